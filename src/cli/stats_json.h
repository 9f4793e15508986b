/* The numbers of a command as a JSON file (--stats), complete or not at all. */
#ifndef CA_CLI_STATS_JSON_H
#define CA_CLI_STATS_JSON_H

#include "film/pass_part.h"
#include "metrics/compare.h"
#include "metrics/image_metrics.h"

/* How the image was made, as its attributes say (settings_json.h), and the statistics; `non_finite` counts samples by
 * technique, `notes` are those of the scene. null: not known, as are the settings where there is no image (NULL).
 * `ranges`: of passes with gaps between them, in order; 0 of them: there are no gaps. */
ca_status ca_stats_write_render(const char *path, const ca_image_layers *image,
                                const ca_render_statistics *statistics, const ca_pass_range *ranges,
                                size_t range_count, ca_error *error);

/* One picture that was compared with the reference. */
typedef struct ca_compared_image {
    const char *path;
    ca_comparison comparison;
    ca_image_metrics metrics;
    bool flip_is_hdr; /* which FLIP is the one for this picture */
    bool same_seed;   /* as the reference's: their noise may not be independent */
    double seed;
} ca_compared_image;

/* What the law of noise says for numbers of paths, averaged over the image and over a region of interest. */
typedef struct ca_noise_prediction {
    uint32_t light_paths, camera_paths;
    ca_noise_summary image, roi;
} ca_noise_prediction;

typedef struct ca_noise_report {
    ca_render_statistics statistics;
    bool has_roi;
    uint32_t roi[4];
    ca_noise_prediction measured;     /* for the numbers of paths that the iterations had */
    ca_noise_prediction *predictions; /* for others */
    size_t prediction_count;
    bool connects; /* with a term of connections, and no recommendation */
    const char *objective; /* NULL: mean */
    ca_noise_recommendation recommendation; /* none where it was interrupted or there is no noise */
} ca_noise_report;

/* Is there a recommendation? */
static inline bool ca_noise_recommends(const ca_noise_report *report)
{
    return report->recommendation.best.light_paths > 0;
}

/* Is a number of camera paths recommended for each pixel? Where paths connect, and where one is all there is, it is
 * the same for all. */
static inline bool ca_noise_has_map(const ca_noise_report *report)
{
    return !report->connects && !report->recommendation.light_paths_only;
}

/* Is a time more than its standard error? Else the noise of the measurement is all that it tells. False of NAN. */
static inline bool ca_noise_is_measured(double seconds, double standard_error) { return seconds > standard_error; }

/* What ca_stats_write_render writes (`interrupted`: the measurement or the timing of paths), the averages, times and
 * recommended numbers; null where there are none. */
ca_status ca_stats_write_noise(const char *path, const ca_image_layers *image, const ca_noise_report *report,
                               ca_error *error);

/* `images[]`, each with its metrics (`flip` is flip_hdr or flip_ldr), and the `settings` that the metrics were
 * computed with. */
ca_status ca_stats_write_compare(const char *path, const char *reference, const ca_metric_settings *settings,
                                 const ca_compared_image *images, size_t count, ca_error *error);

#endif
