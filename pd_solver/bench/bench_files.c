/*
 * How fast checkpoints' rows go to the disk and come back, against the same bytes written
 * plainly: write and fsync of one file of each rank.
 *
 *     [mpirun -np 2] build/bench/bench_files <folder> [megabytes a rank]
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _POSIX_C_SOURCE 200809L
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "hdf5_file.h"

enum { REPEATS = 5, WIDTH = 8, SETS = 4 };

static const pd_file_kind kind = {"checkpoint", 1};
static const pd_rows_of sets[SETS] = {{"a", "m", "eight each", PD_DOUBLE, WIDTH},
                                      {"b", "m", "eight each", PD_DOUBLE, WIDTH},
                                      {"c", "m", "eight each", PD_DOUBLE, WIDTH},
                                      {"d", "m", "eight each", PD_DOUBLE, WIDTH}};
static char path[4096], plain[4096];
static int rank, ranks;

static void must(pd_status status)
{
    if (status.code == PD_OK)
        return;
    fprintf(stderr, "%s\n", status.message);
    MPI_Abort(MPI_COMM_WORLD, 1);
}

static void must_be(bool ok, const char *what)
{
    if (ok)
        return;
    perror(what);
    MPI_Abort(MPI_COMM_WORLD, 1);
}

/* ---- what is timed ---- */

static void write_plainly(double *values, int64_t rows)
{
    const size_t size = (size_t)rows * WIDTH * sizeof *values;
    const int file = open(plain, O_RDWR | O_CREAT | O_TRUNC, 0666);
    for (int k = 0; k < SETS; k++)
        for (size_t put = 0; put < size;) {
            const ssize_t n = write(file, (const char *)values + put, size - put);
            must_be(n > 0, plain);
            put += (size_t)n;
        }
    must_be(fsync(file) == 0, plain);
    close(file);
}

static void write_rows(double *values, int64_t rows)
{
    pd_file *file;
    must(pd_file_create(MPI_COMM_WORLD, path, &kind, &file));
    for (int k = 0; k < SETS; k++)
        must(pd_file_write(file, &sets[k], rows, values));
    must(pd_file_finish(file));
}

static void read_plainly(double *values, int64_t rows)
{
    const size_t size = (size_t)rows * WIDTH * sizeof *values;
    const int file = open(plain, O_RDONLY);
    for (int k = 0; k < SETS; k++)
        for (size_t got = 0; got < size;) {
            const ssize_t n = read(file, (char *)values + got, size - got);
            must_be(n > 0, plain);
            got += (size_t)n;
        }
    close(file);
}

static void read_rows(double *values, int64_t rows)
{
    pd_file *file;
    must(pd_file_open(MPI_COMM_WORLD, path, &kind, &file));
    for (int k = 0; k < SETS; k++)
        must(pd_file_read(file, &sets[k], rank * rows, rows, values));
    pd_file_drop(file);
}

/* Out of the machine's memory, so that reading reads the disk. */
static void forget(const char *name)
{
    const int file = open(name, O_RDONLY);
    if (file < 0)
        return;
    posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
    close(file);
}

typedef void task(double *values, int64_t rows);

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double time_of(task *what, double *values, int64_t rows)
{
    MPI_Barrier(MPI_COMM_WORLD);
    forget(path);
    forget(plain);
    MPI_Barrier(MPI_COMM_WORLD);
    const double begin = MPI_Wtime();
    what(values, rows);
    MPI_Barrier(MPI_COMM_WORLD);
    return MPI_Wtime() - begin;
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    const char *folder = argc > 1 ? argv[1] : ".";
    const double megabytes = argc > 2 ? atof(argv[2]) : 200;
    const int64_t rows = (int64_t)(megabytes * 1e6 / SETS / WIDTH / sizeof(double));
    snprintf(path, sizeof path, "%s/bench.h5", folder);
    snprintf(plain, sizeof plain, "%s/bench.%d", folder, rank);
    double *values = malloc((size_t)rows * WIDTH * sizeof *values + 1);
    must_be(values, "memory");
    for (int64_t k = 0; k < rows * WIDTH; k++)
        values[k] = 1. / (double)(k + 1);
    const struct {
        const char *name;
        task *what;
    } tasks[] = {{"write plainly", write_plainly},
                 {"write rows", write_rows},
                 {"read plainly", read_plainly},
                 {"read rows", read_rows}};
    double seconds[4][REPEATS];
    for (int r = 0; r < REPEATS; r++) /* in turn: disks have moods */
        for (int t = 0; t < 4; t++)
            seconds[t][r] = time_of(tasks[t].what, values, rows);
    const double all = (double)rows * WIDTH * sizeof *values * SETS * ranks / 1e6;
    for (int t = 0; t < 4 && rank == 0; t++) {
        qsort(seconds[t], REPEATS, sizeof(double), by_size);
        printf("%-14s %d ranks %7.0f MB %6.3f s %7.0f MB/s\n", tasks[t].name, ranks, all,
               seconds[t][REPEATS / 2], all / seconds[t][REPEATS / 2]);
    }
    unlink(plain);
    if (rank == 0)
        unlink(path);
    free(values);
    MPI_Finalize();
    return 0;
}
