"""``tensegrity calibrate-robot``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.table import Column, Table

from tensegrity import calibration, robots
from tensegrity.calibration import RobotCalibration
from tensegrity.calibration.robot import OFFSET_STD_M
from tensegrity.cli.console import out, progress_bar
from tensegrity.config import FilterConfig
from tensegrity.files import check_file, write_file
from tensegrity.sequence import read
from tensegrity.yaml_model import dump


def calibrate_robot(
    sequences: Annotated[
        list[Path], typer.Argument(help="Recordings of the robot, standing and slowly rolling.")
    ],
    output: Annotated[Path, typer.Option("--out", help="File for the calibrated robot.")],
    robot: Annotated[
        str | None,
        typer.Option(help="Packaged robot or YAML file.", show_default="the recording's"),
    ] = None,
    config: Annotated[str, typer.Option(help="Packaged profile or YAML file.")] = "full",
    offset_std: Annotated[
        float, typer.Option(help="Cable offsets to expect, standard deviation [m].")
    ] = OFFSET_STD_M,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the file that is already there.")
    ] = False,
) -> None:
    """Find the cables' offsets and how the IMU sits on its rod, and write the robot with them."""
    check_file(output, overwrite=overwrite)
    filter_config = FilterConfig.load(config)
    model = None if robot is None else robots.load(robot)
    recordings = [read(path, robot=model) for path in sequences]
    with progress_bar("calibrating") as progress:
        result = calibration.calibrate_robot(
            recordings, config=filter_config, offset_std=offset_std, progress=progress
        )
    rows = _rows(result)
    names = ", ".join(recording.name for recording in recordings)
    found = "".join(f"#   {label}: {value} +- {std} {unit}\n" for label, value, std, unit in rows)
    write_file(
        output,
        f"# Calibrated from {names}; standard deviations behind +-.\n{found}{dump(result.robot)}",
        overwrite=overwrite,
    )
    table = Table("", *(Column(name, justify="right") for name in ("found", "±", "unit")))
    for row in rows:
        table.add_row(*row)
    out.print(table, soft_wrap=False)
    out.print(f"robot: {output}", markup=False)


def _rows(result: RobotCalibration) -> list[tuple[str, str, str, str]]:
    """Name, value, standard deviation and unit of all that was estimated."""
    robot = result.robot
    angles = np.degrees(robot.imu_misalignment)
    angle_stds = np.degrees(result.imu_misalignment_std)
    rows = [("imu_offset", 1e3 * robot.imu_offset, 1e3 * result.imu_offset_std, "mm")]
    for axis, angle, std in zip("xy", angles, angle_stds, strict=True):
        rows.append((f"imu_misalignment {axis}", angle, std, "deg"))
    for cable, offset, std in zip(
        robot.cables, robot.cable_offsets, result.cable_offset_std, strict=True
    ):
        rows.append(("cable {}-{}".format(*cable.endcaps), 1e3 * offset, 1e3 * std, "mm"))
    return [(label, f"{value:+.2f}", f"{std:.2f}", unit) for label, value, std, unit in rows]
