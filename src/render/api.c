/* The public calls of caustica.h that only pass things on. */
#include "import/import.h"
#include "render/render.h"

#define CA_TEXT_(x) #x
#define CA_TEXT(x) CA_TEXT_(x)

const char *ca_version(void)
{
    return CA_TEXT(CA_VERSION_MAJOR) "." CA_TEXT(CA_VERSION_MINOR) "." CA_TEXT(CA_VERSION_PATCH);
}

ca_status ca_scene_load_sensor(const char *path, const ca_define *defines, size_t define_count, uint32_t sensor,
                               ca_scene **scene, ca_error *error)
{
    *scene = NULL;
    ca_scene_desc desc;
    CA_TRY(ca_import_scene_sensor(path, defines, define_count, sensor, &desc, error));
    return ca_scene_compile(&desc, scene, error);
}

ca_status ca_scene_load(const char *path, const ca_define *defines, size_t define_count, ca_scene **scene,
                        ca_error *error)
{
    return ca_scene_load_sensor(path, defines, define_count, 0, scene, error);
}

const char *ca_scene_note(const ca_scene *scene, size_t index)
{
    return index < scene->desc.notes.count ? scene->desc.notes.items[index] : NULL;
}

void ca_scene_release(ca_scene *scene) { ca_scene_destroy(scene); }

void ca_render_settings_init(ca_render_settings *settings) { *settings = (ca_render_settings){0}; }

void ca_image_size(const ca_image_layers *image, uint32_t *width, uint32_t *height)
{
    *width = image->width;
    *height = image->height;
}

const float *ca_image_channel(const ca_image_layers *image, const char *name) { return ca_layers_find(image, name); }

ca_status ca_image_save(const ca_image_layers *image, const char *path, float exposure, ca_error *error)
{
    return ca_layers_write(image, path, exposure, error);
}

void ca_image_release(ca_image_layers *image) { ca_layers_destroy(image); }
