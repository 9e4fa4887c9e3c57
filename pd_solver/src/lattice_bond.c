/*
 * Forces of bond-based peridynamics on a lattice, [han2025] eqs 28-29; compiled once for
 * each instruction set. force_bond.c says what is computed, lattice.h how.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "body.h"
#include "bond.h"
#include "damage.h"
#include "lanes.h"

void PD_FOR_THIS_SET(pd_lattice_bond)(pd_body *b);

/* Force densities of the lanes of a chunk from `part` on, the planes around it being in
 * `around`; is some bond that bears force longer than s_c |xi|? */
PD_INLINE bool part_force(const int d, const bool breaks, const int kind,
                          const pd_lattice *l, const pd_ring *ring, const pd_chunk *c,
                          int part, const double *const *around,
                          double (*force)[PD_LANES])
{
    const int64_t cell = ring_cell(ring, c) + part;
    const double *y = around[d > 1 ? l->reach : 0] + cell;
    lanes here[3], f[3] = {{0}};
    lane_mask over = {0};
    for (int a = 0; a < d; a++)
        here[a] = PD_LOAD(y + a * l->row);
    for (int k = 0; k < l->n_offsets; k++) {
        const pd_offset *o = &l->offset[k];
        const double *there = around[o->plane] + cell + ring->shift[k];
        lanes Y[3], square = {0};
        for (int a = 0; a < d; a++) {
            Y[a] = PD_LOAD(there + a * l->row) - here[a];
            square += Y[a] * Y[a];
        }
        lanes t = o->inverse - reciprocal_root(square);
        lane_mask too_long = {0};
        if (breaks)
            too_long = lanes_above(square, o->too_long + (lanes){0});
        if (kind == PD_OWN) {
            const lanes weight = PD_LOAD(c->weight + k * PD_LANES + part);
            t *= weight;
            too_long &= lanes_above(weight, (lanes){0});
        } else {
            t *= o->weight;
        }
        if (kind == PD_GAPPED) {
            const lane_mask bonds = lanes_of(c->bonds[k], part);
            t = select_lanes(bonds, t);
            too_long &= bonds;
        }
        for (int a = 0; a < d; a++)
            f[a] += t * Y[a];
        if (breaks)
            over |= too_long;
    }
    for (int a = 0; a < d; a++)
        PD_STORE(force[a] + part, f[a]);
    return breaks && any_lane(over, c->count - part);
}

PD_INLINE bool chunk_force(const int d, const bool breaks, const int kind,
                           const pd_body *b, const pd_chunk *c,
                           const double *const *around, double (*force)[PD_LANES])
{
    bool over = false;
    PD_FOR_PARTS (part, c->count)
        over |= part_force(d, breaks, kind, b->lattice, b->own, c, part, around, force);
    return over;
}

PD_INLINE void force_of_chunk(const int d, const bool breaks, pd_body *b, int64_t z,
                              pd_chunk *c, const double *const *around, double s_c2)
{
    double f[3][PD_LANES];
    for (bool again = true; again;) {
        bool over;
        if (c->weight)
            over = chunk_force(d, breaks, PD_OWN, b, c, around, f);
        else if (c->bonds)
            over = chunk_force(d, breaks, PD_GAPPED, b, c, around, f);
        else
            over = chunk_force(d, breaks, PD_WHOLE, b, c, around, f);
        again = over && pd_damage_break_chunk(b, z, c, s_c2) && !breaks_after_force(b);
    }
    double *force = b->force + (size_t)c->point * d;
    for (int q = 0; q < c->count; q++)
        for (int a = 0; a < d; a++)
            force[q * d + a] = f[a][q];
}

/* Planes [from, to). */
PD_INLINE void sweep_planes(const int d, const bool breaks, pd_body *b, int64_t from,
                            int64_t to)
{
    pd_lattice *l = b->lattice;
    const pd_ring *ring = b->own;
    const int reach = d > 1 ? l->reach : 0;
    const double s_c = breaks ? pd_body_critical_stretch(b, 0, 0) : 0;
    const double *around[2 * PD_MOST_REACH + 1];
    for (int64_t z = from - 2 * reach; z < to; z++) {
        pd_ring_fill(d, b, z + reach, b->y, ring);
        if (z < from)
            continue;
        for (int s = 0; s <= 2 * reach; s++)
            around[s] = ring_plane(ring, z - reach + s);
        for (int64_t m = l->regular.first[z]; m < l->regular.first[z + 1]; m++)
            force_of_chunk(d, breaks, b, z, &l->regular.chunk[m], around, s_c * s_c);
    }
}

/* While ghosts are on their way, the planes that need none. */
PD_INLINE void sweep(const int d, const bool breaks, pd_body *b)
{
    pd_lattice *l = b->lattice;
    set_too_long(l, breaks ? pd_body_critical_stretch(b, 0, 0) : 0);
    if (!pd_halo_is_under_way(b->halo)) {
        sweep_planes(d, breaks, b, 0, l->planes);
        return;
    }
    sweep_planes(d, breaks, b, l->clear, l->clear_to);
    pd_halo_end(b->halo);
    sweep_planes(d, breaks, b, 0, l->clear);
    sweep_planes(d, breaks, b, l->clear_to, l->planes);
}

void PD_FOR_THIS_SET(pd_lattice_bond)(pd_body *b)
{
    const int d = b->options.dimension;
    const bool breaks = pd_body_can_break(&b->options);
    if (d == 1 && breaks)
        sweep(1, true, b);
    else if (d == 1)
        sweep(1, false, b);
    else if (d == 2 && breaks)
        sweep(2, true, b);
    else if (d == 2)
        sweep(2, false, b);
    else if (breaks)
        sweep(3, true, b);
    else
        sweep(3, false, b);
}
