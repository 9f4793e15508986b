#include "weights_scenes.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

const weights_method weights_methods[WEIGHTS_METHODS] = {
    {"path", "path"},
    {"bdpt", "bdpt"},
    {"bdpt, no splats", "bdpt:strategies=no-splat"},
    {"vcm", "vcm"},
    {"vcm-plus", "vcm-plus"},
    {"vcm-star", "vcm-star"},
    {"ovcm", "ovcm"},
    {"cavcm", "cavcm"},
    {"vavcm", "vavcm"},
};

const weights_scene weights_scenes[WEIGHTS_SCENES] = {
    {"bare wall", "weights/bare-wall.xml", false},
    {"Cornell box", "cornell-box/cornell-box.xml", false},
    {"mirror and glass", "speed/cornell-spheres.xml", false},
    {"caustics", "caustics/caustics.xml", false},
    {"lens", "weights/lens.xml", false},
    {"glass slab", "glass-slab/glass-slab.xml", false},
    {"pool", "paper-000/water-caustic.xml", false},
    {"mirror room", "paper-004/mirror-room.xml", false},
    {"rough metal", "weights/rough-metal.xml", false},
    {"rough glass", "rough-glass/rough-glass.xml", false},
    {"light through a gap", "weights/door.xml", false},
    {"long diffuse", "long-diffuse/long-diffuse.xml", false},
    {"small light, far", "small-light-far/small-light-far.xml", false},
    {"wide lens", "depth-of-field/depth-of-field.xml", false},
    {"Veach's room", "veach-bidir/scene.xml", true},
    {"water caustic", "water-caustic/scene.xml", true},
};

bool weights_scene_find(const weights_scene *scene, char path[1024])
{
    const char *shared = getenv("CAUSTICA_SCENES");
    if (!shared) shared = CA_SOURCE_DIR "/../shared/scenes";
    snprintf(path, 1024, "%s/%s", scene->shared ? shared : CA_SOURCE_DIR "/scenes", scene->file);
    if (access(path, R_OK) == 0) return true;
    fprintf(stderr, "SKIPPED: %s is not there%s\n", path,
            scene->shared ? " (CAUSTICA_SCENES names the folder of shared scenes)" : "");
    return false;
}
