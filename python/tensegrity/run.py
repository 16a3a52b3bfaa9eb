"""A run: what an estimator made of a recording, as a directory.

``trajectory.tum`` (pose of the body in the world), ``endcaps.csv`` (world), ``state.csv``
(everything else of the state) and ``config.yaml`` (all that is needed to repeat the run).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tensegrity import __version__
from tensegrity.config import FilterConfig
from tensegrity.errors import InputError
from tensegrity.files import new_directory
from tensegrity.robots import Robot
from tensegrity.sequence import EndcapStream, PoseStream
from tensegrity.sequence.directory import contact_columns, read_endcaps, write_endcaps
from tensegrity.sequence.poses import read_poses, write_poses
from tensegrity.sequence.table import Column, csv_header, read_csv, write_csv
from tensegrity.trajectory import FloatArray, IntArray, Trajectory
from tensegrity.yaml_model import Document, StrictModel, dump, field

TRAJECTORY = "trajectory.tum"
ENDCAPS = "endcaps.csv"
STATE = "state.csv"
CONFIG = "config.yaml"

_HEALTH = "health_"
_NIS = ("cable_nis", "ground_nis")
_UPPER = np.triu_indices(3)


class RunInfo(StrictModel):
    """Where a run comes from: enough to repeat it."""

    version: str = field("version of the package")
    sequence: str = field("the recording")
    runtime_s: float = field("time spent in the estimator", unit="s", ge=0)
    info: dict[str, bool | int | float | str] = field("what else describes the run")
    robot: Robot = field("the robot")
    filter: FilterConfig = field("configuration of the filter")


@dataclass(frozen=True)
class Run:
    """A run that was read back. The poses of its trajectory are accurate to nine digits."""

    path: Path
    trajectory: Trajectory
    info: RunInfo


def write_run(
    trajectory: Trajectory,
    path: str | Path,
    *,
    sequence: str | Path,
    robot: Robot,
    config: FilterConfig,
    overwrite: bool = False,
) -> None:
    """Write a run as a directory that appears complete or not at all.

    ``sequence`` is the path or name of the recording. ``overwrite`` allows an existing run to be
    replaced. Raises :class:`InputError` when ``path`` is taken, :class:`ValueError` when the
    trajectory is not finite.
    """
    info = RunInfo(
        version=__version__,
        sequence=str(sequence),
        runtime_s=trajectory.runtime_s,
        info={key: _scalar(value) for key, value in trajectory.info.items()},
        robot=robot,
        filter=config,
    )
    t_ns = trajectory.t_ns
    with new_directory(Path(path), marker=TRAJECTORY, overwrite=overwrite) as folder:
        poses = PoseStream(t_ns, trajectory.position, trajectory.quaternion)
        write_poses(folder / TRAJECTORY, poses)
        write_endcaps(folder / ENDCAPS, EndcapStream(t_ns, trajectory.endcaps_world))
        columns = _state_columns(robot, list(trajectory.health))
        write_csv(folder / STATE, columns, t_ns, _pack(trajectory))
        (folder / CONFIG).write_text(dump(info), encoding="utf-8")


def is_run(path: str | Path) -> bool:
    """Whether ``path`` is a directory that :func:`write_run` wrote."""
    return (Path(path) / TRAJECTORY).is_file()


def read_run(path: str | Path) -> Run:
    """Read a run. Raises :class:`InputError` with file, line and field."""
    path = Path(path)
    if not path.is_dir():
        problem = "is a file, a run is a directory" if path.exists() else "no such run"
        raise InputError(problem, file=path, hint="a run is what 'tensegrity estimate' writes")
    document = Document(path / CONFIG)
    info = document.model(RunInfo, document.mapping())
    poses = read_poses(path / TRAJECTORY)
    endcaps = read_endcaps(path / ENDCAPS, info.robot)
    header = csv_header(path / STATE)
    for name in _NIS:
        if name not in header:
            raise InputError(
                "column is missing",
                file=path / STATE,
                line=1,
                field=name,
                hint="runs of versions before it had none: estimate again",
            )
    names = [n.removeprefix(_HEALTH) for n in header if n.startswith(_HEALTH)]
    state = read_csv(path / STATE, _state_columns(info.robot, names))
    for file, t_ns in ((ENDCAPS, endcaps.t_ns), (STATE, state.t_ns)):
        if not np.array_equal(t_ns, poses.t_ns):
            raise InputError(
                f"its stamps are not those of {TRAJECTORY}",
                file=path / file,
                field="t_ns",
                hint="estimate again",
            )
    return Run(path, _unpack(poses, endcaps, state.values, names, info), info)


def _state_columns(robot: Robot, health: list[str]) -> list[Column]:
    def vector(name: str, unit: str) -> list[Column]:
        return [Column(f"{name}_{axis}", f"a finite number [{unit}]") for axis in "xyz"]

    def covariance(name: str, unit: str) -> list[Column]:
        pairs = ("xx", "xy", "xz", "yy", "yz", "zz")
        return [Column(f"{name}_cov_{pair}", f"a finite number [{unit}]") for pair in pairs]

    return [
        *vector("velocity", "m/s"),
        *vector("gyro_bias", "rad/s"),
        *vector("accel_bias", "m/s^2"),
        Column("spin", "a finite number [rad]"),
        *covariance("position", "m^2"),
        *covariance("orientation", "rad^2"),
        *covariance("velocity", "m^2/s^2"),
        *(
            Column(name, "an empty cell or a number >= 0", lambda nis: nis >= 0, may_be_empty=True)
            for name in _NIS
        ),
        *contact_columns(robot),
        *(
            Column(
                f"load_{endcap}",
                "an empty cell or a share between 0 and 1",
                lambda share: (share >= 0) & (share <= 1),
                may_be_empty=True,
            )
            for endcap in range(robot.number_of_endcaps)
        ),
        *(
            Column(f"{_HEALTH}{name}", "a count >= 0", lambda counts: counts >= 0)
            for name in health
        ),
    ]


def _pack(trajectory: Trajectory) -> FloatArray:
    """State (N, columns) in the order of :func:`_state_columns`."""
    covariances = (
        trajectory.position_covariance,
        trajectory.orientation_covariance,
        trajectory.velocity_covariance,
    )
    return np.column_stack(
        [
            trajectory.velocity,
            trajectory.gyro_bias,
            trajectory.accel_bias,
            trajectory.spin,
            *(covariance[:, *_UPPER] for covariance in covariances),
            trajectory.cable_nis,
            trajectory.ground_nis,
            trajectory.contacts,
            trajectory.load_shares,
            *trajectory.health.values(),
        ]
    )


def _unpack(
    poses: PoseStream, endcaps: EndcapStream, state: FloatArray, health: list[str], info: RunInfo
) -> Trajectory:
    count = info.robot.number_of_endcaps
    sizes = [3, 3, 3, 1, 6, 6, 6, len(_NIS), count, count]
    parts = np.split(state, np.cumsum(sizes), axis=1)
    velocity, gyro_bias, accel_bias, spin, *covariances, nis, contacts, shares, counters = parts
    rotation = Rotation.from_quat(poses.quaternion).as_matrix()
    relative = endcaps.position - poses.position[:, None]
    position_covariance, orientation_covariance, velocity_covariance = map(_symmetric, covariances)
    return Trajectory(
        t_ns=poses.t_ns,
        position=poses.position,
        quaternion=poses.quaternion,
        velocity=velocity,
        gyro_bias=gyro_bias,
        accel_bias=accel_bias,
        spin=spin[:, 0],
        endcaps_body=np.einsum("nji,nej->nei", rotation, relative),
        endcaps_world=endcaps.position,
        contacts=contacts.astype(np.bool_),
        position_covariance=position_covariance,
        orientation_covariance=orientation_covariance,
        velocity_covariance=velocity_covariance,
        health=_counters(health, counters),
        load_shares=shares,
        cable_nis=nis[:, 0],
        ground_nis=nis[:, 1],
        runtime_s=info.runtime_s,
        info=dict(info.info),
    )


def _symmetric(upper: FloatArray) -> FloatArray:
    """Matrices (N, 3, 3) from their upper triangles (N, 6)."""
    matrix = np.empty((len(upper), 3, 3))
    rows, columns = _UPPER
    matrix[:, rows, columns] = upper
    matrix[:, columns, rows] = upper
    return matrix


def _counters(names: list[str], values: FloatArray) -> dict[str, IntArray]:
    return {name: values[:, i].astype(np.int64) for i, name in enumerate(names)}


def _scalar(value: Any) -> bool | int | float | str:
    """``value`` as YAML knows it: NumPy's scalars as Python's, everything else as text."""
    if isinstance(value, np.generic):
        value = value.item()
    return value if isinstance(value, bool | int | float | str) else str(value)
