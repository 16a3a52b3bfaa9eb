// IMUs on rods 23 and 45: what they say whatever their mounting about the rod.
//
// Such an IMU has its z axis along the rod, toward the even endcap; where its x axis points is not
// known and not needed. Its gyro's z is the rod's spin about itself, which rolling feet want
// (feet.hpp). The norm of its x and y is how fast the rod turns across itself,
//   |w_a - w_b| = L |omega_xy|,
// and in quiet its accelerometer's z is the rod's inclination, u . e_z = f_z / g.
#pragma once

#include "tensegrity/tight/sequential_update.hpp"

namespace tensegrity::tight {

template <typename Scalar>
struct RodImuNoise {
  Scalar rate;         // of the turn across the rod: noise, bias, lag of half a step [rad/s]
  Scalar inclination;  // of u . e_z in quiet [1]
};

// `rod`: 1 for r23, 2 for r45. `gyro` without its bias [rad/s], `accel` [m/s^2], both in the IMU's
// frame. Below `least_turn` [rad/s] the direction of the turn is noise, and only the spin and the
// inclination are used.
template <typename Scalar>
void correct_rod(SequentialUpdate<Scalar>& update, const Belief<Scalar>& belief, int rod,
                 const Vector3<Scalar>& gyro, const Vector3<Scalar>& accel, Scalar rod_length,
                 Scalar gravity, Scalar least_turn, const RodImuNoise<Scalar>& noise) {
  using B = Belief<Scalar>;
  const int a = 2 * rod, b = a + 1;
  const Vector3<Scalar> turning = belief.endcap_velocity(a) - belief.endcap_velocity(b);
  const Scalar speed = turning.norm();
  const Scalar turn = std::hypot(gyro.x(), gyro.y());
  if (turn > least_turn && speed > least_turn * rod_length) {
    Row<Scalar> row;
    row.add(B::endcap_velocity_index(a), turning / speed);
    row.add(B::endcap_velocity_index(b), -turning / speed);
    const Scalar std = noise.rate * rod_length;
    update.correct(row, speed - turn * rod_length, std * std);
  }
  const Vector3<Scalar> span = belief.endcap(a) - belief.endcap(b);
  Row<Scalar> row;
  row.add(B::endcap_index(a), Vector3<Scalar>(0, 0, 1));
  row.add(B::endcap_index(b), Vector3<Scalar>(0, 0, -1));
  row.add(B::kRotation, span.cross(Vector3<Scalar>::UnitZ()));
  const Scalar std = noise.inclination * rod_length;
  update.correct(row, span.z() - rod_length * accel.z() / gravity, std * std);
}

}  // namespace tensegrity::tight
