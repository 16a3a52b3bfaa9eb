"""Shape alone: nine cable lengths to six endcaps in the body frame, and how certain they are."""

import numpy as np

from tensegrity import _core, robots
from tensegrity.estimation import core_robot

CABLE_STD = 0.002  # of the measured lengths [m]

robot = core_robot(robots.load("prism3"))
endcaps = robot.undeformed()  # (6, 3) [m]
lengths = _core.cable_lengths(endcaps)  # (9,) [m], in the order of PRISM_CABLES
lengths[0] -= 0.03  # one side cable shorter, another longer
lengths[4] += 0.05

# One sample: least squares.
solver = _core.ShapeSolver(robot)
status = solver.solve(lengths)
print(f"{status.name}: residuals of {1e3 * np.sqrt(solver.cost):.3f} mm")
sigma = np.sqrt(np.diag(solver.covariance(CABLE_STD))).reshape(6, 3)  # [m]
for i, (q, s) in enumerate(zip(solver.endcaps, sigma, strict=True)):
    print(
        f"endcap {i}: {q[0]:6.3f} {q[1]:6.3f} {q[2]:6.3f} m  +- {1e3 * np.linalg.norm(s):4.1f} mm"
    )

# A stream of samples: a Kalman filter on the shape. Between samples it may move by 1 mm.
tracker = _core.ShapeTracker(robot)
tracker.reset(lengths, CABLE_STD)
noise = np.random.default_rng(0)
for _ in range(100):
    tracker.predict(0.001)
    tracker.correct(lengths + CABLE_STD * noise.standard_normal(9), CABLE_STD)
error = np.linalg.norm(tracker.endcaps - solver.endcaps, axis=1)  # [m]
print(f"tracked: {1e3 * np.sqrt(np.mean(error**2)):.1f} mm from the noiseless shape")
