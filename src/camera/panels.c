#include "camera/panels.h"

#include "math/numeric.h"

void ca_panels_prepare(ca_camera *camera)
{
    ca_camera_panels *panels = &camera->as.panels;
    const ca_camera *first = &panels->cameras[0];
    panels->scale = (float)((double)first->width * panels->count / camera->width);
}

/* A pixel of the film is so many pixels of a panel: densities that are per pixel become those of the film's. */
static void rescale(const ca_camera_panels *panels, const ca_camera *camera, ca_pdf_area *pdf_position,
                    ca_pdf_solid_angle *pdf_direction)
{
    const float pixels = panels->scale * panels->scale;
    if (ca_camera_has_dirac_direction(camera))
        pdf_position->v /= pixels;
    else
        pdf_direction->v /= pixels;
}

/* The y of a panel's film at the upper border of the whole film, whose middle is that of the panel's. */
static float top_of(const ca_camera *camera)
{
    const ca_camera_panels *panels = &camera->as.panels;
    return 0.5f * ((float)panels->cameras[0].height - (float)camera->height * panels->scale);
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
    const float x = film_position.x * panels->scale, y = top_of(camera) + film_position.y * panels->scale;
    const uint32_t index = panel_at(panels, x);
    const ca_camera *panel = &panels->cameras[index];
    const ca_vec2 on_panel = {x - (float)index * (float)panel->width, y};
    ca_camera_ray ray = ca_camera_sample_ray(panel, on_panel, u_lens);
    rescale(panels, panel, &ray.pdf_position, &ray.pdf_direction);
    return ray;
}

/* Does what the panel sees at x and y lie on its part of the film, or beyond where no other one is? */
static bool on_panel(const ca_camera *camera, uint32_t index, ca_vec2 film, float margin)
{
    const ca_camera_panels *panels = &camera->as.panels;
    const float width = (float)panels->cameras[0].width, top = top_of(camera);
    const float bottom = top + (float)camera->height * panels->scale;
    const bool last = index + 1 == panels->count;
    return film.x >= (index == 0 ? -margin : 0.0f) && (last ? film.x <= width + margin : film.x < width) &&
           film.y >= top - margin && film.y <= bottom + margin;
}

bool ca_panels_direct(const ca_camera *camera, ca_vec3 reference, ca_vec2 u_lens, float margin,
                      ca_camera_direct *direct)
{
    const ca_camera_panels *panels = &camera->as.panels;
    const float count = (float)panels->count, choice = u_lens.x * count;
    const uint32_t chosen = (uint32_t)choice, index = chosen < panels->count ? chosen : panels->count - 1;
    const ca_camera *panel = &panels->cameras[index];
    const ca_vec2 u_panel = {choice - (float)index, u_lens.y};
    const float around = margin * panels->scale, taller = ca_max(-top_of(camera), 0.0f);
    if (!ca_camera_sample_direct(panel, reference, u_panel, around + taller, direct)) return false;
    if (!on_panel(camera, index, direct->film_position, around)) return false;
    const ca_vec2 film = {direct->film_position.x + (float)index * (float)panel->width,
                          direct->film_position.y - top_of(camera)};
    direct->film_position = (ca_vec2){film.x / panels->scale, film.y / panels->scale};
    direct->importance /= panels->scale * panels->scale;
    direct->pdf_direct.v /= count;
    rescale(panels, panel, &direct->pdf_position, &direct->pdf_direction);
    return true;
}
