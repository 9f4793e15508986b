#include "support/sample_folder.h"

#include "base/memory.h"
#include "support/sample_files.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

char folder[64];

int make_folder(void **unused)
{
    (void)unused;
    sample_folder_make(folder);
    return 0;
}

int remove_folder(void **unused)
{
    (void)unused;
    sample_folder_remove(folder);
    return 0;
}

const char *path_to(const char *name)
{
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static ca_status read_with_a_failure(const sample_file *file, const char *path, bool meshes, long n)
{
    ca_error error = {{0}};
    ca_memory_fail_after(n);
    const ca_status status = sample_read(path, meshes, &error);
    ca_memory_fail_after(-1);
    if (status != CA_OK && status != CA_ERROR_MEMORY)
        fail_msg("%s, allocation %ld: %s", file->name, n, error.message);
    return status;
}

void check_sample_allocations(bool meshes, long least)
{
    enum { BEYOND = 40 }; /* a reader that did without what found no memory would have allocations behind it */
    sample_file *files;
    const size_t count = sample_files_make(&files);
    size_t checked = 0;
    for (size_t i = 0; i < count; ++i) {
        if (files[i].is_mesh != meshes) continue;
        const char *path = path_to(files[i].name);
        sample_write(path, files[i].bytes.data, files[i].bytes.size);
        long n = 0;
        while (read_with_a_failure(&files[i], path, meshes, n) != CA_OK) ++n;
        if (n + 1 < least) fail_msg("%s: only %ld allocations", files[i].name, n);
        for (long k = n + 1; k < n + BEYOND; ++k)
            if (read_with_a_failure(&files[i], path, meshes, k) != CA_OK)
                fail_msg("%s: read although allocation %ld failed", files[i].name, n);
        checked++;
    }
    assert_true(checked > 2);
    sample_files_free(files, count);
}
