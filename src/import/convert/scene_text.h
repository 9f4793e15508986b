/* The text of a scene as Mitsuba 3 has it, from the tree that it was read into.
 *
 * Numbers stay the text that they were. Spellings that only Mitsuba 0.6 or this renderer has become those of Mitsuba
 * 3 where there are any that mean the same to the bit; what is left gets a note. */
#ifndef CA_IMPORT_CONVERT_SCENE_TEXT_H
#define CA_IMPORT_CONVERT_SCENE_TEXT_H

#include "import/convert/outputs.h"
#include "import/importer.h"

typedef struct ca_scene_writer {
    ca_importer *importer;
    ca_outputs *outputs;
    const char *folder; /* as the text names it, in front of the files' names: "scene-files" */
    char *text;         /* owned */
    size_t length, capacity;
} ca_scene_writer;

/* The whole file; failures are the importer's. The caller frees `text` in any case. */
void ca_scene_write_text(ca_scene_writer *writer);

#endif
