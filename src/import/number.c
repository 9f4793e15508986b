#include "import/number.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

bool ca_parse_integer(const char *text, size_t length, int64_t *value)
{
    const char *end = text + length;
    const bool negative = text < end && *text == '-';
    if (text < end && (*text == '-' || *text == '+')) text++;
    if (text == end) return false;
    int64_t result = 0;
    for (; text < end; text++) {
        if (!is_digit(*text)) return false;
        if (__builtin_mul_overflow(result, 10, &result)) return false;
        const int64_t digit = *text - '0';
        if (__builtin_add_overflow(result, negative ? -digit : digit, &result)) return false;
    }
    *value = result;
    return true;
}

size_t ca_next_token(const char **cursor, const char **token)
{
    static const char separators[] = " \t\r\n,";
    *token = *cursor + strspn(*cursor, separators);
    const size_t length = strcspn(*token, separators);
    *cursor = *token + length;
    return length;
}
