"""The estimator of ranging robots on the real rolling test, and its time against plain NumPy.

    python benchmarks/ukf.py ../shared/data/superball/rolling_indoor

Prints the error on the floor with the settings as they are, with each of them changed by a factor
of two, and with the filter as published; then the time of one update (145 sigma points, 20 RK4
steps, 24 ranges) here and in a straightforward NumPy version of the same arithmetic.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import tensegrity._core as core
from tensegrity import tracking
from tensegrity.dynamics import at_rest, core_net
from tensegrity.ranging.sequence import RangingSequence, read_sequence
from tensegrity.robots import Net, load_net

FloatArray = NDArray[np.float64]

STEPS, DT = 20, 0.005
SCALED = ("body_acceleration", "node_acceleration", "range_std", "gate", "spread")


def floor_table(sequence: RangingSequence) -> None:
    """Errors in x and y of the ends of the rods on the floor, by setting."""
    settings = {"as it is": tracking.TrackSettings()}
    for name in SCALED:
        for factor in (0.5, 2.0):
            config = core.RangingConfig()
            setattr(config, name, factor * getattr(config, name))
            settings[f"{name} x {factor:g}"] = tracking.TrackSettings(config)
    for factor in (0.5, 2.0):
        default = tracking.TrackSettings()
        settings[f"offset stds x {factor:g}"] = tracking.TrackSettings(
            offset_std=factor * default.offset_std,
            unknown_offset_std=factor * default.unknown_offset_std,
        )
    settings["as published"] = tracking.paper_settings()
    literature = tracking.paper_settings()
    literature.filter.filter.weights = core.SigmaWeights.SCALED
    settings["as published, scaled weights"] = literature
    print(f"{'setting':32s} {'x, y [m]':>9s} {'2-D [m]':>9s} {'rejected':>9s} {'restarts':>9s}")
    for name, setting in settings.items():
        track = tracking.track(sequence, settings=setting)
        assert sequence.floor_truth is not None
        error = tracking.floor_errors(track, sequence.floor_truth)
        health = track.health
        print(
            f"{name:32s} {np.sqrt(np.mean(error**2)):9.3f} "
            f"{np.sqrt(np.mean(np.sum(error**2, axis=1))):9.3f} "
            f"{health.ranges_rejected:9d} {health.restarts:9d}"
        )


def numpy_update(net: Net, root: FloatArray, mean: FloatArray, anchors: FloatArray) -> FloatArray:
    """One prediction and correction, vectorised over sigma points as one would write it in NumPy;
    the ground's friction is left out, which is in favour of NumPy."""
    size = len(mean)
    n = size // 2
    alpha = np.sqrt(3 / size)
    spread, weight = np.sqrt(3.0), 1 / 6
    points = np.vstack([mean, mean + spread * root.T, mean - spread * root.T])
    ends = np.vstack([net.rod_ends(), net.cable_ends()])
    members = (*net.rods, *net.cables)
    stiffness = np.array([m.stiffness for m in members])
    damping = np.array([m.damping for m in members])
    rods = len(net.rods)
    rest = np.concatenate([np.full(rods, net.rod_length), net.rest_lengths()])

    def rate(state: FloatArray) -> FloatArray:
        x = state[:, :n].reshape(len(state), -1, 3)
        v = state[:, n:].reshape(len(state), -1, 3)
        d, w = x[:, ends[:, 1]] - x[:, ends[:, 0]], v[:, ends[:, 1]] - v[:, ends[:, 0]]
        length = np.linalg.norm(d, axis=2)
        force = stiffness * (length - rest) + damping * np.sum(d * w, axis=2) / length
        slack = (length < rest) | (force < 0)
        slack[:, :rods] = False
        pull = np.where(slack, 0, force / length)[:, :, None] * d
        acceleration = np.zeros_like(x)
        for member, (a, b) in enumerate(ends):
            acceleration[:, a] += pull[:, member]
            acceleration[:, b] -= pull[:, member]
        depth = np.maximum(-x[:, :, 2], 0)
        ground = net.ground
        normal = depth * (ground.stiffness - ground.damping * v[:, :, 2])
        acceleration[:, :, 2] += np.maximum(normal, 0)
        acceleration /= net.node_mass
        acceleration[:, :, 2] -= 9.81
        return np.hstack([state[:, n:], acceleration.reshape(len(state), -1)])

    for _ in range(STEPS):
        k1 = rate(points)
        k2 = rate(points + DT / 2 * k1)
        k3 = rate(points + DT / 2 * k2)
        k4 = rate(points + DT * k3)
        points = points + DT / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    deviations = points[1:] - points[0]
    shift = weight * deviations.sum(axis=0)
    predicted = points[0] + shift
    covariance = weight * deviations.T @ deviations + (2 - alpha**2) * np.outer(shift, shift)
    covariance += 1e-3 * np.eye(size)
    root = np.linalg.cholesky(covariance)
    points = np.vstack([predicted, predicted + spread * root.T, predicted - spread * root.T])
    modules = net.module_positions(points[:, :n].reshape(len(points), -1, 3))
    ranges = np.linalg.norm(modules[:, :, None] - anchors, axis=3).reshape(len(points), -1)[:, :24]
    deviations_z = ranges[1:] - ranges[0]
    shift_z = weight * deviations_z.sum(axis=0)
    innovation = weight * deviations_z.T @ deviations_z + 0.01 * np.eye(24)
    cross = weight * (points[1:] - points[0]).T @ deviations_z
    gain = np.linalg.solve(innovation, cross.T).T
    covariance -= gain @ innovation @ gain.T
    result: FloatArray = predicted + gain @ (ranges[0] - (ranges[0] + shift_z))
    return result


def core_time(net: Net, anchors: FloatArray) -> float:
    """Median time [s] of an update of the C++ estimator with 24 new ranges."""
    unknown = np.zeros((len(net.nodes), len(anchors)))
    estimator = core.RangingEstimator(
        tracking.core_robot(net),
        core.RangingAnchors(anchors, unknown, unknown + 0.05, np.zeros((len(net.nodes),) * 2)),
        core_net(net),
        net.rest_lengths(),
        core.RangingConfig(),
    )
    modules = net.module_positions(net.standing_on((6, 8, 9)))
    times = []
    for step in range(200):
        t_ns = step * 100_000_000
        for k in range(24):
            node, anchor = (k + step) % 12, (k // 6 + step) % len(anchors)
            estimator.range(
                t_ns, node, anchor, float(np.linalg.norm(modules[node] - anchors[anchor]))
            )
        started = time.perf_counter()
        if estimator.update(t_ns) == core.Status.OK:
            times.append(time.perf_counter() - started)
    return float(np.median(times))


def numpy_time(net: Net, anchors: FloatArray) -> float:
    """Median time [s] of an update in NumPy."""
    mean = at_rest(net.standing_on((6, 8, 9)))
    root = 0.01 * np.eye(len(mean))
    times = []
    for _ in range(7):
        started = time.perf_counter()
        assert np.isfinite(numpy_update(net, root, mean, anchors)).all()
        times.append(time.perf_counter() - started)
    return float(np.median(times))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sequence", type=Path, nargs="?", help="recording with floor_truth.csv")
    arguments = parser.parse_args()
    if arguments.sequence is not None:
        floor_table(read_sequence(arguments.sequence))
    net = load_net("superball")
    anchors = np.array(
        [[5.0, 5.0, 1.0], [-5.0, 5.0, 2.0], [-5.0, -5.0, 3.0], [5.0, -5.0, 2.0], [0.0, 6.0, 4.0]]
    )
    ours, plain = core_time(net, anchors), numpy_time(net, anchors)
    print(
        f"one update: {1e3 * ours:.2f} ms, in NumPy {1e3 * plain:.1f} ms, {plain / ours:.0f} times"
    )


if __name__ == "__main__":
    main()
