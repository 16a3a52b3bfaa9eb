// The tightly coupled filter: cables, feet and IMU correct one state that holds pose, velocity,
// biases, the other rods' endcaps and their velocities, the cables' offsets and the ground.
//
//   IMU ─────> propagate ──> endcaps ──> which of them carry load? <── contact flags (evidence)
//                 │                              │ shares of the weight
//   cables ──> lengths + rods ──> fold        feet: friction, height above the ground
//                 │                              │
//                 └──────────> one right-invariant belief <──────────┘
//
// Cable lengths are direct measurements, so that the velocity of every endcap is known well enough
// to tell feet that stand from feet that slide (tight/friction.hpp).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tensegrity/contact/detector.hpp"
#include "tensegrity/estimator/activity.hpp"
#include "tensegrity/estimator/config.hpp"
#include "tensegrity/estimator/pending.hpp"
#include "tensegrity/estimator/prism_state.hpp"
#include "tensegrity/estimator/spin_start.hpp"
#include "tensegrity/estimator/static_start.hpp"
#include "tensegrity/shape/solver.hpp"
#include "tensegrity/tight/flat_ground.hpp"
#include "tensegrity/tight/friction.hpp"
#include "tensegrity/tight/members.hpp"
#include "tensegrity/tight/place.hpp"
#include "tensegrity/tight/propagate.hpp"
#include "tensegrity/tight/rod_imu.hpp"

namespace tensegrity {

template <typename Scalar_ = double>
class TightFilter {
 public:
  using Scalar = Scalar_;
  using Belief = tight::Belief<Scalar>;
  using V3 = Vector3<Scalar>;
  using Flags = std::array<bool, 6>;

  TightFilter(const Prism<Scalar>& robot, const PrismConfig<Scalar>& config)
      : robot_(robot),
        config_(config),
        reference_(robot.undeformed()),
        solver_(robot),
        detector_(robot, detector_parameters()),
        flag_odds_(std::log((1 - config.contact_error) / config.contact_error)),
        activity_(config.active_force, config.active_rate),
        belief_(robot) {}

  // ---- one step: propagate, with `correct_cables` in between where there are lengths, end_step

  void observe_motion(const inekf::ImuSample<Scalar>& imu, Scalar dt) {
    activity_.update(imu.gyro - belief_.gyro_bias, imu.accel - belief_.accel_bias, config_.gravity,
                     dt);
  }

  void propagate(const inekf::ImuSample<Scalar>& imu, Scalar dt, Scalar gyro_std,
                 Scalar accel_std) {
    const bool unknown = config_.terrain == Terrain::kUnknown;
    const Scalar moving = activity_.level();
    const tight::ProcessNoise<Scalar> noise{
        gyro_std,
        accel_std,
        config_.gyroscope_bias_walk,
        config_.accelerometer_bias_walk,
        config_.endcap_acceleration_rest +
            moving * (config_.endcap_acceleration_moving - config_.endcap_acceleration_rest),
        unknown ? moving * config_.ground_height_walk : Scalar(0),
        unknown ? moving * config_.ground_slope_walk : Scalar(0)};
    tight::propagate(belief_, imu, dt, config_.gravity, noise);
  }

  // Lengths [m], NaN where a cable was not measured.
  Status correct_cables(Nanoseconds, const CableLengths<Scalar>& lengths, PrismHealth& health) {
    // With a cable missing there is no redundancy left to tell a wrong sensor from a wrong shape.
    complete_ = lengths.allFinite() ? std::min(complete_ + 1, kCompleteSamples) : 0;
    const Scalar gate = complete_ > 0 ? square(config_.cable_gate) : Scalar(0);
    tight::CableResult<Scalar> result;
    {
      tight::SequentialUpdate<Scalar> update(belief_);
      result = tight::correct_cables(update, belief_, lengths, config_.cable_std, gate);
    }
    hold_rods();
    if (++cable_samples_ % kFoldEvery == 0) {
      tight::hold_fold(belief_, robot_, kFoldThreshold, kFoldStd);
    }
    health.cables_rejected += std::uint32_t(result.rejected);
    if (result.accepted > 0) cable_nis_ = result.chi_square / Scalar(result.accepted);
    return result.accepted > 0 ? Status::kOk : Status::kRejected;
  }

  void set_contacts(const Flags& flags) {
    flags_ = flags;
    flags_are_new_ = true;
  }

  // An IMU on rod 1 (r23) or 2 (r45), z toward its even endcap. Used at the end of the step.
  void set_rod_imu(int rod, const V3& gyro, const V3& accel) {
    RodImu& imu = rod_imus_[std::size_t(rod - 1)];
    imu.gyro = gyro;
    imu.accel = accel;
    imu.fresh = true;
    if (!started_) {  // the robot stands still: this is the bias
      ++imu.still;
      imu.bias += (gyro - imu.bias) / Scalar(imu.still);
    }
  }
  // The still window was given up.
  void forget_still() {
    for (RodImu& imu : rod_imus_) imu.still = 0;
  }

  // The feet, once all measurements of the step are in.
  void end_step(Scalar dt, PrismHealth& health) {
    correct_rods();
    // Heights above the plane decide which endcaps are feet, the vertical how they share the
    // weight: the plane is sheared level, which moves nothing sideways.
    Endcaps<Scalar> world = belief_.endcaps_world();
    world.row(2) -= belief_.ground.template tail<2>().transpose() * world.template topRows<2>();
    loaded_ = detector_.update(world, dt);
    if (flags_are_new_) loaded_ = detector_.measure(flags_, flag_odds_);
    flags_are_new_ = false;
    correct_feet(world, dt);
    if (config_.terrain == Terrain::kFlat) hold_flat(health);
    watch(dt, health);
    for (RodImu& imu : rod_imus_) imu.fresh = false;
  }

  // ---- start, and what has to be given up

  bool start(const AtRest<Scalar>& rest, PrismHealth& health) {
    solver_.reset();
    if (!used(solver_.solve(rest.lengths))) {
      ++health.shape_failures;
      return false;
    }
    belief_.reset();
    const V3 force = stand_still(belief_, rest, config_);
    auto& p = belief_.covariance;
    p(Belief::kPosition + 2, Belief::kPosition + 2) = square(kStartHeightStd);
    p.diagonal()
        .template segment<9>(Belief::kOffsets)
        .setConstant(square(config_.cable_offset_std));
    p.diagonal()
        .template segment<2>(Belief::kGround + 1)
        .setConstant(square(config_.ground_slope_std));
    flatness_ = tight::Flatness::kUndecided;

    const SpinStart<Scalar> spin = stand(solver_.endcaps(), rest.contacts);
    const Endcaps<Scalar> h = spun(solver_.endcaps(), spin.angle);
    belief_.columns(2, 1) = robot_.endcap_radius - (belief_.rotation * h).row(2).minCoeff();
    tight::place_endcaps(belief_, h, kStartShapeStd, std::sqrt(spin.variance),
                         config_.velocity_std);

    // Gravity levels the robot: R (mean - b_a) + g = g x xi_R - R zeta_a + R n at rest.
    {
      const V3 g(0, 0, -config_.gravity);
      const V3 z = belief_.rotation * force + g;
      tight::SequentialUpdate<Scalar> update(belief_);
      for (int k = 0; k < 3; ++k) {
        tight::Row<Scalar> row;
        row.add(Belief::kRotation, hat(g).row(k).transpose());
        row.add(Belief::kAccelBias, -belief_.rotation.row(k).transpose());
        update.correct(row, z[k], square(config_.accelerometer_std) / Scalar(rest.samples));
      }
    }
    hold_rods();
    detector_.reset();
    started_ = true;
    return true;
  }

  // After a gap too long to bridge [s]: anything up to a walking pace may have happened.
  void open(Scalar dt) {
    const Scalar away = std::min(dt, Scalar(1000));
    auto& p = belief_.covariance;
    const Scalar before =
        p.diagonal().template segment<3>(Belief::kPosition).maxCoeff() + square(away);
    belief_.columns.col(0).setZero();
    belief_.rate.setZero();
    const Endcaps<Scalar> h = belief_.endcaps_body();
    constexpr int kMoved = Belief::kBodyEnd - Belief::kRotation;
    p.template middleRows<kMoved>(Belief::kRotation).setZero();
    p.template middleCols<kMoved>(Belief::kRotation).setZero();
    p.diagonal().template segment<kMoved>(Belief::kRotation).setOnes();
    p.diagonal().template segment<3>(Belief::kPosition).setConstant(before);
    tight::place_endcaps(belief_, h, kLostShapeStd, kLostSpinStd, Scalar(1));
    loaded_.fill(false);
    detector_.reset();
  }

  void describe(PrismState<Scalar>& s) const {
    s.rotation = belief_.rotation;
    s.position = belief_.position();
    s.velocity = belief_.velocity();
    s.gyro_bias = belief_.gyro_bias;
    s.accel_bias = belief_.accel_bias;
    s.endcaps_world = belief_.endcaps_world();
    s.endcaps_body = belief_.endcaps_body();
    s.spin = shape::spin_angle(s.endcaps_body, reference_);
    s.rotation_covariance = belief_.rotation_covariance();
    s.velocity_covariance = belief_.velocity_covariance();
    s.position_covariance = belief_.position_covariance();
    s.contacts = loaded_;
    s.cable_nis = cable_nis_;
    s.ground_nis = ground_nis_;
  }

  // Needs the shape that `describe` has filled in.
  void describe_shape_covariance(PrismState<Scalar>& s) const {
    s.endcap_covariance = belief_.endcap_covariance();
    // Of phi, by its gradient at a shape in the gauge of the turned reference.
    const Vector<Scalar, 18> gradient =
        shape::spin_gradient(s.endcaps_body, spun(reference_, s.spin));
    s.spin_variance = gradient.dot(s.endcap_covariance * gradient);
  }

  // The filter's own mean and covariance, in the invariant frame.
  const Belief& belief() const { return belief_; }

 private:
  static constexpr Scalar square(Scalar x) { return x * x; }

  // Endcaps of this filter err less than those the detector's defaults are for, and their errors
  // change faster.
  static contact::DetectorParameters<Scalar> detector_parameters() {
    contact::DetectorParameters<Scalar> parameters;
    parameters.evidence_time = Scalar(0.05);
    return parameters;
  }

  struct RodImu {
    V3 gyro = V3::Zero(), accel = V3::Zero(), bias = V3::Zero();
    int still = 0;  // samples in the bias
    bool fresh = false;
  };

  // Rate of a rod about its own axis [rad/s], NaN: not measured now.
  Scalar spin(int rod) const {
    if (rod == 0) return std::numeric_limits<Scalar>::quiet_NaN();
    const RodImu& imu = rod_imus_[std::size_t(rod - 1)];
    return imu.fresh ? imu.gyro.z() - imu.bias.z() : std::numeric_limits<Scalar>::quiet_NaN();
  }

  // In a batch of its own: with a cable missing the cables alone move endcaps far, and the rods'
  // lengths linearised before that would be another robot's.
  void hold_rods() {
    tight::SequentialUpdate<Scalar> update(belief_);
    tight::hold_rods(update, belief_, robot_.rod_length, kRodLengthStd, kRodStretchStd);
  }

  void correct_rods() {
    tight::SequentialUpdate<Scalar> update(belief_);
    for (int rod = 1; rod <= 2; ++rod) {
      const RodImu& imu = rod_imus_[std::size_t(rod - 1)];
      if (!imu.fresh) continue;
      // In motion the accelerometer feels the rod's own acceleration, for as long as it lasts.
      const Scalar shaken = std::abs(imu.accel.norm() - config_.gravity) / config_.gravity +
                            activity_.level() * kInclinationMoving;
      tight::correct_rod(update, belief_, rod, V3(imu.gyro - imu.bias), imu.accel,
                         robot_.rod_length, config_.gravity, kLeastTurn,
                         {config_.rod_rate_std, config_.rod_inclination_std + shaken});
    }
  }

  void correct_feet(const Endcaps<Scalar>& world, Scalar dt) {
    const std::array<Scalar, 6> shares = contact::support_shares(world, loaded_);
    const tight::FootNoise<Scalar> noise{config_.creep_std,       config_.slip_length,
                                         config_.slip_speed,      config_.foot_rise_std,
                                         config_.foot_height_std, config_.friction};
    std::array<tight::Foot<Scalar>, tight::Feet<Scalar>::kMost> feet;  // as many as have a share
    std::size_t count = 0;
    for (int endcap = 0; endcap < 6; ++endcap) {
      const Scalar share = shares[std::size_t(endcap)];
      if (share > 0 && count < feet.size()) feet[count++] = {endcap, share, spin(endcap / 2)};
    }
    const auto results = tight::correct_feet(belief_, feet.data(), int(count), robot_, noise, dt);
    worst_height_ = 0;
    slowest_foot_ = std::numeric_limits<Scalar>::max();
    Scalar chi_square = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const auto& result = results[k];
      chi_square += result.height_chi_square;
      if (feet[k].share > kWatchedShare) {
        worst_height_ = std::max(worst_height_, std::abs(result.height));
      }
      slowest_foot_ = std::min(slowest_foot_, result.speed);
    }
    if (count > 0) ground_nis_ = chi_square / Scalar(count);
  }

  // The declaration that the ground is flat: tested once the slope is known, and watched from then
  // on. Slopes too small for the test bend little, and show in the estimate later: from then on the
  // ground is a plane of unknown slope.
  void hold_flat(PrismHealth& health) {
    const tight::Flatness before = flatness_;
    if (flatness_ == tight::Flatness::kUndecided) {
      flatness_ = tight::judge_flatness(belief_);
    } else if (flatness_ == tight::Flatness::kBelieved && complete_ >= kCompleteSamples &&
               belief_.ground.template tail<2>().norm() > kSlopeNoticed) {
      flatness_ = tight::Flatness::kRefuted;
      belief_.covariance.diagonal().template segment<2>(Belief::kGround + 1).array() +=
          square(config_.ground_slope_std);
    }
    if (flatness_ != before && flatness_ == tight::Flatness::kRefuted) ++health.terrain_mismatches;
  }

  // ---- losing lock: what cannot be true of a robot on its feet, for too long
  //
  //  - a loaded foot away from the ground: the shape is another one (the wrong side of the fold, a
  //    wrong spin). The spin about the base rod, which no cable holds, is widened. Placing the
  //    endcaps anew instead made matters worse in trials: in a fall the nearest solution of nine
  //    lengths is as often the wrong one.
  //  - every foot slides fast although nothing shakes the robot: the velocity is wrong (a fall can
  //    leave it so, and sure of itself). It is widened.
  void watch(Scalar dt, PrismHealth& health) {
    // A net with a cable missing bends where it likes: its feet prove nothing.
    if (complete_ < kCompleteSamples) return;
    off_ground_ =
        worst_height_ > kLostHeight ? off_ground_ + dt : std::max(off_ground_ - dt, Scalar(0));
    since_spin_reset_ += dt;
    if (off_ground_ > kLostTime && since_spin_reset_ > kSpinRest) {
      off_ground_ = 0;
      since_spin_reset_ = 0;
      tight::widen_spin(belief_, kLostSpin);
      ++health.spin_resets;
    }
    const bool sliding = slowest_foot_ < std::numeric_limits<Scalar>::max() &&
                         slowest_foot_ > kImpossibleSlip && activity_.level() < Scalar(0.5);
    sliding_ = sliding ? sliding_ + dt : Scalar(0);
    if (sliding_ > kLostTime) {
      sliding_ = 0;
      tight::widen_velocity(belief_, kImpossibleSlip);
      ++health.velocity_resets;
    }
  }

  // phi from the endcaps that are on the ground. The ground may slope.
  SpinStart<Scalar> stand(const Endcaps<Scalar>& q, const Flags& contacts) const {
    SpinStart<Scalar> spin =
        find_spin(q, V3(belief_.rotation.transpose() * V3::UnitZ()), contacts,
                  std::hypot(kStartShapeStd, config_.ground_slope_std * robot_.rod_length / 2));
    if (!spin.found) spin.variance = square(config_.spin_prior_std);
    return spin;
  }

  // Endcaps at rest from averaged lengths near the fold, and the height of the lowest [m].
  static constexpr Scalar kStartShapeStd = Scalar(0.02);
  static constexpr Scalar kStartHeightStd = Scalar(0.03);
  // A foot this far off the ground [m], or feet that all slide this fast [m/s], for so long [s], is
  // a lost robot; feet with less than this share of the weight say nothing about it.
  static constexpr Scalar kLostHeight = Scalar(0.06);
  static constexpr Scalar kImpossibleSlip = Scalar(0.5);
  static constexpr Scalar kLostTime = Scalar(0.3);
  static constexpr Scalar kWatchedShare = Scalar(0.15);
  // Nothing is concluded before so many samples of all nine cables in a row.
  static constexpr int kCompleteSamples = 100;
  // Turns of a rod below this have no measured direction [rad/s]; at full activity the
  // inclination from its accelerometer is this uncertain [1].
  static constexpr Scalar kLeastTurn = Scalar(0.2);
  static constexpr Scalar kInclinationMoving = Scalar(0.3);
  // Ground that was believed to be flat is not when its slope is estimated beyond this.
  static constexpr Scalar kSlopeNoticed = Scalar(5 * tight::kFlatSlopeStd);
  // What is added to a lost spin [rad], and how long that is left to settle [s].
  static constexpr Scalar kLostSpin = Scalar(0.3);
  static constexpr Scalar kSpinRest = Scalar(5);
  // After a long gap [m], [rad].
  static constexpr Scalar kLostShapeStd = Scalar(0.3);
  static constexpr Scalar kLostSpinStd = Scalar(1);
  // What linearisation leaves out of a rod's length [m] and its rate [m/s] (tight/members.hpp).
  static constexpr Scalar kRodLengthStd = Scalar(0.0005);
  static constexpr Scalar kRodStretchStd = Scalar(0.002);
  // The prior on the side of the fold, on every fourth sample with four times its variance.
  static constexpr int kFoldEvery = 4;
  static constexpr Scalar kFoldThreshold = Scalar(0.1);
  static constexpr Scalar kFoldStd = Scalar(0.2);

  Prism<Scalar> robot_;
  PrismConfig<Scalar> config_;
  Endcaps<Scalar> reference_;
  shape::Solver<Scalar> solver_;
  contact::Detector<Scalar> detector_;
  Scalar flag_odds_;
  Activity<Scalar> activity_;
  Belief belief_;
  std::array<RodImu, 2> rod_imus_{};
  Flags flags_{}, loaded_{};
  bool flags_are_new_ = false, started_ = false;
  int cable_samples_ = 0;
  Scalar worst_height_ = 0, slowest_foot_ = 0;  // of the last step [m], [m/s]
  Scalar off_ground_ = 0, sliding_ = 0;         // for how long [s]
  Scalar since_spin_reset_ = kSpinRest;         // [s]
  int complete_ = 0;                            // samples of all nine cables in a row
  tight::Flatness flatness_ = tight::Flatness::kUndecided;
  Scalar cable_nis_ = std::numeric_limits<Scalar>::quiet_NaN();
  Scalar ground_nis_ = std::numeric_limits<Scalar>::quiet_NaN();
};

}  // namespace tensegrity
