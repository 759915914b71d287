"""At a mistake: say what it is, mend the tokens, go on.

Well known mistakes are told apart first; then the best small repair is looked for (`syntax.repairs`); where
none helps, the statement is skipped. Braces are balanced before parsing, so a skip stays inside its block.
"""

from __future__ import annotations

from bisect import bisect_left
from typing import Any

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import did_you_mean, nearest
from scenelang.syntax import mistakes, nodes
from scenelang.syntax.automaton import fits, reach, statement_depth
from scenelang.syntax.lexer import UNIT_ALIASES, UNITS
from scenelang.syntax.repairs import FOLLOWED, MAX_REPLAY, Search, keywords_near
from scenelang.syntax.tables import END, tables
from scenelang.syntax.tokens import MAX_MISTAKES, Report, Tokens

_WORDS = (
    *("nsg", "model", "param", "let", "fn", "module", "import", "for", "if", "material"),
    *("group", "chain", "union", "smooth", "subtract", "intersect"),
)
_HEADS = ("let", "fn", "module", "param", "import", "for", "if", "group", "chain", "material", "union")


class Recovery:
    """Recovery for one file.

    Args:
        tokens: the tokens; they are edited.
        report: takes the mistakes.
    """

    def __init__(self, tokens: Tokens, report: Report) -> None:
        self.tokens = tokens
        self.report = report
        self.repairs = 0
        self.literals = tables().literals
        self.heads = {self.literals[word] for word in _HEADS}

    def resume(self, states: list[int], values: list[Any], at: int) -> int | None:
        """Mend what does not fit at a token.

        Args:
            states, values: the parser's stacks; cut back where the statement is read again.
            at: index of the token.

        Returns:
            The index to go on at, or None where there are too many mistakes.
        """
        self.repairs += 1
        if self.report.full or self.repairs > 4 * MAX_MISTAKES:
            return None
        depth = statement_depth(states)
        start = self._misspelt_if(states, values, at) if self._is(at, "else") else None
        if start is not None:
            return start
        first = self._index(values[depth]) if depth < len(values) else at
        known = self._head_mistake(states, first, at) if first < at else self._start_mistake(states, at)
        if self._misspelt(states[: depth + 1], first, at):
            del states[depth + 1 :], values[depth:]
            return first
        if known or self._spaced_unit(at) or self._unseparated(states, at):
            return at
        search = Search(self.tokens, first, at)
        repair = search.run(states[: depth + 1], states)
        if repair is None:
            del states[depth + 1 :], values[depth:]
            return self._skip(first, at)
        mistakes.report_repair(self.tokens, self.report, repair, search.open_brackets(repair.at))
        self.tokens.replace(repair.at, repair.delete, repair.insert)
        if at - first > MAX_REPLAY:
            return at
        del states[depth + 1 :], values[depth:]
        return first

    def _index(self, value: Any) -> int:
        """Index of the first token of something on the value stack."""
        if isinstance(value, int):
            return value
        span: Span = value[1] if isinstance(value, tuple) else value.span
        return bisect_left(self.tokens.starts, span.start)

    def _is(self, index: int, *texts: str) -> bool:
        return any(self.tokens.kinds[index] == self.literals[text] for text in texts)

    def _insert(self, index: int, name: str) -> None:
        self.tokens.replace(index, 0, [tables().kind(name)])

    # ------------------------------------------------------------ well known mistakes

    def _start_mistake(self, states: list[int], at: int) -> bool:
        """A token that no statement begins with."""
        tokens = self.tokens
        start, end = tokens.starts[at], tokens.ends[at]
        if self._is(at, ";", "{") and self._better_swapped(states, at):
            return False
        if self._is(at, ";"):
            fix = Fix("remove it", (Edit(Span(tokens.source, start, end), ""),))
            self.report.add("W0101", "stray `;`", start, end, help="no `;` follows a block", fix=fix)
            tokens.replace(at, 1, [])
            return True
        if self._is(at, "{"):
            self._headless(at)
            self._insert(at, "BAD_HEAD")
            return True
        if self._is(at, "else"):
            self.report.add("E0101", "`else` without `if`", start, end)
            tokens.replace(at, 1, [] if self._is(at + 1, "if") else [tables().kind("BAD_HEAD")])
            if not self._is(at, "if") and not self._is(at + 1, "{"):
                tokens.replace(at, 1, [])
            return True
        return False

    def _better_swapped(self, states: list[int], at: int) -> bool:
        """Whether more fits when a `;` or `{` changes places with the next token than otherwise."""
        kinds = self.tokens.kinds
        rest = kinds[at + 2 : at + 2 + FOLLOWED]
        instead = [tables().kind("BAD_HEAD"), kinds[at]] if self._is(at, "{") else []
        swapped = reach(states.copy(), [kinds[at + 1], kinds[at], *rest], 0, len(rest) + 2)
        kept = reach(states.copy(), [*instead, kinds[at + 1], *rest], 0, len(rest) + 1 + len(instead))
        return swapped - 2 > kept - 1 - len(instead)

    def _headless(self, at: int) -> None:
        tokens = self.tokens
        before = at - 1
        if at and self._is(before, ";") and not tokens.on_new_line(at):
            start, end = tokens.starts[before], tokens.ends[before]
            fix = Fix("remove it", (Edit(Span(tokens.source, start, end), ""),))
            self.report.add("E0130", "`;` between a statement and its block", start, end, fix=fix)
            return
        help = "a block belongs to a geometry, a module, `group`, `material`, `for`, `if` or a boolean word"
        self.report.add("E0129", "block without a head", tokens.starts[at], tokens.ends[at], help=help)

    def _misspelt(self, stack: list[int], first: int, at: int) -> bool:
        """A keyword with a slip at the head of a statement, which reads on once it is mended."""
        tokens = self.tokens
        if first >= at or at - first > MAX_REPLAY or tables().kinds[tokens.kinds[first]] != "NAME":
            return False
        start, end = tokens.starts[first], tokens.ends[first]
        text = tokens.source.text[start:end]
        rest = tokens.kinds[first + 1 : at + FOLLOWED]
        read = {
            word: reach(stack.copy(), [self.literals[word], *rest], 0, len(rest) + 1)
            for word in _WORDS
            if nearest(text, (word,)) is not None
        }
        word = max(read, key=read.__getitem__, default=None)
        if word is None or read[word] <= at + 1 - first:
            return False
        help, fix = did_you_mean(text, (word,), Span(tokens.source, start, end))
        self.report.add("E0132", f"unknown statement `{text}`", start, end, help=help, fix=fix)
        tokens.kinds[first] = self.literals[word]
        return True

    def _misspelt_if(self, states: list[int], values: list[Any], at: int) -> int | None:
        """`fi (a) { … } else { … }`: where `if` was meant, for parsing to go on from there."""
        kinds, tokens = self.tokens.kinds, self.tokens
        block = self._opening_of(at - 1, "{", "}")
        bracket = self._opening_of(block - 1, "(", ")") if block else 0
        first = bracket - 1
        if (
            first < 0
            or kinds[first] != tables().kind("NAME")
            or "if" not in keywords_near(tokens.text(first))
        ):
            return None
        starts = [i for i, value in enumerate(values) if isinstance(value, nodes.Name | nodes.NameRef)]
        depth = next((i for i in reversed(starts) if values[i].span.start == tokens.starts[first]), None)
        if depth is None:
            return None
        mistakes.report_misspelt(tokens, self.report, first, "if")
        kinds[first] = self.literals["if"]
        del states[depth + 1 :], values[depth:]
        return first

    def _opening_of(self, at: int, opening: str, closing: str) -> int:
        """Index of the bracket that the one at an index closes; 0 where there is none."""
        depth = 0
        for index in range(at, max(0, at - 4 * MAX_REPLAY), -1):
            depth += self._is(index, closing) - self._is(index, opening)
            if depth == 0:
                return index if self._is(index, opening) else 0
        return 0

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
        wrapped = [self.literals["("], *kinds[at:stop], self.literals[")"], kinds[stop]]
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

    # ------------------------------------------------------------ skipping

    def _skip(self, first: int, at: int) -> int | None:
        """Give the statement up: one `BadStmt` up to its `;`, its block, or the end of the block around."""
        tokens = self.tokens
        mistakes.report_unexpected(tokens, self.report, at)
        stop = at
        while not self._at_end(stop) and not self._is(stop, "}", "{"):
            if self._is(stop, ";"):
                stop += 1
                break
            if stop > at and tokens.kinds[stop] in self.heads and tokens.on_new_line(stop):
                break
            stop += 1
        if stop == first:
            return None
        start, end = tokens.starts[first], tokens.ends[stop - 1]
        headed = self._is(stop, "{") and not self._is(stop - 1, ";")
        tokens.replace(first, stop - first, [tables().kind("BAD_HEAD" if headed else "BAD_STATEMENT")])
        tokens.starts[first], tokens.ends[first] = start, end
        return first
