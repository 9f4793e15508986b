/* Parts of renders by passes, of every integrator: the bits of one render; parts that do not fit together. */
#define _POSIX_C_SOURCE 200809L
#include "film/pass_part.h"
#include "integrator/integrator.h"
#include "support/kept_render.h"
#include "support/scene_text.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const char *render_part(const char *integrator, uint64_t begin, uint64_t end, uint32_t threads,
                               const char *name)
{
    ca_render_settings s = settings_of(integrator, 0, threads);
    s.has_passes = true;
    s.passes[0] = begin;
    s.passes[1] = end;
    s.part_path = file(name);
    render(&s, NULL);
    return file(name);
}

static uint64_t merge(const char *const *paths, size_t count, const char *part, ca_render_statistics *statistics)
{
    ca_image_layers *image;
    ca_error error = {""};
    if (ca_merge_parts(paths, count, part, &image, statistics, &error) != CA_OK) fail_msg("%s", error.message);
    const uint64_t hash = image_hash(image);
    ca_image_release(image);
    return hash;
}

/* In any order, with any threads, in one step or in two that leave a gap. */
static void test_parts_of_every_integrator(void **state)
{
    (void)state;
    for (size_t i = 0; integrator_at(i); i++) {
        const char *name = integrator_at(i), *part[3];
        if (chooses(i) || ca_integrator_at(i)->begin_block) continue;
        ca_render_statistics one = {.size = sizeof one}, merged = {.size = sizeof merged};
        const ca_render_settings all = settings_of(name, 5, 2);
        const uint64_t hash = render(&all, &one);
        part[0] = render_part(name, 0, 2, 1, "0.part");
        part[1] = render_part(name, 2, 3, 3, "1.part");
        part[2] = render_part(name, 3, 5, 2, "2.part");
        static const int orders[3][3] = {{0, 1, 2}, {2, 1, 0}, {1, 2, 0}};
        for (int o = 0; o < 3; o++) {
            const char *paths[3] = {part[orders[o][0]], part[orders[o][1]], part[orders[o][2]]};
            if (merge(paths, 3, NULL, &merged) != hash) fail_msg("%s: another image", name);
            expect_same_totals(&one, &merged);
        }
        const char *const outer[2] = {part[2], part[0]}, *const both = file("both.part");
        assert_int_equal(ca_merge_parts(outer, 2, both, NULL, NULL, NULL), CA_OK);
        const char *const all_parts[2] = {both, part[1]};
        assert_true(merge(all_parts, 2, file("all.part"), &merged) == hash);
        assert_true(merged.passes[0] == 0 && merged.passes[1] == 5);
    }
}

static void expect_no_merge(const char *a, const char *b, bool wants_image, const char *words)
{
    const char *const paths[2] = {a, b};
    ca_image_layers *image = NULL;
    ca_error error = {""};
    const char *out = file("out.part");
    assert_int_equal(ca_merge_parts(paths, 2, out, wants_image ? &image : NULL, NULL, &error), CA_ERROR_ARGUMENT);
    assert_null(image);
    assert_false(is_there("out.part"));
    if (!strstr(error.message, words)) fail_msg("\"%s\" is not said in \"%s\"", words, error.message);
}

/* A file that is changed and written again, to changed.part. */
typedef struct open_part {
    ca_pass_reader reader;
    ca_film film;
} open_part;

static void read_part(open_part *p, const char *name)
{
    ca_error error = {""};
    assert_int_equal(ca_pass_reader_open(&p->reader, file(name), &error), CA_OK);
    assert_int_equal(ca_pass_film_create(&p->film, &p->reader.film, &error), CA_OK);
    assert_int_equal(ca_pass_reader_add(&p->reader, &p->film, true, &error), CA_OK);
}

static void write_changed(open_part *p, const ca_pass_part *changed)
{
    assert_int_equal(ca_pass_part_write(changed, &p->film, file("changed.part"), NULL), CA_OK);
    ca_film_destroy(&p->film);
    ca_pass_reader_close(&p->reader);
}

/* Its settings say something else, as those of another version would. */
static void change_setting(const char *name, const char *from, const char *to)
{
    open_part p;
    char settings[4096];
    read_part(&p, name);
    ca_pass_part part = p.reader.part;
    const char *at = strstr(part.settings, from);
    assert_non_null(at);
    snprintf(settings, sizeof settings, "%.*s%s%s", (int)(at - part.settings), part.settings, to, at + strlen(from));
    part.settings = settings;
    write_changed(&p, &part);
}

/* The setting is named, and the file; and nothing is written. */
static void test_settings_of_another_version(void **state)
{
    (void)state;
    static const char *const changes[][3] = {
        {"integrator path\n", "integrator pathos\n", "integrator"},
        {"integrator path\n", "integrator auto\n", "integrator"},
        {"\nrr_depth 3\n", "\nrr_depht 3\n", "rr_depth"},
        {"\nrr_depth 3\n", "\nrr_depth 2.5\n", "rr_depth"},
        {"\nsamples_per_pass 1\n", "\nsamples_per_pass one\n", "samples_per_pass"},
        {"\nsamples_per_pass 1\n", "\nsamples_per_pass 0\n", "samples_per_pass"},
        {"\nsamples_per_pass 1\n", "\n", "samples_per_pass"},
    };
    const char *const path = file("changed.part");
    unlink(file("sum.part"));
    render_part("path", 0, 2, 1, "whole.part");
    for (size_t i = 0; i < sizeof changes / sizeof changes[0]; i++) {
        ca_error error = {""};
        char words[128];
        change_setting("whole.part", changes[i][0], changes[i][1]);
        assert_int_equal(ca_merge_parts(&path, 1, file("sum.part"), NULL, NULL, &error), CA_ERROR_FORMAT);
        snprintf(words, sizeof words, "changed.part: what it tells of the setting \"%s\" makes no sense",
                 changes[i][2]);
        if (!strstr(error.message, words)) fail_msg("\"%s\" is not said in \"%s\"", words, error.message);
        assert_non_null(strstr(error.message, ca_version()));
        assert_false(is_there("sum.part"));
    }
}

static void test_parts_that_do_not_fit(void **state)
{
    (void)state;
    const char *const a = render_part("path", 0, 2, 1, "a.part");
    const char *const b = render_part("path", 1, 3, 1, "b.part");
    expect_no_merge(a, b, false, "a.part with the passes 0:2 and");
    expect_no_merge(a, a, false, "overlap");
    expect_no_merge(a, render_part("path", 4, 5, 1, "d.part"), true, "the passes 2:4 between");
    expect_no_merge(b, render_part("path", 3, 4, 1, "d.part"), true, "begins at pass 1");
    expect_no_merge(a, render_part("bdpt", 2, 3, 1, "c.part"), false, "differ in their integrator");
    expect_no_merge(a, render_part("path:rr_depth=9", 2, 3, 1, "c.part"), false,
                    "differ in their rr_depth: \"rr_depth 3\" and \"rr_depth 9\"");
    /* One that was ended inside of a replicate of four passes is whole in itself, but adds up with none. */
    ending e = {5};
    ca_render_settings s = settings_of("path", 12, 1);
    s.replicates = 3;
    s.part_path = file("open.part");
    s.progress = end_at;
    s.progress_user = &e;
    const uint64_t open = render(&s, NULL);
    assert_true(merge(&s.part_path, 1, NULL, NULL) == open);
    s.progress = NULL;
    s.has_passes = true;
    s.passes[0] = 8;
    s.passes[1] = 12;
    s.part_path = file("closed.part");
    render(&s, NULL);
    expect_no_merge(file("open.part"), s.part_path, false, "ends in the middle of a replicate of 4 passes");
    s = settings_of("path", 2, 1);
    s.part_path = file("q.part");
    s.integrator = "qmcppm";
    render(&s, NULL);
    const char *const paths[2] = {a, s.part_path};
    ca_error error = {""};
    assert_int_equal(ca_merge_parts(paths, 2, NULL, NULL, NULL, &error), CA_ERROR_FORMAT);
    assert_non_null(strstr(error.message, "q.part: a part file of blocks, not of passes"));
}

static double target_of(const char *name)
{
    open_part p;
    read_part(&p, name);
    const ca_pass_part part = p.reader.part;
    write_changed(&p, &part);
    return part.looks.target;
}

/* At the first pass that is told: how many there were at the last look. */
static bool note_look(const ca_render_progress *progress, void *user)
{
    uint32_t *passes = user;
    if (*passes == 0) *passes = progress->noise_passes;
    return true;
}

/* Nobody has looked at the noise of parts that are added up; and a file of ranks that were asked for it just before
 * their look tells that it is due. Who goes on looks at once. */
static void test_looks(void **state)
{
    (void)state;
    ca_render_settings s = settings_of("path", 8, 1);
    s.noise_percent = 1e-3;
    s.part_path = file("looked.part");
    render(&s, NULL);
    assert_true(target_of("looked.part") == 1e-3);
    const char *const paths[2] = {file("looked.part"), render_part("path", 8, 10, 1, "more.part")};
    assert_int_equal(ca_merge_parts(paths, 2, file("sum.part"), NULL, NULL, NULL), CA_OK);
    assert_true(target_of("sum.part") == 0.0);

    open_part p;
    read_part(&p, "looked.part");
    ca_pass_part part = p.reader.part;
    assert_true(part.looks.next == 16.0);
    part.looks.next = 8.0;
    write_changed(&p, &part);
    uint32_t looked = 0;
    s.samples_per_pixel = 12;
    s.part_path = NULL;
    s.checkpoint_path = file("changed.part");
    s.resume = true;
    s.progress = note_look;
    s.progress_user = &looked;
    render(&s, NULL);
    assert_int_equal(looked, 8);
    unlink(s.checkpoint_path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_settings_of_another_version),
        cmocka_unit_test(test_parts_of_every_integrator),
        cmocka_unit_test(test_parts_that_do_not_fit),
        cmocka_unit_test(test_looks),
    };
    return cmocka_run_group_tests(tests, begin_small_renders, end_small_renders);
}
