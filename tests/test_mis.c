/* Weights against a brute-force enumeration of all techniques, over random paths that are split in every possible
 * way. */
#include "support/mis_oracle.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define TOLERANCE 1e-5

enum { PATHS = 400000 };

static uint64_t tails_checked[CA_TECHNIQUE_COUNT], sums_checked;

/* What is compared, for a failure's message. */
typedef struct comparison {
    const ca_mis_rules *rules;
    const ca_full_path *path;
    ca_technique technique;
    uint32_t s;
} comparison;

static void check_equal(const comparison *of, const char *what, uint32_t index, double got, double expected)
{
    /* Below this a float has no relative precision, and no image would show it. */
    const double least = 1e-30;
    if (fabs(got - expected) <= TOLERANCE * fabs(expected) + least) return;
    print_error("%s [%u] of a path with n = %u split after s = %u for %s, reuse kind %d: %.9g instead of %.9g\n",
                what, index, of->path->n, of->s, ca_technique_name(of->technique), (int)of->rules->reuse.kind, got,
                expected);
    fail();
}

/* The densities relative to D_s. */
static void check_densities(const comparison *of, const ca_mis_path *split, const double *splits,
                            const double *merges)
{
    const uint32_t n = of->path->n;
    const double scale = 1.0 / ca_oracle_density(of->path, of->s);
    double got_splits[CA_FULL_PATH_MAX + 1], got_merges[CA_FULL_PATH_MAX];
    ca_mis_densities(of->rules, split, of->technique, got_splits, got_merges);
    for (uint32_t k = 0; k <= n; k++) check_equal(of, "split", k, got_splits[k], splits[k] * scale);
    for (uint32_t m = 0; m < n; m++) check_equal(of, "merge", m, got_merges[m], merges[m] * scale);
}

static ca_technique technique_of_split(uint32_t n, uint32_t k)
{
    return k == n       ? CA_TECHNIQUE_HIT
           : k == n - 1 ? CA_TECHNIQUE_NEXT_EVENT
           : k == 1     ? CA_TECHNIQUE_SPLAT
                        : CA_TECHNIQUE_CONNECT;
}

/* As a walk grows it. */
static double tail_of(double grow(const ca_mis_rules *, const ca_path_vertex *, uint32_t, double),
                      const ca_mis_rules *rules, const ca_mis_side *side)
{
    double tail = 0.0;
    for (uint32_t last = 1; last < side->count; last++) tail = grow(rules, side->vertices, last, tail);
    return tail;
}

/* A merge's weight from what its photon keeps. The photon's density and its segment are made up for the split: what
 * counts of them are the densities that they lead to. */
static void check_sums(const comparison *of, const ca_mis_rules *rules, const ca_mis_path *path, double expected)
{
    ca_path_vertex light[CA_FULL_PATH_MAX + 1];
    const uint32_t count = path->light.count;
    memcpy(light, path->light.vertices, count * sizeof *light);
    light[0].next_event_ratio = path->next_event_ratio;
    if (count > 1) light[count - 2].pdf_reverse = path->light.pdf_before;
    light[count] = (ca_path_vertex){.pdf_forward = path->camera.pdf_last, .to_previous = 0.25f};
    const double tail =
        ca_mis_light_tail(rules, light, count, count > 1 ? tail_of(ca_mis_light_tail, rules, &path->light) : 0.0);
    const ca_photon_sums sums = ca_mis_photon_sums(rules, light, count, tail);
    check_equal(of, "weight by sums", of->s,
                (double)ca_mis_merge_weight(rules, &path->camera, &sums, path->light.pdf_last.v / 0.25f), expected);
    sums_checked++;
}

/* The same weight from the sides' tails, where there are any. */
static void check_tails(const comparison *of, const ca_mis_path *split, double expected)
{
    ca_mis_rules rules = *of->rules;
    ca_mis_path path = *split;
    if (!ca_mis_has_tails(&rules)) return;
    rules.has_tails = true;
    path.camera.tail = tail_of(ca_mis_camera_tail, &rules, &path.camera);
    path.light.tail = tail_of(ca_mis_light_tail, &rules, &path.light);
    assert_true(path.camera.tail >= 0.0 && path.light.tail >= 0.0);
    if (of->technique == CA_TECHNIQUE_MERGE) check_sums(of, &rules, &path, expected);
    check_equal(of, "weight by tails", of->s, (double)ca_mis_weight(&rules, &path, of->technique), expected);
    tails_checked[of->technique]++;
}

/* Checks one technique's weight and gives it. */
static double check_technique(const comparison *of, const double *splits, const double *merges, double value,
                              ca_test_random *random)
{
    ca_split_path split;
    ca_split(of->path, &of->rules->reuse, of->s, of->technique, random, &split);
    split.path.light_class = of->path->light_class;
    if (of->rules->factors) split.path.factors = &of->path->factors;
    const float weight = ca_mis_weight(of->rules, &split.path, of->technique);
    const double expected = ca_oracle_weight(of->rules, of->path->n, splits, merges, value);
    check_equal(of, "weight", of->s, (double)weight, expected);
    check_tails(of, &split.path, expected);
    check_densities(of, &split.path, splits, merges);
    return (double)weight;
}

/* All techniques of a path; how many there are. */
static uint32_t check_path(const ca_mis_rules *rules, const ca_full_path *path, ca_test_random *random)
{
    double splits[CA_FULL_PATH_MAX + 1], merges[CA_FULL_PATH_MAX], sum = 0.0;
    ca_oracle_techniques(rules, path, splits, merges);
    uint32_t count = 0;
    for (uint32_t k = 1; k <= path->n; k++) {
        if (!(splits[k] > 0.0)) continue;
        const comparison of = {rules, path, technique_of_split(path->n, k), k};
        sum += check_technique(&of, splits, merges, splits[k], random);
        count++;
    }
    for (uint32_t m = 1; m + 1 < path->n; m++) {
        if (!(merges[m] > 0.0)) continue;
        const comparison of = {rules, path, CA_TECHNIQUE_MERGE, m + 1};
        sum += check_technique(&of, splits, merges, merges[m], random);
        count++;
    }
    if (count > 0) assert_true(fabs(sum - 1.0) <= TOLERANCE);
    return count;
}

static void test_random_paths(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(1);
    uint64_t techniques = 0, alone = 0;
    for (uint32_t i = 0; i < PATHS; i++) {
        const ca_mis_rules rules = ca_random_rules(&random);
        const ca_full_path path = ca_random_path(&random);
        const uint32_t count = check_path(&rules, &path, &random);
        techniques += count;
        alone += count == 1;
    }
    /* The generator must not have drifted into paths that nothing can find. */
    assert_true(techniques > 2 * (uint64_t)PATHS);
    assert_true(alone < PATHS / 2);
    assert_true(tails_checked[CA_TECHNIQUE_CONNECT] > PATHS / 10);
    assert_true(tails_checked[CA_TECHNIQUE_NEXT_EVENT] > PATHS / 100);
    assert_true(tails_checked[CA_TECHNIQUE_SPLAT] > PATHS / 100);
    assert_true(sums_checked > PATHS / 100);
}

/* A technique that the rules leave out, or that cannot make the path, weighs nothing. */
static void test_hit_left_out(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(2);
    uint32_t left_out = 0;
    for (uint32_t i = 0; i < 20000; i++) {
        ca_mis_rules rules = ca_random_rules(&random);
        const ca_full_path path = ca_random_path(&random);
        double splits[CA_FULL_PATH_MAX + 1], merges[CA_FULL_PATH_MAX];
        ca_oracle_techniques(&rules, &path, splits, merges);
        if (path.pdf_camera[path.n - 1] == 0.0f || ca_oracle_density(&path, path.n) == 0.0 || splits[path.n] > 0.0)
            continue;
        ca_split_path split;
        ca_split(&path, &rules.reuse, path.n, CA_TECHNIQUE_HIT, &random, &split);
        assert_true(ca_mis_weight(&rules, &split.path, CA_TECHNIQUE_HIT) == 0.0f);
        left_out++;
    }
    assert_true(left_out > 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random_paths),
        cmocka_unit_test(test_hit_left_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
