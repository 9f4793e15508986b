/* Accessors: typed elements in buffers, dense or sparse. */
#include "import/gltf/reader.h"

#include <math.h>
#include <string.h>

typedef struct element_type {
    uint32_t code;   /* "componentType" */
    uint32_t size;   /* bytes of a component */
    double largest;  /* of a normalised integer */
    bool is_signed;
} element_type;

static const element_type types[] = {{5120, 1, 127.0, true},    {5121, 1, 255.0, false},
                                     {5122, 2, 32767.0, true},  {5123, 2, 65535.0, false},
                                     {5125, 4, 4294967295.0, false}, {5126, 4, 0.0, true}};

static const element_type *type_of(ca_gltf *g, const ca_gltf_value *owner)
{
    const uint64_t code = ca_gltf_count(g, owner, "componentType", 0);
    for (size_t i = 0; i < CA_COUNT(types); i++)
        if (types[i].code == code) return &types[i];
    ca_gltf_fail(g, owner, "componentType must be 5120 to 5123, 5125 or 5126");
    return NULL;
}

/* Components of an element, of vectors and scalars. */
static uint32_t component_count(ca_gltf *g, const ca_gltf_value *accessor)
{
    static const char *const names[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    const char *name = ca_gltf_text(g, accessor, "type", "");
    for (uint32_t i = 0; i < 4; i++)
        if (strcmp(name, names[i]) == 0) return i + 1;
    ca_gltf_fail(g, accessor, "type must be SCALAR, VEC2, VEC3 or VEC4 here, not \"%.20s\"", name);
    return 1;
}

static double component_at(const unsigned char *p, const element_type *type, bool normalized)
{
    uint32_t bits = 0;
    float real;
    for (uint32_t i = 0; i < type->size; i++) bits |= (uint32_t)p[i] << (8 * i);
    memcpy(&real, &bits, sizeof real);
    if (type->code == 5126) return (double)real;
    double value = (double)bits;
    if (type->code == 5120) value = (double)(int8_t)bits;
    if (type->code == 5122) value = (double)(int16_t)bits;
    return normalized ? fmax(value / type->largest, -1.0) : value;
}

/* Where elements lie: checked, so that reading `count` of them stays inside. */
typedef struct element_run {
    const unsigned char *data; /* NULL: all are zero */
    size_t count, stride;
    uint32_t components;
    const element_type *type;
    bool normalized;
} element_run;

static bool place_run(ca_gltf *g, const ca_gltf_value *owner, element_run *run)
{
    size_t view_stride;
    const ca_gltf_value *view = ca_gltf_reference(g, owner, "bufferView", "bufferViews");
    if (!ca_import_good(g->importer) || !view || !run->type) return ca_import_good(g->importer);
    const ca_gltf_bytes bytes = ca_gltf_view(g, view, &view_stride);
    const uint64_t offset = ca_gltf_count(g, owner, "byteOffset", 0);
    if (!ca_import_good(g->importer)) return false;
    const size_t element = (size_t)run->components * run->type->size;
    run->stride = view_stride ? view_stride : element;
    if (run->stride < element) ca_gltf_fail(g, view, "byteStride is less than an element of %zu bytes", element);
    const bool fits = offset <= bytes.size && element <= bytes.size - offset &&
                      run->count - 1 <= (bytes.size - offset - element) / run->stride;
    if (!fits) ca_gltf_fail(g, owner, "%zu elements do not fit in the buffer view", run->count);
    run->data = bytes.data + offset;
    return ca_import_good(g->importer);
}

size_t ca_gltf_element_count(ca_gltf *g, const ca_gltf_value *accessor)
{
    const uint64_t count = ca_gltf_count(g, accessor, "count", 0);
    if (count > 0 && count <= INT32_MAX) return ca_import_good(g->importer) ? (size_t)count : 0;
    ca_gltf_fail(g, accessor, "count must be from 1 to 2^31 - 1");
    return 0;
}

static bool open_run(ca_gltf *g, const ca_gltf_value *accessor, element_run *run)
{
    *run = (element_run){.count = ca_gltf_element_count(g, accessor),
                         .components = component_count(g, accessor),
                         .type = type_of(g, accessor),
                         .normalized = ca_gltf_boolean(g, accessor, "normalized", false)};
    return ca_import_good(g->importer) && place_run(g, accessor, run);
}

/* Element i as `wanted` numbers; what it lacks is 1. */
static void read_element(const element_run *run, size_t i, uint32_t wanted, double *numbers)
{
    for (uint32_t c = 0; c < wanted; c++) {
        const unsigned char *at = run->data ? run->data + i * run->stride + (size_t)c * run->type->size : NULL;
        numbers[c] = c >= run->components ? 1.0 : at ? component_at(at, run->type, run->normalized) : 0.0;
    }
}

/* ---- Sparse elements ------------------------------------------------------------------------------------------- */

typedef struct sparse_runs {
    element_run indices, values;
} sparse_runs;

/* False where there are none, or after failing. */
static bool open_sparse(ca_gltf *g, const ca_gltf_value *accessor, const element_run *run, sparse_runs *sparse)
{
    const ca_gltf_value *object = ca_gltf_object(g, accessor, "sparse");
    if (!object) return false;
    const ca_gltf_value *indices = ca_gltf_object(g, object, "indices");
    const ca_gltf_value *values = ca_gltf_object(g, object, "values");
    const uint64_t count = ca_gltf_count(g, object, "count", 0);
    if (!indices || !values || count == 0 || count > run->count) {
        ca_gltf_fail(g, object, "needs indices, values and a count of at most that of the accessor");
        return false;
    }
    sparse->indices = (element_run){.count = (size_t)count, .components = 1, .type = type_of(g, indices)};
    sparse->values = *run;
    sparse->values.count = (size_t)count;
    sparse->values.data = NULL;
    if (!place_run(g, indices, &sparse->indices) || !place_run(g, values, &sparse->values)) return false;
    if (sparse->indices.data && sparse->values.data) return true;
    ca_gltf_fail(g, object, "indices and values need buffer views");
    return false;
}

/* The element that number `i` of the sparse ones replaces; SIZE_MAX after failing. */
static size_t sparse_target(ca_gltf *g, const ca_gltf_value *accessor, const element_run *run,
                            const sparse_runs *sparse, size_t i)
{
    double target;
    read_element(&sparse->indices, i, 1, &target);
    if (target >= 0.0 && target < (double)run->count && target == floor(target)) return (size_t)target;
    ca_gltf_fail(g, accessor, "a sparse index is %g, and there are %zu elements", target, run->count);
    return SIZE_MAX;
}

/* ---- Reading --------------------------------------------------------------------------------------------------- */

/* Gives each element to `take`, those that sparse ones replace again. */
typedef bool (*element_taker)(ca_gltf *g, const ca_gltf_value *accessor, size_t i, const double *numbers, void *user);

static bool read_all(ca_gltf *g, const ca_gltf_value *accessor, uint32_t wanted, uint32_t least, element_taker take,
                     void *user)
{
    element_run run;
    sparse_runs sparse;
    double numbers[4];
    if (!open_run(g, accessor, &run)) return false;
    if (run.components < least || run.components > wanted) {
        ca_gltf_fail(g, accessor, "has elements of %u components, and %u are expected", run.components, wanted);
        return false;
    }
    for (size_t i = 0; i < run.count; i++) {
        read_element(&run, i, wanted, numbers);
        if (!take(g, accessor, i, numbers, user)) return false;
    }
    const size_t count = open_sparse(g, accessor, &run, &sparse) ? sparse.indices.count : 0;
    for (size_t i = 0; i < count; i++) {
        const size_t target = sparse_target(g, accessor, &run, &sparse, i);
        if (target == SIZE_MAX) return false;
        read_element(&sparse.values, i, wanted, numbers);
        if (!take(g, accessor, target, numbers, user)) return false;
    }
    return ca_import_good(g->importer);
}

typedef struct float_target {
    float *values;
    uint32_t components;
} float_target;

static bool take_floats(ca_gltf *g, const ca_gltf_value *accessor, size_t i, const double *numbers, void *user)
{
    const float_target *target = user;
    for (uint32_t c = 0; c < target->components; c++) {
        const float value = (float)numbers[c];
        target->values[i * target->components + c] = value;
        if (isfinite(value)) continue;
        ca_gltf_fail(g, accessor, "element %zu is not finite", i);
        return false;
    }
    return true;
}

bool ca_gltf_read_floats(ca_gltf *g, const ca_gltf_value *accessor, uint32_t components, float *values)
{
    float_target target = {values, components};
    return read_all(g, accessor, components, components == 4 ? 3 : components, take_floats, &target);
}

typedef struct index_target {
    uint32_t *values;
    size_t limit;
} index_target;

static bool take_index(ca_gltf *g, const ca_gltf_value *accessor, size_t i, const double *numbers, void *user)
{
    const index_target *target = user;
    if (!(numbers[0] >= 0.0 && numbers[0] < (double)target->limit && numbers[0] == floor(numbers[0]))) {
        ca_gltf_fail(g, accessor, "index %zu is %g, and there are %zu vertices", i, numbers[0], target->limit);
        return false;
    }
    target->values[i] = (uint32_t)numbers[0];
    return true;
}

bool ca_gltf_read_indices(ca_gltf *g, const ca_gltf_value *accessor, size_t limit, uint32_t *values)
{
    index_target target = {values, limit};
    return read_all(g, accessor, 1, 1, take_index, &target);
}
