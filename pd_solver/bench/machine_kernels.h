/*
 * What bench_machine.c times, for one width of vectors: included once for each, between
 * options that let the compiler use it. To be defined: NAME(word), the word with a suffix
 * of the width; BYTES of a vector; FMA(x, y, z) = x y + z, where the processor has it.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
typedef double NAME(vector) __attribute__((vector_size(BYTES)));
#define VECTOR NAME(vector)
#define LANES (BYTES / sizeof(double))

/* ---- streams: n doubles an array, a multiple of 64 ---- */

/* Four sums, as one would wait for itself. */
static void NAME(read)(size_t n, double *a, const double *b, const double *c)
{
    const VECTOR *v = (const VECTOR *)b;
    VECTOR s0 = {0}, s1 = {0}, s2 = {0}, s3 = {0};
    (void)a, (void)c;
    for (size_t k = 0; k < n / LANES; k += 4) {
        s0 += v[k];
        s1 += v[k + 1];
        s2 += v[k + 2];
        s3 += v[k + 3];
    }
    s0 += s1 + s2 + s3;
    sink = s0[0];
}

/* Scaled, or it became a call of memcpy, which bypasses the caches. */
static void NAME(scale)(size_t n, double *restrict a, const double *b, const double *c)
{
    VECTOR *u = (VECTOR *)a;
    const VECTOR *v = (const VECTOR *)b;
    (void)c;
    for (size_t k = 0; k < n / LANES; k++)
        u[k] = 0.5 * v[k];
}

static void NAME(triad)(size_t n, double *restrict a, const double *b, const double *c)
{
    VECTOR *u = (VECTOR *)a;
    const VECTOR *v = (const VECTOR *)b, *w = (const VECTOR *)c;
    for (size_t k = 0; k < n / LANES; k++)
        u[k] = v[k] + 0.5 * w[k];
}

/* ---- operations: CHAINS vectors a step ---- */

/* Different, or the compiler would see that the chains are alike. */
static void NAME(start)(VECTOR *x)
{
    for (int k = 0; k < CHAINS; k++)
        x[k] = (VECTOR){0} + (one + k);
}

static void NAME(finish)(const VECTOR *x)
{
    VECTOR sum = x[0];
    for (int k = 1; k < CHAINS; k++)
        sum += x[k];
    sink = sum[0];
}

/* As many multiplications as additions, in chains of their own: none can be fused. */
static void NAME(multiply_add)(long steps)
{
    const VECTOR y = (VECTOR){0} + one;
    VECTOR x[CHAINS];
    NAME(start)(x);
    for (long s = 0; s < steps; s++)
        for (int k = 0; k < CHAINS; k += 2) {
            x[k] *= y;
            x[k + 1] += y;
        }
    NAME(finish)(x);
}

#ifdef FMA
static void NAME(fma)(long steps)
{
    const VECTOR y = (VECTOR){0} + one;
    VECTOR x[CHAINS];
    NAME(start)(x);
    for (long s = 0; s < steps; s++)
        for (int k = 0; k < CHAINS; k++)
            x[k] = FMA(x[k], y, y);
    NAME(finish)(x);
}
#endif

static const width NAME(width) = {
    .bytes = BYTES,
    .read = NAME(read),
    .scale = NAME(scale),
    .triad = NAME(triad),
    .multiply_add = NAME(multiply_add),
#ifdef FMA
    .fma = NAME(fma),
#endif
};

#undef VECTOR
#undef LANES
#undef NAME
#undef BYTES
#undef FMA
