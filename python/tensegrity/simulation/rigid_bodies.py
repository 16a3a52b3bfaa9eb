"""What the simulated robots share: rods on soft ground, cables that only pull, steps of MuJoCo."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tensegrity.errors import MissingExtraError

if TYPE_CHECKING:
    import mujoco

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
_GROUND, _RODS = 1, 2  # collision groups
_PULL_LIMIT_N = 1e5


class RigidBodies:
    """A compiled model in motion. ``model`` and ``data`` are MuJoCo's."""

    model: mujoco.MjModel
    data: mujoco.MjData

    def __init__(self) -> None:
        """Raises :class:`MissingExtraError` without MuJoCo."""
        self.mujoco = _import_mujoco()

    def step(self) -> None:
        """Advance by :data:`STEP_S`."""
        self.mujoco.mj_step(self.model, self.data)

    def largest_speed(self) -> float:
        """Of any rod: the larger of linear [m/s] and angular speed [rad/s] components."""
        return float(np.abs(self.data.qvel).max())

    def new_spec(self) -> mujoco.MjSpec:
        """An empty world with the settings of the solver."""
        spec = self.mujoco.MjSpec()
        spec.option.timestep = STEP_S
        spec.option.gravity = GRAVITY
        spec.option.integrator = self.mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.noslip_iterations = _NOSLIP_ITERATIONS
        return spec

    def add_ground(
        self, spec: mujoco.MjSpec, normal: FloatArray, contact: dict[str, object]
    ) -> None:
        """A plane through the origin; ``contact`` as from :func:`soft_contact`."""
        spec.worldbody.add_geom(
            type=self.mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0, 0, 1],
            quat=quaternion_to(normal),
            contype=_GROUND,
            conaffinity=0,
            **contact,
        )

    def add_rod_surface(self, rod: mujoco.MjsBody, radius: float, half_length: float) -> None:
        """A capsule about the rod's axis that meets other rods, not the ground."""
        rod.add_geom(
            type=self.mujoco.mjtGeom.mjGEOM_CAPSULE,
            size=[radius, half_length, 0],
            contype=_RODS,
            conaffinity=_RODS,
            friction=[_ROD_FRICTION, 0.005, 0.0001],
            mass=0,
        )

    def add_foot(
        self, rod: mujoco.MjsBody, radius: float, z: float, contact: dict[str, object]
    ) -> None:
        """A sphere on the rod's axis that stands on the ground."""
        rod.add_geom(
            type=self.mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[radius, 0, 0],
            pos=[0, 0, z],
            contype=0,
            conaffinity=_GROUND,
            mass=0,
            **contact,
        )

    def add_cable(
        self,
        spec: mujoco.MjSpec,
        name: str,
        sites: tuple[str, str],
        stiffness: float,
        damping: float,
    ) -> None:
        """A tendon that pulls only: F = min(k (L0 - L) - c dL/dt, 0), control L0."""
        tendon = spec.add_tendon(name=name)
        for site in sites:
            tendon.wrap_site(site)
        actuator = spec.add_actuator(
            name=name,
            trntype=self.mujoco.mjtTrn.mjTRN_TENDON,
            target=name,
            gaintype=self.mujoco.mjtGain.mjGAIN_FIXED,
            biastype=self.mujoco.mjtBias.mjBIAS_AFFINE,
            forcelimited=True,
            forcerange=[-_PULL_LIMIT_N, 0],
        )
        actuator.gainprm[0] = stiffness
        actuator.biasprm[1:3] = [-stiffness, -damping]


def soft_contact(friction: float, time_constant: float) -> dict[str, object]:
    """Properties of a contact with the ground: coefficient of friction, and how fast the ground
    gives way [s]."""
    return {
        "friction": [friction, 0.005, 0.0001],
        "solref": [time_constant, _DAMPING_RATIO],
        "solimp": list(_IMPEDANCE),
    }


def quaternion_to(direction: FloatArray) -> FloatArray:
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
