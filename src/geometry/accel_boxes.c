#include "geometry/accel_boxes.h"

/* Embree's roundings are some 2^-22 of the coordinates; in an instance as many times more as its map and that map's
 * inverse stretch together. */
static const float relative_slack = 1e-5f;

static float largest_stretch(const float m[3][4])
{
    float largest = 0.0f;
    for (int row = 0; row < 3; row++)
        largest = fmaxf(largest, fabsf(m[row][0]) + fabsf(m[row][1]) + fabsf(m[row][2]));
    return largest;
}

/* The bounds of a box's eight corners in the world. */
static void bounds_in_world(const ca_affine *map, ca_vec3 *low, ca_vec3 *high)
{
    const ca_vec3 corners[2] = {*low, *high};
    *low = (ca_vec3){INFINITY, INFINITY, INFINITY};
    *high = ca_neg(*low);
    for (int k = 0; k < 8; k++) {
        const ca_vec3 corner = {corners[k & 1].x, corners[k >> 1 & 1].y, corners[k >> 2].z};
        const ca_vec3 p = ca_map_point(map->to, corner);
        *low = ca_min_vec3(*low, p);
        *high = ca_max_vec3(*high, p);
    }
}

void ca_accel_boxes_add(ca_accel_boxes *boxes, ca_vec3 low, ca_vec3 high, const ca_affine *map)
{
    if (map) bounds_in_world(map, &low, &high);
    const float stretch = map ? fmaxf(1.0f, largest_stretch(map->to) * largest_stretch(map->from)) : 1.0f;
    const float slack = relative_slack * stretch, size = ca_max3(ca_max_vec3(ca_abs3(low), ca_abs3(high)));
    const ca_vec3 center = ca_mul(ca_add(low, high), 0.5f), half = ca_mul(ca_sub(high, low), 0.5f);
    const float more = slack * size;
    boxes->all = boxes->all || boxes->count == CA_ACCEL_BOXES || !(slack < 1.0f) || !ca_is_finite3(center) ||
                 !ca_is_finite3(half) || !isfinite(more);
    if (boxes->all) return;
    boxes->center[boxes->count] = center;
    boxes->half[boxes->count] = ca_add(half, (ca_vec3){more, more, more});
    boxes->slack[boxes->count++] = slack;
}
