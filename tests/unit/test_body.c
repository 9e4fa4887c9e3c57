/*
 * Making a body, the order of its points, what it refuses, loads and sums.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _POSIX_C_SOURCE 200809L /* popen */
#include <stdio.h>

#include "lattice.h"

/* Rounding of a force relative to modulus / spacing; see test_formulations.c. */
#define ROUNDING 1e-12

/* ---- counting allocations ---- */

static size_t allocations;

/* The program's own functions, in front of glibc's; a sanitizer brings its own. */
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t n, size_t size);
extern void *__libc_realloc(void *old, size_t size);

void *malloc(size_t size)
{
    allocations++;
    return __libc_malloc(size);
}

void *calloc(size_t n, size_t size)
{
    allocations++;
    return __libc_calloc(n, size);
}

void *realloc(void *old, size_t size)
{
    allocations++;
    return __libc_realloc(old, size);
}
#endif

/* ---- what is refused ---- */

static pd_status create(const points *cloud, const pd_body_options *options)
{
    pd_body *body = (pd_body *)&body; /* must be overwritten */
    const pd_status status = pd_body_create(MPI_COMM_NULL, options, cloud->n, cloud->X,
                                            cloud->volume, NULL, NULL, &body);
    if (status.code == PD_OK)
        pd_body_destroy(body);
    else
        assert_null(body);
    return status;
}

static void assert_refused(pd_status status, pd_global point, const char *in_message)
{
    if (status.code != PD_BAD_ARGUMENT || status.point != point ||
        !strstr(status.message, in_message))
        fail_msg("%s: code %d, point %ld, message '%s'", in_message, (int)status.code,
                 (long)status.point, status.message);
}

#define PARAMETER(k) (offsetof(pd_body_options, parameters) + (k) * sizeof(double))

static const struct {
    size_t offset; /* of a double in pd_body_options */
    double value;
    const char *in_message; /* name and value */
} refused[] = {
    {offsetof(pd_body_options, horizon_ratio), 0, "horizon ratio 0;"},
    {offsetof(pd_body_options, horizon_ratio), -2, "horizon ratio -2;"},
    {offsetof(pd_body_options, horizon_ratio), 21, "horizon ratio 21;"},
    {offsetof(pd_body_options, horizon_ratio), NAN, "nan"},
    {offsetof(pd_body_options, density), 0, "density 0;"},
    {offsetof(pd_body_options, density), -7, "density -7;"},
    {offsetof(pd_body_options, density), NAN, "nan"},
    {offsetof(pd_body_options, density), INFINITY, "inf"},
    {offsetof(pd_body_options, damping), -3, "damping -3;"},
    {offsetof(pd_body_options, damping), NAN, "nan"},
    {offsetof(pd_body_options, critical_stretch), 0.5, "critical stretch 0.5;"},
    {offsetof(pd_body_options, critical_stretch), 1, "critical stretch 1;"},
    {offsetof(pd_body_options, critical_stretch), -1, "critical stretch -1;"},
    {offsetof(pd_body_options, critical_stretch), NAN, "nan"},
    {PARAMETER(0), 0, "G 0;"},
    {PARAMETER(0), -80, "G -80;"},
    {PARAMETER(0), NAN, "nan"},
    {PARAMETER(0), INFINITY, "inf"},
    {PARAMETER(1), 0.5, "nuStab 0.5;"},
    {PARAMETER(1), -1.25, "nuStab -1.25;"},
    {PARAMETER(1), NAN, "nan"},
};

static void bad_option_is_refused_with_its_value(void **state)
{
    points cloud = lattice(2, 4, 4, 1, 0.1);
    for (size_t k = 0; k < sizeof refused / sizeof *refused; k++) {
        pd_body_options options = options_of(2, 2.015);
        memcpy((char *)&options + refused[k].offset, &refused[k].value, sizeof(double));
        assert_refused(create(&cloud, &options), -1, refused[k].in_message);
    }
    points_free(&cloud);
}

static void options_at_their_bounds_are_allowed(void **state)
{
    points cloud = lattice(2, 4, 4, 1, 0.1);
    pd_body_options options = options_of(2, 20);
    options.critical_stretch = 1.0001;
    options.parameters[1] = -1;
    assert_ok(create(&cloud, &options));
    points_free(&cloud);
}

static void dimension_that_nothing_takes_is_refused(void **state)
{
    points cloud = lattice(2, 4, 4, 1, 0.1);
    pd_body_options options = options_of(2, 2.015);
    options.dimension = 0;
    assert_refused(create(&cloud, &options), -1, "dimension 0;");
    options.dimension = 1;
    assert_refused(create(&cloud, &options), -1, "1 dimension;");
    options.dimension = 4;
    assert_refused(create(&cloud, &options), -1, "dimension 4;");
    points_free(&cloud);
}

static void body_without_points_is_refused(void **state)
{
    const points nothing = {.d = 2};
    const pd_body_options options = options_of(2, 2.015);
    assert_refused(create(&nothing, &options), -1, "0 points;");
}

static void body_without_formulation_or_material_is_refused(void **state)
{
    points cloud = lattice(2, 4, 4, 1, 0.1);
    pd_body_options options = options_of(2, 2.015);
    options.material = NULL;
    assert_refused(create(&cloud, &options), -1, "material");
    options = options_of(2, 2.015);
    options.formulation = NULL;
    assert_refused(create(&cloud, &options), -1, "formulation");
    points_free(&cloud);
}

static void bad_position_is_refused_with_its_point(void **state)
{
    points cloud = lattice(3, 4, 4, 4, 0.1);
    const pd_body_options options = options_of(3, 2.015);
    cloud.X[3 * 11 + 2] = NAN;
    assert_refused(create(&cloud, &options), 11, "nan");
    cloud.X[3 * 11 + 2] = 1e200;
    assert_refused(create(&cloud, &options), 11, "1e+200");
    points_free(&cloud);
}

static void bad_volume_is_refused_with_its_point(void **state)
{
    points cloud = lattice(3, 4, 4, 4, 0.1);
    const pd_body_options options = options_of(3, 2.015);
    cloud.volume[9] = 0;
    assert_refused(create(&cloud, &options), 9, "volume 0;");
    cloud.volume[9] = -0.25;
    assert_refused(create(&cloud, &options), 9, "volume -0.25;");
    cloud.volume[9] = NAN;
    assert_refused(create(&cloud, &options), 9, "nan");
    points_free(&cloud);
}

static void third_component_is_ignored_in_two_dimensions(void **state)
{
    points cloud = lattice(2, 4, 4, 1, 0.1);
    const pd_body_options options = options_of(2, 2.015);
    cloud.X[3 * 5 + 2] = NAN;
    assert_ok(create(&cloud, &options));
    points_free(&cloud);
}

static void nothing_can_be_destroyed(void **state)
{
    pd_body_destroy(NULL);
}

/* ---- a new body ---- */

static void numbers_of_points_are_permuted(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud = lattice(d, 7, 6, 5, 0.1);
        jitter(&cloud, 0.02);
        const pd_body_options options = options_of(d, 2.015);
        pd_body *body = body_of(&cloud, &options);
        const pd_body_view view = pd_body_fields(body);
        assert_int_equal(view.n_owned, cloud.n);
        assert_int_equal(view.n_local, cloud.n);
        unsigned char seen[210] = {0};
        for (pd_local p = 0; p < view.n_owned; p++) {
            assert_in_range(view.id[p], 0, cloud.n - 1);
            assert_false(seen[view.id[p]]);
            seen[view.id[p]] = 1;
        }
        pd_body_destroy(body);
        points_free(&cloud);
    }
}

static void points_keep_what_the_caller_gave(void **state)
{
    points cloud = graded(3, 5, 4, 4, 0.1, 1.1);
    const pd_body_options options = options_of(3, 2.015);
    pd_body *body = body_of(&cloud, &options);
    const pd_body_view view = pd_body_fields(body);
    assert_int_equal(view.dimension, 3);
    for (pd_local p = 0; p < view.n_owned; p++) {
        const size_t i = (size_t)view.id[p];
        assert_memory_equal(view.X + 3 * p, cloud.X + 3 * i, 3 * sizeof(double));
        assert_near(view.volume[p], cloud.volume[i], 0);
        assert_near(view.spacing[p], pow(cloud.volume[i], 1. / 3), 1e-15);
    }
    pd_body_destroy(body);
    points_free(&cloud);
}

static void new_body_is_at_rest(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 0.1);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_of(&cloud, &options);
    const pd_body_view view = pd_body_fields(body);
    assert_memory_equal(view.y, view.X, 2 * cloud.n * sizeof(double));
    assert_near(largest(view.v, 2 * cloud.n), 0, 0);
    assert_near(largest(view.force, 2 * cloud.n), 0, 0);
    for (pd_local p = 0; p < view.n_owned; p++) {
        assert_near(view.J[p], 1, 0);
        assert_memory_equal(view.F + 4 * p, ((double[]){1, 0, 0, 1}), 4 * sizeof(double));
    }
    pd_body_destroy(body);
    points_free(&cloud);
}

static void settings_are_copied(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 0.1);
    pd_body_options options = options_of(2, 2.015);
    options.damping = 4;
    pd_body *body = body_of(&cloud, &options);
    options.damping = 5;
    assert_near(pd_body_settings(body)->damping, 4, 0);
    assert_near(pd_body_settings(body)->horizon_ratio, 2.015, 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* G = 80, nu_stab = 0.35: kappa = 240, rho = 1.5. */
static void wave_speed_is_that_of_longitudinal_waves(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 0.1);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_of(&cloud, &options);
    assert_near(pd_body_wave_speed(body), sqrt((240 + 4. / 3 * 80) / 1.5), ROUNDING);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- held points ---- */

enum { HELD_COLUMNS = 6, ROWS = 5, HELD_POINTS = 10 * ROWS };

/* Ten columns of five points, the left six held; a horizon of 2.015 spacings reaches the
 * last two of those, columns 4 and 5. */
static pd_body *half_held(points *cloud, const pd_body_options *options)
{
    unsigned char held[HELD_POINTS] = {0};
    memset(held, 1, HELD_COLUMNS * ROWS);
    *cloud = lattice(2, 10, ROWS, 1, 0.1);
    return body_with_holds(cloud, options, held);
}

static void held_points_come_last_and_out_of_reach_ones_at_the_end(void **state)
{
    points cloud;
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = half_held(&cloud, &options);
    const pd_body_view view = pd_body_fields(body);
    assert_int_equal(view.n_moving, 4 * ROWS);
    assert_int_equal(view.n_active, 6 * ROWS);
    for (pd_local p = 0; p < view.n_owned; p++) {
        const pd_global column = view.id[p] / ROWS;
        assert_int_equal(p < view.n_moving, column >= 6);
        assert_int_equal(p < view.n_active, column >= 4);
    }
    pd_body_destroy(body);
    points_free(&cloud);
}

/* *context: slope a[3] of y = X + a (X_0 - HOLD_END), which leaves the plane where the
 * held columns end in place; the held columns stay as they are. */
#define HOLD_END 0.6

static void shear_free_columns(const double *X, const void *context, double *y)
{
    const double *slope = context;
    for (int a = 0; a < 3; a++)
        y[a] = X[a] + (X[0] > HOLD_END ? slope[a] * (X[0] - HOLD_END) : 0);
}

static void clamped_affine_map_has_exact_gradients_beside_the_hold(void **state)
{
    const double slope[3] = {0.1, -0.3, 0};
    const double F[4] = {1.1, 0, -0.3, 1};
    points cloud;
    const pd_body_options options = options_of(2, 3.015);
    pd_body *body = half_held(&cloud, &options);
    body_move(body, shear_free_columns, slope);
    assert_ok(pd_body_forces(body));
    const pd_body_view view = pd_body_fields(body);
    for (pd_local p = 0; p < view.n_moving; p++)
        for (int k = 0; k < 4; k++)
            assert_near(view.F[4 * p + k], F[k], ROUNDING);
    pd_body_destroy(body);
    points_free(&cloud);
}

static double energy_with(pd_body *body, pd_local p, int a, double step)
{
    const pd_body_view view = pd_body_fields(body);
    const double y = view.y[2 * p + a];
    view.y[2 * p + a] = y + step;
    assert_ok(pd_body_forces(body));
    const double energy = pd_body_strain_energy(body);
    view.y[2 * p + a] = y;
    return energy;
}

static void force_beside_the_hold_is_minus_the_derivative_of_the_energy(void **state)
{
    const double slope[3] = {0.1, -0.3, 0};
    points cloud;
    const pd_body_options options = options_of(2, 3.015);
    pd_body *body = half_held(&cloud, &options);
    body_move(body, shear_free_columns, slope);
    const pd_body_view view = pd_body_fields(body);
    for (pd_local p = 0; p < view.n_moving; p++) { /* bend it too */
        const double x = view.X[2 * p] - HOLD_END;
        view.y[2 * p + 1] += 0.5 * x * x;
    }
    for (pd_local p = 0; p < view.n_moving; p++)
        for (int a = 0; a < 2; a++) {
            /* Central differences err by step^2 times the third derivative and by
             * round-off of the energy over the step: 1e-7 of the scale is above both. */
            const double step = 1e-6;
            const double slope_of_energy =
                (energy_with(body, p, a, step) - energy_with(body, p, a, -step)) /
                (2 * step);
            assert_ok(pd_body_forces(body));
            const double scale = 350 / 0.1 * view.volume[p]; /* modulus / spacing V */
            assert_near(view.volume[p] * view.force[2 * p + a], -slope_of_energy,
                        1e-7 * scale);
        }
    pd_body_destroy(body);
    points_free(&cloud);
}

static void held_points_out_of_reach_bear_no_force(void **state)
{
    const double amplitude = 0.01;
    points cloud;
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = half_held(&cloud, &options);
    body_move(body, move_in_waves, &amplitude);
    assert_ok(pd_body_forces(body));
    const pd_body_view view = pd_body_fields(body);
    assert_near(largest(view.force + 2 * view.n_active,
                        2 * (size_t)(view.n_owned - view.n_active)),
                0, 0);
    assert_true(largest(view.force, 2 * (size_t)view.n_moving) > 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void body_wholly_held_bears_nothing(void **state)
{
    points cloud = lattice(2, 4, 4, 1, 0.1);
    unsigned char held[16];
    memset(held, 1, sizeof held);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_with_holds(&cloud, &options, held);
    assert_ok(pd_body_forces(body));
    const pd_body_view view = pd_body_fields(body);
    const pd_summary summary = pd_body_summary(body);
    assert_int_equal(view.n_moving, 0);
    assert_int_equal(view.n_active, 0);
    assert_int_equal(summary.bonds, 0);
    assert_near(summary.smallest_J, 1, 0);
    assert_near(summary.mean_volume_change, 0, 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- load and damping ---- */

static void set_all(double *values, size_t n, double a, double b)
{
    for (size_t p = 0; p < n; p++)
        values[2 * p] = a, values[2 * p + 1] = b;
}

static void assert_moving_force(const pd_body *body, double x, double y)
{
    const pd_body_view view = pd_body_fields(body);
    for (pd_local p = 0; p < view.n_moving; p++) {
        assert_near(view.force[2 * p], x, ROUNDING * 350 / 0.1);
        assert_near(view.force[2 * p + 1], y, ROUNDING * 350 / 0.1);
    }
}

static void load_is_added_to_the_force_of_moving_points(void **state)
{
    points cloud;
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = half_held(&cloud, &options);
    double load[2 * HELD_POINTS];
    set_all(load, HELD_POINTS, 3, -5);
    assert_ok(pd_body_load(body, load));
    set_all(load, HELD_POINTS, 0, 0); /* it was copied */
    assert_ok(pd_body_forces(body));
    assert_moving_force(body, 3, -5);
    const pd_body_view view = pd_body_fields(body);
    assert_near(largest(view.force + 2 * view.n_moving,
                        2 * (size_t)(view.n_owned - view.n_moving)),
                0, ROUNDING * 350 / 0.1);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void load_can_be_replaced_and_removed(void **state)
{
    points cloud;
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = half_held(&cloud, &options);
    double load[2 * HELD_POINTS];
    set_all(load, HELD_POINTS, 3, -5);
    assert_ok(pd_body_load(body, load));
    set_all(load, HELD_POINTS, 1, 2);
    assert_ok(pd_body_load(body, load));
    assert_ok(pd_body_forces(body));
    assert_moving_force(body, 1, 2);
    assert_ok(pd_body_load(body, NULL));
    assert_ok(pd_body_forces(body));
    assert_moving_force(body, 0, 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void load_that_is_not_finite_is_refused(void **state)
{
    points cloud;
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = half_held(&cloud, &options);
    double load[2 * HELD_POINTS];
    set_all(load, HELD_POINTS, 3, -5);
    assert_ok(pd_body_load(body, load));
    load[7] = NAN;
    const pd_status status = pd_body_load(body, load);
    assert_int_equal(status.code, PD_BAD_ARGUMENT);
    assert_non_null(strstr(status.message, "nan"));
    assert_ok(pd_body_forces(body)); /* the last load stands */
    assert_moving_force(body, 3, -5);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void damping_opposes_the_velocity_of_moving_points(void **state)
{
    points cloud;
    pd_body_options options = options_of(2, 2.015);
    options.damping = 4;
    pd_body *body = half_held(&cloud, &options);
    const pd_body_view view = pd_body_fields(body);
    set_all(view.v, HELD_POINTS, 2, -0.5);
    assert_ok(pd_body_forces(body));
    assert_moving_force(body, -8, 2);
    assert_near(largest(view.force + 2 * view.n_moving,
                        2 * (size_t)(view.n_owned - view.n_moving)),
                0, ROUNDING * 350 / 0.1);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- numbers that are not finite ---- */

static const double unusable[] = {NAN, INFINITY, -INFINITY, 1e200, -1e200};
enum { UNUSABLE = sizeof unusable / sizeof *unusable };

static void assert_not_finite(pd_body *body, pd_global id)
{
    const pd_status status = pd_body_forces(body);
    assert_int_equal(status.code, PD_NOT_FINITE);
    assert_int_equal(status.point, id);
    assert_true(strlen(status.message) > 0);
}

static void bad_position_is_an_error_of_its_point(void **state)
{
    points cloud;
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = half_held(&cloud, &options);
    /* Columns 2 and 3 bear no force, but are in the families of held points that do. */
    for (pd_global id = 2 * ROWS; id < HELD_POINTS; id += 7)
        for (size_t k = 0; k < UNUSABLE; k++) {
            double *y = pd_body_fields(body).y + 2 * place_of(body, id) + 1;
            const double before = *y;
            *y = unusable[k];
            assert_not_finite(body, id);
            *y = before;
            assert_ok(pd_body_forces(body));
        }
    pd_body_destroy(body);
    points_free(&cloud);
}

static void bad_velocity_is_an_error_of_its_point(void **state)
{
    points cloud;
    const pd_body_options options = options_of(2, 2.015); /* no force from velocities */
    pd_body *body = half_held(&cloud, &options);
    const pd_global id = 7 * ROWS + 3;
    for (size_t k = 0; k < UNUSABLE; k++) {
        pd_body_fields(body).v[2 * place_of(body, id) + 1] = unusable[k];
        assert_not_finite(body, id);
    }
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- summary ---- */

/* 4 x 5 moving points of 0.01 m2 and 1.5 kg/m3 at 2.5 m/s: the held ones do not count. */
static void kinetic_energy_is_that_of_moving_points(void **state)
{
    points cloud;
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = half_held(&cloud, &options);
    set_all(pd_body_fields(body).v, HELD_POINTS, 1.5, -2);
    const pd_summary summary = pd_body_summary(body);
    assert_near(summary.kinetic_energy, 0.5 * 1.5 * 20 * 0.01 * 6.25, 1e-14);
    assert_near(summary.largest_speed, 2.5, 1e-15);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void volume_change_of_affine_map_is_its_determinant(void **state)
{
    points cloud = graded(3, 5, 4, 4, 0.1, 1.1);
    const pd_body_options options = options_of(3, 2.015);
    pd_body *body = body_of(&cloud, &options);
    const affine map = distortion(3);
    const double change = determinant3(map.A) - 1;
    body_map(body, &map);
    assert_ok(pd_body_forces(body));
    double volume = 0;
    for (size_t p = 0; p < cloud.n; p++)
        volume += cloud.volume[p];
    const pd_summary summary = pd_body_summary(body);
    assert_near(summary.mean_volume_change, change, ROUNDING);
    assert_near(summary.sum_volume_change, change * volume, ROUNDING);
    assert_near(summary.smallest_J, 1 + change, ROUNDING);
    assert_near(summary.largest_J, 1 + change, ROUNDING);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void volume_change_is_that_of_moving_points(void **state)
{
    const double slope[3] = {0.1, -0.3, 0};
    points cloud;
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = half_held(&cloud, &options);
    body_move(body, shear_free_columns, slope);
    assert_ok(pd_body_forces(body));
    assert_near(pd_body_summary(body).sum_volume_change, 0.1 * 20 * 0.01, ROUNDING);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void smallest_and_largest_J_are_those_of_the_points(void **state)
{
    const double amplitude = 0.01;
    points cloud = lattice(2, 6, 5, 1, 0.1);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_of(&cloud, &options);
    body_move(body, move_in_waves, &amplitude);
    assert_ok(pd_body_forces(body));
    const double *J = pd_body_fields(body).J;
    double least = J[0], most = J[0];
    for (size_t p = 0; p < cloud.n; p++) {
        least = fmin(least, J[p]);
        most = fmax(most, J[p]);
    }
    assert_true(least < most);
    assert_near(pd_body_summary(body).smallest_J, least, 0);
    assert_near(pd_body_summary(body).largest_J, most, 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* Nearest neighbours of 4 x 3 points: 3 x 3 along x, 4 x 2 along y. */
static void bonds_are_counted_once(void **state)
{
    points cloud = lattice(2, 4, 3, 1, 0.1);
    const pd_body_options options = options_of(2, 1.25);
    pd_body *body = body_of(&cloud, &options);
    assert_int_equal(pd_body_summary(body).bonds, 17);
    assert_int_equal(pd_body_summary(body).broken_bonds, 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* 6 x 3 points, nearest neighbours, columns 0 to 2 held: column 2 bears force, so that
 * 4 x 3 bonds along x and 4 x 2 along y remain. */
static void bonds_between_points_out_of_reach_are_not_counted(void **state)
{
    points cloud = lattice(2, 6, 3, 1, 0.1);
    unsigned char held[18] = {1, 1, 1, 1, 1, 1, 1, 1, 1};
    const pd_body_options options = options_of(2, 1.25);
    pd_body *body = body_with_holds(&cloud, &options, held);
    assert_int_equal(pd_body_summary(body).bonds, 20);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- the library ---- */

static void forces_allocate_nothing(void **state)
{
    if (allocations == 0) /* not even cmocka's: a sanitizer or valgrind allocates */
        skip();
    points cloud = lattice(3, 8, 5, 5, 0.1);
    pd_body_options options = options_of(3, 2.015);
    options.critical_stretch = 1.05;
    options.damping = 1;
    pd_body *body = body_of(&cloud, &options);
    const double amplitude = 0.02; /* breaks bonds */
    body_move(body, move_in_waves, &amplitude);

    const size_t before = allocations;
    const pd_status status = pd_body_forces(body);
    assert_int_equal(allocations, before);
    assert_ok(status);
    assert_true(pd_body_summary(body).broken_bonds > 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* From the folder of the Makefile; without a shared library there is nothing to see. */
static void exported_symbols_begin_with_pd(void **state)
{
    FILE *library = fopen("lib/libpd.so", "r");
    if (!library)
        skip();
    fclose(library);
    FILE *symbols = popen("nm -D --defined-only --format=posix lib/libpd.so", "r");
    assert_non_null(symbols);
    char name[256];
    int count = 0, strangers = 0;
    while (fscanf(symbols, "%255s%*[^\n]", name) == 1) {
        count++;
        if (strncmp(name, "pd_", 3) == 0)
            continue;
        strangers++;
        print_error("exported: %s\n", name);
    }
    pclose(symbols);
    assert_int_equal(strangers, 0);
    assert_true(count > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_option_is_refused_with_its_value),
        cmocka_unit_test(options_at_their_bounds_are_allowed),
        cmocka_unit_test(dimension_that_nothing_takes_is_refused),
        cmocka_unit_test(body_without_points_is_refused),
        cmocka_unit_test(body_without_formulation_or_material_is_refused),
        cmocka_unit_test(bad_position_is_refused_with_its_point),
        cmocka_unit_test(bad_volume_is_refused_with_its_point),
        cmocka_unit_test(third_component_is_ignored_in_two_dimensions),
        cmocka_unit_test(nothing_can_be_destroyed),
        cmocka_unit_test(numbers_of_points_are_permuted),
        cmocka_unit_test(points_keep_what_the_caller_gave),
        cmocka_unit_test(new_body_is_at_rest),
        cmocka_unit_test(settings_are_copied),
        cmocka_unit_test(wave_speed_is_that_of_longitudinal_waves),
        cmocka_unit_test(held_points_come_last_and_out_of_reach_ones_at_the_end),
        cmocka_unit_test(clamped_affine_map_has_exact_gradients_beside_the_hold),
        cmocka_unit_test(force_beside_the_hold_is_minus_the_derivative_of_the_energy),
        cmocka_unit_test(held_points_out_of_reach_bear_no_force),
        cmocka_unit_test(body_wholly_held_bears_nothing),
        cmocka_unit_test(load_is_added_to_the_force_of_moving_points),
        cmocka_unit_test(load_can_be_replaced_and_removed),
        cmocka_unit_test(load_that_is_not_finite_is_refused),
        cmocka_unit_test(damping_opposes_the_velocity_of_moving_points),
        cmocka_unit_test(bad_position_is_an_error_of_its_point),
        cmocka_unit_test(bad_velocity_is_an_error_of_its_point),
        cmocka_unit_test(kinetic_energy_is_that_of_moving_points),
        cmocka_unit_test(volume_change_of_affine_map_is_its_determinant),
        cmocka_unit_test(volume_change_is_that_of_moving_points),
        cmocka_unit_test(smallest_and_largest_J_are_those_of_the_points),
        cmocka_unit_test(bonds_are_counted_once),
        cmocka_unit_test(bonds_between_points_out_of_reach_are_not_counted),
        cmocka_unit_test(forces_allocate_nothing),
        cmocka_unit_test(exported_symbols_begin_with_pd),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
