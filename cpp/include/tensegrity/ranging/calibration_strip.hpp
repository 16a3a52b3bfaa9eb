// One strip of a calibration: the knots of a trajectory with all that depends on them.
//
// Its normal equations are block tridiagonal (a knot meets its neighbours through ranges between
// them and through the motion prior), with a border of the few shared parameters that the strip's
// ranges touch. Eliminating the knots leaves a dense system of the border alone (Schur complement);
// the cost is linear in the number of knots.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tensegrity/ranging/calibration_problem.hpp"
#include "tensegrity/ranging/robust_loss.hpp"

namespace tensegrity::ranging {

template <typename Scalar, int Modules>
class CalibrationStripSolver {
 public:
  static constexpr int kSize = 3 * Modules;  // coordinates of a knot
  using Shared = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using SharedMatrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

  // `index` is the strip's among those of the problem.
  CalibrationStripSolver(const CalibrationProblem<Scalar>& problem, int index)
      : knots_(problem.strips[std::size_t(index)].knots),
        range_std_(problem.range_std),
        rod_information_(1 / (problem.rod_std * problem.rod_std)),
        knot_information_(problem.knot_information),
        motion_information_(problem.strips[std::size_t(index)].motion_information) {
    std::vector<int> local(static_cast<std::size_t>(problem.shared()), -1);
    const auto column = [&](int shared) {
      if (local[std::size_t(shared)] < 0) {
        local[std::size_t(shared)] = static_cast<int>(border_.size());
        border_.push_back(shared);
      }
      return local[std::size_t(shared)];
    };
    for (std::size_t i = 0; i < problem.ranges.size(); ++i) {
      const CalibrationRange<Scalar>& range = problem.ranges[i];
      if (range.strip != index) continue;
      Row row;
      row.source = static_cast<int>(i);
      row.at = kSize * range.knot + 3 * range.module;
      row.knot = range.knot;
      row.module = range.module;
      row.blend = range.knot + 1 < knots_ ? range.blend : Scalar(0);
      row.measured = range.range;
      row.anchor = 3 * range.anchor;
      for (int axis = 0; axis < 3; ++axis) row.columns[axis] = column(3 * range.anchor + axis);
      for (int term : range.offset_terms) {
        if (term < 0) continue;
        row.offsets[row.offset_count] = 3 * problem.anchors + term;
        row.columns[3 + row.offset_count] = column(3 * problem.anchors + term);
        ++row.offset_count;
      }
      rows_.push_back(row);
    }
    std::stable_sort(rows_.begin(), rows_.end(),
                     [](const Row& a, const Row& b) { return a.knot < b.knot; });
    const int rod = problem.strips[std::size_t(index)].rod_length;
    if (Modules == 2 && rod >= 0) {
      rod_ = 3 * problem.anchors + problem.offset_terms + rod;
      rod_column_ = column(rod_);
    }
    width_ = static_cast<int>(border_.size());
    const std::size_t knots = static_cast<std::size_t>(knots_);
    const std::size_t width = static_cast<std::size_t>(width_);
    positions_.assign(kSize * knots, Scalar(0));
    trial_ = positions_;
    gradient_ = positions_;
    step_ = positions_;
    const std::size_t block = kSize * kSize;
    diagonal_.resize(block * knots);
    coupling_.resize(block * knots);
    factor_.resize(block * knots);
    link_.resize(block * knots);
    cross_.resize(kSize * width * knots);
    // One more column than the border: the eliminated gradient.
    eliminated_.resize(kSize * (width + 1) * knots);
    shared_information_.resize(width * width);
    shared_gradient_.resize(width);
    reduced_.resize((width + 1) * (width + 1));
    border_step_.resize(width + 1);
  }

  std::vector<Scalar>& positions() { return positions_; }
  const std::vector<Scalar>& positions() const { return positions_; }
  // Of the cost by the positions, as of the last linearise().
  const std::vector<Scalar>& gradient() const { return gradient_; }

  // Half the loss at the positions (`at_trial`: at those of the last step) and shared parameters.
  Scalar cost(const Shared& shared, const RobustLoss<Scalar>& loss, bool at_trial) const {
    const std::vector<Scalar>& at = at_trial ? trial_ : positions_;
    Scalar sum = 0;
    for (const Row& row : rows_) {
      const Scalar residual = evaluate(row, at, shared).residual;
      sum += loss.value(residual * residual);
    }
    for (int k = 0; k + 1 < knots_; ++k) {
      for (int i = kSize * k; i < kSize * (k + 1); ++i) {
        const Scalar moved = at[std::size_t(i + kSize)] - at[std::size_t(i)];
        sum += motion_information_[std::size_t(k)] * moved * moved;
      }
    }
    for (std::size_t i = 0; i < at.size(); ++i) sum += knot_information_[i % 3] * at[i] * at[i];
    if constexpr (Modules == 2) {
      if (rod_ >= 0) {
        for (int k = 0; k < knots_; ++k) {
          const Scalar error = rod(at.data() + kSize * k).length - shared[rod_];
          sum += loss.value(rod_information_ * error * error);
        }
      }
    }
    return sum / 2;
  }

  // Gauss-Newton normal equations at the positions, with the robust loss as weights.
  void linearise(const Shared& shared, const RobustLoss<Scalar>& loss) {
    clear();
    for (const Row& row : rows_) add_range(row, shared, loss);
    for (int k = 0; k + 1 < knots_; ++k) add_motion(k);
    for (int k = 0; k < knots_; ++k) {
      for (int i = 0; i < kSize; ++i) {
        diagonal(k, i, i) += knot_information_[std::size_t(i % 3)];
        gradient_[std::size_t(kSize * k + i)] +=
            knot_information_[std::size_t(i % 3)] * positions_[std::size_t(kSize * k + i)];
      }
    }
    if constexpr (Modules == 2) {
      if (rod_ >= 0) {
        for (int k = 0; k < knots_; ++k) add_rod(k, shared, loss);
      }
    }
  }

  // Adds what the strip's ranges say about the shared parameters directly.
  void add_shared(SharedMatrix& information, Shared& gradient) const {
    for (int i = 0; i < width_; ++i) {
      gradient[border_[std::size_t(i)]] += shared_gradient_[std::size_t(i)];
      for (int j = 0; j < width_; ++j) {
        information(border_[std::size_t(i)], border_[std::size_t(j)]) +=
            shared_information_[std::size_t(i * width_ + j)];
      }
    }
  }

  // Eliminates the knots and takes what they explain off the shared system. `damping` is relative
  // to the diagonal (Marquardt) plus that of one range: where a knot is hardly measured, the
  // diagonal alone would let it step far beyond what the linearisation is good for. False if a
  // block is not positive definite.
  bool eliminate(Scalar damping, SharedMatrix& information, Shared& gradient) {
    std::fill(reduced_.begin(), reduced_.end(), Scalar(0));
    const int columns = width_ + 1;
    const Scalar range_information = 1 / (range_std_ * range_std_);
    for (int k = 0; k < knots_; ++k) {
      Scalar* factor = &factor_[std::size_t(kSize * kSize * k)];
      std::copy_n(&diagonal_[std::size_t(kSize * kSize * k)], kSize * kSize, factor);
      for (int i = 0; i < kSize; ++i) {
        factor[i * kSize + i] += damping * (factor[i * kSize + i] + range_information);
      }
      Scalar* rows = &eliminated_[std::size_t(kSize) * std::size_t(columns) * std::size_t(k)];
      for (int i = 0; i < kSize; ++i) {
        std::copy_n(&cross(k, i, 0), width_, rows + columns * i);
        rows[columns * i + width_] = gradient_[std::size_t(kSize * k + i)];
      }
      if (k > 0) {
        const Scalar* link = &link_[std::size_t(kSize * kSize * (k - 1))];
        const Scalar* before = rows - kSize * columns;
        for (int i = 0; i < kSize; ++i) {
          Scalar weights[kSize];
          for (int m = 0; m < kSize; ++m) weights[m] = link[kSize * m + i];
          subtract_rows(weights, link, kSize, kSize, factor + kSize * i);
          subtract_rows(weights, before, columns, columns, rows + columns * i);
        }
      }
      if (!cholesky(factor)) return false;
      Scalar* link = &link_[std::size_t(kSize * kSize * k)];
      std::copy_n(&coupling_[std::size_t(kSize * kSize * k)], kSize * kSize, link);
      forward(factor, link, kSize);
      forward(factor, rows, columns);
      for (int j = 0; j < columns; ++j) {
        Scalar weights[kSize];
        for (int m = 0; m < kSize; ++m) weights[m] = rows[columns * m + j];
        subtract_rows(weights, rows, columns, j + 1, &reduced_[std::size_t(columns * j)]);
      }
    }
    for (int j = 0; j < width_; ++j) {
      gradient[border_[std::size_t(j)]] += reduced_[std::size_t(columns * width_ + j)];
      for (int i = 0; i <= j; ++i) {
        information(border_[std::size_t(i)], border_[std::size_t(j)]) +=
            reduced_[std::size_t(columns * j + i)];
        if (i != j)
          information(border_[std::size_t(j)], border_[std::size_t(i)]) +=
              reduced_[std::size_t(columns * j + i)];
      }
    }
    return true;
  }

  // The step of the knots that goes with the step of the shared parameters; makes the trial.
  void substitute(const Shared& shared_step) {
    const int columns = width_ + 1;
    for (int j = 0; j < width_; ++j)
      border_step_[std::size_t(j)] = shared_step[border_[std::size_t(j)]];
    border_step_[std::size_t(width_)] = 1;  // times the eliminated gradient
    for (int k = knots_ - 1; k >= 0; --k) {
      const Scalar* rows = &eliminated_[std::size_t(kSize) * std::size_t(columns) * std::size_t(k)];
      const Scalar* link = &link_[std::size_t(kSize * kSize * k)];
      const Scalar* factor = &factor_[std::size_t(kSize * kSize * k)];
      Scalar* x = &step_[std::size_t(kSize * k)];
      for (int i = 0; i < kSize; ++i) {
        x[i] = 0;
        for (int j = 0; j < columns; ++j)
          x[i] -= rows[columns * i + j] * border_step_[std::size_t(j)];
        if (k + 1 < knots_) {
          for (int j = 0; j < kSize; ++j) x[i] -= link[kSize * i + j] * x[kSize + j];
        }
      }
      for (int i = kSize - 1; i >= 0; --i) {
        for (int j = i + 1; j < kSize; ++j) x[i] -= factor[kSize * j + i] * x[j];
        x[i] /= factor[kSize * i + i];
      }
    }
    for (std::size_t i = 0; i < trial_.size(); ++i) trial_[i] = positions_[i] + step_[i];
  }

  void accept() { positions_.swap(trial_); }

  // Whitened residuals of the strip's ranges, at their place among those of the problem.
  void residuals(const Shared& shared, std::vector<Scalar>& out) const {
    for (const Row& row : rows_)
      out[std::size_t(row.source)] = evaluate(row, positions_, shared).residual;
  }

 private:
  struct Row {
    int source = 0;  // among the problem's ranges
    int knot = 0;
    int module = 0;
    int at = 0;  // first coordinate of the module at the knot
    Scalar blend = 0;
    Scalar measured = 0;
    int anchor = 0;       // first coordinate among the shared parameters
    int offsets[4] = {};  // among the shared parameters
    int columns[7] = {};  // of the anchor's coordinates and the offset terms in the border
    int offset_count = 0;
  };

  struct Evaluated {
    Scalar residual;      // whitened
    Scalar direction[3];  // from the anchor to the module, divided by range_std
  };

  struct Rod {
    Scalar length;
    Scalar direction[3];  // from module 0 to module 1
  };

  // Below this the direction of a distance is arbitrary; a module never sits inside an anchor.
  static constexpr Scalar kClosest = Scalar(1e-6);  // [m]

  Evaluated evaluate(const Row& row, const std::vector<Scalar>& at, const Shared& shared) const {
    Evaluated result;
    Scalar squared = 0;
    const bool between = row.blend > 0;
    for (int i = 0; i < 3; ++i) {
      Scalar x = at[std::size_t(row.at + i)];
      if (between) x += row.blend * (at[std::size_t(row.at + kSize + i)] - x);
      result.direction[i] = x - shared[row.anchor + i];
      squared += result.direction[i] * result.direction[i];
    }
    const Scalar distance = std::max(std::sqrt(squared), kClosest);
    for (Scalar& d : result.direction) d /= distance * range_std_;
    Scalar predicted = distance;
    for (int i = 0; i < row.offset_count; ++i) predicted += shared[row.offsets[i]];
    result.residual = (predicted - row.measured) / range_std_;
    return result;
  }

  static Rod rod(const Scalar* knot) {
    Rod result;
    Scalar squared = 0;
    for (int i = 0; i < 3; ++i) {
      result.direction[i] = knot[3 + i] - knot[i];
      squared += result.direction[i] * result.direction[i];
    }
    result.length = std::max(std::sqrt(squared), kClosest);
    for (Scalar& d : result.direction) d /= result.length;
    return result;
  }

  void clear() {
    for (auto* all :
         {&gradient_, &diagonal_, &coupling_, &cross_, &shared_information_, &shared_gradient_}) {
      std::fill(all->begin(), all->end(), Scalar(0));
    }
  }

  Scalar& diagonal(int k, int i, int j) {
    return diagonal_[std::size_t(kSize * (kSize * k + i) + j)];
  }
  Scalar& coupling(int k, int i, int j) {
    return coupling_[std::size_t(kSize * (kSize * k + i) + j)];
  }
  Scalar& cross(int k, int i, int column) {
    return cross_[std::size_t(width_) * std::size_t(kSize * k + i) + std::size_t(column)];
  }

  void add_range(const Row& row, const Shared& shared, const RobustLoss<Scalar>& loss) {
    const Evaluated e = evaluate(row, positions_, shared);
    const Scalar weight = loss.weight(e.residual * e.residual);
    Scalar slopes[7];  // of the residual, by the row's border columns
    for (int i = 0; i < 3; ++i) slopes[i] = -e.direction[i];
    for (int i = 0; i < row.offset_count; ++i) slopes[3 + i] = 1 / range_std_;
    const int columns = 3 + row.offset_count;
    const int first = 3 * row.module;
    const Scalar share[2] = {1 - row.blend, row.blend};
    const int ends = row.blend > 0 ? 2 : 1;
    for (int end = 0; end < ends; ++end) {
      const int k = row.knot + end;
      for (int i = 0; i < 3; ++i) {
        const Scalar slope = weight * share[end] * e.direction[i];
        gradient_[std::size_t(kSize * k + first + i)] += slope * e.residual;
        for (int j = 0; j < 3; ++j) {
          diagonal(k, first + i, first + j) += slope * share[end] * e.direction[j];
          if (end == 0 && ends == 2) {
            coupling(k, first + i, first + j) += slope * share[1] * e.direction[j];
          }
        }
        for (int c = 0; c < columns; ++c) cross(k, first + i, row.columns[c]) += slope * slopes[c];
      }
    }
    for (int a = 0; a < columns; ++a) {
      shared_gradient_[std::size_t(row.columns[a])] += weight * slopes[a] * e.residual;
      for (int b = 0; b < columns; ++b) {
        shared_information_[std::size_t(row.columns[a] * width_ + row.columns[b])] +=
            weight * slopes[a] * slopes[b];
      }
    }
  }

  void add_motion(int k) {
    const Scalar information = motion_information_[std::size_t(k)];
    for (int i = 0; i < kSize; ++i) {
      const Scalar force = information * (positions_[std::size_t(kSize * (k + 1) + i)] -
                                          positions_[std::size_t(kSize * k + i)]);
      gradient_[std::size_t(kSize * k + i)] -= force;
      gradient_[std::size_t(kSize * (k + 1) + i)] += force;
      diagonal(k, i, i) += information;
      diagonal(k + 1, i, i) += information;
      coupling(k, i, i) -= information;
    }
  }

  void add_rod(int k, const Shared& shared, const RobustLoss<Scalar>& loss) {
    const Rod r = rod(&positions_[std::size_t(kSize * k)]);
    const Scalar error = r.length - shared[rod_];
    const Scalar information = rod_information_ * loss.weight(rod_information_ * error * error);
    for (int i = 0; i < kSize; ++i) {
      const Scalar slope = (i < 3 ? -1 : 1) * information * r.direction[i % 3];
      gradient_[std::size_t(kSize * k + i)] += slope * error;
      for (int j = 0; j < kSize; ++j) {
        diagonal(k, i, j) += slope * (j < 3 ? -1 : 1) * r.direction[j % 3];
      }
      cross(k, i, rod_column_) -= slope;
    }
    shared_gradient_[std::size_t(rod_column_)] -= information * error;
    shared_information_[std::size_t(rod_column_ * width_ + rod_column_)] += information;
  }

  // out -= sum of weights[m] * row m, the first `count` numbers of rows that are `columns` long
  static void subtract_rows(const Scalar* weights, const Scalar* rows, int columns, int count,
                            Scalar* out) {
    for (int j = 0; j < count; ++j) {
      Scalar sum = 0;
      for (int m = 0; m < kSize; ++m) sum += weights[m] * rows[columns * m + j];
      out[j] -= sum;
    }
  }

  // out -= factor * row
  static void subtract(Scalar factor, const Scalar* row, int columns, Scalar* out) {
    for (int j = 0; j < columns; ++j) out[j] -= factor * row[j];
  }

  // Lower triangle of the symmetric a by Cholesky, in place.
  static bool cholesky(Scalar* a) {
    for (int j = 0; j < kSize; ++j) {
      Scalar pivot = a[kSize * j + j];
      for (int m = 0; m < j; ++m) pivot -= a[kSize * j + m] * a[kSize * j + m];
      if (!(pivot > 0)) return false;
      pivot = std::sqrt(pivot);
      a[kSize * j + j] = pivot;
      for (int i = j + 1; i < kSize; ++i) {
        Scalar sum = a[kSize * i + j];
        for (int m = 0; m < j; ++m) sum -= a[kSize * i + m] * a[kSize * j + m];
        a[kSize * i + j] = sum / pivot;
      }
    }
    return true;
  }

  // Rows of b (kSize x columns) become those of L^-1 b.
  static void forward(const Scalar* lower, Scalar* b, int columns) {
    for (int i = 0; i < kSize; ++i) {
      Scalar* row = b + columns * i;
      for (int j = 0; j < i; ++j) subtract(lower[kSize * i + j], b + columns * j, columns, row);
      const Scalar inverse = 1 / lower[kSize * i + i];
      for (int c = 0; c < columns; ++c) row[c] *= inverse;
    }
  }

  int knots_;
  Scalar range_std_, rod_information_;
  std::array<Scalar, 3> knot_information_;
  std::vector<Scalar> motion_information_;
  std::vector<Row> rows_;
  std::vector<int> border_;  // the shared parameter of each column
  int width_ = 0;
  int rod_ = -1;  // among the shared parameters
  int rod_column_ = -1;
  std::vector<Scalar> positions_, trial_, step_, gradient_;
  std::vector<Scalar> diagonal_, coupling_, cross_;           // normal equations, row by row
  std::vector<Scalar> factor_, link_, eliminated_, reduced_;  // and what elimination makes of them
  std::vector<Scalar> shared_information_, shared_gradient_, border_step_;
};

}  // namespace tensegrity::ranging
