"""Recordings survive writing and reading, whole or not at all."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from helpers.sequences import make_sequence
from tensegrity import robots
from tensegrity.errors import InputError
from tensegrity.sequence import (
    CableStream,
    ContactStream,
    EndcapStream,
    ImuStream,
    PoseStream,
    Sequence,
    read,
    write,
)

DIGITS = 1e-8  # nine significant digits are printed


def assert_same(actual: Sequence, expected: Sequence) -> None:
    assert actual.robot == expected.robot
    assert actual.other_imus.keys() == expected.other_imus.keys()
    pairs = [(actual.other_imus[name], expected.other_imus[name]) for name in expected.other_imus]
    for name in ("imu", "cables", "contacts", "groundtruth", "endcaps"):
        pairs.append((getattr(actual, name), getattr(expected, name)))
    for mine, theirs in pairs:
        assert type(mine) is type(theirs)
        for field in () if theirs is None else fields(theirs):
            array, wanted = getattr(mine, field.name), getattr(theirs, field.name)
            assert array.dtype == wanted.dtype
            if array.dtype == np.float64:
                np.testing.assert_allclose(array, wanted, rtol=DIGITS, atol=1e-300)
            else:
                np.testing.assert_array_equal(array, wanted)


def test_a_sequence_reads_back(tmp_path: Path) -> None:
    sequence = make_sequence(yaw_rate=0.3)
    sequence = replace(sequence, other_imus={"r23": sequence.imu, "r45": sequence.imu})
    write(sequence, tmp_path / "turning")
    again = read(tmp_path / "turning")
    assert_same(again, sequence)
    assert again.name == "turning"
    assert again.duration_s == pytest.approx(1.0)


def test_what_is_optional_may_be_missing(tmp_path: Path) -> None:
    sequence = replace(make_sequence(), contacts=None, groundtruth=None, endcaps=None)
    write(sequence, tmp_path / "bare")
    (tmp_path / "bare" / "robot.yaml").unlink()
    again = read(tmp_path / "bare")
    assert_same(again, sequence)
    assert again.robot == robots.load("prism3")


def test_an_empty_cell_is_a_cable_without_measurement(sequence_path: Path, tmp_path: Path) -> None:
    file = sequence_path / "cables.csv"
    before = read(sequence_path).cables.lengths
    header, *rows = (line.split(",") for line in file.read_text().splitlines())
    rows[0][1] = rows[3][5] = ""
    rows[3][9] = " "
    rows[7][1:] = [""] * 9
    lines = [",".join(row) for row in (header, *rows)]
    lines.insert(3, "")  # a blank line must not shift what is missing
    file.write_text("\r\n".join(lines) + "\r\n")

    sequence = read(sequence_path)
    missing = np.zeros(before.shape, dtype=bool)
    missing[0, 0] = missing[3, 4] = missing[3, 8] = missing[7] = True
    np.testing.assert_array_equal(np.isnan(sequence.cables.lengths), missing)
    np.testing.assert_array_equal(sequence.cables.lengths[~missing], before[~missing])

    write(sequence, tmp_path / "again")
    assert_same(read(tmp_path / "again"), sequence)
    written = (tmp_path / "again" / "cables.csv").read_text().splitlines()
    assert written[1].split(",")[1] == ""
    assert written[8].endswith("0" + 9 * ",")


def test_files_the_format_does_not_know_are_ignored(sequence_path: Path) -> None:
    before = read(sequence_path)
    (sequence_path / "notes.csv").write_bytes(b"\xff\x00")
    (sequence_path / "video").mkdir()
    assert_same(read(sequence_path), before)


def test_a_given_robot_takes_the_place_of_the_recorded_one(sequence_path: Path) -> None:
    (sequence_path / "robot.yaml").write_text("rod_lenght: 1\n")
    mine = robots.load().model_copy(update={"name": "mine"})
    assert read(sequence_path, robot=mine).robot == mine


def test_the_robot_is_written_in_full(sequence_path: Path) -> None:
    text = (sequence_path / "robot.yaml").read_text()
    assert all(
        f"{key}: " in text or f"{key}:\n" in text for key in type(robots.load()).model_fields
    )


def test_windows_line_ends_blank_lines_and_a_byte_order_mark_are_fine(sequence_path: Path) -> None:
    before = read(sequence_path)
    for name in ("imu.csv", "groundtruth.tum"):
        content = (sequence_path / name).read_bytes()
        content = b"\xef\xbb\xbf" + content.replace(b"\n", b"\r\n") + b"\r\n"
        (sequence_path / name).write_bytes(content)
    assert_same(read(sequence_path), before)


def test_lines_are_counted_with_comments_and_blank_lines(sequence_path: Path) -> None:
    file = sequence_path / "groundtruth.tum"
    lines = file.read_text().splitlines()
    lines[1] = lines[1].replace(" ", " nan ", 1).rsplit(" ", 1)[0]
    file.write_text("\n".join(["# t x y z qx qy qz qw", "", *lines, ""]))
    with pytest.raises(InputError, match="got nan") as caught:
        read(sequence_path)
    assert (caught.value.line, caught.value.field) == (4, "x")


@pytest.mark.parametrize("t0_ns", [-1, 1_700_000_000_123_456_789, 2**62])
def test_stamps_are_exact_to_the_nanosecond(t0_ns: int, tmp_path: Path) -> None:
    sequence = make_sequence(0.05, t0_ns=t0_ns)
    write(sequence, tmp_path / "s")
    assert_same(read(tmp_path / "s"), sequence)


def test_coarse_quaternions_are_normalised(sequence_path: Path) -> None:
    file = sequence_path / "groundtruth.tum"
    rows = np.loadtxt(file)
    np.savetxt(file, rows, fmt="%.3f")
    groundtruth = read(sequence_path).groundtruth
    assert groundtruth is not None
    np.testing.assert_allclose(np.linalg.norm(groundtruth.quaternion, axis=1), 1, atol=1e-15)


def test_nothing_is_overwritten_unless_asked(sequence_path: Path) -> None:
    first, second = make_sequence(0.1), make_sequence(0.2)
    with pytest.raises(InputError, match="not empty"):
        write(first, sequence_path)
    assert read(sequence_path).duration_s == pytest.approx(1.0)
    write(second, sequence_path, overwrite=True)
    assert read(sequence_path).duration_s == pytest.approx(0.2)


def still(**changes: object) -> Sequence:
    return replace(make_sequence(0.05), **changes)  # type: ignore[arg-type]


T = np.arange(3, dtype=np.int64)
ZERO, ONE = np.zeros((3, 3)), np.ones((3, 3))


@pytest.mark.parametrize(
    ("broken", "says"),
    [
        (still(imu=ImuStream(T, ZERO * np.nan, ONE)), "imu.csv: row 0, column 'gyro_x'"),
        (still(imu=ImuStream(T[::-1], ZERO, ONE)), "imu.csv: row 1, column 't_ns'"),
        (still(imu=ImuStream(T[:2], ZERO, ONE)), "imu.csv: 2 stamps and 6 columns"),
        (still(imu=ImuStream(T[:0], ZERO[:0], ONE[:0])), "imu.csv: no samples"),
        (still(cables=CableStream(T, np.ones((3, 8)))), "cables.csv: 3 stamps and 9 columns"),
        (still(cables=CableStream(T, -np.ones((3, 9)))), "column 'l_0_4': expected an empty cell"),
        (still(cables=CableStream(T, np.full((3, 9), np.inf))), "column 'l_0_4': expected an"),
        (still(cables=CableStream(T, np.full((3, 9), np.nan))), "all values are missing"),
        (still(contacts=ContactStream(T, np.ones((3, 5), bool))), "contacts.csv"),
        (still(groundtruth=PoseStream(T, ZERO, np.ones((3, 4)))), "not of unit length"),
        (still(endcaps=EndcapStream(T, np.full((3, 6, 3), np.inf))), "endcaps.csv"),
        (still(endcaps=EndcapStream(T, np.full((3, 6, 3), np.nan))), "endcaps.csv: row 0"),
        (still(other_imus={"r23": ImuStream(T, ZERO, ONE * np.inf)}), "imu_r23.csv"),
    ],
)
def test_what_could_not_be_read_is_not_written(broken: Sequence, says: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=says.replace("(", r"\(")):
        write(broken, tmp_path / "s")
    assert list(tmp_path.iterdir()) == []


def stamps(count: int) -> st.SearchStrategy[np.ndarray]:
    """Increasing stamps around a common time, so that all streams overlap."""
    gaps = st.lists(st.integers(1, 10**9), min_size=count, max_size=count)
    return gaps.map(lambda g: np.cumsum(g, dtype=np.int64) + 1_700_000_000 * 10**9)


def arrays(shape: tuple[int, ...], low: float, high: float) -> st.SearchStrategy[np.ndarray]:
    return npst.arrays(np.float64, shape, elements=st.floats(low, high))


@st.composite
def sequences(draw: st.DrawFn) -> Sequence:
    count = draw(st.integers(1, 4))
    t_ns = draw(stamps(count))
    quaternion = draw(arrays((count, 4), -1, 1))
    quaternion[:, 3] += 3.0  # away from zero
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    rates, forces = arrays((count, 3), -1e9, 1e9), arrays((count, 3), -1e3, 1e3)
    lengths = draw(arrays((count, 9), 1e-6, 2.9))
    lost = draw(npst.arrays(np.bool_, (count, 9)))
    lengths[lost & ~lost.all()] = np.nan  # a recording with no length at all cannot be written
    return Sequence(
        name="random",
        robot=robots.load(),
        imu=ImuStream(t_ns, draw(rates), draw(forces)),
        cables=CableStream(t_ns, lengths),
        contacts=ContactStream(t_ns, draw(npst.arrays(np.bool_, (count, 6)))),
        groundtruth=PoseStream(t_ns, draw(arrays((count, 3), -1e6, 1e6)), quaternion),
        endcaps=EndcapStream(t_ns, draw(arrays((count, 6, 3), -1e300, 1e300))),
        other_imus={
            name: ImuStream(t_ns, draw(rates), draw(forces))
            for name in sorted(draw(st.sets(st.sampled_from(["r23", "r45", "tip_0"]))))
        },
    )


@settings(max_examples=25, deadline=None)
@given(sequence=sequences())
def test_any_sequence_reads_back(
    tmp_path_factory: pytest.TempPathFactory, sequence: Sequence
) -> None:
    path = tmp_path_factory.mktemp("sequence") / "s"
    write(sequence, path)
    again = read(path)
    assert_same(again, sequence)
    # What was printed once is reproduced without any further loss.
    write(again, path.with_name("again"))
    for file in ("imu.csv", "cables.csv", "contacts.csv", "endcaps.csv", "robot.yaml"):
        assert (path / file).read_bytes() == (path.with_name("again") / file).read_bytes()


def test_shared_recordings_are_read(shared_data: Path) -> None:
    sequence = read(shared_data / "prism3" / "forward")
    assert len(sequence.imu.t_ns) == 7604
    assert sequence.cables.lengths.shape == (3802, 9)
    assert sequence.contacts is not None
    assert sequence.contacts.flags[0].tolist() == [True, False, False, True, False, True]
    assert sequence.groundtruth is not None
    assert sequence.endcaps is not None
    # The body frame is the IMU's: endcap 0 stands on its z axis, L/2 - d away.
    distance = np.linalg.norm(
        sequence.endcaps.position[:, 0] - sequence.groundtruth.position, axis=1
    )
    np.testing.assert_allclose(distance, 1.45 / 2 - 0.02, atol=2e-4)
