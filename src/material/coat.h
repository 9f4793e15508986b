/* A clear coat, smooth or rough, on an elementary BSDF that only reflects (Mitsuba 0.6's coating and roughcoating;
 * Weidlich and Wilkie 2007, "Arbitrarily Layered Micro-Facet Surfaces"). Light is reflected by the coat's boundary,
 * or refracted through it, scattered once by the base, and refracted out again; what the inside of the boundary would
 * reflect back down is lost.
 *
 *     f(wi, wo) = coat's reflection + T_i T_o A f_base(wi', wo') / eta^2
 *
 * with T the shares that pass the boundary, wi' and wo' the directions below it, and A = exp(-absorption (1/cos_i' +
 * 1/cos_o')). Black from below. The functions have the contracts of bxdf.h, for the base under its coat. */
#ifndef CA_MATERIAL_COAT_H
#define CA_MATERIAL_COAT_H

#include "material/bxdf.h"

typedef struct ca_coat {
    float eta;             /* interior over exterior index */
    ca_rgb specular;       /* factor on what the boundary reflects */
    ca_rgb absorption;     /* optical thickness along the normal */
    float specular_weight; /* share of samples, before Fresnel, for the boundary's reflection */
    ca_microfacet facets;  /* of a rough one */
    const struct ca_rough_transmittance *transmittance; /* borrowed from the material; NULL: the coat is smooth */
} ca_coat;

uint32_t ca_coat_scatter(const ca_coat *coat, const ca_bxdf *base);

ca_bxdf_value ca_coat_eval(const ca_coat *coat, const ca_bxdf *base, ca_vec3 wi_local, ca_vec3 wo_local,
                           ca_from from);

bool ca_coat_sample(const ca_coat *coat, const ca_bxdf *base, ca_vec3 wi_local, float u_lobe, ca_vec2 u, ca_from from,
                    ca_bxdf_sample *sample);

ca_rgb ca_coat_albedo(const ca_coat *coat, const ca_bxdf *base, ca_vec3 wi_local);

/* Adds what a rough boundary reflects, specular F D G / (4 cos_i cos_o), to the value, and its densities times the
 * probabilities of sampling it from either side. Both directions lie above. */
void ca_coat_add_facets(const ca_microfacet *facets, float eta, ca_rgb specular, ca_vec3 wi, ca_vec3 wo,
                        float probability_i, float probability_o, ca_bxdf_value *value);

#endif
