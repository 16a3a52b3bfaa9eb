"""Frames of a constellation: ranges fix it up to shift, rotation and reflection."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

_ITERATIONS = 6
_LEVEL_M = 0.05  # a floor tilted by 1 rad counts like an error of the survey of so much


@dataclass(frozen=True)
class RigidMotion:
    """x -> rotation @ x + shift; ``rotation`` (3, 3) is orthogonal and may reflect, ``shift`` (3,)
    [m]."""

    rotation: FloatArray
    shift: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """``points`` (..., 3) moved."""
        return points @ self.rotation.T + self.shift


def align(points: FloatArray, target: FloatArray) -> RigidMotion:
    """The motion, reflections allowed, that brings ``points`` (N, 3) closest to ``target`` (N, 3);
    rows with a NaN are ignored (Kabsch's method)."""
    good = np.isfinite(points).all(axis=1) & np.isfinite(target).all(axis=1)
    middle, target_middle = points[good].mean(axis=0), target[good].mean(axis=0)
    u, _, vt = np.linalg.svd((points[good] - middle).T @ (target[good] - target_middle))
    rotation = (u @ vt).T
    return RigidMotion(rotation, target_middle - rotation @ middle)


def frame_of(anchors: FloatArray, survey: FloatArray, floor_m: FloatArray) -> RigidMotion:
    """:func:`survey_frame` where the survey has any coordinates, else :func:`own_frame`."""
    floor_m = floor_m[np.isfinite(floor_m).all(axis=1)]
    if np.isfinite(survey).any():
        return survey_frame(anchors, survey, floor_m)
    return own_frame(anchors, floor_m)


def survey_frame(anchors: FloatArray, survey: FloatArray, floor_m: FloatArray) -> RigidMotion:
    """The motion that brings ``anchors`` (A, 3) closest to the coordinates (A, 3) of ``survey``
    that are not NaN.

    What they leave open is decided by the robot's path ``floor_m`` (N, 3): it is level, and without
    any known height it is at z = 0 with the anchors on average above it.
    """
    normal = floor_normal(floor_m)
    motion = min(
        (_refined(anchors, survey, normal, turn) for turn in _axis_rotations(normal)),
        key=lambda candidate: candidate[0],
    )[1]
    if not np.isfinite(survey[:, 2]).any():
        height = float(motion(floor_m)[:, 2].mean())
        above = float(motion(anchors)[:, 2].mean()) >= height
        flip = np.diag([1.0, 1.0, 1.0 if above else -1.0])
        shift = motion.shift - [0.0, 0.0, height]
        motion = RigidMotion(flip @ motion.rotation, flip @ shift)
    return motion


def _refined(
    anchors: FloatArray, survey: FloatArray, normal: FloatArray, rotation: FloatArray
) -> tuple[float, RigidMotion]:
    """Cost and motion after Gauss-Newton from ``rotation``."""
    weight = np.isfinite(survey).astype(np.float64)
    target = np.where(weight > 0, survey, 0.0)
    middle = anchors.mean(axis=0)
    centred = anchors - middle
    shift = (weight * (target - centred @ rotation.T)).sum(axis=0)
    shift = shift / np.maximum(weight.sum(axis=0), 1.0)

    def errors() -> FloatArray:
        error = weight * (centred @ rotation.T + shift - target)
        return np.concatenate([error.ravel(), _LEVEL_M * (rotation @ normal)[:2]])

    for _ in range(_ITERATIONS):
        # A small turn w of the result: d moved = w x moved = -[moved]x w.
        slopes = np.zeros((len(anchors), 3, 6))
        slopes[:, :, :3] = -_cross_matrices(centred @ rotation.T)
        slopes[:, :, 3:] = np.eye(3)
        level = np.zeros((2, 6))
        level[:, :3] = -_LEVEL_M * _cross_matrices((rotation @ normal)[None])[0][:2]
        rows = np.vstack([(weight[:, :, None] * slopes).reshape(-1, 6), level])
        step = np.linalg.lstsq(rows, -errors(), rcond=1e-9)[0]
        rotation = Rotation.from_rotvec(step[:3]).as_matrix() @ rotation
        shift = shift + step[3:]
    return float((errors() ** 2).sum()), RigidMotion(rotation, shift - rotation @ middle)


def own_frame(anchors: FloatArray, floor_m: FloatArray) -> RigidMotion:
    """A frame for a constellation without any survey: origin in the middle of the robot's path
    ``floor_m`` (N, 3), z up from it to where the anchors are on average, x toward the first anchor.
    The motion may reflect: a recording and its mirror image measure the same ranges."""
    origin = floor_m.mean(axis=0)
    up = floor_normal(floor_m)
    heights = (anchors - origin) @ up
    up = up if heights.mean() >= 0 else -up
    ahead = anchors[0] - origin
    ahead = ahead - (ahead @ up) * up
    x = ahead / np.linalg.norm(ahead)
    rotation = np.stack([x, np.cross(up, x), up])
    return RigidMotion(rotation, -rotation @ origin)


def floor_normal(path_m: FloatArray) -> FloatArray:
    """Unit normal (3,) of the plane closest to ``path_m`` (N, 3)."""
    _, vectors = np.linalg.eigh(np.cov(path_m.T))
    return vectors[:, 0]


def rigid_directions(anchors: FloatArray) -> FloatArray:
    """(3 A, 6) how the coordinates of ``anchors`` (A, 3) change with shifts and turns of all."""
    directions = np.zeros((len(anchors), 3, 6))
    directions[:, :, :3] = np.eye(3)
    directions[:, :, 3:] = -_cross_matrices(anchors - anchors.mean(axis=0))
    return directions.reshape(-1, 6)


def _axis_rotations(normal: FloatArray) -> list[FloatArray]:
    """Orthogonal matrices that map a frame on ``normal`` to the axes, in all 48 ways."""
    helper = np.eye(3)[int(np.abs(normal).argmin())]
    first = np.cross(normal, helper)
    first /= np.linalg.norm(first)
    frame = np.stack([first, np.cross(normal, first), normal])
    return [
        np.array(signs)[:, None] * frame[list(order)]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]


def _cross_matrices(vectors: FloatArray) -> FloatArray:
    """[v]x (N, 3, 3) with [v]x w = v x w."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.array(rows).transpose(2, 0, 1)
