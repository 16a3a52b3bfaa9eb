"""Figures of a calibration of ranges: residuals, and the anchors around the robot's path."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tensegrity.plotting.style import new_figure, save
from tensegrity.ranging.calibration import RangeCalibration

_SHOWN_M = 1.0  # residuals beyond are drawn at the edge
_BINS = 81
_ELLIPSE_STD = 3.0
_COLOUR, _SECOND_COLOUR = "#0072B2", "#D55E00"


def draw_residuals(result: RangeCalibration, path: Path) -> Path:
    """Residuals over time, their distribution by anchor, and their histogram."""
    residuals = result.residuals
    shown = np.clip(residuals.residual_m, -_SHOWN_M, _SHOWN_M)
    with new_figure(8.0, 6.0) as figure:
        over_time, by_anchor, histogram = figure.subplots(3, 1)
        over_time.plot(residuals.t, shown, ".", markersize=1.5, color=_COLOUR)
        over_time.set(xlabel="time [s]", ylabel="residual [m]", ylim=(-_SHOWN_M, _SHOWN_M))
        ids = result.anchors.ids
        by_anchor.boxplot(
            [shown[residuals.anchor == anchor] for anchor in ids],
            tick_labels=[str(anchor) for anchor in ids],
            whis=(5, 95),
            showfliers=False,
        )
        by_anchor.set(xlabel="anchor", ylabel="residual [m]")
        histogram.hist(shown, bins=np.linspace(-_SHOWN_M, _SHOWN_M, _BINS), color=_COLOUR)
        histogram.set(xlabel="predicted minus measured range [m]", ylabel="ranges", yscale="log")
        return save(figure, path)


def draw_constellation(result: RangeCalibration, path: Path) -> Path:
    """Anchors with three standard deviations and the path of the modules, from above and from the
    side."""
    from matplotlib.patches import Ellipse

    position = result.anchors.position_m
    modules = np.vstack(list(result.modules.values()))
    with new_figure(8.0, 8.0) as figure:
        above, side = figure.subplots(2, 1, height_ratios=(3, 1))
        for axes, second, label in ((above, 1, "y [m]"), (side, 2, "z [m]")):
            axes.plot(modules[:, 0], modules[:, second], ".", markersize=0.6, color="#909090")
            axes.plot(position[:, 0], position[:, second], "^", color=_SECOND_COLOUR)
            for index, (anchor, at) in enumerate(
                zip(result.anchors.ids.tolist(), position, strict=True)
            ):
                axes.annotate(
                    str(anchor), at[[0, second]], textcoords="offset points", xytext=(5, 5)
                )
                rows = [3 * index, 3 * index + second]
                block = result.anchor_covariance[np.ix_(rows, rows)]
                if np.isfinite(block).all():
                    values, vectors = np.linalg.eigh(block)
                    width, height = 2 * _ELLIPSE_STD * np.sqrt(np.maximum(values, 0.0))
                    angle = float(np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0])))
                    axes.add_patch(
                        Ellipse(
                            tuple(at[[0, second]]),
                            width,
                            height,
                            angle=angle,
                            fill=False,
                            color=_SECOND_COLOUR,
                        )
                    )
            axes.set(xlabel="x [m]", ylabel=label, aspect="equal")
        return save(figure, path)
