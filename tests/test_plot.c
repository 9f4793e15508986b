/* Plots as SVG, and the power law fitted to points. */
#define _POSIX_C_SOURCE 200809L
#include "report/plot.h"
#include "report/power_fit.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <expat.h>
#include <math.h>

/* ---- Plots ----------------------------------------------------------------------------------------------------- */

typedef struct svg {
    char *bytes;
    size_t size;
    int circles, texts, paths; /* elements */
    char words[4096];          /* of all texts */
} svg;

static void XMLCALL on_start(void *user, const XML_Char *name, const XML_Char **attributes)
{
    svg *s = user;
    (void)attributes;
    s->circles += strcmp(name, "circle") == 0;
    s->texts += strcmp(name, "text") == 0;
    s->paths += strcmp(name, "path") == 0;
}

static void XMLCALL on_text(void *user, const XML_Char *text, int length)
{
    svg *s = user;
    const size_t used = strlen(s->words);
    snprintf(s->words + used, sizeof s->words - used, "%.*s", length, text);
}

/* Draws, and reads what came out. */
static svg draw(const ca_plot_panel *panels, size_t count, unsigned columns)
{
    svg s = {0};
    FILE *stream = open_memstream(&s.bytes, &s.size);
    assert_non_null(stream);
    ca_plot_write(stream, panels, count, columns);
    assert_int_equal(fclose(stream), 0);
    XML_Parser parser = XML_ParserCreate("UTF-8");
    XML_SetUserData(parser, &s);
    XML_SetElementHandler(parser, on_start, NULL);
    XML_SetCharacterDataHandler(parser, on_text);
    if (XML_Parse(parser, s.bytes, (int)s.size, 1) != XML_STATUS_OK)
        fail_msg("line %lu: %s", XML_GetCurrentLineNumber(parser), XML_ErrorString(XML_GetErrorCode(parser)));
    XML_ParserFree(parser);
    if (strstr(s.bytes, "nan") || strstr(s.bytes, "inf")) fail_msg("a place that is no number:\n%s", s.bytes);
    return s;
}

/* "cx="..." cy="..."" of the circle with this number. */
static void circle_at(const svg *s, int number, double *x, double *y)
{
    const char *at = s->bytes;
    for (int i = 0; i <= number; i++) {
        at = strstr(i ? at + 1 : at, "<circle");
        assert_non_null(at);
    }
    assert_int_equal(sscanf(at, "<circle cx=\"%lf\" cy=\"%lf\"", x, y), 2);
}

static void test_points_lie_where_they_should(void **state)
{
    (void)state;
    const ca_plot_point points[] = {{.x = 1, .y = 100}, {.x = 10, .y = 10}, {.x = 100, .y = 1}};
    const ca_plot_series series = {.name = "one", .points = points, .count = 3};
    const ca_plot_panel panel = {.title = "t", .x_label = "x", .y_label = "y", .series = &series, .count = 1};
    svg s = draw((const ca_plot_panel[]){panel, panel}, 2, 2);
    double x[6], y[6];
    for (int i = 0; i < 6; i++) circle_at(&s, i, &x[i], &y[i]);
    assert_int_equal(s.circles, 6);
    for (int k = 0; k < 6; k += 3) { /* equal ratios are equal distances; larger is further right, and further up */
        assert_true(fabs((x[k + 1] - x[k]) - (x[k + 2] - x[k + 1])) < 0.11 && x[k] < x[k + 1]);
        assert_true(fabs((y[k + 1] - y[k]) - (y[k + 2] - y[k + 1])) < 0.11 && y[k] < y[k + 1]);
    }
    assert_true(fabs(y[0] - y[3]) < 0.01 && fabs(x[3] - x[0] - 460.0) < 0.11); /* beside each other */
    free(s.bytes);
    s = draw((const ca_plot_panel[]){panel, panel}, 2, 1);
    circle_at(&s, 0, &x[0], &y[0]);
    circle_at(&s, 3, &x[3], &y[3]);
    assert_true(fabs(x[0] - x[3]) < 0.01 && y[3] > y[0] + 380.0); /* below each other */
    free(s.bytes);
}

/* Error bars end at the border, which a plot may have no end for. */
static void test_error_bars(void **state)
{
    (void)state;
    const ca_plot_point points[] = {{.x = 1, .y = 2, .low = 1.5, .high = 3},
                                    {.x = 2, .y = 1, .low = -5, .high = HUGE_VAL},
                                    {.x = 3, .y = 1, .low = (double)NAN, .high = (double)NAN}};
    const ca_plot_series series = {.points = points, .count = 3};
    const ca_plot_series plain = {.points = points + 2, .count = 1};
    ca_plot_panel panel = {.title = "t", .x_label = "x", .y_label = "y", .series = &series, .count = 1};
    svg with = draw(&panel, 1, 1);
    const int paths = with.paths;
    free(with.bytes);
    panel.series = &plain;
    svg without = draw(&panel, 1, 1);
    assert_true(paths >= 3); /* two bars and the line between points */
    assert_int_equal(without.circles, 1);
    free(without.bytes);
}

static void test_odd_values_and_texts(void **state)
{
    (void)state;
    const ca_plot_point odd[] = {{.x = 0, .y = 1},        {.x = 1, .y = 0},        {.x = -1, .y = 3},
                                 {.x = 2, .y = (double)NAN}, {.x = HUGE_VAL, .y = 1}, {.x = 4, .y = 5}};
    const ca_plot_series series[] = {{.name = "a<b & \"c\"", .points = odd, .count = 6},
                                     {.name = NULL, .points = odd, .bare = true}};
    ca_plot_panel panel = {.title = "</svg>", .x_label = "x & y", .y_label = "y>", .series = series, .count = 2};
    svg s = draw(&panel, 1, 3);
    assert_int_equal(s.circles, 1);
    assert_non_null(strstr(s.words, "a<b & \"c\""));
    assert_non_null(strstr(s.words, "</svg>"));
    free(s.bytes);
    panel.count = 0;
    s = draw(&panel, 1, 1);
    assert_int_equal(s.circles, 0);
    free(s.bytes);
}

/* ---- The power law --------------------------------------------------------------------------------------------- */

static void assert_close(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance)) fail_msg("%.12g is not %.12g", value, expected);
}

static void test_exact_law(void **state)
{
    (void)state;
    double x[7], y[7];
    for (int i = 0; i < 7; i++) x[i] = pow(3.0, i), y[i] = 5.0 * pow(x[i], -0.75);
    const ca_power_fit fit = ca_power_fit_of(x, y, 7);
    assert_int_equal(fit.points, 7);
    assert_close(fit.exponent, -0.75, 1e-12);
    assert_close(exp(fit.offset), 5.0, 1e-11);
    assert_close(fit.half_width, 0.0, 1e-10);
}

/* By hand: of logarithms (0, 0), (1, 1), (2, 1) the slope is 1/2, the residuals -1/6, 1/3, -1/6, so that its standard
 * error is sqrt(1/6 / 1 / 2); Student's 97.5 % quantile with one degree of freedom is tan(0.95 pi / 2). */
static void test_interval_by_hand(void **state)
{
    (void)state;
    const double e = exp(1.0), x[] = {1.0, e, e * e}, y[] = {1.0, e, e};
    const ca_power_fit fit = ca_power_fit_of(x, y, 3);
    assert_close(fit.exponent, 0.5, 1e-12);
    assert_close(fit.offset, 1.0 / 6.0, 1e-12);
    assert_close(fit.error, sqrt(1.0 / 12.0), 1e-12);
    assert_close(fit.half_width, sqrt(1.0 / 12.0) * 12.706204736, 1e-6);
}

/* In 19 of 20 cases the interval holds the exponent. */
static void test_interval_holds(void **state)
{
    (void)state;
    enum { TRIALS = 4000, POINTS = 8 };
    ca_test_random random = ca_test_random_seed(7);
    int held = 0;
    for (int t = 0; t < TRIALS; t++) {
        double x[POINTS], y[POINTS];
        for (int i = 0; i < POINTS; i++) {
            double normal = -6.0; /* the sum of twelve uniform numbers less six */
            for (int k = 0; k < 12; k++) normal += (double)ca_test_random_float(&random);
            x[i] = pow(2.0, i);
            y[i] = 0.3 * pow(x[i], -0.5) * exp(0.2 * normal);
        }
        const ca_power_fit fit = ca_power_fit_of(x, y, POINTS);
        held += fabs(fit.exponent + 0.5) <= fit.half_width;
    }
    /* 3800 are expected, with a standard deviation of 14. */
    if (held < 3740 || held > 3860) fail_msg("%d of %d intervals hold the exponent", held, TRIALS);
}

static void test_points_without_a_law(void **state)
{
    (void)state;
    const double x[] = {1, 2, 4, 0, 8, 16}, y[] = {1, 0, (double)NAN, 3, -1, 0.25}, same[] = {3, 3, 3};
    ca_power_fit fit = ca_power_fit_of(x, y, 6);
    assert_int_equal(fit.points, 2); /* a line through two points, without an error */
    assert_close(fit.exponent, -0.5, 1e-12);
    assert_true(isnan(fit.error) && isnan(fit.half_width));
    fit = ca_power_fit_of(x, y, 3);
    assert_true(fit.points == 1 && isnan(fit.exponent));
    fit = ca_power_fit_of(same, x, 3);
    assert_true(fit.points == 3 && isnan(fit.exponent) && isnan(fit.half_width));
    fit = ca_power_fit_of(x, y, 0);
    assert_true(fit.points == 0 && isnan(fit.exponent));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_points_lie_where_they_should), cmocka_unit_test(test_error_bars),
        cmocka_unit_test(test_odd_values_and_texts),         cmocka_unit_test(test_exact_law),
        cmocka_unit_test(test_interval_by_hand),             cmocka_unit_test(test_interval_holds),
        cmocka_unit_test(test_points_without_a_law),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
