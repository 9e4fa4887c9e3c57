/*
 * Bonds that break, and what is left of a body then.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "lattice.h"

/* Rounding of a force relative to modulus / spacing; see test_formulations.c. */
#define ROUNDING 1e-12

/* Modulus over spacing (N/m3) of bodies with the parameters of options_of. */
static double force_scale(const pd_body *body)
{
    const double c = pd_body_wave_speed(body);
    return pd_body_settings(body)->density * c * c / pd_body_fields(body).spacing[0];
}

static pd_body_options breakable(int d, double horizon_ratio, double critical_stretch)
{
    pd_body_options options = options_of(d, horizon_ratio);
    options.critical_stretch = critical_stretch;
    return options;
}

static void assert_no_force(const pd_body *body)
{
    const pd_body_view view = pd_body_fields(body);
    assert_near(largest(view.force, (size_t)(view.n_owned * view.dimension)), 0,
                ROUNDING * force_scale(body));
}

static double *damage_of(const pd_body *body)
{
    double *damage = malloc((size_t)pd_body_fields(body).n_owned * sizeof *damage);
    pd_body_damage(body, damage);
    return damage;
}

/* The right half, beyond x = *context, moves off by 100 m. */
static void part(const double *X, const void *context, double *y)
{
    memcpy(y, X, 3 * sizeof *y);
    if (X[0] > *(const double *)context)
        y[0] += 100;
}

static void pull_apart(pd_body *body, double x)
{
    body_move(body, part, &x);
    assert_ok(pd_body_forces(body));
}

/* ---- when a bond breaks ---- */

/* Lattice 5 x 4 of spacing 1 whose lengths and stretches are exact: families are the
 * four nearest, 4 x 4 of 31 bonds along x. */
static void stretch_along_x(pd_body *body, double stretch)
{
    affine map = *at_rest();
    map.A[0] = stretch;
    body_map(body, &map);
    assert_ok(pd_body_forces(body));
}

static void bond_at_the_critical_stretch_holds(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 1);
    const pd_body_options options = breakable(2, 1.25, 1.5);
    pd_body *body = body_of(&cloud, &options);
    stretch_along_x(body, 1.5);
    assert_int_equal(pd_body_summary(body).broken_bonds, 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* 2^-40 beyond; positions up to 8 m resolve 2^-49. */
static void bond_beyond_the_critical_stretch_breaks(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 1);
    const pd_body_options options = breakable(2, 1.25, 1.5);
    pd_body *body = body_of(&cloud, &options);
    stretch_along_x(body, 1.5 * (1 + ldexp(1, -40)));
    assert_int_equal(pd_body_summary(body).broken_bonds, 16);
    assert_int_equal(pd_body_summary(body).bonds, 31);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void only_the_bond_stretched_too_far_breaks(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 1);
    const pd_body_options options = breakable(2, 1.25, 1.5);
    pd_body *body = body_of(&cloud, &options);
    stretch_along_x(body, 1.6);
    const pd_body_view view = pd_body_fields(body);
    for (pd_local p = 0; p < view.n_owned; p++) {
        pd_local neighbour[MOST_NEIGHBOURS];
        const pd_local count = pd_body_family(body, p, MOST_NEIGHBOURS, neighbour);
        for (pd_local k = 0; k < count; k++) {
            const bool along_y = view.X[2 * neighbour[k]] == view.X[2 * p];
            assert_int_equal(pd_body_bond_intact(body, p, k), along_y);
        }
    }
    pd_body_destroy(body);
    points_free(&cloud);
}

/* On the lattice path and on the general one. */
static void bond_may_bear_force_once_more_before_it_breaks(void **state)
{
    for (int general = 0; general < 2; general++) {
        points cloud = lattice(2, 5, 4, 1, 1);
        pd_body_options options = breakable(2, 1.25, 1.5);
        options.general = general;
        options.formulation = pd_formulation_find("bond");
        options.material = pd_material_find("microelastic");
        options.formulation_parameters[1] = 1;
        pd_body *later = body_of(&cloud, &options);
        options.critical_stretch = 0;
        pd_body *whole = body_of(&cloud, &options);
        const double s = 1.5 * (1 + ldexp(1, -40));
        stretch_along_x(later, s);
        stretch_along_x(whole, s);
        const pd_body_view a = pd_body_fields(later), b = pd_body_fields(whole);
        for (pd_local c = 0; c < 2 * a.n_owned; c++)
            assert_near(a.force[c], b.force[c], ROUNDING * force_scale(whole));
        assert_true(largest(a.force, 40) > 0.1 * force_scale(whole));
        assert_int_equal(pd_body_summary(later).broken_bonds, 16);
        stretch_along_x(later, s);
        assert_no_force(later);
        pd_body_destroy(later);
        pd_body_destroy(whole);
        points_free(&cloud);
    }
}

static void broken_bond_never_heals(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 1);
    const pd_body_options options = breakable(2, 1.25, 1.5);
    pd_body *body = body_of(&cloud, &options);
    stretch_along_x(body, 1.6);
    stretch_along_x(body, 1);
    assert_int_equal(pd_body_summary(body).broken_bonds, 16);
    stretch_along_x(body, 0.9);
    assert_int_equal(pd_body_summary(body).broken_bonds, 16);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void bond_compressed_to_nothing_holds(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 1);
    const pd_body_options options = breakable(2, 1.25, 1.5);
    pd_body *body = body_of(&cloud, &options);
    stretch_along_x(body, 0.01);
    assert_int_equal(pd_body_summary(body).broken_bonds, 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void bonds_without_critical_stretch_hold(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 1);
    const pd_body_options options = options_of(2, 1.25);
    pd_body *body = body_of(&cloud, &options);
    stretch_along_x(body, 50);
    assert_int_equal(pd_body_summary(body).broken_bonds, 0);
    double *damage = damage_of(body);
    assert_near(largest(damage, cloud.n), 0, 0);
    free(damage);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- softening ---- */

static void halves_apart_exert_no_force(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud = lattice(d, 8, 6, 4, 0.1);
        const pd_body_options options = breakable(d, 2.015, 1.5);
        pd_body *body = body_of(&cloud, &options);
        pull_apart(body, 0.4);
        assert_no_force(body);
        const pd_summary summary = pd_body_summary(body);
        assert_near(summary.smallest_J, 1, ROUNDING);
        assert_near(summary.largest_J, 1, ROUNDING);
        assert_int_equal(summary.singular, 0);
        pd_body_destroy(body);
        points_free(&cloud);
    }
}

static void waved_apart(const double *X, const void *context, double *y)
{
    const double amplitude = 0.01;
    move_in_waves(X, &amplitude, y);
    if (X[0] > *(const double *)context)
        y[0] += 100;
}

/* Broken bonds have left K, F and the force: half a body is a body of its own. */
static void half_a_body_is_like_a_body_of_its_own(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud = lattice(d, 8, 6, 4, 0.1), half = lattice(d, 4, 6, 4, 0.1);
        const pd_body_options options = breakable(d, 2.015, 1.5);
        pd_body *body = body_of(&cloud, &options), *alone = body_of(&half, &options);
        const double middle = 0.4;
        pull_apart(body, middle); /* rigid, so that nothing else breaks */
        body_move(body, waved_apart, &middle);
        body_move(alone, waved_apart, &middle);
        assert_ok(pd_body_forces(body));
        assert_ok(pd_body_forces(alone));
        pd_local *local = places_of(body);
        const pd_body_view view = pd_body_fields(body), own = pd_body_fields(alone);
        for (pd_local p = 0; p < own.n_owned; p++) {
            const pd_local q = local[own.id[p]]; /* x counts slowest: the same numbers */
            assert_near(view.J[q], own.J[p], ROUNDING);
            for (int a = 0; a < d; a++)
                assert_near(view.force[q * d + a], own.force[p * d + a],
                            ROUNDING * force_scale(body));
        }
        free(local);
        pd_body_destroy(body);
        pd_body_destroy(alone);
        points_free(&cloud);
        points_free(&half);
    }
}

/* ---- points that carry no stress ---- */

static void point_torn_out_carries_no_stress(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud = lattice(d, 5, 5, 5, 0.1);
        const pd_body_options options = breakable(d, 2.015, 1.5);
        pd_body *body = body_of(&cloud, &options);
        const pd_body_view view = pd_body_fields(body);
        const pd_local p = place_of(body, (pd_global)cloud.n / 2);
        view.y[p * d + 1] += 50;
        assert_ok(pd_body_forces(body));
        assert_no_force(body);
        assert_int_equal(pd_body_summary(body).singular, 1);
        assert_near(view.J[p], 1, 0);
        for (int c = 0; c < d * d; c++)
            assert_near(view.F[p * d * d + c], c % (d + 1) == 0, 0);
        pd_body_destroy(body);
        points_free(&cloud);
    }
}

/* Layers of points, one apart, part from each other: bonds within a layer do not span
 * space. The layers are waved, so that they would bear stress. */
static void shed_layers(const double *X, const void *context, double *y)
{
    const double amplitude = 0.01;
    move_in_waves(X, &amplitude, y);
    y[0] += 100 * X[0];
}

static void layers_of_points_carry_no_stress(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud = lattice(d, 3, 5, 5, 0.1);
        const pd_body_options options = breakable(d, 2.015, 1.5);
        pd_body *body = body_of(&cloud, &options);
        body_move(body, shed_layers, NULL);
        assert_ok(pd_body_forces(body));
        const pd_summary summary = pd_body_summary(body);
        assert_int_equal(summary.singular, cloud.n);
        assert_true(summary.broken_bonds < summary.bonds);
        assert_near(largest(pd_body_fields(body).force, cloud.n * (size_t)d), 0, 0);
        pd_body_destroy(body);
        points_free(&cloud);
    }
}

static void body_of_dust_has_a_finite_summary(void **state)
{
    points cloud = lattice(2, 4, 4, 1, 0.1);
    const pd_body_options options = breakable(2, 2.015, 1.5);
    pd_body *body = body_of(&cloud, &options);
    affine map = {{50, 0, 0, 0, 50, 0, 0, 0, 50}, {0}};
    body_map(body, &map);
    assert_ok(pd_body_forces(body));
    const pd_summary summary = pd_body_summary(body);
    assert_int_equal(summary.singular, 16);
    assert_int_equal(summary.broken_bonds, summary.bonds);
    assert_near(pd_body_strain_energy(body), 0, 0);
    assert_near(summary.mean_volume_change, 0, 0);
    assert_near(summary.smallest_J, 1, 0);
    assert_near(summary.largest_J, 1, 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void isolated_point_stays_without_stress(void **state)
{
    points cloud = lattice(2, 5, 5, 1, 0.1);
    const pd_body_options options = breakable(2, 2.015, 1.5);
    pd_body *body = body_of(&cloud, &options);
    pd_body_fields(body).y[2 * place_of(body, 12)] += 50;
    assert_ok(pd_body_forces(body));
    body_map(body, at_rest());
    assert_ok(pd_body_forces(body));
    assert_int_equal(pd_body_summary(body).singular, 1);
    assert_no_force(body);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- inverted points ---- */

static const affine mirror = {{-1, 0, 0, 0, 1, 0, 0, 0, 1}, {0}};

static void inverted_point_is_an_error_without_damage(void **state)
{
    points cloud = lattice(2, 5, 5, 1, 0.1);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_of(&cloud, &options);
    body_map(body, &mirror);
    const pd_status status = pd_body_forces(body);
    assert_int_equal(status.code, PD_INVERTED);
    assert_in_range(status.point, 0, 24);
    assert_true(strlen(status.message) > 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* Corner 24 has bonds (-1,0), (0,-1), (-1,-1); drawn far inside it alone turns over. */
static void inverted_point_is_named(void **state)
{
    points cloud = lattice(2, 5, 5, 1, 0.1);
    const pd_body_options options = options_of(2, 1.5);
    pd_body *body = body_of(&cloud, &options);
    const pd_body_view view = pd_body_fields(body);
    const pd_local corner = place_of(body, 24);
    view.y[2 * corner] -= 0.12;
    view.y[2 * corner + 1] -= 0.12;
    const pd_status status = pd_body_forces(body);
    assert_int_equal(status.code, PD_INVERTED);
    assert_int_equal(status.point, 24);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void inverted_points_are_counted_with_damage(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud = lattice(d, 5, 5, 4, 0.1);
        const pd_body_options options = breakable(d, 2.015, 3);
        pd_body *body = body_of(&cloud, &options);
        body_map(body, &mirror);
        assert_ok(pd_body_forces(body));
        assert_no_force(body);
        assert_int_equal(pd_body_summary(body).inverted, cloud.n);
        assert_int_equal(pd_body_summary(body).singular, 0);
        assert_near(pd_body_fields(body).J[0], 1, 0);
        pd_body_destroy(body);
        points_free(&cloud);
    }
}

static void point_turned_back_bears_stress_again(void **state)
{
    points cloud = lattice(2, 5, 5, 1, 0.1);
    const pd_body_options options = breakable(2, 2.015, 3);
    pd_body *body = body_of(&cloud, &options);
    body_map(body, &mirror);
    assert_ok(pd_body_forces(body));
    const affine map = distortion(2);
    body_map(body, &map);
    assert_ok(pd_body_forces(body));
    assert_int_equal(pd_body_summary(body).inverted, 0);
    assert_near(pd_body_fields(body).J[0], determinant3(map.A), ROUNDING);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* J = 0.002 is sound, 0.0005 is not: PD_SMALLEST_J is 0.001. */
static void flat_point_counts_as_inverted(void **state)
{
    points cloud = lattice(2, 5, 5, 1, 0.1);
    const pd_body_options options = breakable(2, 2.015, 3);
    pd_body *body = body_of(&cloud, &options);
    stretch_along_x(body, 0.002);
    assert_int_equal(pd_body_summary(body).inverted, 0);
    stretch_along_x(body, 0.0005);
    assert_int_equal(pd_body_summary(body).inverted, 25);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- local damage ---- */

/* Lattice 8 x 7, 12 neighbours: of a point beside the plane (1,-1), (1,0), (1,1), (2,0)
 * are beyond it, of a point behind that (2,0). */
static void local_damage_is_the_lost_share_of_the_family(void **state)
{
    points cloud = lattice(2, 8, 7, 1, 0.1);
    const pd_body_options options = breakable(2, 2.015, 1.5);
    pd_body *body = body_of(&cloud, &options);
    pull_apart(body, 0.4);
    double *damage = damage_of(body);
    assert_near(damage[place_of(body, 3 * 7 + 3)], 4. / 12, 1e-15);
    assert_near(damage[place_of(body, 2 * 7 + 3)], 1. / 12, 1e-15);
    assert_near(damage[place_of(body, 1 * 7 + 3)], 0, 0);
    free(damage);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void local_damage_of_an_isolated_point_is_one(void **state)
{
    points cloud = lattice(2, 5, 5, 1, 0.1);
    const pd_body_options options = breakable(2, 2.015, 1.5);
    pd_body *body = body_of(&cloud, &options);
    const pd_local p = place_of(body, 12);
    pd_body_fields(body).y[2 * p] += 50;
    assert_ok(pd_body_forces(body));
    double *damage = damage_of(body);
    assert_near(damage[p], 1, 0);
    free(damage);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* The first column's points have volume 1, the others 2; it is cut off. Of its middle
 * point two neighbours of volume 1 stay, three of volume 2 go: the horizon between the
 * two kinds, 1.5 (1 + sqrt 2)/2 = 1.8, reaches the next column with its diagonals. */
static void local_damage_counts_volumes(void **state)
{
    points cloud = lattice(2, 4, 3, 1, 1);
    for (size_t p = 0; p < cloud.n; p++)
        cloud.volume[p] = p < 3 ? 1 : 2;
    const pd_body_options options = breakable(2, 1.5, 1.5);
    pd_body *body = body_of(&cloud, &options);
    pull_apart(body, 1);
    double *damage = damage_of(body);
    assert_near(damage[place_of(body, 1)], 6. / 8, 1e-15);
    free(damage);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- pre-cracks ---- */

/* Does the bond a-b meet the plane x = cut with its other coordinates between low and
 * high? */
static bool is_cut(int d, const double *a, const double *b, double cut, const double *low,
                   const double *high)
{
    if ((a[0] - cut) * (b[0] - cut) >= 0)
        return false;
    const double share = (cut - a[0]) / (b[0] - a[0]);
    for (int c = 1; c < d; c++) {
        const double place = a[c] + share * (b[c] - a[c]);
        if (place < low[c] || place > high[c])
            return false;
    }
    return true;
}

static void assert_cracked(const pd_body *body, double cut, const double *low,
                           const double *high)
{
    const pd_body_view view = pd_body_fields(body);
    const int d = view.dimension;
    for (pd_local p = 0; p < view.n_owned; p++) {
        pd_local neighbour[MOST_NEIGHBOURS];
        const pd_local count = pd_body_family(body, p, MOST_NEIGHBOURS, neighbour);
        for (pd_local k = 0; k < count; k++) {
            const double *a = view.X + p * d, *b = view.X + neighbour[k] * d;
            assert_int_equal(pd_body_bond_intact(body, p, k),
                             !is_cut(d, a, b, cut, low, high));
        }
    }
}

/* Eight rows, families of eight: a cut between columns crosses 8 level and 2 x 7 oblique
 * bonds. */
static void crack_through_a_plate_breaks_22_bonds(void **state)
{
    points cloud = lattice(2, 10, 8, 1, 0.1);
    const pd_body_options options = options_of(2, 1.5);
    pd_body *body = body_of(&cloud, &options);
    const pd_rectangle crack = {.corner = {0.5, -1}, .edge1 = {0, 3}};
    assert_ok(pd_body_precrack(body, &crack));
    assert_int_equal(pd_body_summary(body).broken_bonds, 22);
    const double low[3] = {0, -1, 0}, high[3] = {0, 2, 0};
    assert_cracked(body, 0.5, low, high);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* Up to 0.33, between the oblique bonds' crossings at 0.3 and the row at 0.35: three
 * level bonds and two oblique ones at each of 0.1, 0.2, 0.3. */
static void crack_into_a_plate_breaks_9_bonds(void **state)
{
    points cloud = lattice(2, 10, 8, 1, 0.1);
    const pd_body_options options = options_of(2, 1.5);
    pd_body *body = body_of(&cloud, &options);
    const pd_rectangle crack = {.corner = {0.5, -1}, .edge1 = {0, 1.33}};
    assert_ok(pd_body_precrack(body, &crack));
    assert_int_equal(pd_body_summary(body).broken_bonds, 9);
    const double low[3] = {0, -1, 0}, high[3] = {0, 0.33, 0};
    assert_cracked(body, 0.5, low, high);
    pd_body_destroy(body);
    points_free(&cloud);
}

static int64_t bonds_broken_by(const pd_rectangle *crack)
{
    points cloud = lattice(2, 10, 8, 1, 0.1);
    const pd_body_options options = options_of(2, 1.5);
    pd_body *body = body_of(&cloud, &options);
    assert_ok(pd_body_precrack(body, crack));
    const int64_t broken = pd_body_summary(body).broken_bonds;
    pd_body_destroy(body);
    points_free(&cloud);
    return broken;
}

/* The row at 0.35 is met, or missed by 1e-6 of the crack's length. */
static void crack_that_touches_a_bond_breaks_it(void **state)
{
    const pd_rectangle touches = {.corner = {0.5, -1}, .edge1 = {0, 1.35}};
    const pd_rectangle misses = {.corner = {0.5, -1}, .edge1 = {0, 1.35 - 1e-6}};
    assert_int_equal(bonds_broken_by(&touches), 10);
    assert_int_equal(bonds_broken_by(&misses), 9);
}

/* Through the column at 0.45 it cuts that off on both sides; 1e-6 beside it, on one. */
static void crack_through_points_breaks_the_bonds_of_both_sides(void **state)
{
    const pd_rectangle touches = {.corner = {0.45, -1}, .edge1 = {0, 3}};
    const pd_rectangle misses = {.corner = {0.45 - 1e-6, -1}, .edge1 = {0, 3}};
    assert_int_equal(bonds_broken_by(&touches), 44);
    assert_int_equal(bonds_broken_by(&misses), 22);
}

static void third_components_of_a_crack_are_ignored_in_the_plane(void **state)
{
    const pd_rectangle crack = {
        .corner = {0.5, -1, 7}, .edge1 = {0, 3, -4}, .edge2 = {1, 2, 0}};
    assert_int_equal(bonds_broken_by(&crack), 22);
}

/* 8 x 6 points a layer, families of 18: 48 straight bonds and 2 (7 x 6 + 8 x 5) oblique
 * ones. */
static void crack_through_a_block_breaks_212_bonds(void **state)
{
    points cloud = lattice(3, 6, 8, 6, 0.1);
    const pd_body_options options = options_of(3, 1.5);
    pd_body *body = body_of(&cloud, &options);
    const pd_rectangle crack = {
        .corner = {0.3, -1, -1}, .edge1 = {0, 3, 0}, .edge2 = {0, 0, 3}};
    assert_ok(pd_body_precrack(body, &crack));
    assert_int_equal(pd_body_summary(body).broken_bonds, 212);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void crack_into_a_block_breaks_what_crosses_it(void **state)
{
    points cloud = lattice(3, 6, 8, 6, 0.1);
    const pd_body_options options = options_of(3, 2.015);
    pd_body *body = body_of(&cloud, &options);
    const pd_rectangle crack = {
        .corner = {0.3, 0.17, 0.08}, .edge1 = {0, 0, 0.31}, .edge2 = {0, 0.36, 0}};
    assert_ok(pd_body_precrack(body, &crack));
    const double low[3] = {0, 0.17, 0.08}, high[3] = {0, 0.53, 0.39};
    assert_cracked(body, 0.3, low, high);
    assert_true(pd_body_summary(body).broken_bonds > 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void crack_at_a_slant_parts_the_plate(void **state)
{
    points cloud = lattice(2, 10, 8, 1, 0.1);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_of(&cloud, &options);
    const pd_rectangle crack = {.corner = {0.2, -0.01}, .edge1 = {0.5, 0.83}};
    assert_ok(pd_body_precrack(body, &crack));
    const pd_body_view view = pd_body_fields(body);
    for (pd_local p = 0; p < view.n_owned; p++) {
        pd_local neighbour[MOST_NEIGHBOURS];
        const pd_local count = pd_body_family(body, p, MOST_NEIGHBOURS, neighbour);
        for (pd_local k = 0; k < count; k++) {
            double side[2];
            for (int end = 0; end < 2; end++) {
                const double *X = view.X + 2 * (end ? neighbour[k] : p);
                side[end] = (X[0] - 0.2) * 0.83 - (X[1] + 0.01) * 0.5;
            }
            assert_int_equal(pd_body_bond_intact(body, p, k), side[0] * side[1] > 0);
        }
    }
    pd_body_destroy(body);
    points_free(&cloud);
}

static void crack_beside_the_body_breaks_none(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud = lattice(d, 6, 6, 6, 0.1);
        const pd_body_options options = options_of(d, 2.015);
        pd_body *body = body_of(&cloud, &options);
        const pd_rectangle cracks[] = {
            {.corner = {-1, 0.62, -1}, .edge1 = {3, 0, 0}, .edge2 = {0, 0, 3}},
            {.corner = {0.3, 0.62, 0}, .edge1 = {0, 1, 0}, .edge2 = {0, 0, 0.6}},
        };
        for (size_t k = 0; k < sizeof cracks / sizeof *cracks; k++)
            assert_ok(pd_body_precrack(body, &cracks[k]));
        assert_int_equal(pd_body_summary(body).broken_bonds, 0);
        pd_body_destroy(body);
        points_free(&cloud);
    }
}

/* In its plane, but beyond its edge along z. */
static void crack_of_a_block_ends_with_its_second_edge(void **state)
{
    points cloud = lattice(3, 6, 6, 6, 0.1);
    const pd_body_options options = options_of(3, 2.015);
    pd_body *body = body_of(&cloud, &options);
    const pd_rectangle crack = {
        .corner = {0.3, 0, 0.62}, .edge1 = {0, 0.6, 0}, .edge2 = {0, 0, 1}};
    assert_ok(pd_body_precrack(body, &crack));
    assert_int_equal(pd_body_summary(body).broken_bonds, 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void crack_is_felt_at_once(void **state)
{
    points cloud = lattice(2, 8, 6, 1, 0.1);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_of(&cloud, &options);
    const pd_rectangle crack = {.corner = {0.4, -1}, .edge1 = {0, 3}};
    assert_ok(pd_body_precrack(body, &crack));
    pull_apart(body, 0.4);
    assert_no_force(body);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void cracks_add_up(void **state)
{
    points cloud = lattice(2, 10, 8, 1, 0.1);
    const pd_body_options options = options_of(2, 1.5);
    pd_body *body = body_of(&cloud, &options);
    const pd_rectangle first = {.corner = {0.5, -1}, .edge1 = {0, 3}};
    const pd_rectangle second = {.corner = {0.2, -1}, .edge1 = {0, 3}};
    assert_ok(pd_body_precrack(body, &first));
    assert_ok(pd_body_precrack(body, &second));
    assert_ok(pd_body_precrack(body, &first));
    assert_int_equal(pd_body_summary(body).broken_bonds, 44);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void degenerate_crack_is_refused(void **state)
{
    points cloud = lattice(3, 4, 4, 4, 0.1);
    const pd_body_options options = options_of(3, 2.015);
    pd_body *body = body_of(&cloud, &options);
    const pd_rectangle no_area = {.edge1 = {0, 1, 0}, .edge2 = {0, 2, 0}};
    const pd_rectangle no_number = {.edge1 = {0, NAN, 0}, .edge2 = {0, 0, 1}};
    assert_int_equal(pd_body_precrack(body, &no_area).code, PD_BAD_ARGUMENT);
    assert_int_equal(pd_body_precrack(body, &no_number).code, PD_BAD_ARGUMENT);
    assert_int_equal(pd_body_summary(body).broken_bonds, 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- pieces ---- */

static void whole_body_is_one_piece(void **state)
{
    points cloud = lattice(2, 8, 6, 1, 0.1);
    const pd_body_options options = breakable(2, 2.015, 1.5);
    pd_body *body = body_of(&cloud, &options);
    pd_global piece[48];
    assert_int_equal(pd_body_pieces(body, piece, NULL), 1);
    for (int p = 0; p < 48; p++)
        assert_int_equal(piece[p], 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void parted_body_is_two_pieces(void **state)
{
    points cloud = lattice(2, 8, 6, 1, 0.1);
    const pd_body_options options = breakable(2, 2.015, 1.5);
    pd_body *body = body_of(&cloud, &options);
    pull_apart(body, 0.4);
    const pd_body_view view = pd_body_fields(body);
    pd_global piece[48];
    assert_int_equal(pd_body_pieces(body, piece, NULL), 2);
    /* Named by their smallest numbers, which run along y first. */
    for (pd_local p = 0; p < 48; p++)
        assert_int_equal(piece[p], view.X[2 * p] > 0.4 ? 24 : 0);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void dust_is_as_many_pieces_as_points(void **state)
{
    points cloud = lattice(2, 8, 6, 1, 0.1);
    const pd_body_options options = breakable(2, 2.015, 1.5);
    pd_body *body = body_of(&cloud, &options);
    affine map = {{50, 0, 0, 0, 50, 0, 0, 0, 50}, {0}};
    body_map(body, &map);
    assert_ok(pd_body_forces(body));
    pd_global piece[48];
    assert_int_equal(pd_body_pieces(body, piece, NULL), 48);
    for (pd_local p = 0; p < 48; p++)
        assert_int_equal(piece[p], pd_body_fields(body).id[p]);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* Columns 0 to 3 of eight are held; 0 and 1 are out of reach of the moving ones. */
static void held_points_out_of_reach_are_in_no_piece(void **state)
{
    points cloud = lattice(2, 8, 6, 1, 0.1);
    unsigned char held[48] = {0};
    memset(held, 1, 24);
    const pd_body_options options = breakable(2, 2.015, 1.5);
    pd_body *body = body_with_holds(&cloud, &options, held);
    const pd_body_view view = pd_body_fields(body);
    pd_global piece[48];
    pd_global holding = -1;
    assert_int_equal(pd_body_pieces(body, piece, &holding), 1);
    assert_int_equal(holding, 1);
    for (pd_local p = 0; p < 48; p++)
        assert_int_equal(piece[p], view.id[p] < 12 ? -1 : 12);
    pd_body_destroy(body);
    points_free(&cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bond_at_the_critical_stretch_holds),
        cmocka_unit_test(bond_beyond_the_critical_stretch_breaks),
        cmocka_unit_test(only_the_bond_stretched_too_far_breaks),
        cmocka_unit_test(bond_may_bear_force_once_more_before_it_breaks),
        cmocka_unit_test(broken_bond_never_heals),
        cmocka_unit_test(bond_compressed_to_nothing_holds),
        cmocka_unit_test(bonds_without_critical_stretch_hold),
        cmocka_unit_test(halves_apart_exert_no_force),
        cmocka_unit_test(half_a_body_is_like_a_body_of_its_own),
        cmocka_unit_test(point_torn_out_carries_no_stress),
        cmocka_unit_test(layers_of_points_carry_no_stress),
        cmocka_unit_test(body_of_dust_has_a_finite_summary),
        cmocka_unit_test(isolated_point_stays_without_stress),
        cmocka_unit_test(inverted_point_is_an_error_without_damage),
        cmocka_unit_test(inverted_point_is_named),
        cmocka_unit_test(inverted_points_are_counted_with_damage),
        cmocka_unit_test(point_turned_back_bears_stress_again),
        cmocka_unit_test(flat_point_counts_as_inverted),
        cmocka_unit_test(local_damage_is_the_lost_share_of_the_family),
        cmocka_unit_test(local_damage_of_an_isolated_point_is_one),
        cmocka_unit_test(local_damage_counts_volumes),
        cmocka_unit_test(crack_through_a_plate_breaks_22_bonds),
        cmocka_unit_test(crack_into_a_plate_breaks_9_bonds),
        cmocka_unit_test(crack_that_touches_a_bond_breaks_it),
        cmocka_unit_test(crack_through_points_breaks_the_bonds_of_both_sides),
        cmocka_unit_test(third_components_of_a_crack_are_ignored_in_the_plane),
        cmocka_unit_test(crack_through_a_block_breaks_212_bonds),
        cmocka_unit_test(crack_into_a_block_breaks_what_crosses_it),
        cmocka_unit_test(crack_at_a_slant_parts_the_plate),
        cmocka_unit_test(crack_beside_the_body_breaks_none),
        cmocka_unit_test(crack_of_a_block_ends_with_its_second_edge),
        cmocka_unit_test(crack_is_felt_at_once),
        cmocka_unit_test(cracks_add_up),
        cmocka_unit_test(degenerate_crack_is_refused),
        cmocka_unit_test(whole_body_is_one_piece),
        cmocka_unit_test(parted_body_is_two_pieces),
        cmocka_unit_test(dust_is_as_many_pieces_as_points),
        cmocka_unit_test(held_points_out_of_reach_are_in_no_piece),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
