"""Documents of the client, their imports and positions, and the check that runs in the background.

Offsets count code points of the whole text. A check does not touch a `Document`: it gets its input when it
begins and returns one value, so that it may run while the user edits. An open buffer stands for its file.
"""

from __future__ import annotations

import os
import re
import threading
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain
from pathlib import Path, PureWindowsPath
from typing import Any, Final, Literal

from lsprotocol import types
from pygls.uris import from_fs_path, to_fs_path

from scenelang.assets.element_file import SUFFIX, ElementFile, load_element_file
from scenelang.assets.records import Record
from scenelang.assets.tensors import TensorError
from scenelang.compiler.compile import check_compiles, check_frames
from scenelang.compiler.graph import Graph
from scenelang.compiler.manifest import Manifest
from scenelang.language import library, tree
from scenelang.language.definitions import Names, Symbol, Use, find_unused
from scenelang.language.diagnostics import Diagnostic, Diagnostics, Fix, Label, SourceFile, Span, common_start
from scenelang.language.diagnostics import Edit as Change
from scenelang.language.evaluation import Source, in_file_order
from scenelang.language.lexer import Report, Tokens, scan
from scenelang.language.limits import Halt
from scenelang.language.parser import parse
from scenelang.language.session import Unreadable, read_source

Encoding = Literal["utf-8", "utf-16", "utf-32"]
_NEWLINE: Final = re.compile(r"\r\n|\n|\r")


class TextChange(Record):
    """``old[start:old_end]`` became ``new[start:new_end]``; offsets in code points."""

    start: int
    old_end: int
    new_end: int

    @property
    def delta(self) -> int:
        return self.new_end - self.old_end


def difference(old: Sequence[str], new: Sequence[str]) -> TextChange:
    """The shortest single edit from one text, or list of lines, to another."""
    start = common_start(old, new)
    end = common_start(old[start:][::-1], new[start:][::-1])
    return TextChange(start, len(old) - end, len(new) - end)


class Lines:
    """The lines of one text."""

    def __init__(self, text: str, encoding: Encoding = "utf-16") -> None:
        self.text = text
        self.encoding = encoding
        self.starts = [0, *(match.end() for match in _NEWLINE.finditer(text))]
        self._plain = text.isascii()

    def _end(self, line: int) -> int:
        """The offset of a line's end, its newline left out."""
        if line + 1 == len(self.starts):
            return len(self.text)
        end = self.starts[line + 1] - 1
        return end - (self.text[end] == "\n" and end > self.starts[line] and self.text[end - 1] == "\r")

    def offset(self, position: types.Position) -> int:
        """The offset of a position; one past the end of its line or of the text is the end of that."""
        line = position.line
        if line >= len(self.starts):
            return len(self.text)
        start, end = self.starts[max(line, 0)], self._end(max(line, 0))
        wanted = max(position.character, 0)
        if self._plain or self.encoding == "utf-32":
            return min(start + wanted, end)
        units = 0
        for at in range(start, end):
            if units >= wanted:
                return at
            units += width(self.text[at], self.encoding)
            if units > wanted:
                return at  # inside a character: before it
        return end

    def position(self, offset: int) -> types.Position:
        offset = min(max(offset, 0), len(self.text))
        line = bisect_right(self.starts, offset) - 1
        start = self.starts[line]
        if self._plain or self.encoding == "utf-32":
            return types.Position(line, offset - start)
        return types.Position(line, width(self.text[start:offset], self.encoding))

    def range(self, start: int, end: int) -> types.Range:
        return types.Range(self.position(start), self.position(end))

    def span(self, span: Span) -> types.Range:
        """The range of a span of this text."""
        return self.range(span.start, span.end)


def width(text: str, encoding: Encoding) -> int:
    """The number of a text's code units."""
    if encoding == "utf-32" or text.isascii():
        return len(text)
    if encoding == "utf-8":
        return len(text.encode("utf-8", "surrogatepass"))
    return len(text) + sum(character > "\uffff" for character in text)


MAX_SEEN: Final = 4  # values and nodes that are recorded of one place


class Seen(Record, frozen=False):
    """The first few values or nodes of one place in an evaluation, each once, and the number of all."""

    values: list[Any] = field(default_factory=list)
    count: int = 0


class Checked(Record, frozen=False):
    """The result of a check."""

    source: SourceFile
    diagnostics: list[Diagnostic]  # of evaluation and compiler
    wanted: frozenset[Path]  # the files that it imports, also those that are not there
    seen: dict[tuple[str, int, int], Seen]  # by file name, start and end
    manifest: Manifest | None = None  # the model that draws it, where that is known


def check(
    file: tree.File,
    path: Path | None,
    root: Path | None,
    texts: Mapping[Path, str],
    model: str | None,
    parsed: bool,
    stop: threading.Event,
) -> Checked:
    """Evaluate a scene and run the compiler's checks; raises `Halt` where ``stop`` was set meanwhile.

    Imports read ``texts`` of open files and cannot leave ``root``, by default the file's folder. ``parsed``
    says that the text has no syntax mistakes.
    """
    result, frame = Diagnostics(), 0
    seen: dict[tuple[str, int, int], Seen] = {}

    def watch(span: Span, value: Any) -> None:
        if stop.is_set():
            raise Halt
        if frame:
            return
        place = seen.setdefault((span.source.name, span.start, span.end), Seen())
        place.count += 1
        if len(place.values) < MAX_SEEN and not any(value is old for old in place.values):
            place.values.append(value)

    def after(stage: str, graph: Graph | None = None) -> None:
        if stop.is_set():
            raise Halt

    source = Source(path, tree=file, model=model, root=root, texts=texts)
    evaluation = source.evaluation(result, replays=True, watch=watch)
    scene, spans = evaluation.run(0)
    after("evaluate")
    manifest = None
    if parsed:
        find_unused(file, result)
        if scene is not None:
            manifest = check_compiles(scene, spans, result, after=after)
        frame = 1
        check_frames(evaluation, result, first=scene, after=after)
        after("frames")
    wanted = frozenset(evaluation.wanted)
    return Checked(file.span.source, in_file_order(result.items), wanted, seen, manifest)


MAX_PAUSE_MS: Final = 60_000


class ClientSettings(Record):
    """Settings of the client, from ``initializationOptions`` or ``workspace/didChangeConfiguration``."""

    debounce_ms: float = 200.0  # pause in typing after which a scene is evaluated
    model: str | None = None  # draws instead of the scene's
    root: Path | None = None  # the folder that imports cannot leave, instead of the scene's
    value_hints: bool = True
    argument_hints: bool = True

    @classmethod
    def read(cls, options: Any) -> ClientSettings:
        """Read a client's settings; one that is missing, of another type or out of range has its default."""
        given = options.get("scenelang", options) if isinstance(options, dict) else None
        given = given if isinstance(given, dict) else {}
        hints = given.get("inlayHints")
        hints = hints if isinstance(hints, dict) else {}
        pause, model, root = given.get("debounceMs"), given.get("model"), given.get("root")
        if isinstance(pause, bool) or not isinstance(pause, int | float) or not 0 <= pause <= MAX_PAUSE_MS:
            pause = cls().debounce_ms
        return cls(
            debounce_ms=float(pause),
            model=model if isinstance(model, str) and model else None,
            root=Path(root).expanduser() if isinstance(root, str) and root else None,
            value_hints=hints.get("values") is not False,
            argument_hints=hints.get("arguments") is not False,
        )


MAX_FILES: Final = 2000  # of a workspace that are searched for references and symbols
_WHOLE: Final = ("E0104", "E0105", "E0106", "E0115", "E0120", "E0121")  # mistakes that concern a whole text
_MOST_MISTAKES: Final = 50  # with more of them a text is parsed as a whole
MAX_TEXT: Final = 2_000_000
"""Characters of a text that is parsed; its tree, tokens and places take a hundred times as many bytes."""


@dataclass(eq=False)
class Document:
    """A text with its tree and what is known about it."""

    uri: str
    path: Path | None  # resolved; None for a buffer that has none
    source: SourceFile
    version: int | None = None  # the client's number of this text; None for a file that is not open
    encoding: Encoding = "utf-16"
    checked: Checked | None = None  # of the last evaluation that ended, perhaps of an older text
    edits: list[TextChange] = field(default_factory=list)  # since that
    semantic: list[Diagnostic] = field(default_factory=list)  # of that, at their current places
    _known: list[tree.Kept] = field(default_factory=list)  # sound statements that are as they were parsed

    @property
    def name(self) -> str:
        """Its name in messages."""
        return self.path.name if self.path is not None else self.uri

    @property
    def text(self) -> str:
        return self.source.text

    @cached_property
    def lines(self) -> Lines:
        return Lines(self.text, self.encoding)

    @cached_property
    def names(self) -> Names:
        return Names(self.file)

    def names_at(self, offset: int) -> Names:
        """The names in sight of an offset."""
        return Names(self._file(lambda span: span.start <= offset <= span.end), offset)

    @property
    def heads(self) -> list[tree.Stmt]:
        """The statements at top level, perhaps at places of an older text."""
        return [s.stmt if isinstance(s, tree.Kept) else s for s in self._parsed[0].statements]

    @cached_property
    def file(self) -> tree.File:
        return self._file(lambda span: True)

    def _file(self, deep: Callable[[Span], bool]) -> tree.File:
        file = self._parsed[0]
        read = [s.moved(deep(s.span)) if isinstance(s, tree.Kept) else s for s in file.statements]
        return tree.File(file.span, tuple(read))

    @cached_property
    def tokens(self) -> Tokens:
        """The tokens as they stand in the text; none of one that is too long."""
        return self.tokens_to(len(self.text))

    def tokens_to(self, offset: int) -> Tokens:
        """The tokens up to the end of an offset's line."""
        source = SourceFile(self.source.name, "") if len(self.text) > MAX_TEXT else self.source
        stop = source.text.find("\n", offset)
        return scan(source, Report(source), stop if stop >= 0 else len(source.text))

    @property
    def syntax(self) -> tuple[Diagnostic, ...]:
        """All syntax mistakes, in the order of the text."""
        return self._parsed[1]

    @cached_property
    def _parsed(self) -> tuple[tree.File, tuple[Diagnostic, ...]]:
        if len(self.text) > MAX_TEXT:
            size = f"{MAX_TEXT // 1_000_000} MB"
            message = f"a text of more than {size}, which the language server does not read"
            help = "`scenelang check` does, up to 10 MB"
            nowhere = Span(self.source, 0, 0)
            return tree.File(nowhere, ()), (Diagnostic("E0324", message, nowhere, help=help),)
        result = Diagnostics()
        return parse(self.source, result, self._known), tuple(result)

    def change(self, change: types.TextDocumentContentChangeEvent) -> None:
        """Take over one change of the client's."""
        if isinstance(change, types.TextDocumentContentChangePartial):
            start, end = sorted((self.lines.offset(change.range.start), self.lines.offset(change.range.end)))
            text = self.text[:start] + change.text + self.text[end:]
            edit = TextChange(start, end, start + len(change.text))
        else:
            text, edit = change.text, difference(self.text, change.text)
        source = SourceFile(self.source.name, text)
        self._known = self._left(edit, source)
        self.source = source
        self.edits.append(edit)
        self.semantic = [moved for d in self.semantic if (moved := _carried(d, edit, source)) is not None]
        for name in ("_parsed", "file", "lines", "names", "tokens"):
            self.__dict__.pop(name, None)

    def _left(self, edit: TextChange, source: SourceFile) -> list[tree.Kept]:
        """The sound statements that an edit does not touch, at their places after it."""
        known: Sequence[tree.Stmt] = self._known
        if "_parsed" in self.__dict__:
            bad = [d.span for d in self.syntax if d.span is not None and d.code not in _WHOLE]
            sound = len(bad) == len(self.syntax) <= _MOST_MISTAKES
            known = self.__dict__.get("file", self._parsed[0]).statements if sound else ()
            known = [s for s in known if all(b.start > s.span.end or b.end < s.span.start for b in bad)]
        result = []
        for stmt in known:
            if stmt.span.end < edit.start or stmt.span.start > edit.old_end:
                delta = edit.delta if stmt.span.start > edit.old_end else 0
                span = Span(source, stmt.span.start + delta, stmt.span.end + delta)
                result.append(tree.Kept(span, stmt.stmt if isinstance(stmt, tree.Kept) else stmt))
        return result

    def before(self, offset: int) -> int | None:
        """The offset of a place in the text that was checked; None where it has been edited since."""
        for edit in reversed(self.edits):
            if offset >= edit.new_end:
                offset -= edit.delta
            elif offset > edit.start:
                return None
        return offset


def _carried(diagnostic: Diagnostic, edit: TextChange, source: SourceFile) -> Diagnostic | None:
    """A diagnostic after an edit; None where the edit touches it."""

    def carried(span: Span) -> Span | None:
        if span.source.name != source.name:
            return span
        if span.end < edit.start:
            return Span(source, span.start, span.end)
        moved = Span(source, span.start + edit.delta, span.end + edit.delta)
        return moved if span.start > edit.old_end else None

    d = diagnostic
    span = carried(d.span) if d.span is not None else None
    if span is None:
        return None
    labels = [Label(at, label.message) for label in d.labels if (at := carried(label.span)) is not None]

    def moved(fix: Fix | None) -> Fix | None:
        edits = (
            [Change(at, e.replacement) for e in fix.edits if (at := carried(e.span)) is not None]
            if fix
            else []
        )
        return Fix(fix.message, tuple(edits), fix.guess) if fix and len(edits) == len(fix.edits) else None

    return Diagnostic(d.code, d.message, span, tuple(labels), d.help, moved(d.fix), moved(d.guess))


class Workspace:
    """All documents."""

    def __init__(self, encoding: Encoding = "utf-16", folders: list[Path] | None = None) -> None:
        self.encoding = encoding
        self.folders = folders or []
        self.open: dict[str, Document] = {}
        self._closed: dict[Path, tuple[tuple[int, int], Document]] = {}

    def put(self, uri: str, text: str, version: int | None) -> Document:
        """Open a buffer, or open it anew."""
        path = path_of(uri)
        source = SourceFile(str(path) if path is not None else uri, text)
        document = Document(uri, _resolved(path), source, version, self.encoding)
        self.open[uri] = document
        return document

    def get(self, uri: str) -> Document | None:
        """An open buffer, or the file of an address."""
        return self.open.get(uri) or self.by_path(_resolved(path_of(uri)))

    def by_path(self, path: Path | None) -> Document | None:
        """The document of a resolved file: its buffer, or the file on the disk."""
        if path is None:
            return None
        for document in self.open.values():
            if document.path == path:
                return document
        try:
            stat = path.stat()
            stamp = (stat.st_mtime_ns, stat.st_size)
            if (known := self._closed.get(path)) is not None and known[0] == stamp:
                return known[1]
            if not path.is_file():
                return None
            source = read_source(path, str(path))
        except (OSError, Unreadable, ValueError):
            return None
        document = Document(uri_of(path), path, source, None, self.encoding)
        self._closed[path] = (stamp, document)
        return document

    def texts(self) -> dict[Path, str]:
        """The texts of open files, for imports."""
        return {d.path: d.text for d in self.open.values() if d.path is not None}

    def known(self) -> Iterator[Document]:
        """Every document: open ones, then the scenes in the client's folders."""
        yield from list(self.open.values())
        seen = {d.path for d in self.open.values()}
        folders = self.folders or sorted({d.path.parent for d in self.open.values() if d.path is not None})
        for folder in folders:
            for path in map(Path.resolve, scenes_below(folder, MAX_FILES * 10)):
                if path not in seen:
                    seen.add(path)
                    if (document := self.by_path(path)) is not None:
                        yield document

    def imported(self, document: Document, text: str) -> Document | None:
        """The document of an import's path."""
        if library.is_reserved(text):
            return self.by_path(library.find(text))
        return self.by_path(self._place(document, text))

    def zoo(self, document: Document, stmt: tree.Import) -> ElementFile | None:
        """The file of elements that an import brings, if it is one."""
        path = library.find(stmt.path.value) or self._place(document, stmt.path.value)
        if path is None or path.suffix != SUFFIX:
            return None
        try:
            return load_element_file(path)
        except (OSError, TensorError):
            return None

    def _place(self, document: Document, text: str) -> Path | None:
        """The file of a path in a document."""
        folder = document.path.parent if document.path is not None else next(iter(self.folders), None)
        if folder is None or not text or "\0" in text or os.path.isabs(text) or PureWindowsPath(text).drive:
            return None
        return _resolved(folder / text)

    def definition(self, document: Document, use: Use) -> tuple[Document, Symbol] | None:
        """The definition that a use means, with its file, also across imports."""
        if use.role == "argument":
            callee = self.definition(document, use.callee) if use.callee is not None else None
            if callee is None:
                return None
            where, symbol = callee
            return next(((where, p) for p in symbol.params if p.name == use.text), None)
        if use.symbol is None:
            return None
        if use.role not in ("member", "material"):
            return document, use.symbol
        stmt = use.symbol.node
        library = self.imported(document, stmt.path.value) if isinstance(stmt, tree.Import) else None
        if library is None:
            return None
        result = library.names.top.names.get(use.text.partition(".")[0])
        return (library, result) if result is not None and result.is_exported else None

    def uses(self, document: Document, symbol: Symbol) -> Iterator[tuple[Document, Use]]:
        """All uses of a definition, its own place among them."""
        abroad = symbol.is_exported or (symbol.owner is not None and symbol.owner.is_exported)
        others = (other for other in (self.known() if abroad else ()) if other.uri != document.uri)
        for other in chain((document,), others):
            for use in other.names.uses if symbol.name in other.text else ():
                near = use.text == symbol.name and (other is document or use.role in ("member", "argument"))
                if near and (target := self.definition(other, use)) is not None and target[1] is symbol:
                    yield other, use


def scenes_below(folder: Path, most: int) -> Iterator[Path]:
    """The scenes in a folder, hidden folders left out, among its first ``most`` files."""
    count = 0
    for where, inner, files in os.walk(folder):
        inner[:] = sorted(name for name in inner if not name.startswith(".") and name != "node_modules")
        for name in sorted(files):
            count += 1
            if count > most:
                return
            if name.endswith(".nsg"):
                yield Path(where, name)


def path_of(uri: str) -> Path | None:
    """The file of an address; None for buffers that have none."""
    name = to_fs_path(uri) if uri.startswith("file:") else None
    return Path(name) if name and "\0" not in name else None


def uri_of(path: Path) -> str:
    """The address of a file."""
    return str(from_fs_path(str(path)))


def _resolved(path: Path | None) -> Path | None:
    try:
        return path.resolve() if path is not None else None
    except (OSError, RuntimeError, ValueError):
        return None
