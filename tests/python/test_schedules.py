"""Schedules of ranging packet by packet, and the power that packets arrive with."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from tensegrity.errors import InputError
from tensegrity.ranging.radio import (
    Links,
    first_path_dbm,
    free_space_dbm,
    rejects,
    total_dbm,
)
from tensegrity.ranging.schedules import (
    Air,
    Round,
    Schedule,
    air_time_s,
    broadcast,
    cost,
    pairwise,
    simulate_round,
)
from tensegrity.ranging.two_way import SPEED_OF_LIGHT, TICK_S, Clocks

FloatArray = NDArray[np.float64]
Build = Callable[[int], Schedule]

START_S = 3.0
ROUNDING_STD_M = 1.3e-3
BOTH = pytest.mark.parametrize("build", [pairwise, broadcast])


def simulated(
    schedule: Schedule,
    seed: int = 0,
    *,
    drift: float = 20e-6,
    aging: float = 0.0,
    noise_s: float = 0.0,
    speed: float = 0.0,
    excess: float = 0.0,
    drop: float = 0.0,
) -> tuple[Round, FloatArray]:
    """A round of modules in a hall, and the error of its ranges (E,) [m]."""
    rng = np.random.default_rng(seed)
    count = schedule.modules
    positions, velocities = rng.uniform(-6, 6, (count, 3)), rng.normal(0, 1, (count, 3))
    velocities *= speed
    clocks = Clocks.draw(count, rng, drift, aging)
    air = Air(np.full((count, count), excess), noise_s, drop)
    done = simulate_round(schedule, clocks, positions, velocities, air, rng, START_S)
    line = positions[schedule.starter] - positions[schedule.responder]
    relative = velocities[schedule.starter] - velocities[schedule.responder]
    line += relative * (done.response_s - START_S)[:, None]
    return done, done.ranges().range_m - np.linalg.norm(line, axis=1)


@BOTH
@pytest.mark.parametrize("modules", [2, 3, 12, 21, 40])
def test_exchanges_are_made_of_their_packets(build: Build, modules: int) -> None:
    schedule = build(modules)
    poll, response, final = schedule.packets.T
    assert (poll < response).all()
    assert (response < final).all()
    assert np.array_equal(schedule.sender[poll], schedule.starter)
    assert np.array_equal(schedule.sender[response], schedule.responder)
    assert np.array_equal(schedule.sender[final], schedule.starter)
    pairs = {frozenset(pair) for pair in zip(schedule.starter, schedule.responder, strict=True)}
    assert len(pairs) == modules * (modules - 1) // 2


def test_costs_grow_linearly_with_broadcasts_and_quadratically_without() -> None:
    for modules in (2, 10, 20, 40):
        one_by_one, all_at_once = cost(pairwise(modules)), cost(broadcast(modules))
        pairs = modules * (modules - 1) // 2
        assert (one_by_one.packets, one_by_one.ranges) == (3 * pairs, pairs)
        assert (all_at_once.packets, all_at_once.ranges) == (3 * modules, 2 * pairs)
        assert one_by_one.duration_s == pytest.approx(3e-3 * pairs)
        assert all_at_once.duration_s == pytest.approx(3e-3 * modules)
        assert one_by_one.longest_exchange_s == pytest.approx(2e-3)
        assert all_at_once.longest_exchange_s == pytest.approx(2e-3 * modules)


def test_broadcasts_range_more_than_twenty_modules_at_15_hz() -> None:
    assert cost(broadcast(22)).rate_hz > 15 > cost(pairwise(8)).rate_hz


@BOTH
def test_no_packets_meet(build: Build) -> None:
    for modules in (5, 20, 40):
        schedule = build(modules)
        done, _ = simulated(schedule, drift=40e-6, speed=5.0)
        # A packet has left the air everywhere when it has crossed the hall.
        gap = np.diff(done.sent_s).min()
        assert gap > schedule.longest_final_s + 25 / SPEED_OF_LIGHT
        assert (np.diff(done.sent_s) > 0).all()


def test_air_time_is_that_of_the_radio() -> None:
    # 264 symbols and 21 header bits of about a microsecond, then 6.8 Mbit/s.
    assert air_time_s(0) == pytest.approx(290e-6, abs=1e-6)
    assert air_time_s(100) - air_time_s(0) == pytest.approx((800 + 3 * 48) / 6.8e6)


@BOTH
def test_drifting_clocks_cost_no_more_than_rounding(build: Build) -> None:
    for drift in (0.0, 40e-6):
        done, error = simulated(build(20), drift=drift)
        assert done.ranges().valid.all()
        assert np.std(error) < 1.2 * ROUNDING_STD_M
        assert abs(np.mean(error)) < ROUNDING_STD_M


@BOTH
def test_noise_of_the_stamps_is_that_of_the_ranges(build: Build) -> None:
    _, error = simulated(build(20), noise_s=0.16e-9)
    # Half the speed of light times sqrt(p^2 + 1 + (1-p)^2), and p is one half on average.
    least = SPEED_OF_LIGHT / 2 * 0.16e-9 * np.sqrt(1.5)
    assert least * 0.85 < np.std(error) < least * 1.25


def test_ageing_clocks_cost_long_exchanges_more() -> None:
    aging = 1e-6
    _, short = simulated(pairwise(20), aging=aging)
    _, long_ = simulated(broadcast(20), aging=aging)
    # v/4 s d (a - d) of a - d = d = 20 ms and two clocks: 30 mm and less.
    bound = SPEED_OF_LIGHT / 4 * 2 * aging * 0.02**2 * 1.05 + 4 * ROUNDING_STD_M
    assert 5 * np.std(short) < np.std(long_)
    assert np.abs(long_).max() < bound


@BOTH
def test_moving_modules_range_the_distance_at_the_response(build: Build) -> None:
    schedule = build(20)
    done, error = simulated(schedule, speed=1.0)
    assert np.abs(error).max() < 5 * ROUNDING_STD_M
    spread = done.response_s.max() - done.response_s.min()
    assert spread > 0.018  # in which modules at 1 m/s move several centimetres


def test_offsets_and_detours_stay_in_the_range() -> None:
    _, error = simulated(broadcast(6), excess=3.9)
    np.testing.assert_allclose(error, 3.9, atol=5 * ROUNDING_STD_M)


def test_lost_packets_cost_the_exchanges_they_belong_to() -> None:
    done, error = simulated(broadcast(30), drop=0.2)
    assert np.array_equal(np.isnan(error), ~done.complete)
    assert done.complete.mean() == pytest.approx(0.8**3, abs=0.06)


def test_both_ranges_of_a_pair_have_noise_of_their_own() -> None:
    schedule = broadcast(25)
    _, error = simulated(schedule, noise_s=0.16e-9)
    table = np.full((25, 25), np.nan)
    table[schedule.starter, schedule.responder] = error
    first, second = np.triu_indices(25, 1)
    forth, back = table[first, second], table[second, first]
    assert abs(np.corrcoef(forth, back)[0, 1]) < 0.2
    assert np.std((forth + back) / 2) < 0.8 * np.std(forth)


@pytest.mark.parametrize(
    ("modules", "spacing", "message"), [(1, 1e-3, "at least 2"), (5, 0.0, r"more than 0 \[s\]")]
)
def test_impossible_schedules_are_errors(modules: int, spacing: float, message: str) -> None:
    for build in (pairwise, broadcast):
        with pytest.raises(InputError, match=message):
            build(modules, spacing)


def test_powers_follow_the_manual() -> None:
    # 10 log10((F1^2 + F2^2 + F3^2)/N^2) - A and 10 log10(C 2^17/N^2) - A, A = 121.74 at 64 MHz.
    assert first_path_dbm([3000, 4000, 0], 100) == pytest.approx(33.98 - 121.74, abs=0.01)
    assert total_dbm(1000, 100) == pytest.approx(41.175 - 121.74, abs=0.01)
    assert total_dbm(1000, 100, 16) - total_dbm(1000, 100) == pytest.approx(121.74 - 113.77)
    with pytest.raises(InputError, match="16 or 64"):
        total_dbm(1000, 100, 32)
    with pytest.raises(InputError, match="preamble symbol"):
        first_path_dbm([1, 1, 1], 0)


def test_packets_with_most_power_after_the_first_path_are_rejected() -> None:
    first, total = np.array([-80.0, -85.0, -95.0, -np.inf]), np.array([-78.0, -80, -80, -90])
    assert rejects(first, total).tolist() == [False, False, True, True]
    assert rejects(first, total, gap_db=3).tolist() == [False, True, True, True]
    assert rejects([np.nan, -np.inf], [-80.0, -np.inf]).all()


def test_power_falls_with_the_square_of_the_distance() -> None:
    near, far = free_space_dbm([2.0, 20.0])
    assert near - far == pytest.approx(20)
    assert near == pytest.approx(-69.0, abs=0.1)  # -14.3 dBm, 54.7 dB of free space


def test_links_are_blocked_for_a_while_and_some_detours_pass() -> None:
    rng = np.random.default_rng(0)
    links = Links(96, rng)
    accepted, detour = np.empty((2, 1000, 96))
    for k in range(1000):
        links.advance(0.1)
        detour[k], first, total = links.packets(np.full(96, 5.0))
        accepted[k] = ~rejects(first, total)
    assert accepted.mean(axis=0).min() > 0.2
    assert accepted.mean(axis=0).max() < 0.8
    assert 1 - accepted.mean() == pytest.approx(0.5, abs=0.05)
    blocked = detour > 0
    assert 0.02 < (accepted * blocked).sum() / accepted.sum() < 0.12
    assert (accepted * ~blocked).sum() / (~blocked).sum() > 0.9
    began = (np.diff(blocked.astype(int), axis=0) == 1).sum()
    assert blocked.sum() * 0.1 / began == pytest.approx(1.0, rel=0.15)  # [s]
    assert detour[blocked].mean() == pytest.approx(0.5, rel=0.15)


def test_ticks_are_those_of_the_radio() -> None:
    assert pytest.approx(15.65e-12, rel=1e-3) == TICK_S
