"""The figures by which runs are compared, and ``metrics.json``."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError
from scipy.spatial.transform import Rotation

from tensegrity.errors import InputError, MissingExtraError
from tensegrity.evaluation.alignment import Alignment
from tensegrity.evaluation.comparison import Comparison, Motion, compare
from tensegrity.evaluation.consistency import Innovations, band

if TYPE_CHECKING:
    from tensegrity.sequence.sequence import Sequence
    from tensegrity.trajectory import Trajectory

FloatArray = NDArray[np.float64]

RPE_DELTA_M = 1.0
"""Length of the path pieces whose relative pose is compared [m], as Tong et al. 2024, Table II."""


@dataclass(frozen=True)
class Metrics:
    """One run against the truth. ``None`` where the recording does not allow the figure.

    * ``method``, ``sequence``, ``alignment`` what was evaluated and how it was aligned
    * ``path_length_m`` true 3-D path of the IMU over the evaluated stamps [m]
    * ``path_length_com_m`` true horizontal path of the centre of mass [m], from the endcaps of
      uniform rods; shorter, since the IMU circles around the centre of mass as the robot rolls
    * ``final_drift_m`` position error at the last stamp [m]; ``final_drift_percent`` of
      ``path_length_m``
    * ``rpe_trans_rmse_m_per_m``, ``rpe_rot_rmse_deg_per_m`` relative pose error over all pieces of
      1 m of the true path, root mean square
    * ``ate_rmse_m`` position error over all stamps, root mean square [m]
    * ``z_drift_m`` vertical error at the last stamp, estimate minus truth [m]
    * ``endcap_rmse_m`` distance of estimated from true endcaps in the body frame, root mean square
      over endcaps and stamps [m]
    * ``cable_rmse_m`` error of the distances between the estimated endcaps, root mean square over
      cables and stamps [m]
    * ``nees_position_median`` median over the moving stamps of e^T P^-1 e / 3 for the position
      error e; 0.79 when P is exact, larger when the estimator is over-confident.
      ``nees_position_mean`` their mean, 1 when P is exact, and ``nees_position_in_band_percent``
      the share of them in the two-sided 95 % band of single samples, 0.072 to 3.12 [%]
    * ``nees_orientation_...``, ``nees_velocity_...`` the same for the rotation vector of the
      orientation error and for the velocity error, in the world
    * ``nis_cables_median``, ``nis_cables_mean`` z^T S^-1 z / m over the updates of moving stamps by
      m cable lengths, z the innovation and S its covariance; the mean is 1 when S is exact.
      ``nis_ground_...`` the same for the heights of the feet above the ground. ``None`` when the
      filter has no such updates
    * ``initial_tilt_deg`` error of the estimated vertical while the robot still stands [deg]
    * ``runtime_s`` time spent in the estimator [s]; ``real_time_factor`` recorded time per runtime
    """

    method: str
    sequence: str
    alignment: Alignment
    path_length_m: float
    path_length_com_m: float | None
    final_drift_m: float
    final_drift_percent: float | None
    rpe_trans_rmse_m_per_m: float | None
    rpe_rot_rmse_deg_per_m: float | None
    ate_rmse_m: float
    z_drift_m: float
    endcap_rmse_m: float | None
    cable_rmse_m: float | None
    nees_position_median: float | None
    nees_position_mean: float | None
    nees_position_in_band_percent: float | None
    nees_orientation_median: float | None
    nees_orientation_mean: float | None
    nees_orientation_in_band_percent: float | None
    nees_velocity_median: float | None
    nees_velocity_mean: float | None
    nees_velocity_in_band_percent: float | None
    nis_cables_median: float | None
    nis_cables_mean: float | None
    nis_ground_median: float | None
    nis_ground_mean: float | None
    initial_tilt_deg: float
    runtime_s: float
    real_time_factor: float | None

    def save(self, path: str | Path) -> None:
        """Write ``metrics.json``; unknown figures are ``null``."""
        Path(path).write_text(
            json.dumps(dataclasses.asdict(self), indent=2) + "\n", encoding="utf-8"
        )

    @classmethod
    def load(cls, path: str | Path) -> Metrics:
        """Read what :meth:`save` wrote; anything else raises :class:`InputError`."""
        path = Path(path)
        try:
            return TypeAdapter(cls).validate_json(path.read_bytes())
        except OSError as error:
            raise InputError(
                f"cannot be read: {error.strerror}", file=path, hint="run 'tensegrity evaluate'"
            ) from error
        except ValidationError as error:
            first = error.errors()[0]
            raise InputError(
                first["msg"],
                file=path,
                field=".".join(str(part) for part in first["loc"]) or None,
                hint="run 'tensegrity evaluate' to write it again",
            ) from error


def evaluate(
    trajectory: Trajectory, sequence: Sequence, alignment: Alignment = Alignment.POSE
) -> Metrics:
    """Compare an estimate with the truth of the recording it was made from.

    Raises :class:`InputError` when there is no truth, :class:`MissingExtraError` without evo.
    """
    return measure(compare(trajectory, sequence, alignment), trajectory.runtime_s)


def measure(comparison: Comparison, runtime_s: float) -> Metrics:
    """The metrics of an estimate that is already aligned; ``runtime_s`` as in :class:`Metrics`."""
    truth, estimate = comparison.truth, comparison.estimate
    error = estimate.position - truth.position
    drift = float(np.linalg.norm(error[-1]))
    path = float(np.linalg.norm(np.diff(truth.position, axis=0), axis=1).sum())
    rpe_trans, rpe_rot = _relative_pose_error(comparison)
    duration = float(comparison.t_s[-1] - comparison.t_s[0])
    return Metrics(
        method=comparison.method,
        sequence=comparison.sequence,
        alignment=comparison.alignment,
        path_length_m=path,
        path_length_com_m=_centre_of_mass_path(comparison),
        final_drift_m=drift,
        final_drift_percent=100.0 * drift / path if path > 0.0 else None,
        rpe_trans_rmse_m_per_m=rpe_trans,
        rpe_rot_rmse_deg_per_m=rpe_rot,
        ate_rmse_m=math.sqrt(float(np.mean(np.sum(error**2, axis=1)))),
        z_drift_m=float(error[-1, 2]),
        endcap_rmse_m=_rms(np.linalg.norm(estimate.endcaps_body - truth.endcaps_body, axis=2)),
        cable_rmse_m=_rms(estimate.cable_lengths - truth.cable_lengths),
        **_nees_figures("position", comparison.position_nees()[comparison.still :]),
        **_nees_figures("orientation", comparison.orientation_nees()[comparison.still :]),
        **_nees_figures("velocity", comparison.velocity_nees()[comparison.still :]),
        **_nis_figures("cables", comparison.cable_innovations, comparison.still),
        **_nis_figures("ground", comparison.ground_innovations, comparison.still),
        initial_tilt_deg=math.degrees(comparison.initial_tilt_rad),
        runtime_s=runtime_s,
        real_time_factor=duration / runtime_s if runtime_s > 0.0 else None,
    )


def _rms(values: FloatArray) -> float | None:
    """Root mean square of what is known (not NaN)."""
    known = values[np.isfinite(values)]
    return math.sqrt(float(np.mean(known**2))) if known.size else None


def _centre_of_mass_path(comparison: Comparison) -> float | None:
    """Horizontal path of the true centre of mass [m]: the mean of the endcaps of uniform rods."""
    known = np.isfinite(comparison.truth.endcaps_body).all(axis=(1, 2))
    if not known.any():
        return None
    centre_body = comparison.truth.endcaps_body[known].mean(axis=1)
    centre = comparison.truth.position[known] + comparison.truth.orientation[known].apply(
        centre_body
    )
    return float(np.linalg.norm(np.diff(centre[:, :2], axis=0), axis=1).sum())


def _nees_figures(name: str, nees: FloatArray) -> dict[str, float | None]:
    """The fields ``nees_<name>_...`` of :class:`Metrics`; ``nees`` has three degrees of freedom."""
    known = nees[np.isfinite(nees)]
    lower, upper = band(3)
    inside = (lower <= known) & (known <= upper)
    return {
        f"nees_{name}_median": float(np.median(known)) if known.size else None,
        f"nees_{name}_mean": float(np.mean(known)) if known.size else None,
        f"nees_{name}_in_band_percent": 100.0 * float(np.mean(inside)) if known.size else None,
    }


def _nis_figures(name: str, innovations: Innovations, first: int) -> dict[str, float | None]:
    """The fields ``nis_<name>_...`` of :class:`Metrics`, from the updates since stamp ``first``."""
    nis = innovations.nis[first:][innovations.updates[first:]]
    return {
        f"nis_{name}_median": float(np.median(nis)) if nis.size else None,
        f"nis_{name}_mean": float(np.mean(nis)) if nis.size else None,
    }


def _relative_pose_error(comparison: Comparison) -> tuple[float | None, float | None]:
    """Root mean square of the relative pose error per metre: translation [m], rotation [deg].

    The pieces of 1 m are taken along the true path. evo's default is the estimate's path, but a
    jittering estimate collects a metre of path while the robot travels less, which flatters it.
    ``None`` when the robot travelled less than 1 m.
    """
    try:
        from evo.core.filters import FilterException
        from evo.core.metrics import RPE, PoseRelation, StatisticsType, Unit
        from evo.core.trajectory import PoseTrajectory3D
    except ImportError as error:
        raise MissingExtraError("evaluation", "viz") from error

    def path(motion: Motion) -> PoseTrajectory3D:
        quaternion_wxyz = motion.orientation.as_quat()[:, [3, 0, 1, 2]]
        return PoseTrajectory3D(motion.position, quaternion_wxyz, comparison.t_s)

    # One search for the pieces serves both figures: evo keeps the error poses in ``rpe.E``.
    rpe = RPE(
        PoseRelation.translation_part,
        delta=RPE_DELTA_M,
        delta_unit=Unit.meters,
        all_pairs=True,
        pairs_from_reference=True,
    )
    try:
        rpe.process_data((path(comparison.truth), path(comparison.estimate)))
    except FilterException:
        return None, None
    rotation = Rotation.from_matrix(np.array([pose[:3, :3] for pose in rpe.E])).magnitude()
    return (
        float(rpe.get_statistic(StatisticsType.rmse)),
        math.degrees(math.sqrt(float(np.mean(rotation**2)))),
    )
