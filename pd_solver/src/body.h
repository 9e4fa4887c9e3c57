/*
 * The inside of a body, for the files of this folder.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_BODY_H
#define PD_SRC_BODY_H

#include "neighbourhood.h"
#include "pd.h"

/* Why a point carries no stress. */
enum { PD_SOUND = 0, PD_POINT_SINGULAR, PD_POINT_INVERTED };

struct pd_body {
    MPI_Comm comm; /* duplicated, or MPI_COMM_NULL */
    pd_body_options options;

    pd_local n_moving, n_active, n_owned, n_local; /* as in pd_body_view */
    pd_global *id;
    double *X, *y, *v, *volume, *spacing, *force, *F, *J;
    double *load; /* [n_owned][d] dead load, N/m3, or NULL */

    /* Bonds of the active points. A broken bond has weight 0, so that it leaves every sum
     * without a test; its bit tells it from a bond that never weighed anything. */
    pd_families families;
    double *weight;   /* [bonds] omega beta V_j, m3 */
    uint64_t *broken; /* [bonds] bits; NULL until a bond can break */

    /* [n_active] distance to where the hold ends, m; 0 for points not beside one; NULL
     * where nothing is held. */
    double *hold_distance;

    unsigned char *prescribed; /* [n_local] bits of components, for the step at hand */

    unsigned char *protect; /* [n_owned] no bond of the point breaks; or NULL */

    void *own; /* the formulation's, freed by its release; or NULL */

    /* correspondence */
    double *K_inverse;      /* [n_active][d][d], m-(d+2); 0 where K is near singular */
    double *Q;              /* [n_active][d][d] P K^-1 */
    unsigned char *carries; /* [n_active] PD_SOUND or why not */
};

/* Can bonds break? */
static inline bool pd_body_can_break(const pd_body_options *o)
{
    return o->critical_stretch > 0 || o->energy_release > 0 || o->critical_stress > 0 ||
           o->failed_strain > 0;
}

/* Speed of longitudinal waves of the material (m/s). */
double pd_body_longitudinal_speed(const pd_body *b);

#endif
