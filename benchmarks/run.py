"""Builds and runs every timing benchmark: `results.json` and the page made from it.

    python benchmarks/run.py             # or: make bench
    python benchmarks/run.py --resume    # after an interruption: what has finished is not repeated

Times are CPU times; of each the median, least and greatest of the repetitions that had their core
for themselves (results.py). A program is run again while too few had. Instructions are counted by
callgrind, on the same programs.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import report
from callgrind import Counts, counts, worst_calls
from results import Repetitions, Results, Timing, least_gauge, split

import tensegrity.sequence
from tensegrity import _core
from tensegrity.simulation import SimulationOptions, simulate

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
RECORDINGS = {"forward": "forward", "right": "right-turn"}
"""Names of recordings, and the manoeuvres that replace them where there are none."""
RANGES = ("building45", "outdoor", "rolling_indoor")
# Short repetitions: whoever else runs on the core then slows down all of one or none. Calls of
# microseconds allow for many shorter than the turns in which a core is shared.
TIMING = ("--benchmark_repetitions=7", "--benchmark_min_time=0.03")
TIMING_SHORT = ("--benchmark_repetitions=40", "--benchmark_min_time=0.004")
INTERLEAVED = "--benchmark_enable_random_interleaving=true"
ENOUGH_ALONE, PATIENCE_S = 5, 20.0
"""A program is run again until of each case so many repetitions had the core, or so long."""
# Symbols are bound at the start, not by the first call that is counted.
COUNTING = (
    "env",
    "LD_BIND_NOW=1",
    "valgrind",
    "-q",
    "--tool=callgrind",
    "--callgrind-out-file=/dev/null",
)

COUNTED = ("filter", "tight", "shape", "contact", "dynamics", "unscented", "superball")
PROGRAMS = (*COUNTED, "cycle")
SHORT = ("filter", "tight", "shape", "contact")
"""Programs of calls of microseconds."""
WITH_RECORDINGS = ("shape", "contact", "cycle")
COUNTED_CYCLES = ("paper", "full")


@dataclass(frozen=True)
class Build:
    """Where things go, and the flags they are built with."""

    folder: Path
    march: str = "native"

    @property
    def flags(self) -> str:
        return f"-O3 -DNDEBUG -march={self.march}"

    def program(self, name: str) -> Path:
        return self.folder / "cmake" / "benchmarks" / "cpp" / name


def run(command: list[str], **options: Any) -> str:
    """Its output; a failure shows all of it and ends the run."""
    shown = " ".join(
        os.path.relpath(word, ROOT) if word.startswith("/") else word for word in command
    )
    print(f"$ {shown}", file=sys.stderr, flush=True)
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, **options)
    if done.returncode != 0:
        raise SystemExit(f"error: {shown}\n{done.stdout}{done.stderr}")
    return done.stdout


def build(where: Build) -> None:
    """All programs, in optimised C++."""
    folder = str(where.folder / "cmake")
    definitions = {
        "CMAKE_BUILD_TYPE": "Release",
        "CMAKE_CXX_FLAGS_RELEASE": where.flags,
        "TENSEGRITY_BUILD_BENCHMARKS": "ON",
    }
    run(["cmake", "-S", str(ROOT), "-B", folder, "-G", "Ninja",
         *(f"-D{name}={value}" for name, value in definitions.items())])  # fmt: skip
    jobs = os.environ.get("JOBS", str(os.cpu_count() or 1))
    run(["cmake", "--build", folder, "-j", jobs])


def recordings(folder: Path) -> list[Path]:
    """The shared recordings, or simulated ones in their place."""
    paths = []
    for name, manoeuvre in RECORDINGS.items():
        shared, simulated = DATA / "prism3" / name, folder / "recordings" / name
        if not shared.is_dir() and not simulated.is_dir():
            sequence = simulate(manoeuvre, SimulationOptions(seed=0))
            tensegrity.sequence.write(sequence, simulated)
        paths.append(shared if shared.is_dir() else simulated)
    return paths


# --- stages: each returns what is stored as JSON until the run is complete ----------------------


Measured = dict[str, Repetitions]


def repeat(
    program: Callable[[], tuple[Measured, dict[str, Any]]], before: Measured
) -> dict[str, Any]:
    """Repetitions by case of as many runs as needed, and what else the last one said. ``before``:
    what the run has measured by the same gauge."""
    measured: Measured = {}
    began = time.monotonic()
    while True:
        more, rest = program()
        for case, repetitions in more.items():
            measured.setdefault(case, []).extend(repetitions)
        least = least_gauge([*before.values(), *measured.values()])
        enough = all(len(split(case, least)[0]) >= ENOUGH_ALONE for case in measured.values())
        if enough or time.monotonic() - began > PATIENCE_S:
            return {"repetitions": measured, **rest}


def time_program(where: Build, name: str, paths: list[Path], before: Measured) -> dict[str, Any]:
    """Of a program in C++."""
    out = where.folder / f"{name}.google.json"

    def program() -> tuple[Measured, dict[str, Any]]:
        run([str(where.program(name)), *(map(str, paths) if name in WITH_RECORDINGS else ()),
             f"--benchmark_out={out}", "--benchmark_out_format=json", INTERLEAVED,
             *(TIMING_SHORT if name in SHORT else TIMING)])  # fmt: skip
        measured: Measured = {}
        heap: dict[str, int] = {}
        for case in json.loads(out.read_text(encoding="utf-8"))["benchmarks"]:
            if case["run_type"] != "iteration":
                continue
            if case["time_unit"] != "ns":
                raise RuntimeError(f"{case['name']}: expected nanoseconds, not {case['time_unit']}")
            repetition = (case["cpu_time"] / case["calls"], case["gauge"])
            measured.setdefault(case["run_name"], []).append(repetition)
            heap[case["run_name"]] = int(case["bytes"])
        return measured, {"heap": heap, "language": "C++"}

    return repeat(program, before)


def time_cycles(where: Build, paths: list[Path]) -> dict[str, Any]:
    """Median and worst of single cycles."""
    output = run([str(where.program("cycle")), *map(str, paths), "--each"])
    return {"cycles": json.loads(output)}


def time_python(name: str, paths: list[Path], before: Measured) -> dict[str, Any]:
    """Of a program in Python, with the versions of peers."""

    def program() -> tuple[Measured, dict[str, Any]]:
        output = run([sys.executable, str(ROOT / "benchmarks" / "python" / name), *map(str, paths)])
        handed_over = json.loads(output)
        return handed_over.pop("repetitions"), handed_over | {"language": "Python"}

    return repeat(program, before)


def count(where: Build, name: str, log: Path, *arguments: str) -> Counts:
    """What a program counts under callgrind."""
    program = [str(where.program(name)), *arguments, "--count"]
    return counts(log, run([*COUNTING, f"--log-file={log}", *program]))


def count_program(where: Build, name: str, paths: list[Path]) -> dict[str, Any]:
    """Instructions per call of each case."""
    log = where.folder / f"{name}.callgrind.log"
    arguments = map(str, paths) if name in WITH_RECORDINGS else ()
    return {"instructions": dict(count(where, name, log, *arguments))}


def count_cycles(where: Build, method: str, paths: list[Path]) -> dict[str, Any]:
    """Instructions of the worst calls of a method."""
    log = where.folder / f"cycle-{method}.callgrind.log"
    wanted = f"--benchmark_filter=^cycle/{method}/"
    return {"worst_instructions": worst_calls(count(where, "cycle", log, *map(str, paths), wanted))}


# --- machine ------------------------------------------------------------------------------------


def cpu_information(key: str) -> str:
    """A line of /proc/cpuinfo; empty where there is none."""
    information = Path("/proc/cpuinfo")
    text = information.read_text(encoding="utf-8") if information.is_file() else ""
    found = re.search(rf"^{key}\s*:\s*(.*)$", text, re.MULTILINE)
    return found[1].strip() if found else ""


def machine() -> dict[str, str]:
    return {
        "processor": cpu_information("model name") or platform.processor() or platform.machine(),
        "cores": str(os.cpu_count()),
        "system": platform.platform(),
    }


def load() -> str:
    return f"{os.getloadavg()[0]:.1f}"


def versions(where: Build, counting: Build) -> dict[str, str]:
    def first_line(*command: str) -> str:
        return run(list(command)).splitlines()[0]

    def debian(package: str) -> str:
        return run(["dpkg-query", "-W", "-f", "${Version}", package])

    return {
        "tensegrity": tensegrity.__version__,
        "commit": first_line("git", "describe", "--always", "--dirty"),
        "compiler": first_line("c++", "--version"),
        "flags": where.flags,
        "flags where instructions are counted": counting.flags,
        "Eigen": debian("libeigen3-dev"),
        "Google Benchmark": debian("libbenchmark-dev"),
        "Ipopt": debian("coinor-libipopt-dev"),
        "valgrind": debian("valgrind"),
        "Python": platform.python_version(),
        "Python module": _core.instruction_set(),
        "numpy": version("numpy"),
    }


# --- all of it ----------------------------------------------------------------------------------


class Stages:
    """Runs each stage once and keeps its result in a file, so that a run can be resumed."""

    def __init__(self, folder: Path, resume: bool) -> None:
        self._folder = folder / "stages"
        if not resume:
            shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir(parents=True, exist_ok=True)

    def run(self, name: str, stage: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        file = self._folder / f"{name}.json"
        if not file.is_file():
            result = stage()
            part = file.with_suffix(".part")
            part.write_text(json.dumps(result), encoding="utf-8")
            part.rename(file)
        stored: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        return stored


def measure(where: Build, resume: bool) -> Results:
    results = Results(machine())
    results.machine["load before"] = load()
    # valgrind does not know AVX-512.
    avx512 = "avx512f" in cpu_information("flags").split()
    counting = Build(where.folder / "x86-64-v3", "x86-64-v3") if avx512 else where
    for each in {where, counting}:
        each.folder.mkdir(parents=True, exist_ok=True)
        build(each)
    paths = recordings(where.folder)
    for path in paths:
        sequence = tensegrity.sequence.read(path)
        results.recordings[path.name] = {
            "samples": len(sequence.imu.t_ns),
            "duration_s": sequence.duration_s,
        }
    results.versions = versions(where, counting)
    results.commands = [
        " ".join(["PROGRAM [RECORDING...]", *TIMING, INTERLEAVED]),
        " ".join([f"{', '.join(SHORT)}:", *TIMING_SHORT, INTERLEAVED]),
        " ".join([*COUNTING, "PROGRAM [RECORDING...] --count"]),
    ]
    stages = Stages(where.folder, resume)

    # By language: each has its own gauge.
    measured: dict[str, Measured] = {"C++": {}, "Python": {}}
    heap: dict[str, int] = {}

    def keep(stored: dict[str, Any]) -> None:
        if "repetitions" in stored:
            measured[stored.pop("language")].update(stored.pop("repetitions"))
            heap.update(stored.pop("heap", {}))
        for part, values in stored.items():
            getattr(results, part).update(values)

    # Times one after the other, so that they do not disturb each other.
    for name in PROGRAMS:
        keep(
            stages.run(
                f"time-{name}",
                lambda name=name: time_program(where, name, paths, measured["C++"]),
            )
        )
    keep(stages.run("time-cycles", lambda: time_cycles(where, paths)))
    python = {"replay": paths, "peers": paths[-1:]}
    if ranges := [path for name in RANGES if (path := DATA / "superball" / name).is_dir()]:
        python["calibration"] = ranges
    for name, folders in python.items():
        keep(
            stages.run(
                f"time-{name}",
                lambda name=name, folders=folders: time_python(
                    f"{name}.py", folders, measured["Python"]
                ),
            )
        )
    results.machine["load after"] = load()
    for language, cases in measured.items():
        least = least_gauge(cases.values())
        # How fast the machine was: comparable from run to run.
        results.machine[f"least gauge, {language}"] = report.duration(least)
        for case, repetitions in cases.items():
            results.times[case] = Timing.of(repetitions, least, heap.get(case, 0))
    # Counts do not care.
    counting_stages: dict[str, Callable[[], dict[str, Any]]] = {
        **{
            f"count-cycles-{method}": lambda method=method: count_cycles(counting, method, paths)
            for method in COUNTED_CYCLES
        },
        **{
            f"count-{name}": lambda name=name: count_program(counting, name, paths)
            for name in COUNTED
        },
    }
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for stored in pool.map(stages.run, counting_stages.keys(), counting_stages.values()):
            keep(stored)
    return results


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--resume", action="store_true", help="keep what an earlier run measured")
    parser.add_argument("--build", type=Path, default=ROOT / "build" / "bench", metavar="FOLDER")
    arguments = parser.parse_args()
    started = datetime.datetime.now(datetime.UTC)
    results = measure(Build(arguments.build.resolve()), arguments.resume)
    results.machine["date"] = started.date().isoformat()
    results.write()
    page = report.page(results)
    report.PAGE.write_text(page, encoding="utf-8")
    print(page)


if __name__ == "__main__":
    main()
