/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "halo.H"
#include "cyclicPolyPatch.H"
#include "processorCyclicPolyPatch.H"
#include "syncTools.H"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

//- Sides of cyclic patches fit within this share of the faces' sizes
constexpr scalar fit = 1e-4;

//- Most boxes that a rank describes its cells by
constexpr label mostLeaves = 128;

//- Cells close together: a box of the places of points, the largest extents
struct leaf
{
    boundBox box;
    vector span;

    leaf()
    :
        box(boundBox::invertedBox),
        span(Zero)
    {}

    void add(const leaf& other)
    {
        box.add(other.box);
        span = max(span, other.span);
    }
};

//- Vectors of the other sides of coupled faces. Component by component:
//  vectors would be turned along with cyclic patches
void swapVectors(const polyMesh& mesh, vectorField& v)
{
    for (direction a = 0; a < 3; ++a)
    {
        scalarField component(v.component(a));
        syncTools::swapBoundaryFaceList(mesh, component);
        v.replace(a, component);
    }
}

//- The cyclic patch that a patch is, or is a part of; -1: none
label cyclicOf(const polyBoundaryMesh& patches, const label patchi)
{
    if (isA<processorCyclicPolyPatch>(patches[patchi]))
    {
        return refCast<const processorCyclicPolyPatch>
        (
            patches[patchi]
        ).referPatchID();
    }
    return isA<cyclicPolyPatch>(patches[patchi]) ? patchi : -1;
}

//- Cut cells into groups of neighbours
void split
(
    const vectorField& centre,
    label* first,
    label* last,
    const label largest,
    const std::function<void(const label*, const label*)>& visit
)
{
    if (last - first <= largest)
    {
        visit(first, last);
        return;
    }
    boundBox box(boundBox::invertedBox);
    for (const label* i = first; i < last; ++i)
    {
        box.add(centre[*i]);
    }
    direction axis = 0;
    for (direction a = 1; a < 3; ++a)
    {
        axis = box.span()[a] > box.span()[axis] ? a : axis;
    }
    label* middle = first + (last - first)/2;
    std::nth_element
    (
        first, middle, last,
        [&](const label i, const label j)
        {
            return centre[i][axis] < centre[j][axis];
        }
    );
    split(centre, first, middle, largest, visit);
    split(centre, middle, last, largest, visit);
}

//- The leaves of every rank
List<List<leaf>> allLeaves(const fvMesh& mesh)
{
    labelList order(identity(mesh.nCells()));
    DynamicList<vector> mine;
    const auto addLeaf = [&](const label* first, const label* last)
    {
        leaf all;
        for (const label* i = first; i < last; ++i)
        {
            leaf one;
            one.box = periFoam::halo::placeBox(mesh, *i);
            one.span = one.box.span();
            all.add(one);
        }
        mine.append(all.box.min());
        mine.append(all.box.max());
        mine.append(all.span);
    };
    if (order.size())
    {
        split
        (
            mesh.cellCentres(),
            order.begin(),
            order.end(),
            max(label(8), (mesh.nCells() - 1)/mostLeaves + 1),
            addLeaf
        );
    }
    List<List<vector>> numbers(Pstream::nProcs());
    numbers[Pstream::myProcNo()] = mine;
    Pstream::gatherList(numbers);
    Pstream::scatterList(numbers);

    List<List<leaf>> leaves(numbers.size());
    forAll(numbers, rank)
    {
        leaves[rank].resize(numbers[rank].size()/3);
        forAll(leaves[rank], i)
        {
            const vector* v = &numbers[rank][3*i];
            leaves[rank][i].box = boundBox(v[0], v[1]);
            leaves[rank][i].span = v[2];
        }
    }
    return leaves;
}

leaf sumOf(const List<leaf>& leaves)
{
    leaf all;
    for (const leaf& one : leaves)
    {
        all.add(one);
    }
    return all;
}

//- Could stencils of the leaf have samples of a cell of that box and extent?
//  As stencils::around, of any cell of the leaf
bool inReach
(
    const boundBox& box,
    const vector& span,
    const leaf& l,
    const scalar halfWidth,
    const Vector<label>& solved
)
{
    for (direction d = 0; d < 3; ++d)
    {
        const scalar reach = (halfWidth + 1)*max(span[d], l.span[d]);
        if
        (
            solved[d] > 0
         && (
                box.max()[d] < l.box.min()[d] - reach
             || box.min()[d] > l.box.max()[d] + reach
            )
        )
        {
            return false;
        }
    }
    return true;
}

boundBox shifted(const boundBox& box, const vector& by)
{
    return boundBox(box.min() + by, box.max() + by);
}

void addKey(periFoam::parcel& to, const periFoam::halo::key& k)
{
    to.labels.append(k.rank);
    to.labels.append(k.index);
    for (direction a = 0; a < 3; ++a)
    {
        to.labels.append(k.turns[a]);
    }
}

periFoam::halo::key getKey(periFoam::parcelReader& from)
{
    periFoam::halo::key k;
    k.rank = from.getLabel();
    k.index = from.getLabel();
    for (direction a = 0; a < 3; ++a)
    {
        k.turns[a] = from.getLabel();
    }
    return k;
}

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

bool Foam::periFoam::halo::key::operator<(const key& other) const
{
    return
        std::tie(rank, index, turns[0], turns[1], turns[2])
      < std::tie
        (
            other.rank, other.index,
            other.turns[0], other.turns[1], other.turns[2]
        );
}


Foam::label Foam::periFoam::halo::periodAt(const vector& separation)
{
    const scalar same = 1e-6*mag(separation);
    for (label i = 0; i < nPeriods_; ++i)
    {
        if (mag(separation - periods_[i]) < same)
        {
            return i + 1;
        }
        if (mag(separation + periods_[i]) < same)
        {
            return -(i + 1);
        }
    }
    if (nPeriods_ == 3)
    {
        return 0;
    }
    periods_[nPeriods_] = separation;
    return ++nPeriods_;
}


Foam::labelList Foam::periFoam::halo::findPeriods
(
    const vectorField& centre,
    const vectorField& area
)
{
    // Every rank has all cyclic patches, in the same order, without faces if
    // need be
    const polyBoundaryMesh& patches = mesh_.boundaryMesh();
    labelList periods(patches.size(), Zero);
    forAll(patches, cyclici)
    {
        if
        (
           !isA<cyclicPolyPatch>(patches[cyclici])
        || !refCast<const cyclicPolyPatch>(patches[cyclici]).owner()
        )
        {
            continue;
        }
        const auto forEachFace = [&](const std::function<void(label)>& visit)
        {
            forAll(patches, patchi)
            {
                if (cyclicOf(patches, patchi) == cyclici)
                {
                    forAll(patches[patchi], i)
                    {
                        visit(patches[patchi].start() + i);
                    }
                }
            }
        };
        const auto separation = [&](const label facei)
        {
            return centre[boundary(facei)] - mesh_.faceCentres()[facei];
        };
        label n = 0;
        vector mean(Zero);
        forEachFace([&](label facei) { mean += separation(facei); ++n; });
        reduce(mean, sumOp<vector>());
        reduce(n, sumOp<label>());
        mean /= max(n, label(1));

        bool straight = n > 0;
        forEachFace
        (
            [&](label facei)
            {
                const vector& S = mesh_.faceAreas()[facei];
                straight =
                    straight
                 && magSqr(separation(facei) - mean) < sqr(fit)*mag(S)
                 && mag(S + area[boundary(facei)]) < fit*mag(S);
            }
        );
        reduce(straight, andOp<bool>());
        const label period = straight ? periodAt(mean) : 0;
        const label neighbour =
            refCast<const cyclicPolyPatch>(patches[cyclici]).neighbPatchID();
        forAll(patches, patchi)
        {
            const label ofPatch = cyclicOf(patches, patchi);
            if (ofPatch == cyclici)
            {
                periods[patchi] = -period;
            }
            else if (ofPatch >= 0 && ofPatch == neighbour)
            {
                periods[patchi] = period;
            }
        }
    }
    return periods;
}


void Foam::periFoam::halo::findOtherSides(vectorField& area)
{
    const label n = mesh_.nFaces() - mesh_.nInternalFaces();
    labelList rank(n, Pstream::myProcNo()), face(n), cell(n);
    vectorField centre(n);
    area.resize(n);
    for (label i = 0; i < n; ++i)
    {
        const label facei = mesh_.nInternalFaces() + i;
        face[i] = facei;
        cell[i] = mesh_.faceOwner()[facei];
        centre[i] = mesh_.faceCentres()[facei];
        area[i] = mesh_.faceAreas()[facei];
    }
    syncTools::swapBoundaryFaceList(mesh_, rank);
    syncTools::swapBoundaryFaceList(mesh_, face);
    syncTools::swapBoundaryFaceList(mesh_, cell);
    swapVectors(mesh_, centre);
    swapVectors(mesh_, area);
    const labelList periods(findPeriods(centre, area));

    otherCell_.resize(n, key{-1, -1, labelVector(Zero)});
    otherFace_ = otherCell_;
    canonical_.resize(n, true);
    behind_.resize(n);
    forAll(behind_, i)
    {
        behind_[i] = cellFace{mesh_.nInternalFaces() + i, -1};
    }
    const polyBoundaryMesh& patches = mesh_.boundaryMesh();
    forAll(patches, patchi)
    {
        const bool cyclic = cyclicOf(patches, patchi) >= 0;
        const label period = periods[patchi];
        if (cyclic ? period == 0 : !isA<processorPolyPatch>(patches[patchi]))
        {
            continue;
        }
        labelVector turns(Zero);
        if (cyclic)
        {
            turns[mag(period) - 1] = period > 0 ? 1 : -1;
        }
        const bool owner =
            refCast<const coupledPolyPatch>(patches[patchi]).owner();
        forAll(patches[patchi], k)
        {
            const label i = boundary(patches[patchi].start() + k);
            otherCell_[i] = key{rank[i], cell[i], turns};
            otherFace_[i] = key{rank[i], face[i], turns};
            canonical_[i] = owner;
        }
    }
}


void Foam::periFoam::halo::pack
(
    const label celli,
    const labelVector& turns,
    const List<boundBox>& boxes,
    const vectorField& otherArea,
    const vectorField& otherSpan,
    parcel& to
) const
{
    const label me = Pstream::myProcNo();
    const vector by(shift(turns));
    const boundBox box(shifted(boxes[celli], by));
    addKey(to, key{me, celli, turns});
    to.add(box.min());
    to.add(box.max());
    to.add(mesh_.cellCentres()[celli] + by);
    to.labels.append(mesh_.cells()[celli].size());
    for (const label facei : mesh_.cells()[celli])
    {
        key face{me, facei, turns}, across{-1, -1, labelVector(Zero)};
        vector S(mesh_.faceAreas()[facei]), width(boxes[celli].span());
        label patch = -1;
        if (mesh_.isInternalFace(facei))
        {
            const label own = mesh_.faceOwner()[facei];
            across = key
            {
                me,
                own == celli ? mesh_.faceNeighbour()[facei] : own,
                turns
            };
            width = (width + boxes[across.index].span())/2;
        }
        else if (coupled(facei))
        {
            const label i = boundary(facei);
            across = otherCell_[i];
            across.turns += turns;
            width = (width + otherSpan[i])/2;
            if (!canonical_[i])
            {
                face = otherFace_[i];
                face.turns += turns;
                S = otherArea[i];
            }
        }
        else
        {
            patch = mesh_.boundaryMesh().whichPatch(facei);
        }
        addKey(to, face);
        addKey(to, across);
        to.labels.append(patch);
        scalar sign;
        to.add(mesh_.faceCentres()[facei] + by);
        to.add(normalOf(S, sign));
        to.add(width);
    }
}


void Foam::periFoam::halo::build
(
    const scalar halfWidth,
    const vectorField& otherArea,
    List<parcel>& outgoing
)
{
    const label me = Pstream::myProcNo();
    const List<List<leaf>> leaves(allLeaves(mesh_));
    List<leaf> ranks(leaves.size());
    vector largest(Zero);
    rankBoxes_.resize(leaves.size());
    forAll(ranks, rank)
    {
        ranks[rank] = sumOf(leaves[rank]);
        rankBoxes_[rank] = ranks[rank].box;
        largest = max(largest, ranks[rank].span);
    }

    List<boundBox> boxes(mesh_.nCells());
    forAll(boxes, celli)
    {
        boxes[celli] = cellBox(mesh_, celli);
    }
    vectorField otherSpan(mesh_.nFaces() - mesh_.nInternalFaces());
    forAll(otherSpan, i)
    {
        otherSpan[i] =
            boxes[mesh_.faceOwner()[mesh_.nInternalFaces() + i]].span();
    }
    swapVectors(mesh_, otherSpan);

    // Kernels wider than a period see several images
    labelVector most(Zero);
    for (label i = 0; i < nPeriods_; ++i)
    {
        scalar reach = 0;
        for (direction a = 0; a < 3; ++a)
        {
            reach += (halfWidth + 1)*largest[a]*mag(periods_[i][a]);
        }
        most[i] = 1 + label(reach/magSqr(periods_[i]));
    }
    const auto visit = [&](const labelVector& turns)
    {
        const vector by(shift(turns));
        forAll(leaves, rank)
        {
            if
            (
                leaves[rank].empty()
             || (rank == me && turns == labelVector(Zero))
             || !inReach
                (
                    shifted(ranks[me].box, by), ranks[me].span, ranks[rank],
                    halfWidth, mesh_.geometricD()
                )
            )
            {
                continue;
            }
            forAll(boxes, celli)
            {
                const boundBox box(shifted(boxes[celli], by));
                const auto near = [&](const leaf& l)
                {
                    return inReach
                    (
                        box, box.span(), l, halfWidth, mesh_.geometricD()
                    );
                };
                if
                (
                    near(ranks[rank])
                 && std::any_of
                    (
                        leaves[rank].begin(), leaves[rank].end(), near
                    )
                )
                {
                    pack
                    (
                        celli, turns, boxes, otherArea, otherSpan,
                        outgoing[rank]
                    );
                }
            }
        }
    };
    labelVector turns;
    for (turns[0] = -most[0]; turns[0] <= most[0]; ++turns[0])
    {
        for (turns[1] = -most[1]; turns[1] <= most[1]; ++turns[1])
        {
            for (turns[2] = -most[2]; turns[2] <= most[2]; ++turns[2])
            {
                visit(turns);
            }
        }
    }
}


void Foam::periFoam::halo::unpack(const List<parcel>& incoming)
{
    const label me = Pstream::myProcNo();
    std::map<key, label> cellOf, faceOf;
    const auto find = [&]
    (
        const std::map<key, label>& known,
        const key& k
    ) -> label
    {
        if (k.rank == me && k.turns == labelVector(Zero))
        {
            return k.index;
        }
        const auto place = known.find(k);
        return place == known.end() ? -1 : place->second;
    };

    DynamicList<haloCell> cells;
    DynamicList<haloFace> faces;
    DynamicList<cellFace> cellFaces;
    DynamicList<key> across;
    for (const parcel& p : incoming)
    {
        parcelReader from(p);
        while (!from.ended())
        {
            const key ofCell(getKey(from));
            const point low(from.getVector()), high(from.getVector());
            const point centre(from.getVector());
            const label n = from.getLabel();
            cellOf[ofCell] = mesh_.nCells() + cells.size();
            cells.append
            (
                haloCell
                {
                    ofCell.rank, ofCell.index, boundBox(low, high), centre,
                    cellFaces.size(), n
                }
            );
            for (label i = 0; i < n; ++i)
            {
                const key ofFace(getKey(from));
                across.append(getKey(from));
                const label patch = from.getLabel();
                const point at(from.getVector());
                const vector normal(from.getVector()), width(from.getVector());
                label facei = find(faceOf, ofFace);
                if (facei < 0)
                {
                    facei = mesh_.nFaces() + faces.size();
                    faceOf[ofFace] = facei;
                    faces.append
                    (
                        haloFace
                        {
                            ofFace.rank, ofFace.index, at, normal, width, patch
                        }
                    );
                }
                cellFaces.append(cellFace{facei, -1});
            }
        }
    }
    forAll(cellFaces, i)
    {
        cellFaces[i].across = across[i].rank < 0 ? -1 : find(cellOf, across[i]);
    }
    cells_ = cells;
    faces_ = faces;
    cellFaces_ = cellFaces;
    forAll(behind_, i)
    {
        if (otherCell_[i].rank < 0)
        {
            continue;
        }
        behind_[i].across = find(cellOf, otherCell_[i]);
        if (!canonical_[i])
        {
            behind_[i].face = find(faceOf, otherFace_[i]);
        }
    }
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::halo::halo(const fvMesh& mesh, const scalar halfWidth)
:
    mesh_(mesh),
    periods_{Zero, Zero, Zero},
    nPeriods_(0)
{
    vectorField otherArea;
    findOtherSides(otherArea);
    List<parcel> outgoing(Pstream::nProcs());
    build(halfWidth, otherArea, outgoing);
    unpack(deliver(outgoing));
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

bool Foam::periFoam::halo::needed(const fvMesh& mesh)
{
    if (Pstream::parRun())
    {
        return true;
    }
    for (const polyPatch& patch : mesh.boundaryMesh())
    {
        if (isA<cyclicPolyPatch>(patch))
        {
            return true;
        }
    }
    return false;
}


Foam::boundBox Foam::periFoam::halo::cellBox
(
    const fvMesh& mesh,
    const label celli
)
{
    boundBox box(boundBox::invertedBox);
    for (const label facei : mesh.cells()[celli])
    {
        for (const label pointi : mesh.faces()[facei])
        {
            box.add(mesh.points()[pointi]);
        }
    }
    return box;
}


Foam::boundBox Foam::periFoam::halo::placeBox
(
    const fvMesh& mesh,
    const label celli
)
{
    // A walk may call points inside that lie outside by as much as faces warp
    scalar warp = 0;
    for (const label facei : mesh.cells()[celli])
    {
        const vector& S = mesh.faceAreas()[facei];
        for (const label pointi : mesh.faces()[facei])
        {
            const vector arm(mesh.points()[pointi] - mesh.faceCentres()[facei]);
            warp = max(warp, mag(arm & S)/mag(S));
        }
    }
    boundBox box(cellBox(mesh, celli));
    box.min() -= 2*warp*vector::one;
    box.max() += 2*warp*vector::one;
    return box;
}


Foam::vector Foam::periFoam::halo::normalOf(const vector& area, scalar& sign)
{
    const label axis = findMax
    (
        FixedList<scalar, 3>
        ({
            std::fabs(area.x()), std::fabs(area.y()), std::fabs(area.z())
        })
    );
    sign = area[axis] < 0 ? -1 : 1;
    return sign*area/mag(area);
}


Foam::labelVector Foam::periFoam::halo::turnsInto(const point& x) const
{
    labelVector turns(Zero);
    if (!mesh_.bounds().contains(x))
    {
        const vector arm(mesh_.bounds().midpoint() - x);
        for (label i = 0; i < nPeriods_; ++i)
        {
            const scalar n = (arm & periods_[i])/magSqr(periods_[i]);
            turns[i] = mag(n) < 1e6 ? std::lround(n) : 0; // else lost
        }
    }
    return turns;
}


Foam::label Foam::periFoam::halo::bytes() const
{
    return
        otherCell_.size()*label(2*sizeof(key) + sizeof(cellFace))
      + canonical_.byteSize()
      + cells_.size()*label(sizeof(haloCell))
      + faces_.size()*label(sizeof(haloFace))
      + cellFaces_.size()*label(sizeof(cellFace))
      + rankBoxes_.size()*label(sizeof(boundBox));
}


// ************************************************************************* //
