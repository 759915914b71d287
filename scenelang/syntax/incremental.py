"""Parsing again after an edit: only the top-level statements near it; the rest of the tree is kept.

What comes out equals a parse of the whole text: tree, spans and diagnostics. That rests on three facts.

- At a boundary between two top-level statements the parser's stack holds nothing but the statements
  read so far, so what follows depends on the tokens that follow alone.
- Recovery looks at most `_REACH` tokens past a mistake, and before its statement at the one token there.
  So a statement with a mistake is kept only that far from the edit, and what is read again after a mistake
  goes on that far.
- What looks at the whole text (braces that do not match, an open comment, too many mistakes, too deep
  nesting) is told apart, and such a text is parsed as a whole.

Kept trees stand at their old places until somebody asks for them: an edit near the top of a long file
moves everything after it and costs nothing where nobody looks.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final

from scenelang.diagnostics.diagnostic import Diagnostic, Diagnostics
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.syntax import nodes
from scenelang.syntax.lexer import Report, Tokens, scan
from scenelang.syntax.parser import parse, parse_tokens
from scenelang.syntax.recovery.repairs import FOLLOWED
from scenelang.syntax.tables import tables

_REACH: Final = 3 * FOLLOWED
_MOST_MISTAKES: Final = 50  # with more of them the whole text is read: some limit may be near
_GLOBAL: Final = ("E0115", "E0120", "E0121", "E0133")
"""An open comment, nesting, too many, habits of other languages: these concern more than one statement."""


@dataclass(slots=True)
class _Piece:
    """A top-level statement where it was last parsed or moved to, and the version of the text then."""

    node: nodes.Stmt
    version: int


@dataclass(frozen=True)
class Edit:
    """``old[start:old_end]`` became ``new[start:new_end]``; offsets in code points."""

    start: int
    old_end: int
    new_end: int

    @property
    def delta(self) -> int:
        return self.new_end - self.old_end


def difference(old: Sequence[str], new: Sequence[str]) -> Edit:
    """The shortest single edit from one text, or list of lines, to another."""
    start = _common(old, new)
    end = _common(old[start:][::-1], new[start:][::-1])
    return Edit(start, len(old) - end, len(new) - end)


def _common(left: Sequence[str], right: Sequence[str]) -> int:
    """How many items two sequences begin with alike."""
    pairs = enumerate(zip(left, right, strict=False))
    return next((at for at, (a, b) in pairs if a != b), min(len(left), len(right)))


@dataclass
class Parsed:
    """A text and its tree, ready to be edited."""

    source: SourceFile
    starts: list[int]  # where each top-level statement begins
    ends: list[int]  # and where it ends
    tokens: Tokens  # the text's tokens, as they were before recovery
    diagnostics: tuple[Diagnostic, ...]  # all syntax mistakes, in the order of the text
    pieces: list[_Piece] = field(repr=False)  # the statements, perhaps at older places
    reparsed: int = 0  # how many statements were read to get here
    version: int = 0  # the number of edits so far

    def statement(self, index: int) -> nodes.Stmt:
        """Top-level statement number ``index``, at its place in this text."""
        piece = self.pieces[index]
        if piece.version != self.version:
            # A new piece: the old one may belong to an older text that somebody still reads.
            delta = self.starts[index] - piece.node.span.start
            piece = _Piece(_moved(piece.node, delta, self.source), self.version)
            self.pieces[index] = piece
        return piece.node

    def heads(self) -> list[nodes.Stmt]:
        """All top-level statements, *not* at their places: for names and kinds only."""
        return [piece.node for piece in self.pieces]

    def at(self, offset: int) -> int | None:
        """Index of the statement that holds ``offset``, its end included; None between statements."""
        index = bisect_right(self.starts, offset) - 1
        return index if index >= 0 and offset <= self.ends[index] else None

    @cached_property
    def file(self) -> nodes.File:
        """The whole tree."""
        statements = tuple(self.statement(index) for index in range(len(self.pieces)))
        return nodes.File(Span(self.source, 0, len(self.source.text)), statements)

    @cached_property
    def is_local(self) -> bool:
        """Whether every mistake concerns its own statement alone."""
        found = self.diagnostics
        if len(found) > _MOST_MISTAKES or any(d.code in _GLOBAL for d in found):
            return False
        return not self.tokens.cut and _settled(self.tokens.kinds)


def parse_whole(source: SourceFile) -> Parsed:
    """Parse a text from scratch."""
    diagnostics = Diagnostics()
    file = parse(source, diagnostics)
    tokens = scan(source, Report(source))
    return Parsed(
        source,
        [stmt.span.start for stmt in file.statements],
        [stmt.span.end for stmt in file.statements],
        tokens,
        tuple(diagnostics),
        [_Piece(stmt, 0) for stmt in file.statements],
        len(file.statements),
    )


def parse_edited(old: Parsed, source: SourceFile, edit: Edit) -> Parsed:
    """Parse a text of which an older version is known.

    Returns:
        What `parse_whole` gives, for less work.
    """
    if old.pieces and old.is_local:
        for reach in (1, _REACH):
            new = _spliced(old, source, edit, reach)
            if new is not None and new.is_local:
                return new
    return parse_whole(source)


def _spliced(old: Parsed, source: SourceFile, edit: Edit, reach: int) -> Parsed | None:
    """The new version, or None where reading ``reach`` unchanged tokens after the edit does not tell."""
    delta = edit.delta
    first, last = _first(old, edit.start), _last(old, edit.old_end, reach)
    to_end = last == len(old.pieces)
    begin = old.starts[first] if first else 0
    end = len(source.text) if to_end else old.ends[last] + delta
    report = Report(source)
    tokens = scan(source, report, begin, end)
    if tokens.cut or not _settled(tokens.kinds):
        return None
    pristine = scan(source, Report(source), begin, end)  # recovery edits the others
    fresh = parse_tokens(tokens, report).statements
    found = Diagnostics()
    report.flush(found)
    others = len(old.diagnostics)
    if not _is_sound(found, others, reach, pristine, source.text[begin:end], begin, to_end):
        return None
    if not to_end:
        # The statement that was read again to be sure has to come out as it was.
        before = old.pieces[last].node
        if not fresh or fresh[-1].span.end != end:
            return None
        if fresh[-1] != _moved(before, fresh[-1].span.start - before.span.start, source):
            return None
    placed = [(d, d.span.start) for d in old.diagnostics if d.span is not None]
    before_it = [_moved(d, 0, source) for d, start in placed if start < begin]
    after_it = [_moved(d, delta, source) for d, start in placed if not to_end and start > end - delta]
    rest = slice(last + 1, None)
    version = old.version + 1
    return Parsed(
        source,
        [*old.starts[:first], *(s.span.start for s in fresh), *(s + delta for s in old.starts[rest])],
        [*old.ends[:first], *(s.span.end for s in fresh), *(e + delta for e in old.ends[rest])],
        _joined(old.tokens, pristine, source, begin, end - delta, delta),
        (*before_it, *found, *after_it),
        [*old.pieces[:first], *(_Piece(stmt, version) for stmt in fresh), *old.pieces[rest]],
        len(fresh),
        version,
    )


def _first(old: Parsed, start: int) -> int:
    """Index of the first statement to read: a sound one before the edit, after one that is."""
    index = max(0, bisect_left(old.ends, start) - 1)
    touched = bisect_left(old.tokens.starts, start)
    near = old.tokens.starts[max(0, touched - _REACH)] if old.tokens.starts else 0
    for d in old.diagnostics:
        if d.span is not None and d.span.start >= near:
            index = min(index, max(0, bisect_left(old.ends, d.span.start) - 1))
            break
    while index and not (_is_clean(old, index) and _is_clean(old, index - 1)):
        index -= 1
    return index


def _last(old: Parsed, end: int, reach: int) -> int:
    """Index of the last statement to read: a sound one, far enough after the edit."""
    index = bisect_right(old.starts, end)  # statements from here on begin after the edit
    if index < len(old.starts):
        token = bisect_left(old.tokens.starts, old.starts[index])
        far = min(token + reach, len(old.tokens.starts) - 1)
        index = bisect_left(old.ends, old.tokens.starts[far])
    while index < len(old.pieces) and not _is_clean(old, index):
        index += 1
    return index


def _is_clean(old: Parsed, index: int) -> bool:
    """Whether no mistake touches a statement or what stands before it."""
    low, high = old.ends[index - 1] if index else 0, old.ends[index]
    spans = [d.span for d in old.diagnostics if d.span is not None]
    return not any(span.start <= high and span.end >= low for span in spans)


def _is_sound(
    found: Diagnostics, others: int, reach: int, tokens: Tokens, text: str, begin: int, to_end: bool
) -> bool:
    """Whether the mistakes found in a part are those that a parse of the whole text finds there."""
    if not found.items:
        return True
    if len(found) + others > _MOST_MISTAKES or any(d.code in _GLOBAL for d in found):
        return False
    if to_end or reach < _REACH:
        return to_end
    furthest = max(d.span.end for d in found if d.span is not None)
    behind = len(tokens.starts) - bisect_left(tokens.starts, furthest)
    # A string that is not closed might be closed further on in its line.
    return behind >= _REACH and "\n" in text[furthest - begin :]


def _moved(value: Any, delta: int, source: SourceFile) -> Any:
    """A tree or a diagnostic with its spans ``delta`` further on, in ``source``."""
    cls = value.__class__
    if cls is Span:
        return Span(source, value.start + delta, value.end + delta)
    if cls is tuple:
        return tuple([_moved(item, delta, source) for item in value])
    names = getattr(cls, "__match_args__", ())
    return cls(*[_moved(getattr(value, name), delta, source) for name in names]) if names else value


def _joined(old: Tokens, new: Tokens, source: SourceFile, begin: int, old_end: int, delta: int) -> Tokens:
    """The old tokens with those in ``[begin, old_end)`` replaced by the new ones, and moved after them."""
    low, high = bisect_left(old.starts, begin), bisect_left(old.starts, old_end)
    whole = Tokens(source)
    inner = len(new.kinds) - 1  # without its end of text
    whole.kinds = [*old.kinds[:low], *new.kinds[:inner], *old.kinds[high:]]
    whole.starts = [*old.starts[:low], *new.starts[:inner], *(at + delta for at in old.starts[high:])]
    whole.ends = [*old.ends[:low], *new.ends[:inner], *(at + delta for at in old.ends[high:])]
    whole.reported = {at for at in old.reported if at < begin} | new.reported
    whole.reported |= {at + delta for at in old.reported if at >= old_end}
    return whole


def _settled(kinds: list[int]) -> bool:
    """Whether all braces match and no statement at top level leaves a bracket open behind it."""
    literals = tables().literals
    opening, closing, semicolon = literals["{"], literals["}"], literals[";"]
    ups, downs = {literals["("], literals["["]}, {literals[")"], literals["]"]}
    depth = brackets = 0
    for kind in kinds:
        if kind == opening:
            depth += 1
        elif kind == closing:
            depth -= 1
            if depth < 0 or (depth == 0 and brackets):
                return False
        elif depth == 0:
            if kind in ups:
                brackets += 1
            elif kind in downs:
                brackets -= brackets > 0
            elif kind == semicolon:
                brackets = 0
    return depth == 0 and brackets == 0
