"""From recordings to a robot whose IMU and cables are calibrated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tensegrity.calibration.evidence import Evidence, Recording
from tensegrity.calibration.mounting import ROUND_REPLAYS, find_mounting
from tensegrity.calibration.offsets import find_offsets
from tensegrity.config import FilterConfig
from tensegrity.errors import InputError
from tensegrity.robots import Robot
from tensegrity.robots.robot import LARGEST_MISALIGNMENT
from tensegrity.sequence import Sequence as Recorded

FloatArray = NDArray[np.float64]

OFFSET_STD_M = 0.01
"""How large cable offsets are expected to be: standard deviation of the prior [m]."""

_LEAST_TURN_DEG = 90.0
_USUAL_ROUNDS = 3  # of the search for the mounting


@dataclass(frozen=True)
class RobotCalibration:
    """A calibrated robot and how well it is known.

    * ``robot`` with the estimates in ``imu_offset`` [m], ``imu_misalignment`` [rad] and
      ``cable_offsets`` [m]
    * ``mounting_covariance`` (3, 3) of imu_offset and the two angles of imu_misalignment
    * ``cable_offset_covariance`` (9, 9) [m^2], with the part that the mounting's uncertainty adds
    """

    robot: Robot
    mounting_covariance: FloatArray
    cable_offset_covariance: FloatArray

    @property
    def imu_offset_std(self) -> float:
        """Standard deviation of ``robot.imu_offset`` [m]."""
        return float(np.sqrt(self.mounting_covariance[0, 0]))

    @property
    def imu_misalignment_std(self) -> FloatArray:
        """Standard deviations (2,) of ``robot.imu_misalignment`` [rad]."""
        return np.sqrt(np.diag(self.mounting_covariance)[1:])

    @property
    def cable_offset_std(self) -> FloatArray:
        """Standard deviations (9,) of ``robot.cable_offsets`` [m]."""
        return np.sqrt(np.diag(self.cable_offset_covariance))


def calibrate_robot(
    sequences: Sequence[Recorded],
    config: FilterConfig | str | Path = "full",
    offset_std: float = OFFSET_STD_M,
    progress: Callable[[float], None] | None = None,
) -> RobotCalibration:
    """Cable offsets and mounting of the base IMU from recordings of one slowly rolling robot.

    The search starts from what ``sequences[0].robot`` states; ``offset_std`` [m] is the standard
    deviation of the cable offsets about that. ``config`` has to be of a tightly coupled filter.
    ``progress`` is called with the fraction done.

    Raises :class:`InputError` when the recordings are of different robots, when one of them never
    stood still or never rolled, and when they do not determine the mounting.
    """
    config = config if isinstance(config, FilterConfig) else FilterConfig.load(config)
    robot = _common_robot(sequences)
    _check(config, offset_std)
    priors = config.priors.model_copy(update={"cable_offset_std": offset_std})
    recordings = [
        Recording(one, robot, config.model_copy(update={"priors": priors})) for one in sequences
    ]
    count = _Count(len(sequences) * _expected_replays(robot), progress)
    start = np.array([robot.imu_offset, *robot.imu_misalignment])
    expected = np.array(robot.cable_offsets)
    for recording in recordings:
        _check_that_it_rolls(recording, recording.replay(start, expected))
        count()

    mounting = find_mounting(recordings, start, expected, count)
    offsets = find_offsets(recordings, mounting, expected, offset_std, count)
    distance, *angles = mounting.estimate.tolist()
    if abs(distance) > robot.rod_length / 2:
        raise InputError(
            f"the IMU seems to sit {distance:.3g} m from the centre of the rod, which is off it",
            field="imu_offset",
            hint="check rod_length and endcap_radius, and that the recording is of this robot",
        )
    if max(map(abs, angles)) > LARGEST_MISALIGNMENT:
        raise InputError(
            "the IMU's z axis seems to be more than "
            f"{np.degrees(LARGEST_MISALIGNMENT):.0f} deg off the rod",
            field="imu_misalignment",
            hint="turn the recorded samples so that z points from endcap 1 to endcap 0",
        )
    calibrated = robot.model_copy(
        update={
            "imu_offset": distance,
            "imu_misalignment": tuple(angles),
            "cable_offsets": tuple(offsets.estimate.tolist()),
        }
    )
    return RobotCalibration(calibrated, mounting.covariance, offsets.covariance)


def _common_robot(sequences: Sequence[Recorded]) -> Robot:
    if not sequences:
        raise InputError("no recording to calibrate from")
    for other in sequences[1:]:
        if other.robot != sequences[0].robot:
            raise InputError(
                f"'{sequences[0].name}' and '{other.name}' are recordings of different robots",
                hint="calibrate one robot at a time, or name the robot with --robot",
            )
    return sequences[0].robot


def _check(config: FilterConfig, offset_std: float) -> None:
    if config.settings.filter != "tight":
        raise InputError(
            "calibration needs a filter with cable offsets in its state",
            field="settings.filter",
            hint="use filter: tight, as in the profile 'full'",
        )
    if not 0 < offset_std <= 0.1:
        raise InputError(
            f"expected a number in (0, 0.1] [m], got {offset_std:g}", field="offset_std"
        )


def _check_that_it_rolls(recording: Recording, evidence: Evidence) -> None:
    orientation = Rotation.from_quat(evidence.trajectory.quaternion)
    turned = np.degrees((orientation[0].inv() * orientation).magnitude().max())
    if turned < _LEAST_TURN_DEG:
        raise InputError(
            f"the robot of '{recording.sequence.name}' turned by no more than {turned:.0f} deg: "
            "at rest any offsets and any mounting fit",
            hint="record a slow roll over several faces after a still start",
        )


def _expected_replays(robot: Robot) -> int:
    """Of one recording, when the search takes as long as it usually does."""
    return 1 + _USUAL_ROUNDS * ROUND_REPLAYS + 1 + len(robot.cables)


class _Count:
    """Turns replays into progress."""

    def __init__(self, expected: int, progress: Callable[[float], None] | None) -> None:
        self._expected = expected
        self._progress = progress
        self._done = 0

    def __call__(self) -> None:
        self._done += 1
        if self._progress is not None:
            self._progress(min(self._done / self._expected, 1.0))
