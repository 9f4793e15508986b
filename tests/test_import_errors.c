/* Every kind of mistake in a scene is an error that names its place, and the nearest known name where a name is
 * wrong. */
#include "support/import_text.h"

#include <stdio.h>

typedef struct mistake {
    const char *text, *message; /* the message after the file's name */
} mistake;

static void expect_all(const mistake *mistakes, size_t count)
{
    for (size_t i = 0; i < count; i++) import_expect_error(mistakes[i].text, mistakes[i].message);
}
#define EXPECT_ALL(mistakes) expect_all(mistakes, sizeof(mistakes) / sizeof *(mistakes))

static void wrong_names(void **state)
{
    (void)state;
    static const mistake mistakes[] = {
        {SCENE("<bsdf type=\"difuse\"/>"), "2:1: unknown bsdf \"difuse\"; the nearest known one is \"diffuse\""},
        {SCENE("<shape type=\"sphere\">\n  <float name=\"radios\" value=\"1\"/></shape>"),
         "3:3: unused parameter \"radios\" of sphere; the nearest known one is \"radius\""},
        {SCENE("<shape type=\"sfere\"/>"), "2:1: unknown shape \"sfere\"; the nearest known one is \"sphere\""},
        {SCENE("<shape type=\"shapegruop\"/>"),
         "2:1: unknown shape \"shapegruop\"; the nearest known one is \"shapegroup\""},
        {SCENE("<emitter type=\"spott\"/>"), "2:1: unknown emitter \"spott\"; the nearest known one is \"spot\""},
        {SCENE("<texture type=\"bitmop\"/>"), "2:1: unknown texture \"bitmop\"; the nearest known one is \"bitmap\""},
        {SCENE("<shpae type=\"sphere\"/>"), "2:1: unknown element <shpae>; the nearest known one is <shape>"},
        {SCENE("<medium type=\"homogeneous\"/>"), "2:1: <medium> is not supported"},
        {SCENE("<shape typ=\"sphere\" type=\"sphere\"/>"),
         "2:1: <shape> has no attribute \"typ\"; the nearest known one is \"type\""},
        {SCENE("<shape/>"), "2:1: <shape> needs the attribute \"type\""},
        {SCENE("<shape type=\"sphere\"><ref id=\"glas\"/></shape>\n<bsdf type=\"dielectric\" id=\"glass\"/>"),
         "2:22: there is no object with the id \"glas\"; the nearest id is \"glass\""},
        {SCENE("<shape type=\"sphere\"><ref id=\"glas\"/></shape>"), "2:22: there is no object with the id \"glas\""},
        {SCENE("<alias id=\"a\" as=\"b\"/><bsdf type=\"null\" id=\"aa\"/>"),
         "2:1: <alias>: there is no object with the id \"a\"; the nearest id is \"aa\""},
        {SCENE("<default name=\"spp\" value=\"1\"/>\n<shape type=\"$sp\"/>"),
         "3:1: $sp is not defined; the nearest known name is $spp"},
        {SCENE("<shape type=\"$sp\"/>"), "2:1: $sp is not defined (write \\$ for a plain $)"},
        {SCENE("<bsdf type=\"conductor\"><string name=\"material\" value=\"Cu_palick\"/></bsdf>"),
         "2:24: \"Cu_palick\" is not a known conductor; the nearest is \"Cu_palik\""},
        {SCENE("<bsdf type=\"dielectric\">\n<string name=\"int_ior\" value=\"watter\"/></bsdf>"),
         "3:1: \"watter\" is not a known int_ior; the nearest is \"water\""},
        {SCENE("<bsdf type=\"dielectric\">\n<string name=\"int_ior\" value=\"1.5\"/></bsdf>"),
         "3:1: parameter \"int_ior\" of dielectric must be a <float>, not <string>"},
        {SCENE("<bsdf type=\"roughconductor\"><string name=\"distribution\" value=\"gxx\"/></bsdf>"),
         "2:29: \"gxx\" is not a known distribution; the nearest is \"ggx\""},
        {"<scene version=\"3.0.0\">\n <sensor type=\"perspektive\"/></scene>",
         "2:2: unknown sensor \"perspektive\"; the nearest known one is \"perspective\""},
        {"<scene version=\"3.0.0\"><sensor type=\"perspective\">\n<film type=\"hdrfilm\"><rfilter "
         "type=\"box\"/>\n<integer name=\"widht\" value=\"3\"/></film></sensor></scene>",
         "3:1: unused parameter \"widht\" of hdrfilm; the nearest known one is \"width\""},
        {"<scene version=\"3.0.0\"><sensor type=\"perspective\">\n<sampler type=\"sobel\"/></sensor></scene>",
         "2:1: unknown sampler \"sobel\"; the nearest known one is \"sobol\""},
        {"<scene version=\"3.0.0\"><sensor type=\"perspective\">\n<film type=\"hdrfilm\"><rfilter "
         "type=\"gausian\"/></film></sensor></scene>",
         "2:22: unknown rfilter \"gausian\"; the nearest known one is \"gaussian\""},
    };
    EXPECT_ALL(mistakes);
}

static void wrong_values(void **state)
{
    (void)state;
    static const mistake mistakes[] = {
        {SCENE("<shape type=\"sphere\"><float name=\"radius\" value=\"1.5x\"/></shape>"),
         "2:22: \"1.5x\" is no finite number"},
        {SCENE("<shape type=\"sphere\"><float name=\"radius\" value=\"1,5\"/></shape>"),
         "2:22: \"1,5\" is no finite number; decimals have a point"},
        {SCENE("<shape type=\"sphere\"><float name=\"radius\" value=\"\"/></shape>"),
         "2:22: <float> needs 1 number in \"value\", not \"\""},
        {SCENE("<shape type=\"sphere\"><float name=\"radius\" value=\"nan\"/></shape>"),
         "2:22: \"nan\" is no finite number"},
        {SCENE("<shape type=\"sphere\"><float name=\"radius\" value=\"1e999\"/></shape>"),
         "2:22: \"1e999\" is no finite number"},
        {SCENE("<shape type=\"sphere\"><float name=\"radius\" value=\"0\"/></shape>"),
         "2:22: parameter \"radius\" of sphere must be greater than 0"},
        {SCENE("<shape type=\"sphere\"><string name=\"radius\" value=\"1\"/></shape>"),
         "2:22: parameter \"radius\" of sphere must be a <float>, not <string>"},
        {SCENE("<shape type=\"sphere\"><float name=\"radius\" value=\"1\"/>\n<float name=\"radius\" "
               "value=\"2\"/></shape>"),
         "3:1: parameter \"radius\" is given a second time"},
        {SCENE("<shape type=\"sphere\"><boolean name=\"flip_normals\" value=\"yes\"/></shape>"),
         "2:22: \"yes\" is neither \"true\" nor \"false\""},
        {SCENE("<shape type=\"sphere\"><point name=\"center\" x=\"1\" y=\"2\"/></shape>"),
         "2:22: <point> needs x, y and z, or value"},
        {SCENE("<shape type=\"sphere\"><point name=\"center\" x=\"1\" y=\"2\" z=\"3\" value=\"4\"/></shape>"),
         "2:22: <point> has both x and value"},
        {SCENE("<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"bitmap\"><float name=\"gamma\" "
               "value=\"1.8\"/></texture></bsdf>"),
         "2:64: parameter \"gamma\" of bitmap must be 1, 2.2, or -1 for sRGB"},
        {SCENE("<bsdf type=\"coating\"><bsdf type=\"bumpmap\"><texture type=\"checkerboard\"/>"
               "<bsdf type=\"diffuse\"/></bsdf></bsdf>"),
         "2:1: coating can only hold a BSDF that reflects, or a blend of such: bumpmap goes around it"},
        {SCENE("<bsdf type=\"coating\"><bsdf type=\"dielectric\"/></bsdf>"),
         "2:1: coating can only hold a BSDF that reflects, or a blend of such: dielectric goes around it"},
        {SCENE("<bsdf type=\"pplastic\"/>"), "2:1: bsdf \"pplastic\": polarised light is not supported"},
        {SCENE("<emitter type=\"sunsky\"/>"),
         "2:1: emitter \"sunsky\": the sky model is not supported; envmap takes a picture of a sky"},
        {SCENE("<bsdf type=\"mixturebsdf\"><string name=\"weights\" value=\"1\"/><bsdf type=\"diffuse\"/>"
               "<bsdf type=\"diffuse\"/></bsdf>"),
         "2:26: weights has 1 number for 2 BSDFs"},
        {SCENE("<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"scale\"/></bsdf>"),
         "2:22: scale needs a nested <texture>"},
        {SCENE("<shape type=\"cube\"><transform name=\"to_world\"><scale x=\"0\"/></transform></shape>"),
         "2:20: this transform is singular, not affine or not finite"},
        {SCENE("<shape type=\"cube\"><transform name=\"to_world\"><matrix value=\"1 2 3\"/></transform></shape>"),
         "2:47: <matrix> needs 16 numbers in \"value\", not \"1 2 3\""},
        {SCENE("<shape type=\"cube\"><transform name=\"to_world\"><rotate angle=\"3\"/></transform></shape>"),
         "2:47: <rotate> needs an axis, and it is 0"},
        {SCENE("<shape type=\"cube\"><transform name=\"to_world\"><lookat origin=\"0 0 0\" target=\"0 1 0\" "
               "up=\"0 1 0\"/></transform></shape>"),
         "2:47: <lookat> needs origin, target and up that are not on one line"},
        {SCENE("<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.5 0.5\"/></bsdf>"),
         "2:22: <rgb> needs 3 numbers in \"value\", not \"0.5 0.5\""},
        {SCENE("<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.5 1.5 0\"/></bsdf>"),
         "2:22: reflectances, weights and opacities lie in [0, 1], and 1.5 does not"},
        {SCENE("<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"#12345g\"/></bsdf>"),
         "2:22: \"#12345g\" is no colour of the form #rrggbb"},
        {SCENE("<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"400:1 300:1\"/></bsdf>"),
         "2:22: the wavelengths of a spectrum must increase, and 300 does not"},
        {SCENE("<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"400:1 500\"/></bsdf>"),
         "2:22: \"500\" is no wavelength:value pair"},
        {SCENE("<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"400:1\"/></bsdf>"),
         "2:22: a spectrum needs at least two wavelengths"},
        {SCENE("<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" type=\"d66\"/></bsdf>"),
         "2:22: unknown texture \"d66\"; the nearest known one is \"d65\""},
        {SCENE("<emitter type=\"point\"><spectrum name=\"intensity\" type=\"blackbody\"/></emitter>"),
         "2:23: parameter \"temperature\" of blackbody is missing"},
        {SCENE("<emitter type=\"point\"><blackbody name=\"intensity\"/></emitter>"),
         "2:23: <blackbody> needs the attribute \"temperature\""},
        {SCENE("<emitter type=\"point\"><blackbody name=\"intensity\" temperature=\"hot\"/></emitter>"),
         "2:23: \"hot\" is no finite number"},
        {SCENE("<emitter type=\"point\"><blackbody name=\"intensity\" temperature=\"1e3\" scal=\"2\"/></emitter>"),
         "2:23: <blackbody> has no attribute \"scal\"; the nearest known one is \"scale\""},
        {SCENE("<emitter type=\"point\"><spectrum name=\"intensity\" type=\"irregular\"><string name=\"wavelengths\" "
               "value=\"400 500\"/><string name=\"values\" value=\"1\"/></spectrum></emitter>"),
         "2:23: there are 2 wavelengths, but 1 value"},
        {SCENE("<emitter type=\"constant\"><rgb name=\"radiance\" value=\"-1 0 0\"/></emitter>"),
         "2:26: a colour cannot have the component -1"},
        {SCENE("<shape type=\"cylinder\"><point name=\"p1\" x=\"0\" y=\"0\" z=\"0\"/></shape>"),
         "2:24: parameter \"p1\" of cylinder must be another point than p0"},
    };
    EXPECT_ALL(mistakes);
}

static void wrong_structure(void **state)
{
    (void)state;
    static const mistake mistakes[] = {
        {"<scene version=\"3.0.0\">\n</scene>", "1:1: the scene has no <sensor>"},
        {"<scene>\n</scene>", "1:1: <scene> needs the attribute \"version\""},
        {"<scene version=\"4.0.0\"/>", "1:1: version \"4.0.0\" of the scene language is not known; 0.x to 3.x are"},
        {"<bsdf type=\"null\"/>", "1:1: the file begins with <bsdf>, not with <scene>"},
        {"<scene version=\"3.0.0\">\n<sensor type=\"batch\"/></scene>", "2:1: batch needs nested sensors"},
        {"<scene version=\"3.0.0\">\n<sensor type=\"batch\"><sensor type=\"batch\"><sensor type=\"perspective\"/>"
         "</sensor></sensor></scene>",
         "2:22: a batch cannot hold a \"batch\""},
        {"<scene version=\"3.0.0\">\n<sensor type=\"batch\"><sensor type=\"distant\"/></sensor></scene>",
         "2:22: a batch cannot hold a \"distant\""},
        {"<scene version=\"3.0.0\">\n<sensor type=\"batch\"><sensor type=\"radiancemeter\"/></sensor></scene>",
         "2:22: radiancemeter needs a film of 1 x 1 pixels, and this is 768 x 576"},
        {"<scene version=\"3.0.0\">\n<sensor type=\"batch\"><sensor type=\"perspective\"/>"
         "<sensor type=\"perspective\"/><film type=\"hdrfilm\"><integer name=\"width\" value=\"9\"/></film>"
         "</sensor></scene>",
         "2:1: the film of 9 pixels a row cannot be divided among the batch's 2 sensors"},
        {SCENE("<shape type=\"merge\"><shape type=\"instance\"/></shape>"), "2:21: a merge cannot hold instance"},
        {SCENE("<integrator type=\"path\"/><integrator type=\"path\"/>"),
         "2:26: a second <integrator>; the first is at line 2"},
        {SCENE("<film type=\"hdrfilm\"/>"), "2:1: <film> has no meaning directly inside <scene>"},
        {SCENE("<film type=\"hdrfilm\" id=\"f\"><integer name=\"widht\" value=\"9\"/></film>"),
         "2:29: unused parameter \"widht\" of hdrfilm; the nearest known one is \"width\""},
        {SCENE("<translate x=\"1\"/>"), "2:1: <translate> cannot stand inside <scene>"},
        {SCENE(
             "<shape type=\"cube\"><transform name=\"to_world\"><float name=\"x\" value=\"1\"/></transform></shape>"),
         "2:47: <float> cannot stand inside <transform>"},
        {SCENE("<shape type=\"cube\"><float name=\"x\" value=\"1\"><float name=\"y\" value=\"1\"/></float></shape>"),
         "2:46: <float> cannot stand inside <float>"},
        {SCENE("<shape type=\"cube\"><film type=\"hdrfilm\"/></shape>"), "2:20: cube has no use for this <film>"},
        {SCENE("<shape type=\"cube\"><bsdf type=\"null\"/><bsdf type=\"null\"/></shape>"),
         "2:39: a shape has one BSDF, and this is a second"},
        {SCENE("<shape type=\"cube\"><emitter type=\"point\"/></shape>"),
         "2:20: a shape can only hold an area or directionalarea emitter, not point"},
        {SCENE("<emitter type=\"area\"/>"), "2:1: area stands inside the shape that emits"},
        {SCENE("<emitter type=\"area\" id=\"a\">\n<float name=\"power\" value=\"1\"/></emitter>"),
         "3:1: unused parameter \"power\" of area; the nearest known one is \"radiance\""},
        {SCENE("<shape type=\"shapegroup\" id=\"g\">\n<shape type=\"cube\"><emitter type=\"area\"/></shape></shape>"),
         "3:20: a shape inside a shapegroup cannot emit light"},
        {SCENE("<shape type=\"shapegroup\">\n<shape type=\"instance\"/></shape>"),
         "3:1: a shapegroup cannot hold a instance"},
        {SCENE("<shape type=\"instance\"/>"), "2:1: an instance needs a <ref> to a shapegroup"},
        {SCENE("<bsdf type=\"twosided\">\n<bsdf type=\"dielectric\"/></bsdf>"),
         "2:1: twosided cannot hold a BSDF that transmits light, as the one at line 3 does"},
        {SCENE("<bsdf type=\"twosided\"><bsdf type=\"mask\"><bsdf type=\"diffuse\"/></bsdf></bsdf>"),
         "2:1: twosided cannot hold a BSDF that transmits light, as the one at line 2 does"},
        {SCENE("<bsdf type=\"twosided\"/>"), "2:1: twosided needs 1 nested BSDF"},
        {SCENE("<bsdf type=\"mask\"><bsdf type=\"diffuse\"/><bsdf type=\"diffuse\"/></bsdf>"),
         "2:41: mask holds 1 BSDF, not more"},
        {SCENE("<bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"0.5\"/><bsdf type=\"diffuse\"/></bsdf>"),
         "2:1: blendbsdf needs 2 nested BSDFs"},
        {SCENE("<bsdf type=\"blendbsdf\"><bsdf type=\"diffuse\"/><bsdf type=\"diffuse\"/></bsdf>"),
         "2:1: parameter \"weight\" of blendbsdf is missing"},
        {SCENE("<bsdf type=\"bumpmap\"><bsdf type=\"diffuse\"/></bsdf>"), "2:1: bumpmap needs a nested <texture>"},
        {SCENE("<bsdf type=\"twosided\" id=\"a\">\n<ref id=\"a\"/></bsdf>"), "2:1: this <bsdf> refers to itself"},
        {SCENE("<alias id=\"a\" as=\"b\"/><alias id=\"b\" as=\"a\"/>"), "2:23: <alias>: \"b\" leads to no object"},
        {SCENE("<bsdf type=\"conductor\"><string name=\"material\" value=\"Ag\"/><rgb name=\"eta\" "
               "value=\"1\"/></bsdf>"),
         "2:24: parameter \"material\" of conductor excludes eta and k"},
        {SCENE("<bsdf type=\"roughconductor\"><float name=\"alpha_u\" value=\"1\"/></bsdf>"),
         "2:29: parameter \"alpha_u\" of roughconductor needs its other half"},
        {SCENE("<bsdf type=\"principled\"><float name=\"eta\" value=\"1.5\"/><float name=\"specular\" "
               "value=\"0.5\"/></bsdf>"),
         "2:56: parameter \"specular\" of principled excludes eta"},
        {SCENE("<bsdf type=\"diffuse\"><bsdf name=\"reflectance\" type=\"diffuse\"/></bsdf>"),
         "2:22: parameter \"reflectance\" of diffuse must be a colour or a <texture>, not <bsdf>"},
        {SCENE("<texture type=\"mesh_attribute\"><string name=\"name\" value=\"color\"/></texture>"),
         "2:32: parameter \"name\" of mesh_attribute must begin with \"vertex_\" or \"face_\""},
    };
    EXPECT_ALL(mistakes);
    char expected[256];
    snprintf(expected, sizeof expected, "3:1: the id \"a\" is taken already, at %s/test.xml:2:1", import_folder());
    import_expect_error(SCENE("<bsdf type=\"null\" id=\"a\"/>\n<shape type=\"cube\" id=\"a\"/>"), expected);
}

static void expect_lens_error(const char *name, const char *message)
{
    char text[256], path[128], expected[256];
    ca_scene_desc desc;
    ca_error error;
    snprintf(text, sizeof text,
             "<scene version=\"3.0.0\"><sensor type=\"realistic\"><string name=\"filename\" "
             "value=\"%s\"/></sensor></scene>",
             name);
    snprintf(path, sizeof path, "%s/test.xml", import_folder());
    snprintf(expected, sizeof expected, "%s/%s", import_folder(), message);
    assert_int_not_equal(ca_import_scene_text(text, strlen(text), path, NULL, 0, &desc, &error), CA_OK);
    assert_string_equal(error.message, expected);
}

/* Lens files are blamed by line and column of their own. */
static void wrong_lens_files(void **state)
{
    (void)state;
    import_write_text("short.dat", "# a lens\n50 5 1.5 20\n\n-50  x 1 20\n");
    expect_lens_error("short.dat", "short.dat:4:6: surface 2 of the lens: expected a thickness in mm, not \"x\"");
    import_write_text("open.dat", "50 5 1.5 20\n");
    expect_lens_error("open.dat", "open.dat:2:1: behind the last surface of the lens there must be air");
    import_write("binary.dat", "50\0", 3);
    char expected[256];
    snprintf(expected, sizeof expected, "test.xml:1:24: %s/binary.dat is no text file", import_folder());
    expect_lens_error("binary.dat", expected);
}

static void wrong_sensors(void **state)
{
    (void)state;
#define SENSOR(type, body) "<scene version=\"3.0.0\">\n<sensor type=\"" type "\">\n" body "</sensor></scene>"
#define LENS(table) "<string name=\"lens\" value=\"" table "\"/>"
    static const mistake mistakes[] = {
        {SENSOR("perspective", "<float name=\"fov\" value=\"180\"/>"),
         "3:1: parameter \"fov\" of perspective is 180, and must lie in [0.0001, 179.9]"},
        {SENSOR("perspective", "<float name=\"fov\" value=\"45\"/>\n<string name=\"focal_length\" value=\"50mm\"/>"),
         "4:1: parameter \"focal_length\" of perspective excludes fov"},
        {SENSOR("perspective", "<string name=\"focal_length\" value=\"50cm\"/>"),
         "3:1: parameter \"focal_length\" of perspective must be a length like \"50mm\""},
        {SENSOR("perspective", "<float name=\"near_clip\" value=\"10\"/><float name=\"far_clip\" value=\"1\"/>"),
         "3:1: parameter \"near_clip\" of perspective must be less than far_clip"},
        {SENSOR("perspective", "<transform name=\"to_world\"><scale value=\"2\"/></transform>"),
         "3:1: parameter \"to_world\" of perspective can only move and rotate"},
        {SENSOR("thinlens", ""), "2:1: parameter \"aperture_radius\" of thinlens is missing"},
        {SENSOR("realistic", ""), "2:1: parameter \"lens\" of realistic or filename must be given, and not both"},
        {SENSOR("realistic", LENS("50 5 1.5 20; -50 0 1")),
         "3:1: surface 2 of the lens: expected the aperture's diameter in mm, not \"-50\""},
        {SENSOR("realistic", LENS("50 5 1.5 20 1")),
         "3:1: surface 1 of the lens: expected the end of the row, not \"1\""},
        {SENSOR("realistic", LENS("50 5 x 20")),
         "3:1: surface 1 of the lens: expected an index of refraction, not \"x\""},
        {SENSOR("realistic", LENS("50 5 0.5 20")),
         "3:1: surface 1 of the lens: expected an index of refraction, not \"0.5\""},
        {SENSOR("realistic", LENS("x 5 1.5 20")), "3:1: surface 1 of the lens: a column is radius, thickness, index, "
                                                  "diameter, glass, abbe or surface, not \"x\""},
        {SENSOR("realistic", LENS("radius thickness index")),
         "3:1: surface 1 of the lens: a header names radius, thickness and diameter, not \"radius\""},
        {SENSOR("realistic", LENS("radius radius")),
         "3:1: surface 1 of the lens: each column has a name of its own, not \"radius\""},
        {SENSOR("realistic", LENS("radius thickness glass diameter; 50 5 BKK7 20")),
         "3:1: surface 1 of the lens: expected a glass such as 517642 or N-BK7 (the nearest is \"N-BK7\"), not "
         "\"BKK7\""},
        {SENSOR("realistic", LENS("50 -5 1.5 20")),
         "3:1: surface 1 of the lens: expected a thickness in mm, not \"-5\""},
        {SENSOR("realistic", LENS("9 5 1.5 20")),
         "3:1: surface 1 of the lens: expected a diameter of at most twice the radius, not \"20\""},
        {SENSOR("realistic", LENS("0 5 1.5 20")),
         "3:1: surface 1 of the lens: a stop does not refract (a plane's radius is \"inf\"), not \"0\""},
        {SENSOR("realistic", LENS("50 - 1.5 20; -50 0 1 20")),
         "3:1: surface 2 of the lens: the one before it needs a thickness, not \"-50\""},
        {SENSOR("realistic", LENS("50 5 1.5 20")), "3:1: behind the last surface of the lens there must be air"},
        {SENSOR("realistic", LENS("")), "3:1: the lens has no surfaces"},
        {SENSOR("realistic", LENS("50 5 1.5 20; -50 0 1 20") "\n<float name=\"aperture_diameter\" value=\"2\"/>"),
         "4:1: parameter \"aperture_diameter\" of realistic needs a lens with one stop"},
        {SENSOR("realistic",
                LENS("50 5 1.5 20; -50 1 1 20; 0 0 1 9") "\n<float name=\"aperture_diameter\" value=\"10\"/>"),
         "4:1: parameter \"aperture_diameter\" of realistic is more than the diameter of the lens's stop"},
        {SENSOR("realistic", LENS("-50 5 1.5 20; 50 0 1 20")),
         "2:1: the lens cannot focus: its focal length is -49.1803 mm, so that it makes no image; film_distance may "
         "say where the film is"},
        {SENSOR("realistic", LENS("50 5 1.5 20; -50 0 1 20") "<float name=\"film_distance\" value=\"50\"/>"
                                                             "<float name=\"focus_distance\" value=\"50\"/>"),
         "3:54: parameter \"film_distance\" of realistic excludes focus_distance"},
        {SENSOR("realistic", LENS("-20 5 1.5 38; 15 0 1 20") "<float name=\"film_distance\" value=\"50\"/>"
                                                             "<float name=\"near_clip\" value=\"0.005\"/>"),
         "3:94: parameter \"near_clip\" of realistic must be in front of the lens's rim"},
        {SENSOR("distant", ""), "2:1: distant needs a film of 1 x 1 pixels, and this is 768 x 576"},
        {SENSOR("distant", "<vector name=\"direction\" x=\"0\" y=\"0\" z=\"0\"/>"),
         "3:1: parameter \"direction\" of distant must have a length over 0"},
        {SENSOR("distant", "<vector name=\"direction\" value=\"1 0 0\"/><transform name=\"to_world\"/>"),
         "3:41: parameter \"to_world\" of distant excludes direction"},
        {SENSOR("distant", "<shape name=\"target\" type=\"cube\"/>"),
         "3:1: a target is a point, a rectangle or a disk, not cube"},
        {SENSOR("distant", "<vector name=\"direction\" value=\"1 0 0\"/><shape name=\"target\" type=\"disk\"/>"),
         "3:41: parameter \"target\" of distant must not be seen edge-on"},
        {SENSOR("radiancemeter", ""),
         "2:1: radiancemeter needs a film of 1 x 1 pixels, and this is 768 x 576"},
        {SENSOR("radiancemeter", "<film type=\"hdrfilm\"><integer name=\"width\" value=\"1\"/></film>"),
         "2:1: radiancemeter needs a film of 1 x 1 pixels, and this is 1 x 576"},
        {SENSOR("radiancemeter", "<vector name=\"direction\" x=\"0\" y=\"0\" z=\"0\"/>"),
         "3:1: parameter \"direction\" of radiancemeter must have a length over 0"},
        {SENSOR("orthographic", "<float name=\"fov\" value=\"45\"/>"),
         "3:1: unused parameter \"fov\" of orthographic; the nearest known one is \"to_world\""},
        {SENSOR("perspective", "<film type=\"hdrfilm\"><integer name=\"width\" value=\"0\"/></film>"),
         "3:22: parameter \"width\" of hdrfilm is 0, and must lie in [1, 65536]"},
        {SENSOR("perspective", "<film type=\"hdrfilm\"><float name=\"width\" value=\"10\"/></film>"),
         "3:22: parameter \"width\" of hdrfilm must be an <integer>, not <float>"},
        {SENSOR("perspective", "<film type=\"hdrfilm\"><integer name=\"width\" value=\"1.5\"/></film>"),
         "3:22: \"1.5\" is no integer"},
        {SENSOR("perspective", "<film type=\"hdrfilm\"><integer name=\"width\" value=\"5,\"/></film>"),
         "3:22: \"5,\" is no integer"},
        {SENSOR("perspective", "<float name=\"fov\" value=\",5\"/>"),
         "3:1: \",5\" is no finite number; decimals have a point"},
        {SENSOR("perspective", "<float name=\"fov\" value=\"40,5\"/>"),
         "3:1: \"40,5\" is no finite number; decimals have a point"},
        {SENSOR("perspective", "<integer name=\"fov\" value=\"40.5\"/>"), "3:1: \"40.5\" is no integer"},
        {SENSOR("perspective", "<film type=\"hdrfilm\"><integer name=\"crop_width\" value=\"769\"/></film>"),
         "3:22: parameter \"crop_width\" of hdrfilm is 769, and must lie in [1, 768]"},
        {SENSOR("perspective", "<film type=\"hdrfilm\"/><film type=\"hdrfilm\"/>"),
         "3:23: a sensor has one film, and this is a second"},
        {SENSOR("perspective",
                "<sampler type=\"independent\"><integer name=\"sample_count\" value=\"0\"/></sampler>"),
         "3:29: parameter \"sample_count\" of independent is 0, and must lie in [1, 2147483647]"},
    };
    EXPECT_ALL(mistakes);
}

#define REFLECTS(texture) SCENE("<bsdf type=\"diffuse\">" texture "</bsdf>")
#define CHECKS "<texture type=\"checkerboard\"><rgb name=\"color1\" value=\"0.5 0.5 0.5\"/></texture>"

/* In textures and spectra that may be anything, until it is known what they are for. */
static void wrong_colors(void **state)
{
    (void)state;
    static const mistake mistakes[] = {
        {REFLECTS("<texture name=\"reflectance\" type=\"checkerboard\"><rgb name=\"color1\" value=\"0.1 1.5 0.1\"/>"
                  "</texture>"),
         "2:22: reflectances, weights and opacities lie in [0, 1], and 1.5 does not"},
        {REFLECTS("<texture name=\"reflectance\" type=\"scale\"><float name=\"scale\" value=\"4\"/>" CHECKS
                  "</texture>"),
         "2:22: reflectances, weights and opacities lie in [0, 1], and 2 does not"},
        {REFLECTS("<spectrum name=\"reflectance\" type=\"d65\"><float name=\"scale\" value=\"5\"/></spectrum>"),
         "2:22: reflectances, weights and opacities lie in [0, 1], and 5 does not"},
        {REFLECTS("<spectrum name=\"reflectance\" type=\"rawconstant\"><vector name=\"value\" value=\"0.5 5 0\"/>"
                  "</spectrum>"),
         "2:70: reflectances, weights and opacities lie in [0, 1], and 5 does not"},
        {SCENE("<emitter type=\"point\"><spectrum name=\"intensity\" type=\"rawconstant\"><vector name=\"value\" "
               "value=\"1 -1 1\"/></spectrum></emitter>"),
         "2:69: a colour cannot have the component -1"},
        {REFLECTS("<spectrum name=\"reflectance\" value=\"0.4:0.5 0.7:0.5\"/>"),
         "2:22: wavelengths are in nanometres: none from 0.4 to 0.7 is visible"},
        {REFLECTS("<spectrum name=\"reflectance\" value=\"830:0.5 900:0.5\"/>"),
         "2:22: wavelengths are in nanometres: none from 830 to 900 is visible"},
        {SCENE("<emitter type=\"ies\"/>"),
         "2:1: emitter \"ies\": tables of luminous intensity are not read; a projector throws a picture of it"},
    };
    EXPECT_ALL(mistakes);
}

static void wrong_files(void **state)
{
    (void)state;
    char expected[1200];
    snprintf(expected, sizeof expected, "2:1: %s/no.obj: cannot open this mesh: No such file or directory",
             import_folder());
    import_expect_error(SCENE("<shape type=\"obj\"><string name=\"filename\" value=\"no.obj\"/></shape>"), expected);
    import_expect_error(SCENE("<shape type=\"obj\"/>"), "2:1: parameter \"filename\" of obj must name a file");
    import_expect_error(SCENE("<shape type=\"obj\">\n<string name=\"filename\" value=\"\"/></shape>"),
                        "3:1: parameter \"filename\" of obj must name a file");
    snprintf(expected, sizeof expected, "2:1: there is no file \"%s/no.xml\" to include", import_folder());
    import_expect_error(SCENE("<include filename=\"no.xml\"/>"), expected);
    snprintf(expected, sizeof expected, "2:1: <path>: there is no folder \"%s/no\"", import_folder());
    import_expect_error(SCENE("<path value=\"no\"/>"), expected);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(wrong_names),   cmocka_unit_test(wrong_values),     cmocka_unit_test(wrong_structure),
        cmocka_unit_test(wrong_sensors), cmocka_unit_test(wrong_lens_files), cmocka_unit_test(wrong_files),
        cmocka_unit_test(wrong_colors),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
