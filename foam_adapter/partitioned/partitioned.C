/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "partitioned.H"
#include "basicThermo.H"
#include "coupledFaces.H"
#include "syncTools.H"
#include "wallPolyPatch.H"

#include <cmath>

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

//- What moves as a motion says counts as this much heavier in exchanges of
//  momentum than it is, and so does what is held
constexpr scalar unmoved = 1e9;

//- Largest (s/(1 - s))^4: what leaks through is this much less than what would
//  flow. Larger numbers hide the flow around from linear solvers, which take
//  residuals in proportion to the largest coefficients; a gas needs them
scalar tightest(const bool compressible)
{
    return compressible ? 1e6 : 1e4;
}

//- (s/(1 - s))^4 of a cell with that share covered, but at most that
scalar tightness(const scalar cover, const scalar most)
{
    const scalar open = max(1 - cover, SMALL);
    return min(pow4(max(cover, scalar(0))/open), most);
}

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoam::partitioned::listMasses()
{
    DynamicList<scalar> volumes, masses;
    for (const solidBody& body : bodies_)
    {
        const scalar beyond = body.options().density - options_.rho;
        for (label p = 0; p < body.nMoving(); ++p)
        {
            volumes.append(body.volume(p));
            masses.append(body.volume(p)*beyond);
        }
        const label first = masses.size() - body.nMoving();
        for (const label p : body.driven())
        {
            masses[first + p] *= unmoved;
        }
    }
    volume_.transfer(volumes);
    mass_.transfer(masses);
}


void Foam::periFoam::partitioned::findWalls()
{
    const boundBox& box = mesh_.bounds();
    const scalar near = 1e-6*box.mag();
    FixedList<bool, 6> wall(false), other(false);
    for (const polyPatch& patch : mesh_.boundaryMesh())
    {
        FixedList<bool, 6>& kind = isA<wallPolyPatch>(patch) ? wall : other;
        for (const point& x : patch.faceCentres())
        {
            for (direction axis = 0; axis < 3; ++axis)
            {
                kind[2*axis] |= mag(x[axis] - box.min()[axis]) < near;
                kind[2*axis + 1] |= mag(x[axis] - box.max()[axis]) < near;
            }
        }
    }
    forAll(walls_, side)
    {
        reduce(wall[side], orOp<bool>());
        reduce(other[side], orOp<bool>());
        walls_[side] = wall[side] && !other[side];
    }
}


void Foam::periFoam::partitioned::forget
(
    const label bodyi,
    const labelUList& points
)
{
    label start = 0;
    for (label i = 0; i < bodyi; ++i)
    {
        start += bodies_[i].nMoving();
    }
    for (const label p : points)
    {
        mass_[start + p] = 0;
        volume_[start + p] = 0;
    }
}


void Foam::periFoam::partitioned::coverByHeld()
{
    heldCells_.resize(bodies_.size());
    heldVolumes_.resize(bodies_.size());
    forAll(bodies_, i)
    {
        bodies_[i].heldOver(transfer_, heldCells_[i], heldVolumes_[i]);
    }
}


void Foam::periFoam::partitioned::addSlip(fvMatrix<vector>& eqn) const
{
    const word mu("thermo:mu"), nu("nu");
    const volVectorField& U = eqn.psi();
    const bool compressible = mesh_.foundObject<volScalarField>(mu);
    if (!compressible && !mesh_.foundObject<volScalarField>(nu))
    {
        return; // without viscosity every wall slips
    }
    // Of the equation: over the density where that has none
    const volScalarField& viscosity =
        mesh_.lookupObject<volScalarField>(compressible ? mu : nu);
    vectorField& source = eqn.source();
    const auto isWall = [](const scalar one, const scalar other)
    {
        return (one < 0.5) != (other < 0.5);
    };
    // The shear force on a cell over a face, from its neighbour
    const auto shear = [&](const label facei, const label celli, const vector& u)
    {
        const vector S(mesh_.faceAreas()[facei]);
        const vector n(S/mag(S));
        const scalar d =
            2*mag(n & (mesh_.faceCentres()[facei] - mesh_.cellCentres()[celli]));
        const vector off(u - U[celli]);
        return viscosity[celli]*mag(S)/d*(off - n*(n & off));
    };
    const labelList& owner = mesh_.faceOwner();
    const labelList& neighbour = mesh_.faceNeighbour();
    forAll(neighbour, facei)
    {
        const label P = owner[facei], N = neighbour[facei];
        if (isWall(cover_[P], cover_[N]))
        {
            const vector f(shear(facei, P, U[N]));
            source[P] += f;
            source[N] -= f;
        }
    }
    scalarField coverBeyond;
    vectorField UBeyond;
    syncTools::swapBoundaryCellList(mesh_, cover_, coverBeyond);
    syncTools::swapBoundaryCellList(mesh_, U.primitiveField(), UBeyond);
    forEachCoupledFace
    (
        mesh_,
        [&](const label facei, const label P, const label b)
        {
            if (isWall(cover_[P], coverBeyond[b]))
            {
                source[P] += shear(facei, P, UBeyond[b]);
            }
        }
    );
}


Foam::vectorField Foam::periFoam::partitioned::cellForce
(
    const volVectorField& U
) const
{
    return exchange_*(solidVelocity_ - U.primitiveField());
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::partitioned::partitioned
(
    const fvMesh& mesh,
    PtrList<solidBody>& bodies,
    const kernel& k,
    const options& o
)
:
    mesh_(mesh),
    bodies_(bodies),
    options_(o),
    integrator_(*pd_integrator_find("velocityVerlet")),
    transfer_(mesh, k, false, true),
    stableStep_(GREAT),
    force_(bodies.size(), vector::zero)
{
    listMasses();
    findWalls();
    coverByHeld();
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::label Foam::periFoam::partitioned::substeps(const scalar deltaT) const
{
    const scalar n = std::ceil(deltaT/(options_.maxStep*stableStep_)*(1 - 1e-9));
    return max(label(n), 1);
}


Foam::label Foam::periFoam::partitioned::begin
(
    const scalar time,
    const bool resumed,
    pd_status& status
)
{
    forAll(bodies_, i)
    {
        solidBody& body = bodies_[i];
        body.release(body.options().density - options_.rho);
        stableStep_ = min(stableStep_, body.stableStep());
        if (!resumed)
        {
            status = body.begin(time);
        }
        if (status.code != PD_OK)
        {
            return i;
        }
        if (resumed)
        {
            forget(i, body.findGone());
        }
        body.keep();
    }
    return -1;
}


Foam::label Foam::periFoam::partitioned::move
(
    const scalar time,
    const scalar deltaT,
    pd_status& status
)
{
    const label n = substeps(deltaT);
    forAll(bodies_, i)
    {
        for (label k = 1; k <= n; ++k)
        {
            status = bodies_[i].step
            (
                integrator_, deltaT/n, time + k*deltaT/n
            );
            if (status.code != PD_OK)
            {
                return i;
            }
        }
        bodies_[i].stopAt(mesh_.bounds(), walls_);
    }
    return -1;
}


Foam::label Foam::periFoam::partitioned::letGo()
{
    label n = 0;
    forAll(bodies_, i)
    {
        const labelList gone(bodies_[i].letGo(mesh_.bounds()));
        forget(i, gone);
        n += returnReduce(gone.size(), sumOp<label>());
    }
    return n;
}


void Foam::periFoam::partitioned::cover(const UList<point>& x)
{
    List<vector> momentum(mass_.size());
    label at = 0;
    for (const solidBody& body : bodies_)
    {
        for (label p = 0; p < body.nMoving(); ++p, ++at)
        {
            momentum[at] = mass_[at]*body.velocity(p);
        }
    }
    transfer_.weigh(x);
    transfer_.spread(volume_, cover_);
    transfer_.spread(mass_, cellMass_);
    transfer_.spread(momentum);
    solidVelocity_.resize(mesh_.nCells());
    solidVelocity_ = Zero;
    transfer_.forEachCellForce
    (
        [&](const label celli, const vector& mv)
        {
            solidVelocity_[celli] += mv;
        }
    );
    forAll(bodies_, i)
    {
        const scalar density = bodies_[i].options().density - options_.rho;
        forAll(heldCells_[i], k)
        {
            const scalar V = heldVolumes_[i][k];
            cover_[heldCells_[i][k]] += V;
            cellMass_[heldCells_[i][k]] += unmoved*density*V;
        }
    }
    cover_ /= mesh_.V();
    forAll(solidVelocity_, celli)
    {
        solidVelocity_[celli] /= max(cellMass_[celli], VSMALL);
    }
}


void Foam::periFoam::partitioned::add
(
    fvMatrix<vector>& eqn,
    const volScalarField* rho
)
{
    const scalar deltaT = mesh_.time().deltaTValue();
    const scalarField& V = mesh_.V();
    const scalar most = tightest(rho);
    drag_.resize(mesh_.nCells());
    exchange_.resize(mesh_.nCells());
    forAll(drag_, celli)
    {
        const scalar density = rho ? (*rho)[celli] : options_.rho;
        drag_[celli] = density*V[celli]/deltaT*tightness(cover_[celli], most);
        exchange_[celli] =
            drag_[celli] > 0 && cellMass_[celli] > 0
          ? 1/(1/drag_[celli] + options_.implicitDrag*deltaT/cellMass_[celli])
          : 0;
    }
    if (options_.slip)
    {
        addSlip(eqn);
    }
    const scalar unit = rho ? 1 : 1/options_.rho;
    eqn.diag() -= unit*exchange_;
    eqn.source() -= unit*exchange_*solidVelocity_;
}


void Foam::periFoam::partitioned::addPower
(
    fvMatrix<scalar>& eqn,
    const volVectorField& U
) const
{
    const scalar deltaT = mesh_.time().deltaTValue();
    const vectorField f(cellForce(U));
    scalarField& source = eqn.source();
    forAll(f, celli)
    {
        if (exchange_[celli] > 0)
        {
            const vector mean
            (
                solidVelocity_[celli] - 0.5*deltaT/cellMass_[celli]*f[celli]
            );
            source[celli] -= f[celli] & mean;
        }
    }
    if (options_.temperature > 0)
    {
        const basicThermo& thermo =
            mesh_.lookupObject<basicThermo>(basicThermo::dictName);
        const scalarField atWall
        (
            thermo.he
            (
                thermo.p(),
                scalarField(mesh_.nCells(), options_.temperature),
                identity(mesh_.nCells())
            )
        );
        eqn.diag() -= drag_;
        source -= drag_*atWall;
    }
}


void Foam::periFoam::partitioned::react(const volVectorField& U)
{
    react(vectorField(-mesh_.time().deltaTValue()*cellForce(U)));
}


void Foam::periFoam::partitioned::react(const vectorField& impulses)
{
    const scalar deltaT = mesh_.time().deltaTValue();
    vectorField change(impulses);
    forAll(change, celli)
    {
        change[celli] /= max(cellMass_[celli], VSMALL);
    }
    List<vector> kick(mass_.size());
    transfer_.sample(change);
    transfer_.interpolate(kick);
    label start = 0;
    forAll(bodies_, i)
    {
        solidBody& body = bodies_[i];
        const scalar density = body.options().density - options_.rho;
        const SubList<vector> ofThis(kick, body.nMoving(), start);
        vector impulse(Zero);
        forAll(ofThis, p)
        {
            impulse += mass_[start + p]*ofThis[p];
            if (mass_[start + p] == 0)
            {
                kick[start + p] = vector::zero; // let go
            }
        }
        forAll(heldCells_[i], k)
        {
            impulse +=
                unmoved*density*heldVolumes_[i][k]*change[heldCells_[i][k]];
        }
        body.kick
        (
            ofThis, SubList<scalar>(mass_, body.nMoving(), start), deltaT
        );
        start += body.nMoving();
        force_[i] = returnReduce(impulse, sumOp<vector>())/deltaT;
    }
}


// ************************************************************************* //
