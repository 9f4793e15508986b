/* Scenes of pbrt, versions 3 and 4 (docs/pbrt.md). */
#ifndef CA_IMPORT_PBRT_PBRT_H
#define CA_IMPORT_PBRT_PBRT_H

struct ca_importer;

/* Makes the tree of the scene that importer->source names, with its includes; relative names are seen from the scene
 * file. Fails with the importer. */
void ca_read_pbrt(struct ca_importer *importer);

#endif
