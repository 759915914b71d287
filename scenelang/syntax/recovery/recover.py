"""At a mistake: say what it is, mend the tokens, go on.

Well known mistakes are told apart first; then the best small repair is looked for (`repairs`); where
none helps, the statement is skipped. Braces are balanced before parsing, so a skip stays inside its block.
"""

from __future__ import annotations

from bisect import bisect_left
from typing import Any

from scenelang.diagnostics.span import Span
from scenelang.syntax import nodes
from scenelang.syntax.automaton import advance, reach, statement_depth
from scenelang.syntax.lexer import MAX_MISTAKES, Report, Tokens
from scenelang.syntax.recovery import mistakes
from scenelang.syntax.recovery.foreign import HEADS, keywords_near
from scenelang.syntax.recovery.habits import Habits
from scenelang.syntax.recovery.patterns import closing
from scenelang.syntax.recovery.repairs import FOLLOWED, MAX_REPLAY, THOROUGH, WINDOW, Repair, Search
from scenelang.syntax.tables import tables
from scenelang.words import DECLARING, NODES

_WORDS = (*(word for word in DECLARING if word != "as"), "for", "if", "material", *NODES)
_INSIDE = 65  # tokens over which another place for a closing bracket is looked for
_STARTS = ("let", "fn", "module", "param", "import", "for", "if", "group", "chain", "material", "union")


class Recovery(Habits):
    """Recovery for one file, whose tokens it edits."""

    def __init__(self, tokens: Tokens, report: Report) -> None:
        super().__init__(tokens, report)
        self.repairs = 0
        self.heads = {self.literals[word] for word in _STARTS}

    def resume(self, states: list[int], values: list[Any], at: int) -> int | None:
        """Mend what does not fit at a token; the parser's stacks are cut back to read a statement again.

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
        if (first < at or self._is(at, "<")) and (
            self._grouped_digits(at)
            or self._import_of_others(first)
            or (at - first <= MAX_REPLAY and self._foreign(states[: depth + 1], first, at))
        ):
            del states[depth + 1 :], values[depth:]
            return first
        known = self._head_mistake(states, first, at) if first < at else self._start_mistake(states, at)
        if self._misspelt(states[: depth + 1], first, at):
            del states[depth + 1 :], values[depth:]
            return first
        if known or self._spaced_unit(at) or self._unseparated(states, at):
            return at
        search = Search(self.tokens, first, at)
        window = WINDOW if len(self.report.found) < THOROUGH else 0
        repair = search.run(states[: depth + 1], states, window)
        if repair is None:
            del states[depth + 1 :], values[depth:]
            return self._skip(first, at)
        sure = self._stands_there(states[: depth + 1], search, repair)
        mistakes.report_repair(self.tokens, self.report, repair, search.open_brackets(repair.at), sure)
        self.tokens.replace(repair.at, repair.delete, repair.insert)
        if at - first > MAX_REPLAY:
            return at
        del states[depth + 1 :], values[depth:]
        return first

    def _stands_there(self, stack: list[int], search: Search, repair: Repair) -> bool:
        """Whether a bracket that a repair closes can be closed nowhere else in the statement.

        ``sin(x * 2;`` may have been meant as ``sin(x) * 2`` and as ``sin(x * 2)``.
        """
        if repair.delete or repair.insert[0] not in search.closings:
            return True
        kinds, opening = self.tokens.kinds, search.open_brackets(repair.at)[0]
        if repair.at - search.first > MAX_REPLAY or repair.at - opening > _INSIDE:
            return False
        reach(stack, kinds, search.first, opening + 1)
        after = [*repair.insert[1:], *kinds[repair.at : search.bound]]
        for at in range(opening + 1, repair.at):
            moved = [repair.insert[0], *kinds[at : repair.at], *after]
            if kinds[at] != repair.insert[0] and reach(stack.copy(), moved, 0, len(moved)) == len(moved):
                return False
            advance(stack, kinds[at])
        return True

    def _index(self, value: Any) -> int:
        """Index of the first token of something on the value stack."""
        if isinstance(value, int):
            return value
        span: Span = value[1] if isinstance(value, tuple) else value.span
        return bisect_left(self.tokens.starts, span.start)

    # ------------------------------------------------------------ well known mistakes

    def _start_mistake(self, states: list[int], at: int) -> bool:
        """A token that no statement begins with."""
        tokens = self.tokens
        if self._is(at, ";", "{") and self._better_swapped(states, at):
            return False
        if self._is(at, ";"):
            self.report.add("W0101", "stray `;`", *tokens.place(at), help="no `;` follows a block", fix="")
            tokens.replace(at, 1, [])
        elif self._is(at, "{"):
            self._headless(at)
            self._insert(at, "BAD_HEAD")
        elif self._is(at, "else"):
            self.report.add("E0101", "`else` without `if`", *tokens.place(at))
            headed = self._is(at + 1, "{")
            tokens.replace(at, 1, [tables().kind("BAD_HEAD")] if headed else [])
        else:
            return False
        return True

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
            fix = None if mistakes.head(tokens, before) in mistakes.DEFINITIONS else ""  # it needs its `;`
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
        words = {HEADS[text]} if text in HEADS else set(keywords_near(text)).intersection(_WORDS)
        trials = {word: [self.literals[word], *rest] for word in sorted(words)}
        read = {word: reach(stack.copy(), trial, 0, len(trial)) for word, trial in trials.items()}
        word = max(read, key=read.__getitem__, default=None)
        if word is None or read[word] <= at + 1 - first:
            return False
        fix = None if text == "int" else word  # whose quotients are whole
        help = f"it is `{word}` here" if text in HEADS else f"did you mean `{word}`?"
        self.report.add("E0132", f"unknown statement `{text}`", start, end, help=help, fix=fix)
        tokens.kinds[first] = self.literals[word]
        return True

    def _misspelt_if(self, states: list[int], values: list[Any], at: int) -> int | None:
        """`fi (a) { … } else { … }`: where `if` was meant, for parsing to go on from there."""
        tokens = self.tokens
        for depth in reversed(range(len(values))):
            if isinstance(values[depth], nodes.Name | nodes.NameRef):
                first = self._index(values[depth])
                block = closing(tokens, first + 1)
                headed = closing(tokens, block, "{}") == at > block > first + 1
                if headed and "if" in keywords_near(tokens.text(first)):
                    mistakes.report_misspelt(tokens, self.report, first, "if")
                    tokens.kinds[first] = self.literals["if"]
                    del states[depth + 1 :], values[depth:]
                    return first
        return None

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
        bad = "BAD_HEAD" if self._is(stop, "{") and not self._is(stop - 1, ";") else "BAD_STATEMENT"
        tokens.give_up(first, stop, bad, *tokens.place(first, stop))
        return first
