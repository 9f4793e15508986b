#define _POSIX_C_SOURCE 200809L /* open_memstream */
#include "support/page_words.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

char *page_words(void (*function)(FILE *, const char *), const char *text)
{
    char *result = NULL;
    size_t length = 0;
    FILE *stream = open_memstream(&result, &length);
    assert_non_null(stream);
    function(stream, text);
    assert_int_equal(fclose(stream), 0);
    return result;
}
