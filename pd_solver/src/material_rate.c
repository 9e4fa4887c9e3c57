/*
 * Rate forms: Cauchy stress that follows the Jaumann rate, [behzadinasab2021] appendix B.
 *
 * Over a step the stress turns with the rotation of [hughes1980], so that a rigid
 * rotation of any size is exact: half of it before the elastic increment, which is that
 * of the middle of the step, and half after, for second order. Then comes the return to
 * the yield surface: radial, [simo1998] section 3.3, and in plane stress that of its
 * section 3.4.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#include "material.h"
#include "tensor.h"

/* ---- half a rotation ----
 *
 * The root Q of the step's rotation (1 - W/2)^-1 (1 + W/2), W = (G - G^T)/2: with
 * W x = 2 a cross x, it turns about a by the angle whose tangent is |a|,
 *
 *     Q = 1 + A/s + A^2/(s (s + 1)), A x = a cross x, s = (1 + a^2)^(1/2)
 *
 * sigma = Q sigma Q^T leaves every bit where W = 0. */

typedef struct {
    double cosine, sine;
} half_turn_2;

PD_INLINE half_turn_2 half_turn_of_2(const double *restrict G)
{
    const double t = 0.25 * (G[1] - G[2]), s = sqrt(1 + t * t);
    return (half_turn_2){1 / s, t / s};
}

PD_INLINE void turn_2(half_turn_2 Q, double *restrict sigma)
{
    const double shear = sigma[3], difference = sigma[1] - sigma[0];
    const double shift = Q.sine * (Q.sine * difference + 2 * Q.cosine * shear);
    sigma[0] += shift;
    sigma[1] -= shift;
    sigma[3] += Q.sine * (Q.cosine * difference - 2 * Q.sine * shear);
}

PD_INLINE void half_turn_of_3(const double *restrict G, double *restrict Q)
{
    const double a = 0.25 * (G[7] - G[5]), b = 0.25 * (G[2] - G[6]),
                 c = 0.25 * (G[3] - G[1]);
    const double s = sqrt(1 + a * a + b * b + c * c), l = 1 / s, k = l / (s + 1);
    Q[0] = 1 - k * (b * b + c * c);
    Q[1] = k * a * b - l * c, Q[3] = k * a * b + l * c;
    Q[2] = k * a * c + l * b, Q[6] = k * a * c - l * b;
    Q[4] = 1 - k * (a * a + c * c);
    Q[5] = k * b * c - l * a, Q[7] = k * b * c + l * a;
    Q[8] = 1 - k * (a * a + b * b);
}

PD_INLINE void turn_3(const double *restrict Q, double *restrict sigma)
{
    const double T[9] = {sigma[0], sigma[3], sigma[5], sigma[3], sigma[1],
                         sigma[4], sigma[5], sigma[4], sigma[2]};
    double QT[9];
    multiply(3, Q, T, QT);
    sigma[0] = dot(3, QT, Q);
    sigma[1] = dot(3, QT + 3, Q + 3);
    sigma[2] = dot(3, QT + 6, Q + 6);
    sigma[3] = dot(3, QT, Q + 3);
    sigma[4] = dot(3, QT + 3, Q + 6);
    sigma[5] = dot(3, QT, Q + 6);
}

/* ---- elastic increment ---- */

/* across: sigma33 grows by lambda times the trace in plane strain, stays 0 in plane
 * stress, whose lambda m holds. */
PD_INLINE void stretch_2(const bool across, lame m, const double *restrict G,
                         double *restrict sigma)
{
    const double volumetric = m.lambda * (G[0] + G[3]);
    sigma[0] += volumetric + 2 * m.mu * G[0];
    sigma[1] += volumetric + 2 * m.mu * G[3];
    if (across)
        sigma[2] += volumetric;
    sigma[3] += m.mu * (G[1] + G[2]);
}

PD_INLINE void stretch_3(lame m, const double *restrict G, double *restrict sigma)
{
    const double volumetric = m.lambda * (G[0] + G[4] + G[8]);
    sigma[0] += volumetric + 2 * m.mu * G[0];
    sigma[1] += volumetric + 2 * m.mu * G[4];
    sigma[2] += volumetric + 2 * m.mu * G[8];
    sigma[3] += m.mu * (G[1] + G[3]);
    sigma[4] += m.mu * (G[5] + G[7]);
    sigma[5] += m.mu * (G[2] + G[6]);
}

PD_INLINE void predict(const int d, const bool across, lame m, const double *restrict G,
                       double *restrict sigma)
{
    if (d == 2) {
        const half_turn_2 Q = half_turn_of_2(G);
        turn_2(Q, sigma);
        stretch_2(across, m, G, sigma);
        turn_2(Q, sigma);
    } else {
        double Q[9];
        half_turn_of_3(G, Q);
        turn_3(Q, sigma);
        stretch_3(m, G, sigma);
        turn_3(Q, sigma);
    }
}

/* ---- blocks of points ----
 *
 * Components lie apart, so that loops over points vectorise without gathers. */

enum { BLOCK = 32 };

typedef struct {
    double G[9][BLOCK], sigma[PD_SYMMETRIC][BLOCK];
} block;

/* Components of sigma that a dimension has: 11 22 33 12, 23 13. */
PD_INLINE int components(const int d)
{
    return d == 2 ? 4 : PD_SYMMETRIC;
}

PD_INLINE void load(const int d, size_t n, const double *restrict G,
                    const double *restrict sigma, block *restrict b)
{
    for (size_t p = 0; p < n; p++) {
        for (int c = 0; c < d * d; c++)
            b->G[c][p] = G[p * (size_t)(d * d) + (size_t)c];
        for (int c = 0; c < components(d); c++)
            b->sigma[c][p] = sigma[p * PD_SYMMETRIC + (size_t)c];
    }
}

PD_INLINE void store(const int d, size_t n, const block *restrict b,
                     double *restrict sigma)
{
    for (size_t p = 0; p < n; p++)
        for (int c = 0; c < components(d); c++)
            sigma[p * PD_SYMMETRIC + (size_t)c] = b->sigma[c][p];
}

PD_INLINE void predict_block(const int d, const bool across, lame m, size_t n,
                             block *restrict b)
{
    for (size_t p = 0; p < n; p++) {
        double G[9], sigma[PD_SYMMETRIC];
        for (int c = 0; c < d * d; c++)
            G[c] = b->G[c][p];
        for (int c = 0; c < components(d); c++)
            sigma[c] = b->sigma[c][p];
        predict(d, across, m, G, sigma);
        for (int c = 0; c < components(d); c++)
            b->sigma[c][p] = sigma[c];
    }
}

PD_INLINE void predict_points(const int d, const bool across, lame m, size_t n,
                              const double *G, double *sigma)
{
    block b;
    for (size_t start = 0; start < n; start += BLOCK) {
        const size_t count = n - start < BLOCK ? n - start : BLOCK;
        double *here = sigma + start * PD_SYMMETRIC;
        load(d, count, G + start * (size_t)(d * d), here, &b);
        predict_block(d, across, m, count, &b);
        store(d, count, &b, here);
    }
}

/* ---- linear elastic ---- */

void pd_linear_elastic_update(const double *parameters, int d, size_t n, const double *G,
                              double *sigma, double *plastic)
{
    (void)plastic;
    if (d == 2)
        predict_points(2, true, lame_of_space(parameters), n, G, sigma);
    else
        predict_points(3, true, lame_of_space(parameters), n, G, sigma);
}

void pd_linear_elastic_update_plane_stress(const double *parameters, int d, size_t n,
                                           const double *G, double *sigma,
                                           double *plastic)
{
    (void)d, (void)plastic;
    predict_points(2, false, lame_of_plane_stress(parameters), n, G, sigma);
}

/* ---- J2 flow with linear isotropic hardening ---- */

typedef struct {
    lame elastic;
    double yield, hardening; /* sigma_Y = yield + hardening * plastic, Pa */
} metal;

/* The von Mises stress squared, by differences: pressure leaves no trace. */
PD_INLINE double von_mises_squared(const int d, const double *sigma)
{
    const double a = sigma[0] - sigma[1], b = sigma[1] - sigma[2],
                 c = sigma[2] - sigma[0];
    return 0.5 * (a * a + b * b + c * c) + 3 * dot(d == 2 ? 1 : 3, sigma + 3, sigma + 3);
}

/* Radial return, exact for linear hardening. Below yield the excess is 0 and the part of
 * the deviator that is kept 1, so that the stress keeps every bit; far beyond, that part
 * is no difference, and q ends on the surface. Neither needs a branch. */
PD_INLINE void return_radially(const int d, metal m, double *restrict sigma,
                               double *restrict plastic)
{
    const double q = sqrt(von_mises_squared(d, sigma));
    const double limit = m.yield + m.hardening * *plastic, over = q - limit;
    const double excess = 0.5 * (over + fabs(over));
    const double flow = excess / (3 * m.elastic.mu + m.hardening);
    const double keep = (limit + m.hardening * flow) / (limit + excess);
    const double mean = (sigma[0] + sigma[1] + sigma[2]) / 3;
    for (int c = 0; c < 3; c++)
        sigma[c] = keep * sigma[c] + (1 - keep) * mean;
    for (int c = 3; c < components(d); c++)
        sigma[c] *= keep;
    *plastic += flow;
}

PD_INLINE void return_block(const int d, metal m, size_t n, block *restrict b,
                            double *restrict plastic)
{
    for (size_t p = 0; p < n; p++) {
        double sigma[PD_SYMMETRIC];
        for (int c = 0; c < components(d); c++)
            sigma[c] = b->sigma[c][p];
        return_radially(d, m, sigma, plastic + p);
        for (int c = 0; c < components(d); c++)
            b->sigma[c][p] = sigma[c];
    }
}

PD_INLINE void flow_points(const int d, metal m, size_t n, const double *G, double *sigma,
                           double *plastic)
{
    block b;
    for (size_t start = 0; start < n; start += BLOCK) {
        const size_t count = n - start < BLOCK ? n - start : BLOCK;
        double *here = sigma + start * PD_SYMMETRIC;
        load(d, count, G + start * (size_t)(d * d), here, &b);
        predict_block(d, true, m.elastic, count, &b);
        return_block(d, m, count, &b, plastic + start);
        store(d, count, &b, here);
    }
}

static void j2_update(const double *parameters, int d, size_t n, const double *G,
                      double *sigma, double *plastic)
{
    const metal m = {lame_of_space(parameters), parameters[2], parameters[3]};
    if (d == 2)
        flow_points(2, m, n, G, sigma, plastic);
    else
        flow_points(3, m, n, G, sigma, plastic);
}

/* Plane stress. The flow scales sum = sigma11 + sigma22 by 1/(1 + ratio z), and what else
 * there is in the plane by 1/(1 + z); z = 2 mu times the multiplier. sigma33 stays 0. */
typedef struct {
    double ratio;       /* (1 + nu) / (3 (1 - nu)) */
    double hardening;   /* H / (3 mu) */
    double sum2, rest2; /* parts of the von Mises stress squared of the prediction */
    double yield;       /* sigma_Y before the step */
} plane_flow;

/* z >= 0 with q(z) (1 - H z/(3 mu)) = sigma_Y, and *q. By Newton on sigma_Y/q - 1 + H z /
 * (3 mu), which is concave and rises: from z = 0 the steps stay below the root and grow
 * to it, wherever that is. */
static double multiplier(const plane_flow *f, double *q)
{
    double z = 0;
    for (int k = 0; k < 50; k++) {
        const double both = 1 / ((1 + f->ratio * z) * (1 + z));
        const double u = (1 + z) * both, v = (1 + f->ratio * z) * both;
        const double sum = f->sum2 * u * u, rest = f->rest2 * v * v;
        *q = sqrt(sum + rest);
        const double by_q = 1 / *q, level = f->yield * by_q;
        const double missing = 1 - f->hardening * z - level;
        const double bend = (f->ratio * u * sum + v * rest) * by_q * by_q;
        const double step = missing / (level * bend + f->hardening);
        if (!(step > 1e-15 * z))
            break;
        z += step;
    }
    return z;
}

static void flow_in_plane(metal m, double ratio, double *sigma, double *plastic)
{
    const double sum = sigma[0] + sigma[1], difference = sigma[0] - sigma[1];
    const plane_flow f = {
        .ratio = ratio,
        .hardening = m.hardening / (3 * m.elastic.mu),
        .sum2 = 0.25 * sum * sum,
        .rest2 = 0.75 * difference * difference + 3 * sigma[3] * sigma[3],
        .yield = m.yield + m.hardening * *plastic,
    };
    if (f.sum2 + f.rest2 <= f.yield * f.yield)
        return;
    double q;
    const double z = multiplier(&f, &q);
    const double half_sum = 0.5 * sum / (1 + ratio * z);
    const double half_difference = 0.5 * difference / (1 + z);
    sigma[0] = half_sum + half_difference;
    sigma[1] = half_sum - half_difference;
    sigma[3] /= 1 + z;
    *plastic += z * q / (3 * m.elastic.mu);
}

static void j2_update_plane_stress(const double *parameters, int d, size_t n,
                                   const double *G, double *sigma, double *plastic)
{
    const double nu = parameters[1], ratio = (1 + nu) / (3 * (1 - nu));
    const metal m = {lame_of_plane_stress(parameters), parameters[2], parameters[3]};
    (void)d;
    predict_points(2, false, m.elastic, n, G, sigma);
    for (size_t p = 0; p < n; p++)
        flow_in_plane(m, ratio, sigma + p * PD_SYMMETRIC, plastic + p);
}

static const pd_parameter j2_parameters[] = {
    PARAMETER_E,
    PARAMETER_NU,
    {.key = "yieldStress",
     .unit = "Pa",
     .above = 0,
     .below = HUGE_VAL,
     .meaning = "von Mises stress at first yield"},
    {.key = "hardening",
     .unit = "Pa",
     .above = 0,
     .below = HUGE_VAL,
     .includes_above = true,
     .meaning = "increase of the yield stress per equivalent plastic strain"},
};

const pd_material pd_material_j2 = {
    .name = "J2",
    .source = "[behzadinasab2021] eqs B.1-B.8",
    .n_parameters = 4,
    .parameters = j2_parameters,
    .moduli = moduli_of_E_nu,
    .update = {[PD_PLANE_STRAIN] = j2_update, [PD_PLANE_STRESS] = j2_update_plane_stress},
    .is_plastic = true,
};
