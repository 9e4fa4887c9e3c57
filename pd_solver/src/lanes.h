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

#include <stdint.h>

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

/* Unaligned: neighbours of a chunk start anywhere. */
#define PD_VECTOR vector_size(PD_WIDTH * sizeof(double)), aligned(8), may_alias
typedef double lanes __attribute__((PD_VECTOR));
typedef int64_t lane_bits __attribute__((PD_VECTOR));
typedef uint64_t lane_words __attribute__((PD_VECTOR));

#define PD_LOAD(address) (*(const lanes *)(address))
#define PD_STORE(address, value) (*(lanes *)(address) = (value))

/* 1/sqrt(x) to an ulp or two for normal x > 0, a large finite number for 0: a linear
 * guess on the exponent, two steps of third order and one of second. No division, root or
 * trap.
 */
PD_INLINE lanes reciprocal_root(lanes x)
{
    const lane_words guess = UINT64_C(0x5fe6eb50c7b537a9) - ((lane_words)x >> 1);
    lanes y = (lanes)guess;
    for (int step = 0; step < 2; step++) {
        const lanes h = 1 - x * y * y;
        y += y * h * (0.5 + 0.375 * h);
    }
    return y + 0.5 * y * (1 - x * y * y);
}

/* What a chunk's bonds weigh, pd_chunk. */
enum { PD_WHOLE, PD_GAPPED, PD_OWN };

/* All bits of the lanes from `part` on whose bit is set. */
PD_INLINE lane_bits lanes_of(unsigned char bits, int part)
{
    lane_bits selected;
    for (int q = 0; q < PD_WIDTH; q++)
        selected[q] = INT64_C(1) << q;
    return (selected & (bits >> part)) != 0;
}

/* x, or 0 in lanes that are not selected. */
PD_INLINE lanes select_lanes(lane_bits selected, lanes x)
{
    return (lanes)((lane_bits)x & selected);
}

/* Is a bit of the first `count` lanes set? */
PD_INLINE bool any_lane(lane_bits bits, int count)
{
    int64_t any = 0;
    for (int q = 0; q < PD_WIDTH; q++)
        any |= q < count ? bits[q] : 0;
    return any;
}

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
