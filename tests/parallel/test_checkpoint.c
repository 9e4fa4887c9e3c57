/*
 * Checkpoints of bodies that several ranks share: they go on to the last bit on as many
 * ranks, and on one rank as the body in one piece would, within round-off; the file of a
 * body in one piece goes on on several.
 *
 *     mpirun -np <ranks> build/parallel/test_checkpoint <folder>
 *
 * Prints lines "PASS <what>" and "FAIL <what>: <why>"; the exit status is 1 if any
 * failed.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../handles.h"
#include "pd.h"

/* Sums are taken in another order by other ranks, and what differs in the last bit grows
 * with the steps that follow: relative to the largest value of the body. */
#define TOLERANCE 1e-9

enum { STEPS = 20 };

static int rank, size, failures;
static char path[512];

typedef struct {
    const char *name, *formulation, *material;
    int d, n[3];
    double parameters[2];           /* of the formulation */
    double stretch, stress, strain; /* at which bonds break, or 0 */
    bool uneven, held;
} scene;

static const scene scenes[] = {
    {.name = "bond",
     .formulation = "bond",
     .material = "microelastic",
     .d = 2,
     .n = {30, 12, 1},
     .parameters = {1, 1},
     .stretch = 1.05,
     .held = true},
    {.name = "bond, uneven",
     .formulation = "bond",
     .material = "microelastic",
     .d = 2,
     .n = {24, 12, 1},
     .parameters = {1, 0},
     .stretch = 1.05,
     .uneven = true,
     .held = true},
    {.name = "correspondence",
     .formulation = "correspondence",
     .material = "neoHookean",
     .d = 2,
     .n = {30, 14, 1},
     .parameters = {0.1},
     .stretch = 1.07,
     .held = true},
    {.name = "correspondence in space",
     .formulation = "correspondence",
     .material = "neoHookean",
     .d = 3,
     .n = {14, 9, 9},
     .stretch = 1.06,
     .held = true},
    {.name = "correspondence, uneven",
     .formulation = "correspondence",
     .material = "neoHookean",
     .d = 2,
     .n = {24, 12, 1},
     .stretch = 1.07,
     .uneven = true},
    {.name = "bondAssociated by stretch",
     .formulation = "bondAssociated",
     .material = "J2",
     .d = 2,
     .n = {24, 10, 1},
     .parameters = {2, 1},
     .stretch = 1.06},
    {.name = "bondAssociated, decaying",
     .formulation = "bondAssociated",
     .material = "J2",
     .d = 2,
     .n = {24, 10, 1},
     .parameters = {2, 1},
     .strain = 0.05,
     .held = true},
    {.name = "bondAssociated of points, decaying",
     .formulation = "bondAssociated",
     .material = "J2",
     .d = 2,
     .n = {24, 10, 1},
     .parameters = {1, 0},
     .strain = 0.05,
     .held = true},
    {.name = "bondAssociated in space",
     .formulation = "bondAssociated",
     .material = "J2",
     .d = 3,
     .n = {9, 6, 6},
     .parameters = {1, 1},
     .strain = 0.05,
     .held = true},
};

/* ---- bodies ---- */

static double noise(size_t p, int a)
{
    const uint32_t seed =
        (uint32_t)(p * 7919 + (size_t)a * 104729 + 5) * UINT32_C(2654435761);
    return (double)(seed >> 8) / (1 << 23) - 1;
}

static pd_body_options options_of(const scene *s)
{
    pd_body_options o = {.dimension = s->d,
                         .horizon_ratio = 2.515,
                         .density = 1.3,
                         .critical_stretch = s->stretch,
                         .critical_stress = s->stress,
                         .failed_strain = s->strain,
                         .sound_strain = s->strain / 4,
                         .formulation = pd_formulation_find(s->formulation),
                         .material = pd_material_find(s->material)};
    for (int k = 0; k < o.formulation->n_parameters; k++)
        o.formulation_parameters[k] = s->parameters[k];
    for (int k = 0; k < o.material->n_parameters; k++) {
        const pd_parameter *p = &o.material->parameters[k];
        const double value = strcmp(p->key, "yieldStress") == 0 ? 2 : 100;
        o.parameters[k] = value < p->below ? value : 0.3 * (p->above + p->below);
    }
    return o;
}

/* Shared out anyhow; all: in one piece. */
static pd_body *create(const scene *s, bool all)
{
    const size_t n = (size_t)(s->n[0] * s->n[1] * s->n[2]);
    double *X = calloc(3 * n, sizeof *X), *volume = calloc(n, sizeof *volume);
    unsigned char *held = calloc(n, 1);
    pd_global *id = calloc(n, sizeof *id);
    size_t mine = 0;
    for (size_t p = 0; p < n; p++) {
        const int index[3] = {(int)p % s->n[0], (int)p / s->n[0] % s->n[1],
                              (int)p / s->n[0] / s->n[1]};
        if (!all && (int)((index[0] / 5 + 3 * (index[1] / 4)) % size) != rank)
            continue;
        volume[mine] = s->d == 2 ? 0.01 : 0.001;
        for (int a = 0; a < s->d; a++)
            X[3 * mine + (size_t)a] =
                0.1 * index[a] + (s->uneven ? 0.015 * noise(p, a) : 0);
        held[mine] = index[0] < 4;
        id[mine++] = (pd_global)p;
    }
    const pd_body_options o = options_of(s);
    pd_body *body = NULL;
    const pd_status status =
        pd_body_create(all ? MPI_COMM_NULL : MPI_COMM_WORLD, &o, mine, X, volume,
                       s->held ? held : NULL, id, &body);
    if (status.code != PD_OK) {
        printf("FAIL creation of %s: %s\n", s->name, status.message);
        MPI_Abort(MPI_COMM_WORLD, 1);
    }
    free(X);
    free(volume);
    free(held);
    free(id);
    return body;
}

static double step_of(const pd_body *body)
{
    return 0.01 / pd_body_wave_speed(body);
}

static void pull(pd_body *body)
{
    const pd_body_view v = pd_body_fields(body);
    for (pd_local p = 0; p < v.n_moving; p++)
        for (int a = 0; a < v.dimension; a++) {
            const double x = v.X[p * v.dimension + a];
            const double other = v.X[p * v.dimension + (a + 1) % v.dimension];
            v.v[p * v.dimension + a] =
                0.003 / step_of(body) * (x + 0.2 * sin(5 * x) + 0.1 * sin(7 * other + a));
        }
}

static pd_status advance(pd_body *body, int steps)
{
    for (int k = 0; k < steps; k++) {
        const pd_status status =
            pd_body_step(body, pd_integrators[0], step_of(body), NULL);
        if (status.code != PD_OK)
            return status;
    }
    return pd_body_summary(body).bonds > 0 ? (pd_status){.code = PD_OK}
                                           : (pd_status){.code = PD_BAD_ARGUMENT};
}

/* ---- what is compared ---- */

static void check(const char *what, const scene *s, bool good, const char *why)
{
    int all = good;
    MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
    failures += !all;
    if (rank == 0 && all)
        printf("PASS %s, %s, on %d ranks\n", s->name, what, size);
    else if (rank == 0)
        printf("FAIL %s, %s, on %d ranks: %s\n", s->name, what, size, why);
}

/* To the last bit. */
static bool same(pd_body *a, pd_body *b)
{
    const pd_body_view v = pd_body_fields(a), w = pd_body_fields(b);
    const size_t n = (size_t)v.n_owned, d = (size_t)v.dimension;
    double *damage = calloc(16 * n + 1, sizeof *damage), *other = damage + 8 * n;
    pd_body_damage(a, damage);
    pd_body_damage(b, other);
    pd_body_stress(a, damage + n, damage + 7 * n);
    pd_body_stress(b, other + n, other + 7 * n);
    const bool ok = memcmp(v.y, w.y, n * d * sizeof *v.y) == 0 &&
                    memcmp(v.v, w.v, n * d * sizeof *v.v) == 0 &&
                    memcmp(v.force, w.force, n * d * sizeof *v.force) == 0 &&
                    memcmp(v.F, w.F, n * d * d * sizeof *v.F) == 0 &&
                    memcmp(v.J, w.J, n * sizeof *v.J) == 0 &&
                    memcmp(damage, other, 8 * n * sizeof *damage) == 0 &&
                    pd_body_summary(a).broken_bonds == pd_body_summary(b).broken_bonds;
    free(damage);
    return ok;
}

/* part, shared, against whole, which every rank has: largest difference of displacement
 * and damage, relative to the largest displacement. */
static double gap(const pd_body *part, const pd_body *whole)
{
    const pd_body_view v = pd_body_fields(part), w = pd_body_fields(whole);
    const int d = v.dimension;
    double *mine = calloc((size_t)v.n_owned + 1, sizeof *mine), worst = 0, most = 0;
    double *all = calloc((size_t)w.n_owned + 1, sizeof *all);
    pd_local *place = calloc((size_t)w.n_owned, sizeof *place);
    pd_body_damage(part, mine);
    pd_body_damage(whole, all);
    for (pd_local p = 0; p < w.n_owned; p++)
        place[w.id[p]] = p;
    for (pd_local c = 0; c < d * w.n_owned; c++)
        most = fmax(most, fabs(w.y[c] - w.X[c]));
    for (pd_local p = 0; p < v.n_owned; p++) {
        const pd_local q = place[v.id[p]];
        for (int a = 0; a < d; a++)
            worst = fmax(worst, fabs(v.y[p * d + a] - w.y[q * d + a]) / most);
        worst = fmax(worst, fabs(mine[p] - all[q]));
    }
    free(mine);
    free(all);
    free(place);
    return worst;
}

static void go_on(const scene *s)
{
    pd_body *shared = create(s, false), *again = create(s, false),
            *whole = create(s, true);
    pd_note note = {.name = "time", .number = 0.5}, back = {.name = "time"};
    pull(shared);
    bool ok =
        pd_body_forces(shared).code == PD_OK && advance(shared, STEPS).code == PD_OK;
    const int64_t broken = pd_body_summary(shared).broken_bonds;
    pd_status status = pd_checkpoint_save(shared, path, 1, &note);
    if (status.code == PD_OK)
        status = pd_checkpoint_load(again, path, 1, &back);
    check("save and load", s, ok && status.code == PD_OK && back.number == 0.5,
          status.message);
    check("as it was", s, same(shared, again), "something differs");
    const pd_status alone = pd_checkpoint_load(whole, path, 1, &back);
    check("load in one piece", s, alone.code == PD_OK, alone.message);
    check("in one piece as it was", s, gap(shared, whole) == 0, "something differs");
    ok = advance(shared, STEPS).code == PD_OK && advance(again, STEPS).code == PD_OK &&
         advance(whole, STEPS).code == PD_OK;
    check("goes on", s, ok && same(shared, again), "something differs");
    check("goes on in one piece", s, gap(shared, whole) <= TOLERANCE, "too far away");
    check("bonds break before and after", s,
          broken > 0 && pd_body_summary(shared).broken_bonds > broken, "too few");
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank == 0)
        status = pd_checkpoint_save(whole, path, 1, &note);
    MPI_Barrier(MPI_COMM_WORLD);
    pd_body_destroy(again);
    again = create(s, false);
    status = pd_checkpoint_load(again, path, 1, &back);
    check("load what one rank saved", s, status.code == PD_OK && gap(again, whole) == 0,
          status.message);
    pd_body_destroy(shared);
    pd_body_destroy(again);
    pd_body_destroy(whole);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    snprintf(path, sizeof path, "%s/body.h5", argc > 1 ? argv[1] : ".");
    for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
        const int before = handles_open();
        go_on(&scenes[k]);
        check("no handle is left open", &scenes[k], handles_open() == before,
              "there are more than before");
    }
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank == 0)
        unlink(path);
    MPI_Finalize();
    return failures > 0;
}
