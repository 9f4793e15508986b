/* The page with a picture of each technique: what is where, how much of the image it is, and the pictures' values. */
#define _POSIX_C_SOURCE 200809L
#include "image/layers.h"
#include "report/technique_page.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { WIDTH = 20, HEIGHT = 10, PAGE_SIZE = 1 << 20 };
static char folder[] = "/tmp/caustica-technique-page-XXXXXX";

static ca_technique_images *create(uint32_t width, uint32_t height)
{
    ca_technique_images *images;
    assert_int_equal(ca_technique_images_create(&images, (const uint32_t[4]){7, 3, 7 + width, 3 + height}, NULL),
                     CA_OK);
    return images;
}

/* The same value in all pixels. */
static void add(ca_technique_images *images, ca_technique technique, uint32_t s, uint32_t t, float value,
                float weight)
{
    uint32_t width, height;
    ca_technique_images_size(images, &width, &height);
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++)
            ca_technique_images_add(images, technique, s, t, 7 + x, 3 + y, ca_rgb_grey(value), weight);
}

static const char *page_of(const ca_technique_images *images, uint32_t passes)
{
    static char text[PAGE_SIZE];
    char path[128];
    ca_error error = {""};
    if (ca_technique_page_write(images, passes, folder, &error) != CA_OK) fail_msg("%s", error.message);
    snprintf(path, sizeof path, "%s/index.html", folder);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    const size_t length = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    assert_true(length < sizeof text - 1);
    text[length] = '\0';
    return text;
}

/* The table without its pictures. */
static const char *outline(const char *page)
{
    static char text[1 << 14];
    size_t used = 0;
    for (const char *at = strstr(page, "<table>"); *at; at++) {
        if (strncmp(at, "<img", 4) == 0) at = strchr(at, '>') + 1;
        while (strncmp(at, "<img", 4) == 0) at = strchr(at, '>') + 1;
        assert_true(used < sizeof text - 1);
        text[used++] = *at;
    }
    text[used] = '\0';
    return text;
}

/* ---- Where pictures are ---------------------------------------------------------------------------------------- */

#define CELL(technique, s, t, percent)                                                                               \
    "<td data-technique=\"" technique "\" data-s=\"" #s "\" data-t=\"" #t "\">s = " #s ", t = " #t ": " percent      \
    " %</td>"

static void test_rows_and_columns(void **state)
{
    (void)state;
    ca_technique_images *images = create(WIDTH, HEIGHT);
    add(images, CA_TECHNIQUE_HIT, 2, 0, 8.0f, 1.0f);        /* 1 segment */
    add(images, CA_TECHNIQUE_HIT, 4, 0, 4.0f, 0.25f);       /* 3 */
    add(images, CA_TECHNIQUE_NEXT_EVENT, 3, 1, 4.0f, 0.5f); /* 3 */
    add(images, CA_TECHNIQUE_CONNECT, 2, 2, 10.0f, 0.3f);   /* 3 */
    add(images, CA_TECHNIQUE_SPLAT, 1, 3, 2.0f, 0.0f);      /* 3 */
    add(images, CA_TECHNIQUE_MERGE, 3, 2, 1.0f, 1.0f);      /* 3, the vertices at the merge are one */
    add(images, CA_TECHNIQUE_CONNECT, 2, 3, 1.0f, 1.0f);    /* 4 */
    assert_string_equal(
        outline(page_of(images, 1)),
        "<table>\n<tr><th></th><th>hit</th><th>next_event</th><th>connect, t = 2</th><th>connect, t = 3</th>"
        "<th>splat</th><th>merge, t = 2</th></tr>\n"
        "<tr><th>1 segment</th>" CELL("hit", 2, 0, "50") "<td></td><td></td><td></td><td></td><td></td></tr>\n"
        "<tr><th>3 segments</th>" CELL("hit", 4, 0, "6.25") CELL("next_event", 3, 1, "12.5")
        CELL("connect", 2, 2, "18.8") "<td></td>" CELL("splat", 1, 3, "0") CELL("merge", 3, 2, "6.25") "</tr>\n"
        "<tr><th>4 segments</th><td></td><td></td><td></td>" CELL("connect", 2, 3, "6.25") "<td></td><td></td></tr>\n"
        "</table></body></html>\n");
    ca_technique_images_destroy(images);
}

/* ---- What they show -------------------------------------------------------------------------------------------- */

/* The first picture of this kind, by way of a file. */
static ca_image_layers *picture(const char *page, const char *kind)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    char mark[64], path[128];
    ca_image_layers *image;
    snprintf(mark, sizeof mark, "<img class=\"%s\"", kind);
    const char *at = strstr(page, mark);
    assert_non_null(at);
    at = strstr(at, "base64,") + 7;
    snprintf(path, sizeof path, "%s/picture.png", folder);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    for (; *at != '"'; at += 4) {
        uint32_t word = 0;
        for (int i = 0; i < 4; i++)
            word = word << 6 | (at[i] == '=' ? 0 : (uint32_t)(strchr(digits, at[i]) - digits));
        const unsigned char bytes[3] = {word >> 16 & 255, word >> 8 & 255, word & 255};
        fwrite(bytes, 1, at[2] == '=' ? 1 : at[3] == '=' ? 2 : 3, file);
    }
    fclose(file);
    assert_int_equal(ca_layers_read(path, &image, NULL), CA_OK);
    unlink(path);
    return image;
}

static void assert_values(const char *page, const char *kind, uint32_t width, uint32_t height, double left,
                          double right)
{
    ca_image_layers *image = picture(page, kind);
    assert_int_equal(image->width, width);
    assert_int_equal(image->height, height);
    const float *g = ca_layers_find(image, "G");
    if (fabs((double)g[0] - left) > 0.01 || fabs((double)g[width - 1] - right) > 0.01)
        fail_msg("%s: %g and %g instead of %g and %g", kind, (double)g[0], (double)g[width - 1], left, right);
    ca_layers_destroy(image);
}

/* The image is 8 everywhere, which is shown as 1. On the left 6 of it are hits of weight 1/2, on the right 2. */
static void test_values(void **state)
{
    (void)state;
    ca_technique_images *images = create(WIDTH, HEIGHT);
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++)
            ca_technique_images_add(images, CA_TECHNIQUE_HIT, 3, 0, 7 + x, 3 + y, ca_rgb_grey(x < 5 ? 12.0f : 4.0f),
                                    0.5f);
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++)
            ca_technique_images_add(images, CA_TECHNIQUE_MERGE, 2, 3, 7 + x, 3 + y, ca_rgb_grey(x < 5 ? 2.0f : 6.0f),
                                    1.0f);
    for (uint32_t passes = 1; passes <= 4; passes *= 4) { /* the exposure follows */
        const char *page = page_of(images, passes);
        assert_values(page, "weighted", WIDTH, HEIGHT, 0.75, 0.25);
        assert_values(page, "unweighted", WIDTH, HEIGHT, 1.0, 0.5);
        assert_values(page, "weight", WIDTH, HEIGHT, 0.5, 0.5);
    }
    ca_technique_images_destroy(images);
}

/* Large ones are reduced, in odd sizes too; the last column is of what is left. */
static void test_reduced(void **state)
{
    (void)state;
    ca_technique_images *images = create(481, 7);
    for (uint32_t y = 0; y < 7; y++)
        for (uint32_t x = 0; x < 481; x++)
            ca_technique_images_add(images, CA_TECHNIQUE_HIT, 3, 0, 7 + x, 3 + y,
                                    ca_rgb_grey(x == 480 ? 0.5f : x % 3 == 1 ? 3.0f : 0.0f), 1.0f);
    assert_values(page_of(images, 1), "weighted", 161, 3, 1.0, 0.5);
    ca_technique_images_destroy(images);
}

static void test_nothing_and_nowhere(void **state)
{
    (void)state;
    ca_error error = {""};
    ca_technique_images *images = create(WIDTH, HEIGHT);
    assert_string_equal(outline(page_of(images, 1)), "<table>\n<tr><th></th></tr>\n</table></body></html>\n");
    assert_int_equal(ca_technique_page_write(images, 1, "/nowhere", &error), CA_ERROR_FILE);
    add(images, CA_TECHNIQUE_HIT, 2, 0, 0.0f, 1.0f); /* black */
    assert_non_null(strstr(page_of(images, 1), "s = 2, t = 0: 0 %"));
    ca_technique_images_destroy(images);
}

static int remove_all(void **state)
{
    (void)state;
    char path[128];
    snprintf(path, sizeof path, "%s/index.html", folder);
    unlink(path);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rows_and_columns),
        cmocka_unit_test(test_values),
        cmocka_unit_test(test_reduced),
        cmocka_unit_test(test_nothing_and_nowhere),
    };
    if (!mkdtemp(folder)) return 1;
    return cmocka_run_group_tests_name("the page of the techniques", tests, NULL, remove_all);
}
