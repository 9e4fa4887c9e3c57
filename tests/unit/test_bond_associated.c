/*
 * Bond-associated correspondence: its gradients, balances, history and damage, against
 * closed forms and the slow all-pairs reference.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _GNU_SOURCE /* feenableexcept */
#include <fenv.h>

#include "damage.h"
#include "lattice.h"
#include "tensor.h"
#include "../reference/reference_bond_associated.h"

#define SPACING 0.05 /* m */

enum { FAMILY = 400 }; /* most bonds of a point */

/* Sums over families lose about 1e-14; moment matrices of jittered families and corners a
 * factor of up to 1e3 at order 2, 1e5 at order 3, where monomials are less distinct. */
static const double rounding_of_order[] = {0, 1e-12, 1e-11, 1e-9};

/* ---- a material to test with ---- */

static const pd_parameter moduli[] = {
    {.key = "lambda", .unit = "Pa", .above = 0, .below = HUGE_VAL, .meaning = "Lame's"},
    {.key = "mu", .unit = "Pa", .above = 0, .below = HUGE_VAL, .meaning = "Lame's"},
};
enum { LAMBDA, MU };

static void give_moduli(const double *parameters, int d, pd_plane plane, double *bulk,
                        double *shear)
{
    *bulk = parameters[LAMBDA] + 2. / 3 * parameters[MU];
    *shear = parameters[MU];
}

/* sigma' = Q sigma Q^T + lambda tr D + 2 mu D, Q = (1 - W/2)^-1 (1 + W/2): hypoelastic
 * with Jaumann's rate. Plane strain. Column by column; a W of three dimensions. */
static void turn(const double *W, double *sigma)
{
    static const int place[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    double before[9], after[9], by_before[9], Q[9], S[9], QS[9];
    identity(3, before);
    identity(3, after);
    for (int c = 0; c < 9; c++)
        before[c] -= W[c] / 2, after[c] += W[c] / 2;
    inverse(3, before, 1 / determinant(3, before), by_before);
    multiply(3, by_before, after, Q);
    for (int c = 0; c < 9; c++)
        S[c] = sigma[place[c / 3][c % 3]];
    multiply(3, Q, S, QS);
    for (int r = 0; r < 3; r++)
        for (int c = r; c < 3; c++)
            sigma[place[r][c]] = dot(3, QS + 3 * r, Q + 3 * c);
}

static void hypoelastic_update(const double *parameters, int d, size_t n, const double *G,
                               double *sigma, double *plastic)
{
    static const int place[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    for (size_t p = 0; p < n; p++, G += d * d, sigma += PD_SYMMETRIC) {
        double D[9] = {0}, W[9] = {0};
        for (int r = 0; r < d; r++)
            for (int c = 0; c < d; c++) {
                D[3 * r + c] = (G[r * d + c] + G[c * d + r]) / 2;
                W[3 * r + c] = (G[r * d + c] - G[c * d + r]) / 2;
            }
        turn(W, sigma);
        for (int r = 0; r < 3; r++)
            for (int c = r; c < 3; c++)
                sigma[place[r][c]] += 2 * parameters[MU] * D[3 * r + c] +
                                      (r == c) * parameters[LAMBDA] * trace(3, D);
        if (plastic)
            plastic[p] += sqrt(2. / 3 * dot(9, D, D));
    }
}

static const pd_material hypoelastic = {
    .name = "hypoelastic",
    .n_parameters = 2,
    .parameters = moduli,
    .moduli = give_moduli,
    .update = {[PD_PLANE_STRAIN] = hypoelastic_update},
};

/* The same, which calls all its strain plastic. */
static const pd_material straining = {
    .name = "straining",
    .n_parameters = 2,
    .parameters = moduli,
    .moduli = give_moduli,
    .update = {[PD_PLANE_STRAIN] = hypoelastic_update},
    .is_plastic = true,
};

/* ---- bodies ---- */

typedef struct {
    int d, order;
    bool associated;
} kind;

static pd_body_options options_of_kind(const kind *k, double horizon_ratio)
{
    return (pd_body_options){
        .dimension = k->d,
        .horizon_ratio = horizon_ratio,
        .density = 1.5,
        .formulation = pd_formulation_find("bondAssociated"),
        .formulation_parameters = {k->order, k->associated},
        .material = &hypoelastic,
        .parameters = {120, 80},
    };
}

/* Horizons that give every point of the clouds below the bonds that its order needs. */
static double ample(const kind *k)
{
    return k->order == 1 ? 2.4 : k->order == 2 ? 3.2 : 4.4;
}

static points scattered(const kind *k)
{
    points cloud =
        k->d == 2 ? lattice(2, 9, 8, 1, SPACING) : lattice(3, 6, 5, 5, SPACING);
    jitter(&cloud, 0.15 * SPACING);
    return cloud;
}

typedef struct {
    points cloud;
    pd_body_options options;
    pd_body *body;
    pd_body_view view;
    double stress_scale, force_scale; /* Pa, N/m3 */
} sample;

static sample sample_of(const points *cloud, const pd_body_options *options,
                        const unsigned char *held)
{
    sample s = {.cloud = *cloud, .options = *options};
    s.body = body_with_holds(cloud, options, held);
    s.view = pd_body_fields(s.body);
    s.stress_scale = options->parameters[LAMBDA] + 2 * options->parameters[MU];
    s.force_scale = s.stress_scale / SPACING;
    return s;
}

static sample scattered_sample(const kind *k)
{
    const points cloud = scattered(k);
    const pd_body_options options = options_of_kind(k, ample(k));
    return sample_of(&cloud, &options, NULL);
}

static void sample_free(sample *s)
{
    pd_body_destroy(s->body);
    points_free(&s->cloud);
}

static void for_every_kind(void (*check)(const kind *))
{
    for (int d = 2; d <= 3; d++)
        for (int order = 1; order <= 3; order++)
            for (int associated = 0; associated < 2; associated++)
                check(&(kind){d, order, associated});
}

/* v = field(y) of moving points. */
static void set_velocities(const sample *s, motion field, const void *context)
{
    const size_t d = (size_t)s->options.dimension;
    for (size_t p = 0; p < (size_t)s->view.n_moving; p++) {
        double x[3] = {0}, v[3];
        memcpy(x, s->view.y + p * d, d * sizeof *x);
        field(x, context, v);
        memcpy(s->view.v + p * d, v, d * sizeof *v);
    }
}

static void drift(const sample *s, double dt)
{
    const size_t numbers = (size_t)s->view.n_moving * (size_t)s->options.dimension;
    for (size_t k = 0; k < numbers; k++)
        s->view.y[k] += dt * s->view.v[k];
}

/* With the velocities that are set; forces at the end are those of the end. */
static void step(const sample *s, double dt, double at)
{
    drift(s, at * dt);
    assert_ok(pd_body_forces(s->body));
    assert_ok(pd_body_advance(s->body, dt, at));
    drift(s, (1 - at) * dt);
    assert_ok(pd_body_forces(s->body));
}

/* Velocities that no polynomial is; *context: their size, m/s. */
static void waves(const double *x, const void *context, double *v)
{
    move_in_waves(x, context, v);
    for (int a = 0; a < 3; a++)
        v[a] -= x[a];
}

/* Other ones. */
static void ripples(const double *x, const void *context, double *v)
{
    const double speed = *(const double *)context;
    for (int a = 0; a < 3; a++)
        v[a] = speed * cos(7 * x[a] + 12 * x[(a + 1) % 3] + a);
}

/* v = L (x - origin) */
static void flow(const double *x, const void *context, double *v)
{
    const affine *map = context;
    for (int r = 0; r < 3; r++) {
        v[r] = 0;
        for (int c = 0; c < 3; c++)
            v[r] += map->A[3 * r + c] * (x[c] - map->b[c]);
    }
}

static affine some_flow(int d)
{
    affine map = distortion(d);
    for (int c = 0; c < 9; c++)
        map.A[c] -= c % 4 == 0;
    return map;
}

/* Stretch by waves, then some steps of others, which leave stress of every kind. */
static void strain(const sample *s)
{
    const double amplitude = 0.05 * SPACING, speed = 0.06 * SPACING;
    body_place(s->body, move_in_waves, &amplitude);
    set_velocities(s, waves, &speed);
    step(s, 1, 0.5);
    set_velocities(s, ripples, &speed);
    step(s, 1, 0);
}

static double sum_of_volumes(const sample *s)
{
    double sum = 0;
    for (size_t p = 0; p < s->cloud.n; p++)
        sum += s->cloud.volume[p];
    return sum;
}

/* ---- gradients ---- */

/* v_a = sum of (c_a . x)^k for k up to *degree */
static const double directions[3][3] = {{2, -1, 1.5}, {1, 2.5, -1}, {-1.5, 1, 2}};

static double form(int a, const double *x)
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += directions[a][c] * (x[c] - 0.15);
    return sum;
}

static void polynomial(const double *x, const void *degree, double *v)
{
    for (int a = 0; a < 3; a++) {
        v[a] = 0;
        for (int k = 1; k <= *(const int *)degree; k++)
            v[a] += 0.1 * pow(form(a, x), k);
    }
}

static double slope(int degree, const double *x, int a, int c)
{
    double sum = 0;
    for (int k = 1; k <= degree; k++)
        sum += 0.1 * k * pow(form(a, x), k - 1) * directions[a][c];
    return sum;
}

/* What a step of unit length added: G = 2 (F - 1)(F + 1)^-1. */
static void step_of(int d, const double *F, double *G)
{
    double minus[9], plus[9], by_plus[9], one[9];
    identity(d, one);
    for (int c = 0; c < d * d; c++)
        minus[c] = 2 * (F[c] - one[c]), plus[c] = F[c] + one[c];
    inverse(d, plus, 1 / determinant(d, plus), by_plus);
    multiply(d, minus, by_plus, G);
}

/* Largest error of the gradient of a polynomial among all points. */
static double error_of_gradient(const kind *k, int degree)
{
    sample s = scattered_sample(k);
    set_velocities(&s, polynomial, &degree);
    assert_ok(pd_body_forces(s.body));
    assert_ok(pd_body_advance(s.body, 1, 0.5));
    double worst = 0;
    for (pd_local p = 0; p < s.view.n_owned; p++) {
        double G[9], x[3] = {0};
        memcpy(x, s.view.y + p * k->d, (size_t)k->d * sizeof *x);
        step_of(k->d, s.view.F + p * k->d * k->d, G);
        for (int c = 0; c < k->d * k->d; c++)
            worst = fmax(worst, fabs(G[c] - slope(degree, x, c / k->d, c % k->d)));
    }
    sample_free(&s);
    return worst;
}

static void check_polynomials(const kind *k)
{
    for (int degree = 1; degree <= k->order; degree++)
        assert_near(error_of_gradient(k, degree), 0, rounding_of_order[k->order]);
    assert_true(error_of_gradient(k, k->order + 1) > 1e-5);
}

/* Scattered points, and those at the surface. */
static void gradients_of_polynomials_are_exact(void **state)
{
    for_every_kind(check_polynomials);
}

/* ---- against the reference ---- */

static reference_bonds *reference_of(const sample *s)
{
    reference_bonds *reference =
        reference_bonds_create(&s->options, s->cloud.n, s->cloud.X, s->cloud.volume);
    assert_non_null(reference);
    return reference;
}

static void set_reference(const sample *s, reference_bonds *reference)
{
    const int d = s->options.dimension;
    for (pd_local p = 0; p < s->view.n_owned; p++)
        for (int a = 0; a < d; a++) {
            reference->y[s->view.id[p]][a] = s->view.y[p * d + a];
            reference->v[s->view.id[p]][a] = s->view.v[p * d + a];
        }
}

static void assert_agreement(const sample *s, const reference_bonds *reference,
                             double tolerance)
{
    const int d = s->options.dimension;
    double *sigma = malloc(s->cloud.n * PD_SYMMETRIC * sizeof *sigma);
    pd_body_stress(s->body, sigma, NULL);
    for (pd_local p = 0; p < s->view.n_owned; p++) {
        const size_t i = (size_t)s->view.id[p];
        for (int r = 0; r < d; r++) {
            assert_near(s->view.force[p * d + r], reference->f[i][r],
                        tolerance * s->force_scale);
            for (int c = 0; c < d; c++)
                assert_near(s->view.F[(p * d + r) * d + c], reference->F[i][r][c],
                            tolerance);
        }
        assert_near(s->view.J[p], reference->J[i], tolerance);
        for (int c = 0; c < PD_SYMMETRIC; c++)
            assert_near(sigma[p * PD_SYMMETRIC + c], reference->mean[i][c],
                        tolerance * s->stress_scale);
    }
    free(sigma);
}

/* A step of both, which are compared at its start and at its end. */
static void step_both(const sample *s, reference_bonds *reference, double at,
                      double tolerance)
{
    drift(s, at);
    set_reference(s, reference);
    reference_bonds_forces(reference);
    assert_ok(pd_body_forces(s->body));
    assert_agreement(s, reference, tolerance);
    reference_bonds_advance(reference, 1, at);
    assert_ok(pd_body_advance(s->body, 1, at));
    drift(s, 1 - at);
    set_reference(s, reference);
    reference_bonds_forces(reference);
    assert_ok(pd_body_forces(s->body));
    assert_agreement(s, reference, tolerance);
}

static void check_reference(const kind *k)
{
    sample s = scattered_sample(k);
    reference_bonds *reference = reference_of(&s);
    const double amplitude = 0.05 * SPACING, speed = 0.06 * SPACING;
    const affine flows = some_flow(k->d);
    body_place(s.body, move_in_waves, &amplitude);
    set_velocities(&s, waves, &speed);
    step_both(&s, reference, 0.5, rounding_of_order[k->order]);
    set_velocities(&s, flow, &flows);
    step_both(&s, reference, 0, rounding_of_order[k->order]);
    set_velocities(&s, ripples, &speed);
    step_both(&s, reference, 1, rounding_of_order[k->order]);
    assert_true(largest(s.view.force, (size_t)(s.view.n_owned * k->d)) >
                1e-2 * s.force_scale);
    reference_bonds_free(reference);
    sample_free(&s);
}

static void body_agrees_with_reference(void **state)
{
    for_every_kind(check_reference);
}

/* ---- balances ---- */

static double power_of_forces(const sample *s)
{
    const int d = s->options.dimension;
    double sum = 0;
    for (pd_local p = 0; p < s->view.n_moving; p++)
        sum += s->view.volume[p] * dot(d, s->view.force + p * d, s->view.v + p * d);
    return sum;
}

/* Relative to stresses and rates of strain of 0.1 everywhere. */
static void check_power(const kind *k)
{
    sample s = scattered_sample(k);
    reference_bonds *reference = reference_of(&s);
    const double amplitude = 0.05 * SPACING, speed = 0.06 * SPACING;
    body_place(s.body, move_in_waves, &amplitude);
    set_velocities(&s, waves, &speed);
    step_both(&s, reference, 0, rounding_of_order[k->order]);
    set_velocities(&s, waves, &speed); /* onwards */
    set_reference(&s, reference);
    const double power = reference_bonds_power(reference);
    const double scale = 0.01 * s.stress_scale * sum_of_volumes(&s);
    assert_near(power_of_forces(&s), -power, rounding_of_order[k->order] * scale);
    assert_true(power > 0.01 * scale);
    reference_bonds_free(reference);
    sample_free(&s);
}

static void power_of_forces_is_the_stress_power(void **state)
{
    for_every_kind(check_power);
}

static void assert_balanced(const sample *s, int order)
{
    const int d = s->options.dimension;
    const double tolerance =
        rounding_of_order[order] * s->force_scale * sum_of_volumes(s);
    assert_true(largest(s->view.force, (size_t)(s->view.n_owned * d)) >
                1e-3 * s->force_scale);
    for (int a = 0; a < d; a++) {
        double force = 0, couple = 0;
        const int b = (a + 1) % d;
        for (pd_local p = 0; p < s->view.n_owned; p++) {
            const double *y = s->view.y + p * d, *f = s->view.force + p * d;
            force += s->view.volume[p] * f[a];
            couple += s->view.volume[p] * (y[a] * f[b] - y[b] * f[a]);
        }
        assert_near(force, 0, tolerance);
        assert_near(couple, 0, tolerance);
    }
}

static void check_balances(const kind *k)
{
    sample s = scattered_sample(k);
    strain(&s);
    assert_balanced(&s, k->order);
    sample_free(&s);
}

static void forces_and_couples_sum_to_nothing(void **state)
{
    for_every_kind(check_balances);
}

static void break_bond(pd_body *body, pd_local p, pd_local q)
{
    const pd_families *families = &body->families;
    for (int64_t k = families->first[p]; k < families->first[p + 1]; k++)
        if (families->neighbour[k] == q)
            pd_damage_break(body, k);
}

/* A point of which one bond is left bears no stress; its neighbour's share of that bond
 * pulls both. */
static sample hanging_sample(const kind *k)
{
    sample s = scattered_sample(k);
    assert_ok(pd_damage_allocate(s.body));
    pd_local family[FAMILY];
    const pd_local hanging = place_of(s.body, 0);
    const pd_local count = pd_body_family(s.body, hanging, FAMILY, family);
    for (pd_local l = 1; l < count; l++) {
        break_bond(s.body, hanging, family[l]);
        break_bond(s.body, family[l], hanging);
    }
    assert_ok(s.options.formulation->prepare(s.body));
    assert_int_equal(pd_body_summary(s.body).singular, 1);
    return s;
}

static void check_hanging_point(const kind *k)
{
    sample s = hanging_sample(k);
    strain(&s);
    assert_balanced(&s, k->order);
    const double *f = s.view.force + place_of(s.body, 0) * k->d;
    assert_true(largest(f, (size_t)k->d) > 1e-3 * s.force_scale);
    sample_free(&s);
}

static void assert_uniform_but(const sample *s, pd_local odd, double tolerance)
{
    double *sigma = malloc(s->cloud.n * PD_SYMMETRIC * sizeof *sigma);
    pd_body_stress(s->body, sigma, NULL);
    const double *first = sigma + (odd == 0) * PD_SYMMETRIC;
    assert_true(largest(first, PD_SYMMETRIC) > 0.01 * s->stress_scale);
    for (pd_local p = 0; p < s->view.n_owned; p++)
        for (int c = 0; c < PD_SYMMETRIC; c++)
            assert_near(sigma[p * PD_SYMMETRIC + c], p == odd ? 0 : first[c],
                        p == odd ? 0 : tolerance * s->stress_scale);
    free(sigma);
}

/* Once turned inside out a point bears no stress; its neighbours go on: their gradients
 * are exact as they were. */
static void check_inverted_point(const kind *k)
{
    const points cloud = scattered(k);
    pd_body_options options = options_of_kind(k, ample(k));
    options.critical_stretch = 100;
    sample s = sample_of(&cloud, &options, NULL);
    const pd_local odd = place_of(s.body, (pd_global)(cloud.n / 2));
    s.body->carries[odd] = PD_POINT_INVERTED;
    const affine flows = some_flow(k->d);
    set_velocities(&s, flow, &flows);
    step(&s, 0.1, 0.5);
    assert_uniform_but(&s, odd, rounding_of_order[k->order]);
    strain(&s);
    assert_int_equal(pd_body_summary(s.body).inverted, 1);
    assert_balanced(&s, k->order);
    sample_free(&s);
}

static void forces_and_couples_balance_where_a_point_is_inverted(void **state)
{
    for_every_kind(check_inverted_point);
}

static void forces_and_couples_balance_where_a_point_hangs(void **state)
{
    for_every_kind(check_hanging_point);
}

/* Force densities that a very short step with a field of velocities adds, over its
 * length: the stiffness times the field, as the volumes hardly change. */
static double *response(const sample *s, motion field)
{
    const double speed = 1, dt = 1e-15;
    const size_t numbers = (size_t)s->view.n_owned * (size_t)s->options.dimension;
    double *added = malloc(numbers * sizeof *added);
    assert_ok(pd_body_forces(s->body));
    memcpy(added, s->view.force, numbers * sizeof *added);
    set_velocities(s, field, &speed);
    assert_ok(pd_body_advance(s->body, dt, 0.5));
    assert_ok(pd_body_forces(s->body));
    for (size_t k = 0; k < numbers; k++)
        added[k] = (s->view.force[k] - added[k]) / dt;
    return added;
}

static double work(const sample *s, const double *force, motion field)
{
    const double speed = 1;
    const int d = s->options.dimension;
    double sum = 0;
    set_velocities(s, field, &speed);
    for (pd_local p = 0; p < s->view.n_moving; p++)
        sum += s->view.volume[p] * dot(d, force + p * d, s->view.v + p * d);
    return sum;
}

/* Held at one end; points where the waves have brought them. */
static sample held_sample_of(const kind *k, double lambda)
{
    const points cloud = scattered(k);
    pd_body_options options = options_of_kind(k, ample(k));
    options.parameters[LAMBDA] = lambda;
    unsigned char *held = calloc(cloud.n, 1);
    for (size_t p = 0; p < cloud.n; p++)
        held[p] = cloud.X[3 * p] < 2 * SPACING;
    sample s = sample_of(&cloud, &options, held);
    free(held);
    const double amplitude = 0.05 * SPACING;
    for (pd_local p = 0; p < s.view.n_moving; p++) {
        double X[3] = {0}, y[3];
        memcpy(X, s.view.X + p * k->d, (size_t)k->d * sizeof *X);
        move_in_waves(X, &amplitude, y);
        memcpy(s.view.y + p * k->d, y, (size_t)k->d * sizeof *y);
    }
    return s;
}

static sample held_sample(const kind *k)
{
    return held_sample_of(k, 120);
}

/* Forces are the transpose of the velocity gradients, in holds too, exactly if the
 * stiffness is symmetric: the material's is. Volumes hardly change in a step of 1e-15. */
static void check_symmetry(const kind *k)
{
    sample s = held_sample(k), t = held_sample(k);
    double *of_waves = response(&s, waves), *of_ripples = response(&t, ripples);
    const double there = work(&s, of_waves, ripples), back = work(&s, of_ripples, waves);
    const double own = work(&s, of_waves, waves);
    assert_true(own < 0);
    assert_near(there, back, rounding_of_order[k->order] * fabs(own));
    assert_true(fabs(there) > 1e-3 * fabs(own));
    free(of_waves);
    free(of_ripples);
    sample_free(&s);
    sample_free(&t);
}

static void stiffness_is_symmetric_with_holds(void **state)
{
    for_every_kind(check_symmetry);
}

/* ---- holds ---- */

/* Held columns 0 and 1 of a lattice end at x = 2 SPACING. A velocity that is linear and
 * zero there is seen exactly where families do not end, at surfaces too. */
static void check_hold(const kind *k)
{
    const points cloud =
        k->d == 2 ? lattice(2, 8, 7, 1, SPACING) : lattice(3, 8, 5, 5, SPACING);
    unsigned char *held = calloc(cloud.n, 1);
    for (size_t p = 0; p < cloud.n; p++)
        held[p] = cloud.X[3 * p] < 2 * SPACING;
    const pd_body_options options = options_of_kind(k, 2.015);
    sample s = sample_of(&cloud, &options, held);
    free(held);
    affine pull = {{0.1, 0, 0, 0.05, 0, 0, 0, 0, 0}, {2 * SPACING, 0, 0}};
    set_velocities(&s, flow, &pull);
    step(&s, 1, 0.5);
    double *sigma = malloc(cloud.n * PD_SYMMETRIC * sizeof *sigma);
    pd_body_stress(s.body, sigma, NULL);
    for (pd_local p = 0; p < s.view.n_owned; p++) {
        if (p >= s.view.n_moving) {
            assert_near(largest(s.view.force + p * k->d, (size_t)k->d), 0, 0);
            assert_near(largest(sigma + p * PD_SYMMETRIC, PD_SYMMETRIC), 0, 0);
            continue;
        }
        double G[9];
        step_of(k->d, s.view.F + p * k->d * k->d, G);
        for (int c = 0; c < k->d * k->d; c++) /* at the middle of the step */
            assert_near(G[c], pull.A[3 * (c / k->d) + c % k->d] / 1.05, 1e-11);
    }
    free(sigma);
    sample_free(&s);
}

static void hold_is_where_velocities_vanish(void **state)
{
    for_every_kind(check_hold);
}

/* ---- history ---- */

/* A step of the flow A, in which points move to (1 + A) x. */
static void expect_step(int d, const double *A, const pd_body_options *o, double *F,
                        double *sigma)
{
    double to_middle[9], by_middle[9], to_end[9], G[9], F_new[9];
    identity(d, to_middle);
    identity(d, to_end);
    for (int c = 0; c < d * d; c++)
        to_middle[c] += A[c] / 2, to_end[c] += A[c];
    inverse(d, to_middle, 1 / determinant(d, to_middle), by_middle);
    multiply(d, A, by_middle, G);
    hypoelastic_update(o->parameters, d, 1, G, sigma, NULL);
    multiply(d, to_end, F, F_new);
    memcpy(F, F_new, (size_t)(d * d) * sizeof *F);
}

static void assert_uniform(const sample *s, const double *F, const double *sigma,
                           double tolerance)
{
    const int d = s->options.dimension;
    double *all = malloc(s->cloud.n * PD_SYMMETRIC * sizeof *all);
    pd_body_stress(s->body, all, NULL);
    for (pd_local p = 0; p < s->view.n_owned; p++) {
        for (int c = 0; c < PD_SYMMETRIC; c++)
            assert_near(all[p * PD_SYMMETRIC + c], sigma[c], tolerance * s->stress_scale);
        for (int c = 0; c < d * d; c++)
            assert_near(s->view.F[p * d * d + c], F[c], tolerance);
        assert_near(s->view.J[p], determinant(d, F), tolerance);
    }
    free(all);
}

static void check_affine_stretch(const kind *k)
{
    sample s = scattered_sample(k);
    const affine flows = some_flow(k->d);
    double sigma[PD_SYMMETRIC] = {0}, F[9], A[9];
    identity(k->d, F);
    for (int c = 0; c < k->d * k->d; c++)
        A[c] = 0.1 * flows.A[3 * (c / k->d) + c % k->d];
    const double at[] = {0, 0.5, 1, 0.25, 0, 0.5};
    for (int n = 0; n < 6; n++) {
        set_velocities(&s, flow, &flows); /* at the start of the step */
        step(&s, 0.1, at[n]);
        expect_step(k->d, A, &s.options, F, sigma);
    }
    assert_uniform(&s, F, sigma, 10 * rounding_of_order[k->order]);
    assert_true(largest(sigma, PD_SYMMETRIC) > 0.01 * s.stress_scale);
    sample_free(&s);
}

/* Wherever in the step the gradient is taken. */
static void affine_stretch_has_the_stress_of_the_rate_form(void **state)
{
    for_every_kind(check_affine_stretch);
}

static void check_interior(const kind *k)
{
    const int side = k->d == 2 ? 13 : 9; /* horizons reach three and two spacings */
    const points cloud = lattice(k->d, side, side, side, SPACING);
    const pd_body_options options = options_of_kind(k, k->d == 2 ? 3.015 : 2.015);
    sample s = sample_of(&cloud, &options, NULL);
    const affine flows = some_flow(k->d);
    set_velocities(&s, flow, &flows);
    step(&s, 0.1, 0.5);
    const pd_local middle = place_of(s.body, (pd_global)(cloud.n / 2));
    assert_near(largest(s.view.force + middle * k->d, (size_t)k->d), 0,
                rounding_of_order[k->order] * s.force_scale);
    assert_true(largest(s.view.force, cloud.n) > 0.01 * s.force_scale); /* at surfaces */
    sample_free(&s);
}

/* Order 3 falls back to 2 where horizons reach two spacings. */
static void interior_of_affine_stretch_is_balanced(void **state)
{
    for_every_kind(check_interior);
}

/* Turn by a right angle in steps; positions are exact, velocities their differences. */
static void turn_body(const sample *s, int steps, double at)
{
    const int d = s->options.dimension;
    const affine turned = rotation(d, acos(0.) / steps);
    for (int n = 0; n < steps; n++) {
        for (pd_local p = 0; p < s->view.n_owned; p++)
            for (int r = 0; r < d; r++) {
                double end = 0;
                for (int c = 0; c < d; c++)
                    end += turned.A[3 * r + c] * s->view.y[p * d + c];
                s->view.v[p * d + r] = end - s->view.y[p * d + r];
            }
        step(s, 1, at);
    }
}

/* Forces turn with the body and nothing else changes: thirty steps of 3 degrees, as
 * exact as one. */
static void check_turn(const kind *k)
{
    for (int halfway = 0; halfway < 2; halfway++) {
        sample s = scattered_sample(k);
        strain(&s);
        const size_t numbers = s.cloud.n * (size_t)k->d;
        double *force = malloc(numbers * sizeof *force);
        double *J = malloc(s.cloud.n * sizeof *J);
        memcpy(force, s.view.force, numbers * sizeof *force);
        memcpy(J, s.view.J, s.cloud.n * sizeof *J);
        turn_body(&s, 30, 0.5 * halfway);
        const affine turned = rotation(k->d, acos(0.));
        const double tolerance = 100 * rounding_of_order[k->order];
        for (pd_local p = 0; p < s.view.n_owned; p++) {
            assert_near(s.view.J[p], J[p], tolerance);
            for (int r = 0; r < k->d; r++) {
                double expected = 0;
                for (int c = 0; c < k->d; c++)
                    expected += turned.A[3 * r + c] * force[p * k->d + c];
                assert_near(s.view.force[p * k->d + r], expected,
                            tolerance * s.force_scale);
            }
        }
        free(force);
        free(J);
        sample_free(&s);
    }
}

static void turned_body_keeps_its_stress(void **state)
{
    for_every_kind(check_turn);
}

/* To three times the length, and a third of the width in two dimensions. */
static void check_long_stretch(const kind *k)
{
    const points cloud =
        k->d == 2 ? lattice(2, 9, 8, 1, SPACING) : lattice(3, 6, 5, 5, SPACING);
    const pd_body_options options = options_of_kind(k, 3.015);
    sample s = sample_of(&cloud, &options, NULL);
    const affine flows = {{1, 0, 0, 0, -0.5, 0, 0, 0, -0.2}, {0}};
    for (int n = 0; n < 11; n++) {
        set_velocities(&s, flow, &flows);
        step(&s, 0.1, 0.5);
    }
    assert_int_equal(pd_body_summary(s.body).singular, 0);
    const double F[] = {pow(1.1, 11), pow(0.95, 11), pow(0.98, 11)};
    for (pd_local p = 0; p < s.view.n_owned; p++)
        for (int c = 0; c < k->d * k->d; c++)
            assert_near(s.view.F[p * k->d * k->d + c],
                        c % (k->d + 1) == 0 ? F[c / k->d] : 0, 1e-9);
    sample_free(&s);
}

static void families_last_under_long_stretch(void **state)
{
    for_every_kind(check_long_stretch);
}

/* ---- modes without energy ---- */

/* *context: the spacing. */
static void checkerboard(const double *x, const void *context, double *v)
{
    const double h = *(const double *)context;
    double sum = 0;
    for (int a = 0; a < 3; a++)
        sum += floor(x[a] / h);
    for (int a = 0; a < 3; a++)
        v[a] = fmod(sum, 2) == 0 ? 1 : -1;
}

/* Force density in the middle of a lattice of which every second point has moved up, the
 * others down, over stiffness and step: without association gradients see none of it. */
static double force_of_checkerboard(int d, int order, bool associated)
{
    const int side = d == 2 ? 13 : 9;
    const points cloud = lattice(d, side, side, side, SPACING);
    const pd_body_options options =
        options_of_kind(&(kind){d, order, associated}, d == 2 ? 3.015 : 2.015);
    sample s = sample_of(&cloud, &options, NULL);
    const double spacing = SPACING;
    set_velocities(&s, checkerboard, &spacing);
    assert_ok(pd_body_forces(s.body));
    assert_ok(pd_body_advance(s.body, 1e-6 * SPACING, 0.5));
    assert_ok(pd_body_forces(s.body));
    const pd_local middle = place_of(s.body, (pd_global)(cloud.n / 2));
    const double force = dot(d, s.view.force + middle * d, s.view.v + middle * d);
    sample_free(&s);
    return -force / (1e-6 * s.force_scale);
}

static void association_resists_the_checkerboard(void **state)
{
    for (int d = 2; d <= 3; d++)
        for (int order = 1; order <= 3; order++) {
            assert_near(force_of_checkerboard(d, order, false), 0, 1e-9);
            assert_true(force_of_checkerboard(d, order, true) > 0.5);
        }
}

/* Gradients of points see nothing of it, those of bonds are 10^6: no body can do that in
 * a step, so that stresses stay as they are. */
static void senseless_motion_of_bonds_makes_no_stress(void **state)
{
    const kind k = {2, 2, true};
    const points cloud = lattice(2, 13, 13, 1, SPACING);
    pd_body_options options = options_of_kind(&k, 3.015);
    options.critical_stretch = 1e3;
    sample s = sample_of(&cloud, &options, NULL);
    const double spacing = SPACING;
    set_velocities(&s, checkerboard, &spacing);
    assert_ok(pd_body_forces(s.body));
    assert_ok(pd_body_advance(s.body, 1e6 * SPACING, 0.5));
    assert_ok(pd_body_forces(s.body));
    const pd_local middle = place_of(s.body, (pd_global)(cloud.n / 2));
    assert_int_equal(s.body->carries[middle], PD_SOUND);
    /* Points see 10^6 times round-off. */
    assert_near(largest(s.view.force + 2 * middle, 2), 0, 1e-5 * s.force_scale);
    sample_free(&s);
}

/* ---- frequency ---- */

/* Highest omega^2 of the body by power iteration. */
static double highest_frequency(const sample *s)
{
    const size_t numbers = (size_t)s->view.n_moving * (size_t)s->options.dimension;
    double *before = malloc(numbers * sizeof *before), highest = 0;
    for (int n = 0; n < 40; n++) {
        const double dt = 1e-12;
        memcpy(before, s->view.force, numbers * sizeof *before);
        assert_ok(pd_body_advance(s->body, dt, 0.5));
        assert_ok(pd_body_forces(s->body));
        double length = 0;
        for (size_t k = 0; k < numbers; k++) {
            s->view.v[k] = -(s->view.force[k] - before[k]) / (dt * s->options.density);
            length += s->view.v[k] * s->view.v[k];
        }
        highest = sqrt(length);
        for (size_t k = 0; k < numbers; k++)
            s->view.v[k] /= highest;
    }
    free(before);
    return highest;
}

/* The bound takes the modulus of plane waves; a volume change has more of a stiffness, up
 * to d times as much where lambda is large. */
static void check_frequency(const kind *k)
{
    const double lambdas[] = {1e-3, 120, 1e4};
    for (int n = 0; n < 3; n++) {
        sample s = held_sample_of(k, lambdas[n]);
        memcpy(s.view.y, s.view.X, s.cloud.n * (size_t)k->d * sizeof *s.view.y);
        assert_ok(pd_body_forces(s.body));
        double *bounds = malloc((size_t)s.view.n_local * sizeof *bounds);
        s.options.formulation->frequency(s.body, bounds);
        const double bound = largest(bounds, (size_t)s.view.n_moving), speed = 1;
        set_velocities(&s, ripples, &speed);
        const double highest = highest_frequency(&s);
        assert_true(bound >= highest);
        assert_true(bound < 16 * highest);
        free(bounds);
        sample_free(&s);
    }
}

static void frequency_is_bounded(void **state)
{
    for_every_kind(check_frequency);
}

/* ---- damage ---- */

static pd_local bonds_broken(const sample *s)
{
    return (pd_local)pd_body_summary(s->body).broken_bonds;
}

/* Both directions of each bond agree. */
static void assert_breaks_are_mutual(const sample *s)
{
    for (pd_local p = 0; p < s->view.n_active; p++) {
        pd_local of_p[FAMILY], of_q[FAMILY];
        const pd_local count = pd_body_family(s->body, p, FAMILY, of_p);
        for (pd_local k = 0; k < count; k++) {
            const pd_local there = pd_body_family(s->body, of_p[k], FAMILY, of_q);
            for (pd_local l = 0; l < there; l++)
                if (of_q[l] == p)
                    assert_int_equal(pd_body_bond_intact(s->body, p, k),
                                     pd_body_bond_intact(s->body, of_p[k], l));
        }
    }
}

typedef void (*check_damage)(const kind *k, const pd_body_options *options);

/* Every criterion, at values that are reached by strains of 0.1 or so. */
static void for_every_criterion(const kind *k, check_damage check)
{
    pd_body_options options = options_of_kind(k, 2.4);
    options.critical_stretch = 1.12;
    check(k, &options);
    options = options_of_kind(k, 2.4);
    options.critical_stress = (k->d == 2 ? 0.12 : 0.094) * 280;
    check(k, &options);
    options = options_of_kind(k, 2.4);
    options.material = &straining;
    options.sound_strain = 0.04;
    options.failed_strain = 0.18;
    check(k, &options);
}

static void for_every_damage(check_damage check)
{
    for (int d = 2; d <= 3; d++)
        for (int associated = 0; associated < 2; associated++)
            for_every_criterion(&(kind){d, 1, associated}, check);
}

/* Pulled and waved until some bonds have gone but all points keep families of order 1. */
static void check_damage_by_reference(const kind *k, const pd_body_options *options)
{
    const points cloud = scattered(k);
    sample s = sample_of(&cloud, options, NULL);
    reference_bonds *reference = reference_of(&s);
    const double speed = 0.05 * SPACING;
    const affine pull = {{0.015, 0, 0, 0, 0, 0, 0, 0, 0}, {0.1, 0.1, 0.1}};
    for (int n = 0; n < 4; n++) {
        set_velocities(&s, waves, &speed);
        step_both(&s, reference, 0.5, 1e-9); /* families with few bonds left */
        set_velocities(&s, flow, &pull);
        step_both(&s, reference, 0, 1e-9);
    }
    const pd_summary summary = pd_body_summary(s.body);
    assert_true(summary.broken_bonds > 0 && summary.broken_bonds < summary.bonds / 2);

    assert_int_equal(summary.singular, 0);
    int64_t broken = 0;
    for (size_t i = 0; i < cloud.n; i++)
        for (size_t j = 0; j < i; j++)
            broken += reference->omega_D[i * cloud.n + j] == 0;
    assert_int_equal(summary.broken_bonds, broken);
    assert_breaks_are_mutual(&s);
    reference_bonds_free(reference);
    sample_free(&s);
}

static void damaged_body_agrees_with_reference(void **state)
{
    for (int d = 2; d <= 3; d++)
        for_every_criterion(&(kind){d, 1, true}, check_damage_by_reference);
}

/* Halves drawn apart, neither deforming. */
static void set_parting(const sample *s, double speed)
{
    const int d = s->options.dimension;
    memset(s->view.v, 0, s->cloud.n * (size_t)d * sizeof *s->view.v);
    for (pd_local p = 0; p < s->view.n_owned; p++)
        s->view.v[p * d] = s->view.X[p * d] > 0.2 ? speed : 0;
}

/* Force on the half that stays. */
static double pull_through_middle(const sample *s)
{
    double sum = 0;
    for (pd_local p = 0; p < s->view.n_owned; p++)
        if (s->view.X[p * s->options.dimension] < 0.2)
            sum += s->view.volume[p] * s->view.force[p * s->options.dimension];
    return sum;
}

/* Force rises while bonds hold, falls when some have broken, is gone with the last. */
static void check_parting(const kind *k, const pd_body_options *options)
{
    const points cloud = lattice(k->d, 8, 6, 4, SPACING);
    sample s = sample_of(&cloud, options, NULL);
    double highest = 0;
    pd_local broken = 0;
    for (int n = 0; n < 300; n++) {
        set_parting(&s, 0.02 * SPACING);
        step(&s, 1, 0.5);
        highest = fmax(highest, pull_through_middle(&s));
        assert_true(bonds_broken(&s) >= broken); /* for good */
        broken = bonds_broken(&s);
    }
    assert_true(highest > 1e-3 * s.stress_scale * pow(4 * SPACING, k->d - 1));
    const bool parted = pd_body_pieces(s.body, NULL, NULL) > 1;
    /* The strain of points, without association, hardly sees a bond that has decayed: it
     * may be left with a weight of nearly nothing. */
    const bool last_bonds_stay = !k->associated && options->failed_strain > 0;
    assert_true(parted || last_bonds_stay);
    assert_near(pull_through_middle(&s), 0, (last_bonds_stay ? 2e-2 : 1e-12) * highest);
    sample_free(&s);
}

static void parted_halves_pull_no_more(void **state)
{
    for_every_damage(check_parting);
}

static void check_protection(const kind *k, const pd_body_options *options)
{
    const points cloud = lattice(k->d, 8, 6, 4, SPACING);
    sample s = sample_of(&cloud, options, NULL);
    pd_body_options whole = *options;
    whole.critical_stretch = whole.critical_stress = whole.failed_strain =
        whole.sound_strain = 0;
    sample t = sample_of(&cloud, &whole, NULL);
    unsigned char *protect = malloc(cloud.n);
    memset(protect, 1, cloud.n);
    assert_ok(pd_body_protect(s.body, protect));
    free(protect);
    for (int n = 0; n < 20; n++) {
        set_parting(&s, 0.02 * SPACING);
        set_parting(&t, 0.02 * SPACING);
        step(&s, 1, 0.5);
        step(&t, 1, 0.5);
    }
    assert_int_equal(bonds_broken(&s), 0);
    const size_t numbers = cloud.n * (size_t)k->d;
    assert_memory_equal(s.view.force, t.view.force, numbers * sizeof(double));
    pd_body_destroy(t.body);
    sample_free(&s);
}

/* Neither break nor decay: to the last bit like bonds that cannot. */
static void protected_bonds_are_as_without_damage(void **state)
{
    for_every_damage(check_protection);
}

static void one_protected_end_protects_the_bond(void **state)
{
    const kind k = {2, 1, true};
    const points cloud = lattice(2, 8, 6, 1, SPACING);
    pd_body_options options = options_of_kind(&k, 2.4);
    options.critical_stretch = 1.1;
    sample s = sample_of(&cloud, &options, NULL);
    unsigned char protect[48] = {0};
    protect[21] = 1;
    assert_ok(pd_body_protect(s.body, protect));
    const affine explosion = {{2, 0, 0, 0, 2, 0, 0, 0, 2}, {0}};
    body_map(s.body, &explosion);
    assert_ok(pd_body_forces(s.body));
    const pd_local of = pd_body_family(s.body, place_of(s.body, 21), 0, NULL);
    const pd_summary summary = pd_body_summary(s.body);
    assert_int_equal(summary.bonds - summary.broken_bonds, of);
    assert_breaks_are_mutual(&s);
    sample_free(&s);
}

/* s_c from G_c. */
static void energy_release_breaks_bonds(void **state)
{
    const kind k = {2, 2, true};
    const points cloud = lattice(2, 8, 6, 1, SPACING);
    pd_body_options options = options_of_kind(&k, 3.015);
    options.energy_release = 0.1;
    sample s = sample_of(&cloud, &options, NULL);
    const double s_c = pd_body_critical_stretch(s.body, 0, 1);
    const double stretches[] = {s_c * (1 - 1e-9), s_c * (1 + 1e-9)};
    for (int n = 0; n < 2; n++) {
        const double a = stretches[n];
        const affine stretch = {{a, 0, 0, 0, a, 0, 0, 0, a}, {0}};
        body_map(s.body, &stretch);
        assert_ok(pd_body_forces(s.body));
        const pd_summary summary = pd_body_summary(s.body);
        assert_int_equal(summary.broken_bonds, n ? summary.bonds : 0);
    }
    sample_free(&s);
}

static void pre_cracks_part_a_body_that_cannot_break(void **state)
{
    const kind k = {2, 2, true};
    const points cloud = lattice(2, 8, 6, 1, SPACING);
    const pd_body_options options = options_of_kind(&k, 3.015);
    sample s = sample_of(&cloud, &options, NULL);
    const pd_rectangle crack = {.corner = {0.2, -1}, .edge1 = {0, 3}};
    assert_ok(pd_body_precrack(s.body, &crack));
    set_parting(&s, 0.05 * SPACING);
    step(&s, 1, 0.5);
    assert_true(bonds_broken(&s) > 0);
    assert_near(largest(s.view.force, 2 * cloud.n), 0, 1e-12 * s.force_scale);
    sample_free(&s);
}

static void body_that_cannot_break_keeps_no_bond_states(void **state)
{
    const kind k = {2, 2, true};
    sample s = scattered_sample(&k);
    strain(&s);
    assert_null(s.body->broken);
    sample_free(&s);
}

/* ---- robustness ---- */

enum { TRAPS = FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW };

/* A step with traps on, from anywhere. */
static pd_code trapped_step(const sample *s, double dt, double at)
{
    feclearexcept(TRAPS);
    feenableexcept(TRAPS);
    pd_status status = pd_body_forces(s->body);
    if (status.code == PD_OK)
        status = pd_body_advance(s->body, dt, at);
    if (status.code == PD_OK)
        status = pd_body_forces(s->body);
    fedisableexcept(TRAPS);
    return status.code;
}

static void assert_finite(const sample *s)
{
    const size_t n = s->cloud.n, d = (size_t)s->options.dimension;
    double *sigma = malloc(n * PD_SYMMETRIC * sizeof *sigma);
    pd_body_stress(s->body, sigma, NULL);
    assert_true(isfinite(largest(sigma, n * PD_SYMMETRIC)));
    /* What no body can do in a step makes no stress. */
    assert_true(largest(sigma, n * PD_SYMMETRIC) < 1e5 * s->stress_scale);
    assert_true(isfinite(largest(s->view.force, n * d)));
    assert_true(isfinite(largest(s->view.F, n * d * d)));
    assert_true(isfinite(largest(s->view.J, n)));
    free(sigma);
}

static void check_violence(const kind *k)
{
    const affine maps[] = {
        {{0}, {0}}, /* all in one place */
        {{1e4, 0, 0, 0, 1e4, 0, 0, 0, 1e4}, {0}},
        {{1e59, 0, 0, 0, 1e59, 0, 0, 0, 1e59}, {0}},
        {{1, 0, 0, 0, 0, 0, 0, 0, 0}, {0}}, /* on one line */
        {{-1, 0, 0, 0, 1, 0, 0, 0, 1}, {0}},
    };
    const double speeds[] = {0, 1, 1e3, 1e10, 1e59};
    for (size_t m = 0; m < sizeof maps / sizeof *maps; m++)
        for (size_t v = 0; v < sizeof speeds / sizeof *speeds; v++)
            for (int breaks = 0; breaks < 2; breaks++) {
                const points cloud = lattice(k->d, 5, 4, 4, SPACING);
                pd_body_options options = options_of_kind(k, 2.4);
                options.critical_stretch = breaks ? 1.5 : 0;
                sample s = sample_of(&cloud, &options, NULL);
                body_map(s.body, &maps[m]);
                set_velocities(&s, ripples, &speeds[v]);
                for (int n = 0; n < 3; n++) {
                    const pd_code code = trapped_step(&s, 1, 0.5 * n);
                    assert_true(code == PD_OK || (code == PD_INVERTED && !breaks));
                    assert_finite(&s);
                }
                sample_free(&s);
            }
}

static void no_trap_under_violence(void **state)
{
    for_every_kind(check_violence);
}

/* Two points in one place, from the start or later, in a body that is sound. */
static void check_meeting_points(const kind *k)
{
    for (int later = 0; later < 2; later++) {
        points cloud = lattice(k->d, 7, 7, 7, SPACING);
        if (!later)
            memcpy(cloud.X, cloud.X + 3, 3 * sizeof *cloud.X);
        const pd_body_options options = options_of_kind(k, 3.015);
        sample s = sample_of(&cloud, &options, NULL);
        const pd_local p = place_of(s.body, 0), q = place_of(s.body, 1);
        if (later)
            memcpy(s.view.y + p * k->d, s.view.y + q * k->d,
                   (size_t)k->d * sizeof *s.view.y);
        const double speed = 0.01 * SPACING;
        set_velocities(&s, ripples, &speed);
        s.view.v[p * k->d] += speed;
        for (int n = 0; n < 2; n++)
            assert_int_equal(trapped_step(&s, 1, 0.5), PD_OK);
        assert_finite(&s);
        sample_free(&s);
    }
}

static void no_trap_where_two_points_meet(void **state)
{
    for_every_kind(check_meeting_points);
}

/* One point is torn out: it bears no stress, alone, and the others go on. */
static void check_torn_point(const kind *k)
{
    const points cloud = lattice(k->d, 5, 5, 5, SPACING);
    pd_body_options options = options_of_kind(k, 2.4);
    options.critical_stretch = 1.5;
    sample s = sample_of(&cloud, &options, NULL);
    const pd_local torn = place_of(s.body, (pd_global)(cloud.n / 2));
    const double far[] = {3, 1e6, 1e59};
    const affine flows = some_flow(k->d);
    for (size_t f = 0; f < sizeof far / sizeof *far; f++) {
        s.view.y[torn * k->d] = far[f];
        set_velocities(&s, flow, &flows);
        s.view.v[torn * k->d] = 1;
        assert_int_equal(trapped_step(&s, 0.01, 0.5), PD_OK);
        assert_finite(&s);
        assert_int_equal(pd_body_summary(s.body).singular, 1);
        assert_near(largest(s.view.force + torn * k->d, (size_t)k->d), 0, 0);
        assert_near(s.view.J[torn], 1, 0);
    }
    sample_free(&s);
}

static void torn_out_point_bears_no_stress(void **state)
{
    for_every_kind(check_torn_point);
}

static void inverted_point_is_an_error_without_damage(void **state)
{
    const kind k = {2, 1, true};
    const points cloud = lattice(2, 5, 5, 1, SPACING);
    const pd_body_options options = options_of_kind(&k, 2.4);
    sample s = sample_of(&cloud, &options, NULL);
    const affine crush = {{-3, 0, 0, 0, 0, 0, 0, 0, 0}, {0}};
    set_velocities(&s, flow, &crush);
    assert_ok(pd_body_forces(s.body));
    assert_ok(pd_body_advance(s.body, 1, 0.5));
    assert_int_equal(pd_body_forces(s.body).code, PD_INVERTED);
    assert_int_equal(pd_body_summary(s.body).inverted, 25);
    sample_free(&s);
}

/* ---- options ---- */

static pd_code create(const pd_body_options *options)
{
    points cloud = lattice(2, 8, 6, 1, SPACING);
    pd_body *body;
    const pd_code code = pd_body_create(MPI_COMM_NULL, options, cloud.n, cloud.X,
                                        cloud.volume, NULL, NULL, &body)
                             .code;
    pd_body_destroy(body);
    points_free(&cloud);
    return code;
}

static void bad_options_are_refused(void **state)
{
    const kind k = {2, 2, true};
    const double orders[] = {0, 4, 1.5, -1, NAN};
    for (size_t n = 0; n < sizeof orders / sizeof *orders; n++) {
        pd_body_options options = options_of_kind(&k, 3.015);
        options.formulation_parameters[0] = orders[n];
        assert_int_equal(create(&options), PD_BAD_ARGUMENT);
    }
    pd_body_options options = options_of_kind(&k, 3.015);
    assert_int_equal(create(&options), PD_OK);
    options.plane = PD_PLANE_STRESS; /* this material has none */
    assert_int_equal(create(&options), PD_BAD_ARGUMENT);
    options = options_of_kind(&k, 3.015);
    options.failed_strain = 0.18; /* without plastic strain */
    assert_int_equal(create(&options), PD_BAD_ARGUMENT);
    options = options_of_kind(&k, 3.015);
    options.material = pd_material_find("neoHookean");
    assert_int_equal(create(&options), PD_BAD_ARGUMENT);
    options = options_of_kind(&k, 0.5); /* no bonds */
    assert_int_equal(create(&options), PD_BAD_FAMILY);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gradients_of_polynomials_are_exact),
        cmocka_unit_test(body_agrees_with_reference),
        cmocka_unit_test(power_of_forces_is_the_stress_power),
        cmocka_unit_test(forces_and_couples_sum_to_nothing),
        cmocka_unit_test(forces_and_couples_balance_where_a_point_hangs),
        cmocka_unit_test(forces_and_couples_balance_where_a_point_is_inverted),
        cmocka_unit_test(stiffness_is_symmetric_with_holds),
        cmocka_unit_test(hold_is_where_velocities_vanish),
        cmocka_unit_test(affine_stretch_has_the_stress_of_the_rate_form),
        cmocka_unit_test(interior_of_affine_stretch_is_balanced),
        cmocka_unit_test(turned_body_keeps_its_stress),
        cmocka_unit_test(families_last_under_long_stretch),
        cmocka_unit_test(association_resists_the_checkerboard),
        cmocka_unit_test(senseless_motion_of_bonds_makes_no_stress),
        cmocka_unit_test(frequency_is_bounded),
        cmocka_unit_test(damaged_body_agrees_with_reference),
        cmocka_unit_test(parted_halves_pull_no_more),
        cmocka_unit_test(protected_bonds_are_as_without_damage),
        cmocka_unit_test(one_protected_end_protects_the_bond),
        cmocka_unit_test(energy_release_breaks_bonds),
        cmocka_unit_test(pre_cracks_part_a_body_that_cannot_break),
        cmocka_unit_test(body_that_cannot_break_keeps_no_bond_states),
        cmocka_unit_test(no_trap_under_violence),
        cmocka_unit_test(no_trap_where_two_points_meet),
        cmocka_unit_test(torn_out_point_bears_no_stress),
        cmocka_unit_test(inverted_point_is_an_error_without_damage),
        cmocka_unit_test(bad_options_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
