/*
 * Semi-Lagrangian, bond-associated correspondence of rate-form materials,
 * [behzadinasab2021] appendices A and C. The families are those at rest; gradients are
 * taken by a reproducing kernel in the current positions, and the stress lives on bonds.
 * Letters:
 *
 *   x     current bond y_j - y_i             omega  influence of the bond, decay included
 *   v     current volume J V                 w      omega v_j, kept as b->weight
 *   L     velocity gradient of a point       share  1/omega-bar, eq. A.6
 *   sigma Cauchy stress of a bond            c      1 where a point bears stress, else 0
 *
 * The stress power of a pair of points is g sigma : L_bond, [behzadinasab2021] eqs 18-19,
 * g = v_i v_j omega (share_i + share_j), and with the mean L over the ends that bear
 * stress
 *
 *   L_bond = L + (v_j - v_i - L x) x^T / |x|^2                                   (A.11)
 *
 * The forces are the transpose of that, so that their power is the stress power whatever
 * the positions: with t = sigma x / |x|^2 and Z_i = sum g c_i/(c_i + c_j) (sigma - t
 * x^T),
 *
 *   V_i f_i = sum_j g t + w_ij Z_i R_i Xi(x_ij) - w_ji Z_j R_j Xi(x_ji)      (A.13, A.14)
 *
 * Pairs exchange opposite forces and L is exact for rotations, so that momentum and
 * angular momentum are kept to round-off.
 *
 * omega takes the current length, but never more than the length at rest: eq. A.4 with a
 * support that is the pair's horizon, and grows with a bond that is stretched. With a
 * fixed support a body stretched twofold would have lost most of its families, without
 * any criterion of failure. So no intact bond ever weighs less than at rest, while motion
 * as a rigid body and compression have the paper's weights.
 *
 * A point whose bonds do not tell the monomials of its order apart takes the next lower
 * order; one whose bonds do not span space bears no stress. Bonds whose ends both bear
 * none exert no force. Held points bear none and their velocities are mirrored, as
 * deformation.h has it for positions.
 *
 * Memory traffic: a directed bond reads its neighbour (4 bytes), w (8) and the positions
 * of the neighbour; Phi would be 16 or 24 bytes more that take no longer to compute than
 * to read. The stress (48 bytes) is kept once for the two directions of a bond, and read
 * once in forces, updated once in advance. The sweeps that need both ends of a pair visit
 * it from the lower index and write to both.
 *
 * A pair of an owned point and a ghost is kept by both ranks, and visited by each from
 * its own point: every term is the same to the last bit from either end, so that both
 * have the same stress and break the bond in the same step. What is written to a ghost is
 * lost, but for the forces of Z on neighbours, which go back to the rank that owns them.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "damage.h"
#include "deformation.h"
#include "influence.h"
#include "reproducing_kernel.h"
#include "status.h"

/* A bond longer than this many horizons weighs nothing: its powers must stay finite. */
#define FARTHEST 1e6

/* Ends closer than this share of the horizon have no direction. */
#define NEAREST 1e-6

/* Displacement gradients of one step from here on are no deformation, and the bond keeps
 * its stress; neither are, in total, those from LARGEST_F on. */
#define LARGEST_STEP 1e3
#define LARGEST_F 1e6

/* Parameters, in the table's order. */
enum { ORDER, ASSOCIATION };

/* Pairs are the bonds of moving points to larger indices, in order: those of point i are
 * the last of its family. Those of held points are their bonds to moving ghosts, so that
 * they know what breaks. */
typedef struct {
    int64_t *upper; /* [n_active] first bond of a pair ... */
    int64_t *end;   /* ... and the one after the last */
    size_t *pair;   /* [n_active + 1] number of the first among the pairs */
    pd_local *met;  /* [n_active] how many lower neighbours a sweep has met */
    double *volume; /* [n_local] v, m3 */
    double *share;  /* [n_local] 1/m3; 0 where a point bears no stress */
    double *rows;   /* [n_moving][d][terms] R / horizon, for x / horizon */
    double *tensor; /* [n_local][d][d] Z while forces, L while advancing */
    double
        *sigma; /* [pairs][PD_SYMMETRIC], Pa; of points, n_local, without association */
    double *plastic;      /* likewise, or NULL where the material has none */
    double *soundness;    /* [pairs] omega_D, or NULL where bonds break at once */
    double least_stretch; /* smallest s_c of all bonds; 0: none */
} state;

static int order_of(const pd_body *b)
{
    return (int)b->options.formulation_parameters[ORDER];
}

static bool is_associated(const pd_body *b)
{
    return b->options.formulation_parameters[ASSOCIATION] > 0;
}

/* Instances of a sweep for every dimension and order. */
#define SWEEP(b, sweep, ...)                                                             \
    switch (4 * (b)->options.dimension + order_of(b)) {                                  \
    case 4 * 2 + 1:                                                                      \
        sweep(2, 1, __VA_ARGS__);                                                        \
        break;                                                                           \
    case 4 * 2 + 2:                                                                      \
        sweep(2, 2, __VA_ARGS__);                                                        \
        break;                                                                           \
    case 4 * 2 + 3:                                                                      \
        sweep(2, 3, __VA_ARGS__);                                                        \
        break;                                                                           \
    case 4 * 3 + 1:                                                                      \
        sweep(3, 1, __VA_ARGS__);                                                        \
        break;                                                                           \
    case 4 * 3 + 2:                                                                      \
        sweep(3, 2, __VA_ARGS__);                                                        \
        break;                                                                           \
    default:                                                                             \
        sweep(3, 3, __VA_ARGS__);                                                        \
    }

/* ---- bonds ---- */

/* v_j - v_i, mirrored in holds. */
PD_INLINE void relative_velocity(const int d, const bool holds, const pd_body *b,
                                 pd_local i, pd_local j, double *dv)
{
    const double *vi = b->v + (size_t)i * d, *vj = b->v + (size_t)j * d;
    const bool into_hold = holds && is_held(b, j), out_of_hold = holds && is_held(b, i);
    for (int a = 0; a < d; a++)
        dv[a] = into_hold     ? -mirror(b, i, j) * vi[a]
                : out_of_hold ? mirror(b, j, i) * vj[a]
                              : vj[a] - vi[a];
}

/* 1/|x|^2, bounded where the ends of the bond meet. */
PD_INLINE double inverse_square(const int d, const pd_body *b, pd_local i, pd_local j,
                                const double *x)
{
    const double spacing = 0.5 * (b->spacing[i] + b->spacing[j]);
    const double least = NEAREST * b->options.horizon_ratio * spacing;
    return 1 / fmax(dot(d, x, x), least * least);
}

/* How many ends of a pair bear stress, as what divides by it. */
PD_INLINE double one_by_bearers(const state *s, pd_local i, pd_local j)
{
    const int count = (s->share[i] > 0) + (s->share[j] > 0);
    return count == 2 ? 0.5 : count;
}

/* g; 0 where no end bears stress. */
PD_INLINE double pair_weight(const pd_body *b, const state *s, pd_local i, int64_t k)
{
    return s->volume[i] * b->weight[k] *
           (s->share[i] + s->share[b->families.neighbour[k]]);
}

/* Consecutive bonds of a family; lanes beyond its end repeat the last and weigh nothing,
 * as do broken ones. Where w is 0 so is x, whatever has become of the point. */
typedef struct {
    pd_local j[LANES];
    double w[LANES];
    lanes x[3]; /* over the horizon of i, - */
} batch;

PD_INLINE void gather(const int d, const pd_body *b, pd_local i, int64_t k, batch *bonds)
{
    const bool holds = beside_hold(b, i);
    const int64_t last = b->families.first[i + 1] - 1;
    const double scale = 1 / (b->options.horizon_ratio * b->spacing[i]);
    for (int l = 0; l < LANES; l++) {
        const int64_t at = k + l < last ? k + l : last;
        const pd_local j = b->families.neighbour[at];
        double xi[3], x[3];
        if (holds)
            bond(d, true, b, i, j, xi, x);
        else
            subtract(d, b->y + (size_t)j * (size_t)d, b->y + (size_t)i * (size_t)d, x);
        bonds->j[l] = j;
        bonds->w[l] = k + l <= last ? b->weight[at] : 0;
        for (int a = 0; a < d; a++)
            bonds->x[a][l] = bonds->w[l] > 0 ? scale * x[a] : 0;
    }
}

/* ---- breaking ---- */

static bool may_break(const pd_body *b, pd_local i, pd_local j)
{
    return !b->protect || !(b->protect[i] || b->protect[j]);
}

/* Bond k of point i seen from its other end. */
static int64_t partner(const pd_body *b, pd_local i, int64_t k)
{
    const pd_local j = b->families.neighbour[k];
    int64_t low = b->families.first[j], high = b->families.first[j + 1] - 1;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (b->families.neighbour[middle] < i)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static void break_pair(pd_body *b, pd_local i, int64_t k)
{
    pd_damage_break(b, k);
    if (b->families.neighbour[k] < b->n_owned) /* else its rank does the same */
        pd_damage_break(b, partner(b, i, k));
}

/* What stress or plastic strain does to a bond, appendix C. */
static void damage_pair(pd_body *b, pd_local i, int64_t k, size_t pair, double strain,
                        double stress)
{
    const pd_body_options *o = &b->options;
    if (b->weight[k] == 0 || !may_break(b, i, b->families.neighbour[k]))
        return;
    if (o->critical_stress > 0 && stress > o->critical_stress)
        break_pair(b, i, k);
    if (o->failed_strain > 0 && strain >= o->failed_strain)
        break_pair(b, i, k);
    else if (o->failed_strain > 0 && strain > o->sound_strain) {
        double *soundness = ((state *)b->own)->soundness + pair;
        const double D =
            (strain - o->sound_strain) / (o->failed_strain - o->sound_strain);
        *soundness = fmin(*soundness, 1 - D); /* eq. C.2 */
    }
}

static double von_mises(const double *s)
{
    const double a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
    return sqrt((a * a + b * b + c * c) / 2 +
                3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

/* ---- weights ---- */

/* Has the bond, of square length now2 and at rest rest2, exceeded its critical stretch?
 */
static bool is_overstretched(const pd_body *b, pd_local i, pd_local j, double rest2,
                             double now2)
{
    const double least = ((const state *)b->own)->least_stretch;
    if (least == 0 || now2 <= least * least * rest2)
        return false;
    const double s_c = pd_body_critical_stretch(b, i, j);
    return now2 > s_c * s_c * rest2 && may_break(b, i, j);
}

/* w of the pairs of point i in both directions, breaking those stretched too far. */
PD_INLINE void weigh_pairs(const int d, const bool holds, pd_body *b, pd_local i)
{
    state *s = b->own;
    for (int64_t k = s->upper[i]; k < s->end[i]; k++) {
        const pd_local j = b->families.neighbour[k];
        /* Pairs come by rising i, as the families list their lower neighbours. */
        const bool is_ghost = j >= b->n_owned;
        const int64_t back = is_ghost ? k : b->families.first[j] + s->met[j]++;
        if (b->broken && bond_is_broken(b, k))
            continue;
        double xi[3], x[3];
        bond(d, holds, b, i, j, xi, x);
        const double rest2 = dot(d, xi, xi), now2 = dot(d, x, x);
        if (b->broken && is_overstretched(b, i, j, rest2, now2)) {
            pd_damage_break(b, k);
            pd_damage_break(b, back);
            continue;
        }
        const double horizon =
            b->options.horizon_ratio * 0.5 * (b->spacing[i] + b->spacing[j]);
        const double length = sqrt(now2 < rest2 ? now2 : rest2);
        double omega = influence(2 * length / horizon, d);
        if (now2 > FARTHEST * FARTHEST * horizon * horizon)
            omega = 0;
        if (s->soundness)
            omega *= s->soundness[s->pair[i] + (size_t)(k - s->upper[i])];
        b->weight[back] = omega * s->volume[i];
        b->weight[k] = omega * s->volume[j];
    }
}

PD_INLINE void weigh(const int d, pd_body *b)
{
    state *s = b->own;
    memset(s->met, 0, (size_t)b->n_active * sizeof *s->met);
    for (pd_local i = 0; i < b->n_active; i++)
        if (beside_hold(b, i))
            weigh_pairs(d, true, b, i);
        else
            weigh_pairs(d, false, b, i);
}

/* ---- the kernel of points ---- */

static void bear_no_stress(pd_body *b, pd_local i)
{
    const int d = b->options.dimension;
    ((state *)b->own)->share[i] = 0;
    b->J[i] = 1;
    identity(d, b->F + (size_t)i * (size_t)(d * d));
}

/* R and omega-bar of point i, eqs A.6-A.8. */
PD_INLINE void solve_point(const int d, const int n, pd_body *b, pd_local i)
{
    state *s = b->own;
    const int N = up_to_degree(d, n);
    lanes moment[MOST_MOMENTS], sum = {0};
    for (int e = 0; e < up_to_degree(d, 2 * n) - d; e++)
        for (int l = 0; l < LANES; l++)
            moment[e][l] = 0;
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k += LANES) {
        batch bonds;
        gather(d, b, i, k, &bonds);
        add_moments(d, n, bonds.x, bonds.w, moment);
        for (int l = 0; l < LANES; l++)
            sum[l] += bonds.w[l];
    }
    double *R = s->rows + (size_t)i * (size_t)(d * N), total = 0;
    const int order = find_rows(d, n, moment, R);
    for (int c = 0; c < d * N; c++)
        R[c] /= b->options.horizon_ratio * b->spacing[i];
    for (int l = 0; l < LANES; l++)
        total += sum[l];
    if (b->carries[i] != PD_POINT_INVERTED)
        b->carries[i] = order > 0 ? PD_SOUND : PD_POINT_SINGULAR;
    if (b->carries[i] == PD_SOUND)
        s->share[i] = 1 / total;
    else
        bear_no_stress(b, i);
}

PD_INLINE void solve_points(const int d, const int n, pd_body *b)
{
    for (pd_local i = 0; i < b->n_moving; i++)
        solve_point(d, n, b, i);
}

/* From y, volumes and soundness, those of ghosts too. */
static void derive_kernels(pd_body *b)
{
    if (b->options.dimension == 2)
        weigh(2, b);
    else
        weigh(3, b);
    SWEEP(b, solve_points, b)
    double *share = ((state *)b->own)->share;
    pd_halo_copy(b->halo, share, sizeof *share);
}

static void find_kernels(pd_body *b)
{
    state *s = b->own;
    pd_body_refresh(b);
    pd_halo_copy(b->halo, b->J, sizeof *b->J);
    for (pd_local i = 0; i < b->n_local; i++)
        s->volume[i] = b->J[i] * b->volume[i];
    derive_kernels(b);
}

/* ---- preparation ---- */

static void *numbers(size_t n)
{
    return calloc(n + 1, sizeof(double));
}

static void number_pairs(pd_body *b)
{
    state *s = b->own;
    s->pair[0] = 0;
    for (pd_local i = 0; i < b->n_active; i++) {
        const bool held = is_held(b, i);
        int64_t k = b->families.first[i], end = b->families.first[i + 1];
        while (k < end && b->families.neighbour[k] < (held ? b->n_owned : i))
            k++;
        while (held && end > k && is_held(b, b->families.neighbour[end - 1]))
            end--; /* moving ghosts come first */
        s->upper[i] = k;
        s->end[i] = end;
        s->pair[i + 1] = s->pair[i] + (size_t)(end - k);
    }
}

static pd_status allocate_points(pd_body *b)
{
    const size_t local = (size_t)b->n_local, moving = (size_t)b->n_moving;
    const int d = b->options.dimension;
    const size_t rows = (size_t)(d * up_to_degree(d, order_of(b)));
    state *s = b->own = calloc(1, sizeof *s);
    if (!s)
        return pd_status_fail(PD_NO_MEMORY, -1, "bond-associated state");
    s->upper = malloc((local + 1) * sizeof *s->upper);
    s->end = malloc((local + 1) * sizeof *s->end);
    s->pair = malloc((local + 1) * sizeof *s->pair);
    s->met = malloc((local + 1) * sizeof *s->met);
    s->volume = numbers(local);
    s->share = numbers(local);
    s->rows = numbers(moving * rows);
    s->tensor = numbers(local * (size_t)(d * d));
    b->carries = calloc(local + 1, sizeof *b->carries);
    if (!s->upper || !s->end || !s->pair || !s->met || !s->volume || !s->share ||
        !s->rows || !s->tensor || !b->carries)
        return pd_status_fail(PD_NO_MEMORY, -1, "bond-associated, %zu points", local);
    return pd_status_ok();
}

static pd_status allocate_bonds(pd_body *b)
{
    state *s = b->own;
    const size_t bonds = (size_t)b->families.first[b->families.n];
    const size_t pairs = s->pair[b->n_active];
    const size_t stresses = is_associated(b) ? pairs : (size_t)b->n_local;
    const bool decays = b->options.failed_strain > 0;
    b->weight = numbers(bonds);
    s->sigma = numbers(stresses * PD_SYMMETRIC);
    if (b->options.material->is_plastic)
        s->plastic = numbers(stresses);
    if (decays)
        s->soundness = numbers(pairs);
    if (!b->weight || !s->sigma || (b->options.material->is_plastic && !s->plastic) ||
        (decays && !s->soundness))
        return pd_status_fail(PD_NO_MEMORY, -1, "bond-associated, %zu bonds", bonds);
    for (size_t p = 0; decays && p < pairs; p++)
        s->soundness[p] = 1;
    return pd_status_ok();
}

static double find_least_stretch(const pd_body *b)
{
    double least = HUGE_VAL;
    for (pd_local i = 0; i < b->n_moving; i++)
        for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++)
            least = fmin(least, pd_body_critical_stretch(b, i, b->families.neighbour[k]));
    return least;
}

static pd_status prepare_storage(pd_body *b)
{
    const pd_body_options *o = &b->options;
    if (o->failed_strain > 0 && !o->material->is_plastic)
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "bonds that break by plastic strain, of the material %s, "
                              "which has none",
                              o->material->name);
    if (b->own)
        return pd_status_ok();
    PD_TRY(allocate_points(b));
    number_pairs(b);
    PD_TRY(allocate_bonds(b));
    if (o->critical_stretch > 0 || o->energy_release > 0)
        ((state *)b->own)->least_stretch = find_least_stretch(b);
    return pd_status_ok();
}

static pd_status prepare(pd_body *b)
{
    PD_TRY(pd_agree(b->comm, prepare_storage(b)));
    find_kernels(b);
    return pd_status_ok();
}

static void release(pd_body *b)
{
    state *s = b->own;
    if (!s)
        return;
    void *arrays[] = {s->upper, s->end,    s->pair,  s->met,     s->volume,   s->share,
                      s->rows,  s->tensor, s->sigma, s->plastic, s->soundness};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        free(arrays[k]);
    free(s);
}

/* ---- forces ---- */

/* T[d][d] of a stress. */
PD_INLINE void unpack(const int d, const double *sigma, double *T)
{
    static const int place[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    for (int r = 0; r < d; r++)
        for (int c = 0; c < d; c++)
            T[r * d + c] = sigma[place[r][c]];
}

/* From the pairs of point i: their forces along t, and what they add to Z, eq. A.14. */
PD_INLINE void pull_pairs(const int d, const bool holds, pd_body *b, pd_local i)
{
    const state *s = b->own;
    const double *sigma = s->sigma + s->pair[i] * PD_SYMMETRIC;
    double *fi = b->force + (size_t)i * d, *Zi = s->tensor + (size_t)i * d * d;
    for (int64_t k = s->upper[i]; k < b->families.first[i + 1];
         k++, sigma += PD_SYMMETRIC) {
        const double g = pair_weight(b, s, i, k);
        if (g == 0)
            continue;
        const pd_local j = b->families.neighbour[k];
        double xi[3], x[3], T[9];
        bond(d, holds, b, i, j, xi, x);
        unpack(d, sigma, T);
        const double by_square = inverse_square(d, b, i, j, x);
        const double part = g * one_by_bearers(s, i, j);
        const double reaction = holds && is_held(b, j) ? mirror(b, i, j) : 1;
        double *fj = b->force + (size_t)j * (size_t)d;
        double *Zj = s->tensor + (size_t)j * (size_t)(d * d);
        for (int r = 0; r < d; r++) {
            const double t = dot(d, T + r * d, x) * by_square;
            fi[r] += reaction * g * t;
            fj[r] -= g * t;
            for (int c = 0; c < d; c++) {
                const double z = part * (T[r * d + c] - t * x[c]);
                Zi[r * d + c] += z;
                Zj[r * d + c] += z;
            }
        }
    }
}

/* Z of points that have a stress of their own. */
PD_INLINE void pull_points(const int d, pd_body *b)
{
    const state *s = b->own;
    for (pd_local i = 0; i < b->n_moving; i++) {
        double *Z = s->tensor + (size_t)i * d * d;
        unpack(d, s->sigma + (size_t)i * PD_SYMMETRIC, Z);
        for (int c = 0; c < d * d; c++)
            Z[c] *= s->share[i] > 0 ? s->volume[i] : 0;
    }
}

PD_INLINE void pull(const int d, pd_body *b)
{
    const size_t points = (size_t)b->n_local * (size_t)d;
    memset(b->force, 0, points * sizeof *b->force);
    memset(((state *)b->own)->tensor, 0, points * (size_t)d * sizeof(double));
    if (!is_associated(b)) {
        pull_points(d, b);
        return;
    }
    for (pd_local i = 0; i < b->n_moving; i++)
        if (beside_hold(b, i))
            pull_pairs(d, true, b, i);
        else
            pull_pairs(d, false, b, i);
}

/* Forces of Z_i on point i and its neighbours, w Z R Xi: eq. A.13, second term. */
PD_INLINE void spread_point(const int d, const int n, pd_body *b, pd_local i)
{
    const state *s = b->own;
    const bool holds = beside_hold(b, i);
    const int N = up_to_degree(d, n);
    const double *Z = s->tensor + (size_t)i * (size_t)(d * d);
    const double *R = s->rows + (size_t)i * (size_t)(d * N);
    double Z_R[3 * MOST_TERMS], *fi = b->force + (size_t)i * (size_t)d;
    for (int r = 0; r < d; r++)
        for (int c = 0; c < N; c++) {
            Z_R[r * N + c] = 0;
            for (int a = 0; a < d; a++)
                Z_R[r * N + c] += Z[r * d + a] * R[a * N + c];
        }
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k += LANES) {
        batch bonds;
        lanes f[3];
        gather(d, b, i, k, &bonds);
        apply_rows(d, n, Z_R, bonds.x, f);
        for (int l = 0; l < LANES; l++) {
            const pd_local j = bonds.j[l];
            const double reaction = holds && is_held(b, j) ? mirror(b, i, j) : 1;
            for (int a = 0; a < d; a++) {
                fi[a] += reaction * bonds.w[l] * f[a][l];
                b->force[(size_t)j * (size_t)d + (size_t)a] -= bonds.w[l] * f[a][l];
            }
        }
    }
}

PD_INLINE void spread(const int d, const int n, pd_body *b)
{
    memset(b->force + (size_t)b->n_owned * (size_t)d, 0,
           (size_t)(b->n_local - b->n_owned) * (size_t)d * sizeof *b->force);
    for (pd_local i = 0; i < b->n_moving; i++)
        if (((state *)b->own)->share[i] > 0)
            spread_point(d, n, b, i);
}

/* From forces (N) to densities; held points feel none. */
static void divide_by_volumes(pd_body *b)
{
    const size_t d = (size_t)b->options.dimension;
    for (pd_local i = 0; i < b->n_active; i++)
        for (size_t a = 0; a < d; a++)
            b->force[(size_t)i * d + a] *= i < b->n_moving ? 1 / b->volume[i] : 0;
}

static void forces(pd_body *b)
{
    find_kernels(b);
    if (b->options.dimension == 2)
        pull(2, b);
    else
        pull(3, b);
    SWEEP(b, spread, b)
    pd_halo_sum(b->halo, b->force, (size_t)b->options.dimension);
    divide_by_volumes(b);
}

/* ---- velocity gradients ---- */

/* L of point i, eq. A.1. */
PD_INLINE void point_gradient(const int d, const int n, pd_body *b, pd_local i)
{
    const state *s = b->own;
    const bool holds = beside_hold(b, i);
    const double *R = s->rows + (size_t)i * (size_t)(d * up_to_degree(d, n));
    double *L = s->tensor + (size_t)i * (size_t)(d * d);
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k += LANES) {
        batch bonds;
        lanes Phi[3];
        gather(d, b, i, k, &bonds);
        apply_rows(d, n, R, bonds.x, Phi);
        for (int l = 0; l < LANES; l++) {
            double dv[3];
            relative_velocity(d, holds, b, i, bonds.j[l], dv);
            for (int r = 0; r < d; r++)
                for (int c = 0; c < d; c++)
                    L[r * d + c] += bonds.w[l] * dv[r] * Phi[c][l];
        }
    }
}

PD_INLINE void point_gradients(const int d, const int n, pd_body *b)
{
    const state *s = b->own;
    memset(s->tensor, 0, (size_t)b->n_local * (size_t)(d * d) * sizeof *s->tensor);
    for (pd_local i = 0; i < b->n_moving; i++)
        if (s->share[i] > 0) /* elsewhere L stays 0 */
            point_gradient(d, n, b, i);
}

/* L of bond k of point i, eq. A.11; 0 for bonds that exert no force. */
PD_INLINE void bond_gradient(const int d, const bool holds, const pd_body *b, pd_local i,
                             int64_t k, double *L)
{
    const state *s = b->own;
    const pd_local j = b->families.neighbour[k];
    const double *Li = s->tensor + (size_t)i * (size_t)(d * d);
    const double *Lj = s->tensor + (size_t)j * (size_t)(d * d);
    const double part = b->weight[k] > 0 ? one_by_bearers(s, i, j) : 0;
    for (int c = 0; c < d * d; c++)
        L[c] = part * (Li[c] + Lj[c]);
    if (part == 0)
        return;
    double xi[3], x[3], dv[3];
    bond(d, holds, b, i, j, xi, x);
    relative_velocity(d, holds, b, i, j, dv);
    const double by_square = inverse_square(d, b, i, j, x);
    for (int r = 0; r < d; r++) {
        const double lack = (dv[r] - dot(d, L + r * d, x)) * by_square;
        for (int c = 0; c < d; c++)
            L[r * d + c] += lack * x[c];
    }
}

/* G: from the velocity gradient L where the step is `at` of the way through to the
 * displacement gradient of the step with respect to its middle: A (1 + (1/2 - at) A)^-1,
 * A = dt L. Zero, and false, where L is no motion that a body can make in a step. */
PD_INLINE bool step_gradient(const int d, const double *L, double dt, double at,
                             double *G)
{
    double A[9], to_middle[9], by_middle[9];
    for (int c = 0; c < d * d; c++)
        A[c] = dt * L[c], G[c] = 0;
    if (!(dot(d * d, A, A) < LARGEST_STEP * LARGEST_STEP))
        return false;
    if (at == 0.5) {
        memcpy(G, A, (size_t)(d * d) * sizeof *G);
        return true;
    }
    identity(d, to_middle);
    for (int c = 0; c < d * d; c++)
        to_middle[c] += (0.5 - at) * A[c];
    const double det = determinant(d, to_middle);
    if (!(det > PD_SMALLEST_J))
        return false;
    inverse(d, to_middle, 1 / det, by_middle);
    multiply(d, A, by_middle, G);
    return true;
}

/* ---- history ---- */

#define BLOCK 64 /* bonds, or points, whose G stays in the first-level cache */

typedef struct {
    size_t first, n; /* number of the first stress, and how many */
    double G[BLOCK * 9];
    pd_local point[BLOCK];
    int64_t bond[BLOCK];
} block;

static void update(pd_body *b, const block *steps)
{
    const state *s = b->own;
    b->options.material->update[b->options.plane](
        b->options.parameters, b->options.dimension, steps->n, steps->G,
        s->sigma + steps->first * PD_SYMMETRIC,
        s->plastic ? s->plastic + steps->first : NULL);
}

static void finish_pairs(pd_body *b, block *steps)
{
    const state *s = b->own;
    update(b, steps);
    for (size_t k = 0; b->broken && k < steps->n; k++) {
        const size_t pair = steps->first + k;
        damage_pair(b, steps->point[k], steps->bond[k], pair,
                    s->plastic ? s->plastic[pair] : 0,
                    von_mises(s->sigma + pair * PD_SYMMETRIC));
    }
    steps->first += steps->n;
    steps->n = 0;
}

PD_INLINE void advance_pairs(const int d, pd_body *b, double dt, double at)
{
    const state *s = b->own;
    block steps = {.n = 0};
    for (pd_local i = 0; i < b->n_active; i++)
        for (int64_t k = s->upper[i]; k < s->end[i]; k++) {
            double L[9];
            if (beside_hold(b, i))
                bond_gradient(d, true, b, i, k, L);
            else
                bond_gradient(d, false, b, i, k, L);
            step_gradient(d, L, dt, at, steps.G + steps.n * (size_t)(d * d));
            steps.point[steps.n] = i;
            steps.bond[steps.n] = k;
            if (++steps.n == BLOCK)
                finish_pairs(b, &steps);
        }
    if (steps.n > 0)
        finish_pairs(b, &steps);
}

PD_INLINE void advance_points(const int d, pd_body *b, double dt, double at)
{
    const state *s = b->own;
    const size_t moving = (size_t)b->n_moving;
    block steps;
    for (steps.first = 0; steps.first < moving; steps.first += steps.n) {
        steps.n = moving - steps.first < BLOCK ? moving - steps.first : BLOCK;
        for (size_t p = 0; p < steps.n; p++)
            step_gradient(d, s->tensor + (steps.first + p) * (size_t)(d * d), dt, at,
                          steps.G + p * (size_t)(d * d));
        update(b, &steps);
    }
}

/* Damage where stresses belong to points: a bond has the mean of its bearing ends. */
static void damage_between_points(pd_body *b)
{
    const state *s = b->own;
    for (pd_local i = 0; i < b->n_active; i++)
        for (int64_t k = s->upper[i]; k < s->end[i]; k++) {
            const pd_local ends[2] = {i, b->families.neighbour[k]};
            const double part = one_by_bearers(s, ends[0], ends[1]);
            double strain = 0, stress = 0;
            for (int e = 0; e < 2; e++) {
                if (s->share[ends[e]] == 0)
                    continue;
                strain += s->plastic ? part * s->plastic[ends[e]] : 0;
                stress +=
                    part * von_mises(s->sigma + (size_t)ends[e] * (size_t)PD_SYMMETRIC);
            }
            damage_pair(b, i, k, s->pair[i] + (size_t)(k - s->upper[i]), strain, stress);
        }
}

/* F over the step, (1 - G/2)^-1 (1 + G/2) F; false where the point turns inside out. */
PD_INLINE bool deform(const int d, const double *G, double *F, double *J)
{
    double before[9], after[9], by_before[9], H[9], F_new[9];
    identity(d, before);
    identity(d, after);
    for (int c = 0; c < d * d; c++)
        before[c] -= G[c] / 2, after[c] += G[c] / 2;
    const double det = determinant(d, before);
    if (!(det > PD_SMALLEST_J))
        return false;
    inverse(d, before, 1 / det, by_before);
    multiply(d, by_before, after, H);
    multiply(d, H, F, F_new);
    const double J_new = determinant(d, F_new);
    if (!(J_new > PD_SMALLEST_J && dot(d * d, F_new, F_new) < LARGEST_F * LARGEST_F))
        return false;
    memcpy(F, F_new, (size_t)(d * d) * sizeof *F);
    *J = J_new;
    return true;
}

/* A point that turns inside out has lost its history: it bears no stress from now on. */
PD_INLINE void deform_points(const int d, pd_body *b, double dt, double at)
{
    const state *s = b->own;
    for (pd_local i = 0; i < b->n_moving; i++) {
        double G[9], *F = b->F + (size_t)i * d * d;
        if (s->share[i] == 0)
            continue;
        if (step_gradient(d, s->tensor + (size_t)i * d * d, dt, at, G) &&
            deform(d, G, F, b->J + i))
            continue;
        b->carries[i] = PD_POINT_INVERTED;
        bear_no_stress(b, i);
    }
}

PD_INLINE void advance_all(const int d, pd_body *b, double dt, double at)
{
    if (is_associated(b))
        advance_pairs(d, b, dt, at);
    else
        advance_points(d, b, dt, at);
    if (b->broken && !is_associated(b)) {
        const state *s = b->own;
        pd_halo_copy(b->halo, s->sigma, PD_SYMMETRIC * sizeof *s->sigma);
        if (s->plastic)
            pd_halo_copy(b->halo, s->plastic, sizeof *s->plastic);
        damage_between_points(b);
    }
    deform_points(d, b, dt, at);
}

static void advance(pd_body *b, double dt, double at)
{
    const int d = b->options.dimension;
    double *L = ((state *)b->own)->tensor;
    pd_halo_copy(b->halo, b->v, (size_t)d * sizeof *b->v);
    SWEEP(b, point_gradients, b)
    pd_halo_copy(b->halo, L, (size_t)(d * d) * sizeof *L);
    if (b->options.dimension == 2)
        advance_all(2, b, dt, at);
    else
        advance_all(3, b, dt, at);
}

/* ---- what there is to see ---- */

/* values[n_owned][width] of points from those of pairs, the mean weighted by alpha. */
static void average(const pd_body *b, int width, const double *of_pairs, double *values)
{
    const state *s = b->own;
    memset(values, 0, (size_t)b->n_owned * (size_t)width * sizeof *values);
    for (pd_local i = 0; i < b->n_moving; i++)
        for (int64_t k = s->upper[i]; k < b->families.first[i + 1]; k++) {
            const pd_local j = b->families.neighbour[k];
            const size_t pair = s->pair[i] + (size_t)(k - s->upper[i]);
            const double to_i = b->weight[k] * s->share[i];
            const double to_j = b->weight[k] * s->volume[i] / s->volume[j] * s->share[j];
            for (int c = 0; c < width; c++) {
                const double value = of_pairs[pair * (size_t)width + (size_t)c];
                values[i * width + c] += to_i * value;
                if (j < b->n_owned)
                    values[j * width + c] += to_j * value;
            }
        }
}

static void show(const pd_body *b, int width, const double *history, double *values)
{
    if (history && is_associated(b)) {
        average(b, width, history, values);
        return;
    }
    for (pd_local i = 0; i < b->n_owned; i++)
        for (int c = 0; c < width; c++)
            values[i * width + c] =
                history && i < b->n_moving && b->carries[i] == PD_SOUND
                    ? history[i * width + c]
                    : 0;
}

static void stress(const pd_body *b, double *sigma, double *plastic)
{
    const state *s = b->own;
    if (sigma)
        show(b, PD_SYMMETRIC, s->sigma, sigma);
    if (plastic)
        show(b, 1, s->plastic, plastic);
}

static bool accepts(const pd_material *material, int d, pd_plane plane)
{
    return material->update[d == 2 ? plane : PD_PLANE_STRAIN];
}

/* ---- frequency ----
 *
 * The stiffness at rest is the sum over pairs of g B^T C B, B: u -> L_bond. The two terms
 * of L_bond = L (1 - n n^T) + (du/|x|) n^T are orthogonal, so that their squares add. Of
 * each, the row of a point has at most the sum over pairs of (M/rho) g |B's column of the
 * point| (sum of B's columns): row sums bound the eigenvalues. M, the modulus of plane
 * waves, is less than that of C for a change of volume, up to d times; sums of lengths
 * are longer than those of vectors by more than that, whatever Poisson's ratio (unit
 * tests measure it: the bound is 1.4 to 2.9 times the highest frequency). */

/* What a point contributes: sums of the columns of its L, Schur's weights of it, and the
 * second term's row. Fits into a tensor of two dimensions. */
typedef struct {
    double columns, own, weight, direct;
} bound;

/* |column| of every point in L_i: measures them, and adds weight_i times them to row. */
static void columns(const int d, const int n, const pd_body *b, pd_local i,
                    bound *measured, double *row)
{
    const state *s = b->own;
    bound *my = measured + i;
    double own[3] = {0}, sum = 0;
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k += LANES) {
        batch bonds;
        lanes Phi[3];
        gather(d, b, i, k, &bonds);
        apply_rows(d, n, s->rows + (size_t)i * (size_t)(d * up_to_degree(d, n)), bonds.x,
                   Phi);
        for (int l = 0; l < LANES; l++) {
            const pd_local j = bonds.j[l];
            const bool into_hold = is_held(b, j);
            double square = 0;
            for (int a = 0; a < d; a++) {
                const double column = bonds.w[l] * Phi[a][l];
                own[a] += into_hold ? mirror(b, i, j) * column : column;
                square += column * column;
            }
            sum += into_hold ? 0 : sqrt(square);
            if (row && !into_hold)
                row[j] += my->weight * sqrt(square);
        }
    }
    my->own = sqrt(dot(d, own, own));
    my->columns = sum + my->own;
    if (row)
        row[i] += my->weight * my->own;
}

/* Weights of points and the rows of the second term. */
static void weigh_columns(const pd_body *b, bound *measured)
{
    const int d = b->options.dimension;
    const state *s = b->own;
    for (pd_local i = 0; i < b->n_moving; i++)
        for (int64_t k = s->upper[i]; k < b->families.first[i + 1]; k++) {
            const pd_local j = b->families.neighbour[k];
            bound *mine = measured + i, *its = measured + j;
            const double part = one_by_bearers(s, i, j);
            const double g = pair_weight(b, s, i, k);
            const double row = part * part * (mine->columns + its->columns);
            double xi[3];
            subtract(d, b->X + (size_t)j * d, b->X + (size_t)i * d, xi);
            const double mirrored = is_held(b, j) ? mirror(b, i, j) : 0;
            const double ends = mirrored > 0 ? mirrored * mirrored : 2;
            mine->weight += g * row, its->weight += g * row;
            mine->direct += g * ends * inverse_square(d, b, i, j, xi);
            its->direct += g * ends * inverse_square(d, b, i, j, xi);
        }
}

static void frequency(const pd_body *b, double *omega2)
{
    const state *s = b->own;
    const size_t d = (size_t)b->options.dimension;
    const int n = order_of(b);
    const double c = pd_body_longitudinal_speed(b);
    bound *measured = (bound *)s->tensor; /* free between forces and advance */
    memset(measured, 0, (size_t)b->n_local * d * d * sizeof *s->tensor);
    memset(omega2, 0, (size_t)b->n_local * sizeof *omega2);
    for (pd_local i = 0; i < b->n_moving; i++)
        columns((int)d, n, b, i, measured, NULL);
    pd_halo_copy(b->halo, measured, sizeof *measured);
    if (is_associated(b))
        weigh_columns(b, measured);
    else
        for (pd_local i = 0; i < b->n_moving; i++)
            measured[i].weight = s->volume[i] * measured[i].columns;
    for (pd_local i = 0; i < b->n_moving; i++)
        columns((int)d, n, b, i, measured, omega2);
    pd_halo_sum(b->halo, omega2, 1);
    for (pd_local i = 0; i < b->n_moving; i++)
        omega2[i] = c * c * (omega2[i] + measured[i].direct) / b->volume[i];
}

/* ---- from step to step ----
 *
 * Stresses, plastic strains and soundness are integrated. Between forces and advance
 * weights and kernels live too; they follow from y, soundness and the volumes that they
 * were made with, which are J V but for points that just ceased to bear stress. */

static int keep(pd_body *b, pd_kept *kept)
{
    const state *s = b->own;
    const bool of_pairs = is_associated(b);
    const pd_kept all[] = {
        {.name = "stress",
         .unit = "Pa",
         .description = "Cauchy stress 11 22 33 12 23 13",
         .of = of_pairs ? PD_OF_PAIRS : PD_OF_POINTS,
         .width = PD_SYMMETRIC,
         .n = b->n_moving,
         .values = s->sigma},
        {.name = "plasticStrain",
         .unit = "-",
         .description = "equivalent plastic strain",
         .of = of_pairs ? PD_OF_PAIRS : PD_OF_POINTS,
         .width = 1,
         .n = b->n_moving,
         .values = s->plastic},
        {.name = "soundness",
         .unit = "-",
         .description = "what damage has left of a bond's influence",
         .of = PD_OF_PAIRS,
         .width = 1,
         .may_lack = true,
         .values = s->soundness},
        {.name = "weighedVolume",
         .unit = "m^d",
         .description = "volume that the last weights were made with",
         .of = PD_OF_POINTS,
         .width = 1,
         .n = b->n_local,
         .values = s->volume},
    };
    int n = 0;
    for (size_t k = 0; k < sizeof all / sizeof *all; k++)
        if (all[k].values)
            kept[n++] = all[k];
    return n;
}

/* ---- the table ---- */

static const pd_parameter parameters[] = {
    [ORDER] = {.key = "order",
               .unit = "-",
               .above = 0,
               .below = LARGEST_ORDER + 1,
               .meaning = "order of the polynomials whose gradients are exact",
               .kind = PD_INTEGER,
               .optional = true,
               .standard = 2},
    [ASSOCIATION] = {.key = "bondAssociation",
                     .unit = "-",
                     .above = 0,
                     .below = 2,
                     .includes_above = true,
                     .meaning = "stresses of bonds; without, of points, which has modes "
                                "without energy",
                     .kind = PD_FLAG,
                     .optional = true,
                     .standard = 1},
};

const pd_formulation pd_formulation_bond_associated = {
    .name = "bondAssociated",
    .source = "[behzadinasab2021] appendices A, C",
    .least_dimension = 2,
    .ghost_layers = 1,
    .criteria = PD_BY_STRETCH | PD_BY_STRESS | PD_BY_PLASTIC_STRAIN,
    .n_parameters = sizeof parameters / sizeof *parameters,
    .parameters = parameters,
    .accepts = accepts,
    .prepare = prepare,
    .release = release,
    .forces = forces,
    .advance = advance,
    .keep = keep,
    .resume = derive_kernels,
    .stress = stress,
    .wave_speed = pd_body_longitudinal_speed,
    .frequency = frequency,
};
