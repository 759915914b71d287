"""Diagnostics of ours as those of the protocol."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

from lsprotocol import types

from scenelang.diagnostics import pages
from scenelang.diagnostics.diagnostic import Diagnostic
from scenelang.diagnostics.pages import CODES
from scenelang.diagnostics.span import Span
from scenelang.lsp.text import Lines
from scenelang.lsp.workspace import uri_of

if TYPE_CHECKING:
    from scenelang.lsp.workspace import Document

SOURCE: Final = "scenelang"
_UNUSED: Final = frozenset({"W0201"})


def name_to_uri(name: str, document: Document) -> str:
    """The address of a file by what its source is called."""
    if name == document.source.name:
        return document.uri
    return uri_of(Path(name)) if Path(name).is_absolute() else name


def to_location(span: Span, document: Document) -> types.Location:
    """A span of any file as a place for the client."""
    if span.source.name == document.source.name:
        return types.Location(document.uri, document.lines.span(span))
    lines = Lines(span.source.text, document.encoding)
    return types.Location(name_to_uri(span.source.name, document), lines.span(span))


def to_diagnostic(diagnostic: Diagnostic, document: Document) -> types.Diagnostic | None:
    """A diagnostic for the client; one of an imported file stands at what led there.

    Returns:
        None where nothing of this file has to do with it.
    """
    d, name = diagnostic, document.source.name
    message = d.message if d.help is None else f"{d.message}\nhelp: {d.help}"
    related = [
        types.DiagnosticRelatedInformation(to_location(label.span, document), label.message)
        for label in d.labels
        if label.span.source.name == name or Path(label.span.source.name).is_absolute()
    ]
    if d.span is None:
        place = document.lines.range(0, 0)
    elif d.span.source.name == name:
        place = document.lines.span(d.span)
    else:
        here = next((label.span for label in d.labels if label.span.source.name == name), None)
        where = here or _import_of(d.span.source.name, document)
        if where is None:
            return None
        place = document.lines.span(where)
        message = f"in `{Path(d.span.source.name).name}`: {message}"
        related.insert(0, types.DiagnosticRelatedInformation(to_location(d.span, document), d.message))
    return types.Diagnostic(
        range=place,
        message=message,
        severity=types.DiagnosticSeverity.Error
        if d.severity == "error"
        else types.DiagnosticSeverity.Warning,
        code=d.code,
        code_description=_description(d.code),
        source=SOURCE,
        tags=[types.DiagnosticTag.Unnecessary] if d.code in _UNUSED else None,
        related_information=related or None,
    )


def _import_of(name: str, document: Document) -> Span | None:
    """The import statement that brings a file, or the first one where it is brought by another."""
    from scenelang.syntax import nodes

    imports = [stmt for stmt in document.parsed.file.statements if isinstance(stmt, nodes.Import)]
    for stmt in imports:
        if name.endswith(Path(stmt.path.value).name):
            return stmt.path.span
    return imports[0].path.span if imports else None


@cache
def _description(code: str) -> types.CodeDescription | None:
    """The page that explains a code; it ships with the package, so it needs no network."""
    if code not in CODES:
        return None
    page = Path(pages.__file__).with_name(f"{code}.md")
    return types.CodeDescription(uri_of(page)) if page.is_file() else None
