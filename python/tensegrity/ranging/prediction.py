"""How well a calibration predicts ranges: each from the others of the same module around it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tensegrity.errors import InputError
from tensegrity.ranging.multilateration import locate_either_side, plane_normal
from tensegrity.ranging.recording import Anchors, Offsets, RangeRecording

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

WINDOW_S = 0.25
LEAST_OTHERS = 5

_LOSS_SCALE_M = 0.15


def prediction_errors(
    recording: RangeRecording,
    anchors: Anchors,
    offsets: Offsets,
    other_anchors_only: bool = False,
    window_s: float = WINDOW_S,
    least_others: int = LEAST_OTHERS,
) -> FloatArray:
    """Predicted minus measured distance (N,) [m] of every range of a timed ``recording``.

    The module's position is solved robustly from its other ranges within ``window_s`` [s] before
    and after (``other_anchors_only``: without those of the same anchor, which tell most of the
    answer). NaN where there are fewer than ``least_others`` of them; nothing else is left out.
    """
    if not recording.timed:
        raise InputError("ranges are predicted from those around them in time", field="step")
    nodes = recording.nodes
    node = np.searchsorted(nodes, recording.node)
    anchor = np.searchsorted(anchors.ids, recording.anchor)
    distance = recording.range_m - offsets.table(nodes, anchors.ids)[node, anchor]
    errors = np.full(len(recording), np.nan)
    used = []
    for i, others in enumerate(_others(recording, node, window_s)):
        valid = np.isfinite(distance[others])
        if other_anchors_only:
            valid &= anchor[others] != anchor[i]
        if np.isfinite(distance[i]) and valid.sum() >= least_others:
            used.append((i, others[valid]))
    if not used:
        return errors
    width = max(len(others) for _, others in used)
    seen_m, seen_from = np.full((len(used), width), np.nan), np.zeros((len(used), width, 3))
    for row, (_, others) in enumerate(used):
        seen_m[row, : len(others)] = distance[others]
        seen_from[row, : len(others)] = anchors.position_m[anchor[others]]
    middle = anchors.position_m.mean(axis=0)
    position = locate_either_side(
        seen_from, seen_m, middle, plane_normal(anchors.position_m), _LOSS_SCALE_M
    )
    rows = np.array([i for i, _ in used])
    predicted = np.linalg.norm(position - anchors.position_m[anchor[rows]], axis=1)
    errors[rows] = predicted - distance[rows]
    return errors


def _others(recording: RangeRecording, node: IntArray, window_s: float) -> list[IntArray]:
    """For each range, the others of its module within the window."""
    window_ns = round(window_s * 1e9)
    found: list[IntArray] = [np.empty(0, dtype=np.int64)] * len(recording)
    for one in np.unique(node):
        own = np.flatnonzero(node == one)
        t_ns = recording.t_ns[own]
        first = np.searchsorted(t_ns, t_ns - window_ns, side="left")
        last = np.searchsorted(t_ns, t_ns + window_ns, side="right")
        for k, index in enumerate(own):
            found[index] = np.concatenate([own[first[k] : k], own[k + 1 : last[k]]])
    return found
