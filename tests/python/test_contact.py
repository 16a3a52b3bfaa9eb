"""The contact detector against a plain NumPy version, its invariances, and recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from tensegrity import _core
from tensegrity.sequence import read

FloatArray = NDArray[np.float64]

ROD_LENGTH = 1.45  # [m]
SUREST = 4.0  # greatest log odds of one geometry, so that sensors can outvote it


def share_of_weight(world: FloatArray, feet: NDArray[np.intp]) -> FloatArray:
    """Forces of three feet that carry a unit weight: balance of forces and of moments."""
    ground = world[feet, :2]
    balance = np.vstack([ground.T, np.ones(3)])
    return np.linalg.solve(balance, [*world[:, :2].mean(axis=0), 1.0])


def log_odds(world: FloatArray, p: _core.ContactDetectorParameters) -> FloatArray:
    order = np.argsort(world[:, 2], kind="stable")
    shares = np.full(6, -0.5)
    shares[order[:3]] = share_of_weight(world, order[:3]).clip(-0.5, 1.0)
    intercept = np.empty(6)
    intercept[order] = np.array(p.intercept)[[0, 1, 2, 2, 2, 2]]
    height = world[:, 2] - world[:, 2].min()
    odds = intercept + p.height_weight * height / ROD_LENGTH + p.share_weight * shares
    return odds.clip(-SUREST, SUREST)


def filtered(
    worlds: FloatArray, intervals: FloatArray, p: _core.ContactDetectorParameters
) -> FloatArray:
    """Forward recursion of the two-state chain with its transition matrix, endcap by endcap."""
    up, down = p.touch_down_rate, p.lift_off_rate
    stationary = np.array([down, up]) / (up + down)
    belief = np.tile(stationary, (6, 1))
    result = []
    for k, (world, dt) in enumerate(zip(worlds, intervals, strict=True)):
        stay = np.exp(-(up + down) * dt)
        transition = stay * np.eye(2) + (1 - stay) * stationary  # rows: from, columns: to
        news = 1.0 if k == 0 else -np.expm1(-dt / p.evidence_time)
        loaded = 1 / (1 + np.exp(-log_odds(world, p)))
        likelihood = (np.column_stack([1 - loaded, loaded]) / stationary) ** news
        belief = (belief @ transition) * likelihood
        belief /= belief.sum(axis=1, keepdims=True)
        belief[:, 1] = belief[:, 1].clip(1e-6, 1 - 1e-6)
        belief[:, 0] = 1 - belief[:, 1]
        result.append(belief[:, 1])
    return np.array(result)


def test_detector_is_the_two_state_filter() -> None:
    random = np.random.default_rng(4)
    p = _core.ContactDetectorParameters()
    # Gentler than the fitted weights, so that probabilities fill the range between 0 and 1.
    p.intercept, p.height_weight, p.share_weight = [1.0, 0.5, -0.5], -4.0, 3.0
    worlds = random.uniform(-0.7, 0.7, (300, 6, 3))
    intervals = random.choice([0.005, 0.01, 0.03, 0.2], 300)
    detector = _core.ContactDetector(_core.Prism(rod_length=ROD_LENGTH), p)
    actual = []
    for world, dt in zip(worlds, intervals, strict=True):
        flags = detector.update(world, dt)
        actual.append(detector.probability)
        np.testing.assert_array_equal(flags, np.array(detector.probability) > 0.5)
    expected = filtered(worlds, intervals, p)
    assert expected.std() > 0.2
    bounded = np.abs([log_odds(world, p) for world in worlds]) == SUREST
    assert 0.1 < bounded.mean() < 0.9
    np.testing.assert_allclose(actual, expected, atol=1e-9)


def test_a_whole_recording_is_its_samples_one_by_one() -> None:
    worlds = np.random.default_rng(6).uniform(-0.7, 0.7, (50, 6, 3))
    worlds[20, 3, 1] = np.nan
    single, whole = _core.ContactDetector(_core.Prism()), _core.ContactDetector(_core.Prism())
    expected = []
    for world in worlds:
        single.update(world, 0.01)
        expected.append(single.probability)
    actual = whole.probabilities(worlds, 0.01)
    np.testing.assert_array_equal(actual, expected)
    np.testing.assert_array_equal(actual[20], actual[19])


@pytest.mark.parametrize("shape", [(6, 3), (4, 3, 6), (4, 5, 3)])
def test_a_recording_of_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"endcaps: expected shape \(N, 6, 3\)"):
        _core.ContactDetector(_core.Prism()).probabilities(np.zeros(shape), 0.01)


@given(
    worlds=arrays(np.float64, (5, 6, 3), elements=st.floats(allow_nan=True, allow_infinity=True)),
    dt=st.floats(allow_nan=True, allow_infinity=True),
)
def test_whatever_comes_in_probabilities_come_out(worlds: FloatArray, dt: float) -> None:
    result = _core.ContactDetector(_core.Prism()).probabilities(worlds, dt)
    assert np.all((result > 0) & (result < 1))


def precision_recall(flags: NDArray[np.bool_], truth: NDArray[np.bool_]) -> tuple[float, float]:
    hits = np.sum(flags & truth)
    return hits / np.sum(flags), hits / np.sum(truth)


# Measured: 0.962 / 0.994 and 0.916 / 0.993. What is missing in precision are bounces: after a face
# change a foot hops 1 to 3 cm high for a quarter of a second, which no estimate of height resolves.
@pytest.mark.parametrize(
    ("name", "precision", "recall"), [("forward", 0.93, 0.98), ("right", 0.88, 0.98)]
)
def test_finds_the_contacts_of_recordings(
    shared_data: Path, name: str, precision: float, recall: float
) -> None:
    sequence = read(shared_data / "prism3" / name)
    assert sequence.endcaps is not None
    assert sequence.contacts is not None
    dt = np.median(np.diff(sequence.endcaps.t_ns)) * 1e-9
    detector = _core.ContactDetector(_core.Prism())
    flags = detector.probabilities(sequence.endcaps.position, dt) > 0.5
    truth = sequence.contacts.flags
    measured = precision_recall(flags, truth)
    assert measured[0] > precision
    assert measured[1] > recall
    # The robot stands still for the first four seconds.
    still = sequence.endcaps.t_ns < 4_000_000_000
    np.testing.assert_array_equal(flags[still], truth[still])


def test_survives_the_errors_of_an_estimator(shared_data: Path) -> None:
    """2 cm per coordinate, drawn anew every two seconds, and a tilt of 1 deg throughout."""
    sequence = read(shared_data / "prism3" / "forward")
    assert sequence.endcaps is not None
    assert sequence.contacts is not None
    world = sequence.endcaps.position[::2]
    truth = sequence.contacts.flags[::2]
    random = np.random.default_rng(11)
    drawn = random.normal(0, 0.02, (len(world) // 200 + 1, 6, 3))
    world = world + np.repeat(drawn, 200, axis=0)[: len(world)]
    world[:, :, 2] += np.deg2rad(1.0) * (world[:, :, 0] - world[:, :, 0].mean(axis=1)[:, None])
    flags = _core.ContactDetector(_core.Prism()).probabilities(world, 0.01) > 0.5
    precision, recall = precision_recall(flags, truth)
    assert precision > 0.9
    assert recall > 0.9
