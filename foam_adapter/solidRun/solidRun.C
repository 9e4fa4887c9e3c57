/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "solidRun.H"
#include "bodyFields.H"
#include "OSspecific.H"
#include "Time.H"

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

//- Seconds of wall time after which the log tells something, whatever
//  reportInterval says
constexpr scalar silence = 10;

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoam::solidRun::dropCouplings()
{
    dictionary& control = const_cast<dictionary&>(time_.controlDict());
    if (!control.isDict("functions"))
    {
        return;
    }
    dictionary& functions = control.subDict("functions");
    for (const word& name : functions.toc())
    {
        if
        (
            functions.isDict(name)
         && functions.subDict(name).lookupOrDefault<word>("type", "")
         == "peridynamics"
        )
        {
            Info<< "periSolidFoam: the function object " << name
                << " is left out, there is no fluid" << endl;
            functions.remove(name);
        }
    }
}


void Foam::periFoam::solidRun::readRelaxation(const checkedDictionary& dict)
{
    relaxation_ = solidBody::relaxation
    {
        dict.numberOr
        (
            1e-6, "tolerance", range::between(0, 1, false, false), dimless
        ),
        dict.integerOr(100000, "maxIterations", 1),
        0,
        0
    };
}


void Foam::periFoam::solidRun::readIntegration()
{
    const checkedDictionary top(scene_.properties());
    const dictionary none;
    const checkedDictionary dict
    (
        top.found("integration") ? top.sub("integration").dict() : none
    );
    DynamicList<word> names;
    for (const pd_integrator* const* i = pd_integrators; *i; ++i)
    {
        names.append((*i)->name);
    }
    names.append("relaxation");
    const word type(dict.choiceOr("velocityVerlet", "type", names));
    integrator_ = pd_integrator_find(type.c_str());
    if (integrator_)
    {
        maxStep_ = dict.numberOr
        (
            0.8, "maxStep", range::between(0, 1, false, true), dimless
        );
        allowUnstable_ = dict.flagOr(false, "allowUnstable");
    }
    else
    {
        readRelaxation(dict);
    }
    // A load step is worth a row and a line of its own
    outputInterval_ = dict.integerOr(integrator_ ? 10 : 1, "outputInterval", 1);
    reportInterval_ =
        dict.integerOr(integrator_ ? 100 : 1, "reportInterval", 1);
    dict.finish();
}


Foam::scalar Foam::periFoam::solidRun::densityOfCoupling() const
{
    const checkedDictionary top(scene_.properties());
    if (!top.found("coupling") || !top.sub("coupling").found("rhoInf"))
    {
        return 0;
    }
    return top.sub("coupling").number("rhoInf", range::above(0), dimDensity);
}


void Foam::periFoam::solidRun::refuseHistories() const
{
    for (const solidBody& body : scene_.bodies())
    {
        if (body.options().formulation->advance)
        {
            const checkedDictionary top(scene_.properties());
            top.sub("integration").refuse
            (
                "type",
                "the formulation of " + body.name() + " integrates a history"
                " of stress in time; allowed with it: a type that does, such"
                " as velocityVerlet"
            );
        }
    }
}


Foam::scalar Foam::periFoam::solidRun::estimateStableStep() const
{
    scalar step = GREAT;
    for (const solidBody& body : scene_.bodies())
    {
        if (body.nAllMoving() > 0)
        {
            step = min(step, body.stableStep());
        }
    }
    return step;
}


void Foam::periFoam::solidRun::begin()
{
    forAll(scene_.bodies(), i)
    {
        const pd_status status = scene_.bodies()[i].begin(time_.value());
        if (status.code != PD_OK)
        {
            fail(i, status.point, status.message);
        }
    }
}


bool Foam::periFoam::solidRun::resume()
{
    notes all;
    all.number("time");
    all.integer("step");
    if (!scene_.load(all))
    {
        return false;
    }
    // To the last bit, which the name of the time does not have
    time_.setTime(all.numberAt(0), label(all.integerAt(1)));
    doneIndex_ = time_.timeIndex();
    doneTime_ = time_.value();
    return true;
}


void Foam::periFoam::solidRun::checkStep() const
{
    const scalar deltaT = time_.deltaTValue(), limit = maxStep_*stableStep_;
    if (!integrator_ || allowUnstable_ || deltaT <= limit*(1 + 1e-9))
    {
        return;
    }
    OStringStream os;
    os  << "the stable step of the bodies at rest is " << stableStep_
        << " s; allowed: at most " << maxStep_ << " times that, " << limit
        << " s, or adjustTimeStep yes, or a larger maxStep or allowUnstable"
        << " yes in integration";
    checkedDictionary(time_.controlDict()).refuse("deltaT", os.str());
}


void Foam::periFoam::solidRun::announce() const
{
    Info<< nl << "periSolidFoam: bodies without a fluid, "
        << (integrator_ ? integrator_->name : "relaxation") << nl;
    report_->announce();
    if (integrator_)
    {
        Info<< "    stable step ";
        if (stableStep_ < GREAT)
        {
            Info<< brief(stableStep_) << " s";
        }
        else
        {
            Info<< "unbounded, nothing moves";
        }
        Info<< ", deltaT " << brief(time_.deltaTValue()) << " s" << nl;
    }
    else
    {
        Info<< "    to a residual of " << brief(relaxation_.tolerance) << nl;
    }
    Info<< endl;
}


void Foam::periFoam::solidRun::move(const label bodyi)
{
    const pd_status status = scene_.bodies()[bodyi].step
    (
        *integrator_, time_.deltaTValue(), time_.value()
    );
    if (status.code != PD_OK)
    {
        fail(bodyi, status.point, status.message);
    }
}


void Foam::periFoam::solidRun::relax(const label bodyi)
{
    solidBody& body = scene_.bodies()[bodyi];
    const pd_status status = body.relax
    (
        time_.value(),
        relaxation_,
        [&](const solidBody::relaxation& r)
        {
            if (wall_.total() > toldAt_ + silence)
            {
                toldAt_ = wall_.total();
                Info<< "periSolidFoam: step " << time_.timeIndex() << ", "
                    << body.name() << ", iteration " << r.iterations
                    << ", residual " << brief(r.residual) << endl;
            }
        }
    );
    if (status.code != PD_OK)
    {
        fail(bodyi, status.point, status.message);
    }
    if (relaxation_.residual > relaxation_.tolerance)
    {
        OStringStream os;
        os  << "the residual is " << relaxation_.residual << " after "
            << relaxation_.iterations << " iterations (maxIterations);"
            << " tolerance " << relaxation_.tolerance;
        fail(bodyi, -1, os.str());
    }
}


void Foam::periFoam::solidRun::tell()
{
    stopwatch watch(wall_, OUTPUT);
    const label step = time_.timeIndex();
    const bool last =
        time_.value() >= time_.endTime().value() - 0.5*time_.deltaTValue();
    if (step % outputInterval_ == 0 || last)
    {
        report_->writeRows(stableStep_);
    }
    if
    (
        step % reportInterval_ == 0
     || last
     || wall_.total() > toldAt_ + silence
    )
    {
        OStringStream how;
        if (integrator_)
        {
            how << "stable step/deltaT "
                << brief(stableStep_/time_.deltaTValue());
        }
        else
        {
            how << "iterations " << relaxation_.iterations << ", residual "
                << brief(relaxation_.residual);
        }
        report_->progress(how.str());
        toldAt_ = wall_.total();
    }
    if (time_.writeTime())
    {
        writeFields();
    }
    time_.write();
    if (time_.writeTime())
    {
        notes all;
        all.number("time", time_.value());
        all.integer("step", time_.timeIndex());
        scene_.save(all);
    }
}


void Foam::periFoam::solidRun::writeFields() const
{
    forAll(scene_.bodies(), i)
    {
        if (scene_.writesFields())
        {
            writeRegion(scene_.mesh(i), scene_.bodies()[i]);
        }
    }
    scene_.writePictures("solid");
}


void Foam::periFoam::solidRun::fail
(
    const label bodyi,
    const label meshCell,
    const string& cause
)
{
    const label step = time_.timeIndex();
    const scalar when = time_.value();
    OStringStream rest;
    if (integrator_)
    {
        rest<< "Stable step " << stableStep_ << " s, deltaT "
            << time_.deltaTValue() << " s; ";
    }
    if (doneIndex_ > time_.startTimeIndex())
    {
        for (solidBody& body : scene_.bodies())
        {
            body.toStart();
            body.begin(doneTime_); // F and J of that state
        }
        time_.setTime(doneTime_, doneIndex_);
        time_.writeNow();
        writeFields();
        rest<< "the last good state is written to "
            << time_.timeName().c_str()
            << ", to be looked at; periResume tells where to go on";
    }
    else
    {
        rest<< "nothing was computed before it";
    }
    report_->fail(bodyi, meshCell, cause, step, when, rest.str());
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::solidRun::solidRun(Time& time, const bool dry)
:
    time_(time),
    scene_(time),
    integrator_(nullptr),
    relaxation_{0, 0, 0, 0},
    maxStep_(1),
    allowUnstable_(false),
    stableStep_(GREAT),
    doneIndex_(time.timeIndex()),
    doneTime_(time.value()),
    wall_(wordList({"solid", "output", "other"})),
    toldAt_(0)
{
    dropCouplings();
    readIntegration();
    scene_.readBodies(nullptr, densityOfCoupling());
    if (integrator_)
    {
        stableStep_ = estimateStableStep(); // at rest, whatever broke since
    }
    else
    {
        refuseHistories();
    }
    const bool resumed = resume();
    if (integrator_)
    {
        if (!time_.isAdjustTimeStep())
        {
            checkStep();
        }
        setDeltaT(); // before the first run(), which compares it with endTime
    }
    report_.reset
    (
        new report(scene_, time_, "solid", "periSolidFoam", wall_, !dry)
    );
    announce();
    if (!resumed)
    {
        begin();
        if (!dry)
        {
            writeFields();
        }
    }
    wall_.start();
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::scalar Foam::periFoam::solidRun::secondsPerStep()
{
    constexpr label times = 3;
    const scalar before = wall_.total();
    for (label k = 0; integrator_ && k < times; ++k)
    {
        begin();
    }
    return (wall_.total() - before)/times;
}


void Foam::periFoam::solidRun::setDeltaT()
{
    if (!integrator_ || !time_.isAdjustTimeStep())
    {
        return;
    }
    const scalar limit = min
    (
        min(maxStep_*stableStep_, time_.endTime().value() - time_.value()),
        time_.controlDict().lookupOrDefault<scalar>("maxDeltaT", GREAT)
    );
    // Time divides what is left until the next write time anew, which may
    // stretch the step
    scalar target = limit;
    do
    {
        time_.setDeltaT(target);
        target *= 0.9;
    }
    while (time_.deltaTValue() > limit);
}


void Foam::periFoam::solidRun::step()
{
    if (!time_.isAdjustTimeStep())
    {
        checkStep();
    }
    {
        stopwatch watch(wall_, SOLID);
        forAll(scene_.bodies(), i)
        {
            if (integrator_)
            {
                move(i);
            }
            else
            {
                relax(i);
            }
        }
    }
    for (solidBody& body : scene_.bodies())
    {
        body.keep();
    }
    doneIndex_ = time_.timeIndex();
    doneTime_ = time_.value();
    tell();
}


// ************************************************************************* //
