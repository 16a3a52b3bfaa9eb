"""Power of received packets: which ranges to believe, and a model of links that lie.

A DWM1000 reports how strongly the first path arrived and how much power all paths brought together.
When the direct path is blocked most of the power comes by reflections, and the range is that of a
detour. C = Caluwaerts et al. 2016, §III-A, rejects such packets, 30 to 70 % indoors. Formulas and
limits are those of the DW1000 User Manual, §4.7.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tensegrity.errors import InputError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

LINE_OF_SIGHT_DB = 6.0
"""Total over first-path power below which the manual calls a packet likely line of sight."""
NO_LINE_OF_SIGHT_DB = 10.0
"""Total over first-path power above which the manual calls it likely not."""

_POWER_CONSTANT_DB = {16: 113.77, 64: 121.74}  # by pulse repetition frequency [MHz]
_SPEED_OF_LIGHT = 299_792_458.0


def first_path_dbm(
    amplitudes: ArrayLike, preamble_count: ArrayLike, prf_mhz: int = 64
) -> FloatArray:
    """Power of the first path [dBm] from ``amplitudes`` (..., 3), the registers FP_AMPL1 to 3, and
    ``preamble_count`` (...), the register RXPACC.

    Raises :class:`InputError` for a frequency the radio does not have and for counts below one.
    """
    squares = (np.asarray(amplitudes, dtype=np.float64) ** 2).sum(axis=-1)
    return _dbm(squares, preamble_count, prf_mhz)


def total_dbm(cir_power: ArrayLike, preamble_count: ArrayLike, prf_mhz: int = 64) -> FloatArray:
    """Power of all paths [dBm] from the registers CIR_PWR and RXPACC (...).

    Raises :class:`InputError` as :func:`first_path_dbm` does.
    """
    return _dbm(np.asarray(cir_power, dtype=np.float64) * 2**17, preamble_count, prf_mhz)


def rejects(
    first_path_dbm: ArrayLike, total_dbm: ArrayLike, gap_db: float = LINE_OF_SIGHT_DB
) -> BoolArray:
    """Whether a packet is too suspicious to use: more than ``gap_db`` between both powers.

    Powers that are not finite are rejected.
    """
    with np.errstate(invalid="ignore"):  # of nothing received; not a number is no small gap
        gap = np.subtract(total_dbm, first_path_dbm)
    return ~(gap <= gap_db)


def free_space_dbm(distance_m: ArrayLike, carrier_hz: float = 6.4896e9) -> FloatArray:
    """Power received over ``distance_m`` [m] in free space from a transmitter at the legal limit of
    -41.3 dBm/MHz over 500 MHz; the carrier is that of channels 4 and 7."""
    distance = np.maximum(np.asarray(distance_m, dtype=np.float64), 0.1)
    loss = 20 * np.log10(4 * np.pi * distance * carrier_hz / _SPEED_OF_LIGHT)
    return -41.3 + 10 * np.log10(500.0) - loss


def _dbm(power: FloatArray, preamble_count: ArrayLike, prf_mhz: int) -> FloatArray:
    if prf_mhz not in _POWER_CONSTANT_DB:
        raise InputError(f"expected 16 or 64 [MHz], got {prf_mhz}", field="prf_mhz")
    count = np.asarray(preamble_count, dtype=np.float64)
    if np.any(count < 1):
        raise InputError("expected at least one preamble symbol", field="preamble_count")
    with np.errstate(divide="ignore"):  # nothing received: minus infinity
        return 10 * np.log10(power / count**2) - _POWER_CONSTANT_DB[prf_mhz]


@dataclass(frozen=True)
class LinkModel:
    """How links between modules behave. Powers are differences of total and first path.

    With these numbers and the limit of 6 dB, 30 to 70 % of the packets of a link are rejected (as
    in C), and of those that pass some 3 to 12 % took a detour.
    """

    blocked_share: tuple[float, float] = (0.27, 0.70)
    """Least and largest share of time without line of sight; every link draws its own."""
    blocked_time_s: float = 1.0
    """Mean time until a blocked link is free again."""
    detour_m: float = 0.5
    """Mean excess of the first path of a blocked link, exponentially distributed."""
    clear_gap_db: tuple[float, float] = (3.0, 1.5)
    """Mean and standard deviation with line of sight."""
    blocked_gap_db: tuple[float, float] = (12.0, 4.0)
    """Mean and standard deviation without."""
    drop: float = 0.05
    """Share of the exchanges in which a packet is lost altogether."""


class Links:
    """The states of many links over time: each is free or blocked, and changes like a two-state
    Markov process."""

    def __init__(
        self, count: int, rng: np.random.Generator, model: LinkModel | None = None
    ) -> None:
        self._model = LinkModel() if model is None else model
        self._rng = rng
        self._share = rng.uniform(*self._model.blocked_share, count)
        self._blocked = rng.random(count) < self._share
        self._detour = self._new_detours()

    def advance(self, dt: float) -> None:
        """Let ``dt`` [s] pass."""
        leave = 1 - np.exp(-dt / self._model.blocked_time_s)
        enter = 1 - np.exp(-dt / self._model.blocked_time_s * self._share / (1 - self._share))
        chance = self._rng.random(len(self._share))
        before = self._blocked
        self._blocked = np.where(before, chance >= leave, chance < enter)
        self._detour = np.where(self._blocked & ~before, self._new_detours(), self._detour)

    def packets(self, distance_m: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """One packet over each link of ``distance_m`` (count,) [m].

        Returns the excess of the path that was measured [m], first-path and total power [dBm], each
        (count,); powers of lost packets are minus infinity.
        """
        model, rng = self._model, self._rng
        size = len(distance_m)
        gap = np.where(
            self._blocked,
            rng.normal(*model.blocked_gap_db, size),
            rng.normal(*model.clear_gap_db, size),
        )
        total = free_space_dbm(distance_m)
        total[rng.random(size) < model.drop] = -np.inf
        first_path = total - np.maximum(gap, 0.0)
        return np.where(self._blocked, self._detour, 0.0), first_path, total

    def _new_detours(self) -> FloatArray:
        return self._rng.exponential(self._model.detour_m, len(self._share))
