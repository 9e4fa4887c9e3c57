/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "scene.H"
#include "fvMesh.H"
#include "OSspecific.H"
#include "sigFpe.H"
#include "Time.H"

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

//- End the run over an error that OpenFOAM met while it read the file. Its own
//  text does not always say in which
void refuseFile
(
    const Time& time,
    const error& e,
    const fileName& file,
    const label line
)
{
    const fileName properties
    (
        time.path()/time.constant()/"peridynamicsProperties"
    );
    FatalIOError
    (
        "periFoam", __FILE__, __LINE__, file.empty() ? properties : file, line
    )   << e.message().c_str() << nl << "    while reading " << properties
        << exit(FatalIOError);
}

//- Name a dictionary after its file, and those in it. Ranks that have it from
//  the master call it by the stream, and so would their errors. The list is
//  gone through as a constant one: in others OpenFOAM finds no end where the
//  last entry has replaced another
void nameAfter(const fileName& file, const fileName& old, dictionary& dict)
{
    if (dict.name().compare(0, old.size(), old) == 0)
    {
        dict.name() = file + dict.name().substr(old.size());
    }
    for (const entry& e : static_cast<const dictionary&>(dict))
    {
        if (e.isDict())
        {
            nameAfter(file, old, const_cast<dictionary&>(e.dict()));
        }
    }
}

//- A state that was copied from another time must not be taken for that of
//  this one. The folder's name has fewer digits than the state
void checkTime(const Time& time, const fileName& file, const scalar kept)
{
    if
    (
        Time::timeName(kept) != time.timeName()
     && mag(kept - time.value()) > 1e-3*time.deltaTValue()
    )
    {
        FatalIOErrorInFunction(time.controlDict())
            << "the run starts at " << time.timeName() << ", where " << file
            << " has the state of time " << Time::timeName(kept)
            << "; allowed: that of the time whose folder it is in"
            << exit(FatalIOError);
    }
}

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoam::scene::checkMesh
(
    const word& name,
    const checkedDictionary& dict
) const
{
    const fileName path
    (
        time_.path()/time_.constant()/name/polyMesh::meshSubDir
    );
    for (const char* f : {"points", "faces", "owner", "neighbour", "boundary"})
    {
        if (!isFile(path/f))
        {
            dict.refuse
            (
                "formulation",
                "the body " + name + " has no mesh " + (path/f)
              + "; allowed: a region mesh of that name (blockMesh -region "
              + name + ")"
            );
        }
    }
}


Foam::wordList Foam::periFoam::scene::bodyNames() const
{
    wordList names(bodies_.size());
    forAll(bodies_, i)
    {
        names[i] = bodies_[i].name();
    }
    return names;
}


Foam::wordList Foam::periFoam::scene::tableNames() const
{
    wordList names(bodyNames());
    names.append("cost");
    for (const solidBody& body : bodies_)
    {
        const checkedDictionary& dict = body.dict();
        for (const motion& m : body.motions())
        {
            if (names.found(m.name()))
            {
                dict.sub("motions").refuse
                (
                    m.name(),
                    "allowed: a name other than cost and those of the bodies "
                    "and of their other motions, whose tables stand beside it"
                );
            }
            names.append(m.name());
        }
    }
    return names;
}


void Foam::periFoam::scene::readOutput()
{
    DynamicList<word> names;
    for (const char* const* name = pd_field_names; *name; ++name)
    {
        names.append(*name);
    }
    output_ = output{true, false, {"displacement", "damage"}, false, 0};
    const checkedDictionary top(properties());
    if (!top.found("output"))
    {
        return;
    }
    const checkedDictionary dict(top.sub("output"));
    if (dict.found("formats"))
    {
        const wordList formats
        (
            dict.choices("formats", wordList({"openfoam", "hdf5"}))
        );
        output_.fields = formats.found("openfoam");
        output_.hdf5 = formats.found("hdf5");
    }
    if (dict.found("fields"))
    {
        output_.names = dict.choices("fields", names);
    }
    output_.single =
        dict.choiceOr("double", "precision", wordList({"double", "single"}))
     == "single";
    output_.interval = dict.integerOr(0, "cellFieldInterval", 0);
    dict.finish();
}


void Foam::periFoam::scene::readProbes()
{
    const checkedDictionary top(properties());
    const wordList bodies(bodyNames()), taken(tableNames());
    if (top.found("probes"))
    {
        const checkedDictionary probes(top.sub("probes"));
        for (const word& name : probes.subNames())
        {
            const checkedDictionary dict(probes.sub(name));
            autoPtr<probe> p(new probe);
            p->name = name;
            p->bodyi = bodies.find(dict.choice("body", bodies));
            p->X = dict.vectorOf("position", dimLength);
            if (!bodies_[p->bodyi].reaches(p->X))
            {
                dict.refuse
                (
                    "position",
                    "allowed: a place in or on the body "
                  + bodies_[p->bodyi].name() + " at rest, within a horizon of"
                    " one of its points"
                );
            }
            if (taken.found(name))
            {
                probes.refuse
                (
                    name,
                    "allowed: a name other than cost and those of the bodies "
                    "and motions, whose tables stand beside it"
                );
            }
            dict.finish();
            probes_.append(p.release());
        }
    }
    // The top level is complete only here. Sub-dictionary parameters is the
    // user's own, for macros
    readOutput();
    for
    (
        const char* key
      : {"parameters", "coupling", "integration", "bodies", "output"}
    )
    {
        top.found(key);
    }
    top.finish();
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::scene::scene(const Time& time)
try
:
    time_(time),
    properties_
    (
        // 1e400 is then refused with its line, rather than trapped
        (
            sigFpe::ignore(),
            throwingErrors(),
            IOobject
            (
                "peridynamicsProperties",
                time.constant(),
                time,
                IOobject::READ_IF_PRESENT,
                IOobject::NO_WRITE
            )
        )
    )
{
    const sigFpe::ignore untrapped; // numbers of the header too
    if (!properties_.headerOk())
    {
        FatalIOErrorInFunction(time.controlDict())
            << "cannot read " << properties_.objectPath()
            << ", which describes the bodies" << exit(FatalIOError);
    }
    const fileName file(properties_.filePath());
    checkText(file);
    const fileName old(properties_.dictionary::name());
    nameAfter(file, old, properties_);
}
catch (const IOerror& e)
{
    refuseFile(time, e, e.ioFileName(), e.ioStartLineNumber());
}
catch (const error& e)
{
    refuseFile(time, e, "", -1);
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

void Foam::periFoam::scene::readBodies
(
    const fvMesh* fluid,
    const scalar rhoInf
)
{
    const checkedDictionary top(properties());
    const checkedDictionary dict(top.sub("bodies"));
    const wordList names(dict.subNames());
    if (names.empty())
    {
        top.refuse("bodies", "allowed: at least one body");
    }
    bodies_.resize(names.size());
    meshes_.resize(fluid ? 0 : names.size());
    forAll(names, i)
    {
        const checkedDictionary body(dict.sub(names[i]));
        checkMesh(names[i], body);
        IOobject io(names[i], time_.constant(), time_, IOobject::MUST_READ);
        autoPtr<polyMesh> inFluid;
        if (fluid)
        {
            inFluid.reset(new polyMesh(io));
        }
        else
        {
            // Schemes and solvers, which nothing here needs, are not read
            io.readOpt() = IOobject::NO_READ;
            meshes_.set(i, new fvMesh(io));
        }
        const polyMesh& mesh = fluid ? inFluid() : meshes_[i];
        bodies_.set
        (
            i, new solidBody(names[i], body, mesh, fluid, rhoInf)
        );
    }
    readProbes();
}


bool Foam::periFoam::scene::wasWritten() const
{
    bool written = false;
    for (const solidBody& body : bodies_)
    {
        written =
            written
         || isFile(time_.timePath()/"lagrangian"/body.name()/"displacement")
         || isFile(time_.timePath()/body.name()/"displacement");
    }
    return returnReduce(written, orOp<bool>());
}


void Foam::periFoam::scene::writePictures(const word& name) const
{
    if (!output_.hdf5)
    {
        return;
    }
    const fileName folder(time_.globalPath()/"postProcessing"/name/"hdf5");
    if (Pstream::master())
    {
        mkDir(folder);
    }
    for (const solidBody& body : bodies_)
    {
        body.writePicture(folder, time_.value(), output_.names, output_.single);
    }
}


void Foam::periFoam::scene::save(const notes& all)
{
    const fileName folder(checkpoints::pathNow(time_));
    if (Pstream::master())
    {
        mkDir(folder);
    }
    for (solidBody& body : bodies_)
    {
        body.keepState(folder, all);
    }
}


bool Foam::periFoam::scene::load(notes& all)
{
    if (time_.startTimeIndex() == 0 && time_.value() == 0)
    {
        return false;
    }
    const fileName folder(checkpoints::pathNow(time_));
    const wordList bodies(bodyNames());
    label there = checkpoints::bodiesIn(folder, bodies).size();
    Pstream::scatter(there);
    if (there == 0 && !wasWritten())
    {
        return false; // a flow without bodies so far
    }
    if (there < bodies.size())
    {
        FatalIOErrorInFunction(time_.controlDict())
            << "the run starts at " << time_.timeName() << ", where "
            << there << " of the " << bodies.size() << " bodies left their"
            << " state in " << folder << ", so that it is not known how they"
            << " go on; allowed: time 0, a flow without bodies, or one of"
            << " the times " << flatOutput(checkpoints::timesOf(time_, bodies))
            << " (periResume sets later ones aside)" << exit(FatalIOError);
    }
    for (solidBody& body : bodies_)
    {
        notes ofBody(all);
        body.resume(folder, ofBody);
        checkTime(time_, folder/(body.name() + ".h5"), ofBody.numberAt(0));
        std::copy(ofBody.data(), ofBody.data() + all.size(), all.data());
    }
    return true;
}


// ************************************************************************* //
