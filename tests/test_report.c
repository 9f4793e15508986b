/* The page of images: channels come back to the bit or as near as they say, texts cannot break out of their place,
 * and the file is whole or not there. What a browser makes of it is test_report_page.sh's business. */
#define _POSIX_C_SOURCE 200809L
#include "base/file.h"
#include "base/memory.h"
#include "report/page.h"
#include "report/page_files.h"
#include "report/page_text.h"
#include "report/plane.h"
#include "support/page_words.h"
#include "support/sample_folder.h"
#include "support/test_random.h"

#include <glob.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <jansson.h>
#include <zlib.h>

/* ---- Reading back ---------------------------------------------------------------------------------------------- */

static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static size_t decode_base64(const char *text, size_t length, unsigned char *bytes)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    size_t size = 0;
    uint32_t word = 0;
    int held = 0;
    for (size_t i = 0; i < length && text[i] != '='; i++) {
        const char *digit = strchr(digits, text[i]);
        assert_non_null(digit);
        word = word << 6 | (uint32_t)(digit - digits);
        held += 6;
        if (held >= 8) bytes[size++] = (unsigned char)(word >> (held -= 8));
    }
    return size;
}

static float float_of_half(uint32_t half)
{
    const uint32_t exponent = half >> 10 & 31, mantissa = half & 1023;
    const float size = exponent == 31  ? (mantissa ? NAN : INFINITY)
                       : exponent == 0 ? ldexpf((float)mantissa, -24)
                                       : ldexpf((float)(1024 + mantissa), (int)exponent - 25);
    return half & 0x8000 ? -size : size;
}

/* The values of plane IMAGE-NUMBER of a page, as viewer.js reads them. Says how many pieces it was in. */
static int read_plane(const char *page, const char *name, bool half, size_t count, float *values)
{
    char mark[96];
    snprintf(mark, sizeof mark, "<script type=\"text/plain\" data-plane=\"%s\"", name);
    unsigned char *deflated = malloc(strlen(page)), *bytes = malloc(4 * count + 1);
    assert_true(deflated && bytes);
    size_t size = 0;
    int pieces = 0;
    bool ended = false;
    for (const char *at = page; (at = strstr(at, mark)) != NULL; pieces++) {
        assert_false(ended);
        at += strlen(mark);
        ended = strncmp(at, " data-end>", 10) == 0;
        at += ended ? 10 : 1;
        const size_t length = strcspn(at, "<");
        assert_true(length > 0 && length <= 256 * 1024);
        size += decode_base64(at, length, deflated + size);
    }
    assert_true(ended);
    uLongf inflated = (uLongf)(4 * count + 1);
    assert_int_equal(uncompress(bytes, &inflated, deflated, (uLong)size), Z_OK);
    assert_int_equal(inflated, count * (half ? 2 : 4));
    for (size_t i = 0; i < count; i++) {
        uint32_t word = 0;
        for (size_t k = 0; k < (half ? 2u : 4u); k++) word |= (uint32_t)bytes[k * count + i] << (8 * k);
        if (half)
            values[i] = float_of_half(word);
        else
            memcpy(&values[i], &word, sizeof word);
    }
    free(deflated);
    free(bytes);
    return pieces;
}

static char *text_of(const char *path)
{
    ca_bytes bytes;
    assert_int_equal(ca_file_read(path, "page", (size_t)1 << 30, &bytes, NULL), CA_OK);
    char *text = malloc(bytes.size + 1);
    assert_non_null(text);
    memcpy(text, bytes.data, bytes.size + 1);
    assert_int_equal(strlen(text), bytes.size);
    ca_bytes_destroy(&bytes);
    return text;
}

/* ---- Rounding -------------------------------------------------------------------------------------------------- */

static void test_rounding(void **state)
{
    (void)state;
    assert_true(ca_plane_round(1.0f + 0x1p-8f, 8) == 1.0f + 0x1p-7f); /* a tie, away from zero */
    assert_true(ca_plane_round(-1.0f - 0x1p-8f, 8) == -1.0f - 0x1p-7f);
    assert_true(ca_plane_round(1.0f + 0x1p-9f, 8) == 1.0f);
    assert_true(ca_plane_round(0x1.ffffp0f, 8) == 2.0f); /* a carry into the exponent */
    assert_true(isfinite(ca_plane_round(0x1.fffffep127f, 8)));
    assert_true(ca_plane_round(INFINITY, 8) == INFINITY && ca_plane_round(-INFINITY, 8) == -INFINITY);
    assert_true(isnan(ca_plane_round(NAN, 8)));
    assert_true(ca_plane_round(0.0f, 8) == 0.0f);
    ca_test_random random = {1};
    for (int i = 0; i < 100000; i++) {
        const float value =
            ldexpf(ca_test_random_float(&random) - 0.5f, (int)(200.0f * ca_test_random_float(&random)) - 100);
        assert_int_equal(bits_of(ca_plane_round(value, CA_PLANE_EXACT)), bits_of(value));
        for (int bits = 8; bits < 24; bits += 4) {
            const float rounded = ca_plane_round(value, bits);
            assert_true(fabsf(rounded - value) <= ldexpf(fabsf(value), -bits));
            assert_int_equal(bits_of(rounded) & ((UINT32_C(1) << (24 - bits)) - 1), 0);
        }
    }
}

static void test_what_fits_half(void **state)
{
    (void)state;
    for (uint32_t half = 0; half < 65536; half++) {
        const float value = float_of_half(half);
        assert_true(ca_plane_fits_half(&value, 1, CA_PLANE_EXACT));
    }
    static const float others[] = {1.0f + 0x1p-11f, 65536.0f, 0x1p-25f, 0x1.8p-24f, 0x1.002p-14f, 0x1.004p-15f, 0.1f};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++)
        assert_false(ca_plane_fits_half(&others[i], 1, CA_PLANE_EXACT));
    assert_true(ca_plane_fits_half(&others[0], 1, 8)); /* rounded, it does */
}

/* ---- Planes ---------------------------------------------------------------------------------------------------- */

static void check_plane(const float *values, size_t count, int bits, int least_pieces)
{
    const bool half = ca_plane_fits_half(values, count, bits);
    const ca_plane plane = {values, count, bits, half, 3, 14};
    char *text = NULL;
    size_t length = 0;
    FILE *stream = open_memstream(&text, &length);
    assert_non_null(stream);
    assert_int_equal(ca_plane_write(&plane, stream, NULL), CA_OK);
    assert_int_equal(fclose(stream), 0);
    float *found = malloc(count * sizeof *found);
    assert_non_null(found);
    assert_true(read_plane(text, "3-14", half, count, found) >= least_pieces);
    for (size_t i = 0; i < count; i++) {
        const float expected = ca_plane_round(values[i], bits);
        if (!(isnan(expected) && isnan(found[i]))) assert_int_equal(bits_of(found[i]), bits_of(expected));
    }
    free(found);
    free(text);
}

static void test_planes_come_back(void **state)
{
    (void)state;
    enum { COUNT = 200000 };
    float *values = malloc(COUNT * sizeof *values);
    assert_non_null(values);
    ca_test_random random = {2};
    for (size_t i = 0; i < COUNT; i++) values[i] = 3.0f * ca_test_random_float(&random) - 1.0f;
    values[5] = NAN;
    values[6] = -INFINITY;
    values[7] = -0.0f;
    values[8] = 0x1p-149f;
    for (size_t count = 1; count < 6; count++) check_plane(values, count, CA_PLANE_EXACT, 1);
    check_plane(values, COUNT, CA_PLANE_EXACT, 3);
    check_plane(values, COUNT, 12, 1);
    for (size_t i = 0; i < COUNT; i++) values[i] = float_of_half((uint32_t)(i & 0xffff));
    check_plane(values, COUNT, CA_PLANE_EXACT, 1);
    free(values);
}

/* ---- Texts ----------------------------------------------------------------------------------------------------- */

static const char nasty[] = "a</script><!--<script>alert(1)</script>&amp;\"'\\\n\t\x01 \xc3\xa9.exr";

static void test_texts_stay_in_their_place(void **state)
{
    (void)state;
    char *json = page_words(ca_page_put_json, nasty);
    assert_null(strpbrk(json, "<>&\n"));
    json_t *value = json_loads(json, JSON_DECODE_ANY, NULL);
    assert_string_equal(json_string_value(value), nasty);
    json_decref(value);
    free(json);
    char *html = page_words(ca_page_put_html, "<b title=\"x\" id='y'>&</b>");
    assert_string_equal(html, "&lt;b title=&quot;x&quot; id=&#39;y&#39;&gt;&amp;&lt;/b&gt;");
    free(html);
}

/* ---- Pages ----------------------------------------------------------------------------------------------------- */

enum { WIDTH = 7, HEIGHT = 5, PIXELS = WIDTH * HEIGHT };

static ca_image_layers *make_layers(const char *const *names, size_t count, uint64_t seed)
{
    ca_image_layers *layers = NULL;
    assert_int_equal(ca_layers_create(&layers, WIDTH, HEIGHT, NULL), CA_OK);
    ca_test_random random = {seed};
    for (size_t i = 0; i < count; i++) {
        float *data;
        assert_int_equal(ca_layers_add(layers, names[i], &data, NULL), CA_OK);
        for (size_t k = 0; k < PIXELS; k++) data[k] = ca_test_random_float(&random);
    }
    return layers;
}

static const char *const picture_names[] = {"R",          "G",         "B",        "Variance.R", "Variance.G",
                                            "Variance.B", "Samples.Y", "Albedo.R", "Albedo.G",   "ConfidenceLow.Y",
                                            "Depth"};
static const char *const map_names[] = {"SSIM", "FLIP.LDR", "Difference.R"};

typedef struct pictures {
    ca_image_layers *image, *maps, *reference;
} pictures;

static pictures make_pictures(void)
{
    const pictures p = {make_layers(picture_names, 11, 1), make_layers(map_names, 3, 2),
                        make_layers(picture_names, 3, 3)};
    for (size_t i = 0; i < PIXELS; i++) p.image->channels[6].data[i] = (float)(i % 5); /* samples: some too few */
    return p;
}

static void destroy_pictures(pictures *p)
{
    ca_layers_destroy(p->image);
    ca_layers_destroy(p->maps);
    ca_layers_destroy(p->reference);
}

static ca_status write_page(const pictures *p, const char *layers, const char *path, ca_error *error)
{
    const ca_pixel_rect roi = {1, 2, 3, 4};
    const ca_page_settings settings = {.title = nasty, .layers = layers, .maps = "SSIM,FLIP.LDR", .roi = &roi};
    const ca_page_metric metrics[] = {{"RMSE", "root", 0.1, CA_PAGE_LOWER},
                                      {"SSIM", nasty, (double)NAN, CA_PAGE_HIGHER}};
    const ca_page_image reference = {.name = "ref", .is_reference = true, .layers = p->reference};
    const ca_page_image image = {
        .name = nasty, .layers = p->image, .maps = p->maps, .metrics = metrics, .metric_count = 2};
    ca_page *page = NULL;
    ca_status status = ca_page_create(&page, path, &settings, error);
    if (status == CA_OK) status = ca_page_add(page, &reference, error);
    if (status == CA_OK) status = ca_page_add(page, &image, error);
    if (status == CA_OK) status = ca_page_finish(page, error);
    ca_page_destroy(page);
    return status;
}

static char *page_text(const pictures *p, const char *layers)
{
    ca_error error = {""};
    char path[128];
    snprintf(path, sizeof path, "%s", path_to("page.html"));
    if (write_page(p, layers, path, &error) != CA_OK) fail_msg("%s", error.message);
    return text_of(path);
}

/* The record of image 1. */
static json_t *record_of(const char *page)
{
    static const char mark[] = "<script type=\"application/json\" data-image=\"1\">";
    const char *start = strstr(page, mark);
    assert_non_null(start);
    start += strlen(mark);
    json_t *record = json_loadb(start, strcspn(start, "<"), 0, NULL);
    assert_non_null(record);
    return record;
}

/* The number of the plane in the record; -1: none. */
static int plane_number(const json_t *record, const char *kind, const char *name, bool *half)
{
    size_t i;
    const json_t *plane;
    json_array_foreach(json_object_get(record, "planes"), i, plane) {
        if (strcmp(json_string_value(json_object_get(plane, "kind")), kind) != 0 ||
            strcmp(json_string_value(json_object_get(plane, "name")), name) != 0)
            continue;
        *half = json_is_true(json_object_get(plane, "half"));
        return (int)i;
    }
    return -1;
}

static bool find_plane(const char *page, const char *kind, const char *name, float values[PIXELS])
{
    json_t *record = record_of(page);
    bool half = false;
    char id[32];
    const int number = plane_number(record, kind, name, &half);
    json_decref(record);
    snprintf(id, sizeof id, "1-%d", number);
    if (number >= 0) assert_int_equal(read_plane(page, id, half, PIXELS, values), 1);
    return number >= 0;
}

static void test_a_page_has_what_it_says(void **state)
{
    (void)state;
    pictures p = make_pictures();
    char *page = page_text(&p, NULL);
    json_t *record = record_of(page);
    assert_string_equal(json_string_value(json_object_get(record, "name")), nasty);
    assert_true(json_is_false(json_object_get(record, "reference")));
    const json_t *metric = json_array_get(json_object_get(record, "metrics"), 0);
    assert_true(json_number_value(json_object_get(metric, "value")) == 0.1);
    assert_true(json_is_null(json_object_get(json_array_get(json_object_get(record, "metrics"), 1), "value")));
    json_decref(record);

    float values[PIXELS];
    for (int c = 0; c < 3; c++) {
        assert_true(find_plane(page, "color", picture_names[c], values));
        assert_memory_equal(values, p.image->channels[c].data, sizeof values);
        assert_true(find_plane(page, "error", picture_names[c], values));
        for (size_t i = 0; i < PIXELS; i++) {
            const double n = (double)(i % 5), variance = (double)p.image->channels[3 + c].data[i];
            if (n < 2.0)
                assert_true(isnan(values[i]));
            else
                assert_true(fabs((double)values[i] / sqrt(variance / n) - 1.0) <= 0x1p-8);
        }
    }
    assert_true(find_plane(page, "map", "FLIP.LDR", values) && find_plane(page, "map", "SSIM", values));
    for (size_t i = 0; i < PIXELS; i++) assert_true(values[i] == ca_plane_round(p.maps->channels[0].data[i], 12));
    assert_false(find_plane(page, "map", "Difference.R", values));
    assert_true(find_plane(page, "below", "Y", values));
    assert_false(find_plane(page, "above", "Y", values));
    for (size_t i = 0; i < PIXELS; i++) {
        const ca_channel *c = p.image->channels;
        const double distance = 0.2126 * (double)c[0].data[i] + 0.7152 * (double)c[1].data[i] +
                                0.0722 * (double)c[2].data[i] - (double)c[9].data[i];
        assert_true(fabs((double)values[i] - distance) <= 0x1p-8 * fabs(distance));
    }
    assert_false(find_plane(page, "layer", "ConfidenceLow.Y", values));
    assert_false(find_plane(page, "layer", "Depth", values));
    free(page);
    destroy_pictures(&p);
}

static void test_colours_come_first(void **state)
{
    (void)state;
    pictures p = make_pictures();
    char *page = page_text(&p, NULL);
    const char *end = strstr(page, "id=\"all-images\"");
    assert_non_null(end);
    /* Of each picture the planes are R G B, R G B of the preview, then the others. */
    assert_true(strstr(page, "data-image=\"1\"") < end && strstr(page, "data-plane") > end);
    assert_true(strstr(page, "data-plane=\"1-5\"") < strstr(page, "data-plane=\"0-0\""));
    assert_true(strstr(page, "data-plane=\"1-2\"") < strstr(page, "data-plane=\"1-6\""));
    free(page);
    destroy_pictures(&p);
}

static void test_layers_on_request(void **state)
{
    (void)state;
    pictures p = make_pictures();
    float values[PIXELS];
    char *page = page_text(&p, "Depth,Albedo");
    assert_true(find_plane(page, "layer", "Depth", values));
    for (size_t i = 0; i < PIXELS; i++) assert_true(values[i] == ca_plane_round(p.image->channels[10].data[i], 16));
    assert_true(find_plane(page, "layer", "Albedo.R", values) && find_plane(page, "layer", "Albedo.G", values));
    assert_false(find_plane(page, "layer", "Variance.R", values));
    free(page);
    page = page_text(&p, "all");
    assert_true(find_plane(page, "layer", "Variance.R", values) && find_plane(page, "layer", "Samples.Y", values));
    assert_false(find_plane(page, "layer", "R", values));
    free(page);
    destroy_pictures(&p);
}

/* The whole page but its own sources has each < where the writer put it, and the same input gives the same bytes. */
static void test_texts_do_not_break_out(void **state)
{
    (void)state;
    pictures p = make_pictures();
    char *page = page_text(&p, NULL), *again = page_text(&p, NULL);
    assert_string_equal(page, again);
    assert_null(strstr(page, "alert(1)</script>"));
    assert_null(strstr(page, "<script>alert"));
    assert_non_null(strstr(page, "<title>a&lt;/script&gt;"));
    assert_non_null(strstr(page, "default-src 'none'"));
    assert_null(strstr(page, "unsafe"));
    assert_null(strstr(page, "://")); /* no address to go to */
    free(page);
    free(again);
    destroy_pictures(&p);
}

static void test_refusals(void **state)
{
    (void)state;
    ca_error error = {""};
    pictures p = make_pictures();
    char path[128];
    snprintf(path, sizeof path, "%s", path_to("refused.html"));
    assert_int_equal(write_page(&p, "Dept", path, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "no picture has a layer \"Dept\""));
    assert_int_equal(write_page(&p, NULL, path_to("missing/page.html"), &error), CA_ERROR_FILE);

    pictures other = make_pictures();
    ca_layers_destroy(other.image);
    assert_int_equal(ca_layers_create(&other.image, WIDTH + 1, HEIGHT, NULL), CA_OK);
    assert_int_equal(write_page(&other, NULL, path, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "no channels R, G and B"));
    for (int c = 0; c < 3; c++) {
        float *data;
        assert_int_equal(ca_layers_add(other.image, picture_names[c], &data, NULL), CA_OK);
    }
    assert_int_equal(write_page(&other, NULL, path, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "8 x 5 pixels, those before it 7 x 5"));
    assert_int_not_equal(access(path, F_OK), 0);
    destroy_pictures(&other);
    destroy_pictures(&p);
}

static void test_every_allocation_may_fail(void **state)
{
    (void)state;
    pictures p = make_pictures();
    char path[128];
    snprintf(path, sizeof path, "%s", path_to("memory.html"));
    ca_status status = CA_ERROR_MEMORY;
    int failures = 0;
    for (; status != CA_OK; failures++) {
        assert_int_not_equal(access(path, F_OK), 0);
        ca_error error = {""};
        ca_memory_fail_after(failures);
        status = write_page(&p, "all", path, &error);
        ca_memory_fail_after(-1);
        if (status != CA_OK) assert_int_equal(status, CA_ERROR_MEMORY);
        assert_true(failures < 2000);
    }
    assert_true(failures > 20);
    destroy_pictures(&p);
}

/* What a browser gets is what is in src/report/. */
static void test_embedded_files(void **state)
{
    (void)state;
    glob_t found; /* *.css, *.html, *.js */
    assert_int_equal(glob(CA_SOURCE_DIR "/src/report/*.[chj][st]*", 0, NULL, &found), 0);
    assert_int_equal(ca_page_file_count, found.gl_pathc);
    for (size_t i = 0; i < found.gl_pathc; i++) {
        const ca_page_file *file = ca_page_files;
        ca_bytes bytes;
        while (strcmp(file->name, strrchr(found.gl_pathv[i], '/') + 1) != 0)
            assert_true(++file < ca_page_files + ca_page_file_count);
        assert_int_equal(ca_file_read(found.gl_pathv[i], "page", 1 << 20, &bytes, NULL), CA_OK);
        assert_int_equal(bytes.size, file->size);
        assert_memory_equal(bytes.data, file->data, bytes.size);
        assert_null(strstr((const char *)bytes.data, "\r"));
        /* Nothing in them ends their own element. */
        if (!strstr(file->name, ".html")) assert_null(strstr((const char *)bytes.data, "</"));
        ca_bytes_destroy(&bytes);
    }
    globfree(&found);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rounding),
        cmocka_unit_test(test_what_fits_half),
        cmocka_unit_test(test_planes_come_back),
        cmocka_unit_test(test_texts_stay_in_their_place),
        cmocka_unit_test(test_a_page_has_what_it_says),
        cmocka_unit_test(test_colours_come_first),
        cmocka_unit_test(test_layers_on_request),
        cmocka_unit_test(test_texts_do_not_break_out),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_every_allocation_may_fail),
        cmocka_unit_test(test_embedded_files),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
