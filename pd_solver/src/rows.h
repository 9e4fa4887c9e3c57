/*
 * Rows by global number: what points have on their ranks, in the order of a file and
 * back.
 *
 * Row k belongs to point k of 0 to N - 1. The ranks have a block of rows each, rank r
 * those from r N/P on. One rank, or MPI_COMM_NULL: no messages, no MPI.
 *
 * All but pd_rows_free are collective and return the same status on all ranks.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_ROWS_H
#define PD_SRC_ROWS_H

#include "pd.h"

typedef struct {
    MPI_Comm comm; /* borrowed */
    int rank, ranks;
    pd_global all;         /* N */
    pd_global first, past; /* this rank's rows are [first, past) */
    pd_local n;            /* points of this rank */
    const pd_global *id;   /* [n] borrowed */
} pd_rows;

/* Plan for n points of numbers id[n], unique and together 0 to N - 1. Errors:
 * PD_BAD_ARGUMENT (a number out of range, twice or missing), PD_NO_MEMORY. */
pd_status pd_rows_create(MPI_Comm comm, pd_local n, const pd_global *id, pd_global N,
                         pd_rows *rows);

static inline int64_t pd_rows_mine(const pd_rows *rows)
{
    return rows->past - rows->first;
}

/* Values of `size` bytes of the points, values[n], into block[rows of this rank]. */
pd_status pd_rows_put(const pd_rows *rows, size_t size, const void *values, void *block);

/* From blocks to any points: values[n] of the numbers id[n], repeated or not. */
pd_status pd_rows_fetch(const pd_rows *rows, size_t size, const void *block, size_t n,
                        const pd_global *id, void *values);

/* Entries of `size` bytes in lists by rows: entry[first[k]] to entry[first[k + 1]] are
 * those of row k of a block or of id[k]. Freed by pd_lists_free. */
typedef struct {
    size_t size;
    int64_t *first; /* [rows + 1] */
    char *entry;    /* [first[rows]][size] */
} pd_lists;

void pd_lists_free(pd_lists *lists);

/* Entries begin with a pd_global, their key. Any rank may have entries of any row, in any
 * order: entry[n][size] for row[n]. In a list they rise by key, and of those with one key
 * one is kept. */
pd_status pd_rows_put_lists(const pd_rows *rows, size_t size, size_t n,
                            const pd_global *row, const void *entry, pd_lists *lists);

/* The lists of the numbers id[n] from those of all blocks. */
pd_status pd_rows_fetch_lists(const pd_rows *rows, const pd_lists *blocks, size_t n,
                              const pd_global *id, pd_lists *lists);

#endif
