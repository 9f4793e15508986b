/* Scenes in glTF 2.0, as .gltf with its files or as one .glb (docs/gltf.md). */
#ifndef CA_IMPORT_GLTF_GLTF_H
#define CA_IMPORT_GLTF_GLTF_H

struct ca_importer;

/* Makes the tree of the scene that importer->source names; relative names are seen from the scene file. Fails with
 * the importer. */
void ca_read_gltf(struct ca_importer *importer);

#endif
