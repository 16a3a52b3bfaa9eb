// Shape alone: nine cable lengths to six endcaps in the body frame, and how certain they are.
#include <cmath>
#include <cstdio>
#include <random>
#include <tensegrity/shape/cables.hpp>
#include <tensegrity/shape/solver.hpp>
#include <tensegrity/shape/tracker.hpp>

int main() {
  constexpr double kCableStd = 0.002;  // of the measured lengths [m]

  const tensegrity::Prism<double> robot;
  tensegrity::CableLengths<double> lengths =
      tensegrity::shape::cable_lengths<double>(robot.undeformed());  // m
  lengths[0] -= 0.03;  // one side cable shorter, another longer
  lengths[4] += 0.05;

  // One sample: least squares.
  tensegrity::shape::Solver<double> solver(robot);
  const tensegrity::Status status = solver.solve(lengths);
  tensegrity::Matrix<double, 18> covariance;  // of the stacked endcaps [m^2]
  if (!used(status) || !used(solver.covariance(kCableStd, covariance))) {
    std::printf("no shape: %s\n", to_string(status));
    return 1;
  }
  std::printf("%s: residuals of %.3f mm\n", to_string(status), 1e3 * std::sqrt(solver.cost()));
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector3d q = solver.endcaps().col(i);
    const double sigma = std::sqrt(covariance.diagonal().segment<3>(3 * i).sum());
    std::printf("endcap %d: %6.3f %6.3f %6.3f m  +- %4.1f mm\n", i, q.x(), q.y(), q.z(),
                1e3 * sigma);
  }

  // A stream of samples: a Kalman filter on the shape. Between samples it may move by 1 mm.
  tensegrity::shape::Tracker<double> tracker(robot);
  if (!used(tracker.reset(lengths, kCableStd))) return 1;
  std::mt19937 generator(0);
  std::normal_distribution<double> noise(0, kCableStd);
  for (int k = 0; k < 100; ++k) {
    tracker.predict(0.001);
    tensegrity::CableLengths<double> sample = lengths;
    for (double& length : sample) length += noise(generator);
    tracker.correct(sample, kCableStd);
  }
  const double error = (tracker.endcaps() - solver.endcaps()).norm() / std::sqrt(6.0);  // m
  std::printf("tracked: %.1f mm from the noiseless shape\n", 1e3 * error);
}
