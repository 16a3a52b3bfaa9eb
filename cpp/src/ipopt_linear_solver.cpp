#include "ipopt_linear_solver.hpp"

#if __has_include(<HSLLoader.h>)  // Ipopt up to 3.13

#include <IpTypes.hpp>  // first: HSLLoader.h uses its types
//
#include <HSLLoader.h>

#include <algorithm>
#include <vector>

extern "C" {
void dsytrf_(const char* triangle, const int* n, double* a, const int* stride, int* pivots,
             double* work, const int* work_size, int* info);
void dsytrs_(const char* triangle, const int* n, const int* columns, const double* a,
             const int* stride, const int* pivots, double* b, const int* b_stride, int* info);
}

namespace tensegrity::shape {

namespace {

// Places in MA27's INFO, and what it says in the first.
constexpr int kFlag = 0, kReals = 4, kIntegers = 5, kNegative = 14, kInfoSize = 20;
constexpr int kSingular = -5, kRealsTooFew = -4, kIntegersTooFew = -3, kNeeded = 1;

// Default controls: none of them is used.
void defaults(int* controls, double* real_controls) {
  std::fill_n(controls, 30, 0);
  std::fill_n(real_controls, 5, 0.0);
}

// Analysis: what a dense factorisation needs.
void analyse(int* n, int*, const int*, const int*, int*, int*, int*, int*, int* steps, int*, int*,
             double*, int* info, double* operations) {
  std::fill_n(info, kInfoSize, 0);
  info[kReals] = *n * *n;
  info[kIntegers] = *n;
  *steps = 1;
  *operations = double(*n) * *n * *n / 3;
}

// Factorisation: `a` has the numbers of a triangle, at `rows` and `columns` from one on, where
// those of one place add up, and gets the factor; `pivots` the order of its rows.
void factorise(int* size, int* count, const int* rows, const int* columns, double* a,
               int* a_capacity, int* pivots, int* pivots_capacity, int*, int*, int* front, int*,
               int*, double*, int* info) {
  const int n = *size;
  std::fill_n(info, kInfoSize, 0);
  if (*pivots_capacity < n) {
    info[kFlag] = kIntegersTooFew;
    info[kNeeded] = n;
    return;
  }
  if (*a_capacity < n * n) {
    info[kFlag] = kRealsTooFew;
    info[kNeeded] = n * n;
    return;
  }
  const std::vector<double> numbers(a, a + *count);
  std::fill_n(a, n * n, 0.0);
  for (int k = 0; k < *count; ++k) {
    const int row = std::max(rows[k], columns[k]), column = std::min(rows[k], columns[k]);
    a[(column - 1) * n + row - 1] += numbers[std::size_t(k)];
  }
  std::vector<double> work(static_cast<std::size_t>(n));
  int status;
  dsytrf_("L", &n, a, &n, pivots, work.data(), &n, &status);
  if (status > 0) info[kFlag] = kSingular;
  *front = n;
  // A block of two by two, both of its pivots negative, has an eigenvalue of either sign.
  for (int k = 0; k < n; ++k) {
    if (pivots[k] < 0) {
      ++info[kNegative];
      ++k;
    } else if (a[k * n + k] < 0) {
      ++info[kNegative];
    }
  }
}

void solve(int* n, double* factor, int*, int* pivots, int*, double*, int*, double* right, int*,
           int*, int*, double*) {
  const int one = 1;
  int status;
  dsytrs_("L", n, &one, factor, n, pivots, right, n, &status);
}

}  // namespace

const char* ipopt_linear_solver() {
  [[maybe_unused]] static const bool set = [] {
    if (!LSL_isMA27available()) LSL_setMA27(analyse, factorise, solve, defaults);
    return true;
  }();
  return "ma27";
}

}  // namespace tensegrity::shape

#else

const char* tensegrity::shape::ipopt_linear_solver() { return "mumps"; }

#endif
