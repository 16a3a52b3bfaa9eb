// Cable lengths of a shape against measured ones: half the sum of squared differences, its gradient
// and its Hessian with respect to the tangent.
//
// Written for the net instead of through the 9 x 10 Jacobian: a cable is a 3 x 3 stiffness between
// two endcaps, the endcaps of a free rod move by dc +- across (L/2 du). Each of the four free
// endcaps holds three cables: what is wanted of all of them is computed for four endcaps, or for
// two directions across two rods, at once. The three cables between free endcaps are there twice.
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
    Vectors push;
    P turn;
    pull(forces(), directions_across(rods), push, turn);
    Tangent<Scalar> out;
    for (int i = 0; i < 3; ++i) {
      out[i] = push[std::size_t(i)].at(0);
      out[5 + i] = push[std::size_t(i)].at(2);
    }
    out[3] = turn.at(0), out[4] = turn.at(1);
    out[8] = turn.at(2), out[9] = turn.at(3);
    return out;
  }

  // The equations of a step: in the lower triangle of `h` J' J, with `second_order` and the second
  // derivatives of the lengths times the residuals, and a unit stiffness that holds the spin about
  // z; below it, in row `kTangent`, the gradient. Above the diagonal is anything.
  template <int Stride>
  void equations(const Rods<Scalar>& rods, bool second_order, Columns<Scalar, Stride> h) const {
    static_assert(Stride == padded(kTangent + 1), "whole packets");
    // First, and in two halves: all that follows waits for the division.
    const Tangent<Scalar> by_angle = spin_by_angle(rods);
    const auto squares = [&](int rod) {
      const int at = 5 * rod;
      return (by_angle[at] * by_angle[at] + by_angle[at + 1] * by_angle[at + 1]) +
             (by_angle[at + 3] * by_angle[at + 3] + by_angle[at + 4] * by_angle[at + 4]);
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
    // Between the rods: of directions across rod 0 on the centre of rod 1 and of those across rod 1
    // on the centre of rod 0, of directions on directions, and of centres on centres.
    Symmetric mixed, turning;
    std::array<Scalar, 6> centres;
    for (std::size_t i = 0; i < 6; ++i) {
      const P own = lane(stiffness[i], 0) + lane(stiffness[i], 1) + lane(stiffness[i], 2);
      both[i] = of_even(own) + of_odd(own);
      difference[i] = of_even(own) - of_odd(own);
      // From rod 0's even end to the even end of rod 1, odd to odd, even to odd.
      const Scalar ee = stiffness[i][4], oo = stiffness[i][5], eo = stiffness[i][8];
      const Scalar less = oo - ee, more = oo + ee;
      mixed[i] = {less - eo, less - eo, less + eo, less + eo};
      turning[i] = {eo - more, eo - more, eo - more, eo - more};
      centres[i] = -more - eo;
    }

    const Vectors force = forces();
    Vectors push;
    P turn;
    pull(force, across, push, turn);
    const Vectors turned = times(difference, across), held = times(both, across),
                  crossed = times(mixed, across), twisted = times(turning, across);
    P along, aside, between;  // a' B a and b' B b, b' B a, and of rod 1 with those of rod 0
    for (std::size_t i = 0; i < 3; ++i) {
      along = along + across[i] * held[i];
      aside = aside + swapped(across[i]) * held[i];
      between = between + P::template permute<2, 3, 2, 3>(across[i]) *
                              P::template permute<0, 0, 1, 1>(twisted[i]);
    }
    if (second_order) {  // endcaps move on circles about their rod's centre
      P circle;
      for (std::size_t i = 0; i < 3; ++i) {
        const Scalar u0 = rods.rod(0).frame(int(i), 2), u1 = rods.rod(1).frame(int(i), 2);
        circle = circle + P(u0, u0, u1, u1) * (of_even(force[i]) - of_odd(force[i]));
      }
      along.subtract(1 / rods.half_length(), circle);
    }

    // Columns of the equations, whole packets at a time. What nothing reads is one: built with a
    // zero GCC moves a register in a way that Valgrind 3.19 does not know.
    constexpr Scalar kNone = 1;
    const P spin[3] = {P(&by_angle[0]), P(&by_angle[4]),
                       P(by_angle[8], by_angle[9], Scalar(0), Scalar(0))};
    const auto put = [&](int column, int packet, P values) {
      values.add(unit * by_angle[column], spin[packet]);
      values.store(h[column] + 4 * packet);
    };
    constexpr std::size_t kColumns[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};  // of a Symmetric
#pragma GCC unroll 3
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& row = kColumns[i];
      const int column = int(i);
      P a = turned[i], b = both[row[0]], c = both[row[1]], d = both[row[2]];
      P::transpose(a, b, c, d);  // by rod and direction, of which the blocks have two alike
      put(column, 0, P::template permute<1, 2, 3, 0>(a));
      put(column + 5, 1, c);
      put(column, 1, {turned[i].at(1), centres[row[0]], centres[row[1]], centres[row[2]]});
      put(column, 2, {crossed[i].at(2), crossed[i].at(3), push[i].at(0), kNone});
      put(column + 5, 2, {turned[i].at(2), turned[i].at(3), push[i].at(2), kNone});
    }
    P a(aside.at(0), along.at(1), kNone, kNone);
    P b = crossed[0], c = crossed[1], d = crossed[2];
    P::transpose(a, b, c, d);
    put(3, 0, {kNone, kNone, kNone, along.at(0)});
    put(3, 1, a);
    put(3, 2, {between.at(0), between.at(1), turn.at(0), kNone});
    put(4, 1, b);
    put(4, 2, {between.at(2), between.at(3), turn.at(1), kNone});
    put(8, 2, {along.at(2), aside.at(2), turn.at(2), kNone});
    put(9, 2, {kNone, along.at(3), turn.at(3), kNone});
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
  // The other direction across the same rod.
  static P swapped(const P& x) { return P::template permute<1, 0, 3, 2>(x); }

  // The gradient by the positions of endcaps 2 .. 5.
  Vectors forces() const {
    Vectors out;
    for (std::size_t i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        out[i] = out[i] + lane(residuals_, k) * lane(directions_[i], k);
      }
    }
    return out;
  }
  // On the centres of the rods, and on their directions across.
  static void pull(const Vectors& force, const Vectors& across, Vectors& push, P& turn) {
    turn = P();
    for (std::size_t i = 0; i < 3; ++i) {
      push[i] = of_even(force[i]) + of_odd(force[i]);
      turn = turn + across[i] * (of_even(force[i]) - of_odd(force[i]));
    }
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
