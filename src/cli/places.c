#include "cli/places.h"

#include "base/memory.h"
#include "scene/scene.h"

#include <stdio.h>
#include <string.h>

static void destroy_place(ca_place *place)
{
    ca_free(place->path);
    ca_free(place->name);
}

void ca_places_destroy(ca_places *places)
{
    for (size_t i = 0; i < places->count; i++) destroy_place(&places->items[i]);
    ca_free(places->items);
    *places = (ca_places){0};
}

/* ---- Which file that is ---------------------------------------------------------------------------------------- */

/* Of a file that is not there: its folder. `end` is where the links of its name end; it becomes its name alone. */
static void find_folder(ca_place *place, char *end)
{
    char *slash = strrchr(end, '/');
    if (slash) *slash = '\0';
    const char *folder = !slash ? "." : slash == end ? "/" : end;
    place->is_known = ca_file_identify(folder, &place->identity);
    if (slash && place->is_known) memmove(end, slash + 1, strlen(slash + 1) + 1);
    if (slash && !place->is_known) *slash = '/';
    place->name = end;
}

static ca_status identify(ca_place *place, ca_error *error)
{
    place->is_known = ca_file_identify(place->path, &place->identity);
    if (place->is_known) return CA_OK;
    char *end = ca_path_follow(place->path);
    if (!end) end = ca_path_resolve(NULL, place->path); /* no end that is known: a file of its own */
    if (!end) return ca_fail_memory(error, place->path);
    find_folder(place, end);
    return CA_OK;
}

static bool is_same(const ca_place *a, const ca_place *b)
{
    if (a->is_known != b->is_known || !a->name != !b->name || (a->name && strcmp(a->name, b->name) != 0))
        return false;
    return !a->is_known || ca_file_identity_compare(&a->identity, &b->identity) == 0;
}

/* ---- Whether it may be written --------------------------------------------------------------------------------- */

/* " (as PATH)" where the file that is read goes by another name. */
static ca_status fail_overwriting(const ca_place *written, const ca_place *read, ca_error *error)
{
    if (strcmp(written->path, read->path) == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%s would overwrite %s, %s", written->option, written->path,
                       read->use);
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%s would overwrite %.400s, %s (as %.400s)", written->option,
                   written->path, read->use, read->path);
}

static ca_status check_pair(const ca_place *a, const ca_place *b, ca_error *error)
{
    if ((!a->option && !b->option) || !is_same(a, b)) return CA_OK;
    if (!a->option) return fail_overwriting(b, a, error);
    if (!b->option) return fail_overwriting(a, b, error);
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%s %.400s and %s %.400s are the same file", a->option, a->path,
                   b->option, b->path);
}

static ca_status check_all(const ca_places *places, const ca_place *place, ca_error *error)
{
    for (size_t i = 0; i < places->count; i++) CA_TRY(check_pair(&places->items[i], place, error));
    return CA_OK;
}

static ca_status make_place(const ca_places *places, const char *path, const char *option, const char *use,
                            ca_place *place, ca_error *error)
{
    *place = (ca_place){.path = ca_path_resolve(NULL, path), .option = option, .use = use};
    ca_status status = place->path ? identify(place, error) : ca_fail_memory(error, path);
    if (status == CA_OK) status = check_all(places, place, error);
    if (status != CA_OK) destroy_place(place);
    return status;
}

static ca_status add(ca_places *places, const char *path, const char *option, const char *use, ca_error *error)
{
    ca_place *items = ca_array_grow(places->items, &places->capacity, places->count + 1, sizeof *items);
    if (!items) return ca_fail_memory(error, "the command line");
    places->items = items;
    ca_place place;
    CA_TRY(make_place(places, path, option, use, &place, error));
    places->items[places->count++] = place;
    return CA_OK;
}

ca_status ca_places_read(ca_places *places, const char *path, const char *use, ca_error *error)
{
    return add(places, path, NULL, use, error);
}

ca_status ca_places_read_scene(ca_places *places, const ca_scene *scene, ca_error *error)
{
    const ca_path_table *files = &scene->desc.files;
    for (size_t i = 0; i < files->count; i++)
        CA_TRY(ca_places_read(places, files->items[i], "from which the scene is read", error));
    return CA_OK;
}

ca_status ca_places_write(ca_places *places, const char *path, const char *option, ca_error *error)
{
    return add(places, path, option, NULL, error);
}

ca_status ca_places_check(const ca_places *places, const char *path, const char *option, ca_error *error)
{
    ca_place place;
    CA_TRY(make_place(places, path, option, NULL, &place, error));
    destroy_place(&place);
    return CA_OK;
}

ca_status ca_places_write_in(ca_places *places, const char *folder, const char *name, const char *option,
                             ca_error *error)
{
    const size_t size = strlen(folder) + strlen(name) + 2;
    char *path = ca_alloc(size, 1);
    if (!path) return ca_fail_memory(error, folder);
    snprintf(path, size, "%s/%s", folder, name);
    const ca_status status = ca_places_write(places, path, option, error);
    ca_free(path);
    return status;
}
