"""Sensors that fall silent: gaps in the IMU's samples, and a cable whose length is lost.

Failures are timed from the start of the motion, which ``still_start`` puts in the recording: they
hit the same part of the motion however long the robot stands still before it.
"""

from __future__ import annotations

import numpy as np

from tensegrity.errors import InputError
from tensegrity.robots import Robot
from tensegrity.sequence.directory import cable_columns
from tensegrity.sequence.sequence import CableStream, ImuStream, IntArray
from tensegrity.simulation.options import SimulationOptions


def with_gaps(imu: ImuStream, options: SimulationOptions) -> ImuStream:
    """``imu`` without the samples in its gaps. A gap begins at every whole multiple of
    ``imu_gap_period`` after the start of the motion, the first after one period."""
    if options.imu_gap is None:
        return imu
    period = _nanoseconds(options.imu_gap_period)
    since_motion = _since_motion(imu.t_ns, options)
    in_gap = (since_motion >= period) & (since_motion % period < _nanoseconds(options.imu_gap))
    return ImuStream(imu.t_ns[~in_gap], imu.gyro[~in_gap], imu.accel[~in_gap])


def without_lost_cable(
    cables: CableStream, robot: Robot, options: SimulationOptions
) -> CableStream:
    """``cables`` with NaN for the lost cable as long as it is lost."""
    if options.lost_cable is None:
        return cables
    since_loss = _since_motion(cables.t_ns, options) - _nanoseconds(options.lost_cable_from)
    lost = since_loss >= 0
    if options.lost_cable_duration is not None:
        lost &= since_loss < _nanoseconds(options.lost_cable_duration)
    lengths = cables.lengths.copy()
    lengths[lost, lost_cable_index(options.lost_cable, robot)] = np.nan
    return CableStream(cables.t_ns, lengths)


def lost_cable_index(name: str, robot: Robot) -> int:
    """Index of the cable with the column ``name`` in ``cables.csv``.

    Raises :class:`InputError` when there is none.
    """
    names = [column.name for column in cable_columns(robot)]
    if name not in names:
        raise InputError(
            f"no cable is called '{name}'", field="lost_cable", hint=f"cables: {', '.join(names)}"
        )
    return names.index(name)


def _since_motion(t_ns: IntArray, options: SimulationOptions) -> IntArray:
    return t_ns - _nanoseconds(options.still_start)


def _nanoseconds(seconds: float) -> int:
    return round(seconds * 1e9)
