"""Callbacks of the grammar that lay out names, lists and expressions; statements are in `layout`.

They take the place of those that build the tree (`scenelang.syntax.build`): a token comes as its index,
everything else as the part that another callback has made.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from scenelang.formatting.documents import (
    LINE,
    Comments,
    Concat,
    Group,
    Indent,
    Part,
    Word,
    after_of,
    before_of,
    ends_of,
    flat_of,
    joined,
    own_after_first,
    plain,
    sequence,
)
from scenelang.formatting.lists import Bracketed, Item, broken, inline
from scenelang.formatting.trivia import Notes, texts_of
from scenelang.syntax.lexer import Tokens

_PATH = re.compile(r"\w+(\.\w+)*")
_NUMBER_LAST = re.compile(r"(?:^|\s)\.?[0-9][\w.+-]*$")  # comments may stand before it
_SURE_DIGITS = 300
"""A number of so many signs without an exponent is finite."""
_LONGEST_OPERATOR = 2
_UNIT_LETTERS = "adegmnrstu"
_LEVELS = {"*": 5, "/": 5, "%": 5, "+": 4, "-": 4, "<": 3, "<=": 3, ">": 3, ">=": 3, "==": 2, "!=": 2}
_LEVELS |= {"&&": 1, "||": 0}


class Operation(Group):
    """Operands with operators of one level between them; those of the same level on the left are taken in."""

    __slots__ = ("level", "operands", "operators")

    def __init__(self, flat: str | None, operands: list[Part], operators: list[Part], level: int) -> None:
        super().__init__(flat, self._lines)
        self.operands = operands
        self.operators = operators
        self.level = level

    def _lines(self) -> Part:
        first = self.operands[0]
        parts: list[Part] = [first]
        after = [*after_of(first)]
        for operator, operand in zip(self.operators, self.operands[1:], strict=True):
            bare = len(flat_of(operator) or "") <= _LONGEST_OPERATOR
            after += before_of(operator)
            if bare:
                # The operator will begin the next line: what stands behind it belongs to the line before.
                after += [*after_of(operator), *before_of(operand)]
            if after:
                parts.append(Comments(own_after_first(after)))
            parts.append(LINE)
            if bare:
                parts += [operator, " ", operand]
            else:  # comments before the operator must not be overtaken
                parts.append(sequence([plain(operator, after=True), " ", operand]))
            after = [*after_of(operand)]
        return Concat(None, parts)


class Choice(Group):
    """``c ? a : b``, with the choices in its last place taken in."""

    __slots__ = ("clauses",)

    def __init__(self, flat: str | None, clauses: list[tuple[Part, ...]]) -> None:
        super().__init__(flat, self._lines)
        self.clauses = clauses  # (condition, ?, value, :) each, and (value,) as the last one

    def _lines(self) -> Part:
        *chosen, (otherwise,) = self.clauses
        if len(chosen) == 1:
            condition, mark, value, colon = chosen[0]
            tail = [LINE, mark, " ", value, LINE, colon, " ", otherwise]
            return sequence([condition, Indent(sequence(tail))])
        parts: list[Part] = []
        lead: list[Part] = []
        for condition, mark, value, colon in chosen:
            parts += [*lead, condition, " ", mark, " ", value]
            lead = [LINE, colon, " "]
        return sequence([*parts, *lead, otherwise])


class ExpressionLayout:
    """Lays out the expressions of one file, which was read without mistakes.

    `doubtful` becomes true at what only the builder of the tree can refuse: an escape in a string, a number
    that may be too large, a call of what may not be a name.
    """

    def __init__(self, tokens: Tokens, notes: Mapping[int, Notes]) -> None:
        self.tokens = tokens
        self.notes = notes
        self.text = tokens.source.text
        self.starts = tokens.starts
        self.ends = tokens.ends
        self.doubtful = False

    def word(self, token: int) -> Part:
        """A token with what stands around it."""
        text = self.text[self.starts[token] : self.ends[token]]
        note = self.notes.get(token)
        if note is None:
            return text
        if note.leading or note.trailing:
            gap = "" if text in ("(", "[") else " "
            text += "".join(gap + comment for comment in texts_of(note.trailing))
            text = " ".join([*texts_of(note.leading), text])
        if not (note.before or note.after or note.blank):
            return text
        word = Word(text)
        word.before, word.after, word.blank = note.before, note.after, note.blank
        return word

    # ------------------------------------------------------------ lists

    def first(self, item: Part) -> list[Item]:
        return [Item(item)]

    def listed(self, items: list[Item], comma: int, item: Part) -> list[Item]:
        self._comma(items, comma)
        items.append(Item(item))
        return items

    def _comma(self, items: list[Item], comma: int) -> None:
        if comma in self.notes:
            note = self.notes[comma]
            item = items[-1].part
            after = [*note.before, *note.after]
            if after_of(item) or after:
                items[-1] = Item(item, "", [*after, *note.trailing])
            else:
                items[-1] = Item(item, "".join(f" {text}" for text in texts_of(note.trailing)))

    def enclosed(self, opening: int, *rest: Any) -> Part:
        return self._bracketed(Group, opening, rest)

    def _bracketed(self, form: type[Group], opening: int, rest: Sequence[Any]) -> Part:
        items: list[Item] = rest[0] if rest[1:] else []
        left, right = self.word(opening), self.word(rest[-1])
        if rest[2:]:
            self._comma(items, rest[1])
        flat: str | None = None
        if not (after_of(left) or before_of(right)):
            flat = joined([left, *inline(items), right])
        return ends_of(form(flat, lambda: broken(left, items, right)), left, right)

    # ------------------------------------------------------------ names

    name = keyword = word

    def path(self, left: Part, dot: int, right: Part) -> Part:
        return self._glued(left, self.word(dot), right)

    def _glued(self, *parts: Part) -> Part:
        """Parts without space between them; one word if they are words without comments around them."""
        text = ""
        for part in parts:
            if isinstance(part, str):
                text += part
            elif isinstance(part, Word) and not (part.before or part.after):
                text += part.flat
            else:
                return sequence(parts)
        word = Word(text)
        word.blank = not isinstance(parts[0], str) and parts[0].blank
        return word if word.blank else text

    # ------------------------------------------------------------ expressions

    def argument(self, *parts: Any) -> Part:
        value: Part = parts[-1]
        if not parts[1:]:
            return value
        name, equal = parts[:2]
        named = sequence([name, " ", self.word(equal), " ", value])
        if isinstance(value, Bracketed) and isinstance(named, Concat):
            # Keeps being told apart as something that opens on the line of a call it is alone in.
            return ends_of(Bracketed(named.flat, lambda: Concat(None, named.parts)), named, named)
        return named

    def range(self, start: Part, dots: int, stop: Part, *rest: Any) -> Part:
        loose = isinstance(start, (Operation, Choice)) or isinstance(stop, (Operation, Choice))
        left = flat_of(start)
        space = " " if loose or (left is not None and left.endswith(".")) else ""
        step = [" ", self.word(rest[0]), " ", rest[1]] if rest else []
        return sequence([start, space, self.word(dots), " " if loose else "", stop, *step])

    def conditional(self, condition: Part, mark: int, then: Part, colon: int, otherwise: Part) -> Part:
        head = (condition, self.word(mark), then, self.word(colon))
        flat = joined([condition, " ", head[1], " ", then, " ", head[3], " ", otherwise])
        tail = otherwise.clauses if isinstance(otherwise, Choice) else [(otherwise,)]
        return ends_of(Choice(flat, [head, *tail]), condition, otherwise)

    def binary(self, left: Part, op: int, right: Part) -> Part:
        operator = self.word(op)
        flat = joined([left, " ", operator, " ", right])
        level = _LEVELS.get(self.text[self.starts[op] : self.ends[op]], -1)
        if isinstance(left, Operation) and left.level == level >= 0:
            operands, operators = left.operands, left.operators
        else:
            operands, operators = [left], []
        operands.append(right)
        operators.append(operator)
        return ends_of(Operation(flat, operands, operators, level), left, right)

    def unary(self, op: int, operand: Part) -> Part:
        return self._glued(self.word(op), operand)

    def index(self, value: Part, opening: int, index: Part, closing: int) -> Part:
        left, right = self.word(opening), self.word(closing)
        if isinstance(index, str):
            return self._glued(value, left, index, right)
        return sequence([value, self._enclosed(left, index, right)])

    def member(self, value: Part, dot: int, name: Part) -> Part:
        # A dot right behind a number may be taken for its decimal point.
        space = " " if _NUMBER_LAST.search(flat_of(value) or "") else ""
        return self._glued(value, space, self.word(dot), name)

    def method(self, value: Part, dot: int, name: Part, args: Part) -> Part:
        if not _PATH.fullmatch(flat_of(value) or ""):
            self.doubtful = True
        return sequence([value, self.word(dot), name, args])

    def call_expr(self, name: Part, args: Part) -> Part:
        return sequence([name, args])

    def parenthesised(self, opening: int, value: Part, closing: int) -> Part:
        return self._enclosed(self.word(opening), value, self.word(closing))

    def _enclosed(self, left: Part, value: Part, right: Part) -> Part:
        inside = [Item(value)]
        doc = Group(joined([left, value, right]), lambda: broken(left, inside, right, comma=""))
        return ends_of(doc, left, right)

    def vector(self, opening: int, *rest: Any) -> Part:
        return self._bracketed(Bracketed, opening, rest)

    def name_ref(self, name: Part) -> Part:
        return name

    def number(self, token: int) -> Part:
        text = self.text[self.starts[token] : self.ends[token]]
        if len(text) > _SURE_DIGITS or "E" in text or "e" in text.rstrip(_UNIT_LETTERS):
            self.doubtful = True
        return self.word(token)

    def string(self, token: int) -> Part:
        if self.text.find("\\", self.starts[token], self.ends[token]) >= 0:
            self.doubtful = True
        return self.word(token)

    color = true = false = word
