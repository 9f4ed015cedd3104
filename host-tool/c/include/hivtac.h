/* Reads forces of a HiVTac sensor, with the code of the tool `hivtac`.
 *
 *     hivtac *sensor = hivtac_open(NULL, NULL, 2.0);
 *     hivtac_sample sample;
 *     while (hivtac_next(sensor, 1.0, &sample) >= 0)
 *         ...
 *     hivtac_close(sensor);
 *
 * Numbers are in SI units. The film's frame is right-handed: x right and y down in the image, z out
 * of the film, away from the camera; a press has a negative force along z.
 *
 * A thread of the library reads the sensor. Several threads may use one sensor at once; after
 * hivtac_close none may. Nothing here prints, and no signal is caught.
 */
#ifndef HIVTAC_H
#define HIVTAC_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A connection to a sensor. */
typedef struct hivtac hivtac;

/* What a function returns. */
enum {
    HIVTAC_SAMPLE = 1,             /* a sample was written */
    HIVTAC_DONE = 0,               /* done; of a wait: no sample came in time */
    HIVTAC_ERROR_INPUT = -1,       /* an argument cannot be used */
    HIVTAC_ERROR_NO_DEVICE = -3,   /* none found, or nobody answers */
    HIVTAC_ERROR_VERSION = -4,     /* it speaks another version of the protocol */
    HIVTAC_ERROR_LOST = -5,        /* the connection was lost: close it, and open another */
    HIVTAC_ERROR_REFUSED = -6,     /* it refused a command, or did not answer it */
    HIVTAC_ERROR_INTERNAL = -100   /* a mistake of this library */
};

/* A contact on the film. Numbers that are not known are NaN. */
typedef struct hivtac_contact {
    double force_n[3];           /* its force on the film, N */
    double magnitude_n;          /* size of the force, N */
    double magnitude_sigma_n;    /* standard uncertainty of the size, N */
    double direction_sigma_rad;  /* standard uncertainty of the direction, rad */
    double place_m[2];           /* where it touches, from the film's middle, m */
    double place_sigma_m;        /* standard uncertainty of each coordinate, m */
} hivtac_contact;

/* A frame's force, or the reason why it is missing. Numbers that are not known are NaN. */
typedef struct hivtac_sample {
    uint64_t time_us;            /* device time of the middle of the exposure, us */
    uint64_t arrived_ns;         /* time of its arrival here, ns since 1970 */
    uint64_t exposed_ns;         /* time of the middle of the exposure, ns since 1970: of several
                                    sensors comparable, and without the jitter of arrivals */
    uint32_t sequence;           /* running number; a gap shows samples that were lost */
    uint32_t frame;              /* running number of the frames exposed */
    uint32_t status;             /* bits of docs/wire.md: why no force, or how good it is */
    uint8_t has_force;           /* 1 if there is a force, else 0 */
    uint8_t has_place;           /* 1 if its place is known, else 0 */
    uint8_t contact;             /* 1 if something touches the film, else 0 */
    uint8_t slip;                /* 1 if it slips, else 0 */
    double force_n[3];           /* force on the film, N */
    double torque_nm[3];         /* its torque about the film's middle, N m: of the force at its
                                    place, and torque_z_nm; what is unknown adds 0 */
    double torque_z_nm;          /* torque about the film's normal at the place, N m */
    double torque_sigma_nm;      /* standard uncertainty of that, N m */
    double magnitude_n;          /* size of the force, N */
    double magnitude_sigma_n;    /* standard uncertainty of the size, N */
    double direction_sigma_rad;  /* standard uncertainty of the direction, rad */
    double force_covariance[9];  /* of force_n, row by row, N^2 */
    double place_m[2];           /* where it touches, from the film's middle, m */
    double place_sigma_m;        /* standard uncertainty of each coordinate, m */
    uint64_t contact_count;      /* how many contacts are known: 0, 1 or 2; with bit 28 of
                                    status, 0 means two that are not resolved */
    hivtac_contact contacts[2];  /* each contact; force_n is their sum, or what the settings filter
                                    and creep make of it */
} hivtac_sample;

/* Connects to a sensor, and asks it for samples: to a port (a serial port's name, or
 * tcp:HOST:PORT, or uart:PORT), to the device with a name or serial number, or, if both are NULL,
 * to the only one that is plugged in. timeout_s: longest wait for its answers, also later. NULL on
 * failure. */
hivtac *hivtac_open(const char *port, const char *device, double timeout_s);

/* Waits up to timeout_s for the next sample. Up to 1024 samples wait for the program; of more, the
 * oldest are passed over. HIVTAC_SAMPLE, HIVTAC_DONE, or an error. */
int hivtac_next(hivtac *sensor, double timeout_s, hivtac_sample *sample);

/* The same for the newest sample; those before it are passed over. With 0 s it never waits, as a
 * control loop needs it. */
int hivtac_newest(hivtac *sensor, double timeout_s, hivtac_sample *sample);

/* How many samples arrived and were passed over. 0 for NULL. */
uint64_t hivtac_missed(const hivtac *sensor);

/* Takes the film's present position as its rest position; nothing may touch it. With keep other
 * than 0 through restarts, too. Some tenths of a second. HIVTAC_DONE, or an error. */
int hivtac_tare(hivtac *sensor, int keep);

/* Says which way gravity pulls in the film's frame, as a vector of any length: for a sensor that
 * turns, as often as it turns, up to 100 times a second. HIVTAC_DONE, or an error. */
int hivtac_set_down(hivtac *sensor, double x, double y, double z);

/* What went wrong in this thread's last call that failed, and what to do. Valid until this thread's
 * next call; empty before the first failure. */
const char *hivtac_last_error(void);

/* Ends the connection. NULL is ignored. */
void hivtac_close(hivtac *sensor);

#ifdef __cplusplus
}
#endif

#endif
