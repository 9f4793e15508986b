/* Vectors in double precision, for points that are put back onto a shape and rounded once. Internal to geometry/. */
#ifndef CA_GEOMETRY_DVEC_H
#define CA_GEOMETRY_DVEC_H

#include "math/vec.h"

typedef struct dvec {
    double x, y, z;
} dvec;

static inline dvec dvec_of(ca_vec3 v) { return (dvec){(double)v.x, (double)v.y, (double)v.z}; }
static inline dvec dvec_column(const float m[3][4], int column)
{
    return (dvec){(double)m[0][column], (double)m[1][column], (double)m[2][column]};
}
static inline dvec dsub(dvec a, dvec b) { return (dvec){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline dvec dmadd(dvec a, double s, dvec b) { return (dvec){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z}; }
static inline dvec dadd(dvec a, dvec b) { return (dvec){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline double ddot(dvec a, dvec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline dvec dcross(dvec a, dvec b)
{
    return (dvec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline dvec dscale(dvec a, double s) { return (dvec){a.x * s, a.y * s, a.z * s}; }
static inline ca_vec3 dround(dvec a) { return (ca_vec3){(float)a.x, (float)a.y, (float)a.z}; }

#endif
