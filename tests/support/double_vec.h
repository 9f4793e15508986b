/* Vectors in double precision, for recomputing what the renderer does in single. */
#ifndef CA_TEST_DOUBLE_VEC_H
#define CA_TEST_DOUBLE_VEC_H

#include "math/vec.h"

#include <math.h>

typedef struct double_vec {
    double x, y, z;
} double_vec;

static inline double_vec dv_from(ca_vec3 a) { return (double_vec){(double)a.x, (double)a.y, (double)a.z}; }
static inline ca_vec3 dv_round(double_vec a) { return (ca_vec3){(float)a.x, (float)a.y, (float)a.z}; }
static inline double_vec dv_madd(double_vec a, double s, double_vec b)
{
    return (double_vec){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
static inline double_vec dv_sub(double_vec a, double_vec b) { return dv_madd(a, -1.0, b); }
static inline double_vec dv_mul(double_vec a, double s) { return (double_vec){a.x * s, a.y * s, a.z * s}; }
static inline double dv_dot(double_vec a, double_vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline double_vec dv_cross(double_vec a, double_vec b)
{
    return (double_vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline double dv_length(double_vec a) { return sqrt(dv_dot(a, a)); }
static inline double_vec dv_unit(double_vec a) { return dv_mul(a, 1.0 / dv_length(a)); }
static inline double_vec dv_axis(int i) { return (double_vec){i == 0, i == 1, i == 2}; }

#endif
