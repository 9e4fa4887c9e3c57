/* Agreement among ranks. SPDX-License-Identifier: GPL-3.0-or-later */
#include "collective.h"

int pd_rank_of(MPI_Comm comm)
{
    int rank = 0;
    if (comm != MPI_COMM_NULL)
        MPI_Comm_rank(comm, &rank);
    return rank;
}

int pd_ranks_of(MPI_Comm comm)
{
    int ranks = 1;
    if (comm != MPI_COMM_NULL)
        MPI_Comm_size(comm, &ranks);
    return ranks;
}

pd_status pd_agree(MPI_Comm comm, pd_status status)
{
    const int ranks = pd_ranks_of(comm);
    if (ranks == 1)
        return status;
    int failed = status.code == PD_OK ? ranks : pd_rank_of(comm);
    MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MIN, comm);
    if (failed < ranks)
        MPI_Bcast(&status, (int)sizeof status, MPI_BYTE, failed, comm);
    return status;
}

void pd_count_all(MPI_Comm comm, int64_t *values, int n)
{
    if (pd_ranks_of(comm) > 1)
        MPI_Allreduce(MPI_IN_PLACE, values, n, MPI_INT64_T, MPI_SUM, comm);
}

int64_t pd_most_of_all(MPI_Comm comm, int64_t value)
{
    if (pd_ranks_of(comm) > 1)
        MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_INT64_T, MPI_MAX, comm);
    return value;
}

int64_t pd_count_before(MPI_Comm comm, int64_t value)
{
    int64_t before = 0;
    if (pd_ranks_of(comm) > 1)
        MPI_Exscan(&value, &before, 1, MPI_INT64_T, MPI_SUM, comm);
    return pd_rank_of(comm) == 0 ? 0 : before; /* Exscan leaves that of rank 0 alone */
}

void pd_sum_all(MPI_Comm comm, double *values, size_t n)
{
    const size_t most = 1 << 28; /* MPI counts in int */
    for (size_t k = 0; pd_ranks_of(comm) > 1 && k < n; k += most)
        MPI_Allreduce(MPI_IN_PLACE, values + k, (int)(n - k < most ? n - k : most),
                      MPI_DOUBLE, MPI_SUM, comm);
}

void pd_largest_all(MPI_Comm comm, double *values, int n)
{
    if (pd_ranks_of(comm) > 1)
        MPI_Allreduce(MPI_IN_PLACE, values, n, MPI_DOUBLE, MPI_MAX, comm);
}
