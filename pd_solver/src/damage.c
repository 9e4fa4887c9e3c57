/*
 * Bond state, local damage, pre-cracks and the pieces that intact bonds connect.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "damage.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "status.h"
#include "tensor.h"

static pd_status make_bits(int64_t bits, uint64_t **words)
{
    const size_t n = (size_t)(bits + 63) / 64;
    *words = calloc(n ? n : 1, sizeof **words);
    return *words ? pd_status_ok()
                  : pd_status_fail(PD_NO_MEMORY, -1, "%zu words of bonds", n);
}

pd_status pd_damage_allocate(pd_body *body)
{
    if (body->broken)
        return pd_status_ok();
    pd_lattice *l = body->lattice;
    if (l)
        PD_TRY(make_bits((int64_t)n_regular_of(body) * l->n_offsets, &l->broken));
    return make_bits(body->families.first[body->families.n], &body->broken);
}

void pd_damage_break(pd_body *body, int64_t k)
{
    body->broken[k / 64] |= UINT64_C(1) << (k % 64);
    body->weight[k] = 0;
}

bool pd_damage_break_regular(pd_body *body, pd_chunk *chunk, int lane, int k)
{
    pd_lattice *l = body->lattice;
    const int64_t row = regular_row(body, chunk->point + lane);
    const int64_t bit = row * l->n_offsets + k;
    if (l->broken[bit / 64] >> (bit % 64) & 1)
        return false;
    if (pd_lattice_cut(l, chunk, lane, k).code != PD_OK) {
        body->out_of_memory = true;
        return false;
    }
    l->broken[bit / 64] |= UINT64_C(1) << (bit % 64);
    return true;
}

bool pd_damage_break_chunk(pd_body *body, int64_t z, pd_chunk *c, double s_c2)
{
    const pd_lattice *l = body->lattice;
    bool any = false;
    for (int q = 0; q < c->count; q++)
        for (int k = 0; k < l->n_offsets; k++) {
            const pd_local i = c->point + q;
            const pd_local j = pd_lattice_neighbour(l, z, c, q, &l->offset[k]);
            if (j < 0 || bond_is_protected(body, i, j))
                continue;
            double Y[3];
            subtract(l->d, body->y + (size_t)j * (size_t)l->d,
                     body->y + (size_t)i * (size_t)l->d, Y);
            const double length = l->offset[k].length;
            if (dot(l->d, Y, Y) > s_c2 * length * length)
                any |= pd_damage_break_regular(body, c, q, k);
        }
    return any;
}

/* Word w of bits, of which only the first n count. */
static uint64_t word_of(const uint64_t *bits, int64_t w, int64_t n)
{
    const int64_t left = n - 64 * w;
    return left >= 64 ? bits[w] : bits[w] & ((UINT64_C(1) << left) - 1);
}

/* Ends of broken bonds of owned regular points: each bond has two. */
static int64_t count_regular(const pd_body *body)
{
    const int64_t n = (int64_t)body->n_regular * body->lattice->n_offsets;
    int64_t ends = 0;
    for (int64_t w = 0; w < (n + 63) / 64; w++)
        ends += __builtin_popcountll(word_of(body->lattice->broken, w, n));
    return ends;
}

/* The same of the general path; points without a family see no bond. */
static int64_t count_general(const pd_body *body)
{
    const int64_t n = body->families.first[body->n_active];
    int64_t ends = 0;
    for (int64_t w = 0; w < (n + 63) / 64; w++)
        for (uint64_t bits = word_of(body->broken, w, n); bits; bits &= bits - 1) {
            const int64_t k = 64 * w + __builtin_ctzll(bits);
            ends += keeps_family(body, body->families.neighbour[k]) ? 1 : 2;
        }
    return ends;
}

int64_t pd_damage_count(const pd_body *body)
{
    int64_t ends = body->broken ? count_general(body) : 0;
    if (body->broken && body->lattice)
        ends += count_regular(body);
    pd_count_all(body->comm, &ends, 1);
    return ends / 2;
}

bool pd_body_bond_intact(const pd_body *body, pd_local p, pd_local k)
{
    pd_family family;
    return !family_broken(family_of(body, p, &family), k);
}

void pd_body_damage(const pd_body *body, double *damage)
{
    pd_family family;
    for (pd_local i = 0; i < body->n_owned; i++) {
        damage[i] = 0;
        if (i >= body->n_active || !body->broken)
            continue;
        family_of(body, i, &family);
        double all = 0, gone = 0;
        for (pd_local k = 0; k < family.count; k++) {
            const double V = body->volume[family.neighbour[k]];
            all += V;
            if (family_broken(&family, k))
                gone += V;
        }
        if (all > 0)
            damage[i] = gone / all;
    }
}

pd_status pd_body_protect(pd_body *body, const unsigned char *protect)
{
    pd_status status = pd_status_ok();
    if (!body->protect)
        body->protect = calloc((size_t)body->n_local + 1, 1);
    if (!body->protect)
        status = pd_status_fail(PD_NO_MEMORY, -1, "%d points", body->n_local);
    PD_TRY(pd_agree(body->comm, status));
    for (pd_local i = 0; i < body->n_owned; i++)
        body->protect[i] = protect[body->given[i]] != 0;
    pd_halo_copy(body->halo, body->protect, sizeof *body->protect);
    return pd_status_ok();
}

/* Bulk modulus of the plane or of space, that of [han2025] eq. 18. */
static double bulk_modulus(const pd_body_options *o)
{
    double K, G;
    o->material->moduli(o->parameters, o->dimension, o->plane, &K, &G);
    if (o->dimension == 3)
        return K;
    if (o->plane == PD_PLANE_STRESS)
        return 9 * K * G / (3 * K + 4 * G); /* E / (2 (1 - nu)) */
    return K + G / 3;
}

double pd_body_critical_stretch(const pd_body *body, pd_local i, pd_local j)
{
    const double pi = 3.14159265358979323846;
    const pd_body_options *o = &body->options;
    if (o->energy_release == 0)
        return o->critical_stretch;
    const double horizon = o->horizon_ratio * 0.5 * (body->spacing[i] + body->spacing[j]);
    const double share = o->dimension == 3 ? 5. / 9 : pi / 3;
    return 1 + sqrt(share * o->energy_release / (bulk_modulus(o) * horizon));
}

/* ---- pre-cracks ---- */

static void cross(const double *a, const double *b, double *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot3(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Does the segment a-b meet the rectangle? Ends that touch count, within round-off. */
static bool crosses(const pd_rectangle *r, const double *normal, const double *a,
                    const double *b)
{
    const double slack = 1e-9;
    double from[3], along[3];
    for (int c = 0; c < 3; c++)
        from[c] = a[c] - r->corner[c], along[c] = b[c] - a[c];
    const double height = dot3(from, normal), climb = dot3(along, normal);
    if (fabs(climb) <= slack * sqrt(dot3(along, along) * dot3(normal, normal)))
        return false; /* parallel to the rectangle */
    const double s = -height / climb;
    if (s < -slack || s > 1 + slack)
        return false;
    double hit[3], e1_n[3], n_e2[3];
    for (int c = 0; c < 3; c++)
        hit[c] = from[c] + s * along[c];
    cross(r->edge2, normal, e1_n); /* dual base: hit = s1 edge1 + s2 edge2 */
    cross(normal, r->edge1, n_e2);
    const double s1 = dot3(hit, e1_n) / dot3(r->edge1, e1_n);
    const double s2 = dot3(hit, n_e2) / dot3(r->edge2, n_e2);
    return s1 >= -slack && s1 <= 1 + slack && s2 >= -slack && s2 <= 1 + slack;
}

/* Break the bonds of point i that cross. */
static void cut_family(pd_body *body, pd_local i, const pd_rectangle *r,
                       const double *normal)
{
    const int d = body->options.dimension;
    pd_family family;
    family_of(body, i, &family);
    for (pd_local k = 0; k < family.count; k++) {
        double a[3] = {0}, b[3] = {0};
        /* From the smaller to the larger number, so that both ends agree. */
        const pd_local j = family.neighbour[k];
        const bool forth = body->id[i] < body->id[j];
        memcpy(a, body->X + (size_t)(forth ? i : j) * d, (size_t)d * sizeof *a);
        memcpy(b, body->X + (size_t)(forth ? j : i) * d, (size_t)d * sizeof *b);
        if (!crosses(r, normal, a, b))
            continue;
        if (!family.offset) {
            pd_damage_break(body, family.base + k);
            continue;
        }
        pd_chunk *chunk = pd_lattice_chunk(body, i);
        pd_damage_break_regular(body, chunk, i - chunk->point, family.offset[k]);
    }
}

pd_status pd_body_precrack(pd_body *body, const pd_rectangle *rectangle)
{
    const int d = body->options.dimension;
    pd_rectangle r = *rectangle;
    for (int c = 0; c < d; c++)
        if (!(usable(r.corner[c]) && usable(r.edge1[c]) && (d < 3 || usable(r.edge2[c]))))
            return pd_status_fail(PD_BAD_ARGUMENT, -1, "a pre-crack that is not finite");
    if (d < 3) {
        /* A strip through the plane, whatever its depth. */
        r.corner[2] = -1, r.edge1[2] = 0;
        r.edge2[0] = r.edge2[1] = 0, r.edge2[2] = 2;
    }
    double normal[3];
    cross(r.edge1, r.edge2, normal);
    const double area = sqrt(dot3(normal, normal));
    if (!(area > 0 && isfinite(area)))
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "a pre-crack of area %g; its edges must span a rectangle",
                              area);
    PD_TRY(pd_agree(body->comm, pd_damage_allocate(body)));
    for (pd_local i = 0; i < body->n_active; i++)
        cut_family(body, i, &r, normal);
    for (pd_local i = body->n_owned; i < body->near.active; i++)
        cut_family(body, i, &r, normal);
    pd_status status = pd_status_ok();
    if (body->out_of_memory)
        status = pd_status_fail(PD_NO_MEMORY, -1, "weights beside a pre-crack");
    PD_TRY(pd_agree(body->comm, status));
    return body->options.formulation->prepare(body);
}

/* ---- pieces ---- */

static pd_local root_of(pd_local *parent, pd_local i)
{
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

/* Join owned points with those, ghosts too, that intact bonds tie to them. */
static void join(const pd_body *body, pd_local *parent)
{
    pd_family family;
    for (pd_local i = 0; i < body->n_local; i++)
        parent[i] = i;
    for (pd_local i = 0; i < body->n_active; i++) {
        family_of(body, i, &family);
        for (pd_local k = 0; k < family.count; k++) {
            const pd_local j = family.neighbour[k];
            if ((j >= i && j < body->n_owned) || family_broken(&family, k) ||
                !keeps_family(body, j))
                continue; /* seen from the other end, or inside a hold */
            const pd_local a = root_of(parent, i), b = root_of(parent, j);
            if (a < b)
                parent[b] = a;
            if (b < a)
                parent[a] = b;
        }
    }
}

/* Give every piece of this rank its smallest label, until neighbours agree. Labels of
 * held points are below 0, so that they go first. */
static void spread_labels(const pd_body *body, pd_local *parent, pd_global *label)
{
    for (int64_t changed = 1; changed > 0;) {
        changed = 0;
        pd_halo_copy(body->halo, label, sizeof *label);
        for (pd_local i = 0; i < body->n_local; i++) {
            const pd_local root = root_of(parent, i);
            if (label[i] < label[root])
                label[root] = label[i];
        }
        for (pd_local i = 0; i < body->n_local; i++) {
            const pd_global least = label[root_of(parent, i)];
            changed += least != label[i];
            label[i] = least;
        }
        if (body->halo)
            pd_count_all(body->comm, &changed, 1);
        else
            changed = 0;
    }
}

pd_global pd_body_pieces(const pd_body *body, pd_global *piece, pd_global *holding)
{
    const size_t n = (size_t)body->n_local + 1;
    pd_local *parent = malloc(n * sizeof *parent);
    pd_global *label = malloc(n * sizeof *label);
    int64_t count[3] = {!parent || !label, 0, 0};
    pd_count_all(body->comm, count, 1);
    if (count[0] > 0) {
        free(parent);
        free(label);
        return -1;
    }
    join(body, parent);
    for (pd_local i = 0; i < body->n_local; i++)
        label[i] = body->id[i] - (is_held(body, i) ? body->n_all : 0);
    spread_labels(body, parent, label);
    for (pd_local i = 0; i < body->n_owned; i++) {
        const bool held = is_held(body, i), inside = !keeps_family(body, i);
        const bool names = !inside && label[i] == body->id[i] - (held ? body->n_all : 0);
        count[1] += names;
        count[2] += names && held;
        if (piece)
            piece[i] = inside ? -1 : label[i] + (label[i] < 0 ? body->n_all : 0);
    }
    free(parent);
    free(label);
    pd_count_all(body->comm, count + 1, 2);
    if (holding)
        *holding = count[2];
    return count[1];
}
