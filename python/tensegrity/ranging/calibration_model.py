"""Ranges as the solver of the calibration takes them: knots, strips, offset terms, priors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from tensegrity.ranging.recording import Anchors, RangeRecording

if TYPE_CHECKING:
    from tensegrity._core import RangeCalibrationSolver, RangeLoss

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

OffsetModel = Literal["constant", "module", "pair"]
Loss = Literal["cauchy", "huber", "squares"]

ANYWHERE_M = 100.0
"""Standard deviation of a position of which nothing is known: recordings are local."""

_MOST_TERMS = 4  # of one range's offset, as the C++ core has it


@dataclass(frozen=True)
class CalibrationModel:
    """What is assumed about ranges, rods, motion and offsets; standard deviations unless said.

    * ``offsets``: one for all ranges, plus one term per module, plus one per pair
    * ``loss`` of range residuals and where it turns, ``loss_scale`` in ``range_std``
    * ``range_std`` of a good range [m], ``rod_std`` of the distance between a rod's modules [m]
    * ``rod_length`` and ``rod_length_std``: what is known about that distance [m]
    * ``survey_std`` of given coordinates of anchors [m]
    * ``knot_s``: time between knots of the trajectory, linear in between [s]
    * ``diffusion``: how fast modules wander, a random walk's variance per time [m^2/s]
    * ``offset_m``, ``offset_std``: what is known about the common offset [m]
    * ``module_std``, ``pair_std``: spread of the terms of modules and pairs about it [m]
    """

    offsets: OffsetModel = "module"
    loss: Loss = "cauchy"
    loss_scale: float = 3.0
    range_std: float = 0.06
    rods: tuple[tuple[int, int], ...] = ((1, 2), (3, 4), (5, 6), (7, 8), (9, 10), (11, 12))
    rod_length: float = 1.6
    rod_length_std: float = 0.1
    rod_std: float = 0.03
    survey_std: float = 0.05
    knot_s: float = 0.4
    diffusion: float = 0.1
    offset_m: float = 3.95
    offset_std: float = 0.15
    module_std: float = 0.05
    pair_std: float = 0.05

    @property
    def core_loss(self) -> RangeLoss:
        """The loss as the C++ core names it."""
        from tensegrity._core import RangeLoss

        return RangeLoss[self.loss]


@dataclass(frozen=True)
class OffsetTerms:
    """The offset of a pair is the sum of its terms: the common one, its modules', its own."""

    nodes: IntArray
    anchors: IntArray
    model: OffsetModel
    prior_mean: FloatArray = field(repr=False)
    prior_std: FloatArray = field(repr=False)

    @classmethod
    def of(cls, model: CalibrationModel, nodes: IntArray, anchors: IntArray) -> OffsetTerms:
        """Terms for all pairs of ``nodes`` and ``anchors``."""
        spread: list[FloatArray] = [np.array([model.offset_std])]
        if model.offsets != "constant":
            spread.append(np.full(len(nodes) + len(anchors), model.module_std))
        if model.offsets == "pair":
            spread.append(np.full(len(nodes) * len(anchors), model.pair_std))
        std = np.concatenate(spread)
        mean = np.zeros(len(std))
        mean[0] = model.offset_m
        return cls(nodes, anchors, model.offsets, mean, std)

    def __len__(self) -> int:
        return len(self.prior_mean)

    def indices(self, node: IntArray, anchor: IntArray) -> IntArray:
        """Terms (N, 4) of pairs, given as positions (N,) in ``nodes`` and ``anchors``; -1: none."""
        terms = np.full((len(node), _MOST_TERMS), -1, dtype=np.int64)
        terms[:, 0] = 0
        if self.model != "constant":
            terms[:, 1] = 1 + node
            terms[:, 2] = 1 + len(self.nodes) + anchor
        if self.model == "pair":
            first = 1 + len(self.nodes) + len(self.anchors)
            terms[:, 3] = first + node * len(self.anchors) + anchor
        return terms

    def jacobian(self) -> FloatArray:
        """(pairs, terms) with the pairs' offsets = jacobian @ terms, pairs node by node."""
        node, anchor = np.divmod(np.arange(len(self.nodes) * len(self.anchors)), len(self.anchors))
        terms = self.indices(node, anchor)
        jacobian = np.zeros((len(terms), len(self)))
        rows, columns = np.nonzero(terms >= 0)
        jacobian[rows, terms[rows, columns]] = 1.0
        return jacobian


@dataclass(frozen=True)
class Strips:
    """Modules whose trajectories belong together, and where on them the ranges are.

    * ``modules``: numbers, one tuple of one or two per strip; two are the ends of a rod
    * ``knot_t`` times of the knots, the same for all strips: [s], or the steps of the recording
    * ``strip``, ``module``, ``knot``, ``blend`` (N,): place of each range
    * ``connected``: whether knots follow each other in time
    """

    modules: tuple[tuple[int, ...], ...]
    knot_t: FloatArray
    strip: IntArray
    module: IntArray
    knot: IntArray
    blend: FloatArray
    connected: bool

    @classmethod
    def of(cls, recording: RangeRecording, model: CalibrationModel) -> Strips:
        """All modules of a recording; rods with only one ranged end are single modules."""
        nodes = set(recording.nodes.tolist())
        modules: list[tuple[int, ...]] = [rod for rod in model.rods if nodes.issuperset(rod)]
        in_rods = {node for rod in modules for node in rod}
        modules += [(node,) for node in sorted(nodes - in_rods)]
        place = {node: (s, m) for s, strip in enumerate(modules) for m, node in enumerate(strip)}
        strip, module = np.array([place[node] for node in recording.node.tolist()]).T
        if recording.timed:
            seconds = recording.elapsed
            count = max(int(np.ceil(seconds[-1] / model.knot_s)) + 1, 2)
            knot = np.minimum((seconds / model.knot_s).astype(np.int64), count - 2)
            blend = seconds / model.knot_s - knot
            knot_t = np.arange(count, dtype=np.float64) * model.knot_s
        else:
            steps, knot = np.unique(recording.t_ns, return_inverse=True)
            blend = np.zeros(len(recording))
            knot_t = steps.astype(np.float64)
        return cls(tuple(modules), knot_t, strip, module, knot, blend, recording.timed)


def build_solver(
    recording: RangeRecording,
    anchors: Anchors,
    terms: OffsetTerms,
    strips: Strips,
    model: CalibrationModel,
    height_std: float = ANYWHERE_M,
) -> RangeCalibrationSolver:
    """The solver for a recording; coordinates of ``anchors`` that are known are a prior, and so is
    z = 0 for all modules, with ``height_std`` [m]."""
    from tensegrity._core import RangeCalibrationSolver

    node = np.searchsorted(terms.nodes, recording.node)
    anchor = np.searchsorted(anchors.ids, recording.anchor)
    rods = [len(modules) == 2 for modules in strips.modules]
    rod_of = np.where(rods, np.cumsum(rods) - 1, -1)
    survey = np.nan_to_num(anchors.position_m.ravel())
    mean = np.concatenate([survey, terms.prior_mean, np.full(sum(rods), model.rod_length)])
    information = np.concatenate(
        [
            survey_information(anchors, model),
            1 / terms.prior_std**2,
            np.full(sum(rods), 1 / model.rod_length_std**2),
        ]
    )
    step = 1 / (model.diffusion * model.knot_s) if strips.connected else 0.0
    motion = np.full(len(strips.knot_t) - 1, step)
    return RangeCalibrationSolver(
        anchors=len(anchors),
        offset_terms=len(terms),
        rod_lengths=sum(rods),
        prior_mean=mean,
        prior_information=information,
        strip_modules=np.array([len(modules) for modules in strips.modules]),
        strip_knots=np.full(len(rods), len(strips.knot_t)),
        strip_rod=rod_of,
        motion_information=[motion] * len(rods),
        indices=np.column_stack(
            [strips.strip, strips.module, strips.knot, anchor, terms.indices(node, anchor)]
        ),
        blend=strips.blend,
        range_m=recording.range_m,
        range_std=model.range_std,
        rod_std=model.rod_std,
        knot_information=[1 / ANYWHERE_M**2, 1 / ANYWHERE_M**2, 1 / height_std**2],
    )


def survey_information(anchors: Anchors, model: CalibrationModel) -> FloatArray:
    """What the survey tells about the coordinates (3 A,) of the anchors [1/m^2]."""
    return anchors.known.ravel() / model.survey_std**2


def positions_of(solver: RangeCalibrationSolver, strips: Strips) -> dict[int, FloatArray]:
    """Positions (knots, 3) [m] of every module by number."""
    found = {}
    for index, modules in enumerate(strips.modules):
        values = np.asarray(solver.positions(index)).reshape(-1, len(modules), 3)
        for place, module in enumerate(modules):
            found[module] = values[:, place]
    return found


def set_positions(
    solver: RangeCalibrationSolver, strips: Strips, positions: dict[int, FloatArray]
) -> None:
    """Start the trajectories from ``positions`` (knots, 3) [m] of every module by number."""
    for index, modules in enumerate(strips.modules):
        solver.set_positions(index, np.stack([positions[module] for module in modules], axis=1))


def shared_parts(
    shared: FloatArray, anchors: int, terms: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Anchors (A, 3), offset terms and rod lengths from the solver's vector [m]."""
    return (
        shared[: 3 * anchors].reshape(anchors, 3),
        shared[3 * anchors : 3 * anchors + terms],
        shared[3 * anchors + terms :],
    )


def snapshots(
    recording: RangeRecording, anchors: Sequence[int], interval_s: float, gap_s: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Ranges of one module at one time to all anchors: node (S,), time (S,), ranges (S, A) [m].

    Timed recordings are interpolated every ``interval_s``, between ranges that are no more than
    ``gap_s`` apart; others are taken as they are. NaN: no range. Times in [s] from the first range
    or in steps.
    """
    nodes = recording.nodes
    if recording.timed:
        seconds = recording.elapsed
        grid = np.arange(0.0, seconds[-1] + interval_s / 2, interval_s)
    else:
        steps, step = np.unique(recording.t_ns, return_inverse=True)
        grid = steps.astype(np.float64)
    table = np.full((len(nodes), len(grid), len(anchors)), np.nan)
    for i, node in enumerate(nodes):
        for j, anchor in enumerate(anchors):
            own = (recording.node == node) & (recording.anchor == anchor)
            if not recording.timed:
                table[i, step[own], j] = recording.range_m[own]
            elif own.sum() > 1:
                table[i, :, j] = _interpolated(grid, seconds[own], recording.range_m[own], gap_s)
    node_of = np.repeat(nodes, len(grid))
    time_of = np.tile(grid, len(nodes))
    flat = table.reshape(-1, len(anchors))
    some = np.isfinite(flat).any(axis=1)
    return node_of[some], time_of[some], flat[some]


def _interpolated(
    grid: FloatArray, seconds: FloatArray, values: FloatArray, gap_s: float
) -> FloatArray:
    after = np.clip(np.searchsorted(seconds, grid), 1, len(seconds) - 1)
    inside = (seconds[0] <= grid) & (grid <= seconds[-1])
    close = seconds[after] - seconds[after - 1] <= gap_s
    return np.where(inside & close, np.interp(grid, seconds, values), np.nan)
