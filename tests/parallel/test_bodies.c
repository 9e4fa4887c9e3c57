/*
 * Bodies that several ranks share, against the same body in one piece: all that a body
 * holds, over steps in which bonds break, for every formulation and way of sharing.
 *
 *     [SCENE=<word>] [SHARING=<word>] mpirun -np <ranks> build/parallel/test_bodies
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

#include "pd.h"

/* Sums are taken in another order, and what differs in the last bit grows with the steps
 * that follow: relative to the largest value of the body. */
#define TOLERANCE 1e-9

#define STEPS 40

static int rank, size;

/* ---- scenes ---- */

typedef struct {
    const char *name, *formulation, *material;
    int d, n[3];
    double ratio;
    bool uneven;           /* no lattice */
    bool general;          /* a lattice that is not used as one */
    int held;              /* columns at the left end */
    double zero_energy;    /* of correspondence */
    int order;             /* of bondAssociated, 0: standard */
    bool points;           /* without bond association */
    double stretch, speed; /* s_c or 0; of the waves, over that of sound */
    double stress, strain; /* von Mises, plastic strain at which bonds break, or 0 */
    bool after;            /* break after force */
} scene;

static const scene scenes[] = {
    {.name = "bond, row",
     .formulation = "bond",
     .material = "linear",
     .d = 1,
     .n = {40, 1, 1},
     .ratio = 3.015,
     .speed = 0.05},
    {.name = "bond, row, breaking",
     .formulation = "bond",
     .material = "linear",
     .d = 1,
     .n = {40, 1, 1},
     .ratio = 3.015,
     .stretch = 1.05,
     .speed = 0.05},
    {.name = "bond, plate",
     .formulation = "bond",
     .material = "linear",
     .d = 2,
     .n = {30, 12, 1},
     .ratio = 3.015,
     .speed = 0.05},
    {.name = "bond, plate of a whole horizon",
     .formulation = "bond",
     .material = "linear",
     .d = 2,
     .n = {30, 12, 1},
     .ratio = 3,
     .speed = 0.05},
    {.name = "bond, plate, breaking, held",
     .formulation = "bond",
     .material = "linear",
     .d = 2,
     .n = {30, 12, 1},
     .ratio = 3.015,
     .held = 5,
     .stretch = 1.05,
     .speed = 0.05},
    {.name = "bond, plate, breaking after force",
     .formulation = "bond",
     .material = "linear",
     .d = 2,
     .n = {30, 12, 1},
     .ratio = 3.015,
     .stretch = 1.05,
     .speed = 0.05,
     .after = true},
    {.name = "bond, uneven plate, breaking",
     .formulation = "bond",
     .material = "linear",
     .d = 2,
     .n = {24, 12, 1},
     .ratio = 3.015,
     .uneven = true,
     .held = 3,
     .stretch = 1.05,
     .speed = 0.05},
    {.name = "bond, block, breaking",
     .formulation = "bond",
     .material = "linear",
     .d = 3,
     .n = {14, 9, 8},
     .ratio = 3.015,
     .stretch = 1.05,
     .speed = 0.05},
    {.name = "bond, block, general, held",
     .formulation = "bond",
     .material = "linear",
     .d = 3,
     .n = {14, 7, 6},
     .ratio = 2.015,
     .general = true,
     .held = 4,
     .speed = 0.05},
    {.name = "correspondence, plate",
     .formulation = "correspondence",
     .material = "neoHookean",
     .d = 2,
     .n = {30, 12, 1},
     .ratio = 2.015,
     .speed = 0.05},
    {.name = "correspondence, plate, breaking, held",
     .formulation = "correspondence",
     .material = "neoHookean",
     .d = 2,
     .n = {30, 14, 1},
     .ratio = 2.015,
     .held = 4,
     .stretch = 1.1,
     .speed = 0.05},
    {.name = "correspondence, plate, controlled, breaking",
     .formulation = "correspondence",
     .material = "neoHookean",
     .d = 2,
     .n = {30, 14, 1},
     .ratio = 3.015,
     .zero_energy = 0.1,
     .held = 4,
     .stretch = 1.1,
     .speed = 0.05},
    {.name = "correspondence, uneven plate, breaking",
     .formulation = "correspondence",
     .material = "neoHookean",
     .d = 2,
     .n = {24, 12, 1},
     .ratio = 2.5,
     .uneven = true,
     .held = 3,
     .zero_energy = 0.1,
     .stretch = 1.1,
     .speed = 0.05},
    {.name = "correspondence, block, held",
     .formulation = "correspondence",
     .material = "neoHookean",
     .d = 3,
     .n = {16, 9, 9},
     .ratio = 2.015,
     .held = 3,
     .speed = 0.05},
    {.name = "correspondence, block, breaking",
     .formulation = "correspondence",
     .material = "neoHookean",
     .d = 3,
     .n = {12, 9, 14},
     .ratio = 3.015,
     .stretch = 1.1,
     .speed = 0.05},
    {.name = "correspondence, block, controlled, breaking, held",
     .formulation = "correspondence",
     .material = "neoHookean",
     .d = 3,
     .n = {14, 9, 9},
     .ratio = 2.015,
     .zero_energy = 0.1,
     .held = 4,
     .stretch = 1.1,
     .speed = 0.05},
    {.name = "correspondence, block, general, breaking, held",
     .formulation = "correspondence",
     .material = "neoHookean",
     .d = 3,
     .n = {14, 7, 6},
     .ratio = 2.015,
     .general = true,
     .held = 4,
     .stretch = 1.1,
     .speed = 0.05},
    {.name = "bondAssociated, plate, held",
     .formulation = "bondAssociated",
     .material = "J2",
     .d = 2,
     .n = {24, 10, 1},
     .ratio = 2.515,
     .held = 3,
     .speed = 0.05},
    {.name = "bondAssociated, plate, breaking by stretch",
     .formulation = "bondAssociated",
     .material = "J2",
     .d = 2,
     .n = {24, 10, 1},
     .ratio = 3.015,
     .stretch = 1.09,
     .speed = 0.1},
    {.name = "bondAssociated, plate, breaking by stress",
     .formulation = "bondAssociated",
     .material = "J2",
     .d = 2,
     .n = {24, 10, 1},
     .ratio = 3.015,
     .order = 1,
     .stress = 9,
     .speed = 0.1},
    {.name = "bondAssociated, plate, decaying",
     .formulation = "bondAssociated",
     .material = "J2",
     .d = 2,
     .n = {24, 10, 1},
     .ratio = 3.015,
     .strain = 0.1,
     .held = 3,
     .speed = 0.1},
    {.name = "bondAssociated, stresses of points, decaying",
     .formulation = "bondAssociated",
     .material = "J2",
     .d = 2,
     .n = {24, 10, 1},
     .ratio = 3.015,
     .points = true,
     .strain = 0.05,
     .held = 3,
     .speed = 0.1},
    {.name = "bondAssociated, uneven plate",
     .formulation = "bondAssociated",
     .material = "J2",
     .d = 2,
     .n = {20, 10, 1},
     .ratio = 3.015,
     .order = 1,
     .uneven = true,
     .stretch = 1.09,
     .speed = 0.1},
    {.name = "bondAssociated, block, held",
     .formulation = "bondAssociated",
     .material = "J2",
     .d = 3,
     .n = {9, 6, 6},
     .ratio = 2.515,
     .held = 2,
     .strain = 0.1,
     .speed = 0.1},
};

typedef struct {
    size_t n;
    double *X, *volume;
    unsigned char *held;
} cloud;

static void cloud_free(cloud *c)
{
    free(c->X);
    free(c->volume);
    free(c->held);
}

static double noise(int64_t p, int a)
{
    const uint32_t seed = (uint32_t)(p * 7919 + a * 104729 + 5) * UINT32_C(2654435761);
    return (double)(seed >> 8) / (1 << 23) - 1;
}

/* Points in columns along the first axis; uneven ones grow wider and are shaken. */
static cloud cloud_of(const scene *s)
{
    const double h = 0.1;
    const size_t n = (size_t)(s->n[0] * s->n[1] * s->n[2]);
    cloud c = {n, calloc(3 * n, sizeof(double)), calloc(n, sizeof(double)), calloc(n, 1)};
    for (size_t p = 0; p < n; p++) {
        const int index[3] = {(int)p % s->n[0], (int)p / s->n[0] % s->n[1],
                              (int)p / s->n[0] / s->n[1]};
        c.volume[p] = 1;
        for (int a = 0; a < s->d; a++) {
            const double growth = s->uneven && a == 0 ? 0.01 * index[0] : 0;
            const double width = h * (1 + growth);
            c.X[3 * p + (size_t)a] = h * index[a] * (1 + growth / 2);
            if (s->uneven)
                c.X[3 * p + (size_t)a] += 0.2 * h * noise((int64_t)p, a);
            c.volume[p] *= width;
        }
        c.held[p] = index[0] < s->held;
    }
    return c;
}

static void set_parameter(pd_body_options *o, const char *key, double value)
{
    for (int k = 0; k < o->formulation->n_parameters; k++)
        if (strcmp(o->formulation->parameters[k].key, key) == 0)
            o->formulation_parameters[k] = value;
}

static double value_of(const char *key)
{
    return strcmp(key, "nu") == 0                 ? 0.3
           : strcmp(key, "nuStab") == 0           ? 0.4
           : strcmp(key, "yieldStress") == 0      ? 2
           : strcmp(key, "hardeningModulus") == 0 ? 10
                                                  : 100;
}

static pd_body_options options_of(const scene *s)
{
    pd_body_options o = {.dimension = s->d,
                         .horizon_ratio = s->ratio,
                         .density = 1.3,
                         .damping = 0.2,
                         .general = s->general,
                         .critical_stretch = s->stretch,
                         .critical_stress = s->stress,
                         .failed_strain = s->strain,
                         .sound_strain = s->strain / 4,
                         .formulation = pd_formulation_find(s->formulation)};
    for (const pd_material *const *m = pd_materials; *m; m++)
        if (strcmp((*m)->name, s->material) == 0)
            o.material = *m;
    if (!o.material) /* the first that the formulation takes */
        for (const pd_material *const *m = pd_materials; *m && !o.material; m++)
            if (o.formulation->accepts(*m, s->d, PD_PLANE_STRAIN))
                o.material = *m;
    for (int k = 0; k < o.material->n_parameters; k++) {
        const pd_parameter *p = &o.material->parameters[k];
        const double value = value_of(p->key);
        o.parameters[k] = value < p->below ? value : 0.5 * (p->above + p->below);
    }
    for (int k = 0; k < o.formulation->n_parameters; k++)
        o.formulation_parameters[k] = o.formulation->parameters[k].standard;
    set_parameter(&o, "zeroEnergy", s->zero_energy);
    set_parameter(&o, "breakAfterForce", s->after);
    set_parameter(&o, "bondAssociation", !s->points);
    if (s->order)
        set_parameter(&o, "order", s->order);
    return o;
}

/* ---- ways of sharing ---- */

typedef int owner(const scene *s, int64_t p);

static int slabs(const scene *s, int64_t p)
{
    return (int)(p % s->n[0]) * size / s->n[0];
}

/* Across the axis along which lattices are swept. */
static int layers(const scene *s, int64_t p)
{
    const int64_t n = (int64_t)s->n[0] * s->n[1] * s->n[2];
    return (int)(p * size / n);
}

/* Blocks of three points a side, one rank after the other. */
static int patches(const scene *s, int64_t p)
{
    const int64_t x = p % s->n[0] / 3, y = p / s->n[0] % s->n[1] / 3;
    const int64_t z = p / s->n[0] / s->n[1] / 3;
    return (int)((x + 5 * y + 7 * z) % size);
}

/* The first rank has none; the last has nearly all. */
static int lopsided(const scene *s, int64_t p)
{
    (void)s;
    return size > 2 && p < 7 ? 1 : size - 1;
}

static int anyhow(const scene *s, int64_t p)
{
    (void)s;
    return (int)(fabs(noise(p, 9)) * size) % size;
}

static const struct {
    const char *name;
    owner *of;
} sharings[] = {{"slabs", slabs},
                {"layers", layers},
                {"patches", patches},
                {"lopsided", lopsided},
                {"anyhow", anyhow}};

/* ---- bodies ---- */

static const scene *the_scene;
static const char *the_sharing;
static int failures, passes;

static void report(bool good, const char *what, double value)
{
    int bad = !good, bad_ranks;
    double worst = fabs(value);
    MPI_Allreduce(&bad, &bad_ranks, 1, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
    MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
    passes += bad_ranks == 0;
    if (bad_ranks == 0)
        return;
    failures++;
    if (rank == 0)
        printf("FAIL %d ranks, %s, %s: %s differs by %g on %d ranks\n", size,
               the_scene->name, the_sharing, what, worst, bad_ranks);
}

static void expect_ok(pd_status status, const char *what)
{
    if (status.code != PD_OK && rank == 0)
        printf("  %s: %s\n", what, status.message);
    report(status.code == PD_OK, what, 0);
}

static pd_body *create(const scene *s, const cloud *all, owner *of)
{
    const pd_body_options o = options_of(s);
    pd_body *body = NULL;
    if (!of) {
        expect_ok(pd_body_create(MPI_COMM_NULL, &o, all->n, all->X, all->volume,
                                 s->held ? all->held : NULL, NULL, &body),
                  "creation in one piece");
        return body;
    }
    cloud mine = {0, calloc(3 * all->n, sizeof(double)), calloc(all->n, sizeof(double)),
                  calloc(all->n, 1)};
    pd_global *id = calloc(all->n, sizeof *id);
    for (size_t p = 0; p < all->n; p++)
        if (of(s, (int64_t)p) == rank) {
            memcpy(mine.X + 3 * mine.n, all->X + 3 * p, 3 * sizeof(double));
            mine.volume[mine.n] = all->volume[p];
            mine.held[mine.n] = all->held[p];
            id[mine.n++] = (pd_global)p;
        }
    expect_ok(pd_body_create(MPI_COMM_WORLD, &o, mine.n, mine.X, mine.volume,
                             s->held ? mine.held : NULL, id, &body),
              "creation");
    free(id);
    cloud_free(&mine);
    return body;
}

/* Waves of position and velocity, of points that move. */
static void set_waves(pd_body *body, double speed)
{
    const pd_body_view v = pd_body_fields(body);
    for (pd_local p = 0; p < v.n_moving; p++)
        for (int a = 0; a < v.dimension; a++) {
            double phase = 1.3 * a;
            for (int c = 0; c < v.dimension; c++)
                phase += (3.1 + 1.7 * c - a) * v.X[p * v.dimension + c];
            v.v[p * v.dimension + a] = speed * sin(phase);
            v.y[p * v.dimension + a] += 0.002 * cos(1.1 * phase);
        }
}

/* Where the point of each number is in the body in one piece. */
static pd_local *places_of(const pd_body *whole)
{
    const pd_body_view v = pd_body_fields(whole);
    pd_local *place = malloc((size_t)v.n_owned * sizeof *place);
    for (pd_local p = 0; p < v.n_owned; p++)
        place[v.id[p]] = p;
    return place;
}

/* mine[n_owned][width] against whole, relative to the largest of that less `rest`. */
static void compare(const pd_body_view *v, const pd_local *place, size_t n_whole,
                    const double *mine, const double *whole, const double *rest,
                    int width, const char *what)
{
    double most = 1e-300, worst = 0;
    for (size_t k = 0; k < n_whole * (size_t)width; k++)
        most = fmax(most, fabs(whole[k] - (rest ? rest[k] : 0)));
    for (pd_local p = 0; p < v->n_owned; p++)
        for (int c = 0; c < width; c++) {
            const double other = whole[place[v->id[p]] * width + c];
            const double gap = fabs(mine[p * width + c] - other) / most;
            worst = gap > worst || gap != gap ? gap : worst;
        }
    report(worst <= TOLERANCE, what, worst);
}

static void compare_numbers(double mine, double whole, const char *what)
{
    const double gap = fabs(mine - whole) / (fabs(whole) + 1e-300);
    report(mine == whole || gap <= TOLERANCE, what, gap);
}

static void compare_fields(const pd_body_view *v, const pd_body_view *w,
                           const pd_local *place)
{
    const size_t n = (size_t)w->n_owned;
    const int d = v->dimension;
    compare(v, place, n, v->y, w->y, w->X, d, "displacement");
    compare(v, place, n, v->v, w->v, NULL, d, "velocity");
    compare(v, place, n, v->force, w->force, NULL, d, "force");
    compare(v, place, n, v->F, w->F, NULL, d * d, "F");
    compare(v, place, n, v->J, w->J, NULL, 1, "J");
}

static void compare_derived(pd_body *part, pd_body *whole, const pd_local *place)
{
    const pd_body_view v = pd_body_fields(part), w = pd_body_fields(whole);
    const size_t n = (size_t)w.n_owned;
    double *mine = calloc(8 * (size_t)v.n_owned + 1, sizeof *mine);
    double *other = calloc(8 * n, sizeof *other);
    pd_global *piece = calloc(2 * n, sizeof *piece), holding[2];
    pd_body_damage(part, mine);
    pd_body_damage(whole, other);
    compare(&v, place, n, mine, other, NULL, 1, "damage");
    pd_body_stress(part, mine, mine + PD_SYMMETRIC * v.n_owned);
    pd_body_stress(whole, other, other + PD_SYMMETRIC * n);
    compare(&v, place, n, mine, other, NULL, PD_SYMMETRIC, "stress");
    compare(&v, place, n, mine + PD_SYMMETRIC * v.n_owned, other + PD_SYMMETRIC * n, NULL,
            1, "plastic strain");
    const pd_global pieces = pd_body_pieces(part, piece, &holding[0]);
    report(pieces == pd_body_pieces(whole, piece + n, &holding[1]), "number of pieces",
           (double)pieces);
    report(holding[0] == holding[1], "number of held pieces", (double)holding[0]);
    int64_t wrong = 0;
    for (pd_local p = 0; p < v.n_owned; p++)
        wrong += piece[p] != piece[(pd_global)n + place[v.id[p]]];
    report(wrong == 0, "pieces", (double)wrong);
    free(mine);
    free(other);
    free(piece);
}

static void compare_sums(pd_body *part, pd_body *whole)
{
    const pd_summary s = pd_body_summary(part), t = pd_body_summary(whole);
    report(s.bonds == t.bonds, "bonds", (double)(s.bonds - t.bonds));
    report(s.broken_bonds == t.broken_bonds, "broken bonds",
           (double)(s.broken_bonds - t.broken_bonds));
    report(s.singular == t.singular && s.inverted == t.inverted, "idle points", 0);
    compare_numbers(s.kinetic_energy, t.kinetic_energy, "kinetic energy");
    compare_numbers(s.largest_speed, t.largest_speed, "largest speed");
    compare_numbers(s.smallest_J, t.smallest_J, "smallest J");
    compare_numbers(s.largest_J, t.largest_J, "largest J");
    compare_numbers(pd_body_strain_energy(part), pd_body_strain_energy(whole),
                    "strain energy");
}

static void compare_all(pd_body *part, pd_body *whole, const pd_local *place)
{
    const pd_body_view v = pd_body_fields(part), w = pd_body_fields(whole);
    compare_fields(&v, &w, place);
    compare_derived(part, whole, place);
    compare_sums(part, whole);
}

static void check(const scene *s, owner *of)
{
    cloud all = cloud_of(s);
    pd_body *whole = create(s, &all, NULL), *part = create(s, &all, of);
    if (!whole || !part)
        return;
    pd_local *place = places_of(whole);
    const double step = 0.5 * pd_body_stable_step(whole);
    compare_numbers(pd_body_stable_step(part), 2 * step, "stable step");
    const pd_integrator *verlet = pd_integrator_find("velocityVerlet");
    pd_body *const both[] = {whole, part};
    for (int k = 0; k < 2; k++) {
        if (s->stretch > 0 && s->d > 1) {
            const pd_rectangle crack = {{1.55, -1, -1}, {0, 1.33, 0}, {0, 0, 9}};
            expect_ok(pd_body_precrack(both[k], &crack), "pre-crack");
        }
        set_waves(both[k], s->speed * pd_body_wave_speed(both[k]));
        expect_ok(pd_body_forces(both[k]), "forces");
    }
    compare_all(part, whole, place);
    for (int n = 0; n < STEPS; n++)
        for (int k = 0; k < 2; k++) {
            const pd_status status = pd_body_step(both[k], verlet, step, NULL);
            if (status.code != PD_OK)
                expect_ok(status, "step");
        }
    compare_all(part, whole, place);
    const pd_summary t = pd_body_summary(whole);
    const bool breaks = s->stretch > 0 || s->stress > 0 || s->strain > 0;
    report(!breaks || (t.broken_bonds > 0 && t.broken_bonds < t.bonds),
           "this scene breaks some bonds, not all; it", (double)t.broken_bonds);
    free(place);
    pd_body_destroy(part);
    pd_body_destroy(whole);
    cloud_free(&all);
}

/* A variable of the environment may hold a part of the names of those to be run. */
static bool is_chosen(const char *variable, const char *name)
{
    const char *part = getenv(variable);
    return !part || strstr(name, part);
}

int main(int argc, char **argv)
{
    MPI_Init(&argc, &argv);
    setvbuf(stdout, NULL, _IOLBF, 0);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++)
        for (size_t m = 0; m < sizeof sharings / sizeof *sharings; m++) {
            if (!is_chosen("SCENE", scenes[k].name) ||
                !is_chosen("SHARING", sharings[m].name))
                continue;
            the_scene = &scenes[k];
            the_sharing = sharings[m].name;
            const int before = failures;
            check(the_scene, sharings[m].of);
            if (rank == 0 && failures == before)
                printf("PASS %d ranks, %s, %s\n", size, the_scene->name, the_sharing);
        }
    MPI_Finalize();
    return failures > 0;
}
