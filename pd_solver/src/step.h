/*
 * What integrators and relaxation share.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_STEP_H
#define PD_SRC_STEP_H

#include "body.h"

/* Mark the prescribed components of the body; NULL: none.
 * Errors: PD_BAD_ARGUMENT, PD_NOT_FINITE. */
pd_status pd_prescribe(pd_body *b, const pd_prescribed *prescribed);

/* Put prescribed components where they shall be. */
void pd_place_prescribed(pd_body *b, const pd_prescribed *prescribed);

/* Is the component of a moving point marked by pd_prescribe? */
static inline bool pd_is_prescribed(const pd_body *b, pd_local p, int axis)
{
    return b->prescribed[p] >> axis & 1;
}

#endif
