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
#include "deformation.h"
#include "influence.h"
#include "lanes.h"
#include "status.h"
#include "tensor.h"

enum { ZERO_ENERGY }; /* of formulation_parameters */

/* What a lattice needs besides. */
typedef struct {
    pd_ring y, Q;        /* Q: [d][d], then g where there is zero-energy control */
    double K_inverse[9]; /* of a point with nothing missing around; with it */
    double g;
} sweeps;

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
    for (pd_local i = b->n_regular; i < b->n_active; i++)
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

/* g of a point; K may be singular, then it bears nothing. */
PD_INLINE double control_of(const int d, const pd_body *b, const double *K, bool sound)
{
    double bulk, shear;
    b->options.material->moduli(b->options.parameters, &bulk, &shear);
    const double coefficient = b->options.formulation_parameters[ZERO_ENERGY];
    return sound ? coefficient * shear * d / trace(d, K) : 0;
}

/* K^-1 and g of point i from its K. */
PD_INLINE void keep_shape(const int d, pd_body *b, pd_local i, const double *K)
{
    const bool sound = shape_inverse(d, K, b->K_inverse + (size_t)i * d * d);
    b->carries[i] = sound ? PD_SOUND : PD_POINT_SINGULAR;
    if (b->control)
        b->control[i] = control_of(d, b, K, sound);
}

/* K^-1 of point i from the bonds that it has. */
PD_INLINE void invert_shape(const int d, pd_body *b, pd_local i)
{
    double K[9];
    shape_tensor(d, b, i, K);
    keep_shape(d, b, i, K);
}

/* The same for a lane of a chunk that has weights of its own. */
static void invert_lane(pd_body *b, const pd_chunk *c, int q)
{
    const pd_lattice *l = b->lattice;
    double K[9] = {0};
    for (int k = 0; k < l->n_offsets; k++)
        add_dyad(l->d, c->weight[k * PD_LANES + q], l->offset[k].xi, l->offset[k].xi, K);
    keep_shape(l->d, b, c->point + q, K);
}

static double weight_on_lattice(const pd_body *b, pd_local i, pd_local j,
                                const pd_offset *offset, const void *context)
{
    (void)b, (void)i, (void)j, (void)context;
    return offset->weight;
}

static pd_status prepare_lattice(pd_body *b)
{
    pd_lattice *l = b->lattice;
    sweeps *own = b->own;
    double K[9] = {0};
    for (int k = 0; k < l->n_offsets; k++) {
        pd_offset *o = &l->offset[k];
        o->weight = weight_of(b, o->length, l->step, pow(l->step, l->d));
        add_dyad(l->d, o->weight, o->xi, o->xi, K);
    }
    const bool sound = shape_inverse(l->d, K, own->K_inverse);
    own->g = control_of(l->d, b, K, sound);
    PD_TRY(pd_lattice_weigh(b, weight_on_lattice, NULL));
    for (int64_t m = 0; m < l->regular.first[l->planes]; m++) {
        const pd_chunk *c = &l->regular.chunk[m];
        for (int q = 0; q < c->count; q++)
            if (c->weight)
                invert_lane(b, c, q);
            else
                b->carries[c->point + q] = sound ? PD_SOUND : PD_POINT_SINGULAR;
    }
    return pd_status_ok();
}

/* Pages of regular points that nothing touches cost nothing. */
static pd_status allocate(pd_body *b)
{
    const size_t active = (size_t)b->n_active, d = (size_t)b->options.dimension;
    const size_t bonds = (size_t)b->families.first[b->families.n];
    const bool controlled = b->options.formulation_parameters[ZERO_ENERGY] > 0;
    if (b->weight)
        return pd_status_ok();
    b->weight = malloc((bonds + 1) * sizeof *b->weight);
    b->K_inverse = calloc(active * d * d, sizeof *b->K_inverse);
    /* Held points bear no stress: their Q stays 0. */
    b->Q = calloc((size_t)b->n_local * d * d, sizeof *b->Q);
    b->carries = calloc(active, sizeof *b->carries);
    if (controlled)
        b->control = calloc((size_t)b->n_local, sizeof *b->control);
    if (!b->weight || !b->K_inverse || !b->Q || !b->carries ||
        (controlled && !b->control))
        return pd_status_fail(PD_NO_MEMORY, -1, "correspondence of %zu bonds", bonds);
    if (!b->lattice)
        return pd_status_ok();
    sweeps *own = b->own = calloc(1, sizeof *own);
    if (!own)
        return pd_status_fail(PD_NO_MEMORY, -1, "rings");
    /* With control the second visit asks for y too. */
    const int reach = b->lattice->reach;
    PD_TRY(pd_ring_create(b->lattice, (int)d, (controlled ? 3 : 2) * reach + 1, &own->y));
    return pd_ring_create(b->lattice, (int)(d * d) + controlled, 2 * reach + 1, &own->Q);
}

static void release(pd_body *b)
{
    sweeps *own = b->own;
    if (own) {
        pd_ring_free(&own->y);
        pd_ring_free(&own->Q);
    }
    free(own);
}

static pd_status prepare(pd_body *b)
{
    PD_TRY(allocate(b));
    weigh_bonds(b);
    for (pd_local i = b->n_regular; i < b->n_active; i++)
        if (b->options.dimension == 2)
            invert_shape(2, b, i);
        else
            invert_shape(3, b, i);
    return b->lattice ? prepare_lattice(b) : pd_status_ok();
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

/* F of point i from sum_j w Y (x) xi, [kim2023] eq. 25; the identity where the point
 * carries no stress. */
PD_INLINE void keep_gradient(const int d, pd_body *b, pd_local i, const double *sum,
                             const double *K_inverse)
{
    double *F = b->F + (size_t)i * d * d;
    multiply(d, sum, K_inverse, F);
    b->J[i] = determinant(d, F);
    if (b->carries[i] != PD_POINT_SINGULAR)
        b->carries[i] = b->J[i] > PD_SMALLEST_J ? PD_SOUND : PD_POINT_INVERTED;
    if (b->carries[i] != PD_SOUND) {
        identity(d, F);
        b->J[i] = 1;
    }
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
    if (i < b->n_moving)
        gradient(d, holds, b, i);
}

PD_INLINE void gradients(const int d, pd_body *b)
{
    for (pd_local i = b->n_regular; i < b->n_active; i++)
        if (beside_hold(b, i))
            deform_point(d, true, b, i);
        else
            deform_point(d, false, b, i);
}

/* ---- forces ---- */

#define BLOCK 64 /* points whose P stays in the first-level cache */

/* Q = P K^-1 - g F; 0 where the point carries no stress. */
PD_INLINE void keep_Q(const int d, const pd_body *b, pd_local i, const double *P,
                      const double *K_inverse, double g, double *Q)
{
    const double *F = b->F + (size_t)i * d * d;
    if (b->carries[i] != PD_SOUND) {
        for (int c = 0; c < d * d; c++)
            Q[c] = 0;
        return;
    }
    multiply(d, P, K_inverse, Q);
    if (b->control)
        for (int c = 0; c < d * d; c++)
            Q[c] -= g * F[c];
}

/* P of points [start, start + n). */
PD_INLINE void stress_points(const int d, const pd_body *b, pd_local start, pd_local n,
                             double *P)
{
    b->options.material->stress[b->options.plane](b->options.parameters, d, (size_t)n,
                                                  b->F + (size_t)start * d * d,
                                                  b->J + start, P);
}

PD_INLINE void stresses(const int d, pd_body *b)
{
    double P[BLOCK * 9];
    for (pd_local start = b->n_regular; start < b->n_moving; start += BLOCK) {
        const pd_local end = start + BLOCK < b->n_moving ? start + BLOCK : b->n_moving;
        stress_points(d, b, start, end - start, P);
        for (pd_local i = start; i < end; i++)
            keep_Q(d, b, i, P + (size_t)(i - start) * d * d,
                   b->K_inverse + (size_t)i * d * d, b->control ? b->control[i] : 0,
                   b->Q + (size_t)i * d * d);
    }
}

/* g of a point as the force counts it. */
PD_INLINE double control_now(const pd_body *b, pd_local i)
{
    return i < b->n_moving && b->carries[i] == PD_SOUND ? b->control[i] : 0;
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
        if (holds && j >= b->n_moving)
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

/* ---- the same on a lattice ---- */

/* sum_j w Y (x) xi of a chunk; is some bond that weighs longer than s_c |xi|? */
PD_INLINE bool chunk_sum(const int d, const bool breaks, const bool own,
                         const pd_lattice *l, const pd_chunk *c,
                         const double *const *around, double s_c2,
                         double (*sum)[PD_LANES])
{
    const double *y = around[l->reach] + c->cell;
    lanes here[3], S[9] = {{0}};
    lane_bits over = {0};
    for (int a = 0; a < d; a++)
        here[a] = PD_LOAD(y + a * l->plane);
    for (int k = 0; k < l->n_offsets; k++) {
        const pd_offset *o = &l->offset[k];
        const double *there = around[o->plane] + c->cell + o->cell;
        lanes Y[3], square = {0}, weight = {0};
        if (own)
            weight = PD_LOAD(c->weight + k * PD_LANES);
        for (int a = 0; a < d; a++) {
            Y[a] = PD_LOAD(there + a * l->plane) - here[a];
            if (breaks)
                square += Y[a] * Y[a];
            if (own)
                Y[a] *= weight;
        }
        for (int r = 0; r < d; r++)
            for (int t = 0; t < d; t++)
                S[r * d + t] += Y[r] * (own ? o->xi[t] : o->weight_xi[t]);
        if (breaks && own)
            over |= (square > s_c2 * o->length * o->length) & (weight > 0);
        else if (breaks)
            over |= square > s_c2 * o->length * o->length;
    }
    for (int t = 0; t < d * d; t++)
        PD_STORE(sum[t], S[t]);
    return breaks && any_lane(&over, c->count);
}

/* F of a chunk, after breaking what is too long. */
PD_INLINE void deform_chunk(const int d, const bool breaks, pd_body *b, int64_t z,
                            pd_chunk *c, const double *const *around, double s_c2)
{
    const pd_lattice *l = b->lattice;
    const sweeps *own = b->own;
    double sum[9][PD_LANES];
    for (bool again = true; again;) {
        const bool over = c->weight
                              ? chunk_sum(d, breaks, true, l, c, around, s_c2, sum)
                              : chunk_sum(d, breaks, false, l, c, around, s_c2, sum);
        again = over && pd_damage_break_chunk(b, z, c, s_c2);
        for (int q = 0; again && q < c->count; q++)
            invert_lane(b, c, q);
    }
    for (int q = 0; q < c->count; q++) {
        const pd_local i = c->point + q;
        double S[9];
        for (int t = 0; t < d * d; t++)
            S[t] = sum[t][q];
        keep_gradient(d, b, i, S,
                      c->weight ? b->K_inverse + (size_t)i * d * d : own->K_inverse);
    }
}

/* Q of a chunk into the ring's plane. */
PD_INLINE void stress_chunk(const int d, pd_body *b, const pd_chunk *c, double *plane)
{
    const pd_lattice *l = b->lattice;
    const sweeps *own = b->own;
    double P[PD_LANES * 9], Q[9];
    stress_points(d, b, c->point, c->count, P);
    for (int q = 0; q < c->count; q++) {
        const pd_local i = c->point + q;
        const double *K_inverse =
            c->weight ? b->K_inverse + (size_t)i * d * d : own->K_inverse;
        const double g = b->control ? (c->weight ? b->control[i] : own->g) : 0;
        keep_Q(d, b, i, P + q * d * d, K_inverse, g, Q);
        for (int t = 0; t < d * d; t++)
            plane[t * l->plane + c->cell + q] = Q[t];
        if (b->control)
            plane[d * d * l->plane + c->cell + q] = b->carries[i] == PD_SOUND ? g : 0;
        if (c->exports) {
            for (int t = 0; t < d * d; t++)
                b->Q[(size_t)i * d * d + t] = Q[t];
            if (b->control)
                b->control[i] = g;
        }
    }
}

/* Q of the points of the general path into the ring's plane. */
PD_INLINE void copy_others(const int d, const pd_body *b, int64_t z, double *plane)
{
    const pd_lattice *l = b->lattice;
    for (int64_t m = l->other.first[z]; m < l->other.first[z + 1]; m++) {
        const pd_chunk *c = &l->other.chunk[m];
        for (int t = 0; t < d * d; t++)
            plane[t * l->plane + c->cell] = b->Q[(size_t)c->point * d * d + t];
        if (b->control)
            plane[d * d * l->plane + c->cell] = control_now(b, c->point);
    }
}

/* Force density of a chunk, [kim2023] eqs 28-29; y: planes of positions, with control. */
PD_INLINE void chunk_force(const int d, const bool own, const bool control,
                           const pd_lattice *l, const pd_chunk *c, const double *const *Q,
                           const double *const *y, double (*force)[PD_LANES])
{
    const double *Qi = Q[l->reach] + c->cell;
    lanes f[3] = {{0}}, first_moment[3] = {{0}}, here[3] = {{0}}, g = {0};
    if (control) {
        g = PD_LOAD(Qi + d * d * l->plane);
        for (int a = 0; a < d; a++)
            here[a] = PD_LOAD(y[l->reach] + c->cell + a * l->plane);
    }
    for (int k = 0; k < l->n_offsets; k++) {
        const pd_offset *o = &l->offset[k];
        const int64_t cell = c->cell + o->cell;
        const double *Qj = Q[o->plane] + cell;
        lanes w = {0}, part[3] = {{0}};
        for (int r = 0; r < d; r++)
            for (int t = 0; t < d; t++)
                part[r] += PD_LOAD(Qj + (r * d + t) * l->plane) *
                           (own ? o->xi[t] : o->weight_xi[t]);
        if (own) {
            w = PD_LOAD(c->weight + k * PD_LANES);
            for (int r = 0; r < d; r++) {
                part[r] *= w;
                first_moment[r] += w * o->xi[r];
            }
        }
        if (control) {
            const lanes both = g + PD_LOAD(Qj + d * d * l->plane);
            for (int r = 0; r < d; r++)
                part[r] += (own ? w * both : o->weight * both) *
                           (PD_LOAD(y[o->plane] + cell + r * l->plane) - here[r]);
        }
        for (int r = 0; r < d; r++)
            f[r] += part[r];
    }
    /* The moment of a full family is zero. */
    for (int r = 0; own && r < d; r++)
        for (int t = 0; t < d; t++)
            f[r] += PD_LOAD(Qi + (r * d + t) * l->plane) * first_moment[t];
    for (int r = 0; r < d; r++)
        PD_STORE(force[r], f[r]);
}

PD_INLINE void force_of_chunk(const int d, const bool control, pd_body *b,
                              const pd_chunk *c, const double *const *Q,
                              const double *const *y)
{
    double f[3][PD_LANES];
    if (c->weight)
        chunk_force(d, true, control, b->lattice, c, Q, y, f);
    else
        chunk_force(d, false, control, b->lattice, c, Q, y, f);
    double *force = b->force + (size_t)c->point * d;
    for (int q = 0; q < c->count; q++)
        for (int r = 0; r < d; r++)
            force[q * d + r] = f[r][q];
}

/* Planes of a ring around plane z. */
PD_INLINE void planes_around(const pd_ring *ring, int reach, int64_t z,
                             const double **around)
{
    for (int s = 0; s <= 2 * reach; s++)
        around[s] = ring_plane(ring, z - reach + s);
}

PD_INLINE void sweep(const int d, const bool breaks, const bool control, pd_body *b)
{
    const pd_lattice *l = b->lattice;
    const sweeps *own = b->own;
    const int reach = l->reach;
    const double s_c = breaks ? pd_body_critical_stretch(b, 0, 0) : 0;
    const double *y[2 * PD_MOST_REACH + 1], *Q[2 * PD_MOST_REACH + 1];
    for (int64_t z = -2 * reach; z < l->planes; z++) {
        const int64_t first = z + reach; /* the plane of the first visit */
        pd_ring_fill(d, b, first + reach, b->y, &own->y);
        planes_around(&own->y, reach, first, y);
        if (first >= 0 && first < l->planes) {
            double *plane = ring_plane(&own->Q, first);
            for (int64_t m = l->regular.first[first]; m < l->regular.first[first + 1];
                 m++) {
                pd_chunk *c = &l->regular.chunk[m];
                deform_chunk(d, breaks, b, first, c, y, s_c * s_c);
                stress_chunk(d, b, c, plane);
            }
            copy_others(d, b, first, plane);
        }
        if (z < 0)
            continue;
        planes_around(&own->Q, reach, z, Q);
        if (control)
            planes_around(&own->y, reach, z, y);
        for (int64_t m = l->regular.first[z]; m < l->regular.first[z + 1]; m++)
            force_of_chunk(d, control, b, &l->regular.chunk[m], Q, y);
    }
}

PD_INLINE void sweep_dimension(const int d, pd_body *b)
{
    const bool breaks = pd_body_can_break(&b->options);
    if (breaks && b->control)
        sweep(d, true, true, b);
    else if (breaks)
        sweep(d, true, false, b);
    else if (b->control)
        sweep(d, false, true, b);
    else
        sweep(d, false, false, b);
}

PD_INLINE void sweep_any(pd_body *b)
{
    if (b->options.dimension == 2)
        sweep_dimension(2, b);
    else
        sweep_dimension(3, b);
}

PD_VERSIONS(lattice_forces, sweep_any, pd_body *)

/* ---- all of it ---- */

PD_INLINE void all_forces(const int d, pd_body *b)
{
    gradients(d, b);
    stresses(d, b);
    if (b->lattice)
        lattice_forces(b);
    bond_forces(d, b);
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
    if (i < b->n_regular && !pd_lattice_chunk(b, i)->weight)
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

/* The force is B^T C B u with B: u -> F - 1, whose rows and columns sum to at most
 * 2 sum_k w_k |K^-1 xi_k|; omega^2 <= (M / rho) row sum x column sum. Zero-energy control
 * adds springs of 2 g w. */
static void frequency(const pd_body *b, double *omega2)
{
    const int d = b->options.dimension;
    const double c = pd_body_longitudinal_speed(b);
    double widest = 0, stiffest = 0;
    for (pd_local i = 0; i < b->n_moving; i++) {
        const bool shared = i < b->n_regular && !pd_lattice_chunk(b, i)->weight;
        const double *K_inverse = shared ? ((const sweeps *)b->own)->K_inverse
                                         : b->K_inverse + (size_t)i * d * d;
        double sum = 0, weights = 0;
        pd_family family;
        family_of(b, i, &family);
        for (pd_local k = 0; k < family.count; k++) {
            const double w = family_weight(b, i, &family, k);
            double xi[3], K_xi[3] = {0};
            subtract(d, b->X + (size_t)family.neighbour[k] * d, b->X + (size_t)i * d, xi);
            for (int r = 0; r < d; r++)
                K_xi[r] = dot(d, K_inverse + r * d, xi);
            sum += w * sqrt(dot(d, K_xi, K_xi));
            weights += w;
        }
        omega2[i] = 2 * sum;
        widest = fmax(widest, omega2[i]);
        if (b->control)
            stiffest = fmax(stiffest, 4 * control_at(b, i) * weights);
    }
    for (pd_local i = 0; i < b->n_moving; i++)
        omega2[i] = c * c * omega2[i] * widest + stiffest / b->options.density;
}

static bool accepts(const pd_material *material, int d, pd_plane plane)
{
    return material->stress[d == 2 ? plane : PD_PLANE_STRAIN];
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
