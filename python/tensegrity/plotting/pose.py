"""Position and orientation over time (as Tong et al. 2024, Figs. 7, 8 and 10)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tensegrity.plotting import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tensegrity.evaluation import Comparison

FloatArray = NDArray[np.float64]
_ANGLES = ("roll", "pitch", "yaw")


def draw(runs: Mapping[str, Comparison]) -> Figure:
    """x, y, z and roll, pitch, yaw with bands of two standard deviations, of runs by label."""
    first = next(iter(runs.values()))
    colours = style.colours(runs)
    true_angles = euler_angles(first.truth.orientation)
    with style.new_figure(8.0, 5.6) as figure:
        panels = figure.subplots(3, 2, sharex=True)
        for label, run in runs.items():
            angles = euler_angles(run.estimate.orientation)
            angle_sigma = euler_sigma(run.estimate.orientation, run.orientation_covariance)
            position_sigma = np.sqrt(np.diagonal(run.position_covariance, axis1=1, axis2=2))
            for k in range(3):
                _band(
                    panels[k, 0],
                    run.t_s,
                    run.estimate.position[:, k],
                    2 * position_sigma[:, k],
                    colours[label],
                    label,
                )
                _band(
                    panels[k, 1],
                    run.t_s,
                    np.degrees(_without_jumps(angles[:, k])),
                    np.degrees(2 * angle_sigma[:, k]),
                    colours[label],
                    label,
                )
        for k in range(3):
            for column, values in enumerate(
                (first.truth.position[:, k], np.degrees(_without_jumps(true_angles[:, k])))
            ):
                panels[k, column].plot(
                    first.t_s,
                    values,
                    color=style.TRUTH_COLOUR,
                    linestyle=(0, (4, 3)),
                    linewidth=0.8,
                    label="truth",
                )
            panels[k, 0].set_ylabel(f"{'xyz'[k]} [m]")
            panels[k, 1].set_ylabel(f"{_ANGLES[k]} [deg]")
            limit = 90 if _ANGLES[k] == "pitch" else 180
            panels[k, 1].set_yticks(np.linspace(-limit, limit, 5))
            panels[k, 1].set_ylim(-1.05 * limit, 1.05 * limit)
        for panel in panels[-1]:
            panel.set_xlabel("time [s]")
        figure.align_ylabels()
        style.legend_above(figure, panels[0, 0].lines)
        return figure


def euler_angles(orientation: Rotation) -> FloatArray:
    """Roll, pitch, yaw (N, 3) [rad] with R = Rz(yaw) Ry(pitch) Rx(roll)."""
    r = orientation.as_matrix()
    # SciPy's as_euler would warn at every pitch of 90 degrees, which a rolling robot passes.
    return np.stack(
        [
            np.arctan2(r[:, 2, 1], r[:, 2, 2]),
            np.arcsin(np.clip(-r[:, 2, 0], -1.0, 1.0)),
            np.arctan2(r[:, 1, 0], r[:, 0, 0]),
        ],
        axis=1,
    )


def euler_sigma(orientation: Rotation, covariance: FloatArray) -> FloatArray:
    """Standard deviations of roll, pitch, yaw (N, 3) [rad].

    ``covariance`` (N, 3, 3) is that of the rotation error in the world. To first order a rotation w
    in the world changes the angles by the inverse of their rate equation; at a pitch of 90 degrees
    roll and yaw are undefined and their standard deviations infinite, which pi stands for.
    """
    _, pitch, yaw = euler_angles(orientation).T
    c, s = np.cos(yaw), np.sin(yaw)
    zero, one = np.zeros_like(yaw), np.ones_like(yaw)
    secant, tangent = 1.0 / np.maximum(np.cos(pitch), 1e-9), np.tan(pitch)
    jacobian = np.stack(
        [
            np.stack([c * secant, s * secant, zero], axis=1),
            np.stack([-s, c, zero], axis=1),
            np.stack([c * tangent, s * tangent, one], axis=1),
        ],
        axis=1,
    )
    variance = np.einsum("nij,njk,nik->ni", jacobian, covariance, jacobian)
    return np.minimum(np.sqrt(variance), np.pi)


def _without_jumps(angle: FloatArray) -> FloatArray:
    """Not-a-number where an angle wraps, so that no line is drawn across the panel."""
    shown = angle.copy()
    shown[1:][np.abs(np.diff(angle)) > np.pi / 2] = np.nan
    return shown


def _band(
    panel: Axes, t: FloatArray, mean: FloatArray, half: FloatArray, colour: str, label: str
) -> None:
    panel.fill_between(t, mean - half, mean + half, color=colour, alpha=0.2, linewidth=0)
    panel.plot(t, mean, color=colour, label=f"{label} ± 2σ")
