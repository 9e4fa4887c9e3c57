/*
 * Rows by global number; see rows.h.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "rows.h"

#include <stdlib.h>
#include <string.h>

#include "collective.h"
#include "status.h"

/* ---- whose row it is ---- */

static pd_global first_of(const pd_rows *r, int rank)
{
    return r->all / r->ranks * rank + r->all % r->ranks * rank / r->ranks;
}

static int owner_of(const pd_rows *r, pd_global row)
{
    int rank = (int)((double)row / (double)r->all * r->ranks); /* or beside it */
    while (row < first_of(r, rank))
        rank--;
    while (row >= first_of(r, rank + 1))
        rank++;
    return rank;
}

static pd_status no_memory(size_t n)
{
    return pd_status_fail(PD_NO_MEMORY, -1, "%zu rows", n);
}

/* ---- records to other ranks ---- */

/* Which records go to which rank, and come from it. */
typedef struct {
    size_t n_out, n_in;
    int *out, *in;             /* [ranks] records */
    int *first_out, *first_in; /* [ranks] */
    size_t *place; /* [n_out] where a record stands among those sorted by rank */
} route;

static void free_route(route *t)
{
    free(t->out);
    free(t->place);
    *t = (route){0};
}

/* Counts of `in` from those of `out`. Collective. */
static pd_status tell_counts(const pd_rows *r, route *t)
{
    MPI_Alltoall(t->out, 1, MPI_INT, t->in, 1, MPI_INT, r->comm);
    size_t n_out = 0, n_in = 0;
    for (int rank = 0; rank < r->ranks; rank++) {
        t->first_out[rank] = (int)n_out;
        t->first_in[rank] = (int)n_in;
        n_out += (size_t)t->out[rank];
        n_in += (size_t)t->in[rank];
    }
    t->n_in = n_in;
    return pd_agree(r->comm, n_in > INT32_MAX || n_out > INT32_MAX
                                 ? pd_status_fail(PD_BAD_ARGUMENT, -1,
                                                  "%zu rows of one rank; allowed: %d",
                                                  n_in, INT32_MAX)
                                 : pd_status_ok());
}

static pd_status allocate_route(const pd_rows *r, size_t n, route *t)
{
    *t = (route){.n_out = n,
                 .out = calloc(4 * (size_t)r->ranks, sizeof *t->out),
                 .place = malloc((n + 1) * sizeof *t->place)};
    t->in = t->out + r->ranks;
    t->first_out = t->in + r->ranks;
    t->first_in = t->first_out + r->ranks;
    return pd_agree(r->comm,
                    t->out && t->place && n <= INT32_MAX ? pd_status_ok() : no_memory(n));
}

/* A record for each row, to the rank that has it. Collective; free_route also on error.
 */
static pd_status find_route(const pd_rows *r, size_t n, const pd_global *row, route *t)
{
    PD_TRY(allocate_route(r, n, t));
    for (size_t k = 0; k < n; k++)
        t->out[owner_of(r, row[k])]++;
    PD_TRY(tell_counts(r, t));
    int *next = malloc((size_t)r->ranks * sizeof *next);
    PD_TRY(pd_agree(r->comm, next ? pd_status_ok() : no_memory(n)));
    memcpy(next, t->first_out, (size_t)r->ranks * sizeof *next);
    for (size_t k = 0; k < n; k++)
        t->place[k] = (size_t)next[owner_of(r, row[k])]++;
    free(next);
    return pd_status_ok();
}

/* Send records of `size` bytes along the route, or back. */
static void send(const pd_rows *r, const route *t, bool back, size_t size,
                 const void *from, void *to)
{
    MPI_Datatype record;
    MPI_Type_contiguous((int)size, MPI_BYTE, &record);
    MPI_Type_commit(&record);
    if (back)
        MPI_Alltoallv(from, t->in, t->first_in, record, to, t->out, t->first_out, record,
                      r->comm);
    else
        MPI_Alltoallv(from, t->out, t->first_out, record, to, t->in, t->first_in, record,
                      r->comm);
    MPI_Type_free(&record);
}

/* Send values[n] and their rows; *rows_in, *in [t->n_in] are the caller's to free. */
static pd_status deliver(const pd_rows *r, const route *t, size_t size,
                         const pd_global *row, const char *values, pd_global **rows_in,
                         char **in)
{
    const size_t n = t->n_out;
    pd_global *sorted = malloc((n + 1) * sizeof *sorted);
    char *out = malloc(n * size + 1);
    *rows_in = malloc((t->n_in + 1) * sizeof **rows_in);
    *in = malloc(t->n_in * size + 1);
    const pd_status status =
        pd_agree(r->comm, sorted && out && *rows_in && *in ? pd_status_ok()
                                                           : no_memory(n + t->n_in));
    if (status.code == PD_OK) {
        for (size_t k = 0; k < n; k++) {
            sorted[t->place[k]] = row[k];
            memcpy(out + t->place[k] * size, values + k * size, size);
        }
        send(r, t, false, sizeof *sorted, sorted, *rows_in);
        send(r, t, false, size, out, *in);
    }
    free(sorted);
    free(out);
    return status;
}

/* ---- the plan ---- */

static pd_status check_numbers(const pd_rows *r)
{
    int64_t n = r->n;
    pd_count_all(r->comm, &n, 1);
    if (n != r->all)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "%lld points; expected: %lld",
                              (long long)n, (long long)r->all);
    pd_status status = pd_status_ok();
    for (pd_local k = 0; k < r->n; k++)
        if (r->id[k] < 0 || r->id[k] >= r->all)
            status = pd_status_fail(PD_BAD_ARGUMENT, r->id[k],
                                    "point number %lld; allowed: 0 to below %lld",
                                    (long long)r->id[k], (long long)r->all);
    return pd_agree(r->comm, status);
}

/* As many numbers as rows: if none is there twice none is missing. */
static pd_status check_doubles(const pd_rows *r)
{
    const size_t mine = (size_t)pd_rows_mine(r);
    pd_global *row = malloc((mine + 1) * sizeof *row);
    PD_TRY(pd_agree(r->comm, row ? pd_status_ok() : no_memory(mine)));
    for (size_t k = 0; k < mine; k++)
        row[k] = -1;
    pd_status status = pd_rows_put(r, sizeof *row, r->id, row);
    for (size_t k = 0; k < mine && status.code == PD_OK; k++)
        if (row[k] < 0)
            status = pd_status_fail(PD_BAD_ARGUMENT, r->first + (pd_global)k,
                                    "no point has number %lld, another's is there twice",
                                    (long long)r->first + (long long)k);
    free(row);
    return pd_agree(r->comm, status);
}

pd_status pd_rows_create(MPI_Comm comm, pd_local n, const pd_global *id, pd_global N,
                         pd_rows *rows)
{
    *rows = (pd_rows){.comm = comm,
                      .rank = pd_rank_of(comm),
                      .ranks = pd_ranks_of(comm),
                      .all = N,
                      .n = n,
                      .id = id};
    rows->first = first_of(rows, rows->rank);
    rows->past = first_of(rows, rows->rank + 1);
    PD_TRY(check_numbers(rows));
    return check_doubles(rows);
}

/* ---- one value a row ---- */

pd_status pd_rows_put(const pd_rows *r, size_t size, const void *values, void *block)
{
    const size_t n = (size_t)r->n;
    if (r->ranks == 1) {
        for (size_t k = 0; k < n; k++)
            memcpy((char *)block + (size_t)r->id[k] * size,
                   (const char *)values + k * size, size);
        return pd_status_ok();
    }
    route t;
    pd_global *row = NULL;
    char *in = NULL;
    pd_status status = find_route(r, n, r->id, &t);
    if (status.code == PD_OK)
        status = deliver(r, &t, size, r->id, values, &row, &in);
    for (size_t k = 0; k < t.n_in && status.code == PD_OK; k++)
        memcpy((char *)block + (size_t)(row[k] - r->first) * size, in + k * size, size);
    free(row);
    free(in);
    free_route(&t);
    return status;
}

/* Which rows the other ranks ask for: asked[t->n_in], the caller's to free. */
static pd_status ask(const pd_rows *r, const route *t, const pd_global *id,
                     pd_global **asked)
{
    pd_global *out = malloc((t->n_out + 1) * sizeof *out);
    *asked = malloc((t->n_in + 1) * sizeof **asked);
    const pd_status status =
        pd_agree(r->comm, out && *asked ? pd_status_ok() : no_memory(t->n_out + t->n_in));
    if (status.code == PD_OK) {
        for (size_t k = 0; k < t->n_out; k++)
            out[t->place[k]] = id[k];
        send(r, t, false, sizeof *out, out, *asked);
    }
    free(out);
    return status;
}

/* Answer those who asked: values[t->n_out] from block. */
static pd_status answer(const pd_rows *r, const route *t, size_t size,
                        const pd_global *asked, const char *block, char *values)
{
    char *out = malloc(t->n_in * size + 1), *in = malloc(t->n_out * size + 1);
    const pd_status status =
        pd_agree(r->comm, out && in ? pd_status_ok() : no_memory(t->n_out + t->n_in));
    if (status.code == PD_OK) {
        for (size_t k = 0; k < t->n_in; k++)
            memcpy(out + k * size, block + (size_t)(asked[k] - r->first) * size, size);
        send(r, t, true, size, out, in);
        for (size_t k = 0; k < t->n_out; k++)
            memcpy(values + k * size, in + t->place[k] * size, size);
    }
    free(out);
    free(in);
    return status;
}

pd_status pd_rows_fetch(const pd_rows *r, size_t size, const void *block, size_t n,
                        const pd_global *id, void *values)
{
    if (r->ranks == 1) {
        for (size_t k = 0; k < n; k++)
            memcpy((char *)values + k * size, (const char *)block + (size_t)id[k] * size,
                   size);
        return pd_status_ok();
    }
    route t;
    pd_global *asked = NULL;
    pd_status status = find_route(r, n, id, &t);
    if (status.code == PD_OK)
        status = ask(r, &t, id, &asked);
    if (status.code == PD_OK)
        status = answer(r, &t, size, asked, block, values);
    free(asked);
    free_route(&t);
    return status;
}

/* ---- lists ---- */

void pd_lists_free(pd_lists *lists)
{
    free(lists->first);
    free(lists->entry);
    *lists = (pd_lists){0};
}

typedef struct {
    pd_global key;
    size_t place;
} ranked;

static int by_key(const void *one, const void *two)
{
    const ranked *a = one, *b = two;
    if (a->key != b->key)
        return a->key < b->key ? -1 : 1;
    return (a->place > b->place) - (a->place < b->place);
}

/* Entries that came for rows of this rank, in[n] for row[n], into lists; `order` is room
 * for n. */
static void fill_lists(const pd_rows *r, size_t n, const pd_global *row, const char *in,
                       ranked *order, pd_lists *lists)
{
    const size_t mine = (size_t)pd_rows_mine(r), size = lists->size;
    int64_t *first = lists->first, kept = 0, begin = 0;
    for (size_t k = 0; k < n; k++)
        first[row[k] - r->first + 1]++;
    for (size_t k = 0; k < mine; k++)
        first[k + 1] += first[k];
    for (size_t k = 0; k < n; k++) {
        ranked *here = &order[first[row[k] - r->first]++];
        here->place = k;
        memcpy(&here->key, in + k * size, sizeof here->key);
    }
    for (size_t k = 0; k < mine; k++) { /* first[k] is now where row k + 1 begins */
        const int64_t end = first[k];
        qsort(order + begin, (size_t)(end - begin), sizeof *order, by_key);
        first[k] = kept;
        for (int64_t e = begin; e < end; e++)
            if (e == begin || order[e].key != order[e - 1].key)
                memcpy(lists->entry + (size_t)kept++ * size, in + order[e].place * size,
                       size);
        begin = end;
    }
    first[mine] = kept;
}

static pd_status make_lists(const pd_rows *r, size_t size, size_t n, const pd_global *row,
                            const char *in, pd_lists *lists)
{
    ranked *order = malloc((n + 1) * sizeof *order);
    *lists = (pd_lists){
        .size = size,
        .first = calloc((size_t)pd_rows_mine(r) + 2, sizeof *lists->first),
        .entry = malloc(n * size + 1),
    };
    const pd_status status = pd_agree(
        r->comm, order && lists->first && lists->entry ? pd_status_ok() : no_memory(n));
    if (status.code == PD_OK)
        fill_lists(r, n, row, in, order, lists);
    else
        pd_lists_free(lists);
    free(order);
    return status;
}

pd_status pd_rows_put_lists(const pd_rows *r, size_t size, size_t n, const pd_global *row,
                            const void *entry, pd_lists *lists)
{
    *lists = (pd_lists){0};
    if (r->ranks == 1)
        return make_lists(r, size, n, row, entry, lists);
    route t;
    pd_global *row_in = NULL;
    char *in = NULL;
    pd_status status = find_route(r, n, row, &t);
    if (status.code == PD_OK)
        status = deliver(r, &t, size, row, entry, &row_in, &in);
    if (status.code == PD_OK)
        status = make_lists(r, size, t.n_in, row_in, in, lists);
    free(row_in);
    free(in);
    free_route(&t);
    return status;
}

/* lists->first of n lists from how long they are, and room for them. */
static pd_status begin_lists(const pd_rows *r, size_t size, size_t n,
                             const int64_t *length, pd_lists *lists)
{
    *lists = (pd_lists){.size = size, .first = malloc((n + 1) * sizeof *lists->first)};
    if (lists->first) {
        lists->first[0] = 0;
        for (size_t k = 0; k < n; k++)
            lists->first[k + 1] = lists->first[k] + length[k];
        lists->entry = malloc((size_t)lists->first[n] * size + 1);
    }
    const pd_status status =
        pd_agree(r->comm, lists->entry ? pd_status_ok() : no_memory(n));
    if (status.code != PD_OK)
        pd_lists_free(lists);
    return status;
}

static int64_t length_of(const pd_lists *lists, int64_t k)
{
    return lists->first[k + 1] - lists->first[k];
}

static void copy_list(const pd_lists *from, int64_t k, pd_lists *to, int64_t m)
{
    memcpy(to->entry + (size_t)to->first[m] * to->size,
           from->entry + (size_t)from->first[k] * from->size,
           (size_t)length_of(from, k) * from->size);
}

/* How long the lists of id[n] are. */
static pd_status fetch_lengths(const pd_rows *r, const pd_lists *blocks, size_t n,
                               const pd_global *id, int64_t *length)
{
    const int64_t mine = pd_rows_mine(r);
    int64_t *of_blocks = malloc(((size_t)mine + 1) * sizeof *of_blocks);
    pd_status status =
        pd_agree(r->comm, of_blocks && length ? pd_status_ok() : no_memory((size_t)mine));
    for (int64_t k = 0; k < mine && status.code == PD_OK; k++)
        of_blocks[k] = length_of(blocks, k);
    if (status.code == PD_OK)
        status = pd_rows_fetch(r, sizeof *length, of_blocks, n, id, length);
    free(of_blocks);
    return status;
}

/* Records that carry the lists which the ranks of `t` asked for, and where they come
 * from.
 */
static void count_entries(const pd_rows *r, const route *t, const pd_lists *blocks,
                          const pd_global *asked, route *entries)
{
    for (int rank = 0; rank < r->ranks; rank++)
        for (int k = t->first_in[rank]; k < t->first_in[rank] + t->in[rank]; k++)
            entries->out[rank] += (int)length_of(blocks, asked[k] - r->first);
}

/* The same list after list, in the order in which they were asked for. */
static void gather_entries(const pd_rows *r, const route *t, const pd_lists *blocks,
                           const pd_global *asked, char *out)
{
    for (size_t k = 0; k < t->n_in; k++) {
        const int64_t row = asked[k] - r->first;
        const size_t bytes = (size_t)length_of(blocks, row) * blocks->size;
        memcpy(out, blocks->entry + (size_t)blocks->first[row] * blocks->size, bytes);
        out += bytes;
    }
}

/* Lists in the order in which they were asked for, back to their places. */
static pd_status place_lists(const pd_rows *r, const route *t, const int64_t *length,
                             const char *in, pd_lists *lists)
{
    int64_t *at = malloc((t->n_out + 2) * sizeof *at);
    PD_TRY(pd_agree(r->comm, at ? pd_status_ok() : no_memory(t->n_out)));
    at[0] = 0;
    for (size_t k = 0; k < t->n_out; k++)
        at[t->place[k] + 1] = length[k];
    for (size_t k = 0; k < t->n_out; k++)
        at[k + 1] += at[k];
    for (size_t k = 0; k < t->n_out; k++)
        memcpy(lists->entry + (size_t)lists->first[k] * lists->size,
               in + (size_t)at[t->place[k]] * lists->size,
               (size_t)length[k] * lists->size);
    free(at);
    return pd_status_ok();
}

static pd_status exchange_lists(const pd_rows *r, const route *t, const pd_lists *blocks,
                                const pd_global *asked, const int64_t *length,
                                pd_lists *lists)
{
    route entries;
    char *out = NULL, *in = NULL;
    size_t total = 0;
    for (size_t k = 0; k < t->n_in; k++)
        total += (size_t)length_of(blocks, asked[k] - r->first);
    pd_status status = allocate_route(r, total, &entries);
    if (status.code == PD_OK) {
        count_entries(r, t, blocks, asked, &entries);
        status = tell_counts(r, &entries);
    }
    if (status.code == PD_OK) {
        out = malloc(total * blocks->size + 1);
        in = malloc(entries.n_in * blocks->size + 1);
        status = pd_agree(r->comm, out && in ? pd_status_ok() : no_memory(total));
    }
    if (status.code == PD_OK) {
        gather_entries(r, t, blocks, asked, out);
        send(r, &entries, false, blocks->size, out, in);
        status = place_lists(r, t, length, in, lists);
    }
    free(out);
    free(in);
    free_route(&entries);
    return status;
}

pd_status pd_rows_fetch_lists(const pd_rows *r, const pd_lists *blocks, size_t n,
                              const pd_global *id, pd_lists *lists)
{
    *lists = (pd_lists){0};
    int64_t *length = malloc((n + 1) * sizeof *length);
    pd_status status = fetch_lengths(r, blocks, n, id, length);
    if (status.code == PD_OK)
        status = begin_lists(r, blocks->size, n, length, lists);
    if (status.code == PD_OK && r->ranks == 1)
        for (size_t k = 0; k < n; k++)
            copy_list(blocks, id[k], lists, (int64_t)k);
    if (status.code == PD_OK && r->ranks > 1) {
        route t;
        pd_global *asked = NULL;
        status = find_route(r, n, id, &t);
        if (status.code == PD_OK)
            status = ask(r, &t, id, &asked);
        if (status.code == PD_OK)
            status = exchange_lists(r, &t, blocks, asked, length, lists);
        free(asked);
        free_route(&t);
    }
    if (status.code != PD_OK)
        pd_lists_free(lists);
    free(length);
    return status;
}
