"""What a simulated recording should look like."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from tensegrity.errors import InputError, did_you_mean
from tensegrity.yaml_model import StrictModel, field, inconsistent, unit_of
from tensegrity.yaml_model.model import INCONSISTENT

ImuSampling = Literal["interval_mean", "instantaneous"]


class Options(StrictModel):
    """Options given as keywords. Unknown or impossible values raise :class:`InputError` with field,
    range and unit."""

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise _input_error(type(self), error) from None


class SimulationOptions(Options):
    """World, robot variants, motion and sensors of a simulated recording.

    The defaults are T's simulation: flat ground and the noise of T Table I.
    """

    seed: int = field("the same seed gives identical recordings", default=0, ge=0)
    randomize: bool = field(
        "draw initial yaw, IMU mounting, friction and speed (10 %), gait gain (5 %) from the seed",
        default=True,
    )

    path_length: float | None = field(
        "horizontal path of the centre of mass; none: that of the manoeuvre",
        unit="m",
        default=None,
        gt=0,
    )
    cable_speed: float = field(
        "fastest change of a cable's rest length: the speed of the gait",
        unit="m/s",
        default=0.13,
        gt=0,
        le=1,
    )
    still_start: float = field("standing still at the start", unit="s", default=4.0, ge=0)
    still_end: float = field("standing still at the end", unit="s", default=3.0, ge=0)

    friction: float = field("friction coefficient of the ground", default=0.9, gt=0, le=3)
    slope: float = field("inclination of the ground", unit="deg", default=0.0, ge=0, le=20)
    slope_direction: float = field(
        "direction in which the ground rises, from the world's x axis", unit="deg", default=0.0
    )
    floor_time_constant: float = field(
        "MuJoCo's contact time constant: smaller is stiffer", unit="s", default=0.02, ge=0.002, le=1
    )

    mirrored: bool = field("simulate the mirror image of the robot", default=False)
    endcap_radius: float | None = field(
        "none: that of the robot", unit="m", default=None, gt=0, le=0.2
    )
    cable_attachment_offset: float | None = field(
        "from the rod's axis; none: that of the robot", unit="m", default=None, ge=0, le=0.2
    )

    imu_sampling: ImuSampling = field(
        "what an IMU sample is: the mean since the previous one, or the value at its stamp",
        default="interval_mean",
    )
    rod_imus: bool = field("record IMUs on the other rods too", default=False)
    imu_misalignment: Annotated[tuple[float, float], Field(strict=False)] = field(
        "turns about the body's x and y that take the body frame to the base IMU's, beside those "
        "the robot states",
        unit="rad",
        default=(0.0, 0.0),
    )
    gyro_noise: float = field("standard deviation", unit="rad/s", default=0.002, ge=0)
    accel_noise: float = field("standard deviation", unit="m/s^2", default=0.043, ge=0)
    gyro_bias_walk: float = field(
        "standard deviation of the random walk after 1 s", unit="rad/s", default=0.001, ge=0
    )
    accel_bias_walk: float = field(
        "standard deviation of the random walk after 1 s", unit="m/s^2", default=0.001, ge=0
    )
    cable_noise: float = field("standard deviation", unit="m", default=0.002, ge=0)
    cable_offsets: Annotated[tuple[float, ...], Field(strict=False)] | None = field(
        "constant errors, one per cable, beside those the robot states; none: no errors",
        unit="m",
        default=None,
    )
    cable_offset_std: float = field(
        "standard deviation of further constant errors, drawn from the seed",
        unit="m",
        default=0.0,
        ge=0,
    )
    contact_false_rate: float = field(
        "share of samples in the air reported", default=0.0, ge=0, le=1
    )
    contact_missing_rate: float = field(
        "share of samples on the ground reported as free", default=0.0, ge=0, le=1
    )

    imu_gap: float | None = field(
        "length of the gaps in which the base IMU delivers no samples; none: no gaps",
        unit="s",
        default=None,
        gt=0,
    )
    imu_gap_period: float = field(
        "from the start of the motion to the first gap and from gap to gap",
        unit="s",
        default=10.0,
        gt=0,
    )
    lost_cable: str | None = field(
        "cable that is not measured, by its column in cables.csv (l_0_4); none: all are measured",
        default=None,
    )
    lost_cable_from: float = field(
        "when it is lost, from the start of the motion; negative: still standing",
        unit="s",
        default=0.0,
    )
    lost_cable_duration: float | None = field(
        "how long it is lost; none: for good", unit="s", default=None, gt=0
    )

    @model_validator(mode="after")
    def _gaps_have_samples_between_them(self) -> SimulationOptions:
        if self.imu_gap is not None and self.imu_gap >= self.imu_gap_period:
            raise inconsistent(
                f"gaps of {self.imu_gap:g} s every {self.imu_gap_period:g} s leave no samples",
                "imu_gap",
                "imu_gap_period",
            )
        return self


def _input_error(options: type[Options], error: ValidationError) -> InputError:
    """The first problem, in the words of the field."""
    detail = error.errors()[0]
    if detail["type"] == INCONSISTENT:
        first, *others = detail["ctx"]["fields"]
        return InputError(detail["msg"], field=first, hint=f"change it or {', '.join(others)}")
    name = str(detail["loc"][0])
    info = options.model_fields.get(name)
    if info is None:
        hint = did_you_mean(name, options.model_fields)
        return InputError("unknown simulation option", field=name, hint=hint)
    unit = unit_of(info)
    expected = detail["msg"][0].lower() + detail["msg"][1:] + (f" [{unit}]" if unit else "")
    return InputError(f"{expected}, got {detail['input']!r}", field=name, hint=info.description)
