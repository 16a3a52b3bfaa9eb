"""Files of a ranging recording: ranges, anchors, offsets and surveyed floor positions.

Modules (nodes of the robot and anchors alike) go by their numbers. Raw ranges are the distance plus
an offset of a few metres that the antennas' delays add (C eqs. 6-7, C is Caluwaerts et al. 2016).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tensegrity.errors import InputError
from tensegrity.ranging.columns import (
    INT64_LEAST,
    INT64_MOST,
    Field,
    header_of,
    read_columns,
    write_columns,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

LONGEST_RANGE_M = 300.0
"""No ultra-wideband module of this class reaches farther; longer "ranges" are broken stamps."""

RANGES_FILE = "ranges.csv"
ANCHORS_FILE = "anchors.csv"
OFFSETS_FILE = "offsets.csv"
INTERNAL_RANGES_FILE = "internal_ranges.csv"
FLOOR_TRUTH_FILE = "floor_truth.csv"

_STAMP = Field("t_ns", "a whole number [ns]", integer=True, least=INT64_LEAST, most=INT64_MOST)
_STEP = Field("step", "a whole number of at least 0", integer=True, least=0, most=2**31)


def _module(name: str) -> Field:
    return Field(name, "the number of a module", integer=True, least=0, most=2**31)


def _range(name: str) -> Field:
    return Field(
        name, f"a range between 0 and {LONGEST_RANGE_M:g} [m]", least=0.0, most=LONGEST_RANGE_M
    )


def _coordinate(name: str) -> Field:
    return Field(
        name, "a coordinate within 10 km [m] or nothing", may_be_empty=True, least=-1e4, most=1e4
    )


_RANGE_FIELDS = (_module("node"), _module("anchor"), _range("range_m"))
_INTERNAL_FIELDS = (_STAMP, _module("node"), _module("other"), _range("range_m"))
_ANCHOR_FIELDS = (_module("anchor"), *(_coordinate(f"{axis}_m") for axis in "xyz"))
_OFFSET_FIELDS = (
    _module("node"),
    _module("anchor"),
    Field("offset_m", "an offset within 100 [m]", least=-100.0, most=100.0),
)
_FLOOR_FIELDS = (
    Field("t_start_s", "a number [s]"),
    Field("t_end_s", "a number [s]"),
    _module("node"),
    Field("x_m", "a number [m]"),
    Field("y_m", "a number [m]"),
)


@dataclass(frozen=True)
class RangeRecording:
    """Raw ranges between modules of the robot and anchors, sorted by time; N of them.

    * ``t_ns`` (N,) stamps [ns]. When not ``timed`` they only count steps: ranges of one step belong
      together, and how much time passes between steps is unknown
    * ``node``, ``anchor`` (N,) numbers of the modules at both ends
    * ``range_m`` (N,) distance plus offset [m]
    """

    t_ns: IntArray
    node: IntArray
    anchor: IntArray
    range_m: FloatArray
    timed: bool = True
    name: str = "recording"

    def __len__(self) -> int:
        return len(self.t_ns)

    @property
    def elapsed(self) -> FloatArray:
        """Seconds (N,) from the first range when ``timed``, else steps."""
        if self.timed:
            return (self.t_ns - self.t_ns[0]) * 1e-9
        return self.t_ns.astype(np.float64)

    @property
    def nodes(self) -> IntArray:
        """Modules of the robot that were ranged, ascending."""
        return np.unique(self.node)

    @property
    def anchors(self) -> IntArray:
        """Anchors that were ranged, ascending."""
        return np.unique(self.anchor)

    def where(self, mask: BoolArray) -> RangeRecording:
        """The ranges with a true flag in ``mask`` (N,)."""
        return RangeRecording(
            self.t_ns[mask],
            self.node[mask],
            self.anchor[mask],
            self.range_m[mask],
            self.timed,
            self.name,
        )

    def between(self, start_s: float, end_s: float) -> RangeRecording:
        """Ranges stamped from ``start_s`` up to but without ``end_s`` [s], or steps when not
        ``timed``.

        Raises :class:`InputError` when there are none.
        """
        stamps = self.t_ns * (1e-9 if self.timed else 1.0)
        inside = (start_s <= stamps) & (stamps < end_s)
        if not inside.any():
            raise InputError(
                f"'{self.name}' holds no ranges from {start_s:g} up to {end_s:g}",
                hint=f"it goes from {stamps[0]:g} to {stamps[-1]:g}",
            )
        return self.where(inside)


@dataclass(frozen=True)
class InternalRanges:
    """Raw ranges among the robot's own modules: ``t_ns``, ``node``, ``other``, ``range_m`` (N,)."""

    t_ns: IntArray
    node: IntArray
    other: IntArray
    range_m: FloatArray

    def __len__(self) -> int:
        return len(self.t_ns)


@dataclass(frozen=True)
class Anchors:
    """Numbers ``ids`` (A,) and positions ``position_m`` (A, 3) in the world [m]; NaN: unknown."""

    ids: IntArray
    position_m: FloatArray

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def known(self) -> BoolArray:
        """(A, 3) which coordinates are known."""
        return np.isfinite(self.position_m)

    def position(self, anchor: int) -> FloatArray:
        """Position (3,) of one anchor [m]."""
        return self.position_m[int(np.flatnonzero(self.ids == anchor)[0])]


@dataclass(frozen=True)
class Offsets:
    """``offset_m`` (P,) [m] of the pairs ``node`` and ``anchor`` (P,), the ones that are known."""

    node: IntArray
    anchor: IntArray
    offset_m: FloatArray

    def __len__(self) -> int:
        return len(self.offset_m)

    def table(self, nodes: Iterable[int], anchors: Iterable[int]) -> FloatArray:
        """Offsets (nodes, anchors) [m]; NaN: unknown."""
        known = {
            (int(node), int(anchor)): float(offset)
            for node, anchor, offset in zip(self.node, self.anchor, self.offset_m, strict=True)
        }
        columns = [int(anchor) for anchor in anchors]
        return np.array([[known.get((int(n), a), np.nan) for a in columns] for n in nodes])


NO_OFFSETS = Offsets(
    np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0, dtype=np.float64)
)


def joined(one: Offsets, other: Offsets) -> Offsets:
    """The pairs of both."""
    return Offsets(
        np.concatenate([one.node, other.node]),
        np.concatenate([one.anchor, other.anchor]),
        np.concatenate([one.offset_m, other.offset_m]),
    )


@dataclass(frozen=True)
class FloorTruth:
    """Where modules rested on the floor: from ``start_s`` to ``end_s`` [s], ``node`` (F,),
    ``position_m`` (F, 2) horizontal [m]."""

    start_s: FloatArray
    end_s: FloatArray
    node: IntArray
    position_m: FloatArray


def read_ranges(path: str | Path, anchors: Anchors | None = None) -> RangeRecording:
    """Raw ranges from a ``ranges.csv`` or the directory that holds it.

    The first column is ``t_ns`` or, for recordings without time, ``step``. With ``anchors``, a
    range to any other anchor is an error.

    Raises :class:`InputError` with file, line and column.
    """
    path = Path(path)
    file = path / RANGES_FILE if path.is_dir() else path
    timed = header_of(file)[:1] != [_STEP.name]
    t_ns, node, anchor, range_m = read_columns(file, (_STAMP if timed else _STEP, *_RANGE_FIELDS))
    _check_order(file, t_ns, _STAMP.name if timed else _STEP.name)
    if anchors is not None:
        strange = np.flatnonzero(~np.isin(anchor, anchors.ids))
        if len(strange):
            raise InputError(
                f"anchor {anchor[strange[0]]} is unknown",
                file=file,
                line=int(strange[0]) + 2,
                field="anchor",
                hint=f"anchors are {_listed(anchors.ids)}; an anchor whose position is unknown "
                "belongs into the anchors file with empty coordinates",
            )
    name = file.resolve().parent.name if file.name == RANGES_FILE else file.stem
    return RangeRecording(t_ns, node, anchor, range_m, timed, name)


def read_internal_ranges(path: str | Path) -> InternalRanges:
    """Raw ranges among the robot's modules. Raises :class:`InputError` as the others do."""
    path = Path(path)
    file = path / INTERNAL_RANGES_FILE if path.is_dir() else path
    t_ns, node, other, range_m = read_columns(file, _INTERNAL_FIELDS)
    _check_order(file, t_ns, _STAMP.name)
    same = np.flatnonzero(node == other)
    if len(same):
        raise InputError(
            f"module {node[same[0]]} cannot range itself",
            file=file,
            line=int(same[0]) + 2,
            field="other",
        )
    return InternalRanges(t_ns, node, other, range_m)


def read_anchors(path: str | Path) -> Anchors:
    """Anchors from an ``anchors.csv`` or the directory that holds it; empty cells are unknown.

    Raises :class:`InputError` with file, line and column, also for an anchor listed twice.
    """
    path = Path(path)
    file = path / ANCHORS_FILE if path.is_dir() else path
    ids, *coordinates = read_columns(file, _ANCHOR_FIELDS)
    _check_unique(file, [(int(anchor),) for anchor in ids], "anchor")
    return Anchors(ids, np.column_stack(coordinates))


def read_offsets(path: str | Path) -> Offsets:
    """Offsets from an ``offsets.csv`` or the directory that holds it.

    Raises :class:`InputError` with file, line and column, also for a pair listed twice.
    """
    path = Path(path)
    file = path / OFFSETS_FILE if path.is_dir() else path
    node, anchor, offset = read_columns(file, _OFFSET_FIELDS)
    _check_unique(file, list(zip(node.tolist(), anchor.tolist(), strict=True)), "node")
    return Offsets(node, anchor, offset)


def read_floor_truth(path: str | Path) -> FloorTruth:
    """Surveyed floor positions from a ``floor_truth.csv`` or the directory that holds it.

    Raises :class:`InputError` with file, line and column.
    """
    path = Path(path)
    file = path / FLOOR_TRUTH_FILE if path.is_dir() else path
    start, end, node, x, y = read_columns(file, _FLOOR_FIELDS)
    empty = np.flatnonzero(end <= start)
    if len(empty):
        raise InputError(
            "ends before it starts", file=file, line=int(empty[0]) + 2, field="t_end_s"
        )
    return FloorTruth(start, end, node, np.column_stack([x, y]))


def write_ranges(path: str | Path, recording: RangeRecording) -> None:
    """Write a file that :func:`read_ranges` reads. Raises :class:`ValueError` for bad values."""
    write_columns(
        Path(path),
        (_STAMP if recording.timed else _STEP, *_RANGE_FIELDS),
        (recording.t_ns, recording.node, recording.anchor, recording.range_m),
    )


def write_internal_ranges(path: str | Path, ranges: InternalRanges) -> None:
    """Write a file that :func:`read_internal_ranges` reads."""
    write_columns(
        Path(path), _INTERNAL_FIELDS, (ranges.t_ns, ranges.node, ranges.other, ranges.range_m)
    )


def write_anchors(path: str | Path, anchors: Anchors) -> None:
    """Write a file that :func:`read_anchors` reads."""
    write_columns(Path(path), _ANCHOR_FIELDS, (anchors.ids, *anchors.position_m.T))


def write_offsets(path: str | Path, offsets: Offsets) -> None:
    """Write a file that :func:`read_offsets` reads."""
    write_columns(Path(path), _OFFSET_FIELDS, (offsets.node, offsets.anchor, offsets.offset_m))


def write_floor_truth(path: str | Path, truth: FloorTruth) -> None:
    """Write a file that :func:`read_floor_truth` reads."""
    write_columns(
        Path(path), _FLOOR_FIELDS, (truth.start_s, truth.end_s, truth.node, *truth.position_m.T)
    )


def _check_order(file: Path, stamps: IntArray, name: str) -> None:
    backward = np.flatnonzero(np.diff(stamps) < 0)
    if len(backward):
        row = int(backward[0]) + 1
        raise InputError(
            f"{stamps[row]} is earlier than the line before, {stamps[row - 1]}: not sorted",
            file=file,
            line=row + 2,
            field=name,
        )


def _check_unique(file: Path, keys: list[tuple[int, ...]], field: str) -> None:
    seen: set[tuple[int, ...]] = set()
    for line, key in enumerate(keys, start=2):
        if key in seen:
            raise InputError(
                f"{' and '.join(map(str, key))} appears twice", file=file, line=line, field=field
            )
        seen.add(key)


def _listed(ids: IntArray) -> str:
    return ", ".join(str(number) for number in ids)
