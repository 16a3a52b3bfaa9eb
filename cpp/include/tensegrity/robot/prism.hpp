// The 3-bar prism as data (T §III-A, Fig. 2).
//
// Rods r01, r23, r45 join endcaps (0,1), (2,3), (4,5). Nine cables join endcaps of different rods:
// six side cables (actuated) and three cross cables. The body frame is the IMU frame on the base
// rod r01: origin at the IMU, z from endcap 1 to endcap 0, so that q0 = (0, 0, L/2 - d) and
// q1 = (0, 0, -L/2 - d) with d the offset of the IMU from the rod's centre toward endcap 0.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "tensegrity/types.hpp"

namespace tensegrity {

// Sense in which the rods twist. `kCounterClockwise` is the robot of T: every mutual moment
// m_ij = (c_j - c_i) . (u_i x u_j) is negative. Its mirror image is `kClockwise`.
enum class Chirality : std::uint8_t { kCounterClockwise, kClockwise };

struct Cable {
  int from;  // endcap
  int to;    // endcap
};

template <typename Scalar>
using Endcaps = Matrix<Scalar, 3, 6>;  // one endcap centre per column [m]
template <typename Scalar>
using CableLengths = Vector<Scalar, 9>;  // order of `kPrismCables` [m]

// T eq. (1). The first six are the side (actuated) cables, the last three the cross cables.
inline constexpr std::array<Cable, 9> kPrismCables = {
    {{0, 4}, {0, 2}, {2, 4}, {1, 5}, {1, 3}, {3, 5}, {1, 4}, {0, 3}, {2, 5}}};

template <typename Scalar>
struct Prism {
  static constexpr int kRods = 3;
  static constexpr int kEndcaps = 6;
  static constexpr int kCables = 9;

  Scalar rod_length = Scalar(1.45);      // L [m]
  Scalar imu_offset = Scalar(0.02);      // d, from the centre of r01 toward endcap 0 [m]
  Scalar endcap_radius = Scalar(0.038);  // [m]
  Scalar side_length = Scalar(0.98);     // side cables of the undeformed robot [m]
  Chirality chirality = Chirality::kCounterClockwise;

  // +1 for the mirror image, -1 for the robot of T: the sign of every mutual moment m_ij.
  Scalar moment_sign() const {
    return chirality == Chirality::kCounterClockwise ? Scalar(-1) : Scalar(1);
  }

  Vector3<Scalar> endcap0() const { return {0, 0, rod_length / 2 - imu_offset}; }
  Vector3<Scalar> endcap1() const { return {0, 0, -rod_length / 2 - imu_offset}; }

  // Endcaps of the undeformed robot in the body frame [m]: even endcaps at angle 120 deg * k on a
  // circle at z = +h/2, odd ones at 120 deg * k - 150 deg at z = -h/2, then turned
  // so that r01 is the body z axis. The spin about z is the reference for every spin angle.
  Endcaps<Scalar> undeformed() const {
    const Scalar radius = side_length / std::sqrt(Scalar(3));
    const Scalar sin75 = Scalar(0.96592582628906831);
    const Scalar chord = 2 * radius * sin75;
    const Scalar height = std::sqrt(rod_length * rod_length - chord * chord);
    const Scalar degree = Scalar(0.017453292519943295);
    const Scalar mirror = chirality == Chirality::kCounterClockwise ? Scalar(1) : Scalar(-1);
    Endcaps<Scalar> q;
    for (int k = 0; k < kRods; ++k) {
      const Scalar even = 120 * degree * Scalar(k);
      const Scalar odd = even - 150 * degree;
      q.col(2 * k) << radius * std::cos(even), mirror * radius * std::sin(even), height / 2;
      q.col(2 * k + 1) << radius * std::cos(odd), mirror * radius * std::sin(odd), -height / 2;
    }
    return in_body_frame(q);
  }

  // Any congruent copy of the robot, moved rigidly so that endcaps 0 and 1 stand where the body
  // frame wants them. The spin about z is that of the shortest rotation.
  Endcaps<Scalar> in_body_frame(const Endcaps<Scalar>& q) const {
    const Vector3<Scalar> axis = (q.col(0) - q.col(1)).normalized();
    const Vector3<Scalar> z = Vector3<Scalar>::UnitZ();
    // Rodrigues' formula for the rotation that takes `axis` to z without spinning about it.
    const Vector3<Scalar> w = axis.cross(z);
    const Scalar c = axis.dot(z);
    Matrix3<Scalar> skew;
    skew << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
    Matrix3<Scalar> rotation = Matrix3<Scalar>::Identity() + skew;
    if (c > Scalar(-1) + Scalar(1e-6)) {
      rotation += skew * skew / (1 + c);
    } else {  // upside down: half a turn about x
      rotation = Vector3<Scalar>(1, -1, -1).asDiagonal();
    }
    const Vector3<Scalar> centre = (q.col(0) + q.col(1)) / 2;
    Endcaps<Scalar> body = rotation * (q.colwise() - centre);
    body.row(2).array() -= imu_offset;
    return body;
  }
};

}  // namespace tensegrity
