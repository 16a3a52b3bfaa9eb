"""Anchors, range offsets and trajectories from raw ranges: :func:`calibrate_ranges`.

C is Caluwaerts et al. 2016, §III-C. Minimised is C eq. 9 with a robust loss, knots of the
trajectory in place of samples, and a random walk between knots: modules range one anchor after the
other, so that single moments hardly ever hold the four ranges that C's samples need.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tensegrity.errors import InputError
from tensegrity.ranging import calibration_bfgs, calibration_lm
from tensegrity.ranging.calibration_checks import check
from tensegrity.ranging.calibration_covariance import POOR_STD_M, complaints
from tensegrity.ranging.calibration_internal import internal_offsets
from tensegrity.ranging.calibration_model import CalibrationModel
from tensegrity.ranging.calibration_solution import Residuals, Solution
from tensegrity.ranging.recording import (
    NO_OFFSETS,
    Anchors,
    InternalRanges,
    Offsets,
    RangeRecording,
)

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

Solver = Literal["lm", "bfgs"]

ATTEMPTS = 3
"""Starts that are refined before the best is finished."""

_OUTLIER_M = 0.5
_MOST_OUTLIERS = 0.25  # share of ranges that may be off by more before it is worth a warning


@dataclass(frozen=True)
class RangeCalibration:
    """A calibrated constellation of anchors, and how well it is known.

    * ``anchors`` all solved, ``anchor_covariance`` (3A, 3A) [m^2]
    * ``offsets`` of all pairs, ``offset_std`` (pairs,) [m]; ``internal_offsets`` of pairs within
      the robot, none without internal ranges
    * ``rods`` and the distances between their modules, ``rod_length`` and ``rod_length_std`` [m]
    * ``knot_t`` (K,) [s] from the first range, or steps; ``modules`` positions (K, 3) by number [m]
    * ``residuals`` of the ranges that were used
    * ``free_motions`` of the whole that no survey holds, in words
    * ``warnings``: why the recording was not rich enough; none if it was
    * ``solver``, ``converged``, ``iterations`` and ``runtime_s`` of the solution

    Covariances are NaN when the solver does not tell them (``bfgs``).
    """

    anchors: Anchors
    anchor_covariance: FloatArray
    offsets: Offsets
    offset_std: FloatArray
    internal_offsets: Offsets
    rods: tuple[tuple[int, ...], ...]
    rod_length: FloatArray
    rod_length_std: FloatArray
    knot_t: FloatArray
    modules: dict[int, FloatArray]
    residuals: Residuals = field(repr=False)
    model: CalibrationModel
    free_motions: tuple[str, ...]
    warnings: tuple[str, ...]
    solver: Solver
    converged: bool
    iterations: int
    runtime_s: float

    @property
    def anchor_std(self) -> FloatArray:
        """Standard deviations (A, 3) of the anchors' coordinates [m]."""
        return np.sqrt(np.diag(self.anchor_covariance)).reshape(-1, 3)

    @property
    def rich_enough(self) -> bool:
        """Whether the recording determined everything."""
        return not self.warnings

    @property
    def verdict(self) -> str:
        """One sentence for people."""
        if self.rich_enough:
            return "the recording was rich enough: every anchor is determined"
        return "the recording was not rich enough: " + "; ".join(self.warnings)

    def statistics(self) -> dict[str, Any]:
        """Numbers about the residuals [m], for tables and files."""
        size = np.abs(self.residuals.residual_m)
        return {
            "ranges": len(size),
            "residual_median_m": float(np.median(size)),
            "residual_90_percent_m": float(np.percentile(size, 90)),
            "residual_rmse_m": float(np.sqrt(np.mean(size**2))),
            "outliers_percent": float(100 * np.mean(size > _OUTLIER_M)),
        }


def calibrate_ranges(
    recording: RangeRecording,
    survey: Anchors | None = None,
    model: CalibrationModel | None = None,
    *,
    solver: Solver = "lm",
    trusted: BoolArray | None = None,
    internal: InternalRanges | None = None,
    seed: int = 0,
    attempts: int = ATTEMPTS,
    progress: Callable[[float], None] | None = None,
) -> RangeCalibration:
    """Anchors, offsets and trajectories from raw ranges.

    ``survey`` lists the anchors with the coordinates that are known; without it nothing is, and the
    result is in a frame of its own. ``trusted`` (N,) are C's alpha: ranges with a false flag are
    left out. ``internal`` ranges of a timed recording give the offsets within the robot.
    ``solver`` "bfgs" is C's own way. ``seed`` decides where the search starts, ``attempts`` how
    often. ``progress`` is called with the fraction done.

    Raises :class:`InputError` when the recording cannot be calibrated, saying why.
    """
    started = time.perf_counter()
    model = model or CalibrationModel()
    report = progress or (lambda fraction: None)
    alpha = np.ones(len(recording), dtype=np.bool_) if trusted is None else trusted
    used = recording.where(alpha)
    if not len(used):
        raise InputError("no range is trusted")
    if survey is None:
        survey = Anchors(used.anchors, np.full((len(used.anchors), 3), np.nan))
    check(used, survey)
    order = np.argsort(survey.ids)
    survey = Anchors(survey.ids[order], survey.position_m[order])
    rng = np.random.default_rng(seed)
    if solver == "bfgs":
        solution = calibration_bfgs.solve(used, survey, model, rng, report)
    else:
        solution = calibration_lm.solve(used, survey, model, rng, attempts, report)
    within = NO_OFFSETS
    if internal is not None and used.timed and solver == "lm":
        within = internal_offsets(internal, int(used.t_ns[0]), solution.knot_t, solution.modules)
    result = _calibration(solution, within, survey, model, solver, time.perf_counter() - started)
    report(1.0)
    return result


def _calibration(
    solution: Solution,
    within: Offsets,
    survey: Anchors,
    model: CalibrationModel,
    solver: Solver,
    runtime_s: float,
) -> RangeCalibration:
    terms, count = solution.terms, 3 * len(survey)
    pairs = terms.jacobian()
    node, anchor = np.meshgrid(terms.nodes, terms.anchors, indexing="ij")
    own = solution.covariance[count : count + len(terms), count : count + len(terms)]
    covariance = solution.covariance[:count, :count]
    return RangeCalibration(
        anchors=Anchors(survey.ids, solution.anchors_m),
        anchor_covariance=covariance,
        offsets=Offsets(node.ravel(), anchor.ravel(), pairs @ solution.offset_terms_m),
        offset_std=np.sqrt(np.einsum("pi,ij,pj->p", pairs, own, pairs)),
        internal_offsets=within,
        rods=solution.rods,
        rod_length=solution.rod_lengths_m,
        rod_length_std=np.sqrt(np.diag(solution.covariance)[count + len(terms) :]),
        knot_t=solution.knot_t,
        modules=solution.modules,
        residuals=solution.residuals,
        model=model,
        free_motions=solution.free_motions,
        warnings=tuple(_warnings(solution, survey, covariance)),
        solver=solver,
        converged=solution.converged,
        iterations=solution.iterations,
        runtime_s=runtime_s,
    )


def _warnings(solution: Solution, survey: Anchors, covariance: FloatArray) -> list[str]:
    found = [] if np.isnan(covariance).any() else complaints(survey.ids, covariance)
    if not solution.converged:
        found.append(f"the solution did not converge in {solution.iterations} iterations")
    if solution.rival_m > POOR_STD_M:
        found.append(
            "another constellation fits about as well, with anchors up to "
            f"{solution.rival_m:.2g} m elsewhere: survey some of them, or move the "
            "robot through a larger area"
        )
    off = float(np.mean(np.abs(solution.residuals.residual_m) > _OUTLIER_M))
    if off > _MOST_OUTLIERS:
        found.append(f"{100 * off:.0f} % of the ranges do not fit within {_OUTLIER_M:g} m")
    return found
