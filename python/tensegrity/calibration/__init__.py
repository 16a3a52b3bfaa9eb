"""What a robot's own sensors say about how they are mounted: :func:`calibrate_robot`."""

from tensegrity.calibration.robot import RobotCalibration, calibrate_robot

__all__ = ["RobotCalibration", "calibrate_robot"]
