"""Which function answers which request."""

from __future__ import annotations

import logging
from typing import Any, Final

from lsprotocol import types
from pygls.exceptions import JsonRpcException

from scenelang.diagnostics.error import SceneError
from scenelang.lsp import (
    actions,
    colours,
    completion,
    hints,
    hover,
    navigation,
    outline,
    signatures,
    tokens,
)
from scenelang.lsp.server import Server, quiet
from scenelang.lsp.settings import Settings
from scenelang.lsp.workspace import Document, path_of

log = logging.getLogger("scenelang.lsp")
_FAILED: Final = -32803  # the protocol's RequestFailed


def _at(server: Server, params: Any) -> tuple[Document, int] | None:
    """The document and the offset that a request is about."""
    document = server.docs.get(params.text_document.uri)
    return None if document is None else (document, document.lines.offset(params.position))


# ---------------------------------------------------------------- the life of a session


@quiet()
def begin(server: Server, params: types.InitializeParams) -> None:
    server.begin(params)


@quiet()
def shut_down(server: Server, params: None) -> None:
    server.was_shut_down = True


@quiet()
def watch_files(server: Server, params: types.InitializedParams) -> None:
    """Ask to be told of scene files that change on the disk."""
    workspace = server.client_capabilities.workspace
    watched = workspace.did_change_watched_files if workspace is not None else None
    if watched is None or not watched.dynamic_registration:
        return
    options = types.DidChangeWatchedFilesRegistrationOptions([types.FileSystemWatcher("**/*.nsg")])
    registration = types.Registration("nsg", types.WORKSPACE_DID_CHANGE_WATCHED_FILES, options)
    server.client_register_capability(types.RegistrationParams([registration]))


@quiet()
def opened(server: Server, params: types.DidOpenTextDocumentParams) -> None:
    item = params.text_document
    document = server.docs.put(item.uri, item.text, item.version)
    server.publish(document)
    server.schedule(document, 0.0)
    server.changed(document.path, item.uri)


@quiet()
def changed(server: Server, params: types.DidChangeTextDocumentParams) -> None:
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


@quiet()
def saved(server: Server, params: types.DidSaveTextDocumentParams) -> None:
    document = server.docs.open.get(params.text_document.uri)
    if document is not None:
        server.schedule(document, 0.0)


@quiet()
def closed(server: Server, params: types.DidCloseTextDocumentParams) -> None:
    uri = params.text_document.uri
    document = server.docs.open.get(uri)
    server.forget(uri)
    server.docs.close(uri)
    server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))
    if document is not None:
        server.changed(document.path, uri)


@quiet()
def files_changed(server: Server, params: types.DidChangeWatchedFilesParams) -> None:
    for change in params.changes:
        path = path_of(change.uri)
        if path is not None:
            server.changed(path.resolve())
            server.changed(path)


@quiet()
def configured(server: Server, params: types.DidChangeConfigurationParams) -> None:
    server.settings = Settings.read(params.settings)
    for document in server.docs.open.values():
        server.schedule(document, 0.0)


@quiet()
def folders_changed(server: Server, params: types.DidChangeWorkspaceFoldersParams) -> None:
    gone = {path_of(folder.uri) for folder in params.event.removed}
    new = [path_of(folder.uri) for folder in params.event.added]
    kept = [folder for folder in server.docs.folders if folder not in gone]
    server.docs.folders = [*kept, *(path.resolve() for path in new if path is not None)]


# ---------------------------------------------------------------- requests at a place


@quiet()
def on_completion(server: Server, params: types.CompletionParams) -> types.CompletionList | None:
    at = _at(server, params)
    if at is None:
        return None
    text = server.client_capabilities.text_document
    item = text.completion.completion_item if text and text.completion else None
    return completion.complete(server.docs, *at, snippets=bool(item and item.snippet_support))


@quiet()
def on_signature(server: Server, params: types.SignatureHelpParams) -> types.SignatureHelp | None:
    at = _at(server, params)
    return signatures.signature_help(server.docs, *at) if at else None


@quiet()
def on_hover(server: Server, params: types.HoverParams) -> types.Hover | None:
    at = _at(server, params)
    return hover.hover(server.docs, *at) if at else None


@quiet()
def on_definition(server: Server, params: types.DefinitionParams) -> types.Location | None:
    at = _at(server, params)
    return navigation.definition(server.docs, *at) if at else None


@quiet(())
def on_references(server: Server, params: types.ReferenceParams) -> list[types.Location]:
    at = _at(server, params)
    return navigation.references(server.docs, *at, params.context.include_declaration) if at else []


@quiet(())
def on_highlight(server: Server, params: types.DocumentHighlightParams) -> list[types.DocumentHighlight]:
    at = _at(server, params)
    return navigation.highlights(server.docs, *at) if at else []


@quiet()
def on_prepare(server: Server, params: types.PrepareRenameParams) -> types.PrepareRenamePlaceholder | None:
    at = _at(server, params)
    try:
        return navigation.prepare_rename(server.docs, *at) if at else None
    except navigation.Refused as reason:
        raise JsonRpcException(str(reason), _FAILED) from None


@quiet()
def on_rename(server: Server, params: types.RenameParams) -> types.WorkspaceEdit | None:
    at = _at(server, params)
    if at is None:
        return None
    try:
        edit = navigation.rename(server.docs, *at, params.new_name)
    except navigation.Refused as reason:
        raise JsonRpcException(str(reason), _FAILED) from None
    workspace = server.client_capabilities.workspace
    known = workspace.workspace_edit if workspace is not None else None
    versioned = known is not None and known.document_changes
    return edit if edit is None or versioned else navigation.plain_edit(edit)


@quiet(())
def on_selection(server: Server, params: types.SelectionRangeParams) -> list[types.SelectionRange]:
    document = server.docs.get(params.text_document.uri)
    if document is None:
        return []
    return [outline.selection(document, document.lines.offset(place)) for place in params.positions]


# ---------------------------------------------------------------- requests for a file


@quiet(())
def on_symbols(server: Server, params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
    document = server.docs.get(params.text_document.uri)
    return outline.document_symbols(document) if document else []


@quiet(())
def on_workspace_symbols(server: Server, params: types.WorkspaceSymbolParams) -> list[types.WorkspaceSymbol]:
    return outline.workspace_symbols(server.docs, params.query)


@quiet(())
def on_folding(server: Server, params: types.FoldingRangeParams) -> list[types.FoldingRange]:
    document = server.docs.get(params.text_document.uri)
    return outline.folding(document) if document else []


@quiet(())
def on_colours(server: Server, params: types.DocumentColorParams) -> list[types.ColorInformation]:
    document = server.docs.get(params.text_document.uri)
    return colours.colours(document) if document else []


@quiet(())
def on_presentation(server: Server, params: types.ColorPresentationParams) -> list[types.ColorPresentation]:
    document = server.docs.get(params.text_document.uri)
    return colours.presentations(document, params.color, params.range) if document else []


@quiet(())
def on_actions(server: Server, params: types.CodeActionParams) -> list[types.CodeAction]:
    document = server.docs.get(params.text_document.uri)
    return actions.code_actions(document, params.range, params.context.only) if document else []


@quiet()
def on_formatting(server: Server, params: types.DocumentFormattingParams) -> list[types.TextEdit] | None:
    return _formatted(server, params.text_document.uri, None)


@quiet()
def on_range_formatting(
    server: Server, params: types.DocumentRangeFormattingParams
) -> list[types.TextEdit] | None:
    return _formatted(server, params.text_document.uri, params.range)


def _formatted(server: Server, uri: str, place: types.Range | None) -> list[types.TextEdit] | None:
    document = server.docs.get(uri)
    try:
        return actions.formatted(document, place) if document else None
    except SceneError:
        message = "not formatted: the file has syntax errors"
        server.window_log_message(types.LogMessageParams(types.MessageType.Info, message))
        return None


@quiet()
def on_tokens(server: Server, params: types.SemanticTokensParams) -> types.SemanticTokens | None:
    document = server.docs.get(params.text_document.uri)
    return types.SemanticTokens(tokens.semantic_tokens(server.docs, document)) if document else None


@quiet()
def on_tokens_range(server: Server, params: types.SemanticTokensRangeParams) -> types.SemanticTokens | None:
    document = server.docs.get(params.text_document.uri)
    if document is None:
        return None
    return types.SemanticTokens(tokens.semantic_tokens(server.docs, document, params.range))


@quiet(())
def on_hints(server: Server, params: types.InlayHintParams) -> list[types.InlayHint]:
    document = server.docs.get(params.text_document.uri)
    return hints.inlay_hints(server.docs, document, params.range, server.settings) if document else []


@quiet(())
def on_links(server: Server, params: types.DocumentLinkParams) -> list[types.DocumentLink]:
    document = server.docs.get(params.text_document.uri)
    return navigation.links(server.docs, document) if document else []


_HANDLERS: Final = (
    (types.INITIALIZE, begin, None),
    (types.INITIALIZED, watch_files, None),
    (types.SHUTDOWN, shut_down, None),
    (types.TEXT_DOCUMENT_DID_OPEN, opened, None),
    (types.TEXT_DOCUMENT_DID_CHANGE, changed, None),
    (types.TEXT_DOCUMENT_DID_SAVE, saved, types.SaveOptions(include_text=False)),
    (types.TEXT_DOCUMENT_DID_CLOSE, closed, None),
    (types.WORKSPACE_DID_CHANGE_WATCHED_FILES, files_changed, None),
    (types.WORKSPACE_DID_CHANGE_CONFIGURATION, configured, None),
    (types.WORKSPACE_DID_CHANGE_WORKSPACE_FOLDERS, folders_changed, None),
    (
        types.TEXT_DOCUMENT_COMPLETION,
        on_completion,
        types.CompletionOptions(trigger_characters=[".", "(", ",", "=", '"', "/"]),
    ),
    (
        types.TEXT_DOCUMENT_SIGNATURE_HELP,
        on_signature,
        types.SignatureHelpOptions(trigger_characters=["(", ","], retrigger_characters=["=", ")"]),
    ),
    (types.TEXT_DOCUMENT_HOVER, on_hover, None),
    (types.TEXT_DOCUMENT_DEFINITION, on_definition, None),
    (types.TEXT_DOCUMENT_REFERENCES, on_references, None),
    (types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT, on_highlight, None),
    (types.TEXT_DOCUMENT_PREPARE_RENAME, on_prepare, None),
    (types.TEXT_DOCUMENT_RENAME, on_rename, None),
    (types.TEXT_DOCUMENT_SELECTION_RANGE, on_selection, None),
    (types.TEXT_DOCUMENT_DOCUMENT_SYMBOL, on_symbols, None),
    (types.WORKSPACE_SYMBOL, on_workspace_symbols, None),
    (types.TEXT_DOCUMENT_FOLDING_RANGE, on_folding, None),
    (types.TEXT_DOCUMENT_DOCUMENT_COLOR, on_colours, None),
    (types.TEXT_DOCUMENT_COLOR_PRESENTATION, on_presentation, None),
    (
        types.TEXT_DOCUMENT_CODE_ACTION,
        on_actions,
        types.CodeActionOptions([types.CodeActionKind.QuickFix, actions.FIX_ALL]),
    ),
    (types.TEXT_DOCUMENT_FORMATTING, on_formatting, None),
    (types.TEXT_DOCUMENT_RANGE_FORMATTING, on_range_formatting, None),
    (types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, on_tokens, tokens.LEGEND),
    (types.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE, on_tokens_range, tokens.LEGEND),
    (types.TEXT_DOCUMENT_INLAY_HINT, on_hints, types.InlayHintOptions(resolve_provider=False)),
    (types.TEXT_DOCUMENT_DOCUMENT_LINK, on_links, None),
)


def make_server() -> Server:
    """A server with all its features."""
    server = Server()
    for method, handler, options in _HANDLERS:
        server.feature(method, options)(handler)
    return server
