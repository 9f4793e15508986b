/* Numbers of the streams of kind zsobol; see zsobol.c. Internal to this folder. */
#ifndef CA_SAMPLING_ZSOBOL_H
#define CA_SAMPLING_ZSOBOL_H

#include "sampling/sampler.h"

float ca_zsobol_1d(const ca_stream *stream, uint32_t dimension);
ca_vec2 ca_zsobol_2d(const ca_stream *stream, uint32_t dimension); /* an even one, and the next */

#endif
