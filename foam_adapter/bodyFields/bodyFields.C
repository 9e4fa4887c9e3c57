/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "bodyFields.H"
#include "IOField.H"
#include "passiveParticleCloud.H"

#include <cstring>

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

//- Gives every field of a body, in the order of its points
template<class Writer>
void forEachField(const periFoam::solidBody& body, const Writer& write)
{
    const label n = body.view().n_owned;
    vectorField displacement(n), U(n);
    scalarField J(n), held(n);
    for (label p = 0; p < n; ++p)
    {
        displacement[p] = body.position(p) - body.reference(p);
        U[p] = body.velocity(p);
        J[p] = body.view().J[p];
        held[p] = p >= body.nMoving();
    }
    write("displacement", dimLength, displacement);
    write("U", dimVelocity, U);
    write("J", dimless, J);
    write("damage", dimless, body.damage());
    write("held", dimless, held);
    if (body.hasStress())
    {
        symmTensorField sigma;
        scalarField plasticStrain;
        body.stress(sigma, plasticStrain);
        write("sigma", dimPressure, sigma);
        const scalarField sigmaEq(Foam::sqrt(1.5)*mag(dev(sigma)));
        write("sigmaEq", dimPressure, sigmaEq);
        if (body.isPlastic())
        {
            write("plasticStrain", dimless, plasticStrain);
        }
    }
}


//- Writes fields of points beside a cloud, by the ranks that write the points
class cloudWriter
{
    const polyMesh& mesh_;
    const periFoam::solidBody& body_;

    //- Where the points are, or nullptr: where they are computed
    const periFoam::hosting* hosts_;

    template<class Type>
    void writeHosted(const word& name, const Field<Type>& values) const
    {
        if (!hosts_)
        {
            IOField<Type>(io(name), values).write();
            return;
        }
        const Field<Type> hosted(hosts_->toHosts(values));

        // No files of clouds without points, as OpenFOAM has it
        IOField<Type>(io(name), hosted).write(hosted.size() > 0);
    }

public:

    cloudWriter
    (
        const polyMesh& mesh,
        const periFoam::solidBody& body,
        const periFoam::hosting* hosts
    )
    :
        mesh_(mesh),
        body_(body),
        hosts_(hosts)
    {}

    IOobject io(const word& name) const
    {
        return IOobject
        (
            name,
            mesh_.time().timeName(),
            cloud::prefix/body_.name(),
            mesh_,
            IOobject::NO_READ,
            IOobject::NO_WRITE,
            false
        );
    }

    template<class Type>
    void operator()
    (
        const word& name,
        const dimensionSet&,
        const Field<Type>& values
    ) const
    {
        writeHosted(name, values);
    }

    //- Tensors are left to the cells
    void operator()
    (
        const word&,
        const dimensionSet&,
        const symmTensorField&
    ) const
    {}

    void writeAll() const
    {
        forEachField(body_, *this);
        labelField cell(body_.view().n_owned);
        forAll(cell, p)
        {
            cell[p] = body_.view().id[p];
        }
        writeHosted("cell", cell);
    }
};


//- Writes fields of points on the cells that they are the centres of
class cellWriter
{
    const fvMesh& mesh_;
    const periFoam::solidBody& body_;

public:

    cellWriter(const fvMesh& mesh, const periFoam::solidBody& body)
    :
        mesh_(mesh),
        body_(body)
    {}

    template<class Type>
    void operator()
    (
        const word& name,
        const dimensionSet& dimensions,
        const Field<Type>& values
    ) const
    {
        Field<Type> ofCells(mesh_.nCells());
        forAll(values, p)
        {
            ofCells[body_.view().given[p]] = values[p];
        }
        periFoam::writeCellField(mesh_, name, dimensions, ofCells);
    }
};


//- The positions of a cloud whose points may have left the mesh, where
//  OpenFOAM's particles cannot follow: each belongs to the cell that it is of
class bodyPositions
:
    public regIOobject
{
    const periFoam::solidBody& body_;

public:

    bodyPositions(const IOobject& io, const periFoam::solidBody& body)
    :
        regIOobject(io),
        body_(body)
    {}

    virtual const word& type() const
    {
        static const word name("Cloud<passiveParticle>");
        return name;
    }

    virtual bool writeData(Ostream& os) const
    {
        const label n = body_.view().n_owned;
        os << n << nl << token::BEGIN_LIST << nl;
        for (label p = 0; p < n; ++p)
        {
            writeOne(os, body_.position(p), body_.view().given[p]);
            os << nl;
        }
        os << token::END_LIST << endl;
        return os.good();
    }

    static void writeOne(Ostream& os, const point& x, const label celli)
    {
        if (os.format() == IOstream::ASCII)
        {
            os << x << token::SPACE << celli;
            return;
        }
        // As particle::writePosition: the two in one run of bytes
        char bytes[sizeof(point) + sizeof(label)];
        std::memcpy(bytes, &x, sizeof(point));
        std::memcpy(bytes + sizeof(point), &celli, sizeof(label));
        os.write(bytes, sizeof(bytes));
    }
};

} // End anonymous namespace


// * * * * * * * * * * * * * * * Global Functions  * * * * * * * * * * * * * //

void Foam::periFoam::writePointCloud
(
    const fvMesh& fluid,
    const transfer& places,
    const solidBody& body
)
{
    passiveParticleCloud cloud
    (
        fluid, body.name(), IDLList<passiveParticle>()
    );
    pointField x(body.view().n_owned);
    forAll(x, p)
    {
        x[p] = body.position(p);
    }
    autoPtr<hosting> hosts(places.newHosting());
    hosts->locate(x);
    // Points keep their numbers (origId), however often they are written;
    // other clouds of the run count on
    const label others = particle::particleCount_;
    particle::particleCount_ = 0;
    forAll(hosts->place(), i)
    {
        cloud.addParticle
        (
            new passiveParticle(fluid, hosts->place()[i], hosts->cell()[i])
        );
    }
    particle::particleCount_ = others;
    cloud.write();
    cloudWriter(fluid, body, hosts.get()).writeAll();
}


void Foam::periFoam::writeRegion(const fvMesh& region, const solidBody& body)
{
    forEachField(body, cellWriter(region, body));
    const cloudWriter cloud(region, body, nullptr);
    bodyPositions(cloud.io("positions"), body).write();
    cloud.writeAll();
}


// ************************************************************************* //
