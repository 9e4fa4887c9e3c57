/*
 * Logarithm and exponential of elementary.h against the C library's.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "elementary.h"

#include "lattice.h"

/* What elementary.h promises, for results of that size: the library's own error, below
 * one, is on top. */
#define THREE_ULP (3 * 0x1p-52)

static double logarithm(double x)
{
    return plain_log(x);
}

static double exponential(double x)
{
    return plain_exp(x);
}

static void near_one(double value, double expected)
{
    assert_near(value, expected, THREE_ULP * fabs(expected));
}

static void logarithms_are_those_of_the_library(void **state)
{
    for (int k = -1000; k <= 1000; k++)
        for (int m = 0; m < 64; m++) {
            const double x = ldexp(1 + m / 64., k);
            near_one(logarithm(x), log(x));
        }
}

/* Where ln x is small its relative error must be, too: J is close to 1 in most solids. */
static void logarithms_beside_one_keep_their_digits(void **state)
{
    for (int k = 1; k <= 52; k++) {
        near_one(logarithm(1 + ldexp(1, -k)), log1p(ldexp(1, -k)));
        near_one(logarithm(1 - ldexp(1, -k)), log1p(-ldexp(1, -k)));
    }
    assert_near(logarithm(1), 0, 0);
}

static void exponentials_are_those_of_the_library(void **state)
{
    for (int k = -69999; k <= 69999; k++)
        near_one(exponential(k / 100.), exp(k / 100.));
    assert_near(exponential(0), 1, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(logarithms_are_those_of_the_library),
        cmocka_unit_test(logarithms_beside_one_keep_their_digits),
        cmocka_unit_test(exponentials_are_those_of_the_library),
    };
    return cmocka_run_group_tests_name("elementary", tests, NULL, NULL);
}
