"""What a run of the benchmarks leaves: `results.json`, read by `report.py`."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

RESULTS = Path(__file__).with_name("results.json")


Repetitions = list[tuple[float, float]]
"""Of one case: time per call, a mean of many calls, and how long a fixed piece of work took before
or after it, whichever was longer: the gauge [ns]."""

ALONE = 1.15
"""A repetition had its core for itself where its gauge is at most so many times the least of the
run. A second thread on the core lengthens the gauge by 1.3 or more, the clock by up to a tenth."""


def least_gauge(cases: Iterable[Repetitions]) -> float:
    return min(gauge for repetitions in cases for _, gauge in repetitions)


def split(repetitions: Repetitions, least: float) -> tuple[list[float], list[float]]:
    """Times of the repetitions that had their core for themselves, and of the others."""
    alone = [time for time, gauge in repetitions if gauge <= ALONE * least]
    others = [time for time, gauge in repetitions if gauge > ALONE * least]
    return alone, others


@dataclass(frozen=True)
class Timing:
    """Time per call over the repetitions that had their core for themselves [ns]; over all of them
    where none had."""

    median_ns: float
    min_ns: float
    max_ns: float
    repetitions: int
    alone: int
    """So many of the repetitions had their core for themselves."""
    disturbed_ns: float | None = None
    """Median of the others, if there are any."""
    bytes: int = 0
    """Heap that the case allocates before its first call, where that is of interest."""

    @staticmethod
    def of(repetitions: Repetitions, least: float, bytes_: int = 0) -> Timing:
        """``least``: gauge of the run."""
        alone, others = split(repetitions, least)
        times = alone or others
        return Timing(
            median_ns=median(times),
            min_ns=min(times),
            max_ns=max(times),
            repetitions=len(repetitions),
            alone=len(alone),
            disturbed_ns=median(others) if others else None,
            bytes=bytes_,
        )


@dataclass
class Results:
    """One run on one machine."""

    machine: dict[str, str] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    commands: list[str] = field(default_factory=list)
    """How the programs of `cpp` were called, to time and to count."""
    recordings: dict[str, dict[str, float]] = field(default_factory=dict)
    """``samples`` of the IMU and ``duration_s`` by name."""
    times: dict[str, Timing] = field(default_factory=dict)
    cycles: dict[str, dict[str, float]] = field(default_factory=dict)
    """``median_ns`` and ``worst_ns`` of single cycles by case."""
    instructions: dict[str, float] = field(default_factory=dict)
    """Of one call, by case."""
    worst_instructions: dict[str, dict[str, float]] = field(default_factory=dict)
    """Of the worst ``imu``, ``contacts``, ``cables`` and ``cycle``, by case."""

    def write(self, path: Path = RESULTS) -> None:
        path.write_text(json.dumps(asdict(self), indent=1) + "\n", encoding="utf-8")

    @staticmethod
    def read(path: Path = RESULTS) -> Results:
        stored: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        stored["times"] = {name: Timing(**timing) for name, timing in stored["times"].items()}
        return Results(**stored)
