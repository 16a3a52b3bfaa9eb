// Which of the shapes that meet the cable lengths are the robot (T eq. 15d-l), and what is wrong
// with the inequalities as they are printed.
//
//   15d,e  q2z, q4z > 0 > q3z, q5z: hold for a robot close to its undeformed shape only. A rolling
//          robot violates them most of the time.
//   15i    has the wrong sign: with q1 - q0 even the undeformed robot violates it. q0 - q1 is
//   meant. 15j-l  are products of differences within one end polygon and the other. A reflection
//   changes
//          no inner product, so they cannot tell the robot from its mirror image.
//
// What does characterise the robot are the mutual moments of its rod axes,
//
//   m_ij = (c_j - c_i) . (u_i x u_j)   for the rod pairs (01,23), (23,45), (45,01)   [m]
//
// with c a rod's centre and u its direction. m_ij is zero exactly when the two axes are in one
// plane (they cross or are parallel), so rods that cannot pass through each other cannot change its
// sign. All three are negative for the robot of T and positive for its mirror image.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "tensegrity/robot/prism.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity::shape {

enum class ConstraintSet : std::uint8_t {
  kAsPrinted,     // T eq. 15d-l, to the letter; no undeformed robot satisfies it
  kCorrected,     // T eq. 15d-l with the sign of 15i repaired
  kMutualMoment,  // the three mutual moments alone
};

// Rod pairs of the mutual moments.
inline constexpr std::array<std::array<int, 2>, 3> kRodPairs = {{{0, 1}, {1, 2}, {2, 0}}};

// m_ij in the order of `kRodPairs` [m]; all of `Prism::moment_sign()` for a valid shape.
template <typename Scalar>
Vector3<Scalar> mutual_moments(const Endcaps<Scalar>& q) {
  Vector3<Scalar> moments;
  for (int k = 0; k < 3; ++k) {
    const int i = 2 * kRodPairs[static_cast<std::size_t>(k)][0];
    const int j = 2 * kRodPairs[static_cast<std::size_t>(k)][1];
    const Vector3<Scalar> ui = (q.col(i) - q.col(i + 1)).normalized();
    const Vector3<Scalar> uj = (q.col(j) - q.col(j + 1)).normalized();
    const Vector3<Scalar> between = (q.col(j) + q.col(j + 1) - q.col(i) - q.col(i + 1)) / 2;
    moments[k] = between.dot(ui.cross(uj));
  }
  return moments;
}

enum class Handedness : std::uint8_t {
  kRight,     // the robot
  kMirrored,  // its mirror image: a reflection y -> -y repairs it and changes no length
  kMixed,     // two rods touch or have passed through each other: no reflection repairs it
};

// `moment_sign`: see `Prism::moment_sign`. Rods that touch, as they do where impossible lengths
// press the shape flat, count as crossed: the sign of their moment is rounding.
template <typename Scalar>
Handedness handedness(const Endcaps<Scalar>& q, Scalar moment_sign) {
  const Scalar touching = Scalar(1e-5) * (q.col(0) - q.col(1)).norm();
  const Vector3<Scalar> signed_moments = moment_sign * mutual_moments(q);
  if ((signed_moments.array() > touching).all()) return Handedness::kRight;
  if ((signed_moments.array() < -touching).all()) return Handedness::kMirrored;
  return Handedness::kMixed;
}

// One inequality of T eq. 15, g(q) >= 0, as a product of one, two or three linear forms of the
// endcaps: <a, e_z>, <a, b> or <a x b, c> with a = sum_i a_i q_i. Value, gradient and Hessian are
// exact polynomials.
template <typename Scalar>
class Inequality {
 public:
  using Form = Vector<Scalar, 6>;  // coefficients a_i of the endcaps

  static Inequality height(const Form& a) { return {1, a, Form::Zero(), Form::Zero()}; }
  static Inequality inner(const Form& a, const Form& b) { return {2, a, b, Form::Zero()}; }
  static Inequality triple(const Form& a, const Form& b, const Form& c) { return {3, a, b, c}; }

  // [m], [m^2] or [m^3] by the number of forms.
  Scalar value(const Endcaps<Scalar>& q) const {
    const Vector3<Scalar> a = q * form_[0];
    if (forms_ == 1) return a.z();
    const Vector3<Scalar> b = q * form_[1];
    if (forms_ == 2) return a.dot(b);
    return a.cross(b).dot(q * form_[2]);
  }

  // With respect to the endcaps; one column per endcap.
  Endcaps<Scalar> gradient(const Endcaps<Scalar>& q) const {
    if (forms_ == 1) return Vector3<Scalar>::UnitZ() * form_[0].transpose();
    const Vector3<Scalar> a = q * form_[0];
    const Vector3<Scalar> b = q * form_[1];
    if (forms_ == 2) return b * form_[0].transpose() + a * form_[1].transpose();
    const Vector3<Scalar> c = q * form_[2];
    return b.cross(c) * form_[0].transpose() + c.cross(a) * form_[1].transpose() +
           a.cross(b) * form_[2].transpose();
  }

  // With respect to the stacked endcaps.
  Matrix<Scalar, 18> hessian(const Endcaps<Scalar>& q) const {
    Matrix<Scalar, 18> out = Matrix<Scalar, 18>::Zero();
    if (forms_ == 2) {
      add_pair(Matrix3<Scalar>::Identity(), form_[0], form_[1], out);
    } else if (forms_ == 3) {
      // <a x b, c>: the block of (a, b) is d2/da db = -[c]x, the others follow cyclically.
      for (std::size_t k = 0; k < 3; ++k) {
        add_pair(minus_cross(q * form_[(k + 2) % 3]), form_[k], form_[(k + 1) % 3], out);
      }
    }
    return out;
  }

 private:
  Inequality(int forms, const Form& a, const Form& b, const Form& c)
      : forms_(forms), form_{a, b, c} {}

  static Matrix3<Scalar> minus_cross(const Vector3<Scalar>& v) {
    Matrix3<Scalar> m;
    m << 0, v.z(), -v.y(), -v.z(), 0, v.x(), v.y(), -v.x(), 0;
    return m;
  }

  // a' M b with both orders of differentiation.
  static void add_pair(const Matrix3<Scalar>& m, const Form& a, const Form& b,
                       Matrix<Scalar, 18>& out) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        out.template block<3, 3>(3 * i, 3 * j) += a[i] * b[j] * m + a[j] * b[i] * m.transpose();
      }
    }
  }

  int forms_;
  std::array<Form, 3> form_;
};

inline constexpr int kMaxInequalities = 10;

// The inequalities of one constraint set. Those that depend on chirality are written for the given
// one: `moment_sign` is `Prism::moment_sign()`.
template <typename Scalar>
class InequalitySet {
 public:
  InequalitySet(ConstraintSet set, Scalar moment_sign) {
    using Form = typename Inequality<Scalar>::Form;
    const auto q = [](int i) -> Form { return Form::Unit(i); };
    const auto centre = [](int rod) -> Form {
      return (Form::Unit(2 * rod) + Form::Unit(2 * rod + 1)) / 2;
    };
    const auto axis = [](int rod) -> Form { return Form::Unit(2 * rod) - Form::Unit(2 * rod + 1); };
    if (set == ConstraintSet::kMutualMoment) {
      for (const auto& pair : kRodPairs) {
        const Form between = centre(pair[1]) - centre(pair[0]);
        add(Inequality<Scalar>::triple(axis(pair[0]), axis(pair[1]), moment_sign * between));
      }
      return;
    }
    add(Inequality<Scalar>::height(q(2)));   // 15d
    add(Inequality<Scalar>::height(-q(3)));  // 15d
    add(Inequality<Scalar>::height(q(4)));   // 15e
    add(Inequality<Scalar>::height(-q(5)));  // 15e
    // T's robot has m_ij < 0; the triple products of 15g-i turn around for its mirror image.
    const Scalar mirror = -moment_sign;
    const Form base = set == ConstraintSet::kAsPrinted ? Form(-axis(0)) : axis(0);
    const auto circulation = [&](int a, int b, int c, const Form& along) {
      return Inequality<Scalar>::triple(centre(b) - centre(a), centre(c) - centre(b),
                                        mirror * along);
    };
    add(circulation(0, 1, 2, axis(1)));                        // 15g
    add(circulation(1, 2, 0, axis(2)));                        // 15h
    add(circulation(2, 0, 1, base));                           // 15i
    add(Inequality<Scalar>::inner(q(2) - q(4), q(5) - q(1)));  // 15j
    add(Inequality<Scalar>::inner(q(0) - q(2), q(3) - q(5)));  // 15k
    add(Inequality<Scalar>::inner(q(4) - q(0), q(1) - q(3)));  // 15l
  }

  int size() const { return size_; }
  const Inequality<Scalar>& operator[](int i) const { return items_[static_cast<std::size_t>(i)]; }

  bool satisfied(const Endcaps<Scalar>& q) const {
    for (int i = 0; i < size_; ++i) {
      if (!((*this)[i].value(q) > 0)) return false;
    }
    return true;
  }

 private:
  using Item = Inequality<Scalar>;

  void add(const Item& item) { items_[static_cast<std::size_t>(size_++)] = item; }

  static Item zero() { return Item::height(Item::Form::Zero()); }

  int size_ = 0;
  std::array<Item, kMaxInequalities> items_ = {zero(), zero(), zero(), zero(), zero(),
                                               zero(), zero(), zero(), zero(), zero()};
};

}  // namespace tensegrity::shape
