"""Times of statements in CPU seconds of this process, and how programs hand them to ``run.py``.

CPU time leaves out what other processes take, but not that another thread on the same core slows
this one: a gauge beside each repetition shows it. Cases that are compared are repeated in turns, so
that a busy machine slows them alike.
"""

from __future__ import annotations

import json
import time
import timeit
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import median
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


Repetitions = list[tuple[float, float]]
"""Of one case: time per call and the gauge [ns], a pair a repetition."""

_NUMBERS = list(range(5000))


def gauge() -> float:
    """How long a fixed piece of work takes at this moment [ns]."""
    return median(timeit.repeat(lambda: sum(_NUMBERS), repeat=15, number=5)) * 1e9


def measure(
    cases: Sequence[Case], repeats: int = REPEATS, least_s: float = 0.05
) -> dict[str, Repetitions]:
    """Each case ``repeats`` times, in means over at least ``least_s`` seconds."""
    timers = [
        timeit.Timer(case.statement, case.setup, time.process_time, case.names) for case in cases
    ]
    numbers = []
    for timer in timers:
        number = 1
        while (spent := timer.timeit(number)) < least_s / 4:
            number *= 4
        numbers.append(max(1, round(number * least_s / spent)))
    measured: dict[str, Repetitions] = {case.name: [] for case in cases}
    for _ in range(repeats):
        for case, timer, number in zip(cases, timers, numbers, strict=True):
            before = gauge()
            spent = timer.timeit(number) / number / case.calls * 1e9
            measured[case.name].append((spent, max(before, gauge())))
    return measured


def hand_over(measured: dict[str, Repetitions], versions: dict[str, str] | None = None) -> None:
    """Prints what ``run.py`` reads: repetitions by name and the versions of the peers."""
    print(json.dumps({"repetitions": measured, "versions": versions or {}}))
