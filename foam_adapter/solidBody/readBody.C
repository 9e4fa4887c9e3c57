/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

Description
    What a body is made of, from its part of
    constant/peridynamicsProperties.

\*---------------------------------------------------------------------------*/

#include "solidBody.H"

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

const dimensionSet dimForceDensity(dimForce/dimVolume);

dimensionSet dimensionsOf(const string& unit)
{
    return
        unit == "Pa" ? dimPressure
      : unit == "m" ? dimLength
      : unit == "kg/m3" ? dimDensity
      : dimless;
}

//- A parameter that the library's tables name
scalar parameter
(
    const periFoam::checkedDictionary& dict,
    const pd_parameter& p
)
{
    if (p.kind == pd_parameter::PD_FLAG)
    {
        if (!p.optional)
        {
            dict.need(p.key, "yes or no");
        }
        return dict.flagOr(p.standard != 0, p.key);
    }
    const periFoam::range allowed
    (
        periFoam::range::between
        (
            max(p.above, -VGREAT), min(p.below, VGREAT), p.includes_above, false
        )
    );
    const dimensionSet dimensions(dimensionsOf(p.unit));
    const scalar value =
        p.optional
      ? dict.numberOr(p.standard, p.key, allowed, dimensions)
      : dict.number(p.key, allowed, dimensions);
    if (p.kind == pd_parameter::PD_INTEGER && value != std::floor(value))
    {
        dict.refuse(p.key, "allowed: an integer");
    }
    return value;
}

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

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


Foam::scalar
Foam::periFoam::solidBody::readDensity(const scalar rhoInf) const
{
    return
        rhoInf > 0
      ? dict_.numberOr(rhoInf, "density", range::above(0), dimDensity)
      : dict_.number("density", range::above(0), dimDensity);
}


pd_plane Foam::periFoam::solidBody::readPlane() const
{
    if (directions_.size() != 2 && dict_.found("plane"))
    {
        dict_.refuse("plane", "allowed: in bodies of two dimensions only");
    }
    const word plane
    (
        dict_.choiceOr
        (
            "planeStrain", "plane", wordList({"planeStrain", "planeStress"})
        )
    );
    return plane == "planeStress" ? PD_PLANE_STRESS : PD_PLANE_STRAIN;
}


void Foam::periFoam::solidBody::readFormulation(pd_body_options& o) const
{
    DynamicList<word> names;
    for (const pd_formulation* const* f = pd_formulations; *f; ++f)
    {
        names.append((*f)->name);
        // Those of a formulation that is not chosen are left alone
        dict_.found(word((*f)->name) + "Coeffs");
    }
    o.formulation = pd_formulation_find
    (
        dict_.choice("formulation", names).c_str()
    );
    if (o.dimension < o.formulation->least_dimension)
    {
        dict_.refuse
        (
            "formulation",
            "region " + name_ + " is a mesh of " + Foam::name(o.dimension)
          + " dimensions; allowed: at least "
          + Foam::name(o.formulation->least_dimension)
        );
    }
    readCoeffs(o);
}


void Foam::periFoam::solidBody::readCoeffs(pd_body_options& o) const
{
    const pd_formulation& f = *o.formulation;
    const word name(word(f.name) + "Coeffs");
    bool needed = dict_.found(name);
    for (int k = 0; k < f.n_parameters; ++k)
    {
        o.formulation_parameters[k] = f.parameters[k].standard;
        needed = needed || !f.parameters[k].optional;
    }
    if (!needed)
    {
        return;
    }
    const checkedDictionary dict(dict_.sub(name));
    for (int k = 0; k < f.n_parameters; ++k)
    {
        o.formulation_parameters[k] = parameter(dict, f.parameters[k]);
    }
    dict.finish();
}


void Foam::periFoam::solidBody::readMaterial(pd_body_options& o) const
{
    DynamicList<word> names;
    for (const pd_material* const* m = pd_materials; *m; ++m)
    {
        if (o.formulation->accepts(*m, o.dimension, o.plane))
        {
            names.append((*m)->name);
        }
    }
    if (names.empty())
    {
        dict_.refuse
        (
            o.plane == PD_PLANE_STRESS ? "plane" : "formulation",
            "no material works with " + word(o.formulation->name) + " there;"
            " allowed: another plane, or another formulation"
        );
    }
    const checkedDictionary dict(dict_.sub("material"));
    o.material = pd_material_find(dict.choice("type", names).c_str());
    for (int k = 0; k < o.material->n_parameters; ++k)
    {
        o.parameters[k] = parameter(dict, o.material->parameters[k]);
    }
    dict.finish();
}


void Foam::periFoam::solidBody::readDamage(pd_body_options& o) const
{
    if (!dict_.found("damage"))
    {
        return;
    }
    const checkedDictionary dict(dict_.sub("damage"));
    const struct
    {
        const char* name;
        int bit;
    } criteria[] =
    {
        {"criticalStretch", PD_BY_STRETCH},
        {"vonMises", PD_BY_STRESS},
        {"plasticStrain", PD_BY_PLASTIC_STRAIN}
    };
    DynamicList<word> names;
    for (const auto& c : criteria)
    {
        if (o.formulation->criteria & c.bit)
        {
            names.append(c.name);
        }
    }
    const word criterion
    (
        names.found("criticalStretch")
      ? dict.choiceOr("criticalStretch", "criterion", names)
      : dict.choice("criterion", names)
    );
    if (criterion == "criticalStretch")
    {
        readCriticalStretch(dict, o);
    }
    else if (criterion == "vonMises")
    {
        o.critical_stress =
            dict.number("criticalStress", range::above(0), dimPressure);
    }
    else
    {
        o.failed_strain =
            dict.number("failedStrain", range::above(0), dimless);
        o.sound_strain = dict.number
        (
            "soundStrain",
            range::between(0, o.failed_strain, true, true),
            dimless
        );
    }
    dict.found("protect"); // cellZones: readProtected
    dict.finish();
}


void Foam::periFoam::solidBody::readCriticalStretch
(
    const checkedDictionary& dict,
    pd_body_options& o
) const
{
    const word key
    (
        dict.oneOf
        (
            wordList
            ({
                "criticalStretch", "criticalBondStrain", "energyReleaseRate"
            })
        )
    );
    if (key == "criticalStretch")
    {
        o.critical_stretch = dict.number(key, range::above(1), dimless);
    }
    else if (key == "criticalBondStrain")
    {
        o.critical_stretch = 1 + dict.number(key, range::above(0), dimless);
    }
    else
    {
        o.energy_release =
            dict.number(key, range::above(0), dimEnergy/dimArea);
        if (o.dimension == 1)
        {
            dict.refuse
            (
                key, "allowed: criticalStretch or criticalBondStrain in place"
                " of it in one dimension"
            );
        }
    }
}


pd_body_options
Foam::periFoam::solidBody::options(const scalar rhoInf) const
{
    pd_body_options o{};
    o.dimension = directions_.size();
    o.horizon_ratio = dict_.number
    (
        "horizonRatio", range::between(0, 20, false, true), dimless
    );
    o.density = readDensity(rhoInf);
    o.damping = dict_.numberOr
    (
        0, "damping", range::atLeast(0), dimDensity/dimTime
    );
    o.plane = readPlane();
    readFormulation(o);
    readMaterial(o);
    readDamage(o);
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
        if (type == "tether" && !fluid_)
        {
            hold.refuse("type", "allowed without a fluid: implicit");
        }
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


void Foam::periFoam::solidBody::placeTethers
(
    const labelList& pointOfCell,
    const List<unsigned char>& held
)
{
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
        if (dict.found("ramp"))
        {
            l->ramp = dict.function<scalar>("ramp");
        }
        dict.finish();
        loads_.append(l.release());
    }
}


void Foam::periFoam::solidBody::readMotions
(
    const polyMesh& solid,
    const labelList& pointOfCell
)
{
    if (!dict_.found("motions"))
    {
        return;
    }
    const checkedDictionary motions(dict_.sub("motions"));
    for (const word& name : motions.subNames())
    {
        const checkedDictionary dict(motions.sub(name));
        autoPtr<motion> m
        (
            new motion
            (
                name, dict, directions_, solid.time().startTime().value()
            )
        );
        const labelList cells(cellsOf(dict, solid));
        dict.finish();
        for (const label celli : cells)
        {
            if (pointOfCell[celli] >= view_.n_moving)
            {
                OStringStream os;
                os  << "cell " << celli << " at " << solid.cellCentres()[celli]
                    << " is held; allowed: cells that no hold holds";
                dict.refuse
                (
                    dict.found("patch") ? "patch" : "cellZone", os.str()
                );
            }
        }
        m->setPoints(labelUIndList(pointOfCell, cells)());
        motions_.append(m.release());
    }
    gatherMotions();
}


void Foam::periFoam::solidBody::readForceCoeffs(const scalar rhoInf)
{
    if (!dict_.found("forceCoeffs") || !fluid_)
    {
        return; // alone there is no force of a fluid
    }
    const checkedDictionary dict(dict_.sub("forceCoeffs"));
    coeffs_.drag = dict.vectorOf("dragDir", dimless);
    coeffs_.lift = dict.vectorOf("liftDir", dimless);
    for (const char* key : {"dragDir", "liftDir"})
    {
        const vector d(dict.vectorOf(key, dimless));
        if (mag(mag(d) - 1) > 1e-6)
        {
            dict.refuse(key, "allowed: a vector of length 1");
        }
    }
    const scalar rho = dict.numberOr
    (
        rhoInf, "rhoInf", range::above(0), dimDensity
    );
    const scalar speed =
        dict.number("magUInf", range::above(0), dimVelocity);
    coeffs_.scale =
        0.5*rho*sqr(speed)*dict.number("Aref", range::above(0), dimArea);
    dict.finish();
}


void Foam::periFoam::solidBody::gatherMotions()
{
    labelList place(view_.n_moving, -1);
    DynamicList<pd_local> points;
    DynamicList<unsigned char> axes;
    prescribedOf_.resize(motions_.size());
    forAll(motions_, i)
    {
        unsigned char bits = 0;
        for (const label axis : motions_[i].axes())
        {
            bits |= 1 << directions_.find(axis);
        }
        prescribedOf_[i].resize(motions_[i].points().size());
        forAll(motions_[i].points(), k)
        {
            const label p = motions_[i].points()[k];
            if (place[p] < 0)
            {
                place[p] = points.size();
                points.append(p);
                axes.append(0);
            }
            unsigned char& taken = axes[place[p]];
            if (taken & bits)
            {
                OStringStream os;
                os  << "it moves the point at " << reference(p)
                    << " along an axis that another motion prescribes;"
                    << " allowed: one motion for each component of a point";
                dict_.sub("motions").refuse(motions_[i].name(), os.str());
            }
            taken |= bits;
            prescribedOf_[i][k] = place[p];
        }
    }
    prescribedPoint_ = points;
    prescribedAxes_ = axes;
    prescribedPlace_.resize(points.size()*view_.dimension, Zero);
    if (fluid_)
    {
        pullVelocity_.resize(prescribedPlace_.size(), Zero);
        pull_.resize(prescribedPlace_.size(), Zero);
    }
}


void Foam::periFoam::solidBody::readVelocities
(
    const polyMesh& solid,
    const labelList& pointOfCell
)
{
    if (!dict_.found("initialVelocity"))
    {
        return;
    }
    const checkedDictionary velocities(dict_.sub("initialVelocity"));
    if (fluid_)
    {
        dict_.refuse
        (
            "initialVelocity",
            "allowed: in runs without a fluid (periSolidFoam); here the body"
            " has the velocity of the fluid"
        );
    }
    for (const word& name : velocities.subNames())
    {
        const checkedDictionary dict(velocities.sub(name));
        const vector value(dict.vectorOf("value", dimVelocity));
        const labelList cells
        (
            dict.found("cellZone") || dict.found("patch")
          ? cellsOf(dict, solid)
          : identity(solid.nCells())
        );
        dict.finish();
        for (const label celli : cells)
        {
            const label p = pointOfCell[celli];
            for (label a = 0; p < view_.n_moving && a < view_.dimension; ++a)
            {
                view_.v[p*view_.dimension + a] = value[directions_[a]];
            }
        }
    }
}


void Foam::periFoam::solidBody::readProtected(const polyMesh& solid)
{
    if (!dict_.found("damage") || !dict_.sub("damage").found("protect"))
    {
        return;
    }
    const checkedDictionary damage(dict_.sub("damage"));
    const wordList zones
    (
        damage.choices("protect", solid.cellZones().names())
    );
    List<unsigned char> protect(solid.nCells(), static_cast<unsigned char>(0));
    for (const word& zone : zones)
    {
        for (const label celli : solid.cellZones()[zone])
        {
            protect[celli] = 1;
        }
    }
    const pd_status status = pd_body_protect(body_, protect.cdata());
    if (status.code != PD_OK)
    {
        damage.refuse("protect", status.message);
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


// ************************************************************************* //
