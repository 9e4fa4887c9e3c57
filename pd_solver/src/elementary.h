/*
 * Logarithm and exponential without a branch, call or table, so that loops over points
 * become vector instructions.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_ELEMENTARY_H
#define PD_SRC_ELEMENTARY_H

#include <stdint.h>

#include "tensor.h"

/* Compile a function once for each instruction set; the loader chooses. */
#if defined(__x86_64__) && defined(__gnu_linux__)
#define PD_FOR_EVERY_SET                                                                 \
    __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define PD_FOR_EVERY_SET
#endif

/* ln 2 in two parts, the first short enough that its multiples are exact. */
#define PD_LN2_HIGH 0x1.62e42p-1
#define PD_LN2_LOW 4.7493250390316726e-07

/* Before a loop whose iterations do not read what others write. */
#if defined(__clang__)
#define PD_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define PD_INDEPENDENT _Pragma("GCC ivdep")
#else
#define PD_INDEPENDENT
#endif

PD_INLINE uint64_t bits_of(double x)
{
    uint64_t bits;
    __builtin_memcpy(&bits, &x, sizeof bits);
    return bits;
}

PD_INLINE double of_bits(uint64_t bits)
{
    double x;
    __builtin_memcpy(&x, &bits, sizeof x);
    return x;
}

/* ln x of a normal x > 0, to two ulp. x = 2^e (1 + f), 1 + f in [sqrt(1/2), sqrt(2)), and
 * ln(1 + f) = 2 (s + s^3/3 + s^5/5 + ...) with s = f/(2 + f), 2 s = f - s f. */
PD_INLINE double plain_log(double x)
{
    const uint64_t above_root_half = bits_of(x) - UINT64_C(0x3fe6a09e667f3bcd);
    const uint64_t e_2_52 = above_root_half & UINT64_C(0xfff0000000000000);
    const double f = of_bits(bits_of(x) - e_2_52) - 1;
    /* 2^52 + 2048 + e, whose last bits are 2048 + e */
    const double e_moved =
        of_bits(((above_root_half ^ UINT64_C(1) << 63) >> 52) + bits_of(0x1p52));
    const double e = e_moved - (0x1p52 + 2048);
    const double s = f / (2 + f), z = s * s;
    double R = 2. / 21;
    for (int odd = 19; odd >= 3; odd -= 2)
        R = R * z + 2. / odd;
    return e * PD_LN2_HIGH + (e * PD_LN2_LOW + (f - s * (f - R * z)));
}

/* e^x of |x| < 700, to two ulp: x = k ln 2 + r, |r| <= ln(2)/2. */
PD_INLINE double plain_exp(double x)
{
    const double round = 0x1.8p52; /* a sum with it has no fraction, and k in its bits */
    const double moved = x * 1.4426950408889634 + round, k = moved - round;
    const double r = (x - k * PD_LN2_HIGH) - k * PD_LN2_LOW;
    const double by_factorial[] = {
        1,
        1,
        1. / 2,
        1. / 6,
        1. / 24,
        1. / 120,
        1. / 720,
        1. / 5040,
        1. / 40320,
        1. / 362880,
        1. / 3628800,
        1. / 39916800,
        1. / 479001600,
        1. / 6227020800,
    };
    double sum = by_factorial[13];
    for (int n = 12; n >= 0; n--)
        sum = sum * r + by_factorial[n];
    return of_bits(bits_of(sum) + (bits_of(moved) << 52));
}

#endif
