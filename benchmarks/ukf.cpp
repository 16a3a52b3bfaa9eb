// Time and memory of the unscented filter's algebra for nets of 3 to 48 rods, 12 states and 5
// measured rows a rod (SUPERball: 72 and 30), with a process that does nothing: what is left of an
// update beside the dynamics (dynamics.cpp).
#include "tensegrity/ukf/unscented_filter.hpp"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>
#include <vector>

using namespace tensegrity::ukf;

namespace {

template <typename Scalar>
void measure(const char* name, Form form, int rods) {
  const int n = 12 * rods, m = 5 * rods, repetitions = std::max(400 * 36 / (rods * rods), 5);
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
  const std::size_t before = mallinfo2().uordblks + mallinfo2().hblkhd;
  UnscentedFilter<Scalar> filter(n, m, settings);
  const std::size_t bytes = mallinfo2().uordblks + mallinfo2().hblkhd - before;
  filter.set(x, p);
  const auto stay = [](auto) { return true; };
  const auto ranges = [](const auto& points, auto predicted) {
    for (int r = 0; r < int(predicted.cols()); ++r) {
      const int node = 3 * (r % (int(points.cols()) / 6));
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
  std::printf("%2d rods  %-20s predict %9.1f us   correct %9.1f us   %8.0f kB\n", rods, name,
              median(predict), median(correct), double(bytes) / 1024);
}

}  // namespace

int main() {
  for (const int rods : {3, 6, 12, 24, 48}) {
    measure<double>("covariance, double", Form::kCovariance, rods);
    measure<float>("covariance, float", Form::kCovariance, rods);
    measure<double>("square root, double", Form::kSquareRoot, rods);
    measure<float>("square root, float", Form::kSquareRoot, rods);
  }
}
