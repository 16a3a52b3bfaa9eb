// One IMU sample: the body by strapdown integration, contact points by rolling.
//
// The transition F = I + A is never formed. It acts on the columns of P, P F', and then on the
// rows of the lower triangle of that.
#pragma once

#include "tensegrity/inekf/belief.hpp"
#include "tensegrity/inekf/strapdown.hpp"
#include "tensegrity/math/symmetric.hpp"

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
void propagate(B& belief, const ImuSample<Scalar>& imu, Scalar dt, Scalar gravity,
               const ProcessNoise<Scalar>& noise, const Rolling<Scalar>& rolling,
               const Vector<Scalar, B::Extra>& extra_walk) {
  using V3 = Vector3<Scalar>;
  using M3 = Matrix3<Scalar>;
  const ImuSample<Scalar> motion{imu.gyro - belief.gyro_bias, imu.accel - belief.accel_bias};
  // Integral of R w: w is an eigenvector of Exp(w t).
  const V3 turn = belief.rotation * motion.gyro * dt;
  const Strapdown<Scalar> body =
      integrate(belief.rotation, belief.velocity, belief.position, motion, dt, gravity);

  // Contact points: d+ = d + r turn x e_z, and the touching point d - r e_z is what turns with R,
  //   xi_d+ = xi_d + r turn x (e_z x xi_R) - int (d - r e_z) x R zeta_g
  const V3 up = V3::UnitZ();
  const bool rolls = rolling.radius > 0;
  const M3 anchor_by_rotation = rolling.radius * hat(turn) * hat(up);
  const int n = belief.dim(), rows = padded(n);
  const int anchors = belief.anchor_count;
  Matrix<Scalar, B::Covariance::RowsAtCompileTime, 3> by_gyro;  // A, columns of the gyro's bias
  by_gyro.template topRows<B::kAnchors>().setZero();
  by_gyro.template middleRows<3>(B::kRotation) = -body.int_r;
  by_gyro.template middleRows<3>(B::kVelocity) = body.velocity_by_gyro;
  by_gyro.template middleRows<3>(B::kPosition) = body.position_by_gyro;
  for (int i = 0; i < anchors; ++i) {
    if (rolls) belief.anchors.col(i) += rolling.radius * turn.cross(up);
    by_gyro.template middleRows<3>(B::anchor_index(i)) =
        body.column_by_gyro(belief.anchors.col(i) - rolling.radius * up);
  }
  for (int i = n; i < rows; ++i) by_gyro.row(i).setZero();

  // ---- P F': every row of it
  auto& p = belief.covariance;
  const M3& v_rotation = body.velocity_by_rotation;
  const M3 p_rotation = v_rotation * (dt / 2);
  add_columns(p, B::kPosition, B::kRotation, p_rotation, rows);
  add_columns(p, B::kPosition, B::kVelocity, M3(dt * M3::Identity()), rows);
  add_columns(p, B::kPosition, B::kAccelBias, body.position_by_accel, rows);
  add_columns(p, B::kVelocity, B::kRotation, v_rotation, rows);
  add_columns(p, B::kVelocity, B::kAccelBias, M3(-body.int_r), rows);
  for (int i = 0; rolls && i < anchors; ++i) {
    add_columns(p, B::anchor_index(i), B::kRotation, anchor_by_rotation, rows);
  }
  const auto by_gyro_of = [&](int at) { return M3(by_gyro.template middleRows<3>(at)); };
  for (const int at : {B::kRotation, B::kVelocity, B::kPosition}) {
    add_columns(p, at, B::kGyroBias, by_gyro_of(at), rows);
  }
  for (int i = 0; i < anchors; ++i) {
    add_columns(p, B::anchor_index(i), B::kGyroBias, by_gyro_of(B::anchor_index(i)), rows);
  }

  // ---- F (P F'): rows from the diagonal on. The noise of a sample is one more error of its
  // biases, which reaches column j of P F' as row j of A.
  const Scalar gyro_variance = noise.gyro * noise.gyro;
  const Scalar accel_variance = noise.accel * noise.accel;
  for (int j = 0; j < n; ++j) {
    Scalar* x = &p(0, j);
    const V3 r(x[0], x[1], x[2]), v(x[3], x[4], x[5]);
    const V3 gyro =
        p.col(j).template segment<3>(B::kGyroBias) + gyro_variance * by_gyro.row(j).transpose();
    V3 accel = p.col(j).template segment<3>(B::kAccelBias);
    if (j >= B::kVelocity && j < B::kPosition) {
      accel -= accel_variance * body.int_r.row(j - B::kVelocity).transpose();
    } else if (j >= B::kPosition && j < B::kGyroBias) {
      accel += accel_variance * body.position_by_accel.row(j - B::kPosition).transpose();
    }
    if (j < B::kGyroBias) {
      p.col(j).template segment<3>(B::kVelocity) += v_rotation * r - body.int_r * accel;
      p.col(j).template segment<3>(B::kPosition) +=
          dt * v + p_rotation * r + body.position_by_accel * accel;
    }
    if (rolls) {
      const V3 rolled = anchor_by_rotation * r;
      for (int i = 0; i < anchors; ++i) {
        p.col(j).template segment<3>(B::anchor_index(i)) += rolled;
      }
    }
    const Scalar g0 = gyro[0], g1 = gyro[1], g2 = gyro[2];
    const Scalar *a0 = &by_gyro(0, 0), *a1 = &by_gyro(0, 1), *a2 = &by_gyro(0, 2);
    for (int i = packet_start(j); i < rows; ++i) x[i] += a0[i] * g0 + a1[i] * g1 + a2[i] * g2;
  }

  const auto walk = [&](int at, int size, Scalar std) {
    for (int k = at; k < at + size; ++k) p(k, k) += std * std * dt;
  };
  walk(B::kGyroBias, 3, noise.gyro_bias);
  walk(B::kAccelBias, 3, noise.accel_bias);
  for (int k = 0; k < B::Extra; ++k) walk(B::kExtra + k, 1, extra_walk[k]);
  walk(B::kAnchors, 3 * anchors, noise.anchor);
  mirror(p, rows);
}

}  // namespace tensegrity::inekf
