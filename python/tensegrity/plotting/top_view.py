"""The path seen from above (as Tong et al. 2024, Fig. 9)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from tensegrity.plotting import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tensegrity.evaluation import Comparison


def draw(runs: Mapping[str, Comparison]) -> Figure:
    """True and estimated paths of the IMU in the horizontal plane, of runs by label."""
    first = next(iter(runs.values()))
    colours = style.colours(runs)
    with style.new_figure(6.0, 5.0) as figure:
        panel = figure.subplots()
        true_xy = first.truth.position[:, :2]
        panel.plot(*true_xy.T, color=style.TRUTH_COLOUR, linewidth=1.4, label="truth")
        for label, run in runs.items():
            xy = run.estimate.position[:, :2]
            panel.plot(*xy.T, color=colours[label], label=label)
            panel.plot(*xy[-1], marker="s", markersize=6, color=colours[label])
        panel.plot(*true_xy[-1], marker="s", markersize=6, color=style.TRUTH_COLOUR)
        panel.plot(
            *true_xy[0],
            marker="o",
            markersize=7,
            color=style.TRUTH_COLOUR,
            markerfacecolor="white",
            linestyle="none",
            label="start",
        )
        panel.plot([], [], marker="s", markersize=6, color="grey", linestyle="none", label="end")
        panel.set_aspect("equal", adjustable="datalim")
        panel.set_xlabel("x [m]")
        panel.set_ylabel("y [m]")
        style.legend_above(figure, panel.get_legend_handles_labels()[0])
        return figure
