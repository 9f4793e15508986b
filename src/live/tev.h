/* Sends pictures to the image viewer tev, which listens on TCP (14158 by default).
 *
 * Its packets, all numbers little endian: 4 bytes of length, which counts itself; 1 byte of kind; 1 byte, is the
 * image to be brought to the front?; the image's name, ended by a zero byte; and then
 *
 *     create (4):  int32 width, height, channels; the names of the channels, each ended by a zero byte
 *     update (6):  int32 channels; their names; int32 x, y, width, height; for each channel int64 offset of its first
 * value; for each channel int64 stride; the values, float32
 *
 * Value i of a channel is number offset + i stride of all, counted in floats. Source: Tom94/tev, src/Ipc.cpp
 * (interpretAsCreateImage, interpretAsUpdateImage), include/tev/Ipc.h and src/python/ipc.py. No call waits for the
 * viewer: a picture is sent piece by piece as it takes it, a newer one begins when the last is through. A viewer that
 * is gone stays so. Threads: one. */
#ifndef CA_LIVE_TEV_H
#define CA_LIVE_TEV_H

#include "live/snapshot.h"

typedef struct ca_tev ca_tev;

/* Connects; waits for two seconds at most. `place`: "HOST:PORT"; `name`: what the viewer calls the image, borrowed.
 * Errors: CA_ERROR_ARGUMENT (the place), CA_ERROR_FILE (no program listens there), CA_ERROR_MEMORY,
 * CA_ERROR_THREADS. */
ca_status ca_tev_create(ca_tev **tev, const char *place, const char *name, ca_error *error);
void ca_tev_destroy(ca_tev *tev);

/* Is the last picture through, and the viewer there, so that it can have another one? */
bool ca_tev_is_ready(const ca_tev *tev);
/* Begins to send R, G and B of a picture. Only when it is ready. */
void ca_tev_show(ca_tev *tev, const ca_live_snapshot *picture);

int ca_tev_descriptor(const ca_tev *tev); /* -1: the viewer is gone */
bool ca_tev_has_more(const ca_tev *tev);  /* to send: wait until the descriptor can be written to */
void ca_tev_run(ca_tev *tev);

#endif
