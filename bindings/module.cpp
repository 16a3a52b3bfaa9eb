#include "bindings.hpp"

PYBIND11_MODULE(_core, m) {
  using namespace tensegrity::bindings;
  m.doc() = "C++ core of tensegrity: shape reconstruction, invariant filter, estimators.";
  m.attr("__version__") = TENSEGRITY_VERSION;
  bind_robot(m);
  bind_shape(m);
  bind_inekf(m);
  bind_contact(m);
  bind_estimator(m);
  bind_dynamics(m);
  bind_ranging_calibration(m);
  bind_ahrs(m);
  bind_ranging(m);
  bind_ukf(m);
}
