#include "report/page_files.h"

#include <string.h>

const ca_page_file *ca_page_file_named(const char *name)
{
    size_t i = 0;
    while (strcmp(ca_page_files[i].name, name) != 0) i++;
    return &ca_page_files[i];
}
