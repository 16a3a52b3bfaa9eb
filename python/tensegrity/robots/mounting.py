"""How the base IMU sits on its rod."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation


def imu_rotation(misalignment: ArrayLike) -> NDArray[np.float64]:
    """Rotation matrix (3, 3) that takes vectors from the IMU's frame to the body frame.

    ``misalignment`` are two angles [rad]: the IMU's frame is the body frame turned by the rotation
    vector ``(x, y, 0)``. A turn about z would only choose another x axis: it has no meaning for a
    rod.
    """
    return Rotation.from_rotvec([*np.asarray(misalignment), 0.0]).as_matrix()
