"""What an estimator says about a recording: one row per sample of the base IMU."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Trajectory:
    """Estimates from the end of the static start to the end of the recording.

    Frames: world (z up), body (the base IMU). Shapes with N rows and E endcaps:

    * ``t_ns`` (N,) [ns]
    * ``position`` (N, 3) of the body in the world [m]; ``quaternion`` (N, 4) x, y, z, w
    * ``velocity`` (N, 3) in the world [m/s]
    * ``gyro_bias`` (N, 3) [rad/s], ``accel_bias`` (N, 3) [m/s^2]
    * ``spin`` (N,) angle of the shape about the base rod, phi [rad]
    * ``endcaps_body`` (N, E, 3), ``endcaps_world`` (N, E, 3) [m]
    * ``load_shares`` (N, E) share of the weight each contact carries, NaN: not known
    * ``contacts`` (N, E) endcaps the filter holds as contacts
    * ``position_covariance`` (N, 3, 3) of the position error in the world [m^2]
    * ``orientation_covariance`` (N, 3, 3) of the rotation error in the world [rad^2]
    * ``velocity_covariance`` (N, 3, 3) of the velocity error in the world [m^2/s^2]
    * ``health`` counters by name, each (N,), cumulative from the start
    * ``cable_nis`` (N,) normalised innovation squared z^T S^-1 z / m of the newest update by m
      cable lengths; ``ground_nis`` (N,) that of the newest update by the heights of m feet above
      the ground. NaN before the first one; a row that brings no update repeats the one before.
      All NaN when left out: a loosely coupled filter has no such updates.
    """

    t_ns: IntArray
    position: FloatArray
    quaternion: FloatArray
    velocity: FloatArray
    gyro_bias: FloatArray
    accel_bias: FloatArray
    spin: FloatArray
    endcaps_body: FloatArray
    endcaps_world: FloatArray
    contacts: NDArray[np.bool_]
    position_covariance: FloatArray
    orientation_covariance: FloatArray
    velocity_covariance: FloatArray
    health: dict[str, IntArray] = field(default_factory=dict)
    load_shares: FloatArray = field(default_factory=lambda: np.empty(0))
    cable_nis: FloatArray = field(default_factory=lambda: np.empty(0))
    ground_nis: FloatArray = field(default_factory=lambda: np.empty(0))
    runtime_s: float = 0.0
    """Wall-clock time spent in the estimator [s]."""
    info: dict[str, Any] = field(default_factory=dict)
    """Method, sequence name and whatever else describes the run."""

    def __post_init__(self) -> None:
        like = {
            "load_shares": self.contacts,
            "cable_nis": self.t_ns,
            "ground_nis": self.t_ns,
        }
        for name, other in like.items():
            if not len(getattr(self, name)):
                # The class is frozen for its users; this is still its construction.
                object.__setattr__(self, name, np.full(other.shape, np.nan))
