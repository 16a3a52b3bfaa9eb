"""Calibration of cables and IMU: what is recovered, what is refused, and who uses the result."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from helpers.sequences import make_sequence
from tensegrity import InputError, PrismEstimator, calibration, estimate, robots
from tensegrity.calibration import RobotCalibration, calibrate_robot
from tensegrity.calibration.evidence import Evidence
from tensegrity.calibration.mounting import Mounting, find_mounting
from tensegrity.calibration.offsets import find_offsets
from tensegrity.cli import app
from tensegrity.robots import Robot
from tensegrity.robots.mounting import imu_rotation
from tensegrity.sequence import Sequence, write
from tensegrity.simulation import SimulationOptions, simulate

pytest.importorskip("mujoco", reason="simulation needs the 'sim' extra")

IMU_OFFSET = 0.035  # m, the packaged robot states 0.02
MISALIGNMENT = (0.03, -0.02)  # rad
OFFSETS = (0.008, -0.005, 0.003, -0.007, 0.002, 0.006, -0.004, 0.005, -0.006)  # m


@pytest.fixture(scope="module")
def slow_roll() -> Sequence:
    """A slow roll of a robot whose recording knows nothing of its errors."""
    truth = robots.load().model_copy(update={"imu_offset": IMU_OFFSET})
    options = SimulationOptions(
        seed=2,
        cable_speed=0.08,
        path_length=3.0,
        still_start=2.5,
        still_end=1.0,
        cable_offsets=OFFSETS,
        imu_misalignment=MISALIGNMENT,
    )
    recording = simulate("left-turn", options, truth)
    return dataclasses.replace(recording, robot=robots.load())


def endcap_error(sequence: Sequence, robot: Robot) -> float:
    """Root mean square error of the endcaps relative to endcap 0, in the frame of the base rod [m]:
    where on the rod the body's origin is does not matter."""
    trajectory = estimate(sequence, robot)
    truth, endcaps = sequence.groundtruth, sequence.endcaps
    assert truth is not None
    assert endcaps is not None
    rows = np.searchsorted(endcaps.t_ns, trajectory.t_ns)
    distances = [
        np.linalg.norm(q[:, 2:] - q[:, :1], axis=2)
        for q in (trajectory.endcaps_body, endcaps.position[rows])
    ]
    return float(np.sqrt(np.mean((distances[0] - distances[1]) ** 2)))


# --- what is recovered --------------------------------------------------------------------------


def test_errors_of_a_slow_roll_are_recovered(slow_roll: Sequence) -> None:
    """One test for all: the calibration replays the recording some forty times."""
    calibrated = calibrate_robot([slow_roll])
    robot = calibrated.robot

    offset_error = abs(robot.imu_offset - IMU_OFFSET)
    assert offset_error < 0.010
    assert offset_error < 3 * calibrated.imu_offset_std
    angle_errors = np.abs(np.subtract(robot.imu_misalignment, MISALIGNMENT))
    assert np.all(angle_errors < 0.010)
    assert np.all(angle_errors < 3 * calibrated.imu_misalignment_std)

    cable_errors = np.abs(np.subtract(robot.cable_offsets, OFFSETS))
    assert np.all(cable_errors < 3 * calibrated.cable_offset_std)
    assert np.sqrt(np.mean(cable_errors**2)) < 0.004  # of 5.4 mm
    assert np.all(calibrated.cable_offset_std < calibration.robot.OFFSET_STD_M)

    assert endcap_error(slow_roll, robot) < endcap_error(slow_roll, slow_roll.robot) / 2


# --- the method, on recordings whose answer is known exactly -------------------------------------


@dataclasses.dataclass
class LinearRecording:
    """Measures ``y = H offsets + noise`` of unit variance, by a Kalman filter with the prior
    standard deviation ``prior_std``; its misfit is quadratic in the mounting, block by block."""

    h: np.ndarray
    y: np.ndarray
    prior_std: float = 0.01
    best: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((1, 3)))  # of each block

    def replay(self, mounting: np.ndarray, expected_offsets: np.ndarray) -> Evidence:
        prior = np.eye(9) / self.prior_std**2
        offsets = np.linalg.solve(
            prior + self.h.T @ self.h, prior @ expected_offsets + self.h.T @ self.y
        )
        misfit = 1e5 * ((mounting - self.best) ** 2).sum(axis=1)
        return Evidence(misfit, offsets, trajectory=None)  # type: ignore[arg-type]


def test_offsets_of_several_recordings_are_those_of_all_measurements_together() -> None:
    rng = np.random.default_rng(0)
    truth = rng.normal(0, 0.01, 9)
    # The first recording sees six combinations, the second six others: some are seen by both.
    hs = [150 * rng.normal(size=(6, 9)) for _ in range(2)]
    ys = [h @ truth + rng.normal(size=6) for h in hs]
    known = Mounting(np.zeros(3), np.zeros((3, 3)), 1.0, [np.zeros((9, 3))] * 2)
    recordings = [LinearRecording(h, y) for h, y in zip(hs, ys, strict=True)]
    expected = np.full(9, 0.001)
    found = find_offsets(recordings, known, expected, 0.01, lambda: None)  # type: ignore[arg-type]
    h, y, prior = np.vstack(hs), np.hstack(ys), np.eye(9) / 0.01**2
    covariance = np.linalg.inv(prior + h.T @ h)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-6, atol=1e-10)
    np.testing.assert_allclose(found.estimate, covariance @ (prior @ expected + h.T @ y), atol=1e-8)


def test_what_no_recording_sees_keeps_the_prior() -> None:
    blind = LinearRecording(np.zeros((1, 9)), np.zeros(1))
    slopes = np.zeros((9, 3))
    known = Mounting(np.zeros(3), np.zeros((3, 3)), 5.0, [slopes])
    found = find_offsets([blind], known, np.zeros(9), 0.01, lambda: None)  # type: ignore[list-item]
    np.testing.assert_allclose(found.estimate, np.zeros(9), atol=1e-12)
    np.testing.assert_allclose(found.covariance, 0.01**2 * np.eye(9), rtol=1e-9)


def test_mounting_is_the_minimum_over_all_blocks() -> None:
    best = np.array([0.04, 0.03, -0.02]) + np.random.default_rng(1).normal(0, 0.004, (40, 3))
    whole = LinearRecording(np.zeros((1, 9)), np.zeros(1), best=best)
    halves = [dataclasses.replace(whole, best=part) for part in (best[:25], best[25:])]
    for recordings in ([whole], halves):
        found = find_mounting(recordings, np.array([0.02, 0, 0]), np.zeros(9), lambda: None)  # type: ignore[arg-type]
        np.testing.assert_allclose(found.estimate, best.mean(axis=0), atol=1e-4)
        scatter = np.std(best, axis=0, ddof=3) / np.sqrt(len(best))
        expected = np.hypot(scatter, [0.003, 0, 0])  # feet that slip, see the module
        np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), expected, rtol=0.05)


# --- what is refused ----------------------------------------------------------------------------


def test_a_robot_that_never_rolls_is_refused() -> None:
    with pytest.raises(InputError, match=r"'synthetic' turned by no more than 0 deg.*slow roll"):
        calibrate_robot([make_sequence(4.0)])


def test_a_loosely_coupled_filter_is_refused() -> None:
    with pytest.raises(InputError, match=r"'settings.filter'.*use filter: tight"):
        calibrate_robot([make_sequence(4.0)], config="paper")


def test_recordings_of_different_robots_are_refused() -> None:
    longer = robots.load().model_copy(update={"rod_length": 1.5})
    with pytest.raises(InputError, match="'a' and 'b' are recordings of different robots"):
        calibrate_robot([make_sequence(name="a"), make_sequence(name="b", robot=longer)])


def test_no_recording_is_refused() -> None:
    with pytest.raises(InputError, match="no recording"):
        calibrate_robot([])


@pytest.mark.parametrize("std", [0.0, -0.01, 1.0, float("nan")])
def test_an_impossible_expectation_is_refused(std: float) -> None:
    with pytest.raises(InputError, match=r"'offset_std': expected a number in \(0, 0.1\] \[m\]"):
        calibrate_robot([make_sequence()], offset_std=std)


@pytest.mark.parametrize(
    ("text", "line", "field", "says"),
    [
        ("imu_misalignment: [0.5, 0.0]\n", 1, "imu_misalignment[0]", "0.349"),
        ("imu_misalignment: [0.1]\n", 1, "imu_misalignment[1]", ""),
        ("name: mine\ncable_offsets: [0.01, 0.0]\n", 2, "cable_offsets", "one per cable, got 2"),
        ("cable_offsets: [a, 0, 0, 0, 0, 0, 0, 0, 0]\n", 1, "cable_offsets[0]", "[m]"),
    ],
)
def test_an_impossible_calibration_in_a_file(
    text: str, line: int, field: str, says: str, tmp_path: Path
) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        robots.load(file)
    assert (caught.value.line, caught.value.field) == (line, field)
    assert says in str(caught.value)


# --- who uses the result ------------------------------------------------------------------------


def test_corrections_undo_the_errors_of_the_sensors() -> None:
    """Samples with the errors a robot states give what exact samples give without them."""
    exact = make_sequence(3.0)
    turned = imu_rotation(MISALIGNMENT)
    imu = dataclasses.replace(
        exact.imu, gyro=exact.imu.gyro @ turned, accel=exact.imu.accel @ turned
    )
    cables = dataclasses.replace(exact.cables, lengths=exact.cables.lengths + OFFSETS)
    robot = robots.load().model_copy(
        update={"imu_misalignment": MISALIGNMENT, "cable_offsets": OFFSETS}
    )
    corrected = estimate(dataclasses.replace(exact, imu=imu, cables=cables), robot)
    expected = estimate(exact)
    np.testing.assert_allclose(corrected.position, expected.position, atol=1e-9)
    np.testing.assert_allclose(corrected.endcaps_body, expected.endcaps_body, atol=1e-9)


def test_streaming_corrects_like_replay() -> None:
    recording = make_sequence(3.0)
    robot = robots.load().model_copy(
        update={"imu_misalignment": (0.01, 0.005), "cable_offsets": (0.002,) * 9}
    )
    estimator = PrismEstimator(robot)
    for k, t in enumerate(recording.imu.t_ns.tolist()):
        estimator.imu(t, recording.imu.gyro[k], recording.imu.accel[k])
        if k % 2 == 0:
            estimator.cables(t, recording.cables.lengths[k // 2])
    replayed = estimate(dataclasses.replace(recording, contacts=None), robot)
    assert len(replayed.t_ns) > 0
    np.testing.assert_array_equal(estimator.state.position, replayed.position[-1])
    np.testing.assert_array_equal(estimator.state.endcaps_body, replayed.endcaps_body[-1])


def test_rotation_takes_the_imu_to_the_body() -> None:
    """A turn about the body's x by a small angle tips the IMU's z toward the body's -y."""
    np.testing.assert_allclose(
        imu_rotation((0.02, 0.0)) @ [0, 0, 1], [0, -np.sin(0.02), np.cos(0.02)], atol=1e-15
    )


# --- command line -------------------------------------------------------------------------------


def calibrate(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["calibrate-robot", *map(str, arguments)])


def test_command_writes_a_robot_that_loads_back(
    written_sequence: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = robots.load().model_copy(
        update={"imu_misalignment": MISALIGNMENT, "cable_offsets": OFFSETS}
    )
    calibrated = RobotCalibration(robot, 1e-6 * np.eye(3), 4e-6 * np.eye(9))
    monkeypatch.setattr(calibration, "calibrate_robot", lambda *_, **__: calibrated)
    file = tmp_path / "robot.yaml"
    result = calibrate(written_sequence, "--out", file)
    assert result.exit_code == 0, result.output
    assert re.search(r"cable 0-4 .* \+8.00 .* 2.00 .* mm", result.stdout)
    assert robots.load(file) == robot
    assert "#   cable 2-5: -6.00 +- 2.00 mm" in file.read_text()
    again = calibrate(written_sequence, "--out", file)
    assert (again.exit_code, again.stdout) == (2, "")
    assert "exists already (add --overwrite" in again.stderr
    assert calibrate(written_sequence, "--out", file, "--overwrite").exit_code == 0


def test_command_writes_nothing_when_calibration_fails(tmp_path: Path) -> None:
    write(make_sequence(4.0), tmp_path / "still")
    result = calibrate(tmp_path / "still", "--out", tmp_path / "robot.yaml")
    assert result.exit_code == 2
    assert "record a slow roll" in result.stderr
    assert not (tmp_path / "robot.yaml").exists()
    missing = calibrate(tmp_path / "still", "--out", tmp_path / "none" / "robot.yaml")
    assert "its directory does not exist" in missing.stderr
