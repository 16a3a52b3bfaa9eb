"""Times of statements in CPU seconds of this process, and how programs hand them to ``run.py``.

CPU time leaves out what other processes take. Cases that are compared are repeated in turns, so
that a busy machine slows them alike.
"""

from __future__ import annotations

import json
import time
import timeit
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

REPEATS = 7


@dataclass(frozen=True)
class Case:
    """A statement to time. ``names`` are its variables; it stands for ``calls`` calls."""

    name: str
    statement: str
    names: dict[str, Any] = field(repr=False)
    calls: int = 1
    setup: str = "pass"


def measure(
    cases: Sequence[Case], repeats: int = REPEATS, least_s: float = 0.05
) -> dict[str, list[float]]:
    """Time per call of each case [ns], ``repeats`` means over at least ``least_s`` seconds."""
    timers = [
        timeit.Timer(case.statement, case.setup, time.process_time, case.names) for case in cases
    ]
    numbers = []
    for timer in timers:
        number = 1
        while (spent := timer.timeit(number)) < least_s / 4:
            number *= 4
        numbers.append(max(1, round(number * least_s / spent)))
    times: dict[str, list[float]] = {case.name: [] for case in cases}
    for _ in range(repeats):
        for case, timer, number in zip(cases, timers, numbers, strict=True):
            times[case.name].append(timer.timeit(number) / number / case.calls * 1e9)
    return times


def hand_over(times: dict[str, list[float]], versions: dict[str, str] | None = None) -> None:
    """Prints what ``run.py`` reads: times by name and the versions of the peers."""
    print(json.dumps({"times_ns": times, "versions": versions or {}}))
