#include "path/mis.h"

#include "math/numeric.h"

#include <stddef.h>

/* A path at its split, with what the technique says of the two vertices next to it. */
typedef struct mis_split {
    const ca_mis_rules *rules;
    const ca_path_vertex *camera, *light;
    uint32_t s, t, n;
    bool camera_last, light_last;         /* are the last vertices connectable? */
    uint32_t connectable;                 /* vertices of the whole path that are */
    uint32_t merge_first, merge_last;     /* ordinals, from the camera, of the vertices where merges are made */
    const float *reuse_camera, *reuse_light;
    const ca_technique_factors *factors;
} mis_split;

/* Where the (count * density) of the techniques go. */
typedef struct mis_sum {
    double total;            /* of all, to the power beta */
    double split, merge;     /* of the split given, and of the merge at its last camera vertex, likewise */
    double *splits, *merges; /* each for itself; NULL in the hot path */
} mis_sum;

static inline double raised(const ca_mis_rules *rules, double x) { return rules->power ? x * x : x; }

static inline bool connectable_camera(const mis_split *m, uint32_t j)
{
    return j + 1 == m->s ? m->camera_last : m->camera[j].connectable;
}

static inline bool connectable_light(const mis_split *m, uint32_t i)
{
    return i + 1 == m->t ? m->light_last : m->light[i].connectable;
}

/* Of the first `count` vertices of a subpath, whose last may differ from its record. */
static inline uint32_t count_connectable(const ca_path_vertex *vertices, uint32_t count, bool last)
{
    return count < 2 ? 0 : vertices[count - 2].connectable_count + last;
}

/* How many light paths may splat for each camera path, where the path of these camera vertices enters the picture. */
static inline double splats_of(const ca_mis_rules *rules, const ca_path_vertex *camera)
{
    return (double)rules->splat_count * (double)camera[0].splat_scale;
}

/* The technique of the split after k camera vertices, whose D_k is `ratio` times D_s. `before` and `after`: are
 * x[k-1] and x[k] connectable? */
static inline double split_term(const mis_split *m, const ca_mis_path *path, uint32_t k, double ratio, bool before,
                                bool after, mis_sum *sum)
{
    const ca_mis_rules *rules = m->rules;
    double value = 0.0;
    if (k == m->n) {
        const bool allowed =
            rules->hit == CA_HIT_ALWAYS || (rules->hit == CA_HIT_DIRECT ? m->n == 2 : m->connectable == 0);
        value = allowed ? ratio : 0.0;
    } else if (m->n == 2) {
        return 0.0;
    } else if (k == m->n - 1) {
        value = rules->next_event && before ? ratio * (double)path->next_event_ratio : 0.0;
    } else if (k == 1) {
        value = rules->splat && after ? ratio * splats_of(rules, m->camera) : 0.0;
    } else {
        value = rules->connect && before && after ? ratio : 0.0;
    }
    value *= (double)ca_split_factor(path->factors, k, m->n - k, path->light_class);
    if (sum->splits) sum->splits[k] = value;
    return raised(rules, value);
}

/* The merge at x[j], the ordinal-th connectable vertex from the camera, of density `density` D_s without area and
 * count. */
static inline double merge_term(const mis_split *m, uint32_t j, uint32_t ordinal, double density, const float *reuse,
                                mis_sum *sum)
{
    if (ordinal < m->merge_first || ordinal > m->merge_last) return 0.0;
    const double factor = (double)ca_merge_factor(m->factors, j + 1, m->n - 1 - j);
    const double value = density * (double)m->rules->merge_area * (double)*reuse * factor;
    if (sum->merges) sum->merges[j] = value;
    return raised(m->rules, value);
}

/* Techniques whose split lies on the camera's side. Moving the split from j+1 to j swaps how x[j] was sampled: factor
 * light/camera. The merge at x[j] needs it from both sides. */
static inline double camera_side(const mis_split *m, const ca_mis_path *path, mis_sum *sum)
{
    double ratio = 1.0, total = 0.0;
    bool connectable = m->s > 1 && connectable_camera(m, m->s - 1);
    for (uint32_t j = m->s - 1; j >= 1; j--) {
        const ca_path_vertex *v = &m->camera[j];
        const float pdf_light = j + 1 == m->s   ? path->camera.pdf_last.v
                                : j + 2 == m->s ? path->camera.pdf_before.v
                                                : v->pdf_reverse.v;
        const uint32_t ordinal =
            j + 1 == m->s ? count_connectable(m->camera, m->s, connectable) : v->connectable_count;
        if (connectable) {
            const double term = merge_term(m, j, ordinal, ratio * (double)pdf_light, &m->reuse_camera[j], sum);
            if (j + 1 == m->s) sum->merge = term;
            total += term;
        }
        ratio *= (double)pdf_light / (double)v->pdf_forward.v;
        if (!(ratio > 0.0)) break;
        const bool before = j > 1 && connectable_camera(m, j - 1);
        total += split_term(m, path, j, ratio, before, connectable, sum);
        connectable = before;
    }
    return total;
}

/* The same towards the light: x[n-1-i] is the light's vertex i. */
static inline double light_side(const mis_split *m, const ca_mis_path *path, mis_sum *sum)
{
    double ratio = 1.0, total = 0.0;
    bool connectable = m->t > 1 && connectable_light(m, m->t - 1);
    for (uint32_t i = m->t; i-- > 0;) {
        const ca_path_vertex *v = &m->light[i];
        const float pdf_camera = i + 1 == m->t   ? path->light.pdf_last.v
                                 : i + 2 == m->t ? path->light.pdf_before.v
                                                 : v->pdf_reverse.v;
        if (connectable) {
            const uint32_t from_light =
                i + 1 == m->t ? count_connectable(m->light, m->t, true) : v->connectable_count;
            total += merge_term(m, m->n - 1 - i, m->connectable - from_light + 1, ratio * (double)pdf_camera,
                                &m->reuse_light[i], sum);
        }
        ratio *= (double)pdf_camera / (double)v->pdf_forward.v;
        if (!(ratio > 0.0)) break;
        const bool after = i > 1 && connectable_light(m, i - 1);
        total += split_term(m, path, m->n - i, ratio, connectable, after, sum);
        connectable = after;
    }
    return total;
}

static inline mis_split split_of(const ca_mis_rules *rules, const ca_mis_path *path, ca_technique technique)
{
    mis_split m = {.rules = rules,
                   .camera = path->camera.vertices,
                   .light = path->light.vertices,
                   .s = path->camera.count,
                   .t = path->light.count,
                   .n = path->camera.count + path->light.count,
                   .factors = path->factors};
    m.camera_last = technique != CA_TECHNIQUE_HIT && m.s > 1;
    m.light_last = m.t > 1 && (technique != CA_TECHNIQUE_MERGE || m.light[m.t - 1].connectable);
    m.connectable = count_connectable(m.camera, m.s, m.camera_last) + count_connectable(m.light, m.t, m.light_last);
    m.merge_first = rules->merge == CA_MERGE_NONE   ? UINT32_MAX
                    : rules->merge == CA_MERGE_LAST ? ca_min_u32(m.connectable, rules->merge_limit)
                                                    : 1;
    m.merge_last = rules->merge_limit;
    return m;
}

/* All techniques relative to D_s. */
static inline void sum_densities(const ca_mis_rules *rules, const ca_mis_path *path, ca_technique technique,
                                 mis_sum *sum)
{
    mis_split m = split_of(rules, path, technique);
    float reuse_camera[CA_PATH_MAX_VERTICES], reuse_light[CA_PATH_MAX_VERTICES];
    if (rules->merge != CA_MERGE_NONE)
        ca_reuse_fill(&rules->reuse, path, m.camera_last, m.light_last, reuse_camera, reuse_light);
    m.reuse_camera = reuse_camera;
    m.reuse_light = reuse_light;
    sum->split = split_term(&m, path, m.s, 1.0, m.camera_last, m.light_last, sum);
    sum->total = sum->split + camera_side(&m, path, sum) + light_side(&m, path, sum);
}

/* ---- Tails ----------------------------------------------------------------------------------------------------- */

bool ca_mis_has_tails(const ca_mis_rules *rules)
{
    const bool same_reuse =
        rules->merge == CA_MERGE_NONE || (rules->merge == CA_MERGE_ALL && rules->merge_limit == UINT32_MAX &&
                                          rules->reuse.kind == CA_REUSE_FULL);
    return !rules->power && !rules->factors && rules->hit == CA_HIT_ALWAYS && same_reuse;
}

/* What a merge at any vertex brings, per density of sampling it from the other side. */
static inline double merge_factor(const ca_mis_rules *rules)
{
    return rules->merge == CA_MERGE_NONE ? 0.0 : (double)rules->merge_area * (double)rules->reuse.light_paths;
}

/* Split terms over the ratio: with the split before camera vertex k, and before the light's vertex i (as it is
 * counted from the light). `at`: is that vertex connectable? */
static inline double camera_split(const ca_mis_rules *rules, const ca_path_vertex *vertices, uint32_t k, bool at)
{
    if (k == 1) return rules->splat && at ? splats_of(rules, vertices) : 0.0;
    return rules->connect && at && vertices[k - 1].connectable ? 1.0 : 0.0;
}

static inline double light_split(const ca_mis_rules *rules, const ca_path_vertex *vertices, uint32_t i, bool at)
{
    if (i == 0) return 1.0;
    if (i == 1) return rules->next_event && at ? (double)vertices[0].next_event_ratio : 0.0;
    return rules->connect && at && vertices[i - 1].connectable ? 1.0 : 0.0;
}

/* One more vertex, `v`, on whose other side the split lies, over its density as sampled from that side. */
static inline double grow_tail(const ca_path_vertex *v, double merge, double split, double before)
{
    return merge + (split + before) / (double)v->pdf_forward.v;
}

/* A light's vertex i, whose event has happened. */
static inline double grow_light_tail(const ca_mis_rules *rules, const ca_path_vertex *vertices, uint32_t i,
                                     double before)
{
    const bool connectable = i > 0 && vertices[i].connectable;
    return grow_tail(&vertices[i], connectable ? merge_factor(rules) : 0.0,
                     light_split(rules, vertices, i, connectable), before);
}

double ca_mis_camera_tail(const ca_mis_rules *rules, const ca_path_vertex *vertices, uint32_t last, double before)
{
    if (!rules->has_tails) return CA_MIS_NO_TAIL;
    if (last < 3) return 0.0;
    const ca_path_vertex *v = &vertices[last - 2];
    return (double)v->pdf_reverse.v * grow_tail(v, v->connectable ? merge_factor(rules) : 0.0,
                                                camera_split(rules, vertices, last - 2, v->connectable), before);
}

double ca_mis_light_tail(const ca_mis_rules *rules, const ca_path_vertex *vertices, uint32_t last, double before)
{
    if (!rules->has_tails) return CA_MIS_NO_TAIL;
    if (last < 2) return 0.0;
    return (double)vertices[last - 2].pdf_reverse.v * grow_light_tail(rules, vertices, last - 2, before);
}

ca_photon_sums ca_mis_photon_sums(const ca_mis_rules *rules, const ca_path_vertex *vertices, uint32_t last,
                                  double tail)
{
    const ca_path_vertex *photon = &vertices[last];
    return (ca_photon_sums){
        .pdf_forward = photon->pdf_forward.v,
        .split = (float)light_split(rules, vertices, last, true),
        .towards = (float)((double)photon->to_previous * grow_light_tail(rules, vertices, last - 1, tail))};
}

/* Techniques with the split at or before the side's last vertex, over D_s. split_last, split_before: of the last two
 * vertices; `second`: is there a second one? */
static inline double side_total(const ca_mis_side *side, double merge_last, double merge_before, double split_last,
                                double split_before, bool second)
{
    const ca_path_vertex *v = &side->vertices[side->count - 1];
    double inside = split_last;
    if (second)
        inside += (double)side->pdf_before.v *
                  (merge_before + (split_before + side->tail) / (double)(v - 1)->pdf_forward.v);
    return (double)side->pdf_last.v * (merge_last + inside / (double)v->pdf_forward.v);
}

static inline double camera_total(const ca_mis_rules *rules, const ca_mis_side *side)
{
    const uint32_t last = side->count - 1;
    if (last == 0) return 0.0;
    const ca_path_vertex *v = side->vertices;
    const bool second = last > 1, connectable = second && v[last - 1].connectable;
    const double merge = merge_factor(rules);
    return side_total(side, merge, connectable ? merge : 0.0, camera_split(rules, v, last, true),
                      second ? camera_split(rules, v, last - 1, connectable) : 0.0, second);
}

static inline double light_total(const ca_mis_rules *rules, const ca_mis_side *side)
{
    const uint32_t last = side->count - 1;
    const ca_path_vertex *v = side->vertices;
    const bool second = last > 0, connectable = last > 1 && v[last - 1].connectable;
    const double merge = merge_factor(rules);
    return side_total(side, second ? merge : 0.0, connectable ? merge : 0.0, light_split(rules, v, last, true),
                      second ? light_split(rules, v, last - 1, connectable) : 0.0, second);
}

/* The weight of next event, a connection or a splat whose sides have tails. */
static inline float weight_by_tails(const ca_mis_rules *rules, const ca_mis_path *path, ca_technique technique)
{
    const double own = technique == CA_TECHNIQUE_SPLAT        ? splats_of(rules, path->camera.vertices)
                       : technique == CA_TECHNIQUE_NEXT_EVENT ? (double)path->next_event_ratio
                                                              : 1.0;
    const double total = own + camera_total(rules, &path->camera) + light_total(rules, &path->light);
    return own > 0.0 ? (float)(own / total) : 0.0f;
}

float ca_mis_merge_weight(const ca_mis_rules *rules, const ca_mis_side *camera, const ca_photon_sums *photon,
                          float pdf)
{
    const double own = (double)camera->pdf_last.v * merge_factor(rules);
    const double total =
        (double)photon->split + camera_total(rules, camera) + (double)photon->towards * (double)pdf;
    return own > 0.0 ? (float)(own / total) : 0.0f;
}

static inline bool has_tails(const ca_mis_rules *rules, const ca_mis_path *path, ca_technique technique)
{
    return rules->has_tails && technique != CA_TECHNIQUE_HIT && technique != CA_TECHNIQUE_MERGE &&
           path->camera.tail >= 0.0 && path->light.tail >= 0.0;
}

/* ---- Weights --------------------------------------------------------------------------------------------------- */

/* Light tracing, and photon mapping at the first vertex, have one way for each path that they find. */
bool ca_mis_has_one_technique(const ca_mis_rules *rules)
{
    if (rules->next_event || rules->connect) return false;
    if (rules->hit == CA_HIT_DIRECT) return rules->merge == CA_MERGE_NONE;
    return rules->hit == CA_HIT_UNMERGEABLE && !rules->splat && rules->merge != CA_MERGE_NONE &&
           rules->merge_limit <= 1;
}

static inline float weight_of_one(const ca_mis_rules *rules, const ca_mis_path *path, ca_technique technique)
{
    if (technique != CA_TECHNIQUE_HIT) return 1.0f;
    const uint32_t n = path->camera.count;
    const bool direct = n == 2;
    if (direct || rules->hit == CA_HIT_DIRECT) return direct ? 1.0f : 0.0f;
    return path->camera.vertices[n - 2].connectable_count == 0 ? 1.0f : 0.0f;
}

float ca_mis_weight(const ca_mis_rules *rules, const ca_mis_path *path, ca_technique technique)
{
    if (ca_mis_has_one_technique(rules)) return weight_of_one(rules, path, technique);
    if (has_tails(rules, path, technique)) return weight_by_tails(rules, path, technique);
    mis_sum sum = {0};
    sum_densities(rules, path, technique, &sum);
    const double own = technique == CA_TECHNIQUE_MERGE ? sum.merge : sum.split;
    return own > 0.0 ? (float)(own / sum.total) : 0.0f;
}

double ca_mis_total(const ca_mis_rules *rules, const ca_mis_path *path, ca_technique technique, double *own)
{
    ca_mis_rules counts = *rules;
    counts.power = false;
    mis_sum sum = {0};
    sum_densities(&counts, path, technique, &sum);
    if (own) *own = technique == CA_TECHNIQUE_MERGE ? sum.merge : sum.split;
    return sum.total;
}

void ca_mis_densities(const ca_mis_rules *rules, const ca_mis_path *path, ca_technique technique, double *splits,
                      double *merges)
{
    const uint32_t n = path->camera.count + path->light.count;
    for (uint32_t k = 0; k <= n; k++) splits[k] = 0.0;
    for (uint32_t j = 0; j < n; j++) merges[j] = 0.0;
    mis_sum sum = {.splits = splits, .merges = merges};
    sum_densities(rules, path, technique, &sum);
}
