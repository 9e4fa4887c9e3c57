/*
 * Vectors of PD_LANES doubles, and one function in several versions.
 *
 * The vectors are the compiler's: they become one register with AVX-512, two with AVX2
 * and four on any x86-64. A kernel is written once as an always-inlined body; PD_VERSIONS
 * compiles it for each instruction set, and the running machine chooses.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_LANES_H
#define PD_SRC_LANES_H

#include <stdint.h>

#include "lattice.h"
#include "tensor.h"

/* Unaligned: neighbours of a chunk start anywhere. */
typedef double lanes
    __attribute__((vector_size(PD_LANES * sizeof(double)), aligned(8), may_alias));
typedef int64_t lane_bits
    __attribute__((vector_size(PD_LANES * sizeof(double)), aligned(8), may_alias));
typedef uint64_t lane_words
    __attribute__((vector_size(PD_LANES * sizeof(double)), aligned(8), may_alias));

#define PD_LOAD(address) (*(const lanes *)(address))
#define PD_STORE(address, value) (*(lanes *)(address) = (value))

/* 1/sqrt(*x) to an ulp or two for normal x > 0, a large finite number for 0: a linear
 * guess on the exponent, two steps of third order and one of second. No division, root or
 * trap. */
PD_INLINE void reciprocal_root(const lanes *x, lanes *result)
{
    const lane_words guess = UINT64_C(0x5fe6eb50c7b537a9) - ((lane_words)*x >> 1);
    lanes y = (lanes)guess;
    for (int step = 0; step < 2; step++) {
        const lanes h = 1 - *x * y * y;
        y += y * h * (0.5 + 0.375 * h);
    }
    const lanes h = 1 - *x * y * y;
    y += 0.5 * y * h;
    *result = y;
}

/* Is a bit of the first `count` lanes set? */
PD_INLINE bool any_lane(const lane_bits *bits, int count)
{
    int64_t any = 0;
    for (int q = 0; q < PD_LANES; q++)
        any |= q < count ? (*bits)[q] : 0;
    return any;
}

/* Put point p's d components, [n][d], into lanes of cell, [d][plane]. */
PD_INLINE void scatter(const int d, int count, const double *from, double *to,
                       int64_t plane)
{
    for (int c = 0; c < d; c++)
        for (int q = 0; q < count; q++)
            to[c * plane + q] = from[q * d + c];
}

/* Instruction sets, the least first. */
enum { PD_ANY_X86, PD_AVX2, PD_AVX512, PD_INSTRUCTION_SETS };

/* The best that this machine has, or less if a test asked for less. */
int pd_instruction_set(void);
void pd_instruction_set_limit(int most);

#if defined(__x86_64__) && defined(__GNUC__)
#define PD_TARGET_AVX2 __attribute__((target("avx2,fma")))
#define PD_TARGET_AVX512 __attribute__((target("avx512f,avx512dq,avx512vl,fma")))
#else
#define PD_TARGET_AVX2
#define PD_TARGET_AVX512
#endif

/* name(argument): body, an always-inlined function, in the best version. */
#define PD_VERSIONS(name, body, type)                                                    \
    static void name##_any(type argument)                                                \
    {                                                                                    \
        body(argument);                                                                  \
    }                                                                                    \
    PD_TARGET_AVX2 static void name##_avx2(type argument)                                \
    {                                                                                    \
        body(argument);                                                                  \
    }                                                                                    \
    PD_TARGET_AVX512 static void name##_avx512(type argument)                            \
    {                                                                                    \
        body(argument);                                                                  \
    }                                                                                    \
    static void name(type argument)                                                      \
    {                                                                                    \
        static void (*const versions[PD_INSTRUCTION_SETS])(type) = {                     \
            name##_any, name##_avx2, name##_avx512};                                     \
        versions[pd_instruction_set()](argument);                                        \
    }

#endif
