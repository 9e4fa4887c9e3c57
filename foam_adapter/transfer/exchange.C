/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "exchange.H"

#include <algorithm>

// * * * * * * * * * * * * * * * Global Functions  * * * * * * * * * * * * * //

Foam::List<Foam::periFoam::parcel> Foam::periFoam::deliver
(
    List<parcel>& outgoing
)
{
    const label me = Pstream::myProcNo();
    List<parcel> incoming(outgoing.size());
    incoming[me].labels.transfer(outgoing[me].labels);
    incoming[me].reals.transfer(outgoing[me].reals);
    if (!Pstream::parRun())
    {
        return incoming;
    }
    PstreamBuffers buffers(Pstream::commsTypes::nonBlocking);
    forAll(outgoing, rank)
    {
        if (outgoing[rank].labels.size() || outgoing[rank].reals.size())
        {
            UOPstream to(rank, buffers);
            to  << static_cast<const UList<label>&>(outgoing[rank].labels)
                << static_cast<const UList<scalar>&>(outgoing[rank].reals);
        }
    }
    labelList sizes;
    buffers.finishedSends(sizes);
    forAll(incoming, rank)
    {
        if (rank != me && sizes[rank])
        {
            UIPstream from(rank, buffers);
            labelList labels;
            scalarList reals;
            from >> labels >> reals;
            incoming[rank].labels.transfer(labels);
            incoming[rank].reals.transfer(reals);
        }
    }
    return incoming;
}


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

Foam::periFoam::exchange::partner& Foam::periFoam::exchange::with
(
    const label rank
)
{
    const auto place = std::lower_bound
    (
        partners_.begin(),
        partners_.end(),
        rank,
        [](const partner& p, const label r) { return p.rank < r; }
    );
    if (place != partners_.end() && place->rank == rank)
    {
        return *place;
    }
    return *partners_.insert(place, partner{rank, {}, {}});
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::label Foam::periFoam::exchange::bytes() const
{
    label total = 0;
    for (const partner& p : partners_)
    {
        total += sizeof(partner) + p.give.byteSize() + p.take.byteSize();
    }
    return total;
}


// ************************************************************************* //
