// One IMU sample: the body by strapdown integration, contact points by rolling.
#pragma once

#include "tensegrity/inekf/belief.hpp"
#include "tensegrity/inekf/transition.hpp"

namespace tensegrity::inekf {

// Standard deviations. White noise is that of one sample, i.e. of the mean over the step.
template <typename Scalar>
struct ProcessNoise {
  Scalar gyro;        // [rad/s]
  Scalar accel;       // [m/s^2]
  Scalar gyro_bias;   // random walk [rad/s/sqrt(s)]
  Scalar accel_bias;  // random walk [m/s^2/sqrt(s)]
  Scalar anchor;      // random walk of a contact point [m/sqrt(s)]
};

// How contact points move. An endcap is a sphere of radius r that rolls without slip on horizontal
// ground: its centre moves with omega x r e_z. radius = 0 is T's static contact.
template <typename Scalar>
struct Rolling {
  Scalar radius = 0;  // [m]
};

// `extra_walk`: random walk of each extra state [unit/sqrt(s)]. Walks of a step are added at its
// end.
template <typename B, typename Scalar = typename B::Scalar>
TENSEGRITY_FLATTEN void propagate(B& belief, const ImuSample<Scalar>& imu, Scalar dt,
                                  Scalar gravity, const ProcessNoise<Scalar>& noise,
                                  const Rolling<Scalar>& rolling,
                                  const Vector<Scalar, B::Extra>& extra_walk) {
  using V3 = Vector3<Scalar>;
  using M3 = Matrix3<Scalar>;
  auto& p = belief.covariance;
  const int n = belief.dim(), rows = padded(n);
  // Needs nothing of the integration, which is a long chain: they overlap.
  fall_and_move(p, gravity * dt, dt, rows);
  const ImuSample<Scalar> motion{imu.gyro - belief.gyro_bias, imu.accel - belief.accel_bias};
  const Strapdown<Scalar> body =
      integrate(belief.rotation, belief.velocity, belief.position, motion, dt, gravity);

  // Contact points: d+ = d + r turn x e_z, and the touching point d - r e_z is what turns with R,
  //   xi_d+ = xi_d + r turn x (e_z x xi_R) - int (d - r e_z) x R zeta_g
  constexpr int kRows = B::Covariance::RowsAtCompileTime;
  const int anchors = belief.anchor_count;
  const V3 up = V3::UnitZ();
  if (rolling.radius > 0) {
    // Integral of R w: w is an eigenvector of Exp(w t).
    const V3 turn = belief.rotation * motion.gyro * dt;
    belief.anchors.leftCols(anchors).colwise() += rolling.radius * turn.cross(up);
    const M3 by_rotation = rolling.radius * hat(turn) * hat(up);
    const Block<Scalar> by = to_block(by_rotation);
    Shear<Scalar, kRows> roll(B::kRotation);
    roll.clear(packet_start(B::kAnchors), rows);
    for (int i = 0; i < anchors; ++i) roll.set(B::anchor_index(i), by);
    roll.apply(p, B::kAnchors, n, rows);
  }
  SensorErrors<Scalar, kRows> errors(body, noise.gyro, noise.accel);
  errors.clear(padded(B::kBodyEnd), rows);
  for (int i = 0; i < anchors; ++i) {
    const V3 touching = belief.anchors.col(i) - rolling.radius * up;
    errors.set_group(B::anchor_index(i), body.column_by_gyro(Packet<Scalar>(touching)));
  }
  errors.apply(p, n, rows);

  const auto walk = [&](int at, int size, Scalar std) {
    for (int k = at; k < at + size; ++k) p(k, k) += std * std * dt;
  };
  walk(B::kGyroBias, 3, noise.gyro_bias);
  walk(B::kAccelBias, 3, noise.accel_bias);
  for (int k = 0; k < B::Extra; ++k) walk(B::kExtra + k, 1, extra_walk[k]);
  walk(B::kAnchors, 3 * anchors, noise.anchor);
}

}  // namespace tensegrity::inekf
