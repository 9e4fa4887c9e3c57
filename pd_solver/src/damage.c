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
        PD_TRY(make_bits((int64_t)body->n_regular * l->n_offsets, &l->broken));
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
    const int64_t bit = ((int64_t)chunk->point + lane) * l->n_offsets + k;
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

/* Ends of broken bonds of regular points: each bond has two. */
static int64_t count_regular(const pd_body *body)
{
    const pd_lattice *l = body->lattice;
    const int64_t words = ((int64_t)body->n_regular * l->n_offsets + 63) / 64;
    int64_t ends = 0;
    for (int64_t w = 0; w < words; w++)
        ends += __builtin_popcountll(l->broken[w]);
    return ends;
}

int64_t pd_damage_count(const pd_body *body)
{
    int64_t ends = 0;
    if (!body->broken)
        return 0;
    if (body->lattice)
        ends += count_regular(body);
    for (int64_t w = 0; w < (body->families.first[body->families.n] + 63) / 64; w++)
        for (uint64_t bits = body->broken[w]; bits; bits &= bits - 1) {
            const int64_t k = 64 * w + __builtin_ctzll(bits);
            ends += body->families.neighbour[k] < body->n_active ? 1 : 2;
        }
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
    if (!body->protect)
        body->protect = malloc((size_t)body->n_local);
    if (!body->protect)
        return pd_status_fail(PD_NO_MEMORY, -1, "%d points", body->n_local);
    for (pd_local i = 0; i < body->n_local; i++)
        body->protect[i] = protect[body->id[i]] != 0;
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
    PD_TRY(pd_damage_allocate(body));

    pd_family family;
    for (pd_local i = 0; i < body->n_active; i++) {
        family_of(body, i, &family);
        for (pd_local k = 0; k < family.count; k++) {
            double a[3] = {0}, b[3] = {0};
            /* From the smaller to the larger index, so that both ends agree. */
            const pd_local j = family.neighbour[k];
            memcpy(a, body->X + (size_t)(i < j ? i : j) * d, (size_t)d * sizeof *a);
            memcpy(b, body->X + (size_t)(i < j ? j : i) * d, (size_t)d * sizeof *b);
            if (!crosses(&r, normal, a, b))
                continue;
            if (i < body->n_regular)
                pd_damage_break_regular(body, pd_lattice_chunk(body, i),
                                        i - pd_lattice_chunk(body, i)->point,
                                        family.offset[k]);
            else
                pd_damage_break(body, family.base + k);
        }
    }
    if (body->out_of_memory)
        return pd_status_fail(PD_NO_MEMORY, -1, "weights beside a pre-crack");
    return body->options.formulation->prepare(body);
}

/* ---- pieces ---- */

static pd_local root_of(pd_local *parent, pd_local i)
{
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

pd_local pd_body_pieces(const pd_body *body, pd_local *piece)
{
    pd_family family;
    for (pd_local i = 0; i < body->n_active; i++)
        piece[i] = i;
    for (pd_local i = 0; i < body->n_active; i++) {
        family_of(body, i, &family);
        for (pd_local k = 0; k < family.count; k++) {
            const pd_local j = family.neighbour[k];
            if (j >= i || family_broken(&family, k))
                continue; /* seen from the other end */
            const pd_local a = root_of(piece, i), b = root_of(piece, j);
            if (a < b)
                piece[b] = a;
            if (b < a)
                piece[a] = b;
        }
    }
    /* Roots are the smallest of their piece, so they are met before the rest of it. */
    pd_local count = 0;
    for (pd_local i = 0; i < body->n_active; i++) {
        const pd_local parent = piece[i];
        piece[i] = parent == i ? count++ : piece[parent];
    }
    for (pd_local i = body->n_active; i < body->n_owned; i++)
        piece[i] = -1;
    return count;
}
