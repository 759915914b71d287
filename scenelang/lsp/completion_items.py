"""A proposal, and those that stand inside strings and numbers."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from lsprotocol import types

from scenelang.evaluate.vocabulary import Vocabulary
from scenelang.lsp.workspace import Document, Workspace
from scenelang.scene import library
from scenelang.words import UNITS

Kind = types.CompletionItemKind
_MAX_PATHS: Final = 200


@dataclass(frozen=True, slots=True)
class Item:
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
    count = 0
    for where, inner, files in os.walk(folder):
        inner[:] = sorted(name for name in inner if not name.startswith("."))[:20]
        for name in sorted(files):
            path = os.path.join(where, name)
            if name.endswith(".nsg") and path != str(document.path):
                count += 1
                if count > _MAX_PATHS:
                    return
                yield Item(os.path.relpath(path, folder).replace(os.sep, "/"), Kind.File)
