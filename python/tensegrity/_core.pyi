"""
C++ core of tensegrity: shape reconstruction, invariant filter, estimators.
"""
from __future__ import annotations
import collections.abc
import enum
import numpy
import numpy.typing
import typing
__all__: list[str] = ['CalibrationStatus', 'Chirality', 'ConstraintSet', 'ContactDetector', 'ContactDetectorParameters', 'ContactNoise', 'ContactPoint', 'DWM1000_TICK_S', 'FilterForm', 'FilterNoise', 'ImuSampling', 'Integrator', 'InvariantFilter', 'IpoptShapeSolver', 'Madgwick', 'MadgwickSettings', 'Net', 'NetGround', 'NetSimulator', 'NetSimulatorFloat', 'PRISM_CABLES', 'Prism', 'PrismConfig', 'PrismEstimator', 'PrismHealth', 'PrismState', 'RangeCalibrationSolver', 'RangeLoss', 'RangingAnchors', 'RangingArrays', 'RangingConfig', 'RangingEstimator', 'RangingHealth', 'RangingProcessNoise', 'RangingRobot', 'RangingState', 'SPEED_OF_LIGHT', 'ShapeMethod', 'ShapeSolver', 'ShapeTracker', 'SigmaWeights', 'SpinMethod', 'Status', 'Terrain', 'UnscentedFilter', 'UnscentedSettings', 'cable_lengths', 'endcap_jacobian', 'fold', 'in_body_frame', 'inequality_values', 'instruction_set', 'length_jacobian', 'mutual_moments', 'spin_angle', 'two_way_ranges']
class Status(enum.Enum):
    """
    What a call did with its input.
    """
    DUPLICATE = ...
    GAP = ...
    NOT_CONVERGED = ...
    NOT_FINITE = ...
    NOT_INITIALIZED = ...
    OK = ...
    OUT_OF_ORDER = ...
    OUT_OF_RANGE = ...
    REJECTED = ...
    TOO_LATE = ...
    WRONG_CHIRALITY = ...
class Chirality(enum.Enum):
    """
    The sense in which the rods twist.
    """
    CLOCKWISE = ...
    COUNTER_CLOCKWISE = ...
class Prism:
    """
    Geometry of a 3-bar prism [m].
    """
    def __init__(self, *, rod_length: typing.SupportsFloat | typing.SupportsIndex = 1.45, imu_offset: typing.SupportsFloat | typing.SupportsIndex = 0.02, endcap_radius: typing.SupportsFloat | typing.SupportsIndex = 0.038, side_length: typing.SupportsFloat | typing.SupportsIndex = 0.98, chirality: Chirality = ...) -> None:
        ...
    def undeformed(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 3]"]:
        """
        Endcaps (6, 3) of the undeformed robot in the body frame [m].
        """
    @property
    def chirality(self) -> Chirality:
        ...
    @property
    def endcap_radius(self) -> float:
        ...
    @property
    def imu_offset(self) -> float:
        ...
    @property
    def rod_length(self) -> float:
        ...
    @property
    def side_length(self) -> float:
        ...
class ConstraintSet(enum.Enum):
    """
    Which inequalities of T eq. (15) a shape has to satisfy.
    """
    AS_PRINTED = ...
    CORRECTED = ...
    MUTUAL_MOMENT = ...
class ShapeSolver:
    """
    Cable lengths -> endcaps by nonlinear least squares (T eq. 15a), in real time. Warm from the last solution; cold after `reset`.
    """
    def __init__(self, robot: Prism, *, max_iterations: typing.SupportsInt | typing.SupportsIndex = 50, max_cold_iterations: typing.SupportsInt | typing.SupportsIndex = 850, tolerance: typing.SupportsFloat | typing.SupportsIndex = 1e-06) -> None:
        ...
    def covariance(self, cable_std: typing.SupportsFloat | typing.SupportsIndex, *, prior_std: typing.SupportsFloat | typing.SupportsIndex = ...) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[18, 18]"]:
        """
        Covariance (18, 18) of the stacked endcaps for cable errors of `cable_std` [m], optionally with a prior of `prior_std` [m] in every tangent direction [m^2].
        """
    def reset(self) -> None:
        """
        Forgets the last solution.
        """
    def solve(self, lengths: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[9, 1]"]) -> Status:
        """
        Solves for lengths (9,) [m]; unless OK or NOT_CONVERGED the shape is unchanged.
        """
    @property
    def cost(self) -> float:
        """
        Sum of squared length residuals [m^2].
        """
    @property
    def endcaps(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 3]"]:
        """
        (6, 3) in the body frame, spin fitted to the undeformed robot [m].
        """
    @property
    def iterations(self) -> int:
        """
        Of the last call.
        """
class ShapeTracker:
    """
    The shape over time: an extended Kalman filter on the two free rods that stays on the branch of the shape equations a loaded robot takes.
    """
    def __init__(self, robot: Prism, *, gate: typing.SupportsFloat | typing.SupportsIndex = 25.0, max_dropped: typing.SupportsInt | typing.SupportsIndex = 3, max_rejections: typing.SupportsInt | typing.SupportsIndex = 10, fold_threshold: typing.SupportsFloat | typing.SupportsIndex = 0.1, fold_std: typing.SupportsFloat | typing.SupportsIndex = 0.1) -> None:
        ...
    def correct(self, lengths: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[9, 1]"], cable_std: typing.SupportsFloat | typing.SupportsIndex, valid: typing.Annotated[collections.abc.Sequence[bool], "FixedSize(9)"] = [True, True, True, True, True, True, True, True, True]) -> Status:
        """
        Uses those of the lengths (9,) [m] that are valid, finite and credible.
        """
    def predict(self, displacement_std: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        Lets the shape drift for one step [m].
        """
    def reset(self, lengths: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[9, 1]"], cable_std: typing.SupportsFloat | typing.SupportsIndex = 0.002) -> Status:
        """
        Starts from lengths (9,) alone [m]; on failure nothing changes.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[18, 18]"]:
        """
        (18, 18) of the stacked endcaps [m^2].
        """
    @property
    def endcaps(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 3]"]:
        """
        (6, 3) in the body frame, spin fitted to the undeformed robot [m].
        """
    @property
    def fold(self) -> float:
        """
        See the function `fold`.
        """
    @property
    def initialized(self) -> bool:
        ...
class IpoptShapeSolver:
    """
    Cable lengths -> endcaps by T eq. (15) with Ipopt: the reference for ShapeSolver, about a thousand times slower.
    """
    def __init__(self, robot: Prism, *, constraints: ConstraintSet = ..., tolerance: typing.SupportsFloat | typing.SupportsIndex = 1e-09, max_iterations: typing.SupportsInt | typing.SupportsIndex = 300) -> None:
        ...
    def reset(self) -> None:
        """
        Forgets the last solution.
        """
    def solve(self, lengths: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[9, 1]"]) -> Status:
        """
        Solves for lengths (9,) [m]; unless OK the shape is unchanged.
        """
    @property
    def cost(self) -> float:
        """
        Sum of squared length residuals [m^2].
        """
    @property
    def endcaps(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 3]"]:
        """
        (6, 3) in the body frame, spin fitted to the undeformed robot [m].
        """
    @property
    def iterations(self) -> int:
        """
        Of the last call, all starts.
        """
class FilterNoise:
    """
    Standard deviations: of one IMU sample (gyro_std [rad/s], accel_std [m/s^2]), and of random walks per square root of a second.
    """
    def __init__(self, *, gyro_std: typing.SupportsFloat | typing.SupportsIndex, accel_std: typing.SupportsFloat | typing.SupportsIndex, gyro_bias_walk: typing.SupportsFloat | typing.SupportsIndex = 0.0, accel_bias_walk: typing.SupportsFloat | typing.SupportsIndex = 0.0, anchor_walk: typing.SupportsFloat | typing.SupportsIndex = 0.0, spin_walk: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
class InvariantFilter:
    """
    Mean on SE_{2+N}(3) x R^7 (biases and the spin angle) and covariance of the right-invariant error (gyro bias, accelerometer bias, rotation, velocity, position, spin, contacts).
    """
    def __init__(self) -> None:
        ...
    def augment(self, id: typing.SupportsInt | typing.SupportsIndex, h: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], h_covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]) -> bool:
        """
        Adds the contact point d = p + R h of an endcap; h (3,) body [m].
        """
    def correct_contacts(self, h: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 3]"], covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[18, 18]"], gate: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> tuple[Status, float]:
        """
        Corrects with all contact points; h (6, 3) endcaps in the body frame after the spin [m], covariance (18, 18) [m^2]. Returns (status, chi square).
        """
    def marginalise(self, id: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Drops the contact point of an endcap.
        """
    def propagate(self, gyro: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], accel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], dt: typing.SupportsFloat | typing.SupportsIndex, noise: FilterNoise, rolling_radius: typing.SupportsFloat | typing.SupportsIndex = 0.0, gravity: typing.SupportsFloat | typing.SupportsIndex = 9.81) -> None:
        """
        One IMU sample over dt [s]; gyro [rad/s] and accel [m/s^2] are means over the step.
        """
    def retract(self, error: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None:
        """
        Takes an error (16 + 3 N,) out of the mean: X <- Exp(-xi) X.
        """
    @property
    def accel_bias(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        b_a (3,), body [m/s^2]
        """
    @accel_bias.setter
    def accel_bias(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def anchor_ids(self) -> list[int]:
        """
        endcap of each contact point
        """
    @property
    def anchors(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        contact points (N, 3), world [m]
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        covariance of the error, (16 + 3 N, 16 + 3 N)
        """
    @covariance.setter
    def covariance(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> None:
        ...
    @property
    def gyro_bias(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        b_g (3,), body [rad/s]
        """
    @gyro_bias.setter
    def gyro_bias(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        p (3,), world [m]
        """
    @position.setter
    def position(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def position_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        ...
    @property
    def rotation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        R (3, 3), body to world
        """
    @rotation.setter
    def rotation(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]) -> None:
        ...
    @property
    def spin(self) -> float:
        """
        phi [rad]
        """
    @spin.setter
    def spin(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        v (3,), world [m/s]
        """
    @velocity.setter
    def velocity(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def velocity_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        ...
class ContactDetectorParameters:
    """
    Weights of the geometry and rates of the two-state Markov process; the defaults are the fitted ones.
    """
    def __init__(self) -> None:
        ...
    @property
    def evidence_time(self) -> float:
        """
        how long errors of the endcap positions persist [s]
        """
    @evidence_time.setter
    def evidence_time(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def height_weight(self) -> float:
        """
        log odds per height above the lowest endcap in rod lengths
        """
    @height_weight.setter
    def height_weight(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def intercept(self) -> typing.Annotated[list[float], "FixedSize(3)"]:
        """
        log odds of the lowest, the second, and the third and higher endcaps, (3,)
        """
    @intercept.setter
    def intercept(self, arg0: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]) -> None:
        ...
    @property
    def lift_off_rate(self) -> float:
        """
        [1/s]
        """
    @lift_off_rate.setter
    def lift_off_rate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def share_weight(self) -> float:
        """
        log odds per share of the weight
        """
    @share_weight.setter
    def share_weight(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def touch_down_rate(self) -> float:
        """
        [1/s]
        """
    @touch_down_rate.setter
    def touch_down_rate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class ContactDetector:
    """
    Which endcaps carry load, from their positions alone. Endcaps are (6, 3) centres in any frame with z up [m].
    """
    def __init__(self, robot: Prism, parameters: ContactDetectorParameters = ...) -> None:
        ...
    def probabilities(self, endcaps: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], dt: typing.SupportsFloat | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
        """
        Updates with every sample of endcaps (N, 6, 3), dt [s] apart; returns (N, 6).
        """
    def reset(self) -> None:
        """
        Forgets everything before the next update.
        """
    def update(self, endcaps: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 3]"], dt: typing.SupportsFloat | typing.SupportsIndex) -> typing.Annotated[list[bool], "FixedSize(6)"]:
        """
        One sample, dt [s] after the last one; returns six flags. Input that is not finite, or a negative dt, keeps the last decision.
        """
    @property
    def probability(self) -> typing.Annotated[list[float], "FixedSize(6)"]:
        """
        Of being loaded, six numbers after the last update.
        """
class ShapeMethod(enum.Enum):
    LEAST_SQUARES = ...
    TRACKER = ...
class SpinMethod(enum.Enum):
    ESTIMATED = ...
    FIXED = ...
class ContactPoint(enum.Enum):
    CENTRE = ...
    ROLLING = ...
class ContactNoise(enum.Enum):
    CONSTANT = ...
    FROM_SHAPE = ...
class ImuSampling(enum.Enum):
    INSTANTANEOUS = ...
    INTERVAL_MEAN = ...
class Terrain(enum.Enum):
    FLAT = ...
    SLOPE = ...
    UNKNOWN = ...
class PrismConfig:
    """
    Settings, priors and noises of the prism's estimator.
    """
    contact_noise: ContactNoise
    contact_point: ContactPoint
    imu_sampling: ImuSampling
    shape: ShapeMethod
    spin: SpinMethod
    static_bias_initialization: bool
    terrain: Terrain
    def __init__(self) -> None:
        ...
    @property
    def accelerometer_bias(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        ...
    @accelerometer_bias.setter
    def accelerometer_bias(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def accelerometer_bias_std(self) -> float:
        ...
    @accelerometer_bias_std.setter
    def accelerometer_bias_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def accelerometer_bias_walk(self) -> float:
        ...
    @accelerometer_bias_walk.setter
    def accelerometer_bias_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def accelerometer_std(self) -> float:
        ...
    @accelerometer_std.setter
    def accelerometer_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def active_force(self) -> float:
        ...
    @active_force.setter
    def active_force(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def active_rate(self) -> float:
        ...
    @active_rate.setter
    def active_rate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def cable_gate(self) -> float:
        ...
    @cable_gate.setter
    def cable_gate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def cable_offset_std(self) -> float:
        ...
    @cable_offset_std.setter
    def cable_offset_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def cable_std(self) -> float:
        ...
    @cable_std.setter
    def cable_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def chi_square_gate(self) -> float:
        ...
    @chi_square_gate.setter
    def chi_square_gate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def contact_error(self) -> float:
        ...
    @contact_error.setter
    def contact_error(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def contact_position_std(self) -> float:
        ...
    @contact_position_std.setter
    def contact_position_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def contact_std(self) -> float:
        ...
    @contact_std.setter
    def contact_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def creep_std(self) -> float:
        ...
    @creep_std.setter
    def creep_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def endcap_acceleration_moving(self) -> float:
        ...
    @endcap_acceleration_moving.setter
    def endcap_acceleration_moving(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def endcap_acceleration_rest(self) -> float:
        ...
    @endcap_acceleration_rest.setter
    def endcap_acceleration_rest(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def foot_height_std(self) -> float:
        ...
    @foot_height_std.setter
    def foot_height_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def foot_rise_std(self) -> float:
        ...
    @foot_rise_std.setter
    def foot_rise_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def friction(self) -> float:
        ...
    @friction.setter
    def friction(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gravity(self) -> float:
        ...
    @gravity.setter
    def gravity(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def ground_height_walk(self) -> float:
        ...
    @ground_height_walk.setter
    def ground_height_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def ground_slope_std(self) -> float:
        ...
    @ground_slope_std.setter
    def ground_slope_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def ground_slope_walk(self) -> float:
        ...
    @ground_slope_walk.setter
    def ground_slope_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyroscope_bias(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        ...
    @gyroscope_bias.setter
    def gyroscope_bias(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def gyroscope_bias_std(self) -> float:
        ...
    @gyroscope_bias_std.setter
    def gyroscope_bias_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyroscope_bias_walk(self) -> float:
        ...
    @gyroscope_bias_walk.setter
    def gyroscope_bias_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyroscope_std(self) -> float:
        ...
    @gyroscope_std.setter
    def gyroscope_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def init_bias_size(self) -> int:
        ...
    @init_bias_size.setter
    def init_bias_size(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def max_imu_gap(self) -> float:
        ...
    @max_imu_gap.setter
    def max_imu_gap(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_latency(self) -> float:
        ...
    @max_latency.setter
    def max_latency(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_shape_iterations(self) -> int:
        ...
    @max_shape_iterations.setter
    def max_shape_iterations(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def orientation_std(self) -> float:
        ...
    @orientation_std.setter
    def orientation_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def position_std(self) -> float:
        ...
    @position_std.setter
    def position_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rod_inclination_std(self) -> float:
        ...
    @rod_inclination_std.setter
    def rod_inclination_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rod_rate_std(self) -> float:
        ...
    @rod_rate_std.setter
    def rod_rate_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def shape_std_moving(self) -> float:
        ...
    @shape_std_moving.setter
    def shape_std_moving(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def shape_std_rest(self) -> float:
        ...
    @shape_std_rest.setter
    def shape_std_rest(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def slip_length(self) -> float:
        ...
    @slip_length.setter
    def slip_length(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def slip_speed(self) -> float:
        ...
    @slip_speed.setter
    def slip_speed(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def spin_prior_std(self) -> float:
        ...
    @spin_prior_std.setter
    def spin_prior_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def spin_walk(self) -> float:
        ...
    @spin_walk.setter
    def spin_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def static_accel_limit(self) -> float:
        ...
    @static_accel_limit.setter
    def static_accel_limit(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def static_gyro_limit(self) -> float:
        ...
    @static_gyro_limit.setter
    def static_gyro_limit(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def velocity_std(self) -> float:
        ...
    @velocity_std.setter
    def velocity_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class PrismHealth:
    """
    Counters since construction; see the C++ header.
    """
    @property
    def cables_dropped(self) -> int:
        ...
    @property
    def cables_rejected(self) -> int:
        ...
    @property
    def contacts_dropped(self) -> int:
        ...
    @property
    def contacts_rejected(self) -> int:
        ...
    @property
    def imu_dropped(self) -> int:
        ...
    @property
    def imu_gaps(self) -> int:
        ...
    @property
    def shape_failures(self) -> int:
        ...
    @property
    def spin_resets(self) -> int:
        ...
    @property
    def terrain_mismatches(self) -> int:
        ...
    @property
    def velocity_resets(self) -> int:
        ...
class PrismState:
    """
    One state of the prism, in SI units.
    """
    @property
    def accel_bias(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), body [m/s^2]
        """
    @property
    def cable_nis(self) -> float:
        """
        of the newest lengths, per degree of freedom; NaN: none
        """
    @property
    def contacts(self) -> typing.Annotated[list[bool], "FixedSize(6)"]:
        """
        endcaps held as contacts
        """
    @property
    def endcap_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[18, 18]"]:
        """
        (18, 18), body [m^2]
        """
    @property
    def endcaps_body(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 3]"]:
        """
        (6, 3) [m]
        """
    @property
    def endcaps_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 3]"]:
        """
        (6, 3) [m]
        """
    @property
    def ground_nis(self) -> float:
        """
        of the newest heights of the feet, per degree of freedom; NaN: none
        """
    @property
    def gyro_bias(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), body [rad/s]
        """
    @property
    def health(self) -> PrismHealth:
        ...
    @property
    def initialized(self) -> bool:
        ...
    @property
    def load_shares(self) -> typing.Annotated[list[float], "FixedSize(6)"]:
        """
        share of the weight each contact carries, six numbers that sum to 1
        """
    @property
    def position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), world [m]
        """
    @property
    def position_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) [m^2]
        """
    @property
    def quaternion(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 1]"]:
        """
        (4,) x y z w
        """
    @property
    def rotation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3), body to world
        """
    @property
    def rotation_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3), world [rad^2]
        """
    @property
    def spin(self) -> float:
        """
        phi [rad]
        """
    @property
    def spin_variance(self) -> float:
        """
        [rad^2]
        """
    @property
    def t(self) -> int:
        """
        stamp [ns]
        """
    @property
    def velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (3,), world [m/s]
        """
    @property
    def velocity_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        (3, 3) [m^2/s^2]
        """
class PrismEstimator:
    """
    Streaming estimator: IMU, cables and contacts in, state out.
    """
    def __init__(self, robot: Prism, config: PrismConfig, tight: bool = True, *, imu_rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None = None, cable_offsets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[9, 1]"] | None = None) -> None:
        """
        imu_rotation (3, 3) turns IMU samples into the body frame, cable_offsets (9,) [m] are taken off the lengths; None leaves them as they are.
        """
    def cables(self, t: typing.SupportsInt | typing.SupportsIndex, lengths: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[9, 1]"]) -> Status:
        """
        Cable lengths: t [ns], (9,) [m] in the order of PRISM_CABLES, NaN: not measured. Offsets are taken off.
        """
    def contacts(self, t: typing.SupportsInt | typing.SupportsIndex, flags: typing.Annotated[numpy.typing.ArrayLike, numpy.bool]) -> Status:
        """
        Contact flags: t [ns], (6,) true on the ground.
        """
    def imu(self, t: typing.SupportsInt | typing.SupportsIndex, gyro: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], accel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> Status:
        """
        One IMU sample: t [ns], angular velocity (3,) [rad/s], specific force (3,) [m/s^2], in the frame of the IMU.
        """
    def replay(self, imu_t: typing.Annotated[numpy.typing.ArrayLike, numpy.int64], gyro: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], accel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], cables_t: typing.Annotated[numpy.typing.ArrayLike, numpy.int64], lengths: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], contacts_t: typing.Annotated[numpy.typing.ArrayLike, numpy.int64] | None = None, flags: typing.Annotated[numpy.typing.ArrayLike, numpy.bool] | None = None, rod_imus: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.Annotated[numpy.typing.ArrayLike, numpy.int64], typing.Annotated[numpy.typing.ArrayLike, numpy.float64], typing.Annotated[numpy.typing.ArrayLike, numpy.float64]]] = [], progress: collections.abc.Callable[[float], None] | None = None) -> tuple:
        """
        Feeds a whole recording and returns (arrays by name, seconds in the estimator).
        """
    def rod_imu(self, t: typing.SupportsInt | typing.SupportsIndex, rod: typing.SupportsInt | typing.SupportsIndex, gyro: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], accel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> Status:
        """
        An IMU on rod 1 (r23) or 2 (r45), z toward its even endcap: t [ns], rate (3,) [rad/s], specific force (3,) [m/s^2]. Before the base rod's sample of the same stamp.
        """
    @property
    def initialized(self) -> bool:
        ...
    @property
    def state(self) -> PrismState:
        ...
class Integrator(enum.Enum):
    """
    Of the equations of motion.
    """
    RUNGE_KUTTA_4 = ...
    SEMI_IMPLICIT_EULER = ...
class NetGround:
    """
    The plane z = 0 that a net rests on.
    """
    def __init__(self) -> None:
        ...
    @property
    def damping(self) -> float:
        """
        [N s/m^2]
        """
    @damping.setter
    def damping(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def friction_damping(self) -> float:
        """
        [N s/m]
        """
    @friction_damping.setter
    def friction_damping(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def friction_kinetic(self) -> float:
        ...
    @friction_kinetic.setter
    def friction_kinetic(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def friction_static(self) -> float:
        ...
    @friction_static.setter
    def friction_static(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def friction_stiffness(self) -> float:
        """
        [N/m]
        """
    @friction_stiffness.setter
    def friction_stiffness(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def stiffness(self) -> float:
        """
        [N/m]; 0 with damping 0: no ground
        """
    @stiffness.setter
    def stiffness(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class Net:
    """
    Point masses joined by rods and cables.
    """
    def __init__(self, nodes: typing.SupportsInt | typing.SupportsIndex, node_mass: typing.SupportsFloat | typing.SupportsIndex, ground: NetGround, gravity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    def set_cables(self, ends: typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 2]"], stiffness: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], damping: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], rest_length: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None:
        """
        ends (cables, 2), as set_rods
        """
    def set_rods(self, ends: typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 2]"], stiffness: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], damping: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], rest_length: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None:
        """
        ends (rods, 2): indices of nodes; stiffness [N/m], damping [N s/m], rest_length [m]
        """
class NetSimulator:
    """
    Many simulations of one net at once.
    """
    def __init__(self, net: Net) -> None:
        ...
    @typing.overload
    def step(self, states: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]", "flags.writeable", "flags.f_contiguous"], rest_lengths: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], dt: typing.SupportsFloat | typing.SupportsIndex, steps: typing.SupportsInt | typing.SupportsIndex, integrator: Integrator = ...) -> Status:
        """
        Moves the states (simulations, 6n), in Fortran order, by steps of dt [s] in place. Friction remembers for this call alone.
        """
    @typing.overload
    def step(self, states: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]", "flags.writeable", "flags.f_contiguous"], anchors: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]", "flags.writeable", "flags.f_contiguous"], rest_lengths: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], dt: typing.SupportsFloat | typing.SupportsIndex, steps: typing.SupportsInt | typing.SupportsIndex, integrator: Integrator = ...) -> Status:
        """
        The same with the points where nodes stand (simulations, 2n), in Fortran order, moved along.
        """
    @property
    def failures(self) -> int:
        """
        Simulations that the last step left as they were.
        """
class NetSimulatorFloat:
    """
    NetSimulator in single precision: twice as many per SIMD register.
    """
    def __init__(self, net: Net) -> None:
        ...
    @typing.overload
    def step(self, states: typing.Annotated[numpy.typing.NDArray[numpy.float32], "[m, n]", "flags.writeable", "flags.f_contiguous"], rest_lengths: typing.Annotated[numpy.typing.ArrayLike, numpy.float32, "[m, 1]"], dt: typing.SupportsFloat | typing.SupportsIndex, steps: typing.SupportsInt | typing.SupportsIndex, integrator: Integrator = ...) -> Status:
        """
        Moves the states (simulations, 6n), in Fortran order, by steps of dt [s] in place. Friction remembers for this call alone.
        """
    @typing.overload
    def step(self, states: typing.Annotated[numpy.typing.NDArray[numpy.float32], "[m, n]", "flags.writeable", "flags.f_contiguous"], anchors: typing.Annotated[numpy.typing.NDArray[numpy.float32], "[m, n]", "flags.writeable", "flags.f_contiguous"], rest_lengths: typing.Annotated[numpy.typing.ArrayLike, numpy.float32, "[m, 1]"], dt: typing.SupportsFloat | typing.SupportsIndex, steps: typing.SupportsInt | typing.SupportsIndex, integrator: Integrator = ...) -> Status:
        """
        The same with the points where nodes stand (simulations, 2n), in Fortran order, moved along.
        """
    @property
    def failures(self) -> int:
        """
        Simulations that the last step left as they were.
        """
class RangeLoss(enum.Enum):
    """
    Loss of a range's whitened residual.
    """
    cauchy = ...
    huber = ...
    squares = ...
class CalibrationStatus(enum.Enum):
    """
    How a solution ended.
    """
    converged = ...
    iteration_limit = ...
    stuck = ...
class RangeCalibrationSolver:
    """
    Levenberg-Marquardt over shared parameters [anchors 3A | offset terms | rod lengths] and the knots of the trajectories, strip by strip.
    """
    def __init__(self, *, anchors: typing.SupportsInt | typing.SupportsIndex, offset_terms: typing.SupportsInt | typing.SupportsIndex, rod_lengths: typing.SupportsInt | typing.SupportsIndex, prior_mean: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], prior_information: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], strip_modules: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], strip_knots: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], strip_rod: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], motion_information: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64]], indices: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], blend: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], range_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], range_std: typing.SupportsFloat | typing.SupportsIndex, rod_std: typing.SupportsFloat | typing.SupportsIndex, knot_information: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]) -> None:
        ...
    def cost(self, loss: RangeLoss, scale: typing.SupportsFloat | typing.SupportsIndex) -> float:
        """
        Half the sum of losses and squared priors.
        """
    def positions(self, strip: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
        """
        Positions of a strip, flat: (knots, modules, 3) [m].
        """
    def reduced_information(self, loss: RangeLoss, scale: typing.SupportsFloat | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Information of the shared parameters, trajectory marginalised [1/m^2].
        """
    def residuals(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Predicted minus measured ranges in standard deviations, (N,).
        """
    def set_positions(self, strip: typing.SupportsInt | typing.SupportsIndex, positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> None:
        ...
    def solve(self, loss: RangeLoss, scale: typing.SupportsFloat | typing.SupportsIndex, max_iterations: typing.SupportsInt | typing.SupportsIndex, tolerance: typing.SupportsFloat | typing.SupportsIndex) -> tuple[CalibrationStatus, int, float]:
        """
        Minimises from the current state; returns status, iterations and the cost.
        """
    def weights(self, loss: RangeLoss, scale: typing.SupportsFloat | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
        """
        Weights that the loss gives the ranges, (N,).
        """
    @property
    def shared(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Shared parameters [m].
        """
    @shared.setter
    def shared(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None:
        ...
class MadgwickSettings:
    """
    Settings of the gradient-descent filter.
    """
    def __init__(self) -> None:
        ...
    @property
    def gain(self) -> float:
        """
        step down the gradient [1/s]
        """
    @gain.setter
    def gain(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def largest_force(self) -> float:
        """
        of a measurement [m/s^2]
        """
    @largest_force.setter
    def largest_force(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def largest_interval(self) -> float:
        """
        of one sample [s]
        """
    @largest_interval.setter
    def largest_interval(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def largest_rate(self) -> float:
        """
        of a measurement [rad/s]
        """
    @largest_rate.setter
    def largest_rate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class Madgwick:
    """
    Orientation of an IMU by gradient descent (Madgwick et al. 2011). Quaternions are w, x, y, z, from the IMU's frame to the world, z up.
    """
    def __init__(self, settings: MadgwickSettings = ...) -> None:
        ...
    def inclination_cosine(self, axis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = (0, 0, 1)) -> float:
        """
        Cosine of the angle between the vertical (up) and an axis (3,) of the IMU's frame.
        """
    def run(self, gyro: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], accel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], dt: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.uint8]]:
        """
        Updates with every row of gyro (N, 3), accel (N, 3) and dt (N,); returns the orientations after each (N, 4) and the statuses (N,) as numbers of Status.
        """
    def start(self, accel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> Status:
        """
        Begins level with a specific force (3,) measured at rest [m/s^2].
        """
    def start_at(self, orientation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 1]"]) -> Status:
        """
        Begins with a known orientation (4,).
        """
    @typing.overload
    def update(self, gyro: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], accel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], dt: typing.SupportsFloat | typing.SupportsIndex) -> Status:
        """
        One sample: rate (3,) [rad/s] and specific force (3,) [m/s^2] over dt [s].
        """
    @typing.overload
    def update(self, gyro: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], accel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], field: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], dt: typing.SupportsFloat | typing.SupportsIndex) -> Status:
        """
        As above with the magnetic field (3,) in any unit.
        """
    @property
    def orientation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 1]"]:
        """
        Quaternion (4,); identity before the start.
        """
    @property
    def settings(self) -> MadgwickSettings:
        ...
    @property
    def started(self) -> bool:
        ...
class SigmaWeights(enum.Enum):
    """
    How sigma points count.
    """
    SCALED = ...
    UNIFORM = ...
class FilterForm(enum.Enum):
    """
    What an unscented filter keeps.
    """
    COVARIANCE = ...
    SQUARE_ROOT = ...
class UnscentedSettings:
    """
    Sigma points and form of an unscented filter.
    """
    form: FilterForm
    weights: SigmaWeights
    def __init__(self) -> None:
        ...
    @property
    def alpha(self) -> float:
        """
        spread of the points
        """
    @alpha.setter
    def alpha(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def beta(self) -> float:
        """
        2 for Gaussian states
        """
    @beta.setter
    def beta(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def kappa(self) -> float:
        ...
    @kappa.setter
    def kappa(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def redraw(self) -> bool:
        """
        draw new points from the predicted covariance before a correction
        """
    @redraw.setter
    def redraw(self, arg0: bool) -> None:
        ...
class UnscentedFilter:
    """
    Unscented Kalman filter with additive noise, measurements that come and go.
    """
    def __init__(self, dimension: typing.SupportsInt | typing.SupportsIndex, capacity: typing.SupportsInt | typing.SupportsIndex, settings: UnscentedSettings = ...) -> None:
        ...
    def correct(self, measure: collections.abc.Callable, z: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], variances: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], gate: typing.SupportsFloat | typing.SupportsIndex = ...) -> Status:
        """
        `measure` maps sigma points (2L+1, L) to measurements (2L+1, rows); z and variances are (rows,); rows with a squared innovation above `gate` variances are left out.
        """
    def predict(self, process: collections.abc.Callable, noise: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> Status:
        """
        `process` maps sigma points (2L+1, L) to new ones; `noise` (L, L) is added.
        """
    def set(self, mean: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> Status:
        """
        Starts from a mean (L,) and covariance (L, L).
        """
    @property
    def accepted(self) -> list[bool]:
        """
        Of the rows of the last correction.
        """
    @property
    def capacity(self) -> int:
        ...
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        ...
    @property
    def dimension(self) -> int:
        ...
    @property
    def mean(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        ...
    @property
    def squared_distance(self) -> float:
        """
        Chi-square of the rows used last.
        """
class RangingProcessNoise(enum.Enum):
    """
    What disturbs the net between updates.
    """
    ACCELERATION = ...
    STATE = ...
class RangingRobot:
    """
    Nodes (n, 3) of the undeformed robot [m], rods (r, 2).
    """
    def __init__(self, nodes: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"], rods: typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 2]"], rod_length: typing.SupportsFloat | typing.SupportsIndex, module_inset: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class RangingAnchors:
    """
    Positions (A, 3) of the anchors [m]; offsets and how well they are known, (n, A); offsets among the robot's modules, (n, n) [m].
    """
    def __init__(self, positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"], offsets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], offset_std: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], internal_offsets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> None:
        ...
class RangingConfig:
    """
    Settings of RangingEstimator; noises are standard deviations.
    """
    process_noise: RangingProcessNoise
    @staticmethod
    def paper() -> RangingConfig:
        """
        The filter as published, with the sigma weights of its authors' code.
        """
    def __init__(self) -> None:
        ...
    @property
    def body_acceleration(self) -> float:
        """
        ACCELERATION: of the robot as one body [m/s/sqrt(s)]
        """
    @body_acceleration.setter
    def body_acceleration(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def dynamics_step(self) -> float:
        """
        longest step [s]
        """
    @dynamics_step.setter
    def dynamics_step(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def filter(self) -> UnscentedSettings:
        """
        sigma points and form
        """
    @filter.setter
    def filter(self, arg0: UnscentedSettings) -> None:
        ...
    @property
    def gate(self) -> float:
        """
        largest innovation [standard deviations]; 0: none
        """
    @gate.setter
    def gate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def hold_rods(self) -> bool:
        """
        sigma points and corrections never stretch rods
        """
    @hold_rods.setter
    def hold_rods(self, arg0: bool) -> None:
        ...
    @property
    def inclination_std(self) -> float:
        """
        [rad]
        """
    @inclination_std.setter
    def inclination_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def internal_range_std(self) -> float:
        """
        [m]
        """
    @internal_range_std.setter
    def internal_range_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def largest_rate(self) -> float:
        """
        of an IMU; faster is a wrong sample [rad/s]
        """
    @largest_rate.setter
    def largest_rate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def lost_level(self) -> float:
        """
        mean squared innovation in variances; 0: never lost
        """
    @lost_level.setter
    def lost_level(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def lost_time(self) -> float:
        """
        [s]
        """
    @lost_time.setter
    def lost_time(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_latency(self) -> float:
        """
        an update waits so long [s]
        """
    @max_latency.setter
    def max_latency(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def node_acceleration(self) -> float:
        """
        ACCELERATION: of every node [m/s/sqrt(s)]
        """
    @node_acceleration.setter
    def node_acceleration(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def period(self) -> float:
        """
        between updates [s]
        """
    @period.setter
    def period(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def range_std(self) -> float:
        """
        to an anchor [m]
        """
    @range_std.setter
    def range_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def spread(self) -> float:
        """
        standard deviations of the sigma points from the mean, in place of filter.alpha; 0: alpha as it is
        """
    @spread.setter
    def spread(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def start_body_std(self) -> float:
        """
        [m]
        """
    @start_body_std.setter
    def start_body_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def start_ground_std(self) -> float:
        """
        height of the three lowest nodes [m]; 0: no ground
        """
    @start_ground_std.setter
    def start_ground_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def start_node_std(self) -> float:
        """
        [m]
        """
    @start_node_std.setter
    def start_node_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def start_pairs(self) -> int:
        """
        pairs of modules that a start needs
        """
    @start_pairs.setter
    def start_pairs(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def start_speed_std(self) -> float:
        """
        [m/s]
        """
    @start_speed_std.setter
    def start_speed_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def start_window(self) -> float:
        """
        [s]
        """
    @start_window.setter
    def start_window(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def state_std(self) -> float:
        """
        STATE: per update [m], [m/s]
        """
    @state_std.setter
    def state_std(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class RangingHealth:
    """
    Counters of RangingEstimator.
    """
    @property
    def dropped(self) -> int:
        """
        wrong stamp, index or value
        """
    @property
    def failed_predictions(self) -> int:
        ...
    @property
    def gaps(self) -> int:
        """
        times without ranges
        """
    @property
    def imu_rejected(self) -> int:
        """
        samples of impossible rates
        """
    @property
    def inclinations_rejected(self) -> int:
        """
        by the gate
        """
    @property
    def inclinations_used(self) -> int:
        ...
    @property
    def ranges_rejected(self) -> int:
        """
        by the gate
        """
    @property
    def ranges_used(self) -> int:
        ...
    @property
    def restarts(self) -> int:
        """
        of a filter that was lost
        """
    @property
    def updates(self) -> int:
        ...
class RangingState:
    """
    What RangingEstimator knows after its last update.
    """
    @property
    def centre_of_mass(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        world [m]
        """
    @property
    def centre_of_mass_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        [m^2]
        """
    @property
    def centre_of_mass_velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [m/s]
        """
    @property
    def face(self) -> typing.Annotated[list[int], "FixedSize(3)"]:
        """
        indices of the three lowest nodes, lowest first
        """
    @property
    def health(self) -> RangingHealth:
        ...
    @property
    def initialized(self) -> bool:
        ...
    @property
    def position_std(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (n, 3) [m]
        """
    @property
    def positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Ends of the rods (n, 3), world [m].
        """
    @property
    def surprise(self) -> float:
        """
        mean squared innovation in variances, recently; 1 is right
        """
    @property
    def t(self) -> int:
        """
        [ns]
        """
    @property
    def velocities(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (n, 3) [m/s]
        """
class RangingArrays:
    """
    Recorded arrays, sorted by stamp.
    """
    def __init__(self) -> None:
        ...
    @property
    def accel(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        (S, 3) [m/s^2]
        """
    @accel.setter
    def accel(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None:
        ...
    @property
    def gyro(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        (S, 3) [rad/s]
        """
    @gyro.setter
    def gyro(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None:
        ...
    @property
    def imu_nodes(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 1]"]:
        """
        (S,) indices of nodes
        """
    @imu_nodes.setter
    def imu_nodes(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 1]"]) -> None:
        ...
    @property
    def imu_t(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int64], "[m, 1]"]:
        """
        (S,) [ns]
        """
    @imu_t.setter
    def imu_t(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.int64, "[m, 1]"]) -> None:
        ...
    @property
    def internal_pairs(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 2]"]:
        """
        (I, 2) indices of nodes
        """
    @internal_pairs.setter
    def internal_pairs(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 2]"]) -> None:
        ...
    @property
    def internal_ranges(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (I,) raw [m]
        """
    @internal_ranges.setter
    def internal_ranges(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None:
        ...
    @property
    def internal_t(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int64], "[m, 1]"]:
        """
        (I,) [ns]
        """
    @internal_t.setter
    def internal_t(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.int64, "[m, 1]"]) -> None:
        ...
    @property
    def motor_t(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int64], "[m, 1]"]:
        """
        (M,) [ns]
        """
    @motor_t.setter
    def motor_t(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.int64, "[m, 1]"]) -> None:
        ...
    @property
    def range_pairs(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 2]"]:
        """
        (N, 2) indices of node and anchor
        """
    @range_pairs.setter
    def range_pairs(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 2]"]) -> None:
        ...
    @property
    def range_t(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int64], "[m, 1]"]:
        """
        (N,) [ns]
        """
    @range_t.setter
    def range_t(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.int64, "[m, 1]"]) -> None:
        ...
    @property
    def ranges(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (N,) raw [m]
        """
    @ranges.setter
    def ranges(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None:
        ...
    @property
    def rest_lengths(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (M, cables) [m]
        """
    @rest_lengths.setter
    def rest_lengths(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> None:
        ...
class RangingEstimator:
    """
    Ranges, inclinations and motors in, state of a net of rods out (C §IV). Modules go by their indices.
    """
    def __init__(self, robot: RangingRobot, anchors: RangingAnchors, net: Net, rest_lengths: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], config: RangingConfig = ...) -> None:
        ...
    def imu(self, t: typing.SupportsInt | typing.SupportsIndex, node: typing.SupportsInt | typing.SupportsIndex, gyro: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], accel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> Status:
        """
        A sample [rad/s], [m/s^2], z along the rod toward its first end.
        """
    def inclination(self, t: typing.SupportsInt | typing.SupportsIndex, rod: typing.SupportsInt | typing.SupportsIndex, cosine: typing.SupportsFloat | typing.SupportsIndex) -> Status:
        """
        Cosine of the angle between up and a rod, toward its first end.
        """
    def internal_range(self, t: typing.SupportsInt | typing.SupportsIndex, node: typing.SupportsInt | typing.SupportsIndex, other: typing.SupportsInt | typing.SupportsIndex, range: typing.SupportsFloat | typing.SupportsIndex) -> Status:
        """
        A raw range between two modules [m].
        """
    def motors(self, t: typing.SupportsInt | typing.SupportsIndex, rest_lengths: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> Status:
        """
        Rest lengths of all cables [m].
        """
    def range(self, t: typing.SupportsInt | typing.SupportsIndex, node: typing.SupportsInt | typing.SupportsIndex, anchor: typing.SupportsInt | typing.SupportsIndex, range: typing.SupportsFloat | typing.SupportsIndex) -> Status:
        """
        A raw range [m].
        """
    def run(self, arrays: RangingArrays) -> dict:
        """
        Feeds recorded arrays; returns the states after every update as arrays.
        """
    def update(self, t: typing.SupportsInt | typing.SupportsIndex) -> Status:
        """
        Brings the state to t.
        """
    @property
    def initialized(self) -> bool:
        ...
    @property
    def state(self) -> RangingState:
        ...
def cable_lengths(endcaps: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 3]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[9, 1]"]:
    """
    Distances (9,) of endcaps (6, 3) in the order of PRISM_CABLES [m].
    """
def endcap_jacobian(robot: Prism, endcaps: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 3]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[18, 10]"]:
    """
    dq/dtangent (18, 10) of the stacked endcaps, same tangent as `length_jacobian`.
    """
def fold(robot: Prism, endcaps: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 3]"]) -> float:
    """
    Side and distance of the fold of the shape equations: positive on the branch a standing robot takes, zero where two branches meet. Dimensionless.
    """
def in_body_frame(robot: Prism, endcaps: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 3]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 3]"]:
    """
    Endcaps (6, 3) given in any frame, moved rigidly to the body frame and turned about z to fit the undeformed robot best [m].
    """
def inequality_values(robot: Prism, endcaps: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 3]"], constraints: ConstraintSet) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    Left-hand sides of the inequalities of T eq. (15) [m, m^2 or m^3], all positive for a shape that satisfies them. Printed and corrected set: 15d (2), 15e (2), 15g to 15l; mutual moments: three.
    """
def instruction_set() -> str:
    """
    What this core is compiled for: 'x86-64-v3' (AVX2 and FMA), 'native', or 'baseline'.
    """
def length_jacobian(robot: Prism, endcaps: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 3]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[9, 10]"]:
    """
    dl/dtangent (9, 10) at endcaps (6, 3) in the body frame; the tangent is (dc23, L/2 du23, dc45, L/2 du45), all in metres.
    """
def mutual_moments(endcaps: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 3]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
    """
    m_ij = (c_j - c_i) . (u_i x u_j) (3,) of the rod pairs (01, 23), (23, 45), (45, 01) [m]: all negative for a counter-clockwise robot, zero where two rod axes cross.
    """
def spin_angle(endcaps: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 3]"], reference: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 3]"]) -> float:
    """
    Angle about body z by which `reference` has to be turned to fit `endcaps` best over endcaps 2 to 5 [rad].
    """
def two_way_ranges(stamps: typing.Annotated[numpy.typing.ArrayLike, numpy.uint64]) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.uint8]]:
    """
    Raw ranges (N,) [m], relative drifts (N,) [1] and statuses (N,), as numbers of Status, of exchanges (N, 6): poll sent, received, response sent, received, final sent, received.
    """
DWM1000_TICK_S: float = 1.5650040064102565e-11
PRISM_CABLES: tuple = ((0, 4), (0, 2), (2, 4), (1, 5), (1, 3), (3, 5), (1, 4), (0, 3), (2, 5))
SPEED_OF_LIGHT: float = 299792458.0
__version__: str = '0.1.0'
