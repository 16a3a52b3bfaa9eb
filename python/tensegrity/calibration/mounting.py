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

from tensegrity.calibration.evidence import MOUNTING, Evidence, Recording
from tensegrity.errors import InputError

FloatArray = NDArray[np.float64]

_DIFFERENCE = 0.01  # of the finite differences [m], [rad]: well above the filter's jitter
_LONGEST_STEP = 0.03  # [m], [rad]: as far as the quadratic is believed
_CONVERGED = 0.5  # of a standard deviation: a further step would be noise
_ROUNDS = 8
ROUND_REPLAYS = 1 + 2 * len(MOUNTING) + len(MOUNTING)


@dataclass(frozen=True)
class Mounting:
    """``estimate`` (3,) and ``covariance`` (3, 3) in the order of
    :data:`~tensegrity.calibration.evidence.MOUNTING`; ``offset_slopes``: for each recording, the
    derivative (9, 3) of the filter's cable offsets with respect to the mounting."""

    estimate: FloatArray
    covariance: FloatArray
    offset_slopes: list[FloatArray]


def find_mounting(
    recordings: Sequence[Recording],
    start: FloatArray,
    expected_offsets: FloatArray,
    replayed: Callable[[], None],
) -> Mounting:
    """The mounting that fits all recordings best, from ``start`` (3,). ``replayed`` is called after
    every replay of a recording.

    Raises :class:`InputError` when the recordings do not determine it.
    """
    estimate = start
    for _ in range(_ROUNDS):
        quadratics = [_Quadratic(one, estimate, expected_offsets, replayed) for one in recordings]
        curvature = sum((one.curvature for one in quadratics), np.zeros((3, 3)))
        slopes = np.vstack([one.slopes for one in quadratics])
        if np.linalg.eigvalsh(curvature)[0] <= 0:
            raise InputError(
                "the recordings do not determine how the IMU is mounted: other mountings fit alike",
                hint="record a longer slow roll over several faces, in a curve as well",
            )
        inverse = np.linalg.inv(curvature)
        # Innovations are neither of unit variance nor independent: the spread of the blocks'
        # slopes says how uncertain the minimum is, whatever the filter's own noises (Huber's
        # sandwich).
        spread = slopes - slopes.mean(axis=0)
        blocks = len(spread)
        scatter = spread.T @ spread * blocks / max(blocks - len(MOUNTING), 1)
        covariance = inverse @ scatter @ inverse
        step = -inverse @ slopes.sum(axis=0)
        estimate = estimate + np.clip(step, -_LONGEST_STEP, _LONGEST_STEP)
        if np.all(np.abs(step) < _CONVERGED * np.sqrt(np.diag(covariance))):
            return Mounting(estimate, covariance, [one.offset_slopes for one in quadratics])
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
        def at(*steps: FloatArray) -> Evidence:
            evidence = recording.replay(centre + sum(steps), expected_offsets)
            replayed()
            return evidence

        axes = _DIFFERENCE * np.eye(len(MOUNTING))
        middle = at(np.zeros(len(MOUNTING)))
        ahead, behind = [at(axis) for axis in axes], [at(-axis) for axis in axes]
        pairs = list(zip(ahead, behind, strict=True))
        self.slopes = np.column_stack([a.misfit - b.misfit for a, b in pairs]) / (2 * _DIFFERENCE)
        self.offset_slopes = np.column_stack([a.offsets - b.offsets for a, b in pairs]) / (
            2 * _DIFFERENCE
        )
        change = [a.misfit.sum() - middle.misfit.sum() for a in ahead]
        self.curvature = np.diag([a.misfit.sum() + b.misfit.sum() for a, b in pairs])
        self.curvature -= 2 * middle.misfit.sum() * np.eye(len(MOUNTING))
        for i, j in ((0, 1), (0, 2), (1, 2)):
            both = at(axes[i], axes[j]).misfit.sum() - middle.misfit.sum()
            self.curvature[i, j] = self.curvature[j, i] = both - change[i] - change[j]
        self.curvature /= _DIFFERENCE**2
