// The tightly coupled filter for C: all of its code is in this object file.
#include "held.hpp"
#include "tensegrity/estimator/prism_estimator.hpp"

using Estimator =
    tensegrity::PrismEstimator<tensegrity_real, tensegrity::TightFilter<tensegrity_real>>;

// All of it, so that C++ in the same program can use this code instead of compiling its own.
template class tensegrity::PrismEstimator<tensegrity_real,
                                          tensegrity::TightFilter<tensegrity_real>>;

tensegrity_status tensegrity_create_full(tensegrity_estimator* estimator,
                                         const tensegrity_robot* robot,
                                         const tensegrity_config* config) {
  return tensegrity::c::Held<Estimator>::create(estimator, robot, config);
}
