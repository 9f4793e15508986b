/* Light sources: what they emit, and sampling them from a point of the scene (next event) or on their own (light
 * paths).
 *
 * Units: radiance W sr^-1 m^-2; point, spot and projector: radiant intensity W sr^-1; directional: irradiance W m^-2
 * on a surface facing it; beam: exitance W m^-2. Directions called `direction` leave the light; directions called
 * `to_light` go towards it.
 *
 * Densities, all without the probability of choosing this light among others:
 *     pdf_direct     of the direction to the light as seen from a reference point, per solid angle *there*
 *     pdf_position   of the emitted ray's origin: area lights and beams per area of the light; directional and
 *                    environment per area of the disk across the direction that covers the scene's bounding sphere
 *                    (emission_guide.h has others)
 *     pdf_direction  of the emitted direction given the origin, per solid angle
 * A Dirac part has the number 1 (its discrete probability), flagged by dirac_position (point, spot, projector) or
 * dirac_direction (directional, beam).
 *
 * For infinite lights `distance` is CA_INFINITE_DISTANCE and position lies outside of the scene. Lights are immutable
 * and shared by all threads. */
#ifndef CA_LIGHT_LIGHT_H
#define CA_LIGHT_LIGHT_H

#include "geometry/shape.h"
#include "material/texture.h"
#include "sampling/distribution.h"

typedef enum ca_light_kind {
    CA_LIGHT_AREA,
    CA_LIGHT_BEAM, /* a surface that shines along its normals only */
    CA_LIGHT_POINT,
    CA_LIGHT_SPOT,
    CA_LIGHT_DIRECTIONAL,
    CA_LIGHT_PROJECTOR,
    CA_LIGHT_CONSTANT, /* environment of one radiance */
    CA_LIGHT_ENVMAP,   /* environment from a latitude-longitude image */
    CA_LIGHT_KIND_COUNT
} ca_light_kind;

/* How the intensity of a spot falls from its beam to its cutoff. */
typedef enum ca_spot_falloff {
    CA_FALLOFF_LINEAR,  /* in the angle, Mitsuba's */
    CA_FALLOFF_SMOOTH,  /* t^2 (3 - 2 t), t linear in the cosine: pbrt-v4's */
    CA_FALLOFF_QUARTIC, /* t^4: pbrt-v3's */
    CA_FALLOFF_COUNT
} ca_spot_falloff;

typedef struct ca_light {
    ca_light_kind kind;
    union { /* the member of the kind's name */
        struct {
            const ca_shape *shape;  /* borrowed from the scene */
            ca_texture_id radiance; /* CA_NONE: 1 */
        } area;
        struct {
            const ca_shape *shape;  /* borrowed from the scene */
            ca_texture_id exitance; /* CA_NONE: 1 */
            bool is_flat;           /* ca_shape_is_flat */
        } beam;
        struct {
            ca_vec3 position; /* world, here and below */
            ca_rgb intensity;
        } point;
        struct {
            ca_affine map; /* light -> world, rigid; z is the axis */
            ca_vec3 position;
            ca_rgb intensity;
            ca_texture_id texture; /* factor over the beam, or CA_NONE */
            float cutoff, beam;    /* radians: no light outside of the first, full light inside of the second */
            ca_spot_falloff falloff;
        } spot;
        struct {
            ca_vec3 direction; /* the way the light travels */
            ca_rgb irradiance;
        } directional;
        struct {
            ca_affine map; /* light -> world, rigid */
            ca_vec3 position;
            ca_texture_id picture; /* or CA_NONE: white */
            ca_rgb scale;
            float tan_half_x, tan_half_y; /* half its field of view */
            ca_distribution_2d pixels;    /* by luminance and solid angle */
        } projector;
        struct {
            ca_rgb radiance;
        } constant;
        struct {
            ca_affine map;         /* light -> world, of which only the rotation matters */
            const ca_image *image; /* borrowed; row 0 is +y of the light's frame */
            ca_rgb scale;
            ca_distribution_2d cells; /* between pixels, by luminance and solid angle */
        } envmap;
    } as;
    const ca_texture *textures; /* borrowed from the scene */
    ca_vec3 scene_center;       /* bounding sphere of the scene */
    float scene_radius;
    float power; /* W, luminance: for choosing among lights */
} ca_light;

#define CA_INFINITE_DISTANCE INFINITY

/* Precomputes power, bounds and tables. Called after all shapes are compiled. */
ca_status ca_light_prepare(ca_light *light, ca_vec3 scene_center, float scene_radius, ca_error *error);
void ca_light_release(ca_light *light);

bool ca_light_is_infinite(const ca_light *light); /* directional, constant, envmap */
bool ca_light_falls_off(const ca_light *light);   /* with distance: neither infinite nor a beam */
bool ca_light_has_next_event(const ca_light *light); /* all but curved beams */
bool ca_light_has_dirac_position(const ca_light *light);
bool ca_light_has_dirac_direction(const ca_light *light);

/* Next event: a point of the light for `reference`.
 * The contribution to a reflection is f |cos| radiance / pdf_direct.v. */
typedef struct ca_light_direct {
    ca_vec3 to_light; /* unit, from the reference */
    float distance;
    ca_vec3 position, position_error, ng; /* of the point on the light; ng and error zero where it has no surface */
    ca_rgb radiance;                      /* Dirac position: intensity / distance^2; directional, beam: irradiance */
    ca_pdf_solid_angle pdf_direct;        /* 1 where the light is a Dirac seen from here */
    ca_pdf_area pdf_position;             /* as a light path would have started there ... */
    ca_pdf_solid_angle pdf_direction;     /* ... and have gone to the reference */
    float cos_light;                      /* |to_light . ng|; 1 where the light has no surface */
    float next_event_ratio;               /* as ca_light_next_event_ratio */
} ca_light_direct;

/* false: no light gets there. */
bool ca_light_sample_direct(const ca_light *light, ca_vec3 reference, ca_vec2 u, ca_light_direct *direct);

/* The same for a point of an area light that was chosen by area; without the radiance. */
bool ca_light_direct_to_surface(const ca_surface *point, ca_pdf_area pdf_position, ca_vec3 reference,
                                ca_light_direct *direct);

/* A light path's first ray. Its flux is radiance cos_light / (pdf_position pdf_direction). */
typedef struct ca_light_emission {
    ca_vec3 origin, origin_error, ng; /* ng zero where the light has no surface */
    ca_vec3 direction;
    ca_rgb radiance; /* Dirac position: intensity; directional: irradiance; beam: exitance */
    ca_pdf_area pdf_position;
    ca_pdf_solid_angle pdf_direction;
    float cos_light; /* 1 where the light has no surface */
} ca_light_emission;

bool ca_light_sample_emission(const ca_light *light, ca_vec2 u_position, ca_vec2 u_direction,
                              ca_light_emission *emission);

/* The same in two steps, of lights at a finite place whose directions are no Dirac ones (area, point, spot): where
 * the ray starts, and what goes into a direction that the caller chooses. */
bool ca_light_can_be_aimed(const ca_light *light);
/* Sets the origin, ng and pdf_position. */
void ca_light_start_emission(const ca_light *light, ca_vec2 u_position, ca_light_emission *emission);
/* Sets the rest; pdf_direction is that of ca_light_sample_emission. false: no light goes there. */
bool ca_light_emission_towards(const ca_light *light, ca_vec3 direction, ca_light_emission *emission);

/* What a path that happened to hit the light sees, and with which densities the light's own techniques would have
 * made the same: for area lights the surface hit and the direction from it back along the path; for environments the
 * direction only (surface NULL). `reference` is the path's previous vertex. */
typedef struct ca_light_hit {
    ca_rgb radiance;
    ca_pdf_solid_angle pdf_direct;
    ca_pdf_area pdf_position;
    ca_pdf_solid_angle pdf_direction;
    float next_event_ratio; /* as ca_light_next_event_ratio */
} ca_light_hit;

ca_light_hit ca_light_eval_hit(const ca_light *light, ca_vec3 reference, const ca_surface *surface,
                               ca_vec3 direction);

/* The density of choosing a point of the light (geometric normal ng) by next event from `reference` over that of a
 * light path's starting there, in one measure and without the choice of the light: 1 but for surfaces that are
 * sampled by the solid angle under which they are seen, and 0 for curved beams, which next event does not find. */
float ca_light_next_event_ratio(const ca_light *light, ca_vec3 reference, ca_vec3 position, ca_vec3 ng);

/* The light leaving `surface` (area) or arriving from infinity (environment, surface NULL) along `direction`,
 * alone. */
ca_rgb ca_light_radiance(const ca_light *light, const ca_surface *surface, ca_vec3 direction);

#endif
