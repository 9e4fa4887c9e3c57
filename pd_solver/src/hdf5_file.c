/*
 * Files of rows; see hdf5_file.h.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifdef __linux__
#define _GNU_SOURCE /* fallocate, sync_file_range */
#else
#define _POSIX_C_SOURCE 200809L
#endif

#include "hdf5_file.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <libgen.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <hdf5.h>

#include "checksum.h"
#include "collective.h"
#include "status.h"

/* Bytes that each have a checksum of their own: the file's is that of theirs, so that
 * ranks share the work. A part of the layout. */
#define BLOCK (INT64_C(1) << 20)

/* Room for what HDF5 says of a file, with the attributes that it has, and of a data set.
 */
#define METADATA 65536
#define METADATA_OF_ROWS 16384

/* Bytes of a rank in one call of MPI-IO. */
#define MOST_AT_ONCE (INT64_C(1) << 28)

#define LONGEST_TEXT 4096

struct pd_file {
    MPI_Comm comm; /* borrowed */
    pd_file_kind kind;
    int version;
    int64_t size;
    char *path;
    char *part;       /* where it is written; NULL: it is read */
    int on_disk;      /* rank 0's descriptor of part, or -1 */
    hid_t id;         /* HDF5's, or negative */
    int64_t reserved; /* bytes, no less than what HDF5 uses */
    bool failed;      /* a write did: the file is not to be finished */
};

/* ---- HDF5 keeps its errors to itself ---- */

typedef struct {
    H5E_auto2_t report;
    void *context;
} voice;

static voice hush(void)
{
    voice v = {NULL, NULL};
    H5Eget_auto2(H5E_DEFAULT, &v.report, &v.context);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return v;
}

static void unhush(voice v)
{
    H5Eset_auto2(H5E_DEFAULT, v.report, v.context);
}

/* ---- errors ---- */

/* What of a path fits into a message. */
static const char *end_of(const char *path)
{
    const size_t most = 130, length = strlen(path);
    return length > most ? path + length - most : path;
}

pd_status pd_file_error(const char *path, const char *format, ...)
{
    char what[200];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    const char *end = end_of(path);
    return pd_status_fail(PD_FILE_ERROR, -1, "%s%s: %s", end == path ? "" : "...", end,
                          what);
}

static pd_status system_error(const char *path, const char *doing, int number)
{
    return pd_file_error(path, "cannot %s: %s", doing, strerror(number));
}

static pd_status hdf5_error(const pd_file *f, const char *doing, const char *name)
{
    return pd_file_error(f->path, "HDF5 cannot %s%s%s", doing, name ? " " : "",
                         name ? name : "");
}

const char *pd_file_path(const pd_file *f)
{
    return f->path;
}

int pd_file_version(const pd_file *f)
{
    return f->version;
}

int64_t pd_file_size(const pd_file *f)
{
    return f->size;
}

/* ---- bytes ---- */

/* Read n bytes; false at the end of the file and on errors, with errno 0 or not. */
static bool read_bytes(int descriptor, int64_t from, size_t n, void *bytes)
{
    errno = 0;
    for (size_t got = 0; got < n;) {
        const ssize_t k =
            pread(descriptor, (char *)bytes + got, n - got, (off_t)(from + (int64_t)got));
        if (k < 0 && errno == EINTR)
            continue;
        if (k <= 0)
            return false;
        got += (size_t)k;
    }
    return true;
}

static bool write_bytes(int descriptor, int64_t from, size_t n, const void *bytes)
{
    for (size_t put = 0; put < n;) {
        const ssize_t k = pwrite(descriptor, (const char *)bytes + put, n - put,
                                 (off_t)(from + (int64_t)put));
        if (k < 0 && errno == EINTR)
            continue;
        if (k <= 0) {
            errno = k == 0 ? ENOSPC : errno;
            return false;
        }
        put += (size_t)k;
    }
    return true;
}

/* Checksums of the blocks of this rank's share. */
static pd_status sum_blocks(const char *path, int descriptor, int64_t size, int64_t first,
                            int64_t last, uint64_t *sums)
{
    pd_checksum_table table;
    char *bytes = malloc(BLOCK);
    if (!bytes)
        return pd_status_fail(PD_NO_MEMORY, -1, "a block of a file");
    pd_checksum_tabulate(&table);
    pd_status status = pd_status_ok();
    for (int64_t k = first; k < last && status.code == PD_OK; k++) {
        const int64_t from = PD_FILE_HEADER + k * BLOCK, left = size - from;
        const size_t n = (size_t)(left < BLOCK ? left : BLOCK);
        if (read_bytes(descriptor, from, n, bytes))
            sums[k] = pd_checksum(&table, 0, bytes, n);
        else
            status = system_error(path, "read it", errno ? errno : EIO);
    }
    free(bytes);
    return status;
}

static uint64_t sum_of_sums(const uint64_t *sums, int64_t n)
{
    pd_checksum_table table;
    uint64_t sum = 0;
    pd_checksum_tabulate(&table);
    for (int64_t k = 0; k < n; k++) {
        unsigned char bytes[8];
        for (int c = 0; c < 8; c++)
            bytes[c] = (unsigned char)(sums[k] >> 8 * c);
        sum = pd_checksum(&table, sum, bytes, sizeof bytes);
    }
    return sum;
}

/* Checksum of all that follows the header. Collective. */
static pd_status check_sum(MPI_Comm comm, const char *path, int descriptor, int64_t size,
                           uint64_t *sum)
{
    const int64_t blocks = (size - PD_FILE_HEADER + BLOCK - 1) / BLOCK;
    const int rank = pd_rank_of(comm), ranks = pd_ranks_of(comm);
    uint64_t *sums = calloc((size_t)blocks + 1, sizeof *sums);
    pd_status status = pd_status_ok();
    if (!sums)
        status = pd_status_fail(PD_NO_MEMORY, -1, "checksums of a file");
    else
        status = sum_blocks(path, descriptor, size, blocks * rank / ranks,
                            blocks * (rank + 1) / ranks, sums);
    status = pd_agree(comm, status);
    if (status.code == PD_OK) {
        pd_count_all(comm, (int64_t *)sums, (int)blocks); /* all but one are 0 */
        *sum = sum_of_sums(sums, blocks);
    }
    free(sums);
    return status;
}

/* ---- the header ---- */

typedef struct {
    char kind[32];
    int version;
    int64_t size;
    uint64_t sum;
} header;

static void render(const header *h, char *text)
{
    memset(text, 0, PD_FILE_HEADER);
    snprintf(text, PD_FILE_HEADER,
             "periFoam %s\nversion %d\nlength %020" PRId64 "\ncrc64 %016" PRIx64
             "\nWhat follows is HDF5: h5dump and ParaView read this file as it is.\n",
             h->kind, h->version, h->size, h->sum);
}

static bool is_hdf5(int descriptor, int64_t at)
{
    char magic[8];
    return read_bytes(descriptor, at, sizeof magic, magic) &&
           memcmp(magic, "\211HDF\r\n\032\n", sizeof magic) == 0;
}

/* Why text, which does not begin as a header does, is none. */
static pd_status tell_foreign(const char *path, int descriptor, int64_t size,
                              const char *kind, const char *text)
{
    if (size == 0)
        return pd_file_error(path, "is empty");
    if (is_hdf5(descriptor, PD_FILE_HEADER) && text[0] == 0)
        return pd_file_error(path, "was not finished: who wrote it ended too early");
    for (int64_t at = 0; at <= 65536; at = at ? 2 * at : 512)
        if (is_hdf5(descriptor, at))
            return pd_file_error(path, "is an HDF5 file, but no periFoam %s", kind);
    return pd_file_error(path, "is no periFoam %s", kind);
}

/* Take the header of a file apart, and find out what is wrong with it. */
static pd_status read_header(const char *path, int descriptor, int64_t size,
                             const pd_file_kind *kind, header *h)
{
    char text[PD_FILE_HEADER + 1] = {0}, again[PD_FILE_HEADER];
    const size_t there = (size_t)(size < PD_FILE_HEADER ? size : PD_FILE_HEADER);
    if (!read_bytes(descriptor, 0, there, text))
        return system_error(path, "read it", errno ? errno : EIO);
    const char begins[] = "periFoam ";
    const size_t length = there < strlen(begins) ? there : strlen(begins);
    if (there == 0 || memcmp(text, begins, length) != 0)
        return tell_foreign(path, descriptor, size, kind->name, text);
    if (there < PD_FILE_HEADER)
        return pd_file_error(path, "is cut short: %" PRId64 " bytes", size);
    const int got =
        sscanf(text, "periFoam %31[a-z]\nversion %9d\nlength %" SCNd64 "\ncrc64 %" SCNx64,
               h->kind, &h->version, &h->size, &h->sum);
    if (got < 2 || h->version < 1)
        return pd_file_error(path, "is damaged at its beginning");
    if (strcmp(h->kind, kind->name) != 0)
        return pd_file_error(path, "is a periFoam %s; expected: a %s", h->kind,
                             kind->name);
    if (h->version > kind->version)
        return pd_file_error(path, "is of version %d; this program reads up to %d",
                             h->version, kind->version);
    if (got == 4)
        render(h, again);
    if (got < 4 || memcmp(text, again, sizeof again) != 0)
        return pd_file_error(path, "is damaged at its beginning");
    if (size != h->size)
        return pd_file_error(path, "is %s: %" PRId64 " bytes of %" PRId64,
                             size < h->size ? "cut short" : "too long", size, h->size);
    return pd_status_ok();
}

/* ---- opening ---- */

static pd_file *new_file(MPI_Comm comm, const char *path, const pd_file_kind *kind,
                         bool writing)
{
    pd_file *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    *f = (pd_file){.comm = comm,
                   .kind = *kind,
                   .version = kind->version,
                   .on_disk = -1,
                   .id = H5I_INVALID_HID};
    const size_t size = strlen(path) + 1;
    f->path = malloc(size);
    f->part = writing ? malloc(size + 5) : NULL;
    if (!f->path || (writing && !f->part)) {
        free(f->path);
        free(f->part);
        free(f);
        return NULL;
    }
    memcpy(f->path, path, size);
    if (writing)
        snprintf(f->part, size + 5, "%s.part", path);
    return f;
}

static void free_file(pd_file *f)
{
    free(f->path);
    free(f->part);
    free(f);
}

/* Of regular files alone; a fifo would wait for ever. */
static pd_status open_bytes(const char *path, int *descriptor, int64_t *size)
{
    struct stat about;
    *descriptor = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (*descriptor < 0)
        return system_error(path, "open it", errno);
    if (fstat(*descriptor, &about) != 0)
        return system_error(path, "open it", errno);
    if (!S_ISREG(about.st_mode))
        return pd_file_error(path, "is no file");
    *size = about.st_size;
    return pd_status_ok();
}

/* Is the file what its header says? Collective. */
static pd_status verify(pd_file *f)
{
    header h = {.version = 0};
    int descriptor = -1;
    uint64_t sum = 0;
    pd_status status = open_bytes(f->path, &descriptor, &f->size);
    if (status.code == PD_OK)
        status = read_header(f->path, descriptor, f->size, &f->kind, &h);
    status = pd_agree(f->comm, status);
    if (status.code == PD_OK)
        status = check_sum(f->comm, f->path, descriptor, f->size, &sum);
    if (status.code == PD_OK && sum != h.sum)
        status = pd_file_error(f->path, "is damaged: its checksum is wrong");
    f->version = h.version;
    if (descriptor >= 0)
        close(descriptor);
    return pd_agree(f->comm, status);
}

/* Locks of HDF5 are refused by some file systems; nobody writes to a file that is read.
 */
static hid_t access_properties(const pd_file *f)
{
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_LATEST);
    H5Pset_sieve_buf_size(access, 0); /* writes fail when they are made, or not at all */
#if H5_VERSION_GE(1, 10, 7) && !(H5_VERS_MINOR == 12 && H5_VERS_RELEASE == 0)
    H5Pset_file_locking(access, false, true);
#endif
#ifdef H5_HAVE_PARALLEL
    if (f->part && pd_ranks_of(f->comm) > 1)
        H5Pset_fapl_mpio(access, f->comm, MPI_INFO_NULL);
#endif
    return access;
}

pd_status pd_file_open(MPI_Comm comm, const char *path, const pd_file_kind *kind,
                       pd_file **file)
{
    *file = NULL;
    pd_file *f = new_file(comm, path, kind, false);
    pd_status status =
        pd_agree(comm, f ? pd_status_ok() : pd_status_fail(PD_NO_MEMORY, -1, "a file"));
    if (status.code == PD_OK)
        status = verify(f);
    if (status.code == PD_OK) {
        /* Each rank for itself: rows are read in slabs as they stand. */
        const voice v = hush();
        const hid_t access = access_properties(f);
        f->id = H5Fopen(path, H5F_ACC_RDONLY, access);
        H5Pclose(access);
        unhush(v);
        status = pd_agree(comm, f->id < 0 ? hdf5_error(f, "open it", NULL) : status);
    }
    if (status.code == PD_OK)
        *file = f;
    else
        pd_file_drop(f);
    return status;
}

/* ---- creating ---- */

/* Reserve `bytes` after what the file has: 0, or an errno. HDF5 must not meet a full
 * disk: it could not close the file any more, and would crash when the program ends. */
static int reserve(pd_file *f, int64_t bytes)
{
    const int64_t end = f->reserved;
    struct rlimit limit;
    if (bytes < 0 || bytes > INT64_MAX - end)
        return EFBIG;
    if (getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY &&
        (uint64_t)end + (uint64_t)bytes > limit.rlim_cur)
        return EFBIG;
#ifdef __linux__
    if (fallocate(f->on_disk, 0, (off_t)end, (off_t)bytes) != 0 && errno != EOPNOTSUPP &&
        errno != ENOSYS && errno != EINVAL && errno != EINTR)
        return errno;
#endif
    f->reserved += bytes;
    return 0;
}

/* Where nothing could be reserved: give a file up and let go of its blocks, so that HDF5
 * finds room to close what it has opened. */
static void give_up(pd_file *f)
{
    f->failed = true;
    if (f->on_disk >= 0 && ftruncate(f->on_disk, 0) != 0)
        return; /* nothing more can be done */
}

/* Let the disk begin with what there is, while we go on. */
static void start_writing(const pd_file *f)
{
#ifdef __linux__
    if (f->on_disk >= 0)
        sync_file_range(f->on_disk, 0, 0, SYNC_FILE_RANGE_WRITE);
#else
    (void)f;
#endif
}

/* reserve, on rank 0, for all ranks. Collective. */
static pd_status reserve_all(pd_file *f, int64_t bytes)
{
    pd_status status = pd_status_ok();
    if (pd_rank_of(f->comm) == 0) {
        const int number = reserve(f, bytes);
        if (number)
            status = system_error(f->path, "write it", number);
    }
    return pd_agree(f->comm, status);
}

/* Not even an empty file may fail in HDF5's hands: try whether there is room for it. */
static bool write_nothing(const pd_file *f)
{
    char *nothing = calloc(1, METADATA);
    const bool ok = nothing && write_bytes(f->on_disk, 0, METADATA, nothing);
    free(nothing);
    return ok;
}

static pd_status create_part(pd_file *f)
{
    if (pd_rank_of(f->comm) != 0)
        return pd_status_ok();
    f->on_disk = open(f->part, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (f->on_disk < 0 || !write_nothing(f))
        return system_error(f->path, "write it", errno);
    return pd_status_ok();
}

static pd_status create_in_hdf5(pd_file *f)
{
    const hid_t access = access_properties(f), creation = H5Pcreate(H5P_FILE_CREATE);
    H5Pset_userblock(creation, PD_FILE_HEADER);
    H5Pset_obj_track_times(creation, false);
    f->id = H5Fcreate(f->part, H5F_ACC_TRUNC, creation, access);
    H5Pclose(creation);
    H5Pclose(access);
    return pd_agree(f->comm,
                    f->id < 0 ? hdf5_error(f, "create it", NULL) : pd_status_ok());
}

pd_status pd_file_create(MPI_Comm comm, const char *path, const pd_file_kind *kind,
                         pd_file **file)
{
    *file = NULL;
    pd_file *f = new_file(comm, path, kind, true);
    pd_status status =
        pd_agree(comm, f ? pd_status_ok() : pd_status_fail(PD_NO_MEMORY, -1, "a file"));
    const voice v = hush();
    if (status.code == PD_OK)
        status = pd_agree(comm, create_part(f));
    if (status.code == PD_OK)
        status = create_in_hdf5(f);
    if (status.code == PD_OK)
        status = reserve_all(f, METADATA);
    unhush(v);
    if (status.code == PD_OK)
        status = pd_file_put_text(f, "format", "periFoam");
    if (status.code == PD_OK)
        status = pd_file_put_text(f, "kind", kind->name);
    if (status.code == PD_OK)
        status = pd_file_put_integer(f, "version", kind->version);
    if (status.code == PD_OK)
        *file = f;
    else
        pd_file_drop(f);
    return status;
}

/* ---- closing ---- */

void pd_file_drop(pd_file *f)
{
    if (!f)
        return;
    const voice v = hush();
    if (f->part && f->id >= 0)
        give_up(f);
    if (f->id >= 0)
        H5Fclose(f->id);
    unhush(v);
    if (f->on_disk >= 0) {
        close(f->on_disk);
        unlink(f->part);
    }
    free_file(f);
}

/* After the folder's entry for the file itself, so that neither survives alone. */
static pd_status rename_part(const pd_file *f)
{
    if (rename(f->part, f->path) != 0)
        return system_error(f->path, "put it in place", errno);
    char *copy = strdup(f->path);
    const int folder = copy ? open(dirname(copy), O_RDONLY | O_CLOEXEC) : -1;
    free(copy);
    if (folder >= 0) {
        fsync(folder); /* some file systems have none for folders */
        close(folder);
    }
    return pd_status_ok();
}

/* Give back what was reserved and not used: where HDF5's part of the file ends stands in
 * its superblock, of version 2 or 3, at a fixed place. */
static void trim(const pd_file *f)
{
    unsigned char block[36];
    struct stat about;
    int64_t end = 0;
    if (f->on_disk < 0 || fstat(f->on_disk, &about) != 0 ||
        !read_bytes(f->on_disk, PD_FILE_HEADER, sizeof block, block) ||
        (block[8] != 2 && block[8] != 3) || block[9] != 8)
        return;
    for (int k = 0; k < 8; k++)
        end |= (int64_t)block[28 + k] << 8 * k;
    end += PD_FILE_HEADER;
    if (end > PD_FILE_HEADER && end < about.st_size && ftruncate(f->on_disk, end) != 0)
        return; /* it stays a little longer than it must be */
}

/* Write the header and have all on the disk. */
static pd_status seal(const pd_file *f, const header *h)
{
    char text[PD_FILE_HEADER];
    if (pd_rank_of(f->comm) != 0)
        return pd_status_ok();
    render(h, text);
    if (!write_bytes(f->on_disk, 0, sizeof text, text) || fsync(f->on_disk) != 0)
        return system_error(f->path, "write it", errno);
    return rename_part(f);
}

/* Read what was written for its checksum, while it goes to the disk. */
static pd_status sum_part(pd_file *f, header *h)
{
    int descriptor = -1;
    pd_status status = pd_agree(f->comm, open_bytes(f->part, &descriptor, &h->size));
    if (status.code == PD_OK) {
        start_writing(f);
        status = check_sum(f->comm, f->path, descriptor, h->size, &h->sum);
        /* Other machines have their own part of it in memory. */
        if (status.code == PD_OK && f->on_disk < 0 && fsync(descriptor) != 0)
            status = system_error(f->path, "write it", errno);
    }
    if (descriptor >= 0)
        close(descriptor);
    return pd_agree(f->comm, status);
}

pd_status pd_file_finish(pd_file *f)
{
    header h = {.version = f->kind.version};
    snprintf(h.kind, sizeof h.kind, "%s", f->kind.name);
    const voice v = hush();
    pd_status status = pd_status_ok();
    if (f->failed || H5Fflush(f->id, H5F_SCOPE_LOCAL) < 0) {
        status = hdf5_error(f, "write it", NULL);
        give_up(f);
    }
    if (H5Fclose(f->id) < 0)
        status = hdf5_error(f, "close it", NULL);
    f->id = H5I_INVALID_HID;
    unhush(v);
    trim(f);
    status = pd_agree(f->comm, status);
    if (status.code == PD_OK)
        status = sum_part(f, &h);
    if (status.code == PD_OK)
        status = pd_agree(f->comm, seal(f, &h));
    if (status.code == PD_OK && f->on_disk >= 0) {
        close(f->on_disk);
        f->on_disk = -1;
    }
    pd_file_drop(f);
    return status;
}

/* ---- data sets ---- */

static const struct {
    size_t size;
} cells[PD_CELLS] = {[PD_DOUBLE] = {8},
                     [PD_SINGLE] = {4},
                     [PD_INT64] = {8},
                     [PD_INT32] = {4},
                     [PD_BYTE] = {1}};

/* How a cell is kept in the file, and in memory. */
static hid_t type_of(pd_cell cell, bool in_memory)
{
    switch (cell) {
    case PD_DOUBLE:
        return in_memory ? H5T_NATIVE_DOUBLE : H5T_IEEE_F64LE;
    case PD_SINGLE:
        return in_memory ? H5T_NATIVE_FLOAT : H5T_IEEE_F32LE;
    case PD_INT64:
        return in_memory ? H5T_NATIVE_INT64 : H5T_STD_I64LE;
    case PD_INT32:
        return in_memory ? H5T_NATIVE_INT32 : H5T_STD_I32LE;
    default:
        return in_memory ? H5T_NATIVE_UINT8 : H5T_STD_U8LE;
    }
}

static int64_t row_size(const pd_rows_of *rows)
{
    return (int64_t)cells[rows->cell].size * rows->width;
}

/* [count][width]; [count] where rows are single cells. */
static hid_t space_of(const pd_rows_of *rows, int64_t count)
{
    const hsize_t extent[] = {(hsize_t)count, (hsize_t)rows->width};
    return H5Screate_simple(rows->width > 1 ? 2 : 1, extent, NULL);
}

static bool put_attribute(hid_t at, const char *name, hid_t type, const void *value)
{
    const hid_t space = H5Screate(H5S_SCALAR);
    const hid_t id = H5Acreate2(at, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    const bool ok = id >= 0 && H5Awrite(id, type, value) >= 0;
    if (id >= 0)
        H5Aclose(id);
    H5Sclose(space);
    return ok;
}

static bool put_text(hid_t at, const char *name, const char *value)
{
    const hid_t type = H5Tcopy(H5T_C_S1);
    const bool ok =
        H5Tset_size(type, strlen(value) + 1) >= 0 && put_attribute(at, name, type, value);
    H5Tclose(type);
    return ok;
}

static hid_t create_rows(const pd_file *f, const pd_rows_of *rows, int64_t count)
{
    const hid_t space = space_of(rows, count), creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_layout(creation, H5D_CONTIGUOUS);
    H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY);
    H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER);
    H5Pset_obj_track_times(creation, false); /* the same state, the same bytes */
    const hid_t set = H5Dcreate2(f->id, rows->name, type_of(rows->cell, false), space,
                                 H5P_DEFAULT, creation, H5P_DEFAULT);
    H5Pclose(creation);
    H5Sclose(space);
    return set;
}

/* Rows [first, first + n) of a data set. */
static bool move_rows(hid_t set, const pd_rows_of *rows, int64_t first, int64_t n,
                      void *into, const void *from, hid_t transfer)
{
    const hsize_t start[] = {(hsize_t)first, 0};
    const hsize_t extent[] = {(hsize_t)n, (hsize_t)rows->width};
    const hid_t there = H5Dget_space(set), here = space_of(rows, n);
    const hid_t type = type_of(rows->cell, true);
    bool ok;
    if (n > 0)
        ok = H5Sselect_hyperslab(there, H5S_SELECT_SET, start, NULL, extent, NULL) >= 0;
    else
        ok = H5Sselect_none(there) >= 0 && H5Sselect_none(here) >= 0;
    if (into)
        ok = ok && H5Dread(set, type, here, there, transfer, into) >= 0;
    else /* collective, whatever the selection came to */
        ok = H5Dwrite(set, type, here, there, transfer, from) >= 0 && ok;
    H5Sclose(here);
    H5Sclose(there);
    return ok;
}

/* In pieces that MPI-IO can count, as many on each rank. */
static bool write_pieces(const pd_file *f, hid_t set, const pd_rows_of *rows,
                         int64_t first, int64_t n, const char *mine)
{
    const int64_t size = row_size(rows), most = MOST_AT_ONCE / size;
    const int64_t pieces = pd_most_of_all(f->comm, (n + most - 1) / most);
    const hid_t transfer = H5Pcreate(H5P_DATASET_XFER);
    bool ok = true;
#ifdef H5_HAVE_PARALLEL
    if (pd_ranks_of(f->comm) > 1) {
        H5Pset_dxpl_mpio(transfer, H5FD_MPIO_COLLECTIVE);
        /* Slabs are long: there is nothing to gather first. */
        H5Pset_dxpl_mpio_collective_opt(transfer, H5FD_MPIO_INDIVIDUAL_IO);
    }
#endif
    for (int64_t k = 0; k < pieces; k++) {
        const int64_t from = k * most < n ? k * most : n;
        const int64_t to = from + most < n ? from + most : n;
        ok &= move_rows(set, rows, first + from, to - from, NULL,
                        mine ? mine + from * size : "", transfer);
    }
    H5Pclose(transfer);
    return ok;
}

static pd_status write_rows(pd_file *f, const pd_rows_of *rows, int64_t n,
                            const void *mine)
{
    int64_t all = n;
    pd_count_all(f->comm, &all, 1);
    const int64_t first = pd_count_before(f->comm, n);
    f->failed = true; /* until it is done */
    PD_TRY(reserve_all(f, all * row_size(rows) + METADATA_OF_ROWS));
    const hid_t set = create_rows(f, rows, all);
    PD_TRY(
        pd_agree(f->comm, set < 0 ? hdf5_error(f, "write", rows->name) : pd_status_ok()));
    bool ok = put_text(set, "unit", rows->unit);
    ok = put_text(set, "description", rows->description) && ok;
    ok = write_pieces(f, set, rows, first, n, mine) && ok;
    const pd_status status =
        pd_agree(f->comm, ok ? pd_status_ok() : hdf5_error(f, "write", rows->name));
    if (status.code != PD_OK)
        give_up(f);
    H5Dclose(set);
    f->failed = status.code != PD_OK;
    start_writing(f);
    return status;
}

pd_status pd_file_write(pd_file *f, const pd_rows_of *rows, int64_t n, const void *mine)
{
    const voice v = hush();
    const pd_status status = write_rows(f, rows, n, mine);
    unhush(v);
    return status;
}

/* Only what stands in the file itself: links and data sets may lead to other files. */
static hid_t open_rows(const pd_file *f, const char *name)
{
    H5L_info_t link;
    H5O_info_t object;
    if (H5Lexists(f->id, name, H5P_DEFAULT) <= 0 ||
        H5Lget_info(f->id, name, &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD ||
        H5Oget_info_by_name(f->id, name, &object, H5P_DEFAULT) < 0 ||
        object.type != H5O_TYPE_DATASET)
        return H5I_INVALID_HID;
    return H5Dopen2(f->id, name, H5P_DEFAULT);
}

bool pd_file_has(const pd_file *f, const char *name)
{
    const voice v = hush();
    const bool there = H5Lexists(f->id, name, H5P_DEFAULT) > 0;
    unhush(v);
    return there;
}

/* Rows of a data set; -1 where it has another form. */
static int64_t count_rows(const pd_file *f, hid_t set, const pd_rows_of *rows)
{
    hsize_t extent[2] = {0, 1};
    const hid_t space = H5Dget_space(set), type = H5Dget_type(set);
    const hid_t creation = H5Dget_create_plist(set);
    bool ok = space >= 0 && type >= 0 && creation >= 0;
    ok = ok && H5Tequal(type, type_of(rows->cell, false)) > 0;
    ok = ok && H5Sget_simple_extent_ndims(space) == (rows->width > 1 ? 2 : 1);
    ok = ok && H5Sget_simple_extent_dims(space, extent, NULL) >= 0;
    ok = ok && extent[1] == (hsize_t)rows->width;
    ok = ok && H5Pget_layout(creation) == H5D_CONTIGUOUS &&
         H5Pget_external_count(creation) == 0;
    ok = ok && extent[0] <= (uint64_t)(f->size / row_size(rows)) &&
         H5Dget_storage_size(set) == extent[0] * (uint64_t)row_size(rows);
    H5Pclose(creation);
    H5Tclose(type);
    H5Sclose(space);
    return ok ? (int64_t)extent[0] : -1;
}

pd_status pd_file_count(pd_file *f, const pd_rows_of *rows, int64_t *count)
{
    const voice v = hush();
    const hid_t set = open_rows(f, rows->name);
    pd_status status = pd_status_ok();
    *count = set < 0 ? -1 : count_rows(f, set, rows);
    if (set < 0)
        status = pd_file_error(f->path, "has no data set %s", rows->name);
    else if (*count < 0)
        status = pd_file_error(f->path, "the data set %s has another form", rows->name);
    if (set >= 0)
        H5Dclose(set);
    unhush(v);
    return pd_agree(f->comm, status);
}

pd_status pd_file_read(pd_file *f, const pd_rows_of *rows, int64_t first, int64_t n,
                       void *values)
{
    const voice v = hush();
    const hid_t set = open_rows(f, rows->name);
    bool ok = set >= 0;
    if (n > 0)
        ok = ok && move_rows(set, rows, first, n, values, NULL, H5P_DEFAULT);
    if (set >= 0)
        H5Dclose(set);
    unhush(v);
    return pd_agree(f->comm, ok ? pd_status_ok() : hdf5_error(f, "read", rows->name));
}

/* ---- attributes ---- */

static pd_status put(pd_file *f, const char *name, bool ok)
{
    return pd_agree(f->comm, ok ? pd_status_ok() : hdf5_error(f, "write", name));
}

/* A type of the file's may differ from that in memory only in the order of its bytes. */
pd_status pd_file_put_number(pd_file *f, const char *name, double value)
{
    const voice v = hush();
    const bool ok = put_attribute(f->id, name, H5T_NATIVE_DOUBLE, &value);
    unhush(v);
    return put(f, name, ok);
}

pd_status pd_file_put_integer(pd_file *f, const char *name, int64_t value)
{
    const voice v = hush();
    const bool ok = put_attribute(f->id, name, H5T_NATIVE_INT64, &value);
    unhush(v);
    return put(f, name, ok);
}

pd_status pd_file_put_text(pd_file *f, const char *name, const char *value)
{
    const voice v = hush();
    const bool ok = put_text(f->id, name, value);
    unhush(v);
    return put(f, name, ok);
}

bool pd_file_knows(const pd_file *f, const char *name)
{
    const voice v = hush();
    const bool there = H5Aexists(f->id, name) > 0;
    unhush(v);
    return there;
}

/* Read a scalar attribute of a class of types, of up to `most` bytes in the file. */
static bool get_attribute(const pd_file *f, const char *name, H5T_class_t class,
                          size_t most, hid_t memory, void *value)
{
    const hid_t id =
        H5Aexists(f->id, name) > 0 ? H5Aopen(f->id, name, H5P_DEFAULT) : H5I_INVALID_HID;
    if (id < 0)
        return false;
    const hid_t type = H5Aget_type(id), space = H5Aget_space(id);
    bool ok = type >= 0 && space >= 0 && H5Tget_class(type) == class;
    ok = ok && H5Sget_simple_extent_type(space) == H5S_SCALAR;
    ok = ok && H5Tget_size(type) <= most && H5Tis_variable_str(type) <= 0;
    ok = ok && H5Aread(id, memory >= 0 ? memory : type, value) >= 0;
    H5Sclose(space);
    H5Tclose(type);
    H5Aclose(id);
    return ok;
}

static pd_status got(const pd_file *f, const char *name, bool ok)
{
    return pd_agree(f->comm,
                    ok ? pd_status_ok()
                       : pd_file_error(f->path, "has no %s, or of another kind", name));
}

pd_status pd_file_number(pd_file *f, const char *name, double *value)
{
    const voice v = hush();
    *value = 0;
    const bool ok = get_attribute(f, name, H5T_FLOAT, 8, H5T_NATIVE_DOUBLE, value);
    unhush(v);
    return got(f, name, ok);
}

pd_status pd_file_integer(pd_file *f, const char *name, int64_t *value)
{
    const voice v = hush();
    *value = 0;
    const bool ok = get_attribute(f, name, H5T_INTEGER, 8, H5T_NATIVE_INT64, value);
    unhush(v);
    return got(f, name, ok);
}

pd_status pd_file_text(pd_file *f, const char *name, size_t capacity, char *text)
{
    char whole[LONGEST_TEXT + 1] = {0};
    const voice v = hush();
    const bool ok = get_attribute(f, name, H5T_STRING, LONGEST_TEXT, -1, whole);
    unhush(v);
    snprintf(text, capacity, "%s", whole);
    return got(f, name, ok);
}

typedef struct {
    const char *prefix;
    size_t n, capacity, size;
    char *names;
} name_list;

static herr_t add_name(hid_t at, const char *name, const H5A_info_t *about, void *context)
{
    (void)at, (void)about;
    name_list *list = context;
    const size_t prefix = strlen(list->prefix);
    if (strncmp(name, list->prefix, prefix) == 0 && list->n < list->capacity &&
        strlen(name) < list->size)
        strcpy(list->names + list->n++ * list->size, name);
    return 0;
}

size_t pd_file_names(const pd_file *f, const char *prefix, size_t capacity, size_t size,
                     char *names)
{
    name_list list = {
        .prefix = prefix, .capacity = capacity, .size = size, .names = names};
    const voice v = hush();
    H5Aiterate2(f->id, H5_INDEX_NAME, H5_ITER_INC, NULL, add_name, &list);
    unhush(v);
    return list.n;
}
