/*
 * What the paths of the formulation `bond` share.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_BOND_H
#define PD_BOND_H

#include "body.h"

enum { SURFACE_CORRECTION, BREAK_AFTER_FORCE }; /* of formulation_parameters */

/* Does a bond that exceeds s_c bear force once more? */
static inline bool breaks_after_force(const pd_body *b)
{
    return b->options.formulation_parameters[BREAK_AFTER_FORCE] > 0;
}

#endif
