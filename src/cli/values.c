#include "cli/values.h"

#include "base/text.h"

#include <float.h>
#include <inttypes.h>
#include <math.h>

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

/* Reads decimal digits up to `limit` and moves the text behind them; neither sign nor space. */
static bool read_digits(const char **text, uint64_t limit, uint64_t *value)
{
    if (!is_digit(**text)) return false;
    *value = 0;
    for (; is_digit(**text); (*text)++) {
        const uint64_t digit = (uint64_t)(**text - '0');
        if (*value > (limit - digit) / 10) return false;
        *value = *value * 10 + digit;
    }
    return true;
}

/* The text is no whole number of at least `minimum`, or one above `limit`. */
static ca_status fail_whole(const char *text, int minimum, uint64_t limit, ca_error *error)
{
    const char *rest = text;
    uint64_t number;
    if (ca_value_is_digits(text) && !read_digits(&rest, limit, &number))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.100s\" is too large: the largest is %" PRIu64, text,
                       limit);
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.100s\" is not a whole number of at least %d", text, minimum);
}

ca_status ca_value_count(const char *text, int minimum, uint32_t *value, ca_error *error)
{
    const char *rest = text;
    uint64_t number = 0;
    if (!read_digits(&rest, UINT32_MAX, &number) || *rest != 0 || number < (uint64_t)minimum)
        return fail_whole(text, minimum, UINT32_MAX, error);
    *value = (uint32_t)number;
    return CA_OK;
}

bool ca_value_is_digits(const char *text)
{
    size_t length = 0;
    while (is_digit(text[length])) length++;
    return length > 0 && text[length] == 0;
}

ca_status ca_value_port(const char *text, uint32_t *value, ca_error *error)
{
    const char *rest = text;
    uint64_t number = 0;
    if (!read_digits(&rest, 65535, &number) || *rest != 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.100s\" is not a port, 0 to 65535", text);
    *value = (uint32_t)number;
    return CA_OK;
}

ca_status ca_value_seed(const char *text, uint64_t *value, ca_error *error)
{
    const char *rest = text;
    if (!read_digits(&rest, UINT64_MAX, value) || *rest != 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.100s\" is not a whole number from 0 to 2^64 - 1", text);
    return CA_OK;
}

ca_status ca_value_integer(const char *text, int minimum, int *value, ca_error *error)
{
    const char *rest = text + (text[0] == '-');
    uint64_t number = 0;
    const bool good = read_digits(&rest, INT32_MAX, &number) && *rest == 0;
    const int64_t with_sign = text[0] == '-' ? -(int64_t)number : (int64_t)number;
    if (!good || with_sign < minimum) return fail_whole(text, minimum, INT32_MAX, error);
    *value = (int)with_sign;
    return CA_OK;
}

/* Decimal numbers only: neither spaces nor hexadecimals. Of one that is too large *value is infinite. */
static bool read_real(const char *text, double *value)
{
    *value = 0.0;
    for (const char *c = text; *c; c++)
        if (!is_digit(*c) && *c != '.' && *c != '-' && *c != '+' && *c != 'e' && *c != 'E') return false;
    return ca_parse_double(text, value);
}

/* A number that no double holds, whose value is thus infinite. */
static ca_status fail_large(const char *text, double value, ca_error *error)
{
    if (value < 0.0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.100s\" is beyond the smallest number, %.4g", text,
                       -DBL_MAX);
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.100s\" is too large: the largest number is %.4g", text,
                   DBL_MAX);
}

ca_status ca_value_real(const char *text, double *value, ca_error *error)
{
    if (read_real(text, value)) return CA_OK;
    if (isinf(*value)) return fail_large(text, *value, error);
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.100s\" is not a number", text);
}

ca_status ca_value_positive(const char *text, double *value, ca_error *error)
{
    if (read_real(text, value) && *value > 0.0) return CA_OK;
    if (isinf(*value) && *value > 0.0) return fail_large(text, *value, error);
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.100s\" is not a number above 0", text);
}

/* `count` whole numbers with `separator` between them. */
static bool read_list(const char *text, char separator, int count, uint32_t *values)
{
    for (int i = 0; i < count; i++) {
        uint64_t number = 0;
        if (i > 0 && *text++ != separator) return false;
        if (!read_digits(&text, UINT32_MAX, &number)) return false;
        values[i] = (uint32_t)number;
    }
    return *text == 0;
}

/* Tells which number is above the limit in a text that has only digits and separators; false: none is. */
static bool tells_large(const char *text, char separator, uint64_t limit, ca_error *error)
{
    for (const char *c = text; *c; c++)
        if (!is_digit(*c) && *c != separator) return false;
    for (; *text; text += *text == separator) {
        const char *first = text;
        uint64_t number;
        const bool large = is_digit(*text) && !read_digits(&text, limit, &number);
        while (is_digit(*text)) text++;
        if (!large) continue;
        ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.*s\" is too large: the largest is %" PRIu64,
                text - first < 100 ? (int)(text - first) : 100, first, limit);
        return true;
    }
    return false;
}

ca_status ca_value_size(const char *text, uint32_t value[2], ca_error *error)
{
    if (read_list(text, 'x', 2, value) && value[0] > 0 && value[1] > 0) return CA_OK;
    if (tells_large(text, 'x', UINT32_MAX, error)) return CA_ERROR_ARGUMENT;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.100s\" is not a size like 640x480", text);
}

ca_status ca_value_range(const char *text, uint64_t value[2], ca_error *error)
{
    const char *rest = text;
    const bool good =
        read_digits(&rest, UINT64_MAX, &value[0]) && *rest++ == ':' && read_digits(&rest, UINT64_MAX, &value[1]);
    if (good && *rest == 0 && value[0] < value[1]) return CA_OK;
    if (tells_large(text, ':', UINT64_MAX, error)) return CA_ERROR_ARGUMENT;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.100s\" is not a range A:B with A < B", text);
}

ca_status ca_value_rect(const char *text, uint32_t value[4], ca_error *error)
{
    if (read_list(text, ',', 4, value) && value[0] < value[2] && value[1] < value[3]) return CA_OK;
    if (tells_large(text, ',', UINT32_MAX, error)) return CA_ERROR_ARGUMENT;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "\"%.100s\" is not a region x0,y0,x1,y1 with x0 < x1 and y0 < y1", text);
}
