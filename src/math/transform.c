#include "math/transform.h"

#include "math/numeric.h"

#include <string.h>

ca_matrix ca_matrix_identity(void)
{
    return (ca_matrix){{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
}

ca_matrix ca_matrix_multiply(const ca_matrix *a, const ca_matrix *b)
{
    ca_matrix c;
    for (int row = 0; row < 4; row++)
        for (int column = 0; column < 4; column++) {
            double sum = 0.0;
            for (int k = 0; k < 4; k++) sum += a->m[row][k] * b->m[k][column];
            c.m[row][column] = sum;
        }
    return c;
}

ca_matrix ca_matrix_translate(double x, double y, double z)
{
    return (ca_matrix){{{1, 0, 0, x}, {0, 1, 0, y}, {0, 0, 1, z}, {0, 0, 0, 1}}};
}

ca_matrix ca_matrix_scale(double x, double y, double z)
{
    return (ca_matrix){{{x, 0, 0, 0}, {0, y, 0, 0}, {0, 0, z, 0}, {0, 0, 0, 1}}};
}

ca_matrix ca_matrix_rotate(double x, double y, double z, double degrees)
{
    const double length = sqrt(x * x + y * y + z * z);
    x /= length, y /= length, z /= length;
    const double angle = degrees * (CA_PI_D / 180.0);
    const double c = cos(angle), s = sin(angle), k = 1.0 - c;
    return (ca_matrix){{{c + x * x * k, x * y * k - z * s, x * z * k + y * s, 0},
                        {y * x * k + z * s, c + y * y * k, y * z * k - x * s, 0},
                        {z * x * k - y * s, z * y * k + x * s, c + z * z * k, 0},
                        {0, 0, 0, 1}}};
}

static void cross_d(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static bool normalize_d(double a[3])
{
    const double length = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    if (!(length > 0.0) || !isfinite(length)) return false;
    for (int i = 0; i < 3; i++) a[i] /= length;
    return true;
}

bool ca_matrix_look_at(const double origin[3], const double target[3], const double up[3], ca_matrix *result)
{
    double z[3] = {target[0] - origin[0], target[1] - origin[1], target[2] - origin[2]};
    double x[3], y[3];
    if (!normalize_d(z)) return false;
    cross_d(up, z, x);
    if (!normalize_d(x)) return false;
    cross_d(z, x, y);
    *result = ca_matrix_identity();
    for (int i = 0; i < 3; i++) {
        result->m[i][0] = x[i];
        result->m[i][1] = y[i];
        result->m[i][2] = z[i];
        result->m[i][3] = origin[i];
    }
    return true;
}

/* Gauss-Jordan elimination with row pivoting. */
bool ca_matrix_invert(const ca_matrix *a, ca_matrix *inverse)
{
    double work[4][8];
    for (int row = 0; row < 4; row++)
        for (int column = 0; column < 4; column++) {
            if (!isfinite(a->m[row][column])) return false;
            work[row][column] = a->m[row][column];
            work[row][column + 4] = row == column;
        }
    for (int column = 0; column < 4; column++) {
        int pivot = column;
        for (int row = column + 1; row < 4; row++)
            if (fabs(work[row][column]) > fabs(work[pivot][column])) pivot = row;
        if (work[pivot][column] == 0.0) return false;
        for (int k = 0; k < 8; k++) {
            const double swap = work[column][k];
            work[column][k] = work[pivot][k];
            work[pivot][k] = swap;
        }
        const double scale = 1.0 / work[column][column];
        for (int k = 0; k < 8; k++) work[column][k] *= scale;
        for (int row = 0; row < 4; row++) {
            if (row == column) continue;
            const double factor = work[row][column];
            for (int k = 0; k < 8; k++) work[row][k] -= factor * work[column][k];
        }
    }
    for (int row = 0; row < 4; row++)
        for (int column = 0; column < 4; column++) {
            if (!isfinite(work[row][column + 4])) return false;
            inverse->m[row][column] = work[row][column + 4];
        }
    return true;
}

double ca_matrix_determinant3(const ca_matrix *a)
{
    const double(*m)[4] = a->m;
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/* R becomes (R + R^-T) / 2: errors are squared by each step, so that eight end at the rounding from any error that
 * matters. */
bool ca_matrix_make_rigid(ca_matrix *a)
{
    ca_matrix r = ca_matrix_identity(), inverse;
    for (int i = 0; i < 9; i++) r.m[i / 3][i % 3] = a->m[i / 3][i % 3];
    for (int step = 0; step < 8; step++) {
        if (!ca_matrix_invert(&r, &inverse)) return false;
        for (int i = 0; i < 9; i++)
            r.m[i / 3][i % 3] = 0.5 * (r.m[i / 3][i % 3] + inverse.m[i % 3][i / 3]);
    }
    for (int i = 0; i < 9; i++) a->m[i / 3][i % 3] = r.m[i / 3][i % 3];
    return true;
}

bool ca_matrix_is_affine(const ca_matrix *a)
{
    for (int row = 0; row < 4; row++)
        for (int column = 0; column < 4; column++)
            if (!isfinite(a->m[row][column])) return false;
    return a->m[3][0] == 0.0 && a->m[3][1] == 0.0 && a->m[3][2] == 0.0 && a->m[3][3] == 1.0;
}

void ca_matrix_point(const ca_matrix *a, const double p[3], double result[3])
{
    double homogeneous[4];
    for (int row = 0; row < 4; row++)
        homogeneous[row] = a->m[row][0] * p[0] + a->m[row][1] * p[1] + a->m[row][2] * p[2] + a->m[row][3];
    for (int row = 0; row < 3; row++) result[row] = homogeneous[row] / homogeneous[3];
}

bool ca_affine_from_matrix(const ca_matrix *matrix, ca_affine *affine)
{
    ca_matrix inverse;
    if (!ca_matrix_is_affine(matrix) || !ca_matrix_invert(matrix, &inverse)) return false;
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++) {
            affine->to[row][column] = (float)matrix->m[row][column];
            affine->from[row][column] = (float)inverse.m[row][column];
            if (!isfinite(affine->to[row][column]) || !isfinite(affine->from[row][column])) return false;
        }
    return true;
}

bool ca_affine_is_identity(const ca_affine *affine)
{
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++)
            if (affine->to[row][column] != (row == column ? 1.0f : 0.0f)) return false;
    return true;
}

/* Of columns of unit length: products of small scales would vanish. */
bool ca_affine_mirrors(const ca_affine *affine)
{
    double c[3][3];
    for (int column = 0; column < 3; column++) {
        double length2 = 0.0;
        for (int row = 0; row < 3; row++) c[column][row] = (double)affine->to[row][column];
        for (int row = 0; row < 3; row++) length2 += c[column][row] * c[column][row];
        for (int row = 0; row < 3; row++) c[column][row] /= sqrt(length2);
    }
    return c[2][0] * (c[0][1] * c[1][2] - c[0][2] * c[1][1]) + c[2][1] * (c[0][2] * c[1][0] - c[0][0] * c[1][2]) +
               c[2][2] * (c[0][0] * c[1][1] - c[0][1] * c[1][0]) <
           0.0;
}
