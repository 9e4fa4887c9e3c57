/*
 * Motions that alternate from point to point, which gradients over families do not see:
 * what they cost in correspondence, without and with the control of zero-energy modes,
 * and in bond-associated correspondence. docs/theory.md has the table that this prints.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "lattice.h"

#define SPACING 0.1    /* m */
#define SIZE 1e-7      /* of the motion, over the spacing: second-order energies */
#define E_MODULUS 200. /* Pa */
#define POISSON 0.3

/* The control that docs/theory.md recommends. */
#define RECOMMENDED 1.

typedef struct {
    int d;
    int alternates[3]; /* does the sign change from point to point along this axis? */
    double along[3];   /* direction of the displacement, of length 1 */
    const char *name;
} mode;

static const mode modes[] = {
    {2, {1, 1}, {1, 0}, "2D checkerboard"},
    {2, {1, 0}, {1, 0}, "2D stripes, along"},
    {2, {1, 0}, {0, 1}, "2D stripes, across"},
    {3, {1, 1, 1}, {1, 0, 0}, "3D checkerboard"},
    {3, {1, 1, 0}, {1, 0, 0}, "3D columns, along"},
    {3, {1, 1, 0}, {0, 0, 1}, "3D columns, across"},
    {3, {1, 0, 0}, {1, 0, 0}, "3D layers, along"},
    {3, {1, 0, 0}, {0, 1, 0}, "3D layers, across"},
};
enum { MODES = sizeof modes / sizeof *modes };

static void alternate(const double *X, const void *context, double *u)
{
    const mode *m = context;
    int sum = 0;
    for (int a = 0; a < m->d; a++)
        sum += m->alternates[a] * (int)floor(X[a] / SPACING);
    for (int a = 0; a < 3; a++)
        u[a] = (sum % 2 ? -1 : 1) * m->along[a];
}

static pd_body_options elastic(int d, double horizon_ratio, const char *formulation,
                               double parameter0, double parameter1)
{
    pd_body_options options = {
        .dimension = d,
        .horizon_ratio = horizon_ratio,
        .density = 1,
        .formulation = pd_formulation_find(formulation),
        .formulation_parameters = {parameter0, parameter1},
        .material = pd_material_find("linearElastic"),
        .parameters = {E_MODULUS, POISSON},
    };
    return options;
}

/* Work against the forces in the middle of a lattice, per volume, over G
 * (size/spacing)^2: the mode is put on step by step, as velocities, for a history of
 * stress, which other formulations have no use for. */
static double energy_of(const mode *m, const pd_body_options *options)
{
    const int side = m->d == 2 ? 21 : 13; /* two horizons and more around the middle */
    points cloud = lattice(m->d, side, side, side, SPACING);
    pd_body *body = body_of(&cloud, options);
    const pd_body_view view = pd_body_fields(body);
    const size_t d = (size_t)m->d;
    const double size = SIZE * SPACING, shear = E_MODULUS / (2 * (1 + POISSON));
    for (size_t p = 0; p < cloud.n; p++) {
        double X[3] = {0}, u[3];
        memcpy(X, view.X + p * d, d * sizeof *X);
        alternate(X, m, u);
        for (size_t a = 0; a < d; a++) {
            view.v[p * d + a] = u[a];
            if (!options->formulation->advance)
                view.y[p * d + a] += size * u[a];
        }
    }
    assert_ok(pd_body_forces(body));
    if (options->formulation->advance) {
        assert_ok(pd_body_advance(body, size, 0.5));
        assert_ok(pd_body_forces(body));
    }
    const size_t middle = (size_t)place_of(body, (pd_global)(cloud.n / 2));
    double work = 0;
    for (size_t a = 0; a < d; a++)
        work -= view.force[middle * d + a] * view.v[middle * d + a] * size / 2;
    pd_body_destroy(body);
    points_free(&cloud);
    return work / (shear * SIZE * SIZE);
}

static double with_control(const mode *m, double horizon_ratio, double coefficient)
{
    const pd_body_options options =
        elastic(m->d, horizon_ratio, "correspondence", coefficient, 0);
    return energy_of(m, &options);
}

static double associated(const mode *m, double horizon_ratio, int order)
{
    const pd_body_options options =
        elastic(m->d, horizon_ratio, "bondAssociated", order, 1);
    return energy_of(m, &options);
}

/* ---- tests ---- */

static void for_every_mode(void (*check)(const mode *m, double horizon_ratio))
{
    for (int k = 0; k < MODES; k++)
        for (double horizon = 2.015; horizon < 3.1; horizon += 1)
            check(&modes[k], horizon);
}

/* What is left is round-off of the positions, some 1e-16/SIZE. */
static void check_plain(const mode *m, double horizon_ratio)
{
    assert_near(with_control(m, horizon_ratio, 0), 0, 1e-7);
}

static void correspondence_does_not_see_the_modes(void **state)
{
    for_every_mode(check_plain);
}

/* For scale: as a shear, the way of two sizes over one spacing would have the energy 2.
 */
static void check_control(const mode *m, double horizon_ratio)
{
    const double control = with_control(m, horizon_ratio, RECOMMENDED);
    const double order1 = associated(m, horizon_ratio, 1);
    print_message("%-20s horizon %.3f: control %.3f, associated %.3f, ratio %.2f\n",
                  m->name, horizon_ratio, control, order1, control / order1);
    assert_true(control > 0.5 * order1);
    assert_true(control < 4); /* twice the shear's: the control does not dominate */
}

static void control_is_over_half_of_bond_association(void **state)
{
    for_every_mode(check_control);
}

/* The orders differ by monomials that an alternating motion has nothing of. */
static void check_orders(const mode *m, double horizon_ratio)
{
    if (m->d == 3 && horizon_ratio > 3)
        return; /* slow */
    const double order1 = associated(m, horizon_ratio, 1);
    for (int order = 2; order <= 3; order++)
        assert_near(associated(m, horizon_ratio, order), order1, 1e-6);
}

static void order_of_bond_association_does_not_matter(void **state)
{
    for_every_mode(check_orders);
}

static void check_linear(const mode *m, double horizon_ratio)
{
    const double one = with_control(m, horizon_ratio, 1);
    assert_near(with_control(m, horizon_ratio, 0.1), 0.1 * one, 1e-7);
    assert_near(with_control(m, horizon_ratio, 10), 10 * one, 1e-6);
}

static void control_is_linear_in_its_coefficient(void **state)
{
    for_every_mode(check_linear);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(correspondence_does_not_see_the_modes),
        cmocka_unit_test(control_is_over_half_of_bond_association),
        cmocka_unit_test(order_of_bond_association_does_not_matter),
        cmocka_unit_test(control_is_linear_in_its_coefficient),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
