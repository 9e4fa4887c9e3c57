/*
 * Points for ParaView: rows by the caller's numbers, and a list of the times that are
 * there.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _GNU_SOURCE /* mkdtemp */
#include <stdio.h>
#include <unistd.h>

#include "hdf5_file.h"
#include "lattice.h"

static char folder[] = "/tmp/test_picture.XXXXXX";
static const pd_file_kind kind = {"fields", 1};

static int make_folder(void **state)
{
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    char command[80];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

static char *list_of_times(const char *name)
{
    static char text[10000];
    char path[80];
    snprintf(path, sizeof path, "%s/%s.xdmf", folder, name);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    text[fread(text, 1, sizeof text - 1, file)] = 0;
    fclose(file);
    return text;
}

static void read_rows(const char *name, const pd_rows_of *what, int64_t n, void *values)
{
    char path[80];
    pd_file *file;
    int64_t rows;
    snprintf(path, sizeof path, "%s/%s.h5", folder, name);
    assert_ok(pd_file_open(MPI_COMM_NULL, path, &kind, &file));
    assert_ok(pd_file_count(file, what, &rows));
    assert_int_equal(rows, n);
    assert_ok(pd_file_read(file, what, 0, n, values));
    pd_file_drop(file);
}

static pd_body *some_body(const points *cloud)
{
    const pd_body_options options = options_of(cloud->d, 3.015);
    pd_body *body = body_of(cloud, &options);
    const double amplitude = 0.01;
    body_move(body, move_in_waves, &amplitude);
    assert_ok(pd_body_forces(body));
    return body;
}

/* A plane of the body's axes 0 and 1 that are 2 and 0 of the picture, at 5 m. */
static void rows_are_those_of_the_callers_numbers(void **state)
{
    points cloud = lattice(2, 9, 8, 1, 0.1);
    pd_body *body = some_body(&cloud);
    const pd_body_view view = pd_body_fields(body);
    double *mark = malloc(cloud.n * sizeof *mark), *sigma = malloc(6 * cloud.n * 8);
    for (size_t p = 0; p < cloud.n; p++)
        mark[p] = 0.5 * (double)view.id[p];
    pd_body_stress(body, sigma, NULL);
    const pd_field field = {"mark", "-", "half the number", 1, mark};
    const char *const own[] = {"displacement", "stress"};
    const pd_picture picture = {.time = 0.25,
                                .n_own = 2,
                                .own = own,
                                .n_fields = 1,
                                .fields = &field,
                                .axes = {2, 0, 1},
                                .origin = {0, 5, 0}};
    assert_ok(pd_body_write_picture(body, folder, "turned", &picture));
    double *x = malloc(3 * cloud.n * 8), *u = malloc(3 * cloud.n * 8);
    double *s = malloc(6 * cloud.n * 8), *m = malloc(cloud.n * 8);
    const int64_t n = (int64_t)cloud.n;
    read_rows("turned_0.25", &(pd_rows_of){"position", "", "", PD_DOUBLE, 3}, n, x);
    read_rows("turned_0.25", &(pd_rows_of){"displacement", "", "", PD_DOUBLE, 3}, n, u);
    read_rows("turned_0.25", &(pd_rows_of){"stress", "", "", PD_DOUBLE, 6}, n, s);
    read_rows("turned_0.25", &(pd_rows_of){"mark", "", "", PD_DOUBLE, 1}, n, m);
    for (size_t p = 0; p < cloud.n; p++) {
        const size_t k = (size_t)view.id[p];
        const double *y = view.y + 2 * p, *X = view.X + 2 * p, *t = sigma + 6 * p;
        assert_true(x[3 * k + 2] == y[0] && x[3 * k] == y[1] && x[3 * k + 1] == 5);
        assert_true(u[3 * k + 2] == y[0] - X[0] && u[3 * k] == y[1] - X[1] &&
                    u[3 * k + 1] == 0);
        assert_true(m[k] == 0.5 * (double)k);
        /* 11 22 33 12 23 13 of axes that were 1 2 0: 22 33 11 23 13 12 */
        const double expected[] = {t[1], t[2], t[0], t[4], t[5], t[3]};
        assert_memory_equal(s + 6 * k, expected, sizeof expected);
    }
    void *arrays[] = {mark, sigma, x, u, s, m};
    for (size_t k = 0; k < 6; k++)
        free(arrays[k]);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* Shorter numbers, none of them beyond what they hold. */
static void numbers_may_be_short(void **state)
{
    points cloud = lattice(3, 4, 4, 4, 0.1);
    pd_body *body = some_body(&cloud);
    double *mark = calloc(cloud.n, sizeof *mark);
    float *got = malloc(cloud.n * sizeof *got);
    mark[0] = 1e300;
    mark[1] = -0.1;
    const pd_field field = {"mark", "-", "", 1, mark};
    const pd_picture picture = {.single = true, .n_fields = 1, .fields = &field};
    assert_ok(pd_body_write_picture(body, folder, "short", &picture));
    read_rows("short_0", &(pd_rows_of){"mark", "", "", PD_SINGLE, 1}, (int64_t)cloud.n,
              got);
    const pd_body_view view = pd_body_fields(body);
    assert_true(got[view.id[0]] == 3.40282347e38f);
    assert_true(got[view.id[1]] == -0.1f);
    free(mark);
    free(got);
    pd_body_destroy(body);
    points_free(&cloud);
}

static int count(const char *text, const char *word)
{
    int n = 0;
    while ((text = strstr(text, word)))
        text++, n++;
    return n;
}

/* Of a run that is continued from 0.2, whose file of 0.1 is gone. */
static void list_has_the_times_that_are_there(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 0.1);
    pd_body *body = some_body(&cloud);
    pd_picture picture = {.n_own = 0};
    char path[80];
    for (int k = 0; k < 5; k++) {
        picture.time = 0.1 * k;
        assert_ok(pd_body_write_picture(body, folder, "times", &picture));
    }
    assert_int_equal(count(list_of_times("times"), "<Time "), 5);
    snprintf(path, sizeof path, "%s/times_0.1.h5", folder);
    assert_int_equal(unlink(path), 0);
    picture.time = 0.25;
    assert_ok(pd_body_write_picture(body, folder, "times", &picture));
    const char *list = list_of_times("times");
    assert_int_equal(count(list, "<Time "), 3);
    assert_non_null(strstr(list, "\"times_0.h5\""));
    assert_non_null(strstr(list, "\"times_0.2.h5\""));
    assert_non_null(strstr(list, "\"times_0.25.h5\""));
    picture.time = 0.25; /* again */
    assert_ok(pd_body_write_picture(body, folder, "times", &picture));
    assert_int_equal(count(list_of_times("times"), "<Time "), 3);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void what_cannot_be_drawn_is_said(void **state)
{
    points cloud = lattice(2, 5, 4, 1, 0.1);
    pd_body *body = some_body(&cloud);
    const char *const unknown[] = {"temperature"};
    pd_field field = {"mark", "-", "", 2, NULL};
    pd_picture p = {.n_own = 1, .own = unknown};
    char path[80];
    assert_int_equal(pd_body_write_picture(body, folder, "a", &p).code, PD_BAD_ARGUMENT);
    p = (pd_picture){.n_fields = 1, .fields = &field};
    assert_int_equal(pd_body_write_picture(body, folder, "a", &p).code, PD_BAD_ARGUMENT);
    p = (pd_picture){.axes = {0, 0, 1}};
    assert_int_equal(pd_body_write_picture(body, folder, "a", &p).code, PD_BAD_ARGUMENT);
    p = (pd_picture){.time = NAN};
    assert_int_equal(pd_body_write_picture(body, folder, "a", &p).code, PD_BAD_ARGUMENT);
    p = (pd_picture){.time = 1};
    assert_int_equal(pd_body_write_picture(body, folder, "a/b", &p).code,
                     PD_BAD_ARGUMENT);
    assert_int_equal(pd_body_write_picture(body, "/nowhere/b", "a", &p).code,
                     PD_FILE_ERROR);
    snprintf(path, sizeof path, "%s/theirs.xdmf", folder);
    FILE *file = fopen(path, "w");
    fputs("<Xdmf/>\n", file);
    fclose(file);
    const pd_status status = pd_body_write_picture(body, folder, "theirs", &p);
    assert_int_equal(status.code, PD_FILE_ERROR);
    assert_non_null(strstr(status.message, "no list of times"));
    assert_string_equal(list_of_times("theirs"), "<Xdmf/>\n");
    pd_body_destroy(body);
    points_free(&cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_are_those_of_the_callers_numbers),
        cmocka_unit_test(numbers_may_be_short),
        cmocka_unit_test(list_has_the_times_that_are_there),
        cmocka_unit_test(what_cannot_be_drawn_is_said),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
