// Cable lengths of a shape against measured ones: half the sum of squared differences, its gradient
// and its Hessian with respect to the tangent.
//
// Written for the net instead of through the 9 x 10 Jacobian: a cable is a 3 x 3 stiffness between
// two endcaps, the endcaps of a free rod move by dc +- across (L/2 du).
#pragma once

#include <array>

#include "tensegrity/shape/gauge.hpp"

namespace tensegrity::shape {

template <typename Scalar>
class LengthResiduals {
 public:
  // `measured`: order of `kPrismCables` [m].
  LengthResiduals(const Rods<Scalar>& rods, const CableLengths<Scalar>& measured) {
    const Endcaps<Scalar> q = rods.endcaps();
    Lanes measured_lanes = Lanes::Ones();
    for (int i = 0; i < 3; ++i) {
      directions_[std::size_t(i)].setOnes();  // lanes without a cable
#pragma GCC unroll 9
      for (int k = 0; k < 9; ++k) {
        const Cable cable = kPrismCables[std::size_t(k)];
        directions_[std::size_t(i)][k] = q(i, cable.from) - q(i, cable.to);
      }
    }
    measured_lanes.template head<9>() = measured.array();
    auto& [x, y, z] = directions_;
    const Lanes lengths = (x * x + y * y + z * z).sqrt();
    // A cable of no length has no direction.
    inverse_lengths_ = (lengths > 0).select(1 / lengths, Scalar(0));
    x *= inverse_lengths_;
    y *= inverse_lengths_;
    z *= inverse_lengths_;
    residuals_ = lengths - measured_lanes;
    residuals_.template tail<kLanes - 9>().setZero();
  }

  // Sum of squared residuals [m^2].
  Scalar cost() const { return residuals_.matrix().squaredNorm(); }

  // J' residuals
  Tangent<Scalar> gradient(const Rods<Scalar>& rods) const {
    Tangent<Scalar> out;
    std::array<std::array<Scalar, 6>, 3> force{};  // by axis and endcap
    for (std::size_t i = 0; i < 3; ++i) {
      const Lanes pull = residuals_ * directions_[i];
#pragma GCC unroll 9
      for (int k = 0; k < 9; ++k) {
        const Cable cable = kPrismCables[std::size_t(k)];
        force[i][std::size_t(cable.from)] += pull[k];
        force[i][std::size_t(cable.to)] -= pull[k];
      }
    }
    for (int rod = 0; rod < 2; ++rod) {
      const std::size_t even = std::size_t(2 * rod + 2);
      const Vector3<Scalar> turn(force[0][even] - force[0][even + 1],
                                 force[1][even] - force[1][even + 1],
                                 force[2][even] - force[2][even + 1]);
      for (std::size_t i = 0; i < 3; ++i) {
        out[5 * rod + int(i)] = force[i][even] + force[i][even + 1];
      }
      out[5 * rod + 3] = rods.rod(rod).frame.col(0).dot(turn);
      out[5 * rod + 4] = rods.rod(rod).frame.col(1).dot(turn);
    }
    return out;
  }

  // J' J, and with `second_order` the second derivatives of the lengths times the residuals as
  // well. The lower triangle; a unit stiffness holds the spin about z.
  TangentMatrix<Scalar> hessian(const Rods<Scalar>& rods, bool second_order) const {
    // A cable resists along itself, and as it is tense also across.
    // (A structured binding would not do: in C++17 no lambda may capture it.)
    const Lanes &x = directions_[0], &y = directions_[1], &z = directions_[2];
    Lanes tension = Lanes::Zero();
    if (second_order) tension = residuals_ * inverse_lengths_;
    const Lanes wx = (1 - tension) * x, wy = (1 - tension) * y, wz = (1 - tension) * z;
    const std::array<Lanes, 6> stiffness{
        {wx * x + tension, wx * y, wx * z, wy * y + tension, wy * z, wz * z + tension}};

    Ends own{};                        // stiffness at endcaps 2 .. 5
    std::array<Symmetric, 4> cross{};  // between the rods: by no side, rod 0's, 1's, both
    std::array<Scalar, 2> circles{};   // endcaps move on circles about their rod's centre
    // Unrolled, so that which endcaps a cable joins is known to the compiler.
#pragma GCC unroll 9
    for (int k = 0; k < 9; ++k) {
      const Cable cable = kPrismCables[std::size_t(k)];
      const int from = free_rod(cable.from), to = free_rod(cable.to);
#pragma GCC unroll 6
      for (std::size_t i = 0; i < 6; ++i) {
        const Scalar value = stiffness[i][k];
        if (from >= 0) own[std::size_t(cable.from - 2)][i] += value;
        if (to >= 0) own[std::size_t(cable.to - 2)][i] += value;
      }
      if (second_order) {
        const auto pull_inward = [&](int endcap, int rod, int sign) {
          const auto u = rods.rod(rod).direction();
          circles[std::size_t(rod)] -= Scalar(sign * rod_side(endcap)) * residuals_[k] *
                                       (x[k] * u[0] + y[k] * u[1] + z[k] * u[2]);
        };
        if (from >= 0) pull_inward(cable.from, from, 1);
        if (to >= 0) pull_inward(cable.to, to, -1);
      }
      if (from < 0 || to < 0) continue;
      const Scalar side_0 = Scalar(rod_side(from == 0 ? cable.from : cable.to));
      const Scalar side_1 = Scalar(rod_side(from == 0 ? cable.to : cable.from));
#pragma GCC unroll 6
      for (std::size_t i = 0; i < 6; ++i) {
        const Scalar value = stiffness[i][k];
        cross[0][i] -= value;
        cross[1][i] -= side_0 * value;
        cross[2][i] -= side_1 * value;
        cross[3][i] -= side_0 * side_1 * value;
      }
    }

    TangentMatrix<Scalar> h;
    for (int rod = 0; rod < 2; ++rod) {
      const int at = 5 * rod;
      const Symmetric& even = own[std::size_t(2 * rod)];
      const Symmetric& odd = own[std::size_t(2 * rod + 1)];
      Symmetric sum, difference;
      for (std::size_t i = 0; i < 6; ++i) {
        sum[i] = even[i] + odd[i];
        difference[i] = even[i] - odd[i];
      }
      const Vector3<Scalar> a = rods.rod(rod).frame.col(0), b = rods.rod(rod).frame.col(1);
      const Vector3<Scalar> sum_a = times(sum, a), sum_b = times(sum, b);
      const Scalar circle = circles[std::size_t(rod)] / rods.half_length();
      set_block(h, at, at, sum);
      set_row(h, at + 3, at, times(difference, a));
      set_row(h, at + 4, at, times(difference, b));
      h(at + 3, at + 3) = a.dot(sum_a) + circle;
      h(at + 4, at + 3) = b.dot(sum_a);
      h(at + 4, at + 4) = b.dot(sum_b) + circle;
    }
    const Vector3<Scalar> a0 = rods.rod(0).frame.col(0), b0 = rods.rod(0).frame.col(1);
    const Vector3<Scalar> a1 = rods.rod(1).frame.col(0), b1 = rods.rod(1).frame.col(1);
    set_block(h, 5, 0, cross[0]);
    h.template block<3, 1>(5, 3) = times(cross[1], a0);
    h.template block<3, 1>(5, 4) = times(cross[1], b0);
    set_row(h, 8, 0, times(cross[2], a1));
    set_row(h, 9, 0, times(cross[2], b1));
    const Vector3<Scalar> both_a = times(cross[3], a0), both_b = times(cross[3], b0);
    h(8, 3) = a1.dot(both_a);
    h(8, 4) = a1.dot(both_b);
    h(9, 3) = b1.dot(both_a);
    h(9, 4) = b1.dot(both_b);

    const Tangent<Scalar> spin = spin_tangent(rods);
    for (int j = 0; j < kTangent; ++j) {
      for (int i = j; i < kTangent; ++i) h(i, j) += spin[i] * spin[j];
    }
    return h;
  }

 private:
  // One number a cable, in whole packets.
  static constexpr int kLanes = 12;
  using Lanes = Eigen::Array<Scalar, kLanes, 1>;
  // xx, xy, xz, yy, yz, zz
  using Symmetric = std::array<Scalar, 6>;
  using Ends = std::array<Symmetric, 4>;

  static Vector3<Scalar> times(const Symmetric& m, const Vector3<Scalar>& v) {
    return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[1] * v[0] + m[3] * v[1] + m[4] * v[2],
            m[2] * v[0] + m[4] * v[1] + m[5] * v[2]};
  }
  static void set_block(TangentMatrix<Scalar>& h, int row, int column, const Symmetric& m) {
    h.template block<3, 3>(row, column) << m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5];
  }
  static void set_row(TangentMatrix<Scalar>& h, int row, int column, const Vector3<Scalar>& v) {
    for (int i = 0; i < 3; ++i) h(row, column + i) = v[i];
  }

  Lanes inverse_lengths_, residuals_;
  std::array<Lanes, 3> directions_;  // from `to` to `from`, unit
};

}  // namespace tensegrity::shape
