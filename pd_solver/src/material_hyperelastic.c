/*
 * Rubbers: the modified neo-Hookean and Mooney-Rivlin solids, [kim2023] eqs 43-47.
 *
 *     Psi = c1 (J^(-2/3) I1 - 3) + c2 (J^(-4/3) I2/2 - 3) + kappa/2 (ln J)^2,
 *     I1 = tr C, I2 = (tr C)^2 - tr C^2
 *
 * The neo-Hookean solid is that of c1 = G/2, c2 = 0. In two dimensions F33 = t completes
 * C and J: 1 in plane strain; where Psi is smallest, hence P33 = 0, in plane stress.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "material.h"

typedef struct {
    double c1, c2, kappa; /* Pa */
} rubber;

static rubber neo_hookean_of(const double *parameters)
{
    const double G = parameters[0];
    return (rubber){G / 2, 0, pd_kappa_stab(G, parameters[1])};
}

/* kappa from G = c1 + c2, [kim2023] section 4.1.3. */
static rubber mooney_rivlin_of(const double *parameters)
{
    const double c1 = parameters[0], c2 = parameters[1];
    return (rubber){c1, c2, pd_kappa_stab(c1 + c2, parameters[2])};
}

/* ---- one point ---- */

/* J is that of space; second: c2 is not 0. */
PD_INLINE double energy_at(const int d, const bool second, rubber m, const double *F,
                           double J, double t)
{
    const double log_J = log(J), isochoric = exp(-2. / 3 * log_J); /* J^(-2/3) */
    double I1 = dot(d * d, F, F);
    if (d == 2)
        I1 += t * t;
    double Psi = m.c1 * (isochoric * I1 - 3) + m.kappa / 2 * log_J * log_J;
    if (second) {
        double cofactor[9];
        inverse(d, F, d == 2 ? t : 1, cofactor);
        double half_I2 = dot(d * d, cofactor, cofactor);
        if (d == 2)
            half_I2 += J / t * (J / t);
        Psi += m.c2 * (isochoric * isochoric * half_I2 - 3);
    }
    return Psi;
}

/* I1 F - F C, with the I1 of space. */
PD_INLINE void second_part(const int d, double I1, const double *F, double *T)
{
    double C[9], FC[9];
    for (int r = 0; r < d; r++)
        for (int c = 0; c < d; c++) {
            C[r * d + c] = 0;
            for (int k = 0; k < d; k++)
                C[r * d + c] += F[k * d + r] * F[k * d + c];
        }
    multiply(d, F, C, FC);
    for (int c = 0; c < d * d; c++)
        T[c] = I1 * F[c] - FC[c];
}

/* P, eqs 44 and 47; J is that of F[d][d]. */
PD_INLINE void stress_at(const int d, const bool second, rubber m, const double *F,
                         double J, double t, double *P)
{
    const double log_J = plain_log(d == 2 ? J * t : J);
    const double first = 2 * m.c1 * plain_exp(-2. / 3 * log_J); /* 2 c1 J^(-2/3) */
    double I1 = dot(d * d, F, F);
    if (d == 2)
        I1 += t * t;
    double volumetric = m.kappa * log_J - first * I1 / 3, F_inverse[9];
    inverse(d, F, 1 / J, F_inverse);
    if (!second) {
        for (int r = 0; r < d; r++)
            for (int c = 0; c < d; c++)
                P[r * d + c] = first * F[r * d + c] + volumetric * F_inverse[c * d + r];
        return;
    }
    const double other = 2 * m.c2 * plain_exp(-4. / 3 * log_J);
    double T[9];
    second_part(d, I1, F, T);
    double I2 = dot(d * d, F, T); /* F : (I1 F - F C) = I1 tr C - tr C^2 */
    if (d == 2)
        I2 += t * t * (I1 - t * t);
    volumetric -= other * I2 / 3;
    for (int r = 0; r < d; r++)
        for (int c = 0; c < d; c++)
            P[r * d + c] = first * F[r * d + c] + other * T[r * d + c] +
                           volumetric * F_inverse[c * d + r];
}

/* ---- across the plane ---- */

/* What P33 F33 depends on, beside x = ln F33. */
typedef struct {
    double c1, c2, kappa;              /* 2/3 c1, 2/3 c2, kappa */
    double I, j, log_j, j_to_minus2_3; /* tr C and det F in the plane */
} across;

static across across_of(rubber m, const double *F, double J)
{
    const double log_j = log(J);
    return (across){.c1 = 2. / 3 * m.c1,
                    .c2 = 2. / 3 * m.c2,
                    .kappa = m.kappa,
                    .I = dot(4, F, F),
                    .j = J,
                    .log_j = log_j,
                    .j_to_minus2_3 = exp(-2. / 3 * log_j)};
}

/* P33 F33 and its derivative by x: eqs 44 and 47 with I1 = I + t^2, I2 = 2 (j^2 + I t^2).
 * Each of the three terms rises with x. */
static double pull_across(const across *a, double x, double *slope)
{
    const double e = exp(2. / 3 * x), t2 = e * e * e;
    const double k = a->j_to_minus2_3 / e; /* J^(-2/3) */
    const double first = a->c1 * k, second = a->c2 * k * k, j2 = a->j * a->j;
    *slope =
        2. / 3 * (first * (4 * t2 + a->I) + second * (a->I * t2 + 4 * j2)) + a->kappa;
    return first * (2 * t2 - a->I) + second * (a->I * t2 - 2 * j2) +
           a->kappa * (x + a->log_j);
}

/* The x where the pull is 0 lies between those where its terms are. Newton from their
 * mean, weighed by the stiffness at rest; by halves where Newton would leave the bracket
 * or is slower than that. */
static double log_thickness(rubber m, const double *F, double J)
{
    const across a = across_of(m, F, J);
    const double x1 = 0.5 * log(a.I / 2), x2 = log(a.j) - x1, x3 = -a.log_j;
    double low = fmin(x1, x3), high = fmax(x1, x3);
    if (m.c2 > 0)
        low = fmin(low, x2), high = fmax(high, x2);
    const double w1 = 4. / 3 * m.c1, w2 = 4. / 3 * m.c2;
    double x = (w1 * x1 + w2 * x2 + m.kappa * x3) / (w1 + w2 + m.kappa);
    double last = high - low;
    for (int k = 0; k < 200; k++) {
        double slope;
        const double pull = pull_across(&a, x, &slope);
        if (pull > 0)
            high = x;
        else
            low = x;
        double step = -pull / slope;
        const bool newton =
            x + step >= low && x + step <= high && fabs(step) <= 0.5 * last;
        if (!newton)
            step = 0.5 * (low + high) - x;
        last = fabs(step);
        x += step;
        if (last < 1e-8) /* the next would be of the order of the square */
            break;
    }
    return x;
}

static double thickness(rubber m, const double *F, double J)
{
    return exp(log_thickness(m, F, J));
}

/* sigma33 = P33 F33 / J at F33 = 1. */
static double out_of_plane(rubber m, const double *F, double J)
{
    const across a = across_of(m, F, J);
    double slope;
    return pull_across(&a, 0, &slope) / J;
}

/* ---- many points ---- */

PD_INLINE void stress_points(const int d, const bool second, const bool thins, rubber m,
                             size_t n, const double *restrict F, const double *restrict J,
                             double *restrict P)
{
    PD_INDEPENDENT
    for (size_t p = 0; p < n; p++) {
        double Fp[9], Pp[9];
        take_point(d, n, p, F, Fp);
        stress_at(d, second, m, Fp, J[p], thins ? thickness(m, Fp, J[p]) : 1, Pp);
        put_point(d, n, p, Pp, P);
    }
}

/* ---- neo-Hookean ---- */

PD_FOR_EVERY_SET
static void neo_hookean_stress(const double *parameters, int d, size_t n, const double *F,
                               const double *J, double *P)
{
    if (d == 2)
        stress_points(2, false, false, neo_hookean_of(parameters), n, F, J, P);
    else
        stress_points(3, false, false, neo_hookean_of(parameters), n, F, J, P);
}

static void neo_hookean_stress_plane_stress(const double *parameters, int d, size_t n,
                                            const double *F, const double *J, double *P)
{
    (void)d;
    stress_points(2, false, true, neo_hookean_of(parameters), n, F, J, P);
}

static double neo_hookean_energy(const double *parameters, int d, const double *F,
                                 double J)
{
    return energy_at(d, false, neo_hookean_of(parameters), F, J, 1);
}

static double neo_hookean_thickness(const double *parameters, const double *F, double J)
{
    return thickness(neo_hookean_of(parameters), F, J);
}

static double neo_hookean_energy_plane_stress(const double *parameters, int d,
                                              const double *F, double J)
{
    const double t = neo_hookean_thickness(parameters, F, J);
    (void)d;
    return energy_at(2, false, neo_hookean_of(parameters), F, J * t, t);
}

static double neo_hookean_out_of_plane(const double *parameters, const double *F,
                                       double J)
{
    return out_of_plane(neo_hookean_of(parameters), F, J);
}

static void neo_hookean_moduli(const double *parameters, int d, pd_plane plane,
                               double *bulk, double *shear)
{
    const rubber m = neo_hookean_of(parameters);
    (void)d, (void)plane; /* the same in every plane */
    *bulk = m.kappa;
    *shear = 2 * (m.c1 + m.c2);
}

#define PARAMETER_NU_STAB                                                                \
    {                                                                                    \
        .key = "nuStab", .unit = "-", .above = -1, .below = 0.5, .includes_above = true, \
        .meaning = "numerical Poisson's ratio, sets kappa_stab"                          \
    }

static const pd_parameter neo_hookean_parameters[] = {
    {.key = "G", .unit = "Pa", .above = 0, .below = HUGE_VAL, .meaning = "shear modulus"},
    PARAMETER_NU_STAB,
};

const pd_material pd_material_neo_hookean = {
    .name = "neoHookean",
    .source = "[kim2023] eqs 43-45",
    .n_parameters = 2,
    .parameters = neo_hookean_parameters,
    .moduli = neo_hookean_moduli,
    .stress = {[PD_PLANE_STRAIN] = neo_hookean_stress,
               [PD_PLANE_STRESS] = neo_hookean_stress_plane_stress},
    .energy = {[PD_PLANE_STRAIN] = neo_hookean_energy,
               [PD_PLANE_STRESS] = neo_hookean_energy_plane_stress},
    .thickness = neo_hookean_thickness,
    .out_of_plane = neo_hookean_out_of_plane,
};

/* ---- Mooney-Rivlin ---- */

PD_FOR_EVERY_SET
static void mooney_rivlin_stress(const double *parameters, int d, size_t n,
                                 const double *F, const double *J, double *P)
{
    if (d == 2)
        stress_points(2, true, false, mooney_rivlin_of(parameters), n, F, J, P);
    else
        stress_points(3, true, false, mooney_rivlin_of(parameters), n, F, J, P);
}

static void mooney_rivlin_stress_plane_stress(const double *parameters, int d, size_t n,
                                              const double *F, const double *J, double *P)
{
    (void)d;
    stress_points(2, true, true, mooney_rivlin_of(parameters), n, F, J, P);
}

static double mooney_rivlin_energy(const double *parameters, int d, const double *F,
                                   double J)
{
    return energy_at(d, true, mooney_rivlin_of(parameters), F, J, 1);
}

static double mooney_rivlin_thickness(const double *parameters, const double *F, double J)
{
    return thickness(mooney_rivlin_of(parameters), F, J);
}

static double mooney_rivlin_energy_plane_stress(const double *parameters, int d,
                                                const double *F, double J)
{
    const double t = mooney_rivlin_thickness(parameters, F, J);
    (void)d;
    return energy_at(2, true, mooney_rivlin_of(parameters), F, J * t, t);
}

static double mooney_rivlin_out_of_plane(const double *parameters, const double *F,
                                         double J)
{
    return out_of_plane(mooney_rivlin_of(parameters), F, J);
}

/* The shear modulus at rest of eq. 46 is 2 (c1 + c2), twice the G that sets kappa. */
static void mooney_rivlin_moduli(const double *parameters, int d, pd_plane plane,
                                 double *bulk, double *shear)
{
    const rubber m = mooney_rivlin_of(parameters);
    (void)d, (void)plane; /* the same in every plane */
    *bulk = m.kappa;
    *shear = 2 * (m.c1 + m.c2);
}

static const pd_parameter mooney_rivlin_parameters[] = {
    {.key = "c1",
     .unit = "Pa",
     .above = 0,
     .below = HUGE_VAL,
     .meaning = "of the first invariant; the shear modulus is 2 (c1 + c2)"},
    {.key = "c2",
     .unit = "Pa",
     .above = 0,
     .below = HUGE_VAL,
     .includes_above = true,
     .meaning = "of the second invariant"},
    PARAMETER_NU_STAB,
};

const pd_material pd_material_mooney_rivlin = {
    .name = "MooneyRivlin",
    .source = "[kim2023] eqs 45-47",
    .n_parameters = 3,
    .parameters = mooney_rivlin_parameters,
    .moduli = mooney_rivlin_moduli,
    .stress = {[PD_PLANE_STRAIN] = mooney_rivlin_stress,
               [PD_PLANE_STRESS] = mooney_rivlin_stress_plane_stress},
    .energy = {[PD_PLANE_STRAIN] = mooney_rivlin_energy,
               [PD_PLANE_STRESS] = mooney_rivlin_energy_plane_stress},
    .thickness = mooney_rivlin_thickness,
    .out_of_plane = mooney_rivlin_out_of_plane,
};
