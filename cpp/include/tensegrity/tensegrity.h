/* The prism's estimator for programs in C: sensors in, state out.
 *
 * C99, and no less valid as C++. The library (CMake target `tensegrity::c`) allocates nothing,
 * throws nothing and starts nothing: the caller supplies the memory, as a `tensegrity_estimator`,
 * and every call returns when its work is done. One estimator is for one thread at a time.
 *
 * Frames. World: z up, gravity (0, 0, -g). Body: that of the IMU on the base rod r01, its origin at
 * the IMU, z from endcap 1 to endcap 0. Rods join the endcaps (0,1), (2,3), (4,5). Cables join
 * (0,4) (0,2) (2,4) (1,5) (1,3) (3,5) (1,4) (0,3) (2,5), in this order: first the six side cables,
 * then the three cross cables. SI units; stamps are nanoseconds of any clock that does not jump.
 *
 * Scalar type. The library is built for `double` or for `float` (CMake: TENSEGRITY_C_SCALAR).
 * Programs of a `float` library define TENSEGRITY_SINGLE; the CMake target and pkg-config do so.
 * Functions carry the type in their symbol's name, so that a header and a library that disagree do
 * not link.
 */
#ifndef TENSEGRITY_TENSEGRITY_H
#define TENSEGRITY_TENSEGRITY_H

#include <stdbool.h>
#include <stdint.h>

#ifdef TENSEGRITY_SINGLE
typedef float tensegrity_real;
#define TENSEGRITY_SYMBOL(name) name##_f32
#define TENSEGRITY_ESTIMATOR_SIZE 14336 /* bytes */
#else
typedef double tensegrity_real;
#define TENSEGRITY_SYMBOL(name) name##_f64
#define TENSEGRITY_ESTIMATOR_SIZE 28672 /* bytes */
#endif

#define tensegrity_default_robot TENSEGRITY_SYMBOL(tensegrity_default_robot)
#define tensegrity_undeformed TENSEGRITY_SYMBOL(tensegrity_undeformed)
#define tensegrity_default_config TENSEGRITY_SYMBOL(tensegrity_default_config)
#define tensegrity_create_full TENSEGRITY_SYMBOL(tensegrity_create_full)
#define tensegrity_create_paper TENSEGRITY_SYMBOL(tensegrity_create_paper)
#define tensegrity_copy TENSEGRITY_SYMBOL(tensegrity_copy)
#define tensegrity_imu TENSEGRITY_SYMBOL(tensegrity_imu)
#define tensegrity_rod_imu TENSEGRITY_SYMBOL(tensegrity_rod_imu)
#define tensegrity_cables TENSEGRITY_SYMBOL(tensegrity_cables)
#define tensegrity_contacts TENSEGRITY_SYMBOL(tensegrity_contacts)
#define tensegrity_initialized TENSEGRITY_SYMBOL(tensegrity_initialized)
#define tensegrity_get_state TENSEGRITY_SYMBOL(tensegrity_get_state)
#define tensegrity_used TENSEGRITY_SYMBOL(tensegrity_used)
#define tensegrity_to_string TENSEGRITY_SYMBOL(tensegrity_to_string)

/* Alignment of an estimator [bytes]: the widest vector registers that a build may use. */
#define TENSEGRITY_ALIGNMENT 64
#if defined(__cplusplus)
#define TENSEGRITY_ALIGNAS alignas(TENSEGRITY_ALIGNMENT)
#elif defined(__GNUC__)
#define TENSEGRITY_ALIGNAS __attribute__((aligned(TENSEGRITY_ALIGNMENT)))
#elif defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
#define TENSEGRITY_ALIGNAS _Alignas(TENSEGRITY_ALIGNMENT)
#else
#error "define how this compiler aligns a variable: C99 has no word for it"
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- status */

/* What a call did with its input. After any of them the estimator holds a valid, finite state. */
typedef enum tensegrity_status {
  TENSEGRITY_OK = 0,
  TENSEGRITY_NOT_INITIALIZED = 1, /* the robot has not stood still yet; the input was noted */
  TENSEGRITY_NOT_FINITE = 2,      /* NaN or infinity; the input was dropped */
  TENSEGRITY_OUT_OF_RANGE = 3,    /* finite but impossible; the input was dropped */
  TENSEGRITY_DUPLICATE = 4,       /* a stamp that was seen before; the input was dropped */
  TENSEGRITY_OUT_OF_ORDER = 5,    /* before the newest one of its kind; the input was dropped */
  TENSEGRITY_TOO_LATE = 6,        /* older than `max_latency`; the input was dropped */
  TENSEGRITY_GAP = 7,           /* samples were missing before it; used, uncertainty was widened */
  TENSEGRITY_REJECTED = 8,      /* innovation beyond the gate; the input was dropped */
  TENSEGRITY_NOT_CONVERGED = 9, /* the iteration limit was reached; the best iterate is kept */
  TENSEGRITY_WRONG_CHIRALITY = 10, /* only mirror images or crossing rods fit the lengths */
  /* of this interface alone; nothing was done */
  TENSEGRITY_NULL_ARGUMENT = 64, /* a pointer is NULL */
  TENSEGRITY_NOT_CREATED = 65,   /* no tensegrity_create_... succeeded on this estimator */
  TENSEGRITY_MISALIGNED = 66, /* the estimator's address is no multiple of TENSEGRITY_ALIGNMENT */
  TENSEGRITY_STATUS_INT = 0x7fffffff /* never returned: keeps 32 bits under -fshort-enums, too */
} tensegrity_status;

/* True for outcomes after which the input has become part of the state (OK, GAP). */
bool tensegrity_used(tensegrity_status status);

/* "ok", "not_finite", ...; "unknown" for values that are none. Never NULL. */
const char* tensegrity_to_string(tensegrity_status status);

/* ---- robot */

/* Sense in which the rods twist: the robot of Tong et al. 2024, or its mirror image. */
typedef enum tensegrity_chirality {
  TENSEGRITY_COUNTER_CLOCKWISE = 0,
  TENSEGRITY_CLOCKWISE = 1,
  TENSEGRITY_CHIRALITY_INT = 0x7fffffff
} tensegrity_chirality;

typedef struct tensegrity_robot {
  tensegrity_real rod_length;    /* between endcap centres [m] */
  tensegrity_real imu_offset;    /* of the IMU from the centre of r01 toward endcap 0 [m] */
  tensegrity_real endcap_radius; /* [m] */
  tensegrity_real side_length;   /* side cables of the undeformed robot [m] */
  tensegrity_chirality chirality;
} tensegrity_robot;

/* The robot of Tong et al. 2024. */
tensegrity_robot tensegrity_default_robot(void);

/* The undeformed robot: endcap centres in the body frame, lengths of the cables [m].
 * OUT_OF_RANGE, NOT_FINITE: no robot has the lengths of `robot`. */
tensegrity_status tensegrity_undeformed(const tensegrity_robot* robot,
                                        tensegrity_real endcaps[6][3],
                                        tensegrity_real cable_lengths[9]);

/* ---- configuration */

/* `paper`: nine lengths to a shape */
typedef enum tensegrity_shape_method {
  TENSEGRITY_SHAPE_LEAST_SQUARES = 0, /* every sample by itself, warm-started */
  TENSEGRITY_SHAPE_TRACKER = 1,       /* a filter over the shape that knows its fold */
  TENSEGRITY_SHAPE_INT = 0x7fffffff
} tensegrity_shape_method;

/* `paper`: the shape's angle about the base rod, which no cable measures */
typedef enum tensegrity_spin_method {
  TENSEGRITY_SPIN_FIXED = 0,     /* stays what the start found */
  TENSEGRITY_SPIN_ESTIMATED = 1, /* is a filter state */
  TENSEGRITY_SPIN_INT = 0x7fffffff
} tensegrity_spin_method;

/* `paper`: what stands still while an endcap is in contact */
typedef enum tensegrity_contact_point {
  TENSEGRITY_CONTACT_CENTRE = 0,  /* the endcap's centre */
  TENSEGRITY_CONTACT_ROLLING = 1, /* the lowest point of a sphere that rolls */
  TENSEGRITY_CONTACT_POINT_INT = 0x7fffffff
} tensegrity_contact_point;

/* `paper`: noise of the contact kinematics */
typedef enum tensegrity_contact_noise {
  TENSEGRITY_NOISE_CONSTANT = 0,   /* one standard deviation for all endcaps */
  TENSEGRITY_NOISE_FROM_SHAPE = 1, /* the joint covariance of the shape */
  TENSEGRITY_NOISE_INT = 0x7fffffff
} tensegrity_contact_noise;

typedef enum tensegrity_imu_sampling {
  TENSEGRITY_IMU_INTERVAL_MEAN = 0, /* the mean over the interval that ends at the stamp */
  TENSEGRITY_IMU_INSTANTANEOUS = 1, /* the value at the stamp */
  TENSEGRITY_IMU_INT = 0x7fffffff
} tensegrity_imu_sampling;

/* `full`: what the ground is declared to be */
typedef enum tensegrity_terrain {
  TENSEGRITY_TERRAIN_FLAT = 0,    /* one level plane */
  TENSEGRITY_TERRAIN_SLOPE = 1,   /* one plane of unknown slope */
  TENSEGRITY_TERRAIN_UNKNOWN = 2, /* a plane that changes on the way */
  TENSEGRITY_TERRAIN_INT = 0x7fffffff
} tensegrity_terrain;

/* Everything that can be set. Start from `tensegrity_default_config`, change what differs. The
 * names are those of the C++ struct PrismConfig; `std` is a standard deviation, `walk` that of a
 * random walk. Bounds are checked when an estimator is created: every number is finite, and where
 * nothing else is said it is not negative. */
typedef struct tensegrity_config {
  /* settings: `paper` */
  tensegrity_shape_method shape;
  tensegrity_spin_method spin;
  tensegrity_contact_point contact_point;
  tensegrity_contact_noise contact_noise;
  int32_t max_shape_iterations; /* of a sample's least squares, >= 1 */
  /* settings: both methods */
  tensegrity_imu_sampling imu_sampling;
  bool static_bias_initialization;
  int32_t init_bias_size;             /* IMU samples in a row that have to be still, >= 1 */
  tensegrity_real static_gyro_limit;  /* std while still [rad/s], > 0 */
  tensegrity_real static_accel_limit; /* std while still [m/s^2], > 0 */
  tensegrity_real max_imu_gap;        /* a longer step counts as missing samples [s], > 0 */
  tensegrity_real max_latency;        /* cables and contacts older than this are dropped [s] */
  tensegrity_real chi_square_gate;    /* probability of the contact gate; 0: no gate; < 1 */
  tensegrity_real gravity;            /* [m/s^2], > 0 */
  /* settings: `full` */
  tensegrity_terrain terrain;
  tensegrity_real friction;      /* coefficient of the ground, matters on slopes alone, > 0 */
  tensegrity_real contact_error; /* share of contact flags that are wrong, > 0, < 0.5 */
  tensegrity_real cable_gate;    /* innovations of cables beyond so many sigmas are left out */

  /* priors: at the start */
  tensegrity_real orientation_std;        /* roll and pitch [rad] */
  tensegrity_real velocity_std;           /* [m/s] */
  tensegrity_real position_std;           /* [m] */
  tensegrity_real gyroscope_bias[3];      /* body [rad/s], any sign */
  tensegrity_real gyroscope_bias_std;     /* [rad/s] */
  tensegrity_real accelerometer_bias[3];  /* body [m/s^2], any sign */
  tensegrity_real accelerometer_bias_std; /* [m/s^2] */
  tensegrity_real spin_prior_std;         /* [rad] */
  tensegrity_real cable_offset_std;       /* constant error of a cable [m] */
  tensegrity_real ground_slope_std;       /* [1] */

  /* noises: both methods */
  tensegrity_real gyroscope_std;           /* of one sample [rad/s], > 0 */
  tensegrity_real accelerometer_std;       /* of one sample [m/s^2], > 0 */
  tensegrity_real gyroscope_bias_walk;     /* [rad/s/sqrt(s)] */
  tensegrity_real accelerometer_bias_walk; /* [m/s^2/sqrt(s)] */
  tensegrity_real cable_std;               /* [m], > 0 */
  /* noises: `paper` */
  tensegrity_real contact_std;          /* random walk of a contact point [m/sqrt(s)] */
  tensegrity_real contact_position_std; /* contact kinematics, white part [m], > 0 */
  tensegrity_real spin_walk;            /* [rad/sqrt(s)] */
  tensegrity_real shape_std_rest;       /* shape at rest [m/sqrt(s)], > 0 */
  tensegrity_real shape_std_moving;     /* shape while rolling or falling [m/sqrt(s)], > 0 */
  /* noises: `full` */
  tensegrity_real endcap_acceleration_rest;   /* white, at rest [m/s/sqrt(s)], > 0 */
  tensegrity_real endcap_acceleration_moving; /* at full activity [m/s/sqrt(s)], > 0 */
  tensegrity_real active_force;               /* from gravity, at full activity [m/s^2], > 0 */
  tensegrity_real active_rate;                /* rate at full activity [rad/s], > 0 */
  tensegrity_real creep_std;                  /* of a foot that stands still [m/sqrt(s)], > 0 */
  tensegrity_real slip_length;                /* scale of friction's likelihood [m] */
  tensegrity_real slip_speed;          /* above it a foot informs across its slip [m/s], > 0 */
  tensegrity_real foot_rise_std;       /* speed off the ground [m/sqrt(s)], > 0 */
  tensegrity_real foot_height_std;     /* height above the ground [m sqrt(s)], > 0 */
  tensegrity_real rod_rate_std;        /* other rods' IMUs: turn across the rod [rad/s], > 0 */
  tensegrity_real rod_inclination_std; /* other rods' IMUs: u . e_z in quiet [1], > 0 */
  tensegrity_real ground_height_walk;  /* terrain unknown, moving [m/sqrt(s)] */
  tensegrity_real ground_slope_walk;   /* terrain unknown, moving [1/sqrt(s)] */
} tensegrity_config;

/* The values of the packaged profiles, for either method. */
tensegrity_config tensegrity_default_config(void);

/* ---- estimator */

/* Memory of one estimator, of either method; its content is the library's. Static, on the stack or
 * in memory aligned to TENSEGRITY_ALIGNMENT (aligned_alloc). Nothing has to be released. */
typedef struct tensegrity_estimator {
  TENSEGRITY_ALIGNAS unsigned char bytes[TENSEGRITY_ESTIMATOR_SIZE];
} tensegrity_estimator;

/* Make an estimator, or make it anew: `full` is the tightly coupled filter, `paper` the method of
 * Tong et al. 2024. Two functions, so that a program links only the method it calls. `robot` and
 * `config` are copied. OUT_OF_RANGE, NOT_FINITE: a value of `robot` or `config` cannot be. */
tensegrity_status tensegrity_create_full(tensegrity_estimator* estimator,
                                         const tensegrity_robot* robot,
                                         const tensegrity_config* config);
tensegrity_status tensegrity_create_paper(tensegrity_estimator* estimator,
                                          const tensegrity_robot* robot,
                                          const tensegrity_config* config);

/* `to` becomes a second estimator in the same state. Do not assign the struct instead: what is in
 * it need not be copyable byte by byte. */
tensegrity_status tensegrity_copy(tensegrity_estimator* to, const tensegrity_estimator* from);

/* Calls of different sensors may interleave in any order; what is ahead of the IMU waits for it.
 * Besides the statuses that a call names, each returns NULL_ARGUMENT, NOT_CREATED or MISALIGNED,
 * and NOT_FINITE, OUT_OF_RANGE, DUPLICATE, OUT_OF_ORDER or TOO_LATE for input that it dropped. */

/* Stamp [ns], angular velocity [rad/s] and specific force [m/s^2] of the base rod's IMU, its frame.
 * NOT_INITIALIZED: not started yet. GAP: used, after missing samples. */
tensegrity_status tensegrity_imu(tensegrity_estimator* estimator, int64_t t,
                                 const tensegrity_real gyro[3], const tensegrity_real accel[3]);

/* An IMU on rod 1 (r23) or 2 (r45), in its own frame: z along the rod toward its even endcap, any
 * mounting about it. Before the base rod's sample of the same stamp. Of use to `full` alone. */
tensegrity_status tensegrity_rod_imu(tensegrity_estimator* estimator, int64_t t, int rod,
                                     const tensegrity_real gyro[3], const tensegrity_real accel[3]);

/* Distances of endcap centres [m]; NaN: not measured. REJECTED, NOT_CONVERGED, WRONG_CHIRALITY:
 * they fit no shape near the last one, and the state is that of the prediction. */
tensegrity_status tensegrity_cables(tensegrity_estimator* estimator, int64_t t,
                                    const tensegrity_real lengths[9]);

/* Which endcaps are on the ground. Without any call, the built-in detector decides. */
tensegrity_status tensegrity_contacts(tensegrity_estimator* estimator, int64_t t,
                                      const bool flags[6]);

/* Whether the robot has stood still long enough and the filter runs. False for NULL. */
bool tensegrity_initialized(const tensegrity_estimator* estimator);

/* ---- state */

/* Counters since creation. A healthy run has zeros, apart from what its sensors lost. */
typedef struct tensegrity_health {
  uint32_t imu_dropped;        /* not finite, out of range, duplicated or out of order */
  uint32_t imu_gaps;           /* steps longer than `max_imu_gap` */
  uint32_t cables_dropped;     /* not finite, out of range, out of order or too late */
  uint32_t contacts_dropped;   /* out of order or too late */
  uint32_t shape_failures;     /* lengths that no shape of this robot fits */
  uint32_t contacts_rejected;  /* corrections that failed the chi-square gate */
  uint32_t cables_rejected;    /* single lengths that failed the filter's gate */
  uint32_t spin_resets;        /* spins of the shape that could not be true, and were widened */
  uint32_t velocity_resets;    /* velocities that could not be true, and were widened */
  uint32_t terrain_mismatches; /* ground declared flat that turned out to slope */
} tensegrity_health;

/* Matrices are [row][column]; covariances are symmetric. */
typedef struct tensegrity_state {
  int64_t t;                          /* stamp of the newest IMU sample in the state [ns] */
  bool initialized;                   /* false: all that follows is zero, `rotation` the identity */
  tensegrity_real rotation[3][3];     /* body to world */
  tensegrity_real position[3];        /* of the IMU in the world [m] */
  tensegrity_real velocity[3];        /* world [m/s] */
  tensegrity_real gyro_bias[3];       /* body [rad/s] */
  tensegrity_real accel_bias[3];      /* body [m/s^2] */
  tensegrity_real spin;               /* of the shape about the base rod [rad] */
  tensegrity_real spin_variance;      /* [rad^2] */
  tensegrity_real endcaps_body[6][3]; /* one centre a row [m] */
  tensegrity_real endcaps_world[6][3];       /* one centre a row [m] */
  tensegrity_real endcap_covariance[18][18]; /* of x, y, z of endcap 0, 1, ..., body [m^2] */
  tensegrity_real rotation_covariance[3][3]; /* world [rad^2] */
  tensegrity_real velocity_covariance[3][3]; /* world [m^2/s^2] */
  tensegrity_real position_covariance[3][3]; /* world [m^2] */
  bool contacts[6];                          /* endcaps that the filter holds as contacts */
  tensegrity_real load_shares[6];            /* share of the weight each carries at rest, sum 1 */
  /* Normalised innovation squared of the newest correction per degree of freedom, NaN: none yet. */
  tensegrity_real cable_nis;
  tensegrity_real ground_nis; /* of the feet's heights */
  tensegrity_health health;
} tensegrity_state;

/* The state at the newest IMU sample. OK also before the start: look at `initialized`. */
tensegrity_status tensegrity_get_state(const tensegrity_estimator* estimator,
                                       tensegrity_state* state);

#ifdef __cplusplus
}
#endif

#endif /* TENSEGRITY_TENSEGRITY_H */
