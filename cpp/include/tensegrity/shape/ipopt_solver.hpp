// Cable lengths -> endcaps by constrained optimisation, T eq. (15) exactly, with Ipopt.
//
// The reference that the real-time `Solver` is tested against, and the way to try the constraint
// sets of the paper. About a thousand times slower; allocates memory. Target tensegrity::ipopt.
#pragma once

#include <memory>

#include "tensegrity/robot/prism.hpp"
#include "tensegrity/shape/constraints.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity::shape {

struct IpoptOptions {
  ConstraintSet constraints = ConstraintSet::kMutualMoment;
  double tolerance = 1e-9;   // Ipopt's `tol`, on the optimality conditions
  int max_iterations = 300;  // per start
};

class IpoptSolver {
 public:
  using Options = IpoptOptions;

  // Throws std::runtime_error when Ipopt cannot be set up (no linear solver).
  explicit IpoptSolver(const Prism<double>& prism, const Options& options = Options());
  ~IpoptSolver();
  IpoptSolver(IpoptSolver&&) noexcept;
  IpoptSolver& operator=(IpoptSolver&&) noexcept;

  // Lengths [m] -> shape. The first call after construction or `reset` starts cold from the
  // undeformed robot; later calls start from the last solution and its multipliers.
  //   kOk             solved
  //   kNotConverged   no start converged; the shape is unchanged
  //   kWrongChirality every start ended in crossing rods; the shape is unchanged
  //   kNotFinite, kOutOfRange  bad lengths; the shape is unchanged
  // With `kAsPrinted` the solution is taken as it is, whatever its chirality.
  Status solve(const CableLengths<double>& lengths);
  void reset();

  // Body frame, Procrustes gauge of the undeformed robot [m].
  const Endcaps<double>& endcaps() const;
  // Sum of squared length residuals, T eq. 15a [m^2].
  double cost() const;
  // Of the last call, all its starts together.
  int iterations() const;

  // Derivatives Ipopt is given, for tests. `endcaps` holds q0..q5 [m]; derivatives are with respect
  // to q2..q5 stacked.
  struct Derivatives {
    double objective;
    Eigen::VectorXd gradient;     // 12
    Eigen::VectorXd constraints;  // two rods, one gauge, then the inequalities
    Eigen::MatrixXd jacobian;     // constraints x 12
    Eigen::MatrixXd hessian;      // of objective + multipliers' constraints, 12 x 12
  };
  Derivatives derivatives(const Endcaps<double>& endcaps, const CableLengths<double>& lengths,
                          const Eigen::VectorXd& multipliers) const;

 private:
  class Problem;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tensegrity::shape
