// Which endcaps carry load, from their estimated positions alone.
//
// The prism stands on two or three endcaps, and these are among its three lowest. Height cannot say
// which of the three: when the robot rolls over an edge, the endcap that loses its load is still
// within centimetres of the ground, about the error of an estimated height. Its share of the
// weight (load_share.hpp) can. Per endcap:
//
//   logit p(loaded | geometry) = intercept[rank] + height_weight h / L + share_weight s
//
// with h the height above the lowest endcap, L the rod length and s the share, which is the least
// one for endcaps higher than the three (these have the third's intercept). Contact is a two-state
// Markov process with rates in 1/s; the geometry's evidence is added to the predicted log odds,
// weighted by the part of it that is new. Errors of the estimated positions persist for about
// `evidence_time`, so that a sample after dt adds 1 - exp(-dt / evidence_time) of what an
// independent one would: the decision does not depend on the rate of the cable sensors.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "tensegrity/contact/load_share.hpp"
#include "tensegrity/robot/prism.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity::contact {

// The defaults have the greatest likelihood over simulated rolling of the robot of T, with the
// endcaps perturbed as an estimator perturbs them (25 mm and 1 deg, correlated in time).
// benchmarks/contact_tuning.py finds them and says how good they are; repeat it for a robot whose
// size or estimation error is quite another.
template <typename Scalar>
struct DetectorParameters {
  std::array<Scalar, 3> intercept{{Scalar(-5.6), Scalar(-1.2), Scalar(-0.9)}};  // by rank
  Scalar height_weight = Scalar(-217);                                          // per rod length
  Scalar share_weight = Scalar(75);
  Scalar touch_down_rate = Scalar(0.44);  // [1/s]
  Scalar lift_off_rate = Scalar(2.8);     // [1/s]
  Scalar evidence_time = Scalar(0.19);    // [s]
};

template <typename Scalar>
class Detector {
 public:
  using Flags = std::array<bool, 6>;
  using Probabilities = std::array<Scalar, 6>;

  explicit Detector(const Prism<Scalar>& robot, const DetectorParameters<Scalar>& parameters = {})
      : rod_length_(robot.rod_length), parameters_(parameters) {
    reset();
  }

  // Forgets everything: the next update decides from its geometry alone.
  void reset() {
    fresh_ = true;
    probability_.fill(stationary());
    loaded_.fill(false);
  }

  // `world`: endcap centres in any frame with z up [m]; `dt`: time since the last update [s].
  // Input that is not finite, or a negative dt, keeps the last decision.
  const Flags& update(const Endcaps<Scalar>& world, Scalar dt) {
    if (!world.allFinite() || !(dt >= 0)) return loaded_;
    const Probabilities geometry = evidence(world);
    const bool overflow = !std::all_of(geometry.begin(), geometry.end(),
                                       [](Scalar logit) { return std::isfinite(logit); });
    if (overflow) return loaded_;
    const Scalar rate = parameters_.touch_down_rate + parameters_.lift_off_rate;
    const Scalar memory = std::exp(-rate * dt);
    const Scalar news = fresh_ ? Scalar(1) : 1 - std::exp(-dt / parameters_.evidence_time);
    for (std::size_t i = 0; i < probability_.size(); ++i) {
      const Scalar predicted = stationary() + (probability_[i] - stationary()) * memory;
      probability_[i] = sigmoid(logit(predicted) + news * (geometry[i] - logit(stationary())));
      loaded_[i] = probability_[i] > Scalar(0.5);
    }
    fresh_ = false;
    return loaded_;
  }

  // What contact sensors say of every endcap, as log odds of being right [nat]: evidence, not
  // truth. Added to the odds after `update`; ln 9 is a sensor that is wrong in 10 % of its samples.
  const Flags& measure(const Flags& flags, Scalar log_odds) {
    for (std::size_t i = 0; i < probability_.size(); ++i) {
      probability_[i] = sigmoid(logit(probability_[i]) + (flags[i] ? log_odds : -log_odds));
      loaded_[i] = probability_[i] > Scalar(0.5);
    }
    return loaded_;
  }

  const Flags& loaded() const { return loaded_; }
  // Of being loaded, after the last update; before the first one the long-term mean.
  const Probabilities& probability() const { return probability_; }

 private:
  // Log odds of "loaded" from one geometry, without history. Not finite where products overflow.
  Probabilities evidence(const Endcaps<Scalar>& world) const {
    const std::array<int, 6> order = lowest_first(world);
    const Vector3<Scalar> share = load_share(world, order);
    const Scalar lowest = world(2, order[0]);
    Probabilities result;
    for (std::size_t rank = 0; rank < order.size(); ++rank) {
      const Scalar height = (world(2, order[rank]) - lowest) / rod_length_;
      const Scalar odds =
          parameters_.intercept[std::min<std::size_t>(rank, 2)] +
          parameters_.height_weight * height +
          parameters_.share_weight * (rank < 3 ? bounded(share[Eigen::Index(rank)]) : kLeastShare);
      result[std::size_t(order[rank])] = odds < -kSurest  ? -kSurest
                                         : odds > kSurest ? kSurest
                                                          : odds;  // NaN stays
    }
    return result;
  }

  // Beyond these a share says no more: it comes from a triangle that is nearly a line. NaN stays.
  static constexpr Scalar kLeastShare = Scalar(-0.5);
  static constexpr Scalar kGreatestShare = Scalar(1);
  static Scalar bounded(Scalar share) {
    return share < kLeastShare ? kLeastShare : share > kGreatestShare ? kGreatestShare : share;
  }

  // The geometry is an estimate, and may be that of another robot altogether when the estimator has
  // lost this one: sensors have to be able to outvote it.
  static constexpr Scalar kSurest = Scalar(4);

  Scalar stationary() const {
    return parameters_.touch_down_rate / (parameters_.touch_down_rate + parameters_.lift_off_rate);
  }

  static Scalar logit(Scalar p) { return std::log(p / (1 - p)); }

  // Held off 0 and 1 so that no certainty is ever beyond revision, in float as in double.
  static Scalar sigmoid(Scalar x) {
    const Scalar p = 1 / (1 + std::exp(-x));
    return std::min(std::max(p, Scalar(1e-6)), Scalar(1 - 1e-6));
  }

  Scalar rod_length_;
  DetectorParameters<Scalar> parameters_;
  Probabilities probability_;
  Flags loaded_;
  bool fresh_ = true;
};

}  // namespace tensegrity::contact
