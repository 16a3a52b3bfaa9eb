"""Cable offsets from the filter's states, with the covariance that the filter does not tell.

For a linear filter with the prior N(m, s^2 I) of the offsets, the posterior mean moves by
C / s^2 times what the prior mean moves: C is the posterior covariance. Replaying a recording with
the mean moved by each cable in turn gives C column by column. What the recording says nothing about
follows the prior entirely, and keeps its standard deviation s. The filter's noises are not exact:
its C is enlarged by the factor by which it is too sure of the mounting.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tensegrity.calibration.evidence import MOUNTING, Recording
from tensegrity.calibration.mounting import Mounting

FloatArray = NDArray[np.float64]

# Feet sink into the ground by some millimetres that differ with their load, and rods are not known
# exactly either: no offset is known better, however long the recording.
_LEAST_STD_M = 0.001


@dataclass(frozen=True)
class Offsets:
    """``estimate`` (9,) [m] and ``covariance`` (9, 9) [m^2] of the cable offsets."""

    estimate: FloatArray
    covariance: FloatArray


def find_offsets(
    recordings: Sequence[Recording],
    mounting: Mounting,
    expected: FloatArray,
    expected_std: float,
    replayed: Callable[[], None],
) -> Offsets:
    """Offsets from all recordings together, with the prior ``expected`` (9,) and ``expected_std``
    [m] counted once. The uncertainty of the ``mounting`` is part of theirs."""
    count = len(expected)
    prior = np.eye(count) / expected_std**2
    information, weighted = prior.copy(), np.zeros(count)
    slopes = np.zeros((count, len(MOUNTING)))
    for recording, offset_slopes in zip(recordings, mounting.offset_slopes, strict=True):
        offsets, covariance = _posterior(recording, mounting, expected, expected_std, replayed)
        own = np.linalg.inv(covariance)
        information += own - prior
        weighted += own @ (offsets - expected)
        slopes += own @ offset_slopes
    joint = np.linalg.inv(information)
    to_offsets = joint @ slopes
    return Offsets(
        expected + joint @ weighted, joint + to_offsets @ mounting.covariance @ to_offsets.T
    )


def _posterior(
    recording: Recording,
    mounting: Mounting,
    expected: FloatArray,
    expected_std: float,
    replayed: Callable[[], None],
) -> tuple[FloatArray, FloatArray]:
    """The filter's offsets (9,) and their covariance (9, 9) for a known mounting."""

    def offsets(prior_mean: FloatArray) -> FloatArray:
        evidence = recording.replay(mounting.estimate, prior_mean)
        replayed()
        return evidence.offsets

    middle = offsets(expected)
    step = expected_std / 2
    response = np.column_stack(
        [(offsets(expected + step * axis) - middle) / step for axis in np.eye(len(expected))]
    )
    # Symmetric, between "known" and "not observed at all", but for the filter's nonlinearity.
    values, vectors = np.linalg.eigh((response + response.T) / 2)
    variances = mounting.variance_factor * values * expected_std**2
    variances = np.clip(variances, _LEAST_STD_M**2, expected_std**2)
    return middle, (vectors * variances) @ vectors.T
