"""A recording in memory: everything a robot's sensors said, and the truth if it is known."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tensegrity.robots import Robot

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

ROD_IMUS = ("r23", "r45")
"""Names of the IMUs on the other rods in a recording: their files are ``imu_<name>.csv``."""


@dataclass(frozen=True)
class ImuStream:
    """Samples of one IMU in its own frame.

    ``t_ns`` (N,) stamps [ns]; ``gyro`` (N, 3) angular velocity [rad/s];
    ``accel`` (N, 3) specific force [m/s^2].
    """

    t_ns: IntArray
    gyro: FloatArray
    accel: FloatArray


@dataclass(frozen=True)
class CableStream:
    """Cable lengths: ``t_ns`` (N,) stamps [ns]; ``lengths`` (N, cables) distances of endcap
    centres [m], columns in the order of ``robot.cables``, NaN where a cable was not measured."""

    t_ns: IntArray
    lengths: FloatArray


@dataclass(frozen=True)
class ContactStream:
    """Contact flags: ``t_ns`` (N,) stamps [ns]; ``flags`` (N, endcaps), true on the ground."""

    t_ns: IntArray
    flags: BoolArray


@dataclass(frozen=True)
class PoseStream:
    """Poses of the body (IMU) frame in the world frame: ``t_ns`` (N,) stamps [ns];
    ``position`` (N, 3) [m]; ``quaternion`` (N, 4) in the order x, y, z, w."""

    t_ns: IntArray
    position: FloatArray
    quaternion: FloatArray


@dataclass(frozen=True)
class EndcapStream:
    """Endcap centres in the world frame: ``t_ns`` (N,) stamps [ns];
    ``position`` (N, endcaps, 3) [m]."""

    t_ns: IntArray
    position: FloatArray


@dataclass(frozen=True)
class Sequence:
    """One recording. ``imu`` is the base IMU; further IMUs are in ``other_imus`` by name.

    ``contacts``, ``groundtruth`` and ``endcaps`` are ``None`` when the recording has none.
    """

    name: str
    robot: Robot
    imu: ImuStream
    cables: CableStream
    contacts: ContactStream | None = None
    groundtruth: PoseStream | None = None
    endcaps: EndcapStream | None = None
    other_imus: dict[str, ImuStream] = field(default_factory=dict)

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample of the base IMU [s]."""
        return float(self.imu.t_ns[-1] - self.imu.t_ns[0]) * 1e-9
