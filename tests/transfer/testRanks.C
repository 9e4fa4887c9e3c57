/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

Application
    testRanks

Description
    Does transfer do the same in parallel, and next to cyclic patches, as in a
    serial run on a whole mesh without them?

    With -record <file>, a serial run on the whole mesh, or on one that holds
    three periods in place of one: moves points about, and writes what they
    get and what they give. With -expect <file>: does the same on another mesh
    of the same flow, decomposed or cyclic, and compares. -periodic <axes>
    names the axes along which the flow repeats itself after a length of 1.

    Cells are told apart by their centres, in one period.

\*---------------------------------------------------------------------------*/

#include "argList.H"
#include "IFstream.H"
#include "OFstream.H"
#include "OSspecific.H"
#include "Random.H"
#include "Time.H"
#include "mathematicalConstants.H"
#include "transfer.H"

using namespace Foam;
using periFoam::kernel;
using periFoam::transfer;

namespace
{

// Sums in another order, and weights that are solved for: these lose as many
// digits as the condition of the fit has, up to five next to walls
constexpr scalar rounding = 1e-10;

constexpr label nPoints = 120;
constexpr label nSteps = 24;

// Corner of the box that the meshes of tests/transfer/run fill
const point corner(-0.31, 0.17, -0.23);


//- One period of the flow, and what repeats it
struct period
{
    vector axes;

    //- x within the period at the corner
    point wrapped(const point& x) const
    {
        point inside(x);
        for (direction a = 0; a < 3; ++a)
        {
            if (axes[a] > 0)
            {
                inside[a] -= std::floor(x[a] - corner[a]);
            }
        }
        return inside;
    }

    //- Are the two the same place, or images of each other?
    bool same(const point& x, const point& y) const
    {
        scalar apart = 0;
        for (direction a = 0; a < 3; ++a)
        {
            scalar d = x[a] - y[a];
            d -= axes[a] > 0 ? std::round(d) : 0;
            apart = max(apart, mag(d));
        }
        return apart < 1e-7;
    }
};


// * * * * * * * * * * * * * * * * The flow  * * * * * * * * * * * * * * * * //

//- Of order one, rough, and the same after a length of 1 along each axis
vector velocityAt(const point& x, const scalar phase)
{
    const scalar turn = constant::mathematical::twoPi;
    const vector r(turn*(x - corner));
    return vector
    (
        std::sin(3*r.x() + 5*r.y() - 2*r.z() + phase),
        std::cos(4*r.x() - 2*r.y() + 3*r.z() + 2*phase),
        std::sin(r.x() + 4*r.y() + 5*r.z() - phase)
    );
}

void setFlow
(
    volVectorField& U,
    surfaceScalarField& phi,
    const vector& solved,
    const scalar phase
)
{
    const fvMesh& mesh = U.mesh();
    const auto velocity = [&](const point& x) -> vector
    {
        return cmptMultiply(solved, velocityAt(x, phase));
    };
    forAll(U, celli)
    {
        U[celli] = velocity(mesh.cellCentres()[celli]);
    }
    forAll(phi, facei)
    {
        phi[facei] = velocity(mesh.faceCentres()[facei])
            & mesh.faceAreas()[facei];
    }
    for (fvsPatchScalarField& patch : phi.boundaryFieldRef())
    {
        forAll(patch, i)
        {
            patch[i] = velocity(patch.patch().Cf()[i]) & patch.patch().Sf()[i];
        }
    }
}


// * * * * * * * * * * * * * * * * The runs  * * * * * * * * * * * * * * * * //

//- What one kernel and scheme did, at every step
struct record
{
    List<vectorField> velocity, force;
    List<scalarField> amount;
    scalar width;
};

Ostream& operator<<(Ostream& os, const record& r)
{
    return os << r.velocity << r.force << r.amount << token::SPACE << r.width;
}

Istream& operator>>(Istream& is, record& r)
{
    return is >> r.velocity >> r.force >> r.amount >> r.width;
}

//- Points at the start: all over the mesh, on faces, edges and corners too
pointField somePoints(const fvMesh& mesh, const vector& solved)
{
    Random random(5);
    const auto oneOf = [&](const label n)
    {
        return min(label(n*random.sample01<scalar>()), n - 1);
    };
    pointField x(nPoints);
    forAll(x, p)
    {
        const label celli = oneOf(mesh.nCells());
        const labelList& corners = mesh.cellPoints()[celli];
        switch (p % 4)
        {
            case 0:
                x[p] = mesh.faceCentres()[oneOf(mesh.nInternalFaces())];
                break;
            case 1:
                x[p] = mesh.points()[corners[oneOf(corners.size())]];
                break;
            default:
                x[p] = Zero;
                scalar total = 0;
                for (const label pointi : corners)
                {
                    const scalar share = random.sample01<scalar>();
                    x[p] += share*mesh.points()[pointi];
                    total += share;
                }
                x[p] /= total;
        }
        const point middle(mesh.bounds().midpoint());
        x[p] = middle + cmptMultiply(solved, x[p] - middle);
    }
    return x;
}

//- The rank that owns a point: of more than two, one owns none
label ownerOf(const label p)
{
    const label n = Pstream::nProcs();
    const label rank = (p % 5 ? p : p/5) % n;
    return n > 2 && rank == 1 ? 0 : rank;
}

class run
{
    const fvMesh& mesh_;
    const period& period_;
    const bool recording_;
    const vector solved_;
    volVectorField& U_;
    surfaceScalarField& phi_;
    transfer transfer_;
    const pointField& start_;
    labelList mine_;

    //- Where point p is at a step: to and fro between two places, or adrift
    //  through the periods; now and then it jumps
    point placeOf(const label p, const label step) const
    {
        point x(start_[step % 8 == 7 ? (p + 37) % nPoints : p]);
        const point& other = start_[(p + 1) % nPoints];
        const scalar s = scalar(step)/nSteps;
        for (direction a = 0; a < 3; ++a)
        {
            if (period_.axes[a] > 0)
            {
                x[a] += (p % 2 ? 2.3 : -1.7)*s;
            }
            else if (step % 8 != 7)
            {
                x[a] += s*(other[a] - x[a]);
            }
        }
        return recording_ ? period_.wrapped(x) : x;
    }

    pointField places(const label step) const
    {
        pointField x(mine_.size());
        forAll(mine_, i)
        {
            x[i] = placeOf(mine_[i], step);
        }
        return x;
    }

public:

    run
    (
        const kernel& k,
        const bool faceFlux,
        const period& repeats,
        const bool recording,
        const vector& solved,
        volVectorField& U,
        surfaceScalarField& phi,
        const pointField& start
    )
    :
        mesh_(U.mesh()),
        period_(repeats),
        recording_(recording),
        solved_(solved),
        U_(U),
        phi_(phi),
        transfer_(mesh_, k, faceFlux),
        start_(start)
    {
        for (label p = 0; p < nPoints; ++p)
        {
            if (ownerOf(p) == Pstream::myProcNo())
            {
                mine_.append(p);
            }
        }
    }

    const labelList& mine() const
    {
        return mine_;
    }

    //- A point on its way out is told to its owner, and back in, found again;
    //  how many were told wrongly
    label strays()
    {
        label wrong = 0;
        pointField x(places(0));
        if (mine_.size() > 3 && period_.axes == vector(Zero))
        {
            x[3] = mesh_.bounds().max() + solved_;
        }
        const label expected =
            mine_.size() > 3 && period_.axes == vector(Zero) ? 3 : -1;
        wrong += transfer_.locate(x) != expected;
        wrong += transfer_.locate(places(0)) != -1;
        label hosted = transfer_.cell().size();
        reduce(hosted, sumOp<label>());
        wrong += hosted != nPoints;
        return wrong;
    }

    //- Force that point p gives
    vector forceOf(const label p, const label step) const
    {
        return cmptMultiply(solved_, velocityAt(start_[p], 3*p + step));
    }

    record all()
    {
        record r;
        for (label step = 0; step < nSteps; ++step)
        {
            const pointField x(places(step));
            const scalar share = step % 2 ? 0.5 : 1;
            setFlow(U_.oldTime(), phi_.oldTime(), solved_, step + 0.5);
            setFlow(U_, phi_, solved_, step);
            vectorField u(x.size()), force(x.size());
            scalarField amount(x.size());
            if (transfer_.locate(x) >= 0)
            {
                FatalErrorInFunction
                    << "a point is outside the mesh" << exit(FatalError);
            }
            transfer_.weigh(x);
            transfer_.sample(U_, phi_, share);
            transfer_.interpolate(u);
            forAll(mine_, i)
            {
                force[i] = forceOf(mine_[i], step);
                amount[i] = 1 + mag(force[i]);
            }
            transfer_.spread(force);
            vectorField ofCells(mesh_.nCells(), Zero);
            transfer_.forEachCellForce
            (
                [&](const label celli, const vector& f) { ofCells[celli] += f; }
            );
            r.velocity.append(u);
            r.force.append(ofCells);
            scalarField amounts;
            transfer_.spreadAmount(x, amount, amounts);
            r.amount.append(amounts);
        }
        r.width = transfer_.smallestWidth();
        return r;
    }
};


// * * * * * * * * * * * * * * * * Compare * * * * * * * * * * * * * * * * * //

//- Sums over the cells that are images of a cell here
template<class Type>
Field<Type> gathered
(
    const List<labelList>& images,
    const Field<Type>& expected
)
{
    Field<Type> sums(images.size(), Zero);
    forAll(images, celli)
    {
        for (const label other : images[celli])
        {
            sums[celli] += expected[other];
        }
    }
    return sums;
}

class judge
{
    label failed_;

public:

    judge()
    :
        failed_(0)
    {}

    void check(const std::string& what, scalar value, const scalar bound)
    {
        reduce(value, maxOp<scalar>());
        if (value <= bound)
        {
            Info<< "PASS " << what.c_str() << nl;
            return;
        }
        ++failed_;
        Info<< "FAIL " << what.c_str() << ": " << value << ", at most "
            << bound << nl;
    }

    label failed() const
    {
        return failed_;
    }
};

void compare
(
    const std::string& who,
    run& test,
    const List<labelList>& images,
    const record& expected,
    judge& result
)
{
    const record found(test.all());
    scalar velocity = 0, force = 0, amount = 0, total = 0;
    for (label step = 0; step < nSteps; ++step)
    {
        forAll(test.mine(), i)
        {
            velocity = max
            (
                velocity,
                mag
                (
                    found.velocity[step][i]
                  - expected.velocity[step][test.mine()[i]]
                )
            );
        }
        const vectorField forces(gathered(images, expected.force[step]));
        const scalarField amounts(gathered(images, expected.amount[step]));
        forAll(images, celli)
        {
            force = max(force, mag(found.force[step][celli] - forces[celli]));
            amount =
                max(amount, mag(found.amount[step][celli] - amounts[celli]));
        }
        vector given(Zero);
        for (label p = 0; p < nPoints; ++p)
        {
            given += test.forceOf(p, step);
        }
        total = max(total, mag(gSum(found.force[step]) - given));
    }
    result.check(who + "velocities", velocity, rounding);
    result.check(who + "forces", force, rounding);
    result.check(who + "amounts", amount, rounding);
    result.check(who + "total force", total, nPoints*rounding/10);
    result.check
    (
        who + "smallest width", mag(found.width/expected.width - 1), rounding
    );
    result.check(who + "points outside are told", test.strays(), 0);
}

//- The recorded cells that are images of each cell here
List<labelList> imagesOf
(
    const fvMesh& mesh,
    const period& repeats,
    const vectorField& recorded,
    judge& result
)
{
    List<labelList> images(mesh.nCells());
    label n = 0;
    forAll(images, celli)
    {
        forAll(recorded, other)
        {
            if (repeats.same(mesh.cellCentres()[celli], recorded[other]))
            {
                images[celli].append(other);
                ++n;
            }
        }
    }
    reduce(n, sumOp<label>());
    result.check("cells are those recorded", mag(n - recorded.size()), 0);
    return images;
}

} // End anonymous namespace


// * * * * * * * * * * * * * * * * * Main  * * * * * * * * * * * * * * * * * //

int main(int argc, char* argv[])
{
    argList::noBanner();
    argList::noFunctionObjects();
    argList::addOption("record", "file", "write results of the whole mesh");
    argList::addOption("expect", "file", "compare with those results");
    argList::addOption("periodic", "axes", "axes of the flow's periods: xyz");
    argList args(argc, argv);

    Time runTime(Time::controlDictName, args);
    fvMesh mesh
    (
        IOobject
        (
            polyMesh::defaultRegion, runTime.timeName(), runTime,
            IOobject::MUST_READ
        )
    );
    period repeats{Zero};
    vector solved(Zero);
    const string axes(args.lookupOrDefault<string>("periodic", ""));
    for (direction a = 0; a < 3; ++a)
    {
        solved[a] = mesh.geometricD()[a] > 0;
        repeats.axes[a] = axes.find("xyz"[a]) != std::string::npos;
    }
    volVectorField U
    (
        IOobject("U", runTime.timeName(), mesh),
        mesh,
        dimensionedVector(dimVelocity, Zero)
    );
    surfaceScalarField phi
    (
        IOobject("phi", runTime.timeName(), mesh),
        mesh,
        dimensionedScalar(dimVelocity*dimArea, Zero)
    );
    U.oldTime();
    phi.oldTime();

    const bool recording = args.found("record");
    pointField start;
    vectorField centres;
    autoPtr<IFstream> is;
    autoPtr<OFstream> os;
    judge result;
    List<labelList> images;
    if (recording)
    {
        start = somePoints(mesh, solved);
        for (point& x : start)
        {
            x = repeats.wrapped(x);
        }
        os.reset(new OFstream(fileName(args["record"])));
        os().precision(17);
        os() << start << mesh.cellCentres();
    }
    else
    {
        is.reset(new IFstream(fileName(args["expect"])));
        is() >> start >> centres;
        images = imagesOf(mesh, repeats, centres, result);
    }
    for (const bool faceFlux : {true, false})
    {
        for (const word& name : kernel::names())
        {
            const kernel& k = *kernel::find(name);
            run test(k, faceFlux, repeats, recording, solved, U, phi, start);
            if (recording)
            {
                os() << test.all() << nl;
                continue;
            }
            record expected;
            is() >> expected;
            const std::string scheme(faceFlux ? "faceFlux " : "cellCentred ");
            compare(scheme + name + " ", test, images, expected, result);
        }
    }
    return result.failed() > 0;
}


// ************************************************************************* //
