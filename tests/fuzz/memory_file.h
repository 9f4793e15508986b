/* A file in memory, for readers that want a path. Included by fuzzers only. */
#ifndef CA_FUZZ_MEMORY_FILE_H
#define CA_FUZZ_MEMORY_FILE_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

/* Its path; the same file for every call. _GNU_SOURCE must be defined. */
static inline const char *memory_file(const uint8_t *data, size_t size)
{
    static char path[64];
    static int file = -1;
    if (file < 0) {
        file = memfd_create("fuzz", MFD_CLOEXEC);
        snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    }
    if (ftruncate(file, 0) != 0 || (size > 0 && pwrite(file, data, size, 0) != (ssize_t)size)) abort();
    return path;
}

#endif
