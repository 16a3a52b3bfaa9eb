// The method of Tong et al. 2024 for C: all of its code is in this object file.
#include "held.hpp"
#include "tensegrity/estimator/prism_estimator.hpp"

using Estimator =
    tensegrity::PrismEstimator<tensegrity_real, tensegrity::LooseFilter<tensegrity_real>>;

// All of it, so that C++ in the same program can use this code instead of compiling its own.
template class tensegrity::PrismEstimator<tensegrity_real,
                                          tensegrity::LooseFilter<tensegrity_real>>;

tensegrity_status tensegrity_create_paper(tensegrity_estimator* estimator,
                                          const tensegrity_robot* robot,
                                          const tensegrity_config* config) {
  return tensegrity::c::Held<Estimator>::create(estimator, robot, config);
}
