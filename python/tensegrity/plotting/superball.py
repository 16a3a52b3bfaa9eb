"""Figures of the experiments of C = Caluwaerts et al. 2016."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tensegrity.plotting.style import TRUTH_COLOUR, legend_above, new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from tensegrity.experiments.superball import Outcome

_COLOURS = ("#0072B2", "#009E73", "#E69F00", "#CC79A7", "#D55E00")
_AXES = "xyz"


def draw_local(outcome: Outcome, nodes: Sequence[int], path: Path) -> Path:
    """Coordinates of single end caps over time, estimated and true (C Fig. 6)."""
    with new_figure(8.0, 1.8 * len(nodes) + 1.2) as figure:
        panels = figure.subplots(len(nodes), 3, sharex=True, squeeze=False)
        for row, node in zip(panels, nodes, strict=True):
            for axis, panel in enumerate(row):
                _draw_coordinate(panel, outcome, node, axis, _COLOURS[0], with_truth=True)
                panel.set_title(f"end cap {node}, {_AXES[axis]} [m]")
        for panel in panels[-1]:
            panel.set_xlabel("time [s]")
        legend_above(figure, panels[0, 0].get_legend_handles_labels()[0])
        return save(figure, path)


def draw_faces(outcomes: Sequence[Outcome], path: Path) -> Path:
    """Faces the robot rested on and the path of its centre of mass, from above (C Fig. 7)."""
    first = outcomes[0]
    with new_figure(9.0, 6.0) as figure:
        panel = figure.subplots()
        truth = first.sequence.endcaps
        assert truth is not None
        panel.plot(*truth.position.mean(axis=1)[:, :2].T, color=TRUTH_COLOUR, label="truth")
        for start, stop in _rests(truth.position):
            _draw_face(panel, truth.position[(start + stop) // 2], TRUTH_COLOUR)
        for outcome, colour in zip(outcomes, _COLOURS, strict=False):
            track = outcome.track
            panel.plot(
                *track.centre_of_mass[:, :2].T, color=colour, linewidth=0.8, label=outcome.setting
            )
            for start, stop in _rests(truth.position):
                at = np.searchsorted(track.t_ns, truth.t_ns[(start + stop) // 2])
                _draw_face(panel, track.nodes[min(int(at), len(track) - 1)], colour)
        panel.set_aspect("equal", adjustable="datalim")
        panel.set(xlabel="x [m]", ylabel="y [m]")
        legend_above(figure, panel.get_legend_handles_labels()[0])
        return save(figure, path)


def draw_end_cap(outcomes: Sequence[Outcome], node: int, path: Path) -> Path:
    """Horizontal position of one end cap over time with every setting (C Fig. 8)."""
    with new_figure(8.0, 4.5) as figure:
        panels = figure.subplots(2, 1, sharex=True)
        for axis, panel in enumerate(panels):
            for index, (outcome, colour) in enumerate(zip(outcomes, _COLOURS, strict=False)):
                _draw_coordinate(panel, outcome, node, axis, colour, with_truth=index == 0)
            panel.set_ylabel(f"{_AXES[axis]} of end cap {node} [m]")
        panels[-1].set_xlabel("time [s]")
        legend_above(figure, panels[0].get_legend_handles_labels()[0])
        return save(figure, path)


def _draw_coordinate(
    panel: Axes, outcome: Outcome, node: int, axis: int, colour: str, *, with_truth: bool
) -> None:
    index = outcome.track.net.index_of(node)
    truth = outcome.sequence.endcaps
    assert truth is not None
    if with_truth:
        panel.plot(
            truth.t_ns * 1e-9, truth.position[:, index, axis], color=TRUTH_COLOUR, label="truth"
        )
    panel.plot(
        outcome.track.t_ns * 1e-9,
        outcome.track.nodes[:, index, axis],
        color=colour,
        linewidth=0.8,
        label=str(outcome.setting),
    )


def _draw_face(panel: Axes, nodes: NDArray[np.float64], colour: str) -> None:
    corners = nodes[np.argsort(nodes[:, 2])[:3], :2]
    panel.fill(*corners.T, facecolor="none", edgecolor=colour, linewidth=0.8)


def _rests(position: NDArray[np.float64]) -> list[tuple[int, int]]:
    """First and last sample of each time that the same three nodes (T, n, 3) were the lowest, for
    at least a twentieth of the recording."""
    lowest = np.sort(np.argsort(position[:, :, 2], axis=1)[:, :3], axis=1)
    changes = np.flatnonzero(np.any(np.diff(lowest, axis=0) != 0, axis=1)) + 1
    bounds = [0, *changes.tolist(), len(position)]
    return [
        (start, stop - 1)
        for start, stop in itertools.pairwise(bounds)
        if stop - start > len(position) / 20
    ]
