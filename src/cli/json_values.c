#include "cli/json_values.h"

#include "base/file.h"
#include "base/memory.h"
#include "report/page_text.h"

#include <math.h>
#include <string.h>

static void *allocate(size_t size) { return ca_alloc(size, 1); }

void ca_json_begin(void) { json_set_alloc_funcs(allocate, ca_free); }

json_t *ca_json_number(double value) { return isfinite(value) ? json_real(value) : json_null(); }

json_t *ca_json_text(const char *text)
{
    static const char replacement[] = "\xef\xbf\xbd";
    char *valid = ca_alloc(strlen(text) + 1, sizeof replacement - 1);
    if (!valid) return NULL;
    size_t used = 0;
    while (*text) {
        const size_t length = ca_page_sequence(text), size = length ? length : sizeof replacement - 1;
        memcpy(valid + used, length ? text : replacement, size);
        used += size;
        text += length ? length : 1;
    }
    json_t *value = json_stringn(valid, used);
    ca_free(valid);
    return value;
}

/* jansson does not say why it gave up: the stream knows of a write that failed, and all else is memory. */
static ca_status write_root(const char *path, const json_t *root, ca_error *error)
{
    ca_file_writer writer;
    CA_TRY(ca_file_create(&writer, path, error));
    const bool dumped = json_dumpf(root, writer.stream, JSON_INDENT(2)) == 0 && fputc('\n', writer.stream) != EOF;
    if (dumped || ferror(writer.stream)) return ca_file_commit(&writer, error); /* it finds the cause */
    ca_file_abandon(&writer);
    return ca_fail_memory(error, path);
}

ca_status ca_json_write(const char *path, json_t *root, bool complete, ca_error *error)
{
    const ca_status status = root && complete ? write_root(path, root, error) : ca_fail_memory(error, path);
    json_decref(root);
    return status;
}
