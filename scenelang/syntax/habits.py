"""What people write out of habit, from other languages or other ways of laying out, told in its own words."""

from __future__ import annotations

import re

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import Span
from scenelang.syntax import mistakes
from scenelang.syntax.automaton import fits, reach
from scenelang.syntax.lexer import UNIT_ALIASES, UNITS
from scenelang.syntax.spelling import FOREIGN_HEADS, word_for
from scenelang.syntax.tables import END, tables
from scenelang.syntax.tokens import Report, Tokens

_IMPORT = re.compile(
    r"""(?P<word>use|include|require)[ \t]*
        (?:<(?P<angled>[^<>"'\n]+)>|"(?P<quoted>[^"\\\n]+)")[ \t]*(?:;|(?=//)|$)""",
    re.VERBOSE,
)


class Habits:
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
        """`for` and `if` without parentheses or braces."""
        if self._is(at - 1, "for", "if") and not self._is(at, "("):
            brace = self._next_brace(at)
            if brace is None or not self._wrapped_fits(states, at, brace):
                return False
            mistakes.report_parentheses(self.tokens, self.report, at, brace)
            self._insert(brace, ")")
            self._insert(at, "(")
            return True
        if self._is(at - 1, "import") and self._bare_path(at):
            return True
        if at == first + 1 and self._bare_argument(states, at):
            return True
        if at == first + 2 and self._is(first, "fn", "module") and self._bare_parameters(states, at):
            return True
        wants_block = fits(states, self.literals["{"]) and not fits(states, self.literals[";"])
        if not wants_block or not self._is(at - 1, ")", "else"):
            return False
        if not self._is(first, "for", "if", "module") or self._is(at, ";", "}", ")") or self._at_end(at):
            return False
        stop = self._end_of_statement(at)
        few = [self.literals["{"], *self.tokens.kinds[at : min(stop, at + 4)]]
        if reach(states.copy(), few, 0, len(few)) < len(few):
            return False
        bare = [(at, stop)]
        if self._is(stop, "else") and not self._is(stop + 1, "{", "if"):
            bare.append((stop + 1, self._end_of_statement(stop + 1)))
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
        fix = Fix("put quotes around it", (Edit(span, f'"{span.text}"'),))
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
        fix: Fix | None = Fix(f"write `{written}`", (Edit(Span(tokens.source, start, end), written),))
        fix = fix if path.endswith(".nsg") else None  # the file has to be written anew
        help = f"write {written} and use what it defines as {alias}.…"
        self.report.add("E0126", message, start, end, help=help, fix=fix)
        stop = first
        while not self._at_end(stop) and tokens.starts[stop] < end:
            tokens.reported.add(tokens.starts[stop])
            stop += 1
        tokens.replace(first, stop - first, [tables().kind("BAD_STATEMENT")])
        tokens.starts[first], tokens.ends[first] = start, end
        return True

    def _bare_parameters(self, states: list[int], at: int) -> bool:
        """`fn half x = x / 2;`: parameters without parentheses."""
        ends = "=" if self._is(at - 2, "fn") else "{"
        stop = at
        while stop < at + 40 and self.tokens.kinds[stop] in (tables().kind("NAME"), self.literals[","]):
            stop += 1
        if stop == at or not self._is(stop, ends) or not self._wrapped_fits(states, at, stop):
            return False
        mistakes.report_parentheses(self.tokens, self.report, at, stop)
        self._insert(stop, ")")
        self._insert(at, "(")
        return True

    def _bare_argument(self, states: list[int], at: int) -> bool:
        """`color #d33;`: a literal behind a name without parentheses."""
        kind = tables().kind
        if self.tokens.kinds[at - 1] != kind("NAME"):
            return False
        if self.tokens.kinds[at] not in (kind("NUMBER"), kind("COLOR"), self.literals["["]):
            return False
        for stop in range(at + 1, min(at + 40, len(self.tokens.kinds) - 1)):
            if self._is(stop, ";"):
                if not self._wrapped_fits(states, at, stop):
                    return False
                mistakes.report_parentheses(self.tokens, self.report, at, stop)
                self._insert(stop, ")")
                self._insert(at, "(")
                return True
        return False

    def _wrapped_fits(self, states: list[int], at: int, stop: int) -> bool:
        """Whether the tokens ``[at, stop)`` are what belongs between parentheses there."""
        kinds = self.tokens.kinds
        # Words that stand for operators elsewhere are mended, and reported, when their turn comes.
        signs = [(kinds[i], word_for(self.tokens.text(i))) for i in range(at, stop)]
        meant = [self.literals[sign] if sign else kind for kind, sign in signs]
        wrapped = [self.literals["("], *meant, self.literals[")"], kinds[stop]]
        return reach(states.copy(), wrapped, 0, len(wrapped)) == len(wrapped)

    def _next_brace(self, at: int) -> int | None:
        """Index of the `{` that follows in this statement, None where a `)` or `;` comes first."""
        depth = 0
        for index in range(at, len(self.tokens.kinds) - 1):
            if self._is(index, "{"):
                return index if depth == 0 else None
            if self._is(index, ";", "}"):
                return None
            depth += self._is(index, "(", "[") - self._is(index, ")", "]")
            if depth < 0:
                return None
        return None

    def _end_of_statement(self, at: int) -> int:
        """Index after the statement that begins at a token: after its `;` or its block."""
        depth = 0
        for index in range(at, len(self.tokens.kinds) - 1):
            if self._is(index, "}"):
                if depth == 0:
                    return index
                depth -= 1
                if depth == 0:
                    return index + 1
            elif self._is(index, "{"):
                depth += 1
            elif depth == 0 and self._is(index, ";"):
                return index + 1
        return len(self.tokens.kinds) - 1

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
        fix = Fix(
            f"write `{unit}` right after the number",
            (Edit(Span(tokens.source, tokens.ends[at - 1], end), unit),),
        )
        self.report.add(
            "E0117",
            "space between a number and its unit",
            start,
            end,
            help="units are glued to their number",
            fix=fix,
        )
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
        for index in reversed(range(at, stop)):
            self._insert(index, ",")
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
        fix = Fix(f"write `{plain}`", (Edit(Span(tokens.source, start, end), plain),))
        self.report.add(
            "E0116", f"`{text}` is not a number", start, end, help="digits are not grouped", fix=fix
        )
        tokens.reported.add(start)
        tokens.ends[at - 1] = end
        tokens.replace(at, stop - at, [])
        return True

    def _loop_of_c(self, first: int) -> bool:
        """`for (i = 0; i < 3; i++) { … }`."""
        tokens = self.tokens
        name = first + 2
        if not (self._is(first, "for") and self._is(first + 1, "(")):
            return False
        if self._is(first + 2, "let") or tokens.text(first + 2) in FOREIGN_HEADS:
            name += 1
        if not self._is(name + 1, "="):
            return False
        brace = next((i for i in range(name, min(name + 40, len(tokens.kinds))) if self._is(i, "{")), None)
        if brace is None or not any(self._is(i, ";") for i in range(name, brace)):
            return False
        start, end = tokens.ends[first + 1], tokens.end_before(brace)
        variable = tokens.text(name)
        help = f"write for ({variable} in 0..<n) {{ … }}"
        self.report.add("E0126", "`for` takes a range or a vector", start, end, help=help)
        tokens.replace(name + 1, brace - name - 1, [])
        for word in (")", "BAD_EXPRESSION", "in"):
            self._insert(name + 1, word)
        if name > first + 2:
            tokens.replace(first + 2, 1, [])
        return True
