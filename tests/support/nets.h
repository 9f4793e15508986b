/* Nets in base 2, judged by counting points in boxes. */
#ifndef CA_TEST_NETS_H
#define CA_TEST_NETS_H

#include <stdint.h>

enum { CA_NET_MOST_BITS = 16 };

/* The smallest t for which the 2^m points (x[i], y[i]) of the unit square have 2^t in each box of 2^-k by 2^(t-m+k),
 * for all k: 0 is a perfect net, m none at all. m is at most CA_NET_MOST_BITS. One thread at a time. */
uint32_t ca_net_quality(const float *x, const float *y, uint32_t m);

#endif
