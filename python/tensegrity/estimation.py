"""From sensors to pose and shape: sample by sample, or a whole recording at once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import tensegrity._core as _core
from tensegrity.config import FilterConfig
from tensegrity.errors import InputError
from tensegrity.robots import Robot
from tensegrity.robots import load as load_robot
from tensegrity.robots.mounting import imu_rotation
from tensegrity.sequence import Sequence
from tensegrity.sequence.sequence import ROD_IMUS
from tensegrity.trajectory import Trajectory

Progress = Callable[[float], None]


class PrismEstimator(_core.PrismEstimator):
    """The streaming estimator of a 3-bar prism; the C++ class has the same names and units.

    ``imu``, ``cables`` and ``contacts`` take a stamp in integer nanoseconds and may be called in
    any interleaving; each returns a :class:`tensegrity._core.Status`. ``state`` is the estimate at
    the newest IMU sample. IMU samples are in the frame of the IMU, which the robot's
    ``imu_misalignment`` turns into the body frame; the robot's ``cable_offsets`` are taken off the
    lengths.

    ``robot`` and ``config`` are models, names of packaged ones, or paths to YAML files.
    """

    def __init__(
        self,
        robot: Robot | str | Path = "prism3",
        config: FilterConfig | str | Path = "full",
    ) -> None:
        robot = robot if isinstance(robot, Robot) else load_robot(robot)
        config = config if isinstance(config, FilterConfig) else FilterConfig.load(config)
        super().__init__(
            core_robot(robot),
            core_config(config),
            tight=config.settings.filter == "tight",
            # None leaves samples as they are: most robots need no correction.
            imu_rotation=(
                imu_rotation(robot.imu_misalignment) if any(robot.imu_misalignment) else None
            ),
            cable_offsets=robot.cable_offsets if any(robot.cable_offsets) else None,
        )


def estimate(
    sequence: Sequence,
    robot: Robot | str | Path | None = None,
    config: FilterConfig | str | Path = "full",
    progress: Progress | None = None,
) -> Trajectory:
    """Replays a whole recording through the estimator.

    ``robot`` replaces the one the recording names. ``progress`` is called with the fraction done.
    Raises :class:`InputError` when the robot never stood still long enough to start.
    """
    robot = sequence.robot if robot is None else robot
    config = config if isinstance(config, FilterConfig) else FilterConfig.load(config)
    estimator = PrismEstimator(robot, config)
    contacts = sequence.contacts
    arrays, runtime_s = estimator.replay(
        sequence.imu.t_ns,
        sequence.imu.gyro,
        sequence.imu.accel,
        sequence.cables.t_ns,
        sequence.cables.lengths,
        None if contacts is None else contacts.t_ns,
        None if contacts is None else contacts.flags,
        [
            (rod, imu.t_ns, imu.gyro, imu.accel)
            for rod, name in enumerate(ROD_IMUS, start=1)
            if (imu := sequence.other_imus.get(name)) is not None
        ],
        progress,
    )
    if len(arrays["t_ns"]) == 0:
        raise _never_started(sequence, config)
    info = {"sequence": sequence.name, "method": config.settings.method}
    return Trajectory(**arrays, runtime_s=runtime_s, info=info)


def _never_started(sequence: Sequence, config: FilterConfig) -> InputError:
    settings = config.settings
    return InputError(
        f"the robot of '{sequence.name}' never stood still for {settings.init_bias_size} IMU "
        f"samples (scatter below {settings.static_gyro_limit} rad/s and "
        f"{settings.static_accel_limit} m/s^2) with cable lengths that fit its shape",
        hint="record a still start, or set settings.static_bias_initialization: false",
    )


def core_robot(robot: Robot) -> _core.Prism:
    """The geometry that the C++ core needs."""
    return _core.Prism(
        rod_length=robot.rod_length,
        imu_offset=robot.imu_offset,
        endcap_radius=robot.endcap_radius,
        side_length=robot.side_length,
        chirality=_core.Chirality[robot.chirality.upper()],
    )


# Where YAML and C++ name the same field differently: a walk and a prior may both be called
# `spin_std` in their sections of the YAML, but share one struct in C++.
_CORE_NAMES = {
    ("priors", "spin_std"): "spin_prior_std",
    ("noises", "gyroscope_bias_std"): "gyroscope_bias_walk",
    ("noises", "accelerometer_bias_std"): "accelerometer_bias_walk",
    ("noises", "spin_std"): "spin_walk",
}
_CORE_ENUMS = {
    "shape": _core.ShapeMethod,
    "spin": _core.SpinMethod,
    "contact_point": _core.ContactPoint,
    "contact_noise": _core.ContactNoise,
    "imu_sampling": _core.ImuSampling,
    "terrain": _core.Terrain,
}


def core_config(config: FilterConfig) -> _core.PrismConfig:
    """The plain struct that the C++ core takes."""
    core = _core.PrismConfig()
    for section in ("settings", "priors", "noises"):
        for name, value in getattr(config, section):
            if (section, name) in (("settings", "method"), ("settings", "filter")):
                continue
            if name in _CORE_ENUMS:
                value = _CORE_ENUMS[name][value.upper()]
            setattr(core, _CORE_NAMES.get((section, name), name), value)
    return core
