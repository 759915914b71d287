"""The names that models offer to a document."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from scenelang.evaluate.vocabulary import Vocabulary, vocabulary
from scenelang.graph.space import Space
from scenelang.graph.spaces import SPACES
from scenelang.syntax import nodes

if TYPE_CHECKING:
    from scenelang.lsp.workspace import Document, Workspace


@cache
def _all() -> Vocabulary:
    return vocabulary()


def vocabulary_of(document: Document, docs: Workspace | None = None) -> Vocabulary:
    """The words of the model that a document names, or those of all models."""
    for stmt in document.parsed.heads():
        if isinstance(stmt, nodes.Model) and isinstance(stmt.name, nodes.String):
            return _all().choose(stmt.name.value) or _all()
    return _all()


def space_of(document: Document) -> Space:
    """The space of the model which draws a document."""
    if document.checked is not None and document.checked.manifest is not None:
        return SPACES[document.checked.manifest.dimension]
    return SPACES[vocabulary_of(document).dimension or 2]
