"""What people write out of habit: looking for it at a mistake, by the table of `syntax.recovery.foreign`."""

from __future__ import annotations

import re
from functools import cache, cached_property
from typing import Final

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import Span
from scenelang.syntax.automaton import reach
from scenelang.syntax.recovery import mistakes
from scenelang.syntax.recovery.foreign import HABITS, OPERATORS, Habit
from scenelang.syntax.recovery.patterns import (
    MOST,
    Change,
    Match,
    change,
    closing,
    find,
    pieces,
)
from scenelang.syntax.recovery.repairs import FOLLOWED
from scenelang.syntax.recovery.slips import Slips
from scenelang.syntax.tables import tables
from scenelang.syntax.tokens import Token
from scenelang.words import NODES, TRANSFORMS

_FLAT: Final = frozenset(("square", "triangle", "pentagon", "star"))
_SOLID: Final = frozenset(("sphere", "torus"))
"""What is drawn in two and in three dimensions; the scene of a text tells which materials there are."""

_MOVES: Final = {*TRANSFORMS, "color"}
_ELSEWHERE: Final = ("mirror", "resize", "offset", "multmatrix", "linear_extrude", "rotate_extrude", "hull")
_PREFIXES: Final = _MOVES.union(_ELSEWHERE)

_INSIDE: Final = (
    "it stands in the block: square { translate(1, 0); }, square { material flat { color(#d33); } }"
)


@cache
def _anchor(pattern: str) -> str:
    """What a pattern begins with: a bracket, an operand, a name or a word."""
    head = pieces(pattern)[0]
    if head.text in ("(", "[", "A"):
        return head.text
    return "name" if head.is_hole and not head.words else "word"


class Habits(Slips):
    """Tells habits from other mistakes and mends their tokens."""

    def _foreign(self, stack: list[int], first: int, at: int) -> bool:
        """What `HABITS` knows, or a transform before what it moves.

        Args:
            stack: the states before the statement.
            first: index of its first token.
            at: index of the token that did not fit.
        """
        if self._prefixed(stack, first, at):
            return True
        tokens = self.tokens
        anchors = self._anchors(first, at)
        for habit in HABITS:
            for start in anchors[_anchor(habit.pattern)]:
                match = find(habit.pattern, tokens, start)
                new = match and change(match, habit.meant, {"material": self._materials[1] or "…"})
                if match and new and self._reads_on(stack, first, at, match, new, habit.meant):
                    self._tell(habit, match, new)
                    return True
        return False

    def _anchors(self, first: int, at: int) -> dict[str, list[int]]:
        """Where a pattern may begin, by what it begins with."""
        tokens, depth = self.tokens, 0
        found = {"(": [], "[": [], "A": [], "name": [first], "word": [first, at - 1]}
        for index in range(at - 1, max(first, at - MOST), -1):
            text = tokens.text(index)
            depth += (text in (")", "]")) - (text in ("(", "["))
            if depth <= 0 and text in ("(", "[", ",", "=", "return") and not found["A"]:
                found["A"] = [index + 1]
            if depth < 0:
                before = tokens.text(index - 1)
                operand = before in (")", "]") or (before.isidentifier() and before not in ("in", "return"))
                found[text] = [] if operand else [index]
                break
        return found

    def _reads_on(self, stack: list[int], first: int, at: int, match: Match, new: Change, meant: str) -> bool:
        """Whether a change lets the rest of the statement read, or the head of one with a block."""
        if new.first > at:
            return False
        old = self._reach(stack, first, new.first, [], new.first, at)
        reached = self._reach(stack, first, new.first, new.new, new.stop, at)
        end = match.stop
        whole = meant[-1:] in (";", "}", "{", "")
        while not whole and end < match.stop + FOLLOWED and not self._at_end(end):
            end += 1
            whole = self._is(end - 1, ";", "{", "}")
        head = "BODY" in meant or (match.parts[0][0] == "for" and reached == match.stop)
        return reached > max(old, at) and (reached >= end or head)

    def _reach(self, stack: list[int], first: int, begin: int, new: list[Token], stop: int, at: int) -> int:
        """The first token after a mistake that does not fit where others stand for ``[begin, stop)``."""
        tokens = self.tokens
        trial = tokens.part(first, begin) + new + tokens.part(stop, max(at, stop) + FOLLOWED)
        # Words that stand for operators elsewhere are mended, and reported, when their turn comes.
        words = [(kind, OPERATORS.get(tokens.source.text[start:end])) for kind, start, end in trial]
        read = [self.literals[sign] if sign else kind for kind, sign in words]
        return first + reach(stack.copy(), read, 0, len(read)) + (stop - begin) - len(new)

    def _tell(self, habit: Habit, match: Match, new: Change) -> None:
        tokens = self.tokens
        old = tokens.source.text[new.start : new.end]
        fix: Fix | None = None
        if habit.safe and "…" not in new.text and "//" not in old and "/*" not in old:
            shown = " ".join(new.text.split())
            shown = shown if len(shown) <= 40 else f"{shown[:37]}…"
            words = f"write `{shown}`" if shown else "remove it"
            fix = self.report.change(new.start, new.end, new.text, words)
        help = habit.help and match.told(habit.help)
        if tokens.starts[match.start] not in tokens.reported:
            self.report.add(habit.code, match.told(habit.message), *new.place, help=help, fix=fix)
        tokens.splice(new.first, new.stop, new.new)

    @cached_property
    def _materials(self) -> tuple[str | None, str | None]:
        """What an object without a material has in this text, and what the only material is, if known."""
        words = set(re.findall(r"\w+", self.tokens.source.text))
        flat, solid = not words.isdisjoint(_FLAT), not words.isdisjoint(_SOLID)
        if flat == solid:
            return None, None
        return ("flat", "flat") if flat else ("diffuse", None)

    def _prefixed(self, stack: list[int], first: int, at: int) -> bool:
        """`translate([1, 0]) color("red") square;`: transforms before what they apply to."""
        tokens = self.tokens
        calls: list[tuple[int, int]] = []
        child = first
        while tokens.text(child) in _PREFIXES and self._is(child + 1, "(") and len(calls) < 20:
            stop = closing(tokens, child + 1)
            calls.append((child, stop))
            child = stop
        if not calls or calls[0][1] != at or tokens.text(child) in _PREFIXES:
            return False
        kinds = tokens.kinds
        if tokens.starts[child] == tokens.ends[child - 1]:
            return False
        named = kinds[child] == tables().kind("NAME")
        if not (named or self._is(child, *NODES, "for", "if")):
            return False
        if reach(stack.copy(), kinds, child, child + 2) <= child + named:
            return False
        start, end = tokens.starts[first], tokens.ends[calls[-1][1] - 1]
        message = f"`{tokens.text(first)}` stands before what it applies to"
        # Among other transforms it lacks its `;`, and what follows is a material.
        among = first > 0 and mistakes.head(tokens, first - 1) in _PREFIXES
        fix = None if among else self._moved_inside(calls, child)
        self.report.add("E0133", message, start, end, help=_INSIDE, fix=fix)
        tokens.replace(first, child - first, [])
        return True

    def _moved_inside(self, calls: list[tuple[int, int]], child: int) -> Fix | None:
        """Put transforms into the block of what they stand before."""
        tokens, text = self.tokens, self.tokens.source.text
        stop = child + 1
        while self._is(stop, "."):
            stop += 2
        stop = closing(tokens, stop) if self._is(stop, "(") else stop
        end = closing(tokens, stop, "{}")
        inside = text[tokens.starts[calls[0][0]] : tokens.ends[max(stop, end - 1)]]
        words = [tokens.text(call) for call, _ in calls]
        colours = words.count("color")
        if self._is(child, "for", "if") or not set(words) <= _MOVES or colours > 1:
            return None
        if "//" in inside or "/*" in inside:
            return None
        if colours and (self._materials[0] is None or "material" in inside):
            return None
        moves = [f"{text[tokens.starts[call] : tokens.ends[last - 1]]};" for call, last in reversed(calls)]
        moves = [m if m[:5] != "color" else f"material {self._materials[0]} {{ {m} }}" for m in moves]
        gone = Edit(Span(tokens.source, tokens.starts[calls[0][0]], tokens.starts[child]), "")
        written = " ".join(moves)
        if self._is(stop, ";"):
            place, text = tokens.place(stop), f" {{ {written} }}"
        elif end > stop:
            last = tokens.ends[end - 2]
            place, text = (last, last), f" {written}{' ' * self._is(end - 2, '{')}"
        else:
            return None
        return Fix("put them into its block", (gone, Edit(Span(tokens.source, *place), text)))
