/*
 * What the unit tests share: clouds of points, bodies made of them, maps that deform
 * bodies, and an assertion on doubles.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef TESTS_UNIT_LATTICE_H
#define TESTS_UNIT_LATTICE_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "pd.h"

/* ---- assertion ---- */

/* |value - expected| <= tolerance; a NaN fails. */
#define assert_near(value, expected, tolerance)                                          \
    assert_near_(value, expected, tolerance, #value, __FILE__, __LINE__)

static inline void assert_near_(double value, double expected, double tolerance,
                                const char *text, const char *file, int line)
{
    if (fabs(value - expected) <= tolerance)
        return;
    print_error("%s is %.17g, expected %.17g within %g\n", text, value, expected,
                tolerance);
    _fail(file, line);
}

#define assert_ok(call) assert_ok_(call, #call, __FILE__, __LINE__)

static inline void assert_ok_(pd_status status, const char *text, const char *file,
                              int line)
{
    if (status.code == PD_OK)
        return;
    print_error("%s: code %d, %s\n", text, (int)status.code, status.message);
    _fail(file, line);
}

/* ---- clouds ---- */

typedef struct {
    int d;
    size_t n;
    double *X;      /* [n][3], m; the third is 0 in two dimensions */
    double *volume; /* [n] */
} points;

/* The next of a fixed sequence of numbers, even in [-1, 1]. */
static inline double next_random(uint32_t *seed)
{
    *seed = *seed * UINT32_C(1664525) + UINT32_C(1013904223);
    return (double)(*seed >> 8) / (1 << 23) - 1;
}

/* Middles and volumes of a tensor grid of cells, the first h wide, each next one `growth`
 * times as wide. Point (i ny + j) nz + k; nz counts for 1 in two dimensions. */
static inline points graded(int d, int nx, int ny, int nz, double h, double growth)
{
    const int count[3] = {nx, ny, d == 2 ? 1 : nz};
    const size_t n = (size_t)(count[0] * count[1] * count[2]);
    points cloud = {d, n, calloc(3 * n, sizeof(double)), malloc(n * sizeof(double))};
    for (size_t p = 0; p < n; p++) {
        const int yz = (int)(p / (size_t)count[2]);
        const int index[3] = {yz / count[1], yz % count[1], (int)(p % (size_t)count[2])};
        cloud.volume[p] = 1;
        for (int a = 0; a < d; a++) {
            double left = 0, width = h;
            for (int k = 0; k < index[a]; k++, width *= growth)
                left += width;
            cloud.X[3 * p + (size_t)a] = left + width / 2;
            cloud.volume[p] *= width;
        }
    }
    return cloud;
}

static inline points lattice(int d, int nx, int ny, int nz, double h)
{
    return graded(d, nx, ny, nz, h, 1);
}

/* Move every point by up to `amplitude` along each axis; volumes stay. */
static inline void jitter(points *cloud, double amplitude)
{
    uint32_t seed = 7;
    for (size_t p = 0; p < cloud->n; p++)
        for (int a = 0; a < cloud->d; a++)
            cloud->X[3 * p + (size_t)a] += amplitude * next_random(&seed);
}

static inline void points_free(points *cloud)
{
    free(cloud->X);
    free(cloud->volume);
    *cloud = (points){0};
}

/* ---- bodies ---- */

/* More than any family of a test has. */
#define MOST_NEIGHBOURS 1024

/* A value that the parameter's bounds allow. */
static inline double some_value(const pd_parameter *p)
{
    if (isfinite(p->above) && isfinite(p->below))
        return p->above + 0.9 * (p->below - p->above);
    return isfinite(p->above) ? p->above + 80 : isfinite(p->below) ? p->below - 80 : 80;
}

/* A body that cannot break: neo-Hookean, G = 80, nu_stab = 0.35. */
static inline pd_body_options options_of(int d, double horizon_ratio)
{
    pd_body_options options = {
        .dimension = d,
        .horizon_ratio = horizon_ratio,
        .density = 1.5,
        .formulation = pd_formulation_find("correspondence"),
        .material = pd_material_find("neoHookean"),
    };
    for (int k = 0; k < options.material->n_parameters; k++)
        options.parameters[k] = some_value(&options.material->parameters[k]);
    return options;
}

static inline pd_body *body_with_holds(const points *cloud,
                                       const pd_body_options *options,
                                       const unsigned char *held)
{
    pd_body *body = NULL;
    assert_ok(pd_body_create(MPI_COMM_NULL, options, cloud->n, cloud->X, cloud->volume,
                             held, NULL, &body));
    assert_non_null(body);
    return body;
}

static inline pd_body *body_of(const points *cloud, const pd_body_options *options)
{
    return body_with_holds(cloud, options, NULL);
}

/* local[n]: where the caller's point of each number went. */
static inline pd_local *places_of(const pd_body *body)
{
    const pd_body_view view = pd_body_fields(body);
    pd_local *local = malloc((size_t)view.n_owned * sizeof *local);
    for (pd_local p = 0; p < view.n_owned; p++)
        local[view.id[p]] = p;
    return local;
}

static inline pd_local place_of(const pd_body *body, pd_global id)
{
    const pd_body_view view = pd_body_fields(body);
    for (pd_local p = 0; p < view.n_owned; p++)
        if (view.id[p] == id)
            return p;
    fail_msg("no point has number %ld", (long)id);
    return -1;
}

/* ---- maps ---- */

/* y = A X + b; in two dimensions the first two rows and columns count. */
typedef struct {
    double A[9], b[3];
} affine;

typedef void (*motion)(const double *X, const void *context, double *y);

static inline void move_affinely(const double *X, const void *context, double *y)
{
    const affine *map = context;
    for (int r = 0; r < 3; r++) {
        y[r] = map->b[r];
        for (int c = 0; c < 3; c++)
            y[r] += map->A[3 * r + c] * X[c];
    }
}

/* Smooth, all components of the gradient different, amplitude *context (m). */
static inline void move_in_waves(const double *X, const void *context, double *y)
{
    const double amplitude = *(const double *)context;
    const double a = 9 * X[0] + 4 * X[1] - 3 * X[2], b = 5 * X[0] - 11 * X[1] + 6 * X[2];
    y[0] = X[0] + amplitude * sin(a);
    y[1] = X[1] + amplitude * (cos(b) - 0.5 * sin(a + b));
    y[2] = X[2] + amplitude * (sin(b) + 0.3 * cos(2 * a));
}

/* Where the motion takes all points, held ones too: target[n_local][d]. */
static inline void targets_of(const pd_body *body, motion move, const void *context,
                              double *target)
{
    const pd_body_view view = pd_body_fields(body);
    const size_t d = (size_t)view.dimension;
    for (size_t p = 0; p < (size_t)view.n_local; p++) {
        double X[3] = {0}, y[3];
        memcpy(X, view.X + p * d, d * sizeof *X);
        move(X, context, y);
        memcpy(target + p * d, y, d * sizeof *y);
    }
}

/* Put all points there; no history hears of it. */
static inline void body_place(pd_body *body, motion move, const void *context)
{
    targets_of(body, move, context, pd_body_fields(body).y);
}

/* The same; a body with a history goes there in one step of a second. */
static inline void body_move(pd_body *body, motion move, const void *context)
{
    const pd_body_view view = pd_body_fields(body);
    const size_t d = (size_t)view.dimension, n = (size_t)view.n_local;
    double *target = malloc(n * d * sizeof *target);
    targets_of(body, move, context, target);
    if (pd_body_has_history(body)) {
        assert_ok(pd_body_forces(body));
        for (size_t c = 0; c < (size_t)view.n_owned * d; c++)
            view.v[c] = target[c] - view.y[c];
        assert_ok(pd_body_advance(body, 1, 0));
    }
    memcpy(view.y, target, n * d * sizeof *target);
    free(target);
}

static inline void body_map(pd_body *body, const affine *map)
{
    body_move(body, move_affinely, map);
}

static inline const affine *at_rest(void)
{
    static const affine map = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0}};
    return &map;
}

/* A turn by `angle` about z in two dimensions, about (1, 2, 2)/3 in three. */
static inline affine rotation(int d, double angle)
{
    const double c = cos(angle), s = sin(angle);
    const double z[3] = {0, 0, 1}, oblique[3] = {1. / 3, 2. / 3, 2. / 3};
    const double *axis = d == 2 ? z : oblique;
    affine map = {{c, -s * axis[2], s * axis[1], s * axis[2], c, -s * axis[0],
                   -s * axis[1], s * axis[0], c},
                  {0}};
    for (int k = 0; k < 9; k++)
        map.A[k] += (1 - c) * axis[k / 3] * axis[k % 3];
    return map;
}

/* A stretch and shear without symmetry; F33 = 1 in two dimensions. */
static inline affine distortion(int d)
{
    if (d == 2)
        return (affine){{1.21, 0.17, 0, -0.08, 0.93, 0, 0, 0, 1}, {0.4, -0.3, 0}};
    return (affine){{1.21, 0.17, -0.05, -0.08, 0.93, 0.11, 0.13, 0.04, 1.06},
                    {0.4, -0.3, 0.2}};
}

static inline double determinant3(const double *A)
{
    return A[0] * (A[4] * A[8] - A[5] * A[7]) - A[1] * (A[3] * A[8] - A[5] * A[6]) +
           A[2] * (A[3] * A[7] - A[4] * A[6]);
}

/* Largest absolute value of n numbers; NaN if any is. */
static inline double largest(const double *values, size_t n)
{
    double most = 0;
    for (size_t k = 0; k < n; k++)
        if (!(fabs(values[k]) <= most))
            most = fabs(values[k]);
    return most;
}

#endif
