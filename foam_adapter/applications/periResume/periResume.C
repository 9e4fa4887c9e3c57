/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

Application
    periResume

Description
    Says from which time a run that broke off can continue, and sets later
    times aside by renaming them to <time>.incomplete: those that were not
    written to their end, or whose states of bodies are damaged. In a
    decomposed case a time is complete when all processor folders have it.

    A run with `startFrom latestTime` then starts from there.

\*---------------------------------------------------------------------------*/

#include "argList.H"
#include "checkpoints.H"
#include "IOdictionary.H"
#include "OSspecific.H"
#include "Time.H"

using namespace Foam;

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

//- Names of the bodies of the case
wordList bodiesOf(const Time& time)
{
    const IOdictionary properties
    (
        IOobject
        (
            "peridynamicsProperties",
            time.constant(),
            time,
            IOobject::MUST_READ,
            IOobject::NO_WRITE,
            false
        )
    );
    return properties.subDict("bodies").toc();
}


//- Why the time cannot be continued from; empty: it can
string lackOf
(
    const fileNameList& folders,
    const word& time,
    const wordList& bodies
)
{
    for (const fileName& folder : folders)
    {
        if (!isDir(folder/time))
        {
            return "there is no " + folder/time;
        }
    }
    const fileName kept(folders[0]/time/periFoam::checkpoints::folder);
    for (const word& body : bodies)
    {
        pd_checkpoint_facts facts;
        const pd_status status =
            pd_checkpoint_check((kept/(body + ".h5")).c_str(), &facts);
        if (status.code != PD_OK)
        {
            return status.message;
        }
    }
    return string();
}


void setAside(const fileNameList& folders, const word& time)
{
    for (const fileName& folder : folders)
    {
        const fileName aside(folder/(time + ".incomplete"));
        if (isDir(folder/time))
        {
            rmDir(aside);
            mv(folder/time, aside);
        }
    }
}


//- Names of all times but constant and 0, latest first
wordList timesOf(const fileNameList& folders, const Time& time)
{
    wordHashSet names;
    DynamicList<instant> all;
    for (const fileName& folder : folders)
    {
        for (const instant& then : Time::findTimes(folder, time.constant()))
        {
            if (then.value() > 0 && names.insert(then.name()))
            {
                all.append(then);
            }
        }
    }
    std::sort
    (
        all.begin(),
        all.end(),
        [](const instant& a, const instant& b)
        {
            return a.value() > b.value();
        }
    );
    wordList result(all.size());
    forAll(all, i)
    {
        result[i] = all[i].name();
    }
    return result;
}

} // End anonymous namespace


// * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * * //

int main(int argc, char* argv[])
{
    argList::addNote
    (
        "Sets times aside that were not written to their end, and says where"
        " a run with bodies continues"
    );
    argList::noParallel();
    argList::noFunctionObjects();

    #include "setRootCase.H"
    #include "createTime.H"

    const wordList bodies(bodiesOf(runTime));

    // A decomposed case continues in its processor folders
    fileNameList folders;
    for (label p = 0; isDir(runTime.path()/("processor" + Foam::name(p))); ++p)
    {
        folders.append(runTime.path()/("processor" + Foam::name(p)));
    }
    if (folders.empty())
    {
        folders.append(runTime.path());
    }

    word from("0");
    for (const word& time : timesOf(folders, runTime))
    {
        const string lack(lackOf(folders, time, bodies));
        if (lack.empty())
        {
            from = time;
            break;
        }
        setAside(folders, time);
        Info<< "periResume: " << time << " is set aside: " << lack.c_str()
            << endl;
    }
    Info<< "periResume: continues from time " << from << endl;
    return 0;
}


// ************************************************************************* //
