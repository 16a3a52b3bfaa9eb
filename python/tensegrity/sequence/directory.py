"""Recordings as directories of CSV files, the package's own format."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tensegrity import robots
from tensegrity.errors import InputError
from tensegrity.files import new_directory
from tensegrity.robots import Robot
from tensegrity.sequence.poses import read_poses, write_poses
from tensegrity.sequence.sequence import (
    CableStream,
    ContactStream,
    EndcapStream,
    ImuStream,
    IntArray,
    Sequence,
)
from tensegrity.sequence.table import Column, read_csv, write_csv
from tensegrity.yaml_model import dump

IMU = "imu.csv"
CABLES = "cables.csv"
CONTACTS = "contacts.csv"
ROBOT = "robot.yaml"
GROUNDTRUTH = "groundtruth.tum"
ENDCAPS = "endcaps.csv"

# Two rods end to end span two rod lengths; no cable between their endcaps is longer.
_LONGEST_CABLE = 2.0  # rod lengths

_IMU_COLUMNS = [
    *(Column(f"gyro_{axis}", "a finite number [rad/s]") for axis in "xyz"),
    *(Column(f"accel_{axis}", "a finite number [m/s^2]") for axis in "xyz"),
]


class DirectoryReader:
    """Reads a directory with at least ``imu.csv`` and ``cables.csv``."""

    def accepts(self, path: Path) -> bool:
        """Every directory: what is missing in it is reported when it is read."""
        return path.is_dir()

    def read(self, path: Path, robot: Robot | None) -> Sequence:
        """Read the files the format knows; others are ignored."""
        if robot is None:
            own = path / ROBOT
            robot = robots.load(own) if own.exists() else robots.load()
        for required in (IMU, CABLES):
            if not (path / required).exists():
                raise InputError(
                    "no such file", file=path / required, hint="every sequence needs this file"
                )
        imu = read_imu(path / IMU)
        contacts, groundtruth, endcaps = (path / f for f in (CONTACTS, GROUNDTRUTH, ENDCAPS))
        sequence = Sequence(
            name=path.resolve().name,
            robot=robot,
            imu=imu,
            cables=_read_cables(path / CABLES, robot),
            contacts=_read_contacts(contacts, robot) if contacts.exists() else None,
            groundtruth=read_poses(groundtruth) if groundtruth.exists() else None,
            endcaps=read_endcaps(endcaps, robot) if endcaps.exists() else None,
            other_imus={
                file.stem.removeprefix("imu_"): read_imu(file)
                for file in sorted(path.glob("imu_*.csv"))
            },
        )
        for name, t_ns in _stamps(sequence).items():
            _check_same_clock(path / name, t_ns, imu.t_ns)
        return sequence


def write(sequence: Sequence, path: str | Path, *, overwrite: bool = False) -> None:
    """Write a recording as a directory that appears complete or not at all.

    ``overwrite`` allows an existing sequence to be replaced. Raises :class:`InputError` when
    ``path`` is taken, :class:`ValueError` for content that could not be read back.
    """
    robot = sequence.robot
    with new_directory(Path(path), marker=IMU, overwrite=overwrite) as folder:
        (folder / ROBOT).write_text(dump(robot), encoding="utf-8")
        write_imu(folder / IMU, sequence.imu)
        for name, imu in sequence.other_imus.items():
            write_imu(folder / f"imu_{name}.csv", imu)
        cables = sequence.cables
        write_csv(folder / CABLES, cable_columns(robot), cables.t_ns, cables.lengths)
        if sequence.contacts is not None:
            contacts = sequence.contacts
            write_csv(folder / CONTACTS, contact_columns(robot), contacts.t_ns, contacts.flags)
        if sequence.groundtruth is not None:
            write_poses(folder / GROUNDTRUTH, sequence.groundtruth)
        if sequence.endcaps is not None:
            write_endcaps(folder / ENDCAPS, sequence.endcaps)


def read_imu(file: Path) -> ImuStream:
    """Samples of one IMU from its CSV file."""
    table = read_csv(file, _IMU_COLUMNS)
    return ImuStream(table.t_ns, table.values[:, :3].copy(), table.values[:, 3:].copy())


def write_imu(file: Path, imu: ImuStream) -> None:
    """Write what :func:`read_imu` reads."""
    write_csv(file, _IMU_COLUMNS, imu.t_ns, np.hstack([imu.gyro, imu.accel]))


def read_endcaps(file: Path, robot: Robot) -> EndcapStream:
    """Endcap centres in the world from ``endcaps.csv``."""
    table = read_csv(file, _endcap_columns(robot.number_of_endcaps))
    return EndcapStream(table.t_ns, table.values.reshape(-1, robot.number_of_endcaps, 3))


def write_endcaps(file: Path, endcaps: EndcapStream) -> None:
    """Write what :func:`read_endcaps` reads."""
    samples, count, _ = endcaps.position.shape
    values = endcaps.position.reshape(samples, 3 * count)
    write_csv(file, _endcap_columns(count), endcaps.t_ns, values)


def cable_columns(robot: Robot) -> list[Column]:
    """One length per cable; an empty cell says that the cable was not measured."""
    longest = _LONGEST_CABLE * robot.rod_length
    return [
        Column(
            "l_{}_{}".format(*cable.endcaps),
            f"an empty cell or a length between 0 and {longest:g} m (two rod lengths) [m]",
            lambda lengths: (lengths > 0) & (lengths <= longest),
            may_be_empty=True,
        )
        for cable in robot.cables
    ]


def contact_columns(robot: Robot) -> list[Column]:
    """One 0/1 column per endcap."""
    return [
        Column(f"c_{i}", "0 or 1", lambda flags: (flags == 0) | (flags == 1))
        for i in range(robot.number_of_endcaps)
    ]


def _endcap_columns(count: int) -> list[Column]:
    return [Column(f"q_{i}_{axis}", "a finite number [m]") for i in range(count) for axis in "xyz"]


def _read_cables(file: Path, robot: Robot) -> CableStream:
    table = read_csv(file, cable_columns(robot))
    return CableStream(table.t_ns, table.values)


def _read_contacts(file: Path, robot: Robot) -> ContactStream:
    table = read_csv(file, contact_columns(robot))
    return ContactStream(table.t_ns, table.values.astype(np.bool_))


def _stamps(sequence: Sequence) -> dict[str, IntArray]:
    """Stamps of every stream but the base IMU, by file."""
    streams = {
        CABLES: sequence.cables,
        CONTACTS: sequence.contacts,
        GROUNDTRUTH: sequence.groundtruth,
        ENDCAPS: sequence.endcaps,
        **{f"imu_{name}.csv": imu for name, imu in sequence.other_imus.items()},
    }
    return {name: stream.t_ns for name, stream in streams.items() if stream is not None}


def _check_same_clock(file: Path, t_ns: IntArray, imu_t_ns: IntArray) -> None:
    if t_ns[0] > imu_t_ns[-1] or t_ns[-1] < imu_t_ns[0]:
        raise InputError(
            f"covers {_span(t_ns)}, {IMU} covers {_span(imu_t_ns)}: no common time",
            file=file,
            hint="all stamps of a sequence have to come from one clock",
        )


def _span(t_ns: IntArray) -> str:
    return f"{t_ns[0] * 1e-9:.3f} s to {t_ns[-1] * 1e-9:.3f} s"
