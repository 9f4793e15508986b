#include "support/agreement_scenes.h"

#include "support/closed_forms.h"
#include "support/scene_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

/* ---- Parts ----------------------------------------------------------------------------------------------------- */

#define NUMBER(name, value) "<float name='" name "' value='" value "'/>"
#define COLOR(name, value) "<rgb name='" name "' value='" value "'/>"
#define TO_WORLD(steps) "<transform name='to_world'>" steps "</transform>"
#define LOOK(origin, target) TO_WORLD("<lookat origin='" origin "' target='" target "' up='0,1,0'/>")
#define AT(xyz) "<translate value='" xyz "'/>"
#define SCALE(xyz) "<scale value='" xyz "'/>"
#define TURN(axis, angle) "<rotate " axis "='1' angle='" angle "'/>"
#define FILM(filter)                                                                                                 \
    "<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='24'/>"                     \
    "<rfilter type='" filter "'/></film>"
#define BITMAP(name, file, more)                                                                                     \
    "<texture type='bitmap' name='" name "'><string name='filename' value='" file "'/>" more "</texture>"
#define RAW "<boolean name='raw' value='true'/>"

/* sensors */
#define FRONT_VIEW                                                                                                   \
    "<sensor type='perspective'>" NUMBER("fov", "48") LOOK("0,1.6,4.2", "0,0.7,0") FILM("tent") "</sensor>"
#define LENS_VIEW                                                                                                    \
    "<sensor type='thinlens'>" NUMBER("fov", "48") NUMBER("aperture_radius", "0.12") NUMBER("focus_distance", "4")   \
        LOOK("0.4,1.5,4.1", "0,0.7,0") FILM("gaussian") "</sensor>"
/* A triplet of this project's own, whose rims cut off light towards the corners. */
#define GLASS_VIEW                                                                                                   \
    "<sensor type='realistic'><string name='lens' value='21.06 6 1.694 20; 283.8 4.22 1 16.8; -35.52 1.4 1.673 13; " \
    "19.07 1 1 12.2; 0 4.89 0 11.7; 63.24 3 1.694 15.6; -26.56 0 1 16.8'/>" NUMBER("film_diagonal", "38")            \
        NUMBER("lens_scale", "0.02") NUMBER("focus_distance", "4") LOOK("0.4,1.5,4.4", "0,0.7,0")                    \
            FILM("gaussian") "</sensor>"
#define PARALLEL_VIEW                                                                                                \
    "<sensor type='orthographic'>" TO_WORLD(                                                                         \
        SCALE("1.7") "<lookat origin='-1,2.2,3.5' target='0,0.7,0' up='0,1,0'/>") FILM("box") "</sensor>"

/* BSDFs */
#define DIFFUSE(rgb) "<bsdf type='diffuse'>" COLOR("reflectance", rgb) "</bsdf>"
#define TWOSIDED(bsdf) "<bsdf type='twosided'>" bsdf "</bsdf>"
#define MIRROR                                                                                                       \
    "<bsdf type='conductor'><string name='material' value='none'/>" COLOR("specular_reflectance", "0.9") "</bsdf>"
#define GLASS "<bsdf type='dielectric'/>"
#define ROUGH_METAL(metal, alpha)                                                                                    \
    "<bsdf type='roughconductor'><string name='material' value='" metal "'/>" NUMBER("alpha", alpha) "</bsdf>"
#define ROUGH_GLASS(alpha)                                                                                           \
    "<bsdf type='roughdielectric'><string name='distribution' value='ggx'/>" NUMBER("alpha", alpha) "</bsdf>"
#define ROUGH_PLASTIC(rgb, alpha)                                                                                    \
    "<bsdf type='roughplastic'>" COLOR("diffuse_reflectance", rgb) NUMBER("alpha", alpha) "</bsdf>"
#define CHECKERS                                                                                                     \
    "<bsdf type='diffuse'><texture type='checkerboard' name='reflectance'>" COLOR("color0", "0.7,0.6,0.5")           \
        COLOR("color1", "0.2,0.3,0.4") "<transform name='to_uv'><scale value='3'/></transform></texture></bsdf>"

/* shapes */
#define BALL(centre, radius, inside)                                                                                 \
    "<shape type='sphere'><point name='center' value='" centre "'/>" NUMBER("radius", radius) inside "</shape>"
#define SHAPE(type, steps, inside) "<shape type='" type "'>" TO_WORLD(steps) inside "</shape>"
#define FLOOR(bsdf) SHAPE("rectangle", SCALE("2.5") TURN("x", "-90"), bsdf)
#define BACK_WALL(bsdf) SHAPE("rectangle", SCALE("2.5") AT("0,2,-1.6"), bsdf)
/* Encloses everything, the sensors too. */
#define ROOM(bsdf)                                                                                                   \
    "<shape type='cube'><boolean name='flip_normals' value='true'/>" TO_WORLD(                                       \
        "<scale x='2.4' y='1.5' z='4.5'/>" AT("0,1.5,0.5")) bsdf "</shape>"
#define KNOT(bsdf)                                                                                                   \
    "<shape type='ply'><string name='filename' value='knot.ply'/>" TO_WORLD(SCALE("0.7") AT("-0.1,0.9,0")) bsdf      \
        "</shape>"

/* lights */
#define GLOW(rgb) "<emitter type='area'>" COLOR("radiance", rgb) "</emitter>"
#define BLACK DIFFUSE("0")
#define CEILING_LIGHT(side, height, emitter)                                                                         \
    SHAPE("rectangle", SCALE(side) TURN("x", "90") AT("0.3," height ",0.3"), BLACK emitter)
#define POINT(position, rgb)                                                                                         \
    "<emitter type='point'><point name='position' value='" position "'/>" COLOR("intensity", rgb) "</emitter>"
#define SPOT(origin, target, rgb)                                                                                    \
    "<emitter type='spot'>" COLOR("intensity", rgb) NUMBER("cutoff_angle", "45") LOOK(origin, target) "</emitter>"
#define SKY(rgb) "<emitter type='constant'>" COLOR("radiance", rgb) "</emitter>"

#define SKY_PICTURE(file) "<emitter type='envmap'><string name='filename' value='" file "'/></emitter>"

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

static const agreement_scene scenes[] = {
    {.name = "point light, rough balls",
     .sensor = FRONT_VIEW,
     .max_depth = 5,
     .radius = 0.02f,
     .fast = true,
     .content = FLOOR(CHECKERS) BACK_WALL(DIFFUSE("0.6,0.5,0.4")) BALL("-0.7,0.5,0", "0.5", ROUGH_METAL("Cu", "0.3"))
         BALL("0.6,0.45,0.4", "0.45", ROUGH_PLASTIC("0.2,0.5,0.3", "0.25")) POINT("-0.6,2.4,1", "9,8,7")},
    {.name = "spot in a closed room",
     .sensor = FRONT_VIEW,
     .max_depth = 6,
     .radius = 0.02f,
     .content = ROOM(DIFFUSE("0.6,0.55,0.5"))
         BALL("-0.6,0.5,0", "0.5",
              "<bsdf type='principled'>" COLOR("base_color", "0.8,0.5,0.2") NUMBER("metallic", "0.6")
                  NUMBER("roughness", "0.45") NUMBER("clearcoat", "0.7") NUMBER("anisotropic", "0.4") "</bsdf>")
             SHAPE("cube", SCALE("0.35") TURN("y", "30") AT("0.8,0.35,0.2"), DIFFUSE("0.3,0.5,0.7"))
                 SPOT("1.2,2.7,2", "-0.2,0.3,-0.3", "24,22,20")},
    {.name = "directional light, rough glass, parallel view",
     .sensor = PARALLEL_VIEW,
     .max_depth = 6,
     .radius = 0.02f,
     .content = FLOOR(CHECKERS) BALL("-0.5,0.6,0", "0.6", ROUGH_GLASS("0.4")) SHAPE(
         "cube", SCALE("0.3") TURN("y", "20") AT("0.8,0.3,0.1"),
         ROUGH_METAL("Al",
                     "0.35")) "<emitter type='directional'>" COLOR("irradiance",
                                                                   "3,2.8,2.5") "<vector name='direction' "
                                                                                "value='-0.5,-1,-0.4'/></emitter>"},
    {.name = "constant sky, instances, thin lens",
     .sensor = LENS_VIEW,
     .max_depth = 5,
     .hide_emitters = true,
     .radius = 0.02f,
     .fast = true,
     .content = SHAPE("disk", SCALE("2.5") TURN("x", "-90"), CHECKERS) "<shape type='shapegroup' id='pair'>" BALL(
         "0,0.3,0", "0.3", ROUGH_PLASTIC("0.6,0.3,0.2", "0.3"))
         SHAPE(
             "cube", SCALE("0.15") AT("0.45,0.15,0"),
             DIFFUSE(
                 "0.3,0.6,0.3")) "</shape>"
                                 "<shape type='instance'><ref id='pair'/>" TO_WORLD(SCALE("1.3") AT(
                                     "-0.9,0,0")) "</shape>"
                                                  "<shape type='instance'><ref id='pair'/>" TO_WORLD(
                                                      "<scale x='1' y='1.6' z='0.8'/>" TURN("y", "70") AT(
                                                          "0.6,0,0.4")) "</shape>" BALL("0.1,0.3,-0.9", "0.3",
                                                                                        "<bsdf "
                                                                                        "type='principled'>" COLOR(
                                                                                            "base_color",
                                                                                            "0.3,0.3,0.7")
                                                                                            NUMBER("sheen", "0.8")
                                                                                                NUMBER(
                                                                                                    "flatness",
                                                                                                    "0.3") "</bsdf>")
                                                      SKY("0.9,1,1.2")},
    {.name = "sky picture, mirror and glass",
     .sensor = FRONT_VIEW,
     .max_depth = 6,
     .hide_emitters = true,
     .radius = 0.02f,
     .needs = NEEDS_SPECULAR_VIEW,
     .content = FLOOR(CHECKERS) BALL("-0.7,0.5,0", "0.5", MIRROR) BALL("0.6,0.5,0.4", "0.5", GLASS)
         SKY_PICTURE("tiles.png")},
    {.name = "projector and point, bumps and normals",
     .sensor = FRONT_VIEW,
     .max_depth = 5,
     .radius = 0.02f,
     .content = FLOOR(DIFFUSE("0.5")) SHAPE("rectangle", SCALE("2.5") AT("0,2,-1.6"),
                                            "<bsdf type='normalmap'>" BITMAP("normals", "dents.png", RAW)
                                                DIFFUSE("0.6,0.5,0.4") "</bsdf>")
         BALL("0.4,0.6,0.2", "0.6",
              "<bsdf type='bumpmap'>" BITMAP("height", "dents.png", RAW) NUMBER("scale", "0.05") ROUGH_PLASTIC(
                  "0.5,0.4,0.6", "0.3") "</bsdf>") "<emitter type='projector'>" BITMAP("irradiance", "tiles.png", "")
             NUMBER("fov", "60") NUMBER("scale", "25")
                 LOOK("-1,2.2,2.5", "0,0.6,-0.5") "</emitter>" POINT("1.5,2.2,2", "4,4,5")},
    {.name = "textured area light, glass ball, thin pane",
     .sensor = FRONT_VIEW,
     .max_depth = 7,
     .radius = 0.02f,
     .needs = NEEDS_SPECULAR_VIEW,
     .content = ROOM(DIFFUSE("0.5,0.55,0.6")) BALL("-0.6,0.5,0.3", "0.5", GLASS) SHAPE(
         "rectangle", "<scale x='0.6' y='0.8'/>" TURN("y", "-25") AT("0.8,0.8,0.3"), "<bsdf type='thindielectric'/>")
         SHAPE("cube", SCALE("0.3") AT("0.7,0.3,-0.6"), DIFFUSE("0.7,0.3,0.2")) CEILING_LIGHT(
             "1", "2.9",
             "<emitter type='area'>" BITMAP("radiance", "tiles.png",
                                            "<transform name='to_uv'><scale value='2'/></transform>") "</emitter>")},
    {.name = "spherical light, mirror, smooth plastic",
     .sensor = PARALLEL_VIEW,
     .max_depth = 6,
     .radius = 0.02f,
     .needs = NEEDS_SPECULAR_VIEW,
     .fast = true,
     .content = FLOOR(CHECKERS) BALL("-0.4,1.9,0.6", "0.45", BLACK GLOW("5,5,4"))
         SHAPE("rectangle", SCALE("0.7") TURN("y", "20") AT("-0.5,0.7,-0.9"), TWOSIDED(MIRROR))
             BALL("0.5,0.5,0", "0.5", "<bsdf type='plastic'>" COLOR("diffuse_reflectance", "0.6,0.3,0.2") "</bsdf>")},
    {.name = "many lights, blend",
     .sensor = FRONT_VIEW,
     .max_depth = 5,
     .radius = 0.02f,
     .hide_emitters = true,
     .content =
         FLOOR("<bsdf type='blendbsdf'><texture type='checkerboard' name='weight'>" COLOR("color0", "0.8")
                   COLOR("color1", "0.1") "</texture>" DIFFUSE("0.5,0.4,0.3") ROUGH_METAL("Ag", "0.3") "</bsdf>")
             SHAPE("rectangle", SCALE("0.6") TURN("y", "15") AT("-0.6,0.7,0.2"), TWOSIDED(DIFFUSE("0.2,0.6,0.7")))
                 BALL("0.8,0.4,0.2", "0.4", DIFFUSE("0.7,0.4,0.3")) CEILING_LIGHT("0.5", "2.6", GLOW("4,5,6"))
                     POINT("1.6,1.8,1.8", "2,1.5,1") SPOT("-1.6,2.4,1.5", "0,0,-0.4", "8,8,12") SKY("0.1,0.12,0.15")},
    /* each vertex chooses among them differently, and emission by power */
    {.name = "lamps of several shapes",
     .sensor = FRONT_VIEW,
     .max_depth = 4,
     .radius = 0.02f,
     .hide_emitters = true,
     .fast = true,
     .content = ROOM(DIFFUSE("0.5,0.55,0.6")) BALL("0.1,0.5,0.2", "0.5", DIFFUSE("0.6,0.5,0.4"))
         BALL("-1.4,1.9,0.4", "0.2", BLACK GLOW("6,5,4")) BALL("1.6,0.5,1.1", "0.15", BLACK GLOW("9,9,12"))
             SHAPE("disk", SCALE("0.4") TURN("y", "60") AT("-2,0.8,1.4"), BLACK GLOW("5,6,7"))
                 CEILING_LIGHT("0.7", "2.7", GLOW("2,2,2"))},
    /* what a mask lets pass is Dirac, as with glass */
    {.name = "mask, area light and sky",
     .sensor = FRONT_VIEW,
     .max_depth = 6,
     .radius = 0.02f,
     .needs = NEEDS_SPECULAR_VIEW,
     .hide_emitters = true,
     .fast = true,
     .content = FLOOR(CHECKERS)
         SHAPE("rectangle", SCALE("0.8") TURN("x", "-40") AT("-0.5,0.9,0.2"),
               "<bsdf type='mask'><texture type='checkerboard' name='opacity'>" COLOR("color0", "0.9")
                   COLOR("color1", "0.2") "<transform name='to_uv'><scale value='2'/></transform></texture>" TWOSIDED(
                       DIFFUSE("0.2,0.6,0.7")) "</bsdf>") BALL("0.8,0.4,0.2", "0.4", DIFFUSE("0.7,0.4,0.3"))
             CEILING_LIGHT("0.9", "2.6", GLOW("3,4,4")) SKY("0.2,0.24,0.3")},
    {.name = "shading normals, disk light",
     .sensor = FRONT_VIEW,
     .max_depth = 5,
     .radius = 0.02f,
     .fast = true,
     .content = FLOOR(DIFFUSE("0.5,0.5,0.6")) BACK_WALL(DIFFUSE("0.6")) KNOT(
         "<bsdf type='diffuse'><texture type='mesh_attribute' name='reflectance'><string name='name' "
         "value='vertex_color'/>"
         "</texture></bsdf>") SHAPE("disk", SCALE("0.6") TURN("x", "110") AT("-0.8,2.5,1.2"), BLACK GLOW("9,8,7"))},
    {.name = "rough glass and area light, thin lens",
     .sensor = LENS_VIEW,
     .max_depth = 6,
     .radius = 0.02f,
     .content = FLOOR(CHECKERS) BACK_WALL(DIFFUSE("0.5,0.3,0.3")) BALL("0.3,0.6,0.5", "0.6", ROUGH_GLASS("0.25"))
         CEILING_LIGHT("0.8", "2.6", GLOW("4,4,5"))},
    {.name = "disk light, rough balls, triplet",
     .sensor = GLASS_VIEW,
     .max_depth = 5,
     .radius = 0.02f,
     .content = FLOOR(CHECKERS) BACK_WALL(DIFFUSE("0.5,0.5,0.6"))
         BALL("-0.5,0.5,-0.2", "0.5", ROUGH_METAL("Cu", "0.3")) BALL("0.6,0.4,0.8", "0.4", DIFFUSE("0.3,0.6,0.4"))
             SHAPE("disk", SCALE("0.6") TURN("x", "100") AT("-0.3,2.6,0.9"), BLACK GLOW("7,7,6"))},
    {.name = "cylinder and disk lights, brushed metal",
     .sensor = PARALLEL_VIEW,
     .max_depth = 6,
     .radius = 0.02f,
     .content = ROOM(DIFFUSE(
         "0.5,0.6,0.5")) "<shape type='cylinder'><point name='p0' value='-1.5,2.2,0.5'/><point name='p1' "
                         "value='0.5,2.4,0.9'/>" NUMBER("radius", "0.15") BLACK GLOW("6,5,4") "</shape>" SHAPE(
                             "disk", SCALE("0.3") TURN("x", "90") AT("1.2,2.6,-0.4"), BLACK GLOW("6,9,12"))
                             SHAPE("cube", SCALE("0.4") TURN("y", "40") AT("0.2,0.4,0.2"),
                                   "<bsdf type='roughconductor'><string name='material' value='Au'/>" NUMBER(
                                       "alpha_u", "0.15")
                                       NUMBER("alpha_v",
                                              "0.45") "</bsdf>") "<shape type='cylinder'><point name='p0' "
                                                                 "value='-1,0,0'/><point name='p1' "
                                                                 "value='-1,1.2,0'/>" NUMBER("radius", "0.3")
                                                                     TWOSIDED(DIFFUSE("0.3,0.4,0.7")) "</shape>"},
    {.name = "principled glass, sky picture and sun",
     .sensor = FRONT_VIEW,
     .max_depth = 6,
     .hide_emitters = true,
     .radius = 0.02f,
     .content = FLOOR(CHECKERS) BALL("0,0.7,0.2", "0.7",
                                     "<bsdf type='principled'>" COLOR("base_color", "0.8,0.7,0.5")
                                         NUMBER("spec_trans", "0.8") NUMBER("roughness", "0.5") "</bsdf>")
         SKY_PICTURE("sky.hdr") "<emitter type='directional'>" COLOR(
             "irradiance", "1.5,1.3,1") "<vector name='direction' value='0.6,-1,-0.5'/></emitter>"},
    {.name = "floor under glass, large light",
     .sensor = FRONT_VIEW,
     .max_depth = 6,
     .radius = 0.02f,
     .needs = NEEDS_SPECULAR_VIEW,
     .content = ROOM(DIFFUSE("0.4")) BALL("0.5,0.3,0.6", "0.25", DIFFUSE("0.7,0.3,0.2"))
         SHAPE("cube", "<scale x='1.2' y='0.05' z='1'/>" AT("0,0.8,0.3"), GLASS)
             CEILING_LIGHT("1.4", "2.95", GLOW("2,2,2"))},
    {.name = "indirect light only",
     .sensor = FRONT_VIEW,
     .max_depth = 6,
     .radius = 0.02f,
     .fast = true,
     .content = ROOM(DIFFUSE("0.7,0.65,0.6")) BALL("-0.5,0.5,0", "0.5", ROUGH_PLASTIC("0.3,0.5,0.4", "0.3"))
         SHAPE("rectangle", TURN("x", "-90") AT("0.6,1.8,0"), TWOSIDED(DIFFUSE("0.5"))) POINT("0.6,2,0", "12,12,12")},
    /* three edges: a caustic seen in a mirror would have four, and only merges find that */
    {.name = "caustics of a point light",
     .sensor = FRONT_VIEW,
     .max_depth = 3,
     .radius = 0.02f,
     .needs = NEEDS_SPECULAR_VIEW | NEEDS_CAUSTICS,
     .content = FLOOR(DIFFUSE("0.6")) SHAPE("rectangle", SCALE("0.6") TURN("y", "30") AT("-0.9,0.6,-0.4"),
                                            TWOSIDED(MIRROR))
         SHAPE("cube", SCALE("0.3") TURN("y", "30") AT("0.9,0.3,0.2"), TWOSIDED(MIRROR)) POINT("0,2,1.5", "6,6,6")},
};

size_t agreement_scene_count(void) { return sizeof scenes / sizeof scenes[0]; }

const agreement_scene *agreement_scene_at(size_t index) { return &scenes[index]; }

ca_scene *agreement_scene_load(const agreement_scene *scene)
{
    char text[16384];
    const int length = snprintf(text, sizeof text,
                                "<scene version='3.0.0'><path value='%s/scenes/textured'/>"
                                "<integrator type='path'><integer name='max_depth' value='%d'/>"
                                "<boolean name='hide_emitters' value='%s'/></integrator>%s%s</scene>",
                                CA_SOURCE_DIR, scene->max_depth, scene->hide_emitters ? "true" : "false",
                                scene->sensor, scene->content);
    assert_true(length > 0 && (size_t)length < sizeof text);
    return scene_from_text(text);
}
