// Four vectors of three, one in each lane of the packets of their components: what is computed for
// one is computed for all, in the same time.
#pragma once

#include "tensegrity/math/packet.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity {

template <typename Scalar>
struct VectorLanes {
  using P = Packet<Scalar>;

  // Of four vectors, whose fourth numbers do not matter.
  static VectorLanes of(P a, P b, P c, P d) {
    P::transpose(a, b, c, d);
    return {a, b, c};
  }
  // The same vector four times.
  static VectorLanes all(const Vector3<Scalar>& v) {
    return {P::all(v[0]), P::all(v[1]), P::all(v[2])};
  }
  // Lane by lane those of `yes` where x is greater than `limit`, else those of `no`.
  static VectorLanes where_greater(const P& x, Scalar limit, const VectorLanes& yes,
                                   const VectorLanes& no) {
    return {P::where_greater(x, limit, yes.x, no.x), P::where_greater(x, limit, yes.y, no.y),
            P::where_greater(x, limit, yes.z, no.z)};
  }

  // this + a v, this - a v
  void add(const P& a, const VectorLanes& v) { x.add(a, v.x), y.add(a, v.y), z.add(a, v.z); }
  void subtract(const P& a, const VectorLanes& v) {
    x.subtract(a, v.x), y.subtract(a, v.y), z.subtract(a, v.z);
  }
  friend VectorLanes operator-(const VectorLanes& a, const VectorLanes& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend VectorLanes operator*(const P& a, const VectorLanes& v) {
    return {a * v.x, a * v.y, a * v.z};
  }

  static P dot(const VectorLanes& a, const VectorLanes& b) {
    P sum = a.x * b.x;
    sum.add(a.y, b.y);
    sum.add(a.z, b.z);
    return sum;
  }
  static VectorLanes cross(const VectorLanes& a, const VectorLanes& b) {
    VectorLanes out{a.y * b.z, a.z * b.x, a.x * b.y};
    out.x.subtract(a.z, b.y);
    out.y.subtract(a.x, b.z);
    out.z.subtract(a.y, b.x);
    return out;
  }
  // M' v
  static VectorLanes transposed_times(const Matrix3<Scalar>& m, const VectorLanes& v) {
    const auto component = [&](int k) {
      P sum = m(0, k) * v.x;
      sum.add(m(1, k), v.y);
      sum.add(m(2, k), v.z);
      return sum;
    };
    return {component(0), component(1), component(2)};
  }

  P x, y, z;
};

}  // namespace tensegrity
