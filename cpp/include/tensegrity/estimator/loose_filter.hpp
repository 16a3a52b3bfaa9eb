// The loosely coupled filter of T (Fig. 3): a shape is reconstructed from the cables by itself, and
// the endcaps of that shape correct a contact-aided invariant EKF.
//
//   cables ──> shape reconstruction ──> contact kinematics h_i = R_z(phi) q_i
//                                              │
//   IMU ─────> invariant EKF: propagate ──> correct ──> pose, velocity, biases, endcaps
//                                              │
//   contacts ──────────────────────> anchors in and out
//
// With the defaults of `PrismConfig` it is T as published; its settings switch single improvements.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "tensegrity/contact/detector.hpp"
#include "tensegrity/estimator/activity.hpp"
#include "tensegrity/estimator/config.hpp"
#include "tensegrity/estimator/pending.hpp"
#include "tensegrity/estimator/prism_state.hpp"
#include "tensegrity/estimator/spin_start.hpp"
#include "tensegrity/estimator/static_start.hpp"
#include "tensegrity/inekf/anchors.hpp"
#include "tensegrity/inekf/contact_kinematics.hpp"
#include "tensegrity/inekf/propagate.hpp"
#include "tensegrity/math/chi_square.hpp"
#include "tensegrity/shape/solver.hpp"
#include "tensegrity/shape/tracker.hpp"

namespace tensegrity {

template <typename Scalar_ = double, int MaxContacts = 6>
class LooseFilter {
 public:
  using Scalar = Scalar_;
  using Belief = inekf::Belief<Scalar, 1, MaxContacts>;  // extra state: the spin angle phi
  using V3 = Vector3<Scalar>;
  using Flags = std::array<bool, 6>;

  LooseFilter(const Prism<Scalar>& robot, const PrismConfig<Scalar>& config)
      : robot_(robot),
        config_(config),
        solver_(robot, solver_options(config)),
        tracker_(robot),
        detector_(robot) {
    if (!(config.chi_square_gate > 0)) return;
    for (int contacts = 1; contacts <= MaxContacts; ++contacts) {
      gates_[std::size_t(contacts)] = chi_square_quantile(config.chi_square_gate, 3 * contacts);
    }
  }

  bool start(const AtRest<Scalar>& rest, PrismHealth& health) {
    if (!reset_shape(rest.lengths)) {
      ++health.shape_failures;
      return false;
    }
    start_attitude(rest);
    start_spin(rest.contacts);
    started_ = true;
    update_contacts();
    return true;
  }

  // At the start of an IMU step.
  void observe_motion(const inekf::ImuSample<Scalar>& imu, Scalar dt) {
    activity_.update(imu.gyro - belief_.gyro_bias, imu.accel - belief_.accel_bias, config_.gravity,
                     dt);
  }

  // One IMU step, or the part of it up to a measurement.
  void propagate(const inekf::ImuSample<Scalar>& imu, Scalar dt, Scalar gyro_std,
                 Scalar accel_std) {
    const inekf::ProcessNoise<Scalar> noise{gyro_std, accel_std, config_.gyroscope_bias_walk,
                                            config_.accelerometer_bias_walk, config_.contact_std};
    const Vector<Scalar, 1> walk(config_.spin == SpinMethod::kEstimated ? config_.spin_walk
                                                                        : Scalar(0));
    inekf::propagate(belief_, imu, dt, config_.gravity, noise, rolling(), walk);
  }

  void end_step(Scalar, PrismHealth&) {}

  // Nine lengths [m] of the instant `t`, all of them measured.
  Status correct_cables(Nanoseconds t, const CableLengths<Scalar>& lengths, PrismHealth& health) {
    if (!lengths.allFinite()) {
      ++health.cables_dropped;
      return Status::kNotFinite;
    }
    const Scalar dt =
        shape_seen_ ? std::max(seconds<Scalar>(shape_time_, t), Scalar(0)) : Scalar(0);
    shape_time_ = t;
    shape_seen_ = true;
    const Endcaps<Scalar> before = endcaps_;
    const Status shape = update_shape(lengths, dt);
    if (shape != Status::kOk) {
      ++health.shape_failures;
      return shape;
    }
    if (!contacts_seen_) detect_contacts(dt);
    roll_with_shape(before);
    const Status status = correct_contacts(health);
    update_contacts();
    return status;
  }

  void set_contacts(const Flags& flags) {
    contacts_seen_ = true;
    flags_ = flags;
    if (started_) release_anchors();
  }

  // T has one IMU: those of other rods are not used.
  void set_rod_imu(int, const V3&, const V3&) {}
  void forget_still() {}

  // After a gap too long to bridge: anything up to a walking pace may have happened.
  void open(Scalar dt) {
    while (belief_.anchor_count > 0) inekf::marginalise(belief_, belief_.anchor_count - 1);
    const Scalar bounded = std::min(dt, Scalar(1000));
    belief_.velocity.setZero();
    auto& p = belief_.covariance;
    const auto reset = [&](int at, Scalar variance) {
      const int n = belief_.dim();
      p.template middleRows<3>(at).leftCols(n).setZero();
      p.template middleCols<3>(at).topRows(n).setZero();
      p.diagonal().template segment<3>(at).setConstant(variance);
    };
    const Scalar position_variance = p.diagonal().template segment<3>(Belief::kPosition).maxCoeff();
    reset(Belief::kVelocity, Scalar(1));
    reset(Belief::kPosition, position_variance + bounded * bounded);
    reset(Belief::kRotation, Scalar(1));
  }

  void describe(PrismState<Scalar>& s) const {
    s.rotation = belief_.rotation;
    s.position = belief_.position;
    s.velocity = belief_.velocity;
    s.gyro_bias = belief_.gyro_bias;
    s.accel_bias = belief_.accel_bias;
    s.spin = belief_.extra[0];
    s.endcaps_body = spun(endcaps_, s.spin);
    s.endcaps_world = (s.rotation * s.endcaps_body).colwise() + s.position;
    s.rotation_covariance = belief_.rotation_covariance();
    s.velocity_covariance = belief_.velocity_covariance();
    s.position_covariance = belief_.position_covariance();
    for (int slot = 0; slot < belief_.anchor_count; ++slot) {
      s.contacts[std::size_t(belief_.anchor_ids[std::size_t(slot)])] = true;
    }
  }

  void describe_shape_covariance(PrismState<Scalar>& s) const {
    s.endcap_covariance = kinematics().joint_covariance();
    s.spin_variance = belief_.covariance(Belief::kExtra, Belief::kExtra);
  }

  // The filter's own mean and covariance, in the invariant frame.
  const Belief& belief() const { return belief_; }

 private:
  // The last step of a quadratic convergence is a tenth of a millimetre, the error left after it
  // far less: cables are good to millimetres.
  static shape::SolverOptions<Scalar> solver_options(const PrismConfig<Scalar>& config) {
    shape::SolverOptions<Scalar> options;
    options.max_iterations = config.max_shape_iterations;
    options.tolerance = Scalar(1e-4);
    return options;
  }

  bool reset_shape(const CableLengths<Scalar>& lengths) {
    solver_.reset();
    if (!used(solver_.solve(lengths))) return false;
    endcaps_ = solver_.endcaps();
    if (config_.shape == ShapeMethod::kTracker) {
      if (!used(tracker_.reset(lengths))) return false;
      endcaps_ = tracker_.endcaps();
    }
    return true;
  }

  // The force fixes the tilt only as well as the accelerometer's bias is known: the update keeps
  // their correlation.
  void start_attitude(const AtRest<Scalar>& rest) {
    belief_.reset();
    const V3 force = stand_still(belief_, rest, config_);
    auto& p = belief_.covariance;
    // R (mean - b_a) + g = g x xi_R - R zeta_a + R n at rest.
    const V3 g(0, 0, -config_.gravity);
    const Matrix3<Scalar> gx = hat(g);
    inekf::Innovation<Belief, 3> z;
    z.set_residual(belief_.rotation * force + g);
    auto cross = z.cross();
    cross = p.template middleCols<3>(Belief::kRotation) * gx.transpose() -
            p.template middleCols<3>(Belief::kAccelBias) * belief_.rotation.transpose();
    z.covariance() = gx * cross.template middleRows<3>(Belief::kRotation) -
                     belief_.rotation * cross.template middleRows<3>(Belief::kAccelBias);
    z.covariance().diagonal().array() +=
        config_.accelerometer_std * config_.accelerometer_std / Scalar(rest.samples);
    inekf::correct(belief_, z, Scalar(0));
  }

  // phi from the endcaps that are on the ground, and the height of the IMU above it.
  void start_spin(const Flags& contacts) {
    const V3 up = belief_.rotation.transpose() * V3::UnitZ();
    const SpinStart<Scalar> spin = find_spin(endcaps_, up, contacts, kStartHeightStd);
    belief_.extra[0] = spin.found ? spin.angle : Scalar(0);
    const Scalar variance =
        spin.found ? spin.variance : config_.spin_prior_std * config_.spin_prior_std;
    belief_.covariance(Belief::kExtra, Belief::kExtra) =
        config_.spin == SpinMethod::kEstimated ? variance : Scalar(0);
    const Endcaps<Scalar> h = belief_.rotation * spun(endcaps_, belief_.extra[0]);
    belief_.position.z() = robot_.endcap_radius - h.row(2).minCoeff();
  }

  // ---- shape and correction

  Status update_shape(const CableLengths<Scalar>& lengths, Scalar dt) {
    if (config_.shape == ShapeMethod::kTracker) {
      const Scalar walk = config_.shape_std_rest +
                          activity_.level() * (config_.shape_std_moving - config_.shape_std_rest);
      tracker_.predict(walk * std::sqrt(dt));
      const Status status = tracker_.correct(lengths, config_.cable_std);
      if (status == Status::kOk) endcaps_ = tracker_.endcaps();
      return status;
    }
    const Status status = solver_.solve(lengths);
    if (status == Status::kOk || status == Status::kNotConverged) {
      endcaps_ = solver_.endcaps();
      return Status::kOk;
    }
    return status;
  }

  // Contact kinematics h = R_z(phi) q with its derivative and covariance, all in the body frame.
  inekf::Kinematics<Scalar, 6, 1> kinematics() const {
    inekf::Kinematics<Scalar, 6, 1> k;
    const Scalar phi = belief_.extra[0];
    k.h = spun(endcaps_, phi);
    for (int i = 0; i < 6; ++i) {
      k.h_extra.template middleRows<3>(3 * i) = V3::UnitZ().cross(k.h.col(i));
    }
    k.variance = config_.contact_position_std * config_.contact_position_std;
    k.correlated =
        config_.contact_noise == ContactNoise::kFromShape && config_.shape == ShapeMethod::kTracker;
    if (!k.correlated) return k;
    k.shape_covariance.setZero();  // endcaps 0 and 1 are exact in the body frame
    const Matrix3<Scalar> spin = SO3<Scalar>::Exp(V3(0, 0, phi)).matrix();
    const Matrix<Scalar, 18>& q = tracker_.covariance();
    for (int i = 2; i < 6; ++i) {
      for (int j = 2; j < 6; ++j) {
        k.shape_covariance.template block<3, 3>(3 * i, 3 * j) =
            spin * q.template block<3, 3>(3 * i, 3 * j) * spin.transpose();
      }
    }
    return k;
  }

  inekf::Rolling<Scalar> rolling() const {
    return {config_.contact_point == ContactPoint::kRolling ? robot_.endcap_radius : Scalar(0)};
  }

  // Rods 23 and 45 also turn against the base rod as the shape changes: u x du across each rod.
  // About its own axis every rod is taken to turn as the base rod does, which propagation did.
  void roll_with_shape(const Endcaps<Scalar>& before) {
    const Scalar radius = rolling().radius;
    if (radius == 0) return;
    const Matrix3<Scalar> to_world =
        belief_.rotation * SO3<Scalar>::Exp(V3(0, 0, belief_.extra[0])).matrix();
    for (int slot = 0; slot < belief_.anchor_count; ++slot) {
      const int rod = belief_.anchor_ids[std::size_t(slot)] / 2;
      if (rod == 0) continue;
      const V3 u0 = (before.col(2 * rod) - before.col(2 * rod + 1)) / robot_.rod_length;
      const V3 u1 = (endcaps_.col(2 * rod) - endcaps_.col(2 * rod + 1)) / robot_.rod_length;
      belief_.anchors.col(slot) += radius * (to_world * u0.cross(u1)).cross(V3::UnitZ());
    }
  }

  Status correct_contacts(PrismHealth& health) {
    if (belief_.anchor_count == 0) return Status::kOk;
    const Scalar gate = gates_[std::size_t(belief_.anchor_count)];
    const inekf::Correction<Scalar> correction =
        inekf::correct_contacts(belief_, kinematics(), gate);
    if (correction.status == Status::kRejected) {
      // The feet are not where they stood. They stand anew where the kinematics puts them.
      ++health.contacts_rejected;
      while (belief_.anchor_count > 0) inekf::marginalise(belief_, belief_.anchor_count - 1);
    }
    return correction.status;
  }

  // ---- contacts

  void detect_contacts(Scalar dt) {
    const Endcaps<Scalar> world = belief_.rotation * spun(endcaps_, belief_.extra[0]);
    flags_ = detector_.update(world, dt);
    release_anchors();
  }

  void release_anchors() {
    for (int slot = belief_.anchor_count - 1; slot >= 0; --slot) {
      if (!flags_[std::size_t(belief_.anchor_ids[std::size_t(slot)])]) {
        inekf::marginalise(belief_, slot);
      }
    }
  }

  // Anchors are added together with a fresh shape, so that both are of the same instant.
  void update_contacts() {
    const auto is_new = [&](int id) { return flags_[std::size_t(id)] && belief_.find(id) < 0; };
    bool any = false;
    for (int id = 0; id < 6; ++id) any = any || is_new(id);
    if (!any) return;
    const auto k = kinematics();
    for (int id = 0; id < 6; ++id) {
      if (is_new(id)) {
        inekf::augment(belief_, id, V3(k.h.col(id)),
                       Matrix<Scalar, 3, 1>(k.h_extra.template middleRows<3>(3 * id)),
                       k.covariance(id, id));
      }
    }
  }

  // Heights of endcaps at rest, reconstructed from averaged lengths near the fold [m].
  static constexpr Scalar kStartHeightStd = Scalar(0.02);
  static constexpr Scalar kActiveForce = Scalar(2);   // [m/s^2]
  static constexpr Scalar kActiveRate = Scalar(0.5);  // [rad/s]

  Prism<Scalar> robot_;
  PrismConfig<Scalar> config_;
  shape::Solver<Scalar> solver_;
  shape::Tracker<Scalar> tracker_;
  contact::Detector<Scalar> detector_;
  Belief belief_;
  Endcaps<Scalar> endcaps_ = Endcaps<Scalar>::Zero();  // Procrustes gauge, phi = 0 [m]
  std::array<Scalar, MaxContacts + 1> gates_{};        // by number of contacts; 0: no gate
  Flags flags_{};
  Activity<Scalar> activity_{kActiveForce, kActiveRate};
  Nanoseconds shape_time_ = 0;  // of the last lengths
  bool shape_seen_ = false, contacts_seen_ = false, started_ = false;
};

}  // namespace tensegrity
