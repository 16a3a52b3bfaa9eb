"""Runs survive writing and reading."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers.sequences import make_sequence
from helpers.trajectories import true_trajectory
from tensegrity import robots
from tensegrity.config import FilterConfig
from tensegrity.errors import InputError
from tensegrity.run import is_run, read_run, write_run
from tensegrity.trajectory import Trajectory


def write_default(trajectory: Trajectory, path: Path, **options: bool) -> None:
    write_run(
        trajectory,
        path,
        sequence="recordings/forward",
        robot=robots.load(),
        config=FilterConfig.load("paper"),
        **options,
    )


@pytest.fixture(scope="module")
def trajectory() -> Trajectory:
    return true_trajectory(make_sequence(0.5, yaw_rate=0.4))


@pytest.fixture
def run_path(trajectory: Trajectory, tmp_path: Path) -> Path:
    write_default(trajectory, tmp_path / "run")
    return tmp_path / "run"


def assert_same(actual: Trajectory, expected: Trajectory) -> None:
    for field in fields(Trajectory):
        mine, theirs = getattr(actual, field.name), getattr(expected, field.name)
        if field.name == "health":
            assert list(mine) == list(theirs)
            for name in theirs:
                np.testing.assert_array_equal(mine[name], theirs[name])
        elif isinstance(theirs, np.ndarray):
            assert mine.dtype == theirs.dtype, field.name
            np.testing.assert_allclose(mine, theirs, rtol=1e-8, atol=5e-8, err_msg=field.name)
        else:
            assert mine == theirs


def test_a_run_reads_back(trajectory: Trajectory, run_path: Path) -> None:
    run = read_run(run_path)
    assert_same(run.trajectory, trajectory)
    assert run.path == run_path
    assert run.info.sequence == "recordings/forward"
    assert run.info.robot == robots.load()
    assert run.info.filter == FilterConfig.load("paper")
    assert run.info.runtime_s == 0.25
    assert run.trajectory.info == {"method": "full"}


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), names=st.lists(st.sampled_from("abc"), unique=True))
def test_any_trajectory_reads_back(
    tmp_path_factory: pytest.TempPathFactory, seed: int, names: list[str]
) -> None:
    rng = np.random.default_rng(seed)
    plain = true_trajectory(make_sequence(0.02, yaw_rate=1.0))
    n = len(plain.t_ns)
    factor = rng.normal(size=(3, n, 3, 3))
    covariance = factor @ factor.swapaxes(-1, -2)
    trajectory = replace(
        plain,
        velocity=rng.normal(size=(n, 3)),
        gyro_bias=rng.normal(size=(n, 3)),
        accel_bias=rng.normal(size=(n, 3)),
        spin=rng.normal(size=n),
        contacts=rng.random((n, 6)) < 0.5,
        position_covariance=covariance[0],
        orientation_covariance=covariance[1],
        velocity_covariance=covariance[2],
        health={name: np.cumsum(rng.integers(0, 9, n)) for name in names},
        cable_nis=np.where(rng.random(n) < 0.5, np.nan, rng.chisquare(9, n) / 9),
        ground_nis=np.where(rng.random(n) < 0.5, np.nan, rng.chisquare(3, n) / 3),
    )
    path = tmp_path_factory.mktemp("run") / "run"
    write_default(trajectory, path)
    assert_same(read_run(path).trajectory, trajectory)


def test_a_trajectory_without_innovations_has_empty_cells(
    trajectory: Trajectory, run_path: Path
) -> None:
    for nis in (trajectory.cable_nis, trajectory.ground_nis):
        assert nis.shape == trajectory.t_ns.shape
        assert np.isnan(nis).all()
    header, *rows = (run_path / "state.csv").read_text().splitlines()
    at = header.split(",").index("cable_nis")
    assert header.split(",")[at + 1] == "ground_nis"
    assert {tuple(row.split(",")[at : at + 2]) for row in rows} == {("", "")}


def test_a_run_from_before_the_innovations_says_what_to_do(run_path: Path) -> None:
    file = run_path / "state.csv"
    rows = [line.split(",") for line in file.read_text().splitlines()]
    at = rows[0].index("cable_nis")
    file.write_text("".join(",".join(row[:at] + row[at + 2 :]) + "\n" for row in rows))
    with pytest.raises(InputError, match="estimate again") as caught:
        read_run(run_path)
    assert (caught.value.file, caught.value.line, caught.value.field) == (file, 1, "cable_nis")


def test_information_of_any_kind_is_kept_as_a_scalar(
    trajectory: Trajectory, tmp_path: Path
) -> None:
    info = {"n": np.int64(3), "x": np.float64(0.5), "ok": np.True_, "path": Path("a/b")}
    write_default(replace(trajectory, info=info), tmp_path / "run")
    assert read_run(tmp_path / "run").trajectory.info == {
        "n": 3,
        "x": 0.5,
        "ok": True,
        "path": "a/b",
    }


def test_an_estimate_that_is_not_finite_is_not_written(
    trajectory: Trajectory, tmp_path: Path
) -> None:
    velocity = trajectory.velocity.copy()
    velocity[7, 1] = np.nan
    with pytest.raises(ValueError, match=r"state\.csv: row 7, column 'velocity_y'"):
        write_default(replace(trajectory, velocity=velocity), tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


def test_only_runs_are_replaced_and_only_when_asked(
    trajectory: Trajectory, run_path: Path, sequence_path: Path
) -> None:
    assert is_run(run_path)
    assert not is_run(sequence_path)
    with pytest.raises(InputError, match="not empty"):
        write_default(trajectory, run_path)
    with pytest.raises(InputError, match=r"holds no trajectory\.tum"):
        write_default(trajectory, sequence_path, overwrite=True)
    write_default(replace(trajectory, runtime_s=9.0), run_path, overwrite=True)
    assert read_run(run_path).info.runtime_s == 9.0


def break_line(file: Path, number: int, old: str, new: str) -> None:
    lines = file.read_text().splitlines(keepends=True)
    assert old in lines[number - 1]
    lines[number - 1] = lines[number - 1].replace(old, new, 1)
    file.write_text("".join(lines))


def test_a_broken_configuration_is_located(run_path: Path) -> None:
    file = run_path / "config.yaml"
    line = next(i for i, text in enumerate(file.read_text().split("\n"), 1) if "cable_std" in text)
    break_line(file, line, "0.0035", "-1")
    with pytest.raises(InputError, match=r"a number > 0 \[m\], got -1") as caught:
        read_run(run_path)
    assert (caught.value.file, caught.value.line) == (file, line)
    assert caught.value.field == "filter.noises.cable_std"


def test_a_negative_innovation_is_refused(trajectory: Trajectory, tmp_path: Path) -> None:
    nis = np.ones(len(trajectory.t_ns))
    nis[5] = -0.1
    with pytest.raises(ValueError, match=r"row 5, column 'ground_nis'.*>= 0, got -0\.1"):
        write_default(replace(trajectory, ground_nis=nis), tmp_path / "run")


def test_a_broken_state_is_located(run_path: Path) -> None:
    file = run_path / "state.csv"
    break_line(file, 3, "5000000,0,", "5000000,x,")
    with pytest.raises(InputError, match=r"\[m/s\], got 'x'") as caught:
        read_run(run_path)
    assert (caught.value.file, caught.value.line, caught.value.field) == (file, 3, "velocity_x")


def test_files_of_different_runs_are_not_mixed(run_path: Path) -> None:
    lines = (run_path / "state.csv").read_text().splitlines(keepends=True)
    (run_path / "state.csv").write_text("".join(lines[:-1]))
    with pytest.raises(InputError, match=r"stamps are not those of trajectory\.tum") as caught:
        read_run(run_path)
    assert caught.value.file == run_path / "state.csv"


@pytest.mark.parametrize("name", ["trajectory.tum", "endcaps.csv", "state.csv", "config.yaml"])
def test_a_missing_file_is_named(name: str, run_path: Path) -> None:
    (run_path / name).unlink()
    with pytest.raises(InputError, match="no such file") as caught:
        read_run(run_path)
    assert caught.value.file == run_path / name


def test_no_run_at_all(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such run"):
        read_run(tmp_path / "none")
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file"):
        read_run(tmp_path / "file")
