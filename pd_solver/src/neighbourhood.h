/*
 * Families: which points lie within which horizon. Knows no mechanics.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_NEIGHBOURHOOD_H
#define PD_SRC_NEIGHBOURHOOD_H

#include "pd.h"

/* Points in cubic cells, for finding those near a place. */
typedef struct {
    int d;
    pd_local n;
    const double *X;        /* [n][d], borrowed */
    const double *spacing;  /* [n], borrowed */
    double ratio;           /* horizon / spacing */
    double origin[3], size; /* m */
    int64_t count[3];
    pd_local *first; /* [cells + 1] into point */
    pd_local *point; /* [n] */
} pd_cell_list;

/* Points [first, end). */
typedef struct {
    pd_local first, end;
} pd_range;

/* Bonds of points [0, n): first[n + 1] into neighbour, each family in rising order; those
 * of points outside the ranges that were asked for are not stored. */
typedef struct {
    pd_local n;
    int64_t *first;
    pd_local *neighbour;
} pd_families;

/* Freed by pd_cell_list_free, also after an error. */
pd_status pd_cell_list_create(int d, pd_local n, const double *X, const double *spacing,
                              double ratio, pd_cell_list *cells);
void pd_cell_list_free(pd_cell_list *cells);

/* Are i and j within each other's horizon? Symmetric to the last bit. */
bool pd_bonded(const pd_cell_list *cells, pd_local i, pd_local j);

/* Neighbours of point i (not i itself) in no order; writes up to capacity of them and
 * returns how many there are. */
pd_local pd_cell_list_near(const pd_cell_list *cells, pd_local i, pd_local capacity,
                           pd_local *near);

/* Families of the points of two ranges, in order. Freed by pd_families_free, also after
 * an error. */
pd_status pd_families_create(const pd_cell_list *cells, const pd_range *ranges,
                             pd_families *families);
void pd_families_free(pd_families *families);

#endif
