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

#include "../handles.h"
#include "body.h"
#include "hdf5_file.h"
#include "lanes.h"
#include "lattice.h"

#define SPACING 0.1 /* m */

enum { STEPS = 24 }; /* before the body is saved, and after */

static char folder[] = "/tmp/test_checkpoint.XXXXXX", path[64];
static int open_before;

static int make_folder(void **state)
{
    if (!mkdtemp(folder))
        return -1;
    snprintf(path, sizeof path, "%s/body.h5", folder);
    open_before = handles_open();
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

/* ---- notes and facts ---- */

static void notes_come_back(void **state)
{
    pd_body *body = begin(&runs[2]);
    pull(body);
    assert_ok(pd_body_forces(body));
    advance(&runs[2], body, 2 * STEPS);
    const pd_note notes[] = {{.name = "time", .number = 0.1 + 0.2},
                             {.name = "step", .kind = PD_NOTE_INTEGER, .integer = -7},
                             {.name = "motion", .kind = PD_NOTE_TEXT, .text = "pull"}};
    assert_ok(pd_checkpoint_save(body, path, 3, notes));
    pd_note back[] = {{.name = "motion", .kind = PD_NOTE_TEXT},
                      {.name = "time"},
                      {.name = "step", .kind = PD_NOTE_INTEGER}};
    pd_body *again = begin(&runs[2]);
    assert_ok(pd_checkpoint_load(again, path, 3, back));
    assert_string_equal(back[0].text, "pull");
    assert_true(back[1].number == 0.1 + 0.2);
    assert_int_equal(back[2].integer, -7);

    pd_checkpoint_facts facts;
    assert_ok(pd_checkpoint_check(path, &facts));
    assert_int_equal(facts.version, 1);
    assert_int_equal(facts.dimension, 2);
    assert_int_equal(facts.points, pd_body_fields(body).n_owned);
    assert_int_equal(facts.broken_bonds, pd_body_summary(body).broken_bonds);
    assert_true(facts.broken_bonds > 0);
    assert_string_equal(facts.formulation, "bond");
    assert_string_equal(facts.material, "microelastic");
    assert_int_equal(facts.n_notes, 3);
    assert_string_equal(facts.notes[0].text, "pull");
    assert_int_equal(facts.notes[1].integer, -7);
    assert_string_equal(facts.notes[2].name, "time");
    assert_true(facts.notes[2].number == 0.1 + 0.2);
    pd_body_destroy(body);
    pd_body_destroy(again);
}

/* ---- what does not fit ---- */

static void assert_error(pd_status status, const char *why)
{
    if (status.code != PD_FILE_ERROR || !strstr(status.message, why) ||
        !strstr(status.message, path))
        fail_msg("expected '%s', got code %d '%s'", why, (int)status.code,
                 status.message);
}

static const run plain = {"correspondence", 2,   "correspondence",
                          "neoHookean",     {0}, .stretch = 1.09};

/* Loading into that body is refused for a reason that holds `why`. */
static void assert_unfit(pd_body *body, const char *why)
{
    assert_error(pd_checkpoint_load(body, path, 0, NULL), why);
    pd_body_destroy(body);
}

static void save_plain(void)
{
    pd_body *body = begin(&plain);
    pull(body);
    assert_ok(pd_body_forces(body));
    advance(&plain, body, 2);
    assert_ok(pd_checkpoint_save(body, path, 0, NULL));
    pd_body_destroy(body);
}

static void body_of_other_options_is_refused(void **state)
{
    save_plain();
    points cloud = cloud_of(&plain);
    pd_body_options o = options_of_run(&plain);
    o.parameters[0] = 81;
    assert_unfit(body_of(&cloud, &o), "material.G 80; that of the body: 81");
    o = options_of_run(&plain);
    o.horizon_ratio = 2.5;
    assert_unfit(body_of(&cloud, &o), "horizonRatio 3.015");
    o = options_of_run(&plain);
    o.density = 2;
    assert_unfit(body_of(&cloud, &o), "density 1.5; that of the body: 2");
    o = options_of_run(&plain);
    o.material = pd_material_find("StVenantKirchhoff");
    assert_unfit(body_of(&cloud, &o), "material neoHookean");
    o = options_of_run(&plain);
    o.formulation_parameters[0] = 0.5;
    assert_unfit(body_of(&cloud, &o), "formulation.zeroEnergy 0");
    points_free(&cloud);
    assert_unfit(begin(&runs[2]), "formulation correspondence");
}

static void body_of_other_points_is_refused(void **state)
{
    save_plain();
    points cloud = cloud_of(&plain);
    const pd_body_options o = options_of_run(&plain);
    unsigned char *held = calloc(cloud.n, 1);
    held[17] = 1;
    assert_unfit(body_with_holds(&cloud, &o, held), "point 17 has another");
    free(held);
    cloud.n--;
    assert_unfit(body_of(&cloud, &o), "266 points; the body has 265");
    cloud.n++;
    /* Off the lattice, where no point is put right. */
    pd_body_options general = o;
    general.general = true;
    pd_body *there = body_of(&cloud, &general);
    assert_ok(pd_checkpoint_save(there, path, 0, NULL));
    pd_body_destroy(there);
    /* As cell centres of a mesh that is decomposed in another way. */
    cloud.X[3 * 31 + 1] += 1e-12 * SPACING;
    pd_body *rounded = body_of(&cloud, &general);
    assert_ok(pd_checkpoint_load(rounded, path, 0, NULL));
    pd_body_destroy(rounded);
    cloud.X[3 * 31 + 1] += 1e-3 * SPACING;
    pd_body *moved = body_of(&cloud, &general);
    assert_int_equal(pd_checkpoint_load(moved, path, 0, NULL).point, 31);
    assert_unfit(moved, "point 31 has another position at rest");
    points_free(&cloud);
}

static void body_of_other_cracks_is_refused(void **state)
{
    save_plain();
    pd_body *cracked = begin(&plain);
    crack(cracked);
    assert_unfit(cracked, "bonds are intact there and broken in the body");
    cracked = begin(&plain);
    crack(cracked);
    assert_ok(pd_body_forces(cracked));
    assert_ok(pd_checkpoint_save(cracked, path, 0, NULL));
    pd_body_destroy(cracked);
    /* A body without the pre-crack gets it from the file. */
    pd_body *whole = begin(&plain);
    assert_ok(pd_checkpoint_load(whole, path, 0, NULL));
    assert_true(pd_body_summary(whole).broken_bonds > 0);
    pd_body_destroy(whole);
}

/* What may change from one run to the next. */
static void other_damping_and_damage_are_taken(void **state)
{
    save_plain();
    points cloud = cloud_of(&plain);
    pd_body_options o = options_of_run(&plain);
    o.damping = 5;
    o.critical_stretch = 0;
    pd_body *body = body_of(&cloud, &o);
    assert_ok(pd_checkpoint_load(body, path, 0, NULL));
    assert_ok(pd_body_forces(body));
    pd_body_destroy(body);
    points_free(&cloud);
}

static void missing_notes_are_named(void **state)
{
    save_plain();
    pd_body *body = begin(&plain);
    pd_note note = {.name = "startTime"};
    assert_error(pd_checkpoint_load(body, path, 1, &note), "startTime");
    const pd_note twice[] = {{.name = "a"}, {.name = "a"}}, nameless = {.number = 1};
    assert_int_equal(pd_checkpoint_save(body, path, 2, twice).code, PD_BAD_ARGUMENT);
    assert_int_equal(pd_checkpoint_save(body, path, 1, &nameless).code, PD_BAD_ARGUMENT);
    pd_body_destroy(body);
}

/* ---- files that are whole, and wrong ---- */

/* Copy the checkpoint, with some data set replaced. Names, cells and widths are those of
 * save_plain(). */
typedef struct {
    const char *name; /* of the data set to replace; NULL: none */
    pd_cell cell;
    int width;
    int64_t rows;
    const void *values;
} forgery;

static const pd_rows_of sets[] = {
    {"reference", "", "", PD_DOUBLE, 2},   {"volume", "", "", PD_DOUBLE, 1},
    {"position", "", "", PD_DOUBLE, 2},    {"velocity", "", "", PD_DOUBLE, 2},
    {"force", "", "", PD_DOUBLE, 2},       {"F", "", "", PD_DOUBLE, 4},
    {"J", "", "", PD_DOUBLE, 1},           {"held", "", "", PD_BYTE, 1},
    {"carries", "", "", PD_BYTE, 1},       {"brokenBonds", "", "", PD_INT32, 1},
    {"brokenPartner", "", "", PD_INT64, 1}};

static const char *const numbers[] = {
    "dimension",      "plane",           "horizonRatio",           "density",
    "damping",        "criticalStretch", "energyRelease",          "criticalStress",
    "failedStrain",   "soundStrain",     "formulation.zeroEnergy", "material.G",
    "material.nuStab"};

static void copy_facts(pd_file *from, pd_file *to)
{
    char word[48];
    int64_t points_of;
    assert_ok(pd_file_text(from, "formulation", sizeof word, word));
    assert_ok(pd_file_put_text(to, "formulation", word));
    assert_ok(pd_file_text(from, "material", sizeof word, word));
    assert_ok(pd_file_put_text(to, "material", word));
    assert_ok(pd_file_integer(from, "points", &points_of));
    assert_ok(pd_file_put_integer(to, "points", points_of));
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++) {
        double value;
        if (!pd_file_knows(from, numbers[k]))
            continue;
        assert_ok(pd_file_number(from, numbers[k], &value));
        assert_ok(pd_file_put_number(to, numbers[k], value));
    }
}

static void forge(const forgery *f)
{
    const pd_file_kind kind = {"checkpoint", 1};
    pd_file *from, *to;
    assert_ok(pd_file_open(MPI_COMM_NULL, path, &kind, &from));
    assert_ok(pd_file_create(MPI_COMM_NULL, path, &kind, &to));
    copy_facts(from, to);
    for (size_t k = 0; k < sizeof sets / sizeof *sets; k++) {
        int64_t rows;
        assert_ok(pd_file_count(from, &sets[k], &rows));
        char *values = malloc((size_t)rows * 8 * (size_t)sets[k].width + 1);
        assert_ok(pd_file_read(from, &sets[k], 0, rows, values));
        if (f->name && strcmp(f->name, sets[k].name) == 0) {
            const pd_rows_of other = {f->name, "", "", f->cell, f->width};
            if (f->width > 0)
                assert_ok(pd_file_write(to, &other, f->rows, f->values));
        } else
            assert_ok(pd_file_write(to, &sets[k], rows, values));
        free(values);
    }
    assert_ok(pd_file_finish(to));
    pd_file_drop(from);
}

/* As a checkpoint that says what no body could have said. */
static void forged_files_are_refused(void **state)
{
    enum { N = 266 };
    static double zeros[4 * N];
    static int32_t one[N] = {1}, two[N] = {2}, negative[N] = {-1}, huge[N] = {INT32_MAX};
    static int32_t both[N] = {-1, 2};
    static unsigned char odd[N] = {9};
    static const int64_t far[] = {200, 1}, outside[] = {INT64_MAX};
    const struct {
        forgery counts, other;
        const char *why;
        bool check; /* does the file alone tell? */
    } cases[] = {
        {{0}, {"J", PD_DOUBLE, 0, 0, NULL}, "no data set J", true},
        {{0}, {"J", PD_SINGLE, 1, N, zeros}, "J has another form", true},
        {{0}, {"F", PD_DOUBLE, 1, N, zeros}, "F has another form", true},
        {{0}, {"J", PD_DOUBLE, 1, N - 1, zeros}, "265 rows of J for 266 points", true},
        {{0}, {"carries", PD_BYTE, 1, N, odd}, "carries 9", false},
        {{0}, {"brokenBonds", PD_INT32, 1, N, one}, "do not add up", true},
        {{0}, {"brokenBonds", PD_INT32, 1, N, negative}, "do not add up", true},
        {{0}, {"brokenBonds", PD_INT32, 1, N, huge}, "do not add up", true},
        {{"brokenBonds", PD_INT32, 1, N, one},
         {"brokenPartner", PD_INT64, 1, 1, outside},
         "the body does not have",
         false},
        {{"brokenBonds", PD_INT32, 1, N, two},
         {"brokenPartner", PD_INT64, 1, 2, far},
         "the body does not have",
         false},
        {{"brokenBonds", PD_INT32, 1, N, both},
         {"brokenPartner", PD_INT64, 1, 1, outside},
         "do not add up",
         true},
    };
    pd_checkpoint_facts facts;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        pd_body *rest = begin(&plain);
        assert_ok(pd_body_forces(rest));
        assert_ok(pd_checkpoint_save(rest, path, 0, NULL));
        pd_body_destroy(rest);
        if (cases[k].counts.name)
            forge(&cases[k].counts);
        forge(&cases[k].other);
        if (cases[k].check)
            assert_error(pd_checkpoint_check(path, &facts), cases[k].why);
        else
            assert_ok(pd_checkpoint_check(path, &facts));
        assert_unfit(begin(&plain), cases[k].why);
    }
}

/* OpenFOAM runs with them on. */
static void no_trap_fires(void **state)
{
    const run *r = &runs[RUNS - 8];
    pd_body *body = begin(r), *again = begin(r);
    pd_checkpoint_facts facts;
    pull(body);
    assert_ok(pd_body_forces(body));
    advance(r, body, STEPS);
    feclearexcept(FE_ALL_EXCEPT);
    feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
    const pd_status saved = pd_checkpoint_save(body, path, 0, NULL);
    const pd_status checked = pd_checkpoint_check(path, &facts);
    const pd_status loaded = pd_checkpoint_load(again, path, 0, NULL);
    fedisableexcept(FE_ALL_EXCEPT);
    assert_ok(saved);
    assert_ok(checked);
    assert_ok(loaded);
    pd_body_destroy(body);
    pd_body_destroy(again);
}

/* Whatever went wrong before. */
static void no_handle_is_left_open(void **state)
{
    assert_int_equal(handles_open(), open_before);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_run_goes_on_as_if_never_stopped),
        cmocka_unit_test(so_it_does_on_other_machines),
        cmocka_unit_test(weights_do_not_depend_on_what_is_broken),
        cmocka_unit_test(notes_come_back),
        cmocka_unit_test(body_of_other_options_is_refused),
        cmocka_unit_test(body_of_other_points_is_refused),
        cmocka_unit_test(body_of_other_cracks_is_refused),
        cmocka_unit_test(other_damping_and_damage_are_taken),
        cmocka_unit_test(missing_notes_are_named),
        cmocka_unit_test(forged_files_are_refused),
        cmocka_unit_test(no_trap_fires),
        cmocka_unit_test(no_handle_is_left_open),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
