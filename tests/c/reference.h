/* The C++ estimators behind the C interface's types: what the C library has to agree with, bit for
 * bit. */
#ifndef TENSEGRITY_TESTS_REFERENCE_H
#define TENSEGRITY_TESTS_REFERENCE_H

#include "tensegrity/tensegrity.h"

#ifdef __cplusplus
extern "C" {
#endif

enum reference_method { REFERENCE_FULL, REFERENCE_PAPER };

/* Starts the one reference anew: the default robot but for its IMU's place, the default
 * configuration but for some of its fields of each type. */
#define REFERENCE_IMU_OFFSET ((tensegrity_real)0.03)
#define REFERENCE_CABLE_STD ((tensegrity_real)0.005)
#define REFERENCE_BIAS_SIZE 300
#define REFERENCE_BIAS ((tensegrity_real)0.001) /* of the gyroscope about y [rad/s] */
void reference_create(enum reference_method method);

/* The same calls as those of the C interface, as the numbers of their statuses. */
int reference_imu(int64_t t, const tensegrity_real gyro[3], const tensegrity_real accel[3]);
int reference_rod_imu(int64_t t, int rod, const tensegrity_real gyro[3],
                      const tensegrity_real accel[3]);
int reference_cables(int64_t t, const tensegrity_real lengths[9]);
int reference_contacts(int64_t t, const bool flags[6]);

/* Name of a field in which `state` is not the reference's state; NULL: it is the same, bit for bit.
 */
const char* reference_difference(const tensegrity_state* state);

#ifdef __cplusplus
}
#endif

#endif
