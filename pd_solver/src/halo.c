/*
 * Messages between ranks.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "halo.h"

#include <stdlib.h>
#include <string.h>

#include "status.h"

enum { TO_GHOSTS = 71, FROM_GHOSTS = 72 }; /* tags */

void pd_halo_free(pd_halo *h)
{
    if (!h)
        return;
    free(h->partner);
    free(h->send);
    free(h->ghost);
    free(h->out);
    free(h->in);
    free(h->request);
    free(h);
}

pd_status pd_halo_reserve(pd_halo *h, size_t size)
{
    if (!h || size <= h->capacity)
        return pd_status_ok();
    /* Either way, so that sums of ghosts have room too. */
    const size_t most = h->n_send > h->n_ghost ? h->n_send : h->n_ghost;
    free(h->out);
    free(h->in);
    h->out = malloc(most * size + 1);
    h->in = malloc(most * size + 1);
    h->capacity = h->out && h->in ? size : 0;
    return h->capacity
               ? pd_status_ok()
               : pd_status_fail(PD_NO_MEMORY, -1, "messages of %zu bytes", most * size);
}

/* Copy the bytes of listed points to or from a buffer, [n][stride]. */
static void pack(const pd_local *point, size_t n, const char *values, size_t size,
                 char *buffer, size_t stride)
{
    for (size_t k = 0; k < n; k++)
        memcpy(buffer + k * stride, values + (size_t)point[k] * size, size);
}

static void unpack(const pd_local *point, size_t n, char *values, size_t size,
                   const char *buffer, size_t stride)
{
    for (size_t k = 0; k < n; k++)
        memcpy(values + (size_t)point[k] * size, buffer + k * stride, size);
}

static size_t bytes_of(const pd_halo *h)
{
    size_t bytes = 0;
    for (int f = 0; f < h->n_fields; f++)
        bytes += h->field[f].size;
    return bytes;
}

void pd_halo_add(pd_halo *h, void *values, size_t size)
{
    if (!h)
        return;
    h->field[h->n_fields].values = values;
    h->field[h->n_fields++].size = size;
}

void pd_halo_begin(pd_halo *h)
{
    if (!h)
        return;
    const size_t size = bytes_of(h);
    h->exchanges++;
    for (int p = 0; p < h->n_partners; p++) {
        const pd_partner *to = &h->partner[p];
        MPI_Irecv(h->in + to->first_ghost * size, (int)(to->n_ghost * size), MPI_BYTE,
                  to->rank, TO_GHOSTS, h->comm, &h->request[2 * p]);
    }
    for (int p = 0; p < h->n_partners; p++) {
        const pd_partner *to = &h->partner[p];
        char *out = h->out + to->first_send * size;
        for (int f = 0, at = 0; f < h->n_fields; at += (int)h->field[f++].size)
            pack(h->send + to->first_send, to->n_send, h->field[f].values,
                 h->field[f].size, out + at, size);
        MPI_Isend(out, (int)(to->n_send * size), MPI_BYTE, to->rank, TO_GHOSTS, h->comm,
                  &h->request[2 * p + 1]);
        h->bytes_sent += (int64_t)(to->n_send * size);
    }
}

void pd_halo_end(pd_halo *h)
{
    if (!pd_halo_is_under_way(h))
        return;
    const size_t size = bytes_of(h);
    MPI_Waitall(2 * h->n_partners, h->request, MPI_STATUSES_IGNORE);
    for (int f = 0, at = 0; f < h->n_fields; at += (int)h->field[f++].size)
        unpack(h->ghost, h->n_ghost, h->field[f].values, h->field[f].size, h->in + at,
               size);
    h->n_fields = 0;
}

void pd_halo_copy(pd_halo *h, void *values, size_t size)
{
    if (!h)
        return;
    pd_halo_end(h);
    pd_halo_add(h, values, size);
    pd_halo_begin(h);
    pd_halo_end(h);
}

void pd_halo_sum(pd_halo *h, double *values, size_t width)
{
    if (!h)
        return;
    const size_t size = width * sizeof *values;
    pd_halo_end(h);
    h->exchanges++;
    for (int p = 0; p < h->n_partners; p++) {
        const pd_partner *to = &h->partner[p];
        char *out = h->out + to->first_ghost * size;
        pack(h->ghost + to->first_ghost, to->n_ghost, (const char *)values, size, out,
             size);
        MPI_Irecv(h->in + to->first_send * size, (int)(to->n_send * size), MPI_BYTE,
                  to->rank, FROM_GHOSTS, h->comm, &h->request[2 * p]);
        MPI_Isend(out, (int)(to->n_ghost * size), MPI_BYTE, to->rank, FROM_GHOSTS,
                  h->comm, &h->request[2 * p + 1]);
        h->bytes_sent += (int64_t)(to->n_ghost * size);
    }
    MPI_Waitall(2 * h->n_partners, h->request, MPI_STATUSES_IGNORE);
    for (size_t k = 0; k < h->n_send; k++) {
        double part[16];
        memcpy(part, h->in + k * size, size);
        for (size_t c = 0; c < width; c++)
            values[(size_t)h->send[k] * width + c] += part[c];
    }
}
