"""Diagnostics of ours as those of the protocol, and changes of the text: their fixes, and formatting."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import SequenceMatcher
from functools import cache
from pathlib import Path
from typing import Final

from lsprotocol import types

from scenelang.diagnostics import pages
from scenelang.diagnostics.diagnostic import Diagnostic
from scenelang.diagnostics.fixes import apply_fixes
from scenelang.diagnostics.pages import CODES
from scenelang.diagnostics.span import Span
from scenelang.lsp.text import Lines, difference
from scenelang.lsp.workspace import Document, uri_of


def to_location(span: Span, document: Document) -> types.Location:
    """A span of any file as a place for the client."""
    name = span.source.name
    if name == document.source.name:
        return types.Location(document.uri, document.lines.span(span))
    uri = uri_of(Path(name)) if Path(name).is_absolute() else name
    return types.Location(uri, Lines(span.source.text, document.encoding).span(span))


def to_diagnostic(diagnostic: Diagnostic, document: Document) -> types.Diagnostic | None:
    """A diagnostic for the client; one of an imported file stands at what led there, if this file did."""
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
        source="scenelang",
        tags=[types.DiagnosticTag.Unnecessary] if d.code == "W0201" else None,
        related_information=related or None,
    )


def _import_of(name: str, document: Document) -> Span | None:
    """The import statement that brings a file, or the first one where it is brought by another."""
    from scenelang.syntax import nodes

    imports = [stmt for stmt in document.file.statements if isinstance(stmt, nodes.Import)]
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


FIX_ALL: Final = "source.fixAll.scenelang"
_MOST_LINES: Final = 4000  # of a difference that is looked at line by line


def code_actions(
    document: Document, place: types.Range, only: Sequence[str] | None
) -> list[types.CodeAction]:
    """What may be done about the mistakes in a range: of the kinds asked for, or of all."""
    lines = document.lines
    start, end = lines.offset(place.start), lines.offset(place.end)
    found = [*document.syntax, *document.semantic]
    here = [
        d
        for d in found
        if d.span is not None
        and d.span.source.name == document.source.name
        and lines.position(d.span.start).line <= lines.position(end).line
        and lines.position(d.span.end).line >= lines.position(start).line
    ]
    actions = []
    if _wants(only, types.CodeActionKind.QuickFix):
        near = [d for d in here if d.span is not None and d.span.start <= end and d.span.end >= start]
        actions += [_quick(document, d, d in near) for d in here if _is_ours(document, d)]
    if _wants(only, FIX_ALL):
        actions += _fix_all(document, found)
    return actions


def _wants(only: Sequence[str] | None, kind: str) -> bool:
    """Whether a kind is asked for; `source` asks for `source.fixAll` too."""
    if not only:
        return True
    return any(kind == asked or kind.startswith(f"{getattr(asked, 'value', asked)}.") for asked in only)


def _is_ours(document: Document, d: Diagnostic) -> bool:
    return d.fix is not None and all(e.span.source.name == document.source.name for e in d.fix.edits)


def _quick(document: Document, d: Diagnostic, preferred: bool) -> types.CodeAction:
    assert d.fix is not None
    edits = [types.TextEdit(document.lines.span(e.span), e.replacement) for e in d.fix.edits]
    shown = to_diagnostic(d, document)
    return types.CodeAction(
        title=d.fix.message[:1].upper() + d.fix.message[1:],
        kind=types.CodeActionKind.QuickFix,
        diagnostics=[shown] if shown is not None else None,
        is_preferred=preferred,
        edit=types.WorkspaceEdit(changes={document.uri: edits}),
    )


def _fix_all(document: Document, found: Sequence[Diagnostic]) -> list[types.CodeAction]:
    text, done = apply_fixes(document.text, [d for d in found if _is_ours(document, d)])
    if not done or text == document.text:
        return []
    title = f"Fix all {len(done)} mistakes with a safe fix" if len(done) > 1 else "Fix the mistake"
    edit = types.WorkspaceEdit(changes={document.uri: text_edits(document, text)})
    return [types.CodeAction(title, kind=FIX_ALL, edit=edit)]


# ---------------------------------------------------------------- formatting


def formatted(document: Document, place: types.Range | None = None) -> list[types.TextEdit]:
    """The edits that lay a text out in the canonical way, or the statements that a range touches.

    Raises:
        SceneError: the text has syntax errors.
    """
    from scenelang.formatting import format_range, format_text

    text, name = document.text, document.source.name
    if place is None:
        return text_edits(document, format_text(text, name=name))
    low, high = document.lines.offset(place.start), document.lines.offset(place.end)
    start, end, new = format_range(text, low, high, name=name)
    return text_edits(document, text[:start] + new + text[end:])


def text_edits(document: Document, text: str) -> list[types.TextEdit]:
    """Few small edits that make the text ``text``, so that cursors and folds stay where they are."""
    old, new = document.text.splitlines(keepends=True), text.splitlines(keepends=True)
    starts = [0]
    for line in old:
        starts.append(starts[-1] + len(line))
    edit = difference(old, new)
    head, inner_old, inner_new = edit.start, old[edit.start : edit.old_end], new[edit.start : edit.new_end]
    if len(inner_old) + len(inner_new) > _MOST_LINES:
        blocks = [(0, len(inner_old), 0, len(inner_new))]
    else:
        matcher = SequenceMatcher(None, inner_old, inner_new, autojunk=False)
        blocks = [(a, b, c, d) for tag, a, b, c, d in matcher.get_opcodes() if tag != "equal"]
    lines = document.lines
    return [
        types.TextEdit(lines.range(starts[head + a], starts[head + b]), "".join(inner_new[c:d]))
        for a, b, c, d in blocks
    ]
