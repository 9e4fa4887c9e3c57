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

/* K of point i, [kim2023] eq. 26, over bonds of weight > 0. */
PD_INLINE void shape_tensor(const int d, const pd_body *b, pd_local i, double *K)
{
    const double *X = b->X, *Xi = X + (size_t)i * d;
    for (int c = 0; c < d * d; c++) K[c] = 0;
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
    double det_over_mean = 0, scaled[9];
    if (mean > 0) {
        for (int c = 0; c < d * d; c++) scaled[c] = K[c] / mean;
        det_over_mean = determinant(d, scaled);
    }
    if (det_over_mean <= PD_SINGULAR_SHAPE) {
        for (int c = 0; c < d * d; c++) K_inverse[c] = 0;
        return false;
    }
    inverse(d, scaled, 1 / det_over_mean, K_inverse);
    for (int c = 0; c < d * d; c++) K_inverse[c] /= mean;
    return true;
}

#endif
