#include "support/gltf_twins.h"

#include "image/layers.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

ca_image_layers *gltf_render(const char *name, const ca_scene_source *source)
{
    ca_scene *scene = NULL;
    ca_image_layers *image = NULL;
    ca_error error = {""};
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = "path:max_depth=4";
    settings.samples_per_pixel = 4;
    settings.width = GLTF_WIDTH;
    settings.height = GLTF_HEIGHT;
    settings.threads = 1;
    if (ca_scene_parse(source, &scene, &error) != CA_OK) fail_msg("%s: %s", name, error.message);
    if (ca_render(scene, &settings, &image, NULL, &error) != CA_OK) fail_msg("%s: %s", name, error.message);
    ca_scene_release(scene);
    return image;
}

void gltf_compare_within(const char *name, const ca_image_layers *a, const ca_image_layers *b, float tolerance)
{
    static const char *const names[3] = {"R", "G", "B"};
    double sum = 0.0;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < GLTF_WIDTH * GLTF_HEIGHT; i++) {
            const float x = ca_layers_find(a, names[c])[i], y = ca_layers_find(b, names[c])[i];
            sum += (double)x;
            if (!(fabsf(x - y) <= tolerance))
                fail_msg("%s: pixel %d of %s is %.9g, and %.9g of its twin", name, i, names[c], (double)x, (double)y);
        }
    if (!(sum > 0.01)) fail_msg("%s: the picture is black", name);
}

void gltf_compare(const char *name, const ca_image_layers *a, const ca_image_layers *b)
{
    gltf_compare_within(name, a, b, 0.0f);
}

void gltf_path_in(const char *folder, const char *name, char path[256])
{
    snprintf(path, 256, "%s/%s", folder, name);
}

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

#define MAP "<string name='data' value='"
#define METALLIC(metallic) "<float name='metallic' value='" metallic "'/>"
#define HALF_ROUGH(metallic) "<float name='roughness' value='0.5'/>" METALLIC(metallic)
#define DULL_MAP(metallic) "<texture type='bitmap' name='roughness'>" MAP "dull'/></texture>" METALLIC(metallic)

const gltf_case gltf_cases[] = {
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
const int gltf_case_count = sizeof gltf_cases / sizeof gltf_cases[0];

const gltf_case *gltf_find_case(const char *name)
{
    for (int i = 0; i < gltf_case_count; i++)
        if (strcmp(gltf_cases[i].name, name) == 0) return &gltf_cases[i];
    fail_msg("there is no case \"%s\"", name);
    return NULL;
}

ca_image_layers *gltf_render_case(const char *folder, const gltf_case *c)
{
    static char text[GLTF_TEXT_SIZE];
    char path[256];
    gltf_path_in(folder, "scene.gltf", path);
    gltf_case_text(c, text, sizeof text);
    const ca_scene_source source = {.text = text, .size = strlen(text), .path = path};
    return gltf_render(c->name, &source);
}
