/*
 * Sharing points out: balance, cut, weights, what is refused.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "lattice.h"
#include "partition.h"

#define RATIO 3.015

static pd_cloud cloud_of(const points *cloud)
{
    return (pd_cloud){.dimension = cloud->d,
                      .horizon_ratio = RATIO,
                      .n = cloud->n,
                      .X = cloud->X,
                      .volume = cloud->volume};
}

/* A line of points, one dimension. */
static points line(int n)
{
    points cloud = lattice(2, n, 1, 1, 1);
    cloud.d = 1;
    return cloud;
}

static int *partition_of(const pd_cloud *cloud, int parts)
{
    int *part = malloc(cloud->n * sizeof *part);
    assert_ok(pd_partition(cloud, parts, part));
    return part;
}

static pd_partition_quality quality_of(const pd_cloud *cloud, int parts, const int *part)
{
    pd_partition_quality q;
    assert_ok(pd_partition_measure(cloud, parts, part, &q));
    return q;
}

/* ---- balance ---- */

/* Within METIS's tolerance and one vertex more, which cannot be split: a point or a
 * cluster of so many points, each of which costs a little more than the mean. */
static void assert_balanced(const points *shape, int parts, double cluster)
{
    const pd_cloud cloud = cloud_of(shape);
    int *part = partition_of(&cloud, parts);
    const pd_partition_quality q = quality_of(&cloud, parts, part);
    assert_true(q.fewest > 0);
    assert_true(q.cost <= PD_PARTITION_TOLERANCE + cluster * parts / (double)shape->n);
    free(part);
}

static void costs_are_balanced(void **state)
{
    const int counts[] = {2, 3, 4, 7, 8, 16, 31};
    for (int d = 1; d <= 3; d++)
        for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
            points cloud = d == 1   ? line(3000)
                           : d == 2 ? lattice(2, 70, 50, 1, 0.1)
                                    : lattice(3, 18, 15, 13, 0.1);
            /* A family inside is at most twice the mean one. */
            assert_balanced(&cloud, counts[k], 2);
            points_free(&cloud);
        }
}

static void costs_of_clusters_are_balanced(void **state)
{
    points plane = lattice(2, 250, 200, 1, 0.1), space = lattice(3, 30, 30, 25, 0.1);
    const pd_cloud in_plane = cloud_of(&plane), in_space = cloud_of(&space);
    assert_true(pd_partition_side(&in_plane, 4) > 1);
    assert_true(pd_partition_side(&in_space, 4) > 1);
    assert_balanced(&plane, 4, 2 * 4);
    assert_balanced(&space, 4, 2 * 8);
    assert_balanced(&space, 10, 2 * 8);
    points_free(&plane);
    points_free(&space);
}

/* From the first to the last point the spacing grows a hundredfold. */
static void uneven_points_are_balanced(void **state)
{
    points few = graded(2, 60, 60, 1, 0.01, 1.08),
           many = graded(2, 200, 150, 1, 0.01, 1.02);
    jitter(&few, 0.002);
    const pd_cloud cloud = cloud_of(&many);
    assert_true(pd_partition_side(&cloud, 4) > 1);
    assert_balanced(&few, 5, 2);
    assert_balanced(&many, 4, 2 * 4);
    points_free(&few);
    points_free(&many);
}

/* ---- cut ---- */

/* A bar across its length: each pair of columns k apart on two sides of a plane across
 * it, k times, is bonded as far as the horizon says. */
static int64_t bonds_across(int ny, int nz)
{
    int64_t bonds = 0;
    for (int k = 1; k <= 3; k++)
        for (int y = -3; y <= 3; y++)
            for (int z = -3; z <= 3; z++)
                if (k * k + y * y + z * z <= RATIO * RATIO && abs(y) < ny && abs(z) < nz)
                    bonds += (int64_t)k * (ny - abs(y)) * (nz - abs(z));
    return bonds;
}

static void assert_cut(const points *shape, int side, double excess, int64_t best)
{
    const pd_cloud cloud = cloud_of(shape);
    int *part = malloc(cloud.n * sizeof *part);
    assert_ok(pd_partition_clustered(&cloud, side, 2, part));
    const pd_partition_quality q = quality_of(&cloud, 2, part);
    assert_true(q.cut >= best);
    assert_true((double)q.cut <= (1 + excess) * (double)best);
    free(part);
}

/* METIS is a heuristic: a step of one column or so in the plane across the bar. */
static void bar_is_cut_across(void **state)
{
    points plane = lattice(2, 120, 12, 1, 1), space = lattice(3, 60, 8, 8, 1);
    for (int side = 1; side <= 3; side++) {
        assert_cut(&plane, side, 0.1, bonds_across(12, 1));
        assert_cut(&space, side, 0.1, bonds_across(8, 8));
    }
    points_free(&plane);
    points_free(&space);
}

static void measure_counts_what_is_cut(void **state)
{
    points cloud = lattice(3, 20, 5, 4, 1);
    const pd_cloud c = cloud_of(&cloud);
    int *part = malloc(c.n * sizeof *part);
    for (size_t i = 0; i < c.n; i++)
        part[i] = cloud.X[3 * i] > 5;
    const pd_partition_quality q = quality_of(&c, 2, part);
    assert_int_equal(q.cut, bonds_across(5, 4));
    assert_int_equal(q.fewest, 5 * 5 * 4);
    assert_near(q.points, 1.5, 1e-12); /* 300 points over 200; round-off */
    assert_near(q.moving, 1.5, 1e-12);
    free(part);
    points_free(&cloud);
}

/* The same body by the library that runs it. */
static void costs_are_families(void **state)
{
    points cloud = graded(3, 7, 6, 5, 0.1, 1.1);
    const pd_cloud c = cloud_of(&cloud);
    const pd_body_options options = options_of(3, RATIO);
    pd_body *body = body_of(&cloud, &options);
    double *cost = malloc(c.n * sizeof *cost);
    assert_ok(pd_partition_costs(&c, cost));
    for (size_t i = 0; i < c.n; i++)
        assert_int_equal((int)cost[i],
                         pd_body_family(body, place_of(body, (pd_global)i), 0, NULL));
    free(cost);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- weights ---- */

/* The left half counts for three times as much: a part of it has a third of the points,
 * in the middle of a long bar. */
static void weights_shift_the_balance(void **state)
{
    points cloud = lattice(2, 200, 10, 1, 1);
    double *weight = malloc(cloud.n * sizeof *weight);
    size_t left = 0;
    for (size_t i = 0; i < cloud.n; i++)
        weight[i] = cloud.X[3 * i] < 100 ? 3 : 1;
    pd_cloud c = cloud_of(&cloud);
    c.weight = weight;
    int *part = partition_of(&c, 2);
    const pd_partition_quality q = quality_of(&c, 2, part);
    assert_true(q.cost <= PD_PARTITION_TOLERANCE);
    /* 3 x = 3 (100 - x) + 100 columns of 200, times ten */
    for (size_t i = 0; i < cloud.n; i++)
        left += part[i] == part[0];
    assert_near((double)left, 200. / 3 * 10, 0.05 * 2000);
    free(part);
    free(weight);
    points_free(&cloud);
}

/* Nine tenths of the bar are held: both parts have their share of the rest. */
static void held_points_cost_nothing(void **state)
{
    points cloud = lattice(2, 200, 20, 1, 1);
    unsigned char *held = malloc(cloud.n);
    int moving[2] = {0};
    for (size_t i = 0; i < cloud.n; i++)
        held[i] = cloud.X[3 * i] > 20;
    pd_cloud c = cloud_of(&cloud);
    c.held = held;
    int *part = partition_of(&c, 2);
    for (size_t i = 0; i < cloud.n; i++)
        moving[part[i]] += !held[i];
    /* At worst one part has all 3600 held points, which cost as much as 140 of the 400
     * moving ones with their 26 bonds: then these are 130 and 270. */
    assert_true(moving[0] > 100 && moving[1] > 100);
    free(part);
    free(held);
    points_free(&cloud);
}

/* ---- few points, many parts ---- */

static void no_part_is_empty(void **state)
{
    for (int n = 1; n <= 40; n++)
        for (int parts = 1; parts <= n; parts++) {
            points cloud = line(n);
            const pd_cloud c = cloud_of(&cloud);
            int *part = partition_of(&c, parts);
            assert_true(quality_of(&c, parts, part).fewest > 0);
            free(part);
            points_free(&cloud);
        }
}

static void more_parts_than_points(void **state)
{
    points cloud = line(5);
    const pd_cloud c = cloud_of(&cloud);
    int *part = partition_of(&c, 12), taken[12] = {0};
    for (int i = 0; i < 5; i++)
        assert_int_equal(taken[part[i]]++, 0);
    free(part);
    points_free(&cloud);
}

static void one_part_is_all(void **state)
{
    points cloud = lattice(3, 5, 4, 3, 1);
    const pd_cloud c = cloud_of(&cloud);
    int *part = partition_of(&c, 1);
    for (size_t i = 0; i < c.n; i++)
        assert_int_equal(part[i], 0);
    free(part);
    points_free(&cloud);
}

/* Two bars that no bond connects, and points without any. */
static void pieces_may_be_apart(void **state)
{
    points cloud = lattice(2, 100, 5, 1, 1);
    for (size_t i = 0; i < cloud.n; i++)
        cloud.X[3 * i] += cloud.X[3 * i] > 50 ? 1e3 : 0;
    assert_balanced(&cloud, 4, 2);
    for (size_t i = 0; i < cloud.n; i++)
        cloud.X[3 * i] *= 100;
    assert_balanced(&cloud, 4, 10);
    points_free(&cloud);
}

static void same_input_same_answer(void **state)
{
    points cloud = lattice(3, 30, 30, 30, 0.1);
    jitter(&cloud, 0.03);
    const pd_cloud c = cloud_of(&cloud);
    int *once = partition_of(&c, 7);
    srand(4711); /* METIS draws numbers */
    int *again = partition_of(&c, 7);
    assert_memory_equal(once, again, c.n * sizeof *once);
    free(once);
    free(again);
    points_free(&cloud);
}

/* ---- any graph ---- */

/* A ring of vertices: all cost 1 of the first kind, only the first tenth of the second.
 */
static void every_cost_is_balanced_by_itself(void **state)
{
    enum { N = 1000 };
    pd_local first[N + 1], neighbour[2 * N];
    double cost[2 * N];
    int part[N];
    for (int v = 0; v < N; v++) {
        first[v] = 2 * v;
        neighbour[2 * v] = (v + 1) % N;
        neighbour[2 * v + 1] = (v + N - 1) % N;
        cost[2 * v] = 1;
        cost[2 * v + 1] = v < N / 10;
    }
    first[N] = 2 * N;
    const double tolerance[] = {1.03, 1.1};
    const pd_graph graph = {N, first, neighbour, 2, cost, tolerance};
    assert_ok(pd_partition_graph(&graph, 4, part));
    int size[4] = {0}, second[4] = {0};
    for (int v = 0; v < N; v++) {
        size[part[v]]++;
        second[part[v]] += v < N / 10;
    }
    for (int p = 0; p < 4; p++) { /* and one vertex, which cannot be split */
        assert_true(size[p] <= 1.03 * N / 4 + 1);
        assert_true(second[p] <= 1.1 * N / 40 + 1);
    }
}

/* ---- errors ---- */

static void assert_refused(const pd_cloud *cloud, int parts, pd_code code,
                           pd_global point, const char *text)
{
    int part[60] = {0};
    const pd_status status = pd_partition(cloud, parts, part);
    assert_int_equal(status.code, code);
    assert_int_equal(status.point, point);
    assert_non_null(strstr(status.message, text));
}

static void bad_input_is_refused(void **state)
{
    points cloud = lattice(3, 5, 4, 3, 1);
    double weight[60] = {[3] = -1};
    pd_cloud c = cloud_of(&cloud);
    assert_refused(&c, 0, PD_BAD_ARGUMENT, -1, "0 parts; allowed: at least 1");
    c.dimension = 4;
    assert_refused(&c, 2, PD_BAD_ARGUMENT, -1, "dimension 4; allowed: 1, 2, 3");
    c = cloud_of(&cloud);
    c.horizon_ratio = 21;
    assert_refused(&c, 2, PD_BAD_ARGUMENT, -1, "horizon ratio 21; allowed");
    c = cloud_of(&cloud);
    c.n = 0;
    assert_refused(&c, 2, PD_BAD_ARGUMENT, -1, "0 points; allowed: 1 to");
    c = cloud_of(&cloud);
    c.weight = weight;
    assert_refused(&c, 2, PD_BAD_ARGUMENT, 3, "weight -1; allowed: at least 0");
    c = cloud_of(&cloud);
    cloud.volume[7] = 0;
    assert_refused(&c, 2, PD_BAD_ARGUMENT, 7, "volume 0; allowed: above 0");
    cloud.volume[7] = 1;
    cloud.X[3 * 9 + 1] = NAN;
    assert_refused(&c, 2, PD_NOT_FINITE, 9, "position");
    points_free(&cloud);
}

static void parts_out_of_range_are_refused(void **state)
{
    points cloud = line(5);
    const pd_cloud c = cloud_of(&cloud);
    const int part[] = {0, 1, 2, 1, 0};
    pd_partition_quality q;
    const pd_status status = pd_partition_measure(&c, 2, part, &q);
    assert_int_equal(status.code, PD_BAD_ARGUMENT);
    assert_int_equal(status.point, 2);
    points_free(&cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(costs_are_balanced),
        cmocka_unit_test(costs_of_clusters_are_balanced),
        cmocka_unit_test(uneven_points_are_balanced),
        cmocka_unit_test(bar_is_cut_across),
        cmocka_unit_test(measure_counts_what_is_cut),
        cmocka_unit_test(costs_are_families),
        cmocka_unit_test(weights_shift_the_balance),
        cmocka_unit_test(held_points_cost_nothing),
        cmocka_unit_test(no_part_is_empty),
        cmocka_unit_test(more_parts_than_points),
        cmocka_unit_test(one_part_is_all),
        cmocka_unit_test(pieces_may_be_apart),
        cmocka_unit_test(same_input_same_answer),
        cmocka_unit_test(every_cost_is_balanced_by_itself),
        cmocka_unit_test(bad_input_is_refused),
        cmocka_unit_test(parts_out_of_range_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
