"""Which commands there are."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Summary:
    """What the group's help and the command's own help say; the rest is at the command."""

    text: str
    example: str


COMMANDS = {
    "demo": Summary("Simulate, estimate, evaluate and draw, all at once.", "demo --out demo"),
    "simulate": Summary(
        "Record a simulated robot.", "simulate right-turn --out recordings/right --seed 3"
    ),
    "estimate": Summary(
        "Estimate shape and pose from a recording.",
        "estimate recordings/right --method full --out runs/right",
    ),
    "evaluate": Summary("Compare a run with the truth.", "evaluate runs/right"),
    "compare": Summary(
        "Print runs side by side.",
        "compare runs/right-paper runs/right-full --figures figures",
    ),
    "calibrate-robot": Summary(
        "Find cable offsets and IMU mounting from slow recordings.",
        "calibrate-robot recordings/slow --out robot.yaml",
    ),
    "calibrate": Summary(
        "Find anchors and range offsets from a recording of the moving robot.",
        "calibrate recordings/outdoor --anchors recordings/outdoor/anchors.csv --out calibration",
    ),
    "track": Summary(
        "Estimate where a ranging robot was.",
        "track recordings/rolling --calibration calibrations/hall --out runs/rolling",
    ),
    "experiment": Summary(
        "Repeat a published experiment in simulation.", "experiment superball-global --seeds 3"
    ),
    "config": Summary("Print a filter configuration.", "config paper > my.yaml"),
    "version": Summary("Print the version.", "version"),
}
"""Command NAME is the function NAME in the module ``tensegrity.cli.NAME``, with underscores for
hyphens."""
