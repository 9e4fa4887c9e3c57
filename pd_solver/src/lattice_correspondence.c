/*
 * Correspondence on a lattice, [kim2023] eqs 24-30; compiled once for each instruction
 * set. force_correspondence.c says what is computed, lattice.h how.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "correspondence.h"
#include "damage.h"
#include "lanes.h"

void PD_FOR_THIS_SET(pd_lattice_correspondence)(pd_body *b);
void PD_FOR_THIS_SET(pd_lattice_shapes)(pd_body *b);

/* ---- shapes ---- */

/* K^-1 of the lanes of a chunk with gaps. One piece of code for new bodies and for bonds
 * that break later: inlined here and there it would round differently, and a body that is
 * loaded from a file would not go on as the one that was saved. */
static __attribute__((noinline)) void invert_lanes(pd_body *b, const pd_chunk *c)
{
    for (int q = 0; q < c->count; q++)
        invert_lane(b, c, q);
}

void PD_FOR_THIS_SET(pd_lattice_shapes)(pd_body *b)
{
    const pd_lattice *l = b->lattice;
    for (int64_t m = 0; m < l->regular.first[l->planes]; m++)
        if (!chunk_is_whole(&l->regular.chunk[m]))
            invert_lanes(b, &l->regular.chunk[m]);
}

/* Call f(d, axes, ...) with literal axes. */
#define FOR_AXES(d, axes, f, ...)                                                        \
    switch (axes) {                                                                      \
    case 1:                                                                              \
        f(d, 1, __VA_ARGS__);                                                            \
        break;                                                                           \
    case 2:                                                                              \
        f(d, 2, __VA_ARGS__);                                                            \
        break;                                                                           \
    case 3:                                                                              \
        f(d, 3, __VA_ARGS__);                                                            \
        break;                                                                           \
    case 4:                                                                              \
        if (d == 3)                                                                      \
            f(d, 4, __VA_ARGS__);                                                        \
        break;                                                                           \
    case 5:                                                                              \
        if (d == 3)                                                                      \
            f(d, 5, __VA_ARGS__);                                                        \
        break;                                                                           \
    case 6:                                                                              \
        if (d == 3)                                                                      \
            f(d, 6, __VA_ARGS__);                                                        \
        break;                                                                           \
    default:                                                                             \
        if (d == 3)                                                                      \
            f(d, 7, __VA_ARGS__);                                                        \
    }

/* ---- deformation gradients ---- */

/* S += w Y (x) xi of whole families, over a run and its mirror: Y - Y' counts for both.
 */
PD_INLINE void add_run(const int d, const int axes, const bool breaks,
                       const pd_lattice *l, const pd_run *run, const pd_ring *ring,
                       int64_t cell, const double *const *around, const lanes *here,
                       lanes *S, lane_mask *over)
{
    for (int k = run->first; k < run->end; k++) {
        const pd_offset *o = &l->offset[k], *mirrored = &l->offset[l->n_offsets - 1 - k];
        const double *one = around[o->plane] + cell + ring->shift[k];
        const double *two = around[mirrored->plane] + cell - ring->shift[k];
        lanes Y[3], square = {0}, square_of_two = {0};
        for (int r = 0; r < d; r++) {
            const lanes y1 = PD_LOAD(one + r * l->row), y2 = PD_LOAD(two + r * l->row);
            Y[r] = y1 - y2;
            if (breaks) {
                square += (y1 - here[r]) * (y1 - here[r]);
                square_of_two += (y2 - here[r]) * (y2 - here[r]);
            }
        }
        for (int r = 0; r < d; r++)
            for (int t = 0; t < d; t++)
                if (axes >> t & 1)
                    S[r * d + t] += Y[r] * o->weight_xi[t];
        if (breaks)
            *over |= lanes_above(square, o->too_long + (lanes){0}) |
                     lanes_above(square_of_two, o->too_long + (lanes){0});
    }
}

PD_INLINE void add_whole(const int d, const bool breaks, const pd_lattice *l,
                         const pd_ring *ring, int64_t cell, const double *const *around,
                         const lanes *here, lanes *S, lane_mask *over)
{
    for (const pd_run *run = l->run; run->first < l->n_offsets / 2; run++)
        FOR_AXES(d, run->axes, add_run, breaks, l, run, ring, cell, around, here, S,
                 over);
}

/* S += w Y (x) xi of families with gaps. */
PD_INLINE void add_gapped(const int d, const bool breaks, const pd_lattice *l,
                          const pd_ring *ring, const pd_chunk *c, int part, int64_t cell,
                          const double *const *around, const lanes *here, lanes *S,
                          lane_mask *over)
{
    for (int k = 0; k < l->n_offsets; k++) {
        const pd_offset *o = &l->offset[k];
        const double *there = around[o->plane] + cell + ring->shift[k];
        const lane_mask bonds = lanes_of(c->bonds[k], part);
        lanes Y[3], square = {0};
        for (int r = 0; r < d; r++) {
            Y[r] = select_lanes(bonds, PD_LOAD(there + r * l->row) - here[r]);
            if (breaks)
                square += Y[r] * Y[r];
        }
        for (int r = 0; r < d; r++)
            for (int t = 0; t < d; t++)
                S[r * d + t] += Y[r] * o->weight_xi[t];
        if (breaks)
            *over |= lanes_above(square, o->too_long + (lanes){0});
    }
}

/* sum_j w Y (x) xi of the lanes of a chunk from `part` on; is some bond that weighs
 * longer than s_c |xi|? */
PD_INLINE bool part_sum(const int d, const bool breaks, const pd_lattice *l,
                        const pd_ring *ring, const pd_chunk *c, int part,
                        const double *const *around, double (*sum)[PD_LANES])
{
    const int64_t cell = ring_cell(ring, c) + part;
    lanes here[3], S[9] = {{0}};
    lane_mask over = {0};
    for (int r = 0; r < d; r++)
        here[r] = PD_LOAD(around[l->reach] + cell + r * l->row);
    if (!chunk_is_whole(c))
        add_gapped(d, breaks, l, ring, c, part, cell, around, here, S, &over);
    else
        add_whole(d, breaks, l, ring, cell, around, here, S, &over);
    for (int t = 0; t < d * d; t++)
        PD_STORE(sum[t] + part, S[t]);
    return breaks && any_lane(over, c->count - part);
}

/* That of all lanes, after breaking what is too long. */
PD_INLINE void chunk_sum(const int d, const bool breaks, pd_body *b, int64_t z,
                         pd_chunk *c, const double *const *around, double s_c2,
                         double (*sum)[PD_LANES])
{
    const sweeps *own = b->own;
    for (bool again = true; again;) {
        bool over = false;
        PD_FOR_PARTS (part, c->count)
            over |= part_sum(d, breaks, b->lattice, &own->y, c, part, around, sum);
        again = over && pd_damage_break_chunk(b, z, c, s_c2);
        if (again)
            invert_lanes(b, c);
    }
}

/* ---- a few chunks at a time, points last ---- */

typedef struct {
    int chunks;
    double F[9 * PD_BLOCK], J[PD_BLOCK], P[9 * PD_BLOCK];
    double K_inverse[PD_BLOCK / PD_LANES][9][PD_LANES]; /* of chunks with gaps */
} block;

/* K^-1 of the lanes of a chunk with gaps. */
PD_INLINE void take_shapes(const int d, const pd_body *b, const pd_chunk *c,
                           double (*K_inverse)[PD_LANES])
{
    for (int t = 0; t < d * d; t++)
        for (int q = 0; q < PD_LANES; q++)
            K_inverse[t][q] =
                q < c->count ? b->K_inverse[(size_t)(c->point + q) * d * d + t] : 0;
}

/* K^-1 of the lanes from `part` on. */
PD_INLINE void shape_lanes(const int d, const sweeps *own, const pd_chunk *c,
                           const double (*K_inverse)[PD_LANES], int part, lanes *K)
{
    for (int t = 0; t < d * d; t++)
        if (chunk_is_whole(c))
            K[t] = own->K_inverse[t] + (lanes){0};
        else
            K[t] = PD_LOAD(K_inverse[t] + part);
}

PD_INLINE void multiply_lanes(const int d, const lanes *A, const lanes *B, lanes *C)
{
    for (int r = 0; r < d; r++)
        for (int c = 0; c < d; c++) {
            C[r * d + c] = A[r * d] * B[c];
            for (int k = 1; k < d; k++)
                C[r * d + c] += A[r * d + k] * B[k * d + c];
        }
}

PD_INLINE lanes determinant_lanes(const int d, const lanes *T)
{
    if (d == 2)
        return T[0] * T[3] - T[1] * T[2];
    return T[0] * (T[4] * T[8] - T[5] * T[7]) - T[1] * (T[3] * T[8] - T[5] * T[6]) +
           T[2] * (T[3] * T[7] - T[4] * T[6]);
}

/* F and J of chunk m of the block from its sum, [kim2023] eq. 25. */
PD_INLINE void deform_chunk(const int d, pd_body *b, const pd_chunk *c, int m, block *at,
                            double (*sum)[PD_LANES])
{
    const int n = at->chunks * PD_LANES;
    if (!chunk_is_whole(c))
        take_shapes(d, b, c, at->K_inverse[m]);
    for (int part = 0; part < PD_LANES; part += PD_WIDTH) {
        lanes S[9], K[9], F[9];
        for (int t = 0; t < d * d; t++)
            S[t] = PD_LOAD(sum[t] + part);
        shape_lanes(d, b->own, c, (const double(*)[PD_LANES])at->K_inverse[m], part, K);
        multiply_lanes(d, S, K, F);
        for (int t = 0; t < d * d; t++)
            PD_STORE(at->F + t * n + m * PD_LANES + part, F[t]);
        PD_STORE(at->J + m * PD_LANES + part, determinant_lanes(d, F));
    }
}

/* Which lanes carry stress; where none is carried F is the identity. Keeps F and J. */
PD_INLINE void judge_chunk(const int d, pd_body *b, const pd_chunk *c, int m, block *at)
{
    const int n = at->chunks * PD_LANES;
    double *F = at->F + m * PD_LANES, *J = at->J + m * PD_LANES;
    for (int q = 0; q < PD_LANES; q++) {
        unsigned char *carries = &b->carries[c->point + q];
        const bool there = q < c->count;
        if (there && *carries != PD_POINT_SINGULAR)
            *carries = J[q] > PD_SMALLEST_J ? PD_SOUND : PD_POINT_INVERTED;
        if (there && *carries == PD_SOUND)
            continue;
        for (int t = 0; t < d * d; t++)
            F[t * n + q] = t % (d + 1) == 0;
        J[q] = 1;
    }
    double *kept = b->F + (size_t)c->point * d * d;
    for (int q = 0; q < c->count; q++) {
        for (int t = 0; t < d * d; t++)
            kept[q * d * d + t] = F[t * n + q];
        b->J[c->point + q] = J[q];
    }
}

/* Q = P K^-1 - g F of a chunk into the ring's plane; 0 where no stress is carried. */
PD_INLINE void load_chunk(const int d, const bool control, pd_body *b, const pd_chunk *c,
                          int m, const block *at, double *plane)
{
    const pd_lattice *l = b->lattice;
    const sweeps *own = b->own;
    const int n = at->chunks * PD_LANES;
    double *cell = plane + ring_cell(&own->Q, c);
    unsigned char sound = 0;
    double g[PD_LANES] = {0};
    for (int q = 0; q < c->count; q++) {
        const pd_local i = c->point + q;
        sound |= (unsigned char)((b->carries[i] == PD_SOUND) << q);
        if (control)
            g[q] = chunk_is_whole(c) ? own->g : b->control[i];
    }
    for (int part = 0; part < PD_LANES; part += PD_WIDTH) {
        const int64_t lane = m * PD_LANES + part;
        const lane_mask carries = lanes_of(sound, part);
        lanes P[9], K[9], Q[9];
        for (int t = 0; t < d * d; t++)
            P[t] = PD_LOAD(at->P + t * n + lane);
        shape_lanes(d, own, c, at->K_inverse[m], part, K);
        multiply_lanes(d, P, K, Q);
        for (int t = 0; t < d * d; t++) {
            if (control)
                Q[t] -= PD_LOAD(g + part) * PD_LOAD(at->F + t * n + lane);
            PD_STORE(cell + t * l->row + part, select_lanes(carries, Q[t]));
        }
        if (control)
            PD_STORE(cell + d * d * l->row + part,
                     select_lanes(carries, PD_LOAD(g + part)));
    }
}

/* Q of a chunk, from the ring's plane, for the points of the general path. */
PD_INLINE void export_chunk(const int d, pd_body *b, const pd_chunk *c,
                            const double *plane)
{
    const pd_lattice *l = b->lattice;
    const sweeps *own = b->own;
    const double *cell = plane + ring_cell(&own->Q, c);
    for (int q = 0; q < c->count; q++) {
        const size_t i = (size_t)(c->point + q);
        for (int t = 0; t < d * d; t++)
            b->Q[i * (size_t)(d * d) + (size_t)t] = cell[t * l->row + q];
        if (b->control && chunk_is_whole(c))
            b->control[i] = own->g;
    }
}

/* F, P and Q of `chunks` chunks of plane z. */
PD_INLINE void visit_block(const int d, const bool breaks, const bool control, pd_body *b,
                           int64_t z, pd_chunk *c, int chunks, const double *const *y,
                           double s_c2, double *plane)
{
    block at;
    at.chunks = chunks;
    for (int m = 0; m < chunks; m++) {
        double sum[9][PD_LANES] = {{0}};
        chunk_sum(d, breaks, b, z, c + m, y, s_c2, sum);
        deform_chunk(d, b, c + m, m, &at, sum);
        judge_chunk(d, b, c + m, m, &at);
    }
    stress_points(d, b, (size_t)(chunks * PD_LANES), at.F, at.J, at.P);
    for (int m = 0; m < chunks; m++) {
        load_chunk(d, control, b, c + m, m, &at, plane);
        if (c[m].exports)
            export_chunk(d, b, c + m, plane);
    }
}

/* Q of the points of the general path into the ring's plane. */
PD_INLINE void copy_others(const int d, const pd_body *b, int64_t z, double *plane)
{
    const pd_lattice *l = b->lattice;
    for (int64_t m = l->other.first[z]; m < l->other.first[z + 1]; m++) {
        const pd_chunk *c = &l->other.chunk[m];
        const int64_t cell = ring_cell(&((const sweeps *)b->own)->Q, c);
        for (int q = 0; q < c->count; q++) {
            const size_t i = (size_t)(c->point + q);
            for (int t = 0; t < d * d; t++)
                plane[cell + q + t * l->row] = b->Q[i * (size_t)(d * d) + (size_t)t];
            if (b->control)
                plane[cell + q + d * d * l->row] = control_now(b, c->point + q);
        }
    }
}

/* ---- forces ---- */

/* Lanes from `part` on that have a point. */
PD_INLINE lane_mask lanes_there(const pd_chunk *c, int part)
{
    return lanes_of((unsigned char)((1u << c->count) - 1), part);
}

/* In space: Q of a plane around the cells of a chunk, row by row: Q_rt(x + a) - Q_rt(x -
 * a) for t = 0, the axis along which rows go, and Q_rt(x + a) + Q_rt(x - a) for others
 * (Q_rt at a = 0, where nothing is along). Two offsets mirrored along the row are so one,
 * aligned, and rows serve the chunks of all planes and rows around. */
typedef struct {
    double sum[PD_MOST_FOLDED][9][PD_LANES] __attribute__((aligned(64)));
    int64_t key[2 * PD_MOST_REACH + 1]; /* which row and x a row of it stands for */
} folded;

PD_INLINE int64_t key_of(int32_t x, int32_t row)
{
    return (int64_t)x << 32 | (uint32_t)row;
}

PD_INLINE void fold_row(const int d, const pd_lattice *l, const double *Q,
                        double (*sum)[9][PD_LANES])
{
    for (int part = 0; part < PD_LANES; part += PD_WIDTH)
        for (int c = 0; c < d * d; c++) {
            const double *q = Q + c * l->row + part;
            const lanes here = PD_LOAD(q);
            PD_STORE(sum[0][c] + part, here);
            for (int a = 1; a <= l->reach; a++)
                if (c % d == 0)
                    PD_STORE(sum[a][c] + part, PD_LOAD(q + a) - PD_LOAD(q - a));
                else
                    PD_STORE(sum[a][c] + part, PD_LOAD(q + a) + PD_LOAD(q - a));
        }
}

/* Have the rows around chunk c; at[reach + rows] is where each begins. */
PD_INLINE void fold_rows(const int d, const pd_lattice *l, const pd_ring *ring,
                         const pd_chunk *c, const double *plane, folded *all,
                         const double (**at)[9][PD_LANES])
{
    const int slots = 2 * l->reach + 1;
    for (int rows = -l->reach; rows <= l->reach; rows++) {
        const int32_t row = c->row + rows;
        const int slot = row % slots;
        double(*sum)[9][PD_LANES] = all->sum + slot * (l->reach + 1);
        at[l->reach + rows] = (const double(*)[9][PD_LANES])sum;
        if (all->key[slot] == key_of(c->x, row))
            continue;
        all->key[slot] = key_of(c->x, row);
        fold_row(d, l, plane + ring_cell(ring, c) + rows * ring->stride, sum);
    }
}

/* terms[r][t] += w Q_rt xi_t of whole families over the plane at s of those around; Q_i
 * cancels. */
PD_INLINE void add_forces(const int d, const pd_lattice *l, int s, int part,
                          const double (*const *at)[9][PD_LANES], lanes *terms)
{
    for (int m = l->folds_of[s]; m < l->folds_of[s + 1]; m++) {
        const pd_fold *fold = &l->fold[m];
        const double *w_xi = l->offset[fold->offset].weight_xi;
        const double(*sum)[PD_LANES] = at[l->reach + fold->rows][fold->along];
        for (int r = 0; r < d; r++)
            for (int t = 0; t < d; t++)
                terms[r * d + t] += PD_LOAD(sum[r * d + t] + part) * w_xi[t];
    }
}

/* The same of families with gaps, over a run of offsets. */
PD_INLINE void add_gapped_forces(const int d, const int axes, const pd_lattice *l,
                                 const pd_run *run, const pd_ring *ring,
                                 const pd_chunk *c, int part, const double *const *Q,
                                 lanes *terms)
{
    const int64_t row = l->row, cell = ring_cell(ring, c) + part;
    for (int k = run->first; k < run->end; k++) {
        const pd_offset *o = &l->offset[k];
        const double *Qj = Q[o->plane] + cell + ring->shift[k];
        const lane_mask bonds = lanes_of(c->bonds[k], part);
        lanes w_xi[3];
        for (int t = 0; t < d; t++)
            w_xi[t] = select_lanes(bonds, o->weight_xi[t] + (lanes){0});
        for (int r = 0; r < d; r++, Qj += d * row)
            for (int t = 0; t < d; t++)
                if (axes >> t & 1)
                    terms[r * d + t] += PD_LOAD(Qj + t * row) * w_xi[t];
    }
}

/* terms[r][t] += Q_rt sum w xi_t of the points themselves, 0 but for families with gaps.
 */
PD_INLINE void add_own_forces(const int d, const sweeps *own, int64_t row,
                              const double *Q, const pd_chunk *c, int part, lanes *terms)
{
    const double *moment = own->moment + (size_t)c->point * d;
    double of_lane[3][PD_LANES] = {{0}};
    for (int q = 0; q < c->count; q++)
        for (int t = 0; t < d; t++)
            of_lane[t][q] = moment[q * d + t];
    for (int r = 0; r < d; r++)
        for (int t = 0; t < d; t++)
            terms[r * d + t] +=
                PD_LOAD(Q + (r * d + t) * row) * PD_LOAD(of_lane[t] + part);
}

/* Add what Q of the plane at s of those around a chunk gives to its force, [kim2023] eqs
 * 28-29. A plane's Q is so read while it is near, not with those of all planes around. */
PD_INLINE void add_plane_forces(const int d, const pd_lattice *l, const sweeps *rings,
                                const pd_chunk *c, int s, const double *plane,
                                folded *all, double *force)
{
    const bool whole = chunk_is_whole(c);
    const double(*at[2 * PD_MOST_REACH + 1])[9][PD_LANES];
    const double *planes[2 * PD_MOST_REACH + 1];
    planes[s] = plane;
    for (int r = 0; r < d; r++) /* rows of other planes are far away */
        __builtin_prefetch(force + ring_cell(&rings->force, c) + r * l->row, 1);
    if (whole)
        fold_rows(d, l, &rings->Q, c, plane, all, at);
    PD_FOR_PARTS (part, c->count) {
        const double *Q = plane + ring_cell(&rings->Q, c) + part;
        double *f = force + ring_cell(&rings->force, c) + part;
        const lane_mask there = lanes_there(c, part);
        lanes terms[9] = {{0}};
        if (whole)
            add_forces(d, l, s, part, at, terms);
        else {
            if (s == l->reach)
                add_own_forces(d, rings, l->row, Q, c, part, terms);
            for (int m = l->runs_of[s]; m < l->runs_of[s + 1]; m++)
                FOR_AXES(d, l->run[m].axes, add_gapped_forces, l, &l->run[m], &rings->Q,
                         c, part, planes, terms)
        }
        for (int r = 0; r < d; r++) {
            lanes sum = terms[r * d];
            for (int t = 1; t < d; t++)
                sum += terms[r * d + t];
            /* Lanes beyond are of the next chunk. */
            PD_STORE(f + r * l->row, PD_LOAD(f + r * l->row) + select_lanes(there, sum));
        }
    }
}

/* terms += w (Q_j - Q_j') xi of whole families, over a run and its mirror. */
PD_INLINE void add_run_forces(const int d, const int axes, const pd_lattice *l,
                              const pd_run *run, const pd_ring *ring, int64_t cell,
                              const double *const *Q, lanes *terms)
{
    const int64_t row = l->row;
    for (int k = run->first; k < run->end; k++) {
        const pd_offset *o = &l->offset[k], *mirrored = &l->offset[l->n_offsets - 1 - k];
        const double *one = Q[o->plane] + cell + ring->shift[k];
        const double *two = Q[mirrored->plane] + cell - ring->shift[k];
        for (int r = 0; r < d; r++, one += d * row, two += d * row)
            for (int t = 0; t < d; t++)
                if (axes >> t & 1)
                    terms[r * d + t] +=
                        (PD_LOAD(one + t * row) - PD_LOAD(two + t * row)) *
                        o->weight_xi[t];
    }
}

/* Force density of the lanes of a chunk from `part` on, all planes around being at hand.
 * In two dimensions they are rows, and near. */
PD_INLINE void gather_forces(const int d, const pd_lattice *l, const sweeps *rings,
                             const pd_chunk *c, int part, const double *const *Q,
                             lanes *f)
{
    const int64_t cell = ring_cell(&rings->Q, c) + part;
    lanes terms[9] = {{0}};
    const pd_run *run = l->run;
    if (chunk_is_whole(c))
        for (; run->first < l->n_offsets / 2; run++)
            FOR_AXES(d, run->axes, add_run_forces, l, run, &rings->Q, cell, Q, terms)
    else {
        add_own_forces(d, rings, l->row, Q[l->reach] + cell, c, part, terms);
        for (const pd_run *end = run + l->runs_of[2 * l->reach + 1]; run < end; run++)
            FOR_AXES(d, run->axes, add_gapped_forces, l, run, &rings->Q, c, part, Q,
                     terms)
    }
    for (int r = 0; r < d; r++) {
        f[r] = terms[r * d];
        for (int t = 1; t < d; t++)
            f[r] += terms[r * d + t];
    }
}

/* f += w (g_i + g_j) Y; y: planes of positions. */
PD_INLINE void add_control(const int d, const pd_lattice *l, const sweeps *rings,
                           const pd_chunk *c, int part, const double *const *Q,
                           const double *const *y, lanes *f)
{
    const int64_t here = ring_cell(&rings->Q, c) + part + d * d * l->row;
    const int64_t y_here = ring_cell(&rings->y, c) + part;
    const lanes g = PD_LOAD(Q[l->reach] + here);
    lanes yi[3];
    for (int r = 0; r < d; r++)
        yi[r] = PD_LOAD(y[l->reach] + y_here + r * l->row);
    for (int k = 0; k < l->n_offsets; k++) {
        const pd_offset *o = &l->offset[k];
        const double *yj = y[o->plane] + y_here + rings->y.shift[k];
        lanes w_g = o->weight * (g + PD_LOAD(Q[o->plane] + here + rings->Q.shift[k]));
        if (!chunk_is_whole(c))
            w_g = select_lanes(lanes_of(c->bonds[k], part), w_g);
        for (int r = 0; r < d; r++)
            f[r] += w_g * (PD_LOAD(yj + r * l->row) - yi[r]);
    }
}

/* Force density of `there` lanes of a chunk out of the ring, which is left at 0; lanes
 * beyond are of the next chunk. */
PD_INLINE void take_forces(const int d, int64_t row, lane_mask there, double *cell,
                           lanes *f)
{
    for (int r = 0; r < d; r++) {
        const lanes all = PD_LOAD(cell + r * row);
        f[r] = select_lanes(there, all);
        PD_STORE(cell + r * row, select_lanes(~there, all));
    }
}

/* Keep the force density of a chunk; plane: of the ring of forces. */
PD_INLINE void keep_force(const int d, const bool control, pd_body *b, const pd_chunk *c,
                          const double *const *Q, const double *const *y, double *plane)
{
    const pd_lattice *l = b->lattice;
    const sweeps *rings = b->own;
    double force[3][PD_LANES];
    PD_FOR_PARTS (part, c->count) {
        lanes f[3];
        if (d == 3)
            take_forces(d, l->row, lanes_there(c, part),
                        plane + ring_cell(&rings->force, c) + part, f);
        else
            gather_forces(d, l, rings, c, part, Q, f);
        if (control)
            add_control(d, l, rings, c, part, Q, y, f);
        for (int r = 0; r < d; r++)
            PD_STORE(force[r] + part, f[r]);
    }
    double *kept = b->force + (size_t)c->point * d;
    for (int q = 0; q < c->count; q++)
        for (int r = 0; r < d; r++)
            kept[q * d + r] = force[r][q];
}

/* ---- all of it ---- */

/* Planes of a ring around plane z. */
PD_INLINE void planes_around(const pd_ring *ring, int reach, int64_t z,
                             const double **around)
{
    for (int s = 0; s <= 2 * reach; s++)
        around[s] = ring_plane(ring, z - reach + s);
}

/* F, P and Q of plane z. */
PD_INLINE void visit_plane(const int d, const bool breaks, const bool control, pd_body *b,
                           int64_t z, double s_c2)
{
    const pd_lattice *l = b->lattice;
    const sweeps *own = b->own;
    const int64_t end = l->regular.first[z + 1], most = PD_BLOCK / PD_LANES;
    const double *y[2 * PD_MOST_REACH + 1];
    double *plane = ring_plane(&own->Q, z);
    planes_around(&own->y, l->reach, z, y);
    for (int64_t m = l->regular.first[z]; m < end; m += most)
        visit_block(d, breaks, control, b, z, &l->regular.chunk[m],
                    (int)(end - m < most ? end - m : most), y, s_c2, plane);
    copy_others(d, b, z, plane);
}

/* Add what plane z gives to the forces of the planes around it, column by column. */
PD_INLINE void spread_plane(const int d, const pd_body *b, int64_t z)
{
    const pd_lattice *l = b->lattice;
    const sweeps *own = b->own;
    const pd_chunk *chunk = l->regular.chunk;
    const double *Q = ring_plane(&own->Q, z);
    const int32_t *next[2 * PD_MOST_REACH + 1], *end[2 * PD_MOST_REACH + 1];
    folded all;
    for (int slot = 0; slot <= 2 * l->reach; slot++) {
        const int64_t to = z - slot + l->reach;
        const bool there = to >= 0 && to < l->planes;
        all.key[slot] = -1;
        next[slot] = l->column + (there ? l->column_of[to] : 0);
        end[slot] = there ? l->column + l->column_of[to + 1] : next[slot];
    }
    for (;;) {
        int64_t key = INT64_MAX;
        for (int s = 0; s <= 2 * l->reach; s++) {
            const int64_t k =
                next[s] < end[s] ? key_of(chunk[*next[s]].x, chunk[*next[s]].row) : key;
            key = k < key ? k : key;
        }
        if (key == INT64_MAX)
            break;
        for (int s = 0; s <= 2 * l->reach; s++) {
            if (next[s] == end[s] ||
                key_of(chunk[*next[s]].x, chunk[*next[s]].row) != key)
                continue;
            const pd_chunk *c = &chunk[*next[s]++];
            add_plane_forces(d, l, own, c, s, Q, &all,
                             ring_plane(&own->force, z - s + l->reach));
        }
    }
}

PD_INLINE void finish_plane(const int d, const bool control, pd_body *b, int64_t z)
{
    const pd_lattice *l = b->lattice;
    const sweeps *own = b->own;
    const double *y[2 * PD_MOST_REACH + 1], *Q[2 * PD_MOST_REACH + 1];
    double *force = NULL;
    if (control)
        planes_around(&own->y, l->reach, z, y);
    if (control || d == 2)
        planes_around(&own->Q, l->reach, z, Q);
    if (d == 3)
        force = ring_plane(&own->force, z);
    for (int64_t m = l->regular.first[z]; m < l->regular.first[z + 1]; m++)
        if (!l->regular.chunk[m].is_ghost)
            keep_force(d, control, b, &l->regular.chunk[m], Q, y, force);
}

PD_INLINE void sweep(const int d, const bool breaks, const bool control, pd_body *b)
{
    pd_lattice *l = b->lattice;
    const sweeps *own = b->own;
    const double s_c = breaks ? pd_body_critical_stretch(b, 0, 0) : 0;
    set_too_long(l, s_c);
    for (int64_t z = -l->reach; z < l->planes + l->reach + own->delay; z++) {
        const int64_t known = z - own->delay, done = known - l->reach;
        if (z + l->reach >= l->ghosts_from)
            pd_halo_end(b->halo);
        pd_ring_fill(d, b, z + l->reach, b->y, &own->y);
        if (z >= 0 && z < l->planes)
            visit_plane(d, breaks, control, b, z, s_c * s_c);
        if (d == 3 && known >= 0 && known < l->planes)
            spread_plane(d, b, known);
        if (done >= 0)
            finish_plane(d, control, b, done);
    }
}

/* Each in a function of its own: what one scene does not use shall not cost it registers.
 */
#define SWEEP(name, d, breaks, control)                                                  \
    static __attribute__((noinline)) void name(pd_body *b)                               \
    {                                                                                    \
        sweep(d, breaks, control, b);                                                    \
    }
SWEEP(sweep_2, 2, false, false)
SWEEP(sweep_2_control, 2, false, true)
SWEEP(sweep_2_breaks, 2, true, false)
SWEEP(sweep_2_breaks_control, 2, true, true)
SWEEP(sweep_3, 3, false, false)
SWEEP(sweep_3_control, 3, false, true)
SWEEP(sweep_3_breaks, 3, true, false)
SWEEP(sweep_3_breaks_control, 3, true, true)

void PD_FOR_THIS_SET(pd_lattice_correspondence)(pd_body *b)
{
    static void (*const sweeps_of[2][2][2])(pd_body *) = {
        {{sweep_2, sweep_2_control}, {sweep_2_breaks, sweep_2_breaks_control}},
        {{sweep_3, sweep_3_control}, {sweep_3_breaks, sweep_3_breaks_control}},
    };
    sweeps_of[b->options.dimension == 3][pd_body_can_break(&b->options)][!!b->control](b);
}
