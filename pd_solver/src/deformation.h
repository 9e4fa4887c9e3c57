/*
 * Shape tensor and non-local deformation gradient over a family.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_DEFORMATION_H
#define PD_SRC_DEFORMATION_H

#include <math.h>

#include "body.h"
#include "tensor.h"

/* Does the family of point i hold both moving and held points? */
PD_INLINE bool beside_hold(const pd_body *b, pd_local i)
{
    return b->hold_distance && b->hold_distance[i] > 0;
}

/* By how much the displacement of the moving end of a bond counts: a bond that enters a
 * hold sees the displacement fall linearly to zero where the hold ends and go on beyond
 * it, as if mirrored there. i: moving, j: held. */
PD_INLINE double mirror(const pd_body *b, pd_local i, pd_local j)
{
    return 1 + b->hold_distance[j] / b->hold_distance[i];
}

/* xi and the deformed bond Y from i to j; holds: bonds may enter a hold. */
PD_INLINE void bond(const int d, const bool holds, const pd_body *b, pd_local i,
                    pd_local j, double *xi, double *Y)
{
    const double *Xi = b->X + (size_t)i * d, *Xj = b->X + (size_t)j * d;
    const double *yi = b->y + (size_t)i * d, *yj = b->y + (size_t)j * d;
    subtract(d, Xj, Xi, xi);
    subtract(d, yj, yi, Y);
    if (!holds)
        return;
    if (!is_held(b, i) && is_held(b, j))
        for (int c = 0; c < d; c++)
            Y[c] = xi[c] - mirror(b, i, j) * (yi[c] - Xi[c]);
    if (is_held(b, i) && !is_held(b, j))
        for (int c = 0; c < d; c++)
            Y[c] = xi[c] + mirror(b, j, i) * (yj[c] - Xj[c]);
}

/* K of point i, [kim2023] eq. 26, over bonds of weight > 0. */
PD_INLINE void shape_tensor(const int d, const pd_body *b, pd_local i, double *K)
{
    const double *X = b->X, *Xi = X + (size_t)i * d;
    for (int c = 0; c < d * d; c++)
        K[c] = 0;
    for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
        double xi[3];
        subtract(d, X + (size_t)b->families.neighbour[k] * d, Xi, xi);
        add_dyad(d, b->weight[k], xi, xi, K);
    }
}

/* K^-1 of point i; zero, and false, where K is near singular. */
PD_INLINE bool shape_inverse(const int d, const double *K, double *K_inverse)
{
    const double mean = trace(d, K) / d; /* >= 0, K is a sum of squares */
    double det_over_mean = 0, scaled[9] = {0};
    if (mean > 0) {
        for (int c = 0; c < d * d; c++)
            scaled[c] = K[c] / mean;
        det_over_mean = determinant(d, scaled);
    }
    if (det_over_mean <= PD_SINGULAR_SHAPE) {
        for (int c = 0; c < d * d; c++)
            K_inverse[c] = 0;
        return false;
    }
    inverse(d, scaled, 1 / det_over_mean, K_inverse);
    for (int c = 0; c < d * d; c++)
        K_inverse[c] /= mean;
    return true;
}

#endif
