"""One place, one mistake; one cause, one report; and nothing that only follows from a mistake of syntax."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Final

from scenelang.diagnostics.diagnostic import Diagnostics, Fix, Label
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.diagnostics.suggest import Effort
from scenelang.evaluate.limits import MAX_COMPARED, Halt
from scenelang.evaluate.report.mismatch import Misfit
from scenelang.evaluate.report.suppression import NONE, Damage
from scenelang.scene import library
from scenelang.scene.spans import Calls
from scenelang.syntax import nodes
from scenelang.syntax.lexer import scan
from scenelang.syntax.tables import tables
from scenelang.syntax.tokens import Report

Advice = tuple[str | None, Fix | None]
"""Help, and a fix."""

_SHOWN: Final = 3  # places of one report


@dataclass(slots=True)
class Shared:
    """A report that several places share.

    Args:
        index: its index among the diagnostics.
        own: labels of its own.
        again: further places.
    """

    index: int
    own: tuple[Label, ...]
    again: dict[Span, None] = field(default_factory=dict)


def shown_places(places: Collection[Span], words: str | Sequence[str], rest: str = "") -> tuple[Label, ...]:
    """Labels for the places that share one report: the first few, and how many there are beyond.

    Args:
        places: in the order in which they were met.
        words: what is said at each place, or at all.
        rest: how the number of the others is put: "in" for "and in 2 more".
    """
    each = [words] * _SHOWN if isinstance(words, str) else words
    labels = [Label(place, text) for place, text in zip(islice(places, _SHOWN), each, strict=False)]
    if len(places) > _SHOWN:
        more = f"{rest} {len(places) - _SHOWN} more".strip()
        labels[-1] = replace(labels[-1], message=f"{labels[-1].message}, and {more}")
    return tuple(labels)


@dataclass(slots=True)
class Reporter:
    """Where the mistakes of one evaluation go, and what is known of those reported.

    Args:
        diagnostics: receives them.
        calls: the calls that are running.
    """

    diagnostics: Diagnostics
    calls: Calls | None = None
    damaged: dict[int, Damage] = field(default_factory=dict)
    reported: dict[tuple[int, int, int], str] = field(default_factory=dict)
    blamed: dict[tuple[int, int, str], Shared] = field(default_factory=dict)
    """Reports of values of the wrong kind, by the definitions they may come from and what is said."""
    unknown: dict[tuple[str, str, int], Shared] = field(default_factory=dict)
    """Reports of unknown names, by code, name and file."""
    told: set[tuple[str, str, int]] = field(default_factory=set)
    """Unknown names that were reported where a definition has the slip."""
    effort: Effort = field(default_factory=lambda: Effort(MAX_COMPARED))
    shared: dict[Hashable, Shared] = field(default_factory=dict)
    """Other reports that several places share, by what they have in common."""
    misfits: dict[int, tuple[nodes.Fn | nodes.Module, dict[Span, Misfit]]] = field(default_factory=dict)
    """Calls that do not fit by what they call and where, until they are reported."""
    names_in: dict[int, dict[str, list[Span]]] = field(default_factory=dict)
    defined: dict[tuple[int, int], Span] = field(default_factory=dict)
    """Where variables and functions are defined, by the file and place of each use."""
    origins: dict[tuple[int, int], nodes.Expr] = field(default_factory=dict)
    """The values of lets and the bodies of functions, by the file and place of their names."""
    parameters: dict[tuple[int, int], tuple[int, int]] = field(default_factory=dict)
    """What a parameter belongs to, as a key of ``given``, and its index; by its file and place."""
    given: dict[int, list[list[nodes.Argument | None]]] = field(default_factory=dict)
    """The arguments of all calls of a function or module."""

    def call_labels(self) -> list[Label]:
        """Labels for the innermost calls that are running."""
        labels: list[Label] = []
        calls = self.calls
        while calls is not None and len(labels) < 2:
            labels.append(Label(calls.span, "in this call"))
            calls = calls.outer
        return labels

    def follows(self, code: str, span: Span) -> bool:
        """Whether a diagnostic may follow from a syntax mistake, there or in a call that is running."""
        if not self.damaged:
            return False
        damage = self.damaged.get(id(span.source), NONE)
        calls = self.calls
        while calls is not None:
            if self.damaged.get(id(calls.span.source), NONE).holds(calls.span):
                return True
            calls = calls.outer
        return damage.explains(code, span)

    def error(
        self,
        code: str,
        message: str,
        span: Span,
        *,
        help: str | None = None,
        fix: Fix | None = None,
        labels: tuple[Label, ...] = (),
    ) -> Shared | None:
        """Report a mistake with the calls that led to it, unless it may follow from one of syntax.

        One that shows in the library that ships is reported where that is called.

        Returns:
            The report, for further places of it; None where nothing was added.

        Raises:
            Halt: there are so many mistakes that no more are kept.
        """
        site = self.calls.outside() if self.calls is not None and library.holds(span.source) else None
        if site is not None:
            labels, fix, span = (Label(span, "which is used here"),), None, site
        place = (id(span.source), span.start, span.end)
        if self.reported.setdefault(place, code) != code or self.follows(code, span):
            return None  # one place, one mistake: what else is wrong there most likely comes of it
        index = len(self.diagnostics)
        around = self.call_labels() if site is None else []
        if not self.diagnostics.add(code, message, span, labels=(*labels, *around), help=help, fix=fix):
            raise Halt
        return Shared(index, self.diagnostics.items[index].labels) if index < len(self.diagnostics) else None

    def share(self, shared: Shared, place: Span, rest: str = "") -> None:
        """Show a further place at a report."""
        items, index = self.diagnostics.items, shared.index
        if place == items[index].span or place in shared.again:
            return
        shared.again[place] = None
        places = shown_places(shared.again, "also here", rest)
        items[index] = replace(items[index], labels=(*shared.own, *places))

    def error_once(
        self,
        key: Hashable,
        code: str,
        message: str,
        span: Span,
        *,
        help: str | None = None,
        fix: Fix | None = None,
        labels: tuple[Label, ...] = (),
    ) -> None:
        """Report a mistake, or show its place at the report of the same one with the same key.

        A fix is for one place: where there are several it is left out.
        """
        known = self.shared.get(key)
        if known is None:
            known = self.error(code, message, span, help=help, fix=fix, labels=labels)
            if known is not None:
                self.shared[key] = known
        elif not self.follows(code, span):
            self.share(known, span)
            items, index = self.diagnostics.items, known.index
            items[index] = replace(items[index], fix=None if known.again else items[index].fix)

    def uses(self, source: SourceFile) -> dict[str, list[Span]]:
        """Where each name stands in a text, its definition included; made at the first unknown name."""
        known = self.names_in.get(id(source))
        if known is None:
            known = self.names_in[id(source)] = {}
            tokens = scan(source, Report(source))
            kinds = {tables().kind(name) for name in ("NAME", "step", "as")}
            for index, kind in enumerate(tokens.kinds):
                if kind in kinds:
                    span = Span(source, tokens.starts[index], tokens.ends[index])
                    known.setdefault(span.text, []).append(span)
        return known

    def is_unused(self, name: str, span: Span | None) -> bool:
        """Whether nothing in a text bears a name but its definition at ``span``."""
        return span is not None and len(self.uses(span.source).get(name, ())) == 1
