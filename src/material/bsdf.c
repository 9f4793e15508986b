#include "material/bsdf.h"

#include "math/numeric.h"
#include "sampling/warp.h"

static const ca_bsdf_value ZERO_VALUE;

/* On the same side of both normals, and clearly so. */
static inline bool sides_agree(float cos_ns, float cos_ng)
{
    return fabsf(cos_ns) > CA_GRAZING_COS && fabsf(cos_ng) > CA_GRAZING_COS && (cos_ns > 0.0f) == (cos_ng > 0.0f);
}

/* The sign of local z. A factor, not a branch: which side a path is on cannot be predicted. */
static inline float lobe_side(const ca_bsdf_lobe *lobe) { return lobe->flipped ? -1.0f : 1.0f; }

static inline ca_vec3 lobe_to_local(const ca_bsdf_lobe *lobe, const ca_frame *frame, ca_vec3 w_world)
{
    ca_vec3 w = ca_to_local(frame, w_world);
    w.z *= lobe_side(lobe);
    return w;
}

static inline ca_vec3 lobe_to_world(const ca_bsdf_lobe *lobe, const ca_frame *frame, ca_vec3 w_local)
{
    w_local.z *= lobe_side(lobe);
    return ca_to_world(frame, w_local);
}

/* ---- The elementary BSDF, under its coat if it has one --------------------------------------------------------- */

static inline ca_bxdf_value lobe_eval(const ca_bsdf_lobe *lobe, ca_vec3 wi, ca_vec3 wo, ca_from from)
{
    if (lobe->coated) return ca_coat_eval(&lobe->coat, &lobe->bxdf, wi, wo, from);
    return ca_bxdf_eval(&lobe->bxdf, wi, wo, from);
}

static inline bool lobe_sample_direction(const ca_bsdf_lobe *lobe, ca_vec3 wi, float u_lobe, ca_vec2 u, ca_from from,
                                         ca_bxdf_sample *sample)
{
    if (lobe->coated) return ca_coat_sample(&lobe->coat, &lobe->bxdf, wi, u_lobe, u, from, sample);
    return ca_bxdf_sample_direction(&lobe->bxdf, wi, u_lobe, u, from, sample);
}

static inline ca_rgb lobe_albedo(const ca_bsdf_lobe *lobe, ca_vec3 wi)
{
    return lobe->coated ? ca_coat_albedo(&lobe->coat, &lobe->bxdf, wi) : ca_bxdf_albedo(&lobe->bxdf, wi);
}

/* ---- Perturbed normals ----------------------------------------------------------------------------------------- */

/* Does the eye see the lobe's normal leaning the other way? */
static inline bool is_turned(const ca_bsdf_lobe *lobe, ca_vec3 w_eye)
{
    return lobe->turns && ca_dot(lobe->frame.n, w_eye) * ca_dot(lobe->ns, w_eye) < 0.0f;
}

/* The lobe's frame, or the one whose normal leans the other way; returns one of them. */
static inline const ca_frame *frame_of(const ca_bsdf_lobe *lobe, bool turned, ca_frame *made)
{
    if (!turned) return &lobe->frame;
    const ca_vec3 n = ca_madd(ca_neg(lobe->frame.n), 2.0f * ca_dot(lobe->frame.n, lobe->ns), lobe->ns);
    *made = ca_frame_from_tangent(n, lobe->frame.s);
    return made;
}

/* Probability that a path from the light takes the turned normal: only those directions on the surface need it that
 * the other does not face, so it grows with the angle between normal and surface (with its sine, which gives the
 * least second moment where both reflect the same). 0 or 1 where light reaches the front of only one. */
static float turned_share(const ca_bsdf *bsdf, const ca_bsdf_lobe *lobe, ca_vec3 w_light)
{
    if (!lobe->turns) return 0.0f;
    const float lean = ca_dot(lobe->frame.n, lobe->ns), cos_ng = ca_dot(bsdf->ng, w_light);
    const float cos_n = ca_dot(lobe->frame.n, w_light);
    if (!sides_agree(2.0f * lean * ca_dot(lobe->ns, w_light) - cos_n, cos_ng)) return 0.0f;
    if (!sides_agree(cos_n, cos_ng)) return 1.0f;
    const float sine = sqrtf(ca_max(0.0f, 1.0f - lean * lean));
    return sine / (1.0f + sine);
}

/* The probability that a path from the light has the normal that its other end sees. */
static float light_share(const ca_bsdf *bsdf, const ca_bsdf_lobe *lobe, bool turned, ca_vec3 w_light)
{
    const float share = turned_share(bsdf, lobe, w_light);
    return turned ? share : 1.0f - share;
}

/* G of bsdf.h. */
static inline float shadowing(const ca_bsdf_lobe *lobe, ca_vec3 w_light)
{
    if (lobe->shadow == 0.0f) return 1.0f;
    const float cosine = ca_dot(lobe->ns, w_light), cos2 = ca_max(cosine * cosine, 1e-12f);
    return 2.0f / (1.0f + sqrtf(1.0f + lobe->shadow * ca_max(0.0f, 1.0f - cos2) / cos2));
}

/* ---- Values ---------------------------------------------------------------------------------------------------- */

/* Cosines with the geometric normal, of a pair of directions. */
typedef struct pair_cosines {
    float i, o;
} pair_cosines;

/* |w_light . ns| / |w_light . ng| */
static inline float shading_ratio(pair_cosines ns, pair_cosines ng, ca_from from)
{
    return from == CA_FROM_CAMERA ? fabsf(ns.o / ng.o) : fabsf(ns.i / ng.i);
}

/* Adds a lobe's share to the sums. */
static inline void add_lobe_value(const ca_bsdf *bsdf, const ca_bsdf_lobe *lobe, ca_vec3 wi_world, ca_vec3 wo_world,
                                  pair_cosines cos_ng, ca_from from, ca_bsdf_value *sum)
{
    const ca_vec3 w_eye = from == CA_FROM_CAMERA ? wi_world : wo_world;
    const ca_vec3 w_light = from == CA_FROM_CAMERA ? wo_world : wi_world;
    ca_frame made;
    const bool turned = is_turned(lobe, w_eye);
    const ca_frame *frame = frame_of(lobe, turned, &made);
    const pair_cosines cos_ns = {ca_dot(frame->n, wi_world), ca_dot(frame->n, wo_world)};
    if (!sides_agree(cos_ns.i, cos_ng.i) || !sides_agree(cos_ns.o, cos_ng.o)) return;
    const ca_bxdf_value value =
        lobe_eval(lobe, lobe_to_local(lobe, frame, wi_world), lobe_to_local(lobe, frame, wo_world), from);
    const float scale = shading_ratio(cos_ns, cos_ng, from) * shadowing(lobe, w_light);
    const float share = light_share(bsdf, lobe, turned, w_light);
    sum->f = ca_rgb_madd(sum->f, lobe->weight * scale, value.f);
    sum->pdf.v += lobe->weight * (from == CA_FROM_LIGHT ? share : 1.0f) * value.pdf.v;
    sum->pdf_reverse.v += lobe->weight * (from == CA_FROM_CAMERA ? share : 1.0f) * value.pdf_reverse.v;
}

/* Diffuse without a coat, and of one normal. */
static inline bool is_plain_diffuse(const ca_bsdf_lobe *lobe)
{
    return lobe->bxdf.kind == CA_BXDF_DIFFUSE && !lobe->turns && lobe->shadow == 0.0f && !lobe->coated;
}

/* A single diffuse leaf needs cosines only, no local directions. */
static inline ca_bsdf_value eval_diffuse(const ca_bsdf_lobe *lobe, ca_vec3 wi_world, ca_vec3 wo_world,
                                         pair_cosines cos_ng, ca_from from)
{
    const float side = lobe_side(lobe);
    const pair_cosines cos_ns = {ca_dot(lobe->frame.n, wi_world) * side, ca_dot(lobe->frame.n, wo_world) * side};
    if (!(cos_ns.i > CA_GRAZING_COS && cos_ns.o > CA_GRAZING_COS && cos_ng.i * side > CA_GRAZING_COS &&
          cos_ng.o * side > CA_GRAZING_COS))
        return ZERO_VALUE;
    const float scale = lobe->weight * CA_INV_PI;
    return (ca_bsdf_value){
        .f = ca_rgb_scale(lobe->bxdf.as.diffuse.reflectance, scale * shading_ratio(cos_ns, cos_ng, from)),
        .pdf = {cos_ns.o * scale},
        .pdf_reverse = {cos_ns.i * scale}};
}

ca_bsdf_value ca_bsdf_eval(const ca_bsdf *bsdf, ca_vec3 wi_world, ca_vec3 wo_world, ca_from from)
{
    const pair_cosines cos_ng = {ca_dot(bsdf->ng, wi_world), ca_dot(bsdf->ng, wo_world)};
    if (bsdf->lobe_count == 1 && is_plain_diffuse(&bsdf->lobes[0]))
        return eval_diffuse(&bsdf->lobes[0], wi_world, wo_world, cos_ng, from);

    ca_bsdf_value sum = ZERO_VALUE;
    if (!(bsdf->scatter & CA_SCATTER_SMOOTH)) return sum;
    if (!(bsdf->scatter & CA_SCATTER_TRANSMISSION) && cos_ng.i * cos_ng.o <= 0.0f) return sum;
    for (uint32_t i = 0; i < bsdf->lobe_count; ++i)
        add_lobe_value(bsdf, &bsdf->lobes[i], wi_world, wo_world, cos_ng, from, &sum);
    return sum;
}

/* The lobe whose share of [0, 1) holds *u, which becomes its place in that share; NULL for the null part. The last
 * lobe also takes what rounding leaves over. */
static const ca_bsdf_lobe *choose_lobe(const ca_bsdf *bsdf, float *u)
{
    if (bsdf->lobe_count == 0) return NULL;
    if (bsdf->lobe_count == 1 && bsdf->null_weight == 0.0f) return &bsdf->lobes[0];
    float rest = *u - bsdf->null_weight;
    if (rest < 0.0f) return NULL;
    uint32_t i = 0;
    while (i + 1 < bsdf->lobe_count && rest >= bsdf->lobes[i].weight) rest -= bsdf->lobes[i++].weight;
    *u = ca_clamp(rest / bsdf->lobes[i].weight, 0.0f, CA_ONE_MINUS_EPSILON);
    return &bsdf->lobes[i];
}

static bool sample_null(const ca_bsdf *bsdf, ca_vec3 wi_world, ca_bsdf_sample *sample)
{
    if (bsdf->null_weight == 0.0f) return false;
    *sample = (ca_bsdf_sample){.wo_world = ca_neg(wi_world),
                               .weight = {1.0f, 1.0f, 1.0f},
                               .pdf = {bsdf->null_weight},
                               .pdf_reverse = {bsdf->null_weight},
                               .scatter = CA_SCATTER_NULL | CA_SCATTER_DIRAC,
                               .eta = 1.0f};
    return true;
}

/* The same for sampling. `side` times a cosine is positive in front of the lobe. */
static bool sample_diffuse(const ca_bsdf *bsdf, ca_vec3 wi_world, ca_vec2 u, ca_from from, ca_bsdf_sample *sample)
{
    const ca_bsdf_lobe *lobe = &bsdf->lobes[0];
    const float side = lobe_side(lobe);
    const float cos_ns_i = ca_dot(lobe->frame.n, wi_world) * side, cos_ng_i = ca_dot(bsdf->ng, wi_world) * side;
    if (!(cos_ns_i > CA_GRAZING_COS && cos_ng_i > CA_GRAZING_COS)) return false;
    const ca_vec3 wo_local = ca_warp_cosine_hemisphere(u);
    const ca_vec3 wo_world = lobe_to_world(lobe, &lobe->frame, wo_local);
    const float cos_ng_o = ca_dot(bsdf->ng, wo_world) * side;
    if (!(wo_local.z > CA_GRAZING_COS && cos_ng_o > CA_GRAZING_COS)) return false;

    const ca_rgb reflectance = lobe->bxdf.as.diffuse.reflectance;
    sample->wo_world = wo_world;
    sample->weight = from == CA_FROM_CAMERA
                         ? reflectance
                         : ca_rgb_scale(reflectance, cos_ns_i * cos_ng_o / (cos_ng_i * wo_local.z));
    sample->pdf.v = wo_local.z * CA_INV_PI;
    sample->pdf_reverse.v = cos_ns_i * CA_INV_PI;
    sample->scatter = CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH;
    sample->eta = 1.0f;
    return true;
}

/* Weight and pdfs of a smooth sample that any of several lobes could have given. */
static bool finish_mixture(const ca_bsdf *bsdf, ca_vec3 wi_world, ca_from from, ca_bsdf_sample *sample)
{
    const ca_bsdf_value value = ca_bsdf_eval(bsdf, wi_world, sample->wo_world, from);
    if (!(value.pdf.v > 0.0f)) return false;
    sample->weight = ca_rgb_scale(value.f, ca_abs_dot(bsdf->ng, sample->wo_world) / value.pdf.v);
    sample->pdf = value.pdf;
    sample->pdf_reverse = value.pdf_reverse;
    return true;
}

/* What a lobe has sampled, in its own frame, and in the world. */
typedef struct lobe_sample {
    ca_bxdf_sample local;
    ca_vec3 wo_world;
    pair_cosines cos_ns, cos_ng;
    float light_share; /* of the normal that was taken: probability for a path from the light */
} lobe_sample;

/* From the camera the normal is known; from the light *u chooses it, and becomes its place in the choice's share. */
static bool take_turned(const ca_bsdf *bsdf, const ca_bsdf_lobe *lobe, ca_vec3 wi_world, ca_from from, float *u)
{
    if (!lobe->turns) return false;
    if (from == CA_FROM_CAMERA) return is_turned(lobe, wi_world);
    const float share = turned_share(bsdf, lobe, wi_world);
    const bool turned = *u < share;
    *u = ca_clamp(turned ? *u / share : (*u - share) / (1.0f - share), 0.0f, CA_ONE_MINUS_EPSILON);
    return turned;
}

static bool sample_lobe(const ca_bsdf *bsdf, const ca_bsdf_lobe *lobe, ca_vec3 wi_world, float u_lobe, ca_vec2 u,
                        ca_from from, lobe_sample *s)
{
    ca_frame made;
    const bool turned = take_turned(bsdf, lobe, wi_world, from, &u_lobe);
    const ca_frame *frame = frame_of(lobe, turned, &made);
    s->cos_ns.i = ca_dot(frame->n, wi_world);
    s->cos_ng.i = ca_dot(bsdf->ng, wi_world);
    if (!sides_agree(s->cos_ns.i, s->cos_ng.i)) return false;
    if (!lobe_sample_direction(lobe, lobe_to_local(lobe, frame, wi_world), u_lobe, u, from, &s->local))
        return false;
    s->wo_world = lobe_to_world(lobe, frame, s->local.wo_local);
    s->cos_ns.o = ca_dot(frame->n, s->wo_world);
    s->cos_ng.o = ca_dot(bsdf->ng, s->wo_world);
    if (!sides_agree(s->cos_ns.o, s->cos_ng.o)) return false;
    if (from == CA_FROM_LIGHT && is_turned(lobe, s->wo_world) != turned) return false; /* the eye sees the other */
    s->light_share = light_share(bsdf, lobe, turned, from == CA_FROM_LIGHT ? wi_world : s->wo_world);
    return true;
}

bool ca_bsdf_sample_direction(const ca_bsdf *bsdf, ca_vec3 wi_world, float u_lobe, ca_vec2 u, ca_from from,
                              ca_bsdf_sample *sample)
{
    if (bsdf->lobe_count == 1 && bsdf->lobes[0].weight == 1.0f && is_plain_diffuse(&bsdf->lobes[0]))
        return sample_diffuse(bsdf, wi_world, u, from, sample);
    const ca_bsdf_lobe *lobe = choose_lobe(bsdf, &u_lobe);
    if (!lobe) return sample_null(bsdf, wi_world, sample);
    lobe_sample s;
    if (!sample_lobe(bsdf, lobe, wi_world, u_lobe, u, from, &s)) return false;

    sample->wo_world = s.wo_world;
    sample->scatter = s.local.scatter;
    sample->eta = s.local.eta;
    if (bsdf->lobe_count > 1 && (s.local.scatter & CA_SCATTER_SMOOTH))
        return finish_mixture(bsdf, wi_world, from, sample);
    /* The elementary weight has |cos_ns.o|; the ratio makes it f̄ |cos_ng.o|, which from the camera is the same. The
     * choice of the lobe cancels. */
    const bool from_light = from == CA_FROM_LIGHT;
    float scale = shadowing(lobe, from_light ? wi_world : s.wo_world);
    if (from_light) scale *= fabsf(s.cos_ns.i * s.cos_ng.o / (s.cos_ng.i * s.cos_ns.o)) / s.light_share;
    sample->weight = ca_rgb_scale(s.local.weight, scale);
    sample->pdf.v = lobe->weight * (from_light ? s.light_share : 1.0f) * s.local.pdf.v;
    sample->pdf_reverse.v = lobe->weight * (from_light ? 1.0f : s.light_share) * s.local.pdf_reverse.v;
    return true;
}

static inline ca_vec3 seen_from(const ca_bsdf_lobe *lobe, ca_vec3 wi_world)
{
    ca_frame made;
    return lobe_to_local(lobe, frame_of(lobe, is_turned(lobe, wi_world), &made), wi_world);
}

ca_rgb ca_bsdf_albedo(const ca_bsdf *bsdf, ca_vec3 wi_world)
{
    ca_rgb sum = ca_rgb_grey(bsdf->null_weight);
    for (uint32_t i = 0; i < bsdf->lobe_count; ++i) {
        const ca_bsdf_lobe *lobe = &bsdf->lobes[i];
        sum = ca_rgb_madd(sum, lobe->weight, lobe_albedo(lobe, seen_from(lobe, wi_world)));
    }
    return sum;
}

ca_rgb ca_bsdf_diffuse_reflectance(const ca_bsdf *bsdf, ca_vec3 wi_world)
{
    ca_rgb sum = ca_rgb_grey(0.0f);
    for (uint32_t i = 0; i < bsdf->lobe_count; ++i) {
        const ca_bsdf_lobe *lobe = &bsdf->lobes[i];
        const ca_rgb color = ca_bxdf_diffuse_reflectance(&lobe->bxdf, seen_from(lobe, wi_world));
        sum = ca_rgb_madd(sum, lobe->weight, color);
    }
    return bsdf->lobe_count == 0 ? sum : ca_rgb_scale(sum, 1.0f / (1.0f - bsdf->null_weight));
}
