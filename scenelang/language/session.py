"""One evaluation: limits, names, files that it may read, and what it shares.

A running file, function or module has one list of slots; slot 0 of a call's is the list it was defined in.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field
from pathlib import Path, PureWindowsPath
from typing import Any, Final, Literal

from scenelang.assets.element_file import SUFFIX, ElementFile, load_element_file
from scenelang.assets.files import read_regular, reason
from scenelang.assets.records import Record
from scenelang.assets.tensors import TensorError
from scenelang.language import library, scopes, tree
from scenelang.language.diagnostics import Diagnostics, Fix, Label, SourceFile, Span, listing, nearest
from scenelang.language.library import SpanMap
from scenelang.language.limits import MAX_BYTES, MAX_OBJECTS, MAX_PARTS, MAX_STEPS, Halt
from scenelang.language.nodes import Unsaid
from scenelang.language.parser import parse
from scenelang.language.reporter import Reporter
from scenelang.language.scene import Animation, Elements

Env = list[Any]

UNBOUND: Final = object()
"""Value of a slot before its ``let``, ``param`` or ``animate`` has run."""


class Needs(Record, frozen=False):
    """Dependencies of a statement, or of the body of a function or module."""

    frame: bool = False  # it reads ``t``, ``u`` or ``frame`` itself
    on: list[Needs] = field(default_factory=list)  # the needs of the names in it

    def varies(self) -> bool:
        """Test whether it may differ from frame to frame; ask when everything is prepared."""
        seen, stack = {self}, [self]
        while stack:
            needs = stack.pop()
            if needs.frame:
                return True
            stack += [other for other in needs.on if other not in seen]
            seen.update(needs.on)
        return False


class Slots(Record, frozen=False):
    """The slots of a file, or of one call of a function or module."""

    parent: Slots | None = None  # those of where it was defined; None for a file
    root: Env | None = None  # a file's live slots, which exist while it is prepared; None for a call
    owner: Span | None = None  # the name of the function or module that is called
    size: int = 1

    def add(self) -> int:
        self.size += 1
        if self.root is not None:
            self.root.append(UNBOUND)
        return self.size - 1


class Definition(Record, frozen=False):
    """A fn or module: what calls refer to; ``run`` is set once its body is prepared."""

    node: tree.Fn | tree.Module
    outer: Slots  # those of where it was defined
    run: Any = None  # of a fn ``run(env) -> value``; of a module its block's actions
    defaults: tuple[Any, ...] = ()  # how to get each parameter's default
    size: int = 1  # number of slots of a call
    weight: int = 1  # evaluation steps of one call
    needs: Needs = field(default_factory=Needs)  # what its body depends on besides its arguments


class Binding(Record, frozen=False):
    """Meaning of a name: a `Definition`, a file, an element's name or the value of a constant ``let``."""

    kind: Literal[
        "let", "param", "argument", "loop", "fn", "module", "import", "element", "text", "width", "poison"
    ]
    span: Span | None = None  # None for the language's own names
    slots: Slots | None = None  # what holds its slot
    slot: int = 0
    value: Any = None
    known: bool = False  # whether ``value`` is that of a ``let``
    needs: Needs | None = None  # what the value of a ``let`` depends on

    @property
    def node(self) -> tree.Fn | tree.Module | None:
        """The statement of a fn or module."""
        return self.value.node if isinstance(self.value, Definition) else None

    def labels(self, words: str = "defined here") -> tuple[Label, ...]:
        """A label for its definition, if that has a place."""
        return () if self.span is None else (Label(self.span, words),)


class Scope(Record, frozen=False):
    """The names of one block, and the block around it."""

    slots: Slots
    parent: Scope | None = None
    names: dict[str, Binding] = field(default_factory=dict)
    later: dict[str, Span] = field(default_factory=dict)  # names that a later line of this block defines

    outwards, find = scopes.outwards, scopes.find

    def visible(self) -> Iterator[tuple[str, Binding]]:
        """All names that can be used here, inner ones first."""
        for scope in self.outwards():
            yield from scope.names.items()

    def reach(self, slots: Slots) -> Callable[[Env], Env]:
        """Function that gets the live ``slots``, which enclose this scope, from those of here."""
        if (root := slots.root) is not None:
            return lambda env: root
        hops, at = 0, self.slots
        while at is not slots:
            assert at.parent is not None
            hops, at = hops + 1, at.parent

        def outer(env: Env) -> Env:
            for _ in range(hops):
                env = env[0]
            return env

        return outer


Watch = Callable[[Span, Any], None]
"""Callback of an editor that watches; it may raise `Halt` to end the evaluation."""


class Settings(Record, frozen=False):
    """Settings of the top level, and the place of each."""

    canvas: tuple[int, int] = (256, 256)  # width and height in pixels
    background: tuple[float, float, float] | Unsaid | None = "default"  # as written; None for transparency
    samples: int = 4  # of a pixel
    stage: dict[str, Any] = field(default_factory=dict)  # of the words of `STAGE` what is stated
    animation: Animation | None = None
    model: str | None = None
    given: dict[str, list[Span]] = field(default_factory=dict)  # the places of each setting, by its word


class Session(Record, frozen=False):
    """The state of one evaluation over all its files."""

    report: Reporter
    expressions: Mapping[type, Callable[..., Any]]  # how each class of the syntax tree is prepared
    statements: Mapping[type, Callable[..., Any]]
    frame: int = 0  # the one that is run, from 0
    fps: float | None = None  # frames a second, instead of those that ``animate`` names
    spans: SpanMap = field(default_factory=SpanMap)
    steps: int = 0
    objects: int = 0
    parts: int = 0
    depth: int = 0
    node_depth: int = 0
    animated: list[Any] = field(default_factory=lambda: [UNBOUND] * 4)
    settings: Settings = field(default_factory=Settings)
    replays: bool = False  # run what no frame changes once; the evaluation is for several frames
    roots: list[list[Any]] = field(default_factory=list)  # the live slots of every file
    needs: Needs = field(default_factory=Needs)  # of the statement being prepared
    elements: dict[Path, Elements] = field(default_factory=dict)  # files that were imported, by place
    zeros: dict[tuple[SourceFile, Span], Span] = field(default_factory=dict)  # angles of 0 that may change
    still: bool = False  # it has been said that there is no animation for time to run in
    watch: Watch | None = None  # shown each name's value and each statement's node

    def restart(self, frame: int) -> None:
        """Forget what the last run left, to run what is prepared for another frame."""
        self.frame = frame
        self.spans = SpanMap()
        self.steps = self.objects = self.parts = self.depth = self.node_depth = 0
        self.report.calls = None
        self.settings = Settings(given=self.settings.given, model=self.settings.model)
        for root in self.roots:
            root[:] = [UNBOUND] * len(root)

    def halt(self, code: str, message: str, span: Span, help: str | None = None) -> Halt:
        """Report a limit that was met; the caller raises what this returns."""
        self.report.error(code, message, span, help=help)
        return Halt()

    def tick(self, steps: int, span: Span) -> None:
        self.steps += steps
        if self.steps > MAX_STEPS:
            raise self.halt("E0322", f"more than {MAX_STEPS:,} evaluation steps", span)

    def count_parts(self, parts: int, span: Span) -> None:
        """Count nodes, transforms and operations that a Scene will hold."""
        self.parts += parts
        if self.parts > MAX_PARTS:
            raise self.halt("E0320", f"more than {MAX_PARTS:,} nodes and transforms in one scene", span)

    def count_objects(self, number: int, span: Span) -> None:
        """Count objects that a Scene will hold."""
        self.objects += number
        if self.objects > MAX_OBJECTS:
            raise self.halt("E0320", f"more than {MAX_OBJECTS:,} objects in one scene", span)


class Defines(Record, frozen=False):
    """Values for params from outside, and the params that files have."""

    values: Mapping[str, Any]  # text as after ``-D NAME=``, or a Python value
    known: dict[str, Span] = field(default_factory=dict)  # each param's place, by its name in the first file
    lost: set[str] = field(default_factory=set)  # words that recovery skipped: perhaps params

    def report_unused(self, diagnostics: Diagnostics) -> None:
        """Report values that no param takes."""
        for name in self.values:
            if name in self.known or name in self.lost:
                continue
            if result := nearest(name, self.known):
                help, labels = f"did you mean `{result}`?", [Label(self.known[result], "this param")]
            else:
                names = listing(self.known)
                help, labels = f"its params are {names}" if names else "the scene has no params", []
            diagnostics.add("E0211", f"no param `{name}` to set", None, help=help, labels=labels)


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
    """The text of a file; raises OSError, also for no regular file, and as `decode_source`."""
    return decode_source(read_regular(path, MAX_BYTES), name)


def decode_source(data: bytes, name: str) -> SourceFile:
    """The text that a file's bytes are; raises `Unreadable` for too many, or no UTF-8."""
    if len(data) > MAX_BYTES:
        raise Unreadable("E0324", f"a file of more than {MAX_BYTES // 1_000_000} MB")
    try:
        return SourceFile(name, data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise Unreadable("E0214", f"it is not UTF-8 text: byte {error.start}") from None


class Loader(Record, frozen=False):
    """Finds imported files inside the import root."""

    root: Path | None  # the folder that imports cannot leave, resolved
    chain: list[Path] = field(default_factory=list)
    sites: list[Span] = field(default_factory=list)  # places of the imports of that chain
    parsed: dict[Path, tree.File] = field(default_factory=dict)
    prepared: dict[Path, Any] = field(default_factory=dict)  # each file's `FileContext`, under its last name
    repeated: int = 0  # characters of files prepared again, as their params have another name each time
    zoos: dict[Path, ElementFile] = field(default_factory=dict)
    wanted: dict[Path, None] = field(default_factory=dict)  # files asked for, there or not
    count: int = 0
    texts: Mapping[Path, str] = field(default_factory=dict)  # instead of files, by their resolved paths

    def load(
        self, stmt: tree.Import, importer: Path | None, session: Session
    ) -> tuple[Path, tree.File | ElementFile] | None:
        """The file that an import in the file ``importer`` means, parsed; None after a report."""
        span = stmt.path.span
        try:
            path = self._locate(stmt.path.value, importer)
            if path in self.chain:
                first = self.chain.index(path)
                names = " → ".join(p.name for p in [*self.chain[first:], path])
                # The first file of the chain, unless it is standard input, was not imported.
                around = self.sites[max(0, first + 1 - len(self.chain) + len(self.sites)) :]
                labels = tuple([Label(site, "which imports this") for site in around])
                raise Unreadable("E0216", f"import cycle: {names}", labels=labels)
            self.count += 1
            if self.count > MAX_IMPORTS:
                raise session.halt("E0324", f"more than {MAX_IMPORTS:,} imports", span)
            if len(self.chain) > MAX_IMPORT_DEPTH:
                raise session.halt("E0324", f"imports nested deeper than {MAX_IMPORT_DEPTH}", span)
            self._read(path, stmt.path, session)
        except Unreadable as error:
            code, fix, labels = error.code, error.fix, error.labels
            session.report.error(code, str(error), span, help=error.help, fix=fix, labels=labels)
            return None
        return path, self.zoos.get(path) or self.parsed[path]

    def _locate(self, text: str, importer: Path | None) -> Path:
        if library.is_reserved(text):
            if (shipped := library.find(text)) is None:
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
            raise Unreadable("E0214", f"cannot read `{text}`: {reason(error)}") from None
        if not path.is_relative_to(self.root):
            help = f"imports stay inside {self.root}; --root sets another folder"
            raise Unreadable("E0215", f"`{text}` lies outside the import root", help)
        self.wanted.update({Path(os.path.abspath(folder / text)): None, path: None})
        return path

    def _read(self, path: Path, written: tree.String, session: Session) -> None:
        text, span = written.value, written.span
        if path in self.parsed or path in self.zoos:
            return
        name = os.path.normpath(os.path.join(os.path.dirname(span.source.name), text))
        name = library.called(text) if library.is_reserved(text) else name
        try:
            if path.suffix == SUFFIX:
                self.zoos[path] = load_element_file(path)
                return
            source = SourceFile(name, self.texts[path]) if path in self.texts else read_source(path, name)
        except TensorError as error:
            help = "`scenelang learn` makes files of elements"
            raise Unreadable("E0217", f"`{text}` is not a file of elements: {error}", help) from None
        except Unreadable as error:
            raise Unreadable(error.code, f"cannot read `{text}`: {error}") from None
        except OSError as error:
            meant = (None, None) if path.suffix == SUFFIX else library.meant(text, span)
            raise Unreadable("E0214", f"cannot read `{text}`: {reason(error)}", *meant) from None
        self.parsed[path] = parse(source, session.report.diagnostics)
