"""The simulated SUPERball: its motion against mechanics, its sensors against the truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tensegrity import robots
from tensegrity.dynamics import relax
from tensegrity.errors import InputError
from tensegrity.ranging.sequence import RangingSequence, read_sequence, write_sequence
from tensegrity.simulation.superball import SuperballOptions, simulate_superball

pytest.importorskip("mujoco")

FloatArray = NDArray[np.float64]

EXACT: dict[str, Any] = {
    "range_noise": 0.0,
    "obstacles": False,
    "gyro_noise": 0.0,
    "accel_noise": 0.0,
    "gyro_bias": 0.0,
    "accel_bias": 0.0,
    "encoder_noise": 0.0,
}
ONE_ROLL_S = 9.5


@pytest.fixture(scope="module")
def exact() -> RangingSequence:
    """One roll as sensors without errors see it."""
    return simulate_superball("rolling", SuperballOptions(duration=ONE_ROLL_S, **EXACT))


@pytest.fixture(scope="module")
def noisy() -> RangingSequence:
    """The same roll with everything that goes wrong."""
    return simulate_superball("rolling", SuperballOptions(duration=ONE_ROLL_S))


def truth(sequence: RangingSequence) -> tuple[FloatArray, FloatArray]:
    """Seconds (N,) and nodes (N, n, 3)."""
    assert sequence.endcaps is not None
    return sequence.endcaps.t_ns * 1e-9, sequence.endcaps.position


def modules_at(sequence: RangingSequence, t_ns: NDArray[np.int64]) -> FloatArray:
    """Positions (N, n, 3) of the modules, interpolated."""
    seconds, nodes = truth(sequence)
    flat = nodes.reshape(len(nodes), -1)
    at = [np.interp(t_ns * 1e-9, seconds, flat[:, k]) for k in range(flat.shape[1])]
    return sequence.net.module_positions(np.stack(at, axis=1).reshape(len(t_ns), -1, 3))


def down(nodes: FloatArray) -> set[int]:
    """Indices of the three lowest nodes."""
    return set(np.argsort(nodes[:, 2])[:3].tolist())


def test_the_robot_keeps_its_rods_and_stays_on_the_ground(exact: RangingSequence) -> None:
    _, nodes = truth(exact)
    first, second = exact.net.rod_ends().T
    lengths = np.linalg.norm(nodes[:, first] - nodes[:, second], axis=2)
    np.testing.assert_allclose(lengths, exact.net.rod_length, atol=1e-9)
    # Soft ground gives way by some centimetres in a fall.
    assert nodes[:, :, 2].min() > -0.05
    assert np.sort(nodes[:, :, 2], axis=1)[:, 2].max() < 0.3


def test_at_rest_it_has_the_shape_of_the_net_in_equilibrium(exact: RangingSequence) -> None:
    """Two models that share the description only: rigid rods here, springs there."""
    resting = truth(exact)[1][0]
    springs = relax(exact.net, start=resting, gravity=True)
    height = resting[:, 2].mean() - springs[:, 2].mean()
    # Feet are spheres here and points there, which sink in by the weight over the stiffness.
    assert 0 < height < 0.03
    centred = [nodes - nodes.mean(axis=0) for nodes in (resting, springs)]
    turn, _ = Rotation.align_vectors(*centred)
    assert turn.magnitude() < np.radians(1)
    np.testing.assert_allclose(turn.apply(centred[1]), centred[0], atol=5e-3)


def test_a_roll_leads_to_the_next_face_along_x(exact: RangingSequence) -> None:
    _, nodes = truth(exact)
    assert down(nodes[0]) != down(nodes[-1])
    assert len(down(nodes[0]) & down(nodes[-1])) == 1
    moved = (nodes[-1] - nodes[0]).mean(axis=0)
    assert 0.4 < np.linalg.norm(moved[:2]) < 1.0
    assert moved[0] > 0.5 * np.linalg.norm(moved[:2])


def test_floor_truth_is_where_the_robot_rests(exact: RangingSequence) -> None:
    seconds, nodes = truth(exact)
    floor = exact.floor_truth
    assert floor is not None
    assert set(floor.node[:3].tolist()) == {exact.net.node_ids[i] for i in down(nodes[0])}
    for start, end, node, position in zip(
        floor.start_s, floor.end_s, floor.node, floor.position_m, strict=True
    ):
        inside = (start <= seconds) & (seconds <= end)
        track = nodes[inside, exact.net.index_of(int(node))]
        assert end - start >= 1.0
        assert track[:, 2].max() < 0.06
        np.testing.assert_allclose(track[:, :2] - position, 0, atol=0.02)


def test_ranges_are_distances_plus_offsets(exact: RangingSequence) -> None:
    ranges, net = exact.ranges, exact.net
    assert exact.offsets is not None
    table = exact.offsets.table(net.node_ids, exact.anchors.ids)
    node = np.array([net.index_of(int(i)) for i in ranges.node])
    anchor = np.searchsorted(exact.anchors.ids, ranges.anchor)
    module = modules_at(exact, ranges.t_ns)[np.arange(len(ranges)), node]
    distance = np.linalg.norm(module - exact.anchors.position_m[anchor], axis=1)
    # Truth is interpolated between samples 10 ms apart.
    np.testing.assert_allclose(ranges.range_m, distance + table[node, anchor], atol=2e-3)
    assert 3.5 < table.min() < table.max() < 4.3
    # Each node ranges every anchor once in a round.
    assert len(ranges) == len(np.unique(ranges.t_ns // 10**8)) * 12 * 8


def test_internal_ranges_go_both_ways(exact: RangingSequence) -> None:
    ranges, net = exact.internal_ranges, exact.net
    assert ranges is not None
    assert exact.offsets is not None
    known = exact.offsets.table(net.node_ids, net.node_ids)
    offsets = np.where(np.isnan(known), known.T, known)
    node, other = (
        np.array([net.index_of(int(i)) for i in ids]) for ids in (ranges.node, ranges.other)
    )
    modules = modules_at(exact, ranges.t_ns)
    row = np.arange(len(ranges))
    distance = np.linalg.norm(modules[row, node] - modules[row, other], axis=1)
    np.testing.assert_allclose(ranges.range_m, distance + offsets[node, other], atol=4e-3)
    assert len(ranges) == len(np.unique(ranges.t_ns // 10**8)) * 12 * 11


def test_obstacles_reject_ranges_and_lengthen_some(
    exact: RangingSequence, noisy: RangingSequence
) -> None:
    share = len(noisy.ranges) / len(exact.ranges)
    assert 0.3 < share < 0.7
    assert noisy.offsets is not None
    net = noisy.net
    table = noisy.offsets.table(net.node_ids, noisy.anchors.ids)
    node = np.array([net.index_of(int(i)) for i in noisy.ranges.node])
    anchor = np.searchsorted(noisy.anchors.ids, noisy.ranges.anchor)
    module = modules_at(noisy, noisy.ranges.t_ns)[np.arange(len(noisy.ranges)), node]
    distance = np.linalg.norm(module - noisy.anchors.position_m[anchor], axis=1)
    error = noisy.ranges.range_m - distance - table[node, anchor]
    assert 0.02 < 1.4826 * np.median(np.abs(error - np.median(error))) < 0.045
    assert 0.01 < (error > 0.2).mean() < 0.12
    assert (error < -0.2).sum() == 0


def test_gyroscopes_turn_the_rods_and_accelerometers_feel_gravity(exact: RangingSequence) -> None:
    seconds, nodes = truth(exact)
    for lower, higher in (sorted(rod.ends) for rod in exact.net.rods):
        axis = nodes[:, exact.net.index_of(lower)] - nodes[:, exact.net.index_of(higher)]
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        across = np.linalg.norm(np.gradient(axis, seconds, axis=0), axis=1)
        for node in (lower, higher):
            imu = exact.imus[node]
            rate = np.interp(seconds, imu.t_ns * 1e-9, np.linalg.norm(imu.gyro[:, :2], axis=1))
            assert np.sqrt(np.mean((rate - across)[5:-5] ** 2)) < 0.1
            still = imu.t_ns < 1e9
            mean = imu.accel[still].mean(axis=0)
            assert abs(np.linalg.norm(mean) - 9.81) < 0.05
            assert abs(mean[2] / 9.81 - axis[0, 2]) < 0.02  # z toward the lower id


def test_motors_shorten_one_cable_at_a_time(exact: RangingSequence) -> None:
    assert exact.motors is not None
    nominal = exact.net.rest_lengths()[exact.net.actuated()]
    shortened = nominal - exact.motors.rest_lengths
    assert shortened.min() > -1e-9
    assert shortened.max() <= 0.45 + 1e-9
    assert ((shortened > 1e-6).sum(axis=1) <= 1).all()
    assert shortened.max() > 0.3
    speed = np.abs(np.diff(shortened, axis=0)).max() / 0.02
    assert speed == pytest.approx(0.15)


def test_local_motion_stays_and_moves_node_2() -> None:
    sequence = simulate_superball("local", SuperballOptions(duration=16.0, **EXACT))
    _, nodes = truth(sequence)
    assert down(nodes[0]) == down(nodes[-1])
    assert np.linalg.norm(nodes.mean(axis=1) - nodes[0].mean(axis=0), axis=1).max() < 0.15
    moved = np.ptp(nodes, axis=0).max(axis=1)
    assert 0.05 < moved[sequence.net.index_of(2)] < 0.4
    assert sequence.motors is not None
    changing = np.ptp(sequence.motors.rest_lengths, axis=0) > 1e-6
    ends = [set(sequence.net.cables[k].ends) for k in sequence.net.actuated()[changing]]
    assert ends == [{2, 5}, {2, 4}]


def test_a_spurious_sample_is_one_sample_of_one_imu(noisy: RangingSequence) -> None:
    options = SuperballOptions(duration=ONE_ROLL_S, spurious_imu=6.0)
    spoilt = simulate_superball("rolling", options)
    differences = {
        node: np.flatnonzero((spoilt.imus[node].gyro != noisy.imus[node].gyro).any(axis=1))
        for node in noisy.imus
    }
    changed = {node: rows for node, rows in differences.items() if len(rows)}
    ((node, rows),) = changed.items()
    assert noisy.imus[node].t_ns[rows].tolist() == [6_000_000_000]
    assert np.linalg.norm(spoilt.imus[node].gyro[rows]) > 30


def test_seeds_repeat_and_differ(noisy: RangingSequence) -> None:
    again = simulate_superball("rolling", SuperballOptions(duration=ONE_ROLL_S))
    assert np.array_equal(again.ranges.range_m, noisy.ranges.range_m)
    assert np.array_equal(truth(again)[1], truth(noisy)[1])
    assert np.array_equal(again.imus[5].accel, noisy.imus[5].accel)
    other = simulate_superball("rolling", SuperballOptions(duration=3.0, seed=1))
    assert not np.allclose(truth(other)[1][0], truth(noisy)[1][0])


def test_sensors_do_not_change_the_motion(exact: RangingSequence, noisy: RangingSequence) -> None:
    assert np.array_equal(truth(exact)[1], truth(noisy)[1])


def test_recordings_survive_the_disk(noisy: RangingSequence, tmp_path: Path) -> None:
    write_sequence(noisy, tmp_path / "roll")
    back = read_sequence(tmp_path / "roll")
    assert back.net == noisy.net
    assert np.array_equal(back.ranges.t_ns, noisy.ranges.t_ns)
    np.testing.assert_allclose(back.ranges.range_m, noisy.ranges.range_m, rtol=1e-8)
    np.testing.assert_allclose(truth(back)[1], truth(noisy)[1], rtol=1e-8, atol=1e-9)
    assert back.imus.keys() == noisy.imus.keys()
    np.testing.assert_allclose(back.imus[7].gyro, noisy.imus[7].gyro, rtol=1e-8)
    assert back.motors is not None
    assert noisy.motors is not None
    np.testing.assert_allclose(back.motors.rest_lengths, noisy.motors.rest_lengths, rtol=1e-8)


def test_unknown_nodes_in_files_are_errors(noisy: RangingSequence, tmp_path: Path) -> None:
    path = tmp_path / "roll"
    write_sequence(noisy, path)
    (path / "imu_99.csv").write_text((path / "imu_1.csv").read_text())
    with pytest.raises(InputError, match=r"imu_99.csv.*no node '99'.*1, 2, 3"):
        read_sequence(path)
    (path / "imu_99.csv").unlink()
    lines = (path / "ranges.csv").read_text().splitlines()
    t_ns, _, anchor, value = lines[3].split(",")
    lines[3] = f"{t_ns},42,{anchor},{value}"
    (path / "ranges.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match=r"ranges.csv:4: field 'node': the robot has no node 42"):
        read_sequence(path)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"round_rate": 100.0}, r"'round_rate'.*15 \[Hz\]"),
        ({"strokes": 0.3}, r"did you mean 'stroke'"),
        ({"duration": 0.5}, r"'duration'.*2 \[s\]"),
    ],
)
def test_impossible_options_are_errors(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        SuperballOptions(**options)


def test_unknown_experiments_and_unfit_robots_are_errors() -> None:
    with pytest.raises(InputError, match="did you mean 'rolling'"):
        simulate_superball("roling")
    prism = robots.Net.from_prism(robots.load())
    for experiment in ("rolling", "local"):
        with pytest.raises(InputError, match="is that of SUPERball"):
            simulate_superball(experiment, net=prism)
