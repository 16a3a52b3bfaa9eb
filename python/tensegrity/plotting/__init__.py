"""Figures of runs against the truth, as PNG files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tensegrity.plotting import cable_lengths, consistency, endcap_errors, pose, style, top_view

if TYPE_CHECKING:
    from tensegrity.evaluation import Comparison

__all__ = ["cable_lengths", "consistency", "endcap_errors", "pose", "save_figures", "top_view"]


def save_figures(runs: Mapping[str, Comparison], directory: str | Path) -> list[Path]:
    """Draw runs of one recording, by label, into ``directory`` (which is made if needed).

    Writes ``pose.png``, ``top_view.png`` and ``consistency.png``, and where the true endcaps are
    known ``cable_lengths.png`` and ``endcap_errors.png``. Returns the paths.
    """
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    figures = {"pose": pose.draw, "top_view": top_view.draw, "consistency": consistency.draw}
    if any(np.isfinite(run.truth.endcaps_body).any() for run in runs.values()):
        figures |= {"cable_lengths": cable_lengths.draw, "endcap_errors": endcap_errors.draw}
    return [style.save(draw(runs), directory / f"{name}.png") for name, draw in figures.items()]
