#include "path/reuse.h"

#include "math/numeric.h"

/* ---- Footprints ----------------------------------------------------------------------------------------------------- */

/* n of equation 8c from the square roots of the two footprints. */
static inline float footprint_reuse(const ca_reuse_rules *rules, float light_choice, float sqrt_area_camera,
                                    float sqrt_area_light)
{
    const float area_ratio = light_choice * ca_sqr(sqrt_area_camera / sqrt_area_light);
    const float x = rules->c == 0.5f ? ca_sqr(area_ratio) * sqrtf(area_ratio) : powf(area_ratio, 2.0f + rules->c);
    const float n = (x + 1.0f) / (x + 1.0f / rules->light_paths);
    return x < 1e30f ? n : 1.0f; /* also where the light's footprint is a point */
}

/* Footprints of one end as they go on through the other side's vertices, from its last to v[1]. */
typedef struct footprint {
    float sqrt_area, sqrt_omega;
} footprint;

static inline footprint arrive(const ca_mis_side *side)
{
    return (footprint){side->sqrt_area, side->sqrt_omega};
}

/* From vertex i of the other side to the one before (8a, 8b). */
static inline void go_on(const ca_reuse_rules *rules, const ca_mis_side *side, uint32_t i, footprint *f)
{
    const ca_path_vertex *v = &side->vertices[i];
    const bool last = i + 1 == side->count;
    const float spread = last ? side->spread : v->spread_reverse;
    if (rules->projected) f->sqrt_area *= sqrtf(1.0f / (last ? side->cos_ratio : v->cos_ratio));
    f->sqrt_omega += spread;
    f->sqrt_area += v->distance * f->sqrt_omega;
}

static void fill_footprint(const ca_reuse_rules *rules, const ca_mis_path *path, float *camera, float *light)
{
    footprint from_light = arrive(&path->camera);
    for (uint32_t j = path->camera.count - 1; j >= 1; j--) {
        camera[j] = footprint_reuse(rules, path->light_choice, path->camera.vertices[j].sqrt_area, from_light.sqrt_area);
        go_on(rules, &path->camera, j, &from_light);
    }
    footprint from_camera = arrive(&path->light);
    for (uint32_t i = path->light.count; i-- > 1;) {
        light[i] = footprint_reuse(rules, path->light_choice, from_camera.sqrt_area, path->light.vertices[i].sqrt_area);
        go_on(rules, &path->light, i, &from_camera);
    }
}

/* ---- Density -------------------------------------------------------------------------------------------------------- */

static inline float density_reuse(const ca_reuse_rules *rules, const ca_path_vertex *v)
{
    return rules->light_paths / ca_max(1.0f, rules->merge_area * v->photon_density);
}

static void fill_density(const ca_reuse_rules *rules, const ca_mis_path *path, float *camera, float *light)
{
    for (uint32_t j = 1; j < path->camera.count; j++) camera[j] = density_reuse(rules, &path->camera.vertices[j]);
    for (uint32_t i = 1; i < path->light.count; i++) light[i] = density_reuse(rules, &path->light.vertices[i]);
}

/* Adds up the factors of a side's connectable vertices. */
static uint32_t sum_connectable(const ca_mis_side *side, bool last, const float *factors, float *sum)
{
    uint32_t count = 0;
    for (uint32_t i = 1; i < side->count; i++) {
        const bool counts = i + 1 == side->count ? last : side->vertices[i].connectable;
        if (!counts) continue;
        *sum += factors[i];
        count++;
    }
    return count;
}

/* What merges lose at crowded vertices they gain at others: the mean stays N_F. */
static void normalise(const ca_reuse_rules *rules, const ca_mis_path *path, bool camera_last, bool light_last,
                      float *camera, float *light)
{
    float sum = 0.0f;
    uint32_t count = sum_connectable(&path->camera, camera_last, camera, &sum);
    count += sum_connectable(&path->light, light_last, light, &sum);
    if (count == 0) return;
    const float scale = rules->light_paths * (float)count / sum;
    for (uint32_t j = 1; j < path->camera.count; j++) camera[j] *= scale;
    for (uint32_t i = 1; i < path->light.count; i++) light[i] *= scale;
}

/* ---- Correlation ---------------------------------------------------------------------------------------------------- */

/* tan 1 degree: paths whose vertices all lie within so much of the first camera segment's length are alike. */
#define ALIKE_TAN 0.01745506f

/* Probability, or 1, that another path's vertex lies in the area. */
static inline float alike(float pdf, float area) { return ca_min(pdf * area, 1.0f); }

/* As the other side samples vertex i of this one. */
static inline float pdf_from_other(const ca_mis_side *side, uint32_t i)
{
    return i + 1 == side->count   ? side->pdf_last.v
           : i + 2 == side->count ? side->pdf_before.v
                                  : side->vertices[i].pdf_reverse.v;
}

/* n for the probabilities that camera paths and light paths up to a vertex are alike. */
static inline float correlation_reuse(const ca_reuse_rules *rules, float camera, float light)
{
    const float either = camera + light - camera * light;
    return either > 0.0f ? rules->light_paths * camera / either : rules->light_paths;
}

/* The light's own vertex: an area light's point, else only which light it is (a direction has no area to compare with). */
static float alike_light_ends(const ca_mis_path *path, float area)
{
    const ca_pdf_area pdf = path->light.count > 0 ? path->light.vertices[0].pdf_forward : path->camera.pdf_last;
    const float sqrt_area = path->light.count > 0 ? path->light.vertices[0].sqrt_area : path->camera.sqrt_area;
    return path->light_infinite || sqrt_area == 0.0f ? path->light_choice : alike(pdf.v, area);
}

static void fill_correlation(const ca_reuse_rules *rules, const ca_mis_path *path, float *camera, float *light)
{
    const ca_mis_side *c = &path->camera, *l = &path->light;
    const float area = CA_PI * ca_sqr(path->camera_distance * ALIKE_TAN);
    /* Surfaces of the camera's side: a path that hit the light has that as its last vertex. */
    const uint32_t camera_surfaces = l->count == 0 ? c->count - 1 : c->count;
    float product = 1.0f;
    for (uint32_t j = 1; j < camera_surfaces; j++) camera[j] = product *= alike(c->vertices[j].pdf_forward.v, area);
    for (uint32_t i = l->count; i-- > 1;) light[i] = product *= alike(pdf_from_other(l, i), area);

    product = alike_light_ends(path, area);
    for (uint32_t i = 1; i < l->count; i++) {
        product *= alike(l->vertices[i].pdf_forward.v, area);
        light[i] = correlation_reuse(rules, light[i], product);
    }
    for (uint32_t j = camera_surfaces; j-- > 1;) {
        product *= alike(pdf_from_other(c, j), area);
        camera[j] = correlation_reuse(rules, camera[j], product);
    }
    /* Camera paths of a pixel all differ at their first vertex: merges there are not correlated. */
    float *first = c->count > 1 ? &camera[1] : &light[l->count - 1];
    *first = rules->light_paths;
}

void ca_reuse_fill(const ca_reuse_rules *rules, const ca_mis_path *path, bool camera_last, bool light_last, float *camera,
                   float *light)
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
    case CA_REUSE_CORRELATION: fill_correlation(rules, path, camera, light); return;
    }
}
