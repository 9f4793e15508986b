/* The front of all samplers: their names, and whose function an address goes to. */
#include "sampling/sampler_kinds.h"

#include <stddef.h>
#include <string.h>

/* ---- Streams --------------------------------------------------------------------------------------------------- */

static ca_stream independent_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index)
{
    /* Two permutations after each word of the address: one leaves traces of small numbers in its lower bits. */
    uint64_t key = ca_pcg_permute(ca_pcg_permute(sampler->seed));
    key = ca_pcg_permute(ca_pcg_permute(key ^ sequence));
    key = ca_pcg_permute(ca_pcg_permute(key + index));
    return (ca_stream){.key = key, .index = index, .sampler = sampler, .kind = CA_SAMPLER_INDEPENDENT};
}

ca_stream ca_stream_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index)
{
    switch (sampler->kind) {
    case CA_SAMPLER_HALTON:
    case CA_SAMPLER_HALTON_PLAIN: return ca_halton_start(sampler, sequence, index);
    case CA_SAMPLER_SOBOL: return ca_sobol_start(sampler, sequence, index);
    case CA_SAMPLER_SOBOL_PLAIN:
    case CA_SAMPLER_SOBOL_IMAGE:
    case CA_SAMPLER_SOBOL_TILES:
    case CA_SAMPLER_SOBOL_TILES_PLAIN: return ca_sobol_image_start(sampler, sequence, index);
    case CA_SAMPLER_ZSOBOL: return ca_zsobol_start(sampler, sequence, index);
    case CA_SAMPLER_LATTICE: return ca_lattice_start(sampler, sequence, index);
    case CA_SAMPLER_LATTICE_PLAIN:
    case CA_SAMPLER_LATTICE_IMAGE:
    case CA_SAMPLER_LATTICE_TILES:
    case CA_SAMPLER_LATTICE_TILES_PLAIN: return ca_lattice_image_start(sampler, sequence, index);
    case CA_SAMPLER_INDEPENDENT:
    case CA_SAMPLER_KIND_COUNT: break;
    }
    return independent_start(sampler, sequence, index);
}

float ca_structured_1d(const ca_stream *stream, uint32_t dimension)
{
    switch (stream->kind) {
    case CA_SAMPLER_HALTON:
    case CA_SAMPLER_HALTON_PLAIN: return ca_halton_1d(stream, dimension);
    case CA_SAMPLER_SOBOL:
    case CA_SAMPLER_ZSOBOL: return ca_sobol_1d(stream, dimension);
    case CA_SAMPLER_SOBOL_PLAIN:
    case CA_SAMPLER_SOBOL_IMAGE:
    case CA_SAMPLER_SOBOL_TILES:
    case CA_SAMPLER_SOBOL_TILES_PLAIN: return ca_sobol_image_1d(stream, dimension);
    case CA_SAMPLER_LATTICE:
    case CA_SAMPLER_LATTICE_PLAIN:
    case CA_SAMPLER_LATTICE_IMAGE:
    case CA_SAMPLER_LATTICE_TILES:
    case CA_SAMPLER_LATTICE_TILES_PLAIN: return ca_lattice_1d(stream, dimension);
    case CA_SAMPLER_INDEPENDENT:
    case CA_SAMPLER_KIND_COUNT: break;
    }
    return ca_sample_1d(stream, dimension);
}

ca_vec2 ca_structured_2d(const ca_stream *stream, uint32_t dimension)
{
    /* One group of the Sobol' sampler holds both: shuffling the index once does. */
    if (stream->kind == CA_SAMPLER_SOBOL || stream->kind == CA_SAMPLER_ZSOBOL) return ca_sobol_2d(stream, dimension);
    return (ca_vec2){ca_structured_1d(stream, dimension), ca_structured_1d(stream, dimension + 1)};
}

void ca_sampler_prepare(ca_sampler *sampler, uint32_t width, uint32_t height)
{
    sampler->width = width;
    sampler->height = height;
    switch (sampler->kind) {
    case CA_SAMPLER_HALTON:
    case CA_SAMPLER_HALTON_PLAIN: ca_halton_prepare(sampler); break;
    case CA_SAMPLER_SOBOL_PLAIN:
    case CA_SAMPLER_SOBOL_IMAGE:
    case CA_SAMPLER_SOBOL_TILES:
    case CA_SAMPLER_SOBOL_TILES_PLAIN: ca_sobol_prepare(sampler); break;
    case CA_SAMPLER_LATTICE_PLAIN:
    case CA_SAMPLER_LATTICE_IMAGE:
    case CA_SAMPLER_LATTICE_TILES:
    case CA_SAMPLER_LATTICE_TILES_PLAIN: ca_lattice_prepare(sampler); break;
    case CA_SAMPLER_INDEPENDENT:
    case CA_SAMPLER_SOBOL:
    case CA_SAMPLER_ZSOBOL:
    case CA_SAMPLER_LATTICE:
    case CA_SAMPLER_KIND_COUNT: break;
    }
}

/* ---- Names ----------------------------------------------------------------------------------------------------- */

static const char *const names[CA_SAMPLER_KIND_COUNT] = {
    [CA_SAMPLER_INDEPENDENT] = "independent",
    [CA_SAMPLER_HALTON] = "halton",
    [CA_SAMPLER_HALTON_PLAIN] = "halton-plain",
    [CA_SAMPLER_SOBOL] = "sobol",
    [CA_SAMPLER_SOBOL_PLAIN] = "sobol-plain",
    [CA_SAMPLER_SOBOL_IMAGE] = "sobol-image",
    [CA_SAMPLER_SOBOL_TILES] = "sobol-tiles",
    [CA_SAMPLER_SOBOL_TILES_PLAIN] = "sobol-tiles-plain",
    [CA_SAMPLER_ZSOBOL] = "zsobol",
    [CA_SAMPLER_LATTICE] = "lattice",
    [CA_SAMPLER_LATTICE_PLAIN] = "lattice-plain",
    [CA_SAMPLER_LATTICE_IMAGE] = "lattice-image",
    [CA_SAMPLER_LATTICE_TILES] = "lattice-tiles",
    [CA_SAMPLER_LATTICE_TILES_PLAIN] = "lattice-tiles-plain",
};

const char *ca_sampler_name(ca_sampler_kind kind)
{
    return (unsigned)kind < CA_SAMPLER_KIND_COUNT ? names[kind] : NULL;
}

bool ca_sampler_find(const char *name, ca_sampler_kind *kind)
{
    for (unsigned i = 0; i < CA_SAMPLER_KIND_COUNT; i++)
        if (strcmp(name, names[i]) == 0) {
            *kind = (ca_sampler_kind)i;
            return true;
        }
    return false;
}

const char *ca_sampler_names(void)
{
    return "independent, halton, halton-plain, sobol, sobol-plain, sobol-image, sobol-tiles, sobol-tiles-plain, "
           "zsobol, lattice, lattice-plain, lattice-image, lattice-tiles, lattice-tiles-plain";
}
