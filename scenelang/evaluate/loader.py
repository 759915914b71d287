"""Reading files, and which files the imports of a scene may read."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path, PureWindowsPath
from typing import Final

from scenelang.diagnostics.diagnostic import Label
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.diagnostics.suggest import listing
from scenelang.evaluate.limits import MAX_BYTES
from scenelang.evaluate.session import Session
from scenelang.files import read_regular
from scenelang.records import Record
from scenelang.scene import library
from scenelang.syntax import nodes, parse

MAX_IMPORTS: Final = 1000
MAX_IMPORT_DEPTH: Final = 100


class Unreadable(Exception):
    """A file that is not scene text; the message says why."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


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
    wanted: dict[Path, None] = field(default_factory=dict)
    """All files that were asked for inside the root, there or not, as written and resolved."""
    count: int = 0
    texts: Mapping[Path, str] = field(default_factory=dict)

    def find(self, stmt: nodes.Import, importer: Path | None, session: Session) -> Path | None:
        """The file that an import in the file ``importer`` means; None after a report."""
        span = stmt.path.span
        path = self._locate(stmt.path, importer, session)
        if path is None:
            return None
        if path in self.chain:
            names = " → ".join(p.name for p in [*self.chain[self.chain.index(path) :], path])
            # The first file of the chain, unless it is standard input, was not imported.
            around = self.sites[max(0, self.chain.index(path) + 1 - len(self.chain) + len(self.sites)) :]
            labels = tuple([Label(site, "which imports this") for site in around])
            session.report.error("E0216", f"import cycle: {names}", span, labels=labels)
            return None
        self.count += 1
        if self.count > MAX_IMPORTS:
            raise session.halt("E0324", f"more than {MAX_IMPORTS:,} imports", span)
        if len(self.chain) > MAX_IMPORT_DEPTH:
            raise session.halt("E0324", f"imports nested deeper than {MAX_IMPORT_DEPTH}", span)
        return path

    def _locate(self, written: nodes.String, importer: Path | None, session: Session) -> Path | None:
        """The place of a file of the library, or inside the root; None after a report."""
        span, text = written.span, written.value
        if library.is_reserved(text):
            shipped = library.find(text)
            if shipped is None:
                help = f"it has {listing(library.names())}; a file of your own is `./{text}`"
                session.report.error("E0214", f"the library has no `{text}`", span, help=help)
            return shipped
        folder = importer.parent if importer is not None else self.root
        if folder is None or self.root is None:
            help = "load the scene from a file, or give a root"
            session.report.error("E0214", "text without a folder cannot import", span, help=help)
            return None
        if not text or "\0" in text:
            session.report.error("E0214", "an import path without a file name", span)
            return None
        if os.path.isabs(text) or PureWindowsPath(text).drive or text[0] in "/\\":
            help = "paths are relative to the importing file"
            session.report.error("E0215", f"`{text}` is an absolute path", span, help=help)
            return None
        try:
            path = (folder / text).resolve()
        except (OSError, RuntimeError, ValueError) as error:
            session.report.error("E0214", f"cannot read `{text}`: {_reason(error)}", span)
            return None
        if not path.is_relative_to(self.root):
            help = f"imports stay inside {self.root}; --root sets another folder"
            session.report.error("E0215", f"`{text}` lies outside the import root", span, help=help)
            return None
        self.wanted.update({Path(os.path.abspath(folder / text)): None, path: None})
        return path

    def read(self, path: Path, stmt: nodes.Import, session: Session) -> nodes.File | None:
        """The parsed file; None after a report."""
        if path in self.parsed:
            return self.parsed[path]
        text, span = stmt.path.value, stmt.path.span
        if library.is_reserved(text):
            name = library.called(text)
        else:
            name = os.path.normpath(os.path.join(os.path.dirname(span.source.name), text))
        try:
            given = self.texts.get(path)
            source = read_source(path, name) if given is None else SourceFile(name, given)
        except Unreadable as error:
            session.report.error(error.code, f"cannot read `{text}`: {error}", span)
            return None
        except OSError as error:
            help, fix = library.meant(text, span)
            session.report.error("E0214", f"cannot read `{text}`: {_reason(error)}", span, help=help, fix=fix)
            return None
        file = parse(source, session.report.diagnostics)
        self.parsed[path] = file
        return file


def _reason(error: BaseException) -> str:
    """What the system says, lower case."""
    return (getattr(error, "strerror", None) or str(error) or "unreadable").lower()
