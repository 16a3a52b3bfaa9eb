"""Configuration of the filter, in the three sections DRIFT uses: settings, priors, noises.

https://github.com/UMich-CURLY/drift. The values live in the packaged profiles ``configs/*.yaml``
alone; no field has a default here.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from tensegrity.packaged import PackagedModels
from tensegrity.yaml_model import StrictModel, dump, field, inconsistent

DEFAULT = "full"
"""The profile of files that name none."""

Vector3 = Annotated[tuple[float, float, float], Field(strict=False)]


class Settings(StrictModel):
    """Which models the filter uses, and its limits."""

    method: Literal["paper", "full"] = field("the estimator of T, or the best one")
    filter: Literal["loose", "tight"] = field(
        "loose: a shape from the cables corrects the pose (T); tight: one state for both"
    )
    shape: Literal["least_squares", "tracker"] = field(
        "filter: loose, endcaps from cables: anew at each sample (T eq. 15), or tracked over time"
    )
    spin: Literal["fixed", "estimated"] = field(
        "filter: loose, angle of the shape about the base rod, which no cable observes: constant, "
        "or a state"
    )
    contact_point: Literal["centre", "rolling"] = field(
        "filter: loose, endcaps touch as fixed points (T), or roll as spheres"
    )
    contact_noise: Literal["constant", "from_shape"] = field(
        "filter: loose, covariance of a contact's position: contact_position_std, or the shape's"
    )
    max_shape_iterations: int = field(
        "filter: loose, least squares stops after so many steps with the best shape so far",
        unit="steps",
        ge=1,
    )
    imu_sampling: Literal["interval_mean", "instantaneous"] = field(
        "a sample is the mean since the previous stamp, or the value at its stamp"
    )
    static_bias_initialization: bool = field(
        "start from the mean of the first still samples instead of priors alone"
    )
    init_bias_size: int = field("still samples that start the filter", unit="samples", ge=1)
    static_gyro_limit: float = field("still: deviation of the gyro below", unit="rad/s", gt=0)
    static_accel_limit: float = field(
        "still: deviation of the accelerometer below", unit="m/s^2", gt=0
    )
    max_imu_gap: float = field("longer gaps between IMU samples widen the state", unit="s", gt=0)
    max_latency: float = field("measurements older than this are dropped", unit="s", ge=0)
    chi_square_gate: float = field(
        "filter: loose, probability mass of contact innovations that are accepted, 0: all",
        ge=0,
        lt=1,
    )
    gravity: float = field("acceleration of gravity, downward", unit="m/s^2", gt=0)
    terrain: Literal["flat", "slope", "unknown"] = field(
        "filter: tight, the ground is level, one plane of unknown slope, or changes on the way"
    )
    friction: float = field(
        "filter: tight, coefficient of friction of the ground, matters on slopes alone", gt=0
    )
    contact_error: float = field(
        "filter: tight, share of contact flags that are wrong: flags are evidence, not truth",
        gt=0,
        lt=0.5,
    )
    cable_gate: float = field(
        "filter: tight, single lengths are left out beyond so many standard deviations, 0: never",
        ge=0,
    )

    @model_validator(mode="after")
    def _shape_has_a_covariance(self) -> Settings:
        if self.contact_noise == "from_shape" and self.shape != "tracker":
            raise inconsistent(
                "contact_noise: from_shape needs shape: tracker, least squares of one sample have "
                "no useful covariance at the fold",
                "contact_noise",
                "shape",
            )
        return self


class Priors(StrictModel):
    """State and standard deviations at the start."""

    orientation_std: float = field("orientation", unit="rad", ge=0)
    velocity_std: float = field("velocity", unit="m/s", ge=0)
    position_std: float = field("position", unit="m", ge=0)
    gyroscope_bias: Vector3 = field("gyroscope bias, IMU frame", unit="rad/s")
    gyroscope_bias_std: float = field("gyroscope bias", unit="rad/s", ge=0)
    accelerometer_bias: Vector3 = field("accelerometer bias, IMU frame", unit="m/s^2")
    accelerometer_bias_std: float = field("accelerometer bias", unit="m/s^2", ge=0)
    spin_std: float = field("spin", unit="rad", ge=0)
    cable_offset_std: float = field("constant error of a cable length", unit="m", ge=0)
    ground_slope_std: float = field("slope of the ground at the start", unit="rad", ge=0)


class Noises(StrictModel):
    """Standard deviations of measurements and of what drives the state."""

    gyroscope_std: float = field("gyroscope, one sample", unit="rad/s", gt=0)
    accelerometer_std: float = field("accelerometer, one sample", unit="m/s^2", gt=0)
    gyroscope_bias_std: float = field(
        "random walk of the gyroscope bias", unit="rad/s/sqrt(s)", ge=0
    )
    accelerometer_bias_std: float = field(
        "random walk of the accelerometer bias", unit="m/s^2/sqrt(s)", ge=0
    )
    cable_std: float = field("cable length, one sample", unit="m", gt=0)
    contact_std: float = field("random walk of a contact point", unit="m/sqrt(s)", ge=0)
    contact_position_std: float = field(
        "contact kinematics; contact_noise: from_shape adds the shape's covariance",
        unit="m",
        gt=0,
    )
    spin_std: float = field(
        "random walk of the spin, with spin: estimated", unit="rad/sqrt(s)", ge=0
    )
    shape_std_rest: float = field(
        "random walk of the shape at rest, with shape: tracker", unit="m/sqrt(s)", gt=0
    )
    shape_std_moving: float = field(
        "random walk of the shape in motion, with shape: tracker", unit="m/sqrt(s)", gt=0
    )
    endcap_acceleration_rest: float = field(
        "white acceleration of the other rods' endcaps at rest", unit="m/s/sqrt(s)", gt=0
    )
    endcap_acceleration_moving: float = field(
        "white acceleration of the other rods' endcaps at full activity",
        unit="m/s/sqrt(s)",
        gt=0,
    )
    active_force: float = field(
        "deviation of the specific force from gravity at full activity", unit="m/s^2", gt=0
    )
    active_rate: float = field("rate of the base rod at full activity", unit="rad/s", gt=0)
    creep_std: float = field("creep of a foot that stands still", unit="m/sqrt(s)", gt=0)
    slip_length: float = field(
        "path a fully loaded foot slips between two decisions of friction", unit="m", ge=0
    )
    slip_speed: float = field(
        "a foot that slips faster informs across its slip alone", unit="m/s", gt=0
    )
    foot_rise_std: float = field("motion of a foot across the ground", unit="m/sqrt(s)", gt=0)
    foot_height_std: float = field("height of a foot above the ground", unit="m*sqrt(s)", gt=0)
    rod_rate_std: float = field("other rods' IMUs: their turn across the rod", unit="rad/s", gt=0)
    rod_inclination_std: float = field(
        "other rods' IMUs: the rod's inclination in quiet, as a cosine", gt=0
    )
    ground_height_walk: float = field(
        "random walk of the ground's height in motion, with terrain: unknown",
        unit="m/sqrt(s)",
        ge=0,
    )
    ground_slope_walk: float = field(
        "random walk of the ground's slope in motion, with terrain: unknown",
        unit="1/sqrt(s)",
        ge=0,
    )


class FilterConfig(StrictModel):
    """Everything that can be set in the estimator."""

    settings: Settings = field("models and limits")
    priors: Priors = field("start of the filter")
    noises: Noises = field("standard deviations")

    @classmethod
    def load(cls, name_or_path: str | Path = DEFAULT) -> FilterConfig:
        """A packaged profile by name, or a YAML file.

        A file may state only what differs from the profile it names with ``base``. Without that
        key it builds on the profile of its own ``settings.method``, or else on ``full``.

        Raises :class:`InputError` with file, line and key.
        """
        return _PROFILES.load(name_or_path)

    def to_yaml(self) -> str:
        """This configuration with description and unit of every key; loads back to an equal one."""
        return dump(self)


def packaged() -> list[str]:
    """Names of the profiles that come with the package."""
    return _PROFILES.names()


def _default_base(content: dict[str, Any]) -> str:
    settings = content.get("settings")
    method = settings.get("method") if isinstance(settings, dict) else None
    return method if method in packaged() else DEFAULT


_PROFILES = PackagedModels(
    FilterConfig, Path(__file__).parent / "configs", "profile", _default_base
)
