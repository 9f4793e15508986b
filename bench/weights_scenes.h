/* The scenes on which variance-aware weights are compared with all others, and the methods. */
#ifndef CA_BENCH_WEIGHTS_SCENES_H
#define CA_BENCH_WEIGHTS_SCENES_H

#include <stdbool.h>

enum { WEIGHTS_PATH, WEIGHTS_BDPT, WEIGHTS_NO_SPLAT, WEIGHTS_FIRST_MERGING, WEIGHTS_VAVCM = 8, WEIGHTS_METHODS };

/* `integrator`: room for parameters of those that merge must be made behind it. */
typedef struct weights_method {
    const char *name, *integrator;
} weights_method;
extern const weights_method weights_methods[WEIGHTS_METHODS];

typedef struct weights_scene {
    const char *name, *file;
    bool shared; /* file: within the folder of shared scenes, else within the project's scenes */
} weights_scene;
enum { WEIGHTS_SCENES = 16 };
extern const weights_scene weights_scenes[WEIGHTS_SCENES];

/* false, and it is said: it is not there. */
bool weights_scene_find(const weights_scene *scene, char path[1024]);

#endif
