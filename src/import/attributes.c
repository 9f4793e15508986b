/* Textures of the values at a mesh's vertices or faces. Which meshes there are is known at the end; until then a
 * colour that is made of such values is guarded, by a texture that keeps it within its range. */
#include "import/importer.h"

static bool has_attribute(const ca_scene_desc *desc, const char *name)
{
    for (size_t i = 0; i < desc->meshes.count; i++)
        if (ca_mesh_find_attribute(&desc->meshes.items[i], name)) return true;
    return false;
}

void ca_import_note_missing_attributes(ca_importer *importer)
{
    for (size_t i = 0; i < importer->attributes.count && ca_import_good(importer); i++) {
        const ca_import_attribute *attribute = &importer->attributes.items[i];
        if (!has_attribute(importer->desc, attribute->name))
            ca_import_note(importer, &attribute->where, "no mesh has the attribute of this texture: it is black");
    }
}

/* ---- Guards ---------------------------------------------------------------------------------------------------- */

typedef bool (*attribute_test)(const ca_texture *attribute);

static bool any_attribute(const ca_scene_desc *desc, ca_texture_id id, attribute_test test)
{
    const ca_texture *t = &desc->textures.items[id];
    ca_texture_id parts[3];
    const int count = ca_texture_parts(t, parts);
    for (int i = 0; i < count; i++)
        if (any_attribute(desc, parts[i], test)) return true;
    return t->kind == CA_TEXTURE_MESH_ATTRIBUTE && test(t);
}

static bool is_there(const ca_texture *attribute)
{
    (void)attribute;
    return true;
}

static bool is_negative(const ca_texture *attribute) { return attribute->as.mesh_attribute.negative; }

ca_texture_id ca_import_guard_attribute(ca_importer *importer, ca_texture_id id, bool share, const ca_location *where)
{
    ca_scene_desc *desc = importer->desc;
    if (!any_attribute(desc, id, is_there)) return CA_NONE;
    const ca_texture_id guard = ca_scene_desc_add_constant(desc, ca_rgb_grey(1.0f)); /* of the identity */
    if (guard == CA_NONE || !CA_TABLE_ADD(&importer->guards)) {
        ca_import_fail_memory(importer, "textures");
        return id;
    }
    ca_texture *texture = &desc->textures.items[guard];
    if (share) {
        texture->kind = CA_TEXTURE_CLAMP;
        texture->as.clamp.child = id;
    } else { /* a product is not negative */
        texture->kind = CA_TEXTURE_SCALE;
        texture->as.scale.child = id;
        texture->as.scale.factor = ca_rgb_grey(1.0f);
        texture->as.scale.varies = false;
    }
    importer->guards.items[importer->guards.count - 1] = (ca_import_guard){guard, id, share, *where};
    return guard;
}

/* ---- Values ---------------------------------------------------------------------------------------------------- */

/* What textures read: the first three components, or the first alone. */
static void measure(const ca_mesh *mesh, const ca_mesh_attribute *attribute, ca_texture *texture)
{
    const uint32_t components = attribute->components, read = components >= 3 ? 3 : 1;
    const size_t count = attribute->per_face ? mesh->triangle_count : mesh->vertex_count;
    float low = 0.0f, high = 0.0f;
    for (size_t i = 0; i < count; i++)
        for (uint32_t c = 0; c < read; c++) {
            const float value = attribute->values[i * components + c];
            low = ca_min(low, value);
            high = ca_max(high, value);
        }
    if (low < 0.0f) texture->as.mesh_attribute.negative = true;
    texture->as.mesh_attribute.most = ca_max(texture->as.mesh_attribute.most, ca_max(high, -low));
}

static void settle(ca_importer *importer, const ca_import_guard *guard)
{
    ca_scene_desc *desc = importer->desc;
    const double most = (double)ca_texture_bound(desc->textures.items, desc->images.items, guard->child);
    const bool negative = any_attribute(desc, guard->child, is_negative), over = guard->share && most > 1.0;
    if (negative)
        ca_import_note(importer, &guard->where,
                       "no colour is negative: negative values at vertices or faces are taken as 0");
    if (over)
        ca_import_note(importer, &guard->where,
                       "reflectances, weights and opacities lie in [0, 1]: values up to %g count as 1", most);
    if (!negative && !over) desc->textures.items[guard->id] = desc->textures.items[guard->child];
}

void ca_import_settle_attributes(ca_importer *importer)
{
    ca_scene_desc *desc = importer->desc;
    for (size_t i = 0; i < desc->textures.count && ca_import_good(importer); i++) {
        ca_texture *texture = &desc->textures.items[i];
        if (texture->kind != CA_TEXTURE_MESH_ATTRIBUTE) continue;
        for (size_t m = 0; m < desc->meshes.count; m++) {
            const ca_mesh *mesh = &desc->meshes.items[m];
            const ca_mesh_attribute *found = ca_mesh_find_attribute(mesh, texture->as.mesh_attribute.name);
            if (found) measure(mesh, found, texture);
        }
    }
    for (size_t i = importer->guards.count; i-- > 0 && ca_import_good(importer);)
        settle(importer, &importer->guards.items[i]);
}
