/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "solidBody.H"
#include "labelIOList.H"
#include "OSspecific.H"
#include "regionSplit.H"
#include "sigFpe.H"
#include "Time.H"
#include "transfer.H"

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

//- Numbers that the cells of this rank had before the mesh was decomposed; none
//  where it was not, or where what decomposed it did not tell
List<pd_global> numbers(const polyMesh& mesh)
{
    if (!Pstream::parRun())
    {
        return List<pd_global>();
    }
    const labelIOList addressing
    (
        IOobject
        (
            "cellProcAddressing",
            mesh.facesInstance(),
            polyMesh::meshSubDir,
            mesh,
            IOobject::READ_IF_PRESENT,
            IOobject::NO_WRITE,
            false
        )
    );
    const bool told = addressing.size() == mesh.nCells();
    List<pd_global> number;
    if (returnReduce(told, andOp<bool>()))
    {
        number.resize(mesh.nCells() + 1); // an empty list would be none
        forAll(addressing, celli)
        {
            number[celli] = addressing[celli];
        }
    }
    return number;
}

void addPiece
(
    periFoam::solidBody::piece& sum,
    const periFoam::solidBody::piece& other
)
{
    for (label k = 0; k < 4; ++k)
    {
        sum[k] += other[k];
    }
    sum[4] = max(sum[4], other[4]);
}

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoam::solidBody::orient(const polyMesh& solid)
{
    if (returnReduce(solid.nCells(), sumOp<label>()) == 0)
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
    const List<pd_global> number(numbers(solid));
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
        Pstream::parRun() ? MPI_COMM_WORLD : MPI_COMM_NULL,
        &o, n, X.cdata(), volume.cdata(), held.cdata(),
        number.size() ? number.cdata() : nullptr,
        &body_
    );
    if (status.code != PD_OK)
    {
        OStringStream os;
        os << status.message;
        if (status.point >= 0)
        {
            os << " (cell " << label(status.point) << " of region "
                << name_.c_str();
            if (!Pstream::parRun())
            {
                os << " at " << solid.cellCentres()[status.point];
            }
            os << ")";
        }
        dict_.refuse("horizonRatio", os.str());
    }
    view_ = pd_body_fields(body_);
    nAllPoints_ = returnReduce(label(view_.n_owned), sumOp<label>());
    nAllMoving_ = returnReduce(label(view_.n_moving), sumOp<label>());
}


void Foam::periFoam::solidBody::checkConnected(const polyMesh& solid) const
{
    // What a hold connects, bonds need not: held pieces count as one
    pd_global nHeld = 0;
    const pd_global n = pd_body_pieces(body_, nullptr, &nHeld);
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
    nAllPoints_(0),
    nAllMoving_(0),
    loaded_(false),
    alone_(!fluid),
    coeffs_{Zero, Zero, 0},
    dragging_(0)
{
    orient(solid);
    const pd_body_options o(options(rhoInf));

    List<unsigned char> held(solid.nCells(), static_cast<unsigned char>(0));
    readHolds(solid, held);
    createBody(solid, o, held);

    labelList pointOfCell(solid.nCells());
    for (label p = 0; p < view_.n_owned; ++p)
    {
        pointOfCell[view_.given[p]] = p;
    }
    placeTethers(pointOfCell, held);
    readLoads(solid, pointOfCell);
    readMotions(solid, pointOfCell);
    readVelocities(solid, pointOfCell);
    checkConnected(solid);
    readProtected(solid);
    readPreCracks();
    readForceCoeffs(rhoInf);
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


Foam::point Foam::periFoam::solidBody::solved(const point& X) const
{
    point inside(middle_);
    for (const label a : directions_)
    {
        inside[a] = X[a];
    }
    return inside;
}


bool Foam::periFoam::solidBody::reaches(const point& X) const
{
    const point inside(solved(X));
    bool near = false;
    for (label p = 0; p < view_.n_owned && !near; ++p)
    {
        near =
            mag(reference(p) - inside)
         <= options().horizon_ratio*view_.spacing[p];
    }
    return returnReduce(near, orOp<bool>());
}


Foam::labelList Foam::periFoam::solidBody::nearest(const point& X) const
{
    const point inside(solved(X));
    scalar least = GREAT;
    for (label p = 0; p < view_.n_owned; ++p)
    {
        least = min(least, mag(reference(p) - inside));
    }
    reduce(least, minOp<scalar>());
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
    const scalar share =
        1.0/returnReduce(nearest.size(), sumOp<label>());
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
    reduce(mean.displacement, sumOp<vector>());
    reduce(mean.velocity, sumOp<vector>());
    reduce(mean.J, sumOp<scalar>());
    reduce(mean.damage, sumOp<scalar>());
    reduce(mean.sigma, sumOp<symmTensor>());
    reduce(mean.plasticStrain, sumOp<scalar>());
    return mean;
}


void Foam::periFoam::solidBody::heldOver
(
    transfer& places,
    labelList& cells,
    scalarField& volumes
) const
{
    DynamicList<point> place;
    DynamicList<scalar> volumeAt;
    for (label p = view_.n_moving; p < view_.n_owned; ++p)
    {
        place.append(reference(p));
        volumeAt.append(volume(p));
    }
    cells.clear();
    volumes.clear();
    if (returnReduce(place.empty(), andOp<bool>()))
    {
        return;
    }
    scalarField ofCells;
    places.spreadAmount(place, volumeAt, ofCells);
    DynamicList<label> covered;
    forAll(ofCells, celli)
    {
        if (ofCells[celli] > 0)
        {
            covered.append(celli);
        }
    }
    volumes = scalarField(ofCells, covered);
    cells.transfer(covered);
}


Foam::point Foam::periFoam::solidBody::centre() const
{
    scalar volumes = 0;
    vector moment(Zero);
    for (label p = 0; p < view_.n_owned; ++p)
    {
        volumes += volume(p);
        moment += volume(p)*position(p);
    }
    reduce(volumes, sumOp<scalar>());
    reduce(moment, sumOp<vector>());
    return moment/volumes;
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


Foam::Map<Foam::periFoam::solidBody::piece>
Foam::periFoam::solidBody::pieces() const
{
    List<pd_global> name(view_.n_owned + 1);
    if (pd_body_pieces(body_, name.data(), nullptr) < 0)
    {
        FatalErrorInFunction
            << "no memory for the pieces of " << name_ << exit(FatalError);
    }
    Map<piece> all;
    for (label p = 0; p < view_.n_active; ++p)
    {
        piece& here = all(label(name[p]), piece(0.0));
        if (p < view_.n_moving)
        {
            const vector moment(volume(p)*position(p));
            addPiece(here, {volume(p), moment.x(), moment.y(), moment.z(), 0});
        }
        else
        {
            here[4] = 1;
        }
    }
    for (const label p : prescribedPoint_)
    {
        all[label(name[p])][4] = 1;
    }
    Pstream::mapCombineGather(all, addPiece);
    Pstream::mapCombineScatter(all);
    return all;
}


void Foam::periFoam::solidBody::writePicture
(
    const fileName& folder,
    const scalar time,
    const wordList& fields,
    const bool single
) const
{
    List<const char*> names(fields.size() + 1, nullptr);
    forAll(fields, i)
    {
        names[i] = fields[i].c_str();
    }
    pd_picture picture{};
    picture.time = time;
    picture.n_own = fields.size();
    picture.own = names.cdata();
    picture.single = single;
    for (label a = 0; a < 3; ++a)
    {
        const bool solved = a < directions_.size();
        picture.axes[a] = solved ? directions_[a] : 0;
        if (!directions_.found(a))
        {
            picture.origin[a] = middle_[a];
        }
    }
    for (label a = directions_.size(), axis = 0; a < 3; ++axis)
    {
        if (!directions_.found(axis))
        {
            picture.axes[a++] = axis;
        }
    }
    const pd_status status = pd_body_write_picture
    (
        body_, folder.c_str(), name_.c_str(), &picture
    );
    if (status.code != PD_OK)
    {
        FatalErrorInFunction
            << "the body " << name_ << " could not be written: "
            << status.message << exit(FatalError);
    }
}


void Foam::periFoam::solidBody::keepState(const fileName& folder, notes all)
{
    for (const motion& m : motions_)
    {
        m.keep(all);
    }
    const pd_status status = pd_checkpoint_save
    (
        body_, (folder/(name_ + ".h5")).c_str(), all.size(), all.data()
    );
    if (status.code != PD_OK)
    {
        FatalErrorInFunction
            << "the state of body " << name_ << " could not be kept: "
            << status.message << nl
            << "    Earlier ones are as they were; periResume finds the last"
            << exit(FatalError);
    }
}


void Foam::periFoam::solidBody::resume(const fileName& folder, notes& all)
{
    label next = all.size();
    for (const motion& m : motions_)
    {
        m.expect(all);
    }
    const pd_status status = pd_checkpoint_load
    (
        body_, (folder/(name_ + ".h5")).c_str(), all.size(), all.data()
    );
    if (status.code != PD_OK)
    {
        FatalIOErrorInFunction(dict_.dict())
            << "the body " << name_ << " cannot continue: " << status.message
            << exit(FatalIOError);
    }
    for (motion& m : motions_)
    {
        m.resume(all, next);
    }
    keep();
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


void Foam::periFoam::solidBody::moveBy
(
    const UList<vector>& v,
    const scalar deltaT,
    const scalar time
)
{
    const label d = view_.dimension;
    for (label p = 0; p < view_.n_moving; ++p)
    {
        for (label a = 0; a < d; ++a)
        {
            view_.y[p*d + a] = start_[p*d + a] + deltaT*v[p][directions_[a]];
        }
    }
    placeMotions(time);
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
    const sigFpe::ignore untrapped; // a ramp beyond all numbers is refused below
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
    setPulls(force);
    return status;
}


pd_status Foam::periFoam::solidBody::advance
(
    const UList<vector>& v,
    const scalar deltaT
)
{
    if (!hasHistory())
    {
        return pd_status{};
    }
    setVelocity(v);
    return pd_body_advance(body_, deltaT, 0);
}


// ************************************************************************* //
