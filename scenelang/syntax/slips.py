"""Slips that are well known: each is told in words of its own, and its tokens are mended."""

from __future__ import annotations

import re
from itertools import chain

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import Span
from scenelang.syntax import mistakes
from scenelang.syntax.automaton import fits, reach
from scenelang.syntax.lexer import UNIT_ALIASES
from scenelang.syntax.tables import END, tables
from scenelang.syntax.tokens import Report, Tokens
from scenelang.words import UNITS

_FAR = 1000  # tokens that the statement of a loop without braces may have

_IMPORT = re.compile(
    r"""(?P<word>use|include|require)[ \t]*
        (?:<(?P<angled>[^<>"'\n]+)>|"(?P<quoted>[^"\\\n]+)")[ \t]*(?:;|(?=//)|$)""",
    re.VERBOSE,
)


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
        for stop in range(at + 1, min(at + 20, len(tokens.kinds) - 1)):
            if tokens.on_new_line(stop) or self._is(stop, ";"):
                return False
            if self._is(stop, "as"):
                break
        else:
            return False
        start, end = tokens.starts[at], tokens.ends[stop - 1]
        span = Span(tokens.source, start, end)
        fix = self.report.change(start, end, f'"{span.text}"', "put quotes around it")
        self.report.add("E0126", f"expected a string, found `{span.text}`", start, end, fix=fix)
        tokens.replace(at, stop - at, [])
        self._insert(at, "STRING")
        return True

    def _import_of_others(self, first: int) -> bool:
        """`use <lib.scad>`, `include "parts.nsg";`: a file without a name for it."""
        tokens, text = self.tokens, self.tokens.source.text
        start = tokens.starts[first]
        line = text[start : text.find("\n", start) if "\n" in text[start:] else len(text)]
        found = _IMPORT.match(line)
        if found is None:
            return False
        path = found["angled"] or found["quoted"]
        alias = re.sub(r"\W", "_", path.rpartition("/")[2].partition(".")[0]) or "parts"
        alias = f"_{alias}" if alias[0].isdigit() or alias in tables().literals else alias
        end = start + found.end()
        written = f'import "{path}" as {alias};'
        message = f"`{found['word']}` without a name for the file"
        fix = written if path.endswith(".nsg") else None  # any other file has to be written anew
        help = f"write {written} and use what it defines as {alias}.…"
        self.report.add("E0126", message, start, end, help=help, fix=fix)
        stop = first
        while not self._at_end(stop) and tokens.starts[stop] < end:
            tokens.reported.add(tokens.starts[stop])
            stop += 1
        tokens.replace(first, stop - first, [tables().kind("BAD_STATEMENT")])
        tokens.starts[first], tokens.ends[first] = start, end
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
        gaps = [tokens.ends[index - 1] for index in range(at, stop)]
        edits = tuple(Edit(Span(tokens.source, gap, gap), ",") for gap in gaps)
        self.report.add("E0112", "missing `,`", gaps[0], gaps[-1], fix=Fix("insert `,` between them", edits))
        for column, new in (
            (tokens.kinds, [self.literals[","]] * len(gaps)),
            (tokens.starts, gaps),
            (tokens.ends, gaps),
        ):
            column[at:stop] = chain.from_iterable(zip(new, column[at:stop], strict=True))
        return True

    def _grouped_digits(self, at: int) -> bool:
        """`let n = 1,000;`: commas in a number."""
        tokens, number = self.tokens, tables().kind("NUMBER")
        stop = at
        while (
            self._is(stop, ",")
            and tokens.kinds[stop + 1] == number
            and tokens.starts[at - 1] < tokens.starts[stop] == tokens.ends[stop - 1]
            and tokens.ends[stop] == tokens.starts[stop + 1]
            and re.fullmatch(r"[0-9]{3}", tokens.text(stop + 1))
        ):
            stop += 2
        if (
            stop == at
            or tokens.kinds[at - 1] != number
            or not re.fullmatch("[0-9]{1,3}", tokens.text(at - 1))
        ):
            return False
        start, end = tokens.starts[at - 1], tokens.ends[stop - 1]
        text = tokens.source.text[start:end]
        plain = text.replace(",", "")
        help = "digits are not grouped, and decimals stand behind a point"
        fix = plain if text.count(",") > 1 else None  # one comma may be the decimal one
        self.report.add("E0116", f"`{text}` is not a number", start, end, help=help, fix=fix)
        tokens.reported.add(start)
        tokens.ends[at - 1] = end
        tokens.replace(at, stop - at, [])
        return True
