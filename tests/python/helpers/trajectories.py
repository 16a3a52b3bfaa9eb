"""Trajectories without an estimator."""

from __future__ import annotations

import numpy as np

from tensegrity.sequence import Sequence
from tensegrity.trajectory import Trajectory


def true_trajectory(sequence: Sequence) -> Trajectory:
    """The truth of a recording as an estimate: zero velocity and biases, 1 cm, 0.01 rad and
    0.01 m/s of uncertainty."""
    truth, endcaps, contacts = sequence.groundtruth, sequence.endcaps, sequence.contacts
    assert truth is not None
    assert endcaps is not None
    assert contacts is not None
    n = len(truth.t_ns)
    covariance = np.tile(1e-4 * np.eye(3), (n, 1, 1))
    return Trajectory(
        t_ns=truth.t_ns,
        position=truth.position,
        quaternion=truth.quaternion,
        velocity=np.zeros((n, 3)),
        gyro_bias=np.zeros((n, 3)),
        accel_bias=np.zeros((n, 3)),
        spin=np.zeros(n),
        endcaps_body=np.tile(sequence.robot.undeformed_endcaps(), (n, 1, 1)),
        endcaps_world=endcaps.position,
        contacts=contacts.flags,
        position_covariance=covariance,
        orientation_covariance=covariance.copy(),
        velocity_covariance=covariance.copy(),
        health={"gaps": np.zeros(n, dtype=np.int64), "rejected": np.arange(n, dtype=np.int64)},
        runtime_s=0.25,
        info={"method": "full"},
    )
