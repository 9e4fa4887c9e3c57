/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "checkedDictionary.H"
#include "ITstream.H"
#include "OSspecific.H"
#include "OStringStream.H"

#include <cctype>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

const char* const brace =
    "a brace has no partner, or the end of the file is missing;"
    " allowed: as many '}' as '{'";

const char* const bracket =
    "a word has a '(' without its ')'; allowed: as many ')' as '('";

const char* const dollar =
    "a '$' has no name behind it; allowed: $ and a key";

//- Finds the line of a key in the text of a dictionary file. Entries do not
//  know it: their tokens keep the lines of macros and included files that they
//  came from, and empty ones have none
class keyFinder
{
    const std::string text_;
    size_t at_;
    label line_;

    bool starts(const char* what) const
    {
        return text_.compare(at_, std::strlen(what), what) == 0;
    }

    //- Move on by one character
    char next()
    {
        line_ += text_[at_] == '\n';
        return text_[at_++];
    }

    //- Move behind the next `what`, or to the end
    void pass(const char* what)
    {
        while (more() && !starts(what))
        {
            next();
        }
        at_ = min(at_ + std::strlen(what), text_.size());
    }

    //- Move behind what starts and ends so, if it starts here
    bool passFrom(const char* start, const char* end)
    {
        if (!starts(start))
        {
            return false;
        }
        next();
        pass(end);
        line_ += *end == '\n';
        return true;
    }

    bool passComment()
    {
        return passFrom("//", "\n") || passFrom("/*", "*/");
    }

    //- Move behind a string, if one starts here: \" does not end it
    bool passString()
    {
        if (!starts("\""))
        {
            return false;
        }
        for (next(); more() && text_[at_] != '"'; next())
        {
            at_ += starts("\\\\") || starts("\\\"");
        }
        at_ = min(at_ + 1, text_.size());
        return true;
    }

    //- Move past a comment or a string, if one starts here
    bool passOpaque()
    {
        return passComment() || passFrom("#{", "#}") || passString();
    }

    bool more() const
    {
        return at_ < text_.size();
    }

    bool atSpace() const
    {
        return std::isspace(static_cast<unsigned char>(text_[at_]));
    }

    bool at(const char* characters) const
    {
        return more() && text_[at_] && std::strchr(characters, text_[at_]);
    }

    //- Move to what follows spaces and comments
    void passBlank()
    {
        while (more() && (atSpace() ? next() : passComment()))
        {}
    }

    //- Move to what follows spaces, comments and strings
    void passSpace()
    {
        while (more() && (atSpace() ? next() : passOpaque()))
        {}
    }

    //- Move behind a word, as OpenFOAM reads one: to a space or one of `ends`,
    //  and brackets are part of it. Whether these have their partners
    bool passWord(const char* brackets, const char* ends)
    {
        label depth = 0;
        while
        (
            more() && !atSpace() && !at(ends)
         && (depth || !at(brackets + 1))
        )
        {
            const char c = next();
            depth += c == brackets[0];
            depth -= c == brackets[1];
        }
        return !depth;
    }

    //- Move behind '#' and a name, and an expression {...} if one follows:
    //  its words are not those of a dictionary. Whether that ends
    bool passDirective()
    {
        passWord("()", "\"'/;{}");
        passBlank();
        label depth = 0;
        while (more() && (depth || at("{")))
        {
            if (!passOpaque())
            {
                const char c = next();
                depth += c == '{';
                depth -= c == '}';
                if (!depth)
                {
                    break;
                }
            }
        }
        return !depth;
    }

    //- Move behind '$' and a name; nullptr, or what is wrong with them
    const char* passVariable()
    {
        next();
        passBlank();
        if (!more() || at("\"';}"))
        {
            return dollar;
        }
        if (at("{"))
        {
            return passWord("{}", "\"';") ? nullptr : brace;
        }
        return passWord("()", "\"';{}") ? nullptr : bracket;
    }

    //- Move behind one token; nullptr, or what is wrong with it
    const char* passToken()
    {
        if (at("}"))
        {
            return brace;
        }
        if (at("#"))
        {
            return passDirective() ? nullptr : brace;
        }
        if (at("$"))
        {
            return passVariable();
        }
        if (at(";()[]:,=+*/'"))
        {
            next();
            return nullptr;
        }
        if (at("-.0123456789"))
        {
            while (at("-+.0123456789eE"))
            {
                next();
            }
            return nullptr;
        }
        return passWord("()", "\"'/;{}") ? nullptr : bracket;
    }

    //- Move behind the ';' of a value, past brackets of all kinds
    void passValue()
    {
        label depth = 0;
        while (more())
        {
            if (passOpaque())
            {
                continue;
            }
            const char c = next();
            depth += c == '(' || c == '{' || c == '[';
            depth -= c == ')' || c == '}' || c == ']';
            if (c == ';' && depth <= 0)
            {
                return;
            }
        }
    }


public:

    explicit keyFinder(const fileName& file)
    :
        text_([&]
        {
            std::ifstream is(file);
            return std::string(std::istreambuf_iterator<char>(is), {});
        }()),
        at_(0),
        line_(1)
    {}

    //- What OpenFOAM would take in silence or with a warning
    struct mistake
    {
        label line;
        const char* text;  // nullptr: none
    };

    //- The first one: a '}' too many, a '{' or the '(' of a word without its
    //  partner, a '$' without a name
    mistake firstMistake()
    {
        DynamicList<label> open;
        for (passSpace(); more(); passSpace())
        {
            const label line = line_;
            if (at("{"))
            {
                open.append(line);
                next();
            }
            else if (at("}") && open.size())
            {
                open.remove();
                next();
            }
            else if (const char* text = passToken())
            {
                return {line, text};
            }
        }
        return {open.empty() ? 0 : open.last(), open.empty() ? nullptr : brace};
    }

    //- Line of the last of these nested keys; -1: they are not in the file
    label lineOf(const wordList& keys)
    {
        label found = -1, depth = 0, matched = 0;
        for (passSpace(); more(); passSpace())
        {
            const label line = line_;
            if (text_[at_] == '}' || text_[at_] == ';')
            {
                depth -= next() == '}';
                matched = min(matched, depth);
                continue;
            }
            const size_t start = at_;
            while (more() && !atSpace() && !std::strchr("{};", text_[at_]))
            {
                next();
            }
            const std::string key(text_, start, at_ - start);
            if (key[0] == '#')
            {
                pass("\n");
                ++line_;
                continue;
            }
            const bool match =
                matched == depth && depth < keys.size() && key == keys[depth];
            if (match && depth + 1 == keys.size())
            {
                found = line;
            }
            passSpace();
            if (more() && text_[at_] == '{')
            {
                next();
                ++depth;
                matched += match;
            }
            else
            {
                passValue();
            }
        }
        return found;
    }
};

//- Keys that lead to a dictionary from the top of its file
wordList keysTo(const dictionary& dict)
{
    if (&dict == &dict.topDict())
    {
        return wordList();
    }
    wordList keys(keysTo(dict.parent()));
    for (const entry& e : dict.parent())
    {
        if (e.isDict() && &e.dict() == &dict)
        {
            keys.append(e.keyword());
        }
    }
    return keys;
}

//- Start a FatalIOError at the line of a key in dict, or of dict itself
OSstream& errorAt(const dictionary& dict, const word& key = "")
{
    const fileName& file = dict.topDict().name();
    wordList keys(keysTo(dict));
    if (!key.empty())
    {
        keys.append(key);
    }
    label line = keyFinder(file).lineOf(keys);
    if (!isFile(file))
    {
        // The copy of a part of a file: what its tokens say
        const entry* e = dict.findEntry(key, keyType::LITERAL);
        line = e ? e->startLineNumber() : dict.startLineNumber();
    }
    return FatalIOError("periFoam", __FILE__, __LINE__, file, line);
}

//- Numbers of this size are as good as infinite: their squares must not be
constexpr scalar largest = 1e60;

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
    if (words.empty())
    {
        return "(none)";
    }
    OStringStream os;
    forAll(words, i)
    {
        os << (i ? ", " : "") << words[i].c_str();
    }
    return os.str();
}

} // End anonymous namespace


// * * * * * * * * * * * * * * * Global Functions  * * * * * * * * * * * * * //

void Foam::periFoam::checkText(const fileName& file)
{
    const auto mistake = keyFinder(file).firstMistake();
    if (mistake.text)
    {
        FatalIOError("periFoam", __FILE__, __LINE__, file, mistake.line)
            << mistake.text << exit(FatalIOError);
    }
}


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
        errorAt(dict_)
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
    errorAt(dict_, e.keyword())
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
        try
        {
            const throwingErrors thrown;
            is >> given;
        }
        catch (const Foam::error& error)
        {
            refuse
            (
                e,
                allowed + "; its dimensions cannot be read: " + error.message()
            );
        }
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
    if (std::fabs(t.number()) >= largest)
    {
        refuse(e, allowed.text() + ", below 1e60 in size");
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
    const string allowed("a vector (x y z) of numbers below 1e60 in size");
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
            good = t.isNumber() && std::fabs(t.number()) < largest;
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


Foam::wordList Foam::periFoam::checkedDictionary::choices
(
    const word& key,
    const wordList& allowed
) const
{
    const string text("a list (...) of " + listed(allowed));
    const entry& e = need(key, text);
    ITstream& is = stream(e, dimless, text);
    const label n = is.size() - 2;
    if (n < 1 || is[0] != token::BEGIN_LIST || is[n + 1] != token::END_LIST)
    {
        refuse(e, text);
    }
    wordList words(n);
    forAll(words, i)
    {
        const token& t = is[i + 1];
        if (!t.isWord() || !allowed.found(t.wordToken()))
        {
            refuse(e, text);
        }
        words[i] = t.wordToken();
    }
    return words;
}


Foam::word
Foam::periFoam::checkedDictionary::oneOf(const wordList& keys) const
{
    const string text("exactly one of " + listed(keys));
    word given;
    for (const word& key : keys)
    {
        const entry* e = find(key);
        if (e && !given.empty())
        {
            refuse(*e, text);
        }
        given = e ? key : given;
    }
    if (given.empty())
    {
        need(keys[0], text);
    }
    return given;
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
    errorAt(dict_, e ? key : word())
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
            errorAt(dict_, e.keyword())
                << "the key '" << e.keyword() << "' in " << name().c_str()
                << " is unknown; its value is " << valueOf(e).c_str()
                << "; allowed: " << listed(allowed).c_str()
                << exit(FatalIOError);
        }
    }
}


// ************************************************************************* //
