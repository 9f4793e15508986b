/* Photons for merging: those vertices of the light paths in memory that can scatter smoothly; and how crowded with
 * them a place is. */
#include "integrator/bidirectional.h"

/* A run is a block of light paths; *at: the path in it, and how many of its records are read. */
static uint32_t read_block(const void *user, uint32_t run, uint64_t *at, ca_photon *photons)
{
    const ca_bidirectional *b = user;
    const uint32_t begin = run * CA_BLOCK_PATHS, end = ca_min_u32(begin + CA_BLOCK_PATHS, b->paths_now);
    uint32_t path = begin + (uint32_t)(*at >> 32), rank = (uint32_t)*at, count = 0;
    for (; path < end; path++, rank = 0)
        for (; rank < b->store.paths[path].records; rank++) {
            if (count == CA_PHOTON_BATCH) {
                *at = (uint64_t)(path - begin) << 32 | rank;
                return count;
            }
            const uint32_t number = ca_light_record_number(&b->store, &b->store.paths[path], rank);
            photons[count++] =
                (ca_photon){.position = ca_light_record_at(&b->store, number)->position, .vertex = number};
        }
    *at = (uint64_t)(end - begin) << 32;
    return count;
}

ca_status ca_light_photons_sort(const ca_bidirectional *b, ca_photon_grid *grid, float radius,
                                const ca_parallel *parallel, ca_error *error)
{
    const ca_scene *scene = b->input.scene;
    const ca_photon_bounds bounds = {scene->low, scene->high};
    const ca_photon_source source = {.user = b,
                                     .run_count = ca_light_block_count(b->paths_now),
                                     .count = b->photons_now,
                                     .read = read_block};
    return ca_photon_grid_build(grid, &source, &bounds, radius, parallel, error);
}

void ca_bidirectional_densities(const ca_bidirectional *b, ca_walk *const *walks, uint32_t count)
{
    if (!b->pilot) return;
    ca_vec3 positions[CA_WALKS];
    float densities[CA_WALKS];
    ca_path_vertex *vertices[CA_WALKS];
    uint32_t asked = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (!ca_vertex_is_smooth(&walks[i]->last)) continue;
        positions[asked] = walks[i]->last.position;
        vertices[asked++] = &walks[i]->densities[walks[i]->vertex];
    }
    if (asked == 0) return;
    ca_photon_density_at(b->pilot, positions, asked, densities);
    for (uint32_t i = 0; i < asked; i++) vertices[i]->photon_density = b->pilot_scale * densities[i];
}
