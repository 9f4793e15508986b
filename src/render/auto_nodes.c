#include "render/auto_nodes.h"

#include "base/memory.h"

#include <math.h>

/* Of N_F from node to node; a run reaches so many nodes to each side. */
enum { NODE_STEP = 4, NODE_REACH = 2 };

/* ---- Life ------------------------------------------------------------------------------------------------------ */

ca_status ca_auto_nodes_create(ca_auto_nodes *nodes, size_t pixels, double first, ca_error *error)
{
    *nodes = (ca_auto_nodes){.first = first, .pixels = pixels};
    nodes->weights = ca_alloc_zeroed(pixels, sizeof *nodes->weights);
    nodes->plane = ca_alloc(pixels, sizeof *nodes->plane);
    return nodes->weights && nodes->plane ? CA_OK : ca_fail_memory(error, "the numbers of rays");
}

void ca_auto_nodes_destroy(ca_auto_nodes *nodes)
{
    ca_free(nodes->weights);
    ca_free(nodes->plane);
    *nodes = (ca_auto_nodes){0};
}

void ca_auto_nodes_clear(ca_auto_nodes *nodes)
{
    nodes->weighted = false;
    nodes->count = 0;
    nodes->luminance = nodes->pairs = 0.0;
}

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

uint32_t ca_auto_nodes_others(double first, uint32_t light_paths, uint32_t camera_paths,
                              ca_pair_numbers others[CA_AUTO_MOST_OTHERS])
{
    uint32_t count = 0;
    const double least = light_paths * pow(NODE_STEP, -NODE_REACH), most = light_paths * pow(NODE_STEP, NODE_REACH);
    const double low = fmax(ceil(log2(fmax(least, 2.0) / first) / log2(NODE_STEP) - 1e-9), -15.0);
    for (int k = 0; k <= 2 * NODE_REACH && count < CA_AUTO_MOST_OTHERS; k++) {
        const double number = round(first * pow(NODE_STEP, low + k));
        if (number > most * (1.0 + 1e-9) || number > CA_RAY_MOST_LIGHT_PATHS_HELD) break;
        if (number < 2.0 || number < camera_paths || (uint32_t)number == light_paths) continue;
        others[count++] = (ca_pair_numbers){(uint32_t)number, camera_paths};
    }
    return count;
}

/* Is it the pilot's number times a power of 4? */
static bool is_node(const ca_auto_nodes *nodes, uint32_t light_paths)
{
    const double power = round(log2(light_paths / nodes->first) / log2(NODE_STEP));
    return round(nodes->first * pow(NODE_STEP, power)) == (double)light_paths;
}

/* The node of so many light paths, which is made where it is missing; NULL: there is no room. */
static ca_auto_node *node_of(ca_auto_nodes *nodes, uint32_t light_paths)
{
    uint32_t at = 0;
    while (at < nodes->count && nodes->items[at].light_paths < light_paths) at++;
    if (at < nodes->count && nodes->items[at].light_paths == (double)light_paths) return &nodes->items[at];
    if (nodes->count == CA_AUTO_MOST_NODES) return NULL;
    for (uint32_t i = nodes->count++; i > at; i--) nodes->items[i] = nodes->items[i - 1];
    nodes->items[at] = (ca_auto_node){.light_paths = light_paths};
    return &nodes->items[at];
}

/* ---- Adding ---------------------------------------------------------------------------------------------------- */

/* As ray_numbers.h has them. */
static void set_weights(ca_auto_nodes *nodes, const ca_auto_gathered *g, ca_ray_objective objective)
{
    const ca_pair_film *film = g->pairs;
    for (size_t p = 0; p < nodes->pixels; p++)
        nodes->plane[p] = ca_noise_excess_of(&film->means[p], g->iterations).luminance2;
    ca_ray_weights(film->width, film->height, CA_AUTO_SMOOTHING, objective, nodes->plane, nodes->weights);
    nodes->weighted = true;
}

static void add_node(ca_auto_nodes *nodes, const ca_pair_film *film, uint32_t iterations, double pairs)
{
    ca_auto_node *node = node_of(nodes, film->light_paths);
    ca_noise_coefficients mean = {0}, objective = {0};
    if (!node) return;
    for (size_t p = 0; p < nodes->pixels; p++) {
        const ca_noise_coefficients c = ca_noise_coefficients_of(film, iterations, p);
        ca_noise_coefficients_add(&mean, &c, 1.0 / (double)nodes->pixels);
        ca_noise_coefficients_add(&objective, &c, nodes->weights[p]);
    }
    const double share = pairs / (node->pairs + pairs);
    ca_noise_coefficients_mix(&node->mean, &mean, share);
    ca_noise_coefficients_mix(&node->objective, &objective, share);
    node->pairs += pairs;
}

void ca_auto_nodes_add(ca_auto_nodes *nodes, const ca_auto_gathered *g, ca_ray_objective objective)
{
    const double pairs = (double)g->iterations * g->light_paths * g->camera_paths[0];
    double luminance = 0.0;
    if (g->iterations < 2 || g->camera_paths[0] < 2) return;
    if (!nodes->weighted) set_weights(nodes, g, objective);
    for (size_t p = 0; p < nodes->pixels; p++)
        luminance += g->pairs->means[p].sums[CA_PAIR_VALUE] / g->iterations / (double)nodes->pixels;
    nodes->pairs += pairs;
    nodes->luminance += (luminance - nodes->luminance) * pairs / nodes->pairs;
    if (is_node(nodes, g->light_paths)) add_node(nodes, g->pairs, g->iterations, pairs);
    for (uint32_t i = 0; i < g->pairs->other_count; i++)
        add_node(nodes, &g->pairs->others[i], g->iterations, pairs);
}

/* ---- What they tell -------------------------------------------------------------------------------------------- */

uint32_t ca_auto_nodes_list(const ca_auto_nodes *nodes, bool objective, ca_connected_node list[CA_AUTO_MOST_NODES])
{
    for (uint32_t i = 0; i < nodes->count; i++) {
        const ca_auto_node *node = &nodes->items[i];
        list[i] = (ca_connected_node){node->light_paths, objective ? node->objective : node->mean};
    }
    return nodes->count;
}

double ca_auto_nodes_relative_variance(const ca_auto_nodes *nodes, double light_paths, double camera_paths)
{
    ca_connected_node list[CA_AUTO_MOST_NODES];
    const ca_connected_image image = {.nodes = list, .node_count = ca_auto_nodes_list(nodes, false, list)};
    if (image.node_count == 0 || !(nodes->luminance > 0.0)) return (double)NAN;
    return ca_connected_expect(&image, light_paths, camera_paths).variance / (nodes->luminance * nodes->luminance);
}
