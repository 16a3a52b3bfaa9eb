"""The estimator from Python: streaming, replay, and whole recordings."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import tensegrity
import tensegrity._core as _core
from helpers.sequences import make_sequence
from tensegrity import FilterConfig, InputError, PrismEstimator, estimate, robots
from tensegrity.estimation import core_config, core_robot
from tensegrity.evaluation import Metrics, evaluate

METHODS = ("paper", "full")


@pytest.fixture(scope="module", params=["forward", "right"])
def recording(request, shared_data):
    return tensegrity.sequence.read(shared_data / "prism3" / request.param)


@pytest.fixture(scope="module")
def standing():
    """Long enough for the static start of 400 samples, and some more."""
    return make_sequence(duration_s=3.0)


@pytest.fixture(scope="module")
def results(recording) -> dict[str, Metrics]:
    return {m: evaluate(estimate(recording, config=m), recording) for m in METHODS}


def test_full_drifts_less_than_paper_on_the_independent_recordings(results):
    assert results["full"].final_drift_m < results["paper"].final_drift_m
    assert results["full"].rpe_trans_rmse_m_per_m < results["paper"].rpe_trans_rmse_m_per_m
    assert results["full"].endcap_rmse_m < results["paper"].endcap_rmse_m


@pytest.mark.parametrize("method", METHODS)
def test_all_metrics_of_the_independent_recordings_are_finite(results, method):
    for name, value in dataclasses.asdict(results[method]).items():
        if isinstance(value, float):
            assert math.isfinite(value), name
        else:
            assert value is not None, name


def test_covariance_of_full_can_be_believed(results):
    """Within the factor that the tuning run holds it to (see benchmarks/filter_tuning.py)."""
    assert 1 / 3 < results["full"].nees_position_median < 3


def test_without_contact_flags_the_detector_decides(recording, results):
    blind = dataclasses.replace(recording, contacts=None)
    metrics = evaluate(estimate(blind, config="full"), recording)
    assert metrics.final_drift_m < results["paper"].final_drift_m


def test_streaming_equals_replay(standing):
    s = standing
    replayed = estimate(s)
    estimator = PrismEstimator(s.robot)
    cables = dict(zip(s.cables.t_ns.tolist(), s.cables.lengths, strict=True))
    flags = (
        {}
        if s.contacts is None
        else dict(zip(s.contacts.t_ns.tolist(), s.contacts.flags, strict=True))
    )
    for t, gyro, accel in zip(s.imu.t_ns.tolist(), s.imu.gyro, s.imu.accel, strict=True):
        estimator.imu(t, gyro, accel)
        if t in flags:
            assert estimator.contacts(t, flags[t]) == _core.Status.OK
        if t in cables:
            assert estimator.cables(t, cables[t]) == _core.Status.OK
    state = estimator.state
    assert state.initialized
    np.testing.assert_array_equal(state.position, replayed.position[-1])
    np.testing.assert_array_equal(state.quaternion, replayed.quaternion[-1])
    np.testing.assert_array_equal(state.endcaps_world, replayed.endcaps_world[-1])


def test_a_still_robot_stays_where_it_is(standing):
    trajectory = estimate(standing)
    assert np.linalg.norm(trajectory.position[-1] - trajectory.position[0]) < 0.01
    assert np.abs(trajectory.velocity).max() < 0.05


def test_a_robot_that_never_stands_still_is_an_error(standing):
    shaken = np.random.default_rng(1).normal(size=standing.imu.gyro.shape)
    imu = dataclasses.replace(standing.imu, gyro=shaken)
    with pytest.raises(InputError, match="never stood still for 400 IMU samples"):
        estimate(dataclasses.replace(standing, imu=imu))


def test_progress_reaches_one(standing):
    seen: list[float] = []
    estimate(standing, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


def test_every_setting_reaches_the_core():
    """A field of the YAML that the core does not know would be lost silently."""
    config = FilterConfig.load("full")
    core = core_config(config)
    assert core.shape == _core.ShapeMethod.TRACKER
    assert core.contact_point == _core.ContactPoint.ROLLING
    assert core.spin_walk == config.noises.spin_std
    assert core.spin_prior_std == config.priors.spin_std
    assert core.gyroscope_bias_walk == config.noises.gyroscope_bias_std
    assert core.gyroscope_bias_std == config.priors.gyroscope_bias_std
    fields = sum(
        len(type(getattr(config, s)).model_fields) for s in ("settings", "priors", "noises")
    )
    assert fields - 1 == sum(not n.startswith("_") for n in dir(core))  # `method` is a label


def test_defaults_of_the_core_are_the_paper_profile():
    default, paper = _core.PrismConfig(), core_config(FilterConfig.load("paper"))
    for name in (n for n in dir(default) if not n.startswith("_")):
        np.testing.assert_array_equal(getattr(default, name), getattr(paper, name), err_msg=name)


@pytest.mark.parametrize("chirality", ["counter_clockwise", "clockwise"])
def test_python_and_cpp_agree_on_the_undeformed_robot(chirality):
    robot = robots.load("prism3").model_copy(update={"chirality": chirality})
    np.testing.assert_allclose(
        core_robot(robot).undeformed(), robot.undeformed_endcaps(), atol=1e-12
    )


def test_replay_checks_its_arrays(standing):
    estimator = PrismEstimator()
    s = standing
    with pytest.raises(ValueError, match=r"gyro: expected shape \(\d+, 3\)"):
        estimator.replay(s.imu.t_ns, s.imu.gyro[:-1], s.imu.accel, s.cables.t_ns, s.cables.lengths)
    with pytest.raises(ValueError, match="go together"):
        estimator.replay(
            s.imu.t_ns, s.imu.gyro, s.imu.accel, s.cables.t_ns, s.cables.lengths, s.imu.t_ns
        )
