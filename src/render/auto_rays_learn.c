/* What iterations have told of the noise, of either kind: for each pixel, or where paths connect for the image. */
#include "base/memory.h"
#include "render/auto_rays_state.h"

ca_status ca_auto_pairs_create(const ca_auto_rays *a, uint32_t light_paths, uint32_t camera_paths,
                               ca_pair_film *pairs, ca_error *error)
{
    ca_pair_numbers others[CA_AUTO_MOST_OTHERS];
    CA_TRY(ca_pair_film_create_means(pairs, a->plan->crop, error));
    pairs->light_paths = light_paths;
    if (!ca_auto_connects(a)) return CA_OK;
    const uint32_t count =
        ca_auto_nodes_others(a->ordinary.numbers.light_paths, light_paths, camera_paths, others);
    if (count > 0) CA_TRY(ca_pair_film_add_others(pairs, others, count, error));
    return ca_pair_film_connect(pairs, error);
}

ca_status ca_auto_known_create(ca_auto_rays *a, ca_error *error)
{
    const size_t pixels = ca_auto_pixels(a);
    if (ca_auto_connects(a)) return ca_auto_nodes_create(&a->nodes, pixels, a->ordinary.numbers.light_paths, error);
    a->known = ca_alloc_zeroed(pixels, sizeof *a->known);
    return a->known ? CA_OK : ca_fail_memory(error, "the numbers of rays");
}

void ca_auto_forget(ca_auto_rays *a)
{
    if (!a->known) {
        ca_auto_nodes_clear(&a->nodes);
        return;
    }
    for (size_t i = 0; i < ca_auto_pixels(a); i++) a->known[i] = (ca_auto_known){0};
}

void ca_auto_learn(ca_auto_rays *a, const ca_pair_film *pairs, uint32_t iterations)
{
    const ca_auto_gathered gathered = {.pairs = pairs,
                                       .iterations = iterations,
                                       .light_paths = a->numbers.light_paths,
                                       .camera_paths = a->numbers.camera_paths,
                                       .one_camera_path = ca_auto_one_camera_path(a)};
    if (a->known)
        ca_auto_known_add(a->known, &gathered);
    else
        ca_auto_nodes_add(&a->nodes, &gathered, a->plan->objective);
}
