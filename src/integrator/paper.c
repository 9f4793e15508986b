/* The program of Sirak 2019, "Bidirectional Path Tracer", as a setting of the engine: `bdpt` with `paper`.
 *
 * What it does otherwise than `bdpt`, and where the report says so:
 *     directions of paths and of light leaving a lamp are uniform over the hemisphere            3.3
 *     a camera vertex is connected to the first vertex of the pixel's own light path, too,
 *     where `bdpt` chooses a point of a light anew (t = 1)                                       3.1, 3.2
 *     all rays of a pixel go through its centre                                                  3.6
 *     s >= 2, t >= 0: no splats; the balance heuristic over these                                3.2, 3.4
 *     surfaces are Lambertian, lights have an area, the camera is a pinhole                      3.2, 3.5
 * It has no roulette either. Heuristic (5) also sums the strategy of one camera vertex, which section 3.2 leaves out;
 * with it weights would not sum to one, and it is left out here. The density of t = 1 is that with which the light
 * path starts: to the weights it is a next event that chooses lights and points as emission does. */
#include "integrator/bidirectional.h"

#include "math/frame.h"
#include "sampling/warp.h"

/* ---- What it can render ---------------------------------------------------------------------------------------- */

static bool is_lambertian(const ca_material *material)
{
    return material->kind == CA_MATERIAL_DIFFUSE || material->kind == CA_MATERIAL_TWOSIDED;
}

ca_status ca_paper_check(const ca_integrator_input *input, ca_error *error)
{
    const ca_scene *scene = input->scene;
    if (input->pairs)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                       "with \"paper\" the noise of pairs is not measured: lights are not asked on their own");
    if (ca_integrator_value(&ca_integrator_bdpt, input, "guide", 0.0) != 0.0)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                       "with \"paper\" light paths start as usual: \"guide\" must be false");
    if (input->camera->kind != CA_CAMERA_PERSPECTIVE)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, &scene->desc.camera.where,
                       "with \"paper\" the sensor must be perspective");
    for (uint32_t i = 0; i < scene->material_count; i++)
        if (!is_lambertian(&scene->materials[i]))
            return ca_fail(error, CA_ERROR_UNSUPPORTED, &scene->desc.materials.items[i].where,
                           "with \"paper\" all BSDFs must be diffuse");
    for (uint32_t i = 0; i < scene->light_count; i++)
        if (scene->lights[i].kind != CA_LIGHT_AREA)
            return ca_fail(error, CA_ERROR_UNSUPPORTED, &scene->desc.lights.items[i].where,
                           "with \"paper\" all lights must have an area");
    return CA_OK;
}

/* ---- Uniform directions ---------------------------------------------------------------------------------------- */

/* Around a unit vector; its cosine with that. */
static ca_vec3 uniform_direction(ca_vec3 axis, ca_vec2 u, float *cosine)
{
    const ca_vec3 local = ca_warp_cone(u, 1.0f);
    const ca_frame frame = ca_frame_from_normal(axis);
    *cosine = local.z;
    return ca_to_world(&frame, local);
}

ca_bsdf_value ca_paper_value(ca_bsdf_value value)
{
    if (!ca_rgb_is_black(value.f)) value.pdf = value.pdf_reverse = CA_PAPER_PDF;
    return value;
}

bool ca_paper_sample(const ca_vertex *vertex, ca_vec2 u, ca_from from, ca_bsdf_sample *sample)
{
    const ca_vec3 front = ca_dot(vertex->ng, vertex->wi) < 0.0f ? ca_neg(vertex->ng) : vertex->ng;
    float cosine;
    const ca_vec3 wo = uniform_direction(front, u, &cosine);
    const ca_bsdf_value value = ca_vertex_eval(vertex, wo, from);
    if (ca_rgb_is_black(value.f)) return false;
    *sample = (ca_bsdf_sample){.wo_world = wo,
                               .weight = ca_rgb_scale(value.f, CA_TWO_PI * cosine),
                               .pdf = CA_PAPER_PDF,
                               .pdf_reverse = CA_PAPER_PDF,
                               .scatter = CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH,
                               .eta = 1.0f};
    return true;
}

bool ca_paper_emission(ca_vec2 u, ca_light_emission *emission)
{
    emission->direction = uniform_direction(emission->ng, u, &emission->cos_light);
    emission->pdf_direction = CA_PAPER_PDF;
    return emission->cos_light > 0.0f;
}

/* ---- t = 1 ----------------------------------------------------------------------------------------------------- */

bool ca_paper_direct(const ca_camera_walk *walk, uint32_t *light, float *choice, ca_light_direct *direct)
{
    const ca_bidirectional *b = walk->b;
    const ca_stream stream =
        ca_stream_start(b->input.sampler, CA_SEQUENCE_LIGHT, b->first_number + walk->paired_number);
    ca_light_start start;
    if (!ca_light_start_path(b, &stream, &start)) return false;
    const ca_light_emission *e = &start.emission;
    const ca_vec3 way = ca_sub(e->origin, walk->walk.last.position);
    const float distance = ca_length(way);
    if (!(distance > 0.0f)) return false;
    const ca_vec3 to_light = ca_mul(way, 1.0f / distance);
    const float cos_light = -ca_dot(e->ng, to_light);
    if (!(cos_light > 0.0f)) return false; /* the lamp's far side */
    *light = start.light;
    *choice = start.choice;
    *direct = (ca_light_direct){.to_light = to_light,
                                .distance = distance,
                                .position = e->origin,
                                .position_error = e->origin_error,
                                .ng = e->ng,
                                .radiance = e->radiance,
                                .pdf_direct = ca_pdf_to_solid_angle(e->pdf_position, cos_light, ca_sqr(distance)),
                                .pdf_position = e->pdf_position,
                                .pdf_direction = CA_PAPER_PDF,
                                .cos_light = cos_light,
                                .next_event_ratio = 1.0f};
    return true;
}
