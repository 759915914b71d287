"""Reading files, and which files the imports of a scene may read."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path, PureWindowsPath
from typing import Any, Final

from scenelang.diagnostics.diagnostic import Fix, Label
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.diagnostics.suggest import listing
from scenelang.elements.zoo import SUFFIX, Zoo, load_zoo
from scenelang.evaluate.limits import MAX_BYTES
from scenelang.evaluate.session import Session
from scenelang.files import read_regular
from scenelang.records import Record
from scenelang.scene import library
from scenelang.syntax import nodes, parse
from scenelang.tensors import TensorError

MAX_IMPORTS: Final = 1000
MAX_IMPORT_DEPTH: Final = 100
_RELATIVE: Final = "paths are relative to the importing file"
Labels = tuple[Label, ...]


class Unreadable(Exception):
    """A file that is not scene text, or not one to read; the message says why."""

    def __init__(
        self, code: str, message: str, help: str | None = None, fix: Fix | None = None, labels: Labels = ()
    ) -> None:
        super().__init__(message)
        self.code, self.help, self.fix, self.labels = code, help, fix, labels


def read_source(path: Path, name: str) -> SourceFile:
    """The text of a file.

    Raises:
        Unreadable: too large, or not UTF-8.
        OSError: as the system says, or that it is not a regular file.
    """
    return decode_source(read_regular(path, MAX_BYTES), name)


def decode_source(data: bytes, name: str) -> SourceFile:
    """The text that a file's bytes are.

    Raises:
        Unreadable: more than `MAX_BYTES`, or not UTF-8.
    """
    if len(data) > MAX_BYTES:
        raise Unreadable("E0324", f"a file of more than {MAX_BYTES // 1_000_000} MB")
    try:
        return SourceFile(name, data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise Unreadable("E0214", f"it is not UTF-8 text: byte {error.start}") from None


class Loader(Record, frozen=False):
    """Finds imported files inside the import root.

    Args:
        root: the folder that imports cannot leave, resolved; None where there is none.
        texts: what to read instead of some files, by their resolved paths: an editor's unsaved buffers, or
            fixes that are not written yet.
    """

    root: Path | None
    chain: list[Path] = field(default_factory=list)
    sites: list[Span] = field(default_factory=list)
    """Where the imports of that chain are written."""
    parsed: dict[Path, nodes.File] = field(default_factory=dict)
    prepared: dict[Path, Any] = field(default_factory=dict)
    """The `FileContext` of each file that has been prepared, under its last name."""
    repeated: int = 0
    """Characters of files that were prepared again, as params of theirs have another name each time."""
    zoos: dict[Path, Zoo] = field(default_factory=dict)
    wanted: dict[Path, None] = field(default_factory=dict)
    """All files that were asked for inside the root, there or not, as written and resolved."""
    count: int = 0
    texts: Mapping[Path, str] = field(default_factory=dict)

    def load(
        self, stmt: nodes.Import, importer: Path | None, session: Session
    ) -> tuple[Path, nodes.File | Zoo] | None:
        """The file that an import in the file ``importer`` means, parsed; None after a report."""
        span = stmt.path.span
        try:
            path = self._locate(stmt.path.value, importer)
            if path in self.chain:
                self._refuse_cycle(path)
            self.count += 1
            if self.count > MAX_IMPORTS:
                raise session.halt("E0324", f"more than {MAX_IMPORTS:,} imports", span)
            if len(self.chain) > MAX_IMPORT_DEPTH:
                raise session.halt("E0324", f"imports nested deeper than {MAX_IMPORT_DEPTH}", span)
            if path.suffix == SUFFIX:
                if path not in self.zoos:
                    self.zoos[path] = self._read_zoo(path, stmt.path.value)
                return path, self.zoos[path]
            if path not in self.parsed:
                self.parsed[path] = parse(self._read(path, stmt.path), session.report.diagnostics)
        except Unreadable as error:
            fix, labels = error.fix, error.labels
            session.report.error(error.code, str(error), span, help=error.help, fix=fix, labels=labels)
            return None
        return path, self.parsed[path]

    def _refuse_cycle(self, path: Path) -> None:
        first = self.chain.index(path)
        names = " → ".join(p.name for p in [*self.chain[first:], path])
        # The first file of the chain, unless it is standard input, was not imported.
        around = self.sites[max(0, first + 1 - len(self.chain) + len(self.sites)) :]
        labels = tuple([Label(site, "which imports this") for site in around])
        raise Unreadable("E0216", f"import cycle: {names}", labels=labels)

    def _locate(self, text: str, importer: Path | None) -> Path:
        """The place of a file of the library, or inside the root."""
        if library.is_reserved(text):
            shipped = library.find(text)
            if shipped is None:
                help = f"it has {listing(library.names())}; a file of your own is `./{text}`"
                raise Unreadable("E0214", f"the library has no `{text}`", help)
            return shipped
        folder = importer.parent if importer is not None else self.root
        if folder is None or self.root is None:
            help = "load the scene from a file, or give a root"
            raise Unreadable("E0214", "text without a folder cannot import", help)
        if not text or "\0" in text:
            raise Unreadable("E0214", "an import path without a file name")
        if os.path.isabs(text) or PureWindowsPath(text).drive or text[0] in "/\\":
            raise Unreadable("E0215", f"`{text}` is an absolute path", _RELATIVE)
        try:
            path = (folder / text).resolve()
        except (OSError, RuntimeError, ValueError) as error:
            raise Unreadable("E0214", f"cannot read `{text}`: {_reason(error)}") from None
        if not path.is_relative_to(self.root):
            help = f"imports stay inside {self.root}; --root sets another folder"
            raise Unreadable("E0215", f"`{text}` lies outside the import root", help)
        self.wanted.update({Path(os.path.abspath(folder / text)): None, path: None})
        return path

    def _read_zoo(self, path: Path, text: str) -> Zoo:
        try:
            return load_zoo(path)
        except TensorError as error:
            help = "`scenelang learn` makes files of elements"
            raise Unreadable("E0217", f"`{text}` is not a file of elements: {error}", help) from None
        except OSError as error:
            raise Unreadable("E0214", f"cannot read `{text}`: {_reason(error)}") from None

    def _read(self, path: Path, written: nodes.String) -> SourceFile:
        text, span = written.value, written.span
        name = os.path.normpath(os.path.join(os.path.dirname(span.source.name), text))
        if library.is_reserved(text):
            name = library.called(text)
        try:
            return SourceFile(name, self.texts[path]) if path in self.texts else read_source(path, name)
        except Unreadable as error:
            raise Unreadable(error.code, f"cannot read `{text}`: {error}") from None
        except OSError as error:
            help, fix = library.meant(text, span)
            raise Unreadable("E0214", f"cannot read `{text}`: {_reason(error)}", help, fix) from None


def _reason(error: BaseException) -> str:
    """What the system says, lower case."""
    return (getattr(error, "strerror", None) or str(error) or "unreadable").lower()
