/* A scene of pbrt and the same one as Mitsuba XML, written by hand: their pictures are the same, to the bit where
 * nothing is computed on the way. One row a plugin or parameter. */
#ifndef CA_TESTS_PBRT_TWINS_H
#define CA_TESTS_PBRT_TWINS_H

#include "support/import_text.h"

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

typedef struct pbrt_twin {
    const char *name, *pbrt, *xml;
    double tolerance; /* of a pixel, relative to the mean; 0: the same bits */
} pbrt_twin;

#define NEW(name, body, xml)                                                                                         \
    {                                                                                                                \
        name, OPTIONS "WorldBegin\n" SKY LAMP FLOOR body, XML_OPTIONS XML_SKY XML_LAMP XML_FLOOR xml, 0.0            \
    }

/* Renders both of each, beside the pictures and meshes that they name; the test fails where they differ. */
void compare_pbrt_twins(const pbrt_twin *twins, size_t count);
#define COMPARE(twins) compare_pbrt_twins(twins, sizeof(twins) / sizeof *(twins))

#endif
