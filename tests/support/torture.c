#define _GNU_SOURCE
#include "support/torture.h"

#include "base/memory.h"
#include "film/part_file.h"
#include "film/part_stream.h"
#include "film/pass_part.h"
#include "image/layers.h"

#include <errno.h>
#include <ftw.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmocka.h>
#include <jansson.h>

static const char *const kind_names[] = {"own", "file", "thread", "monitor", "foreign", "foreign-thread"};
static const char old_content[] = "old\n"; /* of every output before a run */

static int failures;

enum { SECONDS_ALLOWED = 60, MOST_FAILURES = 40 };

const char *torture_kind_name(torture_kind kind) { return kind_names[kind]; }

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static ca_bytes read_all(const char *folder, const char *name)
{
    char path[512];
    ca_bytes bytes;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    (void)ca_file_read(path, "file", (size_t)1 << 30, &bytes, NULL);
    return bytes;
}

static void write_all(const char *folder, const char *name, const void *bytes, size_t size)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(bytes, 1, size, file) != size || fclose(file) != 0) fail_msg("%s cannot be written", path);
}

static void copy(const char *folder, const char *from, const char *to)
{
    ca_bytes bytes = read_all(folder, from);
    if (!bytes.data) fail_msg("%s is not there", from);
    write_all(folder, to, bytes.data, bytes.size);
    ca_bytes_destroy(&bytes);
}

static bool equal(const ca_bytes *a, const void *b, size_t size)
{
    return a->data && a->size == size && memcmp(a->data, b, size) == 0;
}

static bool is_page(const char *folder, const char *name)
{
    static const char end[] = "</html>\n";
    ca_bytes bytes = read_all(folder, name);
    const size_t length = sizeof end - 1;
    const bool good = bytes.data && bytes.size > length && memcmp(bytes.data + bytes.size - length, end, length) == 0;
    ca_bytes_destroy(&bytes);
    return good;
}

/* Of several films: all of its bytes are there. */
static bool is_joined_part(const char *path)
{
    FILE *stream;
    uint64_t size, format;
    if (ca_part_open(path, &stream, &size, &format, NULL) != CA_OK) return false;
    const bool good = format == CA_JOINED_PART_FORMAT && ca_part_check_hash(stream, size);
    fclose(stream);
    return good;
}

static bool is_part(const char *path)
{
    ca_pass_reader reader;
    ca_part part;
    if (ca_pass_reader_open(&reader, path, NULL) == CA_OK) {
        ca_pass_reader_close(&reader);
        return true;
    }
    if (ca_part_read(path, &part, NULL) != CA_OK) return is_joined_part(path);
    ca_part_destroy(&part);
    return true;
}

static bool is_complete(const char *folder, const char *name)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    const char *extension = ca_path_extension(name);
    if (strcmp(extension, ".html") == 0) return is_page(folder, name);
    if (strcmp(extension, ".part") == 0) return is_part(path);
    if (strcmp(extension, ".json") == 0) {
        json_t *root = json_load_file(path, 0, NULL);
        json_decref(root);
        return root != NULL;
    }
    ca_image_layers *layers;
    if (ca_layers_read(path, &layers, NULL) != CA_OK) return false;
    ca_layers_destroy(layers);
    return true;
}

/* ---- Equal contents -------------------------------------------------------------------------------------------- */

static bool same_bytes(const char *folder, const char *a, const char *b)
{
    ca_bytes x = read_all(folder, a), y = read_all(folder, b);
    const bool same = y.data && equal(&x, y.data, y.size);
    ca_bytes_destroy(&x);
    ca_bytes_destroy(&y);
    return same;
}

/* All layers, to the bit; attributes have times. */
static bool same_layers(const char *a, const char *b)
{
    ca_image_layers *x = NULL, *y = NULL;
    bool same = ca_layers_read(a, &x, NULL) == CA_OK && ca_layers_read(b, &y, NULL) == CA_OK &&
                x->channel_count == y->channel_count && x->width == y->width && x->height == y->height;
    for (size_t c = 0; same && c < x->channel_count; c++)
        same = strcmp(x->channels[c].name, y->channels[c].name) == 0 &&
               memcmp(x->channels[c].data, y->channels[c].data, (size_t)x->width * x->height * sizeof(float)) == 0;
    ca_layers_destroy(x);
    ca_layers_destroy(y);
    return same;
}

/* What a part adds up to: its settings, ranges, counts and sums; not its times. */
static bool read_sums(const char *path, ca_bytes *sums)
{
    ca_pass_reader reader;
    ca_film film;
    if (ca_pass_reader_open(&reader, path, NULL) != CA_OK) return false;
    bool good = ca_pass_film_create(&film, &reader.film, NULL) == CA_OK &&
                ca_pass_reader_add(&reader, &film, true, NULL) == CA_OK;
    const size_t text = strlen(reader.part.settings), row = good ? ca_film_row_bytes(&film) : 0;
    const size_t ranges = reader.part.range_count * sizeof *reader.part.ranges;
    sums->size = text + ranges + row * (good ? film.height : 0);
    sums->data = ca_alloc(sums->size, 1);
    good = good && sums->data;
    if (good) {
        memcpy(sums->data, reader.part.settings, text);
        memcpy(sums->data + text, reader.part.ranges, ranges);
        for (uint32_t y = 0; y < film.height; y++) ca_film_write_row(&film, y, sums->data + text + ranges + y * row);
    }
    ca_film_destroy(&film);
    ca_pass_reader_close(&reader);
    return good;
}

/* Those of blocks and of joined films: it is enough that they are whole. */
static bool same_sums(const char *a, const char *b)
{
    ca_bytes x = {0}, y = {0};
    const bool is_of_passes = read_sums(b, &y), read = read_sums(a, &x);
    const bool same = is_of_passes ? read && equal(&x, y.data, y.size) : !read;
    ca_bytes_destroy(&x);
    ca_bytes_destroy(&y);
    return same;
}

/* As far as two runs have the same: times differ. */
static bool same_content(const char *folder, const torture_command *command, const char *output, const char *other)
{
    char a[512], b[512];
    const char *extension = ca_path_extension(output);
    snprintf(a, sizeof a, "%s/%s", folder, output);
    snprintf(b, sizeof b, "%s/%s", folder, other);
    if (command->varies) return true;
    if (strcmp(extension, ".exr") == 0) return same_layers(a, b);
    if (strcmp(extension, ".part") == 0) return same_sums(a, b);
    const bool is_picture = strcmp(extension, ".pfm") == 0 || strcmp(extension, ".png") == 0;
    return (!is_picture && !command->is_exact) || same_bytes(folder, output, other);
}

/* Beside the outputs, of which some are in a folder that comes and goes. */
static void reference_name(char name[256], const torture_command *command, const char *output)
{
    snprintf(name, 256, "%s.%s.reference%s", output, command->name, ca_path_extension(output));
    for (char *slash = name; (slash = strchr(slash, '/')) != NULL;) *slash = '-';
}

/* ---- Before and after a run ------------------------------------------------------------------------------------ */

static int remove_one(const char *path, const struct stat *info, int kind, struct FTW *place)
{
    (void)info, (void)kind, (void)place;
    return remove(path);
}

static void remove_folder(const char *folder, const torture_command *command)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, command->folder);
    nftw(path, remove_one, 16, FTW_DEPTH | FTW_PHYS);
}

static void kept_name(char name[128], const char *output) { snprintf(name, 128, "%s.kept", output); }

static void reset_outputs(const char *folder, const torture_command *command)
{
    char kept[128];
    if (command->folder) {
        remove_folder(folder, command);
        return;
    }
    for (int i = 0; i < TORTURE_OUTPUTS && command->outputs[i]; i++) {
        const char *output = command->outputs[i];
        kept_name(kept, output);
        if (command->kept && strcmp(command->kept, output) == 0)
            copy(folder, kept, output);
        else
            write_all(folder, output, old_content, sizeof old_content - 1);
    }
}

/* What it was before the run. */
static bool is_as_before(const char *folder, const torture_command *command, const char *output)
{
    char kept[128];
    ca_bytes now = read_all(folder, output), before = {0};
    bool same = command->folder ? !now.data : equal(&now, old_content, sizeof old_content - 1);
    kept_name(kept, output);
    if (command->kept && strcmp(command->kept, output) == 0) {
        before = read_all(folder, kept);
        same = before.data && equal(&now, before.data, before.size);
    }
    ca_bytes_destroy(&now);
    ca_bytes_destroy(&before);
    return same;
}

/* ---- Runs ------------------------------------------------------------------------------------------------------ */

/* Variables that reach the program alone: they are set between fork and exec of a child that exits. */
static void run(const ca_program *program, const torture_command *command, const char *kind, long at, bool stays,
                ca_program_result *result)
{
    char number[32], report[128];
    snprintf(number, sizeof number, "%ld", at);
    snprintf(report, sizeof report, "%s/.faults", program->folder);
    unlink(report);
    if (kind) {
        setenv("LD_PRELOAD", CA_BUILD_DIR "/tests/libcaustica-faults.so", 1);
        setenv("CA_FAULT_KIND", kind, 1);
        setenv("CA_FAULT_AT", number, 1);
        setenv("CA_FAULT_STAYS", stays ? "1" : "0", 1);
        setenv("CA_FAULT_REPORT", report, 1);
    }
    const struct rlimit no_core = {0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    const pid_t process = ca_program_start(program, command->words, -1);
    unsetenv("LD_PRELOAD");
    unsetenv("CA_FAULT_KIND");
    (void)alarm(SECONDS_ALLOWED); /* ends this program where that one does not end */
    ca_program_finish(program, process, result);
    (void)alarm(0);
}

void torture_keep_reference(const ca_program *program, const torture_command *command)
{
    ca_program_result result;
    char name[256];
    reset_outputs(program->folder, command);
    run(program, command, NULL, 0, false, &result);
    if (result.exit_status != 0) fail_msg("%s fails without a fault:\n%s", command->name, result.errors);
    for (int i = 0; i < TORTURE_OUTPUTS && command->outputs[i]; i++) {
        if (!is_complete(program->folder, command->outputs[i])) fail_msg("%s is not written", command->outputs[i]);
        reference_name(name, command, command->outputs[i]);
        copy(program->folder, command->outputs[i], name);
    }
}

/* ---- Which calls ----------------------------------------------------------------------------------------------- */

typedef struct counted_call {
    uint64_t stack;
    long number;
} counted_call;

static int by_stack(const void *a, const void *b)
{
    const counted_call *x = a, *y = b;
    if (x->stack != y->stack) return x->stack < y->stack ? -1 : 1;
    return x->number < y->number ? -1 : x->number > y->number;
}

static int by_number(const void *a, const void *b)
{
    const long x = *(const long *)a, y = *(const long *)b;
    return x < y ? -1 : x > y;
}

static size_t read_calls(const ca_program *program, counted_call **calls)
{
    ca_bytes bytes = read_all(program->folder, ".faults");
    const size_t count = bytes.size / 17;
    *calls = calloc(count + 1, sizeof **calls);
    for (size_t i = 0; i < count; i++)
        (*calls)[i] = (counted_call){strtoull((const char *)bytes.data + 17 * i, NULL, 16), (long)i + 1};
    ca_bytes_destroy(&bytes);
    return count;
}

void torture_calls_find(torture_calls *calls, const ca_program *program, const torture_command *command,
                        torture_kind kind, long every)
{
    ca_program_result result;
    counted_call *all;
    reset_outputs(program->folder, command);
    run(program, command, kind_names[kind], 0, false, &result);
    if (result.exit_status != 0) fail_msg("%s fails without a fault:\n%s", command->name, result.errors);
    const size_t count = read_calls(program, &all);
    *calls = (torture_calls){.command = command, .kind = kind};
    calls->numbers = calloc(count + 1, sizeof *calls->numbers);
    qsort(all, count, sizeof *all, by_stack);
    for (size_t i = 0; i < count; i++)
        if (i == 0 || all[i].stack != all[i - 1].stack) calls->numbers[calls->count++] = all[i].number;
    qsort(calls->numbers, calls->count, sizeof *calls->numbers, by_number);
    const size_t stacks = calls->count;
    for (size_t i = 0, s = 0; i < count && (long)i < every; i++) {
        while (s < stacks && calls->numbers[s] < (long)i + 1) s++;
        if (s == stacks || calls->numbers[s] != (long)i + 1) calls->numbers[calls->count++] = (long)i + 1;
    }
    free(all);
}

void torture_calls_free(torture_calls *calls)
{
    free(calls->numbers);
    *calls = (torture_calls){0};
}

/* ---- What must hold -------------------------------------------------------------------------------------------- */

typedef struct faulty_run {
    const ca_program *program;
    const torture_command *command;
    torture_kind kind;
    long at;
    bool stays;
    ca_program_result result;
} faulty_run;

static void fail_run(const faulty_run *f, const char *format, ...) CA_PRINTF(2, 3);

static void fail_run(const faulty_run *f, const char *format, ...)
{
    char what[512];
    va_list list;
    va_start(list, format);
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    ca_bytes report = read_all(f->program->folder, ".faults");
    print_error("CA_TORTURE_ONLY=%s:%s:%ld:%d %s\nexit status %d, signal %d\n%.500s%.1000s\n%.700s\n",
                f->command->name, kind_names[f->kind], f->at, f->stays, what, f->result.exit_status, f->result.signal,
                f->result.output, f->result.errors, report.data ? (const char *)report.data : "");
    ca_bytes_destroy(&report);
    if (++failures >= MOST_FAILURES) fail_msg("%d runs failed", failures);
}

int torture_failures(void) { return failures; }

static bool names_cause(const faulty_run *f)
{
    const char *errors = f->result.errors;
    switch (f->kind) {
    case TORTURE_FILES: return strstr(errors, strerror(EIO)) != NULL;
    case TORTURE_THREADS:
    case TORTURE_FOREIGN_THREADS: return strstr(errors, "thread") != NULL;
    case TORTURE_MONITOR:
    case TORTURE_MEMORY: return strstr(errors, "memory") != NULL;
    default:
        return strncmp(errors, "caustica: ", 10) == 0; /* libraries may take a lack of memory for a damaged file */
    }
}

/* Those of the call stack, the innermost first, each once in a row. */
static void list_libraries(const char *call, char site[256])
{
    const char *before = "";
    size_t used = 0, before_length = 0;
    const char *line = strchr(call + 1, '\n');
    for (; line && line[1] && strncmp(line + 1, "failed ", 7) != 0; line = strchr(line + 1, '\n')) {
        const char *name = line + 1;
        const size_t length = strcspn(name, " \n");
        const bool again = length == before_length && strncmp(name, before, length) == 0;
        if (again || strncmp(name, "libcaustica-faults", 18) == 0 || used + length + 4 > 256) continue;
        used += (size_t)snprintf(site + used, 256 - used, "%s%.*s", used ? " < " : "", (int)length, name);
        before = name;
        before_length = length;
    }
}

/* Libraries that end the process where they get no memory or thread: the first one on the stack of the last call that
 * failed. */
static bool ended_by_library(const faulty_run *f, char site[256])
{
    static const char *const libraries[] = {"libtbb", "libembree", "libstdc++"};
    if (f->kind != TORTURE_FOREIGN_MEMORY && f->kind != TORTURE_FOREIGN_THREADS) return false;
    if (f->result.signal == 0 && f->result.exit_status < 2) return false;
    ca_bytes report = read_all(f->program->folder, ".faults");
    const char *first = NULL, *last_call = report.data ? (const char *)report.data : "";
    for (const char *next = last_call; next; next = strstr(next + 1, "\nfailed ")) last_call = next;
    for (int i = 0; i < 3; i++) {
        const char *found = strstr(last_call, libraries[i]);
        if (found && (!first || found < first)) first = found;
    }
    if (first) list_libraries(last_call, site);
    ca_bytes_destroy(&report);
    return first != NULL;
}

static void check_output(const faulty_run *f, const char *output, bool ended)
{
    char name[256];
    const char *folder = f->program->folder;
    if (is_as_before(folder, f->command, output)) {
        if (f->result.exit_status == 0) fail_run(f, "%s is not written, and nobody says so", output);
        return;
    }
    if (!is_complete(folder, output))
        fail_run(f, "%s is %s", output, ended ? "half written" : "lost or half written");
    if (f->result.exit_status != 0) return;
    reference_name(name, f->command, output);
    if (!same_content(folder, f->command, output, name)) fail_run(f, "%s has another content", output);
}

/* One call that fails loses one output at most, once outputs are written: the others are still written. Those of a
 * folder depend on each other, and what is kept was there before. */
static void check_others(const faulty_run *f)
{
    const torture_command *command = f->command;
    int written = 0, unwritten = 0;
    const bool one_call = f->kind == TORTURE_FILES && !f->stays;
    if (!one_call || command->folder || command->kept) return;
    for (int i = 0; i < TORTURE_OUTPUTS && command->outputs[i]; i++)
        if (is_as_before(f->program->folder, command, command->outputs[i]))
            unwritten++;
        else
            written++;
    if (written > 0 && unwritten > 1) fail_run(f, "%d outputs are lost with one", unwritten - 1);
}

/* For note_left: nftw has no pointer for its caller. */
static const faulty_run *looked_at;
static char left[512];

/* A lock that could not be taken is not removed: another process may hold it. */
static bool may_be_left(const char *name)
{
    char message[600];
    const size_t length = strlen(name), end = strlen(".lock");
    snprintf(message, sizeof message, "%s: cannot lock", name);
    return length > end && strcmp(name + length - end, ".lock") == 0 && strstr(looked_at->result.errors, message);
}

/* Temporaries and locks. */
static int note_left(const char *path, const struct stat *info, int kind, struct FTW *place)
{
    const char *name = path + place->base;
    (void)info, (void)kind;
    if (!strstr(name, CA_FILE_TEMPORARY_MARK) && !strstr(name, ".lock")) return 0;
    if (!may_be_left(name)) snprintf(left, sizeof left, "%s", path);
    return unlink(path);
}

/* What is left is removed, for the next run. */
static void check_nothing_left(const faulty_run *f, bool ended)
{
    left[0] = '\0';
    looked_at = f;
    if (nftw(f->program->folder, note_left, 16, FTW_PHYS) != 0) fail_msg("the folder cannot be read");
    if (left[0] && !ended) fail_run(f, "%s is left", left);
}

bool torture_run(const ca_program *program, const torture_command *command, torture_kind kind, long at, bool stays,
                 char site[256])
{
    faulty_run f = {.program = program, .command = command, .kind = kind, .at = at, .stays = stays};
    reset_outputs(program->folder, command);
    run(program, command, kind_names[kind], at, stays, &f.result);
    const bool ended = ended_by_library(&f, site);
    if (!ended && f.result.exit_status != 0 && f.result.exit_status != 1) fail_run(&f, "it ends otherwise");
    if (f.result.exit_status == 1 && !names_cause(&f)) fail_run(&f, "the cause is not named");
    for (int i = 0; i < TORTURE_OUTPUTS && command->outputs[i]; i++) check_output(&f, command->outputs[i], ended);
    check_others(&f);
    check_nothing_left(&f, ended);
    return ended;
}
