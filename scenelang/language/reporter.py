"""Reporter of an evaluation: one report a place and a name, none that only follows from a syntax mistake."""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterable
from dataclasses import field, replace
from itertools import islice
from typing import Any, Final

from scenelang.assets.records import Record
from scenelang.language import library, tree
from scenelang.language.diagnostics import Diagnostic, Diagnostics, Effort, Fix, Label, SourceFile, Span
from scenelang.language.library import Calls
from scenelang.language.limits import MAX_COMPARED, Halt

Advice = tuple[str | None, Fix | None]
"""Help, and a fix."""

_SHOWN: Final = 3  # further places of one report
_WORD: Final = re.compile(r"[A-Za-z_]\w*")
_NAMES: Final = frozenset(("E0201", "E0203", "E0204", "E0206", "E0207", "E0208", "E0212", "E0213"))
_PLACES: Final = frozenset(("E0202", "E0330", "E0331", "E0332", "E0333", "E0334", "E0335"))
_LOST: Final = frozenset(("E0104", "E0105", "E0106", "E0109", "E0129"))
"""Mistakes after which nobody knows what is defined where: of braces, and in the place of a name."""
_ORPHANS: Final = frozenset(("E0335", "W0304"))
"""Reports of what may be there under a misspelt name."""
_CERTAIN: Final = frozenset(("E0116", "E0117", "E0123", "E0127", "E0132"))
"""Mistakes in one word, number or sign: those with a fix are read as fixed, and hide nothing."""


class Damage(Record):
    """Lines of a file that its syntax mistakes leave unknown, and words that may have been defined there."""

    lines: frozenset[int] = frozenset()
    words: frozenset[str] = frozenset()
    lost: bool = False  # nobody knows what is defined where: a brace or a name is missing

    def holds(self, span: Span) -> bool:
        """Test whether a place lies in text that was mended or skipped."""
        return bool(self.lines) and span.locate()[0][0] in self.lines

    def explains(self, code: str, span: Span) -> bool:
        """Test whether a diagnostic may follow from a syntax mistake."""
        if not self.lines:
            return False
        lost = self.lost or span.text.partition(".")[0] in self.words
        return self.holds(span) or (code in _NAMES and lost) or (code in _PLACES and self.lost)


_SOUND: Final = Damage()


def find_damage(file: tree.File, found: Iterable[Diagnostic]) -> Damage:
    """The damage that a file's syntax mistakes, those among ``found``, have done."""
    source = file.span.source
    marks = [
        (d.code, d.span)
        for d in found
        if d.code.startswith("E01") and d.span is not None and d.span.source is source
        if d.fix is None or d.code not in _CERTAIN
    ]
    marked = {line for _, span in marks for line in _lines(span)}
    lines = set(marked)
    for node in tree.walk(file) if marks else ():
        if isinstance(node, tree.Stmt):
            blocks = [child.span.start for child in tree.children(node) if isinstance(child, tree.Block)]
            own = _lines(Span(source, node.span.start, min([node.span.end, *blocks])))
            if isinstance(node, tree.BadStmt) or not marked.isdisjoint(own):
                lines.update(own)
    words = frozenset(word for line in lines for word in _WORD.findall(source.line(line)))
    lost = any(code in _LOST or not {"{", "}"}.isdisjoint(span.text) for code, span in marks)
    return Damage(frozenset(lines), words, lost)


def _lines(span: Span) -> range:
    (first, _), (last, _) = span.locate()
    return range(first, last + 1)


class Reporter(Record, frozen=False):
    """Mistakes of one evaluation, and the places and names that have been reported."""

    diagnostics: Diagnostics
    calls: Calls | None = None  # those that are running
    damaged: dict[SourceFile, Damage] = field(default_factory=dict)
    reported: dict[tuple[SourceFile, Span], str] = field(default_factory=dict)  # the code at each place
    shared: dict[Hashable, int] = field(default_factory=dict)  # indices of reports that several places share
    effort: Effort = field(default_factory=lambda: Effort(MAX_COMPARED))
    words_in: dict[SourceFile, frozenset[str]] = field(default_factory=dict)

    def damage(self, source: SourceFile) -> Damage:
        return self.damaged.get(source, _SOUND)

    def words(self, source: SourceFile) -> frozenset[str]:
        if source not in self.words_in:
            self.words_in[source] = frozenset(_WORD.findall(source.text))
        return self.words_in[source]

    def follows(self, code: str, span: Span) -> bool:
        """Test whether a diagnostic may follow from another mistake: of syntax, or an unknown node."""
        if code in _ORPHANS and "E0204" in self.reported.values():
            return True
        if not self.damaged:
            return False
        within = self.calls.outwards() if self.calls is not None else ()
        damage = self.damage(span.source)
        return damage.explains(code, span) or any(self.damage(call.source).holds(call) for call in within)

    def error(
        self,
        code: str,
        message: str,
        span: Span,
        *,
        help: str | None = None,
        fix: Fix | None = None,
        labels: tuple[Label, ...] = (),
    ) -> int | None:
        """Report a mistake with the calls that led to it, unless it may follow from one of syntax.

        One in the library is reported where that is called. Returns the index of the report, None where
        nothing was added; raises `Halt` where no more mistakes are kept.
        """
        calls = self.calls
        site = calls.outside() if calls is not None and library.holds(span.source) else None
        if site is not None:
            if not code.startswith("E032"):  # a limit of the scene
                message = library.misfit(site.text, message)
                alias, _, name = site.text.rpartition(".")
                shape = library.shapes_of(span.source).get(name)
                help = f"it is called {alias}.{shape}" if shape else None
            labels, fix, span = (), None, site
        elif calls is not None:
            labels = (*labels, *(Label(call, "in this call") for call in islice(calls.outwards(), 2)))
        if self.reported.setdefault((span.source, span), code) != code or self.follows(code, span):
            return None  # one place, one mistake: what else is wrong there most likely comes of it
        index = len(self.diagnostics)
        if not self.diagnostics.add(code, message, span, labels=labels, help=help, fix=fix):
            raise Halt
        return None if index == len(self.diagnostics) else index

    def warn(self, code: str, message: str, span: Span, help: str | None) -> None:
        """Warn, unless it may follow from a mistake of syntax."""
        if not self.follows(code, span):
            self.diagnostics.add(code, message, span, help=help)

    def error_once(self, key: Hashable, code: str, message: str, span: Span, **more: Any) -> None:
        """Report a mistake, as `error` does, or show its place at the report of the same one of this key."""
        if (index := self.shared.get(key)) is None:
            if (index := self.error(code, message, span, **more)) is not None:
                self.shared[key] = index
            return
        known = self.diagnostics.items[index]
        again = [label for label in known.labels if label.message == "also here"]
        if len(again) < _SHOWN and span not in (known.span, *(label.span for label in again)):
            labels = (*known.labels, Label(span, "also here"))
            self.diagnostics.items[index] = replace(known, labels=labels)
