/*
 * Vectors of doubles for the kernels of lattices, which are compiled once for each
 * instruction set; the running machine chooses (lanes.c).
 *
 * A chunk's PD_LANES points are taken PD_WIDTH at a time, one register of the compiler's
 * vectors: 8 with AVX-512, 4 with AVX2, else 2.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_LANES_H
#define PD_SRC_LANES_H

#include <float.h>
#include <stdint.h>
#if defined(__AVX512F__)
#include <immintrin.h>
#endif

#include "lattice.h"
#include "tensor.h"

#if defined(__AVX512F__)
#define PD_WIDTH 8
#define PD_FOR_THIS_SET(name) name##_avx512
#elif defined(__AVX2__)
#define PD_WIDTH 4
#define PD_FOR_THIS_SET(name) name##_avx2
#else
#define PD_WIDTH 2
#define PD_FOR_THIS_SET(name) name##_any
#endif

/* For each register of a chunk of that many points; only one with AVX-512, which the
 * compiler cannot know from the count. */
#define PD_FOR_PARTS(part, points)                                                       \
    for (int part = 0; part < PD_LANES && part < (points); part += PD_WIDTH)

/* Unaligned: neighbours of a chunk start anywhere. */
#define PD_VECTOR vector_size(PD_WIDTH * sizeof(double)), aligned(8), may_alias
typedef double lanes __attribute__((PD_VECTOR));
typedef int64_t lane_bits __attribute__((PD_VECTOR));
typedef uint64_t lane_words __attribute__((PD_VECTOR));

#define PD_LOAD(address) (*(const lanes *)(address))
#define PD_STORE(address, value) (*(lanes *)(address) = (value))

/* A choice of lanes: with AVX-512 a bit each, else all bits of the lane. */
#if defined(__AVX512F__)
typedef unsigned lane_mask;
#else
typedef lane_bits lane_mask;
#endif

/* The lanes from `part` on whose bit is set. */
PD_INLINE lane_mask lanes_of(unsigned char bits, int part)
{
#if defined(__AVX512F__)
    return (unsigned)bits >> part;
#else
    lane_bits selected;
    for (int q = 0; q < PD_WIDTH; q++)
        selected[q] = INT64_C(1) << q;
    return (selected & (bits >> part)) != 0;
#endif
}

PD_INLINE lane_mask lanes_above(lanes x, lanes limit)
{
#if defined(__AVX512F__)
    return _mm512_cmp_pd_mask((__m512d)x, (__m512d)limit, _CMP_GT_OS);
#else
    return x > limit;
#endif
}

/* x, or 0 in lanes that are not selected. */
PD_INLINE lanes select_lanes(lane_mask selected, lanes x)
{
#if defined(__AVX512F__)
    return (lanes)_mm512_maskz_mov_pd((__mmask8)selected, (__m512d)x);
#else
    return (lanes)((lane_bits)x & selected);
#endif
}

/* Is one of the first `count` lanes selected? */
PD_INLINE bool any_lane(lane_mask mask, int count)
{
#if defined(__AVX512F__)
    return mask & ((1u << (count < PD_WIDTH ? count : PD_WIDTH)) - 1);
#else
    int64_t any = 0;
    for (int q = 0; q < PD_WIDTH; q++)
        any |= q < count ? mask[q] : 0;
    return any;
#endif
}

/* 1/sqrt(x) to an ulp or two for normal x > 0, a large finite number for 0. No division,
 * root or trap: a guess y, and y (1 + h/2 + 3/8 h^2 + 5/16 h^3) with h = 1 - x y^2. One
 * such step does for AVX-512, whose guess has 14 bits; the guess on the exponent, of 4.3,
 * takes two. */
PD_INLINE lanes reciprocal_root(lanes x)
{
#if defined(__AVX512F__)
    const __m512d least = _mm512_set1_pd(DBL_MIN);
    lanes y = (lanes)_mm512_rsqrt14_pd(_mm512_max_pd((__m512d)x, least));
    enum { STEPS = 1 };
#else
    const lane_words guess = UINT64_C(0x5fe6eb50c7b537a9) - ((lane_words)x >> 1);
    lanes y = (lanes)guess;
    enum { STEPS = 2 };
#endif
    for (int step = 0; step < STEPS; step++) {
        const lanes h = 1 - x * y * y;
        y += y * h * (0.5 + h * (0.375 + 0.3125 * h));
    }
    return y;
}

/* What a chunk's bonds weigh, pd_chunk. */
enum { PD_WHOLE, PD_GAPPED, PD_OWN };

/* Instruction sets, the least first. */
enum { PD_ANY, PD_AVX2, PD_AVX512, PD_INSTRUCTION_SETS };

/* The best that this machine has, or less if a test asked for less. */
int pd_instruction_set(void);
void pd_instruction_set_limit(int most);

/* Declare the versions of void name(pd_body *), and name itself, which calls the best. */
#if defined(__x86_64__)
#define PD_VERSIONS(name)                                                                \
    void name##_any(pd_body *b);                                                         \
    void name##_avx2(pd_body *b);                                                        \
    void name##_avx512(pd_body *b);                                                      \
    static void name(pd_body *b)                                                         \
    {                                                                                    \
        void (*const versions[])(pd_body *) = {name##_any, name##_avx2, name##_avx512};  \
        versions[pd_instruction_set()](b);                                               \
    }
#else
#define PD_VERSIONS(name)                                                                \
    void name##_any(pd_body *b);                                                         \
    static void name(pd_body *b)                                                         \
    {                                                                                    \
        name##_any(b);                                                                   \
    }
#endif

#endif
