#include "support/metric_pictures.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

const uint32_t pair_spots[SPOTS][2] = {{0, 0}, {20, 17}, {41, 30}};

const recorded_pair recorded_pairs[PAIR_KINDS] = {
    {"noise", 0.79873319, 0.20015798, 0.22776769,
     {0.2488780, 0.7618132, 0.8409934}, {0.5448992, 0.1366816, 0.1123476}, {0.9154844, 0.1300958, 0.0893203},
     {1.1497953, 2.0780637, 2}},
    {"shift", 0.88851141, 0.11480602, 0.09236817,
     {0.8885222, 0.9583871, 0.9013369}, {0.1143011, 0.0783581, 0.0972212}, {0.1574925, 0.0650800, 0.0613998},
     {1.1497953, 2.0780637, 2}},
    {"colours", 0.19498910, 0.84448213, 0.72441691,
     {0.0368273, 0.1092297, 0.2431607}, {0.9653939, 0.5991343, 0.8955631}, {0.9885377, 0.4767133, 0.7422913},
     {1.1497953, 2.0780637, 2}},
    {"firefly", 0.99049162, 0.00128352, 0.00095538,
     {1.0000000, 0.3397749, 1.0000000}, {0.0000000, 0.2681623, 0.0000000}, {0.0000000, 0.1918737, 0.0000000},
     {1.1497953, 2.0780637, 2}},
    {"bright", 0.79136050, 0.12898502, 0.15639265,
     {0.8966501, 0.6864565, 0.8225812}, {0.0150764, 0.0982313, 0.0831850}, {0.0357393, 0.2241009, 0.1676629},
     {-2.8155882, 2.5418394, 6}},
};

/* In [0, 1], different from pixel to pixel. */
static double hashed(uint32_t x, uint32_t y, uint32_t c)
{
    uint32_t h = x * 73856093u ^ y * 19349663u ^ c * 83492791u;
    h ^= h >> 13;
    h *= 1540483477u;
    h ^= h >> 15;
    return (h & 1023u) / 1023.0;
}

static double base(uint32_t x, uint32_t y, uint32_t c)
{
    if (c == 0) return x / 63.0;
    if (c == 1) return y / 47.0;
    return (x / 8 + y / 8) % 2 == 1 ? 0.75 : 0.25;
}

static double reference_value(pair_kind kind, uint32_t x, uint32_t y, uint32_t c)
{
    const double b = base(x, y, c);
    return kind == PAIR_BRIGHT ? ldexp(b * b, (int)(x / 8) - 3) : b;
}

static double image_value(pair_kind kind, uint32_t x, uint32_t y, uint32_t c)
{
    const double r = reference_value(kind, x, y, c);
    switch (kind) {
    case PAIR_NOISE: return 0.875 * r + 0.125 * hashed(x, y, c);
    case PAIR_SHIFT: return base(x < 63 ? x + 1 : 63, y, c);
    case PAIR_COLOURS: return base(x, y, (c + 1) % 3);
    case PAIR_FIREFLY: return x == 20 && y == 17 ? 50.0 : r;
    default: return r * (0.5 + hashed(x, y, c));
    }
}

ca_image_layers *metric_picture(uint32_t width, uint32_t height)
{
    static const char *const names[3] = {"R", "G", "B"};
    ca_image_layers *layers = NULL;
    assert_int_equal(ca_layers_create(&layers, width, height, NULL), CA_OK);
    for (int c = 0; c < 3; c++) {
        float *data = NULL;
        assert_int_equal(ca_layers_add(layers, names[c], &data, NULL), CA_OK);
    }
    return layers;
}

void make_pair(pair_kind kind, ca_image_layers **image, ca_image_layers **reference)
{
    *image = metric_picture(PAIR_WIDTH, PAIR_HEIGHT);
    *reference = metric_picture(PAIR_WIDTH, PAIR_HEIGHT);
    for (uint32_t c = 0; c < 3; c++)
        for (uint32_t i = 0; i < PAIR_PIXELS; i++) {
            const uint32_t x = i % PAIR_WIDTH, y = i / PAIR_WIDTH;
            (*image)->channels[c].data[i] = (float)image_value(kind, x, y, c);
            (*reference)->channels[c].data[i] = (float)reference_value(kind, x, y, c);
        }
}

void fill_metric_picture(ca_image_layers *picture, float r, float g, float b)
{
    const float values[3] = {r, g, b};
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < (size_t)picture->width * picture->height; i++)
            picture->channels[c].data[i] = values[c];
}

ca_image_metrics measure_pair(const ca_image_layers *image, const ca_image_layers *reference,
                              const ca_metric_settings *settings, ca_image_layers **maps)
{
    ca_image_metrics metrics;
    ca_error error = {""};
    const ca_compare_settings whole = {0};
    if (ca_measure_image(image, reference, &whole, settings, &metrics, maps, &error) != CA_OK)
        fail_msg("%s", error.message);
    return metrics;
}

void assert_near(const char *what, double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%s is %.9g, not %.9g +- %.2g", what, value, expected, tolerance);
}
