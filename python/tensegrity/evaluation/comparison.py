"""An estimate and the truth at the same stamps, in the same world.

Both metrics and figures start from here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from tensegrity.errors import InputError
from tensegrity.evaluation.alignment import Alignment, initial_transform, still_count
from tensegrity.evaluation.consistency import Innovations, normalised_error_squared
from tensegrity.sequence.sequence import CableStream, EndcapStream, PoseStream, Sequence

if TYPE_CHECKING:
    from tensegrity.trajectory import Trajectory

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

MAX_TIME_DIFFERENCE_NS = 10_000_000
"""A stamp counts as covered by the truth when a true sample is this close [ns] (evo's default)."""


@dataclass(frozen=True)
class Motion:
    """Where the robot is, M stamps, E endcaps, C cables.

    ``position`` (M, 3) [m], ``orientation`` (M) and ``velocity`` (M, 3) [m/s] of the body in the
    world of the truth; ``endcaps_body`` (M, E, 3) [m] in the body frame and ``cable_lengths``
    (M, C) [m] between them, in the order of ``robot.cables``. Rows without knowledge of the endcaps
    are NaN.
    """

    position: FloatArray
    orientation: Rotation
    velocity: FloatArray
    endcaps_body: FloatArray
    cable_lengths: FloatArray


@dataclass(frozen=True)
class Comparison:
    """One estimate and the truth, at the M stamps of the estimate that the truth covers.

    * ``t_s`` (M,) since the first sample of the recording [s]
    * ``position_covariance``, ``orientation_covariance``, ``velocity_covariance`` (M, 3, 3) of the
      estimate in the world of the truth [m^2], [rad^2], [m^2/s^2]
    * ``cable_innovations``, ``ground_innovations`` of the filter, which need no truth; the degrees
      of freedom are the cables measured at the newest stamp and the feet held as contacts
    * ``still`` number of leading stamps at which the robot has not moved yet
    * ``initial_tilt_rad`` error of the estimated vertical over those stamps, before alignment
    """

    method: str
    sequence: str
    cable_names: tuple[str, ...]
    t_s: FloatArray
    estimate: Motion
    truth: Motion
    position_covariance: FloatArray
    orientation_covariance: FloatArray
    velocity_covariance: FloatArray
    cable_innovations: Innovations
    ground_innovations: Innovations
    alignment: Alignment
    still: int
    initial_tilt_rad: float

    def position_nees(self) -> FloatArray:
        """Normalised error squared of the position per degree of freedom (M,)."""
        error = self.estimate.position - self.truth.position
        return normalised_error_squared(error, self.position_covariance)

    def orientation_nees(self) -> FloatArray:
        """That of the rotation vector, in the world, from the true to the estimated orientation."""
        error = (self.estimate.orientation * self.truth.orientation.inv()).as_rotvec()
        return normalised_error_squared(error, self.orientation_covariance)

    def velocity_nees(self) -> FloatArray:
        """That of the velocity."""
        error = self.estimate.velocity - self.truth.velocity
        return normalised_error_squared(error, self.velocity_covariance)


def compare(
    trajectory: Trajectory, sequence: Sequence, alignment: Alignment = Alignment.POSE
) -> Comparison:
    """Bring an estimate to the stamps and into the world of the truth.

    The truth is interpolated at the estimate's stamps (linearly, orientations on the great circle);
    its velocity is the central difference of its positions at their own stamps. Stamps outside the
    truth or further than ``MAX_TIME_DIFFERENCE_NS`` from any true sample are left out.

    Raises :class:`InputError` when the recording has no ground truth or it covers no estimate.
    """
    if sequence.groundtruth is None:
        raise InputError(
            f"recording '{sequence.name}' has no ground truth to evaluate against",
            hint="evaluation needs groundtruth.tum in the recording",
        )
    if len(sequence.groundtruth.t_ns) < 2:
        raise InputError(f"the ground truth of recording '{sequence.name}' is a single pose")
    covered = _covered(trajectory.t_ns, sequence.groundtruth.t_ns)
    if not covered.any():
        raise InputError(
            f"the ground truth of recording '{sequence.name}' covers none of the estimate's stamps",
            hint="is this the recording that the run was made from?",
        )
    t_ns = trajectory.t_ns[covered]
    true_position, true_orientation, true_velocity = _interpolate(sequence.groundtruth, t_ns)
    position = trajectory.position[covered]
    orientation = Rotation.from_quat(trajectory.quaternion[covered])

    still = still_count(true_position, true_orientation)
    rotation, translation, tilt = initial_transform(
        position[:still],
        orientation[:still],
        true_position[:still],
        true_orientation[:still],
        alignment,
    )
    cables = [cable.endcaps for cable in sequence.robot.cables]
    endcaps_body = trajectory.endcaps_body[covered]
    true_endcaps_body = _endcaps_in_body(
        sequence.endcaps, t_ns, true_position, true_orientation, endcaps_body.shape[1]
    )
    r = rotation.as_matrix()
    return Comparison(
        method=str(trajectory.info.get("method", "")),
        sequence=sequence.name,
        cable_names=tuple(f"{i}–{j}" for i, j in cables),
        t_s=(t_ns - sequence.imu.t_ns[0]) * 1e-9,
        estimate=Motion(
            position=rotation.apply(position) + translation,
            orientation=rotation * orientation,
            velocity=rotation.apply(trajectory.velocity[covered]),
            endcaps_body=endcaps_body,
            cable_lengths=_distances(endcaps_body, cables),
        ),
        truth=Motion(
            position=true_position,
            orientation=true_orientation,
            velocity=true_velocity,
            endcaps_body=true_endcaps_body,
            cable_lengths=_distances(true_endcaps_body, cables),
        ),
        position_covariance=r @ trajectory.position_covariance[covered] @ r.T,
        orientation_covariance=r @ trajectory.orientation_covariance[covered] @ r.T,
        velocity_covariance=r @ trajectory.velocity_covariance[covered] @ r.T,
        cable_innovations=Innovations(
            trajectory.cable_nis[covered], _measured_cables(sequence.cables, t_ns)
        ),
        ground_innovations=Innovations(
            trajectory.ground_nis[covered], trajectory.contacts[covered].sum(axis=1, dtype=float)
        ),
        alignment=alignment,
        still=still,
        initial_tilt_rad=tilt,
    )


def _covered(t_ns: IntArray, truth_ns: IntArray) -> BoolArray:
    """Stamps between two true samples, the nearer within ``MAX_TIME_DIFFERENCE_NS``, (N,)."""
    after = np.searchsorted(truth_ns, t_ns).clip(1, len(truth_ns) - 1)
    nearest = np.minimum(np.abs(truth_ns[after] - t_ns), np.abs(t_ns - truth_ns[after - 1]))
    inside = (truth_ns[0] <= t_ns) & (t_ns <= truth_ns[-1])
    return inside & (nearest <= MAX_TIME_DIFFERENCE_NS)


def _interpolate(truth: PoseStream, t_ns: IntArray) -> tuple[FloatArray, Rotation, FloatArray]:
    """Position, orientation and velocity of the truth at ``t_ns``."""
    # Relative stamps: nanoseconds since 1970 do not fit into the mantissa of a double.
    known = (truth.t_ns - truth.t_ns[0]) * 1e-9
    wanted = (t_ns - truth.t_ns[0]) * 1e-9

    def at_wanted(values: FloatArray) -> FloatArray:
        return np.stack([np.interp(wanted, known, column) for column in values.T], axis=1)

    velocity = np.gradient(truth.position, known, axis=0)
    orientation = Slerp(known, Rotation.from_quat(truth.quaternion))(wanted)
    return at_wanted(truth.position), orientation, at_wanted(velocity)


def _measured_cables(cables: CableStream, t_ns: IntArray) -> FloatArray:
    """Number of lengths in the newest measurement at each stamp (M,), 0 before the first."""
    counts = np.isfinite(cables.lengths).sum(axis=1)
    newest = np.searchsorted(cables.t_ns, t_ns, side="right")  # 0: none yet
    return np.concatenate([[0.0], counts])[newest]


def _endcaps_in_body(
    endcaps: EndcapStream | None,
    t_ns: IntArray,
    position: FloatArray,
    orientation: Rotation,
    count: int,
) -> FloatArray:
    """True endcaps R^T (q - p) in the body frame (M, count, 3), NaN where they are not recorded."""
    body = np.full((len(t_ns), count, 3), np.nan)
    if endcaps is None:
        return body
    covered = _covered(t_ns, endcaps.t_ns)
    wanted = t_ns[covered] - endcaps.t_ns[0]
    known = endcaps.t_ns - endcaps.t_ns[0]
    to_body = orientation[covered].inv()
    for k in range(count):
        world = np.stack(
            [np.interp(wanted, known, column) for column in endcaps.position[:, k].T], axis=1
        )
        body[covered, k] = to_body.apply(world - position[covered])
    return body


def _distances(endcaps: FloatArray, cables: list[tuple[int, int]]) -> FloatArray:
    first, second = np.array(cables).T
    return np.asarray(np.linalg.norm(endcaps[:, first] - endcaps[:, second], axis=2))
