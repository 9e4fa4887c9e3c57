/*
 * Ghosts: ranks whose boxes come close tell each other the points near the other's box,
 * then which of them they need.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "ghosts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "neighbourhood.h"
#include "status.h"

enum { COUNTS = 73, ELEMENTS }; /* tags */

/* Bonds that are longer than the horizon by less than this share may yet be bonds once
 * points are put on their lattice. */
#define SLACK 1e-3

/* What a rank tells of a point. */
typedef struct {
    double X[3], volume;
    pd_global id;
    pd_local index; /* there */
    unsigned char held;
} offer;

typedef struct {
    size_t n, size; /* of an element, bytes */
    void *data;
} list;

enum { OFFERS, OFFERED, WANTS, WANTED, LISTS };

typedef struct {
    int rank;
    list list[LISTS]; /* of offer, offer, pd_local there, pd_local of ours */
} meeting;

typedef struct {
    MPI_Comm comm;
    int d, rank, size;
    double ratio, reach;
    int n_meetings;
    meeting *meeting;
} search;

double pd_spacing_of(int d, double volume)
{
    return d == 1 ? volume : d == 2 ? sqrt(volume) : cbrt(volume);
}

/* ---- who is near ---- */

typedef struct {
    double low[3], high[3];
} box;

static box box_of(int d, size_t n, const double *X)
{
    box b = {{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
    for (size_t i = 0; i < n; i++)
        for (int a = 0; a < d; a++) {
            b.low[a] = fmin(b.low[a], X[3 * i + (size_t)a]);
            b.high[a] = fmax(b.high[a], X[3 * i + (size_t)a]);
        }
    return b;
}

static bool is_near(const search *s, const box *b, const double *X)
{
    for (int a = 0; a < s->d; a++)
        if (X[a] < b->low[a] - s->reach || X[a] > b->high[a] + s->reach)
            return false;
    return true;
}

/* The same answer whichever of the two asks. */
static bool boxes_meet(const search *s, const box *one, const box *two)
{
    for (int a = 0; a < s->d; a++)
        if (!(one->low[a] - two->high[a] <= s->reach &&
              two->low[a] - one->high[a] <= s->reach))
            return false;
    return true;
}

static pd_status list_create(list *l, size_t n, size_t size)
{
    *l = (list){n, size, calloc(n + 1, size)};
    return l->data ? pd_status_ok()
                   : pd_status_fail(PD_NO_MEMORY, -1, "ghosts: %zu x %zu bytes", n, size);
}

/* Offer a rank our points near its box. */
static pd_status make_offers(const search *s, const pd_part *c, const box *to, list *out)
{
    size_t n = 0;
    for (pd_local i = 0; i < c->n_owned; i++)
        n += is_near(s, to, c->X + 3 * (size_t)i);
    PD_TRY(list_create(out, n, sizeof(offer)));
    offer *next = out->data;
    for (pd_local i = 0; i < c->n_owned; i++) {
        const double *X = c->X + 3 * (size_t)i;
        if (!is_near(s, to, X))
            continue;
        *next = (offer){.volume = c->volume[i],
                        .id = c->id[i],
                        .index = i,
                        .held = c->held && c->held[i]};
        memcpy(next++->X, X, (size_t)s->d * sizeof *X);
    }
    return pd_status_ok();
}

static pd_status find_meetings(search *s, const pd_part *c)
{
    const box mine = box_of(s->d, (size_t)c->n_owned, c->X);
    box *all = malloc((size_t)s->size * sizeof *all);
    s->meeting = calloc((size_t)s->size, sizeof *s->meeting);
    pd_status status = pd_status_ok();
    if (!all || !s->meeting)
        status = pd_status_fail(PD_NO_MEMORY, -1, "boxes of %d ranks", s->size);
    status = pd_agree(s->comm, status);
    if (status.code == PD_OK)
        MPI_Allgather(&mine, sizeof mine, MPI_BYTE, all, sizeof mine, MPI_BYTE, s->comm);
    for (int r = 0; status.code == PD_OK && r < s->size; r++)
        if (r != s->rank && boxes_meet(s, &mine, &all[r])) {
            meeting *m = &s->meeting[s->n_meetings++];
            m->rank = r;
            status = make_offers(s, c, &all[r], &m->list[OFFERS]);
        }
    free(all);
    return pd_agree(s->comm, status);
}

/* Send a list to each rank that we meet, and make another of what it sends. */
static pd_status exchange(const search *s, int from, int to)
{
    MPI_Request *request = malloc(2 * (size_t)s->n_meetings * sizeof *request + 1);
    uint64_t *count = malloc((size_t)s->n_meetings * sizeof *count + 1);
    pd_status status = pd_status_ok();
    if (!request || !count)
        status = pd_status_fail(PD_NO_MEMORY, -1, "%d meetings", s->n_meetings);
    PD_TRY(pd_agree(s->comm, status));
    for (int k = 0; k < s->n_meetings; k++) {
        const meeting *m = &s->meeting[k];
        MPI_Irecv(&count[k], 1, MPI_UINT64_T, m->rank, COUNTS, s->comm, &request[2 * k]);
        MPI_Isend(&m->list[from].n, 1, MPI_UINT64_T, m->rank, COUNTS, s->comm,
                  &request[2 * k + 1]);
    }
    MPI_Waitall(2 * s->n_meetings, request, MPI_STATUSES_IGNORE);
    for (int k = 0; status.code == PD_OK && k < s->n_meetings; k++) {
        list *l = s->meeting[k].list;
        status = list_create(&l[to], count[k], l[from].size);
    }
    status = pd_agree(s->comm, status);
    for (int k = 0; status.code == PD_OK && k < s->n_meetings; k++) {
        meeting *m = &s->meeting[k];
        const list *out = &m->list[from], *in = &m->list[to];
        MPI_Irecv(in->data, (int)(in->n * in->size), MPI_BYTE, m->rank, ELEMENTS, s->comm,
                  &request[2 * k]);
        MPI_Isend(out->data, (int)(out->n * out->size), MPI_BYTE, m->rank, ELEMENTS,
                  s->comm, &request[2 * k + 1]);
    }
    if (status.code == PD_OK)
        MPI_Waitall(2 * s->n_meetings, request, MPI_STATUSES_IGNORE);
    free(request);
    free(count);
    return status;
}

/* ---- what is needed of what is offered ---- */

enum { NOT_NEEDED, NEAR, FAR };

/* Our points and all that is offered, [n][d]. */
typedef struct {
    pd_local n_owned, n;
    double *X, *spacing;
    unsigned char *need; /* [n - n_owned] */
} pool;

static void pool_free(pool *p)
{
    free(p->X);
    free(p->spacing);
    free(p->need);
}

static void put_into_pool(pool *p, int d, pd_local at, const double *X, double volume)
{
    memcpy(p->X + (size_t)at * (size_t)d, X, (size_t)d * sizeof *X);
    p->spacing[at] = pd_spacing_of(d, volume);
}

static pd_status pool_create(const search *s, const pd_part *c, pool *p)
{
    size_t n = (size_t)c->n_owned;
    for (int k = 0; k < s->n_meetings; k++)
        n += s->meeting[k].list[OFFERED].n;
    *p = (pool){.n_owned = c->n_owned, .n = (pd_local)n};
    p->X = malloc((n * (size_t)s->d + 1) * sizeof *p->X);
    p->spacing = malloc((n + 1) * sizeof *p->spacing);
    p->need = calloc(n - (size_t)c->n_owned + 1, 1);
    if (!p->X || !p->spacing || !p->need || n > INT32_MAX / 16)
        return pd_status_fail(PD_NO_MEMORY, -1, "%zu points and ghosts", n);
    for (pd_local i = 0; i < c->n_owned; i++)
        put_into_pool(p, s->d, i, c->X + 3 * (size_t)i, c->volume[i]);
    pd_local at = c->n_owned;
    for (int k = 0; k < s->n_meetings; k++) {
        const list *l = &s->meeting[k].list[OFFERED];
        const offer *o = l->data;
        for (size_t m = 0; m < l->n; m++)
            put_into_pool(p, s->d, at++, o[m].X, o[m].volume);
    }
    return pd_status_ok();
}

/* Is one of the points near g ours, or already needed as NEAR? */
static bool is_wanted(const pool *p, const pd_local *near, pd_local count, int layer)
{
    for (pd_local k = 0; k < count; k++)
        if (layer == NEAR
                ? near[k] < p->n_owned
                : near[k] >= p->n_owned && p->need[near[k] - p->n_owned] == NEAR)
            return true;
    return false;
}

/* Mark layer by layer. */
static pd_status mark_needs(const search *s, int layers, pool *p)
{
    pd_cell_list cells;
    pd_local *near = NULL, capacity = 0;
    pd_status status =
        pd_cell_list_create(s->d, p->n, p->X, p->spacing, s->ratio * (1 + SLACK), &cells);
    for (int layer = NEAR; status.code == PD_OK && layer <= (layers > 1 ? FAR : NEAR);
         layer++)
        for (pd_local g = p->n_owned; g < p->n; g++) {
            if (p->need[g - p->n_owned] != NOT_NEEDED)
                continue;
            pd_local count = pd_cell_list_near(&cells, g, capacity, near);
            if (count > capacity) {
                free(near);
                near = malloc(2 * (size_t)count * sizeof *near);
                capacity = 2 * count;
                if (!near) {
                    status = pd_status_fail(PD_NO_MEMORY, -1, "a family of %d", count);
                    break;
                }
                count = pd_cell_list_near(&cells, g, capacity, near);
            }
            if (is_wanted(p, near, count, layer))
                p->need[g - p->n_owned] = (unsigned char)layer;
        }
    free(near);
    pd_cell_list_free(&cells);
    return status;
}

/* Indices, at their owners, of the offers that are needed. */
static pd_status want(const search *s, const pool *p)
{
    const unsigned char *need = p->need;
    for (int k = 0; k < s->n_meetings; k++) {
        const list *l = &s->meeting[k].list[OFFERED];
        list *wants = &s->meeting[k].list[WANTS];
        const offer *o = l->data;
        PD_TRY(list_create(wants, l->n, sizeof(pd_local)));
        wants->n = 0;
        for (size_t m = 0; m < l->n; m++)
            if (need[m] != NOT_NEEDED)
                ((pd_local *)wants->data)[wants->n++] = o[m].index;
        need += l->n;
    }
    return pd_status_ok();
}

/* ---- the result ---- */

static pd_status make_halo(const search *s, pd_halo **halo)
{
    pd_halo *h = *halo = calloc(1, sizeof *h);
    if (!h)
        return pd_status_fail(PD_NO_MEMORY, -1, "a halo");
    h->comm = s->comm;
    h->partner = calloc((size_t)s->n_meetings + 1, sizeof *h->partner);
    h->request = malloc((2 * (size_t)s->n_meetings + 1) * sizeof(MPI_Request));
    for (int k = 0; k < s->n_meetings; k++) {
        h->n_send += s->meeting[k].list[WANTED].n;
        h->n_ghost += s->meeting[k].list[WANTS].n;
    }
    h->send = malloc((h->n_send + 1) * sizeof *h->send);
    h->ghost = malloc((h->n_ghost + 1) * sizeof *h->ghost);
    if (!h->partner || !h->request || !h->send || !h->ghost)
        return pd_status_fail(PD_NO_MEMORY, -1, "a halo of %zu points", h->n_ghost);
    h->n_send = h->n_ghost = 0;
    for (int k = 0; k < s->n_meetings; k++) {
        const meeting *m = &s->meeting[k];
        const list *wanted = &m->list[WANTED], *wants = &m->list[WANTS];
        if (wanted->n == 0 && wants->n == 0)
            continue;
        h->partner[h->n_partners++] =
            (pd_partner){m->rank, h->n_send, wanted->n, h->n_ghost, wants->n};
        memcpy(h->send + h->n_send, wanted->data, wanted->n * sizeof *h->send);
        h->n_send += wanted->n;
        h->n_ghost += wants->n;
    }
    return pd_status_ok();
}

/* Our points with the ghosts after them. */
static pd_status append_ghosts(const search *s, const pool *p, bool any_held, pd_part *c)
{
    const size_t owned = (size_t)c->n_owned, n = owned + c->halo->n_ghost;
    double *X = malloc((3 * n + 1) * sizeof *X),
           *volume = malloc((n + 1) * sizeof *volume);
    unsigned char *held = calloc(n + 1, 1), *is_far = calloc(n - owned + 1, 1);
    pd_global *id = malloc((n + 1) * sizeof *id);
    void *own[] = {X, volume, held, is_far, id};
    void *numbers = c->own[0]; /* where id points to if it was made here */
    memcpy(c->own, own, sizeof own);
    if (!X || !volume || !held || !is_far || !id) {
        free(numbers);
        return pd_status_fail(PD_NO_MEMORY, -1, "%zu points and ghosts", n);
    }
    memcpy(X, c->X, 3 * owned * sizeof *X);
    memcpy(volume, c->volume, owned * sizeof *volume);
    memcpy(id, c->id, owned * sizeof *id);
    if (c->held)
        memcpy(held, c->held, owned);
    free(numbers);
    const unsigned char *need = p->need;
    size_t g = 0;
    for (int k = 0; k < s->n_meetings; k++) {
        const list *l = &s->meeting[k].list[OFFERED];
        const offer *o = l->data;
        for (size_t m = 0; m < l->n; m++, need++)
            if (*need != NOT_NEEDED) {
                memcpy(X + 3 * (owned + g), o[m].X, sizeof o[m].X);
                volume[owned + g] = o[m].volume;
                id[owned + g] = o[m].id;
                held[owned + g] = o[m].held;
                is_far[g] = *need == FAR;
                c->halo->ghost[g] = (pd_local)(owned + g);
                g++;
            }
    }
    c->X = X, c->volume = volume, c->id = id, c->is_far = is_far;
    c->held = any_held ? held : NULL;
    c->n = (pd_local)n;
    return pd_status_ok();
}

static void search_free(search *s)
{
    for (int k = 0; s->meeting && k < s->n_meetings; k++)
        for (int l = 0; l < LISTS; l++)
            free(s->meeting[k].list[l].data);
    free(s->meeting);
}

static pd_status find_ghosts(search *s, int layers, bool any_held, pd_part *c)
{
    pool p = {0};
    pd_status status = find_meetings(s, c);
    if (status.code == PD_OK)
        status = exchange(s, OFFERS, OFFERED);
    if (status.code != PD_OK)
        return status;
    status = pool_create(s, c, &p);
    if (status.code == PD_OK && p.n > 0)
        status = mark_needs(s, layers, &p);
    if (status.code == PD_OK)
        status = want(s, &p);
    status = pd_agree(s->comm, status);
    if (status.code == PD_OK)
        status = exchange(s, WANTS, WANTED);
    if (status.code == PD_OK) {
        status = make_halo(s, &c->halo);
        if (status.code == PD_OK)
            status = append_ghosts(s, &p, any_held, c);
        status = pd_agree(s->comm, status);
    }
    pool_free(&p);
    return status;
}

/* Numbers that are given, or made. */
static pd_status number(MPI_Comm comm, int64_t n, pd_part *c)
{
    const int64_t before = pd_count_before(comm, n);
    int64_t all = n;
    pd_count_all(comm, &all, 1);
    for (int64_t i = 0; c->id && i < n; i++)
        if (c->id[i] < 0 || c->id[i] >= all)
            return pd_status_fail(PD_BAD_ARGUMENT, c->id[i],
                                  "the number of a point is %lld; allowed: 0 to %lld",
                                  (long long)c->id[i], (long long)all - 1);
    if (c->id)
        return pd_status_ok();
    pd_global *id = c->own[0] = malloc(((size_t)n + 1) * sizeof *id);
    if (!id)
        return pd_status_fail(PD_NO_MEMORY, -1, "%lld numbers", (long long)n);
    for (int64_t i = 0; i < n; i++)
        id[i] = before + i;
    c->id = id;
    return pd_status_ok();
}

pd_status pd_part_create(MPI_Comm comm, int d, double ratio, int layers, size_t n,
                         const double *X, const double *volume, const unsigned char *held,
                         const pd_global *id, pd_part *c)
{
    *c = (pd_part){.n_owned = (pd_local)n,
                   .n = (pd_local)n,
                   .X = X,
                   .volume = volume,
                   .held = held,
                   .id = id};
    PD_TRY(pd_agree(comm, number(comm, (int64_t)n, c)));
    search s = {.comm = comm,
                .d = d,
                .ratio = ratio,
                .rank = pd_rank_of(comm),
                .size = pd_ranks_of(comm)};
    if (s.size == 1)
        return pd_status_ok();
    double widest = 0;
    for (size_t i = 0; i < n; i++)
        widest = fmax(widest, pd_spacing_of(d, volume[i]));
    int64_t any_held = held != NULL;
    pd_largest_all(comm, &widest, 1);
    pd_count_all(comm, &any_held, 1);
    s.reach = layers * ratio * widest * (1 + 2 * SLACK);
    const pd_status status = find_ghosts(&s, layers, any_held > 0, c);
    search_free(&s);
    return status;
}

void pd_part_free(pd_part *c)
{
    for (size_t k = 0; k < sizeof c->own / sizeof *c->own; k++)
        free(c->own[k]);
    *c = (pd_part){0};
}
