/* Shapes, lights and cameras of pbrt beside their twins in Mitsuba XML (support/pbrt_twins.h). */
#include "support/pbrt_twins.h"

static const pbrt_twin shapes[] = {
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

#define ROOM FLOOR PBRT_BALL
#define XML_ROOM XML_FLOOR BALL(MATTE)
#define PLACE(options, light) options "WorldBegin\n" light ROOM
#define XML_PLACE(options, light) options light XML_ROOM

static const pbrt_twin lights_and_cameras[] = {
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

static void same_shapes(void **state)
{
    (void)state;
    COMPARE(shapes);
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
        cmocka_unit_test(same_lights_and_cameras),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
