/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

Application
    periCheck

Description
    Reads a case as its solver would, says what the bodies are, how long a step
    may be and what it costs, or what is wrong, and takes no step. Nothing is
    written.

    With a fluid mesh in constant/polyMesh the case is one for the solver that
    controlDict names, else one for periSolidFoam.

\*---------------------------------------------------------------------------*/

#include "argList.H"
#include "fvMesh.H"
#include "memInfo.H"
#include "peridynamics.H"
#include "solidRun.H"
#include "surfaceFields.H"
#include "Time.H"
#include "volFields.H"

using namespace Foam;

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

//- The function object that couples, by its name
const entry& couplingOf(const Time& time)
{
    const dictionary& all =
        time.controlDict().subOrEmptyDict("functions");
    for (const entry& e : all)
    {
        if
        (
            e.isDict()
         && e.dict().lookupOrDefault<word>("type", word::null)
         == functionObjects::peridynamics::typeName
        )
        {
            return time.controlDict().subDict("functions").lookupEntry
            (
                e.keyword(), keyType::LITERAL
            );
        }
    }
    FatalIOErrorInFunction(time.controlDict())
        << "the dictionary functions has no function object of type "
        << functionObjects::peridynamics::typeName
        << ", so that the bodies would not be in the flow; allowed: one,"
        << " solid { type peridynamics; libs (periFoam); }"
        << exit(FatalIOError);
    return *time.controlDict().begin(); // not reached
}

template<class GeoField>
autoPtr<GeoField> readField(const fvMesh& mesh, const word& name)
{
    return autoPtr<GeoField>
    (
        new GeoField
        (
            IOobject
            (
                name,
                mesh.time().timeName(),
                mesh,
                IOobject::MUST_READ,
                IOobject::NO_WRITE
            ),
            mesh
        )
    );
}

//- A field that only has to be there
template<class GeoField>
autoPtr<GeoField> standIn(const fvMesh& mesh, const word& name)
{
    return autoPtr<GeoField>
    (
        new GeoField
        (
            IOobject(name, mesh.time().timeName(), mesh),
            mesh,
            dimensioned<typename GeoField::value_type>(dimless, Zero)
        )
    );
}

void tellCost
(
    const Time& time,
    const label kilobytes,
    const scalar seconds,
    const char* beside
)
{
    const scalar deltaT = time.deltaTValue();
    const scalar steps = (time.endTime().value() - time.value())/deltaT;
    Info<< "    memory " << periFoam::brief(1e-3*max(kilobytes, 0)) << " MB"
        << nl
        << "    " << periFoam::brief(1e3*seconds) << " ms a step, "
        << periFoam::brief(steps) << " steps of " << periFoam::brief(deltaT)
        << " s to endTime: " << periFoam::brief(steps*seconds) << " s"
        << beside << nl << nl;
}

void checkAlone(Time& time)
{
    memInfo memory;
    const label before = memory.update().rss();
    periFoam::solidRun run(time, true);
    const label used = memory.update().rss() - before;
    tellCost(time, used, run.secondsPerStep(), "");
}

void checkInFlow(Time& time)
{
    const fvMesh mesh
    (
        IOobject
        (
            polyMesh::defaultRegion,
            time.timeName(),
            time,
            IOobject::MUST_READ
        )
    );
    const bool compressible =
        isFile(time.path()/time.constant()/"thermophysicalProperties");
    const autoPtr<volVectorField> U(readField<volVectorField>(mesh, "U"));
    const surfaceScalarField phi
    (
        IOobject("phi", time.timeName(), mesh),
        mesh,
        dimensionedScalar
        (
            compressible ? dimMass/dimTime : dimVolume/dimTime, Zero
        )
    );
    autoPtr<volVectorField> rhoU;
    PtrList<volScalarField> states;
    if
    (
        time.controlDict().lookupOrDefault<word>("application", word::null)
     == "rhoCentralFoam"
    )
    {
        rhoU = standIn<volVectorField>(mesh, "rhoU");
        for (const char* name : {"rho", "rhoE", "p", "T"})
        {
            states.append(standIn<volScalarField>(mesh, name).release());
        }
    }

    const entry& coupling = couplingOf(time);
    memInfo memory;
    const label before = memory.update().rss();
    functionObjects::peridynamics run
    (
        coupling.keyword(), time, coupling.dict(), true
    );
    const label used = memory.update().rss() - before;
    tellCost
    (
        time, used, run.secondsPerStep(), " for bodies and transfer, besides"
        " the flow"
    );
}

} // End anonymous namespace


// * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * //

int main(int argc, char* argv[])
{
    argList::addNote
    (
        "Checks a case with peridynamic bodies, tells what a step may be and"
        " what it costs, and takes none"
    );

    #include "setRootCase.H"
    #include "createTime.H"

    if (isDir(runTime.path()/runTime.constant()/polyMesh::meshSubDir))
    {
        checkInFlow(runTime);
    }
    else
    {
        checkAlone(runTime);
    }
    Info<< "periCheck: nothing wrong was found; no step was taken" << nl
        << endl;
    return 0;
}


// ************************************************************************* //
