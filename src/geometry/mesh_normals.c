/* Smooth normals of meshes. A part of the triangles at a time: first their normals and angles, in tasks of a fixed
 * size; then each thread adds these to vertices of its own. A vertex adds up its corners in the order of the
 * triangles, whichever thread it belongs to: the bits do not depend on how many there are. Neighbours in a mesh are
 * often neighbours in its arrays, so threads own vertices in blocks that are scattered all over these. */
#include "geometry/mesh.h"

#include "base/loading.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/processors.h"
#include "math/arc_tangent.h"

#include <float.h>

/* Triangles: of a loop that is vectorised, of a task, of a part. */
enum { STEP = 64, TASK = 64 * STEP, PART = 16 * TASK };

/* Vertices of a block, as a power of two; how many kinds of blocks there are, each of which belongs to one thread. */
enum { BLOCK_BITS = 8, KINDS = 256 };

/* What triangles add to their corners. */
typedef struct step_normals {
    double normals[3][STEP]; /* axis; of length 1, or 0 without area */
    float angles[3][STEP];   /* corner; in radians */
} step_normals;

typedef struct smoothing {
    ca_mesh *mesh;
    size_t first, count; /* the part's triangles */
    step_normals *steps; /* of the part */
    double *sums;        /* 3 a vertex */
    uint32_t owners;     /* among whom the kinds of blocks are divided */
} smoothing;

/* In double precision: large coordinates and small triangles then keep their normals. */
typedef struct step_triangles {
    double corners[3][3][STEP]; /* corner, axis */
    double doubled_areas[STEP];
} step_triangles;

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

/* Where corners lie here and there, reading them takes most of the time: those of the step at `first` are asked for,
 * while the one before is computed. `rows` holds a row of so many bytes a vertex. */
static void fetch_step(const smoothing *s, size_t first, const void *rows, size_t row_bytes)
{
    enum { NEAR = 1 << 13 }; /* vertices that stay in the cache */
    if (first >= s->count) return;
    const uint32_t *indices = s->mesh->indices + 3 * (s->first + first);
    const size_t corners = 3 * (s->count - first < STEP ? s->count - first : STEP);
    uint32_t least = indices[0], most = indices[0];
    for (size_t c = 1; c < corners; c++) {
        least = indices[c] < least ? indices[c] : least;
        most = indices[c] > most ? indices[c] : most;
    }
    if (most - least < NEAR) return;
    for (size_t c = 0; c < corners; c++) __builtin_prefetch((const char *)rows + indices[c] * row_bytes);
}

/* ---- Triangles ------------------------------------------------------------------------------------------------- */

static void load_corners(const ca_mesh *mesh, size_t first, size_t count, step_triangles *triangles)
{
    for (size_t t = 0; t < count; t++)
        for (size_t k = 0; k < 3; k++) {
            const float *position = mesh->positions + (size_t)3 * mesh->indices[3 * (first + t) + k];
            for (size_t i = 0; i < 3; i++) triangles->corners[k][i][t] = (double)position[i];
        }
}

/* Without branches, so that compilers vectorise it: DBL_MIN changes nothing but 0 / 0. Where it is inlined, gcc does
 * not know any more that the arrays are different ones. */
__attribute__((noinline)) static void find_normals(double (*restrict p)[3][STEP], double (*restrict normals)[STEP],
                                                   double *restrict lengths)
{
    for (int t = 0; t < STEP; t++) {
        const double ax = p[1][0][t] - p[0][0][t], ay = p[1][1][t] - p[0][1][t], az = p[1][2][t] - p[0][2][t];
        const double bx = p[2][0][t] - p[0][0][t], by = p[2][1][t] - p[0][1][t], bz = p[2][2][t] - p[0][2][t];
        const double x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx;
        const double length = sqrt(x * x + y * y + z * z), scale = 1.0 / (length + DBL_MIN);
        normals[0][t] = x * scale;
        normals[1][t] = y * scale;
        normals[2][t] = z * scale;
        lengths[t] = length;
    }
}

/* Of corner k, between its edges: their cross product is as long as twice the area. */
static void find_angles(step_triangles *triangles, int k, float *angles)
{
    double(*p)[STEP] = triangles->corners[k];
    double(*q)[STEP] = triangles->corners[(k + 1) % 3], (*r)[STEP] = triangles->corners[(k + 2) % 3];
    for (int t = 0; t < STEP; t++) {
        const double across = triangles->doubled_areas[t];
        const double dot = (q[0][t] - p[0][t]) * (r[0][t] - p[0][t]) + (q[1][t] - p[1][t]) * (r[1][t] - p[1][t]) +
                           (q[2][t] - p[2][t]) * (r[2][t] - p[2][t]);
        const double along = fabs(dot);
        const double large = along > across ? along : across, small = along > across ? across : along;
        const float octant = ca_atan_unit((float)(small / (large + DBL_MIN)));
        const float quadrant = across > along ? 0.5f * CA_PI - octant : octant;
        angles[t] = dot < 0.0 ? CA_PI - quadrant : quadrant;
    }
}

/* What lies behind the last triangle is computed and not used. */
static void do_step(const smoothing *s, size_t start)
{
    step_triangles triangles = {0};
    step_normals *step = &s->steps[start / STEP];
    load_corners(s->mesh, s->first + start, s->count - start < STEP ? s->count - start : STEP, &triangles);
    find_normals(triangles.corners, step->normals, triangles.doubled_areas);
    for (int k = 0; k < 3; k++) find_angles(&triangles, k, step->angles[k]);
}

static void do_triangles(void *user, uint32_t task, uint32_t worker)
{
    (void)worker;
    const smoothing *s = user;
    const size_t begin = (size_t)task * TASK, end = s->count - begin < TASK ? s->count : begin + TASK;
    for (size_t start = begin; start < end; start += STEP) {
        fetch_step(s, start + STEP, s->mesh->positions, 3 * sizeof(float));
        do_step(s, start);
    }
}

/* ---- Vertices -------------------------------------------------------------------------------------------------- */

/* Kinds that belong to a thread. */
typedef struct owned_kinds {
    uint32_t first, count;
} owned_kinds;

/* The multiplier is KINDS over the golden ratio: of any blocks in a row, kinds in a row are the same share. */
static uint32_t kind_of(uint32_t vertex) { return (vertex >> BLOCK_BITS) * 159u % KINDS; }

static void add_step(const smoothing *s, size_t start, owned_kinds kinds)
{
    const step_normals *step = &s->steps[start / STEP];
    const uint32_t *indices = s->mesh->indices + 3 * (s->first + start);
    const size_t triangles = s->count - start < STEP ? s->count - start : STEP;
    for (size_t t = 0; t < triangles; t++)
        for (size_t k = 0; k < 3; k++) {
            const uint32_t vertex = indices[3 * t + k];
            if (kind_of(vertex) - kinds.first >= kinds.count) continue; /* kinds below the first: very large */
            const double angle = (double)step->angles[k][t];
            double *sum = s->sums + (size_t)3 * vertex;
            for (size_t i = 0; i < 3; i++) sum[i] += step->normals[i][t] * angle;
        }
}

static void add_corners(void *user, uint32_t task, uint32_t worker)
{
    (void)worker;
    const smoothing *s = user;
    const uint32_t first = task * KINDS / s->owners;
    const owned_kinds kinds = {first, (task + 1) * KINDS / s->owners - first};
    for (size_t start = 0; start < s->count; start += STEP) {
        fetch_step(s, start + STEP, s->sums, 3 * sizeof(double));
        add_step(s, start, kinds);
    }
}

static void normalize_sums(void *user, ca_range range)
{
    const smoothing *s = user;
    for (size_t v = range.begin; v < range.end; v++) {
        const double *sum = s->sums + 3 * v;
        const double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
        for (size_t i = 0; i < 3; i++) s->mesh->normals[3 * v + i] = length > 0.0 ? (float)(sum[i] / length) : 0.0f;
    }
}

/* ---- The whole ------------------------------------------------------------------------------------------------- */

static ca_status smooth(smoothing *s, uint32_t workers, ca_error *error)
{
    const size_t triangles = s->mesh->triangle_count;
    for (s->first = 0; s->first < triangles; s->first += PART) {
        CA_TRY(ca_loading_check(error));
        s->count = triangles - s->first < PART ? triangles - s->first : PART;
        ca_parallel_surely(workers, (uint32_t)((s->count + TASK - 1) / TASK), do_triangles, s);
        ca_parallel_surely(workers, s->owners, add_corners, s);
    }
    ca_parallel_ranges(s->mesh->vertex_count, normalize_sums, s);
    return ca_loading_check(error);
}

/* What fits a task is not worth waking others for. */
static uint32_t workers_for(const ca_mesh *mesh, uint32_t threads)
{
    if (mesh->triangle_count <= TASK) return 1;
    return threads ? threads : ca_processors();
}

ca_status ca_mesh_compute_normals(ca_mesh *mesh, uint32_t threads, ca_error *error)
{
    const size_t value_count = (size_t)3 * mesh->vertex_count;
    const size_t part = mesh->triangle_count < PART ? mesh->triangle_count : PART;
    const uint32_t workers = workers_for(mesh, threads);
    smoothing s = {.mesh = mesh, .owners = ca_min_u32(workers, KINDS)};
    s.sums = ca_alloc_large_zeroed(value_count, sizeof *s.sums);
    s.steps = ca_alloc_large((part + STEP - 1) / STEP, sizeof *s.steps);
    if (!mesh->normals) mesh->normals = ca_alloc_large(value_count, sizeof *mesh->normals);
    const bool fits = s.sums && s.steps && mesh->normals;
    const ca_status status = fits ? smooth(&s, workers, error) : ca_fail_memory(error, "mesh normals");
    if (status != CA_OK) ca_mesh_drop_normals(mesh);
    ca_free(s.sums);
    ca_free(s.steps);
    return status;
}
