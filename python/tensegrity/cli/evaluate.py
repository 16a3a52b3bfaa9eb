"""``tensegrity evaluate``, and the evaluation that other commands share with it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tensegrity.cli.console import out
from tensegrity.cli.tables import metrics_table
from tensegrity.errors import InputError
from tensegrity.evaluation import Alignment, compare, measure, published_result
from tensegrity.plotting import save_figures
from tensegrity.run import Run, read_run
from tensegrity.sequence import Sequence, read
from tensegrity.trajectory import Trajectory

METRICS = "metrics.json"
FIGURES = "figures"


def evaluate(
    run: Annotated[Path, typer.Argument(help="Directory written by 'estimate'.")],
    truth: Annotated[
        Path | None,
        typer.Option(help="Recording with the truth, where it is not the one estimated from."),
    ] = None,
    yaw_only: Annotated[
        bool,
        typer.Option(
            "--yaw-only",
            help="Align heading and position alone; an initial tilt then counts as error.",
        ),
    ] = False,
) -> None:
    """Compare a run with the truth: prints a table, writes metrics.json and figures into RUN."""
    opened = read_run(run)
    evaluate_run(
        opened.trajectory,
        read_truth(opened, truth),
        run,
        Alignment.YAW if yaw_only else Alignment.POSE,
    )


def read_truth(run: Run, path: Path | None = None) -> Sequence:
    """The recording at ``path``, by default the one that the run was made from."""
    if path is not None:
        return read(path)
    recorded = Path(run.info.sequence)
    if not recorded.exists():
        raise InputError(
            f"the recording it was made from, {recorded}, is no longer there",
            file=run.path,
            hint="name its present place with --truth",
        )
    return read(recorded)


def evaluate_run(
    trajectory: Trajectory, sequence: Sequence, directory: Path, alignment: Alignment
) -> None:
    """Print the metrics of a run and write them and its figures into its directory."""
    comparison = compare(trajectory, sequence, alignment)
    metrics = measure(comparison, trajectory.runtime_s)
    label = comparison.method or "estimate"
    out.print(
        metrics_table(sequence.name, {label: metrics}, published_result(sequence.name)),
        soft_wrap=False,
    )
    metrics.save(directory / METRICS)
    save_figures({label: comparison}, directory / FIGURES)
    out.print(f"metrics: {directory / METRICS}\nfigures: {directory / FIGURES}", markup=False)
