/* Metrics that look at neighbourhoods, SSIM and FLIP (ssim.h, flip.h), and all metrics as maps.
 *
 * Filters see the whole picture; averages are over the pixels that count: those of the region that no mask covers and
 * that are finite in both pictures. SSIM's average leaves out pixels nearer than half a window to the picture's
 * border. What is not finite in one picture takes the other's value in both (black where neither is finite), so that
 * it adds no difference to its neighbours.
 *
 * SSIM is that of the signal of a display, FLIP LDR that of its light, under one tone curve and exposure; FLIP HDR
 * has its own tone curve and exposures.
 *
 * Layers of the maps, over the whole picture, NAN where a pixel is not finite:
 *     Difference.R .G .B                     image minus reference
 *     Error.RMSE .MAE .relMSE .SMAPE         of the pixel's three channels; the picture's number is their mean, for
 * RMSE the root of the mean of their squares SSIM, FLIP.LDR, FLIP.HDR               their means are the numbers
 *     FLIP.Exposure                          at which FLIP.HDR was found, in stops */
#ifndef CA_METRICS_IMAGE_METRICS_H
#define CA_METRICS_IMAGE_METRICS_H

#include "metrics/compare.h"
#include "metrics/flip.h"
#include "metrics/ssim.h"

typedef struct ca_metric_settings {
    ca_tone_curve tone; /* for SSIM and FLIP LDR */
    double exposure;    /* stops */
    ca_ssim_settings ssim;
    bool flip_ldr, flip_hdr; /* which to compute */
    double pixels_per_degree;
    ca_tone_curve flip_tone;          /* for FLIP HDR; not CA_TONE_LINEAR */
    ca_flip_exposures flip_exposures; /* NAN, NAN, 0: chosen from the reference */
    uint32_t threads;                 /* at least 1 */
} ca_metric_settings;

/* srgb at exposure 0, SSIM's and FLIP's own defaults, both FLIPs, aces, one thread. */
ca_metric_settings ca_metric_defaults(void);

typedef struct ca_image_metrics {
    double ssim;               /* NAN: no window fits around any pixel that counts */
    double flip_ldr, flip_hdr; /* NAN: not computed */
    ca_flip_exposures exposures; /* of FLIP HDR; count 0: not asked for, or the reference is too dark */
} ca_image_metrics;

/* `maps` NULL: none are made. Errors: CA_ERROR_ARGUMENT (those of ca_compare, ca_ssim_map, ca_flip_create,
 * ca_flip_choose_exposures; no pixel counts), CA_ERROR_MEMORY. The result does not depend on the number of threads.
 * Cost: some tenths of a second for each million pixels and exposure. Memory: about 80 bytes a pixel, 120 with
 * maps. */
ca_status ca_measure_image(const ca_image_layers *image, const ca_image_layers *reference,
                           const ca_compare_settings *region, const ca_metric_settings *settings,
                           ca_image_metrics *metrics, ca_image_layers **maps, ca_error *error);

#endif
