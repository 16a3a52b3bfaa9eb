"""Distances between the estimated endcaps against the true ones (as Tong et al. 2024, Fig. 6)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from tensegrity.plotting import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tensegrity.evaluation import Comparison


def draw(runs: Mapping[str, Comparison]) -> Figure:
    """One panel per cable over time, of runs of one recording by label."""
    first = next(iter(runs.values()))
    colours = style.colours(runs)
    columns = 3
    rows = -(-len(first.cable_names) // columns)
    with style.new_figure(8.0, 0.6 + 1.6 * rows) as figure:
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for k, (panel, name) in enumerate(zip(panels.flat, first.cable_names, strict=False)):
            for label, run in runs.items():
                panel.plot(
                    run.t_s, run.estimate.cable_lengths[:, k], color=colours[label], label=label
                )
            # The truth is dashed and on top: otherwise good estimates hide it.
            panel.plot(
                first.t_s,
                first.truth.cable_lengths[:, k],
                color=style.TRUTH_COLOUR,
                linestyle=(0, (4, 3)),
                linewidth=0.7,
                label="truth",
            )
            panel.set_title(f"cable {name}", pad=3.0)
        for panel in panels[:, 0]:
            panel.set_ylabel("length [m]")
        for panel in panels[-1]:
            panel.set_xlabel("time [s]")
        style.legend_above(figure, panels[0, 0].lines)
        return figure
