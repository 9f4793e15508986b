/* How large trees of textures and materials may be. Each is walked by recursion, and what refers to parts that were
 * made before may be of any height, or of any size where it has one part twice. */
#include "import/importer.h"

#include <assert.h>

enum { MOST_HEIGHT = 64, MOST_NODES = 4096 };

static ca_tree_size with_part(ca_tree_size whole, ca_tree_size part)
{
    if (part.height >= whole.height) whole.height = part.height + 1;
    whole.nodes += part.nodes;
    if (whole.nodes > MOST_NODES) whole.nodes = MOST_NODES + 1; /* sums stay small */
    return whole;
}

/* Those before it are known, and so are its parts, which were made before it. */
static bool add(ca_tree_sizes *sizes, const uint32_t *parts, uint32_t count)
{
    ca_tree_size size = {.height = 1, .nodes = 1};
    for (uint32_t i = 0; i < count; i++) {
        assert(parts[i] < sizes->count);
        size = with_part(size, sizes->items[parts[i]]);
    }
    if (!CA_TABLE_ADD(sizes)) return false;
    sizes->items[sizes->count - 1] = size;
    return true;
}

static void check(ca_importer *importer, const ca_tree_sizes *sizes, uint32_t id, const char *what,
                  const ca_location *where)
{
    if (sizes->count <= id)
        ca_import_fail_memory(importer, what);
    else if (sizes->items[id].height > MOST_HEIGHT || sizes->items[id].nodes > MOST_NODES)
        ca_import_fail(importer, where, "%s are made of at most %d others, nested at most %d deep", what,
                       MOST_NODES - 1, MOST_HEIGHT);
}

void ca_import_limit_texture(ca_importer *importer, ca_texture_id id, const ca_location *where)
{
    ca_tree_sizes *sizes = &importer->texture_sizes;
    ca_texture_id parts[3];
    bool enough = true;
    while (enough && sizes->count <= id) {
        const int count = ca_texture_parts(&importer->desc->textures.items[sizes->count], parts);
        enough = add(sizes, parts, (uint32_t)count);
    }
    check(importer, sizes, id, "textures", where);
}

void ca_import_limit_material(ca_importer *importer, ca_material_id id, const ca_location *where)
{
    ca_tree_sizes *sizes = &importer->material_sizes;
    ca_material_id children[2];
    bool enough = true;
    while (enough && sizes->count <= id) {
        const ca_material *material = &importer->desc->materials.items[sizes->count].material;
        enough = add(sizes, children, ca_material_children(material, children));
    }
    check(importer, sizes, id, "BSDFs", where);
}
