// Between the plain structs of the C interface and those of C++.
#pragma once

#include "tensegrity/estimator/config.hpp"
#include "tensegrity/estimator/prism_state.hpp"
#include "tensegrity/robot/prism.hpp"
#include "tensegrity/tensegrity.h"

namespace tensegrity::c {

using Real = tensegrity_real;

// OK, NOT_FINITE or OUT_OF_RANGE: whether there can be such a robot, such a configuration. Every
// enumerator and bound is that of the header.
tensegrity_status check(const tensegrity_robot& robot);
tensegrity_status check(const tensegrity_config& config);

// Of values that passed `check`.
Prism<Real> to_cpp(const tensegrity_robot& robot);
PrismConfig<Real> to_cpp(const tensegrity_config& config);

tensegrity_config to_c(const PrismConfig<Real>& config);
void to_c(const PrismState<Real>& from, tensegrity_state& to);

constexpr tensegrity_status to_c(Status status) {
  return static_cast<tensegrity_status>(static_cast<int>(status));
}

}  // namespace tensegrity::c
