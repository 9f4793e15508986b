/* Sensors: rays from film positions, and film positions from points of the scene.
 *
 * Frame: the camera looks along +z, +y is up, +x is to the *left* of the picture. Film positions are in pixels of the
 * full film, (0, 0) is the upper left corner, x to the right and y down.
 *
 * Importance We is normalised so that the pixel's value is the integral of We L cos over lens, directions (and film
 * area for the orthographic one) with the pixel's filter: for a perspective camera and a film position density of one
 * per pixel, We cos = pdf_lens pdf_direction, so a camera path starts with the weight 1; but for the realistic one
 * (realistic.h), whose picture is darker where less light gets through the lens.
 * Densities:
 *     pdf_position   of the ray's origin: thin lens per area of the lens; orthographic per area of one pixel's
 *                    footprint; pinhole: 1, Dirac; realistic: of the entrance disk, as splats choose it
 *     pdf_direction  per solid angle, for a film position uniform in *one* pixel (1 / solid angle of the pixel at
 *                    this direction); orthographic: 1, Dirac; realistic: what makes the product the density of the
 *                    ray
 * so that each pixel is a sensor of its own. A whole-image density is this divided by the number of pixels. */
#ifndef CA_CAMERA_CAMERA_H
#define CA_CAMERA_CAMERA_H

#include "base/status.h"
#include "camera/realistic.h"
#include "math/measure.h"
#include "math/rgb.h"
#include "math/transform.h"

typedef enum ca_camera_kind {
    CA_CAMERA_PERSPECTIVE,
    CA_CAMERA_THIN_LENS,
    CA_CAMERA_ORTHOGRAPHIC,
    CA_CAMERA_REALISTIC,
    CA_CAMERA_PANELS, /* several of the others, side by side on one film (panels.h) */
    CA_CAMERA_KIND_COUNT
} ca_camera_kind;

/* Of one size; prepared, and none of them panels again. */
typedef struct ca_camera_panels {
    const struct ca_camera *cameras; /* borrowed, from left to right */
    uint32_t count;
    float scale; /* sides of their pixels along one of the whole film's; made by ca_camera_prepare */
} ca_camera_panels;

typedef struct ca_camera {
    ca_camera_kind kind;
    ca_affine map;              /* camera -> world; rigid but for the orthographic one */
    uint32_t width, height;     /* of the full film */
    float near_clip, far_clip;  /* along z */
    float principal_x, principal_y; /* principal point's offset, as a fraction of width and height */
    bool is_disk;                   /* an orthographic one's: its one pixel is the disk in camera space's square */
    union {                         /* the member of the kind's name */
        struct {
            float tan_half_x; /* of the full film's horizontal field of view */
        } perspective;
        struct {
            float tan_half_x;                  /* likewise */
            float lens_radius, focus_distance; /* radius 0: a pinhole */
        } thin_lens;
        struct {
            float area_scale; /* world area per camera-space area; made by ca_camera_prepare */
        } orthographic;
        ca_realistic realistic;
        ca_camera_panels panels;
    } as;

    /* Made by ca_camera_prepare. The film's image lies on the plane z = 1 of camera space, the orthographic one's on
     * z = 0; the realistic one's film itself lies behind the lens, upside down, and lengths on it are in mm. */
    float pixel_width, pixel_height; /* of a pixel there */
    float left, top;                 /* x and y of film position (0, 0) there */
} ca_camera;

/* Which side of the film the field of view is measured along; "diagonal" likewise. */
typedef enum ca_fov_axis { CA_FOV_X, CA_FOV_Y, CA_FOV_DIAGONAL, CA_FOV_SMALLER, CA_FOV_LARGER } ca_fov_axis;
/* tan of half the horizontal field of view, from one along `axis` in degrees in (0, 180). */
double ca_camera_tan_half_x(double fov_degrees, ca_fov_axis axis, uint32_t width, uint32_t height);

void ca_camera_prepare(ca_camera *camera);

typedef struct ca_camera_ray {
    ca_vec3 origin, direction;
    float t_min, t_max; /* where the ray passes the near and the far clip plane */
    ca_rgb weight;      /* 1, but for vignetting; 0: the lens lets nothing through, and there is no ray */
    ca_pdf_area pdf_position;
    ca_pdf_solid_angle pdf_direction;
    float cos_camera; /* between the direction and the camera's axis */
    const ca_camera *camera; /* that made it: of panels the one at the film position, otherwise the camera itself */
} ca_camera_ray;

ca_camera_ray ca_camera_sample_ray(const ca_camera *camera, ca_vec2 film_position, ca_vec2 u_lens);

/* A splat: a point of the lens for `reference`. The contribution to the image at film_position is
 * f |cos| importance / pdf_direct.v; with the film's filter normalised to an integral of one pixel. */
typedef struct ca_camera_direct {
    ca_vec3 position;  /* on the lens */
    ca_vec3 to_camera; /* unit, from the reference */
    float distance;    /* from the reference to `position` */
    float t_near;      /* along the connection, from the reference: the near clip plane; nothing blocks beyond */
    ca_vec2 film_position;
    float importance;              /* We as above; pinhole: per distance^2, pdf_direct 1 */
    ca_pdf_solid_angle pdf_direct; /* of to_camera as seen from the reference, per solid angle there */
    ca_pdf_area pdf_position;      /* as a camera path of that pixel would have started there ... */
    ca_pdf_solid_angle pdf_direction; /* ... and have gone to the reference */
    float cos_camera;
    const ca_camera *camera; /* as of ca_camera_ray */
} ca_camera_direct;

/* false: outside of the film (of its full size, widened by `margin` pixels for the filter) or of the clip planes, or
 * the lens lets nothing through. */
bool ca_camera_sample_direct(const ca_camera *camera, ca_vec3 reference, ca_vec2 u_lens, float margin,
                             ca_camera_direct *direct);

/* Sets the horizontal field of view (and means nothing to a camera without one). */
void ca_camera_set_tan_half_x(ca_camera *camera, float tan_half_x);

/* Is u_lens used? */
bool ca_camera_has_lens(const ca_camera *camera);
/* Moves it back along its axis until all within the sphere lies in front of it, on no clip plane's wrong side. */
void ca_camera_move_out(ca_camera *camera, ca_vec3 center, float radius);
/* As large as the sphere seen along its axis, in front of it; orthographic. */
void ca_camera_cover(ca_camera *camera, ca_vec3 center, float radius);

/* Does the camera have a field of view in degrees? */
bool ca_camera_has_field_of_view(const ca_camera *camera);
/* Of the camera of a ray: panels may differ. */
bool ca_camera_has_dirac_position(const ca_camera *camera);  /* pinhole */
bool ca_camera_has_dirac_direction(const ca_camera *camera); /* orthographic */
/* One, but for panels. A point of the scene is joined with one of them, chosen at random. */
uint32_t ca_camera_count(const ca_camera *camera);

#endif
