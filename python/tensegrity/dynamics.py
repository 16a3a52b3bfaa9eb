"""Simulation of tensegrities as spring-mass nets (C §IV-A; C = Caluwaerts et al. 2016).

A state is ``[positions 3n | velocities 3n]`` [m, m/s], coordinate k of node i at ``3 i + k``. The
world has z up and ground at z = 0::

    net = robots.load_net("superball")
    simulator = Simulator(net)
    state = at_rest(net.standing_on((6, 8, 9)))
    state = simulator.step(state, net.rest_lengths(), dt=0.005, steps=20)
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

import tensegrity._core as _core
from tensegrity.errors import InputError
from tensegrity.robots import Net

FloatArray = NDArray[np.float64]
IntegratorName = Literal["rk4", "semi_implicit_euler"]

GRAVITY = (0.0, 0.0, -9.81)
"""World, z up [m/s^2]."""

_INTEGRATORS = {
    "rk4": _core.Integrator.RUNGE_KUTTA_4,
    "semi_implicit_euler": _core.Integrator.SEMI_IMPLICIT_EULER,
}


class Simulator:
    """Steps many states of one net at once, at C++ speed.

    ``gravity`` [m/s^2] tilted against z makes the ground a slope. ``precision="float"`` takes half
    the time of ``"double"``; positions are then good to about 1e-7 of their size.
    """

    def __init__(
        self,
        net: Net,
        *,
        gravity: ArrayLike = GRAVITY,
        ground: bool = True,
        precision: Literal["double", "float"] = "double",
    ) -> None:
        self.net = net
        core = core_net(net, gravity=gravity, ground=ground)
        self._core: _core.NetSimulator | _core.NetSimulatorFloat
        self._dtype: type[np.floating]
        if precision == "double":
            self._core, self._dtype = _core.NetSimulator(core), np.float64
        else:
            self._core, self._dtype = _core.NetSimulatorFloat(core), np.float32

    def step(
        self,
        states: ArrayLike,
        rest_lengths: ArrayLike,
        dt: float,
        steps: int,
        integrator: IntegratorName = "rk4",
        *,
        anchors: FloatArray | None = None,
    ) -> FloatArray:
        """The states after ``steps`` steps of ``dt`` [s].

        ``states`` is (6n,) or (simulations, 6n); ``rest_lengths`` (cables,) [m] are common to all.
        Nodes that touch the ground begin to stand where they are at the begin of this call, unless
        ``anchors`` (simulations, 2n) or (2n,), made by :func:`anchors_under` and moved in place,
        say where they stand since earlier calls.

        Raises :class:`InputError` for shapes and values that do not fit,
        :class:`FloatingPointError` when a state does not stay finite.
        """
        given = np.asarray(states, dtype=np.float64)
        rows = np.asfortranarray(np.atleast_2d(given), dtype=self._dtype).copy(order="F")
        lengths = np.asarray(rest_lengths, dtype=self._dtype)
        n = len(self.net.nodes)
        if rows.ndim != 2 or rows.shape[1] != 6 * n:
            raise InputError(f"states: expected shape (simulations, {6 * n}), got {given.shape}")
        if lengths.shape != (len(self.net.cables),) or not np.all(lengths >= 0):
            raise InputError(f"rest_lengths: expected {len(self.net.cables)} numbers >= 0 [m]")
        if not (0 < dt < np.inf and steps >= 0):
            raise InputError(f"expected dt > 0 [s] and steps >= 0, got {dt:g} and {steps}")
        kind = _INTEGRATORS[integrator]
        if anchors is None:
            status = self._core.step(rows, lengths, dt, steps, kind)
        else:
            where = np.asfortranarray(np.atleast_2d(anchors), dtype=self._dtype).copy(order="F")
            if where.shape != (len(rows), 2 * n):
                raise InputError(f"anchors: expected shape ({len(rows)}, {2 * n})")
            status = self._core.step(rows, where, lengths, dt, steps, kind)
            anchors[...] = where.reshape(anchors.shape)
        if status != _core.Status.OK:
            raise FloatingPointError(
                f"{self._core.failures} of {len(rows)} simulations did not stay finite; "
                f"stable_step tells how long a step may be, this one has {dt:g} s"
            )
        return rows.astype(np.float64).reshape(given.shape)


def core_net(net: Net, *, gravity: ArrayLike = GRAVITY, ground: bool = True) -> _core.Net:
    """The net as the C++ core takes it."""
    plane = _core.NetGround()
    for name, value in net.ground.model_dump().items():
        setattr(plane, name, value)
    if not ground:
        plane.stiffness = plane.damping = 0.0
    core = _core.Net(len(net.nodes), net.node_mass, plane, np.asarray(gravity, dtype=np.float64))
    core.set_rods(
        net.rod_ends(),
        np.array([rod.stiffness for rod in net.rods]),
        np.array([rod.damping for rod in net.rods]),
        np.full(len(net.rods), net.rod_length),
    )
    core.set_cables(
        net.cable_ends(),
        np.array([cable.stiffness for cable in net.cables]),
        np.array([cable.damping for cable in net.cables]),
        net.rest_lengths(),
    )
    return core


def at_rest(positions: FloatArray) -> FloatArray:
    """The state (..., 6n) of nodes at ``positions`` (..., n, 3) [m] that do not move."""
    flat = positions.reshape(*positions.shape[:-2], -1)
    return np.concatenate([flat, np.zeros_like(flat)], axis=-1)


def positions_of(states: FloatArray) -> FloatArray:
    """Positions (..., n, 3) [m] of states (..., 6n)."""
    return states[..., : states.shape[-1] // 2].reshape(*states.shape[:-1], -1, 3)


def anchors_under(states: FloatArray) -> FloatArray:
    """Points (..., 2n) [m] right under the nodes of states (..., 6n): where they stand without
    friction."""
    return positions_of(states)[..., :2].reshape(*states.shape[:-1], -1)


def relax(
    net: Net,
    rest_lengths: ArrayLike | None = None,
    *,
    start: FloatArray | None = None,
    gravity: bool = False,
    force_tolerance: float = 1e-6,
) -> FloatArray:
    """Positions (n, 3) [m] where the net comes to rest, no node pulled by ``force_tolerance`` [N].

    It starts at ``start`` (n, 3), by default as described. With ``gravity`` it comes to rest on the
    ground, which it touches at the start by default; :meth:`Net.standing_on` puts it on a face.
    Whenever its kinetic energy has passed a peak it is stopped ("kinetic damping"), which ends in
    an equilibrium in much fewer steps than its own damping would.

    Raises :class:`InputError` when it does not come to rest.
    """
    lengths = net.rest_lengths() if rest_lengths is None else np.asarray(rest_lengths)
    dt = stable_step(net, "semi_implicit_euler") / 2
    simulator = Simulator(net, gravity=GRAVITY if gravity else (0.0, 0.0, 0.0), ground=gravity)
    if start is None:
        start = net.undeformed_positions()
        if gravity:
            start[:, 2] -= start[:, 2].min()
    state = at_rest(start)
    anchors = anchors_under(state)
    half = state.size // 2
    peak = 0.0
    for _ in range(_RELAXATION_STEPS):
        state = simulator.step(state, lengths, dt, 1, "semi_implicit_euler", anchors=anchors)
        energy = float(state[half:] @ state[half:])
        if energy >= peak:
            peak = energy
            continue
        state[half:] = 0.0
        peak = 0.0
        # One step from rest gains velocity in proportion to the force.
        moved = simulator.step(state, lengths, dt, 1, "semi_implicit_euler", anchors=anchors.copy())
        forces = net.node_mass * moved[half:].reshape(-1, 3) / dt
        if np.linalg.norm(forces, axis=1).max() < force_tolerance:
            return positions_of(state)
    raise InputError(
        f"the net '{net.name}' does not come to rest",
        hint="without tension in its cables it has no shape of its own",
    )


_RELAXATION_STEPS = 200_000


def stable_step(net: Net, integrator: IntegratorName = "rk4") -> float:
    """The longest stable step [s] of the undeformed net with every node standing on the ground.

    The equations of motion are linearised there. A net deforms and its cables slacken, feet slide
    and lift off: these soften it. Deep under ground the normal force's damping grows without
    limit: there, steps have to be shorter.
    """
    stiffness, damping = _linearised(net)
    n3 = len(stiffness)
    zero, one = np.zeros((n3, n3)), np.eye(n3)
    if integrator == "rk4":
        rates = np.linalg.eigvals(np.block([[zero, one], [-stiffness, -damping]]))

        def growth(dt: float) -> float:
            z = dt * rates
            return float(np.abs(1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))).max())
    else:

        def growth(dt: float) -> float:
            kick = np.block([-dt * stiffness, one - dt * damping])
            drift = np.block([one, zero]) + dt * kick
            return float(np.abs(np.linalg.eigvals(np.vstack([drift, kick]))).max())

    stable, unstable = 0.0, 4 / np.sqrt(np.linalg.eigvalsh(stiffness).max())
    while unstable - stable > 1e-3 * unstable:
        middle = (stable + unstable) / 2
        if growth(middle) <= 1 + 1e-9:  # motions without friction and force stay as they are
            stable = middle
        else:
            unstable = middle
    return float(stable)


def _linearised(net: Net) -> tuple[FloatArray, FloatArray]:
    """Stiffness [1/s^2] and damping [1/s] (3n, 3n) of the undeformed net per mass."""
    positions = net.undeformed_positions()
    n = len(positions)
    stiffness, damping = np.zeros((n, 3, n, 3)), np.zeros((n, 3, n, 3))
    ends = np.concatenate([net.rod_ends(), net.cable_ends()])
    rest_lengths = np.concatenate([np.full(len(net.rods), net.rod_length), net.rest_lengths()])
    for (a, b), member, rest in zip(ends, net.members, rest_lengths, strict=True):
        vector = positions[b] - positions[a]
        length = np.linalg.norm(vector)
        along = np.outer(vector, vector) / length**2
        across = max(0.0, 1 - rest / length) * (np.eye(3) - along)
        for i, j, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
            stiffness[i, :, j] += sign * member.stiffness * (along + across)
            damping[i, :, j] += sign * member.damping * along
    ground = net.ground
    deepest = n * net.node_mass * -GRAVITY[2] / ground.stiffness  # all the weight on one node
    for i in range(n):
        stiffness[i, :, i] += np.diag([ground.friction_stiffness] * 2 + [ground.stiffness])
        damping[i, :, i] += np.diag([ground.friction_damping] * 2 + [ground.damping * deepest])
    return (
        stiffness.reshape(3 * n, 3 * n) / net.node_mass,
        damping.reshape(3 * n, 3 * n) / net.node_mass,
    )
