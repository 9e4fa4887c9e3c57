/*
 * What ranks tell each other about points: with agreement (collective.h) the only
 * messages of a step. Knows no mechanics.
 *
 * Every function takes NULL for a body in one piece: it then does nothing and calls no
 * MPI.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_HALO_H
#define PD_SRC_HALO_H

#include "collective.h"

/* A rank that has ghosts of our points, or points of which we have ghosts. */
typedef struct {
    int rank;
    size_t first_send, n_send;   /* into pd_halo.send */
    size_t first_ghost, n_ghost; /* into pd_halo.ghost */
} pd_partner;

enum { PD_HALO_FIELDS = 3 };

typedef struct pd_halo {
    MPI_Comm comm; /* borrowed */
    int n_partners;
    pd_partner *partner;
    size_t n_send, n_ghost;
    pd_local *send;  /* [n_send] our points, by partner */
    pd_local *ghost; /* [n_ghost] where copies of theirs stand here, by partner */

    /* The exchange under way: at most one. */
    int n_fields; /* 0: none */
    struct {
        char *values;
        size_t size; /* bytes of a point */
    } field[PD_HALO_FIELDS];
    size_t capacity; /* bytes of a point that the buffers hold */
    char *out, *in;
    MPI_Request *request;          /* [2 n_partners] */
    int64_t bytes_sent, exchanges; /* since creation */
} pd_halo;

void pd_halo_free(pd_halo *halo);

/* Make room for exchanges of up to that many bytes a point, so that none fails later. */
pd_status pd_halo_reserve(pd_halo *halo, size_t size);

/* Send what the owned points have in an array [n_local][size bytes], to arrive in the
 * ghosts' places by pd_halo_end; add further arrays before pd_halo_begin. Between begin
 * and end owned values may be read and changed, ghosts not. Collective among partners. */
void pd_halo_add(pd_halo *halo, void *values, size_t size);
void pd_halo_begin(pd_halo *halo);

/* Nothing happens when no exchange is under way. */
void pd_halo_end(pd_halo *halo);

static inline bool pd_halo_is_under_way(const pd_halo *halo)
{
    return halo && halo->n_fields > 0;
}

/* All of that for one array. */
void pd_halo_copy(pd_halo *halo, void *values, size_t size);

/* Add what ghosts have in values[n_local][width] to the points that they are copies of.
 */
void pd_halo_sum(pd_halo *halo, double *values, size_t width);

#endif
