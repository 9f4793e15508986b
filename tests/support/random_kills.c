#define _POSIX_C_SOURCE 200809L
#include "support/random_kills.h"

#include "film/part_stream.h"
#include "film/pass_part.h"
#include "image/layers.h"
#include "support/program_test.h"
#include "support/scene_text.h"

#include <math.h>
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
    const struct timespec time = {.tv_sec = (time_t)seconds, .tv_nsec = (long)(fmod(seconds, 1.0) * 1e9)};
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

/* One run that is killed within so many seconds, unless it ends before; was it? */
static bool run_and_kill(const ca_program *program, const ca_kill_job *job, double seconds, ca_test_random *random)
{
    static const char *const threads[] = {"--threads=1", "--threads=2", "--threads=3"};
    const char *words[MOST_WORDS];
    int count = kept_words(job, words);
    words[count++] = threads[ca_test_random_u32(random) % 3];
    words[count++] = "--checkpoint-every=1e-6";
    words[count] = NULL;
    ca_program_result r;
    const pid_t process = ca_program_start(program, words, -1);
    pause_for(seconds * (double)ca_test_random_float(random));
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

static void unlink_checkpoint(const ca_program *program)
{
    char path[256];
    snprintf(path, sizeof path, "%s/kept.part", program->folder);
    unlink(path);
}

/* ---- What a checkpoint holds ----------------------------------------------------------------------------------- */

static bool has_checkpoint(const ca_program *program) { return exists(program->folder, "kept.part"); }

static uint64_t passes_in(const char *path)
{
    ca_pass_reader reader;
    ca_error error = {""};
    if (ca_pass_reader_open(&reader, path, &error) != CA_OK) fail_msg("%s", error.message);
    const uint64_t passes = ca_pass_part_passes(&reader.part);
    ca_pass_reader_close(&reader);
    return passes;
}

static uint64_t blocks_in(const char *path)
{
    ca_part part;
    ca_error error = {""};
    if (ca_part_read(path, &part, &error) != CA_OK) fail_msg("%s", error.message);
    const uint64_t blocks = part.blocks[1] - part.blocks[0];
    ca_part_destroy(&part);
    return blocks;
}

/* Passes or blocks in the checkpoint; 1 of a render that chooses its numbers of rays, whose file has some iterations
 * but says only to the render how many. 0: there is none. */
static uint64_t amount_kept(const ca_program *program)
{
    char path[256];
    FILE *stream;
    uint64_t size, format;
    ca_error error = {""};
    if (!has_checkpoint(program)) return 0;
    snprintf(path, sizeof path, "%s/kept.part", program->folder);
    if (ca_part_open(path, &stream, &size, &format, &error) != CA_OK) fail_msg("%s", error.message);
    fclose(stream);
    if (format == CA_JOINED_PART_FORMAT) return 1;
    return format == CA_PASS_PART_FORMAT ? passes_in(path) : blocks_in(path);
}

/* One that begins anew has the same picture in the end: only what it says of its beginning tells. */
static void expect_resumed(const ca_program *program, const ca_kill_job *job, uint64_t amount)
{
    json_t *stats = load_json(program->folder, "kept.json");
    const uint64_t resumed = (uint64_t)json_number(stats, "resumed");
    json_decref(stats);
    if (job->chooses_rays ? resumed < amount : resumed != amount)
        fail_msg("%s: went on after %llu passes or blocks, of %llu that the checkpoint has", job->integrator,
                 (unsigned long long)resumed, (unsigned long long)amount);
}

/* ---- All runs -------------------------------------------------------------------------------------------------- */

/* Kills until one has left a checkpoint; what it has is never less than before. On a slow machine, and where a method
 * does much before its first pass, kills come later: after each that came too early, until runs end before. */
static void kill_runs(const ca_program *program, const ca_kill_job *job, ca_test_random *random)
{
    enum { MOST_MORE = 100 };
    double seconds = job->seconds;
    uint64_t before = 0;
    for (int i = 0; i < job->kills || !has_checkpoint(program);) {
        if (i > job->kills + MOST_MORE) fail_msg("%s: no run leaves a checkpoint", job->integrator);
        if (run_and_kill(program, job, seconds, random)) {
            const uint64_t amount = amount_kept(program);
            if (amount < before)
                fail_msg("%s: of %llu passes or blocks in the checkpoint %llu are left", job->integrator,
                         (unsigned long long)before, (unsigned long long)amount);
            if (amount == 0) seconds *= 1.1;
            before = amount;
            i++;
        } else {
            unlink_checkpoint(program); /* it was done: the next one begins anew */
            seconds *= 0.95;
            before = 0;
        }
    }
}

void expect_kills_lose_nothing(const ca_program *program, const ca_kill_job *job, ca_test_random *random)
{
    const char *words[MOST_WORDS];
    unlink_checkpoint(program);
    kill_runs(program, job, random);
    const uint64_t amount = amount_kept(program);
    int count = kept_words(job, words);
    words[count++] = "--stats=kept.json";
    words[count] = NULL;
    run(program, words);
    expect_resumed(program, job, amount);
    render_at_once(program, job);
    if (hash_of(program, "one.exr") != hash_of(program, "kept.exr"))
        fail_msg("%s: after %d kills another image", job->integrator, job->kills);
}
