/*
 * Bond-based peridynamics: the library against the slow all-pairs reference, and against
 * what can be worked out by hand.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include <stdio.h>

#include "body.h"
#include "lattice.h"
#include "../reference/reference_bond.h"

#define SPACING 0.05 /* m */

/* Forces are compared relative to E / spacing. Sums over a family of some dozen bonds,
 * differences of positions that are a hundred spacings of 1e-16: as in
 * test_formulations.c, without an inverse that could lose more. */
#define ROUNDING 1e-12

static const double E = 70; /* Pa */

static pd_body_options bond_options(int d, pd_plane plane, double horizon_ratio)
{
    pd_body_options options = {
        .dimension = d,
        .plane = plane,
        .horizon_ratio = horizon_ratio,
        .density = 1.5,
        .formulation = pd_formulation_find("bond"),
        .material = pd_material_find("microelastic"),
        .formulation_parameters = {1},
        .parameters = {E},
    };
    return options;
}

static pd_body_options without_surface_correction(pd_body_options options)
{
    options.formulation_parameters[0] = 0;
    return options;
}

/* ---- samples ---- */

typedef struct {
    int d;
    pd_plane plane;
    bool corrected; /* near surfaces */
    const char *arrangement;

    points cloud;
    unsigned char *held;
    pd_body_options options;
    pd_body *body;
    pd_body_view view;
    bond_reference *reference;
} sample;

static const struct {
    int d;
    pd_plane plane;
    const char *name;
} spaces[] = {{1, PD_PLANE_STRAIN, "1D"},
              {2, PD_PLANE_STRESS, "plane stress"},
              {2, PD_PLANE_STRAIN, "plane strain"},
              {3, PD_PLANE_STRAIN, "3D"}};
enum { SPACES = sizeof spaces / sizeof *spaces };

static const char *const arrangements[] = {"lattice", "general",      "jittered",
                                           "uneven",  "lattice held", "jittered held"};
enum { ARRANGEMENTS = sizeof arrangements / sizeof *arrangements };

static bool is(const sample *s, const char *word)
{
    return strstr(s->arrangement, word);
}

static points arrange(const sample *s)
{
    const int d = s->d;
    if (is(s, "uneven"))
        return d == 1   ? graded(1, 19, 1, 1, SPACING, 1.05)
               : d == 2 ? graded(2, 11, 9, 1, SPACING, 1.08)
                        : graded(3, 7, 6, 5, SPACING, 1.12);
    points cloud = d == 1   ? lattice(1, 21, 1, 1, SPACING)
                   : d == 2 ? lattice(2, 13, 10, 1, SPACING)
                            : lattice(3, 7, 6, 5, SPACING);
    if (is(s, "jittered"))
        jitter(&cloud, 0.25 * SPACING);
    return cloud;
}

/* The left end, three points deep, and in more dimensions a part of the upper side. */
static unsigned char *hold(const points *cloud)
{
    unsigned char *held = calloc(cloud->n, 1);
    for (size_t p = 0; p < cloud->n; p++) {
        const double *X = cloud->X + 3 * p;
        held[p] =
            X[0] < 3 * SPACING || (cloud->d > 1 && X[0] < 5 * SPACING && X[1] > 0.21);
    }
    return held;
}

static void renew_body(sample *s)
{
    pd_body_destroy(s->body);
    s->body = body_with_holds(&s->cloud, &s->options, s->held);
    s->view = pd_body_fields(s->body);
    bond_reference_free(s->reference);
    s->reference = bond_reference_create(s->d, s->cloud.n, s->cloud.X, s->cloud.volume);
    assert_non_null(s->reference);
    s->reference->plane_stress = s->plane == PD_PLANE_STRESS;
    s->reference->horizon_ratio = s->options.horizon_ratio;
    s->reference->E = E;
    s->reference->surface_correction = s->corrected;
    s->reference->critical_stretch = s->options.critical_stretch;
    s->reference->energy_release = s->options.energy_release;
    if (s->held)
        memcpy(s->reference->held, s->held, s->cloud.n);
}

static int make_body(void **state)
{
    sample *s = *state;
    s->cloud = arrange(s);
    s->held = is(s, "held") ? hold(&s->cloud) : NULL;
    s->options = bond_options(s->d, s->plane, s->d == 3 ? 2.015 : 3.015);
    s->options.formulation_parameters[0] = s->corrected;
    s->options.general = is(s, "general");
    s->body = NULL;
    s->reference = NULL;
    renew_body(s);
    return 0;
}

static int free_body(void **state)
{
    sample *s = *state;
    pd_body_destroy(s->body);
    bond_reference_free(s->reference);
    free(s->held);
    points_free(&s->cloud);
    return 0;
}

/* ---- against the reference ---- */

/* Relative to E, or to what bonds bear that are drawn out of a hold. */
static void assert_point_agrees(const sample *s, pd_local p, const double *stress)
{
    const size_t numbers = (size_t)(s->view.n_moving * s->d);
    const double most_force = fmax(E / SPACING, largest(s->view.force, numbers));
    const double most_stress = fmax(E, largest(stress, s->cloud.n * PD_SYMMETRIC));
    const int place[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    const bond_reference *r = s->reference;
    const size_t i = (size_t)s->view.id[p];
    for (int a = 0; a < s->d; a++)
        assert_near(s->view.force[p * s->d + a], r->f[i][a], ROUNDING * most_force);
    for (int k = 0; k < 9; k++)
        assert_near(stress[PD_SYMMETRIC * p + place[k / 3][k % 3]],
                    r->stress[i][k / 3][k % 3], ROUNDING * most_stress);
}

/* Every bond of point p is as intact as that of the reference. */
static void assert_bonds_agree(const sample *s, pd_local p)
{
    const bond_reference *r = s->reference;
    pd_local neighbour[MOST_NEIGHBOURS];
    const pd_local count = pd_body_family(s->body, p, MOST_NEIGHBOURS, neighbour);
    for (pd_local k = 0; k < count; k++) {
        const size_t i = (size_t)s->view.id[p], j = (size_t)s->view.id[neighbour[k]];
        assert_int_equal(pd_body_bond_intact(s->body, p, k), r->lambda[i * r->n + j]);
    }
}

/* Evaluate both where the library's points are, and compare all that they hold. */
static void assert_agreement(const sample *s)
{
    bond_reference *r = s->reference;
    for (pd_local p = 0; p < s->view.n_owned; p++)
        memcpy(r->y[s->view.id[p]], s->view.y + p * s->d, (size_t)s->d * sizeof(double));
    bond_reference_forces(r);
    assert_ok(pd_body_forces(s->body));

    double *damage = malloc(r->n * sizeof *damage);
    double *stress = malloc(r->n * PD_SYMMETRIC * sizeof *stress);
    double volume = 0;
    pd_body_damage(s->body, damage);
    pd_body_stress(s->body, stress, NULL);
    for (pd_local p = 0; p < s->view.n_owned; p++)
        volume += s->view.volume[p];
    for (pd_local p = 0; p < s->view.n_moving; p++)
        assert_point_agrees(s, p, stress);
    for (pd_local p = 0; p < s->view.n_active; p++) {
        assert_bonds_agree(s, p);
        assert_near(damage[p], r->phi[s->view.id[p]], ROUNDING);
    }
    assert_near(pd_body_strain_energy(s->body), r->energy,
                ROUNDING * fmax(E * volume, r->energy));
    free(damage);
    free(stress);
}

static const double wave_amplitude = 0.1 * SPACING; /* strains of 0.1 */

static void whole_body_agrees_with_reference(void **state)
{
    const sample *s = *state;
    assert_agreement(s);
    const affine map = distortion(s->d == 1 ? 3 : s->d);
    body_map(s->body, &map);
    assert_agreement(s);
    body_move(s->body, move_in_waves, &wave_amplitude);
    assert_agreement(s);
}

/* A point's own displacement of up to *context (m), even in all directions. */
static void shake(const double *X, const void *context, double *y)
{
    const double *amplitude = context;
    uint32_t seed = (uint32_t)(X[0] * 7001 + X[1] * 30011 + X[2] * 90001 + 17);
    for (int a = 0; a < 3; a++) {
        next_random(&seed);
        y[a] = X[a] + *amplitude * next_random(&seed);
    }
}

/* Breaks more and more bonds, and goes back part of the way. */
static void shake_apart(const sample *s)
{
    const double amplitudes[] = {0.05, 0.2, 0.3, 0.1, 0.5, 1};
    int64_t broken = 0;
    for (size_t k = 0; k < sizeof amplitudes / sizeof *amplitudes; k++) {
        const double amplitude = amplitudes[k] * SPACING;
        body_move(s->body, shake, &amplitude);
        assert_agreement(s);
        const pd_summary summary = pd_body_summary(s->body);
        assert_true(summary.broken_bonds >= broken);
        assert_true(summary.broken_bonds < summary.bonds);
        broken = summary.broken_bonds;
    }
    assert_true(broken > 3);
}

static void torn_body_agrees_with_reference(void **state)
{
    sample *s = *state;
    s->options.critical_stretch = 1.25;
    renew_body(s);
    shake_apart(s);
}

/* G_c such that bonds break at stretches of about 0.25: E delta s_c^2 up to factors near
 * one. On uneven points s_c differs from bond to bond. */
static void body_of_given_energy_release_agrees_with_reference(void **state)
{
    sample *s = *state;
    if (s->d == 1)
        return;
    s->options.energy_release = 0.04 * E * s->options.horizon_ratio * SPACING;
    renew_body(s);
    shake_apart(s);
}

static void protected_body_agrees_with_reference(void **state)
{
    sample *s = *state;
    s->options.critical_stretch = 1.25;
    renew_body(s);
    for (size_t p = 0; p < s->cloud.n; p++)
        s->reference->safe[p] = p % 5 == 0;
    assert_ok(pd_body_protect(s->body, s->reference->safe));
    shake_apart(s);
    const affine stretch = {{1.5, 0, 0, 0, 1.5, 0, 0, 0, 1.5}, {0}};
    body_map(s->body, &stretch);
    assert_agreement(s);
}

/* Bonds that the library cut, taken over into the reference: weights of the others must
 * be what they were. */
static void precracked_body_agrees_with_reference(void **state)
{
    const sample *s = *state;
    const double x = 0.186;
    const pd_rectangle crack = {
        .corner = {x, -1, -1}, .edge1 = {0, 1.19, 0}, .edge2 = {0, 0, 3}};
    const pd_rectangle point = {.corner = {x}, .edge1 = {0, 1, 0}};
    assert_ok(pd_body_precrack(s->body, s->d == 1 ? &point : &crack));
    bond_reference *r = s->reference;
    for (pd_local p = 0; p < s->view.n_active; p++) {
        pd_local neighbour[MOST_NEIGHBOURS];
        const pd_local count = pd_body_family(s->body, p, MOST_NEIGHBOURS, neighbour);
        for (pd_local k = 0; k < count; k++)
            r->lambda[(size_t)s->view.id[p] * r->n + (size_t)s->view.id[neighbour[k]]] =
                pd_body_bond_intact(s->body, p, k);
    }
    const pd_summary summary = pd_body_summary(s->body);
    assert_true(summary.broken_bonds > 0);
    assert_true(summary.broken_bonds < summary.bonds);
    body_move(s->body, move_in_waves, &wave_amplitude);
    assert_agreement(s);
}

static double energy_at(const sample *s, size_t component, double value)
{
    s->view.y[component] = value;
    assert_ok(pd_body_forces(s->body));
    return pd_body_strain_energy(s->body);
}

/* V f = -dE/dy of moving points by central differences, holds and all; tolerance as in
 * test_formulations.c: third derivatives leave 1e-10, rounding of the energy 1e-11; bonds
 * into a hold are up to six times as stiff. */
static void force_is_minus_the_derivative_of_the_energy(void **state)
{
    const sample *s = *state;
    const double step = 1e-5 * SPACING;
    body_move(s->body, move_in_waves, &wave_amplitude);
    for (pd_local p = 0; p < s->view.n_moving; p += s->d)
        for (int a = 0; a < s->d; a++) {
            const size_t component = (size_t)(p * s->d + a);
            const double y = s->view.y[component];
            const double above = energy_at(s, component, y + step);
            const double below = energy_at(s, component, y - step);
            energy_at(s, component, y);
            assert_near(s->view.force[component],
                        -(above - below) / (2 * step) / s->view.volume[p],
                        1e-8 * E / SPACING);
        }
}

/* ---- frequencies ---- */

/* Accelerations of small displacements u[n_moving][d], which are replaced by them. */
static void apply_stiffness(const sample *s, double *u)
{
    const double small = 1e-6 * SPACING;
    const size_t numbers = (size_t)(s->view.n_moving * s->d);
    for (size_t c = 0; c < numbers; c++)
        s->view.y[c] = s->view.X[c] + small * u[c];
    assert_ok(pd_body_forces(s->body));
    for (size_t c = 0; c < numbers; c++)
        u[c] = -s->view.force[c] / small / s->options.density;
}

/* The highest omega^2 by the power method, from below. */
static double highest_frequency(const sample *s)
{
    const size_t numbers = (size_t)(s->view.n_moving * s->d);
    double *u = malloc(numbers * sizeof *u), omega2 = 0;
    uint32_t seed = 3;
    for (size_t c = 0; c < numbers; c++)
        u[c] = next_random(&seed);
    for (int k = 0; k < 150; k++) {
        const double before = largest(u, numbers);
        for (size_t c = 0; c < numbers; c++)
            u[c] /= before;
        apply_stiffness(s, u);
        omega2 = largest(u, numbers);
    }
    free(u);
    return omega2;
}

/* The bound takes all bonds of a point along one line and all neighbours in opposite
 * phase. In one dimension that comes near the truth; in three, where a third of the
 * stiffness acts along each axis, it is about twice too high, in omega. */
static void stable_step_is_below_that_of_the_highest_frequency(void **state)
{
    const sample *s = *state;
    const double omega = sqrt(highest_frequency(s));
    const double step = pd_body_stable_step(s->body);
    assert_true(step <= 2 / omega * (1 + 1e-6));
    assert_true(step >= 2 / omega / 2.5);
}

/* ---- all checks of all samples ---- */

typedef struct {
    const char *name;
    CMUnitTestFunction run;
} check;

static const check checks[] = {
    {"whole body agrees with reference", whole_body_agrees_with_reference},
    {"torn body agrees with reference", torn_body_agrees_with_reference},
    {"body of given energy release agrees with reference",
     body_of_given_energy_release_agrees_with_reference},
    {"protected body agrees with reference", protected_body_agrees_with_reference},
    {"precracked body agrees with reference", precracked_body_agrees_with_reference},
    {"force is minus the derivative of the energy",
     force_is_minus_the_derivative_of_the_energy},
    {"stable step is below that of the highest frequency",
     stable_step_is_below_that_of_the_highest_frequency},
};
enum { CHECKS = sizeof checks / sizeof *checks, SAMPLES = SPACES * ARRANGEMENTS * 2 };

typedef char test_name[160];

static void list_tests(sample *samples, struct CMUnitTest *tests, test_name *names)
{
    for (int k = 0; k < SAMPLES; k++) {
        const int space = k % SPACES;
        samples[k] = (sample){.d = spaces[space].d,
                              .plane = spaces[space].plane,
                              .corrected = k / SPACES % 2,
                              .arrangement = arrangements[k / SPACES / 2]};
        for (int c = 0; c < CHECKS; c++) {
            const int n = k * CHECKS + c;
            snprintf(names[n], sizeof *names, "%s, %s%s: %s", spaces[space].name,
                     samples[k].arrangement, samples[k].corrected ? ", corrected" : "",
                     checks[c].name);
            tests[n] = (struct CMUnitTest){names[n], checks[c].run, make_body, free_body,
                                           &samples[k]};
        }
    }
}

/* ---- by hand: one bond ---- */

/* Two points a spacing apart along the first axis, one bond of length h inside a horizon
 * of 3 h, so that its volume counts whole. */
static pd_body *two_points(pd_body_options options, double h)
{
    options.horizon_ratio = 3;
    options = without_surface_correction(options);
    points cloud = lattice(options.dimension, 2, 1, 1, h);
    pd_body *body = body_of(&cloud, &options);
    points_free(&cloud);
    return body;
}

/* f = c s V with E = 70, h = 0.1, delta = 0.3, s = 0.5:
 * 1D            c = 2 70 / 0.09            =   1555.5556   V = 0.1
 * plane stress  c = 9 70 / (pi 0.027)      =   7427.2306   V = 0.01
 * plane strain  c = 48 70 / (5 pi 0.027)   =   7922.3793   V = 0.01
 * 3D            c = 12 70 / (pi 0.0081)    =  33009.914    V = 0.001 */
static void micromoduli_are_those_of_the_paper(void **state)
{
    const double c[SPACES] = {1555.5556, 7427.2306, 7922.3793, 33009.914};
    const double V[SPACES] = {0.1, 0.01, 0.01, 0.001};
    for (int k = 0; k < SPACES; k++) {
        const pd_body_options options = bond_options(spaces[k].d, spaces[k].plane, 0);
        pd_body *body = two_points(options, 0.1);
        const pd_body_view view = pd_body_fields(body);
        view.y[spaces[k].d] += 0.05;
        assert_ok(pd_body_forces(body));
        assert_near(view.force[0], c[k] * 0.5 * V[k], 1e-7 * c[k] * V[k]);
        assert_near(view.force[spaces[k].d], -c[k] * 0.5 * V[k], 1e-7 * c[k] * V[k]);
        /* c s^2 |xi| / 2, times both volumes */
        assert_near(pd_body_strain_energy(body), c[k] * 0.25 * 0.1 / 2 * V[k] * V[k],
                    1e-8 * c[k] * V[k] * V[k]);
        pd_body_destroy(body);
    }
}

/* [han2025] eq. 18 for E = 192 GPa, G_c = 1 kJ/m2, delta = 0.3 mm:
 * plane stress  k = E / (2 (1 - nu)) = 144 GPa,   s_c^2 = pi 1e3 / (3 k delta)
 * = 2.424068e-5 plane strain  k = E / (2 (1 + nu)(1 - 2 nu)) = 153.6 GPa = 2.272564e-5 3D
 * k = E / (3 (1 - 2 nu)) = 128 GPa, s_c^2 = 5e3 / (9 k delta)    = 1.446759e-5
 */
static void critical_stretch_follows_from_the_energy_release_rate(void **state)
{
    const double square[SPACES] = {0, 2.424068e-5, 2.272564e-5, 1.446759e-5};
    for (int k = 1; k < SPACES; k++) {
        pd_body_options options = bond_options(spaces[k].d, spaces[k].plane, 0);
        options.parameters[0] = 192e9;
        options.energy_release = 1e3;
        pd_body *body = two_points(options, 1e-4);
        const double s_c = pd_body_critical_stretch(body, 0, 1) - 1;
        assert_near(s_c * s_c, square[k], 1e-6 * square[k]);
        pd_body_destroy(body);
    }
}

/* Plane stress, E = 192 GPa: the plate of [madenci2014] whose s_c = 0.04472 has
 * G_c = 3 k delta s_c^2 / pi with k = 144 GPa, delta = 3.015e-4 m: 82.91 kJ/m2. */
static void critical_stretch_of_a_plate(void **state)
{
    pd_body_options options = bond_options(2, PD_PLANE_STRESS, 3.015);
    options.parameters[0] = 192e9;
    options.energy_release = 82.914e3;
    points cloud = lattice(2, 4, 4, 1, 1e-4);
    pd_body *body = body_of(&cloud, &options);
    assert_near(pd_body_critical_stretch(body, 0, 1), 1.04472, 1e-6);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* Two points of mass rho V leave each other at +-v. The bond's energy c s^2 h V^2 / 2
 * reaches its limit at s_c when rho V v^2 = c s_c^2 h V^2 / 2. Along a line the bond is a
 * linear spring of omega^2 = 2 c V / (h rho); Verlet with steps of 0.01 / omega shifts
 * energy and sampled peak by 1e-5 of themselves. */
static bool breaks_at_speed(pd_body_options options, double share_of_critical)
{
    const double h = 0.1, s_c = 0.2;
    options.critical_stretch = 1 + s_c;
    options.damping = 0;
    pd_body *body = two_points(options, h);
    const pd_body_view view = pd_body_fields(body);
    const double V = view.volume[0];

    view.y[options.dimension] += h / 100;
    assert_ok(pd_body_forces(body));
    const double c = view.force[0] / (0.01 * V);
    view.y[options.dimension] -= h / 100;
    assert_ok(pd_body_forces(body));

    const double v = share_of_critical * sqrt(c * V * h / (2 * options.density)) * s_c;
    const double omega = sqrt(2 * c * V / (h * options.density));
    view.v[0] = -v, view.v[options.dimension] = v;
    for (int step = 0; step < 700; step++) /* a period and some */
        assert_ok(
            pd_body_step(body, pd_integrator_find("velocityVerlet"), 0.01 / omega, NULL));
    const bool broken = pd_body_summary(body).broken_bonds == 1;
    assert_int_equal(pd_body_bond_intact(body, 0, 0), !broken);
    assert_int_equal(pd_body_bond_intact(body, 1, 0), !broken);
    assert_int_equal(view.y[options.dimension] - view.y[0] > (1 + s_c) * h, broken);
    pd_body_destroy(body);
    return broken;
}

static void bond_breaks_when_kinetic_energy_exceeds_its_own(void **state)
{
    for (int k = 0; k < SPACES; k++)
        for (int general = 0; general < 2; general++) {
            pd_body_options options = bond_options(spaces[k].d, spaces[k].plane, 0);
            options.general = general;
            assert_false(breaks_at_speed(options, 0.9999));
            assert_true(breaks_at_speed(options, 1.0001));
        }
}

/* ---- by hand: uniform strains of a plate, plane stress ---- */

/* A plate of 33 x 33 points under strains ex, ey, with stresses of its points. */
typedef struct {
    points cloud;
    pd_body *body;
    double *stress;
} plate;

static plate strained_plate(const pd_body_options *options, double ex, double ey)
{
    plate p = {.cloud = lattice(2, 33, 33, 1, SPACING)};
    p.body = body_of(&p.cloud, options);
    p.stress = malloc(p.cloud.n * PD_SYMMETRIC * sizeof *p.stress);
    const affine map = {{1 + ex, 0, 0, 0, 1 + ey, 0, 0, 0, 1}, {0}};
    body_map(p.body, &map);
    assert_ok(pd_body_forces(p.body));
    pd_body_stress(p.body, p.stress, NULL);
    return p;
}

static void plate_free(plate *p)
{
    pd_body_destroy(p->body);
    points_free(&p->cloud);
    free(p->stress);
}

/* Energy densities of the point in column x, row y, from the virial: (1/2) sum a s n.n
 * |xi| at small strains. Isotropic: s = z for every bond, the virial's trace is (1/2) sum
 * a z (1 + z) |xi| and W = (1/4) sum a z^2 |xi|. */
static double isotropic_energy(const plate *p, int x, int y, double z)
{
    const pd_local at = place_of(p->body, x * 33 + y);
    const double *s = p->stress + PD_SYMMETRIC * at;
    return (s[0] + s[1]) * z / (2 * (1 + z));
}

/* Uniaxial, up to a factor 1 + O(e). */
static double uniaxial_energy(const plate *p, int x, int y, double e)
{
    return p->stress[PD_SYMMETRIC * place_of(p->body, x * 33 + y)] * e / 2;
}

static const double strain = 1e-6;

/* The correction is made so that the energy of uniaxial strain is the material's,
 * E e^2 / (2 (1 - nu^2)) = 9/16 E e^2; what is left is s = |Y|/|xi| - 1, which is e n^2
 * but for terms of e^2: 1e-6 of the energy. Inside, whatever the horizon. */
static void uniaxial_energy_inside_a_plate_is_exact(void **state)
{
    const double ratios[] = {1.015, 2.2, 3.015, 5.5};
    for (int k = 0; k < 4; k++) {
        const pd_body_options options = bond_options(2, PD_PLANE_STRESS, ratios[k]);
        plate p = strained_plate(&options, strain, 0);
        const double exact = 9. / 16 * E * strain * strain;
        assert_near(uniaxial_energy(&p, 16, 16, strain), exact, 5e-6 * exact);
        plate_free(&p);
    }
}

/* Total energy is the sum of those of points. */
static void isotropic_energies_add_up(void **state)
{
    const pd_body_options options = bond_options(2, PD_PLANE_STRESS, 3.015);
    plate p = strained_plate(&options, 0.1, 0.1);
    double sum = 0;
    for (int k = 0; k < 33 * 33; k++)
        sum += p.cloud.volume[k] * isotropic_energy(&p, k / 33, k % 33, 0.1);
    assert_near(pd_body_strain_energy(p.body), sum, ROUNDING * sum);
    plate_free(&p);
}

/* The factor of a bond is the mean of both ends', so that the last points of a side get
 * about half of what they lack, those behind them too much: of three rows in a horizon
 * the outermost lacks 57 % (68 % at a corner), with the correction 26 %, and the third
 * has up to 21 % too much. Along a side that the strain follows 1 % is left. */
static void uniaxial_energy_near_surfaces_is_corrected(void **state)
{
    const pd_body_options corrected = bond_options(2, PD_PLANE_STRESS, 3.015);
    const pd_body_options plain = without_surface_correction(corrected);
    const double exact = 9. / 16 * E * strain * strain;
    plate with = strained_plate(&corrected, strain, 0);
    plate without = strained_plate(&plain, strain, 0);
    for (int k = 0; k < 33 * 33; k++)
        assert_near(uniaxial_energy(&with, k / 33, k % 33, strain), exact, 0.26 * exact);
    assert_near(uniaxial_energy(&with, 16, 0, strain), exact, 0.01 * exact);
    assert_near(uniaxial_energy(&without, 16, 16, strain), 0.861 * exact, 1e-3 * exact);
    assert_near(uniaxial_energy(&without, 0, 16, strain), 0.430 * exact, 1e-3 * exact);
    assert_near(uniaxial_energy(&without, 0, 0, strain), 0.321 * exact, 1e-3 * exact);
    plate_free(&with);
    plate_free(&without);
}

static double isotropic_error(double ratio)
{
    const pd_body_options options = bond_options(2, PD_PLANE_STRESS, ratio);
    plate p = strained_plate(&options, strain, strain);
    const double exact = E * strain * strain * 1.5; /* E z^2 / (1 - nu), nu = 1/3 */
    const double W = isotropic_energy(&p, 16, 16, strain);
    plate_free(&p);
    return W / exact - 1;
}

/* By how much sum |xi| beta exceeds 8/3 of sum |xi| n_x^4 beta, what both are for a disk.
 */
static double quadrature_error(double ratio)
{
    double all = 0, along = 0;
    for (int x = -9; x <= 9; x++)
        for (int y = -9; y <= 9; y++) {
            const double length = sqrt(x * x + y * y);
            if (length == 0 || length > ratio)
                continue;
            const double beta = fmin(1, ratio - length + 0.5);
            all += beta * length;
            along += beta * length * pow(x / length, 4);
        }
    return all / along * 3 / 8 - 1;
}

/* The correction fits one sum over the family, sum a |xi| n_x^4; isotropic strain takes
 * another, sum a |xi|, 8/3 times as large only where all directions are alike. A lattice
 * misses that by up to 1.5 % at these horizons. */
static void isotropic_energy_inside_a_plate_is_as_good_as_the_quadrature(void **state)
{
    const double ratios[] = {3.015, 5.015, 8.015};
    for (int k = 0; k < 3; k++) {
        assert_near(isotropic_error(ratios[k]), quadrature_error(ratios[k]), 1e-5);
        assert_near(isotropic_error(ratios[k]), 0, 0.016);
    }
}

/* ---- by hand: the rest ---- */

static void family_of_three_spacings_has_122_bonds(void **state)
{
    for (int general = 0; general < 2; general++) {
        pd_body_options options = bond_options(3, PD_PLANE_STRAIN, 3.0002);
        options.general = general;
        points cloud = lattice(3, 7, 7, 7, SPACING);
        pd_body *body = body_of(&cloud, &options);
        assert_int_equal(2 * 249856 / 4096, 122);
        assert_int_equal(
            pd_body_family(body, place_of(body, 3 * 49 + 3 * 7 + 3), 0, NULL), 122);
        pd_body_destroy(body);
        points_free(&cloud);
    }
}

/* Two points in one place have no bond of any direction. */
static void points_in_one_place_are_refused(void **state)
{
    for (int k = 0; k < SPACES; k++)
        for (int corrected = 0; corrected < 2; corrected++) {
            pd_body_options options = bond_options(spaces[k].d, spaces[k].plane, 2.015);
            options.formulation_parameters[0] = corrected;
            const int d = spaces[k].d;
            points cloud = lattice(d, 6, d > 1 ? 5 : 1, d > 2 ? 4 : 1, SPACING);
            memcpy(cloud.X, cloud.X + 3, 3 * sizeof *cloud.X);
            pd_body *body;
            const pd_status status =
                pd_body_create(MPI_COMM_NULL, &options, cloud.n, cloud.X, cloud.volume,
                               NULL, NULL, &body);
            assert_int_equal(status.code, PD_BAD_ARGUMENT);
            assert_in_range(status.point, 0, 1);
            assert_null(body);
            points_free(&cloud);
        }
}

/* A hump u of a bar at rest, far from its ends, spreads so that with a = c^2 u''
 *
 *     sum x^2 u / sum u  =  what it was + c^2 t^2
 *
 * and so it is step by step with Verlet, and with bonds whose energy of uniform strain is
 * exact. Strains of 1e-7 leave s linear to as much; u of 1e-7 spacings at positions of
 * 200 spacings has seven digits, and many points. */
static void waves_of_a_bar_have_its_speed(void **state)
{
    const int n = 400, middle = 200;
    points cloud = lattice(1, n, 1, 1, SPACING);
    const pd_body_options options = bond_options(1, PD_PLANE_STRAIN, 3.015);
    pd_body *body = body_of(&cloud, &options);
    const pd_body_view view = pd_body_fields(body);
    assert_near(pd_body_wave_speed(body), sqrt(E / 1.5), 1e-12 * sqrt(E / 1.5));
    double before = 0, after = 0, sum = 0;
    for (pd_local p = 0; p < n; p++) {
        const double x = view.X[p] - view.X[middle];
        const double u = 1e-6 * SPACING * exp(-pow(x / (10 * SPACING), 2));
        view.y[p] += u;
        sum += u, before += x * x * u;
    }
    assert_ok(pd_body_forces(body));
    const double dt = 0.5 * pd_body_stable_step(body);
    int steps = (int)(100 * SPACING / sqrt(E / 1.5) / dt);
    for (int k = 0; k < steps; k++)
        assert_ok(pd_body_step(body, pd_integrator_find("velocityVerlet"), dt, NULL));
    for (pd_local p = 0; p < n; p++)
        after += pow(view.X[p] - view.X[middle], 2) * (view.y[p] - view.X[p]);
    const double c = sqrt((after - before) / sum) / (steps * dt);
    assert_near(c, sqrt(E / 1.5), 1e-5 * sqrt(E / 1.5));
    pd_body_destroy(body);
    points_free(&cloud);
}

/* Chunks that are not whole. */
static int64_t owners(const pd_body *body)
{
    const pd_lattice *l = body->lattice;
    int64_t n = 0;
    for (int64_t m = 0; m < l->regular.first[l->planes]; m++)
        n += !chunk_is_whole(&l->regular.chunk[m]);
    return n;
}

/* 40 x 40 points, five chunks a row. Corrected families differ within twice the reach of
 * 3 from a side: of rows 6 to 33 the middle three chunks, 8 to 31, are alike. */
static void intact_body_stores_no_bonds(void **state)
{
    points cloud = lattice(2, 40, 40, 1, SPACING);
    pd_body_options options = bond_options(2, PD_PLANE_STRESS, 3.015);
    pd_body *body = body_of(&cloud, &options);
    const affine map = distortion(2);
    body_map(body, &map);
    assert_ok(pd_body_forces(body));
    assert_null(body->broken);
    assert_null(body->lattice->broken);
    assert_int_equal(body->families.first[body->families.n], 0);
    assert_int_equal(owners(body), 200 - 28 * 3);
    const pd_rectangle crack = {.corner = {1, 1.01}, .edge1 = {0.09, 0}};
    assert_ok(pd_body_precrack(body, &crack));
    assert_non_null(body->lattice->broken);
    assert_true(owners(body) > 200 - 28 * 3);
    pd_body_destroy(body);
    points_free(&cloud);
}

int main(void)
{
    static sample samples[SAMPLES];
    static struct CMUnitTest tests[SAMPLES * CHECKS];
    static test_name names[SAMPLES * CHECKS];
    list_tests(samples, tests, names);
    const struct CMUnitTest by_hand[] = {
        cmocka_unit_test(micromoduli_are_those_of_the_paper),
        cmocka_unit_test(critical_stretch_follows_from_the_energy_release_rate),
        cmocka_unit_test(critical_stretch_of_a_plate),
        cmocka_unit_test(bond_breaks_when_kinetic_energy_exceeds_its_own),
        cmocka_unit_test(uniaxial_energy_inside_a_plate_is_exact),
        cmocka_unit_test(isotropic_energy_inside_a_plate_is_as_good_as_the_quadrature),
        cmocka_unit_test(isotropic_energies_add_up),
        cmocka_unit_test(uniaxial_energy_near_surfaces_is_corrected),
        cmocka_unit_test(points_in_one_place_are_refused),
        cmocka_unit_test(waves_of_a_bar_have_its_speed),
        cmocka_unit_test(intact_body_stores_no_bonds),
        cmocka_unit_test(family_of_three_spacings_has_122_bonds),
    };
    const int failures = cmocka_run_group_tests(tests, NULL, NULL);
    return failures + cmocka_run_group_tests(by_hand, NULL, NULL);
}
