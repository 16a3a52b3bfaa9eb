// Cable lengths of a shape against measured ones: half the sum of squared differences, its gradient
// and its Hessian with respect to the tangent.
//
// Written for the net instead of through the 9 x 10 Jacobian: a cable is a 3 x 3 stiffness between
// two endcaps, the endcaps of a free rod move by dc +- across (L/2 du).
#pragma once

#include <array>

#include "tensegrity/math/symmetric.hpp"
#include "tensegrity/shape/gauge.hpp"

namespace tensegrity::shape {

template <typename Scalar>
class LengthResiduals {
 public:
  // `measured`: order of `kPrismCables` [m].
  LengthResiduals(const Rods<Scalar>& rods, const CableLengths<Scalar>& measured) {
    const Endcaps<Scalar> q = rods.endcaps();
    for (int i = 0; i < 3; ++i) {
      // A packet at a time: numbers that are stored one by one cannot be read as packets at once.
      const auto span = [&](int k) {
        const Cable cable = kPrismCables[std::size_t(k)];
        return q(i, cable.from) - q(i, cable.to);
      };
      Scalar* out = &directions_[std::size_t(i)][0];
      Packet<Scalar>(span(0), span(1), span(2), span(3)).store(out);
      Packet<Scalar>(span(4), span(5), span(6), span(7)).store(out + 4);
      Packet<Scalar>(span(8), Scalar(1), Scalar(1), Scalar(1)).store(out + 8);  // no cable
    }
    Lanes measured_lanes;
    Packet<Scalar>(&measured[0]).store(&measured_lanes[0]);
    Packet<Scalar>(&measured[4]).store(&measured_lanes[4]);
    Packet<Scalar>(measured[8], Scalar(1), Scalar(1), Scalar(1)).store(&measured_lanes[8]);
    auto& [x, y, z] = directions_;
    const Lanes lengths = (x * x + y * y + z * z).sqrt();
    // A cable of no length has no direction.
    inverse_lengths_ = (lengths > 0).select(1 / lengths, Scalar(0));
    x *= inverse_lengths_;
    y *= inverse_lengths_;
    z *= inverse_lengths_;
    residuals_ = lengths - measured_lanes;
    Packet<Scalar>(residuals_[8], Scalar(0), Scalar(0), Scalar(0)).store(&residuals_[8]);
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
  // well, to the lower triangle of `h`; a unit stiffness holds the spin about z.
  template <int Stride>
  void hessian(const Rods<Scalar>& rods, bool second_order, Columns<Scalar, Stride> h) const {
    // First, and in two halves: all that follows waits for the division.
    const Tangent<Scalar> spin = spin_by_angle(rods);
    const auto squares = [&](int rod) {
      const int at = 5 * rod;
      return (spin[at] * spin[at] + spin[at + 1] * spin[at + 1]) +
             (spin[at + 3] * spin[at + 3] + spin[at + 4] * spin[at + 4]);
    };
    const Scalar squared = squares(0) + squares(1);
    const Scalar unit = squared > 0 ? 1 / squared : Scalar(0);

    // A cable resists along itself, and as it is tense also across.
    // (A structured binding would not do: in C++17 no lambda may capture it.)
    const Lanes &x = directions_[0], &y = directions_[1], &z = directions_[2];
    Lanes tension = Lanes::Zero();
    if (second_order) tension = residuals_ * inverse_lengths_;
    const Lanes wx = (1 - tension) * x, wy = (1 - tension) * y, wz = (1 - tension) * z;
    const std::array<Lanes, 6> stiffness{
        {wx * x + tension, wx * y, wx * z, wy * y + tension, wy * z, wz * z + tension}};

    const auto of = [&](int k) {
      return Symmetric{stiffness[0][k], stiffness[1][k], stiffness[2][k],
                       stiffness[3][k], stiffness[4][k], stiffness[5][k]};
    };
    Ends own;                         // stiffness at endcaps 2 .. 5
    std::array<Symmetric, 4> cross;   // between the rods: by no side, rod 0's, 1's, both
    std::array<Scalar, 2> circles{};  // endcaps move on circles about their rod's centre
    // Unrolled, so that which cables an endcap holds is known to the compiler.
#pragma GCC unroll 4
    for (int e = 0; e < 4; ++e) {
      const auto& held = kHeldBy[std::size_t(e)];
      own[std::size_t(e)] = sum(sum(of(held[0]), of(held[1])), of(held[2]));
      if (!second_order) continue;
      const int rod = e / 2;
      const auto u = rods.rod(rod).direction();
#pragma GCC unroll 3
      for (int k : held) {
        const int sign = kPrismCables[std::size_t(k)].from == e + 2 ? 1 : -1;
        circles[std::size_t(rod)] -=
            Scalar(sign * rod_side(e)) * residuals_[k] * (x[k] * u[0] + y[k] * u[1] + z[k] * u[2]);
      }
    }
    {  // from rod 0's even end to the even end of rod 1, odd to odd, even to odd
      const Symmetric ee = of(kBetween[0]), oo = of(kBetween[1]), eo = of(kBetween[2]);
      for (std::size_t i = 0; i < 6; ++i) {
        cross[0][i] = -ee[i] - oo[i] - eo[i];
        cross[1][i] = -ee[i] + oo[i] - eo[i];
        cross[2][i] = -ee[i] + oo[i] + eo[i];
        cross[3][i] = -ee[i] - oo[i] + eo[i];
      }
    }

    const auto set = [&](int row, int column, Scalar value) {
      h[column][row] = value + unit * spin[row] * spin[column];
    };
    const auto set_block = [&](int row, int column, const Symmetric& m) {
      set(row, column, m[0]), set(row + 1, column, m[1]), set(row + 2, column, m[2]);
      set(row, column + 1, m[1]), set(row + 1, column + 1, m[3]), set(row + 2, column + 1, m[4]);
      set(row, column + 2, m[2]), set(row + 1, column + 2, m[4]), set(row + 2, column + 2, m[5]);
    };
    const auto set_column = [&](int row, int column, const Vector3<Scalar>& v) {
      for (int i = 0; i < 3; ++i) set(row + i, column, v[i]);
    };
    const auto set_row = [&](int row, int column, const Vector3<Scalar>& v) {
      for (int i = 0; i < 3; ++i) set(row, column + i, v[i]);
    };
    for (int rod = 0; rod < 2; ++rod) {
      const int at = 5 * rod;
      const Symmetric& even = own[std::size_t(2 * rod)];
      const Symmetric& odd = own[std::size_t(2 * rod + 1)];
      const Symmetric both = sum(even, odd);
      Symmetric difference;
      for (std::size_t i = 0; i < 6; ++i) difference[i] = even[i] - odd[i];
      const Vector3<Scalar> a = rods.rod(rod).frame.col(0), b = rods.rod(rod).frame.col(1);
      const Vector3<Scalar> both_a = times(both, a), both_b = times(both, b);
      const Scalar circle = circles[std::size_t(rod)] / rods.half_length();
      set_block(at, at, both);
      set_row(at + 3, at, times(difference, a));
      set_row(at + 4, at, times(difference, b));
      set(at + 3, at + 3, dot(a, both_a) + circle);
      set(at + 4, at + 3, dot(b, both_a));
      set(at + 4, at + 4, dot(b, both_b) + circle);
    }
    const Vector3<Scalar> a0 = rods.rod(0).frame.col(0), b0 = rods.rod(0).frame.col(1);
    const Vector3<Scalar> a1 = rods.rod(1).frame.col(0), b1 = rods.rod(1).frame.col(1);
    set_block(5, 0, cross[0]);
    set_column(5, 3, times(cross[1], a0));
    set_column(5, 4, times(cross[1], b0));
    set_row(8, 0, times(cross[2], a1));
    set_row(9, 0, times(cross[2], b1));
    const Vector3<Scalar> both_a = times(cross[3], a0), both_b = times(cross[3], b0);
    set(8, 3, dot(a1, both_a));
    set(8, 4, dot(a1, both_b));
    set(9, 3, dot(b1, both_a));
    set(9, 4, dot(b1, both_b));
  }

 private:
  // One number a cable, in whole packets.
  static constexpr int kLanes = 12;
  using Lanes = Eigen::Array<Scalar, kLanes, 1>;
  // xx, xy, xz, yy, yz, zz
  using Symmetric = std::array<Scalar, 6>;
  using Ends = std::array<Symmetric, 4>;

  // Cables that endcaps 2 .. 5 hold, and those between rods 23 and 45.
  static constexpr std::array<std::array<int, 3>, 4> kHeldBy = {
      {{{1, 2, 8}}, {{4, 5, 7}}, {{0, 2, 6}}, {{3, 5, 8}}}};
  static constexpr std::array<int, 3> kBetween = {2, 5, 8};

  static Vector3<Scalar> times(const Symmetric& m, const Vector3<Scalar>& v) {
    return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[1] * v[0] + m[3] * v[1] + m[4] * v[2],
            m[2] * v[0] + m[4] * v[1] + m[5] * v[2]};
  }
  // By components: Eigen's packets of two would wait for what is stored one by one.
  static Scalar dot(const Vector3<Scalar>& a, const Vector3<Scalar>& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
  static Symmetric sum(const Symmetric& a, const Symmetric& b) {
    Symmetric out;
    for (std::size_t i = 0; i < 6; ++i) out[i] = a[i] + b[i];
    return out;
  }

  Lanes inverse_lengths_, residuals_;
  std::array<Lanes, 3> directions_;  // from `to` to `from`, unit
};

}  // namespace tensegrity::shape
