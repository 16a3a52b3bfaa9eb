"""Results as a table: means over the recordings of a group, by method."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean

from tensegrity.evaluation import Metrics, published_result


@dataclass(frozen=True)
class Result:
    """One recording by one method."""

    group: str
    method: str
    recording: str
    metrics: Metrics


@dataclass(frozen=True)
class Summary:
    """What the table shows of several runs; ``None`` where no recording allows the figure."""

    runs: int
    drift_percent_mean: float | None
    drift_percent_worst: float | None
    rpe_trans_m_per_m: float | None
    rpe_rot_deg_per_m: float | None
    z_drift_m: float | None
    endcap_rmse_m: float | None
    nees_position_median: float | None
    nees_orientation_median: float | None


def summary(runs: Sequence[Metrics]) -> Summary:
    """Means over ``runs`` and the worst drift; the vertical drift counts without its sign."""

    def values(name: str) -> list[float]:
        return [abs(x) for x in (getattr(m, name) for m in runs) if x is not None]

    def mean(name: str) -> float | None:
        return fmean(values(name)) if values(name) else None

    return Summary(
        runs=len(runs),
        drift_percent_mean=mean("final_drift_percent"),
        drift_percent_worst=max(values("final_drift_percent"), default=None),
        rpe_trans_m_per_m=mean("rpe_trans_rmse_m_per_m"),
        rpe_rot_deg_per_m=mean("rpe_rot_rmse_deg_per_m"),
        z_drift_m=mean("z_drift_m"),
        endcap_rmse_m=mean("endcap_rmse_m"),
        nees_position_median=mean("nees_position_median"),
        nees_orientation_median=mean("nees_orientation_median"),
    )


# Header, field of Summary, format, and what a metre becomes.
_COLUMNS = (
    ("drift, mean [%]", "drift_percent_mean", ".1f", 1),
    ("worst [%]", "drift_percent_worst", ".1f", 1),
    ("RPE [m/m]", "rpe_trans_m_per_m", ".3f", 1),
    ("RPE [°/m]", "rpe_rot_deg_per_m", ".2f", 1),
    ("z drift [cm]", "z_drift_m", ".1f", 100),
    ("endcaps [mm]", "endcap_rmse_m", ".0f", 1000),
    ("NEES", "nees_position_median", ".1f", 1),
    ("rot. NEES", "nees_orientation_median", ".1f", 1),
)


def table(results: Sequence[Result]) -> str:
    """Markdown: a row per group and method, and one per method over all groups."""
    groups = list(dict.fromkeys(result.group for result in results))
    methods = list(dict.fromkeys(result.method for result in results))
    lines = [
        "| | method | runs | " + " | ".join(header for header, *_ in _COLUMNS) + " |",
        "|---|---|--:|" + "--:|" * len(_COLUMNS),
    ]
    for group in groups:
        for method in methods:
            of = [r.metrics for r in results if (r.group, r.method) == (group, method)]
            lines.append(_row(group, method, summary(of)))
        lines.extend(_published_row(group))
    if len(groups) > 1:
        for method in methods:
            of = [r.metrics for r in results if r.method == method]
            lines.append(_row("**all**", method, summary(of)))
    return "\n".join(lines) + "\n"


def _row(group: str, method: str, figures: Summary) -> str:
    cells = [group, method, str(figures.runs)]
    for _, name, form, scale in _COLUMNS:
        value = getattr(figures, name)
        cells.append("–" if value is None else format(scale * value, form))
    return "| " + " | ".join(cells) + " |"


def _published_row(group: str) -> Iterable[str]:
    found = published_result(group)
    if found is not None:
        figures = found[1]
        published = Summary(
            runs=1,
            drift_percent_mean=figures.final_drift_percent,
            drift_percent_worst=None,
            rpe_trans_m_per_m=figures.rpe_trans_rmse_m_per_m,
            rpe_rot_deg_per_m=figures.rpe_rot_rmse_deg_per_m,
            z_drift_m=None,
            endcap_rmse_m=None,
            nees_position_median=None,
            nees_orientation_median=None,
        )
        yield _row(group, "T, Table II", published)
