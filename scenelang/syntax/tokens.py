"""What lexing gives and recovery edits: three parallel lists, and the mistakes found so far."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from scenelang.diagnostics.diagnostic import Diagnostic, Diagnostics, Edit, Fix, Label
from scenelang.diagnostics.fixes import removal
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.syntax.tables import tables

MAX_MISTAKES = 200
"""After so many the rest of a file is not reported: it is not a scene."""

Token = tuple[int, int, int]
"""Kind, start and end."""


class Report:
    """The mistakes of one file, in the order of finding; at most `MAX_MISTAKES`."""

    def __init__(self, source: SourceFile) -> None:
        self.source = source
        self.found: list[Diagnostic] = []
        self.full = False

    def add(
        self,
        code: str,
        message: str,
        start: int,
        end: int,
        *,
        labels: Iterable[Label] = (),
        help: str | None = None,
        fix: Fix | str | None = None,
    ) -> None:
        """Record a mistake at ``[start, end)``; a fix that is text takes the place of what is there."""
        if self.full:
            return
        if len(self.found) == MAX_MISTAKES:
            self.full = True
            code, message, labels, fix = "E0121", f"more than {MAX_MISTAKES} syntax mistakes", (), None
            help = "the rest of the file was not checked"
        if isinstance(fix, str):
            fix = self.change(start, end, fix)
        self.found.append(Diagnostic(code, message, Span(self.source, start, end), tuple(labels), help, fix))

    def change(self, start: int, end: int, text: str, message: str | None = None) -> Fix:
        """A fix that puts a text in the place of ``[start, end)``."""
        if not text:
            return removal(self.source, start, end)
        usual = f"{'insert' if start == end else 'write'} `{text.strip()}`"
        return Fix(message or usual, (Edit(Span(self.source, start, end), text),))

    def flush(self, diagnostics: Diagnostics) -> None:
        """Hand everything over, in the order of the text."""
        for d in sorted(self.found, key=lambda d: d.span.start if d.span is not None else 0):
            diagnostics.add(d.code, d.message, d.span, labels=d.labels, help=d.help, fix=d.fix)


class Tokens:
    """Tokens as parallel lists of kinds, starts and ends; the last one is the end of the text.

    A token that recovery put in is empty (``start == end``).
    """

    __slots__ = ("cut", "ends", "kinds", "reported", "source", "starts")

    def __init__(self, source: SourceFile) -> None:
        self.source = source
        self.kinds: list[int] = []  # indices into `Tables.kinds`
        self.starts: list[int] = []  # offsets of first code points
        self.ends: list[int] = []  # offsets after the last ones
        self.reported: set[int] = set()  # where tokens and characters begin whose mistake is reported
        self.cut = False  # the text ends inside a comment, so what it lacks is not a further mistake

    def append(self, kind: int, start: int, end: int) -> None:
        self.kinds.append(kind)
        self.starts.append(start)
        self.ends.append(end)

    def text(self, index: int) -> str:
        """The text of one token."""
        return self.source.text[self.starts[index] : self.ends[index]]

    def place(self, first: int, stop: int = 0) -> tuple[int, int]:
        """Start and end of a token, or of those before ``stop``."""
        return self.starts[first], self.ends[(stop or first + 1) - 1]

    def end_before(self, index: int) -> int:
        """Where the token before ``index`` ends: where something missing belongs."""
        return self.ends[index - 1] if index else 0

    def on_new_line(self, index: int) -> bool:
        """Whether a token is the first of its line."""
        return index == 0 or "\n" in self.source.text[self.ends[index - 1] : self.starts[index]]

    def replace(self, index: int, count: int, kinds: Sequence[int]) -> None:
        """Put tokens of other kinds in the place of ``count`` tokens.

        A token that takes the place of another keeps it; otherwise new ones are empty and stand where the
        first old one began, or at the end of the token before where none goes.
        """
        if len(kinds) == count == 1:
            self.kinds[index] = kinds[0]
            return
        at = self.starts[index] if count else self.end_before(index)
        self.splice(index, index + count, [(kind, at, at) for kind in kinds])

    def part(self, first: int, stop: int) -> list[Token]:
        """Kinds, starts and ends of the tokens ``[first, stop)``."""
        columns = (self.kinds[first:stop], self.starts[first:stop], self.ends[first:stop])
        return list(zip(*columns, strict=True))

    def splice(self, first: int, stop: int, new: Sequence[Token]) -> None:
        """Put others in the place of the tokens ``[first, stop)``."""
        for number, column in enumerate((self.kinds, self.starts, self.ends)):
            column[first:stop] = [token[number] for token in new]

    def give_up(self, first: int, stop: int, name: str, start: int, end: int) -> None:
        """Put one token that stands for what cannot be read in the place of some."""
        self.splice(first, stop, [(tables().kind(name), start, end)])

    def drop(self, indices: Sequence[int]) -> None:
        """Take out any number of tokens at once."""
        gone = set(indices)
        for column in (self.kinds, self.starts, self.ends):
            column[:] = [value for index, value in enumerate(column) if index not in gone]
