/* Several cameras whose pictures lie side by side on one film, as those of Mitsuba's batch: all as wide as the film's
 * part for each. A ray belongs to the camera of its film position; a splat joins with one of them, all being equally
 * likely, so that its pdf_direct is the camera's own divided by their number. On a film of another size than the
 * cameras were prepared for each sees as much from side to side, and more or less above and below. Densities are then
 * those of a pixel of that film. */
#ifndef CA_CAMERA_PANELS_H
#define CA_CAMERA_PANELS_H

#include "camera/camera.h"

/* The camera's width and height are known. */
void ca_panels_prepare(ca_camera *camera);
/* As ca_camera_sample_ray and ca_camera_sample_direct. */
ca_camera_ray ca_panels_ray(const ca_camera *camera, ca_vec2 film_position, ca_vec2 u_lens);
bool ca_panels_direct(const ca_camera *camera, ca_vec3 reference, ca_vec2 u_lens, float margin,
                      ca_camera_direct *direct);

#endif
