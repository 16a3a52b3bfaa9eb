"""Ranging recordings and the calibration of anchors and offsets."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from tensegrity.cli.app import app
from tensegrity.errors import InputError
from tensegrity.ranging import (
    Anchors,
    FloorTruth,
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
from tensegrity.ranging.calibration import RangeCalibration, calibrate_ranges
from tensegrity.ranging.calibration_files import read_calibration, write_calibration
from tensegrity.ranging.calibration_frame import RigidMotion, align, survey_frame
from tensegrity.ranging.calibration_model import CalibrationModel
from tensegrity.ranging.calibration_start import closed_form
from tensegrity.ranging.multilateration import locate
from tensegrity.ranging.prediction import prediction_errors

FloatArray = NDArray[np.float64]

ANCHORS = Anchors(
    np.arange(13, 19),
    np.array(
        [[0, 0, 2.1], [9, 1, 0.9], [8, 10, 3.4], [-1, 9, 0.8], [4, -3, 1.5], [4, 12, 4.0]],
        dtype=np.float64,
    ),
)
RODS = ((1, 2), (3, 4))
ROD_M = 1.6
OFFSET_M = 3.95
NOISE_M = 0.06
MODEL = CalibrationModel(rods=RODS, rod_length=ROD_M)
FACTS = np.array([0.05, -0.04, 0.02, 0.03, -0.05, 0.01])  # offsets of the anchors [m]


def simulated(
    seed: int = 0, seconds: float = 40.0, rate: float = 60.0, noise: float = NOISE_M
) -> RangeRecording:
    """Two rods that wander through the anchors' area and range one anchor at a time."""
    rng = np.random.default_rng(seed)
    count = round(seconds * rate)
    t = np.sort(rng.uniform(0.0, seconds, count))
    node, anchor = rng.integers(1, 5, count), rng.integers(0, len(ANCHORS), count)
    ranges = np.empty(count)
    for i in range(count):
        distance = np.linalg.norm(module(int(node[i]), t[i]) - ANCHORS.position_m[anchor[i]])
        ranges[i] = distance + OFFSET_M + FACTS[anchor[i]]
    ranges += rng.normal(scale=noise, size=count)
    return RangeRecording(
        np.round(t * 1e9).astype(np.int64), node, ANCHORS.ids[anchor], ranges, name="simulated"
    )


def module(node: int, t: float) -> FloatArray:
    """Position of a module at time t [s]."""
    rod, end = divmod(node - 1, 2)
    middle = [4 + 3 * np.sin(0.21 * t + rod), 4.5 + 4 * np.sin(0.13 * t + 2 * rod), 0.8]
    turn, tilt = 0.35 * t + rod, 0.6 * np.sin(0.5 * t)
    along = [np.cos(turn) * np.cos(tilt), np.sin(turn) * np.cos(tilt), np.sin(tilt)]
    return np.array(middle) + (0.5 - end) * ROD_M * np.array(along)


def misplaced(result: RangeCalibration) -> float:
    """Largest error of an anchor after the best rigid alignment [m]."""
    found = result.anchors.position_m
    return float(
        np.linalg.norm(align(found, ANCHORS.position_m)(found) - ANCHORS.position_m, axis=1).max()
    )


@pytest.fixture(scope="module")
def recording() -> RangeRecording:
    return simulated()


@pytest.fixture(scope="module")
def calibrated(recording: RangeRecording) -> RangeCalibration:
    return calibrate_ranges(recording, ANCHORS, MODEL)


class TestFiles:
    def test_what_is_written_is_read(self, tmp_path: Path, recording: RangeRecording) -> None:
        write_ranges(tmp_path / "ranges.csv", recording)
        again = read_ranges(tmp_path, ANCHORS)
        assert again.timed
        assert again.name == tmp_path.name
        np.testing.assert_array_equal(again.t_ns, recording.t_ns)
        np.testing.assert_array_equal(again.node, recording.node)
        np.testing.assert_array_equal(again.anchor, recording.anchor)
        np.testing.assert_allclose(again.range_m, recording.range_m, rtol=1e-8)

    def test_steps_are_no_times(self, tmp_path: Path) -> None:
        (tmp_path / "ranges.csv").write_text("step,node,anchor,range_m\n0,1,13,5\n0,2,13,6\n")
        recording = read_ranges(tmp_path)
        assert not recording.timed
        np.testing.assert_array_equal(recording.elapsed, [0.0, 0.0])
        write_ranges(tmp_path / "again.csv", recording)
        assert (tmp_path / "again.csv").read_text().startswith("step,")

    def test_a_stretch_of_time_or_steps(self, recording: RangeRecording) -> None:
        part = recording.between(10.0, 20.0)
        assert (part.t_ns >= 10 * 10**9).all()
        assert (part.t_ns < 20 * 10**9).all()
        assert len(part) + len(recording.between(0, 10)) == len(recording.between(0, 20))
        steps = replace(recording, t_ns=np.arange(len(recording)), timed=False)
        np.testing.assert_array_equal(steps.between(3, 6).t_ns, [3, 4, 5])
        with pytest.raises(InputError, match="no ranges from 50 up to 60"):
            recording.between(50.0, 60.0)

    def test_unknown_coordinates_stay_unknown(self, tmp_path: Path) -> None:
        position = np.array([[1.0, 2.0, np.nan], [np.nan, np.nan, np.nan]])
        write_anchors(tmp_path / "anchors.csv", Anchors(np.array([13, 14]), position))
        anchors = read_anchors(tmp_path)
        np.testing.assert_array_equal(anchors.position_m, position)
        np.testing.assert_array_equal(anchors.known, np.isfinite(position))

    def test_small_tables_are_read_back(self, tmp_path: Path) -> None:
        offsets = Offsets(np.array([1, 2]), np.array([13, 13]), np.array([3.9, 4.1]))
        write_offsets(tmp_path / "offsets.csv", offsets)
        table = read_offsets(tmp_path).table([1, 2], [13, 14])
        np.testing.assert_array_equal(table, [[3.9, np.nan], [4.1, np.nan]])
        internal = InternalRanges(
            np.array([0, 5]), np.array([1, 2]), np.array([2, 3]), np.array([5.0, 6.0])
        )
        write_internal_ranges(tmp_path / "internal_ranges.csv", internal)
        np.testing.assert_array_equal(read_internal_ranges(tmp_path).other, internal.other)
        truth = FloorTruth(
            np.array([12.0]), np.array([22.0]), np.array([9]), np.array([[1.09, 1.6]])
        )
        write_floor_truth(tmp_path / "floor_truth.csv", truth)
        np.testing.assert_array_equal(read_floor_truth(tmp_path).position_m, truth.position_m)

    @pytest.mark.parametrize(
        ("line", "field", "says"),
        [
            ("5,1,13,-0.1", "range_m", "between 0 and 300"),
            ("5,1,13,301", "range_m", "between 0 and 300"),
            ("5,1,13,nan", "range_m", "between 0 and 300"),
            ("5,1,13,", "range_m", "between 0 and 300"),
            ("5,1.5,13,4", "node", "number of a module"),
            ("5,1,99,4", "anchor", "anchor 99 is unknown"),
            ("-1,1,13,4", "t_ns", "earlier than the line before"),
            ("99999999999999999999,1,13,4", "t_ns", "whole number"),
            ("5,1,13", None, "3 columns"),
        ],
    )
    def test_bad_ranges_name_line_and_column(
        self, tmp_path: Path, line: str, field: str | None, says: str
    ) -> None:
        file = tmp_path / "ranges.csv"
        file.write_text(f"t_ns,node,anchor,range_m\n0,1,13,5\n{line}\n")
        with pytest.raises(InputError, match=says) as error:
            read_ranges(file, ANCHORS)
        assert (error.value.file, error.value.line, error.value.field) == (file, 3, field)

    @pytest.mark.parametrize(
        ("text", "says"),
        [
            ("", "unknown column|missing"),
            ("t_ns,node,anchor,range\n0,1,13,5\n", "unknown column"),
            ("t_ns,node,anchor\n0,1,13\n", "missing"),
            ("t_ns,node,anchor,range_m\n", "holds no rows"),
            ("t_ns,node,anchor,range_m\n0,1,13,5", "no line end"),
        ],
    )
    def test_bad_tables_are_refused(self, tmp_path: Path, text: str, says: str) -> None:
        (tmp_path / "ranges.csv").write_text(text)
        with pytest.raises(InputError, match=says):
            read_ranges(tmp_path)

    def test_anchors_and_pairs_are_listed_once(self, tmp_path: Path) -> None:
        (tmp_path / "anchors.csv").write_text("anchor,x_m,y_m,z_m\n13,,,\n13,1,2,3\n")
        with pytest.raises(InputError, match="13 appears twice"):
            read_anchors(tmp_path)
        (tmp_path / "offsets.csv").write_text("node,anchor,offset_m\n1,13,3\n1,13,3\n")
        with pytest.raises(InputError, match="1 and 13 appears twice"):
            read_offsets(tmp_path)

    def test_values_that_cannot_be_read_are_not_written(self, tmp_path: Path) -> None:
        bad = RangeRecording(np.array([0]), np.array([1]), np.array([13]), np.array([-1.0]))
        with pytest.raises(ValueError, match="range_m"):
            write_ranges(tmp_path / "ranges.csv", bad)
        assert not (tmp_path / "ranges.csv").exists()


class TestGeometry:
    def test_closed_form_finds_a_plane_triangle(self) -> None:
        rng = np.random.default_rng(0)
        anchors = ANCHORS.position_m[:3] * [1, 1, 0]
        modules = rng.uniform(0, 9, (60, 3)) * [1, 1, 0]
        ranges = np.linalg.norm(modules[:, None] - anchors, axis=2) + OFFSET_M
        solution = closed_form(ranges, OFFSET_M)
        assert solution is not None
        found, misfit = solution
        assert misfit < 1e-6
        np.testing.assert_allclose(align(found, anchors)(found), anchors, atol=1e-6)
        assert closed_form(ranges[:10], OFFSET_M) is None

    def test_locate_ignores_a_range_that_is_far_too_long(self) -> None:
        at = np.array([[3.0, 4.0, 0.5]])
        distances = np.linalg.norm(at[:, None] - ANCHORS.position_m, axis=2)
        distances[0, 1] += 6.0
        distances[0, 4] = np.nan
        found, _ = locate(ANCHORS.position_m, distances, at + 0.7, 0.1)
        np.testing.assert_allclose(found, at, atol=0.01)

    def test_locate_without_enough_ranges_stays_finite(self) -> None:
        distances = np.full((2, 6), np.nan)
        distances[1, :2] = 5.0
        start = np.array([[1.0, 2.0, 3.0], [4.0, 4.0, 1.0]])
        found, _ = locate(ANCHORS.position_m, distances, start, 0.1)
        np.testing.assert_allclose(found[0], start[0])
        assert np.isfinite(found).all()

    @pytest.mark.parametrize("mirrored", [False, True])
    def test_a_partial_survey_fixes_the_frame(self, mirrored: bool) -> None:
        rng = np.random.default_rng(3)
        true = ANCHORS.position_m
        path = rng.uniform([0, 0, 0.3], [8, 8, 0.9], (50, 3))
        turn = Rotation.random(random_state=1).as_matrix() @ np.diag([1, 1, -1 if mirrored else 1])
        away = RigidMotion(turn, np.array([3.0, -2.0, 7.0]))
        survey = np.where(np.eye(6, 3, -3, dtype=bool), np.nan, true)
        survey[:3, :2] = true[:3, :2]
        survey[3:, :2] = np.nan
        motion = survey_frame(away(true), survey, away(path))
        np.testing.assert_allclose(motion(away(true)), true, atol=1e-3)


class TestCalibration:
    def test_anchors_are_found_without_any_survey(self, recording: RangeRecording) -> None:
        result = calibrate_ranges(recording, None, MODEL)
        assert result.rich_enough, result.verdict
        assert len(result.free_motions) == 6
        assert misplaced(result) < 0.1

    def test_random_seeds_find_one_constellation(self, recording: RangeRecording) -> None:
        for seed in range(1, 4):
            assert misplaced(calibrate_ranges(recording, None, MODEL, seed=seed)) < 0.1

    def test_survey_sets_the_frame(self, recording: RangeRecording) -> None:
        position = ANCHORS.position_m.copy()
        position[3:, :2] = np.nan
        result = calibrate_ranges(recording, Anchors(ANCHORS.ids, position), MODEL)
        assert result.free_motions == ()
        np.testing.assert_allclose(result.anchors.position_m, ANCHORS.position_m, atol=0.15)

    def test_offsets_and_trajectory_are_found(self, calibrated: RangeCalibration) -> None:
        expected = OFFSET_M + FACTS
        for node in range(1, 5):
            own = calibrated.offsets.offset_m[calibrated.offsets.node == node]
            np.testing.assert_allclose(own, expected, atol=0.06)
        inner = slice(5, -5)
        for node, positions in calibrated.modules.items():
            true = np.array([module(node, t) for t in calibrated.knot_t])
            error = np.linalg.norm(positions - true, axis=1)[inner]
            assert np.median(error) < 0.15

    def test_rods_keep_their_length(self, calibrated: RangeCalibration) -> None:
        np.testing.assert_allclose(calibrated.rod_length, ROD_M, atol=0.1)
        for (first, second), length in zip(calibrated.rods, calibrated.rod_length, strict=True):
            apart = calibrated.modules[first] - calibrated.modules[second]
            assert np.median(np.abs(np.linalg.norm(apart, axis=1) - length)) < 0.02

    @pytest.mark.parametrize("offsets", ["constant", "pair"])
    def test_every_offset_model_works(self, recording: RangeRecording, offsets: str) -> None:
        model = replace(MODEL, offsets=offsets)
        result = calibrate_ranges(recording, ANCHORS, model)
        spread = result.offsets.offset_m.std()
        assert spread < 1e-9 if offsets == "constant" else spread > 0.01
        assert misplaced(result) < 0.1

    def test_a_tenth_of_the_ranges_may_be_reflections(self, recording: RangeRecording) -> None:
        rng = np.random.default_rng(5)
        late = rng.random(len(recording)) < 0.1
        ranges = recording.range_m + late * rng.uniform(0.5, 5.0, len(recording))
        result = calibrate_ranges(replace(recording, range_m=ranges), None, MODEL)
        assert misplaced(result) < 0.2

    def test_untrusted_ranges_are_left_out(self, recording: RangeRecording) -> None:
        trusted = np.ones(len(recording), dtype=np.bool_)
        trusted[::3] = False
        ranges = np.where(trusted, recording.range_m, 250.0)
        result = calibrate_ranges(
            replace(recording, range_m=ranges), ANCHORS, MODEL, trusted=trusted
        )
        assert len(result.residuals.residual_m) == trusted.sum()
        assert misplaced(result) < 0.1

    def test_steps_without_time_are_enough(self) -> None:
        rng = np.random.default_rng(2)
        step = np.repeat(np.arange(120), 4 * len(ANCHORS))
        node = np.tile(np.repeat(np.arange(1, 5), len(ANCHORS)), 120)
        anchor = np.tile(np.arange(len(ANCHORS)), 4 * 120)
        moments = rng.permutation(120)  # no order in time
        at = np.array([module(int(n), 0.35 * moments[s]) for s, n in zip(step, node, strict=True)])
        ranges = np.linalg.norm(at - ANCHORS.position_m[anchor], axis=1) + OFFSET_M
        ranges += rng.normal(scale=NOISE_M, size=len(ranges))
        recording = RangeRecording(step, node, ANCHORS.ids[anchor], ranges, timed=False)
        assert misplaced(calibrate_ranges(recording, None, MODEL)) < 0.15

    def test_bfgs_reaches_the_same_with_a_survey(self) -> None:
        model = replace(MODEL, offsets="constant")
        result = calibrate_ranges(simulated(seconds=8.0), ANCHORS, model, solver="bfgs")
        assert result.solver == "bfgs"
        assert np.isnan(result.anchor_std).all()
        assert misplaced(result) < 0.2
        np.testing.assert_allclose(result.offsets.offset_m, OFFSET_M, atol=0.2)

    def test_ranges_are_predicted_from_others(
        self, recording: RangeRecording, calibrated: RangeCalibration
    ) -> None:
        errors = prediction_errors(
            recording, calibrated.anchors, calibrated.offsets, least_others=5, window_s=0.3
        )
        valid = errors[np.isfinite(errors)]
        assert len(valid) > 0.5 * len(recording)
        assert np.median(np.abs(valid)) < 0.15
        strict = prediction_errors(
            recording,
            calibrated.anchors,
            calibrated.offsets,
            least_others=5,
            window_s=0.3,
            other_anchors_only=True,
        )
        assert np.isfinite(strict).sum() < len(valid)

    def test_offsets_within_the_robot_are_found(self, recording: RangeRecording) -> None:
        rng = np.random.default_rng(8)
        t_ns = np.arange(0, 39 * 10**9, 10**8)
        node, other = rng.integers(1, 3, len(t_ns)), rng.integers(3, 5, len(t_ns))
        distance = [
            np.linalg.norm(module(int(a), t * 1e-9) - module(int(b), t * 1e-9))
            for a, b, t in zip(node, other, t_ns, strict=True)
        ]
        ranges = np.array(distance) + 4.2 + rng.normal(scale=NOISE_M, size=len(t_ns))
        ranges[::7] += 3.0  # reflections
        internal = InternalRanges(t_ns, node, other, ranges)
        result = calibrate_ranges(recording, ANCHORS, MODEL, internal=internal)
        found = result.internal_offsets
        assert set(zip(found.node.tolist(), found.anchor.tolist(), strict=True)) == {
            (1, 3),
            (1, 4),
            (2, 3),
            (2, 4),
        }
        np.testing.assert_allclose(found.offset_m, 4.2, atol=0.08)

    def test_progress_ends_at_one(self, recording: RangeRecording) -> None:
        fractions: list[float] = []
        calibrate_ranges(recording, ANCHORS, MODEL, progress=fractions.append)
        assert fractions == sorted(fractions)
        assert fractions[-1] == 1.0


class TestUncertainty:
    def test_covariance_is_that_of_repeated_recordings(self) -> None:
        """Normalised squared errors of anchors and offsets over 8 recordings with fresh noise."""
        survey = Anchors(ANCHORS.ids, ANCHORS.position_m.copy())
        survey.position_m[3:] = np.nan
        surveyed = np.repeat(survey.known[:, 0], 3)
        squared = []
        # The model's random walk stands for a smooth path; its noise is the simulated one.
        model = replace(MODEL, survey_std=0.001, knot_s=0.2, diffusion=0.3)
        for seed in range(8):
            result = calibrate_ranges(simulated(seed + 10), survey, model)
            error = (result.anchors.position_m - ANCHORS.position_m).ravel()[~surveyed]
            covariance = result.anchor_covariance[np.ix_(~surveyed, ~surveyed)]
            squared.append(error @ np.linalg.solve(covariance, error) / len(error))
        assert 0.5 < np.mean(squared) < 2.0

    def test_noise_of_the_survey_is_part_of_the_covariance(
        self, calibrated: RangeCalibration
    ) -> None:
        assert (calibrated.anchor_std < MODEL.survey_std).all()
        assert (calibrated.anchor_std > 0.1 * MODEL.survey_std).all()

    def test_a_still_robot_is_not_enough(self) -> None:
        recording = simulated(seconds=20.0)
        first = recording.elapsed < 1.0
        times = np.tile(recording.t_ns[first], 20) + np.repeat(
            np.arange(20) * 10**9, int(first.sum())
        )
        still = RangeRecording(
            times,
            np.tile(recording.node[first], 20),
            np.tile(recording.anchor[first], 20),
            np.tile(recording.range_m[first], 20),
        )
        try:
            result = calibrate_ranges(still, None, MODEL)
        except InputError:
            return
        assert not result.rich_enough

    def test_an_anchor_that_is_seen_from_one_side_only_is_named(self) -> None:
        """Anchor 13 answers only module 1 on a short way: its direction is open."""
        recording = simulated()
        kept = (recording.anchor != 13) | ((recording.node == 1) & (recording.elapsed < 6))
        result = calibrate_ranges(recording.where(kept), None, MODEL)
        assert not result.rich_enough
        assert "anchor 13 is not determined" in result.verdict

    def test_rival_constellations_are_told(self, shared_data: Path) -> None:
        """Four anchors and a robot that hardly moves: seeds disagree, and the verdict says so."""
        recording = read_ranges(shared_data / "superball" / "rolling_indoor")
        result = calibrate_ranges(recording, None)
        assert not result.rich_enough
        assert "another constellation fits about as well" in result.verdict


class TestBadInput:
    def test_unlisted_anchor(self, recording: RangeRecording) -> None:
        listed = Anchors(ANCHORS.ids[1:], ANCHORS.position_m[1:])
        with pytest.raises(InputError, match="anchor 13 was ranged but is not listed"):
            calibrate_ranges(recording, listed, MODEL)

    def test_anchor_nobody_ranged(self, recording: RangeRecording) -> None:
        kept = recording.where(recording.anchor != 15)
        with pytest.raises(InputError, match="nobody ranged anchor 15"):
            calibrate_ranges(kept, ANCHORS, MODEL)

    def test_too_few_anchors(self, recording: RangeRecording) -> None:
        kept = recording.where(recording.anchor < 16)
        with pytest.raises(InputError, match="3 anchors are too few"):
            calibrate_ranges(kept, None, MODEL)

    def test_too_few_ranges(self, recording: RangeRecording) -> None:
        few = recording.where((recording.anchor != 14) | (np.cumsum(recording.anchor == 14) < 4))
        with pytest.raises(InputError, match="3 ranges of anchor 14 are too few"):
            calibrate_ranges(few, None, MODEL)

    def test_parts_that_nothing_connects(self, recording: RangeRecording) -> None:
        kept = recording.where((recording.node <= 2) == (recording.anchor <= 15))
        with pytest.raises(InputError, match=r"2 parts.*modules 1, 2 with anchors 13, 14, 15"):
            calibrate_ranges(kept, None, MODEL)

    def test_nothing_measured_together(self, recording: RangeRecording) -> None:
        scattered = replace(recording, t_ns=np.arange(len(recording)), timed=False)
        with pytest.raises(InputError, match="no three anchors"):
            calibrate_ranges(scattered, None, MODEL)

    def test_module_on_both_sides(self, recording: RangeRecording) -> None:
        with pytest.raises(InputError, match="in both columns"):
            calibrate_ranges(replace(recording, node=recording.node + 12), None, MODEL)

    def test_no_trust_in_anything(self, recording: RangeRecording) -> None:
        with pytest.raises(InputError, match="no range is trusted"):
            calibrate_ranges(recording, None, MODEL, trusted=np.zeros(len(recording), dtype=bool))


class TestDirectory:
    def test_calibration_is_read_back(self, tmp_path: Path, calibrated: RangeCalibration) -> None:
        write_calibration(tmp_path / "calibration", calibrated, figures=False)
        again = read_calibration(tmp_path / "calibration")
        np.testing.assert_allclose(
            again.anchors.position_m, calibrated.anchors.position_m, rtol=1e-7
        )
        np.testing.assert_allclose(again.offsets.offset_m, calibrated.offsets.offset_m, rtol=1e-7)
        assert again.report["verdict"] == calibrated.verdict
        assert again.report["statistics"]["ranges"] == len(calibrated.residuals.residual_m)

    def test_unsolved_anchors_are_refused(self, tmp_path: Path) -> None:
        write_anchors(
            tmp_path / "anchors.csv", Anchors(np.array([13]), np.array([[1.0, np.nan, 2.0]]))
        )
        write_offsets(
            tmp_path / "offsets.csv", Offsets(np.array([1]), np.array([13]), np.array([4.0]))
        )
        with pytest.raises(InputError, match="anchor 13 has no position"):
            read_calibration(tmp_path)

    def test_command_writes_all_files(self, tmp_path: Path, recording: RangeRecording) -> None:
        pytest.importorskip("matplotlib")
        write_ranges(tmp_path / "ranges.csv", recording)
        write_anchors(tmp_path / "anchors.csv", ANCHORS)
        arguments = ["calibrate", str(tmp_path), "--anchors", str(tmp_path / "anchors.csv")]
        arguments += ["--out", str(tmp_path / "out"), "--attempts", "1", "--end", "30"]
        ran = CliRunner().invoke(app, arguments)
        assert ran.exit_code == 0, ran.output
        assert "verdict: " in ran.output
        names = {file.name for file in (tmp_path / "out").iterdir()}
        assert names == {
            "anchors.csv",
            "offsets.csv",
            "calibration.json",
            "residuals.png",
            "constellation.png",
        }
        report = json.loads((tmp_path / "out" / "calibration.json").read_text())
        assert report["solver"] == "lm"
        again = CliRunner().invoke(app, arguments)
        assert again.exit_code == 2

    def test_command_refuses_a_scale_of_nothing(self, tmp_path: Path) -> None:
        arguments = ["calibrate", str(tmp_path), "--out", str(tmp_path / "out")]
        ran = CliRunner().invoke(app, [*arguments, "--loss-scale", "0"])
        assert ran.exit_code == 2
        assert not (tmp_path / "out").exists()


class TestRealRecordings:
    def test_building45_predicts_later_ranges(self, shared_data: Path) -> None:
        folder = shared_data / "superball" / "building45"
        recording, survey = read_ranges(folder), read_anchors(folder)
        result = calibrate_ranges(recording.between(0, 100), survey)
        later = recording.between(100, np.inf)
        error = prediction_errors(later, result.anchors, result.offsets)
        median, most = np.percentile(np.abs(error[np.isfinite(error)]), (50, 90))
        assert median < 0.13
        assert most < 0.55
        known = survey.known
        error_m = np.abs(result.anchors.position_m - survey.position_m)[known]
        assert error_m.max() < 0.2

    def test_outdoor_finds_surveyed_distances_without_survey(self, shared_data: Path) -> None:
        folder = shared_data / "superball" / "outdoor"
        survey = read_anchors(folder)
        result = calibrate_ranges(read_ranges(folder), None, seed=1)
        apart = {}
        for i, j in ((14, 15), (14, 16), (15, 16)):
            true = np.linalg.norm((survey.position(i) - survey.position(j))[:2])
            found = np.linalg.norm(result.anchors.position(i) - result.anchors.position(j))
            apart[i, j] = found - true
        assert max(map(abs, apart.values())) < 0.3, apart
