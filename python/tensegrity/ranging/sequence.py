"""A recording of a ranging robot with everything its sensors said, as a directory of CSV files.

=======================  ===========================================================================
``ranges.csv``           ``t_ns, node, anchor, range_m``: raw, distance plus offset [m]
``anchors.csv``          ``anchor, x_m, y_m, z_m``: empty cells are unknown
``robot.yaml``           the net, or the name of a packaged one; without it SUPERball
``offsets.csv``          ``node, anchor, offset_m``, optional as all below; for internal ranges the
                         other module stands in the column ``anchor``
``internal_ranges.csv``  ``t_ns, node, other, range_m``: raw, between modules of the robot
``imu_<id>.csv``         ``t_ns, gyro_x..z, accel_x..z`` of the IMU at an end, z along the rod
                         toward its end with the lower id
``motors.csv``           ``t_ns`` and ``l0_<i>_<j>``: rest length of each actuated cable [m]
``endcaps.csv``          ``t_ns, q_<id>_x..z``: true ends of the rods in the world [m]
``floor_truth.csv``      ``t_start_s, t_end_s, node, x_m, y_m``: where ends rested on the floor
=======================  ===========================================================================

Modules, nodes and IMUs go by the ids of the net. Arrays over nodes are in its order.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from tensegrity import robots
from tensegrity.errors import InputError
from tensegrity.files import new_directory
from tensegrity.ranging.recording import (
    ANCHORS_FILE,
    FLOOR_TRUTH_FILE,
    INTERNAL_RANGES_FILE,
    OFFSETS_FILE,
    RANGES_FILE,
    Anchors,
    FloatArray,
    FloorTruth,
    IntArray,
    InternalRanges,
    Offsets,
    RangeRecording,
    read_anchors,
    read_floor_truth,
    read_internal_ranges,
    read_offsets,
    read_ranges,
    write_anchors,
    write_floor_truth,
    write_internal_ranges,
    write_offsets,
    write_ranges,
)
from tensegrity.robots.net import Net
from tensegrity.sequence.directory import read_imu, write_imu
from tensegrity.sequence.sequence import EndcapStream, ImuStream
from tensegrity.sequence.table import Column, read_csv, write_csv
from tensegrity.yaml_model import dump

ROBOT_FILE = "robot.yaml"
MOTORS_FILE = "motors.csv"
ENDCAPS_FILE = "endcaps.csv"
_IMU_PREFIX = "imu_"


@dataclass(frozen=True)
class MotorStream:
    """``t_ns`` (N,) stamps [ns]; ``rest_lengths`` (N, actuated) of the cables in ``net.actuated()``
    [m]."""

    t_ns: IntArray
    rest_lengths: FloatArray


@dataclass(frozen=True)
class RangingSequence:
    """What a robot and its anchors recorded; ``imus`` by the id of the end they sit at.

    ``endcaps`` and ``floor_truth`` are truth. In a simulation ``offsets`` is, too.
    """

    name: str
    net: Net
    ranges: RangeRecording
    anchors: Anchors
    offsets: Offsets | None = None
    internal_ranges: InternalRanges | None = None
    imus: dict[int, ImuStream] = field(default_factory=dict)
    motors: MotorStream | None = None
    endcaps: EndcapStream | None = None
    floor_truth: FloorTruth | None = None


def read_sequence(path: str | Path) -> RangingSequence:
    """Read the files of the format in a directory; others are ignored.

    Raises :class:`InputError` with file, line and column, also for modules that are neither a node
    of the robot nor a listed anchor.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise InputError("no such directory", file=folder, hint="check the path")
    own = folder / ROBOT_FILE
    net = robots.load_net(own) if own.exists() else robots.load_net()
    anchors = read_anchors(folder)
    ranges = read_ranges(folder, anchors)
    _check_nodes(folder / RANGES_FILE, ranges.node, net, "node")
    internal = None
    if (folder / INTERNAL_RANGES_FILE).exists():
        internal = read_internal_ranges(folder)
        for column, ids in (("node", internal.node), ("other", internal.other)):
            _check_nodes(folder / INTERNAL_RANGES_FILE, ids, net, column)
    motors, endcaps = folder / MOTORS_FILE, folder / ENDCAPS_FILE
    return RangingSequence(
        name=folder.resolve().name,
        net=net,
        ranges=ranges,
        anchors=anchors,
        offsets=read_offsets(folder) if (folder / OFFSETS_FILE).exists() else None,
        internal_ranges=internal,
        imus=_read_imus(folder, net),
        motors=_read_motors(motors, net) if motors.exists() else None,
        endcaps=_read_endcaps(endcaps, net) if endcaps.exists() else None,
        floor_truth=read_floor_truth(folder) if (folder / FLOOR_TRUTH_FILE).exists() else None,
    )


def write_sequence(sequence: RangingSequence, path: str | Path, *, overwrite: bool = False) -> None:
    """Write what :func:`read_sequence` reads; the directory appears complete or not at all.

    ``overwrite`` allows an existing recording to be replaced. Raises :class:`InputError` when
    ``path`` is taken, :class:`ValueError` for content that could not be read back.
    """
    net = sequence.net
    with new_directory(Path(path), marker=RANGES_FILE, overwrite=overwrite) as folder:
        (folder / ROBOT_FILE).write_text(dump(net), encoding="utf-8")
        write_anchors(folder / ANCHORS_FILE, sequence.anchors)
        write_ranges(folder / RANGES_FILE, sequence.ranges)
        if sequence.offsets is not None:
            write_offsets(folder / OFFSETS_FILE, sequence.offsets)
        if sequence.internal_ranges is not None:
            write_internal_ranges(folder / INTERNAL_RANGES_FILE, sequence.internal_ranges)
        for node, imu in sequence.imus.items():
            write_imu(folder / f"{_IMU_PREFIX}{node}.csv", imu)
        if sequence.motors is not None:
            motors = sequence.motors
            write_csv(folder / MOTORS_FILE, _motor_columns(net), motors.t_ns, motors.rest_lengths)
        if sequence.endcaps is not None:
            write_endcaps(folder / ENDCAPS_FILE, sequence.endcaps, net)
        if sequence.floor_truth is not None:
            write_floor_truth(folder / FLOOR_TRUTH_FILE, sequence.floor_truth)


def write_endcaps(file: Path, endcaps: EndcapStream, net: Net) -> None:
    """Write an ``endcaps.csv`` of the ends of the net's rods."""
    values = endcaps.position.reshape(len(endcaps.t_ns), -1)
    write_csv(file, _endcap_columns(net), endcaps.t_ns, values)


def _motor_columns(net: Net) -> list[Column]:
    return [
        Column(
            "l0_{}_{}".format(*net.cables[index].ends),
            "a rest length above 0 [m]",
            lambda lengths: lengths > 0,
        )
        for index in net.actuated()
    ]


def _endcap_columns(net: Net) -> list[Column]:
    return [
        Column(f"q_{node}_{axis}", "a finite number [m]") for node in net.node_ids for axis in "xyz"
    ]


def _read_motors(file: Path, net: Net) -> MotorStream:
    table = read_csv(file, _motor_columns(net))
    return MotorStream(table.t_ns, table.values)


def _read_endcaps(file: Path, net: Net) -> EndcapStream:
    table = read_csv(file, _endcap_columns(net))
    return EndcapStream(table.t_ns, table.values.reshape(len(table.t_ns), len(net.nodes), 3))


def _read_imus(folder: Path, net: Net) -> dict[int, ImuStream]:
    imus = {}
    for file in folder.glob(f"{_IMU_PREFIX}*.csv"):
        node = file.stem.removeprefix(_IMU_PREFIX)
        if node not in map(str, net.node_ids):
            raise InputError(f"the robot has no node '{node}'", file=file, hint=_known(net))
        imus[int(node)] = read_imu(file)
    return dict(sorted(imus.items()))


def _check_nodes(file: Path, ids: IntArray, net: Net, column: str) -> None:
    for row, node in enumerate(ids.tolist()):
        if node not in net.node_ids:
            raise InputError(
                f"the robot has no node {node}",
                file=file,
                line=row + 2,
                field=column,
                hint=_known(net),
            )


def _known(net: Net) -> str:
    return f"nodes of {net.name} are {', '.join(map(str, net.node_ids))}"
