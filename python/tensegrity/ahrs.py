"""Orientation and inclination of rods from their IMUs, by gradient descent.

The filter of Madgwick, Harrison and Vaidyanathan 2011, "Estimation of IMU and MARG orientation
using a gradient descent algorithm". Quaternions are w, x, y, z and rotate from the IMU's frame to
the world, z up; accelerations are specific forces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tensegrity._core import Madgwick, MadgwickSettings, Status
from tensegrity.errors import InputError
from tensegrity.sequence.sequence import ImuStream

__all__ = ["Madgwick", "MadgwickSettings", "Orientations", "orientations"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Orientations:
    """``t_ns`` (N,) stamps [ns]; ``quaternion`` (N, 4) after each sample; ``used`` (N,) whether the
    sample was one (finite, within the sensor's scale)."""

    t_ns: IntArray
    quaternion: FloatArray
    used: NDArray[np.bool_]

    def inclination_cosine(self) -> FloatArray:
        """Cosine (N,) of the angle between the IMU's z axis, the rod's, and the vertical."""
        _, x, y, _ = self.quaternion.T
        return 1 - 2 * (x**2 + y**2)


def orientations(imu: ImuStream, settings: MadgwickSettings | None = None) -> Orientations:
    """The filter over a recording, started level with its first sample that is one.

    A sample covers the time since the one before it, at most ``settings.largest_interval``: after a
    gap the rotation in the gap is unknown, and gravity brings the inclination back.

    Raises :class:`InputError` when there is no sample to start from.
    """
    filter_ = Madgwick(MadgwickSettings() if settings is None else settings)
    first = next((k for k, a in enumerate(imu.accel) if filter_.start(a) == Status.OK), None)
    if first is None:
        raise InputError(
            "no accelerometer sample has a direction to start from",
            field="accel",
            hint="accelerations are specific forces [m/s^2], not all zero",
        )
    level = filter_.orientation
    quaternion, used = np.tile(level, (len(imu.t_ns), 1)), np.zeros(len(imu.t_ns), dtype=np.bool_)
    used[first] = True
    rest = slice(first + 1, None)
    interval = np.diff(imu.t_ns[first:]) * 1e-9
    interval = np.minimum(interval, filter_.settings.largest_interval)
    quaternion[rest], status = filter_.run(imu.gyro[rest], imu.accel[rest], interval)
    used[rest] = status == Status.OK.value
    return Orientations(imu.t_ns, quaternion, used)
