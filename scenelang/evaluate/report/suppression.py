"""What syntax mistakes leave unknown, so that nothing is reported that only follows from them.

A statement with a syntax mistake has been mended or skipped, by guess. What it defines, and what is wrong
inside it, is known when it reads again; until then both are passed over in silence.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from scenelang.diagnostics.diagnostic import Diagnostic
from scenelang.diagnostics.span import Span
from scenelang.records import Record
from scenelang.syntax import nodes
from scenelang.syntax.tables import tables

_WORD = re.compile(r"[A-Za-z_]\w*")
_DEFINITION = re.compile(
    r"(?:let|param|fn|module)\b(?P<name>[ \t]+[A-Za-z_]\w*)?"
    r"|(?:import|include|use|require)\b(?P<alias>.{0,200}?\bas[ \t]{1,20}\w+)?"
)
_NAMES = frozenset(("E0201", "E0202", "E0203", "E0204", "E0206", "E0207", "E0208", "E0212", "E0213"))
_CERTAIN = frozenset(("E0116", "E0117", "E0123", "E0127", "E0132"))
"""Mistakes in one word, number or sign: those with a fix are read as fixed, and hide nothing."""

_BRACES = frozenset(("E0104", "E0106", "E0129"))
_PLACES = frozenset(("E0330", "E0331", "E0332", "E0333", "E0334", "E0335"))


class Damage(Record):
    """The damage of one file.

    Args:
        parts: what cannot be trusted: simple statements, and the heads of those with a block; in the order
            of the text, none within another.
        blocks: blocks whose head is damaged; names that it defines may be used in them.
        words: words in damaged parts: a definition may have been among them.
        nameless: some damaged definition does not say what it defines.
        unmatched: braces did not match, so nobody knows what stands where.
    """

    parts: tuple[Span, ...] = ()
    blocks: tuple[Span, ...] = ()
    words: frozenset[str] = frozenset()
    nameless: bool = False
    unmatched: bool = False

    def __bool__(self) -> bool:
        return bool(self.parts)

    def loses(self, name: str) -> bool:
        """Whether the definition of a name, plain or dotted, may be among what is damaged."""
        return self.nameless or name in self.words or name.partition(".")[0] in self.words

    def holds(self, span: Span) -> bool:
        """Whether a place lies in a damaged part."""
        at = bisect_right(self.parts, span.start, key=lambda part: part.start)
        return at > 0 and span.end <= self.parts[at - 1].end

    def explains(self, code: str, span: Span) -> bool:
        """Whether a diagnostic may follow from a syntax mistake."""
        if self.holds(span):
            return True
        if code in _NAMES and any(block.start <= span.start < block.end for block in self.blocks):
            return True
        return self.unmatched and code in _NAMES | _PLACES


NONE = Damage()


def find_damage(file: nodes.File, found: Iterable[Diagnostic]) -> Damage:
    """The damage that a file's syntax mistakes, those among ``found``, have done."""
    source = file.span.source
    marks = [
        (d.code, d.span)
        for d in found
        if d.code.startswith("E01") and d.span is not None and d.span.source is source
        if d.fix is None or d.code not in _CERTAIN
    ]
    if not marks:
        return NONE
    found_parts = [node.span for node in nodes.walk(file) if isinstance(node, nodes.BadStmt)]
    blocks: list[Span] = []
    for _, span in marks:
        found_parts.append(_lines(span))
        for part, block in _touched(file.statements, span):
            found_parts.append(part)
            blocks += [block] if block else []
    parts = _outermost(found_parts)
    texts = [part.text for part in parts]
    nameless = any(_is_nameless(match) for text in texts for match in _DEFINITION.finditer(text))
    return Damage(
        parts,
        tuple(dict.fromkeys(blocks)),
        frozenset(word for text in texts for word in _WORD.findall(text)),
        nameless,
        any(code in _BRACES or (code != "E0133" and re.search("[{}]", span.text)) for code, span in marks),
    )


def _outermost(spans: Iterable[Span]) -> tuple[Span, ...]:
    """Those of some spans that lie within no other, in the order of the text."""
    found: list[Span] = []
    for span in sorted(spans, key=lambda span: (span.start, -span.end)):
        if not found or span.end > found[-1].end:
            found.append(span)
    return tuple(found)


def _is_nameless(definition: re.Match[str]) -> bool:
    """Whether a definition does not say what it defines, or says it with a keyword."""
    if definition["name"]:
        return definition["name"].strip() in tables().literals
    return not definition["alias"]


def _lines(span: Span) -> Span:
    """The whole lines of a place: what else they hold may have been read wrongly too."""
    text = span.source.text
    end = text.find("\n", span.end)
    return Span(span.source, text.rfind("\n", 0, span.start) + 1, end if end >= 0 else len(text))


def _holds_mark(block: nodes.Block, mark: Span) -> bool:
    """Whether a mistake is inside a block; one that recovery closed ends where its last statement does."""
    span = block.span
    closed = span.text.endswith("}")
    return span.start < mark.start and (mark.end < span.end or (not closed and mark.end <= span.end))


def _inside(stmt: nodes.Stmt) -> Iterator[nodes.Block]:
    """The blocks of statements that a statement has."""
    stack: list[Any] = [stmt]
    while stack:
        for child in nodes.children(stack.pop()):
            if isinstance(child, nodes.Block):
                yield child
            elif isinstance(child, nodes.Stmt):
                stack.append(child)


def _touched(statements: tuple[nodes.Stmt, ...], mark: Span) -> Iterator[tuple[Span, Span | None]]:
    """The innermost statements at a mistake: what is damaged of each, and the block that follows."""
    stack: list[nodes.Stmt] = list(_near(statements, mark))
    while stack:
        stmt = stack.pop()
        blocks = list(_inside(stmt))
        within = next((block for block in blocks if _holds_mark(block, mark)), None)
        if within is not None:
            stack.extend(_near(within.statements, mark))
        elif blocks:
            yield Span(stmt.span.source, stmt.span.start, blocks[0].span.start), blocks[0].span
        else:
            yield stmt.span, None


def _near(statements: Sequence[nodes.Stmt], mark: Span) -> Sequence[nodes.Stmt]:
    """The statements of a block that reach or touch a place."""
    first = bisect_left(statements, mark.start, key=lambda stmt: stmt.span.end)
    return statements[first : bisect_right(statements, mark.end, lo=first, key=lambda stmt: stmt.span.start)]
