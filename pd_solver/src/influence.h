/* Influence function and volume correction. SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef PD_SRC_INFLUENCE_H
#define PD_SRC_INFLUENCE_H

/* omega(r), r = 2 |xi| / horizon, [kim2023] eq. 30: the cubic B-spline. */
static inline double influence(double r, int dimension)
{
    const double pi = 3.14159265358979323846;
    const double C = dimension == 2 ? 15 / (7 * pi) : 3 / (2 * pi);
    if (r < 1)
        return C * (2. / 3 - r * r + r * r * r / 2);
    if (r <= 2)
        return C * (2 - r) * (2 - r) * (2 - r) / 6;
    return 0;
}

/* beta, the share of a neighbour's volume that counts, [kim2023] eq. 24. */
static inline double volume_fraction(double length, double horizon, double spacing)
{
    if (length <= horizon - spacing / 2)
        return 1;
    if (length <= horizon)
        return (horizon - (length - spacing / 2)) / spacing;
    return 0;
}

#endif
