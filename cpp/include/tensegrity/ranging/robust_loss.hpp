// Robust losses of squared residuals, as iteratively reweighted least squares uses them.
#pragma once

#include <cmath>

namespace tensegrity::ranging {

enum class LossKind { kSquares, kHuber, kCauchy };

// rho(s) of a squared whitened residual s; both robust losses equal s for s << scale^2.
template <typename Scalar>
struct RobustLoss {
  LossKind kind = LossKind::kCauchy;
  Scalar scale = 1;  // residual at which the loss turns, in standard deviations

  Scalar value(Scalar squared) const {
    const Scalar turn = scale * scale;
    switch (kind) {
      case LossKind::kHuber:
        return squared <= turn ? squared : 2 * scale * std::sqrt(squared) - turn;
      case LossKind::kCauchy:
        return turn * std::log1p(squared / turn);
      case LossKind::kSquares:
        break;
    }
    return squared;
  }

  // d rho / d s: the factor of the squared residual in the reweighted problem.
  Scalar weight(Scalar squared) const {
    const Scalar turn = scale * scale;
    switch (kind) {
      case LossKind::kHuber:
        return squared <= turn ? Scalar(1) : scale / std::sqrt(squared);
      case LossKind::kCauchy:
        return turn / (turn + squared);
      case LossKind::kSquares:
        break;
    }
    return 1;
  }
};

}  // namespace tensegrity::ranging
