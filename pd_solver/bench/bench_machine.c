/*
 * What one core of this machine can do at best, the roof over every kernel:
 *
 *     bench_machine [megabytes an array] [repeats]       (default: 512 5)
 *
 * Bandwidths, with the widest vectors, from arrays far beyond every cache and from arrays
 * in the second-level cache; and double operations per second with each width of vectors.
 * A fused multiply-add counts as one operation. Bytes are those that the program reads
 * and writes, as STREAM counts them.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _POSIX_C_SOURCE 200809L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#define MAX_REPEATS 100
#define L2_BYTES (256 << 10) /* an array's; three lie well inside 1 MB */

/* Enough to hide a latency of 4 on 3 ports (an addition may have one of its own, so that
 * fused operations can be fewer), few enough for 16 registers. */
#define CHAINS 12

typedef void stream_kernel(size_t n, double *a, const double *b, const double *c);
typedef void operation_kernel(long steps);

typedef struct {
    int bytes; /* of a vector */
    stream_kernel *read, *scale, *triad;
    operation_kernel *multiply_add, *fma; /* fma: NULL where there is none */
} width;

/* One that the compiler does not know, and where results go so that it computes them. */
static volatile double one = 1, sink;

/* ---- the kernels for each width ---- */

#define NAME(word) word##_128
#define BYTES 16
#include "machine_kernels.h"

#if defined(__x86_64__)
#pragma GCC push_options
#pragma GCC target("avx2,fma")
#define NAME(word) word##_256
#define BYTES 32
#define FMA _mm256_fmadd_pd
#include "machine_kernels.h"
#pragma GCC pop_options

#pragma GCC push_options
#pragma GCC target("avx512f")
#define NAME(word) word##_512
#define BYTES 64
#define FMA _mm512_fmadd_pd
#include "machine_kernels.h"
#pragma GCC pop_options
#endif

/* The widths that this processor has, narrowest first; returns how many. */
static int find_widths(const width **widths)
{
    int n = 0;
    widths[n++] = &width_128;
#if defined(__x86_64__)
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        widths[n++] = &width_256;
    if (__builtin_cpu_supports("avx512f"))
        widths[n++] = &width_512;
#endif
    return n;
}

/* ---- measuring ---- */

/* Of this process: what others do meanwhile does not count. */
static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int rising(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* amount: of what a repeat does, e.g. bytes. */
static void print(const char *what, const char *where, const char *unit, double amount,
                  double *times, int repeats)
{
    qsort(times, (size_t)repeats, sizeof *times, rising);
    const double median = (times[(repeats - 1) / 2] + times[repeats / 2]) / 2;
    printf("%s,%s,%s,%.4g,%.4g\n", what, where, unit, 1e-9 * amount / median,
           1e-9 * amount / times[0]);
}

static void time_stream(const char *what, const char *where, stream_kernel *kernel,
                        double bytes, size_t n, double *const *arrays, int repeats)
{
    double times[MAX_REPEATS];
    const long passes = (long)((1 << 25) / n) + 1;
    kernel(n, arrays[0], arrays[1], arrays[2]);
    for (int r = 0; r < repeats; r++) {
        const double start = seconds();
        for (long k = 0; k < passes; k++)
            kernel(n, arrays[0], arrays[1], arrays[2]);
        times[r] = seconds() - start;
    }
    print(what, where, "GB/s", bytes * (double)n * (double)passes, times, repeats);
}

static void time_operations(const char *what, const width *w, operation_kernel *kernel,
                            int repeats)
{
    double times[MAX_REPEATS];
    const long steps = 10000000;
    kernel(steps);
    for (int r = 0; r < repeats; r++) {
        const double start = seconds();
        kernel(steps);
        times[r] = seconds() - start;
    }
    char where[32];
    snprintf(where, sizeof where, "%d bits", 8 * w->bytes);
    print(what, where, "1e9 operations/s",
          (double)steps * CHAINS * w->bytes / (double)sizeof(double), times, repeats);
}

static void bench_streams(const width *w, size_t bytes, const char *where, int repeats)
{
    const size_t n = bytes / sizeof(double) / 64 * 64;
    double *arrays[3];
    for (int k = 0; k < 3; k++) {
        arrays[k] = aligned_alloc(64, n * sizeof(double));
        if (!arrays[k]) {
            fprintf(stderr, "bench_machine: no memory for 3 arrays of %zu bytes\n",
                    bytes);
            exit(EXIT_FAILURE);
        }
        for (size_t i = 0; i < n; i++)
            arrays[k][i] = 1;
    }
    time_stream("read", where, w->read, 8, n, arrays, repeats);
    time_stream("copy", where, w->scale, 16, n, arrays, repeats);
    time_stream("triad", where, w->triad, 24, n, arrays, repeats);
    for (int k = 0; k < 3; k++)
        free(arrays[k]);
}

static long argument(int argc, char **argv, int k, long otherwise, long low, long high)
{
    if (argc <= k)
        return otherwise;
    char *end;
    const long value = strtol(argv[k], &end, 10);
    if (end == argv[k] || *end || value < low || value > high) {
        fprintf(stderr, "bench_machine: %s; allowed: %ld to %ld\n", argv[k], low, high);
        exit(EXIT_FAILURE);
    }
    return value;
}

int main(int argc, char **argv)
{
    const size_t megabytes = (size_t)argument(argc, argv, 1, 512, 1, 1 << 16);
    const int repeats = (int)argument(argc, argv, 2, 5, 1, MAX_REPEATS);
    const width *widths[3];
    const int n = find_widths(widths);

    puts("quantity,where,unit,median,best");
    bench_streams(widths[n - 1], megabytes << 20, "memory", repeats);
    bench_streams(widths[n - 1], L2_BYTES, "L2", repeats);
    for (int k = 0; k < n; k++) {
        time_operations("multiply or add", widths[k], widths[k]->multiply_add, repeats);
        if (widths[k]->fma)
            time_operations("fma", widths[k], widths[k]->fma, repeats);
    }
    return EXIT_SUCCESS;
}
