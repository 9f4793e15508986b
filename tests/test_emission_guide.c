/* Guided emission: what a guide is made of; rays against their densities; and renders, which must have the same mean
 * as without a guide, less noise where light paths would miss the picture, and bits that depend on no threads. */
#include "base/memory.h"
#include "integrator/bidirectional.h"
#include "light/emission_guide.h"
#include "render/render.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

#define FILM                                                                                                         \
    "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='16'/>"                     \
    "<rfilter type='box'/></film>"
#define CAMERA                                                                                                       \
    "<sensor type='perspective'><float name='fov' value='50'/><transform name='to_world'>"                           \
    "<lookat origin='0,1.2,2.6' target='0,0.4,0' up='0,1,0'/></transform>" FILM "</sensor>"
#define PLAIN(size)                                                                                                  \
    "<shape type='rectangle'><transform name='to_world'><scale value='" size "'/><rotate x='1' angle='-90'/>"        \
    "</transform></shape>"
#define WALL                                                                                                         \
    "<shape type='rectangle'><transform name='to_world'><scale value='0.7'/><translate y='0.7' z='-1'/></transform>" \
    "</shape>"
#define GLASS                                                                                                        \
    "<shape type='sphere'><point name='center' value='0.2,0.5,0'/><float name='radius' value='0.5'/>"                \
    "<bsdf type='dielectric'/></shape>"
#define SUN                                                                                                          \
    "<emitter type='directional'><vector name='direction' value='0.3,-1,-0.2'/><rgb name='irradiance' value='4'/>"   \
    "</emitter>"
#define SKY "<emitter type='constant'><rgb name='radiance' value='0.4,0.5,0.7'/></emitter>"
#define BULB(place)                                                                                                  \
    "<emitter type='point'><point name='position' value='" place "'/><rgb name='intensity' value='3'/></emitter>"

/* A sun and a sky over a plain of 40 m, of which the picture shows three; four bulbs, of which it sees the light of
 * one. */
#define OUTSIDE                                                                                                      \
    "<scene version='3.0.0'>" CAMERA PLAIN("20") WALL GLASS SUN SKY BULB("0.5,2,1") BULB("15,1,0") BULB("-15,1,9")   \
        BULB("9,1,-15") "</scene>"

static ca_render_settings settings_of(const char *integrator, uint32_t samples, uint64_t seed)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = samples;
    settings.has_seed = true;
    settings.seed = seed;
    settings.threads = 1;
    return settings;
}

/* ---- A guide from samples -------------------------------------------------------------------------------------- */

enum { HEAPS = 3, POINTS = 400 };
static const ca_vec3 heaps[HEAPS] = {{8.0f, 0.0f, 2.0f}, {-5.0f, 0.0f, -6.0f}, {0.5f, 0.0f, 0.5f}};

/* Light of number 0 meets flat squares of 1 m: half of it the first one. Some of the last light's, which is a bulb's,
 * comes between. */
static size_t make_samples(ca_guide_sample samples[HEAPS * POINTS])
{
    const ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT};
    size_t count = 0;
    for (uint32_t i = 0; i < POINTS; i++)
        for (int heap = 0; heap < HEAPS; heap++) {
            const ca_stream stream = ca_stream_start(&sampler, i, (uint64_t)heap);
            const ca_vec2 u = ca_sample_2d(&stream, 0);
            const ca_vec3 offset = {u.x - 0.5f, 0.0f, u.y - 0.5f};
            samples[count++] = (ca_guide_sample){.position = ca_add(heaps[heap], offset),
                                                 .light = heap == 2 ? 2 : 0,
                                                 .weight = heap == 0 ? 2.0f : 1.0f};
        }
    return count;
}

static ca_emission_guide *make_guide(const ca_scene *scene)
{
    static ca_guide_sample samples[HEAPS * POINTS];
    ca_emission_guide *guide = NULL;
    ca_error error;
    const size_t count = make_samples(samples);
    assert_int_equal(ca_emission_guide_create(&guide, scene->lights, scene->light_count, &scene->light_choice,
                                              samples, count, &error),
                     CA_OK);
    return guide;
}

static double usual(const ca_scene *scene, uint32_t light)
{
    return (double)ca_light_choice_probability(&scene->light_choice, light);
}

/* A light has its share of the samples' light and of power. */
static void test_choice(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(OUTSIDE);
    ca_emission_guide *guide = make_guide(scene);
    double sum = 0.0;
    const double share[] = {0.75, 0.0, 0.25, 0.0, 0.0, 0.0};
    assert_int_equal(scene->light_count, 6);
    /* 600 of weight 2 ... are as many as (sum w)^2 / sum w^2 equal ones */
    const double equal = POINTS * 16.0 / 6.0, guided = 0.75 * equal / (equal + 8.0 * 6.0);
    for (uint32_t i = 0; i < 6; i++) {
        const double p = (double)ca_emission_probability(guide, &scene->light_choice, i);
        assert_true(fabs(p - guided * share[i] - (1.0 - guided) * usual(scene, i)) < 1e-5);
        assert_true((double)ca_emission_probability(NULL, &scene->light_choice, i) == usual(scene, i));
        sum += p;
    }
    assert_true(fabs(sum - 1.0) < 1e-5);
    for (uint32_t k = 0; k < 64; k++) {
        float probability;
        const float u = ((float)k + 0.5f) / 64.0f;
        const uint32_t light = ca_emission_choose(guide, &scene->light_choice, u, &probability);
        assert_true(probability == ca_emission_probability(guide, &scene->light_choice, light));
    }
    ca_emission_guide_destroy(guide);
    ca_scene_release(scene);
}

/* All points are in balls; a light without samples has none. */
static void test_balls(void **state)
{
    (void)state;
    ca_guide_sample samples[HEAPS * POINTS];
    ca_scene *scene = scene_from_text(OUTSIDE);
    ca_emission_guide *guide = make_guide(scene);
    const size_t count = make_samples(samples);
    const ca_guide_aim *aim = &guide->aims[0];
    assert_true(aim->count > HEAPS);
    for (uint32_t i = 1; i < scene->light_count; i++) assert_int_equal(guide->aims[i].count > 0, i == 2);
    double area = 0.0;
    for (uint32_t b = 1; b < aim->count; b++) area += CA_PI_D * pow((double)aim->balls[b].radius, 2.0);
    assert_true(area < 8.0); /* two squares of 1 m^2, cut into pieces */
    for (size_t i = 0; i < count; i++) {
        uint32_t inside = 0;
        for (uint32_t b = 0; b < aim->count; b++)
            inside += ca_length(ca_sub(samples[i].position, aim->balls[b].center)) <= aim->balls[b].radius;
        assert_true(samples[i].light != 0 || inside >= 2); /* the one around all, and its own */
    }
    ca_emission_guide_destroy(guide);
    ca_scene_release(scene);
}

/* Few samples tell nothing. */
static void test_few_samples(void **state)
{
    (void)state;
    ca_guide_sample samples[HEAPS * POINTS];
    ca_scene *scene = scene_from_text(OUTSIDE);
    ca_emission_guide *guide = NULL;
    make_samples(samples);
    assert_int_equal(ca_emission_guide_create(&guide, scene->lights, scene->light_count, &scene->light_choice,
                                              samples, 9, NULL),
                     CA_OK);
    assert_int_equal(guide->aims[0].count, 0);
    assert_true((double)ca_emission_probability(guide, &scene->light_choice, 3) > 0.85 * usual(scene, 3));
    ca_emission_guide_destroy(guide);
    assert_int_equal(ca_emission_guide_create(&guide, scene->lights, scene->light_count, &scene->light_choice, NULL,
                                              0, NULL),
                     CA_OK);
    for (uint32_t i = 0; i < scene->light_count; i++)
        assert_true(fabs((double)ca_emission_probability(guide, &scene->light_choice, i) - usual(scene, i)) < 1e-6);
    ca_emission_guide_destroy(guide);
    ca_scene_release(scene);
}

/* ---- A guide from the pilot ------------------------------------------------------------------------------------ */

/* A mirror 10 m aside throws the light of a zenithal sun onto the wall that the picture shows, which has none
 * otherwise; something far away makes the scene wide. */
#define ASIDE                                                                                                        \
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='40'/><transform name='to_world'>"    \
    "<lookat origin='3,1,3' target='0,1,0' up='0,1,0'/></transform>" FILM "</sensor>"                                \
    "<shape type='rectangle'><transform name='to_world'><rotate y='1' angle='90'/><translate y='1'/></transform>"    \
    "</shape><shape type='rectangle'><transform name='to_world'><rotate y='1' angle='-90'/>"                         \
    "<rotate z='1' angle='-45'/><translate x='10' y='1'/></transform><bsdf type='twosided'><bsdf type='conductor'/>" \
    "</bsdf></shape><shape type='sphere'><point name='center' value='-50,0,0'/></shape>"                             \
    "<emitter type='directional'><vector name='direction' value='0,-1,0'/><rgb name='irradiance' value='4'/>"        \
    "</emitter></scene>"

static ca_emission_guide *guide_of_pilot(const ca_scene *scene)
{
    const ca_render_settings settings = settings_of("bdpm:guide=true,radius=0.1", 1, 3);
    ca_render_plan plan;
    ca_emission_guide *guide;
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
    assert_int_equal(ca_integrator_make_guide(plan.type, &plan.input, &guide, NULL), CA_OK);
    assert_non_null(guide);
    return guide;
}

/* Rays aim at the mirror, which the light meets first, not at the wall, where it is seen. */
static void test_first_hit(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(ASIDE);
    ca_emission_guide *guide = guide_of_pilot(scene);
    const ca_vec3 down = {0.0f, -1.0f, 0.0f}, mirror = {10.0f, 1.0f, 0.0f}, wall = {0.0f, 1.0f, 0.0f};
    const ca_emission_pdf usual = {{1e-4f}, {1.0f}};
    const ca_emitted_ray to_mirror = {.origin = mirror, .direction = down};
    const ca_emitted_ray to_wall = {.origin = wall, .direction = down};
    assert_true(ca_emission_ray_pdf(guide, 0, &to_mirror, usual).position.v > 100.0f * usual.position.v);
    assert_true(ca_emission_ray_pdf(guide, 0, &to_wall, usual).position.v < usual.position.v);
    ca_emission_guide_destroy(guide);
    ca_scene_release(scene);
}

/* The same with a bulb behind the wall, of which one ray in 3,300 meets the mirror. */
#define ASIDE_OF_BULB                                                                                                \
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='40'/><transform name='to_world'>"    \
    "<lookat origin='3,1,3' target='0,1,0' up='0,1,0'/></transform>" FILM "</sensor>"                                \
    "<shape type='rectangle'><transform name='to_world'><rotate y='1' angle='90'/><translate y='1'/></transform>"    \
    "</shape><shape type='disk'><transform name='to_world'><scale value='0.37'/>"                                    \
    "<lookat origin='10,1,0' target='9.0044,1.0939,0' up='0,0,1'/></transform><bsdf type='twosided'>"                \
    "<bsdf type='conductor'/></bsdf></shape><emitter type='point'><point name='position' value='-0.5,3,0'/>"         \
    "<rgb name='intensity' value='900'/></emitter></scene>"

/* Of so little light more light paths tell. */
static void test_rare_light(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(ASIDE_OF_BULB);
    ca_emission_guide *guide = guide_of_pilot(scene);
    const ca_emission_pdf usual = {{1.0f}, {CA_INV_FOUR_PI}};
    const ca_vec3 bulb = {-0.5f, 3.0f, 0.0f}, mirror = {10.0f, 1.0f, 0.0f};
    const ca_emitted_ray to_mirror = {.origin = bulb, .direction = ca_normalize(ca_sub(mirror, bulb))};
    assert_true(ca_emission_ray_pdf(guide, 0, &to_mirror, usual).direction.v > 100.0f * usual.direction.v);
    ca_emission_guide_destroy(guide);
    ca_scene_release(scene);
}

/* What the picture does not show is no light of it. */
static void test_hidden_lamp(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(OUTSIDE);
    for (int hidden = 0; hidden < 2; hidden++) {
        const ca_render_settings settings = settings_of(hidden ? "bdpm:hide_emitters=true" : "bdpm", 1, 3);
        ca_render_plan plan;
        assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
        ca_integrator_input input = plan.input;
        memset(input.values, 0, sizeof input.values);
        const ca_integrator_type *pilot = &ca_integrator_pilot;
        assert_int_equal(ca_integrator_limit_pilot(pilot, plan.type, &plan.input, &input, NULL), CA_OK);
        assert_true(ca_integrator_value(pilot, &input, "hide_emitters", -1.0) == hidden);
    }
    ca_scene_release(scene);
}

/* ---- Rays ------------------------------------------------------------------------------------------------------ */

enum { RAYS = 1 << 18, CELLS = 24 };

/* Where the ray meets the plane y = 0, in cells of a square of 24 m; CELLS^2: elsewhere. */
static uint32_t cell_of(const ca_light_emission *ray)
{
    const float t = -ray->origin.y / ray->direction.y;
    const float x = ray->origin.x + t * ray->direction.x + 12.0f, z = ray->origin.z + t * ray->direction.z + 12.0f;
    if (!(x >= 0.0f && z >= 0.0f && x < (float)CELLS && z < (float)CELLS)) return CELLS * CELLS;
    return (uint32_t)z * CELLS + (uint32_t)x;
}

/* Per area across the ray, the mean over the cell. */
static double expected_density(const ca_emission_guide *guide, uint32_t cell, ca_vec3 direction, double disk)
{
    enum { STEPS = 40 };
    double sum = 0.0;
    for (uint32_t i = 0; i < STEPS * STEPS; i++) {
        const ca_vec3 point = {(float)(cell % CELLS) - 12.0f + ((float)(i % STEPS) + 0.5f) / STEPS, 0.0f,
                               (float)(cell / CELLS) - 12.0f + ((float)(i / STEPS) + 0.5f) / STEPS};
        const ca_emitted_ray ray = {.origin = point, .direction = direction};
        const ca_emission_pdf usual = {{(float)disk}, {1.0f}};
        sum += (double)ca_emission_ray_pdf(guide, 0, &ray, usual).position.v;
    }
    return sum / (STEPS * STEPS);
}

/* Rays arrive as often as their density says, in every square metre of the plane. */
static void test_rays(void **state)
{
    (void)state;
    static uint32_t arrived[CELLS * CELLS + 1];
    ca_scene *scene = scene_from_text(OUTSIDE);
    ca_emission_guide *guide = make_guide(scene);
    const ca_light *sun = &scene->lights[0];
    assert_int_equal(sun->kind, CA_LIGHT_DIRECTIONAL);
    const ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT, .seed = 3};
    ca_light_emission ray;
    memset(arrived, 0, sizeof arrived);
    for (uint32_t i = 0; i < RAYS; i++) {
        const ca_stream stream = ca_stream_start(&sampler, 0, i);
        const ca_vec2 u = ca_sample_2d(&stream, 0), middle = {0.5f, 0.5f};
        assert_true(ca_emission_sample(guide, scene->lights, 0, u, middle, &ray));
        const float depth = ca_dot(ca_sub(ray.origin, sun->scene_center), ray.direction);
        assert_true(fabsf(depth + sun->scene_radius) < 1e-4f * sun->scene_radius);
        arrived[cell_of(&ray)]++;
    }
    const double disk = 1.0 / (CA_PI_D * pow((double)sun->scene_radius, 2.0));
    const double cos_plane = fabs((double)ray.direction.y);
    double chi = 0.0;
    for (uint32_t c = 0; c < CELLS * CELLS; c++) {
        const double expected = RAYS * cos_plane * expected_density(guide, c, ray.direction, disk);
        chi += pow(arrived[c] - expected, 2.0) / expected;
    }
    const double cells = CELLS * CELLS;
    print_message("chi^2 of %.0f cells: %.1f\n", cells, chi);
    assert_true(chi < cells + 5.0 * sqrt(2.0 * cells));
    assert_true(arrived[12 * CELLS + 12] < arrived[14 * CELLS + 20] / 20); /* the bulb's heap, the sun's first one */
    ca_emission_guide_destroy(guide);
    ca_scene_release(scene);
}

/* ---- Rays that are aimed --------------------------------------------------------------------------------------- */

#define SPOT                                                                                                         \
    "<emitter type='spot'><transform name='to_world'><lookat origin='1,2,0' target='1.3,0,0.5' up='1,0,0'/>"         \
    "</transform><rgb name='intensity' value='3'/><float name='cutoff_angle' value='40'/>"                           \
    "<float name='beam_width' value='20'/></emitter>"
#define LAMP                                                                                                         \
    "<shape type='rectangle'><transform name='to_world'><scale value='0.2'/><rotate x='1' angle='90'/>"              \
    "<translate x='-0.5' y='2.5'/></transform><emitter type='area'><rgb name='radiance' value='9'/></emitter>"       \
    "</shape>"
#define GLOBE                                                                                                        \
    "<shape type='sphere'><point name='center' value='0.5,1.8,-0.5'/><float name='radius' value='0.1'/>"             \
    "<emitter type='area'><rgb name='radiance' value='9'/></emitter></shape>"
#define LAMPS "<scene version='3.0.0'>" CAMERA PLAIN("6") BULB("0,2,0") SPOT LAMP GLOBE "</scene>"

enum { AIMED_RAYS = 1 << 17, LATITUDES = 20, LONGITUDES = 40, DIRECTIONS = LATITUDES * LONGITUDES };

/* Light of every lamp meets two squares on the floor, one at the lamps and one above them. */
static ca_emission_guide *aim_lamps(const ca_scene *scene)
{
    static const ca_vec3 squares[] = {
        {2.0f, 0.0f, 1.0f}, {-3.0f, 0.0f, -2.0f}, {0.0f, 2.0f, 0.0f}, {0.0f, 4.0f, 0.0f}};
    static ca_guide_sample samples[4 * 4 * 100];
    const ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT, .seed = 8};
    ca_emission_guide *guide = NULL;
    size_t count = 0;
    for (uint32_t i = 0; i < 4 * 4 * 100; i++) {
        const ca_stream stream = ca_stream_start(&sampler, 0, i);
        const ca_vec2 u = ca_sample_2d(&stream, 0);
        const ca_vec3 offset = {u.x - 0.5f, 0.0f, u.y - 0.5f};
        samples[count++] = (ca_guide_sample){
            .position = ca_add(squares[i / 4 % 4], offset), .light = i % 4, .weight = i / 4 % 4 == 0 ? 3.0f : 1.0f};
    }
    assert_int_equal(ca_emission_guide_create(&guide, scene->lights, scene->light_count, &scene->light_choice,
                                              samples, count, NULL),
                     CA_OK);
    for (uint32_t i = 0; i < 4; i++) assert_true(guide->aims[i].count > 8);
    return guide;
}

static uint32_t direction_cell(ca_vec3 d)
{
    const double turn = atan2((double)d.y, (double)d.x) / (2.0 * CA_PI_D) + 0.5;
    const uint32_t row = (uint32_t)fmin(0.5 * ((double)d.z + 1.0) * LATITUDES, LATITUDES - 1);
    return row * LONGITUDES + (uint32_t)fmin(turn * LONGITUDES, LONGITUDES - 1);
}

static ca_vec3 direction_in(uint32_t cell, double u, double v)
{
    const double z = 2.0 * (cell / LONGITUDES + u) / LATITUDES - 1.0;
    const double angle = 2.0 * CA_PI_D * ((cell % LONGITUDES + v) / LONGITUDES - 0.5), r = sqrt(1.0 - z * z);
    return (ca_vec3){(float)(r * cos(angle)), (float)(r * sin(angle)), (float)z};
}

/* The share of the light's rays from the origin of `start` that go into the cell. */
static double expected_share(const ca_emission_guide *guide, uint32_t light, const ca_light_emission *start,
                             uint32_t cell)
{
    enum { STEPS = 24 };
    double sum = 0.0;
    for (uint32_t i = 0; i < STEPS * STEPS; i++) {
        const ca_vec3 direction = direction_in(cell, (i % STEPS + 0.5) / STEPS, (double)(i / STEPS + 0.5) / STEPS);
        ca_light_emission towards = *start;
        if (!ca_light_emission_towards(&guide->lights[light], direction, &towards)) continue;
        const ca_emitted_ray ray = {start->origin, start->ng, direction};
        sum += (double)ca_emission_ray_pdf(guide, light, &ray,
                                           (ca_emission_pdf){towards.pdf_position, towards.pdf_direction})
                   .direction.v;
    }
    return sum / (STEPS * STEPS) * 4.0 * CA_PI_D / DIRECTIONS;
}

/* How far the rays' directions from one point of the light are from their density: chi^2 of the cells. */
static double chi_of_light(const ca_emission_guide *guide, uint32_t light, uint32_t *cells)
{
    static uint32_t arrived[DIRECTIONS];
    const ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT, .seed = 4};
    const ca_vec2 place = {0.3f, 0.6f};
    ca_light_emission start = {.cos_light = 0.0f};
    double chi = 0.0;
    memset(arrived, 0, sizeof arrived);
    *cells = 0;
    ca_light_start_emission(&guide->lights[light], place, &start);
    for (uint32_t i = 0; i < AIMED_RAYS; i++) {
        const ca_stream stream = ca_stream_start(&sampler, light, i);
        ca_light_emission ray;
        if (!ca_emission_sample(guide, guide->lights, light, place, ca_sample_2d(&stream, 0), &ray)) continue;
        assert_memory_equal(&ray.origin, &start.origin, sizeof ray.origin);
        assert_true(ray.pdf_direction.v > 0.0f && ray.cos_light > 0.0f);
        arrived[direction_cell(ray.direction)]++;
    }
    for (uint32_t c = 0; c < DIRECTIONS; c++) {
        const double expected = AIMED_RAYS * expected_share(guide, light, &start, c);
        if (expected < 5.0) continue;
        chi += pow(arrived[c] - expected, 2.0) / expected;
        ++*cells;
    }
    return chi;
}

/* Directions come as often as their density says: of a bulb and a lamp within one ball, of a spot, half of whose aims
 * lie outside of its cone, of lamps with balls behind their surface. */
static void test_aimed_rays(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(LAMPS);
    ca_emission_guide *guide = aim_lamps(scene);
    for (uint32_t light = 0; light < 4; light++) {
        uint32_t cells;
        const double chi = chi_of_light(guide, light, &cells);
        print_message("light %u: chi^2 of %u cells: %.1f\n", light, cells, chi);
        assert_true(cells > 60);
        assert_true(chi < cells + 6.0 * sqrt(2.0 * cells));
    }
    ca_emission_guide_destroy(guide);
    ca_scene_release(scene);
}

/* Of one bulb a thousand kilometres away: the solid angle of 20 m around the middle, by the directions that it aims
 * at the picture. A ray that misses its ball by rounding would count far too much. */
static void test_far_light(void **state)
{
    (void)state;
    ca_guide_sample samples[HEAPS * POINTS];
    ca_scene *scene = scene_from_text("<scene version='3.0.0'>" CAMERA PLAIN("6") BULB("6e5,8e5,0") "</scene>");
    const ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT, .seed = 6};
    const ca_vec2 place = {0.5f, 0.5f};
    ca_emission_guide *guide = NULL;
    const size_t count = make_samples(samples);
    for (size_t i = 0; i < count; i++) samples[i].light = 0;
    assert_int_equal(ca_emission_guide_create(&guide, scene->lights, scene->light_count, &scene->light_choice,
                                              samples, count, NULL),
                     CA_OK);
    assert_true(guide->aims[0].count > 0);
    double sum = 0.0;
    for (uint32_t i = 0; i < RAYS; i++) {
        const ca_stream stream = ca_stream_start(&sampler, 0, i);
        ca_light_emission ray;
        if (!ca_emission_sample(guide, scene->lights, 0, place, ca_sample_2d(&stream, 0), &ray)) continue;
        const double o[3] = {(double)ray.origin.x, (double)ray.origin.y, (double)ray.origin.z};
        const double d[3] = {(double)ray.direction.x, (double)ray.direction.y, (double)ray.direction.z};
        const double along = -(o[0] * d[0] + o[1] * d[1] + o[2] * d[2]);
        const double x = o[0] + along * d[0], y = o[1] + along * d[1], z = o[2] + along * d[2];
        if (along > 0.0 && x * x + y * y + z * z < 400.0) sum += 1.0 / (double)ray.pdf_direction.v;
    }
    const double angle = CA_PI_D * 400.0 / 1e12;
    print_message("solid angle %.4g of %.4g\n", sum / RAYS, angle);
    assert_true(fabs(sum / RAYS / angle - 1.0) < 0.08);
    ca_emission_guide_destroy(guide);
    ca_scene_release(scene);
}

/* A photon that is met often is one place, and says nothing of where others are. */
static void test_one_photon(void **state)
{
    (void)state;
    ca_guide_sample samples[POINTS];
    ca_scene *scene = scene_from_text(OUTSIDE);
    ca_emission_guide *guide = NULL;
    for (uint32_t i = 0; i < POINTS; i++)
        samples[i] = (ca_guide_sample){.position = heaps[i % HEAPS], .light = 0, .weight = 1.0f};
    assert_int_equal(ca_emission_guide_create(&guide, scene->lights, scene->light_count, &scene->light_choice,
                                              samples, POINTS, NULL),
                     CA_OK);
    assert_int_equal(guide->aims[0].count, 0);
    ca_emission_guide_destroy(guide);
    ca_scene_release(scene);
}

/* ---- Renders --------------------------------------------------------------------------------------------------- */

static const char *const methods[] = {"light", "bdpt", "ppm", "bdpm", "vcm", "ovcm", "vavcm"};
enum { METHODS = sizeof methods / sizeof methods[0] };

static void name_method(const char *method, bool guided, char *text, size_t size)
{
    const bool merges = strstr(method, "pm") || strstr(method, "vcm");
    snprintf(text, size, "%s:guide=%s,max_depth=6%s", method, guided ? "true" : "false", merges ? ",radius=0.1" : "");
}

typedef struct mean {
    double value, error;
} mean;

/* Of the picture. */
static mean mean_of(const ca_scene *scene, const char *method, bool guided, uint32_t samples)
{
    char name[128];
    mean m;
    name_method(method, guided, name, sizeof name);
    ca_render_settings settings = settings_of(name, samples, 5 + guided);
    if (strcmp(method, "light") != 0) settings.light_paths = 4000;
    ca_image_layers *image = render_scene(scene, &settings);
    channel_mean(image, "G", &m.value, &m.error);
    ca_image_release(image);
    return m;
}

/* The guide changes no mean. The errors of pixels depend on each other through light paths: twice as much is allowed
 * for. */
static void test_mean(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(
        "<scene version='3.0.0'>" CAMERA PLAIN("6") WALL GLASS SUN SKY BULB("0.5,2,1") BULB("5,1,0") SPOT LAMP GLOBE
        "</scene>");
    for (int i = 0; i < METHODS; i++) {
        const uint32_t samples = strcmp(methods[i], "light") == 0 ? 4000 : 80;
        const mean plain = mean_of(scene, methods[i], false, samples);
        const mean guided = mean_of(scene, methods[i], true, samples);
        const double error = 2.0 * hypot(plain.error, guided.error);
        print_message("%-6s %.5f +- %.5f, guided %.5f +- %.5f\n", methods[i], plain.value, plain.error, guided.value,
                      guided.error);
        assert_true(fabs(plain.value - guided.value) < 4.0 * error);
        assert_true(error < 0.05 * plain.value);
    }
    ca_scene_release(scene);
}

/* The mean over pixels of an iteration's variance. */
static double variance_of(const ca_scene *scene, const char *method, bool guided)
{
    char name[128];
    uint32_t width, height;
    double sum = 0.0;
    name_method(method, guided, name, sizeof name);
    const ca_render_settings settings = settings_of(name, 32, 9);
    ca_image_layers *image = render_scene(scene, &settings);
    const float *deviation = ca_image_channel(image, "StandardDeviation.Y");
    ca_image_size(image, &width, &height);
    for (size_t p = 0; p < (size_t)width * height; p++) sum += pow((double)deviation[p], 2.0);
    ca_image_release(image);
    return sum / ((double)width * height);
}

/* One bulb 10 m above a plain of 40 m, of which the picture shows three. */
#define HIGH                                                                                                         \
    "<scene version='3.0.0'>" CAMERA PLAIN("20") WALL GLASS "<emitter type='point'><point name='position' "          \
    "value='1,10,2'/><rgb name='intensity' value='300'/></emitter></scene>"

/* A hundredth of the usual light paths arrives near what the picture shows. */
static void test_variance(void **state)
{
    (void)state;
    static const char *const of_merges[] = {"bdpm", "ppm"}, *const scenes[] = {OUTSIDE, HIGH};
    for (int i = 0; i < 4; i++) {
        ca_scene *scene = scene_from_text(scenes[i / 2]);
        const char *method = of_merges[i % 2];
        const double plain = variance_of(scene, method, false), guided = variance_of(scene, method, true);
        print_message("%s: variance %.4g, guided %.4g\n", method, plain, guided);
        assert_true(guided < 0.25 * plain);
        ca_scene_release(scene);
    }
}

/* The same bits with any threads; others than without a guide. */
static void test_bits(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(OUTSIDE);
    for (int i = 0; i < METHODS; i++) {
        char name[128];
        name_method(methods[i], true, name, sizeof name);
        ca_render_settings settings = settings_of(name, 2, 7);
        settings.light_paths = strcmp(methods[i], "light") == 0 ? 0 : 500;
        const uint64_t hash = rendered_hash(scene, &settings);
        settings.threads = 3;
        assert_true(rendered_hash(scene, &settings) == hash);
        name_method(methods[i], false, name, sizeof name);
        settings.integrator = name;
        assert_true(rendered_hash(scene, &settings) != hash);
    }
    ca_scene_release(scene);
}

/* One projector leaves nothing to guide: the same bits with the parameter and without it. */
static void test_nothing_to_guide(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(
        "<scene version='3.0.0'>" CAMERA PLAIN("6") WALL "<emitter type='projector'><transform name='to_world'>"
        "<lookat origin='0,3,2' target='0,0,0' up='0,1,0'/></transform><float name='scale' value='9'/></emitter>"
        "</scene>");
    ca_render_settings settings = settings_of("ovcm:radius=0.1", 2, 7);
    const uint64_t hash = rendered_hash(scene, &settings);
    settings.integrator = "ovcm:radius=0.1,guide=true";
    assert_true(rendered_hash(scene, &settings) == hash);
    assert_false(ca_emission_can_be_guided(scene->lights, scene->light_count));
    ca_scene_release(scene);
}

/* Whichever allocation fails: an error, and nothing is left over. */
static void test_out_of_memory(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(OUTSIDE);
    ca_render_settings settings = settings_of("bdpm:radius=0.1,guide=true,max_depth=3", 1, 1);
    assert_true(render_without_memory(scene, &settings) > 60);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_choice),
        cmocka_unit_test(test_balls),
        cmocka_unit_test(test_few_samples),
        cmocka_unit_test(test_first_hit),
        cmocka_unit_test(test_rare_light),
        cmocka_unit_test(test_rays),
        cmocka_unit_test(test_aimed_rays),
        cmocka_unit_test(test_far_light),
        cmocka_unit_test(test_one_photon),
        cmocka_unit_test(test_hidden_lamp),
        cmocka_unit_test(test_mean),
        cmocka_unit_test(test_variance),
        cmocka_unit_test(test_bits),
        cmocka_unit_test(test_nothing_to_guide),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
