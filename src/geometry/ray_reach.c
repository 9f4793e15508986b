#include "geometry/ray_reach.h"

#include <math.h>

/* Embree's FLT_LARGE, and the half of it: a mapped component is bounded by the half but for rounding. */
static const double largest = 1.844e18, half_of_it = 0.5 * 1.844e18;

/* Cofactors and determinant by the rule of Sarrus with all products taken as positive: what their rounding errors are
 * relative to. */
typedef struct positive_parts {
    double cofactors[3][3], determinant; /* of row and column */
} positive_parts;

static double magnitude(const ca_affine *map, int row, int column) { return fabs((double)map->to[row][column]); }

static positive_parts positive_parts_of(const ca_affine *map)
{
    positive_parts parts = {.determinant = 0.0};
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
            parts.cofactors[r][c] = magnitude(map, r1, c1) * magnitude(map, r2, c2) +
                                    magnitude(map, r1, c2) * magnitude(map, r2, c1);
        }
    for (int c = 0; c < 3; c++) parts.determinant += magnitude(map, 0, c) * parts.cofactors[0][c];
    return parts;
}

static double determinant_of(const ca_affine *map)
{
    double sum = 0.0;
    for (int c = 0; c < 3; c++) {
        const int c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        sum += (double)map->to[0][c] * ((double)map->to[1][c1] * (double)map->to[2][c2] -
                                        (double)map->to[1][c2] * (double)map->to[2][c1]);
    }
    return sum;
}

/* Single precision makes cofactors and determinant of no more than eight roundings each: their errors are below these
 * parts of the positive ones, and what is lost by underflow is below `tiny`. So the determinant is known to a half if
 * it is large enough, and a number of the inverse is at most `cofactor / (determinant / 2)`. */
static const double least_determinant = 0x1p-20, tiny = 1e-36, most = 1e37;

bool ca_ray_reach_limit(ca_ray_reach *reach, const ca_affine *map)
{
    const positive_parts parts = positive_parts_of(map);
    const double determinant = fabs(determinant_of(map));
    double length = 0.0, offset = 0.0;
    if (!(determinant > least_determinant * parts.determinant && determinant > tiny && parts.determinant < most))
        return false;
    for (int row = 0; row < 3; row++) { /* of the inverse */
        double squares = 0.0, moved = 0.0;
        for (int column = 0; column < 3; column++) {
            if (!(parts.cofactors[column][row] < most)) return false;
            const double number = (parts.cofactors[column][row] + tiny) / (0.5 * determinant);
            squares += number * number;
            moved += number * magnitude(map, column, 3);
        }
        length = fmax(length, sqrt(squares));
        offset = fmax(offset, moved);
    }
    if (!(offset < 0.5 * half_of_it && length < largest)) return false;
    reach->origin = fminf(reach->origin, (float)((half_of_it - offset) / length));
    reach->direction = fminf(reach->direction, (float)(half_of_it / length));
    return true;
}
