/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "checkedDictionary.H"
#include "ITstream.H"
#include "OStringStream.H"

#include <cmath>

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

//- Start a FatalIOError at one line of the file that dict comes from
OSstream& errorAt(const dictionary& dict, const label line)
{
    return FatalIOError
    (
        "periFoam", __FILE__, __LINE__, dict.topDict().name(), line
    );
}

//- The tokens of an entry as the user wrote them
string valueOf(const entry& e)
{
    if (e.isDict())
    {
        return "{...}";
    }
    OStringStream os;
    const tokenList& tokens = e.stream();
    forAll(tokens, i)
    {
        os << (i ? " " : "") << tokens[i];
    }
    return os.str();
}

string listed(const wordList& words)
{
    OStringStream os;
    forAll(words, i)
    {
        os << (i ? ", " : "") << words[i].c_str();
    }
    return os.str();
}

} // End anonymous namespace


// * * * * * * * * * * * * * * * * * Ranges  * * * * * * * * * * * * * * * * //

bool Foam::periFoam::range::holds(const scalar value) const
{
    return
        std::isfinite(value)
     && (value > low || (withLow && value == low))
     && (value < high || (withHigh && value == high));
}


Foam::string Foam::periFoam::range::text() const
{
    OStringStream os;
    os << "a number";
    if (low > -GREAT)
    {
        os << (withLow ? ", at least " : " above ") << low;
    }
    if (high < GREAT)
    {
        os << (withHigh ? ", at most " : ", below ") << high;
    }
    return os.str();
}


Foam::periFoam::range Foam::periFoam::range::any()
{
    return range{-VGREAT, VGREAT, false, false};
}


Foam::periFoam::range Foam::periFoam::range::above(const scalar low)
{
    return range{low, VGREAT, false, false};
}


Foam::periFoam::range Foam::periFoam::range::atLeast(const scalar low)
{
    return range{low, VGREAT, true, false};
}


Foam::periFoam::range Foam::periFoam::range::between
(
    const scalar low,
    const scalar high,
    const bool withLow,
    const bool withHigh
)
{
    return range{low, high, withLow, withHigh};
}


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

const Foam::entry* Foam::periFoam::checkedDictionary::find
(
    const word& key
) const
{
    known_.append(key);
    return dict_.findEntry(key, keyType::LITERAL);
}


const Foam::entry& Foam::periFoam::checkedDictionary::need
(
    const word& key,
    const string& allowed
) const
{
    const entry* e = find(key);
    if (!e)
    {
        errorAt(dict_, dict_.startLineNumber())
            << "the key '" << key << "' is missing in " << name().c_str()
            << "; allowed: " << allowed.c_str() << exit(FatalIOError);
    }
    return *e;
}


void Foam::periFoam::checkedDictionary::refuse
(
    const entry& e,
    const string& allowed
) const
{
    errorAt(dict_, e.startLineNumber())
        << "the key '" << e.keyword() << "' in " << name().c_str()
        << " has the value " << valueOf(e).c_str()
        << "; allowed: " << allowed.c_str() << exit(FatalIOError);
}


Foam::ITstream& Foam::periFoam::checkedDictionary::stream
(
    const entry& e,
    const dimensionSet& dimensions,
    const string& allowed
) const
{
    if (e.isDict())
    {
        refuse(e, allowed);
    }
    ITstream& is = e.stream();
    is.rewind();
    if (is.size() && is[0] == token::BEGIN_SQR)
    {
        dimensionSet given(dimless);
        is >> given;
        if (given != dimensions)
        {
            OStringStream os;
            os << allowed.c_str() << " with dimensions " << dimensions;
            refuse(e, os.str());
        }
    }
    return is;
}


Foam::scalar Foam::periFoam::checkedDictionary::number
(
    const entry& e,
    const range& allowed,
    const dimensionSet& dimensions
) const
{
    ITstream& is = stream(e, dimensions, allowed.text());
    if (is.nRemainingTokens() != 1)
    {
        refuse(e, allowed.text());
    }
    const token t(is);
    if (!t.isNumber() || !allowed.holds(t.number()))
    {
        refuse(e, allowed.text());
    }
    return t.number();
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::string Foam::periFoam::checkedDictionary::name() const
{
    // "/path/peridynamicsProperties.bodies.band" without the path and file
    const std::string whole(dict_.name());
    const std::string top(dict_.topDict().name());
    return
        whole.size() > top.size() + 1
      ? string(whole.substr(top.size() + 1))
      : string(fileName(top).name());
}


bool Foam::periFoam::checkedDictionary::found(const word& key) const
{
    return find(key);
}


Foam::scalar Foam::periFoam::checkedDictionary::number
(
    const word& key,
    const range& allowed,
    const dimensionSet& dimensions
) const
{
    return number(need(key, allowed.text()), allowed, dimensions);
}


Foam::scalar Foam::periFoam::checkedDictionary::numberOr
(
    const scalar otherwise,
    const word& key,
    const range& allowed,
    const dimensionSet& dimensions
) const
{
    const entry* e = find(key);
    return e ? number(*e, allowed, dimensions) : otherwise;
}


Foam::label Foam::periFoam::checkedDictionary::integerOr
(
    const label otherwise,
    const word& key,
    const label low
) const
{
    const entry* e = find(key);
    if (!e)
    {
        return otherwise;
    }
    OStringStream allowed;
    allowed << "an integer, at least " << low;
    ITstream& is = stream(*e, dimless, allowed.str());
    if (is.nRemainingTokens() == 1)
    {
        const token t(is);
        if (t.isLabel() && t.labelToken() >= low)
        {
            return t.labelToken();
        }
    }
    refuse(*e, allowed.str());
    return low;
}


Foam::vector Foam::periFoam::checkedDictionary::vectorOf
(
    const word& key,
    const dimensionSet& dimensions
) const
{
    const string allowed("a vector (x y z) of finite numbers");
    const entry& e = need(key, allowed);
    ITstream& is = stream(e, dimensions, allowed);
    bool good = is.nRemainingTokens() == 5;
    vector result(Zero);
    for (label i = 0; good && i < 5; ++i)
    {
        const token t(is);
        if (i == 0)
        {
            good = t == token::BEGIN_LIST;
        }
        else if (i == 4)
        {
            good = t == token::END_LIST;
        }
        else
        {
            good = t.isNumber() && std::isfinite(t.number());
            result[i - 1] = good ? t.number() : 0;
        }
    }
    if (!good)
    {
        refuse(e, allowed);
    }
    return result;
}


bool Foam::periFoam::checkedDictionary::flagOr
(
    const bool otherwise,
    const word& key
) const
{
    const wordList yes({"yes", "on", "true"});
    const word given
    (
        choiceOr("", key, wordList({"yes", "on", "true", "no", "off", "false"}))
    );
    return given.empty() ? otherwise : yes.found(given);
}


Foam::word Foam::periFoam::checkedDictionary::choice
(
    const word& key,
    const wordList& allowed
) const
{
    const string text("one of " + listed(allowed));
    const entry& e = need(key, text);
    ITstream& is = stream(e, dimless, text);
    if (is.size() != 1 || !is[0].isWord() || !allowed.found(is[0].wordToken()))
    {
        refuse(e, text);
    }
    return is[0].wordToken();
}


Foam::word Foam::periFoam::checkedDictionary::choiceOr
(
    const word& otherwise,
    const word& key,
    const wordList& allowed
) const
{
    return found(key) ? choice(key, allowed) : otherwise;
}


Foam::word Foam::periFoam::checkedDictionary::name(const word& key) const
{
    const string text("a word");
    const entry& e = need(key, text);
    ITstream& is = stream(e, dimless, text);
    if (is.size() != 1 || !is[0].isWord())
    {
        refuse(e, text);
    }
    return is[0].wordToken();
}


Foam::periFoam::checkedDictionary
Foam::periFoam::checkedDictionary::sub(const word& key) const
{
    const entry& e = need(key, "a dictionary {...}");
    if (!e.isDict())
    {
        refuse(e, "a dictionary {...}");
    }
    return checkedDictionary(e.dict());
}


Foam::wordList Foam::periFoam::checkedDictionary::subNames() const
{
    DynamicList<word> names;
    for (const entry& e : dict_)
    {
        if (!e.isDict())
        {
            refuse(e, "a dictionary {...}");
        }
        known_.append(e.keyword());
        names.append(e.keyword());
    }
    return wordList(std::move(names));
}


void Foam::periFoam::checkedDictionary::refuse
(
    const word& key,
    const string& reason
) const
{
    const entry* e = find(key);
    errorAt(dict_, e ? e->startLineNumber() : dict_.startLineNumber())
        << "the key '" << key << "' in " << name().c_str()
        << " has the value " << (e ? valueOf(*e) : string("(none)")).c_str()
        << "; " << reason.c_str() << exit(FatalIOError);
}


void Foam::periFoam::checkedDictionary::finish() const
{
    for (const entry& e : dict_)
    {
        if (!known_.found(e.keyword()) && e.keyword() != "FoamFile")
        {
            wordList allowed(known_);
            inplaceUniqueSort(allowed);
            errorAt(dict_, e.startLineNumber())
                << "the key '" << e.keyword() << "' in " << name().c_str()
                << " is unknown; its value is " << valueOf(e).c_str()
                << "; allowed: " << listed(allowed).c_str()
                << exit(FatalIOError);
        }
    }
}


// ************************************************************************* //
