"""What a run of the benchmarks leaves: `results.json`, read by `report.py`."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

RESULTS = Path(__file__).with_name("results.json")


@dataclass(frozen=True)
class Timing:
    """Time per call over the repetitions [ns], each a mean of many calls."""

    median_ns: float
    min_ns: float
    max_ns: float
    repetitions: int
    bytes: int = 0
    """Heap that the case allocates before its first call, where that is of interest."""

    @staticmethod
    def of(times: list[float], bytes_: int = 0) -> Timing:
        return Timing(median(times), min(times), max(times), len(times), bytes_)


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
