/*
 * The state of a body in a file and back; docs/files.md has the layout.
 *
 * A body is created as ever and then takes its state from the file: first the bonds that
 * are broken, from which the formulation derives weights and shape tensors as it does
 * after pre-cracks; then positions, velocities, forces, F, J and what else it keeps.
 * Nothing is evaluated in between that could break a bond.
 *
 * Rows are those of points, by the caller's numbers, so that a file depends neither on
 * the order of points in memory nor on who owns them. Of bonds the file has, for each
 * point, those to larger numbers, in their order.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "body.h"
#include "collective.h"
#include "damage.h"
#include "hdf5_file.h"
#include "rows.h"
#include "status.h"

static const pd_file_kind kind = {"checkpoint", 1};

/* ---- what is kept of every body ---- */

/* Which points have values in memory. */
typedef enum { OWNED, LOCAL } reach;

typedef struct {
    const char *name, *unit, *description;
    int power;     /* d^power numbers a point */
    size_t array;  /* where pd_body has it */
    reach points;  /* that take it from a file */
    bool is_fixed; /* the same for the whole life of a body */
} point_array;

static const point_array point_arrays[] = {
    {"reference", "m", "position at rest", 1, offsetof(pd_body, X), OWNED, true},
    {"volume", "m^d", "volume at rest", 0, offsetof(pd_body, volume), OWNED, true},
    {"position", "m", "current position", 1, offsetof(pd_body, y), LOCAL, false},
    {"velocity", "m/s", "velocity", 1, offsetof(pd_body, v), LOCAL, false},
    {"force", "N/m^d", "force density, dead load and damping included", 1,
     offsetof(pd_body, force), OWNED, false},
    {"F", "-", "non-local deformation gradient, row by row", 2, offsetof(pd_body, F),
     LOCAL, false},
    {"J", "-", "det F", 0, offsetof(pd_body, J), LOCAL, false},
};

enum { POINT_ARRAYS = sizeof point_arrays / sizeof *point_arrays };

static const pd_rows_of held_rows = {"held", "-", "1: the point never moves", PD_BYTE, 1};
static const pd_rows_of carries_rows = {
    "carries", "-", "0: it bears stress; 1: singular; 2: inverted", PD_BYTE, 1};

/* Lists: how long they are, and the other ends. */
typedef struct {
    pd_rows_of count, partner;
} list_rows;

static const list_rows broken_lists = {
    {"brokenBonds", "-", "broken bonds of each point to points of larger number",
     PD_INT32, 1},
    {"brokenPartner", "-", "the other end of each, point by point", PD_INT64, 1}};
static const list_rows pair_lists = {
    {"pairs", "-", "bonds with a state, of each point to points of larger number",
     PD_INT32, 1},
    {"pairPartner", "-", "the other end of each, point by point", PD_INT64, 1}};

static pd_rows_of rows_of_array(const point_array *a, int d)
{
    const int width = a->power == 0 ? 1 : a->power == 1 ? d : d * d;
    return (pd_rows_of){a->name, a->unit, a->description, PD_DOUBLE, width};
}

static pd_rows_of rows_of_kept(const pd_kept *k)
{
    return (pd_rows_of){k->name, k->unit, k->description, PD_DOUBLE, k->width};
}

static double *array_of(const pd_body *b, const point_array *a)
{
    double *values;
    memcpy(&values, (const char *)b + a->array, sizeof values);
    return values;
}

static int kept_of(pd_body *b, pd_kept *kept)
{
    const pd_formulation *f = b->options.formulation;
    return f->keep ? f->keep(b, kept) : 0;
}

/* ---- points and bonds ---- */

/* Is the family of a point known on this rank? */
static bool is_active(const pd_body *b, pd_local i)
{
    return i < b->n_active || (i >= b->n_owned && i < b->near.active);
}

/* Has the bond from i to j, of a point that keeps its family, a state here? */
static bool is_pair(const pd_body *b, pd_local i, pd_local j)
{
    return is_held(b, i) ? j >= b->n_owned && !is_held(b, j) : j > i;
}

/* Call visit for every pair, see pd_kept, in order. */
typedef void visitor(void *context, size_t pair, pd_local i, pd_local j);

static size_t visit_pairs(const pd_body *b, visitor *visit, void *context)
{
    size_t pair = 0;
    for (pd_local i = 0; i < b->n_active; i++)
        for (int64_t k = b->families.first[i]; k < b->families.first[i + 1]; k++)
            if (is_pair(b, i, b->families.neighbour[k])) {
                if (visit)
                    visit(context, pair, i, b->families.neighbour[k]);
                pair++;
            }
    return pair;
}

static pd_status no_memory(size_t n)
{
    return pd_status_fail(PD_NO_MEMORY, -1, "a checkpoint of %zu numbers", n);
}

/* Did the ranks get what they asked for? Collective. */
static pd_status have(const pd_body *b, const void *memory, size_t n)
{
    return pd_agree(b->comm, memory ? pd_status_ok() : no_memory(n));
}

/* ---- what must be the same ---- */

/* One number that makes a body what it is, and how far it binds. */
typedef struct {
    char name[64];
    double value;
    bool may_change;
} fact;

enum { MOST_FACTS = 10 + 2 * PD_MAX_PARAMETERS };

static size_t facts_of(const pd_body *b, fact *facts)
{
    const pd_body_options *o = &b->options;
    size_t n = 0;
    facts[n++] = (fact){"dimension", o->dimension, false};
    facts[n++] = (fact){"plane", o->plane, false};
    facts[n++] = (fact){"horizonRatio", o->horizon_ratio, false};
    facts[n++] = (fact){"density", o->density, false};
    facts[n++] = (fact){"damping", o->damping, true};
    facts[n++] = (fact){"criticalStretch", o->critical_stretch, true};
    facts[n++] = (fact){"energyRelease", o->energy_release, true};
    facts[n++] = (fact){"criticalStress", o->critical_stress, true};
    facts[n++] = (fact){"failedStrain", o->failed_strain, true};
    facts[n++] = (fact){"soundStrain", o->sound_strain, true};
    for (int k = 0; k < o->formulation->n_parameters; k++, n++) {
        facts[n] = (fact){.value = o->formulation_parameters[k]};
        snprintf(facts[n].name, sizeof facts[n].name, "formulation.%s",
                 o->formulation->parameters[k].key);
    }
    for (int k = 0; k < o->material->n_parameters; k++, n++) {
        facts[n] = (fact){.value = o->parameters[k]};
        snprintf(facts[n].name, sizeof facts[n].name, "material.%s",
                 o->material->parameters[k].key);
    }
    return n;
}

static pd_status save_facts(const pd_body *b, pd_file *file)
{
    fact facts[MOST_FACTS];
    const size_t n = facts_of(b, facts);
    PD_TRY(pd_file_put_text(file, "formulation", b->options.formulation->name));
    PD_TRY(pd_file_put_text(file, "material", b->options.material->name));
    PD_TRY(pd_file_put_integer(file, "points", b->n_all));
    for (size_t k = 0; k < n; k++)
        PD_TRY(pd_file_put_number(file, facts[k].name, facts[k].value));
    return pd_status_ok();
}

static pd_status check_word(pd_file *file, const char *name, const char *ours)
{
    char theirs[48];
    PD_TRY(pd_file_text(file, name, sizeof theirs, theirs));
    if (strcmp(theirs, ours) != 0)
        return pd_file_error(pd_file_path(file), "%s %s; that of the body: %s", name,
                             theirs, ours);
    return pd_status_ok();
}

static pd_status check_facts(const pd_body *b, pd_file *file)
{
    fact facts[MOST_FACTS];
    const size_t n = facts_of(b, facts);
    int64_t points;
    PD_TRY(check_word(file, "formulation", b->options.formulation->name));
    PD_TRY(check_word(file, "material", b->options.material->name));
    for (size_t k = 0; k < n; k++) {
        double theirs;
        PD_TRY(pd_file_number(file, facts[k].name, &theirs));
        if (theirs != facts[k].value && !facts[k].may_change)
            return pd_file_error(pd_file_path(file), "%s %.17g; that of the body: %.17g",
                                 facts[k].name, theirs, facts[k].value);
    }
    PD_TRY(pd_file_integer(file, "points", &points));
    if (points != b->n_all)
        return pd_file_error(pd_file_path(file), "%lld points; the body has %lld",
                             (long long)points, (long long)b->n_all);
    return pd_status_ok();
}

/* ---- notes ---- */

static const char note_prefix[] = "note.";

static void name_of_note(const pd_note *note, char *name, size_t size)
{
    snprintf(name, size, "%s%.*s", note_prefix, (int)sizeof note->name, note->name);
}

static bool ends(const char *text, size_t size)
{
    return memchr(text, 0, size);
}

static pd_status check_notes(size_t n, const pd_note *notes)
{
    if (n > PD_MAX_NOTES)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "%zu notes; allowed: %d", n,
                              PD_MAX_NOTES);
    for (size_t k = 0; k < n; k++) {
        if (!ends(notes[k].name, sizeof notes[k].name) || notes[k].name[0] == 0 ||
            (notes[k].kind == PD_NOTE_TEXT && !ends(notes[k].text, sizeof notes[k].text)))
            return pd_status_fail(PD_BAD_ARGUMENT, -1,
                                  "note %zu has no name, or does not end", k);
        for (size_t m = 0; m < k; m++)
            if (strcmp(notes[k].name, notes[m].name) == 0)
                return pd_status_fail(PD_BAD_ARGUMENT, -1, "two notes are called %s",
                                      notes[k].name);
    }
    return pd_status_ok();
}

static pd_status save_notes(pd_file *file, size_t n, const pd_note *notes)
{
    for (size_t k = 0; k < n; k++) {
        char name[80];
        name_of_note(&notes[k], name, sizeof name);
        if (notes[k].kind == PD_NOTE_NUMBER)
            PD_TRY(pd_file_put_number(file, name, notes[k].number));
        else if (notes[k].kind == PD_NOTE_INTEGER)
            PD_TRY(pd_file_put_integer(file, name, notes[k].integer));
        else
            PD_TRY(pd_file_put_text(file, name, notes[k].text));
    }
    return pd_status_ok();
}

static pd_status load_note(pd_file *file, pd_note *note)
{
    char name[80];
    name_of_note(note, name, sizeof name);
    if (note->kind == PD_NOTE_NUMBER)
        return pd_file_number(file, name, &note->number);
    if (note->kind == PD_NOTE_INTEGER)
        return pd_file_integer(file, name, &note->integer);
    return pd_file_text(file, name, sizeof note->text, note->text);
}

static pd_status load_notes(pd_file *file, size_t n, pd_note *notes)
{
    for (size_t k = 0; k < n; k++)
        PD_TRY(load_note(file, &notes[k]));
    return pd_status_ok();
}

/* Which kind it is of is for the file to say. */
static pd_status find_notes(pd_file *file, pd_checkpoint_facts *facts)
{
    enum { SIZE = sizeof note_prefix + sizeof facts->notes->name - 1 };
    char names[PD_MAX_NOTES][SIZE];
    facts->n_notes = pd_file_names(file, note_prefix, PD_MAX_NOTES, SIZE, names[0]);
    for (size_t k = 0; k < facts->n_notes; k++) {
        pd_note *note = &facts->notes[k];
        pd_status status = {.code = PD_FILE_ERROR};
        strcpy(note->name, names[k] + strlen(note_prefix));
        for (int kind_of = 0; status.code != PD_OK && kind_of <= PD_NOTE_TEXT;
             kind_of++) {
            if (kind_of == PD_NOTE_NUMBER)
                note->kind = PD_NOTE_NUMBER;
            else
                note->kind = kind_of == PD_NOTE_INTEGER ? PD_NOTE_INTEGER : PD_NOTE_TEXT;
            status = load_note(file, note);
        }
        PD_TRY(status);
    }
    return pd_status_ok();
}

/* ---- arrays of points ---- */

/* Write values of `size` bytes of the owned points, in order. */
static pd_status save_points(const pd_rows *rows, pd_file *file, const pd_rows_of *what,
                             size_t size, const void *values)
{
    const int64_t mine = pd_rows_mine(rows);
    void *block = malloc((size_t)mine * size + 1);
    pd_status status = pd_agree(rows->comm, block ? pd_status_ok() : no_memory(size));
    if (status.code == PD_OK)
        status = pd_rows_put(rows, size, values, block);
    if (status.code == PD_OK)
        status = pd_file_write(file, what, mine, block);
    free(block);
    return status;
}

/* Read those of the first n local points. */
static pd_status load_points(const pd_body *b, const pd_rows *rows, pd_file *file,
                             const pd_rows_of *what, size_t size, pd_local n,
                             void *values)
{
    const int64_t mine = pd_rows_mine(rows);
    int64_t count;
    PD_TRY(pd_file_count(file, what, &count));
    if (count != rows->all)
        return pd_file_error(pd_file_path(file), "%lld rows of %s for %lld points",
                             (long long)count, what->name, (long long)rows->all);
    void *block = malloc((size_t)mine * size + 1);
    pd_status status = have(b, block, (size_t)mine);
    if (status.code == PD_OK)
        status = pd_file_read(file, what, rows->first, mine, block);
    if (status.code == PD_OK)
        status = pd_rows_fetch(rows, size, block, (size_t)n, b->id, values);
    free(block);
    return status;
}

static pd_status save_arrays(const pd_body *b, const pd_rows *rows, pd_file *file)
{
    for (int k = 0; k < POINT_ARRAYS; k++) {
        const pd_rows_of what = rows_of_array(&point_arrays[k], b->options.dimension);
        PD_TRY(save_points(rows, file, &what, (size_t)what.width * sizeof(double),
                           array_of(b, &point_arrays[k])));
    }
    return pd_status_ok();
}

/* Of spacing and volume. Centres and volumes of a mesh's cells differ in their last
 * digits when it is decomposed in another way, for its faces may be turned round. */
static const double rounding = 1e-9;

/* Is a row of point i the same? Bytes have to be equal. */
static bool is_same(const pd_body *b, pd_local i, const pd_rows_of *what, size_t size,
                    const void *theirs, const void *ours)
{
    if (what->cell == PD_BYTE)
        return memcmp(theirs, ours, size) == 0;
    const double *t = theirs, *o = ours;
    const double allowed = rounding * (o == &b->volume[i] ? b->volume[i] : b->spacing[i]);
    for (int k = 0; k < what->width; k++)
        if (!(fabs(t[k] - o[k]) <= allowed))
            return false;
    return true;
}

static pd_status compare_points(const pd_body *b, pd_file *file, const pd_rows_of *what,
                                size_t size, const void *theirs, const void *ours)
{
    for (pd_local i = 0; i < b->n_owned; i++)
        if (!is_same(b, i, what, size, (const char *)theirs + (size_t)i * size,
                     (const char *)ours + (size_t)i * size)) {
            pd_status status = pd_file_error(
                pd_file_path(file), "point %lld has another %s than that of the body",
                (long long)b->id[i], what->description);
            status.point = b->id[i];
            return status;
        }
    return pd_status_ok();
}

static pd_status check_points(const pd_body *b, const pd_rows *rows, pd_file *file,
                              const pd_rows_of *what, size_t size, const void *ours)
{
    void *theirs = malloc((size_t)b->n_owned * size + 1);
    pd_status status = have(b, theirs, (size_t)b->n_owned);
    if (status.code == PD_OK)
        status = load_points(b, rows, file, what, size, b->n_owned, theirs);
    if (status.code == PD_OK)
        status = pd_agree(b->comm, compare_points(b, file, what, size, theirs, ours));
    free(theirs);
    return status;
}

/* Arrays that never change are compared, the others taken. */
static pd_status load_arrays(const pd_body *b, const pd_rows *rows, pd_file *file,
                             bool fixed)
{
    for (int k = 0; k < POINT_ARRAYS; k++) {
        const point_array *a = &point_arrays[k];
        const pd_rows_of what = rows_of_array(a, b->options.dimension);
        const size_t size = (size_t)what.width * sizeof(double);
        if (a->is_fixed != fixed)
            continue;
        if (fixed)
            PD_TRY(check_points(b, rows, file, &what, size, array_of(b, a)));
        else
            PD_TRY(load_points(b, rows, file, &what, size,
                               a->points == LOCAL ? b->n_local : b->n_owned,
                               array_of(b, a)));
    }
    return pd_status_ok();
}

/* held[n_owned]; the caller's to free. */
static unsigned char *find_held(const pd_body *b)
{
    unsigned char *held = malloc((size_t)b->n_owned + 1);
    for (pd_local i = 0; held && i < b->n_owned; i++)
        held[i] = is_held(b, i);
    return held;
}

static pd_status save_bytes(const pd_body *b, const pd_rows *rows, pd_file *file)
{
    unsigned char *bytes = find_held(b);
    pd_status status = have(b, bytes, (size_t)b->n_owned);
    if (status.code == PD_OK)
        status = save_points(rows, file, &held_rows, 1, bytes);
    if (status.code == PD_OK && b->carries) {
        for (pd_local i = 0; i < b->n_owned; i++)
            bytes[i] = is_active(b, i) ? b->carries[i] : PD_SOUND;
        status = save_points(rows, file, &carries_rows, 1, bytes);
    }
    free(bytes);
    return status;
}

static pd_status check_held(const pd_body *b, const pd_rows *rows, pd_file *file)
{
    unsigned char *held = find_held(b);
    pd_status status = have(b, held, (size_t)b->n_owned);
    if (status.code == PD_OK)
        status = check_points(b, rows, file, &held_rows, 1, held);
    free(held);
    return status;
}

static pd_status load_carries(const pd_body *b, const pd_rows *rows, pd_file *file)
{
    if (!b->carries)
        return pd_status_ok();
    unsigned char *bytes = malloc((size_t)b->n_local + 1);
    pd_status status = have(b, bytes, (size_t)b->n_local);
    if (status.code == PD_OK)
        status = load_points(b, rows, file, &carries_rows, 1, b->n_local, bytes);
    for (pd_local i = 0; i < b->n_local && status.code == PD_OK; i++)
        if (bytes[i] > PD_POINT_INVERTED)
            status = pd_file_error(pd_file_path(file), "point %lld carries %d",
                                   (long long)b->id[i], bytes[i]);
        else
            b->carries[i] = bytes[i];
    free(bytes);
    return pd_agree(b->comm, status);
}

/* ---- lists in a file ---- */

static pd_status save_counts(const pd_rows *rows, pd_file *file, const list_rows *what,
                             const pd_lists *lists)
{
    const int64_t mine = pd_rows_mine(rows), n = lists->first[mine];
    int32_t *count = malloc(((size_t)mine + 1) * sizeof *count);
    pd_global *partner = malloc(((size_t)n + 1) * sizeof *partner);
    pd_status status = pd_agree(
        rows->comm, count && partner ? pd_status_ok() : no_memory((size_t)(mine + n)));
    if (status.code == PD_OK) {
        for (int64_t k = 0; k < mine; k++)
            count[k] = (int32_t)(lists->first[k + 1] - lists->first[k]);
        for (int64_t e = 0; e < n; e++)
            memcpy(&partner[e], lists->entry + (size_t)e * lists->size, sizeof *partner);
        status = pd_file_write(file, &what->count, mine, count);
    }
    if (status.code == PD_OK)
        status = pd_file_write(file, &what->partner, n, partner);
    free(count);
    free(partner);
    return status;
}

/* first[mine + 1] from the counts of this rank's rows, none of which may lead beyond the
 * `all` entries that there are. */
static pd_status sum_counts(const pd_file *file, const list_rows *what, int64_t mine,
                            const int32_t *count, int64_t all, int64_t *first)
{
    first[0] = 0;
    for (int64_t k = 0; k < mine; k++) {
        if (count[k] < 0 || count[k] > all - first[k])
            return pd_file_error(pd_file_path(file), "%s do not add up",
                                 what->count.name);
        first[k + 1] = first[k] + count[k];
    }
    return pd_status_ok();
}

/* Read lists->first of this rank's rows; *before: entries of the ranks before. */
static pd_status load_counts(const pd_rows *rows, pd_file *file, const list_rows *what,
                             pd_lists *lists, int64_t *before)
{
    const int64_t mine = pd_rows_mine(rows);
    int64_t count_rows, all;
    PD_TRY(pd_file_count(file, &what->count, &count_rows));
    PD_TRY(pd_file_count(file, &what->partner, &all));
    if (count_rows != rows->all)
        return pd_file_error(pd_file_path(file), "%lld rows of %s for %lld points",
                             (long long)count_rows, what->count.name,
                             (long long)rows->all);
    int32_t *count = malloc(((size_t)mine + 1) * sizeof *count);
    lists->first = malloc(((size_t)mine + 1) * sizeof *lists->first);
    pd_status status = pd_agree(
        rows->comm, count && lists->first ? pd_status_ok() : no_memory((size_t)mine));
    if (status.code == PD_OK)
        status = pd_file_read(file, &what->count, rows->first, mine, count);
    if (status.code == PD_OK)
        status =
            pd_agree(rows->comm, sum_counts(file, what, mine, count, all, lists->first));
    free(count);
    PD_TRY(status);
    int64_t sum = lists->first[mine];
    *before = pd_count_before(rows->comm, sum);
    pd_count_all(rows->comm, &sum, 1);
    if (sum != all)
        return pd_file_error(pd_file_path(file), "%s do not add up", what->count.name);
    return pd_status_ok();
}

/* Read this rank's lists: entries of a partner and, if `of` is there, a row of it. */
static pd_status load_lists(const pd_rows *rows, pd_file *file, const list_rows *what,
                            const pd_rows_of *of, pd_lists *lists)
{
    const size_t width = of ? (size_t)of->width * sizeof(double) : 0;
    int64_t before = 0, all, all_of = 0;
    *lists = (pd_lists){.size = sizeof(pd_global) + width};
    PD_TRY(load_counts(rows, file, what, lists, &before));
    PD_TRY(pd_file_count(file, &what->partner, &all));
    if (of)
        PD_TRY(pd_file_count(file, of, &all_of));
    if (of && all_of != all)
        return pd_file_error(pd_file_path(file), "%lld rows of %s; expected: %lld",
                             (long long)all_of, of->name, (long long)all);
    const int64_t n = lists->first[pd_rows_mine(rows)];
    pd_global *partner = malloc(((size_t)n + 1) * sizeof *partner);
    char *values = malloc((size_t)n * width + 1);
    lists->entry = malloc((size_t)n * lists->size + 1);
    pd_status status =
        pd_agree(rows->comm, partner && values && lists->entry ? pd_status_ok()
                                                               : no_memory((size_t)n));
    if (status.code == PD_OK)
        status = pd_file_read(file, &what->partner, before, n, partner);
    if (status.code == PD_OK && of)
        status = pd_file_read(file, of, before, n, values);
    for (int64_t e = 0; e < n && status.code == PD_OK; e++) {
        char *entry = lists->entry + (size_t)e * lists->size;
        memcpy(entry, &partner[e], sizeof *partner);
        memcpy(entry + sizeof *partner, values + (size_t)e * width, width);
    }
    free(partner);
    free(values);
    return status;
}

/* The same, and then the lists of all local points. */
static pd_status fetch_lists(const pd_body *b, const pd_rows *rows, pd_file *file,
                             const list_rows *what, const pd_rows_of *of, pd_lists *lists)
{
    pd_lists blocks;
    *lists = (pd_lists){0};
    pd_status status = load_lists(rows, file, what, of, &blocks);
    if (status.code == PD_OK)
        status = pd_rows_fetch_lists(rows, &blocks, (size_t)b->n_local, b->id, lists);
    pd_lists_free(&blocks);
    return status;
}

/* What the list of the bond's end of smaller number says of it; NULL: nothing. */
static const char *find_bond(const pd_body *b, const pd_lists *lists, pd_local i,
                             pd_local j)
{
    const pd_local row = b->id[i] < b->id[j] ? i : j;
    const pd_global partner = b->id[i] < b->id[j] ? b->id[j] : b->id[i];
    int64_t low = lists->first[row], high = lists->first[row + 1];
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        const char *entry = lists->entry + (size_t)middle * lists->size;
        pd_global key;
        memcpy(&key, entry, sizeof key);
        if (key == partner)
            return entry + sizeof key;
        if (key < partner)
            low = middle + 1;
        else
            high = middle;
    }
    return NULL;
}

/* ---- broken bonds ---- */

typedef struct {
    size_t n;
    pd_global *row, *partner; /* [n]; NULL: they are only counted */
} bond_list;

static void list_bond(const pd_body *b, bond_list *list, pd_local i, pd_local j)
{
    const bool up = b->id[i] < b->id[j];
    if (list->row) {
        list->row[list->n] = b->id[up ? i : j];
        list->partner[list->n] = b->id[up ? j : i];
    }
    list->n++;
}

/* Broken bonds, from the end of smaller number if that keeps a family. */
static void list_broken(const pd_body *b, bond_list *list)
{
    pd_family family;
    list->n = 0;
    for (pd_local i = 0; b->broken && i < b->n_owned; i++) {
        if (!is_active(b, i))
            continue;
        family_of(b, i, &family);
        for (pd_local k = 0; k < family.count; k++) {
            const pd_local j = family.neighbour[k];
            if (family_broken(&family, k) && (b->id[i] < b->id[j] || !keeps_family(b, j)))
                list_bond(b, list, i, j);
        }
    }
}

static pd_status save_broken(const pd_body *b, const pd_rows *rows, pd_file *file)
{
    bond_list list = {0};
    pd_lists lists = {0};
    list_broken(b, &list);
    pd_global *row = malloc((list.n + 1) * sizeof *row);
    pd_global *partner = malloc((list.n + 1) * sizeof *partner);
    pd_status status = have(b, row && partner ? row : NULL, list.n);
    if (status.code == PD_OK) {
        list.row = row;
        list.partner = partner;
        list_broken(b, &list);
        status = pd_rows_put_lists(rows, sizeof *partner, list.n, row, partner, &lists);
    }
    if (status.code == PD_OK)
        status = save_counts(rows, file, &broken_lists, &lists);
    pd_lists_free(&lists);
    free(row);
    free(partner);
    return status;
}

static void break_bond(pd_body *b, pd_local i, const pd_family *family, pd_local k)
{
    if (family->offset) {
        pd_chunk *chunk = pd_lattice_chunk(b, i);
        pd_damage_break_regular(b, chunk, (int)(i - chunk->point), family->offset[k]);
    } else
        pd_damage_break(b, family->base + k);
}

/* Break the listed bonds wherever a family here has them. ends[0]: those listed, seen
 * from the points of this rank, ends[1]: all that are broken now. */
static void break_listed(pd_body *b, const pd_lists *lists, int64_t *ends_of)
{
    pd_family family;
    for (pd_local i = 0; i < b->n_local; i++) {
        if (!is_active(b, i))
            continue;
        family_of(b, i, &family);
        for (pd_local k = 0; k < family.count; k++) {
            const pd_local j = family.neighbour[k];
            const bool listed = find_bond(b, lists, i, j);
            const int64_t count = i >= b->n_owned ? 0 : keeps_family(b, j) ? 1 : 2;
            ends_of[0] += listed ? count : 0;
            ends_of[1] += listed || family_broken(&family, k) ? count : 0;
            if (listed && !family_broken(&family, k))
                break_bond(b, i, &family, k);
        }
    }
}

/* Are the bonds that are broken those of the file, no less and no more? */
static pd_status compare_broken(const pd_body *b, pd_file *file, int64_t all,
                                int64_t *ends_of)
{
    pd_count_all(b->comm, ends_of, 2);
    const long long listed = (long long)ends_of[0] / 2,
                    broken = (long long)ends_of[1] / 2;
    if (listed != all)
        return pd_file_error(pd_file_path(file),
                             "%lld broken bonds, %lld of which the body does not have",
                             (long long)all, (long long)all - listed);
    if (broken != all)
        return pd_file_error(pd_file_path(file),
                             "%lld bonds are intact there and broken in the body; it "
                             "must be new, with the same pre-cracks",
                             broken - listed);
    return pd_status_ok();
}

static pd_status load_broken(pd_body *b, const pd_rows *rows, pd_file *file)
{
    int64_t all, ends_of[2] = {0, 0};
    pd_lists lists;
    PD_TRY(pd_file_count(file, &broken_lists.partner, &all));
    pd_status status = fetch_lists(b, rows, file, &broken_lists, NULL, &lists);
    if (status.code == PD_OK && all > 0)
        status = pd_agree(b->comm, pd_damage_allocate(b));
    if (status.code == PD_OK) {
        break_listed(b, &lists, ends_of);
        status =
            pd_agree(b->comm, b->out_of_memory ? no_memory((size_t)all) : pd_status_ok());
    }
    if (status.code == PD_OK)
        status = compare_broken(b, file, all, ends_of);
    pd_lists_free(&lists);
    if (status.code == PD_OK)
        status = pd_agree(b->comm, b->options.formulation->prepare(b));
    return status;
}

/* ---- what formulations keep ---- */

typedef struct {
    const pd_body *b;
    const pd_kept *kept; /* NULL: partners alone */
    size_t size;
    pd_global *row;
    char *entry;
} pair_entries;

static void list_pair(void *context, size_t pair, pd_local i, pd_local j)
{
    pair_entries *list = context;
    const pd_global *id = list->b->id, a = id[i] < id[j] ? id[i] : id[j];
    const pd_global partner = id[i] < id[j] ? id[j] : id[i];
    char *entry = list->entry + pair * list->size;
    list->row[pair] = a;
    memcpy(entry, &partner, sizeof partner);
    if (list->kept)
        memcpy(entry + sizeof partner,
               list->kept->values + pair * (size_t)list->kept->width,
               list->size - sizeof partner);
}

static pd_status write_entries(const pd_rows *rows, pd_file *file, const pd_kept *kept,
                               const pd_lists *lists)
{
    const pd_rows_of what = rows_of_kept(kept);
    const int64_t n = lists->first[pd_rows_mine(rows)];
    const size_t width = (size_t)kept->width * sizeof(double);
    char *values = malloc((size_t)n * width + 1);
    pd_status status =
        pd_agree(rows->comm, values ? pd_status_ok() : no_memory((size_t)n));
    for (int64_t e = 0; e < n && status.code == PD_OK; e++)
        memcpy(values + (size_t)e * width,
               lists->entry + (size_t)e * lists->size + sizeof(pd_global), width);
    if (status.code == PD_OK)
        status = pd_file_write(file, &what, n, values);
    free(values);
    return status;
}

/* Write an array of pairs; kept == NULL: which pairs there are. */
static pd_status save_pairs(const pd_body *b, const pd_rows *rows, pd_file *file,
                            const pd_kept *kept)
{
    const size_t n = visit_pairs(b, NULL, NULL);
    const size_t size =
        sizeof(pd_global) + (kept ? (size_t)kept->width * sizeof(double) : 0);
    pair_entries list = {b, kept, size, malloc((n + 1) * sizeof *list.row),
                         malloc(n * size + 1)};
    pd_lists lists = {0};
    pd_status status = have(b, list.row && list.entry ? list.row : NULL, n);
    if (status.code == PD_OK) {
        visit_pairs(b, list_pair, &list);
        status = pd_rows_put_lists(rows, size, n, list.row, list.entry, &lists);
    }
    free(list.row);
    free(list.entry);
    if (status.code == PD_OK)
        status = kept ? write_entries(rows, file, kept, &lists)
                      : save_counts(rows, file, &pair_lists, &lists);
    pd_lists_free(&lists);
    return status;
}

static pd_status save_kept_points(const pd_body *b, const pd_rows *rows, pd_file *file,
                                  const pd_kept *kept)
{
    const pd_rows_of what = rows_of_kept(kept);
    const size_t size = (size_t)kept->width * sizeof(double);
    char *values = calloc((size_t)b->n_owned + 1, size);
    pd_status status = have(b, values, (size_t)b->n_owned);
    if (status.code == PD_OK) {
        const pd_local n = kept->n < b->n_owned ? kept->n : b->n_owned;
        memcpy(values, kept->values, (size_t)n * size);
        status = save_points(rows, file, &what, size, values);
    }
    free(values);
    return status;
}

static pd_status save_kept(pd_body *b, const pd_rows *rows, pd_file *file)
{
    pd_kept kept[PD_MAX_KEPT];
    const int n = kept_of(b, kept);
    bool has_pairs = false;
    for (int k = 0; k < n; k++)
        has_pairs = has_pairs || kept[k].of == PD_OF_PAIRS;
    if (has_pairs)
        PD_TRY(save_pairs(b, rows, file, NULL));
    for (int k = 0; k < n; k++)
        PD_TRY(kept[k].of == PD_OF_PAIRS ? save_pairs(b, rows, file, &kept[k])
                                         : save_kept_points(b, rows, file, &kept[k]));
    return pd_status_ok();
}

typedef struct {
    const pd_body *b;
    const pd_kept *kept;
    const pd_lists *lists;
    pd_local missing[2]; /* ends of a pair that the file does not have; -1 */
} pair_values;

static void take_pair(void *context, size_t pair, pd_local i, pd_local j)
{
    pair_values *list = context;
    const size_t width = (size_t)list->kept->width;
    const char *found = find_bond(list->b, list->lists, i, j);
    if (found)
        memcpy(list->kept->values + pair * width, found, width * sizeof(double));
    else
        list->missing[0] = i, list->missing[1] = j;
}

static pd_status load_pairs(const pd_body *b, const pd_rows *rows, pd_file *file,
                            const pd_kept *kept)
{
    const pd_rows_of what = rows_of_kept(kept);
    pd_lists lists;
    pair_values list = {b, kept, &lists, {-1, -1}};
    pd_status status = fetch_lists(b, rows, file, &pair_lists, &what, &lists);
    if (status.code == PD_OK) {
        visit_pairs(b, take_pair, &list);
        if (list.missing[0] >= 0)
            status = pd_file_error(
                pd_file_path(file), "no %s of the bond from %lld to %lld", kept->name,
                (long long)b->id[list.missing[0]], (long long)b->id[list.missing[1]]);
        status = pd_agree(b->comm, status);
    }
    pd_lists_free(&lists);
    return status;
}

/* Values of points that have none are left as they are. */
static pd_status load_kept_points(const pd_body *b, const pd_rows *rows, pd_file *file,
                                  const pd_kept *kept)
{
    const pd_rows_of what = rows_of_kept(kept);
    return load_points(b, rows, file, &what, (size_t)kept->width * sizeof(double),
                       kept->n, kept->values);
}

static pd_status load_kept(pd_body *b, const pd_rows *rows, pd_file *file)
{
    pd_kept kept[PD_MAX_KEPT];
    const int n = kept_of(b, kept);
    for (int k = 0; k < n; k++) {
        if (kept[k].may_lack && !pd_file_has(file, kept[k].name))
            continue;
        PD_TRY(kept[k].of == PD_OF_PAIRS ? load_pairs(b, rows, file, &kept[k])
                                         : load_kept_points(b, rows, file, &kept[k]));
    }
    return pd_status_ok();
}

/* ---- all of it ---- */

static pd_status save_all(pd_body *b, const pd_rows *rows, pd_file *file, size_t n_notes,
                          const pd_note *notes)
{
    PD_TRY(save_facts(b, file));
    PD_TRY(save_notes(file, n_notes, notes));
    PD_TRY(save_arrays(b, rows, file));
    PD_TRY(save_bytes(b, rows, file));
    PD_TRY(save_broken(b, rows, file));
    return save_kept(b, rows, file);
}

pd_status pd_checkpoint_save(pd_body *b, const char *path, size_t n_notes,
                             const pd_note *notes)
{
    pd_rows rows;
    pd_file *file;
    PD_TRY(pd_agree(b->comm, check_notes(n_notes, notes)));
    PD_TRY(pd_rows_create(b->comm, b->n_owned, b->id, b->n_all, &rows));
    PD_TRY(pd_file_create(b->comm, path, &kind, &file));
    const pd_status status = save_all(b, &rows, file, n_notes, notes);
    if (status.code == PD_OK)
        return pd_file_finish(file);
    pd_file_drop(file);
    return status;
}

static pd_status load_all(pd_body *b, const pd_rows *rows, pd_file *file, size_t n_notes,
                          pd_note *notes)
{
    const pd_formulation *f = b->options.formulation;
    PD_TRY(check_facts(b, file));
    PD_TRY(load_notes(file, n_notes, notes));
    PD_TRY(load_arrays(b, rows, file, true));
    PD_TRY(check_held(b, rows, file));
    PD_TRY(load_broken(b, rows, file));
    PD_TRY(load_arrays(b, rows, file, false));
    PD_TRY(load_carries(b, rows, file));
    PD_TRY(load_kept(b, rows, file));
    if (f->resume)
        f->resume(b);
    return pd_status_ok();
}

pd_status pd_checkpoint_load(pd_body *b, const char *path, size_t n_notes, pd_note *notes)
{
    pd_rows rows;
    pd_file *file;
    PD_TRY(pd_agree(b->comm, check_notes(n_notes, notes)));
    PD_TRY(pd_rows_create(b->comm, b->n_owned, b->id, b->n_all, &rows));
    PD_TRY(pd_file_open(b->comm, path, &kind, &file));
    const pd_status status = load_all(b, &rows, file, n_notes, notes);
    pd_file_drop(file);
    return status;
}

/* ---- without a body ---- */

static pd_status check_shapes(pd_file *file, const pd_checkpoint_facts *facts)
{
    for (int k = 0; k < POINT_ARRAYS; k++) {
        const pd_rows_of what = rows_of_array(&point_arrays[k], facts->dimension);
        int64_t count;
        PD_TRY(pd_file_count(file, &what, &count));
        if (count != facts->points)
            return pd_file_error(pd_file_path(file), "%lld rows of %s for %lld points",
                                 (long long)count, what.name, (long long)facts->points);
    }
    return pd_status_ok();
}

static pd_status check_lists(pd_file *file, const list_rows *what, pd_global points)
{
    const pd_rows rows = {
        .comm = MPI_COMM_NULL, .ranks = 1, .all = points, .past = points};
    pd_lists lists;
    const pd_status status = load_lists(&rows, file, what, NULL, &lists);
    pd_lists_free(&lists);
    return status;
}

static pd_status read_facts(pd_file *file, pd_checkpoint_facts *facts)
{
    double dimension;
    facts->version = pd_file_version(file);
    facts->size = pd_file_size(file);
    PD_TRY(pd_file_number(file, "dimension", &dimension));
    if (!(dimension == 1 || dimension == 2 || dimension == 3))
        return pd_file_error(pd_file_path(file), "dimension %g", dimension);
    facts->dimension = (int)dimension;
    PD_TRY(pd_file_integer(file, "points", &facts->points));
    PD_TRY(
        pd_file_text(file, "formulation", sizeof facts->formulation, facts->formulation));
    PD_TRY(pd_file_text(file, "material", sizeof facts->material, facts->material));
    PD_TRY(find_notes(file, facts));
    PD_TRY(check_shapes(file, facts));
    PD_TRY(check_lists(file, &broken_lists, facts->points));
    if (pd_file_has(file, pair_lists.count.name))
        PD_TRY(check_lists(file, &pair_lists, facts->points));
    return pd_file_count(file, &broken_lists.partner, &facts->broken_bonds);
}

pd_status pd_checkpoint_check(const char *path, pd_checkpoint_facts *facts)
{
    pd_file *file;
    memset(facts, 0, sizeof *facts);
    PD_TRY(pd_file_open(MPI_COMM_NULL, path, &kind, &file));
    const pd_status status = read_facts(file, facts);
    pd_file_drop(file);
    return status;
}
