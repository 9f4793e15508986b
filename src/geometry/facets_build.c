/* Which meshes lie apart from the tree, and their pieces. */
#include "geometry/facets.h"

#include "base/memory.h"
#include "geometry/triangle.h"
#include "math/numeric.h"

#include <stdlib.h>

/* ---- Pieces ---------------------------------------------------------------------------------------------------- */

/* Of a mesh's size: no side of a piece is moved farther by rounding, as seen at right angles from nearby. */
static const float largest_overlap = 0x1p-11f;

typedef struct small_mesh {
    uint32_t shape;
    float surface, size; /* of its box, and the largest of its sides */
    float extent;        /* largest coordinate */
} small_mesh;

/* A triangle's corners, from the one opposite the common side if there is one, and where they are in the mesh. */
typedef struct piece {
    ca_vec3 corner[3], opposite;
    uint32_t primitive[2];
    uint32_t first_corner[2];
    bool whole;
} piece;

static ca_vec3 corner_of(const ca_triangle *t, uint32_t k) { return t->p[k % 3]; }

static bool same_point(ca_vec3 a, ca_vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/* Is d, up to rounding, where the parallelogram of a corner p[0] and its neighbours p[1] and p[2] ends? */
static bool is_opposite(const ca_vec3 p[3], ca_vec3 d)
{
    const ca_vec3 gap = ca_sub(ca_sub(p[1], p[0]), ca_sub(d, p[2]));
    const float extent = ca_max3(ca_max_vec3(ca_max_vec3(ca_abs3(p[0]), ca_abs3(p[1])), ca_abs3(p[2])));
    return ca_max3(ca_abs3(gap)) <= CA_GAMMA(6) * extent;
}

/* The triangle `other` across the side that lies opposite of corner k, if both make a parallelogram. */
static bool join(const ca_triangle *t, uint32_t k, const ca_triangle *other, uint32_t other_primitive, piece *made)
{
    const ca_vec3 p[3] = {corner_of(t, k), corner_of(t, k + 1), corner_of(t, k + 2)};
    for (uint32_t j = 0; j < 3; j++) {
        const bool shares = same_point(corner_of(other, j + 1), p[2]) && same_point(corner_of(other, j + 2), p[1]);
        if (!shares || !is_opposite(p, corner_of(other, j))) continue;
        for (int i = 0; i < 3; i++) made->corner[i] = p[i];
        made->opposite = corner_of(other, j);
        made->primitive[1] = other_primitive;
        made->first_corner[0] = k;
        made->first_corner[1] = j;
        made->whole = true;
        return true;
    }
    return false;
}

/* The piece that begins with a triangle; used[] gets all that are in it. */
static piece find_piece(const ca_mesh *mesh, uint32_t primitive, bool *used)
{
    const ca_triangle t = ca_triangle_load(mesh, primitive);
    piece found = {.corner = {t.p[0], t.p[1], t.p[2]}, .primitive = {primitive, primitive}};
    used[primitive] = true;
    for (uint32_t other = primitive + 1; other < mesh->triangle_count; other++) {
        const ca_triangle o = ca_triangle_load(mesh, other);
        for (uint32_t k = 0; k < 3 && !used[other]; k++) used[other] = join(&t, k, &o, other, &found);
        if (found.whole) break;
    }
    return found;
}

static void set_vector(ca_facet_vectors *vectors, uint32_t k, ca_vec3 v)
{
    vectors->x[k] = v.x, vectors->y[k] = v.y, vectors->z[k] = v.z;
}

/* In double precision: a component of the plane's normal errs by its own rounding only. */
static ca_vec3 normal_of(ca_vec3 a, ca_vec3 b)
{
    return (ca_vec3){(float)((double)a.y * (double)b.z - (double)a.z * (double)b.y),
                     (float)((double)a.z * (double)b.x - (double)a.x * (double)b.z),
                     (float)((double)a.x * (double)b.y - (double)a.y * (double)b.x)};
}

static float sum_of_components(ca_vec3 v) { return fabsf(v.x) + fabsf(v.y) + fabsf(v.z); }

/* How far from a mesh's corner, along any axis, c + x a + y b is. */
static float corner_gap(ca_vec3 c, ca_vec3 a, ca_vec3 b, double x, double y, ca_vec3 corner)
{
    const double gap[3] = {(double)c.x + x * (double)a.x + y * (double)b.x - (double)corner.x,
                           (double)c.y + x * (double)a.y + y * (double)b.y - (double)corner.y,
                           (double)c.z + x * (double)a.z + y * (double)b.z - (double)corner.z};
    return ca_max3(ca_abs3((ca_vec3){(float)gap[0], (float)gap[1], (float)gap[2]}));
}

/* The part of the error bound (CA_FACET_ROUNDING) that no ray has to do with. A corner that is off by g along each
 * axis changes x n.d = (r x d).b at its sides by 2 g |d| |b|_1; n.d / 2 has five roundings. */
static float piece_error(const piece *p, ca_vec3 c, ca_vec3 a, ca_vec3 b)
{
    float gap = ca_max(corner_gap(c, a, b, -0.5, -0.5, p->corner[0]),
                       ca_max(corner_gap(c, a, b, 0.5, -0.5, p->corner[1]),
                              corner_gap(c, a, b, -0.5, 0.5, p->corner[2])));
    if (p->whole) gap = ca_max(gap, corner_gap(c, a, b, 0.5, 0.5, p->opposite));
    return CA_FACET_ROUNDING * ca_max3(ca_abs3(c)) + 2.0f * gap +
           CA_GAMMA(5) * ca_max3(ca_max_vec3(ca_abs3(a), ca_abs3(b)));
}

/* Would a piece reach too far beyond its sides? For an origin no farther off than its mesh, with `extent` the mesh's
 * largest coordinate, that is the bound on x n.d over |n.d|, times a side. */
static bool reaches_far(ca_vec3 a, ca_vec3 b, ca_vec3 normal, float extent, float size)
{
    const float longest = ca_max(sum_of_components(a), sum_of_components(b));
    return !(2.0f * CA_FACET_ROUNDING * extent * longest * longest < largest_overlap * size * ca_length(normal));
}

static bool set_piece(ca_facets *facets, const piece *p, const small_mesh *mesh)
{
    const uint32_t k = facets->count;
    const ca_vec3 a = ca_sub(p->corner[1], p->corner[0]), b = ca_sub(p->corner[2], p->corner[0]);
    const ca_vec3 center = ca_mul(ca_add(p->corner[1], p->corner[2]), 0.5f), normal = normal_of(a, b);
    if (reaches_far(a, b, normal, mesh->extent, mesh->size)) return false;
    set_vector(&facets->center, k, center);
    set_vector(&facets->side[0], k, a);
    set_vector(&facets->side[1], k, b);
    set_vector(&facets->normal, k, normal);
    facets->half[k] = p->whole ? 0.0f : 0.5f;
    facets->error[k] = piece_error(p, center, a, b);
    facets->longest[k] = ca_max(sum_of_components(a), sum_of_components(b));
    facets->shape[k] = mesh->shape;
    for (uint32_t i = 0; i < 2; i++) {
        facets->primitive[2 * k + i] = p->primitive[i];
        facets->first_corner[2 * k + i] = p->first_corner[i];
    }
    facets->count++;
    return true;
}

/* Adds all of a mesh's triangles, or none where one reaches too far; false, and nothing is added, where that makes
 * more than `most` pieces. */
static bool add_mesh(ca_facets *facets, const ca_shape *shapes, const small_mesh *small, uint32_t most)
{
    const ca_mesh *mesh = shapes[small->shape].as.mesh.mesh;
    bool used[2 * CA_FACETS] = {false};
    const uint32_t before = facets->count;
    for (uint32_t i = 0; i < mesh->triangle_count; i++) {
        if (used[i]) continue;
        if (facets->count == most) {
            facets->count = before;
            return false;
        }
        const piece found = find_piece(mesh, i, used);
        if (set_piece(facets, &found, small)) continue;
        facets->count = before;
        return true;
    }
    return true;
}

/* ---- Meshes ---------------------------------------------------------------------------------------------------- */

/* Where not all fit: so many pieces at most, and of meshes whose boxes have this share of the surface of the box
 * around all of them. */
enum { LARGE_FACETS = 32 };
static const float large_share = 1.0f / 64.0f;

/* Coordinates and sizes between these leave room for products of four. */
static const float largest_coordinate = 1e6f, smallest_size = 1e-6f;

static float box_surface(ca_vec3 low, ca_vec3 high)
{
    const ca_vec3 size = ca_sub(high, low);
    return size.x * size.y + size.y * size.z + size.z * size.x;
}

/* The largest first. */
static int compare_meshes(const void *a, const void *b)
{
    const small_mesh *first = a, *second = b;
    if (first->surface != second->surface) return first->surface < second->surface ? 1 : -1;
    return first->shape < second->shape ? -1 : 1;
}

/* Of meshes with at most two triangles for each piece that there may be. Returns how many; *surface: of the box
 * around them. */
static uint32_t find_small(const ca_shape *shapes, uint32_t count, small_mesh *found, float *surface)
{
    ca_vec3 all_high = {-INFINITY, -INFINITY, -INFINITY}, all_low = ca_neg(all_high);
    uint32_t small = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (shapes[i].kind != CA_SHAPE_MESH || shapes[i].as.mesh.mesh->triangle_count > 2 * CA_FACETS) continue;
        ca_vec3 low, high;
        ca_shape_bounds(&shapes[i], &low, &high);
        const float extent = ca_max3(ca_max_vec3(ca_abs3(low), ca_abs3(high))), size = ca_max3(ca_sub(high, low));
        if (!(extent < largest_coordinate && size >= smallest_size)) continue;
        all_low = ca_min_vec3(all_low, low);
        all_high = ca_max_vec3(all_high, high);
        found[small++] = (small_mesh){i, box_surface(low, high), size, extent};
    }
    *surface = box_surface(all_low, all_high);
    return small;
}

static void add_small(ca_facets *facets, const ca_shape *shapes, const small_mesh *meshes, uint32_t count,
                      float surface)
{
    bool fit = true;
    for (uint32_t i = 0; i < count && fit; i++)
        fit = add_mesh(facets, shapes, &meshes[i], CA_FACETS);
    if (fit) return;
    *facets = (ca_facets){0};
    for (uint32_t i = 0; i < count && meshes[i].surface >= large_share * surface; i++)
        add_mesh(facets, shapes, &meshes[i], LARGE_FACETS);
}

bool ca_facets_fill(ca_facets *facets, const ca_shape *shapes, uint32_t count)
{
    float surface;
    small_mesh *meshes = ca_alloc(count, sizeof *meshes);
    if (!meshes) return false;
    const uint32_t small = find_small(shapes, count, meshes, &surface);
    qsort(meshes, small, sizeof *meshes, compare_meshes);
    add_small(facets, shapes, meshes, small, surface);
    ca_free(meshes);
    return true;
}

bool ca_facets_have(const ca_facets *facets, uint32_t shape)
{
    for (uint32_t k = 0; k < facets->count; k++)
        if (facets->shape[k] == shape) return true;
    return false;
}
