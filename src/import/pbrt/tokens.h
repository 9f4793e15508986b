/* The words of a .pbrt file, with the place of each. White space separates them; # begins a comment. */
#ifndef CA_IMPORT_PBRT_TOKENS_H
#define CA_IMPORT_PBRT_TOKENS_H

#include "base/memory.h"
#include "base/status.h"

typedef enum ca_pbrt_token_kind {
    CA_PBRT_END,    /* of the file */
    CA_PBRT_WORD,   /* a directive, a number, true or false: text is not terminated */
    CA_PBRT_STRING, /* what stands between quotes, its escapes resolved; terminated, in the arena */
    CA_PBRT_OPEN,   /* [ */
    CA_PBRT_CLOSE,  /* ] */
} ca_pbrt_token_kind;

typedef struct ca_pbrt_token {
    ca_pbrt_token_kind kind;
    const char *text;
    size_t length;
    ca_location where;
} ca_pbrt_token;

typedef struct ca_pbrt_scan {
    const char *cursor, *end; /* borrowed */
    const char *line_start;
    uint32_t line;
    const char *file;
    ca_arena *arena;
    ca_pbrt_token ahead; /* the next token, already read */
    bool has_ahead;
} ca_pbrt_scan;

ca_pbrt_scan ca_pbrt_scan_begin(const char *file, const char *text, size_t size, ca_arena *arena);

/* Errors: CA_ERROR_FORMAT for a string without an end or with an unknown escape, CA_ERROR_MEMORY. */
ca_status ca_pbrt_next(ca_pbrt_scan *scan, ca_pbrt_token *token, ca_error *error);
/* The same without going on. */
ca_status ca_pbrt_peek(ca_pbrt_scan *scan, ca_pbrt_token *token, ca_error *error);

bool ca_pbrt_is_word(const ca_pbrt_token *token, const char *word);

/* Does the text hold this word, outside of strings and comments? */
bool ca_pbrt_text_has_word(const char *text, size_t size, const char *word);

#endif
