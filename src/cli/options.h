/* Command line options: a command describes its options in a table, the words of the command line fill a record.
 *
 *     static const ca_option options[] = {
 *         {.name = "spp", .argument = "N", .kind = CA_OPTION_COUNT, .minimum = 1,
 *          .offset = offsetof(settings, spp), .help = "samples per pixel"},
 *     };
 *
 * Forms: --name VALUE, --name=VALUE, --flag, -o VALUE, -oVALUE; "--" ends the options; everything else is an operand.
 * A value may begin with one dash (a number) but not with two, so that a forgotten value is noticed; --name=--VALUE
 * is possible. An option that is not known, is given twice (unless it is a list), lacks its value or has a malformed
 * one is an error that names it. */
#ifndef CA_CLI_OPTIONS_H
#define CA_CLI_OPTIONS_H

#include "base/status.h"

#include <stdio.h>

/* What a value looks like, and what lies at the option's offset in the record. */
typedef enum ca_option_kind {
    CA_OPTION_FLAG,      /* bool; no value */
    CA_OPTION_TEXT,      /* const char *, borrowed */
    CA_OPTION_TEXT_LIST, /* ca_text_list; may be given several times */
    CA_OPTION_COUNT,     /* uint32_t, at least .minimum */
    CA_OPTION_SEED,      /* uint64_t */
    CA_OPTION_INTEGER,   /* int, at least .minimum */
    CA_OPTION_REAL,      /* double, any finite number */
    CA_OPTION_POSITIVE,  /* double > 0 */
    CA_OPTION_SIZE,      /* uint32_t[2]: WIDTHxHEIGHT, both at least 1 */
    CA_OPTION_RANGE,     /* uint64_t[2]: A:B with A < B */
    CA_OPTION_RECT,      /* uint32_t[4]: x0,y0,x1,y1 with x0 < x1 and y0 < y1 */
    CA_OPTION_RECT_LIST, /* ca_rect_list; may be given several times */
    CA_OPTION_PORT, /* uint32_t up to 65535; may lack its value, which is then 0: a next word that is no number is not
                       its value */
} ca_option_kind;

typedef struct ca_text_list {
    const char **items; /* owned array of borrowed texts */
    size_t count, capacity;
} ca_text_list;

typedef struct ca_rect_list {
    uint32_t (*items)[4]; /* owned */
    size_t count, capacity;
} ca_rect_list;

typedef struct ca_option {
    const char *name;     /* without dashes */
    char letter;          /* 0: none */
    const char *argument; /* "FILE", for the help; NULL for flags */
    ca_option_kind kind;
    int minimum;
    size_t offset; /* of the value in the record */
    size_t given;  /* offset of a bool that is set when the option is given; 0: none (a record begins with something
                      else) */
    const char *help;
} ca_option;

typedef struct ca_option_table {
    const char *command; /* "render" */
    const ca_option *options;
    size_t count;
} ca_option_table;

/* Fills `record` from the words and appends operands. Errors: CA_ERROR_ARGUMENT, CA_ERROR_MEMORY. Lists are the
 * caller's to release, also on failure. */
ca_status ca_options_parse(const ca_option_table *table, int word_count, char *const words[], void *record,
                           ca_text_list *operands, ca_error *error);
void ca_text_list_destroy(ca_text_list *list);
void ca_rect_list_destroy(ca_rect_list *list);

/* The known name that is meant: nearly the same, or one that begins like it; NULL where there is none. */
const char *ca_options_nearest(const char *name, const char *const names[], size_t count);

/* The scene file, for commands that take just one. Errors: CA_ERROR_ARGUMENT. */
ca_status ca_options_scene_operand(const ca_text_list *operands, const char **path, ca_error *error);

/* The "NAME=VALUE" words of --define. To be destroyed on failure too. */
typedef struct ca_define_words {
    ca_define *defines; /* owned, as many as there are words */
    char *storage;      /* owned; their texts */
} ca_define_words;

void ca_define_words_destroy(ca_define_words *words);

/* The limit of memory for reading a scene that the environment has (CAUSTICA_SCENE_MEMORY, in MiB); 0: it has none.
 * Errors: CA_ERROR_ARGUMENT for what is not a number above 0. */
ca_status ca_options_scene_memory(double *mib, ca_error *error);

/* A scene's file as the library reads it: with the defines, and that limit of memory. `read` holds what *source
 * borrows. */
ca_status ca_options_open_source(const char *path, const ca_text_list *define_words, ca_define_words *read,
                                 ca_scene_source *source, ca_error *error);

/* Says on standard error what the scene's file says and is read otherwise. */
void ca_options_say_notes(const ca_scene *scene);

/* Loads the scene with the "NAME=VALUE" words of --define, and says its notes; its first sensor, or another by its
 * number or, where `camera` is not NULL, its id. `draws`: shows how far that is (progress.h). */
ca_status ca_options_load_scene(const char *path, const ca_text_list *define_words, bool draws, ca_scene **scene,
                                ca_error *error);
ca_status ca_options_load_sensor(const char *path, const ca_text_list *define_words, uint32_t sensor,
                                 const char *camera, bool draws, ca_scene **scene, ca_error *error);

/* The options, aligned; help that is longer than a line of 100 columns goes on below itself. */
void ca_options_print(const ca_option_table *table, FILE *stream);
/* What a command's help says beside, a paragraph a line of `text`, broken into lines of 100 columns; examples and
 * lines that begin with a space stay as they are. */
void ca_options_print_prose(const char *text, FILE *stream);
/* "title: names", broken likewise. */
void ca_options_print_names(const char *title, const char *names, FILE *stream);

#endif
