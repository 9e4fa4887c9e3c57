/*
 * Correspondence peridynamics again, slowly: every sum runs over all pairs of points and
 * every equation is written as [kim2023] prints it. The measure of the library; shares
 * no code with it. Tensors are 3 x 3 throughout: in two dimensions K33 = F33 = 1.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef TESTS_REFERENCE_CORRESPONDENCE_H
#define TESTS_REFERENCE_CORRESPONDENCE_H

#include <stddef.h>

typedef struct {
    int d;
    size_t n;
    double horizon_ratio;    /* epsilon / Delta X, - */
    double critical_stretch; /* s_c, -; 0: bonds cannot break */
    double G, nu_stab;       /* Pa, - */
    double smallest_shape;   /* least det K / (tr K / d)^d, as PD_SINGULAR_SHAPE */
    double smallest_J;       /* as PD_SMALLEST_J */
    double (*X)[3];          /* [n] m */
    double *V;               /* [n] m3 (m2) */
    double (*y)[3];          /* [n] m; the caller sets it */
    double *I;               /* [n][n] 1 intact, 0 broken, eq. 17 */
    double (*F)[3][3];       /* [n] - */
    double *J;               /* [n] - */
    double (*f)[3];          /* [n] N/m3 */
    double *phi;             /* [n] local damage, eq. 18 */
    size_t singular, inverted;
} reference_body;

/* Copies X[n][3] and V[n]; y = X. NULL without memory. */
reference_body *reference_create(int d, size_t n, const double *X, const double *V);
void reference_free(reference_body *body);

/* Break bonds at y, then fill F, J, f, phi and the counts. */
void reference_forces(reference_body *body);

#endif
