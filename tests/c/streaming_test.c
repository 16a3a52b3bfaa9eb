/* The C interface from C: the states of both methods are those of C++, bit for bit, and whatever a
 * program passes, it gets a status. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "reference.h"

static int failures = 0;

static void fail(int line, const char* what) {
  printf("line %d: %s\n", line, what);
  ++failures;
}
#define CHECK(condition)                          \
  do {                                            \
    if (!(condition)) fail(__LINE__, #condition); \
  } while (0)

/* ---- a robot on endcaps 0, 3 and 5 */

static const bool kFeet[6] = {true, false, false, true, false, true};
static const tensegrity_real kStill[3] = {0, 0, 0};

/* Uniform in [-1, 1), the same on every machine (Numerical Recipes' linear congruence). */
static tensegrity_real noise(void) {
  static uint32_t seed = 1;
  seed = 1664525u * seed + 1013904223u;
  return (tensegrity_real)(int32_t)(seed >> 8) / (tensegrity_real)(1 << 23) - 1;
}

static tensegrity_robot robot;
static tensegrity_config config;
static tensegrity_real lengths[9];
static tensegrity_real gravity[3]; /* specific force at rest, body [m/s^2] */

static void stand(void) {
  tensegrity_real q[6][3], a[3], b[3], square = 0, side = 0;
  CHECK(tensegrity_undeformed(&robot, q, lengths) == TENSEGRITY_OK);
  for (int k = 0; k < 3; ++k) {
    a[k] = q[3][k] - q[0][k];
    b[k] = q[5][k] - q[0][k];
  }
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    gravity[k] = a[i] * b[j] - a[j] * b[i];
    square += gravity[k] * gravity[k];
    side += gravity[k] * (q[2][k] - q[0][k]);
  }
  for (int k = 0; k < 3; ++k) {
    gravity[k] *= (side > 0 ? config.gravity : -config.gravity) / (tensegrity_real)sqrt(square);
  }
}

/* One IMU step and what is due with it, to the estimator and to the reference; shaken after 3 s. */
static void step(tensegrity_estimator* estimator, int k) {
  const bool quiet = k < 600;
  const int64_t t = k * INT64_C(5000000);
  const tensegrity_real shake = k % 50 == 49 ? 30 : 2;
  tensegrity_real gyro[3], accel[3], measured[9];
  bool flags[6];
  for (int i = 0; i < 3; ++i) {
    gyro[i] = (tensegrity_real)0.002 * noise() + (quiet ? 0 : shake / 10 * noise());
    accel[i] = gravity[i] + (tensegrity_real)0.05 * noise() + (quiet ? 0 : shake * noise());
  }
  for (int i = 0; i < 9; ++i) measured[i] = lengths[i] + (tensegrity_real)0.003 * noise();
  if (!quiet) measured[k % 9] = (tensegrity_real)NAN;
  for (int i = 0; i < 6; ++i) flags[i] = quiet ? kFeet[i] : noise() > 0;
  if (k % 200 == 199) accel[1] = (tensegrity_real)INFINITY;
  CHECK((int)tensegrity_contacts(estimator, t, flags) == reference_contacts(t, flags));
  if (k % 2 == 0) {
    CHECK((int)tensegrity_cables(estimator, t, measured) == reference_cables(t, measured));
  }
  if (k % 4 == 0) {
    CHECK((int)tensegrity_rod_imu(estimator, t, 1, gyro, accel) ==
          reference_rod_imu(t, 1, gyro, accel));
  }
  CHECK((int)tensegrity_imu(estimator, t, gyro, accel) == reference_imu(t, gyro, accel));
}

static void check_same(const tensegrity_estimator* estimator, int k) {
  static tensegrity_state state;
  CHECK(tensegrity_get_state(estimator, &state) == TENSEGRITY_OK);
  const char* field = reference_difference(&state);
  if (field != NULL) {
    printf("step %d: %s differs\n", k, field);
    ++failures;
  }
}

static void check_states(enum reference_method method) {
  static tensegrity_estimator estimator, branch;
  static tensegrity_state state;
  config.static_bias_initialization = method == REFERENCE_FULL; /* as the reference */
  CHECK((method == REFERENCE_FULL ? tensegrity_create_full : tensegrity_create_paper)(
            &estimator, &robot, &config) == TENSEGRITY_OK);
  reference_create(method);
  CHECK(!tensegrity_initialized(&estimator));
  check_same(&estimator, -1);
  for (int k = 0; k < 1200; ++k) {
    step(&estimator, k);
    if (k % 20 == 0) check_same(&estimator, k);
  }
  CHECK(tensegrity_initialized(&estimator));
  check_same(&estimator, 1199);
  tensegrity_get_state(&estimator, &state);
  CHECK(state.initialized);
  CHECK(state.health.imu_dropped > 0);

  /* A copy goes on as its original would have gone on, whatever becomes of that. */
  CHECK(tensegrity_copy(&branch, &estimator) == TENSEGRITY_OK);
  memset(&estimator, 0, sizeof estimator);
  CHECK(tensegrity_get_state(&estimator, &state) == TENSEGRITY_NOT_CREATED);
  for (int k = 1200; k < 1300; ++k) step(&branch, k);
  check_same(&branch, 1299);
}

/* ---- what cannot be */

static void check_bad_arguments(void) {
  static tensegrity_estimator estimator, other;
  static tensegrity_state state;
  static union {
    tensegrity_estimator aligned;
    unsigned char bytes[sizeof(tensegrity_estimator) + 1];
  } memory;
  tensegrity_estimator* misaligned = (void*)(memory.bytes + 1);
  tensegrity_real q[6][3], l[9];
  tensegrity_robot no_robot = robot;
  tensegrity_config no_config = config;

  /* before creation */
  CHECK(tensegrity_imu(&estimator, 0, kStill, gravity) == TENSEGRITY_NOT_CREATED);
  CHECK(tensegrity_rod_imu(&estimator, 0, 1, kStill, gravity) == TENSEGRITY_NOT_CREATED);
  CHECK(tensegrity_cables(&estimator, 0, lengths) == TENSEGRITY_NOT_CREATED);
  CHECK(tensegrity_contacts(&estimator, 0, kFeet) == TENSEGRITY_NOT_CREATED);
  CHECK(tensegrity_get_state(&estimator, &state) == TENSEGRITY_NOT_CREATED);
  CHECK(tensegrity_copy(&other, &estimator) == TENSEGRITY_NOT_CREATED);
  CHECK(!tensegrity_initialized(&estimator));

  /* robots and configurations that cannot be */
  no_robot.rod_length = (tensegrity_real)NAN;
  CHECK(tensegrity_create_full(&estimator, &no_robot, &config) == TENSEGRITY_NOT_FINITE);
  no_robot.rod_length = (tensegrity_real)0.5; /* too short for its side cables */
  CHECK(tensegrity_create_full(&estimator, &no_robot, &config) == TENSEGRITY_OUT_OF_RANGE);
  CHECK(tensegrity_undeformed(&no_robot, q, l) == TENSEGRITY_OUT_OF_RANGE);
  no_robot = robot;
  no_robot.chirality = (tensegrity_chirality)2;
  CHECK(tensegrity_create_paper(&estimator, &no_robot, &config) == TENSEGRITY_OUT_OF_RANGE);
  no_config.cable_std = 0;
  CHECK(tensegrity_create_full(&estimator, &robot, &no_config) == TENSEGRITY_OUT_OF_RANGE);
  no_config = config;
  no_config.accelerometer_bias[2] = (tensegrity_real)INFINITY;
  CHECK(tensegrity_create_full(&estimator, &robot, &no_config) == TENSEGRITY_NOT_FINITE);
  no_config = config;
  no_config.terrain = (tensegrity_terrain)3;
  CHECK(tensegrity_create_full(&estimator, &robot, &no_config) == TENSEGRITY_OUT_OF_RANGE);
  no_config = config;
  no_config.init_bias_size = 0;
  CHECK(tensegrity_create_paper(&estimator, &robot, &no_config) == TENSEGRITY_OUT_OF_RANGE);
  CHECK(tensegrity_get_state(&estimator, &state) == TENSEGRITY_NOT_CREATED);

  /* pointers to nothing */
  CHECK(tensegrity_undeformed(NULL, q, l) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_undeformed(&robot, NULL, l) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_undeformed(&robot, q, NULL) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_create_full(NULL, &robot, &config) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_create_full(&estimator, NULL, &config) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_create_full(&estimator, &robot, NULL) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_create_paper(NULL, &robot, &config) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_create_full(&estimator, &robot, &config) == TENSEGRITY_OK);
  CHECK(tensegrity_imu(NULL, 0, kStill, gravity) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_imu(&estimator, 0, NULL, gravity) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_imu(&estimator, 0, kStill, NULL) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_rod_imu(&estimator, 0, 1, NULL, gravity) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_rod_imu(&estimator, 0, 1, kStill, NULL) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_cables(&estimator, 0, NULL) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_contacts(&estimator, 0, NULL) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_get_state(&estimator, NULL) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_get_state(NULL, &state) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_copy(NULL, &estimator) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(tensegrity_copy(&estimator, NULL) == TENSEGRITY_NULL_ARGUMENT);
  CHECK(!tensegrity_initialized(NULL));

  /* memory at an address that will not do */
  CHECK(tensegrity_create_full(misaligned, &robot, &config) == TENSEGRITY_MISALIGNED);
  CHECK(tensegrity_imu(misaligned, 0, kStill, gravity) == TENSEGRITY_MISALIGNED);
  CHECK(tensegrity_copy(misaligned, &estimator) == TENSEGRITY_MISALIGNED);

  /* samples that cannot be used change nothing but the counters */
  CHECK(tensegrity_rod_imu(&estimator, 0, 3, kStill, gravity) == TENSEGRITY_OUT_OF_RANGE);
  CHECK(tensegrity_imu(&estimator, 5, kStill, gravity) == TENSEGRITY_NOT_INITIALIZED);
  CHECK(tensegrity_imu(&estimator, 5, kStill, gravity) == TENSEGRITY_DUPLICATE);
  CHECK(tensegrity_imu(&estimator, 4, kStill, gravity) == TENSEGRITY_OUT_OF_ORDER);
  CHECK(tensegrity_get_state(&estimator, &state) == TENSEGRITY_OK);
  CHECK(state.t == 5 && !state.initialized && state.health.imu_dropped == 3);
}

static void check_names(void) {
  CHECK(strcmp(tensegrity_to_string(TENSEGRITY_OK), "ok") == 0);
  CHECK(strcmp(tensegrity_to_string(TENSEGRITY_WRONG_CHIRALITY), "wrong_chirality") == 0);
  CHECK(strcmp(tensegrity_to_string(TENSEGRITY_NULL_ARGUMENT), "null_argument") == 0);
  CHECK(strcmp(tensegrity_to_string((tensegrity_status)11), "unknown") == 0);
  CHECK(strcmp(tensegrity_to_string((tensegrity_status)256), "unknown") == 0);
  CHECK(strcmp(tensegrity_to_string((tensegrity_status)-1), "unknown") == 0);
  CHECK(tensegrity_used(TENSEGRITY_GAP) && !tensegrity_used(TENSEGRITY_NULL_ARGUMENT));
}

int main(void) {
  robot = tensegrity_default_robot();
  robot.imu_offset = REFERENCE_IMU_OFFSET;
  config = tensegrity_default_config();
  config.cable_std = REFERENCE_CABLE_STD;
  config.init_bias_size = REFERENCE_BIAS_SIZE;
  config.gyroscope_bias[1] = REFERENCE_BIAS;
  config.imu_sampling = TENSEGRITY_IMU_INSTANTANEOUS;
  config.terrain = TENSEGRITY_TERRAIN_SLOPE;
  config.shape = TENSEGRITY_SHAPE_TRACKER;
  stand();
  check_names();
  check_bad_arguments();
  check_states(REFERENCE_FULL);
  check_states(REFERENCE_PAPER);
  printf("%s\n", failures == 0 ? "passed" : "failed");
  return failures == 0 ? 0 : 1;
}
