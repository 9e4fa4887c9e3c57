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
#include "influence.h"
#include "status.h"
#include "tensor.h"

/* ---- order of points ---- */

/* Kinds of points, in their order. */
enum { MOVING, BESIDE_HOLD, HELD_BESIDE, HELD_INSIDE, KINDS };

typedef struct {
    int kind;
    uint64_t code; /* place along a Morton curve, or in the lattice */
    pd_local point;
} place;

static int by_place(const void *a, const void *b)
{
    const place *p = a, *q = b;
    if (p->kind != q->kind)
        return p->kind < q->kind ? -1 : 1;
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
        return MOVING;
    const pd_local count = pd_cell_list_near(cells, i, capacity, near);
    for (pd_local k = 0; k < count && k < capacity; k++)
        if (!held[near[k]] != !held[i])
            return held[i] ? HELD_BESIDE : BESIDE_HOLD;
    return held[i] ? HELD_INSIDE : MOVING;
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

/* Sort points by kind, then so that neighbours in space are neighbours in memory; counts
 * the kinds into the body. */
static pd_status order_points(pd_body *b, const pd_cell_list *cells,
                              const unsigned char *held, place *places)
{
    const pd_local widest = widest_family(cells, held);
    pd_local *near = malloc((size_t)widest * sizeof *near), count[KINDS] = {0};
    if (!near)
        return pd_status_fail(PD_NO_MEMORY, -1, "a family of %d", widest);
    double step = HUGE_VAL;
    for (pd_local i = 0; i < b->n_owned; i++)
        step = fmin(step, cells->spacing[i]);
    for (pd_local i = 0; i < b->n_owned; i++) {
        const double *X = cells->X + (size_t)i * (size_t)cells->d;
        places[i] = (place){.kind = kind_of(cells, held, i, near, widest),
                            .code = b->lattice ? along_rows(b->lattice, X)
                                               : morton(cells->d, X, cells->origin, step),
                            .point = i};
        count[places[i].kind]++;
    }
    free(near);
    b->n_regular = b->lattice ? count[MOVING] : 0;
    b->n_moving = count[MOVING] + count[BESIDE_HOLD];
    b->n_active = b->n_moving + count[HELD_BESIDE];
    qsort(places, (size_t)b->n_owned, sizeof *places, by_place);
    return pd_status_ok();
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

static pd_status check_options(MPI_Comm comm, const pd_body_options *o, size_t n)
{
    if (comm != MPI_COMM_NULL) {
        int size;
        MPI_Comm_size(comm, &size);
        if (size != 1)
            return pd_status_fail(PD_BAD_ARGUMENT, -1, "%d ranks; this version runs on 1",
                                  size);
    }
    if (o->dimension < 1 || o->dimension > 3)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "dimension %d; allowed: 1, 2, 3",
                              o->dimension);
    if (o->plane != PD_PLANE_STRAIN && o->plane != PD_PLANE_STRESS)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "plane %d; allowed: 0, 1",
                              (int)o->plane);
    if (n < 1 || n > INT32_MAX / 16)
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
    const size_t n = (size_t)b->n_local, d = (size_t)b->options.dimension;
    b->id = malloc(n * sizeof *b->id);
    b->X = malloc(n * d * sizeof *b->X);
    b->y = malloc(n * d * sizeof *b->y);
    b->v = calloc(n * d, sizeof *b->v);
    b->volume = malloc(n * sizeof *b->volume);
    b->spacing = malloc(n * sizeof *b->spacing);
    b->force = calloc(n * d, sizeof *b->force);
    b->F = malloc(n * d * d * sizeof *b->F);
    b->J = malloc(n * sizeof *b->J);
    b->prescribed = calloc(n, sizeof *b->prescribed);
    if (!b->id || !b->X || !b->y || !b->v || !b->volume || !b->spacing || !b->force ||
        !b->F || !b->J || !b->prescribed)
        return pd_status_fail(PD_NO_MEMORY, -1, "a body of %zu points", n);
    return pd_status_ok();
}

/* Exactly: positions and volumes of a mesh are rounded. */
static void put_on_lattice(pd_body *b, pd_local i)
{
    const pd_lattice *l = b->lattice;
    double *X = b->X + (size_t)i * (size_t)l->d, *y = b->y + (size_t)i * (size_t)l->d;
    int64_t index[3] = {0};
    pd_lattice_index(l, X, index);
    for (int a = 0; a < l->d; a++)
        X[a] = y[a] = l->origin[a] + (double)index[a] * l->step;
    b->spacing[i] = l->step;
    b->volume[i] = pow(l->step, l->d);
}

/* Copy the caller's points in the order of `places` (NULL: as they come). */
static void fill(pd_body *b, const double *X, const double *volume, const place *places)
{
    const int d = b->options.dimension;
    for (pd_local i = 0; i < b->n_local; i++) {
        const size_t from = (size_t)(places ? places[i].point : i);
        b->id[i] = (pd_global)from;
        b->volume[i] = volume[from];
        b->spacing[i] = d == 1   ? volume[from]
                        : d == 2 ? sqrt(volume[from])
                                 : cbrt(volume[from]);
        b->J[i] = 1;
        identity(d, b->F + (size_t)i * d * d);
        for (int a = 0; a < d; a++) {
            b->X[(size_t)i * d + a] = X[3 * from + (size_t)a];
            b->y[(size_t)i * d + a] = X[3 * from + (size_t)a];
        }
        if (b->lattice)
            put_on_lattice(b, i);
    }
}

static pd_status build_families(pd_body *b, const double *X, const double *volume,
                                const unsigned char *held)
{
    const int d = b->options.dimension;
    const double ratio = b->options.horizon_ratio;
    PD_TRY(pd_lattice_find(&b->options, (size_t)b->n_owned, X, volume, &b->lattice));
    place *places = malloc((size_t)b->n_owned * sizeof *places);
    if (!places)
        return pd_status_fail(PD_NO_MEMORY, -1, "%d points", b->n_owned);

    fill(b, X, volume, NULL);
    pd_cell_list cells;
    pd_status status =
        pd_cell_list_create(d, b->n_owned, b->X, b->spacing, ratio, &cells);
    if (status.code == PD_OK)
        status = order_points(b, &cells, held, places);
    pd_cell_list_free(&cells);

    if (status.code == PD_OK) {
        fill(b, X, volume, places);
        status = pd_cell_list_create(d, b->n_owned, b->X, b->spacing, ratio, &cells);
        if (status.code == PD_OK)
            status = pd_families_create(&cells, b->n_regular, b->n_active, &b->families);
        pd_cell_list_free(&cells);
    }
    free(places);
    if (status.code == PD_OK && b->lattice)
        status = pd_lattice_fill(b);
    return status;
}

/* How far points beside a hold are from where it ends: the distance to the nearest point
 * of the other kind, less half that point's spacing. 0: not beside a hold. */
static pd_status measure_holds(pd_body *b)
{
    const int d = b->options.dimension;
    if (b->n_moving == b->n_active)
        return pd_status_ok();
    b->hold_distance = calloc((size_t)b->n_active, sizeof *b->hold_distance);
    if (!b->hold_distance)
        return pd_status_fail(PD_NO_MEMORY, -1, "holds of %d points", b->n_active);
    for (pd_local i = b->n_regular; i < b->n_active; i++) {
        double nearest = HUGE_VAL;
        for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++) {
            const pd_local j = b->families.neighbour[k];
            if ((i < b->n_moving) == (j < b->n_moving))
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
            ends += family.neighbour[k] < b->n_active ? 1 : 2;
        i++;
    }
    return ends / 2;
}

static pd_status create(pd_body *b, MPI_Comm comm, const double *X, const double *volume,
                        const unsigned char *held)
{
    if (comm != MPI_COMM_NULL)
        MPI_Comm_dup(comm, &b->comm);
    PD_TRY(allocate(b));
    PD_TRY(build_families(b, X, volume, held));
    PD_TRY(measure_holds(b));
    PD_TRY(b->options.formulation->prepare(b));
    PD_TRY(check_families(b));
    b->n_bonds = count_bonds(b);
    if (pd_body_can_break(&b->options))
        PD_TRY(pd_damage_allocate(b));
    return pd_status_ok();
}

pd_status pd_body_create(MPI_Comm comm, const pd_body_options *options, size_t n,
                         const double *X, const double *volume, const unsigned char *held,
                         pd_body **body)
{
    *body = NULL;
    PD_TRY(check_options(comm, options, n));
    PD_TRY(check_points(options->dimension, n, X, volume));
    pd_body *b = calloc(1, sizeof *b);
    if (!b)
        return pd_status_fail(PD_NO_MEMORY, -1, "a body");
    b->comm = MPI_COMM_NULL;
    b->options = *options;
    if (b->options.dimension != 2)
        b->options.plane = PD_PLANE_STRAIN; /* the index of three-dimensional stress */
    b->n_owned = b->n_local = (pd_local)n;
    const pd_status status = create(b, comm, X, volume, held);
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
    if (b->options.formulation->release)
        b->options.formulation->release(b);
    if (b->comm != MPI_COMM_NULL)
        MPI_Comm_free(&b->comm);
    void *arrays[] = {b->id,      b->X,         b->y,       b->v,
                      b->volume,  b->spacing,   b->force,   b->F,
                      b->J,       b->load,      b->weight,  b->broken,
                      b->Q,       b->K_inverse, b->carries, b->hold_distance,
                      b->protect, b->length,    b->control, b->prescribed};
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
        b->load = malloc(size * sizeof *b->load);
    if (!b->load)
        return pd_status_fail(PD_NO_MEMORY, -1, "loads of %d points", b->n_owned);
    memcpy(b->load, load, size * sizeof *load);
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

pd_status pd_body_forces(pd_body *b)
{
    PD_TRY(check_finite(b, b->y, b->n_local, "position"));
    PD_TRY(check_finite(b, b->v, b->n_moving, "velocity"));
    b->options.formulation->forces(b);
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

bool pd_body_has_history(const pd_body *b)
{
    return b->options.formulation->advance;
}

pd_status pd_body_advance(pd_body *b, double dt, double at)
{
    if (!b->options.formulation->advance)
        return pd_status_ok();
    PD_TRY(check_finite(b, b->v, b->n_moving, "velocity"));
    b->options.formulation->advance(b, dt, at);
    return pd_status_ok();
}

void pd_body_stress(const pd_body *b, double *sigma, double *plastic)
{
    b->options.formulation->stress(b, sigma, plastic);
}

/* ---- summary ---- */

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
    if (volume > 0)
        s.mean_volume_change = s.sum_volume_change / volume;
    else
        s.smallest_J = s.largest_J = 1;
    s.bonds = b->n_bonds;
    s.broken_bonds = pd_damage_count(b);
    return s;
}

double pd_body_strain_energy(const pd_body *b)
{
    const pd_formulation *f = b->options.formulation;
    return f->energy ? f->energy(b) : 0;
}
