/* Transforms: 4x4 matrices in double precision while a scene is put together, and affine maps with their inverse in
 * single precision for rendering. Column vectors: M N p applies N first. Row-major storage, m[row][column]. */
#ifndef CA_MATH_TRANSFORM_H
#define CA_MATH_TRANSFORM_H

#include "math/vec.h"

#include <stdbool.h>

typedef struct ca_matrix {
    double m[4][4];
} ca_matrix;

ca_matrix ca_matrix_identity(void);
ca_matrix ca_matrix_multiply(const ca_matrix *a, const ca_matrix *b);
ca_matrix ca_matrix_translate(double x, double y, double z);
ca_matrix ca_matrix_scale(double x, double y, double z);
/* Right-handed rotation by `degrees` around the axis (any length but 0). */
ca_matrix ca_matrix_rotate(double x, double y, double z, double degrees);
/* Camera-to-world: the origin goes to `origin`, +z looks at `target`, +y leans towards `up`, +x = y x z (to the left
 * of the picture). false where the three do not span a frame. */
bool ca_matrix_look_at(const double origin[3], const double target[3], const double up[3], ca_matrix *result);
/* false where the matrix is singular or not finite. */
bool ca_matrix_invert(const ca_matrix *a, ca_matrix *inverse);
double ca_matrix_determinant3(const ca_matrix *a); /* of the upper left 3x3 */
/* The upper left 3x3 becomes the nearest matrix with columns of unit length at right angles, which mirrors if `a`
 * does: the orthogonal factor of its polar decomposition, by Newton's iteration. For matrices that are nearly so;
 * false where the matrix is singular. */
bool ca_matrix_make_rigid(ca_matrix *a);
bool ca_matrix_is_affine(const ca_matrix *a);      /* last row 0 0 0 1, all finite */
void ca_matrix_point(const ca_matrix *a, const double p[3], double result[3]); /* with division by w */

/* An affine map and its inverse: 96 bytes. */
typedef struct ca_affine {
    float to[3][4];   /* local -> world */
    float from[3][4]; /* world -> local */
} ca_affine;

/* false where the matrix is not affine or not invertible. */
bool ca_affine_from_matrix(const ca_matrix *matrix, ca_affine *affine);
/* Does it leave every point where it is? */
bool ca_affine_is_identity(const ca_affine *affine);
/* Does it turn right hands into left ones? */
bool ca_affine_mirrors(const ca_affine *affine);

static inline ca_vec3 ca_map_point(const float m[3][4], ca_vec3 p)
{
    return (ca_vec3){m[0][0] * p.x + m[0][1] * p.y + m[0][2] * p.z + m[0][3],
                     m[1][0] * p.x + m[1][1] * p.y + m[1][2] * p.z + m[1][3],
                     m[2][0] * p.x + m[2][1] * p.y + m[2][2] * p.z + m[2][3]};
}

static inline ca_vec3 ca_map_vector(const float m[3][4], ca_vec3 v)
{
    return (ca_vec3){m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z, m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
                     m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
}

/* A normal maps by the transpose of the *inverse* matrix, which is the argument. Not of unit length. */
static inline ca_vec3 ca_map_normal(const float inverse[3][4], ca_vec3 n)
{
    return (ca_vec3){inverse[0][0] * n.x + inverse[1][0] * n.y + inverse[2][0] * n.z,
                     inverse[0][1] * n.x + inverse[1][1] * n.y + inverse[2][1] * n.z,
                     inverse[0][2] * n.x + inverse[1][2] * n.y + inverse[2][2] * n.z};
}

#endif
