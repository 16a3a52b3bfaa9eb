"""The two experiments of C = Caluwaerts et al. 2016, §V, on simulated recordings.

``superball-local`` (C Fig. 6): the robot stands while two actuators move; paths of two end caps.
``superball-global`` (C Figs. 7, 8): it rolls over several faces, tracked with several settings.

The offsets of the ranges are calibrated first (C §III-C), from a recording of the rolling robot: a
robot that stands says little about them. The anchors are surveyed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from tensegrity.ranging.calibration import calibrate_ranges
from tensegrity.ranging.calibration_model import CalibrationModel
from tensegrity.ranging.recording import Anchors, Offsets
from tensegrity.ranging.sequence import RangingSequence
from tensegrity.simulation.superball import SuperballOptions, simulate_superball
from tensegrity.simulation.superball.motion import Experiment
from tensegrity.tracking import (
    Track,
    TrackErrors,
    TrackSettings,
    paper_settings,
    track,
    track_errors,
)

FloatArray = NDArray[np.float64]

SPURIOUS_S = 60.0
"""When one IMU of the rolling robot delivers a sample of a saturated gyroscope (C Fig. 8)."""

FACE_DEADLINE_S = 2.0
"""The face that is down at the start has to be found after this time [s]."""

SETTLED_S = 5.0
"""Errors count from here on: C lets the filter settle first [s]."""


class Setting(StrEnum):
    """What the filter is given (C §V-C), and the filter as published."""

    FULL = "full"
    NO_IMU = "no IMU"
    CONSTANT_OFFSET = "constant offset"
    FOUR_ANCHORS = "4 base stations"
    PUBLISHED = "published filter"


@dataclass(frozen=True)
class Outcome:
    """One recording, tracked with one setting."""

    setting: Setting
    seed: int
    sequence: RangingSequence
    track: Track
    errors: TrackErrors

    @property
    def settled(self) -> TrackErrors:
        """Errors from :data:`SETTLED_S` after the start of the recording on."""
        late = self._seconds >= SETTLED_S
        errors = self.errors
        return TrackErrors(
            t_ns=errors.t_ns[late],
            nodes=errors.nodes[late],
            centre_of_mass=errors.centre_of_mass[late],
            nees=errors.nees[late],
            face_right=errors.face_right[late],
        )

    @property
    def found_face(self) -> bool:
        """Whether the face that is down was right within :data:`FACE_DEADLINE_S`."""
        return bool(self.errors.face_right[self._seconds <= FACE_DEADLINE_S][-1:].any())

    @property
    def _seconds(self) -> FloatArray:
        """Of the updates, from the first range on [s]."""
        return (self.errors.t_ns - self.sequence.ranges.t_ns[0]) * 1e-9


def run_experiment(
    experiment: Experiment,
    settings: list[Setting],
    seed: int,
    duration: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Outcome]:
    """Simulate one recording, calibrate its offsets and track it with every setting.

    Offsets belong to the seed: both experiments of one seed have the same. ``duration`` of each
    recording [s]; None is that of :func:`simulate_superball`.
    """
    report = progress or (lambda fraction: None)
    rolling = simulate_superball(
        Experiment.ROLLING,
        SuperballOptions(seed=seed, duration=duration, spurious_imu=SPURIOUS_S),
        progress=lambda fraction: report(0.4 * fraction),
    )
    sequence = rolling
    if experiment is Experiment.LOCAL:
        sequence = simulate_superball(
            experiment,
            SuperballOptions(seed=seed, duration=duration),
            progress=lambda fraction: report(0.4 + 0.1 * fraction),
        )
    calibration = calibrate_ranges(
        rolling.ranges, rolling.anchors, CalibrationModel(offsets="pair")
    )
    report(0.6)
    assert sequence.endcaps is not None  # a simulation knows the truth
    outcomes = []
    for count, setting in enumerate(settings, start=1):
        given, offsets, chosen = _given(
            setting, sequence, calibration.offsets, float(np.median(calibration.offset_std))
        )
        result = track(given, offsets=offsets, settings=chosen)
        outcomes.append(
            Outcome(setting, seed, sequence, result, track_errors(result, sequence.endcaps))
        )
        report(0.6 + 0.4 * count / len(settings))
    return outcomes


def _given(
    setting: Setting, sequence: RangingSequence, offsets: Offsets, offset_std: float
) -> tuple[RangingSequence, Offsets, TrackSettings]:
    """What the filter gets of a recording and its calibration."""
    settings = TrackSettings(offset_std=offset_std)
    if setting is Setting.PUBLISHED:
        return sequence, offsets, paper_settings()
    if setting is Setting.NO_IMU:
        return replace(sequence, imus={}), offsets, settings
    if setting is Setting.CONSTANT_OFFSET:
        mean = np.full_like(offsets.offset_m, offsets.offset_m.mean())
        spread = float(offsets.offset_m.std())
        return sequence, replace(offsets, offset_m=mean), TrackSettings(offset_std=spread)
    if setting is Setting.FOUR_ANCHORS:
        return _with_anchors(sequence, sequence.anchors.ids[::2]), offsets, settings
    return sequence, offsets, settings


def _with_anchors(sequence: RangingSequence, ids: NDArray[np.int64]) -> RangingSequence:
    """The recording as if there had been no other anchors."""
    kept = np.isin(sequence.anchors.ids, ids)
    anchors = Anchors(sequence.anchors.ids[kept], sequence.anchors.position_m[kept])
    ranges = sequence.ranges.where(np.isin(sequence.ranges.anchor, ids))
    return replace(sequence, anchors=anchors, ranges=ranges)
