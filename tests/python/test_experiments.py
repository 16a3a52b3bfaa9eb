"""Tracking and the repeated experiments, end to end from the command line and as functions."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tensegrity.cli import app
from tensegrity.experiments.superball import Outcome, Setting, run_experiment
from tensegrity.ranging.sequence import read_sequence, write_sequence
from tensegrity.simulation.superball import Experiment

pytest.importorskip("mujoco")
DURATION_S = 10.0


@pytest.fixture(scope="module")
def outcomes() -> list[Outcome]:
    return run_experiment(Experiment.ROLLING, list(Setting), 0, DURATION_S)


def by_setting(outcomes: list[Outcome], setting: Setting) -> Outcome:
    return next(outcome for outcome in outcomes if outcome.setting is setting)


def test_settings_take_away_what_they_say(outcomes: list[Outcome]) -> None:
    full = by_setting(outcomes, Setting.FULL)
    assert full.sequence.motors is not None
    without = by_setting(outcomes, Setting.NO_IMU).track.health
    assert without.inclinations_used == 0 < full.track.health.inclinations_used
    fewer = by_setting(outcomes, Setting.FOUR_ANCHORS).track.health
    assert fewer.ranges_used < full.track.health.ranges_used


def test_all_settings_of_ours_find_the_robot(outcomes: list[Outcome]) -> None:
    for setting in (Setting.FULL, Setting.NO_IMU, Setting.CONSTANT_OFFSET, Setting.FOUR_ANCHORS):
        outcome = by_setting(outcomes, setting)
        assert outcome.settled.centre_of_mass_rmse < 0.25, setting
    assert by_setting(outcomes, Setting.FULL).found_face


def test_errors_count_from_when_the_filter_has_settled(outcomes: list[Outcome]) -> None:
    outcome = outcomes[0]
    late = outcome.settled.t_ns[0] - outcome.sequence.ranges.t_ns[0]
    assert late >= 5_000_000_000
    assert len(outcome.settled.nodes) < len(outcome.errors.nodes)


def test_track_writes_what_it_estimated(outcomes: list[Outcome], tmp_path: Path) -> None:
    write_sequence(outcomes[0].sequence, tmp_path / "rolling")
    recording = read_sequence(tmp_path / "rolling")
    arguments = ["track", str(tmp_path / "rolling"), "--out", str(tmp_path / "run")]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    metrics = json.loads((tmp_path / "run" / "metrics.json").read_text())
    assert metrics["centre_of_mass_rmse_m"] < 0.25
    assert metrics["ranges_used"] > 1000
    with (tmp_path / "run" / "endcaps.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0][:2] == ["t_ns", "q_1_x"]
    assert len(rows[0]) == 1 + 3 * len(recording.net.nodes)
    assert np.isfinite(np.array(rows[1:], dtype=float)).all()
    assert (tmp_path / "run" / "path.png").stat().st_size > 1000
    again = CliRunner().invoke(app, arguments)
    assert again.exit_code == 2


def test_a_recording_with_unknown_anchors_is_refused(
    outcomes: list[Outcome], tmp_path: Path
) -> None:
    write_sequence(outcomes[0].sequence, tmp_path / "rolling")
    anchors = tmp_path / "rolling" / "anchors.csv"
    lines = anchors.read_text().splitlines()
    lines[1] = lines[1].split(",")[0] + ",,,"
    anchors.write_text("\n".join(lines) + "\n")
    result = CliRunner().invoke(app, ["track", str(tmp_path / "rolling")])
    assert result.exit_code == 2
    assert "tensegrity calibrate" in result.output
