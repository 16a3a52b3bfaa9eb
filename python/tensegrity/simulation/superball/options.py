"""What a simulated recording of a ranging robot should look like."""

from __future__ import annotations

from tensegrity.simulation.options import Options
from tensegrity.yaml_model import field


class SuperballOptions(Options):
    """Motion, ground and sensors of a simulated recording.

    Noise and offsets are of the size that DWM1000 modules show on recordings of the robot.
    """

    seed: int = field("the same seed gives identical recordings", default=0, ge=0)
    duration: float | None = field(
        "of the recording; none: 75 s rolling, 60 s local", unit="s", default=None, ge=2, le=3600
    )
    still_start: float = field("standing still at the start", unit="s", default=2.0, ge=0)
    friction: float | None = field(
        "coefficient of friction of the ground; none: the mean of the robot's static and kinetic "
        "one, varied by 10 % with the seed",
        default=None,
        gt=0,
        le=3,
    )
    cable_speed: float = field(
        "fastest change of a rest length while rolling", unit="m/s", default=0.15, gt=0, le=1
    )
    stroke: float = field(
        "how far a cable is shortened to roll", unit="m", default=0.45, gt=0, le=0.6
    )

    round_rate: float = field("rounds of ranging", unit="Hz", default=10.0, ge=1, le=15)
    range_noise: float = field(
        "standard deviation with line of sight", unit="m", default=0.03, ge=0
    )
    offset_mean: float = field("mean of the ranges' offsets", unit="m", default=3.9, ge=0)
    module_offset_std: float = field(
        "what each module adds to the offsets of its pairs", unit="m", default=0.05, ge=0
    )
    pair_offset_std: float = field(
        "what else distinguishes each pair's offset", unit="m", default=0.03, ge=0
    )
    obstacles: bool = field(
        "links are blocked at times: detours, rejected and lost packets", default=True
    )

    gyro_noise: float = field("standard deviation", unit="rad/s", default=0.005, ge=0)
    accel_noise: float = field("standard deviation", unit="m/s^2", default=0.05, ge=0)
    gyro_bias: float = field(
        "standard deviation of the constant bias", unit="rad/s", default=0.01, ge=0
    )
    accel_bias: float = field(
        "standard deviation of the constant bias", unit="m/s^2", default=0.05, ge=0
    )
    spurious_imu: float | None = field(
        "when one IMU delivers one sample of a saturated gyroscope; none: never",
        unit="s",
        default=None,
        ge=0,
    )
    encoder_noise: float = field(
        "standard deviation of measured rest lengths", unit="m", default=0.001, ge=0
    )
