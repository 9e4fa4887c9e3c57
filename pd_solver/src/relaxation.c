/*
 * Relaxation to equilibrium: quasi-Newton iterations with limited memory, [nocedal1980],
 * in the metric of a fictitious mass (smooth.c) instead of the diagonal one and adaptive
 * damping of [kilic2010]; docs/relaxation.md compares them.
 *
 * An iteration is one evaluation of forces. With the unbalanced forces g (N) the step is
 * p = H g, where H is M^-1 improved by the last pairs (s, q) of displacements and the
 * internal forces that they caused. No search along p is made: the pairs learn from a
 * step too long, and searches cost what they saved. Nor are energies needed, so that
 * every formulation can be relaxed.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "body.h"
#include "smooth.h"
#include "status.h"
#include "step.h"

/* Pairs that are remembered: fewer cost iterations, more cost memory. Other vectors. */
enum { PAIRS = 8, VECTORS = 6 };

/* Share of M^-1 g in the first steps, before a pair says how stiff the body is. */
#define CAUTIOUS 0.2

/* A step after which forces fail is cut this often, each time to SHORTER of it. */
enum { CUTS = 10 };
#define SHORTER 0.25

/* Iterations with failing forces that a jump of prescribed components may take before the
 * failure is passed on; without a jump, in a row. */
enum { MOST_FAILURES = 100 };

/* Share in the residual's reference of what was unbalanced at the start and where
 * prescribed components moved, for bodies that come to rest without load. */
#define REMEMBERED 1e-3

/* Unbalanced forces below this share of those that displacements as large as positions
 * would cause are round-off. */
#define ROUNDING 3e-17

struct pd_relaxation {
    pd_body *body; /* borrowed */
    pd_smooth smooth;
    unsigned char *prescribed; /* [n_moving] that smooth and the pairs are made for */

    /* Vectors [n_moving][d]. */
    size_t size;
    double *store;                /* holds all of them */
    double *internal;             /* forces without loads at y, N */
    double *base, *base_internal; /* y and these where direction was chosen */
    double *direction;            /* m */
    double *motion;               /* what prescribed components lack, m */
    double *work;
    double *moved[PAIRS], *answer[PAIRS]; /* s, m, and q, N; rings */

    double inverse[PAIRS]; /* 1/(s . q) */
    int pairs, latest;
    double scale;      /* of M^-1 in H */
    double length;     /* of the step along direction */
    double stride;     /* share of motion to try next */
    double remembered; /* norm of unbalanced forces, see REMEMBERED, N */
    double noise;      /* norm of forces that round-off causes, N */
    int failures;      /* see MOST_FAILURES */
    bool started;
};

/* ---- creation ---- */

static double noise_of(const pd_relaxation *r)
{
    const pd_body *b = r->body;
    const size_t d = (size_t)b->options.dimension;
    double farthest = 0, squares = 0;
    for (size_t c = 0; c < r->size; c++) {
        farthest = fmax(farthest, fabs(b->y[c]));
        squares += r->smooth.stiffness[c / d] * r->smooth.stiffness[c / d];
    }
    pd_largest_all(b->comm, &farthest, 1);
    pd_sum_all(b->comm, &squares, 1);
    return ROUNDING * farthest * sqrt(squares);
}

pd_status pd_relaxation_create(pd_body *b, pd_relaxation **relaxation)
{
    *relaxation = NULL;
    if (pd_body_has_history(b))
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "the body has a history; allowed: elastic bodies");
    pd_relaxation *r = calloc(1, sizeof *r);
    const pd_status made = pd_agree(
        b->comm, r ? pd_status_ok() : pd_status_fail(PD_NO_MEMORY, -1, "relaxation"));
    if (made.code != PD_OK) {
        free(r);
        return made;
    }
    const size_t n = (size_t)b->n_moving;
    r->body = b;
    r->size = n * (size_t)b->options.dimension;
    r->prescribed = calloc(n + 1, sizeof *r->prescribed);
    r->store = calloc((VECTORS + 2 * PAIRS) * r->size + 1, sizeof *r->store);
    memset(b->prescribed, 0, n);
    pd_status status = pd_smooth_create(b, &r->smooth);
    if (status.code == PD_OK && !(r->prescribed && r->store))
        status = pd_status_fail(PD_NO_MEMORY, -1, "relaxation of %zu points", n);
    status = pd_agree(b->comm, status);
    if (status.code != PD_OK) {
        pd_relaxation_destroy(r);
        return status;
    }
    double **const arrays[] = {&r->internal,  &r->base,   &r->base_internal,
                               &r->direction, &r->motion, &r->work};
    for (size_t k = 0; k < VECTORS; k++)
        *arrays[k] = r->store + k * r->size;
    for (size_t k = 0; k < PAIRS; k++) {
        r->moved[k] = r->store + (VECTORS + 2 * k) * r->size;
        r->answer[k] = r->moved[k] + r->size;
    }
    r->scale = CAUTIOUS;
    r->stride = 1;
    r->noise = noise_of(r);
    memset(b->v, 0, r->size * sizeof *b->v);
    *relaxation = r;
    return pd_status_ok();
}

void pd_relaxation_destroy(pd_relaxation *r)
{
    if (!r)
        return;
    pd_smooth_free(&r->smooth);
    free(r->prescribed);
    free(r->store);
    free(r);
}

/* ---- forces ---- */

static double product(const pd_relaxation *r, const double *a, const double *b)
{
    double sum = 0;
    for (size_t c = 0; c < r->size; c++)
        sum += a[c] * b[c];
    pd_sum_all(r->body->comm, &sum, 1);
    return sum;
}

/* Forces at y, and the part of them that answers deformation. */
static pd_status evaluate(pd_relaxation *r)
{
    pd_body *b = r->body;
    const size_t d = (size_t)b->options.dimension;
    PD_TRY(pd_body_forces(b));
    for (size_t c = 0; c < r->size; c++)
        r->internal[c] = b->volume[c / d] * (b->force[c] - (b->load ? b->load[c] : 0));
    return pd_status_ok();
}

/* g = internal + loads, 0 where prescribed. */
static void unbalanced(const pd_relaxation *r, const double *internal, double *g)
{
    const pd_body *b = r->body;
    const int d = b->options.dimension;
    for (pd_local p = 0; p < b->n_moving; p++)
        for (int a = 0; a < d; a++) {
            const size_t c = (size_t)p * d + a;
            const double load = b->load ? b->volume[p] * b->load[c] : 0;
            g[c] = pd_is_prescribed(b, p, a) ? 0 : internal[c] + load;
        }
}

/* ---- direction ---- */

/* f := H f, by the two loops of [nocedal1980]. */
static void improve(pd_relaxation *r, double *f)
{
    double along[PAIRS];
    for (int i = 0; i < r->pairs; i++) {
        const int k = (r->latest + PAIRS - i) % PAIRS;
        along[k] = product(r, r->moved[k], f) * r->inverse[k];
        for (size_t c = 0; c < r->size; c++)
            f[c] -= along[k] * r->answer[k][c];
    }
    pd_smooth_apply(&r->smooth, f);
    for (size_t c = 0; c < r->size; c++)
        f[c] *= r->scale;
    for (int i = r->pairs - 1; i >= 0; i--) {
        const int k = (r->latest + PAIRS - i) % PAIRS;
        const double change = along[k] - product(r, r->answer[k], f) * r->inverse[k];
        for (size_t c = 0; c < r->size; c++)
            f[c] += change * r->moved[k][c];
    }
}

/* Choose a direction from where the body is, one that the forces push along. */
static void choose(pd_relaxation *r)
{
    memcpy(r->base, r->body->y, r->size * sizeof *r->base);
    memcpy(r->base_internal, r->internal, r->size * sizeof *r->internal);
    unbalanced(r, r->internal, r->work);
    for (;;) {
        memcpy(r->direction, r->work, r->size * sizeof *r->work);
        improve(r, r->direction);
        if (r->pairs == 0 || product(r, r->direction, r->work) > 0)
            break;
        r->pairs = 0;
    }
    r->length = 1;
}

/* Remember the pair of the step that was taken, if the body resisted it. */
static void learn(pd_relaxation *r)
{
    const int next = (r->latest + 1) % PAIRS;
    double *s = r->moved[next], *q = r->answer[next];
    for (size_t c = 0; c < r->size; c++) {
        s[c] = r->length * r->direction[c];
        q[c] = r->base_internal[c] - r->internal[c];
        r->work[c] = q[c];
    }
    pd_smooth_apply(&r->smooth, r->work);
    const double stiffness = product(r, s, q), soft = product(r, r->work, q);
    const double answer = sqrt(product(r, q, q));
    if (!(stiffness > 1e-6 * sqrt(product(r, s, s)) * answer && soft > 0 &&
          answer > 10 * r->noise)) {
        r->pairs -= r->pairs == PAIRS; /* the oldest was written over */
        return;
    }
    r->inverse[next] = 1 / stiffness;
    r->scale = stiffness / soft;
    r->latest = next;
    r->pairs = r->pairs < PAIRS ? r->pairs + 1 : PAIRS;
}

/* ---- an iteration ---- */

/* Take up which components are prescribed. */
static void adopt(pd_relaxation *r)
{
    const pd_body *b = r->body;
    int64_t changed = memcmp(r->prescribed, b->prescribed, (size_t)b->n_moving) != 0;
    pd_count_all(b->comm, &changed, 1);
    if (changed == 0)
        return;
    memcpy(r->prescribed, b->prescribed, (size_t)b->n_moving);
    pd_smooth_fix(&r->smooth);
    r->pairs = 0;
}

/* Do prescribed components move now? By how much, and the free ones with them: into
 * motion. */
static bool drive(pd_relaxation *r, const pd_prescribed *prescribed)
{
    const pd_body *b = r->body;
    const size_t d = (size_t)b->options.dimension;
    int64_t driven = 0;
    memset(r->motion, 0, r->size * sizeof *r->motion);
    for (size_t k = 0; prescribed && k < prescribed->n; k++)
        for (size_t a = 0; a < d; a++)
            if (prescribed->components[k] >> a & 1) {
                const size_t c = (size_t)prescribed->point[k] * d + a;
                r->motion[c] = prescribed->y[k * d + a] - b->y[c];
                driven += r->motion[c] != 0;
            }
    pd_count_all(b->comm, &driven, 1);
    if (driven > 0)
        pd_smooth_extend(&r->smooth, r->motion);
    return driven > 0;
}

/* Is a failure of forces to be met by a shorter step? */
static bool may_shorten(pd_relaxation *r, pd_status status, int cuts)
{
    if (status.code == PD_OK || cuts == CUTS)
        return false;
    if (cuts == 0)
        r->failures++;
    return r->failures <= MOST_FAILURES;
}

/* Move along the direction, less far if forces fail there. */
static pd_status advance(pd_relaxation *r, const pd_prescribed *prescribed)
{
    pd_status status;
    for (int cuts = 0;; cuts++) {
        for (size_t c = 0; c < r->size; c++)
            r->body->y[c] = r->base[c] + r->length * r->direction[c];
        pd_place_prescribed(r->body, prescribed);
        status = evaluate(r);
        if (status.code == PD_OK && cuts == 0)
            r->failures = 0;
        if (!may_shorten(r, status, cuts))
            return status;
        r->length *= SHORTER;
    }
}

/* Move prescribed components, the free ones with them and along the direction; a part of
 * the way where forces fail at its end. Nothing is learnt of the stiffness: forces of the
 * free components change with the prescribed ones too. */
static pd_status follow(pd_relaxation *r, const pd_prescribed *prescribed)
{
    for (int cuts = 0;; cuts++) {
        for (size_t c = 0; c < r->size; c++)
            r->body->y[c] = r->base[c] + r->stride * r->motion[c] +
                            fmin(r->stride, r->length) * r->direction[c];
        if (r->stride == 1)
            pd_place_prescribed(r->body, prescribed);
        const pd_status status = evaluate(r);
        if (!may_shorten(r, status, cuts))
            return status;
        r->stride *= SHORTER;
    }
}

/* See docs/relaxation.md. */
static double residual_of(pd_relaxation *r, bool remember)
{
    const pd_body *b = r->body;
    const int d = b->options.dimension;
    double sums[3] = {0}; /* squares of what is unbalanced, of loads, of reactions */
    for (pd_local p = 0; p < b->n_moving; p++)
        for (int a = 0; a < d; a++) {
            const size_t c = (size_t)p * d + a;
            const double load = b->load ? b->volume[p] * b->load[c] : 0;
            const double force = r->internal[c] + load;
            if (pd_is_prescribed(b, p, a)) {
                sums[2] += force * force;
                continue;
            }
            sums[0] += force * force;
            sums[1] += load * load;
        }
    pd_sum_all(b->comm, sums, 3);
    const double unbalance = sqrt(sums[0]);
    if (remember)
        r->remembered = fmax(r->remembered, unbalance);
    if (unbalance <= r->noise)
        return 0;
    return unbalance / (sqrt(sums[1]) + sqrt(sums[2]) + REMEMBERED * r->remembered);
}

static pd_status start(pd_relaxation *r)
{
    if (r->started)
        return pd_status_ok();
    PD_TRY(evaluate(r));
    residual_of(r, true);
    r->started = true;
    return pd_status_ok();
}

pd_status pd_relaxation_step(pd_relaxation *r, const pd_prescribed *prescribed,
                             double *residual)
{
    PD_TRY(pd_agree(r->body->comm, pd_prescribe(r->body, prescribed)));
    PD_TRY(start(r));
    adopt(r);
    const bool driven = drive(r, prescribed);
    choose(r);
    if (driven) {
        PD_TRY(follow(r, prescribed));
        *residual = fmax(residual_of(r, true), r->stride < 1 ? 1 : 0);
        r->failures = r->stride < 1 ? r->failures : 0;
        r->stride = r->stride < 1. / 3 ? 2 * r->stride / (1 - r->stride) : 1;
    } else {
        PD_TRY(advance(r, prescribed));
        learn(r);
        *residual = residual_of(r, false);
    }
    return pd_status_ok();
}
