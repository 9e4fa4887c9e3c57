/*
 * Bond-associated correspondence again, slowly: sums over all pairs of points, every
 * directed bond with a stress of its own, the equations as [behzadinasab2021] prints
 * them. The measure of the library; shares no code with it but the material. Families
 * must be able to carry the order asked for: there is no lower one to fall back to.
 * Tensors are 3 x 3 throughout; in two dimensions what is beyond the plane is zero, F33
 * is 1.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef TESTS_REFERENCE_BOND_ASSOCIATED_H
#define TESTS_REFERENCE_BOND_ASSOCIATED_H

#include <stddef.h>

#include "pd.h"

typedef struct {
    pd_body_options options; /* as the library's */
    int d;
    size_t n;
    double (*X)[3], *V;    /* [n] at rest: m, m3 (m2) */
    double (*y)[3];        /* [n] m; the caller sets it */
    double (*v)[3];        /* [n] m/s; the caller sets it */
    double *omega_D;       /* [n][n] what decay has left of a bond, appendix C */
    double (*sigma)[6];    /* [n][n] Cauchy stress of bonds, as pd.h orders it, Pa */
    double *plastic;       /* [n][n] */
    double (*Phi)[3];      /* [n][n] 1/(m4), eq. A.2 */
    double *omega;         /* [n][n] eq. C.1 */
    double *omega_bar;     /* [n] eq. A.6, m3 */
    double (*L)[3][3];     /* [n] eq. A.1, 1/s */
    double (*F)[3][3], *J; /* [n] - */
    double (*f)[3];        /* [n] N/m3 at rest */
    double (*mean)[6];     /* [n] Cauchy stress of points, Pa */
} reference_bonds;

/* Copies X[n][3] and V[n]; y = X. NULL without memory. */
reference_bonds *reference_bonds_create(const pd_body_options *options, size_t n,
                                        const double *X, const double *V);
void reference_bonds_free(reference_bonds *body);

/* At y: break bonds, then f and mean. */
void reference_bonds_forces(reference_bonds *body);

/* L at y and v, and the history over a step; see pd_body_advance. */
void reference_bonds_advance(reference_bonds *body, double dt, double at);

/* Stress power at y and v (W), eqs 18 and 19. */
double reference_bonds_power(reference_bonds *body);

#endif
