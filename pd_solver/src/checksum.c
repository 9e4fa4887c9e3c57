/* CRC-64. SPDX-License-Identifier: GPL-3.0-or-later */
#include "checksum.h"

void pd_checksum_tabulate(pd_checksum_table *t)
{
    for (int byte = 0; byte < 256; byte++) {
        uint64_t crc = (uint64_t)byte;
        for (int bit = 0; bit < 8; bit++)
            crc = crc & 1 ? crc >> 1 ^ UINT64_C(0xc96c5795d7870f42) : crc >> 1;
        t->of[0][byte] = crc;
    }
    for (int byte = 0; byte < 256; byte++)
        for (int k = 1; k < 16; k++)
            t->of[k][byte] = t->of[k - 1][byte] >> 8 ^ t->of[0][t->of[k - 1][byte] & 255];
}

static uint64_t load(const unsigned char *at)
{
    uint64_t word = 0;
    for (int k = 0; k < 8; k++) /* one load where bytes are in this order */
        word |= (uint64_t)at[k] << 8 * k;
    return word;
}

/* One word through the tables from `k` on. */
static inline uint64_t look_up(const pd_checksum_table *t, int k, uint64_t w)
{
    return t->of[k + 7][w & 255] ^ t->of[k + 6][w >> 8 & 255] ^
           t->of[k + 5][w >> 16 & 255] ^ t->of[k + 4][w >> 24 & 255] ^
           t->of[k + 3][w >> 32 & 255] ^ t->of[k + 2][w >> 40 & 255] ^
           t->of[k + 1][w >> 48 & 255] ^ t->of[k][w >> 56];
}

uint64_t pd_checksum(const pd_checksum_table *t, uint64_t before, const void *bytes,
                     size_t n)
{
    const unsigned char *at = bytes;
    uint64_t crc = ~before;
    for (; n >= 16; n -= 16, at += 16)
        crc = look_up(t, 8, load(at) ^ crc) ^ look_up(t, 0, load(at + 8));
    for (; n > 0; n--, at++)
        crc = crc >> 8 ^ t->of[0][(crc ^ *at) & 255];
    return ~crc;
}
