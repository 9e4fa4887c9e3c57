/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "transfer.H"

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


void Foam::periFoam::transfer::sampleFaces
(
    const surfaceScalarField& phi,
    const scalar share
)
{
    const labelList& label = samples_.sampled();
    const DynamicList<scalar>& rArea = samples_.rArea();
    velocity_.resize(label.size());
    forAll(label, i)
    {
        velocity_[i] =
            label[i] < 0 ? 0 : faceVelocity(phi, label[i])*rArea[i];
    }
    if (share != 1)
    {
        const surfaceScalarField& old = phi.oldTime();
        forAll(label, i)
        {
            if (label[i] >= 0)
            {
                velocity_[i] =
                    share*velocity_[i]
                  + (1 - share)*faceVelocity(old, label[i])*rArea[i];
            }
        }
    }
}


template<class Value>
void Foam::periFoam::transfer::sampleCells(const Value& value)
{
    const labelList& label = samples_.sampled();
    velocity_.resize(3*label.size());
    forAll(label, i)
    {
        if (label[i] < 0)
        {
            continue;
        }
        const vector v(value(label[i]));
        for (direction a = 0; a < 3; ++a)
        {
            velocity_[3*i + a] = v[a];
        }
    }
}


void Foam::periFoam::transfer::fillSamples()
{
    if (!sampleExchange_.valid())
    {
        return;
    }
    if (faces())
    {
        sampleExchange_->fill(velocity_);
    }
    else
    {
        UList<vector> v(vectors(velocity_));
        sampleExchange_->fill(v);
    }
}


void Foam::periFoam::transfer::ofCells
(
    const stencils& samples,
    const UList<scalar>& sum,
    scalarField& cellSum
) const
{
    cellSum.resize(mesh_.nCells());
    cellSum = 0;
    forAll(sum, i)
    {
        if (samples.sampled()[i] >= 0)
        {
            cellSum[samples.sampled()[i]] += sum[i];
        }
    }
}


void Foam::periFoam::transfer::share(sampleExchange& samples)
{
    if (samples.update())
    {
        smallestWidth_ = min(samples_.smallestWidth(), cells_.smallestWidth());
        reduce(smallestWidth_, minOp<scalar>());
    }
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::transfer::transfer
(
    const fvMesh& mesh,
    const kernel& k,
    const bool faceFlux,
    const bool positive
)
:
    mesh_(mesh),
    locator_(mesh),
    halo_(halo::needed(mesh) ? new halo(mesh, k.halfWidth) : nullptr),
    samples_
    (
        mesh, k, faceFlux ? stencils::FACES : stencils::CELLS, halo_.get()
    ),
    cells_(mesh, k, stencils::CELLS, halo_.get()),
    smallestWidth_(GREAT),
    positive_(positive)
{
    if (halo_.valid())
    {
        hosting_.reset(new hosting(mesh, locator_, halo_.get(), &samples_));
        sampleExchange_.reset(new sampleExchange(mesh, halo_(), samples_));
        cellExchange_.reset(new sampleExchange(mesh, halo_(), cells_));
    }
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::autoPtr<Foam::periFoam::hosting>
Foam::periFoam::transfer::newHosting() const
{
    return autoPtr<hosting>
    (
        new hosting(mesh_, locator_, halo_.get(), nullptr)
    );
}


Foam::label Foam::periFoam::transfer::locate(const UList<point>& x)
{
    if (hosting_.valid())
    {
        return hosting_->locate(x);
    }
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
        cell_[p] = locator_.cellAt(x[p], cell_[p]);
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
    if (!hosting_.valid())
    {
        samples_.weigh(x, cell_, !positive_, weights_);
        return;
    }
    samples_.weigh
    (
        hosting_->place(), hosting_->cell(), !positive_, weights_
    );
    share(sampleExchange_());
}


void Foam::periFoam::transfer::sample
(
    const volVectorField& U,
    const surfaceScalarField& phi,
    const scalar share
)
{
    if (faces())
    {
        sampleFaces(phi, share);
    }
    else if (share == 1)
    {
        sampleCells([&](const label celli) { return U[celli]; });
    }
    else
    {
        const volVectorField& old = U.oldTime();
        sampleCells
        (
            [&](const label celli)
            {
                return share*U[celli] + (1 - share)*old[celli];
            }
        );
    }
    fillSamples();
}


void Foam::periFoam::transfer::sample(const UList<vector>& ofCells)
{
    sampleCells([&](const label celli) { return ofCells[celli]; });
    fillSamples();
}


void Foam::periFoam::transfer::interpolate(UList<vector>& u) const
{
    if (!hosting_.valid())
    {
        samples_.gather(weights_, velocity_, u);
        return;
    }
    List<vector> ofGuests(hosting_->place().size());
    samples_.gather(weights_, velocity_, ofGuests);
    hosting_->toOwners(ofGuests, u);
}


void Foam::periFoam::transfer::spread(const UList<vector>& force)
{
    force_.resize((faces() ? 1 : 3)*samples_.sampled().size());
    force_ = 0;
    if (!hosting_.valid())
    {
        samples_.scatter(weights_, force, force_);
        return;
    }
    samples_.scatter(weights_, hosting_->toHosts(force), force_);
    if (faces())
    {
        sampleExchange_->gather(force_);
        sampleExchange_->carryBehind(force_);
    }
    else
    {
        UList<vector> f(vectors(force_));
        sampleExchange_->gather(f);
    }
}


void Foam::periFoam::transfer::spread
(
    const UList<scalar>& amount,
    scalarField& cellSum
)
{
    scalarField sum(samples_.sampled().size(), 0);
    if (hosting_.valid())
    {
        samples_.scatter(weights_, hosting_->toHosts(amount), sum);
        sampleExchange_->gather(sum);
    }
    else
    {
        samples_.scatter(weights_, amount, sum);
    }
    ofCells(samples_, sum, cellSum);
}


void Foam::periFoam::transfer::spreadAmount
(
    const UList<point>& x,
    const UList<scalar>& amount,
    scalarField& cellSum
)
{
    autoPtr<hosting> hosts(newHosting());
    hosts->locate(x);
    stencils::weights weight;
    cells_.weigh(hosts->place(), hosts->cell(), false, weight);
    if (cellExchange_.valid())
    {
        share(cellExchange_());
    }
    scalarField sum(cells_.sampled().size(), 0);
    cells_.scatter(weight, hosts->toHosts(amount), sum);
    if (cellExchange_.valid())
    {
        cellExchange_->gather(sum);
    }
    ofCells(cells_, sum, cellSum);
}


Foam::label Foam::periFoam::transfer::bytes() const
{
    return
        samples_.bytes() + cells_.bytes()
      + (halo_.valid() ? halo_->bytes() : 0)
      + (hosting_.valid() ? hosting_->bytes() : 0)
      + (sampleExchange_.valid() ? sampleExchange_->bytes() : 0)
      + (cellExchange_.valid() ? cellExchange_->bytes() : 0)
      + velocity_.byteSize() + force_.byteSize() + cell_.byteSize()
      + weights_.stencil.byteSize() + weights_.first.byteSize()
      + weights_.w.byteSize();
}


// ************************************************************************* //
