// Time of the unscented filter's algebra at SUPERball's size, 72 states and 30 measured rows, with
// a process that does nothing: what is left of an update beside the dynamics.
#include "tensegrity/ukf/unscented_filter.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>
#include <vector>

using namespace tensegrity::ukf;

namespace {

template <typename Scalar>
void measure(const char* name, Form form) {
  const int n = 72, m = 30, repetitions = 400;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  MatrixX<Scalar> a(n, n);
  for (int i = 0; i < a.size(); ++i) a.data()[i] = Scalar(normal(random));
  const MatrixX<Scalar> p = Scalar(0.001) * (a * a.transpose());
  const MatrixX<Scalar> q = Scalar(1e-4) * MatrixX<Scalar>::Identity(n, n);
  const VectorX<Scalar> x = VectorX<Scalar>::LinSpaced(n, Scalar(-2), Scalar(3));
  const VectorX<Scalar> z = VectorX<Scalar>::Constant(m, Scalar(4));
  const VectorX<Scalar> r = VectorX<Scalar>::Constant(m, Scalar(0.01));
  UnscentedSettings<Scalar> settings;
  settings.form = form;
  UnscentedFilter<Scalar> filter(n, m, settings);
  filter.set(x, p);
  const auto stay = [](auto) { return true; };
  const auto ranges = [](const auto& points, auto predicted) {
    for (int r = 0; r < int(predicted.cols()); ++r) {
      const int node = 3 * (r % 12);
      predicted.col(r) =
          ((points.col(node).array() - 5).square() + (points.col(node + 1).array() - 2).square() +
           (points.col(node + 2).array() - 3).square())
              .sqrt();
    }
  };
  std::vector<double> predict, correct;
  using Clock = std::chrono::steady_clock;
  for (int k = 0; k < repetitions; ++k) {
    const auto t0 = Clock::now();
    filter.predict(stay, q);
    const auto t1 = Clock::now();
    filter.correct(ranges, z, r);
    const auto t2 = Clock::now();
    predict.push_back(std::chrono::duration<double, std::micro>(t1 - t0).count());
    correct.push_back(std::chrono::duration<double, std::micro>(t2 - t1).count());
  }
  const auto median = [](std::vector<double>& v) {
    std::nth_element(v.begin(), v.begin() + v.size() / 2, v.end());
    return v[v.size() / 2];
  };
  std::printf("%-24s predict %7.1f us   correct %7.1f us\n", name, median(predict),
              median(correct));
}

}  // namespace

int main() {
  measure<double>("covariance, double", Form::kCovariance);
  measure<float>("covariance, float", Form::kCovariance);
  measure<double>("square root, double", Form::kSquareRoot);
  measure<float>("square root, float", Form::kSquareRoot);
}
