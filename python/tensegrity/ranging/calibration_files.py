"""A calibration as a directory: anchors, offsets, what is known about them, figures."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tensegrity.errors import InputError
from tensegrity.files import new_directory, read_text
from tensegrity.ranging.calibration import RangeCalibration
from tensegrity.ranging.recording import (
    ANCHORS_FILE,
    OFFSETS_FILE,
    Anchors,
    Offsets,
    joined,
    read_anchors,
    read_offsets,
    write_anchors,
    write_offsets,
)

CALIBRATION_FILE = "calibration.json"


@dataclass(frozen=True)
class Calibration:
    """What a filter needs of a calibration directory: ``anchors`` with positions, ``offsets``, and
    the rest as ``report``, the content of calibration.json."""

    anchors: Anchors
    offsets: Offsets
    report: dict[str, Any]


def write_calibration(
    path: str | Path, result: RangeCalibration, *, overwrite: bool = False, figures: bool = True
) -> None:
    """Write a directory that :func:`read_calibration` reads, all at once or not at all.

    Raises :class:`InputError` when ``path`` is not free, and without matplotlib for ``figures``.
    """
    with new_directory(Path(path), marker=CALIBRATION_FILE, overwrite=overwrite) as folder:
        write_anchors(folder / ANCHORS_FILE, result.anchors)
        offsets = joined(result.offsets, result.internal_offsets)
        write_offsets(folder / OFFSETS_FILE, offsets)
        text = json.dumps(report_of(result), indent=2) + "\n"
        (folder / CALIBRATION_FILE).write_text(text, encoding="utf-8")
        if figures:
            from tensegrity.plotting.range_calibration import draw_constellation, draw_residuals

            draw_residuals(result, folder / "residuals.png")
            draw_constellation(result, folder / "constellation.png")


def read_calibration(path: str | Path) -> Calibration:
    """Anchors and offsets from a calibration directory.

    Raises :class:`InputError` for missing or damaged files and for anchors without a position.
    """
    path = Path(path)
    anchors, offsets = read_anchors(path / ANCHORS_FILE), read_offsets(path / OFFSETS_FILE)
    unknown = np.flatnonzero(~anchors.known.all(axis=1))
    if len(unknown):
        raise InputError(
            f"anchor {anchors.ids[unknown[0]]} has no position",
            file=path / ANCHORS_FILE,
            line=int(unknown[0]) + 2,
            hint="run 'tensegrity calibrate' first",
        )
    file = path / CALIBRATION_FILE
    if not file.exists():  # surveyed by hand
        return Calibration(anchors, offsets, {})
    try:
        report = json.loads(read_text(file))
    except json.JSONDecodeError as error:
        raise InputError(f"is no JSON: {error.msg}", file=file, line=error.lineno) from None
    return Calibration(anchors, offsets, report)


def report_of(result: RangeCalibration) -> dict[str, Any]:
    """The content of calibration.json."""
    return {
        "verdict": result.verdict,
        "rich_enough": result.rich_enough,
        "warnings": list(result.warnings),
        "free_motions": list(result.free_motions),
        "solver": result.solver,
        "converged": result.converged,
        "iterations": result.iterations,
        "runtime_s": round(result.runtime_s, 3),
        "statistics": {name: _number(value) for name, value in result.statistics().items()},
        "anchor_std_m": {
            str(anchor): [_number(value) for value in std]
            for anchor, std in zip(result.anchors.ids.tolist(), result.anchor_std, strict=True)
        },
        "offset_std_m": _number(np.sqrt(np.mean(result.offset_std**2))),
        "rod_length_m": {
            "-".join(map(str, rod)): [_number(length), _number(std)]
            for rod, length, std in zip(
                result.rods, result.rod_length, result.rod_length_std, strict=True
            )
        },
        "model": asdict(result.model),
    }


def _number(value: float | int) -> float | int | None:
    """As JSON has it: no NaN, five digits."""
    if isinstance(value, int):
        return value
    return float(f"{value:.5g}") if np.isfinite(value) else None
