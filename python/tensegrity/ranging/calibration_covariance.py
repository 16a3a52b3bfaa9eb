"""How well a calibration is determined: covariance of the shared parameters, and in words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tensegrity.ranging.calibration_frame import rigid_directions
from tensegrity.ranging.calibration_model import Loss

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

POOR_STD_M = 0.3
"""Anchors known worse than this in some direction are reported as not determined."""

_LEAST_PRIOR_INFORMATION = 1e-3  # [1/m^2], of a rigid motion that the survey holds in place
_LEAST_INFORMATION = 1e-6  # [1/m^2], what is known less is as good as unknown
_MOTIONS = (
    "a shift along x",
    "a shift along y",
    "a shift along z",
    "a turn about x",
    "a turn about y",
    "a turn about z",
)


@dataclass(frozen=True)
class Determination:
    """``covariance`` (P, P) of the shared parameters [m^2] with the rigid motions that no survey
    holds taken out, and how many of them there are: ``free_motions``, in words."""

    covariance: FloatArray
    free_motions: tuple[str, ...]


def determine(
    information: FloatArray,
    survey_information: FloatArray,
    anchors_m: FloatArray,
    variance_factor: float,
) -> Determination:
    """Covariance from the ``information`` (P, P), the trajectory marginalised, of shared parameters
    that begin with the coordinates of ``anchors_m`` (A, 3), of which the survey tells
    ``survey_information`` (3 A,).

    Rigid motions of everything change no range: those that the survey does not hold
    are left out, the covariance is that of the anchors' shape in the middle of themselves.
    """
    size, coordinates = len(information), anchors_m.size
    motions = rigid_directions(anchors_m)
    motions = motions / np.linalg.norm(motions, axis=0)
    held = motions.T @ (survey_information[:, None] * motions)
    values, vectors = np.linalg.eigh(held)
    loose = vectors[:, values < _LEAST_PRIOR_INFORMATION]
    names = tuple(
        name for name, share in zip(_MOTIONS, (loose**2).sum(axis=1), strict=True) if share > 0.5
    )
    free = np.zeros((size, loose.shape[1]))
    free[:coordinates] = motions @ loose
    basis = np.linalg.svd(free, full_matrices=True)[0][:, loose.shape[1] :]
    inner = basis.T @ information @ basis
    values, vectors = np.linalg.eigh((inner + inner.T) / 2)
    values = np.maximum(values, _LEAST_INFORMATION)
    root = basis @ (vectors / np.sqrt(values))
    return Determination(variance_factor * root @ root.T, names)


def variance_factor(loss: Loss, scale: float, weights: FloatArray) -> float:
    """What turns the inverse of reweighted information into the covariance of an M-estimate, for
    normal noise of one standard deviation: E[psi^2] / E[psi']^2 times the mean weight."""
    if loss == "squares":
        return float(weights.mean())
    residual = np.linspace(-8.0, 8.0, 4001)
    probability = np.exp(-(residual**2) / 2)
    probability /= probability.sum()
    if loss == "huber":
        psi = np.clip(residual, -scale, scale)
        slope = (np.abs(residual) <= scale).astype(np.float64)
    else:
        weight = scale**2 / (scale**2 + residual**2)
        psi, slope = weight * residual, weight**2 * (1 - (residual / scale) ** 2)
    ratio = (probability @ psi**2) / (probability @ slope) ** 2
    return float(ratio * weights.mean())


def complaints(ids: IntArray, covariance: FloatArray) -> list[str]:
    """What is poorly determined about anchors ``ids`` (A,), by their ``covariance`` (3A, 3A)."""
    found = []
    for index, anchor in enumerate(ids.tolist()):
        block = covariance[3 * index : 3 * index + 3, 3 * index : 3 * index + 3]
        values, vectors = np.linalg.eigh(block)
        for value, vector in zip(values[::-1], vectors.T[::-1], strict=True):
            if value > POOR_STD_M**2:
                found.append(
                    f"anchor {anchor} is not determined {_direction(vector)}: "
                    f"standard deviation {np.sqrt(value):.2g} m"
                )
    return found


def _direction(vector: FloatArray) -> str:
    if abs(vector[2]) > 0.8:
        return "in height"
    x, y, z = vector if vector[int(np.abs(vector).argmax())] > 0 else -vector
    if abs(z) < 0.3:
        return f"along ({x:+.1f}, {y:+.1f}) horizontally"
    return f"along ({x:+.1f}, {y:+.1f}, {z:+.1f})"
