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

/* sum_j w Y (x) xi of the lanes of a chunk from `part` on; is some bond that weighs
 * longer than s_c |xi|? */
PD_INLINE bool part_sum(const int d, const bool breaks, const bool gapped,
                        const pd_lattice *l, const pd_ring *ring, const pd_chunk *c,
                        int part, const double *const *around, double s_c2,
                        double (*sum)[PD_LANES])
{
    const int64_t cell = ring_cell(ring, c) + part;
    const double *y = around[l->reach] + cell;
    lanes here[3], S[9] = {{0}};
    lane_bits over = {0}, bonds = {0};
    for (int a = 0; a < d; a++)
        here[a] = PD_LOAD(y + a * l->row);
    for (int k = 0; k < l->n_offsets; k++) {
        const pd_offset *o = &l->offset[k];
        const double *there = around[o->plane] + cell + ring->shift[k];
        lanes Y[3], square = {0};
        if (gapped)
            bonds = lanes_of(c->bonds[k], part);
        for (int a = 0; a < d; a++) {
            Y[a] = PD_LOAD(there + a * l->row) - here[a];
            if (gapped)
                Y[a] = select_lanes(bonds, Y[a]);
            if (breaks)
                square += Y[a] * Y[a];
        }
        for (int r = 0; r < d; r++)
            for (int t = 0; t < d; t++)
                S[r * d + t] += Y[r] * o->weight_xi[t];
        if (breaks)
            over |= square > s_c2 * o->length * o->length;
    }
    for (int t = 0; t < d * d; t++)
        PD_STORE(sum[t] + part, S[t]);
    return breaks && any_lane(over, c->count - part);
}

PD_INLINE bool chunk_sum(const int d, const bool breaks, const bool gapped,
                         const pd_body *b, const pd_chunk *c, const double *const *around,
                         double s_c2, double (*sum)[PD_LANES])
{
    const sweeps *own = b->own;
    bool over = false;
    for (int part = 0; part < c->count; part += PD_WIDTH)
        over |=
            part_sum(d, breaks, gapped, b->lattice, &own->y, c, part, around, s_c2, sum);
    return over;
}

/* F of a chunk, after breaking what is too long. */
PD_INLINE void deform_chunk(const int d, const bool breaks, pd_body *b, int64_t z,
                            pd_chunk *c, const double *const *around, double s_c2)
{
    const sweeps *own = b->own;
    double sum[9][PD_LANES];
    for (bool again = true; again;) {
        const bool over = chunk_is_whole(c)
                              ? chunk_sum(d, breaks, false, b, c, around, s_c2, sum)
                              : chunk_sum(d, breaks, true, b, c, around, s_c2, sum);
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
                      chunk_is_whole(c) ? own->K_inverse
                                        : b->K_inverse + (size_t)i * d * d);
    }
}

/* Q of a chunk into the ring's plane. */
PD_INLINE void stress_chunk(const int d, pd_body *b, const pd_chunk *c, double *plane)
{
    const pd_lattice *l = b->lattice;
    const sweeps *own = b->own;
    const int64_t cell = ring_cell(&own->Q, c);
    double P[PD_LANES * 9], Q[9];
    stress_points(d, b, c->point, c->count, P);
    for (int q = 0; q < c->count; q++) {
        const pd_local i = c->point + q;
        const double *K_inverse =
            chunk_is_whole(c) ? own->K_inverse : b->K_inverse + (size_t)i * d * d;
        const double g = b->control ? (chunk_is_whole(c) ? own->g : b->control[i]) : 0;
        keep_Q(d, b, i, P + q * d * d, K_inverse, g, Q);
        for (int t = 0; t < d * d; t++)
            plane[cell + t * l->row + q] = Q[t];
        if (b->control)
            plane[cell + d * d * l->row + q] = b->carries[i] == PD_SOUND ? g : 0;
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
        const int64_t cell = ring_cell(&((const sweeps *)b->own)->Q, c);
        for (int t = 0; t < d * d; t++)
            plane[cell + t * l->row] = b->Q[(size_t)c->point * d * d + t];
        if (b->control)
            plane[cell + d * d * l->row] = control_now(b, c->point);
    }
}

/* f += w (g_i + g_j) Y of one offset; Y from `y` at the neighbour and `here`. */
PD_INLINE void add_control(const int d, const pd_lattice *l, lanes w_g, const double *y,
                           const lanes *here, lanes *f)
{
    for (int r = 0; r < d; r++)
        f[r] += w_g * (PD_LOAD(y + r * l->row) - here[r]);
}

/* Force density of the lanes of a chunk from `part` on, [kim2023] eqs 28-29; y: planes of
 * positions, with control. */
PD_INLINE void part_force(const int d, const bool gapped, const bool control,
                          const pd_lattice *l, const sweeps *rings, const pd_chunk *c,
                          int part, const double *const *Q, const double *const *y,
                          double (*force)[PD_LANES])
{
    const int64_t here = ring_cell(&rings->Q, c) + part;
    const int64_t y_here = ring_cell(&rings->y, c) + part;
    const double *Qi = Q[l->reach] + here;
    lanes f[3] = {{0}}, moment[3] = {{0}}, yi[3] = {{0}}, g = {0};
    if (control) {
        g = PD_LOAD(Qi + d * d * l->row);
        for (int a = 0; a < d; a++)
            yi[a] = PD_LOAD(y[l->reach] + y_here + a * l->row);
    }
    for (int k = 0; k < l->n_offsets; k++) {
        const pd_offset *o = &l->offset[k];
        const double *Qj = Q[o->plane] + here + rings->Q.shift[k];
        lane_bits bonds = {0};
        if (gapped)
            bonds = lanes_of(c->bonds[k], part);
        for (int t = 0; t < d; t++) {
            const lanes w_xi = select_lanes(bonds, o->weight_xi[t] + (lanes){0});
            moment[t] += w_xi;
            for (int r = 0; r < d; r++)
                if (gapped)
                    f[r] += PD_LOAD(Qj + (r * d + t) * l->row) * w_xi;
                else
                    f[r] += PD_LOAD(Qj + (r * d + t) * l->row) * o->weight_xi[t];
        }
        if (control) {
            const lanes w_g = o->weight * (g + PD_LOAD(Qj + d * d * l->row));
            add_control(d, l, gapped ? select_lanes(bonds, w_g) : w_g,
                        y[o->plane] + y_here + rings->y.shift[k], yi, f);
        }
    }
    /* The moment of a full family is zero. */
    for (int r = 0; gapped && r < d; r++)
        for (int t = 0; t < d; t++)
            f[r] += PD_LOAD(Qi + (r * d + t) * l->row) * moment[t];
    for (int r = 0; r < d; r++)
        PD_STORE(force[r] + part, f[r]);
}

PD_INLINE void chunk_force(const int d, const bool gapped, const bool control,
                           const pd_body *b, const pd_chunk *c, const double *const *Q,
                           const double *const *y, double (*force)[PD_LANES])
{
    for (int part = 0; part < c->count; part += PD_WIDTH)
        part_force(d, gapped, control, b->lattice, b->own, c, part, Q, y, force);
}

PD_INLINE void force_of_chunk(const int d, const bool control, pd_body *b,
                              const pd_chunk *c, const double *const *Q,
                              const double *const *y)
{
    double f[3][PD_LANES];
    if (chunk_is_whole(c))
        chunk_force(d, false, control, b, c, Q, y, f);
    else
        chunk_force(d, true, control, b, c, Q, y, f);
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

void PD_FOR_THIS_SET(pd_lattice_correspondence)(pd_body *b)
{
    if (b->options.dimension == 2)
        sweep_dimension(2, b);
    else
        sweep_dimension(3, b);
}
