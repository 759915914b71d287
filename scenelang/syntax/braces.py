"""Matching braces before parsing, so that every block is closed and a mistake stays inside one.

Where braces do not match, the layout tells on which line the slip is (`syntax.layout`), and trying the
parser out on that line tells which brace is missing or too many. A text whose braces match is left alone,
however it is laid out.
"""

from __future__ import annotations

from scenelang.diagnostics.diagnostic import Edit, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.syntax.automaton import advance, reach
from scenelang.syntax.layout import Slip, find_hidden_slips, find_slips
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


def balance_hidden(tokens: Tokens, report: Report) -> bool:
    """Mend braces that match by number only; False where nothing speaks for it.

    For texts that have other mistakes: the layout of a sound text is its author's business.
    """
    slips = find_hidden_slips(tokens)
    mender = _Mender(tokens, report)
    if not slips or not all(mender.is_plausible(slip) for slip in slips):
        return False
    for slip in reversed(slips):
        mender.mend(slip)
    mender.match_the_rest()
    return True


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
            at, insert, _ = self._best(slip.first, stop, slip.shift > 0)
            if at < stop:
                stop += 1 if insert else -1
            if insert:
                self._insert(at, self.opening if slip.shift > 0 else self.closing)
            else:
                self._delete(at)

    def is_plausible(self, slip: Slip) -> bool:
        """Whether a slip makes sense of its line, and does not just undo a block that stands flush left."""
        if slip.shift < 0:
            return self.tokens.kinds[slip.stop - 1] != self.opening
        return self._best(slip.first, slip.stop, True)[2]

    def _best(self, first: int, stop: int, opens: bool) -> tuple[int, bool, bool]:
        """Where to mend the tokens ``[first, stop)``, whether by inserting, and whether all fits then.

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
        places = range(max(first, min(misfit, limit) - _LONGEST), min(misfit, limit) + 1)
        for at in range(first, places.start):
            advance(stack, kinds[at])
        found = []  # how far all fits then, which way is likelier, where, whether by inserting
        for at in places:
            if kinds[at] == surplus and at < limit:
                got = reach(stack.copy(), kinds, at + 1, end)
                found.append((got, 0.5 if opens else 0.2, at, False))
            trial = stack.copy()
            if at <= stop and advance(trial, missing):
                found.append((reach(trial, kinds, at, end), 0.3, at, True))
            if not advance(stack, kinds[at]):
                break
        got, _, at, insert = max(found, default=(-1, 0.0, stop, True))
        if got <= misfit < end:  # another mistake is in the way: the end of the line is as good a guess
            last = [index for index in places if kinds[index] == surplus and index < limit][-1:]
            return (last[0], False, False) if opens and last else (stop, True, False)
        return at, insert, got == end

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
