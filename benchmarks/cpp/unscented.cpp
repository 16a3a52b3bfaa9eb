// The algebra of the unscented filter alone, for nets of 3 to 48 rods: 12 states and 5 measured
// rows a rod (SUPERball: 72 and 30), with a process that does nothing. It is what is left of an
// update beside the dynamics.
#include "tensegrity/ukf/unscented_filter.hpp"

#include <malloc.h>

#include <memory>
#include <random>

#include "runner.hpp"

namespace {

using namespace tensegrity;
using benchmarks::Program;
using ukf::Form;

template <typename Scalar>
struct Algebra {
  int n, m;
  ukf::MatrixX<Scalar> q;
  ukf::VectorX<Scalar> z, r;
  ukf::UnscentedFilter<Scalar> filter;

  static ukf::UnscentedSettings<Scalar> settings(Form form) {
    ukf::UnscentedSettings<Scalar> s;
    s.form = form;
    return s;
  }

  Algebra(Form form, int rods)
      : n(12 * rods),
        m(5 * rods),
        q(Scalar(1e-4) * ukf::MatrixX<Scalar>::Identity(n, n)),
        z(ukf::VectorX<Scalar>::Constant(m, Scalar(4))),
        r(ukf::VectorX<Scalar>::Constant(m, Scalar(0.01))),
        filter(n, m, settings(form)) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    ukf::MatrixX<Scalar> a(n, n);
    for (int i = 0; i < a.size(); ++i) a.data()[i] = Scalar(normal(random));
    filter.set(ukf::VectorX<Scalar>::LinSpaced(n, Scalar(-2), Scalar(3)),
               Scalar(0.001) * (a * a.transpose()));
  }

  void predict() {
    filter.predict([](auto) { return true; }, q);
  }
  void correct() {
    const auto ranges = [](const auto& points, auto predicted) {
      for (int k = 0; k < int(predicted.cols()); ++k) {
        const int node = 3 * (k % (int(points.cols()) / 6));
        predicted.col(k) =
            ((points.col(node).array() - 5).square() + (points.col(node + 1).array() - 2).square() +
             (points.col(node + 2).array() - 3).square())
                .sqrt();
      }
    };
    filter.correct(ranges, z, r);
  }
};

// Heap of one filter [bytes].
template <typename Scalar>
double memory(Form form, int rods) {
  const auto used = [] { return mallinfo2().uordblks + mallinfo2().hblkhd; };
  const std::size_t before = used();
  const ukf::UnscentedFilter<Scalar> filter(12 * rods, 5 * rods, Algebra<Scalar>::settings(form));
  return double(used() - before);
}

// One call is a prediction and the correction that follows it.
template <typename Scalar>
void add_algebra(Program& program, Form form, int rods) {
  const std::string name = std::string("ukf/algebra/") +
                           (form == Form::kCovariance ? "covariance" : "square_root") + "/" +
                           std::to_string(rods) + "/" + (sizeof(Scalar) == 4 ? "float" : "double");
  program.add(name,
              [form, rods] {
                return [algebra = std::make_unique<Algebra<Scalar>>(form, rods)] {
                  algebra->predict();
                  algebra->correct();
                };
              },
              {1, rods > 12 ? 0 : 2, memory<Scalar>(form, rods)});
}

}  // namespace

int main(int argc, char** argv) {
  Program program(argc, argv);
  for (const int rods : {3, 6, 12, 24, 48}) {
    for (const Form form : {Form::kCovariance, Form::kSquareRoot}) {
      add_algebra<double>(program, form, rods);
      add_algebra<float>(program, form, rods);
    }
  }
  return program.run();
}
