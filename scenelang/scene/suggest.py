"""Did you mean: the known name nearest to a misspelt one."""

from __future__ import annotations

from collections.abc import Iterable

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import Span


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name most like ``name``, or None where none is close."""
    from difflib import get_close_matches

    choices = {k.lower(): k for k in sorted(known, reverse=True)}
    found = get_close_matches(name.lower(), choices, n=1, cutoff=0.6 if len(name) > 3 else 0.5)
    if not found or (len(name) == 1 and len(found[0]) > 1):
        return None
    return choices[found[0]]


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
