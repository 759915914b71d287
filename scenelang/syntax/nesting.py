"""The nesting limit: no tree is deeper than `MAX_DEPTH`, so no later stage can exhaust the stack.

Depth counts everything that makes the tree deeper: open brackets and braces, operators between them, and
the arms of an `else if` chain. The check runs over tokens, before there is a tree.
"""

from __future__ import annotations

from functools import cache

from scenelang.syntax.tables import tables
from scenelang.syntax.tokens import Report, Tokens

MAX_DEPTH = 200

_OTHER, _OPERATOR, _OPEN, _BRACE, _CLOSE, _END_BRACE, _COMMA, _SEMICOLON = range(8)


_OPERANDS = {"NAME", "NUMBER", "STRING", "COLOR", ")", "]", "true", "false", "step", "as"}


@cache
def _classes() -> tuple[int, ...]:
    """What each kind does to the depth."""
    operators = ("||", "&&", "==", "!=", "<", "<=", ">", ">=", "+", "-", "*", "/", "%", "!", "^", "?", ".")
    classes = dict.fromkeys((*operators, "else"), _OPERATOR)
    classes |= {"(": _OPEN, "[": _OPEN, ")": _CLOSE, "]": _CLOSE, ",": _COMMA, ";": _SEMICOLON}
    classes |= {"{": _BRACE, "}": _END_BRACE}
    return tuple(classes.get(name, _OTHER) for name in tables().kinds)


def limit_nesting(tokens: Tokens, report: Report) -> None:
    """Report what is nested deeper than `MAX_DEPTH` and take it out of the token list."""
    kinds = tokens.kinds
    classes = _classes()
    else_kind, round_ = tables().literals["else"], tables().literals[")"]
    cuts: list[tuple[int, int, list[int]]] = []
    depth = floor = ground = 0  # now; where this list item began; where this block's statements begin
    brackets: list[tuple[int, int]] = []  # open in this block: their kind and the floor outside
    blocks: list[tuple[int, int, int, list[tuple[int, int]]]] = []  # the state outside each open block
    resume = 0
    told = False  # one report until the depth has gone well down again
    for at, kind in enumerate(kinds):
        c = classes[kind]
        if c == _OTHER or at < resume:
            continue
        if c <= _BRACE:
            if depth == MAX_DEPTH:
                if c == _BRACE:
                    first, resume = at + 1, _end_of_block(kinds, at + 1)
                    cuts.append((first, resume, []))
                elif _goes_on(kinds, at):
                    first, resume = at, _end_of_part(kinds, at, True)
                    cuts.append((first, resume, _stand_in(kinds, at, [])))
                else:
                    first, resume = at + 1, _end_of_part(kinds, at + 1, False)
                    closed = classes[kinds[resume]] == _CLOSE
                    unclosed = [] if closed else [*(open_ for open_, _ in brackets), kind]
                    cuts.append((first, resume, _stand_in(kinds, at, unclosed)))
                resume += first > at and classes[kinds[resume]] in (_CLOSE, _END_BRACE)
                if not told:
                    _report(tokens, report, at)
                told = True
                continue
            depth += 1
            if c == _OPEN:
                brackets.append((kind, floor))
                floor = depth
            elif c == _BRACE:
                blocks.append((depth - 1, floor, ground, brackets))
                floor = ground = depth
                brackets = []
        elif c == _CLOSE:
            if brackets:
                depth = floor - (kind == round_)  # `v[0]` makes the tree deeper by what it goes on
                floor = brackets.pop()[1]
        elif c == _COMMA:
            depth = floor
        elif c == _SEMICOLON:
            brackets.clear()
            depth = floor = ground
            told = told and depth > MAX_DEPTH // 2
        elif blocks:
            depth, floor, ground, brackets = blocks.pop()
            if not brackets and kinds[at + 1] != else_kind:
                depth = floor = ground
            told = told and depth > MAX_DEPTH // 2
    for first, stop, kept in reversed(cuts):
        tokens.replace(first, stop - first, kept)


def _report(tokens: Tokens, report: Report, at: int) -> None:
    report.add(
        "E0120",
        f"nested deeper than {MAX_DEPTH} levels",
        tokens.starts[at],
        tokens.ends[at],
        help="give a part of it a name with `let`, `fn` or `module`",
    )


def _follows_operand(kinds: list[int], at: int) -> bool:
    """Whether an expression can end right before a token."""
    return tables().kinds[kinds[at - 1]] in _OPERANDS


def _goes_on(kinds: list[int], at: int) -> bool:
    """Whether a token goes on with what is before it: an operator, or the bracket of an index."""
    indexes = kinds[at] == tables().literals["["] and _follows_operand(kinds, at)
    return indexes or _classes()[kinds[at]] == _OPERATOR


def _end_of_block(kinds: list[int], first: int) -> int:
    """Index of the `}` that closes the block whose first token this is."""
    classes = _classes()
    depth = 0
    for at in range(first, len(kinds)):
        depth += (classes[kinds[at]] == _BRACE) - (classes[kinds[at]] == _END_BRACE)
        if depth < 0:
            return at
    return len(kinds) - 1


def _end_of_part(kinds: list[int], first: int, within_list: bool) -> int:
    """Index of the token that ends a part of a statement: the closing bracket or a separator."""
    classes = _classes()
    question, colon, otherwise, end_brace = (tables().literals[text] for text in ("?", ":", "else", "}"))
    chain = within_list and kinds[first] == otherwise
    open_brackets = open_braces = open_questions = 0
    for at in range(first, len(kinds) - 1):
        kind = kinds[at]
        c = classes[kind]
        if open_braces:
            open_braces += (c == _BRACE) - (c == _END_BRACE)
        elif (
            c in (_END_BRACE, _SEMICOLON)
            or (c == _CLOSE and not open_brackets)
            or (chain and at > first and kinds[at - 1] == end_brace and kind != otherwise)
        ):
            return at
        elif c == _BRACE:
            open_braces += 1
        elif c == _OPEN:
            open_brackets += 1
        elif c == _CLOSE:
            open_brackets -= 1
        elif within_list and not open_brackets:
            if c == _COMMA or (kind == colon and not open_questions):
                return at
            open_questions += (kind == question) - (kind == colon)
    return len(kinds) - 1


def _stand_in(kinds: list[int], at: int, unclosed: list[int]) -> list[int]:
    """The kinds that stand for what is cut behind a bracket or from an operator on."""
    language = tables()
    literals = language.literals
    if kinds[at] == literals["else"]:
        return []
    if _goes_on(kinds, at) and _follows_operand(kinds, at):
        return []
    closing = [literals[")"] if open_ == literals["("] else literals["]"] for open_ in reversed(unclosed)]
    return [language.kind("BAD_EXPRESSION"), *closing]
