"""``tensegrity simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from tensegrity import robots
from tensegrity.cli.console import out, progress_bar
from tensegrity.cli.model_options import with_options_of
from tensegrity.cli.recording import record
from tensegrity.files import check_directory
from tensegrity.sequence.directory import IMU
from tensegrity.simulation import Manoeuvre, SimulationOptions


@with_options_of(SimulationOptions)
def simulate(
    manoeuvre: Annotated[Manoeuvre, typer.Argument(help="What the robot does.")],
    output: Annotated[Path, typer.Option("--out", help="Directory of the recording.")],
    robot: Annotated[str, typer.Option(help="Packaged robot or YAML file.")] = "prism3",
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the recording that is already there.")
    ] = False,
    **options: Any,
) -> None:
    """Simulate a rolling robot and its sensors, and write the recording with the truth."""
    chosen = SimulationOptions(**options)
    model = robots.load(robot)
    check_directory(output, marker=IMU, overwrite=overwrite)
    with progress_bar(f"simulating {manoeuvre}") as progress:
        record(manoeuvre, chosen, model, output, progress)
    out.print(f"recording: {output}", markup=False)
