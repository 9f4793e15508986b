/* JSON files written by people: read with the place of each value, so that errors are reported as file:line:column.
 *
 *     static const ca_json_field fields[] = {
 *         {.key = "seconds", .kind = CA_JSON_NUMBER, .low = 0.01, .high = 600.0, .offset = offsetof(settings,
 * seconds)},
 *     };
 *     ca_json_read("study.json", "study", &document, error);
 *     ca_json_fill(document, ca_json_root(document), "a study", fields, 1, &settings, error);
 *
 * Files are UTF-8; a key that stands twice is refused. Errors of what the file says are CA_ERROR_FORMAT. Values and
 * texts are borrowed from the document. */
#ifndef CA_CLI_JSON_DOCUMENT_H
#define CA_CLI_JSON_DOCUMENT_H

#include "base/status.h"

typedef struct ca_json ca_json;
typedef struct json_t ca_json_value;

/* What a member looks like, and what lies at its offset in the record. */
typedef enum ca_json_kind {
    CA_JSON_TEXT,   /* const char *; not empty */
    CA_JSON_ANY_TEXT, /* const char *; "" too */
    CA_JSON_NUMBER, /* double from .low to .high */
    CA_JSON_COUNT,  /* uint32_t, a whole number from .low to .high */
    CA_JSON_FLAG,   /* bool */
    CA_JSON_OBJECT, /* const ca_json_value * */
    CA_JSON_LIST,   /* const ca_json_value * */
    CA_JSON_ANY,    /* const ca_json_value * */
} ca_json_kind;

typedef struct ca_json_field {
    const char *key;
    ca_json_kind kind;
    bool needed; /* else the record keeps what it has */
    double low, high;
    size_t offset;
} ca_json_field;

/* `what` names the kind of file in errors. Errors: CA_ERROR_FILE, CA_ERROR_FORMAT, CA_ERROR_MEMORY. */
ca_status ca_json_read(const char *path, const char *what, ca_json **document, ca_error *error);
void ca_json_destroy(ca_json *document); /* NULL is allowed */
const ca_json_value *ca_json_root(const ca_json *document);
/* Of all bytes of the file. */
uint64_t ca_json_hash(const ca_json *document);

/* Fills `record` from the members of an object; `what` ("a scenario") names it in errors. Refused: what is no object,
 * a needed member that is missing, a member of another kind or out of range, and one that is not known. */
ca_status ca_json_fill(const ca_json *document, const ca_json_value *object, const char *what,
                       const ca_json_field *fields, size_t count, void *record, ca_error *error);

/* How many there are in a list or an object; 0 for NULL. */
size_t ca_json_size(const ca_json_value *list);
/* The next element, which must be an object. */
ca_status ca_json_object_at(const ca_json *document, const ca_json_value *list, size_t index, const char *what,
                            const ca_json_value **object, ca_error *error);
/* Member number `index` of an object whose members are texts. */
ca_status ca_json_text_member(const ca_json *document, const ca_json_value *object, size_t index, const char **key,
                              const char **text, ca_error *error);

/* CA_ERROR_FORMAT at the value of that member (of the object itself where there is no such member or the key is
 * NULL). */
ca_status ca_json_fail(const ca_json *document, const ca_json_value *object, const char *key, ca_error *error,
                       const char *format, ...) CA_PRINTF(5, 6);

#endif
