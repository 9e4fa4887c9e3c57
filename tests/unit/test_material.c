/*
 * Materials: closed forms of the modified neo-Hookean solid, [kim2023] eqs 43-45, and
 * what any hyperelastic material must keep.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
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
                      const double *F, double *P)
{
    const double J = volume_ratio(d, F);
    material->stress[PD_PLANE_STRAIN](parameters, d, 1, F, &J, P);
}

static double energy_of(const pd_material *material, const double *parameters, int d,
                        const double *F)
{
    return material->energy[PD_PLANE_STRAIN](parameters, d, F, volume_ratio(d, F));
}

static void neo_hookean(double nu_stab, int d, const double *F, double *P)
{
    const double parameters[PD_MAX_PARAMETERS] = {1, nu_stab};
    stress_of(pd_material_find("neoHookean"), parameters, d, F, P);
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

/* A material at allowed parameters, in two or three dimensions, deformed without
 * symmetry. */
typedef struct {
    const pd_material *material;
    int d;
    double parameters[PD_MAX_PARAMETERS];
    double F[9];
} specimen;

static void for_every_specimen(void (*check)(const specimen *))
{
    for (const pd_material *const *m = pd_materials; *m; m++)
        for (int d = 2; d <= 3; d++) {
            specimen s = {.material = *m, .d = d};
            for (int k = 0; k < (*m)->n_parameters; k++)
                s.parameters[k] = some_value(&(*m)->parameters[k]);
            if (d == 2)
                to_plane(twisted, s.F);
            else
                memcpy(s.F, twisted, sizeof twisted);
            check(&s);
        }
}

static void stress_of_specimen(const specimen *s, const double *F, double *P)
{
    stress_of(s->material, s->parameters, s->d, F, P);
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
    assert_near(energy_of(pd_material_find("neoHookean"), parameters, 3, F), 0, ROUNDING);
}

/* eq. 43 by hand: simple shear (3.25 - 3)/2, dilation kappa/2 ln(1.331)^2. */
static void energy_has_its_closed_form(void **state)
{
    const pd_material *material = pd_material_find("neoHookean");
    const double parameters[PD_MAX_PARAMETERS] = {1, 0.4};
    const double shear[9] = {1, 0.5, 0, 0, 1, 0, 0, 0, 1};
    const double dilation[9] = {1.1, 0, 0, 0, 1.1, 0, 0, 0, 1.1};
    assert_near(energy_of(material, parameters, 3, shear), 0.125, ROUNDING);
    assert_near(energy_of(material, parameters, 3, dilation),
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

/* ---- what every material keeps ---- */

static void check_rest(const specimen *s)
{
    double F[9], P[9];
    for (int c = 0; c < s->d * s->d; c++)
        F[c] = c % (s->d + 1) == 0;
    stress_of_specimen(s, F, P);
    const double scale =
        pd_longitudinal_modulus(s->material, s->parameters, s->d, PD_PLANE_STRAIN);
    assert_near(largest(P, (size_t)(s->d * s->d)), 0, ROUNDING * scale);
    assert_near(energy_of(s->material, s->parameters, s->d, F), 0, ROUNDING * scale);
}

static void rest_is_free_of_stress_and_energy(void **state)
{
    for_every_specimen(check_rest);
}

/* P = dPsi/dF by central differences: step 1e-5 balances truncation, 1e-10, and rounding,
 * 1e-16/1e-5; both relative to the modulus, 1e-9 leaves room for the third derivative. */
static void check_derivative(const specimen *s)
{
    const double step = 1e-5, scale = pd_longitudinal_modulus(s->material, s->parameters,
                                                              s->d, PD_PLANE_STRAIN);
    double P[9];
    stress_of_specimen(s, s->F, P);
    for (int c = 0; c < s->d * s->d; c++) {
        double F[9];
        memcpy(F, s->F, sizeof F);
        F[c] = s->F[c] + step;
        const double above = energy_of(s->material, s->parameters, s->d, F);
        F[c] = s->F[c] - step;
        const double below = energy_of(s->material, s->parameters, s->d, F);
        assert_near(P[c], (above - below) / (2 * step), 1e-9 * scale);
    }
}

static void stress_is_the_derivative_of_the_energy(void **state)
{
    for_every_specimen(check_derivative);
}

/* P11 of a small stretch along x over that stretch; its square term makes an error of the
 * order of the stretch, 1e-6, cancelled by taking both signs. Rounding: 1e-16/1e-6. */
static void check_modulus(const specimen *s)
{
    const double step = 1e-6, modulus = pd_longitudinal_modulus(
                                  s->material, s->parameters, s->d, PD_PLANE_STRAIN);
    double F[9], above[9], below[9];
    for (int c = 0; c < s->d * s->d; c++)
        F[c] = c % (s->d + 1) == 0;
    F[0] = 1 + step;
    stress_of_specimen(s, F, above);
    F[0] = 1 - step;
    stress_of_specimen(s, F, below);
    assert_near((above[0] - below[0]) / (2 * step), modulus, 1e-8 * modulus);
}

static void longitudinal_modulus_is_that_of_small_strain(void **state)
{
    for_every_specimen(check_modulus);
}

/* P(R F) = R P(F) and Psi(R F) = Psi(F). */
static void check_objectivity(const specimen *s)
{
    const double scale =
        pd_longitudinal_modulus(s->material, s->parameters, s->d, PD_PLANE_STRAIN);
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
        assert_near(turned[c], RP[c], ROUNDING * scale);
    assert_near(energy_of(s->material, s->parameters, s->d, RF),
                energy_of(s->material, s->parameters, s->d, s->F), ROUNDING * scale);
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
        assert_near(PFt[c], PFt[c % d * d + c / d],
                    ROUNDING * pd_longitudinal_modulus(s->material, s->parameters, s->d,
                                                       PD_PLANE_STRAIN));
}

static void stress_exerts_no_couple(void **state)
{
    for_every_specimen(check_symmetry);
}

static void check_plane(const specimen *s)
{
    if (s->d == 3)
        return;
    const double scale =
        pd_longitudinal_modulus(s->material, s->parameters, s->d, PD_PLANE_STRAIN);
    const double F[9] = {s->F[0], s->F[1], 0, s->F[2], s->F[3], 0, 0, 0, 1};
    double P2[4], P3[9], in_plane[4];
    stress_of(s->material, s->parameters, 2, s->F, P2);
    stress_of(s->material, s->parameters, 3, F, P3);
    to_plane(P3, in_plane);
    for (int c = 0; c < 4; c++)
        assert_near(P2[c], in_plane[c], ROUNDING * scale);
    assert_near(energy_of(s->material, s->parameters, 2, s->F),
                energy_of(s->material, s->parameters, 3, F), ROUNDING * scale);
}

static void two_dimensions_are_plane_strain(void **state)
{
    for_every_specimen(check_plane);
}

static void check_batch(const specimen *s)
{
    const size_t dd = (size_t)(s->d * s->d);
    double F[3 * 9], J[3], P[3 * 9], alone[9];
    for (size_t p = 0; p < 3; p++) {
        for (size_t c = 0; c < dd; c++)
            F[p * dd + c] = s->F[c] * (1 + 0.1 * (double)p);
        J[p] = volume_ratio(s->d, F + p * dd);
    }
    s->material->stress[PD_PLANE_STRAIN](s->parameters, s->d, 3, F, J, P);
    for (size_t p = 0; p < 3; p++) {
        stress_of_specimen(s, F + p * dd, alone);
        for (size_t c = 0; c < dd; c++)
            assert_near(P[p * dd + c], alone[c], 0); /* the same operations */
    }
}

static void many_points_are_stressed_as_one_by_one(void **state)
{
    for_every_specimen(check_batch);
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
        cmocka_unit_test(rest_is_free_of_stress_and_energy),
        cmocka_unit_test(stress_is_the_derivative_of_the_energy),
        cmocka_unit_test(longitudinal_modulus_is_that_of_small_strain),
        cmocka_unit_test(stress_turns_with_the_body),
        cmocka_unit_test(stress_exerts_no_couple),
        cmocka_unit_test(two_dimensions_are_plane_strain),
        cmocka_unit_test(many_points_are_stressed_as_one_by_one),
        cmocka_unit_test(materials_are_found_by_name),
        cmocka_unit_test(formulations_are_found_by_name),
        cmocka_unit_test(parameters_are_described),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
