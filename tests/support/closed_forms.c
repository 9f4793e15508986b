#include "support/closed_forms.h"

#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979323846

/* ---- Sensors --------------------------------------------------------------------------------------------------- */

#define FILM(width, height, filter)                                                                                  \
    "<film type='hdrfilm'><integer name='width' value='" width "'/><integer name='height' value='" height "'/>"      \
    "<rfilter type='" filter "'/></film></sensor>"
#define LOOK_INSIDE                                                                                                  \
    "<transform name='to_world'><lookat origin='0.3,0.1,-0.4' target='0,0.2,1' up='0,1,0'/></transform>"

static const struct general_sensor {
    const char *name, *text;
} general_sensors[GENERAL_SENSORS] = {
    {"perspective", "<sensor type='perspective'><float name='fov' value='70'/>" LOOK_INSIDE FILM("24", "16", "tent")},
    {"orthographic",
     "<sensor type='orthographic'><transform name='to_world'><scale value='0.3'/>"
     "<lookat origin='0,0.1,-0.5' target='0,0.1,1' up='0,1,0'/></transform>" FILM("24", "16", "gaussian")},
    {"thinlens", "<sensor type='thinlens'><float name='fov' value='50'/><float name='aperture_radius' value='0.1'/>"
                 "<float name='focus_distance' value='0.8'/>" LOOK_INSIDE FILM("24", "16", "box")},
};

const char *general_sensor_name(size_t sensor) { return general_sensors[sensor].name; }

/* Straight down from `y`, on the square of half side `half` around the origin. */
#define LOOK_DOWN(half, y)                                                                                           \
    "<sensor type='orthographic'><transform name='to_world'><scale value='" half "'/>"                               \
    "<lookat origin='0," y ",0' target='0,0,0' up='0,0,1'/></transform>" FILM("24", "24", "box")

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

#define DIFFUSE(rho) "<bsdf type='diffuse'><rgb name='reflectance' value='" rho "'/></bsdf>"
#define MIRROR "<bsdf type='conductor'><string name='material' value='none'/></bsdf>"
#define ENCLOSING_SPHERE(inside) "<shape type='sphere'><boolean name='flip_normals' value='true'/>" inside "</shape>"
#define BALL(bsdf)                                                                                                   \
    "<shape type='sphere'><point name='center' value='0.1,0.2,0.4'/><float name='radius' value='0.3'/>" bsdf         \
    "</shape>"
#define DISK(z, bsdf)                                                                                                \
    "<shape type='disk'><transform name='to_world'><scale value='0.5'/><rotate y='1' angle='180'/><translate z='" z  \
    "'/></transform>" bsdf "</shape>"
#define UNLIMITED "<integrator type='path'><integer name='rr_depth' value='5'/></integrator>"
#define DEPTH(n) "<integrator type='path'><integer name='max_depth' value='" n "'/></integrator>"
#define CENTRE_LIGHT "<emitter type='point'><rgb name='intensity' value='2'/></emitter>"
#define GLOW "<emitter type='area'><rgb name='radiance' value='0.5'/></emitter>"
#define FLOOR(rho)                                                                                                   \
    "<shape type='rectangle'><transform name='to_world'><scale value='3'/><rotate x='1' "                            \
    "angle='-90'/></transform>" DIFFUSE(rho) "</shape>"
#define SQUARE_ABOVE                                                                                                 \
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/><translate "                       \
    "y='1'/></transform>" DIFFUSE("0") "<emitter type='area'><rgb name='radiance' value='1'/></emitter></shape>"

#define EXITANCE(m) "<emitter type='directionalarea'><rgb name='radiance' value='" m "'/></emitter>"
#define COLLIMATED_BALL "<shape type='sphere'><float name='radius' value='0.01'/>" EXITANCE("20000") "</shape>"
#define BEAM                                                                                                         \
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='120'/><translate y='1.04' z='0.6'/>"  \
    "</transform>" EXITANCE("2") "</shape>"

/* Of a small element to a square of half side 1 straight above it at height 1: 4 times that of a quarter with a = b
 * = 1. */
static double element_to_square(void) { return 4.0 / (2.0 * PI) * 2.0 * sqrt(0.5) * atan(sqrt(0.5)); }

/* Of a square of side 2 to an equal one straight above it at height 1; by reciprocity the mean radiance of the lower
 * one, where it is white. With X = Y = 2: F = 2 / (pi X Y) (ln sqrt((1+X^2)(1+Y^2) / (1+X^2+Y^2)) + X sqrt(1+Y^2)
 * atan(X / sqrt(1+Y^2))
 * + Y sqrt(1+X^2) atan(Y / sqrt(1+X^2)) - X atan X - Y atan Y). */
static double square_to_square(void)
{
    const double x = 2.0, root = sqrt(1.0 + x * x);
    return 2.0 / (PI * x * x) *
           (log(root * root / sqrt(1.0 + 2.0 * x * x)) + 2.0 * x * root * atan(x / root) - 2.0 * x * atan(x));
}

/* The square hides a share of a sky that is so dim that next event mostly chooses the square. */
static double square_and_sky(void) { return 0.1 + 0.9 * square_to_square(); }

/* ---- Caustics through glass and water -------------------------------------------------------------------------- */

/* A point light of intensity 1 above a floor of reflectance 0.8; in between, light passes through air and through a
 * denser medium, which it enters, and leaves again or not. */
typedef struct layers {
    double air, dense; /* m along the axis */
    double eta;
    int faces; /* that it passes */
} layers;

static const layers slab = {.air = 0.7, .dense = 0.3, .eta = 1.5, .faces = 2};
static const layers water = {.air = 0.5, .dense = 0.5, .eta = 1.33, .faces = 1};
static const double view = 0.3; /* half side of the square of floor that is seen */

/* Distance from the axis at which a ray that left the light at angle theta meets the floor; its derivative. */
static double floor_distance(const layers *l, double theta, double *derivative)
{
    const double inside = asin(sin(theta) / l->eta), c = cos(theta), c_inside = cos(inside);
    *derivative = l->air / (c * c) + l->dense / (c_inside * c_inside) * c / (l->eta * c_inside);
    return l->air * tan(theta) + l->dense * tan(inside);
}

/* Fresnel's formulas; on entering and leaving the angles are the same. */
static double transmittance(const layers *l, double theta)
{
    const double c = cos(theta), c_inside = cos(asin(sin(theta) / l->eta));
    const double s = (c - l->eta * c_inside) / (c + l->eta * c_inside);
    const double p = (l->eta * c - c_inside) / (l->eta * c + c_inside);
    return pow(1.0 - 0.5 * (s * s + p * p), l->faces);
}

/* The flux I T 2 pi sin theta dtheta of a cone falls on the ring 2 pi d dd. */
static double floor_irradiance(const layers *l, double distance)
{
    double low = 0.0, high = 1.5, derivative;
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        if (floor_distance(l, middle, &derivative) < distance)
            low = middle;
        else
            high = middle;
    }
    floor_distance(l, low, &derivative);
    return transmittance(l, low) * sin(low) / (distance * derivative);
}

/* Mean over the view. */
static double floor_radiance(const layers *l)
{
    enum { STEPS = 100 };
    double sum = 0.0;
    for (int y = 0; y < STEPS; y++)
        for (int x = 0; x < STEPS; x++)
            sum += floor_irradiance(l, view * hypot((x + 0.5) / STEPS, (y + 0.5) / STEPS));
    return 0.8 / PI * sum / (STEPS * STEPS);
}

static double under_slab(void) { return floor_radiance(&slab); }
static double under_water(void) { return floor_radiance(&water); }
/* Seen from above at normal incidence; leaving water, radiance falls by the square of the index. */
static double through_slab(void) { return transmittance(&slab, 0.0) * floor_radiance(&slab); }
static double through_water(void)
{
    return transmittance(&water, 0.0) / (water.eta * water.eta) * floor_radiance(&water);
}

/* Full intensity inside of 32 degrees, which is all that the view sees. */
#define SPOT_DOWN                                                                                                    \
    "<emitter type='spot'><rgb name='intensity' value='1'/><float name='cutoff_angle' value='36'/>"                  \
    "<float name='beam_width' value='32'/>"                                                                          \
    "<transform name='to_world'><lookat origin='0,1,0' target='0,0,0' up='0,0,1'/></transform></emitter>"
#define SLAB                                                                                                         \
    "<shape type='cube'><transform name='to_world'><scale x='3' y='0.15' z='3'/><translate y='0.55'/></transform>"   \
    "<bsdf type='dielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/></bsdf></shape>"

/* On a sphere of radius R, merging of light from all sides loses r^2 / (8 R^2): what comes from below the horizon of
 * the point looked at, though not of the photon's. */
#define CAVITY_RADIUS 0.1f
#define WATER                                                                                                        \
    "<shape type='rectangle'><transform name='to_world'><scale value='3'/><rotate x='1' angle='-90'/><translate "    \
    "y='0.5'/>"                                                                                                      \
    "</transform><bsdf type='dielectric'><float name='int_ior' value='1.33'/><float name='ext_ior' "                 \
    "value='1'/></bsdf></shape>"

static const closed_form closed_forms[] = {
    /* E = I / r^2 everywhere; one bounce */
    {"point light in a sphere, direct", DEPTH("2"), NULL, CENTRE_LIGHT ENCLOSING_SPHERE(DIFFUSE("0.6")),
     0.6 / PI * 2.0, NULL, 0, CAVITY_RADIUS},
    /* a cavity of reflectance rho multiplies by 1 / (1 - rho) */
    {"point light in a sphere, all bounces", UNLIMITED, NULL, CENTRE_LIGHT ENCLOSING_SPHERE(DIFFUSE("0.6")),
     0.6 / PI * 2.0 / 0.4, NULL, 0, CAVITY_RADIUS},
    /* light along the normals of a small ball is the same as that of a point, but next event does not find it */
    {"collimated ball in a sphere, all bounces", UNLIMITED, NULL, COLLIMATED_BALL ENCLOSING_SPHERE(DIFFUSE("0.6")),
     0.6 / PI * 2.0 / 0.4, NULL, NEEDS_CAUSTICS | NEEDS_LIGHT_PATHS, CAVITY_RADIUS},
    /* E = M cos(30 degrees) in all of the view */
    {"floor in a beam", DEPTH("2"), LOOK_DOWN("0.3", "0.5"), FLOOR("0.8") BEAM, 0.8 / PI * 2.0 * 0.86602540378,
     NULL, 0, 0.05f},
    {"emissive enclosing sphere", UNLIMITED, NULL, ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW), 1.0, NULL, 0,
     CAVITY_RADIUS},
    {"emissive enclosing sphere, 3 edges", DEPTH("3"), NULL, ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW), 0.5 * 1.75, NULL,
     0, CAVITY_RADIUS},
    /* a mirror in a cavity in equilibrium is invisible */
    {"the same with a mirror ball in it", UNLIMITED, NULL, ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW) BALL(MIRROR), 1.0,
     NULL, NEEDS_SPECULAR_VIEW, CAVITY_RADIUS},
    {"the same with a glass ball in it", UNLIMITED, NULL,
     ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW) BALL("<bsdf type='dielectric'/>"), 1.0, NULL, NEEDS_SPECULAR_VIEW,
     CAVITY_RADIUS},
    /* a mirror before the wall returns what the rest sends: the radiance stays Le / (1 - rho) */
    {"the same with a mirror on the wall", UNLIMITED, NULL,
     ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW) DISK("0.8", "<bsdf type='twosided'>" MIRROR "</bsdf>"), 1.0, NULL,
     NEEDS_SPECULAR_VIEW, CAVITY_RADIUS},
    /* a mask lets the cavity's light pass */
    {"the same with a half transparent disk", UNLIMITED, NULL,
     ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW)
         DISK("0.6",
              "<bsdf type='mask'><float name='opacity' value='0.5'/><bsdf type='twosided'>" MIRROR "</bsdf></bsdf>"),
     1.0, NULL, NEEDS_SPECULAR_VIEW, CAVITY_RADIUS},
    /* constant environment seen by a white ball: the furnace */
    {"white ball in a constant environment", UNLIMITED, NULL,
     "<emitter type='constant'><rgb name='radiance' value='1'/></emitter><shape type='sphere'>"
     "<point name='center' value='0,0.2,0.6'/><float name='radius' value='0.4'/>" DIFFUSE("1") "</shape>",
     1.0, NULL, 0, 0.05f},
    {"form factor of an element to a square", DEPTH("2"), LOOK_DOWN("0.001", "0.5"), FLOOR("1") SQUARE_ABOVE, 0.0,
     element_to_square, NEEDS_NARROW_VIEW, 0.0f},
    {"form factor of a square to a square", DEPTH("2"), LOOK_DOWN("1", "0.5"), FLOOR("1") SQUARE_ABOVE, 0.0,
     square_to_square, 0, 0.05f},
    {"the same under a sky", DEPTH("2"), LOOK_DOWN("1", "0.5"),
     FLOOR("1") SQUARE_ABOVE "<emitter type='constant'><rgb name='radiance' value='0.1'/></emitter>", 0.0,
     square_and_sky, 0, 0.05f},
    {"floor under a slab of glass", DEPTH("4"), LOOK_DOWN("0.3", "0.2"), FLOOR("0.8") SLAB SPOT_DOWN, 0.0, under_slab,
     NEEDS_CAUSTICS, 0.03f},
    {"floor through the same slab", DEPTH("6"), LOOK_DOWN("0.3", "0.9"), FLOOR("0.8") SLAB SPOT_DOWN, 0.0,
     through_slab, NEEDS_SDS | NEEDS_CAUSTICS, 0.03f},
    {"floor under water, seen in it", DEPTH("3"), LOOK_DOWN("0.3", "0.2"), FLOOR("0.8") WATER SPOT_DOWN, 0.0,
     under_water, NEEDS_CAUSTICS, 0.03f},
    {"the same, seen from above", DEPTH("4"), LOOK_DOWN("0.3", "0.9"), FLOOR("0.8") WATER SPOT_DOWN, 0.0,
     through_water, NEEDS_SDS | NEEDS_CAUSTICS, 0.03f},
};

const closed_form *closed_form_named(const char *name)
{
    for (size_t i = 0; i < closed_form_count(); i++)
        if (strcmp(closed_forms[i].name, name) == 0) return &closed_forms[i];
    fail_msg("no closed form is called \"%s\"", name);
    return NULL;
}

size_t closed_form_count(void) { return sizeof closed_forms / sizeof closed_forms[0]; }

const closed_form *closed_form_at(size_t index) { return &closed_forms[index]; }

double closed_form_expected(const closed_form *form) { return form->expect ? form->expect() : form->expected; }

ca_scene *closed_form_scene(const closed_form *form, size_t sensor)
{
    char text[8192];
    const int length = snprintf(text, sizeof text, "<scene version='3.0.0'>%s%s%s</scene>", form->depth,
                                form->sensor ? form->sensor : general_sensors[sensor].text, form->content);
    assert_true(length > 0 && (size_t)length < sizeof text);
    return scene_from_text(text);
}

/* ---- Integrators ----------------------------------------------------------------------------------------------- */

#define RADIUS "radius=%g,alpha=0"
/* Many light paths a block: the number of blocks grows with the square of that of camera paths, and these scenes are
 * even. As many as test_closed_forms.c's tolerance asks for, which is twice as large where builds have asserts. */
#ifdef NDEBUG
#define ALL_PAIRS "light_paths=8000,"
#else
#define ALL_PAIRS "light_paths=2000,"
#endif

static const integrator_variant variants[] = {
    {"path", NEEDS_CAUSTICS | NEEDS_SDS, 1, false},
    {"light", NEEDS_SPECULAR_VIEW | NEEDS_NARROW_VIEW | NEEDS_SDS, 1, false},
    {"bdpt:heuristic=balance", NEEDS_SDS, 1, false},
    {"bdpt:heuristic=power", NEEDS_SDS, 1, false},
    {"bdpt:light_paths=700,camera_paths=2", NEEDS_SDS, 1, false},
    {"bdpt:strategies=no-splat", NEEDS_CAUSTICS | NEEDS_SDS, 1, false},
    {"ppm:" RADIUS, NEEDS_NARROW_VIEW, 1, false},
    {"bdpm:camera_diffuse_depth=1," RADIUS, NEEDS_NARROW_VIEW, 1, false},
    {"bdpm:camera_diffuse_depth=2,merges=last," RADIUS, NEEDS_NARROW_VIEW, 1, false},
    {"vcm:heuristic=balance," RADIUS, NEEDS_NARROW_VIEW, 1, false},
    {"vcm:heuristic=power," RADIUS, NEEDS_NARROW_VIEW, 1, false},
    {"vcm:light_paths=700,camera_paths=2," RADIUS, NEEDS_NARROW_VIEW, 1, false},
    {"vcm-plus:" RADIUS, NEEDS_NARROW_VIEW, 1, false},
    {"vcm-star:" RADIUS, NEEDS_NARROW_VIEW, 1, false},
    {"ovcm:" RADIUS, NEEDS_NARROW_VIEW, 1, false},
    {"cavcm:" RADIUS, NEEDS_NARROW_VIEW, 1, false},
    {"vavcm:" RADIUS, NEEDS_NARROW_VIEW, 1, false},
    {"qmcppm:" ALL_PAIRS RADIUS, NEEDS_NARROW_VIEW, 1, true},
    {"qmcppm:camera_diffuse_depth=2,kernel=sph," ALL_PAIRS RADIUS, NEEDS_NARROW_VIEW, 1, true},
    {"qmcppm:direct=next-event," ALL_PAIRS RADIUS, NEEDS_NARROW_VIEW | NEEDS_LIGHT_PATHS, 1, true},
    {"qmcppm:join=connect,camera_paths=4,light_paths=4", NEEDS_CAUSTICS | NEEDS_SDS, 4, true},
};

size_t integrator_variant_count(void) { return sizeof variants / sizeof variants[0]; }

const integrator_variant *integrator_variant_at(size_t index) { return &variants[index]; }
