/* How fast something falls: the power law y = exp(offset) x^exponent by least squares of log y over log x. */
#ifndef CA_REPORT_POWER_FIT_H
#define CA_REPORT_POWER_FIT_H

#include <stddef.h>

typedef struct ca_power_fit {
    double exponent, offset; /* NAN: fewer than two different x */
    double error;            /* standard error of the exponent; NAN: fewer than three points */
    double
        half_width; /* of its 95 % interval, Student's with two degrees of freedom less than points; NAN likewise */
    size_t points;           /* that counted: those with x > 0 and y > 0, both finite */
} ca_power_fit;

/* The interval takes the points' errors in log y as independent, normal and of one variance about the law. */
ca_power_fit ca_power_fit_of(const double *x, const double *y, size_t count);

#endif
