"""Your robot and your sensors: YAML files that state only what differs, checked when read."""

from pathlib import Path

import tensegrity
from tensegrity import FilterConfig, InputError, robots

# A longer robot with smaller feet. Everything else is that of the packaged prism.
Path("robot.yaml").write_text(
    """\
base: prism3
name: long-prism
rod_length: 1.6        # m
endcap_radius: 0.030   # m
"""
)
robot = robots.load("robot.yaml")
print(f"{robot.name}: rods of {robot.rod_length} m, {len(robot.cables)} cables")

# An IMU that gives instantaneous values, ground that slopes, cable lengths with 5 mm of noise.
Path("filter.yaml").write_text(
    """\
base: full
settings:
  imu_sampling: instantaneous
  terrain: slope
noises:
  cable_std: 0.005       # m
"""
)
config = FilterConfig.load("filter.yaml")
print(f"cables {config.noises.cable_std} m, gyro {config.noises.gyroscope_std} rad/s")

estimator = tensegrity.PrismEstimator(robot, config)

# A mistake is reported with file, line, key and what to do.
Path("wrong.yaml").write_text("noises:\n  cable_sdt: 0.005\n")
try:
    FilterConfig.load("wrong.yaml")
except InputError as error:
    print(error)

# Every value in effect, with its description and unit. Saved, this is a file of its own.
print(config.to_yaml())
