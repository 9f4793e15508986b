#include "path/reuse.h"

#include "math/numeric.h"

#include <assert.h>

/* ---- Density --------------------------------------------------------------------------------------------------- */

static inline float density_reuse(const ca_reuse_rules *rules, float photon_density)
{
    return rules->light_paths / ca_max(1.0f, rules->merge_area * photon_density);
}

static void fill_density(const ca_reuse_rules *rules, const ca_mis_path *path, float *camera, float *light)
{
    const uint32_t last = path->camera.count - 1;
    for (uint32_t j = 1; j <= last; j++) camera[j] = density_reuse(rules, path->camera.vertices[j].photon_density);
    for (uint32_t i = 1; i < path->light.count; i++)
        light[i] = density_reuse(rules, path->light.vertices[i].photon_density);
    if (rules->author && path->merged)
        camera[last] =
            density_reuse(rules, 0.5f * (path->camera.vertices[last].photon_density + path->merged_density));
}

/* Is the interior vertex i connectable? */
static inline bool is_connectable(const ca_mis_side *side, bool last, uint32_t i)
{
    return i + 1 == side->count ? last : side->vertices[i].connectable;
}

/* Adds up the factors of a side's connectable vertices. */
static uint32_t sum_connectable(const ca_mis_side *side, bool last, const float *factors, float *sum)
{
    uint32_t count = 0;
    for (uint32_t i = 1; i < side->count; i++) {
        if (!is_connectable(side, last, i)) continue;
        *sum += factors[i];
        count++;
    }
    return count;
}

/* Of all interior vertices: the last of a camera path that hit a light is none. */
static uint32_t sum_interior(const ca_mis_path *path, const float *camera, const float *light, float *sum)
{
    const uint32_t end = path->light.count == 0 ? path->camera.count - 1 : path->camera.count;
    uint32_t count = 0;
    for (uint32_t j = 1; j < end; j++, count++) *sum += camera[j];
    for (uint32_t i = 1; i < path->light.count; i++, count++) *sum += light[i];
    return count;
}

/* What merges lose at crowded vertices they gain at others: the mean stays N_F. */
static void normalise(const ca_reuse_rules *rules, const ca_mis_path *path, bool camera_last, bool light_last,
                      float *camera, float *light)
{
    float sum = 0.0f;
    uint32_t count;
    if (rules->author) {
        count = sum_interior(path, camera, light, &sum);
    } else {
        count = sum_connectable(&path->camera, camera_last, camera, &sum);
        count += sum_connectable(&path->light, light_last, light, &sum);
    }
    if (count == 0) return;
    const float scale = rules->light_paths * (float)count / sum;
    for (uint32_t j = 1; j < path->camera.count; j++) camera[j] *= scale;
    for (uint32_t i = 1; i < path->light.count; i++) light[i] *= scale;
}

/* ---- Footprint ------------------------------------------------------------------------------------------------- */

/* What does not change along a path in equation 8c. */
typedef struct footprint_ratio {
    float exponent;      /* 2 + c */
    bool fifth;          /* c = 1/2: the exponent is 5 on the roots of the areas, which needs no powf */
    float choice;        /* p_0 of the light; the camera's is 1 */
    float choice_raised; /* to the exponent 5/2 */
    float light_paths, inverse_light_paths;
} footprint_ratio;

static inline footprint_ratio footprint_ratio_of(const ca_reuse_rules *rules, float light_choice)
{
    return (footprint_ratio){.exponent = 2.0f + rules->c,
                             .fifth = rules->c == 0.5f,
                             .choice = light_choice,
                             .choice_raised = ca_sqr(light_choice) * sqrtf(light_choice),
                             .light_paths = rules->light_paths,
                             .inverse_light_paths = 1.0f / rules->light_paths};
}

/* n from the square roots of the two areas. The light's may be 0 and the power may overflow: then reuse gains
 * nothing. */
static inline float footprint_reuse(const footprint_ratio *r, float sqrt_area_camera, float sqrt_area_light)
{
    const float q = sqrt_area_camera / sqrt_area_light, q2 = ca_sqr(q);
    const float x = r->fifth ? r->choice_raised * (ca_sqr(q2) * q) : powf(r->choice * q2, r->exponent);
    const float n = (x + 1.0f) / (x + r->inverse_light_paths);
    return x < 1e30f ? ca_min(n, r->light_paths) : 1.0f;
}

/* The footprint of one end as it goes on through the other side's vertices, from its last to v[1]. */
typedef struct footprint {
    float sqrt_area, sqrt_omega;
    float spread, cos_ratio; /* of the event at the vertex it has reached; the ratio as walked from the other end */
} footprint;

static inline footprint footprint_arrive(const ca_mis_side *side)
{
    return (footprint){side->sqrt_area, side->sqrt_omega, side->spread, side->cos_ratio};
}

/* From `here` to the vertex before (8a, 8b). */
static inline void footprint_go_on(footprint *f, bool projected, const ca_path_vertex *here)
{
    const ca_path_vertex *before = here - 1;
    if (projected) f->sqrt_area *= sqrtf(1.0f / f->cos_ratio);
    f->sqrt_omega += f->spread;
    f->sqrt_area += here->distance * f->sqrt_omega;
    f->spread = before->spread_reverse;
    f->cos_ratio = before->cos_ratio;
}

static void fill_footprint(const ca_reuse_rules *rules, const ca_mis_path *path, float *camera, float *light)
{
    const footprint_ratio ratio = footprint_ratio_of(rules, path->light_choice);
    footprint from_light = footprint_arrive(&path->camera);
    for (uint32_t j = path->camera.count; j-- > 1;) {
        const ca_path_vertex *v = &path->camera.vertices[j];
        camera[j] = footprint_reuse(&ratio, v->sqrt_area, from_light.sqrt_area);
        footprint_go_on(&from_light, rules->projected, v);
    }
    footprint from_camera = footprint_arrive(&path->light);
    for (uint32_t i = path->light.count; i-- > 1;) {
        const ca_path_vertex *v = &path->light.vertices[i];
        light[i] = footprint_reuse(&ratio, from_camera.sqrt_area, v->sqrt_area);
        footprint_go_on(&from_camera, rules->projected, v);
    }
}

/* ---- Correlation ----------------------------------------------------------------------------------------------- */

/* tan 1 degree: paths whose vertices all lie within so much of the first camera segment's length are alike. */
#define ALIKE_TAN 0.017455065f

/* Chance that another path which came as far has its next vertex in the area, too. Behind a Dirac event it follows
 * from the one before (and the density there is no density: path_vertex.h). */
static inline double alike(bool after_dirac, float pdf, float area)
{
    return after_dirac ? 1.0 : (double)ca_min(pdf * area, 1.0f);
}

/* As the other side samples vertex i of this one. */
static inline float pdf_from_other(const ca_mis_side *side, uint32_t i)
{
    return i + 1 == side->count   ? side->pdf_last.v
           : i + 2 == side->count ? side->pdf_before.v
                                  : side->vertices[i].pdf_reverse.v;
}

/* n where camera paths and light paths are alike with these chances. */
static inline float correlation_reuse(const ca_reuse_rules *rules, double camera, double light)
{
    const double either = camera + light - camera * light;
    return either > 0.0 ? (float)((double)rules->light_paths * (camera / either)) : rules->light_paths;
}

/* The light's own vertex: an area light's point, else only which light it is (a direction has no area to compare
 * with). */
static double alike_light_ends(const ca_mis_path *path, float area)
{
    const ca_pdf_area pdf = path->light.count > 0 ? path->light.vertices[0].pdf_forward : path->camera.pdf_last;
    const float sqrt_area = path->light.count > 0 ? path->light.vertices[0].sqrt_area : path->camera.sqrt_area;
    return path->light_infinite || sqrt_area == 0.0f ? (double)path->light_choice : alike(false, pdf.v, area);
}

/* A subpath as it is followed from vertex to vertex: through its own side, then backwards through the other. */
typedef struct alike_walk {
    double chance; /* that another one is alike so far; double, since on long paths it gets tiny */
    bool after_dirac;
    float area;
} alike_walk;

static inline double alike_step(alike_walk *w, const ca_mis_side *side, bool last, uint32_t i, bool backwards)
{
    const float pdf = backwards ? pdf_from_other(side, i) : side->vertices[i].pdf_forward.v;
    w->chance *= alike(w->after_dirac, pdf, w->area);
    w->after_dirac = !is_connectable(side, last, i);
    return w->chance;
}

static void fill_correlation(const ca_reuse_rules *rules, const ca_mis_path *path, bool camera_last, bool light_last,
                             float *camera, float *light)
{
    const ca_mis_side *c = &path->camera, *l = &path->light;
    double camera_chance[CA_PATH_MAX_VERTICES], light_chance[CA_PATH_MAX_VERTICES]; /* of camera paths */
    const uint32_t t = l->count;
    /* Surfaces of the camera's side: a path that hit the light has that as its last vertex. */
    const uint32_t s = t == 0 ? c->count - 1 : c->count;
    const float area = CA_PI * ca_sqr(path->camera_distance * ALIKE_TAN);

    alike_walk walk = {.chance = 1.0, .area = area};
    for (uint32_t j = 1; j < s; j++) camera_chance[j] = alike_step(&walk, c, camera_last, j, false);
    for (uint32_t i = t; i-- > 1;) light_chance[i] = alike_step(&walk, l, light_last, i, true);

    walk = (alike_walk){.chance = alike_light_ends(path, area), .area = area};
    for (uint32_t i = 1; i < t; i++)
        light[i] = correlation_reuse(rules, light_chance[i], alike_step(&walk, l, light_last, i, false));
    for (uint32_t j = s; j-- > 1;)
        camera[j] = correlation_reuse(rules, camera_chance[j], alike_step(&walk, c, camera_last, j, true));

    /* Camera paths of a pixel all differ at their first vertex: merges there are not correlated. */
    if (s > 1) camera[1] = rules->light_paths;
    else if (t > 1) light[t - 1] = rules->light_paths;
}

void ca_reuse_fill(const ca_reuse_rules *rules, const ca_mis_path *path, bool camera_last, bool light_last,
                   float *camera, float *light)
{
    switch (rules->kind) {
    case CA_REUSE_FULL:
        for (uint32_t j = 1; j < path->camera.count; j++) camera[j] = rules->light_paths;
        for (uint32_t i = 1; i < path->light.count; i++) light[i] = rules->light_paths;
        return;
    case CA_REUSE_DENSITY: fill_density(rules, path, camera, light); return;
    case CA_REUSE_NORMALISED:
        fill_density(rules, path, camera, light);
        normalise(rules, path, camera_last, light_last, camera, light);
        return;
    case CA_REUSE_FOOTPRINT: fill_footprint(rules, path, camera, light); return;
    case CA_REUSE_CORRELATION: fill_correlation(rules, path, camera_last, light_last, camera, light); return;
    case CA_REUSE_KIND_COUNT: assert(false && "unknown reuse rule");
    }
}
