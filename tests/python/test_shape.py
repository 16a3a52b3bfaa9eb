"""Shape reconstruction from Python: independent references and recorded robots."""

from __future__ import annotations

from pathlib import Path

import casadi
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

_core = pytest.importorskip("tensegrity._core", reason="the C++ module is not built")

Array = NDArray[np.float64]

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "prism3"
CABLES = np.array(_core.PRISM_CABLES)
CABLE_STD = 0.002  # m


@pytest.fixture
def robot() -> _core.Prism:
    return _core.Prism()


def random_shapes(robot: _core.Prism, count: int, seed: int = 0) -> list[Array]:
    """Valid shapes with rods of the right length, 60 mm from the undeformed robot."""
    rng = np.random.default_rng(seed)
    shapes: list[Array] = []
    while len(shapes) < count:
        q = robot.undeformed() + np.vstack([np.zeros((2, 3)), rng.normal(0, 0.06, (4, 3))])
        for even in (2, 4):
            centre, axis = (q[even] + q[even + 1]) / 2, q[even] - q[even + 1]
            half = robot.rod_length / 2 * axis / np.linalg.norm(axis)
            q[even], q[even + 1] = centre + half, centre - half
        if np.all(_core.mutual_moments(q) < 0):
            shapes.append(q)
    return shapes


def lengths_of(q: Array) -> Array:
    return np.asarray(np.linalg.norm(q[CABLES[:, 0]] - q[CABLES[:, 1]], axis=1))


def test_lengths_are_distances_of_endcaps(robot: _core.Prism) -> None:
    for q in random_shapes(robot, 5):
        np.testing.assert_allclose(_core.cable_lengths(q), lengths_of(q), atol=1e-12)


def test_solver_agrees_with_scipy(robot: _core.Prism) -> None:
    """SciPy on the coordinates of q2..q5, rods held by stiff residuals, knows nothing of ours."""
    rng = np.random.default_rng(1)
    undeformed = robot.undeformed()
    stiffness = 1e3

    def residuals(x: Array, lengths: Array) -> Array:
        q = np.vstack([undeformed[:2], x.reshape(4, 3)])
        rods = [np.linalg.norm(q[i] - q[i + 1]) - robot.rod_length for i in (2, 4)]
        return np.concatenate([lengths_of(q) - lengths, stiffness * np.array(rods)])

    for q in random_shapes(robot, 8, seed=1):
        lengths = lengths_of(q) + rng.normal(0, CABLE_STD, 9)
        solver = _core.ShapeSolver(robot)
        assert solver.solve(lengths) is _core.Status.OK
        fit = least_squares(
            residuals, solver.endcaps[2:].ravel() + rng.normal(0, 1e-3, 12), args=(lengths,),
            xtol=1e-15, ftol=1e-15, gtol=1e-15,
        )  # fmt: skip
        assert solver.cost == pytest.approx(2 * fit.cost, abs=1e-10)
        found = _core.in_body_frame(robot, np.vstack([undeformed[:2], fit.x.reshape(4, 3)]))
        np.testing.assert_allclose(_core.cable_lengths(found), _core.cable_lengths(solver.endcaps),
                                   atol=1e-5)  # fmt: skip


@pytest.mark.skipif(not hasattr(_core, "IpoptShapeSolver"), reason="built without Ipopt")
@pytest.mark.parametrize("constraints", [_core.ConstraintSet.AS_PRINTED,
                                         _core.ConstraintSet.CORRECTED,
                                         _core.ConstraintSet.MUTUAL_MOMENT])  # fmt: skip
def test_ipopt_agrees_with_casadi(robot: _core.Prism, constraints: _core.ConstraintSet) -> None:
    """The same problem written out symbolically, with derivatives by CasADi."""
    rng = np.random.default_rng(2)
    for shape in random_shapes(robot, 3, seed=3):
        lengths = lengths_of(shape) + rng.normal(0, CABLE_STD, 9)
        reference = _core.IpoptShapeSolver(robot, constraints=constraints)
        assert reference.solve(lengths) is _core.Status.OK

        x = casadi.SX.sym("x", 12)
        fixed = robot.undeformed()
        q = [casadi.SX(fixed[0]), casadi.SX(fixed[1]), *(x[3 * i : 3 * i + 3] for i in range(4))]
        c = [(q[2 * k] + q[2 * k + 1]) / 2 for k in range(3)]
        u = [q[2 * k] - q[2 * k + 1] for k in range(3)]
        cost = sum(
            (casadi.norm_2(q[i] - q[j]) - length) ** 2
            for (i, j), length in zip(CABLES, lengths, strict=True)
        )
        rods = [casadi.sumsqr(u[k]) - robot.rod_length**2 for k in (1, 2)]
        if constraints is _core.ConstraintSet.MUTUAL_MOMENT:
            pairs = [(0, 1), (1, 2), (2, 0)]
            g = [-casadi.dot(c[j] - c[i], casadi.cross(u[i], u[j])) for i, j in pairs]
        else:
            base = -u[0] if constraints is _core.ConstraintSet.AS_PRINTED else u[0]
            g = [q[2][2], -q[3][2], q[4][2], -q[5][2]]
            g += [
                casadi.dot(casadi.cross(c[1] - c[0], c[2] - c[1]), u[1]),
                casadi.dot(casadi.cross(c[2] - c[1], c[0] - c[2]), u[2]),
                casadi.dot(casadi.cross(c[0] - c[2], c[1] - c[0]), base),
                casadi.dot(q[2] - q[4], q[5] - q[1]),
                casadi.dot(q[0] - q[2], q[3] - q[5]),
                casadi.dot(q[4] - q[0], q[1] - q[3]),
            ]
        values = casadi.Function("g", [x], [casadi.vertcat(*g)])(reference.endcaps[2:].ravel())
        np.testing.assert_allclose(
            np.asarray(values).ravel(),
            _core.inequality_values(robot, reference.endcaps, constraints),
            atol=1e-12,
        )
        options = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0, "ipopt.tol": 1e-9}
        problem = {"x": x, "f": cost, "g": casadi.vertcat(*rods, *g)}
        solution = casadi.nlpsol("shape", "ipopt", problem, options)(
            x0=reference.endcaps[2:].ravel(), lbg=0, ubg=[0, 0] + [casadi.inf] * len(g)
        )
        assert reference.cost == pytest.approx(float(solution["f"]), abs=1e-9)


def test_covariance_needs_a_solution_and_positive_deviations(robot: _core.Prism) -> None:
    solver = _core.ShapeSolver(robot)
    with pytest.raises(ValueError, match="not_initialized"):
        solver.covariance(CABLE_STD)
    solver.solve(lengths_of(robot.undeformed()))
    with pytest.raises(ValueError, match="out_of_range"):
        solver.covariance(-CABLE_STD)
    with_prior = solver.covariance(CABLE_STD, prior_std=0.01)
    without = solver.covariance(CABLE_STD)
    assert with_prior.shape == without.shape == (18, 18)
    assert np.trace(with_prior) < np.trace(without)


def test_degenerate_endcaps_are_refused(robot: _core.Prism) -> None:
    q = robot.undeformed()
    q[3] = q[2]
    with pytest.raises(ValueError, match="distinct ends"):
        _core.length_jacobian(robot, q)


class Recording:
    """Cable samples of a recorded robot with its true shape in the body frame."""

    def __init__(self, name: str, robot: _core.Prism) -> None:
        directory = DATA / name
        if not directory.is_dir():
            pytest.skip(f"recording {name} is not here")
        cables = np.loadtxt(directory / "cables.csv", delimiter=",", skiprows=1)
        endcaps = np.loadtxt(directory / "endcaps.csv", delimiter=",", skiprows=1)
        rows = np.searchsorted(endcaps[:, 0], cables[:, 0])
        self.lengths = cables[:, 1:]
        self.shapes = np.stack(
            [_core.in_body_frame(robot, row.reshape(6, 3)) for row in endcaps[rows, 1:]]
        )


@pytest.fixture(params=["forward", "right"])
def recording(request: pytest.FixtureRequest, robot: _core.Prism) -> Recording:
    return Recording(request.param, robot)


def test_a_rolling_robot_keeps_its_moments_but_not_the_printed_heights(
    recording: Recording, robot: _core.Prism
) -> None:
    moments = np.array([_core.mutual_moments(q) for q in recording.shapes])
    values = np.array(
        [_core.inequality_values(robot, q, _core.ConstraintSet.CORRECTED) for q in recording.shapes]
    )
    assert np.all(moments < 0)
    assert np.all(values[:, 4:7] > 0)  # 15g-i with the sign of 15i repaired
    assert np.mean(np.all(values[:, :4] > 0, axis=1)) < 0.96  # 15d,e


def test_cold_solver_fits_every_sample_of_a_recording(
    recording: Recording, robot: _core.Prism
) -> None:
    solver = _core.ShapeSolver(robot)
    for lengths in recording.lengths[::20]:
        solver.reset()
        assert solver.solve(lengths) is _core.Status.OK
        assert solver.cost < 9 * (3 * CABLE_STD) ** 2


def track(recording: Recording, robot: _core.Prism, **options: float) -> tuple[Array, Array]:
    """Endcap error [m] and its normalised square at every sample after the first."""
    tracker = _core.ShapeTracker(robot, **options)
    assert tracker.reset(recording.lengths[0]) is _core.Status.OK
    errors, normalised = [], []
    for lengths, truth in zip(recording.lengths[1:], recording.shapes[1:], strict=True):
        tracker.predict(0.01)
        assert tracker.correct(lengths, CABLE_STD) is _core.Status.OK
        error = (tracker.endcaps - truth).ravel()
        errors.append(np.sqrt(error @ error / 6))
        values, vectors = np.linalg.eigh(tracker.covariance)
        # Nine directions are certain: base rod, rod lengths, spin.
        normalised.append(np.sum((vectors[:, 9:].T @ error) ** 2 / values[9:]) / 9)
    return np.array(errors), np.array(normalised)


def test_tracker_on_a_recording(recording: Recording, robot: _core.Prism) -> None:
    error, normalised = track(recording, robot)
    assert np.sqrt(np.mean(error**2)) < 0.025  # m
    # Where the true shape is on the tracker's side of the fold; elsewhere nothing in nine lengths
    # tells the two apart.
    same_side = np.array([_core.fold(robot, q) > 0 for q in recording.shapes[1:]])
    assert np.sqrt(np.mean(error[same_side] ** 2)) < 0.012
    assert 0.5 < np.median(normalised) < 1.3


def test_the_fold_prior_earns_its_keep(recording: Recording, robot: _core.Prism) -> None:
    rng = np.random.default_rng(4)
    noisy = np.array([lengths_of(q) for q in recording.shapes])
    recording.lengths = noisy + rng.normal(0, CABLE_STD, noisy.shape)
    with_prior, _ = track(recording, robot)
    without, _ = track(recording, robot, fold_std=0.0)
    assert np.sqrt(np.mean(with_prior**2)) < 0.7 * np.sqrt(np.mean(without**2))
