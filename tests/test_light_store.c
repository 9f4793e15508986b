/* The light store: paths of many workers at once come back whole, with all that their algorithm asks for and no more
 * than promised, memory is kept, and running out of it is reported. */
#include "base/memory.h"
#include "path/light_store.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { PATHS = 20000, SHAPES = 5000 };

/* What a vertex takes in vcm, whose light paths connect and merge. */
static const ca_mis_rules vcm_rules = {
    .hit = CA_HIT_ALWAYS, .next_event = true, .connect = true, .splat = true, .merge = CA_MERGE_ALL};

/* Room for so many paths of vcm. */
static ca_status create(ca_light_store *store, uint32_t paths, uint32_t workers, ca_error *error)
{
    const ca_light_layout layout = ca_light_layout_of(&vcm_rules, SHAPES, true, false);
    return ca_light_store_create(store, &layout, paths, workers, error);
}

typedef struct filling {
    ca_light_store *store;
    uint32_t pass;
} filling;

/* Mostly short, now and then as long as can be; none at all for every seventh. */
static uint32_t length_of(uint32_t path, uint32_t pass)
{
    ca_test_random random = ca_test_random_seed(((uint64_t)pass << 32) + path);
    const uint32_t draw = ca_test_random_u32(&random) % 1000;
    if (path % 7 == 0) return 0;
    return draw == 0 ? CA_PATH_MAX_VERTICES : 2 + draw % 20;
}

/* Which vertices of a path have records, and which of these lie on matte shapes. */
static bool is_capable(uint32_t path, uint32_t i) { return (path + i) % 5 > 0; }
static bool is_matte(uint32_t path, uint32_t i) { return (path + 3 * i) % 4 > 0; }

/* Vertices up to the last record; 0: there is none. */
static uint32_t kept_length_of(uint32_t path, uint32_t pass)
{
    uint32_t count = length_of(path, pass);
    while (count > 1 && !is_capable(path, count - 1)) count--;
    return count > 1 ? count : 0;
}

static void make_path(uint32_t path, uint32_t pass, uint32_t count, ca_path_vertex *densities,
                      ca_light_vertex *vertices)
{
    for (uint32_t i = 0; i < count; i++) {
        vertices[i] = (ca_light_vertex){.throughput = {.r = (float)pass, .g = (float)path, .b = (float)i},
                                        .capable = i > 0 && is_capable(path, i),
                                        .matte = is_matte(path, i),
                                        .point = {.shape = (path + i) % SHAPES,
                                                  .primitive = path,
                                                  .instance = i,
                                                  .position_error = (float)i}};
        densities[i] = (ca_path_vertex){.to_previous = (float)i, .connectable = i > 0 && is_capable(path, i)};
        densities[i].pdf_forward.v = (float)path;
    }
}

static void fill_path(void *user, uint32_t path, uint32_t worker)
{
    const filling *f = user;
    ca_path_vertex densities[CA_PATH_MAX_VERTICES];
    ca_light_vertex vertices[CA_PATH_MAX_VERTICES];
    const uint32_t count = length_of(path, f->pass);
    if (count == 0) return;
    make_path(path, f->pass, count, densities, vertices);
    size_t bytes = 0;
    ca_light_store_add(f->store, worker, path, densities, vertices, count, &bytes);
    assert_true(bytes <= count * (size_t)120);
}

static void fill(ca_light_store *store, uint32_t paths, uint32_t pass, uint32_t workers)
{
    filling f = {store, pass};
    const ca_parallel parallel = {.workers = workers};
    assert_int_equal(ca_parallel_for(&parallel, paths, fill_path, &f, NULL), CA_OK);
}

static void check_densities(const ca_light_store *store, const ca_light_path *path, uint32_t p)
{
    ca_path_vertex densities[CA_PATH_MAX_VERTICES];
    uint32_t connectable = 0;
    ca_light_unpack(&store->layout, ca_light_words_at(store, path->first), path->count, densities);
    for (uint32_t i = 1; i < path->count; i++) {
        connectable += is_capable(p, i);
        assert_true(densities[i].pdf_forward.v == (float)p && densities[i].to_previous == (float)i);
        assert_true(densities[i].connectable == is_capable(p, i) && densities[i].connectable_count == connectable);
    }
}

/* Returns whether the record lies on a matte shape. */
static bool check_record(const ca_light_store *store, uint32_t p, uint32_t rank, uint32_t i, uint32_t pass,
                         const float *place)
{
    const ca_light_layout *layout = &store->layout;
    const ca_light_path *path = &store->paths[p];
    const ca_light_record *record = ca_light_record_at(store, ca_light_record_number(store, path, rank));
    assert_true(record->index == i && record->rank == rank);
    assert_true(record->throughput.r == (float)pass && record->throughput.g == (float)p &&
                record->throughput.b == (float)i);
    assert_ptr_equal(ca_light_record_start(layout, record), ca_light_words_at(store, path->first));
    assert_int_equal(ca_light_record_path(layout, record), p % CA_CHUNK_PATHS);
    const ca_surface_point point = ca_light_record_point(layout, record, is_matte(p, i) ? NULL : place);
    assert_true(point.shape == (p + i) % SHAPES && point.position_error == (float)i);
    assert_true(is_matte(p, i) || (point.primitive == p && point.instance == i));
    return is_matte(p, i);
}

static void check_path(const ca_light_store *store, uint32_t p, uint32_t pass)
{
    const ca_light_path *path = &store->paths[p];
    const float *place = ca_light_words_at(store, path->first) + (size_t)path->records * store->layout.record_words;
    uint32_t rank = 0;
    check_densities(store, path, p);
    for (uint32_t i = 1; i < path->count; i++)
        if (is_capable(p, i) && !check_record(store, p, rank++, i, pass, place)) place += CA_LIGHT_PLACE_WORDS;
    assert_int_equal(path->records, rank);
}

static void check(const ca_light_store *store, uint32_t paths, uint32_t pass)
{
    assert_int_equal(ca_light_store_check(store, NULL), CA_OK);
    for (uint32_t p = 0; p < paths; p++) {
        assert_int_equal(store->paths[p].count, kept_length_of(p, pass));
        if (store->paths[p].count > 0) check_path(store, p, pass);
    }
}

static void test_paths_come_back(void **state)
{
    (void)state;
    for (uint32_t workers = 1; workers <= 8; workers *= 2) {
        ca_light_store store;
        assert_int_equal(create(&store, PATHS, workers, NULL), CA_OK);
        const size_t empty = ca_light_store_bytes(&store);
        for (uint32_t pass = 0; pass < 3; pass++) {
            ca_light_store_clear(&store);
            for (uint32_t p = 0; p < PATHS; p++) assert_int_equal(store.paths[p].count, 0);
            fill(&store, PATHS, pass, workers);
            check(&store, PATHS, pass);
        }
        assert_true(ca_light_store_bytes(&store) > empty + (size_t)PATHS * 480);
        ca_light_store_destroy(&store);
    }
}

static void test_memory_is_kept(void **state)
{
    (void)state;
    ca_light_store store;
    assert_int_equal(create(&store, PATHS, 1, NULL), CA_OK);
    fill(&store, PATHS, 0, 1);
    const size_t bytes = ca_light_store_bytes(&store);
    ca_memory_fail_after(0); /* no allocation from here on */
    for (uint32_t pass = 0; pass < 3; pass++) {
        ca_light_store_clear(&store);
        fill(&store, pass == 1 ? 10 : PATHS, 0, 1);
        check(&store, pass == 1 ? 10 : PATHS, 0);
        assert_int_equal(ca_light_store_bytes(&store), bytes);
    }
    ca_memory_fail_after(-1);
    ca_light_store_destroy(&store);
}

/* A vertex' number tells its chunk, whatever worker made it; the next pass may divide the slabs otherwise. */
static void test_chunks(void **state)
{
    (void)state;
    enum { CHUNKS = 4, WORKERS = 3 };
    ca_light_store store;
    assert_int_equal(create(&store, CHUNKS * PATHS, WORKERS, NULL), CA_OK);
    ca_test_random random = ca_test_random_seed(5);
    for (uint32_t pass = 0; pass < 2; pass++) {
        ca_light_store_clear(&store);
        for (uint32_t c = 0; c < CHUNKS; c++) {
            ca_light_store_begin_chunk(&store, c);
            filling f = {&store, pass};
            for (uint32_t p = 0; p < 1 + 1000 * (pass + c % 2); p++)
                fill_path(&f, c * PATHS + p, ca_test_random_u32(&random) % WORKERS);
        }
        for (uint32_t p = 0; p < CHUNKS * PATHS; p++)
            for (uint32_t i = 0; i < store.paths[p].records; i++)
                assert_int_equal(ca_light_chunk_of(&store, ca_light_record_number(&store, &store.paths[p], i)),
                                 p / PATHS);
    }
    ca_light_store_destroy(&store);
}

/* A chunk that begins forgets its own paths, and no others. */
static void test_chunks_forget(void **state)
{
    (void)state;
    uint32_t paths[] = {0, CA_CHUNK_PATHS - 10, CA_CHUNK_PATHS, CA_CHUNK_PATHS + 50};
    for (uint32_t i = 0; i < 4; i++)
        while (kept_length_of(paths[i], 0) == 0) paths[i]++;
    const uint32_t last = paths[3];
    ca_light_store store;
    assert_int_equal(create(&store, last + 1, 1, NULL), CA_OK);
    for (uint32_t begun = 0; begun < 2; begun++) {
        for (uint32_t i = 0; i < 4; i++) fill_path(&(filling){&store, 0}, paths[i], 0);
        for (uint32_t i = 0; i < 4; i++) assert_true(store.paths[paths[i]].count > 0);
        ca_light_store_begin_chunk(&store, begun);
        for (uint32_t i = 0; i < 4; i++) assert_true((store.paths[paths[i]].count == 0) == (i / 2 == begun));
    }
    ca_light_store_clear(&store);
    assert_int_equal(store.paths[paths[1]].count, 0);
    ca_light_store_destroy(&store);
}

/* As many of the longest paths as were promised fit, by any worker, and no path reaches into its neighbour. */
static void test_longest_paths(void **state)
{
    (void)state;
    enum { LONG_PATHS = 103, WORKERS = 3 };
    ca_light_store store;
    const ca_light_layout layout = ca_light_layout_of(&vcm_rules, SHAPES, true, true); /* the widest there is */
    assert_int_equal(ca_light_store_create(&store, &layout, LONG_PATHS, WORKERS, NULL), CA_OK);
    for (uint32_t p = 0; p < LONG_PATHS; p++) {
        ca_path_vertex densities[CA_PATH_MAX_VERTICES];
        ca_light_vertex vertices[CA_PATH_MAX_VERTICES];
        make_path(p, 0, CA_PATH_MAX_VERTICES, densities, vertices);
        for (uint32_t i = 1; i < CA_PATH_MAX_VERTICES; i++) vertices[i].capable = true, vertices[i].matte = false;
        const uint32_t worker = p < 10 ? p % WORKERS : 1;
        size_t bytes;
        assert_true(ca_light_store_add(&store, worker, p, densities, vertices, CA_PATH_MAX_VERTICES, &bytes));
    }
    for (uint32_t p = 0; p < LONG_PATHS; p++) {
        check_densities(&store, &store.paths[p], p);
        assert_int_equal(store.paths[p].records, CA_PATH_MAX_VERTICES - 1);
        for (uint32_t i = 0; i < store.paths[p].records; i++) {
            const uint32_t number = ca_light_record_number(&store, &store.paths[p], i);
            assert_true(ca_light_record_at(&store, number)->throughput.g == (float)p);
        }
    }
    ca_light_store_destroy(&store);
}

static void test_out_of_slabs(void **state)
{
    (void)state;
    ca_light_store store;
    ca_error error;
    assert_int_equal(create(&store, 4, 1, NULL), CA_OK);
    ca_path_vertex densities[CA_PATH_MAX_VERTICES];
    ca_light_vertex vertices[CA_PATH_MAX_VERTICES];
    size_t bytes;
    uint32_t begun = 0;
    make_path(0, 0, CA_PATH_MAX_VERTICES, densities, vertices);
    while (begun < 1000 && ca_light_store_add(&store, 0, 0, densities, vertices, CA_PATH_MAX_VERTICES, &bytes))
        begun++;
    assert_in_range(begun, 4, 100);
    assert_int_equal(ca_light_store_check(&store, &error), CA_ERROR_MEMORY);
    assert_false(ca_light_store_add(&store, 0, 0, densities, vertices, CA_PATH_MAX_VERTICES, &bytes));
    ca_light_store_clear(&store);
    fill(&store, 4, 1, 1);
    check(&store, 4, 1);
    ca_light_store_destroy(&store);
}

static void test_allocation_failures(void **state)
{
    (void)state;
    ca_light_store store;
    ca_error error;
    for (long n = 0; n < 4; n++) {
        ca_memory_fail_after(n);
        assert_int_equal(create(&store, 100, 2, &error), CA_ERROR_MEMORY);
        ca_memory_fail_after(-1);
        ca_light_store_destroy(&store); /* allowed after a failure */
    }
    for (long n = 0; n < 6; n++) {
        assert_int_equal(create(&store, PATHS, 3, NULL), CA_OK);
        ca_memory_fail_after(n);
        fill(&store, PATHS, 2, 3);
        ca_memory_fail_after(-1);
        assert_int_equal(ca_light_store_check(&store, &error), CA_ERROR_MEMORY);
        if (n % 2) { /* the next pass finds memory again */
            ca_light_store_clear(&store);
            fill(&store, PATHS, 3, 3);
            check(&store, PATHS, 3);
        }
        ca_light_store_destroy(&store);
    }
}

/* ---- Layouts --------------------------------------------------------------------------------------------------- */

static float draw(ca_test_random *random, float low, float high)
{
    return low + (high - low) * (float)(ca_test_random_u32(random) >> 8) * 0x1p-24f;
}

/* A light path as it is walked: footprints follow from each other, all else is random. */
static void walk_path(ca_test_random *random, bool projected, uint32_t count, ca_path_vertex *v,
                      ca_light_vertex *vertices)
{
    for (uint32_t i = 0; i < count; i++) {
        v[i] = (ca_path_vertex){.pdf_forward = {draw(random, 0.0f, 3.0f)}, .cos_ratio = 1.0f};
        if (i + 1 < count) v[i].pdf_reverse.v = draw(random, 0.0f, 2.0f);
        vertices[i] = (ca_light_vertex){.matte = ca_test_random_u32(random) % 2};
        vertices[i].point.position = (ca_vec3){draw(random, -1.0f, 1.0f), (float)i, 0.5f};
        if (i == 0) {
            v[0].next_event_ratio = draw(random, 0.0f, 2.0f);
            v[0].light_choice = draw(random, 0.0f, 1.0f);
            v[0].sqrt_area = draw(random, 0.0f, 1.0f);
            v[0].at_infinity = ca_test_random_u32(random) % 2;
            continue;
        }
        v[i].to_previous = draw(random, 0.0f, 5.0f);
        v[i].distance = draw(random, 0.1f, 4.0f);
        v[i].sqrt_omega = draw(random, 0.0f, 9.0f);
        v[i].sqrt_area = (projected ? v[i - 1].sqrt_area * sqrtf(v[i - 1].cos_ratio) : v[i - 1].sqrt_area) +
                         v[i].distance * v[i].sqrt_omega;
        v[i].spread_reverse = draw(random, 0.0f, 9.0f);
        v[i].cos_ratio = draw(random, 0.2f, 5.0f);
        v[i].photon_density = draw(random, 0.0f, 90.0f);
        v[i].connectable = ca_test_random_u32(random) % 3 > 0;
        v[i].connectable_count =
            (uint16_t)((i > 1 ? v[i - 1].connectable_count : 0) + v[i].connectable);
        vertices[i].capable = v[i].connectable || ca_test_random_u32(random) % 3 > 0;
    }
}

static ca_mis_rules rules_of(ca_reuse_kind kind, bool projected, bool connect)
{
    ca_mis_rules rules = vcm_rules;
    rules.connect = connect;
    rules.merge_limit = UINT32_MAX;
    rules.splat_count = 1.0f;
    rules.merge_area = 1e-3f;
    rules.reuse = (ca_reuse_rules){.kind = kind,
                                   .light_paths = 100.0f,
                                   .merge_area = 1e-3f,
                                   .epsilon = 0.01f,
                                   .c = 0.5f,
                                   .projected = projected};
    return rules;
}

/* A merge at the light path's last vertex, and an edge to it, from a camera path of its own making. */
static void weights_of(const ca_mis_rules *rules, const ca_path_vertex *camera, const ca_path_vertex *light,
                       uint32_t count, float weights[2])
{
    const ca_path_vertex *last = &light[count - 1];
    ca_mis_path path = {.camera = {.vertices = camera,
                                   .count = 3,
                                   .pdf_last = last->pdf_forward,
                                   .pdf_before = {last->to_previous},
                                   .sqrt_area = last->sqrt_area,
                                   .sqrt_omega = last->sqrt_omega,
                                   .spread = 0.3f,
                                   .cos_ratio = 1.2f,
                                   .tail = CA_MIS_NO_TAIL},
                        .next_event_ratio = light[0].next_event_ratio,
                        .light_choice = light[0].light_choice,
                        .light_infinite = light[0].at_infinity,
                        .camera_distance = 2.0f};
    path.light = (ca_mis_side){.vertices = light,
                               .count = count,
                               .pdf_last = {0.7f},
                               .pdf_before = {1.1f},
                               .sqrt_area = 0.4f,
                               .sqrt_omega = 0.6f,
                               .spread = 0.2f,
                               .cos_ratio = 0.9f,
                               .tail = CA_MIS_NO_TAIL};
    weights[0] = ca_mis_weight(rules, &path, CA_TECHNIQUE_CONNECT);
    path.light.count = count - 1; /* the photon is the camera's last vertex */
    path.light.spread = light[count - 2].spread_reverse;
    path.light.cos_ratio = light[count - 2].cos_ratio;
    if (count > 2) path.light.pdf_before = light[count - 3].pdf_reverse;
    weights[1] = ca_mis_weight(rules, &path, CA_TECHNIQUE_MERGE);
}

/* Whatever the rules ask for, the weights of a path that was kept are those of the path itself, to the bit. */
static void test_weights_of_kept_paths(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(77);
    for (uint32_t n = 0; n < 4000; n++) {
        const uint32_t count = 2 + n % 9;
        const bool projected = n & 1, observed = n % 7 == 0;
        const ca_mis_rules rules =
            rules_of((ca_reuse_kind)(ca_test_random_u32(&random) % CA_REUSE_KIND_COUNT), projected, n % 3 > 0);
        const ca_light_layout layout = ca_light_layout_of(&rules, n % 5 ? 10 : SHAPES, n & 2, observed);
        ca_path_vertex camera[10], light[10], kept[10];
        ca_light_vertex vertices[10], seen[10];
        float memory[CA_LIGHT_PATH_MOST], weights[2][2];
        walk_path(&random, projected, 10, camera, vertices);
        walk_path(&random, projected, count, light, vertices);
        vertices[count - 1].capable = true;
        const ca_light_source source = ca_light_source_of(&layout, light, vertices, count, n);
        assert_int_equal(source.count, count);
        float *at = memory + ca_light_words_before(&layout, count);
        ca_light_pack(&layout, &source, at);
        ca_light_unpack(&layout, at, count, kept);
        weights_of(&rules, camera, light, count, weights[0]);
        weights_of(&rules, camera, kept, count, weights[1]);
        assert_memory_equal(weights[0], weights[1], sizeof weights[0]);
        assert_true(weights[0][0] >= 0.0f && weights[0][0] <= 1.0f);
        for (uint32_t last = 1; last < count; last++)
            assert_int_equal(ca_light_met_dirac(&layout, at, last), light[last].connectable_count < last);
        if (!observed) continue;
        ca_light_unpack_points(&layout, at, count, seen);
        for (uint32_t i = 0; i < count; i++)
            assert_memory_equal(&seen[i].point, &vertices[i].point, sizeof seen[i].point);
    }
}

/* The bytes of light_record.h. */
static void test_promised_bytes(void **state)
{
    (void)state;
    static const struct {
        ca_reuse_kind kind;
        bool connect, pairs, wide;
        uint32_t start, vertex, record;
    } cases[] = {
        {CA_REUSE_FULL, true, false, false, 8, 12, 56},        {CA_REUSE_FULL, false, false, false, 8, 12, 52},
        {CA_REUSE_FULL, true, true, true, 8, 12, 64},          {CA_REUSE_FOOTPRINT, true, false, false, 16, 24, 56},
        {CA_REUSE_CORRELATION, true, false, false, 16, 12, 56}, {CA_REUSE_DENSITY, true, false, false, 8, 16, 56},
        {CA_REUSE_NORMALISED, true, false, true, 8, 16, 60},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const ca_mis_rules rules = rules_of(cases[i].kind, false, cases[i].connect);
        const ca_light_layout layout =
            ca_light_layout_of(&rules, cases[i].wide ? SHAPES : 2048, cases[i].pairs, false);
        assert_int_equal(layout.start_words * sizeof(float), cases[i].start);
        assert_int_equal(layout.vertex_words * sizeof(float), cases[i].vertex);
        assert_int_equal(layout.record_words * sizeof(float), cases[i].record);
        ca_mis_rules with_sums = rules;
        with_sums.photon_sums = true;
        const ca_light_layout wider =
            ca_light_layout_of(&with_sums, cases[i].wide ? SHAPES : 2048, cases[i].pairs, false);
        assert_int_equal(wider.record_words * sizeof(float), cases[i].record + 12);
    }
}

static void test_failure_from_outside(void **state)
{
    (void)state;
    ca_light_store store;
    assert_int_equal(create(&store, 10, 1, NULL), CA_OK);
    ca_light_store_fail(&store);
    assert_int_equal(ca_light_store_check(&store, NULL), CA_ERROR_MEMORY);
    ca_light_store_clear(&store);
    assert_int_equal(ca_light_store_check(&store, NULL), CA_OK);
    ca_light_store_destroy(&store);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_paths_come_back),     cmocka_unit_test(test_memory_is_kept),
        cmocka_unit_test(test_chunks),
        cmocka_unit_test(test_chunks_forget),              cmocka_unit_test(test_longest_paths),
        cmocka_unit_test(test_out_of_slabs),        cmocka_unit_test(test_allocation_failures),
        cmocka_unit_test(test_failure_from_outside), cmocka_unit_test(test_weights_of_kept_paths),
        cmocka_unit_test(test_promised_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
