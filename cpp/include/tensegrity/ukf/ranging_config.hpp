// What RangingEstimator is told about the robot, its anchors and their noise.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tensegrity/types.hpp"
#include "tensegrity/ukf/unscented_filter.hpp"

namespace tensegrity::ukf {

// The geometry that measurements need. Nodes are the ends of the rods; every node ends one rod.
template <typename Scalar>
struct RangingRobot {
  std::vector<Vector3<Scalar>> nodes;    // of the undeformed robot, any frame [m]
  std::vector<std::array<int, 2>> rods;  // indices of the nodes at their ends
  Scalar rod_length = Scalar(1.7);       // [m]
  Scalar module_inset = Scalar(0.1);     // of a ranging module from its node along the rod [m]
};

// The fixed modules and what a calibration knows of the offsets: range = distance + offset.
template <typename Scalar>
struct RangingAnchors {
  std::vector<Vector3<Scalar>> positions;  // world [m]
  MatrixX<Scalar> offsets;                 // (nodes, anchors) [m]
  MatrixX<Scalar> offset_std;              // (nodes, anchors): how well an offset is known [m]
  MatrixX<Scalar> internal_offsets;        // (nodes, nodes) [m]
};

enum class ProcessNoise : std::uint8_t {
  kState,         // the same independent noise on every position and velocity (C §IV-B)
  kAcceleration,  // white accelerations of the body and of its nodes
};

template <typename Scalar>
struct RangingConfig {
  UnscentedSettings<Scalar> filter;
  // Standard deviations that sigma points lie from the mean, in place of filter.alpha; 0: alpha as
  // it is. A net has kinks: cables go slack, nodes touch the ground. The second differences that
  // points a tenth of a standard deviation away take of them (alpha = 0.0139) are multiplied by
  // 1 / alpha^2 and blow the filter up; sqrt(3) is exact for Gaussian fourth moments.
  Scalar spread = Scalar(1.7320508);
  Scalar period = Scalar(0.1);           // between updates [s]
  Scalar dynamics_step = Scalar(0.005);  // longest step of the dynamics [s]
  Scalar max_latency = Scalar(0.02);     // an update waits so long for late measurements [s]

  // noises: standard deviations
  Scalar range_std = Scalar(0.1);           // to an anchor [m]
  Scalar internal_range_std = Scalar(0.1);  // between modules of the robot [m]
  Scalar inclination_std = Scalar(0.1);     // angle of a rod to the vertical [rad]
  ProcessNoise process_noise = ProcessNoise::kAcceleration;
  Scalar state_std = Scalar(0.4);  // kState, per update [m] and [m/s]
  // kAcceleration: of the robot as one body, and of every node on its own [m/s/sqrt(s)]. What the
  // dynamics leave out of a robot that rolls: with these the errors of seeds 100 and 101 of the
  // simulation are as large as their covariance says (benchmarks/ranging_noise.py).
  Scalar body_acceleration = Scalar(0.5);
  Scalar node_acceleration = Scalar(0.5);
  bool hold_rods = true;  // corrections turn and move rods, never stretch them

  // innovations beyond so many standard deviations are left out; 0: none
  Scalar gate = Scalar(3.5);

  // An IMU's rate beyond this is a wrong sample: the ends of a rod of 1.7 m would move at 17 m/s,
  // as after a fall from 15 m [rad/s].
  Scalar largest_rate = Scalar(20);

  // start, and restart of a lost filter
  Scalar start_window = Scalar(1);        // seconds of ranges that a pose is found from
  int start_pairs = 12;                   // different pairs of modules it needs
  Scalar start_ground_std = Scalar(0.1);  // height of the three lowest nodes [m]; 0: no ground
  Scalar start_body_std = Scalar(0.2);    // of a pose that was found [m]
  Scalar start_node_std = Scalar(0.1);    // of the shape [m]
  Scalar start_speed_std = Scalar(0.3);   // [m/s]
  Scalar lost_level = Scalar(4);          // mean squared innovation in variances; 1 is right
  Scalar lost_time = Scalar(1.5);         // [s] over which the mean is taken
};

// C's filter with the constants of §IV-B, which the authors' code takes as standard deviations, and
// the sigma weights of that code: what C reports.
template <typename Scalar>
RangingConfig<Scalar> paper_config() {
  RangingConfig<Scalar> config;
  config.filter.weights = Weights::kUniform;
  config.filter.redraw = false;
  config.spread = Scalar(0);
  config.range_std = config.internal_range_std = Scalar(0.029);
  config.inclination_std = Scalar(0.1);
  config.process_noise = ProcessNoise::kState;
  config.hold_rods = false;
  config.gate = Scalar(0);
  config.lost_level = Scalar(0);
  return config;
}

}  // namespace tensegrity::ukf
