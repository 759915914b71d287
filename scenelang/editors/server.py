"""The language server: one client's session, its checks, diagnostics, fixes and formatting.

Syntax is checked at once, in the loop that reads messages. Evaluation waits until the typing pauses and runs
on a thread of its own; its result is dropped where the text has changed meanwhile.
"""

from __future__ import annotations

import asyncio
import logging
import re
import sys
import threading
from base64 import b64encode
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from difflib import SequenceMatcher
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, BinaryIO, Final

from lsprotocol import types
from pygls.exceptions import JsonRpcException, JsonRpcInvalidRequest
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol
from pygls.protocol.language_server import lsp_method

from scenelang.assets.element import Element
from scenelang.assets.records import Record
from scenelang.editors.workspace import (
    Checked,
    Document,
    Lines,
    Superseded,
    Workspace,
    check,
    difference,
    path_of,
    uri_of,
)
from scenelang.language import pages, tree
from scenelang.language.diagnostics import Diagnostic, Span, apply_fixes
from scenelang.language.pages import CODES


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
    imports = [stmt for stmt in document.file.statements if isinstance(stmt, tree.Import)]
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
_MOST_LINES: Final = 4000  # of a difference that is compared line by line


def code_actions(
    document: Document, place: types.Range, only: Sequence[str] | None
) -> list[types.CodeAction]:
    """Code actions for the mistakes in a range: of the kinds asked for, or of all."""
    lines = document.lines
    start, end = lines.offset(place.start), lines.offset(place.end)
    result = [*document.syntax, *document.semantic]
    here = [
        d
        for d in result
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
        actions += _fix_all(document, result)
    return actions


def _wants(only: Sequence[str] | None, kind: str) -> bool:
    """True where a kind is asked for; `source` asks for `source.fixAll` too."""
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


def _fix_all(document: Document, diagnostics: Sequence[Diagnostic]) -> list[types.CodeAction]:
    text, done = apply_fixes(document.text, [d for d in diagnostics if _is_ours(document, d)])
    if not done or text == document.text:
        return []
    title = f"Fix all {len(done)} mistakes with a safe fix" if len(done) > 1 else "Fix the mistake"
    edit = types.WorkspaceEdit(changes={document.uri: text_edits(document, text)})
    return [types.CodeAction(title, kind=FIX_ALL, edit=edit)]


# ---------------------------------------------------------------- formatting


def formatted(document: Document, place: types.Range | None = None) -> list[types.TextEdit]:
    """Edits that format a text, or the statements that a range touches.

    Raises:
        SceneError: the text has syntax errors.
    """
    from scenelang.language.formatting import format_range, format_text

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


log = logging.getLogger("scenelang.lsp")
_DEEP: Final = 10_000  # trees are up to 200 levels deep, walks take a few calls a level
MAX_PAUSE_MS: Final = 60_000
MAX_DRAWN: Final = 100  # thumbnails that are cached
_LENGTH: Final = re.compile(rb"Content-Length: *(\d+)\r\n\Z")
_MOST_DIGITS: Final = 8  # below 100 MB: the largest text there may be, each character escaped
_CHUNK: Final = 1 << 16
_LONGEST: Final = 64  # bytes of a header that counts


class Settings(Record):
    """Settings of the client, from ``initializationOptions`` or ``workspace/didChangeConfiguration``.

    Args:
        debounce_ms: pause in typing after which a scene is evaluated.
        model: draw with this model instead of the scene's.
        root: the folder that imports cannot leave, instead of the scene's.
    """

    debounce_ms: float = 200.0
    model: str | None = None
    root: Path | None = None
    value_hints: bool = True
    argument_hints: bool = True

    @classmethod
    def read(cls, options: Any) -> Settings:
        """Read a client's settings; one that is missing, of another type or out of range has its default."""
        given = options.get("scenelang", options) if isinstance(options, dict) else None
        if not isinstance(given, dict):
            return cls()
        hints = given.get("inlayHints")
        hints = hints if isinstance(hints, dict) else {}
        pause, model, root = given.get("debounceMs"), given.get("model"), given.get("root")
        if isinstance(pause, bool) or not isinstance(pause, int | float) or not 0 <= pause <= MAX_PAUSE_MS:
            pause = cls().debounce_ms
        return cls(
            debounce_ms=float(pause),
            model=model if isinstance(model, str) and model else None,
            root=Path(root).expanduser() if isinstance(root, str) and root else None,
            value_hints=hints.get("values") is not False,
            argument_hints=hints.get("arguments") is not False,
        )


class Incoming:
    """A stream that skips messages of 100 MB and more, up to the next one's header.

    No JSON holds a line that ends like a header, as newlines in strings are escaped. ``refuse`` is called for
    each skipped message, from the thread that reads.
    """

    def __init__(self, stream: BinaryIO, refuse: Callable[[], None]) -> None:
        self._stream, self._refuse = stream, refuse

    def readline(self) -> bytes:
        """A line of a header; empty at the end."""
        line = b""
        while True:
            piece = self._stream.readline(_CHUNK)
            line = line[-_LONGEST:] + piece
            if not piece or piece.endswith(b"\n"):
                break
        length = _LENGTH.search(line)
        if length is None or len(length[1]) <= _MOST_DIGITS:
            return line if length is None else length[0]
        self._refuse()
        return b"\n"

    def read(self, size: int) -> bytes:
        """A message."""
        return self._stream.read(size)


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

    @lsp_method(types.INITIALIZE)
    def lsp_initialize(self, params: types.InitializeParams) -> Any:
        if self._workspace is not None:
            raise JsonRpcInvalidRequest("the server is initialized already")
        return (yield from super().lsp_initialize(params))

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
        self.settings = Settings()
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
        self.settings = Settings.read(params.initialization_options)

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

    def serve(self, source: BinaryIO, answers: BinaryIO) -> None:
        """Answer one client until it is gone."""
        error = {"code": JsonRpcInvalidRequest.CODE, "message": "a message of 100 MB or more"}
        refused = {"jsonrpc": self.protocol.VERSION, "id": None, "error": error}
        incoming = Incoming(source, lambda: self.protocol._send_data(refused))
        self.start_io(incoming, answers)  # type: ignore[arg-type]  # it has what is called

    # ------------------------------------------------------------ diagnostics

    def publish(self, document: Document) -> None:
        """Send all current diagnostics: those of syntax, and those of the last check, moved."""
        result = [*document.syntax, *document.semantic]
        shown = [d for d in (to_diagnostic(item, document) for item in result) if d is not None]
        self.text_document_publish_diagnostics(
            types.PublishDiagnosticsParams(document.uri, shown, document.version)
        )

    def schedule(self, document: Document, delay_s: float | None = None) -> None:
        """Check a document once nothing has changed for a while."""
        self.forget(document.uri)
        delay = self.settings.debounce_ms / 1000 if delay_s is None else delay_s
        loop = asyncio.get_running_loop()
        self._timers[document.uri] = loop.call_later(delay, self._start, document.uri)

    def forget(self, uri: str) -> None:
        """Drop the check that waits or runs for a document."""
        timer = self._timers.pop(uri, None)
        if timer is not None:
            timer.cancel()
        stop = self._running.pop(uri, None)
        if stop is not None:
            stop.set()

    def _start(self, uri: str) -> None:
        self._timers.pop(uri, None)
        document = self.docs.open.get(uri)
        if document is None:
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
            except Superseded:
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
