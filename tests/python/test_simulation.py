"""The MuJoCo simulation: its motion against mechanics, its sensors against their options."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tensegrity.errors import InputError, MissingExtraError
from tensegrity.sequence.sequence import Sequence
from tensegrity.simulation import Manoeuvre, SimulationOptions, simulate

pytest.importorskip("mujoco")

FloatArray = NDArray[np.float64]

NOISELESS: dict[str, Any] = {
    "gyro_noise": 0.0,
    "accel_noise": 0.0,
    "gyro_bias_walk": 0.0,
    "accel_bias_walk": 0.0,
    "cable_noise": 0.0,
}
SHORT: dict[str, Any] = {"still_start": 1.0, "still_end": 0.5, "path_length": 0.7}


def short(manoeuvre: str = "forward", **changes: Any) -> Sequence:
    return simulate(manoeuvre, SimulationOptions(**(SHORT | changes)))


@pytest.fixture(scope="module")
def exact() -> Sequence:
    """A short roll as sensors without errors see it."""
    return short(**NOISELESS, rod_imus=True)


@pytest.fixture(scope="module")
def noisy() -> Sequence:
    """The same roll with the noise of T Table I."""
    return short(rod_imus=True)


def arrays(sequence: Sequence) -> list[NDArray[Any]]:
    assert sequence.contacts is not None
    assert sequence.groundtruth is not None
    assert sequence.endcaps is not None
    return [
        sequence.imu.gyro,
        sequence.imu.accel,
        sequence.cables.lengths,
        sequence.contacts.flags,
        sequence.groundtruth.position,
        sequence.groundtruth.quaternion,
        sequence.endcaps.position,
    ]


def endcaps_of(sequence: Sequence) -> FloatArray:
    assert sequence.endcaps is not None
    return sequence.endcaps.position


def flags_of(sequence: Sequence) -> NDArray[np.bool_]:
    assert sequence.contacts is not None
    return sequence.contacts.flags


def mutual_moments(endcaps: FloatArray) -> FloatArray:
    """(c_j - c_i) . (u_i x u_j) of the rod pairs, negative for the robot of T."""
    axes = endcaps[:, 0::2] - endcaps[:, 1::2]
    centres = (endcaps[:, 0::2] + endcaps[:, 1::2]) / 2
    pairs = ((0, 1), (1, 2), (2, 0))
    return np.stack(
        [
            np.sum((centres[:, j] - centres[:, i]) * np.cross(axes[:, i], axes[:, j]), axis=1)
            for i, j in pairs
        ],
        axis=1,
    )


# --- repeatability ------------------------------------------------------------------------------


def test_same_seed_gives_identical_recordings(noisy: Sequence) -> None:
    again = short(rod_imus=True)
    for one, other in zip(arrays(noisy), arrays(again), strict=True):
        np.testing.assert_array_equal(one, other)


def test_seeds_differ_in_motion_and_noise(noisy: Sequence) -> None:
    other = short(seed=1)
    length = min(len(endcaps_of(noisy)), len(endcaps_of(other)))
    # Compared in shape, so that the initial yaw does not count.
    gap = np.abs(noisy.cables.lengths[: length // 2] - other.cables.lengths[: length // 2])
    assert gap.max() > 0.05
    assert not np.array_equal(noisy.imu.gyro[:100], other.imu.gyro[:100])


def test_sensor_errors_do_not_change_the_motion(exact: Sequence, noisy: Sequence) -> None:
    np.testing.assert_array_equal(endcaps_of(exact), endcaps_of(noisy))
    np.testing.assert_array_equal(flags_of(exact), flags_of(noisy))


def test_without_randomization_only_noise_depends_on_the_seed() -> None:
    one, other = (short(seed=seed, randomize=False, path_length=0.1) for seed in (0, 1))
    np.testing.assert_array_equal(endcaps_of(one), endcaps_of(other))
    assert not np.array_equal(one.imu.gyro, other.imu.gyro)


# --- layout -------------------------------------------------------------------------------------


def test_rates_and_lengths_of_the_streams(exact: Sequence) -> None:
    assert exact.contacts is not None
    assert exact.groundtruth is not None
    assert exact.endcaps is not None
    assert set(np.diff(exact.imu.t_ns)) == {5_000_000}
    assert set(np.diff(exact.cables.t_ns)) == {10_000_000}
    for t_ns in (exact.contacts.t_ns, exact.groundtruth.t_ns, exact.endcaps.t_ns):
        np.testing.assert_array_equal(t_ns, exact.imu.t_ns)
    assert exact.imu.t_ns[0] == exact.cables.t_ns[0] == 0
    assert 0 <= exact.imu.t_ns[-1] - exact.cables.t_ns[-1] < 10_000_000
    assert list(exact.other_imus) == ["r23", "r45"]


def test_stands_still_on_the_first_face_at_the_start_and_at_the_end(exact: Sequence) -> None:
    speed = np.linalg.norm(np.diff(endcaps_of(exact), axis=0), axis=2).max(axis=1) / 0.005
    assert speed[:200].max() < 0.003
    assert speed[-100:].max() < 0.003
    assert speed.max() > 0.3
    np.testing.assert_array_equal(flags_of(exact)[:200], 200 * [[1, 0, 0, 1, 0, 1]])


def test_path_is_as_long_as_asked(exact: Sequence) -> None:
    centre = endcaps_of(exact)[:, :, :2].mean(axis=1)
    path = np.linalg.norm(np.diff(centre, axis=0), axis=1).sum()
    # The robot stops driving when the path is long enough; what it is falling into then adds.
    assert 0.7 <= path < 0.7 + 0.6


# --- truth --------------------------------------------------------------------------------------


def test_rods_are_rigid(exact: Sequence) -> None:
    endcaps = endcaps_of(exact)
    lengths = np.linalg.norm(endcaps[:, 0::2] - endcaps[:, 1::2], axis=2)
    np.testing.assert_allclose(lengths, 1.45, atol=1e-9)


def test_true_pose_is_that_of_the_imu_on_the_base_rod(exact: Sequence) -> None:
    assert exact.groundtruth is not None
    endcaps, robot = endcaps_of(exact), exact.robot
    axis = (endcaps[:, 0] - endcaps[:, 1]) / robot.rod_length
    centre = (endcaps[:, 0] + endcaps[:, 1]) / 2
    rotation = Rotation.from_quat(exact.groundtruth.quaternion)
    np.testing.assert_allclose(rotation.apply([0, 0, 1]), axis, atol=1e-9)
    np.testing.assert_allclose(
        exact.groundtruth.position, centre + robot.imu_offset * axis, atol=1e-9
    )


def integrated(sequence: Sequence) -> tuple[FloatArray, Rotation]:
    """Final position and rotation by integrating the IMU from the true initial pose at rest."""
    assert sequence.groundtruth is not None
    step, gravity = 0.005, np.array([0, 0, -9.81])
    rotation = Rotation.from_quat(sequence.groundtruth.quaternion[0])
    position, velocity = sequence.groundtruth.position[0].copy(), np.zeros(3)
    for gyro, accel in zip(sequence.imu.gyro[1:], sequence.imu.accel[1:], strict=True):
        middle = rotation * Rotation.from_rotvec(gyro * step / 2)
        acceleration = middle.apply(accel) + gravity
        position += velocity * step + acceleration * step**2 / 2
        velocity += acceleration * step
        rotation = rotation * Rotation.from_rotvec(gyro * step)
    return position, rotation


def test_integrating_the_exact_imu_reproduces_the_truth(exact: Sequence) -> None:
    assert exact.groundtruth is not None
    position, rotation = integrated(exact)
    truth = Rotation.from_quat(exact.groundtruth.quaternion[-1])
    assert np.linalg.norm(position - exact.groundtruth.position[-1]) < 0.02
    assert (rotation.inv() * truth).magnitude() < np.radians(0.05)


def test_instantaneous_samples_miss_what_happens_between_them(exact: Sequence) -> None:
    instantaneous = short(**NOISELESS, imu_sampling="instantaneous")
    np.testing.assert_array_equal(endcaps_of(instantaneous), endcaps_of(exact))
    assert exact.groundtruth is not None
    position, _ = integrated(instantaneous)
    mean_position, _ = integrated(exact)
    truth = exact.groundtruth.position[-1]
    assert np.linalg.norm(position - truth) > 3 * np.linalg.norm(mean_position - truth)


def test_imus_of_the_other_rods_feel_gravity_along_their_rods(exact: Sequence) -> None:
    endcaps = endcaps_of(exact)[0]
    for name, first in (("r23", 2), ("r45", 4)):
        rise = (endcaps[first, 2] - endcaps[first + 1, 2]) / exact.robot.rod_length
        accel = exact.other_imus[name].accel[:100].mean(axis=0)
        assert accel[2] == pytest.approx(9.81 * rise, abs=0.01)
        assert np.linalg.norm(accel) == pytest.approx(9.81, abs=0.01)


# --- sensor errors ------------------------------------------------------------------------------


def test_noise_has_the_size_of_the_options(exact: Sequence, noisy: Sequence) -> None:
    # Biases walk slowly: differences of neighbours hold the white noise, twice.
    def white(values: FloatArray) -> float:
        return float(np.diff(values, axis=0).std() / np.sqrt(2))

    assert white(noisy.imu.gyro - exact.imu.gyro) == pytest.approx(0.002, rel=0.05)
    assert white(noisy.imu.accel - exact.imu.accel) == pytest.approx(0.043, rel=0.05)
    assert white(noisy.cables.lengths - exact.cables.lengths) == pytest.approx(0.002, rel=0.05)


def test_biases_walk_from_zero(exact: Sequence) -> None:
    walking = short(**(NOISELESS | {"gyro_bias_walk": 0.01, "accel_bias_walk": 0.02}))
    gyro_bias = walking.imu.gyro - exact.imu.gyro
    accel_bias = walking.imu.accel - exact.imu.accel
    np.testing.assert_array_equal(gyro_bias[0], 0)
    np.testing.assert_array_equal(accel_bias[0], 0)
    per_sample = np.sqrt(0.005)
    assert np.diff(gyro_bias, axis=0).std() == pytest.approx(0.01 * per_sample, rel=0.05)
    assert np.diff(accel_bias, axis=0).std() == pytest.approx(0.02 * per_sample, rel=0.05)


def test_cable_lengths_are_distances_of_endcap_centres(exact: Sequence) -> None:
    endcaps = endcaps_of(exact)[::2]
    for column, cable in enumerate(exact.robot.cables):
        i, j = cable.endcaps
        distance = np.linalg.norm(endcaps[:, i] - endcaps[:, j], axis=1)
        np.testing.assert_allclose(exact.cables.lengths[:, column], distance, atol=1e-9)


def test_cable_offsets_are_added(exact: Sequence) -> None:
    offsets = tuple(0.001 * k for k in range(9))
    shifted = short(**NOISELESS, cable_offsets=offsets)
    difference = shifted.cables.lengths - exact.cables.lengths
    np.testing.assert_allclose(difference, np.tile(offsets, (len(difference), 1)), atol=1e-12)


def test_drawn_cable_offsets_have_the_size_of_the_option(exact: Sequence) -> None:
    offsets = []
    for seed in (0, 1):
        options = {"randomize": False, "path_length": 0.1, "seed": seed}
        plain = short(**NOISELESS, **options).cables.lengths
        shifted = short(**NOISELESS, **options, cable_offset_std=0.005).cables.lengths
        offsets.append((shifted - plain)[0])
        np.testing.assert_allclose(
            shifted - plain, np.tile(offsets[-1], (len(plain), 1)), atol=1e-12
        )
    assert not np.allclose(offsets[0], offsets[1])
    # Of 18 normal values: 99.98 % of all seeds lie between (chi-square distribution).
    assert 0.44 < np.sqrt(np.mean(np.square(offsets))) / 0.005 < 1.65


def test_contacts_lie_on_the_ground(exact: Sequence) -> None:
    heights, flags = endcaps_of(exact)[:, :, 2], flags_of(exact)
    radius = exact.robot.endcap_radius
    assert np.all(heights[flags] < radius)
    assert np.all(heights[flags] > 0)  # impacts press the soft ground in by some 20 mm
    assert np.median(heights[flags]) == pytest.approx(radius - 0.003, abs=0.001)
    assert np.all(heights[~flags] > radius - 0.001)
    assert 2 < flags.sum(axis=1).mean() <= 3


def test_wrong_contact_flags_come_at_their_rates(exact: Sequence) -> None:
    wrong = flags_of(short(contact_false_rate=0.1, contact_missing_rate=0.3))
    truth = flags_of(exact)
    assert wrong[~truth].mean() == pytest.approx(0.1, abs=0.02)
    assert (~wrong[truth]).mean() == pytest.approx(0.3, abs=0.03)


# --- sensors that fall silent -------------------------------------------------------------------


def test_imu_gaps_lack_whole_samples_of_the_base_imu_alone(noisy: Sequence) -> None:
    gappy = short(rod_imus=True, imu_gap=0.05, imu_gap_period=1.5)
    # The motion begins after 1 s: gaps from 2.5 s, 4 s, ... on, each of ten samples of 5 ms.
    last = noisy.imu.t_ns[-1] * 1e-9
    starts = np.arange(2.5, last, 1.5)
    assert len(starts) > 2
    in_gap = np.zeros(len(noisy.imu.t_ns), dtype=bool)
    for first in np.round(starts / 0.005).astype(int):
        in_gap[first : first + 10] = True
    np.testing.assert_array_equal(gappy.imu.t_ns, noisy.imu.t_ns[~in_gap])
    np.testing.assert_array_equal(gappy.imu.gyro, noisy.imu.gyro[~in_gap])
    np.testing.assert_array_equal(gappy.imu.accel, noisy.imu.accel[~in_gap])
    for one, other in zip(arrays(gappy)[2:], arrays(noisy)[2:], strict=True):
        np.testing.assert_array_equal(one, other)
    for name, imu in noisy.other_imus.items():
        np.testing.assert_array_equal(gappy.other_imus[name].gyro, imu.gyro)


@pytest.mark.parametrize(
    ("failure", "first", "last"),
    [
        ({"lost_cable_from": 0.5}, 1.5, np.inf),
        ({"lost_cable_from": 0.5, "lost_cable_duration": 0.75}, 1.5, 2.25),
        ({"lost_cable_from": -1.0}, 0.0, np.inf),
    ],
)
def test_a_lost_cable_has_no_lengths_while_it_is_lost(
    failure: dict[str, float], first: float, last: float, noisy: Sequence
) -> None:
    sequence = short(rod_imus=True, lost_cable="l_1_3", **failure)
    seconds = noisy.cables.t_ns * 1e-9
    expected = noisy.cables.lengths.copy()
    expected[(seconds > first - 1e-6) & (seconds < last - 1e-6), 4] = np.nan
    np.testing.assert_array_equal(sequence.cables.lengths, expected)
    np.testing.assert_array_equal(sequence.imu.accel, noisy.imu.accel)


# --- robots and worlds --------------------------------------------------------------------------


def test_mirrored_robot_has_the_other_chirality(exact: Sequence) -> None:
    mirrored = short(mirrored=True)
    assert exact.robot.chirality == "counter_clockwise"
    assert mirrored.robot.chirality == "clockwise"
    assert np.all(mutual_moments(endcaps_of(exact)) < 0)
    assert np.all(mutual_moments(endcaps_of(mirrored)) > 0)


@pytest.mark.parametrize(("manoeuvre", "sign"), [("left-turn", 1), ("right-turn", -1)])
def test_turns_go_to_their_side(manoeuvre: str, sign: int) -> None:
    endcaps = endcaps_of(short(manoeuvre, path_length=5.0))
    axis = (endcaps[:, 0::2] - endcaps[:, 1::2]).sum(axis=1)
    yaw = np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))
    assert sign * (yaw[-1] - yaw[0]) > np.radians(15)


def test_mirror_image_turns_left_as_the_robot_turns_right() -> None:
    robot = short("right-turn", randomize=False, **NOISELESS)
    image = short("left-turn", randomize=False, mirrored=True, **NOISELESS)
    until = 500  # falls amplify rounding errors
    np.testing.assert_allclose(
        robot.cables.lengths[:until], image.cables.lengths[:until], atol=1e-3
    )


def test_backward_goes_opposite_to_forward() -> None:
    travelled = []
    for manoeuvre in ("forward", "backward"):
        centre = endcaps_of(short(manoeuvre, path_length=1.5, randomize=False)).mean(axis=1)
        travelled.append(centre[-1] - centre[0])
    forward, backward = travelled
    assert forward @ backward < -0.8 * np.linalg.norm(forward) * np.linalg.norm(backward)


def test_sloping_ground_rises_where_it_should_and_gravity_stays() -> None:
    sequence = short(slope=5.0, slope_direction=90.0, **NOISELESS)
    endcaps, flags = endcaps_of(sequence), flags_of(sequence)
    angle = np.radians(5)
    above = endcaps @ np.array([0, -np.sin(angle), np.cos(angle)])
    radius = sequence.robot.endcap_radius
    assert np.all(above[flags] < radius)
    assert np.median(above[flags]) == pytest.approx(radius - 0.003, abs=0.001)
    assert np.all(above[~flags] > radius - 0.001)
    assert sequence.groundtruth is not None
    rotation = Rotation.from_quat(sequence.groundtruth.quaternion[:100])
    force = rotation.apply(sequence.imu.accel[:100]).mean(axis=0)
    np.testing.assert_allclose(force, [0, 0, 9.81], atol=0.02)


def test_endcap_radius_is_where_the_endcaps_rest() -> None:
    sequence = short(endcap_radius=0.02, path_length=0.01)
    assert sequence.robot.endcap_radius == 0.02
    heights = endcaps_of(sequence)[0, [0, 3, 5], 2]
    np.testing.assert_allclose(heights, 0.02, atol=0.005)


def test_cables_attached_beside_the_axis_hold_the_spin(exact: Sequence) -> None:
    """A cable that pulls on the axis exerts no moment about it: the rods spin freely."""
    free = short(cable_attachment_offset=0.0, **NOISELESS)
    assert free.imu.gyro[:, 2].std() > 2 * exact.imu.gyro[:, 2].std()


def test_faster_cables_roll_faster(exact: Sequence) -> None:
    assert short(cable_speed=0.25).duration_s < exact.duration_s


# --- bad input ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "field", "problem"),
    [
        ({"friction": -1.0}, "friction", "greater than 0"),
        ({"slope": 45.0}, "slope", r"\[deg\], got 45"),
        ({"seed": -1}, "seed", "greater than or equal to 0"),
        ({"gyro_noise": float("nan")}, "gyro_noise", r"finite number \[rad/s\]"),
        ({"imu_sampling": "mean"}, "imu_sampling", "interval_mean"),
        ({"imu_gap": 0.0}, "imu_gap", r"greater than 0 \[s\], got 0"),
        ({"imu_gap": 10.0}, "imu_gap", "gaps of 10 s every 10 s leave no samples"),
        ({"lost_cable_duration": -1.0}, "lost_cable_duration", r"greater than 0 \[s\]"),
        ({"frition": 1.0}, "frition", "did you mean 'friction'"),
    ],
)
def test_options_reject_what_cannot_be(values: dict[str, Any], field: str, problem: str) -> None:
    with pytest.raises(InputError, match=problem) as error:
        SimulationOptions(**values)
    assert error.value.field == field


def test_cable_offsets_are_one_per_cable() -> None:
    with pytest.raises(InputError, match="expected 9 offsets"):
        short(cable_offsets=(0.1, 0.2))


def test_the_lost_cable_is_one_of_the_robot() -> None:
    with pytest.raises(InputError, match=r"no cable is called 'l_4_0' \(cables: l_0_4, l_0_2"):
        short(lost_cable="l_4_0")


def test_unknown_manoeuvre_is_named() -> None:
    with pytest.raises(InputError, match="did you mean 'forward'"):
        simulate("foward")


def test_robot_that_cannot_roll_is_called_stuck() -> None:
    with pytest.raises(InputError, match="is called stuck"):
        short(friction=0.02, cable_speed=1.0, path_length=5.0)


def test_missing_mujoco_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r"tensegrity-estimation\[sim\]"):
        simulate("forward")


# --- progress and names -------------------------------------------------------------------------


def test_progress_grows_to_one() -> None:
    fractions: list[float] = []
    simulate("forward", SimulationOptions(**SHORT), progress=fractions.append)
    assert len(fractions) > 10
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1


def test_manoeuvres_have_the_lengths_of_the_paper() -> None:
    assert {m.value: m.path_length for m in Manoeuvre} == {
        "forward": 7.50,
        "backward": 6.74,
        "left-turn": 18.61,
        "right-turn": 15.70,
    }
