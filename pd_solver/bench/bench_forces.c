/*
 * Directed bonds per second of pd_body_forces, and pd_body_advance where there is a
 * history, on one core:
 *
 *     bench_forces [key=value ...]       keys and defaults: usage() below
 *     bench_forces names                 the formulations, one a line
 *
 * Prints one line of comma-separated values a formulation, below a line of names. A
 * directed bond is one neighbour of one point, so a bond between two points counts twice.
 * Points fill the unit square or cube, nothing is held, and a smooth displacement strains
 * them by less than one percent: every bond works and none breaks.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "pd.h"

#define MAX_REPEATS 1000

typedef struct {
    const char *formulation; /* a name, or "all" */
    int dimension;
    double horizon_ratio;
    int side;             /* points along an edge */
    double critical;      /* s_c; 0: no damage */
    double jitter;        /* largest shift of a point, in spacings; 0: a lattice */
    int repeats;          /* of the measurement; their median is printed */
    double least_seconds; /* that a repeat lasts */
    bool paced;           /* a repeat for each line of standard input, until it ends */
} settings;

static void fail(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fputs("bench_forces: ", stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    exit(EXIT_FAILURE);
}

/* Of this process: what others do meanwhile does not count. */
static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- what a formulation is measured with ---- */

/* The first that the formulation takes; a plastic one if there is one, since it costs
 * most. */
static const pd_material *material_for(const pd_formulation *formulation, int d)
{
    const pd_material *first = NULL;
    for (const pd_material *const *m = pd_materials; *m; m++)
        if (formulation->accepts(*m, d, PD_PLANE_STRAIN) &&
            (!first || ((*m)->is_plastic && formulation->advance)))
            first = *m;
    return first;
}

/* A value inside its bounds. Without an upper bound it is a modulus or a yield stress:
 * all alike, so that strains of a percent stay elastic. */
static double value_of(const pd_parameter *p)
{
    const double modulus = 1e6;
    if (p->above < modulus && modulus < p->below)
        return modulus;
    return isfinite(p->above) ? p->above + 0.9 * (p->below - p->above) : p->below - 1;
}

static pd_body_options options_for(const settings *s, const pd_formulation *formulation)
{
    pd_body_options o = {
        .dimension = s->dimension,
        .horizon_ratio = s->horizon_ratio,
        .density = 1000,
        .critical_stretch = s->critical,
        .formulation = formulation,
        .material = material_for(formulation, s->dimension),
    };
    for (int k = 0; o.material && k < o.material->n_parameters; k++)
        o.parameters[k] = value_of(&o.material->parameters[k]);
    for (int k = 0; k < formulation->n_parameters; k++)
        o.formulation_parameters[k] = formulation->parameters[k].standard;
    return o;
}

/* ---- a body ---- */

/* Pseudo-random in [-1, 1), the same on every machine (splitmix64). */
static double shift(uint64_t *state)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return (double)(z ^ (z >> 31)) / 9223372036854775808. - 1;
}

static size_t count_points(const settings *s)
{
    const size_t side = (size_t)s->side;
    return s->dimension == 2 ? side * side : side * side * side;
}

static void place_points(const settings *s, double *X, double *volume)
{
    const double h = 1. / s->side;
    uint64_t state = 1;
    for (size_t i = 0; i < count_points(s); i++) {
        size_t rest = i;
        volume[i] = s->dimension == 2 ? h * h : h * h * h;
        for (int a = 0; a < 3; a++, rest /= (size_t)s->side)
            X[3 * i + (size_t)a] =
                a < s->dimension ? ((double)(rest % (size_t)s->side) + 0.5 +
                                    (s->jitter > 0 ? s->jitter * shift(&state) : 0)) *
                                       h
                                 : 0;
    }
}

static void demand(pd_status status)
{
    if (status.code != PD_OK)
        fail("%s", status.message);
}

/* A body with a history goes there in a step of a second. */
static void deform(pd_body *body)
{
    const pd_body_view view = pd_body_fields(body);
    const size_t d = (size_t)view.dimension, n = (size_t)view.n_local;
    for (size_t i = 0; i < n; i++)
        for (size_t a = 0; a < d; a++)
            view.v[i * d + a] = 1e-3 * sin(6 * view.X[i * d + (a + 1) % d] + (double)a);
    demand(pd_body_forces(body));
    demand(pd_body_advance(body, 1, 0));
    for (size_t c = 0; c < n * d; c++)
        view.y[c] += view.v[c];
}

static pd_body *build(const settings *s, const pd_formulation *formulation)
{
    const pd_body_options options = options_for(s, formulation);
    const size_t n = count_points(s);
    double *X = malloc(3 * n * sizeof *X), *volume = malloc(n * sizeof *volume);
    if (!X || !volume)
        fail("no memory for %zu points", n);
    place_points(s, X, volume);
    pd_body *body;
    const pd_status status =
        pd_body_create(MPI_COMM_NULL, &options, n, X, volume, NULL, NULL, &body);
    if (status.code != PD_OK)
        fail("%s: %s", formulation->name, status.message);
    free(X);
    free(volume);
    deform(body);
    return body;
}

/* Forces that are finite and not all zero, and no broken bond; returns the directed
 * bonds. A measurement of anything else would be worth nothing. */
static int64_t check(const pd_body *body)
{
    const pd_body_view view = pd_body_fields(body);
    double largest = 0;
    for (size_t k = 0; k < (size_t)view.n_moving * (size_t)view.dimension; k++) {
        if (!isfinite(view.force[k]))
            fail("force component %zu is %g", k, view.force[k]);
        largest = fmax(largest, fabs(view.force[k]));
    }
    if (!(largest > 0))
        fail("all forces are zero");
    const pd_summary summary = pd_body_summary(body);
    if (summary.broken_bonds)
        fail("%lld bonds broke", (long long)summary.broken_bonds);
    return 2 * summary.bonds;
}

/* ---- measuring ---- */

/* Seconds a call, over `calls` of them. */
static double measure(pd_body *body, long calls)
{
    const double start = seconds();
    for (long k = 0; k < calls; k++) {
        demand(pd_body_advance(body, 1e-9, 0)); /* nothing, without a history */
        demand(pd_body_forces(body));
    }
    return (seconds() - start) / (double)calls;
}

/* How many calls last long enough for the clock; warms up the caches on the way. */
static long calibrate(pd_body *body, double least_seconds)
{
    for (long calls = 1;; calls *= 2) {
        const double once = measure(body, calls);
        if (once * (double)calls >= least_seconds / 4)
            return (long)ceil(fmax(1, least_seconds / once));
    }
}

/* Wait for leave to go on: without pacing a number of times, else as long as there are
 * lines. */
static bool next_repeat(const settings *s, int done)
{
    if (!s->paced)
        return done < s->repeats;
    int c;
    while ((c = getchar()) != '\n')
        if (c == EOF)
            return false;
    return done < MAX_REPEATS;
}

static int rising(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void bench(const settings *s, const pd_formulation *formulation)
{
    pd_body *body = build(s, formulation);
    const long calls = calibrate(body, s->least_seconds);
    const double points = (double)count_points(s), bonds = (double)check(body);
    const pd_material *material = pd_body_settings(body)->material;
    double times[MAX_REPEATS];
    int done = 0;
    if (s->paced) {
        puts("ready");
        fflush(stdout);
    }
    while (next_repeat(s, done)) {
        times[done++] = measure(body, calls);
        if (s->paced) {
            printf("%.6g\n", times[done - 1]);
            fflush(stdout);
        }
    }
    if (!done)
        fail("no repeat was asked for");
    check(body);
    qsort(times, (size_t)done, sizeof *times, rising);
    const double median = (times[(done - 1) / 2] + times[done / 2]) / 2;
    printf("%s,%s,%d,%g,%.0f,%.0f,%s,%s,%.4g,%.4g,%.4g\n", formulation->name,
           material ? material->name : "none", s->dimension, s->horizon_ratio, points,
           bonds, s->critical > 0 ? "yes" : "no", s->jitter > 0 ? "jittered" : "lattice",
           1e9 * median / points, bonds / median, 1e9 * times[0] / points);
    pd_body_destroy(body);
}

/* ---- arguments ---- */

static void usage(void)
{
    fputs(
        "usage: bench_forces [key=value ...] | names\n"
        "  formulation=all      a name, or all of them\n"
        "  dimension=2          or 3\n"
        "  m=3.015              horizon / point spacing\n"
        "  side=64              points along an edge\n"
        "  damage=no            yes: a critical stretch that is never reached\n"
        "  arrangement=lattice  jittered: points shifted by up to a tenth of a spacing\n"
        "  repeats=7            of the measurement\n"
        "  seconds=0.05         that a repeat lasts at least\n"
        "  paced=no             yes: a repeat for each line of standard input\n",
        stderr);
    exit(EXIT_FAILURE);
}

static double number(const char *text, double low, double high)
{
    char *end;
    const double value = strtod(text, &end);
    if (end == text || *end || !(value >= low && value <= high))
        fail("%s; allowed: %g to %g", text, low, high);
    return value;
}

/* Whether text is the second of two words. */
static bool second(const char *text, const char *first_word, const char *second_word)
{
    const bool is_second = strcmp(text, second_word) == 0;
    if (!is_second && strcmp(text, first_word) != 0)
        fail("%s; allowed: %s, %s", text, first_word, second_word);
    return is_second;
}

static void set(settings *s, const char *argument)
{
    const char *equals = strchr(argument, '=');
    if (!equals)
        usage();
    const size_t length = (size_t)(equals - argument);
    const char *value = equals + 1;
#define IS(key) (length == sizeof key - 1 && strncmp(argument, key, length) == 0)
    if (IS("formulation"))
        s->formulation = value;
    else if (IS("dimension"))
        s->dimension = (int)number(value, 2, 3);
    else if (IS("m"))
        s->horizon_ratio = number(value, 1, 20);
    else if (IS("side"))
        s->side = (int)number(value, 2, 10000);
    else if (IS("damage"))
        s->critical = second(value, "no", "yes") ? 2 : 0;
    else if (IS("arrangement"))
        s->jitter = second(value, "lattice", "jittered") ? 0.1 : 0;
    else if (IS("repeats"))
        s->repeats = (int)number(value, 1, MAX_REPEATS);
    else if (IS("seconds"))
        s->least_seconds = number(value, 1e-3, 60);
    else if (IS("paced"))
        s->paced = second(value, "no", "yes");
    else
        usage();
#undef IS
}

static void print_names(void)
{
    for (const pd_formulation *const *f = pd_formulations; *f; f++)
        puts((*f)->name);
}

int main(int argc, char **argv)
{
    settings s = {.formulation = "all",
                  .dimension = 2,
                  .horizon_ratio = 3.015,
                  .side = 64,
                  .repeats = 7,
                  .least_seconds = 0.05};
    if (argc == 2 && strcmp(argv[1], "names") == 0) {
        print_names();
        return EXIT_SUCCESS;
    }
    for (int k = 1; k < argc; k++)
        set(&s, argv[k]);
    const bool all = strcmp(s.formulation, "all") == 0;
    if (!all && !pd_formulation_find(s.formulation))
        fail("no formulation is called %s", s.formulation);
    if (all && s.paced)
        fail("paced=yes needs the name of one formulation");
    puts("formulation,material,dimension,horizon_ratio,points,directed_bonds,damage,"
         "arrangement,ns_per_point,bonds_per_s,least_ns_per_point");
    for (const pd_formulation *const *f = pd_formulations; *f; f++)
        if (all || strcmp(s.formulation, (*f)->name) == 0)
            bench(&s, *f);
    return EXIT_SUCCESS;
}
