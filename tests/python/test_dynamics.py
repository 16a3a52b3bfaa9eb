"""Nets and their dynamics, against SciPy's and MuJoCo's integration of the same equations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tensegrity import robots
from tensegrity.dynamics import (
    Simulator,
    anchors_under,
    at_rest,
    positions_of,
    relax,
    stable_step,
)
from tensegrity.errors import InputError
from tensegrity.robots import Net
from tensegrity.yaml_model import dump

FloatArray = NDArray[np.float64]


@pytest.fixture(scope="module")
def superball() -> Net:
    return robots.load_net("superball")


@pytest.fixture(scope="module")
def prism() -> Net:
    return Net.from_prism(robots.load("prism3"))


def changed(net: Net, **values: Any) -> Net:
    return Net.model_validate(net.model_dump() | values)


def moving_states(net: Net, simulations: int, displaced: float) -> FloatArray:
    """The net in equilibrium, nodes ``displaced`` [m] and a hundred times that in motion [m/s]."""
    rng = np.random.default_rng(0)
    rest = at_rest(relax(net))
    scale = np.repeat([displaced, 100 * displaced], rest.size // 2)
    return rest + scale * rng.standard_normal((simulations, rest.size))


def right_side(net: Net, state: FloatArray, gravity: float = 0.0) -> FloatArray:
    """The equations of motion as C §IV-A has them, with its connectivity matrix, for one state.
    With gravity there is smooth ground."""
    n = len(net.nodes)
    ends = np.vstack([net.rod_ends(), net.cable_ends()])
    connectivity = np.zeros((len(ends), n))
    connectivity[np.arange(len(ends)), ends[:, 0]] = 1
    connectivity[np.arange(len(ends)), ends[:, 1]] = -1
    stiffness = np.array([member.stiffness for member in net.members])
    damping = np.array([member.damping for member in net.members])
    rest = np.concatenate([np.full(len(net.rods), net.rod_length), net.rest_lengths()])
    x, v = state.reshape(2, n, 3)
    u = connectivity @ x
    length = np.linalg.norm(u, axis=1)
    rate = np.sum(u * (connectivity @ v), axis=1) / length
    density = stiffness * (1 - rest / length) + damping / length * rate
    cable = np.arange(len(ends)) >= len(net.rods)
    density[cable & ((length < rest) | (density < 0))] = 0
    force = -connectivity.T @ np.diag(density) @ u
    if gravity:
        depth = np.maximum(0.0, -x[:, 2])
        normal = depth * (net.ground.stiffness - net.ground.damping * v[:, 2])
        force[:, 2] += np.maximum(0.0, normal) - net.node_mass * gravity
    return np.concatenate([v.ravel(), force.ravel() / net.node_mass])


def integrated(net: Net, state: FloatArray, seconds: float, gravity: float = 0.0) -> FloatArray:
    """The state after some time by an adaptive method of eighth order."""
    solution = solve_ivp(
        lambda t, y: right_side(net, y, gravity),
        (0, seconds),
        state,
        method="DOP853",
        rtol=1e-9,
        atol=1e-11,
        max_step=1e-3,  # finds every contact
    )
    return np.asarray(solution.y[:, -1])


@pytest.mark.parametrize("name", ["superball", "prism"])
def test_equals_scipy_on_random_states(name: str, request: pytest.FixtureRequest) -> None:
    net: Net = request.getfixturevalue(name)
    states = moving_states(net, 3, 0.001)
    simulator = Simulator(net, gravity=(0, 0, 0), ground=False)
    ours = simulator.step(states, net.rest_lengths(), 2e-4, 500)
    for state, end in zip(states, ours, strict=True):
        np.testing.assert_allclose(end, integrated(net, state, 0.1), atol=1e-6)


def test_equals_scipy_when_cables_slacken(superball: Net) -> None:
    state = moving_states(superball, 1, 0.02)[0]
    simulator = Simulator(superball, gravity=(0, 0, 0), ground=False)
    cables = superball.cable_ends()
    slack = 0
    for _ in range(10):
        # Tautening bends the right side, where fixed steps lose their order.
        expected = integrated(superball, state, 0.01)
        state = simulator.step(state, superball.rest_lengths(), 2e-5, 500)
        np.testing.assert_allclose(state, expected, atol=2e-3)
        x = positions_of(state)
        lengths = np.linalg.norm(x[cables[:, 0]] - x[cables[:, 1]], axis=1)
        slack += np.sum(lengths < superball.rest_lengths())
    assert slack > 10


def test_equals_scipy_when_it_falls_on_smooth_ground(superball: Net) -> None:
    smooth = superball.ground.model_copy(update={"friction_static": 0.0, "friction_kinetic": 0.0})
    net = changed(superball, ground=smooth.model_dump())
    state = at_rest(net.standing_on((6, 8, 9)))
    state[2 : state.size // 2 : 3] += 0.05
    end = Simulator(net).step(state, net.rest_lengths(), 1e-4, 2000)
    assert positions_of(end)[:, 2].min() < -0.005
    np.testing.assert_allclose(end, integrated(net, state, 0.2, 9.81), atol=2e-5)


def test_equals_point_masses_on_springs_in_mujoco(superball: Net) -> None:
    mujoco = pytest.importorskip("mujoco")
    # Taut cables are springs like rods: MuJoCo's tendons are not unilateral in their damping.
    net = changed(
        superball, cables=[c.model_dump() | {"rest_length": 0.8} for c in superball.cables]
    )
    bodies, tendons = [], []
    for i, node in enumerate(net.nodes):
        bodies.append(
            f'<body pos="{" ".join(map(str, node.position))}">'
            '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
            '<joint type="slide" axis="0 0 1"/>'
            f'<geom size=".01" mass="{net.node_mass}" contype="0" conaffinity="0"/>'
            f'<site name="s{i}"/></body>'
        )
    members = [(net.rod_ends(), net.rods, [net.rod_length] * 6)]
    members.append((net.cable_ends(), net.cables, list(net.rest_lengths())))
    for ends, kinds, rest in members:
        for (a, b), member, length in zip(ends, kinds, rest, strict=True):
            tendons.append(
                f'<spatial stiffness="{member.stiffness}" damping="{member.damping}" '
                f'springlength="{length}"><site site="s{a}"/><site site="s{b}"/></spatial>'
            )
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="1e-4" integrator="RK4"/>'
        f"<worldbody>{''.join(bodies)}</worldbody><tendon>{''.join(tendons)}</tendon></mujoco>"
    )
    data = mujoco.MjData(model)
    state = moving_states(net, 1, 0.001)[0]
    half = state.size // 2
    data.qpos[:] = state[:half] - net.undeformed_positions().ravel()
    data.qvel[:] = state[half:]
    for _ in range(2000):
        mujoco.mj_step(model, data)
    ours = Simulator(net, ground=False).step(state, net.rest_lengths(), 1e-4, 2000)
    theirs = data.qpos + net.undeformed_positions().ravel()
    np.testing.assert_allclose(ours[:half], theirs, atol=1e-6)
    np.testing.assert_allclose(ours[half:], data.qvel, atol=1e-4)


def test_superball_is_the_expanded_octahedron(superball: Net) -> None:
    x = superball.undeformed_positions()
    assert superball.node_ids == tuple(range(1, 13))
    assert superball.node_mass * len(superball.nodes) == pytest.approx(21)

    def lengths(ends: NDArray[np.int32]) -> FloatArray:
        return np.asarray(np.linalg.norm(x[ends[:, 0]] - x[ends[:, 1]], axis=1))

    np.testing.assert_allclose(lengths(superball.rod_ends()), 1.7, atol=1e-12)
    np.testing.assert_allclose(lengths(superball.cable_ends()), 1.7 * np.sqrt(6) / 4, atol=1e-12)
    tension = [c.stiffness * (1.7 * np.sqrt(6) / 4 - c.rest_length) for c in superball.cables]
    np.testing.assert_allclose(tension, 100, atol=0.2)  # rest lengths are given to 0.1 mm
    assert len(superball.actuated()) == 12
    assert np.bincount(superball.cable_ends().ravel()).tolist() == [4] * 12


def test_superball_has_the_chirality_of_the_rolling_recording(
    superball: Net, shared_data: Path
) -> None:
    """Seen from above, the measured floor faces have the sense of rotation of the net's."""
    table = np.genfromtxt(
        shared_data / "superball/rolling_indoor/floor_truth.csv", delimiter=",", skip_header=1
    )
    for start in np.unique(table[:, 0]):
        rows = table[table[:, 0] == start]
        ids = [int(id_) for id_ in rows[:, 2]]
        model = superball.standing_on((ids[0], ids[1], ids[2]))
        feet = np.array([model[superball.index_of(id_)] for id_ in ids])[:, :2]
        turns = [np.linalg.det(triangle[1:] - triangle[0]) for triangle in (feet, rows[:, 3:])]
        assert turns[0] * turns[1] > 0


def test_relaxed_superball_keeps_its_symmetry_and_is_in_equilibrium(superball: Net) -> None:
    x = relax(superball)
    acceleration = right_side(superball, at_rest(x))[x.size :]
    assert np.abs(acceleration).max() * superball.node_mass < 1e-6
    rods = superball.rod_ends()
    # 245 N from four cables of 100 N shorten a rod by 2.4 mm.
    np.testing.assert_allclose(
        np.linalg.norm(x[rods[:, 0]] - x[rods[:, 1]], axis=1), 1.7 - 0.00244, atol=5e-5
    )


def test_relaxed_on_the_ground_its_weight_is_carried(prism: Net) -> None:
    for net in (prism, robots.load_net("superball")):
        x = relax(net, gravity=True)
        carried = net.ground.stiffness * np.maximum(0.0, -x[:, 2])
        assert carried.sum() == pytest.approx(len(net.nodes) * net.node_mass * 9.81, rel=1e-6)


def test_relaxed_prism_is_in_equilibrium(prism: Net) -> None:
    x = relax(prism)
    assert np.abs(right_side(prism, at_rest(x))[x.size :]).max() * prism.node_mass < 1e-6


def test_a_net_without_tension_in_a_shape_of_its_own_is_refused(
    superball: Net, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tensegrity.dynamics._RELAXATION_STEPS", 200)
    with pytest.raises(InputError, match="does not come to rest"):
        relax(superball, start=superball.undeformed_positions() * 1.2)


def test_superball_stands_on_a_face(superball: Net) -> None:
    x = relax(superball, start=superball.standing_on((6, 8, 9)), gravity=True)
    feet = [superball.index_of(id_) for id_ in (6, 8, 9)]
    carried = superball.ground.stiffness * -x[feet, 2]
    assert carried.sum() == pytest.approx(21 * 9.81, rel=1e-6)
    others = np.delete(np.arange(12), feet)
    assert x[others, 2].min() > 0.3
    # It stays there when it is stepped.
    state = at_rest(x)
    anchors = anchors_under(relaxed := state)
    state = Simulator(superball).step(state, superball.rest_lengths(), 5e-3, 400, anchors=anchors)
    assert np.abs(positions_of(state) - positions_of(relaxed)).max() < 0.01


def test_superball_stands_on_a_slope_and_slides_on_a_smooth_one(superball: Net) -> None:
    start = at_rest(relax(superball, start=superball.standing_on((6, 8, 9)), gravity=True))
    slope = np.arctan(0.2)
    gravity = 9.81 * np.array([np.sin(slope), 0, -np.cos(slope)])
    seconds = 0.5
    for friction in (0.64, 0.1):
        ground = superball.ground.model_copy(
            update={"friction_static": friction, "friction_kinetic": min(0.54, friction)}
        )
        simulator = Simulator(changed(superball, ground=ground.model_dump()), gravity=gravity)
        end = simulator.step(start, superball.rest_lengths(), 5e-3, round(seconds / 5e-3))
        moved = (positions_of(end) - positions_of(start)).mean(axis=0)[0]
        slides = max(0.0, gravity[0] + friction * gravity[2]) * seconds**2 / 2
        # It also leans downhill, elastically.
        assert moved == pytest.approx(slides, abs=0.05)


def test_steps_up_to_the_stable_one_stay_bounded_and_longer_ones_do_not(superball: Net) -> None:
    state = at_rest(relax(superball))
    state[-36:] += 1e-6 * np.random.default_rng(0).standard_normal(36)
    free = Simulator(superball, gravity=(0, 0, 0), ground=False)
    # The ground, which is not touched here, limits steps little: rods do.
    for integrator, above in (("rk4", 1.1), ("semi_implicit_euler", 1.5)):
        limit = stable_step(superball, integrator)
        calm = free.step(state, superball.rest_lengths(), 0.95 * limit, 2000, integrator)
        assert np.abs(calm - state).max() < 1e-3
        try:
            wild = free.step(state, superball.rest_lengths(), above * limit, 2000, integrator)
        except FloatingPointError:
            continue
        assert np.abs(wild - state).max() > 0.01


def test_the_step_of_the_filter_is_stable(superball: Net) -> None:
    assert stable_step(superball) > 0.005


def test_shapes_and_values_are_checked(superball: Net) -> None:
    simulator, lengths = Simulator(superball), superball.rest_lengths()
    state = at_rest(superball.undeformed_positions())
    with pytest.raises(InputError, match=r"expected shape \(simulations, 72\)"):
        simulator.step(state[:-1], lengths, 0.005, 1)
    with pytest.raises(InputError, match="expected 24 numbers >= 0"):
        simulator.step(state, lengths[:3], 0.005, 1)
    with pytest.raises(InputError, match="expected 24 numbers >= 0"):
        simulator.step(state, -lengths, 0.005, 1)
    with pytest.raises(InputError, match="dt > 0"):
        simulator.step(state, lengths, 0.0, 1)
    with pytest.raises(InputError, match=r"anchors: expected shape \(1, 24\)"):
        simulator.step(state, lengths, 0.005, 1, anchors=np.zeros(23))
    state[5] = np.nan
    with pytest.raises(FloatingPointError, match="1 of 1 simulations"):
        simulator.step(state, lengths, 0.005, 1)


def test_single_precision_and_the_given_array(superball: Net) -> None:
    states = moving_states(superball, 5, 0.01) + np.repeat([2.0, 0.0], 36)
    before = states.copy()
    double = Simulator(superball).step(states, superball.rest_lengths(), 0.005, 20)
    single = Simulator(superball, precision="float").step(
        states, superball.rest_lengths(), 0.005, 20
    )
    np.testing.assert_array_equal(states, before)
    assert 0 < np.abs(double - single)[:, :36].max() < 1e-5
    assert np.abs(double - single)[:, 36:].max() < 1e-3


def test_modules_sit_on_the_rods(superball: Net) -> None:
    x = superball.undeformed_positions()
    modules = superball.module_positions(np.stack([x, 2 * x]))
    np.testing.assert_allclose(np.linalg.norm(modules[0] - x, axis=1), 0.1)
    np.testing.assert_allclose(modules[0, 0], [-0.425, -0.75, 0.0], atol=1e-12)
    np.testing.assert_allclose(modules[1, 0], [-0.85, -1.6, 0.0], atol=1e-12)


def test_a_file_of_a_net_may_state_only_what_differs(superball: Net, tmp_path: Path) -> None:
    file = tmp_path / "ours.yaml"
    file.write_text("name: ours\nrod_length: 1.75\n")
    assert robots.load_net(file) == superball.model_copy(
        update={"name": "ours", "rod_length": 1.75}
    )
    file.write_text(dump(superball))
    assert robots.load_net(file) == superball
    assert robots.packaged_nets() == ["superball"]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("rods:\n  - {ends: [1, 2], stiffness: 1.0, damping: 0.0}", "node 3 is the end of 0 rods"),
        ("rod_length: 2.5", r"nodes \[1, 2\] of a rod are 1.7 m apart, rod_length is 2.5 m"),
        ("module_inset: 0.9", "module_inset 0.9 m is beyond the middle"),
        ("ground: {friction_kinetic: 0.7}", "kinetic friction 0.7 is above static friction 0.64"),
        ("node_mass: 0", r"expected a number > 0 \[kg\], got 0"),
        (
            "cables:\n  - {ends: [1, 99], kind: passive, stiffness: 1.0, damping: 0.0, "
            "rest_length: 1.0}",
            "cables: there is no node 99",
        ),
        (
            "cables:\n  - {ends: [2, 1], kind: passive, stiffness: 1.0, damping: 0.0, "
            "rest_length: 1.0}",
            r"cables: \[2, 1\] is there twice",
        ),
        (
            "cables:\n  - {ends: [1, 1], kind: passive, stiffness: 1.0, damping: 0.0, "
            "rest_length: 1.0}",
            r"cables: \[1, 1\] joins a node to itself",
        ),
        ("nodes:\n" + "  - {id: 1, position: [0.0, 0.0, 0.0]}\n" * 2, "node 1 is there 2 times"),
    ],
)
def test_what_is_no_net_is_refused(text: str, problem: str, tmp_path: Path) -> None:
    file = tmp_path / "net.yaml"
    file.write_text(text + "\n")
    with pytest.raises(InputError, match=problem):
        robots.load_net(file)


def test_a_net_cannot_stand_on_nodes_that_are_no_face(superball: Net) -> None:
    with pytest.raises(InputError, match=r"cannot stand on the nodes \[1, 2, 3\]"):
        superball.standing_on((1, 2, 3))
    with pytest.raises(KeyError, match="no node 13"):
        superball.index_of(13)
