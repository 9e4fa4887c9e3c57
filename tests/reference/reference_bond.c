/*
 * All-pairs bond-based peridynamics, [han2025] eqs 9-18, 28 and 29.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "reference_bond.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bond_reference *bond_reference_create(int d, size_t n, const double *X, const double *V)
{
    bond_reference *b = calloc(1, sizeof *b);
    if (!b)
        return NULL;
    b->d = d;
    b->n = n;
    b->X = calloc(n, sizeof *b->X);
    b->V = calloc(n, sizeof *b->V);
    b->y = calloc(n, sizeof *b->y);
    b->held = calloc(n, sizeof *b->held);
    b->safe = calloc(n, sizeof *b->safe);
    b->lambda = calloc(n * n, sizeof *b->lambda);
    b->f = calloc(n, sizeof *b->f);
    b->stress = calloc(n, sizeof *b->stress);
    b->phi = calloc(n, sizeof *b->phi);
    b->hold = calloc(n, sizeof *b->hold);
    b->g = calloc(n, sizeof *b->g);
    if (!b->X || !b->V || !b->y || !b->held || !b->safe || !b->lambda || !b->f ||
        !b->stress || !b->phi || !b->hold || !b->g) {
        bond_reference_free(b);
        return NULL;
    }
    memcpy(b->X, X, n * sizeof *b->X);
    memcpy(b->y, X, n * sizeof *b->y);
    memcpy(b->V, V, n * sizeof *b->V);
    for (size_t k = 0; k < n * n; k++)
        b->lambda[k] = 1;
    return b;
}

void bond_reference_free(bond_reference *b)
{
    if (!b)
        return;
    free(b->X);
    free(b->V);
    free(b->y);
    free(b->held);
    free(b->safe);
    free(b->lambda);
    free(b->f);
    free(b->stress);
    free(b->phi);
    free(b->hold);
    free(b->g);
    free(b);
}

/* ---- a pair of points ---- */

static double length_of(const double *v)
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static double distance(const bond_reference *b, size_t i, size_t j)
{
    const double xi[3] = {b->X[j][0] - b->X[i][0], b->X[j][1] - b->X[i][1],
                          b->X[j][2] - b->X[i][2]};
    return length_of(xi);
}

static double spacing_of(const bond_reference *b, size_t i)
{
    return pow(b->V[i], 1. / b->d);
}

/* The paper has one Delta x; where volumes differ a pair takes the mean of both. */
static double mean_spacing(const bond_reference *b, size_t i, size_t j)
{
    return (spacing_of(b, i) + spacing_of(b, j)) / 2;
}

static double horizon_of(const bond_reference *b, size_t i, size_t j)
{
    return b->horizon_ratio * mean_spacing(b, i, j);
}

/* eq. 10 */
static int in_family(const bond_reference *b, size_t i, size_t j)
{
    return i != j && distance(b, i, j) <= horizon_of(b, i, j);
}

/* eq. 15, A = h = 1 */
static double micromodulus(const bond_reference *b, double delta)
{
    const double pi = acos(-1);
    switch (b->d) {
    case 1:
        return 2 * b->E / pow(delta, 2);
    case 2:
        return b->plane_stress ? 9 * b->E / (pi * pow(delta, 3))
                               : 48 * b->E / (5 * pi * pow(delta, 3));
    default:
        return 12 * b->E / (pi * pow(delta, 4));
    }
}

/* Volume correction, nu of eq. 28: the part of the cell of j, a spacing wide, that is
 * nearer than the horizon. */
static double volume_correction(const bond_reference *b, size_t i, size_t j)
{
    const double dx = mean_spacing(b, i, j);
    const double inside = (horizon_of(b, i, j) - (distance(b, i, j) - dx / 2)) / dx;
    return fmin(1, inside);
}

/* ---- surface correction, beta of eq. 28 ---- */

/* Energy density of a unit strain along one axis, none along the others: half the
 * modulus. Poisson's ratio is 1/3 in plane stress, else 1/4. */
static double energy_of_material(const bond_reference *b)
{
    if (b->d == 1)
        return b->E / 2;
    if (b->d == 2 && b->plane_stress)
        return b->E / (1 - 1. / 9) / 2;
    return b->E * (1 - 0.25) / ((1 + 0.25) * (1 - 2 * 0.25)) / 2;
}

/* The same as the family of i adds it up: half of each bond's c s^2 |xi| / 2. Cracks are
 * not surfaces of the body as it was made. */
static double energy_of_family(const bond_reference *b, size_t i, int axis)
{
    double W = 0;
    for (size_t j = 0; j < b->n; j++) {
        if (!in_family(b, i, j))
            continue;
        const double xi = distance(b, i, j);
        const double s = pow((b->X[j][axis] - b->X[i][axis]) / xi, 2);
        W += micromodulus(b, horizon_of(b, i, j)) * s * s * xi / 2 / 2 *
             volume_correction(b, i, j) * b->V[j];
    }
    return W;
}

/* An ellipsoid of the mean factors of both ends, met in the direction of the bond. */
static double surface_correction(const bond_reference *b, size_t i, size_t j)
{
    if (!b->surface_correction)
        return 1;
    double sum = 0;
    for (int a = 0; a < b->d; a++) {
        const double n = (b->X[j][a] - b->X[i][a]) / distance(b, i, j);
        sum += pow(n / ((b->g[i][a] + b->g[j][a]) / 2), 2);
    }
    return sqrt(1 / sum);
}

/* c beta nu V_j */
static double weight_of(const bond_reference *b, size_t i, size_t j)
{
    return micromodulus(b, horizon_of(b, i, j)) * surface_correction(b, i, j) *
           volume_correction(b, i, j) * b->V[j];
}

/* ---- holds ---- */

/* A hold ends half a spacing before its nearest point. */
static double distance_to_hold(const bond_reference *b, size_t i)
{
    double nearest = INFINITY;
    for (size_t j = 0; j < b->n; j++)
        if (in_family(b, i, j) && b->held[i] != b->held[j])
            nearest = fmin(nearest, distance(b, i, j) - spacing_of(b, j) / 2);
    return nearest == INFINITY ? 0 : fmax(nearest, spacing_of(b, i) / 10);
}

/* How much more than the displacement of i its bond into the hold is stretched: a line
 * through zero where the hold ends. */
static double mirror(const bond_reference *b, size_t i, size_t j)
{
    return (b->hold[i] + b->hold[j]) / b->hold[i];
}

/* xi + eta */
static void deformed_bond(const bond_reference *b, size_t i, size_t j, double *Y)
{
    for (int a = 0; a < 3; a++) {
        const double xi = b->X[j][a] - b->X[i][a];
        const double u_i = b->y[i][a] - b->X[i][a], u_j = b->y[j][a] - b->X[j][a];
        Y[a] = xi + u_j - u_i;
        if (!b->held[i] && b->held[j])
            Y[a] = xi - mirror(b, i, j) * u_i;
        if (b->held[i] && !b->held[j])
            Y[a] = xi + mirror(b, j, i) * u_j;
    }
}

/* ---- damage ---- */

/* eq. 18; the bulk modulus is that of the plane in two dimensions. */
static double critical_stretch(const bond_reference *b, size_t i, size_t j)
{
    const double pi = acos(-1), delta = horizon_of(b, i, j);
    if (b->critical_stretch > 0)
        return b->critical_stretch - 1;
    if (b->energy_release == 0)
        return INFINITY;
    if (b->d == 3)
        return sqrt(5 * b->energy_release / (9 * (b->E / (3 * (1 - 2 * 0.25))) * delta));
    const double k = b->plane_stress ? b->E / (2 * (1 - 1. / 3))
                                     : b->E / (2 * (1 + 0.25) * (1 - 2 * 0.25));
    return sqrt(pi * b->energy_release / (3 * k * delta));
}

/* eqs 13 and 17 */
static void break_bonds(bond_reference *b)
{
    for (size_t i = 0; i < b->n; i++)
        for (size_t j = 0; j < b->n; j++) {
            if (!in_family(b, i, j) || b->safe[i] || b->safe[j])
                continue;
            double Y[3];
            deformed_bond(b, i, j, Y);
            const double s = length_of(Y) / distance(b, i, j) - 1;
            if (s > critical_stretch(b, i, j))
                b->lambda[i * b->n + j] = 0;
        }
}

static double local_damage(const bond_reference *b, size_t i)
{
    double intact = 0, all = 0;
    for (size_t j = 0; j < b->n; j++) {
        if (!in_family(b, i, j))
            continue;
        intact += b->lambda[i * b->n + j] * b->V[j];
        all += b->V[j];
    }
    return all > 0 ? 1 - intact / all : 0;
}

/* ---- a body ---- */

/* eqs 12, 13, 28 and 29. Of a bond into a hold, half is the moving end's: its own half of
 * the energy, and the derivative of that. */
static void add_bond(bond_reference *b, size_t i, size_t j)
{
    double Y[3];
    deformed_bond(b, i, j, Y);
    const double xi = distance(b, i, j), length = length_of(Y), s = length / xi - 1;
    const double t = b->lambda[i * b->n + j] * weight_of(b, i, j) * s;
    const double share = b->held[j] ? mirror(b, i, j) / 2 : 1;
    b->energy += b->V[i] * t * s * xi / 4;
    if (length == 0)
        return;
    for (int r = 0; r < 3; r++) {
        b->f[i][r] += share * t * Y[r] / length;
        for (int c = 0; c < 3; c++)
            b->stress[i][r][c] += t * Y[r] / length * Y[c] / 2;
    }
}

void bond_reference_forces(bond_reference *b)
{
    for (size_t i = 0; i < b->n; i++) {
        b->hold[i] = distance_to_hold(b, i);
        for (int a = 0; a < b->d; a++) {
            const double W = energy_of_family(b, i, a);
            b->g[i][a] = W > 0 ? energy_of_material(b) / W : 1;
        }
    }
    break_bonds(b);
    memset(b->f, 0, b->n * sizeof *b->f);
    memset(b->stress, 0, b->n * sizeof *b->stress);
    b->energy = 0;
    for (size_t i = 0; i < b->n; i++) {
        b->phi[i] = local_damage(b, i);
        for (size_t j = 0; j < b->n; j++)
            if (!b->held[i] && in_family(b, i, j))
                add_bond(b, i, j);
    }
}
