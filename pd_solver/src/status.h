/* Making and passing on pd_status. SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef PD_SRC_STATUS_H
#define PD_SRC_STATUS_H

#include <math.h>

#include "pd.h"

/* Beyond this a position, velocity or load is as good as infinite: its powers in J and
 * tr C must stay finite. */
#define PD_LARGEST 1e60

static inline bool usable(double value)
{
    return isfinite(value) && fabs(value) < PD_LARGEST;
}

pd_status pd_status_ok(void);

/* A failure; point is the caller's number or -1. */
pd_status pd_status_fail(pd_code code, pd_global point, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#define PD_TRY(call)                                                                     \
    do {                                                                                 \
        pd_status status_ = (call);                                                      \
        if (status_.code != PD_OK)                                                       \
            return status_;                                                              \
    } while (0)

#endif
