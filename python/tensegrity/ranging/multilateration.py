"""Positions of modules from distances to anchors, many at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_CLOSEST_M = 1e-6
_INFORMATION = 1e-6  # of the start [1/m^2]: holds what no distance tells
_FIRST_DAMPING = 1e-2
_NARROWING = (30.0, 5.0, 1.0)
_ITERATIONS = 4  # at each scale


def locate(
    anchors_m: FloatArray,
    distances_m: FloatArray,
    start_m: FloatArray,
    loss_scale_m: float,
) -> tuple[FloatArray, FloatArray]:
    """Positions (S, 3) [m] that fit ``distances_m`` (S, K) to ``anchors_m`` (A, 3) or (S, K, 3),
    and the cost (S,) of each.

    Levenberg-Marquardt from ``start_m`` (S, 3), with Cauchy's loss, which turns at
    ``loss_scale_m``; the cost is in units of its square. NaN distances are ignored.
    """
    position = np.array(start_m, dtype=np.float64)
    # Cauchy's loss is flat where all residuals are large: it narrows as the position gets better.
    for factor in _NARROWING:
        position, cost = _descend(anchors_m, distances_m, position, factor * loss_scale_m)
    return position, cost


def _descend(
    anchors_m: FloatArray,
    distances_m: FloatArray,
    start_m: FloatArray,
    scale_m: float,
) -> tuple[FloatArray, FloatArray]:
    measured = np.isfinite(distances_m)
    distances = np.where(measured, distances_m, 0.0)

    def evaluate(position: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        offset = position[:, None, :] - anchors_m
        length = np.maximum(np.linalg.norm(offset, axis=2), _CLOSEST_M)
        error = (length - distances) / scale_m
        away = position - start_m
        cost = (measured * np.log1p(error**2)).sum(axis=1)
        cost += _INFORMATION * (away**2).sum(axis=1)
        return offset / length[:, :, None], error, away, cost

    position = start_m.copy()
    damping = np.full(len(position), _FIRST_DAMPING)
    direction, error, away, cost = evaluate(position)
    for _ in range(_ITERATIONS):
        weighted = (measured / (1 + error**2))[:, :, None] * direction
        information = np.matmul(weighted.transpose(0, 2, 1), direction) / scale_m**2
        information[:, range(3), range(3)] += _INFORMATION
        gradient = (weighted * error[:, :, None]).sum(axis=1) / scale_m + _INFORMATION * away
        ridge = damping * np.trace(information, axis1=1, axis2=2) / 3
        information[:, range(3), range(3)] += ridge[:, None]
        trial = position - np.linalg.solve(information, gradient[:, :, None])[:, :, 0]
        tried = evaluate(trial)
        better = tried[3] <= cost
        position[better] = trial[better]
        for kept, new in zip((direction, error, away, cost), tried, strict=True):
            kept[better] = new[better]
        damping = np.where(better, damping * 0.2, damping * 5)
    return position, cost


def locate_either_side(
    anchors_m: FloatArray,
    distances_m: FloatArray,
    middle_m: FloatArray,
    normal: FloatArray,
    loss_scale_m: float,
) -> FloatArray:
    """The better of :func:`locate`'s results from both sides, 1 m along the unit ``normal`` (3,),
    of ``middle_m`` (3,): anchors near a plane see a module and its mirror image alike."""
    found, best = np.empty((len(distances_m), 3)), np.full(len(distances_m), np.inf)
    for side in (-1.0, 1.0):
        start = np.broadcast_to(middle_m + side * normal, found.shape)
        position, cost = locate(anchors_m, distances_m, start, loss_scale_m)
        better = cost < best
        found[better], best[better] = position[better], cost[better]
    return found


def plane_normal(points_m: FloatArray) -> FloatArray:
    """Unit normal (3,) of the plane closest to ``points_m`` (N, 3)."""
    return np.linalg.svd(points_m - points_m.mean(axis=0), full_matrices=False)[2][2]
