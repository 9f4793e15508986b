/* Renders that are killed at random times and go on from their checkpoint. */
#ifndef CA_TEST_RANDOM_KILLS_H
#define CA_TEST_RANDOM_KILLS_H

#include "support/run_program.h"
#include "support/test_random.h"

/* What is rendered: ball.xml of the program's folder. */
typedef struct ca_kill_job {
    const char *integrator, *samples; /* the latter: "--spp=16" */
    double seconds;    /* the first kills come within so many, of a run */
    int kills;
    bool chooses_rays; /* --rays auto: the image in the end is the one of the checkpoint's record */
} ca_kill_job;

/* Renders it at once, and again with the kills, each run with another number of threads; fails the test where the two
 * images differ, where a checkpoint has less than the one before it, or where the last run does not go on from all
 * that its checkpoint has. Where numbers of rays are chosen, at once means by the record of what was killed. */
void expect_kills_lose_nothing(const ca_program *program, const ca_kill_job *job, ca_test_random *random);

#endif
