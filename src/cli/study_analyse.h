/* What the answers of a study say: how many saw a difference in each scenario, and whether occluded lights make a
 * difference be seen more often. Counted are the finished sessions; in them, of each scenario the answers that are
 * not left out. */
#ifndef CA_CLI_STUDY_ANALYSE_H
#define CA_CLI_STUDY_ANALYSE_H

#include "cli/study_answers.h"

#define CA_STUDY_ALPHA 0.05

/* Of one scenario. */
typedef struct ca_study_ratio {
    uint32_t yes, total, left_out;
    double ratio;     /* NAN of a total of 0 */
    double low, high; /* interval of Clopper and Pearson */
} ca_study_ratio;

/* Two scenarios of a pair, subject by subject: McNemar's table and its exact test. */
typedef struct ca_study_pair {
    const char *name;
    uint32_t visible, occluded; /* scenarios */
    uint32_t both, neither, only_occluded, only_visible;
    double two_sided, more; /* p; `more`: that so many more see it with an occluded light only by chance */
} ca_study_pair;

typedef struct ca_study_analysis {
    const ca_study_answers *answers; /* borrowed */
    uint32_t subjects, unfinished, left_out;
    ca_study_ratio *ratios; /* owned; by scenario */
    ca_study_pair *pairs;   /* owned */
    uint32_t pair_count;
    /* Over all pairs: subjects who saw a difference in more, in fewer, in as many scenarios with an occluded light;
     * sign test. */
    uint32_t saw_more, saw_fewer, saw_as_many;
    double two_sided, more;
} ca_study_analysis;

/* Errors: CA_ERROR_FORMAT (no finished session), CA_ERROR_MEMORY. */
ca_status ca_study_analyse(const ca_study_answers *answers, ca_study_analysis *analysis, ca_error *error);
/* Also of an analysis that is all zeros. */
void ca_study_analysis_destroy(ca_study_analysis *analysis);

/* To standard output. */
void ca_study_print(const ca_study_analysis *analysis);
/* As a JSON file, complete or not at all. */
ca_status ca_study_write_json(const char *path, const ca_study_analysis *analysis, ca_error *error);

#endif
