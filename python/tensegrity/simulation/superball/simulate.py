"""An experiment of C = Caluwaerts et al. 2016 as a recording with its truth."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tensegrity.errors import InputError, did_you_mean
from tensegrity.ranging.recording import Anchors, FloorTruth
from tensegrity.ranging.sequence import RangingSequence
from tensegrity.robots import load_net
from tensegrity.robots.net import Net
from tensegrity.sequence.sequence import EndcapStream
from tensegrity.simulation.rigid_bodies import STEP_S
from tensegrity.simulation.sensors import FrameMotion, stamps
from tensegrity.simulation.state_log import StateLog
from tensegrity.simulation.superball.motion import Experiment, Local, Motion, Rolling
from tensegrity.simulation.superball.options import SuperballOptions
from tensegrity.simulation.superball.sensors import (
    CONTROL_PERIOD_S,
    IMU_PERIOD_S,
    IMU_STEPS,
    PairOffsets,
    imu,
    motors,
    ranges,
    with_spurious_sample,
)
from tensegrity.simulation.superball.world import NetWorld

FloatArray = NDArray[np.float64]
Progress = Callable[[float], None]

ANCHOR_IDS = tuple(range(13, 21))
# Eight anchors around 13 m by 7 m = 91 m^2 (C §V-A) at the heights of tripods, tables and shelves.
ANCHOR_POSITIONS_M = np.array(
    [
        [-6.5, -3.5, 0.4],
        [-2.2, -3.4, 2.5],
        [2.2, -3.5, 0.9],
        [6.5, -3.3, 2.9],
        [6.4, 3.5, 0.5],
        [2.1, 3.4, 2.2],
        [-2.3, 3.5, 1.2],
        [-6.5, 3.4, 2.7],
    ]
)

_START_M = np.array([-3.0, 0.0, 0.0])  # rolling leads along x
_HEADING_STD = np.radians(12)
_CONTROL_STEPS = round(CONTROL_PERIOD_S / STEP_S)
_STILL_SPEED = 0.02  # of every rod [m/s], [rad/s]
_STILL_S = 0.5  # it sways and stops at every turning point
_LONGEST_SETTLING_S = 30.0
_GROUND_TIME_CONSTANT_S = 0.02
_LANDED_HEIGHT_M = 0.05
_LANDED_SPEED = 0.02  # [m/s]
_SHORTEST_REST_S = 1.0


def simulate_superball(
    experiment: str | Experiment,
    options: SuperballOptions | None = None,
    net: Net | None = None,
    progress: Progress | None = None,
) -> RangingSequence:
    """Simulate ``rolling`` (face to face over several faces) or ``local`` (stationary, two
    actuators in phase-shifted sinusoids in steps) of ``net``, the packaged SUPERball by default.

    World: z up, level ground at z = 0, eight anchors around 91 m^2. The robot has come to rest
    before the recording begins and stands still for ``still_start`` more. ``endcaps`` are the ends
    of the rods every 10 ms, ``offsets`` those the ranges have. ``progress`` is called with the
    fraction done.

    Raises :class:`InputError` for an unknown experiment and for a robot that cannot do it, and
    :class:`MissingExtraError` without MuJoCo.
    """
    experiment = _experiment(experiment)
    options = SuperballOptions() if options is None else options
    net = load_net() if net is None else net
    motion_rng, range_rng, imu_rng, motor_rng = (
        np.random.default_rng(seed) for seed in np.random.SeedSequence(options.seed).spawn(4)
    )
    motion = _motion(experiment, net, options, motion_rng)
    world = NetWorld(
        net,
        _lying(net, motion, motion_rng),
        _friction(net, options, motion_rng),
        _GROUND_TIME_CONSTANT_S,
    )
    _settle(world)
    log = StateLog(world)
    duration = motion.duration if options.duration is None else options.duration
    rest_lengths = _move(log, motion, options.still_start, duration, progress)

    nodes = _nodes(log)
    anchors = Anchors(np.array(ANCHOR_IDS, dtype=np.int64), ANCHOR_POSITIONS_M.copy())
    offsets = PairOffsets.draw(len(net.nodes), len(anchors), options, range_rng)
    outside, inside = ranges(net.module_positions(nodes), net, anchors, offsets, options, range_rng)
    imus = {node: imu(motion, options, imu_rng) for node, motion in _imu_frames(log, imu_rng)}
    if options.spurious_imu is not None:
        node = net.node_ids[int(imu_rng.integers(len(net.nodes)))]
        imus[node] = with_spurious_sample(imus[node], options.spurious_imu)
    truth = nodes[::IMU_STEPS]
    endcaps = EndcapStream(stamps(len(truth), IMU_PERIOD_S), truth)
    return RangingSequence(
        name=f"{experiment}-{options.seed}",
        net=net,
        ranges=outside,
        anchors=anchors,
        offsets=offsets.listed(net, anchors),
        internal_ranges=inside,
        imus=dict(sorted(imus.items())),
        motors=motors(rest_lengths[:, net.actuated()], options, motor_rng),
        endcaps=endcaps,
        floor_truth=floor_truth(endcaps, net),
    )


def floor_truth(endcaps: EndcapStream, net: Net) -> FloorTruth | None:
    """Where ends rest on the ground while nothing moves along it, as C §V-C measured between rolls;
    None when that never happens."""
    seconds = endcaps.t_ns * 1e-9
    speed = np.linalg.norm(np.gradient(endcaps.position, seconds, axis=0), axis=2)
    low = endcaps.position[:, :, 2] < _LANDED_HEIGHT_M
    still = (low.sum(axis=1) >= 3) & (np.where(low, speed, 0.0).max(axis=1) < _LANDED_SPEED)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    rows = []
    for begin, end in edges.reshape(-1, 2):
        if seconds[end - 1] - seconds[begin] < _SHORTEST_REST_S:
            continue
        mean = endcaps.position[begin:end].mean(axis=0)
        for index in np.flatnonzero(low[begin:end].all(axis=0)):
            rows.append(
                (seconds[begin], seconds[end - 1], net.node_ids[index], *mean[index, :2].tolist())
            )
    if not rows:
        return None
    start, stop, node, x, y = (np.array(column) for column in zip(*rows, strict=True))
    return FloorTruth(start, stop, node.astype(np.int64), np.column_stack([x, y]))


def _experiment(name: str | Experiment) -> Experiment:
    try:
        return Experiment(name)
    except ValueError:
        raise InputError(
            f"unknown experiment '{name}'",
            field="experiment",
            hint=did_you_mean(str(name), list(Experiment)),
        ) from None


def _motion(
    experiment: Experiment, net: Net, options: SuperballOptions, rng: np.random.Generator
) -> Motion:
    if experiment is Experiment.ROLLING:
        return Rolling(net, options.stroke, options.cable_speed, rng)
    return Local(net)


def _friction(net: Net, options: SuperballOptions, rng: np.random.Generator) -> float:
    varied = rng.uniform(0.9, 1.1) * (net.ground.friction_static + net.ground.friction_kinetic) / 2
    return varied if options.friction is None else options.friction


def _lying(net: Net, motion: Motion, rng: np.random.Generator) -> FloatArray:
    """Nodes (n, 3) of the undeformed robot with its first face on the ground: at the origin, or
    where it can set out along x."""
    nodes = net.undeformed_positions()
    face = nodes[list(motion.first_face)]
    up = np.cross(face[1] - face[0], face[2] - face[0])
    up *= np.sign(up @ (nodes.mean(axis=0) - face[0])) / np.linalg.norm(up)
    upright, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [up])
    nodes = upright.apply(nodes - face.mean(axis=0))
    course = motion.course(nodes)
    if course is None:
        return Rotation.from_rotvec([0.0, 0.0, rng.uniform(-np.pi, np.pi)]).apply(nodes)
    turn = rng.normal(0.0, _HEADING_STD) - course
    return Rotation.from_rotvec([0.0, 0.0, turn]).apply(nodes) + _START_M


def _settle(world: NetWorld) -> None:
    """Let the robot find its equilibrium under gravity and prestress."""
    for _ in range(round(_LONGEST_SETTLING_S / _STILL_S)):
        fastest = 0.0
        for _ in range(round(_STILL_S / STEP_S)):
            world.step()
            fastest = max(fastest, world.largest_speed())
        if fastest < _STILL_SPEED:
            return
    raise InputError(
        f"the robot does not come to rest within {_LONGEST_SETTLING_S:g} s of being put down",
        hint="raise the friction, or check the cables' rest lengths and damping",
    )


def _move(
    log: StateLog[NetWorld],
    motion: Motion,
    still_start: float,
    duration: float,
    progress: Progress | None,
) -> FloatArray:
    """Stand, then move; returns the rest lengths (N, cables) [m], one row per
    :data:`CONTROL_PERIOD_S`."""
    world = log.world
    lengths = world.rest_lengths()
    stride = motion.cable_speed * CONTROL_PERIOD_S
    commanded = []
    for number in range(round(duration / CONTROL_PERIOD_S)):
        time = number * CONTROL_PERIOD_S
        wanted = lengths
        if time >= still_start:
            wanted = motion.rest_lengths(time - still_start, world.nodes())
        lengths = lengths + np.clip(wanted - lengths, -stride, stride)
        world.command(lengths)
        commanded.append(lengths)
        for _ in range(_CONTROL_STEPS):
            log.step()
        if progress is not None and number % 100 == 0:
            progress(time / duration)
    if progress is not None:
        progress(1.0)
    return np.array(commanded)


def _nodes(log: StateLog[NetWorld]) -> FloatArray:
    """Positions (N, n, 3) of the nodes at every step of the log [m]."""
    world = log.world
    nodes = np.empty((log.steps, len(world.net.nodes), 3))
    for index, (first, second) in enumerate(world.ends.tolist()):
        rod = log.rod(index)
        half_axis = rod.rotation.apply([0.0, 0.0, world.net.rod_length / 2])
        nodes[:, first] = rod.position + half_axis
        nodes[:, second] = rod.position - half_axis
    return nodes


def _imu_frames(
    log: StateLog[NetWorld], rng: np.random.Generator
) -> Iterator[tuple[int, FrameMotion]]:
    """Id and motion of the frame of every IMU: at the ranging module, z along the rod toward the
    end with the lower id, turned about it at random."""
    net = log.world.net
    offset = net.rod_length / 2 - net.module_inset
    for index, ends in enumerate(log.world.ends.tolist()):
        rod = log.rod(index)
        for end, sign in zip(ends, (1, -1), strict=True):
            yield net.node_ids[end], rod.mounted(sign * offset, rng.uniform(-np.pi, np.pi))
