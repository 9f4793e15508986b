#include "sampling/sobol_table.h"

/* The compiler expands the published rows: each number of the table is an enumerator V<d>_<column>. In the fractions
 * v_j = m_j / 2^j, of which 31 bits are kept (an int), the sequence's recurrence is
 *
 *     v_j = a_1 v_(j-1) ^ ... ^ a_(s-1) v_(j-s+1) ^ v_(j-s) ^ (v_(j-s) >> s).
 *
 * Columns 0 to 10 end with the row's own numbers, after zeros, so that each recurrence can look back by 11, the
 * largest degree. Bits only move downwards, so the 31 are exact. */
#define FRACTION(m, j) ((m) << (31 - (j)))

#define DEGREE_1(d, a, m1) ROW(d, 1, a, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, FRACTION(m1, 1))
#define DEGREE_2(d, a, m1, m2) \
    ROW(d, 2, a, 0, 0, 0, 0, 0, 0, 0, 0, 0, FRACTION(m1, 1), FRACTION(m2, 2))
#define DEGREE_3(d, a, m1, m2, m3) \
    ROW(d, 3, a, 0, 0, 0, 0, 0, 0, 0, 0, FRACTION(m1, 1), FRACTION(m2, 2), FRACTION(m3, 3))
#define DEGREE_4(d, a, m1, m2, m3, m4) \
    ROW(d, 4, a, 0, 0, 0, 0, 0, 0, 0, FRACTION(m1, 1), FRACTION(m2, 2), FRACTION(m3, 3), FRACTION(m4, 4))
#define DEGREE_5(d, a, m1, m2, m3, m4, m5) \
    ROW(d, 5, a, 0, 0, 0, 0, 0, 0, FRACTION(m1, 1), FRACTION(m2, 2), FRACTION(m3, 3), FRACTION(m4, 4), \
        FRACTION(m5, 5))
#define DEGREE_6(d, a, m1, m2, m3, m4, m5, m6) \
    ROW(d, 6, a, 0, 0, 0, 0, 0, FRACTION(m1, 1), FRACTION(m2, 2), FRACTION(m3, 3), FRACTION(m4, 4), FRACTION(m5, \
        5), FRACTION(m6, 6))
#define DEGREE_7(d, a, m1, m2, m3, m4, m5, m6, m7) \
    ROW(d, 7, a, 0, 0, 0, 0, FRACTION(m1, 1), FRACTION(m2, 2), FRACTION(m3, 3), FRACTION(m4, 4), FRACTION(m5, \
        5), FRACTION(m6, 6), FRACTION(m7, 7))
#define DEGREE_8(d, a, m1, m2, m3, m4, m5, m6, m7, m8) \
    ROW(d, 8, a, 0, 0, 0, FRACTION(m1, 1), FRACTION(m2, 2), FRACTION(m3, 3), FRACTION(m4, 4), FRACTION(m5, 5), \
        FRACTION(m6, 6), FRACTION(m7, 7), FRACTION(m8, 8))
#define DEGREE_9(d, a, m1, m2, m3, m4, m5, m6, m7, m8, m9) \
    ROW(d, 9, a, 0, 0, FRACTION(m1, 1), FRACTION(m2, 2), FRACTION(m3, 3), FRACTION(m4, 4), FRACTION(m5, 5), \
        FRACTION(m6, 6), FRACTION(m7, 7), FRACTION(m8, 8), FRACTION(m9, 9))
#define DEGREE_10(d, a, m1, m2, m3, m4, m5, m6, m7, m8, m9, m10) \
    ROW(d, 10, a, 0, FRACTION(m1, 1), FRACTION(m2, 2), FRACTION(m3, 3), FRACTION(m4, 4), FRACTION(m5, 5), \
        FRACTION(m6, 6), FRACTION(m7, 7), FRACTION(m8, 8), FRACTION(m9, 9), FRACTION(m10, 10))
#define DEGREE_11(d, a, m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11) \
    ROW(d, 11, a, FRACTION(m1, 1), FRACTION(m2, 2), FRACTION(m3, 3), FRACTION(m4, 4), FRACTION(m5, 5), \
        FRACTION(m6, 6), FRACTION(m7, 7), FRACTION(m8, 8), FRACTION(m9, 9), FRACTION(m10, 10), FRACTION(m11, \
        11))

/* What v_(j-k) adds to v_j. With a's own 1 at its end, a_k is bit 11 - k of `coefficients`. */
#define COEFFICIENTS(s, a) (((a) << 1 | 1) << (11 - (s)))
#define TERM(s, a, k, v) (((COEFFICIENTS(s, a) >> (11 - (k)) & 1) ? (v) : 0) ^ ((k) == (s) ? (v) >> (s) : 0))

#define COLUMN(d, s, a, j, j1, j2, j3, j4, j5, j6, j7, j8, j9, j10, j11) \
    V##d##_##j = (TERM(s, a, 1, V##d##_##j1) ^ TERM(s, a, 2, V##d##_##j2) ^ TERM(s, a, 3, V##d##_##j3) ^ \
                  TERM(s, a, 4, V##d##_##j4) ^ TERM(s, a, 5, V##d##_##j5) ^ TERM(s, a, 6, V##d##_##j6) ^ \
                  TERM(s, a, 7, V##d##_##j7) ^ TERM(s, a, 8, V##d##_##j8) ^ TERM(s, a, 9, V##d##_##j9) ^ \
                  TERM(s, a, 10, V##d##_##j10) ^ TERM(s, a, 11, V##d##_##j11))

#define ROW(d, s, a, v0, v1, v2, v3, v4, v5, v6, v7, v8, v9, v10) \
    enum { \
        V##d##_0 = (v0), V##d##_1 = (v1), V##d##_2 = (v2), V##d##_3 = (v3), V##d##_4 = (v4), V##d##_5 = (v5), \
        V##d##_6 = (v6), V##d##_7 = (v7), V##d##_8 = (v8), V##d##_9 = (v9), V##d##_10 = (v10), \
        COLUMN(d, s, a, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0), \
        COLUMN(d, s, a, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1), \
        COLUMN(d, s, a, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2), \
        COLUMN(d, s, a, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3), \
        COLUMN(d, s, a, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4), \
        COLUMN(d, s, a, 16, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5), \
        COLUMN(d, s, a, 17, 16, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6), \
        COLUMN(d, s, a, 18, 17, 16, 15, 14, 13, 12, 11, 10, 9, 8, 7), \
        COLUMN(d, s, a, 19, 18, 17, 16, 15, 14, 13, 12, 11, 10, 9, 8), \
        COLUMN(d, s, a, 20, 19, 18, 17, 16, 15, 14, 13, 12, 11, 10, 9), \
        COLUMN(d, s, a, 21, 20, 19, 18, 17, 16, 15, 14, 13, 12, 11, 10), \
        COLUMN(d, s, a, 22, 21, 20, 19, 18, 17, 16, 15, 14, 13, 12, 11), \
        COLUMN(d, s, a, 23, 22, 21, 20, 19, 18, 17, 16, 15, 14, 13, 12), \
        COLUMN(d, s, a, 24, 23, 22, 21, 20, 19, 18, 17, 16, 15, 14, 13), \
        COLUMN(d, s, a, 25, 24, 23, 22, 21, 20, 19, 18, 17, 16, 15, 14), \
        COLUMN(d, s, a, 26, 25, 24, 23, 22, 21, 20, 19, 18, 17, 16, 15), \
        COLUMN(d, s, a, 27, 26, 25, 24, 23, 22, 21, 20, 19, 18, 17, 16), \
        COLUMN(d, s, a, 28, 27, 26, 25, 24, 23, 22, 21, 20, 19, 18, 17), \
        COLUMN(d, s, a, 29, 28, 27, 26, 25, 24, 23, 22, 21, 20, 19, 18), \
        COLUMN(d, s, a, 30, 29, 28, 27, 26, 25, 24, 23, 22, 21, 20, 19), \
        COLUMN(d, s, a, 31, 30, 29, 28, 27, 26, 25, 24, 23, 22, 21, 20), \
        COLUMN(d, s, a, 32, 31, 30, 29, 28, 27, 26, 25, 24, 23, 22, 21), \
        COLUMN(d, s, a, 33, 32, 31, 30, 29, 28, 27, 26, 25, 24, 23, 22), \
        COLUMN(d, s, a, 34, 33, 32, 31, 30, 29, 28, 27, 26, 25, 24, 23), \
        COLUMN(d, s, a, 35, 34, 33, 32, 31, 30, 29, 28, 27, 26, 25, 24), \
        COLUMN(d, s, a, 36, 35, 34, 33, 32, 31, 30, 29, 28, 27, 26, 25), \
        COLUMN(d, s, a, 37, 36, 35, 34, 33, 32, 31, 30, 29, 28, 27, 26), \
        COLUMN(d, s, a, 38, 37, 36, 35, 34, 33, 32, 31, 30, 29, 28, 27), \
        COLUMN(d, s, a, 39, 38, 37, 36, 35, 34, 33, 32, 31, 30, 29, 28), \
        COLUMN(d, s, a, 40, 39, 38, 37, 36, 35, 34, 33, 32, 31, 30, 29), \
        COLUMN(d, s, a, 41, 40, 39, 38, 37, 36, 35, 34, 33, 32, 31, 30), \
        COLUMN(d, s, a, 42, 41, 40, 39, 38, 37, 36, 35, 34, 33, 32, 31), \
        COLUMN(d, s, a, 43, 42, 41, 40, 39, 38, 37, 36, 35, 34, 33, 32), \
        COLUMN(d, s, a, 44, 43, 42, 41, 40, 39, 38, 37, 36, 35, 34, 33), \
        COLUMN(d, s, a, 45, 44, 43, 42, 41, 40, 39, 38, 37, 36, 35, 34), \
        COLUMN(d, s, a, 46, 45, 44, 43, 42, 41, 40, 39, 38, 37, 36, 35), \
        COLUMN(d, s, a, 47, 46, 45, 44, 43, 42, 41, 40, 39, 38, 37, 36), \
        COLUMN(d, s, a, 48, 47, 46, 45, 44, 43, 42, 41, 40, 39, 38, 37), \
        COLUMN(d, s, a, 49, 48, 47, 46, 45, 44, 43, 42, 41, 40, 39, 38), \
        COLUMN(d, s, a, 50, 49, 48, 47, 46, 45, 44, 43, 42, 41, 40, 39), \
        COLUMN(d, s, a, 51, 50, 49, 48, 47, 46, 45, 44, 43, 42, 41, 40), \
        COLUMN(d, s, a, 52, 51, 50, 49, 48, 47, 46, 45, 44, 43, 42, 41), \
        COLUMN(d, s, a, 53, 52, 51, 50, 49, 48, 47, 46, 45, 44, 43, 42), \
        COLUMN(d, s, a, 54, 53, 52, 51, 50, 49, 48, 47, 46, 45, 44, 43), \
        COLUMN(d, s, a, 55, 54, 53, 52, 51, 50, 49, 48, 47, 46, 45, 44), \
        COLUMN(d, s, a, 56, 55, 54, 53, 52, 51, 50, 49, 48, 47, 46, 45), \
        COLUMN(d, s, a, 57, 56, 55, 54, 53, 52, 51, 50, 49, 48, 47, 46), \
        COLUMN(d, s, a, 58, 57, 56, 55, 54, 53, 52, 51, 50, 49, 48, 47), \
        COLUMN(d, s, a, 59, 58, 57, 56, 55, 54, 53, 52, 51, 50, 49, 48), \
        COLUMN(d, s, a, 60, 59, 58, 57, 56, 55, 54, 53, 52, 51, 50, 49), \
        COLUMN(d, s, a, 61, 60, 59, 58, 57, 56, 55, 54, 53, 52, 51, 50), \
        COLUMN(d, s, a, 62, 61, 60, 59, 58, 57, 56, 55, 54, 53, 52, 51), \
        COLUMN(d, s, a, 63, 62, 61, 60, 59, 58, 57, 56, 55, 54, 53, 52), \
    };
#include "sampling/sobol_rows.h"
#undef ROW

#define EIGHT(d, i, j, k, l, m, n, o, p) \
    V##d##_##i, V##d##_##j, V##d##_##k, V##d##_##l, V##d##_##m, V##d##_##n, V##d##_##o, V##d##_##p

#define ROW(d, s, a, ...) \
    [(d) - 1] = {.zeros = 11 - (s), \
                 .columns = { \
                     EIGHT(d, 0, 1, 2, 3, 4, 5, 6, 7), \
                     EIGHT(d, 8, 9, 10, 11, 12, 13, 14, 15), \
                     EIGHT(d, 16, 17, 18, 19, 20, 21, 22, 23), \
                     EIGHT(d, 24, 25, 26, 27, 28, 29, 30, 31), \
                     EIGHT(d, 32, 33, 34, 35, 36, 37, 38, 39), \
                     EIGHT(d, 40, 41, 42, 43, 44, 45, 46, 47), \
                     EIGHT(d, 48, 49, 50, 51, 52, 53, 54, 55), \
                     EIGHT(d, 56, 57, 58, 59, 60, 61, 62, 63)}},
const ca_sobol_row ca_sobol_rows[CA_SOBOL_DIMENSION_COUNT] = {
#include "sampling/sobol_rows.h"
};
