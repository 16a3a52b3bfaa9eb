"""Ways to break input files, and what the error has to say: used by the tests of the readers and
of the command line."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

Edit = Callable[[Path], None]


@dataclass(frozen=True)
class MalformedSequence:
    """A broken sequence directory.

    ``apply`` breaks a valid one in place. The error has to name ``file`` (relative to the
    directory, empty for the directory itself), ``line`` and ``field`` (where there are any), and
    its text has to contain ``says``.
    """

    name: str
    file: str
    apply: Edit
    says: str
    line: int | None = None
    field: str | None = None


@dataclass(frozen=True)
class MalformedYaml:
    """A broken YAML file; the meaning of the fields is as above."""

    name: str
    text: str
    says: str
    line: int | None = None
    field: str | None = None


def _lines(path: Path) -> list[str]:
    return path.read_text().splitlines(keepends=True)


def _in_file(file: str, change: Callable[[Path], object]) -> Edit:
    return lambda folder: (change(folder / file), None)[1]


def set_text(file: str, text: str) -> Edit:
    """Replace the whole content."""
    return _in_file(file, lambda path: path.write_text(text))


def set_bytes(file: str, content: bytes) -> Edit:
    """Replace the whole content by bytes."""
    return _in_file(file, lambda path: path.write_bytes(content))


def set_line(file: str, number: int, change: Callable[[str], str]) -> Edit:
    """Change one line (from 1, without its line end)."""

    def edit(path: Path) -> None:
        lines = _lines(path)
        lines[number - 1] = change(lines[number - 1].rstrip("\n")) + "\n"
        path.write_text("".join(lines))

    return _in_file(file, edit)


def set_cell(file: str, number: int, column: int, text: str, separator: str = ",") -> Edit:
    """Change one cell of one line."""

    def change(line: str) -> str:
        cells = line.split(separator)
        cells[column] = text
        return separator.join(cells)

    return set_line(file, number, change)


def swap_columns(file: str, first: int, second: int) -> Edit:
    """Exchange two columns in all lines."""

    def edit(path: Path) -> None:
        rows = [line.rstrip("\n").split(",") for line in _lines(path)]
        for row in rows:
            row[first], row[second] = row[second], row[first]
        path.write_text("".join(",".join(row) + "\n" for row in rows))

    return _in_file(file, edit)


def drop_column(file: str, column: int) -> Edit:
    """Remove one column from all lines."""

    def edit(path: Path) -> None:
        rows = [line.rstrip("\n").split(",") for line in _lines(path)]
        path.write_text("".join(",".join(r[:column] + r[column + 1 :]) + "\n" for r in rows))

    return _in_file(file, edit)


def empty_columns(file: str, first: int) -> Edit:
    """Empty all cells from column ``first`` on, in all lines but the header."""

    def edit(path: Path) -> None:
        header, *rows = _lines(path)
        cells = (row.rstrip("\n").split(",") for row in rows)
        emptied = (",".join(c[:first] + [""] * (len(c) - first)) + "\n" for c in cells)
        path.write_text(header + "".join(emptied))

    return _in_file(file, edit)


def keep_lines(file: str, count: int) -> Edit:
    """Keep the first lines only."""
    return _in_file(file, lambda path: path.write_text("".join(_lines(path)[:count])))


def cut_end(file: str, characters: int) -> Edit:
    """Remove the last characters, as an interrupted copy does."""
    return _in_file(file, lambda path: path.write_text(path.read_text()[:-characters]))


def remove(file: str) -> Edit:
    """Delete the file."""
    return _in_file(file, lambda path: path.unlink())


def shift_stamps(file: str, by_ns: int) -> Edit:
    """Add to all stamps of a CSV file."""

    def edit(path: Path) -> None:
        header, *rows = _lines(path)
        split = (row.split(",", 1) for row in rows)
        path.write_text(header + "".join(f"{int(t) + by_ns},{rest}" for t, rest in split))

    return _in_file(file, edit)


def _rename_column(old: str, new: str) -> Callable[[str], str]:
    return lambda header: ",".join(new if name == old else name for name in header.split(","))


def _to_file(folder: Path) -> None:
    shutil.rmtree(folder)
    folder.write_text("not a sequence\n")


def _to_directory(file: str) -> Edit:
    def edit(path: Path) -> None:
        path.unlink()
        path.mkdir()

    return _in_file(file, edit)


MALFORMED_SEQUENCES = [
    # the directory
    MalformedSequence("no directory", "", shutil.rmtree, "no such sequence"),
    MalformedSequence("path is a file", "", _to_file, "not a sequence"),
    MalformedSequence("no imu.csv", "imu.csv", remove("imu.csv"), "no such file"),
    MalformedSequence("no cables.csv", "cables.csv", remove("cables.csv"), "no such file"),
    MalformedSequence("file is a directory", "imu.csv", _to_directory("imu.csv"), "is a directory"),
    # whole files
    MalformedSequence("empty file", "imu.csv", set_text("imu.csv", ""), "is empty"),
    MalformedSequence("blank file", "imu.csv", set_text("imu.csv", "\n \n"), "is empty"),
    MalformedSequence("only a header", "cables.csv", keep_lines("cables.csv", 1), "no samples"),
    MalformedSequence(
        "binary junk", "imu.csv", set_bytes("imu.csv", b"\x89PNG\r\n\x1a\n\x00"), "not UTF-8", 1
    ),
    MalformedSequence(
        "latin-1 text", "imu.csv", set_bytes("imu.csv", b"t_ns\n\n\xe9\n"), "not UTF-8", 3
    ),
    MalformedSequence(
        "NUL characters", "imu.csv", set_bytes("imu.csv", b"t_ns\n" + bytes(9)), "NUL", 2
    ),
    MalformedSequence("no line end", "imu.csv", cut_end("imu.csv", 1), "cut off", line=202),
    MalformedSequence(
        "cut in the last line", "cables.csv", cut_end("cables.csv", 20), "cut off", line=102
    ),
    MalformedSequence(
        "only comments", "groundtruth.tum", set_text("groundtruth.tum", "# t x\n"), "no samples"
    ),
    MalformedSequence(
        "no cable ever measured",
        "cables.csv",
        empty_columns("cables.csv", 1),
        "but those of 't_ns'",
    ),
    # headers
    MalformedSequence(
        "misspelt column",
        "imu.csv",
        set_line("imu.csv", 1, _rename_column("gyro_y", "gyr_y")),
        "did you mean 'gyro_y'",
        line=1,
        field="gyr_y",
    ),
    MalformedSequence(
        "missing column",
        "imu.csv",
        drop_column("imu.csv", 4),
        "missing",
        line=1,
        field="accel_x",
    ),
    MalformedSequence(
        "duplicate column",
        "imu.csv",
        set_line("imu.csv", 1, _rename_column("accel_y", "accel_x")),
        "twice",
        line=1,
        field="accel_x",
    ),
    MalformedSequence(
        "additional column",
        "contacts.csv",
        set_line("contacts.csv", 1, lambda header: header + ",c_6"),
        "unknown column",
        line=1,
        field="c_6",
    ),
    MalformedSequence(
        "header missing", "imu.csv", set_line("imu.csv", 1, lambda _: "0,1,2,3,4,5,6"), "t_ns", 1
    ),
    MalformedSequence(
        "columns swapped",
        "imu.csv",
        swap_columns("imu.csv", 1, 2),
        "out of order",
        line=1,
        field="gyro_y",
    ),
    MalformedSequence(
        "eight cables",
        "cables.csv",
        drop_column("cables.csv", 9),
        "missing",
        line=1,
        field="l_2_5",
    ),
    MalformedSequence(
        "wrong order of cables",
        "cables.csv",
        swap_columns("cables.csv", 1, 2),
        "out of order",
        line=1,
        field="l_0_2",
    ),
    MalformedSequence(
        "five endcaps",
        "endcaps.csv",
        drop_column("endcaps.csv", 18),
        "missing",
        line=1,
        field="q_5_z",
    ),
    # rows
    MalformedSequence(
        "short row",
        "imu.csv",
        set_line("imu.csv", 7, lambda line: line.rsplit(",", 1)[0]),
        "6 columns, expected 7",
        line=7,
    ),
    MalformedSequence(
        "long row",
        "imu.csv",
        set_line("imu.csv", 7, lambda line: line + ",0"),
        "8 columns, expected 7",
        line=7,
    ),
    MalformedSequence(
        "row of spaces", "imu.csv", set_line("imu.csv", 7, lambda _: "   "), "1 columns", line=7
    ),
    MalformedSequence(
        "semicolons",
        "imu.csv",
        set_line("imu.csv", 9, lambda line: line.replace(",", ";")),
        "1 columns, expected 7",
        line=9,
    ),
    MalformedSequence(
        "short row of poses",
        "groundtruth.tum",
        set_line("groundtruth.tum", 5, lambda line: line.rsplit(" ", 1)[0]),
        "7 columns, expected 8",
        line=5,
    ),
    # numbers
    MalformedSequence(
        "text in a number",
        "imu.csv",
        set_cell("imu.csv", 4, 3, "fast"),
        "[rad/s], got 'fast'",
        line=4,
        field="gyro_z",
    ),
    MalformedSequence(
        "empty cell",
        "imu.csv",
        set_cell("imu.csv", 4, 6, ""),
        "[m/s^2], got ''",
        line=4,
        field="accel_z",
    ),
    MalformedSequence(
        "empty stamp",
        "cables.csv",
        set_cell("cables.csv", 4, 0, ""),
        "a whole number [ns], got ''",
        line=4,
        field="t_ns",
    ),
    MalformedSequence(
        "empty contact flag",
        "contacts.csv",
        set_cell("contacts.csv", 4, 6, ""),
        "0 or 1, got ''",
        line=4,
        field="c_5",
    ),
    MalformedSequence(
        "empty cell in another IMU",
        "imu_r23.csv",
        set_text(
            "imu_r23.csv", "t_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n0,0,,0,0,0,0\n"
        ),
        "[rad/s], got ''",
        line=2,
        field="gyro_y",
    ),
    MalformedSequence(
        "empty coordinate of an endcap",
        "endcaps.csv",
        set_cell("endcaps.csv", 4, 1, ""),
        "[m], got ''",
        line=4,
        field="q_0_x",
    ),
    MalformedSequence(
        "short row of empty cells",
        "cables.csv",
        set_line("cables.csv", 5, lambda line: line.split(",")[0] + 8 * ","),
        "9 columns, expected 10",
        line=5,
    ),
    MalformedSequence(
        "one empty cell too many",
        "cables.csv",
        set_line("cables.csv", 5, lambda line: line + ","),
        "11 columns, expected 10",
        line=5,
    ),
    MalformedSequence(
        "NaN for a cable without measurement",
        "cables.csv",
        set_cell("cables.csv", 5, 3, "nan"),
        "an empty cell or a length between 0 and 2.9 m (two rod lengths) [m], got nan",
        line=5,
        field="l_2_4",
    ),
    MalformedSequence(
        "text for a cable without measurement",
        "cables.csv",
        set_line("cables.csv", 5, lambda line: line.split(",")[0] + ",,lost" + 7 * ","),
        "an empty cell or a length between 0 and 2.9 m (two rod lengths) [m], got 'lost'",
        line=5,
        field="l_0_2",
    ),
    MalformedSequence(
        "infinite length",
        "cables.csv",
        set_cell("cables.csv", 5, 3, "inf"),
        "(two rod lengths) [m], got inf",
        line=5,
        field="l_2_4",
    ),
    MalformedSequence(
        "decimal comma",
        "cables.csv",
        set_line("cables.csv", 2, lambda line: line.replace(".", ",")),
        "columns, expected 10",
        line=2,
    ),
    MalformedSequence(
        "NaN", "imu.csv", set_cell("imu.csv", 3, 1, "nan"), "got nan", line=3, field="gyro_x"
    ),
    MalformedSequence(
        "infinity", "imu.csv", set_cell("imu.csv", 3, 4, "-inf"), "got -inf", 3, "accel_x"
    ),
    MalformedSequence(
        "number too large", "imu.csv", set_cell("imu.csv", 3, 4, "1e999"), "got inf", 3, "accel_x"
    ),
    MalformedSequence(
        "underscore", "imu.csv", set_cell("imu.csv", 3, 4, "1_0"), "got '1_0'", 3, "accel_x"
    ),
    # stamps
    MalformedSequence(
        "fractional nanoseconds",
        "imu.csv",
        set_cell("imu.csv", 5, 0, "15000000.5"),
        "whole number [ns]",
        line=5,
        field="t_ns",
    ),
    MalformedSequence(
        "stamp in seconds with exponent",
        "imu.csv",
        set_cell("imu.csv", 5, 0, "1.5e7"),
        "whole number [ns]",
        line=5,
        field="t_ns",
    ),
    MalformedSequence(
        "stamp too large",
        "imu.csv",
        set_cell("imu.csv", 202, 0, "9" * 20),
        "whole number [ns]",
        line=202,
        field="t_ns",
    ),
    MalformedSequence(
        "stamps not sorted",
        "imu.csv",
        set_cell("imu.csv", 6, 0, "1"),
        "earlier than",
        line=6,
        field="t_ns",
    ),
    MalformedSequence(
        "stamp repeated",
        "cables.csv",
        set_cell("cables.csv", 4, 0, "10000000"),
        "repeats",
        line=4,
        field="t_ns",
    ),
    MalformedSequence(
        "stamps of poses not sorted",
        "groundtruth.tum",
        set_cell("groundtruth.tum", 3, 0, "0.001", " "),
        "earlier than",
        line=3,
        field="t",
    ),
    MalformedSequence(
        "stamp of a pose is text",
        "groundtruth.tum",
        set_cell("groundtruth.tum", 3, 0, "noon", " "),
        "[s], got 'noon'",
        line=3,
        field="t",
    ),
    MalformedSequence(
        "stamp of a pose is infinite",
        "groundtruth.tum",
        set_cell("groundtruth.tum", 3, 0, "inf", " "),
        "[s], got 'inf'",
        line=3,
        field="t",
    ),
    MalformedSequence(
        "stamp of a pose is not a number",
        "groundtruth.tum",
        set_cell("groundtruth.tum", 3, 0, "nan", " "),
        "[s], got 'nan'",
        line=3,
        field="t",
    ),
    MalformedSequence(
        "stamp of a pose is too large",
        "groundtruth.tum",
        set_cell("groundtruth.tum", 3, 0, "1E1000000000", " "),
        "[s], got '1E1000000000'",
        line=3,
        field="t",
    ),
    MalformedSequence(
        "another clock",
        "cables.csv",
        shift_stamps("cables.csv", 1_700_000_000_000_000_000),
        "no common time",
    ),
    MalformedSequence(
        "contacts before the start",
        "contacts.csv",
        shift_stamps("contacts.csv", -2_000_000_000),
        "no common time",
    ),
    # quantities
    MalformedSequence(
        "negative length",
        "cables.csv",
        set_cell("cables.csv", 8, 2, "-0.98"),
        "got -0.98",
        line=8,
        field="l_0_2",
    ),
    MalformedSequence(
        "zero length", "cables.csv", set_cell("cables.csv", 8, 9, "0"), "[m], got 0", 8, "l_2_5"
    ),
    MalformedSequence(
        "length in millimetres",
        "cables.csv",
        set_cell("cables.csv", 2, 1, "980"),
        "between 0 and 2.9 m",
        line=2,
        field="l_0_4",
    ),
    MalformedSequence(
        "contact flag 2", "contacts.csv", set_cell("contacts.csv", 3, 2, "2"), "0 or 1", 3, "c_1"
    ),
    MalformedSequence(
        "contact flag true",
        "contacts.csv",
        set_cell("contacts.csv", 3, 6, "true"),
        "0 or 1, got 'true'",
        line=3,
        field="c_5",
    ),
    MalformedSequence(
        "quaternion not of unit length",
        "groundtruth.tum",
        set_cell("groundtruth.tum", 9, 7, "2", " "),
        "unit quaternion",
        line=9,
        field="qx qy qz qw",
    ),
    # another IMU
    MalformedSequence(
        "broken second IMU",
        "imu_r23.csv",
        set_text("imu_r23.csv", "t_ns,gyro_x\n0,1\n"),
        "missing",
        1,
    ),
    # the robot
    MalformedSequence(
        "unknown robot",
        "robot.yaml",
        set_text("robot.yaml", "# ours\nbase: prism4\n"),
        "did you mean 'prism3'",
        line=2,
        field="base",
    ),
    MalformedSequence(
        "unknown robot by name", "robot.yaml", set_text("robot.yaml", "superb\n"), "'superb'"
    ),
    MalformedSequence(
        "unreadable YAML",
        "robot.yaml",
        set_text("robot.yaml", "a: 1\nb: [1\n"),
        "not valid YAML",
        3,
    ),
    MalformedSequence(
        "unknown key",
        "robot.yaml",
        set_text("robot.yaml", "imu_offset: 0.02\nrod_lenght: 1.45\n"),
        "did you mean 'rod_length'",
        line=2,
        field="rod_lenght",
    ),
    MalformedSequence(
        "negative rod",
        "robot.yaml",
        set_text("robot.yaml", "\nrod_length: -1.45\n"),
        "a number > 0 [m], got -1.45",
        line=2,
        field="rod_length",
    ),
]


MALFORMED_CONFIGS = [
    MalformedYaml(
        "unknown key",
        "noises:\n  gyroscope_std: 0.002\n  cable_sdt: 0.002\n",
        "did you mean 'cable_std'",
        line=3,
        field="noises.cable_sdt",
    ),
    MalformedYaml("unknown section", "noise:\n  cable_std: 1\n", "'noises'", 1, "noise"),
    MalformedYaml(
        "negative noise",
        "noises:\n  cable_std: -1\n",
        "a number > 0 [m], got -1",
        line=2,
        field="noises.cable_std",
    ),
    MalformedYaml(
        "text for a number",
        "noises:\n  cable_std: small\n",
        "[m], got 'small'",
        line=2,
        field="noises.cable_std",
    ),
    MalformedYaml(
        "number in quotes",
        "settings:\n  gravity: '9.81'\n",
        "[m/s^2], got '9.81'",
        line=2,
        field="settings.gravity",
    ),
    MalformedYaml(
        "NaN", "settings:\n  gravity: .nan\n", "got nan", line=2, field="settings.gravity"
    ),
    MalformedYaml(
        "true for a number", "settings:\n  gravity: true\n", "got true", 2, "settings.gravity"
    ),
    MalformedYaml(
        "no value", "settings:\n  gravity:\n", "got nothing", line=2, field="settings.gravity"
    ),
    MalformedYaml(
        "out of range",
        "settings:\n  chi_square_gate: 1.0\n",
        ">= 0 and < 1",
        line=2,
        field="settings.chi_square_gate",
    ),
    MalformedYaml(
        "fraction of a sample",
        "settings:\n  init_bias_size: 0.5\n",
        "a whole number >= 1 [samples]",
        line=2,
        field="settings.init_bias_size",
    ),
    MalformedYaml(
        "unknown choice",
        "settings:\n\n  spin: free\n",
        "one of fixed, estimated, got 'free'",
        line=3,
        field="settings.spin",
    ),
    MalformedYaml(
        "unknown terrain",
        "settings:\n  terrain: hilly\n",
        "one of flat, slope, unknown, got 'hilly'",
        line=2,
        field="settings.terrain",
    ),
    MalformedYaml(
        "unknown filter",
        "settings:\n  filter: coupled\n",
        "one of loose, tight, got 'coupled'",
        line=2,
        field="settings.filter",
    ),
    MalformedYaml(
        "contact sensors that say nothing",
        "settings:\n  contact_error: 0.5\n",
        "> 0 and < 0.5, got 0.5",
        line=2,
        field="settings.contact_error",
    ),
    MalformedYaml(
        "contact sensors that are never wrong",
        "settings:\n  contact_error: 0\n",
        "> 0 and < 0.5, got 0",
        line=2,
        field="settings.contact_error",
    ),
    MalformedYaml(
        "ground without friction",
        "settings:\n  friction: 0\n",
        "a number > 0, got 0",
        line=2,
        field="settings.friction",
    ),
    MalformedYaml(
        "negative cable offset",
        "priors:\n  cable_offset_std: -0.005\n",
        ">= 0 [m], got -0.005",
        line=2,
        field="priors.cable_offset_std",
    ),
    MalformedYaml(
        "foot without noise",
        "noises:\n  foot_height_std: 0\n",
        "a number > 0 [m*sqrt(s)], got 0",
        line=2,
        field="noises.foot_height_std",
    ),
    MalformedYaml(
        "yes for true",
        "settings:\n  static_bias_initialization: yes\n",
        "true or false",
        line=2,
        field="settings.static_bias_initialization",
    ),
    MalformedYaml(
        "vector too short",
        "priors:\n  gyroscope_bias: [0, 0]\n",
        "[rad/s]",
        line=2,
        field="priors.gyroscope_bias[2]",
    ),
    MalformedYaml(
        "section is a number", "priors: 3\n", "a mapping of keys", line=1, field="priors"
    ),
    MalformedYaml("list", "- 1\n- 2\n", "a list of 2", line=1),
    MalformedYaml("unknown base", "base: papr\n", "did you mean 'paper'", line=1, field="base"),
    MalformedYaml("unknown profile by name", "papr\n", "did you mean 'paper'"),
    MalformedYaml("key twice", "base: full\nbase: paper\n", "duplicate key", line=2),
    MalformedYaml("tab", "noises:\n\tcable_std: 1\n", "not valid YAML", line=2),
    MalformedYaml("control character", "noises:\n  \x07\n", "not valid YAML", line=2),
    MalformedYaml("nested too deeply", "{a: " * 1000 + "}" * 1000, "nested too deeply"),
    MalformedYaml(
        "section inside itself",
        "noises: &n\n  spin_std: *n\n",
        "got nothing",
        line=2,
        field="noises.spin_std",
    ),
]
