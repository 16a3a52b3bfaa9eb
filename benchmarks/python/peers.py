"""This package and what else can be installed from Python, on the same problem in the same run.

    python benchmarks/python/peers.py ../shared/data/prism3/right

- one IMU sample and one correction with 1, 3 and 6 contacts: GTSAM's LeggedInvariantEKF. Its biases
  are fixed and it has no spin: 9 + 3 N errors, 16 + 3 N here
- nine cable lengths to a shape: SciPy's `least_squares` and CasADi with Ipopt, from the last
  solution. CasADi brings its own Ipopt; Debian's is the one of `tensegrity.IpoptSolver`
- an update of an unscented filter with a process in NumPy: FilterPy
- an orientation from an IMU sample: `ahrs`
"""

from __future__ import annotations

import argparse
import contextlib
import io
import re
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import ahrs
import casadi
import gtsam
import numpy as np
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter
from numpy.typing import NDArray
from scipy.optimize import least_squares
from timing import Case, Repetitions, hand_over, measure

from tensegrity import _core
from tensegrity.ahrs import Madgwick
from tensegrity.estimation import core_robot
from tensegrity.sequence import Sequence, read
from tensegrity.ukf import UnscentedFilter

Array = NDArray[np.float64]

CONTACTS = (1, 3, 6)
FEET = (1, 3, 5, 0, 2, 4)
"""Endcaps in the order in which they are put on the ground."""
DT, GRAVITY = 0.005, 9.81
GYRO_STD, ACCEL_STD, CONTACT_STD, FOOT_WALK, SPIN_WALK = 0.002, 0.043, 0.05, 0.05, 0.1
SHAPES = 40
"""Consecutive samples of a rolling robot; a repeat goes through all of them."""
CABLES = ((0, 4), (0, 2), (2, 4), (1, 5), (1, 3), (3, 5), (1, 4), (0, 3), (2, 5))


# --- contact-aided invariant filter -------------------------------------------------------------


def filters() -> dict[str, Repetitions]:
    """A robot that stands still, called as each package is meant to be called from Python.

    Corrections without a sample in between would wear out the covariance: what is timed is both,
    and the correction is the difference.
    """
    gyro, accel = np.zeros(3), np.array([0.0, 0.0, GRAVITY])
    endcaps = np.ascontiguousarray(_core.Prism().undeformed())
    cases = []
    for contacts in CONTACTS:
        feet = FEET[:contacts]
        theirs = legged_filter(feet, endcaps)
        measurements = [contact(k, endcaps[foot]) for k, foot in enumerate(feet)]
        motion = {"gyro": gyro, "accel": accel, "dt": DT}
        ours = {
            "filter": standing_filter(feet, endcaps),
            "noise": _core.FilterNoise(
                gyro_std=GYRO_STD, accel_std=ACCEL_STD, anchor_walk=FOOT_WALK, spin_walk=SPIN_WALK
            ),
            "h": endcaps,
            "covariance": CONTACT_STD**2 * np.eye(18),
        }
        for package, predict, correct, names in (
            (
                "tensegrity",
                "filter.propagate(gyro, accel, dt, noise)",
                "filter.correct_contacts(h, covariance)",
                ours,
            ),
            (
                "gtsam",
                "filter.predict(gyro, accel, dt)",
                "filter.processContacts(measurements)",
                {"filter": theirs, "measurements": measurements},
            ),
        ):
            both = f"{predict}; {correct}"
            cases.append(Case(f"both/{contacts}/{package}", both, motion | names))
            cases.append(
                Case(f"peers/propagate/{contacts}/{package}", predict, motion | names, setup=both)
            )
    measured = measure(cases)
    for name in [name for name in measured if name.startswith("both/")]:
        case = name.removeprefix("both/")
        pairs = zip(measured.pop(name), measured[f"peers/propagate/{case}"], strict=True)
        measured[f"peers/correct/{case}"] = [
            (both - propagate, max(gauge, its_gauge))
            for (both, gauge), (propagate, its_gauge) in pairs
        ]
    return measured


def standing_filter(feet: tuple[int, ...], endcaps: Array) -> _core.InvariantFilter:
    filter_ = _core.InvariantFilter()
    filter_.covariance = 1e-4 * np.eye(16)
    for foot in feet:
        filter_.augment(foot, endcaps[foot], CONTACT_STD**2 * np.eye(3))
    return filter_


def legged_filter(feet: tuple[int, ...], endcaps: Array) -> gtsam.LeggedInvariantEKF:
    parameters = gtsam.LeggedEstimatorParams()
    imu = gtsam.PreintegrationCombinedParams.MakeSharedU(GRAVITY)
    imu.setGyroscopeCovariance(GYRO_STD**2 * DT * np.eye(3))
    imu.setAccelerometerCovariance(ACCEL_STD**2 * DT * np.eye(3))
    parameters.preintegrationParams = imu
    parameters.contactCovariance = CONTACT_STD**2 * np.eye(3)
    parameters.footholdProcessSigma = FOOT_WALK
    # Else the first contacts are not a correction but the solution of a factor graph.
    parameters.useFullContactInitialization = False
    state = gtsam.NavState(gtsam.Rot3(), np.zeros(3), np.zeros(3))
    size = 9 + 3 * len(feet)
    footholds = np.asfortranarray(endcaps[list(feet)].T)
    names = [f"endcap {foot}" for foot in feet]
    return gtsam.LeggedInvariantEKF(state, footholds, 1e-4 * np.eye(size), parameters, names)


def contact(foot: int, point: Array) -> gtsam.ContactMeasurement:
    measurement = gtsam.ContactMeasurement()
    measurement.foot = foot
    measurement.bodyPoint = point
    measurement.touchdown = False
    return measurement


# --- shape --------------------------------------------------------------------------------------


def shapes(sequence: Sequence) -> list[Case]:
    """Consecutive lengths of the rolling robot, each from the last solution."""
    robot = core_robot(sequence.robot)
    middle = len(sequence.cables.lengths) // 2
    lengths = list(sequence.cables.lengths[middle : middle + SHAPES])
    solver = _core.ShapeSolver(robot)
    solver.solve(lengths[0])
    start = solver.endcaps[2:].ravel()
    solvers: dict[str, Callable[[Array], object]] = {
        "tensegrity": solver.solve,
        "scipy": ScipyShape(robot, start).solve,
        "casadi": CasadiShape(robot, start).solve,
    }
    if hasattr(_core, "IpoptShapeSolver"):
        reference = _core.IpoptShapeSolver(robot)
        reference.solve(lengths[0])
        solvers["tensegrity_ipopt"] = reference.solve
    return [
        Case(
            f"peers/shape/{sequence.name}/{name}",
            "for sample in lengths: solve(sample)",
            {"solve": solve, "lengths": lengths},
            calls=SHAPES,
        )
        for name, solve in solvers.items()
    ]


class ScipyShape:
    """T eq. 15a over endcaps 2 to 5, with the rods as two stiff residuals."""

    STIFFNESS = 1e3

    def __init__(self, robot: _core.Prism, start: Array) -> None:
        self._base = robot.undeformed()[:2]
        self._rod_length = robot.rod_length
        self._from, self._to = np.array(CABLES).T
        self._x = start

    def solve(self, lengths: Array) -> None:
        self._x = least_squares(self._residuals, self._x, args=(lengths,)).x

    def _residuals(self, x: Array, lengths: Array) -> Array:
        q = np.vstack([self._base, x.reshape(4, 3)])
        rods = np.linalg.norm(q[[2, 4]] - q[[3, 5]], axis=1) - self._rod_length
        cables = np.linalg.norm(q[self._from] - q[self._to], axis=1) - lengths
        return np.concatenate([cables, self.STIFFNESS * rods])


class CasadiShape:
    """T eq. 15 over endcaps 2 to 5 with the mutual moments as constraints, written symbolically and
    built once; the lengths are parameters."""

    def __init__(self, robot: _core.Prism, start: Array) -> None:
        x, lengths = casadi.SX.sym("x", 12), casadi.SX.sym("lengths", 9)
        fixed = robot.undeformed()
        q = [casadi.SX(fixed[0]), casadi.SX(fixed[1]), *(x[3 * i : 3 * i + 3] for i in range(4))]
        c = [(q[2 * k] + q[2 * k + 1]) / 2 for k in range(3)]
        u = [q[2 * k] - q[2 * k + 1] for k in range(3)]
        cost = sum(
            (casadi.norm_2(q[i] - q[j]) - lengths[k]) ** 2 for k, (i, j) in enumerate(CABLES)
        )
        rods = [casadi.sumsqr(u[k]) - robot.rod_length**2 for k in (1, 2)]
        moments = [
            -casadi.dot(c[j] - c[i], casadi.cross(u[i], u[j])) for i, j in ((0, 1), (1, 2), (2, 0))
        ]
        problem = {"x": x, "p": lengths, "f": cost, "g": casadi.vertcat(*rods, *moments)}
        options = {
            "ipopt.print_level": 0,
            "ipopt.sb": "yes",
            "print_time": 0,
            "ipopt.tol": 1e-9,
            "ipopt.warm_start_init_point": "yes",
        }
        self._solver = casadi.nlpsol("shape", "ipopt", problem, options)
        self._upper = [0, 0] + [casadi.inf] * len(moments)
        self._x = start

    def solve(self, lengths: Array) -> None:
        self._x = self._solver(x0=self._x, p=lengths, lbg=0, ubg=self._upper)["x"]


# --- unscented filter ---------------------------------------------------------------------------


def turn(points: Array) -> Array:
    """Position, velocity and turn rate over 0.1 s, a row a point."""
    x, y, vx, vy, rate = points.T
    c, s = np.cos(0.1 * rate), np.sin(0.1 * rate)
    return np.column_stack([x + 0.1 * vx, y + 0.1 * vy, c * vx - s * vy, s * vx + c * vy, rate])


def beacons(points: Array) -> Array:
    """Ranges to two points and a bearing."""
    x, y = points[:, 0], points[:, 1]
    return np.column_stack([np.hypot(x + 3, y), np.hypot(x, y - 4), np.arctan2(y + 5, x + 6)])


def unscented() -> list[Case]:
    """Five states and three rows, process and measurement the same functions in NumPy; FilterPy
    calls them point by point, this package once for all points."""
    mean, covariance = np.array([0.5, -0.2, 0.4, 0.3, 0.5]), 0.01 * np.eye(5)
    noise, variances = 1e-4 * np.eye(5), np.array([0.01, 0.02, 0.001])
    z = beacons(mean[None, :])[0]
    ours = UnscentedFilter(5, 3)
    ours.set(mean, covariance)
    theirs = UnscentedKalmanFilter(
        dim_x=5,
        dim_z=3,
        dt=0.1,
        fx=lambda x, dt: turn(x[None, :])[0],
        hx=lambda x: beacons(x[None, :])[0],
        points=MerweScaledSigmaPoints(5, alpha=1.0, beta=2.0, kappa=0.0),
    )
    theirs.x, theirs.P, theirs.Q, theirs.R = mean, covariance, noise, np.diag(variances)
    shared = {"turn": turn, "beacons": beacons, "noise": noise, "z": z, "variances": variances}
    return [
        Case(
            "peers/unscented/tensegrity",
            "ours.predict(turn, noise); ours.correct(beacons, z, variances)",
            shared | {"ours": ours},
        ),
        Case(
            "peers/unscented/filterpy",
            "theirs.predict(); theirs.update(z)",
            {"theirs": theirs, "z": z},
        ),
    ]


# --- orientation --------------------------------------------------------------------------------


def orientation() -> list[Case]:
    """One IMU sample."""
    gyro, accel = np.array([0.1, -0.2, 0.3]), np.array([0.5, 0.2, 9.7])
    ours = Madgwick()
    ours.start(accel)
    return [
        Case(
            "peers/orientation/tensegrity",
            "update(gyro, accel, dt)",
            {"update": ours.update, "gyro": gyro, "accel": accel, "dt": DT},
        ),
        Case(
            "peers/orientation/ahrs",
            "q = theirs.updateIMU(start, gyro, accel, dt)",
            {
                "theirs": ahrs.filters.Madgwick(),
                "start": ours.orientation,
                "gyro": gyro,
                "accel": accel,
                "dt": DT,
            },
        ),
    ]


def ipopt_of_casadi() -> str:
    """Its version, which only Ipopt's own output tells."""
    x, output = casadi.SX.sym("x"), io.StringIO()
    with contextlib.redirect_stdout(output):
        casadi.nlpsol("any", "ipopt", {"x": x, "f": x**2}, {"print_time": 0})(x0=1)
    found = re.search(r"Ipopt version ([\d.]*\d)", output.getvalue())
    return found[1] if found else "unknown"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", type=Path)
    arguments = parser.parse_args()
    measured = filters()
    for cases in (shapes(read(arguments.recording)), unscented(), orientation()):
        measured |= measure(cases)
    packages = ("gtsam", "casadi", "scipy", "filterpy", "ahrs", "numpy")
    versions = {name: version(name) for name in packages}
    hand_over(measured, versions | {"Ipopt of casadi": ipopt_of_casadi()})


if __name__ == "__main__":
    main()
