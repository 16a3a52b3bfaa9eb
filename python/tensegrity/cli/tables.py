"""Metrics as tables for the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rich.table import Table

from tensegrity.evaluation import Metrics, PublishedResult

PUBLISHED = "T Table II"
"""Heading of the published figures; T is Tong et al. 2024."""


@dataclass(frozen=True)
class Row:
    """A figure of :class:`Metrics` and how to print it."""

    field: str
    label: str
    unit: str
    format: str

    def cell(self, column: Metrics | PublishedResult | None) -> str:
        """The figure as text, a dash where the column does not have it."""
        value = getattr(column, self.field, None)
        return "–" if value is None else format(value, self.format)


ROWS = (
    Row("path_length_m", "path of the IMU", "m", ".2f"),
    Row("path_length_com_m", "path of the centre of mass", "m", ".2f"),
    Row("final_drift_m", "final drift", "m", ".3f"),
    Row("final_drift_percent", "final drift", "%", ".2f"),
    Row("rpe_trans_rmse_m_per_m", "RPE translation, RMSE", "m/m", ".4f"),
    Row("rpe_rot_rmse_deg_per_m", "RPE rotation, RMSE", "deg/m", ".2f"),
    Row("ate_rmse_m", "ATE, RMSE", "m", ".3f"),
    Row("z_drift_m", "final vertical error", "m", "+.3f"),
    Row("endcap_rmse_m", "endcaps (body), RMSE", "m", ".4f"),
    Row("cable_rmse_m", "cable lengths, RMSE", "m", ".4f"),
    Row("nees_position_median", "NEES of position, median", "", ".2f"),
    Row("nees_position_mean", "NEES of position, mean", "", ".2f"),
    Row("nees_position_in_band_percent", "NEES of position, in 95 % band", "%", ".0f"),
    Row("nees_orientation_median", "NEES of orientation, median", "", ".2f"),
    Row("nees_orientation_mean", "NEES of orientation, mean", "", ".2f"),
    Row("nees_orientation_in_band_percent", "NEES of orientation, in 95 % band", "%", ".0f"),
    Row("nees_velocity_median", "NEES of velocity, median", "", ".2f"),
    Row("nees_velocity_mean", "NEES of velocity, mean", "", ".2f"),
    Row("nees_velocity_in_band_percent", "NEES of velocity, in 95 % band", "%", ".0f"),
    Row("nis_cables_median", "NIS of cables, median", "", ".2f"),
    Row("nis_cables_mean", "NIS of cables, mean", "", ".2f"),
    Row("nis_ground_median", "NIS of ground, median", "", ".2f"),
    Row("nis_ground_mean", "NIS of ground, mean", "", ".2f"),
    Row("initial_tilt_deg", "tilt at the start", "deg", ".3f"),
    Row("runtime_s", "runtime", "s", ".3f"),
    Row("real_time_factor", "times real time", "", ".0f"),
)

DEMO_FIELDS = (
    "path_length_m",
    "final_drift_m",
    "final_drift_percent",
    "rpe_trans_rmse_m_per_m",
    "rpe_rot_rmse_deg_per_m",
    "z_drift_m",
    "endcap_rmse_m",
    "cable_rmse_m",
    "nees_position_median",
    "nees_orientation_median",
    "real_time_factor",
)
"""What the table over several recordings shows."""


def metrics_table(
    recording: str,
    columns: Mapping[str, Metrics],
    published: tuple[str, PublishedResult] | None,
) -> Table:
    """One row per metric, one column per run and one for the published figures, if any."""
    alignments = " or ".join(sorted({metrics.alignment for metrics in columns.values()}))
    table = Table(title=f"{recording}, aligned by initial {alignments}", title_justify="left")
    table.add_column("metric")
    table.add_column("unit")
    for name in columns:
        table.add_column(name, justify="right")
    if published is not None:
        table.add_column(f"{PUBLISHED} ({published[0]})", justify="right", style="dim")
    for row in ROWS:
        cells = [row.cell(metrics) for metrics in columns.values()]
        if published is not None:
            cells.append(row.cell(published[1]))
        table.add_row(row.label, row.unit, *cells)
    return table


def demo_table(
    runs: Mapping[str, Mapping[str, Metrics]], published: Mapping[str, PublishedResult]
) -> Table:
    """One block of rows per recording (outer key), one column per method (inner key)."""
    methods = list(next(iter(runs.values())))
    table = Table(title="Estimates against the truth", title_justify="left")
    for heading in ("recording", "metric", "unit"):
        table.add_column(heading)
    for method in methods:
        table.add_column(method, justify="right")
    table.add_column(PUBLISHED, justify="right", style="dim")
    rows = [row for row in ROWS if row.field in DEMO_FIELDS]
    for recording, metrics in runs.items():
        for row in rows:
            cells = [row.cell(metrics[method]) for method in methods]
            cells.append(row.cell(published.get(recording)))
            table.add_row(
                recording if row is rows[0] else "",
                row.label,
                row.unit,
                *cells,
                end_section=row is rows[-1],
            )
    return table
