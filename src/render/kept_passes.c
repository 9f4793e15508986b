#include "render/kept_passes.h"

#include "base/memory.h"
#include "render/kept_method.h"
#include "render/part_counts.h"
#include "render/part_settings.h"

#include <string.h>

ca_status ca_kept_start(ca_kept_passes *kept, const ca_render_plan *plan, ca_error *error)
{
    *kept = (ca_kept_passes){.settings = NULL};
    CA_TRY(ca_checkpoint_start(&kept->checkpoint, plan->settings, error));
    if (!kept->checkpoint.resumes) return CA_OK;
    const ca_status status = ca_pass_reader_open(&kept->reader, kept->checkpoint.path, error);
    if (status != CA_OK) ca_kept_destroy(kept);
    return status;
}

void ca_kept_destroy(ca_kept_passes *kept)
{
    ca_pass_reader_close(&kept->reader);
    ca_checkpoint_end(&kept->checkpoint);
    ca_free(kept->settings);
    kept->settings = NULL;
}

/* ---- Going on -------------------------------------------------------------------------------------------------- */

ca_status ca_kept_use_method(const ca_kept_passes *kept, ca_render_plan *plan, bool *used, ca_error *error)
{
    const ca_pass_part *part = &kept->reader.part;
    *used = kept->checkpoint.resumes;
    return *used ? ca_kept_method_use(part->record, part->settings, kept->reader.path, plan, error) : CA_OK;
}

ca_status ca_kept_check(ca_kept_passes *kept, const ca_render_plan *plan, uint64_t rays, ca_error *error)
{
    CA_TRY(ca_pass_settings_make(plan, rays, &kept->settings, error));
    if (!kept->checkpoint.resumes) return CA_OK;
    return ca_checkpoint_compare(kept->reader.path, kept->reader.part.settings, kept->settings, error);
}

static ca_status check_ranges(const ca_pass_part *part, const ca_render_plan *plan, const char *path, ca_error *error)
{
    const ca_pass_range *first = &part->ranges[0];
    const unsigned long long begin = first->begin, end = first->end;
    if (part->range_count > 1 || begin != plan->first_pass)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "%.400s has the passes %llu:%llu%s, but this render begins at pass %u", path, begin, end,
                       part->range_count > 1 ? " and others" : "", plan->first_pass);
    if (end > plan->pass_limit)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "%.400s has %llu passes already, more than the %u of this render", path, end - begin,
                       plan->pass_limit - plan->first_pass);
    return CA_OK;
}

ca_status ca_kept_restore(ca_kept_passes *kept, const ca_render_plan *plan, ca_film *film, ca_error *error)
{
    if (!kept->checkpoint.resumes) return CA_OK;
    ca_pass_reader *reader = &kept->reader;
    const ca_pass_film_desc desc = ca_pass_film_described(film);
    CA_TRY(check_ranges(&reader->part, plan, reader->path, error));
    if (!ca_pass_film_desc_equal(&desc, &reader->film))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%.400s has another film", reader->path);
    CA_TRY(ca_pass_reader_add(reader, film, true, error));
    kept->resumed = (uint32_t)ca_pass_part_passes(&reader->part);
    memcpy(kept->counts, reader->part.counts, sizeof kept->counts);
    kept->seconds = reader->part.seconds;
    kept->looks = reader->part.looks;
    ca_pass_reader_close(reader);
    return CA_OK;
}

/* ---- Writing --------------------------------------------------------------------------------------------------- */

ca_status ca_kept_write(const ca_kept_passes *kept, const ca_kept_state *state, const char *path, ca_error *error)
{
    const ca_render_plan *plan = state->plan;
    const char *scene = plan->scene->desc.path;
    ca_pass_range range = {plan->first_pass, (uint64_t)plan->first_pass + state->passes};
    char no_scene[] = "", *record = ca_kept_method_make(plan);
    if (!record) return ca_fail_memory(error, path);
    ca_pass_part part = {
        .settings = kept->settings,
        .record = record,
        .scene_path = scene ? (char *)(uintptr_t)scene : no_scene,
        .ranges = &range,
        .range_count = 1,
        .seconds = state->seconds,
        .looks = {state->looks.target, state->looks.next, state->looks.noise},
        .threads = plan->threads,
        .light_paths = state->rays->light_paths,
        .camera_paths = state->rays->camera_paths,
    };
    ca_part_counts_keep(state->workers, part.counts);
    for (int i = 0; i < CA_PART_COUNTS; i++)
        part.counts[i] += kept->counts[i] + (state->others ? state->others[i] : 0);
    const ca_status status = ca_pass_part_write(&part, state->film, path, error);
    ca_free(record);
    return status;
}
