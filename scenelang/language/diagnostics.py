"""Diagnostics as values: places in text, codes, messages, suggestions and fixes.

Everything here is pure: texts go in, texts come out.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right, insort_left
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from heapq import nsmallest
from operator import attrgetter
from typing import Final, Generic, Literal, TypeVar

from scenelang.assets.records import Record


class SourceFile:
    """One text a scene was read from; diagnostics print its ``name``, usually the path as written."""

    def __init__(self, name: str, text: str) -> None:
        self.name: Final = name
        self.text: Final = text

    @cached_property
    def _starts(self) -> list[int]:
        return [0, *(newline.end() for newline in re.finditer("\n", self.text))]

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column of a code-point offset, both from 1."""
        starts = self._starts
        offset = min(max(offset, 0), len(self.text))
        line = bisect_right(starts, offset)
        return line, offset - starts[line - 1] + 1

    def line(self, number: int) -> str:
        """The text of line ``number`` (from 1) without its newline; empty past the end."""
        starts = self._starts
        if not 1 <= number <= len(starts):
            return ""
        end = starts[number] if number < len(starts) else len(self.text)
        return self.text[starts[number - 1] : end].rstrip("\r\n")


class Span(Record):
    """A half-open range ``[start, end)`` of code points in one file."""

    source: SourceFile
    start: int
    end: int

    _key = attrgetter("start", "end")

    def __repr__(self) -> str:
        return f"Span(start={self.start}, end={self.end})"

    def to(self, other: Span) -> Span:
        """The span from the start of this one to the end of ``other`` (same file)."""
        return Span(self.source, min(self.start, other.start), max(self.end, other.end))

    @property
    def text(self) -> str:
        return self.source.text[self.start : self.end]

    def locate(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """``((line, column), (line, column))`` of start and end, from 1, in code points."""
        return self.source.position(self.start), self.source.position(self.end)


Severity = Literal["error", "warning"]
MOST_CHARS: Final = 1000
MOST: Final = 1000
"""So many errors of a file, and so many warnings, are kept."""
MOST_EDITS: Final = 10_000
"""A fix that would take more is left out."""
_BEYOND: Final = {"E": ("E0121", "mistakes"), "W": ("W0102", "warnings")}
BEYOND: Final = tuple(code for code, _ in _BEYOND.values())
"""Codes that say that there are more than are kept."""


class Label(Record):
    """A further place that a diagnostic points at, with a few words of its own."""

    span: Span
    message: str


class Edit(Record):
    """Replace the text of ``span`` by ``replacement``."""

    span: Span
    replacement: str


class Fix(Record):
    """A change that mends the mistake, and is safe to apply unseen unless it is a guess."""

    message: str
    edits: tuple[Edit, ...]
    guess: bool = False


class Diagnostic(Record):
    """One mistake or doubt about a scene.

    Args:
        code: a stable code, ``E0102`` or ``W0501``; see ``scenelang explain``.
        message: the fact, lower case, no full stop.
        span: the primary place; ``None`` where a scene did not come from text.
        labels: further places.
        help: advice.
        fix: a safe change.
        guess: a change that editors offer, and nothing applies unseen.
    """

    code: str
    message: str
    span: Span | None
    labels: tuple[Label, ...] = ()
    help: str | None = None
    fix: Fix | None = None
    guess: Fix | None = None

    @property
    def severity(self) -> Severity:
        return "warning" if self.code.startswith("W") else "error"


def _cut(text: str) -> str:
    return text if len(text) <= MOST_CHARS else f"{text[:MOST_CHARS]}…"


class Diagnostics:
    """An ordered collector; the same code at the same place is kept once, and of a file at most `MOST`."""

    items: list[Diagnostic]

    def __init__(self, items: Iterable[Diagnostic] = ()) -> None:
        self.items = list(items)
        self._seen: set[tuple[str, str, int, int]] = set()
        self._counts: dict[tuple[str, str], int] = {}

    def add(
        self,
        code: str,
        message: str,
        span: Span | None,
        *,
        labels: Iterable[Label] = (),
        help: str | None = None,
        fix: Fix | None = None,
    ) -> bool:
        """Record one diagnostic, with a long message cut; False where there is no room for it."""
        if span is not None:
            key = (code, span.source.name, span.start, span.end)
            if key in self._seen:
                return True
            self._seen.add(key)
        kind = (code[0], "" if span is None else span.source.name)
        beyond, noun = _BEYOND[code[0]]
        if code != beyond:
            count = self._counts[kind] = self._counts.get(kind, 0) + 1
            if count > MOST:
                if count == MOST + 1:
                    self.add(beyond, f"more than {MOST:,} {noun}", span, help="others are not reported")
                return False
        if fix is not None and len(fix.edits) > MOST_EDITS:
            fix = None
        given = tuple([Label(label.span, _cut(label.message)) for label in labels])
        fix, guess = (None, fix) if fix is not None and fix.guess else (fix, None)
        said = _cut(help) if help else help
        self.items.append(Diagnostic(code, _cut(message), span, given, said, fix, guess))
        return True

    @property
    def errors(self) -> list[Diagnostic]:
        return [d for d in self.items if d.severity == "error"]

    def __iter__(self) -> Iterator[Diagnostic]:
        return iter(self.items)

    def __len__(self) -> int:
        return len(self.items)


_CLEAR = 0.5  # by so much a name has to be nearer than the next for a fix to be safe
_SWAPPED, _CASE, _JOINT, _FIRST = 0.9, 0.05, 0.3, 0.15
_LONGEST = 64  # letters of a name that others are compared with
_MOST_SLIPS = 8


class Effort(Record, frozen=False):
    """Budget for finding similar names in one scene, which may hold thousands of names and mistakes."""

    left: int = 500_000  # pairs of letters that may still be compared


def ranked(
    name: str, known: Iterable[str], slips: int | None = None, effort: Effort | None = None
) -> list[tuple[float, str]]:
    """The names that may have been meant, nearest first, each with its distance.

    A letter more, less or other is one slip, two neighbours swapped a little less, an underscore or a final
    ``s`` less again, other case next to nothing, a wrong first letter a little more. By default one in three
    letters is forgiven. Names that are left when ``effort`` is spent are not looked at.
    """
    if (len(name) < 2 and not slips) or len(name) > _LONGEST:
        return []
    limit = min(len(name) // 3 if slips is None else slips, _MOST_SLIPS)
    plain, letters = _plain(name), set(name.lower())
    effort = effort or Effort()
    candidates = []
    for candidate in sorted(set(known)):
        if effort.left <= 0:
            break
        effort.left -= 8
        if abs(len(candidate) - len(name)) > limit + 2:  # an underscore and a final s make no slip
            continue
        if _plain(candidate) == plain:
            distance = _CASE if candidate.lower() == name.lower() else _JOINT
        else:
            lower = candidate.lower()
            own = set(lower)
            if max(len(letters - own), len(own - letters)) > limit:
                continue  # one slip takes at most one of them away
            effort.left -= len(name) * (2 * limit + 1)
            distance = _slips(name.lower(), lower, limit)
            distance += _FIRST * (name[:1].lower() != candidate[:1].lower())
            if distance > limit + _FIRST or distance >= max(len(name), len(candidate)):
                continue
        candidates.append((distance, candidate))
    return sorted(candidates)


def nearest(name: str, known: Iterable[str], slips: int | None = None) -> str | None:
    return next((candidate for _, candidate in ranked(name, known, slips)), None)


def _plain(name: str) -> str:
    """A name without what is easily forgotten: case, underscores, the plural."""
    plain = name.lower().replace("_", "")
    return plain[:-1] if len(plain) > 3 and plain.endswith("s") else plain


def _slips(a: str, b: str, limit: int) -> float:
    """Optimal string alignment distance; anything above ``limit`` once it is sure to exceed it."""
    if abs(len(a) - len(b)) > limit:
        return limit + 1
    far = limit + 1.0
    older: list[float] = []
    row: list[float] = list(range(len(b) + 1))
    for i, letter in enumerate(a, 1):
        older, last, row = row, older, [far] * (len(b) + 1)
        row[0] = i
        for j in range(max(1, i - limit), min(len(b), i + limit) + 1):  # further off it costs too much
            other = b[j - 1]
            cost = min(older[j] + 1, row[j - 1] + 1, older[j - 1] + (letter != other))
            if i > 1 and j > 1 and letter == b[j - 2] and a[i - 2] == other:
                cost = min(cost, last[j - 2] + _SWAPPED)
            row[j] = cost
        if min(row) > limit and (not last or min(older) > limit):
            return limit + 1
    return row[-1]


def did_you_mean(
    name: str, known: Iterable[str], span: Span, *, slips: int | None = None, effort: Effort | None = None
) -> tuple[str | None, Fix | None]:
    """Help text and fix for a misspelt ``name`` at ``span``; both None where nothing is close.

    Where several names are equally near there is no fix, and the help names the first three. A fix is a guess
    unless only case, underscores or a plural differ: `cube` may be `tube`, or a shape that is not there.
    """
    if not (ranking := ranked(name, known, slips, effort)):
        return None, None
    best = ranking[0][0]
    near = [candidate for distance, candidate in ranking if distance < best + _CLEAR]
    if len(near) > 1:
        shown = [f"`{candidate}`" for candidate in near[:3]]
        return f"did you mean {', '.join(shown[:-1])} or {shown[-1]}?", None
    # `p3` is not `p2`, `rotateX` not `rotate` and `heptagon` not `pentagon`: they have a meaning.
    digits, others = ([c for c in text if c.isdigit()] for text in (name, near[0]))
    axis = name[-1:] in "xyzXYZ" and name[:-1].rstrip("_").lower() == near[0].lower()
    start = best < 2 or name[:1].lower() == near[0][:1].lower()
    sure = digits == others and not axis and best <= 2 and start
    guess = best > _JOINT
    fix = Fix(f"rename to `{near[0]}`", (Edit(span, near[0]),), guess) if sure else None
    return f"did you mean `{near[0]}`?", fix


def instead(
    name: str, words: Mapping[str, str], known: Iterable[str], span: Span
) -> tuple[str | None, Fix | None]:
    """Help and fix for a word of another language whose name here is known, or None and None."""
    if (here := words.get(name.lower())) is None or here not in known:
        return None, None
    return f"it is called `{here}` here", Fix(f"write `{here}`", (Edit(span, here),))


def listing(known: Iterable[str], limit: int = 12) -> str:
    """Names for a help text, sorted, cut off after ``limit``."""
    names = nsmallest(limit + 1, known)
    shown = ", ".join(names[:limit])
    return shown + (", …" if len(names) > limit else "")


def common_start(left: Sequence[str], right: Sequence[str]) -> int:
    """Number of items with which both sequences begin."""
    pairs = enumerate(zip(left, right, strict=False))
    return next((at for at, (a, b) in pairs if a != b), min(len(left), len(right)))


def plural(count: int, noun: str) -> str:
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


MAX_ROUNDS: Final = 50
"""A fix may uncover the next mistake; a text that still changes after so many rounds is left there."""
MAX_CROWDED: Final = 2
"""Texts with more mistakes than are kept are left after so many rounds."""
SPENT: Final = "E0322"
"""More steps than an evaluation may have: texts that take so long are not checked again."""

Key = TypeVar("Key", bound=Hashable)


def apply_fixes(text: str, diagnostics: Iterable[Diagnostic]) -> tuple[str, tuple[Diagnostic, ...]]:
    """Apply the fixes of some diagnostics of one text, as many as go together; fixes of other texts stay out.

    A fix is applied whole or not at all. Where two touch the same place, the one that stands first in the
    text wins and the other waits for the next round. Equal fixes of two diagnostics are applied once.

    Returns:
        The text with the fixes, and the diagnostics whose fixes went into it, in the order of the text.
    """
    taken: list[Edit] = []  # in the order of the text, none touching another
    done: list[Diagnostic] = []
    whole: set[tuple[Edit, ...]] = set()
    candidates = [(d, d.fix.edits) for d in diagnostics if d.fix is not None and _fits(d.fix, text)]
    for diagnostic, edits in sorted(candidates, key=lambda candidate: [*map(_order, candidate[1])]):
        if edits not in whole:
            if any(_meets(taken, edit) for edit in edits):
                continue
            whole.add(edits)
            for edit in edits:
                insort_left(taken, edit, key=_order)
        done.append(diagnostic)
    parts, at = [], 0
    for edit in taken:
        parts += [text[at : edit.span.start], edit.replacement]
        at = edit.span.end
    return "".join([*parts, text[at:]]), tuple(done)


def removal(source: SourceFile, start: int, end: int) -> Fix:
    """A fix that takes ``[start, end)`` away, with the line or the spaces that nothing is left of."""
    text = source.text
    first = text.rfind("\n", 0, start) + 1
    last = text.find("\n", end)
    last = len(text) if last < 0 else last + 1
    if not text[first:start].strip() and not text[end:last].strip():
        start, end = first, last
    elif text[start - 1 : start] in (" ", "\n", ""):
        while text[end : end + 1] == " ":
            end += 1
        if text[end : end + 1] in ("\n", ";", ",", ")", "]", ""):
            start = first + len(text[first:start].rstrip(" "))
    return Fix("remove it", (Edit(Span(source, start, end), ""),))


def _fits(fix: Fix, text: str) -> bool:
    return any(e.span.text != e.replacement for e in fix.edits) and all(
        (e.span.source.text is text or e.span.source.text == text)
        and 0 <= e.span.start <= e.span.end <= len(text)
        for e in fix.edits
    )


def _order(edit: Edit) -> tuple[int, int]:
    return edit.span.start, edit.span.end


def _meets(taken: list[Edit], edit: Edit) -> bool:
    """Test whether an edit overlaps a neighbour or inserts at the same place, so that order would matter."""
    at = bisect_left(taken, _order(edit), key=_order)
    for other in taken[max(0, at - 1) : at + 1]:
        (start, end), (next_start, next_end) = sorted((_order(edit), _order(other)))
        empty = start == end or next_start == next_end
        if next_start < end or (empty and next_start == end):
            return True
    return False


# ---------------------------------------------------------------- until nothing changes


class Settled(Record, Generic[Key]):
    """Texts after all their fixes."""

    texts: dict[Key, str]  # what each file holds now
    applied: dict[Key, tuple[Diagnostic, ...]]  # what was fixed, in the order of fixing
    left: tuple[tuple[Key | None, Diagnostic], ...]  # what is still found
    stable: bool  # False where fixes undid each other and the last good texts are given


def settle(
    texts: Mapping[Key, str], check: Callable[[Mapping[Key, str]], Iterable[tuple[Key | None, Diagnostic]]]
) -> Settled[Key]:
    """Apply fixes to ``texts``, by any key, until none is left.

    ``check`` finds their diagnostics, each with the key of its file, None for a file that may not change.
    """
    now = dict(texts)
    applied: dict[Key, tuple[Diagnostic, ...]] = dict.fromkeys(now, ())
    left = tuple(check(now))
    seen = {tuple(now.values())}
    crowded = 0
    for _ in range(MAX_ROUNDS):
        codes = {d.code for _, d in left}
        crowded += not codes.isdisjoint(BEYOND)
        if crowded > MAX_CROWDED or SPENT in codes:
            return Settled(now, applied, left, True)
        after, fixed = dict(now), dict(applied)
        for key in now:
            after[key], done = apply_fixes(now[key], [d for k, d in left if k == key])
            fixed[key] += done
        if after == now:
            return Settled(now, applied, left, True)
        remaining = tuple(check(after))
        if tuple(after.values()) in seen or (_unreadable(remaining) and not _unreadable(left)):
            break
        seen.add(tuple(after.values()))
        now, applied, left = after, fixed, remaining
    return Settled(now, applied, left, False)


def _unreadable(diagnostics: Iterable[tuple[Key | None, Diagnostic]]) -> bool:
    """Test for syntax errors; a fix that brings the first one is a bug, and its round is dropped."""
    return any(d.code.startswith("E01") for _, d in diagnostics)
