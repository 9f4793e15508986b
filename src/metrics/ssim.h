/* Structural similarity (Wang, Bovik, Sheikh and Simoncelli 2004, "Image quality assessment: from error visibility to
 * structural similarity", equation 13), as scikit-image's structural_similarity computes it with
 * gaussian_weights=True, use_sample_covariance=False and a channel axis (skimage/metrics/_structural_similarity.py).
 *
 * Per channel and pixel, with means m, variances v and the covariance c of both pictures in a Gaussian window around
 * it: (2 m_a m_b + C1) (2 c + C2) / ((m_a^2 + m_b^2 + C1) (v_a + v_b + C2)),  C1 = (k1 range)^2,  C2 = (k2 range)^2
 * averaged over the channels. 1 where the windows are equal. Near the border the window sees the picture mirrored;
 * means over a picture leave these pixels out: use only those at least window / 2 pixels from the border. */
#ifndef CA_METRICS_SSIM_H
#define CA_METRICS_SSIM_H

#include "base/parallel.h"
#include "base/status.h"

typedef struct ca_ssim_settings {
    uint32_t window; /* side in pixels, odd */
    double sigma;    /* of the Gaussian, in pixels */
    double range;    /* of the values: largest minus smallest */
    double k1, k2;
} ca_ssim_settings;

#define CA_SSIM_DEFAULTS ((ca_ssim_settings){.window = 11, .sigma = 1.5, .range = 1.0, .k1 = 0.01, .k2 = 0.03})

/* Finite planes of width * height values, borrowed. */
typedef struct ca_ssim_pictures {
    const float *a[3], *b[3];
    uint32_t width, height;
} ca_ssim_pictures;

/* Fills the map, width * height values. Errors: CA_ERROR_ARGUMENT (an even window), CA_ERROR_MEMORY. Threads:
 * parallel; the map does not depend on their number. Cost: about 330 multiplications a pixel for the default
 * window. */
ca_status ca_ssim_map(const ca_ssim_pictures *pictures, const ca_ssim_settings *settings, const ca_parallel *parallel,
                      float *map, ca_error *error);

#endif
