/* What a merge counts for: the limits that the paper names, an example by hand, and what must hold for any path. */
#include "support/mis_oracle.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { PATHS = 20000 };

static void assert_close(double got, double expected, double relative)
{
    if (!(fabs(got - expected) <= relative * fabs(expected))) fail_msg("%.9g instead of %.9g", got, expected);
}

/* n at every vertex of a path that is split after s camera vertices, for an edge there (or a hit). */
static void fill(const ca_reuse_rules *rules, const ca_full_path *path, uint32_t s, float *n)
{
    ca_test_random random = ca_test_random_seed(s);
    ca_split_path split;
    const ca_technique technique = s == path->n ? CA_TECHNIQUE_HIT : CA_TECHNIQUE_CONNECT;
    ca_split(path, rules, s, technique, &random, &split);
    float camera[CA_FULL_PATH_MAX], light[CA_FULL_PATH_MAX];
    ca_reuse_fill(rules, &split.path, technique == CA_TECHNIQUE_CONNECT && s > 1, path->n - s > 1, camera, light);
    for (uint32_t m = 1; m + 1 < path->n; m++) n[m] = m < s ? camera[m] : light[path->n - 1 - m];
}

/* May an edge, or the end of a path, lie behind the first s vertices? */
static bool may_split(const ca_full_path *path, uint32_t s)
{
    if (s == path->n) return true;
    return (s == 1 || ca_full_path_is_smooth(path, s - 1)) && (s == path->n - 1 || ca_full_path_is_smooth(path, s));
}

static ca_reuse_rules rules_of(ca_reuse_kind kind)
{
    return (ca_reuse_rules){.kind = kind, .light_paths = 1e5f, .merge_area = 1e-3f, .epsilon = 0.01f, .c = 0.5f};
}

/* Numbers that are easy by hand: 1 / (0.01 + sqrt p) is 0.1, 0.25 and 2 for these p. */
static const float p_tenth = 99.8001f, p_quarter = 15.9201f, p_two = 0.2401f;

/* Pinhole, two diffuse vertices, an area light of 2 x 2 m that is chosen with probability 1/2. */
static ca_full_path example(void)
{
    return (ca_full_path){
        .n = 4,
        .pdf_camera = {1.0f, 100.0f, 0.1f, 0.01f},
        .pdf_light = {0.0f, 0.1f, 0.01f, 0.125f},
        .distance = {10.0f, 2.0f, 4.0f},
        .pdf_to_light = {p_tenth, p_quarter, 1.0f},
        .pdf_to_camera = {0.0f, 1.0f, p_two, p_quarter},
        .cos_to_light = {1.0f, 0.64f, 1.0f, 1.0f},
        .cos_to_camera = {1.0f, 0.25f, 0.25f, 1.0f},
        .light_area = 4.0f,
        .photon_density = {0.0f, 1e3f, 4e3f},
        .next_event_ratio = 1.0f,
        .light_choice = 0.5f,
    };
}

/* From the camera:   sqrt A = 0.1 * 10 = 1 at x[1], 1 + (0.1 + 0.25) * 2 = 1.7 at x[2].
 * From the light:    sqrt A = 2 + 0.25 * 4 = 3 at x[2], 3 + (0.25 + 2) * 2 = 7.5 at x[1].
 * n = (x + 1) / (x + 1e-5) with x = (0.5 (1 / 7.5)^2)^2.5 = 7.4493e-6 at x[1], (0.5 (1.7 / 3)^2)^2.5 = 0.010329 at
 * x[2]. */
static void test_footprint_by_hand(void **state)
{
    (void)state;
    const ca_full_path path = example();
    ca_reuse_rules rules = rules_of(CA_REUSE_FOOTPRINT);
    for (uint32_t s = 1; s <= 4; s++) {
        float n[CA_FULL_PATH_MAX];
        fill(&rules, &path, s, n);
        assert_close((double)n[1], 57309.1342, 1e-5);
        assert_close((double)n[2], 97.7190584, 1e-5);
    }
    rules.c = 0.0f; /* squares: x = 7.9012e-5 and 0.025778 */
    float n[CA_FULL_PATH_MAX];
    fill(&rules, &path, 2, n);
    assert_close((double)n[1], 11235.2843, 1e-5);
    assert_close((double)n[2], 39.7772083, 1e-5);
}

/* The cosines at x[1] turn the camera's area there by 0.64 / 0.25, its root 1 into 1.6: 2.3 at x[2]. Those at x[2]
 * turn the light's by 0.25 / 1, its root 3 into 1.5: 6 at x[1]. */
static void test_footprint_projected(void **state)
{
    (void)state;
    const ca_full_path path = example();
    ca_reuse_rules rules = rules_of(CA_REUSE_FOOTPRINT);
    rules.projected = true;
    const double x1 = pow(0.5 * pow(1.0 / 6.0, 2.0), 2.5), x2 = pow(0.5 * pow(2.3 / 3.0, 2.0), 2.5);
    for (uint32_t s = 1; s <= 4; s++) {
        float n[CA_FULL_PATH_MAX];
        fill(&rules, &path, s, n);
        assert_close((double)n[1], (x1 + 1.0) / (x1 + 1e-5), 1e-5);
        assert_close((double)n[2], (x2 + 1.0) / (x2 + 1e-5), 1e-5);
    }
}

/* One light path cannot be reused. */
static void test_one_light_path(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(1);
    for (uint32_t i = 0; i < 1000; i++) {
        const ca_full_path path = ca_random_path(&random);
        ca_reuse_rules rules = rules_of(CA_REUSE_FOOTPRINT);
        rules.light_paths = 1.0f;
        float n[CA_FULL_PATH_MAX];
        fill(&rules, &path, path.n, n);
        for (uint32_t m = 1; m + 1 < path.n; m++)
            if (!path.dirac[m]) assert_close((double)n[m], 1.0, 1e-6);
    }
}

static void test_tiny_footprints(void **state)
{
    (void)state;
    const ca_reuse_rules rules = rules_of(CA_REUSE_FOOTPRINT);
    ca_full_path path = example();
    float n[CA_FULL_PATH_MAX];
    /* A camera path that tells its vertex exactly: all variance comes from the light, all photons help. */
    path.pdf_to_light[0] = 1e12f;
    path.dirac[1] = true;
    fill(&rules, &path, 3, n);
    assert_close((double)n[2], 1e5, 1e-3);
    /* A laser whose beam is spread nowhere: none helps. */
    path = example();
    path.light_area = 0.0f;
    path.light_choice = 1.0f;
    path.pdf_to_camera[3] = 1e12f;
    fill(&rules, &path, 3, n);
    assert_close((double)n[2], 1.0, 1e-3);
    /* A footprint of size zero. */
    path.light_parallel = true;
    fill(&rules, &path, 3, n);
    assert_true(n[2] == 1.0f);
}

/* Any scale of scene, any ratio: a number from 1 to N_F. */
static void test_footprint_range(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(2);
    for (uint32_t i = 0; i < PATHS; i++) {
        ca_full_path path = ca_random_path(&random);
        ca_reuse_rules rules = ca_random_rules(&random).reuse;
        rules.kind = CA_REUSE_FOOTPRINT;
        const float scale = powf(10.0f, 30.0f * ca_test_random_float(&random) - 15.0f);
        for (uint32_t k = 0; k + 1 < path.n; k++)
            path.distance[k] *= ca_test_random_float(&random) < 0.3f ? scale : 1.0f;
        float n[CA_FULL_PATH_MAX];
        fill(&rules, &path, path.n, n);
        for (uint32_t m = 1; m + 1 < path.n; m++)
            if (!path.dirac[m]) assert_true(n[m] >= 1.0f && n[m] <= rules.light_paths);
    }
}

/* A model of the scene in another unit has the same weights. */
static void test_footprint_unit(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(3);
    const ca_reuse_rules rules = rules_of(CA_REUSE_FOOTPRINT);
    for (uint32_t i = 0; i < 1000; i++) {
        ca_full_path path = ca_random_path(&random);
        float metres[CA_FULL_PATH_MAX], millimetres[CA_FULL_PATH_MAX];
        fill(&rules, &path, path.n, metres);
        path.camera_area *= 1e6f;
        path.light_area *= 1e6f;
        for (uint32_t k = 0; k + 1 < path.n; k++) path.distance[k] *= 1e3f;
        fill(&rules, &path, path.n, millimetres);
        for (uint32_t m = 1; m + 1 < path.n; m++)
            if (!path.dirac[m]) assert_close((double)millimetres[m], (double)metres[m], 1e-5);
    }
}

/* A mirror changes no footprint: the path is as if unfolded. */
static void test_footprint_mirror(void **state)
{
    (void)state;
    const ca_reuse_rules rules = rules_of(CA_REUSE_FOOTPRINT);
    const ca_full_path plain = example();
    ca_full_path mirrored = plain; /* the mirror comes between x[1] and x[2], which are 2 m apart */
    mirrored.n = 5;
    mirrored.dirac[2] = true;
    mirrored.distance[1] = 0.5f;
    mirrored.distance[2] = 1.5f;
    mirrored.distance[3] = plain.distance[2];
    mirrored.pdf_to_camera[2] = mirrored.pdf_to_light[2] = 1.0f;
    mirrored.pdf_to_camera[3] = plain.pdf_to_camera[2];
    mirrored.pdf_to_light[3] = plain.pdf_to_light[2];
    mirrored.pdf_to_camera[4] = plain.pdf_to_camera[3];
    for (uint32_t s = 1; s <= 5; s++) {
        float n[CA_FULL_PATH_MAX], with_mirror[CA_FULL_PATH_MAX];
        if (!may_split(&mirrored, s)) continue;
        fill(&rules, &plain, 4, n);
        fill(&rules, &mirrored, s, with_mirror);
        assert_close((double)with_mirror[1], (double)n[1], 1e-5);
        assert_close((double)with_mirror[3], (double)n[2], 1e-5);
    }
}

/* n falls as the camera's footprint grows, and grows with the light's and with the number of light paths. */
static void test_footprint_monotone(void **state)
{
    (void)state;
    const ca_reuse_rules rules = rules_of(CA_REUSE_FOOTPRINT);
    float before[CA_FULL_PATH_MAX] = {0};
    for (int step = 0; step < 40; step++) {
        ca_full_path path = example();
        path.pdf_to_light[0] = powf(10.0f, 0.2f * (float)step - 3.0f); /* ever smaller pixels */
        float n[CA_FULL_PATH_MAX];
        fill(&rules, &path, 2, n);
        assert_true(n[1] > before[1] && n[2] >= before[2]);
        before[1] = n[1];
        before[2] = n[2];
    }
    before[1] = before[2] = 0.0f;
    for (int step = 0; step < 40; step++) {
        ca_full_path path = example();
        path.light_area = powf(10.0f, 0.2f * (float)step - 3.0f);
        float n[CA_FULL_PATH_MAX];
        fill(&rules, &path, 2, n);
        assert_true(n[1] > before[1] && n[2] > before[2]);
        before[1] = n[1];
        before[2] = n[2];
    }
    before[1] = before[2] = 0.0f;
    for (float light_paths = 1.0f; light_paths < 1e6f; light_paths *= 2.0f) {
        const ca_full_path path = example();
        ca_reuse_rules more = rules;
        more.light_paths = light_paths;
        float n[CA_FULL_PATH_MAX];
        fill(&more, &path, 2, n);
        assert_true(n[1] > before[1] && n[2] > before[2]);
        before[1] = n[1];
        before[2] = n[2];
    }
}

/* 1e3 and 4e3 photons per m^2 on 1e-3 m^2: one and four, where fewer than one count as one. */
static void test_density(void **state)
{
    (void)state;
    ca_full_path path = example();
    float n[CA_FULL_PATH_MAX];
    ca_reuse_rules rules = rules_of(CA_REUSE_DENSITY);
    fill(&rules, &path, 2, n);
    assert_close((double)n[1], 1e5, 1e-6);
    assert_close((double)n[2], 2.5e4, 1e-6);
    rules.kind = CA_REUSE_NORMALISED; /* times 1 / 0.625 */
    fill(&rules, &path, 2, n);
    assert_close((double)n[1], 1.6e5, 1e-6);
    assert_close((double)n[2], 4e4, 1e-6);
    path.photon_density[1] = path.photon_density[2] = 0.0f;
    fill(&rules, &path, 2, n);
    assert_true(n[1] == 1e5f && n[2] == 1e5f);
}

/* As the author's renderer has it: a merge has the mean of two densities, and the mean n is over all interior
 * vertices. By hand: N = 10, merge area 1; x[1] is a mirror, x[2] was merged. */
static void test_author(void **state)
{
    (void)state;
    ca_path_vertex camera[3], light[2];
    memset(camera, 0, sizeof camera);
    memset(light, 0, sizeof light);
    camera[2].connectable = light[1].connectable = true;
    camera[2].photon_density = 1.0f;
    light[1].photon_density = 5.0f;
    ca_mis_path path = {.camera = {.vertices = camera, .count = 3},
                        .light = {.vertices = light, .count = 2},
                        .merged = true,
                        .merged_density = 3.0f};
    ca_reuse_rules rules = {.kind = CA_REUSE_DENSITY, .light_paths = 10.0f, .merge_area = 1.0f, .author = true};
    float n_camera[3], n_light[2];
    ca_reuse_fill(&rules, &path, true, true, n_camera, n_light);
    assert_true(n_camera[1] == 10.0f && n_camera[2] == 5.0f && n_light[1] == 2.0f);
    rules.kind = CA_REUSE_NORMALISED; /* times 30 / 17 */
    ca_reuse_fill(&rules, &path, true, true, n_camera, n_light);
    assert_true(fabs((double)n_camera[1] - 300.0 / 17.0) < 1e-5);
    assert_true(fabs((double)n_camera[2] - 150.0 / 17.0) < 1e-5);
    assert_true(fabs((double)n_light[1] - 60.0 / 17.0) < 1e-5);
    path.merged = false; /* a connection there: times 30 / 22 */
    ca_reuse_fill(&rules, &path, true, true, n_camera, n_light);
    assert_true(fabs((double)n_camera[2] - 300.0 / 22.0) < 1e-5);
    path.light.count = 0; /* x[2] lies on a light: however crowded it is there, x[1] is all of the mean */
    camera[2].photon_density = 20.0f;
    ca_reuse_fill(&rules, &path, false, false, n_camera, n_light);
    assert_true(fabs((double)n_camera[1] - 10.0) < 1e-5);
    camera[2].photon_density = 1.0f;
    rules.author = false; /* the mirror does not count */
    path.light.count = 2;
    ca_reuse_fill(&rules, &path, true, true, n_camera, n_light); /* 10 and 2: times 20 / 12 */
    assert_true(fabs((double)n_camera[2] - 200.0 / 12.0) < 1e-5);
}

static void test_normalised_mean(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(4);
    for (uint32_t i = 0; i < PATHS; i++) {
        const ca_full_path path = ca_random_path(&random);
        const ca_reuse_rules rules = rules_of(CA_REUSE_NORMALISED);
        for (uint32_t s = 1; s <= path.n; s++) {
            if (!may_split(&path, s)) continue;
            float n[CA_FULL_PATH_MAX];
            double sum = 0.0, count = 0.0;
            fill(&rules, &path, s, n);
            for (uint32_t m = 1; m + 1 < path.n; m++) {
                if (path.dirac[m]) continue;
                sum += (double)n[m];
                count += 1.0;
            }
            if (count > 0.0) assert_close(sum / count, 1e5, 1e-5);
        }
    }
}

/* "Near" is within tan 1 degree times 10 m, 0.0957 m^2. At x[2] camera paths come near with the chance c = 0.1 A =
 * 0.00957 (all of them at x[1]), light paths with l = (0.125 A)(0.01 A) = 1.145e-5: n = N_F c / (c + l - c l). */
static void test_correlation_by_hand(void **state)
{
    (void)state;
    const ca_reuse_rules rules = rules_of(CA_REUSE_CORRELATION);
    ca_full_path path = example();
    const double area = 3.14159265358979 * pow(10.0 * 0.0174550649282, 2.0);
    double c = 0.1 * area, l = 0.125 * area * 0.01 * area;
    for (uint32_t s = 1; s <= 4; s++) {
        float n[CA_FULL_PATH_MAX];
        fill(&rules, &path, s, n);
        assert_true(n[1] == 1e5f);
        assert_close((double)n[2], 1e5 * c / (c + l - c * l), 1e-6);
    }
    /* A spot light, and a sun, that reach x[2] for certain: only which light it is may differ. */
    path.pdf_light[2] = 1e6f;
    path.light_area = 0.0f;
    l = 0.5;
    for (int infinite = 0; infinite < 2; infinite++) {
        float n[CA_FULL_PATH_MAX];
        fill(&rules, &path, 2, n);
        assert_close((double)n[2], 1e5 * c / (c + l - c * l), 1e-6);
        path.light_area = 100.0f;
        path.light_infinite = true;
    }
    /* Behind a mirror a camera path is as certain as before it. */
    path.dirac[1] = true;
    float n[CA_FULL_PATH_MAX];
    fill(&rules, &path, 3, n);
    assert_close((double)n[2], 1e5, 1e-6);
}

/* Wherever a path is split, and so for all of its techniques, its merges count the same. */
static void test_splits_agree(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(5);
    for (uint32_t i = 0; i < PATHS; i++) {
        const ca_full_path path = ca_random_path(&random);
        const ca_reuse_rules rules = ca_random_rules(&random).reuse;
        float hit[CA_FULL_PATH_MAX];
        fill(&rules, &path, path.n, hit);
        for (uint32_t s = 1; s < path.n; s++) {
            if (path.n < 3 || !may_split(&path, s)) continue;
            float n[CA_FULL_PATH_MAX];
            fill(&rules, &path, s, n);
            for (uint32_t m = 1; m + 1 < path.n; m++)
                if (!path.dirac[m] && hit[m] > 1e-20f) assert_close((double)n[m], (double)hit[m], 2e-5);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_footprint_by_hand),   cmocka_unit_test(test_footprint_projected),
        cmocka_unit_test(test_one_light_path),      cmocka_unit_test(test_tiny_footprints),
        cmocka_unit_test(test_footprint_range),     cmocka_unit_test(test_footprint_unit),
        cmocka_unit_test(test_footprint_mirror),    cmocka_unit_test(test_footprint_monotone),
        cmocka_unit_test(test_density),             cmocka_unit_test(test_normalised_mean),
        cmocka_unit_test(test_author),
        cmocka_unit_test(test_correlation_by_hand), cmocka_unit_test(test_splits_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
