/*
 * Bond-based peridynamics again, slowly: every sum runs over all pairs of points and
 * every equation is written as [han2025] prints it, but for the pi of the micromodulus in
 * one dimension. The measure of the library; shares no code with it. Vectors have three
 * components throughout.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef TESTS_REFERENCE_BOND_H
#define TESTS_REFERENCE_BOND_H

#include <stddef.h>

typedef struct {
    int d;
    int plane_stress; /* in two dimensions; else plane strain */
    size_t n;
    double horizon_ratio;    /* delta / Delta x, - */
    double E;                /* Pa */
    int surface_correction;  /* 1: energy-based correction */
    double critical_stretch; /* |xi + eta|/|xi|, -; 0: bonds cannot break so */
    double energy_release;   /* G_c, J/m2; 0: bonds cannot break so */
    double (*X)[3];          /* [n] m */
    double *V;               /* [n] m3 (m2, m) */
    double (*y)[3];          /* [n] m; the caller sets it */
    unsigned char *held;     /* [n] 1: rigid; the caller sets it before any forces */
    unsigned char *safe;     /* [n] 1: its bonds do not break; the caller sets it */
    double *lambda;          /* [n][n] 1 intact, 0 broken, eq. 17; the caller may cut */
    double (*f)[3];          /* [n] N/m3, of points that are not held */
    double (*stress)[3][3];  /* [n] virial, Pa, of points that are not held */
    double *phi;             /* [n] local damage */
    double *hold;            /* [n] distance to where the hold ends, m; 0: far */
    double (*g)[3];          /* [n] shortfall of energy along each axis */
    double energy;           /* J, of points that are not held */
} bond_reference;

/* Copies X[n][3] and V[n]; y = X. NULL without memory. */
bond_reference *bond_reference_create(int d, size_t n, const double *X, const double *V);
void bond_reference_free(bond_reference *body);

/* Break bonds at y, then fill f, stress, phi and energy. */
void bond_reference_forces(bond_reference *body);

#endif
