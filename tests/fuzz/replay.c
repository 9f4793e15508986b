/* Every input that is kept (tests/fuzz/NAME/) through the fuzzer of that name, once: seeds, and inputs that once
 * found a defect. Speaks TAP. With files as arguments behind a name, these through that one. */
#include "base/file.h"

#include <glob.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define FUZZER(name) int fuzz_##name(const uint8_t *data, size_t size);
#include "fuzzers.h"
#undef FUZZER

#define FUZZER(name) {#name, fuzz_##name},
static const struct fuzzer {
    const char *name;
    int (*run)(const uint8_t *data, size_t size);
} fuzzers[] = {
#include "fuzzers.h"
};
enum { FUZZERS = sizeof fuzzers / sizeof fuzzers[0], SECONDS_ALLOWED = 20 };

static bool run_file(const struct fuzzer *f, const char *path)
{
    ca_bytes bytes;
    ca_error error;
    if (ca_file_read(path, "input", (size_t)1 << 26, &bytes, &error) != CA_OK) {
        printf("# %s\n", error.message);
        return false;
    }
    (void)alarm(SECONDS_ALLOWED); /* ends the program: an input that takes for ever */
    f->run(bytes.data, bytes.size);
    (void)alarm(0);
    ca_bytes_destroy(&bytes);
    return true;
}

/* There is at least one. */
static bool run_corpus(const struct fuzzer *f)
{
    char pattern[512];
    glob_t found;
    snprintf(pattern, sizeof pattern, "%s/tests/fuzz/%s/*", CA_SOURCE_DIR, f->name);
    bool good = glob(pattern, 0, NULL, &found) == 0 && found.gl_pathc > 0;
    for (size_t i = 0; good && i < found.gl_pathc; i++) good = run_file(f, found.gl_pathv[i]);
    printf("# %s: %zu inputs\n", f->name, good ? found.gl_pathc : 0);
    globfree(&found);
    return good;
}

int main(int count, char *words[])
{
    int failures = 0;
    if (count < 2) printf("1..%d\n", FUZZERS);
    for (int i = 0; i < FUZZERS; i++) {
        if (count >= 2) {
            for (int k = 2; k < count && strcmp(words[1], fuzzers[i].name) == 0; k++)
                failures += !run_file(&fuzzers[i], words[k]);
            continue;
        }
        fflush(stdout);
        const bool good = run_corpus(&fuzzers[i]);
        printf("%s %d - %s\n", good ? "ok" : "not ok", i + 1, fuzzers[i].name);
        failures += !good;
    }
    return failures > 0;
}
