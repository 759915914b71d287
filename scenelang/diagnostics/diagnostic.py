"""Diagnostics are values: code, severity, message, places, help and a fix."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Literal

from scenelang.diagnostics.span import Span

Severity = Literal["error", "warning"]
MOST_CHARS = 1000


@dataclass(frozen=True, slots=True)
class Label:
    """A further place that a diagnostic points at, with a few words of its own."""

    span: Span
    message: str


@dataclass(frozen=True, slots=True)
class Edit:
    """Replace the text of ``span`` by ``replacement``."""

    span: Span
    replacement: str


@dataclass(frozen=True, slots=True)
class Fix:
    """A change that mends the mistake and is safe to apply unseen."""

    message: str
    edits: tuple[Edit, ...]


@dataclass(frozen=True, slots=True)
class Diagnostic:
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


@dataclass(slots=True)
class Diagnostics:
    """An ordered collector; the same code at the same place is kept once."""

    items: list[Diagnostic] = field(default_factory=list)
    _seen: set[tuple[str, str, int, int]] = field(default_factory=set, repr=False)

    def add(
        self,
        code: str,
        message: str,
        span: Span | None,
        *,
        labels: Iterable[Label] = (),
        help: str | None = None,
        fix: Fix | None = None,
    ) -> None:
        """Record one diagnostic; a message that quotes half a file is cut."""
        if len(message) > MOST_CHARS:
            message = f"{message[:MOST_CHARS]}…"
        if span is not None:
            key = (code, span.source.name, span.start, span.end)
            if key in self._seen:
                return
            self._seen.add(key)
        self.items.append(Diagnostic(code, message, span, tuple(labels), help, fix))

    @property
    def errors(self) -> list[Diagnostic]:
        return [d for d in self.items if d.severity == "error"]

    def __iter__(self) -> Iterator[Diagnostic]:
        return iter(self.items)

    def __len__(self) -> int:
        return len(self.items)


class SceneError(Exception):
    """Raised by the library where a scene has errors; carries the diagnostics.

    Args:
        diagnostics: all that was found, errors and warnings.
    """

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        from scenelang.diagnostics.render import render_text

        super().__init__(render_text(self.diagnostics, fixable=0))
