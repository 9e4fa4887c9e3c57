/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

Description
    What the peridynamics function object tells: the log, postProcessing and
    the fields at write times.

\*---------------------------------------------------------------------------*/

#include "peridynamics.H"
#include "pointCloud.H"
#include "zeroGradientFvPatchFields.H"

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

scalar secondsSince(const std::chrono::steady_clock::time_point& start)
{
    return std::chrono::duration<scalar>
    (
        std::chrono::steady_clock::now() - start
    ).count();
}

void writeVector(Ostream& os, const vector& v)
{
    os << tab << v.x() << tab << v.y() << tab << v.z();
}

//- A number for people
word brief(const scalar value)
{
    OStringStream os;
    os.precision(4);
    os << value;
    return os.str();
}

string brief(const vector& v)
{
    return "(" + brief(v.x()) + " " + brief(v.y()) + " " + brief(v.z()) + ")";
}

//- A field over cells, written to the current time
void writeCellField
(
    const fvMesh& mesh,
    const word& name,
    const scalarField& values
)
{
    volScalarField field
    (
        IOobject
        (
            name,
            mesh.time().timeName(),
            mesh,
            IOobject::NO_READ,
            IOobject::NO_WRITE,
            false
        ),
        mesh,
        dimensionedScalar(dimless, Zero),
        zeroGradientFvPatchScalarField::typeName
    );
    field.primitiveFieldRef() = values;
    field.correctBoundaryConditions();
    field.write();
}

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::functionObjects::peridynamics::announce() const
{
    Info<< nl << type() << " " << name() << ": coupled to "
        << time_.controlDict().lookupOrDefault<word>("application", "solver")
        << " through " << UName_ << " and " << phiName_
        << ", kernel " << kernel_->name;
    if (!kernel_->evenOdd)
    {
        Info<< " (not even-odd: look for a checkerboard in p)";
    }
    Info<< nl;
    for (const periFoam::solidBody& body : bodies_)
    {
        const pd_body_options& o = body.options();
        Info<< "    " << body.name() << ": "
            << label(body.view().n_owned) << " points, "
            << label(body.view().n_moving) << " of them move; "
            << label(body.summary().bonds) << " bonds; "
            << o.formulation->name << ", "
            << (o.material ? o.material->name : "no material")
            << ", horizon " << o.horizon_ratio << " spacings, "
            << (o.critical_stretch > 0 ? "can break" : "cannot break") << nl;
    }
    Info<< "    stable step ";
    if (stableStep_ < GREAT)
    {
        Info<< brief(stableStep_) << " s";
    }
    else
    {
        Info<< "unbounded, nothing moves";
    }
    Info<< ", deltaT "
        << brief(time_.deltaTValue()) << " s" << nl << endl;
}


void Foam::functionObjects::peridynamics::createFiles()
{
    bodyFiles_.resize(bodies_.size());
    forAll(bodies_, i)
    {
        bodyFiles_.set(i, createFile(bodies_[i].name()).release());
        OFstream& os = bodyFiles_[i];
        writeHeader(os, "Body " + bodies_[i].name());
        writeCommented(os, "Time");
        for
        (
            const char* column :
            {
                "mean(J-1)", "sum((J-1)V)", "min(J)", "max(J)",
                "kineticEnergy", "strainEnergy", "maxSpeed",
                "bonds", "brokenBonds", "singular", "inverted",
                "pieces", "freePieces"
            }
        )
        {
            writeTabbed(os, column);
        }
        os << endl;
    }
    for (probePoint& p : probes_)
    {
        p.file = createFile(p.name);
        writeHeader
        (
            p.file(), "Probe " + p.name + " of " + bodies_[p.bodyi].name()
        );
        writeHeaderValue(p.file(), "position", p.X);
        writeCommented(p.file(), "Time");
        for
        (
            const char* column :
            {
                "displacement_x", "displacement_y", "displacement_z",
                "U_x", "U_y", "U_z", "J", "damage"
            }
        )
        {
            writeTabbed(p.file(), column);
        }
        p.file() << endl;
    }
    costFile_ = createFile("cost");
    writeHeader(costFile_(), "Wall time since the first step [s]");
    writeCommented(costFile_(), "Time");
    for
    (
        const char* column :
        {
            "step", "deltaT", "stableStep",
            "solid", "transfer", "output", "flow"
        }
    )
    {
        writeTabbed(costFile_(), column);
    }
    costFile_() << endl;

    pieces_.resize(bodies_.size(), 0);
    freePieces_.resize(bodies_.size(), 0);
    brokenThen_.resize(bodies_.size(), 0);
    forAll(bodies_, i)
    {
        lookForPieces(i, -1);
    }
}


void Foam::functionObjects::peridynamics::lookForPieces
(
    const label bodyi,
    const int64_t broken
)
{
    const periFoam::solidBody& body = bodies_[bodyi];
    if (broken == brokenThen_[bodyi])
    {
        return;
    }
    brokenThen_[bodyi] = max(broken, int64_t(0));

    // A piece is free when none of its points is held
    labelList piece;
    const label n = body.pieces(piece);
    boolList held(n, false);
    for (label p = body.nMoving(); p < body.view().n_active; ++p)
    {
        held[piece[p]] = true;
    }
    scalarList volume(n, Zero);
    List<vector> centre(n, vector::zero);
    scalar all = 0;
    for (label p = 0; p < body.nMoving(); ++p)
    {
        all += body.volume(p);
        volume[piece[p]] += body.volume(p);
        centre[piece[p]] += body.volume(p)*body.position(p);
    }

    // Held points alone are no piece of what moves
    label pieces = 0, freePieces = 0, largest = -1;
    for (label i = 0; i < n; ++i)
    {
        pieces += volume[i] > 0;
        if (!held[i])
        {
            ++freePieces;
            largest = largest < 0 || volume[i] > volume[largest] ? i : largest;
        }
    }
    if (pieces > pieces_[bodyi] && broken >= 0)
    {
        Info<< type() << " " << name() << ": at t = " << brief(time_.value())
            << " s "
            << body.name() << " is in " << pieces << " pieces:";
        labelList order;
        sortedOrder(volume, order, UList<scalar>::greater(volume));
        for (label k = 0; k < min(pieces, label(3)); ++k)
        {
            const label i = order[k];
            Info<< (k ? "; " : " ") << brief(100*volume[i]/all)
                << " % of its volume, centred at "
                << brief(centre[i]/volume[i]).c_str() << ", " << (held[i] ? "held" : "free");
        }
        Info<< endl;
    }
    if (freePieces > freePieces_[bodyi] && broken >= 0)
    {
        Info<< type() << " " << name() << ": at t = " << brief(time_.value())
            << " s "
            << body.name() << " has " << freePieces
            << (freePieces == 1 ? " piece" : " pieces")
            << " that nothing holds, the largest with "
            << brief(100*volume[largest]/all) << " % of its volume, centred at "
            << brief(centre[largest]/volume[largest]).c_str() << endl;
    }
    pieces_[bodyi] = pieces;
    freePieces_[bodyi] = freePieces;
}


void Foam::functionObjects::peridynamics::writeRows()
{
    forAll(bodies_, i)
    {
        const pd_summary s = bodies_[i].summary();
        lookForPieces(i, s.broken_bonds);
        OFstream& os = bodyFiles_[i];
        writeCurrentTime(os);
        os  << tab << s.mean_volume_change << tab << s.sum_volume_change
            << tab << s.smallest_J << tab << s.largest_J
            << tab << s.kinetic_energy << tab << s.strain_energy
            << tab << s.largest_speed
            << tab << label(s.bonds) << tab << label(s.broken_bonds)
            << tab << label(s.singular) << tab << label(s.inverted)
            << tab << pieces_[i] << tab << freePieces_[i] << endl;
    }
    for (probePoint& p : probes_)
    {
        vector displacement, velocity;
        scalar J, damage;
        bodies_[p.bodyi].probe(p.X, displacement, velocity, J, damage);
        writeCurrentTime(p.file());
        writeVector(p.file(), displacement);
        writeVector(p.file(), velocity);
        p.file() << tab << J << tab << damage << endl;
    }
    const scalar flow =
        secondsSince(startOfRun_)
      - solidSeconds_ - transferSeconds_ - outputSeconds_;
    writeCurrentTime(costFile_());
    costFile_()
        << tab << time_.timeIndex() << tab << time_.deltaTValue()
        << tab << stableStep_ << tab << solidSeconds_
        << tab << transferSeconds_ << tab << outputSeconds_
        << tab << flow << endl;
}


void Foam::functionObjects::peridynamics::reportProgress() const
{
    int64_t bonds = 0, broken = 0, idle = 0;
    scalar change = 0, volume = 0;
    for (const periFoam::solidBody& body : bodies_)
    {
        const pd_summary s = body.summary();
        bonds += s.bonds;
        broken += s.broken_bonds;
        idle += s.singular + s.inverted;
        change += s.sum_volume_change;
        if (s.mean_volume_change != 0)
        {
            volume += s.sum_volume_change/s.mean_volume_change;
        }
    }
    const scalar wall = max(secondsSince(startOfRun_), SMALL);
    const scalar run = time_.value() - startTime_;
    const scalar left = max(time_.endTime().value() - time_.value(), 0);
    const scalar percent = 100/wall;

    Info<< type() << " " << name() << ": t = " << brief(time_.value())
        << " s, step " << time_.timeIndex()
        << ", stable step/deltaT " << brief(stableStep_/time_.deltaTValue())
        << ", broken bonds " << label(broken) << " of " << label(bonds)
        << ", points without stress " << label(idle)
        << ", volume change " << brief(volume > 0 ? 100*change/volume : 0) << " %"
        << ", wall time " << brief(wall)
        << " s: solid " << brief(percent*solidSeconds_)
        << " %, transfer " << brief(percent*transferSeconds_)
        << " %, output " << brief(percent*outputSeconds_)
        << " %, flow "
        << brief
           (
               100
             - percent*(solidSeconds_ + transferSeconds_ + outputSeconds_)
           )
        << " %; still to go " << brief(run > 0 ? wall*left/run : 0) << " s"
        << nl << endl;
}


void Foam::functionObjects::peridynamics::writeFields()
{
    DynamicList<point> place;
    DynamicList<scalar> volume, damaged;
    for (const periFoam::solidBody& body : bodies_)
    {
        const scalarField phi(body.damage());
        for (label p = 0; p < body.view().n_owned; ++p)
        {
            place.append(body.position(p));
            volume.append(body.volume(p));
            damaged.append(body.volume(p)*phi[p]);
        }
        periFoam::writePointCloud(mesh_, transfer_(), body);
    }
    scalarField solid, damage;
    transfer_->spreadAmount(place, volume, solid);
    transfer_->spreadAmount(place, damaged, damage);
    forAll(solid, celli)
    {
        damage[celli] = solid[celli] > 0 ? damage[celli]/solid[celli] : 0;
    }
    solid /= mesh_.V();
    writeCellField(mesh_, "solidFraction", solid);
    writeCellField(mesh_, "damage", damage);
}


// ************************************************************************* //
