"""What every solver of the calibration returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tensegrity.ranging.calibration_model import OffsetTerms

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Residuals:
    """Of the N ranges that a solver used: ``t`` [s] from the first range of the recording or steps,
    ``node``, ``anchor`` and ``residual_m``, predicted minus measured [m]; all (N,)."""

    t: FloatArray
    node: IntArray
    anchor: IntArray
    residual_m: FloatArray


@dataclass(frozen=True)
class Solution:
    """A minimum of the calibration's cost.

    * ``anchors_m`` (A, 3), ``terms`` of the offsets and their values ``offset_terms_m``, ``rods``
      and the distances ``rod_lengths_m`` between their modules [m]
    * ``covariance`` (P, P) of all these in this order [m^2], NaN where it is not known
    * ``free_motions`` of the whole that nothing holds, in words
    * ``rival_m``: how far the anchors of another solution that fits about as well are off [m]
    * ``knot_t`` (K,) and positions (K, 3) of the ``modules`` by number [m]
    * ``residuals`` of the ranges
    """

    anchors_m: FloatArray
    terms: OffsetTerms
    offset_terms_m: FloatArray
    rods: tuple[tuple[int, ...], ...]
    rod_lengths_m: FloatArray
    covariance: FloatArray
    free_motions: tuple[str, ...]
    rival_m: float
    knot_t: FloatArray
    modules: dict[int, FloatArray]
    residuals: Residuals
    converged: bool
    iterations: int
