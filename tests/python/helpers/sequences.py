"""Small exact recordings that need no simulator."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tensegrity import robots
from tensegrity.robots import Robot
from tensegrity.sequence import (
    CableStream,
    ContactStream,
    EndcapStream,
    ImuStream,
    PoseStream,
    Sequence,
)

GRAVITY = 9.81  # m/s^2
RESTING_FACE = (0, 3, 5)


def resting_pose(robot: Robot) -> tuple[Rotation, np.ndarray]:
    """Orientation and position [m] of the body of the undeformed robot that stands on its face
    (0, 3, 5), the IMU above the origin."""
    endcaps = robot.undeformed_endcaps()
    corners = endcaps[list(RESTING_FACE)]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal *= np.sign(normal @ (endcaps.mean(axis=0) - corners[0]))
    upright, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [normal / np.linalg.norm(normal)])
    height = robot.endcap_radius - upright.apply(corners[0])[2]
    return upright, np.array([0.0, 0.0, height])


def make_sequence(
    duration_s: float = 1.0,
    *,
    yaw_rate: float = 0.0,
    robot: Robot | None = None,
    name: str = "synthetic",
    t0_ns: int = 0,
) -> Sequence:
    """The undeformed robot on its face (0, 3, 5), turning at ``yaw_rate`` [rad/s] about the
    vertical through the IMU. No noise, no biases; IMU, contacts and truth at 200 Hz, cables at
    100 Hz."""
    robot = robots.load() if robot is None else robot
    fast = t0_ns + np.arange(round(duration_s * 200) + 1, dtype=np.int64) * 5_000_000
    slow = fast[::2]
    upright, position = resting_pose(robot)
    seconds = (fast - t0_ns) * 1e-9
    orientation = Rotation.from_rotvec(np.outer(yaw_rate * seconds, [0.0, 0.0, 1.0])) * upright
    endcaps = robot.undeformed_endcaps()
    lengths = [
        np.linalg.norm(endcaps[i] - endcaps[j]) for i, j in (c.endcaps for c in robot.cables)
    ]
    flags = np.isin(np.arange(len(endcaps)), RESTING_FACE)
    return Sequence(
        name=name,
        robot=robot,
        imu=ImuStream(
            fast,
            np.tile(upright.inv().apply([0.0, 0.0, yaw_rate]), (len(fast), 1)),
            np.tile(upright.inv().apply([0.0, 0.0, GRAVITY]), (len(fast), 1)),
        ),
        cables=CableStream(slow, np.tile(lengths, (len(slow), 1))),
        contacts=ContactStream(fast, np.tile(flags, (len(fast), 1))),
        groundtruth=PoseStream(fast, np.tile(position, (len(fast), 1)), orientation.as_quat()),
        endcaps=EndcapStream(
            fast, position + np.einsum("nij,ej->nei", orientation.as_matrix(), endcaps)
        ),
    )
