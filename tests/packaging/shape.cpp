// Needs headers alone: the cables of the undeformed robot.
#include <cmath>
#include <cstdio>
#include <tensegrity/shape/cables.hpp>

int main() {
  const tensegrity::Prism<double> robot;
  const auto lengths = tensegrity::shape::cable_lengths<double>(robot.undeformed());
  std::printf("side cable %.3f m, cross cable %.3f m\n", lengths[0], lengths[6]);
  return std::abs(lengths[0] - robot.side_length) < 1e-9 ? 0 : 1;
}
