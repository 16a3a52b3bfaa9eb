"""Symmetric double-sided two-way ranging: ranges from the timestamps of three packets.

C = Caluwaerts et al. 2016, §III-A, eqs. 1-7. Module i polls, module j responds, module i sends the
final packet; six stamps of two unsynchronized clocks give the raw range: distance plus antenna
offset.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tensegrity import _core
from tensegrity.errors import InputError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
CounterArray = NDArray[np.uint64]

SPEED_OF_LIGHT: float = _core.SPEED_OF_LIGHT
"""[m/s]"""
TICK_S: float = _core.DWM1000_TICK_S
"""Of the DWM1000's counter, 15.65 ps."""
COUNTER_BITS = 40
"""The counter starts anew every 17.2 s."""

STAMPS = (
    "poll_sent",
    "poll_received",
    "response_sent",
    "response_received",
    "final_sent",
    "final_received",
)
"""Order of the six counters. Sent polls, received responses and sent finals are stamps of the
module that starts, the others of the one that responds."""


@dataclass(frozen=True)
class TwoWayRanges:
    """``range_m`` (N,) raw ranges [m] and ``drift`` (N,) rate of the responding clock over the
    other, minus one, both NaN where not ``valid`` (N,): counters of more than 40 bit, packets out
    of order, exchanges of more than a second, clocks more than 100 ppm apart, more than 300 m."""

    range_m: FloatArray
    drift: FloatArray
    valid: NDArray[np.bool_]


def two_way_ranges(stamps: CounterArray) -> TwoWayRanges:
    """Raw ranges from counters (N, 6) in the order of :data:`STAMPS` [ticks], across wrap-around.

    Raises :class:`InputError` for an array of another shape or with anything but whole numbers of
    at least zero.
    """
    counters = np.asarray(stamps)
    if counters.ndim != 2 or counters.shape[1] != len(STAMPS):
        raise InputError(
            f"expected shape (N, {len(STAMPS)}), got {counters.shape}",
            field="stamps",
            hint=f"one row per exchange: {', '.join(STAMPS)}",
        )
    if not np.issubdtype(counters.dtype, np.integer) or (counters.size and counters.min() < 0):
        raise InputError(
            "expected counters, whole numbers of at least 0 [ticks]",
            field="stamps",
            hint="floating point numbers cannot hold sums of 40 bit counters in single precision",
        )
    range_m, drift, status = _core.two_way_ranges(np.ascontiguousarray(counters, dtype=np.uint64))
    valid = status == _core.Status.OK.value
    return TwoWayRanges(np.where(valid, range_m, np.nan), np.where(valid, drift, np.nan), valid)


@dataclass(frozen=True)
class Clocks:
    """Free-running clocks of modules, for simulation: counters (M,) that started at ``start_s`` [s]
    of their own time, run ``drift`` too fast [1] at time zero and ``aging`` faster every second
    [1/s]."""

    start_s: FloatArray
    drift: FloatArray
    aging: FloatArray

    @classmethod
    def draw(
        cls,
        modules: int,
        rng: np.random.Generator,
        drift: float = 20e-6,
        aging: float = 0.0,
    ) -> Clocks:
        """Clocks that started at any time, with ``drift`` and ``aging`` of either sign at most as
        large (IEEE 802.15.4 allows 20 ppm)."""
        turn = TICK_S * 2**COUNTER_BITS
        return cls(
            rng.uniform(0, turn, modules),
            rng.uniform(-drift, drift, modules),
            rng.uniform(-aging, aging, modules),
        )

    def count(self, module: IntArray, time_s: FloatArray) -> CounterArray:
        """Counters of modules (...) at true times (...) [s]."""
        elapsed = time_s * (1 + self.drift[module] + self.aging[module] / 2 * time_s)
        ticks = np.rint((self.start_s[module] + elapsed) / TICK_S).astype(np.uint64)
        return ticks & np.uint64(2**COUNTER_BITS - 1)
