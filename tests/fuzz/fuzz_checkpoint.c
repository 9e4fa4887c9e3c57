/*
 * Any bytes in place of a checkpoint: `make fuzz-reader SECONDS=60`. They are refused, or
 * the file is what was once written; nothing crashes and nothing is read beyond its end.
 *
 * The first byte says what the others are: the file itself, or changes of a good file,
 * three bytes each (a place and what is added to the byte there; past the end: cut
 * there).
 *
 * HDF5 sees no file whose checksum is wrong: that is what stands between it and the
 * bytes.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _GNU_SOURCE /* mkdtemp */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "pd.h"

static char folder[] = "/dev/shm/fuzz.XXXXXX", path[80];
static unsigned char good[1 << 16];
static size_t good_size;

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size);

static void must(int ok, const char *what)
{
    if (ok)
        return;
    fprintf(stderr, "%s\n", what);
    abort();
}

static void forget(void)
{
    unlink(path);
    rmdir(folder);
}

/* A checkpoint of a few points with a note. */
static void save_good(void)
{
    enum { N = 12 };
    pd_body_options o = {.dimension = 2,
                         .horizon_ratio = 2.015,
                         .density = 1,
                         .formulation = pd_formulation_find("correspondence"),
                         .material = pd_material_find("neoHookean"),
                         .parameters = {80, 0.3},
                         .critical_stretch = 1.5};
    double X[3 * N] = {0}, volume[N];
    pd_body *body = NULL;
    for (int p = 0; p < N; p++)
        X[3 * p] = p % 4, X[3 * p + 1] = p / 4, volume[p] = 1;
    pd_status status = pd_body_create(MPI_COMM_NULL, &o, N, X, volume, NULL, NULL, &body);
    must(status.code == PD_OK, status.message);
    const pd_body_view view = pd_body_fields(body);
    for (int p = 0; p < N; p++)
        view.y[2 * p] *= view.X[2 * p] > 1.5 ? 3 : 1; /* some bonds break */
    status = pd_body_forces(body);
    must(status.code == PD_OK, status.message);
    const pd_note note = {.name = "time", .number = 1};
    status = pd_checkpoint_save(body, path, 1, &note);
    must(status.code == PD_OK, status.message);
    pd_body_destroy(body);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    (void)argc, (void)argv;
    must(mkdtemp(folder) != NULL, "no folder in /dev/shm");
    snprintf(path, sizeof path, "%s/body.h5", folder);
    atexit(forget);
    save_good();
    FILE *file = fopen(path, "rb");
    must(file != NULL, path);
    good_size = fread(good, 1, sizeof good, file);
    must(good_size < sizeof good, "the good file is longer than expected");
    fclose(file);
    return 0;
}

/* The good file, changed; returns its size. */
static size_t change(const unsigned char *data, size_t size, unsigned char *bytes)
{
    size_t end = good_size;
    memcpy(bytes, good, good_size);
    for (; size >= 3; data += 3, size -= 3) {
        const size_t at = (size_t)data[0] << 8 | data[1];
        if (at < good_size)
            bytes[at] = (unsigned char)(bytes[at] + data[2]);
        else
            end = at % (good_size + 1);
    }
    return end;
}

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size)
{
    static unsigned char bytes[sizeof good];
    pd_checkpoint_facts facts;
    if (size < 1 || size > sizeof bytes)
        return 0;
    size_t end = size - 1;
    if (data[0] & 1)
        end = change(data + 1, size - 1, bytes);
    else
        memcpy(bytes, data + 1, end);
    FILE *file = fopen(path, "wb");
    must(file && fwrite(bytes, 1, end, file) == end, path);
    fclose(file);
    const int same = end == good_size && memcmp(bytes, good, end) == 0;
    const pd_status status = pd_checkpoint_check(path, &facts);
    must(status.code == (same ? PD_OK : PD_FILE_ERROR), status.message);
    must(same || strstr(status.message, "body.h5"), "an error that names no file");
    return 0;
}
