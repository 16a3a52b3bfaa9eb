"""``tensegrity compare``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tensegrity import evaluation
from tensegrity.cli.console import out
from tensegrity.cli.evaluate import METRICS, read_truth
from tensegrity.cli.tables import metrics_table
from tensegrity.errors import InputError
from tensegrity.evaluation import Metrics, published_result
from tensegrity.plotting import save_figures
from tensegrity.run import read_run


def compare(
    runs: Annotated[list[Path], typer.Argument(help="Directories written by 'estimate'.")],
    figures: Annotated[
        Path | None,
        typer.Option(help="Draw the runs over each other into this directory, by recording."),
    ] = None,
) -> None:
    """Print the metrics of runs side by side, one table per recording."""
    labels = _labels(runs)
    by_recording: dict[str, dict[str, Metrics]] = {}
    for path, label in labels.items():
        metrics = Metrics.load(path / METRICS)
        by_recording.setdefault(metrics.sequence, {})[label] = metrics
    for recording, columns in by_recording.items():
        out.print(metrics_table(recording, columns, published_result(recording)), soft_wrap=False)
    if figures is not None:
        for recording, columns in by_recording.items():
            paths = {label: path for path, label in labels.items() if label in columns}
            _draw(paths, columns, figures / recording)
            out.print(f"figures: {figures / recording}", markup=False)


def _labels(runs: list[Path]) -> dict[Path, str]:
    """The shortest names that tell the runs apart: the directory's own, or the path as given."""
    names = [run.resolve().name for run in runs]
    if len(set(runs)) < len(runs):
        raise InputError("the same run is named twice", hint="name every run once")
    return {
        run: name if names.count(name) == 1 else str(run)
        for run, name in zip(runs, names, strict=True)
    }


def _draw(paths: dict[str, Path], metrics: dict[str, Metrics], directory: Path) -> None:
    runs = {label: read_run(path) for label, path in paths.items()}
    recordings = {run.info.sequence for run in runs.values()}
    if len(recordings) > 1:
        raise InputError(
            f"cannot draw runs of different recordings together: {', '.join(sorted(recordings))}",
            hint="compare them without --figures, or recording by recording",
        )
    comparisons = {
        label: evaluation.compare(run.trajectory, read_truth(run), metrics[label].alignment)
        for label, run in runs.items()
    }
    save_figures(comparisons, directory)
