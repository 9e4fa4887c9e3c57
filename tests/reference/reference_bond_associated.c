/*
 * All-pairs bond-associated correspondence, [behzadinasab2021] appendices A and C.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "reference_bond_associated.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef double tensor[3][3];
enum { MOST = 19 };

reference_bonds *reference_bonds_create(const pd_body_options *options, size_t n,
                                        const double *X, const double *V)
{
    reference_bonds *b = calloc(1, sizeof *b);
    if (!b)
        return NULL;
    b->options = *options;
    b->d = options->dimension;
    b->n = n;
    void **arrays[] = {(void **)&b->X,         (void **)&b->V,       (void **)&b->y,
                       (void **)&b->v,         (void **)&b->omega_D, (void **)&b->sigma,
                       (void **)&b->plastic,   (void **)&b->Phi,     (void **)&b->omega,
                       (void **)&b->omega_bar, (void **)&b->L,       (void **)&b->F,
                       (void **)&b->J,         (void **)&b->f,       (void **)&b->mean};
    const size_t widths[] = {3, 1, 3, 3, n, 6 * n, n, 3 * n, n, 1, 9, 9, 1, 3, 6};
    for (size_t k = 0; k < sizeof widths / sizeof *widths; k++) {
        *arrays[k] = calloc(n * widths[k], sizeof(double));
        if (!*arrays[k]) {
            reference_bonds_free(b);
            return NULL;
        }
    }
    memcpy(b->X, X, n * sizeof *b->X);
    memcpy(b->y, X, n * sizeof *b->y);
    memcpy(b->V, V, n * sizeof *b->V);
    for (size_t i = 0; i < n; i++) {
        b->J[i] = b->F[i][0][0] = b->F[i][1][1] = b->F[i][2][2] = 1;
        for (size_t j = 0; j < n; j++)
            b->omega_D[i * n + j] = 1;
    }
    return b;
}

void reference_bonds_free(reference_bonds *b)
{
    if (!b)
        return;
    void *arrays[] = {b->X,     b->V,       b->y,   b->v,     b->omega_D,
                      b->sigma, b->plastic, b->Phi, b->omega, b->omega_bar,
                      b->L,     b->F,       b->J,   b->f,     b->mean};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        free(arrays[k]);
    free(b);
}

/* ---- linear algebra ---- */

/* Solve A x = r for several r at once, Gauss with pivots: r becomes x. */
static void solve(int N, double A[MOST][MOST], int columns, double r[MOST][3])
{
    for (int k = 0; k < N; k++) {
        int best = k;
        for (int i = k; i < N; i++)
            if (fabs(A[i][k]) > fabs(A[best][k]))
                best = i;
        for (int c = 0; c < N; c++) {
            const double swap = A[k][c];
            A[k][c] = A[best][c], A[best][c] = swap;
        }
        for (int c = 0; c < columns; c++) {
            const double swap = r[k][c];
            r[k][c] = r[best][c], r[best][c] = swap;
        }
        for (int i = 0; i < N; i++) {
            if (i == k)
                continue;
            const double factor = A[i][k] / A[k][k];
            for (int c = k; c < N; c++)
                A[i][c] -= factor * A[k][c];
            for (int c = 0; c < columns; c++)
                r[i][c] -= factor * r[k][c];
        }
    }
    for (int k = 0; k < N; k++)
        for (int c = 0; c < columns; c++)
            r[k][c] /= A[k][k];
}

/* A^-1 B */
static void divide(tensor A, tensor B, tensor result)
{
    double matrix[MOST][MOST], r[MOST][3];
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < 3; c++)
            matrix[i][c] = A[i][c], r[i][c] = B[i][c];
    solve(3, matrix, 3, r);
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < 3; c++)
            result[i][c] = r[i][c];
}

static double determinant(tensor A)
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += A[0][c] * (A[1][(c + 1) % 3] * A[2][(c + 2) % 3] -
                          A[1][(c + 2) % 3] * A[2][(c + 1) % 3]);
    return sum;
}

/* one 1 + factor A */
static void add_to_one(double factor, tensor A, tensor result)
{
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            result[r][c] = (r == c) + factor * A[r][c];
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

static double stress_component(const double *s, int r, int c)
{
    static const int place[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    return s[place[r][c]];
}

/* ---- a pair of points ---- */

static double distance(const double *a, const double *b)
{
    return sqrt(pow(b[0] - a[0], 2) + pow(b[1] - a[1], 2) + pow(b[2] - a[2], 2));
}

static double horizon_of(const reference_bonds *b, size_t i, size_t j)
{
    return b->options.horizon_ratio *
           (pow(b->V[i], 1. / b->d) + pow(b->V[j], 1. / b->d)) / 2;
}

static int in_family(const reference_bonds *b, size_t i, size_t j)
{
    return i != j && distance(b->X[i], b->X[j]) <= horizon_of(b, i, j);
}

/* eqs A.3, A.4 and C.1; of the length now or at rest the smaller */
static double influence(const reference_bonds *b, size_t i, size_t j)
{
    if (!in_family(b, i, j))
        return 0;
    const double now = distance(b->y[i], b->y[j]), rest = distance(b->X[i], b->X[j]);
    const double eta = fmin(now, rest) / horizon_of(b, i, j);
    double omega = 0;
    if (eta <= 0.5)
        omega = 2. / 3 - 4 * pow(eta, 2) + 4 * pow(eta, 3);
    else if (eta <= 1)
        omega = 4. / 3 - 4 * eta + 4 * pow(eta, 2) - 4. / 3 * pow(eta, 3);
    return omega * b->omega_D[i * b->n + j];
}

static double volume(const reference_bonds *b, size_t i)
{
    return b->J[i] * b->V[i];
}

/* ---- kernels ---- */

/* Xi of x, all monomials of degree 1 to the order, eq. A.9; how many. */
static int monomials(int d, int order, const double *x, double *Xi)
{
    int count = 0;
    for (int degree = 1; degree <= order; degree++)
        for (int p = degree; p >= 0; p--)
            for (int q = degree - p; q >= (d == 2 ? degree - p : 0); q--)
                Xi[count++] = pow(x[0], p) * pow(x[1], q) * pow(x[2], degree - p - q);
    return count;
}

static int bond_monomials(const reference_bonds *b, size_t i, size_t j, double *Xi)
{
    double x[3] = {0};
    const double length = pow(b->V[i], 1. / b->d);
    for (int c = 0; c < b->d; c++)
        x[c] = (b->y[j][c] - b->y[i][c]) / length;
    return monomials(b->d, (int)b->options.formulation_parameters[0], x, Xi);
}

/* Phi of the bonds of point i, eqs A.2, A.7, A.8 */
static void find_Phi(reference_bonds *b, size_t i)
{
    double M[MOST][MOST] = {{0}}, rows[MOST][3] = {{0}}, Xi[MOST];
    int N = 0;
    b->omega_bar[i] = 0;
    for (size_t j = 0; j < b->n; j++) {
        const double omega = b->omega[i * b->n + j] = influence(b, i, j);
        N = bond_monomials(b, i, j, Xi);
        b->omega_bar[i] += omega * volume(b, j);
        for (int r = 0; r < N; r++)
            for (int c = 0; c < N; c++)
                M[r][c] += omega * Xi[r] * Xi[c] * volume(b, j);
    }
    for (int a = 0; a < b->d; a++)
        rows[a][a] = 1 / pow(b->V[i], 1. / b->d);
    solve(N, M, b->d, rows);
    for (size_t j = 0; j < b->n; j++) {
        bond_monomials(b, i, j, Xi);
        for (int a = 0; a < 3; a++) {
            b->Phi[i * b->n + j][a] = 0;
            for (int r = 0; r < N && a < b->d; r++)
                b->Phi[i * b->n + j][a] += b->omega[i * b->n + j] * rows[r][a] * Xi[r];
        }
    }
}

/* eq. A.1 */
static void find_L(reference_bonds *b, size_t i)
{
    memset(b->L[i], 0, sizeof b->L[i]);
    for (size_t j = 0; j < b->n; j++)
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                b->L[i][r][c] +=
                    (b->v[j][r] - b->v[i][r]) * b->Phi[i * b->n + j][c] * volume(b, j);
}

static int is_associated(const reference_bonds *b)
{
    return b->options.formulation_parameters[1] > 0;
}

/* eq. A.11 */
static void bond_L(const reference_bonds *b, size_t i, size_t j, tensor L)
{
    memcpy(L, b->L[i], sizeof(tensor));
    if (!is_associated(b))
        return;
    double x[3], lack[3];
    for (int r = 0; r < 3; r++) {
        x[r] = b->y[j][r] - b->y[i][r];
        for (int c = 0; c < 3; c++)
            L[r][c] = (b->L[i][r][c] + b->L[j][r][c]) / 2;
    }
    for (int r = 0; r < 3; r++) {
        lack[r] = b->v[j][r] - b->v[i][r];
        for (int c = 0; c < 3; c++)
            lack[r] -= L[r][c] * x[c];
    }
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            L[r][c] += lack[r] * x[c] / pow(distance(b->y[i], b->y[j]), 2);
}

/* ---- forces ---- */

static void break_by_stretch(reference_bonds *b)
{
    for (size_t i = 0; i < b->n; i++)
        for (size_t j = 0; j < b->n; j++)
            if (b->options.critical_stretch > 0 && in_family(b, i, j) &&
                distance(b->y[i], b->y[j]) >
                    b->options.critical_stretch * distance(b->X[i], b->X[j]))
                b->omega_D[i * b->n + j] = 0;
}

/* eq. A.14; without association the power is that of sigma : L alone */
static void find_z(const reference_bonds *b, size_t i, tensor z)
{
    memset(z, 0, sizeof(tensor));
    for (size_t j = 0; j < b->n; j++) {
        const size_t k = i * b->n + j;
        if (b->omega[k] == 0)
            continue;
        tensor projection;
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                projection[r][c] = (r == c) - is_associated(b) *
                                                  (b->y[j][r] - b->y[i][r]) *
                                                  (b->y[j][c] - b->y[i][c]) /
                                                  pow(distance(b->y[i], b->y[j]), 2);
        const double mean = is_associated(b)
                                ? 0.5 / b->omega_bar[i] + 0.5 / b->omega_bar[j]
                                : 1 / b->omega_bar[i];
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                for (int a = 0; a < 3; a++)
                    z[r][c] += mean * b->omega[k] * stress_component(b->sigma[k], r, a) *
                               projection[a][c] * volume(b, j);
    }
}

/* T<i, j>, eq. A.13 */
static void force_state(const reference_bonds *b, size_t i, size_t j, tensor z, double *T)
{
    const size_t k = i * b->n + j;
    for (int r = 0; r < 3; r++) {
        T[r] = 0;
        for (int c = 0; c < 3; c++) {
            T[r] += z[r][c] * b->Phi[k][c];
            if (is_associated(b) && b->omega[k] > 0)
                T[r] += b->omega[k] * stress_component(b->sigma[k], r, c) *
                        (b->y[j][c] - b->y[i][c]) /
                        (b->omega_bar[i] * pow(distance(b->y[i], b->y[j]), 2));
        }
    }
}

void reference_bonds_forces(reference_bonds *b)
{
    tensor *z = calloc(b->n, sizeof *z);
    if (!z)
        abort();
    break_by_stretch(b);
    for (size_t i = 0; i < b->n; i++)
        find_Phi(b, i);
    for (size_t i = 0; i < b->n; i++)
        find_z(b, i, z[i]);
    for (size_t i = 0; i < b->n; i++) {
        memset(b->f[i], 0, sizeof b->f[i]);
        memset(b->mean[i], 0, sizeof b->mean[i]);
        for (size_t j = 0; j < b->n; j++) {
            double T[3], T_back[3];
            const size_t k = i * b->n + j;
            force_state(b, i, j, z[i], T);
            force_state(b, j, i, z[j], T_back);
            for (int c = 0; c < 3; c++) /* eq. 22, per volume at rest */
                b->f[i][c] += b->J[i] * (T[c] - T_back[c]) * volume(b, j);
            for (int c = 0; c < 6; c++) /* eq. A.5 */
                b->mean[i][c] +=
                    b->omega[k] / b->omega_bar[i] * b->sigma[k][c] * volume(b, j);
        }
    }
    free(z);
}

/* ---- history ---- */

/* Displacement gradient of the step with respect to its middle. */
static void to_middle(double dt, double at, tensor L, tensor G)
{
    tensor A, middle, transposed, A_transposed, G_transposed;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            A[r][c] = dt * L[r][c];
    add_to_one(0.5 - at, A, middle);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            transposed[r][c] = middle[c][r], A_transposed[r][c] = A[c][r];
    divide(transposed, A_transposed, G_transposed);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            G[r][c] = G_transposed[c][r];
}

/* appendix C */
static void decay(reference_bonds *b, size_t k)
{
    const pd_body_options *o = &b->options;
    const double *s = b->sigma[k], mean = (s[0] + s[1] + s[2]) / 3;
    double squares = 0, D = 0;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            squares += pow(stress_component(s, r, c) - (r == c) * mean, 2);
    if (o->critical_stress > 0 && sqrt(1.5 * squares) > o->critical_stress)
        D = 1;
    if (o->failed_strain > 0 && b->plastic[k] > o->sound_strain)
        D = fmin((b->plastic[k] - o->sound_strain) / (o->failed_strain - o->sound_strain),
                 1);
    b->omega_D[k] = fmin(b->omega_D[k], 1 - D);
}

static void advance_bond(reference_bonds *b, size_t i, size_t j, double dt, double at)
{
    const size_t k = i * b->n + j;
    tensor L, G;
    double plane[9];
    if (b->omega[k] == 0)
        return;
    bond_L(b, i, j, L);
    to_middle(dt, at, L, G);
    for (int r = 0; r < b->d; r++)
        for (int c = 0; c < b->d; c++)
            plane[r * b->d + c] = G[r][c];
    b->options.material->update[b->options.plane](
        b->options.parameters, b->d, 1, plane, b->sigma[k],
        b->options.material->is_plastic ? b->plastic + k : NULL);
    decay(b, k);
}

void reference_bonds_advance(reference_bonds *b, double dt, double at)
{
    for (size_t i = 0; i < b->n; i++)
        find_L(b, i);
    for (size_t i = 0; i < b->n; i++)
        for (size_t j = 0; j < b->n; j++)
            advance_bond(b, i, j, dt, at);
    for (size_t i = 0; i < b->n; i++) {
        tensor G, before, after, step, F;
        to_middle(dt, at, b->L[i], G);
        add_to_one(-0.5, G, before);
        add_to_one(0.5, G, after);
        divide(before, after, step);
        multiply(step, b->F[i], F);
        memcpy(b->F[i], F, sizeof F);
        b->J[i] = determinant(F);
    }
}

double reference_bonds_power(reference_bonds *b)
{
    double sum = 0;
    for (size_t i = 0; i < b->n; i++)
        find_L(b, i);
    for (size_t i = 0; i < b->n; i++)
        for (size_t j = 0; j < b->n; j++) {
            const size_t k = i * b->n + j;
            tensor L;
            if (b->omega[k] == 0)
                continue;
            bond_L(b, i, j, L);
            for (int r = 0; r < 3; r++)
                for (int c = 0; c < 3; c++)
                    sum += volume(b, i) * volume(b, j) * b->omega[k] / b->omega_bar[i] *
                           stress_component(b->sigma[k], r, c) * L[r][c];
        }
    return sum;
}
