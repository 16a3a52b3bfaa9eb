"""``tensegrity calibrate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.table import Column, Table

from tensegrity.cli.console import out, progress_bar
from tensegrity.errors import InputError
from tensegrity.files import check_directory
from tensegrity.ranging.calibration import ATTEMPTS, RangeCalibration, Solver, calibrate_ranges
from tensegrity.ranging.calibration_files import CALIBRATION_FILE, write_calibration
from tensegrity.ranging.calibration_model import CalibrationModel, Loss, OffsetModel
from tensegrity.ranging.recording import (
    INTERNAL_RANGES_FILE,
    read_anchors,
    read_internal_ranges,
    read_ranges,
)

_DEFAULT = CalibrationModel()


def calibrate(
    ranges: Annotated[Path, typer.Argument(help="ranges.csv, or the directory that holds it.")],
    output: Annotated[Path, typer.Option("--out", help="Directory for the calibration.")],
    anchors: Annotated[
        Path | None,
        typer.Option(
            help="Anchors with the coordinates that are known, empty cells for the others.",
            show_default="nothing is known",
        ),
    ] = None,
    offsets: Annotated[
        OffsetModel, typer.Option(help="One offset, plus one per module, plus one per pair.")
    ] = _DEFAULT.offsets,
    solver: Annotated[
        Solver, typer.Option(help="bfgs: the published way, from a random start.")
    ] = "lm",
    loss: Annotated[Loss, typer.Option(help="Of range residuals.")] = _DEFAULT.loss,
    loss_scale: Annotated[
        float, typer.Option(help="Residual at which the loss turns [m].")
    ] = _DEFAULT.loss_scale * _DEFAULT.range_std,
    rod_length: Annotated[
        float, typer.Option(help="Expected distance between a rod's modules [m].")
    ] = _DEFAULT.rod_length,
    rod_length_std: Annotated[
        float, typer.Option(help="Its standard deviation [m].")
    ] = _DEFAULT.rod_length_std,
    offset: Annotated[
        float, typer.Option(help="Expected offset of the ranges [m].")
    ] = _DEFAULT.offset_m,
    offset_std: Annotated[
        float, typer.Option(help="Its standard deviation [m].")
    ] = _DEFAULT.offset_std,
    start: Annotated[
        float | None,
        typer.Option(help="Use ranges from this time (or step) on [s].", show_default="all"),
    ] = None,
    end: Annotated[
        float | None,
        typer.Option(help="Use ranges before this time (or step) [s].", show_default="all"),
    ] = None,
    attempts: Annotated[int, typer.Option(min=1, help="Starts to refine.")] = ATTEMPTS,
    seed: Annotated[int, typer.Option(help="Of the starts.")] = 0,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the calibration that is already there.")
    ] = False,
) -> None:
    """Find anchors and range offsets from a recording of the moving robot."""
    check_directory(output, marker=CALIBRATION_FILE, overwrite=overwrite)
    for name, value in (
        ("loss-scale", loss_scale),
        ("rod-length", rod_length),
        ("rod-length-std", rod_length_std),
        ("offset-std", offset_std),
    ):
        if not 0 < value <= 100:
            raise InputError(f"expected a length in (0, 100] [m], got {value:g}", field=name)
    survey = None if anchors is None else read_anchors(anchors)
    recording = read_ranges(ranges, survey)
    if start is not None or end is not None:
        recording = recording.between(
            -np.inf if start is None else start, np.inf if end is None else end
        )
    inside = ranges / INTERNAL_RANGES_FILE
    internal = read_internal_ranges(inside) if inside.exists() else None
    model = CalibrationModel(
        offsets=offsets,
        loss=loss,
        loss_scale=loss_scale / _DEFAULT.range_std,
        rod_length=rod_length,
        rod_length_std=rod_length_std,
        offset_m=offset,
        offset_std=offset_std,
    )
    with progress_bar("calibrating") as progress:
        result = calibrate_ranges(
            recording,
            survey,
            model,
            solver=solver,
            internal=internal,
            seed=seed,
            attempts=attempts,
            progress=progress,
        )
    write_calibration(output, result, overwrite=overwrite)
    _print(result)
    out.print(f"calibration: {output}", markup=False)


def _print(result: RangeCalibration) -> None:
    names = ("x", "y", "z", "± x, y, z", "ranges", "median", "90 %")
    table = Table(
        "anchor",
        *(Column(name, justify="right") for name in names),
        caption="positions and residuals of ranges in m, standard deviations in mm",
        caption_justify="left",
    )
    for anchor, position, std in zip(
        result.anchors.ids.tolist(), result.anchors.position_m, result.anchor_std, strict=True
    ):
        own = np.abs(result.residuals.residual_m[result.residuals.anchor == anchor])
        table.add_row(
            str(anchor),
            *(f"{value:.3f}" for value in position),
            "–" if np.isnan(std).any() else ", ".join(f"{1e3 * value:.0f}" for value in std),
            str(len(own)),
            *(f"{value:.3f}" for value in np.percentile(own, (50, 90))),
        )
    out.print(table, soft_wrap=False)
    numbers = result.statistics()
    out.print(
        f"{numbers['ranges']} ranges, residual median {numbers['residual_median_m']:.3f} m, "
        f"90 % {numbers['residual_90_percent_m']:.3f} m, more than 0.5 m off "
        f"{numbers['outliers_percent']:.1f} %; mean offset "
        f"{result.offsets.offset_m.mean():.3f} m; {result.runtime_s:.2f} s"
    )
    if result.free_motions:
        out.print(f"not held by any survey: {', '.join(result.free_motions)}")
    out.print(f"verdict: {result.verdict}", markup=False)
