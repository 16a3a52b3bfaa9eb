"""The calibration by closed-form starts and sparse Levenberg-Marquardt."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tensegrity.ranging.calibration_covariance import determine, variance_factor
from tensegrity.ranging.calibration_frame import frame_of
from tensegrity.ranging.calibration_model import (
    CalibrationModel,
    OffsetTerms,
    Strips,
    build_solver,
    positions_of,
    set_positions,
    shared_parts,
    survey_information,
)
from tensegrity.ranging.calibration_search import search
from tensegrity.ranging.calibration_solution import Residuals, Solution
from tensegrity.ranging.recording import Anchors, RangeRecording

FloatArray = NDArray[np.float64]

_ITERATIONS = 100
_TOLERANCE = 1e-4
_SEARCH_SHARE = 0.7  # of the time, for progress


def solve(
    recording: RangeRecording,
    survey: Anchors,
    model: CalibrationModel,
    rng: np.random.Generator,
    attempts: int,
    progress: Callable[[float], None],
) -> Solution:
    """The minimum with the trajectory between knots, in the frame of the ``survey``, whose anchors
    are those of the recording in ascending order.

    Raises :class:`InputError` when there is nothing to start from.
    """
    guess = search(recording, model, rng, attempts, lambda f: progress(_SEARCH_SHARE * f))
    motion = frame_of(guess.anchors_m, survey.position_m, np.vstack(list(guess.modules_m.values())))
    terms = OffsetTerms.of(model, recording.nodes, survey.ids)
    strips = Strips.of(recording, model)
    solver = build_solver(recording, survey, terms, strips, model)
    offset_terms = np.zeros(len(terms))
    offset_terms[0] = guess.offset_m
    solver.shared = np.concatenate(
        [motion(guess.anchors_m).ravel(), offset_terms, guess.rod_lengths_m]
    )
    set_positions(
        solver,
        strips,
        {
            module: _resampled(strips.knot_t, guess.knot_t, motion(positions))
            for module, positions in guess.modules_m.items()
        },
    )
    loss = model.core_loss
    status, iterations, _ = solver.solve(loss, model.loss_scale, _ITERATIONS, _TOLERANCE)
    shared = np.asarray(solver.shared)
    anchors, offset_terms, rod_lengths = shared_parts(shared, len(survey), len(terms))
    residual = np.asarray(solver.residuals())
    determination = determine(
        np.asarray(solver.reduced_information(loss, model.loss_scale)),
        survey_information(survey, model),
        anchors,
        variance_factor(
            model.loss, model.loss_scale, np.asarray(solver.weights(loss, model.loss_scale))
        ),
    )
    return Solution(
        anchors_m=anchors,
        terms=terms,
        offset_terms_m=offset_terms,
        rods=tuple(modules for modules in strips.modules if len(modules) == 2),
        rod_lengths_m=rod_lengths,
        covariance=determination.covariance,
        free_motions=determination.free_motions,
        # Among rivals a survey decides; they are told apart without it only.
        rival_m=0.0 if survey.known.any() else guess.rival_m,
        knot_t=strips.knot_t,
        modules=positions_of(solver, strips),
        residuals=Residuals(
            recording.elapsed, recording.node, recording.anchor, residual * model.range_std
        ),
        converged=status.name == "converged",
        iterations=iterations,
    )


def _resampled(at: FloatArray, t: FloatArray, positions: FloatArray) -> FloatArray:
    return np.column_stack([np.interp(at, t, positions[:, axis]) for axis in range(3)])
