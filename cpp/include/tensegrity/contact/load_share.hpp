// How the robot's weight is shared by the three lowest endcaps.
//
// Three point supports carry a weight in the ratio of the barycentric coordinates of the centre of
// mass's horizontal projection in their triangle (moment equilibrium about its sides). A negative
// share means that the robot is tipping over the opposite side: that endcap is being lifted off.
// The shares depend on horizontal geometry alone, so an endcap that is wrongly held on the ground,
// and thereby has its estimated height pulled to zero, gains no share by it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "tensegrity/robot/prism.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity::contact {

// Endcaps from the lowest to the highest; ties keep the order of their numbers. `world` is in any
// frame whose z axis points up and has to be finite.
template <typename Scalar>
std::array<int, 6> lowest_first(const Endcaps<Scalar>& world) {
  std::array<int, 6> order{{0, 1, 2, 3, 4, 5}};
  for (std::size_t i = 1; i < order.size(); ++i) {  // insertion sort: nothing is shorter for six
    for (std::size_t j = i; j > 0 && world(2, order[j]) < world(2, order[j - 1]); --j) {
      std::swap(order[j], order[j - 1]);
    }
  }
  return order;
}

// Barycentric coordinates of the point p in the plane triangle (a, b, c): p = s0 a + s1 b + s2 c
// with s0 + s1 + s2 = 1. A triangle without area, on which a share means nothing, gives thirds.
template <typename Scalar>
Vector3<Scalar> barycentric(const Vector<Scalar, 2>& a, const Vector<Scalar, 2>& b,
                            const Vector<Scalar, 2>& c, const Vector<Scalar, 2>& p) {
  const auto cross = [](const Vector<Scalar, 2>& u, const Vector<Scalar, 2>& v) {
    return u.x() * v.y() - u.y() * v.x();
  };
  const Vector<Scalar, 2> ab = b - a, ac = c - a, ap = p - a;
  const Scalar area = cross(ab, ac);  // twice, signed
  // Relative to the sides, so that the test is the same in metres and in millimetres.
  if (std::abs(area) <= Scalar(1e-4) * (ab.squaredNorm() + ac.squaredNorm())) {
    return Vector3<Scalar>::Constant(Scalar(1) / 3);
  }
  const Scalar s1 = cross(ap, ac) / area;
  const Scalar s2 = cross(ab, ap) / area;
  return {1 - s1 - s2, s1, s2};
}

// Shares of the robot's weight for `order[0..2]`. The rods are alike and uniform, so that the
// centre of mass is the mean of the endcaps.
template <typename Scalar>
Vector3<Scalar> load_share(const Endcaps<Scalar>& world, const std::array<int, 6>& order) {
  const Matrix<Scalar, 2, 6> ground = world.template topRows<2>();
  return barycentric<Scalar>(ground.col(order[0]), ground.col(order[1]), ground.col(order[2]),
                             ground.rowwise().mean());
}

// Shares for the endcaps that are known to carry load: one takes all, two share as a lever does,
// three as above; of more the lowest three count. Each is at least `least`, and they sum to one;
// endcaps without load have zero.
template <typename Scalar>
std::array<Scalar, 6> support_shares(const Endcaps<Scalar>& world,
                                     const std::array<bool, 6>& loaded,
                                     Scalar least = Scalar(0.01)) {
  std::array<int, 6> feet{};
  std::size_t count = 0;
  for (const int endcap : lowest_first(world)) {
    if (loaded[std::size_t(endcap)] && count < 3) feet[count++] = endcap;
  }
  Vector3<Scalar> share(1, 0, 0);
  if (count == 2) {
    const Vector<Scalar, 2> centre = world.template topRows<2>().rowwise().mean();
    const Vector<Scalar, 2> a = world.col(feet[0]).template head<2>();
    const Vector<Scalar, 2> lever = world.col(feet[1]).template head<2>() - a;
    const Scalar far = lever.dot(centre - a) / lever.squaredNorm();
    share << 1 - far, far, 0;
  } else if (count == 3) {
    share = load_share(world, feet);
  }
  std::array<Scalar, 6> shares{};
  Scalar sum = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Scalar s = share[Eigen::Index(k)];
    sum += shares[std::size_t(feet[k])] = s > least ? s : least;
  }
  for (std::size_t k = 0; k < count; ++k) shares[std::size_t(feet[k])] /= sum;
  return shares;
}

}  // namespace tensegrity::contact
