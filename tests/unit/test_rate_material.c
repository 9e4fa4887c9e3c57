/*
 * Materials in rate form: rotation, elasticity, J2 flow and its return to the yield
 * surface, in plane strain, plane stress and space.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _GNU_SOURCE /* feenableexcept */
#include <fenv.h>

#include "lattice.h"

/* Rounding of some dozen operations, relative to the largest stress on the way. */
#define ROUNDING 1e-14

/* Steel, GPa: E, nu, yieldStress, hardening. linearElastic takes the first two. */
static const double steel[PD_MAX_PARAMETERS] = {200, 0.29, 0.4, 0.1};
enum { YOUNG, POISSON, YIELD, HARDENING };

/* ---- specimens ---- */

typedef struct {
    const pd_material *material;
    int d;
    pd_plane plane;
    const double *parameters;

    double sigma[PD_SYMMETRIC], plastic;
} specimen;

static specimen specimen_of(const char *material, int d, pd_plane plane)
{
    return (specimen){.material = pd_material_find(material),
                      .d = d,
                      .plane = plane,
                      .parameters = steel};
}

static void for_every_plane(const char *material, void (*check)(specimen))
{
    check(specimen_of(material, 2, PD_PLANE_STRAIN));
    check(specimen_of(material, 2, PD_PLANE_STRESS));
    check(specimen_of(material, 3, PD_PLANE_STRAIN));
}

static void for_every_specimen(void (*check)(specimen))
{
    for (const pd_material *const *m = pd_materials; *m; m++)
        if ((*m)->update[PD_PLANE_STRAIN])
            for_every_plane((*m)->name, check);
}

/* A step by G[3][3], of which a plane takes its part. */
static void step(specimen *s, const double *G)
{
    const double plane[4] = {G[0], G[1], G[3], G[4]};
    s->material->update[s->plane](s->parameters, s->d, 1, s->d == 2 ? plane : G, s->sigma,
                                  s->material->is_plastic ? &s->plastic : NULL);
}

static void stretch(specimen *s, double e11, double e22, double e33)
{
    const double G[9] = {e11, 0, 0, 0, e22, 0, 0, 0, e33};
    step(s, G);
}

/* Numbers in [-size, size], one sequence. */
static void random_gradient(uint32_t *seed, double size, double *G)
{
    for (int c = 0; c < 9; c++)
        G[c] = size * next_random(seed);
}

static double von_mises(const double *s)
{
    const double a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
    return sqrt((a * a + b * b + c * c) / 2 +
                3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

static double yield_stress(const specimen *s)
{
    return s->parameters[YIELD] + s->parameters[HARDENING] * s->plastic;
}

static void assert_same_stress(const double *sigma, const double *expected,
                               double tolerance)
{
    for (int c = 0; c < PD_SYMMETRIC; c++)
        assert_near(sigma[c], expected[c], tolerance);
}

/* ---- rotation ---- */

static const int place[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};

/* A sound stress of the plane or of space, below yield. */
static void prestress(specimen *s)
{
    const double sigma[PD_SYMMETRIC] = {0.1, -0.05, 0.03, 0.07, -0.02, 0.04};
    memcpy(s->sigma, sigma, sizeof sigma);
    if (s->d == 2)
        s->sigma[4] = s->sigma[5] = 0;
    if (s->plane == PD_PLANE_STRESS)
        s->sigma[2] = 0;
}

static void turned(int d, double angle, const double *sigma, double *result)
{
    const affine Q = rotation(d, angle);
    for (int r = 0; r < 3; r++)
        for (int c = r; c < 3; c++) {
            double sum = 0;
            for (int k = 0; k < 3; k++)
                for (int l = 0; l < 3; l++)
                    sum += Q.A[3 * r + k] * sigma[place[k][l]] * Q.A[3 * c + l];
            result[place[r][c]] = sum;
        }
}

/* y goes from R(0) to R(angle): the displacement's gradient in the middle is
 * 2 tan(angle/2) times the cross product with the axis, the skew part of R/sin(angle). */
static void rotation_gradient(int d, double angle, double *G)
{
    const affine Q = rotation(d, angle);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            G[3 * r + c] =
                tan(angle / 2) * (Q.A[3 * r + c] - Q.A[3 * c + r]) / sin(angle);
}

static void check_rotation(specimen s)
{
    prestress(&s);
    double expected[PD_SYMMETRIC], G[9];
    const double quarter = acos(0);
    turned(s.d, quarter, s.sigma, expected);
    rotation_gradient(s.d, quarter / 4, G);
    for (int k = 0; k < 4; k++)
        step(&s, G);
    assert_same_stress(s.sigma, expected, ROUNDING);
    assert_near(s.plastic, 0, 0);
}

static void stress_turns_with_the_body(void **state)
{
    for_every_specimen(check_rotation);
}

/* A step of -G undoes that of G: the rule is symmetric in time while elastic. */
static void check_return(specimen s)
{
    prestress(&s);
    const specimen before = s;
    const double G[9] = {0, 0.8, -0.3, -0.8, 0, 0.5, 0.3, -0.5, 1e-5};
    double back[9];
    for (int c = 0; c < 9; c++)
        back[c] = -G[c];
    step(&s, G);
    step(&s, back);
    assert_same_stress(s.sigma, before.sigma, ROUNDING);
}

static void elastic_steps_can_be_undone(void **state)
{
    for_every_specimen(check_return);
}

/* ---- elasticity ---- */

/* Strains below yield, from rest, in one step: Hooke's law with the moduli at rest. */
static void check_hooke(specimen s)
{
    const double e[3][3] = {
        {3e-4, 1e-4, -2e-4}, {1e-4, -1e-4, 5e-5}, {-2e-4, 5e-5, 2e-4}};
    double G[9], K, mu, expected[PD_SYMMETRIC] = {0};
    for (int c = 0; c < 9; c++)
        G[c] = e[c / 3][c % 3];
    s.material->moduli(s.parameters, s.d, s.plane, &K, &mu);
    const double lambda = K - 2. / 3 * mu, in_plane = e[0][0] + e[1][1];
    const double e33 = s.d == 3 ? e[2][2]
                       : s.plane == PD_PLANE_STRESS
                           ? -lambda / (lambda + 2 * mu) * in_plane
                           : 0;
    for (int r = 0; r < 3; r++)
        for (int c = r; c < 3; c++)
            if (s.d == 3 || c < 2)
                expected[place[r][c]] =
                    2 * mu * e[r][c] + (r == c) * lambda * (in_plane + e33);
    expected[2] = 2 * mu * e33 + lambda * (in_plane + e33);
    step(&s, G);
    assert_same_stress(s.sigma, expected, ROUNDING);
    assert_near(s.plastic, 0, 0);
}

static void small_strains_meet_the_moduli(void **state)
{
    for_every_specimen(check_hooke);
}

static void check_stillness(specimen s)
{
    prestress(&s);
    const specimen before = s;
    const double none[9] = {0};
    for (int k = 0; k < 100; k++)
        step(&s, none);
    assert_same_stress(s.sigma, before.sigma, 0);
}

static void nothing_changes_without_motion(void **state)
{
    for_every_specimen(check_stillness);
}

static void check_batch(specimen s)
{
    enum { N = 7 };
    const size_t dd = (size_t)(s.d * s.d);
    double G[N * 9], sigma[N * PD_SYMMETRIC], plastic[N] = {0};
    specimen alone[N];
    uint32_t seed = 5;
    prestress(&s);
    for (size_t p = 0; p < N; p++) { /* every other one flows */
        double whole[9];
        random_gradient(&seed, p % 2 ? 1e-4 : 1e-2, whole);
        for (size_t c = 0; c < dd; c++)
            G[p * dd + c] = s.d == 3 ? whole[c] : whole[c / 2 * 3 + c % 2];
        memcpy(sigma + p * PD_SYMMETRIC, s.sigma, sizeof s.sigma);
        alone[p] = s;
        step(&alone[p], whole);
    }
    s.material->update[s.plane](s.parameters, s.d, N, G, sigma,
                                s.material->is_plastic ? plastic : NULL);
    for (size_t p = 0; p < N; p++) { /* the same operations */
        assert_same_stress(sigma + p * PD_SYMMETRIC, alone[p].sigma, 0);
        assert_near(plastic[p], alone[p].plastic, 0);
    }
}

static void many_points_move_as_one_by_one(void **state)
{
    for_every_specimen(check_batch);
}

/* ---- yield ---- */

/* Load beyond yield in one step, then hold. The first hold may still take back the
 * round-off of the load; after it nothing moves at all. */
static void check_hold(specimen s)
{
    const double load[9] = {0.02, 0.004, 0, 0.003, -0.005, 0, 0, 0, 0}, none[9] = {0};
    step(&s, load);
    assert_true(s.plastic > 0.01);
    assert_near(von_mises(s.sigma), yield_stress(&s), 1e-14);
    specimen before = s;
    step(&s, none);
    assert_same_stress(s.sigma, before.sigma, 1e-15);
    before = s;
    for (int k = 0; k < 1000; k++)
        step(&s, none);
    assert_same_stress(s.sigma, before.sigma, 0);
    assert_near(s.plastic, before.plastic, 0);
}

static void held_strain_keeps_stress_on_the_yield_surface(void **state)
{
    for_every_plane("J2", check_hold);
}

/* Steps of 1e-4 to 0.3: at most on the surface, and on it after flow. Pressures of up to
 * hundreds of yield stresses round to 1e-14 of themselves. */
static void check_consistency(specimen s)
{
    uint32_t seed = 3;
    for (int k = 0; k < 2000; k++) {
        const specimen before = s;
        double G[9];
        random_gradient(&seed, k % 3 ? 1e-3 : 0.1, G);
        const double mean = (G[0] + G[4] + G[8]) / 3;
        for (int c = 0; c < 9; c += 4)
            G[c] -= s.plane == PD_PLANE_STRESS ? 0 : 0.99 * mean;
        step(&s, G);
        const double over = von_mises(s.sigma) - yield_stress(&s);
        assert_true(over <= 1e-12 * yield_stress(&s));
        assert_true(s.plastic >= before.plastic);
        if (s.plastic > before.plastic)
            assert_near(over, 0, 1e-12 * yield_stress(&s));
        if (s.plane == PD_PLANE_STRESS)
            assert_near(s.sigma[2], 0, 0);
        if (s.d == 2)
            assert_true(s.sigma[4] == 0 && s.sigma[5] == 0);
    }
    assert_true(s.plastic > 1);
}

static void flow_ends_on_the_yield_surface(void **state)
{
    for_every_plane("J2", check_consistency);
}

/* Twenty times the yield stress as pressure shifts sigma alone. */
static void pressure_does_not_matter(void **state)
{
    specimen free = specimen_of("J2", 3, PD_PLANE_STRAIN), deep = free;
    const double pressure = 8;
    deep.sigma[0] = deep.sigma[1] = deep.sigma[2] = -pressure;
    uint32_t seed = 9;
    for (int k = 0; k < 20; k++) {
        double G[9];
        random_gradient(&seed, 0.01, G);
        step(&free, G);
        step(&deep, G);
    }
    for (int c = 0; c < 3; c++)
        deep.sigma[c] += pressure;
    assert_true(free.plastic > 0.01);
    assert_same_stress(deep.sigma, free.sigma, 20 * ROUNDING * pressure);
    assert_near(deep.plastic, free.plastic, 20 * ROUNDING * pressure);
}

static void pressure_does_not_make_metal_flow(void **state)
{
    specimen s = specimen_of("J2", 3, PD_PLANE_STRAIN);
    stretch(&s, 0.3, 0.3, 0.3);
    assert_near(s.plastic, 0, 0);
    assert_near(s.sigma[0], steel[YOUNG] / (1 - 2 * steel[POISSON]) * 0.3, 1e-12);
}

/* ---- closed forms ---- */

/* Uniaxial tension by hand: one dimension, linear hardening. */
typedef struct {
    double sigma, plastic;
} bar;

/* Strain along a bar; returns what its sides then do. */
static double pull(bar *b, double strain)
{
    const bar before = *b;
    const double E = steel[YOUNG], H = steel[HARDENING];
    const double trial = b->sigma + E * strain;
    const double over = fabs(trial) - (steel[YIELD] + H * b->plastic);
    double flow = over > 0 ? over / (E + H) : 0;
    b->plastic += flow;
    flow = copysign(flow, trial);
    b->sigma = trial - E * flow;
    return -steel[POISSON] * (b->sigma - before.sigma) / E - 0.5 * flow;
}

static void assert_uniaxial(const specimen *s, const bar *b)
{
    const double expected[PD_SYMMETRIC] = {b->sigma};
    /* Sides are given their strain: 1e-16 of E 0.01, over some dozen steps. */
    assert_same_stress(s->sigma, expected, 1e-13);
    assert_near(s->plastic, b->plastic, 1e-14);
}

static void uniaxial(specimen s, const double *strains, int n)
{
    bar b = {0};
    for (int k = 0; k < n; k++) {
        const double sides = pull(&b, strains[k]);
        stretch(&s, strains[k], sides, sides);
        assert_uniaxial(&s, &b);
    }
}

/* Through yield within a step, then on, as in one step; sigma = Y + E H/(E + H) (strain -
 * Y/E). */
static void check_tension(specimen s)
{
    const double E = steel[YOUNG], H = steel[HARDENING], Y = steel[YIELD];
    const double strains[] = {0.001, 0.005, 0.004};
    uniaxial(s, strains, 3);
    bar b = {0};
    const double sides = pull(&b, 0.01);
    stretch(&s, 0.01, sides, sides);
    assert_uniaxial(&s, &b);
    assert_near(s.sigma[0], Y + E * H / (E + H) * (0.01 - Y / E), 1e-13);
}

static void tension_has_its_closed_form(void **state)
{
    check_tension(specimen_of("J2", 2, PD_PLANE_STRESS));
    check_tension(specimen_of("J2", 3, PD_PLANE_STRAIN));
}

/* Down by less than twice the yield stress: slope E, no flow. */
static void check_unloading(specimen s)
{
    bar b = {0};
    const double sides = pull(&b, 0.02), nu = steel[POISSON];
    stretch(&s, 0.02, sides, sides);
    const specimen loaded = s;
    for (int k = 0; k < 10; k++)
        stretch(&s, -3e-4, nu * 3e-4, nu * 3e-4);
    assert_near(s.sigma[0], loaded.sigma[0] - steel[YOUNG] * 3e-3, 1e-13);
    assert_near(s.plastic, loaded.plastic, 0);
}

static void unloading_is_elastic(void **state)
{
    check_unloading(specimen_of("J2", 2, PD_PLANE_STRESS));
    check_unloading(specimen_of("J2", 3, PD_PLANE_STRAIN));
}

static void cycles_harden_both_ways(void **state)
{
    const double cycles[] = {0.01, -0.02, 0.02, -0.003, 0.003, -0.02, 0.02, -0.02, 0.01};
    uniaxial(specimen_of("J2", 2, PD_PLANE_STRESS), cycles, 9);
    uniaxial(specimen_of("J2", 3, PD_PLANE_STRAIN), cycles, 9);
}

/* Pure shear, everywhere the same: tau = sigma_Y/3^(1/2), gamma = tau/mu + 3^(1/2)
 * plastic, hence with the slope mu H/(3 mu + H). */
static void check_shear(specimen s)
{
    const double mu = steel[YOUNG] / (2 * (1 + steel[POISSON])), H = steel[HARDENING];
    const double first = steel[YIELD] / sqrt(3) / mu, gamma = 0.03;
    const double G[9] = {0, gamma / 4, 0, gamma / 4, 0, 0, 0, 0, 0};
    step(&s, G);
    step(&s, G);
    const double tau = steel[YIELD] / sqrt(3) + mu * H / (3 * mu + H) * (gamma - first);
    const double expected[PD_SYMMETRIC] = {0, 0, 0, tau};
    assert_same_stress(s.sigma, expected, ROUNDING);
    assert_near(s.plastic, (gamma - tau / mu) / sqrt(3), ROUNDING);
}

static void shear_has_its_closed_form(void **state)
{
    for_every_plane("J2", check_shear);
}

/* ---- planes against space ---- */

/* Any path; steps of some yield strains and spins of 0.01. */
static void plane_gradient(uint32_t *seed, double *G)
{
    random_gradient(seed, 0.01, G);
    G[2] = G[5] = G[6] = G[7] = G[8] = 0;
}

static void check_plane_strain(const char *material)
{
    specimen plane = specimen_of(material, 2, PD_PLANE_STRAIN);
    specimen space = specimen_of(material, 3, PD_PLANE_STRAIN);
    uint32_t seed = 21;
    for (int k = 0; k < 50; k++) {
        double G[9];
        plane_gradient(&seed, G);
        step(&plane, G);
        step(&space, G);
        assert_same_stress(plane.sigma, space.sigma, 1e-12); /* up to 10, 50 steps */
        assert_near(plane.plastic, space.plastic, 1e-13);
    }
}

static void plane_strain_is_space_without_strain_across(void **state)
{
    check_plane_strain("linearElastic");
    check_plane_strain("J2");
}

/* The strain across that leaves no stress there, by halves. */
static double strain_across(const specimen *space, const double *G)
{
    double low = -0.1, high = 0.1;
    for (int k = 0; k < 60; k++) {
        const double middle = 0.5 * (low + high);
        double tried[9];
        specimen s = *space;
        memcpy(tried, G, sizeof tried);
        tried[8] = middle;
        step(&s, tried);
        if (s.sigma[2] > 0)
            high = middle;
        else
            low = middle;
    }
    return 0.5 * (low + high);
}

static void check_plane_stress(const char *material)
{
    specimen plane = specimen_of(material, 2, PD_PLANE_STRESS);
    specimen space = specimen_of(material, 3, PD_PLANE_STRAIN);
    uint32_t seed = 22;
    for (int k = 0; k < 50; k++) {
        double G[9];
        plane_gradient(&seed, G);
        step(&plane, G);
        G[8] = strain_across(&space, G);
        step(&space, G);
        assert_same_stress(plane.sigma, space.sigma, 1e-12); /* E 1e-17 a halving */
        assert_near(plane.plastic, space.plastic, 1e-13);
        memcpy(space.sigma, plane.sigma, sizeof plane.sigma);
    }
}

static void plane_stress_is_space_without_stress_across(void **state)
{
    check_plane_stress("linearElastic");
    check_plane_stress("J2");
}

/* ---- against the rate equations ---- */

/* Eqs B.1-B.8 at velocity gradient L, flowing or not: rates of sigma and plastic. */
static void rates(bool flows, const double *L, const double *sigma, double *rate,
                  double *plastic_rate)
{
    const double mu = steel[YOUNG] / (2 * (1 + steel[POISSON]));
    const double lambda = 2 * mu * steel[POISSON] / (1 - 2 * steel[POISSON]);
    const double q = von_mises(sigma), p = (sigma[0] + sigma[1] + sigma[2]) / 3;
    double D[3][3], W[3][3], N[3][3], s[3][3], power = 0;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            D[r][c] = 0.5 * (L[3 * r + c] + L[3 * c + r]);
            W[r][c] = 0.5 * (L[3 * r + c] - L[3 * c + r]);
            s[r][c] = sigma[place[r][c]];
            N[r][c] = flows ? 1.5 * (s[r][c] - (r == c) * p) / q : 0;
            power += N[r][c] * 2 * mu * D[r][c];
        }
    *plastic_rate = power / (steel[HARDENING] + 3 * mu);
    for (int r = 0; r < 3; r++)
        for (int c = r; c < 3; c++) {
            double *out = &rate[place[r][c]];
            *out = 2 * mu * (D[r][c] - *plastic_rate * N[r][c]) +
                   (r == c) * lambda * (D[0][0] + D[1][1] + D[2][2]);
            for (int k = 0; k < 3; k++)
                *out += W[r][k] * s[k][c] - s[r][k] * W[k][c];
        }
}

/* The same in the specimen's plane: D33 is that of no stress rate across, which depends
 * on it linearly. */
static void rates_in(const specimen *s, const double *G, const double *sigma,
                     double *rate, double *plastic_rate)
{
    const bool flows = s->material->is_plastic;
    double L[9] = {G[0], G[1], 0, G[3], G[4], 0, 0, 0, 0};
    if (s->d == 3)
        memcpy(L, G, sizeof L);
    rates(flows, L, sigma, rate, plastic_rate);
    if (s->plane != PD_PLANE_STRESS)
        return;
    const double none = rate[2];
    L[8] = 1;
    rates(flows, L, sigma, rate, plastic_rate);
    L[8] = -none / (rate[2] - none);
    rates(flows, L, sigma, rate, plastic_rate);
}

/* Runge and Kutta's fourth order over unit time. */
static void integrate(specimen *s, const double *L, int n)
{
    const double at[4] = {0, 0.5, 0.5, 1}, weight[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};
    for (int k = 0; k < n; k++) {
        double rate[PD_SYMMETRIC] = {0}, plastic_rate = 0;
        const specimen start = *s;
        for (int stage = 0; stage < 4; stage++) {
            double sigma[PD_SYMMETRIC];
            for (int c = 0; c < PD_SYMMETRIC; c++)
                sigma[c] = start.sigma[c] + at[stage] / n * rate[c];
            rates_in(s, L, sigma, rate, &plastic_rate);
            for (int c = 0; c < PD_SYMMETRIC; c++)
                s->sigma[c] += weight[stage] / n * rate[c];
            s->plastic += weight[stage] / n * plastic_rate;
        }
    }
}

/* Largest error in stress after unit time in n steps. */
static double error_of(specimen s, const double *L, int n, const specimen *exact)
{
    double G[9], difference[PD_SYMMETRIC];
    for (int c = 0; c < 9; c++)
        G[c] = L[c] / n;
    for (int k = 0; k < n; k++)
        step(&s, G);
    for (int c = 0; c < PD_SYMMETRIC; c++)
        difference[c] = s.sigma[c] - exact->sigma[c];
    return largest(difference, PD_SYMMETRIC);
}

/* Sheared to yield and beyond, then stretched and turned in a steady flow. Midpoint rule:
 * second order while elastic; the return is implicit: first order. */
static void check_order(specimen s)
{
    const double size = s.material->is_plastic ? 1 : 0.1;
    const double shear[9] = {0, 4e-3, 0, 4e-3, 0, 0, 0, 0, 0};
    const double L[9] = {6e-3 * size, 0.5, 2e-3 * size, -0.5,       -1e-3 * size,
                         0.2,         0,   -0.2,        1e-3 * size};
    step(&s, shear);
    specimen exact = s;
    integrate(&exact, L, 4000);
    const double coarse = error_of(s, L, 100, &exact), fine = error_of(s, L, 200, &exact);
    const double order = s.material->is_plastic ? 1 : 2;
    assert_near(log2(coarse / fine), order, 0.1);
    assert_true(fine < (s.material->is_plastic ? 2e-3 : 1e-5));
}

static void errors_shrink_with_the_step_as_expected(void **state)
{
    for_every_specimen(check_order);
}

/* ---- where traps are on, as in OpenFOAM ---- */

enum { TRAPS = FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW };

static void step_with_traps(specimen *s, const double *G)
{
    feclearexcept(TRAPS);
    feenableexcept(TRAPS);
    step(s, G);
    fedisableexcept(TRAPS);
    assert_true(isfinite(largest(s->sigma, PD_SYMMETRIC)) && isfinite(s->plastic));
}

static void check_extremes(specimen s)
{
    const double metals[][PD_MAX_PARAMETERS] = {
        {200, 0.29, 0.4, 0.1},   {200, 0.4999999, 0.4, 0}, {200, -0.999, 0.4, 0},
        {1e-20, 0.3, 1e20, 0},   {1e20, 0.3, 1e-20, 0},    {1, 0.3, 1, 1e30},
        {1e30, 0.49, 1e-30, 0.1}};
    const double sizes[] = {0, 1e-320, 1e-160, 1e-15, 1, 1e10, 1e40};
    uint32_t seed = 11;
    for (size_t m = 0; m < sizeof metals / sizeof *metals; m++)
        for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
            double G[9];
            specimen fresh = s;
            fresh.parameters = metals[m];
            for (int n = 0; n < 3; n++) { /* the second and third from a stress */
                random_gradient(&seed, sizes[k], G);
                step_with_traps(&fresh, G);
            }
            stretch(&s, sizes[k], 0, 0); /* along one axis alone */
            step_with_traps(&fresh, G);
        }
}

static void no_trap_at_any_step(void **state)
{
    for_every_specimen(check_extremes);
}

/* However far beyond yield, and whatever the metal. */
static void check_far_beyond_yield(specimen s)
{
    const double nus[] = {-0.99, 0, 0.3, 0.4999};
    for (size_t k = 0; k < 4; k++)
        for (double size = 1e-2; size < 1e9; size *= 10)
            for (int h = 0; h < 3; h++) {
                const double H[] = {0, 1, 1e6};
                const double metal[PD_MAX_PARAMETERS] = {200, nus[k], 0.4, H[h]};
                const double G[9] = {size, 0.3 * size, 0, 0.3 * size, -0.4 * size,
                                     0,    0,          0, -0.1 * size};
                specimen fresh = s;
                fresh.parameters = metal;
                step(&fresh, G);
                const double limit = yield_stress(&fresh);
                /* The pressure, up to 1e4 E size at nu 0.4999, rounds. */
                const double pressure =
                    s.plane == PD_PLANE_STRESS ? 0 : largest(fresh.sigma, 3);
                assert_near(von_mises(fresh.sigma), limit,
                            1e-13 * limit + 1e-15 * pressure);
            }
}

static void flow_ends_on_the_yield_surface_from_anywhere(void **state)
{
    for_every_plane("J2", check_far_beyond_yield);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(stress_turns_with_the_body),
        cmocka_unit_test(elastic_steps_can_be_undone),
        cmocka_unit_test(small_strains_meet_the_moduli),
        cmocka_unit_test(nothing_changes_without_motion),
        cmocka_unit_test(many_points_move_as_one_by_one),
        cmocka_unit_test(held_strain_keeps_stress_on_the_yield_surface),
        cmocka_unit_test(flow_ends_on_the_yield_surface),
        cmocka_unit_test(flow_ends_on_the_yield_surface_from_anywhere),
        cmocka_unit_test(pressure_does_not_matter),
        cmocka_unit_test(pressure_does_not_make_metal_flow),
        cmocka_unit_test(tension_has_its_closed_form),
        cmocka_unit_test(unloading_is_elastic),
        cmocka_unit_test(cycles_harden_both_ways),
        cmocka_unit_test(shear_has_its_closed_form),
        cmocka_unit_test(plane_strain_is_space_without_strain_across),
        cmocka_unit_test(plane_stress_is_space_without_stress_across),
        cmocka_unit_test(errors_shrink_with_the_step_as_expected),
        cmocka_unit_test(no_trap_at_any_step),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
