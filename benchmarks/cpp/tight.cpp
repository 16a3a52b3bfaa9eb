// The tightly coupled filter: one IMU sample, nine cables, three feet.
//
// Every 256th call starts again from the same settled state, so that nothing drifts away; the copy
// of its 22 kB adds a few nanoseconds to the mean of a call.
#include "runner.hpp"
#include "tensegrity/contact/load_share.hpp"
#include "tensegrity/estimator/config.hpp"
#include "tensegrity/shape/cables.hpp"
#include "tensegrity/tight/friction.hpp"
#include "tensegrity/tight/members.hpp"
#include "tensegrity/tight/place.hpp"
#include "tensegrity/tight/propagate.hpp"

namespace {

using namespace tensegrity;
using benchmarks::Program;

constexpr int kRestart = 256;

// A robot that stands still on endcaps 1, 3 and 5.
template <typename Scalar>
struct Rig {
  using Belief = tight::Belief<Scalar>;
  using V3 = Vector3<Scalar>;

  Prism<Scalar> robot;
  PrismConfig<Scalar> config;
  Belief belief, settled;
  inekf::ImuSample<Scalar> imu;
  CableLengths<Scalar> lengths;
  std::array<Scalar, 6> shares;
  Scalar dt = Scalar(0.005);  // [s]
  int calls = 0;

  Rig() : belief(robot), settled(robot) {
    const Endcaps<Scalar> h = robot.undeformed();
    const V3 down = (h.col(3) - h.col(1)).cross(h.col(5) - h.col(1)).normalized();
    const V3 outward = down.dot(h.col(1)) > 0 ? down : V3(-down);
    belief.rotation = shortest_rotation<Scalar>(outward, -V3::UnitZ());
    belief.columns(2, 1) = robot.endcap_radius - (belief.rotation * h).row(2).minCoeff();
    auto variance = belief.covariance.diagonal();
    variance.template head<Belief::kEndcaps>().setConstant(Scalar(1e-4));
    variance.template segment<3>(Belief::kGyroBias).setConstant(Scalar(1e-6));
    variance.template segment<3>(Belief::kAccelBias).setConstant(Scalar(1e-3));
    variance.template segment<9>(Belief::kOffsets)
        .setConstant(config.cable_offset_std * config.cable_offset_std);
    tight::place_endcaps(belief, h, Scalar(0.02), Scalar(0.1), config.velocity_std);
    imu.gyro.setZero();
    imu.accel = belief.rotation.transpose() * V3(0, 0, config.gravity);
    lengths = shape::cable_lengths(h);
    shares =
        contact::support_shares(belief.endcaps_world(), {false, true, false, true, false, true});
    for (int k = 0; k < 400; ++k) {
      propagate();
      correct_cables();
      hold_rods();
      correct_feet();
    }
    settled = belief;
  }

  void propagate() {
    const tight::ProcessNoise<Scalar> noise{config.gyroscope_std,
                                            config.accelerometer_std,
                                            config.gyroscope_bias_walk,
                                            config.accelerometer_bias_walk,
                                            config.endcap_acceleration_moving,
                                            Scalar(0),
                                            Scalar(0)};
    tight::propagate(belief, imu, dt, config.gravity, noise);
  }
  void correct_cables() {
    tight::SequentialUpdate<Scalar> update(belief);
    tight::correct_cables(update, belief, lengths, config.cable_std,
                          config.cable_gate * config.cable_gate);
  }
  void hold_rods() {
    tight::SequentialUpdate<Scalar> update(belief);
    tight::hold_rods(update, belief, robot.rod_length, Scalar(0.0005), Scalar(0.002));
  }
  void correct_feet() {
    const tight::FootNoise<Scalar> noise{config.creep_std,       config.slip_length,
                                         config.slip_speed,      config.foot_rise_std,
                                         config.foot_height_std, config.friction};
    const std::array<tight::Foot<Scalar>, 3> feet{{{1, shares[1]}, {3, shares[3]}, {5, shares[5]}}};
    tight::correct_feet(belief, feet.data(), 3, robot, noise, dt);
  }

  void restart() {
    if (++calls % kRestart == 0) belief = settled;
  }
};

template <typename Scalar>
void add_cases(Program& program, const std::string& scalar) {
  const auto add = [&](const std::string& name, void (Rig<Scalar>::*part)()) {
    program.add("tight/" + name + "/" + scalar, [part] {
      return [rig = Rig<Scalar>(), part]() mutable {
        rig.restart();
        (rig.*part)();
      };
    });
  };
  add("propagate", &Rig<Scalar>::propagate);
  add("cables", &Rig<Scalar>::correct_cables);
  add("rods", &Rig<Scalar>::hold_rods);
  add("feet", &Rig<Scalar>::correct_feet);
}

}  // namespace

int main(int argc, char** argv) {
  Program program(argc, argv);
  add_cases<double>(program, "double");
  add_cases<float>(program, "float");
  return program.run();
}
