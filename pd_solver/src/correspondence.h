/*
 * What the two paths of correspondence share: the general one and that of lattices.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_CORRESPONDENCE_H
#define PD_SRC_CORRESPONDENCE_H

#include "body.h"
#include "deformation.h"
#include "tensor.h"

enum { ZERO_ENERGY }; /* of formulation_parameters */

/* What a lattice needs besides. */
typedef struct {
    pd_ring y, force;
    pd_ring Q;           /* [d][d], then g where there is zero-energy control */
    int delay;           /* planes by which forces wait until bonds are broken */
    double *moment;      /* [n_local][d] sum_j w xi, of points with something missing */
    double K_inverse[9]; /* of a point with nothing missing around; with it */
    double g;
} sweeps;

/* g of a point; K may be singular, then it bears nothing. */
PD_INLINE double control_of(const int d, const pd_body *b, const double *K, bool sound)
{
    double bulk, shear;
    b->options.material->moduli(b->options.parameters, d, b->options.plane, &bulk,
                                &shear);
    const double coefficient = b->options.formulation_parameters[ZERO_ENERGY];
    return sound ? coefficient * shear * d / trace(d, K) : 0;
}

/* K^-1 and g of point i from its K. */
PD_INLINE void keep_shape(const int d, pd_body *b, pd_local i, const double *K)
{
    const bool sound = shape_inverse(d, K, b->K_inverse + (size_t)i * d * d);
    b->carries[i] = sound ? PD_SOUND : PD_POINT_SINGULAR;
    if (b->control)
        b->control[i] = control_of(d, b, K, sound);
}

/* K^-1 of point i from the bonds that it has. */
PD_INLINE void invert_shape(const int d, pd_body *b, pd_local i)
{
    double K[9];
    shape_tensor(d, b, i, K);
    keep_shape(d, b, i, K);
}

/* The same for a lane of a chunk that misses bonds, and its moment. */
PD_INLINE void invert_lane(pd_body *b, const pd_chunk *c, int q)
{
    const pd_lattice *l = b->lattice;
    double K[9] = {0};
    double *moment = ((sweeps *)b->own)->moment + (size_t)(c->point + q) * (size_t)l->d;
    for (int a = 0; a < l->d; a++)
        moment[a] = 0;
    for (int k = 0; k < l->n_offsets; k++) {
        const double weight = chunk_weight(l, c, q, k), *xi = l->offset[k].xi;
        add_dyad(l->d, weight, xi, xi, K);
        for (int a = 0; a < l->d; a++)
            moment[a] += weight * xi[a];
    }
    keep_shape(l->d, b, c->point + q, K);
}

/* F of point i from sum_j w Y (x) xi, [kim2023] eq. 25; the identity where the point
 * carries no stress. */
PD_INLINE void keep_gradient(const int d, pd_body *b, pd_local i, const double *sum,
                             const double *K_inverse)
{
    double *F = b->F + (size_t)i * d * d;
    multiply(d, sum, K_inverse, F);
    b->J[i] = determinant(d, F);
    if (b->carries[i] != PD_POINT_SINGULAR)
        b->carries[i] = b->J[i] > PD_SMALLEST_J ? PD_SOUND : PD_POINT_INVERTED;
    if (b->carries[i] != PD_SOUND) {
        identity(d, F);
        b->J[i] = 1;
    }
}

/* Q = P K^-1 - g F; 0 where the point carries no stress. */
PD_INLINE void keep_Q(const int d, const pd_body *b, pd_local i, const double *P,
                      const double *K_inverse, double g, double *Q)
{
    const double *F = b->F + (size_t)i * d * d;
    if (b->carries[i] != PD_SOUND) {
        for (int c = 0; c < d * d; c++)
            Q[c] = 0;
        return;
    }
    multiply(d, P, K_inverse, Q);
    if (b->control)
        for (int c = 0; c < d * d; c++)
            Q[c] -= g * F[c];
}

#define PD_BLOCK 64 /* points whose F and P stay in the first-level cache */

/* P[d][d][n] of n points from F[d][d][n] and J[n]. */
PD_INLINE void stress_points(const int d, const pd_body *b, size_t n, const double *F,
                             const double *J, double *P)
{
    b->options.material->stress[b->options.plane](b->options.parameters, d, n, F, J, P);
}

/* g of a point as the force counts it. */
PD_INLINE double control_now(const pd_body *b, pd_local i)
{
    return !is_held(b, i) && b->carries[i] == PD_SOUND ? b->control[i] : 0;
}

#endif
