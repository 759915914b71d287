"""The language server: one client's session, its checks, diagnostics, fixes, formatting, and its answers.

Syntax is checked at once, in the loop that reads messages. Evaluation waits until the typing pauses and runs
on a thread of its own; its result is dropped where the text has changed meanwhile.
"""

from __future__ import annotations

import asyncio
import logging
import sys
import threading
from base64 import b64encode
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from difflib import SequenceMatcher
from functools import cache
from importlib.metadata import version
from itertools import accumulate
from pathlib import Path
from typing import Any, Final

from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol
from pygls.protocol.language_server import lsp_method

from scenelang.assets.element import Element
from scenelang.editors import completion, context, navigation
from scenelang.editors.workspace import (
    Checked,
    ClientSettings,
    Document,
    Lines,
    Workspace,
    check,
    difference,
    path_of,
    uri_of,
)
from scenelang.language import pages, tree
from scenelang.language.diagnostics import Diagnostic, Span, apply_fixes
from scenelang.language.limits import Halt
from scenelang.language.reports import SceneError


def to_location(span: Span, document: Document) -> types.Location:
    """A span of any file as a place for the client."""
    name = span.source.name
    if name == document.source.name:
        return types.Location(document.uri, document.lines.span(span))
    uri = uri_of(Path(name)) if Path(name).is_absolute() else name
    return types.Location(uri, Lines(span.source.text, document.encoding).span(span))


def to_diagnostic(diagnostic: Diagnostic, document: Document) -> types.Diagnostic | None:
    """A diagnostic for the client; one of an imported file is placed at the import, None without one."""
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
        imports = [stmt.path for stmt in document.file.statements if isinstance(stmt, tree.Import)]
        named = [path for path in imports if d.span.source.name.endswith(Path(path.value).name)]
        if here is None and not imports:
            return None
        where = here or [*named, *imports][0].span
        place = document.lines.span(where)
        message = f"in `{Path(d.span.source.name).name}`: {message}"
        related.insert(0, types.DiagnosticRelatedInformation(to_location(d.span, document), d.message))
    return types.Diagnostic(
        range=place,
        message=message,
        severity=types.DiagnosticSeverity[d.severity.capitalize()],
        code=d.code,
        code_description=_description(d.code),
        source="scenelang",
        tags=[types.DiagnosticTag.Unnecessary] if d.code == "W0201" else None,
        related_information=related or None,
    )


@cache
def _description(code: str) -> types.CodeDescription | None:
    """The page that explains a code; it ships with the package, so it needs no network."""
    page = Path(pages.__file__).with_name(f"{code}.md")
    return types.CodeDescription(uri_of(page)) if page.is_file() else None


FIX_ALL: Final = "source.fixAll.scenelang"
_MOST_LINES: Final = 4000  # of a difference that is compared line by line


def code_actions(
    document: Document, place: types.Range, only: Sequence[str] | None
) -> list[types.CodeAction]:
    """Code actions for the mistakes in a range: of the kinds asked for, or of all."""

    def wanted(kind: str) -> bool:  # `source` asks for `source.fixAll` too
        prefixes = [f"{getattr(asked, 'value', asked)}." for asked in only or ()]
        return not only or kind in only or kind.startswith(tuple(prefixes))

    lines, actions = document.lines, []
    start, end = lines.offset(place.start), lines.offset(place.end)
    first, last = lines.position(start).line, lines.position(end).line
    result = [*document.syntax, *document.semantic]
    for d in result if wanted(types.CodeActionKind.QuickFix) else ():
        if d.span is None or d.span.source.name != document.source.name or not _is_ours(document, d):
            continue
        if lines.position(d.span.start).line <= last and lines.position(d.span.end).line >= first:
            actions.append(_quick(document, d, d.span.start <= end and d.span.end >= start))
    if wanted(FIX_ALL):
        text, done = apply_fixes(document.text, [d for d in result if _is_ours(document, d)])
        if done and text != document.text:
            title = f"Fix all {len(done)} mistakes with a safe fix" if len(done) > 1 else "Fix the mistake"
            edit = types.WorkspaceEdit(changes={document.uri: text_edits(document, text)})
            actions.append(types.CodeAction(title, kind=FIX_ALL, edit=edit))
    return actions


def _is_ours(document: Document, d: Diagnostic) -> bool:
    fix = d.fix or d.guess
    return fix is not None and all(e.span.source.name == document.source.name for e in fix.edits)


def _quick(document: Document, d: Diagnostic, preferred: bool) -> types.CodeAction:
    fix = d.fix or d.guess
    assert fix is not None
    edits = [types.TextEdit(document.lines.span(e.span), e.replacement) for e in fix.edits]
    shown, title = to_diagnostic(d, document), fix.message[:1].upper() + fix.message[1:]
    edit, kind = types.WorkspaceEdit(changes={document.uri: edits}), types.CodeActionKind.QuickFix
    return types.CodeAction(title, kind, [shown] if shown else None, preferred, edit=edit)


def text_edits(document: Document, text: str) -> list[types.TextEdit]:
    """Few small edits that make the text ``text``, so that cursors and folds stay where they are."""
    old, new = document.text.splitlines(keepends=True), text.splitlines(keepends=True)
    starts = [*accumulate(map(len, old), initial=0)]
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


log = logging.getLogger("scenelang.lsp")
_DEEP: Final = 10_000  # trees are up to 200 levels deep, walks take a few calls a level
MAX_DRAWN: Final = 100  # thumbnails that are cached


def _plain(method: str) -> Any:
    """A method of the protocol that only calls the handler."""

    def handle(self: Protocol, params: Any) -> Any:
        yield self.fm.features[method], (params,), None

    return lsp_method(method)(handle)


class Protocol(LanguageServerProtocol):
    """pygls's protocol without its own copies of documents, which split lines by other rules."""

    def structure_message(self, data: dict[str, Any]) -> Any:
        """A message from its JSON; a request that the protocol does not have is answered by an error."""
        try:
            return super().structure_message(data)
        except JsonRpcException as error:
            if "id" in data and "method" in data:
                self._send_response(data["id"], error=error.to_response_error())
            raise

    lsp_text_document__did_open = _plain(types.TEXT_DOCUMENT_DID_OPEN)
    lsp_text_document__did_change = _plain(types.TEXT_DOCUMENT_DID_CHANGE)
    lsp_text_document__did_close = _plain(types.TEXT_DOCUMENT_DID_CLOSE)


class Server(LanguageServer):
    """One client, its documents, and the checks that run for it."""

    def __init__(self, draw: Callable[[Element], bytes] | None = None) -> None:
        super().__init__("scenelang", version("scenelang"), protocol_cls=Protocol)
        self.docs = Workspace()
        self._draw = draw
        self._drawn: dict[str, str] = {}  # results of `thumbnail`, by digest
        self.settings = ClientSettings()
        self.was_shut_down = False
        self._timers: dict[str, asyncio.TimerHandle] = {}
        self._running: dict[str, threading.Event] = {}
        self._pool = ThreadPoolExecutor(1, "check")

    def begin(self, params: types.InitializeParams) -> None:
        """Take over the client's encoding, folders and settings."""
        sys.setrecursionlimit(max(sys.getrecursionlimit(), _DEEP))
        encoding = str(getattr(self.workspace.position_encoding, "value", self.workspace.position_encoding))
        folders = [path_of(folder.uri) for folder in params.workspace_folders or ()]
        if not folders and params.root_uri:
            folders = [path_of(params.root_uri)]
        known = [folder.resolve() for folder in folders if folder is not None]
        self.docs = Workspace(encoding, known)  # type: ignore[arg-type]
        self.settings = ClientSettings.read(params.initialization_options)

    def thumbnail(self, element: Element) -> str:
        """An element's picture in Markdown; empty where the client shows none or it cannot be drawn."""
        general = self.client_capabilities.general
        markdown = general.markdown if general is not None else None
        if self._draw is None or markdown is None or "img" not in (markdown.allowed_tags or ()):
            return ""
        if element.digest not in self._drawn:
            if len(self._drawn) >= MAX_DRAWN:
                self._drawn.clear()
            try:
                data = b64encode(self._draw(element)).decode()
                self._drawn[element.digest] = f"\n\n![{element.name}](data:image/png;base64,{data})"
            except Exception:
                log.exception("cannot draw element %s", element.name)
                self._drawn[element.digest] = ""
        return self._drawn[element.digest]

    def publish(self, document: Document) -> None:
        """Send all current diagnostics: those of syntax, and those of the last check, moved."""
        result = [*document.syntax, *document.semantic]
        shown = [d for d in (to_diagnostic(item, document) for item in result) if d is not None]
        params = types.PublishDiagnosticsParams(document.uri, shown, document.version)
        self.text_document_publish_diagnostics(params)

    def schedule(self, document: Document, delay_s: float | None = None) -> None:
        """Check a document once nothing has changed for a while."""
        self.forget(document.uri)
        delay = self.settings.debounce_ms / 1000 if delay_s is None else delay_s
        loop = asyncio.get_running_loop()
        self._timers[document.uri] = loop.call_later(delay, self._start, document.uri)

    def forget(self, uri: str) -> None:
        """Drop the check that waits or runs for a document."""
        if (timer := self._timers.pop(uri, None)) is not None:
            timer.cancel()
        if (stop := self._running.pop(uri, None)) is not None:
            stop.set()

    def _start(self, uri: str) -> None:
        self._timers.pop(uri, None)
        if (document := self.docs.open.get(uri)) is None:
            return
        stop = self._running[uri] = threading.Event()
        loop = asyncio.get_running_loop()
        file, whole = document.file, not document.syntax
        folder = next(iter(self.docs.folders), None)
        root = self.settings.root or (folder if document.path is None else None)
        texts, model = self.docs.texts(), self.settings.model

        def work() -> None:
            if stop.is_set():
                return
            try:
                checked = check(file, document.path, root, texts, model, whole, stop)
            except Halt:
                return
            except Exception:
                log.exception("internal error while checking %s", uri)
                return
            loop.call_soon_threadsafe(self._finish, document, checked, stop)

        self._pool.submit(work)

    def _finish(self, document: Document, checked: Checked, stop: threading.Event) -> None:
        if stop.is_set() or checked.source is not document.source:
            return
        self._running.pop(document.uri, None)
        document.checked, document.edits = checked, []
        document.semantic = checked.diagnostics
        self.publish(document)
        workspace = self.client_capabilities.workspace
        hint = workspace.inlay_hint if workspace is not None else None
        if self.settings.value_hints and hint is not None and hint.refresh_support:
            self.workspace_inlay_hint_refresh(None)

    def changed(self, path: Path | None, but: str = "") -> None:
        """Check again the open buffers whose last evaluation asked for a file."""
        for other in list(self.docs.open.values()):
            if other.uri != but and other.checked is not None and path in other.checked.wanted:
                self.schedule(other)

    def shutdown(self) -> None:
        for uri in list(self.docs.open):
            self.forget(uri)
        self._pool.shutdown(wait=False, cancel_futures=True)
        super().shutdown()  # type: ignore[no-untyped-call]

    def report_server_error(self, error: Exception, source: Any) -> None:
        """Keep trouble in the log: a window that pops up helps nobody."""
        log.error("%s", error)


_FAILED: Final = -32803  # the protocol's RequestFailed


def _watch_files(server: Server, params: types.InitializedParams) -> None:
    """Ask the client to report scene files that change on the disk."""
    workspace = server.client_capabilities.workspace
    watched = workspace.did_change_watched_files if workspace is not None else None
    if watched is None or not watched.dynamic_registration:
        return
    options = types.DidChangeWatchedFilesRegistrationOptions([types.FileSystemWatcher("**/*.nsg")])
    registration = types.Registration("nsg", types.WORKSPACE_DID_CHANGE_WATCHED_FILES, options)
    server.client_register_capability(types.RegistrationParams([registration]))


def _opened(server: Server, params: types.DidOpenTextDocumentParams) -> None:
    item = params.text_document
    document = server.docs.put(item.uri, item.text, item.version)
    server.publish(document)
    server.schedule(document, 0.0)
    server.changed(document.path, item.uri)


def _changed(server: Server, params: types.DidChangeTextDocumentParams) -> None:
    if (document := server.docs.open.get(params.text_document.uri)) is None:
        log.warning("change of a document that is not open: %s", params.text_document.uri)
        return
    for change in params.content_changes:
        document.change(change)
    document.version = params.text_document.version
    server.publish(document)
    server.schedule(document)
    server.changed(document.path, document.uri)


def _saved(server: Server, params: types.DidSaveTextDocumentParams) -> None:
    if (document := server.docs.open.get(params.text_document.uri)) is not None:
        server.schedule(document, 0.0)


def _closed(server: Server, params: types.DidCloseTextDocumentParams) -> None:
    uri = params.text_document.uri
    document = server.docs.open.pop(uri, None)
    server.forget(uri)
    server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))
    if document is not None:
        server.changed(document.path, uri)


def _files_changed(server: Server, params: types.DidChangeWatchedFilesParams) -> None:
    for path in (path_of(change.uri) for change in params.changes):
        if path is not None:
            server.changed(path.resolve())
            server.changed(path)


def _configured(server: Server, params: types.DidChangeConfigurationParams) -> None:
    server.settings = ClientSettings.read(params.settings)
    for document in server.docs.open.values():
        server.schedule(document, 0.0)


def _folders_changed(server: Server, params: types.DidChangeWorkspaceFoldersParams) -> None:
    gone = {path_of(folder.uri) for folder in params.event.removed}
    new = [path_of(folder.uri) for folder in params.event.added]
    left = [folder for folder in server.docs.folders if folder not in gone]
    server.docs.folders = [*left, *(path.resolve() for path in new if path is not None)]


def _completion(server: Server, document: Document, offset: int) -> types.CompletionList:
    text = server.client_capabilities.text_document
    item = text.completion.completion_item if text and text.completion else None
    return completion.complete(server.docs, document, offset, snippets=bool(item and item.snippet_support))


def _rename(server: Server, document: Document, params: types.RenameParams) -> types.WorkspaceEdit | None:
    offset = document.lines.offset(params.position)
    workspace = server.client_capabilities.workspace
    known = workspace.workspace_edit if workspace is not None else None
    versioned = known is not None and bool(known.document_changes)
    return navigation.rename(server.docs, document, offset, params.new_name, versioned)


def _formatted(server: Server, document: Document, place: types.Range | None) -> list[types.TextEdit] | None:
    """Edits that format a text, or the statements of a range; None for one with syntax errors."""
    from scenelang.language.formatting import format_range, format_text

    text, name = document.text, document.source.name
    try:
        if place is None:
            return text_edits(document, format_text(text, name=name))
        low, high = document.lines.offset(place.start), document.lines.offset(place.end)
        start, end, new = format_range(text, low, high, name=name)
        return text_edits(document, text[:start] + new + text[end:])
    except SceneError:
        message = "not formatted: the file has syntax errors"
        server.window_log_message(types.LogMessageParams(types.MessageType.Info, message))
        return None


_SESSION: Final[dict[str, Callable[..., Any]]] = {
    types.INITIALIZE: Server.begin,
    types.INITIALIZED: _watch_files,
    types.SHUTDOWN: lambda server, params: setattr(server, "was_shut_down", True),
    types.TEXT_DOCUMENT_DID_OPEN: _opened,
    types.TEXT_DOCUMENT_DID_CHANGE: _changed,
    types.TEXT_DOCUMENT_DID_SAVE: _saved,
    types.TEXT_DOCUMENT_DID_CLOSE: _closed,
    types.WORKSPACE_DID_CHANGE_WATCHED_FILES: _files_changed,
    types.WORKSPACE_DID_CHANGE_CONFIGURATION: _configured,
    types.WORKSPACE_DID_CHANGE_WORKSPACE_FOLDERS: _folders_changed,
    types.WORKSPACE_SYMBOL: lambda server, params: navigation.workspace_symbols(server.docs, params.query),
}
_AT_PLACE: Final[dict[str, Callable[[Server, Document, int], Any]]] = {
    types.TEXT_DOCUMENT_COMPLETION: _completion,
    types.TEXT_DOCUMENT_SIGNATURE_HELP: lambda s, d, at: context.signature_help(s.docs, d, at),
    types.TEXT_DOCUMENT_HOVER: lambda s, d, at: navigation.hover(s.docs, d, at, s.thumbnail),
    types.TEXT_DOCUMENT_DEFINITION: lambda s, d, at: navigation.definition(s.docs, d, at),
    types.TEXT_DOCUMENT_PREPARE_RENAME: lambda s, d, at: navigation.prepare_rename(s.docs, d, at),
}
_OF_FILE: Final[dict[str, Callable[[Server, Document, Any], Any]]] = {
    types.TEXT_DOCUMENT_RENAME: _rename,
    types.TEXT_DOCUMENT_FORMATTING: lambda s, d, p: _formatted(s, d, None),
    types.TEXT_DOCUMENT_RANGE_FORMATTING: lambda s, d, p: _formatted(s, d, p.range),
    types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL: lambda s, d, p: completion.semantic_tokens(s.docs, d),
    types.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE: lambda s, d, p: completion.semantic_tokens(s.docs, d, p.range),
}
_LISTS: Final[dict[str, Callable[[Server, Document, Any], list[Any]]]] = {
    types.TEXT_DOCUMENT_REFERENCES: lambda s, d, p: navigation.references(
        s.docs, d, d.lines.offset(p.position), p.context.include_declaration
    ),
    types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT: lambda s, d, p: navigation.highlights(
        s.docs, d, d.lines.offset(p.position)
    ),
    types.TEXT_DOCUMENT_SELECTION_RANGE: lambda s, d, p: [
        navigation.selection(d, d.lines.offset(place)) for place in p.positions
    ],
    types.TEXT_DOCUMENT_DOCUMENT_SYMBOL: lambda s, d, p: [*navigation.symbols(d, d.file.statements)],
    types.TEXT_DOCUMENT_FOLDING_RANGE: lambda s, d, p: navigation.folding(d),
    types.TEXT_DOCUMENT_DOCUMENT_COLOR: lambda s, d, p: completion.colours(d),
    types.TEXT_DOCUMENT_COLOR_PRESENTATION: lambda s, d, p: completion.presentations(d, p.color, p.range),
    types.TEXT_DOCUMENT_CODE_ACTION: lambda s, d, p: code_actions(d, p.range, p.context.only),
    types.TEXT_DOCUMENT_INLAY_HINT: lambda s, d, p: navigation.inlay_hints(s.docs, d, p.range, s.settings),
    types.TEXT_DOCUMENT_DOCUMENT_LINK: lambda s, d, p: navigation.links(s.docs, d),
}
_OPTIONS: Final = {
    types.TEXT_DOCUMENT_DID_SAVE: types.SaveOptions(include_text=False),
    types.TEXT_DOCUMENT_COMPLETION: types.CompletionOptions(trigger_characters=[*'.(,="/']),
    types.TEXT_DOCUMENT_SIGNATURE_HELP: types.SignatureHelpOptions(
        trigger_characters=["(", ","], retrigger_characters=["=", ")"]
    ),
    types.TEXT_DOCUMENT_CODE_ACTION: types.CodeActionOptions([types.CodeActionKind.QuickFix, FIX_ALL]),
    types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL: completion.LEGEND,
    types.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE: completion.LEGEND,
    types.TEXT_DOCUMENT_INLAY_HINT: types.InlayHintOptions(resolve_provider=False),
}


def _answer(server: Server, method: str, params: Any) -> Any:
    if method in _SESSION:
        return _SESSION[method](server, params)
    if (document := server.docs.get(params.text_document.uri)) is None:
        return [] if method in _LISTS else None
    if method in _AT_PLACE:
        return _AT_PLACE[method](server, document, document.lines.offset(params.position))
    return (_LISTS.get(method) or _OF_FILE[method])(server, document, params)


def _handler(method: str) -> Callable[[Server, Any], Any]:
    """The handler of a method for pygls; a failure leaves the editor without an answer and is logged."""

    def handle(ls: Server, params: Any) -> Any:
        try:
            return _answer(ls, method, params)
        except navigation.RenameRefused as reason:
            raise JsonRpcException(str(reason), _FAILED) from None
        except JsonRpcException:
            raise
        except Exception as error:
            log.exception("internal error in %s", method)
            message = f"internal error in {method}: {error!r}"
            ls.window_log_message(types.LogMessageParams(types.MessageType.Error, message))
            return [] if method in _LISTS else None

    return handle


def make_server(draw: Callable[[Element], bytes] | None = None) -> Server:
    """A server with all its features; ``draw`` makes a small PNG of an element."""
    server = Server(draw)
    for method in (*_SESSION, *_AT_PLACE, *_OF_FILE, *_LISTS):
        server.feature(method, _OPTIONS.get(method))(_handler(method))
    return server
