/* Names of the scene, and ids in the tree, which no two objects share. */
#include "import/pbrt/reader.h"

#include "base/text.h"

#include <stdio.h>
#include <string.h>

ca_pbrt_named *ca_pbrt_name(ca_pbrt_names *names, const char *name)
{
    for (size_t i = names->count; i-- > 0;)
        if (strcmp(names->items[i].name, name) == 0) return &names->items[i];
    return NULL;
}

ca_pbrt_named *ca_pbrt_define(ca_pbrt *p, ca_pbrt_names *names, const char *name)
{
    ca_pbrt_named *there = ca_pbrt_name(names, name);
    if (!there) {
        if (!CA_TABLE_ADD(names)) {
            ca_import_fail_memory(p->importer, "names");
            return NULL;
        }
        there = &names->items[names->count - 1];
    }
    *there = (ca_pbrt_named){.name = name};
    return there;
}

void ca_pbrt_fail_name(ca_pbrt *p, const ca_location *where, const char *what, const char *name,
                       const ca_pbrt_names *names)
{
    const char *nearest = NULL;
    for (size_t i = 0; i < names->count; i++) nearest = ca_nearer_name(name, nearest, names->items[i].name);
    ca_import_fail(p->importer, where, "there is no %s \"%s\"%s%s%s", what, name,
                   nearest ? "; the nearest is \"" : "", nearest ? nearest : "", nearest ? "\"" : "");
}

const char *ca_pbrt_new_id(ca_pbrt *p, const char *what, const char *name)
{
    char number[32];
    snprintf(number, sizeof number, "%u", ++p->next_id);
    const size_t size = strlen(what) + (name ? strlen(name) : 0) + strlen(number) + 5;
    char *id = ca_arena_alloc(&p->importer->document.arena, size, 1);
    if (!id) {
        ca_import_fail_memory(p->importer, "names");
        return NULL;
    }
    snprintf(id, size, "%s %s%s%s", what, number, name ? ": " : "", name ? name : "");
    return id;
}
