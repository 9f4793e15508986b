/* Light from all around, infinitely far: of one radiance, or of a latitude-longitude picture.
 *
 * The picture is mapped as Mitsuba 3's envmap.cpp does: direction to the light (sin phi sin theta, cos theta,
 * -cos phi sin theta) in the light's frame; across, pixel centres lie at phi = 2 pi (x + 1/2) / width and the lookup
 * wraps around; down, the first row is the pole theta = 0 and the last the pole theta = pi. Bilinear in between.
 *
 * Sampling: a cell between four pixels' centres, by a table of the exact integrals of luminance over their solid
 * angles; in it a place by the bilinear luminance. What varies of luminance over density is sin theta within a cell.
 * Luminance is that of absolute values (ca_light_weight), so that the density is positive wherever the light is not
 * black. */
#include "base/memory.h"
#include "light/light_kinds.h"
#include "math/arc_tangent.h"
#include "sampling/warp.h"

/* ---- Lookup ---------------------------------------------------------------------------------------------------- */

/* Where a direction to the light lies in the picture. */
typedef struct picture_place {
    ca_vec2 uv; /* longitude and latitude, each in [0, 1] */
    float sin_theta;
} picture_place;

static picture_place place_of(const ca_light *light, ca_vec3 to_light)
{
    if (light->kind == CA_LIGHT_CONSTANT) return (picture_place){0};
    const ca_vec3 local = ca_light_to_local(&light->as.envmap.map, to_light);
    const float ring = sqrtf(ca_sqr(local.x) + ca_sqr(local.z));
    const ca_vec2 uv = {ca_turn(-local.z, local.x), ca_atan2(ring, local.y) * CA_INV_PI};
    return (picture_place){uv, ring};
}

static ca_vec3 uv_to_direction(ca_vec2 uv)
{
    float sin_phi, cos_phi, sin_theta, cos_theta;
    ca_sincos(CA_TWO_PI * uv.x, &sin_phi, &cos_phi);
    ca_sincos(CA_PI * uv.y, &sin_theta, &cos_theta);
    return (ca_vec3){sin_phi * sin_theta, cos_theta, -cos_phi * sin_theta};
}

/* The cell around a place, and where in it that is. */
typedef struct picture_cell {
    uint32_t x0, x1, y0, y1; /* columns and rows of the four pixels */
    ca_vec2 inside;
} picture_cell;

static picture_cell cell_of(const ca_image *image, ca_vec2 uv)
{
    const float x = uv.x * (float)image->width - 0.5f, y = uv.y * (float)(image->height - 1);
    const float column = floorf(x), row = ca_min(floorf(y), (float)image->height - 1.0f);
    picture_cell cell = {.inside = {x - column, y - row}};
    cell.x0 = column < 0.0f ? image->width - 1 : ca_min_u32((uint32_t)column, image->width - 1);
    cell.x1 = cell.x0 + 1 < image->width ? cell.x0 + 1 : 0;
    cell.y0 = (uint32_t)row, cell.y1 = ca_min_u32(cell.y0 + 1, image->height - 1);
    return cell;
}

static ca_rgb bilinear(const ca_image *image, const picture_cell *c)
{
    return ca_rgb_lerp(
        ca_rgb_lerp(ca_image_rgb(image, c->x0, c->y0), ca_image_rgb(image, c->x1, c->y0), c->inside.x),
        ca_rgb_lerp(ca_image_rgb(image, c->x0, c->y1), ca_image_rgb(image, c->x1, c->y1), c->inside.x), c->inside.y);
}

static ca_rgb radiance_at(const ca_light *light, const picture_place *place)
{
    if (light->kind == CA_LIGHT_CONSTANT) return light->as.constant.radiance;
    const picture_cell cell = cell_of(light->as.envmap.image, place->uv);
    return ca_rgb_mul(light->as.envmap.scale, bilinear(light->as.envmap.image, &cell));
}

ca_rgb ca_light_environment_radiance(const ca_light *light, ca_vec3 direction)
{
    const picture_place place = place_of(light, ca_neg(direction));
    return radiance_at(light, &place);
}

/* ---- Table ----------------------------------------------------------------------------------------------------- */

static uint32_t cell_rows(const ca_image *image) { return ca_max_u32(image->height - 1, 1); }

static float pixel_weight(const ca_light *light, uint32_t x, uint32_t y)
{
    return ca_light_weight(ca_rgb_mul(light->as.envmap.scale, ca_image_rgb(light->as.envmap.image, x, y)));
}

/* Of a row's two pixels, those of the cell that begins at the first. */
static double across(const ca_light *light, uint32_t x, uint32_t y)
{
    const uint32_t right = x + 1 < light->as.envmap.image->width ? x + 1 : 0;
    return 0.5 * ((double)pixel_weight(light, x, y) + (double)pixel_weight(light, right, y));
}

/* Integrals over a cell's solid angle of the weights 1 - t and t of the rows above and below it, with t linear in
 * theta from theta0 to theta1: the integral of t sin theta is (sin theta1 - sin theta0) / (theta1 - theta0) - cos
 * theta1. */
static void row_weights(const ca_image *image, uint32_t row, double *upper, double *lower)
{
    const uint32_t rows = cell_rows(image);
    const double theta0 = CA_PI_D * row / rows, theta1 = CA_PI_D * (row + 1) / rows;
    const double width = 2.0 * CA_PI_D / image->width;
    *lower = width * ((sin(theta1) - sin(theta0)) / (theta1 - theta0) - cos(theta1));
    *upper = width * (cos(theta0) - cos(theta1)) - *lower;
}

/* Fills the table's weights; the sum is the integral of luminance over the sphere. */
static double fill_weights(const ca_light *light, float *weights)
{
    const ca_image *image = light->as.envmap.image;
    double sum = 0.0;
    for (uint32_t row = 0; row < cell_rows(image); row++) {
        double upper, lower;
        row_weights(image, row, &upper, &lower);
        for (uint32_t x = 0; x < image->width; x++) {
            const double weight =
                upper * across(light, x, row) + lower * across(light, x, ca_min_u32(row + 1, image->height - 1));
            weights[(size_t)row * image->width + x] = (float)weight;
            sum += weight;
        }
    }
    return sum;
}

static bool image_is_finite(const ca_image *image)
{
    for (uint32_t y = 0; y < image->height; y++)
        for (uint32_t x = 0; x < image->width; x++)
            if (!ca_rgb_is_finite(ca_image_rgb(image, x, y))) return false;
    return true;
}

static ca_status prepare_envmap(ca_light *light, double *integral, ca_error *error)
{
    const ca_image *image = light->as.envmap.image;
    if (!image_is_finite(image))
        return ca_fail(error, CA_ERROR_SCENE, NULL, "an environment map has a pixel that is not finite");
    float *weights = ca_alloc((size_t)image->width * cell_rows(image), sizeof *weights);
    if (!weights) return ca_fail_memory(error, "an environment map's sampling table");
    *integral = fill_weights(light, weights);
    const ca_status status =
        ca_distribution_2d_create(&light->as.envmap.cells, weights, image->width, cell_rows(image), error);
    ca_free(weights);
    return status;
}

ca_status ca_light_environment_prepare(ca_light *light, ca_error *error)
{
    double integral = 0.0; /* of luminance over directions */
    if (light->kind == CA_LIGHT_CONSTANT)
        integral = 4.0 * CA_PI_D * (double)ca_light_weight(light->as.constant.radiance);
    else
        CA_TRY(prepare_envmap(light, &integral, error));
    const double disk = CA_PI_D * (double)light->scene_radius * (double)light->scene_radius;
    light->power = (float)(disk * integral);
    return CA_OK;
}

/* ---- Sampling -------------------------------------------------------------------------------------------------- */

/* Weights of a cell's pixels: upper left, upper right, lower left, lower right. */
static void cell_weights(const ca_light *light, const picture_cell *c, float w[4])
{
    w[0] = pixel_weight(light, c->x0, c->y0), w[1] = pixel_weight(light, c->x1, c->y0);
    w[2] = pixel_weight(light, c->x0, c->y1), w[3] = pixel_weight(light, c->x1, c->y1);
}

static inline float mix(float a, float b, float t) { return a * (1.0f - t) + b * t; }

/* In the cell, per area of the unit square. Two rows of pixels have one row of cells between them: the last row of
 * pixels, where the lower pole is, belongs to the last cells. */
static float density_in(const ca_light *light, const picture_cell *c)
{
    const ca_distribution_2d *cells = &light->as.envmap.cells;
    float w[4];
    cell_weights(light, c, w);
    const float mean = 0.25f * ((w[0] + w[1]) + (w[2] + w[3]));
    if (!(mean > 0.0f)) return 0.0f;
    const float weight = mix(mix(w[0], w[1], c->inside.x), mix(w[2], w[3], c->inside.x), c->inside.y);
    const float probability =
        ca_distribution_2d_bin_probability(cells, c->x0, ca_min_u32(c->y0, cells->height - 1));
    return probability * ((float)cells->width * (float)cells->height) * (weight / mean);
}

/* Of a direction to the light. A density over the unit square becomes one per solid angle by 2 pi^2 sin theta. At a
 * pole, a set without area, it would be infinite: 0 there. */
static ca_pdf_solid_angle pdf_at(const ca_light *light, const picture_place *place)
{
    if (light->kind == CA_LIGHT_CONSTANT) return (ca_pdf_solid_angle){CA_INV_FOUR_PI};
    if (!(place->sin_theta > 0.0f)) return (ca_pdf_solid_angle){0.0f};
    const picture_cell cell = cell_of(light->as.envmap.image, place->uv);
    return (ca_pdf_solid_angle){density_in(light, &cell) / (2.0f * CA_PI * CA_PI * place->sin_theta)};
}

/* A place of the picture by its density. */
static ca_vec2 sample_place(const ca_light *light, ca_vec2 u)
{
    const ca_image *image = light->as.envmap.image;
    const ca_distribution_2d *cells = &light->as.envmap.cells;
    const ca_bin_2d bin = ca_distribution_2d_sample_bin(cells, u);
    const picture_cell cell = {.x0 = bin.column,
                               .x1 = bin.column + 1 < image->width ? bin.column + 1 : 0,
                               .y0 = bin.row,
                               .y1 = ca_min_u32(bin.row + 1, image->height - 1)};
    float w[4];
    cell_weights(light, &cell, w);
    const float down = ca_warp_linear(bin.inside.y, w[0] + w[1], w[2] + w[3]);
    const float across = ca_warp_linear(bin.inside.x, mix(w[0], w[2], down), mix(w[1], w[3], down));
    const float x = ((float)bin.column + across + 0.5f) / (float)cells->width;
    const float y = ((float)bin.row + down) / (float)cells->height;
    return (ca_vec2){x < 1.0f ? x : x - 1.0f, ca_min(y, CA_ONE_MINUS_EPSILON)};
}

/* The density is evaluated from the direction as eval_hit does it, not taken from the table: rounding may put the
 * direction into the neighbouring cell, and all techniques must agree on what it is worth. */
static bool sample_direction(const ca_light *light, ca_vec2 u, ca_vec3 *to_light, ca_rgb *radiance,
                             ca_pdf_solid_angle *pdf)
{
    if (light->kind == CA_LIGHT_CONSTANT) {
        *to_light = ca_warp_sphere(u);
    } else {
        *to_light = ca_light_to_world(&light->as.envmap.map, uv_to_direction(sample_place(light, u)));
    }
    const picture_place place = place_of(light, *to_light);
    *pdf = pdf_at(light, &place);
    if (!(pdf->v > 0.0f)) return false;
    *radiance = radiance_at(light, &place);
    return true;
}

bool ca_light_environment_direct(const ca_light *light, ca_vec3 reference, ca_vec2 u, ca_light_direct *direct)
{
    *direct = (ca_light_direct){
        .distance = CA_INFINITE_DISTANCE, .cos_light = 1.0f, .next_event_ratio = 1.0f};
    if (!sample_direction(light, u, &direct->to_light, &direct->radiance, &direct->pdf_direct)) return false;
    direct->position = ca_light_far_point(light, reference, direct->to_light);
    direct->pdf_position = ca_light_disk_pdf(light);
    direct->pdf_direction = direct->pdf_direct;
    return true;
}

bool ca_light_environment_emission(const ca_light *light, ca_vec2 u_position, ca_vec2 u_direction,
                                   ca_light_emission *emission)
{
    *emission = (ca_light_emission){.pdf_position = ca_light_disk_pdf(light), .cos_light = 1.0f};
    ca_vec3 to_light;
    if (!sample_direction(light, u_direction, &to_light, &emission->radiance, &emission->pdf_direction)) return false;
    emission->direction = ca_neg(to_light);
    emission->origin = ca_light_disk_point(light, emission->direction, u_position);
    return true;
}

ca_light_hit ca_light_environment_hit(const ca_light *light, ca_vec3 direction)
{
    const picture_place place = place_of(light, ca_neg(direction));
    const ca_pdf_solid_angle pdf = pdf_at(light, &place);
    return (ca_light_hit){.radiance = radiance_at(light, &place),
                          .pdf_direct = pdf,
                          .pdf_position = ca_light_disk_pdf(light),
                          .pdf_direction = pdf,
                          .next_event_ratio = 1.0f};
}
