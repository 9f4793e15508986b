/* qmcppm: its settings, and the blocks of either side as they are asked for. See qmcppm.h for the method.
 *
 * Parameters beside those that all algorithms share (algorithms.c):
 *
 *     light_paths         n_b, light paths of a block; 0: one per pixel of the full film, or 16 with join=connect
 *     camera_paths        camera paths per pixel of a block, so m_b is that times the pixels
 *     radius_pixels       r0 in sides of a pixel's median footprint, where `radius` is 0
 *     radius_photons      r0 differs from place to place: the distance to so many photons of a pilot; 0: it does not
 *     kernel              disk | epanechnikov | sph
 *     gradients           layers IrradianceGradient.*
 *     camera_diffuse_depth, merges, heuristic   as in bdpm; a depth of 0 is ppm
 *     direct              photons | next-event
 *     join                merge | connect (by shadow rays)
 *     order               rectangular | diagonal
 *     blocks              equal | filled (as large as half of the memory each)
 *     keep_blocks         what was traced stays in memory, as far as there is room; changes the time alone
 *     total_light_paths   n, fixed in advance; 0: the radius shrinks as light paths come
 *     total_camera_paths  per pixel: there are only so many, and then only light paths go on; 0: no end
 *     transport           all | smooth | dirac: paths without Dirac events, and those with
 *     error_bars          layers Confidence*.Y and ValueVariance.Y; with the sampler independent only */
#include "integrator/qmcppm.h"

#include "base/memory.h"

#include <math.h>

enum { CONNECT_LIGHT_PATHS = 16, MAX_RADIUS_PHOTONS = 64 };

enum {
    MAX_DEPTH,
    RR_DEPTH,
    HIDE_EMITTERS,
    HEURISTIC,
    LIGHT_PATHS,
    CAMERA_PATHS,
    RADIUS,
    RADIUS_PIXELS,
    ALPHA,
    RADIUS_PHOTONS,
    KERNEL,
    GRADIENTS,
    DIFFUSE_DEPTH,
    MERGES,
    DIRECT,
    JOIN,
    ORDER,
    BLOCKS,
    TOTAL_LIGHT_PATHS,
    TOTAL_CAMERA_PATHS,
    TRANSPORT,
    ERROR_BARS,
    KEEP_BLOCKS,
    PARAMETER_COUNT
};

static const ca_parameter_spec parameters[] = {
    [MAX_DEPTH] = {"max_depth", CA_SPEC_INTEGER, .minimum = -1, .number = -1},
    [RR_DEPTH] = {"rr_depth", CA_SPEC_INTEGER, .minimum = 1, .number = CA_ROULETTE_DEPTH},
    [HIDE_EMITTERS] = {"hide_emitters", CA_SPEC_BOOLEAN, .number = 0},
    [HEURISTIC] = {"heuristic", CA_SPEC_CHOICE, .choices = "balance|power", .number = 0},
    [LIGHT_PATHS] = {"light_paths", CA_SPEC_INTEGER, .minimum = 0, .number = 0},
    [CAMERA_PATHS] = {"camera_paths", CA_SPEC_INTEGER, .minimum = 1, .number = 1},
    [RADIUS] = CA_RADIUS_SPEC,
    [RADIUS_PIXELS] = {"radius_pixels", CA_SPEC_REAL, .minimum = 0, .number = 0},
    [ALPHA] = {"alpha", CA_SPEC_REAL, .minimum = 0, .maximum = 1, .number = 0.5},
    [RADIUS_PHOTONS] = {"radius_photons", CA_SPEC_INTEGER, .minimum = 0, .number = 0},
    [KERNEL] = {"kernel", CA_SPEC_CHOICE, .choices = "disk|epanechnikov|sph", .number = CA_KERNEL_DISK},
    [GRADIENTS] = {"gradients", CA_SPEC_BOOLEAN, .number = 0},
    [DIFFUSE_DEPTH] = {"camera_diffuse_depth", CA_SPEC_INTEGER, .minimum = 0, .number = 0},
    [MERGES] = {"merges", CA_SPEC_CHOICE, .choices = "all|last", .number = 0},
    [DIRECT] = {"direct", CA_SPEC_CHOICE, .choices = "photons|next-event", .number = 0},
    [JOIN] = {"join", CA_SPEC_CHOICE, .choices = "merge|connect", .number = 0},
    [ORDER] = {"order", CA_SPEC_CHOICE, .choices = "rectangular|diagonal", .number = 0},
    [BLOCKS] = {"blocks", CA_SPEC_CHOICE, .choices = "equal|filled", .number = 0},
    [TOTAL_LIGHT_PATHS] = {"total_light_paths", CA_SPEC_INTEGER, .minimum = 0, .number = 0},
    [TOTAL_CAMERA_PATHS] = {"total_camera_paths", CA_SPEC_INTEGER, .minimum = 0, .number = 0},
    [TRANSPORT] = {"transport", CA_SPEC_CHOICE, .choices = "all|smooth|dirac", .number = CA_TRANSPORT_ALL},
    [ERROR_BARS] = {"error_bars", CA_SPEC_BOOLEAN, .number = 0},
    [KEEP_BLOCKS] = {"keep_blocks", CA_SPEC_BOOLEAN, .number = 1},
    [PARAMETER_COUNT] = {.name = NULL},
};

_Static_assert((int)PARAMETER_COUNT <= (int)CA_MAX_PARAMETERS, "an integrator has so many parameters at most");

/* ---- Settings -------------------------------------------------------------------------------------------------- */

typedef struct setting_rule {
    bool wrong;
    const char *reason;
} setting_rule;

static ca_status check_rules(const setting_rule *rules, size_t count, ca_error *error)
{
    for (size_t i = 0; i < count; i++)
        if (rules[i].wrong)
            return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "integrator \"qmcppm\": %s", rules[i].reason);
    return CA_OK;
}

/* Settings that exclude each other, with the reason. */
static ca_status check(const ca_integrator_input *input, ca_error *error)
{
    const double *v = input->values;
    const bool connect = v[JOIN] != 0.0, filled = v[BLOCKS] != 0.0, several = v[DIFFUSE_DEPTH] > 0.0;
    const setting_rule rules[] = {
        {v[GRADIENTS] != 0.0 && v[KERNEL] == CA_KERNEL_DISK,
         "gradients need a smooth kernel (epanechnikov or sph): the disk has no derivative"},
        {v[RADIUS_PHOTONS] > 0.0 && several,
         "radius_photons needs camera_diffuse_depth=0: all merges that share a path's light must have one radius"},
        {v[RADIUS_PHOTONS] > MAX_RADIUS_PHOTONS, "radius_photons can be at most 64"},
        {v[DIRECT] != 0.0 && several, "direct=next-event needs camera_diffuse_depth=0"},
        {connect && (v[KERNEL] != CA_KERNEL_DISK || v[GRADIENTS] != 0.0 || v[RADIUS_PHOTONS] > 0.0 || several ||
                     v[DIRECT] != 0.0),
         "join=connect merges nothing: kernel, gradients, radius_photons, camera_diffuse_depth and direct have no "
         "meaning"},
        {connect && v[TRANSPORT] != CA_TRANSPORT_ALL, "transport needs join=merge"},
        {connect && filled, "join=connect keeps few light paths and no camera paths: its blocks cannot be filled"},
        {connect && v[LIGHT_PATHS] > CA_CHUNK_PATHS, "join=connect can have at most 262144 light_paths"},
        {filled && input->memory_bytes <= 0.0, "blocks=filled needs a limit of memory to fill (--memory)"},
        {filled && (v[TOTAL_LIGHT_PATHS] > 0.0 || v[TOTAL_CAMERA_PATHS] > 0.0),
         "totals of light or camera paths need blocks=equal"},
        {filled && (v[LIGHT_PATHS] > 0.0 || v[CAMERA_PATHS] != 1.0),
         "blocks=filled chooses light_paths and camera_paths itself"},
    };
    return check_rules(rules, sizeof rules / sizeof rules[0], error);
}

/* Can next event stand in for all photons that come straight from a light? */
static ca_status check_lights(const ca_integrator_input *input, ca_error *error)
{
    const ca_scene *scene = input->scene;
    for (uint32_t i = 0; input->values[DIRECT] != 0.0 && i < scene->light_count; i++)
        if (!ca_light_has_next_event(&scene->lights[i]))
            return ca_fail(error, CA_ERROR_UNSUPPORTED, &scene->desc.lights.items[i].where,
                           "integrator \"qmcppm\": direct=next-event does not find this light, which shines along "
                           "the normals of a curved surface; direct=photons does");
    return CA_OK;
}

static ca_status check_error_bars(const ca_qmcppm *q, ca_error *error)
{
    const double *v = q->input.values;
    const setting_rule rules[] = {
        {q->input.sampler->kind != CA_SAMPLER_INDEPENDENT,
         "error_bars need independent paths, by the sampler \"independent\"; of a sequence, replicates with "
         "different seeds tell the error"},
        {v[CAMERA_PATHS] < 2.0,
         "error_bars need camera_paths of 2 or more: light's part of the noise shows only where two camera paths "
         "of a pixel meet the same light paths"},
        {q->light_block < 2 || q->light_block > UINT32_MAX, "error_bars need light_paths from 2 to 4294967295"},
        {q->connect, "error_bars need join=merge"},
        {q->filled, "error_bars need blocks=equal, which give every pixel as many camera paths in each"},
        {q->total_light % q->light_block != 0, "error_bars need total_light_paths in whole blocks of light_paths"},
    };
    return v[ERROR_BARS] != 0.0 ? check_rules(rules, sizeof rules / sizeof rules[0], error) : CA_OK;
}

static void read_settings(ca_qmcppm *q)
{
    const double *v = q->input.values;
    const uint32_t *crop = q->input.crop;
    const double film = (double)q->input.camera->width * q->input.camera->height;
    q->pixels = (uint64_t)(crop[2] - crop[0]) * (crop[3] - crop[1]);
    q->kernel = (ca_kernel)v[KERNEL];
    q->transport = (ca_transport)v[TRANSPORT];
    q->gradients = v[GRADIENTS] != 0.0;
    q->connect = v[JOIN] != 0.0;
    q->direct_photons = v[DIRECT] == 0.0;
    q->weighted = v[DIFFUSE_DEPTH] > 0.0;
    q->filled = v[BLOCKS] != 0.0;
    q->keeps = v[KEEP_BLOCKS] != 0.0 && !q->filled;
    q->radius_photons = (uint32_t)v[RADIUS_PHOTONS];
    q->camera_block = (uint64_t)v[CAMERA_PATHS] * q->pixels;
    q->light_block = (uint64_t)(v[LIGHT_PATHS] > 0.0 ? v[LIGHT_PATHS] : q->connect ? CONNECT_LIGHT_PATHS : film);
    q->reference = q->filled ? film : (double)q->light_block;
    q->total_light = (uint64_t)v[TOTAL_LIGHT_PATHS];
    q->side_bytes = 0.5 * q->input.memory_bytes;
    q->order = (ca_block_order){.diagonal = v[ORDER] != 0.0, .camera_limit = UINT64_MAX, .light_limit = UINT64_MAX};
    if (q->total_light > 0) q->order.light_limit = (q->total_light + q->light_block - 1) / q->light_block;
    if (v[TOTAL_CAMERA_PATHS] > 0.0) q->order.camera_limit = (uint64_t)ceil(v[TOTAL_CAMERA_PATHS] / v[CAMERA_PATHS]);
}

static ca_status fail_too_large(double bytes, double allowed, ca_error *error)
{
    return ca_fail(
        error, CA_ERROR_ARGUMENT, NULL,
        "a block of camera paths and one of light paths need about %.1f MiB, more than the %.1f MiB left beside the "
        "film; fewer light_paths or camera_paths, or blocks=filled, need less",
        bytes / 0x1p20, allowed / 0x1p20);
}

/* What the records alone will take; the vertices are known when they are there. */
static double record_bytes(const ca_qmcppm *q)
{
    return q->connect ? 0.0 : (double)q->camera_block * sizeof(ca_camera_record);
}

static ca_status create_engine(ca_qmcppm *q, ca_error *error)
{
    static const ca_mis_rules photon_rules = {.hit = CA_HIT_UNMERGEABLE, .merge = CA_MERGE_ALL};
    static const ca_mis_rules connect_rules = {.hit = CA_HIT_ALWAYS, .next_event = true, .connect = true};
    ca_integrator_input input = q->input;
    void *engine;
    input.observer = NULL; /* kept camera paths keep no points */
    input.values[LIGHT_PATHS] = q->filled ? CA_CHUNK_PATHS : (double)q->light_block;
    if (q->filled || input.memory_bytes <= 0.0) {
        input.memory_bytes = (double)INFINITY; /* all light paths of a block are there at once */
    } else {
        input.memory_bytes -= record_bytes(q);
        if (input.memory_bytes <= 0.0) return fail_too_large(record_bytes(q), q->input.memory_bytes, error);
    }
    CA_TRY(ca_bidirectional_create(&ca_integrator_qmcppm, q->connect ? &connect_rules : &photon_rules, &input,
                                   &engine, error));
    q->engine = engine;
    if (q->engine->resident < q->engine->chunk_count)
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "a block of %u light paths does not fit the memory allowed: choose fewer light_paths, or blocks=filled",
            q->engine->light_paths);
    return CA_OK;
}

static void destroy(void *state)
{
    ca_qmcppm *q = state;
    for (uint32_t i = 0; q->pairs && i < q->input.workers; i++) ca_pair_covariances_destroy(&q->pairs[i]);
    ca_free(q->pairs);
    for (uint32_t i = 0; q->kept && i < q->input.workers; i++) ca_free(q->kept[i].items);
    ca_free(q->kept);
    if (q->engine) ca_bidirectional_destroy(q->engine);
    ca_photon_grid_destroy(q->pilot);
    ca_camera_records_destroy(&q->camera);
    ca_kept_blocks_destroy(q);
    ca_free(q->camera_starts.starts);
    ca_free(q->light_starts.starts);
    ca_free(q);
}

static ca_status create_kept(ca_qmcppm *q, ca_error *error)
{
    q->kept = ca_alloc_zeroed(q->input.workers, sizeof *q->kept);
    return q->kept ? CA_OK : ca_fail_memory(error, "the camera paths");
}

static ca_status create_pairs(ca_qmcppm *q, ca_error *error)
{
    if (q->input.values[ERROR_BARS] == 0.0) return CA_OK;
    q->pairs = ca_alloc_zeroed(q->input.workers, sizeof *q->pairs);
    if (!q->pairs) return ca_fail_memory(error, "the error bars");
    for (uint32_t i = 0; i < q->input.workers; i++) CA_TRY(ca_pair_covariances_create(&q->pairs[i], error));
    return CA_OK;
}

static ca_status create(const ca_integrator_input *input, void **state, ca_error *error)
{
    CA_TRY(check(input, error));
    CA_TRY(check_lights(input, error));
    ca_qmcppm *q = ca_alloc_zeroed(1, sizeof *q);
    if (!q) return ca_fail_memory(error, "the integrator");
    q->input = *input;
    read_settings(q);
    ca_status status = check_error_bars(q, error);
    if (status == CA_OK) status = create_engine(q, error);
    if (status == CA_OK) status = create_kept(q, error);
    if (status == CA_OK) status = create_pairs(q, error);
    if (status == CA_OK) status = ca_kept_blocks_create(q, error);
    if (status != CA_OK) {
        destroy(q);
        return status;
    }
    *state = q;
    return CA_OK;
}

/* ---- Filled blocks --------------------------------------------------------------------------------------------- */

typedef struct block_job {
    ca_qmcppm *q;
    const ca_parallel *parallel;
    ca_worker *workers;
} block_job;

/* Traces as many paths as one side's memory holds, from `start` on; *count of them. */
typedef ca_status (*fill_function)(const block_job *job, uint64_t start, uint64_t *count, ca_error *error);

static ca_status fill_light(const block_job *job, uint64_t start, uint64_t *count, ca_error *error)
{
    ca_qmcppm *q = job->q;
    uint32_t paths = 0;
    CA_TRY(ca_light_chunk_fill(q->engine, start, q->side_bytes, &paths, job->parallel, job->workers, error));
    *count = paths;
    return CA_OK;
}

static ca_status fill_camera(const block_job *job, uint64_t start, uint64_t *count, ca_error *error)
{
    return ca_camera_records_fill(job->q, start, job->q->side_bytes, count, job->parallel, job->workers, error);
}

static ca_status keep_start(ca_block_starts *starts, uint64_t start, ca_error *error)
{
    uint64_t *known = ca_array_grow(starts->starts, &starts->capacity, starts->known + 1, sizeof *known);
    if (!known) return ca_fail_memory(error, "the blocks");
    starts->starts = known;
    starts->starts[starts->known++] = start;
    return CA_OK;
}

/* Fills the block-th block of a side. Those before it whose ends are not known are filled first, to learn where it
 * begins. */
static ca_status fill_block(const block_job *job, ca_block_starts *s, uint64_t block, fill_function fill,
                            uint64_t *count, ca_error *error)
{
    if (s->known == 0) CA_TRY(keep_start(s, 0, error));
    for (uint64_t k = block + 1 < s->known ? block : s->known - 1; k <= block; k++) {
        CA_TRY(fill(job, s->starts[k], count, error));
        if (k + 1 == s->known) CA_TRY(keep_start(s, s->starts[k] + *count, error));
    }
    return CA_OK;
}

/* ---- Light paths ----------------------------------------------------------------------------------------------- */

/* The radius of a block: it follows the light paths to the block's end, or is that for the n fixed in advance. */
static void set_radius(ca_qmcppm *q, uint64_t light_end)
{
    const double n = (double)(q->total_light ? q->total_light : light_end);
    q->shrink = (float)pow(n / q->reference, -0.5 * (double)q->engine->alpha);
    const float range = q->radius_photons ? CA_LOCAL_RADIUS_RANGE : 1.0f;
    ca_bidirectional_set_radius(q->engine, q->engine->radius0 * q->shrink * range);
}

static ca_status trace_equal_light(const block_job *job, uint64_t j, ca_error *error)
{
    ca_qmcppm *q = job->q;
    const uint64_t begin = j * q->light_block;
    bool found = false;
    q->light_count = q->light_block;
    if (q->total_light && q->light_count > q->total_light - begin) q->light_count = q->total_light - begin;
    set_radius(q, begin + q->light_count);
    if (q->keeps) CA_TRY(ca_kept_light_change(q, j, &found, error));
    if (found) return CA_OK;
    return ca_light_paths_prepare(q->engine, begin, (uint32_t)q->light_count, job->parallel, job->workers, error);
}

static ca_status trace_filled_light(const block_job *job, uint64_t j, ca_error *error)
{
    ca_qmcppm *q = job->q;
    CA_TRY(fill_block(job, &q->light_starts, j, fill_light, &q->light_count, error));
    set_radius(q, q->light_starts.starts[j + 1]);
    return ca_light_photons_sort(q->engine, q->engine->grid, q->engine->radius, job->parallel, error);
}

/* ---- Camera paths ---------------------------------------------------------------------------------------------- */

/* Do the blocks of both sides fit the memory? */
static ca_status check_memory(const ca_qmcppm *q, ca_error *error)
{
    if (q->filled || q->input.memory_bytes <= 0.0) return CA_OK;
    const ca_bidirectional *engine = q->engine;
    double bytes = q->connect ? 0.0 : ca_camera_records_bytes(&q->camera);
    bytes += ca_light_bytes((double)q->light_count, (double)engine->bytes_now, (double)engine->photons_now);
    return bytes <= q->input.memory_bytes ? CA_OK : fail_too_large(bytes, q->input.memory_bytes, error);
}

static ca_status trace_equal_camera(const block_job *job, uint64_t i, ca_error *error)
{
    ca_qmcppm *q = job->q;
    if (q->connect) { /* traced with each block */
        q->camera.first = i * q->camera_block;
        q->camera.count = q->camera_block;
        return CA_OK;
    }
    bool found = false;
    if (q->keeps) CA_TRY(ca_kept_camera_change(q, i, &found, error));
    if (found) return CA_OK;
    return ca_camera_records_trace(q, i * q->camera_block, q->camera_block, job->parallel, job->workers, error);
}

static ca_status trace_filled_camera(const block_job *job, uint64_t i, ca_error *error)
{
    uint64_t count;
    return fill_block(job, &job->q->camera_starts, i, fill_camera, &count, error);
}

/* ---- Blocks ---------------------------------------------------------------------------------------------------- */

/* Photons of a pilot, from whose distances the local radii follow. */
static ca_status make_pilot(const block_job *job, ca_error *error)
{
    ca_qmcppm *q = job->q;
    const uint32_t paths = ca_min_u32(CA_CHUNK_PATHS, q->engine->light_paths);
    q->pilot_scale = (float)sqrt((double)paths / q->reference);
    const float reach = q->engine->radius0 * CA_LOCAL_RADIUS_RANGE / q->pilot_scale;
    return ca_light_pilot(q->engine, paths, reach, &q->pilot, job->parallel, job->workers, error);
}

static ca_status begin_block(void *state, uint64_t block, const ca_parallel *parallel, ca_worker *workers,
                             ca_error *error)
{
    ca_qmcppm *q = state;
    if (block >= ca_block_count(&q->order))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "there are only %llu blocks: block %llu does not exist",
                       (unsigned long long)ca_block_count(&q->order), (unsigned long long)block);
    const ca_block_pair pair = ca_block_pair_at(&q->order, block);
    const bool same_light = q->ready && pair.light == q->now.light,
               same_camera = q->ready && pair.camera == q->now.camera;
    const block_job job = {.q = q, .parallel = parallel, .workers = workers};
    q->ready = false;
    if (q->radius_photons && !q->pilot) CA_TRY(make_pilot(&job, error));
    if (!same_light) CA_TRY((q->filled ? trace_filled_light : trace_equal_light)(&job, pair.light, error));
    if (!same_camera) CA_TRY((q->filled ? trace_filled_camera : trace_equal_camera)(&job, pair.camera, error));
    CA_TRY(check_memory(q, error));
    q->now = pair;
    q->visits = ca_block_visits(&q->order, block);
    if (q->keeps) ca_kept_blocks_done(q, &pair);
    q->ready = true;
    return CA_OK;
}

/* The number of camera blocks that give every pixel so many paths; UINT64_MAX: not known yet. */
static uint64_t camera_blocks(const ca_qmcppm *q, uint32_t samples_per_pixel)
{
    const uint64_t paths = samples_per_pixel * q->pixels;
    if (!q->filled) return (paths + q->camera_block - 1) / q->camera_block;
    for (uint64_t k = 0; k < q->camera_starts.known; k++)
        if (q->camera_starts.starts[k] >= paths) return k;
    return UINT64_MAX;
}

static uint64_t blocks_needed(const void *state, uint32_t samples_per_pixel)
{
    const ca_qmcppm *q = state;
    const uint64_t k = camera_blocks(q, samples_per_pixel), all = ca_block_count(&q->order);
    if (k == UINT64_MAX) return k;
    const uint64_t needed = q->order.diagonal ? k * (k + 1) / 2 : ca_block_square(&q->order, k);
    return q->order.diagonal && (q->order.camera_limit <= k || q->order.light_limit <= k) ? all
           : needed < all                                                                 ? needed
                                                                                          : all;
}

const ca_integrator_type ca_integrator_qmcppm = {
    .name = "qmcppm",
    .parameters = parameters,
    .sampler = CA_SAMPLER_HALTON,
    .create = create,
    .destroy = destroy,
    .begin_block = begin_block,
    .block_pixels = ca_qmcppm_block_pixels,
    .blocks_needed = blocks_needed,
};
