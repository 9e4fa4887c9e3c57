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

const dimensionSet dimForceDensity(dimForce/dimVolume);

//- Span of a mesh along the axis that it leaves out; 1 in three dimensions
scalar depthOf(const polyMesh& mesh)
{
    for (direction d = 0; d < 3; ++d)
    {
        if (mesh.geometricD()[d] < 0)
        {
            return mesh.bounds().span()[d];
        }
    }
    return 1;
}

dimensionSet dimensionsOf(const char* unit)
{
    return string(unit) == "Pa" ? dimPressure : dimless;
}

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoam::solidBody::checkDimensions(const polyMesh& solid) const
{
    if (solid.nCells() == 0)
    {
        dict_.refuse("horizonRatio", "the mesh of region " + name_ + " is empty");
    }
    for (direction d = 0; d < 3; ++d)
    {
        if ((solid.geometricD()[d] < 0) != (fluid_.geometricD()[d] < 0))
        {
            dict_.refuse
            (
                "formulation",
                "region " + name_ + " is a mesh of "
              + Foam::name(solid.nGeometricD()) + " dimensions; allowed: the "
              + "directions of the fluid mesh, which has "
              + Foam::name(fluid_.nGeometricD())
            );
        }
    }
    if (directions_.size() < 2)
    {
        dict_.refuse
        (
            "formulation", "a fluid mesh of one dimension; allowed: two, three"
        );
    }
}


Foam::labelList Foam::periFoam::solidBody::cellsOf
(
    const checkedDictionary& dict,
    const polyMesh& solid
) const
{
    if (dict.found("patch"))
    {
        const word patch(dict.name("patch"));
        const label patchi = solid.boundaryMesh().findPatchID(patch);
        if (patchi < 0)
        {
            dict.choice("patch", solid.boundaryMesh().names());
        }
        labelList cells(solid.boundaryMesh()[patchi].faceCells());
        inplaceUniqueSort(cells);
        return cells;
    }
    const word zone(dict.name("cellZone"));
    const label zonei = solid.cellZones().findZoneID(zone);
    if (zonei < 0)
    {
        dict.choice("cellZone", solid.cellZones().names());
    }
    return solid.cellZones()[zonei];
}


pd_body_options Foam::periFoam::solidBody::options(const scalar rho) const
{
    pd_body_options o{};
    o.dimension = directions_.size();
    o.horizon_ratio = dict_.number
    (
        "horizonRatio", range::between(0, 20, false, true), dimless
    );
    o.density = dict_.numberOr(rho, "density", range::above(0), dimDensity);
    if (o.density != rho)
    {
        dict_.refuse
        (
            "density",
            "allowed: coupling.rhoInf, since this version gives a body the "
            "inertia of the fluid"
        );
    }
    o.damping = dict_.numberOr
    (
        0, "damping", range::atLeast(0), dimDensity/dimTime
    );

    DynamicList<word> names;
    for (const pd_formulation* const* f = pd_formulations; *f; ++f)
    {
        names.append((*f)->name);
    }
    o.formulation = pd_formulation_find
    (
        dict_.choice("formulation", names).c_str()
    );

    names.clear();
    for (const pd_material* const* m = pd_materials; *m; ++m)
    {
        names.append((*m)->name);
    }
    const checkedDictionary material(dict_.sub("material"));
    o.material = pd_material_find(material.choice("type", names).c_str());
    for (int k = 0; k < o.material->n_parameters; ++k)
    {
        const pd_parameter& p = o.material->parameters[k];
        o.parameters[k] = material.number
        (
            p.key,
            range::between
            (
                p.above, min(p.below, VGREAT), p.includes_above, false
            ),
            dimensionsOf(p.unit)
        );
    }
    material.finish();

    if (dict_.found("damage"))
    {
        const checkedDictionary damage(dict_.sub("damage"));
        damage.choiceOr
        (
            "criticalStretch", "criterion", wordList({"criticalStretch"})
        );
        o.critical_stretch =
            damage.number("criticalStretch", range::above(1), dimless);
        damage.finish();
    }
    return o;
}


void Foam::periFoam::solidBody::readHolds
(
    const polyMesh& solid,
    List<unsigned char>& held
)
{
    if (!dict_.found("holds"))
    {
        return;
    }
    const checkedDictionary holds(dict_.sub("holds"));
    for (const word& name : holds.subNames())
    {
        const checkedDictionary hold(holds.sub(name));
        const labelList cells(cellsOf(hold, solid));
        const word type
        (
            hold.choiceOr("implicit", "type", wordList({"implicit", "tether"}))
        );
        if (type == "implicit")
        {
            for (const label celli : cells)
            {
                held[celli] = 1;
            }
        }
        else
        {
            tethers_.append(new tether
            {
                cells,
                hold.number
                (
                    "stiffness",
                    range::above(0),
                    dimForceDensity/dimLength
                ),
                hold.numberOr
                (
                    0, "damping", range::atLeast(0), dimDensity/dimTime
                )
            });
        }
        hold.finish();
    }
}


void Foam::periFoam::solidBody::readLoads
(
    const polyMesh& solid,
    const labelList& pointOfCell
)
{
    if (!dict_.found("loads"))
    {
        return;
    }
    const checkedDictionary loads(dict_.sub("loads"));
    for (const word& name : loads.subNames())
    {
        const checkedDictionary dict(loads.sub(name));
        const word type
        (
            dict.choice("type", wordList({"traction", "bodyForce"}))
        );
        autoPtr<load> l(new load);
        l->density.resize(view_.n_owned, vector::zero);
        if (type == "traction")
        {
            const vector value(dict.vectorOf("value", dimPressure));
            const word patch
            (
                dict.choice("patch", solid.boundaryMesh().names())
            );
            const polyPatch& pp = solid.boundaryMesh()[patch];
            forAll(pp, i)
            {
                const label celli = pp.faceCells()[i];
                l->density[pointOfCell[celli]] +=
                    value*mag(pp.faceAreas()[i])/solid.cellVolumes()[celli];
            }
        }
        else
        {
            const vector value(dict.vectorOf("value", dimForceDensity));
            const labelList cells
            (
                dict.found("cellZone") || dict.found("patch")
              ? cellsOf(dict, solid)
              : identity(solid.nCells())
            );
            for (const label celli : cells)
            {
                l->density[pointOfCell[celli]] = value;
            }
        }
        dict.found("rampCoeffs");
        if (dict.found("ramp"))
        {
            l->ramp = Function1<scalar>::New("ramp", dict.dict());
        }
        dict.finish();
        loads_.append(l.release());
    }
}


void Foam::periFoam::solidBody::readPreCracks()
{
    if (!dict_.found("preCracks"))
    {
        return;
    }
    const checkedDictionary cracks(dict_.sub("preCracks"));
    for (const word& name : cracks.subNames())
    {
        const checkedDictionary dict(cracks.sub(name));
        const vector corner(dict.vectorOf("corner", dimLength));
        const vector edge1(dict.vectorOf("edge1", dimLength));
        const vector edge2
        (
            directions_.size() == 3
          ? dict.vectorOf("edge2", dimLength)
          : vector::zero
        );
        pd_rectangle r{};
        forAll(directions_, a)
        {
            r.corner[a] = corner[directions_[a]];
            r.edge1[a] = edge1[directions_[a]];
            r.edge2[a] = edge2[directions_[a]];
        }
        const pd_status status = pd_body_precrack(body_, &r);
        if (status.code != PD_OK)
        {
            dict.refuse("edge1", status.message);
        }
        dict.finish();
    }
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
    const fvMesh& fluid,
    const scalar rho
)
:
    name_(name),
    fluid_(fluid),
    dict_(dict),
    plane_(0),
    depth_(depthOf(fluid)),
    body_(nullptr),
    view_{}
{
    DynamicList<label> solved(3);
    for (direction d = 0; d < 3; ++d)
    {
        if (fluid.geometricD()[d] > 0)
        {
            solved.append(d);
        }
        else
        {
            plane_ = fluid.bounds().midpoint()[d];
        }
    }
    directions_ = solved;

    const Time& time = fluid.time();
    const fileName meshPath
    (
        time.path()/time.constant()/name/polyMesh::meshSubDir
    );
    for (const char* f : {"points", "faces", "owner", "neighbour", "boundary"})
    {
        if (!isFile(meshPath/f))
        {
            dict_.refuse
            (
                "formulation",
                "the body " + name + " has no mesh " + (meshPath/f)
              + "; allowed: a region mesh of that name (blockMesh -region "
              + name + ")"
            );
        }
    }
    const pd_body_options o(options(rho));
    const polyMesh solid
    (
        IOobject(name, time.constant(), time, IOobject::MUST_READ)
    );
    checkDimensions(solid);

    List<unsigned char> held(solid.nCells(), (unsigned char)(0));
    readHolds(solid, held);
    createBody(solid, o, held);

    labelList pointOfCell(solid.nCells());
    for (label p = 0; p < view_.n_owned; ++p)
    {
        pointOfCell[view_.id[p]] = p;
    }
    for (tether& t : tethers_)
    {
        // Cells that an implicit hold holds too are left to that
        DynamicList<label> points;
        for (const label celli : t.points)
        {
            if (!held[celli])
            {
                points.append(pointOfCell[celli]);
            }
        }
        t.points = points;
    }
    readLoads(solid, pointOfCell);
    checkConnected(solid);
    readPreCracks();
    dict_.finish();
    start_ = SubList<scalar>
    (
        UList<scalar>(view_.y, view_.n_owned*view_.dimension),
        view_.n_moving*view_.dimension
    );
}


// * * * * * * * * * * * * * * * * Destructor  * * * * * * * * * * * * * * * //

Foam::periFoam::solidBody::~solidBody()
{
    pd_body_destroy(body_);
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::point Foam::periFoam::solidBody::position(const label p) const
{
    point x(plane_, plane_, plane_);
    forAll(directions_, a)
    {
        x[directions_[a]] = view_.y[p*view_.dimension + a];
    }
    return x;
}


Foam::point Foam::periFoam::solidBody::reference(const label p) const
{
    point X(plane_, plane_, plane_);
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


void Foam::periFoam::solidBody::probe
(
    const point& X,
    vector& displacement,
    vector& velocity,
    scalar& J,
    scalar& damage
) const
{
    const label d = view_.dimension;
    point inPlane(X);
    if (d == 2)
    {
        inPlane[3 - directions_[0] - directions_[1]] = plane_;
    }
    scalar least = GREAT;
    for (label p = 0; p < view_.n_owned; ++p)
    {
        least = min(least, mag(reference(p) - inPlane));
    }

    const scalarField phi(this->damage());
    displacement = velocity = vector::zero;
    J = damage = 0;
    label count = 0;
    for (label p = 0; p < view_.n_owned; ++p)
    {
        const vector from(inPlane - reference(p));
        if (mag(from) > least + 1e-6*view_.spacing[p])
        {
            continue;
        }
        ++count;
        displacement += position(p) - reference(p);
        for (label r = 0; r < d; ++r)
        {
            for (label c = 0; c < d; ++c)
            {
                displacement[directions_[r]] +=
                    (view_.F[(p*d + r)*d + c] - (r == c))
                   *from[directions_[c]];
            }
        }
        velocity += this->velocity(p);
        J += view_.J[p];
        damage += phi[p];
    }
    displacement /= count;
    velocity /= count;
    J /= count;
    damage /= count;
}


Foam::scalarField Foam::periFoam::solidBody::damage() const
{
    scalarField phi(view_.n_owned);
    pd_body_damage(body_, phi.data());
    return phi;
}


Foam::label Foam::periFoam::solidBody::pieces(labelList& piece) const
{
    piece.resize(view_.n_owned);
    return pd_body_pieces(body_, piece.data());
}


Foam::scalar Foam::periFoam::solidBody::stableStep(const scalar rho) const
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


void Foam::periFoam::solidBody::toStart()
{
    std::copy(start_.begin(), start_.end(), view_.y);
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
    if (loads_.empty())
    {
        return pd_status{};
    }
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
