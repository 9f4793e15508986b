#include "light/light_tree.h"

#include "base/memory.h"
#include "light/light_bounds.h"
#include "math/lanes.h"
#include "math/numeric.h"

#include <assert.h>

enum { WIDTH = CA_LIGHT_TREE_WIDTH, BINS = 12, ABREAST = 64 };
#define SMALLEST_RADIUS 1e-18f /* its square is still a normal number */
_Static_assert((int)WIDTH == (int)CA_LANES, "a node's children are the lanes of a vector");

/* ---- Asking ---------------------------------------------------------------------------------------------------- */

static inline ca_f8 upper(ca_m8 pair) { return (ca_f8)(pair & ca_m8_all((int32_t)0xffff0000)); }
static inline ca_f8 lower(ca_m8 pair) { return (ca_f8)(pair << 16); }

/* 1 where light from behind counts, too. */
static inline float all_around(const ca_light_receiver *receiver)
{
    const ca_vec3 n = receiver->normal;
    return n.x == 0.0f && n.y == 0.0f && n.z == 0.0f ? 1.0f : 0.0f;
}

/* What the children may contribute, up to a factor. The light is anywhere in the child's sphere. Of cosines the mean
 * over the sphere counts, about: that of its middle, or, where the sphere reaches over the plane, half the height of
 * its highest point over the distance. It is above 0 wherever any point of the sphere is above the plane, and gives
 * less noise than the height itself. The normals' spread is added to the cosine. Inside of the sphere the distance is
 * its radius. Heights are cosines times the distance: one root and one division, beside each other. */
static inline ca_f8 weigh(const ca_light_tree_node *node, const ca_light_receiver *receiver, float around)
{
    const ca_v8 middle = {ca_load8(node->x, 0), ca_load8(node->y, 0), ca_load8(node->z, 0)};
    const ca_m8 radius_reach = ca_load8_u32(node->radius_reach, 0), axis_xy = ca_load8_u32(node->axis_xy, 0),
                axis_z_spread = ca_load8_u32(node->axis_z_spread, 0);
    const ca_v8 axis = {upper(axis_xy), lower(axis_xy), upper(axis_z_spread)};
    const ca_v8 from_light = ca_sub_v8(ca_v8_all(receiver->position), middle);
    const ca_f8 radius = upper(radius_reach), zero = ca_f8_all(0.0f);
    const ca_f8 distance2 = ca_max8(ca_dot_v8(from_light, from_light), radius * radius);
    const ca_f8 distance = ca_sqrt8(distance2), inverse2 = 1.0f / distance2;
    const ca_f8 along_axis = ca_dot_v8(axis, from_light);
    const ca_f8 near_axis = ca_min8(along_axis + lower(axis_z_spread) * distance, distance);
    const ca_f8 over_light = ca_max8(near_axis, 0.5f * (near_axis + radius));
    const ca_f8 over_receiver = around * distance - ca_dot_v8(ca_v8_all(receiver->normal), from_light);
    const ca_f8 over_plane = ca_max8(over_receiver, 0.5f * (over_receiver + radius));
    const ca_m8 in_reach = along_axis + 2.0f * radius > lower(radius_reach) * distance;
    const ca_m8 shines = in_reach & (over_light > zero) & (over_plane > zero);
    const ca_f8 weight = ca_load8(node->intensity, 0) * (over_light * inverse2) * (over_plane * inverse2);
    return ca_select8(shines, weight, zero);
}

static inline bool is_usable(float sum) { return sum > 0.0f && sum <= FLT_MAX; }

/* The probability that the tree is asked, by the sum of the root's weights. */
static inline float share_of_tree(const ca_light_tree *tree, float sum)
{
    if (tree->outside == 0.0f) return 1.0f;
    if (!is_usable(sum)) return 0.0f;
    return ca_clamp(sum / (sum + tree->outside), CA_LIGHT_LEAST_SHARE, 1.0f - CA_LIGHT_LEAST_SHARE);
}

typedef struct tree_walk {
    uint32_t at;
    float u, probability, around;
    float share; /* of the tree, or of all outside */
} tree_walk;

/* One of the children, by the number that then is the one within its share; `at` becomes what is below, or CA_NONE
 * where no child can contribute. */
static inline void choose_child(const ca_light_tree_node *node, ca_f8 weights, ca_f8 sums, tree_walk *walk)
{
    const float sum = sums[WIDTH - 1], target = walk->u * sum;
    walk->at = CA_NONE;
    if (!is_usable(sum)) return;
    /* The first whose sum is above the target; by rounding there may be none, then the last that has a weight. */
    const uint32_t some = ca_mask_bits(weights > ca_f8_all(0.0f)), above = ca_mask_bits(sums > ca_f8_all(target));
    const int chosen = above ? __builtin_ctz(above) : 31 - __builtin_clz(some);
    _Alignas(32) float weight[WIDTH], below[1 + WIDTH] = {0.0f};
    ca_store8(weight, 0, weights);
    ca_store8_anywhere(below + 1, sums);
    walk->u = ca_clamp((target - below[chosen]) / weight[chosen], 0.0f, CA_ONE_MINUS_EPSILON);
    walk->probability *= weight[chosen] / sum;
    walk->at = node->child[chosen];
}

static inline void descend(const ca_light_tree *tree, const ca_light_receiver *receiver, tree_walk *walk)
{
    const ca_light_tree_node *node = &tree->nodes[walk->at];
    const ca_f8 weights = weigh(node, receiver, walk->around);
    choose_child(node, weights, ca_sums8(weights), walk);
}

/* The first step: the root also tells how likely the tree is asked. */
static inline tree_walk start(const ca_light_tree *tree, const ca_light_receiver *receiver, float u)
{
    tree_walk walk = {CA_NONE, u, 1.0f, all_around(receiver), 0.0f};
    if (tree->node_count == 0) return walk;
    const ca_f8 weights = weigh(tree->nodes, receiver, walk.around), sums = ca_sums8(weights);
    const float share = share_of_tree(tree, sums[WIDTH - 1]);
    if (u < share) {
        walk.share = share;
        walk.u = ca_min(u / share, CA_ONE_MINUS_EPSILON);
        choose_child(tree->nodes, weights, sums, &walk);
    } else {
        walk.share = 1.0f - share;
        walk.u = ca_min((u - share) / walk.share, CA_ONE_MINUS_EPSILON);
        walk.at = CA_LIGHT_TREE_OUTSIDE;
    }
    return walk;
}

/* Where a walk has ended. */
static uint32_t light_of(const tree_walk *walk, float *u, float *probability)
{
    *u = walk->u;
    *probability = walk->at == CA_NONE ? 0.0f : walk->share * walk->probability;
    return walk->at >= CA_LIGHT_TREE_OUTSIDE ? walk->at : walk->at - CA_LIGHT_TREE_LEAF;
}

uint32_t ca_light_tree_sample(const ca_light_tree *tree, const ca_light_receiver *receiver, float *u,
                              float *probability)
{
    tree_walk walk = start(tree, receiver, *u);
    while (walk.at < CA_LIGHT_TREE_LEAF) descend(tree, receiver, &walk);
    return light_of(&walk, u, probability);
}

static inline void prefetch(const ca_light_tree_node *node)
{
    for (size_t i = 0; i < sizeof *node; i += 64) __builtin_prefetch((const char *)node + i);
}

/* At most ABREAST of them: all of them a level down, then those that are not at a light yet. Without a branch for
 * that: nobody could predict it. */
static void sample_abreast(const ca_light_tree *tree, ca_light_query *queries, uint32_t count)
{
    tree_walk walks[ABREAST];
    uint32_t under_way[ABREAST], left = 0;
    for (uint32_t i = 0; i < count; i++) {
        walks[i] = start(tree, &queries[i].receiver, queries[i].u);
        const bool is_node = walks[i].at < CA_LIGHT_TREE_LEAF;
        prefetch(&tree->nodes[is_node ? walks[i].at : 0]);
        under_way[left] = i;
        left += is_node;
    }
    while (left > 0) {
        uint32_t kept = 0;
        for (uint32_t k = 0; k < left; k++) {
            const uint32_t i = under_way[k];
            descend(tree, &queries[i].receiver, &walks[i]);
            const bool is_node = walks[i].at < CA_LIGHT_TREE_LEAF;
            prefetch(&tree->nodes[is_node ? walks[i].at : 0]);
            under_way[kept] = i;
            kept += is_node;
        }
        left = kept;
    }
    for (uint32_t i = 0; i < count; i++)
        queries[i].light = light_of(&walks[i], &queries[i].u, &queries[i].probability);
}

void ca_light_tree_sample_many(const ca_light_tree *tree, ca_light_query *queries, uint32_t count)
{
    for (uint32_t i = 0; i < count; i += ABREAST) sample_abreast(tree, queries + i, ca_min_u32(count - i, ABREAST));
}

float ca_light_tree_outside_probability(const ca_light_tree *tree, const ca_light_receiver *receiver)
{
    if (tree->node_count == 0) return 0.0f;
    return 1.0f - share_of_tree(tree, ca_sums8(weigh(tree->nodes, receiver, all_around(receiver)))[WIDTH - 1]);
}

float ca_light_tree_probability(const ca_light_tree *tree, const ca_light_receiver *receiver, uint32_t light)
{
    if (tree->node_count == 0) return 0.0f;
    const float around = all_around(receiver);
    float product = tree->leaf[light] == CA_NONE ? 0.0f : 1.0f;
    for (uint32_t place = tree->leaf[light]; place != CA_NONE && product > 0.0f;) {
        const uint32_t node = place / WIDTH;
        const ca_f8 weights = weigh(&tree->nodes[node], receiver, around);
        const float sum = ca_sums8(weights)[WIDTH - 1];
        if (!is_usable(sum)) return 0.0f;
        product *= weights[place % WIDTH] / sum;
        place = tree->parent[node];
        if (place == CA_NONE) product *= share_of_tree(tree, sum);
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

/* The range of at least `least` and at most `most` items that is worth dividing most, or WIDTH. */
static uint32_t worst_range(const tree_range *ranges, uint32_t count, uint32_t least, uint32_t most)
{
    uint32_t worst = WIDTH;
    double highest = -1.0;
    for (uint32_t i = 0; i < count; i++) {
        const double cost = ca_light_bounds_cost(&ranges[i].bounds);
        if (ranges[i].count < least || ranges[i].count > most || !(cost > highest)) continue;
        highest = cost;
        worst = i;
    }
    return worst;
}

/* First what does not fit into a node of its own, then what can be lights of this node altogether: nodes with two or
 * three lights would be half of all. */
static uint32_t range_to_divide(const tree_range *ranges, uint32_t count)
{
    if (count == WIDTH) return WIDTH;
    const uint32_t large = worst_range(ranges, count, WIDTH + 1, UINT32_MAX);
    return large < WIDTH ? large : worst_range(ranges, count, 2, WIDTH - count + 1);
}

/* The nearest number above that a float's upper half can be; finite, not too large. */
static uint32_t half_above(float x)
{
    const uint32_t bits = ca_float_bits(x);
    return (x >= 0.0f ? bits + 0xffffu : bits) >> 16;
}

static uint32_t half_below(float x) { return half_above(-x) ^ 0x8000u; }
static uint32_t half_nearest(float x) { return (ca_float_bits(x) + 0x8000u) >> 16; }
static float from_half(uint32_t half) { return ca_bits_float(half << 16); }
static uint32_t pair_of(uint32_t first, uint32_t second) { return first << 16 | second; }

static void fill_direction(ca_light_tree_node *node, uint32_t slot, const ca_light_bounds *bounds)
{
    const uint32_t x = half_nearest(bounds->axis.x), y = half_nearest(bounds->axis.y),
                   z = half_nearest(bounds->axis.z);
    const ca_vec3 axis = {from_half(x), from_half(y), from_half(z)};
    /* A little more than computed: what is left out here would never be asked. */
    const float slack = ca_length(ca_sub(axis, bounds->axis)) + 1e-3f;
    const float normal = ca_min(bounds->normal_angle, CA_PI), reach = normal + bounds->emission_angle;
    /* Up to a right angle cos(a - normal) is at most cos a + sin normal. */
    const float spread = normal < 0.5f * CA_PI ? sinf(normal) : 1.0f - cosf(normal);
    const float cos_reach = reach < CA_PI ? cosf(reach) : -1.0f;
    node->axis_xy[slot] = pair_of(x, y);
    node->axis_z_spread[slot] = pair_of(z, half_above(spread + slack));
    node->radius_reach[slot] |= half_below(cos_reach - slack);
}

static void fill_slot(ca_light_tree_node *node, uint32_t slot, const ca_light_bounds *bounds, uint32_t child)
{
    const ca_vec3 half = ca_mul(ca_sub(bounds->high, bounds->low), 0.5f), center = ca_add(bounds->low, half);
    node->x[slot] = center.x;
    node->y[slot] = center.y;
    node->z[slot] = center.z;
    const float radius = ca_length(half) * (1.0f + 1e-5f);
    node->radius_reach[slot] = pair_of(half_above(ca_max(radius, SMALLEST_RADIUS)), 0);
    fill_direction(node, slot, bounds);
    node->intensity[slot] = bounds->intensity;
    node->child[slot] = child;
}

/* One node over the range and, below it, all others; there are enough of them. */
static uint32_t build(ca_light_tree *tree, tree_item *items, tree_range range, uint32_t place)
{
    const uint32_t index = tree->node_count++;
    tree->nodes[index] = (ca_light_tree_node){0};
    tree->parent[index] = place;
    tree_range ranges[WIDTH] = {range};
    uint32_t count = 1, worst;
    while ((worst = range_to_divide(ranges, count)) < WIDTH) {
        const tree_range upper_part = divide(items, &ranges[worst]);
        for (uint32_t i = count; i > worst + 1; i--) ranges[i] = ranges[i - 1]; /* in the order of their places */
        ranges[worst + 1] = upper_part;
        count++;
    }
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t light = items[ranges[i].first].light;
        uint32_t child = CA_LIGHT_TREE_LEAF + light;
        if (ranges[i].count > 1)
            child = build(tree, items, ranges[i], index * WIDTH + i);
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
    tree->nodes = ca_alloc_large(count, sizeof *tree->nodes);
    tree->parent = ca_alloc(count, sizeof *tree->parent);
    tree->leaf = ca_alloc(count, sizeof *tree->leaf);
    if (!items || !tree->nodes || !tree->parent || !tree->leaf) {
        ca_free(items);
        ca_light_tree_destroy(tree);
        return ca_fail_memory(error, "the tree of lights");
    }
    for (uint32_t i = 0; i < count; i++) tree->leaf[i] = CA_NONE;
    const uint32_t found = collect(items, lights, count);
    if (found > 0) {
        const tree_range all = {.count = found, .bounds = bounds_of_range(items, 0, found)};
        build(tree, items, all, CA_NONE);
    }
    ca_free(items);
    return CA_OK;
}

void ca_light_tree_destroy(ca_light_tree *tree)
{
    ca_free(tree->nodes);
    ca_free(tree->parent);
    ca_free(tree->leaf);
    *tree = (ca_light_tree){0};
}
