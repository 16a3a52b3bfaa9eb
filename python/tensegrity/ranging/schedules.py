"""Who sends when: pairwise and broadcast ranging among many modules, packet by packet.

C = Caluwaerts et al. 2016, §III-A. Pairwise ranging takes three packets per pair of modules. With
broadcasts every module sends one poll, one response and one final packet in a round, which all
others hear: three packets per module, and two ranges per pair, since either module can take either
part. The price is the time between the packets of one exchange.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tensegrity.errors import InputError
from tensegrity.ranging.two_way import (
    SPEED_OF_LIGHT,
    Clocks,
    CounterArray,
    FloatArray,
    IntArray,
    TwoWayRanges,
    two_way_ranges,
)

PACKET_SPACING_S = 0.001
"""C §III-B."""

Kind = Literal["pairwise", "broadcast"]


@dataclass(frozen=True)
class Schedule:
    """One round among ``modules`` modules, numbered from zero. Packets are sent one after the
    other, ``spacing_s`` apart, so that no two meet.

    * ``sender`` (P,) of every packet, in the order of time
    * ``starter``, ``responder`` (E,) modules of every exchange
    * ``packets`` (E, 3) positions of its poll, response and final packet in ``sender``
    """

    kind: Kind
    modules: int
    spacing_s: float
    sender: IntArray
    starter: IntArray
    responder: IntArray
    packets: IntArray

    @property
    def duration_s(self) -> float:
        """Of a round."""
        return len(self.sender) * self.spacing_s

    @property
    def longest_exchange_s(self) -> float:
        """From a poll to the final packet of the same exchange."""
        return float((self.packets[:, 2] - self.packets[:, 0]).max() * self.spacing_s)

    @property
    def longest_final_s(self) -> float:
        """Air time of the longest final packet, which holds a receive stamp for every exchange that
        it ends."""
        stamps = np.bincount(self.packets[:, 2]).max()
        return air_time_s(_HEADER_BYTES + _STAMP_BYTES * int(stamps))


def pairwise(modules: int, spacing_s: float = PACKET_SPACING_S) -> Schedule:
    """Three packets for one pair after the other; one range per pair."""
    _check(modules, spacing_s)
    first, second = np.triu_indices(modules, 1)
    return Schedule(
        kind="pairwise",
        modules=modules,
        spacing_s=spacing_s,
        sender=np.column_stack([first, second, first]).ravel(),
        starter=first,
        responder=second,
        packets=np.arange(3 * len(first)).reshape(-1, 3),
    )


def broadcast(modules: int, spacing_s: float = PACKET_SPACING_S) -> Schedule:
    """All polls, then all responses, then all final packets; two ranges per pair."""
    _check(modules, spacing_s)
    everyone = np.arange(modules)
    starter, responder = (index.ravel() for index in np.indices((modules, modules)))
    starter, responder = starter[starter != responder], responder[starter != responder]
    return Schedule(
        kind="broadcast",
        modules=modules,
        spacing_s=spacing_s,
        sender=np.tile(everyone, 3),
        starter=starter,
        responder=responder,
        packets=np.column_stack([starter, modules + responder, 2 * modules + starter]),
    )


def _check(modules: int, spacing_s: float) -> None:
    if modules < 2:
        raise InputError(f"expected at least 2 modules, got {modules}", field="modules")
    if not spacing_s > 0:
        raise InputError(f"expected more than 0 [s], got {spacing_s:g}", field="spacing_s")


# Frames of the DWM1000 at 6.8 Mbit/s with 256 preamble symbols (C Table I), IEEE 802.15.4 UWB.
_SYMBOL_S = 1.01763e-6
_PREAMBLE_SYMBOLS, _START_SYMBOLS, _HEADER_BITS = 256, 8, 21
_HEADER_BIT_S = 1.02564e-6
_BIT_RATE = 6.8e6
_PARITY_BITS, _BLOCK_BITS = 48, 330  # Reed-Solomon
_STAMP_BYTES = 5  # 40 bit
_HEADER_BYTES = 12 + _STAMP_BYTES  # of a final packet: addresses, checksum, and its own send stamp


def air_time_s(payload_bytes: int) -> float:
    """How long a packet is on the air [s]."""
    bits = 8 * payload_bytes
    coded = bits + _PARITY_BITS * int(np.ceil(bits / _BLOCK_BITS))
    symbols = _PREAMBLE_SYMBOLS + _START_SYMBOLS
    return symbols * _SYMBOL_S + _HEADER_BITS * _HEADER_BIT_S + coded / _BIT_RATE


@dataclass(frozen=True)
class Air:
    """What happens to packets on their way.

    ``stamp_noise_s`` is the standard deviation of a receive stamp [s] (0.16 ns makes ranges of
    3 cm), ``drop`` the share of receptions that fail; ``excess_m`` (M, M), symmetric, what every
    path is longer than the distance: antenna offsets and detours [m].
    """

    excess_m: FloatArray
    stamp_noise_s: float = 0.16e-9
    drop: float = 0.0


@dataclass(frozen=True)
class Round:
    """Outcome of a round: ``stamps`` (E, 6) counters of the exchanges of the schedule [ticks],
    ``complete`` (E,) whether all three packets arrived, ``response_s`` (E,) true time of the
    response, whose distance a range is [s]; ``sent_s`` (P,) true times of the packets [s]."""

    stamps: CounterArray
    complete: NDArray[np.bool_]
    response_s: FloatArray
    sent_s: FloatArray

    def ranges(self) -> TwoWayRanges:
        """Raw ranges (E,); those of incomplete exchanges are not valid."""
        result = two_way_ranges(self.stamps)
        valid = result.valid & self.complete
        return TwoWayRanges(
            np.where(valid, result.range_m, np.nan), np.where(valid, result.drift, np.nan), valid
        )


def simulate_round(
    schedule: Schedule,
    clocks: Clocks,
    positions: FloatArray,
    velocities: FloatArray,
    air: Air,
    rng: np.random.Generator,
    start_s: float = 0.0,
) -> Round:
    """Send every packet of a round that begins at ``start_s`` [s].

    Modules are at ``positions`` (M, 3) [m] then and move on with ``velocities`` (M, 3) [m/s]. They
    count their slots from the first packet as they hear it, on their own clocks, as in C; modules
    that miss it are not modelled. Stamps of sent packets are exact, since the radio sends at a
    given count.
    """
    rate = 1 + clocks.drift + clocks.aging * start_s

    def path_m(sender: IntArray, receiver: IntArray, time_s: FloatArray) -> FloatArray:
        """Length of the paths of packets sent at ``time_s``. A module at 10 m/s moves 1 nm per
        metre of flight: where the receiver is then is where it is when the packet arrives."""
        elapsed = (time_s - start_s)[:, None]
        line = positions[sender] - positions[receiver]
        line = line + (velocities[sender] - velocities[receiver]) * elapsed
        return np.linalg.norm(line, axis=1) + air.excess_m[sender, receiver]

    first = np.full(schedule.modules, schedule.sender[0])
    everyone = np.arange(schedule.modules)
    heard = start_s + path_m(first, everyone, np.full(schedule.modules, start_s)) / SPEED_OF_LIGHT
    heard[schedule.sender[0]] = start_s
    slot_s = np.arange(len(schedule.sender)) * schedule.spacing_s
    sent_s = heard[schedule.sender] + slot_s / rate[schedule.sender]

    starter, responder = schedule.starter, schedule.responder
    columns, complete = [], np.ones(len(starter), dtype=np.bool_)
    for packet, sender, receiver in zip(
        schedule.packets.T,
        (starter, responder, starter),
        (responder, starter, responder),
        strict=True,
    ):
        sent = sent_s[packet]
        arrival = sent + path_m(sender, receiver, sent) / SPEED_OF_LIGHT
        arrival += rng.normal(0.0, air.stamp_noise_s, len(sent))
        complete &= rng.random(len(sent)) >= air.drop
        columns += [clocks.count(sender, sent), clocks.count(receiver, arrival)]
    return Round(
        stamps=np.column_stack(columns),
        complete=complete,
        response_s=sent_s[schedule.packets[:, 1]],
        sent_s=sent_s,
    )


@dataclass(frozen=True)
class Cost:
    """What a round costs: ``packets`` sent, ``ranges`` gained, ``duration_s``, the ``rate_hz`` of
    rounds one after the other, and the ``longest_exchange_s``."""

    kind: Kind
    modules: int
    packets: int
    ranges: int
    duration_s: float
    rate_hz: float
    longest_exchange_s: float


def cost(schedule: Schedule) -> Cost:
    """Of one round."""
    return Cost(
        kind=schedule.kind,
        modules=schedule.modules,
        packets=len(schedule.sender),
        ranges=len(schedule.starter),
        duration_s=schedule.duration_s,
        rate_hz=1 / schedule.duration_s,
        longest_exchange_s=schedule.longest_exchange_s,
    )
