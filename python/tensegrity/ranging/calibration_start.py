"""A start for the calibration that needs no survey: algebra instead of search.

A robot that rolls stays near a plane, and so do most anchors. With distances d_i in that plane from
a module at p to anchors a_i, and anchor 0 in the origin,

    d_i^2 - d_0^2 = |a_i|^2 - 2 a_i . p        (linear in p)
    d_0^2 = |p|^2 + height^2                   (quadratic in p, the height about constant)

Three anchors give two differences x that are an affine image of p, so d_0^2 is a quadratic form of
x, found by linear least squares from snapshots of the moving robot. Its matrix Q = G'G is the
metric: p = G x + h, and the anchors follow. Further anchors are linear in (|a|^2, a) where p is
known. The common offset is the one unknown that is not linear: a few values are tried. Heights are
left to the refinement (:mod:`tensegrity.ranging.calibration_search`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tensegrity.errors import InputError
from tensegrity.ranging.multilateration import locate

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LEAST_SNAPSHOTS = 15
"""With ranges to the same three anchors; the quadratic form has six coefficients."""

_TRIPLES = 3  # tried per start
_MOST_SNAPSHOTS = 400  # to one set of anchors; as many as C takes of its recording
_OFFSET_STEPS_M = (-0.2, 0.2)  # about the expected offset: errors of 0.2 m shift anchors by as much
_GROWN_SNAPSHOTS = 200  # from which further anchors are found
_PLACED_SNAPSHOTS = 500  # between which modules start
_LEAST_EIGENVALUE = 0.02  # of the metric, relative: flatter triangles are noise
_ROBUST_ROUNDS = 6
_LEAST_TURN_M = 0.1  # residual at which the loss turns, at least
_LOSS_SCALE_M = 0.3  # of ranges to anchors that are metres off in height


@dataclass(frozen=True)
class Start:
    """``anchors_m`` (A, 3) and positions ``modules_m`` (S, 3) of the snapshots [m], NaN where not
    found, and the common ``offset_m`` [m]."""

    anchors_m: FloatArray
    modules_m: FloatArray
    offset_m: float


def find_start(ranges_m: FloatArray, offset_m: float, rng: np.random.Generator) -> Start:
    """A start from snapshots ``ranges_m`` (S, A), NaN where not measured, of modules to anchors,
    by random choice of the anchors and snapshots that it is made from.

    Raises :class:`InputError` when no three anchors were ranged together often enough.
    """
    best: tuple[float, float, IntArray, FloatArray] | None = None
    for tried, triple in enumerate(_triples(ranges_m, rng)):
        if tried >= _TRIPLES and best is not None:
            break
        common = ranges_m[:, triple]
        common = rng.permutation(common[np.isfinite(common).all(axis=1)])[:_MOST_SNAPSHOTS]
        for step in _OFFSET_STEPS_M:
            solution = closed_form(common, offset_m + step)
            if solution is not None and (best is None or solution[1] < best[0]):
                best = (solution[1], offset_m + step, triple, solution[0])
    if best is None:
        raise InputError(
            f"no three anchors were ranged by one module at the same time in {LEAST_SNAPSHOTS} "
            "places or more that differ",
            hint="record longer, while the robot moves through the area of the anchors",
        )
    _, offset, triple, positions = best
    anchors = np.full((ranges_m.shape[1], 3), np.nan)
    anchors[triple] = positions
    while True:
        some = _seen_by(anchors, ranges_m, rng, _GROWN_SNAPSHOTS)
        modules = place_modules(anchors, ranges_m[some], offset)
        grown = _grow(anchors, ranges_m[some] - offset, modules)
        if np.array_equal(grown, anchors, equal_nan=True):
            break
        anchors = grown
    some = _seen_by(anchors, ranges_m, rng, _PLACED_SNAPSHOTS)
    modules = np.full((len(ranges_m), 3), np.nan)
    modules[some] = place_modules(anchors, ranges_m[some], offset)
    return Start(anchors, modules, offset)


def closed_form(ranges_m: FloatArray, offset_m: float) -> tuple[FloatArray, float] | None:
    """Positions (3, 3) [m] of three anchors in the plane z = 0, the first in the origin, from raw
    ``ranges_m`` (S, 3) with one offset, and the median misfit [m].

    None when the snapshots do not determine them.
    """
    distances = ranges_m - offset_m
    squared = distances**2
    differences = squared[:, 1:] - squared[:, :1]
    if len(ranges_m) < LEAST_SNAPSHOTS:
        return None
    middle, spread = np.median(differences, axis=0), differences.std(axis=0)
    if not (spread > 0).all():
        return None
    x, y = ((differences - middle) / spread).T
    design = np.column_stack([x * x, y * y, 2 * x * y, x, y, np.ones(len(x))])
    # An error e of the distance d is one of 2 d e in its square.
    scale = 1 / np.maximum(2 * distances[:, 0], 0.5)
    solution, residual = _robust_least_squares(design * scale[:, None], squared[:, 0] * scale)
    metric = np.array([[solution[0], solution[2]], [solution[2], solution[1]]])
    values, vectors = np.linalg.eigh(metric)
    if values[-1] <= 0:
        return None
    values = np.maximum(values, _LEAST_EIGENVALUE * values[-1])
    root = np.sqrt(values)[:, None] * vectors.T
    anchors = np.zeros((3, 3))
    anchors[1:, :2] = -0.5 * spread[:, None] * np.linalg.inv(root)
    return anchors, float(np.median(np.abs(residual)))


def place_modules(anchors_m: FloatArray, ranges_m: FloatArray, offset_m: float) -> FloatArray:
    """Positions (S, 3) [m] of modules from three ranges or more of (S, A); NaN elsewhere."""
    known = np.isfinite(anchors_m).all(axis=1)
    position = np.full((len(ranges_m), 3), np.nan)
    enough = np.isfinite(ranges_m[:, known]).sum(axis=1) >= 3
    anchors, distances = anchors_m[known], ranges_m[enough][:, known] - offset_m
    # One metre off the plane: in it, nothing tells up from down. Which side is settled later.
    above = anchors.mean(axis=0)
    above[2] += 1.0
    start = np.broadcast_to(above, (len(distances), 3))
    position[enough] = locate(anchors, distances, start, _LOSS_SCALE_M)[0]
    return position


def _seen_by(
    anchors: FloatArray, ranges_m: FloatArray, rng: np.random.Generator, most: int
) -> IntArray:
    """Up to ``most`` random snapshots that see three known anchors."""
    known = np.isfinite(anchors).all(axis=1)
    seen = np.flatnonzero(np.isfinite(ranges_m[:, known]).sum(axis=1) >= 3)
    return rng.permutation(seen)[:most]


def _grow(anchors: FloatArray, distances: FloatArray, modules: FloatArray) -> FloatArray:
    """``anchors`` with unknown ones found from modules whose position is known."""
    grown = anchors.copy()
    located = np.isfinite(modules).all(axis=1)
    for anchor in np.flatnonzero(~np.isfinite(anchors).all(axis=1)):
        seen = located & np.isfinite(distances[:, anchor])
        if seen.sum() < LEAST_SNAPSHOTS:
            continue
        d, middle = distances[seen, anchor], modules[seen].mean(axis=0)
        p = modules[seen] - middle
        # d^2 - |p|^2 = |a|^2 - 2 a . p
        design = np.column_stack([-2 * p, np.ones(len(p))])
        scale = 1 / np.maximum(2 * d, 0.5)
        target = d**2 - (p**2).sum(axis=1)
        solution, _ = _robust_least_squares(design * scale[:, None], target * scale)
        found, _ = locate(p, d[None], solution[None, :3], _LOSS_SCALE_M)
        grown[anchor] = found[0] + middle
    return grown


def _triples(ranges_m: FloatArray, rng: np.random.Generator) -> Iterator[IntArray]:
    """Three anchors at a time in random order, those with more common snapshots rather first."""
    seen = np.isfinite(ranges_m)
    triples = [np.array(triple) for triple in combinations(range(ranges_m.shape[1]), 3)]
    counts = np.array([seen[:, triple].all(axis=1).sum() for triple in triples])
    usable = np.flatnonzero(counts >= LEAST_SNAPSHOTS)
    # Exponential keys over weights: a weighted random order without replacement.
    keys = rng.exponential(size=len(usable)) / counts[usable]
    for index in usable[np.argsort(keys)]:
        yield triples[int(index)]


def _robust_least_squares(design: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Solution and residuals for Cauchy's loss by reweighting, its scale the residuals' own."""
    weight = np.ones(len(target))
    for _ in range(_ROBUST_ROUNDS):
        solution = np.asarray(
            np.linalg.lstsq(design * weight[:, None], target * weight, rcond=1e-10)[0],
            dtype=np.float64,
        )
        residual = np.asarray(target - design @ solution, dtype=np.float64)
        turn = max(_LEAST_TURN_M, 1.5 * float(np.median(np.abs(residual))))
        weight = 1 / np.sqrt(1 + (residual / turn) ** 2)
    return solution, residual
