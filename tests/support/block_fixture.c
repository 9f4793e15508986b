#define _POSIX_C_SOURCE 200809L
#include "support/block_fixture.h"

#include "base/memory.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char *const block_scene =
    "<scene version='3.0.0'><sensor type='perspective'><sampler type='independent'>"
    "<integer name='sample_count' value='3'/></sampler><film type='hdrfilm'><integer name='width' value='48'/>"
    "<integer name='height' value='32'/><rfilter type='box'/></film></sensor>"
    "<shape type='sphere'><point name='center' x='5' y='0' z='-7'/></shape>"
    "<emitter type='constant'><rgb name='radiance' value='1'/></emitter></scene>";

static char folder[] = "/tmp/caustica-blocks-XXXXXX";
ca_block_script ca_block_play;

const char *ca_block_file(const char *name)
{
    static char paths[4][CA_BLOCK_PATH_SIZE];
    static int next;
    next = (next + 1) % 4;
    snprintf(paths[next], sizeof paths[next], "%s/%s", folder, name);
    return paths[next];
}

int ca_block_make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

int ca_block_remove_folder(void **state)
{
    (void)state;
    char command[64];
    snprintf(command, sizeof command, "rm -r '%s'", folder);
    return system(command);
}

/* ---- The integrator -------------------------------------------------------------------------------------------- */

static ca_status fake_create(const ca_integrator_input *input, void **state, ca_error *error)
{
    (void)error;
    assert_int_equal(input->crop[0], CA_BLOCK_CROP_X);
    *state = &ca_block_play;
    return CA_OK;
}

static void fake_destroy(void *state) { assert_ptr_equal(state, &ca_block_play); }

static ca_status fake_begin_block(void *state, uint64_t block, const ca_parallel *parallel, ca_worker *workers,
                                  ca_error *error)
{
    ca_block_script *s = state;
    assert_true(block == s->first + s->begun);
    assert_int_equal(atomic_exchange(&s->pixels, 0),
                     s->begun ? CA_BLOCK_PIXELS : 0); /* the block before is finished */
    if (s->fail_at && block == s->fail_at) return ca_fail(error, CA_ERROR_MEMORY, NULL, "no room for the block");
    s->begun++;
    s->now = block;
    for (uint32_t i = 0; i < parallel->workers; i++) workers[i].counters.light_paths += i == 0 ? block + 1 : 0;
    workers[0].counters.photons += 2;
    workers[0].counters.photons_tested += 3;
    workers[0].counters.merges += 5;
    workers[0].counters.rays += 7;
    workers[0].counters.shadow_rays += 11;
    workers[0].counters.non_finite[CA_TECHNIQUE_MERGE] += 13;
    return CA_OK;
}

float ca_block_radiance(uint32_t x, uint32_t y, uint64_t block)
{
    const int exponent = (int)((x * 7 + y * 13 + block * 29) % 90) - 45;
    return ldexpf((float)(1 + (x * y + block * block) % 101) / 3.0f, exponent) * (block % 5 == 3 ? -0.25f : 1.0f);
}

uint64_t ca_block_pairs(uint32_t x, uint64_t block) { return 10 + (x + block) % 3; }

static void fill_pixel(const void *state, uint32_t x, uint32_t y, ca_block_sample *sample, ca_worker *worker)
{
    const ca_block_script *s = state;
    const bool inside = x >= CA_BLOCK_CROP_X && y >= CA_BLOCK_CROP_Y && x < CA_BLOCK_CROP_X + CA_BLOCK_WIDTH &&
                        y < CA_BLOCK_CROP_Y + CA_BLOCK_HEIGHT;
    if (!inside || sample->pairs || sample->radiance.r != 0.0f) atomic_fetch_add(&ca_block_play.wrong_calls, 1);
    atomic_fetch_add(&ca_block_play.pixels, 1);
    sample->radiance = (ca_rgb){ca_block_radiance(x, y, s->now), 2.0f * ca_block_radiance(y, x, s->now), 0.5f};
    sample->pairs = ca_block_pairs(x, s->now);
    sample->paths = 1 + (uint32_t)(s->now % 2);
    sample->irradiance_gradient = (ca_vec3){ca_block_radiance(x + 1, y, s->now), 0.0f, 1.0f};
    sample->albedo = ca_rgb_grey(0.25f * (float)sample->paths);
    sample->position = (ca_vec3){(float)x / 10.0f, -7.0f, 0.0f};
    worker->counters.camera_paths += sample->paths;
    if (s->bad_samples && x == 5 && y == 4 && s->now % 2 == 1) sample->radiance.g = NAN;
}

static void fake_block_pixels(const void *state, uint32_t x, uint32_t y, uint32_t count, ca_block_sample *samples,
                              ca_worker *worker)
{
    for (uint32_t i = 0; i < count; i++) fill_pixel(state, x + i, y, &samples[i], worker);
}

/* Squares of n x n blocks grow by one shell of 2 n + 1 at a time, its own row before its column. */
static uint64_t row_of(uint64_t block)
{
    uint64_t shell = 0;
    while ((shell + 1) * (shell + 1) <= block) shell++;
    const uint64_t place = block - shell * shell;
    return place <= shell ? shell : 2 * shell - place;
}

/* So many samples need a square of as many blocks. What has to be learnt is how long a row is, by visiting it. */
static uint64_t fake_blocks_needed(const void *state, uint32_t samples)
{
    const ca_block_script *s = state;
    if (s->begun < s->known_from) return UINT64_MAX;
    uint64_t rows = 0;
    for (uint64_t block = s->first; s->learns && block < s->first + s->begun; block++)
        rows = row_of(block) >= rows ? row_of(block) + 1 : rows;
    if (s->learns && samples > rows) return UINT64_MAX;
    const uint64_t square = (uint64_t)samples * samples;
    return s->all && square > s->all ? s->all : square;
}

static const ca_parameter_spec no_parameters[] = {{.name = NULL}};
static const ca_integrator_type fake = {.name = "fake",
                                        .parameters = no_parameters,
                                        .create = fake_create,
                                        .destroy = fake_destroy,
                                        .begin_block = fake_begin_block,
                                        .block_pixels = fake_block_pixels,
                                        .blocks_needed = fake_blocks_needed};

/* ---- Renders --------------------------------------------------------------------------------------------------- */

ca_status ca_block_run(const ca_block_job *j, ca_image_layers **image, ca_render_statistics *statistics,
                       ca_error *error)
{
    ca_scene *scene = scene_from_text(j->scene ? j->scene : block_scene);
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.threads = j->threads;
    settings.seconds = j->seconds;
    settings.has_seed = true;
    settings.seed = j->seed;
    settings.has_crop = true;
    const uint32_t crop[4] = {CA_BLOCK_CROP_X, CA_BLOCK_CROP_Y, CA_BLOCK_CROP_X + CA_BLOCK_WIDTH,
                              CA_BLOCK_CROP_Y + CA_BLOCK_HEIGHT};
    memcpy(settings.crop, crop, sizeof crop);
    settings.progress = j->progress;
    settings.progress_user = j->progress_user;
    ca_render_plan plan;
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, error), CA_OK);
    settings.part_path = j->part;
    plan.type = &fake;
    plan.block_film.gradients = j->gradients;
    plan.block_samples = j->samples;
    plan.open_ended = j->seconds > 0.0;
    plan.blocks[0] = j->blocks[0];
    plan.blocks[1] = j->blocks[1] ? j->blocks[1] : UINT64_MAX;
    ca_block_play.first = j->blocks[0];
    ca_memory_fail_after(j->fail_allocation - 1);
    const ca_status status = ca_render_plan_run(&plan, image, statistics, error);
    ca_memory_fail_after(-1);
    assert_int_equal(atomic_load(&ca_block_play.wrong_calls), 0);
    ca_scene_release(scene);
    return status;
}

ca_image_layers *ca_block_rendered(const ca_block_job *j, ca_render_statistics *statistics)
{
    ca_image_layers *image;
    ca_error error = {""};
    if (ca_block_run(j, &image, statistics, &error) != CA_OK) fail_msg("%s", error.message);
    return image;
}

const char *ca_block_render_part(const char *name, uint64_t begin, uint64_t end, ca_block_job j)
{
    ca_block_play = (ca_block_script){.bad_samples = ca_block_play.bad_samples, .learns = ca_block_play.learns};
    const char *path = ca_block_file(name);
    j.blocks[0] = begin;
    j.blocks[1] = end;
    j.part = path;
    ca_image_release(ca_block_rendered(&j, NULL));
    return path;
}

const ca_attribute *ca_block_attribute(const ca_image_layers *image, const char *name)
{
    const ca_attribute *attribute = ca_layers_attribute(image, name);
    if (!attribute) fail_msg("there is no attribute %s", name);
    return attribute;
}

bool ca_block_watch(const ca_render_progress *progress, void *user)
{
    ca_block_watcher *w = user;
    assert_true(progress->blocks && progress->noise_percent < 0.0);
    assert_int_equal(progress->passes_done, ++w->calls);
    w->last_done = progress->passes_done;
    w->last_total = progress->passes_total;
    return !w->stop_after || progress->passes_done < w->stop_after;
}
