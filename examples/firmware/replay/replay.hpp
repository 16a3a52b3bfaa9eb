// Replays a recording through the estimator, in the order in which a robot's drivers would call it,
// and prints the state. The same code runs on boards and on the host.
//
// What is printed, one line each, frames as in PrismState:
//   state METHOD t px py pz vx vy vz qx qy qz qw   every second and at the end [ms], [m], [m/s]
//   start METHOD instructions                      the IMU cycle in which the estimator starts
//   cycle METHOD instructions                      every IMU cycle after it
//   estimator METHOD bytes                         size of the object, which is on the stack
//   stack METHOD bytes                             deepest stack
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "platform/platform.hpp"
#include "replay/line.hpp"
#include "replay/recording.hpp"
#include "tensegrity/estimator/prism_estimator.hpp"

namespace replay {

// The IMU sample between what came before it and what came with it, as `estimate` of Python calls.
template <typename Estimator>
void imu_cycle(Estimator& estimator, const ImuRow& imu, const ContactRow*& contacts,
               const CableRow*& cables, const Recording& recording) {
  using Scalar = typename Estimator::V3::Scalar;
  const auto feed_before = [&](tensegrity::Nanoseconds end) {
    for (; contacts != recording.contacts.end() && contacts->t < end; ++contacts) {
      std::array<bool, 6> flags;
      for (std::size_t i = 0; i < flags.size(); ++i) flags[i] = contacts->flags[i] != 0;
      estimator.contacts(contacts->t, flags);
    }
    for (; cables != recording.cables.end() && cables->t < end; ++cables) {
      using Lengths = Eigen::Map<const tensegrity::CableLengths<float>>;
      estimator.cables(cables->t, Lengths(cables->lengths).template cast<Scalar>());
    }
  };
  using Vector = Eigen::Map<const tensegrity::Vector3<float>>;
  feed_before(imu.t);
  estimator.imu(imu.t, Vector(imu.gyro).template cast<Scalar>(),
                Vector(imu.accel).template cast<Scalar>());
  feed_before(imu.t + 1);
}

template <typename Scalar>
void print_state(const char* method, const tensegrity::PrismState<Scalar>& state) {
  Line line("state ");
  line.add(method).space().add(std::uint32_t(state.t / 1000000));
  for (const Scalar p : state.position) line.space().add_decimal(p);
  for (const Scalar v : state.velocity) line.space().add_decimal(v);
  for (const Scalar q : Eigen::Quaternion<Scalar>(state.rotation).coeffs()) {
    line.space().add_decimal(q);
  }
  platform::print(line.end());
}

inline void print_count(const char* what, const char* method, std::uint32_t count) {
  platform::print(Line(what).space().add(method).space().add(count).end());
}

template <typename Filter>
[[gnu::noinline]] void run(const char* method, const Recording& recording) {
  using Scalar = typename Filter::Scalar;
  constexpr tensegrity::Nanoseconds kSecond = 1000000000;
  tensegrity::PrismConfig<Scalar> config;
  config.max_shape_iterations =
      8;  // the worst cycle has to end in time; the next goes on from here
  tensegrity::PrismEstimator<Scalar, Filter> estimator({}, config);
  const ContactRow* contacts = recording.contacts.begin();
  const CableRow* cables = recording.cables.begin();
  for (const ImuRow& imu : recording.imu) {
    const bool started = estimator.initialized();
    const std::uint32_t begin = platform::now();
    imu_cycle(estimator, imu, contacts, cables, recording);
    const std::uint32_t cost = platform::instructions(begin, platform::now());
    if (!estimator.initialized()) continue;
    if (cost > 0) print_count(started ? "cycle" : "start", method, cost);
    const bool last = &imu + 1 == recording.imu.end();
    if (imu.t % kSecond == 0 || last) print_state(method, estimator.state());
  }
  print_count("estimator", method, sizeof estimator);
}

// The method with its stack measured.
template <typename Filter>
void replay(const char* method, const Recording& recording) {
  platform::paint_stack();
  run<Filter>(method, recording);
  print_count("stack", method, platform::stack_used());
}

}  // namespace replay
