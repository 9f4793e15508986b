#include "camera/camera.h"

#include "camera/camera_lanes.h"
#include "camera/panels.h"
#include "math/frame.h"
#include "math/numeric.h"
#include "sampling/warp.h"
#include "sampling/warp_lanes.h"

#include <assert.h>

double ca_camera_tan_half_x(double fov_degrees, ca_fov_axis axis, uint32_t width, uint32_t height)
{
    assert(fov_degrees > 0.0 && fov_degrees < 180.0);
    const double tan_half = tan(0.5 * fov_degrees * (CA_PI_D / 180.0));
    const double aspect = (double)width / (double)height;
    switch (axis) {
    case CA_FOV_X: return tan_half;
    case CA_FOV_Y: return tan_half * aspect;
    case CA_FOV_DIAGONAL: return tan_half * aspect / sqrt(1.0 + aspect * aspect);
    case CA_FOV_SMALLER: return width > height ? tan_half * aspect : tan_half;
    case CA_FOV_LARGER: return width > height ? tan_half : tan_half * aspect;
    }
    return tan_half;
}

static ca_vec3 column(const ca_camera *camera, int i)
{
    return (ca_vec3){camera->map.to[0][i], camera->map.to[1][i], camera->map.to[2][i]};
}

/* Half the width of the film's image on its plane. The orthographic film is two units wide in camera space, so that
 * its size comes from the map's scale. */
static double half_width(const ca_camera *camera)
{
    switch (camera->kind) {
    case CA_CAMERA_PERSPECTIVE: return (double)camera->as.perspective.tan_half_x;
    case CA_CAMERA_THIN_LENS: return (double)camera->as.thin_lens.tan_half_x;
    case CA_CAMERA_REALISTIC:
        return 0.5 * camera->as.realistic.film_diagonal * camera->width /
               hypot((double)camera->width, (double)camera->height);
    case CA_CAMERA_ORTHOGRAPHIC:
    case CA_CAMERA_PANELS:
    case CA_CAMERA_KIND_COUNT: break;
    }
    return 1.0;
}

void ca_camera_set_tan_half_x(ca_camera *camera, float tan_half_x)
{
    switch (camera->kind) {
    case CA_CAMERA_PERSPECTIVE: camera->as.perspective.tan_half_x = tan_half_x; break;
    case CA_CAMERA_THIN_LENS: camera->as.thin_lens.tan_half_x = tan_half_x; break;
    case CA_CAMERA_ORTHOGRAPHIC:
    case CA_CAMERA_REALISTIC:
    case CA_CAMERA_PANELS:
    case CA_CAMERA_KIND_COUNT: break;
    }
}

/* A principal point's offset moves what the film sees as if every film position were larger by it, as in Mitsuba
 * 3. */
void ca_camera_prepare(ca_camera *camera)
{
    if (camera->kind == CA_CAMERA_PANELS) {
        ca_panels_prepare(camera);
        return;
    }
    const double half_x = half_width(camera);
    const double half_y = half_x * camera->height / camera->width;
    camera->pixel_width = (float)(2.0 * half_x / camera->width);
    camera->pixel_height = (float)(2.0 * half_y / camera->height);
    camera->left = (float)(half_x * (1.0 - 2.0 * (double)camera->principal_x));
    camera->top = (float)(half_y * (1.0 - 2.0 * (double)camera->principal_y));
    if (camera->kind == CA_CAMERA_REALISTIC) ca_realistic_prepare(camera);
    if (camera->kind != CA_CAMERA_ORTHOGRAPHIC) return;
    const ca_vec3 axis = ca_normalize(column(camera, 2));
    camera->as.orthographic.area_scale = ca_abs_dot(ca_cross(column(camera, 0), column(camera, 1)), axis);
}

static void set_columns(ca_camera *camera, const ca_vec3 columns[4])
{
    ca_matrix m = ca_matrix_identity();
    for (int i = 0; i < 4; i++) {
        m.m[0][i] = (double)columns[i].x;
        m.m[1][i] = (double)columns[i].y;
        m.m[2][i] = (double)columns[i].z;
    }
    const bool good = ca_affine_from_matrix(&m, &camera->map);
    assert(good);
    (void)good;
}

void ca_camera_move_out(ca_camera *camera, ca_vec3 center, float radius)
{
    const ca_vec3 axis = ca_normalize(column(camera, 2)), place = column(camera, 3);
    const float behind = ca_dot(ca_sub(center, place), axis) - 1.5f * radius;
    const ca_vec3 columns[4] = {column(camera, 0), column(camera, 1), axis, ca_madd(place, behind, axis)};
    set_columns(camera, columns);
}

void ca_camera_cover(ca_camera *camera, ca_vec3 center, float radius)
{
    const ca_frame frame = ca_frame_from_normal(ca_normalize(column(camera, 2)));
    const ca_vec3 columns[4] = {ca_mul(frame.s, radius), ca_mul(frame.t, radius), frame.n,
                                ca_madd(center, -1.5f * radius, frame.n)};
    set_columns(camera, columns);
}

bool ca_camera_has_dirac_position(const ca_camera *camera)
{
    switch (camera->kind) {
    case CA_CAMERA_PERSPECTIVE: return true;
    case CA_CAMERA_THIN_LENS: return !(camera->as.thin_lens.lens_radius > 0.0f);
    case CA_CAMERA_ORTHOGRAPHIC:
    case CA_CAMERA_REALISTIC:
    case CA_CAMERA_PANELS:
    case CA_CAMERA_KIND_COUNT: break;
    }
    return false;
}

uint32_t ca_camera_count(const ca_camera *camera)
{
    return camera->kind == CA_CAMERA_PANELS ? camera->as.panels.count : 1;
}

bool ca_camera_has_lens(const ca_camera *camera)
{
    return camera->kind == CA_CAMERA_THIN_LENS || camera->kind == CA_CAMERA_REALISTIC ||
           camera->kind == CA_CAMERA_PANELS;
}

bool ca_camera_has_field_of_view(const ca_camera *camera)
{
    return camera->kind == CA_CAMERA_PERSPECTIVE || camera->kind == CA_CAMERA_THIN_LENS;
}

bool ca_camera_has_dirac_direction(const ca_camera *camera) { return camera->kind == CA_CAMERA_ORTHOGRAPHIC; }

/* Film position <-> point of the plane z = 1 (perspective) or z = 0 (orthographic), in camera space. */
static ca_vec2 film_to_plane(const ca_camera *camera, ca_vec2 film)
{
    return (ca_vec2){camera->left - film.x * camera->pixel_width, camera->top - film.y * camera->pixel_height};
}

static ca_vec2 plane_to_film(const ca_camera *camera, ca_vec2 plane)
{
    return (ca_vec2){(camera->left - plane.x) / camera->pixel_width, (camera->top - plane.y) / camera->pixel_height};
}

/* Densities of a ray that leaves with `cos_camera`. A pixel covers pixel_width pixel_height on the plane z = 1, at
 * the distance 1/cos and tilted by cos: area cos^3 steradians. On a lens the same holds for its image in the plane of
 * focus, larger by focus_distance^2 and farther by as much. */
static ca_pdf_solid_angle pixel_pdf(const ca_camera *camera, float cos_camera)
{
    const float area = camera->pixel_width * camera->pixel_height;
    return (ca_pdf_solid_angle){1.0f / (area * cos_camera * cos_camera * cos_camera)};
}

static ca_pdf_area position_pdf(const ca_camera *camera)
{
    if (camera->kind == CA_CAMERA_ORTHOGRAPHIC) {
        const float area =
            camera->is_disk ? CA_PI : camera->pixel_width * camera->pixel_height;
        return (ca_pdf_area){1.0f / (area * camera->as.orthographic.area_scale)};
    }
    if (ca_camera_has_dirac_position(camera)) return (ca_pdf_area){1.0f};
    return (ca_pdf_area){CA_INV_PI / ca_sqr(camera->as.thin_lens.lens_radius)};
}

/* ---- Rays ------------------------------------------------------------------------------------------------------ */

static ca_camera_ray orthographic_ray(const ca_camera *camera, ca_vec2 plane)
{
    if (camera->is_disk)
        plane = ca_warp_disk((ca_vec2){0.5f * plane.x + 0.5f, 0.5f * plane.y + 0.5f});
    const ca_vec3 axis = column(camera, 2);
    const float length = ca_length(axis);
    return (ca_camera_ray){.origin = ca_map_point(camera->map.to, (ca_vec3){plane.x, plane.y, 0.0f}),
                           .direction = ca_mul(axis, 1.0f / length),
                           .t_min = camera->near_clip * length,
                           .t_max = camera->far_clip * length,
                           .weight = {1.0f, 1.0f, 1.0f},
                           .pdf_position = position_pdf(camera),
                           .pdf_direction = {1.0f},
                           .cos_camera = 1.0f,
                           .camera = camera};
}

static ca_vec3 lens_point(const ca_camera *camera, ca_vec2 u_lens)
{
    if (ca_camera_has_dirac_position(camera)) return (ca_vec3){0.0f, 0.0f, 0.0f};
    const ca_vec2 disk = ca_warp_disk(u_lens);
    return (ca_vec3){camera->as.thin_lens.lens_radius * disk.x, camera->as.thin_lens.lens_radius * disk.y, 0.0f};
}

ca_camera_ray ca_camera_sample_ray(const ca_camera *camera, ca_vec2 film_position, ca_vec2 u_lens)
{
    if (camera->kind == CA_CAMERA_PANELS) return ca_panels_ray(camera, film_position, u_lens);
    if (camera->kind == CA_CAMERA_REALISTIC) return ca_realistic_ray(camera, film_position, u_lens);
    const ca_vec2 plane = film_to_plane(camera, film_position);
    if (camera->kind == CA_CAMERA_ORTHOGRAPHIC) return orthographic_ray(camera, plane);

    /* All rays of a film position meet in the plane of focus. */
    const ca_vec3 lens = lens_point(camera, u_lens);
    ca_vec3 direction = {plane.x, plane.y, 1.0f};
    if (!ca_camera_has_dirac_position(camera)) {
        direction.x -= lens.x / camera->as.thin_lens.focus_distance;
        direction.y -= lens.y / camera->as.thin_lens.focus_distance;
    }
    const float cos_camera = 1.0f / ca_length(direction);
    return (ca_camera_ray){.origin = ca_map_point(camera->map.to, lens),
                           .direction = ca_normalize(ca_map_vector(camera->map.to, direction)),
                           .t_min = camera->near_clip / cos_camera,
                           .t_max = camera->far_clip / cos_camera,
                           .weight = {1.0f, 1.0f, 1.0f},
                           .pdf_position = position_pdf(camera),
                           .pdf_direction = pixel_pdf(camera, cos_camera),
                           .cos_camera = cos_camera,
                           .camera = camera};
}

static inline ca_v8 map_vector8(const float m[3][4], ca_v8 v)
{
    return (ca_v8){m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z, m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
                   m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
}

void ca_camera_sample_rays8(const ca_camera *camera, const ca_f8 film_position[2], const ca_f8 u_lens[2],
                            ca_camera_rays8 *rays)
{
    const float(*to)[4] = camera->map.to;
    const ca_f8 zero = ca_f8_all(0.0f);
    ca_v8 lens = {zero, zero, zero}, direction = {camera->left - film_position[0] * camera->pixel_width,
                                                  camera->top - film_position[1] * camera->pixel_height,
                                                  ca_f8_all(1.0f)};
    if (!ca_camera_has_dirac_position(camera)) {
        ca_disk8(u_lens[0], u_lens[1], &lens.x, &lens.y);
        lens.x = camera->as.thin_lens.lens_radius * lens.x;
        lens.y = camera->as.thin_lens.lens_radius * lens.y;
        direction.x -= lens.x / camera->as.thin_lens.focus_distance;
        direction.y -= lens.y / camera->as.thin_lens.focus_distance;
    }
    const ca_f8 cos_camera = 1.0f / ca_sqrt8(ca_dot_v8(direction, direction));
    const ca_v8 from_lens = map_vector8(to, lens);
    rays->origin = (ca_v8){from_lens.x + to[0][3], from_lens.y + to[1][3], from_lens.z + to[2][3]};
    rays->direction = ca_normalize_v8(map_vector8(to, direction));
    rays->t_min = camera->near_clip / cos_camera;
    rays->t_max = camera->far_clip / cos_camera;
}

/* ---- Splats ---------------------------------------------------------------------------------------------------- */

static bool on_film(const ca_camera *camera, ca_vec2 film, float margin)
{
    return film.x >= -margin && film.y >= -margin && film.x <= (float)camera->width + margin &&
           film.y <= (float)camera->height + margin;
}

/* A world point in camera space. The camera's place is taken off first: mapping coordinates far from the world's
 * origin would lose the digits that tell pixels apart. */
static ca_vec3 to_camera_space(const ca_camera *camera, ca_vec3 world)
{
    return ca_map_vector(camera->map.from, ca_sub(world, column(camera, 3)));
}

static bool orthographic_direct(const ca_camera *camera, ca_vec3 reference, float margin, ca_camera_direct *direct)
{
    const ca_vec3 local = to_camera_space(camera, reference);
    if (!(local.z >= camera->near_clip && local.z <= camera->far_clip)) return false;
    ca_vec2 film = plane_to_film(camera, (ca_vec2){local.x, local.y});
    if (camera->is_disk) { /* of one pixel, wherever in it */
        if (local.x * local.x + local.y * local.y > 1.0f) return false;
        film = (ca_vec2){0.5f, 0.5f};
    }
    if (!on_film(camera, film, margin)) return false;
    const ca_vec3 axis = column(camera, 2);
    const float length = ca_length(axis);
    const ca_pdf_area pdf_position = position_pdf(camera);
    *direct = (ca_camera_direct){.position = ca_map_point(camera->map.to, (ca_vec3){local.x, local.y, 0.0f}),
                                 .to_camera = ca_mul(axis, -1.0f / length),
                                 .distance = local.z * length,
                                 .t_near = (local.z - camera->near_clip) * length,
                                 .film_position = film,
                                 .importance = pdf_position.v,
                                 .pdf_direct = {1.0f},
                                 .pdf_position = pdf_position,
                                 .pdf_direction = {1.0f},
                                 .cos_camera = 1.0f,
                                 .camera = camera};
    return true;
}

bool ca_camera_sample_direct(const ca_camera *camera, ca_vec3 reference, ca_vec2 u_lens, float margin,
                             ca_camera_direct *direct)
{
    if (camera->kind == CA_CAMERA_PANELS) return ca_panels_direct(camera, reference, u_lens, margin, direct);
    if (camera->kind == CA_CAMERA_ORTHOGRAPHIC) return orthographic_direct(camera, reference, margin, direct);

    const ca_vec3 local = to_camera_space(camera, reference);
    if (!(local.z > 0.0f && local.z >= camera->near_clip && local.z <= camera->far_clip)) return false;
    if (camera->kind == CA_CAMERA_REALISTIC)
        return ca_realistic_direct(camera, local, u_lens, direct) && on_film(camera, direct->film_position, margin);
    const ca_vec3 lens = lens_point(camera, u_lens);
    const bool dirac = ca_camera_has_dirac_position(camera);
    const ca_vec3 ray = ca_sub(local, lens);
    ca_vec2 plane = {ray.x / local.z, ray.y / local.z};
    if (!dirac) { /* the plane of focus, seen from the lens' centre, projected to z = 1 */
        plane.x += lens.x / camera->as.thin_lens.focus_distance;
        plane.y += lens.y / camera->as.thin_lens.focus_distance;
    }
    const ca_vec2 film = plane_to_film(camera, plane);
    if (!on_film(camera, film, margin)) return false;

    const float distance = ca_length(ray), cos_camera = local.z / distance;
    const ca_pdf_solid_angle pdf_direction = pixel_pdf(camera, cos_camera);
    const ca_pdf_area pdf_position = position_pdf(camera);
    /* We = pdf_position pdf_direction / cos; a pinhole has the geometry of the connection in its importance. */
    const float We = pdf_position.v * pdf_direction.v / cos_camera;
    *direct = (ca_camera_direct){
        .position = ca_map_point(camera->map.to, lens),
        .to_camera = ca_normalize(ca_map_vector(camera->map.to, ca_neg(ray))),
        .distance = distance,
        .t_near = distance * ((local.z - camera->near_clip) / local.z),
        .film_position = film,
        .importance = dirac ? We * cos_camera / ca_sqr(distance) : We,
        .pdf_direct = {dirac ? 1.0f : ca_pdf_to_solid_angle(pdf_position, cos_camera, ca_sqr(distance)).v},
        .pdf_position = pdf_position,
        .pdf_direction = pdf_direction,
        .cos_camera = cos_camera,
        .camera = camera};
    return true;
}
