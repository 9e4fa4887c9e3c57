/* The table of materials. SPDX-License-Identifier: GPL-3.0-or-later */
#include "material.h"

#include <string.h>

const pd_material *const pd_materials[] = {&pd_material_neo_hookean,
                                           &pd_material_mooney_rivlin,
                                           &pd_material_st_venant_kirchhoff,
                                           &pd_material_linear_elastic,
                                           &pd_material_j2,
                                           &pd_material_microelastic,
                                           NULL};

const pd_material *pd_material_find(const char *name)
{
    for (const pd_material *const *m = pd_materials; *m; m++)
        if (strcmp((*m)->name, name) == 0)
            return *m;
    return NULL;
}

double pd_kappa_stab(double G, double nu_stab)
{
    return 2 * G * (1 + nu_stab) / (3 * (1 - 2 * nu_stab));
}
