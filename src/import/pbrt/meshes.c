/* Meshes that are made: grids over parametric surfaces, and Loop subdivision. */
#include "import/pbrt/reader.h"

#include <stdlib.h>
#include <string.h>

bool ca_pbrt_spend_triangles(ca_pbrt *p, size_t count)
{
    if (count > CA_PBRT_MAX_MADE_TRIANGLES - p->made_triangles)
        ca_import_fail(p->importer, &p->params.where,
                       "the scene's round and subdivided shapes are over the limit of %d triangles",
                       CA_PBRT_MAX_MADE_TRIANGLES);
    else
        p->made_triangles += (uint32_t)count;
    return ca_import_good(p->importer);
}

static bool create(ca_pbrt *p, size_t vertices, size_t triangles, bool smooth, ca_mesh *mesh)
{
    ca_error reason;
    const ca_status status = ca_mesh_create(mesh, vertices, triangles, smooth, smooth, &reason);
    if (status != CA_OK) ca_import_fail_file(p->importer, &p->params.where, status, &reason);
    return status == CA_OK;
}

/* ---- Grids ----------------------------------------------------------------------------------------------------- */

static void set_vertex(const ca_pbrt_surface *surface, uint32_t column, uint32_t row, ca_mesh *mesh)
{
    const size_t vertex = (size_t)row * (surface->columns + 1) + column;
    const double u = (double)column / surface->columns, v = (double)row / surface->rows;
    double position[3], normal[3];
    surface->at(surface->of, u, v, position, normal);
    for (int i = 0; i < 3; i++) {
        mesh->positions[3 * vertex + (size_t)i] = (float)position[i];
        mesh->normals[3 * vertex + (size_t)i] = (float)normal[i];
    }
    mesh->uvs[2 * vertex] = (float)u;
    mesh->uvs[2 * vertex + 1] = (float)(1.0 - v);
}

bool ca_pbrt_make_surface(ca_pbrt *p, const ca_pbrt_surface *surface, ca_mesh *mesh)
{
    const uint32_t columns = surface->columns, rows = surface->rows;
    const size_t triangles = 2 * (size_t)columns * rows;
    if (!ca_pbrt_spend_triangles(p, triangles)) return false;
    if (!create(p, (size_t)(columns + 1) * (rows + 1), triangles, true, mesh)) return false;
    for (uint32_t row = 0; row <= rows; row++)
        for (uint32_t column = 0; column <= columns; column++) set_vertex(surface, column, row, mesh);
    uint32_t *out = mesh->indices;
    for (uint32_t row = 0; row < rows; row++)
        for (uint32_t column = 0; column < columns; column++, out += 6) {
            const uint32_t a = row * (columns + 1) + column, b = a + columns + 1;
            const uint32_t corners[6] = {a, a + 1, b + 1, a, b + 1, b};
            memcpy(out, corners, sizeof corners);
        }
    ca_mesh_normalize_normals(mesh);
    return true;
}

/* ---- Loop subdivision ------------------------------------------------------------------------------------------ */

/* Loop 1987, "Smooth Subdivision Surfaces Based on Triangles", with Warren's weights; limit positions as in Hoppe et
 * al. 1994, "Piecewise Smooth Surface Reconstruction". */
typedef struct control {
    double *points;    /* 3 a vertex */
    uint32_t *corners; /* 3 a triangle */
    size_t vertex_count, triangle_count;
} control;

/* A triangle's side: its ends in order, and the corner across. */
typedef struct side {
    uint32_t low, high, across;
    uint32_t place; /* 3 triangle + number of the side */
} side;

typedef struct neighbours {
    double sum[3]; /* of the neighbours, or of those along the boundary */
    uint32_t count, boundary_count;
    double boundary_sum[3];
} neighbours;

static int compare_sides(const void *a, const void *b)
{
    const side *x = a, *y = b;
    if (x->low != y->low) return x->low < y->low ? -1 : 1;
    if (x->high != y->high) return x->high < y->high ? -1 : 1;
    return x->place < y->place ? -1 : x->place > y->place;
}

static void free_control(control *c)
{
    ca_free(c->points);
    ca_free(c->corners);
    *c = (control){0};
}

static bool is_edge(const side *a, const side *b) { return a->low == b->low && a->high == b->high; }

/* All sides, those of one edge together; NULL after failing. */
static side *sort_sides(ca_pbrt *p, const control *c)
{
    side *sides = ca_alloc(3 * c->triangle_count, sizeof *sides);
    if (!sides) {
        ca_import_fail_memory(p->importer, "a subdivided mesh");
        return NULL;
    }
    for (size_t i = 0; i < 3 * c->triangle_count; i++) {
        const size_t first = i / 3 * 3;
        const uint32_t a = c->corners[i], b = c->corners[first + (i + 1) % 3];
        sides[i] = (side){.low = a < b ? a : b,
                          .high = a < b ? b : a,
                          .across = c->corners[first + (i + 2) % 3],
                          .place = (uint32_t)i};
    }
    qsort(sides, 3 * c->triangle_count, sizeof *sides, compare_sides);
    for (size_t i = 0; i < 3 * c->triangle_count; i++)
        if (sides[i].low == sides[i].high || (i + 2 < 3 * c->triangle_count && is_edge(&sides[i], &sides[i + 2]))) {
            ca_import_fail(p->importer, &p->params.where,
                           "a mesh to be subdivided has an edge of more than two triangles, or of one point");
            ca_free(sides);
            return NULL;
        }
    return sides;
}

static void add_neighbour(const control *c, neighbours *at, uint32_t other, bool boundary)
{
    at->count++;
    at->boundary_count += boundary;
    for (size_t i = 0; i < 3; i++) {
        at->sum[i] += c->points[3 * (size_t)other + i];
        if (boundary) at->boundary_sum[i] += c->points[3 * (size_t)other + i];
    }
}

/* Sums of neighbours, one of each vertex; NULL after failing. */
static neighbours *sum_neighbours(ca_pbrt *p, const control *c, const side *sides)
{
    neighbours *all = ca_alloc_zeroed(c->vertex_count, sizeof *all);
    if (!all) {
        ca_import_fail_memory(p->importer, "a subdivided mesh");
        return NULL;
    }
    for (size_t i = 0; i < 3 * c->triangle_count; i++) {
        const bool two = i + 1 < 3 * c->triangle_count && is_edge(&sides[i], &sides[i + 1]);
        add_neighbour(c, &all[sides[i].low], sides[i].high, !two);
        add_neighbour(c, &all[sides[i].high], sides[i].low, !two);
        i += two;
    }
    return all;
}

/* The vertex with `weight` of each of its neighbours, of those along the boundary where it lies on one. One without
 * neighbours, whose inner weight is not finite, stays where it is. */
static void blend_vertex(const double *point, const neighbours *at, double inner_weight, double boundary_weight,
                         double result[3])
{
    const bool boundary = at->boundary_count > 0;
    const uint32_t count = boundary ? at->boundary_count : at->count;
    const double weight = count == 0 ? 0.0 : boundary ? boundary_weight : inner_weight;
    const double *sum = boundary ? at->boundary_sum : at->sum;
    for (int i = 0; i < 3; i++) result[i] = (1.0 - count * weight) * point[i] + weight * sum[i];
}

static double inner_weight(uint32_t count) { return count == 3 ? 3.0 / 16.0 : 3.0 / (8.0 * count); }

/* The middle of an edge; `second` is NULL on a boundary. */
static void split_edge(const control *c, const side *first, const side *second, double result[3])
{
    const double *a = c->points + 3 * (size_t)first->low, *b = c->points + 3 * (size_t)first->high;
    const double *left = c->points + 3 * (size_t)first->across;
    const double *right = second ? c->points + 3 * (size_t)second->across : NULL;
    for (int i = 0; i < 3; i++)
        result[i] = right ? 0.375 * (a[i] + b[i]) + 0.125 * (left[i] + right[i]) : 0.5 * (a[i] + b[i]);
}

static void move_vertices(const control *c, const neighbours *all, control *finer)
{
    for (size_t v = 0; v < c->vertex_count; v++)
        blend_vertex(c->points + 3 * v, &all[v], inner_weight(all[v].count), 0.125, finer->points + 3 * v);
}

/* New vertices behind the old ones, one an edge; `middles` gets that of each side. */
static void split_edges(const control *c, const side *sides, control *finer, uint32_t *middles)
{
    for (size_t i = 0; i < 3 * c->triangle_count; i++) {
        const bool two = i + 1 < 3 * c->triangle_count && is_edge(&sides[i], &sides[i + 1]);
        split_edge(c, &sides[i], two ? &sides[i + 1] : NULL, finer->points + 3 * finer->vertex_count);
        middles[sides[i].place] = (uint32_t)finer->vertex_count;
        if (two) middles[sides[i + 1].place] = (uint32_t)finer->vertex_count;
        finer->vertex_count++;
        i += two;
    }
}

static void split_triangles(const control *c, const uint32_t *middles, control *finer)
{
    for (size_t t = 0; t < c->triangle_count; t++) {
        const uint32_t *a = c->corners + 3 * t, *m = middles + 3 * t;
        const uint32_t corners[12] = {a[0], m[0], m[2], a[1], m[1], m[0], a[2], m[2], m[1], m[0], m[1], m[2]};
        memcpy(finer->corners + 12 * t, corners, sizeof corners);
    }
}

/* One level; the finer mesh takes the place of the coarser. */
static bool subdivide(ca_pbrt *p, control *c)
{
    if (!ca_pbrt_spend_triangles(p, 4 * c->triangle_count)) return false;
    side *sides = sort_sides(p, c);
    neighbours *all = sides ? sum_neighbours(p, c, sides) : NULL;
    uint32_t *middles = ca_alloc(3 * c->triangle_count, sizeof *middles);
    control finer = {.points = ca_alloc(3 * (c->vertex_count + 3 * c->triangle_count), sizeof(double)),
                     .corners = ca_alloc(12 * c->triangle_count, sizeof(uint32_t)),
                     .vertex_count = c->vertex_count,
                     .triangle_count = 4 * c->triangle_count};
    if (!middles || !finer.points || !finer.corners) {
        ca_import_fail_memory(p->importer, "a subdivided mesh");
    } else if (sides && all) {
        move_vertices(c, all, &finer);
        split_edges(c, sides, &finer, middles);
        split_triangles(c, middles, &finer);
        control coarse = *c;
        *c = finer;
        finer = coarse;
    }
    free_control(&finer);
    ca_free(sides);
    ca_free(all);
    ca_free(middles);
    return ca_import_good(p->importer);
}

/* Vertices to where further levels would carry them. */
static bool put_limit(ca_pbrt *p, const control *c, ca_mesh *mesh)
{
    side *sides = sort_sides(p, c);
    neighbours *all = sides ? sum_neighbours(p, c, sides) : NULL;
    for (size_t v = 0; sides && all && v < c->vertex_count; v++) {
        double limit[3];
        const double inner = 1.0 / (all[v].count + 3.0 / (8.0 * inner_weight(all[v].count)));
        blend_vertex(c->points + 3 * v, &all[v], inner, 0.2, limit);
        for (size_t i = 0; i < 3; i++) mesh->positions[3 * v + i] = (float)limit[i];
    }
    ca_free(sides);
    ca_free(all);
    return ca_import_good(p->importer);
}

static bool make_mesh(ca_pbrt *p, const control *c, ca_mesh *mesh)
{
    ca_error reason;
    if (!create(p, c->vertex_count, c->triangle_count, false, mesh)) return false;
    memcpy(mesh->indices, c->corners, 3 * c->triangle_count * sizeof *c->corners);
    const ca_status status = put_limit(p, c, mesh) ? ca_mesh_compute_normals(mesh, 0, &reason) : CA_ERROR_SCENE;
    if (status == CA_OK) return true;
    ca_import_fail_file(p->importer, &p->params.where, status, &reason);
    ca_mesh_destroy(mesh);
    return false;
}

bool ca_pbrt_subdivide(ca_pbrt *p, const double *points, size_t point_count, const double *indices,
                       size_t index_count, uint32_t levels, ca_mesh *mesh)
{
    control c = {.points = ca_alloc(3 * point_count, sizeof(double)),
                 .corners = ca_alloc(index_count, sizeof(uint32_t)),
                 .vertex_count = point_count,
                 .triangle_count = index_count / 3};
    if (!c.points || !c.corners) {
        ca_import_fail_memory(p->importer, "a subdivided mesh");
        free_control(&c);
        return false;
    }
    memcpy(c.points, points, 3 * point_count * sizeof *points);
    for (size_t i = 0; i < index_count; i++) c.corners[i] = (uint32_t)indices[i];
    for (uint32_t level = 0; level < levels && ca_import_good(p->importer); level++) subdivide(p, &c);
    const bool good = ca_import_good(p->importer) && make_mesh(p, &c, mesh);
    free_control(&c);
    return good;
}
