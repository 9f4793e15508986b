/* Ray numbers: the minimum of an exhaustive search, over real numbers and over integers, for every objective; what
 * scales how; estimates with noise as large as themselves; every failed allocation is reported. */
#include "noise/ray_numbers.h"

#include "base/memory.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { MAX_PIXELS = 32 * 32 };

/* A problem with known variances. */
typedef struct problem {
    ca_ray_pixel pixels[MAX_PIXELS];
    ca_ray_image image;
} problem;

static ca_ray_pixel make_pixel(double interaction, double camera, double light, double luminance, double camera_time,
                               double merge_time)
{
    const double l2 = luminance * luminance;
    return (ca_ray_pixel){.pair = interaction + camera + light + l2,
                          .camera = camera + l2,
                          .light = light + l2,
                          .luminance2 = l2,
                          .camera_time = camera_time,
                          .merge_time = merge_time};
}

/* From 1 / range to range, evenly in the logarithm. */
static double spread(ca_test_random *random, double range)
{
    return pow(range, 2.0 * (double)ca_test_random_float(random) - 1.0);
}

static void make_problem(problem *p, uint32_t width, uint32_t height, uint64_t seed)
{
    ca_test_random random = ca_test_random_seed(seed);
    const double fixed_time = 10.0 * spread(&random, 10.0);
    p->image = (ca_ray_image){.width = width,
                              .height = height,
                              .pixels = p->pixels,
                              .fixed_time = fixed_time,
                              .light_time = spread(&random, 10.0)};
    for (uint32_t i = 0; i < width * height; i++) {
        const double interaction = 20.0 * spread(&random, 10.0);
        const double camera = spread(&random, 5.0);
        const double light = 3.0 * spread(&random, 5.0);
        const double luminance = spread(&random, 3.0);
        const double camera_time = spread(&random, 4.0);
        p->pixels[i] = make_pixel(interaction, camera, light, luminance, camera_time, 0.02 * spread(&random, 5.0));
    }
}

static ca_ray_numbers choose(const problem *p, const ca_ray_settings *settings)
{
    ca_ray_numbers numbers;
    ca_error error = {""};
    if (ca_ray_numbers_choose(&numbers, &p->image, settings, &error) != CA_OK) fail_msg("%s", error.message);
    return numbers;
}

/* ---- The law again, from the components ------------------------------------------------------------------------ */

static double variance_of(const ca_ray_pixel *p, double nf, double nb)
{
    return (p->pair - p->luminance2) / (nf * nb) + (1.0 - 1.0 / nf) * (p->camera - p->luminance2) / nb +
           (1.0 - 1.0 / nb) * (p->light - p->luminance2) / nf;
}

static double time_of(const problem *p, double nf, const double *nb)
{
    double time = p->image.fixed_time + nf * p->image.light_time;
    for (uint32_t i = 0; i < p->image.width * p->image.height; i++)
        time += nb[i] * (p->pixels[i].camera_time + nf * p->pixels[i].merge_time);
    return time;
}

static double objective_of(const problem *p, ca_ray_objective objective, double nf, const double *nb)
{
    const uint32_t count = p->image.width * p->image.height;
    double v[MAX_PIXELS], mean2 = 0.0, sum = 0.0;
    for (uint32_t i = 0; i < count; i++) v[i] = variance_of(&p->pixels[i], nf, nb[i]);
    for (uint32_t i = 0; i < count; i++) mean2 += p->pixels[i].luminance2 / count;
    if (objective == CA_RAYS_WORST_DECILE) {
        const uint32_t worst = (count + 9) / 10;
        for (uint32_t k = 0; k < worst; k++) {
            uint32_t largest = 0;
            for (uint32_t i = 1; i < count; i++)
                if (v[i] > v[largest]) largest = i;
            sum += v[largest] / worst;
            v[largest] = -1.0;
        }
        return sum;
    }
    for (uint32_t i = 0; i < count; i++)
        sum += v[i] / count / (objective == CA_RAYS_RELATIVE ? p->pixels[i].luminance2 + 0.01 * mean2 : 1.0);
    return sum;
}

static double cost_of(const problem *p, ca_ray_objective objective, double nf, const double *nb)
{
    return objective_of(p, objective, nf, nb) * time_of(p, nf, nb);
}

static double map_cost(const problem *p, ca_ray_objective objective, double nf, const uint32_t *map)
{
    double nb[MAX_PIXELS] = {0.0};
    for (uint32_t i = 0; i < p->image.width * p->image.height; i++) nb[i] = map[i];
    return cost_of(p, objective, nf, nb);
}

static double choice_cost(const ca_ray_choice *choice) { return choice->variance * choice->time; }

static void assert_close(double value, double expected, double relative)
{
    if (!(fabs(value - expected) <= relative * fabs(expected))) fail_msg("%.9g instead of %.9g", value, expected);
}

/* ---- Exhaustive searches --------------------------------------------------------------------------------------- */

/* The smallest cost of two pixels over real numbers: the best of a grid in the three logarithms, around which the
 * grid moves until it is its middle, then shrinks. */
static double search_two_pixels(const problem *p, ca_ray_objective objective, double max_nf, double max_nb)
{
    enum { POINTS = 9 };
    const double end[3] = {log(max_nf), log(max_nb), log(max_nb)};
    double middle[3] = {0.5 * end[0], 0.5 * end[1], 0.5 * end[2]}, scale = 0.5, best = HUGE_VAL;
    while (scale > 1e-4) {
        double at[3];
        bool better = false;
        for (int i = 0; i < POINTS * POINTS * POINTS; i++) {
            const int steps[3] = {i % POINTS, i / POINTS % POINTS, i / (POINTS * POINTS)};
            double x[3];
            for (int k = 0; k < 3; k++)
                x[k] = fmin(fmax(middle[k] + scale * end[k] * (2.0 * steps[k] / (POINTS - 1) - 1.0), 0.0), end[k]);
            const double cost = cost_of(p, objective, exp(x[0]), (double[]){exp(x[1]), exp(x[2])});
            if (!(cost < best)) continue;
            best = cost;
            better = true;
            memcpy(at, x, sizeof at);
        }
        if (better) memcpy(middle, at, sizeof at);
        if (!better) scale *= 0.5;
    }
    return best;
}

static void check_two_pixels(ca_ray_objective objective, double tolerance)
{
    static const uint32_t largest[3] = {1 << 20, 40, 6};
    for (uint64_t seed = 0; seed < 24; seed++) {
        problem p;
        make_problem(&p, 2, 1, seed);
        const ca_ray_settings settings = {
            .objective = objective, .max_light_paths = 100000, .max_camera_paths = largest[seed % 3]};
        ca_ray_numbers n = choose(&p, &settings);
        const double best = search_two_pixels(&p, objective, 1e5, largest[seed % 3]);
        assert_close(choice_cost(&n.relaxed), best, tolerance);
        assert_close(choice_cost(&n.best), map_cost(&p, objective, n.best.light_paths, n.camera_paths), 1e-12);
        assert_true(choice_cost(&n.best) >= best * (1.0 - 1e-3));
        ca_ray_numbers_destroy(&n);
    }
}

static void test_real_numbers(void **state)
{
    (void)state;
    check_two_pixels(CA_RAYS_MEAN, 0.001);
    check_two_pixels(CA_RAYS_RELATIVE, 0.001);
    check_two_pixels(CA_RAYS_WORST_DECILE, 0.005);
}

/* The smallest cost of three pixels over N_F <= max_nf, N_B <= max_nb. */
static double search_three_pixels(const problem *p, ca_ray_objective objective, uint32_t max_nf, uint32_t max_nb)
{
    double best = HUGE_VAL;
    for (uint32_t nf = 1; nf <= max_nf; nf++)
        for (uint32_t i = 0; i < max_nb * max_nb * max_nb; i++) {
            const double nb[3] = {i % max_nb + 1, i / max_nb % max_nb + 1, i / (max_nb * max_nb) + 1};
            best = fmin(best, cost_of(p, objective, nf, nb));
        }
    return best;
}

static double search_uniform(const problem *p, ca_ray_objective objective, uint32_t max_nf, uint32_t max_nb)
{
    double best = HUGE_VAL;
    for (uint32_t nf = 1; nf <= max_nf; nf++)
        for (uint32_t n = 1; n <= max_nb; n++) best = fmin(best, cost_of(p, objective, nf, (double[]){n, n, n}));
    return best;
}

static void check_three_pixels(ca_ray_objective objective, uint64_t seed, double *worst)
{
    enum { MAX_NF = 40, MAX_NB = 12 };
    problem p;
    make_problem(&p, 3, 1, 1000 + seed);
    /* Some want many camera paths, some hardly one. */
    for (int i = 0; i < 3; i++) p.pixels[i].camera_time *= seed % 4 == 0 ? 20.0 : seed % 4 == 1 ? 3.0 : 0.5;
    const ca_ray_settings settings = {.objective = objective,
                                      .max_light_paths = MAX_NF,
                                      .max_camera_paths = MAX_NB,
                                      .given_light_paths = 7,
                                      .given_camera_paths = 3};
    ca_ray_numbers n = choose(&p, &settings);
    const double cost = map_cost(&p, objective, n.best.light_paths, n.camera_paths);
    const double best = search_three_pixels(&p, objective, MAX_NF, MAX_NB);
    const double uniform = search_uniform(&p, objective, MAX_NF, MAX_NB);
    assert_close(choice_cost(&n.best), cost, 1e-12);
    assert_true(cost >= best * (1.0 - 1e-12));
    *worst = fmax(*worst, cost / best - 1.0);
    assert_close(choice_cost(&n.uniform), uniform, 0.02);
    assert_close(n.gain_over_uniform, choice_cost(&n.uniform) / cost, 1e-12);
    assert_close(n.gain_over_given, cost_of(&p, objective, 7, (double[]){3, 3, 3}) / cost, 1e-12);
    assert_close(n.best.camera_paths, (n.camera_paths[0] + n.camera_paths[1] + n.camera_paths[2]) / 3.0, 1e-12);
    ca_ray_numbers_destroy(&n);
}

static void test_integers(void **state)
{
    (void)state;
    double worst[3] = {0};
    for (uint64_t seed = 0; seed < 32; seed++)
        for (int objective = 0; objective < 3; objective++)
            check_three_pixels((ca_ray_objective)objective, seed, &worst[objective]);
    print_message("lost against all integers: %.4f %%, %.4f %%, %.4f %%\n", 100.0 * worst[0], 100.0 * worst[1],
                  100.0 * worst[2]);
    assert_true(worst[CA_RAYS_MEAN] < 0.001);
    assert_true(worst[CA_RAYS_RELATIVE] < 0.001);
    assert_true(worst[CA_RAYS_WORST_DECILE] < 0.06); /* its weights are those of real numbers */
}

/* Twenty pixels: the worst tenth is two. No other choice of ours has a better one, and those of the mean have it
 * worse. */
static void test_worst_decile_of_many(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 10; seed++) {
        problem p;
        make_problem(&p, 5, 4, 50 + seed);
        for (int i = 0; i < 20; i++) p.pixels[i].camera_time *= 0.05;
        ca_ray_numbers worst = choose(&p, &(ca_ray_settings){.objective = CA_RAYS_WORST_DECILE});
        ca_ray_numbers mean = choose(&p, &(ca_ray_settings){.objective = CA_RAYS_MEAN});
        const double cost = map_cost(&p, CA_RAYS_WORST_DECILE, worst.best.light_paths, worst.camera_paths);
        assert_close(choice_cost(&worst.best), cost, 1e-12);
        assert_true(cost < map_cost(&p, CA_RAYS_WORST_DECILE, mean.best.light_paths, mean.camera_paths));
        assert_true(cost < choice_cost(&worst.uniform));
        assert_true(cost < choice_cost(&worst.relaxed) * (1.0 + 0.5 / worst.relaxed.camera_paths)); /* steps of 1 */
        ca_ray_numbers_destroy(&worst);
        ca_ray_numbers_destroy(&mean);
    }
}

/* ---- Closed forms and scaling ---------------------------------------------------------------------------------- */

/* With one camera path a pixel, variance x time is (q / N_F + b + f / N_F) (t_0 + t_B + N_F (t_F + t_M)). */
static void test_light_paths_alone(void **state)
{
    (void)state;
    problem p;
    make_problem(&p, 8, 8, 7);
    double q = 0.0, b = 0.0, fixed = p.image.fixed_time, each = p.image.light_time;
    for (int i = 0; i < 64; i++) {
        const ca_ray_pixel *pixel = &p.pixels[i];
        p.pixels[i].pair *= 30.0;
        q += pixel->pair - pixel->camera;
        b += pixel->camera - pixel->luminance2;
        fixed += pixel->camera_time;
        each += pixel->merge_time;
    }
    ca_ray_numbers n = choose(&p, &(ca_ray_settings){.max_camera_paths = 1});
    const double expected = sqrt(q * fixed / (b * each));
    assert_true(expected > 20.0);
    assert_true(fabs(n.best.light_paths - expected) <= 1.0);
    for (int i = 0; i < 64; i++) assert_int_equal(n.camera_paths[i], 1);
    ca_ray_numbers_destroy(&n);
}

/* Scales every pixel by its own times; numbers large enough that integers do not matter. */
static void make_smooth(problem *p)
{
    make_problem(p, 4, 4, 11);
    p->image.fixed_time = 1e4;
    for (int i = 0; i < 16; i++) {
        p->pixels[i] = make_pixel(1.0, 2.0 + i, 40.0, 1.0 + i, 1e-2, 1e-6);
    }
}

static void check_same(const ca_ray_numbers *a, const ca_ray_numbers *b)
{
    assert_close(a->best.light_paths, b->best.light_paths, 1e-9);
    for (int i = 0; i < 16; i++) assert_int_equal(a->camera_paths[i], b->camera_paths[i]);
}

static void test_units_do_not_matter(void **state)
{
    (void)state;
    for (int objective = 0; objective < 3; objective++) {
        const ca_ray_settings settings = {.objective = (ca_ray_objective)objective};
        problem p;
        make_smooth(&p);
        ca_ray_numbers first = choose(&p, &settings);
        for (int i = 0; i < 16; i++) {
            p.pixels[i].pair *= 16.0;
            p.pixels[i].camera *= 16.0;
            p.pixels[i].light *= 16.0;
            p.pixels[i].luminance2 *= 16.0;
            p.pixels[i].camera_time *= 8.0;
            p.pixels[i].merge_time *= 8.0;
        }
        p.image.fixed_time *= 8.0;
        p.image.light_time *= 8.0;
        ca_ray_numbers second = choose(&p, &settings);
        check_same(&first, &second);
        assert_close(second.best.time, 8.0 * first.best.time, 1e-12);
        assert_close(second.best.variance, (objective == CA_RAYS_RELATIVE ? 1.0 : 16.0) * first.best.variance, 1e-12);
        ca_ray_numbers_destroy(&first);
        ca_ray_numbers_destroy(&second);
    }
}

/* N_B goes with the root of the variance over the time; relative variance divides it by the luminance. */
static void test_roots(void **state)
{
    (void)state;
    problem p;
    make_smooth(&p);
    p.image.fixed_time = 1.0;
    for (int i = 0; i < 16; i++)
        p.pixels[i] = make_pixel(0.0, i % 2 ? 4.0 : 1.0, 40.0, i % 2 ? 10.0 : 1.0, i < 8 ? 1e-3 : 9e-3, 0.0);
    ca_ray_numbers n = choose(&p, &(ca_ray_settings){.max_camera_paths = 1000000});
    assert_true(n.camera_paths[8] > 50);
    assert_close(n.camera_paths[1], 2.0 * n.camera_paths[0], 0.01);
    assert_close(n.camera_paths[0], 3.0 * n.camera_paths[8], 0.01);
    ca_ray_numbers r = choose(&p, &(ca_ray_settings){.objective = CA_RAYS_RELATIVE, .max_camera_paths = 1000000});
    const double delta = 0.01 * 50.5;
    assert_close(r.camera_paths[1], 2.0 * r.camera_paths[0] * sqrt((1.0 + delta) / (100.0 + delta)), 0.02);
    ca_ray_numbers_destroy(&n);
    ca_ray_numbers_destroy(&r);
}

static void test_monotone(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 10; seed++) {
        problem p;
        make_problem(&p, 6, 6, 300 + seed);
        const ca_ray_settings none = {0};
        ca_ray_numbers plain = choose(&p, &none);
        const ca_ray_pixel pixel = p.pixels[17];
        p.pixels[17].camera += 50.0;
        p.pixels[17].pair += 50.0;
        ca_ray_numbers noisier = choose(&p, &none);
        p.pixels[17] = pixel;
        p.image.light_time *= 20.0;
        ca_ray_numbers dearer = choose(&p, &none);
        for (int i = 0; i < 36; i++) {
            p.pixels[i].light += 200.0;
            p.pixels[i].pair += 200.0;
        }
        ca_ray_numbers lighter = choose(&p, &none);
        assert_true(noisier.camera_paths[17] > plain.camera_paths[17]);
        assert_true(dearer.relaxed.light_paths < plain.relaxed.light_paths);
        assert_true(lighter.relaxed.light_paths > dearer.relaxed.light_paths);
        ca_ray_numbers_destroy(&plain);
        ca_ray_numbers_destroy(&noisier);
        ca_ray_numbers_destroy(&dearer);
        ca_ray_numbers_destroy(&lighter);
    }
}

/* ---- Noise in the estimates ------------------------------------------------------------------------------------ */

static double noise_of(ca_test_random *random)
{
    double sum = 0.0;
    for (int i = 0; i < 12; i++) sum += (double)ca_test_random_float(random) - 0.5;
    return sum;
}

/* A lit half and a dark one, estimates with errors as large as they are. Judged by the truth. */
static void check_noisy(uint32_t smoothing, double error, double allowed)
{
    problem truth, noisy;
    ca_test_random random = ca_test_random_seed(21);
    make_problem(&truth, 32, 32, 20);
    for (uint32_t i = 0; i < 1024; i++) {
        const double lit = i % 32 < 16 ? 1.0 : 0.04;
        truth.pixels[i] = make_pixel(3000.0 * lit, 30.0 * lit, 30.0 * lit, 1.0, 1e-3, 1e-7);
    }
    noisy = truth;
    noisy.image.pixels = noisy.pixels;
    for (uint32_t i = 0; i < 1024; i++) {
        const double lit = i % 32 < 16 ? error : 0.04 * error;
        noisy.pixels[i].pair += 3000.0 * lit * noise_of(&random);
        noisy.pixels[i].camera += 30.0 * lit * noise_of(&random);
        noisy.pixels[i].light += 30.0 * lit * noise_of(&random);
    }
    ca_ray_numbers best = choose(&truth, &(ca_ray_settings){0});
    ca_ray_numbers n = choose(&noisy, &(ca_ray_settings){.smoothing = smoothing});
    const double lost = map_cost(&truth, CA_RAYS_MEAN, n.best.light_paths, n.camera_paths) / choice_cost(&best.best);
    print_message("errors of %g, smoothed over %u: %.2f %% lost, N_F %.0f for %.0f\n", error, smoothing,
                  100.0 * (lost - 1.0), n.best.light_paths, best.best.light_paths);
    assert_true(lost < 1.0 + allowed);
    for (uint32_t i = 0; i < 1024; i++)
        assert_true(n.camera_paths[i] >= 1 && n.camera_paths[i] <= 4 * best.camera_paths[0]);
    assert_close(choice_cost(&n.best), choice_cost(&best.best), 0.25); /* what it says of itself */
    ca_ray_numbers_destroy(&best);
    ca_ray_numbers_destroy(&n);
}

static void test_noisy_estimates(void **state)
{
    (void)state;
    check_noisy(0, 0.3, 0.05);
    check_noisy(0, 1.0, 0.25);
    check_noisy(1, 1.0, 0.06);
    check_noisy(2, 2.0, 0.10);
}

/* Averages over neighbours are cut at every border alike: the image turned round has the map turned round. */
static void test_smoothing_at_borders(void **state)
{
    (void)state;
    enum { WIDTH = 7, HEIGHT = 5, COUNT = WIDTH * HEIGHT };
    problem p, turned;
    make_problem(&p, WIDTH, HEIGHT, 5);
    p.image.fixed_time = 1e4; /* large numbers: where one pixel more is in an average, they differ */
    turned = p;
    turned.image.pixels = turned.pixels;
    for (int i = 0; i < COUNT; i++) turned.pixels[i] = p.pixels[COUNT - 1 - i];
    for (uint32_t smoothing = 1; smoothing <= 3; smoothing++) {
        ca_ray_numbers a = choose(&p, &(ca_ray_settings){.smoothing = smoothing});
        ca_ray_numbers b = choose(&turned, &(ca_ray_settings){.smoothing = smoothing});
        assert_close(a.best.light_paths, b.best.light_paths, 1e-9);
        for (int i = 0; i < COUNT; i++) {
            assert_true(a.camera_paths[i] > 10);
            assert_int_equal(a.camera_paths[i], b.camera_paths[COUNT - 1 - i]);
        }
        ca_ray_numbers_destroy(&a);
        ca_ray_numbers_destroy(&b);
    }
}

/* A negative estimate takes its neighbours' average, and the sum over the image stays. */
static void test_negative_estimate(void **state)
{
    (void)state;
    problem p;
    make_problem(&p, 5, 5, 1);
    p.image.fixed_time = 1.0;
    for (int i = 0; i < 25; i++) p.pixels[i] = make_pixel(0.0, 1.0, 5.0, 1.0, 1e-3, 0.0);
    ca_ray_numbers even = choose(&p, &(ca_ray_settings){.max_camera_paths = 100000});
    p.pixels[12] = make_pixel(0.0, -2.0, 5.0, 1.0, 1e-3, 0.0);
    ca_ray_numbers n = choose(&p, &(ca_ray_settings){.max_camera_paths = 100000});
    /* 6/9 in the middle, 1 elsewhere, all scaled to a sum of 22. */
    assert_true(n.camera_paths[0] > 100);
    assert_close(n.camera_paths[12], n.camera_paths[0] * sqrt(6.0 / 9.0), 0.02);
    double nb[25];
    for (int i = 0; i < 25; i++) nb[i] = n.camera_paths[i];
    double variance = 0.0;
    for (int i = 0; i < 25; i++)
        variance +=
            ((i == 12 ? 6.0 / 9.0 : 1.0) * 22.0 / (24.0 + 6.0 / 9.0) / nb[i] + 5.0 / n.best.light_paths) / 25.0;
    assert_close(n.best.variance, variance, 1e-9);
    ca_ray_numbers_destroy(&even);
    ca_ray_numbers_destroy(&n);
}

/* What is not noisy at all, and a term that is missing from the whole image. */
static void test_degenerate(void **state)
{
    (void)state;
    for (int objective = 0; objective < 3; objective++) {
        problem p;
        make_problem(&p, 6, 3, 4);
        for (int i = 0; i < 18; i++) p.pixels[i] = make_pixel(0.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        const ca_ray_settings settings = {.objective = (ca_ray_objective)objective,
                                          .max_light_paths = 5000,
                                          .max_camera_paths = 64,
                                          .given_light_paths = 10,
                                          .given_camera_paths = 10};
        ca_ray_numbers n = choose(&p, &settings);
        assert_true(n.best.variance == 0.0 && n.gain_over_given == 1.0 && n.best.light_paths == 1.0);
        for (int i = 0; i < 18; i++) assert_int_equal(n.camera_paths[i], 1);
        ca_ray_numbers_destroy(&n);
        /* Light paths without noise: as many camera paths as there may be, no more light paths than one. */
        p.image.fixed_time = 1e6;
        for (int i = 0; i < 18; i++) p.pixels[i] = make_pixel(0.0, 1.0, 0.0, 1.0, 1.0, 0.0);
        n = choose(&p, &settings);
        for (int i = 0; i < 18; i++) assert_int_equal(n.camera_paths[i], 64);
        assert_true(n.best.light_paths == 1.0);
        ca_ray_numbers_destroy(&n);
        /* And the other way round. */
        for (int i = 0; i < 18; i++) p.pixels[i] = make_pixel(0.0, 0.0, 1.0, 1.0, 1.0, 0.0);
        n = choose(&p, &settings);
        for (int i = 0; i < 18; i++) assert_int_equal(n.camera_paths[i], 1);
        assert_true(n.best.light_paths == 5000.0);
        ca_ray_numbers_destroy(&n);
    }
}

/* ---- Failures -------------------------------------------------------------------------------------------------- */

static void check_refused(const problem *p, const ca_ray_settings *settings, const char *words)
{
    ca_ray_numbers n;
    ca_error error = {""};
    assert_int_equal(ca_ray_numbers_choose(&n, &p->image, settings, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, words));
    assert_null(n.camera_paths);
}

static void test_refusals(void **state)
{
    (void)state;
    problem p, bad;
    make_problem(&p, 3, 2, 5);
    const ca_ray_settings none = {0};
#define CHECK(change, words)                                                                                       \
    bad = p;                                                                                                       \
    bad.image.pixels = bad.pixels;                                                                                 \
    bad.change;                                                                                                    \
    check_refused(&bad, &none, words)
    CHECK(image.height = 0, "at least one pixel");
    CHECK(image.light_time = 0.0, "more than 0");
    CHECK(image.fixed_time = -1.0, "at least 0");
    CHECK(pixels[4].pair = (double)NAN, "(1, 1)");
    CHECK(pixels[4].camera = (double)INFINITY, "(1, 1)");
    CHECK(pixels[4].light = (double)NAN, "(1, 1)");
    CHECK(pixels[4].luminance2 = (double)INFINITY, "(1, 1)");
    CHECK(pixels[2].luminance2 = HUGE_VAL, "(2, 0)");
    CHECK(pixels[3].camera_time = 0.0, "(0, 1)");
    CHECK(pixels[3].merge_time = -1.0, "(0, 1)");
#undef CHECK
    check_refused(&p, &(ca_ray_settings){.min_light_paths = 20, .max_light_paths = 10}, "20");
}

static void test_allocation_failures(void **state)
{
    (void)state;
    problem p;
    make_problem(&p, 3, 2, 5);
    int failures = 0;
    for (;; failures++) {
        ca_ray_numbers n;
        ca_memory_fail_after(failures);
        const ca_status status = ca_ray_numbers_choose(&n, &p.image, &(ca_ray_settings){0}, NULL);
        ca_memory_fail_after(-1);
        if (status == CA_OK) {
            ca_ray_numbers_destroy(&n);
            break;
        }
        assert_int_equal(status, CA_ERROR_MEMORY);
        assert_null(n.camera_paths);
    }
    assert_int_equal(failures, 6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_real_numbers),
        cmocka_unit_test(test_integers),
        cmocka_unit_test(test_worst_decile_of_many),
        cmocka_unit_test(test_light_paths_alone),
        cmocka_unit_test(test_units_do_not_matter),
        cmocka_unit_test(test_roots),
        cmocka_unit_test(test_monotone),
        cmocka_unit_test(test_noisy_estimates),
        cmocka_unit_test(test_smoothing_at_borders),
        cmocka_unit_test(test_negative_estimate),
        cmocka_unit_test(test_degenerate),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
