/* Scenes in glTF for tests: a square and what one feature needs, and the same in XML as its twin. */
#ifndef CA_TEST_GLTF_SCENE_H
#define CA_TEST_GLTF_SCENE_H

#include "caustica.h"

/* A JSON text: asset, one scene of nodes 0, 1, 2 ("Eye", a camera; the square; and `light`, a node), and the square's
 * accessors 0 to 12 over the file square.bin:
 *   0 positions, 1 normals, 2 texture coordinates, 3 indices (u16), 4 colours (float RGB), 5 colours (u8 RGBA,
 *   normalised), 6 positions of which two are sparse, 7 texture coordinates (u16, normalised, with a stride), 8 the
 *   corners in the order of a strip, 9 of a fan, 10 all zero (no buffer view), 11 white colours, 12 yellow ones
 *   (1, 1, 1/2), 13 texture coordinates whose u is mirrored. */
typedef struct gltf_case {
    const char *name;
    const char *node;      /* members of the square's node behind "mesh":0; "" */
    const char *primitive; /* members of the primitive behind "attributes"; 'indices':3 unless they say others; "" */
    const char *attributes; /* NULL: 'POSITION':0,'NORMAL':1,'TEXCOORD_0':2 */
    const char *light;     /* members of node 2 */
    const char *top;       /* members of the root: materials, textures, extensions, ... */
    const char *twin;      /* the objects of the scene in XML, behind the sensor */
} gltf_case;

/* Quotes are written as ' in all texts of a case. `text` gets the JSON. */
void gltf_case_text(const gltf_case *c, char *text, size_t size);
/* The twin as a whole scene: meshes and bitmaps are those of gltf_twin_source. */
void gltf_case_twin(const gltf_case *c, char *text, size_t size);
ca_scene_source gltf_twin_source(const char *text, const char *path);

/* Writes square.bin and map.png (8 bit RGBA) into a folder. */
void gltf_write_files(const char *folder);

#endif
