#include "support/pbrt_twins.h"

#include "support/scene_text.h"

#include <stdio.h>
#include <string.h>

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static void write_sky(void)
{
    static const char header[] = "PF\n8 4\n-1.0\n";
    float pixels[96];
    unsigned char bytes[sizeof header - 1 + sizeof pixels];
    for (int i = 0; i < 96; i++) pixels[i] = 0.1f + 0.02f * (float)((i * 37) % 50);
    memcpy(bytes, header, sizeof header - 1);
    memcpy(bytes + sizeof header - 1, pixels, sizeof pixels);
    import_write("sky.pfm", bytes, sizeof bytes);
}

static void write_two_by_two(const char *name, const float pixels[12])
{
    static const char header[] = "PF\n2 2\n-1.0\n";
    unsigned char bytes[sizeof header - 1 + 12 * sizeof *pixels];
    memcpy(bytes, header, sizeof header - 1);
    memcpy(bytes + sizeof header - 1, pixels, 12 * sizeof *pixels);
    import_write(name, bytes, sizeof bytes);
}

/* 1 - 0.4 times picture.pfm; 3 times it, at most 1; the mean of its channels; and 2 everywhere. */
static void write_changed_pictures(void)
{
    static const float inverse[12] = {1, 1, 0.6f, 0.2f, 0.2f, 0.2f, 0.6f, 1, 1, 1, 0.6f, 1};
    static const float cut[12] = {0, 0, 1, 1, 1, 1, 1, 0, 0, 0, 1, 0};
    static const float third = 1.0f / 3.0f, grey[12] = {third, third, third, 2,     2,     2,
                                                          third, third, third, third, third, third};
    static const float two[12] = {2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2};
    write_two_by_two("two.pfm", two);
    write_two_by_two("inverse.pfm", inverse);
    write_two_by_two("grey.pfm", grey);
    write_two_by_two("cut.pfm", cut);
}

/* picture.pfm, whose pixels are 0, 1 or 2, with a black frame as wide as a pixel of it. */
static void write_framed_picture(void)
{
    static const char header[] = "PF\n4 4\n-1.0\n";
    static const float inside[12] = {0, 0, 1, 2, 2, 2, 1, 0, 0, 0, 1, 0};
    float pixels[48] = {0.0f};
    unsigned char bytes[sizeof header - 1 + sizeof pixels];
    for (int y = 0; y < 2; y++) memcpy(pixels + 12 * (y + 1) + 3, inside + 6 * y, 6 * sizeof *pixels);
    memcpy(bytes, header, sizeof header - 1);
    memcpy(bytes + sizeof header - 1, pixels, sizeof pixels);
    import_write("framed.pfm", bytes, sizeof bytes);
}

/* Two by two pixels of R, G, B and A, and of what a number is read from. */
static void write_pictures_with_alpha(void)
{
    static const float red[4] = {0.9f, 0, 0.3f, 0.6f}, green[4] = {0, 0.3f, 0.6f, 0.9f}, blue[4] = {0.3f, 0, 0, 0};
    static const float alpha[4] = {1, 0.25f, 0, 0.75f}, one[4] = {1, 1, 1, 1};
    const float *const channels[4] = {red, green, blue, alpha};
    float grey[2][12];
    for (int opaque = 0; opaque < 2; opaque++) {
        ca_image_layers *image;
        char path[600];
        assert_int_equal(ca_image_make(2, 2, &image, NULL), CA_OK);
        for (int c = 0; c < 4; c++) {
            const char name[2] = {"RGBA"[c], '\0'};
            assert_int_equal(ca_image_add(image, name, c == 3 && opaque ? one : channels[c], NULL), CA_OK);
        }
        snprintf(path, sizeof path, "%s/%s.exr", import_folder(), opaque ? "opaque" : "leaf");
        assert_int_equal(ca_image_save(image, path, 0.0f, NULL), CA_OK);
        ca_image_release(image);
        for (int i = 0; i < 12; i++) { /* PFM begins with the last row */
            const int pixel = (i / 6 == 0 ? 2 : 0) + i / 3 % 2;
            grey[opaque][i] = opaque ? (red[pixel] + green[pixel] + blue[pixel]) / 3.0f : alpha[pixel];
        }
    }
    write_two_by_two("alpha.pfm", grey[0]);
    write_two_by_two("mean.pfm", grey[1]);
}

/* quad.ply with u = (x + 1) / 2 and v = 1 - (y - 0.5) / 2. */
static const char mapped_quad[] = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                                  "property float z\nproperty float u\nproperty float v\nelement face 1\n"
                                  "property list uchar int vertex_indices\nend_header\n-1 0.5 0 0 1\n1 0.5 0 1 1\n"
                                  "1 2 0 1 0.25\n-1 2 0 0 0.25\n4 0 1 2 3\n";

static const char tent[] = "ply\n"
                           "format ascii 1.0\n"
                           "element vertex 5\n"
                           "property float x\n"
                           "property float y\n"
                           "property float z\n"
                           "element face 4\n"
                           "property list uchar int vertex_indices\n"
                           "end_header\n"
                           "-1 -0.5 -1\n"
                           "1 -0.5 -1\n"
                           "1 -0.5 1\n"
                           "-1 -0.5 1\n"
                           "0 1 0\n"
                           "3 0 4 1\n"
                           "3 1 4 2\n"
                           "3 2 4 3\n"
                           "3 3 4 0\n";

/* The same, packed. */
static const unsigned char packed_tent[] = {
    31,  139, 8,   0,   0,   0,   0,   0,   2,   3,   101, 141, 77,  14,  131, 32,  16,  133, 247, 115, 138, 119,
    1,   13,  8,   158, 199, 16,  24,  34,  9,   162, 1,   218, 104, 79,  223, 89,  217, 196, 174, 190, 247, 51,
    153, 119, 228, 139, 226, 94,  55,  215, 225, 154, 79,  9,   122, 84,  196, 153, 55,  46,  29,  111, 174, 157,
    79,  204, 116, 212, 253, 16,  125, 33,  230, 93,  46,  207, 103, 112, 61,  131, 207, 253, 35,  58,  207, 176,
    191, 62,  167, 214, 241, 242, 171, 171, 72,  247, 196, 146, 74,  72,  158, 27,  113, 9,   203, 202, 46,  112,
    165, 65,  99,  80,  227, 140, 65,  211, 159, 210, 119, 171, 73,  65,  67,  145, 129, 130, 21,  103, 196, 89,
    76,  194, 73,  104, 132, 70,  168, 232, 11,  202, 48,  229, 81,  232, 0,   0,   0};

static void write_files(void)
{
    import_write_picture();
    write_changed_pictures();
    write_framed_picture();
    write_pictures_with_alpha();
    write_sky();
    import_write_text("ball.pbrt", "Translate 0 1 0\nShape \"sphere\"\nTranslate 0 -1 0\n");
    import_write_text("paint.spd", "# a paint\n400 .1\n500 .8 700 .2\n");
    import_write_text("tent.ply", tent);
    import_write_text("mapped_quad.ply", mapped_quad);
    import_write_text("spike.txt", "-9 1 0 .5\n-3 1 0 .25\n3 1 0 0\n9 1 0 -.25\n");
    import_write("tent.ply.gz", packed_tent, sizeof packed_tent);
    import_write_text("pair.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                                  "property float z\nelement face 2\nproperty list uchar int vertex_indices\n"
                                  "end_header\n-1 0 0\n1 0 0\n0 1 0.5\n0 1.5 -1\n3 0 1 2\n3 1 3 2\n");
    import_write_text("quad.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                                  "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                                  "end_header\n-1 0.5 0\n1 0.5 0\n1 2 0\n-1 2 0\n4 0 1 2 3\n");
}

/* ---- Comparison ------------------------------------------------------------------------------------------------ */

void compare_pbrt_twins(const pbrt_twin *twins, size_t count)
{
    write_files();
    for (size_t i = 0; i < count; i++) {
        char xml[8192];
        snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", twins[i].xml);
        ca_image_layers *a = import_render_text(twins[i].pbrt, "twin.pbrt"), *b = import_render_text(xml, "twin.xml");
        const double apart = picture_difference(a, b);
        if (!(apart <= twins[i].tolerance)) fail_msg("%s: pixels differ by %g", twins[i].name, apart);
        ca_image_release(a);
        ca_image_release(b);
    }
}
