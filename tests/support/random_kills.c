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

static const char size[] = "--resolution=24x16";

/* One run that is killed, unless it ends before; was it? */
static bool run_and_kill(const ca_program *program, const ca_kill_job *job, ca_test_random *random)
{
    static const char *const threads[] = {"--threads=1", "--threads=2", "--threads=3"};
    const char *const words[] = {"render",
                                 "ball.xml",
                                 "-i",
                                 job->integrator,
                                 job->samples,
                                 size,
                                 "--quiet",
                                 threads[ca_test_random_u32(random) % 3],
                                 "--checkpoint=kept.part",
                                 "--resume",
                                 "--checkpoint-every=1e-6",
                                 "-o",
                                 "kept.exr",
                                 NULL};
    ca_program_result r;
    const pid_t process = ca_program_start(program, words, -1);
    pause_for(job->seconds * (double)ca_test_random_float(random));
    kill(process, SIGKILL);
    ca_program_finish(program, process, &r);
    if (r.signal != SIGKILL) expect_done(&r);
    return r.signal == SIGKILL;
}

static void run_to_the_end(const ca_program *program, const ca_kill_job *job)
{
    const char *const words[] = {"render",     "ball.xml", "-i",       job->integrator,
                                 job->samples, size,       "--quiet",  "--checkpoint=kept.part",
                                 "--resume",   "-o",       "kept.exr", NULL};
    ca_program_result r;
    ca_program_run(program, words, &r);
    expect_done(&r);
}

void expect_kills_lose_nothing(const ca_program *program, const ca_kill_job *job, ca_test_random *random)
{
    const char *const words[] = {"render", "ball.xml", "-i", job->integrator, job->samples,
                                 size,     "--quiet",  "-o", "one.exr",       NULL};
    char path[256];
    ca_program_result r;
    snprintf(path, sizeof path, "%s/kept.part", program->folder);
    unlink(path);
    ca_program_run(program, words, &r);
    expect_done(&r);
    for (int i = 0; i < job->kills;) {
        if (run_and_kill(program, job, random))
            i++;
        else
            unlink(path); /* it was done: the next one begins anew */
    }
    run_to_the_end(program, job);
    if (hash_of(program, "one.exr") != hash_of(program, "kept.exr"))
        fail_msg("%s: after %d kills another image", job->integrator, job->kills);
}
