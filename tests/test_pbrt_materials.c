/* Materials and textures of pbrt, versions 4 and 3, beside their twins in Mitsuba XML (support/pbrt_twins.h). */
#include "support/pbrt_twins.h"

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

static const pbrt_twin new_materials[] = {
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

static const pbrt_twin old_materials[] = {
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_materials),
        cmocka_unit_test(same_materials_of_version_3),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
