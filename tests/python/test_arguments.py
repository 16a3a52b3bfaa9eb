"""What the calls of the C++ module take for small arrays: those in NumPy's own layout are read in
place, all else is converted, and both mean the same."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import tensegrity._core as _core
from tensegrity import PrismEstimator

GYRO, ACCEL = [0.25, -0.5, 0.125], [0.5, 0.25, 9.75]
NOISE = _core.FilterNoise(gyro_std=0.002, accel_std=0.05)


def in_single_precision(array: np.ndarray) -> list:
    """Values that every form below has exactly."""
    return array.astype(np.float32).tolist()


def strided(values: list) -> np.ndarray:
    return np.repeat(np.array(values), 2, axis=-1)[..., ::2]


def backward(values: list) -> np.ndarray:
    return np.array(values)[..., ::-1].copy()[..., ::-1]


def read_only(values: list) -> np.ndarray:
    array = np.array(values)
    array.setflags(write=False)
    return array


def unaligned(values: list) -> np.ndarray:
    array = np.array(values)
    buffer = np.zeros(array.nbytes + 1, np.uint8)
    moved = buffer[1:].view(float).reshape(array.shape)
    moved[:] = array
    return moved


FORMS: dict[str, Callable[[list], object]] = {
    "list": list,
    "single": lambda values: np.array(values, np.float32),
    "swapped": lambda values: np.array(values, ">f8"),
    "dtype with metadata": lambda values: np.array(values, np.dtype(np.float64, metadata={"a": 1})),
    "fortran": lambda values: np.array(values, order="F"),
    "strided": strided,
    "backward": backward,
    "read-only": read_only,
    "unaligned": unaligned,
    "subclass": lambda values: (
        np.array(values).view(np.matrix) if np.ndim(values) == 2 else np.ma.masked_array(values)
    ),
}


def standing_filter() -> _core.InvariantFilter:
    filter_ = _core.InvariantFilter()
    filter_.covariance = 1e-4 * np.eye(16)
    for foot in (0, 3, 5):
        filter_.augment(foot, _core.Prism().undeformed()[foot], 1e-4 * np.eye(3))
    return filter_


@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_an_array_means_the_same(form: str) -> None:
    as_form = FORMS[form]
    endcaps = in_single_precision(_core.Prism().undeformed() + 0.01)
    root = np.random.default_rng(1).normal(size=(18, 18))
    covariance = in_single_precision(1e-4 * root @ root.T)
    results = []
    for converted in (np.array, as_form):
        filter_ = standing_filter()
        filter_.propagate(converted(GYRO), converted(ACCEL), 0.005, NOISE)
        status, chi_square = filter_.correct_contacts(converted(endcaps), converted(covariance))
        assert status is _core.Status.OK
        results.append((filter_.position, filter_.covariance, chi_square))
    for ours, expected in zip(results[1], results[0], strict=True):
        np.testing.assert_array_equal(ours, expected)


@pytest.mark.parametrize(
    "gyro",
    [np.zeros(4), np.zeros((3, 2)), np.zeros(0), np.float64(1.0), "abc", None],
    ids=["four", "matrix", "empty", "number", "text", "none"],
)
def test_wrong_shapes_and_types_are_refused(gyro: object) -> None:
    filter_, estimator = standing_filter(), PrismEstimator()
    before = filter_.covariance
    with pytest.raises(TypeError, match="incompatible function arguments"):
        filter_.propagate(gyro, np.array(ACCEL), 0.005, NOISE)
    np.testing.assert_array_equal(filter_.covariance, before)
    with pytest.raises(TypeError, match="incompatible function arguments"):
        estimator.imu(1, gyro, ACCEL)
    with pytest.raises(TypeError, match="incompatible function arguments"):
        estimator.cables(1, gyro)


def test_a_transposed_matrix_is_not_its_buffer() -> None:
    """(3, 6) has as many numbers as (6, 3)."""
    with pytest.raises(TypeError, match="incompatible function arguments"):
        standing_filter().correct_contacts(np.zeros((3, 6)), np.eye(18))


def test_streaming_calls_return_the_members_of_status() -> None:
    estimator = PrismEstimator()
    gyro, accel = np.array(GYRO), np.array(ACCEL)
    assert estimator.imu(10, gyro, accel) is _core.Status.NOT_INITIALIZED
    assert estimator.imu(10, gyro, accel) is _core.Status.DUPLICATE
    assert estimator.imu(5, gyro, accel) is _core.Status.OUT_OF_ORDER
    assert estimator.imu(15, np.full(3, np.nan), accel) is _core.Status.NOT_FINITE
    assert estimator.imu(15, 1e9 * gyro, accel) is _core.Status.OUT_OF_RANGE
    assert estimator.cables(10, np.ones(9)) is _core.Status.OK
    assert estimator.state.health.imu_dropped == 4
