// The streaming estimator, and the replay of whole recordings at C++ speed.
#include "tensegrity/estimator/prism_estimator.hpp"

#include <pybind11/functional.h>

#include <chrono>
#include <variant>

#include "bindings.hpp"

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

// Either filter behind one interface: Python chooses by the configuration.
class Estimator {
 public:
  Estimator(const Prism<double>& robot, const Config& config, bool tight) {
    if (tight) {
      any_.emplace<Tight>(robot, config);
    } else {
      any_.emplace<Loose>(robot, config);
    }
  }

  Status imu(Nanoseconds t, const V3& gyro, const V3& accel) {
    return visit([&](auto& e) { return e.imu(t, gyro, accel); });
  }
  Status cables(Nanoseconds t, const CableLengths<double>& lengths) {
    return visit([&](auto& e) { return e.cables(t, lengths); });
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

 private:
  template <typename Call>
  Status visit(const Call& call) {
    return std::visit(call, any_);
  }

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

// One row per IMU sample after the start, as NumPy arrays.
class Recorder {
 public:
  explicit Recorder(std::size_t capacity) { states_.reserve(capacity); }
  void add(const State& s) { states_.push_back(s); }

  py::dict arrays() const {
    py::dict out;
    const auto column = [&](const char* name, std::vector<py::ssize_t> tail, auto&& fill) {
      std::vector<py::ssize_t> shape{py::ssize_t(states_.size())};
      py::ssize_t width = 1;
      for (const py::ssize_t n : tail) {
        shape.push_back(n);
        width *= n;
      }
      py::array_t<double> a(shape);
      double* data = a.mutable_data();
      for (std::size_t k = 0; k < states_.size(); ++k)
        fill(states_[k], data + py::ssize_t(k) * width);
      out[name] = a;
    };
    using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const auto vector = [](const V3& v, double* to) { Eigen::Map<V3>{to} = v; };
    const auto matrix = [](const Matrix3<double>& m, double* to) { Eigen::Map<RowMajor3>{to} = m; };
    py::array_t<std::int64_t> t(py::ssize_t(states_.size()));
    for (std::size_t k = 0; k < states_.size(); ++k) t.mutable_data()[k] = states_[k].t;
    out["t_ns"] = t;
    column("position", {3}, [&](const State& s, double* to) { vector(s.position, to); });
    column("quaternion", {4}, [](const State& s, double* to) {
      Eigen::Map<Eigen::Vector4d>{to} = quaternion(s.rotation);
    });
    column("velocity", {3}, [&](const State& s, double* to) { vector(s.velocity, to); });
    column("gyro_bias", {3}, [&](const State& s, double* to) { vector(s.gyro_bias, to); });
    column("accel_bias", {3}, [&](const State& s, double* to) { vector(s.accel_bias, to); });
    column("spin", {}, [](const State& s, double* to) { *to = s.spin; });
    column("endcaps_body", {6, 3},
           [](const State& s, double* to) { Eigen::Map<Endcaps<double>>{to} = s.endcaps_body; });
    column("endcaps_world", {6, 3},
           [](const State& s, double* to) { Eigen::Map<Endcaps<double>>{to} = s.endcaps_world; });
    column("position_covariance", {3, 3},
           [&](const State& s, double* to) { matrix(s.position_covariance, to); });
    column("orientation_covariance", {3, 3},
           [&](const State& s, double* to) { matrix(s.rotation_covariance, to); });
    column("velocity_covariance", {3, 3},
           [&](const State& s, double* to) { matrix(s.velocity_covariance, to); });
    column("load_shares", {6},
           [](const State& s, double* to) { std::copy_n(s.load_shares.begin(), 6, to); });
    column("cable_nis", {}, [](const State& s, double* to) { *to = s.cable_nis; });
    column("ground_nis", {}, [](const State& s, double* to) { *to = s.ground_nis; });
    py::array_t<bool> contacts({py::ssize_t(states_.size()), py::ssize_t(6)});
    for (std::size_t k = 0; k < states_.size(); ++k) {
      for (std::size_t i = 0; i < 6; ++i)
        contacts.mutable_data()[6 * k + i] = states_[k].contacts[i];
    }
    out["contacts"] = contacts;
    py::dict health;
    const auto counter = [&](const char* name, std::uint32_t PrismHealth::* member) {
      py::array_t<std::int64_t> a(py::ssize_t(states_.size()));
      for (std::size_t k = 0; k < states_.size(); ++k) {
        a.mutable_data()[k] = states_[k].health.*member;
      }
      health[name] = a;
    };
    counter("imu_dropped", &PrismHealth::imu_dropped);
    counter("imu_gaps", &PrismHealth::imu_gaps);
    counter("cables_dropped", &PrismHealth::cables_dropped);
    counter("contacts_dropped", &PrismHealth::contacts_dropped);
    counter("shape_failures", &PrismHealth::shape_failures);
    counter("contacts_rejected", &PrismHealth::contacts_rejected);
    counter("cables_rejected", &PrismHealth::cables_rejected);
    counter("spin_resets", &PrismHealth::spin_resets);
    counter("velocity_resets", &PrismHealth::velocity_resets);
    counter("terrain_mismatches", &PrismHealth::terrain_mismatches);
    out["health"] = health;
    return out;
  }

 private:
  std::vector<State> states_;
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
  Recorder recorder{std::size_t(imus)};
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
        if (estimator.initialized()) recorder.add(estimator.state());
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
      .def(py::init<const Prism<double>&, const Config&, bool>(), py::arg("robot"),
           py::arg("config"), py::arg("tight") = true)
      .def("imu", &Estimator::imu, py::arg("t"), py::arg("gyro"), py::arg("accel"),
           "One IMU sample: t [ns], angular velocity (3,) [rad/s], specific force (3,) [m/s^2].")
      .def("rod_imu", &Estimator::rod_imu, py::arg("t"), py::arg("rod"), py::arg("gyro"),
           py::arg("accel"),
           "An IMU on rod 1 (r23) or 2 (r45), z toward its even endcap: t [ns], rate (3,) [rad/s], "
           "specific force (3,) [m/s^2]. Before the base rod's sample of the same stamp.")
      .def("cables", &Estimator::cables, py::arg("t"), py::arg("lengths"),
           "Cable lengths: t [ns], (9,) [m] in the order of PRISM_CABLES, NaN: not measured.")
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
