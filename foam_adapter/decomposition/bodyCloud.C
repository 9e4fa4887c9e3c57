/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "bodyCloud.H"

// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoam::bodyCloud::readPoints(const polyMesh& solid)
{
    const label n = solid.nCells();
    scalar depth = 1;
    DynamicList<direction> directions(3);
    for (direction d = 0; d < 3; ++d)
    {
        if (solid.geometricD()[d] > 0)
        {
            directions.append(d);
        }
        else
        {
            depth *= solid.bounds().span()[d];
        }
    }
    X_.resize(3*n, Zero);
    volume_.resize(n);
    for (label i = 0; i < n; ++i)
    {
        forAll(directions, a)
        {
            X_[3*i + a] = solid.cellCentres()[i][directions[a]];
        }
        volume_[i] = solid.cellVolumes()[i]/depth;
    }
    cloud_.dimension = directions.size();
    cloud_.n = n;
    cloud_.X = X_.cdata();
    cloud_.volume = volume_.cdata();
}


void Foam::periFoam::bodyCloud::readHolds(const polyMesh& solid)
{
    held_.resize(size(), (unsigned char)(0));
    cloud_.held = held_.cdata();
    if (!dict_.found("holds"))
    {
        return;
    }
    const checkedDictionary holds(dict_.sub("holds"));
    for (const word& name : holds.subNames())
    {
        const checkedDictionary hold(holds.sub(name));
        const wordList types({"implicit", "tether"});
        if (hold.choiceOr("implicit", "type", types) == "tether")
        {
            continue;
        }
        const bool byPatch = hold.found("patch");
        const word part
        (
            byPatch
          ? hold.choice("patch", solid.boundaryMesh().names())
          : hold.choice("cellZone", solid.cellZones().names())
        );
        const labelUList& cells =
            byPatch
          ? solid.boundaryMesh()[part].faceCells()
          : static_cast<const labelUList&>(solid.cellZones()[part]);
        for (const label celli : cells)
        {
            held_[celli] = 1;
        }
    }
}


void Foam::periFoam::bodyCloud::check(const pd_status& status) const
{
    if (status.code == PD_OK)
    {
        return;
    }
    OStringStream os;
    os << status.message;
    if (status.point >= 0)
    {
        os << " (cell " << label(status.point) << " of region " << name_ << ")";
    }
    dict_.refuse("horizonRatio", os.str());
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::bodyCloud::bodyCloud
(
    const word& name,
    const checkedDictionary& dict,
    const polyMesh& solid
)
:
    name_(name),
    dict_(dict),
    cloud_{}
{
    cloud_.horizon_ratio = dict_.number
    (
        "horizonRatio", range::between(0, 20, false, true), dimless
    );
    readPoints(solid);
    readHolds(solid);
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::scalarField Foam::periFoam::bodyCloud::costs() const
{
    scalarField cost(size());
    check(pd_partition_costs(&cloud_, cost.data()));
    label nMoving = 0;
    for (const unsigned char held : held_)
    {
        nMoving += !held;
    }
    cost *= 0.5*max(nMoving, 1)/sum(cost);
    forAll(cost, i)
    {
        cost[i] += held_[i] ? 0 : 0.5;
    }
    return cost;
}


Foam::labelList
Foam::periFoam::bodyCloud::partition(const label nRanks) const
{
    List<int> part(size());
    check(pd_partition(&cloud_, nRanks, part.data()));
    labelList rank(size());
    forAll(rank, i)
    {
        rank[i] = part[i];
    }
    return rank;
}


pd_partition_quality Foam::periFoam::bodyCloud::measure
(
    const label nRanks,
    const labelUList& rank
) const
{
    List<int> part(size());
    forAll(part, i)
    {
        part[i] = rank[i];
    }
    pd_partition_quality quality;
    check(pd_partition_measure(&cloud_, nRanks, part.cdata(), &quality));
    return quality;
}


// ************************************************************************* //
