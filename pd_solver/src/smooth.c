/*
 * The fictitious mass of relaxation, a multilevel preconditioner as in [bramble1990]:
 *
 *     M^-1 f = D^-1 f + sum over levels of P D_l^-1 P^T f
 *
 * D bounds the stiffness from above point by point and is all that [kilic2010] has: with
 * it a force spreads by one horizon an iteration, so that iterations grow with the number
 * of points across the body, and with its square in bending. P interpolates linearly from
 * the nodes of a grid, laid over the body at rest, whose hat functions are displacements
 * many points wide; D_l is the stiffness of a hat. Everything is diagonal and positive,
 * and knows no direction, so that it stays good when parts of the body turn.
 *
 * Every rank has all nodes, and sums over ranks what points bring to them: an eighth of
 * the points in space, which is what limits how many ranks can relax a body together.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "smooth.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "status.h"
#include "step.h"
#include "tensor.h"

/* Nodes of the finest level are at least this many mean spacings apart. */
#define FINEST 2.

/* Stiffness of a hat over M V d / (2 width^2), V the volume that it reaches. One would be
 * its own energy; it shares that of its neighbours. Found by trial. */
#define HAT 8.

/* ---- grids ---- */

static size_t nodes_of(int d, const pd_level *level)
{
    size_t nodes = 1;
    for (int a = 0; a < d; a++)
        nodes *= (size_t)level->count[a];
    return nodes;
}

/* Lay the finest grid over the body, with no more nodes than points; returns its longest
 * count. */
static pd_local lay_finest(const pd_body *b, pd_smooth *s)
{
    const int d = b->options.dimension;
    pd_level *l = &s->level[0];
    double extent[3] = {0}, sum[2] = {0, b->n_moving}; /* volume, points */
    for (int a = 0; a < d; a++) {
        double most[2] = {-HUGE_VAL, -HUGE_VAL}; /* down and up */
        for (pd_local p = 0; p < b->n_active; p++) {
            most[0] = fmax(most[0], -b->X[(size_t)p * d + a]);
            most[1] = fmax(most[1], b->X[(size_t)p * d + a]);
        }
        pd_largest_all(b->comm, most, 2);
        s->origin[a] = -most[0];
        extent[a] = most[1] + most[0];
    }
    for (pd_local p = 0; p < b->n_moving; p++)
        sum[0] += b->volume[p];
    pd_sum_all(b->comm, sum, 2);
    l->width = FINEST * pow(sum[0] / sum[1], 1. / d);
    for (;; l->width *= 1.5) {
        double nodes = 1;
        for (int a = 0; a < d; a++)
            nodes *= floor(extent[a] / l->width) + 2;
        if (nodes <= sum[1] + (1 << d))
            break;
    }
    pd_local longest = 0;
    for (int a = 0; a < d; a++) {
        l->count[a] = (pd_local)(extent[a] / l->width) + 2;
        longest = l->count[a] > longest ? l->count[a] : longest;
    }
    return longest;
}

/* Coarser grids while they have nodes between the ends of the body. */
static void lay_grids(const pd_body *b, pd_smooth *s)
{
    const int d = b->options.dimension;
    pd_local longest = lay_finest(b, s);
    do {
        pd_level *l = &s->level[s->n_levels];
        if (s->n_levels > 0) {
            l->width = 2 * l[-1].width;
            for (int a = 0; a < d; a++)
                l->count[a] = l[-1].count[a] / 2 + 1;
        }
        l->first = s->n_nodes;
        s->n_nodes += nodes_of(d, l);
        longest = longest / 2 + 1;
    } while (++s->n_levels < PD_LEVELS && longest > 2);
}

pd_status pd_smooth_create(const pd_body *b, pd_smooth *s)
{
    const size_t n = (size_t)b->n_moving, d = (size_t)b->options.dimension;
    int64_t moving = b->n_moving;
    pd_count_all(b->comm, &moving, 1);
    *s = (pd_smooth){.body = b};
    if (moving > 0)
        lay_grids(b, s);
    s->stiffness = malloc(((size_t)b->n_local + 1) * sizeof *s->stiffness);
    s->soft = malloc((s->n_nodes * d + 1) * sizeof *s->soft);
    s->value = malloc((s->n_nodes * d + 1) * sizeof *s->value);
    s->weight = malloc((s->n_nodes * d + 1) * sizeof *s->weight);
    pd_status status = pd_status_ok();
    if (!s->stiffness || !s->soft || !s->value || !s->weight)
        status = pd_status_fail(PD_NO_MEMORY, -1, "grids of %zu nodes", s->n_nodes);
    PD_TRY(pd_agree(b->comm, status));
    b->options.formulation->frequency(b, s->stiffness);
    for (size_t p = 0; p < n; p++) {
        s->stiffness[p] *= b->options.density * b->volume[p];
        if (!(s->stiffness[p] > 0)) /* no bonds are left: what moves it has no answer */
            s->stiffness[p] = HUGE_VAL;
    }
    pd_smooth_fix(s);
    return pd_status_ok();
}

void pd_smooth_free(pd_smooth *s)
{
    free(s->stiffness);
    free(s->soft);
    free(s->value);
    free(s->weight);
}

/* ---- from points to nodes and back ---- */

/* The 2^d nodes of a level around a place and their shares of it. */
PD_INLINE int around(const int d, const pd_smooth *s, const pd_level *l, const double *X,
                     size_t *node, double *share)
{
    size_t base[3];
    double part[3];
    for (int a = 0; a < d; a++) {
        const double place = (X[a] - s->origin[a]) / l->width;
        base[a] = (size_t)place;
        part[a] = place - (double)base[a];
    }
    for (int corner = 0; corner < 1 << d; corner++) {
        node[corner] = 0;
        share[corner] = 1;
        for (int a = 0; a < d; a++) {
            const size_t far = corner >> a & 1;
            node[corner] = node[corner] * (size_t)l->count[a] + base[a] + far;
            share[corner] *= far ? part[a] : 1 - part[a];
        }
        node[corner] += l->first;
    }
    return 1 << d;
}

/* The same for node k of a level, between the nodes of the next coarser one. */
static int above(int d, const pd_level *l, size_t k, size_t *node, double *share)
{
    size_t index[3];
    for (int a = d - 1; a >= 0; a--) {
        index[a] = k % (size_t)l->count[a];
        k /= (size_t)l->count[a];
    }
    int n = 0;
    for (int corner = 0; corner < 1 << d; corner++) {
        size_t parent = 0;
        double part = 1;
        for (int a = 0; a < d; a++) {
            const size_t far = corner >> a & 1, odd = index[a] % 2;
            parent = parent * (size_t)l[1].count[a] + index[a] / 2 + far;
            part *= odd ? 0.5 : 1 - (double)far;
        }
        if (part > 0) {
            node[n] = l[1].first + parent;
            share[n++] = part;
        }
    }
    return n;
}

/* Sum a vector over the shares of nodes, or take the sum of theirs. */
PD_INLINE void give(const int d, int n, const size_t *node, const double *share,
                    const double *from, double *value)
{
    for (int k = 0; k < n; k++)
        for (int a = 0; a < d; a++)
            value[node[k] * (size_t)d + a] += share[k] * from[a];
}

PD_INLINE void take(const int d, int n, const size_t *node, const double *share,
                    const double *value, double *to)
{
    for (int k = 0; k < n; k++)
        for (int a = 0; a < d; a++)
            to[a] += share[k] * value[node[k] * (size_t)d + a];
}

/* ---- stiffness of hats ---- */

/* Sum at the nodes of a level the stiffness that point p brings. A hat that reaches a
 * point which does not move would tear the body there: it is fixed. */
static void stiffen(pd_smooth *s, const pd_level *l, pd_local p, double modulus)
{
    const pd_body *b = s->body;
    const int d = b->options.dimension;
    size_t node[8];
    double share[8];
    const int n = around(d, s, l, b->X + (size_t)p * d, node, share);
    const double stiffness = HAT * d / 2 * modulus * b->volume[p] / (l->width * l->width);
    for (int k = 0; k < n; k++)
        for (int a = 0; a < d; a++)
            if (share[k] > 0)
                s->soft[node[k] * (size_t)d + (size_t)a] +=
                    p >= b->n_moving || pd_is_prescribed(b, p, a) ? HUGE_VAL : stiffness;
}

void pd_smooth_fix(pd_smooth *s)
{
    const pd_body *b = s->body;
    const size_t d = (size_t)b->options.dimension;
    const double c = b->options.formulation->wave_speed(b);
    memset(s->soft, 0, s->n_nodes * d * sizeof *s->soft);
    for (int l = 0; l < s->n_levels; l++)
        for (pd_local p = 0; p < b->n_active; p++)
            stiffen(s, &s->level[l], p, b->options.density * c * c);
    pd_sum_all(b->comm, s->soft, s->n_nodes * d);
    for (size_t k = 0; k < s->n_nodes * d; k++)
        s->soft[k] = s->soft[k] > 0 ? 1 / s->soft[k] : 0;
}

/* ---- application ---- */

/* Carry the forces on nodes up to coarser ones, divide, and carry what they move down. */
static void apply_to_nodes(pd_smooth *s)
{
    const int d = s->body->options.dimension;
    size_t node[8];
    double share[8];
    for (int i = 0; i + 1 < s->n_levels; i++) {
        const pd_level *l = &s->level[i];
        for (size_t k = 0; k < nodes_of(d, l); k++) {
            const int n = above(d, l, k, node, share);
            give(d, n, node, share, s->value + (l->first + k) * (size_t)d, s->value);
        }
    }
    for (size_t c = 0; c < s->n_nodes * (size_t)d; c++)
        s->value[c] *= s->soft[c];
    for (int i = s->n_levels - 2; i >= 0; i--) {
        const pd_level *l = &s->level[i];
        for (size_t k = 0; k < nodes_of(d, l); k++) {
            const int n = above(d, l, k, node, share);
            take(d, n, node, share, s->value, s->value + (l->first + k) * (size_t)d);
        }
    }
}

static void zero_prescribed(const pd_body *b, double *f)
{
    const int d = b->options.dimension;
    for (pd_local p = 0; p < b->n_moving; p++)
        for (int a = 0; a < d; a++)
            if (pd_is_prescribed(b, p, a))
                f[(size_t)p * d + a] = 0;
}

PD_INLINE void apply(const int d, pd_smooth *s, double *f)
{
    const pd_body *b = s->body;
    const pd_level *l = &s->level[0];
    size_t node[8];
    double share[8];
    zero_prescribed(b, f);
    memset(s->value, 0, s->n_nodes * (size_t)d * sizeof *s->value);
    for (pd_local p = 0; p < b->n_moving; p++) {
        const int n = around(d, s, l, b->X + (size_t)p * d, node, share);
        give(d, n, node, share, f + (size_t)p * d, s->value);
    }
    pd_sum_all(b->comm, s->value, nodes_of(d, l) * (size_t)d);
    apply_to_nodes(s);
    for (pd_local p = 0; p < b->n_moving; p++) {
        const int n = around(d, s, l, b->X + (size_t)p * d, node, share);
        for (int a = 0; a < d; a++)
            f[(size_t)p * d + a] /= s->stiffness[p];
        take(d, n, node, share, s->value, f + (size_t)p * d);
    }
    zero_prescribed(b, f);
}

void pd_smooth_apply(pd_smooth *s, double *f)
{
    if (s->n_nodes == 0)
        return;
    if (s->body->options.dimension == 1)
        apply(1, s, f);
    else if (s->body->options.dimension == 2)
        apply(2, s, f);
    else
        apply(3, s, f);
}

/* ---- continuation ----
 *
 * Means of what is known are carried to coarser nodes; on the way back nodes that know
 * little take over what the coarser ones around them say. */

/* Divide the sums of a level by their weights, which count to 1 at most. */
static void average(pd_smooth *s, const pd_level *l)
{
    const size_t d = (size_t)s->body->options.dimension;
    for (size_t c = l->first * d; c < (l->first + nodes_of((int)d, l)) * d; c++) {
        s->value[c] = s->weight[c] > 0 ? s->value[c] / s->weight[c] : 0;
        s->weight[c] = fmin(s->weight[c], 1);
    }
}

static void gather_known(pd_smooth *s, const double *u)
{
    const pd_body *b = s->body;
    const int d = b->options.dimension;
    size_t node[8];
    double share[8];
    memset(s->value, 0, s->n_nodes * (size_t)d * sizeof *s->value);
    memset(s->weight, 0, s->n_nodes * (size_t)d * sizeof *s->weight);
    for (pd_local p = 0; p < b->n_active; p++) {
        const bool held = p >= b->n_moving;
        const int n = around(d, s, &s->level[0], b->X + (size_t)p * d, node, share);
        for (int a = 0; a < d; a++)
            if (held || pd_is_prescribed(b, p, a))
                for (int k = 0; k < n; k++) {
                    const size_t c = node[k] * (size_t)d + (size_t)a;
                    s->weight[c] += share[k];
                    s->value[c] += held ? 0 : share[k] * u[(size_t)p * d + a];
                }
    }
    pd_sum_all(b->comm, s->value, nodes_of(d, &s->level[0]) * (size_t)d);
    pd_sum_all(b->comm, s->weight, nodes_of(d, &s->level[0]) * (size_t)d);
    average(s, &s->level[0]);
}

static void carry_up(pd_smooth *s, const pd_level *l)
{
    const size_t d = (size_t)s->body->options.dimension;
    size_t node[8];
    double share[8];
    for (size_t k = 0; k < nodes_of((int)d, l); k++) {
        const size_t c = (l->first + k) * d;
        const int n = above((int)d, l, k, node, share);
        for (int i = 0; i < n; i++)
            for (size_t a = 0; a < d; a++) {
                s->weight[node[i] * d + a] += share[i] * s->weight[c + a];
                s->value[node[i] * d + a] +=
                    share[i] * s->weight[c + a] * s->value[c + a];
            }
    }
    average(s, l + 1);
}

static void carry_down(pd_smooth *s, const pd_level *l)
{
    const size_t d = (size_t)s->body->options.dimension;
    size_t node[8];
    double share[8];
    for (size_t k = 0; k < nodes_of((int)d, l); k++) {
        const size_t c = (l->first + k) * d;
        const int n = above((int)d, l, k, node, share);
        double coarse[3] = {0};
        take((int)d, n, node, share, s->value, coarse);
        for (size_t a = 0; a < d; a++)
            s->value[c + a] += (1 - s->weight[c + a]) * (coarse[a] - s->value[c + a]);
    }
}

void pd_smooth_extend(pd_smooth *s, double *u)
{
    const pd_body *b = s->body;
    const int d = b->options.dimension;
    gather_known(s, u);
    for (int l = 0; l + 1 < s->n_levels; l++)
        carry_up(s, &s->level[l]);
    for (int l = s->n_levels - 2; l >= 0; l--)
        carry_down(s, &s->level[l]);
    for (pd_local p = 0; p < b->n_moving; p++) {
        size_t node[8];
        double share[8], moved[3] = {0};
        const int n = around(d, s, &s->level[0], b->X + (size_t)p * d, node, share);
        take(d, n, node, share, s->value, moved);
        for (int a = 0; a < d; a++)
            if (!pd_is_prescribed(b, p, a))
                u[(size_t)p * d + a] = moved[a];
    }
}
