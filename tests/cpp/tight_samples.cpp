#include "tight_samples.hpp"

#include <Eigen/Cholesky>
#include <random>

#include "shape_samples.hpp"
#include "tensegrity/math/sek3.hpp"

namespace tensegrity::tight::test {

struct Samples::State {
  std::mt19937 generator;
  std::normal_distribution<double> normal;
  shape::test::Samples shapes;
};

Samples::Samples(unsigned seed)
    : state_(new State{std::mt19937(seed), {}, shape::test::Samples(seed)}) {}
Samples::~Samples() = default;

double Samples::uniform(double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(state_->generator);
}

double Samples::normal() { return state_->normal(state_->generator); }

VectorXd Samples::normal(int size, double sigma) {
  return VectorXd::NullaryExpr(size, [&] { return sigma * normal(); });
}

V3 Samples::vector(double sigma) { return normal(3, sigma); }

B Samples::belief(const Prism<double>& robot) {
  B belief(robot);
  belief.rotation = SO3<double>::Exp(vector(1.2)).matrix();
  belief.columns.col(0) = vector(0.8);
  belief.columns.col(1) = vector(1.5);
  const Endcaps<double> q = state_->shapes.shape(robot).endcaps();
  for (int i = 2; i < 6; ++i) {
    belief.columns.col(i) = belief.position() + belief.rotation * q.col(i);
    belief.columns.col(i + 4) = vector(0.8);
  }
  belief.gyro_bias = vector(0.02);
  belief.accel_bias = vector(0.1);
  belief.offsets = normal(9, 0.005);
  belief.ground = V3(0.1, 0.2, 0.2).cwiseProduct(vector(1));
  belief.rate = vector(2);
  belief.covariance = covariance(0.05);
  return belief;
}

B::Covariance Samples::covariance(double scale) {
  const MatrixXd root = MatrixXd::NullaryExpr(kStates, kStates, [&] { return normal(); });
  B::Covariance p = B::Covariance::Zero();
  p.topLeftCorner<kStates, kStates>() =
      scale * scale *
      (MatrixXd::Identity(kStates, kStates) + root.lazyProduct(root.transpose()) / kStates);
  return p;
}

B perturbed(const B& belief, const VectorXd& e) {
  B moved = belief;
  moved.retract(-e);
  return moved;
}

VectorXd difference(const B& a, const B& b) {
  using Group = SEk3<double, B::kColumns>;
  const Group::Tangent xi =
      (Group(a.rotation, a.columns) * Group(b.rotation, b.columns).inverse()).Log();
  VectorXd e = VectorXd::Zero(B::Dim);
  e.segment<3>(B::kRotation) = xi.head<3>();
  for (int c = 0; c < B::kColumns; ++c) {
    e.segment<3>(B::column_index(c)) = xi.segment<3>(3 + 3 * c);
  }
  e.segment<3>(B::kGyroBias) = a.gyro_bias - b.gyro_bias;
  e.segment<3>(B::kAccelBias) = a.accel_bias - b.accel_bias;
  e.segment<9>(B::kOffsets) = a.offsets - b.offsets;
  e.segment<3>(B::kGround) = a.ground - b.ground;
  return e;
}

MatrixXd derivative(const B& belief, const std::function<VectorXd(const B&)>& f) {
  constexpr double kStep = 1e-5;
  MatrixXd jacobian = MatrixXd::Zero(f(belief).size(), B::Dim);
  for (int k = 0; k < kStates; ++k) {
    const VectorXd step = kStep * VectorXd::Unit(B::Dim, k);
    jacobian.col(k) = (f(perturbed(belief, step)) - f(perturbed(belief, -step))) / (2 * kStep);
  }
  return jacobian;
}

B dense_update(const B& belief, const MatrixXd& h, const VectorXd& z, const VectorXd& variances) {
  const MatrixXd p = belief.complete_covariance();
  const MatrixXd hp = h * p;
  MatrixXd s = hp * h.transpose();
  s.diagonal() += variances;
  const Eigen::LLT<MatrixXd> llt(s);
  B updated = belief;
  updated.covariance = p - hp.transpose() * llt.solve(hp);
  updated.retract(hp.transpose() * llt.solve(z));
  return updated;
}

MatrixXd sandwich(const MatrixXd& f, const MatrixXd& p, const MatrixXd& q) {
  return f * p * f.transpose() + q;
}

bool symmetric(const B& belief) {
  const auto p = belief.covariance.topLeftCorner<B::kComplete, B::kComplete>();
  return p == p.transpose();
}

MatrixXd information(const B& belief) {
  const MatrixXd p = belief.complete_covariance().topLeftCorner<kStates, kStates>();
  return Eigen::LLT<MatrixXd>(p).solve(MatrixXd::Identity(kStates, kStates));
}

double distance(const MatrixXd& a, const MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.diagonal().maxCoeff();
}

}  // namespace tensegrity::tight::test
