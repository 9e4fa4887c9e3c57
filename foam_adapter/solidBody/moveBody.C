/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

Description
    How a body moves by itself, without a fluid; and what motions do in one.

\*---------------------------------------------------------------------------*/

#include "solidBody.H"
#include "boundBox.H"

#include <cmath>

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

//- Points that have lost this share of their bonds may leave the fluid
constexpr Foam::scalar debris = 0.5;

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoam::solidBody::setMotions(const scalar time)
{
    const label d = view_.dimension;
    forAll(motions_, i)
    {
        motion& m = motions_[i];
        m.moveTo(time);
        forAll(m.points(), k)
        {
            const point x(m.place(reference(m.points()[k])));
            for (label a = 0; a < d; ++a)
            {
                if (m.axes().found(directions_[a]))
                {
                    prescribedPlace_[prescribedOf_[i][k]*d + a] =
                        x[directions_[a]];
                }
            }
        }
    }
}


pd_prescribed Foam::periFoam::solidBody::prescribed() const
{
    pd_prescribed p{};
    p.n = prescribedPoint_.size();
    p.point = prescribedPoint_.cdata();
    p.components = prescribedAxes_.cdata();
    p.y = prescribedPlace_.cdata();
    return p;
}


void Foam::periFoam::solidBody::placeMotions(const scalar time)
{
    setMotions(time);
    const label d = view_.dimension;
    forAll(prescribedPoint_, k)
    {
        for (label a = 0; a < d; ++a)
        {
            if (prescribedAxes_[k] & (1 << a))
            {
                view_.y[prescribedPoint_[k]*d + a] = prescribedPlace_[k*d + a];
            }
        }
    }
}


void Foam::periFoam::solidBody::setPulls(UList<vector>& force)
{
    const label d = view_.dimension;
    forAll(prescribedPoint_, k)
    {
        const label p = prescribedPoint_[k];
        for (label a = 0; a < d; ++a)
        {
            if (prescribedAxes_[k] & (1 << a))
            {
                const label at = k*d + a;
                pull_[at] = dragging_*(pullVelocity_[at] - view_.v[p*d + a]);
                force[p][directions_[a]] = volume(p)*pull_[at];
            }
        }
    }
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

void Foam::periFoam::solidBody::dragAlong
(
    const scalar deltaT,
    const scalar rho
)
{
    const label d = view_.dimension;

    // A quarter of what an explicit drag may be
    dragging_ = min(rho, options().density)/(2*deltaT);
    forAll(motions_, i)
    {
        motion& m = motions_[i];
        m.findVelocity(deltaT);
        forAll(m.points(), k)
        {
            const vector v(m.velocity(reference(m.points()[k])));
            for (label a = 0; a < d; ++a)
            {
                if (m.axes().found(directions_[a]))
                {
                    pullVelocity_[prescribedOf_[i][k]*d + a] =
                        v[directions_[a]];
                }
            }
        }
    }
}


void Foam::periFoam::solidBody::keep()
{
    const label size = view_.n_moving*view_.dimension;
    start_.resize(size);
    std::copy(view_.y, view_.y + size, start_.begin());
    if (alone_)
    {
        startVelocity_.resize(size);
        std::copy(view_.v, view_.v + size, startVelocity_.begin());
    }
}


void Foam::periFoam::solidBody::toStart()
{
    std::copy(start_.begin(), start_.end(), view_.y);
    std::copy(startVelocity_.begin(), startVelocity_.end(), view_.v);
}


pd_status Foam::periFoam::solidBody::begin(const scalar time)
{
    const pd_status status = setLoads(time);
    return status.code == PD_OK ? pd_body_forces(body_) : status;
}


void Foam::periFoam::solidBody::release(const scalar inertia)
{
    alone_ = true;
    const pd_status status = pd_body_set_inertia(body_, inertia);
    if (status.code != PD_OK)
    {
        FatalErrorInFunction
            << "body " << name_ << ": " << status.message << exit(FatalError);
    }
}


Foam::labelList Foam::periFoam::solidBody::driven() const
{
    DynamicList<label> points;
    forAll(prescribedPoint_, k)
    {
        if (prescribedAxes_[k] == (1 << view_.dimension) - 1)
        {
            points.append(prescribedPoint_[k]);
        }
    }
    return labelList(std::move(points));
}


void Foam::periFoam::solidBody::stopAt
(
    const boundBox& box,
    const FixedList<bool, 6>& sides
)
{
    const label d = view_.dimension;
    const scalar m = options().horizon_ratio;
    for (label a = 0; a < d; ++a)
    {
        const direction axis = directions_[a];
        const scalar inside = 1e-6*box.span()[axis];
        for (label side = 0; side < 2; ++side)
        {
            if (!sides[2*axis + side])
            {
                continue;
            }
            const scalar sign = side ? 1 : -1;
            const scalar wall =
                (side ? box.max() : box.min())[axis] - sign*inside;
            for (label p = 0; p < view_.n_moving; ++p)
            {
                scalar& y = view_.y[p*d + a];
                scalar& v = view_.v[p*d + a];
                const scalar beyond = sign*(y - wall);
                if (beyond > 0 && beyond <= m*view_.spacing[p])
                {
                    y = wall;
                    v = sign*min(sign*v, scalar(0));
                }
            }
        }
    }
}


Foam::labelList Foam::periFoam::solidBody::letGo(const boundBox& box)
{
    const label d = view_.dimension;
    const auto stay = [&](const label p)
    {
        std::copy(&start_[p*d], &start_[p*d] + d, view_.y + p*d);
        std::fill(view_.v + p*d, view_.v + (p + 1)*d, 0);
    };
    for (const label p : gone_)
    {
        stay(p);
    }
    DynamicList<label> outside, left;
    for (label p = 0; canBreak() && p < view_.n_moving; ++p)
    {
        const point x(position(p));
        if (!box.contains(x) && std::isfinite(mag(x)))
        {
            outside.append(p);
        }
    }
    if (returnReduce(outside.empty(), andOp<bool>()))
    {
        return left;
    }
    const scalarField phi(damage());
    for (const label p : outside)
    {
        if (phi[p] >= debris)
        {
            left.append(p);
            stay(p);
        }
    }
    gone_.append(left);
    return left;
}


const Foam::labelList& Foam::periFoam::solidBody::findGone()
{
    DynamicList<label> found;
    if (canBreak())
    {
        const scalarField phi(damage());
        for (label p = 0; p < view_.n_moving; ++p)
        {
            if
            (
                phi[p] >= debris
             && velocity(p) == vector::zero && position(p) != reference(p)
            )
            {
                found.append(p);
            }
        }
    }
    gone_ = found;
    return gone_;
}


void Foam::periFoam::solidBody::kick
(
    const UList<vector>& change,
    const UList<scalar>& mass,
    const scalar deltaT
)
{
    const label d = view_.dimension;
    forAll(prescribedPoint_, k)
    {
        const label p = prescribedPoint_[k];
        for (label a = 0; a < d; ++a)
        {
            if (prescribedAxes_[k] & (1 << a))
            {
                const scalar kicked = change[p][directions_[a]];
                pull_[k*d + a] = -mass[p]/volume(p)*kicked/deltaT;
                view_.v[p*d + a] -= kicked;
            }
        }
    }
    for (label p = 0; p < view_.n_moving; ++p)
    {
        for (label a = 0; a < d; ++a)
        {
            view_.v[p*d + a] += change[p][directions_[a]];
        }
    }
}


pd_status Foam::periFoam::solidBody::step
(
    const pd_integrator& integrator,
    const scalar deltaT,
    const scalar time
)
{
    setMotions(time);
    pd_status status = setLoads(time);
    if (status.code == PD_OK)
    {
        const pd_prescribed motions(prescribed());
        status = pd_body_step(body_, &integrator, deltaT, &motions);
    }
    return status;
}


pd_status Foam::periFoam::solidBody::relax
(
    const scalar time,
    relaxation& r,
    const std::function<void(const relaxation&)>& told
)
{
    setMotions(time);
    const pd_prescribed motions(prescribed());
    pd_status status = setLoads(time);
    pd_relaxation* state = nullptr;
    if (status.code == PD_OK)
    {
        status = pd_relaxation_create(body_, &state);
    }
    r.residual = GREAT;
    r.iterations = 0;
    while
    (
        status.code == PD_OK
     && r.residual > r.tolerance
     && r.iterations < r.maxIterations
    )
    {
        ++r.iterations;
        status = pd_relaxation_step(state, &motions, &r.residual);
        told(r);
    }
    pd_relaxation_destroy(state);
    return status;
}


void Foam::periFoam::solidBody::reaction
(
    const label motioni,
    vector& force,
    vector& displacement
) const
{
    force = displacement = vector::zero;
    const label d = view_.dimension;
    const motion& m = motions_[motioni];
    forAll(m.points(), k)
    {
        const label p = m.points()[k], at = prescribedOf_[motioni][k]*d;
        displacement += position(p) - reference(p);
        for (label a = 0; a < d; ++a)
        {
            const label axis = directions_[a];
            if (m.axes().found(axis))
            {
                force[axis] +=
                    volume(p)
                   *((fluid_ ? pull_[at + a] : 0) - view_.force[p*d + a]);
            }
        }
    }
    reduce(force, sumOp<vector>());
    reduce(displacement, sumOp<vector>());
    displacement /= max(returnReduce(m.points().size(), sumOp<label>()), 1);
}


// ************************************************************************* //
