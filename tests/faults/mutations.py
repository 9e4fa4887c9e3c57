"""Mutations of an OpenFOAM dictionary, each from a source of chance alone."""

import difflib
import os
import re

NUMBER = re.compile(r"(?<![\w.])[-+]?(\d+[.]?\d*|[.]\d+)([eE][-+]?\d+)?(?![\w.])")

NUMBERS = """0 -0 -1 1 2 -2.5 0.5 1e-300 -1e-300 1e-308 1e-320 1e300 -1e300 1e59 -1e59 1e60 1e30
    1e-30 1e15 1e-15 1e308 1e309 1e400 nan -nan NaN inf -inf Infinity 2147483647 2147483648
    -2147483648 9223372036854775807 9223372036854775808 99999999999999999999999999 0x10 1.5.2
    1e 1e+ .5 5. 1,5 1/0 007 1_000 +3 --3 one 3.0 20 19.99""".split()

VALUES = """red on no "" " "text" 1 0 (1) (1 2) (1 2 3) (1 2 3 4) (1 2 3 (4)) () 2(1 2) 3{1} -1{0}
    (a b c) (x) (((1))) (nan 0 0) (1 inf 0) (1e300 0 0) (1e-300 0 0) {} {a 1;} [m] [1] 1;2""".split() + [
    "[0 0 0 0 0 0 0] 1", "[1 -3 0 0 0 0 0] 1", "[1 -1 -2 0 0 0 0] 200", "[1 2 3] 4", "[m/s] 1",
    "[1 -1 -2 0 0 0 0 0 0] 1", "[] 1", "[what] 1", "[1 -1 -2 0 0 0 0", "1 2", "uniform 1",
    "nonuniform List<scalar> 2(1 2)", "List<scalar> 2(1 2)", "List<scalar> 2147483647(1 2)",
    "List<vector> 1(1)", "table ()", "table (0 1)", "table ((0 1) (0 2))", "table ((1 1) (0 2))",
    "table ((0 1e300) (1e-4 -1e300))", "table ((0 1) (1e-300 2))", "table ((0 (1 0 0)))", "table",
    "polynomial ((1 -1))", "polynomial ((1 0.5))", "sine", "constant nan", "constant 1e300",
    "csvFile", "tableFile", "{ type sine; frequency 1e300; amplitude 1; scale 1; level 0; }",
    "{ type linearRamp; start 0; duration 0; }", "{ type table; file \"nothing\"; }",
    "{ type scale; }", "{ type coded; code #{ return 1; #}; }", "zero", "one", "functionObjectValue",
    "default", "none", "dictionary", "word", "../band", "/etc/passwd", "a/b", "..",
]

# A file that includes itself is none of them: OpenFOAM reads it until its stack is full.
MACROS = """$unknown $:unknown.key $..G $... ${unknown} ${{1+1}} $bodies $:bodies $FoamFile $ $$ ${ $:
    #include #"no" # #nothing #neg #calc #eval #codeStream #{ #} $damage $material $:coupling.rhoInf""".split() + [
    '#include "nothing"', '#includeIfPresent "nothing"', '#includeEtc "nothing"',
    "#includeFunc nothing", "#eval { 1/0 }", '#eval "1/0"',
    '#eval { nonsense(3) }', '#eval "sqrt(-1)"', "#eval { 1e300*1e300 }", "#eval {", '#calc "1/0"',
    '#calc "nonsense("', "#codeStream { code #{ os << 1; #}; }", "#inputMode error", "#inputMode merge",
    "#inputMode warn", "#inputMode protect", "#inputMode default", "#inputMode nonsense",
    "#remove coupling", "#remove bodies", "#remove (bodies probes)", '#remove ".*"', "#if 1", "#if 0",
    "#ifeq a a", "#ifeq a b", "#else", "#endif", "#message \"x\"", "#overwrite bodies 1",
    '#sinclude "nothing"', "#include \"$FOAM_CASE/constant/band\"", "#include \"/\"", "$:bodies.band",
]

KEYS = ["\".*\"", "\"ba.*\"", "\"(\"", "\"[\"", "a|b", "(a|b)", "1", "-1", "default", "_", "a.b", "a:b",
        ":a", "..", "../x", "a/b", "type", "dictionary", "nan", "x" * 300, "\u00e9", "\"a b\"", "U", "p",
        "points", "boundary", "plate", "band", "region0", "cost"]

ODD_BYTES = [b"\xc3\xa9", b"\xe9", b"\xff", b"\xfe\xff", b"\xef\xbb\xbf", b"\0", b"\x01", b"\x1b[31m",
             b"\r", b"\r\n", b"\v", b"\f", b"\b", b"\x7f", b"\x80", b"\xe2\x80\x8b", b"\xf0\x9f\x92\xa9",
             b"\\", b"\\\n", b"\"", b"'", b"`", b"\t", b"//", b"/*", b"*/", b"%", b"&", b"|", b"<", b"$"]


class Entry:
    """A key with its value or dictionary, by where they stand in the text."""

    def __init__(self, path, key, value, whole, is_dictionary):
        self.path, self.key, self.value, self.whole = path, key, value, whole
        self.is_dictionary = is_dictionary


def entries(text):
    """All entries of a well-formed dictionary without macros."""
    found = []

    def space(at):
        return re.compile(r"(\s|//[^\n]*\n|/\*.*?\*/)*", re.S).match(text, at).end()

    def block(at, path):
        at = space(at)
        while at < len(text) and text[at] != "}":
            start = at
            at = re.compile(r"[^\s{};]+").match(text, at).end()
            key = (start, at)
            at = space(at)
            inside = path + (text[slice(*key)],)
            if text[at] == "{":
                end = block(at + 1, inside)
                found.append(Entry(inside, key, (at + 1, end), (start, end + 1), True))
                at = end + 1
            else:
                end = text.index(";", at)
                found.append(Entry(inside, key, (at, end), (start, end + 1), False))
                at = end + 1
            at = space(at)
        return at

    block(0, ())
    return found


def put(text, span, new):
    return text[: span[0]] + new + text[span[1] :]


# --- the kinds --------------------------------------------------------------------------
# Each takes a text and a source of chance and returns the altered text.


def dropped(text, chance):
    return put(text, chance.choice(entries(text)).whole, "")


def duplicated(text, chance):
    e, other = chance.choice(entries(text)), chance.choice(entries(text))
    at = chance.choice([e.whole[1], e.whole[0], other.whole[1]])
    return put(text, (at, at), "\n" + text[slice(*e.whole)] + "\n")


def misspelt(text, chance):
    e = chance.choice(entries(text))
    key = text[slice(*e.key)]
    i = chance.randrange(len(key))
    new = chance.choice(
        [
            key[:i] + key[i + 1 :],
            key[:i] + chance.choice("aeiou_.1") + key[i:],
            key[:i] + key[i].swapcase() + key[i + 1 :],
            key[:i] + key[i:][:2][::-1] + key[i + 2 :],
            key + "s",
            chance.choice(KEYS),
            '"' + key + '"',
            '"' + key[: max(1, i)] + '.*"',
        ]
    )
    return put(text, e.key, new)


def renumbered(text, chance):
    leaves = [e for e in entries(text) if not e.is_dictionary]
    spans = [
        (e.value[0] + m.start(), e.value[0] + m.end())
        for e in leaves
        for m in NUMBER.finditer(text[slice(*e.value)])
    ]
    return put(text, chance.choice(spans), chance.choice(NUMBERS))


def revalued(text, chance):
    e = chance.choice(entries(text))
    if e.is_dictionary:
        return put(text, (e.key[1], e.whole[1]), " " + chance.choice(VALUES) + ";")
    return put(text, e.value, chance.choice(VALUES))


def exchanged(text, chance):
    """The value of one key given to another."""
    leaves = [e for e in entries(text) if not e.is_dictionary]
    return put(text, chance.choice(leaves).value, text[slice(*chance.choice(leaves).value)])


def swapped(text, chance):
    """Two sub-dictionaries in each other's place."""
    dictionaries = [e for e in entries(text) if e.is_dictionary]
    while True:
        a, b = sorted(chance.sample(dictionaries, 2), key=lambda e: e.value)
        if a.value[1] <= b.value[0]:
            break
    first, second = text[slice(*a.value)], text[slice(*b.value)]
    return put(put(text, b.value, first), a.value, second)


def punctuated(text, chance):
    marks = ";;{}{}()\"[]"
    if chance.random() < 0.5:
        places = [m.start() for m in re.finditer(r"[;{}()]", text)]
        at = chance.choice(places)
        return put(text, (at, at + 1), chance.choice(["", "", chance.choice(marks)]))
    at = chance.randrange(len(text))
    return put(text, (at, at), chance.choice(marks))


def expanded(text, chance):
    """A macro or directive as a value or on a line of its own."""
    e = chance.choice(entries(text))
    macro = chance.choice(MACROS)
    if chance.random() < 0.5 and not e.is_dictionary:
        return put(text, e.value, macro)
    at = e.whole[chance.randrange(2)]
    return put(text, (at, at), "\n" + macro + chance.choice(["\n", ";\n"]))


def elongated(text, chance):
    e = chance.choice(entries(text))
    length = chance.choice([300, 5000, 100000])
    new = chance.choice(["x" * length, "1" * length, "x " * length, "(" + "1 " * length + ")",
                         "(" * 200 + ")" * 200, "0." + "0" * length + "1", '"' + "x" * length + '"'])
    span = e.key if chance.random() < 0.3 and new[0] == "x" and " " not in new else e.value
    return put(text, span, new)


def flipped(data, chance):
    data = bytearray(data.encode())
    for _ in range(chance.choice([1, 1, 2, 4, 16])):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    return bytes(data)


def odd(text, chance):
    data = text.encode()
    at = chance.randrange(len(data))
    return data[:at] + chance.choice(ODD_BYTES) + data[at:]


def truncated(text, chance):
    return text.encode()[: chance.randrange(len(text))]


def several(text, chance):
    """Two or three textual ones; the text must stay one that `entries` reads."""
    for _ in range(chance.choice([2, 2, 3])):
        text = chance.choice([dropped, renumbered, exchanged, duplicated, renumbered])(text, chance)
    return text


def whole_file(text, chance):
    """Something else in place of the file: bytes, or what makes it from its path."""
    return chance.choice(
        [
            b"",
            b"\n",
            b";",
            b"}",
            b"{",
            bytes(chance.randrange(256) for _ in range(2000)),
            text.replace("\n", "\r\n").encode(),
            text.encode("utf-16"),
            b"\xef\xbb\xbf" + text.encode(),
            text[: text.index("}") + 1].encode(),
            text[text.index("}") + 1 :].encode(),
            text.replace("dictionary;", "volScalarField;", 1).encode(),
            text.replace("ascii;", "binary;", 1).encode(),
            text.replace("2.0;", "9.9;", 1).encode(),
            text.encode() + text.encode(),
            b"\x1f\x8b" + text.encode(),
            lambda path: None,
            lambda path: path.mkdir(),
            lambda path: path.symlink_to(path.name),
            lambda path: path.symlink_to("/dev/null"),
            lambda path: os.mkfifo(path) if False else path.symlink_to("nothing"),
        ]
    )


KINDS = [
    (dropped, 8),
    (duplicated, 5),
    (misspelt, 10),
    (renumbered, 25),
    (revalued, 16),
    (exchanged, 10),
    (swapped, 4),
    (punctuated, 10),
    (expanded, 10),
    (elongated, 4),
    (flipped, 8),
    (odd, 6),
    (truncated, 6),
    (several, 12),
    (whole_file, 4),
]


def mutate(text, chance):
    """The name of a kind, and the bytes of a mutant or what makes its file."""
    kind = chance.choices([k for k, _ in KINDS], [w for _, w in KINDS])[0]
    new = kind(text, chance)
    return kind.__name__, new.encode() if isinstance(new, str) else new


# --- what the tests look at -------------------------------------------------------------


def unbalanced(data):
    """Whether braces outside comments and strings do not match."""
    text = data.decode("latin-1")
    text = re.sub(r'//[^\n]*|/\*.*?(\*/|\Z)|"(\\.|[^"\\])*"|#\{.*?#\}', "", text, flags=re.S)
    depth = 0
    for c in text:
        depth += (c == "{") - (c == "}")
        if depth < 0:
            return True
    return depth != 0


def difference(text, data):
    new = data.decode("latin-1")
    lines = difflib.unified_diff(text.splitlines(), new.splitlines(), lineterm="", n=1)
    return [line[:200] for line in lines][:40]
