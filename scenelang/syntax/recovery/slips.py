"""Slips that are well known: each is told in words of its own, and its tokens are mended."""

from __future__ import annotations

import re
from bisect import bisect_left

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import Span
from scenelang.syntax.automaton import fits, reach
from scenelang.syntax.lexer import UNIT_ALIASES
from scenelang.syntax.recovery import mistakes
from scenelang.syntax.tables import END, tables
from scenelang.syntax.tokens import Report, Tokens
from scenelang.words import UNITS

_FAR = 1000  # tokens that the statement of a loop without braces may have

_IMPORT = re.compile(
    r"""(?P<word>use|include|require)[ \t]*
        (?:<(?P<angled>[^<>"'\n]+)>|"(?P<quoted>[^"\\\n]+)")[ \t]*(?:;|(?=//)|$)""",
    re.VERBOSE | re.MULTILINE,
)
_GROUPED = re.compile(r"[0-9]{1,3}(?:,[0-9]{3}(?![\w°]|\.(?!\.)))+")


class Slips:
    """Tells well known mistakes from others and mends their tokens.

    Args:
        tokens: the tokens; they are edited.
        report: takes the mistakes.
    """

    def __init__(self, tokens: Tokens, report: Report) -> None:
        self.tokens = tokens
        self.report = report
        self.literals = tables().literals

    def _is(self, index: int, *texts: str) -> bool:
        kinds = self.tokens.kinds
        return index < len(kinds) and any(kinds[index] == self.literals[text] for text in texts)

    def _insert(self, index: int, name: str) -> None:
        self.tokens.replace(index, 0, [tables().kind(name)])

    def _head_mistake(self, states: list[int], first: int, at: int) -> bool:
        """`for` and `if` without braces, a path without quotes."""
        if self._is(at - 1, "import") and self._bare_path(at):
            return True
        wants_block = fits(states, self.literals["{"]) and not fits(states, self.literals[";"])
        if not wants_block or not self._is(at - 1, ")", "else"):
            return False
        if not self._is(first, "for", "if", "module") or self._is(at, ";", "}", ")") or self._at_end(at):
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
