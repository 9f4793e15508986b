#define _POSIX_C_SOURCE 200809L
#include "support/import_text.h"
#include "support/scene_text.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[64];

const char *import_folder(void)
{
    if (!folder[0]) {
        strcpy(folder, "/tmp/caustica-import-XXXXXX");
        assert_non_null(mkdtemp(folder));
    }
    return folder;
}

int import_remove_folder(void **state)
{
    (void)state;
    DIR *stream = folder[0] ? opendir(folder) : NULL;
    if (!stream) return 0;
    for (const struct dirent *entry; (entry = readdir(stream)) != NULL;) {
        char path[sizeof folder + sizeof entry->d_name + 1];
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        if (entry->d_name[0] != '.') (void)remove(path);
    }
    closedir(stream);
    (void)rmdir(folder);
    folder[0] = '\0';
    return 0;
}

const char *import_write(const char *name, const void *data, size_t size)
{
    static char paths[16][512];
    static int next;
    char *path = paths[next++ % 16];
    snprintf(path, sizeof paths[0], "%s/%s", import_folder(), name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
    return path;
}

const char *import_write_text(const char *name, const char *text) { return import_write(name, text, strlen(text)); }

void import_write_triangle(void)
{
    import_write_text("triangle.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 0.75\nf 1/1 2/2 3/3\n");
}

void import_write_picture(void)
{
    static const char header[] = "PF\n2 2\n-1.0\n";
    /* PFM's rows go from below. */
    static const float pixels[12] = {0, 0, 1, 2, 2, 2, 1, 0, 0, 0, 1, 0};
    unsigned char bytes[sizeof header - 1 + sizeof pixels];
    memcpy(bytes, header, sizeof header - 1);
    memcpy(bytes + sizeof header - 1, pixels, sizeof pixels);
    import_write("picture.pfm", bytes, sizeof bytes);
}

static ca_status run(ca_scene_desc *desc, const char *text, const ca_define *defines, size_t define_count,
                     ca_error *error)
{
    char path[128];
    snprintf(path, sizeof path, "%s/test.xml", import_folder());
    return ca_import_scene_text(text, strlen(text), path, defines, define_count, desc, error);
}

void import_text(ca_scene_desc *desc, const char *text, const ca_define *defines, size_t define_count)
{
    ca_error error;
    if (run(desc, text, defines, define_count, &error) != CA_OK) fail_msg("%s", error.message);
}

void import_expect_error(const char *text, const char *expected)
{
    ca_scene_desc desc;
    ca_error error;
    char full[1400];
    snprintf(full, sizeof full, "%s/test.xml:%s", import_folder(), expected);
    if (run(&desc, text, NULL, 0, &error) == CA_OK) {
        ca_scene_desc_destroy(&desc);
        fail_msg("imported, but expected the error %s", expected);
    }
    assert_string_equal(error.message, full);
    assert_int_equal(desc.shapes.count, 0);
}

ca_image_layers *import_render_text(const char *text, const char *name)
{
    char path[128];
    ca_scene *scene;
    ca_error error;
    snprintf(path, sizeof path, "%s/%s", import_folder(), name);
    const ca_scene_source source = {.text = text, .size = strlen(text), .path = path};
    if (ca_scene_parse(&source, &scene, &error) != CA_OK) fail_msg("%s", error.message);
    const ca_render_settings settings = {.threads = 1};
    ca_image_layers *image = render_scene(scene, &settings);
    ca_scene_release(scene);
    return image;
}
