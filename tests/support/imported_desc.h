/* What is asked of an imported description: `desc`, which the test has, and fails where it is another. */
#ifndef CA_TESTS_IMPORTED_DESC_H
#define CA_TESTS_IMPORTED_DESC_H

#include "support/import_text.h"

#include <math.h>
#include <string.h>

static ca_scene_desc desc;

static inline void import(const char *text) { import_text(&desc, text, NULL, 0); }

/* A constant spectrum of 1 as emission. */
static const double equal_energy[3] = {1.2050668, 0.948216736, 0.908972979};

static inline void done(void) { ca_scene_desc_destroy(&desc); }

static inline void near(double actual, double expected)
{
    if (!(fabs(actual - expected) <= 1e-6 * fmax(1.0, fabs(expected))))
        fail_msg("%.9g, expected %.9g", actual, expected);
}

static inline ca_rgb constant(ca_texture_id id)
{
    assert_true(id < desc.textures.count);
    assert_int_equal(desc.textures.items[id].kind, CA_TEXTURE_CONSTANT);
    return desc.textures.items[id].as.constant;
}

static inline void is_rgb(ca_rgb c, double r, double g, double b)
{
    near((double)c.r, r);
    near((double)c.g, g);
    near((double)c.b, b);
}

static inline void is_grey(ca_texture_id id, double value) { is_rgb(constant(id), value, value, value); }

/* The note without its place; the scene has no other. */
static inline void is_noted(const char *sentence)
{
    assert_int_equal(desc.notes.count, 1);
    const char *found = strstr(desc.notes.items[0], sentence);
    if (!found || strcmp(found, sentence) != 0) fail_msg("the note is \"%s\"", desc.notes.items[0]);
}

#endif
