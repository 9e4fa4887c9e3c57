/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "pointCloud.H"
#include "IOField.H"
#include "passiveParticleCloud.H"

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

template<class Type>
void writeField
(
    const passiveParticleCloud& cloud,
    const word& name,
    const Field<Type>& values
)
{
    IOField<Type>
    (
        IOobject
        (
            name,
            cloud.time().timeName(),
            cloud,
            IOobject::NO_READ,
            IOobject::NO_WRITE,
            false
        ),
        values
    ).write();
}

} // End anonymous namespace


// * * * * * * * * * * * * * * * Global Functions  * * * * * * * * * * * * * //

void Foam::periFoam::writePointCloud
(
    const fvMesh& mesh,
    const transfer& places,
    const solidBody& body
)
{
    const label n = body.view().n_owned;
    passiveParticleCloud cloud
    (
        mesh, body.name(), IDLList<passiveParticle>()
    );
    vectorField displacement(n), U(n);
    scalarField J(n);
    labelField held(n), cell(n);
    label celli = 0;
    for (label p = 0; p < n; ++p)
    {
        const point x(body.position(p));
        celli = max(places.cellAt(x, celli), 0);
        cloud.addParticle(new passiveParticle(mesh, x, celli));
        displacement[p] = x - body.reference(p);
        U[p] = body.velocity(p);
        J[p] = body.view().J[p];
        held[p] = p >= body.nMoving();
        cell[p] = body.view().id[p];
    }
    cloud.write();
    writeField(cloud, "displacement", displacement);
    writeField(cloud, "U", U);
    writeField(cloud, "J", J);
    writeField(cloud, "damage", body.damage());
    writeField(cloud, "held", held);
    writeField(cloud, "cell", cell);
}


// ************************************************************************* //
