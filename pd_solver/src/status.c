/* Making pd_status. SPDX-License-Identifier: GPL-3.0-or-later */
#include "status.h"

#include <stdarg.h>
#include <stdio.h>

pd_status pd_status_ok(void)
{
    return (pd_status){.code = PD_OK, .point = -1};
}

pd_status pd_status_fail(pd_code code, pd_global point, const char *format, ...)
{
    pd_status status = {.code = code, .point = point};
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(status.message, sizeof status.message, format, arguments);
    va_end(arguments);
    return status;
}
