#include "render/blocks.h"

#include "base/clock.h"
#include "base/loading.h"
#include "base/memory.h"
#include "base/processors.h"
#include "base/stop.h"
#include "base/text.h"
#include "render/checkpoint.h"
#include "render/part_counts.h"
#include "render/part_settings.h"
#include "render/public_structs.h"
#include "render/rank_sums.h"
#include "render/record.h"
#include "render/workers.h"

#include <math.h>
#include <string.h>
#include <sys/resource.h>

typedef struct block_render {
    ca_render_plan *plan;
    void *integrator;
    ca_workers workers;
    ca_part part; /* part.blocks: those done */
    ca_checkpoint checkpoint;
    uint64_t resumed;                       /* blocks that were in the checkpoint; likewise: */
    uint64_t counts_before[CA_PART_COUNTS]; /* what they counted */
    double start;
    ca_block_sample *made; /* owned; of each pixel, until the block is complete */
    ca_kept_counts kept;   /* of the workers, from before the block */
    bool interrupted;
    bool out_of_memory; /* atomic: a worker, while it made a sample */
    const ca_ranks *ranks; /* borrowed; NULL: the render is this process's alone. Else likewise: */
    bool gathered;         /* for the caller, who is being told of the progress */
    ca_rank_work work;
    ca_rank_film rank_film;
} block_render;

/* Blocks that a rank makes one after the other: each uses again what the one before it has traced. */
enum { RUN_OF_BLOCKS = 4 };

/* ---- Which blocks ---------------------------------------------------------------------------------------------- */

/* The number of the block to stop before; UINT64_MAX: not known yet. An integrator with a limited number of blocks
 * stops after its last one, even if more samples were asked for. */
static uint64_t block_limit(const block_render *r)
{
    const ca_render_plan *plan = r->plan;
    if (plan->blocks[1] != UINT64_MAX) return plan->blocks[1];
    const uint64_t needed =
        plan->type->blocks_needed(r->integrator, plan->block_samples ? plan->block_samples : UINT32_MAX);
    return needed > plan->blocks[0] ? needed : plan->blocks[0] + 1;
}

/* The largest number of samples per pixel that needs no more than blocks [0, count). Where further blocks add no
 * samples, many numbers need the same blocks: then the smallest of these, rounded up to whole blocks. */
static uint32_t samples_after(const block_render *r, uint64_t count)
{
    const ca_render_plan *plan = r->plan;
    uint32_t low = 0, high = UINT32_MAX;
    while (low < high) { /* low needs no more than count blocks, high + 1 does */
        const uint32_t middle = high - (high - low) / 2;
        if (plan->type->blocks_needed(r->integrator, middle) <= count)
            low = middle;
        else
            high = middle - 1;
    }
    if (low < UINT32_MAX) return low;
    const uint64_t all = plan->type->blocks_needed(r->integrator, UINT32_MAX);
    uint32_t first = 1;
    while (first < high) { /* high needs all */
        const uint32_t middle = first + (high - first) / 2;
        if (plan->type->blocks_needed(r->integrator, middle) >= all)
            high = middle;
        else
            first = middle + 1;
    }
    const uint64_t whole = ((uint64_t)first + plan->camera_paths - 1) / plan->camera_paths * plan->camera_paths;
    return whole < UINT32_MAX ? (uint32_t)whole : UINT32_MAX;
}

/* ---- The loop -------------------------------------------------------------------------------------------------- */

static uint32_t width_of(const ca_render_plan *plan) { return plan->crop[2] - plan->crop[0]; }

static uint32_t height_of(const ca_render_plan *plan) { return plan->crop[3] - plan->crop[1]; }

/* Pixels [x0, x1) of a row, those of a tile. */
static void render_row(block_render *r, uint32_t x0, uint32_t x1, uint32_t y, uint32_t worker)
{
    const ca_render_plan *plan = r->plan;
    const uint32_t count = x1 - x0;
    ca_block_sample *samples = &r->made[(size_t)y * width_of(plan) + x0];
    if (ca_stop_asked(plan->input.stop)) return;
    memset(samples, 0, count * sizeof *samples);
    plan->type->block_pixels(r->integrator, plan->crop[0] + x0, plan->crop[1] + y, count, samples,
                             &r->workers.list[worker]);
    for (uint32_t i = 0; i < count; i++)
        if (samples[i].out_of_memory) __atomic_store_n(&r->out_of_memory, true, __ATOMIC_RELAXED);
}

static void render_tile(void *user, const ca_tile *tile, uint32_t worker)
{
    for (uint32_t y = tile->y0; y < tile->y1; y++) render_row(user, tile->x0, tile->x1, y, worker);
}

static void add_tile(void *user, const ca_tile *tile, uint32_t worker)
{
    block_render *r = user;
    const uint32_t *crop = r->plan->crop;
    for (uint32_t y = tile->y0; y < tile->y1; y++)
        for (uint32_t x = tile->x0; x < tile->x1; x++)
            if (!ca_block_film_add(r->part.film, crop[0] + x, crop[1] + y,
                                   &r->made[(size_t)y * width_of(r->plan) + x]))
                r->workers.film_rejects[worker]++;
}

static ca_status make_block(block_render *r, uint64_t block, ca_error *error)
{
    const ca_render_plan *plan = r->plan;
    const ca_parallel *parallel = &r->workers.parallel;
    CA_TRY(plan->type->begin_block(r->integrator, block, parallel, r->workers.list, error));
    CA_TRY(ca_for_each_tile(parallel, width_of(plan), height_of(plan), render_tile, r, error));
    return r->out_of_memory ? ca_fail_memory(error, "the pairs of light and camera paths") : CA_OK;
}

/* A block is added as a whole, when all of it is there; one that fails, or is stopped, leaves no trace. */
static ca_status render_block(block_render *r, uint64_t block, ca_error *error)
{
    const ca_parallel unstopped = {.workers = r->workers.parallel.workers};
    ca_workers_keep_counts(&r->workers, &r->kept);
    ca_status status = make_block(r, block, error);
    if (status == CA_OK)
        status = ca_for_each_tile(&unstopped, width_of(r->plan), height_of(r->plan), add_tile, r, error);
    if (status != CA_OK) ca_workers_restore_counts(&r->workers, &r->kept);
    return status;
}

static void count_what_is_done(block_render *r);

static void add_notes(const block_render *r, ca_render_statistics *statistics)
{
    statistics->notes = r->plan->scene->desc.notes.items;
    statistics->note_count = r->plan->scene->desc.notes.count;
}

/* ca_render_progress.snapshot */
static ca_status take_snapshot(const ca_render_progress *progress, ca_image_layers **image,
                               ca_render_statistics *statistics, ca_error *error)
{
    ca_render_statistics told;
    CA_TRY(ca_render_check_snapshot(progress, image, error));
    CA_TRY(ca_statistics_take(statistics, &told, error));
    block_render *r = progress->render;
    const uint64_t end = r->part.blocks[1];
    if (r->ranks) r->part.blocks[1] = r->part.blocks[0] + r->work.in_sums; /* what the film has */
    count_what_is_done(r);
    ca_part_fill_statistics(&r->part, &told);
    add_notes(r, &told);
    ca_statistics_give(&told, statistics);
    const ca_status status = ca_part_develop(&r->part, image, error);
    r->part.blocks[1] = end;
    return status;
}

static void gather_for_progress(const ca_render_progress *progress);

/* Tells the caller how far it is; false where the render should end. */
static bool report_progress(block_render *r, uint64_t limit)
{
    const ca_render_settings *settings = r->plan->settings;
    const uint64_t done = r->part.blocks[1] - r->part.blocks[0], total = limit - r->part.blocks[0];
    const ca_render_progress progress = {
        .blocks = true,
        .passes_done = done < UINT32_MAX ? (uint32_t)done : UINT32_MAX,
        .passes_total = !r->plan->open_ended && total <= UINT32_MAX ? (uint32_t)total : 0,
        .seconds = r->part.seconds,
        .seconds_total = settings->seconds,
        .noise_percent = -1.0,
        /* An image needs all blocks from 0. */
        .snapshot = r->part.blocks[0] == 0 ? take_snapshot : NULL,
        .checkpoint_failure = ca_checkpoint_failure(&r->checkpoint),
        .gather = r->ranks ? gather_for_progress : NULL,
        .render = r,
    };
    r->gathered = false;
    const bool goes_on = ca_render_tell(r->plan, &progress, &r->start);
    if (r->gathered) ca_rank_work_go_on(&r->work, UINT64_MAX); /* no sum changes while its picture is made */
    return goes_on;
}

/* ---- With other ranks ------------------------------------------------------------------------------------------ */

/* ca_rank_work.make */
static ca_status make_range(void *user, ca_work_range range, uint64_t *made, ca_error *error)
{
    block_render *r = user;
    ca_status status = CA_OK;
    for (*made = 0; *made < range.end - range.begin; ++*made) {
        status = render_block(r, range.begin + *made, error);
        if (status != CA_OK) break;
    }
    r->part.seconds = ca_clock_seconds() - r->start;
    return status;
}

/* The film then has all blocks that were handed out. */
static ca_status gather(block_render *r, ca_error *error)
{
    const ca_status status = ca_rank_work_gather(&r->work, error);
    r->part.blocks[1] = r->part.blocks[0] + r->work.in_sums;
    return status;
}

/* ca_render_progress.gather */
static void gather_for_progress(const ca_render_progress *progress)
{
    block_render *r = progress->render;
    (void)gather(r, NULL); /* what fails on this rank fails again with the next block */
    r->gathered = true;
}

/* ---- Checkpoints ----------------------------------------------------------------------------------------------- */

static ca_status write_film(block_render *r, const char *path, ca_error *error)
{
    count_what_is_done(r);
    CA_TRY(ca_rank_work_check_whole(&r->work, path, "blocks", error));
    return ca_part_write(&r->part, path, error);
}

/* ca_checkpoint_writer. At the end all is gathered. */
static ca_status write_part(void *user, const char *path, ca_error *error)
{
    block_render *r = user;
    const bool gathers = ca_rank_work_is_open(&r->work);
    if (gathers) CA_TRY(gather(r, error));
    const ca_status status = write_film(r, path, error);
    if (gathers) ca_rank_work_go_on(&r->work, r->work.look);
    return status;
}

static void keep(block_render *r, uint64_t limit)
{
    const ca_render_settings *settings = r->plan->settings;
    const double done = (double)(r->part.blocks[1] - r->part.blocks[0]), all = (double)(limit - r->part.blocks[0]);
    const double given = settings->seconds > 0.0 ? settings->seconds : (double)INFINITY;
    const double whole =
        r->plan->open_ended || limit == UINT64_MAX ? given : fmin(given, r->part.seconds / done * all);
    ca_checkpoint_keep(&r->checkpoint, settings, whole, write_part, r);
}

static bool is_done(const block_render *r)
{
    const double seconds = r->plan->settings->seconds;
    return r->part.blocks[1] >= block_limit(r) || (seconds > 0.0 && r->part.seconds >= seconds);
}

static bool has_blocks(const block_render *r) { return r->part.blocks[1] > r->part.blocks[0]; }

static ca_status make_blocks(block_render *r, ca_error *error)
{
    while (!has_blocks(r) || !(r->interrupted || is_done(r))) {
        CA_TRY(render_block(r, r->part.blocks[1], error));
        r->part.blocks[1]++;
        r->part.seconds = ca_clock_seconds() - r->start;
        const uint64_t limit = block_limit(r);
        keep(r, limit);
        r->interrupted = !report_progress(r, limit);
    }
    return CA_OK;
}

/* The others get no blocks before it is known how many there are. */
static uint64_t limit_for_ranks(block_render *r)
{
    const double seconds = r->plan->settings->seconds;
    const uint64_t limit = block_limit(r);
    const bool waits = limit == UINT64_MAX && !r->plan->open_ended;
    r->work.run = waits ? 1 : RUN_OF_BLOCKS;
    r->work.limit = limit;
    r->work.deadline = seconds > 0.0 ? r->start + seconds : 0.0;
    ca_rank_work_wait(&r->work, waits);
    return limit;
}

/* As make_blocks, where other ranks make blocks, too. */
static ca_status lead_blocks(block_render *r, ca_error *error)
{
    ca_work_range range;
    ca_status status = CA_OK;
    limit_for_ranks(r);
    while (status == CA_OK && !r->interrupted && ca_rank_work_take(&r->work, &range)) {
        status = ca_rank_work_make(&r->work, range, error);
        r->part.blocks[1] = r->part.blocks[0] + r->work.made;
        const uint64_t limit = limit_for_ranks(r);
        if (status != CA_OK) break;
        keep(r, limit);
        r->interrupted = !report_progress(r, limit) || r->work.end_asked;
    }
    status = ca_rank_work_finish(&r->work, status, error);
    r->part.blocks[1] = r->part.blocks[0] + r->work.in_sums;
    r->part.seconds = ca_clock_seconds() - r->start;
    ca_rank_work_end(&r->work);
    return status;
}

/* The blocks before one that was not made whole are the result, and kept. */
static ca_status run_blocks(block_render *r, ca_error *error)
{
    r->start = ca_clock_seconds() - r->part.seconds;
    const ca_status status = r->ranks ? lead_blocks(r, error) : make_blocks(r, error);
    ca_reserve_open(r->plan->reserve);
    r->interrupted = r->interrupted || status == CA_ERROR_INTERRUPTED;
    const bool early = r->interrupted || status != CA_OK;
    if (has_blocks(r)) ca_checkpoint_keep_last(&r->checkpoint, r->plan->settings, early, write_part, r);
    return status == CA_ERROR_INTERRUPTED && has_blocks(r) ? CA_OK : status;
}

/* ---- What is left ---------------------------------------------------------------------------------------------- */

static uint64_t seed_of(const ca_part *part)
{
    char text[32];
    uint64_t seed = 0;
    ca_part_settings_find(part->settings, "seed", text, sizeof text);
    ca_parse_digits(text, strlen(text), UINT64_MAX, &seed);
    return seed;
}

void ca_part_fill_statistics(const ca_part *part, ca_render_statistics *statistics)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    *statistics = (ca_render_statistics){
        .seconds = part->seconds,
        .samples_per_pixel = part->samples_per_pixel,
        .iterations = part->blocks[1] - part->blocks[0],
        .seed = seed_of(part),
        .peak_memory_bytes = (uint64_t)usage.ru_maxrss * 1024,
        .mean_luminance = ca_block_film_mean_luminance(part->film),
        .mean_standard_deviation = (double)NAN,
        .noise_percent = -1.0,
        .blocks = {part->blocks[0], part->blocks[1]},
    };
    ca_part_counts_fill(part->counts, statistics);
}

/* Of the error bars; NULL where none were asked for. */
static const char *confidence_of(const ca_part *part)
{
    if (!ca_block_film_described(part->film)->error_bars) return NULL;
    return part->blocks[0] == 0 ? "95 % for the expectation at the radii of this render, from the law of all pairs "
                                  "of independent paths"
                                : "none: the first blocks are not there";
}

static ca_status attach_record(const ca_part *part, ca_image_layers *image, ca_error *error)
{
    char version[64], integrator[1024], sampler[64], filter[64];
    ca_part_settings_find(part->settings, "version", version, sizeof version);
    ca_part_settings_find(part->settings, "integrator", integrator, sizeof integrator);
    ca_part_settings_find(part->settings, "sampler", sampler, sizeof sampler);
    ca_part_settings_find(part->settings, "filter", filter, sizeof filter);
    const ca_render_record record = {
        .version = version,
        .scene = part->scene_path,
        .integrator = integrator,
        .sampler = sampler,
        .filter = filter,
        .seed = (double)seed_of(part),
        .samples_per_pixel = part->samples_per_pixel,
        .seconds = part->seconds,
        .threads = part->threads,
        .by_blocks = true,
        .blocks = {part->blocks[0], part->blocks[1]},
        .confidence = confidence_of(part),
    };
    return ca_render_record_attach(&record, image, error);
}

ca_status ca_part_develop(const ca_part *part, ca_image_layers **image, ca_error *error)
{
    CA_TRY(ca_block_film_develop(part->film, ca_min_u32(part->threads, ca_processors()), image, error));
    const ca_status status = attach_record(part, *image, error);
    if (status == CA_OK) return CA_OK;
    ca_layers_destroy(*image);
    *image = NULL;
    return status;
}

/* Records the samples per pixel after these blocks, and after the next number of blocks that adds samples. */
static void keep_samples(block_render *r)
{
    ca_part *part = &r->part;
    const uint32_t samples = samples_after(r, part->blocks[1]);
    part->samples_per_pixel = samples;
    part->next_blocks = 0;
    part->next_samples = 0;
    if (samples == UINT32_MAX) return;
    const uint64_t next = r->plan->type->blocks_needed(r->integrator, samples + 1);
    if (next == UINT64_MAX || next <= part->blocks[1]) return;
    part->next_blocks = next;
    part->next_samples = samples_after(r, next);
}

static void count_what_is_done(block_render *r)
{
    keep_samples(r);
    ca_part_counts_keep(&r->workers, r->part.counts);
    for (int i = 0; i < CA_PART_COUNTS; i++) r->part.counts[i] += r->counts_before[i];
    if (r->ranks) ca_rank_work_count(&r->work, r->part.counts);
}

static ca_status finish(block_render *r, ca_image_layers **image, ca_render_statistics *statistics, ca_error *error)
{
    CA_TRY(ca_stop_check(r->plan->settings->discard, error));
    const ca_status written =
        ca_checkpoint_write_part(&r->checkpoint, r->plan->settings, r->interrupted, write_part, r, error);
    count_what_is_done(r);
    ca_part_fill_statistics(&r->part, statistics);
    add_notes(r, statistics);
    statistics->interrupted = r->interrupted;
    statistics->passes_resumed = r->resumed;
    statistics->keeps_checkpoint = r->checkpoint.is_kept;
    if (written != CA_OK && written != CA_ERROR_FILE) return written;
    ca_error reason;
    const int *before = ca_loading_until(r->plan->settings->discard);
    const ca_status developed = ca_part_develop(&r->part, image, &reason);
    ca_loading_until(before);
    return ca_fail_also(error, written, developed, &reason);
}

/* The part without its blocks. */
static ca_status prepare_part(const ca_render_plan *plan, ca_part *part, ca_error *error)
{
    const char *path = plan->scene->desc.path ? plan->scene->desc.path : "";
    part->threads = plan->threads;
    const size_t size = strlen(path) + 1;
    part->scene_path = ca_alloc(size, 1);
    if (!part->scene_path) return ca_fail_memory(error, "the render");
    memcpy(part->scene_path, path, size);
    part->blocks[0] = part->blocks[1] = plan->blocks[0];
    CA_TRY(ca_part_settings_make(plan, &part->settings, error));
    return ca_block_film_create(&part->film, &plan->block_film, error);
}

static ca_status create_buffers(block_render *r, ca_error *error)
{
    const ca_render_plan *plan = r->plan;
    CA_TRY(ca_workers_create(&r->workers, plan->threads, error));
    CA_TRY(ca_kept_counts_create(&r->kept, &r->workers, error));
    r->workers.parallel.stop = plan->input.stop;
    r->made = ca_alloc((size_t)width_of(plan) * height_of(plan), sizeof *r->made);
    return r->made ? CA_OK : ca_fail_memory(error, "the film");
}

/* Can this render go on from the part of a checkpoint? */
static ca_status check_resumed(const block_render *r, const ca_part *part, ca_error *error)
{
    const char *path = r->checkpoint.path;
    const unsigned long long begin = part->blocks[0], end = part->blocks[1];
    CA_TRY(ca_checkpoint_compare(path, part->settings, r->part.settings, error));
    if (!ca_block_film_desc_equal(ca_block_film_described(part->film), ca_block_film_described(r->part.film)))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%.400s has another film", path);
    if (begin != r->plan->blocks[0])
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "%.400s has the blocks %llu:%llu, but this render begins at block %llu", path, begin, end,
                       (unsigned long long)r->plan->blocks[0]);
    if (end > r->plan->blocks[1])
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "%.400s has %llu blocks already, more than the %llu of this render", path, end - begin,
                       (unsigned long long)(r->plan->blocks[1] - begin));
    return CA_OK;
}

static void take_over(block_render *r, ca_part *part)
{
    ca_block_film *const film = r->part.film;
    r->part.film = part->film;
    part->film = film;
    r->part.blocks[1] = part->blocks[1];
    r->part.seconds = part->seconds;
    r->resumed = part->blocks[1] - part->blocks[0];
    memcpy(r->counts_before, part->counts, sizeof r->counts_before);
}

static ca_status resume(block_render *r, ca_error *error)
{
    ca_part part;
    if (!r->checkpoint.resumes) return CA_OK;
    CA_TRY(ca_part_read(r->checkpoint.path, &part, error));
    const ca_status status = check_resumed(r, &part, error);
    if (status == CA_OK) take_over(r, &part);
    ca_part_destroy(&part);
    return status;
}

/* Where blocks are as large as the memory, how many there are is known when the last camera paths have been traced.
 * So it is of a checkpoint, once its last block's are traced again. */
static ca_status learn_limit(block_render *r, ca_error *error)
{
    if (r->resumed == 0 || r->plan->open_ended || block_limit(r) != UINT64_MAX) return CA_OK;
    ca_workers_keep_counts(&r->workers, &r->kept);
    const ca_status status = r->plan->type->begin_block(r->integrator, r->part.blocks[1] - 1, &r->workers.parallel,
                                                        r->workers.list, error);
    ca_workers_restore_counts(&r->workers, &r->kept);
    return status;
}

static ca_status check_limit(const block_render *r, ca_error *error)
{
    if (r->resumed == 0 || r->plan->open_ended || block_limit(r) >= r->part.blocks[1]) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%.400s has %llu blocks already, more than this render makes",
                   r->checkpoint.path, (unsigned long long)r->resumed);
}

static ca_status run_and_finish(block_render *r, ca_image_layers **image, ca_render_statistics *statistics,
                                ca_error *error)
{
    const ca_status status = run_blocks(r, error);
    if (!has_blocks(r)) return status;
    ca_error reason;
    const ca_status finished = finish(r, image, statistics, &reason);
    return ca_fail_also(error, status, finished, &reason);
}

static ca_status create_work(block_render *r, ca_error *error)
{
    if (!r->ranks) return CA_OK;
    r->rank_film = (ca_rank_film){.blocks = r->part.film, .workers = &r->workers};
    const ca_rank_sums sums = ca_rank_sums_of(&r->rank_film);
    CA_TRY(ca_rank_work_create(&r->work, r->ranks, &sums, r->part.blocks[0], r->resumed, error));
    r->work.end_wanted = r->plan->settings->stop;
    r->work.make = make_range;
    r->work.make_user = r;
    r->workers.parallel.between = ca_rank_work_between;
    r->workers.parallel.between_user = &r->work;
    return CA_OK;
}

/* All that can fail before the first block. With other ranks blocks are finished, whoever asks to stop. */
static ca_status prepare(block_render *r, ca_error *error)
{
    ca_render_plan *plan = r->plan;
    if (r->ranks) plan->input.stop = NULL;
    CA_TRY(prepare_part(plan, &r->part, error));
    CA_TRY(ca_checkpoint_start(&r->checkpoint, plan->settings, error));
    CA_TRY(resume(r, error));
    CA_TRY(create_buffers(r, error));
    CA_TRY(ca_integrator_create(plan->type, &plan->input, &r->integrator, error));
    CA_TRY(learn_limit(r, error));
    CA_TRY(check_limit(r, error));
    return create_work(r, error);
}

static ca_status agree_on_settings(const block_render *r, ca_status status, ca_error *error)
{
    if (!r->ranks) return status;
    CA_TRY(ca_ranks_agree(r->ranks, status, error));
    return ca_part_settings_agree(r->ranks, r->part.settings, error);
}

ca_status ca_render_blocks(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                           ca_error *error)
{
    block_render r = {.plan = plan, .ranks = plan->settings->ranks};
    ca_status status = agree_on_settings(&r, prepare(&r, error), error);
    if (status == CA_OK && ca_ranks_helps(r.ranks))
        ca_rank_work_help(&r.work, 1);
    else if (status == CA_OK)
        status = run_and_finish(&r, image, statistics, error);
    if (r.integrator) plan->type->destroy(r.integrator);
    ca_rank_work_destroy(&r.work);
    ca_workers_destroy(&r.workers);
    ca_kept_counts_destroy(&r.kept);
    ca_free(r.made);
    ca_part_destroy(&r.part);
    ca_checkpoint_end(&r.checkpoint);
    return status;
}
