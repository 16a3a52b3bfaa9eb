"""Whether an estimator is as uncertain as it says: normalised squares and their 95 % bands.

An error e with covariance P, and an innovation z with covariance S, of m degrees of freedom:
e^T P^-1 e and z^T S^-1 z follow a chi-square distribution with m degrees of freedom when the
covariances are right (Bar-Shalom, Li, Kirubarajan 2001, "Estimation with Applications to Tracking
and Navigation", section 5.4). Both are divided by m here, so that 1 is the mean of a consistent
filter whatever m is. Larger: over-confident. Smaller: the covariances are too large.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import chi2

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

BAND_PROBABILITY = 0.95
"""Share of the samples of a consistent filter that lie inside the band."""
# Beyond this a covariance is singular to the nine digits that a run's files keep.
_LARGEST_CONDITION = 1e12


@dataclass(frozen=True)
class Innovations:
    """Normalised innovation squared of the newest update at M stamps, NaN before the first.

    ``nis`` (M,) per degree of freedom, ``degrees_of_freedom`` (M,).
    """

    nis: FloatArray
    degrees_of_freedom: FloatArray

    @property
    def updates(self) -> BoolArray:
        """The stamps that brought an update (M,): between updates the value is repeated, and
        counting it again would give some updates more weight than others."""
        return np.isfinite(self.nis) & (np.diff(self.nis, prepend=np.nan) != 0.0)


def normalised_error_squared(error: FloatArray, covariance: FloatArray) -> FloatArray:
    """e^T P^-1 e per degree of freedom (M,), NaN where P has no inverse.

    ``error`` (M, k) and ``covariance`` (M, k, k) in the same frame and units.
    """
    nees = np.full(len(error), np.nan)
    invertible = np.linalg.cond(covariance) < _LARGEST_CONDITION
    e = error[invertible, :, None]
    squared = e.transpose(0, 2, 1) @ np.linalg.solve(covariance[invertible], e)
    nees[invertible] = squared[:, 0, 0] / error.shape[1]
    return nees


def band(degrees_of_freedom: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Lower and upper end of the two-sided 95 % band of a chi-square per degree of freedom.

    For single samples: consecutive errors of a filter are correlated, so that the mean over a run
    may not be held against the narrower band of that many independent samples. NaN where there is
    no degree of freedom.
    """
    m = np.asarray(degrees_of_freedom, dtype=np.float64)
    m = np.where(m > 0, m, np.nan)
    tail = (1.0 - BAND_PROBABILITY) / 2.0
    return chi2.ppf(tail, m) / m, chi2.isf(tail, m) / m
