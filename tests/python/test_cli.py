"""The commands from the outside: what they print and write, and their exit codes."""

from __future__ import annotations

import dataclasses
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from helpers.sequences import make_sequence
from helpers.trajectories import true_trajectory
from malformed import MALFORMED_CONFIGS, MALFORMED_SEQUENCES, MalformedSequence, MalformedYaml
from tensegrity import evaluation
from tensegrity.cli import app, demo, evaluate
from tensegrity.config import FilterConfig
from tensegrity.errors import MissingExtraError
from tensegrity.run import read_run, write_run
from tensegrity.sequence import read, write
from tensegrity.simulation import Manoeuvre, SimulationOptions

pytest.importorskip("evo", reason="evaluation needs the 'viz' extra")
pytest.importorskip("mujoco", reason="simulation needs the 'sim' extra")

COMMANDS = ("demo", "simulate", "estimate", "evaluate", "compare", "config", "version")


def tensegrity(*arguments: str | Path) -> Result:
    return CliRunner().invoke(
        app, [str(argument) for argument in arguments], prog_name="tensegrity"
    )


def assert_bad_input(result: Result, *says: str) -> None:
    """Exit code 2 and one line on stderr that says what is wrong."""
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert result.stderr.startswith("error: ")
    assert result.stderr.count("\n") == 1
    for text in says:
        assert text in result.stderr


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four seconds of a robot at rest, with truth."""
    path = tmp_path_factory.mktemp("recordings") / "forward"
    write(make_sequence(4.0, name="forward"), path)
    return path


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drawing takes seconds; tests about something else go without."""
    monkeypatch.setattr("tensegrity.cli.evaluate.save_figures", lambda *_: [])


@pytest.fixture
def run(recording: Path, tmp_path: Path) -> Path:
    """A run whose estimate is the truth."""
    sequence = read(recording)
    path = tmp_path / "run"
    write_run(
        true_trajectory(sequence),
        path,
        sequence=recording,
        robot=sequence.robot,
        config=FilterConfig.load("full"),
    )
    return path


# --- help and usage -----------------------------------------------------------------------------


def test_help_lists_all_commands() -> None:
    for arguments in ((), ("--help",), ("-h",)):
        result = tensegrity(*arguments)
        assert result.exit_code == 0
        for command in COMMANDS:
            assert re.search(rf"^  {command} ", result.stdout, re.MULTILINE)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_an_example_that_is_the_command(command: str) -> None:
    result = tensegrity(command, "--help")
    assert result.exit_code == 0
    assert f"Example: tensegrity {command}" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["demonstrate"], "no command 'demonstrate'"),
        (["demoo"], "did you mean 'demo'?"),
        (["--fast"], "No such option: --fast (see 'tensegrity --help')"),
        (["simulate", "forward"], "Missing option '--out' (see 'tensegrity simulate --help')"),
        (["simulate", "forward", "--out", "x", "--friction", "wet"], "'--friction'"),
        (["simulate", "forward", "--out", "x", "--imu-sampling", "mean"], "'--imu-sampling'"),
        (["estimate"], "Missing argument"),
        (["estimate", "x", "--method", "best"], "'--method'"),
        (["compare"], "Missing argument"),
        (["demo", "--seed", "-1"], "'--seed'"),
    ],
)
def test_bad_usage(arguments: list[str], says: str) -> None:
    assert_bad_input(tensegrity(*arguments), says)


def test_version() -> None:
    result = tensegrity("version")
    assert result.exit_code == 0
    assert result.stdout.startswith("tensegrity ")


# --- config -------------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", ["paper", "full"])
def test_config_prints_what_loads_back(profile: str, tmp_path: Path) -> None:
    result = tensegrity("config", profile)
    assert result.exit_code == 0
    printed = tmp_path / "mine.yaml"
    printed.write_text(result.stdout)
    assert FilterConfig.load(printed) == FilterConfig.load(profile)
    assert tensegrity("config", printed).stdout == result.stdout


@pytest.mark.parametrize("case", MALFORMED_CONFIGS, ids=lambda case: case.name)
def test_malformed_config(case: MalformedYaml, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(case.text)
    where = f"{path}:{case.line}" if case.line else str(path)
    fields = [f"field '{case.field}'"] if case.field else []
    assert_bad_input(tensegrity("config", path), where, case.says, *fields)


# --- estimate -----------------------------------------------------------------------------------


@pytest.mark.parametrize("case", MALFORMED_SEQUENCES, ids=lambda case: case.name)
def test_malformed_recording(case: MalformedSequence, sequence_path: Path, tmp_path: Path) -> None:
    case.apply(sequence_path)
    file = sequence_path / case.file if case.file else sequence_path
    where = f"{file}:{case.line}:" if case.line else f"{file}:"
    fields = [f"field '{case.field}'"] if case.field else []
    run = tmp_path / "run"
    assert_bad_input(tensegrity("estimate", sequence_path, "--out", run), where, case.says, *fields)
    assert not run.exists()


@pytest.mark.usefixtures("no_figures")
def test_estimate_writes_a_run_and_evaluates_it(recording: Path, tmp_path: Path) -> None:
    out = tmp_path / "runs" / "forward"
    result = tensegrity("estimate", recording, "--out", out, "--method", "paper")
    assert result.exit_code == 0, result.output
    assert "T Table II (forward)" in result.stdout
    opened = read_run(out)
    assert opened.info.filter == FilterConfig.load("paper")
    assert Path(opened.info.sequence) == recording
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["method"] == "paper"
    assert metrics["endcap_rmse_m"] < 0.02  # exact measurements of a robot at rest


def test_estimate_without_truth_is_not_evaluated(recording: Path, tmp_path: Path) -> None:
    for file in ("imu.csv", "cables.csv", "contacts.csv"):
        (tmp_path / "blind").mkdir(exist_ok=True)
        (tmp_path / "blind" / file).write_bytes((recording / file).read_bytes())
    result = tensegrity("estimate", tmp_path / "blind", "--out", tmp_path / "run")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "run" / "trajectory.tum").is_file()
    assert not (tmp_path / "run" / "metrics.json").exists()


def test_estimate_without_the_viz_extra_keeps_the_run(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(*_: object) -> None:
        raise MissingExtraError("evaluation", "viz")

    monkeypatch.setattr("tensegrity.cli.estimate.evaluate_run", missing)
    result = tensegrity("estimate", recording, "--out", tmp_path / "run")
    assert result.exit_code == 0, result.output
    assert "not evaluated: evaluation needs the 'viz' extra" in result.stderr
    assert (tmp_path / "run" / "trajectory.tum").is_file()


@pytest.mark.usefixtures("no_figures")
def test_estimate_names_its_run_after_recording_and_method(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert tensegrity("estimate", recording).exit_code == 0
    assert (tmp_path / "runs" / "forward-full" / "metrics.json").is_file()


@pytest.mark.usefixtures("no_figures")
def test_a_run_is_replaced_only_on_request(recording: Path, run: Path) -> None:
    before = (run / "config.yaml").read_text()
    arguments = ("estimate", recording, "--out", run, "--method", "paper")
    assert_bad_input(tensegrity(*arguments), str(run), "--overwrite")
    assert (run / "config.yaml").read_text() == before
    assert tensegrity(*arguments, "--overwrite").exit_code == 0
    assert read_run(run).info.filter.settings.method == "paper"


@pytest.mark.parametrize("command", ["estimate", "simulate"])
def test_a_directory_of_something_else_is_never_replaced(
    command: str, recording: Path, tmp_path: Path
) -> None:
    precious = tmp_path / "home" / "thesis.tex"
    precious.parent.mkdir()
    precious.write_text("\\title{}")
    first = recording if command == "estimate" else "forward"
    result = tensegrity(command, first, "--out", precious.parent, "--overwrite")
    assert_bad_input(result, str(precious.parent), "will not be overwritten")
    assert precious.read_text() == "\\title{}"
    assert_bad_input(tensegrity(command, first, "--out", precious), "is a file")


def test_config_and_method_have_to_agree(recording: Path, tmp_path: Path) -> None:
    result = tensegrity(
        "estimate", recording, "--out", tmp_path / "r", "--config", "paper", "--method", "full"
    )
    assert_bad_input(result, "field 'settings.method'", "--method asks for 'full'")


def test_unknown_robot(recording: Path, tmp_path: Path) -> None:
    result = tensegrity("estimate", recording, "--out", tmp_path / "r", "--robot", "prism4")
    assert_bad_input(result, "'prism4'", "prism3")


# --- simulate and demo --------------------------------------------------------------------------

SHORT = ("--path-length", "0.3", "--still-start", "2.5", "--still-end", "0.5")


def test_simulate_writes_a_recording_and_how_it_was_made(tmp_path: Path) -> None:
    out = tmp_path / "slippery"
    result = tensegrity(
        "simulate", "left-turn", "--out", out, *SHORT, "--friction", "0.6", "--seed", "4"
    )
    assert result.exit_code == 0, result.output
    sequence = read(out)
    assert sequence.duration_s > 3.0
    assert sequence.groundtruth is not None
    made = (out / "simulation.yaml").read_text()
    for line in ("manoeuvre: left-turn", "  friction: 0.6 ", "  seed: 4 ", "  path_length: 0.3 "):
        assert f"{line}" in made


def test_simulate_has_an_option_for_everything_that_can_be_simulated() -> None:
    text = tensegrity("simulate", "--help").stdout
    for name, info in SimulationOptions.model_fields.items():
        assert f"--{name.replace('_', '-')} " in text, name
        words = str(info.description).split()
        assert " ".join(words[1:4]) in " ".join(text.split()), name


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--friction", "7"], "field 'friction'"),
        (["--slope", "-3"], "field 'slope'"),
        (["--cable-offsets", "0.01"], "field 'cable_offsets'"),
        (["--robot", "prism4"], "'prism4'"),
    ],
)
def test_simulate_says_what_is_impossible(arguments: list[str], says: str, tmp_path: Path) -> None:
    out = tmp_path / "recording"
    assert_bad_input(tensegrity("simulate", "forward", "--out", out, *arguments), says)
    assert not out.exists()


def test_demo_from_simulation_to_figures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(demo, "Manoeuvre", [Manoeuvre.FORWARD])
    monkeypatch.setattr(demo, "QUICK_PATH_M", 0.3)
    result = tensegrity("demo", "--quick", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    header = next(line for line in result.stdout.splitlines() if "metric" in line)
    assert header.index("paper") < header.index("full") < header.index("T Table II")
    for path in (
        "recordings/forward/imu.csv",
        "runs/forward-paper/metrics.json",
        "runs/forward-full/metrics.json",
        "figures/forward/pose.png",
        "figures/forward/cable_lengths.png",
    ):
        assert (tmp_path / path).is_file(), path
    assert str(tmp_path / "figures") in result.stdout


def test_demo_uses_a_recording_again_that_was_made_the_same_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(demo, "save_figures", lambda *_: [])
    task = demo.Task(Manoeuvre.FORWARD, seed=0, path_length=0.3, directory=tmp_path)
    recorded, estimated = (
        tmp_path / "recordings" / "forward" / "imu.csv",
        tmp_path / "runs" / "forward-full" / "state.csv",
    )

    def run(task: demo.Task) -> tuple[int, int]:
        assert set(task.run(lambda _: None)) == {"paper", "full"}
        return recorded.stat().st_mtime_ns, estimated.stat().st_mtime_ns

    first, again = run(task), run(task)
    assert again[0] == first[0]
    assert again[1] > first[1]
    other_seed = run(dataclasses.replace(task, seed=1))
    assert other_seed[0] > again[0]


# --- evaluate and compare -----------------------------------------------------------------------


def test_evaluate_prints_and_writes(run: Path) -> None:
    result = tensegrity("evaluate", run)
    assert result.exit_code == 0, result.output
    assert "aligned by initial pose" in result.stdout
    assert json.loads((run / "metrics.json").read_text())["ate_rmse_m"] < 1e-6
    assert (run / "figures" / "cable_lengths.png").is_file()
    assert (run / "figures" / "consistency.png").is_file()


@pytest.mark.usefixtures("no_figures")
def test_evaluate_judges_the_covariances(recording: Path, tmp_path: Path) -> None:
    sequence = read(recording)
    truth = true_trajectory(sequence)
    creeping = truth.position.copy()
    creeping[:, 0] += 0.01e-9 * truth.t_ns  # 1 cm/s, the estimate's standard deviation
    poses = dataclasses.replace(sequence.groundtruth, position=creeping)
    write(dataclasses.replace(sequence, groundtruth=poses), tmp_path / "moving")
    write_run(
        dataclasses.replace(truth, cable_nis=1.0 + 0.5 * (-1.0) ** np.arange(len(truth.t_ns))),
        tmp_path / "run",
        sequence=tmp_path / "moving",
        robot=sequence.robot,
        config=FilterConfig.load("full"),
    )
    result = tensegrity("evaluate", tmp_path / "run")
    assert result.exit_code == 0, result.output

    def printed(label: str) -> str:
        row = next(line for line in result.stdout.splitlines() if label in line)
        return row.split("│")[3].strip()

    metrics = json.loads((tmp_path / "run" / "metrics.json").read_text())
    assert printed("NEES of position, mean") == f"{metrics['nees_position_mean']:.2f}"
    assert printed("NEES of velocity, median") == "0.33"  # one of three axes
    assert printed("NEES of velocity, in 95 % band") == "100"
    assert printed("NIS of cables, mean") == "1.00"
    assert printed("NIS of ground, mean") == "–"


@pytest.mark.usefixtures("no_figures")
def test_evaluate_aligns_heading_only(run: Path) -> None:
    result = tensegrity("evaluate", run, "--yaw-only")
    assert "aligned by initial yaw" in result.stdout
    assert json.loads((run / "metrics.json").read_text())["alignment"] == "yaw"


@pytest.mark.usefixtures("no_figures")
def test_evaluate_against_another_recording(run: Path, recording: Path, tmp_path: Path) -> None:
    moved = tmp_path / "backward"
    write(read(recording), moved)
    result = tensegrity("evaluate", run, "--truth", moved)
    assert "T Table II (backward)" in result.stdout


def test_evaluate_when_the_recording_is_gone(recording: Path, tmp_path: Path) -> None:
    sequence = read(recording)
    write_run(
        true_trajectory(sequence),
        tmp_path / "run",
        sequence=tmp_path / "gone",
        robot=sequence.robot,
        config=FilterConfig.load("full"),
    )
    assert_bad_input(tensegrity("evaluate", tmp_path / "run"), "gone", "--truth")


def test_evaluate_what_is_not_a_run(tmp_path: Path) -> None:
    assert_bad_input(tensegrity("evaluate", tmp_path / "nothing"), "no such run")


def test_compare_side_by_side_with_figures(run: Path, recording: Path, tmp_path: Path) -> None:
    sequence = read(recording)
    other = tmp_path / "other"
    write_run(
        true_trajectory(sequence),
        other,
        sequence=recording,
        robot=sequence.robot,
        config=FilterConfig.load("paper"),
    )
    for path in (run, other):
        evaluation.evaluate(read_run(path).trajectory, sequence).save(path / "metrics.json")
    result = tensegrity("compare", run, other, "--figures", tmp_path / "figures")
    assert result.exit_code == 0, result.output
    header = next(line for line in result.stdout.splitlines() if "metric" in line)
    assert header.index(" run ") < header.index(" other ") < header.index("T Table II")
    assert (tmp_path / "figures" / "forward" / "top_view.png").is_file()


def test_compare_does_not_draw_different_recordings_together(
    run: Path, recording: Path, tmp_path: Path
) -> None:
    namesake = tmp_path / "elsewhere" / "forward"
    write(read(recording), namesake)
    sequence = read(namesake)
    other = tmp_path / "other"
    write_run(
        true_trajectory(sequence),
        other,
        sequence=namesake,
        robot=sequence.robot,
        config=FilterConfig.load("full"),
    )
    for path in (run, other):
        evaluation.evaluate(read_run(path).trajectory, sequence).save(path / "metrics.json")
    assert tensegrity("compare", run, other).exit_code == 0
    result = tensegrity("compare", run, other, "--figures", tmp_path / "figures")
    assert result.exit_code == 2
    assert "different recordings" in result.stderr
    assert not (tmp_path / "figures").exists()


def test_compare_needs_metrics(run: Path) -> None:
    assert_bad_input(tensegrity("compare", run), "metrics.json", "tensegrity evaluate")


def test_compare_a_run_with_itself(run: Path) -> None:
    assert_bad_input(tensegrity("compare", run, run), "named twice")


# --- extras -------------------------------------------------------------------------------------


def test_without_mujoco_simulate_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    result = tensegrity("simulate", "forward", "--out", tmp_path / "r")
    assert_bad_input(result, "needs the 'sim' extra", "pip install 'tensegrity-estimation[sim]'")
    assert not (tmp_path / "r").exists()


@pytest.mark.parametrize("module", ["evo.core.metrics", "matplotlib"])
def test_without_evo_or_matplotlib_evaluate_names_the_extra(
    module: str, run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    result = tensegrity("evaluate", run)
    assert result.exit_code == 2
    assert "needs the 'viz' extra" in result.stderr


# --- failures -----------------------------------------------------------------------------------


@pytest.fixture
def broken_evaluation(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(evaluate, "evaluate_run", fail)


@pytest.mark.usefixtures("broken_evaluation")
def test_an_internal_failure_is_one_line_and_exit_code_1(run: Path) -> None:
    result = tensegrity("evaluate", run)
    assert result.exit_code == 1
    assert "internal failure, ZeroDivisionError: a bug" in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.usefixtures("broken_evaluation")
def test_debug_lets_the_exception_through(run: Path) -> None:
    result = tensegrity("--debug", "evaluate", run)
    assert result.exit_code == 1
    assert isinstance(result.exception, ZeroDivisionError)


def in_a_process(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    program = "from tensegrity.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
    )


def test_process_exit_codes_and_no_traceback(tmp_path: Path) -> None:
    good = in_a_process("config", "paper")
    assert good.returncode == 0
    assert good.stdout == FilterConfig.load("paper").to_yaml()
    bad = in_a_process("estimate", tmp_path / "nothing", "--out", tmp_path / "run")
    assert bad.returncode == 2
    assert bad.stderr == f"error: {tmp_path / 'nothing'}: no such sequence (check the path)\n"
    debug = in_a_process("--debug", "estimate", tmp_path / "nothing", "--out", tmp_path / "run")
    assert debug.returncode == 1
    assert "Traceback" in debug.stderr


def test_closed_output_is_no_error() -> None:
    program = f"{sys.executable} -c 'from tensegrity.cli import main; main()' config full | head -1"
    result = subprocess.run(["bash", "-c", program], capture_output=True, text=True, check=False)
    assert "Traceback" not in result.stderr
    assert "error" not in result.stderr
