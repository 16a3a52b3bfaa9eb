"""Instructions per call: the programs have callgrind write its counter to its log before and after
what they count, and print a line "<name> <calls>" for each such pair."""

from __future__ import annotations

import re
from pathlib import Path

Counts = list[tuple[str, float]]
"""Name and instructions per call, in the order of counting."""

_COUNTER = re.compile(r"^events-1: (\d+)$")


def counts(log: Path, output: str) -> Counts:
    """Of a program's log and output. The first pair has nothing between its marks: what it counts
    is the marks' own, and is taken off the others."""
    with log.open(encoding="utf-8") as lines:
        counter = [int(found[1]) for line in lines if (found := _COUNTER.match(line))]
    names = [line.split() for line in output.splitlines()]
    if len(counter) != 2 * len(names):
        raise RuntimeError(f"{log}: {len(counter)} counts for {len(names)} pairs of marks")
    spent = [after - before for before, after in zip(counter[::2], counter[1::2], strict=True)]
    return [
        (name, (instructions - spent[0]) / int(calls))
        for (name, calls), instructions in zip(names[1:], spent[1:], strict=True)
    ]


def worst_calls(calls: Counts) -> dict[str, dict[str, float]]:
    """The most instructions of any `imu`, `contacts` and `cables`, and of any cycle, which is a
    call of `imu` and what follows it until the next one; by case."""
    worst: dict[str, dict[str, float]] = {}
    cycle = 0.0
    for name, instructions in calls:
        case, _, kind = name.rpartition("/")
        cycle = instructions if kind == "imu" else cycle + instructions
        of_case = worst.setdefault(case, {})
        of_case[kind] = max(of_case.get(kind, 0.0), instructions)
        of_case["cycle"] = max(of_case.get("cycle", 0.0), cycle)
    return worst
