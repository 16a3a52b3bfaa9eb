"""How fast the estimator and its parts are on this machine.

    python benchmarks/estimator.py                       # on a simulated forward run
    python benchmarks/estimator.py recordings/monday

Prints median, least and greatest time over the repeats, beside the times that Tong et al. 2024 (T)
report for an i5-11400H. Everything is called from Python: times of a few microseconds contain some
tenths of one for the call. C++ alone is faster.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

import tensegrity
from tensegrity import _core
from tensegrity.errors import InputError
from tensegrity.estimation import core_robot
from tensegrity.sequence import Sequence
from tensegrity.simulation import SimulationOptions, simulate

Lengths = NDArray[np.float64]
"""Of the nine cables [m], (9,)."""

METHODS = ("paper", "full")
CABLE_STD = 0.002  # [m]
STEP_STD = 0.01  # of the shape between two cable samples of a rolling robot [m]
SHAPES = 1000  # samples of a repeat
IPOPT_SHAPES = 20

# T §VI: mean times per call [s].
PAPER_SHAPE, PAPER_PROPAGATION, PAPER_CORRECTION = 4.1e-3, 11.33e-6, 17.46e-6


@dataclass(frozen=True)
class Timing:
    """A line of the table; times per call [s], one per repeat."""

    name: str
    times: list[float]
    published: float | None = None

    def row(self) -> str:
        """As Markdown."""
        figures = (statistics.median(self.times), min(self.times), max(self.times))
        published = "" if self.published is None else duration(self.published)
        return f"| {self.name} | {' | '.join(map(duration, figures))} | {published} |"


def duration(seconds: float) -> str:
    """With three digits and a readable unit."""
    for scale, unit in ((1.0, "s"), (1e-3, "ms")):
        if seconds >= scale:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds / 1e-6:.3g} µs"


# --- whole recordings ---------------------------------------------------------------------------


def replay(sequence: Sequence, method: str, repeats: int) -> list[float]:
    """Times in the estimator for the whole recording [s]."""
    return [tensegrity.estimate(sequence, config=method).runtime_s for _ in range(repeats)]


@dataclass(frozen=True)
class Calls:
    """Mean times of calls from Python on a rolling robot [s]."""

    imu: float
    cables: float
    state: float


def stream(sequence: Sequence, method: str) -> Calls:
    """Feed a recording call by call; cables and contacts at stamps of the IMU, others are left out.

    Raises :class:`InputError` when no cables are left or the robot never stood still.
    """
    estimator = tensegrity.PrismEstimator(sequence.robot, method)
    spent: dict[str, list[int]] = {"imu": [], "cables": [], "state": []}
    started = False

    def timed(name: str, call: Callable[..., object], *arguments: object) -> None:
        before = time.perf_counter_ns()
        call(*arguments)
        after = time.perf_counter_ns()
        if started:
            spent[name].append(after - before)

    contacts = contacts_by_stamp(sequence)
    cables = dict(zip(sequence.cables.t_ns.tolist(), sequence.cables.lengths, strict=True))
    imu = sequence.imu
    for t, gyro, accel in zip(imu.t_ns.tolist(), imu.gyro, imu.accel, strict=True):
        # The IMU goes first at each stamp, so that `imu` only propagates.
        timed("imu", estimator.imu, t, gyro, accel)
        if t in contacts:
            estimator.contacts(t, contacts[t])
        if t in cables:
            timed("cables", estimator.cables, t, cables[t])
        timed("state", getattr, estimator, "state")
        started = estimator.initialized
    if not spent["cables"]:
        raise InputError(
            f"'{sequence.name}' has no cable samples at stamps of the IMU after its still start",
            hint="benchmark a simulated recording instead",
        )
    return Calls(**{name: statistics.fmean(times) * 1e-9 for name, times in spent.items()})


def contacts_by_stamp(sequence: Sequence) -> dict[int, NDArray[np.bool_]]:
    """Contact flags (6,) by stamp [ns]; none where the recording has none."""
    if sequence.contacts is None:
        return {}
    return dict(zip(sequence.contacts.t_ns.tolist(), sequence.contacts.flags, strict=True))


def estimator_timings(sequence: Sequence, repeats: int) -> Iterator[Timing]:
    """Whole recordings, and call by call."""
    samples = len(sequence.imu.t_ns)
    for method in METHODS:
        times = replay(sequence, method, repeats)
        factor = sequence.duration_s / statistics.median(times)
        yield Timing(f"`estimate`, {method}: the whole recording ({factor:.0f} × real time)", times)
        yield Timing(f"`estimate`, {method}: per IMU sample", [t / samples for t in times])
    for method in METHODS:
        calls = [stream(sequence, method) for _ in range(repeats)]
        yield Timing(f"`imu()`, {method}: propagation", [c.imu for c in calls], PAPER_PROPAGATION)
        yield Timing(
            f"`cables()`, {method}: shape and correction",
            [c.cables for c in calls],
            PAPER_SHAPE + PAPER_CORRECTION,
        )
    yield Timing("`state`", [c.state for c in calls])


# --- shape --------------------------------------------------------------------------------------


def shape_timings(sequence: Sequence, repeats: int) -> Iterator[Timing]:
    """Each solver on the lengths of the rolling robot."""
    robot = core_robot(sequence.robot)
    middle = len(sequence.cables.lengths) // 2
    lengths = sequence.cables.lengths[middle - SHAPES // 2 : middle + SHAPES // 2]

    solver = _core.ShapeSolver(robot)
    yield Timing("`ShapeSolver`, warm", per_call(solver.solve, lengths, repeats), PAPER_SHAPE)
    yield Timing("`ShapeSolver`, cold", per_call(cold(solver), lengths, repeats))

    tracker = _core.ShapeTracker(robot)
    tracker.reset(lengths[0], CABLE_STD)

    def track(sample: Lengths) -> None:
        tracker.predict(STEP_STD)
        tracker.correct(sample, CABLE_STD)

    yield Timing("`ShapeTracker`, predict and correct", per_call(track, lengths, repeats))

    if hasattr(_core, "IpoptShapeSolver"):
        reference = _core.IpoptShapeSolver(robot)
        few = lengths[:IPOPT_SHAPES]
        times = per_call(reference.solve, few, repeats)
        yield Timing("`IpoptShapeSolver`, warm", times, PAPER_SHAPE)
        yield Timing("`IpoptShapeSolver`, cold", per_call(cold(reference), few, repeats))


class Solver(Protocol):
    """What the shape solvers have in common; a build may lack Ipopt's."""

    def reset(self) -> None: ...
    def solve(self, lengths: Lengths) -> object: ...


def cold(solver: Solver) -> Callable[[Lengths], object]:
    """``solver.solve`` that does not start from the last solution."""

    def solve(sample: Lengths) -> object:
        solver.reset()
        return solver.solve(sample)

    return solve


def per_call(
    call: Callable[[Lengths], object], samples: NDArray[np.float64], repeats: int
) -> list[float]:
    """Mean time of a call over ``samples`` [s], ``repeats`` times."""
    means = []
    for _ in range(repeats):
        before = time.perf_counter()
        for sample in samples:
            call(sample)
        means.append((time.perf_counter() - before) / len(samples))
    return means


# --- command line -------------------------------------------------------------------------------


def processor() -> str:
    """Its name where the system tells."""
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recordings", nargs="*", type=Path, help="instead of a simulation")
    parser.add_argument("--repeats", type=int, default=7)
    args = parser.parse_args()
    sequences = [tensegrity.sequence.read(path) for path in args.recordings]
    if not sequences:
        sequences = [simulate("forward", SimulationOptions(seed=0))]

    print(
        f"tensegrity {tensegrity.__version__}, Python {platform.python_version()}, "
        f"{platform.platform()}\n{processor()}, {os.cpu_count()} cores\n"
        f"median, least and greatest of {args.repeats} repeats"
    )
    for sequence in sequences:
        print(f"\n{sequence.name}: {sequence.duration_s:.1f} s, {len(sequence.imu.t_ns)} samples\n")
        print("| | median | min | max | T, i5-11400H |\n|---|--:|--:|--:|--:|")
        for timings in (estimator_timings, shape_timings):
            for timing in timings(sequence, args.repeats):
                print(timing.row(), flush=True)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        raise SystemExit(f"error: {error}") from None
