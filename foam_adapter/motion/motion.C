/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "motion.H"
#include "quaternion.H"
#include "sigFpe.H"

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

const Foam::wordList keptNames
({
    "start", "time", "moved_x", "moved_y", "moved_z"
});

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoam::motion::readAxes
(
    const checkedDictionary& dict,
    const labelList& directions
)
{
    axes_ = directions;
    if (dict.found("components"))
    {
        const wordList names({"x", "y", "z"});
        wordList allowed(directions.size());
        forAll(directions, a)
        {
            allowed[a] = names[directions[a]];
        }
        const wordList given(dict.choices("components", allowed));
        axes_.resize(given.size());
        forAll(given, i)
        {
            axes_[i] = names.find(given[i]);
        }
        inplaceUniqueSort(axes_);
    }
}


void Foam::periFoam::motion::readRotation
(
    const checkedDictionary& dict,
    const labelList& directions
)
{
    origin_ = dict.vectorOf("origin", dimLength);
    axis_ = dict.vectorOf("axis", dimless);
    if (mag(axis_) < VSMALL)
    {
        dict.refuse("axis", "allowed: a vector that is not zero");
    }
    axis_ /= mag(axis_);
    if (directions.size() == 1)
    {
        dict.refuse("type", "allowed in one dimension: a motion along it");
    }
    for (const label a : directions)
    {
        if (directions.size() == 2 && mag(axis_[a]) > 1e-9)
        {
            dict.refuse
            (
                "axis",
                "allowed in two dimensions: an axis across their plane"
            );
        }
    }
    angle_ = dict.function<scalar>("angle");
}


Foam::vector Foam::periFoam::motion::travelled(const scalar time) const
{
    if (velocity_->type() == "constant")
    {
        // From the start anew, so that nothing adds up over many steps
        return velocity_->value(time)*(time - start_);
    }
    // Simpson's rule. Not Function1::integrate, which few types have
    const label parts = 4;
    const scalar h = (time - time_)/parts;
    vector sum(moved_);
    for (label i = 0; i < parts; ++i)
    {
        const scalar t = time_ + i*h;
        sum +=
            h/6
           *(
                velocity_->value(t)
              + 4*velocity_->value(t + h/2)
              + velocity_->value(t + h)
            );
    }
    return sum;
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::motion::motion
(
    const word& name,
    const checkedDictionary& dict,
    const labelList& directions,
    const scalar startTime
)
:
    name_(name),
    origin_(Zero),
    axis_(Zero),
    time_(startTime),
    moved_(Zero),
    turned_(tensor::I),
    speed_(Zero),
    spin_(Zero),
    start_(startTime)
{
    const word type
    (
        dict.choice
        (
            "type",
            wordList({"velocity", "displacement", "rotation", "fixed"})
        )
    );
    readAxes(dict, directions);
    if (type == "velocity")
    {
        velocity_ = dict.function<vector>("value");
    }
    else if (type == "displacement")
    {
        displacement_ = dict.function<vector>("value");
    }
    else if (type == "rotation")
    {
        readRotation(dict, directions);
    }
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

void Foam::periFoam::motion::moveTo(const scalar time)
{
    const sigFpe::ignore untrapped; // places that are no numbers are refused
    if (velocity_.valid())
    {
        moved_ = travelled(time);
    }
    else if (displacement_.valid())
    {
        moved_ = displacement_->value(time);
    }
    else if (angle_.valid())
    {
        turned_ = quaternion(axis_, angle_->value(time)).R();
    }
    time_ = time;
}


void Foam::periFoam::motion::findVelocity(const scalar deltaT)
{
    const sigFpe::ignore untrapped; // as in moveTo
    const scalar before = max(time_ - deltaT, start_);
    if (velocity_.valid())
    {
        speed_ = velocity_->value(time_);
    }
    else if (before < time_ && displacement_.valid())
    {
        speed_ = (moved_ - displacement_->value(before))/(time_ - before);
    }
    else if (before < time_ && angle_.valid())
    {
        const tensor then(quaternion(axis_, angle_->value(before)).R());
        spin_ = (turned_ - then)/(time_ - before);
    }
}


void Foam::periFoam::motion::keep(notes& all) const
{
    const scalar values[] =
        {start_, time_, moved_.x(), moved_.y(), moved_.z()};
    forAll(keptNames, k)
    {
        all.number("motion." + name_ + "." + keptNames[k], values[k]);
    }
}


void Foam::periFoam::motion::expect(notes& all) const
{
    for (const word& kept : keptNames)
    {
        all.number("motion." + name_ + "." + kept);
    }
}


void Foam::periFoam::motion::resume(const notes& all, label& next)
{
    start_ = all.numberAt(next++);
    time_ = all.numberAt(next++);
    for (direction a = 0; a < 3; ++a)
    {
        moved_[a] = all.numberAt(next++);
    }
}


// ************************************************************************* //
