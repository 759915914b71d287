"""Diagnostics are values: code, severity, message, places, help and a fix."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final, Literal

from scenelang.diagnostics.span import Span
from scenelang.records import Record

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
    """A change that mends the mistake and is safe to apply unseen."""

    message: str
    edits: tuple[Edit, ...]


class Diagnostic(Record):
    """One mistake or doubt about a scene.

    Args:
        code: a stable code, ``E0102`` or ``W0501``; see ``scenelang explain``.
        message: the fact, lower case, no full stop.
        span: the primary place; ``None`` where a scene did not come from text.
        labels: further places.
        help: advice.
        fix: a safe change.
    """

    code: str
    message: str
    span: Span | None
    labels: tuple[Label, ...] = ()
    help: str | None = None
    fix: Fix | None = None

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
        """Record one diagnostic; a message that quotes half a file is cut.

        Returns:
            Whether there is room for it.
        """
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
        self.items.append(Diagnostic(code, _cut(message), span, given, _cut(help) if help else help, fix))
        return True

    @property
    def errors(self) -> list[Diagnostic]:
        return [d for d in self.items if d.severity == "error"]

    def __iter__(self) -> Iterator[Diagnostic]:
        return iter(self.items)

    def __len__(self) -> int:
        return len(self.items)
