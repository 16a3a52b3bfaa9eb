"""Positions of modules from distances to anchors, many at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_CLOSEST_M = 1e-6
_FIRST_DAMPING = 1e-2
_NARROWING = (30.0, 5.0, 1.0)
_ITERATIONS = 4  # at each scale


@dataclass(frozen=True)
class Whereabouts:
    """Where modules are before they are ranged: ``mean_m`` (3,) [m], ``covariance`` (3, 3) [m^2].

    A robot on the ground is somewhere in the area and low; where few anchors answer, or all of them
    in one plane, this decides between positions that fit equally well.
    """

    mean_m: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, position_m: FloatArray, widened: float = 2.0) -> Whereabouts:
        """Of a recorded trajectory (N, 3) [m], its spread ``widened``."""
        ridge = 1e-4 * np.eye(3)  # [m^2], for trajectories in a plane
        return cls(position_m.mean(axis=0), widened**2 * np.cov(position_m.T) + ridge)

    @property
    def information(self) -> FloatArray:
        """Inverse of the covariance [1/m^2]."""
        return np.asarray(np.linalg.inv(self.covariance), dtype=np.float64)

    @classmethod
    def unknown(cls) -> Whereabouts:
        """Anywhere within a kilometre or so."""
        return cls(np.zeros(3), 1e6 * np.eye(3))


def locate(
    anchors_m: FloatArray,
    distances_m: FloatArray,
    start_m: FloatArray,
    loss_scale_m: float,
    whereabouts: Whereabouts | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Positions (S, 3) [m] that fit ``distances_m`` (S, K) to ``anchors_m`` (A, 3) or (S, K, 3),
    and the cost (S,) of each.

    Levenberg-Marquardt from ``start_m`` (S, 3), with Cauchy's loss, which turns at
    ``loss_scale_m``; the cost is in units of its square. NaN distances are ignored.
    """
    before = whereabouts or Whereabouts.unknown()
    position = np.array(start_m, dtype=np.float64)
    # Cauchy's loss is flat where all residuals are large: it narrows as the position gets better.
    for factor in _NARROWING:
        position, cost = _descend(
            anchors_m, distances_m, position, factor * loss_scale_m, loss_scale_m, before
        )
    return position, cost


def _descend(
    anchors_m: FloatArray,
    distances_m: FloatArray,
    start_m: FloatArray,
    scale_m: float,
    std_m: float,
    before: Whereabouts,
) -> tuple[FloatArray, FloatArray]:
    measured = np.isfinite(distances_m)
    distances = np.where(measured, distances_m, 0.0)
    prior = before.information

    def evaluate(position: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        offset = position[:, None, :] - anchors_m
        length = np.maximum(np.linalg.norm(offset, axis=2), _CLOSEST_M)
        error = (length - distances) / scale_m
        away = position - before.mean_m
        loss = (scale_m / std_m) ** 2 * np.log1p(error**2)
        cost = (measured * loss).sum(axis=1) + ((away @ prior) * away).sum(axis=1)
        return offset / length[:, :, None], error, away, cost

    position = start_m.copy()
    damping = np.full(len(position), _FIRST_DAMPING)
    direction, error, away, cost = evaluate(position)
    for _ in range(_ITERATIONS):
        weighted = (measured / (1 + error**2))[:, :, None] * direction
        information = np.matmul(weighted.transpose(0, 2, 1), direction) / std_m**2 + prior
        gradient = (weighted * error[:, :, None]).sum(axis=1) * scale_m / std_m**2 + away @ prior
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
    whereabouts: Whereabouts | None = None,
) -> FloatArray:
    """The better of :func:`locate`'s results from both sides, 1 m along the unit ``normal`` (3,),
    of ``middle_m`` (3,): anchors near a plane see a module and its mirror image alike."""
    found, best = np.empty((len(distances_m), 3)), np.full(len(distances_m), np.inf)
    for side in (-1.0, 1.0):
        start = np.broadcast_to(middle_m + side * normal, found.shape)
        position, cost = locate(anchors_m, distances_m, start, loss_scale_m, whereabouts)
        better = cost < best
        found[better], best[better] = position[better], cost[better]
    return found


def plane_normal(points_m: FloatArray) -> FloatArray:
    """Unit normal (3,) of the plane closest to ``points_m`` (N, 3)."""
    return np.linalg.svd(points_m - points_m.mean(axis=0), full_matrices=False)[2][2]
