/* Pairs of pictures by formula, and what independent implementations say of them: SSIM by scikit-image 0.26.0
 * (structural_similarity, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1,
 * channel_axis=2, on sRGB signals of the clipped values), FLIP by flip-evaluator 1.7 (inputsRGB=False).
 * `scripts/check-metrics.py recorded` has the same formulas and prints the numbers. */
#ifndef CA_TEST_METRIC_PICTURES_H
#define CA_TEST_METRIC_PICTURES_H

#include "metrics/image_metrics.h"

enum { PAIR_WIDTH = 64, PAIR_HEIGHT = 48, PAIR_PIXELS = PAIR_WIDTH * PAIR_HEIGHT };

typedef enum pair_kind {
    PAIR_NOISE,   /* an eighth of noise */
    PAIR_SHIFT,   /* by a pixel */
    PAIR_COLOURS, /* exchanged */
    PAIR_FIREFLY, /* one pixel of 50 */
    PAIR_BRIGHT,  /* noisy, over 2^8 */
    PAIR_KINDS,
} pair_kind;

/* Where the recorded maps were looked at. */
enum { SPOTS = 3 };
extern const uint32_t pair_spots[SPOTS][2];

typedef struct recorded_pair {
    const char *name;
    double ssim, flip_ldr, flip_hdr;
    double ssim_at[SPOTS], flip_ldr_at[SPOTS], flip_hdr_at[SPOTS];
    ca_flip_exposures exposures;
} recorded_pair;

extern const recorded_pair recorded_pairs[PAIR_KINDS];

/* R G B layers, the caller's to destroy; both fail the test on errors. */
ca_image_layers *metric_picture(uint32_t width, uint32_t height);
void make_pair(pair_kind kind, ca_image_layers **image, ca_image_layers **reference);

void fill_metric_picture(ca_image_layers *picture, float r, float g, float b);

/* ca_measure_image of the whole picture, with all maps; fails the test on errors. */
ca_image_metrics measure_pair(const ca_image_layers *image, const ca_image_layers *reference,
                              const ca_metric_settings *settings, ca_image_layers **maps);

void assert_near(const char *what, double value, double expected, double tolerance);

#endif
