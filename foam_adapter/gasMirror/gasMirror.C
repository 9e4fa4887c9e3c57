/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "gasMirror.H"
#include "basicThermo.H"
#include "coupledFaces.H"
#include "fvMesh.H"
#include "syncTools.H"

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

//- Layers that mirror; what lies deeper
constexpr label layers = 3, deep = layers + 1;

template<class GeoField>
GeoField& changeable(const fvMesh& mesh, const word& name)
{
    return const_cast<GeoField&>(mesh.lookupObject<GeoField>(name));
}

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoam::gasMirror::findLayers(const scalarField& cover)
{
    const labelList& owner = mesh_.faceOwner();
    const labelList& neighbour = mesh_.faceNeighbour();
    DynamicList<label> cells;
    forAll(cover, celli)
    {
        layer_[celli] = cover[celli] >= 0.5 ? deep : 0;
        if (layer_[celli])
        {
            cells.append(celli);
        }
    }
    covered_.transfer(cells);
    for (label next = 1; next <= layers; ++next)
    {
        labelList beyond;
        syncTools::swapBoundaryCellList(mesh_, layer_, beyond);
        forAll(neighbour, facei)
        {
            const label P = owner[facei], N = neighbour[facei];
            if (layer_[P] == next - 1 && layer_[N] == deep)
            {
                layer_[N] = next;
            }
            else if (layer_[N] == next - 1 && layer_[P] == deep)
            {
                layer_[P] = next;
            }
        }
        forEachCoupledFace
        (
            mesh_,
            [&](label, const label P, const label b)
            {
                if (beyond[b] == next - 1 && layer_[P] == deep)
                {
                    layer_[P] = next;
                }
            }
        );
    }
}


void Foam::periFoam::gasMirror::image
(
    const label layer,
    const vectorField& wall
)
{
    const label n = mesh_.nCells();
    scalarField area(n, Zero), p(n, Zero), T(n, Zero);
    vectorField U(n, Zero), normal(n, Zero);
    const vectorField& Sf = mesh_.faceAreas();

    // What a cell of the layer sees of one outside, over a face that points to
    // it with this sign
    const auto see = [&]
    (
        const label celli,
        const vector& S,
        const scalar pOut,
        const scalar TOut,
        const vector& UOut
    )
    {
        const scalar a = mag(S);
        area[celli] += a;
        p[celli] += a*pOut;
        T[celli] += a*TOut;
        U[celli] += a*UOut;
        normal[celli] += S;
    };
    const labelList& owner = mesh_.faceOwner();
    const labelList& neighbour = mesh_.faceNeighbour();
    forAll(neighbour, facei)
    {
        const label P = owner[facei], N = neighbour[facei];
        if (layer_[P] == layer && layer_[N] == layer - 1)
        {
            see(P, Sf[facei], p_[N], T_[N], U_[N]);
        }
        else if (layer_[N] == layer && layer_[P] == layer - 1)
        {
            see(N, -Sf[facei], p_[P], T_[P], U_[P]);
        }
    }
    labelList layerOut;
    scalarField pOut, TOut;
    vectorField UOut;
    syncTools::swapBoundaryCellList(mesh_, layer_, layerOut);
    syncTools::swapBoundaryCellList(mesh_, p_.primitiveField(), pOut);
    syncTools::swapBoundaryCellList(mesh_, T_.primitiveField(), TOut);
    syncTools::swapBoundaryCellList(mesh_, U_.primitiveField(), UOut);
    forEachCoupledFace
    (
        mesh_,
        [&](const label facei, const label P, const label b)
        {
            if (layer_[P] == layer && layerOut[b] == layer - 1)
            {
                see(P, Sf[facei], pOut[b], TOut[b], UOut[b]);
            }
        }
    );
    for (const label celli : covered_)
    {
        if (layer_[celli] != layer)
        {
            continue;
        }
        p_[celli] = p[celli]/area[celli];
        T_[celli] = T[celli]/area[celli];
        U_[celli] = U[celli]/area[celli];
        if (layer > 1)
        {
            continue; // images of images are as they are
        }
        const vector w(wall[celli]);
        const vector n(normal[celli]/max(mag(normal[celli]), VSMALL));
        U_[celli] =
            slip_
          ? U_[celli] - 2*n*(n & (U_[celli] - w))
          : 2*w - U_[celli];
        if (temperature_ > 0)
        {
            T_[celli] = max(2*temperature_ - T_[celli], 0.5*temperature_);
        }
    }
}


void Foam::periFoam::gasMirror::agree()
{
    basicThermo& thermo = const_cast<basicThermo&>
    (
        mesh_.lookupObject<basicThermo>(basicThermo::dictName)
    );
    const scalarField pNew(p_.primitiveField(), covered_);
    const scalarField TNew(T_.primitiveField(), covered_);
    const scalarField eNew(thermo.he(pNew, TNew, covered_));
    volScalarField& e = thermo.he();
    forAll(covered_, i)
    {
        e[covered_[i]] = eNew[i];
    }
    U_.correctBoundaryConditions();
    p_.correctBoundaryConditions();
    e.correctBoundaryConditions();
    thermo.correct();
    const volScalarField& psi =
        mesh_.lookupObject<volScalarField>("thermo:psi");
    given_.resize(covered_.size());
    forAll(covered_, i)
    {
        const label celli = covered_[i];
        rho_[celli] = psi[celli]*p_[celli];
        rhoU_[celli] = rho_[celli]*U_[celli];
        rhoE_[celli] = rho_[celli]*(e[celli] + 0.5*magSqr(U_[celli]));
        given_[i] = rhoU_[celli];
    }
    rho_.boundaryFieldRef() == psi.boundaryField()*p_.boundaryField();
    rhoU_.boundaryFieldRef() == rho_.boundaryField()*U_.boundaryField();
    rhoE_.boundaryFieldRef() ==
        rho_.boundaryField()
       *(e.boundaryField() + 0.5*magSqr(U_.boundaryField()));
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

bool Foam::periFoam::gasMirror::needed(const fvMesh& mesh)
{
    return
        mesh.foundObject<volVectorField>("rhoU")
     && mesh.foundObject<volScalarField>("rhoE");
}


Foam::periFoam::gasMirror::gasMirror
(
    const fvMesh& mesh,
    const bool slip,
    const scalar temperature
)
:
    mesh_(mesh),
    slip_(slip),
    temperature_(temperature),
    rho_(changeable<volScalarField>(mesh, "rho")),
    rhoU_(changeable<volVectorField>(mesh, "rhoU")),
    rhoE_(changeable<volScalarField>(mesh, "rhoE")),
    U_(changeable<volVectorField>(mesh, "U")),
    p_(changeable<volScalarField>(mesh, "p")),
    T_(changeable<volScalarField>(mesh, "T")),
    layer_(mesh.nCells(), Zero)
{}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

void Foam::periFoam::gasMirror::reflect
(
    const scalarField& cover,
    const vectorField& wall
)
{
    findLayers(cover);
    for (label layer = 1; layer <= layers; ++layer)
    {
        image(layer, wall);
    }
    for (const label celli : covered_)
    {
        if (layer_[celli] == deep)
        {
            U_[celli] = wall[celli];
        }
    }
    agree();
}


Foam::vectorField Foam::periFoam::gasMirror::impulses() const
{
    vectorField J(mesh_.nCells(), Zero);
    forAll(covered_, i)
    {
        const label celli = covered_[i];
        J[celli] = mesh_.V()[celli]*(rhoU_[celli] - given_[i]);
    }
    return J;
}


// ************************************************************************* //
