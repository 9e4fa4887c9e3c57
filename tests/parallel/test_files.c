/*
 * Rows and files on several ranks: rows come to the right place whoever has them, one
 * file whatever the number of ranks, and one status on all.
 *
 *     mpirun -np 3 test_files <folder>
 *
 * Prints lines "PASS <what>" and "FAIL <what>: <why>", on rank 0.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _POSIX_C_SOURCE 200809L /* truncate */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "collective.h"
#include "../handles.h"
#include "hdf5_file.h"
#include "rows.h"

static const pd_file_kind kind = {"checkpoint", 1};
static const pd_rows_of values_of = {"values", "m", "two each", PD_DOUBLE, 2};
static const pd_rows_of again = {"again", "m", "two each", PD_DOUBLE, 2};
static MPI_Comm world;
static int rank, ranks, failures;
static char path[512];

/* Does it hold on all ranks? */
static void check(const char *what, bool holds, const char *why)
{
    int all = holds;
    MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_MIN, world);
    failures += !all;
    if (rank == 0 && all)
        printf("PASS %s on %d ranks\n", what, ranks);
    else if (rank == 0)
        printf("FAIL %s on %d ranks: %s\n", what, ranks, why);
}

/* Is the status the same on all ranks, with that code? */
static bool same_status(pd_status status, pd_code code)
{
    pd_status first = status;
    MPI_Bcast(&first, (int)sizeof first, MPI_BYTE, 0, world);
    return status.code == code && strcmp(first.message, status.message) == 0;
}

/* ---- points, shared out at random ---- */

enum { N = 101 };

/* Rank `lucky` gets half of all, some rank nothing. */
static pd_local share_out(unsigned seed, pd_global *id)
{
    pd_global order[N];
    srand(seed);
    for (int k = 0; k < N; k++)
        order[k] = k;
    for (int k = N - 1; k > 0; k--) {
        const int m = rand() % (k + 1);
        const pd_global swap = order[k];
        order[k] = order[m];
        order[m] = swap;
    }
    const int lucky = (int)(seed % (unsigned)ranks);
    pd_local n = 0;
    for (int k = 0; k < N; k++) {
        const int owner = k % 2 || ranks == 1 ? lucky : rand() % ((ranks + 1) / 2);
        if (owner == rank)
            id[n++] = order[k];
    }
    return n;
}

static void rows_come_and_go(void)
{
    bool ok = true;
    for (unsigned seed = 1; seed < 20; seed++) {
        pd_global id[N], asked[2 * N];
        double values[2 * N], block[2 * N] = {0}, got[4 * N];
        pd_rows rows;
        const pd_local n = share_out(seed, id);
        ok &= pd_rows_create(world, n, id, N, &rows).code == PD_OK;
        for (pd_local k = 0; k < n; k++)
            values[2 * k] = (double)id[k], values[2 * k + 1] = -(double)id[k];
        ok &= pd_rows_put(&rows, 16, values, block).code == PD_OK;
        for (int64_t k = 0; k < pd_rows_mine(&rows); k++)
            ok &= block[2 * k] == (double)(rows.first + k) &&
                  block[2 * k + 1] == -(double)(rows.first + k);
        const size_t wanted = (size_t)(rank * 37 % (2 * N)); /* some twice, some never */
        for (size_t k = 0; k < wanted; k++)
            asked[k] = rand() % N;
        ok &= pd_rows_fetch(&rows, 16, block, wanted, asked, got).code == PD_OK;
        for (size_t k = 0; k < wanted; k++)
            ok &= got[2 * k] == (double)asked[k] && got[2 * k + 1] == -(double)asked[k];
    }
    check("rows come and go", ok, "a value is in another row");
}

static void numbers_are_checked(void)
{
    pd_global id[N];
    pd_rows rows;
    pd_local n = share_out(3, id);
    bool ok = true;
    for (pd_local k = 0; k < n; k++)
        if (id[k] == 40)
            id[k] = 41;
    const pd_status twice = pd_rows_create(world, n, id, N, &rows);
    ok &= same_status(twice, PD_BAD_ARGUMENT) && twice.point == 40;
    n = share_out(3, id);
    ok &= same_status(pd_rows_create(world, n, id, N + 1, &rows), PD_BAD_ARGUMENT);
    for (pd_local k = 0; k < n; k++)
        if (id[k] == 40)
            id[k] = N;
    ok &= same_status(pd_rows_create(world, n, id, N, &rows), PD_BAD_ARGUMENT);
    check("numbers of points are checked", ok, "not the same error on all ranks");
}

typedef struct {
    pd_global key;
    double value;
} entry;

/* Row k has the entries k + 1 ... k + k % 5 (twice those that two ranks have). */
static void lists_come_and_go(void)
{
    bool ok = true;
    pd_global id[N], row[10 * N], asked[N];
    entry of[10 * N];
    pd_rows rows;
    const pd_local n = share_out(5, id);
    ok &= pd_rows_create(world, n, id, N, &rows).code == PD_OK;
    size_t m = 0;
    for (pd_local k = 0; k < n; k++)
        for (pd_global e = id[k] % 5; e > 0; e--) { /* falling */
            row[m] = id[k];
            of[m++] = (entry){id[k] + e, 0.5 * (double)(id[k] + e)};
        }
    if (rank == ranks - 1) { /* not its own */
        row[m] = 8;
        of[m++] = (entry){9, 4.5};
    }
    pd_lists blocks, lists;
    ok &= pd_rows_put_lists(&rows, sizeof *of, m, row, of, &blocks).code == PD_OK;
    for (int k = 0; k < N; k++)
        asked[k] = (k * 31 + rank) % N;
    const size_t wanted = rank % 2 ? N / 2 : N;
    ok &= pd_rows_fetch_lists(&rows, &blocks, wanted, asked, &lists).code == PD_OK;
    for (size_t k = 0; k < wanted && ok; k++) {
        ok &= lists.first[k + 1] - lists.first[k] == asked[k] % 5;
        for (int64_t e = lists.first[k]; e < lists.first[k + 1] && ok; e++) {
            entry got;
            memcpy(&got, lists.entry + (size_t)e * lists.size, sizeof got);
            ok &= got.key == asked[k] + 1 + e - lists.first[k] &&
                  got.value == 0.5 * (double)got.key;
        }
    }
    pd_lists_free(&blocks);
    pd_lists_free(&lists);
    check("lists come and go", ok, "a list has other entries");
}

/* ---- files ---- */

/* Each rank writes (rank * 5) % 7 * scale rows. */
static pd_status write_file(int64_t scale, double mark)
{
    const int64_t n = rank * 5 % 7 * scale, first = pd_count_before(world, n);
    double *values = malloc((size_t)n * 16 + 1);
    for (int64_t k = 0; k < n; k++)
        values[2 * k] = mark + (double)(first + k), values[2 * k + 1] = -values[2 * k];
    pd_file *file;
    pd_status status = pd_file_create(world, path, &kind, &file);
    if (status.code == PD_OK) {
        status = pd_file_write(file, &values_of, n, values);
        if (status.code == PD_OK)
            status = pd_file_write(file, &again, n, values);
        if (status.code == PD_OK)
            status = pd_file_put_number(file, "mark", mark);
        if (status.code == PD_OK)
            status = pd_file_finish(file);
        else
            pd_file_drop(file);
    }
    free(values);
    return status;
}

static bool file_has(int64_t scale, double mark)
{
    int64_t all = rank * 5 % 7 * scale, rows;
    double found, pair[2];
    pd_file *file;
    pd_count_all(world, &all, 1);
    if (pd_file_open(world, path, &kind, &file).code != PD_OK)
        return false;
    bool ok = pd_file_count(file, &values_of, &rows).code == PD_OK && rows == all;
    ok = ok && pd_file_number(file, "mark", &found).code == PD_OK && found == mark;
    for (int64_t k = 0; ok && k < 10 && all > 0; k++) {
        const int64_t row = (all / 10 * k + rank) % all;
        ok =
            pd_file_read(file, k % 2 ? &values_of : &again, row, 1, pair).code == PD_OK &&
            pair[0] == mark + (double)row && pair[1] == -pair[0];
    }
    pd_file_drop(file);
    return ok;
}

static void file_is_written_and_read(void)
{
    check("a small file", write_file(3, 1).code == PD_OK && file_has(3, 1), "other rows");
    check("a file of megabytes", write_file(40000, 2).code == PD_OK && file_has(40000, 2),
          "other rows");
    check("a file without rows", write_file(0, 3).code == PD_OK && file_has(0, 3),
          "not read");
}

static void errors_are_the_same_on_all_ranks(void)
{
    pd_file *file;
    double pair[2];
    bool ok = write_file(3, 1).code == PD_OK;
    if (rank == 0 && truncate(path, 1000) != 0)
        ok = false;
    MPI_Barrier(world);
    ok = ok && same_status(pd_file_open(world, path, &kind, &file), PD_FILE_ERROR);
    if (rank == 0)
        unlink(path);
    MPI_Barrier(world);
    ok = ok && same_status(pd_file_open(world, path, &kind, &file), PD_FILE_ERROR);
    ok = ok && write_file(3, 1).code == PD_OK &&
         pd_file_open(world, path, &kind, &file).code == PD_OK;
    if (ok) { /* beyond its end, on one rank */
        ok = same_status(pd_file_read(file, &values_of, rank == ranks - 1 ? 1 << 20 : 0,
                                      rank == ranks - 1, pair),
                         PD_FILE_ERROR);
        pd_file_drop(file);
    }
    ok = ok && same_status(pd_file_create(world, "/nowhere/file.h5", &kind, &file),
                           PD_FILE_ERROR);
    check("errors are the same everywhere", ok, "not the same on all ranks");
}

/* /dev/full's like: a small disk, if there is one. */
static void full_disk_is_an_error(const char *small)
{
    const bool there = access(small, W_OK) == 0;
    char before[sizeof path];
    if (!there)
        return;
    memcpy(before, path, sizeof path);
    snprintf(path, sizeof path, "%s/rows.h5", small);
    bool ok = write_file(3, 1).code == PD_OK;
    const pd_status status = write_file(400000, 2);
    /* A single rank has no rows here. */
    ok = ok && (ranks == 1 ||
                (same_status(status, PD_FILE_ERROR) &&
                 strstr(status.message, "No space left") != NULL && file_has(3, 1)));
    check("a full disk is an error", ok, status.message);
    memcpy(path, before, sizeof path);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    world = MPI_COMM_WORLD;
    MPI_Comm_rank(world, &rank);
    MPI_Comm_size(world, &ranks);
    snprintf(path, sizeof path, "%s/rows.h5", argc > 1 ? argv[1] : ".");
    const int before = handles_open();
    rows_come_and_go();
    numbers_are_checked();
    lists_come_and_go();
    file_is_written_and_read();
    errors_are_the_same_on_all_ranks();
    full_disk_is_an_error(argc > 2 ? argv[2] : "/nowhere");
    check("no handle is left open", handles_open() == before,
          "there are more than before");
    if (rank == 0)
        unlink(path);
    MPI_Finalize();
    return failures > 0;
}
