#include "light/light_tree.h"

#include "base/memory.h"
#include "light/light_bounds.h"
#include "math/numeric.h"

#include <assert.h>

enum { WIDTH = CA_LIGHT_TREE_WIDTH, BINS = 12 };

/* ---- Asking ---------------------------------------------------------------------------------------------------- */

/* cos and sin of max(a - b, 0) for angles in [0, pi]. */
static inline float cos_less(float cos_a, float sin_a, float cos_b, float sin_b)
{
    return cos_a > cos_b ? 1.0f : cos_a * cos_b + sin_a * sin_b;
}

static inline float sin_less(float cos_a, float sin_a, float cos_b, float sin_b)
{
    return cos_a > cos_b ? 0.0f : sin_a * cos_b - cos_a * sin_b;
}

static inline float sine_of(float cosine) { return sqrtf(ca_max(1.0f - cosine * cosine, 0.0f)); }

/* What the children may contribute, up to a factor, and the sum. Angles that depend on where in the child's sphere
 * the light is are the most favourable ones; inside of the sphere every angle is 0. Without branches, so that the
 * compiler computes them all at once. */
static inline float weigh(const ca_light_tree_node *node, const ca_light_receiver *receiver, float weights[WIDTH])
{
    const ca_vec3 p = receiver->position, n = receiver->normal;
    const float all_around = n.x == 0.0f && n.y == 0.0f && n.z == 0.0f ? 1.0f : 0.0f;
    for (int i = 0; i < WIDTH; i++) {
        const float x = node->x[i] - p.x, y = node->y[i] - p.y, z = node->z[i] - p.z;
        const float distance2 = ca_max(x * x + y * y + z * z, FLT_MIN), inverse = 1.0f / sqrtf(distance2);
        const float sin2 = ca_min(node->radius2[i] / distance2, 1.0f);
        const float sin_size = sqrtf(sin2), cos_size = sin2 < 1.0f ? sqrtf(1.0f - sin2) : -1.0f;
        const float cos_axis =
            ca_clamp(-(node->axis_x[i] * x + node->axis_y[i] * y + node->axis_z[i] * z) * inverse, -1.0f, 1.0f);
        const float sin_axis = sine_of(cos_axis);
        const float cos_near = cos_less(cos_axis, sin_axis, node->cos_normal[i], node->sin_normal[i]);
        const float sin_near = sin_less(cos_axis, sin_axis, node->cos_normal[i], node->sin_normal[i]);
        const float cos_light = cos_less(cos_near, sin_near, cos_size, sin_size);
        const float cos_in = ca_clamp((n.x * x + n.y * y + n.z * z) * inverse, -1.0f, 1.0f);
        const float cos_receiver = ca_max(cos_less(cos_in, sine_of(cos_in), cos_size, sin_size), all_around);
        const float shines = cos_light > node->cos_emission[i] && cos_receiver > 0.0f ? 1.0f : 0.0f;
        weights[i] =
            shines * node->intensity[i] * cos_light * cos_receiver / ca_max(distance2, node->radius2[i]);
    }
    float sum = 0.0f;
    for (int i = 0; i < WIDTH; i++) sum += weights[i];
    return sum;
}

uint32_t ca_light_tree_sample(const ca_light_tree *tree, const ca_light_receiver *receiver, float u,
                              float *probability)
{
    *probability = 0.0f;
    float product = 1.0f;
    uint32_t at = tree->node_count > 0 ? 0 : CA_NONE;
    while (at < CA_LIGHT_TREE_LEAF) {
        const ca_light_tree_node *node = &tree->nodes[at];
        float weights[WIDTH];
        const float sum = weigh(node, receiver, weights);
        if (!(sum > 0.0f) || !isfinite(sum)) return CA_NONE;
        const float target = u * sum;
        float below = 0.0f;
        int chosen = -1;
        for (int i = 0; i < WIDTH; i++) {
            if (!(weights[i] > 0.0f)) continue;
            if (chosen >= 0 && target < below + weights[chosen]) break;
            if (chosen >= 0) below += weights[chosen];
            chosen = i;
        }
        u = ca_clamp((target - below) / weights[chosen], 0.0f, CA_ONE_MINUS_EPSILON);
        product *= weights[chosen] / sum;
        at = node->child[chosen];
    }
    if (at == CA_NONE) return CA_NONE;
    *probability = product;
    return at - CA_LIGHT_TREE_LEAF;
}

float ca_light_tree_probability(const ca_light_tree *tree, const ca_light_receiver *receiver, uint32_t light)
{
    if (tree->node_count == 0 || tree->leaf[light] == CA_NONE) return 0.0f;
    float product = 1.0f;
    uint32_t at = tree->leaf[light] / WIDTH, slot = tree->leaf[light] % WIDTH;
    while (at != CA_NONE && product > 0.0f) {
        const ca_light_tree_node *node = &tree->nodes[at];
        float weights[WIDTH];
        const float sum = weigh(node, receiver, weights);
        if (!(sum > 0.0f) || !isfinite(sum)) return 0.0f;
        product *= weights[slot] / sum;
        slot = node->slot;
        at = node->parent;
    }
    return product;
}

/* ---- Building -------------------------------------------------------------------------------------------------- */

typedef struct tree_item {
    ca_light_bounds bounds;
    uint32_t light;
} tree_item;

/* Items [first, first + count). */
typedef struct tree_range {
    uint32_t first, count;
    ca_light_bounds bounds;
} tree_range;

static float component(ca_vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

static float middle(const ca_light_bounds *bounds, int axis)
{
    return 0.5f * (component(bounds->low, axis) + component(bounds->high, axis));
}

static ca_light_bounds bounds_of_range(const tree_item *items, uint32_t first, uint32_t count)
{
    ca_light_bounds bounds = items[first].bounds;
    for (uint32_t i = 1; i < count; i++) bounds = ca_light_bounds_union(&bounds, &items[first + i].bounds);
    return bounds;
}

/* Bins of equal width along an axis over the middles of the items. */
typedef struct tree_axis {
    int axis;
    float low, scale; /* bin = (middle - low) scale */
} tree_axis;

static uint32_t bin_of(const tree_axis *a, const tree_item *item)
{
    const float x = (middle(&item->bounds, a->axis) - a->low) * a->scale;
    return ca_min_u32((uint32_t)ca_max(x, 0.0f), BINS - 1);
}

/* false: the middles do not differ along it. */
static bool axis_of(const tree_item *items, const tree_range *range, int axis, tree_axis *a)
{
    float low = INFINITY, high = -INFINITY;
    for (uint32_t i = 0; i < range->count; i++) {
        const float m = middle(&items[range->first + i].bounds, axis);
        low = ca_min(low, m);
        high = ca_max(high, m);
    }
    *a = (tree_axis){axis, low, (float)BINS / (high - low)};
    return high > low && isfinite(a->scale);
}

static void merge_bounds(ca_light_bounds *sum, bool *any, const ca_light_bounds *more)
{
    *sum = *any ? ca_light_bounds_union(sum, more) : *more;
    *any = true;
}

/* The cheapest plane between two bins of an axis; INFINITY where there is none. Flat boxes are better divided along
 * their longest side: the cost counts by how much shorter this one is. */
static double cheapest_plane(const tree_item *items, const tree_range *range, const tree_axis *a, uint32_t *plane)
{
    ca_light_bounds bins[BINS], above[BINS], below;
    bool filled[BINS] = {false}, any_above[BINS], any = false;
    for (uint32_t i = 0; i < range->count; i++) {
        const uint32_t bin = bin_of(a, &items[range->first + i]);
        merge_bounds(&bins[bin], &filled[bin], &items[range->first + i].bounds);
    }
    for (uint32_t i = BINS; i-- > 0;) {
        if (i + 1 < BINS) above[i] = above[i + 1];
        any_above[i] = i + 1 < BINS && any_above[i + 1];
        if (filled[i]) merge_bounds(&above[i], &any_above[i], &bins[i]);
    }
    const ca_vec3 size = ca_sub(range->bounds.high, range->bounds.low);
    const double stretch = (double)ca_max3(size) / fmax((double)component(size, a->axis), 1e-30);
    double least = (double)INFINITY;
    for (uint32_t i = 0; i + 1 < BINS; i++) {
        if (filled[i]) merge_bounds(&below, &any, &bins[i]);
        if (!any || !any_above[i + 1]) continue;
        const double cost = stretch * (ca_light_bounds_cost(&below) + ca_light_bounds_cost(&above[i + 1]));
        if (!(cost < least)) continue;
        least = cost;
        *plane = i + 1;
    }
    return least;
}

/* Moves the items of the lower bins to the front; how many. */
static uint32_t partition(tree_item *items, const tree_range *range, const tree_axis *a, uint32_t plane)
{
    uint32_t lower = 0;
    for (uint32_t i = 0; i < range->count; i++) {
        if (bin_of(a, &items[range->first + i]) >= plane) continue;
        const tree_item item = items[range->first + i];
        items[range->first + i] = items[range->first + lower];
        items[range->first + lower++] = item;
    }
    return lower;
}

/* Divides a range of at least two: it becomes the lower part, and the upper is returned. */
static tree_range divide(tree_item *items, tree_range *range)
{
    double least = (double)INFINITY;
    uint32_t plane = 0, lower = range->count / 2; /* where all are in one place */
    tree_axis best = {0};
    for (int axis = 0; axis < 3; axis++) {
        tree_axis a;
        uint32_t candidate = 0;
        if (!axis_of(items, range, axis, &a)) continue;
        const double cost = cheapest_plane(items, range, &a, &candidate);
        if (!(cost < least)) continue;
        least = cost;
        plane = candidate;
        best = a;
    }
    if (least < (double)INFINITY) lower = partition(items, range, &best, plane);
    tree_range upper = {.first = range->first + lower, .count = range->count - lower};
    range->count = lower;
    range->bounds = bounds_of_range(items, range->first, range->count);
    upper.bounds = bounds_of_range(items, upper.first, upper.count);
    return upper;
}

/* The range that is worth dividing most, or WIDTH. */
static uint32_t worst_range(const tree_range *ranges, uint32_t count)
{
    uint32_t worst = WIDTH;
    double most = -1.0;
    for (uint32_t i = 0; i < count; i++) {
        const double cost = ca_light_bounds_cost(&ranges[i].bounds);
        if (ranges[i].count < 2 || !(cost > most)) continue;
        most = cost;
        worst = i;
    }
    return worst;
}

static void fill_slot(ca_light_tree_node *node, uint32_t slot, const ca_light_bounds *bounds, uint32_t child)
{
    const ca_vec3 half = ca_mul(ca_sub(bounds->high, bounds->low), 0.5f), center = ca_add(bounds->low, half);
    node->x[slot] = center.x;
    node->y[slot] = center.y;
    node->z[slot] = center.z;
    node->radius2[slot] = ca_length2(half) * (1.0f + 1e-5f);
    node->axis_x[slot] = bounds->axis.x;
    node->axis_y[slot] = bounds->axis.y;
    node->axis_z[slot] = bounds->axis.z;
    /* A little wider than computed: what is left out here would never be asked. */
    const float normal_angle = ca_min(bounds->normal_angle + 1e-3f, CA_PI);
    node->cos_normal[slot] = cosf(normal_angle);
    node->sin_normal[slot] = sinf(normal_angle);
    node->cos_emission[slot] = ca_max(cosf(bounds->emission_angle + 1e-3f), 0.0f);
    node->intensity[slot] = bounds->intensity;
    node->child[slot] = child;
}

/* One node over the range and, below it, all others; there are enough of them. */
static uint32_t build(ca_light_tree *tree, tree_item *items, tree_range range, uint32_t parent, uint32_t parent_slot)
{
    const uint32_t index = tree->node_count++;
    tree->nodes[index] = (ca_light_tree_node){.parent = parent, .slot = parent_slot};
    tree_range ranges[WIDTH] = {range};
    uint32_t count = 1, worst;
    while (count < WIDTH && (worst = worst_range(ranges, count)) < WIDTH) {
        const tree_range upper = divide(items, &ranges[worst]);
        for (uint32_t i = count; i > worst + 1; i--) ranges[i] = ranges[i - 1]; /* in the order of their places */
        ranges[worst + 1] = upper;
        count++;
    }
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t light = items[ranges[i].first].light;
        uint32_t child = CA_LIGHT_TREE_LEAF + light;
        if (ranges[i].count > 1)
            child = build(tree, items, ranges[i], index, i);
        else
            tree->leaf[light] = index * WIDTH + i;
        fill_slot(&tree->nodes[index], i, &ranges[i].bounds, child);
    }
    return index;
}

static uint32_t collect(tree_item *items, const ca_light *lights, uint32_t count)
{
    uint32_t found = 0;
    for (uint32_t i = 0; i < count; i++) {
        items[found].light = i;
        found += ca_light_bounds_of(&lights[i], &items[found].bounds) && items[found].bounds.intensity > 0.0f;
    }
    return found;
}

ca_status ca_light_tree_create(ca_light_tree *tree, const ca_light *lights, uint32_t count, ca_error *error)
{
    assert(count < CA_LIGHT_TREE_LEAF / WIDTH);
    *tree = (ca_light_tree){0};
    if (count == 0) return CA_OK;
    tree_item *items = ca_alloc(count, sizeof *items);
    tree->nodes = ca_alloc(count, sizeof *tree->nodes);
    tree->leaf = ca_alloc(count, sizeof *tree->leaf);
    if (!items || !tree->nodes || !tree->leaf) {
        ca_free(items);
        ca_light_tree_destroy(tree);
        return ca_fail_memory(error, "the tree of lights");
    }
    for (uint32_t i = 0; i < count; i++) tree->leaf[i] = CA_NONE;
    const uint32_t found = collect(items, lights, count);
    if (found > 0) {
        const tree_range all = {.count = found, .bounds = bounds_of_range(items, 0, found)};
        build(tree, items, all, CA_NONE, 0);
    }
    ca_free(items);
    return CA_OK;
}

void ca_light_tree_destroy(ca_light_tree *tree)
{
    ca_free(tree->nodes);
    ca_free(tree->leaf);
    *tree = (ca_light_tree){0};
}
