/* The flat pieces of a world's small meshes (parallelograms, and triangles that are half of none), met without a
 * tree: eight rays at a time meet each piece in turn, or one ray eight pieces at a time, with the same operations in
 * each lane and so to the same bits. A room's walls and boxes are answered so in a fraction of the time that a tree
 * takes; what is left to the tree ends at the nearest piece.
 *
 * A parallelogram is its centre c and two sides a and b. A ray o + t d meets its plane at c + x a + y b, where with
 * r = o - c, n = a x b and q = r x d
 *     n.d x = -q.b,    n.d y = q.a,    n.d t = -n.r,
 * and it meets the piece if |x|, |y| <= 1/2. A triangle is half of a parallelogram: x + y <= 0. Closed surfaces have
 * no cracks: pieces reach beyond their sides by the rounding error of n.d x and n.d y, which is bounded before the
 * division by n.d and so for grazing rays too. That is some 1e-6 of the coordinates of piece and origin, more where
 * the piece is narrow; meshes for which this is no small part of their size are left to Embree.
 *
 * Immutable once it is filled. State: 80 bytes a piece. */
#ifndef CA_GEOMETRY_FACETS_H
#define CA_GEOMETRY_FACETS_H

#include "geometry/accel.h"
#include "math/lanes.h"
#include "math/numeric.h"

/* At most so many pieces; a multiple of eight. With 90 a box still renders faster than with a tree. */
enum { CA_FACETS = 96 };

/* With |.| a largest component and |.|_1 the sum of the components' sizes: r has a rounding, the components of q have
 * two more, in all 5 u |r| |d|, and q.b has three of its own: it errs by 11 u |r| |d| |b|_1, and |r| <= |o| + |c|. */
#define CA_FACET_ROUNDING CA_GAMMA(12)

typedef struct ca_facet_vectors {
    float x[CA_FACETS], y[CA_FACETS], z[CA_FACETS];
} ca_facet_vectors;

typedef struct ca_facets {
    uint32_t count; /* behind the last piece come pieces that no ray meets, up to a whole group of eight */
    ca_facet_vectors center, side[2], normal; /* c, a, b, and n, on the side of the winding */
    float half[CA_FACETS];    /* 1/2: a triangle (x + y errs by twice as much as each), 0: a parallelogram */
    float error[CA_FACETS];   /* how far the piece's own numbers may be off, as a length */
    float longest[CA_FACETS]; /* of a and b, as sums of their components' sizes */
    uint32_t shape[CA_FACETS];
    uint32_t primitive[2 * CA_FACETS]; /* the triangles with x + y <= 0, and beyond */
    uint32_t first_corner[2 * CA_FACETS]; /* that corner of theirs which is not on their common side */
} ca_facets;

/* The hits of eight rays: in each lane the nearest so far. */
typedef struct ca_facet_hits {
    ca_f8 t, u, v;
    ca_v8 ng;
    ca_m8 shape, primitive;
} ca_facet_hits;

/* Fills a zeroed structure with the pieces of the small meshes among a world's shapes, or, where these are too many,
 * of the largest of them: a room's walls. Left out are meshes so large or small that products of four of their
 * lengths leave single precision, and those whose pieces would reach visibly beyond their sides: far from the origin
 * for their size, or slivers. false: out of memory. */
bool ca_facets_fill(ca_facets *facets, const ca_shape *shapes, uint32_t count);
/* Are the shape's triangles among the pieces? */
bool ca_facets_have(const ca_facets *facets, uint32_t shape);

/* Pieces before hits->t take the place of what was met there; only lanes of `valid` meet anything. */
void ca_facets_intersect8(const ca_facets *facets, ca_v8 origin, ca_v8 direction, ca_f8 t_min, ca_m8 valid,
                          ca_facet_hits *hits);
/* Lanes in which a piece lies between t_min and t_max. */
ca_m8 ca_facets_occlude8(const ca_facets *facets, ca_v8 origin, ca_v8 direction, ca_f8 t_min, ca_f8 t_max);

/* The same for a ray alone: the nearest before hit->t, of which instance stays. */
bool ca_facets_intersect(const ca_facets *facets, ca_vec3 origin, ca_vec3 direction, float t_min, ca_hit *hit);
bool ca_facets_occlude(const ca_facets *facets, ca_vec3 origin, ca_vec3 direction, float t_min, float t_max);

#endif
