"""The robot and its ground as a MuJoCo model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tensegrity.simulation.rigid_bodies import RigidBodies, quaternion_to, soft_contact

if TYPE_CHECKING:
    import mujoco

    from tensegrity.robots import Robot

FloatArray = NDArray[np.float64]

# Without friction in its joints a rod whose cables pull on its axis would spin on for ever.
_SPIN_DAMPING = 0.002  # [N m s]
_DOF_OF_ROD, _SPIN_DOF = 6, 5


class World(RigidBodies):
    """Three free rods, nine cables, and an inclined plane.

    Bodies 1 to 3 are the rods, body frame at the rod's centre
    with z toward the even endcap. Control k is the rest length of cable k, stated like all lengths
    between endcap centres.
    """

    def __init__(
        self,
        robot: Robot,
        endcaps: FloatArray,
        ground_normal: FloatArray,
        friction: float,
        floor_time_constant: float,
    ) -> None:
        """``endcaps`` (6, 3) is where the undeformed robot is put down in the world [m],
        ``ground_normal`` (3,) the unit normal of the ground through the world's origin.

        Raises :class:`MissingExtraError` without MuJoCo.
        """
        super().__init__()
        self.robot = robot
        self.ground_normal = ground_normal
        self._half_length = robot.rod_length / 2
        self.model = self._compile(endcaps, friction, floor_time_constant)
        self.model.dof_damping[_SPIN_DOF::_DOF_OF_ROD] = _SPIN_DAMPING
        self.data = self.mujoco.MjData(self.model)
        self.mujoco.mj_kinematics(self.model, self.data)
        self.mujoco.mj_tendon(self.model, self.data)
        pairs = np.array([cable.endcaps for cable in robot.cables])
        centre_distance = np.linalg.norm(endcaps[pairs[:, 0]] - endcaps[pairs[:, 1]], axis=1)
        self._shortening = centre_distance - self.data.ten_length
        self.command(np.array([cable.rest_length for cable in robot.cables]))

    def command(self, rest_lengths: FloatArray) -> None:
        """Set the rest lengths (9,) of the cables [m].

        Cables are attached beside the rods' axes and so are shorter than the distance of the
        endcap centres; the difference in the undeformed robot is taken off here.
        """
        self.data.ctrl[:] = rest_lengths - self._shortening

    def rest_lengths(self) -> FloatArray:
        """Rest lengths (9,) as last commanded [m]."""
        return self.data.ctrl + self._shortening

    def endcaps(self) -> FloatArray:
        """Endcap centres (6, 3) in the world [m]."""
        centres = self.data.xpos[1:]
        axes = self._half_length * self.data.xmat[1:, 2::3]
        endcaps = np.empty((6, 3))
        endcaps[0::2] = centres + axes
        endcaps[1::2] = centres - axes
        return endcaps

    def _compile(
        self, endcaps: FloatArray, friction: float, floor_time_constant: float
    ) -> mujoco.MjModel:
        robot = self.robot
        spec = self.new_spec()
        contact = soft_contact(friction, floor_time_constant)
        self.add_ground(spec, self.ground_normal, contact)
        for first, second in robot.rods:
            self._add_rod(spec, endcaps, first, second, contact)
        for index, cable in enumerate(robot.cables):
            i, j = cable.endcaps
            sites = _attachment(index, i), _attachment(index, j)
            self.add_cable(spec, f"cable_{index}", sites, cable.stiffness, cable.damping)
        return spec.compile()

    def _add_rod(
        self,
        spec: mujoco.MjSpec,
        endcaps: FloatArray,
        first: int,
        second: int,
        contact: dict[str, object],
    ) -> None:
        mj, robot = self.mujoco, self.robot
        length, radius, mass = robot.rod_length, robot.rod_diameter / 2, robot.rod_mass
        axis = (endcaps[first] - endcaps[second]) / length
        quaternion = quaternion_to(axis)
        rotation = np.empty(9)
        mj.mju_quat2Mat(rotation, quaternion)
        to_rod = rotation.reshape(3, 3).T
        across = mass * (3 * radius**2 + length**2) / 12  # solid cylinder
        rod = spec.worldbody.add_body(
            name=f"rod_{first}{second}",
            pos=(endcaps[first] + endcaps[second]) / 2,
            quat=quaternion,
            mass=mass,
            ipos=[0, 0, 0],
            iquat=[1, 0, 0, 0],
            inertia=[across, across, mass * radius**2 / 2],
            explicitinertial=True,
        )
        rod.add_freejoint()
        # Rods meet each other in strongly deformed poses. The capsule ends short of the endcaps,
        # whose touch sensors would feel it.
        # Rods meet each other in strongly deformed poses. The capsule ends short of the endcaps,
        # whose touch sensors would feel it.
        self.add_rod_surface(rod, radius, length / 2 - 3 * radius)
        for endcap, z in ((first, length / 2), (second, -length / 2)):
            self.add_foot(rod, robot.endcap_radius, z, contact)
            rod.add_site(
                name=f"endcap_{endcap}",
                type=mj.mjtGeom.mjGEOM_SPHERE,
                size=[1.2 * robot.endcap_radius, 0, 0],
                pos=[0, 0, z],
            )
            for index, cable in enumerate(robot.cables):
                if endcap in cable.endcaps:
                    far_end = sum(cable.endcaps) - endcap
                    across_rod = to_rod @ (endcaps[far_end] - endcaps[endcap])
                    across_rod[2] = 0
                    across_rod *= robot.cable_attachment_offset / np.linalg.norm(across_rod)
                    across_rod[2] = z
                    rod.add_site(name=_attachment(index, endcap), pos=across_rod)
        for endcap in (first, second):
            spec.add_sensor(
                name=f"contact_{endcap}",
                type=mj.mjtSensor.mjSENS_TOUCH,
                objtype=mj.mjtObj.mjOBJ_SITE,
                objname=f"endcap_{endcap}",
            )


def _attachment(cable: int, endcap: int) -> str:
    """Name of the point where a cable is attached to the rod of an endcap."""
    return f"cable_{cable}_at_{endcap}"
