/* Eight rays of a camera at a time. Apart from camera.h, since vector types are much to compile for all that needs a
 * camera and no lanes. */
#ifndef CA_CAMERA_CAMERA_LANES_H
#define CA_CAMERA_CAMERA_LANES_H

#include "camera/camera.h"
#include "math/lanes.h"

/* Rays of ca_camera_sample_ray without densities, to the bit, of cameras with a thin lens or none: all of weight
 * 1. */
typedef struct ca_camera_rays8 {
    ca_v8 origin, direction;
    ca_f8 t_min, t_max;
} ca_camera_rays8;

static inline bool ca_camera_has_lanes(const ca_camera *camera)
{
    return camera->kind == CA_CAMERA_PERSPECTIVE || camera->kind == CA_CAMERA_THIN_LENS;
}
void ca_camera_sample_rays8(const ca_camera *camera, const ca_f8 film_position[2], const ca_f8 u_lens[2],
                            ca_camera_rays8 *rays);

#endif
