"""Instructions per call from callgrind's combined dumps: one dump a case, or one a call."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

_TRIGGER, _TOTAL = "desc: Trigger: Client Request: ", "totals: "


def dumps(path: Path) -> Iterator[tuple[str, int]]:
    """Name and instructions of each dump that a program asked for, in order; "before" only zeroes
    the counters, and what the program does after its last request has no name."""
    name = ""
    with path.open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            if line.startswith(_TRIGGER):
                name = line.removeprefix(_TRIGGER).strip()
            elif line.startswith(_TOTAL):
                if name not in ("", "before"):
                    yield name, int(line.removeprefix(_TOTAL))
                name = ""


def worst_calls(path: Path) -> dict[str, dict[str, int]]:
    """The most instructions of any `imu`, `contacts` and `cables`, and of any cycle, which is a
    call of `imu` and what follows it until the next one; by case."""
    worst: dict[str, dict[str, int]] = {}
    cycle = 0
    for name, instructions in dumps(path):
        case, _, kind = name.rpartition("/")
        cycle = instructions if kind == "imu" else cycle + instructions
        calls = worst.setdefault(case, {})
        calls[kind] = max(calls.get(kind, 0), instructions)
        calls["cycle"] = max(calls.get("cycle", 0), cycle)
    return worst
