// What SUPERball measures, as functions of many states at once.
//
// A state is [positions 3n | velocities 3n]. Measurements have stamps of their own: `ahead` seconds
// after the state's time (mostly before it: negative), nodes are taken to move on with their
// velocities between.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "tensegrity/ukf/dense.hpp"
#include "tensegrity/ukf/ranging_config.hpp"

namespace tensegrity::ukf {

template <typename Scalar>
struct RangingRow {
  enum class Kind : std::uint8_t { kRange, kInternalRange, kInclination };
  Kind kind = Kind::kRange;
  int first = 0;     // node; of an inclination the rod
  int second = 0;    // anchor; of an internal range the other node
  Scalar value = 0;  // distance [m]; of an inclination the cosine
  Scalar std = 1;
  std::int64_t t = 0;  // [ns]
  Scalar ahead = 0;    // [s]
};

template <typename Scalar>
class RangingModel {
 public:
  // For up to `states` states at once.
  RangingModel(const RangingRobot<Scalar>& robot, const RangingAnchors<Scalar>& anchors, int states)
      : robot_(robot),
        anchors_(anchors),
        partners_(robot.nodes.size(), 0),
        modules_(states, 3 * int(robot.nodes.size())) {
    for (const auto& rod : robot.rods) {
      partners_[std::size_t(rod[0])] = rod[1];
      partners_[std::size_t(rod[1])] = rod[0];
    }
  }

  const RangingRobot<Scalar>& robot() const { return robot_; }
  const RangingAnchors<Scalar>& anchors() const { return anchors_; }
  int nodes() const { return int(partners_.size()); }

  // predicted(s, r): what row r would measure in state s; states is (states x 6n).
  void operator()(const ConstMatrixRef<Scalar>& states, MatrixRef<Scalar> predicted,
                  const std::vector<RangingRow<Scalar>>& rows) {
    place_modules(states);
    for (Eigen::Index r = 0; r < predicted.cols(); ++r) {
      const RangingRow<Scalar>& row = rows[std::size_t(r)];
      switch (row.kind) {
        case RangingRow<Scalar>::Kind::kRange:
          to_anchor(states, row, predicted.col(r));
          break;
        case RangingRow<Scalar>::Kind::kInternalRange:
          to_module(states, row, predicted.col(r));
          break;
        case RangingRow<Scalar>::Kind::kInclination:
          inclination(states, row, predicted.col(r));
          break;
      }
    }
  }

  // Where the module of a node is, from the positions of all nodes (3n).
  Vector3<Scalar> module(const ConstVectorRef<Scalar>& positions, int node) const {
    const Vector3<Scalar> end = positions.template segment<3>(3 * node);
    const Vector3<Scalar> rod =
        positions.template segment<3>(3 * partners_[std::size_t(node)]) - end;
    return end + robot_.module_inset * rod.normalized();
  }

 private:
  using Column = VectorRef<Scalar>;

  // Modules at every node of every state; 0.1 m inside the rod, C §III-B.
  void place_modules(const ConstMatrixRef<Scalar>& states) {
    const Scalar inset = robot_.module_inset;
    for (int i = 0; i < nodes(); ++i) {
      const int other = partners_[std::size_t(i)];
      const Scalar *x = column(states, 3 * i), *y = column(states, 3 * i + 1),
                   *z = column(states, 3 * i + 2);
      const Scalar *ox = column(states, 3 * other), *oy = column(states, 3 * other + 1),
                   *oz = column(states, 3 * other + 2);
      Scalar *mx = &modules_(0, 3 * i), *my = &modules_(0, 3 * i + 1),
             *mz = &modules_(0, 3 * i + 2);
      for (Eigen::Index s = 0; s < states.rows(); ++s) {
        const Scalar dx = ox[s] - x[s], dy = oy[s] - y[s], dz = oz[s] - z[s];
        const Scalar part = inset / std::sqrt(dx * dx + dy * dy + dz * dz);
        mx[s] = x[s] + part * dx;
        my[s] = y[s] + part * dy;
        mz[s] = z[s] + part * dz;
      }
    }
  }

  void to_anchor(const ConstMatrixRef<Scalar>& states, const RangingRow<Scalar>& row,
                 Column out) const {
    const Vector3<Scalar>& anchor = anchors_.positions[std::size_t(row.second)];
    out.setZero();
    for (int k = 0; k < 3; ++k) {
      const int c = 3 * row.first + k;
      const Scalar *m = &modules_(0, c), *v = column(states, 3 * nodes() + c);
      for (Eigen::Index s = 0; s < states.rows(); ++s) {
        const Scalar d = m[s] + row.ahead * v[s] - anchor[k];
        out[s] += d * d;
      }
    }
    for (Eigen::Index s = 0; s < states.rows(); ++s) out[s] = std::sqrt(out[s]);
  }

  void to_module(const ConstMatrixRef<Scalar>& states, const RangingRow<Scalar>& row,
                 Column out) const {
    out.setZero();
    for (int k = 0; k < 3; ++k) {
      const int a = 3 * row.first + k, b = 3 * row.second + k;
      const Scalar *ma = &modules_(0, a), *mb = &modules_(0, b);
      const Scalar *va = column(states, 3 * nodes() + a), *vb = column(states, 3 * nodes() + b);
      for (Eigen::Index s = 0; s < states.rows(); ++s) {
        const Scalar d = ma[s] - mb[s] + row.ahead * (va[s] - vb[s]);
        out[s] += d * d;
      }
    }
    for (Eigen::Index s = 0; s < states.rows(); ++s) out[s] = std::sqrt(out[s]);
  }

  // Cosine of the angle between the vertical and the rod, toward its first end.
  void inclination(const ConstMatrixRef<Scalar>& states, const RangingRow<Scalar>& row,
                   Column out) const {
    const auto& rod = robot_.rods[std::size_t(row.first)];
    out.setZero();
    for (int k = 0; k < 3; ++k) {
      const int a = 3 * rod[0] + k, b = 3 * rod[1] + k, v = 3 * nodes();
      const Scalar *xa = column(states, a), *xb = column(states, b), *va = column(states, v + a),
                   *vb = column(states, v + b);
      for (Eigen::Index s = 0; s < states.rows(); ++s) {
        const Scalar d = xa[s] - xb[s] + row.ahead * (va[s] - vb[s]);
        out[s] += d * d;
        if (k == 2) out[s] = d / std::sqrt(out[s]);
      }
    }
  }

  static const Scalar* column(const ConstMatrixRef<Scalar>& states, int c) {
    return states.data() + c * states.outerStride();
  }

  RangingRobot<Scalar> robot_;
  RangingAnchors<Scalar> anchors_;
  std::vector<int> partners_;
  MatrixX<Scalar> modules_;  // (states x 3n)
};

}  // namespace tensegrity::ukf
