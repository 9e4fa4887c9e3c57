/*
 * Families by a cell list, as compressed rows.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "neighbourhood.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "status.h"

/* Cell of X along axis a, clamped to the box. */
static int64_t cell_along(const pd_cell_list *cells, const double *X, int a)
{
    int64_t index = (int64_t)floor((X[a] - cells->origin[a]) / cells->size);
    if (index < 0)
        return 0;
    return index < cells->count[a] ? index : cells->count[a] - 1;
}

static int64_t cell_of(const pd_cell_list *cells, const double *X)
{
    int64_t index = 0;
    for (int a = 0; a < cells->d; a++)
        index = index * cells->count[a] + cell_along(cells, X, a);
    return index;
}

/* Box of the points, and cells at least as wide as the widest horizon; wider where a
 * sparse cloud would need many more cells than it has points. */
static int64_t lay_out(pd_cell_list *cells)
{
    const int d = cells->d;
    double extent[3] = {0};
    for (int a = 0; a < 3; a++)
        cells->count[a] = 1;
    cells->size = cells->n > 0 ? 0 : 1;
    for (int a = 0; cells->n > 0 && a < d; a++) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (pd_local p = 0; p < cells->n; p++) {
            low = fmin(low, cells->X[(size_t)p * d + a]);
            high = fmax(high, cells->X[(size_t)p * d + a]);
        }
        cells->origin[a] = low;
        extent[a] = high - low;
    }
    /* A little wider, so that round-off puts no bond of full length two cells apart. */
    for (pd_local p = 0; p < cells->n; p++)
        cells->size = fmax(cells->size, cells->ratio * cells->spacing[p] * (1 + 1e-9));
    for (;; cells->size *= 2) {
        double total = 1;
        for (int a = 0; a < d; a++)
            total *= floor(extent[a] / cells->size) + 1;
        if (total > 8. * cells->n + 64)
            continue;
        for (int a = 0; a < d; a++)
            cells->count[a] = (int64_t)floor(extent[a] / cells->size) + 1;
        return (int64_t)total;
    }
}

pd_status pd_cell_list_create(int d, pd_local n, const double *X, const double *spacing,
                              double ratio, pd_cell_list *cells)
{
    *cells = (pd_cell_list){.d = d, .n = n, .X = X, .spacing = spacing, .ratio = ratio};
    const int64_t total = lay_out(cells);
    cells->first = calloc((size_t)total + 1, sizeof *cells->first);
    cells->point = malloc(((size_t)n + 1) * sizeof *cells->point);
    if (!cells->first || !cells->point)
        return pd_status_fail(PD_NO_MEMORY, -1, "cell list of %lld cells",
                              (long long)total);

    for (pd_local p = 0; p < n; p++)
        cells->first[cell_of(cells, X + (size_t)p * d) + 1]++;
    for (int64_t c = 0; c < total; c++)
        cells->first[c + 1] += cells->first[c];
    for (pd_local p = n - 1; p >= 0; p--) /* counts down so that cells keep their order */
        cells->point[--cells->first[cell_of(cells, X + (size_t)p * d) + 1]] = p;
    /* The loop above moved every first[c + 1] to where cell c begins. */
    memmove(cells->first, cells->first + 1, (size_t)total * sizeof *cells->first);
    cells->first[total] = n;
    return pd_status_ok();
}

void pd_cell_list_free(pd_cell_list *cells)
{
    free(cells->first);
    free(cells->point);
    *cells = (pd_cell_list){0};
}

bool pd_bonded(const pd_cell_list *cells, pd_local i, pd_local j)
{
    const int d = cells->d;
    const double horizon = cells->ratio * 0.5 * (cells->spacing[i] + cells->spacing[j]);
    double square = 0;
    for (int a = 0; a < d; a++) {
        const double xi = cells->X[(size_t)j * d + a] - cells->X[(size_t)i * d + a];
        square += xi * xi;
    }
    return square <= horizon * horizon;
}

pd_local pd_cell_list_near(const pd_cell_list *cells, pd_local i, pd_local capacity,
                           pd_local *near)
{
    const double *X = cells->X + (size_t)i * cells->d;
    int64_t low[3] = {0}, high[3] = {0};
    for (int a = 0; a < cells->d; a++) {
        const int64_t here = cell_along(cells, X, a);
        low[a] = here > 0 ? here - 1 : 0;
        high[a] = here + 1 < cells->count[a] ? here + 1 : here;
    }
    pd_local found = 0;
    for (int64_t x = low[0]; x <= high[0]; x++)
        for (int64_t y = low[1]; y <= high[1]; y++)
            for (int64_t z = low[2]; z <= high[2]; z++) {
                int64_t c = x * cells->count[1] + y;
                if (cells->d == 3)
                    c = c * cells->count[2] + z;
                for (pd_local k = cells->first[c]; k < cells->first[c + 1]; k++) {
                    const pd_local j = cells->point[k];
                    if (j == i || !pd_bonded(cells, i, j))
                        continue;
                    if (found < capacity)
                        near[found] = j;
                    found++;
                }
            }
    return found;
}

static int rising(const void *a, const void *b)
{
    const pd_local i = *(const pd_local *)a, j = *(const pd_local *)b;
    return (i > j) - (i < j);
}

static bool is_asked_for(const pd_range *ranges, pd_local i)
{
    return (i >= ranges[0].first && i < ranges[0].end) ||
           (i >= ranges[1].first && i < ranges[1].end);
}

pd_status pd_families_create(const pd_cell_list *cells, const pd_range *ranges,
                             pd_families *families)
{
    const pd_local n = cells->n;
    *families = (pd_families){.n = n};
    families->first = calloc((size_t)n + 1, sizeof *families->first);
    if (!families->first)
        return pd_status_fail(PD_NO_MEMORY, -1, "families of %d points", n);

    for (pd_local i = 0; i < n; i++)
        families->first[i + 1] =
            families->first[i] +
            (is_asked_for(ranges, i) ? pd_cell_list_near(cells, i, 0, NULL) : 0);
    const size_t bonds = (size_t)families->first[n];
    families->neighbour = malloc((bonds ? bonds : 1) * sizeof *families->neighbour);
    if (!families->neighbour)
        return pd_status_fail(PD_NO_MEMORY, -1, "%zu bonds", bonds);

    for (pd_local i = 0; i < n; i++) {
        pd_local *family = families->neighbour + families->first[i];
        const pd_local size = (pd_local)(families->first[i + 1] - families->first[i]);
        if (size == 0)
            continue;
        pd_cell_list_near(cells, i, size, family);
        qsort(family, (size_t)size, sizeof *family, rising);
    }
    return pd_status_ok();
}

void pd_families_free(pd_families *families)
{
    free(families->first);
    free(families->neighbour);
    *families = (pd_families){0};
}
