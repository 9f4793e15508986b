#include "geometry/mesh.h"

#include "base/loading.h"
#include "base/memory.h"
#include "base/parallel.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static const size_t max_vertices = ((size_t)1 << 31) - 1;
static const size_t max_triangles = (size_t)1 << 30;

ca_status ca_mesh_begin(ca_mesh *mesh, size_t vertex_count, size_t triangle_count, ca_error *error)
{
    *mesh = (ca_mesh){0};
    if (vertex_count > max_vertices || triangle_count > max_triangles)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                       "a mesh of %zu vertices and %zu triangles is over the limit of %zu and %zu", vertex_count,
                       triangle_count, max_vertices, max_triangles);
    mesh->owners = ca_alloc_zeroed(1, sizeof *mesh->owners);
    if (!mesh->owners) return ca_fail_memory(error, "mesh");
    atomic_init(&mesh->owners->count, 1);
    mesh->vertex_count = (uint32_t)vertex_count;
    mesh->triangle_count = (uint32_t)triangle_count;
    return CA_OK;
}

ca_status ca_mesh_create(ca_mesh *mesh, size_t vertex_count, size_t triangle_count, bool normals, bool uvs,
                         ca_error *error)
{
    CA_TRY(ca_mesh_begin(mesh, vertex_count, triangle_count, error));
    mesh->positions = ca_alloc_zeroed(3 * vertex_count + 1, sizeof *mesh->positions);
    mesh->indices = ca_alloc_zeroed(3 * triangle_count, sizeof *mesh->indices);
    if (normals) mesh->normals = ca_alloc_zeroed(3 * vertex_count, sizeof *mesh->normals);
    if (uvs) mesh->uvs = ca_alloc_zeroed(2 * vertex_count, sizeof *mesh->uvs);
    if (!mesh->positions || !mesh->indices || (normals && !mesh->normals) || (uvs && !mesh->uvs)) {
        ca_mesh_destroy(mesh);
        return ca_fail_memory(error, "mesh");
    }
    return CA_OK;
}

static void free_arrays(ca_mesh *mesh, unsigned lent)
{
    for (uint32_t i = 0; i < mesh->attribute_count; ++i) {
        ca_free(mesh->attributes[i].name);
        ca_free(mesh->attributes[i].values);
    }
    ca_free(mesh->attributes);
    ca_free(mesh->normals);
    if (!(lent & CA_MESH_POSITIONS)) ca_free(mesh->positions);
    if (!(lent & CA_MESH_UVS)) ca_free(mesh->uvs);
    if (!(lent & CA_MESH_INDICES)) ca_free(mesh->indices);
}

void ca_mesh_destroy(ca_mesh *mesh)
{
    ca_mesh_owners *owners = mesh->owners;
    if (!owners) {
        free_arrays(mesh, 0);
    } else if (atomic_fetch_sub(&owners->count, 1) == 1) {
        free_arrays(mesh, owners->lent);
        ca_mesh_lender_drop(owners->lender);
        ca_free(owners);
    }
    *mesh = (ca_mesh){0};
}

ca_mesh ca_mesh_share(const ca_mesh *mesh)
{
    assert(mesh->owners);
    atomic_fetch_add(&mesh->owners->count, 1);
    return *mesh;
}

ca_mesh_lender *ca_mesh_lender_create(void (*release)(void *user), void *user)
{
    ca_mesh_lender *lender = ca_alloc_zeroed(1, sizeof *lender);
    if (!lender) return NULL;
    atomic_init(&lender->users, 1);
    lender->release = release;
    lender->user = user;
    return lender;
}

void ca_mesh_lender_drop(ca_mesh_lender *lender)
{
    if (!lender || atomic_fetch_sub(&lender->users, 1) != 1) return;
    lender->release(lender->user);
    ca_free(lender);
}

void ca_mesh_borrow(ca_mesh *mesh, ca_mesh_lender *lender, unsigned lent)
{
    assert(!mesh->owners->lender);
    if (lent == 0) return;
    atomic_fetch_add(&lender->users, 1);
    mesh->owners->lender = lender;
    mesh->owners->lent = lent;
}

typedef struct lent_arrays {
    float *uvs, *positions;
    uint32_t *indices;
} lent_arrays;

static void free_lent_arrays(void *user)
{
    lent_arrays *arrays = user;
    ca_free(arrays->uvs);
    ca_free(arrays->positions);
    ca_free(arrays->indices);
    ca_free(arrays);
}

ca_status ca_mesh_lend(ca_mesh *mesh, unsigned lent, ca_error *error)
{
    if (mesh->owners->lender) return CA_OK;
    lent_arrays *arrays = ca_alloc_zeroed(1, sizeof *arrays);
    ca_mesh_lender *lender = arrays ? ca_mesh_lender_create(free_lent_arrays, arrays) : NULL;
    if (!lender) {
        ca_free(arrays);
        return ca_fail_memory(error, "mesh");
    }
    if (lent & CA_MESH_UVS) arrays->uvs = mesh->uvs;
    if (lent & CA_MESH_POSITIONS) arrays->positions = mesh->positions;
    if (lent & CA_MESH_INDICES) arrays->indices = mesh->indices;
    ca_mesh_borrow(mesh, lender, lent);
    ca_mesh_lender_drop(lender);
    return CA_OK;
}

static size_t attribute_length(const ca_mesh *mesh, const ca_mesh_attribute *attribute)
{
    return (size_t)attribute->components * (attribute->per_face ? mesh->triangle_count : mesh->vertex_count);
}

ca_status ca_mesh_add_attribute(ca_mesh *mesh, const char *name, uint32_t components, bool per_face, float **values,
                                ca_error *error)
{
    assert(components >= 1 && components <= 4 && !ca_mesh_find_attribute(mesh, name));
    const size_t name_size = strlen(name) + 1;
    size_t capacity = mesh->attribute_count;
    ca_mesh_attribute *attributes =
        ca_array_grow(mesh->attributes, &capacity, (size_t)mesh->attribute_count + 1, sizeof *attributes);
    if (!attributes) return ca_fail_memory(error, "mesh attribute");
    mesh->attributes = attributes;

    ca_mesh_attribute attribute = {.components = components, .per_face = per_face};
    attribute.name = ca_alloc(name_size, 1);
    attribute.values = ca_alloc_zeroed(attribute_length(mesh, &attribute), sizeof *attribute.values);
    if (!attribute.name || !attribute.values) {
        ca_free(attribute.name);
        ca_free(attribute.values);
        return ca_fail_memory(error, "mesh attribute");
    }
    memcpy(attribute.name, name, name_size);
    mesh->attributes[mesh->attribute_count++] = attribute;
    *values = attribute.values;
    return CA_OK;
}

static ca_status copy_attributes(const ca_mesh *from, ca_mesh *mesh, ca_error *error)
{
    for (uint32_t i = 0; i < from->attribute_count; ++i) {
        const ca_mesh_attribute *attribute = &from->attributes[i];
        float *values;
        CA_TRY(ca_mesh_add_attribute(mesh, attribute->name, attribute->components, attribute->per_face, &values,
                                     error));
        memcpy(values, attribute->values, attribute_length(from, attribute) * sizeof *values);
    }
    return CA_OK;
}

typedef struct array_copy {
    uint32_t *to;
    const uint32_t *from;
} array_copy;

static void copy_range(void *user, ca_range range)
{
    const array_copy *copy = user;
    memcpy(copy->to + range.begin, copy->from + range.begin, 4 * (range.end - range.begin));
}

static void *copy_array(const void *values, size_t count)
{
    uint32_t *to = values ? ca_alloc_large(count + 1, sizeof *to) : NULL;
    if (!to) return NULL;
    array_copy copy = {to, values};
    ca_parallel_ranges(count, copy_range, &copy);
    to[count] = 0;
    return to;
}

void *ca_mesh_take_array(const void *values, size_t count, bool lent)
{
    if (lent) return (void *)(uintptr_t)values; /* nobody writes to what is lent */
    return copy_array(values, count);
}

ca_status ca_mesh_copy(const ca_mesh *from, unsigned shared, ca_mesh *mesh, ca_error *error)
{
    const size_t vertices = from->vertex_count, triangles = from->triangle_count;
    CA_TRY(ca_mesh_begin(mesh, vertices, triangles, error));
    shared &= from->owners->lent;
    ca_mesh_borrow(mesh, from->owners->lender, shared);
    mesh->positions = ca_mesh_take_array(from->positions, 3 * vertices, shared & CA_MESH_POSITIONS);
    mesh->indices = ca_mesh_take_array(from->indices, 3 * triangles, shared & CA_MESH_INDICES);
    mesh->normals = ca_mesh_take_array(from->normals, 3 * vertices, false);
    mesh->uvs = ca_mesh_take_array(from->uvs, 2 * vertices, shared & CA_MESH_UVS);
    mesh->content_hash = from->content_hash;
    const bool missing = !mesh->positions || !mesh->indices || (from->normals && !mesh->normals) ||
                         (from->uvs && !mesh->uvs);
    ca_status status = missing ? ca_fail_memory(error, "mesh") : copy_attributes(from, mesh, error);
    if (status == CA_OK) status = ca_loading_check(error);
    if (status != CA_OK) ca_mesh_destroy(mesh);
    return status;
}

const ca_mesh_attribute *ca_mesh_find_attribute(const ca_mesh *mesh, const char *name)
{
    for (uint32_t i = 0; i < mesh->attribute_count; ++i)
        if (strcmp(mesh->attributes[i].name, name) == 0) return &mesh->attributes[i];
    return NULL;
}

static ca_vec3 load3(const float *values) { return (ca_vec3){values[0], values[1], values[2]}; }

static void store3(float *values, ca_vec3 v)
{
    values[0] = v.x;
    values[1] = v.y;
    values[2] = v.z;
}

/* A zero vector stays zero: readers of normals fall back on the face's own where the sum of corners has no length. A
 * unit vector whose components were rounded stays as it is (its squared length is off by less than 2^-23), so that
 * normals that were written to a file are the same when they are read. */
static ca_vec3 unit_or_zero(ca_vec3 v)
{
    const double x = (double)v.x, y = (double)v.y, z = (double)v.z;
    const double length2 = x * x + y * y + z * z; /* floats squared neither overflow nor vanish in double */
    if (fabs(length2 - 1.0) < 0x1p-23) return v;
    const double length = sqrt(length2);
    if (!(length > 0.0) || !isfinite(length)) return (ca_vec3){0};
    return (ca_vec3){(float)(x / length), (float)(y / length), (float)(z / length)};
}

static void normalize_range(void *user, ca_range range)
{
    float *normals = user;
    for (size_t v = range.begin; v < range.end; ++v) store3(normals + 3 * v, unit_or_zero(load3(normals + 3 * v)));
}

void ca_mesh_normalize_normals(ca_mesh *mesh)
{
    if (mesh->normals) ca_parallel_ranges(mesh->vertex_count, normalize_range, mesh->normals);
}

static void reverse_range(void *user, ca_range range)
{
    uint32_t *indices = user;
    for (size_t t = range.begin; t < range.end; ++t) {
        uint32_t *corners = indices + 3 * t;
        const uint32_t second = corners[1];
        corners[1] = corners[2];
        corners[2] = second;
    }
}

static void reverse_triangles(ca_mesh *mesh)
{
    ca_parallel_ranges(mesh->triangle_count, reverse_range, mesh->indices);
}

typedef struct mapping {
    ca_mesh *mesh;
    const ca_affine *map;
} mapping;

static void map_positions(void *user, ca_range range)
{
    const mapping *m = user;
    for (size_t v = range.begin; v < range.end; ++v) {
        float *position = m->mesh->positions + 3 * v;
        store3(position, ca_map_point(m->map->to, load3(position)));
    }
}

static void map_normals(void *user, ca_range range)
{
    const mapping *m = user;
    for (size_t v = range.begin; v < range.end; ++v) {
        float *normal = m->mesh->normals + 3 * v;
        store3(normal, unit_or_zero(ca_map_normal(m->map->from, load3(normal))));
    }
}

void ca_mesh_transform(ca_mesh *mesh, const ca_affine *map)
{
    mapping m = {mesh, map};
    if (!ca_affine_is_identity(map)) ca_parallel_ranges(mesh->vertex_count, map_positions, &m);
    if (mesh->normals) ca_parallel_ranges(mesh->vertex_count, map_normals, &m);
    if (ca_affine_mirrors(map)) reverse_triangles(mesh);
}

static void negate_range(void *user, ca_range range)
{
    float *normals = user;
    for (size_t i = 3 * range.begin; i < 3 * range.end; ++i) normals[i] = -normals[i];
}

void ca_mesh_flip_normals(ca_mesh *mesh)
{
    reverse_triangles(mesh);
    if (mesh->normals) ca_parallel_ranges(mesh->vertex_count, negate_range, mesh->normals);
}

void ca_mesh_drop_normals(ca_mesh *mesh)
{
    ca_free(mesh->normals);
    mesh->normals = NULL;
}

/* Corners in double precision: large coordinates and small triangles then keep their normals and areas. */
static void load_triangle(const ca_mesh *mesh, size_t triangle, double p[3][3])
{
    for (int k = 0; k < 3; ++k) {
        const float *position = mesh->positions + (size_t)3 * mesh->indices[3 * triangle + (size_t)k];
        for (int i = 0; i < 3; ++i) p[k][i] = (double)position[i];
    }
}

static void edge(const double from[3], const double to[3], double result[3])
{
    for (int i = 0; i < 3; ++i) result[i] = to[i] - from[i];
}

static void cross(const double a[3], const double b[3], double result[3])
{
    result[0] = a[1] * b[2] - a[2] * b[1];
    result[1] = a[2] * b[0] - a[0] * b[2];
    result[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* By how much the rounding of normals and corners may turn a triangle's normal, in radians: the corners' over the
 * height on the longest edge. At most 1e-4: the normal of a smaller triangle is worse than those of its vertices. */
static double normal_rounding(double p[3][3], double edges[2][3], double length_of_normal)
{
    double extent = 0.0, third[3];
    for (int i = 0; i < 9; i++) extent = fmax(extent, fabs(p[i / 3][i % 3]));
    edge(p[1], p[2], third);
    const double longest =
        sqrt(fmax(fmax(dot(edges[0], edges[0]), dot(edges[1], edges[1])), dot(third, third)));
    return fmin(1e-6 + 4.0 * extent * 0x1p-24 * longest / length_of_normal, 1e-4);
}

static bool is_flat(const ca_mesh *mesh, size_t triangle)
{
    double p[3][3], edges[2][3], n[3], across[3];
    load_triangle(mesh, triangle, p);
    for (int i = 0; i < 2; i++) edge(p[0], p[i + 1], edges[i]);
    cross(edges[0], edges[1], n);
    const double length = sqrt(dot(n, n));
    const double sine = length > 0.0 ? normal_rounding(p, edges, length) : 0.0;
    for (int k = 0; k < 3; k++) {
        const float *corner = mesh->normals + 3 * (size_t)mesh->indices[3 * triangle + (size_t)k];
        const double m[3] = {(double)corner[0], (double)corner[1], (double)corner[2]};
        cross(n, m, across);
        if (!(dot(n, m) > 0.0 && sqrt(dot(across, across)) <= sine * length * sqrt(dot(m, m)))) return false;
    }
    return true;
}

typedef struct flatness {
    const ca_mesh *mesh;
    atomic_bool curved;
} flatness;

static void search_curved(void *user, ca_range range)
{
    flatness *f = user;
    for (size_t t = range.begin; t < range.end && !atomic_load_explicit(&f->curved, memory_order_relaxed); t++)
        if (!is_flat(f->mesh, t)) atomic_store(&f->curved, true);
}

bool ca_mesh_normals_are_flat(const ca_mesh *mesh)
{
    flatness f = {.mesh = mesh, .curved = false};
    if (!mesh->normals) return false;
    ca_parallel_ranges(mesh->triangle_count, search_curved, &f);
    return !atomic_load(&f.curved);
}

double ca_mesh_triangle_area(const ca_mesh *mesh, uint32_t triangle)
{
    double p[3][3], a[3], b[3], n[3];
    load_triangle(mesh, triangle, p);
    edge(p[0], p[1], a);
    edge(p[0], p[2], b);
    cross(a, b, n);
    return 0.5 * sqrt(dot(n, n));
}

/* Results of ranges, which are joined in their order. */
typedef struct measures {
    const ca_mesh *mesh;
    double areas[CA_RANGES];
    ca_vec3 low[CA_RANGES], high[CA_RANGES];
} measures;

static void add_areas(void *user, ca_range range)
{
    measures *m = user;
    double area = 0.0;
    for (size_t t = range.begin; t < range.end; t++) area += ca_mesh_triangle_area(m->mesh, (uint32_t)t);
    m->areas[range.number] = area;
}

static void find_bounds(void *user, ca_range range)
{
    measures *m = user;
    ca_vec3 low = {INFINITY, INFINITY, INFINITY}, high = ca_neg(low);
    for (size_t v = range.begin; v < range.end; v++) {
        const ca_vec3 position = load3(m->mesh->positions + 3 * v);
        low = ca_min_vec3(low, position);
        high = ca_max_vec3(high, position);
    }
    m->low[range.number] = low, m->high[range.number] = high;
}

void ca_mesh_bounds(const ca_mesh *mesh, ca_vec3 *low, ca_vec3 *high)
{
    measures m = {.mesh = mesh};
    const uint32_t ranges = ca_parallel_ranges(mesh->vertex_count, find_bounds, &m);
    *low = (ca_vec3){INFINITY, INFINITY, INFINITY}, *high = ca_neg(*low);
    for (uint32_t i = 0; i < ranges; i++) {
        *low = ca_min_vec3(*low, m.low[i]);
        *high = ca_max_vec3(*high, m.high[i]);
    }
}

void ca_mesh_measure(ca_mesh *mesh)
{
    measures m = {.mesh = mesh};
    const uint32_t ranges = ca_parallel_ranges(mesh->triangle_count, add_areas, &m);
    mesh->area = 0.0;
    for (uint32_t i = 0; i < ranges; i++) mesh->area += m.areas[i];
    ca_mesh_bounds(mesh, &mesh->low, &mesh->high);
}

size_t ca_mesh_bytes(const ca_mesh *mesh)
{
    size_t floats = (size_t)3 * mesh->vertex_count + 1;
    if (mesh->normals) floats += (size_t)3 * mesh->vertex_count;
    if (mesh->uvs) floats += (size_t)2 * mesh->vertex_count;
    for (uint32_t i = 0; i < mesh->attribute_count; ++i) floats += attribute_length(mesh, &mesh->attributes[i]);
    return floats * sizeof(float) + (size_t)3 * mesh->triangle_count * sizeof(uint32_t);
}

/* Of four bytes each, of which none may be so large. */
typedef struct value_check {
    const void *values;
    uint32_t limit, mask; /* of what is compared */
    atomic_bool failed;
} value_check;

/* Without a way out, so that compilers vectorise it. */
static void check_range(void *user, ca_range range)
{
    value_check *check = user;
    const unsigned char *values = check->values;
    const uint32_t mask = check->mask;
    uint32_t largest = 0;
    for (size_t i = range.begin; i < range.end; ++i) {
        uint32_t bits;
        memcpy(&bits, values + 4 * i, 4);
        largest = largest > (bits & mask) ? largest : bits & mask;
    }
    if (largest >= check->limit) atomic_store(&check->failed, true);
}

static bool are_below(const void *values, size_t count, uint32_t mask, uint32_t limit)
{
    value_check check = {.values = values, .limit = limit, .mask = mask, .failed = false};
    ca_parallel_ranges(count, check_range, &check);
    return !atomic_load(&check.failed);
}

/* Index of the first value that is not finite, or `count`. Bits of floats but for the sign, as a number, rise with
 * their size; infinity has these. */
static size_t find_not_finite(const float *values, size_t count)
{
    if (are_below(values, count, UINT32_C(0x7fffffff), UINT32_C(0x7f800000))) return count;
    size_t i = 0;
    while (i < count && isfinite(values[i])) ++i;
    return i;
}

static ca_status check_indices(const ca_mesh *mesh, const ca_location *where, ca_error *error)
{
    const size_t count = (size_t)3 * mesh->triangle_count;
    if (are_below(mesh->indices, count, UINT32_MAX, mesh->vertex_count)) return CA_OK;
    size_t i = 0;
    while (i + 1 < count && mesh->indices[i] < mesh->vertex_count) ++i;
    return ca_fail(error, CA_ERROR_FORMAT, where, "triangle %zu uses vertex %u, but there are only %u", i / 3,
                   mesh->indices[i], mesh->vertex_count);
}

static ca_status check_vertex_values(const ca_mesh *mesh, const float *values, size_t components, const char *what,
                                     const ca_location *where, ca_error *error)
{
    if (!values) return CA_OK;
    const size_t count = components * mesh->vertex_count;
    const size_t bad = find_not_finite(values, count);
    if (bad == count) return CA_OK;
    return ca_fail(error, CA_ERROR_FORMAT, where, "the %s of vertex %zu is not a finite number", what,
                   bad / components);
}

ca_status ca_mesh_validate(const ca_mesh *mesh, const char *path, ca_error *error)
{
    const ca_location where = {.file = path};
    if (mesh->triangle_count == 0 || mesh->vertex_count == 0)
        return ca_fail(error, CA_ERROR_FORMAT, &where, "the mesh has no faces");
    CA_TRY(check_indices(mesh, &where, error));
    CA_TRY(check_vertex_values(mesh, mesh->positions, 3, "position", &where, error));
    CA_TRY(check_vertex_values(mesh, mesh->normals, 3, "normal", &where, error));
    CA_TRY(check_vertex_values(mesh, mesh->uvs, 2, "uv", &where, error));
    for (uint32_t i = 0; i < mesh->attribute_count; ++i) {
        const ca_mesh_attribute *attribute = &mesh->attributes[i];
        const size_t count = attribute_length(mesh, attribute);
        const size_t bad = find_not_finite(attribute->values, count);
        if (bad < count)
            return ca_fail(error, CA_ERROR_FORMAT, &where, "the attribute \"%s\" of %s %zu is not a finite number",
                           attribute->name, attribute->per_face ? "triangle" : "vertex", bad / attribute->components);
    }
    return ca_loading_check(error);
}

/* A square of two triangles around `center` with the half sides u and v, along which uv run from 0 to 1. It faces
 * `normal`, which is u x v or its opposite. */
static void add_square(ca_mesh *mesh, uint32_t square, ca_vec3 center, ca_vec3 normal, ca_vec3 u, ca_vec3 v)
{
    static const float corner_uv[4][2] = {{0.0f, 0.0f}, {1.0f, 0.0f}, {1.0f, 1.0f}, {0.0f, 1.0f}};
    static const uint32_t corners[2][6] = {{0, 1, 2, 0, 2, 3}, {0, 2, 1, 0, 3, 2}};
    for (uint32_t k = 0; k < 4; ++k) {
        const size_t vertex = 4 * (size_t)square + k;
        const ca_vec3 along_u = ca_madd(center, 2.0f * corner_uv[k][0] - 1.0f, u);
        store3(mesh->positions + 3 * vertex, ca_madd(along_u, 2.0f * corner_uv[k][1] - 1.0f, v));
        store3(mesh->normals + 3 * vertex, normal);
        memcpy(mesh->uvs + 2 * vertex, corner_uv[k], sizeof corner_uv[k]);
    }
    const uint32_t *order = corners[ca_dot(ca_cross(u, v), normal) < 0.0f];
    for (size_t i = 0; i < 6; ++i) mesh->indices[6 * (size_t)square + i] = 4 * square + order[i];
}

ca_status ca_mesh_create_rectangle(ca_mesh *mesh, ca_error *error)
{
    const ca_vec3 x = {1.0f, 0.0f, 0.0f}, y = {0.0f, 1.0f, 0.0f}, z = {0.0f, 0.0f, 1.0f};
    CA_TRY(ca_mesh_create(mesh, 4, 2, true, true, error));
    add_square(mesh, 0, (ca_vec3){0}, z, x, y);
    return CA_OK;
}

/* Faces and the directions of u and v on each as in Mitsuba 3 (src/shapes/cube.cpp): u x v points inwards. */
ca_status ca_mesh_create_cube(ca_mesh *mesh, ca_error *error)
{
    static const ca_vec3 faces[6][3] = {
        /* normal              u                    v */
        {{0.0f, -1.0f, 0.0f}, {0.0f, 0.0f, 1.0f}, {1.0f, 0.0f, 0.0f}},
        {{0.0f, 1.0f, 0.0f}, {-1.0f, 0.0f, 0.0f}, {0.0f, 0.0f, -1.0f}},
        {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, -1.0f}},
        {{0.0f, 0.0f, 1.0f}, {0.0f, 1.0f, 0.0f}, {1.0f, 0.0f, 0.0f}},
        {{-1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, 1.0f}},
        {{0.0f, 0.0f, -1.0f}, {0.0f, -1.0f, 0.0f}, {1.0f, 0.0f, 0.0f}},
    };
    CA_TRY(ca_mesh_create(mesh, 24, 12, true, true, error));
    for (uint32_t f = 0; f < 6; ++f) add_square(mesh, f, faces[f][0], faces[f][0], faces[f][1], faces[f][2]);
    return CA_OK;
}
