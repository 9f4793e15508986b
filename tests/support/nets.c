#include "support/nets.h"

#include <stdbool.h>
#include <string.h>

enum { MOST = 1 << CA_NET_MOST_BITS };

/* Whether 2^m points have 2^t in each elementary interval of the unit square with area 2^(t-m). */
static bool is_net(const float *x, const float *y, uint32_t m, uint32_t t)
{
    static uint32_t count[MOST];
    for (uint32_t k = 0; k <= m - t; k++) {
        memset(count, 0, sizeof count[0] << (m - t));
        for (uint32_t i = 0; i < 1u << m; i++) {
            const uint32_t column = (uint32_t)(x[i] * (float)(1u << k));
            const uint32_t row = (uint32_t)(y[i] * (float)(1u << (m - t - k)));
            count[(column << (m - t - k)) + row]++;
        }
        for (uint32_t box = 0; box < 1u << (m - t); box++)
            if (count[box] != 1u << t) return false;
    }
    return true;
}

uint32_t ca_net_quality(const float *x, const float *y, uint32_t m)
{
    for (uint32_t t = 0; t < m; t++)
        if (is_net(x, y, m, t)) return t;
    return m;
}
