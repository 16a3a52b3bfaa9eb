// The streaming estimator, and the replay of whole recordings at C++ speed.
#include "tensegrity/estimator/prism_estimator.hpp"

#include <pybind11/functional.h>

#include <chrono>
#include <optional>
#include <variant>

#include "bindings.hpp"
#include "numbers.hpp"

namespace tensegrity::bindings {

namespace {

using Loose = PrismEstimator<double, LooseFilter<double>>;
using Tight = PrismEstimator<double, TightFilter<double>>;
using State = PrismState<double>;
using Config = PrismConfig<double>;
using V3 = Vector3<double>;

using Stamps = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Bools = py::array_t<bool, py::array::c_style | py::array::forcecast>;

// Either filter behind one interface, for Python chooses by the configuration; and the robot's
// corrections of what its sensors say, which are part of the robot's description in Python.
class Estimator {
 public:
  // imu_rotation: from the frame of the base rod's IMU to the body frame. cable_offsets [m] are
  // taken off the lengths. Without them samples stay as they are, to the last bit.
  Estimator(const Prism<double>& robot, const Config& config, bool tight,
            const std::optional<Matrix3<double>>& imu_rotation,
            const std::optional<CableLengths<double>>& cable_offsets)
      : imu_rotation_(imu_rotation), cable_offsets_(cable_offsets) {
    if (tight) {
      any_.emplace<Tight>(robot, config);
    } else {
      any_.emplace<Loose>(robot, config);
    }
  }

  Status imu(Nanoseconds t, const V3& gyro, const V3& accel) {
    return visit([&](auto& e) { return e.imu(t, to_body(gyro), to_body(accel)); });
  }
  Status cables(Nanoseconds t, const CableLengths<double>& lengths) {
    return visit([&](auto& e) { return e.cables(t, without_offsets(lengths)); });
  }
  Status rod_imu(Nanoseconds t, int rod, const V3& gyro, const V3& accel) {
    return visit([&](auto& e) { return e.rod_imu(t, rod, gyro, accel); });
  }
  Status contacts(Nanoseconds t, const std::array<bool, 6>& flags) {
    return visit([&](auto& e) { return e.contacts(t, flags); });
  }
  bool initialized() const {
    return std::visit([](const auto& e) { return e.initialized(); }, any_);
  }
  State state() const {
    return std::visit([](const auto& e) { return e.state(); }, any_);
  }
  State state_without_shape_covariance() const {
    return std::visit([](const auto& e) { return e.state_without_shape_covariance(); }, any_);
  }

 private:
  template <typename Call>
  Status visit(const Call& call) {
    return std::visit(call, any_);
  }

  V3 to_body(const V3& v) const { return imu_rotation_ ? V3(*imu_rotation_ * v) : v; }
  CableLengths<double> without_offsets(const CableLengths<double>& lengths) const {
    return cable_offsets_ ? CableLengths<double>(lengths - *cable_offsets_) : lengths;
  }

  std::optional<Matrix3<double>> imu_rotation_;
  std::optional<CableLengths<double>> cable_offsets_;
  std::variant<Loose, Tight> any_;
};

void check_rows(const py::array& a, const char* name, py::ssize_t rows, py::ssize_t cols) {
  const bool good = cols == 0 ? a.ndim() == 1 && a.shape(0) == rows
                              : a.ndim() == 2 && a.shape(0) == rows && a.shape(1) == cols;
  if (!good) {
    throw py::value_error(std::string(name) + ": expected shape (" + std::to_string(rows) +
                          (cols == 0 ? ",)" : ", " + std::to_string(cols) + ")"));
  }
}

Eigen::Vector4d quaternion(const Matrix3<double>& rotation) {
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return q.normalized().coeffs();  // x y z w
}

// One array of a recording, filled row by row.
template <typename T>
class Column {
 public:
  // tail: the shape of a row.
  Column(const char* name, py::ssize_t capacity, std::vector<py::ssize_t> tail = {})
      : name_(name), shape_(std::move(tail)) {
    for (const py::ssize_t n : shape_) width_ *= n;
    shape_.insert(shape_.begin(), capacity);
    array_ = py::array_t<T>(shape_);
    next_ = array_.mutable_data();
  }

  // Where the next row goes. Needs no GIL.
  T* next() {
    T* const row = next_;
    next_ += width_;
    return row;
  }

  // Gives the array of the first `rows` away.
  void move_to(py::dict& out, py::ssize_t rows) {
    shape_.front() = rows;
    array_.resize(shape_, false);  // nobody else has seen it
    out[name_] = std::move(array_);
  }

 private:
  const char* name_;
  std::vector<py::ssize_t> shape_;
  py::ssize_t width_ = 1;
  py::array_t<T> array_;
  T* next_;
};

// One row per IMU sample after the start, written to NumPy arrays as it comes.
class Recorder {
 public:
  explicit Recorder(py::ssize_t capacity)
      : t_("t_ns", capacity),
        position_("position", capacity, {3}),
        quaternion_("quaternion", capacity, {4}),
        velocity_("velocity", capacity, {3}),
        gyro_bias_("gyro_bias", capacity, {3}),
        accel_bias_("accel_bias", capacity, {3}),
        spin_("spin", capacity),
        endcaps_body_("endcaps_body", capacity, {6, 3}),
        endcaps_world_("endcaps_world", capacity, {6, 3}),
        position_covariance_("position_covariance", capacity, {3, 3}),
        orientation_covariance_("orientation_covariance", capacity, {3, 3}),
        velocity_covariance_("velocity_covariance", capacity, {3, 3}),
        load_shares_("load_shares", capacity, {6}),
        cable_nis_("cable_nis", capacity),
        ground_nis_("ground_nis", capacity),
        contacts_("contacts", capacity, {6}) {
    health_.reserve(kCounters.size());
    for (const Counter& counter : kCounters) health_.emplace_back(counter.name, capacity);
  }

  void add(const State& s) {
    *t_.next() = s.t;
    Eigen::Map<V3>{position_.next()} = s.position;
    Eigen::Map<Eigen::Vector4d>{quaternion_.next()} = quaternion(s.rotation);
    Eigen::Map<V3>{velocity_.next()} = s.velocity;
    Eigen::Map<V3>{gyro_bias_.next()} = s.gyro_bias;
    Eigen::Map<V3>{accel_bias_.next()} = s.accel_bias;
    *spin_.next() = s.spin;
    Eigen::Map<Endcaps<double>>{endcaps_body_.next()} = s.endcaps_body;
    Eigen::Map<Endcaps<double>>{endcaps_world_.next()} = s.endcaps_world;
    // Symmetric: rows and columns are the same.
    Eigen::Map<Matrix3<double>>{position_covariance_.next()} = s.position_covariance;
    Eigen::Map<Matrix3<double>>{orientation_covariance_.next()} = s.rotation_covariance;
    Eigen::Map<Matrix3<double>>{velocity_covariance_.next()} = s.velocity_covariance;
    std::copy(s.load_shares.begin(), s.load_shares.end(), load_shares_.next());
    *cable_nis_.next() = s.cable_nis;
    *ground_nis_.next() = s.ground_nis;
    std::copy(s.contacts.begin(), s.contacts.end(), contacts_.next());
    for (std::size_t k = 0; k < kCounters.size(); ++k) {
      *health_[k].next() = s.health.*kCounters[k].member;
    }
    ++rows_;
  }

  // Gives the arrays away: for the end.
  py::dict arrays() {
    py::dict out;
    t_.move_to(out, rows_);
    for (Column<double>* column :
         {&position_, &quaternion_, &velocity_, &gyro_bias_, &accel_bias_, &spin_, &endcaps_body_,
          &endcaps_world_, &position_covariance_, &orientation_covariance_, &velocity_covariance_,
          &load_shares_, &cable_nis_, &ground_nis_}) {
      column->move_to(out, rows_);
    }
    contacts_.move_to(out, rows_);
    py::dict health;
    for (Column<std::int64_t>& column : health_) column.move_to(health, rows_);
    out["health"] = health;
    return out;
  }

 private:
  struct Counter {
    const char* name;
    std::uint32_t PrismHealth::* member;
  };
  static constexpr std::array<Counter, 10> kCounters{{
      {"imu_dropped", &PrismHealth::imu_dropped},
      {"imu_gaps", &PrismHealth::imu_gaps},
      {"cables_dropped", &PrismHealth::cables_dropped},
      {"contacts_dropped", &PrismHealth::contacts_dropped},
      {"shape_failures", &PrismHealth::shape_failures},
      {"contacts_rejected", &PrismHealth::contacts_rejected},
      {"cables_rejected", &PrismHealth::cables_rejected},
      {"spin_resets", &PrismHealth::spin_resets},
      {"velocity_resets", &PrismHealth::velocity_resets},
      {"terrain_mismatches", &PrismHealth::terrain_mismatches},
  }};

  Column<std::int64_t> t_;
  Column<double> position_, quaternion_, velocity_, gyro_bias_, accel_bias_, spin_, endcaps_body_,
      endcaps_world_, position_covariance_, orientation_covariance_, velocity_covariance_,
      load_shares_, cable_nis_, ground_nis_;
  Column<bool> contacts_;
  std::vector<Column<std::int64_t>> health_;
  py::ssize_t rows_ = 0;
};

// The samples of an IMU on another rod.
struct RodImu {
  int rod;  // 1: r23, 2: r45
  Stamps t;
  Doubles gyro, accel;
  py::ssize_t next = 0;
};

// Feeds a whole recording: at equal stamps the other rods' IMUs go first, then the base rod's, then
// contacts, then cables.
py::tuple replay(Estimator& estimator, const Stamps& imu_t, const Doubles& gyro,
                 const Doubles& accel, const Stamps& cables_t, const Doubles& lengths,
                 const std::optional<Stamps>& contacts_t, const std::optional<Bools>& flags,
                 const std::vector<std::tuple<int, Stamps, Doubles, Doubles>>& rod_imus,
                 const std::optional<std::function<void(double)>>& progress) {
  check_rows(imu_t, "imu_t", imu_t.size(), 0);
  check_rows(gyro, "gyro", imu_t.size(), 3);
  check_rows(accel, "accel", imu_t.size(), 3);
  check_rows(cables_t, "cables_t", cables_t.size(), 0);
  check_rows(lengths, "lengths", cables_t.size(), 9);
  if (contacts_t.has_value() != flags.has_value()) {
    throw py::value_error("contacts_t and flags go together");
  }
  if (flags) check_rows(*flags, "flags", contacts_t->size(), 6);
  std::vector<RodImu> others;
  for (const auto& [rod, t, rate, force] : rod_imus) {
    if (rod != 1 && rod != 2) throw py::value_error("rod_imus: expected rod 1 (r23) or 2 (r45)");
    check_rows(t, "rod_imus t", t.size(), 0);
    check_rows(rate, "rod_imus gyro", t.size(), 3);
    check_rows(force, "rod_imus accel", t.size(), 3);
    others.push_back({rod, t, rate, force});
  }

  const py::ssize_t imus = imu_t.size(), cables = cables_t.size();
  const py::ssize_t contacts = contacts_t ? contacts_t->size() : 0;
  Recorder recorder(imus);
  py::ssize_t c = 0, f = 0;
  std::chrono::steady_clock::duration elapsed{0};
  constexpr py::ssize_t kChunk = 2000;  // samples between two looks at signals and progress
  for (py::ssize_t begin = 0; begin < imus; begin += kChunk) {
    const py::ssize_t end = std::min(imus, begin + kChunk);
    {
      py::gil_scoped_release release;
      const auto started = std::chrono::steady_clock::now();
      for (py::ssize_t k = begin; k < end; ++k) {
        const Nanoseconds t = imu_t.data()[k];
        // What came before this sample waits in the estimator until the sample reaches it.
        const auto feed_until = [&](auto&& due) {
          while (f < contacts && due(contacts_t->data()[f])) {
            std::array<bool, 6> now;
            for (std::size_t i = 0; i < 6; ++i) now[i] = flags->data()[6 * f + py::ssize_t(i)];
            estimator.contacts(contacts_t->data()[f], now);
            ++f;
          }
          while (c < cables && due(cables_t.data()[c])) {
            estimator.cables(cables_t.data()[c],
                             Eigen::Map<const CableLengths<double>>(lengths.data() + 9 * c));
            ++c;
          }
        };
        feed_until([t](Nanoseconds stamp) { return stamp < t; });
        for (RodImu& other : others) {
          for (; other.next < other.t.size() && other.t.data()[other.next] <= t; ++other.next) {
            estimator.rod_imu(other.t.data()[other.next], other.rod,
                              Eigen::Map<const V3>(other.gyro.data() + 3 * other.next),
                              Eigen::Map<const V3>(other.accel.data() + 3 * other.next));
          }
        }
        estimator.imu(t, Eigen::Map<const V3>(gyro.data() + 3 * k),
                      Eigen::Map<const V3>(accel.data() + 3 * k));
        feed_until([t](Nanoseconds stamp) { return stamp == t; });
        if (estimator.initialized()) {
          recorder.add(estimator.state_without_shape_covariance());
        }
      }
      elapsed += std::chrono::steady_clock::now() - started;
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (progress) (*progress)(double(end) / double(imus));
  }
  return py::make_tuple(recorder.arrays(), std::chrono::duration<double>(elapsed).count());
}

std::array<bool, 6> six_flags(const Bools& flags) {
  check_rows(flags, "flags", 6, 0);
  std::array<bool, 6> out;
  std::copy(flags.data(), flags.data() + 6, out.begin());
  return out;
}

}  // namespace

void bind_estimator(py::module_& m) {
  py::native_enum<ShapeMethod>(m, "ShapeMethod", "enum.Enum")
      .value("LEAST_SQUARES", ShapeMethod::kLeastSquares)
      .value("TRACKER", ShapeMethod::kTracker)
      .finalize();
  py::native_enum<SpinMethod>(m, "SpinMethod", "enum.Enum")
      .value("FIXED", SpinMethod::kFixed)
      .value("ESTIMATED", SpinMethod::kEstimated)
      .finalize();
  py::native_enum<ContactPoint>(m, "ContactPoint", "enum.Enum")
      .value("CENTRE", ContactPoint::kCentre)
      .value("ROLLING", ContactPoint::kRolling)
      .finalize();
  py::native_enum<ContactNoise>(m, "ContactNoise", "enum.Enum")
      .value("CONSTANT", ContactNoise::kConstant)
      .value("FROM_SHAPE", ContactNoise::kFromShape)
      .finalize();
  py::native_enum<ImuSampling>(m, "ImuSampling", "enum.Enum")
      .value("INTERVAL_MEAN", ImuSampling::kIntervalMean)
      .value("INSTANTANEOUS", ImuSampling::kInstantaneous)
      .finalize();
  py::native_enum<Terrain>(m, "Terrain", "enum.Enum")
      .value("FLAT", Terrain::kFlat)
      .value("SLOPE", Terrain::kSlope)
      .value("UNKNOWN", Terrain::kUnknown)
      .finalize();

  py::class_<Config>(m, "PrismConfig", "Settings, priors and noises of the prism's estimator.")
      .def(py::init<>())
      .def_readwrite("shape", &Config::shape)
      .def_readwrite("spin", &Config::spin)
      .def_readwrite("contact_point", &Config::contact_point)
      .def_readwrite("contact_noise", &Config::contact_noise)
      .def_readwrite("max_shape_iterations", &Config::max_shape_iterations)
      .def_readwrite("imu_sampling", &Config::imu_sampling)
      .def_readwrite("static_bias_initialization", &Config::static_bias_initialization)
      .def_readwrite("init_bias_size", &Config::init_bias_size)
      .def_readwrite("static_gyro_limit", &Config::static_gyro_limit)
      .def_readwrite("static_accel_limit", &Config::static_accel_limit)
      .def_readwrite("max_imu_gap", &Config::max_imu_gap)
      .def_readwrite("max_latency", &Config::max_latency)
      .def_readwrite("chi_square_gate", &Config::chi_square_gate)
      .def_readwrite("gravity", &Config::gravity)
      .def_readwrite("orientation_std", &Config::orientation_std)
      .def_readwrite("velocity_std", &Config::velocity_std)
      .def_readwrite("position_std", &Config::position_std)
      .def_readwrite("gyroscope_bias", &Config::gyroscope_bias)
      .def_readwrite("gyroscope_bias_std", &Config::gyroscope_bias_std)
      .def_readwrite("accelerometer_bias", &Config::accelerometer_bias)
      .def_readwrite("accelerometer_bias_std", &Config::accelerometer_bias_std)
      .def_readwrite("spin_prior_std", &Config::spin_prior_std)
      .def_readwrite("gyroscope_std", &Config::gyroscope_std)
      .def_readwrite("accelerometer_std", &Config::accelerometer_std)
      .def_readwrite("gyroscope_bias_walk", &Config::gyroscope_bias_walk)
      .def_readwrite("accelerometer_bias_walk", &Config::accelerometer_bias_walk)
      .def_readwrite("cable_std", &Config::cable_std)
      .def_readwrite("contact_std", &Config::contact_std)
      .def_readwrite("contact_position_std", &Config::contact_position_std)
      .def_readwrite("spin_walk", &Config::spin_walk)
      .def_readwrite("shape_std_rest", &Config::shape_std_rest)
      .def_readwrite("shape_std_moving", &Config::shape_std_moving)
      .def_readwrite("terrain", &Config::terrain)
      .def_readwrite("friction", &Config::friction)
      .def_readwrite("contact_error", &Config::contact_error)
      .def_readwrite("rod_rate_std", &Config::rod_rate_std)
      .def_readwrite("rod_inclination_std", &Config::rod_inclination_std)
      .def_readwrite("cable_gate", &Config::cable_gate)
      .def_readwrite("cable_offset_std", &Config::cable_offset_std)
      .def_readwrite("ground_slope_std", &Config::ground_slope_std)
      .def_readwrite("endcap_acceleration_rest", &Config::endcap_acceleration_rest)
      .def_readwrite("endcap_acceleration_moving", &Config::endcap_acceleration_moving)
      .def_readwrite("active_force", &Config::active_force)
      .def_readwrite("active_rate", &Config::active_rate)
      .def_readwrite("creep_std", &Config::creep_std)
      .def_readwrite("slip_length", &Config::slip_length)
      .def_readwrite("slip_speed", &Config::slip_speed)
      .def_readwrite("foot_rise_std", &Config::foot_rise_std)
      .def_readwrite("foot_height_std", &Config::foot_height_std)
      .def_readwrite("ground_height_walk", &Config::ground_height_walk)
      .def_readwrite("ground_slope_walk", &Config::ground_slope_walk);

  py::class_<PrismHealth>(m, "PrismHealth", "Counters since construction; see the C++ header.")
      .def_readonly("imu_dropped", &PrismHealth::imu_dropped)
      .def_readonly("imu_gaps", &PrismHealth::imu_gaps)
      .def_readonly("cables_dropped", &PrismHealth::cables_dropped)
      .def_readonly("contacts_dropped", &PrismHealth::contacts_dropped)
      .def_readonly("shape_failures", &PrismHealth::shape_failures)
      .def_readonly("contacts_rejected", &PrismHealth::contacts_rejected)
      .def_readonly("cables_rejected", &PrismHealth::cables_rejected)
      .def_readonly("spin_resets", &PrismHealth::spin_resets)
      .def_readonly("velocity_resets", &PrismHealth::velocity_resets)
      .def_readonly("terrain_mismatches", &PrismHealth::terrain_mismatches);

  using Six = Eigen::Matrix<double, 6, 3>;
  py::class_<State>(m, "PrismState", "One state of the prism, in SI units.")
      .def_readonly("t", &State::t, "stamp [ns]")
      .def_readonly("initialized", &State::initialized)
      .def_readonly("rotation", &State::rotation, "(3, 3), body to world")
      .def_property_readonly(
          "quaternion", [](const State& s) { return quaternion(s.rotation); }, "(4,) x y z w")
      .def_readonly("position", &State::position, "(3,), world [m]")
      .def_readonly("velocity", &State::velocity, "(3,), world [m/s]")
      .def_readonly("gyro_bias", &State::gyro_bias, "(3,), body [rad/s]")
      .def_readonly("accel_bias", &State::accel_bias, "(3,), body [m/s^2]")
      .def_readonly("spin", &State::spin, "phi [rad]")
      .def_readonly("spin_variance", &State::spin_variance, "[rad^2]")
      .def_property_readonly(
          "endcaps_body", [](const State& s) -> Six { return s.endcaps_body.transpose(); },
          "(6, 3) [m]")
      .def_property_readonly(
          "endcaps_world", [](const State& s) -> Six { return s.endcaps_world.transpose(); },
          "(6, 3) [m]")
      .def_readonly("endcap_covariance", &State::endcap_covariance, "(18, 18), body [m^2]")
      .def_readonly("rotation_covariance", &State::rotation_covariance, "(3, 3), world [rad^2]")
      .def_readonly("velocity_covariance", &State::velocity_covariance, "(3, 3) [m^2/s^2]")
      .def_readonly("position_covariance", &State::position_covariance, "(3, 3) [m^2]")
      .def_readonly("contacts", &State::contacts, "endcaps held as contacts")
      .def_readonly("load_shares", &State::load_shares,
                    "share of the weight each contact carries, six numbers that sum to 1")
      .def_readonly("cable_nis", &State::cable_nis,
                    "of the newest lengths, per degree of freedom; NaN: none")
      .def_readonly("ground_nis", &State::ground_nis,
                    "of the newest heights of the feet, per degree of freedom; NaN: none")
      .def_readonly("health", &State::health);

  py::class_<Estimator>(m, "PrismEstimator",
                        "Streaming estimator: IMU, cables and contacts in, state out.")
      .def(
          py::init<const Prism<double>&, const Config&, bool, const std::optional<Matrix3<double>>&,
                   const std::optional<CableLengths<double>>&>(),
          py::arg("robot"), py::arg("config"), py::arg("tight") = true, py::kw_only(),
          py::arg("imu_rotation") = py::none(), py::arg("cable_offsets") = py::none(),
          "imu_rotation (3, 3) turns IMU samples into the body frame, cable_offsets (9,) [m] are "
          "taken off the lengths; None leaves them as they are.")
      .def(
          "imu",
          [](Estimator& e, Nanoseconds t, const Numbers<3>& gyro, const Numbers<3>& accel) {
            return e.imu(t, *gyro, *accel);
          },
          py::arg("t"), py::arg("gyro"), py::arg("accel"),
          "One IMU sample: t [ns], angular velocity (3,) [rad/s], specific force (3,) [m/s^2], in "
          "the frame of the IMU.")
      .def(
          "rod_imu",
          [](Estimator& e, Nanoseconds t, int rod, const Numbers<3>& gyro,
             const Numbers<3>& accel) { return e.rod_imu(t, rod, *gyro, *accel); },
          py::arg("t"), py::arg("rod"), py::arg("gyro"), py::arg("accel"),
          "An IMU on rod 1 (r23) or 2 (r45), z toward its even endcap: t [ns], rate (3,) [rad/s], "
          "specific force (3,) [m/s^2]. Before the base rod's sample of the same stamp.")
      .def(
          "cables",
          [](Estimator& e, Nanoseconds t, const Numbers<9>& lengths) {
            return e.cables(t, *lengths);
          },
          py::arg("t"), py::arg("lengths"),
          "Cable lengths: t [ns], (9,) [m] in the order of PRISM_CABLES, NaN: not measured. "
          "Offsets are taken off.")
      .def(
          "contacts",
          [](Estimator& e, Nanoseconds t, const Bools& flags) {
            return e.contacts(t, six_flags(flags));
          },
          py::arg("t"), py::arg("flags"), "Contact flags: t [ns], (6,) true on the ground.")
      .def_property_readonly("state", &Estimator::state)
      .def_property_readonly("initialized", &Estimator::initialized)
      .def("replay", &replay, py::arg("imu_t"), py::arg("gyro"), py::arg("accel"),
           py::arg("cables_t"), py::arg("lengths"), py::arg("contacts_t") = py::none(),
           py::arg("flags") = py::none(),
           py::arg("rod_imus") = std::vector<std::tuple<int, Stamps, Doubles, Doubles>>{},
           py::arg("progress") = py::none(),
           "Feeds a whole recording and returns (arrays by name, seconds in the estimator).");
}

}  // namespace tensegrity::bindings
