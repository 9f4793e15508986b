#define _POSIX_C_SOURCE 200809L
#include "support/small_render.h"

#include "integrator/integrator.h"
#include "support/scene_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

const char *const scene_xml =
    "<scene version='3.0.0'><default name='grey' value='0.5'/>"
    "<sensor type='perspective'><float name='fov' value='40'/>"
    "<transform name='to_world'><lookat origin='0,3,6' target='0,0.5,0' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='6'/></film></sensor>"
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='3'/></transform>"
    "<bsdf type='diffuse'><rgb name='reflectance' value='$grey'/></bsdf></shape>"
    "<shape type='sphere'><point name='center' value='0,0.6,0'/><float name='radius' value='0.6'/>"
    "<bsdf type='dielectric'/></shape>"
    "<shape type='sphere'><point name='center' value='1,3,0'/><float name='radius' value='0.2'/>"
    "<emitter type='area'><rgb name='radiance' value='30'/></emitter></shape></scene>";

ca_scene *scene;

static char folder[] = "/tmp/caustica-renders-XXXXXX";

int begin_small_renders(void **state)
{
    (void)state;
    if (!mkdtemp(folder)) return -1;
    FILE *stream = fopen(file("scene.xml"), "w");
    if (!stream) return -1;
    const bool written = fputs(scene_xml, stream) >= 0;
    if (fclose(stream) != 0 || !written) return -1;
    return ca_scene_load(file("scene.xml"), NULL, 0, &scene, NULL) == CA_OK ? 0 : -1;
}

int end_small_renders(void **state)
{
    (void)state;
    char command[64];
    ca_scene_release(scene);
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

const char *file(const char *name)
{
    static char paths[64][256];
    char path[256];
    int i = 0;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    while (paths[i][0] && strcmp(paths[i], path) != 0) assert_true(++i < 64);
    return memcpy(paths[i], path, sizeof path);
}

ca_render_settings settings_of(const char *integrator, uint32_t samples, uint32_t threads)
{
    ca_render_settings s;
    ca_render_settings_init(&s);
    s.integrator = integrator;
    s.samples_per_pixel = samples;
    s.threads = threads;
    s.has_max_depth = true;
    s.max_depth = 4;
    /* So that it need not be looked for. */
    if (ca_integrator_of(integrator) && ca_integrator_has_parameter(ca_integrator_of(integrator), "radius"))
        s.radius = 0.1;
    return s;
}

uint64_t render(const ca_render_settings *settings, ca_render_statistics *statistics)
{
    ca_image_layers *image = NULL;
    ca_error error = {""};
    if (ca_render(scene, settings, &image, statistics, &error) != CA_OK) fail_msg("%s", error.message);
    const uint64_t hash = image_hash(image);
    ca_image_release(image);
    return hash;
}

const char *integrator_at(size_t i)
{
    const ca_integrator_type *type = ca_integrator_at(i);
    return type ? type->name : NULL;
}

bool chooses(size_t i) { return ca_integrator_has(ca_integrator_at(i), CA_ABILITY_CHOOSES); }
