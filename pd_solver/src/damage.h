/*
 * Bond state: the only writer of pd_body.broken, and of weights after creation.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_DAMAGE_H
#define PD_SRC_DAMAGE_H

#include "body.h"

/* Make room for bond states; all intact. Nothing happens when there is room already. */
pd_status pd_damage_allocate(pd_body *body);

/* Break directed bond k; its partner breaks by the same test at the other end. */
void pd_damage_break(pd_body *body, int64_t k);

static inline bool bond_is_broken(const pd_body *body, int64_t k)
{
    return body->broken && (body->broken[k / 64] >> (k % 64) & 1);
}

/* Is either end in a region where nothing fails? */
static inline bool bond_is_protected(const pd_body *body, pd_local i, pd_local j)
{
    return body->protect && (body->protect[i] || body->protect[j]);
}

#endif
