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

static inline ca_vec3 lobe_to_local(const ca_bsdf_lobe *lobe, ca_vec3 w_world)
{
    ca_vec3 w = ca_to_local(&lobe->frame, w_world);
    w.z *= lobe_side(lobe);
    return w;
}

static inline ca_vec3 lobe_to_world(const ca_bsdf_lobe *lobe, ca_vec3 w_local)
{
    w_local.z *= lobe_side(lobe);
    return ca_to_world(&lobe->frame, w_local);
}

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
static inline void add_lobe_value(const ca_bsdf_lobe *lobe, ca_vec3 wi_world, ca_vec3 wo_world, pair_cosines cos_ng,
                                  ca_from from, ca_bsdf_value *sum)
{
    const pair_cosines cos_ns = {ca_dot(lobe->frame.n, wi_world), ca_dot(lobe->frame.n, wo_world)};
    if (!sides_agree(cos_ns.i, cos_ng.i) || !sides_agree(cos_ns.o, cos_ng.o)) return;
    const ca_bxdf_value value =
        ca_bxdf_eval(&lobe->bxdf, lobe_to_local(lobe, wi_world), lobe_to_local(lobe, wo_world), from);
    sum->f = ca_rgb_madd(sum->f, lobe->weight * shading_ratio(cos_ns, cos_ng, from), value.f);
    sum->pdf.v += lobe->weight * value.pdf.v;
    sum->pdf_reverse.v += lobe->weight * value.pdf_reverse.v;
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
    if (bsdf->lobe_count == 1 && bsdf->lobes[0].bxdf.kind == CA_BXDF_DIFFUSE)
        return eval_diffuse(&bsdf->lobes[0], wi_world, wo_world, cos_ng, from);

    ca_bsdf_value sum = ZERO_VALUE;
    if (!(bsdf->scatter & CA_SCATTER_SMOOTH)) return sum;
    if (!(bsdf->scatter & CA_SCATTER_TRANSMISSION) && cos_ng.i * cos_ng.o <= 0.0f) return sum;
    for (uint32_t i = 0; i < bsdf->lobe_count; ++i)
        add_lobe_value(&bsdf->lobes[i], wi_world, wo_world, cos_ng, from, &sum);
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
    const ca_vec3 wo_world = lobe_to_world(lobe, wo_local);
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

bool ca_bsdf_sample_direction(const ca_bsdf *bsdf, ca_vec3 wi_world, float u_lobe, ca_vec2 u, ca_from from,
                              ca_bsdf_sample *sample)
{
    if (bsdf->lobe_count == 1 && bsdf->lobes[0].weight == 1.0f && bsdf->lobes[0].bxdf.kind == CA_BXDF_DIFFUSE)
        return sample_diffuse(bsdf, wi_world, u, from, sample);
    const ca_bsdf_lobe *lobe = choose_lobe(bsdf, &u_lobe);
    if (!lobe) return sample_null(bsdf, wi_world, sample);

    pair_cosines cos_ns = {ca_dot(lobe->frame.n, wi_world), 0.0f}, cos_ng = {ca_dot(bsdf->ng, wi_world), 0.0f};
    if (!sides_agree(cos_ns.i, cos_ng.i)) return false;
    ca_bxdf_sample local;
    if (!ca_bxdf_sample_direction(&lobe->bxdf, lobe_to_local(lobe, wi_world), u_lobe, u, from, &local)) return false;

    const ca_vec3 wo_world = lobe_to_world(lobe, local.wo_local);
    cos_ns.o = ca_dot(lobe->frame.n, wo_world);
    cos_ng.o = ca_dot(bsdf->ng, wo_world);
    if (!sides_agree(cos_ns.o, cos_ng.o)) return false;

    sample->wo_world = wo_world;
    sample->scatter = local.scatter;
    sample->eta = local.eta;
    if (bsdf->lobe_count > 1 && (local.scatter & CA_SCATTER_SMOOTH))
        return finish_mixture(bsdf, wi_world, from, sample);
    /* The elementary weight has |cos_ns.o|; the ratio makes it f̄ |cos_ng.o|, which from the camera is the same. The
     * choice of the lobe cancels. */
    sample->weight = from == CA_FROM_CAMERA
                         ? local.weight
                         : ca_rgb_scale(local.weight, fabsf(cos_ns.i * cos_ng.o / (cos_ng.i * cos_ns.o)));
    sample->pdf.v = lobe->weight * local.pdf.v;
    sample->pdf_reverse.v = lobe->weight * local.pdf_reverse.v;
    return true;
}

ca_rgb ca_bsdf_albedo(const ca_bsdf *bsdf, ca_vec3 wi_world)
{
    ca_rgb sum = ca_rgb_grey(bsdf->null_weight);
    for (uint32_t i = 0; i < bsdf->lobe_count; ++i) {
        const ca_bsdf_lobe *lobe = &bsdf->lobes[i];
        sum = ca_rgb_madd(sum, lobe->weight, ca_bxdf_albedo(&lobe->bxdf, lobe_to_local(lobe, wi_world)));
    }
    return sum;
}
