"""Whether errors and innovations are as large as the covariances say, over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from tensegrity.evaluation.consistency import BAND_PROBABILITY, Innovations, band
from tensegrity.plotting import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tensegrity.evaluation import Comparison
    from tensegrity.evaluation.consistency import FloatArray

_BAND_COLOUR = "#E4E4E4"
_BAND_LABEL = f"{100 * BAND_PROBABILITY:g} % band"
# Below the bands of two and more degrees of freedom; the errors right after the alignment, which
# are almost zero, would otherwise compress everything else.
_SMALLEST = 1e-3


def draw(runs: Mapping[str, Comparison]) -> Figure:
    """NEES of position and orientation, and where a run has them NIS of cables and ground.

    All per degree of freedom, from the first motion on, with the 95 % bands of single samples, of
    runs of one recording by label.
    """
    colours = style.colours(runs)
    cables = {label: run.cable_innovations for label, run in runs.items()}
    ground = {label: run.ground_innovations for label, run in runs.items()}
    innovations = {
        name: by_run
        for name, by_run in {"NIS of cables": cables, "NIS of ground": ground}.items()
        if any(one.updates.any() for one in by_run.values())
    }
    names = ["NEES of position", "NEES of orientation", *innovations]
    with style.new_figure(8.0, 0.6 + 1.7 * len(names)) as figure:
        axes = figure.subplots(len(names), 1, sharex=True)
        panels: dict[str, Axes] = dict(zip(names, axes, strict=True))
        for label, run in runs.items():
            colour = colours[label]
            _draw_nees(panels["NEES of position"], run, run.position_nees(), colour, label)
            _draw_nees(panels["NEES of orientation"], run, run.orientation_nees(), colour, label)
            for name, by_run in innovations.items():
                _draw_nis(panels[name], run, by_run[label], colour)
        for name, panel in panels.items():
            panel.set_yscale("log")
            panel.set_ylim(bottom=max(panel.get_ylim()[0], _SMALLEST))
            panel.set_title(f"{name}, per degree of freedom", pad=3.0)
            panel.set_ylabel(name.split()[0])
        axes[-1].set_xlabel("time [s]")
        figure.align_ylabels()
        handles, labels = axes[0].get_legend_handles_labels()
        # One entry for the bands, which are drawn with every run.
        by_label = dict(zip(labels, handles, strict=True))
        style.legend_above(figure, [by_label[key] for key in (*runs, _BAND_LABEL)])
        return figure


def _draw_nees(panel: Axes, run: Comparison, nees: FloatArray, colour: str, label: str) -> None:
    t_s = run.t_s[run.still :]
    _draw_band(panel, t_s, np.full(len(t_s), 3.0))
    panel.plot(t_s, nees[run.still :], color=colour, linewidth=0.8, label=label)


def _draw_nis(panel: Axes, run: Comparison, innovations: Innovations, colour: str) -> None:
    """A dot per update: a line between single innovations, which jump from one to the next, would
    cover the panel."""
    shown = innovations.updates & (np.arange(len(run.t_s)) >= run.still)
    t_s = run.t_s[shown]
    _draw_band(panel, t_s, innovations.degrees_of_freedom[shown])
    panel.plot(t_s, innovations.nis[shown], ".", color=colour, markersize=1.0, alpha=0.5)


def _draw_band(panel: Axes, t_s: FloatArray, degrees_of_freedom: FloatArray) -> None:
    panel.fill_between(
        t_s,
        *band(degrees_of_freedom),
        step="post",
        color=_BAND_COLOUR,
        linewidth=0,
        zorder=0,
        label=_BAND_LABEL,
    )
