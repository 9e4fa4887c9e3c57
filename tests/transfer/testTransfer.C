/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

Application
    testTransfer

Description
    What transfer promises, for every kernel and both schemes, at points all
    over the mesh of the case: next to walls, in corners, and exactly on
    faces, vertices and cell centres. With -kernels: the table of kernels
    instead. Prints "PASS <what>" or "FAIL <what>: <kernel>: <value>, <bound>";
    the exit status is 1 if anything failed.

\*---------------------------------------------------------------------------*/

#include "argList.H"
#include "Random.H"
#include "Time.H"
#include "emptyPolyPatch.H"
#include "mathematicalConstants.H"
#include "transfer.H"
#include "reference.H"

#include <functional>

using namespace Foam;
using periFoam::kernel;
using periFoam::reference;
using periFoam::transfer;

namespace
{

// Rounding of sums of a few hundred terms of order one
constexpr scalar rounding = 1e-12;

// Beyond this condition of the fit's moments, of which some 50 are usual, the
// samples within reach do not determine a linear field, as those of narrow
// kernels next to walls; a constant one remains
constexpr scalar undetermined = 1e3;


// * * * * * * * * * * * * * * * * Results * * * * * * * * * * * * * * * * * //

//- The worst of each check
class results
{
    struct result
    {
        std::string what, who;
        scalar value, bound;

        scalar share() const
        {
            return bound > 0 ? value/bound : value > 0 ? GREAT : 0;
        }
    };

    std::vector<result> results_;


public:

    void check
    (
        const std::string& what,
        const std::string& who,
        const scalar value,
        const scalar bound
    )
    {
        const result latest{what, who, value, bound};
        for (result& r : results_)
        {
            if (r.what == what)
            {
                r = latest.share() > r.share() ? latest : r;
                return;
            }
        }
        results_.push_back(latest);
    }

    //- How many failed
    label print() const
    {
        label failed = 0;
        for (const result& r : results_)
        {
            if (r.value <= r.bound)
            {
                Info<< "PASS " << r.what.c_str() << nl;
            }
            else
            {
                ++failed;
                Info<< "FAIL " << r.what.c_str() << ": " << r.who.c_str()
                    << ": " << r.value << ", at most " << r.bound << nl;
            }
        }
        return failed;
    }
};


// * * * * * * * * * * * * * * * * Kernels * * * * * * * * * * * * * * * * * //

scalar phi(const kernel& k, const scalar r)
{
    const scalar unit = 1;
    scalar w;
    k.evaluate(1, 0, &r, &unit, &w);
    return w;
}

//- Sum of f(r) phi(r) over grid points j = first, first + stride, ...
scalar gridSum
(
    const kernel& k,
    const scalar shift,
    const std::function<scalar(scalar)>& f,
    const label first = -6,
    const label stride = 1
)
{
    scalar sum = 0;
    for (label j = first; j <= 6; j += stride)
    {
        sum += f(shift - j);
    }
    return sum;
}

//- theta phiHat(theta) at its largest, phiHat by the midpoint rule
scalar steepest(const kernel& k)
{
    const label n = 2000;
    const scalar dr = k.halfWidth/n;
    scalar most = 0;
    for (scalar theta = 0; theta < 20; theta += 0.01)
    {
        scalar transform = 0;
        for (label i = 0; i < n; ++i)
        {
            const scalar r = (i + 0.5)*dr;
            transform += 2*dr*phi(k, r)*std::cos(theta*r);
        }
        most = max(most, theta*transform);
    }
    return most;
}

//- What a kernel's sums over the grid are at every shift; < 0: not constant
struct moments
{
    scalar first, second, squares;
};

const HashTable<moments> gridMoments
{
    {"ib4", {0, -1, 3./8}},      // [peskin2002] eqs 6.16 to 6.19
    {"cosine4", {-1, -1, 3./8}},
    {"bspline4", {0, 1./3, -1}},
    {"ib3", {0, -1, 1./2}},      // [roma1999] eqs 19 to 21
    {"hat2", {0, -1, -1}}
};

void checkKernel(const word& name, results& found)
{
    const kernel& k = *kernel::find(name);
    const std::string who(name);

    scalar outside = 0, asymmetry = 0, negative = 0;
    for (scalar r = 0; r < 4; r += 1./64)
    {
        const scalar w = phi(k, r);
        outside = max(outside, r >= k.halfWidth ? mag(w) : w > 0 ? 0 : GREAT);
        asymmetry = max(asymmetry, mag(w - phi(k, -r)));
        negative = max(negative, -w);
    }
    found.check("half width", who, outside, rounding);
    found.check("symmetric", who, asymmetry, rounding);
    found.check("not negative", who, negative, 0);

    const moments expected = gridMoments.lookup(name, {-1, -1, -1});
    scalar unity = 0, first = 0, second = 0, squares = 0, parity = 0;
    for (scalar shift = 0; shift < 1; shift += 1./128)
    {
        const auto one = [&](scalar r) { return phi(k, r); };
        const auto linear = [&](scalar r) { return r*phi(k, r); };
        const auto quadratic = [&](scalar r) { return r*r*phi(k, r); };
        const auto square = [&](scalar r) { return sqr(phi(k, r)); };
        const auto error = [&](const std::function<scalar(scalar)>& f, scalar is)
        {
            return is < 0 ? 0 : mag(gridSum(k, shift, f) - is);
        };
        unity = max(unity, error(one, 1));
        first = max(first, error(linear, expected.first));
        second = max(second, error(quadratic, expected.second));
        squares = max(squares, error(square, expected.squares));
        parity = max(parity, mag(gridSum(k, shift, one, -6, 2) - 0.5));
    }
    found.check("partition of unity", who, unity, rounding);
    found.check("first moment", who, first, rounding);
    found.check("second moment", who, second, rounding);
    found.check("sum of squares", who, squares, rounding);
    found.check
    (
        "even-odd flag", who, k.evenOdd ? parity : parity > 1e-3 ? 0 : 1, rounding
    );

    // The table has three decimals
    const scalar most = steepest(k);
    found.check("steepest wave", who, mag(k.steepest/most - 1), 1e-3);

    const scalar x[3] = {0.9, 1.4, 2.1}, rWidth[3] = {2, 1, 0.5};
    scalar w[3], scaled = 0;
    k.evaluate(3, 1.2, x, rWidth, w);
    for (label i = 0; i < 3; ++i)
    {
        scaled = max(scaled, mag(w[i] - phi(k, (x[i] - 1.2)*rWidth[i])));
    }
    found.check("widths", who, scaled, rounding);
    found.check("by name", who, name == k.name ? 0 : 1, 0);
}

void checkKernels(results& found)
{
    const wordList names(kernel::names());
    for (const word& name : names)
    {
        checkKernel(name, found);
    }
    for (const word& name : gridMoments.sortedToc())
    {
        found.check("by name", name, names.found(name) ? 0 : 1, 0);
    }
    found.check("by name", "none", kernel::find("none") ? 1 : 0, 0);
}


// * * * * * * * * * * * * * * * * Points  * * * * * * * * * * * * * * * * * //

bool isWall(const fvMesh& mesh, const label facei)
{
    return
       !mesh.isInternalFace(facei)
    && !isA<emptyPolyPatch>
        (
            mesh.boundaryMesh()[mesh.boundaryMesh().whichPatch(facei)]
        );
}

//- Directions that are solved for: 1, else 0
vector solved(const fvMesh& mesh)
{
    vector d(Zero);
    for (direction a = 0; a < 3; ++a)
    {
        d[a] = mesh.geometricD()[a] > 0;
    }
    return d;
}

label oneOf(const label n, Random& random)
{
    return min(label(n*random.sample01<scalar>()), n - 1);
}

//- In the convex hull of the cell's corners, mostly close to one of them
point inCell(const fvMesh& mesh, const label celli, Random& random)
{
    point sum(Zero);
    scalar total = 0;
    for (const label pointi : mesh.cellPoints()[celli])
    {
        const scalar share = pow4(random.sample01<scalar>());
        sum += share*mesh.points()[pointi];
        total += share;
    }
    return sum/total;
}

pointField somePoints(const fvMesh& mesh, Random& random)
{
    DynamicList<label> wallFaces;
    for (label facei = 0; facei < mesh.nFaces(); ++facei)
    {
        if (isWall(mesh, facei))
        {
            wallFaces.append(facei);
        }
    }
    DynamicList<point> x;
    for (label i = 0; i < 40; ++i)
    {
        const label wall = wallFaces[oneOf(wallFaces.size(), random)];
        x.append(inCell(mesh, oneOf(mesh.nCells(), random), random));
        x.append(inCell(mesh, mesh.faceOwner()[wall], random));
    }
    for (label i = 0; i < 20; ++i)
    {
        const label wall = wallFaces[oneOf(wallFaces.size(), random)];
        const face& corners = mesh.faces()[wall];
        x.append(mesh.faceCentres()[oneOf(mesh.nInternalFaces(), random)]);
        x.append(mesh.points()[oneOf(mesh.nPoints(), random)]);
        x.append(mesh.cellCentres()[oneOf(mesh.nCells(), random)]);
        x.append(mesh.faceCentres()[wall]);
        x.append(mesh.points()[corners[oneOf(corners.size(), random)]]);
        x.append(mesh.cellCentres()[mesh.faceOwner()[wall]]);
    }

    // In two dimensions bodies keep to the middle plane
    const vector d(solved(mesh));
    const point middle(mesh.bounds().midpoint());
    for (point& p : x)
    {
        p = middle + cmptMultiply(d, p - middle);
    }
    return pointField(std::move(x));
}

//- How far x is outside a cell, less what its faces are warped
scalar outsideCell(const fvMesh& mesh, const label celli, const point& x)
{
    scalar most = 0;
    for (const label facei : mesh.cells()[celli])
    {
        if (!mesh.isInternalFace(facei) && !isWall(mesh, facei))
        {
            continue;
        }
        const point& centre = mesh.faceCentres()[facei];
        const vector n(mesh.faceAreas()[facei]/mag(mesh.faceAreas()[facei]));
        const scalar sign = mesh.faceOwner()[facei] == celli ? 1 : -1;
        scalar warp = 0;
        for (const label pointi : mesh.faces()[facei])
        {
            warp = max(warp, mag((mesh.points()[pointi] - centre) & n));
        }
        most = max(most, sign*((x - centre) & n) - warp);
    }
    return most;
}


// * * * * * * * * * * * * * * * * Fields  * * * * * * * * * * * * * * * * * //

vector randomVector(Random& random)
{
    vector v;
    for (direction a = 0; a < 3; ++a)
    {
        v[a] = 2*random.sample01<scalar>() - 1;
    }
    return v;
}

//- Velocities of cells, and fluxes
struct flow
{
    const fvMesh& mesh;
    volVectorField U;
    surfaceScalarField phi;

    explicit flow(const fvMesh& mesh)
    :
        mesh(mesh),
        U
        (
            IOobject("U", mesh.time().timeName(), mesh),
            mesh,
            dimensionedVector(dimVelocity, Zero)
        ),
        phi
        (
            IOobject("phi", mesh.time().timeName(), mesh),
            mesh,
            dimensionedScalar(dimVelocity*dimArea, Zero)
        )
    {}

    //- The flux of each face by its label, but where nothing can flow
    void setFluxes(const std::function<scalar(label)>& flux)
    {
        for (label facei = 0; facei < mesh.nInternalFaces(); ++facei)
        {
            phi[facei] = flux(facei);
        }
        for (fvsPatchScalarField& patch : phi.boundaryFieldRef())
        {
            forAll(patch, i)
            {
                patch[i] = flux(patch.patch().start() + i);
            }
        }
    }

    scalar flux(const label facei) const
    {
        if (mesh.isInternalFace(facei))
        {
            return phi[facei];
        }
        const label patchi = mesh.boundaryMesh().whichPatch(facei);
        return phi.boundaryField()[patchi]
            [facei - mesh.boundaryMesh()[patchi].start()];
    }

    void set(const std::function<vector(point)>& velocity)
    {
        forAll(U, celli)
        {
            U[celli] = velocity(mesh.cellCentres()[celli]);
        }
        setFluxes
        (
            [&](label facei)
            {
                return velocity(mesh.faceCentres()[facei])
                    & mesh.faceAreas()[facei];
            }
        );
    }

    //- Up to one, without relation between cells or faces
    void setRandom(Random& random)
    {
        const vector d(solved(mesh));
        for (vector& v : U)
        {
            v = cmptMultiply(d, randomVector(random));
        }
        setFluxes
        (
            [&](label facei)
            {
                return randomVector(random).x()*mag(mesh.faceAreas()[facei]);
            }
        );
    }

    //- Fluxes of the cells' velocities, by the mesh's interpolation weights
    void setInterpolated()
    {
        setFluxes
        (
            [&](label facei)
            {
                vector v(U[mesh.faceOwner()[facei]]);
                if (mesh.isInternalFace(facei))
                {
                    const scalar w = mesh.weights()[facei];
                    v = w*v + (1 - w)*U[mesh.faceNeighbour()[facei]];
                }
                return v & mesh.faceAreas()[facei];
            }
        );
    }
};


// * * * * * * * * * * * * * * * * Transfer  * * * * * * * * * * * * * * * * //

//- One kernel and one scheme on one mesh
class bench
{
    const fvMesh& mesh_;
    const kernel& kernel_;
    const bool faceFlux_;
    const pointField& x_;
    const vector solved_;

    flow& flow_;
    Random random_;
    transfer transfer_;
    List<reference::weights> expected_;
    results& results_;

    void check(const std::string& what, const scalar value, const scalar bound)
    {
        const std::string scheme(faceFlux_ ? "faceFlux " : "cellCentred ");
        results_.check(scheme + what, kernel_.name, value, bound);
    }

    bool determined(const label p) const
    {
        return expected_[p].condition < undetermined;
    }

    //- Velocities of x from the flow
    vectorField velocity(const UList<point>& x, const scalar share = 1)
    {
        vectorField u(x.size());
        if (transfer_.locate(x) >= 0)
        {
            FatalErrorInFunction
                << "a point is outside the mesh" << exit(FatalError);
        }
        transfer_.weigh(x);
        transfer_.sample(flow_.U, flow_.phi, share);
        transfer_.interpolate(u);
        return u;
    }

    //- A point's velocity from the flow, by the reference's weights
    vector expected(const label p) const
    {
        const vectorField& w = expected_[p].w;
        vector sum(Zero);
        forAll(w, k)
        {
            const label i = expected_[p].sample[k];
            sum += faceFlux_
              ? w[k]*(flow_.flux(i)/mag(mesh_.faceAreas()[i]))
              : cmptMultiply(w[k], flow_.U[i]);
        }
        return sum;
    }

    //- The worst of errors that are of constant fields, or of those determined.
    //
    //  Solving for the weights loses as many digits as the condition has
    void checkVelocity
    (
        const std::string& what,
        const vectorField& error,
        const bool constant
    )
    {
        forAll(error, p)
        {
            if (constant || determined(p))
            {
                const scalar lost = min(expected_[p].condition, undetermined);
                check(what, mag(error[p]), rounding*(1 + lost/50));
            }
        }
    }


public:

    bench
    (
        const fvMesh& mesh,
        const word& kernelName,
        const bool faceFlux,
        const pointField& x,
        flow& fields,
        results& found
    )
    :
        mesh_(mesh),
        kernel_(*kernel::find(kernelName)),
        faceFlux_(faceFlux),
        x_(x),
        solved_(solved(mesh)),
        flow_(fields),
        random_(2),
        transfer_(mesh, kernel_, faceFlux),
        expected_(x.size()),
        results_(found)
    {
        const reference weights(mesh, kernel_, faceFlux);
        forAll(x, p)
        {
            expected_[p] = weights.at(x[p]);
        }
    }

    //- Each cell holds its point, also after jumps across the mesh; the first
    //  point outside is told
    void location()
    {
        const scalar size = mesh_.bounds().mag();
        label lost = transfer_.locate(x_);
        check("points are in the mesh", lost < 0 ? 0 : lost + 1, 0);

        scalar outside = 0;
        pointField places(x_);
        for (label jump = 0; jump < 4; ++jump)
        {
            lost = max(lost, transfer_.locate(places));
            forAll(places, p)
            {
                outside = max
                (
                    outside, outsideCell(mesh_, transfer_.cell()[p], places[p])
                );
            }
            inplaceRotateList<List>(places, 37);
        }
        check("jumps are followed", lost < 0 ? 0 : lost + 1, 0);
        check("cells hold their points", outside/size, rounding);

        label missed = 0;
        for (label facei = 0; facei < mesh_.nFaces(); ++facei)
        {
            if (isWall(mesh_, facei) && facei % 7 == 0)
            {
                const vector& S = mesh_.faceAreas()[facei];
                places = x_;
                const label p = oneOf(places.size(), random_);
                places[p] = mesh_.faceCentres()[facei] + 1e-6*size*S/mag(S);
                missed += transfer_.locate(places) != p;
            }
        }
        places = x_;
        places[3] = mesh_.bounds().max() + 100*solved_;
        places[5] = places[3];
        missed += transfer_.locate(places) != 3;
        missed += transfer_.locate(x_) != -1;
        check("points outside are told", missed, 0);
    }

    //- Constant and linear fields are reproduced
    void exactness()
    {
        label few = 0;
        forAll(x_, p)
        {
            few += kernel_.halfWidth >= 2
                && expected_[p].condition > 10*undetermined;
        }
        check("four cells determine a linear field", few, 0);

        for (label trial = 0; trial < 3; ++trial)
        {
            const vector a(cmptMultiply(solved_, randomVector(random_)));
            tensor B(Zero);
            for (direction r = 0; r < 3; ++r)
            {
                const vector row(cmptMultiply(solved_, randomVector(random_)));
                for (direction c = 0; c < 3; ++c)
                {
                    B(r, c) = solved_[r]*row[c];
                }
            }
            for (const scalar linear : {0, 1})
            {
                // Of order one all over the mesh
                const auto field = [&](const point& at)
                {
                    return a + linear*(B & (at - mesh_.bounds().midpoint()));
                };
                flow_.set(field);
                vectorField error(velocity(x_));
                forAll(x_, p)
                {
                    error[p] -= field(x_[p]);
                }
                checkVelocity(linear ? "linear" : "constant", error, !linear);
            }
        }
    }

    //- Velocities are those of the definition, whatever the fluxes
    void definition()
    {
        flow_.setRandom(random_);
        vectorField error(velocity(x_));
        forAll(x_, p)
        {
            error[p] -= expected(p);
        }
        checkVelocity("definition", error, false);

        // An extrapolation by a cell or two at most
        check("weights are small", max(mag(velocity(x_))), 20);
    }

    //- The velocity of the midpoint is the mean of the old and the new one
    void midpoint()
    {
        flow old(mesh_);
        old.setRandom(random_);
        flow_.setRandom(random_);
        flow_.U.oldTime() == old.U;
        flow_.phi.oldTime() == old.phi;
        const vectorField mean(velocity(x_, 0.5)), late(velocity(x_));
        flow_.U == old.U;
        flow_.phi == old.phi;
        const vectorField early(velocity(x_));
        check("midpoint", max(mag(mean - (early + late)/2)), rounding);
    }

    //- Spreading is the transpose of interpolation: the power that points give
    //  arrives in the cells. And the total force
    void adjoint()
    {
        flow_.setRandom(random_);
        flow_.setInterpolated();
        const vectorField u(velocity(x_));
        vectorField force(x_.size());
        for (vector& f : force)
        {
            f = randomVector(random_);
        }
        transfer_.spread(force);

        vector total(Zero);
        scalar power = 0, most = 0, size = 0;
        forAll(x_, p)
        {
            const scalar given = force[p] & u[p];
            power -= given;
            most += mag(given);
            total -= cmptMultiply(solved_, force[p]);
            size += mag(force[p]);
        }
        transfer_.forEachCellForce
        (
            [&](const label celli, const vector& f)
            {
                const scalar taken = f & flow_.U[celli];
                power += taken;
                most += mag(taken);
                total += f;
            }
        );
        check("adjoint", mag(power)/most, rounding);
        check("total force", mag(total)/size, rounding);
    }

    //- Amounts are spread by positive weights with sum one; those of points
    //  outside the mesh are left out
    void amounts()
    {
        const reference weights(mesh_, kernel_, false);
        scalarField amount(x_.size()), cells, difference(mesh_.nCells(), 0);
        forAll(amount, p)
        {
            amount[p] = random_.sample01<scalar>();
            weights.addAmount(x_[p], amount[p], difference);
        }
        transfer_.spreadAmount(x_, amount, cells);
        difference -= cells;
        check("amount kept", mag(sum(cells)/sum(amount) - 1), rounding);
        check("amount not negative", -min(cells), rounding);
        check("amount definition", max(mag(difference)), rounding);

        pointField all(x_);
        all.append(mesh_.bounds().max() + solved_);
        amount.append(1);
        scalarField same;
        transfer_.spreadAmount(all, amount, same);
        check("amount outside", max(mag(same - cells)), 0);
    }

    //- Velocities do not jump where a path crosses into another cell, nor
    //  within one, whatever the fluxes.
    //
    //  Weights change over distances of a cell or, where few samples are
    //  left, a small share of one: over 1e-10 of the mesh by less than 1e-6.
    //  What halving a step does not make small is a jump.
    void continuity()
    {
        flow_.setRandom(random_);
        const label steps = 40;
        scalar across = 0, within = 0;
        for (label path = 0; path < 8; ++path)
        {
            const point start(x_[oneOf(x_.size(), random_)]);
            const point end(x_[oneOf(x_.size(), random_)]);
            const auto at = [&](const scalar s)
            {
                return pointField(1, start + s*(end - start));
            };
            scalar steepest = 0, from = 0;
            for (label step = 0; step < steps; ++step)
            {
                scalar low = scalar(step)/steps, high = scalar(step + 1)/steps;
                if (transfer_.locate(at(high)) >= 0)
                {
                    break;
                }
                transfer_.locate(at(low));
                const label cell = transfer_.cell()[0];
                transfer_.locate(at(high));
                if (transfer_.cell()[0] == cell)
                {
                    const vector u(velocity(at(low))[0]);
                    const scalar change = mag(velocity(at(high))[0] - u);
                    if (change > steepest)
                    {
                        steepest = change;
                        from = low;
                    }
                    continue;
                }
                bool inside = true;
                while (inside && high - low > 1e-12)
                {
                    const scalar middle = (low + high)/2;
                    inside = transfer_.locate(at(middle)) < 0;
                    (transfer_.cell()[0] == cell ? low : high) = middle;
                }
                if (!inside)
                {
                    break;
                }
                const vector u(velocity(at(low))[0]);
                across = max(across, mag(velocity(at(high))[0] - u));
            }
            scalar change = steepest;
            for (scalar h = 0.5/steps; steepest > 0 && h > 1e-12; h /= 2)
            {
                const vector low(velocity(at(from))[0]);
                const vector middle(velocity(at(from + h))[0]);
                const vector high(velocity(at(from + 2*h))[0]);
                const bool upper = mag(high - middle) > mag(middle - low);
                change = upper ? mag(high - middle) : mag(middle - low);
                from += upper ? h : 0;
            }
            within = max(within, change);
        }
        check("continuous across faces", across, 1e-6);
        check("continuous within cells", within, 1e-6);
    }

    //- Work that was done for a place is kept
    void memory()
    {
        velocity(x_);
        transfer_.spread(vectorField(x_.size(), Zero));
        const label bytes = transfer_.bytes();
        velocity(x_);
        transfer_.spread(vectorField(x_.size(), Zero));
        check("stencils are kept", mag(transfer_.bytes() - bytes), 0);
    }

    //- The smallest width is that of a cell near a point
    void widths()
    {
        scalar here = GREAT, all = GREAT;
        const auto smallest = [&](const label celli)
        {
            const vector extent(reference::extent(mesh_, celli));
            scalar least = GREAT;
            for (direction a = 0; a < 3; ++a)
            {
                least = min(least, solved_[a] > 0 ? extent[a] : GREAT);
            }
            return least;
        };
        for (const label celli : transfer_.cell())
        {
            here = min(here, smallest(celli));
        }
        for (label celli = 0; celli < mesh_.nCells(); ++celli)
        {
            all = min(all, smallest(celli));
        }
        const scalar width = transfer_.smallestWidth();
        check("smallest width", max(all - width, width - here)/all, rounding);
    }

    void run()
    {
        struct
        {
            const char* what;
            void (bench::*test)();
        }
        const tests[] =
        {
            {"location", &bench::location},
            {"exactness", &bench::exactness},
            {"definition", &bench::definition},
            {"midpoint", &bench::midpoint},
            {"adjoint", &bench::adjoint},
            {"amounts", &bench::amounts},
            {"widths", &bench::widths},
            {"continuity", &bench::continuity},
            {"memory", &bench::memory}
        };
        for (const auto& t : tests)
        {
            std::string error;
            try
            {
                (this->*t.test)();
            }
            catch (const Foam::error& e)
            {
                error = ": " + e.message();
            }
            check(t.what + std::string(" ends") + error, !error.empty(), 0);
        }
    }
};

} // End anonymous namespace


// * * * * * * * * * * * * * * * * * Main  * * * * * * * * * * * * * * * * * //

int main(int argc, char* argv[])
{
    argList::noBanner();
    argList::noParallel();
    argList::noFunctionObjects();
    argList::addBoolOption("kernels", "the table of kernels, without a mesh");
    argList args(argc, argv);

    results found;
    if (args.found("kernels"))
    {
        checkKernels(found);
        return found.print() > 0;
    }

    Time runTime(Time::controlDictName, args);
    fvMesh mesh
    (
        IOobject(polyMesh::defaultRegion, runTime.timeName(), runTime, IOobject::MUST_READ)
    );
    flow fields(mesh);
    Random random(1);
    const pointField x(somePoints(mesh, random));
    FatalError.throwExceptions();
    for (const bool faceFlux : {true, false})
    {
        for (const word& name : kernel::names())
        {
            bench(mesh, name, faceFlux, x, fields, found).run();
        }
    }
    return found.print() > 0;
}


// ************************************************************************* //
