#include "support/sample_folder.h"

#include "support/sample_files.h"

#include <stdio.h>

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
