/*
 * Bodies whose points stand on a cubic lattice: families, offsets and weights are the
 * same for all points but those near a surface or a crack, and are not stored for each.
 *
 * Points are numbered along the first axis, then the second, then the third, and taken in
 * chunks of up to PD_LANES neighbours in a row, one vector of doubles. A sweep goes
 * through the body plane by plane and keeps what it needs of the planes around, component
 * by component, in a ring that fits a cache: a bond costs no index, weight or length, and
 * memory is read and written once.
 *
 * Regular points, [0, n_regular), go this way, and so do near ghosts of that kind. Points
 * that touch a hold have families of their own and go the general way. The box is that of
 * the points of this rank and their ghosts, on the lattice of all ranks.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_LATTICE_H
#define PD_SRC_LATTICE_H

#include "ghosts.h"
#include "pd.h"

#define PD_LANES 8
#define PD_MOST_OFFSETS 512 /* more make a family better stored */
#define PD_MOST_FOLDED 45   /* rows times cells along: 9 x 5, or 13 in a plane */
#define PD_MOST_REACH 12    /* so far reach that many offsets in two dimensions */

/* From a point to one of its neighbours. */
typedef struct {
    int plane;           /* 0 to 2 reach: the neighbour's plane, counted in the ring */
    int32_t cell;        /* what is added to the cell within the plane */
    int32_t rows, along; /* the same, in rows and in cells of a row */
    double xi[3];        /* m */
    double length;       /* |xi|, m */
    double inverse;      /* 1/|xi|, 1/m */
    double weight;       /* the formulation's, of a bond with nothing missing around */
    double weight_xi[3];
    double too_long; /* the |Y|^2 beyond which a bond breaks, m2; set by a sweep */
} pd_offset;

/* An offset and its mirror along a row: a sum or difference of cells `along` away on both
 * sides, of a row. */
typedef struct {
    int rows, along; /* along >= 0 */
    int offset;      /* the one of the two with along */
} pd_fold;

/* Offsets [first, end); bit a of `axes` stands for xi_a != 0. */
typedef struct {
    int axes, first, end;
} pd_run;

typedef struct {
    pd_local point; /* the first */
    int32_t cell;   /* its cell within its plane ... */
    int32_t row, x; /* ... which is that one of that row */
    int count;      /* 1 to PD_LANES */
    bool exports;   /* a point of general path reads it */
    bool is_ghost;  /* its F is needed, its force is not */

    /* What its bonds weigh: as the offsets say when both are NULL (it is whole), that or
     * nothing as bit q of bonds[n_offsets] has it for lane q, or else as weight
     * [n_offsets][PD_LANES] has it, 0 for no bond. */
    unsigned char *bonds;
    double *weight;
} pd_chunk;

/* Chunks of planes: those of plane z are [first[z], first[z + 1]). */
typedef struct {
    pd_chunk *chunk;
    int64_t *first;
} pd_chunks;

typedef struct pd_lattice {
    int d, reach;               /* of the horizon, in steps */
    double step, origin[3];     /* m, of the lattice of all ranks */
    int64_t low[3];             /* steps from there to the box */
    int64_t count[3];           /* points of the box, along each axis */
    int64_t row, plane, planes; /* cells of a padded row and plane; planes in all */
    int n_offsets;
    pd_offset *offset; /* the last is the first mirrored, and so on */

    /* Offsets of one plane with the same components other than 0, in order; those of
     * plane s are [runs_of[s], runs_of[s + 1]), half of all are of half the offsets. */
    pd_run *run;
    int runs_of[2 * PD_MOST_REACH + 2];
    pd_fold *fold; /* those of plane s are [folds_of[s], folds_of[s + 1]) */
    int folds_of[2 * PD_MOST_REACH + 2];
    pd_chunks regular, other; /* other: active points of the general path, and ghosts */

    /* Regular chunks of owned points by x and then by row, plane by plane: those of plane
     * z are [column_of[z], column_of[z + 1]). */
    int32_t *column;
    int64_t *column_of;

    int64_t ghosts_from;     /* no ghost stands in planes before this */
    int64_t clear, clear_to; /* families of planes [clear, clear_to) hold no ghosts */
    pd_local *at;            /* [planes][plane] the active point there, or -1 */
    uint64_t *broken;        /* [regular points, ghosts after][n_offsets] bits; NULL
                              * until one can break */
} pd_lattice;

/* The lattice that all points stand on; NULL in *lattice when they do not, or when
 * families are better stored: the same for all ranks, but NULL on one without points.
 * Collective. Freed by pd_lattice_free. */
pd_status pd_lattice_find(MPI_Comm comm, const pd_body_options *o, const pd_part *part,
                          pd_lattice **lattice);
void pd_lattice_free(pd_lattice *lattice);

/* Steps from the first point of the box, along each axis. */
void pd_lattice_index(const pd_lattice *lattice, const double *X, int64_t *index);

/* Put X, which is as good as there, on the lattice to the last bit. */
void pd_lattice_place(const pd_lattice *lattice, double *X);

/* Chunks and map of the body's points, which are in order. */
pd_status pd_lattice_fill(pd_body *body);

/* Neighbours of regular point i, and the offset of each; returns how many. */
pd_local pd_lattice_family(const pd_body *body, pd_local i, pd_local *neighbour,
                           short *offset);

/* Take bond k of a lane out of a chunk. */
pd_status pd_lattice_cut(pd_lattice *lattice, pd_chunk *chunk, int lane, int k);

/* Bonds break beyond stretch s_c. */
static inline void set_too_long(pd_lattice *lattice, double s_c)
{
    for (int k = 0; k < lattice->n_offsets; k++) {
        const double most = s_c * lattice->offset[k].length;
        lattice->offset[k].too_long = most * most;
    }
}

static inline bool chunk_is_whole(const pd_chunk *chunk)
{
    return !chunk->bonds && !chunk->weight;
}

/* Weight of bond k of a lane. */
static inline double chunk_weight(const pd_lattice *lattice, const pd_chunk *chunk,
                                  int lane, int k)
{
    if (chunk->weight)
        return chunk->weight[k * PD_LANES + lane];
    return !chunk->bonds || chunk->bonds[k] >> lane & 1 ? lattice->offset[k].weight : 0;
}

/* The active point at an offset of lane q of a chunk in plane z, or -1. */
pd_local pd_lattice_neighbour(const pd_lattice *lattice, int64_t z, const pd_chunk *chunk,
                              int q, const pd_offset *offset);

/* Chunk of a regular point. */
pd_chunk *pd_lattice_chunk(const pd_body *body, pd_local i);

/* Weigh every bond: weight(body, i, j, offset, context); j < 0 has no bond. Broken bonds
 * weigh nothing. A chunk keeps no more of it than it must. */
typedef double pd_weigh(const pd_body *body, pd_local i, pd_local j,
                        const pd_offset *offset, const void *context);
pd_status pd_lattice_weigh(pd_body *body, pd_weigh *weigh, const void *context);

/* ---- the ring ---- */

/* Planes of components around the plane at hand. The components of a row stand together,
 * [planes in the ring][rows][components][cells], so that few pages of memory are in use.
 */
typedef struct {
    int components, slots;
    int64_t stride; /* from row to row */
    int64_t plane;  /* from plane to plane */
    int64_t planes; /* of the lattice */
    int64_t *shift; /* [n_offsets] from a cell to a neighbour's in its plane */
    double *data, *nothing;
} pd_ring;

pd_status pd_ring_create(const pd_lattice *lattice, int components, int slots,
                         pd_ring *ring);
void pd_ring_free(pd_ring *ring);

/* Plane z; where there is none: numbers that are finite. */
static inline double *ring_plane(const pd_ring *ring, int64_t z)
{
    if (z < 0 || z >= ring->planes)
        return ring->nothing;
    return ring->data + z % ring->slots * ring->plane;
}

/* First component of a chunk's first cell, within its plane. */
static inline int64_t ring_cell(const pd_ring *ring, const pd_chunk *chunk)
{
    return chunk->row * ring->stride + chunk->x;
}

/* Put plane z of a field [n][d] of points into the ring; outside nothing happens. */
void pd_ring_fill(int d, const pd_body *body, int64_t z, const double *field,
                  const pd_ring *ring);

#endif
