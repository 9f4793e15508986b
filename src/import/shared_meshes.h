/* Meshes that several shapes of a scene show are read once. Shapes that have one in the same place share all of it,
 * and are one mesh of the description; those in different places share the arrays that placing leaves as they are:
 * texture coordinates, and the indices where no map turns triangles round. */
#ifndef CA_IMPORT_SHARED_MESHES_H
#define CA_IMPORT_SHARED_MESHES_H

#include "import/importer.h"

/* What tells a mesh from others: numbers made of all that it depends on (0: it cannot be told). */
typedef struct ca_mesh_key {
    uint64_t content;   /* the file or the arrays, and what is done with them before they are placed */
    uint64_t place;     /* the same, and where it lies */
    bool keeps_indices; /* placing does not turn triangles round */
    bool lasts;         /* the next version of the scene may know it by `place`, too */
} ca_mesh_key;

/* `content` is what tells the file or the arrays; `kind` tells how it is read. */
ca_mesh_key ca_mesh_key_of(uint64_t content, uint64_t kind, const ca_mesh_use *use);

/* The description's mesh for a shape that is the same as another one's, or as one of the previous version; or a new
 * one that shares what it can with another one's. CA_NONE: it has to be read; or after failing. */
uint32_t ca_shared_mesh(ca_importer *importer, const ca_mesh_key *key);
/* Adds a mesh to the description, for later shapes to share; takes it over. CA_NONE after failing. */
uint32_t ca_shared_mesh_add(ca_importer *importer, const ca_mesh_key *key, ca_mesh *mesh);

void ca_shared_meshes_destroy(ca_shared_meshes *meshes);

#endif
