/*
 * What every formulation must keep, whatever the material, dimension and arrangement of
 * points; and the library against the slow all-pairs reference.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include <stdio.h>

#include "lattice.h"
#include "../reference/reference_correspondence.h"

#define SPACING 0.05 /* m */

/* Forces are compared relative to modulus / spacing, gradients relative to 1. Sums over a
 * family of some dozen bonds lose about 1e-14; positions of 1 m a hundred spacings of
 * 1e-16 m each; families at corners lose a factor of ten more in K^-1. */
#define ROUNDING 1e-12

/* ---- samples ---- */

typedef struct {
    const pd_formulation *formulation;
    const pd_material *material;
    int d;
    const char *arrangement;

    points cloud;
    pd_body_options options;
    pd_body *body;
    pd_body_view view;
    double force_scale; /* modulus / spacing, N/m3 */
} sample;

static const char *const arrangements[] = {"lattice", "jittered", "uneven"};
enum { ARRANGEMENTS = sizeof arrangements / sizeof *arrangements };

static points arrange(int d, const char *arrangement)
{
    if (strcmp(arrangement, "uneven") == 0)
        return d == 2 ? graded(2, 11, 9, 1, SPACING, 1.08)
                      : graded(3, 7, 6, 5, SPACING, 1.12);
    points cloud = d == 2 ? lattice(2, 12, 10, 1, SPACING) : lattice(3, 7, 6, 5, SPACING);
    if (strcmp(arrangement, "jittered") == 0)
        jitter(&cloud, 0.25 * SPACING);
    return cloud;
}

static int make_body(void **state)
{
    sample *s = *state;
    s->cloud = arrange(s->d, s->arrangement);
    s->options = options_of(s->d, s->d == 2 ? 3.015 : 2.015);
    s->options.formulation = s->formulation;
    for (int k = 0; k < s->formulation->n_parameters; k++) {
        const pd_parameter *p = &s->formulation->parameters[k];
        s->options.formulation_parameters[k] = p->optional ? p->standard : some_value(p);
    }
    s->options.material = s->material;
    for (int k = 0; k < s->material->n_parameters; k++)
        s->options.parameters[k] = some_value(&s->material->parameters[k]);
    for (int k = 0; k < s->formulation->n_parameters; k++)
        s->options.formulation_parameters[k] = s->formulation->parameters[k].standard;
    s->body = body_of(&s->cloud, &s->options);
    s->view = pd_body_fields(s->body);
    const double c = pd_body_wave_speed(s->body);
    s->force_scale = s->options.density * c * c / SPACING;
    return 0;
}

static int free_body(void **state)
{
    sample *s = *state;
    pd_body_destroy(s->body);
    points_free(&s->cloud);
    return 0;
}

/* Moments of second order, which rate forms invert, are worse conditioned at corners than
 * K by another factor of ten or so. */
static void assert_no_force(const sample *s)
{
    const size_t numbers = (size_t)s->view.n_owned * (size_t)s->d;
    const double rounding = pd_body_has_history(s->body) ? 20 * ROUNDING : ROUNDING;
    assert_near(largest(s->view.force, numbers), 0, rounding * s->force_scale);
}

static double sum_of_volumes(const sample *s)
{
    double sum = 0;
    for (size_t p = 0; p < s->cloud.n; p++)
        sum += s->cloud.volume[p];
    return sum;
}

/* ---- no deformation ---- */

static void rest_is_free_of_force(void **state)
{
    const sample *s = *state;
    assert_ok(pd_body_forces(s->body));
    assert_no_force(s);
}

static void translation_is_free_of_force(void **state)
{
    const sample *s = *state;
    affine map = *at_rest();
    map.b[0] = 1.7, map.b[1] = -0.6, map.b[2] = 0.9;
    body_map(s->body, &map);
    assert_ok(pd_body_forces(s->body));
    assert_no_force(s);
}

static void rotation_is_free_of_force_and_volume_change(void **state)
{
    const sample *s = *state;
    const affine map = rotation(s->d, 2.1);
    body_map(s->body, &map);
    assert_ok(pd_body_forces(s->body));
    assert_no_force(s);
    for (pd_local p = 0; p < s->view.n_owned; p++)
        assert_near(s->view.J[p], 1, ROUNDING);
}

static bool has_energy(const sample *s)
{
    return s->formulation->energy;
}

static void rotation_costs_no_energy(void **state)
{
    const sample *s = *state;
    const affine map = rotation(s->d, 2.1);
    body_map(s->body, &map);
    assert_ok(pd_body_forces(s->body));
    assert_near(pd_body_strain_energy(s->body), 0,
                ROUNDING * s->force_scale * SPACING * sum_of_volumes(s));
}

/* ---- affine maps ---- */

static bool corresponds(const sample *s)
{
    return s->formulation->corresponds;
}

static void gradient_of_affine_map_is_exact_everywhere(void **state)
{
    const sample *s = *state;
    const affine map = distortion(s->d);
    body_map(s->body, &map);
    assert_ok(pd_body_forces(s->body));
    for (pd_local p = 0; p < s->view.n_owned; p++) {
        for (int r = 0; r < s->d; r++)
            for (int c = 0; c < s->d; c++)
                assert_near(s->view.F[(p * s->d + r) * s->d + c], map.A[3 * r + c],
                            ROUNDING);
        assert_near(s->view.J[p], determinant3(map.A), ROUNDING);
    }
}

static void energy_of_affine_map_is_density_times_volume(void **state)
{
    const sample *s = *state;
    const affine map = distortion(s->d);
    body_map(s->body, &map);
    assert_ok(pd_body_forces(s->body));
    double F[9];
    for (int c = 0; c < s->d * s->d; c++)
        F[c] = map.A[3 * (c / s->d) + c % s->d];
    const double expected =
        sum_of_volumes(s) * s->material->energy[PD_PLANE_STRAIN](
                                s->options.parameters, s->d, F, determinant3(map.A));
    assert_near(pd_body_strain_energy(s->body), expected, ROUNDING * expected);
}

static bool is_lattice(const sample *s)
{
    return strcmp(s->arrangement, "lattice") == 0;
}

/* The middle of a lattice of 2 (4 reach) + 1 points: all its family's families are whole,
 * and uniform stress has no divergence. */
static void interior_of_affine_map_is_balanced(void **state)
{
    const sample *s = *state;
    const int side = s->d == 2 ? 13 : 9; /* horizons reach three and two spacings */
    points cloud = lattice(s->d, side, side, side, SPACING);
    pd_body *body = body_of(&cloud, &s->options);
    const affine map = distortion(s->d);
    body_map(body, &map);
    assert_ok(pd_body_forces(body));
    const pd_local middle = place_of(body, (pd_global)(cloud.n / 2));
    assert_near(largest(pd_body_fields(body).force + middle * s->d, (size_t)s->d), 0,
                ROUNDING * s->force_scale);
    pd_body_destroy(body);
    points_free(&cloud);
}

/* ---- balances ---- */

static const double wave_amplitude = 0.1 * SPACING; /* strains of 0.1, all J > 0.5 */

static void assert_deformed(const sample *s)
{
    const size_t numbers = (size_t)s->view.n_owned * (size_t)s->d;
    assert_true(largest(s->view.force, numbers) > 1e-3 * s->force_scale);
}

static void forces_sum_to_nothing(void **state)
{
    const sample *s = *state;
    body_move(s->body, move_in_waves, &wave_amplitude);
    assert_ok(pd_body_forces(s->body));
    assert_deformed(s);
    for (int a = 0; a < s->d; a++) {
        double sum = 0;
        for (pd_local p = 0; p < s->view.n_owned; p++)
            sum += s->view.volume[p] * s->view.force[p * s->d + a];
        assert_near(sum, 0, ROUNDING * s->force_scale * sum_of_volumes(s));
    }
}

static double couple(const sample *s, int a, int b)
{
    double sum = 0;
    for (pd_local p = 0; p < s->view.n_owned; p++) {
        const double *y = s->view.y + p * s->d, *f = s->view.force + p * s->d;
        sum += s->view.volume[p] * (y[a] * f[b] - y[b] * f[a]);
    }
    return sum;
}

/* Arms are no longer than 1 m. */
static void couples_sum_to_nothing(void **state)
{
    const sample *s = *state;
    body_move(s->body, move_in_waves, &wave_amplitude);
    assert_ok(pd_body_forces(s->body));
    assert_deformed(s);
    for (int a = 0; a < s->d; a++)
        assert_near(couple(s, a, (a + 1) % s->d), 0,
                    ROUNDING * s->force_scale * sum_of_volumes(s));
}

static double energy_at(const sample *s, size_t component, double value)
{
    s->view.y[component] = value;
    assert_ok(pd_body_forces(s->body));
    return pd_body_strain_energy(s->body);
}

/* V f = -dE/dy by central differences. With a step of 1e-5 spacings the third derivative
 * leaves 1e-10 of the force scale; rounding leaves the energy, at strains of 0.1 about
 * 1e-2 moduli times the volume of n points, 1e-16 times itself over the step: n 1e-13.
 * 1e-8 of the force scale covers both for any n below 1e4. */
static void force_is_minus_the_derivative_of_the_energy(void **state)
{
    const sample *s = *state;
    const double step = 1e-5 * SPACING;
    body_move(s->body, move_in_waves, &wave_amplitude);
    for (pd_local k = 0; k < 14; k++) { /* both ends of the order are corners */
        const pd_local p = (pd_local)((int64_t)k * (s->view.n_owned - 1) / 13);
        for (int a = 0; a < s->d; a++) {
            const size_t component = (size_t)(p * s->d + a);
            const double y = s->view.y[component];
            const double above = energy_at(s, component, y + step);
            const double below = energy_at(s, component, y - step);
            energy_at(s, component, y);
            assert_near(s->view.force[component],
                        -(above - below) / (2 * step) / s->view.volume[p],
                        1e-8 * s->force_scale);
        }
    }
}

static void mirrored_waves(const double *X, const void *context, double *y)
{
    const double mirrored[3] = {-X[0], X[1], X[2]};
    move_in_waves(mirrored, context, y);
    y[0] = -y[0];
}

static void mirror_image_has_mirrored_forces(void **state)
{
    const sample *s = *state;
    body_move(s->body, move_in_waves, &wave_amplitude);
    assert_ok(pd_body_forces(s->body));

    points image = arrange(s->d, s->arrangement);
    for (size_t p = 0; p < image.n; p++)
        image.X[3 * p] = -image.X[3 * p];
    pd_body *mirrored = body_of(&image, &s->options);
    body_move(mirrored, mirrored_waves, &wave_amplitude);
    assert_ok(pd_body_forces(mirrored));

    pd_local *local = places_of(mirrored);
    const double *force = pd_body_fields(mirrored).force;
    for (pd_local p = 0; p < s->view.n_owned; p++)
        for (int a = 0; a < s->d; a++)
            assert_near(force[local[s->view.id[p]] * s->d + a],
                        (a == 0 ? -1 : 1) * s->view.force[p * s->d + a],
                        ROUNDING * s->force_scale);
    free(local);
    pd_body_destroy(mirrored);
    points_free(&image);
}

/* ---- against the reference ---- */

static bool has_reference(const sample *s)
{
    return strcmp(s->formulation->name, "correspondence") == 0 &&
           strcmp(s->material->name, "neoHookean") == 0;
}

static reference_body *reference_of(const sample *s)
{
    reference_body *reference =
        reference_create(s->d, s->cloud.n, s->cloud.X, s->cloud.volume);
    assert_non_null(reference);
    reference->horizon_ratio = s->options.horizon_ratio;
    reference->critical_stretch = s->options.critical_stretch;
    reference->G = s->options.parameters[0];
    reference->nu_stab = s->options.parameters[1];
    reference->smallest_shape = PD_SINGULAR_SHAPE;
    reference->smallest_J = PD_SMALLEST_J;
    return reference;
}

static void assert_point_agrees(const sample *s, pd_local p,
                                const reference_body *reference, double tolerance)
{
    const int d = s->d;
    const size_t i = (size_t)s->view.id[p];
    for (int r = 0; r < d; r++) {
        assert_near(s->view.force[p * d + r], reference->f[i][r],
                    tolerance * s->force_scale);
        for (int c = 0; c < d; c++)
            assert_near(s->view.F[(p * d + r) * d + c], reference->F[i][r][c], tolerance);
    }
    assert_near(s->view.J[p], reference->J[i], tolerance);
}

/* Evaluate both where the library's points are, and compare all that they hold. */
static void assert_agreement(const sample *s, reference_body *reference, double tolerance)
{
    for (pd_local p = 0; p < s->view.n_owned; p++)
        memcpy(reference->y[s->view.id[p]], s->view.y + p * s->d,
               (size_t)s->d * sizeof(double));
    reference_forces(reference);
    assert_ok(pd_body_forces(s->body));

    double *damage = malloc(s->cloud.n * sizeof *damage);
    pd_body_damage(s->body, damage);
    for (pd_local p = 0; p < s->view.n_owned; p++) {
        assert_point_agrees(s, p, reference, tolerance);
        assert_near(damage[p], reference->phi[s->view.id[p]], ROUNDING);
    }
    free(damage);
    const pd_summary summary = pd_body_summary(s->body);
    assert_int_equal(summary.singular, reference->singular);
    assert_int_equal(summary.inverted, reference->inverted);
}

static void whole_body_agrees_with_reference(void **state)
{
    const sample *s = *state;
    reference_body *reference = reference_of(s);
    const affine map = distortion(s->d);
    body_map(s->body, &map);
    assert_agreement(s, reference, ROUNDING);
    body_move(s->body, move_in_waves, &wave_amplitude);
    assert_agreement(s, reference, ROUNDING);
    reference_free(reference);
}

/* Opened across an oblique plane through the middle, and waved: *context is the opening,
 * m. */
static void tear(const double *X, const void *context, double *y)
{
    const double opening = *(const double *)context;
    const double waves = 0.1 * opening;
    const double across = X[0] - 0.31 + 0.2 * (X[1] - 0.25) + 0.1 * X[2];
    move_in_waves(X, &waves, y);
    y[0] += opening * tanh(3 * across / SPACING) * (1 + X[1]);
    y[1] += 0.4 * opening * tanh(2 * across / SPACING);
}

/* Opens step by step, closes part of the way; bonds that stay intact at points that lost
 * almost all have K near singular, down to 1e-6, which costs as many digits. */
static void torn_body_agrees_with_reference(void **state)
{
    sample *s = *state;
    pd_body_destroy(s->body);
    s->options.critical_stretch = 1.4;
    for (int k = 0; k < s->formulation->n_parameters; k++)
        s->options.formulation_parameters[k] = s->formulation->parameters[k].standard;
    s->body = body_of(&s->cloud, &s->options);
    s->view = pd_body_fields(s->body);
    reference_body *reference = reference_of(s);

    const double openings[] = {0.1, 0.4, 0.8, 1.4, 0.5, 2.5};
    int64_t broken = 0;
    for (size_t k = 0; k < sizeof openings / sizeof *openings; k++) {
        const double opening = openings[k] * SPACING;
        body_move(s->body, tear, &opening);
        assert_agreement(s, reference, 1e-8);
        const pd_summary summary = pd_body_summary(s->body);
        assert_true(summary.broken_bonds >= broken &&
                    summary.broken_bonds < summary.bonds);
        broken = summary.broken_bonds;
    }
    assert_true(broken > 0);
    reference_free(reference);
}

/* ---- all checks of all samples ---- */

typedef struct {
    const char *name;
    CMUnitTestFunction run;
    bool (*applies)(const sample *); /* NULL: to all */
} check;

static const check checks[] = {
    {"rest is free of force", rest_is_free_of_force, NULL},
    {"translation is free of force", translation_is_free_of_force, NULL},
    {"rotation is free of force and volume change",
     rotation_is_free_of_force_and_volume_change, NULL},
    {"rotation costs no energy", rotation_costs_no_energy, has_energy},
    {"gradient of affine map is exact everywhere",
     gradient_of_affine_map_is_exact_everywhere, corresponds},
    {"energy of affine map is density times volume",
     energy_of_affine_map_is_density_times_volume, corresponds},
    {"interior of affine map is balanced", interior_of_affine_map_is_balanced,
     is_lattice},
    {"forces sum to nothing", forces_sum_to_nothing, NULL},
    {"couples sum to nothing", couples_sum_to_nothing, NULL},
    {"force is minus the derivative of the energy",
     force_is_minus_the_derivative_of_the_energy, has_energy},
    {"mirror image has mirrored forces", mirror_image_has_mirrored_forces, NULL},
    {"whole body agrees with reference", whole_body_agrees_with_reference, has_reference},
    {"torn body agrees with reference", torn_body_agrees_with_reference, has_reference},
};
enum { CHECKS = sizeof checks / sizeof *checks };

/* Each formulation with every material that it takes. */
static size_t list_samples(sample *samples)
{
    size_t n = 0;
    for (const pd_formulation *const *f = pd_formulations; *f; f++)
        for (const pd_material *const *m = pd_materials; *m; m++)
            for (int d = 2; d <= 3; d++)
                for (int a = 0; a < ARRANGEMENTS; a++) {
                    if (!(*f)->accepts(*m, d, PD_PLANE_STRAIN))
                        continue;
                    if (samples)
                        samples[n] = (sample){.formulation = *f,
                                              .material = *m,
                                              .d = d,
                                              .arrangement = arrangements[a]};
                    n++;
                }
    return n;
}

typedef char test_name[160];

static size_t list_tests(sample *s, struct CMUnitTest *tests, test_name *names)
{
    size_t n = 0;
    for (const check *c = checks; c < checks + CHECKS; c++) {
        if (c->applies && !c->applies(s))
            continue;
        snprintf(names[n], sizeof *names, "%s, %s, %dD %s: %s", s->formulation->name,
                 s->material->name, s->d, s->arrangement, c->name);
        tests[n] = (struct CMUnitTest){names[n], c->run, make_body, free_body, s};
        n++;
    }
    return n;
}

int main(void)
{
    const size_t n = list_samples(NULL);
    sample *samples = calloc(n, sizeof *samples);
    struct CMUnitTest *all = calloc(n * CHECKS, sizeof *all);
    test_name *names = calloc(n * CHECKS, sizeof *names);
    list_samples(samples);
    size_t count = 0;
    for (size_t k = 0; k < n; k++)
        count += list_tests(&samples[k], all + count, names + count);

    struct CMUnitTest tests[count]; /* cmocka takes an array, no pointer */
    memcpy(tests, all, sizeof tests);
    const int failures = cmocka_run_group_tests(tests, NULL, NULL);
    free(samples);
    free(all);
    free(names);
    return failures;
}
