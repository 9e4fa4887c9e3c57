/*
 * The fictitious mass of relaxation: which displacement answers a force.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_SMOOTH_H
#define PD_SRC_SMOOTH_H

#include "body.h"

enum { PD_LEVELS = 16 };

/* A grid over the body at rest, each next one twice as wide, all with one origin. */
typedef struct {
    pd_local count[3]; /* nodes along the axes */
    size_t first;      /* node of this level in the arrays of all */
    double width;      /* m */
} pd_level;

typedef struct {
    const pd_body *body; /* borrowed */
    double *stiffness;   /* [n_local] bound of the diagonal, N/m */
    double origin[3];
    int n_levels;
    size_t n_nodes; /* of all levels */
    pd_level level[PD_LEVELS];
    double *soft; /* [nodes][d] inverse of the stiffness of hats, m/N; 0: fixed */
    double *value, *weight; /* [nodes][d] work */
} pd_smooth;

/* Collective, as all of these. Errors: PD_NO_MEMORY. Followed by pd_smooth_free, also
 * then. */
pd_status pd_smooth_create(const pd_body *b, pd_smooth *s);
void pd_smooth_free(pd_smooth *s);

/* Take up which components of the body are prescribed. */
void pd_smooth_fix(pd_smooth *s);

/* Replace forces f[n_moving][d] (N) by displacements (m), about the inverse of the
 * stiffness times them; 0 where prescribed. */
void pd_smooth_apply(pd_smooth *s, double *f);

/* Continue displacements u[n_moving][d] (m) from prescribed components, and from held
 * points, which do not move, to the free components. */
void pd_smooth_extend(pd_smooth *s, double *u);

#endif
