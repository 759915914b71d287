"""The functions that answer requests."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, Final

from lsprotocol import types
from pygls.exceptions import JsonRpcException

from scenelang.assets.element import Element
from scenelang.editors import completion, context, hover, navigation
from scenelang.editors.server import FIX_ALL, Server, Settings, code_actions, formatted
from scenelang.editors.workspace import Document, path_of
from scenelang.language.reports import SceneError

log = logging.getLogger("scenelang.lsp")
_FAILED: Final = -32803  # the protocol's RequestFailed


# ---------------------------------------------------------------- the life of a session


def _shut_down(server: Server, params: None) -> None:
    server.was_shut_down = True


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
    document = server.docs.open.get(params.text_document.uri)
    if document is None:
        log.warning("change of a document that is not open: %s", params.text_document.uri)
        return
    for change in params.content_changes:
        document.change(change)
    document.version = params.text_document.version
    server.publish(document)
    server.schedule(document)
    server.changed(document.path, document.uri)


def _saved(server: Server, params: types.DidSaveTextDocumentParams) -> None:
    document = server.docs.open.get(params.text_document.uri)
    if document is not None:
        server.schedule(document, 0.0)


def _closed(server: Server, params: types.DidCloseTextDocumentParams) -> None:
    uri = params.text_document.uri
    document = server.docs.open.pop(uri, None)
    server.forget(uri)
    server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))
    if document is not None:
        server.changed(document.path, uri)


def _files_changed(server: Server, params: types.DidChangeWatchedFilesParams) -> None:
    for change in params.changes:
        path = path_of(change.uri)
        if path is not None:
            server.changed(path.resolve())
            server.changed(path)


def _configured(server: Server, params: types.DidChangeConfigurationParams) -> None:
    server.settings = Settings.read(params.settings)
    for document in server.docs.open.values():
        server.schedule(document, 0.0)


def _folders_changed(server: Server, params: types.DidChangeWorkspaceFoldersParams) -> None:
    gone = {path_of(folder.uri) for folder in params.event.removed}
    new = [path_of(folder.uri) for folder in params.event.added]
    left = [folder for folder in server.docs.folders if folder not in gone]
    server.docs.folders = [*left, *(path.resolve() for path in new if path is not None)]


# ---------------------------------------------------------------- requests


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
    try:
        return formatted(document, place)
    except SceneError:
        message = "not formatted: the file has syntax errors"
        server.window_log_message(types.LogMessageParams(types.MessageType.Info, message))
        return None


def _tokens(server: Server, document: Document, place: types.Range | None) -> types.SemanticTokens:
    return types.SemanticTokens(completion.semantic_tokens(server.docs, document, place))


_SESSION: Final[dict[str, Callable[..., Any]]] = {
    types.INITIALIZE: Server.begin,
    types.INITIALIZED: _watch_files,
    types.SHUTDOWN: _shut_down,
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
    types.TEXT_DOCUMENT_HOVER: lambda s, d, at: hover.hover(s.docs, d, at, s.thumbnail),
    types.TEXT_DOCUMENT_DEFINITION: lambda s, d, at: navigation.definition(s.docs, d, at),
    types.TEXT_DOCUMENT_PREPARE_RENAME: lambda s, d, at: navigation.prepare_rename(s.docs, d, at),
}
_OF_FILE: Final[dict[str, Callable[[Server, Document, Any], Any]]] = {
    types.TEXT_DOCUMENT_RENAME: _rename,
    types.TEXT_DOCUMENT_FORMATTING: lambda s, d, p: _formatted(s, d, None),
    types.TEXT_DOCUMENT_RANGE_FORMATTING: lambda s, d, p: _formatted(s, d, p.range),
    types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL: lambda s, d, p: _tokens(s, d, None),
    types.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE: lambda s, d, p: _tokens(s, d, p.range),
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
    types.TEXT_DOCUMENT_DOCUMENT_SYMBOL: lambda s, d, p: navigation.document_symbols(d),
    types.TEXT_DOCUMENT_FOLDING_RANGE: lambda s, d, p: navigation.folding(d),
    types.TEXT_DOCUMENT_DOCUMENT_COLOR: lambda s, d, p: completion.colours(d),
    types.TEXT_DOCUMENT_COLOR_PRESENTATION: lambda s, d, p: completion.presentations(d, p.color, p.range),
    types.TEXT_DOCUMENT_CODE_ACTION: lambda s, d, p: code_actions(d, p.range, p.context.only),
    types.TEXT_DOCUMENT_INLAY_HINT: lambda s, d, p: hover.inlay_hints(s.docs, d, p.range, s.settings),
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
    document = server.docs.get(params.text_document.uri)
    if document is None:
        return [] if method in _LISTS else None
    if method in _AT_PLACE:
        return _AT_PLACE[method](server, document, document.lines.offset(params.position))
    return (_LISTS.get(method) or _OF_FILE[method])(server, document, params)


def _handler(method: str) -> Callable[[Server, Any], Any]:
    """The handler of a method for pygls; a failure leaves the editor without an answer and is logged."""

    def handle(ls: Server, params: Any) -> Any:
        try:
            return _answer(ls, method, params)
        except navigation.Refused as reason:
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
    """A server with all its features.

    Args:
        draw: makes a small PNG of an element.
    """
    server = Server(draw)
    for method in (*_SESSION, *_AT_PLACE, *_OF_FILE, *_LISTS):
        server.feature(method, _OPTIONS.get(method))(_handler(method))
    return server
