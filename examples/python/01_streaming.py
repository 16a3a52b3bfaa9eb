"""The estimator on board: feed sensors as they come, read the state when you need it.

Here the sensors are those of a robot that stands still on one face.
"""

import numpy as np

import tensegrity

robot = tensegrity.robots.load("prism3")  # the 3-bar prism of T, or a path to your YAML
estimator = tensegrity.PrismEstimator(robot, config="full")

endcaps = robot.undeformed_endcaps()
lengths = np.array(
    [np.linalg.norm(endcaps[i] - endcaps[j]) for i, j in tensegrity.robots.PRISM_CABLES]
)

# Standing on endcaps 0, 3 and 5, gravity pulls along the normal of their plane.
normal = np.cross(endcaps[3] - endcaps[0], endcaps[5] - endcaps[0])
normal /= np.linalg.norm(normal)
up = normal if normal @ (endcaps[2] - endcaps[0]) > 0 else -normal

for k in range(601):  # 3 s at 200 Hz
    t = k * 5_000_000  # ns
    estimator.contacts(t, [True, False, False, True, False, True])
    if k % 2 == 0:
        estimator.cables(t, lengths)  # m
    estimator.imu(t, np.zeros(3), 9.81 * up)  # rad/s, m/s^2

state = estimator.state
print(f"started: {'yes' if state.initialized else 'no'}")
height, moved = state.position[2], np.linalg.norm(state.position[:2])
print(f"IMU {height:.3f} m above the ground, moved {moved:.4f} m")
for i, (x, y, z) in enumerate(state.endcaps_world):
    ground = "  on the ground" if state.contacts[i] else ""
    print(f"endcap {i}: {x:6.3f} {y:6.3f} {z:6.3f} m{ground}")
