"""States of a world at every step."""

from __future__ import annotations

from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tensegrity.simulation.rigid_bodies import RigidBodies
from tensegrity.simulation.sensors import FrameMotion

FloatArray = NDArray[np.float64]

_FIRST_CAPACITY = 65_536  # one minute

WorldT = TypeVar("WorldT", bound=RigidBodies)


class StateLog(Generic[WorldT]):
    """Steps a world and keeps every state, with the contact forces that act in it.

    Whole rows of MuJoCo's arrays are copied, everything else is computed afterwards for all steps
    at once: a step in Python then costs little more than the physics.
    """

    def __init__(self, world: WorldT) -> None:
        self.world = world
        self.steps = 0
        self._positions = np.empty((_FIRST_CAPACITY, world.model.nq))
        self._velocities = np.empty((_FIRST_CAPACITY, world.model.nv))
        self._forces = np.empty((_FIRST_CAPACITY, world.model.nsensordata))

    def step(self) -> None:
        """Log the state, then advance the world by one step."""
        row = self.steps
        if row == len(self._positions):
            self._grow()
        data = self.world.data
        self._positions[row] = data.qpos
        self._velocities[row] = data.qvel
        self.world.step()
        self._forces[row] = data.sensordata  # of the state before the step
        self.steps = row + 1

    def normal_forces(self) -> FloatArray:
        """What the world's touch sensors feel between endcaps and ground (N, sensors) [N]."""
        return self._forces[: self.steps]

    def rod(self, index: int) -> FrameMotion:
        """Motion of a rod's centre, z along the rod."""
        position = self._positions[: self.steps, 7 * index : 7 * index + 7]
        velocity = self._velocities[: self.steps, 6 * index : 6 * index + 6]
        # MuJoCo: quaternions w, x, y, z; linear velocity in the world, angular in the body.
        return FrameMotion(
            position=position[:, :3],
            velocity=velocity[:, :3],
            rotation=Rotation.from_quat(position[:, 3:], scalar_first=True),
            angular_velocity=velocity[:, 3:],
        )

    def _grow(self) -> None:
        for name in ("_positions", "_velocities", "_forces"):
            array = getattr(self, name)
            setattr(self, name, np.concatenate([array, np.empty_like(array)]))
