"""Which address answers what."""

from __future__ import annotations

import asyncio
import contextlib
import mimetypes
import re
import secrets
from collections.abc import AsyncIterator, Awaitable, Callable
from importlib.resources import files
from pathlib import Path
from typing import Final
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from scenelang.play.guard import policy
from scenelang.play.language import Languages
from scenelang.play.live import Live
from scenelang.play.shared import Play
from scenelang.play.watch import watch

MOST_PAGES: Final = 8
_KINDS: Final = {".js": "text/javascript", ".css": "text/css", ".html": "text/html", ".nsg": "text/plain"}
_STATIC: Final = re.compile(r"(?:(viewer|examples)/)?([A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)+)")
_FROM: Final = {None: "play/web", "viewer": "viewer/web", "examples": "play/web/examples"}


def make_app(play: Play) -> Starlette:
    """The server, without a guard; while it runs processes wait for jobs and the folder is watched."""

    languages = Languages(play.folder)

    async def page(request: Request) -> Response:
        nonce = secrets.token_urlsafe(16)
        text = files("scenelang").joinpath("play/web/play.html").read_text("utf-8")
        headers = {"Content-Security-Policy": policy(nonce, request.headers["host"])}
        return Response(text.replace("__NONCE__", nonce), media_type="text/html", headers=headers)

    async def download(request: Request) -> Response:
        found = play.store.take(request.query_params.get("key", ""))
        if found is None:
            return PlainTextResponse("There is no such file any more.\n", 404)
        name, kind, data = found
        headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(name, safe='')}"}
        return Response(data, media_type=kind, headers=headers)

    async def live(socket: WebSocket) -> None:
        connection = Live(play, socket)
        play.pages.add(connection)
        try:
            await connection.run()
        finally:
            play.pages.discard(connection)

    @contextlib.asynccontextmanager
    async def running(_: Starlette) -> AsyncIterator[None]:
        stop = asyncio.Event()
        play.quick.start()
        play.views.start()
        languages.start()
        play.later(asyncio.to_thread(play.journal.tidy))
        play.later(watch(play, stop))
        try:
            yield
        finally:
            stop.set()
            await languages.close()
            await play.close()

    routes = [
        Route("/", page),
        Route("/static/{name:path}", _static),
        Route("/download", download),
        WebSocketRoute("/live", _few(live)),
        WebSocketRoute("/lsp", _few(languages.serve)),
    ]
    return Starlette(routes=routes, lifespan=running)


async def _static(request: Request) -> Response:
    """A file of the package."""
    found = _STATIC.fullmatch(request.path_params["name"])
    place = files("scenelang").joinpath(_FROM[found[1]], found[2]) if found is not None else None
    if place is None or not place.is_file():
        return PlainTextResponse("There is no such file.\n", 404)
    kind = _KINDS.get(Path(place.name).suffix) or mimetypes.guess_type(place.name)[0]
    return Response(place.read_bytes(), media_type=kind or "application/octet-stream")


def _few(answer: Callable[[WebSocket], Awaitable[None]]) -> Callable[[WebSocket], Awaitable[None]]:
    """What refuses a connection where there are `MOST_PAGES` already."""
    count = 0

    async def counted(socket: WebSocket) -> None:
        nonlocal count
        if count >= MOST_PAGES:
            await socket.close(1013, f"more than {MOST_PAGES} pages")
            return
        count += 1
        try:
            await answer(socket)
        finally:
            count -= 1

    return counted
