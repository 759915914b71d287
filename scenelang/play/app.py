"""The server: what it holds, and which address answers what."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import mimetypes
import re
import secrets
from collections.abc import AsyncIterator, Coroutine
from importlib.resources import files
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from scenelang.backend.options import usable_cores
from scenelang.evaluate.limits import MAX_BYTES
from scenelang.play.folder import Folder
from scenelang.play.guard import Guard, policy
from scenelang.play.journal import Journal
from scenelang.play.language import bridge
from scenelang.play.live import Live
from scenelang.play.made import Files
from scenelang.play.messages import MOST_SIDE
from scenelang.play.pool import Pool
from scenelang.play.watch import watch

log = logging.getLogger("scenelang.play")
MOST_PAGES: Final = 8
_KINDS: Final = {".js": "text/javascript", ".css": "text/css", ".html": "text/html", ".nsg": "text/plain"}
_STATIC: Final = re.compile(r"(?:(viewer|examples)/)?([A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)+)")
_FROM: Final = {"": "play/web", "viewer": "viewer/web", "examples": "play/web/examples"}


class Play:
    """What all pages of a server share.

    Args:
        folder: the scenes.
        first: the one to show at first.
        journal: keeps what is not saved.
    """

    def __init__(self, folder: Folder, first: str | None = None, journal: Journal | None = None) -> None:
        self.folder, self.first = folder, first
        self.journal = journal if journal is not None else Journal()
        self.quick = Pool(most=max(3, usable_cores()), warm=2)  # what is looked at while typing
        self.slow = Pool(most=2, warm=0, nice=10)
        self.store = Files()
        self.pages: set[Live] = set()
        self._tasks: set[asyncio.Future[Any]] = set()
        self._listed: list[str] | None = None
        self._languages = 0

    @contextlib.asynccontextmanager
    async def running(self, _: object = None) -> AsyncIterator[None]:
        """Within it processes wait for jobs, and the folder is watched."""
        self.quick.start()
        self.later(asyncio.to_thread(self.journal.tidy))
        stop = asyncio.Event()
        self.later(watch(self, stop))
        try:
            yield
        finally:
            stop.set()
            for task in list(self._tasks):
                task.cancel()
            await asyncio.gather(*self._tasks, return_exceptions=True)
            await self.quick.close()
            await self.slow.close()

    def later(self, work: Coroutine[Any, Any, Any]) -> None:
        """Do something beside all else."""

        def ended(task: asyncio.Future[Any]) -> None:
            self._tasks.discard(task)
            if not task.cancelled() and (error := task.exception()) is not None:
                log.error("%r", error)

        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(ended)

    # ------------------------------------------------------------ files

    async def files(self) -> dict[str, Any]:
        """The message that lists what there is."""
        self._listed = await asyncio.to_thread(self.folder.names)
        return {
            "kind": "files",
            "files": self._listed,
            "examples": _examples(),
            "folder": self.folder.path.name,
            "open": self.first if self.first is not None else next(iter(self._listed), None),
            "uri": f"{self.folder.path.as_uri()}/",
            "most": {"bytes": MAX_BYTES, "side": MOST_SIDE},
        }

    async def refresh(self) -> None:
        """Tell all pages what there is, if that has changed."""
        before = self._listed
        message = await self.files()
        if self._listed != before:
            for page in self.pages:
                page.tell(message)

    async def write(self, name: str, text: str, base: str | None, page: Live) -> str:
        """Write a file for a page, and tell the others; raises as `Folder.write`."""
        disk = await asyncio.to_thread(self.folder.write, name, text, base)
        for other in self.pages:
            if other is not page:
                other.changed(name, text, disk)
        if self._listed is not None and name not in self._listed:
            await self.refresh()
        return disk

    def keep(self, path: Path, text: str, saved: str, disk: str | None) -> None:
        """Keep a text that is not saved; where it is, forget what was kept."""
        try:
            if text == saved:
                self.journal.drop(path)
            else:
                self.journal.keep(path, text, disk)
        except OSError as error:
            log.warning("unsaved text is not kept: %s", error)

    # ------------------------------------------------------------ addresses

    async def page(self, request: Request) -> Response:
        """The page itself."""
        nonce = secrets.token_urlsafe(16)
        text = files("scenelang").joinpath("play/web/play.html").read_text("utf-8")
        headers = {"Content-Security-Policy": policy(nonce, request.headers["host"])}
        return Response(text.replace("__NONCE__", nonce), media_type="text/html", headers=headers)

    async def static(self, request: Request) -> Response:
        """A file of the package."""
        found = _STATIC.fullmatch(request.path_params["name"])
        place = files("scenelang").joinpath(_FROM[found[1] or ""], found[2]) if found is not None else None
        if place is None or not place.is_file():
            return PlainTextResponse("There is no such file.\n", 404)
        suffix = Path(place.name).suffix
        kind = _KINDS.get(suffix) or mimetypes.guess_type(place.name)[0] or "application/octet-stream"
        return Response(place.read_bytes(), media_type=kind)

    async def download(self, request: Request) -> Response:
        """A file that was made for the page."""
        found = self.store.take(request.query_params.get("key", ""))
        if found is None:
            return PlainTextResponse("There is no such file any more.\n", 404)
        name, kind, data = found
        headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(Path(name).name, safe='')}"}
        return Response(data, media_type=kind, headers=headers)

    async def live(self, socket: WebSocket) -> None:
        """A page."""
        if len(self.pages) >= MOST_PAGES:
            await socket.close(1013, f"more than {MOST_PAGES} pages")
            return
        page = Live(self, socket)
        self.pages.add(page)
        try:
            await page.run()
        finally:
            self.pages.discard(page)

    async def language(self, socket: WebSocket) -> None:
        """The language server of a page."""
        if self._languages >= MOST_PAGES:
            await socket.close(1013, f"more than {MOST_PAGES} pages")
            return
        self._languages += 1
        try:
            await bridge(socket, self.folder)
        finally:
            self._languages -= 1

    def app(self) -> Starlette:
        """Without a guard."""
        routes = [
            Route("/", self.page),
            Route("/static/{name:path}", self.static),
            Route("/download", self.download),
            WebSocketRoute("/live", self.live),
            WebSocketRoute("/lsp", self.language),
        ]
        return Starlette(routes=routes, lifespan=self.running)

    def guarded(self, token: str, hosts: tuple[str, ...] = (), anywhere: bool = False) -> Guard:
        """With one; arguments as of `Guard`."""
        app: ASGIApp = self.app()
        return Guard(app, token, hosts, anywhere)


def _examples() -> list[str]:
    """Scenes that come with the page."""
    folder = files("scenelang").joinpath(_FROM["examples"])
    return (
        sorted(place.name for place in folder.iterdir() if place.name.endswith(".nsg"))
        if folder.is_dir()
        else []
    )
