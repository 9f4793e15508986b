/* Probability densities carry their measure in their type, so that a density per steradian cannot be multiplied
 * into a product of densities per square metre by mistake. `.v` is the number. Exactly one function converts.
 *
 * A Dirac event has no density: its `.v` then holds the *discrete* probability of the event (1 for a mirror, the
 * Fresnel reflectance for glass), and the flag that says so travels beside it. */
#ifndef CA_MATH_MEASURE_H
#define CA_MATH_MEASURE_H

#include "math/vec.h"

typedef struct ca_pdf_area {
    float v; /* m^-2, on the surface that holds the vertex */
} ca_pdf_area;

typedef struct ca_pdf_solid_angle {
    float v; /* sr^-1 */
} ca_pdf_solid_angle;

/* Density per area at the far end of a segment, from the density per solid angle at its near end:
 * p_A = p_W |cos| / d^2, with cos taken between the segment and the far surface's geometric normal. */
static inline ca_pdf_area ca_pdf_to_area(ca_pdf_solid_angle pdf, float abs_cos_far, float distance2)
{
    return (ca_pdf_area){pdf.v * abs_cos_far / distance2};
}

/* The inverse: 0 where the far surface is seen edge-on. */
static inline ca_pdf_solid_angle ca_pdf_to_solid_angle(ca_pdf_area pdf, float abs_cos_far, float distance2)
{
    return (ca_pdf_solid_angle){abs_cos_far > 0.0f ? pdf.v * distance2 / abs_cos_far : 0.0f};
}

#endif
