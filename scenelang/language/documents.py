"""Documents: text with places where lines may break, comments, and the printer that chooses among them.

A comment is printed where the rule that attached it attaches it again: that makes formatting idempotent.

After Philip Wadler, *A prettier printer*, in The Fun of Programming (2003): a group is printed on one line if
it fits, otherwise its own line breaks are taken and the groups inside are tried. Two things are different:
every document knows its text on one line beforehand, and keeps the comments at its ends apart from itself.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import field
from typing import Final, NamedTuple, TypeVar

from scenelang.assets.records import Record
from scenelang.language.lexer import Tokens
from scenelang.language.tables import tables

_COMMENT = re.compile(r"//[^\n]*|/\*(?:[\s\S]*?\*/|[\s\S]*)")


class Comment(NamedTuple):
    text: str  # from its first sign to its last, trailing white space of its lines taken off
    column: int | None  # code points before it on its line, if it has several lines and no tabs stand there
    ends_line: bool  # nothing may follow it on its last line: it is a line comment or has several lines
    own_line: bool = False  # it stands on lines of its own
    blank: bool = False  # a blank line stands before it


def texts_of(comments: Iterable[Comment]) -> list[str]:
    return [comment.text for comment in comments]


class Notes(Record, frozen=False):
    """Comments and blank lines around one token."""

    before: list[Comment] = field(default_factory=list)  # comments on lines of their own before it
    leading: Sequence[Comment] = ()  # block comments before it on its line
    trailing: Sequence[Comment] = ()  # block comments after it on its line, which need not end there
    after: list[Comment] = field(default_factory=list)  # comments behind it after which its line must end
    blank: bool = False  # a blank line stands right before it, or before its leading comments


def attach(tokens: Tokens) -> dict[int, Notes]:
    """The notes of every token that has any, by index; those of the end of the text go with the last one."""
    text = tokens.source.text
    notes: dict[int, Notes] = {}
    end = 0
    for index, start in enumerate(tokens.starts):
        if start - end > 1:
            gap = text[end:start]
            if "/" in gap or gap.count("\n") > 1:
                _attach(tokens, notes, index, *_read(text, end, start))
        end = tokens.ends[index]
    return notes


def comments_of(tokens: Tokens) -> list[str]:
    """The texts of all comments, in order, without the white space at the ends of their lines."""
    text = tokens.source.text
    comments: list[str] = []
    end = 0
    for start, stop in zip(tokens.starts, tokens.ends, strict=True):
        if start - end > 1:
            comments += ["\n".join(map(str.strip, c.split("\n"))) for c in _COMMENT.findall(text, end, start)]
        end = stop
    return comments


def _attach(
    tokens: Tokens, notes: dict[int, Notes], index: int, comments: list[Comment], newlines: list[int]
) -> None:
    """Note what stands between the token before ``index`` and that token."""
    before, kind = (tables().kinds[tokens.kinds[at]] for at in (index - 1, index))
    closes = kind in ("$END", ")", "]", "}", ",", ";")
    here = notes.setdefault(index, Notes())
    behind = 0  # so many stand on the line of the token before
    while index and behind < len(comments) and not newlines[behind]:
        behind += 1
        if comments[behind - 1].ends_line:
            break
    ahead = len(comments)  # the first of those on the line of the token
    while not closes and ahead > behind and not newlines[ahead] and not comments[ahead - 1].ends_line:
        ahead -= 1
    here.blank = newlines[ahead] > 1
    for comment, lines in zip(comments[behind:ahead], newlines[behind:], strict=False):
        here.before.append(comment._replace(own_line=True, blank=lines > 1))
    here.leading = comments[ahead:]
    if last := comments[:behind]:
        if last[-1].ends_line or ahead > behind:
            notes.setdefault(index - 1, Notes()).after += last
        elif closes or (newlines[behind] and before in (",", ";", "{", "}")):
            notes.setdefault(index - 1, Notes()).trailing = last
        else:
            here.leading = [*last, *here.leading]
            here.blank = False


def _read(text: str, start: int, end: int) -> tuple[list[Comment], list[int]]:
    """The comments between two places, and how many newlines stand before each and after the last."""
    comments: list[Comment] = []
    newlines: list[int] = []
    at = start
    for match in _COMMENT.finditer(text, start, end):
        begins = match.start()
        newlines.append(text.count("\n", at, begins))
        at = match.end()
        words = "\n".join(line.rstrip() for line in match[0].split("\n"))
        several = "\n" in words
        line = text[text.rfind("\n", 0, begins) + 1 : begins]
        column = len(line) if several and "\t" not in line else None
        comments.append(Comment(words, column, several or words.startswith("//")))
    newlines.append(text.count("\n", at, end))
    return comments, newlines


WIDTH: Final = 100
"""Columns of a line, where breaking lines can achieve that."""
INDENT: Final = 2

AnyDoc = TypeVar("AnyDoc", bound="Doc")


class Doc:
    __slots__ = ("after", "before", "blank", "flat")

    def __init__(self, flat: str | None) -> None:
        self.flat = flat  # its text on one line; None if it cannot be on one or is wider than any
        self.before: Sequence[Comment] = ()  # on lines of their own before it
        self.after: Sequence[Comment] = ()  # behind it; the line must end there
        self.blank = False  # a blank line stands before it, after the comments of `before`


Part = Doc | str
"""A bare string is a short text that never breaks, without comments around it."""


class DocText(Doc):
    """Text that stands as it is, with comments around it."""

    __slots__ = ()
    flat: str


class Break(Doc):
    """Line break, taken once the group around it does not fit."""

    __slots__ = ()


class Concat(Doc):
    __slots__ = ("parts",)

    def __init__(self, flat: str | None, parts: Sequence[Part]) -> None:
        super().__init__(flat)
        self.parts = parts


class DocGroup(Doc):
    """Document on one line if it fits, otherwise that of ``maker``, which is called at most once."""

    __slots__ = ("_made", "maker")

    def __init__(self, flat: str | None, maker: Callable[[], Part]) -> None:
        super().__init__(flat)
        self.maker = maker
        self._made: Part | None = None

    def broken(self) -> Part:
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
    """Comments after which the line ends; ``inside`` something, what follows them is indented."""

    __slots__ = ("comments", "inside")

    def __init__(self, comments: Sequence[Comment], inside: bool = False) -> None:
        super().__init__(None)
        self.comments = comments
        self.inside = inside


LINE: Final = Break(" ")
SOFT: Final = Break("")
BLANK: Final = Break(None)
"""Breaks the line always, and a blank one follows."""


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


# ---------------------------------------------------------------- printing


def render(doc: Part) -> list[str]:
    printer = _Printer()
    printer.print(doc)
    if printer.line:
        printer.newline(0)
    return printer.lines


class _Printer:
    """Writes lines; nothing may stand on the line of a comment that has ``ended`` it."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.line = ""
        self.margin = 0
        self.ended = False

    def print(self, doc: Part) -> None:
        # An explicit stack: documents nest deeper than Python likes to recurse.
        stack: list[tuple[int, Part]] = [(0, doc)]
        while stack:
            margin, part = stack.pop()
            if isinstance(part, str):
                self.write(part, margin)
            elif isinstance(part, Break):
                self.newline(margin)
                if part is BLANK:
                    self.lines.append("")
            elif part.flat is not None and self.fits(part.flat, margin, stack):
                self.write(part.flat, margin)
            elif isinstance(part, Concat):
                stack += [(margin, inner) for inner in reversed(part.parts)]
            elif isinstance(part, DocGroup):
                stack.append((margin, part.broken()))
            elif isinstance(part, Indent):
                stack.append((margin + INDENT, part.part))
            elif isinstance(part, Comments):
                self.comments(part, margin)
            elif isinstance(part, Fill):
                self.fill(part, margin)
            elif part.flat is not None:
                self.write(part.flat, margin)

    def newline(self, margin: int) -> None:
        self.lines.append(self.line.rstrip(" "))
        self.line = ""
        self.margin = margin
        self.ended = False

    def write(self, text: str, margin: int) -> None:
        if self.ended:
            if not (text := text.lstrip(" ")):
                return
            self.newline(margin + INDENT)
        if self.line:
            self.line += text
        elif text:
            self.line = " " * self.margin + text

    def fits(self, flat: str, margin: int, stack: Sequence[tuple[int, Part]]) -> bool:
        """Test whether a text, and what follows it up to the next break, fits on the line."""
        column = margin + INDENT if self.ended else len(self.line) or self.margin
        room = WIDTH - column - len(flat)
        return room >= 0 and _reach(stack, room) <= room

    def comments(self, doc: Comments, margin: int) -> None:
        follows = False  # another comment that does not end its line
        for comment in doc.comments:
            if self.line and not comment.own_line and follows:
                self.line += " "
            elif comment.own_line or self.ended:
                if self.line:
                    self.newline(margin + INDENT if doc.inside else margin)
            elif self.line:
                self.line = self.line.rstrip(" ") + ("  " if comment.text.startswith("//") else " ")
            follows = not comment.ends_line
            if not self.line:
                self.line = " " * self.margin
            head, *rest = comment.text.split("\n")
            shift = None if comment.column is None else len(self.line) - comment.column
            self.line += head
            for line in rest:
                self.lines.append(self.line)
                self.line = _shifted(line, shift)
            self.ended = True

    def fill(self, doc: Fill, margin: int) -> None:
        for index, text in enumerate(doc.texts):
            if index and len(self.line) + 2 + len(text) > WIDTH:
                self.newline(margin)
            self.write(f" {text}," if self.line else f"{text},", margin)


def _shifted(line: str, shift: int | None) -> str:
    """A further line of a block comment that has moved by some columns."""
    text = line.lstrip(" ")
    if shift is None or not text or text.startswith("\t"):
        return line
    return " " * max(len(line) - len(text) + shift, 0) + text


def _reach(stack: Sequence[tuple[int, Part]], room: int) -> int:
    """Number of columns before the line can break; may stop counting beyond ``room``."""
    used = 0
    for _, top in reversed(stack):
        todo = [top]
        while todo:
            part = todo.pop()
            if isinstance(part, str):
                used += len(part)
            elif isinstance(part, (Break, Comments)):
                return used
            elif isinstance(part, Concat):
                todo += reversed(part.parts)
            elif isinstance(part, DocGroup):
                todo.append(part.broken())
            elif isinstance(part, Indent):
                todo.append(part.part)
            elif isinstance(part, Fill):
                used += len(part.texts[0]) + 1 if part.texts else 0
                return used
            elif part.flat is not None:
                used += len(part.flat)
            if used > room:
                return used
    return used
