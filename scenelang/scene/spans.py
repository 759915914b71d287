"""Where each node of a Scene was written."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from scenelang.diagnostics.span import Span
from scenelang.scene import library


class Place(NamedTuple):
    """The two spans of a node: its heading name or keyword, and its whole statement."""

    name: Span
    statement: Span


class Calls(NamedTuple):
    """The module and function calls that led somewhere, innermost first."""

    span: Span
    outer: Calls | None

    def outside(self) -> Span | None:
        """The innermost call that is not written in the library."""
        calls: Calls | None = self
        while calls is not None and library.holds(calls.span.source):
            calls = calls.outer
        return None if calls is None else calls.span


@dataclass(slots=True)
class SpanMap:
    """Spans of a Scene's nodes, transforms and materials, by identity.

    It answers for the very objects that the evaluator made and only while that Scene is alive; for any
    other object it answers None. Nodes that one statement made many times share one place.
    """

    _places: dict[int, Place] = field(default_factory=dict)
    _calls: dict[int, Calls] = field(default_factory=dict)

    def record(self, node: object, place: Place, calls: Calls | None = None) -> None:
        """Remember where ``node`` was written and through which calls it came about.

        What the library makes counts as written where it is called.
        """
        if calls is not None and library.holds(place.name.source):
            site = calls.outside() or place.name
            place = Place(site, site)
        self._places[id(node)] = place
        if calls is not None:
            self._calls[id(node)] = calls

    def copy(self, old: object, new: object) -> None:
        """``new`` stands for ``old``, which an outer block has added to."""
        self._places[id(new)] = self._places[id(old)]
        if id(old) in self._calls:
            self._calls[id(new)] = self._calls[id(old)]

    def add(self, other: SpanMap) -> None:
        """Take over all that ``other`` knows."""
        self._places.update(other._places)
        self._calls.update(other._calls)

    def span(self, node: object) -> Span | None:
        """The name or keyword that heads the statement of ``node``: what a caret points at."""
        place = self._places.get(id(node))
        return place.name if place else None

    def statement(self, node: object) -> Span | None:
        """The whole statement of ``node``."""
        place = self._places.get(id(node))
        return place.statement if place else None

    def calls(self, node: object) -> tuple[Span, ...]:
        """The calls that led to ``node``, innermost first; empty where it stands in no module."""
        found, calls = [], self._calls.get(id(node))
        while calls is not None:
            found.append(calls.span)
            calls = calls.outer
        return tuple(found)

    def __len__(self) -> int:
        return len(self._places)
