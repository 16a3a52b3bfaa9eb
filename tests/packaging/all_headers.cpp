// Every class template of the core in scalar type SCALAR, those of the prism's estimators with
// ESTIMATORS, for compilers to find fault with (warnings.sh). Nothing of it is linked or run.
#include "tensegrity/ahrs/madgwick.hpp"
#include "tensegrity/contact/detector.hpp"
#include "tensegrity/dynamics/simulator.hpp"
#include "tensegrity/math/sek3.hpp"
#include "tensegrity/ranging/calibration.hpp"
#include "tensegrity/ranging/range_model.hpp"
#include "tensegrity/ranging/two_way.hpp"
#include "tensegrity/shape/constraints.hpp"
#include "tensegrity/shape/length_residuals.hpp"
#include "tensegrity/ukf/ranging_estimator.hpp"
#ifdef ESTIMATORS
#include "tensegrity/estimator/prism_estimator.hpp"
#endif

namespace tensegrity {

template class SO3<SCALAR>;
template class SEk3<SCALAR, 3>;
template class ahrs::Madgwick<SCALAR>;
template class contact::Detector<SCALAR>;
template class dynamics::Simulator<SCALAR>;
template class ranging::CalibrationSolver<SCALAR>;
template struct ranging::AnchorDistance<SCALAR>;
template struct ranging::ModuleDistance<SCALAR>;
template struct ranging::TwoWayRange<SCALAR>;
template class shape::Inequality<SCALAR>;
template class shape::InequalitySet<SCALAR>;
template class shape::LengthResiduals<SCALAR>;
template class ukf::PoseSearch<SCALAR>;
template class ukf::RangingEstimator<SCALAR, dynamics::Simulator<SCALAR>>;
template class ukf::RangingModel<SCALAR>;
template class ukf::UnscentedFilter<SCALAR>;

#ifdef ESTIMATORS
template class PrismEstimator<SCALAR, TightFilter<SCALAR>>;
template class PrismEstimator<SCALAR, LooseFilter<SCALAR>>;
template class TightFilter<SCALAR>;
template class LooseFilter<SCALAR>;
template class shape::Solver<SCALAR>;
template class shape::Tracker<SCALAR>;
template class tight::Feet<SCALAR>;
template class tight::FeetUpdate<SCALAR>;
template class tight::FootRows<SCALAR>;
template struct tight::Ground<SCALAR>;
template class tight::Row<SCALAR>;
template class tight::SequentialUpdate<SCALAR>;
template struct tight::WaitingRows<SCALAR>;
template struct VectorLanes<SCALAR>;
#endif

}  // namespace tensegrity
