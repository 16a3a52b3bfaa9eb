// The unscented Kalman filter with additive noise, for any state of fixed dimension L.
//
// The process and the measurement are callables on all sigma points at once: matrices with one row
// per point, so that the points of one coordinate are contiguous and a process can be vectorised
// across them. Measurements are scalar rows that come and go: every call brings as many as there
// are, rows whose innovation fails the gate are left out, the others correct jointly.
//
//   UnscentedFilter<double> filter(L, capacity, settings);
//   filter.set(mean, covariance);
//   filter.predict([&](auto points) { ... ; return true; }, process_noise);
//   filter.correct([&](const auto& points, auto predicted) { ... }, z, variances, gate);
//
// Two forms with the same interface. `kCovariance` keeps P; `kSquareRoot` keeps a triangular root S
// (S S' = P) and changes it by QR and rank-one updates (van der Merwe & Wan 2001), which holds
// twice the digits: for single precision, or states whose variances differ by more than 1e10.
//
// Memory is taken in the constructor, none afterwards. Whatever comes in, the mean stays finite
// and the covariance finite, symmetric and positive semidefinite (the covariance form: to the
// rounding of the covariance that a correction subtracts from).
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "tensegrity/types.hpp"
#include "tensegrity/ukf/dense.hpp"
#include "tensegrity/ukf/sigma_points.hpp"

namespace tensegrity::ukf {

enum class Form : std::uint8_t { kCovariance, kSquareRoot };

template <typename Scalar>
struct UnscentedSettings {
  Scalar alpha = Scalar(0.0139);  // C §IV-B
  Scalar beta = Scalar(2);
  Scalar kappa = Scalar(0);
  Weights weights = Weights::kScaled;
  Form form = Form::kCovariance;
  // Draw new points from the predicted covariance before a correction, so that they include the
  // process noise. Without, a measurement sees the propagated points.
  bool redraw = true;
};

template <typename Scalar>
class UnscentedFilter {
 public:
  // `capacity`: the largest number of rows of one correction.
  UnscentedFilter(int dimension, int capacity, const UnscentedSettings<Scalar>& settings = {})
      : settings_(settings),
        weights_(sigma_weights(settings.weights, dimension, settings.alpha, settings.beta,
                               settings.kappa)),
        dimension_(dimension),
        capacity_(capacity),
        mean_(VectorX<Scalar>::Zero(dimension)),
        covariance_(MatrixX<Scalar>::Zero(dimension, dimension)),
        root_(MatrixX<Scalar>::Zero(dimension, dimension)),
        points_(MatrixX<Scalar>::Zero(2 * dimension + 1, dimension)),
        predicted_(MatrixX<Scalar>::Zero(2 * dimension + 1, capacity)),
        stack_(form_is_root() ? 3 * dimension + 1 : 0, dimension),
        joint_(form_is_root() ? dimension + capacity : 0, dimension + capacity),
        noise_root_(form_is_root() ? dimension : 0, dimension),
        shift_(VectorX<Scalar>::Zero(dimension)),
        next_mean_(VectorX<Scalar>::Zero(dimension)),
        root_rows_(MatrixX<Scalar>::Zero(dimension, dimension)),
        slopes_(MatrixX<Scalar>::Zero(dimension, capacity)),
        cross_(MatrixX<Scalar>::Zero(dimension, capacity)),
        gain_(MatrixX<Scalar>::Zero(capacity, dimension)),
        innovation_covariance_(MatrixX<Scalar>::Zero(capacity, capacity)),
        innovation_root_(MatrixX<Scalar>::Zero(capacity, capacity)),
        row_shift_(VectorX<Scalar>::Zero(capacity)),
        innovation_(VectorX<Scalar>::Zero(capacity)),
        innovation_variance_(VectorX<Scalar>::Zero(capacity)),
        used_innovation_(VectorX<Scalar>::Zero(capacity)),
        used_variance_(VectorX<Scalar>::Zero(capacity)),
        accepted_(VectorX<Scalar>::Zero(capacity).template cast<bool>()) {}

  int dimension() const { return dimension_; }
  int capacity() const { return capacity_; }
  const UnscentedSettings<Scalar>& settings() const { return settings_; }

  // Starts from a mean and a covariance (its lower triangle is read). kNotFinite: nothing is done.
  Status set(const ConstVectorRef<Scalar>& mean, const ConstMatrixRef<Scalar>& covariance) {
    if (mean.size() != dimension_ || covariance.rows() != dimension_ ||
        covariance.cols() != dimension_) {
      return Status::kOutOfRange;
    }
    if (!mean.allFinite() || !covariance.allFinite()) return Status::kNotFinite;
    if (!(covariance.diagonal().minCoeff() >= 0)) return Status::kOutOfRange;
    mean_ = mean;
    cholesky<Scalar>(covariance, root_);
    root_is_current_ = true;
    if (!form_is_root()) take_covariance(covariance);
    points_are_drawn_ = false;
    return Status::kOk;
  }

  // Replaces the mean, the covariance stays: for a constraint that a linear correction misses to
  // second order. kNotFinite: nothing is done.
  Status move(const ConstVectorRef<Scalar>& mean) {
    if (mean.size() != dimension_) return Status::kOutOfRange;
    if (!mean.allFinite()) return Status::kNotFinite;
    mean_ = mean;
    points_are_drawn_ = false;
    return Status::kOk;
  }

  const VectorX<Scalar>& mean() const { return mean_; }
  // P. In the square-root form it is the product of the root, made for every call.
  MatrixX<Scalar> covariance() const {
    if (!form_is_root()) return covariance_;
    return root_ * root_.transpose();
  }
  // P(i, j), of either form.
  Scalar covariance(int i, int j) const {
    if (!form_is_root()) return covariance_(i, j);
    const int n = std::min(i, j) + 1;
    return root_.row(i).head(n).dot(root_.row(j).head(n));
  }

  // x <- f(x) + w, w of covariance `noise` (L x L, positive semidefinite; its lower triangle is
  // read). `process(points)` maps the (2L+1) x L sigma points in place and returns whether it
  // could. If it could not, or a point is not finite, the mean stays, the noise is added:
  // kNotFinite.
  template <typename Process>
  Status predict(const Process& process, const ConstMatrixRef<Scalar>& noise) {
    if (!noise.allFinite()) return Status::kNotFinite;
    draw_points();
    const bool good = process(MatrixRef<Scalar>(points_)) && points_.allFinite();
    if (!good || !take_mean()) {
      add_noise(noise);
      points_are_drawn_ = false;
      return Status::kNotFinite;
    }
    if (form_is_root()) {
      predict_root(noise);
    } else {
      predict_covariance(noise);
    }
    if (!settings_.redraw) {
      points_.bottomRows(2 * dimension_).rowwise() += points_.row(0);
      points_are_drawn_ = true;
    } else {
      points_are_drawn_ = false;
    }
    return Status::kOk;
  }

  // Corrects by z = h(x) + v, v independent with `variances` (> 0), on as many rows as z has, up to
  // the capacity. `measure(points, predicted)` writes h of every sigma point, (2L+1) x rows. Rows
  // with nu^2 > gate * s, s the variance of the innovation nu, are left out, and so are rows
  // that are not finite. kRejected: there were rows, none could be used; nothing changed.
  template <typename Measure>
  Status correct(const Measure& measure, const ConstVectorRef<Scalar>& z,
                 const ConstVectorRef<Scalar>& variances,
                 Scalar gate = std::numeric_limits<Scalar>::infinity()) {
    rows_ = 0;
    used_ = 0;
    squared_distance_ = 0;
    if (z.size() > capacity_ || variances.size() != z.size()) return Status::kOutOfRange;
    rows_ = int(z.size());
    if (rows_ == 0) return Status::kOk;
    if (!points_are_drawn_) draw_points();
    measure(ConstMatrixRef<Scalar>(points_), MatrixRef<Scalar>(predicted_.leftCols(rows_)));
    choose_rows(z, variances, gate);
    points_are_drawn_ = false;
    if (used_ == 0) return Status::kRejected;
    const bool good = settings_.redraw ? correct_with_slopes() : correct_with_cross();
    return good ? Status::kOk : Status::kNotFinite;
  }

  // ---- of the last correction

  int rows() const { return rows_; }
  int used() const { return used_; }
  bool accepted(int row) const { return accepted_[row]; }
  Scalar innovation(int row) const { return innovation_[row]; }
  // Variance of the innovation; not positive for a row that was not finite.
  Scalar innovation_variance(int row) const { return innovation_variance_[row]; }
  // nu' S^-1 nu of the rows that were used: chi-square distributed with used() degrees of freedom.
  Scalar squared_distance() const { return squared_distance_; }

 private:
  bool form_is_root() const { return settings_.form == Form::kSquareRoot; }

  void take_covariance(const ConstMatrixRef<Scalar>& covariance) {
    covariance_ = covariance;
    mirror_lower<Scalar>(covariance_);
  }

  // Rows of points_: the centre, then plus, then minus each column of the root.
  void draw_points() {
    if (!root_is_current_) {
      cholesky<Scalar>(covariance_, root_);
      root_is_current_ = true;
    }
    for (int j = 0; j < dimension_; ++j) {
      const Scalar centre = mean_[j];
      Scalar* column = &points_(0, j);
      column[0] = centre;
      for (int i = 0; i < dimension_; ++i) {
        const Scalar step = weights_.spread * root_(j, i);
        column[1 + i] = centre + step;
        column[1 + dimension_ + i] = centre - step;
      }
    }
    shift_.setZero();
    points_are_drawn_ = true;
  }

  // Turns the points behind the first into deviations from it, and finds the mean. False, with the
  // mean as it was, when numbers overflow.
  bool take_mean() {
    const int others = 2 * dimension_;
    Scalar size = 0;
    for (int j = 0; j < dimension_; ++j) {
      auto deviations = points_.col(j).tail(others);
      deviations.array() -= points_(0, j);
      shift_[j] = weights_.outer * deviations.sum();
      next_mean_[j] = points_(0, j) + shift_[j];
      size += weights_.outer * deviations.squaredNorm() + shift_[j] * shift_[j];
    }
    if (!std::isfinite(size) || !next_mean_.allFinite()) return false;
    mean_ = next_mean_;
    return true;
  }

  void predict_covariance(const ConstMatrixRef<Scalar>& noise) {
    const auto deviations = points_.bottomRows(2 * dimension_);
    covariance_ = noise;
    add_product<Scalar>(covariance_, deviations, deviations, weights_.outer, true);
    for (int j = 0; j < dimension_; ++j) {
      const Scalar factor = weights_.centre * shift_[j];
      for (int i = j; i < dimension_; ++i) covariance_(i, j) += factor * shift_[i];
    }
    mirror_lower<Scalar>(covariance_);
    root_is_current_ = false;
  }

  void predict_root(const ConstMatrixRef<Scalar>& noise) {
    const int n = dimension_;
    cholesky<Scalar>(noise, noise_root_);
    stack_.topRows(2 * n) = std::sqrt(weights_.outer) * points_.bottomRows(2 * n);
    stack_.middleRows(2 * n, n) = noise_root_.transpose();
    stack_.row(3 * n) = std::sqrt(std::max(weights_.centre, Scalar(0))) * shift_.transpose();
    triangularise<Scalar>(stack_);
    root_ = stack_.topRows(n).transpose();
    if (weights_.centre < 0) {
      next_mean_ = std::sqrt(-weights_.centre) * shift_;
      rank_one_update<Scalar>(root_, next_mean_, Scalar(-1));
    }
  }

  void add_noise(const ConstMatrixRef<Scalar>& noise) {
    const int n = dimension_;
    if (!form_is_root()) {
      for (int j = 0; j < n; ++j) {
        for (int i = j; i < n; ++i) covariance_(i, j) += noise(i, j);
      }
      mirror_lower<Scalar>(covariance_);
      root_is_current_ = false;
      return;
    }
    cholesky<Scalar>(noise, noise_root_);
    stack_.setZero();
    stack_.topRows(n) = root_.transpose();
    stack_.middleRows(n, n) = noise_root_.transpose();
    triangularise<Scalar>(stack_);
    root_ = stack_.topRows(n).transpose();
  }

  // Innovations and their variances; packs the columns of the rows that pass the gate, as
  // deviations from the centre, to the left of predicted_.
  void choose_rows(const ConstVectorRef<Scalar>& z, const ConstVectorRef<Scalar>& variances,
                   Scalar gate) {
    const int others = 2 * dimension_;
    for (int r = 0; r < rows_; ++r) {
      auto deviations = predicted_.col(r).tail(others);
      const Scalar centre = predicted_(0, r);
      deviations.array() -= centre;
      const Scalar shift = weights_.outer * deviations.sum();
      const Scalar nu = z[r] - (centre + shift);
      const Scalar s = weights_.outer * deviations.squaredNorm() + weights_.centre * shift * shift +
                       variances[r];
      innovation_[r] = nu;
      innovation_variance_[r] = std::isfinite(s) ? s : Scalar(0);
      accepted_[r] =
          variances[r] > 0 && s > 0 && std::isfinite(s) && std::isfinite(nu) && nu * nu <= gate * s;
      if (!accepted_[r]) continue;
      if (used_ != r) predicted_.col(used_) = predicted_.col(r);
      row_shift_[used_] = shift;
      used_innovation_[used_] = nu;
      used_variance_[used_] = variances[r];
      ++used_;
    }
  }

  // Lower triangle of the covariance of the rows in use without the slopes' part: that of the even
  // part of h and of the noise.
  void add_shift_and_noise(MatrixRef<Scalar> s) {
    for (int j = 0; j < used_; ++j) {
      const Scalar factor = weights_.centre * row_shift_[j];
      for (int i = j; i < used_; ++i) s(i, j) += factor * row_shift_[i];
      s(j, j) += used_variance_[j];
    }
  }

  // With x = mean + S xi and xi ~ N(0, I), z = h0 + G' xi + v: the rows of G are half the
  // differences of opposite points, G is what statistical linearisation calls the slope. The even
  // part of h counts as noise. So P_xz = S G, and P = S (I - G S_zz^-1 G') S' afterwards.
  bool correct_with_slopes() {
    const int n = dimension_, m = used_;
    const Scalar slope = weights_.outer * weights_.spread;
    // What the odd part counts in S_zz, in the square-root form without the slopes' share: nothing,
    // with scaled weights.
    const Scalar share = form_is_root() ? slope * slope : Scalar(0);
    const Scalar odd_factor = std::sqrt(std::max(weights_.outer / 2 - share, Scalar(0)));
    const Scalar even_factor = std::sqrt(weights_.outer / 2);
    for (int r = 0; r < m; ++r) {
      Scalar* plus = &predicted_(1, r);
      Scalar* minus = plus + n;
      for (int i = 0; i < n; ++i) {
        const Scalar odd = plus[i] - minus[i], even = plus[i] + minus[i];
        slopes_(i, r) = slope * odd;
        plus[i] = odd_factor * odd;
        minus[i] = even_factor * even;
      }
    }
    auto s = innovation_covariance_.topLeftCorner(m, m);
    s.setZero();
    const auto rows = predicted_.block(1, 0, 2 * n, m);
    add_product<Scalar>(s, rows, rows, Scalar(1), true);
    add_shift_and_noise(s);
    if (form_is_root()) return update_root(m);
    root_rows_ = root_.transpose();
    auto cross = cross_.leftCols(m);
    cross.setZero();
    add_product<Scalar>(cross, root_rows_, slopes_.leftCols(m), Scalar(1));
    return update_by_cross(m);
  }

  // The same with points that do not include the process noise: P_xz from the propagated points.
  bool correct_with_cross() {
    const int n = dimension_, m = used_;
    const auto rows = predicted_.block(1, 0, 2 * n, m);
    auto s = innovation_covariance_.topLeftCorner(m, m);
    s.setZero();
    add_product<Scalar>(s, rows, rows, weights_.outer, true);
    add_shift_and_noise(s);
    auto cross = cross_.leftCols(m);
    cross.setZero();
    points_.bottomRows(2 * n).rowwise() -= points_.row(0);
    add_product<Scalar>(cross, points_.bottomRows(2 * n), rows, weights_.outer);
    cross.noalias() += (weights_.centre * shift_) * row_shift_.head(m).transpose();
    return update_by_cross(m);
  }

  // P <- P - P_xz S_zz^-1 P_zx.
  bool update_by_cross(int m) {
    const auto s = innovation_covariance_.topLeftCorner(m, m);
    auto root = innovation_root_.topLeftCorner(m, m);
    cholesky<Scalar>(s, root);
    if (!(root.diagonal().minCoeff() > 0)) return false;
    auto nu = used_innovation_.head(m);
    solve_lower<Scalar>(root, nu);
    auto w = gain_.topRows(m);  // root^-1 P_zx
    w = cross_.leftCols(m).transpose();
    solve_lower<Scalar>(root, w);
    next_mean_.noalias() = mean_ + w.transpose() * nu;
    squared_distance_ = nu.squaredNorm();
    if (!next_mean_.allFinite() || !w.allFinite()) return false;
    mean_ = next_mean_;
    if (form_is_root()) {
      for (int k = 0; k < m; ++k) {
        next_mean_ = w.row(k);
        rank_one_update<Scalar>(root_, next_mean_, Scalar(-1));
      }
      return true;
    }
    add_product<Scalar>(covariance_, w, w, Scalar(-1), true);
    for (int j = 0; j < dimension_; ++j) covariance_(j, j) = std::max(covariance_(j, j), Scalar(0));
    mirror_lower<Scalar>(covariance_);
    root_is_current_ = false;
    return true;
  }

  // QR of [R~^T/2 0; G I]: with R~ the covariance of what is not slope, the triangle is
  // [S_zz^T/2 W; 0 M'] with W'W + M M' = I, so that S M is the new root.
  bool update_root(int m) {
    const int n = dimension_;
    auto noise = innovation_root_.topLeftCorner(m, m);
    cholesky<Scalar>(innovation_covariance_.topLeftCorner(m, m), noise);
    auto joint = joint_.topLeftCorner(m + n, m + n);
    joint.setZero();
    joint.topLeftCorner(m, m) = noise.transpose();
    joint.bottomLeftCorner(n, m) = slopes_.leftCols(m);
    joint.bottomRightCorner(n, n).diagonal().setOnes();
    triangularise<Scalar>(joint);
    if (!joint.allFinite() || joint.topLeftCorner(m, m).diagonal().cwiseAbs().minCoeff() == 0) {
      return false;
    }
    innovation_root_.topLeftCorner(m, m) = joint.topLeftCorner(m, m).transpose();
    auto nu = used_innovation_.head(m);
    solve_lower<Scalar>(innovation_root_.topLeftCorner(m, m), nu);
    shift_.noalias() = joint.topRightCorner(m, n).transpose() * nu;
    next_mean_ = mean_;
    for (int j = 0; j < n; ++j) {
      next_mean_.tail(n - j) += shift_[j] * root_.col(j).tail(n - j);
    }
    squared_distance_ = nu.squaredNorm();
    if (!next_mean_.allFinite()) return false;
    mean_ = next_mean_;
    // Lower triangular times lower triangular, column by column.
    const auto m_rows = joint.bottomRightCorner(n, n);
    for (int j = 0; j < n; ++j) {
      shift_.setZero();
      for (int k = j; k < n; ++k) shift_.tail(n - k) += m_rows(j, k) * root_.col(k).tail(n - k);
      root_.col(j) = shift_;
      if (root_(j, j) < 0) root_.col(j) *= Scalar(-1);
    }
    return true;
  }

  UnscentedSettings<Scalar> settings_;
  SigmaWeights<Scalar> weights_;
  int dimension_, capacity_;
  VectorX<Scalar> mean_;
  MatrixX<Scalar> covariance_;  // current in the covariance form
  MatrixX<Scalar> root_;        // lower triangular; current when root_is_current_
  MatrixX<Scalar> points_, predicted_;
  MatrixX<Scalar> stack_, joint_, noise_root_;  // of the square-root form
  VectorX<Scalar> shift_, next_mean_;
  MatrixX<Scalar> root_rows_, slopes_, cross_, gain_;
  MatrixX<Scalar> innovation_covariance_, innovation_root_;
  VectorX<Scalar> row_shift_, innovation_, innovation_variance_, used_innovation_, used_variance_;
  Eigen::Matrix<bool, Eigen::Dynamic, 1> accepted_;
  bool root_is_current_ = true;
  bool points_are_drawn_ = false;
  int rows_ = 0, used_ = 0;
  Scalar squared_distance_ = 0;
};

}  // namespace tensegrity::ukf
