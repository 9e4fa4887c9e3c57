/*
 * Elastic materials of Young's modulus and Poisson's ratio.
 *
 * Plane stress is the law of the plane with another lambda: S33 = 0 where the law is
 * linear in E (Saint Venant-Kirchhoff), T33 = 0 where it is in U (linear elastic).
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "material.h"

static const pd_parameter E_nu[] = {PARAMETER_E, PARAMETER_NU};

/* Strain across a plane of stress: -lambda/(lambda + 2 mu) times the trace in it. */
static double strain_across(const double *parameters, double trace_in_plane)
{
    const double nu = parameters[1];
    return -nu / (1 - nu) * trace_in_plane;
}

/* ---- Saint Venant-Kirchhoff: S = lambda tr(E) 1 + 2 mu E, E = (C - 1)/2 ---- */

PD_INLINE void green_strain(const int d, const double *F, double *E)
{
    for (int r = 0; r < d; r++)
        for (int c = 0; c < d; c++) {
            double sum = r == c ? -1 : 0;
            for (int k = 0; k < d; k++)
                sum += F[k * d + r] * F[k * d + c];
            E[r * d + c] = 0.5 * sum;
        }
}

PD_INLINE void st_venant_points(const int d, lame m, size_t n, const double *restrict F,
                                double *restrict P)
{
    PD_INDEPENDENT
    for (size_t p = 0; p < n; p++) {
        double Fp[9], S[9], Pp[9];
        take_point(d, n, p, F, Fp);
        green_strain(d, Fp, S);
        const double volumetric = m.lambda * trace(d, S);
        for (int c = 0; c < d * d; c++)
            S[c] = 2 * m.mu * S[c] + (c % (d + 1) == 0 ? volumetric : 0);
        multiply(d, Fp, S, Pp);
        put_point(d, n, p, Pp, P);
    }
}

PD_FOR_EVERY_SET
static void st_venant_stress(const double *parameters, int d, size_t n, const double *F,
                             const double *J, double *P)
{
    (void)J;
    if (d == 2)
        st_venant_points(2, lame_of_space(parameters), n, F, P);
    else
        st_venant_points(3, lame_of_space(parameters), n, F, P);
}

static void st_venant_stress_plane_stress(const double *parameters, int d, size_t n,
                                          const double *F, const double *J, double *P)
{
    (void)d, (void)J;
    st_venant_points(2, lame_of_plane_stress(parameters), n, F, P);
}

static double st_venant_energy_of(lame m, int d, const double *F)
{
    double E[9];
    green_strain(d, F, E);
    const double volume = trace(d, E);
    return m.lambda / 2 * volume * volume + m.mu * dot(d * d, E, E);
}

static double st_venant_energy(const double *parameters, int d, const double *F, double J)
{
    (void)J;
    return st_venant_energy_of(lame_of_space(parameters), d, F);
}

static double st_venant_energy_plane_stress(const double *parameters, int d,
                                            const double *F, double J)
{
    (void)J;
    return st_venant_energy_of(lame_of_plane_stress(parameters), d, F);
}

/* F33^2 = 1 + 2 E33; the law lets a plane that is stretched too far vanish. */
static double st_venant_thickness(const double *parameters, const double *F, double J)
{
    (void)J;
    double E[4];
    green_strain(2, F, E);
    const double square = 1 + 2 * strain_across(parameters, trace(2, E));
    return sqrt(fmax(square, PD_SMALLEST_J * PD_SMALLEST_J));
}

static double st_venant_out_of_plane(const double *parameters, const double *F, double J)
{
    double E[4];
    green_strain(2, F, E);
    return lame_of_space(parameters).lambda * trace(2, E) / J;
}

const pd_material pd_material_st_venant_kirchhoff = {
    .name = "StVenantKirchhoff",
    .source = "Hooke's law between S and E",
    .n_parameters = 2,
    .parameters = E_nu,
    .moduli = moduli_of_E_nu,
    .stress = {[PD_PLANE_STRAIN] = st_venant_stress,
               [PD_PLANE_STRESS] = st_venant_stress_plane_stress},
    .energy = {[PD_PLANE_STRAIN] = st_venant_energy,
               [PD_PLANE_STRESS] = st_venant_energy_plane_stress},
    .thickness = st_venant_thickness,
    .out_of_plane = st_venant_out_of_plane,
};

/* ---- linear elastic: P = R T, T = lambda tr(U - 1) 1 + 2 mu (U - 1), F = R U ----
 *
 * The linear law of small strains is not objective in F itself; on the stretch U, in axes
 * that turn with the body, it is. */

/* R towards the rotation in it: the mean of z R and of the transposed inverse of that.
 * Far from it z makes both alike in size, [higham1986]; near it z = 1 squares
 * the error. False where det R is lost in round-off. */
static bool approach_rotation(double *R)
{
    double cofactor[9];
    const double det = determinant(3, R);
    if (!(det > 0))
        return false;
    inverse(3, R, 1, cofactor);
    const double by_det = 1 / det, size2 = dot(9, R, R);
    double keep = 0.5, take = 0.5 * by_det;
    if (fabs(det - 1) + fabs(size2 - 3) > 0.3) {
        const double other = sqrt(dot(9, cofactor, cofactor)) * by_det;
        const double z = sqrt(other / sqrt(size2));
        keep *= z, take /= z;
    }
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            R[r * 3 + c] = keep * R[r * 3 + c] + take * cofactor[c * 3 + r];
    return true;
}

/* R of F = R U, det F > 0; finite, but no rotation, where stretches differ beyond all
 * digits. */
static void polar_rotation_3(const double *F, double *R)
{
    const int most = 30; /* 9 where stretches differ by 1e16 */
    for (int c = 0; c < 9; c++)
        R[c] = F[c];
    for (int k = 0; k < most; k++) {
        double change[9];
        for (int c = 0; c < 9; c++)
            change[c] = R[c];
        if (!approach_rotation(R))
            break;
        subtract(9, R, change, change);
        if (dot(9, change, change) < 1e-16) /* the next would be of that order */
            break;
    }
}

/* The rotation closest to F, det F > 0, and tr U = R : F. */
PD_INLINE double polar(const int d, const double *F, double *R)
{
    if (d == 3) {
        polar_rotation_3(F, R);
        return dot(9, R, F);
    }
    const double cosine = F[0] + F[3], sine = F[2] - F[1];
    const double trace_U = sqrt(cosine * cosine + sine * sine); /* > 0 where det F is */
    R[0] = R[3] = cosine / trace_U;
    R[1] = -(R[2] = sine / trace_U);
    return trace_U;
}

PD_INLINE void linear_points(const int d, lame m, size_t n, const double *restrict F,
                             double *restrict P)
{
    for (size_t p = 0; p < n; p++) {
        double Fp[9], R[9], Pp[9];
        take_point(d, n, p, F, Fp);
        const double volumetric = m.lambda * (polar(d, Fp, R) - d);
        for (int c = 0; c < d * d; c++)
            Pp[c] = 2 * m.mu * (Fp[c] - R[c]) + volumetric * R[c];
        put_point(d, n, p, Pp, P);
    }
}

static void linear_stress(const double *parameters, int d, size_t n, const double *F,
                          const double *J, double *P)
{
    (void)J;
    if (d == 2)
        linear_points(2, lame_of_space(parameters), n, F, P);
    else
        linear_points(3, lame_of_space(parameters), n, F, P);
}

static void linear_stress_plane_stress(const double *parameters, int d, size_t n,
                                       const double *F, const double *J, double *P)
{
    (void)d, (void)J;
    linear_points(2, lame_of_plane_stress(parameters), n, F, P);
}

/* |U - 1| = |F - R|. */
static double linear_energy_of(lame m, int d, const double *F)
{
    double R[9], F_R[9];
    const double volume = (d == 2 ? polar(2, F, R) : polar(3, F, R)) - d;
    subtract(d * d, F, R, F_R);
    return m.lambda / 2 * volume * volume + m.mu * dot(d * d, F_R, F_R);
}

static double linear_energy(const double *parameters, int d, const double *F, double J)
{
    (void)J;
    return linear_energy_of(lame_of_space(parameters), d, F);
}

static double linear_energy_plane_stress(const double *parameters, int d, const double *F,
                                         double J)
{
    (void)J;
    return linear_energy_of(lame_of_plane_stress(parameters), d, F);
}

/* The law lets a plane that is stretched too far vanish. */
static double linear_thickness(const double *parameters, const double *F, double J)
{
    (void)J;
    double R[4];
    return fmax(1 + strain_across(parameters, polar(2, F, R) - 2), PD_SMALLEST_J);
}

static double linear_out_of_plane(const double *parameters, const double *F, double J)
{
    double R[4];
    return lame_of_space(parameters).lambda * (polar(2, F, R) - 2) / J;
}

const pd_material pd_material_linear_elastic = {
    .name = "linearElastic",
    .source = "Hooke's law on U - 1; its Jaumann rate, [behzadinasab2021] eqs B.1-B.4",
    .n_parameters = 2,
    .parameters = E_nu,
    .moduli = moduli_of_E_nu,
    .stress = {[PD_PLANE_STRAIN] = linear_stress,
               [PD_PLANE_STRESS] = linear_stress_plane_stress},
    .energy = {[PD_PLANE_STRAIN] = linear_energy,
               [PD_PLANE_STRESS] = linear_energy_plane_stress},
    .thickness = linear_thickness,
    .out_of_plane = linear_out_of_plane,
    .update = {[PD_PLANE_STRAIN] = pd_linear_elastic_update,
               [PD_PLANE_STRESS] = pd_linear_elastic_update_plane_stress},
};

/* ---- microelastic: moduli alone, Poisson's ratio is that of central forces ---- */

static void microelastic_moduli(const double *parameters, int d, pd_plane plane,
                                double *bulk, double *shear)
{
    const double nu = d == 2 && plane == PD_PLANE_STRESS ? 1. / 3 : 0.25;
    const double E_and_nu[] = {parameters[0], nu};
    moduli_of_E_nu(E_and_nu, d, plane, bulk, shear);
}

const pd_material pd_material_microelastic = {
    .name = "microelastic",
    .source = "[han2025] eq. 15",
    .n_parameters = 1,
    .parameters = E_nu,
    .moduli = microelastic_moduli,
};
