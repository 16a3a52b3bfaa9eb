"""``tensegrity experiment``."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.table import Column, Table

from tensegrity.cli.console import out, progress_bar
from tensegrity.experiments.superball import Outcome, Setting, run_experiment
from tensegrity.files import new_directory
from tensegrity.plotting.superball import draw_end_cap, draw_faces, draw_local
from tensegrity.simulation.superball import Experiment

TABLE = "results.csv"
_LOCAL_NODES = (1, 2)  # of C Fig. 6
_GLOBAL_NODE = 12  # of C Fig. 8


class Name(StrEnum):
    """Experiments there are."""

    SUPERBALL_LOCAL = "superball-local"
    SUPERBALL_GLOBAL = "superball-global"


def experiment(
    name: Annotated[Name, typer.Argument(help="Which experiment.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "--out", help="Directory for table and figures.", show_default="runs/<experiment>"
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, max=100, help="Simulated recordings.")] = 1,
    duration: Annotated[
        float | None,
        typer.Option(min=8, max=600, help="Of a recording [s].", show_default="75 or 60"),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the results that are already there.")
    ] = False,
) -> None:
    """Repeat a published experiment on simulated recordings: print its table, draw its figures."""
    kind = Experiment.LOCAL if name is Name.SUPERBALL_LOCAL else Experiment.ROLLING
    directory = output or Path("runs") / name
    with new_directory(directory, marker=TABLE, overwrite=overwrite) as folder:
        outcomes: list[Outcome] = []
        with progress_bar(name) as progress:
            for seed in range(seeds):
                part = partial(_advance, progress, seed, seeds)
                outcomes += run_experiment(kind, list(Setting), seed, duration, part)
        first = [outcome for outcome in outcomes if outcome.seed == 0]
        if kind is Experiment.LOCAL:
            draw_local(first[0], _LOCAL_NODES, folder / "end_caps.png")
        else:
            draw_faces(first, folder / "faces.png")
            draw_end_cap(first, _GLOBAL_NODE, folder / f"end_cap_{_GLOBAL_NODE}.png")
        (folder / TABLE).write_text(_csv(outcomes), encoding="utf-8")
    out.print(_table(outcomes), soft_wrap=False)
    out.print(f"table and figures: {directory}", markup=False)


def _advance(progress: Callable[[float], None], done: int, total: int, fraction: float) -> None:
    progress((done + fraction) / total)


def _table(outcomes: list[Outcome]) -> Table:
    names = (
        "CoM [m]",
        "end caps [m]",
        "NEES",
        "first face",
        "faces [%]",
        "rejected [%]",
        "angles",
        "IMU",
        "restarts",
    )
    table = Table("", *(Column(name, justify="right") for name in names))
    for setting in Setting:
        runs = [outcome for outcome in outcomes if outcome.setting is setting]
        errors = [run.settled for run in runs]
        health = [run.track.health for run in runs]
        used = sum(h.ranges_used for h in health)
        rejected = sum(h.ranges_rejected for h in health)
        table.add_row(
            setting,
            f"{np.mean([e.centre_of_mass_rmse for e in errors]):.3f}",
            f"{np.mean([e.node_rmse for e in errors]):.3f}",
            f"{np.mean([np.median(e.nees) / 3 for e in errors]):.2f}",
            f"{sum(run.found_face for run in runs)}/{len(runs)}",
            f"{100 * np.mean([e.face_right.mean() for e in errors]):.1f}",
            f"{100 * rejected / max(used + rejected, 1):.1f}",
            str(sum(h.inclinations_rejected for h in health)),
            str(sum(h.imu_rejected for h in health)),
            str(sum(h.restarts for h in health)),
        )
    return table


def _csv(outcomes: list[Outcome]) -> str:
    lines = [
        "setting,seed,centre_of_mass_rmse_m,endcap_rmse_m,nees_median,first_face_found,"
        "faces_right,ranges_used,ranges_rejected,inclinations_rejected,imu_rejected,restarts"
    ]
    for run in outcomes:
        errors, health = run.settled, run.track.health
        lines.append(
            f"{run.setting},{run.seed},{errors.centre_of_mass_rmse:.4f},{errors.node_rmse:.4f},"
            f"{np.median(errors.nees) / 3:.3f},{int(run.found_face)},"
            f"{errors.face_right.mean():.4f},{health.ranges_used},{health.ranges_rejected},"
            f"{health.inclinations_rejected},{health.imu_rejected},{health.restarts}"
        )
    return "\n".join(lines) + "\n"
