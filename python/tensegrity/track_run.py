"""The result of tracking a ranging robot, as a directory.

=================  =================================================================================
``endcaps.csv``    ``t_ns, q_<id>_x..z``: ends of the rods in the world [m]
``state.csv``      ``t_ns``, centre of mass [m] and its standard deviations, ids of the three lowest
                   nodes (lowest first), recent mean squared innovation in variances (1 is right)
``metrics.json``   what the filter used and rejected, and errors where the recording has truth
``path.png``       the centre of mass and the last face from above
=================  =================================================================================
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from tensegrity.files import new_directory
from tensegrity.ranging.sequence import ENDCAPS_FILE, RangingSequence, write_endcaps
from tensegrity.sequence.sequence import EndcapStream
from tensegrity.sequence.table import Column, write_csv
from tensegrity.tracking import Track, floor_errors, track_errors

STATE_FILE = "state.csv"
METRICS_FILE = "metrics.json"
FIGURE_FILE = "path.png"

_HEALTH = (
    "updates",
    "ranges_used",
    "ranges_rejected",
    "inclinations_used",
    "inclinations_rejected",
    "imu_rejected",
    "dropped",
    "gaps",
    "failed_predictions",
    "restarts",
)


def write_track(
    track: Track,
    path: str | Path,
    *,
    metrics: dict[str, Any],
    figure: bool = True,
    overwrite: bool = False,
) -> None:
    """Write the files above; the directory appears complete or not at all.

    Raises :class:`InputError` when ``path`` is not free, and without matplotlib for ``figure``.
    """
    with new_directory(Path(path), marker=STATE_FILE, overwrite=overwrite) as folder:
        endcaps = EndcapStream(track.t_ns, track.nodes)
        write_endcaps(folder / ENDCAPS_FILE, endcaps, track.net)
        std = np.sqrt(np.diagonal(track.centre_of_mass_covariance, axis1=1, axis2=2))
        columns = [
            *(Column(f"com_{axis}", "a coordinate [m]") for axis in "xyz"),
            *(Column(f"com_std_{axis}", "a standard deviation [m]") for axis in "xyz"),
            *(Column(f"face_{place}", "the id of a node") for place in (1, 2, 3)),
            Column("surprise", "a mean squared innovation"),
        ]
        write_csv(
            folder / STATE_FILE,
            columns,
            track.t_ns,
            np.column_stack([track.centre_of_mass, std, track.faces, track.surprise]),
        )
        (folder / METRICS_FILE).write_text(json.dumps(metrics, indent=2) + "\n", encoding="utf-8")
        if figure:
            from tensegrity.plotting.track import draw

            draw(track, folder / FIGURE_FILE)


def metrics_of(track: Track, sequence: RangingSequence, runtime_s: float) -> dict[str, Any]:
    """What became of the measurements, and errors against the truth that the recording has [m]."""
    duration = float(track.t_ns[-1] - track.t_ns[0]) * 1e-9
    metrics: dict[str, Any] = {name: getattr(track.health, name) for name in _HEALTH}
    metrics["runtime_s"] = runtime_s
    metrics["real_time_factor"] = duration / runtime_s
    if sequence.endcaps is not None:
        errors = track_errors(track, sequence.endcaps)
        metrics["centre_of_mass_rmse_m"] = errors.centre_of_mass_rmse
        metrics["endcap_rmse_m"] = errors.node_rmse
        metrics["nees_centre_of_mass_median"] = float(np.median(errors.nees)) / 3
        metrics["faces_right_percent"] = 100 * float(errors.face_right.mean())
    if sequence.floor_truth is not None:
        floor = floor_errors(track, sequence.floor_truth)
        seen = np.isfinite(floor).all(axis=1)
        metrics["floor_positions"] = int(seen.sum())
        if seen.any():
            metrics["floor_rmse_m"] = float(np.sqrt(np.mean(floor[seen] ** 2)))
    return metrics
