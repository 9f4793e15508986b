/* glTF 2.0: each feature against a twin in XML, to the bit; what is refused, and where it says so. */
#define _XOPEN_SOURCE 700
#include "base/file.h"
#include "base/memory.h"
#include "import/import.h"
#include "render/render.h"
#include "support/gltf_scene.h"
#include "support/program_test.h"

#include <math.h>
#include <stdlib.h>

enum { WIDTH = 24, HEIGHT = 16, TEXT_SIZE = 16384 };

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

static ca_image_layers *render_source(const char *name, const ca_scene_source *source)
{
    ca_scene *scene = NULL;
    ca_image_layers *image = NULL;
    ca_error error = {""};
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = "path:max_depth=4";
    settings.samples_per_pixel = 4;
    settings.width = WIDTH;
    settings.height = HEIGHT;
    settings.threads = 1;
    if (ca_scene_parse(source, &scene, &error) != CA_OK) fail_msg("%s: %s", name, error.message);
    if (ca_render(scene, &settings, &image, NULL, &error) != CA_OK) fail_msg("%s: %s", name, error.message);
    ca_scene_release(scene);
    return image;
}

static void compare_within(const char *name, const ca_image_layers *a, const ca_image_layers *b, float tolerance)
{
    static const char *const names[3] = {"R", "G", "B"};
    double sum = 0.0;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            const float x = ca_layers_find(a, names[c])[i], y = ca_layers_find(b, names[c])[i];
            sum += (double)x;
            if (!(fabsf(x - y) <= tolerance))
                fail_msg("%s: pixel %d of %s is %.9g, and %.9g of its twin", name, i, names[c], (double)x, (double)y);
        }
    if (!(sum > 0.01)) fail_msg("%s: the picture is black", name);
}

static void compare_images(const char *name, const ca_image_layers *a, const ca_image_layers *b)
{
    compare_within(name, a, b, 0.0f);
}

static void path_in(void **state, const char *name, char path[256])
{
    snprintf(path, 256, "%s/%s", folder_of(state), name);
}

/* ---- Twins ----------------------------------------------------------------------------------------------------- */

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
#define MAP "<string name='data' value='"
#define METALLIC(metallic) "<float name='metallic' value='" metallic "'/>"
#define HALF_ROUGH(metallic) "<float name='roughness' value='0.5'/>" METALLIC(metallic)
#define DULL_MAP(metallic) "<texture type='bitmap' name='roughness'>" MAP "dull'/></texture>" METALLIC(metallic)
#define MAP_TOP "'textures':[{'source':0}],'images':[{'uri':'map.png'}]"

static const gltf_case cases[] = {
    {"factors", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf>" SHAPE("plain", "")},
    {"default material", "", "", NULL, LAMP_NODE, LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(
         "<rgb name='base_color' value='1'/><float name='roughness' value='1'/><float name='metallic' value='1'/>")
     "</bsdf>" SHAPE("plain", "")},
    {"texture of a file, its sampler and its map", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{'metallicFactor':0,'baseColorTexture':{'index':0,'extensions':"
     "{'KHR_texture_transform':{'offset':[0.25,0.5],'scale':[2,3],'rotation':0.5}}}}}],"
     "'textures':[{'source':0,'sampler':0}],'images':[{'uri':'map%2epng'}],"
     "'samplers':[{'magFilter':9728,'wrapS':33648,'wrapT':33648}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(
         "<texture type='bitmap' name='base_color'><string name='filename' value='map.png'/>"
         "<string name='wrap_mode' value='mirror'/><string name='filter_type' value='nearest'/>"
         "<transform name='to_uv'><matrix value='1.7551651237807455 1.438276615812609 0 0.25 -0.95885107720840601 "
         "2.6327476856711183 0 0.5 0 0 1 0 0 0 0 1'/></transform></texture>"
         "<float name='roughness' value='1'/><float name='metallic' value='0'/>") "</bsdf>" SHAPE("square", "")},
    {"texture in WebP beside another", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{'metallicFactor':0,'baseColorTexture':{'index':0}}}],"
     "'textures':[{'source':0,'extensions':{'EXT_texture_webp':{'source':1}}}],"
     "'images':[{'uri':'map.png'},{'uri':'map.webp'}],'extensionsRequired':['EXT_texture_webp']," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(
         "<texture type='bitmap' name='base_color'><string name='filename' value='map.webp'/></texture>"
         "<float name='roughness' value='1'/><float name='metallic' value='0'/>") "</bsdf>" SHAPE("square", "")},
    {"texture times a factor", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{'metallicFactor':0,'baseColorFactor':[0.5,0.25,0.75,1],"
     "'baseColorTexture':{'index':0}}}]," MAP_TOP "," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED("<texture type='bitmap' name='base_color'>" MAP "tinted'/></texture>"
     "<float name='roughness' value='1'/><float name='metallic' value='0'/>") "</bsdf>" SHAPE("square", "")},
    {"roughness and metallic", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{'baseColorFactor':[0.5,0.25,0.75,1],'roughnessFactor':0.5,"
     "'metallicFactor':0.75,'metallicRoughnessTexture':{'index':0}}}]," MAP_TOP "," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED("<rgb name='base_color' value='0.5 0.25 0.75'/>"
     "<texture type='bitmap' name='roughness'>" MAP "green'/></texture>"
     "<texture type='bitmap' name='metallic'>" MAP "blue'/></texture>") "</bsdf>" SHAPE("square", "")},
    {"normal map", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "},'normalTexture':{'index':0,'scale':0.25}}],"
     MAP_TOP "," LAMP_TOP,
     "<bsdf type='twosided' id='m'><bsdf type='normalmap'><texture type='bitmap' name='normalmap'>" MAP
     "bumps'/></texture>" PRINCIPLED(DULL) "</bsdf></bsdf>" SHAPE("square", "")},
    {"normal map on mirrored coordinates", "", ",'material':0", "'POSITION':0,'NORMAL':1,'TEXCOORD_0':13", LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "},'normalTexture':{'index':0,'scale':0.25}}],"
     "'textures':[{'source':0,'sampler':0}],'images':[{'uri':'map.png'}],'samplers':[{'magFilter':9728}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'><bsdf type='normalmap'><texture type='bitmap' name='normalmap'>"
     "<string name='filter_type' value='nearest'/>" MAP "turned'/></texture>" PRINCIPLED(DULL) "</bsdf></bsdf>"
     SHAPE("square", "")},
    {"emission and its strength", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "},'emissiveFactor':[0.5,0.25,0.75],'extensions':"
     "{'KHR_materials_emissive_strength':{'emissiveStrength':8}}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf>"
     SHAPE("plain", "<emitter type='area'><rgb name='radiance' value='4 2 6'/></emitter>")},
    {"emission by a texture", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "},'emissiveFactor':[0.5,0.25,0.75],'emissiveTexture':"
     "{'index':0},'extensions':{'KHR_materials_emissive_strength':{'emissiveStrength':8}}}]," MAP_TOP "," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf><texture type='bitmap' id='t'>" MAP "glow'/></texture>"
     SHAPE("square", "<emitter type='area'><ref name='radiance' id='t'/></emitter>")},
    {"unlit", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "},'extensions':{'KHR_materials_unlit':{}}}]," LAMP_TOP,
     "<bsdf type='diffuse' id='m'><float name='reflectance' value='0'/></bsdf>"
     SHAPE("plain", "<emitter type='area'><rgb name='radiance' value='0.5 0.25 0.75'/></emitter>")},
    {"alpha that blends", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{'baseColorFactor':[0.5,0.25,0.75,0.75],'metallicFactor':0,"
     "'baseColorTexture':{'index':0}},'alphaMode':'BLEND'}]," MAP_TOP "," LAMP_TOP,
     "<bsdf type='mask' id='m'><texture type='bitmap' name='opacity'>" MAP "alpha'/></texture><bsdf type='twosided'>"
     PRINCIPLED("<texture type='bitmap' name='base_color'>" MAP "tinted'/></texture>"
     "<float name='roughness' value='1'/><float name='metallic' value='0'/>") "</bsdf></bsdf>" SHAPE("square", "")},
    {"alpha that cuts", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{'baseColorFactor':[0.5,0.25,0.75,1],'metallicFactor':0,"
     "'baseColorTexture':{'index':0}},'alphaMode':'MASK'}]," MAP_TOP "," LAMP_TOP,
     "<bsdf type='mask' id='m'><texture type='bitmap' name='opacity'>" MAP
     "cut'/><string name='filter_type' value='nearest'/></texture><bsdf type='twosided'>"
     PRINCIPLED("<texture type='bitmap' name='base_color'>" MAP "tinted'/></texture>"
     "<float name='roughness' value='1'/><float name='metallic' value='0'/>") "</bsdf></bsdf>" SHAPE("square", "")},
    {"alpha without a texture", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{'baseColorFactor':[0.5,0.25,0.75,0.375],'roughnessFactor':0.5,"
     "'metallicFactor':0.25},'alphaMode':'BLEND'}]," LAMP_TOP,
     "<bsdf type='mask' id='m'><float name='opacity' value='0.375'/><bsdf type='twosided'>" PRINCIPLED(DULL)
     "</bsdf></bsdf>" SHAPE("plain", "")},
    {"clearcoat", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "},'extensions':{'KHR_materials_clearcoat':{'clearcoatFactor':"
     "0.5,'clearcoatTexture':{'index':0},'clearcoatRoughnessFactor':0.25,'clearcoatRoughnessTexture':{'index':0}}}}],"
     MAP_TOP "," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL "<texture type='bitmap' name='clearcoat'>" MAP "red'/></texture>"
     "<texture type='bitmap' name='clearcoat_gloss'>" MAP "coat'/></texture>") "</bsdf>" SHAPE("square", "")},
    {"sheen", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "},'extensions':{'KHR_materials_sheen':{'sheenColorFactor':"
     "[0.5,0.25,0.125],'sheenRoughnessFactor':0.25}}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL "<float name='sheen' value='0.5'/>"
     "<float name='sheen_tint' value='1'/>") "</bsdf>" SHAPE("plain", "")},
    {"index of refraction", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "},'extensions':{'KHR_materials_ior':{'ior':2}}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'><bsdf type='principled'>" DULL "<float name='eta' value='2'/></bsdf></bsdf>"
     SHAPE("plain", "")},
    /* 0.04 / 4 of the light straight on: (1 + 0.1) / (1 - 0.1) */
    {"specular", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "},'extensions':{'KHR_materials_specular':{'specularFactor':"
     "0.5,'specularColorFactor':[0.5,0.5,0.5]}}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'><bsdf type='principled'>" DULL
     "<float name='eta' value='1.2222222222222223'/></bsdf></bsdf>" SHAPE("plain", "")},
    /* Half of a metal: 0.52 is 0.04 and half of the rest. Metallic-roughness beside it is not read. */
    {"specular-glossiness", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{'metallicFactor':1},'extensions':{'KHR_materials_pbrSpecularGlossiness':{"
     "'diffuseFactor':[0.5,0.25,0.75,1],'specularFactor':[0.52,0.26,0.13],'glossinessFactor':0.5}}}],"
     "'extensionsRequired':['KHR_materials_pbrSpecularGlossiness']," LAMP_TOP,
     "<bsdf type='twosided' id='m'><bsdf type='blendbsdf'><float name='weight' value='0.5'/>"
     PRINCIPLED("<rgb name='base_color' value='0.5 0.25 0.75'/>" HALF_ROUGH("0"))
     PRINCIPLED("<rgb name='base_color' value='1 0.5 0.25'/>" HALF_ROUGH("1")) "</bsdf></bsdf>" SHAPE("plain", "")},
    /* 0.01 of the light straight on: (1 + 0.1) / (1 - 0.1) */
    {"specular-glossiness of a dielectric", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'extensions':{'KHR_materials_pbrSpecularGlossiness':{'diffuseFactor':[0.5,0.25,0.75,1],"
     "'specularFactor':[0.01,0.01,0.01],'glossinessFactor':0.5}}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'><bsdf type='principled'><rgb name='base_color' value='0.5 0.25 0.75'/>"
     HALF_ROUGH("0") "<float name='eta' value='1.2222222222222223'/></bsdf></bsdf>" SHAPE("plain", "")},
    {"specular-glossiness by textures", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'extensions':{'KHR_materials_pbrSpecularGlossiness':{'diffuseFactor':[0.5,0.25,0.75,1],"
     "'diffuseTexture':{'index':0},'specularFactor':[0.5,0.25,0.75],'glossinessFactor':0.75,"
     "'specularGlossinessTexture':{'index':0}}}}]," MAP_TOP "," LAMP_TOP,
     "<bsdf type='twosided' id='m'><bsdf type='blendbsdf'>"
     "<texture type='bitmap' name='weight'>" MAP "metal'/></texture>"
     PRINCIPLED("<texture type='bitmap' name='base_color'>" MAP "tinted'/></texture>" DULL_MAP("0"))
     PRINCIPLED("<texture type='bitmap' name='base_color'>" MAP "hue'/></texture>" DULL_MAP("1"))
     "</bsdf></bsdf>" SHAPE("square", "")},
    {"thin wall", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{'baseColorFactor':[0.5,0.25,0.75,1],'roughnessFactor':0,"
     "'metallicFactor':0},'extensions':{'KHR_materials_transmission':{'transmissionFactor':0.75}}}]," LAMP_TOP,
     "<bsdf type='blendbsdf' id='m'><float name='weight' value='0.75'/><bsdf type='twosided'>" PRINCIPLED(
         "<rgb name='base_color' value='0.5 0.25 0.75'/><float name='roughness' value='0'/>"
         "<float name='metallic' value='0'/>")
     "</bsdf><bsdf type='thindielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>"
     "<rgb name='specular_transmittance' value='0.5 0.25 0.75'/></bsdf></bsdf>" SHAPE("plain", "")},
    {"solid glass", "", ",'material':0", NULL, LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{'baseColorFactor':[0.5,0.25,0.75,1],'roughnessFactor':0.25,"
     "'metallicFactor':0},'extensions':{'KHR_materials_transmission':{'transmissionFactor':0.75},"
     "'KHR_materials_volume':{'thicknessFactor':1}}}]," LAMP_TOP,
     "<bsdf type='principled' id='m'><rgb name='base_color' value='0.5 0.25 0.75'/>"
     "<float name='roughness' value='0.25'/><float name='metallic' value='0'/><float name='spec_trans' value='0.75'/>"
     "<float name='eta' value='1.5'/></bsdf>" SHAPE("plain", "")},
    {"spot", "", ",'material':0", NULL,
     "'translation':[0.5,0.25,3],'rotation':[0,1,0,0],'children':[3]},"
     "{'rotation':[0,-1,0,0],'extensions':{'KHR_lights_punctual':{'light':0}}",
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}],'extensions':{'KHR_lights_punctual':{'lights':[{'type':"
     "'spot','intensity':40,'spot':{'innerConeAngle':0.25,'outerConeAngle':0.5}}]}}",
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf><shape type='mesh'><string name='data' value='plain'/>"
     "<ref id='m'/></shape><emitter type='spot'><rgb name='intensity' value='40'/>"
     "<float name='cutoff_angle' value='28.647889756541161'/><float name='beam_width' value='14.32394487827058'/>"
     "<transform name='to_world'><matrix value='-1 0 0 0.5 0 1 0 0.25 0 0 -1 3 0 0 0 1'/></transform></emitter>"},
    {"sun", "", ",'material':0", NULL, "'scale':[3,2,5],'extensions':{'KHR_lights_punctual':{'light':0}}",
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}],'extensions':{'KHR_lights_punctual':{'lights':[{'type':"
     "'directional','intensity':4}]}}",
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf><shape type='mesh'><string name='data' value='plain'/>"
     "<ref id='m'/></shape><emitter type='directional'><rgb name='irradiance' value='4'/>"
     "<vector name='direction' value='0 0 -1'/></emitter>"},
    {"a matrix, which mirrors", ",'matrix':[-0.5,0,0,0,0.25,0.75,0,0,0,0,1,0,0.125,0.5,0.25,1]", ",'material':0",
     NULL, LAMP_NODE, "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf>"
     SHAPE("plain", "<transform name='to_world'><matrix value='-0.5 0.25 0 0.125 0 0.75 0 0.5 0 0 1 0.25 0 0 0 "
                    "1'/></transform>")},
    {"scale, rotation, translation", ",'scale':[0.5,1,2],'rotation':[0,0,2,0],'translation':[0.25,0.5,-1]",
     ",'material':0", NULL, LAMP_NODE, "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf>"
     SHAPE("plain", "<transform name='to_world'><matrix value='-0.5 0 0 0.25 0 -1 0 0.5 0 0 2 -1 0 0 0 1'/>"
                    "</transform>")},
    {"instances", "", ",'material':0", NULL, LAMP_NODE ",'children':[3]},{'mesh':0,'translation':[-1,-1,-4]",
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf><shape type='shapegroup' id='g'><shape type='mesh'>"
     "<string name='data' value='plain'/><ref id='m'/></shape></shape>"
     "<shape type='instance'><ref id='g'/></shape>" LAMP_TWIN
     "<shape type='instance'><transform name='to_world'><translate value='0 0.5 -1'/></transform>"
     "<ref id='g'/></shape>"},
    {"flat faces without normals", "", ",'material':0", "'POSITION':0", LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf>"
     SHAPE("flat", "<boolean name='face_normals' value='true'/>")},
    {"sparse positions", "", ",'material':0", "'POSITION':6,'NORMAL':1", LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf>" SHAPE("plain", "")},
    {"packed coordinates with a stride", "", ",'material':0", "'POSITION':0,'NORMAL':1,'TEXCOORD_1':7", LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{'metallicFactor':0,'baseColorFactor':[0.5,0.25,0.75,1],"
     "'baseColorTexture':{'index':0,'texCoord':1}}}]," MAP_TOP "," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED("<texture type='bitmap' name='base_color'>" MAP "tinted'/></texture>"
     "<float name='roughness' value='1'/><float name='metallic' value='0'/>") "</bsdf>" SHAPE("square", "")},
    {"a fan", "", ",'material':0,'mode':6,'indices':9", "'POSITION':0,'NORMAL':1", LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf>" SHAPE("fan", "")},
    {"a strip", "", ",'material':0,'mode':5,'indices':8", "'POSITION':0,'NORMAL':1", LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf>" SHAPE("strip", "")},
    {"what is hidden is not there", "", ",'material':0", "'POSITION':0,'NORMAL':1",
     LAMP_NODE ",'children':[3]},{'extensions':{'KHR_node_visibility':{'visible':false}},'children':[4,5],'mesh':0,"
     "'translation':[-0.5,-1,0]},{'mesh':0,'translation':[0,-1,-2]},"
     "{'extensions':{'KHR_lights_punctual':{'light':0},'KHR_node_visibility':{'visible':true}}",
     "'extensionsRequired':['KHR_node_visibility'],'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf>" SHAPE("plain", "")},
    {"white colours are none", "", ",'material':0", "'POSITION':0,'NORMAL':1,'COLOR_0':11", LAMP_NODE,
     "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP,
     "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf>" SHAPE("plain", "")},
};
enum { CASES = sizeof cases / sizeof cases[0] };

static ca_image_layers *render_case(void **state, const gltf_case *c)
{
    static char text[TEXT_SIZE];
    char path[256];
    path_in(state, "scene.gltf", path);
    gltf_case_text(c, text, sizeof text);
    const ca_scene_source source = {.text = text, .size = strlen(text), .path = path};
    return render_source(c->name, &source);
}

static void compare_case(void **state, const gltf_case *c)
{
    static char text[TEXT_SIZE];
    char path[256];
    path_in(state, "twin.xml", path);
    gltf_case_twin(c, text, sizeof text);
    const ca_scene_source twin = gltf_twin_source(text, path);
    ca_image_layers *a = render_case(state, c), *b = render_source(c->name, &twin);
    compare_within(c->name, a, b, strstr(c->name, "mirrored") ? 1e-6f : 0.0f); /* a mirrored frame rounds otherwise */
    ca_image_release(a);
    ca_image_release(b);
}

static void test_twins(void **state)
{
    gltf_write_files(folder_of(state));
    for (int i = 0; i < CASES; i++)
        compare_case(state, &cases[i]);
}

static const gltf_case *find_case(const char *name)
{
    for (int i = 0; i < CASES; i++)
        if (strcmp(cases[i].name, name) == 0) return &cases[i];
    fail_msg("there is no case \"%s\"", name);
    return NULL;
}

/* ---- What a converted scene is --------------------------------------------------------------------------------- */

static void test_converted(void **state)
{
    static char text[TEXT_SIZE];
    char path[256], to[256];
    gltf_write_files(folder_of(state));
    path_in(state, "scene.gltf", path);
    path_in(state, "copy.xml", to);
    for (int i = 0; i < CASES; i++) {
        ca_scene_desc desc;
        ca_error error = {""};
        gltf_case_text(&cases[i], text, sizeof text);
        const ca_scene_source source = {.text = text, .size = strlen(text), .path = path}, copy = {.path = to};
        if (ca_import_convert(&source, to, &desc, &error) != CA_OK) fail_msg("%s: %s", cases[i].name, error.message);
        ca_scene_desc_destroy(&desc);
        ca_image_layers *a = render_source(cases[i].name, &source), *b = render_source(cases[i].name, &copy);
        compare_images(cases[i].name, a, b);
        ca_image_release(a);
        ca_image_release(b);
    }
}

/* ---- Colours at corners ---------------------------------------------------------------------------------------- */

static void check_colors(void **state, const char *attributes, const float expected[12])
{
    static char text[TEXT_SIZE];
    char path[256];
    ca_scene_desc desc;
    ca_error error = {""};
    const gltf_case c = {.name = "colours", .node = "", .primitive = ",'material':0", .attributes = attributes,
                         .light = LAMP_NODE,
                         .top = "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP};
    path_in(state, "scene.gltf", path);
    gltf_case_text(&c, text, sizeof text);
    if (ca_import_scene_text(text, strlen(text), path, NULL, 0, &desc, &error) != CA_OK)
        fail_msg("%s", error.message);
    const ca_mesh_attribute *colors = ca_mesh_find_attribute(&desc.meshes.items[0], "vertex_color");
    assert_non_null(colors);
    assert_int_equal(colors->components, 3);
    for (int i = 0; i < 12; i++) {
        static const float base[3] = {0.5f, 0.25f, 0.75f};
        if (fabsf(colors->values[i] - expected[i] * base[i % 3]) > 1e-7f)
            fail_msg("colour %d is %g", i, (double)colors->values[i]);
    }
    ca_scene_desc_destroy(&desc);
}

static void test_colors(void **state)
{
    gltf_write_files(folder_of(state));
    check_colors(state, "'POSITION':0,'NORMAL':1,'COLOR_0':4",
                 (const float[12]){1, 0, 0, 0, 1, 0, 0, 0, 1, 0.5f, 0.25f, 0.75f});
    check_colors(state, "'POSITION':0,'NORMAL':1,'COLOR_0':5",
                 (const float[12]){1, 0, 0.2f, 0, 1, 0, 0.4f, 0, 1, 1, 1, 0});
}

/* With a texture: both, times the factor; twins within rounding. */
#define YELLOW "'POSITION':0,'NORMAL':1,'TEXCOORD_0':2,'COLOR_0':12"
#define YELLOW_TOP(members)                                                                                          \
    "'materials':[{'pbrMetallicRoughness':{'metallicFactor':0,'baseColorFactor':[0.5,0.25,0.75,1],"                  \
    "'baseColorTexture':{'index':0}}" members "}]," MAP_TOP "," LAMP_TOP
#define YELLOW_TEXTURE(attribute)                                                                                    \
    "<texture type='scale' " attribute "><rgb name='scale' value='0.5 0.25 0.375'/><texture type='bitmap'>"          \
    "<string name='filename' value='map.png'/></texture></texture>"

static void assert_near_images(const char *name, const ca_image_layers *a, const ca_image_layers *b)
{
    static const char *const names[3] = {"R", "G", "B"};
    double sum = 0.0;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            const double x = (double)ca_layers_find(a, names[c])[i], y = (double)ca_layers_find(b, names[c])[i];
            sum += x;
            if (!(fabs(x - y) <= 1e-5 * (y + 0.01)))
                fail_msg("%s: pixel %d of %s is %.9g, and %.9g of its twin", name, i, names[c], x, y);
        }
    assert_true(sum > 0.01);
}

static void test_colors_and_a_texture(void **state)
{
    static const gltf_case both[] = {
        {"coloured corners and a texture", "", ",'material':0", YELLOW, LAMP_NODE, YELLOW_TOP(""),
         "<bsdf type='twosided' id='m'>" PRINCIPLED(YELLOW_TEXTURE("name='base_color'")
         "<float name='roughness' value='1'/><float name='metallic' value='0'/>") "</bsdf>" SHAPE("square", "")},
        {"the same, unlit", "", ",'material':0", YELLOW, LAMP_NODE,
         YELLOW_TOP(",'extensions':{'KHR_materials_unlit':{}}"),
         YELLOW_TEXTURE("id='t'") "<bsdf type='diffuse' id='m'><float name='reflectance' value='0'/></bsdf>"
         SHAPE("square", "<emitter type='area'><ref name='radiance' id='t'/></emitter>")},
    };
    static char text[TEXT_SIZE];
    char path[256];
    gltf_write_files(folder_of(state));
    for (size_t i = 0; i < sizeof both / sizeof both[0]; i++) {
        ca_image_layers *a = render_case(state, &both[i]);
        path_in(state, "twin.xml", path);
        gltf_case_twin(&both[i], text, sizeof text);
        const ca_scene_source twin = gltf_twin_source(text, path);
        ca_image_layers *b = render_source(both[i].name, &twin);
        assert_near_images(both[i].name, a, b);
        ca_image_release(a);
        ca_image_release(b);
    }
}

/* ---- Instances of one node ------------------------------------------------------------------------------------- */

/* Scaled by accessor 12, turned by 5 as quaternions, moved by 0, and then by the node's own translation. */
static void test_many_places(void **state)
{
    static const float quaternions[4][4] = {{1, 0, 0.2f, 1}, {0, 1, 0, 1}, {0.4f, 0, 1, 1}, {1, 1, 0, 1}};
    static const float translations[4][3] = {{-1, -1, 0}, {1, -1, 0.25f}, {1, 1, 0}, {-1, 1, -0.125f}};
    static char text[TEXT_SIZE], twin_text[TEXT_SIZE];
    char path[256];
    size_t at = (size_t)snprintf(twin_text, sizeof twin_text,
                                 "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf>"
                                 "<shape type='shapegroup' id='g'><shape type='mesh'>"
                                 "<string name='data' value='plain'/><ref id='m'/></shape></shape>" LAMP_TWIN);
    for (int i = 0; i < 4; i++) {
        const float *q = quaternions[i], *t = translations[i];
        const double sine = sqrt((double)(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]));
        at += (size_t)snprintf(twin_text + at, sizeof twin_text - at,
                               "<shape type='instance'><transform name='to_world'><scale value='1 1 0.5'/>"
                               "<rotate x='%.9g' y='%.9g' z='%.9g' angle='%.17g'/><translate value='%g %g %g'/>"
                               "<translate value='0.25 0 -4'/></transform><ref id='g'/></shape>",
                               (double)q[0], (double)q[1], (double)q[2],
                               2.0 * atan2(sine, (double)q[3]) * 180.0 / 3.14159265358979323846, (double)t[0],
                               (double)t[1], (double)t[2]);
    }
    const gltf_case c = {"many places",
                         ",'translation':[0.25,0,-4],'extensions':{'EXT_mesh_gpu_instancing':{'attributes':"
                         "{'TRANSLATION':0,'ROTATION':5,'SCALE':12}}}",
                         ",'material':0", NULL, LAMP_NODE,
                         "'extensionsRequired':['EXT_mesh_gpu_instancing'],"
                         "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP, twin_text};
    gltf_write_files(folder_of(state));
    ca_image_layers *a = render_case(state, &c);
    path_in(state, "twin.xml", path);
    gltf_case_twin(&c, text, sizeof text);
    const ca_scene_source twin = gltf_twin_source(text, path);
    ca_image_layers *b = render_source(c.name, &twin);
    assert_near_images(c.name, a, b);
    ca_image_release(a);
    ca_image_release(b);
}

/* ---- Containers ------------------------------------------------------------------------------------------------ */

static void put_u32(FILE *file, size_t value)
{
    for (int i = 0; i < 4; i++) fputc((int)(value >> (8 * i) & 255), file);
}

/* The first case with its buffer in the chunk of a .glb. */
static void write_glb(void **state, const char *json, const char *name)
{
    char path[256];
    ca_bytes square;
    ca_error error = {""};
    path_in(state, "square.bin", path);
    assert_int_equal(ca_file_read(path, "buffer", 1 << 20, &square, &error), CA_OK);
    path_in(state, name, path);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    const size_t length = (strlen(json) + 3) / 4 * 4, data = (square.size + 3) / 4 * 4;
    fputs("glTF", file);
    put_u32(file, 2), put_u32(file, 12 + 8 + length + 8 + data), put_u32(file, length);
    fputs("JSON", file);
    fprintf(file, "%-*s", (int)length, json);
    put_u32(file, data);
    fwrite("BIN", 1, 4, file);
    fwrite(square.data, 1, square.size, file);
    for (size_t i = square.size; i < data; i++) fputc(0, file);
    assert_int_equal(fclose(file), 0);
    ca_bytes_destroy(&square);
}

static char *base64_of(const unsigned char *data, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    static char text[TEXT_SIZE];
    size_t length = 0;
    for (size_t i = 0; i < size; i += 3) {
        const unsigned bits = (unsigned)data[i] << 16 | (i + 1 < size ? (unsigned)data[i + 1] << 8 : 0) |
                              (i + 2 < size ? data[i + 2] : 0u);
        for (size_t k = 0; k < 4; k++)
            text[length++] = i + k > size ? '=' : digits[bits >> (18 - 6 * k) & 63];
    }
    text[length] = '\0';
    return text;
}

static void replace(char *text, size_t size, const char *from, const char *to)
{
    char *at = strstr(text, from);
    assert_non_null(at);
    const size_t rest = strlen(at + strlen(from)) + 1;
    assert_true((size_t)(at - text) + strlen(to) + rest < size);
    memmove(at + strlen(to), at + strlen(from), rest);
    memcpy(at, to, strlen(to));
}

static void test_containers(void **state)
{
    static char text[TEXT_SIZE], uri[TEXT_SIZE + 64];
    char path[256];
    gltf_write_files(folder_of(state));
    const gltf_case *c = find_case("texture of a file, its sampler and its map");
    ca_image_layers *expected = render_case(state, c);
    gltf_case_text(c, text, sizeof text);
    replace(text, sizeof text, "\"uri\":\"square.bin\",", "");
    write_glb(state, text, "scene.GLB");
    path_in(state, "scene.GLB", path);
    ca_scene_source source = {.path = path};
    ca_image_layers *image = render_source("a .glb", &source);
    compare_images("a .glb", image, expected);
    ca_image_release(image);

    ca_bytes bytes;
    ca_error error = {""};
    path_in(state, "map.png", path);
    assert_int_equal(ca_file_read(path, "image", 1 << 20, &bytes, &error), CA_OK);
    snprintf(uri, sizeof uri, "data:image/png;base64,%s", base64_of(bytes.data, bytes.size));
    ca_bytes_destroy(&bytes);
    gltf_case_text(c, text, sizeof text);
    replace(text, sizeof text, "map%2epng", uri);
    path_in(state, "scene.gltf", path);
    source = (ca_scene_source){.text = text, .size = strlen(text), .path = path};
    image = render_source("data in a uri", &source);
    compare_images("data in a uri", image, expected);
    ca_image_release(image);
    ca_image_release(expected);
}

/* ---- Refusals -------------------------------------------------------------------------------------------------- */

typedef struct refusal {
    const char *from, *to; /* replaced in the JSON of "factors" */
    const char *message;   /* behind the file's name */
} refusal;

static const refusal refusals[] = {
    {"'version':'2.0'", "'version':'1.0'", ":1:10: asset: version \"1.0\" of glTF is not read; 2.0 is"},
    {"'scene':0", "'scene':1", "scene: is 1, and scenes has 1 elements"},
    {"[0,1,2]", "[0,1,7]", ":1:62: scenes[0].nodes[2]: is no node of the 3 that there are"},
    {"[0,1,2]", "[0,1,1]", "nodes[1]: this node is in the tree of nodes twice, or in itself"},
    {"'mesh':0", "'mesh':0,'children':[1]", "nodes[1]: this node is in the tree of nodes twice"},
    {"'mesh':0", "'mesh':0,'skin':0", "nodes[1]: skins are not supported"},
    {"'mesh':0", "'mesh':0,'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':0,'SCALE':3}}}",
     "accessors[3]: has 6 elements, and another part of the instances 4"},
    {"'mesh':0", "'mesh':1", "nodes[1].mesh: is 1, and meshes has 1 elements"},
    {"'mesh':0", "'mesh':0,'matrix':[1,2]", "nodes[1].matrix: must be 16 numbers"},
    {"'mesh':0", "'mesh':0,'rotation':[0,0,0,0]", "nodes[1]: its rotation is no quaternion"},
    {"'indices':3", "'indices':3,'targets':[]", "meshes[0].primitives[0]: morph targets are not supported"},
    {"'indices':3", "'indices':8,'mode':9", "mode must be from 0 to 6"},
    {"'indices':3", "'indices':0", "accessors[0]: has elements of 3 components, and 1 are expected"},
    {"'NORMAL':1", "'NORMAL':3", "accessors[3]: has 6 elements, and the positions have 4"},
    {"'count':6", "'count':7", "accessors[3]: 7 elements do not fit in the buffer view"},
    {"'count':6", "'count':0", "accessors[3]: count must be from 1 to 2^31 - 1"},
    {"'componentType':5123,'count':6", "'componentType':5124,'count':6", "componentType must be 5120 to 5123"},
    {"'bufferView':3,'componentType':5123", "'bufferView':5,'componentType':5121",
     "accessors[3]: index 0 is 255, and there are 4 vertices"},
    {"'byteLength':452", "'byteLength':453", "buffers[0]: has 452 bytes instead of 453"},
    {"'byteLength':452", "'byteLength':100", "does not lie in its buffer, which has 100 bytes"},
    {"'uri':'square.bin'", "'uri':'none.bin'", "buffers[0]: "},
    {"'uri':'square.bin'", "'uri':'https://x/y.bin'", "only files and data are read"},
    {"'uri':'square.bin'", "'uri':'data:text/plain,x'", "data in a uri must be base64"},
    {"'baseColorFactor':[0.5", "'baseColorFactor':[1.5",
     "materials[0].pbrMetallicRoughness.baseColorFactor: must lie in [0, 1]"},
    {"'roughnessFactor':0.5", "'roughnessFactor':'x'",
     "materials[0].pbrMetallicRoughness.roughnessFactor: must be a number, not a text"},
    {"'roughnessFactor':0.5", "'roughnessFactor':-1", "roughnessFactor: is -1, and must lie in [0, 1]"},
    {"'roughnessFactor':0.5", "'roughnessFactor':0.5,'roughnessFactor':0.5", "this key is given twice"},
    {"'metallicFactor':0.25", "'metallicRoughnessTexture':{'index':0}",
     "metallicRoughnessTexture.index: is 0, and textures has 0 elements"},
    {"'materials':[{", "'materials':[{'alphaMode':'X',", "materials[0]: alphaMode \"X\" is not known"},
    {"'materials':[{", "'extensionsRequired':['KHR_draco_mesh_compression'],'materials':[{",
     "extensionsRequired[0]: the file needs the extension KHR_draco_mesh_compression, which is not supported"},
    {"'materials':[{",
     "'materials':[{'extensions':{'KHR_materials_transmission':{'transmissionFactor':1},'KHR_materials_volume':"
     "{'thicknessFactor':1,'attenuationDistance':1,'attenuationColor':[0.5,1,1]}},",
     "materials[0].extensions.KHR_materials_volume: volumes that absorb light are not supported"},
    {"'materials':[{",
     "'textures':[{'extensions':{'KHR_texture_basisu':{'source':0}}}],'materials':[{'normalTexture':{'index':0},",
     "textures[0]: textures in KTX2 (KHR_texture_basisu) are not read"},
    {"'materials':[{",
     "'textures':[{'source':0}],'images':[{'uri':'square.bin'}],'materials':[{'normalTexture':{'index':0},",
     "images[0]: images are PNG, JPEG or WebP files, and this is none of them"},
    {"'materials':[{",
     "'textures':[{'source':0}],'images':[{'uri':'map.png'}],'materials':[{'normalTexture':{'index':0,'texCoord':1},",
     "meshes[0].primitives[0]: has no TEXCOORD_1, which its material needs"},
    {"'buffer':0,'byteLength':48", "'buffer':0,'byteLength':48,'extensions':{'EXT_meshopt_compression':{}}",
     "bufferViews[0]: data packed by meshopt is not read"},
    {"'indices':3", "'indices':3,'extensions':{'KHR_draco_mesh_compression':{}}", NULL},
    {"'POSITION':0,'NORMAL':1", "'POSITION':10", NULL},
    {"'intensity':40", "'intensity':-40", "extensions.KHR_lights_punctual.lights[0].intensity: is -40"},
    {"'type':'point'", "'type':'bulb'", "type \"bulb\" is not point, spot or directional"},
    {"'light':0", "'light':1", "nodes[2].extensions.KHR_lights_punctual: counts no light of the 1 that there are"},
    {"'camera':0", "'camera':1", "nodes[0].camera: is 1, and cameras has 1 elements"},
    {"'yfov':0.75,", "", "cameras[0].perspective: has no yfov"},
    {"'type':'perspective'", "'type':'ortographic'",
     "cameras[0]: type \"ortographic\" is not perspective or orthographic"},
    {"'type':'perspective'", "'type':'orthographic','orthographic':{'ymag':1}",
     "cameras[0].orthographic: has no xmag"},
    {"'type':'perspective'", "'type':'orthographic','orthographic':{'xmag':1}",
     "cameras[0].orthographic: has no ymag"},
    {"'yfov':0.75", "'yfov':4", "cameras[0].perspective.yfov: is 4, and must lie in"},
    {"'scene':0", "'scene':0 0", ":1:38: this is not JSON: expected , or }"},
    {"'scene':0", "'scene':01", "this is not JSON: expected a value"},
    {"'scene':0", "'scene':0,'a\\u0000':1", "this is not JSON: a wrong \\u in a string"},
    {"'scene':0", "'scene':0,'a\xff':1", "this is not JSON: a character that a string cannot have"},
};

static void test_refusals(void **state)
{
    static char text[TEXT_SIZE];
    char path[256], from[512], to[512];
    gltf_write_files(folder_of(state));
    path_in(state, "scene.gltf", path);
    for (size_t i = 0; i < sizeof refusals / sizeof *refusals; i++) {
        const refusal *r = &refusals[i];
        ca_scene_desc desc;
        ca_error error = {""};
        gltf_case_text(find_case("factors"), text, sizeof text);
        snprintf(from, sizeof from, "%s", r->from), snprintf(to, sizeof to, "%s", r->to);
        for (char *c = from; *c; c++) *c = *c == '\'' ? '"' : *c;
        for (char *c = to; *c; c++) *c = *c == '\'' ? '"' : *c;
        replace(text, sizeof text, from, to);
        const ca_status status = ca_import_scene_text(text, strlen(text), path, NULL, 0, &desc, &error);
        if (!r->message && status != CA_OK) fail_msg("%s is refused: %s", r->to, error.message);
        if (!r->message) {
            ca_scene_desc_destroy(&desc);
            continue;
        }
        if (status == CA_OK) fail_msg("%s is not refused", r->to);
        if (!strstr(error.message, r->message) || strncmp(error.message, path, strlen(path)) != 0)
            fail_msg("%s: \"%s\" does not tell \"%s\"", r->to, error.message, r->message);
    }
}

/* ---- Cameras, and what is missing ------------------------------------------------------------------------------ */

static void load_text(void **state, const char *text, const char *camera, ca_scene_desc *desc)
{
    char path[256];
    ca_error error = {""};
    path_in(state, "scene.gltf", path);
    const ca_scene_source source = {.text = text, .size = strlen(text), .path = path, .camera = camera};
    if (ca_import_scene_source(&source, desc, &error) != CA_OK) fail_msg("%s", error.message);
}

/* Each extension of a material that is not read is said once, whoever defined it. */
static void test_unread_extensions(void **state)
{
    static char text[TEXT_SIZE];
    ca_scene_desc desc;
    char many[4096] = "\"materials\":[{\"extensions\":{";
    gltf_write_files(folder_of(state));
    gltf_case_text(find_case("factors"), text, sizeof text);
    replace(text, sizeof text, "\"materials\":[{",
            "\"extensionsUsed\":[\"ADOBE_materials_clearcoat_tint\"],\"materials\":[{\"extensions\":{"
            "\"ADOBE_materials_clearcoat_tint\":{},\"KHR_materials_iridescence\":{},\"KHR_materials_ior\":{}},");
    load_text(state, text, NULL, &desc);
    assert_int_equal(desc.notes.count, 2);
    assert_says(desc.notes.items[0], "the material extension ADOBE_materials_clearcoat_tint is not read");
    assert_says(desc.notes.items[1], "the material extension KHR_materials_iridescence is not read");
    ca_scene_desc_destroy(&desc);
    for (int i = 0; i < 40; i++) {
        const size_t used = strlen(many);
        snprintf(many + used, sizeof many - used, "%s\"X_%d\":{}", i ? "," : "", i);
    }
    strcat(many, "},");
    gltf_case_text(find_case("factors"), text, sizeof text);
    replace(text, sizeof text, "\"materials\":[{", many);
    load_text(state, text, NULL, &desc);
    assert_int_equal(desc.notes.count, 33);
    assert_says(desc.notes.items[32], "more than 32 material extensions are not read");
    ca_scene_desc_destroy(&desc);
}

/* 3 wide and 2 high, seen from (1, 2, 5) along +x: the second sensor of the file. */
static void test_cameras(void **state)
{
    static char text[TEXT_SIZE];
    ca_scene_desc desc;
    ca_error error = {""};
    gltf_case c = *find_case("factors");
    c.light = LAMP_NODE ",'children':[3]},{'name':'Side','camera':1,'translation':[0,0.5,2],"
                        "'rotation':[0,-0.70710678118654757,0,0.70710678118654757]";
    gltf_write_files(folder_of(state));
    gltf_case_text(&c, text, sizeof text);
    replace(text, sizeof text, "\"zfar\":100}}",
            "\"zfar\":100}},{\"type\":\"orthographic\",\"orthographic\":"
            "{\"xmag\":1.5,\"ymag\":1,\"znear\":0.5,\"zfar\":9}}");
    load_text(state, text, "Side", &desc);
    assert_int_equal(desc.camera.camera.kind, CA_CAMERA_ORTHOGRAPHIC);
    assert_int_equal(desc.film.width, 768);
    assert_int_equal(desc.film.height, 512);
    static const float expected[3][4] = {{0, 0, 1, 1}, {0, 1.5f, 0, 2}, {-1.5f, 0, 0, 5}};
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++)
            if (fabsf(desc.camera.camera.map.to[row][column] - expected[row][column]) > 1e-6f)
                fail_msg("row %d, column %d of the camera's map is %g", row, column,
                         (double)desc.camera.camera.map.to[row][column]);
    assert_true(desc.camera.camera.near_clip == 0.5f && desc.camera.camera.far_clip == 9.0f);
    ca_scene_desc_destroy(&desc);
    load_text(state, text, NULL, &desc);
    assert_int_equal(desc.camera.camera.kind, CA_CAMERA_PERSPECTIVE);
    ca_scene_desc_destroy(&desc);
    const ca_scene_source source = {.text = text, .size = strlen(text), .path = "scene.gltf", .camera = "side"};
    assert_int_not_equal(ca_import_scene_source(&source, &desc, &error), CA_OK);
}

/* A file without camera and light is seen whole, under a white sky, and both are said. */
static void test_defaults(void **state)
{
    static char text[TEXT_SIZE];
    char path[256];
    const gltf_case c = {.name = "bare", .node = ",'translation':[100,0,0]", .primitive = "", .light = "", .top = ""};
    ca_scene_desc desc;
    gltf_write_files(folder_of(state));
    gltf_case_text(&c, text, sizeof text);
    replace(text, sizeof text, "\"camera\":0,", "");
    load_text(state, text, NULL, &desc);
    assert_int_equal(desc.lights.count, 1);
    assert_int_equal(desc.lights.items[0].kind, CA_LIGHT_CONSTANT);
    assert_int_equal(desc.notes.count, 2);
    assert_says(desc.notes.items[0], "there is no camera in the scene");
    assert_says(desc.notes.items[1], "there is no light in the scene");
    ca_scene_desc_destroy(&desc);
    /* All four corners are in the picture: albedo there, and none at its edges. */
    path_in(state, "scene.gltf", path);
    const ca_scene_source source = {.text = text, .size = strlen(text), .path = path};
    ca_image_layers *image = render_source("bare", &source);
    const float *z = ca_layers_find(image, "N.Z");
    int inside = 0, edge = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        const int x = i % WIDTH, y = i / WIDTH;
        const bool hit = z[i] != 0.0f;
        inside += hit;
        edge += hit && (x == 0 || y == 0 || x == WIDTH - 1 || y == HEIGHT - 1);
    }
    assert_int_equal(edge, 0);
    assert_in_range(inside, WIDTH * HEIGHT / 10, WIDTH * HEIGHT / 2);
    ca_image_release(image);
}

/* ---- The program ----------------------------------------------------------------------------------------------- */

static void test_the_program(void **state)
{
    static char text[TEXT_SIZE];
    ca_program_result r;
    gltf_write_files(folder_of(state));
    gltf_case_text(find_case("factors"), text, sizeof text);
    write_text(folder_of(state), "scene.gltf", text);
    RUN(&r, "info", "scene.gltf", "--camera", "Eye");
    assert_exit(&r, 0);
    assert_says(r.output, "field of view");
    RUN(&r, "render", "scene.gltf", "--camera", "Eyes", "-o", "a.exr");
    assert_wrong_usage(&r, "there is no sensor \"Eyes\"; the nearest id is \"Eye\"");
    RUN(&r, "render", "scene.gltf", "--camera=Eye", "--spp=1", "--resolution=24x16", "-o", "a.exr", "--quiet");
    assert_exit(&r, 0);
    RUN(&r, "info", "scene.gltf", "-D", "a=b");
    assert_exit(&r, 2);
}

/* ---- Failing allocations --------------------------------------------------------------------------------------- */

static void test_failing_allocations(void **state)
{
    static char text[TEXT_SIZE];
    static const char *const names[] = {"clearcoat", "instances", "sparse positions"};
    char path[256];
    gltf_write_files(folder_of(state));
    path_in(state, "scene.gltf", path);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        gltf_case_text(find_case(names[i]), text, sizeof text);
        for (long count = 0;; count++) {
            ca_scene_desc desc;
            ca_error error = {""};
            ca_memory_fail_after(count);
            const ca_status status = ca_import_scene_text(text, strlen(text), path, NULL, 0, &desc, &error);
            ca_memory_fail_after(-1);
            if (status == CA_OK) {
                ca_scene_desc_destroy(&desc);
                assert_in_range(count, 20, 10000);
                break;
            }
            if (status != CA_ERROR_MEMORY && !strstr(error.message, "memory"))
                fail_msg("allocation %ld: %s", count, error.message);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_twins),      PROGRAM_TEST(test_converted), PROGRAM_TEST(test_colors),
        PROGRAM_TEST(test_containers), PROGRAM_TEST(test_refusals),  PROGRAM_TEST(test_failing_allocations),
        PROGRAM_TEST(test_unread_extensions),
        PROGRAM_TEST(test_cameras),    PROGRAM_TEST(test_defaults),  PROGRAM_TEST(test_the_program),
        PROGRAM_TEST(test_colors_and_a_texture), PROGRAM_TEST(test_many_places),
    };
    return run_program_tests("glTF", tests, sizeof tests / sizeof tests[0]);
}
