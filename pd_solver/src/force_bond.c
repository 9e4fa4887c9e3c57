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
 * On a lattice (lattice.h) a bond reads nothing but y of the neighbour, from a cache:
 * memory gives y and takes the force, 2 d doubles a point.
 *
 * A bond into a hold is continued as deformation.h says; held points bear no strain
 * energy, so that a moving point has its own half of the bond's energy only.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include <math.h>
#include <stdlib.h>

#include "bond.h"
#include "damage.h"
#include "deformation.h"
#include "influence.h"
#include "lanes.h"
#include "status.h"
#include "tensor.h"

static const double pi = 3.14159265358979323846;

/* ---- constants ---- */

/* Micromodulus c, [han2025] eq. 15 for a unit of thickness or section, N/m6. In one
 * dimension the energy of a uniform stretch, c s^2 horizon^2 / 4 = E s^2 / 2, leaves no
 * pi, which the paper prints. */
static double micromodulus(const pd_body_options *o, double horizon)
{
    const double E = o->parameters[0], square = horizon * horizon;
    if (o->dimension == 1)
        return 2 * E / square;
    if (o->dimension == 3)
        return 12 * E / (pi * square * square);
    const double c = o->plane == PD_PLANE_STRESS ? 9. : 48. / 5;
    return c * E / (pi * square * horizon);
}

/* Modulus of a uniaxial strain, twice its energy density, Pa. */
static double uniaxial_modulus(const pd_body *b)
{
    const double c = pd_body_longitudinal_speed(b);
    return b->options.density * c * c;
}

/* ---- preparation ---- */

/* a of a bond of that length without surface correction; spacing: the pair's mean. */
static double plain_weight(const pd_body *b, double length, double spacing, double volume)
{
    const double horizon = b->options.horizon_ratio * spacing;
    return micromodulus(&b->options, horizon) *
           volume_fraction(length, horizon, spacing) * volume;
}

/* xi and |xi| of the bond from i to j, and its a without surface correction. */
static double measure(const pd_body *b, pd_local i, pd_local j, double *xi,
                      double *length)
{
    const int d = b->options.dimension;
    subtract(d, b->X + (size_t)j * d, b->X + (size_t)i * d, xi);
    *length = sqrt(dot(d, xi, xi));
    return plain_weight(b, *length, 0.5 * (b->spacing[i] + b->spacing[j]), b->volume[j]);
}

/* Twice the energy density that a bond adds under a unit uniaxial strain along each axis.
 */
static void add_energy(int d, double a, const double *xi, double length, double *twice)
{
    for (int c = 0; c < d; c++) {
        const double n2 = xi[c] * xi[c] / (length * length);
        twice[c] += a / 2 * length * n2 * n2;
    }
}

/* By how much the energy density under those strains falls short of the material's: g[d],
 * the energy-based surface correction [madenci2014]. A family without a bond towards some
 * axis has nothing to correct there. */
static void shortfall(const pd_body *b, const double *twice, double *g)
{
    for (int c = 0; c < b->options.dimension; c++)
        g[c] = twice[c] > 0 ? uniaxial_modulus(b) / twice[c] : 1;
}

/* Bonds count that a crack has cut: the correction is for surfaces of the body as it was
 * made. */
static void surface_factors(const pd_body *b, pd_local i, double *g)
{
    const int d = b->options.dimension;
    double twice[3] = {0};
    pd_family family;
    family_of(b, i, &family);
    for (pd_local k = 0; k < family.count; k++) {
        double xi[3], length;
        const double a = measure(b, i, family.neighbour[k], xi, &length);
        add_energy(d, a, xi, length, twice);
    }
    shortfall(b, twice, g);
}

/* Factor of a bond between points of factors g and h. */
static double surface_correction(int d, const double *xi, double length, const double *g,
                                 const double *h)
{
    double sum = 0;
    for (int c = 0; c < d; c++) {
        const double part = 2 * xi[c] / (length * (g[c] + h[c]));
        sum += part * part;
    }
    return 1 / sqrt(sum);
}

/* a of the bond from i to j; factors[n_local][d] or NULL. */
static double weight_of(const pd_body *b, pd_local i, pd_local j, const double *factors,
                        double *length)
{
    const size_t d = (size_t)b->options.dimension;
    double xi[3];
    const double a = measure(b, i, j, xi, length);
    if (!factors || !keeps_family(b, j))
        return a;
    return a * surface_correction((int)d, xi, *length, factors + (size_t)i * d,
                                  factors + (size_t)j * d);
}

static double weight_on_lattice(const pd_body *b, pd_local i, pd_local j,
                                const pd_offset *offset, const void *context)
{
    (void)offset;
    double length;
    return weight_of(b, i, j, context, &length);
}

/* Weights of offsets: those of a point far from any surface. */
static void weigh_offsets(pd_body *b, bool corrected)
{
    pd_lattice *l = b->lattice;
    double twice[3] = {0}, g[3];
    for (int k = 0; k < l->n_offsets; k++) {
        pd_offset *o = &l->offset[k];
        o->weight = plain_weight(b, o->length, l->step, pow(l->step, l->d));
        add_energy(l->d, o->weight, o->xi, o->length, twice);
    }
    shortfall(b, twice, g);
    for (int k = 0; corrected && k < l->n_offsets; k++) {
        pd_offset *o = &l->offset[k];
        o->weight *= surface_correction(l->d, o->xi, o->length, g, g);
    }
}

static pd_status weigh(pd_body *b, const double *factors)
{
    for (pd_local i = b->n_regular; i < b->n_active; i++)
        for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
            const double a =
                weight_of(b, i, b->families.neighbour[k], factors, &b->length[k]);
            b->weight[k] = bond_is_broken(b, k) ? 0 : a;
        }
    if (!b->lattice)
        return pd_status_ok();
    weigh_offsets(b, factors);
    return pd_lattice_weigh(b, weight_on_lattice, factors);
}

static pd_status allocate(pd_body *b)
{
    if (b->weight)
        return pd_status_ok();
    const size_t bonds = (size_t)b->families.first[b->families.n];
    b->weight = malloc((bonds + 1) * sizeof *b->weight);
    b->length = malloc((bonds + 1) * sizeof *b->length);
    if (!b->weight || !b->length)
        return pd_status_fail(PD_NO_MEMORY, -1, "%zu bonds", bonds);
    if (!b->lattice)
        return pd_status_ok();
    b->own = calloc(1, sizeof(pd_ring));
    if (!b->own)
        return pd_status_fail(PD_NO_MEMORY, -1, "a ring");
    return pd_ring_create(b->lattice, b->options.dimension, 2 * b->lattice->reach + 1,
                          b->own);
}

/* A bond without length has no direction. On a lattice there is none. */
static pd_status check_lengths(const pd_body *b)
{
    for (pd_local i = b->n_regular; i < b->n_active; i++)
        for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
            const pd_local j = b->families.neighbour[k];
            double xi[3], length;
            measure(b, i, j, xi, &length);
            if (!(length > 0))
                return pd_status_fail(PD_BAD_ARGUMENT, b->id[i],
                                      "the point stands where point %lld stands",
                                      (long long)b->id[j]);
        }
    return pd_status_ok();
}

static pd_status prepare_storage(pd_body *b, double **factors)
{
    const size_t size = (size_t)b->n_local * (size_t)b->options.dimension;
    PD_TRY(check_lengths(b));
    PD_TRY(allocate(b));
    if (b->options.formulation_parameters[SURFACE_CORRECTION] == 0)
        return pd_status_ok();
    *factors = malloc((size + 1) * sizeof **factors);
    return *factors ? pd_status_ok()
                    : pd_status_fail(PD_NO_MEMORY, -1, "%d points", b->n_local);
}

static pd_status prepare(pd_body *b)
{
    const size_t d = (size_t)b->options.dimension;
    double *factors = NULL;
    pd_status status = pd_agree(b->comm, prepare_storage(b, &factors));
    if (status.code == PD_OK && factors) {
        for (pd_local i = 0; i < b->n_active; i++)
            surface_factors(b, i, factors + (size_t)i * d);
        pd_halo_copy(b->halo, factors, d * sizeof *factors);
    }
    if (status.code == PD_OK)
        status = pd_agree(b->comm, weigh(b, factors));
    free(factors);
    return status;
}

static void release(pd_body *b)
{
    if (b->own)
        pd_ring_free(b->own);
    free(b->own);
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
        if (holds && is_held(b, j))
            t *= 0.5 * mirror(b, i, j);
        for (int c = 0; c < d; c++)
            f[c] += t * Y[c];
    }
    for (int c = 0; c < d; c++)
        b->force[(size_t)i * d + c] = f[c];
}

/* Break bonds and find the force of point i. */
PD_INLINE void treat(const int d, const bool breaks, pd_body *b, pd_local i)
{
    if (breaks && !breaks_after_force(b))
        break_bonds(d, true, b, i);
    if (i < b->n_moving && beside_hold(b, i))
        bond_force(d, true, b, i);
    else if (i < b->n_moving)
        bond_force(d, false, b, i);
    if (breaks && breaks_after_force(b))
        break_bonds(d, true, b, i);
}

/* While ghosts are on their way, the points that need none. */
PD_INLINE void all_forces(const int d, pd_body *b)
{
    const bool breaks = pd_body_can_break(&b->options);
    const bool waits = pd_halo_is_under_way(b->halo);
    for (pd_local i = b->n_regular; i < b->n_active; i++)
        if (!waits || !family_has_ghosts(b, i))
            treat(d, breaks, b, i);
    pd_halo_end(b->halo);
    for (pd_local i = b->n_regular; waits && i < b->n_active; i++)
        if (family_has_ghosts(b, i))
            treat(d, breaks, b, i);
}

PD_VERSIONS(pd_lattice_bond)

static void forces(pd_body *b)
{
    if (b->lattice)
        pd_lattice_bond(b);
    if (b->options.dimension == 1)
        all_forces(1, b);
    else if (b->options.dimension == 2)
        all_forces(2, b);
    else
        all_forces(3, b);
}

/* ---- what else the table asks ---- */

/* Visit the bonds of moving point i, to j: weight, |xi| and Y. */
typedef void visitor(void *sum, const pd_body *b, pd_local i, pd_local j, double weight,
                     double length, const double *Y);

static void visit_bonds(const pd_body *b, pd_local i, visitor *visit, void *sum)
{
    const int d = b->options.dimension;
    const pd_lattice *l = b->lattice;
    pd_family family;
    family_of(b, i, &family);
    for (pd_local k = 0; k < family.count; k++) {
        const pd_local j = family.neighbour[k];
        double xi[3], Y[3];
        bond(d, b->hold_distance, b, i, j, xi, Y);
        const double length = family.offset ? l->offset[family.offset[k]].length
                                            : b->length[family.base + k];
        visit(sum, b, i, j, family_weight(b, i, &family, k), length, Y);
    }
}

/* Half of c s^2 |xi| / 2 of every bond is each end's. */
static void add_bond_energy(void *sum, const pd_body *b, pd_local i, pd_local j,
                            double weight, double length, const double *Y)
{
    (void)j;
    const double s = sqrt(dot(b->options.dimension, Y, Y)) / length - 1;
    *(double *)sum += b->volume[i] * weight * s * s * length / 4;
}

static double energy(const pd_body *b)
{
    double sum = 0;
    for (pd_local i = 0; i < b->n_moving; i++)
        visit_bonds(b, i, add_bond_energy, &sum);
    return sum;
}

/* The virial: half of force (x) bond. */
static void add_virial(void *sum, const pd_body *b, pd_local i, pd_local j, double weight,
                       double length, const double *Y)
{
    (void)i, (void)j;
    const int d = b->options.dimension;
    const int place[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    const double square = dot(d, Y, Y);
    const double inverse = square > 0 ? 1 / sqrt(square) : 0;
    double *s = sum;
    for (int r = 0; r < d; r++)
        for (int c = r; c < d; c++)
            s[place[r][c]] += weight / 2 * (1 / length - inverse) * Y[r] * Y[c];
}

/* 33 in two dimensions: no bond bears it. */
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
        if (i < b->n_moving)
            visit_bonds(b, i, add_virial, s);
    }
}

/* At rest a bond has the stiffness a n (x) n / |xi|; the row of point i sums to at most
 * twice its diagonal. A bond into a hold is on the diagonal alone. */
static void add_stiffness(void *sum, const pd_body *b, pd_local i, pd_local j,
                          double weight, double length, const double *Y)
{
    (void)Y;
    const double row = is_held(b, j) ? 0.5 * mirror(b, i, j) * mirror(b, i, j) : 2;
    *(double *)sum += row * weight / length / b->options.density;
}

static void frequency(const pd_body *b, double *omega2)
{
    for (pd_local i = 0; i < b->n_moving; i++) {
        omega2[i] = 0;
        visit_bonds(b, i, add_stiffness, &omega2[i]);
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
    [BREAK_AFTER_FORCE] = {.key = "breakAfterForce",
                           .unit = "-",
                           .above = 0,
                           .below = 2,
                           .includes_above = true,
                           .meaning = "bonds that exceed s_c bear force once more",
                           .kind = PD_FLAG,
                           .optional = true,
                           .standard = 0},
};

const pd_formulation pd_formulation_bond = {
    .name = "bond",
    .source = "[han2025] eqs 9-18, 28-30",
    .least_dimension = 1,
    .ghost_layers = 1,
    .has_lattice_path = true,
    .criteria = PD_BY_STRETCH,
    .n_parameters = sizeof parameters / sizeof *parameters,
    .parameters = parameters,
    .accepts = accepts,
    .prepare = prepare,
    .release = release,
    .forces = forces,
    .energy = energy,
    .stress = stress,
    .wave_speed = pd_body_longitudinal_speed,
    .frequency = frequency,
};
