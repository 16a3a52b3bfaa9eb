// The shape tracker: accuracy and consistency on its own model, robustness, health, no heap.
#include "tensegrity/shape/tracker.hpp"

#include <doctest/doctest.h>

#include <Eigen/Eigenvalues>
#include <cstdlib>
#include <limits>

#include "allocations.hpp"
#include "shape_samples.hpp"

namespace tensegrity::shape {
namespace {

using test::Samples;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kCableStd = 0.002;
constexpr double kStep = 0.001;  // [m] per sample and tangent direction

// Of dynamic size: the eigenvalues of a fixed 18 x 18 matrix take minutes to compile.
template <typename Scalar>
using DynamicMatrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

// Random walk of a robot that stays on the branch of positive fold, pulled back to its start.
class Walk {
 public:
  Walk(const Prism<double>& prism, unsigned seed) : samples_(seed), truth_(start(prism)) {}

  CableLengths<double> step() {
    Rods<double> next = truth_;
    do {
      next = truth_;
      next.retract(samples_.normal<kTangent>(kStep));
    } while (fold(next, -1.0) < 0.3);
    truth_ = next;
    return measure();
  }
  CableLengths<double> measure() {
    return cable_lengths(truth_.endcaps()) + samples_.normal<9>(kCableStd);
  }
  Endcaps<double> endcaps(const Prism<double>& prism) const {
    return in_procrustes_gauge(truth_.endcaps(), prism.undeformed());
  }
  Samples& samples() { return samples_; }

 private:
  Rods<double> start(const Prism<double>& prism) {
    while (true) {
      const Rods<double> rods = samples_.shape(prism, 0.04);
      if (fold(rods, -1.0) > 0.6) return rods;
    }
  }

  Samples samples_;
  Rods<double> truth_;
};

template <typename Scalar>
void check_health(const Tracker<Scalar>& tracker) {
  const Matrix<Scalar, 18> covariance = tracker.covariance();
  REQUIRE(tracker.endcaps().allFinite());
  REQUIRE(covariance.allFinite());
  CHECK(covariance == covariance.transpose());
  const Eigen::SelfAdjointEigenSolver<DynamicMatrix<Scalar>> eigen(covariance);
  CHECK(eigen.eigenvalues().minCoeff() >
        -100 * std::numeric_limits<Scalar>::epsilon() * (1 + eigen.eigenvalues().maxCoeff()));
  CHECK(handedness(tracker.endcaps(), Scalar(-1)) == Handedness::kRight);
}

TEST_CASE("before the start nothing is corrected") {
  Tracker<double> tracker{Prism<double>{}};
  CHECK_FALSE(tracker.initialized());
  tracker.predict(0.01);
  CHECK(tracker.correct(CableLengths<double>::Ones(), kCableStd) == Status::kNotInitialized);
  CHECK(tracker.reset(CableLengths<double>::Constant(kNaN)) == Status::kNotFinite);
  CHECK_FALSE(tracker.initialized());
}

TEST_CASE_TEMPLATE("a random walk is followed with honest covariance", Scalar, double, float) {
  const Prism<double> prism;
  double normalised = 0;
  double squared = 0;
  int count = 0;
  for (unsigned seed = 50; seed < 58; ++seed) {
    Walk walk(prism, seed);
    Tracker<Scalar> tracker{Prism<Scalar>{}};
    REQUIRE(tracker.reset(walk.measure().cast<Scalar>()) == Status::kOk);
    if ((tracker.endcaps().template cast<double>() - walk.endcaps(prism)).norm() > 0.2) {
      continue;  // noise has put the very first sample on another solution
    }
    for (int k = 0; k < 300; ++k) {
      const CableLengths<double> lengths = walk.step();
      tracker.predict(Scalar(kStep));
      REQUIRE(tracker.correct(lengths.cast<Scalar>(), Scalar(kCableStd)) == Status::kOk);
      if (k < 100) continue;
      const Vector<double, 18> error =
          (tracker.endcaps().template cast<double>() - walk.endcaps(prism)).reshaped();
      const Eigen::SelfAdjointEigenSolver<DynamicMatrix<double>> eigen(
          tracker.covariance().template cast<double>());
      for (int i = 9; i < 18; ++i) {  // the other nine are zero: base rod, rod lengths, spin
        const double component = eigen.eigenvectors().col(i).dot(error);
        normalised += component * component / eigen.eigenvalues()[i];
      }
      squared += error.squaredNorm() / 6;
      ++count;
    }
    check_health(tracker);
  }
  REQUIRE(count > 1000);
  const double nees = normalised / count / 9;
  CHECK(nees > 0.7);
  CHECK(nees < 1.4);
  CHECK(std::sqrt(squared / count) < 0.006);  // m; a single sample gives about 20 mm near the fold
}

TEST_CASE("the one-sided prior pushes a shape up to its threshold, and only below it") {
  const Prism<double> prism;
  const CableLengths<double> lengths = Walk(prism, 59).measure();
  const auto settled = [&](const TrackerOptions<double>& options) {
    Tracker<double> tracker(prism, options);
    REQUIRE(tracker.reset(lengths) == Status::kOk);
    for (int k = 0; k < 20; ++k) {
      tracker.predict(kStep);
      REQUIRE(tracker.correct(lengths, kCableStd) == Status::kOk);
    }
    return tracker.fold();
  };
  TrackerOptions<double> options;
  options.fold_std = 0;
  const double free = settled(options);
  options.fold_std = 0.1;
  options.fold_threshold = free - 0.3;
  CHECK(settled(options) == free);
  options.fold_threshold = free + 0.3;
  const double guarded = settled(options);
  CHECK(guarded > free);
  CHECK(guarded < options.fold_threshold);  // soft: the lengths have their say
}

TEST_CASE("a single wild cable is dropped, a lost one is done without") {
  const Prism<double> prism;
  for (int cable = 0; cable < 9; ++cable) {
    Walk walk(prism, 60);
    Tracker<double> tracker(prism);
    REQUIRE(tracker.reset(walk.measure()) == Status::kOk);
    for (int k = 0; k < 100; ++k) {
      CableLengths<double> lengths = walk.step();
      std::array<bool, 9> valid;
      valid.fill(true);
      if (k % 3 == 0) lengths[cable] += 0.3;
      if (k % 3 == 1) lengths[cable] = kNaN;
      if (k % 3 == 2) {
        valid[static_cast<std::size_t>(cable)] = false;
        lengths[cable] = 0.3;
      }
      tracker.predict(kStep);
      REQUIRE(tracker.correct(lengths, kCableStd, valid) == Status::kOk);
    }
    check_health(tracker);
    CHECK((tracker.endcaps() - walk.endcaps(prism)).norm() < 0.1);
  }
}

TEST_CASE("a wrong tracker starts again, a wrong sample does not disturb a good one") {
  const Prism<double> prism;
  Walk walk(prism, 61);
  Tracker<double> tracker(prism);
  REQUIRE(tracker.reset(walk.measure()) == Status::kOk);
  const Endcaps<double> before = tracker.endcaps();
  CableLengths<double> garbage = walk.measure();
  garbage.array() += 0.2;
  CHECK(tracker.correct(garbage, kCableStd) == Status::kRejected);
  CHECK(tracker.endcaps() == before);

  Walk elsewhere(prism, 62);
  Status status = Status::kRejected;
  int samples = 0;
  for (; status == Status::kRejected && samples < 100; ++samples) {
    tracker.predict(1e-4);
    status = tracker.correct(elsewhere.measure(), kCableStd);
  }
  CHECK(status == Status::kOk);
  CHECK(samples <= TrackerOptions<double>().max_rejections);
  CHECK((cable_lengths(tracker.endcaps()) - cable_lengths(elsewhere.endcaps(prism))).norm() <
        10 * kCableStd);
}

TEST_CASE_TEMPLATE("whatever comes in, state and covariance stay healthy", Scalar, double, float) {
  const Prism<double> prism;
  Walk walk(prism, 63);
  Tracker<Scalar> tracker{Prism<Scalar>{}};
  REQUIRE(tracker.reset(walk.measure().cast<Scalar>()) == Status::kOk);
  const double huge = std::numeric_limits<float>::max();
  const double odd[] = {
      kNaN, huge, -huge, 0, -1, 1e-30, 4.3, 0.01, std::numeric_limits<double>::infinity()};
  for (int k = 0; k < 400; ++k) {
    CableLengths<double> lengths = walk.step();
    const Vector<double, 3> dice = walk.samples().normal<3>(1);
    if (dice[0] > 0.5) lengths[k % 9] = odd[k % 8];
    if (dice[0] < -1) lengths = walk.samples().normal<9>(1).cwiseAbs();
    tracker.predict(Scalar(dice[1] > 1.5 ? odd[k % 9] : std::abs(dice[1]) * 0.01));
    const double cable_std = dice[2] > 1.5 ? odd[k % 9] : kCableStd;
    tracker.correct(lengths.cast<Scalar>(), Scalar(cable_std));
    check_health(tracker);
  }
}

TEST_CASE("statuses say why a correction was not made") {
  const Prism<double> prism;
  Walk walk(prism, 64);
  Tracker<double> tracker(prism);
  const CableLengths<double> lengths = walk.measure();
  REQUIRE(tracker.reset(lengths) == Status::kOk);
  CHECK(tracker.correct(lengths, kNaN) == Status::kNotFinite);
  CHECK(tracker.correct(lengths, 0) == Status::kOutOfRange);
  CHECK(tracker.correct(CableLengths<double>::Constant(kNaN), kCableStd) == Status::kNotFinite);
  CHECK(tracker.correct(CableLengths<double>::Constant(-1), kCableStd) == Status::kOutOfRange);
}

TEST_CASE_TEMPLATE("solving and tracking allocate no memory", Scalar, double, float) {
  const Prism<double> prism;
  Walk walk(prism, 65);
  const CableLengths<Scalar> lengths = walk.measure().cast<Scalar>();
  Solver<Scalar> solver{Prism<Scalar>{}};
  Tracker<Scalar> tracker{Prism<Scalar>{}};
  Matrix<Scalar, 18> covariance;
  const long before = tensegrity::testing::allocations();
  solver.solve(lengths);
  solver.solve(lengths);
  solver.covariance(Scalar(0.002), covariance);
  solver.covariance(Scalar(0.002), Scalar(0.02), covariance);
  fold_gradient(solver.rods(), Scalar(-1));
  tracker.reset(lengths);
  tracker.predict(Scalar(0.001));
  tracker.correct(lengths, Scalar(0.002));
  covariance = tracker.covariance();
  const long counted = tensegrity::testing::allocations() - before;
  CHECK(counted == 0);
  // The counter counts.
  void* volatile block = std::malloc(1);
  std::free(block);
  CHECK(tensegrity::testing::allocations() > before + counted);
}

}  // namespace
}  // namespace tensegrity::shape
