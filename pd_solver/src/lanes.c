/* Which instructions the machine has. SPDX-License-Identifier: GPL-3.0-or-later */
#include "lanes.h"

static int limit = PD_AVX512;

static int available(void)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("fma"))
        return PD_AVX512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return PD_AVX2;
#endif
    return PD_ANY;
}

int pd_instruction_set(void)
{
    const int best = available();
    return best < limit ? best : limit;
}

void pd_instruction_set_limit(int most)
{
    limit = most;
}
