/* What tests of renders that are kept in files share: the small scene's (small_render.h) with a checkpoint. */
#ifndef CA_TEST_KEPT_RENDER_H
#define CA_TEST_KEPT_RENDER_H

#include "support/small_render.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static inline bool is_there(const char *name) { return access(file(name), F_OK) == 0; }

/* Keeps c.part, and goes on from it. */
static inline ca_render_settings kept(const char *integrator, uint32_t samples, uint32_t threads)
{
    ca_render_settings s = settings_of(integrator, samples, threads);
    s.checkpoint_path = file("c.part");
    s.resume = true;
    return s;
}

/* Pilots trace their light paths again where a render goes on or is made in parts. */
static inline void expect_same_totals(const ca_render_statistics *a, const ca_render_statistics *b)
{
    assert_true(a->iterations == b->iterations && a->samples_per_pixel == b->samples_per_pixel);
    assert_true(a->camera_paths == b->camera_paths && a->light_paths <= b->light_paths);
    assert_true(a->noise_percent == b->noise_percent || isnan(a->noise_percent));
}

static inline void refuse_on(const ca_scene *of, const ca_render_settings *settings, ca_status expected,
                             const char *words)
{
    ca_image_layers *image;
    ca_error error = {""};
    const ca_status status = ca_render(of, settings, &image, NULL, &error);
    if (status != expected) fail_msg("%s: status %d: %s", words, (int)status, error.message);
    assert_null(image);
    if (!strstr(error.message, words)) fail_msg("\"%s\" is not said in \"%s\"", words, error.message);
    assert_false(is_there("c.part.lock"));
}

/* Ends a render after so many passes: its progress callback. */
typedef struct ending {
    uint32_t at;
} ending;

static inline bool end_at(const ca_render_progress *progress, void *user)
{
    return progress->passes_done < ((const ending *)user)->at;
}

#endif
