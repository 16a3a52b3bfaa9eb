// SUPERball's estimator (C §IV): ranges, inclinations and motors in, state out.
//
// The state is the position and velocity of every node; a net of springs and masses on the ground
// predicts it (`Dynamics`), an unscented filter corrects it.
//
// Order and time. Every sensor has its own stamps [ns] and rate; calls may interleave. Once started
// the filter is updated every `period`, when a measurement comes that is `max_latency` later than
// the update, or by update(t). An update takes all that came since the last one, each at its own
// stamp: nodes are taken to move on with their velocities from the stamp to the update.
//  - at or before the last update: kTooLate;
//  - behind the newest of its own kind (pair of modules, rod, IMU): kOutOfOrder; equal: kDuplicate;
//  - the first range after a time without any longer than `start_window` returns kGap: the filter
//    starts again from the ranges that follow, since a robot that rolls is anywhere by then.
//
// Start: rigid poses of the undeformed robot are searched for in the first `start_window`
// (pose_search.hpp). A filter whose innovations stay too large is lost: it starts again from the
// latest ranges if a rigid pose explains them better than its own estimate does.
//
// Memory is taken in the constructor, none afterwards; nothing throws; whatever comes in, the state
// stays finite.
//
// `Dynamics` has  Status step(MatrixRef<Scalar> states, ConstVectorRef<Scalar> rest_lengths,
// Scalar dt, int steps)  for states (2L+1 x 6n), each row one simulation.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "tensegrity/ahrs/madgwick.hpp"
#include "tensegrity/types.hpp"
#include "tensegrity/ukf/body_noise.hpp"
#include "tensegrity/ukf/pose_search.hpp"
#include "tensegrity/ukf/ranging_config.hpp"
#include "tensegrity/ukf/ranging_rows.hpp"
#include "tensegrity/ukf/ranging_state.hpp"
#include "tensegrity/ukf/unscented_filter.hpp"

namespace tensegrity::ukf {

template <typename Scalar, typename Dynamics>
class RangingEstimator {
 public:
  using Nanoseconds = std::int64_t;
  using V3 = Vector3<Scalar>;
  using Row = RangingRow<Scalar>;

  // `rest_lengths` of all cables until motors() says otherwise [m].
  RangingEstimator(const RangingRobot<Scalar>& robot, const RangingAnchors<Scalar>& anchors,
                   Dynamics dynamics, const ConstVectorRef<Scalar>& rest_lengths,
                   const RangingConfig<Scalar>& config = {})
      : config_(sane(config)),
        dynamics_(std::move(dynamics)),
        nodes_(int(robot.nodes.size())),
        model_(robot, anchors, 12 * nodes_ + 1),
        filter_(6 * nodes_, kRows, filter_settings(config, 6 * nodes_)),
        search_(robot.nodes, modules(robot), axes(robot),
                {PoseSearchSettings<Scalar>().orientations, PoseSearchSettings<Scalar>().iterations,
                 config.start_ground_std}),
        rest_lengths_(rest_lengths),
        noise_(MatrixX<Scalar>::Zero(6 * nodes_, 6 * nodes_)),
        scratch_(VectorX<Scalar>::Zero(6 * nodes_)),
        values_(VectorX<Scalar>::Zero(kRows)),
        variances_(VectorX<Scalar>::Zero(kRows)),
        newest_range_(pairs(), kNever),
        newest_internal_(std::size_t(nodes_ * nodes_), kNever),
        newest_inclination_(robot.rods.size(), kNever),
        imus_(std::size_t(nodes_)),
        pair_count_(pairs(), 0) {
    pending_.reserve(kPending);
    rows_.reserve(kRows);
    recent_.reserve(kRecent);
    distances_.reserve(kRecent);
    inclinations_.reserve(std::size_t(nodes_) + robot.rods.size());
    state_.positions = VectorX<Scalar>::Zero(3 * nodes_);
    state_.velocities = VectorX<Scalar>::Zero(3 * nodes_);
    state_.position_std = VectorX<Scalar>::Zero(3 * nodes_);
  }

  // Rest lengths of all cables [m]; used from the next update on.
  Status motors(Nanoseconds t, const ConstVectorRef<Scalar>& rest_lengths) {
    Status status = check_stamp(t, newest_motors_, false);
    if (status == Status::kOk && rest_lengths.size() != rest_lengths_.size()) {
      status = Status::kOutOfRange;
    }
    if (status == Status::kOk && !rest_lengths.allFinite()) status = Status::kNotFinite;
    if (status == Status::kOk && !(rest_lengths.minCoeff() > 0)) status = Status::kOutOfRange;
    if (status != Status::kOk) return drop(status);
    newest_motors_ = t;
    run_updates(t);
    rest_lengths_ = rest_lengths;
    return Status::kOk;
  }

  // A raw range from the module of a node to an anchor [m]; indices, not ids.
  Status range(Nanoseconds t, int node, int anchor, Scalar range) {
    const RangingAnchors<Scalar>& anchors = model_.anchors();
    if (node < 0 || node >= nodes_ || anchor < 0 || anchor >= int(anchors.positions.size())) {
      return drop(Status::kOutOfRange);
    }
    const Scalar distance = range - anchors.offsets(node, anchor);
    const Scalar std = std::hypot(config_.range_std, anchors.offset_std(node, anchor));
    Row row{Row::Kind::kRange, node, anchor, distance, std, t, Scalar(0)};
    return take_range(row, newest_range_[pair(node, anchor)]);
  }

  // A raw range between the modules of two nodes [m].
  Status internal_range(Nanoseconds t, int node, int other, Scalar range) {
    if (node < 0 || node >= nodes_ || other < 0 || other >= nodes_ || node == other) {
      return drop(Status::kOutOfRange);
    }
    const Scalar distance = range - model_.anchors().internal_offsets(node, other);
    Row row{Row::Kind::kInternalRange,  node, other,    distance,
            config_.internal_range_std, t,    Scalar(0)};
    return take_range(row, newest_internal_[std::size_t(node * nodes_ + other)]);
  }

  // Cosine of the angle between the vertical (up) and a rod, toward its first end.
  Status inclination(Nanoseconds t, int rod, Scalar cosine) {
    if (rod < 0 || rod >= int(newest_inclination_.size())) return drop(Status::kOutOfRange);
    if (!std::isfinite(cosine)) return drop(Status::kNotFinite);
    if (std::abs(cosine) > Scalar(1.001)) return drop(Status::kOutOfRange);
    Nanoseconds& newest = newest_inclination_[std::size_t(rod)];
    const Status status = check_stamp(t, newest, true);
    if (status != Status::kOk) return drop(status);
    newest = t;
    run_updates(t);
    push(inclination_row(t, rod, cosine));
    return Status::kOk;
  }

  // A sample of the IMU at a node: rate [rad/s] and specific force [m/s^2], z along the rod toward
  // its first end. The inclination of the rod comes from an AHRS of its own for each IMU. A rate
  // above `largest_rate` is kOutOfRange: the sample is left out and counted, the AHRS bridges it.
  Status imu(Nanoseconds t, int node, const V3& gyro, const V3& accel) {
    if (node < 0 || node >= nodes_) return drop(Status::kOutOfRange);
    Imu& imu = imus_[std::size_t(node)];
    Status status = check_stamp(t, imu.newest, true);
    if (status != Status::kOk) return drop(status);
    imu.newest = t;
    run_updates(t);
    if (gyro.allFinite() && gyro.norm() > config_.largest_rate) {
      ++state_.health.imu_rejected;
      return Status::kOutOfRange;
    }
    status = imu.ahrs.started() && seconds(imu.t, t) < kLongestImuGap
                 ? imu.ahrs.update(gyro, accel, seconds(imu.t, t))
                 : imu.ahrs.start(accel);
    if (status != Status::kOk) return drop(status);
    imu.t = t;
    imu.force = accel.norm();
    imu.accel = accel;
    imu.fresh = true;
    return Status::kOk;
  }

  // Brings the state to t with all measurements up to t; the next automatic update follows a
  // `period` later. kNotInitialized: there was no start yet.
  Status update(Nanoseconds t) {
    if (state_.initialized && t <= state_.t)
      return t == state_.t ? Status::kDuplicate : Status::kOutOfOrder;
    if (state_.initialized && seconds(state_.t, t) > kLongestAbsence) stop();
    try_start(t);
    if (!state_.initialized) return Status::kNotInitialized;
    while (state_.initialized && next_ < t) step(next_);
    if (state_.initialized && state_.t < t) step(t);
    return state_.initialized ? Status::kOk : Status::kNotInitialized;
  }

  bool initialized() const { return state_.initialized; }
  // After the last update.
  const RangingState<Scalar>& state() const { return state_; }
  const UnscentedFilter<Scalar>& filter() const { return filter_; }
  const RangingConfig<Scalar>& config() const { return config_; }

 private:
  static constexpr int kRows = 256;      // measurements of one update
  static constexpr int kPending = 1024;  // measurements that wait
  static constexpr int kRecent = 4096;   // ranges of the last `start_window`
  static constexpr Nanoseconds kNever = INT64_MIN;
  static constexpr Scalar kLongestAbsence = Scalar(10);    // of all sensors [s], then a new start
  static constexpr Scalar kShortestPeriod = Scalar(1e-3);  // [s]
  static constexpr Scalar kShortestStep = Scalar(1e-4);    // of the dynamics [s]
  static constexpr Scalar kLongestImuGap = Scalar(0.5);    // [s], then the AHRS starts again
  static constexpr Scalar kLongestRange = Scalar(300);     // no module of this class reaches it [m]
  static constexpr Scalar kStandard = Scalar(9.81);        // gravity [m/s^2]
  static constexpr int kRejectedInARow = 10;  // inclinations, then the AHRS starts again

  struct Imu {
    ahrs::Madgwick<Scalar> ahrs;
    Nanoseconds newest = kNever, t = kNever;
    V3 accel = V3::Zero();
    Scalar force = 0;
    bool fresh = false;
    int rejected = 0;  // in a row
  };

  static Scalar seconds(Nanoseconds from, Nanoseconds to) {
    // Stamps are anything; their difference need not fit their type.
    return Scalar((static_cast<long double>(to) - static_cast<long double>(from)) * 1e-9L);
  }
  static Nanoseconds nanoseconds(Scalar seconds) {
    return Nanoseconds(std::llround(double(seconds) * 1e9));
  }

  static std::vector<V3> modules(const RangingRobot<Scalar>& robot) {
    std::vector<V3> result(robot.nodes.size(), V3::Zero());
    for (const auto& rod : robot.rods) {
      const V3 &a = robot.nodes[std::size_t(rod[0])], &b = robot.nodes[std::size_t(rod[1])];
      const V3 inset = robot.module_inset * (b - a).normalized();
      result[std::size_t(rod[0])] = a + inset;
      result[std::size_t(rod[1])] = b - inset;
    }
    return result;
  }

  static std::vector<V3> axes(const RangingRobot<Scalar>& robot) {
    std::vector<V3> result;
    for (const auto& rod : robot.rods) {
      result.push_back(
          (robot.nodes[std::size_t(rod[0])] - robot.nodes[std::size_t(rod[1])]).normalized());
    }
    return result;
  }

  std::size_t pairs() const { return std::size_t(nodes_) * model_.anchors().positions.size(); }
  std::size_t pair(int node, int anchor) const {
    return std::size_t(node) * model_.anchors().positions.size() + std::size_t(anchor);
  }

  // Times that would keep an update from ever coming to its end.
  static RangingConfig<Scalar> sane(RangingConfig<Scalar> config) {
    config.period = std::max(config.period, kShortestPeriod);
    config.dynamics_step = std::max(config.dynamics_step, kShortestStep);
    config.max_latency = std::max(config.max_latency, Scalar(0));
    return config;
  }

  static UnscentedSettings<Scalar> filter_settings(const RangingConfig<Scalar>& config,
                                                   int dimension) {
    UnscentedSettings<Scalar> settings = config.filter;
    if (config.spread > 0) {
      settings.alpha = config.spread / std::sqrt(Scalar(dimension));
      settings.kappa = 0;
    }
    return settings;
  }

  // ---- input

  Status drop(Status status) {
    ++state_.health.dropped;
    return status;
  }

  Status check_stamp(Nanoseconds t, Nanoseconds newest, bool late_matters) const {
    if (t == newest) return Status::kDuplicate;
    if (t < newest) return Status::kOutOfOrder;
    if (late_matters && state_.initialized && t <= state_.t) return Status::kTooLate;
    return Status::kOk;
  }

  Status take_range(Row row, Nanoseconds& newest) {
    if (!std::isfinite(row.value)) return drop(Status::kNotFinite);
    if (std::abs(row.value) > kLongestRange) return drop(Status::kOutOfRange);
    const Status status = check_stamp(row.t, newest, true);
    if (status != Status::kOk) return drop(status);
    const Nanoseconds before = newest_any_range_;
    newest = row.t;
    newest_any_range_ = row.t;
    const bool gap = state_.initialized && seconds(before, row.t) > config_.start_window;
    if (gap) stop();
    // A start takes all that has one stamp: the first range behind it tells that it is complete.
    if (before != kNever && row.t > before) try_start(before);
    run_updates(row.t);
    push(row);
    if (row.kind == Row::Kind::kRange) remember(row);
    return gap ? Status::kGap : Status::kOk;
  }

  void push(const Row& row) {
    if (pending_.size() == std::size_t(kPending)) {
      pending_.erase(pending_.begin());
      ++state_.health.dropped;
    }
    pending_.push_back(row);
  }

  void remember(const Row& row) {
    forget(row.t);
    if (recent_.empty()) first_range_ = row.t;
    if (recent_.size() == std::size_t(kRecent)) recent_.erase(recent_.begin());
    recent_.push_back(row);
  }

  // Ranges that are not of the last `start_window` before t.
  void forget(Nanoseconds t) {
    const auto old = [&](const Row& r) {
      const Scalar age = seconds(r.t, t);
      return age > config_.start_window || age < 0;
    };
    recent_.erase(std::remove_if(recent_.begin(), recent_.end(), old), recent_.end());
  }

  // Waits for a new start: what the robot did meanwhile is unknown.
  void stop() {
    ++state_.health.gaps;
    state_.initialized = false;
    pending_.clear();
    recent_.clear();
  }

  // Near the vertical the cosine changes with the square of the angle.
  Row inclination_row(Nanoseconds t, int rod, Scalar cosine) const {
    const Scalar s = config_.inclination_std, sine2 = std::max(1 - cosine * cosine, Scalar(0));
    return {Row::Kind::kInclination,
            rod,
            -1,
            cosine,
            std::sqrt(s * s * sine2 + s * s * s * s / 2),
            t,
            Scalar(0)};
  }

  // ---- time

  // All automatic updates that nothing will come for any more.
  void run_updates(Nanoseconds t) {
    if (!state_.initialized) return;
    if (seconds(state_.t, t) > kLongestAbsence) {
      stop();
      return;
    }
    const Nanoseconds latency = nanoseconds(config_.max_latency);
    while (state_.initialized && next_ + latency < t) step(next_);
  }

  void step(Nanoseconds t) {
    predict(seconds(state_.t, t));
    state_.t = t;
    next_ = t + nanoseconds(config_.period);
    collect_rows(t);
    correct();
    ++state_.health.updates;
    describe();
    if (ran_away()) {
      start_anew(t);
      return;
    }
    if (config_.lost_level > 0 && state_.surprise > config_.lost_level &&
        seconds(last_start_, t) > config_.lost_time) {
      restart(t);
    }
  }

  void predict(Scalar dt) {
    if (config_.process_noise == ProcessNoise::kState) {
      noise_.setZero();
      noise_.diagonal().setConstant(config_.state_std * config_.state_std);
    } else {
      displacement_covariance<Scalar>(filter_.mean().head(3 * nodes_), model_.robot().rods,
                                      config_.body_acceleration, config_.node_acceleration,
                                      noise_.topLeftCorner(3 * nodes_, 3 * nodes_));
      integrate_acceleration<Scalar>(noise_, dt);
    }
    const int steps = std::max(1, int(std::ceil(double(dt / config_.dynamics_step) - 1e-6)));
    const auto process = [&](MatrixRef<Scalar> points) {
      if (config_.hold_rods) hold_rods_of(points);
      return dynamics_.step(points, rest_lengths_, dt / Scalar(steps), steps) == Status::kOk;
    };
    if (filter_.predict(process, noise_) != Status::kOk) ++state_.health.failed_predictions;
    if (config_.hold_rods) hold_rods();
  }

  // Moves what is stamped up to t from the pending measurements to the rows, and adds what the
  // AHRSs say: they are ahead of the update by the latency.
  void collect_rows(Nanoseconds t) {
    rows_.clear();
    std::size_t kept = 0;
    for (const Row& row : pending_) {
      if (row.t > t) {
        pending_[kept++] = row;
      } else if (rows_.size() < std::size_t(kRows)) {
        rows_.push_back(row);
        rows_.back().ahead = seconds(t, row.t);
      }
    }
    pending_.resize(kept);
    imu_rows_ = int(rows_.size());
    for (int r = 0; r < int(model_.robot().rods.size()); ++r) {
      for (const int node : model_.robot().rods[std::size_t(r)]) {
        Imu& imu = imus_[std::size_t(node)];
        if (!imu.fresh || rows_.size() >= std::size_t(kRows)) continue;
        rows_.push_back(inclination_row(imu.t, r, imu.ahrs.inclination_cosine()));
        rows_.back().ahead = seconds(t, imu.t);
        rows_.back().second = node;
        imu.fresh = false;
      }
    }
  }

  void correct() {
    const int count = int(rows_.size());
    if (count == 0) return;
    for (int r = 0; r < count; ++r) {
      values_[r] = rows_[std::size_t(r)].value;
      const Scalar std = rows_[std::size_t(r)].std;
      variances_[r] = std * std;
    }
    const Scalar gate =
        config_.gate > 0 ? config_.gate * config_.gate : std::numeric_limits<Scalar>::infinity();
    const auto measure = [&](const ConstMatrixRef<Scalar>& points, MatrixRef<Scalar> predicted) {
      model_(points, predicted, rows_);
    };
    filter_.correct(measure, values_.head(count), variances_.head(count), gate);
    count_rows();
    if (config_.hold_rods) hold_rods();
  }

  void count_rows() {
    RangingHealth& health = state_.health;
    Scalar sum = 0;
    int ranges = 0;
    for (int r = 0; r < filter_.rows(); ++r) {
      const bool accepted = filter_.accepted(r);
      const Row& row = rows_[std::size_t(r)];
      if (row.kind == Row::Kind::kInclination) {
        ++(accepted ? health.inclinations_used : health.inclinations_rejected);
        if (r >= imu_rows_) judge(imus_[std::size_t(row.second)], accepted);
        continue;
      }
      ++(accepted ? health.ranges_used : health.ranges_rejected);
      const Scalar nu = filter_.innovation(r), s = filter_.innovation_variance(r);
      if (!(s > 0)) continue;
      // A single wild range says nothing; bounded at the square of the largest useful gate.
      sum += std::min(nu * nu / s, kWildest);
      ++ranges;
    }
    if (ranges == 0) return;
    const Scalar weight = Scalar(1) - std::exp(-config_.period / config_.lost_time);
    state_.surprise += weight * (sum / Scalar(ranges) - state_.surprise);
  }

  // An AHRS that disagrees for long has been thrown off: it starts again when its IMU is at rest.
  void judge(Imu& imu, bool accepted) {
    imu.rejected = accepted ? 0 : imu.rejected + 1;
    if (imu.rejected < kRejectedInARow || std::abs(imu.force - kStandard) > Scalar(0.5)) return;
    if (imu.ahrs.start(imu.accel) == Status::kOk) imu.rejected = 0;
  }

  // Positions that are uncertain by a rotation have a mean with shorter rods, a linear correction
  // that turns a rod stretches it; at 1e5 N/m either would be a blow. Rods of the mean keep their
  // middle and direction and get their length back; their ends do not move along them.
  void hold_rods() {
    scratch_ = filter_.mean();
    const int v = 3 * nodes_;
    for (const auto& rod : model_.robot().rods) {
      auto x0 = scratch_.template segment<3>(3 * rod[0]);
      auto x1 = scratch_.template segment<3>(3 * rod[1]);
      auto v0 = scratch_.template segment<3>(v + 3 * rod[0]);
      auto v1 = scratch_.template segment<3>(v + 3 * rod[1]);
      const V3 d = x1 - x0, axis = d.normalized();
      const V3 longer = (model_.robot().rod_length - d.norm()) / 2 * axis;
      const V3 faster = -axis.dot(v1 - v0) / 2 * axis;
      x0 -= longer;
      x1 += longer;
      v0 -= faster;
      v1 += faster;
    }
    filter_.move(scratch_);
  }

  // The same for sigma points: displacements across a rod stretch it to second order.
  void hold_rods_of(MatrixRef<Scalar> points) const {
    const int v = 3 * nodes_;
    const Scalar length = model_.robot().rod_length;
    const Eigen::Index count = points.rows();
    for (const auto& rod : model_.robot().rods) {
      const int a = 3 * rod[0], b = 3 * rod[1];
      Scalar *x0[3], *x1[3], *v0[3], *v1[3];
      for (int k = 0; k < 3; ++k) {
        x0[k] = &points(0, a + k);
        x1[k] = &points(0, b + k);
        v0[k] = &points(0, v + a + k);
        v1[k] = &points(0, v + b + k);
      }
      for (Eigen::Index s = 0; s < count; ++s) {
        const Scalar dx = x1[0][s] - x0[0][s], dy = x1[1][s] - x0[1][s], dz = x1[2][s] - x0[2][s];
        const Scalar norm = std::sqrt(dx * dx + dy * dy + dz * dz);
        const Scalar axis[3] = {dx / norm, dy / norm, dz / norm};
        const Scalar longer = (length - norm) / 2;
        Scalar faster = 0;
        for (int k = 0; k < 3; ++k) faster -= axis[k] * (v1[k][s] - v0[k][s]) / 2;
        for (int k = 0; k < 3; ++k) {
          x0[k][s] -= longer * axis[k];
          x1[k][s] += longer * axis[k];
          v0[k][s] -= faster * axis[k];
          v1[k][s] += faster * axis[k];
        }
      }
    }
  }

  // ---- start

  void try_start(Nanoseconds t) {
    if (state_.initialized) return;
    forget(t);
    if (recent_.empty()) return;
    if (seconds(first_range_, t) < config_.start_window - Scalar(1e-6)) return;
    if (gather(t) < config_.start_pairs) return;
    const RigidPose<Scalar> pose = search_.best(distances_, inclinations_);
    if (!std::isfinite(pose.cost)) return;
    begin(t, pose);
  }

  // No rolling robot is this fast or this uncertain: sigma points so far apart that their cables
  // tear the net away from where it is.
  bool ran_away() const {
    return state_.velocities.cwiseAbs().maxCoeff() > kFastest ||
           state_.position_std.maxCoeff() > kMostUncertain;
  }

  // Starts from the latest ranges, or waits for more.
  void start_anew(Nanoseconds t) {
    ++state_.health.restarts;
    state_.initialized = false;
    pending_.clear();
    try_start(t);
  }

  // Searches a pose for the latest ranges, and takes it if it explains them clearly better.
  void restart(Nanoseconds t) {
    last_start_ = t;
    forget(t);
    if (gather(t) < config_.start_pairs) return;
    const RigidPose<Scalar> pose = search_.best(distances_, inclinations_);
    const auto module = [&](int i) { return model_.module(state_.positions, i); };
    const Scalar own = PoseSearch<Scalar>::cost(module, distances_);
    if (!std::isfinite(pose.cost) || pose.cost > kClearlyBetter * own) return;
    ++state_.health.restarts;
    begin(t, pose);
  }

  // The latest ranges and inclinations for the pose search; returns the number of pairs. However
  // often a pair was ranged, it counts once, since its error is mostly that of its offset.
  int gather(Nanoseconds t) {
    std::fill(pair_count_.begin(), pair_count_.end(), 0);
    distances_.clear();
    inclinations_.clear();
    int count = 0;
    for (const Row& row : recent_) count += pair_count_[pair(row.first, row.second)]++ == 0;
    for (const Row& row : recent_) {
      const Scalar repeated = std::sqrt(Scalar(pair_count_[pair(row.first, row.second)]));
      distances_.push_back({row.first, model_.anchors().positions[std::size_t(row.second)],
                            row.value, row.std * repeated});
    }
    for (int r = 0; r < int(model_.robot().rods.size()); ++r) {
      for (const int node : model_.robot().rods[std::size_t(r)]) {
        const Imu& imu = imus_[std::size_t(node)];
        if (!imu.ahrs.started() || seconds(imu.t, t) > kLongestImuGap) continue;
        const Row row = inclination_row(t, r, imu.ahrs.inclination_cosine());
        inclinations_.push_back({r, row.value, row.std});
      }
      const Row* newest = nullptr;
      for (const Row& row : pending_) {
        if (row.kind == Row::Kind::kInclination && row.first == r) newest = &row;
      }
      if (newest != nullptr) inclinations_.push_back({r, newest->value, newest->std});
    }
    return count;
  }

  void begin(Nanoseconds t, const RigidPose<Scalar>& pose) {
    auto positions = scratch_.head(3 * nodes_);
    for (int i = 0; i < nodes_; ++i) {
      scratch_.template segment<3>(3 * i) =
          pose.rotation * model_.robot().nodes[std::size_t(i)] + pose.position;
    }
    scratch_.tail(3 * nodes_).setZero();
    noise_.setZero();
    displacement_covariance<Scalar>(positions, model_.robot().rods, config_.start_body_std,
                                    config_.start_node_std,
                                    noise_.topLeftCorner(3 * nodes_, 3 * nodes_));
    displacement_covariance<Scalar>(positions, model_.robot().rods, config_.start_speed_std,
                                    config_.start_speed_std / 2,
                                    noise_.bottomRightCorner(3 * nodes_, 3 * nodes_));
    if (filter_.set(scratch_, noise_) != Status::kOk) return;
    state_.t = last_start_ = t;
    next_ = t + nanoseconds(config_.period);
    state_.initialized = true;
    state_.surprise = 1;
    std::size_t kept = 0;
    for (const Row& row : pending_) {
      if (row.t > t) pending_[kept++] = row;
    }
    pending_.resize(kept);
    describe();
  }

  void describe() {
    const int n = nodes_;
    const VectorX<Scalar>& mean = filter_.mean();
    state_.positions = mean.head(3 * n);
    state_.velocities = mean.tail(3 * n);
    for (int i = 0; i < 3 * n; ++i) state_.position_std[i] = std::sqrt(filter_.covariance(i, i));
    state_.centre_of_mass.setZero();
    state_.centre_of_mass_velocity.setZero();
    state_.centre_of_mass_covariance.setZero();
    for (int i = 0; i < n; ++i) {
      state_.centre_of_mass += mean.template segment<3>(3 * i) / Scalar(n);
      state_.centre_of_mass_velocity += mean.template segment<3>(3 * (n + i)) / Scalar(n);
      for (int j = 0; j < n; ++j) {
        for (int a = 0; a < 3; ++a) {
          for (int b = 0; b < 3; ++b) {
            state_.centre_of_mass_covariance(a, b) +=
                filter_.covariance(3 * i + a, 3 * j + b) / Scalar(n * n);
          }
        }
      }
    }
    find_face();
  }

  void find_face() {
    auto& face = state_.face;
    int count = 0;
    for (int i = 0; i < nodes_; ++i) {
      const Scalar z = state_.positions[3 * i + 2];
      int place = count < 3 ? count++ : (z < height(face[2]) ? 2 : -1);
      if (place < 0) continue;
      for (; place > 0 && z < height(face[std::size_t(place - 1)]); --place) {
        face[std::size_t(place)] = face[std::size_t(place - 1)];
      }
      face[std::size_t(place)] = i;
    }
  }
  Scalar height(int node) const { return state_.positions[3 * node + 2]; }

  static constexpr Scalar kFastest = Scalar(50);        // [m/s]
  static constexpr Scalar kMostUncertain = Scalar(20);  // [m]
  static constexpr Scalar kWildest = Scalar(16);
  static constexpr Scalar kClearlyBetter = Scalar(0.7);

  RangingConfig<Scalar> config_;
  Dynamics dynamics_;
  int nodes_;
  RangingModel<Scalar> model_;
  UnscentedFilter<Scalar> filter_;
  PoseSearch<Scalar> search_;
  VectorX<Scalar> rest_lengths_;
  MatrixX<Scalar> noise_;
  VectorX<Scalar> scratch_, values_, variances_;
  std::vector<Row> pending_, rows_, recent_;
  std::vector<PointDistance<Scalar>> distances_;
  std::vector<AxisInclination<Scalar>> inclinations_;
  std::vector<Nanoseconds> newest_range_, newest_internal_, newest_inclination_;
  std::vector<Imu> imus_;
  std::vector<int> pair_count_;
  Nanoseconds newest_motors_ = kNever, newest_any_range_ = kNever;
  Nanoseconds next_ = 0, last_start_ = 0;
  Nanoseconds first_range_ = 0;  // since when ranges have come without a gap
  int imu_rows_ = 0;             // the first row that an IMU of ours gave
  RangingState<Scalar> state_;
};

}  // namespace tensegrity::ukf
