/* Fuzzer of checkpoints of renders with rays "auto", which are of two pixels and two threads here. */
#define _GNU_SOURCE
#include "base/memory.h"
#include "memory_file.h"
#include "render/auto_rays_state.h"
#include "sealed_part.h"

#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { WIDTH = 2, HEIGHT = 1, THREADS = 2 };
static char settings[] = "film 2x1\n", choices[] = "objective mean\n";

static void destroy(ca_auto_rays *a, ca_auto_pilot *pilot, ca_auto_work_film *work)
{
    ca_auto_pilot_destroy(pilot);
    ca_auto_work_destroy(work);
    ca_auto_record_destroy(&a->record);
    ca_auto_record_destroy(&a->script);
    ca_halved_film_destroy(&a->pilot);
    ca_joined_film_destroy(&a->render);
    ca_ray_times_destroy(a->times);
    ca_free(a->known);
}

static void read_it(const char *path)
{
    uint32_t camera_paths[WIDTH * HEIGHT] = {0}, first[WIDTH * HEIGHT] = {0};
    ca_render_plan plan = {.type = ca_integrator_of("bdpm"), .crop = {0, 0, WIDTH, HEIGHT}, .threads = THREADS};
    ca_auto_rays a = {.plan = &plan,
                      .frame = {.width = WIDTH, .height = HEIGHT, .full_width = WIDTH, .full_height = HEIGHT},
                      .numbers.camera_paths = camera_paths,
                      .next.camera_path = first,
                      .kept = {.settings = settings, .choices = choices}};
    ca_auto_pilot pilot = {.seconds = 0.0};
    ca_auto_work_film work = {.iterations = 0};
    ca_auto_place place = {.pilot = &pilot, .work = &work};
    ca_error error = {{0}};
    const ca_status status = ca_auto_file_read(&a, &place, path, &error);
    if (status != CA_OK && !error.message[0]) abort();
    if (status == CA_OK && place.stage == CA_AUTO_AT_RUN) (void)ca_auto_look(&a);
    if (ca_auto_script_read(&a, path, &error) != CA_OK && status == CA_OK &&
        a.iterations >= CA_PILOT_HALVES)
        abort(); /* what can be gone on from can be repeated */
    destroy(&a, &pilot, &work);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    uint8_t *copy = sealed_part(data, size);
    if (!copy) return 0;
    read_it(memory_file(copy, size));
    free(copy);
    return 0;
}
