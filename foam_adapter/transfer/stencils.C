/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "stencils.H"
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

//- Most unknowns of a linear velocity field: 3 values and 9 gradients
constexpr label mostUnknowns = 12;

//- In-place Cholesky factors of the leading m x m part of A; false where a
//  pivot falls below round-off of what it started from
bool factorise(scalar (&A)[mostUnknowns][mostUnknowns], const label m)
{
    for (label j = 0; j < m; ++j)
    {
        const scalar start = A[j][j];
        for (label k = 0; k < j; ++k)
        {
            A[j][j] -= A[j][k]*A[j][k];
        }
        if (!(A[j][j] > 1e-8*start))
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

//- Visit the rows of a block: the label of each sample in sample[0, n), its
//  weight along the row in along[], the product of the others in across.
//  w, where the weights of the block start, moves on to the next block
template<class Row>
inline void forEachRow
(
    const Foam::periFoam::stencils::block& b,
    const scalar*& w,
    const label* sample,
    const Row& row
)
{
    const scalar* w0 = w;
    const scalar* w1 = w0 + b.n[0];
    const scalar* along = w1 + b.n[1];
    const label n = b.n[2];
    for (label i = 0; i < b.n[0]; ++i)
    {
        for (label j = 0; j < b.n[1]; ++j, sample += n)
        {
            row(n, sample, along, w0[i]*w1[j]);
        }
    }
    w = along + n;
}

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

Foam::boundBox Foam::periFoam::stencils::cellBox(const label celli) const
{
    boundBox box(boundBox::invertedBox);
    for (const label facei : mesh_.cells()[celli])
    {
        for (const label pointi : mesh_.faces()[facei])
        {
            box.add(mesh_.points()[pointi]);
        }
    }
    return box;
}


Foam::vector Foam::periFoam::stencils::widthAt(const label label) const
{
    if (type_ == CELLS)
    {
        return cellBox(label).span();
    }
    const vector owner(cellBox(mesh_.faceOwner()[label]).span());
    return
        mesh_.isInternalFace(label)
      ? (owner + cellBox(mesh_.faceNeighbour()[label]).span())/2
      : owner;
}


bool Foam::periFoam::stencils::usable(const label facei) const
{
    if (mesh_.isInternalFace(facei))
    {
        return true;
    }
    const polyPatch& patch =
        mesh_.boundaryMesh()[mesh_.boundaryMesh().whichPatch(facei)];
    if (patch.coupled())
    {
        FatalErrorInFunction
            << "a body is within a kernel's reach of patch " << patch.name()
            << " of type " << patch.type() << "; allowed near a body: "
            << "patches that are not coupled" << exit(FatalError);
    }
    return !isA<emptyPolyPatch>(patch) && !isA<wedgePolyPatch>(patch);
}


Foam::label Foam::periFoam::stencils::compactOf(const label label)
{
    if (compact_[label] >= 0)
    {
        return compact_[label];
    }
    compact_[label] = sampled_.size();
    sampled_.append(label);
    width_.append(widthAt(label));
    for (const Foam::label d : directions_)
    {
        smallestWidth_ = min(smallestWidth_, width_.last()[d]);
    }
    if (type_ == CELLS)
    {
        position_.append(mesh_.cellCentres()[label]);
        return compact_[label];
    }
    position_.append(mesh_.faceCentres()[label]);
    const vector& S = mesh_.faceAreas()[label];

    // Normals point along the axis they are nearest to, so that samples on
    // a boundary, whose normals point outwards, agree with those inside
    const Foam::label axis = findMax
    (
        FixedList<scalar, 3>({std::fabs(S.x()), std::fabs(S.y()), std::fabs(S.z())})
    );
    const scalar sign = S[axis] < 0 ? -1 : 1;
    normal_.append(sign*S/mag(S));
    rArea_.append(sign/mag(S));
    return compact_[label];
}


bool Foam::periFoam::stencils::within
(
    const label compact,
    const boundBox& box
) const
{
    const point& x = position_[compact];
    for (const label d : directions_)
    {
        const scalar reach = (kernel_.halfWidth - same)*width_[compact][d];
        if (x[d] <= box.min()[d] - reach || x[d] >= box.max()[d] + reach)
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
    const boundBox box(cellBox(celli));
    labelHashSet seenCells, seenFaces;
    DynamicList<label> queue;
    queue.append(celli);
    seenCells.insert(celli);

    while (queue.size())
    {
        const label here = queue.remove();
        if (type_ == CELLS)
        {
            found.append(compactOf(here));
        }
        for (const label facei : mesh_.cells()[here])
        {
            if (!seenFaces.insert(facei) || !usable(facei))
            {
                continue;
            }
            bool cross = type_ == CELLS;
            if (type_ == FACES && within(compactOf(facei), box))
            {
                found.append(compactOf(facei));
                cross = true;
            }
            if (!cross || !mesh_.isInternalFace(facei))
            {
                continue;
            }
            const label owner = mesh_.faceOwner()[facei];
            const label next =
                owner == here ? mesh_.faceNeighbour()[facei] : owner;
            if
            (
                !seenCells.found(next)
             && (type_ == FACES || within(compactOf(next), box))
            )
            {
                seenCells.insert(next);
                queue.append(next);
            }
        }
    }
    sort(found);
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
    if (total != found.size() || !total)
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

    stencil s{blocks_.size(), 0, 0, 0};
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


void Foam::periFoam::stencils::weigh1D
(
    const block& b,
    const label k,
    const scalar X,
    const bool linear,
    scalar* w
) const
{
    const label n = b.n[k];
    if (n == 1)
    {
        w[0] = 1;
        return;
    }
    const scalar* x = &coordinates_[b.start[k]];
    const scalar* rWidth = &rWidths_[b.start[k]];
    kernel_.evaluate(n, X, x, rWidth, w);

    scalar m0 = 0, m1 = 0, m2 = 0;
    for (label i = 0; i < n; ++i)
    {
        const scalar r = (x[i] - X)*rWidth[0];
        const scalar wr = w[i]*r;
        m0 += w[i];
        m1 += wr;
        m2 += wr*r;
    }
    const scalar determinant = m0*m2 - m1*m1;
    const bool bend = linear && determinant > 1e-8*m0*m2;
    const scalar a = bend ? m2/determinant : 1/m0;
    const scalar c = bend ? m1*rWidth[0]/determinant : 0;
    for (label i = 0; i < n; ++i)
    {
        w[i] *= a - c*(x[i] - X);
    }
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
    const scalar length = width_[samples_[s.first]][directions_[0]];
    for (label i = 0; i < s.size; ++i)
    {
        const label sample = samples_[s.first + i];
        weight[i] = 1;
        for (const label a : directions_)
        {
            const scalar rWidth = 1/width_[sample][a];
            scalar factor;
            kernel_.evaluate(1, x[a], &position_[sample][a], &rWidth, &factor);
            weight[i] *= factor;
        }
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
                    rows[i][t]*(position_[sample][a] - x[a])/length;
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

    scalar L[mostUnknowns][mostUnknowns];
    label m = unknowns;
    std::copy(&A[0][0], &A[0][0] + mostUnknowns*mostUnknowns, &L[0][0]);
    if (!factorise(L, m))
    {
        m = targets;
        std::copy(&A[0][0], &A[0][0] + mostUnknowns*mostUnknowns, &L[0][0]);
        if (!factorise(L, m))
        {
            FatalErrorInFunction
                << "the " << s.size << " faces around the point " << x
                << " do not determine its velocity; allowed: meshes with at "
                << "least two cells in each direction near a body"
                << exit(FatalError);
        }
    }
    for (label t = 0; t < targets; ++t)
    {
        scalar z[mostUnknowns] = {0};
        z[t] = 1;
        substitute(L, m, z);
        for (label i = 0; i < s.size; ++i)
        {
            scalar sum = 0;
            for (label r = 0; r < m; ++r)
            {
                sum += rows[i][r]*z[r];
            }
            w[i*targets + t] = weight[i]*sum;
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
        const label sample = samples_[s.first + i];
        w[i] = 1;
        for (const label a : directions_)
        {
            const scalar rWidth = 1/width_[sample][a];
            scalar factor;
            kernel_.evaluate(1, x[a], &position_[sample][a], &rWidth, &factor);
            w[i] *= factor;
        }
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
    const sampleType type
)
:
    mesh_(mesh),
    kernel_(k),
    type_(type),
    stencilOfCell_(mesh.nCells(), -1),
    compact_(type == FACES ? mesh.nFaces() : mesh.nCells(), -1),
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
            total += blocks_[k].n[0] + blocks_[k].n[1] + blocks_[k].n[2];
        }
    }
    result.w.resize(total);

    forAll(x, p)
    {
        const stencil& s = stencils_[result.stencil[p]];
        scalar* w = result.w.data() + result.first[p];
        for (label bi = s.block; bi < s.block + s.nBlocks; ++bi)
        {
            for (label k = 0; k < 3; ++k)
            {
                weigh1D(blocks_[bi], k, x[p][axes_[k]], linear, w);
                w += blocks_[bi].n[k];
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
                    [&](label n, const label* i, const scalar* v, scalar c)
                    {
                        scalar part = 0;
                        for (label j = 0; j < n; ++j)
                        {
                            part += v[j]*samples[i[j]];
                        }
                        one += c*part;
                    }
                );
                sum[b.component] += one;
            }
            else
            {
                forEachRow
                (
                    b, w, &samples_[b.first],
                    [&](label n, const label* i, const scalar* v, scalar c)
                    {
                        for (label j = 0; j < n; ++j)
                        {
                            for (const label a : directions_)
                            {
                                sum[a] += c*v[j]*samples[3*i[j] + a];
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
                    [&](label n, const label* i, const scalar* v, scalar c)
                    {
                        for (label j = 0; j < n; ++j)
                        {
                            samples[i[j]] += c*one*v[j];
                        }
                    }
                );
            }
            else
            {
                forEachRow
                (
                    b, w, &samples_[b.first],
                    [&](label n, const label* i, const scalar* v, scalar c)
                    {
                        for (label j = 0; j < n; ++j)
                        {
                            for (const label a : directions_)
                            {
                                samples[3*i[j] + a] += c*v[j]*value[a];
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
                [&](label n, const label* i, const scalar* v, scalar c)
                {
                    for (label j = 0; j < n; ++j)
                    {
                        samples[i[j]] += c*v[j]*value;
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
      + stencils_.byteSize() + blocks_.byteSize()
      + coordinates_.byteSize() + rWidths_.byteSize()
      + samples_.byteSize() + sampled_.byteSize() + position_.byteSize()
      + normal_.byteSize() + width_.byteSize() + rArea_.byteSize();
}


// ************************************************************************* //
