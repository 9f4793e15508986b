/* Do two integrators make the same picture? Block-wise tests of the means with the noise that repeated renders have,
 * corrected for the number of blocks and channels, and with the bias of the whole picture that they would have shown.
 *
 * One comparison of twenty looks suspicious (p < 5 %) by chance. Such a one is made again, with other seeds and four
 * times the samples, and then counts as failed below a p-value at which all comparisons together have one false alarm
 * or more in 1 % of runs. */
#ifndef CA_TEST_AGREEMENT_H
#define CA_TEST_AGREEMENT_H

#include "support/agreement_scenes.h"

#include <stdint.h>

typedef struct agreement_settings {
    const char *const
        *integrators; /* those to compare with the reference; NULL ends. "%g" stands for the scene's radius */
    bool (*wanted)(const agreement_scene *scene);
    double target;        /* a bias to detect: each picture gets as many samples as that needs, judging by a pilot */
    uint32_t max_samples; /* but no more than this per pixel, at the first look */
} agreement_settings;

/* What has come of all comparisons. */
typedef struct agreement_result {
    uint32_t comparisons, skipped; /* skipped: the integrator cannot find all light of the scene */
    uint32_t suspicious;           /* at the first look */
    uint32_t failed;               /* at the second too */
    double largest_detectable;     /* relative bias that a first look shows with 80 % probability; worst of all */
} agreement_result;

/* Compares on one scene, with a line for each comparison. Adds to the result. */
void compare_integrators(const agreement_scene *scene, const agreement_settings *settings, agreement_result *result);

/* Probability of `suspicious` or more where nothing differs. */
double suspicious_p_value(const agreement_result *result);

#endif
