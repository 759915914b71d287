"""Slips of the pen, made on purpose: what a mutation study does to sound scenes, and who judges the result.

Each mutation changes one token of a scene. Lark's own parser, built from the grammar, says whether the text
still is one of the language; where it is, evaluating it says whether it still means something. What is left
of neither is a mistake, and its diagnostics are looked at.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
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

Fault = Literal["syntax", "meaning"]

PLAUSIBLE = (
    *("{", "}", "(", ")", "[", "]", ";", ",", "=", ".", "..", ":", "+", "-", "*", "/", "==", "<", "?"),
    *("0.5", "2", "30deg", "#d33", '"s"', "x", "scale", "square"),
    *("let", "if", "else", "for", "in", "fn", "group", "chain", "material", "subtract", "module"),
)
"""What a hand may put where it does not belong."""


@dataclass(frozen=True, slots=True)
class Mutation:
    """One slip in one scene.

    Args:
        kind: what was done.
        scene: the scene's name.
        text: what came out.
        lines: the first and last line that the slip touches, in ``text``.
        what: in words, for reports.
    """

    kind: Kind
    scene: str
    text: str
    lines: tuple[int, int]
    what: str


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a mutation that is a mistake.

    Args:
        mutation: the slip.
        fault: whether the text is no longer one of the language, or no longer means anything.
        diagnostics: all that is reported about the scene.
        tree: whether there was a tree of the whole text.
    """

    mutation: Mutation
    fault: Fault
    diagnostics: tuple[Diagnostic, ...]
    tree: bool

    @property
    def count(self) -> int:
        return len(self.diagnostics)

    @property
    def near(self) -> bool:
        """Whether the first diagnostic is at most one line from the slip."""
        return bool(self.diagnostics) and self.distance <= 1

    @property
    def distance(self) -> int:
        """Lines between the slip and the nearest diagnostic."""
        first, last = self.mutation.lines
        lines = [d.span.locate()[0][0] for d in self.diagnostics if d.span is not None]
        return min((max(first - line, line - last, 0) for line in lines), default=1_000_000)

    @property
    def good(self) -> bool:
        """One mistake, one diagnostic, where it is."""
        return self.count == 1 and self.near


@dataclass(frozen=True, slots=True)
class Scene:
    """A sound text to make slips in.

    Args:
        name: short name.
        text: the text.
        path: its file; what it imports lies beside it.
    """

    name: str
    text: str
    path: Path


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
    kinds = ["double", "beside"]
    if len(word) > 1:
        kinds.append("drop")
    if at + 1 < len(word) and word[at] != word[at + 1]:
        kinds.append("exchange")
    kind = generator.choice(kinds)
    if kind == "drop":
        return word[:at] + word[at + 1 :]
    if kind == "double":
        return word[:at] + word[at] + word[at:]
    if kind == "exchange":
        return word[:at] + word[at + 1] + word[at] + word[at + 2 :]
    rows = ("qwertyuiop", "asdfghjkl", "zxcvbnm")
    row = next((row for row in rows if word[at].lower() in row), "xyz")
    place = row.find(word[at].lower())
    return word[:at] + row[place - 1 if place > 0 else 1] + word[at + 1 :]


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


def exhaust(seed: int, tries: int = 2, kinds: Sequence[Kind] = KINDS) -> Iterator[tuple[Scene, Mutation]]:
    """Slips of each kind at every token of every scene; ``tries`` of those that are drawn."""
    generator = random.Random(seed)
    for scene in scenes():
        for index in range(len(_words(scene))):
            for kind in kinds:
                for _ in range(1 if kind in ("delete", "swap", "cut") else tries):
                    mutation = mutate(scene, kind, index, generator)
                    if mutation is not None:
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


class Disagreement(AssertionError):
    """The judge and the language do not agree on whether a text is sound."""


def judge(scene: Scene, mutation: Mutation) -> Outcome | None:
    """What becomes of a slip; None where the text is still a scene.

    Raises:
        Disagreement: the parser takes what the grammar refuses, or the other way about.
    """
    diagnostics, tree, meant = check(scene, mutation.text)
    sound = is_language(mutation.text)
    # `a.f()` is what the grammar reads and the tree has no place for.
    syntax = [d for d in diagnostics if d.code[1:3] == "01" and d.code != "E0128"]
    if sound == bool(syntax):
        raise Disagreement(f"Lark says {sound}, the parser {syntax}: {mutation.what} in\n{mutation.text}")
    if sound and meant:
        return None
    whole = tree.span.end == len(mutation.text)
    return Outcome(mutation, "meaning" if sound else "syntax", tuple(diagnostics), whole)


# ---------------------------------------------------------------- counting


@dataclass(slots=True)
class Tally:
    """Counts of one kind of mistake."""

    outcomes: list[Outcome] = field(default_factory=list)
    still_sound: int = 0

    def share(self, right: str) -> float:
        """The share of mistakes that are ``right``: an attribute of `Outcome`."""
        return sum(bool(getattr(o, right)) for o in self.outcomes) / max(1, len(self.outcomes))

    def counts(self) -> Counter[int]:
        """How many mistakes gave so many diagnostics."""
        return Counter(o.count for o in self.outcomes)


Table = dict[tuple[Kind, Fault], Tally]


def study(slips: Iterator[tuple[Scene, Mutation]]) -> Table:
    """Judge many slips."""
    table: Table = {}
    for scene, mutation in slips:
        outcome = judge(scene, mutation)
        if outcome is None:
            table.setdefault((mutation.kind, "meaning"), Tally()).still_sound += 1
        else:
            table.setdefault((mutation.kind, outcome.fault), Tally()).outcomes.append(outcome)
    return table


def parsed_only(tally: Tally) -> Tally:
    """The same mistakes as the parser alone reports them."""
    outcomes = [
        replace(o, diagnostics=tuple(d for d in o.diagnostics if d.code[1:3] == "01"))
        for o in tally.outcomes
        if o.fault == "syntax"
    ]
    return Tally(outcomes)


def together(table: Table, fault: Fault | None = None) -> Tally:
    """All kinds of mistakes as one."""
    tallies = [tally for (_, its), tally in table.items() if fault in (None, its)]
    return Tally([o for tally in tallies for o in tally.outcomes], sum(t.still_sound for t in tallies))
