"""Offsets between modules of the robot, once their trajectories are known.

The difference between raw ranges and estimated distances (C, end of §III-C, C is Caluwaerts et al.
2016), its median over the recording: these pairs are close together, and metal in between makes
some of their ranges far too long.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tensegrity.ranging.recording import InternalRanges, Offsets

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_LEAST_RANGES = 5  # of a pair


def internal_offsets(
    ranges: InternalRanges, start_ns: int, knot_t: FloatArray, modules: dict[int, FloatArray]
) -> Offsets:
    """Offsets [m] of the pairs (smaller number first) that were ranged at least five times.

    ``modules`` are positions (K, 3) [m] by number at ``knot_t`` (K,) [s] after ``start_ns`` [ns];
    ranges outside that time are not used.
    """
    t = (ranges.t_ns - start_ns) * 1e-9
    first, second = np.minimum(ranges.node, ranges.other), np.maximum(ranges.node, ranges.other)
    inside = (knot_t[0] <= t) & (t <= knot_t[-1])
    inside &= np.isin(first, list(modules)) & np.isin(second, list(modules))
    pairs, found = [], []
    for pair in np.unique(np.column_stack([first, second])[inside], axis=0).tolist():
        own = inside & (first == pair[0]) & (second == pair[1])
        if own.sum() < _LEAST_RANGES:
            continue
        at, other = (_positions(t[own], knot_t, modules[module]) for module in pair)
        pairs.append(pair)
        found.append(float(np.median(ranges.range_m[own] - np.linalg.norm(at - other, axis=1))))
    numbers = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return Offsets(numbers[:, 0], numbers[:, 1], np.array(found, dtype=np.float64))


def _positions(t: FloatArray, knot_t: FloatArray, positions: FloatArray) -> FloatArray:
    return np.column_stack([np.interp(t, knot_t, positions[:, axis]) for axis in range(3)])
