#include "cli/options.h"

#include "base/clock.h"
#include "base/loading.h"
#include "base/memory.h"
#include "base/text.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "cli/values.h"

#include <stdlib.h>
#include <string.h>

enum { NAME_LIMIT = 64, OPTION_LIMIT = 64 };

/* ---- Names that are nearly right ------------------------------------------------------------------------------- */

const char *ca_options_nearest(const char *name, const char *const names[], size_t count)
{
    const char *nearest = ca_nearest_name(name, names, count);
    for (size_t i = 0; i < count && !nearest; i++)
        if (strlen(name) >= 3 && strncmp(name, names[i], strlen(name)) == 0) nearest = names[i];
    return nearest;
}

static const char *nearest_option(const ca_option_table *table, const char *name)
{
    const char *names[OPTION_LIMIT];
    size_t count = 0;
    for (; count < table->count && count < OPTION_LIMIT; count++) names[count] = table->options[count].name;
    return ca_options_nearest(name, names, count);
}

static ca_status fail_unknown(const ca_option_table *table, const char *word, const char *name, ca_error *error)
{
    const char *nearest = word[1] == '-' ? nearest_option(table, name) : NULL;
    if (nearest)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "option --%s is not known; did you mean --%s?", name, nearest);
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "option %s is not known", word);
}

/* ---- Lists ----------------------------------------------------------------------------------------------------- */

static ca_status append_text(ca_text_list *list, const char *text, ca_error *error)
{
    const char **items = ca_array_grow(list->items, &list->capacity, list->count + 1, sizeof *items);
    if (!items) return ca_fail_memory(error, "the command line");
    list->items = items;
    list->items[list->count++] = text;
    return CA_OK;
}

static ca_status append_rect(ca_rect_list *list, const char *text, ca_error *error)
{
    uint32_t(*items)[4] = ca_array_grow(list->items, &list->capacity, list->count + 1, sizeof *items);
    if (!items) return ca_fail_memory(error, "the command line");
    list->items = items;
    CA_TRY(ca_value_rect(text, list->items[list->count], error));
    list->count++;
    return CA_OK;
}

void ca_text_list_destroy(ca_text_list *list)
{
    ca_free(list->items);
    *list = (ca_text_list){0};
}

void ca_rect_list_destroy(ca_rect_list *list)
{
    ca_free(list->items);
    *list = (ca_rect_list){0};
}

/* ---- Parsing --------------------------------------------------------------------------------------------------- */

static ca_status read_value(const ca_option *option, const char *text, void *target, ca_error *error)
{
    switch (option->kind) {
    case CA_OPTION_FLAG: *(bool *)target = true; return CA_OK;
    case CA_OPTION_TEXT: *(const char **)target = text; return CA_OK;
    case CA_OPTION_TEXT_LIST: return append_text(target, text, error);
    case CA_OPTION_COUNT: return ca_value_count(text, option->minimum, target, error);
    case CA_OPTION_SEED: return ca_value_seed(text, target, error);
    case CA_OPTION_INTEGER: return ca_value_integer(text, option->minimum, target, error);
    case CA_OPTION_REAL: return ca_value_real(text, target, error);
    case CA_OPTION_POSITIVE: return ca_value_positive(text, target, error);
    case CA_OPTION_SIZE: return ca_value_size(text, target, error);
    case CA_OPTION_RANGE: return ca_value_range(text, target, error);
    case CA_OPTION_RECT: return ca_value_rect(text, target, error);
    case CA_OPTION_RECT_LIST: return append_rect(target, text, error);
    case CA_OPTION_PORT: return ca_value_port(text, target, error);
    }
    return CA_OK;
}

static bool is_list(const ca_option *option)
{
    return option->kind == CA_OPTION_TEXT_LIST || option->kind == CA_OPTION_RECT_LIST;
}

/* The option of a word "--name", "--name=value", "-l" or "-lvalue"; *value is what follows in the same word, or
 * NULL. */
static const ca_option *find_option(const ca_option_table *table, const char *word, const char **value)
{
    const bool is_long = word[1] == '-';
    const size_t length = is_long ? strcspn(word + 2, "=") : 1;
    for (size_t i = 0; i < table->count; i++) {
        const ca_option *option = &table->options[i];
        if (is_long ? strncmp(option->name, word + 2, length) != 0 || option->name[length] != 0
                    : option->letter != word[1])
            continue;
        const char *rest = word + (is_long ? 2 + length : 2);
        *value = *rest == 0 ? NULL : rest + is_long;
        return option;
    }
    return NULL;
}

/* Puts the name of the option in front of what is wrong with its value. */
static ca_status fail_value(const ca_option *option, const ca_error *reason, ca_status status, ca_error *error)
{
    return ca_fail(error, status, NULL, "--%s: %.900s", option->name, reason->message);
}

typedef struct word_reader {
    char *const *words;
    int count, next;
} word_reader;

static ca_status parse_option(const ca_option_table *table, word_reader *reader, bool *seen, void *record,
                              ca_error *error)
{
    const char *word = reader->words[reader->next++], *value = NULL;
    const ca_option *option = find_option(table, word, &value);
    if (!option) {
        char name[NAME_LIMIT];
        snprintf(name, sizeof name, "%.*s", (int)strcspn(word + 1 + (word[1] == '-'), "="),
                 word + 1 + (word[1] == '-'));
        return fail_unknown(table, word, name, error);
    }
    bool *const seen_this = &seen[option - table->options];
    if (*seen_this && !is_list(option))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "option --%s is given twice", option->name);
    *seen_this = true;
    if (option->kind == CA_OPTION_FLAG && value)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "option --%s takes no value", option->name);
    const char *next = reader->next < reader->count ? reader->words[reader->next] : NULL;
    if (option->kind == CA_OPTION_PORT && !value && !(next && ca_value_is_digits(next))) value = "0";
    if (option->kind != CA_OPTION_FLAG && !value) {
        if (!next || strncmp(next, "--", 2) == 0)
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "option --%s needs a value: %s", option->name,
                           option->argument);
        value = next;
        reader->next++;
    }
    ca_error reason = {""};
    const ca_status status = read_value(option, value, (char *)record + option->offset, &reason);
    if (status != CA_OK) return fail_value(option, &reason, status, error);
    if (option->given) *(bool *)((char *)record + option->given) = true;
    return CA_OK;
}

ca_status ca_options_parse(const ca_option_table *table, int word_count, char *const words[], void *record,
                           ca_text_list *operands, ca_error *error)
{
    bool seen[OPTION_LIMIT] = {false};
    word_reader reader = {.words = words, .count = word_count};
    bool options_ended = table->count > OPTION_LIMIT;
    while (reader.next < reader.count) {
        const char *word = words[reader.next];
        if (options_ended || word[0] != '-' || word[1] == 0) {
            CA_TRY(append_text(operands, word, error));
            reader.next++;
        } else if (strcmp(word, "--") == 0) {
            options_ended = true;
            reader.next++;
        } else {
            CA_TRY(parse_option(table, &reader, seen, record, error));
        }
    }
    return CA_OK;
}

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

ca_status ca_options_scene_operand(const ca_text_list *operands, const char **path, ca_error *error)
{
    if (operands->count != 1)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       operands->count == 0 ? "a scene file is missing" : "there is more than one scene file");
    *path = operands->items[0];
    return CA_OK;
}

void ca_define_words_destroy(ca_define_words *words)
{
    ca_free(words->defines);
    ca_free(words->storage);
}

static ca_status read_defines(const ca_text_list *words, ca_define_words *read, ca_error *error)
{
    size_t bytes = 0;
    for (size_t i = 0; i < words->count; i++) bytes += strlen(words->items[i]) + 1;
    read->defines = ca_alloc(words->count, sizeof *read->defines);
    read->storage = ca_alloc(bytes, 1);
    if (!read->defines || !read->storage) return ca_fail_memory(error, "the command line");
    char *text = read->storage;
    for (size_t i = 0; i < words->count; i++) {
        const size_t size = strlen(words->items[i]) + 1;
        memcpy(text, words->items[i], size);
        char *equals = strchr(text, '=');
        if (!equals || equals == text)
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--define: \"%s\" is not NAME=VALUE", words->items[i]);
        *equals = 0;
        for (size_t before = 0; before < i; before++)
            if (strcmp(read->defines[before].name, text) == 0)
                return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--define: %s is defined twice, as \"%s\" and \"%s\"",
                               text, read->defines[before].value, equals + 1);
        read->defines[i] = (ca_define){.name = text, .value = equals + 1};
        text += size;
    }
    return CA_OK;
}

ca_status ca_options_load_scene(const char *path, const ca_text_list *define_words, bool draws, ca_scene **scene,
                                ca_error *error)
{
    return ca_options_load_sensor(path, define_words, 0, NULL, draws, scene, error);
}

ca_status ca_options_scene_memory(double *mib, ca_error *error)
{
    static const char name[] = "CAUSTICA_SCENE_MEMORY";
    const char *text = getenv(name);
    double given = 0.0;
    ca_error reason = {""};
    if (text && ca_value_positive(text, &given, &reason) != CA_OK)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%s in the environment (MiB): %.900s", name, reason.message);
    *mib = given;
    return CA_OK;
}

ca_status ca_options_open_source(const char *path, const ca_text_list *define_words, ca_define_words *read,
                                 ca_scene_source *source, ca_error *error)
{
    const ca_status status = read_defines(define_words, read, error);
    *source = (ca_scene_source){.path = path,
                                .defines = read->defines,
                                .define_count = define_words->count,
                                .stop = ca_signals_stop()};
    return status == CA_OK ? ca_options_scene_memory(&source->memory_mib, error) : status;
}

typedef struct loading_line {
    ca_progress_line line;
    double start;
} loading_line;

/* Small scenes are there before anything is drawn. */
static void draw_loading(const char *what, double fraction, void *user)
{
    loading_line *loading = user;
    const double first = 1.0, seconds = ca_clock_seconds() - loading->start;
    if (seconds >= first) ca_progress_draw_loading(&loading->line, what, fraction, seconds);
}

static ca_status parse_drawing(const ca_scene_source *source, bool draws, ca_scene **scene, ca_error *error)
{
    loading_line loading = {.line = ca_progress_start(draws), .start = ca_clock_seconds()};
    if (loading.line.stream) ca_loading_begin(draw_loading, &loading);
    const ca_status status = ca_scene_parse(source, scene, error);
    ca_loading_end();
    ca_progress_clear(&loading.line);
    return status;
}

ca_status ca_options_load_sensor(const char *path, const ca_text_list *define_words, uint32_t sensor,
                                 const char *camera, bool draws, ca_scene **scene, ca_error *error)
{
    if (sensor > 0 && camera)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--sensor and --camera exclude each other: give one");
    ca_define_words read;
    ca_scene_source source;
    *scene = NULL;
    ca_status status = ca_options_open_source(path, define_words, &read, &source, error);
    source.sensor = sensor;
    source.camera = camera;
    if (status == CA_OK) status = parse_drawing(&source, draws, scene, error);
    ca_define_words_destroy(&read);
    if (status == CA_OK) ca_options_say_notes(*scene);
    return status;
}

void ca_options_say_notes(const ca_scene *scene)
{
    const char *note;
    for (size_t i = 0; (note = ca_scene_note(scene, i)) != NULL; i++) ca_say(stderr, "caustica: note: %s\n", note);
}

/* ---- Help ------------------------------------------------------------------------------------------------------ */

enum { HELP_COLUMN = 30, HELP_WIDTH = 100 };

/* Words from column `used` on; further lines begin at `indent`. */
static void put_words(FILE *stream, const char *text, size_t length, size_t used, size_t indent)
{
    for (size_t at = 0, word; at < length; at += word + (text[at + word] == ' ')) {
        word = strcspn(text + at, " \n");
        if (at > 0 && used + 1 + word > HELP_WIDTH) {
            fprintf(stream, "\n%*s", (int)indent, "");
            used = indent;
        } else if (at > 0) {
            fputc(' ', stream);
            used++;
        }
        fwrite(text + at, 1, word, stream);
        used += word;
    }
    fputc('\n', stream);
}

void ca_options_print(const ca_option_table *table, FILE *stream)
{
    for (size_t i = 0; i < table->count; i++) {
        const ca_option *option = &table->options[i];
        int used = option->letter ? fprintf(stream, "  -%c, --%s", option->letter, option->name)
                                  : fprintf(stream, "      --%s", option->name);
        if (option->argument) used += fprintf(stream, " %s", option->argument);
        if (used > HELP_COLUMN - 2) {
            fprintf(stream, "\n");
            used = 0;
        }
        fprintf(stream, "%*s", HELP_COLUMN - used, "");
        put_words(stream, option->help, strlen(option->help), HELP_COLUMN, HELP_COLUMN);
    }
}

void ca_options_print_prose(const char *text, FILE *stream)
{
    while (*text) {
        const size_t length = strcspn(text, "\n");
        if (text[0] == ' ' || strncmp(text, "Example", 7) == 0)
            fprintf(stream, "%.*s\n", (int)length, text);
        else
            put_words(stream, text, length, 0, 0);
        text += length + (text[length] == '\n');
    }
}

void ca_options_print_names(const char *title, const char *names, FILE *stream)
{
    char text[512];
    snprintf(text, sizeof text, "%s: %s", title, names);
    put_words(stream, text, strlen(text), 0, 0);
}
