/* The live view: who is let in, and what looking may cost, judged from words and numbers alone. */
#include "live/access.h"
#include "live/budget.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* ---- Requests judged ------------------------------------------------------------------------------------------- */

static int judge(const char *address, const char *method, const char *path, const char *host, const char *origin)
{
    ca_live_access access = {.token = "0123456789abcdef0123456789abcdef", .port = 8080};
    strcpy(access.address, address);
    access.any_address = strcmp(address, "0.0.0.0") == 0;
    const ca_live_request request = {.method = method, .path = path, .host = host, .origin = origin};
    ca_live_resource resource;
    return ca_live_judge(&access, &request, &resource);
}

#define TOKEN "/0123456789abcdef0123456789abcdef"

static void test_access(void **state)
{
    (void)state;
    const char *const here = "127.0.0.1", *const host = "127.0.0.1:8080";
    assert_int_equal(judge(here, "GET", TOKEN "/", host, NULL), 200);
    assert_int_equal(judge(here, "GET", TOKEN "/events", "localhost:8080", "http://localhost:8080"), 200);
    assert_int_equal(judge("::1", "GET", TOKEN "/", "[::1]:8080", NULL), 200);
    /* The token: none, a part of it, one letter wrong, something behind it. */
    assert_int_equal(judge(here, "GET", "/", host, NULL), 403);
    assert_int_equal(judge(here, "GET", "/events", host, NULL), 403);
    assert_int_equal(judge(here, "GET", TOKEN, host, NULL), 403);
    assert_int_equal(judge(here, "GET", "/0123456789abcdef0123456789abcde/", host, NULL), 403);
    assert_int_equal(judge(here, "GET", "/0123456789abcdef0123456789abcdee/", host, NULL), 403);
    assert_int_equal(judge(here, "GET", TOKEN "0/", host, NULL), 403);
    /* The host: a name that resolves to this machine, another port, no port, none at all. */
    static const char *const wrong_hosts[] = {"evil.example:8080",
                                              "127.0.0.1:8081",
                                              "127.0.0.1",
                                              "127.0.0.2:8080",
                                              "localhost.evil.example:8080",
                                              "[127.0.0.1:8080",
                                              "",
                                              ":8080",
                                              "127.0.0.1:8080x"};
    for (size_t i = 0; i < sizeof wrong_hosts / sizeof wrong_hosts[0]; i++)
        assert_int_equal(judge(here, "GET", TOKEN "/", wrong_hosts[i], NULL), 403);
    assert_int_equal(judge(here, "GET", TOKEN "/", NULL, NULL), 400);
    assert_int_equal(judge("0.0.0.0", "GET", TOKEN "/", "192.168.1.5:8080", NULL), 200);
    assert_int_equal(judge("0.0.0.0", "GET", TOKEN "/", "evil.example:8080", NULL), 403);
    /* Another page's request. */
    assert_int_equal(judge(here, "POST", TOKEN "/stop", host, "http://evil.example:8080"), 403);
    assert_int_equal(judge(here, "POST", TOKEN "/stop", host, "null"), 403);
    assert_int_equal(judge(here, "POST", TOKEN "/stop", host, "http://127.0.0.1:8080"), 200);
    /* Paths that climb, and things that are not there. */
    static const char *const climbing[] = {TOKEN "/../etc/passwd", TOKEN "/..",
                                           "/../" TOKEN "/",       TOKEN "//etc/passwd",
                                           TOKEN "/..\\live.js",   TOKEN "/%2e%2e/live.js",
                                           "etc/passwd",           "*"};
    for (size_t i = 0; i < sizeof climbing / sizeof climbing[0]; i++)
        assert_int_equal(judge(here, "GET", climbing[i], host, NULL), 400);
    assert_int_equal(judge(here, "GET", TOKEN "/compare.js", host, NULL), 404);
    assert_int_equal(judge(here, "GET", TOKEN "/events/", host, NULL), 404);
    assert_int_equal(judge(here, "GET", TOKEN "/stop", host, NULL), 405);
    assert_int_equal(judge(here, "POST", TOKEN "/", host, NULL), 405);
    assert_int_equal(judge(here, "DELETE", TOKEN "/events", host, NULL), 405);
}

static void test_tokens_differ(void **state)
{
    (void)state;
    char a[CA_LIVE_TOKEN_LENGTH + 1], b[CA_LIVE_TOKEN_LENGTH + 1];
    assert_true(ca_live_make_token(a) && ca_live_make_token(b));
    assert_int_equal(strlen(a), CA_LIVE_TOKEN_LENGTH);
    assert_int_equal(strspn(a, "0123456789abcdef"), CA_LIVE_TOKEN_LENGTH);
    assert_string_not_equal(a, b);
}

static void test_budget(void **state)
{
    (void)state;
    ca_live_budget budget = ca_live_budget_open(1);
    assert_true(budget.start > 0.0 && budget.spent == 0.0);
    budget.start = 100.0;
    budget.spent = 0.45; /* the advance, and the share of 20 s */
    assert_true(ca_live_budget_allows(&budget, 120.01, 0.0));
    assert_false(ca_live_budget_allows(&budget, 119.9, 0.0));
    assert_false(ca_live_budget_allows(&budget, 120.01, 0.01));
    ca_live_budget_end(&budget, 120.01, 5e7); /* 0.6 s in all, and 0.1 s for the picture */
    assert_true(ca_live_budget_allows(&budget, 120.01, 0.25));
    assert_false(ca_live_budget_allows(&budget, 120.01, 0.26));
    /* A picture that is not paid off does not take the last one away. */
    ca_live_budget poor = {.share = CA_LIVE_SHARE, .advance = CA_LIVE_ADVANCE, .spent = 5.0};
    ca_live_budget_end(&poor, 20.0, 5e7);
    assert_true(ca_live_budget_allows(&poor, 20.0, 0.24));
    assert_false(ca_live_budget_allows(&poor, 20.0, 0.26));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_access),
        cmocka_unit_test(test_tokens_differ),
        cmocka_unit_test(test_budget),
    };
    return cmocka_run_group_tests_name("live view: who and how much", tests, NULL, NULL);
}
