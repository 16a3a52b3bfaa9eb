// What a calibration is asked: ranges, trajectories to find, and what is known beforehand.
//
// All parameters that are not trajectory are one vector, the "shared" ones:
//   [anchor positions 3A | offset terms P | rod lengths R], all in metres.
#pragma once

#include <array>
#include <vector>

namespace tensegrity::ranging {

// A raw range: distance between an anchor and a module, plus the sum of its offset terms (C eq. 7,
// C is Caluwaerts et al. 2016). The module's position at the time of the range lies on the line
// between two knots: (1 - blend) * knot + blend * (knot + 1).
template <typename Scalar>
struct CalibrationRange {
  int strip = 0;
  int module = 0;  // within the strip
  int knot = 0;
  Scalar blend = 0;
  int anchor = 0;
  std::array<int, 4> offset_terms{{-1, -1, -1, -1}};  // -1: none
  Scalar range = 0;                                   // [m]
};

// The trajectory of the modules that a rod joins (two), or of a single module.
template <typename Scalar>
struct CalibrationStrip {
  int modules = 2;
  int knots = 0;
  std::vector<Scalar> motion_information;  // of each step knot -> knot + 1, 1/variance [1/m^2]
  int rod_length = -1;                     // which of the rod lengths; -1: no rod
};

template <typename Scalar>
struct CalibrationProblem {
  int anchors = 0;
  int offset_terms = 0;
  int rod_lengths = 0;
  // Independent normal priors of the shared parameters; information 0: nothing is known.
  std::vector<Scalar> prior_mean;
  std::vector<Scalar> prior_information;
  std::vector<CalibrationStrip<Scalar>> strips;
  std::vector<CalibrationRange<Scalar>> ranges;
  Scalar range_std = Scalar(0.1);  // [m]
  Scalar rod_std = Scalar(0.02);   // of the distance between a rod's modules at a knot [m]
  // What is known about every module at every knot: x, y and z are about zero, each with this
  // information [1/m^2]. A little of it keeps unmeasured knots determined.
  std::array<Scalar, 3> knot_information{{Scalar(1e-4), Scalar(1e-4), Scalar(1e-4)}};

  int shared() const { return 3 * anchors + offset_terms + rod_lengths; }
};

}  // namespace tensegrity::ranging
