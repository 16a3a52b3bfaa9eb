/* The estimator on board, in C: feed sensors as they come, read the state when you need it.
 * Here the sensors are those of a robot that stands still on one face. */
#include <math.h>
#include <stdio.h>
#include <tensegrity/tensegrity.h>

static tensegrity_estimator estimator; /* all the memory there is */

/* The normal of the plane of endcaps 0, 3 and 5, on which the robot stands, toward endcap 2. */
static void face_normal(tensegrity_real q[6][3], tensegrity_real up[3]) {
  tensegrity_real a[3], b[3], side = 0, square = 0;
  for (int k = 0; k < 3; ++k) {
    a[k] = q[3][k] - q[0][k];
    b[k] = q[5][k] - q[0][k];
  }
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    up[k] = a[i] * b[j] - a[j] * b[i];
    side += up[k] * (q[2][k] - q[0][k]);
    square += up[k] * up[k];
  }
  for (int k = 0; k < 3; ++k) up[k] *= (side > 0 ? 1 : -1) / (tensegrity_real)sqrt(square);
}

int main(void) {
  const tensegrity_robot robot = tensegrity_default_robot(); /* set its lengths to yours */
  const tensegrity_config config = tensegrity_default_config();
  tensegrity_status status = tensegrity_create_full(&estimator, &robot, &config);
  if (status != TENSEGRITY_OK) {
    printf("no estimator: %s\n", tensegrity_to_string(status));
    return 1;
  }

  tensegrity_real endcaps[6][3], lengths[9], up[3], accel[3];
  tensegrity_undeformed(&robot, endcaps, lengths);
  face_normal(endcaps, up);
  for (int k = 0; k < 3; ++k) accel[k] = config.gravity * up[k];
  const tensegrity_real gyro[3] = {0, 0, 0};
  const bool feet[6] = {true, false, false, true, false, true};

  for (int k = 0; k <= 600; ++k) { /* 3 s at 200 Hz */
    const int64_t t = k * INT64_C(5000000);
    tensegrity_contacts(&estimator, t, feet);
    if (k % 2 == 0) tensegrity_cables(&estimator, t, lengths); /* m */
    status = tensegrity_imu(&estimator, t, gyro, accel);       /* rad/s, m/s^2 */
  }
  printf("last IMU sample: %s\n", tensegrity_to_string(status));

  static tensegrity_state state; /* 3.4 kB: not for every stack */
  tensegrity_get_state(&estimator, &state);
  printf("IMU %.3f m above the ground, moved %.4f m\n", (double)state.position[2],
         hypot((double)state.position[0], (double)state.position[1]));
  for (int i = 0; i < 6; ++i) {
    printf("endcap %d: %6.3f %6.3f %6.3f m%s\n", i, (double)state.endcaps_world[i][0],
           (double)state.endcaps_world[i][1], (double)state.endcaps_world[i][2],
           state.contacts[i] ? "  on the ground" : "");
  }
  return state.initialized ? 0 : 1;
}
