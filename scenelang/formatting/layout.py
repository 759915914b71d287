"""Callbacks of the grammar that lay out statements and blocks.

Which blocks may stand on one line:

- that of an object, a material or a call, if its statements are calls and such blocks themselves;
- that of a `module`, `for`, `if`, `group`, `chain` or boolean node, if no statement in it has a block, or
  if its only statement has one without further blocks.

A comment that ends its line, or a blank line inside, opens a block; so does a line that would be too long.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from scenelang.formatting.documents import (
    BLANK,
    LINE,
    Comments,
    Concat,
    Group,
    Indent,
    Part,
    after_of,
    before_of,
    ends_of,
    flat_of,
    joined,
    own_after_first,
    plain,
    sequence,
)
from scenelang.formatting.expressions import Choice, ExpressionLayout, Operation
from scenelang.formatting.lists import Bracketed, Item, blank_before, comment_lines, comments_before
from scenelang.formatting.trivia import Comment
from scenelang.syntax.tables import tables


class Statement(Group):
    """A statement with ``depth`` blocks within each other; a simple one may stand in a block on one line."""

    __slots__ = ("depth", "simple")

    def __init__(self, flat: str | None, maker: Callable[[], Part], depth: int, simple: bool) -> None:
        super().__init__(flat, maker)
        self.depth = depth
        self.simple = simple


class Block:
    """``{ … }``, whose place in a line is for the statement around it to say."""

    __slots__ = ("closing", "depth", "flat", "opening", "statements")

    def __init__(self, opening: Part, statements: Sequence[Item], closing: Part) -> None:
        self.opening = opening
        self.closing = closing
        self.statements = statements
        self.depth = 1
        self.flat: str | None = None
        simple = not (before_of(opening) or after_of(opening) or before_of(closing))
        for index, item in enumerate(statements):
            stmt = item.part
            assert isinstance(stmt, Statement)
            self.depth = max(self.depth, stmt.depth + 1)
            simple = simple and stmt.simple and not (stmt.before or stmt.after or (index and stmt.blank))
        if simple and not statements and flat_of(opening) == "{":
            self.flat = f"{{{flat_of(closing)}"
        elif simple:
            spaced = [part for item in statements for part in (" ", item.part)]
            self.flat = joined([opening, *spaced, " ", closing])

    def structural(self) -> str | None:
        """Its one line where it is the block of something that is not an object."""
        few = self.depth <= 1 or (self.depth == 2 and len(self.statements) == 1)
        return self.flat if few else None

    def open(self, behind: Sequence[Comment] = ()) -> list[Part]:
        """The block on lines of its own; ``behind`` are comments that stood before its opening brace."""
        opened = [*behind, *before_of(self.opening)]
        head: list[Part] = [plain(self.opening)]
        first: list[Part] = []
        if opened and flat_of(self.opening) != "{":  # comments before the brace must not be overtaken
            head = [Comments(opened, inside=True), plain(self.opening, after=True)]
        elif opened := [*opened, *after_of(self.opening)]:
            first = [Comments(own_after_first(opened))]
        inside = entries(self.statements, before_of(self.closing))
        if not inside and not opened:
            return [self.flat or "{}"]
        return [*head, Indent(Concat(None, [*first, *inside])), LINE, plain(self.closing)]


def entries(statements: Sequence[Item], dangling: Sequence[Comment]) -> list[Part]:
    """Statements and the comments between them, each on a new line, blank lines kept."""
    parts: list[Part] = []
    for item in statements:
        stmt = item.part
        parts.append(BLANK if parts and blank_before(stmt) else LINE)
        parts += comments_before(stmt)
        parts.append(stmt)
        if after := after_of(stmt):
            parts.append(Comments(own_after_first(after)))
    return [*parts, *comment_lines(dangling, begun=bool(parts))]


def _lined(parts: Sequence[Part], flat: str | None) -> Group:
    """What follows on the same line or, where that is too long, on a line of its own."""
    return Group(None if flat is None else " " + flat, lambda: Indent(Concat(None, [LINE, *parts])))


class Layout(ExpressionLayout):
    """Lays out one file."""

    def callbacks(self) -> list[Callable[..., Any] | None]:
        """The callback of every rule, in the order of `Tables.rules`; None passes the value on.

        Rules that only recovery uses have none: what is laid out has no mistakes.
        """
        names = (name for _, _, name in tables().rules)
        return [None if not name or name.startswith("bad_") else getattr(self, name) for name in names]

    def file(self, statements: list[Item] | None = None) -> Part:
        last = self.notes.get(len(self.tokens.kinds) - 1)
        parts = entries(statements or [], last.before if last else [])
        return Concat(None, parts[1:])

    def following(self, items: list[Item], item: Part) -> list[Item]:
        items.append(Item(item))
        return items

    # ------------------------------------------------------------ statements without a block

    def _ended(self, parts: Sequence[Part], last: int, simple: bool = False) -> Statement:
        """A statement that ends with ``;``; comments before that go behind it."""
        semicolon = self.word(last)
        after = [*after_of(parts[-1]), *before_of(semicolon), *after_of(semicolon)]
        if after and last in self.notes:
            after += self.notes[last].trailing
            semicolon = ";"
        whole = [*parts[:-1], plain(parts[-1], before=len(parts) > 1), plain(semicolon)]
        stmt = Statement(joined(whole), lambda: sequence(whole), 0, simple)
        ends_of(stmt, parts[0], "")
        stmt.after = after
        return stmt

    def _assigned(self, equal: int, value: Part) -> list[Part]:
        """``=`` and what follows: operations go to a line of their own before they are broken."""
        sign = self.word(equal)
        commented = after_of(sign) or before_of(value)
        if not commented and not isinstance(value, (Operation, Choice)):
            return [" ", sign, " ", value]
        doc = _lined([*comments_before(value), value], None if commented else flat_of(value))
        doc.after = after_of(value)
        return [" ", sign, doc]

    def version(self, word: int, number: int, last: int) -> Part:
        return self._ended([self.word(word), " ", self.number(number)], last)

    def model(self, word: int, name: Part, last: int) -> Part:
        return self._ended([self.word(word), " ", name], last)

    def param(self, word: int, name: Part, equal: int, default: Part, *rest: Any) -> Part:
        head = [self.word(word), " ", name, *self._assigned(equal, default)]
        if rest[1:]:
            limits = sequence([self.word(rest[0]), " ", rest[1]])
            head.append(ends_of(_lined([limits], flat_of(limits)), limits, limits))
        return self._ended(head, rest[-1])

    def let(self, word: int, name: Part, equal: int, value: Part, last: int) -> Part:
        return self._ended([self.word(word), " ", name, *self._assigned(equal, value)], last)

    def fn(self, word: int, name: Part, params: Part, equal: int, body: Part, last: int) -> Part:
        return self._ended([self.word(word), " ", name, params, *self._assigned(equal, body)], last)

    def import_(self, word: int, path: int, as_: int, alias: Part, last: int) -> Part:
        return self._ended([self.word(word), " ", self.string(path), " ", self.word(as_), " ", alias], last)

    def material_use(self, word: int, *rest: Any) -> Part:
        return self._use(self._material(word, rest[:-1]), rest[-1])

    def _material(self, word: int, names: Sequence[Part]) -> list[Part]:
        return [self.word(word), *[part for name in names for part in (" ", name)]]

    def call(self, name: Part, *rest: Any) -> Part:
        return self._use([name, *rest[:-1]], rest[-1])

    def _use(self, head: list[Part], last: int | Block) -> Part:
        if isinstance(last, Block):
            return self._blocked(head, last, structure=False)
        return self._ended(head, last, simple=True)

    def parameter(self, name: Part, *default: Any) -> Part:
        return sequence([name, " ", self.word(default[0]), " ", default[1]]) if default else name

    # ------------------------------------------------------------ statements with a block

    def block(self, opening: int, *rest: Any) -> Block:
        return Block(self.word(opening), rest[0] if rest[1:] else [], self.word(rest[-1]))

    def _blocked(self, head: Sequence[Part], body: Block, structure: bool = True) -> Statement:
        """A statement that ends with a block; that of an object stands on one line with what holds it."""
        one_line = body.structural() if structure else body.flat
        begun = [*head[:-1], plain(head[-1], before=len(head) > 1)]
        flat = None if one_line is None or after_of(head[-1]) else joined([*begun, " ", one_line])
        stmt = Statement(
            flat,
            lambda: sequence([*begun, " ", *body.open(after_of(head[-1]))]),
            body.depth,
            simple=not structure and one_line is not None,
        )
        return ends_of(stmt, head[0], body.closing)

    def module(self, word: int, name: Part, params: Part, body: Block) -> Part:
        return self._blocked([self.word(word), " ", name, params], body)

    def for_(
        self, word: int, opening: int, variable: Part, within: int, iterable: Part, closing: int, body: Block
    ) -> Part:
        inside = sequence([variable, " ", self.word(within), " ", iterable])
        return self._blocked([self.word(word), " ", self.parenthesised(opening, inside, closing)], body)

    def if_(self, word: int, opening: int, condition: Part, closing: int, then: Block, *rest: Any) -> Part:
        begun = self._blocked([self.word(word), " ", self.parenthesised(opening, condition, closing)], then)
        if not rest:
            return begun
        otherwise: Block | Statement = rest[1]
        turn = self.word(rest[0])
        between = [*after_of(then.closing), *before_of(turn)]
        first = otherwise.opening if isinstance(otherwise, Block) else otherwise
        inline = otherwise.structural() if isinstance(otherwise, Block) else otherwise.flat
        flat = None
        if inline is not None and not (between or after_of(turn) or before_of(first)):
            flat = joined([begun, " ", turn, " ", inline])

        def broken() -> Part:
            parts = [begun.broken(), *([Comments(own_after_first(between)), LINE] if between else [" "])]
            if isinstance(otherwise, Block):
                return sequence([*parts, plain(turn), " ", *otherwise.open(after_of(turn))])
            return sequence([*parts, plain(turn, after=True), " ", otherwise.broken()])

        last = otherwise.closing if isinstance(otherwise, Block) else otherwise
        depth = max(then.depth, otherwise.depth)
        return ends_of(Statement(flat, broken, depth, simple=False), begun, last)

    def node(self, kind: Part, *rest: Any) -> Part:
        return self._blocked([kind, *rest[:-1]], rest[-1])

    def combined(self, op: Part, *rest: Any) -> Part:
        child: Statement = rest[-1]
        parts = [op, *rest[:-1], " ", child]
        stmt = Statement(joined(parts), lambda: sequence(parts), child.depth, child.simple)
        return ends_of(stmt, op, child)

    def material(self, word: int, *rest: Any) -> Part:
        body = rest[-1]
        if not isinstance(body, Block):
            return sequence(self._material(word, rest))
        stmt = self._blocked(self._material(word, rest[:-1]), body, structure=False)
        return ends_of(Bracketed(stmt.flat, stmt.maker), stmt, stmt)
