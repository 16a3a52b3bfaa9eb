// Anchors, range offsets and trajectories from raw ranges (C eqs. 8-9, Caluwaerts et al. 2016):
// Levenberg-Marquardt on the sparse normal equations.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "tensegrity/ranging/calibration_problem.hpp"
#include "tensegrity/ranging/calibration_strip.hpp"
#include "tensegrity/ranging/robust_loss.hpp"

namespace tensegrity::ranging {

struct CalibrationOptions {
  int max_iterations = 60;
  double tolerance = 1e-5;  // relative decrease of the cost at which it has converged
};

enum class CalibrationStatus { kConverged, kIterationLimit, kStuck };

template <typename Scalar>
struct CalibrationReport {
  CalibrationStatus status = CalibrationStatus::kIterationLimit;
  int iterations = 0;
  Scalar cost = 0;  // half the sum of all losses and squared priors
};

// The solver and its state. Nothing is allocated after construction.
template <typename Scalar>
class CalibrationSolver {
 public:
  using Shared = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using SharedMatrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

  // Indices in the problem have to be in range. Shared parameters start at the mean of their
  // prior, positions at zero.
  explicit CalibrationSolver(const CalibrationProblem<Scalar>& problem)
      : shared_(problem.shared()),
        prior_mean_(Eigen::Map<const Shared>(problem.prior_mean.data(), problem.shared())),
        prior_information_(
            Eigen::Map<const Shared>(problem.prior_information.data(), problem.shared())),
        ranges_(problem.ranges.size()),
        trial_(problem.shared()),
        step_(problem.shared()),
        gradient_(problem.shared()),
        reduced_gradient_(problem.shared()),
        information_(problem.shared(), problem.shared()),
        reduced_(problem.shared(), problem.shared()),
        factor_(problem.shared()) {
    shared_ = prior_mean_;
    for (std::size_t i = 0; i < problem.strips.size(); ++i) {
      const int index = static_cast<int>(i);
      if (problem.strips[i].modules == 2) {
        order_.push_back({true, rods_.size()});
        rods_.emplace_back(problem, index);
      } else {
        order_.push_back({false, singles_.size()});
        singles_.emplace_back(problem, index);
      }
    }
  }

  Shared& shared() { return shared_; }
  const Shared& shared() const { return shared_; }
  std::size_t strips() const { return order_.size(); }

  // Positions of a strip: [knot][module][axis] [m].
  std::vector<Scalar>& positions(std::size_t strip) {
    const Place place = order_[strip];
    return place.rod ? rods_[place.index].positions() : singles_[place.index].positions();
  }

  Scalar cost(const RobustLoss<Scalar>& loss) const { return cost(shared_, loss, false); }

  // Minimises the cost from the current state, which is never left for a worse one.
  CalibrationReport<Scalar> solve(const RobustLoss<Scalar>& loss,
                                  const CalibrationOptions& options = {}) {
    CalibrationReport<Scalar> report;
    report.cost = cost(loss);
    Scalar damping = Scalar(1e-4);
    while (report.iterations < options.max_iterations) {
      linearise(loss);
      ++report.iterations;
      Scalar reached = 0;
      bool better = false;
      for (int attempt = 0; attempt < kAttempts && !better; ++attempt) {
        if (step(damping)) {
          reached = cost(trial_, loss, true);
          better = reached <= report.cost;  // false for NaN, too
        }
        if (!better) damping = damping * kWorse;
      }
      if (!better) {
        report.status = CalibrationStatus::kStuck;
        return report;
      }
      shared_.swap(trial_);
      each([](auto& strip) { strip.accept(); });
      const Scalar decrease = report.cost - reached;
      report.cost = reached;
      damping = std::max(damping * kBetter, Scalar(1e-9));
      if (decrease <= Scalar(options.tolerance) * reached) {
        report.status = CalibrationStatus::kConverged;
        return report;
      }
    }
    return report;
  }

  // Information of the shared parameters when the trajectory is unknown: the Schur complement at
  // the current state. False (and garbage) if the trajectory is not determined.
  bool reduced_information(const RobustLoss<Scalar>& loss, SharedMatrix& out) {
    linearise(loss);
    reduced_gradient_ = gradient_;
    reduced_ = information_;
    bool good = true;
    each([&](auto& strip) {
      good = good && strip.eliminate(Scalar(0), reduced_, reduced_gradient_);
    });
    out = reduced_;
    return good;
  }

  // Gradient of the cost by the shared parameters and by the positions of a strip at the current
  // state, as of the last solve() or reduced_information().
  const Shared& shared_gradient() const { return gradient_; }
  const std::vector<Scalar>& gradient(std::size_t strip) const {
    const Place place = order_[strip];
    return place.rod ? rods_[place.index].gradient() : singles_[place.index].gradient();
  }

  // Whitened residuals (predicted minus measured) in the order of the problem's ranges.
  void residuals(std::vector<Scalar>& out) const {
    each([&](const auto& strip) { strip.residuals(shared_, out); });
  }

  std::size_t ranges() const { return ranges_; }

 private:
  struct Place {
    bool rod;
    std::size_t index;
  };

  static constexpr int kAttempts = 25;
  static constexpr Scalar kWorse = Scalar(5);
  static constexpr Scalar kBetter = Scalar(0.2);

  template <typename Function>
  void each(Function&& function) {
    for (auto& strip : rods_) function(strip);
    for (auto& strip : singles_) function(strip);
  }
  template <typename Function>
  void each(Function&& function) const {
    for (const auto& strip : rods_) function(strip);
    for (const auto& strip : singles_) function(strip);
  }

  Scalar cost(const Shared& shared, const RobustLoss<Scalar>& loss, bool at_trial) const {
    Scalar sum = 0;
    each([&](const auto& strip) { sum += strip.cost(shared, loss, at_trial); });
    for (int i = 0; i < shared.size(); ++i) {
      const Scalar error = shared[i] - prior_mean_[i];
      sum += prior_information_[i] * error * error / 2;
    }
    return sum;
  }

  void linearise(const RobustLoss<Scalar>& loss) {
    each([&](auto& strip) { strip.linearise(shared_, loss); });
    information_.setZero();
    for (int i = 0; i < shared_.size(); ++i) {
      information_(i, i) = prior_information_[i];
      gradient_[i] = prior_information_[i] * (shared_[i] - prior_mean_[i]);
    }
    each([&](const auto& strip) { strip.add_shared(information_, gradient_); });
  }

  // Makes the trial; false when the damped equations are not positive definite.
  bool step(Scalar damping) {
    reduced_ = information_;
    reduced_gradient_ = gradient_;
    // The constant keeps parameters that nothing depends on where they are.
    for (int i = 0; i < shared_.size(); ++i) reduced_(i, i) += damping * (information_(i, i) + 1);
    bool good = true;
    each(
        [&](auto& strip) { good = good && strip.eliminate(damping, reduced_, reduced_gradient_); });
    if (!good) return false;
    factor_.compute(reduced_);
    if (factor_.info() != Eigen::Success) return false;
    step_ = -reduced_gradient_;
    factor_.solveInPlace(step_);
    trial_ = shared_ + step_;
    each([&](auto& strip) { strip.substitute(step_); });
    return true;
  }

  Shared shared_, prior_mean_, prior_information_;
  std::size_t ranges_;
  Shared trial_, step_, gradient_, reduced_gradient_;
  SharedMatrix information_, reduced_;
  Eigen::LLT<SharedMatrix> factor_;
  std::vector<CalibrationStripSolver<Scalar, 2>> rods_;
  std::vector<CalibrationStripSolver<Scalar, 1>> singles_;
  std::vector<Place> order_;
};

}  // namespace tensegrity::ranging
