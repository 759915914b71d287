"""Well known mistakes: habits, by the table in `foreign`, and slips told in words of their own."""

from __future__ import annotations

import re
from bisect import bisect_left
from functools import cache, cached_property
from typing import Final

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import Span
from scenelang.syntax.automaton import fits, reach
from scenelang.syntax.lexer import UNIT_ALIASES, Report, Token, Tokens
from scenelang.syntax.recovery import mistakes
from scenelang.syntax.recovery.foreign import HABITS, OPERATORS, Habit
from scenelang.syntax.recovery.patterns import MOST, Change, Match, change, closing, find, pieces
from scenelang.syntax.recovery.repairs import FOLLOWED
from scenelang.syntax.tables import END, tables
from scenelang.words import NODES, TRANSFORMS, UNITS

_FLAT: Final = frozenset(("square", "triangle", "pentagon", "star"))
_SOLID: Final = frozenset(("sphere", "torus"))
"""What is drawn in two and in three dimensions; the scene of a text tells which materials there are."""

_MOVES: Final = {*TRANSFORMS, "color"}
_ELSEWHERE: Final = {
    "mirror": "write scale(-1, 1); in its block",
    "resize": "write scale(sx, sy); in its block, in factors",
    "offset": "outlines are not offset",
    "multmatrix": "write matrix([[…4], […4], […4], […4]]); in its block",
    "linear_extrude": "a 2D scene is not extruded",
    "rotate_extrude": "a 2D scene is not extruded",
    "hull": "there is no hull; smooth { … } blends objects into each other",
}
"""What OpenSCAD writes before objects, and what there is instead."""
_PREFIXES: Final = _MOVES.union(_ELSEWHERE)

_INSIDE: Final = (
    "it stands in the block: square { translate(1, 0); }, square { material flat { color(#d33); } }"
)

_FAR = 1000  # tokens that the statement of a loop without braces may have

_IMPORT = re.compile(
    r"""(?P<word>use|include|require)[ \t]*
        (?:<(?P<angled>[^<>"'\n]+)>|"(?P<quoted>[^"\\\n]+)")[ \t]*(?:;|(?=//)|$)""",
    re.VERBOSE | re.MULTILINE,
)
_GROUPED = re.compile(r"[0-9]{1,3}(?:,[0-9]{3}(?![\w°]|\.(?!\.)))+")


@cache
def _anchor(pattern: str) -> str:
    """What a pattern begins with: a bracket or `<`, an operand, a name or a word."""
    head = pieces(pattern)[0]
    if head.text in ("(", "[", "<", "A"):
        return head.text
    return "name" if head.is_hole and not head.words else "word"


class Habits:
    """Tells well known mistakes from others, reports them and mends their tokens."""

    def __init__(self, tokens: Tokens, report: Report) -> None:
        self.tokens = tokens
        self.report = report
        self.literals = tables().literals

    def _is(self, index: int, *texts: str) -> bool:
        kinds = self.tokens.kinds
        return index < len(kinds) and any(kinds[index] == self.literals[text] for text in texts)

    def _insert(self, index: int, name: str) -> None:
        self.tokens.replace(index, 0, [tables().kind(name)])

    # ------------------------------------------------------------ habits

    def _foreign(self, stack: list[int], first: int, at: int) -> bool:
        """What `HABITS` knows, or a transform before what it moves; ``stack`` is the statement's."""
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
        found = {"(": [], "[": [], "<": [at], "A": [], "name": [first], "word": [first, at - 1]}
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
        named = tokens.kinds[child] == tables().kind("NAME")
        glued = tokens.starts[child] == tokens.ends[child - 1]
        if glued or not (named or self._is(child, *NODES, "for", "if")):
            return False
        if reach(stack.copy(), tokens.kinds, child, child + 2) <= child + named:
            return False
        start, end = tokens.starts[first], tokens.ends[calls[-1][1] - 1]
        message = f"`{tokens.text(first)}` stands before what it applies to"
        # Among other transforms it lacks its `;`, and what follows is a material.
        among = first > 0 and mistakes.head(tokens, first - 1) in _PREFIXES
        fix = None if among else self._moved_inside(calls, child)
        help = next(
            (_ELSEWHERE[word] for call, _ in calls if (word := tokens.text(call)) in _ELSEWHERE), _INSIDE
        )
        self.report.add("E0133", message, start, end, help=help, fix=fix)
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
        known = self._materials[0] is not None and "material" not in inside
        if "//" in inside or "/*" in inside or (colours and not known):
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

    # ------------------------------------------------------------ slips

    def _head_mistake(self, states: list[int], first: int, at: int) -> bool:
        """`for` and `if` without braces, a path without quotes."""
        if self._is(at - 1, "import") and self._bare_path(at):
            return True
        wants_block = fits(states, self.literals["{"]) and not fits(states, self.literals[";"])
        if not wants_block or not self._is(at - 1, ")", "else"):
            return False
        if (
            not self._is(first, "for", "if", "module")
            or self._is(at, ";", "}", ")")
            or self.tokens.kinds[at] == END
        ):
            return False
        stop = self._end_of_statement(at)
        if not stop:
            return False
        few = [self.literals["{"], *self.tokens.kinds[at : min(stop, at + 4)]]
        if reach(states.copy(), few, 0, len(few)) < len(few):
            return False
        bare = [(at, stop)]
        if self._is(stop, "else") and not self._is(stop + 1, "{", "if"):
            bare.append((stop + 1, self._end_of_statement(stop + 1) or stop + 2))
        mistakes.report_braces(self.tokens, self.report, bare)
        for first, stop in reversed(bare):
            self._insert(stop, "}")
            self._insert(first, "{")
        return True

    def _at_end(self, at: int) -> bool:
        return self.tokens.kinds[at] == END

    def _bare_path(self, at: int) -> bool:
        """`import lib/parts.nsg as parts`: the path without its quotes."""
        tokens = self.tokens
        near = range(at + 1, min(at + 20, len(tokens.kinds) - 1))
        stop = next((i for i in near if tokens.on_new_line(i) or self._is(i, ";", "as")), at)
        if not self._is(stop, "as") or stop == at or tokens.on_new_line(stop):
            return False
        start, end = tokens.place(at, stop)
        path = tokens.source.text[start:end]
        fix = self.report.change(start, end, f'"{path}"', "put quotes around it")
        self.report.add("E0126", f"expected a string, found `{path}`", start, end, fix=fix)
        tokens.replace(at, stop - at, [])
        self._insert(at, "STRING")
        return True

    def _import_of_others(self, first: int) -> bool:
        """`use <lib.scad>`, `include "parts.nsg";`: a file without a name for it."""
        tokens, start = self.tokens, self.tokens.starts[first]
        found = _IMPORT.match(tokens.source.text, start)
        if found is None:
            return False
        path = found["angled"] or found["quoted"]
        alias = re.sub(r"\W", "_", path.rpartition("/")[2].partition(".")[0]) or "parts"
        alias = f"_{alias}" if alias[0].isdigit() or alias in self.literals else alias
        written = f'import "{path}" as {alias};'
        fix = written if path.endswith(".nsg") else None  # any other file has to be written anew
        message = f"`{found['word']}` without a name for the file"
        help = f"write {written} and use what it defines as {alias}.…"
        self.report.add("E0126", message, start, found.end(), help=help, fix=fix)
        stop = bisect_left(tokens.starts, found.end(), first, len(tokens.kinds) - 1)
        tokens.reported.update(tokens.starts[first:stop])
        tokens.give_up(first, stop, "BAD_STATEMENT", start, found.end())
        return True

    def _end_of_statement(self, at: int) -> int:
        """Index after the statement at a token, its `;` or its block; 0 where that is far."""
        opening, closing, semicolon = (self.literals[sign] for sign in "{};")
        depth, last = 0, len(self.tokens.kinds) - 1
        for index in range(at, min(at + _FAR, last)):
            kind = self.tokens.kinds[index]
            if kind == closing:
                if depth <= 1:
                    return index + depth
                depth -= 1
            elif kind == opening:
                depth += 1
            elif depth == 0 and kind == semicolon:
                return index + 1
        return last if last <= at + _FAR else 0

    def _spaced_unit(self, at: int) -> bool:
        """`30 deg`: mend the number, drop the unit."""
        tokens = self.tokens
        kind = tables().kind
        if not at or tokens.kinds[at] != kind("NAME") or tokens.kinds[at - 1] != kind("NUMBER"):
            return False
        word, gap = tokens.text(at), tokens.source.text[tokens.ends[at - 1] : tokens.starts[at]]
        if word not in (*UNITS, *UNIT_ALIASES) or gap.strip(" ") or not tokens.text(at - 1)[-1:].isdigit():
            return False
        unit = UNIT_ALIASES.get(word, word)
        start, end = tokens.starts[at - 1], tokens.ends[at]
        fix = self.report.change(tokens.ends[at - 1], end, unit, f"write `{unit}` right after the number")
        help = "units are glued to their number"
        self.report.add("E0117", "space between a number and its unit", start, end, help=help, fix=fix)
        if word in UNITS:
            tokens.ends[at - 1] = end
        else:
            tokens.reported.add(start)
        tokens.replace(at, 1, [])
        return True

    def _unseparated(self, states: list[int], at: int) -> bool:
        """`[1 2 3]`: put the commas in, as one mistake."""
        tokens = self.tokens
        literal = {tables().kind(name) for name in ("NUMBER", "COLOR", "STRING")}
        stop = at
        while tokens.kinds[stop] in literal:
            stop += 1
        if stop < at + 2 or tokens.kinds[at - 1] not in literal or not fits(states, self.literals[","]):
            return False
        gaps = tokens.ends[at - 1 : stop - 1]
        edits = tuple(Edit(Span(tokens.source, gap, gap), ",") for gap in gaps)
        self.report.add("E0112", "missing `,`", gaps[0], gaps[-1], fix=Fix("insert `,` between them", edits))
        for index in reversed(range(at, stop)):
            self._insert(index, ",")
        return True

    def _grouped_digits(self, at: int) -> bool:
        """`let n = 1,000;`: commas in a number."""
        tokens, start = self.tokens, self.tokens.starts[at - 1]
        found = _GROUPED.match(tokens.source.text, start)
        if not found or not self._is(at, ",") or tokens.kinds[at - 1] != tables().kind("NUMBER"):
            return False
        commas = found[0].count(",")
        help = "digits are not grouped, and decimals stand behind a point"
        fix = found[0].replace(",", "") if commas > 1 else None  # one comma may be the decimal one
        self.report.add("E0116", f"`{found[0]}` is not a number", start, found.end(), help=help, fix=fix)
        tokens.reported.add(start)
        tokens.ends[at - 1] = found.end()
        tokens.replace(at, 2 * commas, [])
        return True
