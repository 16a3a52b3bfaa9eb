"""The path of a ranging robot from above."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tensegrity.plotting.style import legend_above, new_figure, save

if TYPE_CHECKING:
    from tensegrity.tracking import Track

_COLOUR = "#0072B2"


def draw(track: Track, path: Path) -> Path:
    """Centre of mass over time, and the first and last three lowest nodes."""
    with new_figure(6.0, 5.0) as figure:
        panel = figure.subplots()
        panel.plot(*track.centre_of_mass[:, :2].T, color=_COLOUR, label="centre of mass")
        for at, label, style in ((0, "first face", ":"), (len(track) - 1, "last face", "-")):
            lowest = np.argsort(track.nodes[at, :, 2])[:3]
            corners = track.nodes[at, lowest, :2]
            panel.plot(*corners[[0, 1, 2, 0]].T, style, color="black", label=label)
            for corner, node in zip(corners, lowest, strict=True):
                panel.annotate(
                    str(track.net.node_ids[int(node)]),
                    corner,
                    textcoords="offset points",
                    xytext=(4, 4),
                )
        panel.set_aspect("equal", adjustable="datalim")
        panel.set(xlabel="x [m]", ylabel="y [m]")
        legend_above(figure, panel.get_legend_handles_labels()[0])
        return save(figure, path)
