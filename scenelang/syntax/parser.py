"""Text to tree: braces, the automaton, and `syntax.recovery.recover` where a token does not fit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.syntax import nodes
from scenelang.syntax.automaton import run
from scenelang.syntax.build import Builder
from scenelang.syntax.lexer import scan
from scenelang.syntax.nesting import limit_nesting
from scenelang.syntax.tables import tables
from scenelang.syntax.tokens import Report, Tokens

if TYPE_CHECKING:
    from scenelang.syntax.recovery.recover import Recovery


def parse(source: SourceFile, diagnostics: Diagnostics) -> nodes.File:
    """The tree of a text; never raises.

    Args:
        source: the text.
        diagnostics: takes every syntax mistake, in the order of the text.

    Returns:
        A tree of the whole text. Where there are mistakes it holds `BadStmt` and `BadExpr` nodes.
    """
    report = Report(source)
    tokens = scan(source, report)
    if _unbalanced(tokens):
        # What only mistakes need is loaded at the first one: most runs start and end without any.
        from scenelang.syntax.recovery.braces import balance

        balance(tokens, report)
    file = parse_tokens(tokens, report)
    report.flush(diagnostics)
    return file


def _unbalanced(tokens: Tokens) -> bool:
    """Whether some brace has no counterpart."""
    opening, closing = tables().literals["{"], tables().literals["}"]
    depth = 0
    for kind in tokens.kinds:
        if kind == opening:
            depth += 1
        elif kind == closing:
            depth -= 1
            if depth < 0:
                return True
    return depth != 0


def parse_tokens(tokens: Tokens, report: Report) -> nodes.File:
    """The tree of tokens whose braces match; recovery edits them and reports to ``report``."""
    limit_nesting(tokens, report)
    recovery: Recovery | None = None
    unfinished: list[Any] = []

    def mend(states: list[int], values: list[Any], at: int) -> int | None:
        nonlocal recovery, unfinished
        if recovery is None:
            from scenelang.syntax.recovery.recover import Recovery

            recovery = Recovery(tokens, report)
        unfinished = values
        return recovery.resume(states, values, at)

    file: nodes.File | None = run(tokens.kinds, Builder(tokens, report).callbacks(), mend)
    return _abandoned(tokens, unfinished) if file is None else file


def _abandoned(tokens: Tokens, values: list[Any]) -> nodes.File:
    """The tree of what came before the mistakes became too many."""
    statements = values[0] if values and isinstance(values[0], list) else []
    end = tokens.ends[-1]
    start = statements[-1].span.end if statements else 0
    rest = nodes.BadStmt(Span(tokens.source, start, end))
    return nodes.File((*statements, rest), Span(tokens.source, 0, end))
