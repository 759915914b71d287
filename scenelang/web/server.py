"""`scenelang play`: a local page that edits scenes and shows them.

The page is on this machine, and so is whatever else the browser shows. Another site's page can send requests
here, and by a name that it has point at 127.0.0.1 even read the answers, but knows no token, cannot choose
the ``Host`` of a name that is not its own, and cannot hide its ``Origin``.

docs/architecture.md has its addresses and messages.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import ipaddress
import logging
import mimetypes
import re
import secrets
import socket
import threading
import webbrowser
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from importlib.resources import files
from pathlib import Path
from typing import Final
from urllib.parse import parse_qs, quote

import uvicorn
from starlette.applications import Starlette
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket
from watchfiles import DefaultFilter, awatch

from scenelang.web.folder import Denied
from scenelang.web.language import serve_language
from scenelang.web.live import Live, Play

LOCAL: Final = ("localhost", "127.0.0.1", "::1")
HEADERS: Final = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
_NOTHING: Final = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
_REFUSED: Final = "Refused: open the address that `scenelang play` has printed.\n"


def policy(nonce: str, host: str) -> str:
    """The content policy of the page; ``host`` is its own, with the port."""
    return (
        f"{_NOTHING}; script-src 'self'; style-src 'self' 'nonce-{nonce}'; img-src 'self' data: blob:; "
        f"connect-src 'self' ws://{host}"
    )


class Guard:
    """Middleware that lets requests through that have the token, come from the page and name this machine.

    ``hosts`` are its names besides those of its loopback; ``anywhere`` any IP address is one, too.
    """

    def __init__(self, app: ASGIApp, token: str, hosts: Iterable[str] = (), anywhere: bool = False) -> None:
        self._app, self._token, self._anywhere = app, token, anywhere
        self._hosts = {*LOCAL, *(host.lower() for host in hosts)}
        self._once: str | None = secrets.token_urlsafe(16)

    @property
    def once(self) -> str:
        """A path that leads to the page once: a browser's command line, which others may read, gets this."""
        return f"/open/{self._once}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return

        async def answer(message: Message) -> None:
            if message["type"] in ("http.response.start", "websocket.accept"):
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers[name] = value
                headers.setdefault("Content-Security-Policy", _NOTHING)
            await send(message)

        if self._knows(scope):
            path, query = scope["path"], parse_qs(scope["query_string"].decode("latin-1"))
            first, _, rest = path.removeprefix("/").partition("/")
            asked = _same(query.get("token", [""])[0], self._token)
            once = self._once is not None and _same(path, self.once)
            if once:
                self._once = None
            elif _same(first, self._token) and path != f"/{first}":
                await self._app({**scope, "path": f"/{rest}", "raw_path": None}, receive, answer)
                return
            if once or _same(first, self._token) or (asked and path == "/"):
                await RedirectResponse(f"/{self._token}/", 303)(scope, receive, answer)
                return
            if asked:
                await self._app(scope, receive, answer)
                return
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await PlainTextResponse(_REFUSED, 403)(scope, receive, answer)

    def _knows(self, scope: Scope) -> bool:
        """True where a request names this machine and does not come from another page."""
        headers = Headers(scope=scope)
        host, origin, site = headers.getlist("host"), headers.getlist("origin"), headers.get("sec-fetch-site")
        if len(host) != 1 or not self._is_here(host[0]) or site not in (None, "same-origin", "none"):
            return False
        if not origin:
            return bool(scope["type"] != "websocket")
        return [one.lower() for one in origin] == [f"http://{host[0].lower()}"]

    def _is_here(self, host: str) -> bool:
        """True where a ``Host`` is a name of this machine; its port is checked with the origin."""
        name = re.sub(r":[0-9]+\Z", "", host.lower())
        name = name[1:-1] if name.startswith("[") and name.endswith("]") else name
        if name in self._hosts:
            return True
        try:
            return self._anywhere and bool(ipaddress.ip_address(name))
        except ValueError:
            return False


def _same(one: str, other: str) -> bool:
    """True for equal texts; the time it takes does not depend on where they differ."""
    return secrets.compare_digest(one.encode("utf-8", "replace"), other.encode())


def is_loopback(host: str) -> bool:
    """True for an address that only this machine reaches."""
    try:
        result = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        return False
    return all(ipaddress.ip_address(str(place[4][0]).partition("%")[0]).is_loopback for place in result)


log = logging.getLogger("scenelang.play")
STEP_MS: Final = 30  # without a change, after which changes are reported
PATIENCE_S: Final = 0.3  # a file that is gone, or empty, may be in the middle of being written
SLOW_MS: Final = 1000  # between two polls where the system reports no changes


async def watch(play: Play, stop: asyncio.Event) -> None:
    """Report changes to pages until ``stop``."""
    await asyncio.to_thread(play.folder.names)  # which finds whether it is large
    usual = DefaultFilter()
    for polling in (False, True):
        try:
            changes = awatch(
                play.folder.path,
                watch_filter=lambda change, path: not Path(path).name.startswith(".") and usual(change, path),
                debounce=300,
                step=STEP_MS,
                stop_event=stop,
                recursive=not play.folder.is_large and not polling,
                force_polling=polling or None,
                poll_delay_ms=SLOW_MS,
            )
            async for found in changes:
                play.later(_tell(play, {Path(path) for _, path in found}))
            return
        except (OSError, RuntimeError) as error:
            log.warning("the system does not tell of changes: %s", error)


async def _tell(play: Play, paths: set[Path]) -> None:
    names = {name for path in paths if (name := play.folder.name_of(path)) is not None}
    for name in names:
        if any(name in page.open for page in play.pages):
            await _reread(play, name)
    for page in play.pages:
        for path in paths:
            page.imported(path)
    if names or any(path.is_dir() or not path.exists() for path in paths):
        await play.refresh()


async def _reread(play: Play, name: str) -> None:
    for patient in (False, True):
        async with play.reading:
            try:
                text, disk = await asyncio.to_thread(play.folder.read, name)
            except Denied as error:
                log.warning("%s", error)
                return
            if text or patient:
                for page in play.pages:
                    page.changed(name, text, disk)
                return
        await asyncio.sleep(PATIENCE_S)


MOST_PAGES: Final = 8
_KINDS: Final = {".js": "text/javascript", ".css": "text/css", ".html": "text/html", ".nsg": "text/plain"}
_STATIC: Final = re.compile(r"(?:(viewer|examples)/)?([A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)+)")
_FROM: Final = {None: "web/editor", "viewer": "web/viewer", "examples": "web/editor/examples"}


def make_app(play: Play) -> Starlette:
    """The server, without a guard; while it runs processes wait for jobs and the folder is watched."""

    async def page(request: Request) -> Response:
        nonce = secrets.token_urlsafe(16)
        text = files("scenelang").joinpath("web/editor/play.html").read_text("utf-8")
        headers = {"Content-Security-Policy": policy(nonce, request.headers["host"])}
        return Response(text.replace("__NONCE__", nonce), media_type="text/html", headers=headers)

    async def download(request: Request) -> Response:
        if (result := play.store.take(request.query_params.get("key", ""))) is None:
            return PlainTextResponse("There is no such file any more.\n", 404)
        name, kind, data = result
        headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(name, safe='')}"}
        return Response(data, media_type=kind, headers=headers)

    @contextlib.asynccontextmanager
    async def running(_: Starlette) -> AsyncIterator[None]:
        stop = asyncio.Event()
        play.quick.start()
        play.views.start()
        play.later(asyncio.to_thread(play.journal.tidy))
        play.later(watch(play, stop))
        try:
            yield
        finally:
            stop.set()
            await play.close()

    routes = [
        Route("/", page),
        Route("/static/{name:path}", _static),
        Route("/download", download),
        WebSocketRoute("/live", _few(lambda socket: Live(play, socket).run())),
        WebSocketRoute("/lsp", _few(lambda socket: serve_language(socket, play.folder))),
    ]
    return Starlette(routes=routes, lifespan=running)


async def _static(request: Request) -> Response:
    """A file of the package."""
    result = _STATIC.fullmatch(request.path_params["name"])
    place = files("scenelang").joinpath(_FROM[result[1]], result[2]) if result is not None else None
    if place is None or not place.is_file():
        return PlainTextResponse("There is no such file.\n", 404)
    kind = _KINDS.get(Path(place.name).suffix) or mimetypes.guess_type(place.name)[0]
    return Response(place.read_bytes(), media_type=kind or "application/octet-stream")


def _few(answer: Callable[[WebSocket], Awaitable[None]]) -> Callable[[WebSocket], Awaitable[None]]:
    """An endpoint that refuses a connection where there are `MOST_PAGES` already."""
    connected: set[WebSocket] = set()

    async def counted(socket: WebSocket) -> None:
        if len(connected) >= MOST_PAGES:
            await socket.close(1013, f"more than {MOST_PAGES} pages")
            return
        connected.add(socket)
        try:
            await answer(socket)
        finally:
            connected.discard(socket)

    return counted


PORT: Final = 8766
MOST_MESSAGE: Final = 1 << 25
"""Bytes of a message of the page: the largest text, each character of which may be escaped."""
_TAKEN: Final = {errno.EADDRINUSE: "is in use", errno.EACCES: "may not be used"}


def listen(host: str, port: int | None) -> socket.socket:
    """A listening socket: on the port, or on `PORT` or any other that is free; raises `OSError`."""
    try:
        number = PORT if port is None else port
        family = socket.getaddrinfo(host, number, type=socket.SOCK_STREAM)[0][0]
        return socket.create_server((host, number), family=family)
    except OSError as error:
        if error.errno not in _TAKEN:
            raise OSError(error.errno, f"cannot listen on `{host}`: {error.strerror or error}") from None
        if port is None:
            return listen(host, 0)
        raise OSError(error.errno, f"port {port} of {host} {_TAKEN[error.errno]}") from None


def serve(
    play: Play, host: str, port: int | None, *, browser: bool, say: Callable[[str], None] = print
) -> None:
    """Serve until Ctrl-C, which is raised again when everything has ended; raises as `listen`."""
    token = secrets.token_urlsafe(32)
    with listen(host, port) as listener:
        number = listener.getsockname()[1]
        local = is_loopback(host)
        hosts = () if local else (host, socket.gethostname())
        guard = Guard(make_app(play), token, hosts, anywhere=not local)
        name = host if local or host not in ("0.0.0.0", "::", "") else LOCAL[1]
        name = f"[{name}]" if ":" in name else name
        config = uvicorn.Config(
            guard,
            log_level=logging.WARNING,
            access_log=False,  # which would hold the token
            server_header=False,
            http="h11",
            ws="websockets-sansio",
            ws_max_size=MOST_MESSAGE,
            ws_per_message_deflate=False,
            lifespan="on",
            timeout_graceful_shutdown=2,
        )
        say(f"http://{name}:{number}/{token}/")
        if browser:
            address = f"http://{name}:{number}{guard.once}"
            threading.Timer(0.3, webbrowser.open, (address,)).start()
        uvicorn.Server(config).run(sockets=[listener])
