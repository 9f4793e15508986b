/* A scene file with everything that only concerns files resolved: <include> replaced by what it includes, $names by
 * their values, 0.6 spellings by today's, <path> and <alias> remembered. What is left are objects, parameters and
 * refs, every one checked against elements.h. */
#ifndef CA_IMPORT_DOCUMENT_H
#define CA_IMPORT_DOCUMENT_H

#include "import/import.h"
#include "import/xml_tree.h"

enum {
    CA_DOCUMENT_MAX_INCLUDE_DEPTH = 16,
    CA_DOCUMENT_MAX_INCLUDES = 1024,
    CA_DOCUMENT_MAX_DEFAULTS = 256,
    CA_DOCUMENT_MAX_VALUE = 64 << 20, /* bytes of one attribute once its $names are replaced */
};

typedef struct ca_document_id {
    const char *id;
    ca_xml_node *node; /* an object, or of an alias the <alias> itself */
} ca_document_id;

typedef struct ca_document {
    ca_arena arena;      /* nodes and texts, gone with the document */
    const char *path;    /* of the scene file */
    ca_xml_node *root;   /* <scene> */
    ca_document_id *ids; /* sorted by id */
    size_t id_count, id_capacity;
    const char **folders; /* of <path>, each ending in "/", the latest first to be asked */
    size_t folder_count, folder_capacity;
    ca_path_table files; /* all that the scene is read from; texts in `strings` */
    ca_arena *strings;   /* the description's */
    uint64_t content_hash; /* of all texts read so far, wherever they lie, and of the definitions */
} ca_document;

/* `text` may be NULL: the file is then read. `strings` outlives the document and keeps the file names of
 * locations. */
ca_status ca_document_load(ca_document *document, const char *path, const char *text, size_t size,
                           const ca_define *defines, size_t define_count, ca_arena *strings, ca_error *error);
void ca_document_destroy(ca_document *document);

/* For a scene that is not XML, whose reader makes the tree (tree_build.h): an empty document, and the end of it,
 * which checks all elements and finds their ids. Definitions have nothing to define there: an error. */
ca_status ca_document_start(ca_document *document, const char *path, const ca_define *defines, size_t define_count,
                            ca_arena *strings, ca_error *error);
ca_status ca_document_finish(ca_document *document, ca_error *error);
/* Makes a text that was read part of what the scene's content is known by. */
void ca_document_add_content(ca_document *document, const void *bytes, size_t size);

/* Notes that the scene is read from this file, and gives back its name in `strings`; NULL when out of memory. */
const char *ca_document_add_file(ca_document *document, const char *path);

/* The object behind an id, through aliases; NULL where there is none. */
ca_xml_node *ca_document_find(const ca_document *document, const char *id);
/* Where ids that begin with `length` bytes of `start`, or come after it, begin among the sorted ones. */
size_t ca_document_first_id(const ca_document *document, const char *start, size_t length);
/* The id nearest to a wrong one; NULL where the scene has none. */
const char *ca_document_nearest_id(const ca_document *document, const char *id);

/* Where the file is that an element of `from_file` calls `name`: in the folders of <path>, beside `from_file`, beside
 * the scene; the name seen from `from_file` where it is in none of them. In the document's arena; NULL when out of
 * memory. */
const char *ca_document_resolve(ca_document *document, const char *from_file, const char *name);

#endif
