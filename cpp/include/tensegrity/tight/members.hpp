// What holds the robot together, as measurements: nine cables of measured length, two rods of known
// length, and the side of the fold the shape is on.
//
// With right-invariant errors the distance of endcaps i and j moves by n . (xi_i - xi_j), n the
// unit vector from j to i: no rotation, no position of the whole.
#pragma once

#include "tensegrity/shape/fold.hpp"
#include "tensegrity/tight/sequential_update.hpp"

namespace tensegrity::tight {

template <typename Scalar>
struct CableResult {
  Scalar chi_square = 0;  // of the accepted cables
  int accepted = 0;
  int rejected = 0;
};

// `lengths`: distances of endcap centres [m], NaN for a cable without a measurement. A length whose
// squared innovation exceeds `gate` times its variance is left out (0: never), for it is the sensor
// that is wrong; unless more than `kMostOutliers` are, for then it is the state.
inline constexpr int kMostOutliers = 2;

template <typename Scalar>
CableResult<Scalar> correct_cables(SequentialUpdate<Scalar>& update, const Belief<Scalar>& belief,
                                   const CableLengths<Scalar>& lengths, Scalar std, Scalar gate) {
  using B = Belief<Scalar>;
  CableResult<Scalar> result;
  std::array<int, 9> outliers;
  int count = 0;
  const auto correct = [&](int k, Scalar limit) {
    const Cable cable = kPrismCables[std::size_t(k)];
    const Vector3<Scalar> span = belief.endcap(cable.from) - belief.endcap(cable.to);
    const Scalar length = span.norm();
    if (!(length > 0)) return;
    Row<Scalar> row;
    row.add(B::endcap_index(cable.from), span / length);
    row.add(B::endcap_index(cable.to), -span / length);
    row.add_single(B::kOffsets + k, Scalar(1));
    const Scalar chi_square =
        update.correct(row, length + belief.offsets[k] - lengths[k], std * std, limit);
    if (limit > 0 && !(chi_square <= limit)) {
      outliers[std::size_t(count++)] = k;
    } else {
      result.chi_square += chi_square;
      ++result.accepted;
    }
  };
  for (int k = 0; k < 9; ++k) {
    if (std::isfinite(lengths[k])) correct(k, gate);
  }
  if (count > kMostOutliers) {
    for (int k = 0; k < count; ++k) correct(outliers[std::size_t(k)], Scalar(0));
  } else {
    result.rejected = count;
  }
  return result;
}

// Rods 23 and 45 keep their length L, and therefore do not stretch: |q_a - q_b| = L and
// n . (w_a - w_b) = 0. The standard deviations [m], [m/s] stand for what linearisation leaves out:
// an error of direction of x metres at each end shortens the rod by 2 x^2 / L in second order.
template <typename Scalar>
void hold_rods(SequentialUpdate<Scalar>& update, const Belief<Scalar>& belief, Scalar rod_length,
               Scalar length_std, Scalar stretch_std) {
  using B = Belief<Scalar>;
  for (int a = 2; a < 6; a += 2) {
    const int b = a + 1;
    const Vector3<Scalar> span = belief.endcap(a) - belief.endcap(b);
    const Scalar length = span.norm();
    if (!(length > 0)) continue;
    const Vector3<Scalar> n = span / length;
    Row<Scalar> row;
    row.add(B::endcap_index(a), n);
    row.add(B::endcap_index(b), -n);
    update.correct(row, length - rod_length, length_std * length_std);
    const Vector3<Scalar> rate = belief.endcap_velocity(a) - belief.endcap_velocity(b);
    const Scalar stretch = n.dot(rate);
    const Vector3<Scalar> across = (rate - stretch * n) / length;
    Row<Scalar> rigid;
    rigid.add(B::endcap_velocity_index(a), n);
    rigid.add(B::endcap_velocity_index(b), -n);
    rigid.add(B::endcap_index(a), across);
    rigid.add(B::endcap_index(b), -across);
    update.correct(rigid, stretch, stretch_std * stretch_std);
  }
}

// Soft one-sided prior on the side of the fold (shape/fold.hpp): two shapes fit nine lengths, and
// the loaded robot is on the one of positive `fold` but for moments. Below `threshold` it is
// measured to be there with the standard deviation `std`.
template <typename Scalar>
void hold_fold(Belief<Scalar>& belief, const Prism<Scalar>& robot, Scalar threshold, Scalar std) {
  using B = Belief<Scalar>;
  const shape::Rods<Scalar> rods(robot, belief.endcaps_body());
  const shape::Fold<Scalar> fold(rods, robot.moment_sign());
  const Scalar value = fold.value();
  if (!(value < threshold)) return;
  const shape::Tangent<Scalar> gradient = fold.gradient();
  Row<Scalar> row;
  Vector3<Scalar> base = Vector3<Scalar>::Zero();
  for (int i = 2; i < 6; ++i) {
    // d tangent / d endcap: dc = (dq_a + dq_b)/2, L/2 du = across' (dq_a - dq_b)/2.
    const int k = shape::free_rod(i);
    const Vector3<Scalar> body =
        gradient.template segment<3>(5 * k) / 2 +
        Scalar(shape::rod_side(i)) / 2 *
            (rods.rod(k).across() * gradient.template segment<2>(5 * k + 3));
    const Vector3<Scalar> world = belief.rotation * body;
    row.add(B::endcap_index(i), world);
    base -= world;
  }
  row.add(B::kPosition, base);
  SequentialUpdate<Scalar> update(belief);
  update.correct(row, value - threshold, std * std);
}

}  // namespace tensegrity::tight
