/*
 * All-pairs correspondence peridynamics, [kim2023] eqs 16-18, 24-30, 43-45.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "reference_correspondence.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef double tensor[3][3];

reference_body *reference_create(int d, size_t n, const double *X, const double *V)
{
    reference_body *b = calloc(1, sizeof *b);
    if (!b)
        return NULL;
    b->d = d;
    b->n = n;
    b->X = calloc(n, sizeof *b->X);
    b->V = calloc(n, sizeof *b->V);
    b->y = calloc(n, sizeof *b->y);
    b->I = calloc(n * n, sizeof *b->I);
    b->F = calloc(n, sizeof *b->F);
    b->J = calloc(n, sizeof *b->J);
    b->f = calloc(n, sizeof *b->f);
    b->phi = calloc(n, sizeof *b->phi);
    if (!b->X || !b->V || !b->y || !b->I || !b->F || !b->J || !b->f || !b->phi) {
        reference_free(b);
        return NULL;
    }
    memcpy(b->X, X, n * sizeof *b->X);
    memcpy(b->y, X, n * sizeof *b->y);
    memcpy(b->V, V, n * sizeof *b->V);
    for (size_t k = 0; k < n * n; k++)
        b->I[k] = 1;
    return b;
}

void reference_free(reference_body *b)
{
    if (!b)
        return;
    free(b->X);
    free(b->V);
    free(b->y);
    free(b->I);
    free(b->F);
    free(b->J);
    free(b->f);
    free(b->phi);
    free(b);
}

/* ---- a pair of points ---- */

static double distance(const double *a, const double *b)
{
    return sqrt(pow(b[0] - a[0], 2) + pow(b[1] - a[1], 2) + pow(b[2] - a[2], 2));
}

/* The paper has one Delta X; where volumes differ a pair takes the mean of both. */
static double spacing_of(const reference_body *b, size_t l, size_t m)
{
    return (pow(b->V[l], 1. / b->d) + pow(b->V[m], 1. / b->d)) / 2;
}

static int in_family(const reference_body *b, size_t l, size_t m)
{
    return l != m && distance(b->X[l], b->X[m]) <= b->horizon_ratio * spacing_of(b, l, m);
}

/* V_m^(l), eq. 24 */
static double corrected_volume(const reference_body *b, size_t l, size_t m)
{
    const double xi = distance(b->X[l], b->X[m]);
    const double DeltaX = spacing_of(b, l, m), epsilon = b->horizon_ratio * DeltaX;
    if (xi <= epsilon - DeltaX / 2)
        return b->V[m];
    if (xi <= epsilon)
        return 1 / DeltaX * (epsilon - (xi - DeltaX / 2)) * b->V[m];
    return 0;
}

/* omega of the bond, eq. 30, times I, eq. 17 */
static double omega_hat(const reference_body *b, size_t l, size_t m)
{
    const double epsilon = b->horizon_ratio * spacing_of(b, l, m);
    const double r = 2 * distance(b->X[l], b->X[m]) / epsilon;
    const double C = b->d == 2 ? 15 / (7 * acos(-1)) : 3 / (2 * acos(-1));
    double omega = 0;
    if (r < 1)
        omega = C * (2. / 3 - pow(r, 2) + pow(r, 3) / 2);
    else if (r <= 2)
        omega = C * pow(2 - r, 3) / 6;
    return omega * b->I[l * b->n + m];
}

/* ---- tensors ---- */

static double determinant(tensor A)
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += A[0][c] * (A[1][(c + 1) % 3] * A[2][(c + 2) % 3] -
                          A[1][(c + 2) % 3] * A[2][(c + 1) % 3]);
    return sum;
}

static void invert(tensor A, tensor inverse)
{
    const double det = determinant(A);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            inverse[c][r] = (A[(r + 1) % 3][(c + 1) % 3] * A[(r + 2) % 3][(c + 2) % 3] -
                             A[(r + 1) % 3][(c + 2) % 3] * A[(r + 2) % 3][(c + 1) % 3]) /
                            det;
}

static void multiply(tensor A, tensor B, tensor AB)
{
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            AB[r][c] = 0;
            for (int k = 0; k < 3; k++)
                AB[r][c] += A[r][k] * B[k][c];
        }
}

static void set_identity(tensor A)
{
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            A[r][c] = r == c;
}

/* sum over the family of omega_hat (a_m - a_l) (x) (X_m - X_l) V_m^(l): K with a = X,
 * eq. 26; with a = y, F K, eq. 25. */
static void sum_over_family(const reference_body *b, size_t l, double (*a)[3], tensor sum)
{
    memset(sum, 0, sizeof(tensor));
    for (size_t m = 0; m < b->n; m++) {
        if (!in_family(b, l, m))
            continue;
        const double weight = omega_hat(b, l, m) * corrected_volume(b, l, m);
        for (int r = 0; r < b->d; r++)
            for (int c = 0; c < b->d; c++)
                sum[r][c] += weight * (a[m][r] - a[l][r]) * (b->X[m][c] - b->X[l][c]);
    }
    if (b->d == 2)
        sum[2][2] = 1;
}

/* P, eqs 44 and 45 */
static void stress(const reference_body *b, tensor F, double J, tensor P)
{
    const double kappa = 2 * b->G * (1 + b->nu_stab) / (3 * (1 - 2 * b->nu_stab));
    tensor inverse;
    double trC = 0;
    invert(F, inverse);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            trC += F[r][c] * F[r][c];
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            P[r][c] = b->G * pow(J, -2. / 3) * (F[r][c] - trC / 3 * inverse[c][r]) +
                      kappa * log(J) * inverse[c][r];
}

/* ---- a body ---- */

/* eqs 16 and 17 */
static void break_bonds(reference_body *b)
{
    if (b->critical_stretch == 0)
        return;
    for (size_t l = 0; l < b->n; l++)
        for (size_t m = 0; m < b->n; m++) {
            const double xi = distance(b->X[l], b->X[m]);
            if (l != m && distance(b->y[l], b->y[m]) / xi > b->critical_stretch)
                b->I[l * b->n + m] = 0;
        }
}

/* F, J, and P K^-1 of point l; no stress where K or F cannot be inverted. */
static void deform(reference_body *b, size_t l, tensor PKinverse)
{
    tensor K, Kinverse, FK, P;
    sum_over_family(b, l, b->X, K);
    set_identity(b->F[l]);
    b->J[l] = 1;
    memset(PKinverse, 0, sizeof(tensor));
    const double mean =
        (b->d == 2 ? K[0][0] + K[1][1] : K[0][0] + K[1][1] + K[2][2]) / b->d;
    if (!(determinant(K) > b->smallest_shape * pow(mean, b->d))) {
        b->singular++;
        return;
    }
    invert(K, Kinverse);
    sum_over_family(b, l, b->y, FK);
    tensor F;
    multiply(FK, Kinverse, F);
    if (!(determinant(F) > b->smallest_J)) {
        b->inverted++;
        return;
    }
    memcpy(b->F[l], F, sizeof F);
    b->J[l] = determinant(F);
    stress(b, F, b->J[l], P);
    multiply(P, Kinverse, PKinverse);
}

/* eqs 28 and 29 */
static void sum_forces(reference_body *b, tensor *PKinverse, size_t l)
{
    memset(b->f[l], 0, sizeof b->f[l]);
    for (size_t m = 0; m < b->n; m++) {
        if (!in_family(b, l, m))
            continue;
        for (int r = 0; r < b->d; r++)
            for (int c = 0; c < b->d; c++)
                b->f[l][r] += omega_hat(b, l, m) *
                              (PKinverse[l][r][c] + PKinverse[m][r][c]) *
                              (b->X[m][c] - b->X[l][c]) * corrected_volume(b, l, m);
    }
}

/* eq. 18, with whole volumes: the paper's integrals carry no correction */
static double local_damage(const reference_body *b, size_t l)
{
    double intact = 0, all = 0;
    for (size_t m = 0; m < b->n; m++) {
        if (!in_family(b, l, m))
            continue;
        intact += b->I[l * b->n + m] * b->V[m];
        all += b->V[m];
    }
    return all > 0 ? 1 - intact / all : 0;
}

void reference_forces(reference_body *b)
{
    tensor *PKinverse = calloc(b->n, sizeof *PKinverse);
    if (!PKinverse)
        abort();
    b->singular = b->inverted = 0;
    break_bonds(b);
    for (size_t l = 0; l < b->n; l++)
        deform(b, l, PKinverse[l]);
    for (size_t l = 0; l < b->n; l++)
        sum_forces(b, PKinverse, l);
    for (size_t l = 0; l < b->n; l++)
        b->phi[l] = local_damage(b, l);
    free(PKinverse);
}
