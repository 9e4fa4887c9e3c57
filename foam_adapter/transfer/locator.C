/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "locator.H"
#include "emptyPolyPatch.H"
#include "volFields.H"

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

//- Share of a cell's size that gaps between cells have at most
constexpr Foam::scalar widestGap = 0.1;

} // End anonymous namespace


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::locator::locator(const fvMesh& mesh)
:
    mesh_(mesh),
    longestWalk_
    (
        3*Foam::pow(scalar(mesh.nCells()), 1./mesh.nGeometricD())
    )
{}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::periFoam::locator::walk Foam::periFoam::locator::walkTo
(
    const point& x,
    label celli
) const
{
    const vectorField& centre = mesh_.faceCentres();
    const vectorField& area = mesh_.faceAreas();
    const labelList& owner = mesh_.faceOwner();

    label nearest = celli;
    scalar gap = GREAT;
    for (label step = 0; step < longestWalk_; ++step)
    {
        label exit = -1;
        scalar farthest = 0;
        for (const label facei : mesh_.cells()[celli])
        {
            const scalar height = ((x - centre[facei]) & area[facei]);
            const scalar outwards = owner[facei] == celli ? height : -height;

            // Round-off keeps a point on a face where it is. Faces of empty
            // patches do not count: points keep to the plane by themselves
            if
            (
                outwards > farthest
             && outwards > 1e-12*mag(area[facei])*mag(x)
             && (
                    mesh_.isInternalFace(facei)
                 || !isA<emptyPolyPatch>
                    (
                        mesh_.boundaryMesh()
                        [mesh_.boundaryMesh().whichPatch(facei)]
                    )
                )
            )
            {
                farthest = outwards;
                exit = facei;
            }
        }
        if (exit < 0)
        {
            return {celli, -1, celli};
        }
        if (!mesh_.isInternalFace(exit))
        {
            return {-1, exit, celli};
        }
        if (farthest < gap*mag(area[exit]))
        {
            gap = farthest/mag(area[exit]);
            nearest = celli;
        }
        celli = owner[exit] == celli ? mesh_.faceNeighbour()[exit] : owner[exit];
    }

    // In circles: in a gap that warped faces leave between cells, or lost
    const bool inGap = gap < widestGap*Foam::cbrt(mesh_.V()[nearest]);
    return {inGap ? nearest : -1, -1, nearest};
}


Foam::label Foam::periFoam::locator::cellAt
(
    const point& x,
    label celli
) const
{
    celli = walkTo(x, celli).cell;
    if (celli < 0)
    {
        celli = mesh_.findCell(x, polyMesh::FACE_PLANES);
    }
    if (celli < 0)
    {
        // On a wall, but for round-off
        celli = walkTo(x, mesh_.findNearestCell(x)).cell;
    }
    return celli;
}


Foam::label Foam::periFoam::locator::search(const point& x) const
{
    if (!search_.valid())
    {
        search_.reset(new meshSearch(mesh_, polyMesh::FACE_PLANES));
    }
    return search_->findCell(x);
}


Foam::label Foam::periFoam::locator::nearest(const point& x) const
{
    if (!search_.valid())
    {
        search_.reset(new meshSearch(mesh_, polyMesh::FACE_PLANES));
    }
    const walk w(walkTo(x, search_->findNearestCell(x)));
    if
    (
        w.cell >= 0 || w.exit < 0
     || !mesh_.boundaryMesh()
        [mesh_.boundaryMesh().whichPatch(w.exit)].coupled()
    )
    {
        return w.cell;
    }
    const vector& S = mesh_.faceAreas()[w.exit];
    const scalar outwards = ((x - mesh_.faceCentres()[w.exit]) & S)/mag(S);
    return outwards < widestGap*Foam::cbrt(mesh_.V()[w.last]) ? w.last : -1;
}


// ************************************************************************* //
