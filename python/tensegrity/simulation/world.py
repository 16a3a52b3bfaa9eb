"""The robot and its ground as a MuJoCo model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tensegrity.errors import MissingExtraError

if TYPE_CHECKING:
    import mujoco

    from tensegrity.robots import Robot

FloatArray = NDArray[np.float64]

STEP_S = 0.001
GRAVITY = np.array([0.0, 0.0, -9.81])
"""In the world frame [m/s^2]."""

# Contact of endcaps and ground. MuJoCo's default contact is so stiff that the flags of a rolling
# robot chatter at 80 Hz; a soft, overdamped one behaves like a rubber endcap.
_DAMPING_RATIO = 2.0
_IMPEDANCE = (0.2, 0.95, 0.004, 0.5, 2.0)
# MuJoCo's regularized friction lets a robot creep down a slope of 5 deg with 3 mm/s; its noslip
# pass stops that.
_NOSLIP_ITERATIONS = 5
_ROD_FRICTION = 0.3
# Without friction in its joints a rod whose cables pull on its axis would spin on for ever.
_SPIN_DAMPING = 0.002  # [N m s]
_DOF_OF_ROD, _SPIN_DOF = 6, 5
_GROUND, _RODS = 1, 2  # collision groups
_PULL_LIMIT_N = 1e5


class World:
    """Three free rods, nine cables, and an inclined plane.

    ``model`` and ``data`` are MuJoCo's. Bodies 1 to 3 are the rods, body frame at the rod's centre
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
        self._mujoco = _import_mujoco()
        self.robot = robot
        self.ground_normal = ground_normal
        self._half_length = robot.rod_length / 2
        self.model = self._compile(endcaps, friction, floor_time_constant)
        self.model.dof_damping[_SPIN_DOF::_DOF_OF_ROD] = _SPIN_DAMPING
        self.data = self._mujoco.MjData(self.model)
        self._mujoco.mj_kinematics(self.model, self.data)
        self._mujoco.mj_tendon(self.model, self.data)
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

    def step(self) -> None:
        """Advance by :data:`STEP_S`."""
        self._mujoco.mj_step(self.model, self.data)

    def endcaps(self) -> FloatArray:
        """Endcap centres (6, 3) in the world [m]."""
        centres = self.data.xpos[1:]
        axes = self._half_length * self.data.xmat[1:, 2::3]
        endcaps = np.empty((6, 3))
        endcaps[0::2] = centres + axes
        endcaps[1::2] = centres - axes
        return endcaps

    def largest_speed(self) -> float:
        """Of any rod: the larger of linear [m/s] and angular speed [rad/s] components."""
        return float(np.abs(self.data.qvel).max())

    def _compile(
        self, endcaps: FloatArray, friction: float, floor_time_constant: float
    ) -> mujoco.MjModel:
        mj, robot = self._mujoco, self.robot
        spec = mj.MjSpec()
        spec.option.timestep = STEP_S
        spec.option.gravity = GRAVITY
        spec.option.integrator = mj.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.noslip_iterations = _NOSLIP_ITERATIONS
        contact: dict[str, object] = {
            "friction": [friction, 0.005, 0.0001],
            "solref": [floor_time_constant, _DAMPING_RATIO],
            "solimp": list(_IMPEDANCE),
        }
        spec.worldbody.add_geom(
            type=mj.mjtGeom.mjGEOM_PLANE,
            size=[0, 0, 1],
            quat=_quaternion_to(self.ground_normal),
            contype=_GROUND,
            conaffinity=0,
            **contact,
        )
        for first, second in robot.rods:
            self._add_rod(spec, endcaps, first, second, contact)
        for index, cable in enumerate(robot.cables):
            i, j = cable.endcaps
            tendon = spec.add_tendon(name=f"cable_{index}")
            tendon.wrap_site(_attachment(index, i))
            tendon.wrap_site(_attachment(index, j))
            # Affine actuator, pulling only: F = min(k (L0 - L) - c dL/dt, 0), control L0.
            actuator = spec.add_actuator(
                name=f"cable_{index}",
                trntype=mj.mjtTrn.mjTRN_TENDON,
                target=f"cable_{index}",
                gaintype=mj.mjtGain.mjGAIN_FIXED,
                biastype=mj.mjtBias.mjBIAS_AFFINE,
                forcelimited=True,
                forcerange=[-_PULL_LIMIT_N, 0],
            )
            actuator.gainprm[0] = cable.stiffness
            actuator.biasprm[1:3] = [-cable.stiffness, -cable.damping]
        return spec.compile()

    def _add_rod(
        self,
        spec: mujoco.MjSpec,
        endcaps: FloatArray,
        first: int,
        second: int,
        contact: dict[str, object],
    ) -> None:
        mj, robot = self._mujoco, self.robot
        length, radius, mass = robot.rod_length, robot.rod_diameter / 2, robot.rod_mass
        axis = (endcaps[first] - endcaps[second]) / length
        quaternion = _quaternion_to(axis)
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
        rod.add_geom(
            type=mj.mjtGeom.mjGEOM_CAPSULE,
            size=[radius, length / 2 - 3 * radius, 0],
            contype=_RODS,
            conaffinity=_RODS,
            friction=[_ROD_FRICTION, 0.005, 0.0001],
            mass=0,
        )
        for endcap, z in ((first, length / 2), (second, -length / 2)):
            rod.add_geom(
                type=mj.mjtGeom.mjGEOM_SPHERE,
                size=[robot.endcap_radius, 0, 0],
                pos=[0, 0, z],
                contype=0,
                conaffinity=_GROUND,
                mass=0,
                **contact,
            )
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


def _quaternion_to(direction: FloatArray) -> FloatArray:
    """The shortest rotation from z to the unit vector ``direction`` as w, x, y, z."""
    x, y, z = direction
    if z < -1 + 1e-9:
        return np.array([0.0, 1.0, 0.0, 0.0])  # half a turn about x
    quaternion = np.array([1 + z, -y, x, 0.0])
    return quaternion / np.linalg.norm(quaternion)


def _import_mujoco() -> Any:
    try:
        import mujoco
    except ImportError as error:
        raise MissingExtraError("simulation", "sim") from error
    return mujoco
