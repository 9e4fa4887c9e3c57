/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "timeLevel.H"
#include "ITstream.H"

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

//- The coefficient of CrankNicolson, which may be written as that of a ramp;
//  its full value then
scalar offCentring(ITstream& scheme)
{
    scalar psi = 1;
    while (scheme.nRemainingTokens() > 0)
    {
        const token t(scheme);
        if (t.isNumber())
        {
            psi = t.number();
        }
    }
    return min(max(psi, scalar(0)), scalar(1));
}

} // End anonymous namespace


// * * * * * * * * * * * * * * * Global Functions  * * * * * * * * * * * * * //

Foam::scalar Foam::periFoam::forceLevel
(
    const fvMesh& mesh,
    const word& derivative,
    const label timeIndex
)
{
    if (timeIndex < 2)
    {
        return 0.5;
    }
    ITstream& scheme = mesh.ddtScheme(derivative);
    scheme.rewind();
    const word name(scheme);
    scalar level = 0.5;
    if (name == "backward")
    {
        level = 1;
    }
    else if (name == "CrankNicolson")
    {
        const scalar psi = offCentring(scheme);
        level = 0.5 + psi/(1 + psi);
    }
    scheme.rewind();
    return level;
}


// ************************************************************************* //
