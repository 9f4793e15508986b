#define _POSIX_C_SOURCE 200809L
#include "cli/outputs.h"

#include "base/file.h"
#include "base/memory.h"

#include <string.h>
#include <sys/stat.h>

ca_status ca_output_check_place(const char *path, ca_error *error)
{
    struct stat info;
    if (stat(path, &info) == 0 && !S_ISREG(info.st_mode))
        return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot write: this is not a regular file", path);
    ca_file_writer writer;
    CA_TRY(ca_file_create(&writer, path, error));
    ca_file_abandon(&writer);
    return CA_OK;
}

char *ca_output_default(const char *scene_path, const char *extension)
{
    const char *slash = strrchr(scene_path, '/'), *name = slash ? slash + 1 : scene_path;
    const size_t length = strlen(name) - strlen(ca_path_extension(name));
    char *path = ca_alloc(length + strlen(extension) + 1, 1);
    if (!path) return NULL;
    memcpy(path, name, length);
    memcpy(path + length, extension, strlen(extension) + 1);
    return path;
}
