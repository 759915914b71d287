"""The printer: chooses line breaks and writes the lines of a document."""

from __future__ import annotations

from collections.abc import Sequence

from scenelang.formatting.documents import (
    INDENT,
    WIDTH,
    Blank,
    Break,
    Comments,
    Concat,
    Fill,
    Group,
    Indent,
    Part,
)


def render(doc: Part, width: int = WIDTH) -> list[str]:
    """The lines of a document."""
    printer = _Printer(width)
    printer.print(doc)
    return printer.finish()


class _Printer:
    """Writes lines.

    A line's margin is settled by the break that began it. `ended` says that a comment has been written
    after which nothing may stand on the same line.
    """

    def __init__(self, width: int) -> None:
        self.width = width
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
            elif isinstance(part, Blank):
                self.newline(margin)
                self.lines.append("")
            elif part.flat is not None and self.fits(part.flat, margin, stack):
                self.write(part.flat, margin)
            elif isinstance(part, Concat):
                stack += [(margin, inner) for inner in reversed(part.parts)]
            elif isinstance(part, Group):
                stack.append((margin, part.broken()))
            elif isinstance(part, Indent):
                stack.append((margin + INDENT, part.part))
            elif isinstance(part, Comments):
                self.comments(part, margin)
            elif isinstance(part, Fill):
                self.fill(part, margin)
            elif part.flat is not None:
                self.write(part.flat, margin)

    def finish(self) -> list[str]:
        if self.line:
            self.newline(0)
        return self.lines

    def newline(self, margin: int) -> None:
        self.lines.append(self.line.rstrip(" "))
        self.line = ""
        self.margin = margin
        self.ended = False

    def write(self, text: str, margin: int) -> None:
        if self.ended:
            text = text.lstrip(" ")
            if not text:
                return
            self.newline(margin + INDENT)
        if self.line:
            self.line += text
        elif text:
            self.line = " " * self.margin + text

    def fits(self, flat: str, margin: int, stack: Sequence[tuple[int, Part]]) -> bool:
        """Whether a text fits on the line, and what comes up to the next place to break too."""
        column = margin + INDENT if self.ended else len(self.line) or self.margin
        room = self.width - column - len(flat)
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
            if index and len(self.line) + 2 + len(text) > self.width:
                self.newline(margin)
            self.write(f" {text}," if self.line else f"{text},", margin)


def _shifted(line: str, shift: int | None) -> str:
    """A further line of a block comment that has moved by some columns."""
    text = line.lstrip(" ")
    if shift is None or not text or text.startswith("\t"):
        return line
    return " " * max(len(line) - len(text) + shift, 0) + text


def _reach(stack: Sequence[tuple[int, Part]], room: int) -> int:
    """How many columns follow before the line can break; may stop counting beyond ``room``."""
    used = 0
    for _, top in reversed(stack):
        todo = [top]
        while todo:
            part = todo.pop()
            if isinstance(part, str):
                used += len(part)
            elif isinstance(part, (Break, Blank, Comments)):
                return used
            elif isinstance(part, Concat):
                todo += reversed(part.parts)
            elif isinstance(part, Group):
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
