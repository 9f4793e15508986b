/* What a photon costs: nanoseconds for each distance that a query looks at, with everything around it, in a grid that
 * fits the cache and in one of a large pass; and how long such a grid takes to build.
 *
 * Photons and queries lie on the walls of a tilted room and a ball in it. Queries come tile by tile as pixels do, or
 * scattered, which is the worst for caches. Every figure is a median. Writes its part of bench/results.json (or the
 * file given as argument). */
#include "base/clock.h"
#include "base/memory.h"
#include "bench_support.h"
#include "math/numeric.h"
#include "photon/photon_grid.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RUNS = 7, QUERIES = 200000, TILES = 500 };

enum { RUN_PHOTONS = 1024 };

typedef struct photon_set {
    ca_photon *photons;
    uint32_t count;
    float radius;
} photon_set;

static uint64_t random_state = 1;
static float uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (float)(random_state >> 40) * 0x1p-24f;
}

/* Turned a little, so that no wall lies along the cells. */
static ca_vec3 turned(ca_vec3 p)
{
    const ca_vec3 q = {p.x * 0.96f - p.y * 0.28f, p.x * 0.28f + p.y * 0.96f, p.z};
    return (ca_vec3){q.x, q.y * 0.8f - q.z * 0.6f, q.y * 0.6f + q.z * 0.8f};
}

/* On the room's six walls (2 m) or the ball: by `wall` from 0 to 6, and where on it. */
static ca_vec3 place(float wall, float u, float v)
{
    const float a = 2.0f * u - 1.0f, b = 2.0f * v - 1.0f, side = (uint32_t)wall % 2 ? 1.0f : -1.0f;
    switch ((uint32_t)wall / 2) {
    case 0: return turned((ca_vec3){side, a, b});
    case 1: return turned((ca_vec3){a, side, b});
    case 2: return turned((ca_vec3){a, b, side});
    default: break;
    }
    const float ring = sqrtf(1.0f - a * a);
    return turned((ca_vec3){0.5f * ring * cosf(CA_TWO_PI * v), 0.5f * ring * sinf(CA_TWO_PI * v), 0.5f * a});
}

static photon_set make_photons(uint32_t count, float radius)
{
    photon_set set = {ca_alloc(count, sizeof(ca_photon)), count, radius};
    for (uint32_t i = 0; i < count; i++) {
        const float wall = 6.5f * uniform(), u = uniform(), v = uniform();
        set.photons[i] = (ca_photon){place(wall, u, v), i};
    }
    return set;
}

/* `coherent`: small squares on the walls, one after the other. */
static ca_vec3 *make_queries(bool coherent)
{
    ca_vec3 *positions = ca_alloc(QUERIES, sizeof *positions);
    float wall = 0.0f, u0 = 0.0f, v0 = 0.0f;
    for (uint32_t i = 0; i < QUERIES; i++) {
        if (!coherent || i % (QUERIES / TILES) == 0)
            wall = 6.5f * uniform(), u0 = 0.95f * uniform(), v0 = 0.95f * uniform();
        const float size = coherent ? 0.02f : 0.05f;
        const float u = u0 + size * uniform(), v = v0 + size * uniform();
        positions[i] = place(wall, u, v);
    }
    return positions;
}

/* *at: how many of a run are read. */
static uint32_t read_photons(const void *user, uint32_t run, uint64_t *at, ca_photon *photons)
{
    const photon_set *set = user;
    const uint32_t begin = run * RUN_PHOTONS + (uint32_t)*at;
    const uint32_t end = ca_min_u32((run + 1) * RUN_PHOTONS, set->count);
    const uint32_t count = ca_min_u32(end - begin, CA_PHOTON_BATCH);
    memcpy(photons, set->photons + begin, count * sizeof *photons);
    *at += count;
    return count;
}

static double build_seconds(ca_photon_grid *grid, const photon_set *set, uint32_t workers)
{
    const ca_photon_source source = {set, (set->count + RUN_PHOTONS - 1) / RUN_PHOTONS, set->count, read_photons};
    const ca_photon_bounds bounds = {{-2.0f, -2.0f, -2.0f}, {2.0f, 2.0f, 2.0f}};
    const ca_parallel parallel = {.workers = workers};
    ca_error error;
    const double start = ca_clock_seconds();
    if (ca_photon_grid_build(grid, &source, &bounds, set->radius, &parallel, &error) != CA_OK)
        bench_die("build", &error);
    return ca_clock_seconds() - start;
}

typedef struct query_figures {
    double tested, found;        /* a query */
    double nanoseconds_a_tested; /* median */
} query_figures;

static query_figures measure_queries(const char *name, const ca_photon_grid *grid, const ca_vec3 *positions)
{
    double nanoseconds[RUNS];
    uint64_t tested = 0, found = 0, checksum = 0;
    for (int run = 0; run < RUNS; run++) {
        tested = found = 0;
        const double start = ca_clock_seconds();
        for (uint32_t i = 0; i < QUERIES; i++) {
            ca_photon_query query;
            uint32_t vertices[CA_PHOTON_BATCH], count;
            ca_photon_query_start(&query, grid, positions[i]);
            while ((count = ca_photon_query_next(&query, vertices)) > 0) {
                found += count;
                checksum += vertices[0];
            }
            tested += query.tested;
        }
        nanoseconds[run] = 1e9 * (ca_clock_seconds() - start) / (double)tested;
    }
    const query_figures figures = {(double)tested / QUERIES, (double)found / QUERIES,
                                   bench_median(nanoseconds, RUNS)};
    printf("%-24s %5.1f tested and %5.1f found a query: %5.2f ns a tested photon, %6.1f ns a query (checksum %llx)\n",
           name, figures.tested, figures.found, figures.nanoseconds_a_tested,
           figures.nanoseconds_a_tested * figures.tested, (unsigned long long)checksum);
    return figures;
}

static json_t *query_json(const query_figures *figures)
{
    return json_pack("{s:f, s:f, s:f}", "tested", figures->tested, "found", figures->found, "ns_per_tested",
                     figures->nanoseconds_a_tested);
}

static json_t *measure_set(const char *name, uint32_t count, float radius)
{
    const photon_set set = make_photons(count, radius);
    ca_photon_grid *grid;
    ca_error error;
    if (ca_photon_grid_create(&grid, &error) != CA_OK) bench_die("grid", &error);
    double one[RUNS], two[RUNS];
    build_seconds(grid, &set, 1);
    for (int run = 0; run < RUNS; run++) {
        one[run] = build_seconds(grid, &set, 1);
        two[run] = build_seconds(grid, &set, 2);
    }
    const double build1 = bench_median(one, RUNS), build2 = bench_median(two, RUNS);
    printf("%s: %u photons, radius %g m: built in %.2f ms, by two threads in %.2f ms; %.1f bytes a photon\n", name,
           count, (double)radius, 1e3 * build1, 1e3 * build2, (double)ca_photon_grid_bytes(grid) / count);
    ca_vec3 *tiles = make_queries(true), *scattered = make_queries(false);
    const query_figures coherent = measure_queries("  in tiles", grid, tiles);
    const query_figures incoherent = measure_queries("  scattered", grid, scattered);
    ca_free(tiles);
    ca_free(scattered);
    ca_photon_grid_destroy(grid);
    ca_free(set.photons);
    return json_pack("{s:I, s:f, s:f, s:o, s:o}", "photons", (json_int_t)count, "build_seconds", build1,
                     "build_seconds_two_threads", build2, "tiles", query_json(&coherent), "scattered",
                     query_json(&incoherent));
}

int main(int argc, char **argv)
{
    const char *results = bench_results_file(argc, argv);
    json_t *figures = json_object();
    json_object_set_new(figures, "cached", measure_set("cached", 20000, 0.05f));
    json_object_set_new(figures, "large", measure_set("large", 1300000, 0.0062f));
    bench_write_results(results, "photons", figures);
    return 0;
}
