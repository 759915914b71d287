"""Fixes applied to text: which go together, in what order, and again until none is left.

Everything here is pure: texts go in, texts come out. `scenelang check --fix` reads and writes the files; an
editor sends the edits of one `Fix`, or what `settle` makes of its open buffers.
"""

from __future__ import annotations

from bisect import bisect_left, insort_left
from collections.abc import Callable, Hashable, Iterable, Mapping
from typing import Final, Generic, TypeVar

from scenelang.diagnostics.diagnostic import BEYOND, Diagnostic, Edit, Fix
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.records import Record

MAX_ROUNDS: Final = 50
"""A fix may uncover the next mistake; a text that still changes after so many rounds is left there."""
MAX_CROWDED: Final = 2
"""Texts with more mistakes than are kept are left after so many rounds, as looking for so many takes long."""
SPENT: Final = "E0322"
"""More steps than an evaluation may have: texts that take so long are not checked again."""

Key = TypeVar("Key", bound=Hashable)


def apply_fixes(text: str, diagnostics: Iterable[Diagnostic]) -> tuple[str, tuple[Diagnostic, ...]]:
    """Apply the fixes of some diagnostics of one text, as many as go together.

    A fix is applied whole or not at all. Where two touch the same place, the one that stands first in the
    text wins and the other waits for the next round. Equal fixes of two diagnostics are applied once.

    Args:
        text: the text in which the diagnostics were found. A fix for any other text is left out.
        diagnostics: in any order, with or without fixes.

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
    """Whether a fix was made for this text and changes something."""
    return any(e.span.text != e.replacement for e in fix.edits) and all(
        (e.span.source.text is text or e.span.source.text == text)
        and 0 <= e.span.start <= e.span.end <= len(text)
        for e in fix.edits
    )


def _order(edit: Edit) -> tuple[int, int]:
    return edit.span.start, edit.span.end


def _meets(taken: list[Edit], edit: Edit) -> bool:
    """Whether an edit shares text with a neighbour, or an insertion its place: then order would matter."""
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
    """Apply fixes until none is left.

    Args:
        texts: the files that may change, by any key.
        check: finds the diagnostics of such texts; each comes with the key of the file that it is in, None
            for a file that may not change.

    Returns:
        The texts and what is left to mend by hand.
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
        found = tuple(check(after))
        if tuple(after.values()) in seen or (_unreadable(found) and not _unreadable(left)):
            break
        seen.add(tuple(after.values()))
        now, applied, left = after, fixed, found
    return Settled(now, applied, left, False)


def _unreadable(found: Iterable[tuple[Key | None, Diagnostic]]) -> bool:
    """Whether there are syntax errors; a fix that brings the first one is a bug, and its round is dropped."""
    return any(d.code.startswith("E01") for _, d in found)
