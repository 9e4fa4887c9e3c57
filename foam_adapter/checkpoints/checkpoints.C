/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "checkpoints.H"
#include "OSspecific.H"
#include "Time.H"

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

pd_note named(const word& name)
{
    pd_note note{};
    name.copy(note.name, sizeof(note.name) - 1);
    return note;
}

} // End anonymous namespace


// * * * * * * * * * * * * * * * Global Functions  * * * * * * * * * * * * * //

const Foam::fileName Foam::periFoam::checkpoints::folder("uniform/periFoam");


void Foam::periFoam::notes::number(const word& name, const scalar value)
{
    pd_note note(named(name));
    note.kind = pd_note::PD_NOTE_NUMBER;
    note.number = value;
    notes_.append(note);
}


void Foam::periFoam::notes::integer(const word& name, const int64_t value)
{
    pd_note note(named(name));
    note.kind = pd_note::PD_NOTE_INTEGER;
    note.integer = value;
    notes_.append(note);
}


Foam::fileName Foam::periFoam::checkpoints::pathNow(const Time& time)
{
    fileName path(time.timePath()/folder);
    Pstream::scatter(path);
    return path;
}


Foam::wordList Foam::periFoam::checkpoints::bodiesIn
(
    const fileName& folder,
    const wordList& bodies
)
{
    DynamicList<word> there;
    for (const word& body : bodies)
    {
        if (isFile(folder/(body + ".h5"), false))
        {
            there.append(body);
        }
    }
    return wordList(std::move(there));
}


Foam::wordList Foam::periFoam::checkpoints::timesOf
(
    const Time& time,
    const wordList& bodies
)
{
    DynamicList<word> complete;
    for (const instant& then : Time::findTimes(time.path(), time.constant()))
    {
        const fileName path(time.path()/then.name()/folder);
        if (bodiesIn(path, bodies).size() == bodies.size())
        {
            complete.append(then.name());
        }
    }
    const label most = 5, n = complete.size();
    return
        n <= most
      ? wordList(std::move(complete))
      : wordList(SubList<word>(complete, most, n - most));
}


// ************************************************************************* //
