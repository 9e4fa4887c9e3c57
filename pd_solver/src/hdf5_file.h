/*
 * Files of rows, one for all ranks; the only user of HDF5.
 *
 * A file begins with 512 bytes of text (HDF5's user block): what it is, the version of
 * its layout, its length and a CRC-64 of all that follows. They are written last, and
 * read before HDF5 sees the file, so that files cut short, changed, foreign or newer are
 * told apart before anything is made of them. The rest is plain HDF5: data sets
 * [rows][width] without chunks or filters, attributes with numbers and words.
 *
 * Writing goes to `<path>.part`, which takes the place of `path` when it is whole and on
 * the disk; until then an earlier file stays as it was. Several ranks write at once, each
 * its rows, by MPI-IO; one rank, or MPI_COMM_NULL, without MPI. Space is reserved before
 * it is written: HDF5 cannot close a file whose disk is full.
 *
 * All functions are collective and return the same status on all ranks: PD_FILE_ERROR,
 * which names the file and what is wrong, or PD_NO_MEMORY.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_HDF5_FILE_H
#define PD_SRC_HDF5_FILE_H

#include "pd.h"

/* Bytes that stand before HDF5's. */
#define PD_FILE_HEADER 512

/* What a file is. */
typedef struct {
    const char *name; /* "checkpoint" */
    int version;      /* of the layout, 1 or above */
} pd_file_kind;

typedef enum { PD_DOUBLE, PD_SINGLE, PD_INT64, PD_INT32, PD_BYTE, PD_CELLS } pd_cell;

/* A data set: how each is called, in which unit, and what it means. */
typedef struct {
    const char *name, *unit, *description;
    pd_cell cell; /* of the file; PD_SINGLE: double in memory */
    int width;
} pd_rows_of;

typedef struct pd_file pd_file;

/* Begin to write. *file is NULL on error; followed by pd_file_finish or pd_file_drop. */
pd_status pd_file_create(MPI_Comm comm, const char *path, const pd_file_kind *kind,
                         pd_file **file);

/* Append a data set of the rows of all ranks, rank after rank: mine[n_mine][width]. */
pd_status pd_file_write(pd_file *file, const pd_rows_of *rows, int64_t n_mine,
                        const void *mine);

/* Attributes of the file. */
pd_status pd_file_put_number(pd_file *file, const char *name, double value);
pd_status pd_file_put_integer(pd_file *file, const char *name, int64_t value);
pd_status pd_file_put_text(pd_file *file, const char *name, const char *value);

/* Put the file in its place, whole; frees it, after an error too, when the earlier file
 * under that name is as it was. */
pd_status pd_file_finish(pd_file *file);

/* Open a file that is whole, of that kind and of no newer version. *file is NULL on
 * error; followed by pd_file_drop. */
pd_status pd_file_open(MPI_Comm comm, const char *path, const pd_file_kind *kind,
                       pd_file **file);

/* Close a file that was opened, or give up one that was created. NULL is allowed. */
void pd_file_drop(pd_file *file);

int pd_file_version(const pd_file *file);
int64_t pd_file_size(const pd_file *file); /* bytes */

/* Is there such a data set? */
bool pd_file_has(const pd_file *file, const char *name);

/* How many rows a data set has; an error where cell or width differ, or where the file
 * does not hold as many bytes. */
pd_status pd_file_count(pd_file *file, const pd_rows_of *rows, int64_t *count);

/* Read rows [first, first + n) of a data set, all of which pd_file_count counted. */
pd_status pd_file_read(pd_file *file, const pd_rows_of *rows, int64_t first, int64_t n,
                       void *values);

/* Attributes; an error that names the missing. text holds `capacity` bytes. */
bool pd_file_knows(const pd_file *file, const char *name);
pd_status pd_file_number(pd_file *file, const char *name, double *value);
pd_status pd_file_integer(pd_file *file, const char *name, int64_t *value);
pd_status pd_file_text(pd_file *file, const char *name, size_t capacity, char *text);

/* Names of attributes that begin with `prefix`, in order: names[capacity][size]; those
 * that do not fit are left out. */
size_t pd_file_names(const pd_file *file, const char *prefix, size_t capacity,
                     size_t size, char *names);

/* PD_FILE_ERROR of that file. */
pd_status pd_file_error(const char *path, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
const char *pd_file_path(const pd_file *file);

#endif
