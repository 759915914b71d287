"""Which small edits of the tokens are tried at a mistake, what each costs, and the search for the best.

A repair is worth how far parsing goes on after it, less what it costs; costs say which mistakes people
make. Only repairs after which at least three tokens or a whole statement fit are taken.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache

from scenelang.records import Record
from scenelang.syntax.automaton import LOOKAHEAD, advance, completion, fits, reach
from scenelang.syntax.lexer import Tokens
from scenelang.syntax.recovery.foreign import OPERATORS, keywords_near
from scenelang.syntax.recovery.layout import leaves_open
from scenelang.syntax.tables import END, tables

Kinds = tuple[int, ...]

FOLLOWED = 80
"""How far the repairs that look best are followed to choose between them."""

WINDOW = 24
"""How many tokens before the mistake the cause is looked for."""

THOROUGH = 100
"""After so many mistakes in a file the cause is looked for at the mistake alone."""

MAX_REPLAY = 400
"""A statement with more tokens before the mistake is not tried again from its start."""


class Repair(Record):
    """Put ``insert`` in the place of ``delete`` tokens at index ``at``."""

    at: int
    delete: int
    insert: tuple[int, ...]
    cost: float = 0

    @property
    def end(self) -> int:
        return self.at + self.delete


# What is forgotten, and what that costs. Several tokens that only make sense together count as one.
_INSERTIONS = {";": 1.3, ",": 1.2, "=": 1.3, "in": 1.4, "as": 1.4, ":": 1.5, "..": 2.0, "*": 2.2}
_INSERTIONS |= {"(": 1.6, "( )": 1.6, "{ }": 1.9, "BAD_EXPRESSION": 1.6, "NAME": 1.7, "STRING": 1.8}
_INSERTIONS |= {"= BAD_EXPRESSION": 1.9, "in BAD_EXPRESSION": 1.9, "as NAME": 1.9, ": BAD_EXPRESSION": 1.9}
_INSERTIONS |= {"let": 1.4, "param": 1.5, "fn": 1.5, "for": 1.5, "if": 1.5, "nsg": 1.6, "model": 1.7}
_INSERTIONS |= {"import": 1.6, "material": 1.6}
_ONLY_BEFORE = dict.fromkeys(("let", "param", "fn", "material"), "NAME") | {"for": "(", "if": "("}
_ONLY_BEFORE |= {"nsg": "NUMBER", "model": "STRING", "import": "STRING"}
_ONLY_AFTER = {"as": "STRING", "as NAME": "STRING"}
REPLACEMENTS = {
    "=": {"==": 1.0},
    "==": {"=": 1.2},
    ":": {"=": 1.2, ";": 1.2, "..": 1.4, ",": 1.4},
    ";": {",": 1.2, ":": 1.5, "{ }": 1.8},
    ",": {";": 1.2, "=": 1.6},
    ".": {",": 1.5, ";": 1.5},
    ")": {"]": 1.1},
    "]": {")": 1.1},
    "(": {"[": 1.3},
    "[": {"(": 1.3},
}
_DELETION, _FURTHER_DELETION = 1.5, 0.6
_SUBSTITUTION = 1.1  # something else stands where a forgotten token belongs
_MISSPELT = 0.9
_BREAK = 1.4  # a line breaks off
_SWAP = 1.8
_KEYWORD_AS_NAME = 1.1
_NEW_LINE = 0.6  # a token that begins a line is seldom the slip
_CLOSING, _CLOSING_AND_SEMICOLON = 1.1, 1.8


def _kinds(names: str) -> Kinds:
    return tuple(map(tables().kind, names.split()))


@cache
def _insertions() -> list[tuple[Kinds, float, Kinds, Kinds]]:
    """What may be forgotten: the tokens, the cost, what has to stand after and before, if that matters."""
    only = [(_ONLY_BEFORE.get(names, ""), _ONLY_AFTER.get(names, "")) for names in _INSERTIONS]
    costs = zip(_INSERTIONS.items(), only, strict=True)
    return [(_kinds(names), cost, _kinds(after), _kinds(before)) for (names, cost), (after, before) in costs]


@cache
def _replacements() -> dict[Kinds, list[tuple[Kinds, float]]]:
    """What may be written for something else, in kinds."""
    rows = REPLACEMENTS.items()
    return {_kinds(name): [(_kinds(new), cost) for new, cost in costs.items()] for name, costs in rows}


Found = tuple[float, float, Repair, list[int]]


class Search:
    """Looks for the best repair at a token that does not fit, in the statement from ``first`` on."""

    def __init__(self, tokens: Tokens, first: int, at: int) -> None:
        self.tokens = tokens
        self.kinds = tokens.kinds
        self.first = first
        self.at = at
        literals = tables().literals
        self.closing_of = {literals["("]: literals[")"], literals["["]: literals["]"]}
        self.closings = set(self.closing_of.values())
        self.fixed = {END, literals["{"], literals["}"]}  # braces were matched before
        self.ends = {literals[";"], literals["}"], END}
        self.semicolon = literals[";"]
        self.bound = at  # where the statement ends, or its head
        while self.bound < min(at + FOLLOWED, len(self.kinds)):
            self.bound += 1
            if self.kinds[self.bound - 1] in (*self.fixed, self.semicolon):
                break
        self.name = tables().kind("NAME")
        self.keywords = {kind for text, kind in literals.items() if text.isalpha()}

    def run(self, base: list[int], stack: list[int], window: int = WINDOW) -> Repair | None:
        """The best repair, or None where none helps.

        Args:
            base: the states before the statement.
            stack: those at the mistake; used where it is too far from there.
            window: how many tokens before the mistake are looked at.
        """
        if self.at - self.first > MAX_REPLAY:
            return self._settle(self._try_all(stack, self.at))[1]
        # Replayed, since the parser may have applied rules that only the bad token asked for.
        prefixes = []
        prefix = base.copy()
        for at in range(self.first, self.at):
            if at >= self.at - window:
                prefixes.append((at, prefix.copy()))
            advance(prefix, self.kinds[at])
        found = self._try_all(prefix, self.at)
        for at, prefix in prefixes:
            if self._begins_statement(at):
                found += self._try(prefix, at, self._broken_off(prefix, at, 0.7 - 0.1 * (self.at - at)))
        score, best = self._settle(found)
        if best is None or score < self._worth(self.at + FOLLOWED) - 2:
            for at, prefix in prefixes:
                found += self._try_all(prefix, at)
            best = self._settle(found)[1]
        return best

    def _worth(self, stop: int) -> float:
        """What it is worth that the tokens up to ``stop`` fit: those of later statements count little."""
        own = min(stop, self.bound) - self.at
        return own + 0.15 * (min(stop, self.at + FOLLOWED) - self.at - own)

    def _try_all(self, stack: list[int], at: int) -> list[Found]:
        """All repairs at one token that help."""
        return self._try(stack, at, self._candidates(stack, at))

    def _try(self, stack: list[int], at: int, candidates: Iterable[Repair]) -> list[Found]:
        """Those of some repairs that help, each with its score, its cost and the states after it."""
        found: list[Found] = []
        distance = self.at - at
        extra = 0.1 + 0.1 * distance if distance else 0.0
        for repair in candidates:
            trial = stack.copy()
            if not all(advance(trial, kind) for kind in repair.insert):
                continue
            start = max(self.at, repair.end)
            after = trial.copy()
            stop = reach(after, self.kinds, repair.end, start + LOOKAHEAD)
            if stop < start + 3 and not any(kind in self.ends for kind in self.kinds[start:stop]):
                continue
            cost = repair.cost + extra
            found.append((self._worth(stop) - cost, cost, repair, trial))
        return found

    def _settle(self, found: list[Found]) -> tuple[float, Repair | None]:
        """The best of several repairs and its score: the few that look best are followed further."""
        settled: list[tuple[float, Repair | None]] = []
        for _, cost, repair, trial in sorted(found, key=lambda one: -one[0])[:8]:
            stop = reach(trial.copy(), self.kinds, repair.end, max(self.at, repair.end) + FOLLOWED)
            settled.append((self._worth(stop) - cost, repair))
        return max(settled, key=lambda one: one[0], default=(0.0, None))

    def _candidates(self, stack: list[int], at: int) -> Iterator[Repair]:
        tokens, kinds = self.tokens, self.kinds
        kind = kinds[at]
        new_line = tokens.on_new_line(at)
        yield from self._closings(at)
        before = kinds[at - 1] if at else END
        after = kinds[at + 1] if kind != END else END
        for insert, cost, needed_after, needed_before in _insertions():
            if needed_before not in ((), (before,)) or not fits(stack, insert[0]):
                continue
            if (
                needed_after in ((), (after,))
                and kind not in self.fixed
                and insert != (kind,)
                and not insert[1:]
            ):
                yield Repair(at, 1, insert, cost + _SUBSTITUTION + _NEW_LINE * new_line)
            if needed_after not in ((), (kind,)):
                continue
            if insert[0] == self.semicolon and (new_line or kind in self.ends):
                cost = 1.0
            elif new_line and insert[0] not in self.ends:
                cost += _NEW_LINE / 2
            yield Repair(at, 0, insert, cost)
        if new_line or kind in self.ends:
            yield from self._broken_off(stack, at)
        # Two tokens the wrong way round; at most one of them is a brace.
        if END not in (kind, after) and kind != after and not self.fixed.issuperset((kind, after)):
            yield Repair(at, 2, (kinds[at + 1], kind), _SWAP)
        if kind in self.fixed:
            return
        for insert, cost in _replacements().get((kind,), ()):
            header = kind == tables().literals["="] and self._is(self.first, "fn", "module")
            yield Repair(at, 1, insert, cost + 0.5 * header)
        if kind in self.keywords:
            yield Repair(at, 1, (self.name,), _KEYWORD_AS_NAME + (at < self.at))
        elif kind == self.name:
            yield from self._misspelt(at)
        cost = _DELETION
        for count in range(1, 4):
            last = at + count - 1
            if kinds[last] in self.fixed or (count > 1 and kinds[last] == self.semicolon):
                return
            if tokens.on_new_line(last):
                if count > 1:
                    return
                cost += _NEW_LINE
            yield Repair(at, count, (), cost)
            cost += _FURTHER_DELETION

    def _misspelt(self, at: int) -> Iterator[Repair]:
        """A keyword with a slip, or an operator written as a word."""
        if self.kinds[at] == self.name:
            text = self.tokens.text(at)
            for word in (*([OPERATORS[text]] if text in OPERATORS else []), *keywords_near(text)):
                yield Repair(at, 1, (tables().literals[word],), _MISSPELT)

    def _is(self, at: int, *words: str) -> bool:
        return any(self.kinds[at] == tables().literals[word] for word in words)

    def _begins_statement(self, at: int) -> bool:
        """Whether a line in brackets, or after ``material flat``, is laid out like a statement of its own."""
        if not self.tokens.on_new_line(at):
            return False
        inside = self._is(at - 1, "let", "param", "fn", "module") or self._is(at - 2, "material")
        inside = inside or bool(self.open_brackets(at))
        return inside and self.kinds[at] in (self.name, *self.keywords) and leaves_open(self.kinds, at)

    def _broken_off(self, stack: list[int], at: int, cost: float = _BREAK) -> Iterator[Repair]:
        """The line before a token breaks off in the middle of a statement."""
        opening, closing = (tables().literals[text] for text in "{}")
        for goal, rest in ((self.semicolon, ()), (opening, (closing,))):
            missing = completion(stack, goal)
            if missing or (missing is not None and goal == self.semicolon):
                yield Repair(at, 0, (*missing, goal, *rest), cost + 0.05 * len(missing))

    def _closings(self, at: int) -> Iterator[Repair]:
        """Close one bracket, or all that are open, perhaps ending the statement too."""
        open_ = self.open_brackets(at)
        if not open_:
            return
        # Nobody forgets to close what holds nothing, or after a comma.
        dangling = at - 1 == open_[-1] or self._is(at - 1, ",")
        closings = tuple(self.closing_of[self.kinds[index]] for index in reversed(open_))
        yield Repair(at, 0, closings[:1], _CLOSING + dangling)
        if len(closings) > 1:
            yield Repair(at, 0, closings, _CLOSING + dangling + 0.1 * len(closings))
        yield Repair(at, 0, (*closings, self.semicolon), _CLOSING_AND_SEMICOLON + dangling)
        if self.kinds[at] not in self.fixed and self.kinds[at] not in self.closings:
            yield Repair(at, 1, closings[:1], _CLOSING + dangling + _SUBSTITUTION)
        if self.tokens.on_new_line(at):
            yield Repair(at, 0, (closings[0], tables().literals[","]), _CLOSING_AND_SEMICOLON + dangling)

    def open_brackets(self, at: int) -> list[int]:
        """Indices of the brackets of the statement that are open before a token."""
        open_: list[int] = []
        for index in range(self.first, at):
            kind = self.kinds[index]
            if kind in self.closing_of:
                open_.append(index)
            elif kind in self.closings and open_:
                open_.pop()
        return open_
