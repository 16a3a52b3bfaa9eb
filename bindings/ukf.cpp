// The generic unscented filter with processes and measurements in Python, and the estimator of
// ranging robots: sample by sample and over recordings at C++ speed.
#include "bindings.hpp"
#include "tensegrity/dynamics/single_precision.hpp"
#include "tensegrity/ukf/ranging_estimator.hpp"

namespace tensegrity::bindings {

namespace {

using Filter = ukf::UnscentedFilter<double>;
using Settings = ukf::UnscentedSettings<double>;
using Matrix = ukf::MatrixX<double>;
using VectorD = ukf::VectorX<double>;

Matrix call(const py::function& function, const ukf::ConstMatrixRef<double>& points,
            Eigen::Index columns, const char* what) {
  const Matrix result = function(Matrix(points)).cast<Matrix>();
  if (result.rows() != points.rows() || result.cols() != columns) {
    throw py::value_error(std::string(what) + ": expected an array of shape (" +
                          std::to_string(points.rows()) + ", " + std::to_string(columns) + ")");
  }
  return result;
}

Status predict(Filter& filter, const py::function& process, const Matrix& noise) {
  if (noise.rows() != filter.dimension() || noise.cols() != filter.dimension()) {
    throw py::value_error("noise: expected a square matrix of the filter's dimension");
  }
  const auto in_place = [&](ukf::MatrixRef<double> points) {
    points = call(process, points, filter.dimension(), "process");
    return true;
  };
  return filter.predict(in_place, noise);
}

Status correct(Filter& filter, const py::function& measure, const VectorD& z,
               const VectorD& variances, double gate) {
  if (variances.size() != z.size()) {
    throw py::value_error("variances: expected as many as z has rows");
  }
  if (z.size() > filter.capacity()) {
    throw py::value_error("z: more rows than the filter's capacity");
  }
  const auto in_place = [&](const ukf::ConstMatrixRef<double>& points,
                            ukf::MatrixRef<double> predicted) {
    predicted = call(measure, points, predicted.cols(), "measure");
  };
  return filter.correct(in_place, z, variances, gate);
}

std::vector<bool> accepted(const Filter& filter) {
  std::vector<bool> result;
  for (int r = 0; r < filter.rows(); ++r) result.push_back(filter.accepted(r));
  return result;
}

// ---- the estimator of ranging robots

using Estimator = ukf::RangingEstimator<double, dynamics::SinglePrecision>;
using Robot = ukf::RangingRobot<double>;
using Anchors = ukf::RangingAnchors<double>;
using Config = ukf::RangingConfig<double>;
using Health = ukf::RangingHealth;
using State = ukf::RangingState<double>;
using V3 = Vector3<double>;
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Stamps = Eigen::Matrix<std::int64_t, Eigen::Dynamic, 1>;
using Indices = Eigen::Matrix<int, Eigen::Dynamic, 1>;
using Pairs = Eigen::Matrix<int, Eigen::Dynamic, 2>;

std::vector<V3> points(const Points& rows) {
  std::vector<V3> result;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) result.push_back(rows.row(i));
  return result;
}

Robot robot(const Points& nodes, const Pairs& rods, double rod_length, double module_inset) {
  Robot result;
  result.nodes = points(nodes);
  for (Eigen::Index k = 0; k < rods.rows(); ++k) {
    for (const int end : {rods(k, 0), rods(k, 1)}) {
      if (end < 0 || end >= nodes.rows()) throw py::value_error("rods: no such node");
    }
    result.rods.push_back({rods(k, 0), rods(k, 1)});
  }
  result.rod_length = rod_length;
  result.module_inset = module_inset;
  return result;
}

Estimator estimator(const Robot& robot, const Anchors& anchors, const dynamics::Net<double>& net,
                    const VectorD& rest_lengths, const Config& config) {
  const Eigen::Index nodes = Eigen::Index(robot.nodes.size());
  const Eigen::Index count = Eigen::Index(anchors.positions.size());
  if (net.nodes != int(nodes)) throw py::value_error("net: not the robot's nodes");
  if (rest_lengths.size() != Eigen::Index(net.cables.size())) {
    throw py::value_error("rest_lengths: expected one per cable");
  }
  if (anchors.offsets.rows() != nodes || anchors.offsets.cols() != count ||
      anchors.offset_std.rows() != nodes || anchors.offset_std.cols() != count) {
    throw py::value_error("offsets, offset_std: expected (nodes, anchors)");
  }
  if (anchors.internal_offsets.rows() != nodes || anchors.internal_offsets.cols() != nodes) {
    throw py::value_error("internal_offsets: expected (nodes, nodes)");
  }
  const int points = 12 * net.nodes + 1;
  return Estimator(robot, anchors, dynamics::SinglePrecision(net, points), rest_lengths, config);
}

// Arrays of one sensor, in the order of their stamps; empty: there was none.
struct Recording {
  Stamps range_t, internal_t, motor_t, imu_t;
  Pairs range_pairs, internal_pairs;
  VectorD ranges, internal_ranges;
  Rows rest_lengths;
  Indices imu_nodes;
  Points gyro, accel;
};

void check(const Recording& r) {
  const auto agree = [](Eigen::Index stamps, Eigen::Index rows, const char* what) {
    if (stamps != rows) throw py::value_error(std::string(what) + ": expected one row per stamp");
  };
  agree(r.range_t.size(), r.range_pairs.rows(), "range_pairs");
  agree(r.range_t.size(), r.ranges.size(), "ranges");
  agree(r.internal_t.size(), r.internal_pairs.rows(), "internal_pairs");
  agree(r.internal_t.size(), r.internal_ranges.size(), "internal_ranges");
  agree(r.motor_t.size(), r.rest_lengths.rows(), "rest_lengths");
  agree(r.imu_t.size(), r.imu_nodes.size(), "imu_nodes");
  agree(r.imu_t.size(), r.gyro.rows(), "gyro");
  agree(r.imu_t.size(), r.accel.rows(), "accel");
}

// What the state was after every update.
struct History {
  std::vector<std::int64_t> t;
  std::vector<double> positions, velocities, position_std, centre_of_mass, covariance, surprise;
  std::vector<int> face;

  void add(const State& s) {
    const auto append = [](std::vector<double>& to, const double* from, Eigen::Index count) {
      to.insert(to.end(), from, from + count);
    };
    t.push_back(s.t);
    append(positions, s.positions.data(), s.positions.size());
    append(velocities, s.velocities.data(), s.velocities.size());
    append(position_std, s.position_std.data(), s.position_std.size());
    append(centre_of_mass, s.centre_of_mass.data(), 3);
    append(covariance, s.centre_of_mass_covariance.data(), 9);
    surprise.push_back(s.surprise);
    face.insert(face.end(), s.face.begin(), s.face.end());
  }
};

template <typename T>
py::array_t<T> array(const std::vector<T>& values, std::vector<py::ssize_t> shape) {
  py::array_t<T> result(shape);
  std::copy(values.begin(), values.end(), result.mutable_data());
  return result;
}

// Feeds all sensors in the order of their stamps, at equal stamps motors, IMUs, ranges.
void feed(Estimator& e, const Recording& r, History& history) {
  Eigen::Index motor = 0, imu = 0, internal = 0, range = 0;
  std::int64_t seen = std::numeric_limits<std::int64_t>::min(), last = seen;
  const auto stamp = [](const Stamps& t, Eigen::Index k) {
    return k < t.size() ? t[k] : std::numeric_limits<std::int64_t>::max();
  };
  const auto record = [&] {
    if (!e.initialized() || e.state().t == seen) return;
    seen = e.state().t;
    history.add(e.state());
  };
  while (true) {
    const std::int64_t t = std::min({stamp(r.motor_t, motor), stamp(r.imu_t, imu),
                                     stamp(r.internal_t, internal), stamp(r.range_t, range)});
    if (t == std::numeric_limits<std::int64_t>::max()) break;
    last = t;
    if (stamp(r.motor_t, motor) == t) {
      e.motors(t, r.rest_lengths.row(motor++).transpose());
    } else if (stamp(r.imu_t, imu) == t) {
      e.imu(t, r.imu_nodes[imu], r.gyro.row(imu), r.accel.row(imu));
      ++imu;
    } else if (stamp(r.internal_t, internal) == t) {
      e.internal_range(t, r.internal_pairs(internal, 0), r.internal_pairs(internal, 1),
                       r.internal_ranges[internal]);
      ++internal;
    } else {
      e.range(t, r.range_pairs(range, 0), r.range_pairs(range, 1), r.ranges[range]);
      ++range;
    }
    record();
  }
  if (history.t.empty() && last == std::numeric_limits<std::int64_t>::min()) return;
  e.update(last);
  record();
}

py::dict run(Estimator& e, const Recording& r) {
  check(r);
  History h;
  {
    const py::gil_scoped_release release;
    feed(e, r, h);
  }
  const py::ssize_t count = py::ssize_t(h.t.size()), n = e.state().positions.size() / 3;
  py::dict result;
  result["t_ns"] = array(h.t, {count});
  result["positions"] = array(h.positions, {count, n, 3});
  result["velocities"] = array(h.velocities, {count, n, 3});
  result["position_std"] = array(h.position_std, {count, n, 3});
  result["centre_of_mass"] = array(h.centre_of_mass, {count, 3});
  result["centre_of_mass_covariance"] = array(h.covariance, {count, 3, 3});
  result["face"] = array(h.face, {count, 3});
  result["surprise"] = array(h.surprise, {count});
  return result;
}

void bind_ranging_estimator(py::module_& m) {
  py::native_enum<ukf::ProcessNoise>(m, "RangingProcessNoise", "enum.Enum",
                                     "What disturbs the net between updates.")
      .value("STATE", ukf::ProcessNoise::kState)
      .value("ACCELERATION", ukf::ProcessNoise::kAcceleration)
      .finalize();

  py::class_<Robot>(m, "RangingRobot", "Nodes (n, 3) of the undeformed robot [m], rods (r, 2).")
      .def(py::init(&robot), py::arg("nodes"), py::arg("rods"), py::arg("rod_length"),
           py::arg("module_inset"));

  py::class_<Anchors>(m, "RangingAnchors",
                      "Positions (A, 3) of the anchors [m]; offsets and how well they are known, "
                      "(n, A); offsets among the robot's modules, (n, n) [m].")
      .def(py::init([](const Points& positions, const Matrix& offsets, const Matrix& offset_std,
                       const Matrix& internal_offsets) {
             return Anchors{points(positions), offsets, offset_std, internal_offsets};
           }),
           py::arg("positions"), py::arg("offsets"), py::arg("offset_std"),
           py::arg("internal_offsets"));

  py::class_<Config>(m, "RangingConfig",
                     "Settings of RangingEstimator; noises are standard "
                     "deviations.")
      .def(py::init<>())
      .def_static("paper", &ukf::paper_config<double>,
                  "The filter as published, with the sigma weights of its authors' code.")
      .def_readwrite("filter", &Config::filter, "sigma points and form")
      .def_readwrite("spread", &Config::spread,
                     "standard deviations of the sigma points from the mean, in place of "
                     "filter.alpha; 0: alpha as it is")
      .def_readwrite("period", &Config::period, "between updates [s]")
      .def_readwrite("dynamics_step", &Config::dynamics_step, "longest step [s]")
      .def_readwrite("max_latency", &Config::max_latency, "an update waits so long [s]")
      .def_readwrite("range_std", &Config::range_std, "to an anchor [m]")
      .def_readwrite("internal_range_std", &Config::internal_range_std, "[m]")
      .def_readwrite("inclination_std", &Config::inclination_std, "[rad]")
      .def_readwrite("process_noise", &Config::process_noise)
      .def_readwrite("state_std", &Config::state_std, "STATE: per update [m], [m/s]")
      .def_readwrite("body_acceleration", &Config::body_acceleration,
                     "ACCELERATION: of the robot as one body [m/s/sqrt(s)]")
      .def_readwrite("node_acceleration", &Config::node_acceleration,
                     "ACCELERATION: of every node [m/s/sqrt(s)]")
      .def_readwrite("hold_rods", &Config::hold_rods,
                     "sigma points and corrections never stretch rods")
      .def_readwrite("gate", &Config::gate, "largest innovation [standard deviations]; 0: none")
      .def_readwrite("largest_rate", &Config::largest_rate,
                     "of an IMU; faster is a wrong sample [rad/s]")
      .def_readwrite("start_window", &Config::start_window, "[s]")
      .def_readwrite("start_pairs", &Config::start_pairs, "pairs of modules that a start needs")
      .def_readwrite("start_ground_std", &Config::start_ground_std,
                     "height of the three lowest nodes [m]; 0: no ground")
      .def_readwrite("start_body_std", &Config::start_body_std, "[m]")
      .def_readwrite("start_node_std", &Config::start_node_std, "[m]")
      .def_readwrite("start_speed_std", &Config::start_speed_std, "[m/s]")
      .def_readwrite("lost_level", &Config::lost_level,
                     "mean squared innovation in variances; 0: never lost")
      .def_readwrite("lost_time", &Config::lost_time, "[s]");

  py::class_<Health>(m, "RangingHealth", "Counters of RangingEstimator.")
      .def_readonly("updates", &Health::updates)
      .def_readonly("ranges_used", &Health::ranges_used)
      .def_readonly("ranges_rejected", &Health::ranges_rejected, "by the gate")
      .def_readonly("inclinations_used", &Health::inclinations_used)
      .def_readonly("inclinations_rejected", &Health::inclinations_rejected, "by the gate")
      .def_readonly("imu_rejected", &Health::imu_rejected, "samples of impossible rates")
      .def_readonly("dropped", &Health::dropped, "wrong stamp, index or value")
      .def_readonly("gaps", &Health::gaps, "times without ranges")
      .def_readonly("failed_predictions", &Health::failed_predictions)
      .def_readonly("restarts", &Health::restarts, "of a filter that was lost");

  py::class_<State>(m, "RangingState", "What RangingEstimator knows after its last update.")
      .def_readonly("t", &State::t, "[ns]")
      .def_readonly("initialized", &State::initialized)
      .def_property_readonly(
          "positions",
          [](const State& s) {
            return Rows(Eigen::Map<const Points>(s.positions.data(), s.positions.size() / 3, 3));
          },
          "Ends of the rods (n, 3), world [m].")
      .def_property_readonly(
          "velocities",
          [](const State& s) {
            return Rows(Eigen::Map<const Points>(s.velocities.data(), s.velocities.size() / 3, 3));
          },
          "(n, 3) [m/s]")
      .def_property_readonly(
          "position_std",
          [](const State& s) {
            return Rows(
                Eigen::Map<const Points>(s.position_std.data(), s.position_std.size() / 3, 3));
          },
          "(n, 3) [m]")
      .def_readonly("centre_of_mass", &State::centre_of_mass, "world [m]")
      .def_readonly("centre_of_mass_velocity", &State::centre_of_mass_velocity, "[m/s]")
      .def_readonly("centre_of_mass_covariance", &State::centre_of_mass_covariance, "[m^2]")
      .def_readonly("face", &State::face, "indices of the three lowest nodes, lowest first")
      .def_readonly("surprise", &State::surprise,
                    "mean squared innovation in variances, recently; 1 is right")
      .def_readonly("health", &State::health);

  py::class_<Recording>(m, "RangingArrays", "Recorded arrays, sorted by stamp.")
      .def(py::init<>())
      .def_readwrite("range_t", &Recording::range_t, "(N,) [ns]")
      .def_readwrite("range_pairs", &Recording::range_pairs, "(N, 2) indices of node and anchor")
      .def_readwrite("ranges", &Recording::ranges, "(N,) raw [m]")
      .def_readwrite("internal_t", &Recording::internal_t, "(I,) [ns]")
      .def_readwrite("internal_pairs", &Recording::internal_pairs, "(I, 2) indices of nodes")
      .def_readwrite("internal_ranges", &Recording::internal_ranges, "(I,) raw [m]")
      .def_readwrite("motor_t", &Recording::motor_t, "(M,) [ns]")
      .def_readwrite("rest_lengths", &Recording::rest_lengths, "(M, cables) [m]")
      .def_readwrite("imu_t", &Recording::imu_t, "(S,) [ns]")
      .def_readwrite("imu_nodes", &Recording::imu_nodes, "(S,) indices of nodes")
      .def_readwrite("gyro", &Recording::gyro, "(S, 3) [rad/s]")
      .def_readwrite("accel", &Recording::accel, "(S, 3) [m/s^2]");

  py::class_<Estimator>(m, "RangingEstimator",
                        "Ranges, inclinations and motors in, state of a net of rods out (C §IV). "
                        "Modules go by their indices.")
      .def(py::init(&estimator), py::arg("robot"), py::arg("anchors"), py::arg("net"),
           py::arg("rest_lengths"), py::arg_v("config", Config{}, "RangingConfig()"))
      .def(
          "motors", [](Estimator& e, std::int64_t t, const VectorD& l) { return e.motors(t, l); },
          py::arg("t"), py::arg("rest_lengths"), "Rest lengths of all cables [m].")
      .def("range", &Estimator::range, py::arg("t"), py::arg("node"), py::arg("anchor"),
           py::arg("range"), "A raw range [m].")
      .def("internal_range", &Estimator::internal_range, py::arg("t"), py::arg("node"),
           py::arg("other"), py::arg("range"), "A raw range between two modules [m].")
      .def("inclination", &Estimator::inclination, py::arg("t"), py::arg("rod"), py::arg("cosine"),
           "Cosine of the angle between up and a rod, toward its first end.")
      .def("imu", &Estimator::imu, py::arg("t"), py::arg("node"), py::arg("gyro"), py::arg("accel"),
           "A sample [rad/s], [m/s^2], z along the rod toward its first end.")
      .def("update", &Estimator::update, py::arg("t"), "Brings the state to t.")
      .def("run", &run, py::arg("arrays"),
           "Feeds recorded arrays; returns the states after every update as arrays.")
      .def_property_readonly("initialized", &Estimator::initialized)
      .def_property_readonly("state", [](const Estimator& e) { return e.state(); });
}

}  // namespace

void bind_ukf(py::module_& m) {
  py::native_enum<ukf::Weights>(m, "SigmaWeights", "enum.Enum", "How sigma points count.")
      .value("SCALED", ukf::Weights::kScaled)
      .value("UNIFORM", ukf::Weights::kUniform)
      .finalize();
  py::native_enum<ukf::Form>(m, "FilterForm", "enum.Enum", "What an unscented filter keeps.")
      .value("COVARIANCE", ukf::Form::kCovariance)
      .value("SQUARE_ROOT", ukf::Form::kSquareRoot)
      .finalize();

  py::class_<Settings>(m, "UnscentedSettings", "Sigma points and form of an unscented filter.")
      .def(py::init<>())
      .def_readwrite("alpha", &Settings::alpha, "spread of the points")
      .def_readwrite("beta", &Settings::beta, "2 for Gaussian states")
      .def_readwrite("kappa", &Settings::kappa)
      .def_readwrite("weights", &Settings::weights)
      .def_readwrite("form", &Settings::form)
      .def_readwrite("redraw", &Settings::redraw,
                     "draw new points from the predicted covariance before a correction");

  py::class_<Filter>(m, "UnscentedFilter",
                     "Unscented Kalman filter with additive noise, measurements that come and go.")
      .def(py::init<int, int, const Settings&>(), py::arg("dimension"), py::arg("capacity"),
           py::arg_v("settings", Settings{}, "UnscentedSettings()"))
      .def(
          "set",
          [](Filter& filter, const VectorD& mean, const Matrix& covariance) {
            return filter.set(mean, covariance);
          },
          py::arg("mean"), py::arg("covariance"), "Starts from a mean (L,) and covariance (L, L).")
      .def("predict", &predict, py::arg("process"), py::arg("noise"),
           "`process` maps sigma points (2L+1, L) to new ones; `noise` (L, L) is added.")
      .def(
          "correct", &correct, py::arg("measure"), py::arg("z"), py::arg("variances"),
          py::arg_v("gate", std::numeric_limits<double>::infinity(), "float('inf')"),
          "`measure` maps sigma points (2L+1, L) to measurements (2L+1, rows); z and variances are "
          "(rows,); rows with a squared innovation above `gate` variances are left out.")
      .def_property_readonly("mean", [](const Filter& filter) { return VectorD(filter.mean()); })
      .def_property_readonly("covariance", [](const Filter& filter) { return filter.covariance(); })
      .def_property_readonly("accepted", &accepted, "Of the rows of the last correction.")
      .def_property_readonly("squared_distance", &Filter::squared_distance,
                             "Chi-square of the rows used last.")
      .def_property_readonly("dimension", &Filter::dimension)
      .def_property_readonly("capacity", &Filter::capacity);

  bind_ranging_estimator(m);
}

}  // namespace tensegrity::bindings
