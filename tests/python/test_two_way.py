"""Two-way ranging over arrays of counters, and clocks that stamp them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tensegrity.errors import InputError
from tensegrity.ranging.two_way import (
    COUNTER_BITS,
    SPEED_OF_LIGHT,
    STAMPS,
    TICK_S,
    Clocks,
    CounterArray,
    two_way_ranges,
)

TURN = 2**COUNTER_BITS
ROUNDING_M = 1.5 * SPEED_OF_LIGHT * TICK_S / 2 + 1e-3  # three rounded stamps, and 20 ppm of 50 m


def exchange(
    distance: float, clocks: Clocks, reply_s: tuple[float, float], start_s: float = 0.0
) -> CounterArray:
    """Stamps (1, 6) of modules 0 and 1 standing still."""
    flight = distance / SPEED_OF_LIGHT
    steps = [0.0, flight, reply_s[0], flight, reply_s[1], flight]
    module = np.array([0, 1, 1, 0, 0, 1])
    return clocks.count(module, start_s + np.cumsum(steps))[None]


def test_module_2_gets_the_distance_by_the_equations_of_the_paper() -> None:
    clocks = Clocks(np.array([1.0, 2.0]), np.array([15e-6, -12e-6]), np.zeros(2))
    stamps = exchange(12.3, clocks, (1e-3, 1.2e-3))
    sp, rp, sr, rr, sf, rf = (int(counter) for counter in stamps[0])
    a, b, c, d = sf - sp, rf - rp, rf - sr, sf - rr  # C eqs. 1-4
    by_hand = SPEED_OF_LIGHT * TICK_S / 2 * (c - d * b / a)  # C eq. 6
    result = two_way_ranges(stamps)
    assert result.valid.tolist() == [True]
    assert result.range_m[0] == pytest.approx(by_hand, abs=1e-6)
    assert abs(result.range_m[0] - 12.3) < ROUNDING_M
    assert result.drift[0] == pytest.approx(-27e-6, abs=1e-8)


@given(
    distance=st.floats(0, 50),
    drift=st.tuples(st.floats(-20e-6, 20e-6), st.floats(-20e-6, 20e-6)),
    start=st.tuples(st.integers(0, TURN - 1), st.integers(0, TURN - 1)),
    reply=st.tuples(st.floats(3e-4, 0.06), st.floats(3e-4, 0.06)),
)
def test_any_clocks_and_replies_give_the_distance(
    distance: float,
    drift: tuple[float, float],
    start: tuple[int, int],
    reply: tuple[float, float],
) -> None:
    clocks = Clocks(np.array(start) * TICK_S, np.array(drift), np.zeros(2))
    result = two_way_ranges(exchange(distance, clocks, reply))
    assert result.valid[0]
    assert abs(result.range_m[0] - distance) < ROUNDING_M


@given(st.lists(st.tuples(*[st.integers(0, 2**64 - 1)] * 6), min_size=1, max_size=5))
def test_any_counters_are_ranges_or_not_valid(rows: list[tuple[int, ...]]) -> None:
    result = two_way_ranges(np.array(rows, dtype=np.uint64))
    assert (np.abs(result.range_m[result.valid]) <= 300).all()
    assert np.isnan(result.range_m[~result.valid]).all()
    assert np.isnan(result.drift[~result.valid]).all()
    too_large = (np.array(rows, dtype=np.uint64) >= TURN).any(axis=1)
    assert not result.valid[too_large].any()


def test_swapped_packets_are_not_valid() -> None:
    clocks = Clocks(np.array([1.0, 2.0]), np.zeros(2), np.zeros(2))
    good = exchange(5.0, clocks, (1e-3, 1e-3))
    for one, other in (("poll_sent", "final_sent"), ("poll_received", "response_sent")):
        bad = good.copy()
        columns = [STAMPS.index(one), STAMPS.index(other)]
        bad[:, columns] = bad[:, columns[::-1]]
        assert two_way_ranges(np.vstack([good, bad])).valid.tolist() == [True, False]


@pytest.mark.parametrize(
    ("stamps", "message"),
    [
        (np.zeros((2, 5), dtype=np.int64), r"expected shape \(N, 6\), got \(2, 5\).*poll_sent"),
        (np.zeros((2, 6)), "whole numbers"),
        (np.full((1, 6), -1), "at least 0"),
    ],
)
def test_other_arrays_are_errors(stamps: CounterArray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        two_way_ranges(stamps)


def test_clocks_wrap_drift_and_age() -> None:
    clocks = Clocks(np.array([TURN * TICK_S - 0.5]), np.array([10e-6]), np.array([1e-6]))
    module = np.zeros(3, dtype=np.int64)
    before, wrapped, later = clocks.count(module, np.array([0.0, 1.0, 11.0])).tolist()
    assert before > wrapped
    assert (wrapped - before) % TURN * TICK_S == pytest.approx(1 + 10e-6 + 0.5e-6, abs=1e-10)
    assert (later - wrapped) * TICK_S == pytest.approx(10 + 100e-6 + 60e-6, abs=1e-10)
