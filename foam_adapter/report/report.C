/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "report.H"

#include <algorithm>

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

//- Digits of impulses: balances of momentum are exact
constexpr int exactDigits = 14;

void writeVector(Ostream& os, const vector& v)
{
    os << tab << v.x() << tab << v.y() << tab << v.z();
}

string briefVector(const vector& v)
{
    return
        "(" + periFoam::brief(v.x()) + " " + periFoam::brief(v.y()) + " "
      + periFoam::brief(v.z()) + ")";
}

scalar volumeOf(const List<periFoam::solidBody::piece>& pieces)
{
    scalar sum = 0;
    for (const periFoam::solidBody::piece& piece : pieces)
    {
        sum += piece[0];
    }
    return sum;
}

vector centreOf(const periFoam::solidBody::piece& piece)
{
    return vector(piece[1], piece[2], piece[3])/piece[0];
}

} // End anonymous namespace


// * * * * * * * * * * * * * * * Global Functions  * * * * * * * * * * * * * //

Foam::word Foam::periFoam::brief(const scalar value)
{
    OStringStream os;
    os.precision(4);
    os << value;
    return os.str();
}


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

Foam::autoPtr<Foam::periFoam::report::table>
Foam::periFoam::report::newTable
(
    const word& name,
    const string& header,
    const label bodyi,
    const label i
) const
{
    autoPtr<table> t(new table);
    t->bodyi = bodyi;
    t->i = i;
    t->file = openTable(name);
    writeHeader(t->file(), header);
    return t;
}


Foam::autoPtr<Foam::OFstream> Foam::periFoam::report::openTable
(
    const word& name
) const
{
    return
        writes_ && Pstream::master()
      ? createFile(name)
      : autoPtr<OFstream>(new OFstream("/dev/null"));
}


void Foam::periFoam::report::writeColumns
(
    OFstream& os,
    const wordList& columns
) const
{
    writeCommented(os, "Time");
    for (const word& column : columns)
    {
        writeTabbed(os, column);
    }
    os << endl;
}


void Foam::periFoam::report::createBodyTables()
{
    forAll(scene_.bodies(), i)
    {
        const word& name = scene_.bodies()[i].name();
        bodies_.append(newTable(name, "Body " + name, i, 0).release());
        writeColumns
        (
            bodies_[i].file(),
            wordList
            ({
                "mean(J-1)", "sum((J-1)V)", "min(J)", "max(J)",
                "kineticEnergy", "strainEnergy", "maxSpeed",
                "bonds", "brokenBonds", "singular", "inverted",
                "pieces", "freePieces"
            })
        );
    }
}


void Foam::periFoam::report::createProbeTables()
{
    forAll(scene_.probes(), i)
    {
        const scene::probe& p = scene_.probes()[i];
        const solidBody& body = scene_.bodies()[p.bodyi];
        autoPtr<table> t
        (
            newTable
            (
                p.name, "Probe " + p.name + " of " + body.name(), p.bodyi, i
            )
        );
        t->nearest = body.nearest(p.X);
        writeHeaderValue(t->file(), "position", p.X);
        wordList columns
        ({
            "displacement_x", "displacement_y", "displacement_z",
            "U_x", "U_y", "U_z", "J", "damage"
        });
        if (body.hasStress())
        {
            for (direction k = 0; k < symmTensor::nComponents; ++k)
            {
                columns.append
                (
                    "sigma_" + word(symmTensor::componentNames[k])
                );
            }
        }
        if (body.isPlastic())
        {
            columns.append("plasticStrain");
        }
        writeColumns(t->file(), columns);
        probes_.append(t.release());
    }
}


void Foam::periFoam::report::createMotionTables()
{
    forAll(scene_.bodies(), i)
    {
        const solidBody& body = scene_.bodies()[i];
        forAll(body.motions(), k)
        {
            const word& name = body.motions()[k].name();
            autoPtr<table> t
            (
                newTable
                (
                    name,
                    "Motion " + name + " of " + body.name()
                  + ": force that it exerts, mean displacement",
                    i,
                    k
                )
            );
            writeColumns
            (
                t->file(),
                wordList
                ({
                    "force_x", "force_y", "force_z",
                    "displacement_x", "displacement_y", "displacement_z"
                })
            );
            motions_.append(t.release());
        }
    }
}


void Foam::periFoam::report::createCostTable()
{
    cost_ = openTable("cost");
    writeHeader(cost_(), "Wall time since the first step [s]");
    wordList columns({"step", "deltaT", "stableStep"});
    columns.append(wall_.parts());
    writeColumns(cost_(), columns);
}


void Foam::periFoam::report::lookForPieces
(
    const label bodyi,
    const int64_t broken
)
{
    const solidBody& body = scene_.bodies()[bodyi];
    if (broken == brokenThen_[bodyi])
    {
        return;
    }
    brokenThen_[bodyi] = max(broken, int64_t(0));

    // Held points alone are no piece of what moves. A piece is free when none
    // of its points is held or moved
    const Map<solidBody::piece> all(body.pieces());
    DynamicList<solidBody::piece> pieces;
    label freePieces = 0;
    for (const label name : all.sortedToc())
    {
        const solidBody::piece& piece = all[name];
        if (piece[0] > 0)
        {
            pieces.append(piece);
        }
        freePieces += piece[4] == 0;
    }
    std::stable_sort
    (
        pieces.begin(),
        pieces.end(),
        [](const solidBody::piece& a, const solidBody::piece& b)
        {
            return a[0] > b[0];
        }
    );
    const bool first = broken < 0;
    if (pieces.size() > pieces_[bodyi] && !first)
    {
        tellPieces(body.name(), pieces);
    }
    if (freePieces > freePieces_[bodyi] && !first)
    {
        tellFreePieces(body.name(), freePieces, pieces);
    }
    pieces_[bodyi] = pieces.size();
    freePieces_[bodyi] = freePieces;
}


void Foam::periFoam::report::tellPieces
(
    const word& body,
    const List<solidBody::piece>& pieces
) const
{
    Info<< title_.c_str() << ": at t = " << brief(time_.value())
        << " s " << body << " is in " << pieces.size() << " pieces:";
    for (label k = 0; k < min(pieces.size(), label(3)); ++k)
    {
        Info<< (k ? "; " : " ") << brief(100*pieces[k][0]/volumeOf(pieces))
            << " % of its volume, centred at "
            << briefVector(centreOf(pieces[k])).c_str()
            << ", " << (pieces[k][4] > 0 ? "held" : "free");
    }
    Info<< endl;
}


void Foam::periFoam::report::tellFreePieces
(
    const word& body,
    const label freePieces,
    const List<solidBody::piece>& pieces
) const
{
    label largest = 0;
    while (pieces[largest][4] > 0)
    {
        ++largest;
    }
    Info<< title_.c_str() << ": at t = " << brief(time_.value())
        << " s " << body << " has " << freePieces
        << (freePieces == 1 ? " piece" : " pieces")
        << " that nothing holds, the largest with "
        << brief(100*pieces[largest][0]/volumeOf(pieces))
        << " % of its volume, centred at "
        << briefVector(centreOf(pieces[largest])).c_str() << endl;
}


void Foam::periFoam::report::writeBodyRow(const label bodyi)
{
    const pd_summary s = scene_.bodies()[bodyi].summary();
    lookForPieces(bodyi, s.broken_bonds);
    OFstream& os = bodies_[bodyi].file();
    writeCurrentTime(os);
    os  << tab << s.mean_volume_change << tab << s.sum_volume_change
        << tab << s.smallest_J << tab << s.largest_J
        << tab << s.kinetic_energy
        << tab << scene_.bodies()[bodyi].strainEnergy()
        << tab << s.largest_speed
        << tab << label(s.bonds) << tab << label(s.broken_bonds)
        << tab << label(s.singular) << tab << label(s.inverted)
        << tab << pieces_[bodyi] << tab << freePieces_[bodyi] << endl;
}


void Foam::periFoam::report::writeProbeRow(table& t)
{
    const solidBody& body = scene_.bodies()[t.bodyi];
    const solidBody::state s
    (
        body.probe(scene_.probes()[t.i].X, t.nearest)
    );
    OFstream& os = t.file();
    writeCurrentTime(os);
    writeVector(os, s.displacement);
    writeVector(os, s.velocity);
    os << tab << s.J << tab << s.damage;
    for (direction k = 0; body.hasStress() && k < symmTensor::nComponents; ++k)
    {
        os << tab << s.sigma[k];
    }
    if (body.isPlastic())
    {
        os << tab << s.plasticStrain;
    }
    os << endl;
}


void Foam::periFoam::report::writeMotionRow(table& t)
{
    const solidBody& body = scene_.bodies()[t.bodyi];
    vector force, displacement;
    body.reaction(t.i, force, displacement);
    writeCurrentTime(t.file());
    writeVector(t.file(), force);
    writeVector(t.file(), displacement);
    t.file() << endl;
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::report::report
(
    const scene& s,
    const objectRegistry& obr,
    const word& name,
    const string& title,
    const wallTime& wall,
    const bool writes
)
:
    writeFile(obr, name),
    scene_(s),
    time_(s.time()),
    title_(title),
    wall_(wall),
    startTime_(s.time().value()),
    writes_(writes),
    pieces_(s.bodies().size(), Zero),
    freePieces_(s.bodies().size(), Zero),
    brokenThen_(s.bodies().size(), int64_t(0))
{
    writePrecision_ = 8;
    createBodyTables();
    createProbeTables();
    createMotionTables();
    createCostTable();
    forAll(scene_.bodies(), i)
    {
        lookForPieces(i, -1);
    }
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

void Foam::periFoam::report::announce() const
{
    for (const solidBody& body : scene_.bodies())
    {
        const pd_body_options& o = body.options();
        const pd_summary s = body.summary(); // all ranks, before any prints
        Info<< "    " << body.name() << ": "
            << body.nAllPoints() << " points, "
            << body.nAllMoving() << " of them move; "
            << label(s.bonds) << " bonds; "
            << o.formulation->name << ", " << o.material->name
            << ", horizon " << o.horizon_ratio << " spacings, "
            << (body.canBreak() ? "can break" : "cannot break") << nl;
        if (Pstream::parRun())
        {
            const label mine = body.nMoving();
            const scalar mean = scalar(body.nAllMoving())/Pstream::nProcs();
            const label most = returnReduce(mine, maxOp<label>());
            const pd_traffic told = body.traffic();
            Info<< "        " << Pstream::nProcs() << " ranks, the fullest with "
                << brief(100*(most/max(mean, SMALL) - 1))
                << " % more moving points than the mean; ghosts "
                << returnReduce(label(told.ghosts), sumOp<label>()) << nl;
        }
    }
}


void Foam::periFoam::report::writeRows(const scalar stableStep)
{
    forAll(bodies_, i)
    {
        writeBodyRow(i);
    }
    for (table& t : probes_)
    {
        writeProbeRow(t);
    }
    for (table& t : motions_)
    {
        writeMotionRow(t);
    }
    writeCurrentTime(cost_());
    cost_()
        << tab << time_.timeIndex() << tab << time_.deltaTValue()
        << tab << stableStep;
    for (const scalar seconds : wall_.seconds())
    {
        cost_() << tab << seconds;
    }
    cost_() << endl;
}


void Foam::periFoam::report::addForceTables()
{
    forAll(scene_.bodies(), i)
    {
        const solidBody& body = scene_.bodies()[i];
        forces_.append
        (
            newTable
            (
                "force_" + body.name(),
                "Force of the fluid on " + body.name()
              + ", its impulse since the start of the run, centre of mass",
                i,
                0
            ).release()
        );
        wordList columns
        ({
            "force_x", "force_y", "force_z",
            "impulse_x", "impulse_y", "impulse_z",
            "centre_x", "centre_y", "centre_z"
        });
        if (body.coeffs().scale > 0)
        {
            columns.append("Cd");
            columns.append("Cl");
        }
        writeColumns(forces_[i].file(), columns);
    }
}


void Foam::periFoam::report::writeForces
(
    const UList<vector>& forces,
    const UList<vector>& impulses
)
{
    forAll(forces_, i)
    {
        const solidBody& body = scene_.bodies()[i];
        const solidBody::forceCoeffs& c = body.coeffs();
        const point centre(body.centre());
        OFstream& os = forces_[i].file();
        writeCurrentTime(os);
        const int digits = os.precision(exactDigits);
        writeVector(os, forces[i]);
        writeVector(os, impulses[i]);
        writeVector(os, centre);
        os.precision(digits);
        if (c.scale > 0)
        {
            os  << tab << (forces[i] & c.drag)/c.scale
                << tab << (forces[i] & c.lift)/c.scale;
        }
        os << endl;
    }
}


void Foam::periFoam::report::progress(const string& how) const
{
    int64_t bonds = 0, broken = 0, idle = 0;
    scalar change = 0, volume = 0;
    for (const solidBody& body : scene_.bodies())
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
    const scalar wall = max(wall_.total(), SMALL);
    const scalar run = time_.value() - startTime_;
    const scalar left = max(time_.endTime().value() - time_.value(), 0);

    Info<< title_.c_str() << ": t = " << brief(time_.value())
        << " s, step " << time_.timeIndex() << ", " << how.c_str()
        << ", broken bonds " << label(broken) << " of " << label(bonds)
        << ", points without stress " << label(idle)
        << ", volume change " << brief(volume > 0 ? 100*change/volume : 0)
        << " %, wall time " << brief(wall) << " s: ";
    const scalarList seconds(wall_.seconds());
    forAll(seconds, i)
    {
        Info<< (i ? ", " : "") << wall_.parts()[i] << " "
            << brief(100*seconds[i]/wall) << " %";
    }
    Info<< "; still to go " << brief(run > 0 ? wall*left/run : 0) << " s"
        << nl << endl;
}


void Foam::periFoam::report::fail
(
    const label bodyi,
    const label meshCell,
    const string& cause,
    const label step,
    const scalar time,
    const string& rest
) const
{
    const string where
    (
        meshCell < 0 ? "" : ", point of cell " + Foam::name(meshCell)
    );
    FatalErrorInFunction
        << "step " << step << ", time " << time << " s, body "
        << scene_.bodies()[bodyi].name() << where.c_str()
        << ": " << cause.c_str() << nl << "    " << rest.c_str()
        << exit(FatalError);
}


// ************************************************************************* //
