/* Scenes in glTF, a feature each, and their pictures beside those of their twins in XML (gltf_scene.h). */
#ifndef CA_TEST_GLTF_TWINS_H
#define CA_TEST_GLTF_TWINS_H

#include "support/gltf_scene.h"

enum { GLTF_WIDTH = 24, GLTF_HEIGHT = 16, GLTF_TEXT_SIZE = 16384 };

#define LAMP_NODE "'translation':[1,1.5,3],'extensions':{'KHR_lights_punctual':{'light':0}}"
#define LAMP_TOP                                                                                                     \
    "'extensions':{'KHR_lights_punctual':{'lights':[{'type':'point','intensity':40,'color':[1,0.5,0.25]}]}}"
#define LAMP_TWIN                                                                                                    \
    "<emitter type='point'><rgb name='intensity' value='40 20 10'/><point name='position' value='1 1.5 3'/></emitter>"
#define SHAPE(array, more)                                                                                           \
    "<shape type='mesh'><string name='data' value='" array "'/><ref id='m'/>" more "</shape>" LAMP_TWIN
#define PRINCIPLED(more) "<bsdf type='principled'>" more "<float name='eta' value='1.5'/></bsdf>"
#define DULL                                                                                                         \
    "<rgb name='base_color' value='0.5 0.25 0.75'/><float name='roughness' value='0.5'/>"                            \
    "<float name='metallic' value='0.25'/>"
#define DULL_PBR "'baseColorFactor':[0.5,0.25,0.75,1],'roughnessFactor':0.5,'metallicFactor':0.25"
#define MAP_TOP "'textures':[{'source':0}],'images':[{'uri':'map.png'}]"

extern const gltf_case gltf_cases[];
extern const int gltf_case_count;
/* Fails the test where there is none of that name. */
const gltf_case *gltf_find_case(const char *name);

void gltf_path_in(const char *folder, const char *name, char path[256]);

/* A picture of GLTF_WIDTH x GLTF_HEIGHT pixels; fails the test, with the name, on error. */
ca_image_layers *gltf_render(const char *name, const ca_scene_source *source);
/* Of the case, as FOLDER/scene.gltf. */
ca_image_layers *gltf_render_case(const char *folder, const gltf_case *c);

/* Fail the test where pixels differ, by more than the tolerance, or are black. */
void gltf_compare_within(const char *name, const ca_image_layers *a, const ca_image_layers *b, float tolerance);
void gltf_compare(const char *name, const ca_image_layers *a, const ca_image_layers *b);

#endif
