/* A slide projector: a point that throws a picture. The texture is the irradiance on the plane z = 1 of the light's
 * frame, times pi and the scale, so that a white diffuse plane there shows the picture's values (as Mitsuba 3's
 * projector.cpp). The picture is upright and not mirrored as the light sees it: +x is to its left, +y its top.
 *
 * Intensity: irradiance at z = 1 is I cos / distance^2 = I cos^3, so I = pi scale picture / cos^3. Directions are
 * sampled by the picture's luminance on that plane, whose density per solid angle has the same cos^-3: the flux of a
 * sample depends on the picture only as far as the table is coarser than it.
 *
 * The place in the picture is chosen by u_position, as a camera's first pair chooses the place on the film: where
 * both read the same sequence, a projector of one colour and a camera with its view send out the same rays. */
#include "base/memory.h"
#include "light/light_kinds.h"
#include "math/numeric.h"

/* Coordinates in the picture of a point of the plane z = 1, in [0, 1]^2 where it is on the slide. */
static ca_vec2 plane_to_picture(const ca_light *light, ca_vec2 plane)
{
    return (ca_vec2){0.5f - 0.5f * plane.x / light->as.projector.tan_half_x,
                     0.5f + 0.5f * plane.y / light->as.projector.tan_half_y};
}

static ca_vec2 picture_to_plane(const ca_light *light, ca_vec2 uv)
{
    return (ca_vec2){(1.0f - 2.0f * uv.x) * light->as.projector.tan_half_x,
                     (2.0f * uv.y - 1.0f) * light->as.projector.tan_half_y};
}

static float plane_area(const ca_light *light)
{
    return 4.0f * light->as.projector.tan_half_x * light->as.projector.tan_half_y;
}

static ca_rgb irradiance_at(const ca_light *light, ca_vec2 uv)
{
    const ca_rgb picture = ca_light_texture_at(light, light->as.projector.picture, uv);
    return ca_rgb_scale(ca_rgb_mul(light->as.projector.scale, picture), CA_PI);
}

/* Cells of the sampling table: the pixels of a bitmap, a grid for what has none. */
static void table_size(const ca_light *light, uint32_t *width, uint32_t *height)
{
    enum { GRID = 256, LARGEST = 1024 };
    *width = *height = 1;
    if (light->as.projector.picture == CA_NONE) return;
    const ca_texture *picture = &light->textures[light->as.projector.picture];
    switch (picture->kind) {
    case CA_TEXTURE_CONSTANT: break;
    case CA_TEXTURE_BITMAP:
        *width = ca_min_u32(picture->as.bitmap.image->width, LARGEST);
        *height = ca_min_u32(picture->as.bitmap.image->height, LARGEST);
        break;
    case CA_TEXTURE_CHECKERBOARD:
    case CA_TEXTURE_SCALE:
    case CA_TEXTURE_MIX:
    case CA_TEXTURE_POWER:
    case CA_TEXTURE_CLAMP:
    case CA_TEXTURE_MAPPED:
    case CA_TEXTURE_FACING:
    case CA_TEXTURE_MESH_ATTRIBUTE: *width = *height = GRID; break;
    case CA_TEXTURE_KIND_COUNT: break;
    }
}

/* Mean over a cell by the trapezium rule on its quarters: exact for a bilinear bitmap of the table's size. */
static float cell_mean(const ca_light *light, uint32_t x, uint32_t y, uint32_t width, uint32_t height)
{
    float sum = 0.0f;
    for (uint32_t j = 0; j < 3; j++)
        for (uint32_t i = 0; i < 3; i++) {
            const float factor = (i == 1 ? 0.5f : 0.25f) * (j == 1 ? 0.5f : 0.25f);
            const ca_vec2 uv = {((float)x + 0.5f * (float)i) / (float)width,
                                ((float)y + 0.5f * (float)j) / (float)height};
            sum += factor * ca_light_weight(irradiance_at(light, uv));
        }
    return sum;
}

ca_status ca_light_projector_prepare(ca_light *light, ca_error *error)
{
    uint32_t width, height;
    table_size(light, &width, &height);
    float *weights = ca_alloc((size_t)width * height, sizeof *weights);
    if (!weights) return ca_fail_memory(error, "a projector's sampling table");
    double sum = 0.0;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++)
            sum += (double)(weights[(size_t)y * width + x] = cell_mean(light, x, y, width, height));
    const double mean = sum / ((double)width * height);
    light->power = (float)mean * plane_area(light);
    /* What a cell's nine points miss (pictures finer than the table) is still sampled sometimes. */
    for (size_t i = 0; i < (size_t)width * height; i++) weights[i] += 1e-3f * (float)mean;
    const ca_status status =
        isfinite(sum) ? ca_distribution_2d_create(&light->as.projector.pixels, weights, width, height, error)
                      : ca_fail(error, CA_ERROR_SCENE, NULL, "a projector's picture has a pixel that is not finite");
    ca_free(weights);
    return status;
}

bool ca_light_projector_direct(const ca_light *light, ca_vec3 reference, ca_light_direct *direct)
{
    if (!ca_light_direct_from_point(light->as.projector.position, reference, direct)) return false;
    const ca_vec3 local = ca_light_to_local(&light->as.projector.map, ca_neg(direct->to_light));
    if (!(local.z > 0.0f)) return false;
    const ca_vec2 uv = plane_to_picture(light, (ca_vec2){local.x / local.z, local.y / local.z});
    if (!(uv.x >= 0.0f && uv.x <= 1.0f && uv.y >= 0.0f && uv.y <= 1.0f)) return false;
    const float cos3 = local.z * local.z * local.z;
    direct->radiance = ca_rgb_scale(irradiance_at(light, uv), 1.0f / (cos3 * ca_sqr(direct->distance)));
    const float density = ca_distribution_2d_density(&light->as.projector.pixels, uv);
    direct->pdf_direction.v = density / (plane_area(light) * cos3);
    return !ca_rgb_is_black(direct->radiance);
}

bool ca_light_projector_emission(const ca_light *light, ca_vec2 u_position, ca_light_emission *emission)
{
    float density;
    const ca_vec2 uv = ca_distribution_2d_sample(&light->as.projector.pixels, u_position, &density);
    const ca_vec2 plane = picture_to_plane(light, uv);
    const ca_vec3 local = ca_normalize((ca_vec3){plane.x, plane.y, 1.0f});
    const float cos3 = local.z * local.z * local.z;
    *emission = (ca_light_emission){.origin = light->as.projector.position,
                                    .direction = ca_light_to_world(&light->as.projector.map, local),
                                    .radiance = ca_rgb_scale(irradiance_at(light, uv), 1.0f / cos3),
                                    .pdf_position = {1.0f},
                                    .pdf_direction = {density / (plane_area(light) * cos3)},
                                    .cos_light = 1.0f};
    return !ca_rgb_is_black(emission->radiance);
}
