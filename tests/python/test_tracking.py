"""Tracking a ranging robot: made-up recordings of a robot at rest, and the real rolling test."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tensegrity import robots, tracking
from tensegrity._core import RangingEstimator, Status
from tensegrity.dynamics import core_net, relax
from tensegrity.errors import InputError
from tensegrity.ranging.recording import (
    Anchors,
    FloorTruth,
    InternalRanges,
    Offsets,
    RangeRecording,
)
from tensegrity.ranging.sequence import MotorStream, RangingSequence, read_sequence
from tensegrity.sequence.sequence import EndcapStream, ImuStream
from tensegrity.tracking import TrackSettings, floor_errors, track, track_errors

NET = robots.load_net("superball")
POSITIONS = np.array([[5.0, 4.0, 0.4], [-5.0, 4.0, 2.5], [-5.0, -4.0, 0.5], [5.0, -4.0, 3.0]])
ANCHOR_IDS = np.array([13, 14, 15, 16])
FACE = (6, 8, 9)
AT_REST = relax(NET, start=NET.standing_on(FACE), gravity=True) + np.array([1.0, -0.5, 0.0])


def at_rest(seconds: float = 3.0, seed: int = 1) -> RangingSequence:
    """The robot stands on FACE; every module ranges half of the anchors at 10 Hz."""
    random = np.random.default_rng(seed)
    nodes = AT_REST
    modules = NET.module_positions(nodes)
    rows = [
        (step * 100_000_000, node, anchor, i, k)
        for step in range(round(10 * seconds))
        for i, node in enumerate(NET.node_ids)
        for k, anchor in enumerate(ANCHOR_IDS)
        if (i + k + step) % 2 == 0
    ]
    offsets = 3.9 + 0.1 * random.normal(size=(len(nodes), len(POSITIONS)))
    distance = np.linalg.norm(modules[:, None] - POSITIONS[None], axis=2)
    noise = 0.05 * random.normal(size=len(rows))
    ranges = [(distance + offsets)[i, k] for *_, i, k in rows] + noise
    t_ns, node, anchor = (np.array([row[c] for row in rows]) for c in range(3))
    pairs = np.meshgrid(np.array(NET.node_ids), ANCHOR_IDS, indexing="ij")
    truth = np.arange(0, seconds + 1, 0.01)
    return RangingSequence(
        name="at-rest",
        net=NET,
        ranges=RangeRecording(t_ns, node, anchor, ranges),
        anchors=Anchors(ANCHOR_IDS, POSITIONS),
        offsets=Offsets(pairs[0].ravel(), pairs[1].ravel(), offsets.ravel()),
        endcaps=EndcapStream(
            (truth * 1e9).astype(np.int64), np.repeat(nodes[None], len(truth), axis=0)
        ),
    )


@pytest.fixture(scope="module")
def sequence() -> RangingSequence:
    return at_rest()


def test_finds_a_robot_at_rest_and_the_face_that_is_down(sequence: RangingSequence) -> None:
    result = track(sequence)
    assert sequence.endcaps is not None
    errors = track_errors(result, sequence.endcaps)
    assert errors.centre_of_mass_rmse < 0.1
    assert errors.node_rmse < 0.15
    assert errors.face_right[len(result) // 2 :].all()
    assert set(result.faces[-1]) == set(FACE)
    # Offsets are exact, and not trusted to be: the covariance must not be smaller than the errors.
    assert np.mean(errors.nees) < 3
    assert result.health.restarts == 0
    assert np.diff(result.t_ns) == pytest.approx(1e8)
    lengths = np.linalg.norm(np.diff(result.nodes.reshape(len(result), 6, 2, 3), axis=2), axis=-1)
    assert lengths == pytest.approx(1.7, abs=0.01)


def test_uses_every_sensor_that_there_is(sequence: RangingSequence) -> None:
    nodes = AT_REST
    t_ns = np.arange(0, 3_000_000_000, 20_000_000)
    imus = {}
    for a, b in NET.rod_ends():
        axis = (nodes[a] - nodes[b]) / np.linalg.norm(nodes[a] - nodes[b])
        across = np.sqrt(1 - axis[2] ** 2)
        force = 9.81 * np.array([across, 0.0, axis[2]])
        for end in (a, b):
            imus[NET.node_ids[end]] = ImuStream(
                t_ns, np.zeros((len(t_ns), 3)), np.tile(force, (len(t_ns), 1))
            )
    modules = NET.module_positions(nodes)
    pairs = [(i, j) for i in range(12) for j in range(12) if i != j]
    internal = InternalRanges(
        np.full(len(pairs), 2_050_000_000),
        np.array([NET.node_ids[i] for i, _ in pairs]),
        np.array([NET.node_ids[j] for _, j in pairs]),
        np.array([np.linalg.norm(modules[i] - modules[j]) + 3.7 for i, j in pairs]),
    )
    assert sequence.offsets is not None
    listed = Offsets(
        np.concatenate([sequence.offsets.node, internal.node]),
        np.concatenate([sequence.offsets.anchor, internal.other]),
        np.concatenate([sequence.offsets.offset_m, np.full(len(pairs), 3.7)]),
    )
    motors = MotorStream(t_ns[::5], np.tile(NET.rest_lengths()[NET.actuated()], (30, 1)))
    full = replace(sequence, imus=imus, internal_ranges=internal, motors=motors, offsets=listed)
    result = track(full)
    # 120 internal ranges and 12 inclinations at each of the updates, but for the very last one.
    assert result.health.ranges_used >= track(sequence).health.ranges_used + len(pairs)
    assert result.health.inclinations_used >= 12 * (len(result) - 2)
    assert result.health.dropped == 0
    assert sequence.endcaps is not None
    assert track_errors(result, sequence.endcaps).node_rmse < 0.1


def test_streaming_gives_what_a_recording_gives(sequence: RangingSequence) -> None:
    assert sequence.offsets is not None
    settings = TrackSettings()
    estimator = RangingEstimator(
        tracking.core_robot(NET),
        tracking.core_anchors(NET, sequence.anchors, sequence.offsets, settings),
        core_net(NET),
        NET.rest_lengths(),
        settings.filter,
    )
    ranges = sequence.ranges
    for t, node, anchor, value in zip(
        ranges.t_ns, ranges.node, ranges.anchor, ranges.range_m, strict=True
    ):
        status = estimator.range(int(t), NET.index_of(node), int(anchor) - 13, float(value))
        assert status == Status.OK
    assert estimator.update(int(ranges.t_ns[-1])) == Status.OK
    result = track(sequence, settings=settings)
    np.testing.assert_array_equal(estimator.state.positions, result.nodes[-1])
    assert estimator.state.t == result.t_ns[-1]


def test_a_module_that_was_never_calibrated_is_filled_in(sequence: RangingSequence) -> None:
    assert sequence.offsets is not None
    table = sequence.offsets.table(NET.node_ids, ANCHOR_IDS)
    default = sequence.offsets.offset_m.copy()
    default[sequence.offsets.node == 3] = 2.0  # two metres from right: ranges would be rejected
    with_default = replace(sequence.offsets, offset_m=default)
    assert sequence.endcaps is not None
    result = track(sequence, offsets=with_default)
    assert track_errors(result, sequence.endcaps).node_rmse < 0.12
    assert np.ptp(table[2]) > 0

    constant = replace(sequence.offsets, offset_m=np.full(len(sequence.offsets), 3.9))
    assert track_errors(track(sequence, offsets=constant), sequence.endcaps).node_rmse < 0.15


def test_says_what_a_recording_lacks(sequence: RangingSequence) -> None:
    with pytest.raises(InputError, match=r"no offsets.*calibrate"):
        track(replace(sequence, offsets=None))
    lost = sequence.anchors.position_m.copy()
    lost[2, 1] = np.nan
    with pytest.raises(InputError, match=r"anchor 15 has no position.*calibrate"):
        track(replace(sequence, anchors=Anchors(ANCHOR_IDS, lost)))
    with pytest.raises(InputError, match="anchor 16 was ranged"):
        track(replace(sequence, anchors=Anchors(ANCHOR_IDS[:3], POSITIONS[:3])))
    with pytest.raises(InputError, match="steps"):
        track(replace(sequence, ranges=replace(sequence.ranges, timed=False)))
    few = sequence.ranges.where(sequence.ranges.node < 3)
    with pytest.raises(InputError, match=r"no start was found.*12 pairs"):
        track(replace(sequence, ranges=few))
    assert sequence.endcaps is not None
    later = replace(sequence.endcaps, t_ns=sequence.endcaps.t_ns + 10**12)
    with pytest.raises(InputError, match="no time in common"):
        track_errors(track(sequence), later)


def test_floor_errors_are_means_over_windows(sequence: RangingSequence) -> None:
    result = track(sequence)
    where = result.nodes[:, NET.index_of(8), :2]
    seconds = result.t_ns * 1e-9
    inside = (seconds >= 1.5) & (seconds < 2.0)
    truth = FloorTruth(
        np.array([1.5, 90.0]), np.array([2.0, 99.0]), np.array([8, 8]), np.array([[1.0, 2.0]] * 2)
    )
    errors = floor_errors(result, truth)
    np.testing.assert_allclose(errors[0], where[inside].mean(axis=0) - [1.0, 2.0])
    assert np.isnan(errors[1]).all()


def test_rolling_test_of_the_real_robot(shared_data: Path) -> None:
    recording = read_sequence(shared_data / "superball" / "rolling_indoor")
    assert recording.floor_truth is not None
    ours = track(recording)
    errors = floor_errors(ours, recording.floor_truth)
    assert np.sqrt(np.mean(errors**2)) < 0.25  # C's filter, repaired: 0.36 m
    assert ours.health.restarts == 0
    first = ours.t_ns * 1e-9 < recording.floor_truth.end_s[0]
    right = [set(found) == {6, 8, 9} for found in ours.faces[first].tolist()]
    assert np.mean(right) > 0.5

    published = track(recording, settings=tracking.paper_settings())
    assert np.isfinite(published.nodes).all()
    of_paper = floor_errors(published, recording.floor_truth)
    assert np.sqrt(np.mean(errors**2)) < np.sqrt(np.mean(of_paper**2))
