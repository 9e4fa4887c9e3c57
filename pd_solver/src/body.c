/*
 * A body: its points, their order, and what they amount to.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "body.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "damage.h"
#include "elementary.h"
#include "ghosts.h"
#include "influence.h"
#include "status.h"
#include "tensor.h"

/* ---- order of points ---- */

typedef struct {
    int rank;      /* kinds of owned points, of near ghosts, of others: in that order */
    uint64_t code; /* place along a Morton curve, or in the lattice */
    pd_local point;
} place;

static int by_place(const void *a, const void *b)
{
    const place *p = a, *q = b;
    if (p->rank != q->rank)
        return p->rank < q->rank ? -1 : 1;
    if (p->code != q->code)
        return p->code < q->code ? -1 : 1;
    return (p->point > q->point) - (p->point < q->point);
}

/* Interleave the bits of a point's grid indices, 21 an axis. */
static uint64_t morton(int d, const double *X, const double *origin, double step)
{
    uint64_t code = 0;
    for (int a = 0; a < d; a++) {
        const uint64_t index = (uint64_t)fmin((X[a] - origin[a]) / step + 0.25, 2097151.);
        for (int bit = 0; bit < 21; bit++)
            code |= (index >> bit & 1) << (bit * d + a);
    }
    return code;
}

/* Along the first axis, then the second, then the third. */
static uint64_t along_rows(const pd_lattice *l, const double *X)
{
    int64_t index[3] = {0};
    uint64_t code = 0;
    pd_lattice_index(l, X, index);
    for (int a = l->d - 1; a >= 0; a--)
        code = code * (uint64_t)l->count[a] + (uint64_t)index[a];
    return code;
}

static int kind_of(const pd_cell_list *cells, const unsigned char *held, pd_local i,
                   pd_local *near, pd_local capacity)
{
    if (!held)
        return PD_MOVING;
    const pd_local count = pd_cell_list_near(cells, i, capacity, near);
    for (pd_local k = 0; k < count && k < capacity; k++)
        if (!held[near[k]] != !held[i])
            return held[i] ? PD_HELD_BESIDE : PD_BESIDE_HOLD;
    return held[i] ? PD_HELD_INSIDE : PD_MOVING;
}

/* The largest family, if kinds depend on it. */
static pd_local widest_family(const pd_cell_list *cells, const unsigned char *held)
{
    pd_local widest = 1;
    for (pd_local i = 0; held && i < cells->n; i++) {
        const pd_local count = pd_cell_list_near(cells, i, 0, NULL);
        widest = count > widest ? count : widest;
    }
    return widest;
}

/* Kinds of the points as they are given; those of ghosts are what their owners find. */
static pd_status find_kinds(pd_body *b, const pd_cell_list *cells, const pd_part *part)
{
    const pd_local widest = widest_family(cells, part->held);
    pd_local *near = malloc((size_t)widest * sizeof *near);
    if (near)
        for (pd_local i = 0; i < b->n_owned; i++)
            b->kind[i] = (unsigned char)kind_of(cells, part->held, i, near, widest);
    const bool short_of_memory = !near;
    free(near);
    return short_of_memory ? pd_status_fail(PD_NO_MEMORY, -1, "a family of %d", widest)
                           : pd_status_ok();
}

/* Where the kinds of points begin and end, from how many of each rank of place there are.
 */
static void mark_ranges(pd_body *b, const pd_local *count)
{
    b->n_regular = b->lattice ? count[PD_MOVING] : 0;
    b->n_moving = count[PD_MOVING] + count[PD_BESIDE_HOLD];
    b->n_active = b->n_moving + count[PD_HELD_BESIDE];
    count += PD_KINDS;
    b->near.regular = b->n_owned + (b->lattice ? count[PD_MOVING] : 0);
    b->near.moving = b->n_owned + count[PD_MOVING] + count[PD_BESIDE_HOLD];
    b->near.active = b->near.moving + count[PD_HELD_BESIDE];
    b->near.all = b->near.active + count[PD_HELD_INSIDE];
}

/* Sort points by kind, then so that neighbours in space are neighbours in memory. */
static void order_points(pd_body *b, const pd_cell_list *cells, const pd_part *part,
                         place *places)
{
    const bool near_ghosts = b->options.formulation->ghost_layers > 1;
    pd_local count[3 * PD_KINDS] = {0};
    double step = HUGE_VAL;
    for (pd_local i = 0; i < b->n_local; i++)
        step = fmin(step, cells->spacing[i]);
    for (pd_local i = 0; i < b->n_local; i++) {
        const double *X = cells->X + (size_t)i * (size_t)cells->d;
        const bool is_ghost = i >= b->n_owned;
        const bool is_near = is_ghost && near_ghosts && !part->is_far[i - b->n_owned];
        const int group = !is_ghost ? 0 : is_near ? 1 : 2;
        places[i] = (place){.rank = group * PD_KINDS + b->kind[i],
                            .code = b->lattice ? along_rows(b->lattice, X)
                                               : morton(cells->d, X, cells->origin, step),
                            .point = i};
        count[places[i].rank]++;
    }
    mark_ranges(b, count);
    qsort(places, (size_t)b->n_local, sizeof *places, by_place);
}

/* ---- creation ---- */

static pd_status check_parameters(int n, const pd_parameter *parameters,
                                  const double *values)
{
    for (int k = 0; k < n; k++) {
        const pd_parameter *p = &parameters[k];
        const double value = values[k];
        if (!(usable(value) && value < p->below &&
              (value > p->above || (p->includes_above && value == p->above))))
            return pd_status_fail(PD_BAD_ARGUMENT, -1, "%s %g; allowed: %s %g, below %g",
                                  p->key, value, p->includes_above ? "at least" : "above",
                                  p->above, p->below);
        if (p->kind != PD_NUMBER && value != floor(value))
            return pd_status_fail(PD_BAD_ARGUMENT, -1, "%s %g; allowed: an integer",
                                  p->key, value);
    }
    return pd_status_ok();
}

static pd_status check_model(const pd_body_options *o)
{
    if (!o->formulation)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "no formulation");
    if (!o->material)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "no material");
    if (o->dimension < o->formulation->least_dimension)
        return pd_status_fail(
            PD_BAD_ARGUMENT, -1, "formulation %s in %d dimension; allowed: at least %d",
            o->formulation->name, o->dimension, o->formulation->least_dimension);
    if (!o->formulation->accepts(o->material, o->dimension, o->plane))
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "formulation %s does not take the material %s%s",
                              o->formulation->name, o->material->name,
                              o->dimension != 2             ? ""
                              : o->plane == PD_PLANE_STRESS ? " in plane stress"
                                                            : " in plane strain");
    PD_TRY(check_parameters(o->material->n_parameters, o->material->parameters,
                            o->parameters));
    return check_parameters(o->formulation->n_parameters, o->formulation->parameters,
                            o->formulation_parameters);
}

static pd_status check_damage(const pd_body_options *o)
{
    const struct {
        const char *name;
        double value, above;
        int criterion;
    } criteria[] = {
        {"critical stretch", o->critical_stretch, 1, PD_BY_STRETCH},
        {"energy release rate", o->energy_release, 0, PD_BY_STRETCH},
        {"critical stress", o->critical_stress, 0, PD_BY_STRESS},
        {"failed strain", o->failed_strain, 0, PD_BY_PLASTIC_STRAIN},
    };
    int given = 0;
    for (size_t k = 0; k < sizeof criteria / sizeof *criteria; k++) {
        const double value = criteria[k].value;
        if (!(usable(value) && (value == 0 || value > criteria[k].above)))
            return pd_status_fail(PD_BAD_ARGUMENT, -1,
                                  "%s %g; allowed: above %g, or 0 for no damage",
                                  criteria[k].name, value, criteria[k].above);
        if (value > 0 && !(o->formulation->criteria & criteria[k].criterion))
            return pd_status_fail(PD_BAD_ARGUMENT, -1,
                                  "bonds of formulation %s cannot break by %s",
                                  o->formulation->name, criteria[k].name);
        given += value > 0;
    }
    if (given > 1)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "%d criteria of damage; allowed: one",
                              given);
    if (!(usable(o->sound_strain) && o->sound_strain >= 0 &&
          (o->failed_strain == 0 || o->sound_strain <= o->failed_strain)))
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "sound strain %g; allowed: 0 to the failed strain, %g",
                              o->sound_strain, o->failed_strain);
    if (o->energy_release > 0 && o->dimension == 1)
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "an energy release rate in 1 dimension; allowed: 2, 3");
    return pd_status_ok();
}

/* all: points of all ranks. */
static pd_status check_options(const pd_body_options *o, size_t n, int64_t all)
{
    if (o->dimension < 1 || o->dimension > 3)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "dimension %d; allowed: 1, 2, 3",
                              o->dimension);
    if (o->plane != PD_PLANE_STRAIN && o->plane != PD_PLANE_STRESS)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "plane %d; allowed: 0, 1",
                              (int)o->plane);
    if (all < 1 || n > INT32_MAX / 16)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "%zu points; allowed: 1 to %d", n,
                              INT32_MAX / 16);
    if (!(usable(o->horizon_ratio) && o->horizon_ratio > 0 && o->horizon_ratio <= 20))
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "horizon ratio %g; allowed: above 0, at most 20",
                              o->horizon_ratio);
    if (!(usable(o->density) && o->density > 0))
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "density %g; allowed: above 0",
                              o->density);
    if (!(usable(o->damping) && o->damping >= 0))
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "damping %g; allowed: 0 or above",
                              o->damping);
    PD_TRY(check_model(o));
    return check_damage(o);
}

static pd_status check_points(int d, size_t n, const double *X, const double *volume)
{
    for (size_t i = 0; i < n; i++) {
        for (int a = 0; a < d; a++)
            if (!usable(X[3 * i + a]))
                return pd_status_fail(PD_BAD_ARGUMENT, (pd_global)i, "position %g",
                                      X[3 * i + a]);
        if (!(usable(volume[i]) && volume[i] > 0))
            return pd_status_fail(PD_BAD_ARGUMENT, (pd_global)i,
                                  "volume %g; allowed: above 0", volume[i]);
    }
    return pd_status_ok();
}

static pd_status allocate(pd_body *b)
{
    /* One more: a rank may have no point, and malloc(0) may return NULL. */
    const size_t n = (size_t)b->n_local + 1, d = (size_t)b->options.dimension;
    b->id = malloc(n * sizeof *b->id);
    b->given = malloc(n * sizeof *b->given);
    b->kind = calloc(n, sizeof *b->kind);
    b->X = malloc(n * d * sizeof *b->X);
    b->y = malloc(n * d * sizeof *b->y);
    b->v = calloc(n * d, sizeof *b->v);
    b->volume = malloc(n * sizeof *b->volume);
    b->spacing = malloc(n * sizeof *b->spacing);
    b->force = calloc(n * d, sizeof *b->force);
    b->F = malloc(n * d * d * sizeof *b->F);
    b->J = malloc(n * sizeof *b->J);
    b->prescribed = calloc(n, sizeof *b->prescribed);
    if (!b->id || !b->given || !b->kind || !b->X || !b->y || !b->v || !b->volume ||
        !b->spacing || !b->force || !b->F || !b->J || !b->prescribed)
        return pd_status_fail(PD_NO_MEMORY, -1, "a body of %zu points", n);
    return pd_status_ok();
}

/* Exactly: positions and volumes of a mesh are rounded. */
static void put_on_lattice(pd_body *b, pd_local i)
{
    const pd_lattice *l = b->lattice;
    double *X = b->X + (size_t)i * (size_t)l->d, *y = b->y + (size_t)i * (size_t)l->d;
    pd_lattice_place(l, X);
    memcpy(y, X, (size_t)l->d * sizeof *y);
    b->spacing[i] = l->step;
    b->volume[i] = pow(l->step, l->d);
}

/* Copy the given points in the order of `places` (NULL: as they come). */
static void fill(pd_body *b, const pd_part *part, const place *places)
{
    const int d = b->options.dimension;
    for (pd_local i = 0; i < b->n_local; i++) {
        const size_t from = (size_t)(places ? places[i].point : i);
        b->id[i] = part->id[from];
        b->given[i] = (pd_local)from;
        b->volume[i] = part->volume[from];
        b->spacing[i] = pd_spacing_of(d, b->volume[i]);
        b->J[i] = 1;
        identity(d, b->F + (size_t)i * d * d);
        for (int a = 0; a < d; a++) {
            b->X[(size_t)i * d + a] = part->X[3 * from + (size_t)a];
            b->y[(size_t)i * d + a] = part->X[3 * from + (size_t)a];
        }
        if (b->lattice)
            put_on_lattice(b, i);
    }
}

/* The halo, and kinds, from places as given to those in order. */
static pd_status renumber(pd_body *b, const place *places)
{
    const size_t n = (size_t)b->n_local;
    pd_local *now = malloc((n + 1) * sizeof *now);
    if (!now)
        return pd_status_fail(PD_NO_MEMORY, -1, "%zu points", n);
    for (pd_local i = 0; i < b->n_local; i++) {
        now[places[i].point] = i;
        b->kind[i] = (unsigned char)(places[i].rank % PD_KINDS);
    }
    for (size_t k = 0; b->halo && k < b->halo->n_send; k++)
        b->halo->send[k] = now[b->halo->send[k]];
    for (size_t k = 0; b->halo && k < b->halo->n_ghost; k++)
        b->halo->ghost[k] = now[b->halo->ghost[k]];
    free(now);
    return pd_status_ok();
}

/* Kinds of all points and their order. */
static pd_status arrange(pd_body *b, const pd_part *part, place *places)
{
    pd_cell_list cells;
    fill(b, part, NULL);
    pd_status status = pd_cell_list_create(b->options.dimension, b->n_local, b->X,
                                           b->spacing, b->options.horizon_ratio, &cells);
    if (status.code == PD_OK)
        status = find_kinds(b, &cells, part);
    status = pd_agree(b->comm, status);
    if (status.code == PD_OK) {
        pd_halo_copy(b->halo, b->kind, sizeof *b->kind);
        order_points(b, &cells, part, places);
        fill(b, part, places);
        status = renumber(b, places);
    }
    pd_cell_list_free(&cells);
    return status;
}

static pd_status build_families(pd_body *b, const pd_part *part)
{
    const pd_body_options *o = &b->options;
    PD_TRY(pd_lattice_find(b->comm, o, part, &b->lattice));
    place *places = malloc(((size_t)b->n_local + 1) * sizeof *places);
    pd_status status = pd_status_ok();
    if (!places)
        status = pd_status_fail(PD_NO_MEMORY, -1, "%d points", b->n_local);
    status = pd_agree(b->comm, status);
    if (status.code == PD_OK)
        status = arrange(b, part, places);
    free(places);
    if (status.code == PD_OK) {
        const pd_range general[] = {{b->n_regular, b->n_active},
                                    {b->near.regular, b->near.active}};
        pd_cell_list cells;
        status = pd_cell_list_create(o->dimension, b->n_local, b->X, b->spacing,
                                     o->horizon_ratio, &cells);
        if (status.code == PD_OK)
            status = pd_families_create(&cells, general, &b->families);
        pd_cell_list_free(&cells);
    }
    if (status.code == PD_OK && b->lattice)
        status = pd_lattice_fill(b);
    return pd_agree(b->comm, status);
}

/* How far points beside a hold are from where it ends: the distance to the nearest point
 * of the other kind, less half that point's spacing. 0: not beside a hold. */
static pd_status measure_holds(pd_body *b)
{
    const int d = b->options.dimension;
    bool any = false;
    for (pd_local i = 0; i < b->n_local; i++)
        any |= is_held(b, i);
    if (!any)
        return pd_status_ok();
    b->hold_distance = calloc((size_t)b->n_local, sizeof *b->hold_distance);
    if (!b->hold_distance)
        return pd_status_fail(PD_NO_MEMORY, -1, "holds of %d points", b->n_active);
    for (pd_local i = b->n_regular; i < b->n_active; i++) {
        double nearest = HUGE_VAL;
        for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
            const pd_local j = b->families.neighbour[k];
            if (is_held(b, i) == is_held(b, j))
                continue;
            double xi[3];
            subtract(d, b->X + (size_t)j * d, b->X + (size_t)i * d, xi);
            nearest = fmin(nearest, sqrt(dot(d, xi, xi)) - b->spacing[j] / 2);
        }
        /* Points of a very uneven mesh may lie inside each other's half spacing. */
        if (nearest < HUGE_VAL)
            b->hold_distance[i] = fmax(nearest, 0.1 * b->spacing[i]);
    }
    return pd_status_ok();
}

/* The same of ghosts, which their owners know. Where nothing is held here, nothing is
 * beside it. */
static pd_status share_holds(pd_body *b)
{
    double *distance = b->hold_distance, *none = NULL;
    if (b->halo && !distance)
        distance = none = calloc((size_t)b->n_local + 1, sizeof *none);
    const bool short_of_memory = b->halo && !distance;
    PD_TRY(pd_agree(b->comm, short_of_memory ? pd_status_fail(PD_NO_MEMORY, -1, "holds")
                                             : pd_status_ok()));
    pd_halo_copy(b->halo, distance, sizeof *distance);
    free(none);
    return pd_status_ok();
}

static pd_status check_families(const pd_body *b)
{
    for (pd_local i = 0; i < b->n_active; i++)
        if (b->carries && b->carries[i] == PD_POINT_SINGULAR)
            return pd_status_fail(PD_BAD_FAMILY, b->id[i],
                                  "a horizon of %g spacings gives the point %d bonds, "
                                  "which do not span space",
                                  b->options.horizon_ratio,
                                  pd_body_family(b, i, 0, NULL));
    return pd_status_ok();
}

/* Undirected bonds. A bond between active points is seen from both ends, one to a point
 * that keeps no family, which no family of a lattice reaches, from one. */
static int64_t count_bonds(const pd_body *b)
{
    int64_t ends = 0;
    pd_local i = 0;
    while (i < b->n_active) {
        const pd_chunk *c = i < b->n_regular ? pd_lattice_chunk(b, i) : NULL;
        if (c && chunk_is_whole(c)) {
            ends += (int64_t)c->count * b->lattice->n_offsets;
            i += c->count;
            continue;
        }
        pd_family family;
        family_of(b, i, &family);
        for (pd_local k = 0; k < family.count; k++)
            ends += keeps_family(b, family.neighbour[k]) ? 1 : 2;
        i++;
    }
    pd_count_all(b->comm, &ends, 1);
    return ends / 2;
}

/* Arrays of the size that the ghosts make them, and room for their messages. */
static pd_status adopt(pd_body *b, pd_part *part)
{
    b->n_owned = part->n_owned;
    b->n_local = part->n;
    b->halo = part->halo;
    /* Three positions and velocities; the widest is what bond-associated kernels send. */
    PD_TRY(pd_halo_reserve(b->halo, 16 * sizeof(double)));
    return allocate(b);
}

static pd_status create(pd_body *b, size_t n, const double *X, const double *volume,
                        const unsigned char *held, const pd_global *id)
{
    const pd_body_options *o = &b->options;
    pd_part part;
    pd_status status =
        pd_part_create(b->comm, o->dimension, o->horizon_ratio,
                       o->formulation->ghost_layers, n, X, volume, held, id, &part);
    if (status.code == PD_OK)
        status = pd_agree(b->comm, adopt(b, &part));
    else
        pd_halo_free(part.halo);
    if (status.code == PD_OK)
        status = build_families(b, &part);
    pd_part_free(&part);
    PD_TRY(status);
    PD_TRY(pd_agree(b->comm, measure_holds(b)));
    PD_TRY(share_holds(b));
    PD_TRY(b->options.formulation->prepare(b));
    PD_TRY(pd_agree(b->comm, check_families(b)));
    b->n_bonds = count_bonds(b);
    if (pd_body_can_break(&b->options))
        status = pd_damage_allocate(b);
    return pd_agree(b->comm, status);
}

/* What a rank can say without the others. */
static pd_status check_given(const pd_body_options *options, size_t n, int64_t all,
                             const double *X, const double *volume)
{
    PD_TRY(check_options(options, n, all));
    return check_points(options->dimension, n, X, volume);
}

pd_status pd_body_create(MPI_Comm comm, const pd_body_options *options, size_t n,
                         const double *X, const double *volume, const unsigned char *held,
                         const pd_global *id, pd_body **body)
{
    *body = NULL;
    int64_t all = (int64_t)n;
    pd_count_all(comm, &all, 1);
    pd_status status = check_given(options, n, all, X, volume);
    pd_body *b = NULL;
    if (status.code == PD_OK && !(b = calloc(1, sizeof *b)))
        status = pd_status_fail(PD_NO_MEMORY, -1, "a body");
    status = pd_agree(comm, status);
    if (status.code != PD_OK) {
        free(b);
        return status;
    }
    b->comm = MPI_COMM_NULL;
    b->options = *options;
    b->inertia = options->density;
    if (b->options.dimension != 2)
        b->options.plane = PD_PLANE_STRAIN; /* the index of three-dimensional stress */
    b->n_all = all;
    if (comm != MPI_COMM_NULL)
        MPI_Comm_dup(comm, &b->comm);
    status = create(b, n, X, volume, held, id);
    if (status.code == PD_OK)
        *body = b;
    else
        pd_body_destroy(b);
    return status;
}

void pd_body_destroy(pd_body *b)
{
    if (!b)
        return;
    pd_halo_end(b->halo);
    if (b->options.formulation->release)
        b->options.formulation->release(b);
    pd_halo_free(b->halo);
    if (b->comm != MPI_COMM_NULL)
        MPI_Comm_free(&b->comm);
    void *arrays[] = {b->id,      b->X,         b->y,       b->v,
                      b->volume,  b->spacing,   b->force,   b->F,
                      b->J,       b->load,      b->weight,  b->broken,
                      b->Q,       b->K_inverse, b->carries, b->hold_distance,
                      b->protect, b->length,    b->control, b->prescribed,
                      b->given,   b->kind};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        free(arrays[k]);
    pd_families_free(&b->families);
    pd_lattice_free(b->lattice);
    free(b);
}

pd_status pd_body_load(pd_body *b, const double *load)
{
    const size_t size = (size_t)b->n_owned * (size_t)b->options.dimension;
    if (!load) {
        free(b->load);
        b->load = NULL;
        return pd_status_ok();
    }
    for (size_t k = 0; k < size; k++)
        if (!usable(load[k]))
            return pd_status_fail(PD_BAD_ARGUMENT, -1, "load %g", load[k]);
    if (!b->load)
        b->load = malloc((size + 1) * sizeof *b->load);
    if (!b->load)
        return pd_status_fail(PD_NO_MEMORY, -1, "loads of %d points", b->n_owned);
    memcpy(b->load, load, size * sizeof *load);
    return pd_status_ok();
}

pd_status pd_body_set_inertia(pd_body *b, double inertia)
{
    if (!(usable(inertia) && inertia > 0))
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "inertia %g; allowed: above 0",
                              inertia);
    b->inertia = inertia;
    return pd_status_ok();
}

/* ---- views ---- */

pd_body_view pd_body_fields(const pd_body *b)
{
    return (pd_body_view){
        .dimension = b->options.dimension,
        .n_moving = b->n_moving,
        .n_active = b->n_active,
        .n_owned = b->n_owned,
        .n_local = b->n_local,
        .id = b->id,
        .given = b->given,
        .X = b->X,
        .y = b->y,
        .v = b->v,
        .volume = b->volume,
        .spacing = b->spacing,
        .force = b->force,
        .F = b->F,
        .J = b->J,
    };
}

pd_traffic pd_body_traffic(const pd_body *b)
{
    const pd_halo *h = b->halo;
    if (!h)
        return (pd_traffic){0};
    return (pd_traffic){.neighbours = h->n_partners,
                        .ghosts = (pd_local)h->n_ghost,
                        .sent = (pd_local)h->n_send,
                        .bytes = h->bytes_sent,
                        .calls = h->exchanges};
}

const pd_body_options *pd_body_settings(const pd_body *b)
{
    return &b->options;
}

pd_local pd_body_family(const pd_body *b, pd_local p, pd_local capacity,
                        pd_local *neighbour)
{
    if (p >= b->n_active)
        return 0;
    pd_family family;
    family_of(b, p, &family);
    for (pd_local k = 0; k < family.count && k < capacity; k++)
        neighbour[k] = family.neighbour[k];
    return family.count;
}

double pd_longitudinal_modulus(const pd_material *material, const double *parameters,
                               int d, pd_plane plane)
{
    double K, G;
    material->moduli(parameters, d, plane, &K, &G);
    const double E = 9 * K * G / (3 * K + G);
    if (d == 1)
        return E;
    if (d == 2 && plane == PD_PLANE_STRESS)
        return 4 * G * (3 * K + G) / (3 * K + 4 * G);
    return K + 4. / 3 * G;
}

double pd_body_longitudinal_speed(const pd_body *b)
{
    return sqrt(pd_longitudinal_modulus(b->options.material, b->options.parameters,
                                        b->options.dimension, b->options.plane) /
                b->options.density);
}

double pd_body_wave_speed(const pd_body *b)
{
    return b->options.formulation->wave_speed(b);
}

double pd_influence(double r, int dimension)
{
    return influence(r, dimension);
}

double pd_volume_fraction(double length, double horizon, double spacing)
{
    return volume_fraction(length, horizon, spacing);
}

/* ---- forces ---- */

/* The largest of the values without their signs, as bits: of the same order, and above
 * all numbers where one is none. Without a branch, so that it takes vectors. */
PD_FOR_EVERY_SET
static uint64_t largest_size(const double *values, size_t n)
{
    const uint64_t size = UINT64_MAX >> 1;
    uint64_t largest = 0;
    for (size_t k = 0; k < n; k++) {
        const uint64_t bits = bits_of(values[k]) & size;
        largest = bits > largest ? bits : largest;
    }
    return largest;
}

static pd_status check_finite(const pd_body *b, const double *values, pd_local n,
                              const char *what)
{
    const int d = b->options.dimension;
    const size_t count = (size_t)n * (size_t)d;
    if (usable(of_bits(largest_size(values, count))))
        return pd_status_ok();
    size_t k = 0;
    while (usable(values[k]))
        k++;
    return pd_status_fail(PD_NOT_FINITE, b->id[k / (size_t)d], "%s component %g", what,
                          values[k]);
}

static pd_status check_inversion(const pd_body *b)
{
    if (pd_body_can_break(&b->options) || !b->carries)
        return pd_status_ok();
    for (pd_local i = 0; i < b->n_active; i++)
        if (b->carries[i] == PD_POINT_INVERTED)
            return pd_status_fail(PD_INVERTED, b->id[i],
                                  "the volume ratio J fell to %g or below; the material "
                                  "has turned inside out",
                                  PD_SMALLEST_J);
    return pd_status_ok();
}

/* Positions and velocities that the caller, or a step, has set. */
static pd_status check_motion(const pd_body *b)
{
    PD_TRY(check_finite(b, b->y, b->n_owned, "position"));
    return check_finite(b, b->v, b->n_moving, "velocity");
}

/* Dead loads and damping, and what came of all. */
static pd_status complete_forces(pd_body *b)
{
    if (b->out_of_memory)
        return pd_status_fail(PD_NO_MEMORY, -1, "weights of broken bonds");
    const size_t moving = (size_t)b->n_moving * (size_t)b->options.dimension;
    const double eta = b->options.damping;
    if (eta > 0)
        for (size_t k = 0; k < moving; k++)
            b->force[k] -= eta * b->v[k];
    if (b->load)
        for (size_t k = 0; k < moving; k++)
            b->force[k] += b->load[k];
    PD_TRY(check_finite(b, b->force, b->n_active, "force"));
    return check_inversion(b);
}

void pd_body_send(pd_body *b)
{
    pd_halo_add(b->halo, b->y, (size_t)b->options.dimension * sizeof *b->y);
    pd_halo_begin(b->halo);
}

void pd_body_refresh(pd_body *b)
{
    if (!pd_halo_is_under_way(b->halo))
        pd_body_send(b);
    pd_halo_end(b->halo);
}

pd_status pd_body_forces(pd_body *b)
{
    if (!pd_halo_is_under_way(b->halo))
        pd_body_send(b);
    const pd_status status = pd_agree(b->comm, check_motion(b));
    if (status.code != PD_OK) {
        pd_halo_end(b->halo);
        return status;
    }
    b->options.formulation->forces(b); /* ends the exchange when it needs ghosts */
    return pd_agree(b->comm, complete_forces(b));
}

bool pd_body_has_history(const pd_body *b)
{
    return b->options.formulation->advance;
}

pd_status pd_body_advance(pd_body *b, double dt, double at)
{
    if (!b->options.formulation->advance)
        return pd_status_ok();
    PD_TRY(pd_agree(b->comm, check_finite(b, b->v, b->n_moving, "velocity")));
    b->options.formulation->advance(b, dt, at);
    return pd_status_ok();
}

void pd_body_stress(pd_body *b, double *sigma, double *plastic)
{
    pd_body_refresh(b);
    b->options.formulation->stress(b, sigma, plastic);
}

/* ---- summary ---- */

/* From sums of a rank to those of all. */
static void sum_up(MPI_Comm comm, pd_summary *s, double volume)
{
    double sum[] = {s->kinetic_energy, s->sum_volume_change, volume};
    double most[] = {-s->smallest_J, s->largest_J, s->largest_speed};
    int64_t count[] = {s->singular, s->inverted};
    pd_sum_all(comm, sum, 3);
    pd_largest_all(comm, most, 3);
    pd_count_all(comm, count, 2);
    s->kinetic_energy = sum[0], s->sum_volume_change = sum[1];
    s->smallest_J = -most[0], s->largest_J = most[1], s->largest_speed = most[2];
    s->singular = count[0], s->inverted = count[1];
    if (sum[2] > 0)
        s->mean_volume_change = s->sum_volume_change / sum[2];
    else
        s->smallest_J = s->largest_J = 1;
}

pd_summary pd_body_summary(const pd_body *b)
{
    const int d = b->options.dimension;
    pd_summary s = {.smallest_J = HUGE_VAL, .largest_J = -HUGE_VAL};
    double volume = 0;
    for (pd_local i = 0; i < b->n_moving; i++) {
        const double *v = b->v + (size_t)i * d;
        const double v2 = dot(d, v, v);
        s.kinetic_energy += 0.5 * b->options.density * b->volume[i] * v2;
        s.largest_speed = fmax(s.largest_speed, sqrt(v2));
        if (b->carries && b->carries[i] != PD_SOUND) {
            s.singular += b->carries[i] == PD_POINT_SINGULAR;
            s.inverted += b->carries[i] == PD_POINT_INVERTED;
            continue;
        }
        volume += b->volume[i];
        s.sum_volume_change += (b->J[i] - 1) * b->volume[i];
        s.smallest_J = fmin(s.smallest_J, b->J[i]);
        s.largest_J = fmax(s.largest_J, b->J[i]);
    }
    sum_up(b->comm, &s, volume);
    s.bonds = b->n_bonds;
    s.broken_bonds = pd_damage_count(b);
    return s;
}

double pd_body_strain_energy(pd_body *b)
{
    const pd_formulation *f = b->options.formulation;
    if (!f->energy)
        return 0;
    pd_body_refresh(b);
    double sum = f->energy(b);
    pd_sum_all(b->comm, &sum, 1);
    return sum;
}
