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


def test_counts_are_between_marks_without_the_marks_own(tmp_path: Path) -> None:
    from callgrind import counts

    log = tmp_path / "log"
    counter = (1000, 1010, 2000, 2110, 5000, 5410)
    log.write_text("".join(f"threads: 1\nevents-1: {n}\nevents-1-0: 7\n" for n in counter))
    assert counts(log, "mark 1\nshape/cold 10\ncycle 1\n") == [("shape/cold", 10), ("cycle", 400)]
    with pytest.raises(RuntimeError, match="6 counts for 2 pairs"):
        counts(log, "mark 1\nshape/cold 10\n")


def test_the_worst_cycle_is_not_the_sum_of_the_worst_calls() -> None:
    from callgrind import worst_calls

    calls = [("imu", 100), ("cables", 50), ("imu", 120), ("contacts", 5)]
    assert worst_calls([(f"cycle/full/right/{kind}", count) for kind, count in calls]) == {
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

    def shown(*times: float) -> str:
        return spread(Timing.of([(time, 1.0) for time in times], least=1.0))

    assert shown(1500.0, 1200.0, 1800.0) == "1.50 µs (1.20 – 1.80 µs)"
    assert shown(900.0, 1000.0, 1100.0) == "1.00 µs (900 ns – 1.10 µs)"


def test_repetitions_on_a_shared_core_do_not_count() -> None:
    from report import spread
    from results import Timing, least_gauge

    repetitions = [(100.0, 10.0), (104.0, 11.4), (102.0, 10.2), (170.0, 13.0), (150.0, 11.6)]
    least = least_gauge([repetitions, [(1.0, 20.0)]])
    timing = Timing.of(repetitions, least)
    assert (timing.median_ns, timing.min_ns, timing.max_ns) == (102.0, 100.0, 104.0)
    assert (timing.alone, timing.repetitions, timing.disturbed_ns) == (3, 5, 160.0)

    never = Timing.of([(1.0, 20.0), (2.0, 30.0)], least)
    assert (never.median_ns, never.alone) == (1.5, 0)
    assert spread(never).endswith("*")
