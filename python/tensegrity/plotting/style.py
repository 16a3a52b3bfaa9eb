"""How every figure looks: colours, sizes, the time axis, the file."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tensegrity.errors import MissingExtraError

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

    from tensegrity.evaluation import Comparison

TRUTH_COLOUR = "black"
# Okabe and Ito's palette, which people with any colour vision tell apart (without its yellow, which
# is too light for lines on white). A method keeps its colour in every figure.
_METHOD_COLOURS = {"full": "#0072B2", "paper": "#D55E00"}
_FURTHER_COLOURS = ("#009E73", "#CC79A7", "#56B4E9", "#E69F00")

_SETTINGS: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E0E0E0",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "lines.linewidth": 1.0,
    "lines.solid_joinstyle": "round",
    "savefig.dpi": 150,
    # A stretch of an estimate that diverged can be longer than Agg draws in one piece.
    "agg.path.chunksize": 10_000,
}


@contextmanager
def new_figure(width: float, height: float) -> Iterator[Figure]:
    """An empty figure of the given size [inch] in this package's style.

    It belongs to no window and to no global state, so that it works without a display and in
    threads. Raises :class:`MissingExtraError` without matplotlib.
    """
    try:
        import matplotlib
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtraError("drawing figures", "viz") from error
    with matplotlib.rc_context(_SETTINGS):
        yield Figure(figsize=(width, height), layout="constrained")


def colours(runs: Mapping[str, Comparison]) -> dict[str, str]:
    """A colour for every run by label; the first run of a method has the method's."""
    methods = dict(_METHOD_COLOURS)
    further = itertools.cycle(_FURTHER_COLOURS)
    return {label: methods.pop(run.method, "") or next(further) for label, run in runs.items()}


def legend_above(figure: Figure, handles: Iterable[Artist]) -> None:
    """One legend for all panels, in a row over them."""
    handles = list(handles)
    figure.legend(handles=handles, loc="outside upper center", ncols=min(len(handles), 6))


def save(figure: Figure, path: Path) -> Path:
    """Write the figure as PNG and return its path."""
    import matplotlib

    with matplotlib.rc_context(_SETTINGS):  # some settings count only when the file is drawn
        figure.savefig(path, format="png")
    return path
