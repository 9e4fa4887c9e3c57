/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "kernel.H"
#include "mathematicalConstants.H"

#include <cmath>

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using Foam::label;
using Foam::scalar;

// The four-point kernel: both branches share one root, with m = |r| inside 1
// and 2 - |r| outside, so that the loop over it has no branch.
inline scalar ib4(const scalar r)
{
    const scalar a = std::fabs(r);
    const bool inner = a < 1;
    const scalar m = inner ? a : 2 - (a < 2 ? a : 2);
    const scalar root = std::sqrt(1 + 4*m - 4*m*m);
    return (inner ? 3 - 2*m + root : 1 + 2*m - root)/8;
}

inline scalar cosine4(const scalar r)
{
    const scalar pi = Foam::constant::mathematical::pi;
    return std::fabs(r) < 2 ? (1 + std::cos(pi*r/2))/4 : 0;
}

inline scalar bspline4(const scalar r)
{
    const scalar a = std::fabs(r);
    const scalar b = 2 - a;
    return a < 1 ? 2./3 - a*a + a*a*a/2 : a < 2 ? b*b*b/6 : 0;
}

inline scalar ib3(const scalar r)
{
    const scalar a = std::fabs(r);
    return
        a < 0.5 ? (1 + std::sqrt(1 - 3*a*a))/3
      : a < 1.5 ? (5 - 3*a - std::sqrt(1 - 3*(1 - a)*(1 - a)))/6
      : 0;
}

inline scalar hat2(const scalar r)
{
    const scalar a = std::fabs(r);
    return a < 1 ? 1 - a : 0;
}

template<scalar (*phi)(scalar)>
void evaluate
(
    label n, scalar X, const scalar* x, const scalar* rWidth, scalar* w
)
{
    for (label i = 0; i < n; ++i)
    {
        w[i] = phi((x[i] - X)*rWidth[i]);
    }
}

// The last number is max over theta of theta*phiHat(theta), by quadrature of
// the kernel's Fourier transform; tests/transfer recomputes it.
const Foam::periFoam::kernel table[] =
{
    {"ib4", 2, true, 0.818, evaluate<ib4>},
    {"cosine4", 2, true, 0.818, evaluate<cosine4>},
    {"bspline4", 2, false, 1.038, evaluate<bspline4>},
    {"ib3", 1.5, false, 1.087, evaluate<ib3>},
    {"hat2", 1, false, 1.449, evaluate<hat2>}
};

} // End anonymous namespace


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

const Foam::periFoam::kernel* Foam::periFoam::kernel::find(const word& name)
{
    for (const kernel& k : table)
    {
        if (name == k.name)
        {
            return &k;
        }
    }
    return nullptr;
}


Foam::wordList Foam::periFoam::kernel::names()
{
    DynamicList<word> list;
    for (const kernel& k : table)
    {
        list.append(k.name);
    }
    return wordList(std::move(list));
}


// ************************************************************************* //
