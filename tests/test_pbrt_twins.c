/* A scene of pbrt and the same one as Mitsuba XML, written by hand: their pictures are the same, to the bit where
 * nothing is computed on the way. One row a plugin or parameter. */
#include "support/import_text.h"
#include "support/scene_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define CAMERA "LookAt 0 2 -6  0 0.7 0  0 1 0\nCamera \"perspective\" \"float fov\" 35\n"
#define FILM "Film \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 24\n"
#define SAMPLES "Sampler \"independent\" \"integer pixelsamples\" 8\nIntegrator \"path\" \"integer maxdepth\" 4\n"
#define OPTIONS CAMERA FILM SAMPLES
#define SKY "LightSource \"infinite\" \"rgb L\" [.5 .6 .7]\n"
#define LAMP "LightSource \"point\" \"rgb I\" [20 18 16] \"point from\" [2 4 -3]\n"

#define XML_FILM                                                                                                     \
    "<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='24'/></film>"              \
    "<sampler type='independent'><integer name='sample_count' value='8'/></sampler>"
#define XML_PATH "<integrator type='path'><integer name='max_depth' value='5'/></integrator>"
#define XML_VIEW                                                                                                     \
    "<transform name='to_world'><scale x='-1'/><lookat origin='0,2,-6' target='0,0.7,0' up='0,1,0'/></transform>"    \
    "<float name='near_clip' value='1e-4'/><float name='far_clip' value='1e10'/>"
#define XML_SENSOR                                                                                                   \
    "<sensor type='perspective'><float name='fov' value='35'/><string name='fov_axis' value='y'/>" XML_VIEW XML_FILM \
    "</sensor>"
#define XML_OPTIONS XML_PATH XML_SENSOR
#define XML_SKY "<emitter type='constant'><rgb name='radiance' value='.5 .6 .7'/></emitter>"
#define XML_LAMP                                                                                                     \
    "<emitter type='point'><rgb name='intensity' value='20 18 16'/><point name='position' x='2' y='4' z='-3'/>"      \
    "</emitter>"
#define MATTE "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='.5'/></bsdf></bsdf>"
#define BALL(bsdf) "<shape type='sphere'><point name='center' x='0' y='1' z='0'/>" bsdf "</shape>"
#define FLOOR "Material \"diffuse\"\nAttributeBegin Rotate -90 1 0 0 Shape \"disk\" \"float radius\" 5 AttributeEnd\n"
#define XML_FLOOR                                                                                                    \
    "<shape type='disk'><transform name='to_world'><scale value='5'/><rotate x='1' angle='-90'/></transform>" MATTE  \
    "</shape>"
#define PBRT_BALL "Translate 0 1 0 Shape \"sphere\"\n"

typedef struct twin {
    const char *name, *pbrt, *xml;
    double tolerance; /* of a pixel, relative to the mean; 0: the same bits */
} twin;

#define NEW(name, body, xml)                                                                                         \
    {                                                                                                                \
        name, OPTIONS "WorldBegin\n" SKY LAMP FLOOR body, XML_OPTIONS XML_SKY XML_LAMP XML_FLOOR xml, 0.0            \
    }
#define OLD_NEAR(name, body, xml, tolerance)                                                                         \
    {                                                                                                                \
        name, OPTIONS "PixelFilter \"gaussian\"\nWorldBegin\n" SKY LAMP FLOOR body "WorldEnd\n",                     \
            XML_OPTIONS XML_SKY XML_LAMP XML_FLOOR xml, tolerance                                                    \
    }
#define OLD(name, body, xml) OLD_NEAR(name, body, xml, 0.0)
#define NEAR(name, body, xml, tolerance)                                                                             \
    {                                                                                                                \
        name, OPTIONS "WorldBegin\n" SKY LAMP FLOOR body, XML_OPTIONS XML_SKY XML_LAMP XML_FLOOR xml, tolerance      \
    }

#define SIX_BY_FOUR                                                                                                  \
    "<transform name='to_uv'><scale x='3' y='-2'/><translate y='2'/></transform>"
#define PBRT_SIX_BY_FOUR "\"float uscale\" 6 \"float vscale\" 4 "
#define PBRT_TEXTURED "Material \"diffuse\" \"texture reflectance\" \"t\"\n" PBRT_BALL
#define XML_BOARD(color0, color1)                                                                                    \
    BALL("<bsdf type='twosided'><bsdf type='diffuse'><texture type='checkerboard' name='reflectance'>" SIX_BY_FOUR   \
         "<rgb name='color0' value='" color0 "'/><rgb name='color1' value='" color1 "'/></texture></bsdf></bsdf>")

#define PBRT_MIX "Texture \"t\" \"spectrum\" \"mix\" \"rgb tex1\" [.1 .1 .9] \"rgb tex2\" [.9 .1 .1] "
#define XML_PAINTED(color)                                                                                           \
    BALL("<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='" color "'/></bsdf></bsdf>")

#define XML_MIX_BY(file)                                                                                             \
    BALL("<bsdf type='twosided'><bsdf type='diffuse'><texture type='mix' name='reflectance'>"                        \
         "<rgb name='color0' value='.1 .1 .9'/><rgb name='color1' value='.9 .1 .1'/>"                                \
         "<texture type='bitmap' name='weight'><string name='filename' value='" file                                 \
         "'/></texture></texture></bsdf></bsdf>")

#define XML_PICTURE(to_uv)                                                                                           \
    "<bsdf type='twosided'><bsdf type='diffuse'><texture type='scale' name='reflectance'>"                           \
    "<float name='scale' value='0.4'/><texture type='bitmap'><string name='filename' value='picture.pfm'/>" to_uv    \
    "</texture></texture></bsdf></bsdf>"

#define PBRT_PICTURE                                                                                                 \
    "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"picture.pfm\" \"float scale\" 0.4\n"
#define XML_MAPPED_QUAD                                                                                              \
    "<shape type='ply'><string name='filename' value='mapped_quad.ply'/><boolean name='face_normals' value='true'/>"

#define PBRT_TWO_PAINTS                                                                                              \
    "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" \"rgb reflectance\" [.9 0 0]\n"                             \
    "MakeNamedMaterial \"b\" \"string type\" \"diffuse\" \"rgb reflectance\" [0 .9 0]\n"                             \
    "Material \"mix\" \"string materials\" [\"a\" \"b\"] "

static const twin shapes[] = {
    NEW("sphere", "Translate 0 1 0 Shape \"sphere\" \"float radius\" 0.75\n",
        "<shape type='sphere'><float name='radius' value='0.75'/><point name='center' x='0' y='1' z='0'/>" MATTE
        "</shape>"),
    NEW("cylinder", "Translate 0 1 0 Shape \"cylinder\" \"float zmin\" -2 \"float zmax\" 1 \"float radius\" 0.5\n",
        "<shape type='cylinder'><point name='p0' x='0' y='1' z='-2'/><point name='p1' x='0' y='1' z='1'/>"
        "<float name='radius' value='0.5'/>" MATTE "</shape>"),
    NEW("disk", "Translate 0 1 0 Rotate 150 0 1 0 Shape \"disk\" \"float radius\" 0.7 \"float height\" 0.3\n",
        "<shape type='disk'><transform name='to_world'><translate z='0.3'/><scale x='0.7' y='0.7'/>"
        "<rotate y='1' angle='150'/><translate y='1'/></transform>" MATTE "</shape>"),
    NEW("plymesh", "Translate 0 1 0 Shape \"plymesh\" \"string filename\" \"tent.ply\"\n",
        "<shape type='ply'><string name='filename' value='tent.ply'/><boolean name='face_normals' value='true'/>"
        "<transform name='to_world'><translate y='1'/></transform>" MATTE "</shape>"),
    NEW("plymesh.gz", "Translate 0 1 0 Shape \"plymesh\" \"string filename\" \"tent.ply.gz\"\n",
        "<shape type='ply'><string name='filename' value='tent.ply'/><boolean name='face_normals' value='true'/>"
        "<transform name='to_world'><translate y='1'/></transform>" MATTE "</shape>"),
    NEW("trianglemesh",
        "Shape \"trianglemesh\" \"point3 P\" [-1 1 0  1 1 0  0 2 0.5  0 2.5 -1] \"integer indices\" [0 1 2  1 3 2]\n",
        "<shape type='ply'><string name='filename' value='pair.ply'/><boolean name='face_normals' value='true'/>"
        "<transform name='to_world'><translate y='1'/></transform>" MATTE "</shape>"),
    NEW("bilinearmesh", "Shape \"bilinearmesh\" \"point3 P\" [-1 0.5 0  1 0.5 0  -1 2 0  1 2 0]\n",
        "<shape type='ply'><string name='filename' value='quad.ply'/><boolean name='face_normals' "
        "value='true'/>" MATTE "</shape>"),
    NEW("curve",
        "Translate 0 1 0 Shape \"curve\" \"point3 P\" [-3 0 0  -1 0 0  1 0 0  3 0 0]\n"
        "\"float width0\" 0.5 \"float width1\" 0 \"string type\" \"cylinder\"\n",
        "<shape type='bsplinecurve'><string name='filename' value='spike.txt'/>" MATTE "</shape>"),
    NEW("instances",
        "ObjectBegin \"o\" Translate 0 0.5 0 Shape \"sphere\" \"float radius\" 0.5 ObjectEnd\n"
        "AttributeBegin Translate -1 0 0 ObjectInstance \"o\" AttributeEnd\n"
        "AttributeBegin Translate 1 0 0 Scale 1 2 1 ObjectInstance \"o\" AttributeEnd\n",
        "<shape type='shapegroup' id='o'><shape type='sphere'><point name='center' x='0' y='0.5' z='0'/>"
        "<float name='radius' value='0.5'/>" MATTE "</shape></shape>"
        "<shape type='instance'><ref id='o'/><transform name='to_world'><translate x='-1'/></transform></shape>"
        "<shape type='instance'><ref id='o'/><transform name='to_world'><scale y='2'/><translate x='1'/>"
        "</transform></shape>"),
    NEW("alpha", "Translate 0 1 0 Shape \"sphere\" \"float alpha\" 0.4\n",
        BALL("<bsdf type='mask'><float name='opacity' value='0.4'/>" MATTE "</bsdf>")),
    NEW("coordinate systems",
        "AttributeBegin Translate 0 1 0 CoordinateSystem \"up\" AttributeEnd\n"
        "Translate 7 7 7 CoordSysTransform \"up\" Shape \"sphere\"\n",
        BALL(MATTE)),
    NEW("transforms",
        "Transform [1 0 0 0  0 1 0 0  0 0 1 0  0 0.5 0 1] ConcatTransform [1 0 0 0  0 1 0 0  0 0 1 0  0 0.5 0 1]\n"
        "TransformBegin Scale 9 9 9 TransformEnd Shape \"sphere\"\n",
        BALL(MATTE)),
    NEW("an include", "Include \"ball.pbrt\"\n", BALL(MATTE)),
    NEW("an import", "Import \"ball.pbrt\" Translate 0 3 0 Shape \"sphere\" \"float radius\" 0.2\n",
        BALL(MATTE) "<shape type='sphere'><point name='center' x='0' y='3' z='0'/><float name='radius' "
                    "value='0.2'/>" MATTE "</shape>"),
    NEW("presets", "Attribute \"shape\" \"float radius\" 0.75 Translate 0 1 0 Shape \"sphere\"\n",
        "<shape type='sphere'><float name='radius' value='0.75'/><point name='center' x='0' y='1' z='0'/>" MATTE
        "</shape>"),
};

static const twin new_materials[] = {
    NEW("diffuse", "Material \"diffuse\" \"rgb reflectance\" [.8 .2 .1]\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='.8 .2 .1'/></bsdf></bsdf>")),
    NEW("spectrum", "Material \"diffuse\" \"spectrum reflectance\" [400 .1 500 .8 700 .2]\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='diffuse'>"
             "<spectrum name='reflectance' value='400:.1 500:.8 700:.2'/></bsdf></bsdf>")),
    NEW("spectrum in a file", "Material \"diffuse\" \"spectrum reflectance\" \"paint.spd\"\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='diffuse'>"
             "<spectrum name='reflectance' value='400:.1 500:.8 700:.2'/></bsdf></bsdf>")),
    NEW("smooth conductor",
        "Material \"conductor\" \"spectrum eta\" \"metal-Ag-eta\" \"spectrum k\" \"metal-Ag-k\"\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='conductor'><string name='material' value='Ag'/></bsdf></bsdf>")),
    NEW("conductor", "Material \"conductor\" \"float roughness\" 0.09\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='roughconductor'><string name='material' value='Cu'/>"
             "<string name='distribution' value='ggx'/><float name='alpha' value='0.3'/></bsdf></bsdf>")),
    NEW("conductor, a texture of roughness", /* a board of 0.09 and 0.25 is one of 0.3 and 0.5 */
        "Texture \"w\" \"float\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"float tex1\" .09 \"float tex2\" .25\n"
        "Material \"conductor\" \"texture roughness\" \"w\"\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='roughconductor'><string name='material' value='Cu'/>"
             "<string name='distribution' value='ggx'/><texture type='checkerboard' name='alpha'>" SIX_BY_FOUR
             "<float name='color0' value='.5'/><float name='color1' value='.3'/></texture></bsdf></bsdf>")),
    NEAR("coateddiffuse, a texture of roughness", /* whose table is that of the root of the mean */
         "Texture \"w\" \"float\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"float tex1\" .09 \"float tex2\" .16\n"
         "Material \"coateddiffuse\" \"rgb reflectance\" [.4 .2 .1] \"texture roughness\" \"w\"\n" PBRT_BALL,
         BALL("<bsdf type='twosided'><bsdf type='roughplastic'><rgb name='diffuse_reflectance' value='.4 .2 .1'/>"
              "<float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>"
              "<boolean name='nonlinear' value='true'/><string name='distribution' value='ggx'/>"
              "<texture type='checkerboard' name='alpha'>" SIX_BY_FOUR
              "<float name='color0' value='.4'/><float name='color1' value='.3'/></texture></bsdf></bsdf>"),
         2e-3),
    NEW("conductor, two roughnesses",
        "Material \"conductor\" \"float uroughness\" 0.1 \"float vroughness\" 0.3 \"bool remaproughness\" "
        "false\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='roughconductor'><string name='material' value='Cu'/>"
             "<string name='distribution' value='ggx'/><float name='alpha_u' value='0.1'/>"
             "<float name='alpha_v' value='0.3'/></bsdf></bsdf>")),
    NEW("dielectric", "Material \"dielectric\" \"float eta\" 1.4\n" PBRT_BALL,
        BALL("<bsdf type='dielectric'><float name='int_ior' value='1.4'/><float name='ext_ior' value='1'/></bsdf>")),
    NEW("glass by name", "Material \"dielectric\" \"spectrum eta\" \"glass-LASF9\"\n" PBRT_BALL,
        BALL("<bsdf type='dielectric'><float name='int_ior' value='1.85025'/><float name='ext_ior' value='1'/>"
             "</bsdf>")),
    NEW("rough dielectric", "Material \"dielectric\" \"float roughness\" 0.04\n" PBRT_BALL,
        BALL("<bsdf type='roughdielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>"
             "<string name='distribution' value='ggx'/><float name='alpha' value='0.2'/></bsdf>")),
    NEW("thindielectric", "Material \"thindielectric\" \"float eta\" 1.3\n" PBRT_BALL,
        BALL("<bsdf type='thindielectric'><float name='int_ior' value='1.3'/><float name='ext_ior' value='1'/>"
             "</bsdf>")),
    NEW("coateddiffuse", "Material \"coateddiffuse\" \"rgb reflectance\" [.8 .2 .1]\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='plastic'><rgb name='diffuse_reflectance' value='.8 .2 .1'/>"
             "<float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>"
             "<boolean name='nonlinear' value='true'/></bsdf></bsdf>")),
    NEW("rough coateddiffuse", "Material \"coateddiffuse\" \"float roughness\" 0.25 \"float eta\" 1.6\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='roughplastic'><float name='int_ior' value='1.6'/>"
             "<float name='ext_ior' value='1'/><boolean name='nonlinear' value='true'/>"
             "<string name='distribution' value='ggx'/><float name='alpha' value='0.5'/></bsdf></bsdf>")),
    NEAR("coateddiffuse, smooth along u", /* 0 counts as 0.0001: the root of 0.0001 sqrt(0.3) */
         "Material \"coateddiffuse\" \"float uroughness\" 0 \"float vroughness\" 0.3\n" PBRT_BALL,
         BALL("<bsdf type='twosided'><bsdf type='roughplastic'><float name='int_ior' value='1.5'/>"
              "<float name='ext_ior' value='1'/><boolean name='nonlinear' value='true'/>"
              "<string name='distribution' value='ggx'/><float name='alpha' value='0.007400828'/></bsdf></bsdf>"),
         1e-4),
    NEW("dielectric that is no boundary", /* to a float's digits */
        "Material \"dielectric\" \"float eta\" 1.00000001 \"float roughness\" 0.1\n" PBRT_BALL,
        BALL("<bsdf type='null'/>")),
    NEW("diffusetransmission",
        "Material \"diffusetransmission\" \"rgb reflectance\" [.4 .3 .2] \"rgb transmittance\" [.1 .2 "
        ".6]\n" PBRT_BALL,
        BALL("<bsdf type='blendbsdf'><float name='weight' value='0.6'/>"
             "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='1 .75 .5'/></bsdf></bsdf>"
             "<bsdf type='difftrans'><rgb name='transmittance' value='0.166666666666666667 0.333333333333333333 1'/>"
             "</bsdf></bsdf>")),
    NEW("mix",
        PBRT_TWO_PAINTS "\"float amount\" 0.2\n" PBRT_BALL,
        BALL("<bsdf type='blendbsdf'><float name='weight' value='0.2'/>"
             "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='.9 0 0'/></bsdf></bsdf>"
             "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='0 .9 0'/></bsdf></bsdf>"
             "</bsdf>")),
    NEW("mix by more than 1", PBRT_TWO_PAINTS "\"float amount\" 3\n" PBRT_BALL, XML_PAINTED("0 .9 0")),
    NEW("mix by less than 0", PBRT_TWO_PAINTS "\"float amount\" -1\n" PBRT_BALL, XML_PAINTED(".9 0 0")),
    NEW("interface", "Material \"interface\"\n" PBRT_BALL, BALL("<bsdf type='null'/>")),
    NEW("checkerboard",
        "Texture \"t\" \"spectrum\" \"checkerboard\" \"float uscale\" 6 \"float vscale\" 4 \"rgb tex1\" [.9 .1 .1] "
        "\"rgb tex2\" [.1 .1 .9]\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='diffuse'><texture type='checkerboard' name='reflectance'>"
             "<rgb name='color0' value='.9 .1 .1'/><rgb name='color1' value='.1 .1 .9'/><transform name='to_uv'>"
             "<scale x='3' y='-2'/><translate y='2'/></transform></texture></bsdf></bsdf>")),
    NEW("mix of textures", /* by a board of ones and zeros */
        "Texture \"w\" \"float\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"float tex1\" 1 \"float tex2\" 0\n"
        "Texture \"t\" \"spectrum\" \"mix\" \"rgb tex1\" [.1 .1 .9] \"rgb tex2\" [.9 .1 .1] "
        "\"texture amount\" \"w\"\n" PBRT_TEXTURED, XML_BOARD(".9 .1 .1", ".1 .1 .9")),
    NEAR("mix by a picture over 1",
         "Texture \"w\" \"float\" \"imagemap\" \"string filename\" \"two.pfm\"\n" PBRT_MIX
         "\"texture amount\" \"w\"\n" PBRT_TEXTURED,
         XML_PAINTED(".9 .1 .1"), 1e-6),
    NEAR("mix by a product over 1", /* of boards of 1 and 1/2, 2 and 3 */
         "Texture \"a\" \"float\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"float tex1\" 1 \"float tex2\" .5\n"
         "Texture \"b\" \"float\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"float tex1\" 2 \"float tex2\" 3\n"
         "Texture \"w\" \"float\" \"scale\" \"texture tex\" \"a\" \"texture scale\" \"b\"\n" PBRT_MIX
         "\"texture amount\" \"w\"\n" PBRT_TEXTURED,
         XML_PAINTED(".9 .1 .1"), 1e-6),
    NEAR("mix by a board over 1", /* of 2 and 3 */
         "Texture \"w\" \"float\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"float tex1\" 2 \"float tex2\" 3\n" PBRT_MIX
         "\"texture amount\" \"w\"\n" PBRT_TEXTURED,
         XML_PAINTED(".9 .1 .1"), 1e-6),
    NEW("mix of colours by more than 1", PBRT_MIX "\"float amount\" 2\n" PBRT_TEXTURED, XML_PAINTED(".9 .1 .1")),
    NEW("mix of colours by less than 0", PBRT_MIX "\"float amount\" -1\n" PBRT_TEXTURED, XML_PAINTED(".1 .1 .9")),
    NEW("mix with a texture by more than 1",
        "Texture \"c\" \"spectrum\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"rgb tex1\" [.9 .1 .1] "
        "\"rgb tex2\" [.1 .1 .9]\n"
        "Texture \"t\" \"spectrum\" \"mix\" \"texture tex2\" \"c\" \"float amount\" 3\n" PBRT_TEXTURED,
        XML_BOARD(".9 .1 .1", ".1 .1 .9")),
    NEW("scale of textures", /* by a board of halves and ones */
        "Texture \"w\" \"float\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"float tex1\" .5 \"float tex2\" 1\n"
        "Texture \"c\" \"spectrum\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"rgb tex1\" [.9 .1 .1] "
        "\"rgb tex2\" [.1 .1 .9]\n"
        "Texture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"c\" \"texture scale\" \"w\"\n" PBRT_TEXTURED,
        XML_BOARD(".45 .05 .05", ".1 .1 .9")),
    NEW("product of colours",
        "Texture \"a\" \"spectrum\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"rgb tex1\" [.5 1 .25] "
        "\"rgb tex2\" [1 .5 1]\n"
        "Texture \"c\" \"spectrum\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"rgb tex1\" [.9 .1 .4] "
        "\"rgb tex2\" [.1 .2 .9]\n"
        "Texture \"t\" \"spectrum\" \"scale\" \"texture tex1\" \"c\" \"texture tex2\" \"a\"\n" PBRT_TEXTURED,
        XML_BOARD(".45 .1 .1", ".1 .1 .9")),
    NEW("imagemap",
        "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"picture.pfm\" \"float scale\" 0.4\n"
        "Material \"diffuse\" \"texture reflectance\" \"t\"\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='diffuse'><texture type='scale' name='reflectance'>"
             "<float name='scale' value='0.4'/><texture type='bitmap'><string name='filename' value='picture.pfm'/>"
             "</texture></texture></bsdf></bsdf>")),
    NEAR("planar mapping", /* of a texture that is three to the right of the shape */
         "AttributeBegin Translate 3 0 0 " PBRT_PICTURE
         "\"string mapping\" \"planar\" \"vector3 v1\" [.5 0 0] \"vector3 v2\" [0 .5 0]\n"
         "\"float udelta\" 2 \"float vdelta\" -.25 AttributeEnd Material \"diffuse\" \"texture reflectance\" \"t\"\n"
         "Shape \"plymesh\" \"string filename\" \"quad.ply\"\n",
         XML_MAPPED_QUAD XML_PICTURE("") "</shape>", 1e-5),
    NEAR("planar mapping across",
         "Translate 0 0.5 1 Rotate 90 0 1 0 " PBRT_PICTURE
         "\"string mapping\" \"planar\" \"vector3 v1\" [0 0 .5] \"vector3 v2\" [0 .5 0] \"float udelta\" .5\n"
         "Rotate -90 0 1 0 Translate 0 -0.5 -1 Material \"diffuse\" \"texture reflectance\" \"t\"\n"
         "Shape \"plymesh\" \"string filename\" \"quad.ply\"\n",
         XML_MAPPED_QUAD XML_PICTURE("") "</shape>", 1e-5),
    NEAR("cylindrical mapping", /* half a turn from u; 1 - v is z */
         "Translate 0 1 0 " PBRT_PICTURE
         "\"string mapping\" \"cylindrical\" Material \"diffuse\" \"texture reflectance\" \"t\"\n"
         "Shape \"cylinder\" \"float zmin\" 0 \"float zmax\" 1\n",
         "<shape type='cylinder'><transform name='to_world'><translate y='1'/></transform>" XML_PICTURE(
             "<transform name='to_uv'><scale y='-1'/><translate x='0.5' y='1'/></transform>") "</shape>",
         1e-4),
    NEAR("spherical mapping", /* (theta, phi), where (u, v) is (phi, theta) */
         "Translate 0 1 0 " PBRT_PICTURE
         "\"string mapping\" \"spherical\" Material \"diffuse\" \"texture reflectance\" \"t\"\n"
         "Shape \"sphere\"\n",
         "<shape type='sphere'><point name='center' x='0' y='1' z='0'/>" XML_PICTURE(
             "<transform name='to_uv'><rotate z='1' angle='-90'/><translate y='1'/></transform>") "</shape>",
         1e-4),
    NEAR("planar board",
         "Texture \"t\" \"spectrum\" \"checkerboard\" \"string mapping\" \"planar\" \"vector3 v1\" [3 0 0]\n"
         "\"vector3 v2\" [0 2 0] \"rgb tex1\" [.9 .1 .1] \"rgb tex2\" [.1 .1 .9]\n"
         "Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"plymesh\" \"string filename\" \"quad.ply\"\n",
         XML_MAPPED_QUAD
         "<bsdf type='twosided'><bsdf type='diffuse'><texture type='checkerboard' name='reflectance'>"
         "<transform name='to_uv'>"
         "<scale x='3' y='-2'/><translate x='-1.5' y='2.5'/></transform><rgb name='color0' value='.9 .1 .1'/>"
         "<rgb name='color1' value='.1 .1 .9'/></texture></bsdf></bsdf></shape>",
         1e-5),
    NEAR("imagemap, black around it", /* the picture in the middle of one that is twice as wide and high */
         PBRT_PICTURE "\"string wrap\" \"black\" \"float uscale\" 2 \"float vscale\" 2 \"float udelta\" -.5\n"
                      "\"float vdelta\" -.5\n" PBRT_TEXTURED,
         BALL("<bsdf type='twosided'><bsdf type='diffuse'><texture type='scale' name='reflectance'>"
              "<float name='scale' value='0.4'/><texture type='bitmap'><string name='filename' value='framed.pfm'/>"
              "<string name='wrap_mode' value='clamp'/></texture></texture></bsdf></bsdf>"),
         1e-6),
    NEW("directionmix", /* the first texture where the surface faces the direction */
        "Texture \"t\" \"spectrum\" \"directionmix\" \"rgb tex1\" [.9 .1 .1] \"rgb tex2\" [.1 .1 .9]\n"
        "\"vector3 dir\" [0 0 2]\n" PBRT_TEXTURED,
        BALL("<bsdf type='twosided'><bsdf type='diffuse'><texture type='mix' name='reflectance'>"
             "<rgb name='color0' value='.1 .1 .9'/><rgb name='color1' value='.9 .1 .1'/>"
             "<texture type='facing' name='weight'><vector name='direction' value='0 0 1'/></texture></texture>"
             "</bsdf></bsdf>")),
    NEAR("directionmix of a flat shape", /* turned by 60 degrees from the direction: half of each */
         "Texture \"t\" \"spectrum\" \"directionmix\" \"rgb tex1\" [.9 .1 .1] \"rgb tex2\" [.1 .1 .9]\n"
         "\"vector3 dir\" [0 .86602540378 .5]\n"
         "Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"plymesh\" \"string filename\" \"quad.ply\"\n",
         "<shape type='ply'><string name='filename' value='quad.ply'/><boolean name='face_normals' value='true'/>"
         "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='.5 .1 .5'/></bsdf></bsdf>"
         "</shape>",
         1e-5),
    NEAR("imagemap, brighter than white", /* reflectances are cut to 1 */
         "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"picture.pfm\" \"float scale\" 3\n"
         "\"string filter\" \"point\" Material \"diffuse\" \"texture reflectance\" \"t\"\n" PBRT_BALL,
         BALL("<bsdf type='twosided'><bsdf type='diffuse'><texture type='bitmap' name='reflectance'>"
              "<string name='filename' value='cut.pfm'/><string name='filter_type' value='nearest'/></texture></bsdf>"
              "</bsdf>"),
         1e-5),
    NEAR("imagemap, inverted", /* 1 - 0.4 v of each channel */
         "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"picture.pfm\" \"float scale\" 0.4\n"
         "\"bool invert\" true Material \"diffuse\" \"texture reflectance\" \"t\"\n" PBRT_BALL,
         BALL("<bsdf type='twosided'><bsdf type='diffuse'><texture type='bitmap' name='reflectance'>"
              "<string name='filename' value='inverse.pfm'/></texture></bsdf></bsdf>"),
         1e-5),
    NEAR("imagemap, inverted number", /* 1 - 0.4 v, v the mean: the mix by 0.4 v of what is exchanged */
         "Texture \"w\" \"float\" \"imagemap\" \"string filename\" \"picture.pfm\" \"float scale\" 0.4\n"
         "\"bool invert\" true Texture \"t\" \"spectrum\" \"mix\" \"rgb tex1\" [.1 .1 .9]\n"
         "\"rgb tex2\" [.9 .1 .1] \"texture amount\" \"w\"\n" PBRT_TEXTURED,
         BALL("<bsdf type='twosided'><bsdf type='diffuse'><texture type='mix' name='reflectance'>"
              "<rgb name='color0' value='.9 .1 .1'/><rgb name='color1' value='.1 .1 .9'/>"
              "<texture type='scale' name='weight'><float name='scale' value='0.4'/><texture type='bitmap'>"
              "<string name='filename' value='grey.pfm'/></texture></texture></texture></bsdf></bsdf>"),
         1e-5),
    NEAR("number from alpha",
         "Texture \"w\" \"float\" \"imagemap\" \"string filename\" \"leaf.exr\"\n"
         "Texture \"t\" \"spectrum\" \"mix\" \"rgb tex1\" [.1 .1 .9]\n"
         "\"rgb tex2\" [.9 .1 .1] \"texture amount\" \"w\"\n" PBRT_TEXTURED,
         XML_MIX_BY("alpha.pfm"), 1e-6),
    NEAR("number from colours", /* their mean, where alpha is 1 everywhere */
         "Texture \"w\" \"float\" \"imagemap\" \"string filename\" \"opaque.exr\"\n"
         "Texture \"t\" \"spectrum\" \"mix\" \"rgb tex1\" [.1 .1 .9]\n"
         "\"rgb tex2\" [.9 .1 .1] \"texture amount\" \"w\"\n" PBRT_TEXTURED,
         XML_MIX_BY("mean.pfm"), 1e-6),
    NEW("displacement",
        "Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"picture.pfm\" \"float scale\" 0.1\n"
        "Material \"diffuse\" \"texture displacement\" \"t\"\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='bumpmap'><texture type='scale' name='height'>"
             "<float name='scale' value='0.1'/><texture type='bitmap'><string name='filename' value='grey.pfm'/>"
             "</texture></texture><bsdf type='diffuse'/></bsdf></bsdf>")),
    NEAR("negative displacement",
         "Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"picture.pfm\" \"float scale\" -0.1\n"
         "Material \"diffuse\" \"texture displacement\" \"t\"\n" PBRT_BALL,
         BALL("<bsdf type='twosided'><bsdf type='bumpmap'><float name='scale' value='-0.1'/>"
              "<texture type='bitmap'><string name='filename' value='grey.pfm'/></texture><bsdf type='diffuse'/>"
              "</bsdf></bsdf>"),
         1e-5),
    NEW("normalmap", "Material \"diffuse\" \"string normalmap\" \"picture.pfm\"\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='normalmap'><texture type='bitmap' name='normals'>"
             "<string name='filename' value='picture.pfm'/><boolean name='raw' value='true'/></texture>"
             "<bsdf type='diffuse'/></bsdf></bsdf>")),
};

#define PAINT "<rgb name='reflectance' value='.4 .2 .1'/>"

static const twin old_materials[] = {
    OLD("matte", "Material \"matte\" \"rgb Kd\" [.8 .2 .1]\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='.8 .2 .1'/></bsdf></bsdf>")),
    OLD_NEAR("matte, brighter than white", /* reflectances are cut to 1 */
             "Texture \"t\" \"color\" \"imagemap\" \"string filename\" \"picture.pfm\" \"float scale\" 3\n"
             "\"string filter\" \"point\" Material \"matte\" \"texture Kd\" \"t\"\n" PBRT_BALL,
             BALL("<bsdf type='twosided'><bsdf type='diffuse'><texture type='bitmap' name='reflectance'>"
                  "<string name='filename' value='cut.pfm'/><string name='filter_type' value='nearest'/></texture>"
                  "</bsdf></bsdf>"),
             1e-5),
    OLD_NEAR("a colour times more than 1", /* picture.pfm has values up to 2 */
             "Texture \"i\" \"color\" \"imagemap\" \"string filename\" \"picture.pfm\" \"float scale\" .1\n"
             "Texture \"s\" \"color\" \"scale\" \"rgb tex1\" [2 3 .5] \"texture tex2\" \"i\"\n"
             "Material \"matte\" \"texture Kd\" \"s\"\n" PBRT_BALL,
             BALL("<bsdf type='twosided'><bsdf type='diffuse'><texture type='scale' name='reflectance'>"
                  "<rgb name='scale' value='.2 .3 .05'/><texture type='bitmap'>"
                  "<string name='filename' value='picture.pfm'/></texture></texture></bsdf></bsdf>"),
             1e-5),
    OLD("matte, rough", "Material \"matte\" \"rgb Kd\" [.4 .2 .1] \"float sigma\" 20\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='roughdiffuse'>" PAINT
             "<float name='alpha' value='0.493653659795374'/><boolean name='use_fast_approx' value='true'/></bsdf>"
             "</bsdf>")),
    OLD_NEAR("matte, rough here and there",
             "Texture \"s\" \"float\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"float tex1\" 20 \"float tex2\" 0\n"
             "Material \"matte\" \"rgb Kd\" [.4 .2 .1] \"texture sigma\" \"s\"\n" PBRT_BALL,
             BALL("<bsdf type='twosided'><bsdf type='roughdiffuse'>" PAINT
                  "<texture type='checkerboard' name='alpha'>" SIX_BY_FOUR
                  "<float name='color0' value='0'/><float name='color1' value='0.493653659795374'/></texture>"
                  "<boolean name='use_fast_approx' value='true'/></bsdf></bsdf>"),
             1e-5),
    OLD("glass", "Material \"glass\" \"rgb Kt\" [.9 .5 .9] \"float index\" 1.7\n" PBRT_BALL,
        BALL("<bsdf type='dielectric'><float name='int_ior' value='1.7'/><float name='ext_ior' value='1'/>"
             "<rgb name='specular_transmittance' value='.9 .5 .9'/></bsdf>")),
    OLD("glass that is no boundary",
        "Material \"glass\" \"rgb Kt\" [.9 .5 .9] \"float index\" 1 \"float uroughness\" 0.1\n" PBRT_BALL,
        BALL("<bsdf type='dielectric'><float name='int_ior' value='1'/><float name='ext_ior' value='1'/>"
             "<rgb name='specular_transmittance' value='.9 .5 .9'/></bsdf>")),
    OLD("mirror", "Material \"mirror\" \"rgb Kr\" [.9 .5 .9]\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='conductor'><rgb name='specular_reflectance' value='.9 .5 .9'/></bsdf>"
             "</bsdf>")),
    OLD("metal", "Material \"metal\" \"float roughness\" 0.3 \"bool remaproughness\" \"false\"\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='roughconductor'><string name='material' value='Cu'/>"
             "<string name='distribution' value='ggx'/><float name='alpha' value='0.3'/></bsdf></bsdf>")),
    OLD_NEAR("metal, a texture remapped", /* 1.595 r^0.536 */
             "Texture \"w\" \"float\" \"checkerboard\" " PBRT_SIX_BY_FOUR "\"float tex1\" .04 \"float tex2\" .16\n"
             "Material \"metal\" \"texture roughness\" \"w\"\n" PBRT_BALL,
             BALL("<bsdf type='twosided'><bsdf type='roughconductor'><string name='material' value='Cu'/>"
                  "<string name='distribution' value='ggx'/><texture type='checkerboard' name='alpha'>" SIX_BY_FOUR
                  "<float name='color0' value='0.5972677'/><float name='color1' value='0.2840958'/></texture></bsdf>"
                  "</bsdf>"),
             1e-4),
    OLD("metal, remapped", "Material \"metal\" \"float roughness\" 0.1\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='roughconductor'><string name='material' value='Cu'/>"
             "<string name='distribution' value='ggx'/><float name='alpha' value='0.46176003200863397'/></bsdf>"
             "</bsdf>")),
    OLD("plastic",
        "Material \"plastic\" \"rgb Kd\" [.4 .2 .1] \"float Ks\" 0.4 \"float roughness\" 0.1 "
        "\"bool remaproughness\" \"false\"\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='blendbsdf'><float name='weight' value='0.5'/>"
             "<bsdf type='diffuse'><rgb name='reflectance' value='.8 .4 .2'/></bsdf>"
             "<bsdf type='roughdielectric'><string name='distribution' value='ggx'/><float name='alpha' value='0.1'/>"
             "<float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>"
             "<float name='specular_reflectance' value='0.8'/><float name='specular_transmittance' value='0'/></bsdf>"
             "</bsdf></bsdf>")),
    OLD("uber",
        "Material \"uber\" \"rgb Kd\" [.4 .2 .1] \"float Ks\" 0 \"float Kr\" 0.4 \"float opacity\" 0.7\n" PBRT_BALL,
        BALL("<bsdf type='mask'><float name='opacity' value='0.7'/>"
             "<bsdf type='twosided'><bsdf type='blendbsdf'><float name='weight' value='0.5'/>"
             "<bsdf type='diffuse'><rgb name='reflectance' value='.8 .4 .2'/></bsdf>"
             "<bsdf type='dielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>"
             "<float name='specular_reflectance' value='0.8'/><float name='specular_transmittance' value='0'/></bsdf>"
             "</bsdf></bsdf></bsdf>")),
    OLD("uber that is no boundary", /* neither gloss nor mirror */
        "Material \"uber\" \"rgb Kd\" [.4 .2 .1] \"float Ks\" 0.4 \"float Kr\" 0.4 \"float index\" 1\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='diffuse'>" PAINT "</bsdf></bsdf>")),
    OLD("uber that is no boundary and lets light through",
        "Material \"uber\" \"rgb Kd\" [0 0 0] \"float Ks\" 0.4 \"float Kt\" 0.4 \"float index\" 1\n" PBRT_BALL,
        BALL("<bsdf type='dielectric'><float name='int_ior' value='1'/><float name='ext_ior' value='1'/>"
             "<float name='specular_transmittance' value='0.4'/></bsdf>")),
    OLD("translucent", "Material \"translucent\" \"rgb Kd\" [.4 .2 .1] \"float Ks\" 0\n" PBRT_BALL,
        BALL("<bsdf type='blendbsdf'><float name='weight' value='0.5'/>"
             "<bsdf type='twosided'><bsdf type='diffuse'>" PAINT "</bsdf></bsdf>"
             "<bsdf type='difftrans'><rgb name='transmittance' value='.4 .2 .1'/></bsdf></bsdf>")),
    OLD("substrate",
        "Material \"substrate\" \"rgb Kd\" [.4 .2 .1] \"float Ks\" 0.04 \"float uroughness\" 0.1 "
        "\"float vroughness\" 0.1 \"bool remaproughness\" \"false\"\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='roughplastic'><rgb name='diffuse_reflectance' value='.4 .2 .1'/>"
             "<float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>"
             "<string name='distribution' value='ggx'/><float name='alpha' value='0.1'/></bsdf></bsdf>")),
    OLD("substrate, smooth",
        "Material \"substrate\" \"rgb Kd\" [.4 .2 .1] \"float Ks\" 0.04 \"float uroughness\" 0 "
        "\"float vroughness\" 0 \"bool remaproughness\" \"false\"\n" PBRT_BALL,
        BALL("<bsdf type='twosided'><bsdf type='roughplastic'><rgb name='diffuse_reflectance' value='.4 .2 .1'/>"
             "<float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>"
             "<string name='distribution' value='ggx'/><float name='alpha' value='0'/></bsdf></bsdf>")),
    OLD("disney that is no boundary", /* of facets */
        "Material \"disney\" \"rgb color\" [.8 .4 .2] \"float eta\" 1 \"float spectrans\" 1 \"float roughness\" "
        "0.3\n" PBRT_BALL,
        BALL("<bsdf type='principled'><rgb name='base_color' value='.8 .4 .2'/><float name='eta' value='1.001'/>"
             "<float name='roughness' value='0.3'/><float name='spec_trans' value='1'/>"
             "<float name='clearcoat_gloss' value='1'/><float name='sheen_tint' value='0.5'/></bsdf>")),
    OLD("disney",
        "Material \"disney\" \"rgb color\" [.8 .4 .2] \"float metallic\" 0.5 \"float roughness\" 0.3 "
        "\"float clearcoat\" 1\n" PBRT_BALL,
        BALL(
            "<bsdf type='twosided'><bsdf type='principled'><rgb name='base_color' value='.8 .4 .2'/>"
            "<float name='eta' value='1.5'/><float name='metallic' value='0.5'/><float name='roughness' value='0.3'/>"
            "<float name='clearcoat' value='1'/><float name='clearcoat_gloss' value='1'/>"
            "<float name='sheen_tint' value='0.5'/></bsdf></bsdf>")),
    OLD("mix of version 3",
        "MakeNamedMaterial \"a\" \"string type\" \"matte\" \"rgb Kd\" [.9 0 0]\n"
        "MakeNamedMaterial \"b\" \"string type\" \"matte\" \"rgb Kd\" [0 .9 0]\n"
        "Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" \"float amount\" "
        "0.2\n" PBRT_BALL,
        BALL("<bsdf type='blendbsdf'><float name='weight' value='0.2'/>"
             "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='0 .9 0'/></bsdf></bsdf>"
             "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='.9 0 0'/></bsdf></bsdf>"
             "</bsdf>")),
};

#define ROOM FLOOR PBRT_BALL
#define XML_ROOM XML_FLOOR BALL(MATTE)
#define PLACE(options, light) options "WorldBegin\n" light ROOM
#define XML_PLACE(options, light) options light XML_ROOM

static const twin lights_and_cameras[] = {
    {"point", PLACE(OPTIONS, LAMP), XML_PLACE(XML_OPTIONS, XML_LAMP), 0.0},
    {"distant",
     PLACE(OPTIONS, "LightSource \"distant\" \"rgb L\" [2 1 1] \"point from\" [1 3 -1] \"float scale\" 2\n"),
     XML_PLACE(XML_OPTIONS, "<emitter type='directional'><rgb name='irradiance' value='4 2 2'/>"
                            "<vector name='direction' x='-1' y='-3' z='2'/></emitter>"),
     1e-5},
    {"spot",
     PLACE(OPTIONS, "LightSource \"spot\" \"rgb I\" [30 30 30] \"point from\" [0 4 -2] \"point to\" [0 0 0] "
                    "\"float coneangle\" 25 \"float conedeltaangle\" 10\n"),
     XML_PLACE(
         XML_OPTIONS,
         "<emitter type='spot'><rgb name='intensity' value='30'/><float name='cutoff_angle' value='25'/>"
         "<float name='beam_width' value='15'/><string name='falloff' value='smooth'/><transform name='to_world'>"
         "<lookat origin='0 4 -2' target='0 0 0' up='1 0 0'/></transform></emitter>"),
     1e-4},
    {"area light",
     PLACE(OPTIONS, "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [5 4 3] \"float scale\" 2\nTranslate 0 4 0 "
                    "Rotate 90 1 0 0 Shape \"disk\" AttributeEnd\n"),
     XML_PLACE(XML_OPTIONS, "<shape type='disk'><transform name='to_world'><rotate x='1' angle='90'/><translate "
                            "y='4'/></transform>" MATTE
                            "<emitter type='area'><rgb name='radiance' value='10 8 6'/></emitter></shape>"),
     0.0},
    {"area light on nothing",
     PLACE(OPTIONS, LAMP "AttributeBegin Material \"interface\" AreaLightSource \"diffuse\" \"rgb L\" [5 4 3]\n"
                         "Translate 0 3 0 Shape \"sphere\" \"float radius\" 0.3 AttributeEnd\n"),
     XML_PLACE(XML_OPTIONS, XML_LAMP "<shape type='sphere'><point name='center' x='0' y='3' z='0'/>"
                                     "<float name='radius' value='0.3'/><bsdf type='null'/></shape>"),
     1e-5},
    {"sky of version 3",
     OPTIONS "PixelFilter \"gaussian\"\nWorldBegin\nLightSource \"infinite\" \"string mapname\" \"sky.pfm\" "
             "\"rgb scale\" [2 1 1]\n" ROOM "WorldEnd\n",
     XML_PLACE(XML_OPTIONS,
               "<emitter type='envmap'><string name='filename' value='sky.pfm'/><rgb name='scale' value='2 1 1'/>"
               "<transform name='to_world'><matrix value='0 0 -1  1 0 0  0 1 0'/></transform></emitter>"),
     0.0},
    {"exposure",
     CAMERA
     "Film \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 24 \"float iso\" 200 \"float exposuretime\" "
     "0.25\n" SAMPLES "WorldBegin\n" SKY LAMP ROOM,
     XML_PLACE(XML_OPTIONS, "<emitter type='constant'><rgb name='radiance' value='.25 .3 .35'/></emitter>"
                            "<emitter type='point'><rgb name='intensity' value='10 9 8'/>"
                            "<point name='position' x='2' y='4' z='-3'/></emitter>"),
     0.0},
    {"lens",
     "Scale 0.5 0.5 0.5\nLookAt 0 2 -6  0 0.7 0  0 1 0\nCamera \"perspective\" \"float fov\" 35 \"float lensradius\" "
     "0.2 \"float focaldistance\" 3\n" FILM SAMPLES "WorldBegin\n" SKY LAMP ROOM,
     XML_PLACE(XML_PATH
               "<sensor type='thinlens'><float name='fov' value='35'/><string name='fov_axis' value='y'/>"
               "<float name='aperture_radius' value='0.4'/><float name='focus_distance' value='6'/>"
               "<transform name='to_world'><scale x='-1'/><lookat origin='0,2,-6' target='0,0.7,0' up='0,1,0'/>"
               "</transform>" XML_FILM "</sensor>",
               XML_SKY XML_LAMP),
     0.3},
    {"orthographic",
     "LookAt 0 2 -6  0 0.7 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [-2 3 -1.75 2]\n" FILM SAMPLES
     "WorldBegin\n" SKY LAMP ROOM,
     XML_PLACE(XML_PATH "<sensor type='orthographic'><transform name='to_world'><scale x='-2.5' y='2.5'/>"
                        "<translate x='0.5' y='0.125'/><lookat origin='0,2,-6' target='0,0.7,0' up='0,1,0'/>"
                        "</transform>" XML_FILM "</sensor>",
               XML_SKY XML_LAMP),
     1e-3},
    {"screenwindow",
     "LookAt 0 2 -6  0 0.7 0  0 1 0\nCamera \"perspective\" \"float fov\" 40 \"float screenwindow\" [-1 0.6 -0.2 "
     "1]\n" FILM SAMPLES "WorldBegin\n" SKY LAMP ROOM,
     XML_PLACE(XML_PATH "<sensor type='perspective'><float name='fov' value='32.46860426270301'/>"
                        "<float name='principal_point_offset_x' value='-0.125'/>"
                        "<float name='principal_point_offset_y' value='-0.333333333'/>" XML_VIEW XML_FILM "</sensor>",
               XML_SKY XML_LAMP),
     0.1},
    {"crop",
     CAMERA "Film \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 24 \"float cropwindow\" [0.25 0.75 0 "
            "0.5]\n" SAMPLES "WorldBegin\n" SKY LAMP ROOM,
     XML_PLACE(XML_PATH
               "<sensor type='perspective'><float name='fov' value='35'/><string name='fov_axis' value='y'/>" XML_VIEW
               "<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='24'/>"
               "<integer name='crop_offset_x' value='8'/><integer name='crop_offset_y' value='0'/>"
               "<integer name='crop_width' value='16'/><integer name='crop_height' value='12'/></film>"
               "<sampler type='independent'><integer name='sample_count' value='8'/></sampler></sensor>",
               XML_SKY XML_LAMP),
     0.0},
};

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static void write_sky(void)
{
    static const char header[] = "PF\n8 4\n-1.0\n";
    float pixels[96];
    unsigned char bytes[sizeof header - 1 + sizeof pixels];
    for (int i = 0; i < 96; i++) pixels[i] = 0.1f + 0.02f * (float)((i * 37) % 50);
    memcpy(bytes, header, sizeof header - 1);
    memcpy(bytes + sizeof header - 1, pixels, sizeof pixels);
    import_write("sky.pfm", bytes, sizeof bytes);
}

static void write_two_by_two(const char *name, const float pixels[12])
{
    static const char header[] = "PF\n2 2\n-1.0\n";
    unsigned char bytes[sizeof header - 1 + 12 * sizeof *pixels];
    memcpy(bytes, header, sizeof header - 1);
    memcpy(bytes + sizeof header - 1, pixels, 12 * sizeof *pixels);
    import_write(name, bytes, sizeof bytes);
}

/* 1 - 0.4 times picture.pfm; 3 times it, at most 1; the mean of its channels; and 2 everywhere. */
static void write_changed_pictures(void)
{
    static const float inverse[12] = {1, 1, 0.6f, 0.2f, 0.2f, 0.2f, 0.6f, 1, 1, 1, 0.6f, 1};
    static const float cut[12] = {0, 0, 1, 1, 1, 1, 1, 0, 0, 0, 1, 0};
    static const float third = 1.0f / 3.0f, grey[12] = {third, third, third, 2,     2,     2,
                                                          third, third, third, third, third, third};
    static const float two[12] = {2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2};
    write_two_by_two("two.pfm", two);
    write_two_by_two("inverse.pfm", inverse);
    write_two_by_two("grey.pfm", grey);
    write_two_by_two("cut.pfm", cut);
}

/* picture.pfm, whose pixels are 0, 1 or 2, with a black frame as wide as a pixel of it. */
static void write_framed_picture(void)
{
    static const char header[] = "PF\n4 4\n-1.0\n";
    static const float inside[12] = {0, 0, 1, 2, 2, 2, 1, 0, 0, 0, 1, 0};
    float pixels[48] = {0.0f};
    unsigned char bytes[sizeof header - 1 + sizeof pixels];
    for (int y = 0; y < 2; y++) memcpy(pixels + 12 * (y + 1) + 3, inside + 6 * y, 6 * sizeof *pixels);
    memcpy(bytes, header, sizeof header - 1);
    memcpy(bytes + sizeof header - 1, pixels, sizeof pixels);
    import_write("framed.pfm", bytes, sizeof bytes);
}

/* Two by two pixels of R, G, B and A, and of what a number is read from. */
static void write_pictures_with_alpha(void)
{
    static const float red[4] = {0.9f, 0, 0.3f, 0.6f}, green[4] = {0, 0.3f, 0.6f, 0.9f}, blue[4] = {0.3f, 0, 0, 0};
    static const float alpha[4] = {1, 0.25f, 0, 0.75f}, one[4] = {1, 1, 1, 1};
    const float *const channels[4] = {red, green, blue, alpha};
    float grey[2][12];
    for (int opaque = 0; opaque < 2; opaque++) {
        ca_image_layers *image;
        char path[600];
        assert_int_equal(ca_image_make(2, 2, &image, NULL), CA_OK);
        for (int c = 0; c < 4; c++) {
            const char name[2] = {"RGBA"[c], '\0'};
            assert_int_equal(ca_image_add(image, name, c == 3 && opaque ? one : channels[c], NULL), CA_OK);
        }
        snprintf(path, sizeof path, "%s/%s.exr", import_folder(), opaque ? "opaque" : "leaf");
        assert_int_equal(ca_image_save(image, path, 0.0f, NULL), CA_OK);
        ca_image_release(image);
        for (int i = 0; i < 12; i++) { /* PFM begins with the last row */
            const int pixel = (i / 6 == 0 ? 2 : 0) + i / 3 % 2;
            grey[opaque][i] = opaque ? (red[pixel] + green[pixel] + blue[pixel]) / 3.0f : alpha[pixel];
        }
    }
    write_two_by_two("alpha.pfm", grey[0]);
    write_two_by_two("mean.pfm", grey[1]);
}

/* quad.ply with u = (x + 1) / 2 and v = 1 - (y - 0.5) / 2. */
static const char mapped_quad[] = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                                  "property float z\nproperty float u\nproperty float v\nelement face 1\n"
                                  "property list uchar int vertex_indices\nend_header\n-1 0.5 0 0 1\n1 0.5 0 1 1\n"
                                  "1 2 0 1 0.25\n-1 2 0 0 0.25\n4 0 1 2 3\n";

static const char tent[] = "ply\n"
                           "format ascii 1.0\n"
                           "element vertex 5\n"
                           "property float x\n"
                           "property float y\n"
                           "property float z\n"
                           "element face 4\n"
                           "property list uchar int vertex_indices\n"
                           "end_header\n"
                           "-1 -0.5 -1\n"
                           "1 -0.5 -1\n"
                           "1 -0.5 1\n"
                           "-1 -0.5 1\n"
                           "0 1 0\n"
                           "3 0 4 1\n"
                           "3 1 4 2\n"
                           "3 2 4 3\n"
                           "3 3 4 0\n";

/* The same, packed. */
static const unsigned char packed_tent[] = {
    31,  139, 8,   0,   0,   0,   0,   0,   2,   3,   101, 141, 77,  14,  131, 32,  16,  133, 247, 115, 138, 119,
    1,   13,  8,   158, 199, 16,  24,  34,  9,   162, 1,   218, 104, 79,  223, 89,  217, 196, 174, 190, 247, 51,
    153, 119, 228, 139, 226, 94,  55,  215, 225, 154, 79,  9,   122, 84,  196, 153, 55,  46,  29,  111, 174, 157,
    79,  204, 116, 212, 253, 16,  125, 33,  230, 93,  46,  207, 103, 112, 61,  131, 207, 253, 35,  58,  207, 176,
    191, 62,  167, 214, 241, 242, 171, 171, 72,  247, 196, 146, 74,  72,  158, 27,  113, 9,   203, 202, 46,  112,
    165, 65,  99,  80,  227, 140, 65,  211, 159, 210, 119, 171, 73,  65,  67,  145, 129, 130, 21,  103, 196, 89,
    76,  194, 73,  104, 132, 70,  168, 232, 11,  202, 48,  229, 81,  232, 0,   0,   0};

static void write_files(void)
{
    import_write_picture();
    write_changed_pictures();
    write_framed_picture();
    write_pictures_with_alpha();
    write_sky();
    import_write_text("ball.pbrt", "Translate 0 1 0\nShape \"sphere\"\nTranslate 0 -1 0\n");
    import_write_text("paint.spd", "# a paint\n400 .1\n500 .8 700 .2\n");
    import_write_text("tent.ply", tent);
    import_write_text("mapped_quad.ply", mapped_quad);
    import_write_text("spike.txt", "-9 1 0 .5\n-3 1 0 .25\n3 1 0 0\n9 1 0 -.25\n");
    import_write("tent.ply.gz", packed_tent, sizeof packed_tent);
    import_write_text("pair.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                                  "property float z\nelement face 2\nproperty list uchar int vertex_indices\n"
                                  "end_header\n-1 0 0\n1 0 0\n0 1 0.5\n0 1.5 -1\n3 0 1 2\n3 1 3 2\n");
    import_write_text("quad.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                                  "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                                  "end_header\n-1 0.5 0\n1 0.5 0\n1 2 0\n-1 2 0\n4 0 1 2 3\n");
}

/* ---- Comparison ------------------------------------------------------------------------------------------------ */

static void compare(const twin *twins, size_t count)
{
    write_files();
    for (size_t i = 0; i < count; i++) {
        char xml[8192];
        snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", twins[i].xml);
        ca_image_layers *a = import_render_text(twins[i].pbrt, "twin.pbrt"), *b = import_render_text(xml, "twin.xml");
        const double apart = picture_difference(a, b);
        if (!(apart <= twins[i].tolerance)) fail_msg("%s: pixels differ by %g", twins[i].name, apart);
        ca_image_release(a);
        ca_image_release(b);
    }
}
#define COMPARE(twins) compare(twins, sizeof(twins) / sizeof *(twins))

static void same_shapes(void **state)
{
    (void)state;
    COMPARE(shapes);
}

static void same_materials(void **state)
{
    (void)state;
    COMPARE(new_materials);
}

static void same_materials_of_version_3(void **state)
{
    (void)state;
    COMPARE(old_materials);
}

static void same_lights_and_cameras(void **state)
{
    (void)state;
    COMPARE(lights_and_cameras);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_shapes),
        cmocka_unit_test(same_materials),
        cmocka_unit_test(same_materials_of_version_3),
        cmocka_unit_test(same_lights_and_cameras),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
