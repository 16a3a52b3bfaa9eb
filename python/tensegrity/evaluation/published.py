"""What Tong et al. 2024 ("Tensegrity Robot Proprioceptive State Estimation with Geometric
Constraints") report, to compare with.

Their simulated recordings are not public: the figures belong to other recordings of the same four
manoeuvres, with the same robot and the same sensor noise.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PublishedResult:
    """One column of Table II; fields are named as in :class:`tensegrity.evaluation.Metrics`."""

    path_length_m: float
    final_drift_m: float
    final_drift_percent: float
    rpe_trans_rmse_m_per_m: float
    rpe_rot_rmse_deg_per_m: float
    cable_rmse_m: float | None = None


# One number for shape reconstruction over the simulated recordings (section VI-B).
_CABLE_RMSE_M = 0.0463

TABLE_II: dict[str, PublishedResult] = {
    "forward": PublishedResult(7.50, 0.3275, 4.37, 0.0911, 2.86, _CABLE_RMSE_M),
    "backward": PublishedResult(6.74, 0.3386, 5.02, 0.0936, 3.72, _CABLE_RMSE_M),
    "left-turn": PublishedResult(18.61, 0.8221, 4.42, 0.1159, 3.94, _CABLE_RMSE_M),
    "right-turn": PublishedResult(15.70, 0.7610, 4.85, 0.1022, 3.18, _CABLE_RMSE_M),
    "forward-realworld": PublishedResult(5.02, 0.1174, 2.34, 0.1927, 10.84),
}
"""Table II by manoeuvre; the first four are simulated, the last is the real robot."""

# Looked for in a recording's name, most specific first.
_KEYWORDS = (
    ("realworld", "forward-realworld"),
    ("forward", "forward"),
    ("backward", "backward"),
    ("left", "left-turn"),
    ("right", "right-turn"),
)


def published_result(sequence_name: str) -> tuple[str, PublishedResult] | None:
    """The column of Table II whose manoeuvre the recording's name mentions, if any.

    ``right``, ``right-turn`` and ``2024_right_3`` all give ``("right-turn", ...)``.
    """
    name = sequence_name.lower()
    for keyword, manoeuvre in _KEYWORDS:
        if keyword in name:
            return manoeuvre, TABLE_II[manoeuvre]
    return None
