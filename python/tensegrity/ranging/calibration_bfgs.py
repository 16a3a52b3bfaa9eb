"""The calibration as C does it: BFGS on C eq. 9 from a random start, for comparison.

C is Caluwaerts et al. 2016, §III-C: unknown are the anchors, the offsets and the position of every
module in every one of some 400 randomly selected samples; bar constraints take the form of ranges
without offset; a module's sample counts (alpha = 1) when at least four anchors answered.
Limited-memory BFGS, because the dense matrix of thousands of positions would not fit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tensegrity.errors import InputError
from tensegrity.ranging.calibration_frame import frame_of
from tensegrity.ranging.calibration_model import CalibrationModel, OffsetTerms, snapshots
from tensegrity.ranging.calibration_solution import Residuals, Solution
from tensegrity.ranging.recording import Anchors, RangeRecording

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SAMPLES = 400
_LEAST_RANGES = 4
_START_STD_M = 5.0  # of anchors and modules about the origin
_SNAPSHOT_S, _GAP_S = 0.25, 1.0
_ITERATIONS = 3000
_CLOSEST_M = 1e-9


class _Samples:
    """C eq. 9 as a function of one vector: anchors, offset terms, positions of the samples."""

    def __init__(
        self,
        node: IntArray,
        time: FloatArray,
        ranges: FloatArray,
        survey: Anchors,
        terms: OffsetTerms,
        model: CalibrationModel,
    ) -> None:
        self.node, self.time = node, time
        self.sample, self.anchor = np.nonzero(np.isfinite(ranges))
        self.range_m = ranges[self.sample, self.anchor]
        place = np.searchsorted(terms.nodes, node)
        self.term = terms.indices(place[self.sample], self.anchor)
        self.terms, self.anchors = len(terms), len(survey)
        self.prior_mean = terms.prior_mean
        self.prior_information = (model.range_std / terms.prior_std) ** 2
        self.survey = survey.position_m
        row = {(int(n), float(t)): i for i, (n, t) in enumerate(zip(node, time, strict=True))}
        bars = [
            (row[a, t], row[b, t])
            for a, b in model.rods
            for t in np.unique(time).tolist()
            if (a, t) in row and (b, t) in row
        ]
        self.bar = np.array(bars, dtype=np.int64).reshape(-1, 2)
        self.bar_length = model.rod_length

    def split(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Anchors (A, 3), offset terms and positions (S, 3)."""
        first = 3 * self.anchors
        return (
            x[:first].reshape(-1, 3),
            x[first : first + self.terms],
            x[first + self.terms :].reshape(-1, 3),
        )

    def errors(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Predicted minus measured ranges (N,) and unit vectors (N, 3) from the anchors."""
        anchors, terms, positions = self.split(x)
        offset = np.where(self.term >= 0, terms[self.term], 0.0).sum(axis=1)
        away = positions[self.sample] - anchors[self.anchor]
        distance = np.maximum(np.linalg.norm(away, axis=1), _CLOSEST_M)
        return distance + offset - self.range_m, away / distance[:, None]

    def cost(self, x: FloatArray) -> tuple[float, FloatArray]:
        """C eq. 9 with bars, and its gradient."""
        anchors, terms, positions = self.split(x)
        error, direction = self.errors(x)
        gradient = np.zeros_like(x)
        to_anchors, to_terms, to_positions = self.split(gradient)  # views
        pull = 2 * error[:, None] * direction
        np.add.at(to_positions, self.sample, pull)
        np.add.at(to_anchors, self.anchor, -pull)
        for column in self.term.T:
            good = column >= 0
            np.add.at(to_terms, column[good], 2 * error[good])
        bar = positions[self.bar[:, 1]] - positions[self.bar[:, 0]]
        length = np.maximum(np.linalg.norm(bar, axis=1), _CLOSEST_M)
        stretch = length - self.bar_length
        pull = (2 * stretch / length)[:, None] * bar
        np.add.at(to_positions, self.bar[:, 1], pull)
        np.add.at(to_positions, self.bar[:, 0], -pull)
        # Sums of terms are not unique without what is expected of each.
        wrong = terms - self.prior_mean
        to_terms += 2 * self.prior_information * wrong
        misplaced = np.where(np.isfinite(self.survey), anchors - self.survey, 0.0)
        to_anchors += 2 * len(error) * misplaced
        total = (error**2).sum() + (stretch**2).sum()
        total += (self.prior_information * wrong**2).sum() + len(error) * (misplaced**2).sum()
        return float(total), gradient


def solve(
    recording: RangeRecording,
    survey: Anchors,
    model: CalibrationModel,
    rng: np.random.Generator,
    progress: Callable[[float], None],
) -> Solution:
    """The minimum that BFGS reaches from one random start; the ``survey`` is part of the cost.

    Raises :class:`InputError` when no sample has four ranges.
    """
    from scipy.optimize import minimize

    node, time, ranges = snapshots(recording, survey.ids.tolist(), _SNAPSHOT_S, _GAP_S)
    counts = np.isfinite(ranges).sum(axis=1) >= _LEAST_RANGES
    moments = rng.permutation(np.unique(time[counts]))[:_SAMPLES]
    alpha = counts & np.isin(time, moments)
    if not alpha.any():
        raise InputError(
            f"at no time did one module range {_LEAST_RANGES} anchors",
            hint="solver 'lm' does not need that",
        )
    terms = OffsetTerms.of(model, recording.nodes, survey.ids)
    samples = _Samples(node[alpha], time[alpha], ranges[alpha], survey, terms, model)
    anchors = np.where(
        np.isfinite(survey.position_m),
        survey.position_m,
        rng.normal(scale=_START_STD_M, size=survey.position_m.shape),
    )
    positions = rng.normal(scale=_START_STD_M, size=(int(alpha.sum()), 3)) + anchors.mean(axis=0)
    start = np.concatenate([anchors.ravel(), terms.prior_mean, positions.ravel()])
    done = 0

    def count(_: Any) -> None:
        nonlocal done
        done += 1
        progress(min(done / _ITERATIONS, 1.0))

    result = minimize(
        samples.cost,
        start,
        jac=True,
        method="L-BFGS-B",
        callback=count,
        options={"maxiter": _ITERATIONS, "maxfun": 2 * _ITERATIONS},
    )
    found, offset_terms, positions = samples.split(result.x)
    motion = frame_of(found, survey.position_m, positions)
    found, positions = motion(found), motion(positions)
    times = np.unique(time[alpha])
    modules = {}
    for one in recording.nodes.tolist():
        own = node[alpha] == one
        modules[one] = np.full((len(times), 3), np.nan)
        modules[one][np.searchsorted(times, time[alpha][own])] = positions[own]
    error, _ = samples.errors(result.x)
    size = 3 * len(survey) + len(terms)
    return Solution(
        anchors_m=found,
        terms=terms,
        offset_terms_m=offset_terms,
        rods=(),
        rod_lengths_m=np.empty(0),
        covariance=np.full((size, size), np.nan),
        free_motions=(),
        rival_m=0.0,
        knot_t=times,
        modules=modules,
        residuals=Residuals(
            samples.time[samples.sample],
            samples.node[samples.sample],
            survey.ids[samples.anchor],
            error,
        ),
        converged=bool(result.success),
        iterations=int(result.nit),
    )
