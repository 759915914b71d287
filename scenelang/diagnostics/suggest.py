"""Did you mean: the known name nearest to a misspelt one."""

from __future__ import annotations

from collections.abc import Iterable

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import Span


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name with the fewest slips from ``name``: at most one in three letters, ties by name.

    A slip is a letter more, less or other, or two neighbours swapped; case does not count.
    """
    best, found = len(name) // 3, None
    for candidate in sorted(known):
        slips = _slips(name.lower(), candidate.lower(), best)
        if slips < best or (slips == best and found is None):
            best, found = slips, candidate
    return found if len(name) > 1 else None


def _slips(a: str, b: str, limit: int) -> int:
    """Optimal string alignment distance; anything above ``limit`` once it is sure to exceed it."""
    if abs(len(a) - len(b)) > limit:
        return limit + 1
    older: list[int] = []
    row = list(range(len(b) + 1))
    for i, letter in enumerate(a, 1):
        older, last, row = row, older, [i]
        for j, other in enumerate(b, 1):
            cost = min(older[j] + 1, row[j - 1] + 1, older[j - 1] + (letter != other))
            if i > 1 and j > 1 and letter == b[j - 2] and a[i - 2] == other:
                cost = min(cost, last[j - 2] + 1)
            row.append(cost)
        if min(row) > limit and (not last or min(older) > limit):
            return limit + 1
    return row[-1]


def did_you_mean(name: str, known: Iterable[str], span: Span) -> tuple[str | None, Fix | None]:
    """Help text and fix for a misspelt ``name`` at ``span``; both None where nothing is close."""
    found = nearest(name, known)
    if found is None:
        return None, None
    return f"did you mean '{found}'?", Fix(f"rename to '{found}'", (Edit(span, found),))


def listing(known: Iterable[str], limit: int = 12) -> str:
    """Names for a help text, sorted, cut off after ``limit``."""
    names = sorted(known)
    shown = ", ".join(names[:limit])
    return shown + (", …" if len(names) > limit else "")
