// The functions of tensegrity.h that are the same for every method.
#include "tensegrity/tensegrity.h"

#include "held.hpp"
#include "tensegrity/shape/cables.hpp"

using tensegrity::Status;
using tensegrity::Vector3;
using tensegrity::c::Header;
using tensegrity::c::kMark;
using tensegrity::c::kOffset;
using tensegrity::c::Operations;
using tensegrity::c::Real;
using tensegrity::c::to_c;

namespace {

// OK when `estimator` is one, and all other pointers point somewhere.
template <typename... Pointers>
tensegrity_status check(const tensegrity_estimator* estimator, Pointers... pointers) {
  if (estimator == nullptr || (... || (pointers == nullptr))) return TENSEGRITY_NULL_ARGUMENT;
  if (!tensegrity::c::aligned(estimator)) return TENSEGRITY_MISALIGNED;
  const auto* header = reinterpret_cast<const Header*>(estimator->bytes);
  return header->mark == kMark ? TENSEGRITY_OK : TENSEGRITY_NOT_CREATED;
}

// Of an estimator that passed `check`.
const Operations& operations(const tensegrity_estimator* estimator) {
  return *std::launder(reinterpret_cast<const Header*>(estimator->bytes))->operations;
}

Vector3<Real> vector(const Real v[3]) { return {v[0], v[1], v[2]}; }

}  // namespace

bool tensegrity_used(tensegrity_status status) {
  return status == TENSEGRITY_OK || status == TENSEGRITY_GAP;
}

const char* tensegrity_to_string(tensegrity_status status) {
  switch (status) {
    case TENSEGRITY_NULL_ARGUMENT:
      return "null_argument";
    case TENSEGRITY_NOT_CREATED:
      return "not_created";
    case TENSEGRITY_MISALIGNED:
      return "misaligned";
    default:
      return status < TENSEGRITY_NULL_ARGUMENT ? to_string(static_cast<Status>(status)) : "unknown";
  }
}

tensegrity_robot tensegrity_default_robot() {
  const tensegrity::Prism<Real> robot;
  return {robot.rod_length, robot.imu_offset, robot.endcap_radius, robot.side_length,
          TENSEGRITY_COUNTER_CLOCKWISE};
}

tensegrity_status tensegrity_undeformed(const tensegrity_robot* robot, Real endcaps[6][3],
                                        Real cable_lengths[9]) {
  if (robot == nullptr || endcaps == nullptr || cable_lengths == nullptr) {
    return TENSEGRITY_NULL_ARGUMENT;
  }
  const tensegrity_status status = tensegrity::c::check(*robot);
  if (status != TENSEGRITY_OK) return status;
  Eigen::Map<tensegrity::Endcaps<Real>> centres(&endcaps[0][0]);
  centres = tensegrity::c::to_cpp(*robot).undeformed();
  Eigen::Map<tensegrity::CableLengths<Real>>{cable_lengths} =
      tensegrity::shape::cable_lengths<Real>(centres);
  return TENSEGRITY_OK;
}

tensegrity_config tensegrity_default_config() { return to_c(tensegrity::PrismConfig<Real>{}); }

tensegrity_status tensegrity_copy(tensegrity_estimator* to, const tensegrity_estimator* from) {
  const tensegrity_status status = check(from, to);
  if (status != TENSEGRITY_OK || to == from) return status;
  if (!tensegrity::c::aligned(to)) return TENSEGRITY_MISALIGNED;
  operations(from).copy(to->bytes + kOffset, from->bytes + kOffset);
  write_header(to, operations(from));
  return TENSEGRITY_OK;
}

tensegrity_status tensegrity_imu(tensegrity_estimator* estimator, int64_t t, const Real gyro[3],
                                 const Real accel[3]) {
  const tensegrity_status status = check(estimator, gyro, accel);
  if (status != TENSEGRITY_OK) return status;
  return to_c(
      operations(estimator).imu(estimator->bytes + kOffset, t, vector(gyro), vector(accel)));
}

tensegrity_status tensegrity_rod_imu(tensegrity_estimator* estimator, int64_t t, int rod,
                                     const Real gyro[3], const Real accel[3]) {
  const tensegrity_status status = check(estimator, gyro, accel);
  if (status != TENSEGRITY_OK) return status;
  return to_c(operations(estimator).rod_imu(estimator->bytes + kOffset, t, rod, vector(gyro),
                                            vector(accel)));
}

tensegrity_status tensegrity_cables(tensegrity_estimator* estimator, int64_t t,
                                    const Real lengths[9]) {
  const tensegrity_status status = check(estimator, lengths);
  if (status != TENSEGRITY_OK) return status;
  const tensegrity::CableLengths<Real> copy(lengths);
  return to_c(operations(estimator).cables(estimator->bytes + kOffset, t, copy));
}

tensegrity_status tensegrity_contacts(tensegrity_estimator* estimator, int64_t t,
                                      const bool flags[6]) {
  const tensegrity_status status = check(estimator, flags);
  if (status != TENSEGRITY_OK) return status;
  const std::array<bool, 6> copy{flags[0], flags[1], flags[2], flags[3], flags[4], flags[5]};
  return to_c(operations(estimator).contacts(estimator->bytes + kOffset, t, copy));
}

bool tensegrity_initialized(const tensegrity_estimator* estimator) {
  return check(estimator) == TENSEGRITY_OK &&
         operations(estimator).initialized(estimator->bytes + kOffset);
}

tensegrity_status tensegrity_get_state(const tensegrity_estimator* estimator,
                                       tensegrity_state* state) {
  const tensegrity_status status = check(estimator, state);
  if (status != TENSEGRITY_OK) return status;
  operations(estimator).state(estimator->bytes + kOffset, *state);
  return TENSEGRITY_OK;
}
