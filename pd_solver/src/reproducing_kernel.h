/*
 * Reproducing-kernel gradients, [behzadinasab2021] eqs A.2, A.7-A.9: for the bonds x of a
 * family, Phi = w R Xi(x) with R the first d rows of M^-1, such that the sum of
 * Phi (f(x) - f(0)) is the gradient of f at 0, exact for polynomials of its order. Knows
 * no bodies.
 *
 * Bonds come in batches of LANES, component by component, so that the compiler can work
 * on several at a time. Every function is inlined with a literal dimension and order.
 *
 * M needs no products of monomials: its entries are the moments of degree 2 to 2 n, of
 * which there are fewer (d = 3, n = 3: 80 for 190 entries).
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_REPRODUCING_KERNEL_H
#define PD_SRC_REPRODUCING_KERNEL_H

#include "pd.h"
#include "tensor.h"

#define LANES 4
typedef double lanes[LANES];

/* The compiler's own limit would leave the degree of a monomial to run time. */
#define UNROLLED _Pragma("GCC unroll 32")

enum { LARGEST_ORDER = 3, MOST_TERMS = 19, MOST_MOMENTS = 80, MOST_OF_A_DEGREE = 28 };

/* What a monomial adds to those before it, as the share of its square that they leave:
 * below this the order that it belongs to is not used. On a lattice, monomials that the
 * family can tell apart leave 6e-3 or more, also at corners; those that only bonds as
 * long as the horizon tell apart 1e-4 or less. */
#define SMALLEST_PIVOT 1e-3

/* ---- monomials ----
 *
 * Of one degree, by falling powers of the first component, then of the second:
 * xx xy yy; xx xy xz yy yz zz. Of several, by rising degree. */

/* How many there are of a degree. */
PD_INLINE int of_degree(const int d, const int degree)
{
    return d == 2 ? degree + 1 : (degree + 1) * (degree + 2) / 2;
}

/* How many there are of degree 1 to n, the length of Xi. */
PD_INLINE int up_to_degree(const int d, const int n)
{
    return d == 2 ? (n + 1) * (n + 2) / 2 - 1 : (n + 1) * (n + 2) * (n + 3) / 6 - 1;
}

/* Place of x^a y^b z^c among those of its degree. */
PD_INLINE int place_in_degree(const int d, const int *power)
{
    if (d == 2)
        return power[1];
    const int rest = power[1] + power[2];
    return rest * (rest + 1) / 2 + power[2];
}

/* m: from the monomials of the degree below to those of the degree. */
PD_INLINE void raise(const int d, const int degree, lanes *x, lanes *m)
{
    /* All times x; then those without x times y; then the power of the last times it. */
    const int lower = of_degree(d, degree - 1), all = of_degree(d, degree);
    for (int l = 0; l < LANES; l++)
        m[all - 1][l] = m[lower - 1][l] * x[d - 1][l];
    UNROLLED
    for (int e = 0; d == 3 && e < degree; e++)
        for (int l = 0; l < LANES; l++)
            m[lower + e][l] = m[lower - degree + e][l] * x[1][l];
    UNROLLED
    for (int e = 0; e < lower; e++)
        for (int l = 0; l < LANES; l++)
            m[e][l] *= x[0][l];
}

/* ---- the moment matrix ---- */

/* moment += w times all monomials of degree 2 to 2 n of x. */
PD_INLINE void add_moments(const int d, const int n, lanes *x, const double *w,
                           lanes *moment)
{
    lanes m[MOST_OF_A_DEGREE];
    for (int a = 0; a < d; a++)
        for (int l = 0; l < LANES; l++)
            m[a][l] = w[l] * x[a][l];
    int at = 0;
    UNROLLED
    for (int degree = 2; degree <= 2 * n; degree++) {
        raise(d, degree, x, m);
        UNROLLED
        for (int e = 0; e < of_degree(d, degree); e++, at++)
            for (int l = 0; l < LANES; l++)
                moment[at][l] += m[e][l];
    }
}

/* Powers of the monomials of Xi, in order. */
PD_INLINE void list_powers(const int d, const int n, int (*power)[3])
{
    int e = 0;
    for (int degree = 1; degree <= n; degree++)
        for (int rest = 0; rest <= degree; rest++)
            for (int c = d == 2 ? rest : 0; c <= rest; c++, e++) {
                power[e][0] = degree - rest;
                power[e][1] = d == 2 ? c : rest - c;
                power[e][2] = d == 2 ? 0 : c;
            }
}

/* Lower triangle of M[N][N], eq. A.7, N = up_to_degree(d, n), from its moments. */
PD_INLINE void fill_matrix(const int d, const int n, lanes *moment, double *M)
{
    const int N = up_to_degree(d, n);
    int power[MOST_TERMS][3];
    list_powers(d, n, power);
    for (int r = 0; r < N; r++)
        for (int c = 0; c <= r; c++) {
            int sum[3], degree = 0;
            for (int a = 0; a < 3; a++)
                degree += sum[a] = power[r][a] + power[c][a];
            const int at = up_to_degree(d, degree - 1) - d + place_in_degree(d, sum);
            double total = 0;
            for (int l = 0; l < LANES; l++)
                total += moment[at][l];
            M[r * N + c] = total;
        }
}

/* Do the bonds span space? The measure of PD_SINGULAR_SHAPE. */
PD_INLINE bool spans_space(const int d, const int N, const double *M)
{
    double K[9], mean = 0;
    for (int a = 0; a < d; a++)
        mean += M[a * N + a] / d;
    if (!(mean > 0))
        return false;
    for (int r = 0; r < d; r++)
        for (int c = 0; c < d; c++)
            K[r * d + c] = M[r > c ? r * N + c : c * N + r] / mean;
    return determinant(d, K) > PD_SINGULAR_SHAPE;
}

/* M = L D L^T in place of its lower triangle, D^-1 on the diagonal, as far as whole
 * degrees go: returns how many terms that are. Leading blocks of L are those of lower
 * orders, so that an order that fails leaves the one below. */
PD_INLINE int factorise(const int d, const int n, double *M)
{
    const int N = up_to_degree(d, n);
    int degree = 1;
    for (int k = 0; k < N; k++) {
        if (k == up_to_degree(d, degree))
            degree++;
        double pivot = M[k * N + k], scaled[MOST_TERMS];
        for (int c = 0; c < k; c++) {
            scaled[c] = M[k * N + c];
            M[k * N + c] *= M[c * N + c];
            pivot -= scaled[c] * M[k * N + c];
        }
        if (!(pivot > (k < d ? 0 : SMALLEST_PIVOT) * M[k * N + k]))
            return up_to_degree(d, degree - 1);
        M[k * N + k] = 1 / pivot;
        for (int r = k + 1; r < N; r++)
            for (int c = 0; c < k; c++)
                M[r * N + k] -= M[r * N + c] * M[k * N + c];
    }
    return N;
}

/* Rows R[d][N] of M^-1 from its factors of `terms` terms; the rest of R is 0. */
PD_INLINE void solve_rows(const int d, const int N, const int terms, const double *M,
                          double *R)
{
    for (int a = 0; a < d; a++) {
        double *row = R + a * N;
        for (int r = 0; r < N; r++)
            row[r] = r == a;
        for (int r = a + 1; r < terms; r++)
            for (int c = a; c < r; c++)
                row[r] -= M[r * N + c] * row[c];
        for (int r = a; r < terms; r++)
            row[r] *= M[r * N + r];
        for (int c = terms - 1; c >= 0; c--)
            for (int r = c + 1; r < terms; r++)
                row[c] -= M[r * N + c] * row[r];
    }
}

/* R[d][N] of order n from the moments, of a lower order where the family does not tell
 * the monomials of n apart; returns the order, 0 and R = 0 where the bonds do not span
 * space. */
PD_INLINE int find_rows(const int d, const int n, lanes *moment, double *R)
{
    const int N = up_to_degree(d, n);
    double M[MOST_TERMS * MOST_TERMS]; /* above the diagonal nothing is set or read */
    fill_matrix(d, n, moment, M);
    const int terms = spans_space(d, N, M) ? factorise(d, n, M) : 0;
    if (terms == N)
        solve_rows(d, N, N, M, R); /* a literal count: unrolled */
    else if (terms > 0)
        solve_rows(d, N, terms, M, R);
    else
        for (int c = 0; c < d * N; c++)
            R[c] = 0;
    int order = 0;
    while (order < n && up_to_degree(d, order + 1) <= terms)
        order++;
    return order;
}

/* ---- gradients ---- */

/* result[d] = R Xi(x), for any R[d][N]. */
PD_INLINE void apply_rows(const int d, const int n, const double *R, lanes *x,
                          lanes *result)
{
    const int N = up_to_degree(d, n);
    lanes m[MOST_OF_A_DEGREE];
    for (int a = 0; a < d; a++)
        for (int l = 0; l < LANES; l++)
            m[a][l] = x[a][l], result[a][l] = 0;
    int at = 0;
    UNROLLED
    for (int degree = 1; degree <= n; degree++) {
        if (degree > 1)
            raise(d, degree, x, m);
        UNROLLED
        for (int e = 0; e < of_degree(d, degree); e++, at++)
            for (int a = 0; a < d; a++)
                for (int l = 0; l < LANES; l++)
                    result[a][l] += R[a * N + at] * m[e][l];
    }
}

#endif
