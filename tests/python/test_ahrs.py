"""The gradient-descent AHRS against the `ahrs` package, over random motion and on a robot."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tensegrity._core import Status
from tensegrity.ahrs import Madgwick, MadgwickSettings, orientations
from tensegrity.errors import InputError
from tensegrity.sequence.sequence import ImuStream

FloatArray = NDArray[np.float64]

DT = 0.01
SAMPLES = 500


def random_motion(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rates, forces and magnetic fields (N, 3) of a body that tumbles and shakes."""
    rng = np.random.default_rng(seed)
    gyro = 2 * np.cumsum(rng.normal(0, np.sqrt(DT), (SAMPLES, 3)), axis=0)
    rotation = Rotation.random(random_state=seed)
    accel, field = np.empty((2, SAMPLES, 3))
    for k, rate in enumerate(gyro):
        rotation = rotation * Rotation.from_rotvec(rate * DT)
        accel[k] = rotation.inv().apply([0, 0, 9.81]) + rng.normal(0, 1.0, 3)
        field[k] = rotation.inv().apply([20, 0, -43]) + rng.normal(0, 2.0, 3)
    return gyro, accel, field


def settings(gain: float) -> MadgwickSettings:
    made = MadgwickSettings()
    made.gain = gain
    return made


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("gain", [0.033, 0.3])
def test_equals_the_ahrs_package_without_magnetometer(seed: int, gain: float) -> None:
    ahrs = pytest.importorskip("ahrs")
    gyro, accel, _ = random_motion(seed)
    start = Rotation.random(random_state=seed + 100).as_quat(scalar_first=True)
    expected = ahrs.filters.Madgwick(gyr=gyro, acc=accel, Dt=DT, gain=gain, q0=start).Q
    ours = Madgwick(settings(gain))
    assert ours.start_at(start) == Status.OK
    quaternions, statuses = ours.run(gyro[1:], accel[1:], np.full(SAMPLES - 1, DT))
    assert (statuses == Status.OK.value).all()
    np.testing.assert_allclose(quaternions, expected[1:], atol=1e-9, rtol=0)


@pytest.mark.parametrize("seed", range(5))
def test_equals_the_ahrs_package_with_magnetometer(seed: int) -> None:
    ahrs = pytest.importorskip("ahrs")
    gyro, accel, field = random_motion(seed)
    expected = ahrs.filters.Madgwick(gyr=gyro, acc=accel, mag=field, Dt=DT, gain=0.1).Q
    ours = Madgwick(settings(0.1))
    assert ours.start_at(expected[0]) == Status.OK  # the package has a start of its own
    for k in range(1, SAMPLES):
        assert ours.update(gyro[k], accel[k], field[k], DT) == Status.OK
        np.testing.assert_allclose(ours.orientation, expected[k], atol=1e-9, rtol=0)


def test_recordings_equal_samples_one_by_one() -> None:
    gyro, accel, _ = random_motion(1)
    t_ns = np.arange(SAMPLES, dtype=np.int64) * 10_000_000
    whole = orientations(ImuStream(t_ns, gyro, accel))
    one_by_one = Madgwick()
    one_by_one.start(accel[0])
    for k in range(1, SAMPLES):
        one_by_one.update(gyro[k], accel[k], DT)
        np.testing.assert_allclose(whole.quaternion[k], one_by_one.orientation, atol=1e-12)
        cosine = one_by_one.inclination_cosine()
        assert whole.inclination_cosine()[k] == pytest.approx(cosine, abs=1e-12)
    assert whole.used.all()


def test_a_saturated_gyroscope_is_forgotten_and_broken_samples_are_flagged() -> None:
    accel = np.tile([0.0, 0.0, 9.81], (3000, 1))
    gyro = np.zeros_like(accel)
    gyro[1000] = np.radians([2000, 0, 0])
    gyro[2500] = np.nan
    accel[2600, 0] = 1e5
    t_ns = np.arange(3000, dtype=np.int64) * 10_000_000
    result = orientations(ImuStream(t_ns, gyro, accel))
    tilt = np.arccos(np.clip(result.inclination_cosine(), -1, 1))
    assert tilt[:1000].max() < 1e-9
    assert tilt[1000] == pytest.approx(np.arctan(np.radians(2000) * DT / 2) * 2, rel=0.02)
    assert tilt[-1] < 0.002  # 0.34 rad at 2 x 0.033 rad/s take 5 s
    assert np.flatnonzero(~result.used).tolist() == [2500, 2600]


def test_a_recording_without_gravity_is_an_error() -> None:
    nothing = np.zeros((3, 3))
    with pytest.raises(InputError, match="no accelerometer sample has a direction"):
        orientations(ImuStream(np.arange(3), nothing, nothing))


@given(
    gyro=arrays(np.float64, (4, 3), elements=st.floats(width=64)),
    accel=arrays(np.float64, (4, 3), elements=st.floats(width=64)),
    dt=arrays(np.float64, 4, elements=st.floats(width=64)),
)
def test_any_samples_leave_a_unit_quaternion(
    gyro: FloatArray, accel: FloatArray, dt: FloatArray
) -> None:
    filter_ = Madgwick()
    filter_.start(np.array([0.0, 3.0, 9.0]))
    quaternions, statuses = filter_.run(gyro, accel, dt)
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1, atol=1e-12)
    finite = np.isfinite(gyro).all(axis=1) & np.isfinite(accel).all(axis=1) & np.isfinite(dt)
    assert (statuses[~finite] == Status.NOT_FINITE.value).all()


@pytest.mark.parametrize(
    ("gyro", "accel", "dt", "message"),
    [
        (np.zeros((3, 2)), np.zeros((3, 3)), np.zeros(3), r"gyro: expected shape \(3, 3\)"),
        (np.zeros((3, 3)), np.zeros((2, 3)), np.zeros(3), r"accel: expected shape \(3, 3\)"),
        (np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(4), r"dt: expected shape \(3,\)"),
    ],
)
def test_wrong_shapes_are_errors(
    gyro: FloatArray, accel: FloatArray, dt: FloatArray, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        Madgwick().run(gyro, accel, dt)


def test_inclinations_of_a_rolling_robot() -> None:
    pytest.importorskip("mujoco")
    from tensegrity.simulation.superball import SuperballOptions, simulate_superball

    sequence = simulate_superball("rolling", SuperballOptions(duration=18.0, seed=2))
    assert sequence.endcaps is not None
    nodes, net = sequence.endcaps.position, sequence.net
    for lower, higher in (sorted(rod.ends) for rod in net.rods):
        axis = nodes[:, net.index_of(lower)] - nodes[:, net.index_of(higher)]
        cosine = axis[:, 2] / np.linalg.norm(axis, axis=1)
        for node in (lower, higher):
            imu = sequence.imus[node]
            error = orientations(imu).inclination_cosine() - np.interp(
                imu.t_ns, sequence.endcaps.t_ns, cosine
            )
            # The default gain bears with a bias of 0.033 rad/s; impacts of 70 m/s^2 hardly count.
            assert np.sqrt(np.mean(error**2)) < 0.06
