"""``tensegrity simulate``, and the recording of a simulation that the demo shares with it."""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from tensegrity.cli.console import out, progress_bar
from tensegrity.cli.output import check_output
from tensegrity.robots import Robot
from tensegrity.simulation.options import SimulationOptions
from tensegrity.yaml_model import dump_sections, unit_of

SIMULATION = "simulation.yaml"
"""Where a simulated recording says how it was made."""


def simulate(
    manoeuvre: Annotated[str, typer.Argument(help="forward, backward, left-turn or right-turn.")],
    output: Annotated[Path, typer.Option("--out", help="Directory of the recording.")],
    robot: Annotated[str, typer.Option(help="Packaged robot or YAML file.")] = "prism3",
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the recording that is already there.")
    ] = False,
    **options: Any,
) -> None:
    """Simulate a rolling robot and its sensors, and write the recording with the truth."""
    from tensegrity import robots
    from tensegrity.sequence.directory import IMU

    chosen = SimulationOptions(**options)
    model = robots.load(robot)
    check_output(output, marker=IMU, overwrite=overwrite)
    with progress_bar(f"simulating {manoeuvre}") as progress:
        record(manoeuvre, chosen, model, output, progress)
    out.print(f"recording: {output}", markup=False)


def record(
    manoeuvre: str,
    options: SimulationOptions,
    robot: Robot,
    directory: Path,
    progress: Callable[[float], None],
) -> None:
    """Simulate and write a recording, with its options; one that is there is replaced."""
    from tensegrity.sequence import write
    from tensegrity.simulation import simulate as run_simulation

    sequence = run_simulation(manoeuvre, options, robot, progress)
    write(sequence, directory, overwrite=True)
    (directory / SIMULATION).write_text(describe(manoeuvre, options, robot), encoding="utf-8")


def describe(manoeuvre: str, options: SimulationOptions, robot: Robot) -> str:
    """Everything that determines a simulated recording, as YAML."""
    return dump_sections({"manoeuvre": manoeuvre, "options": options, "robot": robot})


def _with_options_of(model: type[SimulationOptions], command: Callable[..., None]) -> None:
    """Give the command an option for every field of the model, in place of ``**options``.

    typer reads a command's options from its signature; description, unit and default are stated
    once, in the model.
    """
    parameters = [
        parameter
        for parameter in inspect.signature(command, eval_str=True).parameters.values()
        if parameter.kind is not inspect.Parameter.VAR_KEYWORD
    ]
    for name, info in model.model_fields.items():
        unit = unit_of(info)
        text = f"{info.description} [{unit}]" if unit else str(info.description)
        kind = _option_type(info.annotation)
        parameters.append(
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=info.default,
                annotation=Annotated[kind, typer.Option(help=text[0].upper() + text[1:] + ".")],
            )
        )
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in parameters}


def _option_type(annotation: Any) -> Any:
    """The type by which typer reads a field: lists for tuples of any length (repeated options)."""
    if typing.get_origin(annotation) is Annotated:
        return _option_type(typing.get_args(annotation)[0])
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        return typing.Union[tuple(_option_type(a) for a in typing.get_args(annotation))]  # noqa: UP007
    if typing.get_origin(annotation) is tuple:
        return list[typing.get_args(annotation)[0]]  # type: ignore[misc]
    return annotation


_with_options_of(SimulationOptions, simulate)
