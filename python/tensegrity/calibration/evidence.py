"""How well one recording fits a robot that is mounted in a certain way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tensegrity.config import FilterConfig
from tensegrity.errors import InputError
from tensegrity.estimation import estimate
from tensegrity.robots import Robot
from tensegrity.sequence import Sequence
from tensegrity.sequence.directory import cable_columns
from tensegrity.trajectory import Trajectory

FloatArray = NDArray[np.float64]

MOUNTING = ("imu_offset", "imu_misalignment x", "imu_misalignment y")
"""Order of the parameters of the mounting; [m], [rad], [rad]."""

BLOCK_S = 5.0
"""Innovations of one block add up [s]: about a step of a slow robot, after which they are as good
as independent."""

# Squared innovations of one sample count in full while they are well below this, and by their
# logarithm above (Cauchy's loss): a filter that has lost the robot for a moment says nothing.
_OUTLIER = 50.0

_READING_S = 3.0  # at the end of the recording, where the offsets are read


@dataclass(frozen=True)
class Evidence:
    """One recording replayed through the filter.

    * ``misfit`` (blocks,) robust sums of squared normalised innovations of cables and ground over
      :data:`BLOCK_S` each: minus twice the logarithm of the recording's likelihood, up to a
      constant
    * ``offsets`` (9,) the filter's cable offsets at the end of the recording [m]
    * ``trajectory`` the estimate itself
    """

    misfit: FloatArray
    offsets: FloatArray
    trajectory: Trajectory


@dataclass(frozen=True)
class Recording:
    """A recording and what is held fixed about its robot: ``config`` states how large the cable
    offsets may be (``priors.cable_offset_std``)."""

    sequence: Sequence
    robot: Robot
    config: FilterConfig

    def replay(self, mounting: FloatArray, expected_offsets: FloatArray) -> Evidence:
        """The recording's evidence for a ``mounting`` (3,), in the order of :data:`MOUNTING`.
        ``expected_offsets`` (9,) [m] are the mean of the filter's prior."""
        robot = self.robot.model_copy(
            update={
                "imu_offset": float(mounting[0]),
                "imu_misalignment": (float(mounting[1]), float(mounting[2])),
                "cable_offsets": tuple(expected_offsets.tolist()),
            }
        )
        trajectory = estimate(self.sequence, robot, self.config)
        return Evidence(self._misfit(trajectory), self._offsets(trajectory), trajectory)

    def _misfit(self, trajectory: Trajectory) -> FloatArray:
        rows = self._rows_of_cables(trajectory)
        measured = np.zeros(len(trajectory.t_ns))
        measured[rows[rows >= 0]] = np.isfinite(self.sequence.cables.lengths[rows >= 0]).sum(axis=1)
        misfit = np.nan_to_num(trajectory.cable_nis) * measured
        misfit += np.nan_to_num(trajectory.ground_nis) * trajectory.contacts.sum(axis=1)
        misfit = _OUTLIER * np.log1p(misfit / _OUTLIER)
        seconds = (trajectory.t_ns - trajectory.t_ns[0]) * 1e-9
        return np.bincount((seconds / BLOCK_S).astype(np.int64), misfit).astype(np.float64)

    def _offsets(self, trajectory: Trajectory) -> FloatArray:
        """What the filter takes off the lengths at the end: measured minus estimated distances."""
        rows = self._rows_of_cables(trajectory)
        cables = self.sequence.cables
        last = cables.t_ns >= cables.t_ns[-1] - round(_READING_S * 1e9)
        last &= rows >= 0
        first, second = np.array([cable.endcaps for cable in self.robot.cables]).T
        endcaps = trajectory.endcaps_body[rows[last]]
        error = cables.lengths[last] - np.linalg.norm(
            endcaps[:, first] - endcaps[:, second], axis=2
        )
        silent = ~np.isfinite(error).any(axis=0)
        if silent.any():
            names = [column.name for column in cable_columns(self.robot)]
            raise InputError(
                f"cable {names[int(silent.argmax())]} of '{self.sequence.name}' was not measured "
                f"in the last {_READING_S:g} s",
                hint="calibrate from a recording with all cables",
            )
        return np.nanmean(error, axis=0)

    def _rows_of_cables(self, trajectory: Trajectory) -> NDArray[np.int64]:
        """Row of the trajectory that follows each measurement of the cables; -1: none does."""
        t_ns = self.sequence.cables.t_ns
        rows = np.searchsorted(trajectory.t_ns, t_ns)
        outside = (t_ns < trajectory.t_ns[0]) | (rows == len(trajectory.t_ns))
        return np.where(outside, -1, rows)
