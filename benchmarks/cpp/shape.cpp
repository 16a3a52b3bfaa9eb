// Nine cable lengths to a shape: the solver of the filters step by step, warm and cold, the
// tracker, and Ipopt on T's formulation.
#include <memory>

#include "recording.hpp"
#include "runner.hpp"
#include "tensegrity/shape/ipopt_solver.hpp"
#include "tensegrity/shape/solver.hpp"
#include "tensegrity/shape/tracker.hpp"

namespace {

using namespace tensegrity;
using benchmarks::Program;

constexpr double kTolerance = 1e-4;  // of LooseFilter: length of the last step [m]
constexpr double kCableStd = 0.002;  // [m]
constexpr double kStepStd = 0.01;    // of the shape between two samples of a rolling robot [m]

// Consecutive cable lengths of the rolling robot, to and fro: neighbours stay neighbours.
class Stream {
 public:
  Stream(const std::string& recording, std::size_t most)
      : lengths_([&] {
          const auto all = benchmarks::read_lengths(recording);
          const std::size_t middle = all.size() / 2, half = std::min(most, all.size()) / 2;
          return std::vector<CableLengths<double>>(all.begin() + std::ptrdiff_t(middle - half),
                                                   all.begin() + std::ptrdiff_t(middle + half));
        }()) {}

  std::size_t size() const { return lengths_.size(); }
  const CableLengths<double>& next() {
    if (at_ + 1 == lengths_.size()) forth_ = false;
    if (at_ == 0) forth_ = true;
    return lengths_[forth_ ? at_++ : at_--];
  }

 private:
  std::vector<CableLengths<double>> lengths_;
  std::size_t at_ = 0;
  bool forth_ = true;
};

shape::SolverOptions<double> options() {
  shape::SolverOptions<double> o;
  o.tolerance = kTolerance;
  return o;
}

void add_cases(Program& program, const std::string& recording) {
  const std::string suffix = "/" + benchmarks::recording_name(recording);
  const Stream all(recording, 2000), few(recording, 40);
  const int counted = 2 * int(all.size());
  program.add("shape/step" + suffix,
              [all] {
                shape::SolverOptions<double> one = options();
                one.max_iterations = 1;
                shape::Solver<double> solver({}, one);
                auto stream = all;
                const CableLengths<double> first = stream.next();
                for (int k = 0; k < 20; ++k) solver.solve(first);  // a step each, until it fits
                return [solver, stream]() mutable { solver.solve(stream.next()); };
              },
              {1, counted});
  program.add("shape/warm" + suffix,
              [all] {
                return [solver = shape::Solver<double>({}, options()), stream = all]() mutable {
                  solver.solve(stream.next());
                };
              },
              {1, counted});
  program.add("shape/cold" + suffix,
              [all] {
                return [solver = shape::Solver<double>({}, options()), stream = all]() mutable {
                  solver.reset();
                  solver.solve(stream.next());
                };
              },
              {1, counted});
  program.add("shape/tracker" + suffix,
              [all] {
                auto stream = all;
                shape::Tracker<double> tracker({});
                tracker.reset(stream.next(), kCableStd);
                return [tracker, stream]() mutable {
                  tracker.predict(kStepStd);
                  tracker.correct(stream.next(), kCableStd);
                };
              },
              {1, counted});
  for (const bool cold : {false, true}) {
    program.add(std::string("shape/ipopt_") + (cold ? "cold" : "warm") + suffix,
                [few, cold] {
                  return [solver = std::make_unique<shape::IpoptSolver>(Prism<double>()),
                          stream = few, cold]() mutable {
                    if (cold) solver->reset();
                    solver->solve(stream.next());
                  };
                },
                {1, int(few.size())});
  }
}

}  // namespace

int main(int argc, char** argv) {
  Program program(argc, argv);
  for (const std::string& recording : program.recordings()) add_cases(program, recording);
  return program.run();
}
