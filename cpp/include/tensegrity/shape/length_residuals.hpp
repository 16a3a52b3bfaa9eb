// Cable lengths of a shape against measured ones: half the sum of squared differences, its gradient
// and its Hessian with respect to the tangent.
//
// Written for the net instead of through the 9 x 10 Jacobian: a cable is a 3 x 3 stiffness between
// two endcaps, the endcaps of a free rod move by dc +- across (L/2 du). Each of the four free
// endcaps holds three cables: what is wanted of all of them is computed for four endcaps, or for two
// directions across two rods, at once. The three cables between free endcaps are there twice.
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
    const Scalar half = rods.half_length();
    for (int i = 0; i < 3; ++i) {
      const auto &c0 = rods.rod(0).centre, &c1 = rods.rod(1).centre;
      const Scalar u0 = half * rods.rod(0).frame(i, 2), u1 = half * rods.rod(1).frame(i, 2);
      const Scalar b0 = rods.base(0)[i], b1 = rods.base(1)[i];
      const P ends(c0[i] + u0, c0[i] - u0, c1[i] + u1, c1[i] - u1);
      // To the other end of the cable, in the order of kHeldBy.
      Scalar* out = &directions_[std::size_t(i)][0];
      (ends - P(b0, b1, b0, b1)).store(out);
      (ends - P::template permute<2, 3, 0, 1>(ends)).store(out + 4);
      (ends - P(ends.at(3), b0, b1, ends.at(0))).store(out + 8);
    }
    Lanes measured_lanes;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& cable = kHeldBy[k];
      P(measured[cable[0]], measured[cable[1]], measured[cable[2]], measured[cable[3]])
          .store(&measured_lanes[4 * int(k)]);
    }
    auto& [x, y, z] = directions_;
    const Lanes lengths = (x * x + y * y + z * z).sqrt();
    // A cable of no length has no direction.
    inverse_lengths_ = (lengths > 0).select(1 / lengths, Scalar(0));
    x *= inverse_lengths_;
    y *= inverse_lengths_;
    z *= inverse_lengths_;
    residuals_ = lengths - measured_lanes;
  }

  // Sum of squared residuals [m^2].
  Scalar cost() const {
    const auto squares = [&](int k) {
      const P r = lane(residuals_, k);
      return r * r;
    };
    // Of those there twice, half of each.
    P sum = squares(0) + squares(2) * P(Scalar(0.5), Scalar(1), Scalar(1), Scalar(0.5));
    sum.add(Scalar(0.5), squares(1));
    return (sum.at(0) + sum.at(1)) + (sum.at(2) + sum.at(3));
  }

  // J' residuals
  Tangent<Scalar> gradient(const Rods<Scalar>& rods) const {
    Tangent<Scalar> out;
    const Vectors pull = forces(), across = directions_across(rods);
    P turn;
    for (std::size_t i = 0; i < 3; ++i) {
      const P push = of_even(pull[i]) + of_odd(pull[i]);
      out[int(i)] = push.at(0);
      out[5 + int(i)] = push.at(2);
      turn = turn + across[i] * (of_even(pull[i]) - of_odd(pull[i]));
    }
    out[3] = turn.at(0), out[4] = turn.at(1);
    out[8] = turn.at(2), out[9] = turn.at(3);
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
    const auto& [x, y, z] = directions_;
    Lanes tension = Lanes::Zero();
    if (second_order) tension = residuals_ * inverse_lengths_;
    const Lanes wx = (1 - tension) * x, wy = (1 - tension) * y, wz = (1 - tension) * z;
    const std::array<Lanes, 6> stiffness{
        {wx * x + tension, wx * y, wx * z, wy * y + tension, wy * z, wz * z + tension}};

    const Vectors across = directions_across(rods);
    // Of a rod's endcaps together, and of the even one less the odd one.
    Symmetric both, difference;
    // Between the rods, of `across` of rod 0 on the centre of rod 1 and of rod 1 on that of rod 0,
    // of directions on directions, and of centres on centres.
    Symmetric mixed, turning;
    std::array<Scalar, 6> centres;
    for (std::size_t i = 0; i < 6; ++i) {
      const P own = lane(stiffness[i], 0) + lane(stiffness[i], 1) + lane(stiffness[i], 2);
      both[i] = of_even(own) + of_odd(own);
      difference[i] = of_even(own) - of_odd(own);
      // From rod 0's even end to the even end of rod 1, odd to odd, even to odd.
      const Scalar ee = stiffness[i][4], oo = stiffness[i][5], eo = stiffness[i][8];
      const Scalar less = oo - ee;
      mixed[i] = {less - eo, less - eo, less + eo, less + eo};
      centres[i] = -(ee + oo) - eo;
      const Scalar turn = eo - (ee + oo);
      turning[i] = {turn, turn, turn, turn};
    }

    const Vectors turned = times(difference, across), held = times(both, across),
                  crossed = times(mixed, across), twisted = times(turning, across);
    P along, aside, between;  // a' B a and b' B b, b' B a, and of rod 1 with those of rod 0
    for (std::size_t i = 0; i < 3; ++i) {
      along = along + across[i] * held[i];
      aside = aside + P::template permute<1, 0, 3, 2>(across[i]) * held[i];
      between = between + P::template permute<2, 2, 3, 3>(across[i]) *
                              P::template permute<0, 1, 0, 1>(twisted[i]);
    }
    if (second_order) {  // endcaps move on circles about their rod's centre
      const Vectors pull = forces();
      P circle;
      for (std::size_t i = 0; i < 3; ++i) {
        const Scalar u0 = rods.rod(0).frame(int(i), 2), u1 = rods.rod(1).frame(int(i), 2);
        circle = circle + P(u0, u0, u1, u1) * (of_even(pull[i]) - of_odd(pull[i]));
      }
      along.subtract(1 / rods.half_length(), circle);
    }

    const auto set = [&](int row, int column, Scalar value) {
      h[column][row] = value + unit * spin[row] * spin[column];
    };
    const auto set_block = [&](int row, int column, const auto& m) {
      set(row, column, m(0)), set(row + 1, column, m(1)), set(row + 2, column, m(2));
      set(row, column + 1, m(1)), set(row + 1, column + 1, m(3)), set(row + 2, column + 1, m(4));
      set(row, column + 2, m(2)), set(row + 1, column + 2, m(4)), set(row + 2, column + 2, m(5));
    };
#pragma GCC unroll 2
    for (int rod = 0; rod < 2; ++rod) {
      const int at = 5 * rod, a = 2 * rod, b = a + 1;
      set_block(at, at, [&](std::size_t i) { return both[i].at(a); });
      for (int i = 0; i < 3; ++i) {
        set(at + 3, at + i, turned[std::size_t(i)].at(a));
        set(at + 4, at + i, turned[std::size_t(i)].at(b));
      }
      set(at + 3, at + 3, along.at(a));
      set(at + 4, at + 3, aside.at(a));
      set(at + 4, at + 4, along.at(b));
    }
    set_block(5, 0, [&](std::size_t i) { return centres[i]; });
    for (int i = 0; i < 3; ++i) {
      const P& on_centres = crossed[std::size_t(i)];
      set(5 + i, 3, on_centres.at(0));
      set(5 + i, 4, on_centres.at(1));
      set(8, i, on_centres.at(2));
      set(9, i, on_centres.at(3));
    }
    set(8, 3, between.at(0));
    set(8, 4, between.at(1));
    set(9, 3, between.at(2));
    set(9, 4, between.at(3));
  }

 private:
  using P = Packet<Scalar>;
  // One number for each of three cables that endcaps 2 .. 5 hold.
  static constexpr int kLanes = 12;
  using Lanes = Eigen::Array<Scalar, kLanes, 1>;
  using Vectors = std::array<P, 3>;    // by axis
  using Symmetric = std::array<P, 6>;  // xx, xy, xz, yy, yz, zz

  // To a base endcap, to the like endcap of the other rod, the rest.
  static constexpr std::array<std::array<int, 4>, 3> kHeldBy = {
      {{{1, 4, 0, 3}}, {{2, 5, 2, 5}}, {{8, 7, 6, 8}}}};

  static P lane(const Lanes& x, int k) { return P(&x[4 * k]); }
  // Of endcaps 2 .. 5, those of each rod's even or odd one: rod 0 twice, rod 1 twice.
  static P of_even(const P& x) { return P::template permute<0, 0, 2, 2>(x); }
  static P of_odd(const P& x) { return P::template permute<1, 1, 3, 3>(x); }

  // Of cables that are too long, on endcaps 2 .. 5, away from the other end.
  Vectors forces() const {
    Vectors out;
    for (std::size_t i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        out[i] = out[i] + lane(residuals_, k) * lane(directions_[i], k);
      }
    }
    return out;
  }
  // Both directions across rod 0, then both across rod 1.
  static Vectors directions_across(const Rods<Scalar>& rods) {
    Vectors out;
    for (int i = 0; i < 3; ++i) {
      const auto &f0 = rods.rod(0).frame, &f1 = rods.rod(1).frame;
      out[std::size_t(i)] = P(f0(i, 0), f0(i, 1), f1(i, 0), f1(i, 1));
    }
    return out;
  }
  static Vectors times(const Symmetric& m, const Vectors& v) {
    return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[1] * v[0] + m[3] * v[1] + m[4] * v[2],
            m[2] * v[0] + m[4] * v[1] + m[5] * v[2]};
  }

  Lanes inverse_lengths_, residuals_;
  std::array<Lanes, 3> directions_;  // toward the endcap that holds the cable, unit
};

}  // namespace tensegrity::shape
