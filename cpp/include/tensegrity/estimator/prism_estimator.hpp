// Sensors in, state out: the estimator of T (Fig. 3) for a 3-bar prism.
//
//   cables ──> shape reconstruction ──> contact kinematics h_i = R_z(phi) q_i
//                                              │
//   IMU ─────> invariant EKF: propagate ──> correct ──> pose, velocity, biases, endcaps
//                                              │
//   contacts ──────────────────────> anchors in and out
//
// Order and time. Every sensor has its own stamps [ns] and rate, and calls may interleave in any
// order. The state lives at the stamp of the newest IMU sample.
//  - cables or contacts ahead of the IMU wait until a sample reaches their stamp; the step is then
//    split there, so that the order of the calls does not matter;
//  - up to `max_latency` behind the state they are taken as if they were new; older: kTooLate;
//  - behind the newest of their own kind: kOutOfOrder; equal to it: kDuplicate. Both are dropped;
//  - an IMU step longer than `max_imu_gap` returns kGap: the motion between is bridged by the mean
//    of the two samples, with their difference as noise. After more than `kLongestBridge` seconds
//    nothing is bridged: pose is held, anchors are dropped and the uncertainty is opened;
//  - cables that stop coming only stop correcting; contact flags keep their last value.
// Whatever the input, the state stays finite and no call allocates, throws or blocks.
#pragma once

#include <array>
#include <cmath>

#include "tensegrity/contact/detector.hpp"
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

template <typename Scalar = double, int MaxContacts = 6>
class PrismEstimator {
 public:
  using Belief = inekf::Belief<Scalar, 1, MaxContacts>;  // extra state: the spin angle phi
  using V3 = Vector3<Scalar>;
  using Flags = std::array<bool, 6>;

  explicit PrismEstimator(const Prism<Scalar>& robot = {}, const PrismConfig<Scalar>& config = {})
      : robot_(robot),
        config_(config),
        solver_(robot),
        tracker_(robot),
        detector_(robot),
        start_({config.init_bias_size, config.static_gyro_limit, config.static_accel_limit,
                kPriorSigmas * config.gyroscope_bias_std,
                kPriorSigmas * config.accelerometer_bias_std, config.gravity, config.gyroscope_bias,
                config.accelerometer_bias}) {
    for (int contacts = 1; contacts <= MaxContacts; ++contacts) {
      gates_[std::size_t(contacts)] =
          config.chi_square_gate > 0
              ? Scalar(chi_square_quantile(double(config.chi_square_gate), 3 * contacts))
              : Scalar(0);
    }
  }

  // Angular velocity [rad/s] and specific force [m/s^2] in the IMU frame.
  Status imu(Nanoseconds t, const V3& gyro, const V3& accel) {
    const Status status = check_imu(t, gyro, accel);
    if (status != Status::kOk) {
      ++health_.imu_dropped;
      return status;
    }
    const inekf::ImuSample<Scalar> sample{gyro, accel};
    const inekf::ImuSample<Scalar> previous = imu_seen_ ? last_sample_ : sample;
    const Nanoseconds begin = imu_seen_ ? time_ : t;
    last_sample_ = sample;
    imu_seen_ = true;
    if (!initialized_) {
      take_pending(t, [](Nanoseconds) {});
      time_ = t;
      return start(gyro, accel);
    }
    return advance(begin, t, previous, sample);
  }

  // Nine distances of endcap centres [m], in the order of kPrismCables.
  Status cables(Nanoseconds t, const CableLengths<Scalar>& lengths) {
    Status status = Status::kOk;
    if (!lengths.allFinite()) {
      status = Status::kNotFinite;
    } else if (lengths.minCoeff() <= 0 || lengths.maxCoeff() > 3 * robot_.rod_length) {
      status = Status::kOutOfRange;
    } else {
      status = check_stamp(t, last_cables_, cables_seen_);
    }
    if (status != Status::kOk) {
      ++health_.cables_dropped;
      return status;
    }
    last_cables_ = t;
    cables_seen_ = true;
    typename PendingQueue<Scalar>::Item item;
    item.t = t;
    item.kind = PendingMeasurement<Scalar>::Kind::kCables;
    item.lengths = lengths;
    return take(item);
  }

  // Which endcaps are on the ground. Without any call, the built-in detector decides.
  Status contacts(Nanoseconds t, const Flags& flags) {
    const Status status = check_stamp(t, last_contacts_, contacts_seen_);
    if (status != Status::kOk) {
      ++health_.contacts_dropped;
      return status;
    }
    last_contacts_ = t;
    contacts_seen_ = true;
    typename PendingQueue<Scalar>::Item item;
    item.t = t;
    item.kind = PendingMeasurement<Scalar>::Kind::kContacts;
    item.flags = flags;
    return take(item);
  }

  bool initialized() const { return initialized_; }

  PrismState<Scalar> state() const {
    PrismState<Scalar> s;
    s.t = time_;
    s.initialized = initialized_;
    s.health = health_;
    if (!initialized_) return s;
    s.rotation = belief_.rotation;
    s.position = belief_.position;
    s.velocity = belief_.velocity;
    s.gyro_bias = belief_.gyro_bias;
    s.accel_bias = belief_.accel_bias;
    s.spin = belief_.extra[0];
    s.spin_variance = belief_.covariance(Belief::kExtra, Belief::kExtra);
    s.endcaps_body = spun(endcaps_, s.spin);
    s.endcaps_world = (s.rotation * s.endcaps_body).colwise() + s.position;
    s.endcap_covariance = kinematics().covariance;
    s.rotation_covariance = belief_.rotation_covariance();
    s.velocity_covariance = belief_.velocity_covariance();
    s.position_covariance = belief_.position_covariance();
    for (int slot = 0; slot < belief_.anchor_count; ++slot) {
      s.contacts[std::size_t(belief_.anchor_ids[slot])] = true;
    }
    return s;
  }

  // The filter's own mean and covariance, in the invariant frame.
  const Belief& belief() const { return belief_; }
  const PrismConfig<Scalar>& config() const { return config_; }
  const Prism<Scalar>& robot() const { return robot_; }

 private:
  static constexpr Scalar kPriorSigmas = Scalar(5);
  static constexpr Scalar kLongestBridge = Scalar(1);     // [s]
  static constexpr Scalar kLargestRate = Scalar(200);     // [rad/s], no gyro reaches it
  static constexpr Scalar kLargestForce = Scalar(20000);  // [m/s^2], 2000 g

  static Scalar seconds(Nanoseconds from, Nanoseconds to) {
    return Scalar(double(to - from) * 1e-9);
  }

  // ---- input checks

  Status check_imu(Nanoseconds t, const V3& gyro, const V3& accel) const {
    if (!gyro.allFinite() || !accel.allFinite()) return Status::kNotFinite;
    if (gyro.cwiseAbs().maxCoeff() > kLargestRate || accel.cwiseAbs().maxCoeff() > kLargestForce) {
      return Status::kOutOfRange;
    }
    if (imu_seen_ && t == time_) return Status::kDuplicate;
    if (imu_seen_ && t < time_) return Status::kOutOfOrder;
    return Status::kOk;
  }

  Status check_stamp(Nanoseconds t, Nanoseconds last, bool seen) const {
    if (seen && t == last) return Status::kDuplicate;
    if (seen && t < last) return Status::kOutOfOrder;
    if (imu_seen_ && t < time_ && seconds(t, time_) > config_.max_latency) return Status::kTooLate;
    return Status::kOk;
  }

  // ---- time

  Status take(const typename PendingQueue<Scalar>::Item& item) {
    if (imu_seen_ && item.t <= time_) return apply(item);
    if (!pending_.push(item)) ++health_.cables_dropped;
    return Status::kOk;
  }

  // Applies all that waits for a stamp up to `t`; `reach` brings the state to each stamp first.
  template <typename Reach>
  void take_pending(Nanoseconds t, const Reach& reach) {
    while (!pending_.empty() && pending_.front().t <= t) {
      reach(pending_.front().t);
      apply(pending_.front());
      pending_.pop();
    }
  }

  Status apply(const typename PendingQueue<Scalar>::Item& item) {
    if (item.kind == PendingMeasurement<Scalar>::Kind::kContacts) {
      flags_ = item.flags;
      if (initialized_) release_anchors();
      return Status::kOk;
    }
    return initialized_ ? correct(item.t, item.lengths) : collect(item.t, item.lengths);
  }

  Status advance(Nanoseconds begin, Nanoseconds t, const inekf::ImuSample<Scalar>& previous,
                 const inekf::ImuSample<Scalar>& sample) {
    const Scalar dt = seconds(begin, t);
    const bool gap = dt > config_.max_imu_gap;
    if (gap) ++health_.imu_gaps;
    if (dt > kLongestBridge) {
      open_uncertainty(dt);
      take_pending(t, [](Nanoseconds) {});
      time_ = t;
      return Status::kGap;
    }
    inekf::ImuSample<Scalar> mean = sample;
    inekf::ProcessNoise<Scalar> noise{config_.gyroscope_std, config_.accelerometer_std,
                                      config_.gyroscope_bias_walk, config_.accelerometer_bias_walk,
                                      config_.contact_std};
    if (gap || config_.imu_sampling == ImuSampling::kInstantaneous) {
      mean.gyro = (previous.gyro + sample.gyro) / 2;
      mean.accel = (previous.accel + sample.accel) / 2;
    }
    if (gap) {  // what happened between the two samples is as uncertain as they differ
      noise.gyro = std::max(noise.gyro, (sample.gyro - previous.gyro).norm());
      noise.accel = std::max(noise.accel, (sample.accel - previous.accel).norm());
    }
    update_activity(mean, dt);
    Nanoseconds now = begin;
    const auto reach = [&](Nanoseconds stamp) {
      if (stamp <= now) return;
      const Scalar part = seconds(now, stamp);
      // One sample's noise, spread over the parts of a split step.
      inekf::ProcessNoise<Scalar> scaled = noise;
      const Scalar spread = std::sqrt(dt / part);
      scaled.gyro *= spread;
      scaled.accel *= spread;
      const Vector<Scalar, 1> walk(config_.spin == SpinMethod::kEstimated ? config_.spin_walk
                                                                          : Scalar(0));
      inekf::propagate(belief_, mean, part, config_.gravity, scaled, rolling(), walk);
      now = stamp;
    };
    take_pending(t, reach);
    reach(t);
    time_ = t;
    return gap ? Status::kGap : Status::kOk;
  }

  // ---- static start

  // Cable lengths before the start: their mean over the still window is what the start uses.
  Status collect(Nanoseconds t, const CableLengths<Scalar>& lengths) {
    ++still_cables_;
    mean_lengths_ += (lengths - mean_lengths_) / Scalar(still_cables_);
    shape_time_ = t;
    return Status::kOk;
  }

  Status start(const V3& gyro, const V3& accel) {
    const int before = start_.samples();
    const bool still = !config_.static_bias_initialization || start_.add(gyro, accel);
    if (!still) {
      if (start_.samples() <= before) still_cables_ = 0;  // a window was given up
      return Status::kNotInitialized;
    }
    if (still_cables_ == 0 || !reset_shape()) {
      start_.clear();
      return Status::kNotInitialized;
    }
    if (config_.static_bias_initialization) {
      start_attitude(start_.mean_gyro(), start_.mean_accel(), start_.samples());
    } else {
      start_attitude(config_.gyroscope_bias, accel, 1);
    }
    start_spin();
    initialized_ = true;
    update_contacts();
    return Status::kOk;
  }

  bool reset_shape() {
    solver_.reset();
    if (!used(solver_.solve(mean_lengths_))) {
      ++health_.shape_failures;
      return false;
    }
    endcaps_ = solver_.endcaps();
    if (config_.shape == ShapeMethod::kTracker) {
      if (!used(tracker_.reset(mean_lengths_))) {
        ++health_.shape_failures;
        return false;
      }
      endcaps_ = tracker_.endcaps();
    }
    return true;
  }

  // Roll and pitch from the mean specific force, gyro bias from the mean rate. The force fixes the
  // tilt only as well as the accelerometer bias is known: the update below keeps their correlation.
  void start_attitude(const V3& mean_gyro, const V3& mean_accel, int samples) {
    belief_ = Belief{};
    const V3 force = mean_accel - config_.accelerometer_bias;
    belief_.rotation = shortest_rotation(force.normalized(), V3::UnitZ());
    belief_.gyro_bias = mean_gyro;
    belief_.accel_bias = config_.accelerometer_bias;

    auto& p = belief_.covariance;
    const auto set = [&](int at, Scalar std) {
      p.diagonal().template segment<3>(at).setConstant(std * std);
    };
    set(Belief::kRotation, config_.orientation_std);
    p(Belief::kRotation + 2, Belief::kRotation + 2) = 0;  // heading: zero by definition
    set(Belief::kVelocity, config_.velocity_std);
    set(Belief::kPosition, config_.position_std);
    set(Belief::kGyroBias, config_.static_bias_initialization
                               ? config_.gyroscope_std / std::sqrt(Scalar(samples))
                               : config_.gyroscope_bias_std);
    set(Belief::kAccelBias, config_.accelerometer_bias_std);

    // R (mean - b_a) + g = g x xi_R - R zeta_a + R n at rest.
    const V3 g(0, 0, -config_.gravity);
    const Matrix3<Scalar> gx = hat(g);
    const int n = belief_.dim();
    inekf::Innovation<Belief, 3> z;
    z.resize(n, 3);
    z.residual = belief_.rotation * force + g;
    z.cross =
        p.template middleCols<3>(Belief::kRotation).topRows(n) * gx.transpose() -
        p.template middleCols<3>(Belief::kAccelBias).topRows(n) * belief_.rotation.transpose();
    z.covariance = gx * z.cross.template middleRows<3>(Belief::kRotation) -
                   belief_.rotation * z.cross.template middleRows<3>(Belief::kAccelBias);
    z.covariance.diagonal().array() +=
        config_.accelerometer_std * config_.accelerometer_std / Scalar(samples);
    inekf::correct(belief_, z, Scalar(0));
  }

  // phi from the endcaps that are on the ground, and the height of the IMU above it.
  void start_spin() {
    const V3 up = belief_.rotation.transpose() * V3::UnitZ();
    const SpinStart<Scalar> spin =
        find_spin(endcaps_, up, contacts_seen_ ? flags_ : Flags{}, kStartHeightStd);
    belief_.extra[0] = spin.found ? spin.angle : Scalar(0);
    const Scalar variance =
        spin.found ? spin.variance : config_.spin_prior_std * config_.spin_prior_std;
    belief_.covariance(Belief::kExtra, Belief::kExtra) =
        config_.spin == SpinMethod::kEstimated ? variance : Scalar(0);
    const Endcaps<Scalar> h = belief_.rotation * spun(endcaps_, belief_.extra[0]);
    belief_.position.z() = robot_.endcap_radius - h.row(2).minCoeff();
  }

  // ---- shape and correction

  Status correct(Nanoseconds t, const CableLengths<Scalar>& lengths) {
    const Endcaps<Scalar> before = endcaps_;
    const Scalar dt = std::max(seconds(shape_time_, t), Scalar(0));
    const Status shape = update_shape(lengths, dt);
    shape_time_ = t;
    if (shape != Status::kOk) {
      ++health_.shape_failures;
      return shape;
    }
    if (!contacts_seen_) detect_contacts(dt);
    roll_with_shape(before);
    const Status status = correct_contacts();
    update_contacts();
    return status;
  }

  Status update_shape(const CableLengths<Scalar>& lengths, Scalar dt) {
    if (config_.shape == ShapeMethod::kTracker) {
      const Scalar walk =
          config_.shape_std_rest + activity_ * (config_.shape_std_moving - config_.shape_std_rest);
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
    const Scalar floor = config_.contact_position_std * config_.contact_position_std;
    k.covariance.setZero();
    if (config_.contact_noise == ContactNoise::kFromShape &&
        config_.shape == ShapeMethod::kTracker) {
      const Matrix3<Scalar> spin = SO3<Scalar>::Exp(V3(0, 0, phi)).matrix();
      const Matrix<Scalar, 18>& q = tracker_.covariance();
      for (int i = 2; i < 6; ++i) {  // endcaps 0 and 1 are exact in the body frame
        for (int j = 2; j < 6; ++j) {
          k.covariance.template block<3, 3>(3 * i, 3 * j) =
              spin * q.template block<3, 3>(3 * i, 3 * j) * spin.transpose();
        }
      }
    }
    k.covariance.diagonal().array() += floor;
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

  Status correct_contacts() {
    if (belief_.anchor_count == 0) return Status::kOk;
    const auto innovation = inekf::contact_innovation(belief_, kinematics());
    const Scalar gate = gates_[std::size_t(belief_.anchor_count)];
    const inekf::Correction correction = inekf::correct(belief_, innovation, gate);
    if (correction.status == Status::kRejected) {
      // The feet are not where they stood. They stand anew where the kinematics puts them.
      ++health_.contacts_rejected;
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
    release_anchors();
    const auto k = kinematics();
    for (int id = 0; id < 6; ++id) {
      if (flags_[std::size_t(id)] && belief_.find(id) < 0) {
        inekf::augment(belief_, id, V3(k.h.col(id)),
                       Matrix<Scalar, 3, 1>(k.h_extra.template middleRows<3>(3 * id)),
                       Matrix3<Scalar>(k.covariance.template block<3, 3>(3 * id, 3 * id)));
      }
    }
  }

  // ---- motion

  // 0 at rest, 1 when rolling or falling: how far force is from gravity and how fast the rod turns,
  // with a memory of 0.1 s so that a fall does not end between two samples.
  void update_activity(const inekf::ImuSample<Scalar>& imu, Scalar dt) {
    const Scalar force = std::abs((imu.accel - belief_.accel_bias).norm() - config_.gravity);
    const Scalar rate = (imu.gyro - belief_.gyro_bias).norm();
    const Scalar now = std::min(force / kActiveForce + rate / kActiveRate, Scalar(1));
    activity_ = std::max(now, activity_ * std::exp(-dt / kActivityMemory));
  }

  // After a gap too long to bridge: anything up to a walking pace may have happened.
  void open_uncertainty(Scalar dt) {
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

  static Matrix3<Scalar> shortest_rotation(const V3& from, const V3& to) {
    const V3 axis = from.cross(to);
    const Scalar sine = axis.norm(), cosine = from.dot(to);
    if (sine < Scalar(1e-6)) {
      return cosine > 0 ? Matrix3<Scalar>::Identity() : Matrix3<Scalar>(V3(1, -1, -1).asDiagonal());
    }
    return SO3<Scalar>::Exp(axis / sine * std::atan2(sine, cosine)).matrix();
  }

  // Heights of endcaps at rest, reconstructed from averaged lengths near the fold [m].
  static constexpr Scalar kStartHeightStd = Scalar(0.02);
  static constexpr Scalar kActiveForce = Scalar(2);       // [m/s^2]
  static constexpr Scalar kActiveRate = Scalar(0.5);      // [rad/s]
  static constexpr Scalar kActivityMemory = Scalar(0.1);  // [s]

  Prism<Scalar> robot_;
  PrismConfig<Scalar> config_;
  shape::Solver<Scalar> solver_;
  shape::Tracker<Scalar> tracker_;
  contact::Detector<Scalar> detector_;
  StaticStart<Scalar> start_;
  PendingQueue<Scalar> pending_;
  Belief belief_;
  Endcaps<Scalar> endcaps_ = Endcaps<Scalar>::Zero();  // Procrustes gauge, phi = 0 [m]
  CableLengths<Scalar> mean_lengths_ = CableLengths<Scalar>::Zero();
  inekf::ImuSample<Scalar> last_sample_{V3::Zero(), V3::Zero()};
  std::array<Scalar, MaxContacts + 1> gates_{};  // by number of contacts; 0: no gate
  PrismHealth health_;
  Flags flags_{};
  Nanoseconds time_ = 0, last_cables_ = 0, last_contacts_ = 0, shape_time_ = 0;
  Scalar activity_ = 0;
  int still_cables_ = 0;
  bool imu_seen_ = false, cables_seen_ = false, contacts_seen_ = false, initialized_ = false;
};

}  // namespace tensegrity
