"""One place, one mistake; one cause, one report; and nothing that only follows from a mistake of syntax."""

from __future__ import annotations

from collections.abc import Collection, Hashable
from dataclasses import field, replace
from itertools import islice
from typing import Final

from scenelang.diagnostics.diagnostic import Diagnostics, Fix, Label
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.diagnostics.suggest import Effort
from scenelang.evaluate.limits import MAX_COMPARED, Halt
from scenelang.evaluate.report.suppression import NONE, Damage
from scenelang.records import Record
from scenelang.scene import library
from scenelang.scene.spans import Calls
from scenelang.syntax.lexer import Report, scan
from scenelang.syntax.tables import tables

Advice = tuple[str | None, Fix | None]
"""Help, and a fix."""

_SHOWN: Final = 3  # places of one report


class Shared(Record, frozen=False):
    """A report that several places share: its index among the diagnostics, its own labels, further places."""

    index: int
    code: str
    own: tuple[Label, ...]
    again: dict[Span, None] = field(default_factory=dict)


def shown_places(places: Collection[Span], words: str, rest: str = "") -> tuple[Label, ...]:
    """Labels for the places that share one report: the first few, and how many there are beyond.

    ``rest`` is how their number is put: "in" for "and in 2 more".
    """
    labels = [Label(place, words) for place in islice(places, _SHOWN)]
    if len(places) > _SHOWN:
        more = f"{rest} {len(places) - _SHOWN} more".strip()
        labels[-1] = replace(labels[-1], message=f"{words}, and {more}")
    return tuple(labels)


class Reporter(Record, frozen=False):
    """Where the mistakes of one evaluation go, and what is known of those reported.

    Args:
        calls: the calls that are running.
        damaged: what syntax mistakes have damaged, by file.
        reported: the code that was reported at each place.
        shared: reports that several places share, by what they have in common.
        at_definition: unknown names that were reported where a definition has the slip.
        effort: what looking for similar names may still cost.
        names_in: where each name of a file stands.
        defined: where variables and functions are defined, by the file and start of each use.
    """

    diagnostics: Diagnostics
    calls: Calls | None = None
    damaged: dict[SourceFile, Damage] = field(default_factory=dict)
    reported: dict[tuple[SourceFile, Span], str] = field(default_factory=dict)
    shared: dict[Hashable, Shared] = field(default_factory=dict)
    at_definition: set[Hashable] = field(default_factory=set)
    effort: Effort = field(default_factory=lambda: Effort(MAX_COMPARED))
    names_in: dict[SourceFile, dict[str, list[Span]]] = field(default_factory=dict)
    defined: dict[tuple[SourceFile, int], Span] = field(default_factory=dict)

    def follows(self, code: str, span: Span) -> bool:
        """Whether a diagnostic may follow from a syntax mistake, there or in a call that is running."""
        if not self.damaged:
            return False
        within = self.calls.outwards() if self.calls is not None else ()
        if any(self.damaged.get(call.source, NONE).holds(call) for call in within):
            return True
        return self.damaged.get(span.source, NONE).explains(code, span)

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
        calls = self.calls
        site = calls.outside() if calls is not None and library.holds(span.source) else None
        if site is not None:
            labels, fix, span = (Label(span, "which is used here"),), None, site
            help = help or _called(site)
        elif calls is not None:
            labels = (*labels, *(Label(call, "in this call") for call in islice(calls.outwards(), 2)))
        if self.reported.setdefault((span.source, span), code) != code or self.follows(code, span):
            return None  # one place, one mistake: what else is wrong there most likely comes of it
        index = len(self.diagnostics)
        if not self.diagnostics.add(code, message, span, labels=labels, help=help, fix=fix):
            raise Halt
        if index == len(self.diagnostics):
            return None
        return Shared(index, code, self.diagnostics.items[index].labels)

    def warn(self, code: str, message: str, span: Span, help: str | None) -> None:
        """Warn, unless it may follow from a mistake of syntax."""
        if not self.follows(code, span):
            self.diagnostics.add(code, message, span, help=help)

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
        known = self.names_in.get(source)
        if known is None:
            known = self.names_in[source] = {}
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


def _called(site: Span) -> str | None:
    """Usage line of the library's module that a call names."""
    from scenelang.evaluate.report.foreign_words import SHAPES  # only mistakes need it

    alias, _, module = site.text.rpartition(".")
    shape = SHAPES.get(module)
    return f"it is called {alias}.{shape.call}" if shape is not None and alias else None
