/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "solidTerms.H"
#include "fvmDdt.H"
#include "gaussLaplacianScheme.H"
#include "linear.H"
#include "uncorrectedSnGrad.H"
#include "fixedValueFvPatchFields.H"
#include "zeroGradientFvPatchFields.H"

#include <cmath>

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

//- What incompressible flow leaves of the resistance to changes of volume: its
//  velocities have no divergence, but what points take from them has a little.
//  Fitted to measured limits of the step (docs/limits.md)
scalar felt(const scalar bulk, const scalar shear)
{
    return sqr(bulk)/(bulk + 200*shear);
}

//- A bound of the square of the largest stretch: the largest sum of a row's
//  magnitudes of C = F^T F, at least 1
scalar largestStretchSqr(const double* F, const label d)
{
    scalar largest = 1;
    for (label r = 0; r < d; ++r)
    {
        scalar row = 0;
        for (label c = 0; c < d; ++c)
        {
            scalar C = 0;
            for (label k = 0; k < d; ++k)
            {
                C += F[k*d + r]*F[k*d + c];
            }
            row += std::fabs(C);
        }
        largest = max(largest, row);
    }
    return largest;
}

//- Modulus of the points of a body as they are now
class elasticity
{
    const pd_body_view& view_;
    scalar rest_, shear_;

public:

    elasticity(const periFoam::solidBody& body, const bool compressible)
    :
        view_(body.view())
    {
        scalar bulk;
        body.moduli(bulk, shear_);
        rest_ =
            compressible
          ? max(body.longitudinalModulus() - shear_, scalar(0))
          : felt(bulk, shear_);
    }

    scalar atRest() const
    {
        return shear_ + rest_;
    }

    scalar operator()(const label p) const
    {
        const label d = view_.dimension;
        const scalar stretchSqr =
            view_.F ? largestStretchSqr(view_.F + p*d*d, d) : 1;
        return stretchSqr*shear_ + rest_;
    }
};

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoam::solidTerms::spread
(
    const scalarField& amount,
    scalarField& density
) const
{
    // Along each axis that is solved for, as a force would be; then the mean
    vectorField along(amount.size());
    forAll(along, p)
    {
        along[p] = vector::uniform(amount[p]);
    }
    transfer_.spread(along);
    density.resize(mesh_.nCells());
    density = 0;
    const Vector<label>& solved = mesh_.geometricD();
    transfer_.forEachCellForce
    (
        [&](const label celli, const vector& f)
        {
            for (direction a = 0; a < 3; ++a)
            {
                density[celli] += solved[a] > 0 ? f[a] : 0;
            }
        }
    );
    density /= scalar(mesh_.nGeometricD())*mesh_.V();
}


Foam::scalarField Foam::periFoam::solidTerms::moduli() const
{
    DynamicList<scalar> all;
    for (const solidBody& body : bodies_)
    {
        const elasticity moduli(body, false);
        for (label p = 0; p < body.nMoving(); ++p)
        {
            all.append(body.volume(p)*moduli(p));
        }
    }
    return scalarField(std::move(all));
}


Foam::tmp<Foam::volScalarField> Foam::periFoam::solidTerms::asField
(
    const word& name,
    const dimensionSet& dimensions,
    const scalarField& values
) const
{
    tmp<volScalarField> field
    (
        new volScalarField
        (
            IOobject
            (
                name,
                mesh_.time().timeName(),
                mesh_,
                IOobject::NO_READ,
                IOobject::NO_WRITE,
                false
            ),
            mesh_,
            dimensionedScalar(dimensions, Zero),
            zeroGradientFvPatchScalarField::typeName
        )
    );
    field.ref().primitiveFieldRef() = values;
    field.ref().correctBoundaryConditions();
    return field;
}


Foam::tmp<Foam::fvMatrix<Foam::vector>> Foam::periFoam::solidTerms::inertia
(
    const volVectorField& U,
    const volScalarField* rho
) const
{
    tmp<fvMatrix<vector>> all(rho ? fvm::ddt(*rho, U) : fvm::ddt(U));
    if (hasExcess_)
    {
        all.ref() += excessInertia(U, rho);
    }
    return all;
}


Foam::tmp<Foam::fvMatrix<Foam::vector>>
Foam::periFoam::solidTerms::excessInertia
(
    const volVectorField& U,
    const volScalarField* rho
) const
{
    tmp<fvMatrix<vector>> excess(fvm::ddt(U));
    excess.ref() *= asField
    (
        "periFoamExcess",
        rho ? dimDensity : dimless,
        scalarField(excess_/(rho ? 1 : rho_))
    )().internalField();
    return excess;
}


Foam::vectorField Foam::periFoam::solidTerms::restOf
(
    const fvMatrix<vector>& inertia
) const
{
    return
        inertia.diag()*inertia.psi().primitiveField() - inertia.source()
      - force_ - response_;
}


void Foam::periFoam::solidTerms::makeFields(const fvMatrix<vector>& eqn)
{
    IOobject io
    (
        "periFoamRest",
        Time::timeName(mesh_.time().startTime().value()),
        mesh_,
        IOobject::READ_IF_PRESENT,
        IOobject::NO_WRITE // the solver writes before the step is complete
    );
    rest_.reset
    (
        new volVectorField
        (
            io,
            mesh_,
            dimensionedVector(eqn.dimensions()/dimVolume, Zero)
        )
    );
    wordList patches(mesh_.boundary().size());
    forAll(patches, i)
    {
        const word& type = mesh_.boundary()[i].type();
        patches[i] =
            polyPatch::constraintType(type)
          ? type
          : eqn.psi().boundaryField()[i].fixesValue()
          ? fixedValueFvPatchVectorField::typeName
          : zeroGradientFvPatchVectorField::typeName;
    }
    change_.reset
    (
        new volVectorField
        (
            IOobject
            (
                "periFoamChange",
                mesh_.time().timeName(),
                mesh_,
                IOobject::NO_READ,
                IOobject::NO_WRITE
            ),
            mesh_,
            dimensionedVector(dimVelocity, Zero),
            patches
        )
    );
    response_.resize(mesh_.nCells(), Zero);
}


void Foam::periFoam::solidTerms::predict
(
    const scalarField& diagonal,
    const vectorField& rhs,
    const scalar unit
)
{
    volVectorField& change = change_();
    change == dimensionedVector(dimVelocity, Zero); // also in a run resumed
    const dimensionSet perVolume(rest_().dimensions());
    const volScalarField g
    (
        asField
        (
            "periFoamElasticity",
            perVolume*dimArea/dimVelocity,
            strength_*mesh_.time().deltaTValue()*unit*modulus_
        )
    );
    fv::gaussLaplacianScheme<vector, scalar> laplacian
    (
        mesh_,
        tmp<surfaceInterpolationScheme<scalar>>(new linear<scalar>(mesh_)),
        tmp<fv::snGradScheme<vector>>
        (
            new fv::uncorrectedSnGrad<vector>(mesh_)
        )
    );
    tmp<fvMatrix<vector>> response
    (
        laplacian.fvmLaplacian(linear<scalar>(mesh_).interpolate(g)(), change)
    );
    fvMatrix<vector> eqn(-response());
    eqn.diag() += diagonal;
    eqn.source() += rhs;

    const dictionary& solvers = mesh_.solutionDict().subDict("solvers");
    dictionary controls;
    controls.add("solver", word("PCG"));
    controls.add("preconditioner", word("DIC"));
    controls.add("tolerance", 1e-10);
    controls.add("relTol", 1e-4);
    if (solvers.found(change.name()))
    {
        controls = solvers.subDict(change.name());
    }
    eqn.solve(controls);

    // What the laplacian of the solution is, by the equation itself
    response_ = diagonal*change.primitiveField() - rhs;
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::solidTerms::solidTerms
(
    const fvMesh& mesh,
    const PtrList<solidBody>& bodies,
    transfer& places,
    const scalar rho,
    const scalar strength
)
:
    mesh_(mesh),
    bodies_(bodies),
    transfer_(places),
    rho_(rho),
    strength_(strength),
    hasExcess_(false),
    index_(-1),
    density_(nullptr)
{
    DynamicList<scalar> masses;
    for (const solidBody& body : bodies_)
    {
        const scalar excess = body.options().density - rho_;
        hasExcess_ = hasExcess_ || excess != 0;
        for (label p = 0; p < body.nMoving(); ++p)
        {
            masses.append(excess*body.volume(p));
        }
    }
    if (hasExcess_)
    {
        excessMass_.transfer(masses);
    }
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::scalar Foam::periFoam::solidTerms::stiffest
(
    const solidBody& body,
    const bool stretched,
    const bool compressible
)
{
    const elasticity moduli(body, compressible);
    scalar largest = moduli.atRest();
    for (label p = 0; stretched && p < body.nMoving(); ++p)
    {
        largest = max(largest, moduli(p));
    }
    return largest;
}


void Foam::periFoam::solidTerms::addConvection
(
    const UList<vector>& u,
    const UList<vector>& v,
    const scalar dt,
    UList<vector>& force
) const
{
    forAll(excessMass_, p)
    {
        force[p] -= excessMass_[p]/dt*(u[p] - v[p]);
    }
}


void Foam::periFoam::solidTerms::update()
{
    if (strength_ > 0)
    {
        spread(moduli(), modulus_);
        modulus_ = max(modulus_, scalar(0));
    }
    if (hasExcess_)
    {
        spread(excessMass_, excess_);

        // Where points crowd, a lighter body would leave less than its own
        // inertia, and then none
        scalar lightest = 0;
        for (const solidBody& body : bodies_)
        {
            lightest = min(lightest, body.options().density - rho_);
        }
        excess_ = max(excess_, lightest);
    }
}


void Foam::periFoam::solidTerms::add
(
    fvMatrix<vector>& eqn,
    const volScalarField* rho,
    const scalarField& brake
)
{
    const volVectorField& U = eqn.psi();
    const scalar unit = rho ? 1 : 1/rho_;
    const label index = mesh_.time().timeIndex();
    const scalarField& V = mesh_.V();
    density_ = rho;

    scalarField braked;
    if (brake.size())
    {
        braked = brake*V;
        if (rho)
        {
            braked *= rho->primitiveField();
        }
        eqn.diag() -= braked;
    }

    tmp<fvMatrix<vector>> mass;
    if (strength_ > 0)
    {
        mass = inertia(U, rho);
        if (!rest_.valid())
        {
            makeFields(eqn);
        }
        if (index == index_) // an outer corrector
        {
            rest_->primitiveFieldRef() = restOf(mass())/V;
        }
    }
    force_.resize(mesh_.nCells());
    force_ = Zero;
    transfer_.forEachCellForce
    (
        [&](const label celli, const vector& f) { force_[celli] += unit*f; }
    );
    eqn.source() -= force_;
    if (strength_ > 0)
    {
        const fvMatrix<vector>& M = mass();
        scalarField diagonal(M.diag());
        if (braked.size())
        {
            diagonal += braked;
        }
        predict
        (
            diagonal,
            force_ + rest_->primitiveField()*V
          - M.diag()*U.primitiveField() + M.source(),
            unit
        );
        eqn.source() -= response_;
    }
    if (hasExcess_)
    {
        const fvMatrix<vector> excess(excessInertia(U, rho));
        excessDiag_ = excess.diag();
        excessSource_ = excess.source();
        eqn -= excess;
    }
    index_ = index;
}


Foam::scalarField Foam::periFoam::solidTerms::power
(
    const volVectorField& U
) const
{
    vectorField f(force_);
    if (response_.size())
    {
        f += response_;
    }
    if (hasExcess_)
    {
        f += excessSource_ - excessDiag_*U.primitiveField();
    }
    return f & U.primitiveField();
}


void Foam::periFoam::solidTerms::finish(const volVectorField& U)
{
    if (strength_ > 0 && index_ == mesh_.time().timeIndex())
    {
        rest_->primitiveFieldRef() =
            restOf(inertia(U, density_)())/mesh_.V();
    }
}


void Foam::periFoam::solidTerms::write()
{
    if (rest_.valid())
    {
        rest_->instance() = mesh_.time().timeName();
        rest_->write();
    }
}


// ************************************************************************* //
