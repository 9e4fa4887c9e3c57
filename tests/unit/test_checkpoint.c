/*
 * A body that is saved, made anew and loaded goes on to the last bit as one that never
 * stopped; one that the file does not fit is refused.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _GNU_SOURCE /* feenableexcept, mkdtemp */
#include <fenv.h>
#include <stdio.h>
#include <unistd.h>

#include "body.h"
#include "damage.h"
#include "lanes.h"
#include "lattice.h"

#define SPACING 0.1 /* m */

enum { STEPS = 24 }; /* before the body is saved, and after */

static char folder[] = "/tmp/test_checkpoint.XXXXXX", path[64];

static int make_folder(void **state)
{
    if (!mkdtemp(folder))
        return -1;
    snprintf(path, sizeof path, "%s/body.h5", folder);
    return 0;
}

static int remove_folder(void **state)
{
    unlink(path);
    return rmdir(folder);
}

/* ---- runs ---- */

typedef struct {
    const char *what;
    int d;
    const char *formulation, *material;
    double parameters[2];                           /* of the formulation */
    double stretch, release, stress, failed, sound; /* criteria of damage */
    bool general, jittered, held, cracked, protects;
    double damping;
    const char *integrator; /* NULL: velocityVerlet */
    pd_plane plane;
} run;

/* Pulled at this rate (1/step) in all directions, unevenly, so that bonds of stretch
 * 1 + 24 x 0.004 break now and then, before and after the body is saved. */
#define RATE 0.004

static const run runs[] = {
    {"bond", 2, "bond", "microelastic", {1, 0}, .damping = 0},
    {"bond in a line", 1, "bond", "microelastic", {1, 0}, .stretch = 1.09, .held = true},
    {"bond that breaks", 2, "bond", "microelastic", {1, 0}, .stretch = 1.09},
    {"bond that breaks, no correction",
     2,
     "bond",
     "microelastic",
     {0, 0},
     .stretch = 1.09},
    {"bond that breaks later", 2, "bond", "microelastic", {1, 1}, .stretch = 1.09},
    {"bond, general",
     2,
     "bond",
     "microelastic",
     {1, 1},
     .stretch = 1.09,
     .general = true},
    {"bond, jittered",
     2,
     "bond",
     "microelastic",
     {1, 0},
     .stretch = 1.09,
     .jittered = true,
     .held = true,
     .cracked = true},
    {"bond, held, cracked, protected",
     2,
     "bond",
     "microelastic",
     {1, 0},
     .stretch = 1.09,
     .held = true,
     .cracked = true,
     .protects = true,
     .damping = 3},
    {"bond in space",
     3,
     "bond",
     "microelastic",
     {1, 0},
     .stretch = 1.09,
     .held = true,
     .cracked = true,
     .integrator = "symplecticEuler"},
    {"correspondence", 2, "correspondence", "neoHookean", {0}, .damping = 0},
    {"correspondence that breaks",
     2,
     "correspondence",
     "neoHookean",
     {0},
     .stretch = 1.09},
    {"correspondence by release",
     2,
     "correspondence",
     "neoHookean",
     {0},
     .release = 1,
     .plane = PD_PLANE_STRESS},
    {"correspondence, control",
     2,
     "correspondence",
     "neoHookean",
     {0.5},
     .stretch = 1.09,
     .held = true,
     .cracked = true,
     .damping = 2},
    {"correspondence, general",
     2,
     "correspondence",
     "neoHookean",
     {0.5},
     .stretch = 1.09,
     .general = true,
     .held = true,
     .cracked = true,
     .protects = true},
    {"correspondence, jittered",
     3,
     "correspondence",
     "neoHookean",
     {0},
     .stretch = 1.09,
     .jittered = true,
     .held = true},
    {"correspondence in space",
     3,
     "correspondence",
     "neoHookean",
     {0},
     .stretch = 1.09,
     .held = true,
     .cracked = true,
     .protects = true},
    {"correspondence in space, control",
     3,
     "correspondence",
     "neoHookean",
     {0.5},
     .stretch = 1.09,
     .cracked = true,
     .integrator = "symplecticEuler"},
    {"bondAssociated, order 1",
     2,
     "bondAssociated",
     "J2",
     {1, 1},
     .stretch = 1.09,
     .held = true},
    {"bondAssociated, order 2",
     2,
     "bondAssociated",
     "J2",
     {2, 1},
     .stretch = 1.07,
     .held = true,
     .cracked = true,
     .protects = true,
     .damping = 2},
    {"bondAssociated, order 3", 2, "bondAssociated", "J2", {3, 1}, .stress = 8},
    {"bondAssociated by plastic strain",
     2,
     "bondAssociated",
     "J2",
     {2, 1},
     .failed = 0.06,
     .sound = 0.01,
     .jittered = true,
     .held = true},
    {"bondAssociated in plane stress",
     2,
     "bondAssociated",
     "J2",
     {1, 1},
     .failed = 0.06,
     .sound = 0.01,
     .plane = PD_PLANE_STRESS},
    {"bondAssociated of points",
     2,
     "bondAssociated",
     "J2",
     {1, 0},
     .failed = 0.06,
     .sound = 0.01,
     .held = true},
    {"bondAssociated of points by stress",
     2,
     "bondAssociated",
     "J2",
     {2, 0},
     .stress = 8},
    {"bondAssociated whole", 2, "bondAssociated", "J2", {2, 1}, .held = true},
    {"bondAssociated in space",
     3,
     "bondAssociated",
     "J2",
     {1, 1},
     .failed = 0.06,
     .sound = 0.01,
     .held = true,
     .integrator = "symplecticEuler"},
    {"bondAssociated in space of points",
     3,
     "bondAssociated",
     "J2",
     {2, 0},
     .stretch = 1.09,
     .cracked = true},
};

enum { RUNS = sizeof runs / sizeof *runs };

static bool breaks(const run *r)
{
    return r->stretch > 0 || r->release > 0 || r->stress > 0 || r->failed > 0;
}

static points cloud_of(const run *r)
{
    points cloud = r->d == 3   ? lattice(3, 8, 6, 11, SPACING)
                   : r->d == 2 ? lattice(2, 14, 19, 1, SPACING)
                               : lattice(2, 40, 1, 1, SPACING);
    if (r->jittered)
        jitter(&cloud, 0.15 * SPACING);
    if (r->d == 1)
        for (size_t p = 0; p < cloud.n; p++)
            cloud.volume[p] = SPACING;
    return cloud;
}

static pd_body_options options_of_run(const run *r)
{
    pd_body_options o = {
        .dimension = r->d,
        .plane = r->plane,
        .horizon_ratio = r->d == 3 ? 2.015 : 3.015,
        .density = 1.5,
        .damping = r->damping,
        .critical_stretch = r->stretch,
        .energy_release = r->release,
        .critical_stress = r->stress,
        .failed_strain = r->failed,
        .sound_strain = r->sound,
        .general = r->general,
        .formulation = pd_formulation_find(r->formulation),
        .material = pd_material_find(r->material),
    };
    assert_non_null(o.formulation);
    assert_non_null(o.material);
    for (int k = 0; k < o.formulation->n_parameters; k++)
        o.formulation_parameters[k] = r->parameters[k];
    for (int k = 0; k < o.material->n_parameters; k++)
        o.parameters[k] = some_value(&o.material->parameters[k]);
    if (o.material->is_plastic) /* it flows from a stretch of a few hundredths on */
        for (int k = 0; k < o.material->n_parameters; k++)
            if (strcmp(o.material->parameters[k].key, "yieldStress") == 0)
                o.parameters[k] = 4;
    return o;
}

static void crack(pd_body *body)
{
    const pd_rectangle slit = {
        .corner = {0.47, -1, -1}, .edge1 = {0, 1.3, 0}, .edge2 = {0, 0, 9}};
    assert_ok(pd_body_precrack(body, &slit));
}

/* A body as the run has it when it is new. */
static pd_body *begin(const run *r)
{
    points cloud = cloud_of(r);
    const pd_body_options o = options_of_run(r);
    unsigned char *mark = calloc(cloud.n, 1);
    for (size_t p = 0; r->held && p < cloud.n; p++)
        mark[p] = cloud.X[3 * p] < 0.25;
    pd_body *body = body_with_holds(&cloud, &o, r->held ? mark : NULL);
    for (size_t p = 0; p < cloud.n; p++)
        mark[p] = cloud.X[3 * p] > 0.8;
    if (r->protects)
        assert_ok(pd_body_protect(body, mark));
    if (r->cracked)
        crack(body);
    free(mark);
    points_free(&cloud);
    return body;
}

static double step_of(const pd_body *body)
{
    return 0.2 * pd_body_settings(body)->horizon_ratio * SPACING /
           pd_body_wave_speed(body) / 3;
}

static void pull(pd_body *body)
{
    const pd_body_view view = pd_body_fields(body);
    const int d = view.dimension;
    for (pd_local p = 0; p < view.n_moving; p++)
        for (int a = 0; a < d; a++) {
            const double x = view.X[p * d + a], other = view.X[p * d + (a + 1) % d];
            view.v[p * d + a] =
                RATE / step_of(body) * (x + 0.2 * sin(5 * x) + 0.1 * sin(7 * other + a));
        }
}

static void advance(const run *r, pd_body *body, int steps)
{
    const pd_integrator *integrator =
        pd_integrator_find(r->integrator ? r->integrator : "velocityVerlet");
    const double dt = step_of(body);
    for (int k = 0; k < steps; k++)
        assert_ok(pd_body_step(body, integrator, dt, NULL));
}

/* ---- comparison ---- */

/* Runs that went wrong are all named before a test fails. */
static int differences;

static void differs(const char *of, const char *what)
{
    print_error("%s: %s\n", of, what);
    differences++;
}

static void assert_same(const char *run_of, const char *what, const void *a,
                        const void *b, size_t size)
{
    if (!a && !b)
        return;
    if (!a || !b || memcmp(a, b, size) != 0)
        differs(run_of, what);
}

/* All that a body has, to the last bit. */
static void assert_equal_bodies(const char *of, pd_body *a, pd_body *b)
{
    const size_t n = (size_t)a->n_owned, d = (size_t)a->options.dimension;
    const size_t active = (size_t)a->n_active;
    assert_int_equal(a->n_moving, b->n_moving);
    assert_same(of, "y", a->y, b->y, n * d * sizeof(double));
    assert_same(of, "v", a->v, b->v, n * d * sizeof(double));
    assert_same(of, "force", a->force, b->force, n * d * sizeof(double));
    assert_same(of, "F", a->F, b->F, n * d * d * sizeof(double));
    assert_same(of, "J", a->J, b->J, n * sizeof(double));
    assert_same(of, "carries", a->carries, b->carries, active);
    const size_t bonds = (size_t)a->families.first[a->families.n];
    assert_same(of, "broken", a->broken, b->broken, (bonds + 63) / 64 * 8);
    assert_same(of, "weight", a->weight, b->weight, bonds * sizeof(double));
    if (a->lattice) {
        const size_t bits = (size_t)a->n_regular * (size_t)a->lattice->n_offsets;
        assert_non_null(b->lattice);
        assert_same(of, "broken of the lattice", a->lattice->broken, b->lattice->broken,
                    (bits + 63) / 64 * 8);
    }
    double *one = calloc(14 * n, sizeof *one), *two = one + 7 * n;
    pd_body_stress(a, one, one + 6 * n);
    pd_body_stress(b, two, two + 6 * n);
    assert_same(of, "stress", one, two, 7 * n * sizeof *one);
    free(one);
    if (pd_body_strain_energy(a) != pd_body_strain_energy(b))
        differs(of, "energy");
    if (pd_body_stable_step(a) != pd_body_stable_step(b))
        differs(of, "stable step");
}

/* ---- going on ---- */

static void goes_on_as_if_never_stopped(const run *r)
{
    pd_body *whole = begin(r), *again = begin(r);

    pull(whole);
    assert_ok(pd_body_forces(whole));
    const int64_t cracks = pd_body_summary(whole).broken_bonds;
    advance(r, whole, STEPS);
    const int64_t broken = pd_body_summary(whole).broken_bonds;
    assert_ok(pd_checkpoint_save(whole, path, 0, NULL));
    assert_ok(pd_checkpoint_load(again, path, 0, NULL));
    assert_equal_bodies(r->what, whole, again);
    advance(r, whole, STEPS);
    advance(r, again, STEPS);
    assert_equal_bodies(r->what, whole, again);
    const pd_summary end = pd_body_summary(whole);
    if (breaks(r) && !(broken > cracks && end.broken_bonds > broken))
        differs(r->what, "too few bonds broke for a test");
    pd_body_destroy(whole);
    pd_body_destroy(again);
}

static void every_run_goes_on_as_if_never_stopped(void **state)
{
    differences = 0;
    for (int k = 0; k < RUNS; k++)
        goes_on_as_if_never_stopped(&runs[k]);
    assert_int_equal(differences, 0);
}

/* The kernels of other instruction sets round differently, but not after a restart. */
static void so_it_does_on_other_machines(void **state)
{
    differences = 0;
    for (int set = PD_ANY; set < pd_instruction_set(); set++) {
        pd_instruction_set_limit(set);
        for (int k = 0; k < RUNS; k++)
            if (!runs[k].general && !runs[k].jittered)
                goes_on_as_if_never_stopped(&runs[k]);
        pd_instruction_set_limit(PD_AVX512);
    }
    assert_int_equal(differences, 0);
}

/* The part beyond a height moves off. */
static void part(const double *X, const void *context, double *y)
{
    memcpy(y, X, 3 * sizeof *y);
    if (X[1] > *(const double *)context)
        y[1] += 100;
}

/* Rows whose corrected bonds, those towards the surface, have all been cut off could do
 * with the weights of offsets, which differ by round-off. */
static void weights_do_not_depend_on_what_is_broken(void **state)
{
    const run r = {"bond", 2, "bond", "microelastic", {1, 0}, .stretch = 1.5};
    const pd_body_options o = options_of_run(&r);
    points cloud = lattice(2, 24, 20, 1, SPACING);
    pd_body *whole = body_of(&cloud, &o), *again = body_of(&cloud, &o);
    const double height = 17 * SPACING, amplitude = 0.02;
    body_move(whole, part, &height);
    assert_ok(pd_body_forces(whole));
    assert_true(pd_body_summary(whole).broken_bonds > 0);
    assert_ok(pd_checkpoint_save(whole, path, 0, NULL));
    assert_ok(pd_checkpoint_load(again, path, 0, NULL));
    body_move(whole, move_in_waves, &amplitude);
    body_move(again, move_in_waves, &amplitude);
    assert_ok(pd_body_forces(whole));
    assert_ok(pd_body_forces(again));
    differences = 0;
    assert_equal_bodies("bond", whole, again);
    assert_int_equal(differences, 0);
    pd_body_destroy(whole);
    pd_body_destroy(again);
    points_free(&cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_run_goes_on_as_if_never_stopped),
        cmocka_unit_test(so_it_does_on_other_machines),
        cmocka_unit_test(weights_do_not_depend_on_what_is_broken),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
