/*
 * Finding ghosts: the points of other ranks that the families of our own reach.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_GHOSTS_H
#define PD_SRC_GHOSTS_H

#include "halo.h"

/* Points as they are given, ours first, then ghosts. */
typedef struct {
    pd_local n_owned, n;
    const double *X;             /* [n][3], m */
    const double *volume;        /* [n] */
    const unsigned char *held;   /* [n], or NULL where no rank holds any */
    const pd_global *id;         /* [n] */
    const unsigned char *is_far; /* [n - n_owned] outside the first layer; or NULL */
    pd_halo *halo;               /* of places in these arrays; NULL in one piece */
    void *own[5];                /* what pd_part_free frees */
} pd_part;

/*
 * Points of a rank and, from the others, those within `layers` of its horizons: of bonds
 * up to ratio times the mean of two spacings. There may be a few more, so that round-off
 * hides none. Without id points are numbered rank after rank. Collective.
 * Errors: PD_NO_MEMORY; PD_BAD_ARGUMENT (numbers that are out of range). Freed by
 * pd_part_free, also then; the halo is the caller's.
 */
pd_status pd_part_create(MPI_Comm comm, int d, double ratio, int layers, size_t n,
                         const double *X, const double *volume, const unsigned char *held,
                         const pd_global *id, pd_part *part);
void pd_part_free(pd_part *part);

/* volume^(1/d) */
double pd_spacing_of(int d, double volume);

#endif
