"""Matching braces before parsing, so that every block is closed and a mistake stays inside one.

Where braces do not match, the layout tells on which line the slip is (`syntax.layout`), and trying the
parser out on that line tells which brace is missing or too many. A text whose braces match is left alone,
however it is laid out.
"""

from __future__ import annotations

from scenelang.diagnostics.diagnostic import Edit, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.syntax.automaton import advance, reach
from scenelang.syntax.layout import Slip, find_slips
from scenelang.syntax.tables import tables
from scenelang.syntax.tokens import Report, Tokens

_BEHIND = 4  # so many tokens after the line have to fit as well
_LONGEST = 80  # so many places before the first misfit are tried


def balance(tokens: Tokens, report: Report) -> None:
    """Report braces that do not match and mend the token list."""
    mender = _Mender(tokens, report)
    for slip in reversed(find_slips(tokens)):  # from the last on, so that indices hold
        mender.mend(slip)
    mender.match_the_rest()


class _Mender:
    """Reports and mends the braces of one file."""

    def __init__(self, tokens: Tokens, report: Report) -> None:
        self.tokens = tokens
        self.report = report
        literals = tables().literals
        self.opening, self.closing = literals["{"], literals["}"]
        self.otherwise = literals["else"]
        name = tables().kind("NAME")
        self.in_block = self._deep([name, self.opening])
        self.in_if = self._deep([literals["if"], literals["("], name, literals[")"], self.opening])

    def _deep(self, head: list[int]) -> list[int]:
        """The states deep inside blocks with a head: all that a line can close fits there."""
        stack = [tables().start]
        for kind in head * 40:
            advance(stack, kind)
        return stack

    def mend(self, slip: Slip) -> None:
        """Mend one line, brace by brace."""
        stop = slip.stop
        for _ in range(abs(slip.shift)):
            at, insert = self._best(slip.first, stop, slip.shift > 0)
            if at < stop:
                stop += 1 if insert else -1
            if insert:
                self._insert(at, self.opening if slip.shift > 0 else self.closing)
            else:
                self._delete(at)

    def _best(self, first: int, stop: int, opens: bool) -> tuple[int, bool]:
        """Where to mend the tokens ``[first, stop)``, and whether to insert a brace there.

        Args:
            opens: the line lacks a `{` or has a `}` too many; otherwise the other way about.
        """
        kinds = self.tokens.kinds
        # The layout cannot tell a brace at the end of a line from one at the start of the next.
        limit = stop
        while kinds[limit] in (self.opening, self.closing):
            limit += 1
        end = min(limit + _BEHIND, len(kinds) - 1)
        surplus, missing = (self.closing, self.opening) if opens else (self.opening, self.closing)
        goes_on = kinds[first] == self.closing and kinds[first + 1] == self.otherwise
        stack = (self.in_if if goes_on else self.in_block).copy()
        misfit = reach(stack.copy(), kinds, first, end)
        # Nothing to go by: a `}` belongs to the end of the line, a surplus one is the last.
        best = (-1, 0.0, stop, True)  # reach, preference, place, whether to insert
        from_ = max(first, misfit - _LONGEST)
        for at in range(first, min(misfit, limit) + 1):
            if at >= from_:
                if kinds[at] == surplus and at < limit:
                    got = reach(stack.copy(), kinds, at + 1, end)
                    best = max(best, (got, 0.5 if opens else 0.2, at, False))
                trial = stack.copy()
                if at <= stop and advance(trial, missing):
                    got = reach(trial, kinds, at, end)
                    best = max(best, (got, 0.3, at, True))
            if not advance(stack, kinds[at]):
                break
        return best[2], best[3]

    # ------------------------------------------------------------ mending

    def _insert(self, at: int, kind: int) -> None:
        tokens = self.tokens
        end = tokens.end_before(at)
        if kind == self.opening:
            fix = Fix("insert `{`", (Edit(Span(tokens.source, end, end), " {"),))
            self.report.add("E0106", "missing `{`", end, end, fix=fix)
        elif not tokens.cut:
            labels = [Label(self._span(index), "this block is not closed") for index in self._open(at)[-1:]]
            self.report.add("E0104", "missing `}`", end, end, labels=labels)
        tokens.replace(at, 0, [kind])

    def _delete(self, at: int) -> None:
        self._report_unmatched(at)
        self.tokens.replace(at, 1, [])

    def _report_unmatched(self, at: int) -> None:
        span = self._span(at)
        self.report.add("E0105", f"unmatched `{span.text}`", span.start, span.end)

    def match_the_rest(self) -> None:
        """Drop what still closes nothing and close what is still open."""
        tokens = self.tokens
        depth = 0
        stray = []
        for at, kind in enumerate(tokens.kinds):
            if kind == self.opening:
                depth += 1
            elif kind == self.closing and depth:
                depth -= 1
            elif kind == self.closing:
                stray.append(at)
        for at in stray:
            self._report_unmatched(at)
        tokens.drop(stray)
        if not depth:
            return
        last = len(tokens.kinds) - 1
        end = tokens.end_before(last)
        if not tokens.cut:
            count = f" {depth} times" if depth > 1 else ""
            labels = [Label(self._span(index), "this block is not closed") for index in self._open(last)[-3:]]
            self.report.add("E0104", f"missing `}}`{count}", end, end, labels=labels)
        tokens.replace(last, 0, [self.closing] * depth)

    def _open(self, at: int) -> list[int]:
        """Indices of the braces open before a token."""
        open_: list[int] = []
        for index in range(at):
            kind = self.tokens.kinds[index]
            if kind == self.opening:
                open_.append(index)
            elif kind == self.closing and open_:
                open_.pop()
        return open_

    def _span(self, index: int) -> Span:
        return Span(self.tokens.source, self.tokens.starts[index], self.tokens.ends[index])
