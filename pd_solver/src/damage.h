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

/* The same for offset k of a lane of a regular chunk; was it intact? Without memory for
 * the chunk's weights it stays so, and body->out_of_memory is set. */
bool pd_damage_break_regular(pd_body *body, pd_chunk *chunk, int lane, int k);

/* Break the bonds of a regular chunk of plane z whose square of length exceeds s_c2
 * |xi|^2; did any? */
bool pd_damage_break_chunk(pd_body *body, int64_t z, pd_chunk *chunk, double s_c2);

/* Broken bonds, undirected. */
int64_t pd_damage_count(const pd_body *body);

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
