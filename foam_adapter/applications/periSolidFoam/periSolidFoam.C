/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

Application
    periSolidFoam

Description
    Moves the bodies of constant/peridynamicsProperties without a fluid. Reads
    and writes what the function object peridynamics does in a flow; see
    docs/dictionary.md.

\*---------------------------------------------------------------------------*/

#include "argList.H"
#include "solidRun.H"
#include "Time.H"

using namespace Foam;

// * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * //

int main(int argc, char* argv[])
{
    argList::addNote
    (
        "Moves the bodies of constant/peridynamicsProperties without a fluid"
    );

    #include "setRootCase.H"
    #include "createTime.H"

    periFoam::solidRun run(runTime);

    while (runTime.run())
    {
        run.setDeltaT();
        ++runTime;
        run.step();
    }

    Info<< "End" << nl << endl;
    return 0;
}


// ************************************************************************* //
