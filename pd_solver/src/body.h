/*
 * The inside of a body, for the files of this folder.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_BODY_H
#define PD_SRC_BODY_H

#include "halo.h"
#include "lattice.h"
#include "neighbourhood.h"
#include "pd.h"

/* Kinds of points, in their order. */
enum pd_kind { PD_MOVING, PD_BESIDE_HOLD, PD_HELD_BESIDE, PD_HELD_INSIDE, PD_KINDS };

/* Why a point carries no stress. */
enum { PD_SOUND = 0, PD_POINT_SINGULAR, PD_POINT_INVERTED };

struct pd_body {
    MPI_Comm comm; /* duplicated, or MPI_COMM_NULL */
    pd_body_options options;
    double inertia; /* mass per volume that the integrators move, kg/m^d */

    pd_local n_moving, n_active, n_owned, n_local; /* as in pd_body_view */

    /* Points [0, n_regular) go by the lattice; those from n_regular to n_active have
     * families. Without a lattice n_regular is 0. */
    pd_local n_regular;
    pd_lattice *lattice; /* or NULL */

    /* Ghosts from n_owned on: near ones, whose families are known, in the same order of
     * kinds as owned points, and then those that are only neighbours. Where formulations
     * need one layer none is near. */
    struct {
        pd_local regular, moving, active, all; /* ends of near ghosts */
    } near;
    unsigned char *kind; /* [n_local] of pd_kind */
    pd_halo *halo;       /* NULL: in one piece */
    pd_global n_all;     /* points on all ranks */
    pd_local *given;     /* [n_owned] */

    pd_global *id;
    double *X, *y, *v, *volume, *spacing, *force, *F, *J;
    double *load; /* [n_owned][d] dead load, N/m3, or NULL */

    /* Bonds of the points [n_regular, n_active), and of near ghosts [near.regular,
     * near.active). A broken bond has weight 0, so that it leaves every sum without a
     * test; its bit tells it from a bond that never weighed anything. */
    pd_families families;
    int64_t n_bonds;  /* undirected, of all active points of all ranks */
    double *weight;   /* [bonds] omega beta V_j, m3; in bond c beta nu V_j, N/m3 */
    double *length;   /* [bonds] |xi|, m; NULL where the formulation does not ask */
    uint64_t *broken; /* [bonds] bits; NULL until a bond can break */

    /* [n_local] distance to where the hold ends, m; 0 for points not beside one; NULL
     * where nothing is held. */
    double *hold_distance;

    unsigned char *prescribed; /* [n_local] bits of components, for the step at hand */

    unsigned char *protect; /* [n_local] no bond of the point breaks; or NULL */

    bool out_of_memory; /* in forces, which return nothing */

    void *own; /* the formulation's, freed by its release; or NULL */

    /* correspondence */
    double *K_inverse;      /* [n_local][d][d], m-(d+2); 0 where K is near singular */
    double *Q;              /* [n_local][d][d] P K^-1 */
    unsigned char *carries; /* [n_local] PD_SOUND or why not */
    double *control;        /* [n_local] zero-energy stiffness, N/m8 (N/m6); or NULL */
};

static inline bool is_held(const pd_body *b, pd_local i)
{
    return b->kind[i] >= PD_HELD_BESIDE;
}

/* Has the point bonds, on the rank that owns it? */
static inline bool keeps_family(const pd_body *b, pd_local i)
{
    return b->kind[i] != PD_HELD_INSIDE;
}

/* Does the point go by the lattice here? */
static inline bool is_regular(const pd_body *b, pd_local i)
{
    return i < b->n_regular || (i >= b->n_owned && i < b->near.regular);
}

/* Regular points, ghosts after owned ones, without gaps. */
static inline pd_local n_regular_of(const pd_body *b)
{
    return b->n_regular + (b->near.regular - b->n_owned);
}

static inline pd_local regular_row(const pd_body *b, pd_local i)
{
    return i < b->n_owned ? i : i - b->n_owned + b->n_regular;
}

/* Does the family of a point of the general path hold ghosts? They come last. */
static inline bool family_has_ghosts(const pd_body *b, pd_local i)
{
    const int64_t end = b->families.first[i + 1];
    return end > b->families.first[i] && b->families.neighbour[end - 1] >= b->n_owned;
}

/* Points with families of their own, not by the lattice: owned, then near ghosts. The
 * next after i; n_local ends. */
static inline pd_local next_general(const pd_body *b, pd_local i)
{
    if (++i >= b->n_active && i < b->n_owned)
        i = b->n_owned;
    if (i >= b->n_owned && i < b->near.regular)
        i = b->near.regular;
    return i >= b->n_owned && i >= b->near.active ? b->n_local : i;
}

#define PD_FOR_GENERAL(b, i)                                                             \
    for (pd_local i = next_general(b, (b)->n_regular - 1); i < (b)->n_local;             \
         i = next_general(b, i))

/* Bonds of a point, wherever they are kept. */
typedef struct {
    pd_local count;
    const pd_local *neighbour; /* [count] */
    int64_t base;              /* bond k is number base + (offset ? offset[k] : k) ... */
    const short *offset;
    const uint64_t *broken; /* ... of these bits; or NULL */
    const pd_chunk *chunk;  /* of a regular point */
    pd_local neighbours_[PD_MOST_OFFSETS];
    short offsets_[PD_MOST_OFFSETS];
} pd_family;

/* Family of an active point, or of a near ghost; lives as long as `family`. */
static inline const pd_family *family_of(const pd_body *b, pd_local i, pd_family *family)
{
    if (is_regular(b, i)) {
        family->count = pd_lattice_family(b, i, family->neighbours_, family->offsets_);
        family->neighbour = family->neighbours_;
        family->offset = family->offsets_;
        family->chunk = pd_lattice_chunk(b, i);
        family->base = (int64_t)regular_row(b, i) * b->lattice->n_offsets;
        family->broken = b->lattice->broken;
    } else {
        family->base = b->families.first[i];
        family->count = (pd_local)(b->families.first[i + 1] - family->base);
        family->neighbour = b->families.neighbour + family->base;
        family->offset = NULL;
        family->broken = b->broken;
    }
    return family;
}

static inline bool family_broken(const pd_family *f, pd_local k)
{
    const int64_t bit = f->base + (f->offset ? f->offset[k] : k);
    return f->broken && (f->broken[bit / 64] >> (bit % 64) & 1);
}

/* Weight of bond k of a family; for loops that need not be fast. */
static inline double family_weight(const pd_body *b, pd_local i, const pd_family *f,
                                   pd_local k)
{
    if (!f->offset)
        return b->weight[f->base + k];
    return chunk_weight(b->lattice, f->chunk, i - f->chunk->point, f->offset[k]);
}

/* Can bonds break? PD_NO_DAMAGE leaves damage out of the library, to measure what it
 * costs where it is not used. */
static inline bool pd_body_can_break(const pd_body_options *o)
{
#ifdef PD_NO_DAMAGE
    (void)o;
    return false;
#endif
    return o->critical_stretch > 0 || o->energy_release > 0 || o->critical_stress > 0 ||
           o->failed_strain > 0;
}

/* Begin to send positions to where ghosts are; pd_halo_end ends it. Collective. */
void pd_body_send(pd_body *b);

/* Bring the ghosts' positions up to date. Collective. */
void pd_body_refresh(pd_body *b);

/* Speed of longitudinal waves of the material (m/s). */
double pd_body_longitudinal_speed(const pd_body *b);

#endif
