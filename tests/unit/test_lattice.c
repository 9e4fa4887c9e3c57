/*
 * Bodies on a lattice: their path against the general one, in all that a body holds, for
 * every instruction set, with floating point traps on; and what counts as a lattice.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _GNU_SOURCE /* feenableexcept */
#include <fenv.h>
#include <stdio.h>

#include "body.h"
#include "lanes.h"
#include "lattice.h"

#define SPACING 0.05 /* m, of most shapes */

/* Of forces, relative to modulus / spacing, of F and J to 1: both paths sum the same
 * numbers in another order, see test_formulations.c. */
#define ROUNDING 1e-12

/* In torn bodies of correspondence K comes near singular, down to 1e-6, which costs as
 * many digits. Bonds alone lose none. */
#define TORN_ROUNDING 1e-8

static const char *const set_names[] = {"any", "avx2", "avx512"};

/* ---- shapes ---- */

typedef bool place(int x, int y, int z);

typedef struct {
    const char *name;
    int d, n[3];
    double ratio;
    place *absent, *held; /* NULL: nowhere */
    double h;             /* 0: SPACING */
} shape;

static bool outside_L(int x, int y, int z)
{
    return x > 4 && y > 3 && z < 9;
}

static bool in_hole(int x, int y, int z)
{
    return x > 3 && x < 7 && y > 2 && y < 6 && z < 3;
}

static bool by_chance(int x, int y, int z)
{
    uint32_t seed = (uint32_t)(x * 7919 + y * 104729 + z * 1299709 + 5);
    next_random(&seed);
    next_random(&seed);
    return next_random(&seed) < -0.6;
}

static bool odd(int x, int y, int z)
{
    return (x | y | z) % 2 == 1;
}

/* Two parts, far from each other, with empty planes between. */
static bool between_parts(int x, int y, int z)
{
    return (y > 3 && y < 9) || (x > 5 && x < 8 && y < 4) || z > 99;
}

static bool left(int x, int y, int z)
{
    return x < 3 && y < 99 && z < 99;
}

static bool both_ends(int x, int y, int z)
{
    return x < 2 || x > 17 || y > 99 || z > 99;
}

static bool two_sides(int x, int y, int z)
{
    return x < 2 || (x > 6 && y < 1) || z > 99;
}

static bool all_around(int x, int y, int z)
{
    return x < 1 || x > 11 || y < 2 || y > 8 || z > 99;
}

static bool an_island(int x, int y, int z)
{
    return x > 5 && x < 8 && y > 3 && y < 6 && z < 2;
}

static bool below(int x, int y, int z)
{
    return (y < 99 && z < 1) || (x < 1 && z < 3);
}

static const shape shapes[] = {
    {"two points", 1, {2, 1, 1}, 3.015, NULL, NULL, 0},
    {"row of 5", 1, {5, 1, 1}, 1.015, NULL, NULL, 0},
    {"row of 7", 1, {7, 1, 1}, 4.2, NULL, NULL, 0},
    {"row of 8", 1, {8, 1, 1}, 2.015, NULL, NULL, 0},
    {"row of 9", 1, {9, 1, 1}, 3.015, NULL, NULL, 0},
    {"row of 16", 1, {16, 1, 1}, 3.015, NULL, NULL, 0},
    {"row of 45", 1, {45, 1, 1}, 12.9, NULL, NULL, 0},
    {"row with gaps", 1, {37, 1, 1}, 3.015, by_chance, NULL, 0},
    {"row of single points", 1, {21, 1, 1}, 1.015, odd, NULL, 0},
    {"row held at its ends", 1, {20, 1, 1}, 3.015, NULL, both_ends, 0},

    {"less than a horizon", 2, {3, 2, 1}, 4.2, NULL, NULL, 0},
    {"one row", 2, {19, 1, 1}, 3.015, NULL, NULL, 0},
    {"one column", 2, {1, 19, 1}, 3.015, NULL, NULL, 0},
    {"8 x 8", 2, {8, 8, 1}, 2.015, NULL, NULL, 0},
    {"crosses alone", 2, {16, 5, 1}, 1.015, NULL, NULL, 0},
    {"13 x 11", 2, {13, 11, 1}, 3.015, NULL, NULL, 0},
    {"17 x 9", 2, {17, 9, 1}, 4.2, NULL, NULL, 0},
    {"far horizon", 2, {14, 9, 1}, 12.5, NULL, NULL, 0},
    {"L", 2, {12, 9, 1}, 3.015, outside_L, NULL, 0},
    {"plate with a hole", 2, {11, 10, 1}, 2.015, in_hole, NULL, 0},
    {"plate with gaps", 2, {14, 12, 1}, 3.015, by_chance, NULL, 0},
    {"plate of single points", 2, {9, 9, 1}, 1.015, odd, NULL, 0},
    {"parts", 2, {13, 14, 1}, 3.015, between_parts, NULL, 0},
    {"plate held on one side", 2, {13, 8, 1}, 3.015, NULL, left, 0},
    {"plate held on two sides", 2, {13, 9, 1}, 2.015, by_chance, two_sides, 0},
    {"plate held all around", 2, {13, 11, 1}, 3.015, NULL, all_around, 0},
    {"plate held inside", 2, {14, 10, 1}, 4.2, NULL, an_island, 0},
    {"plate of a whole horizon", 2, {12, 9, 1}, 3, NULL, NULL, 0.0625},
    /* With chunks that miss nothing. */
    {"long plate", 2, {28, 9, 1}, 3.015, NULL, NULL, 0},
    {"long plate, far horizon", 2, {26, 11, 1}, 4.2, NULL, NULL, 0},
    {"long plate held inside", 2, {27, 12, 1}, 2.015, NULL, an_island, 0},

    {"cube less than a horizon", 3, {3, 2, 3}, 4.2, NULL, NULL, 0},
    {"one row in space", 3, {19, 1, 1}, 3.015, NULL, NULL, 0},
    {"one pillar in space", 3, {1, 1, 11}, 2.015, NULL, NULL, 0},
    {"one plane in space", 3, {10, 7, 1}, 2.015, NULL, NULL, 0},
    {"one upright plane", 3, {1, 9, 8}, 2.015, NULL, NULL, 0},
    {"8 x 4 x 5", 3, {8, 4, 5}, 2.015, NULL, NULL, 0},
    {"crosses in space", 3, {9, 4, 4}, 1.015, NULL, NULL, 0},
    {"9 x 6 x 7", 3, {9, 6, 7}, 3.015, NULL, NULL, 0},
    {"6 x 5 x 4", 3, {6, 5, 4}, 4.2, NULL, NULL, 0},
    {"L in space", 3, {8, 6, 4}, 2.015, outside_L, NULL, 0},
    {"block with a hole", 3, {9, 8, 4}, 2.015, in_hole, NULL, 0},
    {"block with gaps", 3, {11, 5, 5}, 3.015, by_chance, NULL, 0},
    {"block held below", 3, {9, 4, 7}, 2.015, NULL, below, 0},
    {"block held on two sides", 3, {10, 5, 5}, 3.015, by_chance, two_sides, 0},
    {"long block", 3, {18, 6, 6}, 2.015, NULL, NULL, 0},
};
enum { SHAPES = sizeof shapes / sizeof *shapes };

static double step_of(const shape *s)
{
    return s->h > 0 ? s->h : SPACING;
}

/* The points of a shape, in no order, and which are held (to free). */
static points cut_out(const shape *s, unsigned char **held)
{
    points box = lattice(s->d, s->n[0], s->n[1], s->n[2], step_of(s));
    points cloud = {s->d, 0, calloc(3 * box.n, sizeof(double)),
                    malloc(box.n * sizeof(double))};
    *held = calloc(box.n, 1);
    size_t stride = 37;
    while (box.n % stride == 0) /* 37 is prime */
        stride++;
    for (size_t k = 0; k < box.n; k++) {
        const size_t p = k * stride % box.n;
        int at[3];
        for (int a = 0; a < 3; a++)
            at[a] = (int)floor(box.X[3 * p + (size_t)a] / step_of(s));
        if (s->absent && s->absent(at[0], at[1], at[2]))
            continue;
        memcpy(cloud.X + 3 * cloud.n, box.X + 3 * p, 3 * sizeof *cloud.X);
        cloud.volume[cloud.n] = box.volume[p];
        (*held)[cloud.n++] = s->held && s->held(at[0], at[1], at[2]);
    }
    points_free(&box);
    return cloud;
}

/* ---- models ---- */

typedef struct {
    const char *name, *formulation, *material;
    int least, most; /* dimensions */
    pd_plane plane;
    double parameter; /* of the formulation */
} model;

static const model models[] = {
    {"bond", "bond", "microelastic", 1, 3, PD_PLANE_STRAIN, 0},
    {"bond corrected", "bond", "microelastic", 1, 3, PD_PLANE_STRESS, 1},
    {"correspondence", "correspondence", "neoHookean", 2, 3, PD_PLANE_STRAIN, 0},
    {"correspondence controlled", "correspondence", "neoHookean", 2, 3, PD_PLANE_STRAIN,
     0.7},
};
enum { MODELS = sizeof models / sizeof *models };

static pd_body_options options_for(const model *m, int d, double ratio)
{
    pd_body_options options = options_of(d == 1 ? 2 : d, ratio);
    options.dimension = d;
    options.plane = m->plane;
    options.formulation = pd_formulation_find(m->formulation);
    options.formulation_parameters[0] = m->parameter;
    options.material = pd_material_find(m->material);
    for (int k = 0; k < options.material->n_parameters; k++)
        options.parameters[k] = some_value(&options.material->parameters[k]);
    return options;
}

/* ---- pairs of bodies ---- */

typedef struct {
    const shape *shape;
    const model *model;
    int set; /* of instructions */

    points cloud;
    unsigned char *held;
    pd_body_options options;
    size_t n;
    pd_body *body[2]; /* on its lattice, and the general way */
    pd_body_view view[2];
    pd_local *local[2]; /* where the caller's points are */
    double modulus, tolerance;
} pair;

enum { LATTICE, GENERAL };

/* Both bodies, or neither: then the same error of both. */
static bool pair_create(pair *p)
{
    pd_status status[2];
    for (int way = 0; way < 2; way++) {
        p->options.general = way == GENERAL;
        status[way] = pd_body_create(MPI_COMM_NULL, &p->options, p->n, p->cloud.X,
                                     p->cloud.volume, p->held, NULL, &p->body[way]);
    }
    assert_int_equal(status[LATTICE].code, status[GENERAL].code);
    if (status[LATTICE].code != PD_OK) {
        assert_int_equal(status[LATTICE].code, PD_BAD_FAMILY);
        return false;
    }
    assert_non_null(p->body[LATTICE]->lattice);
    assert_null(p->body[GENERAL]->lattice);
    for (int way = 0; way < 2; way++) {
        p->view[way] = pd_body_fields(p->body[way]);
        p->local[way] = places_of(p->body[way]);
    }
    const double c = pd_body_wave_speed(p->body[GENERAL]);
    p->modulus = p->options.density * c * c;
    return true;
}

static void pair_destroy(pair *p)
{
    for (int way = 0; way < 2; way++) {
        pd_body_destroy(p->body[way]);
        free(p->local[way]);
        p->body[way] = NULL;
        p->local[way] = NULL;
    }
}

/* The same positions, to the last bit. */
static void pair_move(const pair *p, motion move, const void *context)
{
    const size_t d = (size_t)p->shape->d;
    body_move(p->body[GENERAL], move, context);
    for (size_t k = 0; k < p->n; k++)
        memcpy(p->view[LATTICE].y + (size_t)p->local[LATTICE][k] * d,
               p->view[GENERAL].y + (size_t)p->local[GENERAL][k] * d, d * sizeof(double));
}

static pd_code forces_with_traps(pd_body *body)
{
    feclearexcept(FE_ALL_EXCEPT);
    feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
    const pd_status status = pd_body_forces(body);
    fedisableexcept(FE_ALL_EXCEPT);
    return status.code;
}

/* ---- what a pair has in common ---- */

/* Numbers [n_moving][m] of either body, compared point by point with what the general
 * body's largest number or `scale` makes of the tolerance. */
static void assert_same_numbers(const pair *p, const double *const *values, int m,
                                double scale, const char *what)
{
    const size_t moving = (size_t)p->view[GENERAL].n_moving;
    const double most = largest(values[GENERAL], moving * (size_t)m);
    assert_true(isfinite(most));
    for (size_t k = 0; k < p->n; k++) {
        const pd_local i = p->local[LATTICE][k], j = p->local[GENERAL][k];
        for (int c = 0; c < m && j < p->view[GENERAL].n_moving; c++)
            assert_near_(values[LATTICE][i * m + c], values[GENERAL][j * m + c],
                         p->tolerance * fmax(scale, most), what, __FILE__, __LINE__);
    }
}

static void assert_same_fields(const pair *p)
{
    const int d = p->shape->d;
    const double *force[] = {p->view[0].force, p->view[1].force};
    const double *F[] = {p->view[0].F, p->view[1].F}, *J[] = {p->view[0].J, p->view[1].J};
    assert_same_numbers(p, force, d, p->modulus / step_of(p->shape), "force");
    assert_same_numbers(p, F, d * d, 1, "F");
    assert_same_numbers(p, J, 1, 1, "J");
}

static void assert_same_derived(const pair *p)
{
    double *stress[2], *omega2[2], *damage[2];
    for (int way = 0; way < 2; way++) {
        stress[way] = malloc(p->n * PD_SYMMETRIC * sizeof(double));
        omega2[way] = malloc((p->n + 1) * sizeof(double));
        damage[way] = malloc(p->n * sizeof(double));
        pd_body_stress(p->body[way], stress[way], NULL);
        pd_body_damage(p->body[way], damage[way]);
        p->options.formulation->frequency(p->body[way], omega2[way]);
    }
    assert_same_numbers(p, (const double *const *)stress, PD_SYMMETRIC, p->modulus,
                        "stress");
    assert_same_numbers(p, (const double *const *)omega2, 1, 0, "omega2");
    for (size_t k = 0; k < p->n; k++)
        assert_near(damage[0][p->local[0][k]], damage[1][p->local[1][k]], ROUNDING);
    for (int way = 0; way < 2; way++) {
        free(stress[way]);
        free(omega2[way]);
        free(damage[way]);
    }
    const double step = pd_body_stable_step(p->body[GENERAL]);
    if (isfinite(step))
        assert_near(pd_body_stable_step(p->body[LATTICE]), step, p->tolerance * step);
    else
        assert_true(isinf(pd_body_stable_step(p->body[LATTICE])));
}

/* bonds[n][n] by caller's numbers: 0 none, 1 broken, 2 intact. */
static unsigned char *bonds_of(const pair *p, int way)
{
    unsigned char *bonds = calloc(p->n * p->n, 1);
    for (size_t k = 0; k < p->n; k++) {
        pd_local neighbour[MOST_NEIGHBOURS];
        const pd_local i = p->local[way][k];
        const pd_local count =
            pd_body_family(p->body[way], i, MOST_NEIGHBOURS, neighbour);
        for (pd_local m = 0; m < count; m++) {
            unsigned char *bond =
                &bonds[k * p->n + (size_t)p->view[way].id[neighbour[m]]];
            assert_int_equal(*bond, 0);
            *bond = pd_body_bond_intact(p->body[way], i, m) ? 2 : 1;
        }
    }
    return bonds;
}

/* Bond by bond; and a bond is as broken at one end as at the other. */
static void assert_same_bonds(const pair *p)
{
    unsigned char *bonds[2] = {bonds_of(p, 0), bonds_of(p, 1)};
    assert_memory_equal(bonds[0], bonds[1], p->n * p->n);
    for (size_t i = 0; i < p->n; i++)
        for (size_t j = 0; j < i; j++)
            if (bonds[0][i * p->n + j] && bonds[0][j * p->n + i])
                assert_int_equal(bonds[0][i * p->n + j], bonds[0][j * p->n + i]);
    free(bonds[0]);
    free(bonds[1]);
}

/* The same parts, by the same names. */
static void assert_same_pieces(const pair *p)
{
    pd_global *piece[2], count[2], holding[2];
    for (int way = 0; way < 2; way++) {
        piece[way] = malloc(p->n * sizeof *piece[way]);
        count[way] = pd_body_pieces(p->body[way], piece[way], &holding[way]);
    }
    assert_int_equal(count[0], count[1]);
    assert_int_equal(holding[0], holding[1]);
    for (size_t k = 0; k < p->n; k++)
        assert_int_equal(piece[0][p->local[0][k]], piece[1][p->local[1][k]]);
    free(piece[0]);
    free(piece[1]);
}

static void assert_same_summary(const pair *p)
{
    const pd_summary a = pd_body_summary(p->body[0]), b = pd_body_summary(p->body[1]);
    const double volume = (double)p->n * pow(step_of(p->shape), p->shape->d);
    assert_int_equal(a.bonds, b.bonds);
    assert_int_equal(a.broken_bonds, b.broken_bonds);
    assert_int_equal(a.singular, b.singular);
    assert_int_equal(a.inverted, b.inverted);
    const double energy = pd_body_strain_energy(p->body[1]);
    assert_near(pd_body_strain_energy(p->body[0]), energy,
                p->tolerance * fmax(p->modulus * volume, energy));
    assert_near(a.smallest_J, b.smallest_J, p->tolerance * fmax(1, b.largest_J));
    assert_near(a.largest_J, b.largest_J, p->tolerance * fmax(1, b.largest_J));
    assert_near(a.mean_volume_change, b.mean_volume_change,
                p->tolerance * fmax(1, b.largest_J));
}

static void assert_pair_agrees(const pair *p)
{
    const pd_code code = forces_with_traps(p->body[GENERAL]);
    assert_int_equal(forces_with_traps(p->body[LATTICE]), code);
    assert_int_equal(p->view[0].n_moving, p->view[1].n_moving);
    assert_int_equal(p->view[0].n_active, p->view[1].n_active);
    assert_same_fields(p);
    assert_same_derived(p);
    assert_same_bonds(p);
    assert_same_pieces(p);
    assert_same_summary(p);
}

/* ---- intact bodies ---- */

static void whole_bodies_agree(pair *p)
{
    const double amplitude = 0.1 * step_of(p->shape);
    const affine map = distortion(p->shape->d == 1 ? 3 : p->shape->d);
    assert_pair_agrees(p);
    pair_move(p, move_affinely, &map);
    assert_pair_agrees(p);
    pair_move(p, move_in_waves, &amplitude);
    assert_pair_agrees(p);
    assert_true(p->shape->absent == odd ||
                largest(p->view[0].force, (size_t)p->view[0].n_moving) > 0);
}

/* The mirrored ends of bonds into a hold meet moving points but for round-off, which then
 * decides on the direction of their force. */
static void assert_pair_survives(const pair *p)
{
    if (!p->shape->held) {
        assert_pair_agrees(p);
        return;
    }
    for (int way = 0; way < 2; way++) {
        forces_with_traps(p->body[way]);
        assert_true(isfinite(largest(p->view[way].force, (size_t)p->view[way].n_moving)));
    }
}

/* All in one place, and some: the force of no direction is none. */
static void meet(const double *X, const void *context, double *y)
{
    const double h = *(const double *)context;
    for (int a = 0; a < 3; a++)
        y[a] = 2 * h * floor(X[a] / (2 * h));
}

static void bodies_whose_points_meet_agree(pair *p)
{
    const double h = step_of(p->shape);
    const affine collapse = {{0}, {0.5, 0.2, 0.1}};
    pair_move(p, move_affinely, &collapse);
    assert_pair_survives(p);
    pair_move(p, meet, &h);
    assert_pair_survives(p);
}

/* ---- damage ---- */

/* A point's own displacement of up to context[0] (m), even in all directions; context[1]
 * gives each step another. */
static void shake(const double *X, const void *context, double *y)
{
    const double *amplitude = context;
    uint32_t seed =
        (uint32_t)(amplitude[1] + X[0] * 7001 + X[1] * 30011 + X[2] * 90001 + 17);
    for (int a = 0; a < 3; a++) {
        next_random(&seed);
        y[a] = X[a] + *amplitude * next_random(&seed);
    }
}

/* Breaks more and more bonds, goes back part of the way, and lets fly apart. */
static void shake_apart(pair *p)
{
    const double amplitudes[] = {0.02, 0.12, 0.16, 0.05, 0.25, 0.4, 0.1};
    for (size_t k = 0; k < sizeof amplitudes / sizeof *amplitudes; k++) {
        const double context[] = {amplitudes[k] * step_of(p->shape), (double)k * 1000};
        pair_move(p, shake, context);
        assert_pair_agrees(p);
    }
    const affine explosion = {{7, 0, 0, 0, 7, 0, 0, 0, 7}, {0}};
    pair_move(p, move_affinely, &explosion);
    assert_pair_agrees(p);
    pair_move(p, move_affinely, at_rest());
    assert_pair_agrees(p);
}

static void torn_bodies_agree(pair *p)
{
    shake_apart(p);
}

/* Opened along an oblique plane, so that most chunks stay whole. */
static void tear(const double *X, const void *context, double *y)
{
    const double opening = *(const double *)context;
    memcpy(y, X, 3 * sizeof *y);
    y[0] += opening * tanh(40 * (X[0] - 0.21 + 0.2 * X[1] + 0.1 * X[2]));
    y[1] += 0.2 * opening * sin(30 * X[0]);
}

static void slowly_torn_bodies_agree(pair *p)
{
    const double openings[] = {0.05, 0.12, 0.2, 0.3, 0.1, 0.6};
    for (size_t k = 0; k < sizeof openings / sizeof *openings; k++) {
        const double opening = openings[k] * step_of(p->shape);
        pair_move(p, tear, &opening);
        assert_pair_agrees(p);
    }
}

static void protected_bodies_agree(pair *p)
{
    unsigned char *safe = malloc(p->n);
    for (size_t k = 0; k < p->n; k++)
        safe[k] = p->cloud.X[3 * k] > 5.2 * SPACING || k % 7 == 0;
    for (int way = 0; way < 2; way++)
        assert_ok(pd_body_protect(p->body[way], safe));
    shake_apart(p);
    free(safe);
}

/* One into the body, one through it. */
static void precracked_bodies_agree(pair *p)
{
    const double h = step_of(p->shape), amplitude = 0.1 * h;
    const pd_rectangle cracks[] = {
        {.corner = {3.17 * h, -h, -h}, .edge1 = {0, 4.34 * h, 0}, .edge2 = {0, 0, 9 * h}},
        {.corner = {6.1 * h, -h, -h},
         .edge1 = {3 * h, 17 * h, 0},
         .edge2 = {0, h, 9 * h}},
        {.corner = {-h, -h, 2.23 * h}, .edge1 = {5.3 * h, 0, 0}, .edge2 = {0, 9 * h, h}},
    };
    for (size_t k = 0; k < (p->shape->d == 3 ? 3 : 2); k++) {
        for (int way = 0; way < 2; way++)
            assert_ok(pd_body_precrack(p->body[way], &cracks[k]));
        assert_pair_agrees(p);
    }
    pair_move(p, move_in_waves, &amplitude);
    assert_pair_agrees(p);
    if (pd_body_can_break(&p->options))
        shake_apart(p);
}

/* ---- all of it ---- */

typedef struct {
    const char *name;
    void (*run)(pair *p);
    double critical_stretch;
    double energy_release; /* over modulus times spacing */
} check;

static const check checks[] = {
    {"whole bodies agree", whole_bodies_agree, 0, 0},
    {"bodies whose points meet agree", bodies_whose_points_meet_agree, 0, 0},
    {"bodies whose points meet agree with damage", bodies_whose_points_meet_agree, 1.234,
     0},
    {"torn bodies agree", torn_bodies_agree, 1.2, 0},
    {"torn bodies of given energy release agree", torn_bodies_agree, 0, 0.08},
    {"slowly torn bodies agree", slowly_torn_bodies_agree, 1.1, 0},
    {"protected bodies agree", protected_bodies_agree, 1.2, 0},
    {"precracked bodies agree", precracked_bodies_agree, 0, 0},
    {"precracked bodies agree with damage", precracked_bodies_agree, 1.2, 0},
};
enum { CHECKS = sizeof checks / sizeof *checks };

typedef struct {
    const check *check;
    const shape *shape;
    const model *model;
    int set;
} sample;

/* One-dimensional bodies have no energy release rate, and their bonds no F. */
static bool applies(const sample *s)
{
    return s->shape->d >= s->model->least &&
           (s->shape->d > 1 || s->check->energy_release == 0);
}

/* Points that their families do not hold in space are no body of correspondence: a row,
 * a plane, crosses of single points. Both paths must say so; that is checked already. */
static void check_sample(void **state)
{
    const sample *s = *state;
    pair p = {.shape = s->shape, .model = s->model, .set = s->set};
    pd_instruction_set_limit(s->set);
    if (pd_instruction_set() != s->set)
        skip(); /* not on this machine */
    p.cloud = cut_out(s->shape, &p.held);
    p.n = p.cloud.n;
    p.options = options_for(s->model, s->shape->d, s->shape->ratio);
    p.options.critical_stretch = s->check->critical_stretch;
    p.options.energy_release =
        s->check->energy_release *
        pd_longitudinal_modulus(p.options.material, p.options.parameters, s->shape->d,
                                p.options.plane) *
        step_of(s->shape);
    const bool breaks =
        pd_body_can_break(&p.options) || s->check->run == precracked_bodies_agree;
    p.tolerance = breaks && p.options.formulation->corresponds ? TORN_ROUNDING : ROUNDING;
    if (pair_create(&p))
        s->check->run(&p);
    pair_destroy(&p);
    free(p.held);
    points_free(&p.cloud);
    pd_instruction_set_limit(PD_AVX512);
}

typedef char test_name[160];

static size_t list_samples(sample *samples)
{
    size_t n = 0;
    for (int k = 0; k < SHAPES * MODELS * CHECKS * PD_INSTRUCTION_SETS; k++) {
        const int set = k % PD_INSTRUCTION_SETS, c = k / PD_INSTRUCTION_SETS % CHECKS;
        const int sm = k / PD_INSTRUCTION_SETS / CHECKS;
        const sample s = {&checks[c], &shapes[sm / MODELS], &models[sm % MODELS], set};
        if (!applies(&s))
            continue;
        if (samples)
            samples[n] = s;
        n++;
    }
    return n;
}

static struct CMUnitTest test_of(sample *s, test_name name)
{
    snprintf(name, sizeof(test_name), "%dD %s, %s, %s: %s", s->shape->d, s->shape->name,
             s->model->name, set_names[s->set], s->check->name);
    return (struct CMUnitTest){name, check_sample, NULL, NULL, s};
}

/* ---- bonds that weigh nothing ---- */

static void open_at_middle(const double *X, const void *context, double *y)
{
    memcpy(y, X, 3 * sizeof *y);
    y[0] += X[0] > 0.5 ? *(const double *)context : 0;
}

/* Bonds of exactly the horizon's length weigh nothing in correspondence, but connect, and
 * break: here two steps long, after all that weigh. 16 steps of 1/16 m, s_c = 1.2; the
 * gap opens by 0.3, 0.38 and 0.45 steps: bonds of one step break at 0.2, oblique ones at
 * 0.3748, those of two steps at 0.4. */
static void bonds_without_weight_break_too(void **state)
{
    const shape plate = {"", 2, {16, 6, 1}, 2, NULL, NULL, 0.0625};
    const double gaps[] = {0.3, 0.38, 0.45};
    const pd_local pieces[] = {1, 1, 2};
    for (int m = 2; m < MODELS; m++) {
        pair p = {.shape = &plate, .model = &models[m], .tolerance = TORN_ROUNDING};
        p.cloud = cut_out(&plate, &p.held);
        p.n = p.cloud.n;
        p.options = options_for(p.model, 2, plate.ratio);
        p.options.critical_stretch = 1.2;
        assert_true(pair_create(&p));
        for (int k = 0; k < 3; k++) {
            const double gap = gaps[k] * 0.0625;
            pd_global piece[96];
            pair_move(&p, open_at_middle, &gap);
            assert_pair_agrees(&p);
            assert_int_equal(pd_body_pieces(p.body[LATTICE], piece, NULL), pieces[k]);
        }
        pair_destroy(&p);
        free(p.held);
        points_free(&p.cloud);
    }
}

/* ---- what is a lattice ---- */

static bool takes_lattice(const points *cloud, double ratio)
{
    const pd_body_options options = options_for(&models[0], cloud->d, ratio);
    pd_body *body = body_of(cloud, &options);
    const bool takes = body->lattice;
    pd_body_destroy(body);
    return takes;
}

/* A 9 x 7 plate whose inner point 30 is off by so many steps along y. */
static bool accepts_point_off_by(double steps)
{
    points cloud = lattice(2, 9, 7, 1, SPACING);
    cloud.X[3 * 30 + 1] += steps * SPACING;
    const bool accepts = takes_lattice(&cloud, 3.015);
    points_free(&cloud);
    return accepts;
}

static void positions_may_be_rounded(void **state)
{
    assert_true(accepts_point_off_by(1e-5));
    assert_true(accepts_point_off_by(-0.9e-4));
    assert_false(accepts_point_off_by(1.1e-4));
    assert_false(accepts_point_off_by(-1e-3));
    assert_false(accepts_point_off_by(0.5));
}

static bool accepts_volume_off_by(double share)
{
    points cloud = lattice(3, 5, 4, 4, SPACING);
    cloud.volume[11] *= 1 + share;
    const bool accepts = takes_lattice(&cloud, 2.015);
    points_free(&cloud);
    return accepts;
}

static void volumes_may_be_rounded(void **state)
{
    assert_true(accepts_volume_off_by(1e-5));
    assert_false(accepts_volume_off_by(1e-3));
    assert_false(accepts_volume_off_by(-1e-3));
}

/* Steps of sx, sy, sz times the edge of a point's volume. */
static bool accepts_steps(int d, double sx, double sy, double sz)
{
    points cloud = lattice(d, 6, d > 1 ? 5 : 1, d > 2 ? 4 : 1, SPACING);
    const double factor[] = {sx, sy, sz};
    for (size_t k = 0; k < 3 * cloud.n; k++)
        cloud.X[k] *= factor[k % 3];
    const bool accepts = takes_lattice(&cloud, 2.015);
    points_free(&cloud);
    return accepts;
}

static void steps_are_those_of_volumes_along_all_axes(void **state)
{
    for (int d = 1; d <= 3; d++) {
        assert_true(accepts_steps(d, 1, 1, 1));
        assert_false(accepts_steps(d, 1.01, 1.01, 1.01));
        assert_false(accepts_steps(d, 0.99, 0.99, 0.99));
    }
    assert_false(accepts_steps(2, 1, 1.01, 1));
    assert_false(accepts_steps(2, 1.01, 1, 1));
    assert_false(accepts_steps(3, 1, 1, 1.001));
    assert_true(accepts_steps(3, 2, 1, 3)); /* with empty places between */
}

/* Inner points off by 1e-5 of a step: the box, and with it the step, is as it was. */
static points rounded_lattice(int d)
{
    points cloud = lattice(d, 11, d > 1 ? 9 : 1, d > 2 ? 4 : 1, SPACING);
    const double *last = cloud.X + 3 * (cloud.n - 1);
    uint32_t seed = 7;
    for (size_t k = 3; k < 3 * (cloud.n - 1); k++)
        if (cloud.X[k] > cloud.X[k % 3] && cloud.X[k] < last[k % 3])
            cloud.X[k] += 1e-5 * SPACING * next_random(&seed);
    cloud.volume[3] *= 1 + 1e-5;
    return cloud;
}

/* Points of a body are put where the lattice is, so that all offsets are exact. */
static void rounded_points_are_put_on_the_lattice(void **state)
{
    for (int d = 1; d <= 3; d++) {
        points cloud = rounded_lattice(d);
        points exact = lattice(d, 11, d > 1 ? 9 : 1, d > 2 ? 4 : 1, SPACING);
        const pd_body_options options = options_for(&models[0], d, 2.015);
        pd_body *body = body_of(&cloud, &options);
        const pd_body_view view = pd_body_fields(body);
        assert_non_null(body->lattice);
        for (pd_local p = 0; p < view.n_owned; p++) {
            assert_true(view.volume[p] == view.volume[0]);
            assert_true(view.spacing[p] == view.spacing[0]);
            for (int a = 0; a < d; a++) {
                assert_near(view.X[p * d + a], exact.X[3 * view.id[p] + a], 1e-15);
                assert_near(view.y[p * d + a], exact.X[3 * view.id[p] + a], 1e-15);
            }
        }
        pd_body_destroy(body);
        points_free(&exact);
        points_free(&cloud);
    }
}

/* n points of a diagonal: a lattice of n x n places, nearly all of them empty. */
static bool accepts_diagonal(int n)
{
    points cloud = lattice(2, n, 1, 1, SPACING);
    for (int k = 0; k < n; k++)
        cloud.X[3 * k + 1] = cloud.X[3 * k];
    const bool accepts = takes_lattice(&cloud, 3.015);
    points_free(&cloud);
    return accepts;
}

static void sparse_points_are_no_lattice(void **state)
{
    assert_true(accepts_diagonal(50));
    assert_false(accepts_diagonal(600));
}

static void points_in_one_place_are_no_lattice(void **state)
{
    pd_body_options options = options_of(2, 2.015);
    points cloud = lattice(2, 6, 5, 1, SPACING);
    memcpy(cloud.X, cloud.X + 3, 3 * sizeof *cloud.X);
    pd_body *body = body_of(&cloud, &options);
    assert_null(body->lattice);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* Offsets are 512 at most, PD_MOST_OFFSETS, and reach 12 steps: the plane has fewer
 * within 12.5 steps, space has 514 within 5. */
static void horizons_too_far_or_too_near_are_no_lattice(void **state)
{
    const struct {
        int d;
        double ratio;
        bool takes;
    } horizons[] = {{1, 0.9, false},  {1, 1.015, true}, {1, 12.9, true},
                    {1, 13.1, false}, {2, 0.9, false},  {2, 12.5, true},
                    {2, 13.1, false}, {3, 4.9, true},   {3, 5.015, false}};
    for (size_t k = 0; k < sizeof horizons / sizeof *horizons; k++) {
        const int d = horizons[k].d;
        points cloud = lattice(d, 6, d > 1 ? 5 : 1, d > 2 ? 4 : 1, SPACING);
        assert_int_equal(takes_lattice(&cloud, horizons[k].ratio), horizons[k].takes);
        points_free(&cloud);
    }
}

static void general_path_can_be_asked_for(void **state)
{
    points cloud = lattice(2, 6, 5, 1, SPACING);
    pd_body_options options = options_of(2, 2.015);
    pd_body *body = body_of(&cloud, &options);
    assert_non_null(body->lattice);
    pd_body_destroy(body);
    options.general = true;
    body = body_of(&cloud, &options);
    assert_null(body->lattice);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- where the lattice is ---- */

/* A body of 9 x 7 x 5 points, or 9 x 7, or 9, whose corner is at `origin`. */
static pd_body *body_at(const pd_body_options *options, const double *origin)
{
    const int d = options->dimension;
    points cloud = lattice(d, 9, d > 1 ? 7 : 1, d > 2 ? 5 : 1, SPACING);
    for (size_t k = 0; k < 3 * cloud.n; k++)
        cloud.X[k] += origin[k % 3];
    pd_body *body = body_of(&cloud, options);
    assert_non_null(body->lattice);
    points_free(&cloud);
    return body;
}

/* Points of both stand in the same order. Positions of 2000 m are rounded to 2e-13 m,
 * 5e-12 of a step; K^-1 of a torn family may make 1e3 of that. */
static void assert_same_but_for_the_origin(pd_body *home, pd_body *body,
                                           const double *origin)
{
    const pd_body_view here = pd_body_fields(home), there = pd_body_fields(body);
    const size_t numbers = (size_t)(here.n_owned * here.dimension);
    const double c = pd_body_wave_speed(home);
    const double scale = pd_body_settings(home)->density * c * c / SPACING;
    for (size_t k = 0; k < numbers; k++)
        there.y[k] = here.y[k] + origin[k % (size_t)here.dimension];
    assert_ok(pd_body_forces(home));
    assert_ok(pd_body_forces(body));
    for (size_t k = 0; k < numbers; k++)
        assert_near(there.force[k], here.force[k], 1e-8 * scale);
    assert_int_equal(pd_body_summary(body).broken_bonds,
                     pd_body_summary(home).broken_bonds);
}

static void check_place(const model *m, int d, const double *origin)
{
    pd_body_options options = options_for(m, d, 2.015);
    options.critical_stretch = 1.3;
    const double zero[3] = {0};
    pd_body *home = body_at(&options, zero), *body = body_at(&options, origin);
    for (int k = 0; k < 3; k++) {
        body_move(home, shake, (const double[]){(0.03 + 0.09 * k) * SPACING, 0});
        assert_same_but_for_the_origin(home, body, origin);
    }
    assert_true(pd_body_summary(home).broken_bonds > 0);
    pd_body_destroy(home);
    pd_body_destroy(body);
}

static void lattice_may_be_anywhere(void **state)
{
    const double origins[][3] = {{-1234.5, 0.017, 3}, {1999, -1500.3, -0.4}};
    for (int m = 0; m < MODELS; m++)
        for (int d = models[m].least; d <= 3; d++)
            for (int o = 0; o < 2; o++)
                check_place(&models[m], d, origins[o]);
}

/* ---- vectors ---- */

/* Three steps leave less than 2 ulp, 4e-16, of the root; the division of the test itself
 * another. 0 gives a finite number. */
static void reciprocal_root_is_exact_to_an_ulp_or_two(void **state)
{
    for (int exponent = -1000; exponent <= 1000; exponent += 1)
        for (int k = 0; k < 64; k++) {
            const double x = ldexp(1 + k / 64.0, exponent);
            const lanes zero = {0}, root = reciprocal_root(zero + x);
            for (int q = 0; q < PD_WIDTH; q++)
                assert_near(root[q] * sqrt(x), 1, 6e-16);
        }
    feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
    const lanes root = reciprocal_root((lanes){0});
    fedisableexcept(FE_ALL_EXCEPT);
    for (int q = 0; q < PD_WIDTH; q++)
        assert_true(isfinite(root[q]));
}

static void instruction_set_is_limited(void **state)
{
    for (int set = 0; set < PD_INSTRUCTION_SETS; set++) {
        pd_instruction_set_limit(set);
        assert_in_range(pd_instruction_set(), 0, set);
    }
    pd_instruction_set_limit(PD_ANY);
    assert_int_equal(pd_instruction_set(), PD_ANY);
    pd_instruction_set_limit(PD_AVX512);
}

int main(void)
{
    const size_t n = list_samples(NULL);
    sample *samples = calloc(n, sizeof *samples);
    test_name *names = calloc(n, sizeof *names);
    struct CMUnitTest tests[n]; /* cmocka takes an array, no pointer */
    list_samples(samples);
    for (size_t k = 0; k < n; k++)
        tests[k] = test_of(&samples[k], names[k]);
    const struct CMUnitTest others[] = {
        cmocka_unit_test(bonds_without_weight_break_too),
        cmocka_unit_test(positions_may_be_rounded),
        cmocka_unit_test(volumes_may_be_rounded),
        cmocka_unit_test(steps_are_those_of_volumes_along_all_axes),
        cmocka_unit_test(rounded_points_are_put_on_the_lattice),
        cmocka_unit_test(sparse_points_are_no_lattice),
        cmocka_unit_test(points_in_one_place_are_no_lattice),
        cmocka_unit_test(horizons_too_far_or_too_near_are_no_lattice),
        cmocka_unit_test(general_path_can_be_asked_for),
        cmocka_unit_test(lattice_may_be_anywhere),
        cmocka_unit_test(reciprocal_root_is_exact_to_an_ulp_or_two),
        cmocka_unit_test(instruction_set_is_limited),
    };
    int failures = cmocka_run_group_tests(others, NULL, NULL);
    failures += cmocka_run_group_tests(tests, NULL, NULL);
    free(samples);
    free(names);
    return failures;
}
