/*
 * Sharing points out among ranks: what pd_partition does, in parts. The only user of
 * METIS.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_PARTITION_H
#define PD_SRC_PARTITION_H

#include "pd.h"

/* Points a side of the clusters that pd_partition chooses; 1: every point by itself. */
int pd_partition_side(const pd_cloud *cloud, int parts);

/* pd_partition with clusters of that many points a side. */
pd_status pd_partition_clustered(const pd_cloud *cloud, int side, int parts, int *part);

#endif
