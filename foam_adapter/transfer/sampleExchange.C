/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "sampleExchange.H"
#include "surfaceFields.H"

// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoam::sampleExchange::requestGhosts()
{
    List<parcel> requests(Pstream::nProcs());
    const labelList& ghosts = samples_.ghosts();
    for (; knownGhosts_ < ghosts.size(); ++knownGhosts_)
    {
        const label ghost = samples_.ghostLabels()[knownGhosts_];
        label rank, index;
        if (samples_.type() == stencils::FACES)
        {
            rank = halo_.face(ghost).rank;
            index = halo_.face(ghost).index;
        }
        else
        {
            rank = halo_.cell(ghost).rank;
            index = halo_.cell(ghost).index;
        }
        samplesTo_.take(rank, ghosts[knownGhosts_]);
        requests[rank].labels.append(index);
    }
    const List<parcel> arrived(deliver(requests));
    forAll(arrived, rank)
    {
        for (const label index : arrived[rank].labels)
        {
            samplesTo_.give(rank, samples_.compactOf(index));
        }
    }
}


void Foam::periFoam::sampleExchange::findBehind()
{
    const labelList& label = samples_.sampled();
    const polyBoundaryMesh& patches = mesh_.boundaryMesh();
    List<parcel> cells(Pstream::nProcs());
    for (; knownSamples_ < label.size(); ++knownSamples_)
    {
        const Foam::label facei = label[knownSamples_];
        if
        (
            samples_.type() != stencils::FACES || facei < 0
         || mesh_.isInternalFace(facei) || !halo_.coupled(facei)
        )
        {
            continue;
        }
        const Foam::label patchi = patches.whichPatch(facei);
        const halo::key& behind = halo_.otherCell(facei);
        forcesBehind_.give(behind.rank, coupled_.size());
        coupled_.append(knownSamples_);
        shareBehind_.append
        (
            1 - mesh_.weights().boundaryField()[patchi]
                [facei - patches[patchi].start()]
        );
        cells[behind.rank].labels.append(behind.index);
        cells[behind.rank].labels.append(facei);
    }
    const List<parcel> arrived(deliver(cells));
    forAll(arrived, rank)
    {
        const DynamicList<Foam::label>& told = arrived[rank].labels;
        for (Foam::label i = 0; i < told.size(); i += 2)
        {
            forcesBehind_.take(rank, cellBehind_.size());
            cellBehind_.append(told[i]);
            faceBehind_.append(labelPair(rank, told[i + 1]));
        }
    }
    leavingOrder_ = identity(coupled_.size());
    std::sort
    (
        leavingOrder_.begin(),
        leavingOrder_.end(),
        [&](const Foam::label a, const Foam::label b)
        {
            return label[coupled_[a]] < label[coupled_[b]];
        }
    );
    arrivingOrder_ = identity(cellBehind_.size());
    std::sort
    (
        arrivingOrder_.begin(),
        arrivingOrder_.end(),
        [&](const Foam::label a, const Foam::label b)
        {
            return faceBehind_[a] < faceBehind_[b];
        }
    );
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::sampleExchange::sampleExchange
(
    const fvMesh& mesh,
    const halo& beyond,
    stencils& samples
)
:
    mesh_(mesh),
    halo_(beyond),
    samples_(samples),
    knownSamples_(0),
    knownGhosts_(0)
{
    mesh.weights(); // made by all ranks together, or they wait for each other
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

bool Foam::periFoam::sampleExchange::update()
{
    bool grew = samples_.sampled().size() > knownSamples_;
    reduce(grew, orOp<bool>());
    if (grew)
    {
        requestGhosts();
        findBehind();
    }
    return grew;
}


void Foam::periFoam::sampleExchange::carryBehind(const UList<scalar>& force)
{
    leaving_.resize(coupled_.size());
    arriving_.resize(cellBehind_.size());
    forAll(coupled_, i)
    {
        const label sample = coupled_[i];
        leaving_[i] =
            shareBehind_[i]*force[sample]*samples_.normal()[sample];
    }
    forcesBehind_.forward(leaving_, arriving_);
}


Foam::label Foam::periFoam::sampleExchange::bytes() const
{
    return
        samplesTo_.bytes() + forcesBehind_.bytes()
      + coupled_.byteSize() + shareBehind_.byteSize() + cellBehind_.byteSize()
      + leaving_.byteSize() + arriving_.byteSize();
}


// ************************************************************************* //
