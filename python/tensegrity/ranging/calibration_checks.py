"""Whether a recording can be calibrated at all, before time is spent on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tensegrity.errors import InputError
from tensegrity.ranging.recording import Anchors, RangeRecording

_LEAST_ANCHORS = 4
_LEAST_RANGES = 10  # of one anchor: its position alone has three coordinates


def check(recording: RangeRecording, survey: Anchors) -> None:
    """Raise :class:`InputError` naming the modules when ranges and survey do not belong together or
    the ranges do not hold together."""
    strange = recording.anchors[~np.isin(recording.anchors, survey.ids)]
    if len(strange):
        raise InputError(
            f"anchor {strange[0]} was ranged but is not listed",
            field="anchor",
            hint=f"anchors are {_listed(survey.ids)}; list it with empty coordinates",
        )
    silent = survey.ids[~np.isin(survey.ids, recording.anchors)]
    if len(silent):
        raise InputError(
            f"nobody ranged anchor {_listed(silent)}",
            field="anchor",
            hint="take it off the list of anchors, or check that it was switched on",
        )
    both = np.intersect1d(recording.nodes, recording.anchors)
    if len(both):
        raise InputError(
            f"module {both[0]} is in both columns: one of the robot or an anchor?", field="node"
        )
    if len(recording.anchors) < _LEAST_ANCHORS:
        raise InputError(
            f"{len(recording.anchors)} anchors are too few, {_LEAST_ANCHORS} at least are needed",
            field="anchor",
        )
    for anchor in recording.anchors:
        count = int((recording.anchor == anchor).sum())
        if count < _LEAST_RANGES:
            raise InputError(
                f"{count} ranges of anchor {anchor} are too few, {_LEAST_RANGES} at least are "
                "needed",
                field="anchor",
                hint="record longer or take the anchor off the list",
            )
    islands = _islands(recording)
    if len(islands) > 1:
        parts = "; ".join(
            f"modules {_listed(nodes)} with anchors {_listed(anchors)}"
            for nodes, anchors in islands
        )
        raise InputError(
            f"the ranges fall into {len(islands)} parts that nothing connects: {parts}",
            hint="calibrate each part on its own",
        )


def _islands(recording: RangeRecording) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Modules and anchors that are connected through ranges, part by part."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    nodes, anchors = recording.nodes, recording.anchors
    node = np.searchsorted(nodes, recording.node)
    anchor = len(nodes) + np.searchsorted(anchors, recording.anchor)
    size = len(nodes) + len(anchors)
    graph = coo_array((np.ones(len(node)), (node, anchor)), shape=(size, size))
    count, part = connected_components(graph, directed=False)
    split = len(nodes)
    return [(nodes[part[:split] == k], anchors[part[split:] == k]) for k in range(count)]


def _listed(ids: NDArray[np.int64]) -> str:
    return ", ".join(str(number) for number in ids)
