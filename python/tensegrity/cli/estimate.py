"""``tensegrity estimate``."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from tensegrity import estimation, robots
from tensegrity.cli.console import err, out, progress_bar
from tensegrity.cli.evaluate import evaluate_run
from tensegrity.cli.events import report_events
from tensegrity.config import FilterConfig
from tensegrity.errors import InputError, MissingExtraError
from tensegrity.evaluation import Alignment
from tensegrity.files import check_directory
from tensegrity.run import TRAJECTORY, write_run
from tensegrity.sequence import read


class Method(StrEnum):
    """The packaged profiles."""

    PAPER = "paper"
    FULL = "full"


def estimate(
    sequence: Annotated[Path, typer.Argument(help="Recording: a directory with imu.csv, ...")],
    output: Annotated[
        Path | None,
        typer.Option(
            "--out", help="Directory of the run.", show_default="runs/<recording>-<method>"
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(help="Packaged robot or YAML file.", show_default="the recording's"),
    ] = None,
    config: Annotated[
        str | None, typer.Option(help="Packaged profile or YAML file.", show_default="the method's")
    ] = None,
    method: Annotated[
        Method | None,
        typer.Option(
            help="The estimator of Tong et al. 2024 as published, or the best there is.",
            show_default="full",
        ),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the run that is already there.")
    ] = False,
) -> None:
    """Estimate shape and pose from a recording; where it holds the truth, evaluate as well."""
    filter_config = choose_config(config, method)
    recording = read(sequence, robot=None if robot is None else robots.load(robot))
    directory = output or Path("runs") / f"{recording.name}-{filter_config.settings.method}"
    check_directory(directory, marker=TRAJECTORY, overwrite=overwrite)

    with progress_bar(f"estimating {recording.name}") as progress:
        trajectory = estimation.estimate(recording, config=filter_config, progress=progress)
    write_run(
        trajectory,
        directory,
        sequence=sequence.resolve(),
        robot=recording.robot,
        config=filter_config,
        overwrite=overwrite,
    )
    report_events(trajectory)
    out.print(f"run: {directory}", markup=False)
    if recording.groundtruth is None:
        return
    try:
        evaluate_run(trajectory, recording, directory, Alignment.POSE)
    except MissingExtraError as error:
        err.print(f"not evaluated: {error}", markup=False)


def choose_config(config: str | None, method: Method | None) -> FilterConfig:
    """The configuration that ``--config`` and ``--method`` ask for together."""
    if config is None:
        return FilterConfig.load(method or Method.FULL)
    chosen = FilterConfig.load(config)
    if method is not None and chosen.settings.method != method:
        raise InputError(
            f"configures the method '{chosen.settings.method}', --method asks for '{method}'",
            file=config,
            field="settings.method",
            hint=f"leave out --method, or put 'base: {method}' into the file",
        )
    return chosen
