/*
 * Partition of the graph of bonds, and of any graph, by METIS.
 *
 * The graph of a body has some hundred edges a point, most of which say the same. Of
 * large clouds METIS sees clusters of neighbouring points instead, with the number of
 * bonds between them; clusters are cubes of an octree, so they follow uneven spacings.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "partition.h"

#include <fenv.h>
#include <math.h>
#include <metis.h>
#include <stdlib.h>
#include <string.h>

#include "neighbourhood.h"
#include "status.h"

/* Clouds of fewer points are left to METIS point by point: a second at most. */
#define FEW_POINTS 20000

/* Clusters are made larger until there are so few: some seconds. */
#define MANY_CLUSTERS 250000

/* Clusters that every part has at least, so that one more or less keeps the balance. */
#define CLUSTERS_A_PART 500

/* Sums of weights in METIS's integers, far enough from the largest. */
#define LARGEST_SUM (1 << 29)

/* Below so many vertices a part METIS may leave parts empty, and complains on stdout. */
#define VERTICES_A_PART 4

/* Up to this many parts METIS bisects recursively, which cuts less and balances better.
 */
#define FEW_PARTS 8

/* ---- graphs as METIS wants them ---- */

typedef struct {
    idx_t n, n_costs;
    idx_t *first;     /* [n + 1] */
    idx_t *neighbour; /* [capacity] */
    idx_t *bonds;     /* [capacity] weight of the edges; NULL: 1 each */
    idx_t *cost;      /* [n][n_costs] */
    size_t capacity;
} metis_graph;

static void graph_free(metis_graph *graph)
{
    free(graph->first);
    free(graph->neighbour);
    free(graph->bonds);
    free(graph->cost);
    *graph = (metis_graph){0};
}

/* Costs as integers whose sum is about LARGEST_SUM, or their own where they are small;
 * what costs anything costs 1. */
static void set_costs(metis_graph *graph, const double *cost)
{
    for (idx_t c = 0; c < graph->n_costs; c++) {
        double sum = 0;
        for (idx_t v = 0; v < graph->n; v++)
            sum += cost[v * graph->n_costs + c];
        const double scale = sum > 0 ? (LARGEST_SUM - graph->n) / sum : 0;
        for (idx_t v = 0; v < graph->n; v++) {
            const double value = cost[v * graph->n_costs + c];
            graph->cost[v * graph->n_costs + c] =
                (idx_t)floor(value * scale) + (value > 0 ? 1 : 0);
        }
    }
}

/* Runs of vertices of the same length; METIS is made for many vertices a part. */
static void share_in_order(idx_t n, int parts, int *part)
{
    for (idx_t v = 0; v < n; v++)
        part[v] = parts >= n ? (int)v : (int)((int64_t)v * parts / n);
}

/* Give every empty part a vertex of the part that has most. */
static pd_status fill_empty(idx_t n, int parts, int *part)
{
    idx_t *size = calloc((size_t)parts, sizeof *size);
    if (!size)
        return pd_status_fail(PD_NO_MEMORY, -1, "sizes of %d parts", parts);
    for (idx_t v = 0; v < n; v++)
        size[part[v]]++;
    for (int p = 0; p < parts; p++) {
        if (size[p])
            continue;
        int fullest = 0;
        for (int q = 1; q < parts; q++)
            fullest = size[q] > size[fullest] ? q : fullest;
        idx_t v = 0;
        while (part[v] != fullest)
            v++;
        part[v] = p;
        size[p]++;
        size[fullest]--;
    }
    free(size);
    return pd_status_ok();
}

/* How a partition came out. */
typedef struct {
    double excess; /* cost of a part over what is tolerated, at worst; below 1 is good */
    idx_t cut;
} outcome;

static bool is_better(outcome a, outcome b)
{
    const double excess_a = fmax(a.excess, 1), excess_b = fmax(b.excess, 1);
    return excess_a != excess_b ? excess_a < excess_b : a.cut < b.cut;
}

/* One cost of the parts, summed in sum[parts]. */
static double largest_share(const metis_graph *graph, idx_t c, int parts,
                            const idx_t *part, double *sum)
{
    double whole = 0, largest = 0;
    for (int p = 0; p < parts; p++)
        sum[p] = 0;
    for (idx_t v = 0; v < graph->n; v++)
        sum[part[v]] += graph->cost[v * graph->n_costs + c];
    for (int p = 0; p < parts; p++) {
        whole += sum[p];
        largest = fmax(largest, sum[p]);
    }
    return whole > 0 ? largest * parts / whole : 1;
}

/* METIS by recursive bisection or at once; limits[n_costs] and sum[parts] are for use. */
static pd_status call_metis(metis_graph *graph, bool bisect, const double *tolerance,
                            real_t *limits, double *sum, int parts, idx_t *part,
                            outcome *out)
{
    idx_t options[METIS_NOPTIONS], n_parts = parts;
    METIS_SetDefaultOptions(options);
    options[METIS_OPTION_SEED] = 1;
    options[METIS_OPTION_NUMBERING] = 0;
    /* METIS tolerates that much in every bisection. */
    const double root = bisect ? 1 / ceil(log2(parts)) : 1;
    for (idx_t c = 0; c < graph->n_costs; c++)
        limits[c] = (real_t)pow(tolerance[c], root);
    /* OpenFOAM traps divisions by zero; METIS divides by sums of weights and is right. */
    fenv_t environment;
    feholdexcept(&environment);
    const int status = (bisect ? METIS_PartGraphRecursive : METIS_PartGraphKway)(
        &graph->n, &graph->n_costs, graph->first, graph->neighbour, graph->cost, NULL,
        graph->bonds, &n_parts, NULL, limits, options, &out->cut, part);
    fesetenv(&environment);
    if (status == METIS_ERROR_MEMORY)
        return pd_status_fail(PD_NO_MEMORY, -1, "METIS: a graph of %lld vertices",
                              (long long)graph->n);
    if (status != METIS_OK)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "METIS failed with status %d", status);
    out->excess = 0;
    for (idx_t c = 0; c < graph->n_costs; c++)
        out->excess =
            fmax(out->excess, largest_share(graph, c, parts, part, sum) / tolerance[c]);
    return pd_status_ok();
}

/* The better one of METIS's two ways; the second is not tried where the first will do. */
static pd_status best_of_two(metis_graph *graph, const double *tolerance, real_t *limits,
                             double *sum, int parts, idx_t *other, int *part)
{
    outcome first, second;
    PD_TRY(call_metis(graph, false, tolerance, limits, sum, parts, other, &first));
    for (idx_t v = 0; v < graph->n; v++)
        part[v] = (int)other[v];
    if (parts > FEW_PARTS && first.excess <= 1)
        return pd_status_ok();
    PD_TRY(call_metis(graph, true, tolerance, limits, sum, parts, other, &second));
    for (idx_t v = 0; is_better(second, first) && v < graph->n; v++)
        part[v] = (int)other[v];
    return pd_status_ok();
}

static pd_status share_out(metis_graph *graph, const double *tolerance, int parts,
                           int *part)
{
    if (parts == 1 || graph->n < (int64_t)VERTICES_A_PART * parts) {
        share_in_order(graph->n, parts, part);
        return pd_status_ok();
    }
    idx_t *other = malloc((size_t)graph->n * sizeof *other);
    real_t *limits = malloc((size_t)graph->n_costs * sizeof *limits);
    double *sum = malloc((size_t)parts * sizeof *sum);
    const pd_status status =
        other && limits && sum
            ? best_of_two(graph, tolerance, limits, sum, parts, other, part)
            : pd_status_fail(PD_NO_MEMORY, -1, "partition of %lld vertices",
                             (long long)graph->n);
    free(other);
    free(limits);
    free(sum);
    return status.code == PD_OK ? fill_empty(graph->n, parts, part) : status;
}

static pd_status check_parts(int parts)
{
    if (parts < 1)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "%d parts; allowed: at least 1",
                              parts);
    return pd_status_ok();
}

/* ---- any graph ---- */

static pd_status check_graph(const pd_graph *graph)
{
    if (graph->n < 1 || graph->n_costs < 1)
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "a graph of %d vertices with %d costs; allowed: at least 1",
                              graph->n, graph->n_costs);
    for (int c = 0; c < graph->n_costs; c++)
        if (!(usable(graph->tolerance[c]) && graph->tolerance[c] > 1))
            return pd_status_fail(PD_BAD_ARGUMENT, -1, "tolerance %g; allowed: above 1",
                                  graph->tolerance[c]);
    for (pd_local v = 0; v < graph->n; v++)
        for (int c = 0; c < graph->n_costs; c++) {
            const double cost = graph->cost[(size_t)v * (size_t)graph->n_costs + c];
            if (!(usable(cost) && cost >= 0))
                return pd_status_fail(PD_BAD_ARGUMENT, v, "cost %g; allowed: at least 0",
                                      cost);
        }
    return pd_status_ok();
}

/* Copied: METIS may have been built with integers of another width. */
static pd_status copy_graph(const pd_graph *from, metis_graph *graph)
{
    const size_t n = (size_t)from->n, edges = (size_t)from->first[n];
    graph->n = from->n;
    graph->n_costs = from->n_costs;
    graph->first = malloc((n + 1) * sizeof *graph->first);
    graph->neighbour = malloc((edges ? edges : 1) * sizeof *graph->neighbour);
    graph->cost = malloc(n * (size_t)from->n_costs * sizeof *graph->cost);
    if (!graph->first || !graph->neighbour || !graph->cost)
        return pd_status_fail(PD_NO_MEMORY, -1, "a graph of %zu vertices, %zu edges", n,
                              edges);
    for (size_t v = 0; v <= n; v++)
        graph->first[v] = from->first[v];
    for (size_t e = 0; e < edges; e++)
        graph->neighbour[e] = from->neighbour[e];
    set_costs(graph, from->cost);
    return pd_status_ok();
}

pd_status pd_partition_graph(const pd_graph *graph, int parts, int *part)
{
    PD_TRY(check_parts(parts));
    PD_TRY(check_graph(graph));
    metis_graph copy = {0};
    pd_status status = copy_graph(graph, &copy);
    if (status.code == PD_OK)
        status = share_out(&copy, graph->tolerance, parts, part);
    graph_free(&copy);
    return status;
}

/* ---- points and their neighbours ---- */

typedef struct {
    const pd_cloud *cloud;
    int d;
    pd_local n;
    double *X;       /* [n][d] */
    double *spacing; /* [n] */
    pd_cell_list cells;
    pd_local *near; /* [capacity] neighbours of one point */
    pd_local capacity;
} neighbours;

static pd_status check_cloud(const pd_cloud *cloud)
{
    if (cloud->dimension < 1 || cloud->dimension > 3)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "dimension %d; allowed: 1, 2, 3",
                              cloud->dimension);
    if (!(usable(cloud->horizon_ratio) && cloud->horizon_ratio > 0 &&
          cloud->horizon_ratio <= 20))
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "horizon ratio %g; allowed: above 0, at most 20",
                              cloud->horizon_ratio);
    if (cloud->n < 1 || cloud->n > INT32_MAX / 16)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "%zu points; allowed: 1 to %d",
                              cloud->n, INT32_MAX / 16);
    for (size_t i = 0; i < cloud->n; i++) {
        for (int a = 0; a < cloud->dimension; a++)
            if (!usable(cloud->X[3 * i + (size_t)a]))
                return pd_status_fail(PD_NOT_FINITE, (pd_global)i, "position %g",
                                      cloud->X[3 * i + (size_t)a]);
        if (!(usable(cloud->volume[i]) && cloud->volume[i] > 0))
            return pd_status_fail(PD_BAD_ARGUMENT, (pd_global)i,
                                  "volume %g; allowed: above 0", cloud->volume[i]);
        if (cloud->weight && !(usable(cloud->weight[i]) && cloud->weight[i] >= 0))
            return pd_status_fail(PD_BAD_ARGUMENT, (pd_global)i,
                                  "weight %g; allowed: at least 0", cloud->weight[i]);
    }
    return pd_status_ok();
}

/* Freed by neighbours_free, also after an error. */
static pd_status neighbours_create(const pd_cloud *cloud, neighbours *of)
{
    *of = (neighbours){
        .cloud = cloud, .d = cloud->dimension, .n = (pd_local)cloud->n, .capacity = 512};
    PD_TRY(check_cloud(cloud));
    const size_t n = cloud->n, d = (size_t)of->d;
    of->X = malloc(n * d * sizeof *of->X);
    of->spacing = malloc(n * sizeof *of->spacing);
    of->near = malloc((size_t)of->capacity * sizeof *of->near);
    if (!of->X || !of->spacing || !of->near)
        return pd_status_fail(PD_NO_MEMORY, -1, "partition of %zu points", n);
    for (size_t i = 0; i < n; i++) {
        memcpy(of->X + i * d, cloud->X + 3 * i, d * sizeof *of->X);
        of->spacing[i] = d == 1   ? cloud->volume[i]
                         : d == 2 ? sqrt(cloud->volume[i])
                                  : cbrt(cloud->volume[i]);
    }
    return pd_cell_list_create(of->d, of->n, of->X, of->spacing, cloud->horizon_ratio,
                               &of->cells);
}

static void neighbours_free(neighbours *of)
{
    pd_cell_list_free(&of->cells);
    free(of->X);
    free(of->spacing);
    free(of->near);
    *of = (neighbours){0};
}

/* Fill near with the neighbours of point i. */
static pd_status find_near(neighbours *of, pd_local i, pd_local *count)
{
    *count = pd_cell_list_near(&of->cells, i, of->capacity, of->near);
    if (*count <= of->capacity)
        return pd_status_ok();
    pd_local *longer = realloc(of->near, 2 * (size_t)*count * sizeof *longer);
    if (!longer)
        return pd_status_fail(PD_NO_MEMORY, i, "a family of %d", *count);
    of->near = longer;
    of->capacity = 2 * *count;
    pd_cell_list_near(&of->cells, i, of->capacity, of->near);
    return pd_status_ok();
}

/* Does the bond do anything? */
static bool counts(const pd_cloud *cloud, pd_local i, pd_local j)
{
    return !(cloud->held && cloud->held[i] && cloud->held[j]);
}

/* Of a point whose neighbours stand in near. */
static double cost_of(const neighbours *of, pd_local i, pd_local count)
{
    double bonds = 0;
    for (pd_local k = 0; k < count; k++)
        bonds += counts(of->cloud, i, of->near[k]);
    return fmax(1, bonds * (of->cloud->weight ? of->cloud->weight[i] : 1));
}

/* ---- clusters ---- */

typedef struct {
    uint64_t key; /* bits of the leaf's indices, those of the axes in turn */
    pd_local point;
} keyed;

/* Points [first[c], first[c + 1]) of order make cluster c. */
typedef struct {
    pd_local n;
    keyed *order;    /* [points] */
    pd_local *first; /* [n + 1] */
    pd_local *of;    /* [points] the cluster of a point */
} clusters;

static void clusters_free(clusters *c)
{
    free(c->order);
    free(c->first);
    free(c->of);
    *c = (clusters){0};
}

static int by_key(const void *a, const void *b)
{
    const keyed *s = a, *t = b;
    if (s->key != t->key)
        return s->key < t->key ? -1 : 1;
    return (s->point > t->point) - (s->point < t->point);
}

/* Number the leaves of an octree over the points, each `side` of the smallest spacing
 * wide unless that is too many; returns the levels. */
static int number_leaves(const neighbours *from, int side, keyed *order)
{
    const int d = from->d, most = 60 / d;
    double low[3] = {0}, extent = 0, smallest = HUGE_VAL;
    for (pd_local i = 0; i < from->n; i++)
        smallest = fmin(smallest, from->spacing[i]);
    for (int a = 0; a < d; a++) {
        double high = -HUGE_VAL;
        low[a] = HUGE_VAL;
        for (pd_local i = 0; i < from->n; i++) {
            low[a] = fmin(low[a], from->X[(size_t)i * (size_t)d + (size_t)a]);
            high = fmax(high, from->X[(size_t)i * (size_t)d + (size_t)a]);
        }
        low[a] -= smallest / 2; /* the points of a lattice stand between walls */
        extent = fmax(extent, high - low[a]);
    }
    double leaf = side * smallest;
    int levels = 0;
    while (ldexp(leaf, levels) <= extent)
        if (levels < most)
            levels++;
        else
            leaf *= 2;
    for (pd_local i = 0; i < from->n; i++) {
        uint64_t key = 0;
        for (int a = 0; a < d; a++) {
            const uint64_t index =
                (uint64_t)((from->X[(size_t)i * (size_t)d + (size_t)a] - low[a]) / leaf);
            for (int bit = 0; bit < levels; bit++)
                key |= (index >> bit & 1) << (bit * d + a);
        }
        order[i] = (keyed){key, i};
    }
    return levels;
}

/* Cut points [from, to), which share all bits from `shift` on, into cubes of at most
 * `capacity` points. */
static void divide(clusters *c, pd_local from, pd_local to, int shift, int d,
                   pd_local capacity)
{
    if (to - from <= capacity || shift == 0) {
        c->first[++c->n] = to;
        return;
    }
    shift -= d;
    while (from < to) {
        pd_local end = from + 1;
        while (end < to && c->order[end].key >> shift == c->order[from].key >> shift)
            end++;
        divide(c, from, end, shift, d, capacity);
        from = end;
    }
}

/* Freed by clusters_free, also after an error. */
static pd_status clusters_create(const neighbours *from, int side, clusters *c)
{
    const size_t n = (size_t)from->n;
    *c = (clusters){.order = malloc(n * sizeof *c->order),
                    .first = calloc(n + 1, sizeof *c->first),
                    .of = malloc(n * sizeof *c->of)};
    if (!c->order || !c->first || !c->of)
        return pd_status_fail(PD_NO_MEMORY, -1, "clusters of %zu points", n);
    const int levels = number_leaves(from, side, c->order);
    qsort(c->order, n, sizeof *c->order, by_key);
    const int capacity = side == 1 ? 1 : (int)lround(pow(side, from->d));
    divide(c, 0, from->n, levels * from->d, from->d, capacity);
    for (pd_local k = 0; k < c->n; k++)
        for (pd_local i = c->first[k]; i < c->first[k + 1]; i++)
            c->of[c->order[i].point] = k;
    return pd_status_ok();
}

/* ---- the graph of clusters ---- */

static pd_status make_room(metis_graph *graph, size_t edges)
{
    if (edges <= graph->capacity)
        return pd_status_ok();
    const size_t capacity = 2 * edges + 1024;
    idx_t *neighbour = realloc(graph->neighbour, capacity * sizeof *neighbour);
    graph->neighbour = neighbour ? neighbour : graph->neighbour;
    idx_t *bonds = realloc(graph->bonds, capacity * sizeof *bonds);
    graph->bonds = bonds ? bonds : graph->bonds;
    if (!neighbour || !bonds)
        return pd_status_fail(PD_NO_MEMORY, -1, "a graph of %zu edges", edges);
    graph->capacity = capacity;
    return pd_status_ok();
}

/* Add the bonds of a point of cluster k to the row that begins at first[k]; place[n]:
 * where in that row a cluster stands. */
static pd_status add_bonds(metis_graph *graph, idx_t k, const clusters *c,
                           const neighbours *of, pd_local i, pd_local count,
                           int64_t *place, size_t *edges)
{
    PD_TRY(make_room(graph, *edges + (size_t)count));
    for (pd_local b = 0; b < count; b++) {
        const pd_local other = c->of[of->near[b]];
        if (other == k)
            continue;
        if (place[other] < graph->first[k]) {
            place[other] = (int64_t)*edges;
            graph->neighbour[*edges] = other;
            graph->bonds[*edges] = 0;
            ++*edges;
        }
        graph->bonds[place[other]] += counts(of->cloud, i, of->near[b]);
    }
    return pd_status_ok();
}

/* Points inside a hold stay with those beside them: an edge weighs at least 1. */
static void limit_bonds(metis_graph *graph)
{
    const idx_t edges = graph->first[graph->n];
    double sum = 0;
    for (idx_t e = 0; e < edges; e++)
        sum += (double)graph->bonds[e];
    const double scale = sum > LARGEST_SUM ? LARGEST_SUM / sum : 1;
    for (idx_t e = 0; e < edges; e++) {
        graph->bonds[e] = (idx_t)((double)graph->bonds[e] * scale);
        graph->bonds[e] = graph->bonds[e] > 1 ? graph->bonds[e] : 1;
    }
}

static pd_status fill_rows(neighbours *of, const clusters *c, int64_t *place,
                           double *cost, metis_graph *graph)
{
    size_t edges = 0;
    for (pd_local k = 0; k < c->n; k++)
        place[k] = -1;
    for (pd_local k = 0; k < c->n; k++) {
        graph->first[k] = (idx_t)edges;
        cost[k] = 0;
        for (pd_local m = c->first[k]; m < c->first[k + 1]; m++) {
            const pd_local i = c->order[m].point;
            pd_local count = 0;
            PD_TRY(find_near(of, i, &count));
            cost[k] += cost_of(of, i, count);
            PD_TRY(add_bonds(graph, k, c, of, i, count, place, &edges));
        }
        if (edges > (size_t)IDX_MAX)
            return pd_status_fail(PD_BAD_ARGUMENT, -1,
                                  "the graph of %d points in clusters of %d has more "
                                  "edges than METIS can number, %lld; allowed: larger "
                                  "clusters",
                                  of->n, c->first[1], (long long)IDX_MAX);
    }
    graph->first[c->n] = (idx_t)edges;
    return pd_status_ok();
}

static pd_status cluster_graph(neighbours *of, const clusters *c, metis_graph *graph)
{
    const size_t n = (size_t)c->n;
    graph->n = c->n;
    graph->n_costs = 1;
    graph->first = malloc((n + 1) * sizeof *graph->first);
    graph->cost = malloc(n * sizeof *graph->cost);
    int64_t *place = malloc(n * sizeof *place);
    double *cost = malloc(n * sizeof *cost);
    pd_status status = pd_status_ok();
    if (!graph->first || !graph->cost || !place || !cost)
        status = pd_status_fail(PD_NO_MEMORY, -1, "a graph of %zu clusters", n);
    else
        status = fill_rows(of, c, place, cost, graph);
    if (status.code == PD_OK) {
        set_costs(graph, cost);
        limit_bonds(graph);
    }
    free(place);
    free(cost);
    return status;
}

/* ---- partition ---- */

int pd_partition_side(const pd_cloud *cloud, int parts)
{
    int side = 1;
    if (cloud->n <= FEW_POINTS)
        return side;
    /* Beyond the horizon's width they only coarsen the answer. */
    while (
        side + 1 <= cloud->horizon_ratio &&
        (side == 1 || (double)cloud->n > MANY_CLUSTERS * pow(side, cloud->dimension)) &&
        (double)cloud->n >=
            (double)CLUSTERS_A_PART * parts * pow(side + 1, cloud->dimension))
        side++;
    return side;
}

static pd_status partition(neighbours *of, int side, int parts, clusters *c,
                           metis_graph *graph, int *part)
{
    PD_TRY(clusters_create(of, side, c));
    PD_TRY(cluster_graph(of, c, graph));
    int *answer = malloc((size_t)c->n * sizeof *answer);
    if (!answer)
        return pd_status_fail(PD_NO_MEMORY, -1, "partition of %d clusters", c->n);
    const double tolerance = PD_PARTITION_TOLERANCE;
    const pd_status status = share_out(graph, &tolerance, parts, answer);
    for (pd_local i = 0; status.code == PD_OK && i < of->n; i++)
        part[i] = answer[c->of[i]];
    free(answer);
    return status;
}

pd_status pd_partition_clustered(const pd_cloud *cloud, int side, int parts, int *part)
{
    PD_TRY(check_parts(parts));
    neighbours of = {0};
    clusters c = {0};
    metis_graph graph = {0};
    pd_status status = neighbours_create(cloud, &of);
    if (status.code == PD_OK && parts == 1)
        memset(part, 0, cloud->n * sizeof *part);
    else if (status.code == PD_OK)
        status = partition(&of, side, parts, &c, &graph, part);
    graph_free(&graph);
    clusters_free(&c);
    neighbours_free(&of);
    return status;
}

pd_status pd_partition(const pd_cloud *cloud, int parts, int *part)
{
    return pd_partition_clustered(cloud, pd_partition_side(cloud, parts), parts, part);
}

/* ---- what it costs ---- */

pd_status pd_partition_costs(const pd_cloud *cloud, double *cost)
{
    neighbours of = {0};
    pd_status status = neighbours_create(cloud, &of);
    for (pd_local i = 0; status.code == PD_OK && i < of.n; i++) {
        pd_local count = 0;
        status = find_near(&of, i, &count);
        if (status.code == PD_OK)
            cost[i] = cost_of(&of, i, count);
    }
    neighbours_free(&of);
    return status;
}

/* Sums over parts, zero before. */
typedef struct {
    double *points, *moving, *cost; /* [parts] */
} sums;

static pd_status add_up(neighbours *of, const int *part, const sums *sum,
                        pd_partition_quality *q)
{
    for (pd_local i = 0; i < of->n; i++) {
        pd_local count = 0;
        PD_TRY(find_near(of, i, &count));
        sum->points[part[i]]++;
        sum->moving[part[i]] += !(of->cloud->held && of->cloud->held[i]);
        sum->cost[part[i]] += cost_of(of, i, count);
        for (pd_local k = 0; k < count; k++)
            if (of->near[k] > i && counts(of->cloud, i, of->near[k])) {
                q->bonds++;
                q->cut += part[i] != part[of->near[k]];
            }
    }
    return pd_status_ok();
}

static double largest_over_mean(int n, const double *values)
{
    double sum = 0, largest = 0;
    for (int k = 0; k < n; k++) {
        sum += values[k];
        largest = fmax(largest, values[k]);
    }
    return sum > 0 ? largest * n / sum : 1;
}

static pd_status check_labels(size_t n, int parts, const int *part)
{
    for (size_t i = 0; i < n; i++)
        if (part[i] < 0 || part[i] >= parts)
            return pd_status_fail(PD_BAD_ARGUMENT, (pd_global)i,
                                  "part %d; allowed: 0 to %d", part[i], parts - 1);
    return pd_status_ok();
}

pd_status pd_partition_measure(const pd_cloud *cloud, int parts, const int *part,
                               pd_partition_quality *quality)
{
    *quality = (pd_partition_quality){0};
    PD_TRY(check_parts(parts));
    PD_TRY(check_labels(cloud->n, parts, part));
    neighbours of = {0};
    double *values = calloc(3 * (size_t)parts, sizeof *values);
    pd_status status = values
                           ? neighbours_create(cloud, &of)
                           : pd_status_fail(PD_NO_MEMORY, -1, "sums of %d parts", parts);
    const sums sum = {values, values ? values + parts : NULL,
                      values ? values + 2 * (size_t)parts : NULL};
    if (status.code == PD_OK)
        status = add_up(&of, part, &sum, quality);
    if (status.code == PD_OK) {
        quality->points = largest_over_mean(parts, sum.points);
        quality->moving = largest_over_mean(parts, sum.moving);
        quality->cost = largest_over_mean(parts, sum.cost);
        double fewest = sum.points[0];
        for (int p = 1; p < parts; p++)
            fewest = fmin(fewest, sum.points[p]);
        quality->fewest = (size_t)fewest;
    }
    free(values);
    neighbours_free(&of);
    return status;
}
