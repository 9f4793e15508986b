/* Damaged meshes and images of every format, read by every reader: no crash, no leak (under the sanitizers of the
 * preset `asan`), no file that takes longer than 5 seconds.
 *
 * CA_MUTATIONS: number of files (20000). CA_MUTATION_SEED: which ones (1). Each mutation depends on seed and number
 * only; the file that kills the test is the one left in the folder that the first line names. */
#define _POSIX_C_SOURCE 200809L
#include "support/sample_files.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

enum { SECONDS_ALLOWED = 5 };

/* A multiplicative hash of (seed, number, draw): good enough to choose places and bytes. */
static uint64_t state;

static uint32_t draw(uint32_t below)
{
    state += UINT64_C(0x9e3779b97f4a7c15);
    uint64_t z = state;
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return (uint32_t)((z ^ (z >> 31)) % below);
}

/* Places near the start are hit more often: headers are small beside the data. */
static size_t draw_place(size_t size)
{
    const uint32_t range = draw(3) == 0 && size > 128 ? 128 : (uint32_t)size;
    return draw(range ? range : 1);
}

static void overwrite_number(sample_bytes *bytes)
{
    static const uint32_t numbers[] = {0,          1,          0x7f,       0xff,       0x7fff,    0x8000,
                                       0xffff,     0x7fffffff, 0x80000000, 0xffffffff, 0xfffffffe, 0x10000,
                                       0x7f800000, 0x7fc00000, 0xff800000, 0x00ffffff};
    const uint32_t number = numbers[draw(sizeof numbers / sizeof *numbers)];
    const size_t place = draw_place(bytes->size), width = (size_t)1 << draw(3);
    const bool big_endian = draw(2);
    for (size_t i = 0; i < width && place + i < bytes->size; ++i)
        bytes->data[place + i] = (unsigned char)(number >> (8 * (big_endian ? width - 1 - i : i)));
}

/* Digits of a text header become other digits. */
static void change_digit(sample_bytes *bytes)
{
    size_t place = draw_place(bytes->size);
    for (size_t i = 0; i < bytes->size; ++i, place = (place + 1) % bytes->size)
        if (bytes->data[place] >= '0' && bytes->data[place] <= '9') {
            bytes->data[place] = (unsigned char)("0123456789-.eE/ "[draw(16)]);
            return;
        }
}

static void move_block(sample_bytes *bytes)
{
    const size_t from = draw((uint32_t)bytes->size), to = draw((uint32_t)bytes->size);
    const size_t longest = bytes->size - (from > to ? from : to);
    memmove(bytes->data + to, bytes->data + from, draw((uint32_t)longest + 1));
}

static void remove_block(sample_bytes *bytes)
{
    const size_t from = draw((uint32_t)bytes->size);
    size_t length = draw(16) + 1u;
    if (length > bytes->size - from) length = bytes->size - from;
    memmove(bytes->data + from, bytes->data + from + length, bytes->size - from - length);
    bytes->size -= length;
}

static void mutate(sample_bytes *bytes)
{
    for (uint32_t rounds = 1 + draw(4); rounds-- > 0 && bytes->size > 0;) {
        const size_t place = draw_place(bytes->size);
        switch (draw(8)) {
        case 0: bytes->data[place] ^= (unsigned char)(1u << draw(8)); break;
        case 1: bytes->data[place] = (unsigned char)draw(256); break;
        case 2: bytes->data[place] = (unsigned char)(bytes->data[place] + draw(3) - 1); break;
        case 3: overwrite_number(bytes); break;
        case 4: change_digit(bytes); break;
        case 5: move_block(bytes); break;
        case 6: remove_block(bytes); break;
        default: bytes->size = draw((uint32_t)bytes->size + 1); break;
        }
    }
}

static long setting(const char *name, long otherwise)
{
    const char *text = getenv(name);
    return text ? strtol(text, NULL, 10) : otherwise;
}

static double now(void)
{
    struct timespec t;
    timespec_get(&t, TIME_UTC);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void readers_survive_mutations(void **unused)
{
    (void)unused;
    const long count = setting("CA_MUTATIONS", 20000), seed = setting("CA_MUTATION_SEED", 1);
    sample_file *files;
    const size_t file_count = sample_files_make(&files);
    char folder[64];
    sample_folder_make(folder);
    print_message("# %ld mutations of %zu files, in %s\n", count, file_count, folder);
    long accepted = 0;
    double slowest = 0.0;
    for (long i = 0; i < count; ++i) {
        const sample_file *file = &files[(size_t)i % file_count];
        state = (uint64_t)seed << 32 ^ (uint64_t)i * UINT64_C(0x2545f4914f6cdd1d);
        sample_bytes mutated = {0};
        sample_append(&mutated, file->bytes.data, file->bytes.size);
        mutate(&mutated);
        char path[256];
        snprintf(path, sizeof path, "%s/%s", folder, file->name);
        sample_write(path, mutated.data, mutated.size);
        sample_free(&mutated);

        ca_error error = {{0}};
        const double start = now();
        alarm(2 * SECONDS_ALLOWED); /* a reader that never returns ends the program */
        const ca_status status = sample_read(path, file->is_mesh, &error);
        alarm(0);
        const double seconds = now() - start;
        if (seconds > slowest) slowest = seconds;
        if (seconds > SECONDS_ALLOWED) fail_msg("mutation %ld of %s took %.1f s", i, file->name, seconds);
        if (status != CA_OK && error.message[0] == '\0') fail_msg("mutation %ld of %s: no message", i, file->name);
        accepted += status == CA_OK;
    }
    print_message("# %ld of %ld were still readable; the slowest took %.3f s\n", accepted, count, slowest);
    sample_folder_remove(folder);
    sample_files_free(files, file_count);
}

static void samples_are_readable(void **unused)
{
    (void)unused;
    sample_file *files;
    const size_t file_count = sample_files_make(&files);
    char folder[64], path[256];
    sample_folder_make(folder);
    for (size_t i = 0; i < file_count; ++i) {
        ca_error error = {{0}};
        snprintf(path, sizeof path, "%s/%s", folder, files[i].name);
        sample_write(path, files[i].bytes.data, files[i].bytes.size);
        if (sample_read(path, files[i].is_mesh, &error) != CA_OK) fail_msg("%s", error.message);
    }
    sample_folder_remove(folder);
    sample_files_free(files, file_count);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_are_readable),
        cmocka_unit_test(readers_survive_mutations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
