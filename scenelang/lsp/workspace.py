"""Documents: the buffers that the client has open, the files they import, and how both are called.

An open buffer counts for its file, on the disk or not yet. Files that are not open are read when asked for,
again when they have changed.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path, PureWindowsPath
from typing import TYPE_CHECKING, Final

from pygls.uris import from_fs_path, to_fs_path

from scenelang.diagnostics.diagnostic import Diagnostic, Diagnostics, Fix, Label
from scenelang.diagnostics.diagnostic import Edit as Change
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.elements.zoo import SUFFIX, Zoo, load_zoo
from scenelang.evaluate.loader import Unreadable, read_source
from scenelang.lsp.text import Edit, Encoding, Lines, applied
from scenelang.resolve.names import Names, Symbol, Use
from scenelang.scene import library
from scenelang.syntax import nodes, parse
from scenelang.syntax.lexer import Report, Tokens, scan
from scenelang.tensors import TensorError

if TYPE_CHECKING:
    from lsprotocol import types

    from scenelang.lsp.check import Checked

MAX_FILES: Final = 2000  # of a workspace that are searched for references and symbols
MAX_TEXT: Final = 2_000_000
"""Characters of a text that is parsed; its tree, tokens and places take a hundred times as many bytes."""


@dataclass(eq=False)
class Document:
    """A text with its tree and what is known about it.

    Args:
        uri: what the client calls it.
        path: its resolved file; None for a buffer that has none.
        version: the client's number of this text; None for a file that is not open.
        checked: the last evaluation that ended, perhaps of an older text.
        edits: what has been edited since that.
        semantic: what it found, at the places of now.
    """

    uri: str
    path: Path | None
    source: SourceFile
    version: int | None = None
    encoding: Encoding = "utf-16"
    checked: Checked | None = None
    edits: list[Edit] = field(default_factory=list)
    semantic: list[Diagnostic] = field(default_factory=list)

    @property
    def name(self) -> str:
        """What messages call it."""
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

    @property
    def file(self) -> nodes.File:
        """The tree."""
        return self._parsed[0]

    @cached_property
    def tokens(self) -> Tokens:
        """The tokens as they stand in the text; none of one that is too long."""
        source = SourceFile(self.source.name, "") if self._is_too_long else self.source
        return scan(source, Report(source))

    @property
    def syntax(self) -> tuple[Diagnostic, ...]:
        """All syntax mistakes, in the order of the text."""
        return self._parsed[1]

    @property
    def _is_too_long(self) -> bool:
        return len(self.text) > MAX_TEXT

    @cached_property
    def _parsed(self) -> tuple[nodes.File, tuple[Diagnostic, ...]]:
        if self._is_too_long:
            message = (
                f"a text of more than {MAX_TEXT // 1_000_000} MB, which the language server does not read"
            )
            help = "`scenelang check` does, up to 10 MB"
            nowhere = Span(self.source, 0, 0)
            return nodes.File(nowhere, ()), (Diagnostic("E0324", message, nowhere, help=help),)
        found = Diagnostics()
        return parse(self.source, found), tuple(found)

    def change(self, change: types.TextDocumentContentChangeEvent) -> None:
        """Take over one change of the client's."""
        text, edit = applied(self.lines, change)
        source = SourceFile(self.source.name, text)
        self.source = source
        self.edits.append(edit)
        self.semantic = [moved for d in self.semantic if (moved := _carried(d, edit, source)) is not None]
        for name in ("_parsed", "lines", "names", "tokens"):
            self.__dict__.pop(name, None)

    def before(self, offset: int) -> int | None:
        """Where a place stood in the text that was checked; None where it has been edited since."""
        for edit in reversed(self.edits):
            if offset >= edit.new_end:
                offset -= edit.delta
            elif offset > edit.start:
                return None
        return offset


def _carried(diagnostic: Diagnostic, edit: Edit, source: SourceFile) -> Diagnostic | None:
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
    fix = None
    if d.fix is not None:
        edits = [Change(at, e.replacement) for e in d.fix.edits if (at := carried(e.span)) is not None]
        fix = Fix(d.fix.message, tuple(edits)) if len(edits) == len(d.fix.edits) else None
    return Diagnostic(d.code, d.message, span, tuple(labels), d.help, fix)


class Workspace:
    """All documents."""

    def __init__(self, encoding: Encoding = "utf-16", folders: list[Path] | None = None) -> None:
        self.encoding = encoding
        self.folders = folders or []
        self.open: dict[str, Document] = {}
        self._closed: dict[Path, tuple[tuple[int, int], Document]] = {}

    # ------------------------------------------------------------ the client's buffers

    def put(self, uri: str, text: str, version: int | None) -> Document:
        """Open a buffer, or open it anew."""
        path = path_of(uri)
        source = SourceFile(str(path) if path is not None else uri, text)
        document = Document(uri, _resolved(path), source, version, self.encoding)
        self.open[uri] = document
        return document

    def get(self, uri: str) -> Document | None:
        """An open buffer, or the file that the address means."""
        return self.open.get(uri) or self.by_path(_resolved(path_of(uri)))

    def by_path(self, path: Path | None) -> Document | None:
        """The document of a resolved file: its buffer, or what is on the disk."""
        if path is None:
            return None
        for document in self.open.values():
            if document.path == path:
                return document
        try:
            stat = path.stat()
            stamp = (stat.st_mtime_ns, stat.st_size)
            known = self._closed.get(path)
            if known is not None and known[0] == stamp:
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
        """What open files hold, for imports."""
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
                    document = self.by_path(path)
                    if document is not None:
                        yield document

    # ------------------------------------------------------------ names across files

    def imported(self, document: Document, text: str) -> Document | None:
        """The document that an import's path means."""
        if library.is_reserved(text):
            return self.by_path(library.find(text))
        return self.by_path(self._place(document, text))

    def zoo(self, document: Document, stmt: nodes.Import) -> Zoo | None:
        """The file of elements that an import brings, if it is one."""
        path = library.find(stmt.path.value) or self._place(document, stmt.path.value)
        if path is None or path.suffix != SUFFIX:
            return None
        try:
            return load_zoo(path)
        except (OSError, TensorError):
            return None

    def _place(self, document: Document, text: str) -> Path | None:
        """The file that a path in a document means."""
        folder = document.path.parent if document.path is not None else next(iter(self.folders), None)
        if folder is None or not text or "\0" in text or os.path.isabs(text) or PureWindowsPath(text).drive:
            return None
        return _resolved(folder / text)

    def definition(self, document: Document, use: Use) -> tuple[Document, Symbol] | None:
        """Where what a use means is defined, over as many files as it takes."""
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
        library = self.imported(document, stmt.path.value) if isinstance(stmt, nodes.Import) else None
        if library is None:
            return None
        found = library.names.top.symbols.get(use.text.partition(".")[0])
        return (library, found) if found is not None and found.is_exported else None

    def uses(self, document: Document, symbol: Symbol) -> Iterator[tuple[Document, Use]]:
        """Every place that means a definition; its own is among them."""
        for use in document.names.uses:
            target = self.definition(document, use) if use.text == symbol.name else None
            if target is not None and target[1] is symbol:
                yield document, use
        if not (symbol.is_exported or (symbol.owner is not None and symbol.owner.is_exported)):
            return
        for other in self.known():
            if other.uri == document.uri or symbol.name not in other.text:
                continue
            for use in other.names.uses:
                if use.text != symbol.name or use.role not in ("member", "argument"):
                    continue
                target = self.definition(other, use)
                if target is not None and target[1] is symbol:
                    yield other, use


def scenes_below(folder: Path, most: int) -> Iterator[Path]:
    """The scenes in a folder, hidden folders left out; so many files are looked at."""
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
