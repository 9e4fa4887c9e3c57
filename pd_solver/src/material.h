/*
 * What the files of materials share. Each material is one const table; material.c lists
 * them.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_MATERIAL_H
#define PD_SRC_MATERIAL_H

#include <math.h>

#include "elementary.h"
#include "pd.h"
#include "tensor.h"

extern const pd_material pd_material_neo_hookean, pd_material_mooney_rivlin;
extern const pd_material pd_material_st_venant_kirchhoff, pd_material_linear_elastic;
extern const pd_material pd_material_j2, pd_material_microelastic;

/* The entries of a table of parameters that begins with E and nu. */
#define PARAMETER_E                                                                      \
    {                                                                                    \
        .key = "E", .unit = "Pa", .above = 0, .below = HUGE_VAL,                         \
        .meaning = "Young's modulus"                                                     \
    }
#define PARAMETER_NU                                                                     \
    {                                                                                    \
        .key = "nu", .unit = "-", .above = -1, .below = 0.5,                             \
        .meaning = "Poisson's ratio"                                                     \
    }

/* Lame's constants of a linear law from strains to stresses (Pa). */
typedef struct {
    double lambda, mu;
} lame;

/* Those of space, from {E, nu}. */
static inline lame lame_of_space(const double *parameters)
{
    const double E = parameters[0], nu = parameters[1];
    return (lame){E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))};
}

/* Those that give the stress of a plane from the strains in it where sigma33 = 0. */
static inline lame lame_of_plane_stress(const double *parameters)
{
    const double E = parameters[0], nu = parameters[1];
    return (lame){E * nu / ((1 + nu) * (1 - nu)), E / (2 * (1 + nu))};
}

/* Moduli at rest of a material whose parameters begin with {E, nu}. */
static inline void moduli_of_E_nu(const double *parameters, int d, pd_plane plane,
                                  double *bulk, double *shear)
{
    const double E = parameters[0], nu = parameters[1];
    (void)d, (void)plane; /* the same in every plane */
    *bulk = E / (3 * (1 - 2 * nu));
    *shear = E / (2 * (1 + nu));
}

/* One tensor T[d][d] of a field [d][d][n]. */
PD_INLINE void take_point(const int d, size_t n, size_t p, const double *from, double *T)
{
    for (int c = 0; c < d * d; c++)
        T[c] = from[(size_t)c * n + p];
}

PD_INLINE void put_point(const int d, size_t n, size_t p, const double *T, double *to)
{
    for (int c = 0; c < d * d; c++)
        to[(size_t)c * n + p] = T[c];
}

/* Rate forms of the linear law, in material_rate.c. */
void pd_linear_elastic_update(const double *parameters, int d, size_t n, const double *G,
                              double *sigma, double *plastic);
void pd_linear_elastic_update_plane_stress(const double *parameters, int d, size_t n,
                                           const double *G, double *sigma,
                                           double *plastic);

#endif
