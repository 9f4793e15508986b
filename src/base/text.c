#define _POSIX_C_SOURCE 200809L
#include "base/text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- Names that are nearly right ------------------------------------------------------------------------------- */

enum { COMPARED = 63 };

static size_t min3(size_t a, size_t b, size_t c)
{
    const size_t ab = a < b ? a : b;
    return ab < c ? ab : c;
}

size_t ca_edit_distance(const char *a, const char *b)
{
    const size_t a_length = strnlen(a, COMPARED), b_length = strnlen(b, COMPARED);
    /* rows[i % 3][j]: edits from the first i letters of a to the first j of b (optimal string alignment). */
    size_t rows[3][COMPARED + 1];
    for (size_t j = 0; j <= b_length; j++) rows[0][j] = j;
    for (size_t i = 1; i <= a_length; i++) {
        size_t *row = rows[i % 3];
        const size_t *above = rows[(i - 1) % 3], *two_above = rows[(i + 1) % 3];
        row[0] = i;
        for (size_t j = 1; j <= b_length; j++) {
            row[j] = min3(above[j] + 1, row[j - 1] + 1, above[j - 1] + (a[i - 1] != b[j - 1]));
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] && two_above[j - 2] + 1 < row[j])
                row[j] = two_above[j - 2] + 1;
        }
    }
    return rows[a_length % 3][b_length];
}

const char *ca_nearer_name(const char *word, const char *a, const char *b)
{
    if (!a || !b) return a ? a : b;
    return ca_edit_distance(word, b) < ca_edit_distance(word, a) ? b : a;
}

const char *ca_nearest_name_however_far(const char *word, const char *const *candidates, size_t count)
{
    const char *nearest = NULL;
    for (size_t i = 0; i < count; i++) nearest = ca_nearer_name(word, nearest, candidates[i]);
    return nearest;
}

const char *ca_nearest_name(const char *word, const char *const *candidates, size_t count)
{
    const char *nearest = ca_nearest_name_however_far(word, candidates, count);
    return nearest && ca_edit_distance(word, nearest) <= strlen(word) / 3 + 1 ? nearest : NULL;
}

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

/* Digits beyond this many cannot change a double by more than its rounding. */
enum { SIGNIFICANT_DIGITS = 40 };

typedef struct decimal {
    char digits[SIGNIFICANT_DIGITS + 1];
    int digit_count;
    int64_t exponent; /* value = digits * 10^exponent */
    bool negative;
} decimal;

static void add_digit(decimal *number, char digit, bool after_point)
{
    const bool leading_zero = digit == '0' && number->digit_count == 0;
    const bool kept = !leading_zero && number->digit_count < SIGNIFICANT_DIGITS;
    if (kept) number->digits[number->digit_count++] = digit;
    if (after_point && (kept || leading_zero)) number->exponent--;
    if (!after_point && !kept && !leading_zero) number->exponent++;
}

/* [+-] digits [. digits] [e [+-] digits], with a digit before or after the point. */
static bool scan_decimal(const char *text, const char *end, decimal *number)
{
    *number = (decimal){.negative = text < end && *text == '-'};
    if (text < end && (*text == '-' || *text == '+')) text++;
    bool any = false;
    for (; text < end && is_digit(*text); text++, any = true) add_digit(number, *text, false);
    if (text < end && *text == '.')
        for (text++; text < end && is_digit(*text); text++, any = true) add_digit(number, *text, true);
    if (!any) return false;
    if (text == end) return true;
    if (*text != 'e' && *text != 'E') return false;
    text++;
    const bool negative = text < end && *text == '-';
    if (text < end && (*text == '-' || *text == '+')) text++;
    if (text == end) return false;
    int64_t exponent = 0;
    for (; text < end && is_digit(*text); text++)
        if (exponent < 1000000) exponent = 10 * exponent + (*text - '0');
    number->exponent += negative ? -exponent : exponent;
    return text == end;
}

bool ca_parse_number(const char *text, size_t length, double *value)
{
    decimal number;
    if (!scan_decimal(text, text + length, &number)) return false;
    /* Written again without a decimal point, the number reads the same in every locale, and strtod rounds it well. */
    char canonical[SIGNIFICANT_DIGITS + 32];
    snprintf(canonical, sizeof canonical, "%s%s%se%lld", number.negative ? "-" : "", number.digits,
             number.digit_count ? "" : "0", (long long)number.exponent);
    *value = strtod(canonical, NULL);
    return isfinite(*value);
}

const char *ca_noun(double count, const char *one, const char *many)
{
    return count > 0.99995 && count < 1.0005 ? one : many;
}

const char *ca_list_separator(size_t index, size_t count, const char *last)
{
    if (index == 0) return "";
    return index + 1 < count ? ", " : last;
}

bool ca_parse_double(const char *text, double *value) { return ca_parse_number(text, strlen(text), value); }

bool ca_parse_digits(const char *text, size_t length, uint64_t limit, uint64_t *value)
{
    uint64_t result = 0;
    for (size_t i = 0; i < length; i++) {
        if (!is_digit(text[i])) return false;
        const uint64_t digit = (uint64_t)(text[i] - '0');
        if (digit > limit || result > (limit - digit) / 10) return false;
        result = 10 * result + digit;
    }
    *value = result;
    return length > 0;
}

bool ca_parse_integer(const char *text, size_t length, int64_t *value)
{
    const bool negative = length > 0 && *text == '-', has_sign = negative || (length > 0 && *text == '+');
    const uint64_t limit = (uint64_t)INT64_MAX + negative; /* INT64_MIN is one further from 0 */
    uint64_t magnitude;
    if (!ca_parse_digits(text + has_sign, length - has_sign, limit, &magnitude)) return false;
    *value = negative ? -(int64_t)(magnitude / 2) - (int64_t)(magnitude - magnitude / 2) : (int64_t)magnitude;
    return true;
}

int ca_hex_digit(char digit)
{
    if (digit >= '0' && digit <= '9') return digit - '0';
    if (digit >= 'a' && digit <= 'f') return digit - 'a' + 10;
    return digit >= 'A' && digit <= 'F' ? digit - 'A' + 10 : -1;
}

size_t ca_byte_order_mark(const char *text, size_t size)
{
    static const char mark[] = {'\xef', '\xbb', '\xbf'};
    return size >= sizeof mark && memcmp(text, mark, sizeof mark) == 0 ? sizeof mark : 0;
}
