// Needs the library that needs Ipopt: the shape of the undeformed robot from its cables.
#include <cstdio>
#include <tensegrity/shape/cables.hpp>
#include <tensegrity/shape/ipopt_solver.hpp>

int main() {
  const tensegrity::Prism<double> robot;
  tensegrity::shape::IpoptSolver solver(robot);
  const auto status = solver.solve(tensegrity::shape::cable_lengths<double>(robot.undeformed()));
  std::printf("%s after %d iterations\n", to_string(status), solver.iterations());
  return used(status) ? 0 : 1;
}
