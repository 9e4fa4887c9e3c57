/*
 * How much faster several ranks compute what one does, what they tell each other for it,
 * and what points cost in memory:
 *
 *     mpirun -np <ranks> bench_ranks [key=value ...]     keys and defaults: main()
 *
 * A box of points on a lattice, or shaken off it, is cut into slabs across its last axis.
 * The first rank times the whole alone, while the others sleep; then all time it
 * together; again and again, and medians are taken. The triad of STREAM is timed in the
 * same turns: where memory is the limit no more can be gained than it gains. On a machine
 * that others use too, the best turns of both tell more than the medians.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "pd.h"

#define MOST_TURNS 99
#define TRIAD (1 << 23) /* doubles an array: far beyond every cache */

typedef struct {
    const char *formulation;
    int dimension, n[3], turns, together_only;
    double ratio, jitter;
} settings;

static int rank, size;

static void demand(pd_status status)
{
    if (status.code == PD_OK)
        return;
    fprintf(stderr, "bench_ranks: %s\n", status.message);
    MPI_Abort(MPI_COMM_WORLD, 1);
}

/* ---- waiting without using a core ---- */

static void meet(void)
{
    MPI_Request request;
    MPI_Ibarrier(MPI_COMM_WORLD, &request);
    for (int there = 0; !there;) {
        const struct timespec a_while = {0, 1000000};
        MPI_Test(&request, &there, MPI_STATUS_IGNORE);
        if (!there)
            nanosleep(&a_while, NULL);
    }
}

/* Bytes of memory that this process has in use. */
static double resident(void)
{
    long pages = 0, all = 0;
    FILE *f = fopen("/proc/self/statm", "r");
    if (f && fscanf(f, "%ld %ld", &all, &pages) != 2)
        pages = 0;
    if (f)
        fclose(f);
    return 4096. * (double)pages;
}

/* The most that it ever had. */
static double peak(void)
{
    char line[128];
    double kilobytes = 0;
    FILE *f = fopen("/proc/self/status", "r");
    while (f && fgets(line, sizeof line, f))
        if (sscanf(line, "VmHWM: %lf", &kilobytes) == 1)
            break;
    if (f)
        fclose(f);
    return 1024 * kilobytes;
}

/* ---- a body ---- */

static const pd_material *material_for(const pd_formulation *f, int d)
{
    for (const pd_material *const *m = pd_materials; *m; m++)
        if (f->accepts(*m, d, PD_PLANE_STRAIN))
            return *m;
    return NULL;
}

static pd_body_options options_for(const settings *s)
{
    pd_body_options o = {.dimension = s->dimension,
                         .horizon_ratio = s->ratio,
                         .density = 1000,
                         .formulation = pd_formulation_find(s->formulation)};
    if (!o.formulation) {
        fprintf(stderr, "bench_ranks: no formulation %s\n", s->formulation);
        MPI_Abort(MPI_COMM_WORLD, 1);
    }
    o.material = material_for(o.formulation, s->dimension);
    for (int k = 0; k < o.material->n_parameters; k++) {
        const pd_parameter *p = &o.material->parameters[k];
        o.parameters[k] = p->below > 1e6 ? 1e6 : p->above + 0.9 * (p->below - p->above);
    }
    for (int k = 0; k < o.formulation->n_parameters; k++)
        o.formulation_parameters[k] = o.formulation->parameters[k].standard;
    return o;
}

static double shift(uint64_t z)
{
    z = (z + 0x9e3779b97f4a7c15) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return (double)(z ^ (z >> 31)) / 9223372036854775808. - 1;
}

/* The slab [from, to) of the last axis, of the box. */
static pd_body *build(MPI_Comm comm, const settings *s, int from, int to)
{
    const pd_body_options o = options_for(s);
    const double h = 1e-2;
    const size_t plane =
        s->dimension == 3 ? (size_t)s->n[0] * (size_t)s->n[1] : (size_t)s->n[0];
    const size_t n = plane * (size_t)(to - from), before = plane * (size_t)from;
    double *X = malloc((3 * n + 1) * sizeof *X),
           *volume = malloc((n + 1) * sizeof *volume);
    if (!X || !volume)
        MPI_Abort(MPI_COMM_WORLD, 1);
    for (size_t i = 0; i < n; i++) {
        size_t rest = i + before;
        volume[i] = pow(h, s->dimension);
        for (int a = 0; a < 3; a++, rest /= (size_t)s->n[a - 1])
            X[3 * i + (size_t)a] =
                h * ((double)(rest % (size_t)s->n[a]) +
                     (a < s->dimension ? s->jitter * shift(3 * (i + before) + (size_t)a)
                                       : 0));
    }
    pd_body *body = NULL;
    demand(pd_body_create(comm, &o, n, X, volume, NULL, NULL, &body));
    free(X);
    free(volume);
    const pd_body_view v = pd_body_fields(body);
    for (size_t k = 0; k < (size_t)v.n_owned * (size_t)v.dimension; k++)
        v.y[k] += 1e-3 * h * sin(300 * v.X[k]);
    demand(pd_body_forces(body));
    return body;
}

/* ---- timing ---- */

static double time_forces(pd_body *body, int calls)
{
    const double start = MPI_Wtime();
    for (int k = 0; k < calls; k++) {
        demand(pd_body_advance(body, 1e-12, 0));
        demand(pd_body_forces(body));
    }
    return (MPI_Wtime() - start) / calls;
}

/* Bytes a second. */
static double time_triad(double *a, const double *b, const double *c)
{
    const double start = MPI_Wtime();
    for (size_t k = 0; k < TRIAD; k++)
        a[k] = b[k] + 3 * c[k];
    return 3. * TRIAD * sizeof *a / (MPI_Wtime() - start);
}

static int rising(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int n)
{
    qsort(values, (size_t)n, sizeof *values, rising);
    return (values[(n - 1) / 2] + values[n / 2]) / 2;
}

static double over_ranks(double value, MPI_Op op)
{
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, op, MPI_COMM_WORLD);
    return value;
}

typedef struct {
    double alone[MOST_TURNS], together[MOST_TURNS];
    double triad_alone[MOST_TURNS], triad_together[MOST_TURNS];
} times;

static void take_turns(const settings *s, pd_body *whole, pd_body *part, int calls,
                       times *t)
{
    double *a = calloc(TRIAD, sizeof *a), *b = calloc(TRIAD, sizeof *b),
           *c = calloc(TRIAD, sizeof *c);
    if (!a || !b || !c)
        MPI_Abort(MPI_COMM_WORLD, 1);
    for (int k = 0; k < s->turns; k++) {
        meet();
        if (rank == 0 && whole) {
            t->alone[k] = time_forces(whole, calls);
            t->triad_alone[k] = time_triad(a, b, c);
        }
        meet();
        t->together[k] = time_forces(part, calls);
        MPI_Barrier(MPI_COMM_WORLD);
        t->triad_together[k] = over_ranks(time_triad(a, b, c), MPI_SUM);
    }
    free(a);
    free(b);
    free(c);
}

static void bench(const settings *s)
{
    const int last = s->n[s->dimension - 1];
    const double points = (double)s->n[0] * s->n[1] * s->n[2];
    double start = MPI_Wtime(), before = resident();
    pd_body *part = build(MPI_COMM_WORLD, s, (int)((long)last * rank / size),
                          (int)((long)last * (rank + 1) / size));
    const double made = over_ranks(MPI_Wtime() - start, MPI_MAX);
    const double memory = over_ranks(resident() - before, MPI_SUM) / points;
    const double most = over_ranks(peak(), MPI_SUM) / points;
    pd_body *whole =
        rank == 0 && !s->together_only ? build(MPI_COMM_NULL, s, 0, last) : NULL;
    const pd_traffic then = pd_body_traffic(part);
    const double once = over_ranks(time_forces(part, 1), MPI_MAX);
    const int calls = (int)fmax(1, ceil(0.3 / once));
    static times t;
    take_turns(s, whole, part, calls, &t);
    const pd_traffic now = pd_body_traffic(part);
    const double called = 1 + (double)calls * s->turns;
    const double bytes = over_ranks((double)(now.bytes - then.bytes) / called, MPI_MAX);
    const double ghosts = over_ranks((double)now.ghosts, MPI_SUM);
    const double bonds = 2 * (double)pd_body_summary(part).bonds;
    if (rank == 0) {
        const double together = median(t.together, s->turns); /* sorted by that */
        const double alone = whole ? median(t.alone, s->turns) : 0;
        printf(
            "%s,%d,%g,%s,%.0f,%.0f,%d,%.4g,%.4g,%.3f,%.3f,%.3f,%.0f,%.0f,%.4f,%.0f,%.0f,%"
            ".3g\n",
            s->formulation, s->dimension, s->ratio, s->jitter > 0 ? "shaken" : "lattice",
            points, bonds, size, 1e9 * alone / points, 1e9 * together / points,
            alone / together, t.alone[0] / t.together[0],
            whole ? median(t.triad_together, s->turns) / median(t.triad_alone, s->turns)
                  : 0,
            bytes, (double)(now.calls - then.calls) / called, ghosts / points, memory,
            most, made);
    }
    pd_body_destroy(whole);
    pd_body_destroy(part);
}

int main(int argc, char **argv)
{
    settings s = {"bond", 3, {100, 100, 100}, 5, 0, 3.015, 0};
    char name[64];
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    for (int k = 1; k < argc; k++)
        if (sscanf(argv[k], "formulation=%63s", name) == 1)
            s.formulation = name;
        else if (sscanf(argv[k], "n=%dx%dx%d", &s.n[0], &s.n[1], &s.n[2]) != 3 &&
                 sscanf(argv[k], "dimension=%d", &s.dimension) != 1 &&
                 sscanf(argv[k], "ratio=%lf", &s.ratio) != 1 &&
                 sscanf(argv[k], "jitter=%lf", &s.jitter) != 1 &&
                 sscanf(argv[k], "turns=%d", &s.turns) != 1 &&
                 sscanf(argv[k], "together=%d", &s.together_only) != 1) {
            fprintf(stderr,
                    "bench_ranks: '%s'; allowed: formulation=<name> dimension=<2|3> "
                    "n=<x>x<y>x<z> ratio=<m> jitter=<spacings> turns=<odd> "
                    "together=<0|1>\n",
                    argv[k]);
            MPI_Abort(MPI_COMM_WORLD, 1);
        }
    if (s.turns < 1 || s.turns > MOST_TURNS)
        s.turns = 5;
    if (rank == 0)
        printf("formulation,dimension,horizon,points on,points,directed bonds,ranks,ns a "
               "point alone,ns a point together,speed-up,of the best turns,of the triad,"
               "bytes a rank sends,"
               "messages,ghosts a point,bytes a point,at most,seconds to make\n");
    bench(&s);
    MPI_Finalize();
    return 0;
}
