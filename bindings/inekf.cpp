// The filter by itself: for tests against independent implementations and for other robots.
#include "bindings.hpp"
#include "numbers.hpp"
#include "tensegrity/inekf/anchors.hpp"
#include "tensegrity/inekf/contact_kinematics.hpp"
#include "tensegrity/inekf/propagate.hpp"

namespace tensegrity::bindings {

namespace {

using Belief = inekf::Belief<double, 1, 6>;
using V3 = Vector3<double>;
using RowVectors = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

struct FilterNoise {
  inekf::ProcessNoise<double> process;
  double spin_walk;  // [rad/sqrt(s)]
};

RowVectors anchors(const Belief& b) { return b.anchors.leftCols(b.anchor_count).transpose(); }

Eigen::MatrixXd covariance(const Belief& b) {
  return b.complete_covariance().topLeftCorner(b.dim(), b.dim());
}

void set_covariance(Belief& b, const Eigen::MatrixXd& p) {
  if (p.rows() != b.dim() || p.cols() != b.dim()) {
    throw py::value_error("covariance: expected " + std::to_string(b.dim()) + " x " +
                          std::to_string(b.dim()) + " for " + std::to_string(b.anchor_count) +
                          " contacts");
  }
  b.covariance.topLeftCorner(b.dim(), b.dim()) = p;
}

inekf::Kinematics<double, 6, 1> spun_kinematics(const Numbers<6, 3>& h,
                                                const Numbers<18, 18>& covariance) {
  inekf::Kinematics<double, 6, 1> k;
  k.h = (*h).transpose();
  for (int i = 0; i < 6; ++i) {
    k.h_extra.middleRows<3>(3 * i) = V3::UnitZ().cross(V3(k.h.col(i)));
  }
  k.correlated = true;
  k.shape_covariance = (*covariance).transpose();  // symmetric: the same, in the order of memory
  return k;
}

}  // namespace

void bind_inekf(py::module_& m) {
  py::class_<FilterNoise>(m, "FilterNoise",
                          "Standard deviations: of one IMU sample (gyro_std [rad/s], accel_std "
                          "[m/s^2]), and of random walks per square root of a second.")
      .def(py::init([](double gyro_std, double accel_std, double gyro_bias_walk,
                       double accel_bias_walk, double anchor_walk, double spin_walk) {
             return FilterNoise{{gyro_std, accel_std, gyro_bias_walk, accel_bias_walk, anchor_walk},
                                spin_walk};
           }),
           py::kw_only(), py::arg("gyro_std"), py::arg("accel_std"),
           py::arg("gyro_bias_walk") = 0.0, py::arg("accel_bias_walk") = 0.0,
           py::arg("anchor_walk") = 0.0, py::arg("spin_walk") = 0.0);

  py::class_<Belief>(m, "InvariantFilter",
                     "Mean on SE_{2+N}(3) x R^7 (biases and the spin angle) and covariance of the "
                     "right-invariant error (gyro bias, accelerometer bias, rotation, "
                     "velocity, position, spin, contacts).")
      .def(py::init<>())
      .def_readwrite("rotation", &Belief::rotation, "R (3, 3), body to world")
      .def_readwrite("velocity", &Belief::velocity, "v (3,), world [m/s]")
      .def_readwrite("position", &Belief::position, "p (3,), world [m]")
      .def_readwrite("gyro_bias", &Belief::gyro_bias, "b_g (3,), body [rad/s]")
      .def_readwrite("accel_bias", &Belief::accel_bias, "b_a (3,), body [m/s^2]")
      .def_property(
          "spin", [](const Belief& b) { return b.extra[0]; },
          [](Belief& b, double spin) { b.extra[0] = spin; }, "phi [rad]")
      .def_property_readonly("anchors", &anchors, "contact points (N, 3), world [m]")
      .def_property_readonly(
          "anchor_ids",
          [](const Belief& b) {
            return std::vector<int>(b.anchor_ids.begin(), b.anchor_ids.begin() + b.anchor_count);
          },
          "endcap of each contact point")
      .def_property("covariance", &covariance, &set_covariance,
                    "covariance of the error, (16 + 3 N, 16 + 3 N)")
      .def_property_readonly("position_covariance", &Belief::position_covariance)
      .def_property_readonly("velocity_covariance", &Belief::velocity_covariance)
      .def(
          "retract",
          [](Belief& b, const Eigen::VectorXd& e) {
            if (e.size() != b.dim()) throw py::value_error("error vector: wrong length");
            Belief::ErrorVector error = Belief::ErrorVector::Zero();
            error.head(e.size()) = e;
            b.retract(error);
          },
          py::arg("error"), "Takes an error (16 + 3 N,) out of the mean: X <- Exp(-xi) X.")
      .def(
          "propagate",
          [](Belief& b, const Numbers<3>& gyro, const Numbers<3>& accel, double dt,
             const FilterNoise& noise, double rolling_radius, double gravity) {
            if (!(dt > 0)) throw py::value_error("dt: has to be positive [s]");
            inekf::propagate(b, {*gyro, *accel}, dt, gravity, noise.process, {rolling_radius},
                             Vector<double, 1>(noise.spin_walk));
          },
          py::arg("gyro"), py::arg("accel"), py::arg("dt"), py::arg("noise"),
          py::arg("rolling_radius") = 0.0, py::arg("gravity") = 9.81,
          "One IMU sample over dt [s]; gyro [rad/s] and accel [m/s^2] are means over the step.")
      .def(
          "augment",
          [](Belief& b, int id, const V3& h, const Matrix3<double>& h_covariance) {
            if (id < 0 || id > 5) throw py::value_error("id: endcaps are 0 .. 5");
            return inekf::augment(b, id, h, Matrix<double, 3, 1>(V3::UnitZ().cross(h)),
                                  h_covariance);
          },
          py::arg("id"), py::arg("h"), py::arg("h_covariance"),
          "Adds the contact point d = p + R h of an endcap; h (3,) body [m].")
      .def(
          "marginalise",
          [](Belief& b, int id) {
            const int slot = b.find(id);
            if (slot < 0) throw py::value_error("id: no contact point of this endcap");
            inekf::marginalise(b, slot);
          },
          py::arg("id"), "Drops the contact point of an endcap.")
      .def(
          "correct_contacts",
          [](Belief& b, const Numbers<6, 3>& h, const Numbers<18, 18>& covariance, double gate) {
            const inekf::Correction<double> c =
                inekf::correct_contacts(b, spun_kinematics(h, covariance), gate);
            return py::make_tuple(c.status, c.chi_square);
          },
          py::arg("h"), py::arg("covariance"), py::arg("gate") = 0.0,
          "Corrects with all contact points; h (6, 3) endcaps in the body frame after the spin "
          "[m], covariance (18, 18) [m^2]. Returns (status, chi square).");
}

}  // namespace tensegrity::bindings
