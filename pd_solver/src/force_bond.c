/*
 * Bond-based peridynamics, [han2025] eqs 9-18 and 28: f = c s along the deformed bond,
 * with volume correction, energy-based surface correction and critical-stretch damage.
 *
 * With a = c beta nu V_j the force of a bond is
 *
 *     a s Y/|Y| = a (1/|xi| - 1/|Y|) Y,    s = |Y|/|xi| - 1,
 *
 * which needs one reciprocal root. A family is visited once. Per directed bond that reads
 * an index (4 bytes), a and |xi| (8 bytes each), and gathers y of the neighbour.
 *
 * A bond into a hold is continued as deformation.h says; held points bear no strain
 * energy, so that a moving point has its own half of the bond's energy only.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include <math.h>
#include <stdlib.h>

#include "damage.h"
#include "deformation.h"
#include "influence.h"
#include "status.h"
#include "tensor.h"

enum { SURFACE_CORRECTION }; /* of formulation_parameters */

static const double pi = 3.14159265358979323846;

/* ---- constants ---- */

/* Micromodulus c, [han2025] eq. 15 for a unit of thickness or section, N/m6. In one
 * dimension the energy of a uniform stretch, c s^2 horizon^2 / 4 = E s^2 / 2, leaves no
 * pi, which the paper prints. */
static double micromodulus(const pd_body_options *o, double horizon)
{
    const double E = o->parameters[0];
    if (o->dimension == 1)
        return 2 * E / (horizon * horizon);
    if (o->dimension == 3)
        return 12 * E / (pi * pow(horizon, 4));
    const double c = o->plane == PD_PLANE_STRESS ? 9. : 48. / 5;
    return c * E / (pi * pow(horizon, 3));
}

/* Modulus of a uniaxial strain, twice its energy density, Pa. */
static double uniaxial_modulus(const pd_body *b)
{
    const double c = pd_body_longitudinal_speed(b);
    return b->options.density * c * c;
}

/* ---- preparation ---- */

/* Bond k of point i: direction n, length |xi| and a without the surface correction. */
static double plain_weight(const pd_body *b, pd_local i, int64_t k, double *n,
                           double *length)
{
    const int d = b->options.dimension;
    const pd_local j = b->families.neighbour[k];
    subtract(d, b->X + (size_t)j * d, b->X + (size_t)i * d, n);
    *length = sqrt(dot(d, n, n));
    for (int c = 0; c < d; c++)
        n[c] /= *length;
    const double spacing = 0.5 * (b->spacing[i] + b->spacing[j]);
    const double horizon = b->options.horizon_ratio * spacing;
    return micromodulus(&b->options, horizon) *
           volume_fraction(*length, horizon, spacing) * b->volume[j];
}

/* By how much the energy density of point i under a uniaxial strain along each axis falls
 * short of the material's: g[d], the energy-based surface correction [madenci2014]. Bonds
 * count that a crack has cut: the correction is for surfaces of the reference shape. */
static void surface_factors(const pd_body *b, pd_local i, double *g)
{
    const int d = b->options.dimension;
    double twice_energy[3] = {0};
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
        double n[3], length;
        const double a = plain_weight(b, i, k, n, &length);
        for (int c = 0; c < d; c++)
            twice_energy[c] += a / 2 * length * pow(n[c], 4);
    }
    /* A family without a bond towards some axis has nothing to correct there. */
    for (int c = 0; c < d; c++)
        g[c] = twice_energy[c] > 0 ? uniaxial_modulus(b) / twice_energy[c] : 1;
}

/* Factor of a bond along n between points of factors g and h. */
static double surface_correction(int d, const double *n, const double *g, const double *h)
{
    double sum = 0;
    for (int c = 0; c < d; c++) {
        const double part = 2 * n[c] / (g[c] + h[c]);
        sum += part * part;
    }
    return 1 / sqrt(sum);
}

static void weigh_bonds(pd_body *b, const double *factors)
{
    const int d = b->options.dimension;
    for (pd_local i = 0; i < b->families.n; i++)
        for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
            const pd_local j = b->families.neighbour[k];
            double n[3];
            double a = plain_weight(b, i, k, n, &b->length[k]);
            if (factors && j < b->n_active)
                a *= surface_correction(d, n, factors + (size_t)i * d,
                                        factors + (size_t)j * d);
            b->weight[k] = bond_is_broken(b, k) ? 0 : a;
        }
}

static pd_status prepare(pd_body *b)
{
    const int d = b->options.dimension;
    const size_t bonds = (size_t)b->families.first[b->families.n];
    if (!b->weight) {
        b->weight = malloc((bonds + 1) * sizeof *b->weight);
        b->length = malloc((bonds + 1) * sizeof *b->length);
        if (!b->weight || !b->length)
            return pd_status_fail(PD_NO_MEMORY, -1, "%zu bonds", bonds);
    }
    double *factors = NULL;
    if (b->options.formulation_parameters[SURFACE_CORRECTION] != 0) {
        factors = malloc((size_t)b->n_active * (size_t)d * sizeof *factors);
        if (!factors)
            return pd_status_fail(PD_NO_MEMORY, -1, "%d points", b->n_active);
        for (pd_local i = 0; i < b->n_active; i++)
            surface_factors(b, i, factors + (size_t)i * d);
    }
    weigh_bonds(b, factors);
    free(factors);
    return pd_status_ok();
}

/* ---- forces ---- */

/* Break the bonds of point i that are longer than s_c |xi|. */
PD_INLINE void break_bonds(const int d, const bool holds, pd_body *b, pd_local i)
{
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
        const pd_local j = b->families.neighbour[k];
        double xi[3], Y[3];
        bond(d, holds, b, i, j, xi, Y);
        const double longest = pd_body_critical_stretch(b, i, j) * b->length[k];
        if (dot(d, Y, Y) > longest * longest && !bond_is_protected(b, i, j) &&
            !bond_is_broken(b, k))
            pd_damage_break(b, k);
    }
}

/* Force density of moving point i, [han2025] eqs 28-29. */
PD_INLINE void bond_force(const int d, const bool holds, pd_body *b, pd_local i)
{
    double f[3] = {0};
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
        const pd_local j = b->families.neighbour[k];
        double xi[3], Y[3];
        bond(d, holds, b, i, j, xi, Y);
        const double square = dot(d, Y, Y);
        /* Two points in one place pull each other nowhere. */
        const double inverse = square > 0 ? 1 / sqrt(square) : 0;
        double t = b->weight[k] * (1 / b->length[k] - inverse);
        if (holds && j >= b->n_moving)
            t *= 0.5 * mirror(b, i, j);
        for (int c = 0; c < d; c++)
            f[c] += t * Y[c];
    }
    for (int c = 0; c < d; c++)
        b->force[(size_t)i * d + c] = f[c];
}

PD_INLINE void all_forces(const int d, pd_body *b)
{
    if (pd_body_can_break(&b->options))
        for (pd_local i = 0; i < b->n_active; i++)
            break_bonds(d, true, b, i);
    for (pd_local i = 0; i < b->n_moving; i++)
        if (beside_hold(b, i))
            bond_force(d, true, b, i);
        else
            bond_force(d, false, b, i);
}

static void forces(pd_body *b)
{
    if (b->options.dimension == 1)
        all_forces(1, b);
    else if (b->options.dimension == 2)
        all_forces(2, b);
    else
        all_forces(3, b);
}

/* ---- what else the table asks ---- */

/* Half of c s^2 |xi| / 2 of every bond is each end's. */
static double energy(const pd_body *b)
{
    const int d = b->options.dimension;
    double sum = 0;
    for (pd_local i = 0; i < b->n_moving; i++)
        for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
            double xi[3], Y[3];
            bond(d, b->hold_distance, b, i, b->families.neighbour[k], xi, Y);
            const double s = sqrt(dot(d, Y, Y)) / b->length[k] - 1;
            sum += b->volume[i] * b->weight[k] * s * s * b->length[k] / 4;
        }
    return sum;
}

/* The virial of each point: half of force (x) bond, summed; 33 from no bond. */
static void stress(const pd_body *b, double *sigma, double *plastic)
{
    const int d = b->options.dimension;
    const int place[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    for (pd_local i = 0; i < b->n_owned; i++) {
        if (plastic)
            plastic[i] = 0;
        if (!sigma)
            continue;
        double *s = sigma + (size_t)i * PD_SYMMETRIC;
        for (int c = 0; c < PD_SYMMETRIC; c++)
            s[c] = 0;
        if (i >= b->n_moving)
            continue;
        for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
            double xi[3], Y[3];
            bond(d, b->hold_distance, b, i, b->families.neighbour[k], xi, Y);
            const double square = dot(d, Y, Y);
            const double inverse = square > 0 ? 1 / sqrt(square) : 0;
            const double t = b->weight[k] / 2 * (1 / b->length[k] - inverse);
            for (int r = 0; r < d; r++)
                for (int c = r; c < d; c++)
                    s[place[r][c]] += t * Y[r] * Y[c];
        }
    }
}

/* At rest a bond has the stiffness a n (x) n / |xi|; the row of point i sums to at most
 * twice its diagonal. */
static void frequency(const pd_body *b, double *omega2)
{
    for (pd_local i = 0; i < b->n_moving; i++) {
        double sum = 0;
        for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++)
            sum += b->weight[k] / b->length[k];
        omega2[i] = 2 * sum / b->options.density;
    }
}

/* Its bonds know no more than Young's modulus. */
static bool accepts(const pd_material *material, int d, pd_plane plane)
{
    (void)d, (void)plane;
    return !material->stress[PD_PLANE_STRAIN] && !material->update[PD_PLANE_STRAIN];
}

static const pd_parameter parameters[] = {
    [SURFACE_CORRECTION] = {.key = "surfaceCorrection",
                            .unit = "-",
                            .above = 0,
                            .below = 2,
                            .includes_above = true,
                            .meaning = "energy-based correction of bonds near surfaces",
                            .kind = PD_FLAG,
                            .optional = true,
                            .standard = 1},
};

const pd_formulation pd_formulation_bond = {
    .name = "bond",
    .source = "[han2025] eqs 9-18, 28-30",
    .least_dimension = 1,
    .criteria = PD_BY_STRETCH,
    .n_parameters = sizeof parameters / sizeof *parameters,
    .parameters = parameters,
    .accepts = accepts,
    .prepare = prepare,
    .forces = forces,
    .energy = energy,
    .stress = stress,
    .wave_speed = pd_body_longitudinal_speed,
    .frequency = frequency,
};
