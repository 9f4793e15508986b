/* Equal but for a relative error; else the test fails. */
#ifndef CA_TEST_EXPECT_NEAR_H
#define CA_TEST_EXPECT_NEAR_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static inline void expect_near(double got, double expected, double relative)
{
    if (!(fabs(got - expected) <= relative * fabs(expected))) fail_msg("%.12g is not %.12g", got, expected);
}

#endif
