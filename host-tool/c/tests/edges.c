/* Arguments that cannot be used, and a sensor at rest: edges PORT. Ends with 0 if all is right. */
#include <hivtac.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define CHECK(what)                                                                     \
    do {                                                                                \
        if (!(what)) {                                                                  \
            fprintf(stderr, "line %d: %s; %s\n", __LINE__, #what, hivtac_last_error()); \
            return 1;                                                                   \
        }                                                                               \
    } while (0)

static int says(const char *part)
{
    return strstr(hivtac_last_error(), part) != NULL;
}

int main(int count, char **arguments)
{
    hivtac_sample sample;
    CHECK(count == 2);
    CHECK(!*hivtac_last_error());
    CHECK(!hivtac_open("tcp:127.0.0.1:1", NULL, 1.0) && says("127.0.0.1:1"));
    CHECK(!hivtac_open("a", "b", 1.0) && says("not both"));
    CHECK(!hivtac_open("\xff", NULL, 1.0) && says("UTF-8"));
    CHECK(!hivtac_open(arguments[1], NULL, NAN) && says("no time to wait"));
    CHECK(hivtac_next(NULL, 0, &sample) == HIVTAC_ERROR_INPUT && says("sensor is NULL"));
    CHECK(hivtac_tare(NULL, 0) == HIVTAC_ERROR_INPUT);
    CHECK(hivtac_set_down(NULL, 0, 0, 1) == HIVTAC_ERROR_INPUT);
    CHECK(hivtac_missed(NULL) == 0);
    hivtac_close(NULL);

    hivtac *sensor = hivtac_open(arguments[1], NULL, 20.0);
    CHECK(sensor);
    CHECK(hivtac_next(sensor, 0, NULL) == HIVTAC_ERROR_INPUT && says("sample is NULL"));
    CHECK(hivtac_next(sensor, -1, &sample) == HIVTAC_ERROR_INPUT && says("no time to wait"));
    CHECK(hivtac_set_down(sensor, 0, 0, 0) == HIVTAC_ERROR_INPUT);
    CHECK(hivtac_set_down(sensor, 0, 0, -2) == HIVTAC_DONE);
    CHECK(hivtac_tare(sensor, 1) == HIVTAC_DONE);
    CHECK(hivtac_next(sensor, 20, &sample) == HIVTAC_SAMPLE);
    uint32_t first = sample.sequence;
    CHECK(hivtac_next(sensor, 20, &sample) == HIVTAC_SAMPLE && sample.sequence > first);
    /* Waiting samples are taken at once, and then it does not wait. */
    int result;
    while ((result = hivtac_newest(sensor, 0, &sample)) == HIVTAC_SAMPLE) {
    }
    CHECK(result == HIVTAC_DONE);
    CHECK(!sample.contact && sample.arrived_ns > 1700000000000000000u);
    CHECK(sample.exposed_ns <= sample.arrived_ns);
    CHECK(sample.arrived_ns - sample.exposed_ns < 1000000000u);
    if (!sample.has_force)
        CHECK(isnan(sample.force_n[2]) && isnan(sample.force_covariance[0]));
    hivtac_close(sensor);
    return 0;
}
