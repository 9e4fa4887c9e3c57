/*
 * Points and their fields for ParaView: rows in HDF5, and XDMF that says where they are.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#define _POSIX_C_SOURCE 200809L

#include <errno.h>
#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "body.h"
#include "collective.h"
#include "hdf5_file.h"
#include "rows.h"
#include "status.h"

static const pd_file_kind kind = {"fields", 1};

/* ---- fields of the body's own ---- */

/* In the body's axes, values[n_owned][width]; vectors have d components there. */
typedef pd_status filler(pd_body *b, double *values);

static pd_status fill_displacement(pd_body *b, double *values)
{
    const size_t size = (size_t)b->n_owned * (size_t)b->options.dimension;
    for (size_t c = 0; c < size; c++)
        values[c] = b->y[c] - b->X[c];
    return pd_status_ok();
}

static pd_status fill_velocity(pd_body *b, double *values)
{
    const size_t size = (size_t)b->n_owned * (size_t)b->options.dimension;
    memcpy(values, b->v, size * sizeof *values);
    return pd_status_ok();
}

static pd_status fill_force(pd_body *b, double *values)
{
    const size_t size = (size_t)b->n_owned * (size_t)b->options.dimension;
    memcpy(values, b->force, size * sizeof *values);
    return pd_status_ok();
}

static pd_status fill_J(pd_body *b, double *values)
{
    memcpy(values, b->J, (size_t)b->n_owned * sizeof *values);
    return pd_status_ok();
}

static pd_status fill_damage(pd_body *b, double *values)
{
    pd_body_damage(b, values);
    return pd_status_ok();
}

static pd_status fill_stress(pd_body *b, double *values)
{
    pd_body_stress(b, values, NULL);
    return pd_status_ok();
}

static pd_status fill_plastic(pd_body *b, double *values)
{
    pd_body_stress(b, NULL, values);
    return pd_status_ok();
}

static pd_status fill_held(pd_body *b, double *values)
{
    for (pd_local i = 0; i < b->n_owned; i++)
        values[i] = is_held(b, i);
    return pd_status_ok();
}

static pd_status fill_piece(pd_body *b, double *values)
{
    pd_global *piece = malloc(((size_t)b->n_owned + 1) * sizeof *piece);
    pd_status status = pd_agree(
        b->comm, piece ? pd_status_ok() : pd_status_fail(PD_NO_MEMORY, -1, "pieces"));
    if (status.code == PD_OK && pd_body_pieces(b, piece, NULL) < 0)
        status = pd_status_fail(PD_NO_MEMORY, -1, "pieces");
    if (status.code == PD_OK) {
        for (pd_local i = 0; i < b->n_owned; i++)
            values[i] = (double)piece[i];
    }
    free(piece);
    return status;
}

enum { VECTOR = 3 };

static const struct {
    const char *name, *unit, *description;
    int width;
    filler *fill;
} own_fields[] = {
    {"displacement", "m", "from the position at rest", VECTOR, fill_displacement},
    {"velocity", "m/s", "velocity", VECTOR, fill_velocity},
    {"force", "N/m^d", "force density, of volume at rest", VECTOR, fill_force},
    {"J", "-", "volume over that at rest", 1, fill_J},
    {"damage", "-", "share of a family that is broken", 1, fill_damage},
    {"stress", "Pa", "Cauchy stress 11 22 33 12 23 13", PD_SYMMETRIC, fill_stress},
    {"plasticStrain", "-", "equivalent plastic strain", 1, fill_plastic},
    {"held", "-", "1: the point never moves", 1, fill_held},
    {"piece", "-", "smallest number of the piece; -1: deep in a hold", 1, fill_piece},
};

enum { OWN_FIELDS = sizeof own_fields / sizeof *own_fields };

const char *const pd_field_names[] = {"displacement", "velocity", "force",         "J",
                                      "damage",       "stress",   "plasticStrain", "held",
                                      "piece",        NULL};

static int find_own(const char *name)
{
    for (int k = 0; k < OWN_FIELDS; k++)
        if (strcmp(own_fields[k].name, name) == 0)
            return k;
    return -1;
}

/* ---- what may be asked ---- */

/* In a file's name, a link to a data set and XML. */
static bool is_plain(const char *name)
{
    return name[0] && strlen(name) < 100 && !strpbrk(name, "/:<>&\"' \t\r\n") &&
           name[0] != '.';
}

static bool is_permutation(const int *axes)
{
    int seen = 0;
    for (int a = 0; a < 3; a++)
        seen |= axes[a] >= 0 && axes[a] < 3 ? 1 << axes[a] : 0;
    return seen == 7;
}

static pd_status check_field(const char *name, int width)
{
    if (!is_plain(name) || strcmp(name, "position") == 0)
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "a field cannot be called '%s'", name);
    if (width != 1 && width != VECTOR && width != PD_SYMMETRIC)
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "field %s of width %d; allowed: 1, 3, 6", name, width);
    return pd_status_ok();
}

static pd_status check_picture(const char *name, const pd_picture *p)
{
    const int none[3] = {0, 0, 0};
    if (!is_plain(name))
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "a picture cannot be called '%s'",
                              name);
    if (!isfinite(p->time))
        return pd_status_fail(PD_BAD_ARGUMENT, -1, "a picture at time %g", p->time);
    if (memcmp(p->axes, none, sizeof none) != 0 && !is_permutation(p->axes))
        return pd_status_fail(PD_BAD_ARGUMENT, -1,
                              "axes %d %d %d; allowed: each of 0 1 2", p->axes[0],
                              p->axes[1], p->axes[2]);
    for (size_t k = 0; k < p->n_own; k++)
        if (find_own(p->own[k]) < 0)
            return pd_status_fail(PD_BAD_ARGUMENT, -1, "a body has no field %s",
                                  p->own[k]);
    for (size_t k = 0; k < p->n_fields; k++) {
        PD_TRY(check_field(p->fields[k].name, p->fields[k].width));
        for (size_t m = 0; m < k; m++)
            if (strcmp(p->fields[k].name, p->fields[m].name) == 0)
                return pd_status_fail(PD_BAD_ARGUMENT, -1, "two fields are called %s",
                                      p->fields[k].name);
        for (size_t m = 0; m < p->n_own; m++)
            if (strcmp(p->fields[k].name, p->own[m]) == 0)
                return pd_status_fail(PD_BAD_ARGUMENT, -1, "two fields are called %s",
                                      p->fields[k].name);
    }
    return pd_status_ok();
}

/* ---- into space ---- */

typedef struct {
    int axes[3]; /* of the picture, for each of the body's */
    const double *origin;
    bool single;
    const pd_rows *rows;
    pd_file *file;
    FILE *xml;             /* rank 0's, what says where the rows are */
    const char *file_name; /* without its folder */
} canvas;

/* from[n][d] to to[n][3]; components that a body lacks are `rest`. */
static void spread_vectors(const canvas *c, int d, size_t n, const double *from,
                           const double *rest, double *to)
{
    for (size_t i = 0; i < n; i++)
        for (int a = 0; a < 3; a++)
            to[3 * i + (size_t)c->axes[a]] =
                (a < d ? from[i * (size_t)d + (size_t)a] : 0) + rest[c->axes[a]];
}

/* Components 11 22 33 12 23 13 of symmetric tensors, in place. */
static void turn_tensors(const canvas *c, size_t n, double *values)
{
    static const int place[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    for (size_t i = 0; i < n; i++) {
        double s[PD_SYMMETRIC], *to = values + i * PD_SYMMETRIC;
        memcpy(s, to, sizeof s);
        for (int r = 0; r < 3; r++)
            for (int t = r; t < 3; t++)
                to[place[c->axes[r]][c->axes[t]]] = s[place[r][t]];
    }
}

/* What is beyond floats becomes the largest; NaN stays. */
static void shorten(size_t n, const double *from, float *to)
{
    for (size_t k = 0; k < n; k++)
        to[k] = from[k] > FLT_MAX    ? FLT_MAX
                : from[k] < -FLT_MAX ? -FLT_MAX
                                     : (float)from[k];
}

/* ---- a data set and its place in the list ---- */

static void describe(const canvas *c, const pd_field *field)
{
    const char *type = field->width == 1   ? "Scalar"
                       : field->width == 3 ? "Vector"
                                           : "Matrix";
    const bool is_position = strcmp(field->name, "position") == 0;
    if (!c->xml)
        return;
    if (is_position)
        fprintf(c->xml, "<Geometry GeometryType=\"XYZ\">");
    else
        fprintf(c->xml, "<Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"Node\">",
                field->name, type);
    fprintf(c->xml, "<DataItem Dimensions=\"%" PRId64, (int64_t)c->rows->all);
    if (field->width > 1)
        fprintf(c->xml, " %d", field->width);
    fprintf(c->xml,
            "\" NumberType=\"Float\" Precision=\"%d\" Format=\"HDF\">%s:/%s</DataItem>%s",
            c->single ? 4 : 8, c->file_name, field->name,
            is_position ? "</Geometry>" : "</Attribute>");
}

static pd_status write_field(const canvas *c, const pd_field *field)
{
    const pd_rows_of what = {field->name, field->unit, field->description,
                             c->single ? PD_SINGLE : PD_DOUBLE, field->width};
    const size_t width = (size_t)field->width, mine = (size_t)pd_rows_mine(c->rows);
    double *block = malloc((mine * width + 1) * sizeof *block);
    pd_status status =
        pd_agree(c->rows->comm,
                 block ? pd_status_ok() : pd_status_fail(PD_NO_MEMORY, -1, "a field"));
    if (status.code == PD_OK)
        status = pd_rows_put(c->rows, width * sizeof *block, field->values, block);
    if (status.code == PD_OK && c->single) {
        float *shorter = malloc((mine * width + 1) * sizeof *shorter);
        status = pd_agree(c->rows->comm,
                          shorter ? pd_status_ok()
                                  : pd_status_fail(PD_NO_MEMORY, -1, "a field"));
        if (status.code == PD_OK) {
            shorten(mine * width, block, shorter);
            status = pd_file_write(c->file, &what, (int64_t)mine, shorter);
        }
        free(shorter);
    } else if (status.code == PD_OK)
        status = pd_file_write(c->file, &what, (int64_t)mine, block);
    if (status.code == PD_OK)
        describe(c, field);
    free(block);
    return status;
}

static pd_status write_own(pd_body *b, const canvas *c, int own)
{
    const double nothing[3] = {0};
    const size_t n = (size_t)b->n_owned, width = (size_t)own_fields[own].width;
    double *values = malloc((n * width + 1) * sizeof *values);
    double *spread = malloc((n * width + 1) * sizeof *spread);
    pd_status status =
        pd_agree(b->comm, values && spread ? pd_status_ok()
                                           : pd_status_fail(PD_NO_MEMORY, -1, "a field"));
    if (status.code == PD_OK)
        status = own_fields[own].fill(b, values);
    if (status.code == PD_OK) {
        const bool is_vector = width == VECTOR;
        if (is_vector)
            spread_vectors(c, b->options.dimension, n, values, nothing, spread);
        if (width == PD_SYMMETRIC)
            turn_tensors(c, n, values);
        const pd_field field = {own_fields[own].name, own_fields[own].unit,
                                own_fields[own].description, own_fields[own].width,
                                is_vector ? spread : values};
        status = write_field(c, &field);
    }
    free(values);
    free(spread);
    return status;
}

static pd_status write_positions(pd_body *b, const canvas *c)
{
    double *values = malloc((3 * (size_t)b->n_owned + 1) * sizeof *values);
    pd_status status = pd_agree(
        b->comm, values ? pd_status_ok() : pd_status_fail(PD_NO_MEMORY, -1, "a field"));
    if (status.code == PD_OK) {
        spread_vectors(c, b->options.dimension, (size_t)b->n_owned, b->y, c->origin,
                       values);
        const pd_field field = {"position", "m", "current position", VECTOR, values};
        status = write_field(c, &field);
    }
    free(values);
    return status;
}

static pd_status write_rows(pd_body *b, const canvas *c, const pd_picture *p)
{
    PD_TRY(pd_file_put_number(c->file, "time", p->time));
    PD_TRY(write_positions(b, c));
    for (size_t k = 0; k < p->n_own; k++)
        PD_TRY(write_own(b, c, find_own(p->own[k])));
    for (size_t k = 0; k < p->n_fields; k++)
        PD_TRY(write_field(c, &p->fields[k]));
    return pd_status_ok();
}

/* ---- the list of times ----
 *
 * An entry is one line, which begins with its time and the name of its file, so that
 * entries of earlier times are kept as they stand. */

static const char top[] =
    "<?xml version=\"1.0\"?>\n"
    "<!-- Written by periFoam; ParaView opens this file. -->\n"
    "<Xdmf Version=\"2.0\"><Domain><Grid Name=\"times\" GridType=\"Collection\" "
    "CollectionType=\"Temporal\">\n";
static const char bottom[] = "</Grid></Domain></Xdmf>\n";

/* Is the line an entry of an earlier time, whose file is still there and not the new one?
 */
static bool stays(const char *folder, const char *line, double time, const char *file)
{
    const char begins[] = "<Grid Name=\"", then[] = "\"><Time Value=\"";
    char name[256], path[4096];
    if (strncmp(line, begins, strlen(begins)) != 0)
        return false;
    const char *from = line + strlen(begins), *end = strstr(from, then);
    if (!end || (size_t)(end - from) >= sizeof name ||
        !(strtod(end + strlen(then), NULL) < time))
        return false;
    memcpy(name, from, (size_t)(end - from));
    name[end - from] = 0;
    if (strcmp(name, file) == 0)
        return false;
    const int length = snprintf(path, sizeof path, "%s/%s", folder, name);
    return length > 0 && (size_t)length < sizeof path && access(path, F_OK) == 0;
}

/* Copy the entries that stay. A list that is not ours is left alone. */
static pd_status keep_entries(const char *folder, const char *path, double time,
                              const char *file, FILE *to)
{
    FILE *from = fopen(path, "r");
    if (!from)
        return errno == ENOENT
                   ? pd_status_ok()
                   : pd_file_error(path, "cannot read it: %s", strerror(errno));
    char *line = NULL, head[sizeof top];
    size_t room = 0;
    const size_t got = fread(head, 1, strlen(top), from);
    pd_status status = pd_status_ok();
    if (got != strlen(top) || memcmp(head, top, got) != 0)
        status = pd_file_error(path, "is no list of times that periFoam wrote");
    while (status.code == PD_OK && getline(&line, &room, from) > 0)
        if (stays(folder, line, time, file))
            fputs(line, to);
    free(line);
    fclose(from);
    return status;
}

static pd_status put_list(const char *path, const char *part, FILE *list)
{
    const bool written = fflush(list) == 0 && fsync(fileno(list)) == 0;
    const int number = errno;
    if (fclose(list) == 0 && written && rename(part, path) == 0)
        return pd_status_ok();
    const pd_status status =
        pd_file_error(path, "cannot write it: %s", strerror(written ? errno : number));
    unlink(part);
    return status;
}

static pd_status write_list(const char *folder, const char *name, double time,
                            const char *file, const char *entry)
{
    const size_t size = strlen(folder) + strlen(name) + 20;
    char *path = malloc(2 * size), *part = path + size;
    if (!path)
        return pd_status_fail(PD_NO_MEMORY, -1, "a list of times");
    snprintf(path, size, "%s/%s.xdmf", folder, name);
    snprintf(part, size, "%s/%s.xdmf.part", folder, name);
    FILE *list = fopen(part, "w");
    pd_status status = pd_status_ok();
    if (!list)
        status = pd_file_error(path, "cannot write it: %s", strerror(errno));
    else {
        fputs(top, list);
        status = keep_entries(folder, path, time, file, list);
        fprintf(list, "%s\n%s", entry, bottom);
        if (status.code == PD_OK)
            status = put_list(path, part, list);
        else {
            fclose(list);
            unlink(part);
        }
    }
    free(path);
    return status;
}

/* ---- all of it ---- */

/* The file of rows at `path`; on rank 0 its entry goes to c->xml. */
static pd_status draw(pd_body *b, const char *path, const pd_picture *p, canvas *c)
{
    pd_rows rows;
    PD_TRY(pd_rows_create(b->comm, b->n_owned, b->id, b->n_all, &rows));
    c->rows = &rows;
    PD_TRY(pd_file_create(b->comm, path, &kind, &c->file));
    if (c->xml)
        fprintf(c->xml,
                "<Grid Name=\"%s\"><Time Value=\"%.17g\"/><Topology "
                "TopologyType=\"Polyvertex\" NumberOfElements=\"%" PRId64 "\"/>",
                c->file_name, p->time, b->n_all);
    const pd_status status = write_rows(b, c, p);
    if (status.code == PD_OK)
        return pd_file_finish(c->file);
    pd_file_drop(c->file);
    return status;
}

static pd_status make_folder(const char *folder)
{
    if (mkdir(folder, 0777) == 0 || errno == EEXIST)
        return pd_status_ok();
    return pd_file_error(folder, "cannot create it: %s", strerror(errno));
}

pd_status pd_body_write_picture(pd_body *b, const char *folder, const char *name,
                                const pd_picture *p)
{
    const bool first = pd_rank_of(b->comm) == 0;
    PD_TRY(pd_agree(b->comm, check_picture(name, p)));
    PD_TRY(pd_agree(b->comm, first ? make_folder(folder) : pd_status_ok()));
    char time[32], *entry = NULL, *path;
    size_t length = 0;
    snprintf(time, sizeof time, "%.10g", p->time);
    const size_t size = strlen(folder) + strlen(name) + sizeof time + 8;
    path = malloc(size);
    canvas c = {.axes = {0, 1, 2},
                .origin = p->origin,
                .single = p->single,
                .xml = first ? open_memstream(&entry, &length) : NULL};
    if (is_permutation(p->axes))
        memcpy(c.axes, p->axes, sizeof c.axes);
    pd_status status =
        pd_agree(b->comm, path && (c.xml || !first)
                              ? pd_status_ok()
                              : pd_status_fail(PD_NO_MEMORY, -1, "a picture"));
    if (status.code == PD_OK) {
        snprintf(path, size, "%s/%s_%s.h5", folder, name, time);
        c.file_name = path + strlen(folder) + 1;
        status = draw(b, path, p, &c);
    }
    if (c.xml) {
        fprintf(c.xml, "</Grid>");
        if (fclose(c.xml) != 0 && status.code == PD_OK)
            status = pd_status_fail(PD_NO_MEMORY, -1, "a list of times");
        if (status.code == PD_OK)
            status = write_list(folder, name, p->time, c.file_name, entry);
    }
    free(entry);
    free(path);
    return pd_agree(b->comm, status);
}
