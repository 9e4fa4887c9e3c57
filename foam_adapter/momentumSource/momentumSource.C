/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "momentumSource.H"
#include "peridynamics.H"

// * * * * * * * * * * * * * * Static Data Members * * * * * * * * * * * * * //

namespace Foam
{
namespace fv
{
    defineTypeNameAndDebug(periFoamMomentumSource, 0);
}
}


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

Foam::functionObjects::peridynamics&
Foam::fv::periFoamMomentumSource::coupling() const
{
    if (!coupling_)
    {
        FatalErrorInFunction
            << "the peridynamics function object " << name_
            << " was removed from controlDict during the run; the flow cannot"
            << " go on without its solid" << exit(FatalError);
    }
    return *coupling_;
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::fv::periFoamMomentumSource::periFoamMomentumSource
(
    const word& name,
    const wordList& fieldNames,
    const fvMesh& mesh,
    functionObjects::peridynamics& coupling
)
:
    option(name, typeName, dictionary::null, mesh),
    coupling_(&coupling)
{
    fieldNames_ = fieldNames;
    applied_.resize(fieldNames.size(), false);
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

void Foam::fv::periFoamMomentumSource::addSup
(
    fvMatrix<vector>& eqn,
    const label
)
{
    coupling().addForce(eqn, nullptr);
}


void Foam::fv::periFoamMomentumSource::addSup
(
    const volScalarField& rho,
    fvMatrix<vector>& eqn,
    const label
)
{
    coupling().addForce(eqn, &rho);
}


void Foam::fv::periFoamMomentumSource::addSup
(
    const volScalarField&,
    fvMatrix<scalar>& eqn,
    const label
)
{
    coupling().addPower(eqn);
}


// ************************************************************************* //
