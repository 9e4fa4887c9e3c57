/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "transfer.H"
#include "emptyPolyPatch.H"

// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

Foam::scalar Foam::periFoam::transfer::faceVelocity
(
    const surfaceScalarField& phi,
    label facei
) const
{
    if (mesh_.isInternalFace(facei))
    {
        return phi[facei];
    }
    const label patchi = mesh_.boundaryMesh().whichPatch(facei);
    return phi.boundaryField()[patchi]
        [facei - mesh_.boundaryMesh()[patchi].start()];
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::transfer::transfer
(
    const fvMesh& mesh,
    const kernel& k,
    const bool faceFlux
)
:
    mesh_(mesh),
    longestWalk_
    (
        3*Foam::pow(scalar(mesh.nCells()), 1./mesh.nGeometricD())
    ),
    samples_(mesh, k, faceFlux ? stencils::FACES : stencils::CELLS),
    cells_(mesh, k, stencils::CELLS)
{}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::label Foam::periFoam::transfer::walk
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
            return celli;
        }
        if (!mesh_.isInternalFace(exit))
        {
            return -1;
        }
        if (farthest < gap*mag(area[exit]))
        {
            gap = farthest/mag(area[exit]);
            nearest = celli;
        }
        celli = owner[exit] == celli ? mesh_.faceNeighbour()[exit] : owner[exit];
    }

    // In circles: in a gap that warped faces leave between cells, or lost
    return gap < 0.1*Foam::cbrt(mesh_.V()[nearest]) ? nearest : -1;
}


Foam::label Foam::periFoam::transfer::cellAt
(
    const point& x,
    label celli
) const
{
    celli = walk(x, celli);
    if (celli < 0)
    {
        celli = mesh_.findCell(x, polyMesh::FACE_PLANES);
    }
    if (celli < 0)
    {
        // On a wall, but for round-off
        celli = walk(x, mesh_.findNearestCell(x));
    }
    return celli;
}


Foam::label Foam::periFoam::transfer::locate(const UList<point>& x)
{
    if (cell_.size() != x.size())
    {
        cell_.resize(x.size(), 0);
    }
    // Neighbours in the list are neighbours in space: the last point's cell
    // is where a point without a cell of its own starts from
    forAll(x, p)
    {
        if (samples_.inside(x[p], cell_[p]))
        {
            continue;
        }
        cell_[p] = cellAt(x[p], cell_[p]);
        if (cell_[p] < 0)
        {
            cell_[p] = 0;
            return p;
        }
    }
    return -1;
}


void Foam::periFoam::transfer::weigh(const UList<point>& x)
{
    samples_.weigh(x, cell_, true, weights_);
}


void Foam::periFoam::transfer::sample
(
    const volVectorField& U,
    const surfaceScalarField& phi,
    const bool midpoint
)
{
    const labelList& label = samples_.sampled();
    if (!faces())
    {
        velocity_.resize(3*label.size());
        forAll(label, i)
        {
            const vector v
            (
                midpoint
              ? (U[label[i]] + U.oldTime()[label[i]])/2
              : U[label[i]]
            );
            for (direction a = 0; a < 3; ++a)
            {
                velocity_[3*i + a] = v[a];
            }
        }
        return;
    }
    velocity_.resize(label.size());
    const DynamicList<scalar>& rArea = samples_.rArea();
    forAll(label, i)
    {
        velocity_[i] = faceVelocity(phi, label[i])*rArea[i];
    }
    if (midpoint)
    {
        const surfaceScalarField& old = phi.oldTime();
        forAll(label, i)
        {
            velocity_[i] =
                (velocity_[i] + faceVelocity(old, label[i])*rArea[i])/2;
        }
    }
}


void Foam::periFoam::transfer::interpolate(UList<vector>& u) const
{
    samples_.gather(weights_, velocity_, u);
}


void Foam::periFoam::transfer::spread(const UList<vector>& force)
{
    force_.resize((faces() ? 1 : 3)*samples_.sampled().size());
    force_ = 0;
    samples_.scatter(weights_, force, force_);
}


void Foam::periFoam::transfer::spreadAmount
(
    const UList<point>& x,
    const UList<scalar>& amount,
    scalarField& cellSum
)
{
    DynamicList<point> place(x.size());
    DynamicList<label> cell(x.size());
    DynamicList<scalar> inside(x.size());
    label near = 0;
    forAll(x, p)
    {
        const label celli = cellAt(x[p], near);
        if (celli >= 0)
        {
            near = celli;
            place.append(x[p]);
            cell.append(celli);
            inside.append(amount[p]);
        }
    }
    stencils::weights weight;
    cells_.weigh(place, cell, false, weight);
    scalarField sum(cells_.sampled().size(), 0);
    cells_.scatter(weight, inside, sum);

    cellSum.resize(mesh_.nCells());
    cellSum = 0;
    forAll(sum, i)
    {
        cellSum[cells_.sampled()[i]] += sum[i];
    }
}


Foam::label Foam::periFoam::transfer::bytes() const
{
    return
        samples_.bytes() + cells_.bytes()
      + velocity_.byteSize() + force_.byteSize() + cell_.byteSize()
      + weights_.stencil.byteSize() + weights_.first.byteSize()
      + weights_.w.byteSize();
}


// ************************************************************************* //
