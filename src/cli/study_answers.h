/* Answers of a study as its page exports them (docs/study.md): files of one study, put together. A session that
 * stands in several files counts once; a subject takes part once. */
#ifndef CA_CLI_STUDY_ANSWERS_H
#define CA_CLI_STUDY_ANSWERS_H

#include "cli/study_config.h"

/* A subject's answer to a scenario. */
typedef enum ca_study_answer {
    CA_STUDY_NOT_ASKED,
    CA_STUDY_LEFT_OUT, /* the images were not shown as long as they should, or not all the time */
    CA_STUDY_NO,
    CA_STUDY_YES
} ca_study_answer;

/* How far from the time that they should be shown images may be, in milliseconds. */
#define CA_STUDY_TOLERANCE_MS 50.0

typedef struct ca_study_subject {
    const char *subject, *session, *file; /* borrowed */
    bool finished;
    ca_study_answer *answers; /* owned; by scenario */
} ca_study_subject;

typedef struct ca_study_asked {
    const char *name, *pair, *light_name;
    ca_study_light light;
    double flip; /* mean FLIP of image and reference */
} ca_study_asked;

typedef struct ca_study_answers {
    const char *id, *title, *question;
    double seconds;
    ca_study_asked *scenarios; /* owned */
    uint32_t scenario_count;
    ca_study_subject *subjects; /* owned; finished or not */
    size_t subject_count, subject_capacity;
    ca_json **documents; /* owned */
    size_t document_count;
} ca_study_answers;

/* The paths are borrowed. Errors: CA_ERROR_FILE, CA_ERROR_MEMORY, CA_ERROR_FORMAT (with line and column). */
ca_status ca_study_answers_read(const char *const *paths, size_t count, ca_study_answers *answers, ca_error *error);
/* Also of answers that are all zeros. */
void ca_study_answers_destroy(ca_study_answers *answers);

#endif
