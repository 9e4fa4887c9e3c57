/*
 * No floating point trap fires in the library, whatever a body has come to: OpenFOAM runs
 * with traps on. A trap would end the test that caused it with SIGFPE.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _GNU_SOURCE /* feenableexcept */
#include <fenv.h>

#include "lattice.h"

enum { TRAPS = FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW };

/* All that a time step asks of a body, with traps on. */
static pd_code step(pd_body *body)
{
    const size_t n = (size_t)pd_body_fields(body).n_owned;
    double *damage = malloc(n * sizeof *damage);
    pd_global *piece = malloc(n * sizeof *piece);
    feclearexcept(TRAPS);
    feenableexcept(TRAPS);
    const pd_status status = pd_body_forces(body);
    pd_body_damage(body, damage);
    pd_body_pieces(body, piece, NULL);
    pd_body_summary(body);
    pd_body_wave_speed(body);
    fedisableexcept(TRAPS);
    free(damage);
    free(piece);
    return status.code;
}

/* ---- bodies ---- */

typedef struct {
    int d;
    double critical_stretch; /* 0: none */
} kind;

static const kind kinds[] = {{2, 0}, {2, 1.5}, {3, 0}, {3, 1.5}};
enum { KINDS = sizeof kinds / sizeof *kinds };

static void for_every_kind(void (*check)(const kind *, pd_body *))
{
    for (int k = 0; k < KINDS; k++) {
        points cloud = lattice(kinds[k].d, 5, 4, 4, 0.1);
        pd_body_options options = options_of(kinds[k].d, 2.015);
        options.critical_stretch = kinds[k].critical_stretch;
        options.damping = 1;
        pd_body *body = body_of(&cloud, &options);
        check(&kinds[k], body);
        pd_body_destroy(body);
        points_free(&cloud);
    }
}

static void assert_finite(const pd_body *body)
{
    const pd_body_view view = pd_body_fields(body);
    const size_t n = (size_t)view.n_owned, d = (size_t)view.dimension;
    assert_true(isfinite(largest(view.force, n * d)));
    assert_true(isfinite(largest(view.F, n * d * d)));
    assert_true(isfinite(largest(view.J, n)));
}

/* ---- positions ---- */

static void check_rest(const kind *k, pd_body *body)
{
    assert_int_equal(step(body), PD_OK);
    assert_finite(body);
}

static void no_trap_at_rest(void **state)
{
    for_every_kind(check_rest);
}

static void check_mirror(const kind *k, pd_body *body)
{
    const affine mirror = {{-1, 0, 0, 0, 1, 0, 0, 0, 1}, {0}};
    body_map(body, &mirror);
    assert_int_equal(step(body), k->critical_stretch > 0 ? PD_OK : PD_INVERTED);
    assert_finite(body);
}

static void no_trap_where_all_is_inverted(void **state)
{
    for_every_kind(check_mirror);
}

/* All points in one place: F = 0. */
static void check_collapse(const kind *k, pd_body *body)
{
    const affine collapse = {{0}, {0}};
    body_map(body, &collapse);
    assert_int_equal(step(body), k->critical_stretch > 0 ? PD_OK : PD_INVERTED);
    assert_finite(body);
}

static void no_trap_where_all_is_in_one_place(void **state)
{
    for_every_kind(check_collapse);
}

/* With damage all bonds break; without, J is about 1e4 to the power d. */
static void check_explosion(const kind *k, pd_body *body)
{
    const affine explosion = {{1e4, 0, 0, 0, 1e4, 0, 0, 0, 1e4}, {0}};
    body_map(body, &explosion);
    assert_int_equal(step(body), PD_OK);
    assert_finite(body);
    if (k->critical_stretch > 0)
        assert_int_equal(pd_body_summary(body).singular, pd_body_fields(body).n_owned);
}

static void no_trap_where_all_bonds_break(void **state)
{
    for_every_kind(check_explosion);
}

static void shed_layers(const double *X, const void *context, double *y)
{
    memcpy(y, X, 3 * sizeof *y);
    y[0] *= 100;
}

static void check_layers(const kind *k, pd_body *body)
{
    body_move(body, shed_layers, NULL);
    assert_int_equal(step(body), PD_OK);
    assert_finite(body);
    if (k->critical_stretch > 0)
        assert_int_equal(pd_body_summary(body).singular, pd_body_fields(body).n_owned);
}

static void no_trap_where_families_are_flat(void **state)
{
    for_every_kind(check_layers);
}

static void check_point_torn_out(const kind *k, pd_body *body)
{
    pd_body_fields(body).y[0] -= 1e6;
    const pd_code code = step(body);
    assert_true(code == PD_OK || code == PD_INVERTED);
    assert_finite(body);
}

static void no_trap_where_a_point_is_torn_out(void **state)
{
    for_every_kind(check_point_torn_out);
}

/* Whatever position still counts as finite: its cube must not overflow. */
static void check_far_point(const kind *k, pd_body *body)
{
    const double far[] = {1e20, 9e59, 1e61, 1e80, 1e110, 1e160};
    for (size_t f = 0; f < sizeof far / sizeof *far; f++) {
        pd_body_fields(body).y[1] = far[f];
        const pd_code code = step(body);
        assert_true(code == PD_OK || code == PD_INVERTED || code == PD_NOT_FINITE);
    }
}

static void no_trap_where_a_point_is_very_far(void **state)
{
    for_every_kind(check_far_point);
}

static void check_far_body(const kind *k, pd_body *body)
{
    const double far[] = {1e20, 1e59, 1e61, 1e80, 1e110, 1e160};
    for (size_t f = 0; f < sizeof far / sizeof *far; f++) {
        const affine explosion = {{far[f], 0, 0, 0, far[f], 0, 0, 0, far[f]}, {0}};
        body_map(body, &explosion);
        const pd_code code = step(body);
        assert_true(code == PD_OK || code == PD_NOT_FINITE);
    }
}

static void no_trap_where_all_points_are_very_far(void **state)
{
    for_every_kind(check_far_body);
}

/* ---- numbers that are not finite ---- */

static const double unusable[] = {NAN, INFINITY, -INFINITY, 1e200, -1e200, 1e308};
enum { UNUSABLE = sizeof unusable / sizeof *unusable };

static void check_bad_position(const kind *k, pd_body *body)
{
    for (int u = 0; u < UNUSABLE; u++) {
        pd_body_fields(body).y[k->d + 1] = unusable[u];
        assert_int_equal(step(body), PD_NOT_FINITE);
    }
}

static void no_trap_where_a_position_is_not_finite(void **state)
{
    for_every_kind(check_bad_position);
}

/* The velocities go through the kinetic energy of the summary, too. */
static void check_bad_velocity(const kind *k, pd_body *body)
{
    for (int u = 0; u < UNUSABLE; u++) {
        pd_body_fields(body).v[k->d + 1] = unusable[u];
        feclearexcept(TRAPS);
        feenableexcept(TRAPS);
        const pd_status status = pd_body_forces(body);
        fedisableexcept(TRAPS);
        assert_int_equal(status.code, PD_NOT_FINITE);
    }
}

static void no_trap_where_a_velocity_is_not_finite(void **state)
{
    for_every_kind(check_bad_velocity);
}

/* Held columns 0 and 1 are out of reach of the moving ones, but in the families of held
 * columns 2 and 3, which are not. */
static void no_trap_where_a_held_position_is_not_finite(void **state)
{
    points cloud = lattice(2, 8, 4, 1, 0.1);
    unsigned char held[32] = {0};
    memset(held, 1, 16);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_with_holds(&cloud, &options, held);
    for (pd_global id = 0; id < 16; id++)
        for (int u = 0; u < UNUSABLE; u++) {
            double *y = pd_body_fields(body).y + 2 * place_of(body, id);
            const double before = *y;
            *y = unusable[u];
            assert_int_equal(step(body), PD_NOT_FINITE);
            *y = before;
        }
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- creation ---- */

static pd_code create(const points *cloud, const pd_body_options *options)
{
    pd_body *body;
    feclearexcept(TRAPS);
    feenableexcept(TRAPS);
    const pd_status status = pd_body_create(MPI_COMM_NULL, options, cloud->n, cloud->X,
                                            cloud->volume, NULL, NULL, &body);
    fedisableexcept(TRAPS);
    pd_body_destroy(body);
    return status.code;
}

static void no_trap_while_bad_points_are_refused(void **state)
{
    const pd_body_options options = options_of(2, 2.015);
    for (int u = 0; u < UNUSABLE; u++) {
        points cloud = lattice(2, 5, 4, 1, 0.1);
        cloud.X[7] = unusable[u];
        assert_int_equal(create(&cloud, &options), PD_BAD_ARGUMENT);
        cloud.X[7] = 0;
        cloud.volume[3] = unusable[u];
        assert_int_equal(create(&cloud, &options), PD_BAD_ARGUMENT);
        points_free(&cloud);
    }
}

static void no_trap_while_bad_options_are_refused(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 0.1);
    const pd_body_options sound = options_of(2, 2.015);
    for (int u = 0; u < UNUSABLE; u++) {
        pd_body_options options = sound;
        options.parameters[0] = unusable[u];
        assert_int_equal(create(&cloud, &options), PD_BAD_ARGUMENT);
        options = sound;
        options.critical_stretch = unusable[u];
        assert_int_equal(create(&cloud, &options), PD_BAD_ARGUMENT);
    }
    points_free(&cloud);
}

static void no_trap_while_flat_families_are_refused(void **state)
{
    points line = lattice(2, 5, 1, 1, 0.1), plane = lattice(3, 5, 5, 1, 0.1);
    const pd_body_options two = options_of(2, 2.015), three = options_of(3, 2.015);
    assert_int_equal(create(&line, &two), PD_BAD_FAMILY);
    assert_int_equal(create(&plane, &three), PD_BAD_FAMILY);
    points_free(&line);
    points_free(&plane);
}

static void no_trap_where_points_are_in_one_place(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 0.1);
    const pd_body_options options = options_of(2, 2.015);
    memcpy(cloud.X, cloud.X + 3, 3 * sizeof *cloud.X); /* two of them */
    assert_int_equal(create(&cloud, &options), PD_OK);
    memset(cloud.X, 0, 3 * cloud.n * sizeof *cloud.X); /* all */
    assert_int_equal(create(&cloud, &options), PD_BAD_FAMILY);
    points_free(&cloud);
}

static pd_code precrack(pd_body *body, const pd_rectangle *crack)
{
    feclearexcept(TRAPS);
    feenableexcept(TRAPS);
    const pd_status status = pd_body_precrack(body, crack);
    fedisableexcept(TRAPS);
    return status.code;
}

/* Half-way between layers of points, and through a layer, which cuts it off from both
 * sides. */
static void check_precrack(const kind *k, pd_body *body)
{
    const pd_rectangle cracks[] = {
        {.corner = {0.2, -1, -1}, .edge1 = {0, 3, 0}, .edge2 = {0, 0, 3}},
        {.corner = {0.25, -1, -1}, .edge1 = {0, 3, 0}, .edge2 = {0, 0, 3}},
    };
    for (size_t c = 0; c < sizeof cracks / sizeof *cracks; c++)
        assert_int_equal(precrack(body, &cracks[c]), PD_OK);
    assert_int_equal(step(body), PD_OK);
    assert_finite(body);
    assert_true(pd_body_summary(body).singular > 0);
}

static void no_trap_in_precracks(void **state)
{
    for_every_kind(check_precrack);
}

static void check_bad_precrack(const kind *k, pd_body *body)
{
    for (int u = -1; u < UNUSABLE; u++) {
        pd_rectangle crack = {.edge1 = {0, 1, 0}, .edge2 = {0, 0, 1}};
        crack.edge1[1] = u < 0 ? 0 : unusable[u];
        assert_int_equal(precrack(body, &crack), PD_BAD_ARGUMENT);
        crack.edge1[1] = 1;
        crack.corner[1] = unusable[u < 0 ? 0 : u];
        assert_int_equal(precrack(body, &crack), PD_BAD_ARGUMENT);
    }
}

static void no_trap_while_bad_precracks_are_refused(void **state)
{
    for_every_kind(check_bad_precrack);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_trap_at_rest),
        cmocka_unit_test(no_trap_where_all_is_inverted),
        cmocka_unit_test(no_trap_where_all_is_in_one_place),
        cmocka_unit_test(no_trap_where_all_bonds_break),
        cmocka_unit_test(no_trap_where_families_are_flat),
        cmocka_unit_test(no_trap_where_a_point_is_torn_out),
        cmocka_unit_test(no_trap_where_a_point_is_very_far),
        cmocka_unit_test(no_trap_where_all_points_are_very_far),
        cmocka_unit_test(no_trap_where_a_position_is_not_finite),
        cmocka_unit_test(no_trap_where_a_velocity_is_not_finite),
        cmocka_unit_test(no_trap_where_a_held_position_is_not_finite),
        cmocka_unit_test(no_trap_while_bad_points_are_refused),
        cmocka_unit_test(no_trap_while_bad_options_are_refused),
        cmocka_unit_test(no_trap_while_flat_families_are_refused),
        cmocka_unit_test(no_trap_where_points_are_in_one_place),
        cmocka_unit_test(no_trap_in_precracks),
        cmocka_unit_test(no_trap_while_bad_precracks_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
