/*
 * Non-ordinary state-based peridynamics by constitutive correspondence,
 * [silling2007], discretised as in [kim2023] eqs 24-30, with critical-stretch damage,
 * [kim2023] eqs 16-18.
 *
 * On request motions that F does not see are resisted, in the manner of [silling2017]:
 * the energy of point i grows by g_i/2 sum_j w |Y - F_i xi|^2 with w = omega beta V_j and
 *
 *     g_i = zeroEnergy x shear modulus x d / tr K_i,
 *
 * so that zeroEnergy = 1 makes such a motion about as stiff as a shear of its size. Since
 * sum_j w (Y - F xi) (x) xi = 0, the force only needs Q - g F in place of Q = P K^-1, and
 * (g_i + g_j) w Y.
 *
 * Each evaluation visits a family twice: once for F (and the bonds that break there),
 * once for the force. Per directed bond that reads an index (4 bytes) and a weight
 * (8 bytes) twice, and gathers X and y, then X and Q of the neighbour.
 *
 * On a lattice (lattice.h) both visits are made in one sweep, the second a horizon behind
 * the first: y and Q of the neighbours come from a cache. Memory gives y and takes F, J
 * and the force, (2 d + d^2 + 1) doubles a point and nothing a bond.
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
#include "correspondence.h"
#include "deformation.h"
#include "influence.h"
#include "lanes.h"
#include "status.h"
#include "tensor.h"

/* ---- preparation ---- */

/* omega beta V_j, [kim2023] eqs 24 and 30; lengths are the pair's means. */
static double weight_of(const pd_body *b, double length, double spacing, double volume)
{
    const double horizon = b->options.horizon_ratio * spacing;
    return influence(2 * length / horizon, b->options.dimension) *
           volume_fraction(length, horizon, spacing) * volume;
}

static void weigh_bonds(pd_body *b)
{
    const int d = b->options.dimension;
    PD_FOR_GENERAL(b, i)
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
        const pd_local j = b->families.neighbour[k];
        double xi[3];
        subtract(d, b->X + (size_t)j * d, b->X + (size_t)i * d, xi);
        b->weight[k] =
            bond_is_broken(b, k)
                ? 0
                : weight_of(b, sqrt(dot(d, xi, xi)),
                            0.5 * (b->spacing[i] + b->spacing[j]), b->volume[j]);
    }
}

static double weight_on_lattice(const pd_body *b, pd_local i, pd_local j,
                                const pd_offset *offset, const void *context)
{
    (void)b, (void)i, (void)j, (void)context;
    return offset->weight;
}

PD_VERSIONS(pd_lattice_shapes)

static pd_status prepare_lattice(pd_body *b)
{
    pd_lattice *l = b->lattice;
    sweeps *own = b->own;
    double K[9] = {0};
    for (int k = 0; k < l->n_offsets; k++) {
        pd_offset *o = &l->offset[k];
        const double volume = pow(l->step, l->d);
        /* Bonds as long as the horizon weigh nothing, but break like others; on a lattice
         * 0 is no bond. No sum feels this instead. */
        o->weight = fmax(weight_of(b, o->length, l->step, volume), 1e-40 * volume);
        add_dyad(l->d, o->weight, o->xi, o->xi, K);
    }
    const bool sound = shape_inverse(l->d, K, own->K_inverse);
    own->g = control_of(l->d, b, K, sound);
    PD_TRY(pd_lattice_weigh(b, weight_on_lattice, NULL));
    for (int64_t m = 0; m < l->regular.first[l->planes]; m++) {
        const pd_chunk *c = &l->regular.chunk[m];
        for (int q = 0; q < c->count && chunk_is_whole(c); q++)
            b->carries[c->point + q] = sound ? PD_SOUND : PD_POINT_SINGULAR;
    }
    pd_lattice_shapes(b);
    return pd_status_ok();
}

/* Pages of regular points that nothing touches cost nothing. */
static pd_status allocate(pd_body *b)
{
    const size_t local = (size_t)b->n_local + 1, d = (size_t)b->options.dimension;
    const size_t bonds = (size_t)b->families.first[b->families.n];
    const bool controlled = b->options.formulation_parameters[ZERO_ENERGY] > 0;
    if (b->weight)
        return pd_status_ok();
    b->weight = malloc((bonds + 1) * sizeof *b->weight);
    b->K_inverse = calloc(local * d * d, sizeof *b->K_inverse);
    /* Held points bear no stress: their Q stays 0. So does that of far ghosts, which only
     * near ghosts read. */
    b->Q = calloc(local * d * d, sizeof *b->Q);
    b->carries = calloc(local, sizeof *b->carries);
    if (controlled)
        b->control = calloc(local, sizeof *b->control);
    if (!b->weight || !b->K_inverse || !b->Q || !b->carries ||
        (controlled && !b->control))
        return pd_status_fail(PD_NO_MEMORY, -1, "correspondence of %zu bonds", bonds);
    if (!b->lattice)
        return pd_status_ok();
    sweeps *own = b->own = calloc(1, sizeof *own);
    if (!own)
        return pd_status_fail(PD_NO_MEMORY, -1, "rings");
    own->moment = calloc(local * d, sizeof *own->moment);
    if (!own->moment)
        return pd_status_fail(PD_NO_MEMORY, -1, "moments of %d points", b->n_local);
    /* In space a plane of Q goes into the forces around while it is near, after what
     * breaks there is known; else, and for control, planes stay until all around are
     * there. */
    const int reach = b->lattice->reach, around = 2 * reach + 1;
    const bool spreads = d == 3, stays = controlled || !spreads;
    own->delay = spreads && pd_body_can_break(&b->options) ? reach : 0;
    if (spreads)
        PD_TRY(pd_ring_create(b->lattice, (int)d, around, &own->force));
    PD_TRY(pd_ring_create(b->lattice, (int)d,
                          around + (controlled ? reach + own->delay : 0), &own->y));
    return pd_ring_create(b->lattice, (int)(d * d) + controlled,
                          (stays ? around : 1) + own->delay, &own->Q);
}

static void release(pd_body *b)
{
    sweeps *own = b->own;
    if (own) {
        pd_ring_free(&own->y);
        pd_ring_free(&own->force);
        pd_ring_free(&own->Q);
        free(own->moment);
    }
    free(own);
}

static pd_status prepare_here(pd_body *b)
{
    PD_TRY(allocate(b));
    weigh_bonds(b);
    PD_FOR_GENERAL(b, i)
    if (b->options.dimension == 2)
        invert_shape(2, b, i);
    else
        invert_shape(3, b, i);
    return b->lattice ? prepare_lattice(b) : pd_status_ok();
}

static pd_status prepare(pd_body *b)
{
    return pd_agree(b->comm, prepare_here(b));
}

/* ---- deformation gradients and broken bonds ---- */

/* Break the bonds of point i whose stretch exceeds s_c; did any? */
PD_INLINE bool break_bonds(const int d, const bool holds, pd_body *b, pd_local i)
{
    bool any = false;
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
        double xi[3], Y[3];
        const pd_local j = b->families.neighbour[k];
        bond(d, holds, b, i, j, xi, Y);
        const double s_c = pd_body_critical_stretch(b, i, j);
        if (dot(d, Y, Y) <= s_c * s_c * dot(d, xi, xi))
            continue;
        if (bond_is_broken(b, k) || bond_is_protected(b, i, j))
            continue;
        pd_damage_break(b, k);
        any = true;
    }
    return any;
}

PD_INLINE void gradient(const int d, const bool holds, pd_body *b, pd_local i)
{
    double sum[9] = {0};
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
        double xi[3], Y[3];
        bond(d, holds, b, i, b->families.neighbour[k], xi, Y);
        add_dyad(d, b->weight[k], Y, xi, sum);
    }
    keep_gradient(d, b, i, sum, b->K_inverse + (size_t)i * d * d);
}

PD_INLINE void deform_point(const int d, const bool holds, pd_body *b, pd_local i)
{
    if (pd_body_can_break(&b->options) && break_bonds(d, holds, b, i))
        invert_shape(d, b, i);
    if (!is_held(b, i))
        gradient(d, holds, b, i);
}

PD_INLINE void deform(const int d, pd_body *b, pd_local i)
{
    if (beside_hold(b, i))
        deform_point(d, true, b, i);
    else
        deform_point(d, false, b, i);
}

/* While ghosts are on their way, those of the points that need none. */
PD_INLINE void gradients(const int d, pd_body *b)
{
    const bool waits = pd_halo_is_under_way(b->halo);
    if (next_general(b, b->n_regular - 1) == b->n_local)
        return; /* the lattice may wait yet */
    for (pd_local i = b->n_regular; waits && i < b->n_active; i++)
        if (!family_has_ghosts(b, i))
            deform(d, b, i);
    pd_halo_end(b->halo);
    PD_FOR_GENERAL(b, i)
    if (!waits || family_has_ghosts(b, i) || i >= b->n_owned)
        deform(d, b, i);
}

/* ---- forces ---- */

/* Turn [n][d * d] into [d * d][n]. */
PD_INLINE void points_last(const int d, size_t n, const double *from, double *to)
{
    for (size_t p = 0; p < n; p++)
        for (size_t c = 0; c < (size_t)(d * d); c++)
            to[c * n + p] = from[p * (size_t)(d * d) + c];
}

/* Q of points [from, to). */
PD_INLINE void stresses(const int d, pd_body *b, pd_local from, pd_local to)
{
    double F[PD_BLOCK * 9], P[PD_BLOCK * 9];
    for (pd_local start = from; start < to; start += PD_BLOCK) {
        const pd_local left = to - start, n = left < PD_BLOCK ? left : PD_BLOCK;
        points_last(d, (size_t)n, b->F + (size_t)start * d * d, F);
        stress_points(d, b, (size_t)n, F, b->J + start, P);
        for (pd_local q = 0; q < n; q++) {
            const pd_local i = start + q;
            double Pi[9];
            for (int c = 0; c < d * d; c++)
                Pi[c] = P[c * n + q];
            keep_Q(d, b, i, Pi, b->K_inverse + (size_t)i * d * d,
                   b->control ? b->control[i] : 0, b->Q + (size_t)i * d * d);
        }
    }
}

/* f += sum_j w (g_i + g_j) Y. */
PD_INLINE void control_force(const int d, const bool holds, const pd_body *b, pd_local i,
                             double *f)
{
    const double g_i = control_now(b, i);
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
        const pd_local j = b->families.neighbour[k];
        double xi[3], Y[3];
        bond(d, holds, b, i, j, xi, Y);
        double w = b->weight[k] * (g_i + control_now(b, j));
        if (holds && is_held(b, j))
            w *= mirror(b, i, j);
        for (int c = 0; c < d; c++)
            f[c] += w * Y[c];
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
            holds && is_held(b, j) ? b->weight[k] * mirror(b, i, j) : b->weight[k];
        double xi[3];
        subtract(d, b->X + (size_t)j * (size_t)d, Xi, xi);
        for (int r = 0; r < d; r++) {
            double row = 0;
            for (int c = 0; c < d; c++)
                row += (Qi[r * d + c] + Qj[r * d + c]) * xi[c];
            f[r] += w * row;
        }
    }
    if (b->control)
        control_force(d, holds, b, i, f);
    for (int r = 0; r < d; r++)
        b->force[(size_t)i * d + r] = f[r];
}

PD_INLINE void bond_forces(const int d, pd_body *b)
{
    for (pd_local i = b->n_regular; i < b->n_moving; i++)
        if (beside_hold(b, i))
            bond_force(d, true, b, i);
        else
            bond_force(d, false, b, i);
}

PD_VERSIONS(pd_lattice_correspondence)

/* ---- all of it ---- */

PD_INLINE void all_forces(const int d, pd_body *b)
{
    gradients(d, b);
    stresses(d, b, b->n_regular, b->n_moving);
    stresses(d, b, b->near.regular, b->near.moving);
    if (b->lattice)
        pd_lattice_correspondence(b);
    bond_forces(d, b);
    pd_halo_end(b->halo); /* where nothing needed a ghost */
}

static void forces(pd_body *b)
{
    if (b->options.dimension == 2)
        all_forces(2, b);
    else
        all_forces(3, b);
}

/* ---- what else the table asks ---- */

/* g of any moving point, wherever it is kept. */
static double control_at(const pd_body *b, pd_local i)
{
    if (is_regular(b, i) && chunk_is_whole(pd_lattice_chunk(b, i)))
        return ((const sweeps *)b->own)->g;
    return b->control[i];
}

/* sum_j w |Y - F xi|^2 of point i. */
static double unseen(const pd_body *b, pd_local i)
{
    const int d = b->options.dimension;
    const double *F = b->F + (size_t)i * d * d;
    double sum = 0;
    pd_family family;
    family_of(b, i, &family);
    for (pd_local k = 0; k < family.count; k++) {
        double xi[3], z[3];
        bond(d, b->hold_distance, b, i, family.neighbour[k], xi, z);
        for (int r = 0; r < d; r++)
            z[r] -= dot(d, F + r * d, xi);
        sum += family_weight(b, i, &family, k) * dot(d, z, z);
    }
    return sum;
}

static double energy(const pd_body *b)
{
    const int d = b->options.dimension;
    double sum = 0;
    for (pd_local i = 0; i < b->n_moving; i++) {
        if (b->carries[i] != PD_SOUND)
            continue;
        const double *F = b->F + (size_t)i * d * d;
        sum += b->volume[i] * b->options.material->energy[b->options.plane](
                                  b->options.parameters, d, F, b->J[i]);
        if (b->control)
            sum += b->volume[i] * control_at(b, i) / 2 * unseen(b, i);
    }
    return sum;
}

/* K^-1 of any moving point, wherever it is kept. */
static const double *shape_at(const pd_body *b, pd_local i)
{
    const size_t d = (size_t)b->options.dimension;
    if (is_regular(b, i) && chunk_is_whole(pd_lattice_chunk(b, i)))
        return ((const sweeps *)b->own)->K_inverse;
    return b->K_inverse + (size_t)i * d * d;
}

static bool accepts(const pd_material *material, int d, pd_plane plane)
{
    return material->stress[d == 2 ? plane : PD_PLANE_STRAIN];
}

/* ---- frequency ----
 *
 * With F_i - 1 = sum_j w u_j a_j - u_i s, a = K^-1 xi and s = K^-1 sum w xi (0 inside a
 * body), Cauchy's inequality gives for any theta > 0
 *
 *     |F_i - 1|^2 <= mu_i (sum_j w |u_j|^2 + theta |u_i|^2),   mu = |K^-1 + s s^T/theta|.
 *
 * The strain energy, at most half of M |F - 1|^2 V in waves, is so bounded by a diagonal
 * form, and omega^2 by that over rho. The best theta is |s| sqrt(sum w / |K^-1|).
 * Zero-energy control has at most the energy g/2 sum_j w |u_j - u_i|^2 V, and
 * |u_j - u_i|^2 <= 2 |u_j|^2 + 2 |u_i|^2. */

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

/* What point i's own displacement enters F and the control with. */
typedef struct {
    double s[3];
    double moving; /* sum of w of bonds to moving points */
    double held;   /* sum of w mirror^2 of the others */
} own_part;

static own_part own_part_of(const pd_body *b, pd_local i, const pd_family *family,
                            const double *K_inverse)
{
    const int d = b->options.dimension;
    double sum[3] = {0};
    own_part own = {.moving = 0};
    for (pd_local k = 0; k < family->count; k++) {
        const pd_local j = family->neighbour[k];
        const double w = family_weight(b, i, family, k);
        const bool held = is_held(b, j);
        const double part = held ? mirror(b, i, j) : 1;
        double xi[3];
        subtract(d, b->X + (size_t)j * d, b->X + (size_t)i * d, xi);
        own.moving += held ? 0 : w;
        own.held += held ? w * part * part : 0;
        for (int a = 0; a < d; a++)
            sum[a] += w * part * xi[a];
    }
    for (int a = 0; a < d; a++)
        own.s[a] = dot(d, K_inverse + a * d, sum);
    return own;
}

/* Add the bounds that the energy of point i gives, over rho. */
static void bound_energy(const pd_body *b, pd_local i, const double *K_inverse,
                         double *omega2)
{
    const int d = b->options.dimension;
    const double c = pd_body_longitudinal_speed(b);
    const double g = b->control ? 2 * control_at(b, i) / b->options.density : 0;
    pd_family family;
    family_of(b, i, &family);
    const own_part own = own_part_of(b, i, &family, K_inverse);
    double A[9];
    memcpy(A, K_inverse, (size_t)(d * d) * sizeof *A);
    const double norm = row_norm(d, A);
    const double theta = norm > 0 ? sqrt(dot(d, own.s, own.s) * own.moving / norm) : 0;
    if (theta > 0)
        add_dyad(d, 1 / theta, own.s, own.s, A);
    const double mu = c * c * row_norm(d, A);
    omega2[i] += theta * mu + g * (own.moving + own.held / 2);
    for (pd_local k = 0; k < family.count; k++) {
        const pd_local j = family.neighbour[k];
        if (!is_held(b, j)) /* w of j's bond to i */
            omega2[j] +=
                family_weight(b, i, &family, k) * b->volume[i] / b->volume[j] * (mu + g);
    }
}

static void frequency(const pd_body *b, double *omega2)
{
    memset(omega2, 0, (size_t)b->n_local * sizeof *omega2);
    for (pd_local i = 0; i < b->n_moving; i++)
        bound_energy(b, i, shape_at(b, i), omega2);
    pd_halo_sum(b->halo, omega2, 1);
}

/* P F^T / J of point i; in two dimensions J counts the thickness. */
static void cauchy_stress(const pd_body *b, pd_local i, double *s)
{
    const int d = b->options.dimension;
    const int place[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    const pd_material *material = b->options.material;
    const double *parameters = b->options.parameters, *F = b->F + (size_t)i * d * d;
    const bool thins = d == 2 && b->options.plane == PD_PLANE_STRESS;
    const double J =
        thins ? b->J[i] * material->thickness(parameters, F, b->J[i]) : b->J[i];
    double P[9];
    material->stress[b->options.plane](parameters, d, 1, F, b->J + i, P);
    for (int r = 0; r < d; r++)
        for (int c = 0; c < d; c++)
            s[place[r][c]] = dot(d, P + r * d, F + c * d) / J;
    if (d == 2 && !thins)
        s[2] = material->out_of_plane(parameters, F, b->J[i]);
}

static void stress(const pd_body *b, double *sigma, double *plastic)
{
    for (pd_local i = 0; i < b->n_owned; i++) {
        if (plastic)
            plastic[i] = 0;
        if (!sigma)
            continue;
        double *s = sigma + (size_t)i * PD_SYMMETRIC;
        for (int c = 0; c < PD_SYMMETRIC; c++)
            s[c] = 0;
        if (i < b->n_moving && b->carries[i] == PD_SOUND)
            cauchy_stress(b, i, s);
    }
}

static const pd_parameter parameters[] = {
    [ZERO_ENERGY] = {.key = "zeroEnergy",
                     .unit = "-",
                     .above = 0,
                     .below = HUGE_VAL,
                     .includes_above = true,
                     .meaning = "stiffness against motions that F does not see",
                     .optional = true,
                     .standard = 0},
};

const pd_formulation pd_formulation_correspondence = {
    .name = "correspondence",
    .source = "[kim2023] eqs 12-18, 24-30",
    .corresponds = true,
    .least_dimension = 2,
    .ghost_layers = 2,
    .has_lattice_path = true,
    .criteria = PD_BY_STRETCH,
    .accepts = accepts,
    .n_parameters = sizeof parameters / sizeof *parameters,
    .parameters = parameters,
    .prepare = prepare,
    .release = release,
    .forces = forces,
    .energy = energy,
    .stress = stress,
    .wave_speed = pd_body_longitudinal_speed,
    .frequency = frequency,
};
