// Many simulations of one net at once: the prediction of an unscented filter's sigma points.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "tensegrity/dynamics/ground.hpp"
#include "tensegrity/dynamics/lanes.hpp"
#include "tensegrity/dynamics/member_forces.hpp"
#include "tensegrity/dynamics/net.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity::dynamics {

enum class Integrator {
  kRungeKutta4,        // classical, four evaluations of the forces per step
  kSemiImplicitEuler,  // velocities, then positions with the new velocities; one evaluation
};

// Steps simulations of a net (C §IV-A) that differ in their states and share the rest lengths.
//
// A state is [positions 3n | velocities 3n] [m, m/s], coordinate k of node i at 3 i + k. States are
// the rows of a column-major matrix: one coordinate of all simulations is contiguous, and a SIMD
// register holds one coordinate of as many simulations as it has lanes. Such a group runs through
// all steps before the next is touched, so that its memory stays in the first-level cache. A
// simulation's result does not depend on the others.
//
// All memory is allocated by the constructor. A simulation that does not stay finite is left as it
// was before the call.
template <typename Scalar>
class Simulator {
 public:
  using States = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

  // `net` has to be valid(); of one that is not, every step returns kNotInitialized.
  explicit Simulator(const Net<Scalar>& net)
      : net_(valid(net) ? net : Net<Scalar>{}),
        coordinates_(3 * Eigen::Index(net_.nodes)),
        state_(kCount, kParts * coordinates_),
        anchors_(kCount, 2 * Eigen::Index(net_.nodes)) {
    for (const Member<Scalar>& rod : net_.rods) rods_.push_back(constants(rod));
    for (const Member<Scalar>& cable : net_.cables) cables_.push_back(constants(cable));
  }

  // Moves every simulation by `steps` steps of `dt` [s] with the cables' `rest_lengths` [m].
  // `states` is simulations x 6n. Friction remembers for this call alone: nodes start standing
  // where they are, see ground.hpp.
  Status step(Eigen::Ref<States> states, const Eigen::Ref<const Vector>& rest_lengths, Scalar dt,
              int steps, Integrator integrator = Integrator::kRungeKutta4) {
    return run(states, nullptr, rest_lengths, dt, steps, integrator);
  }

  // The same, with the points where nodes stand as part of the state: `anchors`, simulations x 2n,
  // coordinate k of node i at 2 i + k [m]. For simulations that go on from call to call; they start
  // as the nodes' horizontal positions.
  Status step(Eigen::Ref<States> states, Eigen::Ref<States> anchors,
              const Eigen::Ref<const Vector>& rest_lengths, Scalar dt, int steps,
              Integrator integrator = Integrator::kRungeKutta4) {
    return run(states, &anchors, rest_lengths, dt, steps, integrator);
  }

  // Simulations that the last step left as they were.
  int failures() const { return failures_; }

  const Net<Scalar>& net() const { return net_; }

 private:
  using L = Lanes<Scalar>;
  using Lane = typename L::Vector;
  static constexpr Eigen::Index kCount = L::kCount;

  // Parts of `state_`, 3n columns each.
  enum Part { kX, kV, kXStage, kVStage, kXLast, kForce, kSum, kWeighted, kParts };

  static MemberConstants<Scalar> constants(const Member<Scalar>& m) {
    return {3 * Eigen::Index(m.from), 3 * Eigen::Index(m.to), m.stiffness, m.damping,
            m.stiffness * m.rest_length};
  }

  Lane* part(Part which) { return L::data(state_) + which * coordinates_; }

  Status run(Eigen::Ref<States> states, Eigen::Ref<States>* anchors,
             const Eigen::Ref<const Vector>& rest_lengths, Scalar dt, int steps,
             Integrator integrator) {
    failures_ = 0;
    if (net_.nodes == 0) return Status::kNotInitialized;
    if (!rest_lengths.allFinite() || !std::isfinite(dt)) return Status::kNotFinite;
    if (states.cols() != 2 * coordinates_ || rest_lengths.size() != Eigen::Index(cables_.size()) ||
        (rest_lengths.array() < 0).any() || dt <= 0 || steps < 0 ||
        (anchors != nullptr &&
         (anchors->rows() != states.rows() || anchors->cols() != anchors_.cols()))) {
      return Status::kOutOfRange;
    }
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      cables_[k].rest_tension = cables_[k].stiffness * rest_lengths[Eigen::Index(k)];
    }
    for (Eigen::Index row = 0; row < states.rows(); row += kCount) {
      const Eigen::Index count = std::min(kCount, states.rows() - row);
      load(states, row, count, state_);
      if (anchors != nullptr) {
        load(*anchors, row, count, anchors_);
      } else {
        stand_where_they_are();
      }
      for (int k = 0; k < steps; ++k) {
        if (integrator == Integrator::kRungeKutta4) {
          runge_kutta_4(dt);
        } else {
          semi_implicit_euler(dt);
        }
      }
      const Lane error = not_finite();
      for (Eigen::Index lane = 0; lane < count; ++lane) {
        if (error[lane] == 0) continue;
        ++failures_;
        state_.row(lane).leftCols(2 * coordinates_) = states.row(row + lane).array();
        if (anchors != nullptr) anchors_.row(lane) = anchors->row(row + lane).array();
      }
      store(state_, row, count, states);
      if (anchors != nullptr) store(anchors_, row, count, *anchors);
    }
    return failures_ == 0 ? Status::kOk : Status::kNotFinite;
  }

  // Columns of `source` into those of `buffer`; spare lanes repeat the last simulation.
  static void load(const Eigen::Ref<States>& source, Eigen::Index row, Eigen::Index count,
                   typename L::Buffer& buffer) {
    for (Eigen::Index c = 0; c < source.cols(); ++c) {
      const Scalar* from = &source.coeffRef(row, c);
      for (Eigen::Index lane = 0; lane < kCount; ++lane) {
        buffer(lane, c) = from[std::min(lane, count - 1)];
      }
    }
  }

  static void store(const typename L::Buffer& buffer, Eigen::Index row, Eigen::Index count,
                    Eigen::Ref<States>& target) {
    for (Eigen::Index c = 0; c < target.cols(); ++c) {
      for (Eigen::Index lane = 0; lane < count; ++lane) target(row + lane, c) = buffer(lane, c);
    }
  }

  void stand_where_they_are() {
    for (Eigen::Index node = 0; node < net_.nodes; ++node) {
      anchors_.col(2 * node) = state_.col(3 * node);
      anchors_.col(2 * node + 1) = state_.col(3 * node + 1);
    }
  }

  // Zero in the lanes whose state is finite, else NaN.
  Lane not_finite() {
    const Lane* state = part(kX);
    Lane sum{};
    for (Eigen::Index c = 0; c < 2 * coordinates_; ++c) sum += state[c] - state[c];
    return sum;
  }

  // Accelerations at `position` and `velocity`: `use(c, acceleration)` for every coordinate c, in
  // order. It may overwrite coordinate c of both.
  template <Anchors anchors, typename Use>
  void accelerations(const Lane* position, const Lane* velocity, const Use& use) {
    Lane* const force = part(kForce);
    for (Eigen::Index c = 0; c < coordinates_; ++c) force[c] = Lane{};
    for (const auto& rod : rods_) {
      add_member_force<Scalar, Pushes::kYes>(rod, position, velocity, force);
    }
    for (const auto& cable : cables_) {
      add_member_force<Scalar, Pushes::kNo>(cable, position, velocity, force);
    }
    Lane* const anchor = L::data(anchors_);
    const Scalar inverse_mass = 1 / net_.node_mass;
    for (Eigen::Index node = 0; node < net_.nodes; ++node) {
      const Eigen::Index c = 3 * node;
      add_ground_force<Scalar, anchors>(net_.ground, position + c, velocity + c, anchor + 2 * node,
                                        force + c);
      for (Eigen::Index k = 0; k < 3; ++k) {
        use(c + k, Lane(force[c + k] * inverse_mass + net_.gravity[k]));
      }
    }
  }

  // With x'' = a(x, x'), the stages of the classical method are
  //   x2 = x + h/2 v            v2 = v + h/2 a1
  //   x3 = x2 + h^2/4 a1        v3 = v + h/2 a2
  //   x4 = x + h v + h^2/2 a2   v4 = v + h a3
  // and the step is x += h v + h^2/6 (a1 + a2 + a3), v += h/6 (a1 + 2 a2 + 2 a3 + a4).
  void runge_kutta_4(Scalar h) {
    Lane *const x = part(kX), *const v = part(kV), *const xs = part(kXStage),
                *const vs = part(kVStage), *const x4 = part(kXLast), *const sum = part(kSum),
                *const weighted = part(kWeighted);
    const Scalar half = h / 2, quarter_square = h * h / 4, half_square = h * h / 2;
    const Scalar sixth = h / 6, sixth_square = h * h / 6;
    accelerations<Anchors::kFollow>(x, v, [=](Eigen::Index c, const Lane& a1) {
      sum[c] = a1;
      weighted[c] = a1;
      xs[c] = x[c] + half * v[c];
      vs[c] = v[c] + half * a1;
    });
    accelerations<Anchors::kStay>(xs, vs, [=](Eigen::Index c, const Lane& a2) {
      xs[c] += quarter_square * sum[c];
      vs[c] = v[c] + half * a2;
      x4[c] = x[c] + h * v[c] + half_square * a2;
      sum[c] += a2;
      weighted[c] += 2 * a2;
    });
    accelerations<Anchors::kStay>(xs, vs, [=](Eigen::Index c, const Lane& a3) {
      vs[c] = v[c] + h * a3;
      sum[c] += a3;
      weighted[c] += 2 * a3;
    });
    accelerations<Anchors::kStay>(x4, vs, [=](Eigen::Index c, const Lane& a4) {
      x[c] += h * v[c] + sixth_square * sum[c];
      v[c] += sixth * (weighted[c] + a4);
    });
  }

  void semi_implicit_euler(Scalar h) {
    Lane *const x = part(kX), *const v = part(kV);
    accelerations<Anchors::kFollow>(x, v, [=](Eigen::Index c, const Lane& a) {
      v[c] += h * a;
      x[c] += h * v[c];
    });
  }

  Net<Scalar> net_;
  Eigen::Index coordinates_;
  std::vector<MemberConstants<Scalar>> rods_, cables_;
  typename L::Buffer state_;    // its parts are those of enum Part
  typename L::Buffer anchors_;  // 2n columns
  int failures_ = 0;
};

}  // namespace tensegrity::dynamics
