#include "render/kept_method.h"

#include "base/memory.h"
#include "base/text.h"
#include "film/part_stream.h"
#include "film/pass_part.h"
#include "render/auto_file.h"
#include "render/auto_method.h"
#include "render/checkpoint.h"
#include "render/part_settings.h"

#include <stdio.h>
#include <string.h>

/* In front of the settings that the method was chosen for. */
static const char asked_begin[] = "asked\n";

char *ca_kept_method_make(const ca_render_plan *plan)
{
    const char *asked = plan->asked ? plan->asked : "";
    const size_t size = strlen(asked) + sizeof plan->method.reason + 256;
    char *lines = ca_alloc_zeroed(size, 1);
    if (lines && plan->asked)
        snprintf(lines, size, "method_reason %s\nmethod_seconds %.17g\n%s%s", plan->method.reason,
                 plan->method.seconds, asked_begin, asked);
    return lines;
}

static const char *asked_in(const char *lines)
{
    const char *begin = strstr(lines, asked_begin);
    return begin ? begin + sizeof asked_begin - 1 : NULL;
}

ca_status ca_kept_method_use(const char *lines, const char *settings, const char *path, ca_render_plan *plan,
                             ca_error *error)
{
    const char *asked = asked_in(lines);
    ca_method_statistics *method = &plan->method;
    char seconds[64];
    CA_TRY(ca_checkpoint_compare(path, asked ? asked : settings, plan->asked, error));
    CA_TRY(ca_pass_settings_use(settings, path, plan, error));
    CA_TRY(ca_render_plan_recount(plan, error));
    ca_part_settings_find(lines, "method_reason", method->reason, sizeof method->reason);
    if (ca_part_settings_find(lines, "method_seconds", seconds, sizeof seconds) &&
        !ca_parse_double(seconds, &method->seconds))
        method->seconds = 0.0;
    return CA_OK;
}

/* ---- Of rays "auto" -------------------------------------------------------------------------------------------- */

/* Passes are of numbers that were chosen once, or of a method without numbers to choose; else they are another
 * render's, which is told when the file is read. */
static ca_status use_passes(ca_render_plan *plan, const char *path, ca_error *error)
{
    const bool chooses = ca_render_plan_chooses(plan);
    ca_pass_reader reader;
    ca_status status = CA_OK;
    CA_TRY(ca_pass_reader_open(&reader, path, error));
    if (chooses) status = ca_kept_method_use(reader.part.record, reader.part.settings, path, plan, error);
    if (reader.part.light_paths > 0)
        plan->rays = CA_RAYS_AUTO_ONCE;
    else if (chooses)
        plan->rays = CA_RAYS_OF_SETTINGS;
    ca_pass_reader_close(&reader);
    return status == CA_OK ? ca_render_plan_memory(plan, error) : status;
}

static ca_status use_file(ca_render_plan *plan, const char *path, ca_error *error)
{
    FILE *stream;
    uint64_t size, format;
    CA_TRY(ca_part_open(path, &stream, &size, &format, error));
    fclose(stream);
    if (format != CA_JOINED_PART_FORMAT) return use_passes(plan, path, error);
    return ca_render_plan_chooses(plan) ? ca_auto_file_use_method(plan, path, error) : CA_OK;
}

ca_status ca_kept_method_recall(ca_render_plan *plan, bool *used, ca_error *error)
{
    ca_checkpoint checkpoint;
    CA_TRY(ca_checkpoint_start(&checkpoint, plan->settings, error));
    *used = checkpoint.resumes;
    const ca_status status = *used ? use_file(plan, plan->settings->checkpoint_path, error) : CA_OK;
    ca_checkpoint_end(&checkpoint);
    return status;
}
