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

static void check(ca_importer *importer, ca_tree_size size, const char *what, const ca_location *where)
{
    if (size.height > MOST_HEIGHT || size.nodes > MOST_NODES)
        ca_import_fail(importer, where, "%s are made of at most %d others, nested at most %d deep", what,
                       MOST_NODES - 1, MOST_HEIGHT);
}

/* Those before it are known, and so are its parts, which were made before it. */
static bool add_texture(ca_importer *importer)
{
    const size_t id = importer->texture_sizes.count;
    ca_texture_id parts[3];
    if (!CA_TABLE_ADD(&importer->texture_sizes)) return false;
    ca_tree_size size = {.height = 1, .nodes = 1};
    const int count = ca_texture_parts(&importer->desc->textures.items[id], parts);
    for (int i = 0; i < count; i++) {
        assert(parts[i] < id);
        size = with_part(size, importer->texture_sizes.items[parts[i]]);
    }
    importer->texture_sizes.items[id] = size;
    return true;
}

void ca_import_limit_texture(ca_importer *importer, ca_texture_id id, const ca_location *where)
{
    bool enough = true;
    while (enough && importer->texture_sizes.count <= id) enough = add_texture(importer);
    if (enough)
        check(importer, importer->texture_sizes.items[id], "textures", where);
    else
        ca_import_fail_memory(importer, "textures");
}

static bool add_material(ca_importer *importer)
{
    const size_t id = importer->material_sizes.count;
    ca_material_id children[2];
    if (!CA_TABLE_ADD(&importer->material_sizes)) return false;
    ca_tree_size size = {.height = 1, .nodes = 1};
    const uint32_t count = ca_material_children(&importer->desc->materials.items[id].material, children);
    for (uint32_t i = 0; i < count; i++) {
        assert(children[i] < id);
        size = with_part(size, importer->material_sizes.items[children[i]]);
    }
    importer->material_sizes.items[id] = size;
    return true;
}

void ca_import_limit_material(ca_importer *importer, ca_material_id id, const ca_location *where)
{
    bool enough = true;
    while (enough && importer->material_sizes.count <= id) enough = add_material(importer);
    if (enough)
        check(importer, importer->material_sizes.items[id], "BSDFs", where);
    else
        ca_import_fail_memory(importer, "materials");
}
