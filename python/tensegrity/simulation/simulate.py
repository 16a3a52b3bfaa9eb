"""A manoeuvre from its still start to its still end, as a recording with its truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tensegrity.errors import InputError
from tensegrity.robots import Robot, load
from tensegrity.robots.mounting import imu_rotation
from tensegrity.sequence.sequence import ROD_IMUS, EndcapStream, PoseStream, Sequence
from tensegrity.simulation.failures import lost_cable_index, with_gaps, without_lost_cable
from tensegrity.simulation.gait import FACES, Gait
from tensegrity.simulation.manoeuvres import Manoeuvre
from tensegrity.simulation.options import SimulationOptions
from tensegrity.simulation.rigid_bodies import STEP_S
from tensegrity.simulation.sensors import (
    IMU_PERIOD_S,
    IMU_STEPS,
    cable_stream,
    contact_stream,
    imu_stream,
    stamps,
)
from tensegrity.simulation.state_log import StateLog
from tensegrity.simulation.world import World

FloatArray = NDArray[np.float64]
Progress = Callable[[float], None]

_CONTROL_STEPS = 10
_STILL_SPEED = 1e-3  # of every rod [m/s], [rad/s]
_LONGEST_SETTLING_S = 20.0
_LONGEST_COMING_TO_REST_S = 5.0
# The prism rolls at 1.5 to 2 times the speed of its cables; at a third of that it is called stuck.
_SLOWEST_ROLLING = 0.5  # of the speed of the cables
_TRAVEL_TO_SET_OUT = 3.0  # of a cable [m]: time for two attempts


@dataclass(frozen=True)
class _Draw:
    """What differs between seeds, besides the sensors' noise."""

    yaw: float
    imu_turns: FloatArray
    friction: float
    gain: float
    cable_speed: float


def simulate(
    manoeuvre: str | Manoeuvre,
    options: SimulationOptions | None = None,
    robot: Robot | None = None,
    progress: Progress | None = None,
) -> Sequence:
    """Simulate a manoeuvre of ``robot`` (the packaged prism by default).

    The robot lies still on face (0, 3, 5), rolls until the horizontal path of its centre of mass
    is long enough, and comes to rest. World: z up, the ground passes through the origin, where the
    robot starts. Time zero is the first sample. Truth comes at the rate of the IMU. ``progress``
    is called with the fraction done.

    Raises :class:`InputError` for an unknown manoeuvre and for a robot that cannot do it, and
    :class:`MissingExtraError` without MuJoCo.
    """
    return simulate_with_forces(manoeuvre, options, robot, progress)[0]


def simulate_with_forces(
    manoeuvre: str | Manoeuvre,
    options: SimulationOptions | None = None,
    robot: Robot | None = None,
    progress: Progress | None = None,
) -> tuple[Sequence, FloatArray]:
    """As :func:`simulate`, with the normal forces (N, 6) between endcaps and ground [N] at the
    stamps of the IMU."""
    manoeuvre = Manoeuvre.named(manoeuvre)
    options = SimulationOptions() if options is None else options
    robot = _variant(load() if robot is None else robot, options)
    _check_cables(robot, options)
    motion_rng, *sensor_rngs = (
        np.random.default_rng(seed) for seed in np.random.SeedSequence(options.seed).spawn(4)
    )
    draw = _draw(options, motion_rng)
    up = _ground_normal(options)
    world = World(
        robot, _lying(robot, up, draw.yaw), up, draw.friction, options.floor_time_constant
    )
    rest_lengths = np.array([cable.rest_length for cable in robot.cables])
    clockwise = robot.chirality == "clockwise"
    gait = Gait(manoeuvre, clockwise, rest_lengths[:6], up, draw.gain, draw.cable_speed, motion_rng)
    path_length = manoeuvre.path_length if options.path_length is None else options.path_length

    _settle(world)
    log = StateLog(world)
    _stand(log, IMU_STEPS * STEP_S + options.still_start)
    _roll(log, gait, draw.cable_speed, path_length, progress)
    _come_to_rest(log)
    _stand(log, options.still_end)
    recording = _recording(f"{manoeuvre}-{options.seed}", log, options, draw.imu_turns, sensor_rngs)
    assert recording.groundtruth is not None
    return recording, log.normal_forces()[_at_samples(len(recording.groundtruth.t_ns))]


def _variant(robot: Robot, options: SimulationOptions) -> Robot:
    """``robot`` with what the options change."""
    changes: dict[str, object] = {}
    if options.mirrored:
        mirror_images = {"counter_clockwise": "clockwise", "clockwise": "counter_clockwise"}
        changes["chirality"] = mirror_images[robot.chirality]
    if options.endcap_radius is not None:
        changes["endcap_radius"] = options.endcap_radius
    if options.cable_attachment_offset is not None:
        changes["cable_attachment_offset"] = options.cable_attachment_offset
    return robot.model_copy(update=changes)


def _check_cables(robot: Robot, options: SimulationOptions) -> None:
    """Whether what the options say about cables fits the robot's, before anything is simulated."""
    if options.cable_offsets is not None and len(options.cable_offsets) != len(robot.cables):
        raise InputError(
            f"expected {len(robot.cables)} offsets [m], got {len(options.cable_offsets)}",
            field="cable_offsets",
            hint="one per cable, in the robot's order",
        )
    if options.lost_cable is not None:
        lost_cable_index(options.lost_cable, robot)


def _draw(options: SimulationOptions, rng: np.random.Generator) -> _Draw:
    turns = rng.uniform(-np.pi, np.pi, 4)
    friction, gain, speed = 1 + np.array([0.10, 0.05, 0.10]) * rng.uniform(-1, 1, 3)
    if not options.randomize:
        return _Draw(0.0, np.zeros(3), options.friction, 1.0, options.cable_speed)
    return _Draw(
        yaw=turns[0],
        imu_turns=turns[1:],
        friction=options.friction * friction,
        gain=gain,
        cable_speed=options.cable_speed * speed,
    )


def _ground_normal(options: SimulationOptions) -> FloatArray:
    slope, direction = np.radians([options.slope, options.slope_direction])
    uphill = np.array([np.cos(direction), np.sin(direction), 0.0])
    return np.cos(slope) * np.array([0.0, 0.0, 1.0]) - np.sin(slope) * uphill


def _lying(robot: Robot, up: FloatArray, yaw: float) -> FloatArray:
    """Endcaps (6, 3) of the undeformed robot with the first face on the ground at the origin."""
    endcaps = robot.undeformed_endcaps()
    face = endcaps[list(FACES[0])]
    inward = np.cross(face[1] - face[0], face[2] - face[0])
    inward *= np.sign(inward @ (endcaps.mean(axis=0) - face[0])) / np.linalg.norm(inward)
    upright, _ = Rotation.align_vectors(up, inward)
    rotation = Rotation.from_rotvec(yaw * up) * upright
    return rotation.apply(endcaps - face.mean(axis=0)) + robot.endcap_radius * up


def _settle(world: World) -> None:
    """Let the robot find its equilibrium under gravity and prestress."""
    for _ in range(round(_LONGEST_SETTLING_S / STEP_S)):
        world.step()
        if world.largest_speed() < _STILL_SPEED:
            return
    raise InputError(
        f"the robot does not come to rest within {_LONGEST_SETTLING_S:g} s of being put down",
        hint="lower the slope, raise the friction, or check the cables' rest lengths and damping",
    )


def _stand(log: StateLog[World], duration_s: float) -> None:
    for _ in range(round(duration_s / STEP_S)):
        log.step()


def _roll(
    log: StateLog[World],
    gait: Gait,
    cable_speed: float,
    path_length: float,
    progress: Progress | None,
) -> None:
    """Roll until the horizontal path of the centre of mass is ``path_length`` [m]."""
    world = log.world
    rest_lengths = world.rest_lengths()
    side = rest_lengths[:6]
    stride = cable_speed * STEP_S
    endcaps = world.endcaps()
    path, last_report, begin = 0.0, 0.0, log.steps
    limit_s = (_TRAVEL_TO_SET_OUT + path_length / _SLOWEST_ROLLING) / cable_speed
    while path < path_length:
        elapsed = (log.steps - begin) * STEP_S
        if elapsed > limit_s:
            raise InputError(
                f"the robot rolled {path:.2f} m of {path_length:.2f} m in {limit_s:.0f} s and is "
                "called stuck",
                hint="try another seed, a smaller slope or another friction",
            )
        wanted = gait.rest_lengths(elapsed, endcaps)
        for _ in range(_CONTROL_STEPS):
            side += np.clip(wanted - side, -stride, stride)
            world.command(rest_lengths)
            log.step()
        before, endcaps = endcaps, world.endcaps()
        path += float(np.linalg.norm((endcaps - before).mean(axis=0)[:2]))
        if progress is not None and (path - last_report) > 0.01 * path_length:
            last_report = path
            progress(min(path / path_length, 1.0))
    if progress is not None:
        progress(1.0)


def _come_to_rest(log: StateLog[World]) -> None:
    for _ in range(round(_LONGEST_COMING_TO_REST_S / STEP_S)):
        if log.world.largest_speed() < _STILL_SPEED:
            return
        log.step()


def _at_samples(count: int) -> slice:
    """The steps of a log at which the IMU's ``count`` samples are stamped."""
    return slice(IMU_STEPS, IMU_STEPS * (count + 1), IMU_STEPS)


def _recording(
    name: str,
    log: StateLog[World],
    options: SimulationOptions,
    imu_turns: FloatArray,
    rngs: list[np.random.Generator],
) -> Sequence:
    """What the sensors saw, and the truth."""
    imu_rng, cable_rng, contact_rng = rngs
    robot = log.world.robot
    rods = [log.rod(index) for index in range(len(robot.rods))]
    frames = [
        rod.mounted(robot.imu_offset, turn) for rod, turn in zip(rods, imu_turns, strict=True)
    ]
    misalignment = np.add(robot.imu_misalignment, options.imu_misalignment)
    base = imu_stream(frames[0], options, imu_rng, imu_rotation(misalignment))
    others = [
        imu_stream(frame, options, imu_rng, np.eye(3))
        for frame in (frames[1:] if options.rod_imus else [])
    ]
    t_ns = base.t_ns
    end = IMU_STEPS * (len(t_ns) + 1)
    since_start = slice(IMU_STEPS, end)
    endcaps = np.empty((log.steps, robot.number_of_endcaps, 3))
    for rod, (first, second) in zip(rods, robot.rods, strict=True):
        half_axis = rod.rotation.apply([0.0, 0.0, robot.rod_length / 2])
        endcaps[:, first] = rod.position + half_axis
        endcaps[:, second] = rod.position - half_axis
    endcaps = endcaps[since_start]
    at_samples = _at_samples(len(t_ns))
    return Sequence(
        name=name,
        robot=robot,
        imu=with_gaps(base, options),
        cables=without_lost_cable(cable_stream(endcaps, robot, options, cable_rng), robot, options),
        contacts=contact_stream(log.normal_forces()[since_start], options, contact_rng),
        groundtruth=PoseStream(
            t_ns=t_ns,
            position=frames[0].position[at_samples],
            quaternion=frames[0].rotation[at_samples].as_quat(),
        ),
        endcaps=EndcapStream(t_ns=stamps(len(t_ns), IMU_PERIOD_S), position=endcaps[::IMU_STEPS]),
        other_imus=dict(zip(ROD_IMUS, others, strict=False)),
    )
