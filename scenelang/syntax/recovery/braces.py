"""Matching braces before parsing, so that every block is closed and a mistake stays inside one.

Where braces do not match, the layout tells the line of the slip: a line that stands no further in than the
head of an open block comes after its end. Trying the parser out on that line tells which brace is missing
or too many. A text whose braces match is left alone, however it is laid out.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from scenelang.diagnostics.diagnostic import Label
from scenelang.diagnostics.span import Span
from scenelang.syntax.automaton import advance, completion, fits, reach
from scenelang.syntax.lexer import Report, Tokens
from scenelang.syntax.recovery.recover import Repair, report_repair
from scenelang.syntax.tables import tables

_BEHIND: Final = 4  # so many tokens after the line have to fit as well
_LONGEST: Final = 80  # so many places before the first misfit are tried
_MOST: Final = 50  # slips of one text
_INSTEAD: Final = (*"()[];,=", "BAD_EXPRESSION", "NAME", "*", ".", "..", ":", "in", "as")
"""What a brace may be written for, likely ones first."""


class _Slip(NamedTuple):
    """A line with a brace too few or too many: its tokens, and the brace that it lacks."""

    first: int
    stop: int
    missing: int


def balance(tokens: Tokens, report: Report) -> None:
    """Report braces that do not match and mend the token list."""
    if not tokens.cut:  # an open comment would have swallowed the rest of the layout
        line, grown = -1, 0  # the line that is mended, and by how many tokens it grew
        for slip in reversed(_slips(tokens)):  # from the last on, so that indices hold
            same = slip.first == line
            line, grown = slip.first, grown if same else 0
            size = len(tokens.kinds)
            _mend(tokens, report, slip._replace(stop=slip.stop + grown))
            grown += len(tokens.kinds) - size
    stray = _unmatched(tokens)[1]
    for at in stray:
        report.add("E0105", f"unmatched `{tokens.text(at)}`", *tokens.place(at))
    tokens.drop(stray)
    open_ = _unmatched(tokens)[0]
    last = len(tokens.kinds) - 1
    if open_ and not tokens.cut:
        _report_unclosed(tokens, report, last, open_[-3:], len(open_))
    tokens.replace(last, 0, [tables().literals["}"]] * len(open_))


def _unmatched(tokens: Tokens) -> tuple[list[int], list[int]]:
    """Indices of the braces that are open at the end, and of those that close nothing."""
    opening, closing = (tables().literals[sign] for sign in "{}")
    open_: list[int] = []
    stray: list[int] = []
    for index, kind in enumerate(tokens.kinds):
        if kind == opening:
            open_.append(index)
        elif kind == closing and open_:
            open_.pop()
        elif kind == closing:
            stray.append(index)
    return open_, stray


def _report_unclosed(tokens: Tokens, report: Report, at: int, open_: list[int], count: int = 1) -> None:
    end = tokens.end_before(at)
    labels = [Label(Span(tokens.source, *tokens.place(index)), "opened here") for index in open_]
    message = "missing `}`" + f" {count} times" * (count > 1)
    report.add("E0104", message, end, end, labels=labels)


# ---------------------------------------------------------------- the lines of the slips


def _slips(tokens: Tokens) -> list[_Slip]:
    """Lines whose braces do not go with the layout, as many as braces are missing at most."""
    kinds, starts, text = tokens.kinds, tokens.starts, tokens.source.text
    opening, closing = (tables().literals[sign] for sign in "{}")
    surplus = kinds.count(opening) - kinds.count(closing)
    last = len(kinds) - 1
    heads = [at for at in range(last) if tokens.on_new_line(at)]
    columns = [starts[at] - text.rfind("\n", 0, starts[at]) for at in heads]
    open_: list[tuple[int, int]] = []  # column and line of the heads of open blocks
    found: list[_Slip] = []
    doubled: set[int] = set()  # lines that leave two blocks open
    at_column: dict[int, int] = {}  # the last line that begins at a column
    for line, first in enumerate(heads):
        stop = heads[line + 1] if line + 1 < len(heads) else last
        column, closes = columns[line], kinds[first] == closing
        while open_ and (open_[-1][0] > column or (open_[-1][0] == column and not closes)):
            head = open_.pop()[1]
            if head not in doubled:  # else one of its two is too many
                head = line - 1
            found.append(_Slip(heads[head], heads[head + 1], closing))
        for at in range(first, stop):
            if kinds[at] == opening:
                deeper = line + 1 == len(heads) or columns[line + 1] > column
                inside = deeper or at + 1 < stop
                open_.append((column if inside else 0, line))
            elif kinds[at] == closing:
                if open_ and (open_[-1][1] == line or (closes and open_[-1][0] in (0, column))):
                    open_.pop()
                    continue
                head = at_column.get(column, line) if at == first else line
                if head < line and columns[head + 1] > column:  # its block was not opened there
                    found.append(_Slip(heads[head], heads[head + 1], opening))
                else:
                    found.append(_Slip(first, stop, opening))
        at_column[column] = line
        if sum(head == line for _, head in open_[-2:]) == 2:
            doubled.add(line)
    if open_ and open_[-1][1] == len(heads) - 1:
        found.append(_Slip(heads[-1], last, closing))
    if sum(1 if slip.missing == closing else -1 for slip in found) != surplus:  # an odd layout
        wanted = closing if surplus > 0 else opening
        found = [slip for slip in found if slip.missing == wanted][: abs(surplus)]
    return sorted(found)[:_MOST]


# ---------------------------------------------------------------- mending a line


def _mend(tokens: Tokens, report: Report, slip: _Slip) -> None:
    """Report one brace of a line and mend it."""
    opening, closing = (tables().literals[sign] for sign in "{}")
    repair = _best(tokens, slip)
    names = [tables().kinds[kind] for kind in repair.insert]
    end = tokens.end_before(repair.at)
    if names == ["{"] and not repair.delete:
        report.add("E0106", "missing `{`", end, end, fix=" {")
    elif names == ["}"] and not repair.delete:
        open_: list[int] = []
        for index in range(repair.at):
            if tokens.kinds[index] == opening:
                open_.append(index)
            elif tokens.kinds[index] == closing and open_:
                open_.pop()
        _report_unclosed(tokens, report, repair.at, open_[-1:])
    else:
        report_repair(tokens, report, repair, [])
    tokens.replace(repair.at, repair.delete, repair.insert)


def _best(tokens: Tokens, slip: _Slip) -> Repair:
    """The change after which most of the line, and what follows it, reads."""
    kinds, (opening, closing) = tokens.kinds, (tables().literals[sign] for sign in "{}")
    first, stop = slip.first, slip.stop
    limit = stop  # the layout cannot tell a brace at the end of a line from one at the start of the next
    while kinds[limit] in (opening, closing):
        limit += 1
    end = min(limit + _BEHIND, len(kinds) - 1)
    ends = {opening, closing, tables().literals[";"]}
    before = range(first, max(0, first - _LONGEST), -1)
    head = next((at for at in before if kinds[at - 1] in ends), first)
    if reach(_inside(kinds, head), kinds, head, end) > reach(_inside(kinds, first), kinds, first, end):
        first = head  # the line goes on with a statement
    stack = _inside(kinds, first)
    misfit = min(reach(stack.copy(), kinds, first, end), limit)
    places = range(max(first, misfit - _LONGEST), misfit + 1)
    reach(stack, kinds, first, places.start)
    depth = sum((kind == opening) - (kind == closing) for kind in kinds[first : places.start])
    best, highest = Repair(stop, 0, (slip.missing,)), (-1, 0.0, -1)
    for at in places:
        for mend in _mends(tokens, stack, at, stop, limit, slip.missing):
            if slip.missing in mend.insert and slip.missing == closing and at < stop and depth < 1:
                continue  # it would close what the layout leaves open
            trial = stack.copy()
            if all(advance(trial, kind) for kind in mend.insert):
                got = reach(trial, kinds, at + mend.delete, end)
                if got == end == len(kinds) - 1 and not fits(trial, closing):
                    got -= 1  # the text would end in the middle of a statement
                if (got, -mend.cost, mend.at) > highest:
                    best, highest = mend, (got, -mend.cost, mend.at)
        depth += (kinds[at] == opening) - (kinds[at] == closing)
        if at == limit or not advance(stack, kinds[at]):
            break
    return best


def _inside(kinds: list[int], first: int) -> list[int]:
    """The states deep inside blocks: all that a line can close fits there."""
    literals, name = tables().literals, tables().kind("NAME")
    head = [name, literals["{"]]
    if literals["else"] in kinds[first : first + 2]:
        head = [literals["if"], literals["("], name, literals[")"], literals["{"]]
    stack = [tables().start]
    for kind in head * 40:
        advance(stack, kind)
    if kinds[first] == literals["else"]:
        advance(stack, literals["}"])
    return stack


def _mends(
    tokens: Tokens, stack: list[int], at: int, stop: int, limit: int, missing: int
) -> Iterator[Repair]:
    """What may be done at one place about a missing brace, each the cheaper the likelier it is."""
    literals, kind = tables().literals, tokens.kinds[at]
    closes = missing == literals["}"]
    surplus = literals["{"] if closes else literals["}"]
    if at <= stop:
        yield Repair(at, 0, (missing,), -0.3)
    if at == stop and not fits(stack, literals["}"]):  # the line breaks off
        rest = completion(stack, literals[";"] if closes else literals["{"])
        if rest is not None and (closes or rest):
            yield Repair(at, 0, (*rest, *((literals[";"],) if closes else ()), missing), -0.6)
    elif at == stop and closes:
        yield Repair(at, 0, (missing, literals[";"]), -0.25)
    if at == stop and closes and kind != missing:
        yield Repair(at, 1, (missing,), -0.1)
    if at >= limit:
        return
    if kind == surplus:
        yield Repair(at, 1, (), -0.2 if closes else -0.5 - 0.05 * tokens.on_new_line(at))
        for rank, name in enumerate(_INSTEAD):
            yield Repair(at, 1, (tables().kind(name),), 0.001 * rank - 0.1)
    elif kind != missing:
        yield Repair(at, 1, (missing,), -0.1)
