"""Matching braces before parsing, so that every block is closed and a mistake stays inside one.

Where braces do not match, the layout tells on which line the slip is (`layout`), and trying the
parser out on that line tells which brace is missing or too many. A text whose braces match is left alone,
however it is laid out.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from scenelang.diagnostics.diagnostic import Label
from scenelang.diagnostics.span import Span
from scenelang.syntax.automaton import advance, completion, fits, reach
from scenelang.syntax.lexer import Report, Tokens
from scenelang.syntax.recovery.layout import Slip, find_slips
from scenelang.syntax.recovery.mistakes import report_broken_off, report_instead
from scenelang.syntax.recovery.repairs import Kinds, Repair
from scenelang.syntax.tables import tables

_BEHIND = 4  # so many tokens after the line have to fit as well
_LONGEST = 80  # so many places before the first misfit are tried


def balance(tokens: Tokens, report: Report) -> None:
    """Report braces that do not match and mend the token list."""
    mender = _Mender(tokens, report)
    if tokens.cut:
        mender.match_the_rest()  # an open comment has swallowed the rest of the layout
        return
    mender.mend_plain()
    for slip in reversed(find_slips(tokens)):  # from the last on, so that indices hold
        if report.full:
            break
        mender.mend(slip)
    mender.match_the_rest()


@cache
def _instead() -> tuple[int, ...]:
    """What a brace may be written for, likely ones first."""
    names = ("(", ")", "[", "]", ";", ",", "=", "BAD_EXPRESSION", "NAME", "*", ".", "..", ":", "in", "as")
    return tuple(map(tables().kind, names))


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
        self.behind_if = self.in_if.copy()
        advance(self.behind_if, self.closing)

    def _deep(self, head: list[int]) -> list[int]:
        """The states deep inside blocks with a head: all that a line can close fits there."""
        stack = [tables().start]
        for kind in head * 40:
            advance(stack, kind)
        return stack

    def mend_plain(self) -> None:
        """Mend a brace that cannot stand where it does, if that is all that is wrong around it."""
        kinds = self.tokens.kinds
        start = [tables().start]
        at = reach(start.copy(), kinds, 0, len(kinds))
        if at == len(kinds) or kinds[at] not in (self.opening, self.closing):
            return
        more = kinds.count(self.opening) - kinds.count(self.closing)
        depth = kinds[:at].count(self.opening) - kinds[:at].count(self.closing)
        ended = kinds[at - 1] in (tables().literals[";"], self.opening, self.closing)
        if more <= 0 if kinds[at] == self.opening else more >= 0 or (depth == 0 and ended):
            return
        reach(start, kinds, 0, at)
        end = min(at + 2 * _BEHIND, len(kinds))
        for mend in (Repair(at, 1, ()), *(Repair(at, 1, (other,)) for other in _instead())):
            trial = start.copy()
            if all(advance(trial, kind) for kind in mend.insert) and reach(trial, kinds, at + 1, end) == end:
                self._apply(mend)
                return

    def mend(self, slip: Slip) -> None:
        """Mend one line: by one change where that does, else brace by brace."""
        count = abs(slip.shift)
        if count > 1:
            mend, fits = self._best(slip, slip.stop, count)
            if fits:
                self._apply(mend)
                return
        stop = slip.stop
        for _ in range(count):
            mend, _ = self._best(slip, stop, 1)
            if mend.at < stop:
                stop += len(mend.insert) - mend.delete
            self._apply(mend)

    def _best(self, slip: Slip, stop: int, count: int) -> tuple[Repair, bool]:
        """How to mend ``count`` braces of a line, up to the token ``stop``, and whether all fits then."""
        kinds, first, opens = self.tokens.kinds, slip.first, slip.shift > 0
        # The layout cannot tell a brace at the end of a line from one at the start of the next.
        limit = stop
        while kinds[limit] in (self.opening, self.closing):
            limit += 1
        end = min(limit + _BEHIND, len(kinds) - 1)
        missing = self.opening if opens else self.closing
        wanted, at_end = (missing,) * count, Repair(stop, 0, (missing,))
        goes_on = kinds[first] == self.closing and kinds[first + 1] == self.otherwise
        stack = (self.in_if if goes_on else self.in_block).copy()
        if kinds[first] == self.otherwise:
            stack = self.behind_if.copy()
        misfit = reach(stack.copy(), kinds, first, end)
        places = range(max(first, min(misfit, limit) - _LONGEST), min(misfit, limit) + 1)
        depth = slip.depth + (kinds[first] == self.closing)
        for at in range(first, places.start):
            depth += (kinds[at] == self.opening) - (kinds[at] == self.closing)
            advance(stack, kinds[at])
        found = []  # how far all fits then, and what to do
        for at in places:
            for mend in self._mends(stack, at, stop, limit, wanted):
                if mend.insert.count(self.closing) > depth:
                    continue  # it would close more than is open
                trial = stack.copy()
                if all(advance(trial, kind) for kind in mend.insert):
                    got = reach(trial, kinds, at + mend.delete, end)
                    if got == end == len(kinds) - 1 and not fits(trial, self.closing):
                        got -= 1  # the text would end in the middle of a statement
                    found.append((got, mend))
            depth += (kinds[at] == self.opening) - (kinds[at] == self.closing)
            if not advance(stack, kinds[at]):
                break
        got, mend = max(found, key=lambda one: (one[0], -one[1].cost, one[1].at), default=(-1, at_end))
        return mend, got == end

    def _mends(self, stack: list[int], at: int, stop: int, limit: int, wanted: Kinds) -> Iterator[Repair]:
        """What may be done at one place about missing braces, each the cheaper the likelier it is."""
        kind, missing = self.tokens.kinds[at], wanted[0]
        surplus = self.closing if missing == self.opening else self.opening
        if at <= stop:
            yield Repair(at, 0, wanted, -0.3)
        if at == stop:
            yield from self._broken_off(stack, at, wanted)
        if at >= limit:
            return
        if kind == surplus:
            if len(wanted) == 1:
                yield Repair(at, 1, (), -0.5 if missing == self.opening else -0.2)
                for rank, other in enumerate(_instead()):
                    yield Repair(at, 1, (other,), 0.001 * rank - 0.1)
            else:
                yield Repair(at, 1, wanted[1:], -0.4)
        elif kind != missing:
            yield Repair(at, 1, wanted, -0.1)

    def _broken_off(self, stack: list[int], at: int, wanted: Kinds) -> Iterator[Repair]:
        """The line breaks off before a token: what its statement lacks, and the braces after that."""
        semicolon = tables().literals[";"]
        if fits(stack, self.closing):  # nothing is unfinished inside the block
            if wanted[0] == self.closing:
                yield Repair(at, 0, (*wanted, semicolon), -0.25)
            return
        opens = wanted[0] == self.opening
        missing = completion(stack, self.opening if opens else semicolon)
        if missing is None or (opens and (not missing or len(wanted) > 1)):
            return
        missing += () if opens else (semicolon,)
        insert = (*missing, *wanted)
        trial = stack.copy()
        if all(advance(trial, kind) for kind in insert) and not fits(trial, self.tokens.kinds[at]):
            insert += (*(completion(trial, semicolon) or ()), semicolon)
        yield Repair(at, 0, insert, -0.6)

    # ------------------------------------------------------------ mending

    def _apply(self, mend: Repair) -> None:
        tokens, at = self.tokens, mend.at
        names = [tables().kinds[kind] for kind in mend.insert]
        end = tokens.end_before(at)
        if mend.delete and names:
            report_instead(tokens, self.report, at, names)
        elif mend.delete:
            self._report_unmatched(at)
        elif mend.insert == (self.opening,):
            self.report.add("E0106", "missing `{`", end, end, fix=" {")
        elif mend.insert[0] != self.closing:
            report_broken_off(tokens, self.report, at, names)
        elif not tokens.cut:
            self._report_unclosed(at, names.count("}"), names[-1] == ";")
        tokens.replace(at, mend.delete, mend.insert)

    def _report_unclosed(self, at: int, count: int, ends: bool = False) -> None:
        end = self.tokens.end_before(at)
        places = [Span(self.tokens.source, *self.tokens.place(index)) for index in self._unmatched(at)[0]]
        labels = [Label(place, "this block is not closed") for place in places[-count:][-3:]]
        times = f" {count} times" if count > 1 else ""
        brace = "`};`" if ends else "`}`"
        self.report.add("E0104", f"missing {brace}{times}", end, end, labels=labels)

    def _report_unmatched(self, at: int) -> None:
        self.report.add("E0105", f"unmatched `{self.tokens.text(at)}`", *self.tokens.place(at))

    def match_the_rest(self) -> None:
        """Drop what still closes nothing and close what is still open."""
        tokens = self.tokens
        open_, stray = self._unmatched(len(tokens.kinds))
        for at in stray:
            self._report_unmatched(at)
        tokens.drop(stray)
        last = len(tokens.kinds) - 1
        if open_ and not tokens.cut:
            self._report_unclosed(last, len(open_))
        tokens.replace(last, 0, [self.closing] * len(open_))

    def _unmatched(self, stop: int) -> tuple[list[int], list[int]]:
        """Indices of the braces before a token that are open there, and of those that close nothing."""
        open_: list[int] = []
        stray: list[int] = []
        for index, kind in enumerate(self.tokens.kinds[:stop]):
            if kind == self.opening:
                open_.append(index)
            elif kind == self.closing:
                if open_:
                    open_.pop()
                else:
                    stray.append(index)
        return open_, stray
