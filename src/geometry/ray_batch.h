/* Many rays at a time, as structures of arrays: what a batch of paths asks the geometry.
 *
 * A ray's answer is the one that ca_accel_intersect or ca_accel_occluded gives for it alone, to the bit, whatever
 * else is in the batch: packets of eight go through Embree without its coherent mode, which lets neighbours decide
 * ties; quadrics and flat pieces that lie apart are met in a fixed order; where Embree knows quadrics (the world has
 * more than eight) or instances, of which neighbours decide ties too, nearest hits are asked for one by one. Rays for
 * Embree are sorted by the octant of their direction and the place of their origin before they are packed; answers
 * come in the order of the questions.
 *
 * Arrays are aligned to 32 bytes and hold a whole number of groups of eight (math/lanes.h). */
#ifndef CA_GEOMETRY_RAY_BATCH_H
#define CA_GEOMETRY_RAY_BATCH_H

#include "geometry/accel.h"
#include "math/lanes.h"

/* Rays of a batch, and how many numbers a column has room for: a line of cache more than the rays. Columns of 512
 * would lie 2048 bytes apart, and the numbers of one path would all fall into two sets of the first cache. */
enum { CA_RAY_BATCH = 512, CA_COLUMN = CA_RAY_BATCH + 16 };

/* Vectors of three by components. */
typedef struct ca_column3 {
    _Alignas(32) float x[CA_COLUMN];
    float y[CA_COLUMN], z[CA_COLUMN];
} ca_column3;

typedef struct ca_ray_batch {
    ca_column3 origin, direction;
    float t_min[CA_COLUMN], t_max[CA_COLUMN];
} ca_ray_batch;

/* What each ray met; as ca_hit. */
typedef struct ca_hit_batch {
    _Alignas(32) float t[CA_COLUMN];
    float u[CA_COLUMN], v[CA_COLUMN];
    ca_column3 ng;
    uint32_t shape[CA_COLUMN], primitive[CA_COLUMN], instance[CA_COLUMN]; /* shape CA_NONE: nothing */
} ca_hit_batch;

static inline ca_vec3 ca_column3_at(const ca_column3 *column, uint32_t i)
{
    return (ca_vec3){column->x[i], column->y[i], column->z[i]};
}
static inline void ca_column3_set(ca_column3 *column, uint32_t i, ca_vec3 v)
{
    column->x[i] = v.x, column->y[i] = v.y, column->z[i] = v.z;
}
static inline ca_v8 ca_column3_load(const ca_column3 *column, uint32_t i)
{
    return (ca_v8){ca_load8(column->x, i), ca_load8(column->y, i), ca_load8(column->z, i)};
}
static inline void ca_column3_store(ca_column3 *column, uint32_t i, ca_v8 v)
{
    ca_store8(column->x, i, v.x), ca_store8(column->y, i, v.y), ca_store8(column->z, i, v.z);
}
/* To eight places from `i` on, which need not be a multiple of eight. */
static inline void ca_column3_store_anywhere(ca_column3 *column, uint32_t i, ca_v8 v)
{
    ca_store8_anywhere(column->x + i, v.x);
    ca_store8_anywhere(column->y + i, v.y);
    ca_store8_anywhere(column->z + i, v.z);
}

/* Rays [0, count), count <= CA_RAY_BATCH. What lies behind the last one up to a whole group is overwritten. */
void ca_accel_intersect_batch(const ca_accel *accel, const ca_ray_batch *rays, uint32_t count, ca_hit_batch *hits);
/* occluded[i]: 1 where something is in between, else 0. */
void ca_accel_occluded_batch(const ca_accel *accel, const ca_ray_batch *rays, uint32_t count, uint8_t *occluded);

/* Elements i of rays and hits as the single-ray interface has them. */
static inline ca_hit ca_hit_batch_at(const ca_hit_batch *hits, uint32_t i)
{
    return (ca_hit){.t = hits->t[i],
                    .u = hits->u[i],
                    .v = hits->v[i],
                    .ng = ca_column3_at(&hits->ng, i),
                    .shape = hits->shape[i],
                    .primitive = hits->primitive[i],
                    .instance = hits->instance[i]};
}

#endif
