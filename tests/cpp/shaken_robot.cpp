#include "shaken_robot.hpp"

#include <Eigen/Eigenvalues>

namespace tensegrity::test {

void check_covariance(const Eigen::MatrixXd& p, double epsilon) {
  CHECK((p - p.transpose()).norm() <= epsilon * p.norm());
  CHECK(p.diagonal().minCoeff() >= 0);
  const Eigen::VectorXd scale =
      p.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * p * scale.asDiagonal();
  const double smallest =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation).eigenvalues().minCoeff();
  CHECK(smallest > -1e3 * epsilon);
}

}  // namespace tensegrity::test
