"""How far the estimated endcaps are from the true ones in the body frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from tensegrity.plotting import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tensegrity.evaluation import Comparison

_BASE_ROD_ENDCAPS = 2
"""The endcaps of the base rod have fixed positions in the body frame: no error to show."""


def draw(runs: Mapping[str, Comparison]) -> Figure:
    """One panel per endcap that is not on the base rod, over time, of runs by label."""
    first = next(iter(runs.values()))
    colours = style.colours(runs)
    endcaps = range(_BASE_ROD_ENDCAPS, first.truth.endcaps_body.shape[1])
    rows = -(-len(endcaps) // 2)
    with style.new_figure(8.0, 0.6 + 1.7 * rows) as figure:
        panels = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
        for panel, k in zip(panels.flat, endcaps, strict=False):
            for label, run in runs.items():
                error = run.estimate.endcaps_body[:, k] - run.truth.endcaps_body[:, k]
                panel.plot(
                    run.t_s,
                    1e3 * np.linalg.norm(error, axis=1),
                    color=colours[label],
                    linewidth=0.8,
                    label=label,
                )
            panel.set_title(f"endcap {k}", pad=3.0)
        panels[0, 0].set_ylim(bottom=0.0)
        for panel in panels[:, 0]:
            panel.set_ylabel("error [mm]")
        for panel in panels[-1]:
            panel.set_xlabel("time [s]")
        style.legend_above(figure, panels[0, 0].lines)
        return figure
