/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "hosting.H"

#include <algorithm>
#include <tuple>

// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

bool Foam::periFoam::hosting::answer::operator<(const answer& other) const
{
    return
        std::tie(how, image, rank)
      < std::tie(other.how, other.image, other.rank);
}


void Foam::periFoam::hosting::pack(const guest& g, parcel& to)
{
    to.labels.append(g.owner);
    to.labels.append(g.index);
    to.labels.append(g.cell);
    for (direction a = 0; a < 3; ++a)
    {
        to.labels.append(g.turns[a]);
    }
    to.add(g.place);
}


Foam::periFoam::hosting::guest Foam::periFoam::hosting::unpack
(
    parcelReader& from
)
{
    guest g;
    g.owner = from.getLabel();
    g.index = from.getLabel();
    g.cell = from.getLabel();
    for (direction a = 0; a < 3; ++a)
    {
        g.turns[a] = from.getLabel();
    }
    g.place = from.getVector();
    return g;
}


bool Foam::periFoam::hosting::settle(guest& g, changes& c) const
{
    // Warped faces may lead a walk in circles, through cyclic patches too
    const label mostCrossings = 20;
    for (label crossing = 0; crossing < mostCrossings; ++crossing)
    {
        if (stencils_ && stencils_->inside(g.place, g.cell))
        {
            return true;
        }
        const locator::walk w(locator_.walkTo(g.place, g.cell));
        c.near = w.last;
        if (w.cell >= 0)
        {
            g.cell = w.cell;
            return true;
        }
        if (w.exit < 0 || !halo_->coupled(w.exit))
        {
            break;
        }

        // What is seen behind a patch is shifted by its turns
        const halo::key& behind = halo_->otherCell(w.exit);
        g.place -= halo_->shift(behind.turns);
        g.turns -= behind.turns;
        g.cell = behind.index;
        if (behind.rank != Pstream::myProcNo())
        {
            pack(g, c.leaving[behind.rank]);
            return false;
        }
    }
    c.strays.append(g);
    return false;
}


void Foam::periFoam::hosting::start(const UList<point>& x, changes& c)
{
    // Neighbours in the list are neighbours in space
    guests_.clear();
    forAll(x, p)
    {
        const labelVector turns(halo_->turnsInto(x[p]));
        guest g
        {
            Pstream::myProcNo(), p, x[p] + halo_->shift(turns), turns, c.near
        };
        if (mesh_.nCells() == 0)
        {
            c.strays.append(g);
        }
        else if (settle(g, c))
        {
            guests_.push_back(g);
        }
    }
}


void Foam::periFoam::hosting::follow(const UList<point>& x, changes& c)
{
    const List<point> position(toHosts(x));
    std::size_t staying = 0;
    forAll(position, i)
    {
        guest& g = guests_[i];
        g.place = position[i];
        if (halo_->nPeriods())
        {
            g.place += halo_->shift(g.turns);
        }
        if (settle(g, c))
        {
            guests_[staying++] = g;
        }
    }
    guests_.resize(staying);
}


void Foam::periFoam::hosting::travel(changes& c)
{
    label roundsLeft = 2*Pstream::nProcs() + 10;
    while (true)
    {
        label travelling = 0;
        for (const parcel& p : c.leaving)
        {
            travelling += p.labels.size();
        }
        reduce(travelling, sumOp<label>());
        if (!travelling)
        {
            return;
        }
        List<parcel> arrived;
        if (roundsLeft-- > 0)
        {
            arrived = deliver(c.leaving);
        }
        else
        {
            arrived.transfer(c.leaving); // in circles: left to the search
        }
        c.leaving = List<parcel>(Pstream::nProcs());
        for (const parcel& p : arrived)
        {
            parcelReader from(p);
            while (!from.ended())
            {
                guest g(unpack(from));
                if (roundsLeft < 0)
                {
                    c.strays.append(g);
                }
                else if (settle(g, c))
                {
                    guests_.push_back(g);
                }
            }
        }
    }
}


Foam::List<Foam::labelVector> Foam::periFoam::hosting::images
(
    const guest& g
) const
{
    // The box around the mesh may be larger than a period
    DynamicList<labelVector> all;
    all.append(halo_->turnsInto(g.place - halo_->shift(g.turns)));
    for (label i = 0; i < halo_->nPeriods(); ++i)
    {
        for (label n = all.size(), k = 0; k < n; ++k)
        {
            for (const label turn : {-1, 1})
            {
                labelVector image(all[k]);
                image[i] += turn;
                all.append(image);
            }
        }
    }
    return List<labelVector>(std::move(all));
}


Foam::List<Foam::periFoam::hosting::answer> Foam::periFoam::hosting::ask
(
    const DynamicList<guest>& strays
) const
{
    List<parcel> questions(Pstream::nProcs());
    forAll(strays, i)
    {
        const guest& g = strays[i];
        const List<labelVector> turns(images(g));
        forAll(turns, image)
        {
            const point x(g.place + halo_->shift(turns[image] - g.turns));
            forAll(questions, rank)
            {
                boundBox box(halo_->rankBox(rank));
                const vector slack(1e-6*box.mag()*vector::one);
                box.min() -= slack;
                box.max() += slack;
                if (box.contains(x))
                {
                    questions[rank].labels.append(i);
                    questions[rank].labels.append(image);
                    questions[rank].add(x);
                }
            }
        }
    }

    List<parcel> answers(Pstream::nProcs());
    const List<parcel> asked(deliver(questions));
    forAll(asked, rank)
    {
        parcelReader from(asked[rank]);
        while (!from.ended())
        {
            const label stray = from.getLabel(), image = from.getLabel();
            const point x(from.getVector());
            label how = 0, celli = locator_.search(x);
            if (celli < 0)
            {
                how = 1;
                celli = locator_.nearest(x);
            }
            if (celli >= 0)
            {
                for (const label number : {stray, how, image, celli})
                {
                    answers[rank].labels.append(number);
                }
            }
        }
    }

    List<answer> best(strays.size(), answer{2, -1, -1, -1});
    const List<parcel> answered(deliver(answers));
    forAll(answered, rank)
    {
        parcelReader from(answered[rank]);
        while (!from.ended())
        {
            const label stray = from.getLabel(), how = from.getLabel();
            const label image = from.getLabel(), celli = from.getLabel();
            best[stray] =
                std::min(best[stray], answer{how, image, rank, celli});
        }
    }
    return best;
}


void Foam::periFoam::hosting::search(changes& c)
{
    label n = c.strays.size();
    reduce(n, sumOp<label>());
    if (!n)
    {
        complete_ = true;
        return;
    }
    const List<answer> best(ask(c.strays));
    List<parcel> found(Pstream::nProcs());
    forAll(c.strays, i)
    {
        guest g(c.strays[i]);
        if (best[i].rank < 0)
        {
            c.lost.append(g);
            continue;
        }
        const labelVector turns(images(g)[best[i].image]);
        g.place += halo_->shift(turns - g.turns);
        g.turns = turns;
        g.cell = best[i].cell;
        pack(g, found[best[i].rank]);
    }
    for (const parcel& p : deliver(found))
    {
        parcelReader from(p);
        while (!from.ended())
        {
            guests_.push_back(unpack(from));
        }
    }
    label nLost = c.lost.size();
    reduce(nLost, sumOp<label>());
    complete_ = nLost == 0;
}


void Foam::periFoam::hosting::introduce(const changes& c)
{
    std::sort(guests_.begin(), guests_.end());
    pointsTo_.clear();
    List<parcel> told(Pstream::nProcs());
    label i = 0;
    for (const guest& g : guests_)
    {
        pointsTo_.take(g.owner, i++);
        told[g.owner].labels.append(g.index);
        told[g.owner].labels.append(1);
    }
    for (const guest& g : c.lost)
    {
        told[g.owner].labels.append(g.index);
        told[g.owner].labels.append(0);
    }
    lost_ = -1;
    const List<parcel> heard(deliver(told));
    forAll(heard, rank)
    {
        parcelReader from(heard[rank]);
        while (!from.ended())
        {
            const label p = from.getLabel();
            if (from.getLabel())
            {
                pointsTo_.give(rank, p);
            }
            else
            {
                lost_ = lost_ < 0 ? p : min(lost_, p);
            }
        }
    }
}


void Foam::periFoam::hosting::locateAlone(const UList<point>& x)
{
    guests_.clear();
    pointsTo_.clear();
    lost_ = -1;
    label near = 0;
    forAll(x, p)
    {
        const label celli = locator_.cellAt(x[p], near);
        if (celli < 0)
        {
            lost_ = lost_ < 0 ? p : lost_;
            continue;
        }
        near = celli;
        pointsTo_.give(0, p);
        pointsTo_.take(0, label(guests_.size()));
        guests_.push_back(guest{0, p, x[p], labelVector(Zero), celli});
    }
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::hosting::hosting
(
    const fvMesh& mesh,
    const locator& l,
    const halo* beyond,
    const stencils* samples
)
:
    mesh_(mesh),
    locator_(l),
    halo_(beyond),
    stencils_(samples),
    complete_(false),
    lost_(-1)
{}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::label Foam::periFoam::hosting::locate(const UList<point>& x)
{
    if (!halo_)
    {
        locateAlone(x);
    }
    else
    {
        changes c;
        const bool fresh = !complete_;
        if (fresh)
        {
            start(x, c);
        }
        else
        {
            follow(x, c);
        }
        bool moved = fresh || c.strays.size();
        for (const parcel& p : c.leaving)
        {
            moved = moved || p.labels.size();
        }
        reduce(moved, orOp<bool>());
        if (moved)
        {
            travel(c);
            search(c);
            introduce(c);
        }
    }
    const label n = guests_.size();
    place_.resize(n);
    cell_.resize(n);
    for (label i = 0; i < n; ++i)
    {
        place_[i] = guests_[i].place;
        cell_[i] = guests_[i].cell;
    }
    return lost_;
}


Foam::label Foam::periFoam::hosting::bytes() const
{
    return
        label(guests_.size()*sizeof(guest)) + place_.byteSize()
      + cell_.byteSize() + pointsTo_.bytes();
}


// ************************************************************************* //
