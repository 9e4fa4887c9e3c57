/*
 * Families, and what a bond weighs by its length.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "lattice.h"

/* ---- families against all pairs ---- */

static double distance(const points *cloud, size_t i, size_t j)
{
    double square = 0;
    for (int a = 0; a < 3; a++)
        square += pow(cloud->X[3 * j + (size_t)a] - cloud->X[3 * i + (size_t)a], 2);
    return sqrt(square);
}

static double horizon(const points *cloud, double ratio, size_t i, size_t j)
{
    const double one_by_d = 1. / cloud->d;
    return ratio * 0.5 *
           (pow(cloud->volume[i], one_by_d) + pow(cloud->volume[j], one_by_d));
}

static int is_in_family(const pd_body *body, pd_local p, pd_local q)
{
    pd_local neighbour[MOST_NEIGHBOURS];
    const pd_local count = pd_body_family(body, p, MOST_NEIGHBOURS, neighbour);
    int found = 0;
    for (pd_local k = 0; k < count; k++)
        found += neighbour[k] == q;
    return found;
}

/* Round-off decides about a bond as long as the horizon; it must only be decided alike at
 * both ends. 1e-12: some hundred rounding errors of a length. */
static void assert_families(const points *cloud, double ratio)
{
    const pd_body_options options = options_of(cloud->d, ratio);
    pd_body *body = body_of(cloud, &options);
    pd_local *local = places_of(body);
    for (size_t i = 0; i < cloud->n; i++)
        for (size_t j = 0; j < cloud->n; j++) {
            const int found = is_in_family(body, local[i], local[j]);
            const double length = distance(cloud, i, j);
            const double reach = horizon(cloud, ratio, i, j);
            assert_int_equal(found, is_in_family(body, local[j], local[i]));
            if (fabs(length - reach) > 1e-12 * reach)
                assert_int_equal(found, i != j && length < reach);
        }
    free(local);
    pd_body_destroy(body);
}

static void family_of_lattice_is_that_of_all_pairs(void **state)
{
    const double ratios[] = {1.5, 2, 2.015, 3, 3.015};
    for (int d = 2; d <= 3; d++)
        for (size_t k = 0; k < sizeof ratios / sizeof *ratios; k++) {
            points cloud = lattice(d, 8, 7, 5, 0.1);
            assert_families(&cloud, ratios[k]);
            points_free(&cloud);
        }
}

static void family_of_irregular_points_is_that_of_all_pairs(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud = lattice(d, 8, 7, 5, 0.1);
        jitter(&cloud, 0.03);
        assert_families(&cloud, 2.2);
        points_free(&cloud);
    }
}

static void family_of_uneven_volumes_is_that_of_all_pairs(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud = graded(d, 8, 7, 5, 0.1, 1.15);
        assert_families(&cloud, 2.2);
        points_free(&cloud);
    }
}

static void families_do_not_depend_on_where_the_body_stands(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud = lattice(d, 8, 7, 5, 0.1);
        for (size_t p = 0; p < cloud.n; p++) {
            cloud.X[3 * p] -= 20;
            cloud.X[3 * p + 1] += 7.77;
        }
        assert_families(&cloud, 2.015);
        points_free(&cloud);
    }
}

/* Two lattices so far apart that a grid of horizons between them would not fit. */
static void families_of_a_sparse_cloud_are_those_of_all_pairs(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud = lattice(d, 8, 5, 4, 0.1);
        for (size_t p = cloud.n / 2; p < cloud.n; p++)
            for (int a = 0; a < d; a++)
                cloud.X[3 * p + (size_t)a] += 1e5;
        assert_families(&cloud, 2.2);
        points_free(&cloud);
    }
}

/* A horizon of exactly two or three spacings is what users write. The bond that long may
 * be in or out by round-off, but every interior point of a power-of-two lattice, free of
 * round-off, has it. */
static void bond_as_long_as_the_horizon_is_in(void **state)
{
    points cloud = lattice(2, 9, 9, 1, 0.125);
    const pd_body_options options = options_of(2, 3);
    pd_body *body = body_of(&cloud, &options);
    assert_int_equal(pd_body_family(body, place_of(body, 40), 0, NULL), 28);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- counts ---- */

/* Integer vectors other than 0 no longer than the ratio. */
static int count_by_definition(int d, double ratio)
{
    int count = -1;
    for (int x = -4; x <= 4; x++)
        for (int y = -4; y <= 4; y++)
            for (int z = d == 2 ? 0 : -4; z <= (d == 2 ? 0 : 4); z++)
                count += sqrt(x * x + y * y + z * z) <= ratio;
    return count;
}

static int count_in_the_middle(int d, double ratio)
{
    points cloud = lattice(d, 9, 9, 9, 0.1);
    const pd_body_options options = options_of(d, ratio);
    pd_body *body = body_of(&cloud, &options);
    const int count =
        pd_body_family(body, place_of(body, (pd_global)cloud.n / 2), 0, NULL);
    pd_body_destroy(body);
    points_free(&cloud);
    return count;
}

static void interior_point_has_122_neighbours_at_3_0002_spacings(void **state)
{
    assert_int_equal(count_by_definition(3, 3.0002), 122);
    assert_int_equal(count_in_the_middle(3, 3.0002), 122);
}

static void interior_point_has_12_neighbours_at_2_015_spacings(void **state)
{
    assert_int_equal(count_by_definition(2, 2.015), 12);
    assert_int_equal(count_in_the_middle(2, 2.015), 12);
}

static void interior_point_has_28_neighbours_at_3_015_spacings(void **state)
{
    assert_int_equal(count_by_definition(2, 3.015), 28);
    assert_int_equal(count_in_the_middle(2, 3.015), 28);
}

/* ---- families that do not span space ---- */

static pd_status refusal(const points *cloud, double ratio)
{
    const pd_body_options options = options_of(cloud->d, ratio);
    pd_body *body;
    const pd_status status = pd_body_create(MPI_COMM_NULL, &options, cloud->n, cloud->X,
                                            cloud->volume, NULL, NULL, &body);
    assert_null(body);
    return status;
}

static void horizon_below_the_spacing_is_refused(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud = lattice(d, 4, 4, 4, 0.1);
        const pd_status status = refusal(&cloud, 0.95);
        assert_int_equal(status.code, PD_BAD_FAMILY);
        assert_in_range(status.point, 0, cloud.n - 1);
        assert_non_null(strstr(status.message, "0.95"));
        points_free(&cloud);
    }
}

static void points_on_a_line_are_refused(void **state)
{
    points cloud = lattice(2, 6, 1, 1, 0.1);
    assert_int_equal(refusal(&cloud, 3.015).code, PD_BAD_FAMILY);
    points_free(&cloud);
}

static void points_in_a_plane_are_refused_in_space(void **state)
{
    points cloud = lattice(3, 6, 6, 1, 0.1);
    assert_int_equal(refusal(&cloud, 3.015).code, PD_BAD_FAMILY);
    points_free(&cloud);
}

static void point_apart_is_named(void **state)
{
    points cloud = lattice(2, 5, 5, 1, 0.1);
    cloud.X[3 * 13] += 100;
    const pd_status status = refusal(&cloud, 2.015);
    assert_int_equal(status.code, PD_BAD_FAMILY);
    assert_int_equal(status.point, 13);
    assert_non_null(strstr(status.message, " 0 bonds"));
    points_free(&cloud);
}

/* ---- held points ---- */

/* Columns 0 to 5 of ten are held; a horizon of 2.015 spacings reaches columns 4 and 5. */
static void held_points_out_of_reach_keep_no_family(void **state)
{
    points cloud = lattice(2, 10, 4, 1, 0.1);
    unsigned char held[40] = {0};
    memset(held, 1, 24);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_with_holds(&cloud, &options, held);
    for (pd_global id = 0; id < 40; id++) {
        const pd_local count = pd_body_family(body, place_of(body, id), 0, NULL);
        if (id < 16)
            assert_int_equal(count, 0);
        else
            assert_true(count > 0);
    }
    pd_body_destroy(body);
    points_free(&cloud);
}

/* Column 4 bears force: its family reaches back into columns 2 and 3, which do not. */
static void held_point_beside_moving_ones_keeps_its_whole_family(void **state)
{
    points cloud = lattice(2, 10, 5, 1, 0.1);
    unsigned char held[50] = {0};
    memset(held, 1, 30);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_with_holds(&cloud, &options, held);
    assert_int_equal(pd_body_family(body, place_of(body, 4 * 5 + 2), 0, NULL), 12);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- influence and volume correction ---- */

/* C (2/3 - r^2 + r^3/2), then C (2 - r)^3 / 6, by hand. Rounding of a few terms. */
static void influence_has_the_values_of_the_spline(void **state)
{
    const double pi = acos(-1), C2 = 15 / (7 * pi), C3 = 3 / (2 * pi), rounding = 1e-15;
    assert_near(pd_influence(0, 2), C2 * 2 / 3, rounding);
    assert_near(pd_influence(0, 3), C3 * 2 / 3, rounding);
    assert_near(pd_influence(0.5, 2), C2 * 23 / 48, rounding);
    assert_near(pd_influence(0.5, 3), C3 * 23 / 48, rounding);
    assert_near(pd_influence(1, 2), C2 / 6, rounding);
    assert_near(pd_influence(1.5, 2), C2 / 48, rounding);
    assert_near(pd_influence(1.5, 3), C3 / 48, rounding);
}

static void influence_ends_at_the_horizon(void **state)
{
    for (int d = 2; d <= 3; d++) {
        assert_near(pd_influence(2, d), 0, 0);
        assert_near(pd_influence(2.1, d), 0, 0);
    }
}

/* The midpoint rule's error is dr^2/24 times the difference of the integrand's slopes at
 * both ends, at most 3 here: 5e-7, far below what a wrong C would make. */
static void influence_integrates_to_one(void **state)
{
    const int n = 1000;
    const double pi = acos(-1), dr = 2. / n;
    double plane = 0, space = 0;
    for (int k = 0; k < n; k++) {
        const double r = (k + 0.5) * dr;
        plane += pd_influence(r, 2) * 2 * pi * r * dr;
        space += pd_influence(r, 3) * 4 * pi * r * r * dr;
    }
    assert_near(plane, 1, 1e-6);
    assert_near(space, 1, 1e-6);
}

/* Horizon 0.6, spacing 0.2: whole up to 0.5, half at 0.6. Rounding of three terms. */
static void volume_fraction_falls_from_one_to_a_half(void **state)
{
    assert_near(pd_volume_fraction(0.2, 0.6, 0.2), 1, 0);
    assert_near(pd_volume_fraction(0.49, 0.6, 0.2), 1, 0);
    assert_near(pd_volume_fraction(0.52, 0.6, 0.2), 0.9, 1e-14);
    assert_near(pd_volume_fraction(0.55, 0.6, 0.2), 0.75, 1e-14);
    assert_near(pd_volume_fraction(0.6, 0.6, 0.2), 0.5, 1e-14);
}

static void volume_fraction_is_nothing_beyond_the_horizon(void **state)
{
    assert_near(pd_volume_fraction(0.601, 0.6, 0.2), 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(family_of_lattice_is_that_of_all_pairs),
        cmocka_unit_test(family_of_irregular_points_is_that_of_all_pairs),
        cmocka_unit_test(family_of_uneven_volumes_is_that_of_all_pairs),
        cmocka_unit_test(families_do_not_depend_on_where_the_body_stands),
        cmocka_unit_test(families_of_a_sparse_cloud_are_those_of_all_pairs),
        cmocka_unit_test(bond_as_long_as_the_horizon_is_in),
        cmocka_unit_test(interior_point_has_122_neighbours_at_3_0002_spacings),
        cmocka_unit_test(interior_point_has_12_neighbours_at_2_015_spacings),
        cmocka_unit_test(interior_point_has_28_neighbours_at_3_015_spacings),
        cmocka_unit_test(horizon_below_the_spacing_is_refused),
        cmocka_unit_test(points_on_a_line_are_refused),
        cmocka_unit_test(points_in_a_plane_are_refused_in_space),
        cmocka_unit_test(point_apart_is_named),
        cmocka_unit_test(held_points_out_of_reach_keep_no_family),
        cmocka_unit_test(held_point_beside_moving_ones_keeps_its_whole_family),
        cmocka_unit_test(influence_has_the_values_of_the_spline),
        cmocka_unit_test(influence_ends_at_the_horizon),
        cmocka_unit_test(influence_integrates_to_one),
        cmocka_unit_test(volume_fraction_falls_from_one_to_a_half),
        cmocka_unit_test(volume_fraction_is_nothing_beyond_the_horizon),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
