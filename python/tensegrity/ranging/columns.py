"""Tables of a few typed columns whose rows need not be one per stamp: ranges, anchors, offsets.

:mod:`tensegrity.sequence.table` reads tables with one row per stamp; several modules range at the
same time, and anchors have no time at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tensegrity.errors import InputError, quoted
from tensegrity.files import read_text

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Field:
    """A column: its name, what it holds in words with the unit, and its limits.

    ``integer`` columns are read exactly (stamps need all 64 bits). ``may_be_empty``: an empty cell
    is NaN, and NaN is written as an empty cell.
    """

    name: str
    expected: str
    integer: bool = False
    may_be_empty: bool = False
    least: float = -np.inf
    most: float = np.inf

    def parse(self, text: str) -> float | int | None:
        """The value of a cell, None if it is none that this column takes."""
        if not text:
            return float("nan") if self.may_be_empty else None
        try:
            if "_" in text:  # Python reads 1_000 as a number, nobody else does
                return None
            value = int(text) if self.integer else float(text)
        except ValueError:
            return None
        # NaN is not within limits, and infinity is beyond any.
        good = self.least <= value <= self.most and abs(value) != np.inf
        return value if good else None


INT64_LEAST, INT64_MOST = -(2**63), 2**63 - 1


def header_of(file: Path) -> list[str]:
    """Names in the first line of a CSV file."""
    return [name.strip() for name in read_text(file).split("\n", 1)[0].split(",")]


def read_columns(file: Path, fields: Sequence[Field]) -> list[NDArray[Any]]:
    """The columns of a CSV file with the header of ``fields``, in this order.

    Raises :class:`InputError` with file, line and column; also when there is no row.
    """
    text = read_text(file)
    lines = text.split("\n")
    names = [field.name for field in fields]
    found = [name.strip() for name in lines[0].split(",")]
    if found != names:
        wrong = next((name for name in found if name not in names), None)
        raise InputError(
            "unknown column" if wrong else "columns are missing or out of order",
            file=file,
            line=1,
            field=wrong,
            hint=f"expected header: {','.join(names)}",
        )
    if not text.endswith("\n"):
        raise InputError(
            "the last line has no line end",
            file=file,
            line=len(lines),
            hint="the file was cut off; if this line is complete, add a line end",
        )
    rows = [_row(file, number, line, fields) for number, line in enumerate(lines[1:-1], start=2)]
    if not rows:
        raise InputError("holds no rows", file=file, hint="was the recording interrupted?")
    return [
        np.array(column, dtype=np.int64 if field.integer else np.float64)
        for field, column in zip(fields, zip(*rows, strict=True), strict=True)
    ]


def write_columns(file: Path, fields: Sequence[Field], columns: Sequence[NDArray[Any]]) -> None:
    """Write what :func:`read_columns` reads, numbers with nine digits.

    Raises :class:`ValueError` for values that :func:`read_columns` would not accept.
    """
    rows = [",".join(field.name for field in fields)]
    for number, values in enumerate(zip(*(c.tolist() for c in columns), strict=True)):
        cells = [
            str(value) if field.integer else "" if np.isnan(value) else f"{value:.9g}"
            for field, value in zip(fields, values, strict=True)
        ]
        for field, cell in zip(fields, cells, strict=True):
            if field.parse(cell) is None:
                raise ValueError(
                    f"{file.name}: row {number}, column '{field.name}': "
                    f"expected {field.expected}, got {quoted(cell)}"
                )
        rows.append(",".join(cells))
    if len(rows) == 1:
        raise ValueError(f"{file.name}: no rows")
    file.write_text("\n".join(rows) + "\n", encoding="utf-8", newline="\n")


def _row(file: Path, number: int, line: str, fields: Sequence[Field]) -> list[float | int]:
    cells = line.split(",")
    if len(cells) != len(fields):
        raise InputError(f"{len(cells)} columns, expected {len(fields)}", file=file, line=number)
    values = []
    for field, cell in zip(fields, cells, strict=True):
        value = field.parse(cell.strip())
        if value is None:
            raise InputError(
                f"expected {field.expected}, got {quoted(cell.strip())}",
                file=file,
                line=number,
                field=field.name,
            )
        values.append(value)
    return values
