// Sensors in, state out. The streaming front of every filter for a 3-bar prism: it checks samples,
// keeps their time, finds the still start, and hands the filter one step after the other.
//
// Order and time. Every sensor has its own stamps [ns] and rate, and calls may interleave in any
// order. The state lives at the stamp of the newest IMU sample.
//  - cables or contacts ahead of the IMU wait until a sample reaches their stamp; the step is then
//    split there, so that the order of the calls does not matter. Of one stamp it does: contact
//    points end a step of the tightly coupled filter, with the cables called until then;
//  - up to `max_latency` behind the state they are taken as if they were new; older: kTooLate;
//  - behind the newest of their own kind: kOutOfOrder; equal to it: kDuplicate. Both are dropped;
//  - an IMU step longer than `max_imu_gap` returns kGap: the motion between is bridged by the mean
//    of the two samples, with their difference as noise. After more than `kLongestBridge` seconds
//    nothing is bridged: pose is held and the uncertainty is opened;
//  - a cable without a measurement is NaN; cables that stop coming only stop correcting; contact
//    flags keep their last value.
// Whatever the input, the state stays finite and no call allocates, throws or blocks.
//
// `Filter` is TightFilter (the best, default) or LooseFilter (T's method and its variants).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "tensegrity/contact/load_share.hpp"
#include "tensegrity/estimator/config.hpp"
#include "tensegrity/estimator/loose_filter.hpp"
#include "tensegrity/estimator/pending.hpp"
#include "tensegrity/estimator/prism_state.hpp"
#include "tensegrity/estimator/static_start.hpp"
#include "tensegrity/estimator/tight_filter.hpp"

namespace tensegrity {

template <typename Scalar = double, typename Filter = TightFilter<Scalar>>
class PrismEstimator {
 public:
  using V3 = Vector3<Scalar>;
  using Flags = std::array<bool, 6>;

  explicit PrismEstimator(const Prism<Scalar>& robot = {}, const PrismConfig<Scalar>& config = {})
      : robot_(robot),
        config_(config),
        filter_(robot, config),
        start_({config.init_bias_size, config.static_gyro_limit, config.static_accel_limit,
                kPriorSigmas * config.gyroscope_bias_std,
                kPriorSigmas * config.accelerometer_bias_std, config.gravity, config.gyroscope_bias,
                config.accelerometer_bias}) {}

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

  // Nine distances of endcap centres [m], in the order of kPrismCables; NaN: not measured.
  Status cables(Nanoseconds t, const CableLengths<Scalar>& lengths) {
    Measurement measurement;
    measurement.t = t;
    measurement.kind = Measurement::Kind::kCables;
    measurement.lengths = lengths;
    return take_new(measurement, check_lengths(lengths), cable_stamps_, health_.cables_dropped);
  }

  // An IMU on rod 1 (r23) or 2 (r45): rate [rad/s] and specific force [m/s^2] in its own frame, z
  // along the rod toward its even endcap, any mounting about it. Taken with the base rod's next
  // sample (call this one first at equal stamps), forgotten when that is later than `max_latency`.
  Status rod_imu(Nanoseconds t, int rod, const V3& gyro, const V3& accel) {
    Status status = Status::kOk;
    if (rod != 1 && rod != 2) {
      status = Status::kOutOfRange;
    } else {
      status = check_sample(gyro, accel);
    }
    if (status == Status::kOk && imu_seen_ && seconds<Scalar>(t, time_) > config_.max_latency) {
      status = Status::kTooLate;
    }
    if (status != Status::kOk) {
      ++health_.imu_dropped;
      return status;
    }
    filter_.set_rod_imu(rod, gyro, accel);
    return Status::kOk;
  }

  // Which endcaps are on the ground. Without any call, the built-in detector decides.
  Status contacts(Nanoseconds t, const Flags& flags) {
    Measurement measurement;
    measurement.t = t;
    measurement.kind = Measurement::Kind::kContacts;
    measurement.flags = flags;
    return take_new(measurement, Status::kOk, contact_stamps_, health_.contacts_dropped);
  }

  bool initialized() const { return initialized_; }

  PrismState<Scalar> state() const {
    PrismState<Scalar> s = state_without_shape_covariance();
    if (initialized_) filter_.describe_shape_covariance(s);
    return s;
  }

  // The same with `endcap_covariance` and `spin_variance` left at zero: they take longer than all
  // the rest, which counts where every state is recorded.
  PrismState<Scalar> state_without_shape_covariance() const {
    PrismState<Scalar> s;
    s.t = time_;
    s.initialized = initialized_;
    s.health = health_;
    if (!initialized_) return s;
    filter_.describe(s);
    s.load_shares = contact::support_shares(s.endcaps_world, s.contacts);
    return s;
  }

  const Filter& filter() const { return filter_; }
  const PrismConfig<Scalar>& config() const { return config_; }
  const Prism<Scalar>& robot() const { return robot_; }

 private:
  using Measurement = PendingMeasurement<Scalar>;

  // Newest stamp of one kind of measurement.
  struct Stamps {
    Nanoseconds last = 0;
    bool seen = false;
  };

  static constexpr Scalar kPriorSigmas = Scalar(5);
  static constexpr Scalar kUniform = Scalar(0.2886751);   // 1/sqrt(12)
  static constexpr Scalar kLongestBridge = Scalar(1);     // [s]
  static constexpr Scalar kLargestRate = Scalar(200);     // [rad/s], no gyro reaches it
  static constexpr Scalar kLargestForce = Scalar(20000);  // [m/s^2], 2000 g

  // ---- input checks

  static Status check_sample(const V3& gyro, const V3& accel) {
    if (!gyro.allFinite() || !accel.allFinite()) return Status::kNotFinite;
    if (gyro.cwiseAbs().maxCoeff() > kLargestRate || accel.cwiseAbs().maxCoeff() > kLargestForce) {
      return Status::kOutOfRange;
    }
    return Status::kOk;
  }

  Status check_imu(Nanoseconds t, const V3& gyro, const V3& accel) const {
    const Status status = check_sample(gyro, accel);
    if (status != Status::kOk) return status;
    if (imu_seen_ && t == time_) return Status::kDuplicate;
    if (imu_seen_ && t < time_) return Status::kOutOfOrder;
    return Status::kOk;
  }

  // NaN stands for a cable that was not measured; one length at least has to be there.
  Status check_lengths(const CableLengths<Scalar>& lengths) const {
    if (lengths.array().isNaN().all()) return Status::kNotFinite;
    for (int k = 0; k < 9; ++k) {
      if (std::isinf(lengths[k])) return Status::kNotFinite;
      if (lengths[k] <= 0 || lengths[k] > 3 * robot_.rod_length) return Status::kOutOfRange;
    }
    return Status::kOk;
  }

  Status check_stamp(Nanoseconds t, const Stamps& stamps) const {
    if (stamps.seen && t == stamps.last) return Status::kDuplicate;
    if (stamps.seen && t < stamps.last) return Status::kOutOfOrder;
    const bool late = imu_seen_ && t < time_ && seconds<Scalar>(t, time_) > config_.max_latency;
    return late ? Status::kTooLate : Status::kOk;
  }

  // ---- time

  // `content`: what is wrong with the measurement itself.
  Status take_new(const Measurement& measurement, Status content, Stamps& stamps,
                  std::uint32_t& dropped) {
    const Status status = content == Status::kOk ? check_stamp(measurement.t, stamps) : content;
    if (status != Status::kOk) {
      ++dropped;
      return status;
    }
    stamps = {measurement.t, true};
    if (imu_seen_ && measurement.t <= time_) return apply(measurement);
    if (!pending_.push(measurement)) ++health_.cables_dropped;
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

  Status apply(const Measurement& measurement) {
    if (measurement.kind == Measurement::Kind::kContacts) {
      contacts_ = measurement.flags;
      filter_.set_contacts(measurement.flags);
      return Status::kOk;
    }
    if (!initialized_) return collect(measurement.lengths);
    return filter_.correct_cables(measurement.t, measurement.lengths, health_);
  }

  Status advance(Nanoseconds begin, Nanoseconds t, const inekf::ImuSample<Scalar>& previous,
                 const inekf::ImuSample<Scalar>& sample) {
    const Scalar dt = seconds<Scalar>(begin, t);
    const bool gap = dt > config_.max_imu_gap;
    if (gap) ++health_.imu_gaps;
    if (dt > kLongestBridge) {
      filter_.open(dt);
      take_pending(t, [](Nanoseconds) {});
      time_ = t;
      return Status::kGap;
    }
    inekf::ImuSample<Scalar> mean = sample;
    Scalar gyro_std = config_.gyroscope_std, accel_std = config_.accelerometer_std;
    const bool instantaneous = config_.imu_sampling == ImuSampling::kInstantaneous;
    if (gap || instantaneous) {
      // The mean over the step is somewhere between its ends, in an impact anywhere between:
      // uniform over the difference. What a gap hides may even lie beyond.
      mean.gyro = (previous.gyro + sample.gyro) / 2;
      mean.accel = (previous.accel + sample.accel) / 2;
      const Scalar part = gap ? Scalar(1) : kUniform;
      gyro_std = std::hypot(gyro_std, part * (sample.gyro - previous.gyro).norm());
      accel_std = std::hypot(accel_std, part * (sample.accel - previous.accel).norm());
    }
    filter_.observe_motion(mean, dt);
    Nanoseconds now = begin;
    const auto reach = [&](Nanoseconds stamp) {
      if (stamp <= now) return;
      const Scalar part = seconds<Scalar>(now, stamp);
      // One sample's noise, spread over the parts of a split step.
      const Scalar spread = std::sqrt(dt / part);
      filter_.propagate(mean, part, gyro_std * spread, accel_std * spread);
      now = stamp;
    };
    take_pending(t, reach);
    reach(t);
    filter_.end_step(dt, health_);
    time_ = t;
    return gap ? Status::kGap : Status::kOk;
  }

  // ---- static start

  // Cable lengths before the start: their mean over the still window is what the start uses.
  Status collect(const CableLengths<Scalar>& lengths) {
    for (int k = 0; k < 9; ++k) {
      if (std::isnan(lengths[k])) continue;
      ++still_cables_[std::size_t(k)];
      mean_lengths_[k] += (lengths[k] - mean_lengths_[k]) / Scalar(still_cables_[std::size_t(k)]);
    }
    return Status::kOk;
  }

  // Flags before the start: the spin is found from them, and the filter does not get over a wrong
  // one. At rest they are constant but for errors, so that what most samples of the still window
  // say is right where a single one is wrong with probability `contact_error` per endcap.
  void count_contacts() {
    for (std::size_t i = 0; i < contacts_.size(); ++i) still_contacts_[i] += contacts_[i] ? 1 : -1;
  }

  // All false where there were no flags.
  Flags most_contacts() const {
    Flags flags;
    for (std::size_t i = 0; i < flags.size(); ++i) flags[i] = still_contacts_[i] > 0;
    return flags;
  }

  Status start(const V3& gyro, const V3& accel) {
    count_contacts();
    const int before = start_.samples();
    const bool still = !config_.static_bias_initialization || start_.add(gyro, accel);
    if (!still) {
      if (start_.samples() <= before) forget_still();
      return Status::kNotInitialized;
    }
    const bool measured = *std::min_element(still_cables_.begin(), still_cables_.end()) > 0;
    const AtRest<Scalar> rest =
        config_.static_bias_initialization
            ? AtRest<Scalar>{start_.mean_gyro(), start_.mean_accel(), start_.samples(),
                             mean_lengths_, most_contacts()}
            : AtRest<Scalar>{config_.gyroscope_bias, accel, 1, mean_lengths_, most_contacts()};
    if (!measured || !filter_.start(rest, health_)) {
      start_.clear();
      forget_still();
      return Status::kNotInitialized;
    }
    initialized_ = true;
    return Status::kOk;
  }

  // The window was given up.
  void forget_still() {
    still_cables_.fill(0);
    still_contacts_.fill(0);
    filter_.forget_still();
  }

  Prism<Scalar> robot_;
  PrismConfig<Scalar> config_;
  Filter filter_;
  StaticStart<Scalar> start_;
  PendingQueue<Scalar> pending_;
  CableLengths<Scalar> mean_lengths_ = CableLengths<Scalar>::Zero();
  std::array<int, 9> still_cables_{};  // how many lengths of each cable are in the mean
  // IMU samples of the still window with the endcap on the ground, less those without.
  std::array<int, 6> still_contacts_{};
  Flags contacts_{};  // the last flags
  inekf::ImuSample<Scalar> last_sample_{V3::Zero(), V3::Zero()};
  PrismHealth health_;
  Stamps cable_stamps_, contact_stamps_;
  Nanoseconds time_ = 0;
  bool imu_seen_ = false, initialized_ = false;
};

}  // namespace tensegrity
