"""``tensegrity track``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Column, Table

from tensegrity import tracking
from tensegrity.cli.console import out
from tensegrity.cli.estimate import Method
from tensegrity.files import check_directory
from tensegrity.ranging.calibration_files import read_calibration
from tensegrity.ranging.sequence import read_sequence
from tensegrity.track_run import STATE_FILE, metrics_of, write_track


def track(
    sequence: Annotated[
        Path, typer.Argument(help="Recording: a directory with ranges.csv, anchors.csv, ...")
    ],
    calibration: Annotated[
        Path | None,
        typer.Option(
            help="Directory written by 'tensegrity calibrate'.",
            show_default="the recording's anchors.csv and offsets.csv",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--out", help="Directory of the run.", show_default="runs/<recording>"),
    ] = None,
    method: Annotated[
        Method,
        typer.Option(help="The filter of Caluwaerts et al. 2016 as published, or the best one."),
    ] = Method.FULL,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the run that is already there.")
    ] = False,
) -> None:
    """Estimate where a ranging robot was; where the recording holds the truth, evaluate as well."""
    recording = read_sequence(sequence)
    directory = output or Path("runs") / recording.name
    check_directory(directory, marker=STATE_FILE, overwrite=overwrite)
    known = None if calibration is None else read_calibration(calibration)
    settings = tracking.paper_settings() if method is Method.PAPER else None
    started = time.perf_counter()
    result = tracking.track(
        recording,
        anchors=None if known is None else known.anchors,
        offsets=None if known is None else known.offsets,
        settings=settings,
    )
    metrics = metrics_of(result, recording, time.perf_counter() - started)
    write_track(result, directory, metrics=metrics, overwrite=overwrite)
    table = Table("", Column(recording.name, justify="right"))
    for name, value in metrics.items():
        table.add_row(name, f"{value:.3f}" if isinstance(value, float) else str(value))
    out.print(table, soft_wrap=False)
    out.print(f"run: {directory}", markup=False)
