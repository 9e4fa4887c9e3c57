/*
 * Files of rows: what is written comes back, and no other file is taken for one.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _GNU_SOURCE /* mkdtemp, fallocate */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "../handles.h"
#include "checksum.h"
#include "hdf5_file.h"
#include "lattice.h"

enum { ROWS = 50 };

static const pd_file_kind kind = {"checkpoint", 2};
static const pd_rows_of numbers = {"numbers", "m", "three each", PD_DOUBLE, 3};
static const pd_rows_of counts = {"counts", "-", "one each", PD_INT32, 1};

static char folder[] = "/tmp/test_files.XXXXXX", path[128], part[128], other[128];
static int open_before;
static int reports = -1; /* what stood for standard error */

static int make_folder(void **state)
{
    if (!mkdtemp(folder))
        return -1;
    snprintf(path, sizeof path, "%s/rows.h5", folder);
    snprintf(part, sizeof part, "%s/rows.h5.part", folder);
    snprintf(other, sizeof other, "%s/other", folder);
    signal(SIGXFSZ, SIG_IGN);
    open_before = handles_open();
    return 0;
}

static int remove_folder(void **state)
{
    unlink(path);
    unlink(other);
    return rmdir(folder);
}

/* ---- a disk that reserves nothing ---- */

/* The linker puts this in place of fallocate, so that writes meet the full disk. */
int __wrap_fallocate(int descriptor, int mode, off_t from, off_t size);
int __real_fallocate(int descriptor, int mode, off_t from, off_t size);
static bool reserves_nothing;

int __wrap_fallocate(int descriptor, int mode, off_t from, off_t size)
{
    if (!reserves_nothing)
        return __real_fallocate(descriptor, mode, from, size);
    errno = EOPNOTSUPP;
    return -1;
}

/* ---- writing and reading ---- */

static double number(int64_t row, int column, double mark)
{
    return mark + (double)row + 0.1 * column;
}

/* `rows` rows and two attributes. */
static pd_status write_rows(const char *to, int64_t rows, double mark)
{
    double *values = malloc((size_t)(3 * rows) * sizeof *values + 1);
    int32_t *count = malloc((size_t)rows * sizeof *count + 1);
    for (int64_t k = 0; k < rows; k++) {
        for (int c = 0; c < 3; c++)
            values[3 * k + c] = number(k, c, mark);
        count[k] = (int32_t)(7 * k);
    }
    pd_file *file;
    pd_status status = pd_file_create(MPI_COMM_NULL, to, &kind, &file);
    if (status.code == PD_OK) {
        status = pd_file_put_number(file, "mark", mark);
        if (status.code == PD_OK)
            status = pd_file_put_text(file, "word", "sailcloth");
        if (status.code == PD_OK)
            status = pd_file_write(file, &numbers, rows, values);
        if (status.code == PD_OK)
            status = pd_file_write(file, &counts, rows, count);
        if (status.code == PD_OK)
            status = pd_file_finish(file);
        else
            pd_file_drop(file);
    }
    free(values);
    free(count);
    return status;
}

static pd_status open_file(pd_file **file)
{
    return pd_file_open(MPI_COMM_NULL, path, &kind, file);
}

/* The mark of the file, all rows of which are as they were written. */
static double read_rows(void)
{
    pd_file *file;
    double values[3 * ROWS], mark;
    int32_t count[ROWS];
    int64_t rows;
    assert_ok(open_file(&file));
    assert_ok(pd_file_number(file, "mark", &mark));
    assert_ok(pd_file_count(file, &numbers, &rows));
    assert_int_equal(rows, ROWS);
    assert_ok(pd_file_read(file, &numbers, 0, ROWS, values));
    assert_ok(pd_file_read(file, &counts, 0, ROWS, count));
    for (int k = 0; k < ROWS; k++) {
        assert_int_equal(count[k], 7 * k);
        for (int c = 0; c < 3; c++)
            assert_true(values[3 * k + c] == number(k, c, mark));
    }
    pd_file_drop(file);
    return mark;
}

static bool exists(const char *name)
{
    return access(name, F_OK) == 0;
}

static int64_t size_of(const char *name)
{
    struct stat about;
    assert_int_equal(stat(name, &about), 0);
    return about.st_size;
}

static char *bytes_of(const char *name, int64_t size)
{
    char *bytes = malloc((size_t)size + 1);
    FILE *file = fopen(name, "rb");
    assert_int_equal(fread(bytes, 1, (size_t)size, file), size);
    fclose(file);
    return bytes;
}

static void put_bytes(const char *name, const char *bytes, int64_t size)
{
    FILE *file = fopen(name, "wb");
    assert_int_equal(fwrite(bytes, 1, (size_t)size, file), size);
    fclose(file);
}

/* The file is refused, for a reason that holds `why`, by its name. */
static void assert_refused(const char *why)
{
    pd_file *file;
    const pd_status status = open_file(&file);
    assert_null(file);
    if (status.code != PD_FILE_ERROR || !strstr(status.message, why) ||
        !strstr(status.message, "rows.h5"))
        fail_msg("expected '%s', got code %d '%s'", why, (int)status.code,
                 status.message);
}

/* ---- tests ---- */

static void what_is_written_comes_back(void **state)
{
    pd_file *file;
    char word[20];
    double mark;
    int64_t version, rows;
    double row[3];
    assert_ok(write_rows(path, ROWS, 4));
    assert_true(read_rows() == 4);
    assert_false(exists(part));
    assert_ok(open_file(&file));
    assert_ok(pd_file_text(file, "word", sizeof word, word));
    assert_string_equal(word, "sailcloth");
    assert_ok(pd_file_integer(file, "version", &version));
    assert_int_equal(version, 2);
    assert_ok(pd_file_read(file, &numbers, ROWS - 1, 1, row));
    assert_true(row[2] == number(ROWS - 1, 2, 4));
    assert_false(pd_file_has(file, "none"));
    assert_int_equal(pd_file_integer(file, "mark", &version).code, PD_FILE_ERROR);
    assert_int_equal(pd_file_number(file, "none", &mark).code, PD_FILE_ERROR);
    assert_int_equal(pd_file_number(file, "word", &mark).code, PD_FILE_ERROR);
    const pd_rows_of wide = {"numbers", "m", "", PD_DOUBLE, 4};
    const pd_rows_of floats = {"numbers", "m", "", PD_SINGLE, 3};
    assert_int_equal(pd_file_count(file, &wide, &rows).code, PD_FILE_ERROR);
    assert_int_equal(pd_file_count(file, &floats, &rows).code, PD_FILE_ERROR);
    pd_file_drop(file);
}

static void file_without_rows_comes_back(void **state)
{
    pd_file *file;
    int64_t rows = -1;
    assert_ok(write_rows(path, 0, 4));
    assert_ok(open_file(&file));
    assert_ok(pd_file_count(file, &numbers, &rows));
    assert_int_equal(rows, 0);
    pd_file_drop(file);
}

/* CRC-64 of xz, of its nine digits; and of bytes in two parts, at every length. */
static void checksum_is_that_of_xz(void **state)
{
    pd_checksum_table table;
    pd_checksum_tabulate(&table);
    assert_true(pd_checksum(&table, 0, "123456789", 9) == UINT64_C(0x995dc9bbdf1939fa));
    const char bytes[] = "sixteen bytes at a time, and then those that are left over";
    const uint64_t whole = pd_checksum(&table, 0, bytes, sizeof bytes);
    for (size_t n = 0; n <= sizeof bytes; n++)
        assert_true(pd_checksum(&table, pd_checksum(&table, 0, bytes, n), bytes + n,
                                sizeof bytes - n) == whole);
}

/* From its end to its beginning, so that it need not be written again and again. */
static void file_cut_short_is_refused_at_every_length(void **state)
{
    assert_ok(write_rows(path, ROWS, 4));
    const int64_t size = size_of(path);
    assert_int_equal(truncate(path, size + 1), 0);
    assert_refused("is too long");
    for (int64_t n = size - 1; n >= 0; n--) {
        assert_int_equal(truncate(path, n), 0);
        assert_refused(n == 0 ? "is empty" : "is cut short");
    }
}

static void put_byte(int64_t at, char byte)
{
    const int descriptor = open(path, O_WRONLY);
    assert_int_equal(pwrite(descriptor, &byte, 1, at), 1);
    close(descriptor);
}

/* One bit of every byte of the file: its header, HDF5's own, attributes, rows. */
static void no_changed_byte_goes_unnoticed(void **state)
{
    assert_ok(write_rows(path, ROWS, 4));
    const int64_t size = size_of(path);
    char *bytes = bytes_of(path, size);
    for (int64_t n = 0; n < size; n++) {
        put_byte(n, (char)(bytes[n] ^ 1 << n % 8));
        assert_refused("");
        put_byte(n, bytes[n]);
    }
    assert_true(read_rows() == 4);
    free(bytes);
}

static void other_files_are_told_apart(void **state)
{
    const pd_file_kind newer = {"checkpoint", 3}, fields = {"fields", 1};
    pd_file *file;
    unlink(path);
    assert_refused("No such file");
    assert_ok(pd_file_create(MPI_COMM_NULL, path, &newer, &file));
    assert_ok(pd_file_finish(file));
    assert_refused("is of version 3; this program reads up to 2");
    assert_ok(pd_file_create(MPI_COMM_NULL, path, &fields, &file));
    assert_ok(pd_file_finish(file));
    assert_refused("is a periFoam fields; expected: a checkpoint");
    put_bytes(path, "solid flap\nfacet normal 0 0 1\n", 30);
    assert_refused("is no periFoam checkpoint");
    put_bytes(path, "periFoam is a library", 21);
    assert_refused("is cut short: 21 bytes");

    assert_ok(write_rows(path, ROWS, 4));
    const int64_t size = size_of(path);
    char *bytes = bytes_of(path, size);
    put_bytes(path, bytes + PD_FILE_HEADER, size - PD_FILE_HEADER);
    assert_refused("is an HDF5 file, but no periFoam checkpoint");
    memset(bytes, 0, PD_FILE_HEADER);
    put_bytes(path, bytes, size);
    assert_refused("was not finished");
    free(bytes);

    unlink(path);
    mkdir(path, 0777);
    assert_refused("is no file");
    rmdir(path);
    mkfifo(path, 0666);
    assert_refused("is no file");
    unlink(path);
}

/* An older version is for the reader to deal with. */
static void older_version_is_read(void **state)
{
    const pd_file_kind old = {"checkpoint", 1};
    pd_file *file;
    assert_ok(pd_file_create(MPI_COMM_NULL, path, &old, &file));
    assert_ok(pd_file_finish(file));
    assert_ok(open_file(&file));
    assert_int_equal(pd_file_version(file), 1);
    pd_file_drop(file);
}

static void file_that_is_dropped_leaves_nothing(void **state)
{
    pd_file *file;
    assert_ok(write_rows(path, ROWS, 4));
    put_bytes(part, "left by a run that crashed", 26);
    assert_ok(pd_file_create(MPI_COMM_NULL, path, &kind, &file));
    assert_true(exists(part));
    pd_file_drop(file);
    assert_false(exists(part));
    assert_true(read_rows() == 4);
}

static void what_cannot_be_written_is_said(void **state)
{
    put_bytes(other, "", 0);
    const char *const places[] = {"/nowhere/rows.h5", "/proc/rows.h5"};
    char below[160];
    pd_file *file;
    for (size_t k = 0; k < 2; k++) {
        const pd_status status = pd_file_create(MPI_COMM_NULL, places[k], &kind, &file);
        assert_int_equal(status.code, PD_FILE_ERROR);
        assert_non_null(strstr(status.message, places[k]));
        assert_null(file);
    }
    snprintf(below, sizeof below, "%s/rows.h5", other);
    const pd_status status = pd_file_create(MPI_COMM_NULL, below, &kind, &file);
    assert_non_null(strstr(status.message, "Not a directory"));
}

/* ---- full disks ---- */

/* A write that failed: it says why, leaves the earlier file as it was and nothing else.
 */
static void assert_nothing_happened(pd_status status, const char *why)
{
    assert_int_equal(status.code, PD_FILE_ERROR);
    if (why && !strstr(status.message, why))
        fail_msg("expected '%s', got '%s'", why, status.message);
    assert_false(exists(part));
    assert_true(read_rows() == 4);
}

/* With files of at most that many bytes. */
static pd_status write_limited(int64_t most)
{
    struct rlimit before, limit;
    getrlimit(RLIMIT_FSIZE, &before);
    limit = before;
    limit.rlim_cur = (rlim_t)most;
    setrlimit(RLIMIT_FSIZE, &limit);
    const pd_status status = write_rows(path, 20000, 5);
    setrlimit(RLIMIT_FSIZE, &before);
    return status;
}

static void limit_of_size_is_an_error(void **state)
{
    assert_ok(write_rows(path, 20000, 4));
    const int64_t size = size_of(path);
    assert_ok(write_rows(path, ROWS, 4));
    for (int64_t most = 0; most < size; most += size / 37)
        assert_nothing_happened(write_limited(most), "File too large");
    assert_ok(write_limited(size + 200000));
}

/* Mount a small file system, if we may. */
static bool mount_small(void)
{
    if (geteuid() != 0 || mount("none", folder, "tmpfs", 0, "size=800k") != 0)
        return false;
    return true;
}

/* Fill the disk up but for that many bytes. */
static void fill_disk(int64_t left)
{
    const int descriptor = open(other, O_RDWR | O_CREAT | O_TRUNC, 0666);
    char bytes[4096] = {1};
    while (write(descriptor, bytes, sizeof bytes) > 0)
        continue;
    assert_int_equal(ftruncate(descriptor, lseek(descriptor, 0, SEEK_END) - left), 0);
    close(descriptor);
}

static void write_on_full_disks(bool reserves)
{
    reserves_nothing = !reserves;
    int written = 0;
    for (int64_t left = 0; left < 720000; left += 24576) {
        assert_ok(write_rows(path, ROWS, 4));
        fill_disk(left);
        const pd_status status = write_rows(path, 10000, 5);
        if (status.code == PD_OK)
            written++;
        else
            assert_nothing_happened(status, reserves ? "No space left" : NULL);
        unlink(other);
    }
    assert_true(written > 0);
    reserves_nothing = false;
}

static void full_disk_is_an_error(void **state)
{
    unlink(path);
    if (!mount_small())
        skip();
    write_on_full_disks(true);
    umount(folder);
}

/* HDF5 meets the full disk itself where none reserves. */
static void full_disk_that_reserves_nothing_is_an_error(void **state)
{
    unlink(path);
    if (!mount_small())
        skip();
    write_on_full_disks(false);
    umount(folder);
}

/* ---- silence ---- */

static int listen_to_errors(void **state)
{
    fflush(stderr);
    reports = dup(STDERR_FILENO);
    const int to = open(other, O_RDWR | O_CREAT | O_TRUNC, 0666);
    dup2(to, STDERR_FILENO);
    close(to);
    return 0;
}

static int stop_listening(void **state)
{
    dup2(reports, STDERR_FILENO);
    close(reports);
    return 0;
}

static void errors_are_not_printed(void **state)
{
    pd_file *file;
    double values[3 * ROWS];
    assert_ok(write_rows(path, ROWS, 4));
    assert_ok(open_file(&file));
    const pd_rows_of none = {"none", "m", "", PD_DOUBLE, 4};
    assert_int_equal(pd_file_read(file, &none, 0, 1, values).code, PD_FILE_ERROR);
    assert_int_equal(pd_file_read(file, &numbers, ROWS, 1, values).code, PD_FILE_ERROR);
    pd_file_drop(file);
    fflush(stderr);
    assert_int_equal(size_of(other), 0);
}

/* Whatever went wrong before. */
static void no_handle_is_left_open(void **state)
{
    assert_int_equal(handles_open(), open_before);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_written_comes_back),
        cmocka_unit_test(file_without_rows_comes_back),
        cmocka_unit_test(checksum_is_that_of_xz),
        cmocka_unit_test(file_cut_short_is_refused_at_every_length),
        cmocka_unit_test(no_changed_byte_goes_unnoticed),
        cmocka_unit_test(other_files_are_told_apart),
        cmocka_unit_test(older_version_is_read),
        cmocka_unit_test(file_that_is_dropped_leaves_nothing),
        cmocka_unit_test(what_cannot_be_written_is_said),
        cmocka_unit_test(limit_of_size_is_an_error),
        cmocka_unit_test(full_disk_is_an_error),
        cmocka_unit_test(full_disk_that_reserves_nothing_is_an_error),
        cmocka_unit_test_setup_teardown(errors_are_not_printed, listen_to_errors,
                                        stop_listening),
        cmocka_unit_test(no_handle_is_left_open),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
