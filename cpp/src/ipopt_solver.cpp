#include "tensegrity/shape/ipopt_solver.hpp"

// Debian's Ipopt 3.11 asks for a configuration macro before it includes <cstddef>.
#ifndef HAVE_CSTDDEF
#define HAVE_CSTDDEF
#endif
#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>
#include <limits>
#include <stdexcept>
#include <utility>

#include "ipopt_linear_solver.hpp"
#include "tensegrity/shape/cables.hpp"
#include "tensegrity/shape/gauge.hpp"
#include "tensegrity/shape/solver.hpp"
#include "tensegrity/shape/starts.hpp"

namespace tensegrity::shape {

namespace {

constexpr int kVariables = 12;       // q2..q5
constexpr int kFirst = 6;            // of the variables in the stacked endcaps
constexpr int kEqualities = 3;       // rods 23 and 45, gauge
constexpr double kUnbounded = 2e19;  // Ipopt: anything above 1e19 is no bound

using Variables = Vector<double, kVariables>;

}  // namespace

// T eq. (15) in q2..q5. The spin about z, which changes neither cost nor constraints, is held by
// one linear equality: the shape is in the Procrustes gauge. Without it the Hessian is singular at
// every solution.
class IpoptSolver::Problem : public Ipopt::TNLP {
 public:
  Problem(const Prism<double>& prism, ConstraintSet set)
      : prism_(prism),
        reference_(prism.undeformed()),
        inequalities_(set, prism.moment_sign()),
        multipliers_(Eigen::VectorXd::Zero(constraints())) {}

  int constraints() const { return kEqualities + inequalities_.size(); }

  void set_lengths(const CableLengths<double>& lengths) { lengths_ = lengths; }

  void start_at(const Endcaps<double>& q) {
    x_ = q.rightCols<4>().reshaped();
    multipliers_.setZero();
  }

  struct Point {
    Variables x;
    Eigen::VectorXd multipliers;
  };
  Point point() const { return {x_, multipliers_}; }
  void start_at(const Point& point) {
    x_ = point.x;
    multipliers_ = point.multipliers;
  }

  Endcaps<double> endcaps() const { return endcaps(x_); }

  Endcaps<double> endcaps(const Variables& x) const {
    Endcaps<double> q;
    q.col(0) = prism_.endcap0();
    q.col(1) = prism_.endcap1();
    q.rightCols<4>() = x.reshaped(3, 4);
    return q;
  }

  // T eq. (15a) [m^2].
  double objective(const Endcaps<double>& q) const {
    return (cable_lengths(q) - lengths_).squaredNorm();
  }

  Variables objective_gradient(const Endcaps<double>& q) const {
    Endcaps<double> gradient = Endcaps<double>::Zero();
    for (int k = 0; k < 9; ++k) {
      const Cable cable = kPrismCables[static_cast<std::size_t>(k)];
      double length;
      const Vector3<double> n = detail::cable_direction(q, cable, length);
      const Vector3<double> force = 2 * (length - lengths_[k]) * n;
      gradient.col(cable.from) += force;
      gradient.col(cable.to) -= force;
    }
    return gradient.rightCols<4>().reshaped();
  }

  Eigen::VectorXd constraint_values(const Endcaps<double>& q) const {
    Eigen::VectorXd g(constraints());
    for (int rod = 1; rod <= 2; ++rod) {
      g[rod - 1] = (q.col(2 * rod) - q.col(2 * rod + 1)).squaredNorm();  // 15f
    }
    g[2] = gauge_coefficients().dot(q.rightCols<4>().reshaped());
    for (int i = 0; i < inequalities_.size(); ++i) g[kEqualities + i] = inequalities_[i].value(q);
    return g;
  }

  Eigen::MatrixXd constraint_jacobian(const Endcaps<double>& q) const {
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(constraints(), kVariables);
    for (int rod = 1; rod <= 2; ++rod) {
      const Vector3<double> twice = 2 * (q.col(2 * rod) - q.col(2 * rod + 1));
      jacobian.block<1, 3>(rod - 1, 6 * rod - kFirst) = twice.transpose();
      jacobian.block<1, 3>(rod - 1, 6 * rod + 3 - kFirst) = -twice.transpose();
    }
    jacobian.row(2) = gauge_coefficients().transpose();
    for (int i = 0; i < inequalities_.size(); ++i) {
      const Endcaps<double> gradient = inequalities_[i].gradient(q);
      jacobian.row(kEqualities + i) = gradient.rightCols<4>().reshaped().transpose();
    }
    return jacobian;
  }

  Eigen::MatrixXd lagrangian_hessian(const Endcaps<double>& q, double objective_factor,
                                     const Eigen::VectorXd& multipliers) const {
    Matrix<double, 18> hessian = Matrix<double, 18>::Zero();
    const Matrix3<double> identity = Matrix3<double>::Identity();
    const auto add_difference = [&hessian](int i, int j, const Matrix3<double>& block) {
      hessian.block<3, 3>(3 * i, 3 * i) += block;
      hessian.block<3, 3>(3 * j, 3 * j) += block;
      hessian.block<3, 3>(3 * i, 3 * j) -= block;
      hessian.block<3, 3>(3 * j, 3 * i) -= block;
    };
    for (int k = 0; k < 9; ++k) {
      const Cable cable = kPrismCables[static_cast<std::size_t>(k)];
      double length;
      const Vector3<double> n = detail::cable_direction(q, cable, length);
      if (length <= 0) continue;
      const Matrix3<double> along = n * n.transpose();
      add_difference(
          cable.from, cable.to,
          2 * objective_factor * (along + (length - lengths_[k]) / length * (identity - along)));
    }
    for (int rod = 1; rod <= 2; ++rod) {
      add_difference(2 * rod, 2 * rod + 1, 2 * multipliers[rod - 1] * identity);
    }
    for (int i = 0; i < inequalities_.size(); ++i) {
      hessian += multipliers[kEqualities + i] * inequalities_[i].hessian(q);
    }
    return hessian.bottomRightCorner<kVariables, kVariables>();
  }

  // Ipopt::TNLP

  bool get_nlp_info(int& n, int& m, int& jacobian_size, int& hessian_size,
                    IndexStyleEnum& style) override {
    n = kVariables;
    m = constraints();
    jacobian_size = m * n;
    hessian_size = n * (n + 1) / 2;
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(int n, double* x_low, double* x_high, int m, double* g_low,
                       double* g_high) override {
    std::fill_n(x_low, n, -kUnbounded);
    std::fill_n(x_high, n, kUnbounded);
    std::fill_n(g_low, m, 0.0);
    std::fill_n(g_high, m, kUnbounded);
    const double squared = prism_.rod_length * prism_.rod_length;
    for (int rod = 0; rod < 2; ++rod) g_low[rod] = g_high[rod] = squared;
    g_high[2] = 0;
    return true;
  }

  bool get_starting_point(int n, bool, double* x, bool, double* z_low, double* z_high, int m,
                          bool init_multipliers, double* multipliers) override {
    std::copy_n(x_.data(), n, x);
    // The variables have no bounds and therefore no bound multipliers.
    std::fill_n(z_low, n, 0.0);
    std::fill_n(z_high, n, 0.0);
    if (init_multipliers) std::copy_n(multipliers_.data(), m, multipliers);
    return true;
  }

  bool eval_f(int, const double* x, bool, double& value) override {
    value = objective(endcaps(Eigen::Map<const Variables>(x)));
    return true;
  }

  bool eval_grad_f(int, const double* x, bool, double* gradient) override {
    Eigen::Map<Variables> out(gradient);
    out = objective_gradient(endcaps(Eigen::Map<const Variables>(x)));
    return true;
  }

  bool eval_g(int, const double* x, bool, int m, double* g) override {
    Eigen::Map<Eigen::VectorXd>(g, m) = constraint_values(endcaps(Eigen::Map<const Variables>(x)));
    return true;
  }

  bool eval_jac_g(int n, const double* x, bool, int m, int, int* rows, int* columns,
                  double* values) override {
    if (values == nullptr) {
      for (int i = 0; i < m * n; ++i) {
        rows[i] = i % m;
        columns[i] = i / m;
      }
      return true;
    }
    Eigen::Map<Eigen::MatrixXd>(values, m, n) =
        constraint_jacobian(endcaps(Eigen::Map<const Variables>(x)));
    return true;
  }

  bool eval_h(int n, const double* x, bool, double objective_factor, int m,
              const double* multipliers, bool, int, int* rows, int* columns,
              double* values) override {
    Eigen::MatrixXd hessian;
    if (values != nullptr) {
      hessian = lagrangian_hessian(endcaps(Eigen::Map<const Variables>(x)), objective_factor,
                                   Eigen::Map<const Eigen::VectorXd>(multipliers, m));
    }
    int at = 0;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j, ++at) {
        if (values != nullptr) {
          values[at] = hessian(i, j);
        } else {
          rows[at] = i;
          columns[at] = j;
        }
      }
    }
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn, int n, const double* x, const double*, const double*,
                         int m, const double*, const double* multipliers, double,
                         const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    x_ = Eigen::Map<const Variables>(x, n);
    multipliers_ = Eigen::Map<const Eigen::VectorXd>(multipliers, m);
  }

 private:
  // sum over q2..q5 of (reference x q)_z: zero in the gauge of the reference.
  Variables gauge_coefficients() const {
    Endcaps<double> coefficients = Endcaps<double>::Zero();
    coefficients.row(0) = -reference_.row(1);
    coefficients.row(1) = reference_.row(0);
    return coefficients.rightCols<4>().reshaped();
  }

  Prism<double> prism_;
  Endcaps<double> reference_;
  InequalitySet<double> inequalities_;
  CableLengths<double> lengths_ = CableLengths<double>::Zero();
  Variables x_ = Variables::Zero();
  Eigen::VectorXd multipliers_;
};

namespace {

// Ipopt for one kind of start. It is built once: later solves keep its vectors and what was
// analysed of the linear systems, which no change of lengths changes.
class Application {
 public:
  Application(const IpoptOptions& options, bool warm) : ipopt_(new Ipopt::IpoptApplication(false)) {
    const auto set = ipopt_->Options();
    set->SetIntegerValue("print_level", 0);
    set->SetStringValue("sb", "yes");  // no banner
    set->SetStringValue("linear_solver", ipopt_linear_solver());
    set->SetNumericValue("tol", options.tolerance);
    set->SetIntegerValue("max_iter", options.max_iterations);
    // Where it has to be MUMPS: twelve variables need no tenfold work space for fill-in. Taken from
    // the system and given back at every factorisation, it costs more than the factorisation; Ipopt
    // adds to it on demand.
    set->SetIntegerValue("mumps_mem_percent", 10);
    // One solve a step, no residuals and refinement: the system is dense and well scaled.
    set->SetStringValue("fast_step_computation", "yes");
    set->SetStringValue("warm_start_init_point", warm ? "yes" : "no");
    // With its multipliers a solution starts below the last barrier of the tolerance, and none has
    // to be lowered. A cold start needs a barrier only where inequalities become active: no robot
    // is near those of the mutual moments, many are cut off by those of the paper.
    const double cold_barrier = options.constraints == ConstraintSet::kMutualMoment ? 1e-7 : 1e-3;
    set->SetNumericValue("mu_init", warm ? options.tolerance / 100 : cold_barrier);
    // Warm starts stay where they are instead of being pushed away from active constraints.
    for (const char* name :
         {"warm_start_bound_push", "warm_start_slack_bound_push", "warm_start_bound_frac",
          "warm_start_slack_bound_frac", "warm_start_mult_bound_push"}) {
      set->SetNumericValue(name, 1e-9);
    }
    if (ipopt_->Initialize("") != Ipopt::Solve_Succeeded) {
      throw std::runtime_error("Ipopt could not be initialised");
    }
  }

  // From where `problem`, always the same, starts to a local solution; true when Ipopt converged.
  bool solve(const Ipopt::SmartPtr<Ipopt::TNLP>& problem) {
    ipopt_->Options()->SetStringValue("warm_start_same_structure", built_ ? "yes" : "no");
    const Ipopt::ApplicationReturnStatus status =
        built_ ? ipopt_->ReOptimizeTNLP(problem) : ipopt_->OptimizeTNLP(problem);
    built_ = true;
    return status == Ipopt::Solve_Succeeded || status == Ipopt::Solved_To_Acceptable_Level;
  }

  // Of the last solve.
  int iterations() const {
    const auto statistics = ipopt_->Statistics();
    return IsValid(statistics) ? statistics->IterationCount() : 0;
  }

 private:
  Ipopt::SmartPtr<Ipopt::IpoptApplication> ipopt_;
  bool built_ = false;
};

}  // namespace

struct IpoptSolver::Impl {
  Impl(const Prism<double>& prism_in, const Options& options_in)
      : prism(prism_in),
        options(options_in),
        reference(prism.undeformed()),
        endcaps(reference),
        problem(new Problem(prism, options.constraints)),
        cold_start(options, false),
        warm_start(options, true) {}

  bool run(Application& from) {
    const bool converged = from.solve(problem);
    iterations += from.iterations();
    return converged;
  }

  // Whether the present point of `problem` is the robot; one that is mirrored becomes so.
  bool is_robot() {
    if (options.constraints == ConstraintSet::kAsPrinted) return true;
    const Endcaps<double> q = problem->endcaps();
    const Handedness hand = handedness(q, prism.moment_sign());
    if (hand == Handedness::kMirrored) {
      Rods<double> rods(prism, q);
      rods.reflect();
      problem->start_at(in_procrustes_gauge(rods.endcaps(), reference));
    }
    return hand != Handedness::kMixed;
  }

  Prism<double> prism;
  Options options;
  Endcaps<double> reference;
  Endcaps<double> endcaps;
  double cost = 0;
  int iterations = 0;
  bool warm = false;
  Ipopt::SmartPtr<Problem> problem;
  Application cold_start, warm_start;
};

IpoptSolver::IpoptSolver(const Prism<double>& prism, const Options& options)
    : impl_(std::make_unique<Impl>(prism, options)) {}
IpoptSolver::~IpoptSolver() = default;
IpoptSolver::IpoptSolver(IpoptSolver&&) noexcept = default;
IpoptSolver& IpoptSolver::operator=(IpoptSolver&&) noexcept = default;

Status IpoptSolver::solve(const CableLengths<double>& lengths) {
  Impl& self = *impl_;
  const Status input = check_lengths(lengths, self.prism.rod_length);
  if (input != Status::kOk) return input;
  self.iterations = 0;
  self.problem->set_lengths(lengths);
  const Problem::Point previous = self.problem->point();

  bool converged = self.warm && self.run(self.warm_start);
  bool found = converged && self.is_robot();
  for (int k = 0; !found && k < kColdStarts; ++k) {
    self.problem->start_at(
        in_procrustes_gauge(shape::cold_start(self.prism, k).endcaps(), self.reference));
    const bool start_converged = self.run(self.cold_start);
    converged = converged || start_converged;
    found = start_converged && self.is_robot();
  }
  if (!found) {
    self.problem->start_at(previous);
    return converged ? Status::kWrongChirality : Status::kNotConverged;
  }
  self.endcaps = in_procrustes_gauge(self.problem->endcaps(), self.reference);
  self.cost = self.problem->objective(self.endcaps);
  self.warm = true;
  return Status::kOk;
}

void IpoptSolver::reset() {
  impl_->endcaps = impl_->reference;
  impl_->cost = 0;
  impl_->iterations = 0;
  impl_->warm = false;
}

const Endcaps<double>& IpoptSolver::endcaps() const { return impl_->endcaps; }
double IpoptSolver::cost() const { return impl_->cost; }
int IpoptSolver::iterations() const { return impl_->iterations; }

IpoptSolver::Derivatives IpoptSolver::derivatives(const Endcaps<double>& endcaps,
                                                  const CableLengths<double>& lengths,
                                                  const Eigen::VectorXd& multipliers) const {
  Problem problem(impl_->prism, impl_->options.constraints);
  problem.set_lengths(lengths);
  return {problem.objective(endcaps), problem.objective_gradient(endcaps),
          problem.constraint_values(endcaps), problem.constraint_jacobian(endcaps),
          problem.lagrangian_hessian(endcaps, 1, multipliers)};
}

}  // namespace tensegrity::shape
