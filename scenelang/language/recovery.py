"""Recovery: braces matched by indentation, and tokens mended where they do not fit.

Where braces do not match, the layout tells the line of the slip: one that stands no further in than the head
of an open block comes after its end. Trying the parser out on it tells which brace is missing or too many.

With braces that match, `habits` are looked up first. Then each way to insert, delete or replace a token near
the mistake is tried: it is worth how far the parser reads on, less what it costs. Where none helps, the
statement is skipped up to its end.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterator
from functools import cache
from math import inf
from typing import Any, Final

from scenelang.assets.records import Record
from scenelang.language.diagnostics import Label, Span
from scenelang.language.foreign import HEADS, OPERATORS, UNIT_NAMES
from scenelang.language.habits import MAX_REPLAY, head_word, keywords_near, mend_habit, quoted
from scenelang.language.lexer import (
    LOOKAHEAD,
    MAX_MISTAKES,
    Report,
    Tokens,
    advance,
    completion,
    fits,
    reach,
    statement_depth,
)
from scenelang.language.tables import END, rows, tables
from scenelang.language.words import TRANSFORMS, UNITS

_BEHIND: Final = 4  # so many tokens after the line have to fit as well
_LONGEST: Final = 80  # so many places before the first misfit are tried
_MOST: Final = 50  # slips of one text
_INSTEAD: Final = "( ) [ ] ; , = BAD_EXPRESSION NAME * . .. : in as"
"""Tokens that a brace may be written for, likely ones first."""


def balance(tokens: Tokens, report: Report) -> None:
    """Report braces that do not match and mend the token list."""
    if not tokens.cut:  # an open comment would have swallowed the rest of the layout
        for first, missing in reversed(_slips(tokens)):  # from the last on, so that indices hold
            _mend(tokens, report, first, missing)
    last = len(tokens.kinds) - 1
    stray = tokens.unmatched(last)[1]
    for at in stray:
        report.add("E0105", f"unmatched `{tokens.text(at)}`", *tokens.place(at))
    tokens.drop(stray)
    last -= len(stray)
    if (open_ := tokens.unmatched(last)[0]) and not tokens.cut:
        _report_unclosed(tokens, report, last, open_[-3:], len(open_))
    tokens.replace(last, 0, [tables().literals["}"]] * len(open_))


def _report_unclosed(tokens: Tokens, report: Report, at: int, open_: list[int], count: int = 1) -> None:
    end = tokens.end_before(at)
    labels = [Label(Span(tokens.source, *tokens.place(index)), "opened here") for index in open_]
    message = "missing `}`" + f" {count} times" * (count > 1)
    report.add("E0104", message, end, end, labels=labels)


def _slips(tokens: Tokens) -> list[tuple[int, int]]:
    """First tokens of lines whose braces do not go with the layout, each with the brace that it lacks."""
    kinds, starts, text = tokens.kinds, tokens.starts, tokens.source.text
    opening, closing = (tables().literals[sign] for sign in "{}")
    surplus = kinds.count(opening) - kinds.count(closing)
    last = len(kinds) - 1
    heads = [at for at in range(last) if tokens.on_new_line(at)]
    columns = [starts[at] - text.rfind("\n", 0, starts[at]) for at in heads]
    open_: list[tuple[int, int]] = []  # column and line of the heads of open blocks
    slips: list[tuple[int, int]] = []
    doubled: set[int] = set()  # lines that leave two blocks open, one of them too many
    at_column: dict[int, int] = {}  # the last line that begins at a column
    for line, first in enumerate(heads):
        stop = heads[line + 1] if line + 1 < len(heads) else last
        column, closes = columns[line], kinds[first] == closing
        while open_ and (open_[-1][0] > column or (open_[-1][0] == column and not closes)):
            head = open_.pop()[1]
            slips.append((heads[head if head in doubled else line - 1], closing))
        for at in range(first, stop):
            if kinds[at] == opening:
                inside = line + 1 == len(heads) or columns[line + 1] > column or at + 1 < stop
                open_.append((column if inside else 0, line))
            elif kinds[at] == closing:
                if open_ and (open_[-1][1] == line or (closes and open_[-1][0] in (0, column))):
                    open_.pop()
                    continue
                head = at_column.get(column, line) if at == first else line
                opened = head == line or columns[head + 1] <= column
                slips.append((first if opened else heads[head], opening))  # else its block was not opened
        at_column[column] = line
        if sum(head == line for _, head in open_[-2:]) == 2:
            doubled.add(line)
    if open_ and open_[-1][1] == len(heads) - 1:
        slips.append((heads[-1], closing))
    if sum(1 if missing == closing else -1 for _, missing in slips) != surplus:  # an odd layout
        wanted = closing if surplus > 0 else opening
        slips = [slip for slip in slips if slip[1] == wanted][: abs(surplus)]
    return sorted(slips)[:_MOST]


def _mend(tokens: Tokens, report: Report, first: int, missing: int) -> None:
    newline = tokens.source.text.find("\n", tokens.starts[first])
    last = len(tokens.kinds) - 1
    stop = last if newline < 0 else bisect_left(tokens.starts, newline, first + 1)
    repair = _best(tokens, first, stop, missing)
    end = tokens.end_before(repair.at)
    if repair.insert == _kinds("{") and not repair.delete:
        report.add("E0106", "missing `{`", end, end, fix=" {")
    elif repair.insert == _kinds("}") and not repair.delete:
        _report_unclosed(tokens, report, repair.at, tokens.unmatched(repair.at)[0][-1:])
    else:
        report_repair(tokens, report, repair, [])
    tokens.replace(repair.at, repair.delete, repair.insert)


def _best(tokens: Tokens, first: int, stop: int, missing: int) -> Repair:
    """The change of a line after which most of it, and what follows, reads."""
    kinds, (opening, closing) = tokens.kinds, (tables().literals[sign] for sign in "{}")
    limit = stop  # the layout cannot tell a brace at the end of a line from one at the start of the next
    while kinds[limit] in (opening, closing):
        limit += 1
    end = min(limit + _BEHIND, len(kinds) - 1)
    other = _kinds("else")[0]
    words = "if ( NAME ) {" if other in kinds[first : first + 2] else "NAME {"
    stack = [tables().start]
    for kind in _kinds(words) * 40 + _kinds("}") * (kinds[first] == other):
        advance(stack, kind)  # deep inside blocks, where all that a line can close fits
    misfit = min(reach(stack.copy(), kinds, first, end), limit)
    places = range(max(first, misfit - _LONGEST), misfit + 1)
    reach(stack, kinds, first, places.start)
    depth = sum((kind == opening) - (kind == closing) for kind in kinds[first : places.start])
    best, highest = Repair(stop, 0, (missing,)), (-1, 0.0, -1)
    for at in places:
        for mend in _mends(tokens, stack, at, stop, limit, missing):
            if missing in mend.insert and missing == closing and at < stop and depth < 1:
                continue  # it would close what the layout leaves open
            trial = stack.copy()
            if all(advance(trial, kind) for kind in mend.insert):
                got = reach(trial, kinds, at + mend.delete, end)
                if got == end == len(kinds) - 1 and not fits(trial, closing):
                    got -= 1  # the text would end in the middle of a statement
                if (got, -mend.cost, mend.at) > highest:
                    best, highest = mend, (got, -mend.cost, mend.at)
        depth += (kinds[at] == opening) - (kinds[at] == closing)
        if at == limit or not advance(stack, kinds[at]):
            break
    return best


def _mends(tokens: Tokens, stack: list[int], at: int, stop: int, most: int, missing: int) -> Iterator[Repair]:
    """Repairs of a missing brace at one place, each the cheaper the likelier it is."""
    (brace,), (end,) = _kinds("}"), _kinds(";")
    closes, name = missing == brace, tokens.name(at)
    if at <= stop:
        yield Repair(at, 0, (missing,), -0.3)
    if at == stop and not fits(stack, brace):  # the line breaks off
        rest = completion(stack, end if closes else missing)
        if rest is not None and (closes or rest):
            yield Repair(at, 0, (*rest, end, missing) if closes else (*rest, missing), -0.6)
    elif at == stop and closes:
        yield Repair(at, 0, (missing, end), -0.25)
    if at >= most:
        return
    if name == ("{" if closes else "}"):
        yield Repair(at, 1, (), -0.2 if closes else -0.5 - 0.05 * tokens.on_new_line(at))
        for rank, kind in enumerate(_kinds(_INSTEAD)):
            yield Repair(at, 1, (kind,), 0.001 * rank - 0.1)
    elif tokens.kinds[at] != missing:
        yield Repair(at, 1, (missing,), -0.1)


FOLLOWED: Final = 80
"""Number of tokens for which the likeliest repairs are followed, to choose between them."""
_WINDOW: Final = 8  # tokens before the mistake among which its cause is looked for
_THOROUGH: Final = 100  # after so many mistakes in a file it is looked for at the mistake alone

_REPLACEMENTS: Final = [(old, new, float(cost)) for old, new, cost in rows("recovery", "replacements")]
_CODES: Final = dict[str, str](rows("recovery", "codes"))
_DELETION, _SUBSTITUTION, _MISSPELT, _BREAK, _SWAP = 1.5, 1.1, 0.9, 1.4, 1.8
_NEW_LINE = 0.6  # a token that begins a line is seldom the slip
_CLOSING = 1.1

_DIVISION: Final = re.compile(r"[ \t]*//[ \t]*[\w.()]{1,40}[ \t]*;[ \t]*(?=\n)")
"""Comment that was meant for a division."""
_PLAIN: Final = re.compile(r"(?:[\w\s.,=#]|(?<=[(\[,])-|(?<=, )-)*+")
"""Items in brackets without an operator between them: the bracket ends behind them all."""
_FLAT: Final = re.compile(r"[^()\[\]{};]*+")
"""The inside of brackets that holds no others: before a block, all of it belongs there."""
_BEGINNINGS: Final = ("let", "param", "fn", "module")
_DEFINITIONS: Final = ("let", "param", "fn")
_CLOSES: Final = {"(": ")", "[": "]"}
_FIXED: Final = ("{", "}", "$END")  # braces were matched before
_ENDS: Final = (";", "}", "$END")
_NAMED: Final = {"BAD_EXPRESSION": "an expression", "NAME": "a name", "STRING": "a string"}


class Repair(Record):
    """Put ``insert`` in the place of ``delete`` tokens at index ``at``."""

    at: int
    delete: int
    insert: tuple[int, ...]
    cost: float = 0


@cache
def _kinds(names: str) -> tuple[int, ...]:
    return tuple(map(tables().kind, names.split()))


@cache
def _insertions() -> list[tuple[tuple[int, ...], float, tuple[int, ...]]]:
    """Insertions to try: the tokens, the cost, and the token that has to follow if that matters."""
    known = rows("recovery", "insertions")
    return [(_kinds(names), float(cost), _kinds("".join(needed))) for names, cost, *needed in known]


class Recovery:
    """Recovery for one file, whose tokens it edits."""

    def __init__(self, tokens: Tokens, report: Report) -> None:
        self.tokens = tokens
        self.report = report
        self.repairs = 0

    def resume(self, states: list[int], values: list[Any], at: int) -> int | None:
        """Mend what does not fit at a token and cut the parser's stacks back to read its statement again.

        Returns the index to go on at, or None where there are too many mistakes.
        """
        self.repairs += 1
        if self.report.full or self.repairs > 4 * MAX_MISTAKES:
            return None
        depth = statement_depth(states)
        base = states[: depth + 1]
        begun = values[depth] if depth < len(values) else at
        if not isinstance(begun, int):
            span: Span = begun[1] if isinstance(begun, tuple) else begun.span
            begun = bisect_left(self.tokens.starts, span.start)
        first: int = begun
        near = at - first <= MAX_REPLAY
        mended = near and mend_habit(self.tokens, self.report, base, first, at)
        if not mended and (self._spaced_unit(at) or (first == at and self._start_mistake(at))):
            return at
        if not mended and (repair := self._search(base, states, first, at)) is not None:
            open_ = self.tokens.unmatched(repair.at, first, "()[]")[0]
            report_repair(self.tokens, self.report, repair, open_)
            self.tokens.replace(repair.at, repair.delete, repair.insert)
            if not near:
                return at
            mended = True
        del states[depth + 1 :], values[depth:]
        return first if mended else self._skip(first, at)

    # ------------------------------------------------------------ the best repair

    def _search(self, base: list[int], stack: list[int], first: int, at: int) -> Repair | None:
        """The best repair of a statement from ``first`` on, or None where none helps.

        ``base`` are the states before the statement, ``stack`` those at the mistake, used if it is too far.
        """
        tokens, kinds = self.tokens, self.tokens.kinds
        bound = next((i for i in range(at, at + FOLLOWED) if tokens.name(i) in _ENDS), at + FOLLOWED)

        def worth(stop: int) -> float:  # tokens of later statements that fit count little
            own = min(stop, bound + 1) - at
            return own + 0.15 * (min(stop, at + FOLLOWED) - at - own)

        far = at - first > MAX_REPLAY
        before = (stack if far else base).copy()
        prefixes = []
        for place in range(at if far else first, at):  # the parser may have applied rules for the bad token
            prefixes.append((place, before.copy()))
            advance(before, kinds[place])
        found = [(at, before, self._candidates(before, first, at))]
        found += [(place, states, self._misspelt(first, place)) for place, states in prefixes[:1]]
        for place, states in prefixes[-_WINDOW if len(self.report.found) < _THOROUGH else -1 :]:
            if tokens.on_new_line(place) and (tokens.name(place) == "NAME" or tokens.name(place).islower()):
                found.append((place, states, self._broken_off(states, place, 0.7 - 0.1 * (at - place))))
            found.append((place, states, self._candidates(states, first, place)))
        attempts = []
        for place, states, repairs in found:
            early = 0.1 + 0.1 * (at - place) if place < at else 0.0
            for repair in repairs:
                trial = states.copy()
                if not all(advance(trial, kind) for kind in repair.insert):
                    continue
                end = repair.at + repair.delete
                start = max(at, end)
                stop = reach(trial.copy(), kinds, end, start + LOOKAHEAD)
                if stop >= start + 3 or any(tokens.name(index) in _ENDS for index in range(start, stop)):
                    attempts.append((worth(stop) - early - repair.cost, early + repair.cost, repair, trial))
        best, highest = None, -inf
        for _, cost, repair, trial in sorted(attempts, key=lambda one: -one[0])[:8]:
            end = repair.at + repair.delete
            score = worth(reach(trial, kinds, end, max(at, end) + FOLLOWED)) - cost
            if score > highest:
                best, highest = repair, score
        return best

    def _candidates(self, stack: list[int], first: int, at: int) -> Iterator[Repair]:
        tokens, kind = self.tokens, self.tokens.kinds[at]
        name, new_line = tokens.name(at), tokens.on_new_line(at)
        following = at + (kind != END)
        after = tokens.kinds[following]
        if open_ := [tokens.name(index) for index in tokens.unmatched(at, first, "()[]")[0]]:
            cost = _CLOSING + (tokens.name(at - 1) in ("(", "[", ","))  # nobody forgets to close these
            closings = _kinds(" ".join(_CLOSES[bracket] for bracket in reversed(open_)))
            yield Repair(at, 0, closings[:1], cost)
            yield Repair(at, 0, closings, cost + 0.1 * len(closings))
            yield Repair(at, 0, (*closings, *_kinds(";")), cost + 0.7)
            if name not in (*_FIXED, ")", "]"):
                yield Repair(at, 1, closings[:1], cost + _SUBSTITUTION)
            if new_line:
                yield Repair(at, 0, (closings[0], *_kinds(",")), cost + 0.7)
        for insert, cost, needed in _insertions():
            starts = tables().kinds[insert[0]]
            behind = tokens.name(at - 1) if at else ""
            if not fits(stack, insert[0]) or (starts == "as" and behind != "STRING"):
                continue
            if needed in ((), (after,)) and name not in _FIXED and insert != (kind,):
                yield Repair(at, 1, insert, cost + _SUBSTITUTION + _NEW_LINE * new_line + len(insert) - 1)
            if starts == ";" and (new_line or name in _ENDS):
                cost = 1.0
            elif new_line and starts not in _ENDS:
                cost += _NEW_LINE / 2
            if needed in ((), (kind,)):
                yield Repair(at, 0, insert, cost)
        if new_line or name in _ENDS:
            yield from self._broken_off(stack, at)
        both = {name, tokens.name(following)}
        if END not in (kind, after) and len(both) == 2 and not both <= {*_FIXED}:
            yield Repair(at, 2, (after, kind), _SWAP)
        if name in _FIXED:
            return
        for written, meant, cost in _REPLACEMENTS:
            if written == name:
                header = name == "=" and tokens.name(first) in ("fn", "module")
                yield Repair(at, 1, _kinds(meant), cost + 0.5 * header)
        if name.islower():
            yield Repair(at, 1, _kinds("NAME"), _MISSPELT + 0.2)
        yield from self._misspelt(first, at)
        cost = _DELETION
        for last in range(at, at + 3):
            begins = tokens.on_new_line(last)
            if tokens.name(last) in _FIXED or (last > at and (tokens.name(last) == ";" or begins)):
                return
            yield Repair(at, last + 1 - at, (), cost + _NEW_LINE * begins)
            cost += 0.6

    def _misspelt(self, first: int, at: int) -> Iterator[Repair]:
        """A keyword with a slip or of another language, or an operator written as a word."""
        text = self.tokens.text(at) if self.tokens.name(at) == "NAME" else ""
        for word in (OPERATORS.get(text), HEADS.get(text) if at == first else None, *keywords_near(text)):
            if text and word:
                yield Repair(at, 1, _kinds(word), _MISSPELT)

    def _broken_off(self, stack: list[int], at: int, cost: float = _BREAK) -> Iterator[Repair]:
        """The line before a token breaks off in the middle of a statement."""
        for end in (_kinds(";"), _kinds("{ }")):
            if (missing := completion(stack, end[0])) or (missing is not None and len(end) == 1):
                yield Repair(at, 0, (*missing, *end), cost + 0.05 * len(missing))

    # ------------------------------------------------------------ mistakes with words of their own

    def _start_mistake(self, at: int) -> bool:
        """A token that no statement begins with."""
        tokens, place, name = self.tokens, self.tokens.place(at), self.tokens.name(at)
        block = tokens.kinds[at] != END and tokens.name(at + 1) == "{"
        if name == ";" and not block:
            self.report.add("W0101", "stray `;`", *place, help="no `;` follows a block", fix="")
            tokens.replace(at, 1, ())
        elif name == "{" and at and tokens.name(at - 1) == ";" and not tokens.on_new_line(at):
            fix = None if head_word(tokens, at - 1) in _DEFINITIONS else ""  # it needs its `;`
            self.report.add("E0130", "`;` between a statement and its block", *tokens.place(at - 1), fix=fix)
            tokens.replace(at, 0, _kinds("BAD_HEAD"))
        elif name == "{":
            help = "a block belongs to an object, a module, `group`, `material`, `for`, `if` or a boolean"
            self.report.add("E0129", "block without a head", *place, help=help)
            tokens.replace(at, 0, _kinds("BAD_HEAD"))
        elif name == "else":
            self.report.add("E0101", "`else` without `if`", *place)
            tokens.replace(at, 1, _kinds("BAD_HEAD") if block else ())
        else:
            return False
        return True

    def _spaced_unit(self, at: int) -> bool:
        """`30 deg`: one number, whose value is unknown."""
        tokens, number, word = self.tokens, tables().kind("NUMBER"), self.tokens.text(at)
        unit, gap = UNIT_NAMES.get(word, word), (tokens.end_before(at), tokens.starts[at])
        bare = at > 0 and tokens.kinds[at - 1] == number and tokens.text(at - 1)[-1:].isdigit()
        if not bare or unit not in UNITS or tokens.source.text[slice(*gap)].strip(" "):
            return False
        start, end = tokens.place(at - 1, at + 1)
        fix = self.report.change(gap[0], end, unit, f"write `{unit}` right after the number")
        help = "units are glued to their number"
        self.report.add("E0117", "space between a number and its unit", start, end, help=help, fix=fix)
        tokens.splice(at - 1, at + 1, [(number, start, end)])
        tokens.reported.add(start)
        return True

    def _skip(self, first: int, at: int) -> int | None:
        """Give the statement up: one `BadStmt` up to its `;`, its block, or the end of the block around."""
        tokens = self.tokens
        if tokens.starts[at] not in tokens.reported:
            place = (tokens.end_before(at),) * 2 if tokens.kinds[at] == END else tokens.place(at)
            self.report.add("E0122", f"this is not a statement: unexpected {_shown(tokens, at)}", *place)
        stop = at
        while tokens.name(stop) not in _FIXED:
            begins = tokens.name(stop).islower() and tokens.on_new_line(stop)
            if stop > at and (begins or tokens.name(stop - 1) == ";"):
                break
            stop += 1
        if stop == first:
            return None
        bad = "BAD_HEAD" if tokens.name(stop) == "{" and tokens.name(stop - 1) != ";" else "BAD_STATEMENT"
        tokens.splice(first, stop, [(tables().kind(bad), *tokens.place(first, stop))])
        return first


# ---------------------------------------------------------------- repairs in words


def report_repair(tokens: Tokens, report: Report, repair: Repair, open_: list[int]) -> None:
    """Report the mistake that a repair is going to mend; ``open_`` are the brackets open before it."""
    at, stop = repair.at, repair.at + repair.delete
    gap = (tokens.end_before(at), tokens.starts[at])
    if any(tokens.starts[index] in tokens.reported for index in range(at, stop)):
        return  # a slip that has been reported already
    if repair.delete and tokens.starts[at] == tokens.ends[stop - 1]:
        return  # what recovery put in itself, at a mistake that has been reported
    if not repair.delete and any(start in tokens.reported for start in range(*gap)):
        return  # what belongs here was read as something illegal
    names = [tables().kinds[kind] for kind in repair.insert]
    if not repair.delete:
        _report_insertion(tokens, report, at, names, open_)
    elif not names:
        text = tokens.source.text[slice(*tokens.place(at, stop))]
        code, word = ("E0105", "unmatched") if text in (")", "]", "{", "}") else ("E0101", "unexpected")
        twice = text.isalpha() and text in (tokens.text(stop), tokens.text(at - 1))
        help = "between values choose with c ? a : b" if text.startswith("else") else None
        place = tokens.place(at, stop)
        report.add(code, f"{word} {quoted(text)}", *place, help=help, fix="" if twice else None)
    else:
        _report_replacement(tokens, report, repair, names)


def _report_insertion(tokens: Tokens, report: Report, at: int, names: list[str], open_: list[int]) -> None:
    end, shown, first = tokens.end_before(at), _shown(tokens, at), names[0]
    breaks_off = tokens.on_new_line(at) or tokens.kinds[at] == END
    code, place = _CODES.get(first, "E0126"), (end, end)
    message, help, labels, fix = f"missing {_listed(names)}", None, [], None
    if names == ["as", "NAME"]:
        help = f"write import {tokens.text(at - 1)} as s; and what it has with s. before its name"
    elif names == ["{", "}"]:
        help = "braces are mandatory here, even around nothing"
    elif len(names) > 1 and names[-1] in (";", "}") and set(names) - {")", "]", "}", ";"}:
        message, help = f"unfinished statement: {message}", "the line breaks off here"
    elif first in (")", "]") and open_:
        labels = [Label(Span(tokens.source, *tokens.place(open_[-1])), "opened here")]
        inside = tokens.ends[open_[-1]], end
        if not breaks_off and len(open_) == len(names) == 1:
            simple = {"`;`": _PLAIN, "`{`": _FLAT}.get(shown)
            fix = first if simple and simple.fullmatch(tokens.source.text, *inside) else None
    elif first == ";":
        help, text = "a `;` ends every statement without a block", tokens.text(at)
        moved = tokens.text(at - 1) == ")" and head_word(tokens, at - 1) in TRANSFORMS
        if tokens.kinds[at] != END and _DIVISION.match(tokens.source.text, end):
            help = "`//` begins a comment; the whole part of a / b is floor(a / b)"
        elif breaks_off or text in ("}", *_BEGINNINGS) or (moved and text in (*TRANSFORMS, "material")):
            fix = ";"  # what comes next can only begin a statement of its own
    elif first in _NAMED:
        message = f"expected {_NAMED[first]}, found {shown}"
        if not breaks_off:  # an operand is missed where the next token stands
            place = tokens.place(at)
    elif first == ",":
        message = f"missing `,` or operator before {shown}"
    else:
        message = f"{message} before {shown}"
        fix = f" {first}" if names in (["="], ["in"], ["as"]) else None
    report.add(code, message, *place, labels=labels, help=help, fix=fix)


def _report_replacement(tokens: Tokens, report: Report, repair: Repair, names: list[str]) -> None:
    at, (start, end) = repair.at, tokens.place(repair.at, repair.at + repair.delete)
    text, new = tokens.text(at), "".join(names)
    code, message, help, fix = "E0130", f"{_shown(tokens, at)} where {_listed(names)} belongs", None, None
    if repair.delete == 2:
        code, message = "E0131", f"`{text}` and `{tokens.text(at + 1)}` are in the wrong order"
    elif new == "NAME" and text.isalpha():
        code, message, help = "E0110", f"`{text}` is a keyword, not a name", "choose another name"
    elif names[0] in _NAMED:
        code = _CODES.get(names[0], "E0126")
        message = f"expected {_NAMED[names[0]]}, found {_shown(tokens, at)}"
    elif new == "==":
        code, message, help = "E0111", "`=` does not compare", "equality is `==`"
        fix = None if head_word(tokens, at) in _DEFINITIONS else new  # two names for one value, more likely
    elif names == ["{", "}"]:
        code, message = "E0106", f"missing block, found `{text}`"
    elif {text, new} == {")", "]"}:
        code, fix = "E0105", new
    elif OPERATORS.get(text) == new:
        code, message, help = "E0127", f"`{text}` is not used here", f"`{new}` is the sign for it"
        fix = None if new == "!" and tokens.text(at + 1) != "(" else new  # elsewhere it takes more
    elif new.isalpha() and new in (HEADS.get(text), *keywords_near(text)):
        code, message, fix = "E0132", f"unknown word `{text}`", None if text == "int" else new
        help = f"it is `{new}` here" if text in HEADS else f"did you mean `{new}`?"
    elif any((text, new) == (written, meant) for written, meant, _ in _REPLACEMENTS):
        fix = " =" if new == "=" and tokens.end_before(at) == start else new
    report.add(code, message, start, end, help=help, fix=fix)


def _listed(names: list[str]) -> str:
    """Missing tokens in words: "an expression, `)` and `{`"."""
    parts: list[str] = []
    for name in names:
        if parts and not (name.isalpha() or parts[-1][-2:-1].isalpha()) and name not in _NAMED:
            parts[-1] = f"{parts[-1][:-1]}{name}`"  # signs in a row
        else:
            parts.append(_NAMED.get(name, f"`{name}`"))
    return " and ".join((", ".join(parts[:-1]), parts[-1])) if parts[1:] else parts[0]


def _shown(tokens: Tokens, at: int) -> str:
    return "the end of the file" if tokens.kinds[at] == END else quoted(tokens.text(at))
