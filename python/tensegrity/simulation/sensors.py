"""What the robot's sensors say about a motion that is known at every simulation step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tensegrity.robots import Robot
from tensegrity.sequence.sequence import CableStream, ContactStream, ImuStream
from tensegrity.simulation.options import ImuSampling, SimulationOptions
from tensegrity.simulation.rigid_bodies import GRAVITY, STEP_S

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

IMU_PERIOD_S = 0.005  # T §VI-A: 200 Hz
CABLE_PERIOD_S = 0.01  # T §VI-A: 100 Hz
CONTACT_PERIOD_S = 0.005
CONTACT_FORCE_N = 1.0
"""An endcap touches the ground when the normal force is larger."""

IMU_STEPS = round(IMU_PERIOD_S / STEP_S)
CABLE_STEPS = round(CABLE_PERIOD_S / STEP_S)
CONTACT_STEPS = round(CONTACT_PERIOD_S / STEP_S)


@dataclass(frozen=True)
class FrameMotion:
    """Motion of a frame, one row per simulation step.

    ``position`` (N, 3) and ``velocity`` (N, 3) in the world [m], [m/s]; ``rotation`` (N) of the
    frame in the world; ``angular_velocity`` (N, 3) in the frame [rad/s].
    """

    position: FloatArray
    velocity: FloatArray
    rotation: Rotation
    angular_velocity: FloatArray

    def mounted(self, offset: float, turn: float) -> FrameMotion:
        """Motion of a frame fixed to this one, ``offset`` [m] along z and turned about it
        by ``turn`` [rad]."""
        lever = np.array([0.0, 0.0, offset])
        mounting = Rotation.from_rotvec([0.0, 0.0, turn])
        return FrameMotion(
            position=self.position + self.rotation.apply(lever),
            velocity=self.velocity + self.rotation.apply(np.cross(self.angular_velocity, lever)),
            rotation=self.rotation * mounting,
            angular_velocity=mounting.inv().apply(self.angular_velocity),
        )


def stamps(count: int, period_s: float) -> IntArray:
    """``count`` stamps from zero [ns]."""
    return np.arange(count, dtype=np.int64) * round(period_s * 1e9)


def imu_stream(
    motion: FrameMotion,
    options: SimulationOptions,
    rng: np.random.Generator,
    mounting: FloatArray,
) -> ImuStream:
    """An IMU at the origin of the frame of ``motion``; ``mounting`` (3, 3) rotates from the IMU's
    axes to that frame's.

    Row :data:`IMU_STEPS` of ``motion`` is time zero: the first sample covers what comes before.
    Biases start at zero and walk.
    """
    samples = inertial_samples(motion, IMU_STEPS, options.imu_sampling)
    gyro, accel = (values @ mounting for values in samples)
    for values, noise, walk in (
        (gyro, options.gyro_noise, options.gyro_bias_walk),
        (accel, options.accel_noise, options.accel_bias_walk),
    ):
        steps = rng.normal(0.0, walk * np.sqrt(IMU_PERIOD_S), values.shape)
        steps[0] = 0
        values += np.cumsum(steps, axis=0) + rng.normal(0.0, noise, values.shape)
    return ImuStream(t_ns=stamps(len(gyro), IMU_PERIOD_S), gyro=gyro, accel=accel)


def inertial_samples(
    motion: FrameMotion, steps: int, sampling: ImuSampling
) -> tuple[FloatArray, FloatArray]:
    """Angular velocity (M, 3) [rad/s] and specific force (M, 3) [m/s^2] in the frame, one row per
    ``steps`` of the simulation, free of noise.

    Both are what moves the simulation: a step integrates the velocities at its *end*, and the
    specific force of a step is the change of velocity it makes. Integrating the samples leads
    along the motion itself, through every impact.
    """
    rate = motion.angular_velocity[1:]
    acceleration = np.diff(motion.velocity, axis=0) / STEP_S - GRAVITY
    middle = motion.rotation[:-1] * Rotation.from_rotvec(rate * STEP_S / 2)
    force = middle.inv().apply(acceleration)
    samples = len(rate) // steps
    shape = (samples, steps, 3)
    rate = rate[: samples * steps].reshape(shape)
    force = force[: samples * steps].reshape(shape)
    if sampling == "instantaneous":
        return rate[:, -1].copy(), force[:, -1].copy()
    return rate.mean(axis=1), force.mean(axis=1)


def cable_stream(
    endcaps: FloatArray, robot: Robot, options: SimulationOptions, rng: np.random.Generator
) -> CableStream:
    """Distances of endcap centres from ``endcaps`` (N, 6, 3), one row per step from time zero."""
    sampled = endcaps[::CABLE_STEPS]
    pairs = np.array([cable.endcaps for cable in robot.cables])
    lengths = np.linalg.norm(sampled[:, pairs[:, 0]] - sampled[:, pairs[:, 1]], axis=2)
    lengths += np.array(robot.cable_offsets)
    if options.cable_offsets is not None:
        lengths += np.array(options.cable_offsets)
    lengths += rng.normal(0.0, options.cable_noise, lengths.shape)
    lengths += rng.normal(0.0, options.cable_offset_std, len(robot.cables))
    return CableStream(t_ns=stamps(len(lengths), CABLE_PERIOD_S), lengths=lengths)


def contact_stream(
    normal_force: FloatArray, options: SimulationOptions, rng: np.random.Generator
) -> ContactStream:
    """Contact flags from ``normal_force`` (N, 6) [N], one row per step from time zero."""
    touching = normal_force[::CONTACT_STEPS] > CONTACT_FORCE_N
    chance = rng.random(touching.shape)
    flags = np.where(
        touching, chance >= options.contact_missing_rate, chance < options.contact_false_rate
    )
    return ContactStream(t_ns=stamps(len(flags), CONTACT_PERIOD_S), flags=flags)
