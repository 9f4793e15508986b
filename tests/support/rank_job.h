/* A render by ranks that are threads (thread_ranks.h), and what becomes of it on rank 0 and on the last one. */
#ifndef CA_TEST_RANK_JOB_H
#define CA_TEST_RANK_JOB_H

#include "caustica.h"

typedef struct rank_job {
    ca_render_settings settings; /* of rank 0; the others have no files and no callback */
    const ca_scene *last_scene;  /* of the last rank; NULL: the same; likewise: */
    const char *last_integrator;
    const int *last_stop; /* likewise */
    bool last_without_rays;
    bool many_threads; /* the ranks have one, two and three */
    ca_status status, others;
    ca_image_layers *image;
    ca_render_statistics statistics;
    ca_error error;
} rank_job;

/* Renders small_render.h's scene; the image is the caller's. */
void rank_job_run(rank_job *j, uint32_t ranks, uint32_t lateness);
/* Likewise; fails the test where a rank fails. */
void rank_job_succeed(rank_job *j, uint32_t ranks, uint32_t lateness);
/* The image's hash, and lets the image go. */
uint64_t rank_job_hash(rank_job *j, uint32_t ranks, uint32_t lateness);
/* Fails the test unless all ranks end with this status, and these words are said. */
void rank_job_refused(rank_job *j, uint32_t ranks, ca_status status, const char *words);

#endif
