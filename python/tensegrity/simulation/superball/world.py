"""A robot of single rods in a net of cables, SUPERball for one, as a MuJoCo model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tensegrity.simulation.rigid_bodies import RigidBodies, quaternion_to, soft_contact

if TYPE_CHECKING:
    import mujoco

    from tensegrity.robots.net import Net

FloatArray = NDArray[np.float64]

_UP = np.array([0.0, 0.0, 1.0])
_FOOT_RADIUS_M = 0.03
_ROD_RADIUS_M = 0.03
# The rods' surfaces end where the end caps begin, which hold the cables.
_END_CAP_LENGTH_M = 0.2
# Masses sit at the ends of the rods, this far off the axis (inertia about it), and cables that pull
# on the axis leave a rod free to spin: in the robot they leave the end cap on one side and hold it.
_GYRATION_RADIUS_M = 0.06
_SPIN_DAMPING = 0.1  # [N m s]
_DOF_OF_ROD, _SPIN_DOF = 6, 5


class NetWorld(RigidBodies):
    """The rods of a net as rigid bodies with a point mass at either end, on level ground.

    Body k + 1 is rod k of the net, body frame at the rod's centre with z toward the end with the
    lower id. ``ends`` (rods, 2) are the indices of the nodes at the rods' ends, that one first.
    Control k is the rest length of cable k.
    """

    def __init__(
        self, net: Net, positions: FloatArray, friction: float, floor_time_constant: float
    ) -> None:
        """``positions`` (n, 3): where the nodes are put down in the world [m].

        Raises :class:`MissingExtraError` without MuJoCo.
        """
        super().__init__()
        self.net = net
        self.ends = np.array(
            [sorted(ends, key=net.node_ids.__getitem__) for ends in net.rod_ends()]
        )
        self._half_length = net.rod_length / 2
        self.model = self._compile(positions, soft_contact(friction, floor_time_constant))
        self.model.dof_damping[_SPIN_DOF::_DOF_OF_ROD] = _SPIN_DAMPING
        self.data = self.mujoco.MjData(self.model)
        self.mujoco.mj_kinematics(self.model, self.data)
        self.command(net.rest_lengths())

    def command(self, rest_lengths: FloatArray) -> None:
        """Set the rest lengths (cables,) [m]."""
        self.data.ctrl[:] = rest_lengths

    def rest_lengths(self) -> FloatArray:
        """Rest lengths (cables,) as last commanded [m]."""
        return self.data.ctrl.copy()

    def nodes(self) -> FloatArray:
        """Positions (n, 3) of the rods' ends in the world [m]."""
        centres = self.data.xpos[1:]
        axes = self._half_length * self.data.xmat[1:, 2::3]
        nodes = np.empty((len(self.net.nodes), 3))
        nodes[self.ends[:, 0]] = centres + axes
        nodes[self.ends[:, 1]] = centres - axes
        return nodes

    def _compile(self, positions: FloatArray, contact: dict[str, object]) -> mujoco.MjModel:
        spec = self.new_spec()
        self.add_ground(spec, _UP, contact)
        for first, second in self.ends.tolist():
            self._add_rod(spec, positions, first, second, contact)
        for index, (i, j) in enumerate(self.net.cable_ends().tolist()):
            cable = self.net.cables[index]
            self.add_cable(
                spec, f"cable_{index}", (_end(i), _end(j)), cable.stiffness, cable.damping
            )
        return spec.compile()

    def _add_rod(
        self,
        spec: mujoco.MjSpec,
        positions: FloatArray,
        first: int,
        second: int,
        contact: dict[str, object],
    ) -> None:
        axis = positions[first] - positions[second]
        mass = 2 * self.net.node_mass
        across = mass * self._half_length**2
        rod = spec.worldbody.add_body(
            name=f"rod_{first}_{second}",
            pos=(positions[first] + positions[second]) / 2,
            quat=quaternion_to(axis / np.linalg.norm(axis)),
            mass=mass,
            ipos=[0, 0, 0],
            iquat=[1, 0, 0, 0],
            inertia=[across, across, mass * _GYRATION_RADIUS_M**2],
            explicitinertial=True,
        )
        rod.add_freejoint()
        self.add_rod_surface(rod, _ROD_RADIUS_M, self._half_length - _END_CAP_LENGTH_M)
        for node, sign in ((first, 1), (second, -1)):
            # The tip of the sphere is the end of the rod: it touches the ground at z = 0.
            self.add_foot(rod, _FOOT_RADIUS_M, sign * (self._half_length - _FOOT_RADIUS_M), contact)
            rod.add_site(name=_end(node), pos=[0, 0, sign * self._half_length])


def _end(node: int) -> str:
    """Name of the end of a rod."""
    return f"node_{node}"
