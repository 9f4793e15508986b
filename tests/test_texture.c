/* Textures against formulas written down a second time, in double precision and without the wrapping tricks. */
#include "material/texture.h"
#include "math/numeric.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static const ca_texture_wrap WRAPS[] = {CA_WRAP_REPEAT, CA_WRAP_MIRROR, CA_WRAP_CLAMP, CA_WRAP_ZERO};

static float uniform(ca_test_random *random, float low, float high)
{
    return low + (high - low) * ca_test_random_float(random);
}

static ca_surface surface_at(float u, float v) { return (ca_surface){.uv = {u, v}}; }

static void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance)) fail_msg("%.9g, expected %.9g +- %.2g", value, expected, tolerance);
}

static void fill_random(ca_image *image, uint64_t seed)
{
    ca_test_random random = ca_test_random_seed(seed);
    const size_t count = (size_t)image->width * image->height * image->channels;
    for (size_t i = 0; i < count; ++i) image->data[i] = ca_test_random_float(&random);
}

static ca_texture bitmap(const ca_image *image, ca_texture_filter filter, ca_texture_wrap wrap)
{
    return (ca_texture){.kind = CA_TEXTURE_BITMAP,
                        .to_uv = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
                        .as.bitmap = {.image = image, .filter = filter, .wrap = wrap}};
}

static int modulo(int i, int n) { return ((i % n) + n) % n; }

static int oracle_index(int i, int n, ca_texture_wrap wrap)
{
    if (wrap == CA_WRAP_REPEAT) return modulo(i, n);
    if (wrap == CA_WRAP_CLAMP || wrap == CA_WRAP_ZERO) return i < 0 ? 0 : i >= n ? n - 1 : i;
    const int m = modulo(i, 2 * n);
    return m < n ? m : 2 * n - 1 - m;
}

static double oracle_texel(const ca_texture *texture, int x, int y, int channel)
{
    const ca_image *image = texture->as.bitmap.image;
    const bool outside = x < 0 || x >= (int)image->width || y < 0 || y >= (int)image->height;
    if (outside && texture->as.bitmap.wrap == CA_WRAP_ZERO) return 0.0;
    const int i = oracle_index(x, (int)image->width, texture->as.bitmap.wrap);
    const int j = oracle_index(y, (int)image->height, texture->as.bitmap.wrap);
    const uint32_t c = image->channels < 3 ? 0 : (uint32_t)channel;
    return (double)image->data[((uint32_t)j * image->width + (uint32_t)i) * image->channels + c];
}

static double oracle_bilinear(const ca_texture *texture, double u, double v, int channel)
{
    const double x = u * texture->as.bitmap.image->width - 0.5, y = (1 - v) * texture->as.bitmap.image->height - 0.5;
    const double i = floor(x), j = floor(y), a = x - i, b = y - j;
    return (1 - b) * ((1 - a) * oracle_texel(texture, (int)i, (int)j, channel) +
                      a * oracle_texel(texture, (int)i + 1, (int)j, channel)) +
           b * ((1 - a) * oracle_texel(texture, (int)i, (int)j + 1, channel) +
                a * oracle_texel(texture, (int)i + 1, (int)j + 1, channel));
}

static void oracle_uv(const ca_texture *texture, double u, double v, double *tu, double *tv)
{
    const float(*m)[3] = texture->to_uv;
    *tu = (double)m[0][0] * u + (double)m[0][1] * v + (double)m[0][2];
    *tv = (double)m[1][0] * u + (double)m[1][1] * v + (double)m[1][2];
}

static void constant_is_itself(void **state)
{
    (void)state;
    const ca_texture table[] = {ca_texture_constant((ca_rgb){0.1f, 0.2f, 0.3f}),
                                ca_texture_constant((ca_rgb){0.7f, 0.7f, 0.7f})};
    const ca_surface surface = surface_at(0.3f, 0.4f);
    const ca_rgb value = ca_texture_eval(table, 0, &surface);
    assert_true(value.r == 0.1f && value.g == 0.2f && value.b == 0.3f);
    assert_near((double)ca_texture_eval_scalar(table, 0, &surface), 0.2126 * 0.1 + 0.7152 * 0.2 + 0.0722 * 0.3, 1e-7);
    assert_true(ca_texture_eval_scalar(table, 1, &surface) == 0.7f); /* to the bit */
    const ca_vec2 gradient = ca_texture_gradient(table, 0, &surface);
    assert_true(gradient.x == 0.0f && gradient.y == 0.0f);
    assert_true(ca_texture_mean(table, 0).g == 0.2f);
    assert_true(ca_texture_max(table, 0) == 0.3f);
}

/* Row 0 is on top; texel centres carry the texels' values. */
static void bitmap_stands_upright(void **state)
{
    (void)state;
    float data[] = {1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f}; /* two rows of three */
    const ca_image image = {.width = 3, .height = 2, .channels = 1, .data = data};
    for (int filter = 0; filter < 2; ++filter) {
        const ca_texture texture = bitmap(&image, filter ? CA_FILTER_BILINEAR : CA_FILTER_NEAREST, CA_WRAP_REPEAT);
        for (int y = 0; y < 2; ++y)
            for (int x = 0; x < 3; ++x) {
                const ca_surface surface = surface_at(((float)x + 0.5f) / 3.0f, 1.0f - ((float)y + 0.5f) / 2.0f);
                const ca_rgb value = ca_texture_eval(&texture, 0, &surface);
                assert_near((double)value.r, 1.0 + x + 3.0 * y, 1e-5);
            }
    }
}

static void nearest_is_the_texel_around(void **state)
{
    (void)state;
    ca_image image;
    assert_int_equal(ca_image_create(&image, 5, 3, 3, NULL), CA_OK);
    fill_random(&image, 1);
    ca_test_random random = ca_test_random_seed(2);
    for (int w = 0; w < 4; ++w) {
        const ca_texture texture = bitmap(&image, CA_FILTER_NEAREST, WRAPS[w]);
        for (int i = 0; i < 20000; ++i) {
            const float u = uniform(&random, -4.0f, 4.0f), v = uniform(&random, -4.0f, 4.0f);
            const double x = (double)u * 5.0, y = (1.0 - (double)v) * 3.0;
            if (fabs(x - rint(x)) < 1e-4 || fabs(y - rint(y)) < 1e-4) continue; /* rounding decides there */
            const ca_surface surface = surface_at(u, v);
            const ca_rgb value = ca_texture_eval(&texture, 0, &surface);
            assert_true((double)value.r == oracle_texel(&texture, (int)floor(x), (int)floor(y), 0));
            assert_true((double)value.b == oracle_texel(&texture, (int)floor(x), (int)floor(y), 2));
        }
        const ca_surface tiny = surface_at(-1e-12f, 0.9f);
        const int left = WRAPS[w] == CA_WRAP_REPEAT ? 4 : WRAPS[w] == CA_WRAP_ZERO ? -1 : 0;
        assert_true((double)ca_texture_eval(&texture, 0, &tiny).r == oracle_texel(&texture, left, 0, 0));
    }
    ca_image_destroy(&image);
}

static void check_bilinear(uint32_t width, uint32_t height, uint32_t channels)
{
    ca_image image;
    assert_int_equal(ca_image_create(&image, width, height, channels, NULL), CA_OK);
    fill_random(&image, 100 * width + 10 * height + channels);
    ca_test_random random = ca_test_random_seed(3);
    for (int w = 0; w < 4; ++w) {
        ca_texture texture = bitmap(&image, CA_FILTER_BILINEAR, WRAPS[w]);
        for (int i = 0; i < 5000; ++i) {
            for (int r = 0; r < 2; ++r)
                for (int c = 0; c < 3; ++c) texture.to_uv[r][c] = uniform(&random, -1.5f, 1.5f);
            const float u = uniform(&random, -2.0f, 2.0f), v = uniform(&random, -2.0f, 2.0f);
            double tu, tv;
            oracle_uv(&texture, (double)u, (double)v, &tu, &tv);
            const ca_surface surface = surface_at(u, v);
            const ca_rgb value = ca_texture_eval(&texture, 0, &surface);
            assert_near((double)value.r, oracle_bilinear(&texture, tu, tv, 0), 1e-4);
            assert_near((double)value.g, oracle_bilinear(&texture, tu, tv, 1), 1e-4);
            assert_near((double)value.b, oracle_bilinear(&texture, tu, tv, 2), 1e-4);
        }
    }
    ca_image_destroy(&image);
}

static void bilinear_is_the_formula(void **state)
{
    (void)state;
    check_bilinear(7, 4, 3);
    check_bilinear(6, 5, 4);
    check_bilinear(3, 3, 2);
    check_bilinear(1, 1, 1);
    check_bilinear(1, 4, 3);
}

static double oracle_luminance(const ca_texture *texture, double u, double v)
{
    double tu, tv;
    oracle_uv(texture, u, v, &tu, &tv);
    return 0.2126 * oracle_bilinear(texture, tu, tv, 0) + 0.7152 * oracle_bilinear(texture, tu, tv, 1) +
           0.0722 * oracle_bilinear(texture, tu, tv, 2);
}

/* Central differences in double precision; a step that crosses a kink shows as a large second difference. */
static void gradient_is_the_slope(void **state)
{
    (void)state;
    ca_image image;
    assert_int_equal(ca_image_create(&image, 6, 9, 3, NULL), CA_OK);
    fill_random(&image, 4);
    ca_test_random random = ca_test_random_seed(5);
    int compared = 0;
    for (int i = 0; i < 9000; ++i) {
        ca_texture texture = bitmap(&image, CA_FILTER_BILINEAR, WRAPS[i % 4]);
        for (int r = 0; r < 2; ++r)
            for (int c = 0; c < 3; ++c) texture.to_uv[r][c] = uniform(&random, -1.5f, 1.5f);
        const double u = (double)uniform(&random, -1.0f, 1.0f), v = (double)uniform(&random, -1.0f, 1.0f), h = 1e-5;
        const double here = oracle_luminance(&texture, u, v);
        const double u0 = oracle_luminance(&texture, u - h, v), u1 = oracle_luminance(&texture, u + h, v);
        const double v0 = oracle_luminance(&texture, u, v - h), v1 = oracle_luminance(&texture, u, v + h);
        if (fabs(u0 + u1 - 2 * here) > 1e-8 || fabs(v0 + v1 - 2 * here) > 1e-8) continue;
        const ca_surface surface = surface_at((float)u, (float)v);
        const ca_vec2 gradient = ca_texture_gradient(&texture, 0, &surface);
        assert_near((double)gradient.x, (u1 - u0) / (2 * h), 1e-3);
        assert_near((double)gradient.y, (v1 - v0) / (2 * h), 1e-3);
        ++compared;
    }
    assert_true(compared > 8000);
    const ca_texture nearest = bitmap(&image, CA_FILTER_NEAREST, CA_WRAP_REPEAT);
    const ca_surface surface = surface_at(0.3f, 0.3f);
    assert_true(ca_texture_gradient(&nearest, 0, &surface).x == 0.0f);
    ca_image_destroy(&image);
}

/* The cosine to the line of the geometric normal, whichever its side; over all directions half on average. */
static void facing_is_a_cosine(void **state)
{
    (void)state;
    const ca_texture table[] = {{.kind = CA_TEXTURE_FACING, .as.facing = {.direction = {0.0f, 0.6f, 0.8f}}}};
    ca_surface surface = surface_at(0.3f, 0.4f);
    ca_test_random random = ca_test_random_seed(21);
    double sum = 0.0;
    for (int i = 0; i < 20000; i++) {
        const float z = uniform(&random, -1.0f, 1.0f), phi = uniform(&random, 0.0f, 6.2831853f);
        const float r = sqrtf(1.0f - z * z);
        surface.ng = (ca_vec3){r * cosf(phi), r * sinf(phi), z};
        const float value = ca_texture_eval_scalar(table, 0, &surface);
        assert_near((double)value, fabs(0.6 * (double)surface.ng.y + 0.8 * (double)z), 1e-6);
        assert_true(ca_texture_eval(table, 0, &surface).b == value && value <= ca_texture_max(table, 0));
        sum += (double)value;
    }
    assert_near(sum / 20000.0, (double)ca_texture_mean(table, 0).g, 0.01);
    assert_false(ca_texture_reads_uv(&table[0]));
    assert_true(ca_texture_gradient(table, 0, &surface).x == 0.0f);
}

static void wild_coordinates_stay_in_the_picture(void **state)
{
    (void)state;
    const float wild[] = {0.0f,    -0.0f,  1.0f,     -1.0f,     1e30f, -1e30f, INFINITY,
                          -INFINITY, NAN,  1e-40f,   -1e-40f,   16777217.5f, 2.0f, -2.0f};
    ca_image image;
    assert_int_equal(ca_image_create(&image, 13, 7, 1, NULL), CA_OK);
    fill_random(&image, 6);
    for (int w = 0; w < 8; ++w) {
        const ca_texture texture = bitmap(&image, w < 4 ? CA_FILTER_BILINEAR : CA_FILTER_NEAREST, WRAPS[w % 4]);
        for (size_t i = 0; i < sizeof wild / sizeof *wild; ++i)
            for (size_t j = 0; j < sizeof wild / sizeof *wild; ++j) {
                const ca_surface surface = surface_at(wild[i], wild[j]);
                const ca_rgb value = ca_texture_eval(&texture, 0, &surface);
                assert_true(value.r >= 0.0f && value.r <= 1.0f);
                const ca_vec2 gradient = ca_texture_gradient(&texture, 0, &surface);
                assert_true(isfinite(gradient.x) && isfinite(gradient.y));
            }
    }
    ca_image_destroy(&image);
}

static void checkerboard_alternates(void **state)
{
    (void)state;
    float data[] = {3.0f, 4.0f};
    const ca_image image = {.width = 2, .height = 1, .channels = 1, .data = data};
    ca_texture table[3] = {ca_texture_constant((ca_rgb){1.0f, 2.0f, 3.0f}),
                           bitmap(&image, CA_FILTER_NEAREST, CA_WRAP_REPEAT),
                           {.kind = CA_TEXTURE_CHECKERBOARD,
                            .to_uv = {{2.0f, 0.0f, 0.25f}, {0.0f, 3.0f, 0.0f}},
                            .as.checkerboard = {0, 1}}};
    ca_test_random random = ca_test_random_seed(7);
    for (int i = 0; i < 10000; ++i) {
        const float u = uniform(&random, -2.0f, 2.0f), v = uniform(&random, -2.0f, 2.0f);
        const int column = (int)floor(2.0 * (2.0 * (double)u + 0.25)), row = (int)floor(2.0 * 3.0 * (double)v);
        const ca_surface surface = surface_at(u, v);
        const float value = ca_texture_eval(table, 2, &surface).r;
        /* The coloured texture is looked up at the surface's own coordinates. */
        const float other = (double)u - floor((double)u) < 0.5 ? 3.0f : 4.0f;
        assert_true(value == (modulo(column + row, 2) == 0 ? 1.0f : other));
        /* As a number the two are exchanged. */
        const float number = modulo(column + row, 2) == 0 ? other : ca_luminance(table[0].as.constant);
        assert_near((double)ca_texture_eval_scalar(table, 2, &surface), (double)number, 1e-6);
    }
    assert_near((double)ca_texture_mean(table, 2).r, 0.5 * (1.0 + 3.5), 1e-6);
    assert_near((double)ca_texture_mean(table, 2).b, 0.5 * (3.0 + 3.5), 1e-6);
    assert_true(ca_texture_max(table, 2) == 4.0f);
    const ca_surface surface = surface_at(0.1f, 0.1f);
    assert_true(ca_texture_gradient(table, 2, &surface).y == 0.0f);
}

static ca_texture attribute_texture(const char *name)
{
    return (ca_texture){.kind = CA_TEXTURE_MESH_ATTRIBUTE, .as.mesh_attribute = {.name = name}};
}

/* The child's value times the factor, at coordinates that the scale may move; its slope is that of its values. */
static void scale_multiplies(void **state)
{
    (void)state;
    float texels[16];
    ca_image image = {.width = 4, .height = 4, .channels = 1, .data = texels};
    fill_random(&image, 5);
    ca_texture table[2] = {bitmap(&image, CA_FILTER_BILINEAR, CA_WRAP_REPEAT),
                           {.kind = CA_TEXTURE_SCALE,
                            .to_uv = {{1.0f, 0.0f, 0.25f}, {0.5f, -1.0f, 1.0f}},
                            .as.scale = {.child = 0, .factor = {2.0f, 2.0f, 2.0f}}}};
    ca_test_random random = ca_test_random_seed(9);
    int near_kinks = 0;
    for (int i = 0; i < 200; i++) {
        const float u = uniform(&random, -1.0f, 2.0f), v = uniform(&random, -1.0f, 2.0f), h = 1e-3f;
        const ca_surface here = surface_at(u, v), child = surface_at(u + 0.25f, 0.5f * u - v + 1.0f);
        const ca_surface right = surface_at(u + h, v), left = surface_at(u - h, v);
        const float value = ca_texture_eval_scalar(table, 1, &here);
        assert_near((double)value, 2.0 * (double)ca_texture_eval_scalar(table, 0, &child), 1e-5);
        const float slope =
            (ca_texture_eval_scalar(table, 1, &right) - ca_texture_eval_scalar(table, 1, &left)) / (2.0f * h);
        const double known = (double)ca_texture_gradient(table, 1, &here).x;
        near_kinks += fabs((double)slope - known) > 0.02;
    }
    assert_true(near_kinks <= 8); /* a difference over a kink of the patch is not its slope: 1.6 % of all */
    assert_near((double)ca_texture_mean(table, 1).g, 2.0 * (double)ca_texture_mean(table, 0).g, 1e-6);
    assert_near((double)ca_texture_max(table, 1), 2.0 * (double)ca_texture_max(table, 0), 1e-6);
}

/* Slopes of textures 3 and 4, which are made of pictures 0, 1 and 2, by differences. */
static void assert_slopes(const ca_texture *table, uint32_t id, const ca_surface *at)
{
    const float h = 1e-3f;
    const ca_surface right = surface_at(at->uv.x + h, at->uv.y), left = surface_at(at->uv.x - h, at->uv.y);
    const ca_surface above = surface_at(at->uv.x, at->uv.y + h), below = surface_at(at->uv.x, at->uv.y - h);
    const ca_vec2 known = ca_texture_gradient(table, id, at);
    const float x = ca_texture_eval_scalar(table, id, &right) - ca_texture_eval_scalar(table, id, &left);
    const float y = ca_texture_eval_scalar(table, id, &above) - ca_texture_eval_scalar(table, id, &below);
    assert_near((double)(x / (2.0f * h)), (double)known.x, 0.02);
    assert_near((double)(y / (2.0f * h)), (double)known.y, 0.02);
}

/* A product of two pictures and a mix of two by a third: values, slopes, and bounds that hold. */
static void textures_multiply_and_mix(void **state)
{
    (void)state;
    float texels[3][16];
    ca_image images[3];
    ca_texture table[5];
    for (int i = 0; i < 3; i++) {
        images[i] = (ca_image){.width = 4, .height = 4, .channels = 1, .data = texels[i]};
        fill_random(&images[i], (uint64_t)(20 + i));
        table[i] = bitmap(&images[i], CA_FILTER_BILINEAR, CA_WRAP_REPEAT);
    }
    table[3] = (ca_texture){.kind = CA_TEXTURE_SCALE,
                            .to_uv = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
                            .as.scale = {.child = 0, .factor = {2.0f, 2.0f, 2.0f}, .varies = true, .by = 1}};
    table[4] = (ca_texture){.kind = CA_TEXTURE_MIX, .as.mix = {.color0 = 0, .color1 = 3, .weight = 2}};
    ca_test_random random = ca_test_random_seed(9);
    for (int i = 0; i < 200; i++) {
        /* Away from kinks, which are at the texels' centres. */
        const float u = 0.25f * (float)(i % 4) + uniform(&random, 0.13f, 0.37f);
        const float v = 0.25f * (float)(i / 4 % 4) + uniform(&random, 0.13f, 0.37f);
        const ca_surface here = surface_at(u, v);
        double value[5];
        for (uint32_t k = 0; k < 5; k++) {
            value[k] = (double)ca_texture_eval_scalar(table, k, &here);
            assert_near((double)ca_texture_eval(table, k, &here).g, value[k], 1e-6);
            assert_true(value[k] <= (double)ca_texture_max(table, k) + 1e-6);
        }
        assert_near(value[3], 2.0 * value[0] * value[1], 1e-5);
        assert_near(value[4], (1.0 - value[2]) * value[0] + value[2] * value[3], 1e-5);
        assert_slopes(table, 3, &here);
        assert_slopes(table, 4, &here);
    }
    const double mean[3] = {(double)ca_texture_mean(table, 0).g, (double)ca_texture_mean(table, 1).g,
                            (double)ca_texture_mean(table, 2).g};
    assert_near((double)ca_texture_mean(table, 3).g, 2.0 * mean[0] * mean[1], 1e-6);
    assert_near((double)ca_texture_mean(table, 4).g,
                (1.0 - mean[2]) * mean[0] + mean[2] * 2.0 * mean[0] * mean[1], 1e-6);
}

/* A negative factor: no value by itself, but a height's slope, a part of a mix and a product of two. */
static void parts_keep_their_signs(void **state)
{
    (void)state;
    enum { NEGATIVE = 1, ONE, HALF, INVERSE, SQUARE, COUNT };
    const ca_rgb colour = {-0.5f, -0.25f, -0.125f};
    float texels[16];
    ca_image image = {.width = 4, .height = 4, .channels = 1, .data = texels};
    fill_random(&image, 31);
    ca_texture table[COUNT] = {
        [0] = bitmap(&image, CA_FILTER_BILINEAR, CA_WRAP_REPEAT),
        [NEGATIVE] = {.kind = CA_TEXTURE_SCALE,
                      .to_uv = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
                      .as.scale = {.child = 0, .factor = colour}},
        [ONE] = ca_texture_constant(ca_rgb_grey(1.0f)),
        [HALF] = ca_texture_constant(ca_rgb_grey(0.5f)),
        [INVERSE] = {.kind = CA_TEXTURE_MIX, .as.mix = {.color0 = ONE, .color1 = NEGATIVE, .weight = HALF}},
        [SQUARE] = {.kind = CA_TEXTURE_SCALE,
                    .to_uv = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
                    .as.scale = {.child = NEGATIVE, .factor = {1.0f, 1.0f, 1.0f}, .varies = true, .by = NEGATIVE}},
    };
    const double factor = (double)ca_texture_scalar_of(colour);
    const double mean = (double)ca_texture_mean(table, 0).g;
    for (int i = 0; i < 16; i++) {
        const ca_surface here = surface_at(0.25f * (float)(i % 4) + 0.2f, 0.25f * (float)(i / 4) + 0.3f);
        const double value = (double)ca_texture_eval_scalar(table, 0, &here);
        const ca_vec2 slope = ca_texture_gradient(table, 0, &here);
        assert_true(ca_texture_eval_scalar(table, NEGATIVE, &here) == 0.0f);
        assert_true(ca_texture_eval(table, NEGATIVE, &here).r == 0.0f);
        assert_near((double)ca_texture_gradient(table, NEGATIVE, &here).x, factor * (double)slope.x, 1e-5);
        assert_near((double)ca_texture_eval(table, INVERSE, &here).r, 0.5 - 0.25 * value, 1e-6);
        assert_near((double)ca_texture_eval(table, INVERSE, &here).b, 0.5 - 0.0625 * value, 1e-6);
        assert_near((double)ca_texture_eval_scalar(table, INVERSE, &here), 0.5 + 0.5 * factor * value, 1e-6);
        assert_near((double)ca_texture_eval(table, SQUARE, &here).g, 0.0625 * value * value, 1e-6);
        assert_near((double)ca_texture_eval_scalar(table, SQUARE, &here), factor * factor * value * value, 1e-6);
        assert_slopes(table, INVERSE, &here);
        assert_slopes(table, SQUARE, &here);
        assert_true(0.25 * value * value <= (double)ca_texture_max(table, SQUARE));
    }
    assert_true(ca_texture_mean(table, NEGATIVE).r == 0.0f);
    assert_near((double)ca_texture_mean(table, INVERSE).r, 0.5 - 0.25 * mean, 1e-6);
    assert_near((double)ca_texture_max(table, NEGATIVE), 0.5 * (double)ca_texture_max(table, 0), 1e-6);
}

/* Of colours and of numbers, with their slope; what is under 0 counts as 0. */
static void power_raises(void **state)
{
    (void)state;
    float texels[16];
    ca_image image = {.width = 4, .height = 4, .channels = 1, .data = texels};
    fill_random(&image, 12);
    ca_texture table[4] = {bitmap(&image, CA_FILTER_BILINEAR, CA_WRAP_REPEAT),
                           {.kind = CA_TEXTURE_POWER, .as.power = {.child = 0, .exponent = 0.5f}},
                           ca_texture_constant((ca_rgb){0.04f, 0.09f, -0.16f}),
                           {.kind = CA_TEXTURE_POWER, .as.power = {.child = 2, .exponent = 0.5f}}};
    for (int i = 0; i < 16; i++) {
        const ca_surface here = surface_at(0.25f * (float)(i % 4) + 0.2f, 0.25f * (float)(i / 4) + 0.3f);
        const double value = (double)ca_texture_eval_scalar(table, 0, &here);
        assert_near((double)ca_texture_eval_scalar(table, 1, &here), sqrt(value), 1e-6);
        assert_near((double)ca_texture_eval(table, 1, &here).b, sqrt(value), 1e-6);
        assert_slopes(table, 1, &here);
        assert_true(sqrt(value) <= (double)ca_texture_max(table, 1));
    }
    const ca_surface here = surface_at(0.0f, 0.0f);
    const ca_rgb roots = ca_texture_eval(table, 3, &here), mean = ca_texture_mean(table, 3);
    assert_near((double)roots.r, 0.2, 1e-6);
    assert_near((double)roots.g, 0.3, 1e-6);
    assert_true(roots.b == 0.0f && mean.b == 0.0f);
    assert_near((double)mean.g, 0.3, 1e-6);
    table[2] = ca_texture_constant(ca_rgb_grey(0.0f));
    assert_true(ca_texture_gradient(table, 3, &here).x == 0.0f);
}

/* What is over 1 is 1, each component by itself, and has no slope. */
static void clamp_cuts(void **state)
{
    (void)state;
    float texels[16];
    ca_image image = {.width = 4, .height = 4, .channels = 1, .data = texels};
    fill_random(&image, 12);
    ca_texture table[4] = {bitmap(&image, CA_FILTER_BILINEAR, CA_WRAP_REPEAT),
                           {.kind = CA_TEXTURE_SCALE,
                            .to_uv = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
                            .as.scale = {.child = 0, .factor = {1.0f, 2.0f, 3.0f}}},
                           {.kind = CA_TEXTURE_CLAMP, .as.clamp = {.child = 1}},
                           {.kind = CA_TEXTURE_CLAMP, .as.clamp = {.child = 0}}};
    int cut = 0;
    for (int i = 0; i < 16; i++) {
        const ca_surface here = surface_at(0.25f * (float)(i % 4) + 0.2f, 0.25f * (float)(i / 4) + 0.3f);
        const float value = ca_texture_eval_scalar(table, 0, &here);
        const float luminous = ca_texture_eval_scalar(table, 1, &here);
        const ca_rgb colour = ca_texture_eval(table, 2, &here);
        const ca_vec2 slope = ca_texture_gradient(table, 1, &here);
        assert_near((double)colour.r, fmin((double)value, 1.0), 1e-6);
        assert_near((double)colour.g, fmin(2.0 * (double)value, 1.0), 1e-6);
        assert_near((double)colour.b, fmin(3.0 * (double)value, 1.0), 1e-6);
        assert_near((double)ca_texture_eval_scalar(table, 2, &here), fmin((double)luminous, 1.0), 1e-6);
        cut += luminous > 1.0f;
        assert_near((double)ca_texture_gradient(table, 2, &here).y, luminous > 1.0f ? 0.0 : (double)slope.y, 0.0);
    }
    assert_in_range(cut, 3, 13);
    assert_true(ca_texture_max(table, 2) == 1.0f && ca_texture_max(table, 3) <= 1.0f);
    assert_true(ca_texture_mean(table, 2).b == 1.0f && ca_texture_mean(table, 2).r < 1.0f);
}

static void assert_mapped(ca_texture_mapping mapping, ca_vec3 q, double s, double t)
{
    const ca_vec2 st = ca_texture_mapping_at(mapping, q);
    assert_near((double)st.x, s, 1e-6);
    assert_near((double)st.y, t, 1e-6);
}

static void mappings_of_known_points(void **state)
{
    (void)state;
    assert_mapped(CA_MAPPING_PLANAR, (ca_vec3){0.2f, -3.0f, 5.0f}, 0.2, -3.0);
    assert_mapped(CA_MAPPING_CYLINDRICAL, (ca_vec3){2.0f, 0.0f, 0.3f}, 0.5, 0.3);
    assert_mapped(CA_MAPPING_CYLINDRICAL, (ca_vec3){0.0f, 1.0f, -7.0f}, 0.75, -7.0);
    assert_mapped(CA_MAPPING_CYLINDRICAL, (ca_vec3){0.0f, -1.0f, 0.0f}, 0.25, 0.0);
    assert_mapped(CA_MAPPING_SPHERICAL, (ca_vec3){3.0f, 0.0f, 0.0f}, 0.5, 0.0);
    assert_mapped(CA_MAPPING_SPHERICAL, (ca_vec3){0.0f, 2.0f, 0.0f}, 0.5, 0.25);
    assert_mapped(CA_MAPPING_SPHERICAL, (ca_vec3){0.0f, -2.0f, 2.0f}, 0.25, 0.75);
    assert_mapped(CA_MAPPING_SPHERICAL, (ca_vec3){0.0f, 0.0f, -1.0f}, 1.0, 0.0);
}

/* A bent patch over the unit square, far from the axis of the mappings. */
static ca_surface patch_at(float u, float v)
{
    ca_surface surface = surface_at(u, v);
    surface.position = (ca_vec3){1.0f + 0.5f * u, 0.7f - 0.2f * u + 0.4f * v, 0.3f + u * v};
    surface.dpdu = (ca_vec3){0.5f, -0.2f, v};
    surface.dpdv = (ca_vec3){0.0f, 0.4f, u};
    return surface;
}

/* The child where the mapping says, with the slope of that, under a transform that turns and stretches. */
static void mapped_by_position(void **state)
{
    (void)state;
    static const float to_texture[3][4] = {
        {1.2f, 0.3f, -0.2f, 0.1f}, {-0.4f, 0.9f, 0.5f, 0.2f}, {0.1f, -0.6f, 1.1f, -0.3f}};
    float texels[16];
    ca_image image = {.width = 4, .height = 4, .channels = 1, .data = texels};
    fill_random(&image, 8);
    ca_texture table[2] = {bitmap(&image, CA_FILTER_BILINEAR, CA_WRAP_REPEAT), {.kind = CA_TEXTURE_MAPPED}};
    memcpy(table[1].as.mapped.to_texture, to_texture, sizeof to_texture);
    const float h = 1e-3f;
    int near_kinks = 0;
    for (int i = 0; i < 300; i++) {
        table[1].as.mapped.mapping = (ca_texture_mapping)(i % 3);
        const float u = 0.07f + 0.09f * (float)(i / 3 % 10), v = 0.07f + 0.09f * (float)(i / 30);
        const ca_surface here = patch_at(u, v), right = patch_at(u + h, v), left = patch_at(u - h, v);
        const ca_surface above = patch_at(u, v + h), below = patch_at(u, v - h);
        const ca_vec3 q = ca_map_point(to_texture, here.position);
        const ca_vec2 st = ca_texture_mapping_at((ca_texture_mapping)(i % 3), q);
        const ca_surface child = surface_at(st.x, st.y);
        assert_near((double)ca_texture_eval(table, 1, &here).g, (double)ca_texture_eval(table, 0, &child).g, 1e-6);
        const ca_vec2 known = ca_texture_gradient(table, 1, &here);
        const float x = ca_texture_eval_scalar(table, 1, &right) - ca_texture_eval_scalar(table, 1, &left);
        const float y = ca_texture_eval_scalar(table, 1, &above) - ca_texture_eval_scalar(table, 1, &below);
        near_kinks += fabsf(x / (2.0f * h) - known.x) > 0.02f || fabsf(y / (2.0f * h) - known.y) > 0.02f;
    }
    assert_true(near_kinks <= 12); /* a difference over a kink of the patch is not its slope */
    assert_true(ca_texture_max(table, 1) == ca_texture_max(table, 0));
    assert_true(ca_texture_mean(table, 1).r == ca_texture_mean(table, 0).r);
}

/* As a number a checkerboard has its colours exchanged, also where it is scaled or a weight. */
static void numbers_are_made_of_numbers(void **state)
{
    (void)state;
    ca_texture table[7] = {ca_texture_constant(ca_rgb_grey(0.25f)), ca_texture_constant(ca_rgb_grey(1.0f)),
                           {.kind = CA_TEXTURE_CHECKERBOARD,
                            .to_uv = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
                            .as.checkerboard = {.color0 = 0, .color1 = 1}},
                           {.kind = CA_TEXTURE_SCALE,
                            .to_uv = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
                            .as.scale = {.child = 2, .factor = {3.0f, 3.0f, 3.0f}}},
                           {.kind = CA_TEXTURE_MIX, .as.mix = {.color0 = 0, .color1 = 1, .weight = 2}},
                           {.kind = CA_TEXTURE_MIX, .as.mix = {.color0 = 1, .color1 = 1, .weight = 3}},
                           {.kind = CA_TEXTURE_MIX, .as.mix = {.color0 = 2, .color1 = 2, .weight = 0}}};
    const ca_surface here = surface_at(0.2f, 0.3f);
    assert_near((double)ca_texture_eval(table, 2, &here).g, 0.25, 0.0);
    assert_near((double)ca_texture_eval(table, 3, &here).g, 0.75, 1e-7);
    assert_near((double)ca_texture_eval_scalar(table, 3, &here), 3.0, 1e-7);
    assert_near((double)ca_texture_eval(table, 4, &here).g, 1.0, 1e-7);
    assert_near((double)ca_texture_max(table, 5), 3.0, 1e-6); /* weights above 1 */
    assert_near((double)ca_texture_eval(table, 6, &here).g, 0.25, 1e-7);
    assert_near((double)ca_texture_eval_scalar(table, 6, &here), 1.0, 1e-7);
    table[1] = ca_texture_constant(ca_rgb_grey(0.0f));
    table[4].as.mix.weight = 3; /* exchanged: 0 here, and 0.75 in other fields */
    assert_near((double)ca_texture_eval(table, 4, &here).g, 0.25, 1e-7);
}

static void mesh_attributes_are_interpolated(void **state)
{
    (void)state;
    ca_mesh mesh;
    assert_int_equal(ca_mesh_create(&mesh, 4, 2, false, false, NULL), CA_OK);
    const uint32_t indices[] = {0, 1, 2, 2, 1, 3};
    for (int i = 0; i < 6; ++i) mesh.indices[i] = indices[i];
    float *color, *grey, *face;
    assert_int_equal(ca_mesh_add_attribute(&mesh, "vertex_color", 3, false, &color, NULL), CA_OK);
    assert_int_equal(ca_mesh_add_attribute(&mesh, "vertex_grey", 1, false, &grey, NULL), CA_OK);
    assert_int_equal(ca_mesh_add_attribute(&mesh, "face_color", 4, true, &face, NULL), CA_OK);
    /* The pointers of earlier attributes stay: each has its own array. */
    for (int i = 0; i < 12; ++i) color[i] = (float)(i * i);
    for (int i = 0; i < 4; ++i) grey[i] = (float)i;
    for (int i = 0; i < 8; ++i) face[i] = (float)i;
    const ca_texture table[] = {attribute_texture("vertex_color"), attribute_texture("vertex_grey"),
                                attribute_texture("face_color"), attribute_texture("vertex_other")};
    ca_surface surface = {.mesh = &mesh, .primitive = 1, .barycentric = {0.25f, 0.375f}};
    /* corners 2, 1, 3 with weights 0.375, 0.25, 0.375 */
    const ca_rgb value = ca_texture_eval(table, 0, &surface);
    assert_near((double)value.r, 0.375 * 36 + 0.25 * 9 + 0.375 * 81, 1e-4);
    assert_near((double)value.b, 0.375 * 64 + 0.25 * 25 + 0.375 * 121, 1e-4);
    assert_near((double)ca_texture_eval_scalar(table, 1, &surface), 0.375 * 2 + 0.25 * 1 + 0.375 * 3, 1e-6);
    assert_true(ca_texture_eval(table, 2, &surface).g == 5.0f);
    assert_true(ca_rgb_is_black(ca_texture_eval(table, 3, &surface)));
    surface.mesh = NULL;
    assert_true(ca_rgb_is_black(ca_texture_eval(table, 0, &surface)));
    assert_true(ca_texture_mean(table, 0).r == 1.0f && ca_texture_max(table, 0) == 1.0f);
    ca_mesh_destroy(&mesh);
}

static void mean_and_max_of_a_bitmap(void **state)
{
    (void)state;
    float data[] = {1.0f, 2.0f, 3.0f, 9.0f, 5.0f, 6.0f, 7.0f, 99.0f}; /* the alphas do not count */
    const ca_image image = {.width = 1, .height = 2, .channels = 4, .data = data};
    const ca_texture texture = bitmap(&image, CA_FILTER_BILINEAR, CA_WRAP_REPEAT);
    const ca_rgb mean = ca_texture_mean(&texture, 0);
    assert_true(mean.r == 3.0f && mean.g == 4.0f && mean.b == 5.0f);
    assert_true(ca_texture_max(&texture, 0) == 7.0f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(constant_is_itself),
        cmocka_unit_test(bitmap_stands_upright),
        cmocka_unit_test(nearest_is_the_texel_around),
        cmocka_unit_test(bilinear_is_the_formula),
        cmocka_unit_test(gradient_is_the_slope),
        cmocka_unit_test(facing_is_a_cosine),
        cmocka_unit_test(wild_coordinates_stay_in_the_picture),
        cmocka_unit_test(checkerboard_alternates),
        cmocka_unit_test(scale_multiplies),
        cmocka_unit_test(textures_multiply_and_mix),
        cmocka_unit_test(parts_keep_their_signs),
        cmocka_unit_test(power_raises),
        cmocka_unit_test(clamp_cuts),
        cmocka_unit_test(mappings_of_known_points),
        cmocka_unit_test(mapped_by_position),
        cmocka_unit_test(numbers_are_made_of_numbers),
        cmocka_unit_test(mesh_attributes_are_interpolated),
        cmocka_unit_test(mean_and_max_of_a_bitmap),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
