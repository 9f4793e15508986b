/* Boxes around what Embree knows: rays that pass by all of them, which eight at a time learn in a few nanoseconds,
 * are not given to it. A box is wider than Embree's own arithmetic can be off, so that no ray's answer changes.
 * Internal to accel*.c. */
#ifndef CA_GEOMETRY_ACCEL_BOXES_H
#define CA_GEOMETRY_ACCEL_BOXES_H

#include "math/lanes.h"
#include "math/transform.h"

enum { CA_ACCEL_BOXES = 16 };

typedef struct ca_accel_boxes {
    uint32_t count;
    bool all; /* no boxes: every ray is asked */
    ca_vec3 center[CA_ACCEL_BOXES], half[CA_ACCEL_BOXES];
    float slack[CA_ACCEL_BOXES]; /* more on all sides, for each unit of the origin's largest coordinate */
} ca_accel_boxes;

/* Another box, from `low` to `high` in the space of `map` (NULL: the world). Where there are too many, or one is not
 * finite, every ray is asked. */
void ca_accel_boxes_add(ca_accel_boxes *boxes, ca_vec3 low, ca_vec3 high, const ca_affine *map);

/* 1 / d, but finite. */
static inline ca_f8 ca_box_inverse8(ca_f8 d)
{
    return 1.0f / ca_copysign8(ca_max8(ca_abs8(d), ca_f8_all(1e-30f)), d);
}

/* Where lines are between two parallel planes; what is no number leaves the interval as it is. */
static inline void ca_box_slab8(ca_f8 offset, ca_f8 half, ca_f8 inverse, ca_f8 *near, ca_f8 *far)
{
    const ca_f8 middle = offset * inverse, reach = half * ca_abs8(inverse);
    *near = ca_max8(middle - reach, *near);
    *far = ca_min8(middle + reach, *far);
}

/* Rays that may meet a box between t_min and t_max. */
static inline ca_m8 ca_accel_boxes_meet8(const ca_accel_boxes *boxes, ca_v8 origin, ca_v8 direction, ca_f8 t_min,
                                         ca_f8 t_max)
{
    if (boxes->all) return ca_m8_all(-1);
    const ca_v8 inverse = {ca_box_inverse8(direction.x), ca_box_inverse8(direction.y), ca_box_inverse8(direction.z)};
    const ca_f8 size = ca_max3_v8(ca_abs_v8(origin)), end = t_max * 1.0001f;
    ca_m8 met = ca_m8_all(0);
    for (uint32_t k = 0; k < boxes->count; k++) {
        const ca_v8 offset = ca_sub_v8(ca_v8_all(boxes->center[k]), origin);
        const ca_f8 slack = boxes->slack[k] * size;
        ca_f8 near = t_min, far = end;
        ca_box_slab8(offset.x, boxes->half[k].x + slack, inverse.x, &near, &far);
        ca_box_slab8(offset.y, boxes->half[k].y + slack, inverse.y, &near, &far);
        ca_box_slab8(offset.z, boxes->half[k].z + slack, inverse.z, &near, &far);
        met |= ~(near > far);
    }
    return met;
}

#endif
