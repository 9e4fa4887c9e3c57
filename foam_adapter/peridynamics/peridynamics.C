/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "peridynamics.H"
#include "addToRunTimeSelectionTable.H"
#include "bodyFields.H"
#include "fvOptions.H"
#include "OSspecific.H"
#include "timeLevel.H"

#include <cmath>

// * * * * * * * * * * * * * * Static Data Members * * * * * * * * * * * * * //

namespace Foam
{
namespace functionObjects
{
    defineTypeNameAndDebug(peridynamics, 0);
    addToRunTimeSelectionTable(functionObject, peridynamics, dictionary);
}
}

namespace
{

using namespace Foam;

//- A fixed deltaT beyond the stable step by more than this, unstable even at
//  rest, ends the run
constexpr scalar allowedExcess = 1.25;

//- Largest stable omega deltaT of the coupling, by a sixth less than measured
//  (docs/limits.md). The schemes alone bear 2 without any damping; in the flow
//  slow growth is left, which viscosity takes away, and the fluid's inertia.
//  damping: nu/(h^2 omega); ratio: of the densities of body and fluid
scalar stablePhase(const scalar damping, const scalar ratio)
{
    return 0.5 + 0.25*min(10/ratio, scalar(1)) + 1.5*damping/(damping + 0.008);
}

//- What is left of it with a kernel of two cells, which feeds a checkerboard,
//  and where velocities of cells, which do not keep volumes, move the points
constexpr scalar ofNarrowKernel = 0.5;
constexpr scalar ofCells = 0.65;

//- From here on errors end the run. OpenFOAM makes warnings of those that a
//  constructor meets, and would go on without the solid
const word& endingOnErrors
(
    const word& name,
    const Time& runTime,
    const dictionary& dict
)
{
    if (functionObject::postProcess)
    {
        return name;
    }
    FatalError.throwExceptions(false);
    const word region
    (
        dict.lookupOrDefault<word>("region", polyMesh::defaultRegion)
    );
    if (!runTime.foundObject<fvMesh>(region))
    {
        FatalIOErrorInFunction(dict)
            << "the key 'region' has the value " << region
            << "; allowed: one of " << flatOutput(runTime.names<fvMesh>())
            << exit(FatalIOError);
    }
    return name;
}

//- The text of the first rank that has one. Collective
string firstText(const string& mine)
{
    stringList all(Pstream::nProcs());
    all[Pstream::myProcNo()] = mine;
    Pstream::gatherList(all);
    Pstream::scatterList(all);
    for (const string& text : all)
    {
        if (!text.empty())
        {
            return text;
        }
    }
    return string();
}

const char* const solversThatAsk =
    "pimpleFoam, pisoFoam, simpleFoam, interFoam, interIsoFoam, rhoPimpleFoam,"
    " sonicFoam; rhoCentralFoam with partitioned bodies";

//- Others are found out at the end of their first step
const wordHashSet solversThatDoNot
({
    "icoFoam", "nonNewtonianIcoFoam", "potentialFoam", "dnsFoam", "mhdFoam",
    "cavitatingFoam"
});

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::functionObjects::peridynamics::checkFunctionKeys
(
    const dictionary& dict
) const
{
    const periFoam::checkedDictionary keys(dict);
    const wordList known
    ({
        "type", "libs", "functionObjectLibs", "region", "enabled", "log"
    });
    for (const word& key : known)
    {
        keys.found(key);
    }
    keys.finish();
}


void Foam::functionObjects::peridynamics::readCoupling()
{
    using periFoam::range;
    const periFoam::checkedDictionary top(scene_.properties());
    const periFoam::checkedDictionary dict(top.sub("coupling"));

    UName_ = dict.found("U") ? dict.name("U") : word("U");
    phiName_ = dict.found("phi") ? dict.name("phi") : word("phi");
    compressible_ =
        foundObject<surfaceScalarField>(phiName_)
     && phi().dimensions() == dimMass/dimTime;
    rhoInf_ = dict.number("rhoInf", range::above(0), dimDensity);
    allowUnstable_ = dict.flagOr(false, "allowUnstable");
    outputInterval_ = dict.integerOr(10, "outputInterval", 1);
    holdStrength_ = dict.numberOr
    (
        10000, "holdStrength", range::above(0), dimless
    );
    implicitElastic_ = dict.numberOr
    (
        0, "implicitElastic", range::atLeast(0), dimless
    );
    if (compressible_ && implicitElastic_ > 0)
    {
        dict.refuse
        (
            "implicitElastic", "allowed in a compressible flow: 0; there waves"
            " of the fluid bound the step too"
        );
    }
    reportInterval_ = dict.integerOr(100, "reportInterval", 1);
    released_ =
        dict.choiceOr
        (
            "immersed", "type", wordList({"immersed", "partitioned"})
        )
     == "partitioned";
    if (!released_ && periFoam::gasMirror::needed(mesh_))
    {
        dict.refuse
        (
            "type", "allowed in a solver that takes no sources, such as"
            " rhoCentralFoam: partitioned"
        );
    }
    readRelease(dict);
    readKernel(dict);
    readPartitioned(dict);
    dict.finish();
}


void Foam::functionObjects::peridynamics::readKernel
(
    const periFoam::checkedDictionary& dict
)
{
    kernel_ = periFoam::kernel::find
    (
        dict.choiceOr
        (
            released_ ? "hat2" : "ib4", "kernel", periFoam::kernel::names()
        )
    );
    const word faceFlux("faceFlux"), cellCentred("cellCentred");
    const bool cells = released_ || compressible_;
    const word scheme
    (
        dict.choiceOr
        (
            cells ? cellCentred : faceFlux,
            "transfer",
            wordList({faceFlux, cellCentred})
        )
    );
    if (cells && scheme == faceFlux)
    {
        dict.refuse
        (
            "transfer",
            "allowed where bodies are partitioned or the flow is compressible: "
          + cellCentred
        );
    }
    transfer_.reset
    (
        new periFoam::transfer(mesh_, *kernel_, scheme == faceFlux)
    );
    phaseShare_ =
        (kernel_->halfWidth > 1 ? 1 : ofNarrowKernel)
       *(scheme == faceFlux || compressible_ ? 1 : ofCells);
}


void Foam::functionObjects::peridynamics::readRelease
(
    const periFoam::checkedDictionary& dict
)
{
    releaseTime_ = releaseDamage_ = GREAT;
    if (!dict.found("release"))
    {
        return;
    }
    if (released_)
    {
        dict.refuse("release", "allowed with type immersed only");
    }
    const periFoam::checkedDictionary when(dict.sub("release"));
    const word key(when.oneOf(wordList({"time", "damage"})));
    if (key == "time")
    {
        releaseTime_ = when.number(key, periFoam::range::any(), dimTime);
    }
    else
    {
        releaseDamage_ = when.number
        (
            key, periFoam::range::between(0, 1, false, true), dimless
        );
    }
    when.finish();
}


void Foam::functionObjects::peridynamics::readPartitioned
(
    const periFoam::checkedDictionary& dict
)
{
    using periFoam::range;
    for
    (
        const char* key :
        {"wall", "wallTemperature", "maxStep", "implicitDrag"}
    )
    {
        if (dict.found(key) && !everApart())
        {
            dict.refuse(key, "allowed with type partitioned or a release only");
        }
    }
    apartOptions_ = periFoam::partitioned::options
    {
        rhoInf_,
        dict.numberOr(0.8, "maxStep", range::between(0, 1, false, true), dimless),
        dict.choiceOr("noSlip", "wall", wordList({"noSlip", "slip"})) == "slip",
        dict.numberOr(1, "implicitDrag", range::between(0.5, 1, true, true), dimless),
        dict.numberOr(0, "wallTemperature", range::above(0), dimTemperature)
    };
    if
    (
        apartOptions_.implicitDrag != 1 && periFoam::gasMirror::needed(mesh_)
    )
    {
        dict.refuse
        (
            "implicitDrag", "allowed in a solver that takes no sources, such as"
            " rhoCentralFoam: 1"
        );
    }
    if (apartOptions_.temperature > 0 && !compressible_)
    {
        dict.refuse
        (
            "wallTemperature", "allowed in compressible flows only; this one"
            " has no temperature"
        );
    }
}


void Foam::functionObjects::peridynamics::readBodies()
{
    scene_.readBodies(&mesh_, rhoInf_);
    label moving = 0;
    for (const periFoam::solidBody& body : bodies_)
    {
        moving += body.nMoving();
    }
    position_.resize(moving);
    velocity_.resize(moving, vector::zero);
    meanVelocity_.resize(moving, vector::zero);
    force_.resize(moving, vector::zero);
    for (const periFoam::solidBody& body : bodies_)
    {
        if (body.hasHistory())
        {
            known_.resize(moving, vector::zero);
        }
    }
    bodyForce_.resize(bodies_.size(), vector::zero);
    impulse_.resize(bodies_.size(), vector::zero);
    if (everApart())
    {
        checkApart();
        apart_.reset
        (
            new periFoam::partitioned
            (
                mesh_,
                bodies_,
                released_ ? *kernel_ : *periFoam::kernel::find("hat2"),
                apartOptions_
            )
        );
        if (periFoam::gasMirror::needed(mesh_))
        {
            mirror_.reset
            (
                new periFoam::gasMirror
                (
                    mesh_, apartOptions_.slip, apartOptions_.temperature
                )
            );
        }
    }
    terms_.reset
    (
        new periFoam::solidTerms
        (
            mesh_, bodies_, transfer_(), rhoInf_, implicitElastic_
        )
    );
}


void Foam::functionObjects::peridynamics::checkApart() const
{
    for (const periFoam::solidBody& body : bodies_)
    {
        if (body.tethers().size())
        {
            body.dict().refuse
            (
                "holds",
                "allowed in bodies that are partitioned or released: those of"
                " type implicit"
            );
        }
        if (body.options().density <= rhoInf_)
        {
            body.dict().refuse
            (
                "density",
                "the density of a body that is partitioned or released is "
              + Foam::name(body.options().density)
              + "; allowed: above rhoInf, " + Foam::name(rhoInf_)
            );
        }
    }
}


void Foam::functionObjects::peridynamics::checkSpacing() const
{
    constexpr scalar rounding = 1.01;
    for (const periFoam::solidBody& body : bodies_)
    {
        scalar widest = 0;
        for (label p = 0; p < body.nMoving(); ++p)
        {
            widest = max(widest, body.view().spacing[p]);
        }
        reduce(widest, maxOp<scalar>());
        if (widest > rounding*apart_->smallestWidth())
        {
            OStringStream os;
            os  << "its points are up to " << widest << " m apart, and some of"
                << " the fluid's cells there " << apart_->smallestWidth()
                << " m wide, so that the fluid would pass between points;"
                << " allowed in bodies that are partitioned or released: a"
                << " mesh of the body no coarser than the fluid's";
            const periFoam::checkedDictionary top(scene_.properties());
            top.sub("bodies").refuse(body.name(), os.str());
        }
    }
}


void Foam::functionObjects::peridynamics::checkSolver() const
{
    const periFoam::checkedDictionary top(scene_.properties());
    const PtrList<fv::option>& sources = fv::options::New(mesh_);
    for (const fv::option& source : sources)
    {
        if (isA<fv::periFoamMomentumSource>(source))
        {
            FatalIOErrorInFunction(time_.controlDict())
                << "the function object " << name() << " would couple the"
                << " bodies that " << source.name() << " couples already;"
                << " allowed: one function object of type " << type()
                << exit(FatalIOError);
        }
    }
    const word solver(solverName());
    if (solversThatDoNot.found(solver))
    {
        failUnasked(solver + " does not ask");
    }
    const periFoam::checkedDictionary coupling(top.sub("coupling"));
    if (!foundObject<volVectorField>(UName_))
    {
        coupling.refuse
        (
            "U",
            "the solver " + solver + " has no velocity field " + UName_
        );
    }
    if (!foundObject<surfaceScalarField>(phiName_))
    {
        coupling.refuse("phi", "the solver has no flux field " + phiName_);
    }
    ITstream& ddt = mesh_.ddtScheme("ddt(" + UName_ + ")");
    ddt.rewind();
    const word scheme(ddt);
    ddt.rewind();
    if (scheme == "localEuler")
    {
        const periFoam::checkedDictionary schemes
        (
            mesh_.schemesDict().subDict("ddtSchemes")
        );
        schemes.refuse
        (
            "default",
            "bodies and flow go in one step; allowed: schemes without a step"
            " of each cell"
        );
    }
    if (!compressible_ && phi().dimensions() != dimVolume/dimTime)
    {
        OStringStream os;
        os  << phiName_ << " has the dimensions " << phi().dimensions()
            << "; allowed: those of a volume flux or a mass flux";
        coupling.refuse("phi", os.str());
    }
}


Foam::word Foam::functionObjects::peridynamics::solverName() const
{
    const word program(Foam::getEnv("FOAM_EXECUTABLE"));
    return
        program.empty() || program == "periCheck"
      ? time_.controlDict().lookupOrDefault<word>("application", "(unnamed)")
      : program;
}


void Foam::functionObjects::peridynamics::failUnasked(const string& what) const
{
    FatalIOErrorInFunction(time_.controlDict())
        << "the solver " << what.c_str() << " for momentum sources on "
        << UName_ << ", so that the solid would not act on the flow; allowed:"
        << " solvers that do, such as " << solversThatAsk
        << exit(FatalIOError);
}


void Foam::functionObjects::peridynamics::checkPlaces()
{
    forAll(bodies_, i)
    {
        const periFoam::solidBody& body = bodies_[i];
        pointField X(body.view().n_owned);
        label lost = -1;
        forAll(X, p)
        {
            X[p] = body.reference(p);
            const bool far =
               !transfer_->periodic() && !mesh_.bounds().contains(X[p]);
            lost = far && lost < 0 ? p : lost;
        }
        if (returnReduce(lost < 0, andOp<bool>()))
        {
            lost = transfer_->newHosting()->locate(X);
        }
        OStringStream os;
        if (lost >= 0)
        {
            os  << "cell " << label(body.view().id[lost]) << " of region "
                << body.name() << " at " << X[lost]
                << " lies outside the fluid mesh; allowed: within "
                << mesh_.bounds().min() << " to " << mesh_.bounds().max();
        }
        const string why(firstText(os.str()));
        if (!why.empty())
        {
            const periFoam::checkedDictionary top(scene_.properties());
            top.sub("bodies").refuse(body.name(), why);
        }
    }
    checkOverlap();
}


void Foam::functionObjects::peridynamics::checkOverlap() const
{
    for (label i = 0; i < bodies_.size(); ++i)
    {
        // The mesh of body i, to see whether it holds points of the others
        autoPtr<polyMesh> mesh;
        for (label j = 0; j < bodies_.size(); ++j)
        {
            if (i == j)
            {
                continue;
            }
            if (!mesh.valid())
            {
                mesh.reset
                (
                    new polyMesh
                    (
                        IOobject
                        (
                            bodies_[i].name(),
                            time_.constant(),
                            time_,
                            IOobject::MUST_READ
                        )
                    )
                );
            }
            const string why(overlap(mesh(), bodies_[j]));
            if (!why.empty())
            {
                const periFoam::checkedDictionary top(scene_.properties());
                top.sub("bodies").refuse
                (
                    bodies_[j].name(),
                    "it overlaps the body " + bodies_[i].name() + why
                  + "; allowed: bodies apart"
                );
            }
        }
    }
}


Foam::string Foam::functionObjects::peridynamics::overlap
(
    const polyMesh& mesh,
    const periFoam::solidBody& body
) const
{
    // Points of any rank may lie in this rank's part of the mesh
    DynamicList<point> near;
    for (label p = 0; p < body.view().n_owned; ++p)
    {
        if (mesh.bounds().contains(body.reference(p)))
        {
            near.append(body.reference(p));
        }
    }
    List<List<point>> all(Pstream::nProcs());
    all[Pstream::myProcNo()] = near;
    Pstream::gatherList(all);
    Pstream::scatterList(all);

    OStringStream os;
    for (const List<point>& ofRank : all)
    {
        for (const point& X : ofRank)
        {
            if
            (
                os.str().empty() && mesh.nCells()
             && mesh.findCell(X, polyMesh::FACE_PLANES) >= 0
            )
            {
                os << " at " << X;
            }
        }
    }
    return firstText(os.str());
}


void Foam::functionObjects::peridynamics::buildHolds()
{
    heldCells_.resize(bodies_.size());
    heldVolumes_.resize(bodies_.size());
    bool held = false;
    scalarField sum(mesh_.nCells(), Zero);
    forAll(bodies_, i)
    {
        bodies_[i].heldOver(transfer_(), heldCells_[i], heldVolumes_[i]);
        forAll(heldCells_[i], k)
        {
            sum[heldCells_[i][k]] += heldVolumes_[i][k];
        }
        held = held || heldCells_[i].size();
    }
    if (returnReduce(held, orOp<bool>()))
    {
        heldShare_ = min(sum/mesh_.V(), scalar(1));
    }
}


Foam::scalar Foam::functionObjects::peridynamics::holdTime() const
{
    // What elastic waves at rest take across the smallest cell
    scalar omega = 0;
    for (const periFoam::solidBody& body : bodies_)
    {
        if (body.nMoving())
        {
            omega = max(omega, fastest(body, false));
        }
    }
    reduce(omega, maxOp<scalar>());
    return omega > 0 ? 1/omega : 0;
}


void Foam::functionObjects::peridynamics::appendSource()
{
    fv::options& options = fv::options::New(mesh_);
    PtrList<fv::option>& list = options;
    wordList fields(1, UName_);
    for (const char* energy : {"e", "h"})
    {
        if (compressible_ && foundObject<volScalarField>(energy))
        {
            fields.append(energy);
        }
    }
    source_ = new fv::periFoamMomentumSource(name(), fields, mesh_, *this);
    list.append(source_);

    // A file that is edited during the run would be read again for every
    // source by name, this one too, which is in no file
    if (options.watchIndices().size())
    {
        options.watchIndices().clear();
        Info<< type() << " " << name() << ": edits of fvOptions take effect"
            << " at the next start, not during the run" << endl;
    }
}


void Foam::functionObjects::peridynamics::keepOldFields() const
{
    for (const word& name : mesh_.names<volScalarField>())
    {
        lookupObject<volScalarField>(name).oldTime();
    }
    U().oldTime();
    phi().oldTime();
}


Foam::scalar Foam::functionObjects::peridynamics::fastest
(
    const periFoam::solidBody& body,
    const bool stretched
) const
{
    const scalar c = Foam::sqrt
    (
        periFoam::solidTerms::stiffest(body, stretched, compressible_)
       /body.options().density
    );
    return kernel_->steepest*c/smallestWidth_;
}


Foam::scalar
Foam::functionObjects::peridynamics::levelOf(const label timeIndex) const
{
    return periFoam::forceLevel(mesh_, "ddt(" + UName_ + ")", timeIndex);
}


Foam::scalar Foam::functionObjects::peridynamics::smallestNu() const
{
    const word name("nu");
    return
        foundObject<volScalarField>(name)
      ? gMin(lookupObject<volScalarField>(name).primitiveField())
      : 0;
}


Foam::scalar Foam::functionObjects::peridynamics::stableStep
(
    const bool stretched
) const
{
    // The fastest motion is an elastic wave as short as the kernel lets
    // through, as much slower when a share of the elasticity is implicit
    if (released_)
    {
        return GREAT; // the flow's own bounds
    }
    const scalar nu = smallestNu();
    const scalar explicitShare =
        1 - 2*implicitElastic_/levelOf(max(time_.timeIndex(), 2));
    scalar step = GREAT;
    for (const periFoam::solidBody& body : bodies_)
    {
        if (body.nMoving() == 0)
        {
            continue;
        }
        step = min(step, body.springStep(rhoInf_));
        if (explicitShare > 0)
        {
            const scalar omega = fastest(body, stretched);
            const scalar damping =
                nu*rhoInf_/(body.options().density*sqr(smallestWidth_)*omega);
            step = min
            (
                step,
                phaseShare_
               *stablePhase(damping, body.options().density/rhoInf_)
               /(omega*Foam::sqrt(explicitShare))
            );
        }
    }
    reduce(step, minOp<scalar>()); // some ranks have no moving points
    return step;
}


void Foam::functionObjects::peridynamics::checkStep
(
    const bool capped
) const
{
    const scalar deltaT = time_.deltaTValue();
    if
    (
        allowUnstable_
     || capped
     || deltaT <= allowedExcess*stepAtRest_
    )
    {
        return;
    }
    const periFoam::checkedDictionary control(time_.controlDict());
    OStringStream os;
    os  << "the step that keeps the coupling stable is " << stepAtRest_
        << " s; allowed: at most " << allowedExcess << " times that, "
        << allowedExcess*stepAtRest_ << " s, or adjustTimeStep yes, or "
        << "allowUnstable yes in coupling";
    control.refuse("deltaT", os.str());
}


const Foam::volVectorField& Foam::functionObjects::peridynamics::U() const
{
    return lookupObject<volVectorField>(UName_);
}


const Foam::surfaceScalarField&
Foam::functionObjects::peridynamics::phi() const
{
    return lookupObject<surfaceScalarField>(phiName_);
}


template<class Type>
Foam::SubList<Type> Foam::functionObjects::peridynamics::ofBody
(
    List<Type>& all,
    const label bodyi
) const
{
    label start = 0;
    for (label i = 0; i < bodyi; ++i)
    {
        start += bodies_[i].nMoving();
    }
    return SubList<Type>(all, bodies_[bodyi].nMoving(), start);
}


Foam::label Foam::functionObjects::peridynamics::firstFarOff() const
{
    const point centre(mesh_.bounds().midpoint());
    const vector reach(mesh_.bounds().span());
    forAll(position_, p)
    {
        for (direction a = 0; a < 3; ++a)
        {
            const scalar x = position_[p][a];
            if
            (
               !std::isfinite(x)
            || (
                   !transfer_->periodic()
                && std::fabs(x - centre[a]) > reach[a]
                )
            )
            {
                return p;
            }
        }
    }
    return -1;
}


template<class Places>
void Foam::functionObjects::peridynamics::place
(
    const char* when,
    Places& places
)
{
    label start = 0;
    for (const periFoam::solidBody& body : bodies_)
    {
        for (label p = 0; p < body.nMoving(); ++p)
        {
            position_[start++] = body.position(p);
        }
    }
    label lost = firstFarOff();
    if (returnReduce(lost < 0, andOp<bool>()))
    {
        lost = places.locate(position_);
    }
    failure f{-1, -1, ""};
    if (lost >= 0)
    {
        f.bodyi = 0;
        label p = lost;
        while (p >= bodies_[f.bodyi].nMoving())
        {
            p -= bodies_[f.bodyi++].nMoving();
        }
        OStringStream os;
        os  << "the point left the fluid mesh " << when << ", for "
            << bodies_[f.bodyi].position(p);
        f.meshCell = bodies_[f.bodyi].view().id[p];
        f.cause = os.str();
    }
    endOn(f);
}


void Foam::functionObjects::peridynamics::moveBy
(
    const UList<vector>& v,
    const scalar share
)
{
    const scalar deltaT = time_.deltaTValue();
    const scalar time = time_.value() - (1 - share)*deltaT;
    label start = 0;
    for (periFoam::solidBody& body : bodies_)
    {
        body.moveBy
        (
            SubList<vector>(v, body.nMoving(), start), share*deltaT, time
        );
        start += body.nMoving();
    }
}


void Foam::functionObjects::peridynamics::findMeanVelocity()
{
    stopwatch watch(wall_, TRANSFER);
    transfer_->sample(U(), phi(), level_);
    transfer_->interpolate(meanVelocity_);
    const scalar late = 1/(2*level_);
    if (late != 1)
    {
        forAll(meanVelocity_, p)
        {
            meanVelocity_[p] =
                (1 - late)*velocity_[p] + late*meanVelocity_[p];
        }
    }
}


void Foam::functionObjects::peridynamics::beginStep()
{
    if (mesh_.changing())
    {
        FatalErrorInFunction
            << "the fluid mesh moves or changes; allowed: a fixed mesh"
            << exit(FatalError);
    }
    if (askedIndex_ > doneIndex_)
    {
        FatalErrorInFunction
            << "the function object " << name() << " was not executed after"
            << " the last step; allowed: no executeControl, executeInterval,"
            << " timeStart or timeEnd in its dictionary" << exit(FatalError);
    }
    askedIndex_ = time_.timeIndex();
    checkStep(false);
    release();
    if (released_)
    {
        moveApart();
        return;
    }
    level_ = levelOf(time_.timeIndex());
    forAll(known_, p)
    {
        known_[p] = time_.timeIndex() > 1 ? level_*velocity_[p] : vector::zero;
    }
    moveBy(velocity_, level_);
}


void Foam::functionObjects::peridynamics::release()
{
    if (released_ || !apart_.valid())
    {
        return;
    }
    const scalar before = time_.value() - time_.deltaTValue();
    if
    (
        before >= releaseTime_ - 1e-6*time_.deltaTValue()
     || (releaseDamage_ < GREAT && tooDamaged())
    )
    {
        released_ = true;
        startApart(before, false);
        stableStep_ = GREAT;
        Info<< type() << " " << name() << ": at t = " << periFoam::brief(before)
            << " s the bodies are released, and move by themselves from now on"
            << endl;
    }
}


void Foam::functionObjects::peridynamics::startApart
(
    const scalar time,
    const bool resumed
)
{
    pd_status status{};
    const label bodyi = apart_->begin(time, resumed, status);
    endOn(bodyi, status);
}


bool Foam::functionObjects::peridynamics::tooDamaged() const
{
    bool reached = false;
    for (const periFoam::solidBody& body : bodies_)
    {
        reached =
            reached
         || (body.canBreak() && max(body.damage()) >= releaseDamage_);
    }
    return returnReduce(reached, orOp<bool>());
}


void Foam::functionObjects::peridynamics::moveApart()
{
    const scalar deltaT = time_.deltaTValue();
    pd_status status{};
    label bodyi = -1;
    {
        stopwatch watch(wall_, SOLID);
        bodyi = apart_->move(time_.value() - deltaT, deltaT, status);
    }
    endOn(bodyi, status);
    stopwatch watch(wall_, TRANSFER);
    const label gone = transfer_->periodic() ? 0 : apart_->letGo();
    if (gone)
    {
        Info<< type() << " " << name() << ": at t = "
            << periFoam::brief(time_.value()) << " s " << gone
            << (gone == 1 ? " point" : " points")
            << " with less than half of their bonds left the fluid; let go"
            << endl;
    }
    place("after the bodies moved", apart_());
    apart_->cover(position_);
}


void Foam::functionObjects::peridynamics::evaluateForces()
{
    const scalar deltaT = time_.deltaTValue();
    {
        stopwatch watch(wall_, TRANSFER);
        place("where forces are taken", transfer_());
        transfer_->weigh(position_);
    }
    {
        stopwatch watch(wall_, SOLID);
        const scalar time = time_.value() - (1 - level_)*deltaT;
        pd_status status{};
        label bodyi = 0;
        for (; bodyi < bodies_.size() && status.code == PD_OK; ++bodyi)
        {
            periFoam::solidBody& body = bodies_[bodyi];
            body.dragAlong(deltaT, rhoInf_);
            status = body.setLoads(time);
            if (status.code == PD_OK)
            {
                SubList<vector> force(ofBody(force_, bodyi));
                status = body.forces(force);
            }
        }
        endOn(bodyi - 1, status);
    }
    stopwatch watch(wall_, TRANSFER);
    terms_->update();
    if (terms_->hasExcess())
    {
        List<vector> u(force_.size());
        transfer_->sample(U().oldTime(), phi().oldTime(), 1);
        transfer_->interpolate(u);

        // The points' velocities are those of where forces were taken in the
        // last step, which may have had another level
        const label index = time_.timeIndex();
        const scalar since =
            level_*deltaT
          + (index > 1 ? (1 - levelOf(index - 1))*time_.deltaT0Value() : 0);
        terms_->addConvection(u, velocity_, since, force_);
    }
    transfer_->spread(force_);
}


Foam::functionObjects::peridynamics::failure
Foam::functionObjects::peridynamics::firstWild()
{
    forAll(bodies_, i)
    {
        const SubList<vector> v(ofBody(meanVelocity_, i));
        forAll(v, p)
        {
            if
            (
               !std::isfinite(v[p].x())
            || !std::isfinite(v[p].y())
            || !std::isfinite(v[p].z())
            )
            {
                return failure
                {
                    i,
                    label(bodies_[i].view().id[p]),
                    "the velocity of the flow there is not finite"
                };
            }
        }
    }
    return failure{-1, -1, ""};
}


void Foam::functionObjects::peridynamics::advanceHistories
(
    const UList<vector>& v
)
{
    stopwatch watch(wall_, SOLID);
    List<vector> rest(v);
    forAll(rest, p)
    {
        rest[p] -= known_[p];
    }
    known_ = v;
    pd_status status{};
    label bodyi = 0;
    for (; bodyi < bodies_.size() && status.code == PD_OK; ++bodyi)
    {
        status = bodies_[bodyi].advance
        (
            ofBody(rest, bodyi), time_.deltaTValue()
        );
    }
    endOn(bodyi - 1, status);
}


void Foam::functionObjects::peridynamics::moveAlong()
{
    findMeanVelocity();
    endOn(firstWild());
    List<vector> before(velocity_);
    {
        stopwatch watch(wall_, TRANSFER);
        if (level_ != 1) // else it was sampled for the mean
        {
            transfer_->sample(U(), phi(), 1);
        }
        transfer_->interpolate(velocity_);
    }
    if (known_.size())
    {
        // To the y* of the next step: stresses are then of where forces are
        // taken
        const scalar next = levelOf(time_.timeIndex() + 1);
        List<vector> way(known_.size());
        forAll(way, p)
        {
            way[p] = meanVelocity_[p] + next*velocity_[p];
        }
        advanceHistories(way);
    }
    stopwatch watch(wall_, TRANSFER);
    moveBy(meanVelocity_, 1);
    place("at the end of the step", transfer_());
    findForces(before);
    forAll(bodies_, i)
    {
        bodies_[i].setVelocity(ofBody(velocity_, i));
    }
    if (transfer_->smallestWidth() < smallestWidth_)
    {
        smallestWidth_ = transfer_->smallestWidth(); // a body met finer cells
        stepAtRest_ = stableStep(false);
    }
    terms_->finish(U());
}


void Foam::functionObjects::peridynamics::findForces
(
    const UList<vector>& before
)
{
    const scalarField* rho =
        compressible_
      ? &lookupObject<volScalarField>("rho").primitiveField()
      : nullptr;
    const scalar deltaT = time_.deltaTValue();
    label p = 0;
    forAll(bodies_, i)
    {
        vector f(Zero);
        const scalar excess = bodies_[i].options().density - rhoInf_;
        for (label j = 0; j < bodies_[i].nMoving(); ++j, ++p)
        {
            f +=
                excess*bodies_[i].volume(j)/deltaT*(velocity_[p] - before[p])
              - force_[p];
        }
        forAll(heldCells_[i], k)
        {
            const label celli = heldCells_[i][k];
            f +=
                brake_*heldVolumes_[i][k]*(rho ? (*rho)[celli] : rhoInf_)
               *U()[celli];
        }
        bodyForce_[i] = returnReduce(f, sumOp<vector>());
    }
}


void Foam::functionObjects::peridynamics::stepMirrored()
{
    {
        // By the weights of where the solver found the bodies
        stopwatch watch(wall_, TRANSFER);
        apart_->react(mirror_->impulses());
    }
    beginStep();
    {
        stopwatch watch(wall_, TRANSFER);
        mirror_->reflect(apart_->shares(), apart_->solidVelocity());
    }
    finishStep();
}


void Foam::functionObjects::peridynamics::finishStep()
{
    if (released_)
    {
        stopwatch watch(wall_, TRANSFER);
        if (!mirror_.valid())
        {
            apart_->react(U());
        }
        forAll(bodies_, i)
        {
            bodyForce_[i] = apart_->force(i);
        }
    }
    else
    {
        moveAlong();
    }
    failure f{-1, -1, ""};
    forAll(bodies_, i)
    {
        impulse_[i] += time_.deltaTValue()*bodyForce_[i];
        bodies_[i].keep();
        if (!std::isfinite(mag(bodyForce_[i])))
        {
            f = failure{i, -1, "the force of the flow on it is not finite"};
        }
    }
    endOn(f);
    doneIndex_ = time_.timeIndex();
    doneTime_ = time_.value();
}


template<class GeoField>
void Foam::functionObjects::peridynamics::restoreOld() const
{
    // A field before its own old times, "U" before "U_0"
    for (const word& name : mesh_.sortedNames<GeoField>())
    {
        const GeoField& field = lookupObject<GeoField>(name);
        if (field.nOldTimes() > 0 && field.writeOpt() == IOobject::AUTO_WRITE)
        {
            const_cast<GeoField&>(field) == field.oldTime();
        }
    }
}


void Foam::functionObjects::peridynamics::endOn(const failure& mine)
{
    if (!returnReduce(mine.bodyi >= 0, orOp<bool>()))
    {
        return;
    }
    labelList bodies(Pstream::nProcs()), cells(bodies);
    stringList causes(bodies.size());
    bodies[Pstream::myProcNo()] = mine.bodyi;
    cells[Pstream::myProcNo()] = mine.meshCell;
    causes[Pstream::myProcNo()] = mine.cause;
    Pstream::gatherList(bodies);
    Pstream::scatterList(bodies);
    Pstream::gatherList(cells);
    Pstream::scatterList(cells);
    Pstream::gatherList(causes);
    Pstream::scatterList(causes);
    label rank = 0;
    while (bodies[rank] < 0)
    {
        ++rank;
    }
    fail(failure{bodies[rank], cells[rank], causes[rank]});
}


void Foam::functionObjects::peridynamics::endOn
(
    const label bodyi,
    const pd_status& status
)
{
    const bool well = status.code == PD_OK;
    endOn
    (
        failure
        {
            well ? -1 : bodyi,
            well ? -1 : label(status.point),
            well ? "" : status.message
        }
    );
}


void Foam::functionObjects::peridynamics::fail(const failure& f)
{
    const label step = time_.timeIndex();
    const scalar when = time_.value();
    string kept("nothing was computed before it");
    if (doneIndex_ > time_.startTimeIndex())
    {
        for (periFoam::solidBody& body : bodies_)
        {
            body.toStart();
        }
        restoreOld<volScalarField>();
        restoreOld<volVectorField>();
        restoreOld<surfaceScalarField>();
        Time& time = const_cast<Time&>(time_);
        if (time.writeTime() && isDir(time.timePath()))
        {
            rmDir(time.timePath()); // what the solver wrote of this step
        }
        time.setTime(doneTime_, doneIndex_);
        time.writeNow();
        updateCellFields();
        writeFields();
        kept =
            "the last good state is written to " + time.timeName()
          + ", to be looked at; periResume tells where to go on";
    }
    OStringStream rest;
    rest<< "Stable step " << stableStep_ << " s, deltaT "
        << time_.deltaTValue() << " s; " << kept.c_str();
    report_->fail(f.bodyi, f.meshCell, f.cause, step, when, rest.str());
}


void Foam::functionObjects::peridynamics::keepState()
{
    periFoam::notes all;
    all.number("time", time_.value());
    all.integer("step", time_.timeIndex());
    all.number("smallestWidth", smallestWidth_);
    all.number("stableStep", stableStep_);
    all.number("holdTime", holdTime_);
    all.integer("released", released_);
    scene_.save(all);
}


bool Foam::functionObjects::peridynamics::resume()
{
    periFoam::notes all;
    all.number("time");
    all.integer("step");
    all.number("smallestWidth");
    all.number("stableStep");
    all.number("holdTime");
    all.integer("released");
    if (!scene_.load(all))
    {
        return false;
    }
    // To the last bit, which the name of the time does not have
    const_cast<Time&>(time_).setTime(all.numberAt(0), label(all.integerAt(1)));
    askedIndex_ = doneIndex_ = time_.timeIndex();
    doneTime_ = time_.value();
    smallestWidth_ = all.numberAt(2);
    stableStep_ = all.numberAt(3);
    holdTime_ = all.numberAt(4);
    released_ = all.integerAt(5);
    return true;
}


void Foam::functionObjects::peridynamics::startVelocities(const bool resumed)
{
    if (!resumed)
    {
        transfer_->sample(U(), phi(), 1);
        transfer_->interpolate(velocity_);
    }
    label p = 0;
    forAll(bodies_, i)
    {
        if (!resumed)
        {
            bodies_[i].setVelocity(ofBody(velocity_, i));
            continue;
        }
        for (label j = 0; j < bodies_[i].nMoving(); ++j)
        {
            velocity_[p++] = bodies_[i].velocity(j);
        }
    }
}


void Foam::functionObjects::peridynamics::announce() const
{
    Info<< nl << type() << " " << name() << ": coupled to " << solverName()
        << " through " << UName_ << " and " << phiName_
        << ", kernel " << kernel_->name;
    if (!kernel_->evenOdd && !released_)
    {
        Info<< " (not even-odd: look for a checkerboard in p)";
    }
    Info<< nl;
    report_->announce();
    Info<< "    stable step ";
    if (stableStep_ < GREAT)
    {
        Info<< periFoam::brief(stableStep_) << " s";
    }
    else
    {
        Info<< "unbounded";
    }
    Info<< ", deltaT " << periFoam::brief(time_.deltaTValue()) << " s"
        << nl << endl;
}


Foam::volScalarField& Foam::functionObjects::peridynamics::cellField
(
    const word& name
) const
{
    if (!foundObject<volScalarField>(name))
    {
        // Not AUTO_WRITE: solvers write before this is up to date
        regIOobject::store
        (
            new volScalarField
            (
                IOobject(name, time_.timeName(), mesh_),
                mesh_,
                dimensionedScalar(dimless, Zero),
                zeroGradientFvPatchScalarField::typeName
            )
        );
    }
    return lookupObjectRef<volScalarField>(name);
}


void Foam::functionObjects::peridynamics::updateCellFields()
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
    }
    volScalarField& solidFraction = cellField("solidFraction");
    volScalarField& damage = cellField("damage");
    scalarField& solid = solidFraction.primitiveFieldRef();
    transfer_->spreadAmount(place, volume, solid);
    transfer_->spreadAmount(place, damaged, damage.primitiveFieldRef());
    forAll(solid, celli)
    {
        damage[celli] = solid[celli] > 0 ? damage[celli]/solid[celli] : 0;
    }
    solid /= mesh_.V();
    solidFraction.correctBoundaryConditions();
    damage.correctBoundaryConditions();
}


void Foam::functionObjects::peridynamics::writeFields() const
{
    if (scene_.writesFields())
    {
        for (const periFoam::solidBody& body : bodies_)
        {
            periFoam::writePointCloud(mesh_, transfer_(), body);
        }
    }
    scene_.writePictures(name());
    for (const char* field : {"solidFraction", "damage"})
    {
        volScalarField& written = cellField(field);
        written.instance() = time_.timeName();
        written.write();
    }
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::functionObjects::peridynamics::peridynamics
(
    const word& name,
    const Time& runTime,
    const dictionary& dict
)
:
    peridynamics(name, runTime, dict, false)
{}


Foam::functionObjects::peridynamics::peridynamics
(
    const word& name,
    const Time& runTime,
    const dictionary& dict,
    const bool dry
)
:
    fvMeshFunctionObject(endingOnErrors(name, runTime, dict), runTime, dict),
    scene_(runTime),
    kernel_(nullptr),
    bodies_(scene_.bodies()),
    phaseShare_(1),
    implicitElastic_(0),
    released_(false),
    releaseTime_(GREAT),
    releaseDamage_(GREAT),
    level_(0.5),
    brake_(0),
    source_(nullptr),
    askedIndex_(runTime.timeIndex()),
    doneIndex_(runTime.timeIndex()),
    doneTime_(runTime.value()),
    stableStep_(GREAT),
    stepAtRest_(GREAT),
    holdTime_(0),
    smallestWidth_(GREAT),
    capping_(false),
    wall_(wordList({"solid", "transfer", "output", "flow"}))
{
    if (postProcess)
    {
        return; // nothing moves
    }
    checkFunctionKeys(dict);
    readCoupling();
    checkSolver();
    readBodies();
    checkPlaces();
    const bool resumed = resume();
    place("before the first step", transfer_());
    transfer_->weigh(position_);
    if (released_)
    {
        startApart(time_.value(), resumed);
    }
    startVelocities(resumed);
    if (apart_.valid())
    {
        place("before the first step", apart_());
        apart_->cover(position_);
        checkSpacing();
    }
    if (mirror_.valid() && !dry)
    {
        mirror_->reflect(apart_->shares(), apart_->solidVelocity());
    }
    smallestWidth_ = min(smallestWidth_, transfer_->smallestWidth());
    stepAtRest_ = stableStep(false);
    if (!resumed)
    {
        holdTime_ = holdTime();
        stableStep_ = stepAtRest_;
    }
    if (!released_)
    {
        buildHolds();
    }
    checkStep(time_.isAdjustTimeStep());
    appendSource();
    keepOldFields();
    report_.reset
    (
        new periFoam::report
        (
            scene_, mesh_, name, type() + (" " + name), wall_, !dry
        )
    );
    report_->addForceTables();
    announce();
    updateCellFields();
    if (!resumed && !dry)
    {
        writeFields();
    }
    wall_.start();
}


// * * * * * * * * * * * * * * * * Destructor  * * * * * * * * * * * * * * * //

Foam::functionObjects::peridynamics::~peridynamics()
{
    // At the end of the run the mesh, and with it the source, is gone already
    if (time_.foundObject<fvMesh>(mesh_.name()) && source_)
    {
        source_->detach();
    }
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

void Foam::functionObjects::peridynamics::addForce
(
    fvMatrix<vector>& eqn,
    const volScalarField* rho
)
{
    if (time_.timeIndex() > doneIndex_)
    {
        const bool corrector = askedIndex_ == time_.timeIndex();
        if (!corrector)
        {
            beginStep();
        }
        else if (!released_)
        {
            findMeanVelocity();
            if (known_.size())
            {
                List<vector> way(meanVelocity_);
                for (vector& v : way)
                {
                    v *= level_;
                }
                advanceHistories(way);
            }
            moveBy(meanVelocity_, level_);
        }
        if (!released_)
        {
            evaluateForces();
        }
    }

    stopwatch watch(wall_, TRANSFER);
    if (released_)
    {
        apart_->add(eqn, rho);
        return;
    }
    brake_ = holdStrength_/(holdTime_ > 0 ? holdTime_ : time_.deltaTValue());
    terms_->add(eqn, rho, brake_*heldShare_);
}


void Foam::functionObjects::peridynamics::addPower(fvMatrix<scalar>& eqn)
{
    stopwatch watch(wall_, TRANSFER);
    if (released_)
    {
        apart_->addPower(eqn, U());
    }
    else
    {
        eqn.source() -= terms_->power(U());
    }
}


Foam::scalar Foam::functionObjects::peridynamics::secondsPerStep()
{
    constexpr label times = 3;
    const label forces =
        released_ ? apart_->substeps(time_.deltaTValue()) : 1;
    scalar solid = 0;
    const scalar before = wall_.total();
    for (label k = 0; k < times; ++k)
    {
        const scalar start = wall_.total();
        for (periFoam::solidBody& body : bodies_)
        {
            body.begin(time_.value());
        }
        solid += wall_.total() - start;
        place("before the first step", transfer_());
        transfer_->weigh(position_);
        transfer_->sample(U(), phi(), 1);
        transfer_->interpolate(velocity_);
        transfer_->spread(force_);
    }
    return (wall_.total() - before + (forces - 1)*solid)/times;
}


bool Foam::functionObjects::peridynamics::adjustTimeStep()
{
    if
    (
        !capping_
     && time_.isAdjustTimeStep()
     && time_.deltaTValue() > stableStep_
    )
    {
        // Time divides what is left until the next write time anew, which
        // may stretch the step, and asks all function objects again
        capping_ = true;
        scalar target = stableStep_;
        do
        {
            const_cast<Time&>(time_).setDeltaT(target);
            target *= 0.9;
        }
        while (time_.deltaTValue() > stableStep_);
        capping_ = false;
    }
    return true;
}


bool Foam::functionObjects::peridynamics::read(const dictionary& dict)
{
    checkFunctionKeys(dict);
    return fvMeshFunctionObject::read(dict);
}


bool Foam::functionObjects::peridynamics::execute()
{
    if (postProcess || doneIndex_ == time_.timeIndex())
    {
        return true;
    }
    if (mirror_.valid())
    {
        stepMirrored();
    }
    else if (askedIndex_ == time_.timeIndex())
    {
        finishStep();
    }
    else
    {
        failUnasked
        (
            solverName() + " did not ask in step "
          + Foam::name(time_.timeIndex())
        );
    }

    stopwatch watch(wall_, OUTPUT);
    const label step = time_.timeIndex();
    const label interval = scene_.cellFieldInterval();
    if (time_.writeTime() || (interval && step % interval == 0))
    {
        updateCellFields();
    }
    if (step % outputInterval_ == 0 || time_.isAdjustTimeStep())
    {
        stableStep_ = stableStep(true);
    }
    if (step % outputInterval_ == 0)
    {
        report_->writeRows
        (
            released_ ? apart_->stableStep() : stableStep_
        );
        report_->writeForces(bodyForce_, impulse_);
    }
    if (step % reportInterval_ == 0)
    {
        report_->progress
        (
            released_
          ? "substeps " + Foam::name(apart_->substeps(time_.deltaTValue()))
          : "stable step/deltaT "
          + periFoam::brief(stableStep_/time_.deltaTValue())
        );
    }
    return true;
}


bool Foam::functionObjects::peridynamics::write()
{
    if
    (
       !postProcess && time_.writeTime() && doneIndex_ == time_.timeIndex()
    )
    {
        stopwatch watch(wall_, OUTPUT);
        writeFields();
        keepState();
        terms_->write();
    }
    return true;
}


// ************************************************************************* //
