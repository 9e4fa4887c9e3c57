/*
 * Hyperelastic materials: closed forms, and what all must keep in every plane.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _GNU_SOURCE /* feenableexcept */
#include <fenv.h>

#include "lattice.h"

/* Rounding of the dozen operations of a stress of order G. */
#define ROUNDING 1e-14

static const double unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
static const double twisted[9] = {1.21, 0.17, -0.05, -0.08, 0.93, 0.11, 0.13, 0.04, 1.06};

/* ---- one deformation gradient ---- */

/* Rows and columns of the plane. */
static void to_plane(const double *T, double *plane)
{
    plane[0] = T[0], plane[1] = T[1], plane[2] = T[3], plane[3] = T[4];
}

static double volume_ratio(int d, const double *F)
{
    return d == 2 ? F[0] * F[3] - F[1] * F[2] : determinant3(F);
}

static void stress_of(const pd_material *material, const double *parameters, int d,
                      pd_plane plane, const double *F, double *P)
{
    const double J = volume_ratio(d, F);
    material->stress[plane](parameters, d, 1, F, &J, P);
}

static double energy_of(const pd_material *material, const double *parameters, int d,
                        pd_plane plane, const double *F)
{
    return material->energy[plane](parameters, d, F, volume_ratio(d, F));
}

static void neo_hookean(double nu_stab, int d, const double *F, double *P)
{
    const double parameters[PD_MAX_PARAMETERS] = {1, nu_stab};
    stress_of(pd_material_find("neoHookean"), parameters, d, PD_PLANE_STRAIN, F, P);
}

static void multiply(int d, const double *A, const double *B, double *AB)
{
    for (int r = 0; r < d; r++)
        for (int c = 0; c < d; c++) {
            AB[r * d + c] = 0;
            for (int k = 0; k < d; k++)
                AB[r * d + c] += A[r * d + k] * B[k * d + c];
        }
}

/* ---- every material ---- */

/* A material with a stress at allowed parameters, in one plane or in space, deformed
 * without symmetry. */
typedef struct {
    const pd_material *material;
    int d;
    pd_plane plane;
    double parameters[PD_MAX_PARAMETERS];
    double F[9];
    double modulus; /* of longitudinal waves: the scale of stresses */
} specimen;

static specimen specimen_of(const pd_material *material, int d, pd_plane plane)
{
    specimen s = {.material = material, .d = d, .plane = plane};
    for (int k = 0; k < material->n_parameters; k++)
        s.parameters[k] = some_value(&material->parameters[k]);
    if (d == 2)
        to_plane(twisted, s.F);
    else
        memcpy(s.F, twisted, sizeof twisted);
    s.modulus = pd_longitudinal_modulus(material, s.parameters, d, plane);
    return s;
}

static void for_every_specimen(void (*check)(const specimen *))
{
    for (const pd_material *const *m = pd_materials; *m; m++)
        for (int d = 2; d <= 3; d++)
            for (int plane = 0; plane < (d == 2 ? PD_PLANES : 1); plane++) {
                if (!(*m)->stress[plane])
                    continue;
                const specimen s = specimen_of(*m, d, (pd_plane)plane);
                check(&s);
            }
}

static void stress_of_specimen(const specimen *s, const double *F, double *P)
{
    stress_of(s->material, s->parameters, s->d, s->plane, F, P);
}

static double energy_of_specimen(const specimen *s, const double *F)
{
    return energy_of(s->material, s->parameters, s->d, s->plane, F);
}

static void to_identity(int d, double *F)
{
    for (int c = 0; c < d * d; c++)
        F[c] = c % (d + 1) == 0;
}

/* ---- closed forms ---- */

static void kappa_follows_from_numerical_poisson_ratio(void **state)
{
    assert_near(pd_kappa_stab(80, -1), 0, 0);
    assert_near(pd_kappa_stab(1, 0.4), 14. / 3, 1e-14); /* 1 - 2 nu_stab loses a digit */
    assert_near(pd_kappa_stab(1, 0), 2. / 3, ROUNDING);
}

/* J = 1, tr C = 3.25: P = F - 3.25/3 F^-T, whatever kappa. */
static void simple_shear_has_its_closed_form(void **state)
{
    const double F[9] = {1, 0.5, 0, 0, 1, 0, 0, 0, 1};
    const double expected[9] = {-0.25 / 3, 0.5, 0, 3.25 / 6, -0.25 / 3,
                                0,         0,   0, -0.25 / 3};
    double P[9];
    neo_hookean(0.4, 3, F, P);
    for (int c = 0; c < 9; c++)
        assert_near(P[c], expected[c], ROUNDING);
}

/* J = 1, tr C = 3.134444 with C33 = 1; the expected values are given to six digits. */
static void plane_strain_stretch_has_its_closed_form(void **state)
{
    const double F[4] = {1.2, 0, 0, 1 / 1.2};
    double P[4];
    neo_hookean(0.4, 2, F, P);
    assert_near(P[0], 0.329321, 1e-6);
    assert_near(P[3], -0.420444, 1e-6);
    assert_near(P[1], 0, ROUNDING);
    assert_near(P[2], 0, ROUNDING);
}

/* F = 1.1 I: no isochoric stress; P = kappa ln(1.331)/1.1. */
static void dilation_is_resisted_by_kappa_alone(void **state)
{
    const double F[9] = {1.1, 0, 0, 0, 1.1, 0, 0, 0, 1.1};
    double P[9];
    neo_hookean(0.4, 3, F, P);
    for (int c = 0; c < 9; c++)
        assert_near(P[c], unit[c] * 14. / 3 * log(1.331) / 1.1, ROUNDING);
}

static void dilation_costs_nothing_without_kappa(void **state)
{
    const double F[9] = {1.1, 0, 0, 0, 1.1, 0, 0, 0, 1.1};
    const double parameters[PD_MAX_PARAMETERS] = {1, -1};
    double P[9];
    neo_hookean(-1, 3, F, P);
    for (int c = 0; c < 9; c++)
        assert_near(P[c], 0, ROUNDING);
    assert_near(
        energy_of(pd_material_find("neoHookean"), parameters, 3, PD_PLANE_STRAIN, F), 0,
        ROUNDING);
}

/* eq. 43 by hand: simple shear (3.25 - 3)/2, dilation kappa/2 ln(1.331)^2. */
static void energy_has_its_closed_form(void **state)
{
    const pd_material *material = pd_material_find("neoHookean");
    const double parameters[PD_MAX_PARAMETERS] = {1, 0.4};
    const double shear[9] = {1, 0.5, 0, 0, 1, 0, 0, 0, 1};
    const double dilation[9] = {1.1, 0, 0, 0, 1.1, 0, 0, 0, 1.1};
    assert_near(energy_of(material, parameters, 3, PD_PLANE_STRAIN, shear), 0.125,
                ROUNDING);
    assert_near(energy_of(material, parameters, 3, PD_PLANE_STRAIN, dilation),
                7. / 3 * log(1.331) * log(1.331), ROUNDING);
}

/* Uniaxial strain of a linear solid: G 4/3 + kappa. */
static void longitudinal_modulus_is_kappa_and_four_thirds_G(void **state)
{
    const double parameters[PD_MAX_PARAMETERS] = {1, 0.4};
    assert_near(pd_longitudinal_modulus(pd_material_find("neoHookean"), parameters, 3,
                                        PD_PLANE_STRAIN),
                6, ROUNDING);
}

/* F = diag(2, 1/2^(1/2), 1/2^(1/2)), J = 1: what the pressure cannot change is
 * sigma11 - sigma22 = 2 (4 - 1/2) (c1 + c2/2), as of any Mooney-Rivlin solid. */
static void mooney_rivlin_stretch_has_its_closed_form(void **state)
{
    const double c1 = 3, c2 = 5, side = sqrt(0.5);
    const double parameters[PD_MAX_PARAMETERS] = {c1, c2, 0.4};
    const double F[9] = {2, 0, 0, 0, side, 0, 0, 0, side};
    double P[9];
    stress_of(pd_material_find("MooneyRivlin"), parameters, 3, PD_PLANE_STRAIN, F, P);
    assert_near(P[0] * 2 - P[4] * side, 7 * (c1 + c2 / 2), 100 * ROUNDING);
    assert_near(P[4], P[8], 100 * ROUNDING);
}

/* Shear of J = 1, tr C = tr C^-1 = 3 + gamma^2: Psi = (c1 + c2) gamma^2, P12 its
 * derivative. */
static void mooney_rivlin_shear_has_its_closed_form(void **state)
{
    const double parameters[PD_MAX_PARAMETERS] = {3, 5, 0.4};
    const pd_material *material = pd_material_find("MooneyRivlin");
    const double F[9] = {1, 0.5, 0, 0, 1, 0, 0, 0, 1};
    double P[9];
    stress_of(material, parameters, 3, PD_PLANE_STRAIN, F, P);
    assert_near(P[1], 2 * 8 * 0.5, 100 * ROUNDING);
    assert_near(energy_of(material, parameters, 3, PD_PLANE_STRAIN, F), 8 * 0.25,
                100 * ROUNDING);
}

/* kappa from G = c1 + c2 as [kim2023] has it, although the shear modulus is twice that.
 */
static void mooney_rivlin_kappa_is_that_of_c1_and_c2(void **state)
{
    const double parameters[PD_MAX_PARAMETERS] = {3, 5, 0.4};
    double K, G;
    pd_material_find("MooneyRivlin")->moduli(parameters, 3, PD_PLANE_STRAIN, &K, &G);
    assert_near(K, 14. / 3 * 8, 1e-12);
    assert_near(G, 16, 0);
}

/* Without volume change a square sheet of rubber pulled to twice its sides has
 * P11 = G (2 - 2^-5) and a fourth of its thickness; kappa is 5e6 G. */
static void stretched_sheet_has_its_closed_form(void **state)
{
    const pd_material *material = pd_material_find("neoHookean");
    const double parameters[PD_MAX_PARAMETERS] = {1, 0.4999999};
    const double F[4] = {2, 0, 0, 2};
    double P[4];
    stress_of(material, parameters, 2, PD_PLANE_STRESS, F, P);
    assert_near(P[0], 2 - 1. / 32, 1e-6);
    assert_near(material->thickness(parameters, F, 4), 0.25, 1e-6);
}

/* A bar of 1.2 times its length: E11 = 0.22 and U11 - 1 = 0.2; lambda = 40, mu = 80. */
static void stretch_has_the_closed_forms_of_E_and_nu(void **state)
{
    const double parameters[PD_MAX_PARAMETERS] = {200 - 1. / 3 * 40, 1. / 6};
    const double F[9] = {1.2, 0, 0, 0, 1, 0, 0, 0, 1};
    double P[9];
    stress_of(pd_material_find("StVenantKirchhoff"), parameters, 3, PD_PLANE_STRAIN, F,
              P);
    assert_near(P[0], 1.2 * 200 * 0.22, 1e-12);
    assert_near(P[4], 40 * 0.22, 1e-12);
    stress_of(pd_material_find("linearElastic"), parameters, 3, PD_PLANE_STRAIN, F, P);
    assert_near(P[0], 200 * 0.2, 1e-12);
    assert_near(P[4], 40 * 0.2, 1e-12);
}

/* F = R U with any turn and stretches that differ by 1e6: P = R T(U); the largest is
 * about 200 times 1e3. */
static void linear_stress_finds_any_rotation(void **state)
{
    const double parameters[PD_MAX_PARAMETERS] = {200 - 1. / 3 * 40, 1. / 6};
    const double U[][3] = {{1, 1, 1}, {1.3, 0.8, 1.1}, {1e-3, 1, 1e3}};
    for (size_t k = 0; k < 3; k++)
        for (double angle = 0; angle < 6.4; angle += 0.4) {
            const affine R = rotation(3, angle);
            double F[9], P[9], volume = U[k][0] + U[k][1] + U[k][2] - 3;
            for (int c = 0; c < 9; c++)
                F[c] = R.A[c] * U[k][c % 3];
            stress_of(pd_material_find("linearElastic"), parameters, 3, PD_PLANE_STRAIN,
                      F, P);
            for (int c = 0; c < 9; c++)
                assert_near(P[c], R.A[c] * (40 * volume + 160 * (U[k][c % 3] - 1)),
                            k < 2 ? 1e-12 : 1e-9);
        }
}

/* Bonds of central forces have nu = 1/3 in plane stress: E/(1 - nu) and E/(1 - nu^2) give
 * the 1.5 E z^2 of strain z all around, the 9/16 E e^2 of strain e along one axis. */
static void microelastic_solid_has_the_ratio_of_its_plane(void **state)
{
    const pd_material *material = pd_material_find("microelastic");
    const double E = 80;
    double K, G;
    material->moduli(&E, 2, PD_PLANE_STRESS, &K, &G);
    assert_near(2 * 9 * K * G / (3 * K + 4 * G), 1.5 * E, 1e-12);
    assert_near(pd_longitudinal_modulus(material, &E, 2, PD_PLANE_STRESS) / 2,
                9. / 16 * E, 1e-12);
    assert_near(pd_longitudinal_modulus(material, &E, 2, PD_PLANE_STRAIN), 1.2 * E,
                1e-12);
    assert_near(pd_longitudinal_modulus(material, &E, 3, PD_PLANE_STRAIN), 1.2 * E,
                1e-12);
    assert_near(pd_longitudinal_modulus(material, &E, 1, PD_PLANE_STRAIN), E, 1e-12);
}

/* ---- what every material keeps ---- */

static void check_rest(const specimen *s)
{
    double F[9], P[9];
    to_identity(s->d, F);
    stress_of_specimen(s, F, P);
    assert_near(largest(P, (size_t)(s->d * s->d)), 0, ROUNDING * s->modulus);
    assert_near(energy_of_specimen(s, F), 0, ROUNDING * s->modulus);
}

static void rest_is_free_of_stress_and_energy(void **state)
{
    for_every_specimen(check_rest);
}

/* P = dPsi/dF by central differences: step 1e-5 balances truncation, 1e-10, and rounding,
 * 1e-16/1e-5; both relative to the modulus, 1e-9 leaves room for the third derivative. */
static void check_derivative(const specimen *s)
{
    const double step = 1e-5;
    double P[9];
    stress_of_specimen(s, s->F, P);
    for (int c = 0; c < s->d * s->d; c++) {
        double F[9];
        memcpy(F, s->F, sizeof F);
        F[c] = s->F[c] + step;
        const double above = energy_of_specimen(s, F);
        F[c] = s->F[c] - step;
        const double below = energy_of_specimen(s, F);
        assert_near(P[c], (above - below) / (2 * step), 1e-9 * s->modulus);
    }
}

static void stress_is_the_derivative_of_the_energy(void **state)
{
    for_every_specimen(check_derivative);
}

/* Derivative of P_rc by F_ab at rest. The square term makes an error of the order of the
 * step, 1e-6, cancelled by taking both signs. Rounding: 1e-16/1e-6. */
static double tangent(const specimen *s, int rc, int ab)
{
    const double step = 1e-6;
    double F[9], above[9], below[9];
    to_identity(s->d, F);
    F[ab] += step;
    stress_of_specimen(s, F, above);
    F[ab] -= 2 * step;
    stress_of_specimen(s, F, below);
    return (above[rc] - below[rc]) / (2 * step);
}

/* Lame's constants of space and of plane stress, from the bulk and shear modulus. */
static void check_moduli(const specimen *s)
{
    const int d = s->d;
    double K, G;
    s->material->moduli(s->parameters, d, s->plane, &K, &G);
    const double lambda = K - 2. / 3 * G;
    const double side =
        s->plane == PD_PLANE_STRESS ? 2 * lambda * G / (lambda + 2 * G) : lambda;
    const double tolerance = 1e-8 * s->modulus;
    assert_near(tangent(s, 0, 0), side + 2 * G, tolerance);
    assert_near(s->modulus, side + 2 * G, ROUNDING * s->modulus);
    assert_near(tangent(s, 0, d + 1), side, tolerance);
    assert_near(tangent(s, 1, 1), G, tolerance);
    assert_near(tangent(s, 1, d), G, tolerance);
    assert_near(tangent(s, 0, 1), 0, tolerance);
}

static void small_strains_meet_the_moduli(void **state)
{
    for_every_specimen(check_moduli);
}

/* P(R F) = R P(F) and Psi(R F) = Psi(F). */
static void check_objectivity(const specimen *s)
{
    const affine turn = rotation(s->d, 0.7);
    double R[9], RF[9], P[9], RP[9], turned[9];
    if (s->d == 2)
        to_plane(turn.A, R);
    else
        memcpy(R, turn.A, sizeof R);
    multiply(s->d, R, s->F, RF);
    stress_of_specimen(s, s->F, P);
    stress_of_specimen(s, RF, turned);
    multiply(s->d, R, P, RP);
    for (int c = 0; c < s->d * s->d; c++)
        assert_near(turned[c], RP[c], ROUNDING * s->modulus);
    assert_near(energy_of_specimen(s, RF), energy_of_specimen(s, s->F),
                ROUNDING * s->modulus);
}

static void stress_turns_with_the_body(void **state)
{
    for_every_specimen(check_objectivity);
}

/* P F^T = F P^T: no couples. */
static void check_symmetry(const specimen *s)
{
    const int d = s->d;
    double P[9], Ft[9] = {0}, PFt[9];
    stress_of_specimen(s, s->F, P);
    for (int c = 0; c < d * d; c++)
        Ft[c] = s->F[c % d * d + c / d];
    multiply(d, P, Ft, PFt);
    for (int c = 0; c < d * d; c++)
        assert_near(PFt[c], PFt[c % d * d + c / d], ROUNDING * s->modulus);
}

static void stress_exerts_no_couple(void **state)
{
    for_every_specimen(check_symmetry);
}

/* As many as take whole vectors and leave some over. */
#define BATCH 19

static void check_batch(const specimen *s)
{
    const size_t dd = (size_t)(s->d * s->d);
    double F[BATCH * 9], J[BATCH], P[BATCH * 9], one[9], alone[9];
    for (size_t p = 0; p < BATCH; p++) {
        for (size_t c = 0; c < dd; c++)
            F[c * BATCH + p] = one[c] = s->F[c] * (1 + 0.01 * (double)p);
        J[p] = volume_ratio(s->d, one);
    }
    s->material->stress[s->plane](s->parameters, s->d, BATCH, F, J, P);
    for (size_t p = 0; p < BATCH; p++) {
        for (size_t c = 0; c < dd; c++)
            one[c] = F[c * BATCH + p];
        stress_of_specimen(s, one, alone);
        /* The same operations, but vectors may fuse others of them. */
        for (size_t c = 0; c < dd; c++)
            assert_near(P[c * BATCH + p], alone[c], 10 * ROUNDING * s->modulus);
    }
}

static void many_points_are_stressed_as_one_by_one(void **state)
{
    for_every_specimen(check_batch);
}

/* ---- the third direction ---- */

/* A specimen of the plane as one of space, with that F33. */
static specimen in_space(const specimen *s, double F33)
{
    specimen whole = *s;
    whole.d = 3, whole.plane = PD_PLANE_STRAIN;
    const double F[9] = {s->F[0], s->F[1], 0, s->F[2], s->F[3], 0, 0, 0, F33};
    memcpy(whole.F, F, sizeof F);
    return whole;
}

/* Stress and energy of the plane are those of space; returns P33 there. */
static double compare_with_space(const specimen *s, double F33)
{
    const specimen whole = in_space(s, F33);
    double P2[4], P3[9], in_plane[4];
    stress_of_specimen(s, s->F, P2);
    stress_of_specimen(&whole, whole.F, P3);
    to_plane(P3, in_plane);
    for (int c = 0; c < 4; c++)
        assert_near(P2[c], in_plane[c], ROUNDING * s->modulus);
    assert_near(energy_of_specimen(s, s->F), energy_of_specimen(&whole, whole.F),
                ROUNDING * s->modulus);
    return P3[8];
}

static void check_plane_strain(const specimen *s)
{
    if (s->d == 3 || s->plane != PD_PLANE_STRAIN)
        return;
    const double P33 = compare_with_space(s, 1), J = volume_ratio(2, s->F);
    assert_near(s->material->out_of_plane(s->parameters, s->F, J), P33 / J,
                ROUNDING * s->modulus);
}

static void plane_strain_is_space_without_strain_across(void **state)
{
    for_every_specimen(check_plane_strain);
}

static bool is_rubber(const pd_material *material)
{
    return strcmp(material->name, "neoHookean") == 0 ||
           strcmp(material->name, "MooneyRivlin") == 0;
}

/* Thick, thin, sheared and pulled to ten times its length: F33 in [0.1, 3]. Saint Venant
 * and the linear law have no plane stress where F33 would not be above 0. */
static void check_plane_stress(const specimen *s)
{
    if (s->plane != PD_PLANE_STRESS)
        return;
    const double maps[][4] = {{1, 0, 0, 1},          {1.21, 0.17, -0.08, 0.93},
                              {0.5, 0.3, -0.1, 0.7}, {0.1, 0, 0, 1.2},
                              {1.3, 1, -1, 1.1},     {10, 2, 0, 0.4}};
    const bool soft = is_rubber(s->material);
    for (size_t k = 0; k < (soft ? 6 : 4); k++) {
        specimen sheet = *s;
        memcpy(sheet.F, maps[k], sizeof maps[k]);
        const double t =
            s->material->thickness(s->parameters, sheet.F, volume_ratio(2, sheet.F));
        assert_true(t > 0);
        /* At 10 the stress is a hundred moduli. */
        specimen scaled = sheet;
        scaled.modulus *= k == 5 ? 100 : 3;
        assert_near(compare_with_space(&scaled, t), 0, ROUNDING * scaled.modulus);
    }
}

static void plane_stress_is_space_without_stress_across(void **state)
{
    for_every_specimen(check_plane_stress);
}

/* Cauchy stress P F^T/J of space, with the F33 that the plane has. */
static void check_body(const specimen *s)
{
    points cloud = lattice(s->d, 5, 4, 4, 0.1);
    pd_body_options options = options_of(s->d, 2.015);
    options.plane = s->plane, options.material = s->material;
    memcpy(options.parameters, s->parameters, sizeof s->parameters);
    pd_body *body = body_of(&cloud, &options);
    const affine map = distortion(s->d);
    body_map(body, &map);
    assert_ok(pd_body_forces(body));
    double *sigma = calloc(cloud.n * PD_SYMMETRIC, sizeof *sigma), P[9];
    pd_body_stress(body, sigma, NULL);

    specimen whole = *s;
    const bool thins = s->plane == PD_PLANE_STRESS;
    if (s->d == 2)
        whole = in_space(
            s, thins ? s->material->thickness(s->parameters, s->F, volume_ratio(2, s->F))
                     : 1);
    stress_of_specimen(&whole, whole.F, P);
    const int from[PD_SYMMETRIC][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
    for (int k = 0; k < PD_SYMMETRIC; k++) {
        double expected = 0;
        for (int c = 0; c < 3; c++)
            expected += P[from[k][0] * 3 + c] * whole.F[from[k][1] * 3 + c];
        /* F of a body rounds to 1e-13 at corners. */
        assert_near(sigma[k], expected / determinant3(whole.F), 1e-12 * s->modulus);
    }
    free(sigma);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void bodies_know_their_whole_cauchy_stress(void **state)
{
    for_every_specimen(check_body);
}

/* ---- where traps are on, as in OpenFOAM ---- */

enum { TRAPS = FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW };

static void check_extreme(const specimen *s, const double *F)
{
    double P[9], across = 0;
    feclearexcept(TRAPS);
    feenableexcept(TRAPS);
    stress_of_specimen(s, F, P);
    const double energy = energy_of_specimen(s, F);
    if (s->d == 2 && s->plane == PD_PLANE_STRESS)
        across = s->material->thickness(s->parameters, F, volume_ratio(2, F));
    if (s->d == 2 && s->plane == PD_PLANE_STRAIN)
        across = s->material->out_of_plane(s->parameters, F, volume_ratio(2, F));
    fedisableexcept(TRAPS);
    assert_true(isfinite(largest(P, (size_t)(s->d * s->d))));
    assert_true(isfinite(energy) && isfinite(across));
    assert_true(s->d == 3 || s->plane != PD_PLANE_STRESS || across > 0);
}

/* P33 F33 is a difference of terms of the size of modulus J^(-2/3) tr C and, where c2 is
 * not 0, its square. */
static void check_pull_across(const specimen *s, const double *F)
{
    if (s->plane != PD_PLANE_STRESS || !is_rubber(s->material))
        return;
    specimen sheet = *s;
    memcpy(sheet.F, F, 4 * sizeof *F);
    const double j = volume_ratio(2, F);
    const double t = s->material->thickness(s->parameters, F, j);
    const specimen whole = in_space(&sheet, t);
    double P[9];
    stress_of_specimen(&whole, whole.F, P);
    double I1 = t * t;
    for (int c = 0; c < 4; c++)
        I1 += F[c] * F[c];
    const double size = pow(j * t, -2. / 3) * I1;
    assert_near(P[8] * t, 0, 1e-12 * s->modulus * size * (1 + size));
}

/* Stretches a and b along axes that lie askew, then a shear; c is the third. */
static void check_extremes(const specimen *s)
{
    const double sizes[][3] = {{1, 1, 1},       {1e-3, 1, 1},     {1e-3, 1e3, 1},
                               {1e3, 1e3, 1e3}, {0.1, 0.1, 0.11}, {1e-2, 1e2, 1},
                               {1e-8, 1e8, 1},  {1e-20, 1e20, 1}, {1e20, 1e20, 1},
                               {1e59, 1e59, 1}, {1e59, 1e-59, 1}, {1e59, 1e59, 1e59}};
    const affine turn = rotation(s->d, 0.7);
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++)
        for (int shear = 0; shear < 2; shear++) {
            double R[9], U[9] = {0}, F[9];
            if (s->d == 2)
                to_plane(turn.A, R);
            else
                memcpy(R, turn.A, sizeof R);
            for (int a = 0; a < s->d; a++)
                U[a * s->d + a] = sizes[k][a];
            U[1] = shear * sizes[k][0];
            multiply(s->d, R, U, F);
            const double J = volume_ratio(s->d, F);
            if (J > PD_SMALLEST_J) /* what a body asks for; round-off may take it away */
                check_extreme(s, F);
            if (volume_ratio(s->d, U) > PD_SMALLEST_J) {
                check_extreme(s, U);
                check_pull_across(s, U);
            }
        }
}

static void no_trap_at_any_deformation(void **state)
{
    for_every_specimen(check_extremes);
}

/* Two turns, and stretches of any size in between: J is round-off in many, and above 0 in
 * half of those. */
static void nonsense(uint32_t *seed, int d, double span, double *F)
{
    const affine one = rotation(d, 3 * next_random(seed)),
                 z = rotation(2, next_random(seed));
    double R[9] = {1, 0, 0, 1}, Q[9] = {1, 0, 0, 1};
    if (d == 2) {
        to_plane(one.A, R);
        to_plane(z.A, Q);
    } else {
        memcpy(R, one.A, sizeof R);
        memcpy(Q, z.A, sizeof Q);
    }
    for (int a = 0; a < d; a++) {
        const double size = pow(10, span * next_random(seed));
        for (int r = 0; r < d; r++)
            R[r * d + a] *= size;
    }
    multiply(d, R, Q, F);
}

static void check_nonsense(const specimen *s)
{
    const double span[] = {1, 5, 20, 59};
    uint32_t seed = 17;
    for (int k = 0; k < 4000; k++) {
        double F[9];
        nonsense(&seed, s->d, span[k % 4], F);
        if (volume_ratio(s->d, F) > PD_SMALLEST_J)
            check_extreme(s, F);
    }
}

static void no_trap_at_nonsense(void **state)
{
    for_every_specimen(check_nonsense);
}

/* ---- the table ---- */

static void materials_are_found_by_name(void **state)
{
    for (const pd_material *const *m = pd_materials; *m; m++)
        assert_ptr_equal(pd_material_find((*m)->name), *m);
    assert_null(pd_material_find("marshmallow"));
    assert_null(pd_material_find(""));
}

static void formulations_are_found_by_name(void **state)
{
    for (const pd_formulation *const *f = pd_formulations; *f; f++)
        assert_ptr_equal(pd_formulation_find((*f)->name), *f);
    assert_null(pd_formulation_find("marshmallow"));
}

static void parameters_are_described(void **state)
{
    for (const pd_material *const *m = pd_materials; *m; m++) {
        assert_in_range((*m)->n_parameters, 1, PD_MAX_PARAMETERS);
        for (int k = 0; k < (*m)->n_parameters; k++) {
            const pd_parameter *p = &(*m)->parameters[k];
            assert_true(strlen(p->key) > 0 && strlen(p->meaning) > 0);
            assert_true(p->above < p->below);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kappa_follows_from_numerical_poisson_ratio),
        cmocka_unit_test(simple_shear_has_its_closed_form),
        cmocka_unit_test(plane_strain_stretch_has_its_closed_form),
        cmocka_unit_test(dilation_is_resisted_by_kappa_alone),
        cmocka_unit_test(dilation_costs_nothing_without_kappa),
        cmocka_unit_test(energy_has_its_closed_form),
        cmocka_unit_test(longitudinal_modulus_is_kappa_and_four_thirds_G),
        cmocka_unit_test(mooney_rivlin_stretch_has_its_closed_form),
        cmocka_unit_test(mooney_rivlin_shear_has_its_closed_form),
        cmocka_unit_test(mooney_rivlin_kappa_is_that_of_c1_and_c2),
        cmocka_unit_test(stretched_sheet_has_its_closed_form),
        cmocka_unit_test(stretch_has_the_closed_forms_of_E_and_nu),
        cmocka_unit_test(linear_stress_finds_any_rotation),
        cmocka_unit_test(microelastic_solid_has_the_ratio_of_its_plane),
        cmocka_unit_test(rest_is_free_of_stress_and_energy),
        cmocka_unit_test(stress_is_the_derivative_of_the_energy),
        cmocka_unit_test(small_strains_meet_the_moduli),
        cmocka_unit_test(stress_turns_with_the_body),
        cmocka_unit_test(stress_exerts_no_couple),
        cmocka_unit_test(many_points_are_stressed_as_one_by_one),
        cmocka_unit_test(plane_strain_is_space_without_strain_across),
        cmocka_unit_test(plane_stress_is_space_without_stress_across),
        cmocka_unit_test(bodies_know_their_whole_cauchy_stress),
        cmocka_unit_test(no_trap_at_any_deformation),
        cmocka_unit_test(no_trap_at_nonsense),
        cmocka_unit_test(materials_are_found_by_name),
        cmocka_unit_test(formulations_are_found_by_name),
        cmocka_unit_test(parameters_are_described),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
