"""Where the layout says that braces are amiss: a shortest path over the lines of a text.

The state is how far the depth meant is from the depth written. It begins at 0, may change from line to
line at the price of a slip, and has to make the depth 0 at the end; a line whose indentation does not agree
with its depth costs 1. The cheapest path is the fewest slips that explain the layout.
"""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

from scenelang.records import Record
from scenelang.syntax.lexer import Tokens
from scenelang.syntax.tables import tables

_SLIP = 1.4  # a slip costs as much as so many lines at the wrong depth
_WIDEST = 12  # further off than this is not searched
_NEVER = 1e9
_FAR = 200  # tokens in which a statement shows whether it is one


class Slip(Record):
    """Between the tokens ``first`` and ``stop`` the depth meant goes ``shift`` away from the one written.

    ``depth`` is the one meant on that line, which is less by 1 than before its `}` if it begins with one.
    """

    first: int
    stop: int
    shift: int
    depth: int


class _Line(Record):
    """A line that begins with a statement or a closing brace."""

    first: int  # index of its first token
    indent: int
    depth: int  # by the braces as written


def find_slips(tokens: Tokens) -> list[Slip]:
    """The slips that explain best why braces do not match; none where there are too many."""
    lines = _lines(tokens)
    if len(lines) > 2 and not any(line.indent for line in lines):
        # Without indentation, where lines each close what they open: the one that does not.
        pairs = [(line, after, after.depth - line.depth) for line, after in pairwise(lines)]
        wrong = [Slip(line.first, after.first, -more, line.depth) for line, after, more in pairs if more]
        if len(wrong) == 1 and abs(wrong[0].shift) <= _WIDEST:
            return wrong
    wanted = -lines[-1].depth
    if abs(wanted) > _WIDEST or min(line.depth for line in lines) < -_WIDEST:
        return []
    came_from = _cheapest(lines, wanted)
    state = wanted + _WIDEST
    slips = []
    for number in range(len(lines) - 1, 0, -1):
        source = came_from[number][state]
        if source != state:
            line = lines[number - 1]
            depth = line.depth + source - _WIDEST
            slips.append(Slip(line.first, lines[number].first, state - source, depth))
        state = source
    return slips[::-1]


def _lines(tokens: Tokens) -> list[_Line]:
    """The lines whose indentation says how deep they are, and the end of the text."""
    literals = tables().literals
    opening, closing, semicolon = literals["{"], literals["}"], literals[";"]
    starters = {kind for text, kind in literals.items() if text.isalpha()} | {tables().kind("NAME")}
    lines = []
    depth = brackets = 0
    previous = semicolon
    for at, kind in enumerate(tokens.kinds[:-1]):
        statement = previous in (semicolon, opening, closing) or kind == closing
        candidate = (statement or kind in starters) and tokens.on_new_line(at)
        if candidate and (statement or brackets == 0 or leaves_open(tokens.kinds, at)):
            brackets = 0
            start = tokens.starts[at]
            before = tokens.source.text[tokens.source.text.rfind("\n", 0, start) + 1 : start]
            lines.append(_Line(at, len(before.expandtabs(8)), depth - (kind == closing)))
        depth += (kind == opening) - (kind == closing)
        if kind in (opening, closing, semicolon):
            brackets = 0
        brackets += (kind in (literals["("], literals["["])) - (kind in (literals[")"], literals["]"]))
        previous = kind
    lines.append(_Line(len(tokens.kinds) - 1, 0, depth))
    return lines


def leaves_open(kinds: list[int], at: int) -> bool:
    """Whether a line inside brackets is a statement by itself: they are not closed where it ends."""
    literals = tables().literals
    if kinds[at] in (literals["material"], literals["step"], literals["as"]):
        return False
    depth = 0
    for kind in kinds[at : at + _FAR]:
        if kind in (literals["{"], literals["}"], literals[";"]):
            return True
        depth += (kind in (literals["("], literals["["])) - (kind in (literals[")"], literals["]"]))
        if depth < 0:
            return False
    return False


def _cheapest(lines: list[_Line], wanted: int) -> list[list[int]]:
    """For each line and state the state before it on the cheapest path."""
    pairs = pairwise(lines)
    steps = Counter(line.indent - before.indent for before, line in pairs if line.indent > before.indent)
    unit = min(steps, key=lambda step: (-steps[step], step), default=0)  # how much deeper a level stands
    offsets = range(-_WIDEST, _WIDEST + 1)
    costs = [0.0 if offset == 0 else _NEVER for offset in offsets]
    came_from = [list(range(len(offsets)))]
    for number, line in enumerate(lines):
        if number:
            came_from.append(_step(costs))
        last = number == len(lines) - 1
        for state, offset in enumerate(offsets):
            depth = line.depth + offset
            if depth < 0 or (last and offset != wanted):
                costs[state] += _NEVER
            elif not last and unit * depth != line.indent:
                costs[state] += 1
    return came_from


def _step(costs: list[float]) -> list[int]:
    """For each state the cheapest one before it; adds its cost. Moving wins a tie, so slips come late."""
    count = len(costs)
    source = list(range(count))
    for states, step in ((range(1, count), -1), (range(count - 2, -1, -1), 1)):
        for state in states:
            if costs[state + step] + _SLIP <= costs[state]:
                costs[state] = costs[state + step] + _SLIP
                source[state] = source[state + step]
    return source
