/*
 * Finding and filling a lattice.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "lattice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "body.h"
#include "status.h"
#include "tensor.h"

/* Points stand on the lattice when they are this close to it, in steps: what a mesh file
 * of seven digits keeps. Volumes likewise. */
#define TOLERANCE 1e-4

/* ---- is it one? ---- */

/* Box of owned points of all ranks, their mean volume, and how many there are. */
typedef struct {
    double low[3], high[3], mean, n;
} extent;

static extent measure(MPI_Comm comm, int d, const pd_part *c)
{
    double total[2] = {0, c->n_owned}, most[6];
    for (int a = 0; a < 6; a++)
        most[a] = -HUGE_VAL;
    for (pd_local i = 0; i < c->n_owned; i++) {
        total[0] += c->volume[i];
        for (int a = 0; a < d; a++) {
            const double X = c->X[3 * (size_t)i + (size_t)a];
            most[a] = fmax(most[a], -X);
            most[3 + a] = fmax(most[3 + a], X);
        }
    }
    pd_sum_all(comm, total, 2);
    pd_largest_all(comm, most, 6);
    extent e = {.mean = total[0] / total[1], .n = total[1]};
    for (int a = 0; a < d; a++)
        e.low[a] = -most[a], e.high[a] = most[3 + a];
    return e;
}

/* Origin and step; false when the points cannot be a lattice. */
static bool span(pd_lattice *l, const extent *e)
{
    const double guess = l->d == 1 ? e->mean : l->d == 2 ? sqrt(e->mean) : cbrt(e->mean);
    double widest = 0;
    l->step = guess;
    for (int a = 0; a < l->d; a++) {
        l->origin[a] = e->low[a];
        const double steps = (e->high[a] - e->low[a]) / guess;
        if (!(steps < 1e6))
            return false;
        if (steps > widest) {
            widest = steps;
            if (steps >= 0.5)
                l->step = (e->high[a] - e->low[a]) / floor(steps + 0.5);
        }
    }
    return fabs(l->step - guess) <= TOLERANCE * guess;
}

static void index_of(const pd_lattice *l, const double *X, int64_t *index)
{
    for (int a = 0; a < l->d; a++)
        index[a] = (int64_t)floor((X[a] - l->origin[a]) / l->step + 0.5);
}

void pd_lattice_index(const pd_lattice *l, const double *X, int64_t *index)
{
    index_of(l, X, index);
    for (int a = 0; a < l->d; a++)
        index[a] -= l->low[a];
}

void pd_lattice_place(const pd_lattice *l, double *X)
{
    int64_t index[3];
    index_of(l, X, index);
    for (int a = 0; a < l->d; a++)
        X[a] = l->origin[a] + (double)index[a] * l->step;
}

/* Do the points of this rank, ghosts too, stand on it? Finds their box. */
static bool all_stand_on_it(pd_lattice *l, double mean, const pd_part *c)
{
    int64_t high[3] = {0};
    for (pd_local i = 0; i < c->n; i++) {
        const double *X = c->X + 3 * (size_t)i;
        int64_t index[3] = {0};
        index_of(l, X, index);
        if (fabs(c->volume[i] - mean) > TOLERANCE * mean)
            return false;
        for (int a = 0; a < l->d; a++) {
            const double there = l->origin[a] + (double)index[a] * l->step;
            if (fabs(X[a] - there) > TOLERANCE * l->step)
                return false;
            l->low[a] = i == 0 || index[a] < l->low[a] ? index[a] : l->low[a];
            high[a] = i == 0 || index[a] > high[a] ? index[a] : high[a];
        }
    }
    for (int a = 0; a < 3; a++)
        l->count[a] = a < l->d ? high[a] - l->low[a] + 1 : 1;
    return true;
}

/* Is some place of the lattice taken twice? */
static pd_status find_double(const pd_lattice *l, const pd_part *c, bool *found)
{
    const size_t places = (size_t)(l->count[0] * l->count[1] * l->count[2]);
    unsigned char *taken = calloc(places, 1);
    if (!taken)
        return pd_status_fail(PD_NO_MEMORY, -1, "a lattice of %zu places", places);
    for (pd_local i = 0; i < c->n; i++) {
        int64_t index[3] = {0};
        pd_lattice_index(l, c->X + 3 * (size_t)i, index);
        unsigned char *here =
            &taken[(index[2] * l->count[1] + index[1]) * l->count[0] + index[0]];
        *found |= *here;
        *here = 1;
    }
    free(taken);
    return pd_status_ok();
}

/* ---- offsets ---- */

/* Offsets within the horizon, by plane, row and place; with offset == NULL they are only
 * counted. */
static int list_offsets(const pd_lattice *l, double ratio, pd_offset *offset)
{
    const int r = l->reach, ry = l->d > 1 ? r : 0, rz = l->d > 2 ? r : 0;
    int n = 0;
    for (int z = -rz; z <= rz; z++)
        for (int y = -ry; y <= ry; y++)
            for (int x = -r; x <= r; x++) {
                const int square = x * x + y * y + z * z;
                if (square == 0 || square > ratio * ratio)
                    continue;
                if (offset) {
                    const int slow = l->d == 3 ? z : l->d == 2 ? y : 0;
                    const int row = l->d == 3 ? y : 0;
                    offset[n] = (pd_offset){
                        .plane = slow + (l->d > 1 ? r : 0),
                        .cell = (int32_t)(row * l->row) + x,
                        .rows = row,
                        .along = x,
                        .xi = {x * l->step, y * l->step, z * l->step},
                        .length = sqrt(square) * l->step,
                        .inverse = 1 / (sqrt(square) * l->step),
                    };
                }
                n++;
            }
    return n;
}

/* Bits of the axes along which an offset goes. */
static int axes_of(const pd_offset *o)
{
    int axes = 0;
    for (int a = 0; a < 3; a++)
        axes |= o->xi[a] != 0 ? 1 << a : 0;
    return axes;
}

/* By plane, then by axes, then as they are. */
static int in_order(const void *one, const void *two)
{
    const pd_offset *a = one, *b = two;
    if (a->plane != b->plane)
        return a->plane - b->plane;
    if (axes_of(a) != axes_of(b))
        return axes_of(a) - axes_of(b);
    return a->cell - b->cell;
}

/* The mirrored half of the offsets is the first half, mirrored and backwards. */
static void order_offsets(pd_lattice *l)
{
    const int half = l->n_offsets / 2;
    qsort(l->offset, (size_t)half, sizeof *l->offset, in_order);
    for (int k = 0; k < half; k++) {
        pd_offset *o = &l->offset[l->n_offsets - 1 - k];
        *o = l->offset[k];
        o->plane = 2 * (l->d > 1 ? l->reach : 0) - o->plane;
        o->cell = -o->cell;
        o->rows = -o->rows;
        o->along = -o->along;
        for (int a = 0; a < 3; a++)
            o->xi[a] = -o->xi[a];
    }
}

static void list_runs(pd_lattice *l)
{
    int n = 0, plane = 0;
    for (int k = 0; k < l->n_offsets; k++) {
        const pd_offset *o = &l->offset[k];
        const int axes = axes_of(o);
        if (n == 0 || k == l->n_offsets / 2 || o[-1].plane != o->plane ||
            l->run[n - 1].axes != axes)
            l->run[n++] = (pd_run){.axes = axes, .first = k};
        l->run[n - 1].end = k + 1;
        while (plane <= o->plane)
            l->runs_of[plane++] = n - 1;
    }
    while (plane < 2 * PD_MOST_REACH + 2)
        l->runs_of[plane++] = n;
}

static void list_folds(pd_lattice *l)
{
    int n = 0, plane = 0;
    for (int k = 0; k < l->n_offsets; k++) {
        const pd_offset *o = &l->offset[k];
        while (plane <= o->plane)
            l->folds_of[plane++] = n;
        if (o->along >= 0)
            l->fold[n++] = (pd_fold){o->rows, o->along, k};
    }
    while (plane < 2 * PD_MOST_REACH + 2)
        l->folds_of[plane++] = n;
}

/* Cells before the first of a row: whole vectors. */
static int64_t margin(const pd_lattice *l)
{
    return (l->reach + PD_LANES - 1) / PD_LANES * PD_LANES;
}

/* Cells of the padded box: a chunk at the end of a row may look a vector further. A row
 * is an odd number of cache lines: rows a power of two apart would meet in the same few.
 */
static void lay_out(pd_lattice *l)
{
    const int64_t lines = (margin(l) + l->count[0] + l->reach) / PD_LANES + 2;
    l->row = PD_LANES * (lines | 1);
    l->plane = l->d == 3 ? l->row * (l->count[1] + 2 * l->reach) : l->row;
    l->planes = l->d == 1 ? 1 : l->count[l->d - 1];
}

/* Is this rank's part of the lattice one that is worth having? */
static pd_status judge(const pd_body_options *o, const extent *e, const pd_part *c,
                       pd_lattice *l, bool *good)
{
    *good = false;
    if (!span(l, e) || !all_stand_on_it(l, e->mean, c))
        return pd_status_ok();
    l->reach = (int)o->horizon_ratio;
    lay_out(l);
    l->n_offsets = list_offsets(l, o->horizon_ratio, NULL);
    /* A hollow body would drag an empty box along. */
    if (l->n_offsets < 1 || l->reach > PD_MOST_REACH || l->n_offsets > PD_MOST_OFFSETS ||
        (double)l->plane * (double)l->planes > 8. * c->n + 65536 ||
        l->plane > INT32_MAX / 2)
        return pd_status_ok();
    bool shared = false;
    PD_TRY(find_double(l, c, &shared));
    *good = !shared;
    return pd_status_ok();
}

static pd_status list_all_offsets(const pd_body_options *o, pd_lattice *l)
{
    const size_t n = (size_t)l->n_offsets;
    l->offset = malloc(n * sizeof *l->offset);
    l->run = malloc(n * sizeof *l->run);
    l->fold = malloc(n * sizeof *l->fold);
    if (!l->offset || !l->run || !l->fold)
        return pd_status_fail(PD_NO_MEMORY, -1, "a lattice");
    list_offsets(l, o->horizon_ratio, l->offset);
    order_offsets(l);
    list_runs(l);
    list_folds(l);
    return pd_status_ok();
}

pd_status pd_lattice_find(MPI_Comm comm, const pd_body_options *o, const pd_part *c,
                          pd_lattice **lattice)
{
    *lattice = NULL;
    if (o->general || !o->formulation->has_lattice_path)
        return pd_status_ok();
    const extent e = measure(comm, o->dimension, c);
    if (e.n < 2)
        return pd_status_ok();
    bool good = true;
    pd_status status = pd_status_ok();
    pd_lattice *l = calloc(1, sizeof *l);
    if (!l)
        status = pd_status_fail(PD_NO_MEMORY, -1, "a lattice");
    else
        l->d = o->dimension;
    if (l && c->n > 0)
        status = judge(o, &e, c, l, &good);
    int64_t against = !good;
    status = pd_agree(comm, status);
    pd_count_all(comm, &against, 1);
    if (status.code == PD_OK && against == 0 && c->n > 0) {
        status = list_all_offsets(o, l);
        if (status.code == PD_OK)
            *lattice = l;
    }
    if (!*lattice)
        pd_lattice_free(l);
    return pd_agree(comm, status);
}

static void forget_weights(pd_chunk *c)
{
    free(c->bonds);
    free(c->weight);
    c->bonds = NULL;
    c->weight = NULL;
}

static void free_chunks(pd_chunks *chunks, int64_t planes)
{
    if (chunks->first && chunks->chunk && planes > 0)
        for (int64_t k = 0; k < chunks->first[planes]; k++)
            forget_weights(&chunks->chunk[k]);
    free(chunks->chunk);
    free(chunks->first);
}

void pd_lattice_free(pd_lattice *l)
{
    if (!l)
        return;
    free_chunks(&l->regular, l->planes);
    free_chunks(&l->other, l->planes);
    free(l->offset);
    free(l->run);
    free(l->fold);
    free(l->column);
    free(l->column_of);
    free(l->at);
    free(l->broken);
    free(l);
}

/* ---- chunks ---- */

/* Plane and cell of a point within the padded box. */
static int64_t cell_of(const pd_lattice *l, const double *X, int32_t *cell)
{
    int64_t index[3] = {0};
    pd_lattice_index(l, X, index);
    *cell = (int32_t)(index[0] + margin(l));
    if (l->d == 3)
        *cell += (int32_t)(l->row * (index[1] + l->reach));
    return l->d == 1 ? 0 : index[l->d - 1];
}

static pd_chunk chunk_at(const pd_lattice *l, pd_local p, int32_t cell)
{
    return (pd_chunk){.point = p,
                      .cell = cell,
                      .row = (int32_t)(cell / l->row),
                      .x = (int32_t)(cell % l->row),
                      .count = 1};
}

/* Place of a point in the order of planes and cells. */
static int64_t place_of(const pd_lattice *l, const pd_body *b, pd_local p)
{
    int32_t cell;
    const int64_t plane = cell_of(l, b->X + (size_t)p * (size_t)l->d, &cell);
    return plane * l->plane + cell;
}

/* Regular points in order of their cells: owned ones and near ghosts are so each. */
static size_t order_regular(const pd_body *b, pd_local *order)
{
    const pd_lattice *l = b->lattice;
    pd_local p = 0, g = b->n_owned;
    size_t n = 0;
    while (p < b->n_regular || g < b->near.regular) {
        const bool ghost = p == b->n_regular ||
                           (g < b->near.regular && place_of(l, b, g) < place_of(l, b, p));
        order[n++] = ghost ? g++ : p++;
    }
    return n;
}

typedef struct {
    int64_t place;
    pd_local point;
} placed;

static int by_cell(const void *one, const void *two)
{
    const placed *a = one, *b = two;
    return (a->place > b->place) - (a->place < b->place);
}

/* The other points that regular ones may have for neighbours, likewise. */
static pd_status order_others(const pd_body *b, pd_local *order, size_t *n)
{
    placed *places = malloc((size_t)(b->n_local - b->n_regular + 1) * sizeof *places);
    if (!places)
        return pd_status_fail(PD_NO_MEMORY, -1, "%d points", b->n_local);
    *n = 0;
    for (pd_local p = b->n_regular; p < b->n_local; p++)
        if (!is_regular(b, p) && keeps_family(b, p))
            places[(*n)++] = (placed){place_of(b->lattice, b, p), p};
    qsort(places, *n, sizeof *places, by_cell);
    for (size_t k = 0; k < *n; k++)
        order[k] = places[k].point;
    free(places);
    return pd_status_ok();
}

/* Append point p to the last chunk, if it is next to that, or as a chunk of its own. */
static void append_point(const pd_lattice *l, const pd_body *b, pd_local p,
                         pd_chunks *chunks, int64_t *n)
{
    const int64_t place = place_of(l, b, p), plane = place / l->plane;
    const int32_t cell = (int32_t)(place % l->plane);
    pd_chunk *last = *n > chunks->first[plane] ? &chunks->chunk[*n - 1] : NULL;
    const bool is_ghost = p >= b->n_owned;
    if (last && last->count < PD_LANES && cell == last->cell + last->count &&
        p == last->point + last->count && is_ghost == last->is_ghost) {
        last->count++;
        return;
    }
    chunks->chunk[*n] = chunk_at(l, p, cell);
    chunks->chunk[(*n)++].is_ghost = is_ghost;
}

/* Chunks of points in order of their cells. */
static pd_status chunk_points(pd_body *b, const pd_local *order, size_t count,
                              pd_chunks *chunks)
{
    pd_lattice *l = b->lattice;
    chunks->first = calloc((size_t)l->planes + 1, sizeof *chunks->first);
    chunks->chunk = malloc((count + 1) * sizeof *chunks->chunk);
    if (!chunks->first || !chunks->chunk)
        return pd_status_fail(PD_NO_MEMORY, -1, "%zu points", count);
    int64_t n = 0, at = 0;
    for (size_t k = 0; k < count; k++) {
        const int64_t place = place_of(l, b, order[k]);
        while (at < place / l->plane)
            chunks->first[++at] = n;
        append_point(l, b, order[k], chunks, &n);
        l->at[place] = order[k];
    }
    while (at < l->planes)
        chunks->first[++at] = n;
    pd_chunk *fitted = realloc(chunks->chunk, ((size_t)n + 1) * sizeof *chunks->chunk);
    if (fitted)
        chunks->chunk = fitted;
    return pd_status_ok();
}

/* By x, then by row. */
static int by_column(const void *one, const void *two)
{
    const pd_chunk *a = *(pd_chunk *const *)one, *b = *(pd_chunk *const *)two;
    return a->x != b->x ? (a->x > b->x) - (a->x < b->x)
                        : (a->row > b->row) - (a->row < b->row);
}

static pd_status order_by_column(pd_lattice *l)
{
    const pd_chunks *chunks = &l->regular;
    const size_t n = (size_t)chunks->first[l->planes];
    const pd_chunk **order = malloc((n + 1) * sizeof *order);
    l->column = malloc((n + 1) * sizeof *l->column);
    l->column_of = calloc((size_t)l->planes + 1, sizeof *l->column_of);
    if (!order || !l->column || !l->column_of) {
        free(order);
        return pd_status_fail(PD_NO_MEMORY, -1, "%zu chunks", n);
    }
    for (int64_t z = 0; z < l->planes; z++) {
        int64_t end = l->column_of[z];
        for (int64_t m = chunks->first[z]; m < chunks->first[z + 1]; m++)
            if (!chunks->chunk[m].is_ghost)
                order[end++] = &chunks->chunk[m];
        qsort(order + l->column_of[z], (size_t)(end - l->column_of[z]), sizeof *order,
              by_column);
        l->column_of[z + 1] = end;
    }
    for (int64_t m = 0; m < l->column_of[l->planes]; m++)
        l->column[m] = (int32_t)(order[m] - chunks->chunk);
    free(order);
    return pd_status_ok();
}

pd_local pd_lattice_neighbour(const pd_lattice *l, int64_t z, const pd_chunk *c, int q,
                              const pd_offset *o)
{
    const int64_t plane = z + o->plane - (l->d > 1 ? l->reach : 0);
    if (plane < 0 || plane >= l->planes)
        return -1;
    return l->at[plane * l->plane + c->cell + q + o->cell];
}

/* Is Q of its neighbours read from where points keep it? */
static bool reads_kept(const pd_body *b, pd_local j)
{
    return (j >= b->n_regular && j < b->n_active) ||
           (j >= b->near.regular && j < b->near.active);
}

static void mark_exports(pd_body *b)
{
    const pd_lattice *l = b->lattice;
    for (int64_t z = 0; z < l->planes; z++)
        for (int64_t m = l->regular.first[z]; m < l->regular.first[z + 1]; m++) {
            pd_chunk *c = &l->regular.chunk[m];
            for (int q = 0; q < c->count; q++)
                for (int k = 0; k < l->n_offsets && !c->exports; k++)
                    c->exports =
                        reads_kept(b, pd_lattice_neighbour(l, z, c, q, &l->offset[k]));
        }
}

/* Which planes have ghosts, and the longest run of planes far from them. */
static pd_status find_ghosts(pd_body *b)
{
    pd_lattice *l = b->lattice;
    const int64_t reach = l->d > 1 ? l->reach : 0;
    bool *has = calloc((size_t)l->planes + 1, sizeof *has);
    if (!has)
        return pd_status_fail(PD_NO_MEMORY, -1, "%lld planes", (long long)l->planes);
    for (pd_local p = b->n_owned; p < b->n_local; p++)
        has[place_of(l, b, p) / l->plane] = true;
    l->ghosts_from = 0;
    while (l->ghosts_from < l->planes && !has[l->ghosts_from])
        l->ghosts_from++;
    has[l->planes] = true; /* the end is no neighbour, but ends a run */
    for (int64_t z = 0, from = 0; z <= l->planes; z++) {
        if (!has[z])
            continue;
        const int64_t first = from > 0 ? from + reach : 0;
        const int64_t end = z < l->planes ? z - reach : z;
        if (end - first > l->clear_to - l->clear)
            l->clear = first, l->clear_to = end;
        from = z + 1;
    }
    free(has);
    return pd_status_ok();
}

pd_status pd_lattice_fill(pd_body *b)
{
    pd_lattice *l = b->lattice;
    const size_t cells = (size_t)(l->plane * l->planes);
    l->at = malloc(cells * sizeof *l->at);
    pd_local *order = malloc(((size_t)b->n_local + 1) * sizeof *order);
    pd_status status = pd_status_ok();
    if (!l->at || !order)
        status = pd_status_fail(PD_NO_MEMORY, -1, "a lattice of %zu cells", cells);
    else
        memset(l->at, -1, cells * sizeof *l->at);
    size_t others = 0;
    if (status.code == PD_OK)
        status = chunk_points(b, order, order_regular(b, order), &l->regular);
    if (status.code == PD_OK)
        status = order_others(b, order, &others);
    if (status.code == PD_OK)
        status = chunk_points(b, order, others, &l->other);
    free(order);
    PD_TRY(status);
    PD_TRY(order_by_column(l));
    if (others > 0)
        mark_exports(b);
    return find_ghosts(b);
}

pd_chunk *pd_lattice_chunk(const pd_body *b, pd_local i)
{
    const pd_lattice *l = b->lattice;
    const int64_t place = place_of(l, b, i), plane = place / l->plane;
    const int32_t cell = (int32_t)(place % l->plane);
    int64_t low = l->regular.first[plane], high = l->regular.first[plane + 1];
    while (high - low > 1) {
        const int64_t middle = (low + high) / 2;
        if (l->regular.chunk[middle].cell <= cell)
            low = middle;
        else
            high = middle;
    }
    return &l->regular.chunk[low];
}

pd_local pd_lattice_family(const pd_body *b, pd_local i, pd_local *neighbour,
                           short *offset)
{
    const pd_lattice *l = b->lattice;
    int32_t cell;
    const int64_t z = cell_of(l, b->X + (size_t)i * (size_t)l->d, &cell);
    const pd_chunk here = {.cell = cell};
    pd_local n = 0;
    for (int k = 0; k < l->n_offsets; k++) {
        const pd_local j = pd_lattice_neighbour(l, z, &here, 0, &l->offset[k]);
        if (j < 0)
            continue;
        neighbour[n] = j;
        offset[n++] = (short)k;
    }
    return n;
}

/* ---- weights ---- */

static pd_status no_memory(const pd_lattice *l)
{
    return pd_status_fail(PD_NO_MEMORY, -1, "%d bonds of a chunk", l->n_offsets);
}

pd_status pd_lattice_cut(pd_lattice *l, pd_chunk *c, int lane, int k)
{
    if (c->weight) {
        c->weight[k * PD_LANES + lane] = 0;
        return pd_status_ok();
    }
    if (!c->bonds) {
        c->bonds = malloc((size_t)l->n_offsets);
        if (!c->bonds)
            return no_memory(l);
        memset(c->bonds, 0xff, (size_t)l->n_offsets);
    }
    c->bonds[k] &= (unsigned char)~(1u << lane);
    return pd_status_ok();
}

/* What a chunk has to keep. */
enum { NOTHING, BONDS, WEIGHTS };

/* Weights of one chunk, and its bonds as bits. */
static int weigh_chunk(const pd_body *b, int64_t z, const pd_chunk *c, pd_weigh *weigh,
                       const void *context, double *weight, unsigned char *bonds)
{
    const pd_lattice *l = b->lattice;
    int keep = NOTHING;
    memset(bonds, 0, (size_t)l->n_offsets);
    for (int k = 0; k < l->n_offsets; k++)
        for (int q = 0; q < PD_LANES; q++) {
            const double common = l->offset[k].weight;
            double *w = weight + k * PD_LANES + q;
            *w = 0;
            if (q >= c->count)
                continue;
            const pd_local i = c->point + q;
            const pd_local j = pd_lattice_neighbour(l, z, c, q, &l->offset[k]);
            const int64_t bit = (int64_t)regular_row(b, i) * l->n_offsets + k;
            const bool broken = l->broken && l->broken[bit / 64] >> (bit % 64) & 1;
            if (j < 0 || broken)
                keep = keep == NOTHING ? BONDS : keep;
            if (j < 0)
                continue;
            *w = weigh(b, i, j, &l->offset[k], context);
            /* Beyond round-off of the sums that a weight may come from. Broken bonds
             * count too: what a chunk keeps shall not depend on when it is weighed. */
            if (fabs(*w - common) > 1e-11 * fabs(common))
                keep = WEIGHTS;
            if (broken)
                *w = 0;
            else
                bonds[k] |= (unsigned char)(1u << q);
        }
    return keep;
}

static pd_status copy_of(const pd_lattice *l, const void *from, size_t size, void *to)
{
    void *copy = malloc(size);
    if (!copy)
        return no_memory(l);
    memcpy(copy, from, size);
    memcpy(to, &copy, sizeof copy);
    return pd_status_ok();
}

pd_status pd_lattice_weigh(pd_body *b, pd_weigh *weigh, const void *context)
{
    pd_lattice *l = b->lattice;
    double weight[PD_MOST_OFFSETS * PD_LANES];
    unsigned char bonds[PD_MOST_OFFSETS];
    const size_t n = (size_t)l->n_offsets;
    for (int k = 0; k < l->n_offsets; k++)
        for (int a = 0; a < 3; a++)
            l->offset[k].weight_xi[a] = l->offset[k].weight * l->offset[k].xi[a];
    for (int64_t z = 0; z < l->planes; z++)
        for (int64_t m = l->regular.first[z]; m < l->regular.first[z + 1]; m++) {
            pd_chunk *c = &l->regular.chunk[m];
            const int keep = weigh_chunk(b, z, c, weigh, context, weight, bonds);
            forget_weights(c);
            if (keep == BONDS)
                PD_TRY(copy_of(l, bonds, n, &c->bonds));
            if (keep == WEIGHTS)
                PD_TRY(copy_of(l, weight, n * PD_LANES * sizeof *weight, &c->weight));
        }
    return pd_status_ok();
}

/* ---- the ring ---- */

pd_status pd_ring_create(const pd_lattice *l, int components, int slots, pd_ring *ring)
{
    *ring = (pd_ring){.components = components,
                      .slots = slots,
                      .stride = components * l->row,
                      .plane = components * l->plane,
                      .planes = l->planes};
    const size_t size = (size_t)ring->plane;
    ring->shift = malloc((size_t)l->n_offsets * sizeof *ring->shift);
    /* Rows are whole cache lines. */
    const size_t bytes = size * sizeof *ring->data;
    ring->data = aligned_alloc(64, (size_t)slots * bytes);
    ring->nothing = aligned_alloc(64, bytes);
    if (!ring->shift || !ring->data || !ring->nothing)
        return pd_status_fail(PD_NO_MEMORY, -1, "%d planes of %zu numbers", slots, size);
    memset(ring->data, 0, (size_t)slots * bytes);
    memset(ring->nothing, 0, bytes);
    for (int k = 0; k < l->n_offsets; k++)
        ring->shift[k] = l->offset[k].rows * ring->stride + l->offset[k].along;
    return pd_status_ok();
}

void pd_ring_free(pd_ring *ring)
{
    free(ring->shift);
    free(ring->data);
    free(ring->nothing);
    *ring = (pd_ring){0};
}

/* Put the d components of `count` points, [count][d], into cells, [d][row]. */
PD_INLINE void scatter(const int d, int count, const double *from, double *to,
                       int64_t row)
{
    for (int c = 0; c < d; c++)
        for (int q = 0; q < count; q++)
            to[c * row + q] = from[q * d + c];
}

PD_INLINE void fill_plane(const int d, const pd_lattice *l, const pd_chunks *chunks,
                          int64_t z, const double *field, const pd_ring *ring)
{
    double *plane = ring_plane(ring, z);
    for (int64_t m = chunks->first[z]; m < chunks->first[z + 1]; m++) {
        const pd_chunk *c = &chunks->chunk[m];
        const double *from = field + (size_t)c->point * (size_t)d;
        double *to = plane + ring_cell(ring, c);
        if (c->count == PD_LANES) /* the count is a constant here */
            scatter(d, PD_LANES, from, to, l->row);
        else
            scatter(d, c->count, from, to, l->row);
    }
}

void pd_ring_fill(int d, const pd_body *b, int64_t z, const double *field,
                  const pd_ring *ring)
{
    const pd_lattice *l = b->lattice;
    if (z < 0 || z >= l->planes)
        return;
    const pd_chunks *kinds[] = {&l->regular, &l->other};
    for (int k = 0; k < 2; k++)
        if (d == 1)
            fill_plane(1, l, kinds[k], z, field, ring);
        else if (d == 2)
            fill_plane(2, l, kinds[k], z, field, ring);
        else
            fill_plane(3, l, kinds[k], z, field, ring);
}
