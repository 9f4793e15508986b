#include "support/random_paths.h"

#include <math.h>

static float uniform(ca_test_random *random, float low, float high)
{
    return low + (high - low) * ca_test_random_float(random);
}

static float log_uniform(ca_test_random *random, float low, float high)
{
    return expf(uniform(random, logf(low), logf(high)));
}

static bool happens(ca_test_random *random, float probability) { return ca_test_random_float(random) < probability; }

static uint32_t below(ca_test_random *random, uint32_t count) { return ca_test_random_u32(random) % count; }

/* ---- Rules ----------------------------------------------------------------------------------------------------- */

static ca_mis_rules algorithm_rules(ca_test_random *random)
{
    const uint32_t depth = 1 + below(random, 4);
    const ca_mis_rules algorithms[] = {
        {.hit = CA_HIT_ALWAYS, .next_event = true},                                 /* path */
        {.hit = CA_HIT_DIRECT, .splat = true},                                      /* light */
        {.hit = CA_HIT_ALWAYS, .next_event = true, .connect = true, .splat = true}, /* bdpt */
        {.hit = CA_HIT_UNMERGEABLE, .merge = CA_MERGE_ALL, .merge_limit = 1},       /* ppm */
        {.hit = CA_HIT_UNMERGEABLE, .merge = CA_MERGE_ALL, .merge_limit = depth},   /* bdpm */
        {.hit = CA_HIT_UNMERGEABLE, .merge = CA_MERGE_LAST, .merge_limit = depth},  /* bdpm, last */
        {.hit = CA_HIT_ALWAYS,
         .next_event = true,
         .connect = true,
         .splat = true,
         .merge = CA_MERGE_ALL, /* vcm */
         .merge_limit = UINT32_MAX},
    };
    return algorithms[below(random, sizeof algorithms / sizeof *algorithms)];
}

static ca_mis_rules any_rules(ca_test_random *random)
{
    return (ca_mis_rules){.hit = (ca_hit_rule)below(random, 3),
                          .next_event = happens(random, 0.5f),
                          .connect = happens(random, 0.5f),
                          .splat = happens(random, 0.5f),
                          .merge = (ca_merge_rule)below(random, 3),
                          .merge_limit = happens(random, 0.3f) ? UINT32_MAX : below(random, 6)};
}

ca_mis_rules ca_random_rules(ca_test_random *random)
{
    ca_mis_rules rules = happens(random, 0.5f) ? algorithm_rules(random) : any_rules(random);
    const float light_paths = happens(random, 0.1f) ? 1.0f : floorf(log_uniform(random, 1.0f, 1e6f));
    rules.power = happens(random, 0.5f);
    rules.factors = happens(random, 0.1f);
    rules.splat_count = light_paths / (float)(1 + below(random, 8));
    rules.merge_area = log_uniform(random, 1e-7f, 1e-1f);
    rules.reuse = (ca_reuse_rules){.kind = (ca_reuse_kind)below(random, CA_REUSE_KIND_COUNT),
                                   .light_paths = light_paths,
                                   .merge_area = rules.merge_area,
                                   .epsilon = happens(random, 0.5f) ? 0.01f : uniform(random, 0.0f, 0.1f),
                                   .c = happens(random, 0.5f) ? 0.5f : uniform(random, 0.0f, 1.0f),
                                   .projected = happens(random, 0.3f)};
    return rules;
}

/* ---- Paths ----------------------------------------------------------------------------------------------------- */

static void draw_camera(ca_test_random *random, ca_full_path *path)
{
    const uint32_t kind = below(random, 3); /* pinhole, thin lens, orthographic */
    path->camera_parallel = kind == 2;
    path->camera_area = kind == 0   ? 0.0f
                        : kind == 1 ? log_uniform(random, 1e-8f, 1e-5f)
                                    : log_uniform(random, 1e-7f, 1e-4f);
    path->pdf_camera[0] = kind == 1 ? 1.0f / path->camera_area : 1.0f;
    path->pdf_to_light[0] = log_uniform(random, 1e4f, 1e6f); /* within a pixel */
    path->distance[0] = uniform(random, 1.0f, 10.0f);
}

static void draw_light(ca_test_random *random, ca_full_path *path)
{
    const uint32_t last = path->n - 1, kind = below(random, 4); /* point, area, environment, directional */
    const bool infinite = kind >= 2;
    path->light_choice = happens(random, 0.5f) ? 1.0f : uniform(random, 0.01f, 1.0f);
    path->light_area = kind == 0  ? 0.0f
                       : infinite ? log_uniform(random, 10.0f, 1e4f)
                                  : log_uniform(random, 1e-3f, 10.0f);
    path->light_parallel = kind == 3;
    path->light_infinite = infinite;
    path->pdf_to_camera[last] = log_uniform(random, 0.05f, 100.0f);
    const float own = kind == 1 ? 1.0f / path->light_area : kind == 2 ? path->pdf_to_camera[last] : 1.0f;
    path->pdf_light[last] = path->light_choice * own;
    if (kind == 0 || kind == 3) path->pdf_camera[last] = 0.0f;
    path->splat_scale = happens(random, 0.5f) ? log_uniform(random, 1e-2f, 1e2f) : 1.0f;
    path->next_event_ratio = kind == 1 && happens(random, 0.5f) ? uniform(random, 0.5f, 4.0f) : 1.0f;
}

static void draw_interior(ca_test_random *random, uint32_t i, float dirac, float decades, ca_full_path *path)
{
    path->dirac[i] = happens(random, dirac);
    path->pdf_camera[i] = log_uniform(random, 1e-3f, 1e4f);
    path->pdf_light[i] = path->pdf_camera[i] * powf(10.0f, uniform(random, -decades, decades));
    if (happens(random, 0.01f)) path->pdf_light[i] = 0.0f;
    if (happens(random, 0.01f)) path->pdf_camera[i] = 0.0f;
    path->distance[i] = log_uniform(random, 1e-2f, 1e2f);
    path->pdf_to_light[i] = log_uniform(random, 1e-2f, 1e4f);
    path->pdf_to_camera[i] = log_uniform(random, 1e-2f, 1e4f);
    path->cos_to_light[i] = uniform(random, 0.05f, 1.0f);
    path->cos_to_camera[i] = uniform(random, 0.05f, 1.0f);
    path->photon_density[i] = log_uniform(random, 1e-1f, 1e7f);
}

static void draw_factors(ca_test_random *random, ca_technique_factors *factors)
{
    float drawn[sizeof *factors / sizeof(float)];
    for (size_t i = 0; i < sizeof drawn / sizeof *drawn; i++) drawn[i] = log_uniform(random, 1e-2f, 1e3f);
    memcpy(factors, drawn, sizeof drawn);
}

ca_full_path ca_random_path(ca_test_random *random)
{
    const float dirac_choices[] = {0.0f, 0.2f, 0.7f}, decade_choices[] = {0.3f, 1.0f, 4.0f};
    const float dirac = dirac_choices[below(random, 3)], decades = decade_choices[below(random, 3)];
    ca_full_path path = {.n = 2 + below(random, CA_FULL_PATH_MAX - 1)};
    path.pdf_camera[path.n - 1] = log_uniform(random, 1e-3f, 1e2f);
    draw_camera(random, &path);
    draw_light(random, &path);
    draw_factors(random, &path.factors);
    path.light_class = below(random, CA_FACTOR_LIGHTS);
    for (uint32_t i = 1; i + 1 < path.n; i++) draw_interior(random, i, dirac, decades, &path);
    return path;
}

/* ---- Splits ---------------------------------------------------------------------------------------------------- */

/* The path as walked from one of its ends, vertex 0 there. */
typedef struct walk {
    const ca_full_path *path;
    bool from_light;
    const ca_reuse_rules *rules;
} walk;

static uint32_t at(const walk *w, uint32_t i) { return w->from_light ? w->path->n - 1 - i : i; }
static float pdf_own(const walk *w, uint32_t i)
{
    return w->from_light ? w->path->pdf_light[at(w, i)] : w->path->pdf_camera[at(w, i)];
}
static float pdf_other(const walk *w, uint32_t i)
{
    return w->from_light ? w->path->pdf_camera[at(w, i)] : w->path->pdf_light[at(w, i)];
}
static float distance_before(const walk *w, uint32_t i)
{
    return w->path->distance[w->from_light ? at(w, i) : i - 1];
}
static float cos_ratio(const walk *w, uint32_t i)
{
    const ca_full_path *p = w->path;
    if (i == 0 || i == p->n - 1) return 1.0f;
    const uint32_t k = at(w, i);
    return w->from_light ? p->cos_to_camera[k] / p->cos_to_light[k] : p->cos_to_light[k] / p->cos_to_camera[k];
}
static float start_area(const walk *w) { return sqrtf(w->from_light ? w->path->light_area : w->path->camera_area); }

/* What the event at vertex i adds to sqrt(Omega), going on (forward) or back. */
static float spread(const walk *w, uint32_t i, bool forward)
{
    const ca_full_path *p = w->path;
    const uint32_t k = at(w, i);
    const bool to_light = forward != w->from_light;
    const bool single = (k == 0 && p->camera_parallel) || (k == p->n - 1 && p->light_parallel) || p->dirac[k];
    if (single) return 0.0f;
    return ca_footprint_spread(w->rules->epsilon,
                               (ca_pdf_solid_angle){to_light ? p->pdf_to_light[k] : p->pdf_to_camera[k]});
}

/* Footprints on arrival at each vertex. */
static void footprints(const walk *w, uint32_t count, float *sqrt_area, float *sqrt_omega)
{
    sqrt_area[0] = start_area(w);
    sqrt_omega[0] = 0.0f;
    for (uint32_t i = 1; i < count; i++) {
        const float tilt = w->rules->projected ? sqrtf(cos_ratio(w, i - 1)) : 1.0f;
        sqrt_omega[i] = sqrt_omega[i - 1] + spread(w, i - 1, true);
        sqrt_area[i] = sqrt_area[i - 1] * tilt + distance_before(w, i) * sqrt_omega[i];
    }
}

static void fill_vertices(const walk *w, uint32_t count, bool last_is_recorded, ca_test_random *random,
                          ca_path_vertex *v)
{
    float sqrt_area[CA_FULL_PATH_MAX], sqrt_omega[CA_FULL_PATH_MAX];
    footprints(w, count, sqrt_area, sqrt_omega);
    uint16_t so_far = 0;
    for (uint32_t i = 0; i < count; i++) {
        const bool known = i + 1 < count || last_is_recorded; /* the event there */
        bool smooth = ca_full_path_is_smooth(w->path, at(w, i));
        if (!known) smooth = i > 0 && happens(random, 0.5f);
        so_far = (uint16_t)(so_far + smooth);
        v[i] = (ca_path_vertex){.pdf_forward = {pdf_own(w, i)},
                                .pdf_reverse = {i + 2 < count ? pdf_other(w, i) : NAN},
                                .to_previous = NAN,
                                .distance = i > 0 ? distance_before(w, i) : 0.0f,
                                .sqrt_area = sqrt_area[i],
                                .sqrt_omega = sqrt_omega[i],
                                .spread_reverse = known ? spread(w, i, false) : NAN,
                                .cos_ratio = known ? cos_ratio(w, i) : NAN,
                                .photon_density = w->path->photon_density[at(w, i)],
                                .connectable = smooth,
                                .connectable_count = so_far};
    }
    if (!w->from_light && count > 0) v[0].splat_scale = w->path->splat_scale;
    if (w->from_light && count > 0) {
        v[0].next_event_ratio = w->path->next_event_ratio;
        v[0].light_choice = w->path->light_choice;
        v[0].at_infinity = w->path->light_infinite;
    }
}

static ca_mis_side make_side(const walk *w, uint32_t count, const ca_path_vertex *vertices)
{
    ca_mis_side side = {.vertices = vertices, .count = count, .tail = CA_MIS_NO_TAIL};
    if (count == 0) return side;
    const walk other = {w->path, !w->from_light, w->rules};
    float sqrt_area[CA_FULL_PATH_MAX], sqrt_omega[CA_FULL_PATH_MAX];
    footprints(&other, w->path->n, sqrt_area, sqrt_omega);
    const uint32_t last = w->path->n - count; /* in the other's numbers */
    side.pdf_last.v = count > 1 || w->from_light ? pdf_other(w, count - 1) : NAN;
    side.pdf_before.v = count > 1 ? pdf_other(w, count - 2) : NAN;
    side.sqrt_area = sqrt_area[last];
    side.sqrt_omega = sqrt_omega[last];
    side.spread = spread(&other, last, true);
    side.cos_ratio = cos_ratio(w, count - 1);
    return side;
}

void ca_split(const ca_full_path *path, const ca_reuse_rules *rules, uint32_t s, ca_technique technique,
              ca_test_random *random, ca_split_path *split)
{
    const walk camera = {path, false, rules}, light = {path, true, rules};
    fill_vertices(&camera, s, false, random, split->camera);
    fill_vertices(&light, path->n - s, technique == CA_TECHNIQUE_MERGE, random, split->light);
    split->path = (ca_mis_path){.camera = make_side(&camera, s, split->camera),
                                .light = make_side(&light, path->n - s, split->light),
                                .next_event_ratio = path->next_event_ratio,
                                .light_choice = path->light_choice,
                                .light_infinite = path->light_infinite,
                                .camera_distance = path->distance[0]};
}
