/*
 * Hyperelastic materials: first Piola-Kirchhoff stress and strain energy density.
 * A new material is one table here; its parameters become dictionary keys by themselves.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include <math.h>
#include <string.h>

#include "pd.h"
#include "tensor.h"

double pd_kappa_stab(double G, double nu_stab)
{
    return 2 * G * (1 + nu_stab) / (3 * (1 - 2 * nu_stab));
}

/* ---- modified neo-Hookean, [kim2023] eqs 43-45 ---- */

static const pd_parameter neo_hookean_parameters[] = {
    {.key = "G", .unit = "Pa", .above = 0, .below = HUGE_VAL, .meaning = "shear modulus"},
    {.key = "nuStab",
     .unit = "-",
     .above = -1,
     .below = 0.5,
     .includes_above = true,
     .meaning = "numerical Poisson's ratio, sets kappa_stab"},
};

/* tr C of the three-dimensional C: plane strain adds C33 = 1. */
PD_INLINE double first_invariant(const int d, const double *F)
{
    return dot(d * d, F, F) + (3 - d);
}

PD_INLINE void neo_hookean_points(const int d, double G, double kappa, size_t n,
                                  const double *F, const double *J, double *P)
{
    for (size_t p = 0; p < n; p++, F += d * d, P += d * d) {
        const double log_J = log(J[p]);
        const double isochoric = G * exp(-2. / 3 * log_J); /* G J^(-2/3) */
        const double volumetric = kappa * log_J - isochoric * first_invariant(d, F) / 3;
        double F_inverse[9];
        inverse(d, F, 1 / J[p], F_inverse);
        for (int r = 0; r < d; r++)
            for (int c = 0; c < d; c++)
                P[r * d + c] =
                    isochoric * F[r * d + c] + volumetric * F_inverse[c * d + r];
    }
}

static void neo_hookean_stress(const double *parameters, int d, size_t n, const double *F,
                               const double *J, double *P)
{
    const double G = parameters[0], kappa = pd_kappa_stab(G, parameters[1]);
    if (d == 2)
        neo_hookean_points(2, G, kappa, n, F, J, P);
    else
        neo_hookean_points(3, G, kappa, n, F, J, P);
}

static double neo_hookean_energy(const double *parameters, int d, const double *F,
                                 double J)
{
    const double G = parameters[0], kappa = pd_kappa_stab(G, parameters[1]);
    const double log_J = log(J);
    return G / 2 * (exp(-2. / 3 * log_J) * first_invariant(d, F) - 3) +
           kappa / 2 * log_J * log_J;
}

static void neo_hookean_moduli(const double *parameters, double *bulk, double *shear)
{
    *bulk = pd_kappa_stab(parameters[0], parameters[1]);
    *shear = parameters[0];
}

static const pd_material neo_hookean = {
    .name = "neoHookean",
    .source = "[kim2023] eqs 43-45",
    .n_parameters = 2,
    .parameters = neo_hookean_parameters,
    .moduli = neo_hookean_moduli,
    .stress = {[PD_PLANE_STRAIN] = neo_hookean_stress},
    .energy = {[PD_PLANE_STRAIN] = neo_hookean_energy},
};

/* ---- the table ---- */

const pd_material *const pd_materials[] = {&neo_hookean, NULL};

const pd_material *pd_material_find(const char *name)
{
    for (const pd_material *const *m = pd_materials; *m; m++)
        if (strcmp((*m)->name, name) == 0)
            return *m;
    return NULL;
}
