// The shape over time: an extended Kalman filter on the ten tangent unknowns of `Rods`.
//
// Close to the fold (fold.hpp) nine noisy lengths leave the shape uncertain by centimetres along
// the mechanism and ambiguous between two branches. What one sample cannot tell the previous ones
// can: the shape follows a random walk whose step the caller gives, and a soft one-sided prior
// keeps it on the branch of positive `fold`, where a robot that is loaded by gravity stays but for
// moments.
//
// The spin about z is in no measurement; shape and covariance are moved to the Procrustes gauge
// after every step (gauge.hpp).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "tensegrity/math/ldlt.hpp"
#include "tensegrity/shape/solver.hpp"

namespace tensegrity::shape {

template <typename Scalar>
struct TrackerOptions {
  // A cable is dropped from a sample when its squared innovation exceeds this many variances.
  Scalar gate = 25;
  // A sample in which more cables fail is dropped as a whole.
  int max_dropped = 3;
  // After so many dropped samples in a row the tracker itself is wrong, and starts again.
  int max_rejections = 10;
  // Soft prior: where `fold` is below the threshold, it is measured to be there, with this standard
  // deviation. Zero switches it off.
  Scalar fold_threshold = Scalar(0.1);
  Scalar fold_std = Scalar(0.1);
};

template <typename Scalar>
class Tracker {
 public:
  using Options = TrackerOptions<Scalar>;

  explicit Tracker(const Prism<Scalar>& prism, const Options& options = Options())
      : prism_(prism),
        options_(options),
        reference_(prism.undeformed()),
        solver_(prism),
        rods_(prism, reference_),
        endcaps_(reference_) {}

  // Starts from nine lengths [m] alone, on the branch a standing robot takes. `cable_std` [m] gives
  // the initial covariance. Status as `Solver::solve`; on failure nothing changes.
  Status reset(const CableLengths<Scalar>& lengths, Scalar cable_std = Scalar(0.002)) {
    solver_.reset();
    const Status solved = solver_.solve(lengths);
    if (!used(solved)) return solved;
    TangentMatrix<Scalar> covariance;
    const Status spread = solver_.tangent_covariance(cable_std, covariance);
    if (!used(spread)) return spread;
    rods_ = solver_.rods();
    covariance_ = covariance;
    rejections_ = 0;
    initialized_ = true;
    publish();
    return Status::kOk;
  }

  // Lets the shape drift for one step: a random walk of standard deviation `displacement_std` [m]
  // in every tangent direction. About 10 mm per 10 ms while the robot rolls, 0.1 mm while it
  // stands. A value that is negative or not finite is taken for zero.
  void predict(Scalar displacement_std) {
    if (!initialized_ || !(displacement_std > 0)) return;
    // A rod's length is as good as not knowing; the bound also keeps the covariance finite.
    const Scalar limit = prism_.rod_length;
    const Scalar step = std::min(displacement_std, limit);
    covariance_.diagonal().array() += step * step;
    const Scalar largest = covariance_.diagonal().maxCoeff();
    if (largest > limit * limit) covariance_ *= limit * limit / largest;
  }

  // Nine lengths [m] with independent errors of standard deviation `cable_std` [m]. Cables that are
  // not `valid`, not finite, impossible or too far from what is expected are left out.
  //   kOk             at least one cable was used
  //   kRejected       more than `max_dropped` cables, or the shape they lead to, are incredible
  //   kNotFinite, kOutOfRange  no usable length, or a bad `cable_std`
  // Unless kOk is returned, the shape is unchanged.
  Status correct(const CableLengths<Scalar>& lengths, Scalar cable_std,
                 const std::array<bool, 9>& valid = all_valid()) {
    if (!initialized_) return Status::kNotInitialized;
    if (!std::isfinite(cable_std)) return Status::kNotFinite;
    if (!(cable_std > 0)) return Status::kOutOfRange;
    Mask usable{};
    const Status input = select(lengths, valid, usable);
    if (input != Status::kOk) return input;
    if (!gate(lengths, cable_std, usable)) return reject(lengths, cable_std);

    Rods<Scalar> rods = rods_;
    TangentMatrix<Scalar> covariance = covariance_;
    if (!update_lengths(lengths, cable_std, usable, rods, covariance)) {
      return reject(lengths, cable_std);
    }
    update_fold(rods, covariance);
    if (!credible(rods, covariance)) return reject(lengths, cable_std);
    rods_ = rods;
    covariance_ = covariance;
    rejections_ = 0;
    publish();
    return Status::kOk;
  }

  // Body frame, Procrustes gauge of the undeformed robot [m].
  const Endcaps<Scalar>& endcaps() const { return endcaps_; }
  // Of the stacked endcaps in that gauge, 18 x 18 [m^2].
  Matrix<Scalar, 18> covariance() const {
    return endcap_covariance(rods_, covariance_, reference_);
  }
  bool initialized() const { return initialized_; }
  // Side and distance of the fold, see fold.hpp.
  Scalar fold() const { return shape::fold(rods_, prism_.moment_sign()); }

 private:
  using Mask = std::array<bool, 9>;

  static constexpr Mask all_valid() {
    return {true, true, true, true, true, true, true, true, true};
  }

  static constexpr std::size_t index(int k) { return static_cast<std::size_t>(k); }

  // The cables that can be used at all.
  Status select(const CableLengths<Scalar>& lengths, const Mask& valid, Mask& usable) const {
    bool any = false;
    bool finite = true;
    for (int k = 0; k < 9; ++k) {
      const bool is_finite = std::isfinite(lengths[k]);
      const bool possible = lengths[k] > 0 && lengths[k] <= 3 * prism_.rod_length;
      usable[index(k)] = valid[index(k)] && is_finite && possible;
      any = any || usable[index(k)];
      finite = finite && (is_finite || !valid[index(k)]);
    }
    if (any) return Status::kOk;
    return finite ? Status::kOutOfRange : Status::kNotFinite;
  }

  // Drops single wild cables; false when there are too many of them.
  bool gate(const CableLengths<Scalar>& lengths, Scalar cable_std, Mask& usable) const {
    const LengthJacobian<Scalar> jacobian = length_jacobian(rods_);
    const CableLengths<Scalar> innovation = lengths - cable_lengths(rods_.endcaps());
    int dropped = 0;
    for (int k = 0; k < 9; ++k) {
      if (!usable[index(k)]) continue;
      const Scalar variance =
          jacobian.row(k).dot(jacobian.row(k) * covariance_) + cable_std * cable_std;
      if (innovation[k] * innovation[k] > options_.gate * variance) {
        usable[index(k)] = false;
        ++dropped;
      }
    }
    return dropped <= options_.max_dropped;
  }

  // One update with all usable cables at once. Linearised at the prediction on purpose:
  // relinearised at its own result, next to the fold, the update was less accurate and more sure of
  // itself. False if the spread of the lengths has no inverse.
  bool update_lengths(const CableLengths<Scalar>& lengths, Scalar cable_std, const Mask& usable,
                      Rods<Scalar>& rods, TangentMatrix<Scalar>& covariance) const {
    LengthJacobian<Scalar> jacobian = length_jacobian(rods);
    CableLengths<Scalar> innovation = lengths - cable_lengths(rods.endcaps());
    for (int k = 0; k < 9; ++k) {
      // A row of zeros is a measurement that says nothing: the size stays fixed.
      if (usable[index(k)]) continue;
      jacobian.row(k).setZero();
      innovation[k] = 0;
    }
    const Scalar variance = cable_std * cable_std;
    // Lazy products: others refer to the heap for operands of more than eight rows and columns.
    const LengthJacobian<Scalar> cross = jacobian.lazyProduct(covariance);
    Ldlt<Scalar, 9, padded(kTangent)> system;
    system.matrix() = cross.lazyProduct(jacobian.transpose());
    system.matrix().diagonal().array() += variance;
    system.set_right(Vector<Scalar, 9>::Zero());
    system.below().setZero();
    system.below().template topRows<kTangent>() = cross.transpose();
    if (!system.factor()) return false;
    system.solve_below();
    const Matrix<Scalar, kTangent, 9> gain = system.below().template topRows<kTangent>();
    rods.retract(gain * innovation);
    // Joseph's form (I - K J) P (I - K J)' + K R K' stays positive semi-definite under rounding.
    const TangentMatrix<Scalar> keep =
        TangentMatrix<Scalar>::Identity() - gain.lazyProduct(jacobian);
    const TangentMatrix<Scalar> kept = keep.lazyProduct(covariance);
    const TangentMatrix<Scalar> updated =
        kept.lazyProduct(keep.transpose()) + variance * gain.lazyProduct(gain.transpose());
    covariance = (updated + updated.transpose()) / 2;
    return true;
  }

  // The soft one-sided prior. It moves the shape but does not claim to have measured it: what the
  // prior says at one sample it says again at the next, and counting it as independent evidence
  // would make the covariance too small.
  void update_fold(Rods<Scalar>& rods, const TangentMatrix<Scalar>& covariance) const {
    if (!(options_.fold_std > 0)) return;
    const Fold<Scalar> fold(rods, prism_.moment_sign());
    const Scalar missing = options_.fold_threshold - fold.value();
    if (!(missing > 0)) return;
    const Tangent<Scalar> gradient = fold.gradient();
    const Tangent<Scalar> cross = covariance * gradient;
    const Scalar variance = gradient.dot(cross) + options_.fold_std * options_.fold_std;
    rods.retract(cross * (missing / variance));
  }

  bool credible(const Rods<Scalar>& rods, const TangentMatrix<Scalar>& covariance) const {
    const Endcaps<Scalar> q = rods.endcaps();
    return q.allFinite() && covariance.allFinite() &&
           handedness(q, prism_.moment_sign()) == Handedness::kRight;
  }

  // Either the sample is wrong or the tracker is: a sample is dropped, a tracker that disagrees
  // with many in a row starts again, provided that the lengths fit together.
  Status reject(const CableLengths<Scalar>& lengths, Scalar cable_std) {
    if (++rejections_ < options_.max_rejections) return Status::kRejected;
    solver_.reset();
    const bool fits =
        used(solver_.solve(lengths)) && solver_.cost() <= options_.gate * 9 * cable_std * cable_std;
    return fits ? reset(lengths, cable_std) : Status::kRejected;
  }

  void publish() {
    move_to_procrustes_gauge(rods_, reference_, covariance_);
    endcaps_ = rods_.endcaps();
  }

  Prism<Scalar> prism_;
  Options options_;
  Endcaps<Scalar> reference_;  // the undeformed robot
  Solver<Scalar> solver_;
  Rods<Scalar> rods_;
  TangentMatrix<Scalar> covariance_ = TangentMatrix<Scalar>::Zero();
  Endcaps<Scalar> endcaps_;
  int rejections_ = 0;
  bool initialized_ = false;
};

}  // namespace tensegrity::shape
