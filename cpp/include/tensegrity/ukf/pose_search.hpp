// Where a robot of known, rigid shape is, from ranges alone or with inclinations: the start of
// RangingEstimator.
//
// The cost of a pose has many minima: a net of six rods has twenty faces to stand on, and ranges to
// a few anchors in one plane hardly tell up from down. So the search begins at many orientations,
// spread evenly over all rotations, goes down from each by Levenberg-Marquardt and keeps the best.
// Residuals are in standard deviations under the loss 2 (sqrt(1 + r^2) - 1), quadratic for small
// ones and linear for wrong ranges.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tensegrity/math/ldlt.hpp"
#include "tensegrity/math/so3.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity::ukf {

// Distance of a point of the robot to a point of the world.
template <typename Scalar>
struct PointDistance {
  int point = 0;                                     // index of the robot's point
  Vector3<Scalar> anchor = Vector3<Scalar>::Zero();  // world [m]
  Scalar distance = 0;                               // [m]
  Scalar std = 1;                                    // [m]
};

// Cosine of the angle between an axis of the robot and the vertical.
template <typename Scalar>
struct AxisInclination {
  int axis = 0;
  Scalar cosine = 0;
  Scalar std = 1;
};

template <typename Scalar>
struct RigidPose {
  Matrix3<Scalar> rotation = Matrix3<Scalar>::Identity();  // robot to world
  Vector3<Scalar> position = Vector3<Scalar>::Zero();      // world [m]
  Scalar cost = std::numeric_limits<Scalar>::infinity();   // sum of the losses
};

template <typename Scalar>
struct PoseSearchSettings {
  int orientations = 96;
  int iterations = 25;            // of Levenberg-Marquardt, for each of them
  Scalar ground_std = Scalar(0);  // height of the three lowest nodes [m]; 0: no ground at z = 0
};

template <typename Scalar>
class PoseSearch {
 public:
  using V3 = Vector3<Scalar>;
  using M3 = Matrix3<Scalar>;

  // `nodes`: what stands on the ground; `points`: what is ranged; `axes`: unit vectors. All in the
  // robot's frame [m].
  PoseSearch(std::vector<V3> nodes, std::vector<V3> points, std::vector<V3> axes,
             const PoseSearchSettings<Scalar>& settings = {})
      : nodes_(std::move(nodes)),
        points_(std::move(points)),
        axes_(std::move(axes)),
        settings_(settings) {}

  // The best pose; its cost is infinite when there are no distances.
  RigidPose<Scalar> best(const std::vector<PointDistance<Scalar>>& distances,
                         const std::vector<AxisInclination<Scalar>>& inclinations) const {
    RigidPose<Scalar> result;
    if (distances.empty()) return result;
    const V3 centre = locate(distances);
    for (int k = 0; k < settings_.orientations; ++k) {
      RigidPose<Scalar> pose;
      pose.rotation = orientation(k, settings_.orientations);
      pose.position = centre;
      descend(pose, distances, inclinations);
      if (pose.cost < result.cost) result = pose;
    }
    return result;
  }

  // Cost of any positions of the robot's points, with what `best` would pay for the ground left
  // out.
  template <typename Points>
  static Scalar cost(const Points& points, const std::vector<PointDistance<Scalar>>& distances) {
    Scalar sum = 0;
    for (const auto& d : distances) {
      sum += loss(((points(d.point) - d.anchor).norm() - d.distance) / d.std);
    }
    return sum;
  }

 private:
  using V6 = Vector<Scalar, 6>;
  using M6 = Matrix<Scalar, 6>;

  static Scalar loss(Scalar r) { return 2 * (std::sqrt(1 + r * r) - 1); }

  // Super-Fibonacci spirals (Alexa 2022): evenly spread rotations.
  static M3 orientation(int k, int count) {
    const double phi = 1.4142135623730951, psi = 1.533751168755204288118041;
    const double s = k + 0.5, r = std::sqrt(s / count), big = std::sqrt(1 - s / count);
    const double a = 2 * 3.14159265358979323846 * s / phi, b = 2 * 3.14159265358979323846 * s / psi;
    return Eigen::Quaternion<Scalar>(Scalar(big * std::cos(b)), Scalar(r * std::sin(a)),
                                     Scalar(r * std::cos(a)), Scalar(big * std::sin(b)))
        .toRotationMatrix();
  }

  // Where the robot would be if it were one point.
  V3 locate(const std::vector<PointDistance<Scalar>>& distances) const {
    V3 centre = V3::Zero();
    Scalar size = 0;
    for (const auto& d : distances) centre += d.anchor / Scalar(distances.size());
    for (const V3& node : nodes_) size = std::max(size, node.norm());
    if (settings_.ground_std > 0) centre.z() = size;
    for (int k = 0; k < settings_.iterations; ++k) {
      M3 hessian = M3::Identity() * Scalar(1e-3);
      V3 gradient = V3::Zero();
      for (const auto& d : distances) {
        const V3 line = centre - d.anchor;
        const Scalar length = std::max(line.norm(), Scalar(1e-3));
        const V3 slope = line / length;
        const Scalar r = (length - d.distance) / size, w = 1 / std::sqrt(1 + r * r);
        hessian += w * slope * slope.transpose();
        gradient += w * r * slope;
      }
      const V3 step = hessian.ldlt().solve(gradient) * size;
      if (!step.allFinite()) break;
      centre -= step;
      if (settings_.ground_std > 0) centre.z() = std::max(centre.z(), size / 2);
    }
    return centre;
  }

  void descend(RigidPose<Scalar>& pose, const std::vector<PointDistance<Scalar>>& distances,
               const std::vector<AxisInclination<Scalar>>& inclinations) const {
    M6 hessian;
    V6 gradient;
    pose.cost = linearise(pose, distances, inclinations, hessian, gradient);
    Scalar damping = Scalar(1e-2);
    for (int k = 0; k < settings_.iterations; ++k) {
      M6 damped = hessian;
      damped.diagonal() *= 1 + damping;
      damped.diagonal().array() += Scalar(1e-6);
      Ldlt<Scalar, 6> system;
      system.matrix() = damped;
      system.set_right(gradient);
      if (!system.factor()) return;
      const V6 step = system.solve();
      RigidPose<Scalar> next;
      next.rotation = SO3<Scalar>::Exp(-step.template head<3>()).matrix() * pose.rotation;
      next.position = pose.position - step.template tail<3>();
      M6 next_hessian;
      V6 next_gradient;
      next.cost = linearise(next, distances, inclinations, next_hessian, next_gradient);
      if (next.cost < pose.cost) {
        const bool done = pose.cost - next.cost < Scalar(1e-4) * pose.cost;
        pose = next;
        hessian = next_hessian;
        gradient = next_gradient;
        damping = std::max(damping / 5, Scalar(1e-6));
        if (done) return;
      } else {
        damping *= 5;
        if (damping > Scalar(1e4)) return;
      }
    }
  }

  // Cost, gradient and Gauss-Newton matrix by rotation (about world axes, at the robot's origin)
  // and translation.
  Scalar linearise(const RigidPose<Scalar>& pose,
                   const std::vector<PointDistance<Scalar>>& distances,
                   const std::vector<AxisInclination<Scalar>>& inclinations, M6& hessian,
                   V6& gradient) const {
    Scalar cost = 0;
    hessian.setZero();
    gradient.setZero();
    const auto add = [&](Scalar r, const V6& slope) {
      const Scalar weight = 1 / std::sqrt(1 + r * r);
      cost += loss(r);
      gradient += (weight * r) * slope;
      hessian += weight * slope * slope.transpose();
    };
    V6 slope;
    for (const auto& d : distances) {
      const V3 arm = pose.rotation * points_[std::size_t(d.point)];
      const V3 line = arm + pose.position - d.anchor;
      const Scalar length = std::max(line.norm(), Scalar(1e-6));
      const V3 direction = line / (length * d.std);
      slope << arm.cross(direction), direction;
      add((length - d.distance) / d.std, slope);
    }
    for (const auto& i : inclinations) {
      const V3 axis = pose.rotation * axes_[std::size_t(i.axis)];
      slope << V3(axis.y(), -axis.x(), 0) / i.std, V3::Zero();
      add((axis.z() - i.cosine) / i.std, slope);
    }
    if (settings_.ground_std > 0) add_ground(pose, add);
    return cost;
  }

  template <typename Add>
  void add_ground(const RigidPose<Scalar>& pose, const Add& add) const {
    constexpr int kFeet = 3;
    int lowest[kFeet];
    Scalar height[kFeet];
    int count = 0;
    for (int i = 0; i < int(nodes_.size()); ++i) {
      const Scalar z = pose.rotation.row(2).dot(nodes_[std::size_t(i)]);
      int place = count < kFeet ? count++ : (z < height[kFeet - 1] ? kFeet - 1 : -1);
      if (place < 0) continue;
      for (; place > 0 && z < height[place - 1]; --place) {
        height[place] = height[place - 1];
        lowest[place] = lowest[place - 1];
      }
      height[place] = z;
      lowest[place] = i;
    }
    V6 slope;
    for (int k = 0; k < count; ++k) {
      const V3 arm = pose.rotation * nodes_[std::size_t(lowest[k])];
      slope << V3(arm.y(), -arm.x(), 0), V3::UnitZ();
      add((arm.z() + pose.position.z()) / settings_.ground_std, slope / settings_.ground_std);
    }
  }

  std::vector<V3> nodes_, points_, axes_;
  PoseSearchSettings<Scalar> settings_;
};

}  // namespace tensegrity::ukf
