/*
 * Moving a body in time: velocity Verlet and the symplectic Euler scheme of [han2025].
 *
 * Damping -eta v is a part of the force. Taken as it stands it would limit the step to
 * 2 rho/eta and leave Verlet first order. It is taken with the mean of the velocities
 * before and after instead, whose part of the unknown one goes to the left-hand side:
 *
 *     rho (v' - v)/dt = g - eta (v + v')/2   is   v' = v + dt (g - eta v)/(rho + eta
 * dt/2)
 *
 * where g - eta v is the force as it is. Verlet's half steps share that out, so that the
 * velocities in the middle of the steps are those of central differences: second order,
 * and stable below 2/omega whatever eta is.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include <stdlib.h>
#include <string.h>

#include "body.h"
#include "status.h"
#include "step.h"

/* ---- prescribed components ---- */

static pd_status check_prescribed(const pd_body *b, const pd_prescribed *prescribed,
                                  size_t k)
{
    const pd_local p = prescribed->point[k];
    if (p < 0 || p >= b->n_moving)
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "prescribed point %d; allowed: 0 to below %d", (int)p,
                              (int)b->n_moving);
    for (int a = 0; a < b->options.dimension; a++) {
        const double y = prescribed->y[k * (size_t)b->options.dimension + (size_t)a];
        if (prescribed->components[k] >> a & 1 && !usable(y))
            return pd_status_fail(PD_NOT_FINITE, b->id[p], "prescribed position %g", y);
    }
    return pd_status_ok();
}

pd_status pd_prescribe(pd_body *b, const pd_prescribed *prescribed)
{
    memset(b->prescribed, 0, (size_t)b->n_moving);
    for (size_t k = 0; prescribed && k < prescribed->n; k++) {
        PD_TRY(check_prescribed(b, prescribed, k));
        b->prescribed[prescribed->point[k]] |= prescribed->components[k];
    }
    return pd_status_ok();
}

void pd_place_prescribed(pd_body *b, const pd_prescribed *prescribed)
{
    const size_t d = (size_t)b->options.dimension;
    for (size_t k = 0; prescribed && k < prescribed->n; k++)
        for (size_t a = 0; a < d; a++)
            if (prescribed->components[k] >> a & 1)
                b->y[(size_t)prescribed->point[k] * d + a] = prescribed->y[k * d + a];
}

/* The velocity that takes prescribed components where they shall be. */
static void prescribe_velocities(pd_body *b, double dt, const pd_prescribed *prescribed)
{
    const size_t d = (size_t)b->options.dimension;
    for (size_t k = 0; prescribed && k < prescribed->n; k++)
        for (size_t a = 0; a < d; a++) {
            const size_t c = (size_t)prescribed->point[k] * d + a;
            if (prescribed->components[k] >> a & 1)
                b->v[c] = (prescribed->y[k * d + a] - b->y[c]) / dt;
        }
}

/* ---- integrators ---- */

/* v += rate * force on the free components. */
static void kick(pd_body *b, double rate)
{
    const int d = b->options.dimension;
    for (pd_local p = 0; p < b->n_moving; p++)
        for (int a = 0; a < d; a++)
            if (!pd_is_prescribed(b, p, a))
                b->v[(size_t)p * d + a] += rate * b->force[(size_t)p * d + a];
}

/* As kick; the damping in the force follows the velocity. */
static void kick_and_damp(pd_body *b, double rate)
{
    const double lost = 1 - rate * b->options.damping;
    const int d = b->options.dimension;
    kick(b, rate);
    if (b->options.damping == 0)
        return;
    for (pd_local p = 0; p < b->n_moving; p++)
        for (int a = 0; a < d; a++)
            if (!pd_is_prescribed(b, p, a))
                b->force[(size_t)p * d + a] *= lost;
}

/* To the end of the step with the velocities in its middle, and the forces there. */
static pd_status move(pd_body *b, double dt, const pd_prescribed *prescribed)
{
    const size_t size = (size_t)b->n_moving * (size_t)b->options.dimension;
    prescribe_velocities(b, dt, prescribed);
    PD_TRY(pd_body_advance(b, dt, 0));
    for (size_t c = 0; c < size; c++)
        b->y[c] += dt * b->v[c];
    pd_place_prescribed(b, prescribed); /* to the last bit */
    return pd_body_forces(b);
}

static pd_status velocity_verlet(pd_body *b, double dt, const pd_prescribed *prescribed)
{
    const double rho = b->inertia;
    kick(b, dt / 2 / (rho + b->options.damping * dt / 2));
    PD_TRY(move(b, dt, prescribed));
    kick_and_damp(b, dt / 2 / rho);
    return pd_status_ok();
}

static pd_status symplectic_euler(pd_body *b, double dt, const pd_prescribed *prescribed)
{
    kick(b, dt / (b->inertia + b->options.damping * dt / 2));
    return move(b, dt, prescribed);
}

static const pd_integrator integrators[] = {
    {"velocityVerlet", "[swope1982]", velocity_verlet},
    {"symplecticEuler", "[han2025] eq. 30", symplectic_euler},
};

const pd_integrator *const pd_integrators[] = {&integrators[0], &integrators[1], NULL};

const pd_integrator *pd_integrator_find(const char *name)
{
    for (const pd_integrator *const *i = pd_integrators; *i; i++)
        if (strcmp((*i)->name, name) == 0)
            return *i;
    return NULL;
}

/* ---- a step ---- */

pd_status pd_body_step(pd_body *b, const pd_integrator *integrator, double dt,
                       const pd_prescribed *prescribed)
{
    if (!(usable(dt) && dt > 1 / PD_LARGEST)) /* distances over dt must not overflow */
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "time step %g; allowed: above 0", dt);
    PD_TRY(pd_agree(b->comm, pd_prescribe(b, prescribed)));
    return integrator->step(b, dt, prescribed);
}

/* Damping is taken implicitly, see above: it does not limit the step. */
double pd_body_stable_step(const pd_body *b)
{
    double *omega2 = malloc(((size_t)b->n_local + 1) * sizeof *omega2);
    double highest = 0;
    int64_t short_of_memory = !omega2;
    pd_count_all(b->comm, &short_of_memory, 1);
    if (short_of_memory > 0) {
        free(omega2);
        return 0;
    }
    b->options.formulation->frequency(b, omega2);
    for (pd_local p = 0; p < b->n_moving; p++)
        highest = fmax(highest, omega2[p] * b->options.density / b->inertia);
    free(omega2);
    pd_largest_all(b->comm, &highest, 1);
    return highest > 0 ? 2 / sqrt(highest) : HUGE_VAL;
}
