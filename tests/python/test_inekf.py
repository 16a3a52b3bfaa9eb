"""The C++ filter against a dense one, written from the equations alone.

The dense filter (T eqs. 4-14, biases as Hartley et al. 2020) never uses the block structure or the
closed forms of the C++ code: means and transitions are matrix exponentials, groups are matrices.
The noise of a sample is an error of its mean, a bias of that step alone; walks are added after it.

Over one sample the inputs are constant in the body frame, so the *left*-invariant error has a
constant system matrix and scipy.linalg.expm is exact. The right-invariant error follows by the
adjoint at either end of the step.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation

from tensegrity import _core

# Blocks of the error; contact points follow.
GYRO_BIAS, ACCEL_BIAS = slice(0, 3), slice(3, 6)
ROTATION, VELOCITY, POSITION = slice(6, 9), slice(9, 12), slice(12, 15)
SPIN = 15
BIASES, BODY = slice(0, 6), slice(6, 15)

GRAVITY = np.array([0.0, 0.0, -9.81])
NOISE = {
    "gyro_std": 0.002,
    "accel_std": 0.043,
    "gyro_bias_walk": 0.001,
    "accel_bias_walk": 0.001,
    "anchor_walk": 0.05,
    "spin_walk": 0.02,
}


def hat(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def algebra(xi):
    """The matrix of a tangent of SE_k(3), ordered (rotation, columns...)."""
    k = len(xi) // 3 - 1
    m = np.zeros((3 + k, 3 + k))
    m[:3, :3] = hat(xi[:3])
    m[:3, 3:] = xi[3:].reshape(k, 3).T
    return m


class DenseFilter:
    """X as a matrix, theta = (b_g, b_a, phi); error (zeta_bg, zeta_ba, xi_R, xi_v, xi_p, zeta_phi,
    xi_d...)."""

    def __init__(self, rotation, velocity, position, gyro_bias, accel_bias, spin, covariance):
        self.x = np.eye(5)
        self.x[:3, :3] = rotation
        self.x[:3, 3] = velocity
        self.x[:3, 4] = position
        self.bg, self.ba, self.spin = gyro_bias.copy(), accel_bias.copy(), spin
        self.p = covariance.copy()
        self.ids: list[int] = []

    @property
    def rotation(self):
        return self.x[:3, :3]

    def group_rows(self):
        """Rows of the error that belong to the group, in the order of X's columns."""
        return list(range(6, 15)) + list(range(16, 16 + 3 * len(self.ids)))

    def adjoint(self):
        """Ad_X on the group part, identity on theta."""
        n = len(self.p)
        ad = np.eye(n)
        rows = self.group_rows()
        columns = self.x.shape[0] - 3
        g = np.zeros((3 + 3 * columns, 3 + 3 * columns))
        g[:3, :3] = self.rotation
        for k in range(columns):
            s = slice(3 + 3 * k, 6 + 3 * k)
            g[s, s] = self.rotation
            g[s, :3] = hat(self.x[:3, 3 + k]) @ self.rotation
        ad[np.ix_(rows, rows)] = g
        return ad

    def propagate(self, gyro, accel, dt):
        w, a = gyro - self.bg, accel - self.ba
        n, contacts = len(self.p), len(self.ids)
        # Left-invariant error dynamics (Hartley et al. 2020, eq. 70).
        system = np.zeros((n, n))
        for block in (ROTATION, VELOCITY, POSITION):
            system[block, block] = -hat(w)
        system[VELOCITY, ROTATION] = -hat(a)
        system[POSITION, VELOCITY] = np.eye(3)
        system[ROTATION, GYRO_BIAS] = system[VELOCITY, ACCEL_BIAS] = -np.eye(3)
        walk = np.zeros(n)
        walk[GYRO_BIAS] = NOISE["gyro_bias_walk"]
        walk[ACCEL_BIAS] = NOISE["accel_bias_walk"]
        walk[SPIN] = NOISE["spin_walk"]
        for i in range(contacts):
            s = slice(16 + 3 * i, 19 + 3 * i)
            system[s, s] = -hat(w)
            walk[s] = NOISE["anchor_walk"]
        phi = expm(system * dt)
        by_sample = phi[:, BIASES].copy()
        by_sample[BIASES] = 0
        variance = np.repeat([NOISE["gyro_std"] ** 2, NOISE["accel_std"] ** 2], 3)
        noise = by_sample @ np.diag(variance) @ by_sample.T + np.diag(walk**2 * dt)

        left = np.linalg.inv(self.adjoint())
        p_left = phi @ (left @ self.p @ left.T) @ phi.T + noise

        motion = np.zeros((5, 5))  # d/dt (R, v, p) in the falling frame
        motion[:3, :3] = hat(w)
        motion[:3, 3] = a
        motion[3, 4] = 1
        step = expm(motion * dt)
        r, v, p = self.rotation.copy(), self.x[:3, 3].copy(), self.x[:3, 4].copy()
        self.x[:3, :3] = r @ step[:3, :3]
        self.x[:3, 3] = v + r @ step[:3, 3] + GRAVITY * dt
        self.x[:3, 4] = p + v * dt + r @ step[:3, 4] + GRAVITY * dt**2 / 2
        ad = self.adjoint()
        self.p = ad @ p_left @ ad.T

    def augment(self, endcap, h, h_covariance):
        n = len(self.p)
        f = np.vstack([np.eye(n), np.zeros((3, n))])
        f[n:, POSITION] = np.eye(3)
        f[n:, SPIN] = self.rotation @ np.cross([0, 0, 1], h)
        g = np.zeros((n + 3, 3))
        g[n:] = self.rotation
        self.p = f @ self.p @ f.T + g @ h_covariance @ g.T
        size = self.x.shape[0]
        x = np.eye(size + 1)
        x[:size, :size] = self.x
        x[:3, size] = self.x[:3, 4] + self.rotation @ h
        self.x = x
        self.ids.append(endcap)

    def marginalise(self, endcap):
        k = self.ids.index(endcap)
        keep = [i for i in range(len(self.p)) if not 16 + 3 * k <= i < 19 + 3 * k]
        m = np.eye(len(self.p))[keep]
        self.p = m @ self.p @ m.T
        self.x = np.delete(np.delete(self.x, 5 + k, 0), 5 + k, 1)
        self.ids.pop(k)

    def correct(self, h, covariance):
        n, contacts = len(self.p), len(self.ids)
        jacobian = np.zeros((3 * contacts, n))
        residual = np.zeros(3 * contacts)
        noise = np.zeros((3 * contacts, 3 * contacts))
        for k, i in enumerate(self.ids):
            s = slice(3 * k, 3 * k + 3)
            jacobian[s, POSITION] = np.eye(3)
            jacobian[s, SPIN] = self.rotation @ np.cross([0, 0, 1], h[i])
            jacobian[s, 16 + 3 * k : 19 + 3 * k] = -np.eye(3)
            residual[s] = self.rotation @ h[i] + self.x[:3, 4] - self.x[:3, 5 + k]
            for m, j in enumerate(self.ids):
                noise[s, 3 * m : 3 * m + 3] = (
                    self.rotation
                    @ covariance[3 * i : 3 * i + 3, 3 * j : 3 * j + 3]
                    @ self.rotation.T
                )
        innovation = jacobian @ self.p @ jacobian.T + noise
        gain = self.p @ jacobian.T @ np.linalg.inv(innovation)
        error = gain @ residual
        a = np.eye(n) - gain @ jacobian
        self.p = a @ self.p @ a.T + gain @ noise @ gain.T
        self.x = expm(algebra(-error[self.group_rows()])) @ self.x
        self.bg = self.bg - error[GYRO_BIAS]
        self.ba = self.ba - error[ACCEL_BIAS]
        self.spin = self.spin - error[SPIN]


def random_covariance(rng, n, scale):
    a = rng.normal(size=(n, n)) * scale[:, None]
    return a @ a.T / n


def random_start(rng):
    scale = np.full(16, 0.02)
    scale[ROTATION], scale[VELOCITY], scale[POSITION] = 0.1, 0.2, 0.1
    return {
        "rotation": Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix(),
        "velocity": rng.normal(size=3),
        "position": rng.normal(size=3),
        "gyro_bias": rng.normal(size=3) * 0.01,
        "accel_bias": rng.normal(size=3) * 0.05,
        "spin": rng.normal() * 0.3,
        "covariance": random_covariance(rng, 16, scale),
    }


def make_filter(start):
    f = _core.InvariantFilter()
    for name, value in start.items():
        setattr(f, name, value)
    return f


def difference(fast, dense):
    """The largest difference of any number of the two filters."""
    pairs = [
        (fast.rotation, dense.rotation),
        (fast.velocity, dense.x[:3, 3]),
        (fast.position, dense.x[:3, 4]),
        (fast.gyro_bias, dense.bg),
        (fast.accel_bias, dense.ba),
        (fast.spin, dense.spin),
        (fast.anchors, dense.x[:3, 5:].T),
        (fast.covariance, dense.p),
    ]
    return max(float(np.abs(np.asarray(a) - b).max(initial=0)) for a, b in pairs)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_equals_a_dense_filter_over_1000_random_steps(seed):
    """Contacts come and go; IMU as violent as in a fall (16 rad/s, 100 m/s^2 peaks)."""
    rng = np.random.default_rng(seed)
    start = random_start(rng)
    fast, dense = make_filter(start), DenseFilter(**start)
    worst = 0.0
    for step in range(1000):
        violent = rng.random() < 0.05
        gyro = rng.normal(size=3) * (8 if violent else 1)
        accel = (
            dense.rotation.T @ -GRAVITY
            + 0.2 * dense.rotation.T @ -dense.x[:3, 3]  # keeps the random walk in bounds
            + rng.normal(size=3) * (50 if violent else 2)
        )
        fast.propagate(gyro, accel, 0.005, _core.FilterNoise(**NOISE))
        dense.propagate(gyro, accel, 0.005)
        h = rng.normal(size=(6, 3)) * 0.5
        for slot, endcap in enumerate(dense.ids):  # kinematics near what the filter expects
            h[endcap] = dense.rotation.T @ (dense.x[:3, 5 + slot] - dense.x[:3, 4])
            h[endcap] += rng.normal(size=3) * 0.01
        q_covariance = random_covariance(rng, 18, np.full(18, 0.02)) + np.eye(18) * 1e-5
        for endcap in range(6):
            if endcap in dense.ids and rng.random() < 0.03:
                fast.marginalise(endcap)
                dense.marginalise(endcap)
            elif endcap not in dense.ids and rng.random() < 0.03:
                block = q_covariance[3 * endcap : 3 * endcap + 3, 3 * endcap : 3 * endcap + 3]
                fast.augment(endcap, h[endcap], block)
                dense.augment(endcap, h[endcap], block)
        if step % 2 == 0 and dense.ids:
            status, _ = fast.correct_contacts(h, q_covariance)
            assert status == _core.Status.OK
            dense.correct(h, q_covariance)
        worst = max(worst, difference(fast, dense))
    assert worst < 1e-9


def relative_error(bar, other):
    """e with Xbar X^-1 = Exp(xi), thetabar - theta = zeta."""

    def matrix(f):
        m = np.eye(5 + len(f.anchors))
        m[:3, :3] = f.rotation
        m[:3, 3:] = np.vstack([f.velocity, f.position, f.anchors.reshape(-1, 3)]).T
        return m

    xi = np.real(logm(matrix(bar) @ np.linalg.inv(matrix(other))))
    columns = xi[:3, 3:].T.ravel()
    return np.concatenate(
        [
            bar.gyro_bias - other.gyro_bias,
            bar.accel_bias - other.accel_bias,
            [xi[2, 1], xi[0, 2], xi[1, 0]],
            columns[:6],
            [bar.spin - other.spin],
            columns[6:],
        ]
    )


def clone(f, ids):
    """A copy of a filter's mean and covariance."""
    c = _core.InvariantFilter()
    for name in ("rotation", "velocity", "position", "gyro_bias", "accel_bias", "spin"):
        setattr(c, name, getattr(f, name))
    for endcap, anchor in zip(ids, f.anchors, strict=True):
        c.augment(endcap, c.rotation.T @ (anchor - c.position), np.eye(3))
    c.covariance = f.covariance
    return c


def violent_filter(seed):
    rng = np.random.default_rng(seed)
    f = make_filter(random_start(rng))
    ids = [0, 3, 5]
    for endcap in ids:
        f.augment(endcap, rng.normal(size=3), np.eye(3) * 1e-4)
    return f, ids, rng


@pytest.mark.parametrize("radius", [0.0, 0.038])
@pytest.mark.parametrize("seed", range(5))
def test_transition_against_finite_differences(seed, radius):
    f, ids, rng = violent_filter(seed)
    gyro, accel = rng.normal(size=3) * 8, rng.normal(size=3) * 40
    silent = _core.FilterNoise(**dict.fromkeys(NOISE, 0.0))
    dim = len(f.covariance)
    for _ in range(4):
        u = rng.normal(size=dim)
        ends = []
        for sign in (1, -1):
            g = clone(f, ids)
            g.retract(-sign * 1e-5 * u)
            g.propagate(gyro, accel, 0.005, silent, rolling_radius=radius)
            ends.append(g)
        numeric = relative_error(ends[0], ends[1]) / 2e-5
        g = clone(f, ids)
        g.covariance = np.outer(u, u)
        g.propagate(gyro, accel, 0.005, silent, rolling_radius=radius)
        # Rolling neglects the change of the contact's lever arm within the step: O(r |w|^2 dt^2).
        tolerance = 1e-6 if radius == 0 else radius * (8 * 0.005) ** 2 * np.abs(u).max()
        np.testing.assert_allclose(
            g.covariance, np.outer(numeric, numeric), atol=tolerance * np.abs(numeric).max()
        )


@pytest.mark.parametrize("seed", range(5))
def test_contact_measurement_against_finite_differences(seed):
    """H of the update is the numerical derivative of z = R R_z(phi) q + p - d where z = 0.

    Elsewhere the derivative also has a term xi_R x z, which T eq. 12 drops: H does not depend on
    the state, and that is the point of the invariant error.
    """
    f, ids, rng = violent_filter(seed)
    q = rng.normal(size=(6, 3))
    spin = Rotation.from_rotvec([0, 0, f.spin])
    q[ids] = spin.inv().apply((f.anchors - f.position) @ f.rotation)

    def residual(g):
        h = Rotation.from_rotvec([0, 0, g.spin]).apply(q)
        world = h @ g.rotation.T + g.position
        return (world[ids] - g.anchors).ravel()

    dim = len(f.covariance)
    jacobian = np.zeros((9, dim))
    for i in range(dim):
        e = np.zeros(dim)
        e[i] = 1e-6
        plus, minus = clone(f, ids), clone(f, ids)
        plus.retract(-e)
        minus.retract(e)
        jacobian[:, i] = (residual(plus) - residual(minus)) / 2e-6

    # What the update does to P says what H was.
    s = jacobian @ f.covariance @ jacobian.T + np.eye(9)
    gain = np.linalg.solve(s, jacobian @ f.covariance)
    expected = f.covariance - f.covariance @ jacobian.T @ gain
    status, chi_square = f.correct_contacts(spin.apply(q), np.eye(18))
    assert status == _core.Status.OK
    assert chi_square < 1e-20
    np.testing.assert_allclose(f.covariance, expected, atol=1e-7)


def test_gate_rejects_and_changes_nothing():
    f, ids, _ = violent_filter(7)
    before = f.covariance
    h = np.zeros((6, 3))
    h[ids] = (f.anchors - f.position) @ f.rotation
    h[0, 0] += 10
    status, chi_square = f.correct_contacts(h, np.eye(18) * 1e-4, gate=27.9)
    assert status == _core.Status.REJECTED
    assert chi_square > 27.9
    np.testing.assert_array_equal(f.covariance, before)


def transform(start, yaw, shift):
    """The same start seen from a world that is turned about gravity and shifted."""
    turn = Rotation.from_rotvec([0, 0, yaw]).as_matrix()
    ad = np.eye(16)
    for block in (ROTATION, VELOCITY, POSITION):
        ad[block, block] = turn
    ad[POSITION, ROTATION] = hat(shift) @ turn
    moved = dict(start)
    moved["rotation"] = turn @ start["rotation"]
    moved["velocity"] = turn @ start["velocity"]
    moved["position"] = turn @ start["position"] + shift
    moved["covariance"] = ad @ start["covariance"] @ ad.T
    return moved, turn, ad


@pytest.mark.parametrize("radius", [0.0, 0.038])
def test_invariance_under_shift_and_turn_about_gravity(radius):
    """Same sensors, moved start: the same errors and covariance in the invariant frame."""
    rng = np.random.default_rng(11)
    start = random_start(rng)
    shift = np.array([3.0, -2.0, 0.7])
    moved, turn, ad = transform(start, 2.1, shift)
    a, b = make_filter(start), make_filter(moved)
    for step in range(400):
        gyro, accel = rng.normal(size=3), a.rotation.T @ -GRAVITY + rng.normal(size=3)
        for f in (a, b):
            f.propagate(gyro, accel, 0.005, _core.FilterNoise(**NOISE), rolling_radius=radius)
        h = rng.normal(size=(6, 3)) * 0.5
        for slot, endcap in enumerate(a.anchor_ids):
            h[endcap] = a.rotation.T @ (a.anchors[slot] - a.position) + rng.normal(size=3) * 0.01
        for f in (a, b):
            if step % 100 == 0:
                f.augment(step // 100, h[step // 100], np.eye(3) * 1e-4)
            if step % 2:
                f.correct_contacts(h, np.eye(18) * 1e-4)
    np.testing.assert_allclose(b.rotation, turn @ a.rotation, atol=1e-9)
    np.testing.assert_allclose(b.position, turn @ a.position + shift, atol=1e-9)
    np.testing.assert_allclose(b.velocity, turn @ a.velocity, atol=1e-9)
    np.testing.assert_allclose(b.gyro_bias, a.gyro_bias, atol=1e-9)
    np.testing.assert_allclose(b.accel_bias, a.accel_bias, atol=1e-9)
    full = np.eye(len(a.covariance))
    full[:16, :16] = ad
    for slot in range(len(a.anchor_ids)):
        at = 16 + 3 * slot
        full[at : at + 3, ROTATION] = hat(shift) @ turn
        full[at : at + 3, at : at + 3] = turn
    np.testing.assert_allclose(b.covariance, full @ a.covariance @ full.T, atol=1e-9)


def test_propagated_covariance_against_monte_carlo():
    """Samples of noise, pushed through the mean equations, scatter as P says."""
    rng = np.random.default_rng(5)
    start = random_start(rng)
    start["covariance"] = np.zeros((16, 16))
    steps, dt, runs = 40, 0.005, 3000
    gyro = rng.normal(size=(steps, 3)) * 2
    accel = rng.normal(size=(steps, 3)) * 5 + [0, 0, 9.81]
    noise = _core.FilterNoise(gyro_std=0.1, accel_std=1.0)
    reference = make_filter(start)
    for k in range(steps):
        reference.propagate(gyro[k], accel[k], dt, noise)
    errors = []
    for _ in range(runs):
        f = make_filter(start)
        for k in range(steps):
            f.propagate(
                gyro[k] + rng.normal(size=3) * 0.1, accel[k] + rng.normal(size=3), dt, noise
            )
        errors.append(relative_error(f, reference)[BODY])
    sampled = np.cov(np.array(errors).T)
    predicted = reference.covariance[BODY, BODY]
    # Whitened, the sampled covariance is the identity up to its own scatter sqrt(2 / runs).
    whiten = np.linalg.inv(np.linalg.cholesky(predicted))
    np.testing.assert_allclose(whiten @ sampled @ whiten.T, np.eye(9), atol=6 * np.sqrt(2 / runs))


def test_wrong_use_is_reported():
    f = _core.InvariantFilter()
    with pytest.raises(ValueError, match="dt"):
        f.propagate(np.zeros(3), np.zeros(3), 0.0, _core.FilterNoise(gyro_std=0.1, accel_std=0.1))
    with pytest.raises(ValueError, match="no contact point"):
        f.marginalise(3)
    with pytest.raises(ValueError, match="16 x 16"):
        f.covariance = np.eye(3)
    assert f.augment(2, np.ones(3), np.eye(3))
    assert not f.augment(2, np.ones(3), np.eye(3))
