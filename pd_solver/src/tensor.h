/*
 * Small dense vectors and tensors, row-major T[d][d]. Every function is inlined with a
 * literal d, so that two dimensions pay for two components only.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_TENSOR_H
#define PD_SRC_TENSOR_H

#include <stddef.h>

#define PD_INLINE static inline __attribute__((always_inline, unused))

PD_INLINE double dot(const int d, const double *a, const double *b)
{
    double sum = 0;
    for (int c = 0; c < d; c++)
        sum += a[c] * b[c];
    return sum;
}

PD_INLINE void subtract(const int d, const double *a, const double *b, double *result)
{
    for (int c = 0; c < d; c++)
        result[c] = a[c] - b[c];
}

PD_INLINE void identity(const int d, double *T)
{
    for (int c = 0; c < d * d; c++)
        T[c] = c % (d + 1) == 0;
}

/* T += w a (x) b */
PD_INLINE void add_dyad(const int d, double w, const double *a, const double *b,
                        double *T)
{
    for (int r = 0; r < d; r++)
        for (int c = 0; c < d; c++)
            T[r * d + c] += w * a[r] * b[c];
}

PD_INLINE double trace(const int d, const double *T)
{
    double sum = 0;
    for (int c = 0; c < d; c++)
        sum += T[c * d + c];
    return sum;
}

PD_INLINE double determinant(const int d, const double *T)
{
    if (d == 2)
        return T[0] * T[3] - T[1] * T[2];
    return T[0] * (T[4] * T[8] - T[5] * T[7]) - T[1] * (T[3] * T[8] - T[5] * T[6]) +
           T[2] * (T[3] * T[7] - T[4] * T[6]);
}

/* Inverse of T given 1/det T. */
PD_INLINE void inverse(const int d, const double *T, double one_by_det, double *I)
{
    if (d == 2) {
        I[0] = T[3] * one_by_det, I[1] = -T[1] * one_by_det;
        I[2] = -T[2] * one_by_det, I[3] = T[0] * one_by_det;
        return;
    }
    I[0] = (T[4] * T[8] - T[5] * T[7]) * one_by_det;
    I[1] = (T[2] * T[7] - T[1] * T[8]) * one_by_det;
    I[2] = (T[1] * T[5] - T[2] * T[4]) * one_by_det;
    I[3] = (T[5] * T[6] - T[3] * T[8]) * one_by_det;
    I[4] = (T[0] * T[8] - T[2] * T[6]) * one_by_det;
    I[5] = (T[2] * T[3] - T[0] * T[5]) * one_by_det;
    I[6] = (T[3] * T[7] - T[4] * T[6]) * one_by_det;
    I[7] = (T[1] * T[6] - T[0] * T[7]) * one_by_det;
    I[8] = (T[0] * T[4] - T[1] * T[3]) * one_by_det;
}

/* C = A B */
PD_INLINE void multiply(const int d, const double *A, const double *B, double *C)
{
    for (int r = 0; r < d; r++)
        for (int c = 0; c < d; c++) {
            double sum = 0;
            for (int k = 0; k < d; k++)
                sum += A[r * d + k] * B[k * d + c];
            C[r * d + c] = sum;
        }
}

#endif
