/*
 * Relaxation: the answers it reaches, how many iterations that takes, what it reports.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _GNU_SOURCE /* feenableexcept */
#include <fenv.h>

#include "lattice.h"

/* G = 80, nu_stab = 0.35 of options_of(). */
#define SHEAR 80.
#define BULK 240.

#define PI 3.14159265358979323846

/* Spacing of most bodies here, m. */
#define STEP 0.1

/* ---- counting allocations ---- */

static size_t allocations;

/* The program's own functions, in front of glibc's; a sanitizer brings its own. */
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t n, size_t size);
extern void *__libc_realloc(void *old, size_t size);

void *malloc(size_t size)
{
    allocations++;
    return __libc_malloc(size);
}

void *calloc(size_t n, size_t size)
{
    allocations++;
    return __libc_calloc(n, size);
}

void *realloc(void *old, size_t size)
{
    allocations++;
    return __libc_realloc(old, size);
}
#endif

/* ---- prescribed points ---- */

enum { MOST_PRESCRIBED = 2000 };

typedef struct {
    pd_prescribed list;
    pd_local point[MOST_PRESCRIBED];
    unsigned char components[MOST_PRESCRIBED];
    double y[3 * MOST_PRESCRIBED];
} targets;

/* Prescribe the components of a point to be where `to` is, [3]. */
static void prescribe(targets *t, int d, pd_local p, unsigned components,
                      const double *to)
{
    assert_true(t->list.n < MOST_PRESCRIBED);
    t->point[t->list.n] = p;
    t->components[t->list.n] = (unsigned char)components;
    memcpy(t->y + t->list.n * (size_t)d, to, (size_t)d * sizeof *to);
    t->list = (pd_prescribed){t->list.n + 1, t->point, t->components, t->y};
}

/* Put the points with x below `low` (m) where they are, those beyond `high` where the
 * motion takes them. */
static void prescribe_ends(targets *t, const pd_body *body, double low, double high,
                           motion move, const void *context)
{
    const pd_body_view view = pd_body_fields(body);
    const size_t d = (size_t)view.dimension;
    for (pd_local p = 0; p < view.n_moving; p++) {
        double X[3] = {0}, to[3];
        memcpy(X, view.X + (size_t)p * d, d * sizeof *X);
        if (X[0] > low && X[0] < high)
            continue;
        memcpy(to, X, sizeof to);
        if (X[0] >= high)
            move(X, context, to);
        prescribe(t, (int)d, p, 7, to);
    }
}

/* ---- relaxing ---- */

/* Iterate until the residual is at most the tolerance; returns how often. */
static int relax(pd_body *body, const targets *t, double tolerance, int most)
{
    pd_relaxation *relaxation;
    assert_ok(pd_relaxation_create(body, &relaxation));
    double residual = HUGE_VAL;
    int iterations = 0;
    while (residual > tolerance && iterations < most) {
        assert_ok(pd_relaxation_step(relaxation, t ? &t->list : NULL, &residual));
        iterations++;
    }
    pd_relaxation_destroy(relaxation);
    if (residual > tolerance)
        fail_msg("residual %g after %d iterations", residual, iterations);
    return iterations;
}

/* Forces that a body of n points bears at an affine map, as loads that keep it there. */
static void load_for(pd_body *body, const affine *map)
{
    const pd_body_view view = pd_body_fields(body);
    const size_t n = (size_t)view.n_owned * (size_t)view.dimension;
    double *load = malloc(n * sizeof *load);
    body_map(body, map);
    assert_ok(pd_body_forces(body));
    for (size_t k = 0; k < n; k++)
        load[k] = -view.force[k];
    assert_ok(pd_body_load(body, load));
    body_map(body, at_rest());
    free(load);
}

/* Load the points with x beyond `from` (m) with density b (N/m3) along an axis. */
static void load_beyond(pd_body *body, double from, int axis, double b)
{
    const pd_body_view view = pd_body_fields(body);
    const size_t d = (size_t)view.dimension;
    double *load = calloc((size_t)view.n_owned * d, sizeof *load);
    for (size_t p = 0; p < (size_t)view.n_owned; p++)
        if (view.X[p * d] > from)
            load[p * d + (size_t)axis] = b;
    assert_ok(pd_body_load(body, load));
    free(load);
}

/* ---- uniform stretch ---- */

/* P11 and P22 of the plane-strain neo-Hookean at F = diag(a, b, 1). */
static void principal(double a, double b, double *P11, double *P22)
{
    const double J = a * b, scale = SHEAR * pow(J, -2. / 3);
    const double common = BULK * log(J) - scale * (a * a + b * b + 1) / 3;
    *P11 = scale * a + common / a;
    *P22 = scale * b + common / b;
}

/* The stretches that bear the traction T with free sides, by Newton's method for b
 * inside a secant search for a. */
static void stretches(double T, double *a, double *b)
{
    double low = 0.5, high = 3, P11 = 0, P22;
    *b = 1;
    for (int k = 0; k < 100; k++) {
        *a = 0.5 * (low + high);
        for (int i = 0; i < 30; i++) {
            double ahead;
            principal(*a, *b, &P11, &P22);
            principal(*a, *b + 1e-6, &P11, &ahead);
            *b -= P22 / ((ahead - P22) / 1e-6);
        }
        principal(*a, *b, &P11, &P22);
        if (P11 < T)
            low = *a;
        else
            high = *a;
    }
}

/* The left end slides, the lower left corner stays; the loads are those that the map
 * needs: traction at the end, none across. The residual 1e-9 leaves 1e-9 of the strain
 * times the condition of the body, of 100. */
static void stretched_bar_reaches_the_closed_form(void **state)
{
    points cloud = lattice(2, 16, 6, 1, STEP);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_of(&cloud, &options);
    const pd_body_view view = pd_body_fields(body);
    const double T = 60;
    affine map = {{0, 0, 0, 0, 0, 0, 0, 0, 1}, {0}};
    stretches(T, &map.A[0], &map.A[4]);
    assert_true(map.A[0] > 1.2 && map.A[4] < 0.95);
    load_for(body, &map);
    assert_ok(pd_body_forces(body));
    double right = 0, across = 0;
    targets *t = calloc(1, sizeof *t);
    for (pd_local p = 0; p < view.n_owned; p++) {
        const double *X = view.X + 2 * p, to[3] = {map.A[0] * X[0], map.A[4] * X[1], 0};
        if (X[0] < STEP)
            prescribe(t, 2, p, X[1] < STEP ? 3 : 1, to);
        right += X[0] > 0.8 ? view.volume[p] * view.force[2 * p] : 0;
        across += X[1] > 0.3 ? view.volume[p] * view.force[2 * p + 1] : 0;
    }
    assert_near(right, T * 6 * STEP, 1e-9);
    assert_near(across, 0, 1e-9);
    relax(body, t, 1e-9, 400);
    for (pd_local p = 0; p < view.n_owned; p++)
        for (int c = 0; c < 2; c++)
            assert_near(view.y[2 * p + c], map.A[4 * c] * view.X[2 * p + c], 1e-7);
    free(t);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* The traction as a user gives it: on the last three columns. The middle of the bar,
 * three heights away, has the stretch of the closed form: found to 1e-5. */
static void traction_on_the_last_columns_stretches_the_middle(void **state)
{
    points cloud = lattice(2, 48, 8, 1, STEP);
    pd_body_options options = options_of(2, 3.015);
    options.formulation_parameters[0] = 0.1;
    pd_body *body = body_of(&cloud, &options);
    const pd_body_view view = pd_body_fields(body);
    double a, b;
    stretches(60, &a, &b);
    load_beyond(body, 4.5, 0, 60 / (3 * STEP));
    targets *t = calloc(1, sizeof *t);
    for (pd_local p = 0; p < view.n_owned; p++)
        if (view.X[2 * p] < STEP) {
            const double *X = view.X + 2 * p, to[3] = {X[0], X[1], 0};
            prescribe(t, 2, p, X[1] < STEP ? 3 : 1, to);
        }
    relax(body, t, 1e-7, 600);
    double length = 0;
    for (pd_local p = 0; p < view.n_owned; p++) {
        length += fabs(view.X[2 * p] - 3.45) < 1e-6 ? view.y[2 * p] / 8 : 0;
        length -= fabs(view.X[2 * p] - 1.45) < 1e-6 ? view.y[2 * p] / 8 : 0;
    }
    assert_near(length / 2, a, 1e-4);
    free(t);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- large deformation ---- */

/* nx columns behind three held ones. */
static pd_body *cantilever(points *cloud, int d, int nx, int ny, double b)
{
    *cloud = lattice(d, nx + 3, ny, ny, STEP);
    unsigned char *held = calloc(cloud->n, 1);
    memset(held, 1, 3 * cloud->n / (size_t)(nx + 3));
    const pd_body_options options = options_of(d, 2.015);
    pd_body *body = body_with_holds(cloud, &options, held);
    load_beyond(body, (nx + 2) * STEP, 1, b);
    free(held);
    return body;
}

/* Mean displacement of the last column. */
static double tip(const pd_body *body, int axis)
{
    const pd_body_view view = pd_body_fields(body);
    const size_t d = (size_t)view.dimension;
    double end = 0, sum = 0;
    int n = 0;
    for (size_t p = 0; p < (size_t)view.n_moving; p++)
        end = fmax(end, view.X[p * d]);
    for (size_t p = 0; p < (size_t)view.n_moving; p++)
        if (view.X[p * d] > end - STEP / 2) {
            sum += view.y[p * d + (size_t)axis] - view.X[p * d + (size_t)axis];
            n++;
        }
    return sum / n;
}

/* 20:1 in plane strain, P L^2/(E' I) = 1 with the bar's E' = 4 G (kappa + G/3)/M: the
 * elastica's tip goes down by 0.3017 L and back by 0.0564 L. Families at the edges are
 * half, which makes beams of few points softer: by 0.0292 L with 6 across, 0.0072 L with
 * 12, 0.0017 L with 24. Dynamic relaxation with a diagonal mass takes 60 000 iterations.
 */
static void slender_cantilever_reaches_the_elastica(void **state)
{
    const int across = 12;
    const double height = across * STEP, L = 20 * height;
    const double modulus = 4 * SHEAR * (BULK + SHEAR / 3) / (BULK + 4. / 3 * SHEAR);
    const double force = modulus * pow(height, 3) / 12 / (L * L);
    points cloud;
    pd_body *body = cantilever(&cloud, 2, 20 * across, across, -force / (height * STEP));
    relax(body, NULL, 1e-6, 3000);
    assert_near(tip(body, 1) / L, -0.3017, 0.008);
    assert_near(tip(body, 0) / L, -0.0564, 0.003);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void slender_cantilever_in_space_is_found(void **state)
{
    points cloud;
    pd_body *body = cantilever(&cloud, 3, 80, 4, -0.4);
    relax(body, NULL, 1e-6, 5000);
    assert_true(tip(body, 1) < -0.25 * 8);
    assert_near(tip(body, 2), 0,
                1e-3); /* nothing pushes it there; 1e-6 of the load may */
    pd_body_destroy(body);
    points_free(&cloud);
}

static void press(const double *X, const void *context, double *y)
{
    memcpy(y, X, 3 * sizeof *y);
    y[0] -= *(const double *)context;
}

/* Ends of two layers prescribed whole, 40 % together at once. The left half is the mirror
 * image of the right one: both ends bear the same. */
static void block_is_compressed_to_sixty_per_cent(void **state)
{
    const double by = 0.4 * 2.4;
    points cloud = lattice(2, 24, 24, 1, STEP);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_of(&cloud, &options);
    const pd_body_view view = pd_body_fields(body);
    targets *t = calloc(1, sizeof *t);
    prescribe_ends(t, body, 2 * STEP, 2.2, press, &by);
    relax(body, t, 1e-6, 600);
    double ends[2] = {0, 0}, scale = 0;
    for (size_t k = 0; k < t->list.n; k++) {
        const pd_local p = t->point[k];
        const double force = view.volume[p] * view.force[2 * p];
        assert_memory_equal(view.y + 2 * p, t->y + 2 * k, 2 * sizeof *view.y);
        ends[view.X[2 * p] > 1] += force;
        scale += fabs(force);
    }
    assert_near(ends[0] + ends[1], 0, 1e-5 * scale);
    assert_true(ends[0] < -0.4 * SHEAR * 2.4);
    assert_true(pd_body_summary(body).smallest_J > 0.5);
    free(t);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void twist(const double *X, const void *context, double *y)
{
    const double angle = *(const double *)context, c = cos(angle), s = sin(angle);
    const double a = X[1] - 0.3, b = X[2] - 0.3;
    y[0] = X[0];
    y[1] = 0.3 + c * a - s * b;
    y[2] = 0.3 + s * a + c * b;
}

/* Half a turn, a quarter at once, twice: in the middle it is a quarter. */
static void beam_is_twisted_by_half_a_turn(void **state)
{
    points cloud = lattice(3, 30, 6, 6, STEP);
    const pd_body_options options = options_of(3, 2.015);
    pd_body *body = body_of(&cloud, &options);
    const pd_body_view view = pd_body_fields(body);
    for (int k = 1; k <= 2; k++) {
        const double angle = k * PI / 2;
        targets *t = calloc(1, sizeof *t);
        prescribe_ends(t, body, 3 * STEP, 2.7, twist, &angle);
        relax(body, t, 1e-6, 1000);
        free(t);
    }
    /* The corners of the two columns beside the middle turn by a quarter in the mean,
     * from one eighth of a turn. */
    double sum[2] = {0, 0};
    for (pd_local p = 0; p < view.n_owned; p++) {
        const double *X = view.X + 3 * p, *y = view.y + 3 * p;
        if (fabs(X[0] - 1.5) < STEP && X[1] > 0.5 && X[2] > 0.5) {
            sum[0] += (y[1] - 0.3) / 2;
            sum[1] += (y[2] - 0.3) / 2;
        }
    }
    assert_near(atan2(sum[1], sum[0]), PI * 3 / 4, 1e-4);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* Held on the left, pulled on the right by a third of its length at once. Points that
 * went along unaware of the hold would have gone by as much beside it. */
static void held_bar_is_pulled_at_once(void **state)
{
    points cloud = lattice(2, 30, 6, 1, STEP);
    unsigned char held[180] = {0};
    memset(held, 1, 6 * 6);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_with_holds(&cloud, &options, held);
    const double by = -1;
    targets *t = calloc(1, sizeof *t);
    prescribe_ends(t, body, -1, 2.8, press, &by);
    pd_relaxation *relaxation;
    double residual;
    assert_ok(pd_relaxation_create(body, &relaxation));
    assert_ok(pd_relaxation_step(relaxation, &t->list, &residual));
    pd_relaxation_destroy(relaxation);
    assert_true(pd_body_summary(body).largest_J < 2.5); /* 1.4 on the average */
    relax(body, t, 1e-6, 400);
    assert_true(pd_body_summary(body).largest_J < 1.5);
    free(t);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* Volumes 1:4.8 and no lattice: the map of its own loads is found again. */
static void uneven_body_is_relaxed(void **state)
{
    for (int d = 2; d <= 3; d++) {
        points cloud =
            d == 2 ? graded(2, 20, 20, 1, STEP, 1.04) : graded(3, 10, 9, 8, STEP, 1.06);
        jitter(&cloud, 0.01);
        unsigned char *held = calloc(cloud.n, 1);
        memset(held, 1, cloud.n / 5);
        const pd_body_options options = options_of(d, 2.015);
        pd_body *body = body_with_holds(&cloud, &options, held);
        load_beyond(body, d == 2 ? 2.7 : 1.1, 1, -25);
        relax(body, NULL, 1e-6, 500);
        assert_true(tip(body, 1) < -0.05);
        free(held);
        pd_body_destroy(body);
        points_free(&cloud);
    }
}

/* Four times as many points across need four times as many iterations with a diagonal
 * mass. Found: 60 and 115. */
static void iterations_hardly_grow_with_the_number_of_points(void **state)
{
    int iterations[2];
    for (int fine = 0; fine < 2; fine++) {
        const int n = fine ? 64 : 16;
        points cloud = lattice(2, n, n, 1, 1.6 / n);
        pd_body_options options = options_of(2, 2.015);
        options.formulation_parameters[0] = 0.1;
        pd_body *body = body_of(&cloud, &options);
        const double by = -0.16;
        targets *t = calloc(1, sizeof *t);
        prescribe_ends(t, body, 3.2 / n, 1.6 - 3.2 / n, press, &by);
        iterations[fine] = relax(body, t, 1e-6, 500);
        free(t);
        pd_body_destroy(body);
        points_free(&cloud);
    }
    assert_true(iterations[1] < 2.5 * iterations[0]);
}

/* Every formulation that knows equilibrium under a material that it takes. */
static void every_elastic_formulation_is_relaxed(void **state)
{
    for (const pd_formulation *const *f = pd_formulations; *f; f++)
        for (const pd_material *const *m = pd_materials; *m; m++) {
            if (!(*f)->accepts(*m, 2, PD_PLANE_STRAIN) || (*f)->advance)
                continue;
            points cloud = lattice(2, 16, 8, 1, STEP);
            pd_body_options options = options_of(2, 3.015);
            options.formulation = *f;
            options.material = *m;
            for (int k = 0; k < (*f)->n_parameters; k++)
                options.formulation_parameters[k] = (*f)->parameters[k].standard;
            for (int k = 0; k < (*m)->n_parameters; k++)
                options.parameters[k] = some_value(&(*m)->parameters[k]);
            pd_body *body = body_of(&cloud, &options);
            const double by = -0.08;
            targets *t = calloc(1, sizeof *t);
            prescribe_ends(t, body, 2 * STEP, 1.4, press, &by);
            relax(body, t, 1e-6, 500);
            free(t);
            pd_body_destroy(body);
            points_free(&cloud);
        }
}

/* ---- residual ---- */

/* A bar between prescribed ends with loads b, its forces filled by one iteration. */
typedef struct {
    points cloud;
    pd_body *body;
    pd_relaxation *relaxation;
    targets t;
} bar;

static bar *make_bar(double by, double b)
{
    bar *it = calloc(1, sizeof *it);
    it->cloud = lattice(2, 12, 5, 1, STEP);
    const pd_body_options options = options_of(2, 2.015);
    it->body = body_of(&it->cloud, &options);
    if (b != 0)
        load_beyond(it->body, 0.5, 1, b);
    prescribe_ends(&it->t, it->body, STEP, 1.1, press, &by);
    assert_ok(pd_relaxation_create(it->body, &it->relaxation));
    return it;
}

static void free_bar(bar *it)
{
    pd_relaxation_destroy(it->relaxation);
    pd_body_destroy(it->body);
    points_free(&it->cloud);
    free(it);
}

static void residual_is_what_it_is_said_to_be(void **state)
{
    bar *it = make_bar(-0.01, 4);
    const pd_body_view view = pd_body_fields(it->body);
    double remembered = 0;
    for (int iteration = 0; iteration < 20; iteration++) {
        double residual, unbalance = 0, loads = 0, reactions = 0;
        assert_ok(pd_relaxation_step(it->relaxation, &it->t.list, &residual));
        for (pd_local p = 0; p < view.n_moving; p++)
            for (int a = 0; a < 2; a++) {
                const double force = view.volume[p] * view.force[2 * p + a];
                const bool end = view.X[2 * p] < STEP || view.X[2 * p] > 1.1;
                const double load =
                    a == 1 && view.X[2 * p] > 0.5 && !end ? 4 * view.volume[p] : 0;
                *(end ? &reactions : &unbalance) += force * force;
                loads += load * load;
            }
        /* At rest the loads were unbalanced; then the ends moved. */
        if (iteration == 0)
            remembered = fmax(sqrt(loads), sqrt(unbalance));
        assert_near(residual,
                    sqrt(unbalance) / (sqrt(loads) + sqrt(reactions) + 1e-3 * remembered),
                    1e-12 * residual);
    }
    free_bar(it);
}

static void nothing_to_relax_is_a_residual_of_nothing(void **state)
{
    for (int far = 0; far < 2; far++) { /* round-off is that of positions */
        points cloud = lattice(3, 6, 5, 4, STEP);
        for (size_t k = 0; k < 3 * cloud.n; k++)
            cloud.X[k] += far * 1e4;
        jitter(&cloud, 0.02);
        const pd_body_options options = options_of(3, 2.015);
        pd_body *body = body_of(&cloud, &options);
        const affine turned = rotation(3, 0.7);
        for (int k = 0; k < 2; k++) {
            body_map(body, k ? &turned : at_rest());
            assert_int_equal(relax(body, NULL, 0, 1), 1);
        }
        pd_body_destroy(body);
        points_free(&cloud);
    }
}

/* Released with the ends where they were: reactions vanish with the forces. */
static void unloaded_body_comes_to_rest(void **state)
{
    const double amplitude = 0.004;
    bar *it = make_bar(0, 0);
    body_move(it->body, move_in_waves, &amplitude);
    relax(it->body, &it->t, 1e-6, 300);
    const pd_body_view view = pd_body_fields(it->body);
    for (pd_local k = 0; k < 2 * view.n_owned; k++)
        assert_near(view.y[k], view.X[k], 1e-8); /* 1e-9 of 4e-3 m, times condition */
    free_bar(it);
}

static void load_on_prescribed_components_is_not_counted(void **state)
{
    bar *it = make_bar(0, 0);
    load_beyond(it->body, 1.1, 0, 1e9); /* all of it goes into the reaction */
    double residual;
    for (int k = 0; k < 3; k++)
        assert_ok(pd_relaxation_step(it->relaxation, &it->t.list, &residual));
    assert_near(residual, 0, 1e-15); /* forces are the round-off of a body at rest */
    const pd_body_view view = pd_body_fields(it->body);
    for (int c = 0; c < 120; c++)
        assert_near(view.y[c], view.X[c], 1e-15 * fabs(view.X[c]));
    free_bar(it);
}

/* ---- what may change meanwhile ---- */

static void loads_may_change_between_iterations(void **state)
{
    bar *it = make_bar(0, 4), *other = make_bar(0, -7);
    double residual;
    for (int k = 0; k < 12; k++)
        assert_ok(pd_relaxation_step(it->relaxation, &it->t.list, &residual));
    load_beyond(it->body, 0.5, 1, -7);
    for (int k = 0; k < 300 && residual > 1e-9; k++)
        assert_ok(pd_relaxation_step(it->relaxation, &it->t.list, &residual));
    relax(other->body, &other->t, 1e-9, 300);
    const double *y = pd_body_fields(it->body).y, *x = pd_body_fields(other->body).y;
    for (int k = 0; k < 120; k++)
        assert_near(y[k], x[k], 1e-9); /* 1e-9 of 0.01 m, times condition */
    free_bar(it);
    free_bar(other);
}

/* First held at both ends, then at the left one alone: its forces are gone in the end. */
static void prescribed_components_may_change_between_iterations(void **state)
{
    bar *it = make_bar(-0.05, 0);
    double residual;
    for (int k = 0; k < 30; k++)
        assert_ok(pd_relaxation_step(it->relaxation, &it->t.list, &residual));
    const pd_body_view view = pd_body_fields(it->body);
    targets *left = calloc(1, sizeof *left);
    for (pd_local p = 0; p < view.n_owned; p++)
        if (view.X[2 * p] < STEP)
            prescribe(left, 2, p, 3, view.X + 2 * p);
    for (int k = 0; k < 300 && (k == 0 || residual > 1e-9); k++)
        assert_ok(pd_relaxation_step(it->relaxation, &left->list, &residual));
    for (int k = 0; k < 120; k++)
        assert_near(view.y[k], view.X[k], 1e-8);
    free(left);
    free_bar(it);
}

/* A target that moves in every iteration is followed. */
static void moving_targets_are_followed(void **state)
{
    bar *it = make_bar(0, 0);
    for (int k = 1; k <= 60; k++) {
        const double by = -0.005 * k;
        double residual;
        it->t.list.n = 0;
        prescribe_ends(&it->t, it->body, STEP, 1.1, press, &by);
        assert_ok(pd_relaxation_step(it->relaxation, &it->t.list, &residual));
        assert_true(residual < 100);
    }
    relax(it->body, &it->t, 1e-6, 200);
    const pd_summary summary = pd_body_summary(it->body);
    assert_true(summary.smallest_J > 0.9 && summary.largest_J < 1.3);
    free_bar(it);
}

static void damping_and_velocity_play_no_part(void **state)
{
    double y[2][120];
    for (int damped = 0; damped < 2; damped++) {
        points cloud = lattice(2, 12, 5, 1, STEP);
        pd_body_options options = options_of(2, 2.015);
        options.damping = damped * 1e4;
        pd_body *body = body_of(&cloud, &options);
        const pd_body_view view = pd_body_fields(body);
        const double by = -0.1;
        targets *t = calloc(1, sizeof *t);
        prescribe_ends(t, body, STEP, 1.1, press, &by);
        for (int k = 0; k < 120; k++)
            view.v[k] = damped * 5;
        relax(body, t, 1e-6, 200);
        assert_near(pd_body_summary(body).largest_speed, 0, 0);
        memcpy(y[damped], view.y, sizeof *y);
        free(t);
        pd_body_destroy(body);
        points_free(&cloud);
    }
    assert_memory_equal(y[0], y[1], sizeof *y);
}

/* ---- errors ---- */

static pd_status trapped_step(pd_relaxation *relaxation, const pd_prescribed *prescribed,
                              double *residual)
{
    feclearexcept(FE_ALL_EXCEPT);
    feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
    const pd_status status = pd_relaxation_step(relaxation, prescribed, residual);
    fedisableexcept(FE_ALL_EXCEPT);
    return status;
}

static void bad_target_is_an_error_of_its_point(void **state)
{
    const double unusable[] = {NAN, INFINITY, 1e200};
    bar *it = make_bar(0, 0);
    for (int u = 0; u < 3; u++) {
        double residual;
        it->t.y[2 * 3 + 1] = unusable[u];
        const pd_status status = trapped_step(it->relaxation, &it->t.list, &residual);
        assert_int_equal(status.code, PD_NOT_FINITE);
        assert_int_equal(status.point, pd_body_fields(it->body).id[it->t.point[3]]);
    }
    free_bar(it);
}

static void bad_position_is_an_error_of_its_point(void **state)
{
    bar *it = make_bar(0, 0);
    const pd_body_view view = pd_body_fields(it->body);
    double residual;
    view.y[2 * 31] = NAN;
    const pd_status status = trapped_step(it->relaxation, &it->t.list, &residual);
    assert_int_equal(status.code, PD_NOT_FINITE);
    assert_int_equal(status.point, view.id[31]);
    free_bar(it);
}

/* Ends that pass through one another: no equilibrium with J > 0 exists. */
static void impossible_targets_end_in_an_error(void **state)
{
    bar *it = make_bar(1.3, 0);
    pd_status status = {.code = PD_OK};
    double residual = HUGE_VAL;
    for (int k = 0; k < 3000 && status.code == PD_OK; k++) {
        status = trapped_step(it->relaxation, &it->t.list, &residual);
        assert_true(status.code != PD_OK || residual >= 1); /* it is not there */
    }
    assert_true(status.code == PD_INVERTED || status.code == PD_NOT_FINITE);
    assert_true(status.point >= 0);
    free_bar(it);
}

/* A load that nothing balances pushes the body away, for ever or until its positions are
 * no numbers; the residual never says that it is at rest. */
static void unbalanced_load_is_never_at_rest(void **state)
{
    points cloud = lattice(2, 6, 6, 1, STEP);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_of(&cloud, &options);
    load_beyond(body, -1, 0, 50);
    pd_relaxation *relaxation;
    assert_ok(pd_relaxation_create(body, &relaxation));
    pd_status status = {.code = PD_OK};
    for (int k = 0; k < 500 && status.code == PD_OK; k++) {
        double residual;
        status = trapped_step(relaxation, NULL, &residual);
        assert_true(status.code != PD_OK || residual > 0.9);
    }
    pd_relaxation_destroy(relaxation);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void no_history(pd_body *body, double dt, double at)
{
}

static void body_with_history_is_refused(void **state)
{
    points cloud = lattice(2, 6, 6, 1, STEP);
    pd_body_options options = options_of(2, 2.015);
    pd_formulation formulation = *options.formulation;
    formulation.advance = no_history;
    options.formulation = &formulation;
    pd_body *body = body_of(&cloud, &options);
    pd_relaxation *relaxation = (pd_relaxation *)&body; /* must be overwritten */
    const pd_status status = pd_relaxation_create(body, &relaxation);
    assert_int_equal(status.code, PD_BAD_ARGUMENT);
    assert_null(relaxation);
    assert_non_null(strstr(status.message, "history"));
    pd_body_destroy(body);
    points_free(&cloud);
}

static void nothing_can_be_destroyed(void **state)
{
    pd_relaxation_destroy(NULL);
}

static void body_wholly_held_is_relaxed(void **state)
{
    points cloud = lattice(2, 4, 4, 1, STEP);
    unsigned char held[16];
    memset(held, 1, sizeof held);
    const pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_with_holds(&cloud, &options, held);
    assert_int_equal(relax(body, NULL, 0, 1), 1);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void body_wholly_prescribed_is_relaxed(void **state)
{
    bar *it = make_bar(0, 0);
    const double by = -0.1;
    it->t.list.n = 0;
    prescribe_ends(&it->t, it->body, 2, 3, press, &by);
    it->t.y[1] += 0.01;
    assert_int_equal(relax(it->body, &it->t, 0, 1), 1);
    free_bar(it);
}

/* Bonds that could break but do not leave everything as it is. */
static void body_that_can_break_is_relaxed(void **state)
{
    for (int crack = 0; crack < 2; crack++) {
        points cloud = lattice(2, 20, 12, 1, STEP);
        pd_body_options options = options_of(2, 3.015);
        options.critical_stretch = 1.5;
        options.formulation_parameters[0] = 0.1;
        pd_body *body = body_of(&cloud, &options);
        const pd_rectangle slit = {.corner = {1, -1, 0}, .edge1 = {0, 1.5, 0}};
        if (crack)
            assert_ok(pd_body_precrack(body, &slit));
        const double by = -0.1;
        targets *t = calloc(1, sizeof *t);
        prescribe_ends(t, body, 2 * STEP, 1.8, press, &by);
        relax(body, t, 1e-6, 500);
        free(t);
        pd_body_destroy(body);
        points_free(&cloud);
    }
}

/* Nothing divides by the stiffness of a point that has none left. */
static void point_without_bonds_stays_where_it_is(void **state)
{
    points cloud = lattice(2, 8, 6, 1, STEP);
    pd_body_options options = options_of(2, 2.015);
    options.critical_stretch = 1.5;
    pd_body *body = body_of(&cloud, &options);
    const pd_body_view view = pd_body_fields(body);
    size_t corner = 0;
    for (size_t p = 0; p < (size_t)view.n_owned; p++)
        if (view.X[2 * p] + view.X[2 * p + 1] <
            view.X[2 * corner] + view.X[2 * corner + 1])
            corner = p;
    const double *X = view.X + 2 * corner;
    const pd_rectangle slit = {.corner = {X[0] - 1, X[1] + 1.05, 0}, .edge1 = {2, -2, 0}};
    assert_ok(pd_body_precrack(body, &slit));
    load_beyond(body, X[0] + 6.5 * STEP, 0, 1);
    targets *t = calloc(1, sizeof *t);
    for (pd_local p = 0; p < view.n_owned; p++)
        if ((size_t)p != corner && view.X[2 * p] < X[0] + 1.5 * STEP)
            prescribe(t, 2, p, 3, view.X + 2 * p);
    pd_relaxation *relaxation;
    assert_ok(pd_relaxation_create(body, &relaxation));
    double residual = HUGE_VAL;
    for (int k = 0; k < 200 && !(residual <= 1e-6); k++)
        assert_ok(trapped_step(relaxation, &t->list, &residual));
    assert_true(residual <= 1e-6);
    for (int a = 0; a < 2; a++)
        assert_true(view.y[2 * corner + (size_t)a] == X[a]);
    pd_relaxation_destroy(relaxation);
    free(t);
    pd_body_destroy(body);
    points_free(&cloud);
}

static void iterations_allocate_nothing(void **state)
{
    bar *it = make_bar(-0.3, 4);
    double residual;
    allocations = 0;
    for (int k = 0; k < 30; k++)
        assert_ok(pd_relaxation_step(it->relaxation, &it->t.list, &residual));
    assert_int_equal(allocations, 0);
    free_bar(it);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(stretched_bar_reaches_the_closed_form),
        cmocka_unit_test(traction_on_the_last_columns_stretches_the_middle),
        cmocka_unit_test(slender_cantilever_reaches_the_elastica),
        cmocka_unit_test(slender_cantilever_in_space_is_found),
        cmocka_unit_test(block_is_compressed_to_sixty_per_cent),
        cmocka_unit_test(beam_is_twisted_by_half_a_turn),
        cmocka_unit_test(held_bar_is_pulled_at_once),
        cmocka_unit_test(uneven_body_is_relaxed),
        cmocka_unit_test(iterations_hardly_grow_with_the_number_of_points),
        cmocka_unit_test(every_elastic_formulation_is_relaxed),
        cmocka_unit_test(residual_is_what_it_is_said_to_be),
        cmocka_unit_test(nothing_to_relax_is_a_residual_of_nothing),
        cmocka_unit_test(unloaded_body_comes_to_rest),
        cmocka_unit_test(load_on_prescribed_components_is_not_counted),
        cmocka_unit_test(loads_may_change_between_iterations),
        cmocka_unit_test(prescribed_components_may_change_between_iterations),
        cmocka_unit_test(moving_targets_are_followed),
        cmocka_unit_test(damping_and_velocity_play_no_part),
        cmocka_unit_test(bad_target_is_an_error_of_its_point),
        cmocka_unit_test(bad_position_is_an_error_of_its_point),
        cmocka_unit_test(impossible_targets_end_in_an_error),
        cmocka_unit_test(unbalanced_load_is_never_at_rest),
        cmocka_unit_test(body_with_history_is_refused),
        cmocka_unit_test(nothing_can_be_destroyed),
        cmocka_unit_test(body_wholly_held_is_relaxed),
        cmocka_unit_test(body_wholly_prescribed_is_relaxed),
        cmocka_unit_test(body_that_can_break_is_relaxed),
        cmocka_unit_test(point_without_bonds_stays_where_it_is),
        cmocka_unit_test(iterations_allocate_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
