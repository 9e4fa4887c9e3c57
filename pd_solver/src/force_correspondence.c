/*
 * Non-ordinary state-based peridynamics by constitutive correspondence,
 * [silling2007], discretised as in [kim2023] eqs 24-30, with critical-stretch damage,
 * [kim2023] eqs 16-18.
 *
 * Each evaluation visits a family twice: once for F (and the bonds that break there),
 * once for the force. Per directed bond that reads an index (4 bytes) and a weight
 * (8 bytes) twice, and gathers X and y, then X and Q of the neighbour.
 *
 * The force is minus the gradient of sum_i V_i Psi(F_i) because omega beta V_i V_j and
 * the families are symmetric.
 *
 * A held part is rigid: its points bear no strain energy, and bonds into it are
 * continued as deformation.h says, so that the energy of the moving points is that of a
 * solid clamped where the hold ends.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include <stdlib.h>
#include <string.h>

#include "damage.h"
#include "deformation.h"
#include "influence.h"
#include "status.h"
#include "tensor.h"

/* ---- preparation ---- */

/* omega beta V_j of every bond, [kim2023] eqs 24 and 30; lengths are the pair's means. */
static void weigh_bonds(pd_body *b)
{
    const int d = b->options.dimension;
    for (pd_local i = 0; i < b->families.n; i++)
        for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
            const pd_local j = b->families.neighbour[k];
            double xi[3];
            subtract(d, b->X + (size_t)j * d, b->X + (size_t)i * d, xi);
            const double spacing = 0.5 * (b->spacing[i] + b->spacing[j]);
            const double horizon = b->options.horizon_ratio * spacing;
            const double length = sqrt(dot(d, xi, xi));
            b->weight[k] = bond_is_broken(b, k)
                               ? 0
                               : influence(2 * length / horizon, d) *
                                     volume_fraction(length, horizon, spacing) *
                                     b->volume[j];
        }
}

/* K^-1 of point i from the bonds that it has. */
PD_INLINE void invert_shape(const int d, pd_body *b, pd_local i)
{
    double K[9];
    shape_tensor(d, b, i, K);
    const bool sound = shape_inverse(d, K, b->K_inverse + (size_t)i * d * d);
    b->carries[i] = sound ? PD_SOUND : PD_POINT_SINGULAR;
}

PD_INLINE void shape_points(const int d, pd_body *b)
{
    for (pd_local i = 0; i < b->n_active; i++)
        invert_shape(d, b, i);
}

static pd_status prepare(pd_body *b)
{
    const size_t active = (size_t)b->n_active;
    const size_t d = (size_t)b->options.dimension;
    if (!b->weight) {
        const size_t bonds = (size_t)b->families.first[b->families.n];
        b->weight = malloc((bonds + 1) * sizeof *b->weight);
        b->K_inverse = malloc(active * d * d * sizeof *b->K_inverse);
        /* Held points bear no stress: their Q stays 0. */
        b->Q = calloc((size_t)b->n_local * d * d, sizeof *b->Q);
        b->carries = calloc(active, sizeof *b->carries);
        if (!b->weight || !b->K_inverse || !b->Q || !b->carries)
            return pd_status_fail(PD_NO_MEMORY, -1, "correspondence of %zu bonds", bonds);
    }
    weigh_bonds(b);
    if (d == 2)
        shape_points(2, b);
    else
        shape_points(3, b);
    return pd_status_ok();
}

/* ---- deformation gradients and broken bonds ---- */

/* Break the bonds of point i whose stretch exceeds s_c; did any? */
PD_INLINE bool break_bonds(const int d, const bool holds, pd_body *b, pd_local i,
                           double s_c_squared)
{
    bool any = false;
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
        double xi[3], Y[3];
        bond(d, holds, b, i, b->families.neighbour[k], xi, Y);
        if (dot(d, Y, Y) <= s_c_squared * dot(d, xi, xi))
            continue;
        if (bond_is_broken(b, k))
            continue;
        pd_damage_break(b, k);
        any = true;
    }
    return any;
}

/* F of point i, [kim2023] eq. 25; the identity where the point carries no stress. */
PD_INLINE void gradient(const int d, const bool holds, pd_body *b, pd_local i)
{
    double *F = b->F + (size_t)i * d * d;
    double sum[9] = {0};
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
        double xi[3], Y[3];
        bond(d, holds, b, i, b->families.neighbour[k], xi, Y);
        add_dyad(d, b->weight[k], Y, xi, sum);
    }
    multiply(d, sum, b->K_inverse + (size_t)i * d * d, F);
    b->J[i] = determinant(d, F);
    if (b->carries[i] != PD_POINT_SINGULAR)
        b->carries[i] = b->J[i] > PD_SMALLEST_J ? PD_SOUND : PD_POINT_INVERTED;
    if (b->carries[i] != PD_SOUND) {
        identity(d, F);
        b->J[i] = 1;
    }
}

PD_INLINE void deform_point(const int d, const bool holds, pd_body *b, pd_local i)
{
    const double s_c = b->options.critical_stretch;
    if (s_c > 0 && break_bonds(d, holds, b, i, s_c * s_c))
        invert_shape(d, b, i);
    if (i < b->n_moving)
        gradient(d, holds, b, i);
}

PD_INLINE void gradients(const int d, pd_body *b)
{
    for (pd_local i = 0; i < b->n_active; i++)
        if (beside_hold(b, i))
            deform_point(d, true, b, i);
        else
            deform_point(d, false, b, i);
}

/* ---- forces ---- */

#define BLOCK 64 /* points whose P stays in the first-level cache */

PD_INLINE void stresses(const int d, pd_body *b)
{
    double P[BLOCK * 9];
    for (pd_local start = 0; start < b->n_moving; start += BLOCK) {
        const pd_local end = start + BLOCK < b->n_moving ? start + BLOCK : b->n_moving;
        b->options.material->stress[b->options.plane](
            b->options.parameters, d, (size_t)(end - start), b->F + (size_t)start * d * d,
            b->J + start, P);
        for (pd_local i = start; i < end; i++) {
            double *Q = b->Q + (size_t)i * d * d;
            if (b->carries[i] == PD_SOUND)
                multiply(d, P + (size_t)(i - start) * d * d,
                         b->K_inverse + (size_t)i * d * d, Q);
            else
                for (int c = 0; c < d * d; c++)
                    Q[c] = 0;
        }
    }
}

/* Force density of moving point i, [kim2023] eqs 28-29. */
PD_INLINE void bond_force(const int d, const bool holds, pd_body *b, pd_local i)
{
    const double *Xi = b->X + (size_t)i * d, *Qi = b->Q + (size_t)i * d * d;
    double f[3] = {0};
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
        const pd_local j = b->families.neighbour[k];
        const double *Qj = b->Q + (size_t)j * (size_t)(d * d);
        const double w =
            holds && j >= b->n_moving ? b->weight[k] * mirror(b, i, j) : b->weight[k];
        double xi[3];
        subtract(d, b->X + (size_t)j * (size_t)d, Xi, xi);
        for (int r = 0; r < d; r++) {
            double row = 0;
            for (int c = 0; c < d; c++)
                row += (Qi[r * d + c] + Qj[r * d + c]) * xi[c];
            f[r] += w * row;
        }
    }
    for (int r = 0; r < d; r++)
        b->force[(size_t)i * d + r] = f[r];
}

PD_INLINE void all_forces(const int d, pd_body *b)
{
    gradients(d, b);
    stresses(d, b);
    for (pd_local i = 0; i < b->n_moving; i++)
        if (beside_hold(b, i))
            bond_force(d, true, b, i);
        else
            bond_force(d, false, b, i);
}

static void forces(pd_body *b)
{
    if (b->options.dimension == 2)
        all_forces(2, b);
    else
        all_forces(3, b);
}

static double energy(const pd_body *b)
{
    const int d = b->options.dimension;
    double sum = 0;
    for (pd_local i = 0; i < b->n_moving; i++)
        if (b->carries[i] == PD_SOUND)
            sum += b->volume[i] *
                   b->options.material->energy[b->options.plane](
                       b->options.parameters, d, b->F + (size_t)i * d * d, b->J[i]);
    return sum;
}

static bool accepts(const pd_material *material, int d, pd_plane plane)
{
    return material->stress[d == 2 ? plane : PD_PLANE_STRAIN];
}

/* Largest sum of absolute values in a row: no eigenvalue is beyond it. */
static double row_norm(int d, const double *A)
{
    double most = 0;
    for (int r = 0; r < d; r++) {
        double sum = 0;
        for (int c = 0; c < d; c++)
            sum += fabs(A[r * d + c]);
        most = fmax(most, sum);
    }
    return most;
}

/* s = K^-1 sum w xi, by which the displacement of point i itself enters F; returns the
 * weight of its moving neighbours. */
static double own_part(const pd_body *b, pd_local i, double *s)
{
    const int d = b->options.dimension;
    double sum[3] = {0}, weight = 0;
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
        const pd_local j = b->families.neighbour[k];
        const bool held = j >= b->n_moving;
        double xi[3];
        subtract(d, b->X + (size_t)j * d, b->X + (size_t)i * d, xi);
        weight += held ? 0 : b->weight[k];
        for (int a = 0; a < d; a++)
            sum[a] += (held ? mirror(b, i, j) : 1) * b->weight[k] * xi[a];
    }
    for (int a = 0; a < d; a++)
        s[a] = dot(d, b->K_inverse + (size_t)i * d * d + a * d, sum);
    return weight;
}

/*
 * With F_i - 1 = sum_j w u_j a_j - u_i s, a = K^-1 xi and s = K^-1 sum w xi (0 inside a
 * body), Cauchy's inequality gives for any theta > 0
 *
 *     |F_i - 1|^2 <= mu_i (sum_j w |u_j|^2 + theta |u_i|^2),   mu = |K^-1 + s s^T/theta|.
 *
 * The strain energy, at most half of M |F - 1|^2 V in waves, is so bounded by a diagonal
 * form, and omega^2 by that over rho. The best theta is |s| sqrt(sum w / |K^-1|).
 */
static void frequency(const pd_body *b, double *omega2)
{
    const int d = b->options.dimension;
    const double c = pd_body_longitudinal_speed(b);
    for (pd_local i = 0; i < b->n_moving; i++)
        omega2[i] = 0;
    for (pd_local i = 0; i < b->n_moving; i++) {
        double A[9], s[3];
        memcpy(A, b->K_inverse + (size_t)i * d * d, (size_t)(d * d) * sizeof *A);
        const double weight = own_part(b, i, s), norm = row_norm(d, A);
        const double theta = norm > 0 ? sqrt(dot(d, s, s) * weight / norm) : 0;
        if (theta > 0)
            add_dyad(d, 1 / theta, s, s, A);
        const double mu = c * c * row_norm(d, A);
        omega2[i] += theta * mu;
        for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
            const pd_local j = b->families.neighbour[k];
            if (j < b->n_moving) /* w of j's bond to i */
                omega2[j] += b->weight[k] * b->volume[i] / b->volume[j] * mu;
        }
    }
}

/* P F^T / J; in two dimensions without the stress across the plane. */
static void stress(const pd_body *b, double *sigma, double *plastic)
{
    const int d = b->options.dimension;
    const int place[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    for (pd_local i = 0; i < b->n_owned; i++) {
        if (plastic)
            plastic[i] = 0;
        if (!sigma)
            continue;
        double *s = sigma + (size_t)i * PD_SYMMETRIC, P[9];
        for (int c = 0; c < PD_SYMMETRIC; c++)
            s[c] = 0;
        if (i >= b->n_moving || b->carries[i] != PD_SOUND)
            continue;
        const double *F = b->F + (size_t)i * d * d;
        b->options.material->stress[b->options.plane](b->options.parameters, d, 1, F,
                                                      b->J + i, P);
        for (int r = 0; r < d; r++)
            for (int c = 0; c < d; c++)
                s[place[r][c]] = dot(d, P + r * d, F + c * d) / b->J[i];
    }
}

const pd_formulation pd_formulation_correspondence = {
    .name = "correspondence",
    .source = "[kim2023] eqs 12-18, 24-30",
    .corresponds = true,
    .least_dimension = 2,
    .criteria = PD_BY_STRETCH,
    .accepts = accepts,
    .prepare = prepare,
    .forces = forces,
    .energy = energy,
    .stress = stress,
    .wave_speed = pd_body_longitudinal_speed,
    .frequency = frequency,
};
