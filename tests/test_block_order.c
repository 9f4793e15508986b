/* The order of blocks: every pair once, squares first, one side kept from step to step, direct access; with and
 * without limits. */
#include "integrator/block_order.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 40 };

static const ca_block_order endless = {.camera_limit = UINT64_MAX, .light_limit = UINT64_MAX};

/* Numbers 0 to count - 1 give each pair of `order` below SIDE x SIDE at most once; how many. */
static uint32_t distinct_pairs(const ca_block_order *order, uint64_t count)
{
    static bool seen[SIDE * SIDE];
    uint32_t distinct = 0;
    memset(seen, 0, sizeof seen);
    for (uint64_t n = 0; n < count; n++) {
        const ca_block_pair pair = ca_block_pair_at(order, n);
        assert_true(pair.camera < SIDE && pair.light < SIDE);
        assert_true(pair.camera < order->camera_limit && pair.light < order->light_limit);
        bool *slot = &seen[pair.camera * SIDE + pair.light];
        assert_false(*slot);
        *slot = true;
        distinct++;
    }
    return distinct;
}

static void squares_grow_and_one_side_is_kept(void **state)
{
    (void)state;
    assert_int_equal(distinct_pairs(&endless, SIDE * SIDE), SIDE * SIDE);
    ca_block_pair before = ca_block_pair_at(&endless, 0);
    assert_int_equal(before.camera, 0);
    assert_int_equal(before.light, 0);
    for (uint64_t n = 1; n < SIDE * SIDE; n++) {
        const ca_block_pair pair = ca_block_pair_at(&endless, n);
        const uint64_t shell = pair.camera > pair.light ? pair.camera : pair.light;
        assert_true(shell * shell <= n &&
                    n < (shell + 1) * (shell + 1)); /* direct access: the number says the shell */
        const bool camera_kept = pair.camera == before.camera, light_kept = pair.light == before.light;
        assert_true(camera_kept != light_kept);
        const uint64_t step = camera_kept ? pair.light - before.light : pair.camera - before.camera;
        assert_true(step == 1 || step == UINT64_MAX);
        before = pair;
    }
}

/* The four corners of a shell far out, where rounding a square root would show. */
static void far_blocks_are_found(void **state)
{
    (void)state;
    const uint64_t k = UINT64_C(3037000499); /* k^2 is just below 2^63 */
    const ca_block_pair first = ca_block_pair_at(&endless, k * k), last = ca_block_pair_at(&endless, k * k + 2 * k);
    const ca_block_pair corner = ca_block_pair_at(&endless, k * k + k),
                        before = ca_block_pair_at(&endless, k * k - 1);
    assert_true(first.camera == k && first.light == 0); /* an odd shell */
    assert_true(corner.camera == k && corner.light == k);
    assert_true(last.camera == 0 && last.light == k);
    assert_true(before.camera == k - 1 && before.light == 0);
}

static void limits_leave_lines(void **state)
{
    (void)state;
    static const struct {
        uint64_t camera, light;
    } limits[] = {{1, 30}, {30, 1}, {2, 17}, {3, 17}, {17, 3}, {17, 4}, {16, 16}, {1, 1}};
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++)
        for (int diagonal = 0; diagonal < 2; diagonal++) {
            const ca_block_order order = {
                .diagonal = diagonal, .camera_limit = limits[i].camera, .light_limit = limits[i].light};
            const uint64_t count = limits[i].camera * limits[i].light;
            assert_int_equal(ca_block_count(&order), count);
            assert_int_equal(distinct_pairs(&order, count), count);
            for (uint64_t n = 1; n < count && !diagonal; n++) {
                const ca_block_pair a = ca_block_pair_at(&order, n - 1), b = ca_block_pair_at(&order, n);
                assert_true((a.camera == b.camera) != (a.light == b.light));
            }
        }
}

static void diagonals_are_cantors(void **state)
{
    (void)state;
    const ca_block_order order = {.diagonal = true, .camera_limit = UINT64_MAX, .light_limit = UINT64_MAX};
    for (uint64_t n = 0, d = 0; d < 20; d++)
        for (uint64_t i = 0; i <= d; i++, n++) {
            const ca_block_pair pair = ca_block_pair_at(&order, n);
            assert_true(pair.camera == i && pair.light == d - i);
        }
}

static void counts_do_not_overflow(void **state)
{
    (void)state;
    assert_true(ca_block_count(&endless) == UINT64_MAX);
    const ca_block_order fixed_rows = {.camera_limit = 3, .light_limit = UINT64_MAX};
    assert_true(ca_block_count(&fixed_rows) == UINT64_MAX);
    assert_int_equal(ca_block_square(&fixed_rows, 10), 30);
    assert_int_equal(ca_block_square(&endless, 10), 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(squares_grow_and_one_side_is_kept), cmocka_unit_test(far_blocks_are_found),
        cmocka_unit_test(limits_leave_lines),                cmocka_unit_test(diagonals_are_cantors),
        cmocka_unit_test(counts_do_not_overflow),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
