/* Spectra into colours: constants, known colours, narrow lines, and exactness of the integrals. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "image/spectrum.h"

static void assert_near(float actual, double expected, double tolerance)
{
    if (!(fabs((double)actual - expected) <= tolerance)) fail_msg("%g, expected %g", (double)actual, expected);
}

static void assert_rgb(ca_rgb actual, double r, double g, double b, double tolerance)
{
    assert_near(actual.r, r, tolerance);
    assert_near(actual.g, g, tolerance);
    assert_near(actual.b, b, tolerance);
}

static void constant_reflectance_is_grey(void **state)
{
    (void)state;
    const ca_spectrum_sample wide[2] = {{300.0, 0.25}, {900.0, 0.25}};
    assert_rgb(ca_spectrum_reflectance(wide, 2), 0.25, 0.25, 0.25, 1e-6);
    const ca_spectrum_sample split[4] = {{360.0, 0.5}, {501.3, 0.5}, {640.77, 0.5}, {830.0, 0.5}};
    assert_rgb(ca_spectrum_reflectance(split, 4), 0.5, 0.5, 0.5, 1e-6);
}

/* Equal-energy white, x = y = 1/3, in Rec. 709 for Y = 1: the sums of the matrix' rows. */
static void constant_emission_has_luminance_one(void **state)
{
    (void)state;
    const ca_spectrum_sample one[2] = {{360.0, 1.0}, {830.0, 1.0}};
    const ca_rgb rgb = ca_spectrum_emission(one, 2);
    assert_near(ca_luminance(rgb), 1.0, 1e-4);
    assert_rgb(rgb, 1.2048, 0.9484, 0.9089, 1e-3);
}

/* A line at 555 nm emits about 683/106.857 of the luminance that the same power does when it is spread evenly, and
 * has the chromaticity of the spectral locus there, (0.3373, 0.6589) by CIE's tables. */
static void narrow_line_is_not_missed(void **state)
{
    (void)state;
    const ca_spectrum_sample line[3] = {{554.99, 0.0}, {555.0, 100.0}, {555.01, 0.0}};
    const ca_rgb rgb = ca_spectrum_emission(line, 3);
    /* Its area is 1 nm; the integral of y over the spectrum is 106.857. */
    assert_near(ca_luminance(rgb), 1.0 / 106.857, 2e-5);
    const double x = 0.4123908 * (double)rgb.r + 0.3575843 * (double)rgb.g + 0.1804808 * (double)rgb.b;
    const double y = 0.2126390 * (double)rgb.r + 0.7151687 * (double)rgb.g + 0.0721923 * (double)rgb.b;
    const double z = 0.0193308 * (double)rgb.r + 0.1191948 * (double)rgb.g + 0.9505322 * (double)rgb.b;
    assert_near((float)(x / (x + y + z)), 0.3373, 2e-3);
    assert_near((float)(y / (x + y + z)), 0.6589, 2e-3);
}

static void nothing_outside_of_the_list(void **state)
{
    (void)state;
    const ca_spectrum_sample invisible[2] = {{900.0, 1.0}, {1000.0, 1.0}};
    assert_rgb(ca_spectrum_emission(invisible, 2), 0.0, 0.0, 0.0, 0.0);
    const ca_spectrum_sample red[2] = {{600.0, 1.0}, {830.0, 1.0}}, rest[2] = {{360.0, 1.0}, {600.0, 1.0}};
    const ca_rgb a = ca_spectrum_reflectance(red, 2), b = ca_spectrum_reflectance(rest, 2);
    assert_true(a.r > 0.5f && a.g < 0.1f && a.b < 0.1f);
    assert_rgb(ca_rgb_add(a, b), 1.0, 1.0, 1.0, 1e-5);
}

/* The same spectrum with many more breakpoints has the same colour: the integrals are exact, not sampled. */
static void refinement_changes_nothing(void **state)
{
    (void)state;
    enum { FINE = 1001 };
    ca_spectrum_sample fine[FINE];
    const ca_spectrum_sample coarse[2] = {{400.0, 0.1}, {700.0, 0.9}};
    for (int i = 0; i < FINE; i++) {
        const double t = (double)i / (FINE - 1);
        fine[i] = (ca_spectrum_sample){400.0 + 300.0 * t, 0.1 + 0.8 * t};
    }
    const ca_rgb a = ca_spectrum_reflectance(coarse, 2), b = ca_spectrum_reflectance(fine, FINE);
    assert_rgb(a, (double)b.r, (double)b.g, (double)b.b, 1e-6);
    const ca_rgb c = ca_spectrum_emission(coarse, 2), d = ca_spectrum_emission(fine, FINE);
    assert_rgb(c, (double)d.r, (double)d.g, (double)d.b, 1e-6);
}

/* Checks the tables for typing errors. */
static void tables_have_equal_areas(void **state)
{
    (void)state;
    /* CIE's x, y and z have the same area over the spectrum, so equal energy lies at x = y = 1/3. */
    const ca_spectrum_sample one[2] = {{360.0, 1.0}, {830.0, 1.0}};
    const ca_rgb e = ca_spectrum_emission(one, 2);
    const double x = 0.4123908 * (double)e.r + 0.3575843 * (double)e.g + 0.1804808 * (double)e.b;
    const double z = 0.0193308 * (double)e.r + 0.1191948 * (double)e.g + 0.9505322 * (double)e.b;
    assert_near((float)x, 1.0, 2e-4);
    assert_near((float)z, 1.0, 4e-4);
}

static void values_between_and_beyond(void **state)
{
    (void)state;
    const ca_spectrum_sample list[] = {{400.0, 1.0}, {500.0, 3.0}, {600.0, 2.0}};
    const double wavelengths[] = {100.0, 400.0, 425.0, 500.0, 590.0, 600.0, 900.0};
    const double values[] = {1.0, 1.0, 1.5, 3.0, 2.1, 2.0, 2.0};
    for (int i = 0; i < 7; i++)
        assert_true(fabs(ca_spectrum_value(list, 3, wavelengths[i]) - values[i]) < 1e-12);
    assert_true(ca_spectrum_value(list, 1, 900.0) == 1.0);
}

/* At 5000 K Planck's law has 12107 W m^-2 sr^-1 nm^-1 at 500 nm and its peak of 4.0957e-15 T^5 at 579.55 nm. */
static void black_body_radiates_by_planck(void **state)
{
    (void)state;
    ca_spectrum_sample samples[CA_BLACKBODY_SAMPLES];
    ca_spectrum_blackbody(5000.0, samples);
    const double peak = ca_spectrum_blackbody_peak(5000.0);
    assert_true(fabs(peak / (4.0957e-15 * pow(5000.0, 5.0)) - 1.0) < 1e-4);
    assert_true(samples[0].wavelength_nm == 360.0 && samples[CA_BLACKBODY_SAMPLES - 1].wavelength_nm == 830.0);
    assert_true(fabs(samples[28].value / 12107.0 - 1.0) < 1e-3);
    for (int i = 0; i < CA_BLACKBODY_SAMPLES; i++) assert_true(samples[i].value > 0.0 && samples[i].value < peak);
    assert_true(samples[44].value > 0.99999 * peak);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(constant_reflectance_is_grey), cmocka_unit_test(constant_emission_has_luminance_one),
        cmocka_unit_test(narrow_line_is_not_missed),    cmocka_unit_test(nothing_outside_of_the_list),
        cmocka_unit_test(refinement_changes_nothing),   cmocka_unit_test(tables_have_equal_areas),
        cmocka_unit_test(values_between_and_beyond),    cmocka_unit_test(black_body_radiates_by_planck),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
