"""From a start in the plane to a solution in space that a local solver can finish.

The start knows no heights, and a wrong pattern of heights (an anchor below the floor instead of
above) is a minimum of its own. Several starts with random heights are refined on few knots, with
the losses and the rods' distances narrowing; the best one is kept.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tensegrity.ranging.calibration_frame import align
from tensegrity.ranging.calibration_model import (
    ANYWHERE_M,
    CalibrationModel,
    OffsetTerms,
    Strips,
    build_solver,
    positions_of,
    set_positions,
    shared_parts,
    snapshots,
)
from tensegrity.ranging.calibration_start import Start, find_start
from tensegrity.ranging.recording import Anchors, RangeRecording

FloatArray = NDArray[np.float64]

_KNOT_S = 1.0
_SNAPSHOT_S, _GAP_S = 0.25, 1.0
_ANCHOR_HEIGHT_M = 1.0  # standard deviation about the plane of the start
_HEIGHT_STD_M = 0.3  # of modules
_WANDER_STD_M = 0.1  # of modules in the plane about the start
# Scale of the loss in standard deviations, and standard deviations of the rods' distances and of
# the modules' heights about the plane [m].
_COARSE = (10.0, 0.5, 0.5)
_MIDDLE = (3.0, 0.2, ANYWHERE_M)
_RIVAL_COST = 1.1  # relative to the best: what noise alone may explain
_ITERATIONS = 40
_TOLERANCE = 1e-3


@dataclass(frozen=True)
class Guess:
    """``anchors_m`` (A, 3) and the modules' positions (K, 3) at ``knot_t`` [m], the common
    ``offset_m`` and the ``rod_lengths_m`` in the order of the recording's rods [m].

    ``cost`` is comparable among guesses of one recording; ``rival_m`` is how far an anchor of
    another guess that fits about as well is from this one [m], after alignment."""

    anchors_m: FloatArray
    offset_m: float
    rod_lengths_m: FloatArray
    knot_t: FloatArray
    modules_m: dict[int, FloatArray]
    cost: float
    rival_m: float = 0.0


def search(
    recording: RangeRecording,
    model: CalibrationModel,
    rng: np.random.Generator,
    attempts: int,
    progress: Callable[[float], None],
) -> Guess:
    """The best of several refined starts, in an arbitrary frame; no survey is needed or used.

    Raises :class:`InputError` when there is nothing to start from.
    """
    coarse = replace(model, offsets="constant", knot_s=_KNOT_S)
    unknown = Anchors(recording.anchors, np.full((len(recording.anchors), 3), np.nan))
    node, time, ranges = snapshots(recording, recording.anchors.tolist(), _SNAPSHOT_S, _GAP_S)
    enough = np.isfinite(ranges).sum(axis=1) >= 3
    node, time, ranges = node[enough], time[enough], ranges[enough]
    terms = OffsetTerms.of(coarse, recording.nodes, unknown.ids)
    strips = Strips.of(recording, coarse)
    first, second = (
        build_solver(
            recording, unknown, terms, strips, replace(coarse, rod_std=rod_std), height_std
        )
        for _, rod_std, height_std in (_COARSE, _MIDDLE)
    )
    loss = coarse.core_loss
    guesses: list[Guess] = []
    for attempt in range(attempts):
        start = find_start(ranges, model.offset_m, rng)
        rods = len(first.shared) - 3 * len(unknown) - len(terms)
        anchors = _with_heights(start, rng)
        first.shared = np.concatenate(
            [anchors.ravel(), [start.offset_m], np.full(rods, model.rod_length)]
        )
        set_positions(first, strips, _trajectories(start, node, time, strips.knot_t, rng))
        first.solve(loss, _COARSE[0], _ITERATIONS, _TOLERANCE)
        second.shared = first.shared
        set_positions(second, strips, positions_of(first, strips))
        _, _, cost = second.solve(loss, _MIDDLE[0], _ITERATIONS, _TOLERANCE)
        found, offset, lengths = shared_parts(second.shared, len(unknown), len(terms))
        modules = positions_of(second, strips)
        guesses.append(Guess(found, float(offset[0]), lengths, strips.knot_t, modules, cost))
        progress((attempt + 1) / attempts)
    if not guesses:
        raise ValueError("attempts: expected at least 1")
    best = min(guesses, key=lambda guess: guess.cost)
    rivals = [
        float(np.linalg.norm(_differences(guess, best), axis=1).max())
        for guess in guesses
        if guess.cost < _RIVAL_COST * best.cost
    ]
    return replace(best, rival_m=max(rivals))


def _differences(guess: Guess, other: Guess) -> FloatArray:
    """Differences (A, 3) [m] of the anchors of two guesses after the best alignment."""
    moved = align(guess.anchors_m, other.anchors_m)(guess.anchors_m)
    return moved - other.anchors_m


def _with_heights(start: Start, rng: np.random.Generator) -> FloatArray:
    """Anchors with random heights on one side of the plane: most stand higher than the robot.
    Those that were not found start in the middle of the others."""
    middle = np.nanmean(start.anchors_m, axis=0)
    anchors = np.where(np.isfinite(start.anchors_m), start.anchors_m, middle)
    anchors[:, 2] = np.abs(rng.normal(scale=_ANCHOR_HEIGHT_M, size=len(anchors)))
    return anchors


def _trajectories(
    start: Start,
    node: NDArray[np.int64],
    time: FloatArray,
    knot_t: FloatArray,
    rng: np.random.Generator,
) -> dict[int, FloatArray]:
    """Positions (K, 3) of every module at the knots, between those of the snapshots."""
    found = np.isfinite(start.modules_m).all(axis=1)
    middle = start.modules_m[found].mean(axis=0)
    spread = np.array([_WANDER_STD_M, _WANDER_STD_M, _HEIGHT_STD_M])
    modules = {}
    for one in np.unique(node).tolist():
        own = found & (node == one)
        at = np.tile(middle, (len(knot_t), 1))
        if own.any():
            at = np.column_stack(
                [np.interp(knot_t, time[own], start.modules_m[own, axis]) for axis in range(3)]
            )
        modules[one] = at * [1.0, 1.0, 0.0] + rng.normal(size=at.shape) * spread
    return modules
