#include "bindings.hpp"

// Python knows it as tensegrity._core (loader.cpp).
PYBIND11_MODULE(tensegrity_python, m) {
  using namespace tensegrity::bindings;
  m.doc() = "C++ core of tensegrity: shape reconstruction, invariant filter, estimators.";
  m.attr("__version__") = TENSEGRITY_VERSION;
  m.def(
      "instruction_set", [] { return TENSEGRITY_INSTRUCTION_SET; },
      "What this core is compiled for: 'x86-64-v3' (AVX2 and FMA), 'native', or 'baseline'.");
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
