"""A proposal, and those that stand inside strings and numbers."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from itertools import islice
from typing import Final

from lsprotocol import types

from scenelang.evaluate.vocabulary import Vocabulary
from scenelang.lsp.workspace import Document, Workspace, scenes_below
from scenelang.records import Record
from scenelang.scene import library
from scenelang.words import UNITS

Kind = types.CompletionItemKind
_MOST_PATHS: Final = 200
_MOST_FILES: Final = 2000


class Item(Record):
    """A proposal.

    Args:
        label: what the list shows.
        kind: its icon.
        text: what is inserted; the label without it.
        rank: one letter; what is likelier comes first.
        detail: a line beside the label.
        about: Markdown.
        snippet: whether ``text`` has placeholders.
    """

    label: str
    kind: Kind
    text: str = ""
    rank: str = "m"
    detail: str = ""
    about: str = ""
    snippet: bool = False


def units(typed: str) -> Iterator[Item]:
    """Units that a number may be getting."""
    number = re.match(r"[0-9]*\.?[0-9]*", typed)
    if number is None or not number[0] or number[0] == ".":
        return
    rest = typed[number.end() :]
    for unit in UNITS:
        if rest and unit.startswith(rest):
            yield Item(f"{number[0]}{unit}", Kind.Unit)


def strings(
    docs: Workspace, document: Document, words: Vocabulary, before: tuple[str, ...]
) -> Iterator[Item]:
    """What a string may say: a model's name, a file to import."""
    if before == ("model",):
        for manifest in words.models:
            yield Item(manifest.name, Kind.Module, about=manifest.summary)
    elif before == ("import",):
        yield from _paths(docs, document)


def _paths(docs: Workspace, document: Document) -> Iterator[Item]:
    """Scenes that can be imported: the library's, and those below the import root."""
    yield from (Item(name, Kind.File, rank="a") for name in library.names())
    folder = document.path.parent if document.path is not None else next(iter(docs.folders), None)
    if folder is None:
        return
    for path in islice(scenes_below(folder, _MOST_FILES), _MOST_PATHS):
        if path != document.path:
            yield Item(os.path.relpath(path, folder).replace(os.sep, "/"), Kind.File)
