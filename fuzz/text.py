"""Scene texts: the seeds, the words of the grammar, and mutations of tokens, statements and numbers."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from random import Random
from typing import Final

from scenelang.language.foreign import SIGNS, UNIT_NAMES
from scenelang.language.tables import tables
from scenelang.language.values import CONSTANTS, FUNCTIONS
from scenelang.language.words import ANIMATED, LANGUAGE

ROOT: Final = Path(__file__).resolve().parent.parent
FOLDERS: Final = ("examples", "examples/lib", "tests/language", "tests/language", "tests/conformance/cases")

NUMBERS: Final = [
    "0",
    "1",
    "-1",
    "2",
    "3",
    "0.5",
    "1e-320",
    "1e308",
    "-1e308",
    "1e309",
    "1e999999",
    "4e-324",
    "1e16",
    "9007199254740993",
    "100000",
    "100001",
    "1000000",
    "10000001",
    "8192",
    "8193",
    "0.1",
    ".5",
    "1.",
    "007",
    "1e",
    "1.2.3",
    "1e-7",
    "6.2832",
    "0.30000000000000004",
    "1e22",
    "1e-5",
]
ODD: Final = [
    "\x00",
    "\ufeff",
    "\u202e",
    "\u2066",
    "\u200b",
    "́",
    "�",
    "😀",
    "𝟘",
    "٠",
    "µ",
    "\x7f",
    "\x1b[31m",
    "\x85",
    "\u2028",
    "\u2029",
    "\x0b",
    "\x0c",
    "\x1c",
    "\r",
    "\r\n",
    "\n",
    "\t",
    "\xa0",
    "\\",
    '"',
    "'",
    "`",
    "@",
    "$",
    "~",
    "/*",
    "*/",
    "//",
    "�",
    "\U0010ffff",
    "é",
    "ß",
    "ﬁ",
    "：；，（）",
]
PIECES: Final = (
    "for (i in 0..<3) { square { translate(i, 0); } }",
    "for (i in 0..1000000) { }",
    "if (u > 0.5) { star { } } else { square { } }",
    "fn f(x, y = x) = x > 0 ? f(x - 1) : y;",
    "module m(a, b = 2) { square { scale(a); } }",
    "m(1) { rotate(30deg); }",
    "m(m = 1);",
    'let v = [1, [2, 3], "s", #d33];',
    "param k = 0.5 in 0..1;",
    "param a = 30deg in 0deg..90deg step 10deg;",
    "animate(2s, 24, loop = true);",
    "canvas(8, 8);",
    "background(none);",
    'model "shapes2d";',
    'import "lib/parts.nsg" as lib;',
    'import "../outside.nsg" as up;',
    "let mist = material flat { color(#d33); hue(1turn); };",
    "mist { grayscale(0.5); }",
    "chain { square { } smooth star { } subtract pentagon { scale(0.5); } intersect square { } }",
    "subtract { square { } union { star { } triangle { scale(0.2); } } }",
    "matrix([[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]);",
    "shear(xy = 0.5); twirl(1.5); bend(-0.5);",
    "2 ^ 3 ^ 4 ^ 5",
    "rand(1e300) % -0.1",
    "[1, 2, 3][1].x",
    "0..1e6 step 1e-9",
)

_TOKEN: Final = re.compile(
    r'"(?:\\.|[^"\n])*"|[\w#.°]+|\s+|//[^\n]*|/\*.*?\*/|[-<>=!&|*.]{1,3}|[\s\S]', re.DOTALL
)


@cache
def texts() -> tuple[str, ...]:
    """All scene texts of examples, documentation and tests."""
    found: list[str] = []
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.nsg*")):
            if folder in ("examples", "examples/lib") and path.parent != ROOT / folder:
                continue
            text = path.read_text(encoding="utf-8")
            found += re.split(r"^-{3,}.*$", text, flags=re.MULTILINE) if path.suffix == ".nsgs" else [text]
    for path in sorted((ROOT / "docs").rglob("*.md")):
        found += re.findall(r"```nsg\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL)
    found += ["", "\ufeffnsg 1;\r\nstar { }\r\n", "/* never closed", *PIECES]
    return tuple(dict.fromkeys(found))


def decode(data: bytes) -> str:
    """Any bytes as text; what is no UTF-8 becomes lone surrogates, which Python strings may hold."""
    return data.decode("utf-8", "surrogateescape")


def encode(text: str) -> bytes:
    """The bytes of a text, also of one with surrogates."""
    try:
        return text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:
        return text.encode("utf-8", "surrogatepass")


def seeds() -> list[bytes]:
    return [encode(text) for text in texts()]


@cache
def words() -> tuple[str, ...]:
    """Names and signs of the language."""
    own = ["square", "triangle", "star", "pentagon", "flat", "sphere", "diffuse", "shapes2d", "loop", "axis"]
    units = ["deg", "rad", "turn", "s", "ms", *UNIT_NAMES]
    signs = [*tables().literals, *SIGNS]
    found = [*signs, *FUNCTIONS, *CONSTANTS, *ANIMATED, *sorted(LANGUAGE), *own, *units, *NUMBERS, *ODD]
    return tuple(dict.fromkeys(word for word in found if word))


def dictionary() -> list[bytes]:
    """Words and short pieces for libFuzzer, which takes entries of up to 64 bytes."""
    return [encode(word) for word in (*words(), *(p for p in PIECES if len(p) < 60))]


def mutate(data: bytes, generator: Random) -> bytes:
    """One to three changes of tokens or statements."""
    text = decode(data)
    for _ in range(generator.randint(1, 3)):
        text = generator.choice(_CHANGES)(text, generator)
    return encode(text)


def _tokens(text: str) -> list[str]:
    return _TOKEN.findall(text)


def _cut(text: str, generator: Random) -> str:
    tokens = _tokens(text)
    if tokens:
        at = generator.randrange(len(tokens))
        del tokens[at : at + generator.choice((1, 1, 1, 2, 5, 20))]
    return "".join(tokens)


def _insert(text: str, generator: Random) -> str:
    tokens = _tokens(text)
    at = generator.randint(0, len(tokens))
    tokens[at:at] = [generator.choice(words()), generator.choice(("", " "))]
    return "".join(tokens)


def _replace(text: str, generator: Random) -> str:
    tokens = _tokens(text)
    if tokens:
        tokens[generator.randrange(len(tokens))] = generator.choice(words())
    return "".join(tokens)


def _exchange(text: str, generator: Random) -> str:
    tokens = _tokens(text)
    if len(tokens) > 1:
        one, other = generator.randrange(len(tokens)), generator.randrange(len(tokens))
        tokens[one], tokens[other] = tokens[other], tokens[one]
    return "".join(tokens)


def _number(text: str, generator: Random) -> str:
    places = list(re.finditer(r"[0-9.]+(?:[eE][-+]?[0-9]+)?", text))
    if not places:
        return text
    place = generator.choice(places)
    return text[: place.start()] + generator.choice(NUMBERS) + text[place.end() :]


def _repeat(text: str, generator: Random) -> str:
    """A stretch several times over, which nests where it opens something."""
    tokens = _tokens(text)
    if not tokens:
        return text
    at = generator.randrange(len(tokens))
    end = min(len(tokens), at + generator.choice((1, 2, 3, 8)))
    tokens[at:end] = tokens[at:end] * generator.choice((2, 2, 2, 3, 3, 10, 10, 60))
    return "".join(tokens)


def _statement(text: str, generator: Random) -> str:
    """A piece of another text, where a statement may begin."""
    other = generator.choice((*PIECES, generator.choice(texts())))
    if len(other) > 200:
        at = generator.randrange(len(other) - 100)
        other = other[at : at + generator.randint(1, 100)]
    places = [match.end() for match in re.finditer(r"[;{}]", text)] or [len(text)]
    at = generator.choice(places)
    return text[:at] + other + text[at:]


def _wrap(text: str, generator: Random) -> str:
    """A stretch inside something."""
    head, tail = generator.choice(
        (("group { ", " }"), ("(", ")"), ("[", "]"), ("chain { ", " }"), ("for (i in 0..2) { ", " }"),
         ("module w(a = 1) { ", " }"), ("-", ""), ("if (true) { ", " } else { }"), ("/*", "*/"), ('"', '"'))
    )  # fmt: skip
    tokens = _tokens(text)
    at = generator.randint(0, len(tokens))
    end = generator.randint(at, len(tokens))
    return "".join(tokens[:at]) + head + "".join(tokens[at:end]) + tail + "".join(tokens[end:])


_CHANGES: Final = (_cut, _insert, _insert, _replace, _replace, _exchange, _number, _repeat, _statement, _wrap)
