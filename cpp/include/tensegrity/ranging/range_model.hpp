// Distances that radio modules on rods measure, with their derivatives.
//
// A module does not sit at the end of its rod but `inset` metres inside, on the axis (0.1 m on
// SUPERball, C §III-B): with the end e, the far end f of the same rod and u = (f - e)/|f - e|,
//
//   m = e + inset u,   dm/df = (inset/|f - e|) (I - u u'),   dm/de = I - dm/df.
//
// Ends, not modules, are the nodes of the net, so a range depends on both ends of a rod. Points in
// one place have no direction between them: derivatives by them are zero there.
#pragma once

#include "tensegrity/types.hpp"

namespace tensegrity::ranging {

namespace detail {

// Of unit length, or zero.
template <typename Scalar>
Vector3<Scalar> direction(const Vector3<Scalar>& line, Scalar length) {
  return length > 0 ? Vector3<Scalar>(line / length) : Vector3<Scalar>(Vector3<Scalar>::Zero());
}

}  // namespace detail

// Where a module is, from the two ends of its rod.
template <typename Scalar>
struct Module {
  Vector3<Scalar> position;  // [m], frame of the ends
  Matrix3<Scalar> by_end;    // d position / d end
  Matrix3<Scalar> by_far_end;

  Module(const Vector3<Scalar>& end, const Vector3<Scalar>& far_end, Scalar inset) {
    const Vector3<Scalar> rod = far_end - end;
    const Scalar length = rod.norm();
    const Vector3<Scalar> axis = detail::direction(rod, length);
    const Scalar share = length > 0 ? inset / length : Scalar(0);
    position = end + inset * axis;
    by_far_end = share * (Matrix3<Scalar>::Identity() - axis * axis.transpose());
    by_end = Matrix3<Scalar>::Identity() - by_far_end;
  }
};

// From a module to an anchor.
template <typename Scalar>
struct AnchorDistance {
  Scalar distance;  // [m]
  Vector3<Scalar> by_end;
  Vector3<Scalar> by_far_end;
  Vector3<Scalar> by_anchor;

  AnchorDistance(const Module<Scalar>& module, const Vector3<Scalar>& anchor) {
    const Vector3<Scalar> line = module.position - anchor;
    distance = line.norm();
    const Vector3<Scalar> direction = detail::direction(line, distance);
    by_end = module.by_end.transpose() * direction;
    by_far_end = module.by_far_end.transpose() * direction;
    by_anchor = -direction;
  }
};

// Between two modules of the robot. When both are on one rod, a node appears twice: as the end of
// one module and as the far end of the other; its derivative is the sum.
template <typename Scalar>
struct ModuleDistance {
  Scalar distance;  // [m]
  Vector3<Scalar> by_first_end;
  Vector3<Scalar> by_first_far_end;
  Vector3<Scalar> by_second_end;
  Vector3<Scalar> by_second_far_end;

  ModuleDistance(const Module<Scalar>& first, const Module<Scalar>& second) {
    const Vector3<Scalar> line = first.position - second.position;
    distance = line.norm();
    const Vector3<Scalar> direction = detail::direction(line, distance);
    by_first_end = first.by_end.transpose() * direction;
    by_first_far_end = first.by_far_end.transpose() * direction;
    by_second_end = -(second.by_end.transpose() * direction);
    by_second_far_end = -(second.by_far_end.transpose() * direction);
  }
};

}  // namespace tensegrity::ranging
