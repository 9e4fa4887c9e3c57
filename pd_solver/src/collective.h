/*
 * Agreement among ranks. MPI_COMM_NULL is one rank, and no function of MPI is called.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_SRC_COLLECTIVE_H
#define PD_SRC_COLLECTIVE_H

#include "pd.h"

int pd_rank_of(MPI_Comm comm);
int pd_ranks_of(MPI_Comm comm);

/* The status of the lowest rank that failed, on all ranks. Collective. */
pd_status pd_agree(MPI_Comm comm, pd_status status);

/* Sums over all ranks, in place. Collective. */
void pd_count_all(MPI_Comm comm, int64_t *values, int n);

void pd_sum_all(MPI_Comm comm, double *values, size_t n);

/* The largest of each of the ranks' values, in place. Collective. */
void pd_largest_all(MPI_Comm comm, double *values, int n);

/* The largest of the ranks' values. Collective. */
int64_t pd_most_of_all(MPI_Comm comm, int64_t value);

/* Sum of the values of the ranks before this one. Collective. */
int64_t pd_count_before(MPI_Comm comm, int64_t value);

#endif
