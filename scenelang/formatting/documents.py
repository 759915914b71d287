"""Documents: text with places where lines may break, and the printer that chooses among them.

After Philip Wadler, *A prettier printer*, in The Fun of Programming (2003): a group is printed on one line if
it fits, otherwise its own line breaks are taken and the groups inside are tried. Two things are different.
Every document knows its text on one line beforehand, so that whatever fits is written at once; and a
document keeps the comments at its two ends apart from itself, so that whoever puts documents together
decides where they go (behind a comma, for example).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, TypeVar

from scenelang.formatting.trivia import Comment

WIDTH: Final = 100
"""Columns of a line, where breaking lines can achieve that."""
INDENT: Final = 2

AnyDoc = TypeVar("AnyDoc", bound="Doc")


class Doc:
    """A piece of layout.

    Args:
        flat: its text on one line; None if it cannot be on one line or is wider than any line.
    """

    __slots__ = ("after", "before", "blank", "flat")

    def __init__(self, flat: str | None) -> None:
        self.flat = flat
        self.before: Sequence[Comment] = ()  # on lines of their own before it
        self.after: Sequence[Comment] = ()  # behind it; the line must end there
        self.blank = False  # a blank line stands before it, after the comments of `before`


Part = Doc | str
"""A bare string is a short text that never breaks, without comments around it."""


class Word(Doc):
    """Text that stands as it is, with comments around it."""

    __slots__ = ()
    flat: str


class Break(Doc):
    """A place where the line breaks once the group around it does not fit."""

    __slots__ = ()


class Blank(Doc):
    """A line break with a blank line after it."""

    __slots__ = ()


class Concat(Doc):
    """Parts one after another."""

    __slots__ = ("parts",)

    def __init__(self, flat: str | None, parts: Sequence[Part]) -> None:
        super().__init__(flat)
        self.parts = parts


class Group(Doc):
    """What is on one line if it fits, and otherwise as ``maker`` says, which is asked at most once."""

    __slots__ = ("_made", "maker")

    def __init__(self, flat: str | None, maker: Callable[[], Part]) -> None:
        super().__init__(flat)
        self.maker = maker
        self._made: Part | None = None

    def broken(self) -> Part:
        """What it is where it does not fit on a line."""
        if self._made is None:
            self._made = self.maker()
        return self._made


class Indent(Doc):
    """Breaks inside go deeper by a step."""

    __slots__ = ("part",)

    def __init__(self, part: Part) -> None:
        super().__init__(None)
        self.part = part


class Fill(Doc):
    """Short texts with commas, as many on each line as fit."""

    __slots__ = ("texts",)

    def __init__(self, texts: Sequence[str]) -> None:
        super().__init__(None)
        self.texts = texts


class Comments(Doc):
    """Comments after which the line ends.

    Args:
        comments: in order.
        inside: they stand in the middle of something, so what follows is indented.
    """

    __slots__ = ("comments", "inside")

    def __init__(self, comments: Sequence[Comment], inside: bool = False) -> None:
        super().__init__(None)
        self.comments = comments
        self.inside = inside


LINE: Final = Break(" ")
SOFT: Final = Break("")
BLANK: Final = Blank(None)


def sequence(parts: Sequence[Part]) -> Part:
    """Parts one after another; comments between them stay there, those at the ends become its own."""
    inside: list[Part] = []
    after: Sequence[Comment] = ()
    for index, part in enumerate(parts):
        between = (after, before_of(part) if index else ())
        inside += [Comments(comments, inside=True) for comments in between if comments]
        inside.append(part)
        after = after_of(part)
    return ends_of(Concat(joined(parts), inside), parts[0], parts[-1])


def before_of(part: Part) -> Sequence[Comment]:
    return () if isinstance(part, str) else part.before


def blank_of(part: Part) -> bool:
    return not isinstance(part, str) and part.blank


def after_of(part: Part) -> Sequence[Comment]:
    return () if isinstance(part, str) else part.after


def plain(part: Part, before: bool = False, after: bool = False) -> Part:
    """A part without the comments at its ends, or with those of one end; the others the caller places."""
    if isinstance(part, str) or not (part.before or part.after):
        return part
    doc = Concat(part.flat, [part])
    doc.before = part.before if before else ()
    doc.after = part.after if after else ()
    return doc


def own_after_first(comments: Sequence[Comment]) -> Sequence[Comment]:
    """Comments of which each stands on a line of its own that comes after one that ends its line."""
    placed: list[Comment] = []
    own = False
    for comment in comments:
        own = own or comment.own_line
        placed.append(comment._replace(own_line=own))
        own = own or comment.ends_line
    return placed


def flat_of(part: Part) -> str | None:
    return part if isinstance(part, str) else part.flat


def joined(parts: Sequence[Part]) -> str | None:
    """The parts on one line; None if they cannot be."""
    flat = ""
    for index, part in enumerate(parts):
        text = flat_of(part)
        if text is None or (index and before_of(part)) or (after_of(part) and index < len(parts) - 1):
            return None
        flat += text
        if len(flat) > WIDTH:
            return None
    return flat


def ends_of(doc: AnyDoc, first: Part, last: Part) -> AnyDoc:
    """``doc`` with the comments before its first part and after its last."""
    if not isinstance(first, str):
        doc.before, doc.blank = first.before, first.blank
    if not isinstance(last, str):
        doc.after = last.after
    return doc
