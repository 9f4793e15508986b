/* Growing arrays: they keep their elements, at least double, and stay as they were when memory ends. */
#include "base/memory.h"

#include "scene/description.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

static void test_array_keeps_its_elements(void **state)
{
    (void)state;
    uint32_t *array = NULL;
    size_t capacity = 0, moves = 0;
    for (uint32_t i = 0; i < 1000; i++) {
        const size_t before = capacity;
        uint32_t *grown = ca_array_grow(array, &capacity, i + 1, sizeof *grown);
        assert_non_null(grown);
        array = grown;
        array[i] = i * i;
        assert_true(capacity > i && (capacity == before || capacity >= 2 * before));
        moves += capacity != before;
    }
    for (uint32_t i = 0; i < 1000; i++) assert_int_equal(array[i], i * i);
    assert_true(moves <= 8);
    ca_free(array);
}

static void test_room_for_nothing(void **state)
{
    (void)state;
    size_t capacity = 0;
    char *array = ca_array_grow(NULL, &capacity, 0, sizeof *array);
    assert_non_null(array);
    ca_free(array);
}

static void test_array_without_memory(void **state)
{
    (void)state;
    size_t capacity = 0;
    double *array = ca_array_grow(NULL, &capacity, 8, sizeof *array);
    assert_non_null(array);
    array[7] = 7.5;
    const size_t before = capacity;
    ca_memory_fail_after(0);
    assert_null(ca_array_grow(array, &capacity, before + 1, sizeof *array));
    assert_null(ca_array_grow(array, &capacity, SIZE_MAX / 4, sizeof *array)); /* overflows */
    ca_memory_fail_after(-1);
    assert_int_equal(capacity, before);
    assert_true(array[7] == 7.5);
    ca_free(array);
}

static void test_table_without_memory(void **state)
{
    (void)state;
    CA_TABLE(uint64_t) table = {0};
    while (table.count == 0 || table.count < table.capacity) {
        assert_true(CA_TABLE_ADD(&table));
        assert_true(table.items[table.count - 1] == 0);
        table.items[table.count - 1] = table.count;
    }
    const size_t full = table.count;
    ca_memory_fail_after(0);
    assert_false(CA_TABLE_ADD(&table));
    ca_memory_fail_after(-1);
    assert_int_equal(table.count, full);
    assert_true(CA_TABLE_ADD(&table));
    assert_true(table.items[full - 1] == full && table.items[full] == 0);
    ca_free(table.items);
}

/* Of all sizes: below a huge page, with a rest, and more than there is. */
static void test_large_zeros(void **state)
{
    (void)state;
    static const size_t counts[] = {1, 1000, (2 << 20) - 1, (4 << 20) + 12345};
    for (int i = 0; i < 4; i++) {
        unsigned char *bytes = ca_alloc_large_zeroed(counts[i], 1);
        assert_non_null(bytes);
        for (size_t k = 0; k < counts[i]; k++)
            if (bytes[k] != 0) fail_msg("byte %zu of %zu is %d", k, counts[i], bytes[k]);
        memset(bytes, 255, counts[i]);
        ca_free(bytes);
    }
    assert_null(ca_alloc_large_zeroed(SIZE_MAX / 2, 8));
    ca_memory_fail_after(0);
    assert_null(ca_alloc_large_zeroed(8, 8));
    ca_memory_fail_after(-1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_array_keeps_its_elements),
        cmocka_unit_test(test_room_for_nothing),
        cmocka_unit_test(test_array_without_memory),
        cmocka_unit_test(test_table_without_memory),
        cmocka_unit_test(test_large_zeros),
    };
    return cmocka_run_group_tests_name("memory", tests, NULL, NULL);
}
