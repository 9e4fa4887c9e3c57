/* The table of formulations. SPDX-License-Identifier: GPL-3.0-or-later */
#include <string.h>

#include "pd.h"

extern const pd_formulation pd_formulation_correspondence, pd_formulation_bond,
    pd_formulation_bond_associated;

const pd_formulation *const pd_formulations[] = {
    &pd_formulation_correspondence,
    &pd_formulation_bond,
    &pd_formulation_bond_associated,
    NULL,
};

const pd_formulation *pd_formulation_find(const char *name)
{
    for (const pd_formulation *const *f = pd_formulations; *f; f++)
        if (strcmp((*f)->name, name) == 0)
            return *f;
    return NULL;
}
