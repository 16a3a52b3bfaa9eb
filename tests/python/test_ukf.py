"""The unscented filter against FilterPy, and with input that no filter should have to see."""

from collections.abc import Callable

import numpy as np
import pytest
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from tensegrity._core import Status
from tensegrity.ukf import FilterForm, UnscentedFilter, UnscentedSettings

FloatArray = NDArray[np.float64]
FORMS = list(FilterForm)


def make(dimension: int, capacity: int, form: FilterForm, alpha: float = 0.0139) -> UnscentedFilter:
    options = UnscentedSettings()
    options.alpha, options.form = alpha, form
    return UnscentedFilter(dimension, capacity, options)


def turn(points: FloatArray) -> FloatArray:
    """Position, velocity and turn rate over 0.1 s; nonlinear in the last."""
    x, y, vx, vy, rate = points.T
    c, s = np.cos(0.1 * rate), np.sin(0.1 * rate)
    speed = np.hypot(vx, vy) + 1
    return np.column_stack(
        [x + 0.1 * vx, y + 0.1 * vy, c * vx - s * vy, s * vx + c * vy, rate - 0.01 * rate * speed]
    )


def beacons(points: FloatArray) -> FloatArray:
    """Ranges to two points and a bearing."""
    x, y = points[:, 0], points[:, 1]
    return np.column_stack([np.hypot(x + 3, y), np.hypot(x, y - 4), np.arctan2(y + 5, x + 6)])


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("alpha", [0.0139, 0.1, 1.0])
def test_equals_filterpy(form: FilterForm, alpha: float) -> None:
    random = np.random.default_rng(1)
    size = 5
    root = random.normal(size=(size, size)) / 3
    covariance = root @ root.T + 0.01 * np.eye(size)
    noise = np.diag([1e-4, 1e-4, 1e-3, 1e-3, 1e-3]) + 5e-5
    variances = np.array([0.01, 0.02, 0.001])
    mean = np.array([0.5, -0.2, 0.4, 0.3, 0.5])

    def one(function: Callable[[FloatArray], FloatArray]) -> Callable[..., FloatArray]:
        return lambda x, *_: function(x[None, :])[0]

    theirs = UnscentedKalmanFilter(
        dim_x=size,
        dim_z=3,
        dt=0.1,
        fx=one(turn),
        hx=one(beacons),
        points=MerweScaledSigmaPoints(size, alpha=alpha, beta=2.0, kappa=0.0),
    )
    theirs.x, theirs.P, theirs.Q, theirs.R = mean, covariance, noise, np.diag(variances)
    ours = make(size, 3, form, alpha)
    assert ours.set(mean, covariance) == Status.OK

    for _ in range(40):
        z = beacons(mean[None, :])[0] + random.normal(size=3) * np.sqrt(variances)
        theirs.predict()
        theirs.update(z)
        assert ours.predict(turn, noise) == Status.OK
        assert ours.correct(beacons, z, variances) == Status.OK
        np.testing.assert_allclose(ours.mean, theirs.x, rtol=0, atol=1e-9)
        np.testing.assert_allclose(ours.covariance, theirs.P, rtol=0, atol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_leaves_out_what_the_gate_rejects(form: FilterForm) -> None:
    filter = make(2, 3, form)
    filter.set([0.0, 0.0], np.eye(2) * 0.01)
    pick = [0, 1, 0]
    z = [0.05, 7.0, np.nan]
    assert filter.correct(lambda p: p[:, pick], z, [0.01] * 3, 9.0) == Status.OK
    assert filter.accepted == [True, False, False]
    np.testing.assert_allclose(filter.mean, [0.025, 0.0], atol=1e-12)


def test_says_what_is_wrong_with_the_shape_of_an_argument() -> None:
    filter = make(2, 2, FilterForm.COVARIANCE)
    filter.set([0.0, 0.0], np.eye(2))
    with pytest.raises(ValueError, match="noise"):
        filter.predict(lambda p: p, np.eye(3))
    with pytest.raises(ValueError, match="process"):
        filter.predict(lambda p: p[:3], np.eye(2))
    with pytest.raises(ValueError, match="variances"):
        filter.correct(lambda p: p, [0.0, 0.0], [1.0])
    with pytest.raises(ValueError, match="capacity"):
        filter.correct(lambda p: p, [0.0] * 3, [1.0] * 3)
    with pytest.raises(ValueError, match="measure"):
        filter.correct(lambda p: p, [0.0], [1.0])


ANY_NUMBER = st.floats(allow_nan=True, allow_infinity=True)


@settings(max_examples=150, deadline=None)
@given(
    form=st.sampled_from(FORMS),
    mean=arrays(float, 3, elements=ANY_NUMBER),
    root=arrays(float, (3, 3), elements=st.floats(-1e3, 1e3)),
    noise=arrays(float, (3, 3), elements=st.floats(-1e3, 1e3)),
    factor=ANY_NUMBER,
    z=arrays(float, 2, elements=ANY_NUMBER),
    variances=arrays(float, 2, elements=ANY_NUMBER),
)
def test_stays_finite_and_semidefinite_whatever_comes(
    form: FilterForm,
    mean: FloatArray,
    root: FloatArray,
    noise: FloatArray,
    factor: float,
    z: FloatArray,
    variances: FloatArray,
) -> None:
    filter = make(3, 2, form)
    with np.errstate(all="ignore"):
        filter.set(mean, root @ root.T)
        for _ in range(2):
            filter.predict(lambda p: p * factor, noise @ noise.T)
            before = filter.covariance
            filter.correct(lambda p: p[:, :2] * p[:, 1:], z, variances, 25.0)
            covariance = filter.covariance
            assert np.isfinite(filter.mean).all()
            assert np.isfinite(covariance).all()
            np.testing.assert_array_equal(covariance, covariance.T)
            # Differences of covariances are exact to the last digits of what was subtracted from.
            kept = covariance if form == FilterForm.SQUARE_ROOT else before
            scale = max(float(np.abs(kept).max()), 1e-300)
            assert np.linalg.eigvalsh(covariance / scale).min() > -1e-9
