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
  const ImuSample<Scalar> motion{imu.gyro - belief.gyro_bias, imu.accel - belief.accel_bias};
  const Strapdown<Scalar> body =
      integrate(belief.rotation, belief.velocity, belief.position, motion, dt, gravity);

  // Contact points begin in this row, or up to three after it; of the columns before it, and of the
  // body's, the part above the diagonal is read.
  constexpr int kGroup = packet_start(B::kAnchors), kBody = std::max(padded(B::kExtra), kGroup);
  auto& p = belief.covariance;
  const int n = belief.dim(), rows = padded(n);
  const int anchors = belief.anchor_count;
  const V3 up = V3::UnitZ();

  // Contact points: d+ = d + r turn x e_z, and the touching point d - r e_z is what turns with R,
  //   xi_d+ = xi_d + r turn x (e_z x xi_R) - int (d - r e_z) x R zeta_g
  // The first of the two, by itself: no other error sees it in this step.
  if (rolling.radius > 0) {
    // Integral of R w: w is an eigenvector of Exp(w t).
    const V3 turn = belief.rotation * motion.gyro * dt;
    belief.anchors.leftCols(anchors).colwise() += rolling.radius * turn.cross(up);
    const M3 by_rotation = rolling.radius * hat(turn) * hat(up);
    belief.complete();
    for (int i = 0; i < anchors; ++i) {
      add_columns(p, B::anchor_index(i), B::kRotation, by_rotation, 0, rows);
    }
    for (int j = 0; j < n; ++j) {
      const V3 rolled = by_rotation * p.col(j).template head<3>();
      for (int i = 0; i < anchors; ++i) {
        p.col(j).template segment<3>(B::anchor_index(i)) += rolled;
      }
    }
  } else {
    mirror(p, kBody);
  }

  // ---- P F'
  Transition<Scalar, B::Covariance::RowsAtCompileTime> transition(body, noise.gyro, noise.accel,
                                                                  rows);
  for (int i = 0; i < anchors; ++i) {
    const V3 touching = belief.anchors.col(i) - rolling.radius * up;
    transition.set_group(B::anchor_index(i), body.column_by_gyro(Packet<Scalar>(touching)));
  }
  transition.body_columns(p, rows);
  for (int i = 0; i < anchors; ++i) transition.group_columns(p, B::anchor_index(i), rows);

  // ---- F (P F')
  transition.all_rows(p, kGroup, n);

  const auto walk = [&](int at, int size, Scalar std) {
    for (int k = at; k < at + size; ++k) p(k, k) += std * std * dt;
  };
  walk(B::kGyroBias, 3, noise.gyro_bias);
  walk(B::kAccelBias, 3, noise.accel_bias);
  for (int k = 0; k < B::Extra; ++k) walk(B::kExtra + k, 1, extra_walk[k]);
  walk(B::kAnchors, 3 * anchors, noise.anchor);
}

}  // namespace tensegrity::inekf
