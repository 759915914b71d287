"""Patterns over tokens: what somebody wrote, and what is written here instead, each as one line of text.

A pattern and its replacement are texts with holes: ``for (<i> = [<A>:<B>])`` and ``for (<i> in <A>..<B>)``.

======================  ======================================================================
``<i>``                 one name
``<A>``                 tokens of one statement whose brackets match, up to what follows
``<in|of>``             one of these words or signs; left out of the replacement
``<type>``              one of the words that `WORDS` has under this name
``<VALUES>``            the same, where the first of them is a number, a colour or a vector
``<LINE>``              the rest of the line, or of the statement on it
``<BODY>``              the same, or all lines below that stand further in
``<BLOCK>``             a block with its braces
``<PARAMS>``            parameters; the replacement has them without their types
``…?`` before ``>``     may be missing
======================  ======================================================================
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from itertools import takewhile
from typing import Final

from scenelang.records import Record
from scenelang.syntax.lexer import Token, Tokens
from scenelang.syntax.tables import END, tables
from scenelang.words import GEOMETRIES, NODES, OPERATIONS, TRANSFORMS

MOST: Final = 200
"""A hole takes no more tokens; a block twenty times as many."""

TYPES: Final = ("float", "int", "bool", "double", "number", "string", *(f"vec{n}" for n in "234"), "color")
WORDS: Final[Mapping[str, tuple[str, ...]]] = {
    "type": TYPES,
    "fn": ("fn", "function", "func", "fun", "def", *TYPES),
    "let": ("let", "var", "const", *TYPES),
    "node": tuple(NODES),
    "object": (*NODES, *GEOMETRIES),
    "elif": ("elif", "elsif", "elseif"),
    "call": (*(TRANSFORMS | OPERATIONS), "canvas", "background"),
    "control": ("for", "if"),
    "library": ("math", "numpy", "random", "sys", "os", "Math"),
}
"""Words that a hole of this name takes."""

_PIECE = re.compile(
    r"(?P<gap>\s*)(?:<(?P<hole>[^<>\s?]+)(?P<optional>\??)>"
    r"|(?P<text>[A-Za-z_]\w*|\.\.<(?!\w+>)|\.\.|[<>=!]=|&&|\|\||\S))"
)
_TYPED = re.compile(rf"\b(?:{'|'.join(TYPES)})\s+(?=[A-Za-z_])|\s*:\s*[A-Za-z_]\w*")
"""The types that stand before or after the names of parameters."""


class Piece(Record):
    """A hole or a literal text of a pattern."""

    text: str  # the name of the hole, or the literal text
    is_hole: bool
    spaced: bool  # a space stands before it
    optional: bool = False
    words: tuple[str, ...] = ()  # what it takes, where that is one of some words


@cache
def pieces(pattern: str) -> tuple[Piece, ...]:
    """A pattern taken apart."""
    found = []
    for match in _PIECE.finditer(pattern):
        hole = match["hole"]
        choice = tuple(re.findall(r"[^|]+", hole)) if hole and not hole.isidentifier() else ()
        words = WORDS.get(hole or "", choice)
        text = hole or match["text"]
        found.append(Piece(text, bool(hole), bool(match["gap"]), bool(match["optional"]), words))
    return tuple(found)


class Match(Record):
    """Where the pieces of a pattern were found."""

    tokens: Tokens
    start: int
    stop: int
    parts: tuple[tuple[str, int, int], ...]  # key and tokens of each piece; the key of a word is its text
    words: Mapping[str, str]  # the words found for those of `WORDS`

    def holes(self) -> dict[str, tuple[int, int]]:
        """The tokens of each hole."""
        return {key: (start, stop) for key, start, stop in self.parts if key[0] == "<"}

    def text(self, start: int, stop: int) -> str:
        """The text of some tokens, with what stands between them."""
        return self.tokens.source.text[self.tokens.starts[start] : self.tokens.ends[stop - 1]]

    def told(self, words: str) -> str:
        """Words for a report, with the names that it has in its holes."""
        names = {key: self.text(*place) for key, place in self.holes().items() if key.islower()}
        names |= {f"<{key}>": word for key, word in self.words.items()}
        return re.sub("<[a-z]+>", lambda hole: names.get(hole[0], hole[0]), words)


def find(pattern: str, tokens: Tokens, at: int) -> Match | None:
    """The tokens from ``at`` on that a pattern describes; None where they are others."""
    wanted = pieces(pattern)
    parts: list[tuple[str, int, int]] = []
    names: dict[str, str] = {}  # what stands in the holes for names
    words: dict[str, str] = {}
    start = at
    for number, piece in enumerate(wanted):
        following = next((p for p in wanted[number + 1 :] if not p.optional), None)
        stop = _taken(piece, following, tokens, at, start)
        if stop == at and not piece.optional:
            return None
        if stop > at:
            text = tokens.text(at)
            hole = piece.is_hole and not piece.words
            if hole and piece.text.islower() and names.setdefault(piece.text, text) != text:
                return None  # the same name is meant in both places
            parts.append((f"<{piece.text}>" if hole else text, at, stop))
            if piece.words:
                words[piece.text] = text
        at = stop
    return Match(tokens, start, at, tuple(parts), words)


def _taken(piece: Piece, following: Piece | None, tokens: Tokens, at: int, start: int) -> int:
    """Index after the tokens that a piece takes; ``at`` where it takes none."""
    kind = tokens.kinds[at]
    if kind == END or (piece.text == "VALUES" and tables().kinds[kind] not in ("NUMBER", "COLOR", "[")):
        return at
    if not piece.is_hole or piece.words:
        return at + (tokens.text(at) in (piece.words or (piece.text,)))
    if piece.text.islower():
        return at + (kind == tables().kind("NAME"))
    if piece.text == "BLOCK":
        return closing(tokens, at, "{}")
    if piece.text == "BODY":
        return _body(tokens, at, start)
    one_line = piece.text == "LINE"
    until = following.text if following is not None and not following.is_hole else ""
    return _run(tokens, at, until, one_line, alone=following is None and not one_line)


def _run(tokens: Tokens, at: int, until: str, one_line: bool, alone: bool) -> int:
    """Index after tokens whose brackets match, up to a text, or the end of the statement or line."""
    names = tables().kinds
    open_: list[str] = []
    for index in range(at, min(at + MOST, len(tokens.kinds) - 1)):
        text = names[tokens.kinds[index]]  # braces may have been put in
        if not open_ and (
            until in (text, tokens.text(index))
            or (alone and text == ",")
            or (one_line and tokens.on_new_line(index))
        ):
            return index
        if text in ("{", "}", ";"):
            return index
        if text in ("(", "[", "?"):
            open_.append(text)
        elif text in (")", "]") or (text == ":" and open_ and open_[-1] == "?"):
            while open_ and open_[-1] == "?" != text and text != ":":
                open_.pop()
            if not open_:
                return index
            open_.pop()
    return min(at + MOST, len(tokens.kinds) - 1)


def closing(tokens: Tokens, at: int, brackets: str = "()") -> int:
    """Index after the bracket that closes the one at an index; ``at`` where there is none near."""
    opening, close = (tables().literals[sign] for sign in brackets)
    depth = 0
    for index in range(at, min(at + 20 * MOST, len(tokens.kinds) - 1)):
        depth += (tokens.kinds[index] == opening) - (tokens.kinds[index] == close)
        if depth <= 0:
            return index + (index > at)
    return at


def _body(tokens: Tokens, at: int, head: int) -> int:
    """Index after the rest of a line, or after the lines that stand further in than a head's."""

    def column(index: int) -> int:
        return tokens.starts[index] - tokens.source.text.rfind("\n", 0, tokens.starts[index])

    opening, close = (tables().literals[sign] for sign in "{}")
    level = column(head) if tokens.on_new_line(at) else None
    depth = 0
    for index in range(at, min(at + 20 * MOST, len(tokens.kinds) - 1)):
        depth += (tokens.kinds[index] == opening) - (tokens.kinds[index] == close)
        if depth < 0 or (tokens.on_new_line(index) and (level is None or column(index) <= level)):
            return index
    return min(at + 20 * MOST, len(tokens.kinds) - 1)


class Change(Record):
    """What a replacement makes of a match, less what both have in common at their ends."""

    first: int  # of the tokens that go
    stop: int
    place: tuple[int, int]  # where it is shown: the text that goes, with the name before it
    new: list[Token]  # the tokens that come; holes that change their order are left out
    start: int  # of the text that goes
    end: int
    text: str  # that comes


def _alike(keys: list[str], others: list[str]) -> int:
    """How many of two lists are equal, from the first on."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(keys, others, strict=False)))


def change(match: Match, replacement: str, extra: Mapping[str, str]) -> Change | None:
    """What to do to a match for it to become a replacement; None where nothing would change.

    The texts of holes that the match does not have are in ``extra``.
    """
    tokens, holes = match.tokens, match.holes()
    known = {**extra, **match.words}
    wanted = [
        Piece(known[p.text], False, p.spaced) if p.is_hole and p.text in known else p
        for p in pieces(replacement)
        if not p.is_hole or p.text in known or f"<{p.text}>" in holes
    ]
    keys = [f"<{p.text}>" if p.is_hole else p.text for p in wanted]
    had = ["" if key == "<PARAMS>" and _TYPED.search(match.text(i, j)) else key for key, i, j in match.parts]
    before = _alike(keys, had)
    behind = _alike(keys[before:][::-1], had[before:][::-1])
    middle, gone = wanted[before : len(wanted) - behind], match.parts[before : len(had) - behind]
    if not middle and not gone:
        return None
    first = gone[0][1] if gone else (match.parts[before][1] if before < len(had) else match.stop)
    stop = gone[-1][2] if gone else first
    end = tokens.ends[stop - 1] if gone else tokens.starts[first]
    touching = first > 0 and (not middle or not middle[0].spaced) and before > 0
    start = tokens.ends[first - 1] if touching else tokens.starts[first]
    if gone and not middle and behind and not wanted[-behind].spaced:
        end = tokens.starts[stop]
    text, new = _written(match, middle, first, stop)
    if middle and middle[0].spaced and before and start == tokens.ends[first - 1]:
        text = f" {text}"
    if behind and wanted[-behind].spaced and (not gone or (middle and end == tokens.starts[stop])):
        text += " "
    shown_end = tokens.ends[stop - 1] if gone else end
    name = match.parts[before - 1] if before and gone and not touching else ("", first, first)
    shown = tokens.starts[name[1] if name[0].islower() and name[0][0] == "<" else first]
    return Change(first, stop, (shown, max(shown, shown_end)), new, start, end, text)


def _written(match: Match, pieces: list[Piece], first: int, stop: int) -> tuple[str, list[Token]]:
    """The text of a replacement, and its tokens: those of holes at their places, others empty, in order."""
    tokens, holes, language = match.tokens, match.holes(), tables()
    written = ""
    new: list[Token] = []
    at = tokens.starts[first]
    for number, piece in enumerate(pieces):
        text, typed = piece.text, piece.text == "PARAMS"
        place = holes.get(f"<{text}>") if piece.is_hole else None
        if place is not None and (begin := tokens.starts[place[0]]) >= at:
            types = [found.span() for found in _TYPED.finditer(match.text(*place))] if typed else []
            new += (one for one in tokens.part(*place) if not any(i <= one[1] - begin < j for i, j in types))
            at = tokens.ends[place[1] - 1]
        elif text.startswith("BAD_"):
            end = tokens.ends[stop - 1] if stop > first else at
            new.append((language.kind(text), at, end))
            at = end
        elif piece.is_hole:
            new.append((language.kind("BAD_EXPRESSION" if text.isupper() else "NAME"), at, at))
        else:
            new.append((language.literals.get(text, language.kind("NAME")), at, at))
        if place is not None:
            text = _TYPED.sub("", match.text(*place)) if typed else match.text(*place)
        written += " " * (piece.spaced and number > 0) + text
    return written, new
