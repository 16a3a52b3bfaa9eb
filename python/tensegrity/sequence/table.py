"""Tables of numbers over time, as CSV with a header or in TUM's format.

Reading is fast for files that are right (one vectorised pass) and exact about those that are not
(a second, slow pass finds the line and the column).
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tensegrity.errors import InputError, did_you_mean, quoted
from tensegrity.files import read_text

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
Values = FloatArray | BoolArray

_INT64 = np.iinfo(np.int64)
_EMPTY_CELL = re.compile(r",\s*(?:,|$)")


@dataclass(frozen=True)
class Column:
    """A column after the stamp: its name, what it holds (in words, with the unit), and a
    vectorised test of its values, which are finite before the test sees them.

    ``may_be_empty``: an empty cell of a CSV file is no error but NaN, and NaN is written as an
    empty cell. The text ``nan`` is an error everywhere."""

    name: str
    expected: str
    accepts: Callable[[FloatArray], BoolArray] | None = None
    may_be_empty: bool = False


@dataclass(frozen=True)
class Table:
    """Content of a file: ``t_ns`` (N,) stamps [ns], ``values`` (N, columns), and the line of each
    row in the file, from 1."""

    file: Path
    t_ns: IntArray
    values: FloatArray
    lines: IntArray


@dataclass(frozen=True)
class _Dialect:
    separator: str | None  # None: any white space
    comment: str | None  # start of lines that are skipped
    has_header: bool
    stamp_name: str
    stamp_expected: str
    parse_stamp: Callable[[str], int]  # to ns; ValueError if it is none
    format_stamp: Callable[[int], str]


def _nanoseconds(text: str) -> int:
    if "_" in text:  # Python reads 1_000 as a number, nobody else does
        raise ValueError(text)
    return int(text)


def _seconds(text: str) -> int:
    # Decimal, because a double holds the seconds since 1970 to only 0.2 us.
    try:
        nanoseconds = Decimal(text.replace("_", "?")).scaleb(9)
        if abs(nanoseconds) > _INT64.max:
            raise ValueError(text)
    except ArithmeticError as error:
        raise ValueError(text) from error
    return int(nanoseconds.to_integral_value())


_CSV = _Dialect(",", None, True, "t_ns", "a whole number [ns]", _nanoseconds, str)
_TUM = _Dialect(
    None, "#", False, "t", "a number [s]", _seconds, lambda t: f"{Decimal(t).scaleb(-9):.9f}"
)


def read_csv(file: Path, columns: Sequence[Column]) -> Table:
    """A CSV file with the header ``t_ns`` and the names of ``columns``, in this order.

    Raises :class:`InputError` with file, line and column.
    """
    return _read(file, columns, _CSV)


def read_tum(file: Path, columns: Sequence[Column]) -> Table:
    """A file in TUM's format: seconds and the ``columns``, separated by spaces, no header.

    Raises :class:`InputError` with file, line and column.
    """
    return _read(file, columns, _TUM)


def csv_header(file: Path) -> list[str]:
    """Names in the header of a CSV file."""
    return _header(read_text(file))


def write_csv(file: Path, columns: Sequence[Column], t_ns: IntArray, values: Values) -> None:
    """Write what :func:`read_csv` reads, values with nine digits.

    Raises :class:`ValueError` for values that :func:`read_csv` would not accept.
    """
    _write(file, columns, t_ns, values, _CSV)


def write_tum(file: Path, columns: Sequence[Column], t_ns: IntArray, values: Values) -> None:
    """Write what :func:`read_tum` reads, values with nine digits.

    Raises :class:`ValueError` for values that :func:`read_tum` would not accept.
    """
    _write(file, columns, t_ns, values, _TUM)


def _read(file: Path, columns: Sequence[Column], dialect: _Dialect) -> Table:
    text = read_text(file)
    if not text.strip():
        raise InputError("is empty", file=file, hint="was the recording interrupted?")
    first = 1
    if dialect.has_header:
        _check_header(file, _header(text), [dialect.stamp_name, *(c.name for c in columns)])
        first = 2
    if not text.endswith("\n"):
        raise InputError(
            "the last line has no line end",
            file=file,
            line=text.count("\n") + 1,
            hint="the file was cut off; if this line is complete, add a line end",
        )
    lines = np.arange(first, text.count("\n") + 1)
    text, empty_cells = _fill_empty_cells(text, first, columns)
    row_type = [("stamp", "U40"), ("values", np.float64, (len(columns),))]
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "loadtxt: input contained no data")
            rows = np.loadtxt(
                io.StringIO(text),
                dtype=row_type,
                delimiter=dialect.separator,
                comments=dialect.comment,
                skiprows=first - 1,
                ndmin=1,
            )
        stamps = [dialect.parse_stamp(stamp) for stamp in rows["stamp"].tolist()]
        t_ns = np.array(stamps, dtype=np.int64)
    except (ValueError, OverflowError):
        raise _unreadable(file, text, _row_lines(text, first, dialect), columns, dialect) from None
    if not len(rows):
        raise InputError("holds no samples", file=file, hint="was the recording interrupted?")
    if len(rows) < len(lines):
        lines = _row_lines(text, first, dialect)
    table = Table(file, t_ns, rows["values"], lines)
    missing = np.zeros(table.values.shape, dtype=np.bool_)
    for line, column in empty_cells:
        missing[np.searchsorted(lines, line), column] = True
    problem = _first_problem(table.t_ns, table.values, missing, columns, dialect)
    if problem is not None:
        row, name, what = problem
        raise InputError(what, file=file, line=int(lines[row]), field=name)
    if missing.all():
        raise InputError(
            f"every cell but those of '{dialect.stamp_name}' is empty",
            file=file,
            hint=f"expected {columns[0].expected} in at least one of them",
        )
    return table


def _fill_empty_cells(
    text: str, first: int, columns: Sequence[Column]
) -> tuple[str, list[tuple[int, int]]]:
    """``text`` with NaN in the empty cells that are allowed, and their lines and columns.

    Columns are counted as in ``columns``, lines from 1 with ``first`` the first below the header.
    """
    allowed = [index for index, column in enumerate(columns) if column.may_be_empty]
    filled: list[tuple[int, int]] = []
    if not allowed:
        return text, filled
    content = text.split("\n")
    for number, line in enumerate(content[first - 1 :], start=first):
        if _EMPTY_CELL.search(line) is None:
            continue
        stamp, *cells = line.split(",")
        for index in allowed:
            if index < len(cells) and not cells[index].strip():
                cells[index] = "nan"
                filled.append((number, index))
        content[number - 1] = ",".join([stamp, *cells])
    return "\n".join(content), filled


def _row_lines(text: str, first: int, dialect: _Dialect) -> IntArray:
    """Lines that NumPy takes for a row: neither empty nor nothing but a comment."""
    content = text.split("\n")[first - 1 :]
    return np.array(
        [n for n, line in enumerate(content, start=first) if _without_comment(line, dialect)],
        dtype=np.int64,
    )


def _without_comment(line: str, dialect: _Dialect) -> str:
    if dialect.comment is not None:
        line = line.split(dialect.comment, 1)[0]
    return line.strip() if dialect.separator is None else line.rstrip("\r")


def _header(text: str) -> list[str]:
    return [name.strip() for name in text.split("\n", 1)[0].split(",")]


def _check_header(file: Path, names: list[str], expected: list[str]) -> None:
    def error(problem: str, field: str, hint: str | None = None) -> InputError:
        return InputError(problem, file=file, line=1, field=field, hint=hint)

    header = f"expected header: {','.join(expected)}"
    for position, name in enumerate(names):
        if name in names[:position]:
            raise error("column appears twice", name, header)
    for name in names:
        if name not in expected:
            missing = [e for e in expected if e not in names]
            hint = did_you_mean(name, missing) if missing else header
            raise error("unknown column", name, hint)
    for name in expected:
        if name not in names:
            raise error("column is missing", name, header)
    for name, wanted in zip(names, expected, strict=True):
        if name != wanted:
            raise error(f"column is out of order, '{wanted}' belongs here", name, header)


def _first_problem(
    t_ns: IntArray,
    values: FloatArray,
    missing: BoolArray,
    columns: Sequence[Column],
    dialect: _Dialect,
) -> tuple[int, str, str] | None:
    """Row, column and problem of the first value that is not what it should be; ``missing`` has
    the shape of ``values`` and is true where there need not be any."""
    problems: list[tuple[int, str, str]] = []
    backward = np.flatnonzero(np.diff(t_ns) <= 0)
    if len(backward):
        row = int(backward[0]) + 1
        before, now = (dialect.format_stamp(int(t)) for t in t_ns[row - 1 : row + 1])
        what = "repeats the stamp" if before == now else "is earlier than the stamp"
        problems.append(
            (row, dialect.stamp_name, f"{now} {what} of the line before, {before}: not sorted")
        )
    finite = np.isfinite(values)
    for index, column in enumerate(columns):
        good = finite[:, index]
        if column.accepts is not None:
            good = good & column.accepts(np.where(good, values[:, index], 0.0))
        bad = np.flatnonzero(~good & ~missing[:, index])
        if len(bad):
            row = int(bad[0])
            value = f"{values[row, index]:.9g}"
            problems.append((row, column.name, f"expected {column.expected}, got {value}"))
    return min(problems, key=lambda problem: problem[0], default=None)


def _unreadable(
    file: Path, text: str, lines: IntArray, columns: Sequence[Column], dialect: _Dialect
) -> InputError:
    """The error for the first line that is not a stamp and one number per column."""
    content = text.split("\n")
    width = len(columns) + 1
    for number in lines.tolist():
        cells = _without_comment(content[number - 1], dialect).split(dialect.separator)

        def error(problem: str, field: str | None, line: int = number) -> InputError:
            return InputError(problem, file=file, line=line, field=field)

        if len(cells) != width:
            return error(f"{len(cells)} columns, expected {width}", None)
        try:
            stamp = dialect.parse_stamp(cells[0])
        except ValueError:
            stamp = None
        if stamp is None or not _INT64.min <= stamp <= _INT64.max:
            return error(
                f"expected {dialect.stamp_expected}, got {quoted(cells[0].strip())}",
                dialect.stamp_name,
            )
        for cell, column in zip(cells[1:], columns, strict=True):
            if not _is_number(cell):
                return error(f"expected {column.expected}, got {quoted(cell.strip())}", column.name)
    return InputError("is not a table of numbers", file=file)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text


def _write(
    file: Path, columns: Sequence[Column], t_ns: IntArray, values: Values, dialect: _Dialect
) -> None:
    numbers = np.asarray(values, dtype=np.float64)
    if numbers.shape != (len(t_ns), len(columns)):
        raise ValueError(
            f"{file.name}: {len(t_ns)} stamps and {len(columns)} columns, "
            f"but values of shape {numbers.shape}"
        )
    if not len(t_ns):
        raise ValueError(f"{file.name}: no samples")
    missing = np.isnan(numbers) & [column.may_be_empty for column in columns]
    problem = _first_problem(t_ns, numbers, missing, columns, dialect)
    if problem is not None:
        row, name, what = problem
        raise ValueError(f"{file.name}: row {row}, column '{name}': {what}")
    if missing.all():
        raise ValueError(f"{file.name}: all values are missing")
    separator = dialect.separator or " "
    names = [dialect.stamp_name, *(column.name for column in columns)]
    header = separator.join(names) + "\n" if dialect.has_header else ""
    row_format = separator.join(["%s"] + ["%.9g"] * len(columns)) + "\n"
    body = "".join(
        row_format % (dialect.format_stamp(stamp), *row)
        for stamp, row in zip(t_ns.tolist(), numbers.tolist(), strict=True)
    )
    if missing.any():
        body = body.replace("nan", "")  # every other NaN was refused above
    file.write_text(header + body, encoding="utf-8", newline="\n")
