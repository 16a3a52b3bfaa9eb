#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

#include "allocations.hpp"
#include "tensegrity/ranging/calibration.hpp"

namespace {

using tensegrity::ranging::CalibrationProblem;
using tensegrity::ranging::CalibrationRange;
using tensegrity::ranging::CalibrationSolver;
using tensegrity::ranging::CalibrationStatus;
using tensegrity::ranging::CalibrationStrip;
using tensegrity::ranging::LossKind;
using tensegrity::ranging::RobustLoss;

constexpr int kAnchors = 5;
constexpr int kKnots = 7;
constexpr double kOffset = 3.9, kRod = 1.6;  // [m]

// One rod and one single module on their way among five anchors, ranged without any noise.
template <typename Scalar>
struct World {
  CalibrationProblem<Scalar> problem;
  std::vector<Scalar> shared;                  // true shared parameters
  std::vector<std::vector<Scalar>> positions;  // true positions of the strips
};

Eigen::Vector3d anchor_position(int anchor) {
  constexpr double table[kAnchors][3] = {
      {0, 0, 2.1}, {9, 1, 0.9}, {8, 10, 3.4}, {-1, 9, 0.8}, {4, 5, 4.5}};
  return Eigen::Vector3d(table[anchor][0], table[anchor][1], table[anchor][2]);
}

Eigen::Vector3d module_position(int strip, int module, double knot) {
  const Eigen::Vector3d middle(2 + 0.8 * knot, 4 + 2 * std::sin(knot + strip), 0.7 + 0.1 * knot);
  const double turn = 0.9 * knot + strip;
  const Eigen::Vector3d along(std::cos(turn), 0.8 * std::sin(turn), 0.6 * std::sin(turn));
  return middle + (module == 0 ? -0.5 : 0.5) * kRod * along;
}

template <typename Scalar>
World<Scalar> make_world(bool with_motion) {
  World<Scalar> world;
  CalibrationProblem<Scalar>& problem = world.problem;
  problem.anchors = kAnchors;
  problem.offset_terms = 3;
  problem.rod_lengths = 1;
  for (int modules : {2, 1}) {
    CalibrationStrip<Scalar> strip;
    strip.modules = modules;
    strip.knots = kKnots;
    strip.motion_information.assign(kKnots - 1, with_motion ? Scalar(0.5) : Scalar(0));
    strip.rod_length = modules == 2 ? 0 : -1;
    problem.strips.push_back(strip);
    std::vector<Scalar> positions;
    for (int knot = 0; knot < kKnots; ++knot) {
      for (int module = 0; module < modules; ++module) {
        const Eigen::Vector3d p = module_position(2 - modules, module, knot);
        for (int axis = 0; axis < 3; ++axis) positions.push_back(Scalar(p[axis]));
      }
    }
    world.positions.push_back(positions);
  }
  for (int anchor = 0; anchor < kAnchors; ++anchor) {
    for (int axis = 0; axis < 3; ++axis) {
      world.shared.push_back(Scalar(anchor_position(anchor)[axis]));
    }
  }
  for (double term : {kOffset, 0.05, -0.03}) world.shared.push_back(Scalar(term));
  const Eigen::Vector3d rod = module_position(0, 1, 0) - module_position(0, 0, 0);
  world.shared.push_back(Scalar(rod.norm()));
  problem.prior_mean = world.shared;
  problem.prior_information.assign(problem.shared(), Scalar(0));
  // Three anchors are surveyed, the offset of one module is known to be small.
  for (int i = 0; i < 9; ++i) problem.prior_information[i] = Scalar(1e4);
  for (int i = 3 * kAnchors + 1; i < 3 * kAnchors + 3; ++i) {
    problem.prior_information[i] = Scalar(100);
  }
  problem.knot_information = {{Scalar(0), Scalar(0), Scalar(0)}};
  for (int strip = 0; strip < 2; ++strip) {
    const int modules = problem.strips[strip].modules;
    for (int module = 0; module < modules; ++module) {
      for (int knot = 0; knot < kKnots; ++knot) {
        for (int anchor = 0; anchor < kAnchors; ++anchor) {
          for (double blend : {0.0, 0.3}) {
            if (knot + 1 == kKnots && blend > 0) continue;
            CalibrationRange<Scalar> range;
            range.strip = strip;
            range.module = module;
            range.knot = knot;
            range.blend = Scalar(blend);
            range.anchor = anchor;
            range.offset_terms = {{0, strip == 0 ? 1 : -1, anchor == 2 ? 2 : -1, -1}};
            const Eigen::Vector3d p = (1 - blend) * module_position(strip, module, knot) +
                                      blend * module_position(strip, module, knot + 1);
            range.range = Scalar((p - anchor_position(anchor)).norm() + kOffset +
                                 (strip == 0 ? 0.05 : 0) + (anchor == 2 ? -0.03 : 0));
            problem.ranges.push_back(range);
          }
        }
      }
    }
  }
  return world;
}

template <typename Scalar>
void set_truth(const World<Scalar>& world, CalibrationSolver<Scalar>& solver) {
  for (std::size_t i = 0; i < world.shared.size(); ++i) solver.shared()[i] = world.shared[i];
  for (std::size_t s = 0; s < world.positions.size(); ++s) solver.positions(s) = world.positions[s];
}

template <typename Scalar>
void disturb(CalibrationSolver<Scalar>& solver, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, size);
  for (int i = 0; i < solver.shared().size(); ++i) solver.shared()[i] += Scalar(normal(random));
  for (std::size_t s = 0; s < solver.strips(); ++s) {
    for (Scalar& x : solver.positions(s)) x += Scalar(normal(random));
  }
}

// Every unknown as one vector of references: shared parameters, then positions strip by strip.
std::vector<double*> unknowns(CalibrationSolver<double>& solver) {
  std::vector<double*> all;
  for (int i = 0; i < solver.shared().size(); ++i) all.push_back(&solver.shared()[i]);
  for (std::size_t s = 0; s < solver.strips(); ++s) {
    for (double& x : solver.positions(s)) all.push_back(&x);
  }
  return all;
}

}  // namespace

TEST_CASE("a robust loss equals the square near zero and its weight is its slope") {
  for (LossKind kind : {LossKind::kSquares, LossKind::kHuber, LossKind::kCauchy}) {
    const RobustLoss<double> loss{kind, 1.5};
    CHECK(loss.value(1e-8) == doctest::Approx(1e-8));
    for (double squared : {0.01, 1.0, 2.0, 9.0, 400.0}) {
      const double step = 1e-6 * squared;
      const double slope = (loss.value(squared + step) - loss.value(squared - step)) / (2 * step);
      CHECK(loss.weight(squared) == doctest::Approx(slope).epsilon(1e-6));
    }
  }
}

TEST_CASE("gradients of the calibration are those of its cost") {
  const World<double> world = make_world<double>(true);
  for (LossKind kind : {LossKind::kSquares, LossKind::kHuber, LossKind::kCauchy}) {
    const RobustLoss<double> loss{kind, 2.0};
    CalibrationSolver<double> solver(world.problem);
    set_truth(world, solver);
    disturb(solver, 0.2, 7);
    CalibrationSolver<double>::SharedMatrix information;
    REQUIRE(solver.reduced_information(loss, information));
    std::vector<double> gradient(solver.shared_gradient().data(),
                                 solver.shared_gradient().data() + solver.shared().size());
    for (std::size_t s = 0; s < solver.strips(); ++s) {
      gradient.insert(gradient.end(), solver.gradient(s).begin(), solver.gradient(s).end());
    }
    const std::vector<double*> all = unknowns(solver);
    REQUIRE(all.size() == gradient.size());
    constexpr double kStep = 1e-6;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double at = *all[i];
      *all[i] = at + kStep;
      const double above = solver.cost(loss);
      *all[i] = at - kStep;
      const double below = solver.cost(loss);
      *all[i] = at;
      CHECK(gradient[i] == doctest::Approx((above - below) / (2 * kStep)).epsilon(1e-5).scale(10));
    }
  }
}

TEST_CASE("eliminating the knots is the Schur complement of the dense normal equations") {
  // Without noise, motion and rods all residuals are zero, and the Hessian is Gauss and Newton's.
  World<double> world = make_world<double>(false);
  world.problem.strips[0].rod_length = -1;
  const RobustLoss<double> loss{LossKind::kSquares, 1.0};
  CalibrationSolver<double> solver(world.problem);
  set_truth(world, solver);
  CalibrationSolver<double>::SharedMatrix reduced;
  REQUIRE(solver.reduced_information(loss, reduced));

  const std::vector<double*> all = unknowns(solver);
  const int size = static_cast<int>(all.size()), shared = world.problem.shared();
  Eigen::MatrixXd hessian(size, size);
  constexpr double kStep = 1e-5;
  CalibrationSolver<double>::SharedMatrix unused;
  for (int i = 0; i < size; ++i) {
    Eigen::VectorXd slope[2];
    for (int side = 0; side < 2; ++side) {
      const double at = *all[i];
      *all[i] = at + (side == 0 ? kStep : -kStep);
      solver.reduced_information(loss, unused);
      *all[i] = at;
      slope[side].resize(size);
      slope[side].head(shared) = solver.shared_gradient();
      int row = shared;
      for (std::size_t s = 0; s < solver.strips(); ++s) {
        for (double g : solver.gradient(s)) slope[side][row++] = g;
      }
    }
    hessian.col(i) = (slope[0] - slope[1]) / (2 * kStep);
  }
  const int rest = size - shared;
  const Eigen::MatrixXd expected =
      hessian.topLeftCorner(shared, shared) -
      hessian.topRightCorner(shared, rest) * hessian.bottomRightCorner(rest, rest)
                                                 .ldlt()
                                                 .solve(hessian.bottomLeftCorner(rest, shared));
  CHECK((reduced - expected).norm() < 1e-4 * expected.norm());
}

TEST_CASE_TEMPLATE("a calibration without noise is found exactly, from metres away", Scalar, double,
                   float) {
  World<Scalar> world = make_world<Scalar>(false);
  world.problem.strips[0].rod_length = -1;
  const RobustLoss<Scalar> loss{LossKind::kCauchy, Scalar(50)};
  CalibrationSolver<Scalar> solver(world.problem);
  set_truth(world, solver);
  disturb(solver, 0.3, 3);
  const auto report = solver.solve(loss, {200, 1e-12});
  CHECK(report.status != CalibrationStatus::kIterationLimit);
  const double tolerance = std::is_same_v<Scalar, double> ? 1e-5 : 2e-2;
  for (int i = 0; i < 3 * kAnchors + 3; ++i) {
    CHECK(std::abs(double(solver.shared()[i] - world.shared[i])) < tolerance);
  }
}

TEST_CASE("ranges that are far too long hardly matter to a robust loss") {
  World<double> world = make_world<double>(false);
  world.problem.strips[0].rod_length = -1;
  for (std::size_t i = 0; i < world.problem.ranges.size(); i += 11) {
    world.problem.ranges[i].range += 5.0;
  }
  const auto error = [&](LossKind kind) {
    CalibrationSolver<double> solver(world.problem);
    set_truth(world, solver);
    solver.solve({kind, 1.0}, {200, 1e-10});
    double worst = 0;
    for (int i = 0; i < 3 * kAnchors; ++i) {
      worst = std::max(worst, std::abs(solver.shared()[i] - world.shared[i]));
    }
    return worst;
  };
  CHECK(error(LossKind::kCauchy) < 0.02);
  CHECK(error(LossKind::kSquares) > 0.2);
}

TEST_CASE("a rod of known length holds what ranges alone leave open") {
  // The rod's module 1 is never ranged: only rod and motion tell how far it is.
  World<double> world = make_world<double>(true);
  auto& ranges = world.problem.ranges;
  std::vector<CalibrationRange<double>> kept;
  for (const auto& range : ranges) {
    if (range.strip == 1 || range.module == 0) kept.push_back(range);
  }
  ranges = kept;
  world.problem.prior_information.back() = 1e6;
  world.problem.knot_information = {{1e-4, 1e-4, 1e-4}};
  CalibrationSolver<double> solver(world.problem);
  set_truth(world, solver);
  disturb(solver, 0.05, 5);
  solver.solve({LossKind::kSquares, 1.0}, {100, 1e-9});
  const double length = world.shared.back();
  for (int knot = 0; knot < kKnots; ++knot) {
    const double* p = solver.positions(0).data() + 6 * knot;
    const Eigen::Map<const Eigen::Vector3d> first(p), second(p + 3);
    CHECK((second - first).norm() == doctest::Approx(length).epsilon(0.05));
  }
}

TEST_CASE("solving allocates nothing and leaves broken input alone") {
  World<double> world = make_world<double>(true);
  CalibrationSolver<double> solver(world.problem);
  set_truth(world, solver);
  disturb(solver, 0.1, 9);
  const RobustLoss<double> loss{LossKind::kCauchy, 3.0};
  const long allocated = tensegrity::testing::allocations();
  solver.solve(loss);
  CHECK(tensegrity::testing::allocations() == allocated);

  world.problem.ranges[3].range = std::numeric_limits<double>::quiet_NaN();
  CalibrationSolver<double> broken(world.problem);
  set_truth(world, broken);
  const auto before = broken.positions(0);
  CHECK(broken.solve(loss).status == CalibrationStatus::kStuck);
  CHECK(broken.positions(0) == before);
  CHECK(broken.shared().allFinite());
}
