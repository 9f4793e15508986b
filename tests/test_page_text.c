/* Texts that may be any bytes in files that are UTF-8. */
#include "report/page_text.h"
#include "support/page_words.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>
#include <jansson.h>

/* Against jansson, which refuses what is no UTF-8. */
static void test_what_is_no_utf8_is_replaced(void **state)
{
    (void)state;
    static const struct {
        const char *text, *expected;
    } cases[] = {
        {"a\xc3\xa4\xe2\x82\xac\xf0\x9f\x92\xa1z", "a\xc3\xa4\xe2\x82\xac\xf0\x9f\x92\xa1z"},
        {"M\xfcller", "M\xef\xbf\xbdller"},                          /* Latin-1 */
        {"\xc3", "\xef\xbf\xbd"},                                    /* ends too early */
        {"\xe2\x82", "\xef\xbf\xbd\xef\xbf\xbd"},
        {"\xc0\x80", "\xef\xbf\xbd\xef\xbf\xbd"},                    /* too long for what it says */
        {"\xe0\x9f\xbf", "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd"},
        {"\xed\xa0\x80", "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd"},    /* a surrogate */
        {"\xf4\x90\x80\x80.", "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd."}, /* beyond the last one */
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char *json = page_words(ca_page_put_json, cases[i].text), *html = page_words(ca_page_put_html, cases[i].text);
        json_t *value = json_loads(json, JSON_DECODE_ANY, NULL);
        if (!value) fail_msg("case %zu: %s is not JSON", i, json);
        assert_string_equal(json_string_value(value), cases[i].expected);
        assert_string_equal(html, cases[i].expected);
        json_decref(value);
        free(json);
        free(html);
    }
    /* Every two and three bytes: a sequence exactly where jansson takes it for one. */
    for (unsigned a = 0x80; a < 0x100; a++)
        for (unsigned b = 0x70; b < 0x100; b++)
            for (unsigned c = 0x7f; c < 0xc1; c += 0x41 / 5) {
                const char two[] = {(char)a, (char)b, '\0'}, three[] = {(char)a, (char)b, (char)c, '\0'};
                json_t *of_two = json_string(two), *of_three = json_string(three);
                assert_true((ca_page_sequence(two) == 2) == (of_two != NULL));
                assert_true((ca_page_sequence(three) == 3 || (of_two && c == 0x7f)) == (of_three != NULL));
                json_decref(of_two);
                json_decref(of_three);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_is_no_utf8_is_replaced),
    };
    return cmocka_run_group_tests_name("page text", tests, NULL, NULL);
}
