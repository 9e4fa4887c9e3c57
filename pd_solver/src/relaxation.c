/*
 * Dynamic relaxation, [kilic2010].
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "body.h"
#include "status.h"
#include "step.h"

struct pd_relaxation {
    pd_body *body;   /* borrowed */
    double *mass;    /* [n_moving] fictitious density for steps of 1 */
    double *before;  /* [n_moving][d] forces of the last iteration */
    double damping;  /* c of the next iteration, 1 per step */
    double stiffest; /* factor on mass, which grows with the stiffness found */
    double largest_unbalance;
    bool started;
    bool jumped; /* prescribed points moved in this iteration */
};

pd_status pd_relaxation_create(pd_body *b, pd_relaxation **relaxation)
{
    *relaxation = NULL;
    if (pd_body_has_history(b))
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "relaxation of a body whose material has a history");
    const size_t n = (size_t)b->n_moving, d = (size_t)b->options.dimension;
    pd_relaxation *r = calloc(1, sizeof *r);
    if (!r)
        return pd_status_fail(PD_NO_MEMORY, -1, "relaxation");
    r->body = b;
    r->mass = malloc((n + 1) * sizeof *r->mass);
    r->before = calloc(n * d + 1, sizeof *r->before);
    if (!r->mass || !r->before) {
        pd_relaxation_destroy(r);
        return pd_status_fail(PD_NO_MEMORY, -1, "relaxation of %zu points", n);
    }
    b->options.formulation->frequency(b, r->mass);
    for (size_t p = 0; p < n; p++)
        r->mass[p] *= b->options.density / 4;
    r->stiffest = 1.1;
    memset(b->v, 0, n * d * sizeof *b->v);
    *relaxation = r;
    return pd_status_ok();
}

void pd_relaxation_destroy(pd_relaxation *r)
{
    if (!r)
        return;
    pd_body *b = r->body;
    memset(b->v, 0, (size_t)b->n_moving * (size_t)b->options.dimension * sizeof *b->v);
    free(r->mass);
    free(r->before);
    free(r);
}

static void move(pd_relaxation *r, const pd_prescribed *prescribed)
{
    pd_body *b = r->body;
    const int d = b->options.dimension;
    const double keep = (2 - r->damping) / (2 + r->damping);
    for (pd_local p = 0; p < b->n_moving; p++)
        for (int a = 0; a < d; a++) {
            const size_t c = (size_t)p * d + a;
            b->v[c] = keep * b->v[c] +
                      2 / (2 + r->damping) * b->force[c] / (r->stiffest * r->mass[p]);
        }
    pd_prescribed_velocities(b, 1, prescribed);
    r->jumped = false;
    for (pd_local p = 0; p < b->n_moving; p++)
        for (int a = 0; a < d; a++)
            if (pd_is_prescribed(b, p, a) && b->v[(size_t)p * d + a] != 0)
                r->jumped = true;
    pd_drift(b, 1, prescribed);
}

static pd_status forces(pd_body *b)
{
    const size_t n = (size_t)b->n_moving * (size_t)b->options.dimension;
    PD_TRY(pd_body_forces(b));
    for (size_t c = 0; c < n; c++)
        b->force[c] += b->options.damping * b->v[c]; /* that of v, which is fictitious */
    return pd_status_ok();
}

static void adapt(pd_relaxation *r)
{
    const pd_body *b = r->body;
    const int d = b->options.dimension;
    double stiffness = 0, inertia = 0, power = 0;
    for (pd_local p = 0; p < b->n_moving; p++)
        for (int a = 0; a < d; a++) {
            const size_t c = (size_t)p * d + a;
            if (pd_is_prescribed(b, p, a))
                continue;
            stiffness += b->volume[p] * b->v[c] * (r->before[c] - b->force[c]);
            inertia += b->volume[p] * b->v[c] * b->v[c] * r->stiffest * r->mass[p];
            power += b->volume[p] * b->v[c] * b->force[c];
        }
    const double square = inertia > 0 ? stiffness / inertia : 0;
    if (square > 3.2) {
        r->stiffest *= fmax(1.5, square / 3);
        memset(b->v, 0, (size_t)b->n_moving * (size_t)d * sizeof *b->v);
    }
    r->damping = 2 * sqrt(fmin(fmax(square, 0), 0.9));
}

static double residual_of(pd_relaxation *r)
{
    const pd_body *b = r->body;
    const int d = b->options.dimension;
    double unbalance = 0, loads = 0, reactions = 0;
    for (pd_local p = 0; p < b->n_moving; p++)
        for (int a = 0; a < d; a++) {
            const size_t c = (size_t)p * d + a;
            const double force = b->volume[p] * b->force[c];
            if (pd_is_prescribed(b, p, a)) {
                reactions += force * force;
                continue;
            }
            const double load = b->load ? b->volume[p] * b->load[c] : 0;
            unbalance += force * force;
            loads += load * load;
        }
    unbalance = sqrt(unbalance);
    r->largest_unbalance = fmax(r->largest_unbalance, unbalance);
    const double all = sqrt(loads) + sqrt(reactions) + 1e-3 * r->largest_unbalance;
    return all > 0 ? unbalance / all : 0;
}

pd_status pd_relaxation_step(pd_relaxation *r, const pd_prescribed *prescribed,
                             double *residual)
{
    pd_body *b = r->body;
    const size_t n = (size_t)b->n_moving * (size_t)b->options.dimension;
    PD_TRY(pd_prescribe(b, prescribed));
    if (!r->started)
        PD_TRY(forces(b));
    r->started = true;
    move(r, prescribed);
    memcpy(r->before, b->force, n * sizeof *r->before);
    PD_TRY(forces(b));
    if (!r->jumped) /* their jump changes forces too: it says nothing of the free points
                     */
        adapt(r);
    *residual = residual_of(r);
    return pd_status_ok();
}
