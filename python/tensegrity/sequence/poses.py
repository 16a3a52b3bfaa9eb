"""Poses over time in TUM's format: ``t[s] x y z qx qy qz qw``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tensegrity.errors import InputError
from tensegrity.sequence.sequence import PoseStream
from tensegrity.sequence.table import Column, read_tum, write_tum

# Files with three decimals are still read; a sum of four rounding errors of half a unit is below.
_UNIT_TOLERANCE = 2e-3

_COLUMNS = [
    *(Column(axis, "a finite number [m]") for axis in "xyz"),
    *(Column(f"q{axis}", "a finite number") for axis in "xyzw"),
]


def read_poses(file: Path) -> PoseStream:
    """Poses of the body in the world, quaternions normalised.

    Raises :class:`InputError` with file, line and column.
    """
    table = read_tum(file, _COLUMNS)
    quaternion = table.values[:, 3:]
    norm = np.linalg.norm(quaternion, axis=1)
    bad = np.flatnonzero(np.abs(norm - 1) > _UNIT_TOLERANCE)
    if len(bad):
        row = int(bad[0])
        raise InputError(
            f"expected a unit quaternion, got one of length {norm[row]:.6g}",
            file=file,
            line=int(table.lines[row]),
            field="qx qy qz qw",
        )
    return PoseStream(table.t_ns, table.values[:, :3].copy(), quaternion / norm[:, None])


def write_poses(file: Path, poses: PoseStream) -> None:
    """Write what :func:`read_poses` reads.

    Raises :class:`ValueError` for values it would not accept.
    """
    norm = np.linalg.norm(poses.quaternion, axis=1)
    if np.any(np.abs(norm - 1) > _UNIT_TOLERANCE):
        raise ValueError(f"{file.name}: quaternions are not of unit length")
    write_tum(file, _COLUMNS, poses.t_ns, np.hstack([poses.position, poses.quaternion]))
