// Cable lengths -> endcaps by nonlinear least squares (T eq. 15a), in real time.
//
// Minimises the sum of squared length residuals over the ten tangent unknowns of `Rods`; rod
// lengths and the base rod are met by construction. Newton's method with the exact Hessian where
// that is positive definite, else Gauss-Newton, both with Levenberg-Marquardt damping: close to the
// fold (fold.hpp) noisy lengths often have no exact solution, and there Gauss-Newton alone does not
// converge. The spin about z is held by a unit stiffness and removed by the Procrustes gauge.
//
// Chirality (constraints.hpp) is not a constraint of the iteration but checked at its end: a
// mirrored shape is reflected, a shape with crossed rods is started anew.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "tensegrity/math/ldlt.hpp"
#include "tensegrity/robot/prism.hpp"
#include "tensegrity/shape/cables.hpp"
#include "tensegrity/shape/constraints.hpp"
#include "tensegrity/shape/fold.hpp"
#include "tensegrity/shape/gauge.hpp"
#include "tensegrity/shape/length_residuals.hpp"
#include "tensegrity/shape/rods.hpp"
#include "tensegrity/shape/starts.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity::shape {

template <typename Scalar>
struct SolverOptions {
  int max_iterations = 50;        // of a solve that starts from the last solution
  int max_cold_iterations = 850;  // of one that does not, over all its starts
  // Length of the last tangent step [m].
  Scalar tolerance = std::is_same_v<Scalar, float> ? Scalar(1e-5) : Scalar(1e-6);
};

// kOk when every length is finite and a prism could have it, else why not.
template <typename Scalar>
Status check_lengths(const CableLengths<Scalar>& lengths, Scalar rod_length) {
  if (!lengths.allFinite()) return Status::kNotFinite;
  // Two endcaps of a net whose rods all touch are at most three rods apart.
  if ((lengths.array() <= 0).any() || (lengths.array() > 3 * rod_length).any()) {
    return Status::kOutOfRange;
  }
  return Status::kOk;
}

template <typename Scalar>
class Solver {
 public:
  using Options = SolverOptions<Scalar>;

  explicit Solver(const Prism<Scalar>& prism, const Options& options = Options())
      : prism_(prism),
        options_(options),
        reference_(prism.undeformed()),
        rods_(prism, reference_),
        endcaps_(reference_) {}

  // Lengths [m] -> shape. The first call after construction or `reset` starts cold, from a fixed
  // set of shapes, and takes the branch of positive `fold` if the lengths have one there; later
  // calls start from the last solution and stay on its branch.
  //   kOk             solved (read `cost` to judge how well the lengths fit together)
  //   kNotConverged   the iteration limit was reached; the best iterate is kept
  //   kWrongChirality only shapes with crossing rods fit; the shape is unchanged
  //   kNotFinite, kOutOfRange  bad lengths; the shape is unchanged
  Status solve(const CableLengths<Scalar>& lengths) {
    const Status input = check_lengths(lengths, prism_.rod_length);
    if (input != Status::kOk) return input;
    Solution best = warm_ ? minimise(rods_, lengths, options_.max_iterations, newton_) : unsolved();
    Endcaps<Scalar> q = best.rods.endcaps();
    int iterations = best.iterations;
    if (!warm_ || handedness(q, prism_.moment_sign()) != Handedness::kRight) {
      best = solve_cold(lengths, iterations);
      if (best.cost == std::numeric_limits<Scalar>::max()) return Status::kWrongChirality;
      q = best.rods.endcaps();
    }
    rods_ = best.rods;
    const Spin<Scalar> turn = spin(q, reference_);
    rods_.rotate_about_z(turn.cosine, -turn.sine);
    endcaps_ = rods_.endcaps();
    cost_ = best.cost;
    iterations_ = iterations;
    newton_ = best.newton;
    warm_ = true;
    return best.converged ? Status::kOk : Status::kNotConverged;
  }

  // Forgets the last solution: the next `solve` starts cold.
  void reset() {
    rods_ = Rods<Scalar>(prism_, reference_);
    endcaps_ = reference_;
    cost_ = 0;
    iterations_ = 0;
    newton_ = false;
    warm_ = false;
  }

  // Body frame, Procrustes gauge of the undeformed robot [m]; the undeformed robot before the first
  // solution.
  const Endcaps<Scalar>& endcaps() const { return endcaps_; }
  const Rods<Scalar>& rods() const { return rods_; }
  // Sum of squared length residuals, T eq. 15a [m^2].
  Scalar cost() const { return cost_; }
  int iterations() const { return iterations_; }

  // Covariance of the stacked endcaps (18 x 18, Procrustes gauge) [m^2] for independent cable
  // errors of standard deviation `cable_std` [m]: sigma^2 J_p J_p', J_p = D [J; t']^-1 [I; 0].
  //
  // Along the mechanism the linear formula sigma^2 / s^2 has no limit as s goes to zero on the
  // fold, where the error in truth grows with sqrt(sigma). It is replaced by sigma^2 / (s^2 +
  // sqrt(pi/2) |kappa| sigma). On the fold the shape follows kappa x^2 / 2 = n, with n the normal
  // error of the self-stress-weighted lengths; for half of all n there is no solution and the fit
  // stays at x = 0, hence E x^2 = 2 E max(n, 0) / |kappa| = sigma / (sqrt(pi/2) |kappa|), which is
  // the limit of the formula.
  Status covariance(Scalar cable_std, Matrix<Scalar, 18>& out) const {
    TangentMatrix<Scalar> tangent;
    const Status status = tangent_covariance(cable_std, tangent);
    if (used(status)) out = to_endcaps(tangent);
    return status;
  }

  // The same with a prior on the shape: independent errors of standard deviation `prior_std` [m] in
  // every tangent direction, as the previous solution and a bound on the motion since give it.
  Status covariance(Scalar cable_std, Scalar prior_std, Matrix<Scalar, 18>& out) const {
    if (!warm_) return Status::kNotInitialized;
    for (const Scalar value : {cable_std, prior_std}) {
      const Status input = check_std(value);
      if (input != Status::kOk) return input;
    }
    const LengthJacobian<Scalar> jacobian = length_jacobian(rods_);
    // Lazy products: others refer to the heap for operands of more than eight rows and columns.
    TangentMatrix<Scalar> information =
        jacobian.transpose().lazyProduct(jacobian) / (cable_std * cable_std);
    information.diagonal().array() += 1 / (prior_std * prior_std);
    constexpr int kRows = padded(kTangent);
    Ldlt<Scalar, kTangent, kRows> system;
    system.matrix() = information;
    system.set_right(Tangent<Scalar>::Zero());
    system.below().setIdentity();
    if (!system.factor()) return Status::kOutOfRange;  // beyond the range of Scalar
    system.solve_below();
    const TangentMatrix<Scalar> tangent = system.below().template topRows<kTangent>();
    out = to_endcaps(tangent);
    return Status::kOk;
  }

  // Covariance without prior in the tangent of `rods` [m^2], with no uncertainty of the spin.
  Status tangent_covariance(Scalar cable_std, TangentMatrix<Scalar>& out) const {
    if (!warm_) return Status::kNotInitialized;
    const Status input = check_std(cable_std);
    if (input != Status::kOk) return input;
    const FoldAnalysis<Scalar> analysis = analyse_fold(rods_);
    const Scalar sqrt_half_pi = Scalar(1.2533141373155003);
    Vector<Scalar, 9> squared = analysis.singular_values.cwiseAbs2();
    squared[8] += sqrt_half_pi * std::abs(analysis.curvature) * cable_std;
    const Vector<Scalar, 9> variances = cable_std * cable_std * squared.cwiseInverse();
    const Matrix<Scalar, kTangent, 9> spread = analysis.motions * variances.asDiagonal();
    out = spread.lazyProduct(analysis.motions.transpose());
    return Status::kOk;
  }

 private:
  struct Solution {
    Rods<Scalar> rods;
    Scalar cost;
    int iterations;
    bool converged;
    bool newton;  // the last steps needed second derivatives
  };

  Solution unsolved() const { return {rods_, std::numeric_limits<Scalar>::max(), 0, false, false}; }

  static Status check_std(Scalar value) {
    if (!std::isfinite(value)) return Status::kNotFinite;
    return value > 0 ? Status::kOk : Status::kOutOfRange;
  }

  // Of nine residuals that are zero but for rounding [m^2].
  Scalar rounding_cost() const {
    const Scalar rounding = 4 * std::numeric_limits<Scalar>::epsilon() * prism_.rod_length;
    return 9 * rounding * rounding;
  }

  // Two minima whose costs differ by less are equally good [m^2].
  Scalar same_cost() const {
    const Scalar residual = Scalar(1e-6) * prism_.rod_length;
    return 9 * residual * residual;
  }

  // One descent from `start` to a local minimum in at most `limit` iterations. `newton`: take
  // second derivatives from the start.
  TENSEGRITY_FLATTEN Solution minimise(const Rods<Scalar>& start,
                                       const CableLengths<Scalar>& lengths, int limit,
                                       bool newton = false) const {
    const Scalar initial_damping = Scalar(1e-3);
    // Beyond this no second-order model of the lengths holds.
    const Scalar max_step = Scalar(0.3) * prism_.rod_length;
    LengthResiduals<Scalar> residuals(start, lengths);
    Solution now{start, residuals.cost(), 0, false, newton};
    Scalar damping = 0;
    while (now.iterations < limit) {
      ++now.iterations;
      Ldlt<Scalar, kTangent> system;
      const auto model = [&](bool second_order) {
        residuals.equations(now.rods, second_order, system.columns());
        for (int k = 0; damping > 0 && k < kTangent; ++k) system.column(k)[k] += damping;
        return system.factor();
      };
      if (!model(now.newton)) {  // not a minimum of the second-order model
        damping = std::max(damping, initial_damping);
        model(false);
      }
      Tangent<Scalar> step = -system.solve();
      const Scalar length = step.norm();
      if (!std::isfinite(length)) {
        damping = std::max(10 * damping, initial_damping);
        continue;
      }
      if (length > max_step) step *= max_step / length;
      Rods<Scalar> trial = now.rods;
      trial.retract(step);
      const LengthResiduals<Scalar> trial_residuals(trial, lengths);
      const Scalar trial_cost = trial_residuals.cost();
      now.newton = wants_newton(trial_cost, now.cost);
      const bool taken = trial_cost < now.cost;
      if (taken) {
        now.rods = trial;
        now.cost = trial_cost;
        residuals = trial_residuals;
        damping = damping > initial_damping / 100 ? damping / 10 : Scalar(0);
      } else {
        damping = std::max(10 * damping, initial_damping);
      }
      if (length < options_.tolerance || now.cost < rounding_cost()) {
        now.converged = true;
        break;
      }
      if (taken && damping == 0 && finish(now, system, residuals, lengths, length)) break;
    }
    return now;
  }

  // After a step of `length`: so close that the same factors may do for the last one. It shrinks
  // the error as it is shorter than the step before, and leaves less than a thousandth of the
  // tolerance. False: it would not, and `now` is as it was.
  bool finish(Solution& now, Ldlt<Scalar, kTangent>& system,
              const LengthResiduals<Scalar>& residuals, const CableLengths<Scalar>& lengths,
              Scalar length) const {
    if (!(length * length < options_.tolerance * prism_.rod_length / 10)) return false;
    const Tangent<Scalar> step = -system.solve(residuals.gradient(now.rods));
    if (!(step.squaredNorm() < options_.tolerance / 1000 * length)) return false;
    Rods<Scalar> last = now.rods;
    last.retract(step);
    const Scalar cost = LengthResiduals<Scalar>(last, lengths).cost();
    if (!(cost <= now.cost)) return false;
    now.newton = wants_newton(cost, now.cost);
    now.rods = last;
    now.cost = cost;
    now.converged = true;
    return true;
  }

  // Gauss-Newton as long as that makes much progress.
  static bool wants_newton(Scalar cost, Scalar before) { return cost > Scalar(0.1) * before; }

  // No single start may use up what the others need.
  static int start_limit(int limit, int iterations) {
    constexpr int kPerStart = 50;
    return std::min(limit - iterations, kPerStart);
  }

  // Best of the fixed starts that ends in a shape without crossing rods; among equally good ones
  // the first on the branch of positive fold. One start suffices for nearly all shapes.
  Solution solve_cold(const CableLengths<Scalar>& lengths, int& iterations) const {
    // A cost as from independent errors of 1 % of a rod is no reason to look for a better minimum.
    const Scalar good_cost = 9 * Scalar(1e-4) * prism_.rod_length * prism_.rod_length;
    // Lengths that have no solution are fitted best on the fold itself, on neither side of it.
    const Scalar on_fold = Scalar(-0.01);
    const Scalar sign = prism_.moment_sign();
    Solution best = unsolved();
    bool best_is_positive = false;
    const int limit = iterations + options_.max_cold_iterations;
    for (int k = 0; k < kColdStarts && iterations < limit; ++k) {
      Solution candidate = minimise(cold_start(prism_, k), lengths, start_limit(limit, iterations));
      iterations += candidate.iterations;
      Handedness hand = handedness(candidate.rods.endcaps(), sign);
      if (hand == Handedness::kMirrored) {
        candidate.rods.reflect();
        hand = Handedness::kRight;
      }
      if (hand != Handedness::kRight) continue;
      candidate = to_positive_fold(candidate, lengths, limit, iterations);
      const bool is_positive = fold(candidate.rods, sign) > on_fold;
      const bool better = candidate.cost < best.cost - same_cost();
      const bool as_good = candidate.cost < best.cost + same_cost();
      if (better || (as_good && is_positive && !best_is_positive)) {
        best = candidate;
        best_is_positive = is_positive;
      }
      if (best_is_positive && best.cost < good_cost) break;
    }
    return best;
  }

  // Crosses the fold from the branch of larger twist, if that is possible at no higher cost.
  Solution to_positive_fold(const Solution& solution, const CableLengths<Scalar>& lengths,
                            int limit, int& iterations) const {
    const Scalar sign = prism_.moment_sign();
    if (fold(solution.rods, sign) >= 0) return solution;
    Rods<Scalar> across = solution.rods;
    across.retract(across_fold(solution.rods, lengths));
    const Solution other = minimise(across, lengths, start_limit(limit, iterations));
    iterations += other.iterations;
    const bool as_good = other.cost < solution.cost + same_cost();
    const bool valid = handedness(other.rods.endcaps(), sign) == Handedness::kRight;
    return as_good && valid && fold(other.rods, sign) > 0 ? other : solution;
  }

  // To where along the mechanism the lengths are the same again: they change as s x + kappa x^2 /
  // 2, with s its singular value and kappa the curvature of `analyse_fold`. Zero on the fold
  // itself.
  //
  // The mechanism is found by inverse iteration on J' J: a start for `minimise` needs no more, and
  // a decomposition takes longer than all of a solve.
  Tangent<Scalar> across_fold(const Rods<Scalar>& rods, const CableLengths<Scalar>& lengths) const {
    constexpr int kMaxIterations = 10;
    constexpr Scalar kSettled = Scalar(1e-4);  // squared change of a unit vector
    // Singular values below its root are as good as zero; positive definite on the fold as well.
    constexpr Scalar kShift = Scalar(1e-5);
    const Scalar farthest = Scalar(0.2) * prism_.rod_length;
    Ldlt<Scalar, kTangent> system;
    LengthResiduals<Scalar>(rods, lengths).equations(rods, false, system.columns());
    for (int k = 0; k < kTangent; ++k) system.column(k)[k] += kShift;
    if (!system.factor()) return Tangent<Scalar>::Zero();
    Tangent<Scalar> mechanism = Tangent<Scalar>::Ones().normalized();
    for (int k = 0; k < kMaxIterations; ++k) {
      const Tangent<Scalar> before = mechanism;
      mechanism = system.solve(before).normalized();
      if ((mechanism - before).squaredNorm() < kSettled) break;
    }
    const Vector<Scalar, 9> stretch = length_jacobian(rods).lazyProduct(mechanism);  // s u
    const Scalar squared = stretch.squaredNorm();
    const Matrix<Scalar, kTangent, 9> stretched = mechanism * stretch.transpose();
    const Scalar curvature = mechanism.dot(length_hessian_products(rods, stretched));  // s kappa
    if (!(std::abs(curvature) > 0)) return Tangent<Scalar>::Zero();
    return std::clamp(-2 * squared / curvature, -farthest, farthest) * mechanism;
  }

  Matrix<Scalar, 18> to_endcaps(const TangentMatrix<Scalar>& tangent) const {
    return endcap_covariance(rods_, tangent, reference_);
  }

  Prism<Scalar> prism_;
  Options options_;
  Endcaps<Scalar> reference_;  // the undeformed robot
  Rods<Scalar> rods_;
  Endcaps<Scalar> endcaps_;
  Scalar cost_ = 0;
  int iterations_ = 0;
  bool newton_ = false;  // the last solution is near the fold: so will the next one be
  bool warm_ = false;
};

}  // namespace tensegrity::shape
