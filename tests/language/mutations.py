"""Slips of the pen, one token of a sound scene each, and a judge of what is reported about them.

Lark's own parser, built from the grammar, says whether a text still is one of the language, evaluation
whether it still means something.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Literal

from lark import Lark
from lark.exceptions import LarkError

from scenelang.language import tree as nodes
from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile
from scenelang.language.evaluation import Source
from scenelang.language.lexer import Report, scan
from scenelang.language.parser import parse
from scenelang.language.tables import grammar_path, tables

REPOSITORY = Path(__file__).resolve().parents[2]

Kind = Literal["delete", "insert", "swap", "replace", "cut", "keyword", "name"]
KINDS: tuple[Kind, ...] = ("delete", "insert", "swap", "replace", "cut", "keyword", "name")
"""A token deleted, one put in, one exchanged with the next, one replaced, the rest of a line cut off, a
keyword misspelt, a name misspelt."""

Fault = Literal["syntax", "meaning", "none"]
"""Whether a text is no longer one of the language, no longer means anything, or still is a scene."""

PLAUSIBLE = (
    *("{", "}", "(", ")", "[", "]", ";", ",", "=", ".", "..", ":", "+", "-", "*", "/", "==", "<", "?"),
    *("0.5", "2", "30deg", "#d33", '"s"', "x", "scale", "square"),
    *("let", "if", "else", "for", "in", "fn", "group", "chain", "material", "subtract", "module"),
)
"""What a hand may put where it does not belong."""


@dataclass(frozen=True, slots=True)
class Scene:
    """A sound text to make slips in; what it imports lies next to ``path``."""

    name: str
    text: str
    path: Path


@dataclass(frozen=True, slots=True)
class Mutation:
    """One slip in one scene: the text with it, the lines of it that the slip touches, and its words."""

    kind: Kind
    scene: str
    text: str
    lines: tuple[int, int]
    what: str


@dataclass(frozen=True, slots=True)
class Outcome:
    """All that is reported about a slip, and whether there was a tree of the whole text."""

    mutation: Mutation
    fault: Fault
    diagnostics: tuple[Diagnostic, ...]
    tree: bool

    @property
    def count(self) -> int:
        return len(self.diagnostics)

    @property
    def distance(self) -> int:
        """Lines between the slip and the nearest diagnostic."""
        first, last = self.mutation.lines
        lines = [d.span.locate()[0][0] for d in self.diagnostics if d.span is not None]
        return min((max(first - line, line - last, 0) for line in lines), default=1_000_000)

    @property
    def near(self) -> bool:
        return self.distance <= 1

    @property
    def good(self) -> bool:
        """One mistake, one diagnostic, where it is."""
        return self.count == 1 and self.near


@cache
def scenes() -> tuple[Scene, ...]:
    """All examples, and the sound scenes of the tests."""
    paths = [*(REPOSITORY / "examples").rglob("*.nsg"), *(Path(__file__).parent / "scenes").glob("*.nsg")]
    return tuple(
        Scene(str(path.relative_to(REPOSITORY)), path.read_text(encoding="utf-8"), path)
        for path in sorted(paths)
    )


# ---------------------------------------------------------------- making slips


@cache
def _words(scene: Scene) -> list[tuple[str, int, int, int]]:
    """The tokens of a scene: kind's name, start, end, line."""
    source = SourceFile(scene.name, scene.text)
    tokens = scan(source, Report(source))
    names = tables().kinds
    columns = zip(tokens.kinds[:-1], tokens.starts, tokens.ends, strict=False)
    return [(names[kind], start, end, source.position(start)[0]) for kind, start, end in columns]


def _misspelt(word: str, generator: random.Random) -> str:
    """A word with one letter left out, doubled, exchanged with the next, or hit beside."""
    at = generator.randrange(len(word))
    head, letter, tail = word[:at], word[at], word[at + 1 :]
    row = next((row for row in ("qwertyuiop", "asdfghjkl", "zxcvbnm") if letter.lower() in row), "xyz")
    place = row.find(letter.lower())
    slips = [word[: at + 1] + letter + tail, head + row[place - 1 if place > 0 else 1] + tail]
    if len(word) > 1:
        slips.append(head + tail)
    if tail and letter != tail[0]:
        slips.append(head + tail[0] + letter + tail[1:])
    return generator.choice(slips)


def _glue(before: str, token: str, after: str) -> str:
    """A token between two texts, with spaces where it would grow together with its neighbours."""

    def grows(left: str, right: str) -> bool:
        return bool(left and right) and all(c.isalnum() or c in "_.#<=" for c in (left[-1], right[0]))

    return f"{before}{' ' * grows(before, token)}{token}{' ' * grows(token, after)}{after}"


def mutate(scene: Scene, kind: Kind, index: int, generator: random.Random) -> Mutation | None:
    """Make one slip at one token; None where that kind of slip cannot be made there."""
    text, words = scene.text, _words(scene)
    _, start, end, line = words[index]
    word = text[start:end]
    new, last, what = text, line, f"`{word}`"
    if kind == "delete":
        new = text[:start] + text[end:]
    elif kind in ("insert", "replace"):
        other = generator.choice(PLAUSIBLE)
        if other == word:
            return None
        if kind == "insert":
            new, what = _glue(text[:start], other, f" {text[start:]}"), f"`{other}` before {what}"
        else:
            new, what = _glue(text[:start], other, text[end:]), f"`{other}` for {what}"
    elif kind == "swap":
        if index + 1 == len(words):
            return None
        _, after, stop, last = words[index + 1]
        if text[after:stop] == word:
            return None
        gap = text[end:after]
        new = _glue(_glue(text[:start], text[after:stop], gap), word, text[stop:])
        what = f"{what} and `{text[after:stop]}`"
    elif kind == "cut":
        first = index == 0 or words[index - 1][3] < line
        stop = text.find("\n", start)
        if first or stop < 0:
            return None
        new, what = text[:start].rstrip(" ") + text[stop:], f"`{text[start:stop]}`"
    else:
        if (kind == "keyword") != (word in tables().literals) or not word.isidentifier():
            return None
        other = _misspelt(word, generator)
        new, what = text[:start] + other + text[end:], f"`{other}` for {what}"
    if new == text:
        return None
    return Mutation(kind, scene.name, new, (line, last), what)


def sample(count: int, seed: int, kinds: Sequence[Kind] = KINDS) -> Iterator[tuple[Scene, Mutation]]:
    """As many slips of each kind, at places drawn from all scenes, all tokens alike."""
    generator = random.Random(seed)
    pool = [(scene, index) for scene in scenes() for index in range(len(_words(scene)))]
    for kind in kinds:
        made = 0
        while made < count:
            scene, index = generator.choice(pool)
            mutation = mutate(scene, kind, index, generator)
            if mutation is not None:
                made += 1
                yield scene, mutation


# ---------------------------------------------------------------- judging


@cache
def _lark() -> Lark:
    return Lark(grammar_path().read_text(encoding="utf-8"), parser="lalr", lexer="basic")


def is_language(text: str) -> bool:
    """Whether Lark reads a text by the grammar."""
    try:
        _lark().parse(text)
    except LarkError:
        return False
    return True


def check(scene: Scene, text: str) -> tuple[list[Diagnostic], nodes.File, bool]:
    """All diagnostics of a text in a scene's place, its tree, and whether it means a scene."""
    diagnostics = Diagnostics()
    tree = parse(SourceFile(scene.name, text), diagnostics)
    result, _ = Source(scene.path, tree=tree).scene(diagnostics)
    return list(diagnostics), tree, result is not None


def judge(scene: Scene, mutation: Mutation) -> Outcome:
    """What becomes of a slip; raises where the parser and Lark do not agree on the text."""
    diagnostics, tree, meant = check(scene, mutation.text)
    sound = is_language(mutation.text)
    # `a.f()` is what the grammar reads and the tree has no place for.
    syntax = [d for d in diagnostics if d.code[1:3] == "01" and d.code != "E0128"]
    assert sound != bool(syntax), f"Lark says {sound}, the parser {syntax}: {mutation}"
    fault: Fault = "syntax" if not sound else "none" if meant else "meaning"
    return Outcome(mutation, fault, tuple(diagnostics), tree.span.end == len(mutation.text))


def study(count: int, seed: int, kinds: Sequence[Kind] = KINDS) -> list[Outcome]:
    """Judge as many slips of each kind."""
    return [judge(scene, mutation) for scene, mutation in sample(count, seed, kinds)]


def parsed_only(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Mistakes of syntax as the parser alone reports them."""
    return [
        replace(o, diagnostics=tuple(d for d in o.diagnostics if d.code[1:3] == "01"))
        for o in outcomes
        if o.fault == "syntax"
    ]


def share(outcomes: Sequence[Outcome], right: str) -> float:
    """The share of outcomes that are ``right``, an attribute of `Outcome`."""
    return sum(bool(getattr(o, right)) for o in outcomes) / max(1, len(outcomes))
