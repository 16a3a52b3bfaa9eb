"""Simulated recordings on disk: the recording itself and how it was made."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tensegrity import __version__
from tensegrity.robots import Robot
from tensegrity.sequence import write
from tensegrity.simulation import Manoeuvre, SimulationOptions, simulate
from tensegrity.yaml_model import StrictModel, dump, field

SIMULATION = "simulation.yaml"


class SimulationInfo(StrictModel):
    """Everything that determines a simulated recording."""

    version: str = field("version of the package")
    manoeuvre: str = field("what the robot does")
    options: SimulationOptions = field("options of the simulation")
    robot: Robot = field("the robot")


def describe(manoeuvre: Manoeuvre, options: SimulationOptions, robot: Robot) -> str:
    """:class:`SimulationInfo` as YAML; the same text means the same recording."""
    return dump(
        SimulationInfo(version=__version__, manoeuvre=manoeuvre.value, options=options, robot=robot)
    )


def record(
    manoeuvre: Manoeuvre,
    options: SimulationOptions,
    robot: Robot,
    directory: Path,
    progress: Callable[[float], None],
) -> None:
    """Simulate and write a recording and how it was made; one that is there is replaced."""
    sequence = simulate(manoeuvre, options, robot, progress)
    write(sequence, directory, overwrite=True)
    (directory / SIMULATION).write_text(describe(manoeuvre, options, robot), encoding="utf-8")
