/* `caustica compare --html` from outside: the page is there, and where it cannot be, nothing is. What is in it is for
 * test_report.c and test_report_page.sh. */
#include "support/program_test.h"

static void render(void **state, const char *name, const char *seed)
{
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "--seed", seed, "-o", name, "--quiet");
    assert_exit(&r, 0);
}

static void test_writes_a_page(void **state)
{
    ca_program_result r;
    render(state, "a.exr", "1");
    render(state, "b.exr", "2");
    RUN(&r, "compare", "a.exr", "--reference", "b.exr", "--html", "page.html", "--html-layers", "Albedo,P.X",
        "--roi=2,3,10,12");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    assert_says(r.output, "\nwrote page.html\n");
    assert_true(exists(folder_of(state), "page.html"));
    RUN(&r, "compare", "a.exr", "--reference", "b.exr", "--html", "all.html", "--html-layers=all");
    assert_exit(&r, 0);
    assert_true(exists(folder_of(state), "all.html"));
}

/* A layer that only one of the images has, be it the last one. */
static void test_layer_of_one_image(void **state)
{
    ca_program_result r;
    render(state, "a.exr", "1");
    RUN(&r, "render", "ball.xml", "--quiet", "-i", "bdpt", "-o", "plain.pfm");
    assert_exit(&r, 0);
    RUN(&r, "compare", "plain.pfm", "a.exr", "--reference=plain.pfm", "--html=page.html", "--html-layers=Albedo");
    assert_exit(&r, 0);
    assert_true(exists(folder_of(state), "page.html"));
}

static void test_refuses(void **state)
{
    ca_program_result r;
    render(state, "a.exr", "1");
    RUN(&r, "compare", "a.exr", "--reference", "a.exr", "--html-layers=all");
    assert_wrong_usage(&r, "--html-layers needs --html");
    RUN(&r, "compare", "a.exr", "--reference", "a.exr", "--html=page.html", "--html-layers=Albedo,Albino");
    assert_wrong_usage(&r, "no picture has a layer \"Albino\"");
    assert_string_equal(r.output, ""); /* found out before the work */
    assert_false(exists(folder_of(state), "page.html"));
    RUN(&r, "compare", "a.exr", "--reference", "a.exr", "--html=missing/page.html");
    assert_exit(&r, 1);
    assert_says(r.errors, "missing/page.html");
    assert_string_equal(r.output, ""); /* found out before the work */
    RUN(&r, "compare", "a.exr", "--reference", "a.exr", "--html=.");
    assert_exit(&r, 1);
    assert_says(r.errors, ".: cannot write: this is not a regular file");
    assert_string_equal(r.output, "");
    RUN(&r, "compare", "a.exr", "--reference", "a.exr", "--stats=-");
    assert_exit(&r, 1);
    assert_says(r.errors, "-: files are not written to standard output");
    assert_string_equal(r.output, "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {PROGRAM_TEST(test_writes_a_page), PROGRAM_TEST(test_layer_of_one_image),
                                      PROGRAM_TEST(test_refuses)};
    return run_program_tests("cli_html", tests, sizeof tests / sizeof tests[0]);
}
