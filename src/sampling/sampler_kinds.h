/* What each kind of sampler does for the functions of sampler.h. Internal to this folder. */
#ifndef CA_SAMPLING_SAMPLER_KINDS_H
#define CA_SAMPLING_SAMPLER_KINDS_H

#include "sampling/sampler.h"

/* ---- halton.c: radical inverses in prime bases ----------------------------------------------------------------- */
void ca_halton_prepare(ca_sampler *sampler);
ca_stream ca_halton_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index);
float ca_halton_1d(const ca_stream *stream, uint32_t dimension);

/* ---- sobol.c: nets in base 2 ----------------------------------------------------------------------------------- */
void ca_sobol_prepare(ca_sampler *sampler); /* sobol-plain */
ca_stream ca_sobol_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index);       /* sobol */
ca_stream ca_sobol_plain_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index);
ca_stream ca_zsobol_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index);
float ca_sobol_1d(const ca_stream *stream, uint32_t dimension); /* sobol and zsobol */
ca_vec2 ca_sobol_2d(const ca_stream *stream, uint32_t dimension);
float ca_sobol_plain_1d(const ca_stream *stream, uint32_t dimension);

/* ---- lattice.c ------------------------------------------------------------------------------------------------- */
ca_stream ca_lattice_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index);
float ca_lattice_1d(const ca_stream *stream, uint32_t dimension);

#endif
