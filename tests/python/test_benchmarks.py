"""The benchmarks' own arithmetic: counts from dumps of callgrind, and figures as they are shown."""

import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(autouse=True)
def _benchmarks_on_the_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    # `report` and `results` are names that others may have too.
    for name in ("callgrind", "report", "results"):
        monkeypatch.delitem(sys.modules, name, raising=False)


def dump(name: str, instructions: int) -> str:
    return (
        f"desc: Trigger: Client Request: {name}\n\nevents: Ir\nsummary: 7\n\n"
        f"fn=(1) f\n0 {instructions}\n\ntotals: {instructions}\n"
    )


def test_the_worst_cycle_is_not_the_sum_of_the_worst_calls(tmp_path: Path) -> None:
    from callgrind import worst_calls

    file = tmp_path / "out"
    file.write_text(
        "version: 1\n"
        + dump("before", 10**9)
        + dump("cycle/full/right/imu", 100)
        + dump("cycle/full/right/cables", 50)
        + dump("cycle/full/right/imu", 120)
        + dump("cycle/full/right/contacts", 5)
        + "desc: Trigger: Program termination\ntotals: 1000000\n"
    )
    assert worst_calls(file) == {
        "cycle/full/right": {"imu": 120, "cables": 50, "contacts": 5, "cycle": 150}
    }


@pytest.mark.parametrize(
    ("ns", "shown"),
    [
        (0.5, "0.50 ns"),
        (12.34, "12.3 ns"),
        (1234.0, "1.23 µs"),
        (4.1e6, "4.10 ms"),
        (2e9, "2.00 s"),
    ],
)
def test_durations_have_three_digits(ns: float, shown: str) -> None:
    from report import duration

    assert duration(ns) == shown


def test_a_spread_has_one_unit_where_it_can() -> None:
    from report import spread
    from results import Timing

    assert spread(Timing.of([1500.0, 1200.0, 1800.0])) == "1.50 µs (1.20 – 1.80 µs)"
    assert spread(Timing.of([900.0, 1000.0, 1100.0])) == "1.00 µs (900 ns – 1.10 µs)"
