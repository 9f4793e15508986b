#define _POSIX_C_SOURCE 200809L
#include "support/random_kills.h"

#include "image/layers.h"
#include "support/scene_text.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

static uint64_t hash_of(const ca_program *program, const char *name)
{
    char path[256];
    ca_image_layers *image;
    ca_error error = {""};
    snprintf(path, sizeof path, "%s/%s", program->folder, name);
    if (ca_layers_read(path, &image, &error) != CA_OK) fail_msg("%s", error.message);
    const uint64_t hash = image_hash(image);
    ca_image_release(image);
    return hash;
}

static void pause_for(double seconds)
{
    const struct timespec time = {.tv_nsec = (long)(seconds * 1e9)};
    nanosleep(&time, NULL);
}

static void expect_done(const ca_program_result *r)
{
    if (r->exit_status != 0) fail_msg("exit status %d, signal %d: %s", r->exit_status, r->signal, r->errors);
}

enum { MOST_WORDS = 24 };

/* All but what a run is for; NULL follows. Gives back their number. */
static int common_words(const ca_kill_job *job, const char *words[MOST_WORDS])
{
    const char *const common[] = {"render", "ball.xml", "-i", job->integrator, "--resolution=24x16", "--quiet"};
    int count = 0;
    for (; count < 6; count++) words[count] = common[count];
    words[count] = NULL;
    return count;
}

static int kept_words(const ca_kill_job *job, const char *words[MOST_WORDS])
{
    int count = common_words(job, words);
    words[count++] = job->samples;
    words[count++] = "--checkpoint=kept.part";
    words[count++] = "--resume";
    if (job->chooses_rays) words[count++] = "--rays=auto";
    words[count++] = "-o";
    words[count++] = "kept.exr";
    words[count] = NULL;
    return count;
}

/* One run that is killed, unless it ends before; was it? */
static bool run_and_kill(const ca_program *program, const ca_kill_job *job, ca_test_random *random)
{
    static const char *const threads[] = {"--threads=1", "--threads=2", "--threads=3"};
    const char *words[MOST_WORDS];
    int count = kept_words(job, words);
    words[count++] = threads[ca_test_random_u32(random) % 3];
    words[count++] = "--checkpoint-every=1e-6";
    words[count] = NULL;
    ca_program_result r;
    const pid_t process = ca_program_start(program, words, -1);
    pause_for(job->seconds * (double)ca_test_random_float(random));
    kill(process, SIGKILL);
    ca_program_finish(program, process, &r);
    if (r.signal != SIGKILL) expect_done(&r);
    return r.signal == SIGKILL;
}

static void run(const ca_program *program, const char *const words[])
{
    ca_program_result r;
    ca_program_run(program, words, &r);
    expect_done(&r);
}

static void render_at_once(const ca_program *program, const ca_kill_job *job)
{
    const char *words[MOST_WORDS];
    int count = common_words(job, words);
    words[count++] = job->chooses_rays ? "--rays=kept.part" : job->samples;
    words[count++] = "-o";
    words[count++] = "one.exr";
    words[count] = NULL;
    run(program, words);
}

void expect_kills_lose_nothing(const ca_program *program, const ca_kill_job *job, ca_test_random *random)
{
    const char *words[MOST_WORDS];
    char path[256];
    snprintf(path, sizeof path, "%s/kept.part", program->folder);
    unlink(path);
    for (int i = 0; i < job->kills;) {
        if (run_and_kill(program, job, random))
            i++;
        else
            unlink(path); /* it was done: the next one begins anew */
    }
    kept_words(job, words);
    run(program, words);
    render_at_once(program, job);
    if (hash_of(program, "one.exr") != hash_of(program, "kept.exr"))
        fail_msg("%s: after %d kills another image", job->integrator, job->kills);
}
