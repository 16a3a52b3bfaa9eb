// The loosely coupled filter: one IMU sample, with contact points that stand still (T) and with
// ones that roll, and one correction, by the number of contacts.
//
// Every 256th call starts again from the same settled state, so that nothing drifts away; the copy
// adds about a nanosecond to the mean of a call.
#include "runner.hpp"
#include "tensegrity/estimator/config.hpp"
#include "tensegrity/inekf/anchors.hpp"
#include "tensegrity/inekf/contact_kinematics.hpp"
#include "tensegrity/inekf/propagate.hpp"
#include "tensegrity/robot/prism.hpp"

namespace {

using namespace tensegrity;
using benchmarks::Program;

constexpr int kRestart = 256;

// A robot at rest with `contacts` endcaps on the ground; biases and spin are estimated.
template <typename Scalar>
struct Rig {
  using Belief = inekf::Belief<Scalar, 1, 6>;
  using V3 = Vector3<Scalar>;

  Belief belief, settled;
  inekf::Kinematics<Scalar, 6, 1> kinematics;
  inekf::ImuSample<Scalar> imu;
  PrismConfig<Scalar> config;
  inekf::Rolling<Scalar> rolling;
  int calls = 0;

  Rig(int contacts, ContactPoint point) {
    const Prism<Scalar> robot;
    if (point == ContactPoint::kRolling) rolling.radius = robot.endcap_radius;
    kinematics.h = robot.undeformed();
    for (int i = 0; i < 6; ++i) {
      kinematics.h_extra.template middleRows<3>(3 * i) = V3::UnitZ().cross(kinematics.h.col(i));
    }
    kinematics.variance = config.contact_position_std * config.contact_position_std;
    belief.rotation = SO3<Scalar>::Exp(V3(Scalar(0.9), Scalar(-0.4), Scalar(0.3))).matrix();
    belief.position = V3(Scalar(0.3), Scalar(-0.2), Scalar(0.5));
    auto variance = belief.covariance.diagonal();
    variance.template head<Belief::kAnchors>().setConstant(Scalar(1e-4));
    constexpr std::array<int, 6> kOrder = {1, 3, 5, 0, 2, 4};
    for (int i = 0; i < contacts; ++i) {
      const int id = kOrder[std::size_t(i)];
      inekf::augment(belief, id, V3(kinematics.h.col(id)),
                     Matrix<Scalar, 3, 1>(kinematics.h_extra.template middleRows<3>(3 * id)),
                     kinematics.covariance(id, id));
    }
    imu.gyro.setZero();
    imu.accel = belief.rotation.transpose() * V3(0, 0, config.gravity);
    for (int k = 0; k < 400; ++k) {
      propagate();
      correct();
    }
    settled = belief;
  }

  void propagate() {
    inekf::propagate(belief, imu, Scalar(0.005), config.gravity,
                     {config.gyroscope_std, config.accelerometer_std, config.gyroscope_bias_walk,
                      config.accelerometer_bias_walk, config.contact_std},
                     rolling, Vector<Scalar, 1>(config.spin_walk));
  }
  void correct() { inekf::correct_contacts(belief, kinematics, Scalar(0)); }

  void restart() {
    if (++calls % kRestart == 0) belief = settled;
  }
};

template <typename Scalar>
void add_cases(Program& program, const std::string& scalar) {
  const auto add = [&](const std::string& name, int contacts, ContactPoint point,
                       void (Rig<Scalar>::*step)()) {
    program.add("filter/" + name + "/" + std::to_string(contacts) + "/" + scalar, [=] {
      return [rig = Rig<Scalar>(contacts, point), step]() mutable {
        rig.restart();
        (rig.*step)();
      };
    });
  };
  for (int contacts = 0; contacts <= 6; ++contacts) {
    add("propagate", contacts, ContactPoint::kCentre, &Rig<Scalar>::propagate);
    if (contacts == 0) continue;
    add("roll", contacts, ContactPoint::kRolling, &Rig<Scalar>::propagate);
    add("correct", contacts, ContactPoint::kCentre, &Rig<Scalar>::correct);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Program program(argc, argv);
  add_cases<double>(program, "double");
  add_cases<float>(program, "float");
  return program.run();
}
