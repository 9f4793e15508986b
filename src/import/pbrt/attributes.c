/* The directives that keep and restore the graphics state, and those of its parts that are not transforms. */
#include "import/pbrt/directives.h"

#include "base/text.h"

#include <string.h>

void ca_pbrt_open_state(ca_pbrt *p, ca_pbrt_open kind)
{
    if (p->saved.count == CA_PBRT_MAX_OPEN_STATES)
        ca_import_fail(p->importer, &p->params.where, "more than %d blocks are open", CA_PBRT_MAX_OPEN_STATES);
    else if (!CA_TABLE_ADD(&p->saved))
        ca_import_fail_memory(p->importer, "attributes");
    else
        p->saved.items[p->saved.count - 1] =
            (ca_pbrt_saved){.state = p->state, .kind = kind, .where = p->params.where};
}

const char *const ca_pbrt_open_names[CA_PBRT_OPEN_OBJECT + 1] = {"AttributeBegin", "TransformBegin", "ObjectBegin"};

void ca_pbrt_close_state(ca_pbrt *p, ca_pbrt_open kind)
{
    if (p->saved.count == 0) {
        ca_import_fail(p->importer, &p->params.where, "%s ends nothing that was begun", p->params.what);
        return;
    }
    const ca_pbrt_saved *top = &p->saved.items[p->saved.count - 1];
    if (top->kind != kind) {
        ca_import_fail(p->importer, &p->params.where, "%s, but the open block is the %s of line %u", p->params.what,
                       ca_pbrt_open_names[top->kind], top->where.line);
        return;
    }
    if (kind == CA_PBRT_OPEN_TRANSFORM) {
        p->state.ctm = top->state.ctm;
        p->state.start_is_active = top->state.start_is_active;
    } else {
        p->state = top->state;
    }
    p->saved.count--;
}

void ca_pbrt_run_attribute_begin(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    ca_pbrt_open_state(p, CA_PBRT_OPEN_ATTRIBUTES);
}

void ca_pbrt_run_attribute_end(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    ca_pbrt_close_state(p, CA_PBRT_OPEN_ATTRIBUTES);
}

void ca_pbrt_run_transform_begin(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    ca_pbrt_open_state(p, CA_PBRT_OPEN_TRANSFORM);
}

void ca_pbrt_run_transform_end(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    ca_pbrt_close_state(p, CA_PBRT_OPEN_TRANSFORM);
}

void ca_pbrt_run_reverse(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    p->state.reverses = !p->state.reverses;
}

/* The parameter with its values in the document's arena. */
static bool keep_preset(ca_pbrt *p, const ca_pbrt_parameter *parameter, ca_pbrt_preset *preset)
{
    ca_arena *arena = &p->importer->document.arena;
    preset->parameter = *parameter;
    if (parameter->texts) {
        const char **texts = ca_arena_alloc(arena, parameter->count, sizeof *texts);
        if (texts) memcpy(texts, parameter->texts, parameter->count * sizeof *texts);
        preset->parameter.texts = texts;
        return texts != NULL;
    }
    double *numbers = ca_arena_alloc(arena, parameter->count + 1, sizeof *numbers);
    if (numbers && parameter->count > 0) memcpy(numbers, parameter->numbers, parameter->count * sizeof *numbers);
    preset->parameter.numbers = numbers;
    return numbers != NULL;
}

void ca_pbrt_run_attribute(ca_pbrt *p, const double *n, const char *const *s)
{
    static const char *const targets[CA_PBRT_TARGET_COUNT] = {"shape", "light", "material", "medium", "texture"};
    size_t target = 0;
    (void)n;
    while (target < CA_PBRT_TARGET_COUNT && strcmp(targets[target], s[0]) != 0) target++;
    if (target == CA_PBRT_TARGET_COUNT) {
        ca_import_fail(p->importer, &p->params.where, "Attribute \"%s\" is not known; the nearest is \"%s\"", s[0],
                       ca_nearest_name_however_far(s[0], targets, CA_PBRT_TARGET_COUNT));
        return;
    }
    for (size_t i = 0; i < p->params.list.count; i++) {
        ca_pbrt_preset *preset = ca_arena_alloc(&p->importer->document.arena, 1, sizeof *preset);
        if (!preset || !keep_preset(p, &p->params.list.items[i], preset)) {
            ca_import_fail_memory(p->importer, "attributes");
            return;
        }
        preset->next = p->state.presets[target];
        p->state.presets[target] = preset;
        p->params.list.items[i].used = true;
    }
}

void ca_pbrt_run_color_space(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    for (uint32_t i = 0; i < CA_PBRT_SPACE_COUNT; i++)
        if (strcmp(ca_pbrt_space_names[i], s[0]) == 0) {
            p->state.space = i;
            return;
        }
    ca_import_fail(p->importer, &p->params.where, "ColorSpace \"%s\" is not known; the nearest is \"%s\"", s[0],
                   ca_nearest_name_however_far(s[0], ca_pbrt_space_names, CA_PBRT_SPACE_COUNT));
}
