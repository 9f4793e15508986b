#include "support/traced_path.h"

#include "support/lens_oracle.h"
#include "support/specular_chain.h"

static const double pi = 3.14159265358979323846;

/* A direction this near to a Dirac event's is that event. Where nothing else can happen it is it from farther, too:
 * points that are close together, as at edges, leave a direction few digits. */
#define SAME_DIRECTION 3e-4
#define ONLY_DIRECTION 0.05

/* ---- Points ---------------------------------------------------------------------------------------------------- */

static uint32_t light_number(const ca_observed_path *observed, const ca_scene *scene)
{
    if (observed->path->light.count > 0) return observed->light[0].point.shape;
    const ca_surface_point *last = &observed->camera[observed->path->camera.count - 1];
    return last->shape == CA_NONE ? scene->environment : scene->shapes[last->shape].light;
}

static void read_points(const ca_observed_path *observed, traced_path *path)
{
    const uint32_t s = observed->path->camera.count, t = observed->path->light.count;
    for (uint32_t i = 0; i < path->n; i++) {
        const ca_surface_point *point = i < s ? &observed->camera[i] : &observed->light[s + t - 1 - i].point;
        path->points[i] = *point;
        path->facing_camera[i] = path->facing_light[i] = dv_from(point->position);
        path->ng[i] = dv_from(point->ng);
    }
    if (observed->technique != CA_TECHNIQUE_MERGE) return;
    path->merged = s - 1;
    path->facing_light[s - 1] = dv_from(observed->light[t].point.position);
    path->ng[s - 1] = dv_from(observed->light[t].point.ng);
}

/* Where a ray from a point towards another starts: off the surface. */
static double_vec ray_origin(const ca_surface_point *point, double_vec towards)
{
    const double_vec direction = dv_sub(towards, dv_from(point->position));
    const ca_vec3 error = {point->position_error, point->position_error, point->position_error};
    return dv_from(ca_offset_origin(point->position, error, point->ng, dv_round(direction)));
}

/* Segments that a walk has traced begin off the surface, those that a technique adds on it. */
static void start_rays(traced_path *path, ca_technique technique)
{
    const uint32_t n = path->n, s = path->split, light_first = technique == CA_TECHNIQUE_MERGE ? s - 1 : s;
    const uint32_t camera_last = technique == CA_TECHNIQUE_HIT ? n - 1 : s - 1;
    for (uint32_t i = 1; i < camera_last; i++)
        path->facing_light[i] = ray_origin(&path->points[i], path->facing_camera[i + 1]);
    for (uint32_t i = n - 2; i > light_first; i--)
        path->facing_camera[i] = ray_origin(&path->points[i], path->facing_light[i - 1]);
}

static double disk_area(const ca_light *light)
{
    return pi * (double)light->scene_radius * (double)light->scene_radius;
}

/* Of the line through a point along `way`: of the disk around the scene, and of the guide's balls. */
static double disk_density(const ca_emission_guide *guide, uint32_t light, const ca_scene *scene, double_vec point,
                           double_vec way)
{
    const double usual = 1.0 / disk_area(&scene->lights[light]);
    if (!guide || guide->aims[light].count == 0) return usual;
    const ca_guide_aim *aim = &guide->aims[light];
    double density = (double)ca_distribution_1d_probability(&aim->parts, 0) * usual;
    for (uint32_t i = 0; i < aim->count; i++) {
        const double radius = (double)aim->balls[i].radius;
        const double_vec offset = dv_sub(point, dv_from(aim->balls[i].center));
        const double_vec across = dv_sub(offset, dv_mul(way, dv_dot(offset, way)));
        if (dv_length(across) <= radius)
            density += (double)ca_distribution_1d_probability(&aim->parts, i + 1) / (pi * radius * radius);
    }
    return density;
}

/* The probability of the light, and the density of the ray's origin. */
static void read_emission(const ca_emission_guide *guide, uint32_t light, traced_path *path)
{
    const uint32_t last = path->n - 1;
    const ca_light_choice *choice = &path->scene->light_choice;
    path->light_choice = (double)(guide ? ca_distribution_1d_probability(&guide->choice, light)
                                        : ca_light_choice_probability(choice, light));
    if (path->light->kind == CA_LIGHT_BEAM) path->disk_density = 1.0 / (double)path->light->as.beam.shape->area;
    if (guide && guide->aims[light].count > 0 && !ca_light_is_infinite(path->light)) path->aim = &guide->aims[light];
    if (!ca_light_is_infinite(path->light) || path->n < 2) return;
    const double_vec point = path->facing_light[last - 1];
    const double_vec way = dv_unit(dv_sub(path->facing_camera[last], point));
    path->disk_density = disk_density(guide, light, path->scene, point, way);
}

/* Of several side by side the one in whose lens the path begins: they are far apart. */
static const ca_camera *camera_at(const ca_camera *camera, ca_vec3 position)
{
    if (camera->kind != CA_CAMERA_PANELS) return camera;
    const ca_camera *nearest = NULL;
    float least = INFINITY;
    for (uint32_t i = 0; i < camera->as.panels.count; i++) {
        const float(*m)[4] = camera->as.panels.cameras[i].map.to;
        const float distance = ca_length(ca_sub(position, (ca_vec3){m[0][3], m[1][3], m[2][3]}));
        if (distance >= least) continue;
        least = distance;
        nearest = &camera->as.panels.cameras[i];
    }
    return nearest;
}

bool traced_path_read(const ca_observed_path *observed, const ca_scene *scene, const ca_camera *camera,
                      const ca_emission_guide *guide, float (*density)(const void *user, ca_vec3 position),
                      const void *user, traced_path *path)
{
    const uint32_t n = observed->path->camera.count + observed->path->light.count;
    if (n > CA_FULL_PATH_MAX) return false;
    const uint32_t light = light_number(observed, scene);
    *path = (traced_path){.scene = scene,
                          .camera = camera_at(camera, observed->camera[0].position),
                          .light = &scene->lights[light],
                          .factors = observed->path->factors,
                          .n = n,
                          .split = observed->path->camera.count};
    read_points(observed, path);
    start_rays(path, observed->technique);
    read_emission(guide, light, path);
    for (uint32_t i = 1; i + 1 < n && density; i++)
        path->photon_density[i] = (double)density(user, path->points[i].position);
    return true;
}

double traced_path_uncertainty(const traced_path *path, uint32_t i)
{
    const ca_surface_point *point = &path->points[i];
    const double size = dv_length(dv_from(point->position));
    double reach = 0.0;
    if (i > 0) reach = dv_length(dv_sub(path->facing_camera[i], path->facing_light[i - 1]));
    if (i + 1 < path->n) reach = fmax(reach, dv_length(dv_sub(path->facing_light[i], path->facing_camera[i + 1])));
    /* A ray starts off the surface by the bound along the normal, and its direction is rounded. */
    return 3.0 * (double)point->position_error + 4e-7 * (size + reach);
}

/* ---- Segments and events --------------------------------------------------------------------------------------- */

/* From x[i] to x[i+1]. */
static double_vec segment(const traced_path *path, uint32_t i)
{
    return dv_sub(path->facing_camera[i + 1], path->facing_light[i]);
}

static double_vec to_light(const traced_path *path, uint32_t i) { return dv_unit(segment(path, i)); }
static double_vec to_camera(const traced_path *path, uint32_t i) { return dv_mul(to_light(path, i - 1), -1.0); }

static void bsdf_seen_from(const traced_path *path, uint32_t i, double_vec from, ca_bsdf *bsdf)
{
    const ca_scene *scene = path->scene;
    ca_surface surface;
    ca_accel_surface_at(scene->accel, &path->points[i], &surface);
    ca_bsdf_init(bsdf, scene->materials, scene->desc.textures.items, &surface, dv_round(from));
}

/* A Dirac event that takes `from` to `to`, or nearly. */
typedef struct dirac_event {
    double miss; /* distance of the unit directions; INFINITY: there is no event at all */
    double probability, eta;
    double_vec normal; /* of the leaf that does it */
} dirac_event;

static void try_event(const ca_bsdf *bsdf, ca_vec3 normal, double_vec from, double_vec to, float u_lobe,
                      dirac_event *best)
{
    ca_bsdf_sample sample;
    const ca_vec2 centre = {0.5f, 0.5f};
    if (!ca_bsdf_sample_direction(bsdf, dv_round(from), u_lobe, centre, CA_FROM_CAMERA, &sample)) return;
    if (!(sample.scatter & CA_SCATTER_DIRAC)) return;
    const double miss = dv_length(dv_sub(dv_from(sample.wo_world), to));
    if (miss >= best->miss) return;
    *best = (dirac_event){.miss = miss,
                          .probability = (double)sample.pdf.v,
                          .eta = (double)sample.eta,
                          .normal = dv_from(normal)};
}

/* Every leaf is asked at both ends of its share, where those that can do two things do different ones. */
static dirac_event find_event(const traced_path *path, uint32_t i, double_vec from, double_vec to)
{
    ca_bsdf bsdf;
    bsdf_seen_from(path, i, from, &bsdf);
    dirac_event best = {.miss = (double)INFINITY};
    if (bsdf.null_weight > 0.0f) try_event(&bsdf, bsdf.ng, from, to, 0.0f, &best);
    float begin = bsdf.null_weight;
    for (uint32_t k = 0; k < bsdf.lobe_count; k++) {
        const float weight = bsdf.lobes[k].weight;
        const ca_vec3 normal = bsdf.lobes[k].frame.n;
        try_event(&bsdf, normal, from, to, begin + 1e-6f * weight, &best);
        try_event(&bsdf, normal, from, to, begin + (1.0f - 1e-6f) * weight, &best);
        begin += weight;
    }
    return best;
}

static bool is_joined(const traced_path *path, ca_technique technique, uint32_t i)
{
    if (technique == CA_TECHNIQUE_HIT) return false;
    return i + 1 == path->split || (i == path->split && technique != CA_TECHNIQUE_MERGE);
}

bool traced_path_find_events(traced_path *path, ca_technique technique, const char **complaint)
{
    for (uint32_t i = 1; i + 1 < path->n; i++) {
        const double_vec from = to_camera(path, i), to = to_light(path, i);
        ca_bsdf bsdf;
        bsdf_seen_from(path, i, from, &bsdf);
        const bool smooth = (bsdf.scatter & CA_SCATTER_SMOOTH) != 0;
        path->dirac[i] = false;
        const double near = smooth ? SAME_DIRECTION : ONLY_DIRECTION;
        if (!is_joined(path, technique, i)) path->dirac[i] = find_event(path, i, from, to).miss < near;
        if (path->dirac[i] || smooth) continue;
        *complaint = is_joined(path, technique, i) ? "a joined vertex has no smooth part"
                                                   : "a vertex has no event that explains where the path goes";
        return false;
    }
    return true;
}

/* d(omega towards the light) / d(omega towards the camera) of the Dirac event at x[i]: n^2 cos d(omega) stays
 * (etendue). */
static double jacobian_of_event(const traced_path *path, uint32_t i)
{
    const double_vec from = to_camera(path, i), to = to_light(path, i);
    const dirac_event event = find_event(path, i, from, to);
    if (event.eta == 1.0) return 1.0;
    return fabs(dv_dot(event.normal, from)) / (event.eta * event.eta * fabs(dv_dot(event.normal, to)));
}

/* Density per solid angle with which a walk that comes from `from` goes on to `to`; a Dirac event's probability. */
static double pdf_of_event(const traced_path *path, uint32_t i, double_vec from, double_vec to, ca_from walk)
{
    if (path->dirac[i]) return find_event(path, i, from, to).probability;
    if (path->uniform) return 0.5 / pi;
    ca_bsdf bsdf;
    bsdf_seen_from(path, i, from, &bsdf);
    return (double)ca_bsdf_eval(&bsdf, dv_round(from), dv_round(to), walk).pdf.v;
}

/* ---- Ends ------------------------------------------------------------------------------------------------------ */

static double lens_area(const ca_camera *camera)
{
    if (ca_camera_has_dirac_direction(camera))
        return (double)camera->pixel_width * (double)camera->pixel_height *
               (double)camera->as.orthographic.area_scale;
    if (ca_camera_has_dirac_position(camera)) return 0.0;
    if (camera->kind == CA_CAMERA_REALISTIC)
        return pi * pow(camera->as.realistic.disk_radius * camera->as.realistic.scale, 2.0);
    return pi * (double)camera->as.thin_lens.lens_radius * (double)camera->as.thin_lens.lens_radius;
}

/* A pixel is seen under pixel_width pixel_height cos^3 steradians, on the plane z = 1 of the camera's space. (Where
 * the path's first vertex is no lens this is some number, and all techniques have it.) */
static double pixel_pdf(const ca_camera *camera, double_vec position, double_vec direction)
{
    if (camera->kind == CA_CAMERA_REALISTIC) {
        const double density = lens_oracle_density(camera, position, direction) * lens_area(camera);
        return density > 0.0 ? density : 1.0;
    }
    const ca_vec3 axis = {camera->map.to[0][2], camera->map.to[1][2], camera->map.to[2][2]};
    const double cos_camera = fabs(dv_dot(dv_unit(dv_from(axis)), direction));
    return 1.0 / ((double)camera->pixel_width * (double)camera->pixel_height * pow(cos_camera, 3.0));
}

static void recompute_camera_end(const traced_path *path, ca_full_path *full)
{
    const double area = lens_area(path->camera);
    full->camera_parallel = ca_camera_has_dirac_direction(path->camera);
    full->camera_area = (float)area;
    full->splat_scale = 1.0f; /* there is no map of camera paths */
    full->pdf_camera[0] = area > 0.0 && !full->camera_parallel ? (float)(1.0 / area) : 1.0f;
    const double_vec position = dv_from(path->points[0].position);
    full->pdf_to_light[0] =
        full->camera_parallel ? 1.0f : (float)pixel_pdf(path->camera, position, to_light(path, 0));
}

/* Of leaving the light towards x[n-2], per solid angle. */
static double usual_emission_pdf(const traced_path *path)
{
    const uint32_t last = path->n - 1;
    const double_vec direction = to_camera(path, last);
    const ca_vec3 reference = dv_round(path->facing_light[last - 1]);
    ca_light_direct direct = {0};
    if (path->uniform) return 0.5 / pi;
    switch (path->light->kind) {
    case CA_LIGHT_AREA: return fmax(dv_dot(path->ng[last], direction), 0.0) / pi;
    case CA_LIGHT_BEAM:
    case CA_LIGHT_DIRECTIONAL: return 1.0;
    case CA_LIGHT_CONSTANT:
    case CA_LIGHT_ENVMAP:
        return (double)ca_light_eval_hit(path->light, reference, NULL, dv_round(direction)).pdf_direction.v;
    default:
        ca_light_sample_direct(path->light, reference, (ca_vec2){0.5f, 0.5f}, &direct);
        return (double)direct.pdf_direction.v;
    }
}

/* Of directions that a guide aims: balls that hold the light, or lie behind its surface, leave theirs to the usual
 * ones. */
static double emission_pdf(const traced_path *path)
{
    const uint32_t last = path->n - 1;
    const double usual = usual_emission_pdf(path);
    if (!path->aim) return usual;
    const double_vec way = to_camera(path, last);
    double pdf = (double)ca_distribution_1d_probability(&path->aim->parts, 0) * usual;
    for (uint32_t i = 0; i < path->aim->count; i++) {
        const ca_guide_ball *ball = &path->aim->balls[i];
        const double share = (double)ca_distribution_1d_probability(&path->aim->parts, i + 1);
        const double_vec offset = dv_sub(dv_from(ball->center), dv_from(path->points[last].position));
        const double distance = dv_length(offset), sine = (double)ball->radius / distance;
        const bool behind = dv_dot(offset, path->ng[last]) <= -(double)ball->radius;
        if (sine >= 1.0 || behind) {
            pdf += share * usual;
            continue;
        }
        const double most = asin(sine), angle = acos(fmin(dv_dot(offset, way) / distance, 1.0));
        if (angle <= most) pdf += share / (2.0 * pi * (1.0 - cos(most)));
    }
    return pdf;
}

/* Who asks for light at x[i]: what lies behind a surface that only reflects cannot help; the lens gets it from
 * everywhere. */
static ca_light_receiver receiver_at(const traced_path *path, uint32_t i)
{
    ca_light_receiver receiver = {.position = path->points[i].position};
    if (i == path->merged && i > 0) receiver.position = dv_round(path->facing_light[i]);
    if (i == 0) return receiver;
    const double_vec from = i == path->merged ? to_light(path, i) : to_camera(path, i); /* a photon's ng may lean */
    ca_bsdf bsdf;
    bsdf_seen_from(path, i, from, &bsdf);
    if (bsdf.scatter & CA_SCATTER_TRANSMISSION) return receiver;
    const ca_vec3 ng = dv_round(path->ng[i]);
    receiver.normal = dv_dot(path->ng[i], from) < 0.0 ? ca_neg(ng) : ng;
    return receiver;
}

/* Next event chooses points of some shapes by the solid angle under which they are seen, of all else as emission
 * does; and a light by what it may contribute, emission by power. */
static double next_event_ratio(const traced_path *path)
{
    if (path->uniform) return 1.0;
    const uint32_t last = path->n - 1;
    const ca_light_choice *choice = &path->scene->light_choice;
    const uint32_t light = (uint32_t)(path->light - path->scene->lights);
    const ca_light_receiver receiver = receiver_at(path, last - 1);
    const double chosen =
        (double)ca_light_choice_direct_probability(choice, &receiver, light) / path->light_choice;
    if (path->light->kind == CA_LIGHT_BEAM && path->light->as.beam.shape->kind == CA_SHAPE_SPHERE) return 0.0;
    if (path->light->kind != CA_LIGHT_AREA) return chosen;
    const ca_shape *shape = path->light->as.area.shape;
    const double_vec way = dv_sub(dv_from(path->points[last].position), dv_from(receiver.position));
    const double cos_light = fabs(dv_dot(path->ng[last], dv_unit(way)));
    const ca_pdf_solid_angle pdf = ca_shape_pdf_seen(shape, receiver.position);
    if (!(pdf.v > 0.0f)) return chosen;
    return chosen * (double)pdf.v * cos_light / dv_dot(way, way) * (double)shape->area;
}

static void recompute_light_end(const traced_path *path, ca_full_path *full)
{
    const ca_light *light = path->light;
    const uint32_t last = path->n - 1;
    const bool infinite = ca_light_is_infinite(light) || light->kind == CA_LIGHT_BEAM; /* parallel rays */
    const double area = light->kind == CA_LIGHT_AREA ? (double)light->as.area.shape->area
                        : infinite                   ? 1.0 / path->disk_density
                                                     : 0.0;
    const double pdf = emission_pdf(path);
    full->light_area = (float)area;
    full->light_infinite = infinite;
    full->light_parallel = ca_light_has_dirac_direction(light);
    full->light_choice = (float)path->light_choice;
    full->next_event_ratio = (float)next_event_ratio(path);
    full->pdf_to_camera[last] = (float)pdf;
    full->pdf_light[last] =
        (float)(path->light_choice * (infinite ? pdf : light->kind == CA_LIGHT_AREA ? 1.0 / area : 1.0));
}

/* ---- The whole path -------------------------------------------------------------------------------------------- */

static void recompute_events(const traced_path *path, ca_full_path *full)
{
    for (uint32_t i = 1; i + 1 < path->n; i++) {
        const double_vec from = to_camera(path, i), to = to_light(path, i), ng = dv_from(path->points[i].ng);
        full->dirac[i] = path->dirac[i];
        full->photon_density[i] = (float)path->photon_density[i];
        full->cos_to_camera[i] = (float)fabs(dv_dot(ng, from));
        full->cos_to_light[i] = (float)fabs(dv_dot(ng, to));
        full->pdf_to_light[i] = (float)pdf_of_event(path, i, from, to, CA_FROM_CAMERA);
        full->pdf_to_camera[i] = (float)pdf_of_event(path, i, to, from, CA_FROM_LIGHT);
    }
}

/* |cos| over distance^2 of x[i+1] as seen from x[i], and the other way round. A segment of parallel rays does not
 * thin out; what is at infinity has no cosine; Dirac lights are never met. */
static double thinning_to_light(const traced_path *path, const ca_full_path *full, uint32_t i)
{
    const double_vec way = segment(path, i);
    if (i + 2 == path->n) {
        const ca_light *light = path->light;
        if (ca_light_has_dirac_position(light) || ca_light_has_dirac_direction(light)) return 0.0;
        if (full->light_infinite) return 1.0;
    }
    const double cos_there = fabs(dv_dot(dv_from(path->points[i + 1].ng), dv_unit(way)));
    return i == 0 && full->camera_parallel ? cos_there / lens_area(path->camera) : cos_there / dv_dot(way, way);
}

static double thinning_to_camera(const traced_path *path, const ca_full_path *full, uint32_t i)
{
    const double_vec way = segment(path, i);
    const double cos_there = fabs(dv_dot(path->ng[i], dv_unit(way)));
    return i + 2 == path->n && full->light_infinite ? cos_there * path->disk_density
                                                    : cos_there / dv_dot(way, way);
}

static void recompute_densities(const traced_path *path, ca_full_path *full)
{
    for (uint32_t i = 0; i + 1 < path->n; i++)
        full->pdf_camera[i + 1] = (float)((double)full->pdf_to_light[i] * thinning_to_light(path, full, i));
    for (uint32_t i = 1; i + 1 < path->n; i++) {
        const bool parallel = i + 2 == path->n && full->light_infinite;
        const double pdf = parallel ? 1.0 : (double)full->pdf_to_camera[i + 1];
        const double jacobian = path->dirac[i + 1] ? jacobian_of_event(path, i + 1) : 1.0;
        full->pdf_light[i] = (float)(pdf * jacobian * thinning_to_camera(path, full, i));
    }
}

static void recompute_distances(const traced_path *path, ca_full_path *full)
{
    for (uint32_t i = 0; i + 1 < path->n; i++) full->distance[i] = (float)dv_length(segment(path, i));
    if (!ca_light_is_infinite(path->light)) return;
    const uint32_t i = path->n - 2;
    const double_vec offset = dv_sub(path->facing_light[i], dv_from(path->light->scene_center));
    full->distance[i] = (float)((double)path->light->scene_radius - dv_dot(offset, to_light(path, i)));
}

/* ---- Dirac events as one map ----------------------------------------------------------------------------------- */

/* A sphere, or the plane of a triangle. */
static chain_surface surface_at(const traced_path *path, uint32_t i)
{
    const double_vec met = path->facing_camera[i];
    chain_surface surface = {.place = met, .normal = dv_unit(path->ng[i]), .met = met};
    const bool light = i + 1 == path->n;
    if (light && path->light->kind != CA_LIGHT_AREA) return surface; /* a point: never met */
    const ca_shape *shape = light ? path->light->as.area.shape : &path->scene->shapes[path->points[i].shape];
    if (shape->kind != CA_SHAPE_SPHERE) return surface;
    surface.sphere = true;
    surface.place = dv_from(shape->as.sphere.center);
    surface.radius = (double)shape->as.sphere.radius;
    return surface;
}

/* Of the walk that comes to x[i] from `from` and goes on to `to`. */
static chain_surface event_at(const traced_path *path, uint32_t i, double_vec from, double_vec to)
{
    chain_surface surface = surface_at(path, i);
    const dirac_event event = find_event(path, i, from, to);
    surface.reflects = dv_dot(event.normal, from) * dv_dot(event.normal, to) > 0.0;
    surface.eta = event.eta;
    return surface;
}

static double area_per_solid_angle(const traced_path *path, uint32_t first, uint32_t last)
{
    chain_surface chain[CA_FULL_PATH_MAX];
    uint32_t count = 0;
    const bool onward = last > first;
    for (uint32_t i = onward ? first + 1 : first - 1; i != last; i += onward ? 1 : UINT32_MAX) {
        const double_vec to_eye = to_camera(path, i), on = to_light(path, i);
        chain[count++] = event_at(path, i, onward ? to_eye : on, onward ? on : to_eye);
    }
    chain[count++] = surface_at(path, last);
    return chain_area_per_solid_angle(chain, count, onward ? path->facing_light[first] : path->facing_camera[first],
                                      onward ? to_light(path, first) : to_camera(path, first));
}

/* Walks jump from x[a] to x[b] and back, through Dirac events alone, which have their probabilities. */
static void recompute_chain(const traced_path *path, uint32_t a, uint32_t b, ca_full_path *full)
{
    for (uint32_t i = a + 1; i < b; i++) {
        full->pdf_camera[i] = full->pdf_to_light[i];
        full->pdf_light[i] = full->pdf_to_camera[i];
    }
    if (full->pdf_camera[b] > 0.0f)
        full->pdf_camera[b] = (float)((double)full->pdf_to_light[a] / area_per_solid_angle(path, a, b));
    if (a > 0) full->pdf_light[a] = (float)((double)full->pdf_to_camera[b] / area_per_solid_angle(path, b, a));
}

static void recompute_chains(const traced_path *path, ca_full_path *full)
{
    for (uint32_t a = 0; a + 2 < path->n; a++) {
        uint32_t b = a + 1;
        while (path->dirac[b]) b++;
        if (b > a + 1) recompute_chain(path, a, b, full);
        a = b - 1;
    }
}

void traced_path_recompute(const traced_path *path, ca_full_path *full)
{
    *full = (ca_full_path){.n = path->n};
    full->light_class = (uint32_t)(path->light - path->scene->lights) % CA_FACTOR_LIGHTS;
    if (path->factors) full->factors = *path->factors;
    recompute_camera_end(path, full);
    recompute_light_end(path, full);
    recompute_events(path, full);
    recompute_densities(path, full);
    recompute_distances(path, full);
    if (path->by_differences) recompute_chains(path, full);
}
