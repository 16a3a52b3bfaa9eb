"""The calibration of anchors and offsets on the real recordings of SUPERball.

Two tables: how well ranges after the first 100 s are predicted by a calibration from the first
100 s, and how often random seeds end in the same constellation without any survey.

    python benchmarks/range_calibration.py ../shared/data/superball --seeds 20
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np
from numpy.typing import NDArray

from tensegrity.ranging import RangeRecording, read_anchors, read_ranges
from tensegrity.ranging.calibration import RangeCalibration, Solver, calibrate_ranges
from tensegrity.ranging.calibration_frame import align
from tensegrity.ranging.calibration_model import CalibrationModel
from tensegrity.ranging.prediction import prediction_errors

FIT_S = 100.0
SAME_M = 0.25
"""Constellations are the same when no anchor is farther off after the best rigid alignment."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("data", type=Path, help="folder with building45 and outdoor")
    parser.add_argument("--seeds", type=int, default=20, help="of the default solver")
    parser.add_argument("--bfgs-seeds", type=int, default=3, help="of the published solver")
    arguments = parser.parse_args()
    predictions(arguments.data / "building45")
    for name in ("building45", "outdoor"):
        recording = read_ranges(arguments.data / name)
        if recording.timed:
            recording = recording.between(0.0, FIT_S)
        reference = seeds(recording, "lm", arguments.seeds, None)
        if arguments.bfgs_seeds:
            seeds(recording, "bfgs", arguments.bfgs_seeds, reference)


def predictions(folder: Path) -> None:
    """Errors of later ranges predicted from the other ranges of the same module within 0.25 s."""
    survey, recording = read_anchors(folder), read_ranges(folder)
    fit, later = recording.between(0.0, FIT_S), recording.between(FIT_S, np.inf)
    print(f"\n{folder.name}: fit on the first {FIT_S:g} s, predict later ranges; median / 90 % [m]")
    print(f"{'solver':8}{'offsets':10}{'survey':8}{'all others':>18}{'other anchors only':>22}")
    default = CalibrationModel()
    for solver, model, known in (
        ("lm", default, True),
        ("lm", default, False),
        ("lm", replace(default, offsets="constant"), True),
        ("lm", replace(default, offsets="pair"), True),
        ("lm", replace(default, loss="squares"), True),
        ("bfgs", replace(default, offsets="pair"), True),
    ):
        result = calibrate_ranges(fit, survey if known else None, model, solver=solver)
        cells = [_errors(result, later, strict) for strict in (False, True)]
        name = model.offsets if model.loss == "cauchy" else f"{model.offsets}, L2"
        print(f"{solver:8}{name:12}{'yes' if known else 'no':6}{cells[0]:>18}{cells[1]:>22}")


def seeds(
    recording: RangeRecording,
    solver: Solver,
    count: int,
    reference: NDArray[np.float64] | None,
) -> NDArray[np.float64]:
    """How often random seeds find one constellation; returns the reference that was compared to:
    the one that most others are close to when none is given."""
    found, times = [], []
    for seed in range(count):
        started = time.perf_counter()
        found.append(calibrate_ranges(recording, solver=solver, seed=seed).anchors.position_m)
        times.append(time.perf_counter() - started)
    if reference is None:
        agreeing = [sum(_distance(one, other) < SAME_M for other in found) for one in found]
        reference = found[int(np.argmax(agreeing))]
    distances = np.array([_distance(one, reference) for one in found])
    same = distances < SAME_M
    within = f", those within {distances[same].max():.3f} m" if same.any() else ""
    print(
        f"{recording.name}, {solver}, no survey: {same.sum()} of {count} seeds in the same "
        f"constellation (tolerance {SAME_M} m){within}; {median(times):.2f} s each"
    )
    return reference


def _errors(result: RangeCalibration, later: RangeRecording, other_anchors_only: bool) -> str:
    error = prediction_errors(
        later, result.anchors, result.offsets, other_anchors_only=other_anchors_only
    )
    size = np.abs(error[np.isfinite(error)])
    return "{:.3f} / {:.3f} ({})".format(*np.percentile(size, (50, 90)), len(size))


def _distance(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(align(one, other)(one) - other, axis=1).max())


if __name__ == "__main__":
    main()
