/*
 * CRC-64 (polynomial of ECMA-182, bits reflected: that of xz), sixteen bytes at a time.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_CHECKSUM_H
#define PD_SRC_CHECKSUM_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint64_t of[16][256];
} pd_checksum_table;

void pd_checksum_tabulate(pd_checksum_table *table);

/* Checksum of bytes that follow others of checksum `before`; 0: none. */
uint64_t pd_checksum(const pd_checksum_table *table, uint64_t before, const void *bytes,
                     size_t n);

#endif
