"""The world of the estimate onto the world of the truth, from the still start alone.

Position and heading at the start are unobservable from proprioception, so an estimate lives in a
world frame of its own. As Tong et al. 2024 (section VI-C) do, only the first segment is aligned:
aligning the whole path would hide drift. While the robot stands still its positions are one point,
which leaves a fit of positions (Umeyama) without any direction; the mean *pose* of the still
segment determines the transform instead.
"""

from __future__ import annotations

from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

STILL_DISTANCE_M = 2e-3
"""A robot that is closer than this to where it started has not moved yet [m]."""
STILL_ANGLE_RAD = np.deg2rad(0.2)
"""The same for its orientation [rad]."""


class Alignment(StrEnum):
    """Which part of the initial pose is taken from the truth."""

    POSE = "pose"
    """Position and full orientation, as evo's ``--align_origin``; what Tong et al. use."""
    YAW = "yaw"
    """Position and heading, the four directions that are really unobservable. An initial error in
    roll and pitch then counts as the estimator's own and makes the whole path tilt."""


def still_count(position: FloatArray, orientation: Rotation) -> int:
    """Number of leading poses before the robot first leaves its initial pose (at least one).

    ``position`` (N, 3) [m] and ``orientation`` (N) are the truth.
    """
    distance = np.linalg.norm(position - position[0], axis=1)
    angle = (orientation * orientation[0].inv()).magnitude()
    moved = (distance > STILL_DISTANCE_M) | (angle > STILL_ANGLE_RAD)
    return int(np.argmax(moved)) if moved.any() else len(position)


def initial_transform(
    position: FloatArray,
    orientation: Rotation,
    true_position: FloatArray,
    true_orientation: Rotation,
    alignment: Alignment,
) -> tuple[Rotation, FloatArray, float]:
    """Rigid transform of the estimate's world onto the truth's, from poses of a still robot.

    All arguments hold the same K >= 1 stamps: positions (K, 3) [m], orientations body to world.

    Returns the rotation R and translation t with ``R p + t`` in the world of the truth, and the
    angle between the two vertical directions [rad]: the estimate's initial error in roll and pitch,
    which ``Alignment.POSE`` removes.
    """
    difference = true_orientation.mean() * orientation.mean().inv()
    up = difference.apply(np.array([0.0, 0.0, 1.0]))
    tilt = float(np.arctan2(np.hypot(up[0], up[1]), up[2]))
    if alignment is Alignment.YAW:
        # The rotation about z closest to the difference: it maximises trace(Rz(yaw)^T difference).
        m = difference.as_matrix()
        yaw = np.arctan2(m[1, 0] - m[0, 1], m[0, 0] + m[1, 1])
        difference = Rotation.from_euler("z", float(yaw))
    translation = true_position.mean(axis=0) - difference.apply(position.mean(axis=0))
    return difference, translation, tilt
