"""The library that ships, `std/…`, and the places where nodes of a Scene were written.

A path ``std/shapes`` means a file of this package wherever it is written. A user's own file of that name is
``./std/shapes``; one with a suffix, ``std/shapes.nsg``, is always the user's.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import field
from pathlib import Path
from typing import Final, NamedTuple

from scenelang.assets.records import Record
from scenelang.language import foreign
from scenelang.language.diagnostics import Edit, Fix, SourceFile, Span
from scenelang.language.scopes import outwards

SHAPES: Final = "std/shapes"
SOLIDS: Final = "std/solids"
_CALLS: Final = {SHAPES: foreign.SHAPES, SOLIDS: foreign.SOLIDS}
"""Calls of the shapes of each file, by many names in small letters."""
_FOLDER: Final = Path(__file__).resolve().parent / "std"
_RESERVED: Final = re.compile(r"std/[A-Za-z0-9_]+")
_SUFFIXES: Final = (".nsg", ".safetensors")
_FILES: Final = {f"std/{path.stem}": path for path in _FOLDER.iterdir() if path.suffix in _SUFFIXES}


def is_reserved(text: str) -> bool:
    """Test whether an import's path is reserved for the library, whether it has such a file or not."""
    return _RESERVED.fullmatch(text) is not None


def names() -> list[str]:
    """Names of the files that can be imported."""
    return sorted(_FILES)


def find(text: str) -> Path | None:
    """The file that a name of the library means; None where it means none."""
    return _FILES.get(text)


def owns(path: Path) -> bool:
    """Test whether a resolved path is a file of the library."""
    return path.parent == _FOLDER


def called(name: str) -> str:
    """Name of a library file in diagnostics and Programs, wherever it is installed."""
    return f"<{name}>"


def holds(source: SourceFile) -> bool:
    """Test whether a text is a file of the library."""
    return source.name.startswith("<std/")


def shapes_of(source: SourceFile) -> Mapping[str, str]:
    """How the shapes of a file of the library are called, by many names in small letters."""
    return _CALLS.get(source.name.strip("<>"), {})


def having(name: str) -> list[str]:
    """Names of the files of the library with a module of some name."""
    files = {**_CALLS, "std/letters": {"text": "text(text)"}}
    return [file for file, calls in files.items() if any(c.startswith(f"{name}(") for c in calls.values())]


def misfit(call: str, fact: str) -> str:
    """The message of a mistake in the library, told where that is called."""
    return f"the arguments of `{call}` do not fit: {fact}"


def meant(text: str, span: Span) -> tuple[str | None, Fix | None]:
    """Help and fix for the path of a file that is not there, if the library's was meant."""
    name = text.removeprefix("./").removesuffix(".nsg").removesuffix(".safetensors")
    if name not in names():
        return None, None
    return f"the library that ships is `{name}`", Fix(f"write `{name}`", (Edit(span, f'"{name}"'),))


class Written(NamedTuple):
    """The two spans of a node: its heading name or keyword, and its whole statement."""

    name: Span
    statement: Span


class Calls(NamedTuple):
    """The module and function calls that led somewhere, innermost first."""

    span: Span
    parent: Calls | None

    def outwards(self) -> Iterator[Span]:
        """The places of the calls."""
        return (call.span for call in outwards(self))

    def outside(self) -> Span | None:
        """The innermost call that is not written in the library."""
        return next((call for call in self.outwards() if not holds(call.source)), None)


class SpanMap(Record, frozen=False):
    """Spans of a Scene's nodes, transforms and materials, for the very objects that the evaluator made."""

    # by `id`: each node, so that no other can come by that `id`, and the name or keyword that heads it
    _known: dict[int, tuple[object, Span]] = field(default_factory=dict)
    main: SourceFile | None = None  # the file of the scene, where it is text

    def record(self, node: object, written: Written, calls: Calls | None = None) -> None:
        """Remember where ``node`` was written: of what the library makes, where it is called."""
        outside = calls.outside() if calls is not None and holds(written.name.source) else None
        self._known[id(node)] = node, outside or written.name

    def copy(self, old: object, new: object) -> None:
        """``new`` stands for ``old``, which an outer block has added to."""
        self._known[id(new)] = new, self._known[id(old)][1]

    def add(self, other: SpanMap) -> None:
        """Take over all that ``other`` knows."""
        self._known.update(other._known)

    def span(self, node: object) -> Span | None:
        """The name or keyword that heads the statement of ``node``: what a caret points at."""
        known = self._known.get(id(node))
        return known[1] if known else None

    def __len__(self) -> int:
        return len(self._known)
