/* Images in memory and the way to disk and back: what a writer wrote is what a reader reads, and where a write fails,
 * the old file stays and nothing else is left. */
#define _DEFAULT_SOURCE
#include "base/memory.h"
#include "image/image.h"
#include "image/layers.h"
#include "support/sample_files.h"
#include "support/sample_folder.h"
#include "support/test_random.h"

#include <dirent.h>
#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cmocka.h>

enum { WIDTH = 37, HEIGHT = 29 };

/* R, G, B and further channels of noise over six decades, of which every third is meant to become halves. */
static ca_image_layers *noise_layers(size_t channel_count)
{
    static const char *const names[] = {"R", "G", "B", "A", "Variance.R", "Samples.Y", "Albedo.G", "Z"};
    ca_image_layers *layers;
    assert_int_equal(ca_layers_create(&layers, WIDTH, HEIGHT, NULL), CA_OK);
    ca_test_random random = ca_test_random_seed(channel_count);
    for (size_t c = 0; c < channel_count; ++c) {
        float *data;
        assert_int_equal(ca_layers_add(layers, names[c], &data, NULL), CA_OK);
        for (size_t i = 0; i < WIDTH * HEIGHT; ++i) data[i] = exp2f(20.0f * ca_test_random_float(&random) - 16.0f);
        layers->channels[c].half = c % 3 == 2;
    }
    return layers;
}

static void write_layers(const ca_image_layers *layers, const char *path, float exposure)
{
    ca_error error = {{0}};
    if (ca_layers_write(layers, path, exposure, &error) != CA_OK) fail_msg("%s", error.message);
}

static ca_image_layers *read_layers(const char *path)
{
    ca_error error = {{0}};
    ca_image_layers *layers = NULL;
    if (ca_layers_read(path, &layers, &error) != CA_OK) fail_msg("%s", error.message);
    return layers;
}

/* The channels are equal, those of halves up to half a unit in the last of their 11 bits. */
static void assert_same_channels(const ca_image_layers *written, const ca_image_layers *read, size_t count)
{
    assert_int_equal(read->channel_count, count);
    assert_int_equal(read->width, written->width);
    assert_int_equal(read->height, written->height);
    for (size_t c = 0; c < count; ++c) {
        const ca_channel *channel = &written->channels[c];
        const float *data = ca_layers_find(read, channel->name);
        if (!data) fail_msg("channel %s is missing", channel->name);
        for (size_t i = 0; i < (size_t)written->width * written->height; ++i) {
            const float wanted = channel->data[i];
            const float tolerance = channel->half ? fmaxf(wanted * 0x1p-11f, 0x1p-25f) : 0.0f;
            if (!(fabsf(data[i] - wanted) <= tolerance))
                fail_msg("%s[%zu] is %.9g, not %.9g", channel->name, i, (double)data[i], (double)wanted);
        }
    }
}

/* ---- round trips ----------------------------------------------------------------------------------------------- */

static void exr_round_trip(void **unused)
{
    (void)unused;
    for (size_t count = 1; count <= 8; ++count) {
        ca_image_layers *layers = noise_layers(count);
        layers->x0 = 5;
        layers->y0 = -3;
        layers->full_width = 640;
        layers->full_height = 480;
        assert_int_equal(ca_layers_set_text(layers, "comments", "grey", NULL), CA_OK);
        assert_int_equal(ca_layers_set_text(layers, "comments", "white and black", NULL), CA_OK);
        assert_int_equal(ca_layers_set_number(layers, "a.name.of.more.than.31.characters", 0.1, NULL), CA_OK);
        write_layers(layers, path_to("a.exr"), 3.0f);
        ca_image_layers *read = read_layers(path_to("a.exr"));
        assert_same_channels(layers, read, count);
        for (size_t c = 0; c < count; ++c)
            for (size_t k = 0; k < count; ++k)
                if (strcmp(layers->channels[c].name, read->channels[k].name) == 0)
                    assert_int_equal(read->channels[k].half, layers->channels[c].half);
        assert_int_equal(read->x0, 5);
        assert_int_equal(read->y0, -3);
        assert_int_equal(read->full_width, 640);
        assert_int_equal(read->full_height, 480);
        assert_int_equal(read->attribute_count, 2);
        for (size_t i = 0; i < 2; ++i) {
            const ca_attribute *attribute = &read->attributes[i];
            if (attribute->text)
                assert_string_equal(attribute->text, "white and black");
            else
                assert_true(strcmp(attribute->name, "a.name.of.more.than.31.characters") == 0 &&
                            attribute->number == 0.1);
        }
        ca_layers_destroy(read);
        ca_layers_destroy(layers);
    }
}

/* Some of so few numbers take as many bytes when they are compressed: the chunk is as long as one that is not. */
static void exr_of_few_pixels(void **unused)
{
    (void)unused;
    const char *path = path_to("few.exr");
    static const char *const names[] = {"R", "G", "B", "A"};
    for (uint32_t width = 1; width < 12; ++width)
        for (uint32_t height = 1; height < 6; ++height)
            for (size_t count = 1; count <= 4; ++count) {
                ca_image_layers *layers;
                assert_int_equal(ca_layers_create(&layers, width, height, NULL), CA_OK);
                for (size_t c = 0; c < count; ++c) {
                    float *data;
                    assert_int_equal(ca_layers_add(layers, names[c], &data, NULL), CA_OK);
                    for (size_t i = 0; i < (size_t)width * height; ++i) data[i] = (float)(count * i + c) / 24.0f;
                }
                write_layers(layers, path, 0.0f);
                ca_image_layers *read = read_layers(path);
                assert_same_channels(layers, read, count);
                ca_layers_destroy(layers);
                ca_layers_destroy(read);
            }
}

/* As a texture: each channel in its place, whatever the mixture of types and whichever other channels there are. */
static void exr_as_image(void **unused)
{
    (void)unused;
    for (size_t count = 3; count <= 8; ++count)
        for (int halves = 0; halves < 2; ++halves) {
            ca_image_layers *layers = noise_layers(count);
            for (size_t c = 0; c < count; ++c) {
                layers->channels[c].half = halves;
                for (size_t i = 0; i < WIDTH * HEIGHT; ++i) layers->channels[c].data[i] = (float)(i % 128 + 128 * c);
            }
            write_layers(layers, path_to("i.exr"), 0.0f);
            ca_image image;
            ca_error error = {{0}};
            if (ca_image_read(path_to("i.exr"), CA_ENCODING_SRGB, &image, &error) != CA_OK)
                fail_msg("%s", error.message);
            assert_int_equal(image.channels, count == 3 ? 3 : 4);
            for (size_t i = 0; i < WIDTH * HEIGHT; ++i)
                for (size_t c = 0; c < image.channels; ++c)
                    assert_float_equal(image.data[i * image.channels + c], layers->channels[c].data[i], 0.0f);
            ca_image_destroy(&image);
            ca_layers_destroy(layers);
        }
}

/* Halves of which only one or three channels are asked for: the library's shortcuts for three and four channels. */
static void exr_some_channels(void **unused)
{
    (void)unused;
    static const char *const names[][4] = {{"R", "Y", "Z"},      {"Y", "Z"},           {"Mask", "Y", "Z", "id"},
                                           {"B", "G", "R", "Z"}, {"A", "Y", "Z", "z"}, {"G", "R", "Y"}};
    for (size_t k = 0; k < sizeof names / sizeof *names; ++k) {
        ca_image_layers *layers;
        assert_int_equal(ca_layers_create(&layers, WIDTH, HEIGHT, NULL), CA_OK);
        for (size_t c = 0; c < 4 && names[k][c]; ++c) {
            float *data;
            assert_int_equal(ca_layers_add(layers, names[k][c], &data, NULL), CA_OK);
            layers->channels[c].half = true;
            for (size_t i = 0; i < WIDTH * HEIGHT; ++i) data[i] = (float)(i % 128 + 128 * c);
        }
        write_layers(layers, path_to("s.exr"), 0.0f);
        ca_image image;
        ca_error error = {{0}};
        if (ca_image_read(path_to("s.exr"), CA_ENCODING_SRGB, &image, &error) != CA_OK) fail_msg("%s", error.message);
        const float *first = ca_layers_find(layers, image.channels >= 3 ? "R" : "Y");
        for (size_t i = 0; i < WIDTH * HEIGHT; ++i)
            assert_float_equal(image.data[i * image.channels], first[i], 0.0f);
        ca_image_destroy(&image);
        ca_layers_destroy(layers);
    }
}

static void pfm_round_trip(void **unused)
{
    (void)unused;
    ca_image_layers *layers = noise_layers(5);
    layers->channels[2].half = false;
    write_layers(layers, path_to("a.pfm"), 3.0f);
    ca_image_layers *read = read_layers(path_to("a.pfm"));
    assert_same_channels(layers, read, 3);
    ca_layers_destroy(read);
    ca_layers_destroy(layers);
}

/* Within half a code of the exposed value; what has no code is black or white. */
static void png_round_trip(void **unused)
{
    (void)unused;
    ca_image_layers *layers = noise_layers(3);
    const float odd[] = {-1.0f, NAN, INFINITY, -INFINITY, 0.0f, 1e30f};
    const float odd_codes[] = {0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 1.0f};
    memcpy(layers->channels[1].data, odd, sizeof odd);
    write_layers(layers, path_to("a.png"), 2.0f);
    ca_image image;
    ca_error error = {{0}};
    if (ca_image_read(path_to("a.png"), CA_ENCODING_RAW, &image, &error) != CA_OK) fail_msg("%s", error.message);
    assert_int_equal(image.width, WIDTH);
    assert_int_equal(image.channels, 3);
    for (size_t i = 0; i < WIDTH * HEIGHT; ++i)
        for (size_t c = 0; c < 3; ++c) {
            const bool is_odd = c == 1 && i < 6;
            const float code =
                is_odd ? odd_codes[i] : ca_linear_to_srgb(fminf(4.0f * layers->channels[c].data[i], 1.0f));
            const float tolerance = is_odd ? 0.0f : 0.5f / 255.0f + 1e-6f;
            assert_true(fabsf(image.data[3 * i + c] - code) <= tolerance);
        }
    ca_image_destroy(&image);
    ca_layers_destroy(layers);
}

static void srgb_is_its_own_inverse(void **unused)
{
    (void)unused;
    float last = -1.0f;
    for (int i = 0; i <= 1000; ++i) {
        const float encoded = (float)i / 1000.0f, linear = ca_srgb_to_linear(encoded);
        assert_true(linear > last);
        assert_float_equal(ca_linear_to_srgb(linear), encoded, 2e-6f);
        last = linear;
    }
    assert_float_equal(ca_srgb_to_linear(0.5f), 0.21404114f, 1e-6f);
    assert_float_equal(ca_srgb_to_linear(1.0f), 1.0f, 1e-7f);
}

/* ---- failures -------------------------------------------------------------------------------------------------- */

static const char *const outputs[] = {"full.exr", "full.png", "full.pfm"};

static size_t files_in_folder(void)
{
    size_t count = 0;
    DIR *listing = opendir(folder);
    assert_non_null(listing);
    for (struct dirent *entry; (entry = readdir(listing)) != NULL;) count += entry->d_name[0] != '.';
    closedir(listing);
    return count;
}

static void assert_old_file(const char *path)
{
    char text[8] = {0};
    FILE *stream = fopen(path, "rb");
    assert_non_null(stream);
    assert_int_equal(fread(text, 1, sizeof text, stream), 3);
    assert_string_equal(text, "old");
    fclose(stream);
}

/* A disk that is full after so many bytes, by the limit of the process on the size of files. */
static ca_status write_limited(const ca_image_layers *layers, const char *path, rlim_t bytes, ca_error *error)
{
    struct rlimit before;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    const struct rlimit limited = {.rlim_cur = bytes, .rlim_max = before.rlim_max};
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limited), 0);
    const ca_status status = ca_layers_write(layers, path, 0.0f, error);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    return status;
}

static void full_disk_keeps_the_old_file(void **unused)
{
    (void)unused;
    signal(SIGXFSZ, SIG_IGN);
    ca_image_layers *layers = noise_layers(8);
    for (size_t k = 0; k < sizeof outputs / sizeof *outputs; ++k) {
        const char *path = path_to(outputs[k]);
        write_layers(layers, path, 0.0f);
        struct stat info;
        assert_int_equal(stat(path, &info), 0);
        sample_write(path, "old", 3);
        const size_t files = files_in_folder();
        for (rlim_t limit = 0; limit < (rlim_t)info.st_size; limit += (rlim_t)info.st_size / 16) {
            ca_error error = {{0}};
            assert_int_equal(write_limited(layers, path, limit, &error), CA_ERROR_FILE);
            if (strncmp(error.message, path, strlen(path)) != 0 || !strstr(error.message, "cannot write") ||
                !strstr(error.message, "File too large"))
                fail_msg("\"%s\"", error.message);
            assert_old_file(path);
            assert_int_equal(files_in_folder(), files);
        }
        ca_error error = {{0}};
        assert_int_equal(write_limited(layers, path, (rlim_t)info.st_size, &error), CA_OK);
    }
    ca_layers_destroy(layers);
    signal(SIGXFSZ, SIG_DFL);
}

static void every_allocation_may_fail(void **unused)
{
    (void)unused;
    ca_image_layers *layers = noise_layers(8);
    for (size_t k = 0; k < sizeof outputs / sizeof *outputs; ++k) {
        const char *path = path_to(outputs[k]);
        sample_write(path, "old", 3);
        const size_t files = files_in_folder();
        long n = 0;
        for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; ++n) {
            ca_error error = {{0}};
            ca_memory_fail_after(n);
            status = ca_layers_write(layers, path, 0.0f, &error);
            ca_memory_fail_after(-1);
            if (status != CA_OK && status != CA_ERROR_MEMORY) fail_msg("allocation %ld: %s", n, error.message);
            if (status != CA_OK) assert_old_file(path);
            assert_int_equal(files_in_folder(), files);
        }
        assert_true(n > 3);
    }
    ca_layers_destroy(layers);
}

static void paths_and_channels_are_checked(void **unused)
{
    (void)unused;
    ca_image_layers *layers = noise_layers(2);
    ca_error error = {{0}};
    const size_t files = files_in_folder();
    assert_int_equal(ca_layers_write(layers, path_to("a.jpg"), 0.0f, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, ".exr, .png or .pfm"));
    assert_int_equal(ca_layers_check_path("exr", &error), CA_ERROR_ARGUMENT);
    assert_int_equal(ca_layers_check_path("a.EXR", &error), CA_OK);
    assert_int_equal(ca_layers_write(layers, path_to("two.png"), 0.0f, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "the image has no channels R, G and B"));
    assert_int_equal(ca_layers_write(layers, "/nowhere/a.exr", 0.0f, &error), CA_ERROR_FILE);
    assert_string_equal(error.message, "/nowhere/a.exr: cannot write: No such file or directory");
    assert_int_equal(files_in_folder(), files);
    ca_layers_destroy(layers);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exr_round_trip),
        cmocka_unit_test(exr_of_few_pixels),
        cmocka_unit_test(exr_as_image),
        cmocka_unit_test(exr_some_channels),
        cmocka_unit_test(pfm_round_trip),
        cmocka_unit_test(png_round_trip),
        cmocka_unit_test(srgb_is_its_own_inverse),
        cmocka_unit_test(full_disk_keeps_the_old_file),
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test(paths_and_channels_are_checked),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
