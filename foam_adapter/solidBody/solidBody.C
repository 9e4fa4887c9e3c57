/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "solidBody.H"
#include "OSspecific.H"
#include "regionSplit.H"
#include "Time.H"

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

//- Extent of a mesh along the axes that it leaves out
scalar depthOf(const polyMesh& mesh)
{
    scalar depth = 1;
    for (direction d = 0; d < 3; ++d)
    {
        if (mesh.geometricD()[d] < 0)
        {
            depth *= mesh.bounds().span()[d];
        }
    }
    return depth;
}

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoam::solidBody::orient(const polyMesh& solid)
{
    if (solid.nCells() == 0)
    {
        dict_.refuse
        (
            "horizonRatio", "the mesh of region " + name_ + " is empty"
        );
    }
    const polyMesh& around = fluid_ ? *fluid_ : solid;
    DynamicList<label> solved(3);
    for (direction d = 0; d < 3; ++d)
    {
        if ((solid.geometricD()[d] < 0) != (around.geometricD()[d] < 0))
        {
            dict_.refuse
            (
                "formulation",
                "region " + name_ + " is a mesh of "
              + Foam::name(solid.nGeometricD()) + " dimensions; allowed: the "
              + "directions of the fluid mesh, which has "
              + Foam::name(around.nGeometricD())
            );
        }
        if (solid.geometricD()[d] > 0)
        {
            solved.append(d);
        }
    }
    if (fluid_ && solved.size() < 2)
    {
        dict_.refuse
        (
            "formulation", "a fluid mesh of one dimension; allowed: two, three"
        );
    }
    directions_ = solved;
    middle_ = around.bounds().midpoint();
    depth_ = depthOf(around);
}


void Foam::periFoam::solidBody::createBody
(
    const polyMesh& solid,
    const pd_body_options& o,
    const List<unsigned char>& held
)
{
    const label n = solid.nCells();
    scalarList X(3*n, Zero), volume(solid.cellVolumes());
    const scalar depth = depthOf(solid);
    for (label p = 0; p < n; ++p)
    {
        forAll(directions_, a)
        {
            X[3*p + a] = solid.cellCentres()[p][directions_[a]];
        }
        volume[p] /= depth;
    }
    const pd_status status = pd_body_create
    (
        MPI_COMM_NULL, &o, n, X.cdata(), volume.cdata(), held.cdata(), &body_
    );
    if (status.code != PD_OK)
    {
        OStringStream os;
        os << status.message;
        if (status.point >= 0)
        {
            os << " (cell " << label(status.point) << " of region "
                << name_.c_str() << " at "
                << solid.cellCentres()[status.point] << ")";
        }
        dict_.refuse("horizonRatio", os.str());
    }
    view_ = pd_body_fields(body_);
}


void Foam::periFoam::solidBody::checkConnected(const polyMesh& solid) const
{
    // What a hold connects, bonds need not: held pieces count as one
    labelList piece;
    const label n = pieces(piece);
    boolList held(n, false);
    for (label p = view_.n_moving; p < view_.n_active; ++p)
    {
        held[piece[p]] = true;
    }
    const label nHeld = findIndices(held, true).size();
    const label nPieces = n - nHeld + (nHeld > 0);
    const label nRegions = regionSplit(solid).nRegions();
    if (nPieces > nRegions)
    {
        dict_.refuse
        (
            "horizonRatio",
            "bonds connect the points into " + Foam::name(nPieces)
          + " pieces; allowed: a horizon that connects what the mesh of region "
          + name_ + " connects, " + Foam::name(nRegions) + " pieces"
        );
    }
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::solidBody::solidBody
(
    const word& name,
    const checkedDictionary& dict,
    const polyMesh& solid,
    const fvMesh* fluid,
    const scalar rhoInf
)
:
    name_(name),
    dict_(dict),
    fluid_(fluid),
    middle_(Zero),
    depth_(1),
    body_(nullptr),
    view_{},
    loaded_(false)
{
    orient(solid);
    const pd_body_options o(options(rhoInf));

    List<unsigned char> held(solid.nCells(), (unsigned char)(0));
    readHolds(solid, held);
    createBody(solid, o, held);

    labelList pointOfCell(solid.nCells());
    for (label p = 0; p < view_.n_owned; ++p)
    {
        pointOfCell[view_.id[p]] = p;
    }
    placeTethers(pointOfCell, held);
    readLoads(solid, pointOfCell);
    readMotions(solid, pointOfCell);
    readVelocities(solid, pointOfCell);
    checkConnected(solid);
    readProtected(solid);
    readPreCracks();
    dict_.finish();
    keep();
}


// * * * * * * * * * * * * * * * * Destructor  * * * * * * * * * * * * * * * //

Foam::periFoam::solidBody::~solidBody()
{
    pd_body_destroy(body_);
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::point Foam::periFoam::solidBody::position(const label p) const
{
    point x(middle_);
    forAll(directions_, a)
    {
        x[directions_[a]] = view_.y[p*view_.dimension + a];
    }
    return x;
}


Foam::point Foam::periFoam::solidBody::reference(const label p) const
{
    point X(middle_);
    forAll(directions_, a)
    {
        X[directions_[a]] = view_.X[p*view_.dimension + a];
    }
    return X;
}


Foam::vector Foam::periFoam::solidBody::velocity(const label p) const
{
    vector v(Zero);
    forAll(directions_, a)
    {
        v[directions_[a]] = view_.v[p*view_.dimension + a];
    }
    return v;
}


Foam::labelList Foam::periFoam::solidBody::nearest(const point& X) const
{
    point inside(middle_);
    for (const label a : directions_)
    {
        inside[a] = X[a];
    }
    scalar least = GREAT;
    for (label p = 0; p < view_.n_owned; ++p)
    {
        least = min(least, mag(reference(p) - inside));
    }
    DynamicList<label> points;
    for (label p = 0; p < view_.n_owned; ++p)
    {
        if (mag(reference(p) - inside) <= least + 1e-6*view_.spacing[p])
        {
            points.append(p);
        }
    }
    return labelList(std::move(points));
}


Foam::periFoam::solidBody::state Foam::periFoam::solidBody::probe
(
    const point& X,
    const labelList& nearest
) const
{
    const label d = view_.dimension;
    const scalarField phi(damage());
    symmTensorField sigma;
    scalarField plasticStrain;
    stress(sigma, plasticStrain);

    state mean{Zero, Zero, 0, 0, Zero, 0};
    const scalar share = 1.0/nearest.size();
    for (const label p : nearest)
    {
        vector displacement(position(p) - reference(p));
        for (label r = 0; r < d; ++r)
        {
            for (label c = 0; c < d; ++c)
            {
                const label axis = directions_[c];
                displacement[directions_[r]] +=
                    (view_.F[(p*d + r)*d + c] - (r == c))
                   *(X[axis] - reference(p)[axis]);
            }
        }
        mean.displacement += share*displacement;
        mean.velocity += share*velocity(p);
        mean.J += share*view_.J[p];
        mean.damage += share*phi[p];
        mean.sigma += share*sigma[p];
        mean.plasticStrain += share*plasticStrain[p];
    }
    return mean;
}


Foam::scalarField Foam::periFoam::solidBody::damage() const
{
    scalarField phi(view_.n_owned);
    pd_body_damage(body_, phi.data());
    return phi;
}


void Foam::periFoam::solidBody::stress
(
    symmTensorField& sigma,
    scalarField& plasticStrain
) const
{
    sigma.resize(view_.n_owned);
    sigma = Zero;
    plasticStrain.resize(view_.n_owned);
    plasticStrain = 0;
    if (!hasStress())
    {
        return;
    }
    scalarList components(PD_SYMMETRIC*view_.n_owned);
    pd_body_stress(body_, components.data(), plasticStrain.data());

    // The library's axes: those that are solved for, then the others
    labelList axes(directions_);
    for (label a = 0; a < 3; ++a)
    {
        if (!directions_.found(a))
        {
            axes.append(a);
        }
    }
    const label pairs[PD_SYMMETRIC][2] =
        {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
    const label ofPair[3][3] =
    {
        {symmTensor::XX, symmTensor::XY, symmTensor::XZ},
        {symmTensor::XY, symmTensor::YY, symmTensor::YZ},
        {symmTensor::XZ, symmTensor::YZ, symmTensor::ZZ}
    };
    forAll(sigma, p)
    {
        for (label k = 0; k < PD_SYMMETRIC; ++k)
        {
            sigma[p][ofPair[axes[pairs[k][0]]][axes[pairs[k][1]]]] =
                components[PD_SYMMETRIC*p + k];
        }
    }
}


Foam::label Foam::periFoam::solidBody::pieces(labelList& piece) const
{
    piece.resize(view_.n_owned);
    return pd_body_pieces(body_, piece.data());
}


Foam::scalar Foam::periFoam::solidBody::springStep(const scalar rho) const
{
    // Midpoint rule for an oscillator, omega^2 = k/rho: stable below 2/omega;
    // a damped point, v' = -eta v/rho, taken explicitly: below 2 rho/eta. Half
    // of either, as for waves
    scalar step = GREAT;
    scalar eta = options().damping;
    for (const tether& t : tethers_)
    {
        step = min(step, Foam::sqrt(rho/t.stiffness));
        eta = max(eta, options().damping + t.damping);
    }
    return eta > 0 ? min(step, rho/eta) : step;
}


void Foam::periFoam::solidBody::toMidpoint
(
    const UList<vector>& v,
    const scalar deltaT
)
{
    const label d = view_.dimension;
    for (label p = 0; p < view_.n_moving; ++p)
    {
        for (label a = 0; a < d; ++a)
        {
            view_.y[p*d + a] = start_[p*d + a] + deltaT/2*v[p][directions_[a]];
        }
    }
}


void Foam::periFoam::solidBody::toEnd
(
    const UList<vector>& v,
    const scalar deltaT
)
{
    toMidpoint(v, 2*deltaT);
    std::copy(view_.y, view_.y + start_.size(), start_.begin());
}


void Foam::periFoam::solidBody::setVelocity(const UList<vector>& v)
{
    const label d = view_.dimension;
    for (label p = 0; p < view_.n_moving; ++p)
    {
        for (label a = 0; a < d; ++a)
        {
            view_.v[p*d + a] = v[p][directions_[a]];
        }
    }
}


pd_status Foam::periFoam::solidBody::setLoads(const scalar time)
{
    bool changes = !loaded_;
    for (const load& l : loads_)
    {
        changes = changes || l.ramp.valid();
    }
    if (loads_.empty() || !changes)
    {
        return pd_status{};
    }
    loaded_ = true;
    const label d = view_.dimension;
    scalarList b(view_.n_owned*d, Zero);
    for (const load& l : loads_)
    {
        const scalar factor = l.ramp.valid() ? l.ramp->value(time) : 1;
        forAll(l.density, p)
        {
            for (label a = 0; a < d; ++a)
            {
                b[p*d + a] += factor*l.density[p][directions_[a]];
            }
        }
    }
    return pd_body_load(body_, b.cdata());
}


pd_status Foam::periFoam::solidBody::forces(UList<vector>& force)
{
    const pd_status status = pd_body_forces(body_);
    const label d = view_.dimension;
    for (label p = 0; p < view_.n_moving; ++p)
    {
        force[p] = vector::zero;
        for (label a = 0; a < d; ++a)
        {
            force[p][directions_[a]] = volume(p)*view_.force[p*d + a];
        }
    }
    for (const tether& t : tethers_)
    {
        for (const label p : t.points)
        {
            force[p] -= volume(p)
               *(
                    t.stiffness*(position(p) - reference(p))
                  + t.damping*velocity(p)
                );
        }
    }
    return status;
}


// ************************************************************************* //
