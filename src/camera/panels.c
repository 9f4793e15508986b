#include "camera/panels.h"

void ca_panels_prepare(ca_camera *camera)
{
    ca_camera_panels *panels = &camera->as.panels;
    const ca_camera *first = &panels->cameras[0];
    panels->scale_x = (float)((double)first->width * panels->count / camera->width);
    panels->scale_y = (float)((double)first->height / camera->height);
}

/* A pixel of the film is so many pixels of a panel: densities that are per pixel become those of the film's. */
static void rescale(const ca_camera_panels *panels, const ca_camera *camera, ca_pdf_area *pdf_position,
                    ca_pdf_solid_angle *pdf_direction)
{
    const float pixels = panels->scale_x * panels->scale_y;
    if (ca_camera_has_dirac_direction(camera))
        pdf_position->v /= pixels;
    else
        pdf_direction->v /= pixels;
}

/* Film positions beyond the left and the right border belong to the outer panels. */
static uint32_t panel_at(const ca_camera_panels *panels, float x)
{
    const float index = x / (float)panels->cameras[0].width;
    if (!(index > 0.0f)) return 0;
    return index < (float)panels->count ? (uint32_t)index : panels->count - 1;
}

ca_camera_ray ca_panels_ray(const ca_camera *camera, ca_vec2 film_position, ca_vec2 u_lens)
{
    const ca_camera_panels *panels = &camera->as.panels;
    const float x = film_position.x * panels->scale_x, y = film_position.y * panels->scale_y;
    const uint32_t index = panel_at(panels, x);
    const ca_camera *panel = &panels->cameras[index];
    const ca_vec2 on_panel = {x - (float)index * (float)panel->width, y};
    ca_camera_ray ray = ca_camera_sample_ray(panel, on_panel, u_lens);
    rescale(panels, panel, &ray.pdf_position, &ray.pdf_direction);
    return ray;
}

/* Does what the panel sees at x lie on it, or beyond it where no other one is? */
static bool on_panel(const ca_camera_panels *panels, uint32_t index, float x)
{
    return (index == 0 || x >= 0.0f) &&
           (index + 1 == panels->count || x < (float)panels->cameras[index].width);
}

bool ca_panels_direct(const ca_camera *camera, ca_vec3 reference, ca_vec2 u_lens, float margin,
                      ca_camera_direct *direct)
{
    const ca_camera_panels *panels = &camera->as.panels;
    const float count = (float)panels->count, choice = u_lens.x * count;
    const uint32_t chosen = (uint32_t)choice, index = chosen < panels->count ? chosen : panels->count - 1;
    const ca_camera *panel = &panels->cameras[index];
    const ca_vec2 u_panel = {choice - (float)index, u_lens.y};
    const float most = margin * (panels->scale_x > panels->scale_y ? panels->scale_x : panels->scale_y);
    if (!ca_camera_sample_direct(panel, reference, u_panel, most, direct)) return false;
    if (!on_panel(panels, index, direct->film_position.x)) return false;
    direct->film_position.x =
        (direct->film_position.x + (float)index * (float)panel->width) / panels->scale_x;
    direct->film_position.y /= panels->scale_y;
    direct->importance /= panels->scale_x * panels->scale_y;
    direct->pdf_direct.v /= count;
    rescale(panels, panel, &direct->pdf_position, &direct->pdf_direction);
    return true;
}
