/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "stencils.H"
#include "coupledPolyPatch.H"
#include "emptyPolyPatch.H"
#include "wedgePolyPatch.H"
#include "HashSet.H"

#include <cmath>

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

//- Coordinates closer than this share of the kernel width are the same
constexpr scalar same = 1e-6;

//- Longest row of samples in a block; a stencil with more is a plain list
constexpr label longestRow = 32;

//- Most unknowns of a linear velocity field: 3 values and 9 gradients
constexpr label mostUnknowns = 12;

//- Gradients are fitted where the spread of the samples about their centre is
//  at least this, in squared kernel widths
constexpr scalar leastSpread = 1e-3;

//- The spread with what makes gradients fade, without a jump, where samples
//  no longer determine them: next to walls, with narrow kernels
inline scalar faded(const scalar spread)
{
    const scalar lack = leastSpread - spread;
    return lack > 0 ? spread + lack*lack/leastSpread : spread;
}

//- In-place Cholesky factors of the leading m x m part of A, of which the first
//  `values` unknowns are values and the others their gradients in kernel
//  widths, n of each; false where not even the values are determined
bool factorise
(
    scalar (&A)[mostUnknowns][mostUnknowns],
    const label values,
    const label n,
    const label m
)
{
    scalar start[mostUnknowns];
    for (label j = 0; j < values; ++j)
    {
        start[j] = A[j][j];
    }
    for (label j = 0; j < m; ++j)
    {
        for (label k = 0; k < j; ++k)
        {
            A[j][j] -= A[j][k]*A[j][k];
        }
        if (j >= values)
        {
            const scalar scale = start[(j - values)/n];
            A[j][j] = scale*faded(A[j][j]/scale);
        }
        else if (!(A[j][j] > 1e-8*start[j]))
        {
            return false;
        }
        A[j][j] = std::sqrt(A[j][j]);
        for (label i = j + 1; i < m; ++i)
        {
            for (label k = 0; k < j; ++k)
            {
                A[i][j] -= A[i][k]*A[j][k];
            }
            A[i][j] /= A[j][j];
        }
    }
    return true;
}

void substitute
(
    const scalar (&L)[mostUnknowns][mostUnknowns],
    const label m,
    scalar (&b)[mostUnknowns]
)
{
    for (label i = 0; i < m; ++i)
    {
        for (label k = 0; k < i; ++k)
        {
            b[i] -= L[i][k]*b[k];
        }
        b[i] /= L[i][i];
    }
    for (label i = m - 1; i >= 0; --i)
    {
        for (label k = i + 1; k < m; ++k)
        {
            b[i] -= L[k][i]*b[k];
        }
        b[i] /= L[i][i];
    }
}

//- Values that differ by more than `same` widths, rising; and their widths
void distinct
(
    scalarList& values,
    const scalarList& width,
    DynamicList<scalar>& coordinate,
    DynamicList<scalar>& coordinateWidth
)
{
    labelList order;
    sortedOrder(values, order);
    for (const label i : order)
    {
        if
        (
            coordinate.empty()
         || values[i] - coordinate.last() > same*width[i]
        )
        {
            coordinate.append(values[i]);
            coordinateWidth.append(width[i]);
        }
    }
}

//- Visit the rows of a block: the label of each sample in sample[0, n) and its
//  weight in v[]. w, where the weights of the block start, moves on to the
//  next block
template<class Row>
inline void forEachRow
(
    const Foam::periFoam::stencils::block& b,
    const scalar*& w,
    const label* sample,
    const Row& row
)
{
    // flat ? p p p : p p p + q p p + p q p + p p q
    const label n = b.n[2];
    const bool flat = *w++;
    const scalar* p0 = w;
    const scalar* q0 = p0 + b.n[0];
    const scalar* p1 = q0 + b.n[0];
    const scalar* q1 = p1 + b.n[1];
    const scalar* p2 = q1 + b.n[1];
    const scalar* q2 = p2 + n;
    scalar v[longestRow];
    for (label i = 0; i < b.n[0]; ++i)
    {
        for (label j = 0; j < b.n[1]; ++j, sample += n)
        {
            const scalar c = p0[i]*p1[j];
            if (flat)
            {
                for (label k = 0; k < n; ++k)
                {
                    v[k] = c*p2[k];
                }
            }
            else
            {
                const scalar a = c + q0[i]*p1[j] + p0[i]*q1[j];
                for (label k = 0; k < n; ++k)
                {
                    v[k] = a*p2[k] + c*q2[k];
                }
            }
            row(n, sample, v);
        }
    }
    w = q2 + n;
}

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

const Foam::boundBox& Foam::periFoam::stencils::cellBox
(
    const label celli
) const
{
    const auto known = cellBoxes_.cfind(celli);
    if (known.found())
    {
        return *known;
    }
    cellBoxes_.insert
    (
        celli,
        celli < mesh_.nCells()
      ? halo::cellBox(mesh_, celli)
      : halo_->cell(celli).box
    );
    return cellBoxes_[celli];
}


Foam::boundBox Foam::periFoam::stencils::boxOf(const label celli) const
{
    const boundBox& box = cellBox(celli);
    const vector slack(same*box.span());
    for (const label facei : mesh_.cells()[celli])
    {
        for (const label pointi : mesh_.faces()[facei])
        {
            const point& x = mesh_.points()[pointi];
            for (const label d : directions_)
            {
                if
                (
                    x[d] > box.min()[d] + slack[d]
                 && x[d] < box.max()[d] - slack[d]
                )
                {
                    return boundBox(boundBox::invertedBox);
                }
            }
        }
    }
    return boundBox(box.min() + slack, box.max() - slack);
}


const Foam::point& Foam::periFoam::stencils::placeOf(const label label) const
{
    if (type_ == CELLS)
    {
        return
            isGhost(label)
          ? halo_->cell(label).centre
          : mesh_.cellCentres()[label];
    }
    return
        isGhost(label) ? halo_->face(label).centre : mesh_.faceCentres()[label];
}


Foam::vector Foam::periFoam::stencils::widthAt(const label label) const
{
    if (type_ == CELLS)
    {
        return cellBox(label).span();
    }
    if (isGhost(label))
    {
        return halo_->face(label).width;
    }
    Foam::label behind = -1;
    if (mesh_.isInternalFace(label))
    {
        behind = mesh_.faceNeighbour()[label];
    }
    else if (halo_)
    {
        behind = halo_->behind(label).across;
    }
    const vector owner(cellBox(mesh_.faceOwner()[label]).span());
    return behind < 0 ? owner : (owner + cellBox(behind).span())/2;
}


bool Foam::periFoam::stencils::usable(const label facei) const
{
    label patchi = -1;
    if (facei >= mesh_.nFaces())
    {
        patchi = halo_->face(facei).patch;
    }
    else if
    (
       !mesh_.isInternalFace(facei)
    && !(halo_ && halo_->coupled(facei))
    )
    {
        patchi = mesh_.boundaryMesh().whichPatch(facei);
    }
    if (patchi < 0)
    {
        return true;
    }
    const polyPatch& patch = mesh_.boundaryMesh()[patchi];

    // The geometry of cyclicAMI does not call itself coupled
    if (isA<coupledPolyPatch>(patch))
    {
        FatalErrorInFunction
            << "a body is within a kernel's reach of patch " << patch.name()
            << " of type " << patch.type() << "; allowed near a body: cyclic"
            << " patches that are shifted, not turned, copies of each other,"
            << " with at most three different shifts; patches that are not"
            << " coupled" << exit(FatalError);
    }
    return !isA<emptyPolyPatch>(patch) && !isA<wedgePolyPatch>(patch);
}


void Foam::periFoam::stencils::facesOf
(
    const label celli,
    DynamicList<halo::cellFace>& faces
) const
{
    faces.clear();
    if (celli >= mesh_.nCells())
    {
        const halo::haloCell& c = halo_->cell(celli);
        for (label i = 0; i < c.size; ++i)
        {
            faces.append(halo_->faceOf(c, i));
        }
        return;
    }
    for (const label facei : mesh_.cells()[celli])
    {
        if (mesh_.isInternalFace(facei))
        {
            const label own = mesh_.faceOwner()[facei];
            faces.append
            (
                halo::cellFace
                {
                    facei,
                    own == celli ? mesh_.faceNeighbour()[facei] : own
                }
            );
        }
        else if (halo_)
        {
            faces.append(halo_->behind(facei));
        }
        else
        {
            faces.append(halo::cellFace{facei, -1});
        }
    }
}


Foam::label Foam::periFoam::stencils::compactOf(const label label)
{
    if (compact_[label] >= 0)
    {
        return compact_[label];
    }
    compact_[label] = sampled_.size();
    if (isGhost(label))
    {
        ghosts_.append(sampled_.size());
        ghostLabel_.append(label);
    }
    sampled_.append(isGhost(label) ? -1 : label);
    width_.append(widthAt(label));
    for (const Foam::label d : directions_)
    {
        smallestWidth_ = min(smallestWidth_, width_.last()[d]);
    }
    position_.append(placeOf(label));
    if (type_ == CELLS)
    {
        return compact_[label];
    }
    if (isGhost(label))
    {
        normal_.append(halo_->face(label).normal);
        rArea_.append(0);
        return compact_[label];
    }
    const vector& S = mesh_.faceAreas()[label];
    scalar sign;
    normal_.append(halo::normalOf(S, sign));
    rArea_.append(sign/mag(S));
    return compact_[label];
}


bool Foam::periFoam::stencils::within
(
    const point& x,
    const vector& width,
    const boundBox& box
) const
{
    for (const label d : directions_)
    {
        const scalar reach = (kernel_.halfWidth - same)*width[d];
        if (x[d] <= box.min()[d] - reach || x[d] >= box.max()[d] + reach)
        {
            return false;
        }
    }
    return true;
}


bool Foam::periFoam::stencils::around
(
    const boundBox& cell,
    const boundBox& box
) const
{
    for (const label d : directions_)
    {
        const scalar reach =
            (kernel_.halfWidth + 1)*max(cell.span()[d], box.span()[d]);
        if
        (
            cell.max()[d] < box.min()[d] - reach
         || cell.min()[d] > box.max()[d] + reach
        )
        {
            return false;
        }
    }
    return true;
}


void Foam::periFoam::stencils::collect
(
    const label celli,
    DynamicList<label>& found
)
{
    const boundBox box(halo::placeBox(mesh_, celli));
    const auto inReach = [&](const label label)
    {
        return within(placeOf(label), widthAt(label), box);
    };
    labelHashSet seenCells, seenFaces;
    DynamicList<label> queue;
    DynamicList<halo::cellFace> faces;
    queue.append(celli);
    seenCells.insert(celli);

    while (queue.size())
    {
        const label here = queue.remove();
        const bool holds = type_ == CELLS && inReach(here);
        if (holds)
        {
            found.append(here);
        }
        facesOf(here, faces);
        for (const halo::cellFace& f : faces)
        {
            if (!seenFaces.insert(f.face))
            {
                continue;
            }
            if (type_ == FACES && inReach(f.face) && usable(f.face))
            {
                found.append(f.face);
            }
            if (f.across < 0)
            {
                if (holds)
                {
                    usable(f.face);
                }
                continue;
            }

            // Through cells that are not in reach too: samples behind them,
            // larger or around a corner, may be
            if (seenCells.insert(f.across) && around(cellBox(f.across), box))
            {
                queue.append(f.across);
            }
        }
    }
    // By label, not in the order of meeting, so that sums do not depend on what
    // came before: a run that was interrupted goes on to the last bit
    sort(found);
    for (label& sample : found)
    {
        sample = compactOf(sample);
    }
}


const Foam::labelList& Foam::periFoam::stencils::order() const
{
    if (order_.size() != sampled_.size())
    {
        sortedOrder(sampled_, order_);
    }
    return order_;
}


bool Foam::periFoam::stencils::appendBlock
(
    const UList<label>& found,
    const label component
)
{
    block b;
    b.component = component;
    label total = 1;
    List<DynamicList<scalar>> coordinate(3), width(3);
    for (label k = 0; k < 3; ++k)
    {
        const label axis = axes_[k];
        scalarList x(found.size()), w(found.size());
        forAll(found, i)
        {
            x[i] = position_[found[i]][axis];
            w[i] = width_[found[i]][axis];
        }
        if (directions_.found(axis))
        {
            distinct(x, w, coordinate[k], width[k]);
        }
        else
        {
            coordinate[k].append(0);
            width[k].append(1);
        }
        b.n[k] = coordinate[k].size();
        total *= b.n[k];
    }
    if (total != found.size() || !total || b.n[2] > longestRow)
    {
        return false;
    }

    labelList slot(total, -1);
    for (const label sample : found)
    {
        label index = 0;
        for (label k = 0; k < 3; ++k)
        {
            label place = 0;
            const label axis = axes_[k];
            if (directions_.found(axis))
            {
                const scalar slack = same*width_[sample][axis];
                while
                (
                    place < b.n[k]
                 && mag(coordinate[k][place] - position_[sample][axis]) > slack
                )
                {
                    ++place;
                }
                if
                (
                    place == b.n[k]
                 || mag(width[k][place] - width_[sample][axis]) > slack
                )
                {
                    return false;
                }
            }
            index = index*b.n[k] + place;
        }
        if (slot[index] >= 0)
        {
            return false;
        }
        slot[index] = sample;
    }

    for (label k = 0; k < 3; ++k)
    {
        b.start[k] = coordinates_.size();
        coordinates_.append(coordinate[k]);
        for (const scalar w : width[k])
        {
            rWidths_.append(1/w);
        }
    }
    b.first = samples_.size();
    samples_.append(slot);
    blocks_.append(b);
    return true;
}


void Foam::periFoam::stencils::append(const label celli)
{
    DynamicList<label> found;
    collect(celli, found);

    stencil s{blocks_.size(), 0, 0, 0, boxOf(celli)};
    bool rectilinear = true;
    if (type_ == CELLS)
    {
        rectilinear = appendBlock(found, -1);
        s.nBlocks = 1;
    }
    else
    {
        label aligned = 0;
        for (const label d : directions_)
        {
            DynamicList<label> along;
            for (const label sample : found)
            {
                if (normal_[sample][d] > 1 - 1e-10)
                {
                    along.append(sample);
                }
            }
            aligned += along.size();
            rectilinear = rectilinear && appendBlock(along, d);
            ++s.nBlocks;
        }
        rectilinear = rectilinear && aligned == found.size();
    }
    if (!rectilinear)
    {
        blocks_.resize(s.block);
        s.nBlocks = 0;
        s.first = samples_.size();
        s.size = found.size();
        samples_.append(found);
    }
    stencilOfCell_[celli] = stencils_.size();
    stencils_.append(s);
}


bool Foam::periFoam::stencils::weigh1D
(
    const block& b,
    const label k,
    const scalar X,
    const bool linear,
    scalar* w
) const
{
    const label n = b.n[k];
    scalar* q = w + n;
    if (n == 1)
    {
        w[0] = 1;
        q[0] = 0;
        return true;
    }
    const scalar* x = &coordinates_[b.start[k]];
    kernel_.evaluate(n, X, x, &rWidths_[b.start[k]], w);

    scalar sum = 0, offset = 0;
    for (label i = 0; i < n; ++i)
    {
        sum += w[i];
        offset += w[i]*(x[i] - X);
    }
    const scalar rSum = 1/sum;
    offset *= rSum;
    for (label i = 0; i < n; ++i)
    {
        w[i] *= rSum;
    }

    // On a uniform grid away from walls the first moment vanishes by itself
    if (!linear || mag(offset)*rWidths_[b.start[k]] < 1e-13)
    {
        std::fill(q, q + n, 0);
        return true;
    }
    scalar width = 0, spread = 0;
    for (label i = 0; i < n; ++i)
    {
        width += w[i]/rWidths_[b.start[k] + i];
    }
    for (label i = 0; i < n; ++i)
    {
        q[i] = (x[i] - X - offset)/width;
        spread += w[i]*q[i]*q[i];
    }
    const scalar slope = -offset/width/faded(spread);
    for (label i = 0; i < n; ++i)
    {
        q[i] *= slope*w[i];
    }
    return false;
}


Foam::scalar Foam::periFoam::stencils::kernelOf
(
    const label sample,
    const point& x
) const
{
    scalar product = 1;
    for (const label a : directions_)
    {
        const scalar rWidth = 1/width_[sample][a];
        scalar factor;
        kernel_.evaluate(1, x[a], &position_[sample][a], &rWidth, &factor);
        product *= factor;
    }
    return product;
}


void Foam::periFoam::stencils::weighList
(
    const stencil& s,
    const point& x,
    scalar* w
) const
{
    const label d = directions_.size();
    const label targets = type_ == FACES ? d : 1;
    const label unknowns = targets*(1 + d);

    scalar A[mostUnknowns][mostUnknowns] = {{0}};
    List<FixedList<scalar, mostUnknowns>> rows(s.size);
    scalarList weight(s.size);
    scalar sum = 0;
    vector width(Zero);
    for (label i = 0; i < s.size; ++i)
    {
        const label sample = samples_[s.first + i];
        weight[i] = kernelOf(sample, x);
        sum += weight[i];
        width += weight[i]*width_[sample];
    }
    width /= sum;
    for (label i = 0; i < s.size; ++i)
    {
        const label sample = samples_[s.first + i];
        label column = targets;
        for (label t = 0; t < targets; ++t)
        {
            rows[i][t] = type_ == FACES ? normal_[sample][directions_[t]] : 1;
        }
        for (label t = 0; t < targets; ++t)
        {
            for (const label a : directions_)
            {
                rows[i][column++] =
                    rows[i][t]*(position_[sample][a] - x[a])/width[a];
            }
        }
        for (label r = 0; r < unknowns; ++r)
        {
            for (label c = 0; c <= r; ++c)
            {
                A[r][c] += weight[i]*rows[i][r]*rows[i][c];
            }
        }
    }

    if (!factorise(A, targets, d, unknowns))
    {
        FatalErrorInFunction
            << "the " << s.size << " faces around the point " << x
            << " do not determine its velocity; allowed: meshes with at "
            << "least two cells in each direction near a body"
            << exit(FatalError);
    }
    for (label t = 0; t < targets; ++t)
    {
        scalar z[mostUnknowns] = {0};
        z[t] = 1;
        substitute(A, unknowns, z);
        for (label i = 0; i < s.size; ++i)
        {
            scalar value = 0;
            for (label r = 0; r < unknowns; ++r)
            {
                value += rows[i][r]*z[r];
            }
            w[i*targets + t] = weight[i]*value;
        }
    }
}


void Foam::periFoam::stencils::weighPositive
(
    const stencil& s,
    const point& x,
    scalar* w
) const
{
    scalar sum = 0;
    for (label i = 0; i < s.size; ++i)
    {
        w[i] = kernelOf(samples_[s.first + i], x);
        sum += w[i];
    }
    for (label i = 0; i < s.size; ++i)
    {
        w[i] /= sum;
    }
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoam::stencils::stencils
(
    const fvMesh& mesh,
    const kernel& k,
    const sampleType type,
    const halo* beyond
)
:
    mesh_(mesh),
    kernel_(k),
    type_(type),
    halo_(beyond),
    stencilOfCell_(mesh.nCells(), -1),
    compact_
    (
        type == FACES
      ? mesh.nFaces() + (beyond ? beyond->nFaces() : 0)
      : mesh.nCells() + (beyond ? beyond->nCells() : 0),
        -1
    ),
    smallestWidth_(GREAT)
{
    DynamicList<label> solved(3);
    for (direction d = 0; d < 3; ++d)
    {
        if (mesh.geometricD()[d] > 0)
        {
            solved.append(d);
        }
    }
    directions_ = solved;

    label next = 0;
    for (label d = 0; d < 3; ++d)
    {
        if (!directions_.found(d))
        {
            axes_[next++] = d;
        }
    }
    for (const label d : directions_)
    {
        axes_[next++] = d;
    }
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

bool Foam::periFoam::stencils::inside(const point& x, const label celli) const
{
    const label si = stencilOfCell_[celli];
    if (si < 0)
    {
        return false;
    }
    const boundBox& box = stencils_[si].box;
    for (const label d : directions_)
    {
        if (x[d] <= box.min()[d] || x[d] >= box.max()[d])
        {
            return false;
        }
    }
    return true;
}


void Foam::periFoam::stencils::weigh
(
    const UList<point>& x,
    const labelUList& cell,
    const bool linear,
    weights& result
)
{
    const label perSample = type_ == FACES ? directions_.size() : 1;
    result.stencil.resize(x.size());
    result.first.resize(x.size());

    label total = 0;
    forAll(x, p)
    {
        if (stencilOfCell_[cell[p]] < 0)
        {
            append(cell[p]);
        }
        const label si = stencilOfCell_[cell[p]];
        const stencil& s = stencils_[si];
        result.stencil[p] = si;
        result.first[p] = total;
        total += s.size*perSample;
        for (label k = s.block; k < s.block + s.nBlocks; ++k)
        {
            total +=
                1 + 2*(blocks_[k].n[0] + blocks_[k].n[1] + blocks_[k].n[2]);
        }
    }
    result.w.resize(total);

    forAll(x, p)
    {
        const stencil& s = stencils_[result.stencil[p]];
        scalar* w = result.w.data() + result.first[p];
        for (label bi = s.block; bi < s.block + s.nBlocks; ++bi)
        {
            scalar& flat = *w++;
            flat = 1;
            for (label k = 0; k < 3; ++k)
            {
                if (!weigh1D(blocks_[bi], k, x[p][axes_[k]], linear, w))
                {
                    flat = 0;
                }
                w += 2*blocks_[bi].n[k];
            }
        }
        if (s.nBlocks)
        {
            continue;
        }
        if (linear)
        {
            weighList(s, x[p], w);
        }
        else
        {
            weighPositive(s, x[p], w);
        }
    }
}


void Foam::periFoam::stencils::gather
(
    const weights& weight,
    const UList<scalar>& samples,
    UList<vector>& result
) const
{
    const label d = directions_.size();
    forAll(result, p)
    {
        const stencil& s = stencils_[weight.stencil[p]];
        const scalar* w = weight.w.cdata() + weight.first[p];
        vector sum(Zero);
        for (label k = s.block; k < s.block + s.nBlocks; ++k)
        {
            const block& b = blocks_[k];
            if (type_ == FACES)
            {
                scalar one = 0;
                forEachRow
                (
                    b, w, &samples_[b.first],
                    [&](label n, const label* i, const scalar* v)
                    {
                        for (label j = 0; j < n; ++j)
                        {
                            one += v[j]*samples[i[j]];
                        }
                    }
                );
                sum[b.component] += one;
            }
            else
            {
                forEachRow
                (
                    b, w, &samples_[b.first],
                    [&](label n, const label* i, const scalar* v)
                    {
                        for (label j = 0; j < n; ++j)
                        {
                            for (const label a : directions_)
                            {
                                sum[a] += v[j]*samples[3*i[j] + a];
                            }
                        }
                    }
                );
            }
        }
        for (label k = 0; k < s.size; ++k)
        {
            const label i = samples_[s.first + k];
            for (label a = 0; a < d; ++a)
            {
                sum[directions_[a]] +=
                    type_ == FACES
                  ? w[k*d + a]*samples[i]
                  : w[k]*samples[3*i + directions_[a]];
            }
        }
        result[p] = sum;
    }
}


void Foam::periFoam::stencils::scatter
(
    const weights& weight,
    const UList<vector>& values,
    UList<scalar>& samples
) const
{
    const label d = directions_.size();
    forAll(values, p)
    {
        const stencil& s = stencils_[weight.stencil[p]];
        const scalar* w = weight.w.cdata() + weight.first[p];
        const vector& value = values[p];
        for (label k = s.block; k < s.block + s.nBlocks; ++k)
        {
            const block& b = blocks_[k];
            if (type_ == FACES)
            {
                const scalar one = value[b.component];
                forEachRow
                (
                    b, w, &samples_[b.first],
                    [&](label n, const label* i, const scalar* v)
                    {
                        for (label j = 0; j < n; ++j)
                        {
                            samples[i[j]] += one*v[j];
                        }
                    }
                );
            }
            else
            {
                forEachRow
                (
                    b, w, &samples_[b.first],
                    [&](label n, const label* i, const scalar* v)
                    {
                        for (label j = 0; j < n; ++j)
                        {
                            for (const label a : directions_)
                            {
                                samples[3*i[j] + a] += v[j]*value[a];
                            }
                        }
                    }
                );
            }
        }
        for (label k = 0; k < s.size; ++k)
        {
            const label i = samples_[s.first + k];
            for (label a = 0; a < d; ++a)
            {
                if (type_ == FACES)
                {
                    samples[i] += w[k*d + a]*value[directions_[a]];
                }
                else
                {
                    samples[3*i + directions_[a]] += w[k]*value[directions_[a]];
                }
            }
        }
    }
}


void Foam::periFoam::stencils::scatter
(
    const weights& weight,
    const UList<scalar>& values,
    UList<scalar>& samples
) const
{
    forAll(values, p)
    {
        const stencil& s = stencils_[weight.stencil[p]];
        const scalar* w = weight.w.cdata() + weight.first[p];
        const scalar value = values[p];
        for (label k = s.block; k < s.block + s.nBlocks; ++k)
        {
            const block& b = blocks_[k];
            forEachRow
            (
                b, w, &samples_[b.first],
                [&](label n, const label* i, const scalar* v)
                {
                    for (label j = 0; j < n; ++j)
                    {
                        samples[i[j]] += v[j]*value;
                    }
                }
            );
        }
        for (label k = 0; k < s.size; ++k)
        {
            samples[samples_[s.first + k]] += w[k]*value;
        }
    }
}


Foam::label Foam::periFoam::stencils::bytes() const
{
    return
        stencilOfCell_.byteSize() + compact_.byteSize()
      + stencils_.size()*label(sizeof(stencil))
      + blocks_.size()*label(sizeof(block))
      + coordinates_.byteSize() + rWidths_.byteSize()
      + samples_.byteSize() + sampled_.byteSize() + position_.byteSize()
      + ghosts_.byteSize() + ghostLabel_.byteSize()
      + normal_.byteSize() + width_.byteSize() + rArea_.byteSize()
      + cellBoxes_.size()*label(sizeof(boundBox) + sizeof(label));
}


// ************************************************************************* //
