#include "support/rank_job.h"

#include "support/scene_text.h"
#include "support/small_render.h"
#include "support/thread_ranks.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static void render_as(void *user, const ca_ranks *ranks)
{
    rank_job *j = user;
    ca_render_settings s = j->settings;
    ca_image_layers *none = NULL;
    const bool is_last = ranks->rank + 1 == ranks->count;
    s.ranks = ranks;
    if (j->many_threads) s.threads = 1 + ranks->rank % 3;
    if (ranks->rank == 0) {
        j->status = ca_render(scene, &s, &j->image, &j->statistics, &j->error);
        return;
    }
    s.progress = NULL;
    s.checkpoint_path = s.part_path = NULL;
    s.resume = false;
    if (is_last && j->last_stop) s.stop = j->last_stop;
    if (is_last && j->last_without_rays) s.rays = NULL;
    if (is_last && j->last_integrator) s.integrator = j->last_integrator;
    const ca_status status = ca_render(is_last && j->last_scene ? j->last_scene : scene, &s, &none, NULL, NULL);
    assert_null(none);
    if (is_last) j->others = status;
}

void rank_job_run(rank_job *j, uint32_t ranks, uint32_t lateness)
{
    j->image = NULL;
    ca_render_statistics_init(&j->statistics);
    j->error.message[0] = '\0';
    ca_run_ranks(ranks, lateness, render_as, j);
}

void rank_job_succeed(rank_job *j, uint32_t ranks, uint32_t lateness)
{
    rank_job_run(j, ranks, lateness);
    if (j->status != CA_OK) fail_msg("%s", j->error.message);
    assert_int_equal(j->others, CA_OK);
}

void rank_job_refused(rank_job *j, uint32_t ranks, ca_status status, const char *words)
{
    rank_job_run(j, ranks, 0);
    if (!strstr(j->error.message, words)) fail_msg("\"%s\" is not said in: %s", words, j->error.message);
    assert_true(j->status == status && j->others == status && !j->image);
}

uint64_t rank_job_hash(rank_job *j, uint32_t ranks, uint32_t lateness)
{
    rank_job_succeed(j, ranks, lateness);
    const uint64_t hash = image_hash(j->image);
    ca_image_release(j->image);
    return hash;
}
