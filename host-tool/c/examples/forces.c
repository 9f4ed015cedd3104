/* Prints forces of a sensor for a second: forces [PORT]. */
#include <hivtac.h>
#include <math.h>
#include <stdio.h>

int main(int count, char **arguments)
{
    hivtac *sensor = hivtac_open(count > 1 ? arguments[1] : NULL, NULL, 2.0);
    if (!sensor) {
        fprintf(stderr, "%s\n", hivtac_last_error());
        return 1;
    }
    hivtac_sample sample;
    int result = HIVTAC_DONE;
    /* A loop of 50 turns a second, slower than the sensor: each takes the newest sample. */
    for (int turn = 0; turn < 50 && result >= 0; turn++) {
        result = hivtac_newest(sensor, 0.02, &sample);
        if (result != HIVTAC_SAMPLE)
            continue;
        if (!sample.has_force) {
            printf("frame %u: no force, status 0x%x\n", sample.frame, sample.status);
            continue;
        }
        printf("frame %u: %.6f %.6f %.6f N at %.6f %.6f m, contact %d, sigma %.6f N\n",
               sample.frame, sample.force_n[0], sample.force_n[1], sample.force_n[2],
               sample.place_m[0], sample.place_m[1], sample.contact,
               sqrt(sample.force_covariance[8]));
    }
    if (result < 0)
        fprintf(stderr, "%s\n", hivtac_last_error());
    fprintf(stderr, "%llu passed over\n", (unsigned long long)hivtac_missed(sensor));
    hivtac_close(sensor);
    return result < 0;
}
