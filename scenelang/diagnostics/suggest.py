"""Did you mean: the known names nearest to a misspelt one, words of other languages, lists, plurals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from heapq import nsmallest

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import Span
from scenelang.records import Record

_CLEAR = 0.5  # by so much a name has to be nearer than the next for a fix to be safe
_SWAPPED, _CASE, _JOINT, _FIRST = 0.9, 0.05, 0.3, 0.15
_LONGEST = 64  # letters of a name that others are compared with
_MOST_SLIPS = 8


class Effort(Record, frozen=False):
    """What looking for similar names may still cost, over all of a scene: it may hold thousands of both."""

    left: int = 500_000  # pairs of letters that may still be compared

    @property
    def spent(self) -> bool:
        return self.left <= 0


def ranked(
    name: str, known: Iterable[str], slips: int | None = None, effort: Effort | None = None
) -> list[tuple[float, str]]:
    """The names that may have been meant, nearest first, each with its distance.

    The distance counts slips: a letter more, less or other is one, two neighbours swapped a little less,
    an underscore or a final ``s`` too many or too few less again, other case next to nothing. A wrong first
    letter counts a little more, since it seldom is.

    Args:
        slips: how many slips are forgiven; by default one in three letters.
        effort: what this takes its work from; the names that are left when it is spent are not looked at.
    """
    if (len(name) < 2 and not slips) or len(name) > _LONGEST:
        return []
    limit = min(len(name) // 3 if slips is None else slips, _MOST_SLIPS)
    plain, letters = _plain(name), set(name.lower())
    effort = effort or Effort()
    found = []
    for candidate in sorted(set(known)):
        if effort.spent:
            break
        effort.left -= 8
        if abs(len(candidate) - len(name)) > limit + 2:  # an underscore and a final s make no slip
            continue
        other = _plain(candidate)
        if other == plain:
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
        found.append((distance, candidate))
    return sorted(found)


def nearest(name: str, known: Iterable[str], slips: int | None = None) -> str | None:
    """The known name with the fewest slips from ``name``; None where none is near."""
    found = ranked(name, known, slips)
    return found[0][1] if found else None


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


class Suggestion(str):
    """A help text that suggests one name, with the name."""

    name: str

    def __new__(cls, name: str) -> Suggestion:
        made = super().__new__(cls, f"did you mean `{name}`?")
        made.name = name
        return made


def did_you_mean(
    name: str, known: Iterable[str], span: Span, *, slips: int | None = None, effort: Effort | None = None
) -> tuple[str | None, Fix | None]:
    """Help text and fix for a misspelt ``name`` at ``span``; both None where nothing is close.

    Where several names are equally near there is no fix, and the help names the first three.
    """
    found = ranked(name, known, slips, effort)
    if not found:
        return None, None
    best = found[0][0]
    near = [candidate for distance, candidate in found if distance < best + _CLEAR]
    if len(near) > 1:
        shown = [f"`{candidate}`" for candidate in near[:3]]
        return f"did you mean {', '.join(shown[:-1])} or {shown[-1]}?", None
    fix = Fix(f"rename to `{near[0]}`", (Edit(span, near[0]),)) if is_slip(name, near[0], best) else None
    return Suggestion(near[0]), fix


def is_slip(name: str, other: str, distance: float) -> bool:
    """Whether one name can only have been meant for the other.

    `p3` is not `p2`, `rotateX` not `rotate` and `heptagon` not `pentagon`: they mean something of their own.
    """
    digits, others = ([c for c in text if c.isdigit()] for text in (name, other))
    axis = name[-1:] in "xyzXYZ" and name[:-1].rstrip("_").lower() == other.lower()
    start = distance < 2 or name[:1].lower() == other[:1].lower()
    return digits == others and not axis and distance <= 2 and start


def instead(
    name: str, words: Mapping[str, str], known: Iterable[str], span: Span
) -> tuple[str | None, Fix | None]:
    """Help and fix for a word of another language whose name here is known; both None for any other."""
    here = words.get(name.lower())
    if here is None or here not in known:
        return None, None
    return f"it is called `{here}` here", Fix(f"write `{here}`", (Edit(span, here),))


def listing(known: Iterable[str], limit: int = 12) -> str:
    """Names for a help text, sorted, cut off after ``limit``."""
    names = nsmallest(limit + 1, known)
    shown = ", ".join(names[:limit])
    return shown + (", …" if len(names) > limit else "")


def plural(count: int, noun: str) -> str:
    """`1 error`, `2 errors`."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"
