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
from tensegrity.sequence import CableStream, ContactStream, Sequence
from tensegrity.sequence.sequence import ROD_IMUS
from tensegrity.trajectory import Trajectory

METHODS = ("paper", "full")

# Of the path of the IMU. Twice what T reports of robots whose sensors all work (4.4 to 5.0 %):
# a filter that loses the robot when one of them fails drifts by tens of percent.
LARGEST_DRIFT_PERCENT = 10.0

LOST_AT_NS = 5_000_000_000  # 1 s after the simulated robot set out


@pytest.fixture(scope="module", params=["forward", "right"])
def recording(request, shared_data):
    return tensegrity.sequence.read(shared_data / "prism3" / request.param)


@pytest.fixture(scope="module")
def standing():
    """Long enough for the static start of 400 samples, and some more."""
    return make_sequence(duration_s=3.0)


def simulated(**options) -> Sequence:
    """A short roll forward, with IMUs on all rods; sensors do not change the motion."""
    pytest.importorskip("mujoco")
    from tensegrity.simulation import SimulationOptions, simulate

    return simulate("forward", SimulationOptions(seed=1, path_length=2.0, **options))


@pytest.fixture(scope="module")
def rolling() -> Sequence:
    return simulated(rod_imus=True)


@pytest.fixture(scope="module")
def base_imu_only(rolling) -> Sequence:
    return dataclasses.replace(rolling, other_imus={})


@pytest.fixture(scope="module")
def nominal(base_imu_only) -> Metrics:
    return evaluate(estimate(base_imu_only), base_imu_only)


@pytest.fixture(scope="module")
def uphill() -> Sequence:
    return simulated(slope=5.0)


def assert_finite(trajectory: Trajectory) -> None:
    for name in (
        "position",
        "quaternion",
        "velocity",
        "endcaps_world",
        "position_covariance",
        "orientation_covariance",
        "velocity_covariance",
    ):
        assert np.isfinite(getattr(trajectory, name)).all(), name


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
        if name.startswith("nis_") and method == "paper":
            assert value is None, name  # a shape comes before the filter, not its innovations
        elif isinstance(value, float):
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


@pytest.mark.parametrize("method", METHODS)
def test_streaming_equals_replay(rolling, method):
    """Of all sensors, those of the other rods as well."""
    replayed = estimate(rolling, config=method)
    estimator = PrismEstimator(rolling.robot, method)
    flags = dict(zip(rolling.contacts.t_ns.tolist(), rolling.contacts.flags, strict=True))
    cables = dict(zip(rolling.cables.t_ns.tolist(), rolling.cables.lengths, strict=True))
    others = [rolling.other_imus[name] for name in ROD_IMUS]
    imu = rolling.imu
    for k, t in enumerate(imu.t_ns.tolist()):
        for rod, other in enumerate(others, start=1):
            assert other.t_ns[k] == t
            assert estimator.rod_imu(t, rod, other.gyro[k], other.accel[k]) == _core.Status.OK
        estimator.imu(t, imu.gyro[k], imu.accel[k])
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


# ---- sensors that fail, are missing, or are more than T's


def test_a_lost_cable_does_not_lose_the_robot(base_imu_only):
    """One motion of the shape is no longer measured, so that a bound for accuracy would have no
    reason. But the robot moves by more than half a rod from face to face: with less drift than that
    it is still known which face it stands on, and where."""
    lengths = base_imu_only.cables.lengths.copy()
    lengths[base_imu_only.cables.t_ns > LOST_AT_NS, 0] = np.nan
    cables = CableStream(base_imu_only.cables.t_ns, lengths)
    trajectory = estimate(dataclasses.replace(base_imu_only, cables=cables))
    assert_finite(trajectory)
    assert trajectory.health["cables_dropped"][-1] == 0
    metrics = evaluate(trajectory, base_imu_only)
    assert metrics.final_drift_m < base_imu_only.robot.rod_length / 2


def test_without_any_cable_the_state_stays_finite(base_imu_only):
    seen = base_imu_only.cables.t_ns <= LOST_AT_NS
    cables = CableStream(base_imu_only.cables.t_ns[seen], base_imu_only.cables.lengths[seen])
    assert_finite(estimate(dataclasses.replace(base_imu_only, cables=cables)))


def test_lengths_that_are_all_missing_are_refused(standing):
    estimator = PrismEstimator(standing.robot)
    for t, gyro, accel in zip(
        standing.imu.t_ns.tolist(), standing.imu.gyro, standing.imu.accel, strict=True
    ):
        estimator.imu(t, gyro, accel)
        estimator.cables(t, standing.cables.lengths[0])
    before = estimator.state
    assert before.initialized
    assert estimator.cables(t + 1, np.full(9, np.nan)) == _core.Status.NOT_FINITE
    assert estimator.state.health.cables_dropped == before.health.cables_dropped + 1
    np.testing.assert_array_equal(estimator.state.endcaps_world, before.endcaps_world)


def test_contact_flags_are_not_needed(base_imu_only):
    blind = dataclasses.replace(base_imu_only, contacts=None)
    trajectory = estimate(blind)
    assert_finite(trajectory)
    assert evaluate(trajectory, blind).final_drift_percent < LARGEST_DRIFT_PERCENT


@pytest.mark.parametrize("seed", [2, 3])  # wrong and right in the sample before the start
def test_wrong_contact_flags_are_outvoted(base_imu_only, seed):
    """Every tenth flag, as `contact_error` says. Held contacts are then more often right than
    the flags are."""
    truth = base_imu_only.contacts
    wrong = np.random.default_rng(seed).random(truth.flags.shape) < 0.1
    flags = ContactStream(truth.t_ns, truth.flags ^ wrong)
    trajectory = estimate(dataclasses.replace(base_imu_only, contacts=flags))
    assert_finite(trajectory)
    assert evaluate(trajectory, base_imu_only).final_drift_percent < LARGEST_DRIFT_PERCENT
    at = np.searchsorted(truth.t_ns, trajectory.t_ns)
    held_wrongly = (trajectory.contacts != truth.flags[at]).mean()
    assert held_wrongly < wrong.mean()


@pytest.mark.parametrize("method", METHODS)
def test_flags_that_are_wrong_at_the_start_are_outvoted(standing, method):
    """The sample before the start, which found the spin alone: two feet are level for another
    shape as well."""
    right = estimate(standing, config=method)
    starts_ns = right.t_ns[0]
    flags = standing.contacts.flags.copy()
    before = standing.contacts.t_ns < starts_ns
    flags[np.flatnonzero(before)[-1], np.flatnonzero(flags[0])[0]] = False
    contacts = ContactStream(standing.contacts.t_ns, flags)
    trajectory = estimate(dataclasses.replace(standing, contacts=contacts), config=method)
    np.testing.assert_array_equal(trajectory.endcaps_body[0], right.endcaps_body[0])


def test_imus_on_the_other_rods_improve_the_shape(rolling, nominal):
    metrics = evaluate(estimate(rolling), rolling)
    assert metrics.endcap_rmse_m < nominal.endcap_rmse_m


def test_imus_that_are_on_no_rod_are_not_used(rolling, base_imu_only):
    spare = dataclasses.replace(rolling, other_imus={"spare": rolling.other_imus["r23"]})
    np.testing.assert_array_equal(estimate(spare).position, estimate(base_imu_only).position)


# ---- terrain


def test_flat_ground_is_not_taken_for_a_slope(base_imu_only):
    assert estimate(base_imu_only).health["terrain_mismatches"][-1] == 0


def test_a_slope_that_was_declared_flat_is_noticed_and_does_no_harm(uphill):
    trajectory = estimate(uphill)
    assert_finite(trajectory)
    assert trajectory.health["terrain_mismatches"][-1] == 1
    assert evaluate(trajectory, uphill).final_drift_percent < LARGEST_DRIFT_PERCENT


@pytest.mark.parametrize("terrain", ["slope", "unknown"])
def test_a_declared_slope_is_no_surprise(uphill, terrain):
    config = FilterConfig.load("full")
    settings = config.settings.model_copy(update={"terrain": terrain})
    trajectory = estimate(uphill, config=config.model_copy(update={"settings": settings}))
    assert_finite(trajectory)
    assert trajectory.health["terrain_mismatches"][-1] == 0
    assert evaluate(trajectory, uphill).final_drift_percent < LARGEST_DRIFT_PERCENT


# ---- the core's plain structs


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
    assert core.terrain == _core.Terrain.FLAT
    fields = sum(
        len(type(getattr(config, s)).model_fields) for s in ("settings", "priors", "noises")
    )
    # `method` is a label, `filter` the class.
    assert fields - 2 == len(core_fields(core))


def core_fields(core: _core.PrismConfig) -> list[str]:
    return [name for name in dir(core) if not name.startswith("_")]


def test_defaults_of_the_core_are_the_packaged_profiles():
    """`paper` with the loosely coupled filter, `full` with the tightly coupled one."""
    loose_alone = {
        "shape",
        "spin",
        "contact_point",
        "contact_noise",
        "contact_position_std",
        "spin_walk",
        "shape_std_rest",
        "shape_std_moving",
    }
    default, paper = _core.PrismConfig(), core_config(FilterConfig.load("paper"))
    full = core_config(FilterConfig.load("full"))
    for name in core_fields(default):
        value = getattr(default, name)
        np.testing.assert_array_equal(value, getattr(paper, name), err_msg=name)
        if name not in loose_alone:
            np.testing.assert_array_equal(value, getattr(full, name), err_msg=name)


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
