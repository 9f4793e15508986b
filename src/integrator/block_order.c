#include "integrator/block_order.h"

#include <math.h>

static uint64_t min_u64(uint64_t a, uint64_t b) { return a < b ? a : b; }

/* The largest k with k * k <= n. */
static uint64_t integer_root(uint64_t n)
{
    uint64_t k = (uint64_t)sqrt((double)n); /* off by one at most, near large squares */
    while (k > UINT32_MAX || k * k > n) k--;
    while (k < UINT32_MAX && (k + 1) * (k + 1) <= n) k++;
    return k;
}

/* Shell k of the squares: odd ones go up along j and then back along i, even ones the other way round, so that each
 * begins beside the end of the one before. */
static ca_block_pair pair_on_shell(uint64_t k, uint64_t step)
{
    const uint64_t rising = min_u64(step, k), falling = step < k ? k : 2 * k - step;
    return k % 2 ? (ca_block_pair){.camera = falling, .light = rising}
                 : (ca_block_pair){.camera = rising, .light = falling};
}

/* Line k >= side behind a square of that side: `step` along it, back and forth, beginning beside the end of the line
 * before. The last shell, side - 1, ends at the short side's 0 or side - 1, as `square_ends_low` says. */
static uint64_t step_on_line(uint64_t k, uint64_t side, uint64_t step, bool square_ends_low)
{
    const bool forth = ((k - side) % 2 == 0) == square_ends_low;
    return forth ? step : side - 1 - step;
}

static ca_block_pair rectangular_pair(const ca_block_order *order, uint64_t number)
{
    const uint64_t side = min_u64(order->camera_limit, order->light_limit);
    const uint64_t k = integer_root(number);
    if (k < side) return pair_on_shell(k, number - k * k);
    const uint64_t line = side + (number - side * side) / side, step = (number - side * side) % side;
    const bool ends_at_camera_0 =
        side % 2 == 0; /* shell side - 1 is odd: it ends at (0, side - 1), else at (side - 1, 0) */
    if (order->camera_limit == side)
        return (ca_block_pair){.camera = step_on_line(line, side, step, ends_at_camera_0), .light = line};
    return (ca_block_pair){.camera = line, .light = step_on_line(line, side, step, !ends_at_camera_0)};
}

static ca_block_pair diagonal_pair(const ca_block_order *order, uint64_t number)
{
    for (uint64_t d = 0;; d++) {
        const uint64_t first = d < order->light_limit ? 0 : d - order->light_limit + 1; /* i from here ... */
        const uint64_t last = min_u64(d, order->camera_limit - 1);                      /* ... to here */
        const uint64_t length = last - first + 1;
        if (number < length) return (ca_block_pair){.camera = first + number, .light = d - first - number};
        number -= length;
    }
}

ca_block_pair ca_block_pair_at(const ca_block_order *order, uint64_t number)
{
    return order->diagonal ? diagonal_pair(order, number) : rectangular_pair(order, number);
}

/* On a shell: along its first leg the blocks of one row or column follow each other, along its second those of the
 * other; both have met, on the squares before, all of the other side. */
static ca_block_pair visits_on_shell(uint64_t k, uint64_t step)
{
    const bool second = step > k;
    const uint64_t along = second ? step - k : step, across = step == k ? 0 : k;
    const bool along_camera = (k % 2 == 1) != second; /* odd shells begin with row k */
    return along_camera ? (ca_block_pair){.camera = along, .light = across}
                        : (ca_block_pair){.camera = across, .light = along};
}

static ca_block_pair rectangular_visits(const ca_block_order *order, uint64_t number)
{
    const uint64_t side = min_u64(order->camera_limit, order->light_limit);
    const uint64_t k = integer_root(number);
    if (k < side) return visits_on_shell(k, number - k * k);
    const uint64_t line = side + (number - side * side) / side, step = (number - side * side) % side;
    return order->camera_limit == side ? (ca_block_pair){.camera = line, .light = step}
                                       : (ca_block_pair){.camera = step, .light = line};
}

ca_block_pair ca_block_visits(const ca_block_order *order, uint64_t number)
{
    if (!order->diagonal) return rectangular_visits(order, number);
    const ca_block_pair pair = diagonal_pair(order, number);
    return (ca_block_pair){.camera = pair.light, .light = pair.camera};
}

static uint64_t product(uint64_t a, uint64_t b) { return b != 0 && a > UINT64_MAX / b ? UINT64_MAX : a * b; }

uint64_t ca_block_count(const ca_block_order *order) { return product(order->camera_limit, order->light_limit); }

uint64_t ca_block_square(const ca_block_order *order, uint64_t k)
{
    return product(min_u64(k, order->camera_limit), min_u64(k, order->light_limit));
}
