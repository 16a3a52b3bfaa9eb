"""The mounting of the IMU that a recording fits best: Newton's method on the filter's misfit.

The filter takes the IMU's place and direction on the rod as given, but what it predicts depends on
them: a tilted IMU puts the feet at wrong heights, a displaced one moves them when the rod turns.
Its squared normalised innovations add up to minus twice the log-likelihood of the recording. They
are smooth in the three parameters, so that a quadratic through ten replays leads to the minimum.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tensegrity.calibration.evidence import MOUNTING, Recording
from tensegrity.errors import InputError

FloatArray = NDArray[np.float64]

MOUNTING_STD = np.array([0.03, 0.05, 0.05])
"""Standard deviation of the mounting about what the robot states [m], [rad], [rad]: a hand's
breadth and a few degrees."""

_DIFFERENCE = 0.01  # of the finite differences [m], [rad]: well above the filter's jitter
_CONVERGED = 1.0  # of a standard deviation: what is left after such a step is far less
# What feet that sink in and slip do to the point a rod seems to turn about: with it the errors of
# simulated recordings are as large as their standard deviations say [m], [rad], [rad].
_MODEL_STD = np.array([0.003, 0.0, 0.0])
_ROUNDS = 8
_LONGEST_STEP = 0.03  # [m], [rad]: as far as the quadratic is believed
_DAMPINGS = (0.0, 0.1, 1.0, 10.0, 100.0)  # of the mean curvature (Levenberg)
ROUND_REPLAYS = 2 + 2 * len(MOUNTING) + len(MOUNTING)


@dataclass(frozen=True)
class Mounting:
    """What the recordings say about the mounting.

    * ``estimate`` (3,) and ``covariance`` (3, 3) in the order of
      :data:`~tensegrity.calibration.evidence.MOUNTING`
    * ``variance_factor`` how many times larger, on average, that covariance is than the filter's
      innovations would make it were they independent and of unit variance; at least 1
    * ``offset_slopes``: for each recording, the derivative (9, 3) of the filter's cable offsets
      with respect to the mounting
    """

    estimate: FloatArray
    covariance: FloatArray
    variance_factor: float
    offset_slopes: list[FloatArray]


def find_mounting(
    recordings: Sequence[Recording],
    start: FloatArray,
    expected_offsets: FloatArray,
    replayed: Callable[[], None],
) -> Mounting:
    """The mounting that fits all recordings best, from ``start`` (3,), which is the mean of its
    prior. ``replayed`` is called after every replay of a recording.

    Raises :class:`InputError` when it cannot be found.
    """
    prior = np.diag(MOUNTING_STD**-2)

    def misfit(mounting: FloatArray) -> float:
        total = float((mounting - start) @ prior @ (mounting - start))
        for recording in recordings:
            total += float(recording.replay(mounting, expected_offsets).misfit.sum())
            replayed()
        return total

    centre, lowest = start, misfit(start)
    for _ in range(_ROUNDS):
        quadratics = [_Quadratic(one, centre, expected_offsets, replayed) for one in recordings]
        # Where the misfit bends downward, Newton's step leads uphill: its size alone counts.
        values, vectors = np.linalg.eigh(np.sum([one.curvature for one in quadratics], axis=0))
        curvature = 2 * prior + (vectors * np.abs(values)) @ vectors.T
        slopes = np.vstack([one.slopes for one in quadratics])
        inverse = np.linalg.inv(curvature)
        # Innovations are neither of unit variance nor independent: the spread of the blocks'
        # slopes says how uncertain the minimum is, whatever the filter's own noises (Huber's
        # sandwich).
        spread = slopes - slopes.mean(axis=0)
        blocks = len(spread)
        scatter = 4 * prior + spread.T @ spread * blocks / max(blocks - len(MOUNTING), 1)
        covariance = inverse @ scatter @ inverse
        slope = slopes.sum(axis=0) + 2 * prior @ (centre - start)
        found = None
        for damping in _DAMPINGS:
            damped = curvature + damping * np.trace(curvature) / 3 * np.eye(3)
            step = -np.linalg.solve(damped, slope)
            if np.abs(step).max() > _LONGEST_STEP:
                continue
            there_misfit = misfit(centre + step)
            if there_misfit < lowest:
                found, lowest = centre + step, there_misfit
                break
        small = np.all(np.abs(inverse @ slope) < _CONVERGED * np.sqrt(np.diag(covariance)))
        if found is None or small:
            return Mounting(
                centre if found is None else found,
                covariance + np.diag(_MODEL_STD**2),
                max(1.0, float(np.trace(curvature @ covariance)) / 2 / len(MOUNTING)),
                [one.offset_slopes for one in quadratics],
            )
        centre = found
    raise InputError(
        f"the IMU's mounting did not settle in {_ROUNDS} steps",
        hint="start from a robot.yaml closer to the truth, or record a longer slow roll",
    )


class _Quadratic:
    """The misfit of one recording around a mounting, from finite differences: ``slopes``
    (blocks, 3) of its blocks, ``curvature`` (3, 3) of its sum, ``offset_slopes`` (9, 3)."""

    def __init__(
        self,
        recording: Recording,
        centre: FloatArray,
        expected_offsets: FloatArray,
        replayed: Callable[[], None],
    ) -> None:
        def at(step: FloatArray) -> tuple[FloatArray, FloatArray]:
            evidence = recording.replay(centre + step, expected_offsets)
            replayed()
            return evidence.misfit, evidence.offsets

        axes = _DIFFERENCE * np.eye(len(MOUNTING))
        middle = at(np.zeros(len(MOUNTING)))[0].sum()
        ahead, ahead_offsets = zip(*(at(axis) for axis in axes), strict=True)
        behind, behind_offsets = zip(*(at(-axis) for axis in axes), strict=True)
        self.slopes = np.subtract(ahead, behind).T / (2 * _DIFFERENCE)
        self.offset_slopes = np.subtract(ahead_offsets, behind_offsets).T / (2 * _DIFFERENCE)
        rise = np.sum(ahead, axis=1) - middle
        curvature = np.diag(rise + np.sum(behind, axis=1) - middle)
        for i, j in ((0, 1), (0, 2), (1, 2)):
            both = at(axes[i] + axes[j])[0].sum() - middle
            curvature[i, j] = curvature[j, i] = both - rise[i] - rise[j]
        self.curvature = curvature / _DIFFERENCE**2
